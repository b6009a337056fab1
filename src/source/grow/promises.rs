//! Promises about graphs that are shared, finer ways along branches, and about what is around a plant.

use glam::Vec3;

use super::{Graph, GraphParams, GrowError, ObstacleMeshes, Solids, crossings, grow, grow_among, grow_on};
use crate::base::Seed;
use crate::plant::Plant;
use crate::preset::plan::{Beside, Company, Endpoints, GrowParams, GrowSpace, Light, Obstacle, Sampling};
use crate::preset::species;

fn small(detail: f32) -> GrowParams {
    let text = "(height: 8.0, nodes: 4000, width: 0.9, tip_radius: 0.01, slenderness: 10000.0, bole: 0.1, iterations: [\
        (endpoints: Volume(shape: Point(height: 0.5), count: 1)),\
        (endpoints: Volume(shape: HalfEllipsoid(bottom: 0.35, top: 0.85, radius: 0.35), count: 14),\
         guide: Piecewise(alpha1: 30.0)),\
        (endpoints: Surface(k: 2, t: 0.7, count: 60), guide: Piecewise(alpha1: 30.0))])";
    let mut params = species("small.ron", text).unwrap();
    params.space.detail = detail;
    params
}

fn grown(params: &GrowParams) -> Plant {
    grow(params, Seed::new(7)).unwrap().0
}

/// Least distance of two segments, sampled along the first.
fn apart(a: [Vec3; 2], b: [Vec3; 2]) -> f32 {
    let along = b[1] - b[0];
    (0..=8)
        .map(|k| {
            let p = a[0].lerp(a[1], k as f32 / 8.0);
            let t = ((p - b[0]).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
            p.distance(b[0] + along * t)
        })
        .fold(f32::INFINITY, f32::min)
}

#[test]
fn axes_of_two_branches_never_cross_but_at_forks() {
    for (detail, seed) in [(1.0, 1), (1.0, 2), (2.0, 3)] {
        let mut params = small(detail);
        params.seed = seed;
        let plant = grown(&params);
        let posed = plant.pose();
        let mut segments = Vec::new();
        for id in plant.chain_ids() {
            for (k, pair) in posed.chain(&plant, id).windows(2).enumerate() {
                segments.push((id, k, [pair[0], pair[1]]));
            }
        }
        for (i, &(a, k, s)) in segments.iter().enumerate() {
            for &(b, l, t) in &segments[..i] {
                // Where a branch leaves, it and what leaves beside it touch.
                let leaves = |x, n: usize| n < 2 && plant.chain(x).parent.is_some();
                if a != b && !leaves(a, k) && !leaves(b, l) && s[0].distance(t[0]) < 0.5 {
                    assert!(apart(s, t) > 1e-5, "{a:?} and {b:?} at {}", s[0]);
                }
            }
        }
    }
}

#[test]
fn axes_of_real_size_cross_nowhere_after_smoothing() {
    // As many twigs as a shipped species has, on a smaller graph, so that they are crowded.
    let mut params = small(2.0);
    params.nodes = 12_000;
    params.iterations[2].endpoints =
        Endpoints::Surface { k: 2, t: 1.0, irregular: 0.0, count: 900, sampling: Sampling::Poisson };
    for seed in 1..4 {
        params.seed = seed;
        let (plant, notes) = grow(&params, Seed::new(7)).unwrap();
        assert!(plant.chains().len() > 300);
        assert!(crossings(&plant) == 0 || notes.iter().any(|n| n.contains("still grow")), "{notes:?}");
    }
}

#[test]
fn each_plant_of_a_stand_has_its_own_radii() {
    let mut params = pair(Company::Kept);
    params.space.beside[0].params.tip_radius = params.tip_radius * 3.0;
    params.space.beside[0].params.taper = params.taper;
    let stand = grown(&params);
    let second = stand.chain_ids().filter(|&id| stand.chain(id).parent.is_none()).nth(1).unwrap();
    let (own, others) = stand.all_radii().split_at(stand.span(second).start);
    let least = |radii: &[f32]| radii.iter().copied().fold(f32::INFINITY, f32::min);
    assert!((least(others) / least(own) - 3.0).abs() < 0.05, "{} {}", least(own), least(others));
}

#[test]
fn a_graph_serves_many_trees_and_changes_none() {
    for detail in [1.0, 2.0] {
        let mut params = small(detail);
        let of = GraphParams::of(&params, &Solids::new()).unwrap();
        let graph = Graph::new(&of, &ObstacleMeshes::new()).unwrap();
        let mut trees = Vec::new();
        for seed in [4, 5] {
            params.seed = seed;
            let (on, _) = grow_on(&graph, &params, &Solids::new(), Seed::new(7)).unwrap();
            assert_eq!(on, grown(&params));
            trees.push(on);
        }
        // The trunk too is each tree's own.
        let trunk = |t: usize| -> Vec<Vec3> { trees[t].points(crate::plant::ChainId(0)).to_vec() };
        assert_ne!(trunk(0), trunk(1));
        let mut other = params.clone();
        other.space.graph_seed = 2;
        assert_eq!(grow_on(&graph, &other, &Solids::new(), Seed::new(7)).unwrap_err(), GrowError::OtherGraph);
        assert_ne!(grown(&other), trees[1]);
    }
}

#[test]
fn threads_change_nothing_where_ways_are_finer() {
    let mut params = small(2.0);
    params.space.obstacles = vec![Obstacle::Box { low: [1.0, 0.0, -2.0], high: [2.0, 9.0, 2.0] }];
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| grow(&params, Seed::new(7)).unwrap())
    };
    assert_eq!(on(1), on(3));
}

fn pair(company: Company) -> GrowParams {
    let mut params = small(1.0);
    let neighbour = GrowParams { seed: 3, height: 6.0, ..small(1.0) };
    params.space.beside = vec![Beside { params: neighbour, at: [2.5, 0.5] }];
    params.space.company = company;
    params
}

#[test]
fn a_first_plant_without_room_is_named_with_the_one_beside_it() {
    // A trunk each, of which there is room for one.
    let mut params = small(1.0);
    params.iterations.truncate(1);
    params.space.beside = vec![Beside { params: GrowParams { seed: 2, ..params.clone() }, at: [0.0, 0.0] }];
    params.space.company = Company::Kept;
    match grow(&params, Seed::new(7)) {
        Err(GrowError::Crowded { number, of, nearest, away, .. }) => {
            assert_eq!((number, of, nearest, away), (1, 2, 2, 0.0))
        }
        other => panic!("{:?}", other.map(|grown| grown.1)),
    }
}

#[test]
fn plants_that_find_no_room_are_told_in_one_note() {
    let mut params = small(1.0);
    let close = |i: u64| Beside { params: GrowParams { seed: i, ..small(1.0) }, at: [0.05 * (i + 1) as f32, 0.04] };
    params.space.beside = (0..12).map(close).collect();
    params.space.company = Company::Kept;
    let (plant, notes) = grow(&params, Seed::new(7)).unwrap();
    let told: Vec<&String> = notes.iter().filter(|note| note.contains("found no room to grow")).collect();
    assert!(
        told.len() == 1 && told[0].contains("of 13 plants") && told[0].contains("move them farther apart"),
        "{notes:?}"
    );
    // The nearest to number 3 stands beside it, where the second does.
    assert!(told[0].contains("number 3 of 8.0 m at (0.1, 0.04), 0.05 m from number"), "{notes:?}");
    // Those that are not there, and those that are low.
    let posed = plant.pose();
    let mut tops: Vec<f32> = vec![0.0; plant.chains().len()];
    let mut roots: Vec<usize> = Vec::new();
    for id in plant.chain_ids() {
        roots.push(plant.chain(id).parent.map_or(id.index(), |parent| roots[parent.index()]));
        let top = &mut tops[roots[id.index()]];
        *top = posed.chain(&plant, id).iter().fold(*top, |top, p| top.max(p.y));
    }
    let tall = tops.iter().filter(|top| **top > 8.0 * 0.35).count();
    assert!(told[0].starts_with(&format!("{} of 13", 13 - tall)), "{tall}: {notes:?}");
    let named = told[0].split_once("number ").and_then(|(_, rest)| rest.split_once(' ')).unwrap().0;
    assert!(notes.iter().all(|note| !note.starts_with(&format!("plant {named}:"))), "{notes:?}");
    let roomy = grow(&pair(Company::Kept), Seed::new(7)).unwrap().1;
    assert!(roomy.iter().all(|note| !note.contains("no room")), "{roomy:?}");
}

#[test]
fn fronds_of_a_high_crown_never_become_stems_on_a_finer_graph() {
    let palm = species("palm.ron", include_str!("../../../presets/species/palm.ron")).unwrap();
    // As builds seed them: these had two.
    for seed in [24, 35, 90, 107, 131] {
        let (plant, _) = grow(&GrowParams { seed, ..palm.clone() }, Seed::new(seed).child("grow")).unwrap();
        assert_eq!(plant.chains().iter().filter(|chain| chain.parent.is_none()).count(), 1, "{seed}");
    }
}

#[test]
fn a_stand_in_which_nothing_grows_is_an_error() {
    // Each trunk ends over another's ground.
    let culm = "(height: 9.0, nodes: 8000, width: 0.3, tip_radius: 0.01, iterations: [\
        (endpoints: Volume(shape: Point(height: 0.98, out: 0.12), count: 1)),\
        (endpoints: Volume(shape: Ellipsoid(bottom: 0.5, top: 0.98, radius: 0.1), count: 10))])";
    let culm = species("culm.ron", culm).unwrap();
    let mut params = culm.clone();
    let beside = [[2.0, 0.0], [-2.0, 0.0], [0.0, 2.0], [0.0, -2.0]];
    params.space.beside =
        (2..).zip(beside).map(|(seed, at)| Beside { params: GrowParams { seed, ..culm.clone() }, at }).collect();
    params.space.company = Company::Kept;
    for seed in 1..6 {
        let made = grow(&GrowParams { seed, ..params.clone() }, Seed::new(1));
        let is_low = |plant: &Plant| plant.height() < 9.0 * 0.35;
        assert!(!made.is_ok_and(|(plant, _)| is_low(&plant)), "{seed}");
    }
}

#[test]
fn trees_of_a_stand_share_the_space_without_touching() {
    let stand = grown(&pair(Company::Kept));
    let stems: Vec<Vec3> = stand.chains().iter().filter(|c| c.parent.is_none()).map(|c| c.origin).collect();
    assert_eq!(stems.len(), 2);
    assert!(stems[1].distance(Vec3::new(2.5, 0.0, 0.5)) < 0.4, "{}", stems[1]);
    let posed = stand.pose();
    let second = stand.chain_ids().filter(|&id| stand.chain(id).parent.is_none()).nth(1).unwrap();
    let split = stand.span(second).start;
    let (own, others) = posed.positions().split_at(split);
    assert!(own.iter().all(|p| others.iter().all(|q| p.distance(*q) > 0.02)));
    // Each keeps to its side: alone, the first reaches further towards the second.
    let reach = |plant: &Plant| {
        let posed = plant.pose();
        let count = |side: f32| posed.positions().iter().filter(|p| p.x * side > 1.2).count() as f32;
        count(1.0) / count(-1.0).max(1.0)
    };
    let (alone, beside) = (grown(&small(1.0)), grown(&pair(Company::LeftOut)));
    assert_eq!(beside.chains().iter().filter(|c| c.parent.is_none()).count(), 1);
    assert!(reach(&beside) < reach(&alone) * 0.8, "{} and {}", reach(&beside), reach(&alone));
}

#[test]
fn the_seed_decides_the_way_of_a_trunk_that_grows_past_others() {
    // It grows after the tree at whose foot it stands, towards one place: only whims tell its ways apart.
    let trunk = |seed: u64| {
        let mut params = small(1.0);
        let mut shrub = GrowParams { seed, height: 1.0, whim: 0.6, ..small(1.0) };
        shrub.iterations.truncate(1);
        params.space.beside = vec![Beside { params: shrub, at: [0.35, 0.0] }];
        params.space.company = Company::Kept;
        let stand = grow(&params, Seed::new(7)).unwrap().0;
        let second = stand.chain_ids().filter(|&id| stand.chain(id).parent.is_none()).nth(1).unwrap();
        stand.points(second).to_vec()
    };
    let trunks: Vec<_> = (1..5).map(trunk).collect();
    assert!(trunks.iter().skip(1).any(|other| *other != trunks[0]), "{trunks:?}");
}

#[test]
fn a_volume_that_the_region_cuts_off_is_told_with_the_width_that_holds_it() {
    let text = "(height: 8.0, nodes: 1500, width: 1.0, detail: 1.0, iterations: [\
        (endpoints: Volume(shape: Point(height: 0.6))),\
        (endpoints: Volume(shape: Box(bottom: 0.3, top: 0.9, width: 1.0, depth: 1.0), count: 30))])";
    let told = |text: &str| {
        let notes = grow(&species("s.ron", text).unwrap(), Seed::new(1)).unwrap().1;
        notes.into_iter().find(|note| note.contains("outside of the graph's region"))
    };
    let note = told(text).unwrap_or_default();
    assert!(note.starts_with("iteration 2: 21.") && note.contains("from a `width` of 1.42 on"), "{note}");
    assert_eq!(told(&text.replacen("width: 1.0", "width: 1.42", 1)), None);
}

#[test]
fn a_shrub_in_company_of_a_tree_is_as_whole_as_alone() {
    let shrub = |seed: u64| GrowParams { seed, height: 1.0, ..small(1.0) };
    let alone = grown(&shrub(3)).chains().len();
    // Beneath its crown, and far from it; the tree first, and the shrub.
    let near = |first: GrowParams, second: GrowParams, x: f32| {
        let mut params = first;
        params.space.beside = vec![Beside { params: second, at: [x, 0.3] }];
        params.space.company = Company::Kept;
        let (stand, notes) = grow(&params, Seed::new(7)).unwrap();
        let second = stand.chain_ids().filter(|&id| stand.chain(id).parent.is_none()).nth(1).unwrap();
        let posed = stand.pose();
        let (own, others) = posed.positions().split_at(stand.span(second).start);
        let apart = own.iter().flat_map(|p| others.iter().map(|q| p.distance(*q))).fold(f32::MAX, f32::min);
        let bounds = |all: &[Vec3]| all.iter().fold(0.0_f32, |top, p| top.max(p.y));
        (second.index(), stand.chains().len() - second.index(), apart, [bounds(own), bounds(others)], notes)
    };
    for x in [1.6, 30.0] {
        let (tree, shrubs, apart, [high, low], notes) = near(small(1.0), shrub(3), x);
        assert!(tree > 20 && shrubs * 3 > alone * 2, "{x}: {shrubs} of {alone}: {notes:?}");
        assert!(apart > 0.02 && (7.0..9.0).contains(&high) && (0.8..1.2).contains(&low), "{x}: {apart} {high} {low}");
        let (shrubs, tree, apart, [low, high], notes) = near(shrub(3), small(1.0), x);
        assert!(tree > 20 && shrubs * 3 > alone * 2, "{x}: {shrubs} of {alone}: {notes:?}");
        assert!(apart > 0.02 && (7.0..9.0).contains(&high) && (0.8..1.2).contains(&low), "{x}: {apart} {high} {low}");
    }
    // Trees of unlike heights whose crowns meet keep to themselves, whoever is higher.
    for [first, second] in [[8.0, 3.0], [3.0, 8.0]] {
        let of = |height: f32, seed: u64| GrowParams { seed, height, ..small(1.0) };
        let (_, _, apart, ..) = near(of(first, 1), of(second, 2), 1.5);
        assert!(apart > 0.02, "{first} and {second}: {apart}");
    }
    // What is left out takes room all the same.
    let mut params = shrub(3);
    params.space.beside = vec![Beside { params: small(1.0), at: [1.2, 0.0] }];
    let beside = grown(&params);
    assert!(beside.chains().iter().filter(|chain| chain.parent.is_none()).count() == 1 && beside != grown(&shrub(3)));
}

#[test]
fn nothing_grows_through_obstacles() {
    let (low, high) = ([0.6, 0.0, -4.0], [0.9, 9.0, 4.0]);
    for (detail, mesh) in [(1.0, false), (2.0, false), (1.0, true)] {
        let mut params = small(detail);
        let mut meshes = ObstacleMeshes::new();
        params.space.clearance = 0.05;
        params.space.obstacles = vec![Obstacle::Box { low, high }];
        if mesh {
            params.space.obstacles = vec![Obstacle::Mesh { file: "wall.glb".to_owned(), at: low }];
            let corner = |i: u32| {
                let side = |axis: usize| if i >> axis & 1 == 1 { high[axis] - low[axis] } else { 0.0 };
                Vec3::new(side(0), side(1), side(2))
            };
            let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
            let triangles = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]);
            meshes.insert("wall.glb".to_owned(), triangles.map(|t| t.map(corner)).collect());
        }
        let (plant, _) = grow_among(&params, &Solids::new(), &meshes, Seed::new(7)).unwrap();
        let posed = plant.pose();
        assert!(plant.chains().len() > 20);
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        assert!(posed.positions().iter().all(|p| !(p.cmpgt(low).all() && p.cmplt(high).all())));
        let free = grow(&small(detail), Seed::new(7)).unwrap().0;
        let beyond = |plant: &Plant| plant.pose().positions().iter().filter(|p| p.x > 0.9).count();
        assert!(beyond(&plant) < beyond(&free) / 3, "{} of {}", beyond(&plant), beyond(&free));
    }
    let mut params = small(1.0);
    params.space.obstacles = vec![Obstacle::Mesh { file: "gone.glb".to_owned(), at: [0.0; 3] }];
    assert_eq!(grow(&params, Seed::new(7)).unwrap_err(), GrowError::NoMesh("gone.glb".to_owned()));
}

#[test]
fn branches_reach_for_the_light() {
    let side = |strength: f32| {
        let mut params = small(1.0);
        params.space.light = Light { direction: [1.0, 0.3, 0.0], strength };
        let plant = grown(&params);
        let posed = plant.pose();
        posed.positions().iter().map(|p| p.x).sum::<f32>() / posed.positions().len() as f32
    };
    let (dark, bright) = (side(0.0), side(0.9));
    assert!(bright > dark + 0.1, "{dark} {bright}");
}

#[test]
fn extremes_of_the_surroundings_end_in_a_plant_or_an_error() {
    type Change = fn(&mut GrowSpace, &GrowParams);
    let changes: [Change; 12] = [
        |s, _| s.detail = 4.0,
        |s, _| s.detail = f32::NAN,
        |s, _| s.light = Light { direction: [0.0; 3], strength: 1.0 },
        |s, _| s.light = Light { direction: [0.0, -1.0, 0.0], strength: 1.0 },
        |s, _| s.obstacles = vec![Obstacle::Box { low: [-99.0; 3], high: [99.0; 3] }],
        |s, _| s.obstacles = vec![Obstacle::Box { low: [9.0; 3], high: [-9.0; 3] }],
        |s, _| {
            s.obstacles = vec![Obstacle::Box { low: [1.0, 0.0, 1.0], high: [1.0, 0.0, 1.0] }];
            s.clearance = 100.0;
        },
        |s, _| s.obstacles = vec![Obstacle::Box { low: [f32::INFINITY; 3], high: [1.0; 3] }],
        |s, p| s.beside = vec![Beside { params: p.clone(), at: [0.0, 0.0] }],
        |s, p| s.beside = vec![Beside { params: GrowParams { height: 80.0, ..p.clone() }, at: [32.0, 0.0] }],
        |s, p| s.beside = vec![Beside { params: GrowParams { height: 800.0, ..p.clone() }, at: [1.0, 0.0] }],
        |s, p| s.beside = (0..31).map(|i| Beside { params: p.clone(), at: [i as f32 * 0.5, 0.0] }).collect(),
    ];
    for (i, change) in changes.iter().enumerate() {
        let mut params = GrowParams { nodes: 600, ..small(1.0) };
        let plain = params.clone();
        change(&mut params.space, &plain);
        match grow(&params, Seed::new(1)) {
            Ok((plant, _)) => assert!(plant.height() > 0.0, "change {i}"),
            Err(GrowError::OutOfRange { field, .. }) => assert!(!field.is_empty()),
            Err(GrowError::Nothing | GrowError::Crowded { .. }) => assert!(i >= 4, "change {i}"),
            Err(other) => panic!("change {i}: {other}"),
        }
    }
}
