//! Figures of blending: topology, corners, continuity, the paper's Table 1, matching, mixes, memory, growth of cost.

use std::hint::black_box;

use rayon::prelude::*;
use treewright::base::Seed;
use treewright::blend::{State, Tasks, mix};
use treewright::plant::{ChainId, Plant, PlantBuilder, PlantStats};
use treewright::preset::plan::{ImportHeight, ImportParams, Pick};
use treewright::relate::{Blender, Family, TopologyTree, fuzzy_family, match_fuzzy, nway_family};
use treewright::select::{self, Examined, Sources};
use treewright::source::import::import;

use crate::table_1::{FILTER, MATCHING, ROWS, Row, SCORES, source};
use crate::{Figure, data, seconds};

/// Prints them.
pub(crate) fn print() {
    matching();
    mixes();
    memory();
    growth();
    continuity();
    table_1();
    topology();
    crate::select::print();
}

/// What the figures of each row begin with, and what the paper took, seconds.
const PAPER: [(&str, f64); 7] = [
    ("salix", 15.72),
    ("salix_bonsai", 5.04),
    ("ulmus", 12.25),
    ("cypress_ash", 3.78),
    ("redwood_bonsai", 1.32),
    ("maidenhair_maple", 16.71),
    ("acacia_bonsai", 1.58),
];

/// Makes a row's trees: all stages from the sources on. Every tree is made whole; the sum of what `look` says of each.
fn blended((a, b): &(Plant, Plant), trees: usize, look: fn(&Plant) -> usize) -> usize {
    let family = fuzzy_family(a.clone(), b.clone(), &MATCHING).expect("they match");
    let tasks = Tasks::new(&family, 0, 1);
    let states = tasks.in_betweens(Seed::new(1), trees, 0.0, 1.0);
    tasks.map_trees(&states, &|_, plant: &Plant, _| look(plant)).into_iter().sum()
}

/// The family of a row's plants and its trees, filtered and measured.
fn examined((a, b): &(Plant, Plant), trees: usize) -> (Sources, Vec<Examined>) {
    let family = fuzzy_family(a.clone(), b.clone(), &MATCHING).expect("they match");
    let tasks = Tasks::new(&family, 0, 1);
    let states = tasks.in_betweens(Seed::new(1), trees, 0.0, 1.0);
    let sources = Sources::of(&family, &FILTER);
    let examined = tasks.map_trees(&states, &|_, plant: &Plant, kins| select::examine(plant, kins, &sources, &FILTER));
    (sources, examined)
}

/// All stages with filter, scores and sampling: how many are kept.
fn kept(plants: &(Plant, Plant), trees: usize) -> usize {
    let (sources, examined) = examined(plants, trees);
    let scores = select::scores(&examined, &sources, &SCORES);
    let keep = (trees as f64 / 2.0).sqrt().ceil() as usize;
    select::pick(Pick::Inspiring, keep, FILTER.botany, &examined, &scores).map_or(0, |picked| picked.kept.len())
}

fn table_1() {
    let threads = rayon::current_num_threads();
    let rows: Vec<(&Row, (Plant, Plant))> = ROWS.iter().map(|row| (row, row.plants())).collect();
    for ((row, plants), (name, paper)) in rows.iter().zip(PAPER) {
        let figure = |part: &str| format!("blend.{name}{part}");
        let points = blended(plants, row.trees, |plant| plant.all_points().len()) / row.trees;
        let how = format!(
            "{} trees between a {} of {} chains and a {} of {}, {points} points on average: matching, schedule, blending, \
             median of 7, {threads} threads",
            row.trees,
            row.source.0,
            plants.0.chains().len(),
            row.target.0,
            plants.1.chains().len()
        );
        let time = seconds(7, || {
            black_box(blended(plants, row.trees, |plant| plant.all_points().len()));
        });
        Figure::new(figure(""), time * 1e3, "ms", how).print();
        let how = format!("times faster than the paper's {paper} s, which hold these stages");
        Figure::new(figure("_ratio"), paper / time, "x", how).goal(">= 200").print();
        let time = seconds(3, || {
            black_box(blended(plants, row.trees, |plant| plant.pose().positions().len()));
        });
        let how = "the same and world positions of all points, which any filter needs: what it can't be faster than";
        Figure::new(figure("_posed"), paper / time, "x", how).print();
        let time = seconds(3, || {
            black_box(kept(plants, row.trees));
        });
        let how = format!("with filter, scores and sampling: times faster than the paper's {paper} s without");
        Figure::new(figure("_kept"), paper / time, "x", how).print();
    }
    plausible(&rows);
}

/// What the botanical filter lets through, and whether it knows other kinds.
fn plausible(rows: &[(&Row, (Plant, Plant))]) {
    let found: Vec<(Sources, Vec<Examined>)> = rows.iter().map(|(row, plants)| examined(plants, row.trees)).collect();
    let all: usize = found.iter().map(|f| f.1.len()).sum();
    let rejected = |f: &(Sources, Vec<Examined>)| f.1.iter().filter(|t| t.departure.by > FILTER.botany).count();
    let each: Vec<String> = PAPER.iter().zip(&found).map(|(r, f)| format!("{} {}", rejected(f), r.0)).collect();
    let sum: usize = found.iter().map(rejected).sum();
    let how = format!("of the {all} trees of these rows rejected by their proportions: {}", each.join(", "));
    Figure::new("blend.filter_rejected", sum as f64 / all as f64 * 100.0, "%", how).goal("<= 10").print();
    let (mut told, mut pairs) = (0, 0);
    for (i, (_, trees)) in found.iter().enumerate() {
        let other = &found[(i + 3) % found.len()].0;
        let kinds: Vec<_> = other.profiles.iter().map(|p| &p.proportions).collect();
        told += trees.iter().filter(|t| t.profile.proportions.departure(&kinds).by > FILTER.botany).count();
        pairs += trees.len();
    }
    let how = format!("of {pairs} trees rejected when they are held against the sources of another row");
    Figure::new("blend.filter_foreign", told as f64 / pairs as f64 * 100.0, "%", how).print();
}

/// A trunk with branches all over, each with two twigs.
fn comb(seed: u64, count: usize) -> Plant {
    let mut builder = PlantBuilder::new();
    let up: Vec<_> = (0..=20).map(|i| glam::Vec3::Y * 0.5 * i as f32).collect();
    let stem = builder.stem(glam::Vec3::ZERO, &up, &[0.2; 21]);
    for i in 0..count {
        let at = Seed::new(seed).at(i as u64);
        let out = at.direction() * at.child("length").range(0.2, 3.0);
        builder.branch(stem, at.unit(), &[glam::Vec3::ZERO, out * 0.5, out], &[0.05, 0.04, 0.02]);
    }
    builder.finish().expect("a plant")
}

fn matching() {
    let (a, b) = (source("oak", 1, 600), source("elm", 2, 600));
    let (tree_a, tree_b) = (TopologyTree::of(&a), TopologyTree::of(&b));
    let time = seconds(15, || drop(black_box(match_fuzzy(&tree_a, &tree_b, &MATCHING))));
    let how = "an oak and an elm of 600 chains each, median of 15";
    Figure::new("blend.match_600", time * 1e3, "ms", how).goal("<= 5").print();
    let time = seconds(15, || drop(black_box(TopologyTree::of(&a))));
    Figure::new("blend.topology_tree_600", time * 1e3, "ms", "of the oak, median of 15").print();
    let (tree_a, tree_b) = (TopologyTree::of(&comb(1, 600)), TopologyTree::of(&comb(2, 600)));
    let time = seconds(15, || drop(black_box(match_fuzzy(&tree_a, &tree_b, &MATCHING))));
    let how = "600 branches of one trunk against 600 of another, median of 15";
    Figure::new("blend.match_600_siblings", time * 1e3, "ms", how).goal("<= 5").print();
}

fn mixes() {
    let plants = ["oak", "elm", "ash", "lime"].map(|species| source(species, 1, 500));
    let family = nway_family(plants.to_vec(), &MATCHING).expect("they match");
    let mut blender = Blender::new(&family);
    let (mut plant, mut turn) = (Plant::default(), 0);
    let time = seconds(31, || {
        turn += 1;
        // Other weights each time: nothing of the last mix is left as it was.
        let shares = treewright::base::simplex_point(4, turn);
        blender.blend_into(&mix(&family, &shares), &mut plant);
    });
    let (kins, points) = (family.kin_count(), plant.all_points().len());
    let how = format!("oak, elm, ash and lime of 500 chains, {kins} kins, {points} points, other weights each time");
    Figure::new("blend.mix_4way_500", time * 1e3, "ms", how).goal("<= 2").print();
    let time = seconds(5, || drop(black_box(nway_family(plants.to_vec(), &MATCHING))));
    Figure::new("blend.match_4way_500", time * 1e3, "ms", "the family of these four, median of 5").print();
}

fn memory() {
    let family = fuzzy_family(source("willow", 1, 213), source("willow", 2, 594), &MATCHING).expect("they match");
    let tasks = Tasks::new(&family, 0, 1);
    let mut states: Vec<State> = Vec::new();
    for seed in 0..100 {
        states.extend(tasks.in_betweens(Seed::new(seed), 100, 0.05, 0.95));
    }
    let bytes: usize = states.iter().map(State::bytes).sum();
    let how = format!("{} kept variants of the Salix pair, {} kins", states.len(), family.kin_count());
    let each = bytes as f64 / states.len() as f64;
    Figure::new("blend.memory_per_variant", each, "bytes", how.clone()).goal("<= 2048").print();
    Figure::new("blend.memory_10000", bytes as f64 / 1e6, "MB", how).goal("<= 20").print();
}

/// The slope of a line through logarithms.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> =
        points.iter().map(|(x, y)| (treewright::base::math::ln64(*x), treewright::base::math::ln64(*y))).collect();
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / logs.iter().map(|p| (p.0 - mx) * (p.0 - mx)).sum::<f64>()
}

fn growth() {
    let (a, b) = (source("oak", 1, 400), source("oak", 2, 400));
    let family = fuzzy_family(a, b, &MATCHING).expect("they match");
    let tasks = Tasks::new(&family, 0, 1);
    let made = |tasks: &Tasks<'_>, trees: usize| {
        let states = tasks.in_betweens(Seed::new(1), trees, 0.0, 1.0);
        tasks.map_trees(&states, &|_, plant: &Plant, _| plant.all_points().len()).len()
    };
    let line: Vec<(f64, f64)> = [50, 100, 200, 400, 800]
        .map(|trees| (trees as f64, seconds(5, || assert_eq!(black_box(made(&tasks, trees)), trees))))
        .to_vec();
    let how = "50 to 800 trees between two oaks of 400 chains";
    Figure::new("blend.exponent_trees", exponent(&line), "", how).goal("<= 1.1").print();
    let time_of = |family: &Family| {
        let tasks = Tasks::new(family, 0, 1);
        (family.kin_count() as f64, seconds(5, || assert_eq!(black_box(made(&tasks, 100)), 100)))
    };
    let line: Vec<(f64, f64)> = [100, 200, 400, 800, 1600]
        .map(|chains| time_of(&fuzzy_family(comb(1, chains), comb(2, chains), &MATCHING).expect("they match")))
        .to_vec();
    let how = "100 trees between two of 100 to 1600 branches that are all alike, over the chains of both";
    Figure::new("blend.exponent_chains", exponent(&line), "", how).goal("<= 1.1").print();
    let line: Vec<(f64, f64)> = [100, 200, 400, 800, 1600]
        .map(|chains| {
            time_of(&fuzzy_family(source("oak", 1, chains), source("oak", 2, chains), &MATCHING).expect("they match"))
        })
        .to_vec();
    let how = "100 trees between two oaks cut down to 100 to 1600 chains, over the chains of both";
    Figure::new("blend.exponent_chains_oak", exponent(&line), "", how).goal("<= 1.1").print();
    let line: Vec<(f64, f64)> = [150, 300, 600, 1200]
        .map(|count| {
            let (a, b) = (TopologyTree::of(&comb(1, count)), TopologyTree::of(&comb(2, count)));
            (count as f64, seconds(5, || drop(black_box(match_fuzzy(&a, &b, &MATCHING)))))
        })
        .to_vec();
    let how = "150 to 1200 branches of one trunk against as many of another";
    Figure::new("blend.exponent_match", exponent(&line), "", how).goal("< 3").print();
}

/// Families of grown sources, of real ones, and of both.
fn families() -> Vec<(&'static str, Family)> {
    let mut plants: Vec<(&'static str, Plant)> =
        ["oak", "birch", "willow", "bonsai", "shrub"].map(|species| (species, source(species, 3, 300))).to_vec();
    if let Some(folder) = data() {
        for name in ["itsme_tree_2.csv", "pyhelios_olive_900_qsm.txt", "eztree_oak_medium.swc"] {
            let params =
                ImportParams { file: name.to_owned(), height: ImportHeight::Metres(10.0), ..ImportParams::default() };
            let Ok(bytes) = std::fs::read(folder.join("skeleton").join(name)) else { continue };
            if let Ok(imported) = import(&bytes, name, &params) {
                plants.push((name, imported.plant));
            }
        }
    }
    let mut families = Vec::new();
    for i in 0..plants.len() {
        let (a, b) = (&plants[i], &plants[(i + 1) % plants.len()]);
        families.push((a.0, fuzzy_family(a.1.clone(), b.1.clone(), &MATCHING).expect("they match")));
    }
    families
}

fn topology() {
    let families = families();
    let batches = 10_000_usize.div_ceil(families.len() * 50);
    let mut worst = 1.0_f32;
    let (mut trees, mut exact) = (0, 0);
    let mut corner = 0.0_f32;
    for (_, family) in &families {
        let tasks = Tasks::new(family, 0, 1);
        let found: Vec<(usize, f32)> = (0..batches as u64)
            .into_par_iter()
            .map(|seed| {
                let states = tasks.in_betweens(Seed::new(seed), 50, 0.0, 1.0);
                let ratios = tasks.map_trees(&states, &|_, plant: &Plant, _| PlantStats::of(plant).topology_continuity);
                (ratios.len(), ratios.into_iter().fold(1.0, f32::min))
            })
            .collect();
        trees += found.iter().map(|f| f.0).sum::<usize>();
        worst = found.iter().fold(worst, |w, f| w.min(f.1));
        for (s, plant) in family.sources().iter().enumerate() {
            let made = family.blend(&family.corner(s));
            exact += usize::from(made == *plant);
            if made.chains().len() == plant.chains().len() {
                let (a, b) = (made.pose(), plant.pose());
                let apart = a.positions().iter().zip(b.positions()).map(|(p, q)| p.distance(*q));
                corner = apart.fold(corner, |w, d| w.max(d / plant.height()));
            } else {
                corner = f32::INFINITY;
            }
        }
    }
    let names: Vec<&str> = families.iter().map(|f| f.0).collect();
    let how = format!("least of {trees} trees, {batches} batches between each two neighbours of {}", names.join(", "));
    Figure::new("blend.continuity", f64::from(worst), "", how).goal("1").print();
    let how =
        format!("largest distance of a point from the source's, over its height; {exact} of {} exact", 2 * names.len());
    Figure::new("blend.corner_error", f64::from(corner), "", how).goal("<= 0.00001").print();
}

/// Farthest that a place on a chain (by kin and arc length) moves, over the height.
fn moved(family: &Family, a: &treewright::relate::Weights, b: &treewright::relate::Weights) -> f32 {
    let (a, kins_a) = family.blend_with_kins(a);
    let (b, kins_b) = family.blend_with_kins(b);
    let (posed_a, posed_b) = (a.pose(), b.pose());
    let mut most = 0.0_f32;
    for (id, kin) in a.chain_ids().zip(&kins_a) {
        let Ok(other) = kins_b.binary_search(kin) else { continue };
        for i in 0..=8 {
            let t = f64::from(i) / 8.0;
            let there = posed_b.curve(&b, ChainId(other as u32)).point(t);
            most = most.max(posed_a.curve(&a, id).point(t).distance(there));
        }
    }
    most / a.height().max(b.height())
}

fn continuity() {
    let mut steps = [0.0_f32; 3];
    let mut taken = 0;
    for (_, family) in &families() {
        let tasks = Tasks::new(family, 0, 1);
        let states: Vec<State> = tasks.batch(Seed::new(5), 1.0).collect();
        for pair in states.windows(2).skip(1).step_by(6) {
            let at = |share| tasks.between(&pair[0], &pair[1], share);
            for (most, half) in steps.iter_mut().zip([0.05, 0.005, 0.0005]) {
                *most = most.max(moved(family, &at(0.5 - half), &at(0.5 + half)));
            }
            taken += 1;
        }
    }
    let how =
        |part: &str| format!("farthest move of any point over the tree's height in {part} of a step, {taken} steps");
    Figure::new("blend.step_tenth", f64::from(steps[0]), "", how("a tenth")).print();
    Figure::new("blend.step_hundredth", f64::from(steps[1]), "", how("a hundredth")).print();
    Figure::new("blend.step_thousandth", f64::from(steps[2]), "", how("a thousandth")).print();
    let slope = exponent(&[(0.1, steps[0].into()), (0.01, steps[1].into()), (0.001, steps[2].into())]);
    Figure::new("blend.step_exponent", slope, "", "of the farthest move over the step").goal(">= 0.9").print();
}
