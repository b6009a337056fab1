//! Figures of the shape space: the paper's Table 2, metric properties, path quality, means, symmetry, registration.

use std::hint::black_box;
use std::time::Instant;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use treewright::base::{Rotation, Seed};
use treewright::blend::Tasks;
use treewright::blend::shape::{
    BinaryTree, Comparison, Metric, Reflection, Size, TreeGeodesic, TreePoint, distance, distance_matrix, frechet_mean,
    variance, weighted_mean,
};
use treewright::plant::{ChainId, Crown, Curve, Plant, PlantBuilder, PlantStats};
use treewright::preset::plan::{ChainPath, ElasticParams, Facing, ImportParams, MatchParams};
use treewright::relate::{
    ElasticCurve, Family, STEPS, ShapePoint, best_path, elastic_family, fuzzy_family, nway_family, register,
};
use treewright::source::import::import;

use crate::table_1::source;
use crate::{Figure, data, seconds};

/// Prints them.
pub(crate) fn print() {
    table_2();
    mean_of_five();
    registration();
    one_family();
    paths();
    quality();
    shrinking();
    symmetry();
    plants();
    sizes();
}

fn straight() -> ElasticParams {
    ElasticParams { path: ChainPath::Straight, ..ElasticParams::default() }
}

/// A row of the paper's Table 2: nodes of source and target, seconds for correspondence and geodesic.
struct Row {
    figure: [&'static str; 2],
    nodes: (usize, usize),
    species: (&'static str, &'static str),
    paper: f64,
}

const ROWS: [Row; 7] = [
    Row { figure: ["space.fig1", "space.fig1_ratio"], nodes: (118, 484), species: ("elm", "oak"), paper: 175.07 },
    Row { figure: ["space.fig6a", "space.fig6a_ratio"], nodes: (362, 226), species: ("oak", "oak"), paper: 200.45 },
    Row { figure: ["space.fig6b", "space.fig6b_ratio"], nodes: (302, 372), species: ("lime", "lime"), paper: 109.09 },
    Row { figure: ["space.fig7a", "space.fig7a_ratio"], nodes: (118, 338), species: ("birch", "elm"), paper: 81.32 },
    Row { figure: ["space.fig7b", "space.fig7b_ratio"], nodes: (118, 430), species: ("poplar", "ash"), paper: 149.64 },
    Row { figure: ["space.fig8", "space.fig8_ratio"], nodes: (28, 790), species: ("oak", "oak"), paper: 664.79 },
    Row { figure: ["space.fig9", "space.fig9_ratio"], nodes: (118, 28), species: ("ash", "lime"), paper: 17.94 },
];

/// A plant of so many nodes: a bifurcation and an end for each branch, a base and an end for the trunk.
fn of_nodes(species: &str, seed: u64, nodes: usize) -> Plant {
    source(species, seed, nodes / 2).without_leaves()
}

/// Everything between two plants: correspondence, both metrics' geodesics, and the tree in the middle of either.
fn geodesic(a: &Plant, b: &Plant) -> (f64, usize) {
    let family = elastic_family(vec![a.clone(), b.clone()], &ElasticParams::default()).expect("they match");
    let point = |s: usize| family.shape_point(&family.corner(s)).expect("the family is elastic");
    let elastic = point(0).distance(&point(1));
    let middle = family.blend(&weighted_mean(&family, &[0.5, 0.5]));
    let way = TreeGeodesic::new(&TreePoint::of(&family, 0), &TreePoint::of(&family, 1));
    let halfway = way.midpoint().plant().expect("a plant");
    (elastic + way.length(), middle.chains().len() + halfway.chains().len())
}

fn table_2() {
    let threads = rayon::current_num_threads();
    for row in &ROWS {
        let (a, b) = (of_nodes(row.species.0, 1, row.nodes.0), of_nodes(row.species.1, 2, row.nodes.1));
        let time = seconds(9, || {
            black_box(geodesic(&a, &b));
        });
        let matched =
            seconds(5, || drop(black_box(elastic_family(vec![a.clone(), b.clone()], &ElasticParams::default()))));
        let how = format!(
            "{} of {} nodes to {} of {}: correspondence ({:.1} ms), elastic and QED geodesics, both midpoints as plants; \
             median of 9, {threads} threads",
            row.species.0,
            2 * a.chains().len(),
            row.species.1,
            2 * b.chains().len(),
            matched * 1e3
        );
        Figure::new(row.figure[0], time * 1e3, "ms", how).goal("<= 60").print();
        let how = format!("times faster than the paper's {} s", row.paper);
        Figure::new(row.figure[1], row.paper / time, "x", how).print();
    }
}

fn mean_of_five() {
    let plants: Vec<Plant> = (1..6).map(|seed| of_nodes("oak", seed, 400)).collect();
    let made = || {
        let family = elastic_family(plants.clone(), &ElasticParams::default()).expect("they match");
        let mean = family.blend(&weighted_mean(&family, &[1.0; 5]));
        (family, mean)
    };
    let time = seconds(5, || drop(black_box(made())));
    let (family, mean) = made();
    let how = format!("five oaks of 400 nodes, {} kins, mean of {} chains", family.kin_count(), mean.chains().len());
    Figure::new("space.mean_of_five", time, "s", how).goal("<= 0.5").print();
    let points: Vec<TreePoint> = (0..5).map(|s| TreePoint::of(&family, s)).collect();
    let time = seconds(5, || drop(black_box(frechet_mean(&points, &[1.0; 5], 10))));
    let how = "Sturm's algorithm in tree-shape space, ten rounds, after the correspondence";
    Figure::new("space.sturm_five", time, "s", how).goal("<= 0.5").print();
    let mean = frechet_mean(&points, &[1.0; 5], 10).expect("there are points");
    let least = variance(&mean, &points, &[1.0; 5]);
    let best = points.iter().map(|p| variance(p, &points, &[1.0; 5])).fold(f64::INFINITY, f64::min);
    let how = "summed squared distance from the mean, over that from the best of the five";
    Figure::new("space.mean_variance", least / best, "", how).goal("< 1").print();
}

/// Exhaustive search over all lattice paths.
fn exhaustive(q1: &[DVec3], q2: &[DVec3], i: usize, j: usize) -> f64 {
    let last = q1.len() - 1;
    if (i, j) == (last, last) {
        return 0.0;
    }
    let product = |x: f64, y: f64| {
        let at = |q: &[DVec3], x: f64| {
            let low = (x as usize).min(q.len() - 1);
            q[low].lerp(q[(low + 1).min(q.len() - 1)], x - low as f64)
        };
        at(q1, x).dot(at(q2, y))
    };
    let mut best = f64::NEG_INFINITY;
    for (a, b) in STEPS.into_iter().filter(|&(a, b)| i + a <= last && j + b <= last) {
        let parts = a.max(b);
        let mean: f64 = (0..=parts)
            .map(|k| {
                let f = k as f64 / parts as f64;
                let weight = if k == 0 || k == parts { 0.5 } else { 1.0 };
                weight * product(i as f64 + a as f64 * f, j as f64 + b as f64 * f)
            })
            .sum::<f64>()
            / parts as f64;
        best = best.max(mean * ((a * b) as f64).sqrt() + exhaustive(q1, q2, i + a, j + b));
    }
    best
}

fn registration() {
    let cases = 300;
    let worst: Vec<f64> = (0..cases)
        .into_par_iter()
        .map(|i| {
            let q = |name: &str| -> Vec<DVec3> {
                let seed = Seed::new(i).child(name);
                let drift = seed.child("drift").direction().as_dvec3();
                (0..9).map(|k| (seed.at(k).direction().as_dvec3() + drift).normalize()).collect()
            };
            let (q1, q2) = (q("a"), q("b"));
            (best_path(&q1, &q2, 9).1 - exhaustive(&q1, &q2, 0, 0)).abs()
        })
        .collect();
    let how = format!("greatest difference of dynamic programming from all lattice paths, {cases} pairs of 9 samples");
    Figure::new("space.srvf_dp_error", worst.iter().fold(0.0, |a, b| a.max(*b)), "", how).goal("<= 1e-9").print();
    // Rotations as well: real branches against a dense set of rotations, each with its best path.
    let plants = [of_nodes("oak", 1, 200), of_nodes("willow", 2, 200)];
    let bent = |plant: &Plant| -> Vec<ElasticCurve> {
        let curves = plant.chain_ids().map(|id| ElasticCurve::new(plant.points(id)));
        curves.filter(|c| c.q().windows(2).any(|w| w[0].dot(w[1]) < 0.98)).take(12).collect()
    };
    let (a, b) = (bent(&plants[0]), bent(&plants[1]));
    let pairs: Vec<(&ElasticCurve, &ElasticCurve)> = a.iter().zip(&b).collect();
    let short: Vec<f64> = pairs
        .par_iter()
        .map(|(x, y)| {
            let found = register(x, y).agreement;
            let mut best = found;
            for i in 0..600 {
                let seed = Seed::new(7).at(i);
                let turn = Rotation::about(seed.direction(), seed.child("angle").range(0.0, std::f32::consts::TAU));
                let turned: Vec<DVec3> = y.q().iter().map(|q| turn.rotate(q.as_vec3()).as_dvec3()).collect();
                best = best.max(best_path(x.q(), &turned, 49).1 / 49.0);
            }
            best - found
        })
        .collect();
    let how = format!(
        "agreement (at most 1) that 600 random rotations with their best paths find more, worst of {} pairs of bent branches",
        pairs.len()
    );
    Figure::new("space.srvf_search_gap", short.iter().fold(0.0, |a, b| a.max(*b)), "", how).goal("<= 0.01").print();
}

/// Plants of one family each, grown and real.
fn families() -> Vec<(String, Vec<Plant>)> {
    let mut all: Vec<(String, Vec<Plant>)> = vec![
        ("oaks".into(), (1..5).map(|s| of_nodes("oak", s, 200)).collect()),
        ("species".into(), ["elm", "birch", "pine", "willow"].map(|s| of_nodes(s, 1, 160)).into()),
    ];
    let real = real(100);
    if real.len() > 3 {
        all.push(("real".into(), real.into_iter().take(4).map(|r| r.1).collect()));
    }
    all
}

/// Real plants of the data folder, cut to their coarsest chains.
fn real(chains: usize) -> Vec<(String, Plant)> {
    let Some(folder) = data() else { return Vec::new() };
    let mut found = Vec::new();
    for file in [
        "eztree_aspen_small.swc",
        "eztree_oak_medium.swc",
        "eztree_pine_medium.swc",
        "itsme_tree_1.csv",
        "itsme_tree_2.csv",
        "mtg_apple_agraf.swc",
        "plantgeom_coffee.swc",
        "pyhelios_olive_900_qsm.txt",
        "pyhelios_walnut_365_qsm.txt",
        "rtwig_small.csv",
    ] {
        let Ok(bytes) = std::fs::read(folder.join("skeleton").join(file)) else { continue };
        let params = ImportParams { file: file.to_owned(), ..ImportParams::default() };
        let Ok(imported) = import(&bytes, file, &params) else { continue };
        let plant = imported.plant.without_leaves();
        let mut order: Vec<ChainId> = plant.chain_ids().collect();
        order.sort_by(|&a, &b| {
            let (x, y) = (plant.chain(a), plant.chain(b));
            x.order.cmp(&y.order).then(plant.radii(b)[0].total_cmp(&plant.radii(a)[0])).then(a.cmp(&b))
        });
        found.push((file.to_owned(), treewright::select::without(&plant, order.get(chains..).unwrap_or(&[]))));
    }
    found
}

/// Triples and how far they break the triangle inequality: how many do, the worst share.
fn triangles(matrix: &[Vec<f64>], slack: f64) -> (usize, usize, f64) {
    let count = matrix.len();
    let (mut all, mut broken, mut worst) = (0, 0, 0.0_f64);
    for i in 0..count {
        for j in 0..count {
            for k in i + 1..count {
                if j == i || j == k {
                    continue;
                }
                all += 1;
                let over = matrix[i][k] / (matrix[i][j] + matrix[j][k]) - 1.0;
                if over > slack {
                    broken += 1;
                    worst = worst.max(over);
                }
            }
        }
    }
    (all, broken, worst)
}

fn one_family() {
    let (mut all, mut broken, mut worst) = (0, 0, 0.0_f64);
    let (mut all_qed, mut broken_qed, mut worst_qed, mut turns) = (0, 0, 0.0_f64, 0);
    for (_, plants) in families() {
        let family = elastic_family(plants.clone(), &ElasticParams::default()).expect("they match");
        let share = |i: u64| -> Vec<f32> {
            {
                let square = |s| Seed::new(i).at(s).unit() * Seed::new(i).at(s).unit();
                (0..4).map(square).collect()
            }
        };
        let mut points: Vec<ShapePoint> =
            (0..4).map(|s| family.shape_point(&family.corner(s)).expect("elastic")).collect();
        points.extend((0..8).map(|i| family.shape_point(&weighted_mean(&family, &share(i))).expect("elastic")));
        let matrix: Vec<Vec<f64>> = points.iter().map(|a| points.iter().map(|b| a.distance(b)).collect()).collect();
        let found = triangles(&matrix, 1e-9);
        (all, broken, worst) = (all + found.0, broken + found.1, worst.max(found.2));
        // The fuzzy matching lets branches pass each other, so that QED geodesics turn from orthant to orthant.
        let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
        let family = nway_family(plants, &matching).expect("they match");
        let mut points: Vec<TreePoint> = (0..4).map(|s| TreePoint::of(&family, s)).collect();
        for i in 0..6_u64 {
            let (a, b) = (i as usize % 4, (i as usize + 1 + i as usize / 4) % 4);
            points.push(TreeGeodesic::new(&points[a], &points[b]).at(f64::from(Seed::new(i).unit())));
        }
        let ways: Vec<Vec<TreeGeodesic>> =
            points.par_iter().map(|a| points.iter().map(|b| TreeGeodesic::new(a, b)).collect()).collect();
        turns += ways.iter().flatten().map(TreeGeodesic::turns).sum::<usize>();
        let matrix: Vec<Vec<f64>> = ways.iter().map(|row| row.iter().map(TreeGeodesic::length).collect()).collect();
        let found = triangles(&matrix, 1e-9);
        (all_qed, broken_qed, worst_qed) = (all_qed + found.0, broken_qed + found.1, worst_qed.max(found.2));
    }
    let how = format!("elastic metric, {all} triples of sources and blends of three families, worst by {worst:.2e}");
    Figure::new("space.triangle_one_family", broken as f64, "triples", how).goal("0").print();
    let how = format!("QED, {all_qed} triples, {turns} turns from orthant to orthant, worst by {worst_qed:.2e}");
    Figure::new("space.triangle_one_family_qed", broken_qed as f64, "triples", how).goal("0").print();
}

fn pairs() -> Vec<(&'static str, Plant, Plant)> {
    vec![
        ("oak to oak", of_nodes("oak", 1, 300), of_nodes("oak", 4, 360)),
        ("birch to elm", of_nodes("birch", 1, 118), of_nodes("elm", 2, 338)),
        ("small oak to oak", of_nodes("oak", 3, 28), of_nodes("oak", 2, 500)),
        ("willow to lime", of_nodes("willow", 1, 240), of_nodes("lime", 2, 300)),
    ]
}

fn paths() {
    let (mut uneven, mut off_middle, mut length_off) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut valid, mut made) = (0, 0);
    let steps = 20;
    for (_, a, b) in pairs() {
        let family = elastic_family(vec![a.clone(), b.clone()], &ElasticParams::default()).expect("they match");
        let at = |i: usize| weighted_mean(&family, &[1.0 - i as f32 / steps as f32, i as f32 / steps as f32]);
        let points: Vec<ShapePoint> = (0..=steps).map(|i| family.shape_point(&at(i)).expect("elastic")).collect();
        let whole = points[0].distance(&points[steps]);
        let between: Vec<f64> = points.windows(2).map(|w| w[0].distance(&w[1])).collect();
        let even = whole / steps as f64;
        uneven = between.iter().fold(uneven, |u, d| u.max((d / even - 1.0).abs()));
        length_off = length_off.max((between.iter().sum::<f64>() / whole - 1.0).abs());
        let middle = &points[steps / 2];
        off_middle = off_middle.max((middle.distance(&points[0]) - middle.distance(&points[steps])).abs() / whole);
        // The path of the QED metric, in a family whose branches pass each other.
        let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
        let crossing = fuzzy_family(a, b, &matching).expect("they match");
        let way = TreeGeodesic::new(&TreePoint::of(&crossing, 0), &TreePoint::of(&crossing, 1));
        let qed: Vec<TreePoint> = (0..=steps).map(|i| way.at(i as f64 / steps as f64)).collect();
        let apart = |a: &TreePoint, b: &TreePoint| TreeGeodesic::new(a, b).length();
        let between: Vec<f64> = qed.windows(2).map(|w| apart(&w[0], &w[1])).collect();
        let even = way.length() / steps as f64;
        uneven = between.iter().fold(uneven, |u, d| u.max((d / even - 1.0).abs()));
        length_off = length_off.max((between.iter().sum::<f64>() / way.length() - 1.0).abs());
        let middle = &qed[steps / 2];
        off_middle = off_middle.max((apart(middle, &qed[0]) - apart(middle, &qed[steps])).abs() / way.length());
        for (i, point) in qed.iter().enumerate().take(steps + 1) {
            made += 2;
            let plant = family.blend(&at(i));
            valid += usize::from(PlantBuilder::from_plant(plant).finish().is_ok());
            valid += usize::from(point.plant().is_ok());
        }
    }
    let how =
        "steps of 1/20 on elastic and QED geodesics of four pairs: worst deviation from a twentieth of the distance";
    Figure::new("space.step_unevenness", uneven, "of a step", how).goal("<= 0.001").print();
    let how = "difference of the middle's distances to the ends, over the distance, worst";
    Figure::new("space.middle_off", off_middle, "", how).goal("<= 0.0001").print();
    Figure::new("space.length_off", length_off, "", "summed steps over the distance, worst").goal("<= 0.0001").print();
    let how = format!("of {made} plants of these paths");
    Figure::new("space.invalid_points", (made - valid) as f64, "plants", how).goal("0").print();
}

/// Cells of a picture's edge.
const EDGE: usize = 200;

/// What one looks at: total length of branches, volume of the crown's hull, and which cells of a picture wood covers.
struct Seen {
    length: f64,
    volume: f64,
    cells: Vec<bool>,
}

fn seen(plant: &Plant, reach: f32) -> Seen {
    let posed = plant.pose();
    let mut crown = Crown::new(Vec3::Y * reach * 0.5);
    posed.positions().iter().for_each(|p| crown.add(*p));
    let (low, high) = crown.bounds();
    let side = 24;
    let inside = (0..side * side * side).filter(|cell| {
        let at = |i: usize| (i as f32 + 0.5) / side as f32;
        let f = Vec3::new(at(cell % side), at(cell / side % side), at(cell / side / side));
        crown.contains(low + (high - low) * f)
    });
    let share = inside.count() as f64 / (side * side * side) as f64;
    let size = (high - low).as_dvec3();
    let mut cells = vec![false; EDGE * EDGE];
    let scale = EDGE as f32 / (2.0 * reach);
    for id in plant.chain_ids() {
        let (points, radii) = (posed.chain(plant, id), plant.radii(id));
        for i in 1..points.len() {
            let parts = (points[i].distance(points[i - 1]) * scale).ceil().max(1.0) as usize;
            for part in 0..=parts {
                let f = part as f32 / parts as f32;
                let p = points[i - 1].lerp(points[i], f);
                let r = ((radii[i - 1] + (radii[i] - radii[i - 1]) * f) * scale).max(0.5);
                let (x, y) = ((p.x + reach) * scale, p.y * scale);
                let range = |c: f32| (c - r).max(0.0) as usize..((c + r).max(0.0) as usize + 1).min(EDGE);
                for row in range(y) {
                    range(x).for_each(|column| cells[row * EDGE + column] = true);
                }
            }
        }
    }
    Seen { length: f64::from(PlantStats::of(plant).wood_length), volume: share * size.x * size.y * size.z, cells }
}

/// Largest jumps between neighbours: of length and volume over the larger end, of cells over those covered.
fn jumps(trees: &[Plant], reach: f32) -> [f64; 3] {
    let all: Vec<Seen> = trees.par_iter().map(|t| seen(t, reach)).collect();
    let (first, last) = (&all[0], &all[all.len() - 1]);
    let (length, volume) = (first.length.max(last.length), first.volume.max(last.volume));
    all.windows(2).fold([0.0; 3], |most: [f64; 3], w| {
        let differ = w[0].cells.iter().zip(&w[1].cells).filter(|(a, b)| a != b).count();
        let covered = w[0].cells.iter().zip(&w[1].cells).filter(|(a, b)| **a || **b).count();
        [
            most[0].max((w[0].length - w[1].length).abs() / length),
            most[1].max((w[0].volume - w[1].volume).abs() / volume),
            most[2].max(differ as f64 / covered.max(1) as f64),
        ]
    })
}

fn quality() {
    let steps = 24;
    let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
    let mut worst = [[0.0_f64; 3]; 3];
    let mut told: Vec<String> = Vec::new();
    for (name, a, b) in pairs() {
        let reach = a.height().max(b.height()) * 1.05;
        let along = |params: &ElasticParams| -> Vec<Plant> {
            let family = elastic_family(vec![a.clone(), b.clone()], params).expect("they match");
            let at = |i: usize| i as f32 / steps as f32;
            (0..=steps).map(|i| family.blend(&weighted_mean(&family, &[1.0 - at(i), at(i)]))).collect()
        };
        let family = fuzzy_family(a.clone(), b.clone(), &matching).expect("they match");
        let tasks = Tasks::new(&family, 0, 1);
        let states = tasks.in_betweens(Seed::new(1), steps + 1, 0.0, 1.0);
        let batch: Vec<Plant> = states.iter().map(|state| family.blend(&tasks.weights(state))).collect();
        let found =
            [jumps(&along(&ElasticParams::default()), reach), jumps(&along(&straight()), reach), jumps(&batch, reach)];
        for (worst, found) in worst.iter_mut().zip(&found) {
            worst.iter_mut().zip(found).for_each(|(w, f)| *w = w.max(*f));
        }
        told.push(format!("{name}: {:.3}", found[0][0]));
    }
    let names = [
        ["space.jump_length", "space.jump_volume", "space.jump_picture"],
        ["space.jump_length_straight", "space.jump_volume_straight", "space.jump_picture_straight"],
        ["space.jump_length_stochastic", "space.jump_volume_stochastic", "space.jump_picture_stochastic"],
    ];
    let what = ["elastic geodesic", "straight interpolation", "stochastic blend, a batch"];
    let unit = ["of the longer end's branches", "of the larger crown's hull", "of covered pixels"];
    for ((names, what), worst) in names.iter().zip(what).zip(&worst) {
        for ((name, value), unit) in names.iter().zip(worst).zip(unit) {
            let how =
                format!("{what}: largest jump between neighbours of {steps} steps, four pairs ({})", told.join(", "));
            Figure::new(*name, *value, unit, how).print();
        }
    }
}

/// Least length of a matched branch in the middle of the way, over the mean of its ends.
fn shrinking() {
    let mut least = [f64::INFINITY; 2];
    let mut sums = [(0.0, 0); 2];
    for (_, a, b) in pairs() {
        for (which, params) in [ElasticParams::default(), straight()].into_iter().enumerate() {
            let family = elastic_family(vec![a.clone(), b.clone()], &params).expect("they match");
            let (middle, kins) = family.blend_with_kins(&weighted_mean(&family, &[0.5, 0.5]));
            let length = |plant: &Plant, id: ChainId| f64::from(Curve::new(plant.points(id)).length());
            for (id, &kin) in middle.chain_ids().zip(&kins) {
                let own = |s: usize| family.member(kin, s).map(|c| length(&family.sources()[s], c));
                let (Some(one), Some(two)) = (own(0), own(1)) else { continue };
                let wanted = (one + two) * 0.5;
                if wanted > 0.01 {
                    let ratio = length(&middle, id) / wanted;
                    least[which] = least[which].min(ratio);
                    sums[which] = (sums[which].0 + ratio, sums[which].1 + 1);
                }
            }
        }
    }
    let names = [["space.shrink", "space.shrink_mean"], ["space.shrink_straight", "space.shrink_straight_mean"]];
    for (which, (names, what)) in names.iter().zip(["elastic", "straight, as in the paper"]).enumerate() {
        let how = format!(
            "{what}: length of a matched branch in the middle over the mean of its ends, {} branches",
            sums[which].1
        );
        let goal = if which == 0 { ">= 0.99" } else { "" };
        Figure::new(names[0], least[which], "least", how.clone()).goal(goal).print();
        Figure::new(names[1], sums[which].0 / f64::from(sums[which].1.max(1)), "mean", how).print();
    }
}

/// The plant with every branch turned by up to so many radians.
fn shaken(plant: &Plant, seed: Seed, most: f32) -> Plant {
    let mut builder = PlantBuilder::new();
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let own = seed.at(u64::from(id.0));
        let turn = Rotation::about(own.direction(), own.child("angle").range(0.0, most));
        let grown = own.child("length").range(1.0 - most * 0.5, 1.0 + most * 0.5);
        let points: Vec<Vec3> = plant.points(id).iter().map(|p| turn.rotate(*p) * grown).collect();
        match chain.parent {
            None => builder.stem(chain.origin, plant.points(id), plant.radii(id)),
            Some(parent) => builder.branch(parent, chain.location, &points, plant.radii(id)),
        };
    }
    builder.finish().expect("a plant")
}

fn symmetry() {
    let params = ElasticParams::default();
    let plant = of_nodes("oak", 2, 160);
    let time = Instant::now();
    let reflection = Reflection::best(&plant, &params).expect("a plant");
    let time = time.elapsed().as_secs_f64();
    let how = format!("28 planes of an oak of 160 nodes, best at {:.1} degrees", reflection.azimuth().to_degrees());
    Figure::new("space.best_plane", time, "s", how).print();
    let across = |azimuth: f32| Reflection::across(&plant, azimuth, &params).expect("a plant").asymmetry();
    let planes: Vec<f64> = (0..180).into_par_iter().map(|i| across((i as f32).to_radians())).collect();
    let least = planes.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let how = "asymmetry across the plane that is found, over the least of one every degree";
    Figure::new("space.best_plane_ratio", reflection.asymmetry() / least, "", how).goal("<= 1.02").print();
    let made = reflection.symmetrized(1.0);
    let again = Reflection::across(&made, reflection.azimuth(), &params).expect("a plant");
    let how = format!(
        "farthest of the symmetrized oak from its image, over its height; before {:.2}; elastic asymmetry {:.1e} of {:.2}",
        reflection.deviation() / plant.height(),
        again.asymmetry(),
        reflection.asymmetry()
    );
    let deviation = f64::from(again.deviation() / made.height());
    Figure::new("space.asymmetry_left", deviation, "of the height", how).goal("<= 1e-4").print();
    let how = "elastic asymmetry of the symmetrized oak over that of the oak";
    Figure::new("space.asymmetry_ratio", again.asymmetry() / reflection.asymmetry(), "", how).goal("<= 1e-3").print();
    // Other symmetric plants: the oak, shaken a little or a lot, made symmetric across the same plane.
    // The shortest known way: by a correspondence of their own, or by that in which they were made symmetric.
    let how = Comparison::by(Metric::Elastic);
    let measure = |other: &Plant| distance(&plant, other, &how).expect("they match");
    let own = measure(&made).min(reflection.asymmetry() * 0.5);
    let others: Vec<f64> = (0..1000_u64)
        .into_par_iter()
        .map(|i| {
            let seed = Seed::new(11).at(i);
            let other = shaken(&plant, seed, seed.child("most").range(0.005, 0.6));
            let reflected = Reflection::across(&other, reflection.azimuth(), &params).expect("a plant");
            measure(&reflected.symmetrized(1.0)).min(measure(&other) + reflected.asymmetry() * 0.5)
        })
        .collect();
    let nearer = others.iter().filter(|d| **d < own).count();
    let nearest = others.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let how = format!(
        "of 1000 other symmetric plants, by the shorter of two ways each; the nearest is {:.4} times as far as the \
         symmetrized oak, whose own correspondence gives {:.4} of half the asymmetry",
        nearest / own,
        measure(&made) / (reflection.asymmetry() * 0.5)
    );
    Figure::new("space.nearer_symmetric", nearer as f64, "plants", how).goal("0").print();
    // In the family of the oak and its image: what is symmetric there.
    let family = reflection.family();
    let corner = family.shape_point(&family.corner(0)).expect("elastic");
    let middle = family.shape_point(&weighted_mean(family, &[0.5, 0.5])).expect("elastic").distance(&corner);
    let nearer = (0..1000_u64).filter(|&i| {
        family.shape_point(&symmetric(family, Seed::new(i))).expect("elastic").distance(&corner) < middle * (1.0 - 1e-6)
    });
    let how = "of 1000 random symmetric plants of the oak's own family";
    Figure::new("space.nearer_in_family", nearer.count() as f64, "plants", how).goal("0").print();
}

/// Weights of a symmetric plant: what a kin has of one side its image has of the other.
fn symmetric(family: &Family, seed: Seed) -> treewright::relate::Weights {
    let mut weights = treewright::relate::Weights::new(family.kin_count(), 2);
    let stray = seed.child("stray").unit();
    let stray = stray * stray * stray;
    for kin in family.kin_ids() {
        let (one, other) = (family.member(kin, 0), family.member(kin, 1));
        let name = |c: Option<ChainId>| c.map_or(0, |c| u64::from(c.0) + 1);
        let (low, high) = (name(one).min(name(other)), name(one).max(name(other)));
        let draw = seed.at(low).at(high);
        let off = if one == other { 0.0 } else { draw.range(-0.5, 0.5) * stray };
        let share = if name(one) < name(other) { 0.5 + off } else { 0.5 - off };
        let held = match (one, other) {
            (Some(_), Some(_)) => 1.0,
            _ => 0.5,
        };
        let grown = (held + held * stray * draw.child("grown").range(-0.5, 0.0)).min(1.0);
        weights.set(kin, &[1.0 - share, share], grown);
    }
    weights
}

const SPECIES: [&str; 6] = ["oak", "birch", "pine", "willow", "poplar", "elm"];

fn plants() {
    let mut named: Vec<(String, Plant)> = SPECIES
        .par_iter()
        .flat_map_iter(|species| (1..7).map(move |seed| ((*species).to_owned(), of_nodes(species, seed, 240))))
        .collect();
    let grown = named.len();
    named.extend(real(120));
    let plants: Vec<Plant> = named.iter().map(|n| n.1.clone()).collect();
    let nearest = |matrix: &[Vec<f64>], i: usize| {
        (0..matrix.len()).filter(|&j| j != i).min_by(|&a, &b| matrix[i][a].total_cmp(&matrix[i][b]))
    };
    let same = |matrix: &[Vec<f64>]| {
        let same = |&i: &usize| nearest(matrix, i).is_some_and(|j| named[j].0 == named[i].0);
        (0..grown).filter(same).count() as f64 / grown as f64
    };
    for (metric, names) in [
        (Metric::Qed, ["space.nearest_same_qed", "space.triangle_broken_qed", "space.triangle_worst_qed"]),
        (Metric::Edit, ["space.nearest_same_edit", "space.triangle_broken_edit", "space.triangle_worst_edit"]),
        (
            Metric::Elastic,
            ["space.nearest_same_elastic", "space.triangle_broken_elastic", "space.triangle_worst_elastic"],
        ),
    ] {
        let how_plain = Comparison::by(metric);
        let time = Instant::now();
        let matrix = distance_matrix(&plants, &how_plain).expect("they match");
        let time = time.elapsed().as_secs_f64();
        let relative = distance_matrix(&plants, &Comparison { size: Size::Relative, ..how_plain }).expect("they match");
        let how = format!(
            "of {grown} grown trees of {} species among {} with real ones, scaled to one size ({:.2} as they are); a \
             matrix took {time:.1} s",
            SPECIES.len(),
            plants.len(),
            same(&matrix)
        );
        Figure::new(names[0], same(&relative), "nearest neighbours of the same species", how).print();
        let (all, broken, worst) = triangles(&matrix, 1e-9);
        let scaled = triangles(&relative, 1e-9);
        let how = format!(
            "{all} triples, each pair with a correspondence of its own; scaled to one size {} break it, by {:.4} at most",
            scaled.1, scaled.2
        );
        Figure::new(names[1], broken as f64 / all as f64, "of the triples", how.clone()).goal("<= 0.01").print();
        Figure::new(names[2], worst, "over the two sides", how).goal("<= 0.05").print();
        let asymmetric = (0..plants.len())
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .step_by(7)
            .filter(|&(i, j)| distance(&plants[i], &plants[j], &how_plain).expect("they match") != matrix[j][i])
            .count();
        if metric == Metric::Qed {
            let how = "every seventh, the other way round, to the last bit";
            Figure::new("space.asymmetric_pairs", asymmetric as f64, "pairs", how).goal("0").print();
            let own = plants.iter().map(|p| distance(p, p, &how_plain).expect("it matches"));
            let how = format!("greatest distance of {} plants from themselves", plants.len());
            Figure::new("space.self_distance", own.fold(0.0, f64::max), "m", how).goal("0").print();
        }
    }
    // Turned at random, and turned back by the free facing.
    let few: Vec<Plant> = SPECIES
        .iter()
        .flat_map(|species| {
            (1..4).map(move |seed| {
                let plant = of_nodes(species, seed, 80);
                treewright::relate::turned(&plant, Seed::new(seed).child(species).range(0.0, std::f32::consts::TAU))
            })
        })
        .collect();
    for (facing, name) in [(Facing::Fixed, "space.nearest_same_turned"), (Facing::Free, "space.nearest_same_free")] {
        let how = Comparison { facing, ..Comparison::by(Metric::Elastic) };
        let matrix = distance_matrix(&few, &how).expect("they match");
        let same = (0..few.len()).filter(|&i| nearest(&matrix, i).is_some_and(|j| j / 3 == i / 3));
        let how = format!("of {} trees of 80 nodes turned at random, {facing:?} facing", few.len());
        Figure::new(name, same.count() as f64 / few.len() as f64, "nearest neighbours of the same species", how)
            .print();
    }
    let plant = of_nodes("oak", 3, 160);
    let turned = treewright::relate::turned(&plant, 2.2);
    let of = |facing| {
        distance(&plant, &turned, &Comparison { facing, ..Comparison::by(Metric::Elastic) }).expect("they match")
    };
    let how = "distance of an oak from itself turned by 126 degrees, over the distance without turning";
    Figure::new("space.turned_back", of(Facing::Free) / of(Facing::Fixed), "", how).goal("<= 0.1").print();
}

fn sizes() {
    let (a, b) = (of_nodes("oak", 1, 790), of_nodes("pine", 2, 790));
    let family = elastic_family(vec![a, b], &ElasticParams::default()).expect("they match");
    let point = TreePoint::of(&family, 0);
    let tree = BinaryTree::of(&point);
    let how = format!(
        "nodes held of a maximal binary tree of depth {}, which has 2^{} of them",
        tree.depth(),
        tree.depth() + 1
    );
    Figure::new("space.binary_nodes", tree.nodes().len() as f64, "nodes", how).goal("<= 10000").print();
}
