//! Promises of growth as a whole: what comes out for any parameters, and what the shipped species look like.

use glam::Vec3;

use super::growth::{Tree, grow_all};
use super::refine::Ways;
use super::skeleton;
use super::space::Space;
use super::structure::Structure;
use super::{Graph, GraphParams, GrowError, ObstacleMeshes, Solids, grow};
use crate::base::{Seed, math};
use crate::plant::{Plant, PlantStats};
use crate::preset::plan::{
    Count, EndpointRule, Endpoints, GrowIteration, GrowParams, GrowSpace, Guide, GuideAxis, GuideStart, LeaderRule,
    Light, Sampling, Volume,
};
use crate::preset::species;

fn pass(endpoints: Endpoints, first: f32) -> GrowIteration {
    let guide = Guide::Piecewise { alpha1: first, alpha2: 0.0, h0: 1 };
    GrowIteration { endpoints, guide, axis: GuideAxis::Vector, start: GuideStart::Kept, keep: EndpointRule::Any }
}

fn volume(shape: Volume, count: u32) -> Endpoints {
    Endpoints::Volume { shape, count: Count::Number(count), sampling: Sampling::Poisson }
}

fn surface(k: u32, t: f32, count: u32) -> Endpoints {
    Endpoints::Surface { k, t, irregular: 0.0, count, sampling: Sampling::Poisson }
}

fn point(height: f32) -> Endpoints {
    volume(Volume::Point { height, out: 0.0, turn: None }, 1)
}

pub(super) fn small() -> GrowParams {
    let crown = Volume::HalfEllipsoid { bottom: 0.4, top: 0.8, radius: 0.3, hollow: 0.2 };
    GrowParams {
        seed: 1,
        height: 9.0,
        nodes: 2500,
        width: 0.8,
        tip_radius: 0.01,
        allometry: 2.0,
        taper: 0.3,
        flare: 0.35,
        flare_height: 5.0,
        crookedness: 0.3,
        leader: LeaderRule::Held,
        length_cost: 0.2,
        whim: 0.15,
        bole: 0.1,
        slenderness: 10_000.0,
        space: GrowSpace { detail: 1.0, ..GrowSpace::default() },
        iterations: vec![pass(point(0.5), 0.0), pass(volume(crown, 12), 0.6), pass(surface(2, 0.7, 60), 0.5)],
    }
}

fn grown(params: &GrowParams) -> Plant {
    grow(params, Seed::new(7)).unwrap().0
}

#[test]
fn no_light_takes_the_only_end_of_a_trunk() {
    for turn in 0..12 {
        let (sin, cos) = math::sin_cos(turn as f32 * 0.52);
        let light = Light { direction: [cos, 0.0, sin], strength: 1.0 };
        let params = GrowParams { space: GrowSpace { light, ..small().space }, ..small() };
        let (plant, notes) = grow(&params, Seed::new(7)).unwrap();
        assert!(notes.iter().all(|note| !note.contains("no node is free")), "{turn}: {notes:?}");
        assert_eq!(plant.chains().iter().filter(|c| c.parent.is_none()).count(), 1);
    }
}

#[test]
fn a_tree_stands_at_the_origin_as_tall_as_asked() {
    let plant = grown(&small());
    assert!((plant.height() - 9.0).abs() < 1e-4);
    assert_eq!(plant.chains()[0].origin, Vec3::ZERO);
    assert!(plant.chains().iter().filter(|c| c.parent.is_none()).count() == 1);
    assert!(plant.chains().len() > 40 && plant.chains().iter().any(|c| c.order >= 3));
}

#[test]
fn a_plant_of_another_height_is_the_same_one_scaled() {
    // Some of its branches are shed, and which ones hangs on how thick they are for their length.
    let params = GrowParams { slenderness: 170.0, ..small() };
    let plant = grown(&params);
    let counts = [&plant, &grown(&small())].map(|p| p.chains().len());
    assert!(counts[0] > 20 && counts[0] < counts[1], "{counts:?}");
    for scale in [0.2, 3.0] {
        let other = grown(&params.clone().at_height(9.0 * scale));
        assert_eq!(plant.chains().len(), other.chains().len(), "{scale}");
        let near = |a: f32, b: f32| (a * scale - b).abs() < 1e-3 * scale;
        assert!(plant.all_radii().iter().zip(other.all_radii()).all(|(a, b)| near(*a, *b)), "{scale}");
        assert!(plant.all_points().iter().zip(other.all_points()).all(|(a, b)| near(a.distance(*b / scale), 0.0)));
    }
}

#[test]
fn a_trunk_that_leads_up_to_the_top_is_straight_up_to_its_tip() {
    let text = "(height: 10.0, nodes: 8000, width: 0.5, tip_radius: 0.005, allometry: 2.3, crookedness: 0.05, bole: 0.05,\
        slenderness: 10000.0, iterations: [\
        (endpoints: Volume(shape: Point(height: 0.97), count: 1)),\
        (endpoints: Volume(shape: Cone(bottom: 0.1, top: 0.95, radius: 0.2, hollow: 0.8), count: 60),\
         guide: Piecewise(alpha1: 70.0)),\
        (endpoints: Surface(k: 2, t: 1.0, count: 200), guide: Piecewise(alpha1: 30.0))])";
    let mut params = species("mast.ron", text).unwrap();
    for seed in 3..6 {
        params.seed = seed;
        let (plant, _) = grow(&params, Seed::new(seed).child("grow")).unwrap();
        let trunk = plant.points(plant.chain_ids().next().unwrap());
        let line = trunk[trunk.len() - 1];
        assert!(line.y > 9.5, "{line}");
        let sway = trunk.iter().map(|p| (*p - line * (p.y / line.y)).length()).fold(0.0_f32, f32::max);
        assert!(sway < 0.035 * line.y, "{seed}: {sway}");
    }
}

#[test]
fn one_thread_and_two_grow_the_same_tree() {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| grow(&small(), Seed::new(7)).unwrap())
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn another_seed_grows_another_tree() {
    let mut other = small();
    other.seed = 2;
    assert_ne!(grown(&small()), grown(&other));
    assert_ne!(grow(&small(), Seed::new(8)).unwrap().0, grown(&small()));
}

/// The structure that some parameters grow, its graph, its ways, and what is told.
fn structure(params: &GrowParams) -> (Structure, Graph, Ways, Vec<String>) {
    let graph = Graph::new(&GraphParams::of(params, &Solids::new()).unwrap(), &ObstacleMeshes::new()).unwrap();
    let mut trees = [Tree::new(params, 1.0, Seed::new(4))];
    let ways = grow_all(graph.own(), &mut trees, &[], &params.space, &Solids::new()).remove(0);
    let [tree] = trees;
    (tree.structure, graph, ways, tree.notes)
}

#[test]
fn every_endpoint_is_reached_or_told_of() {
    let (structure, graph, _, notes) = structure(&small());
    let Space { nodes, graph, .. } = graph.space();
    assert!(notes.is_empty(), "{notes:?}");
    let tips = 1 + 12 + 60;
    let mut bears = vec![false; structure.members.len()];
    structure.members.iter().skip(1).for_each(|m| bears[m.parent as usize] = true);
    let found = bears.iter().filter(|b| !**b).count();
    // A branch that ends on the way of a later one has no tip of its own.
    assert!(found <= tips && found > tips * 3 / 4, "{found}");
    // A tree: every member once, after its parent, one edge of the graph away.
    let mut seen = vec![false; nodes.len()];
    for (i, member) in structure.members.iter().enumerate() {
        assert!(!std::mem::replace(&mut seen[member.node as usize], true));
        assert!(i == 0 || (member.parent as usize) < i);
        let parent = structure.members[member.parent as usize].node;
        assert!(i == 0 || graph.leaving(parent).any(|n| n == member.node));
        assert!((member.vector.length() - 1.0).abs() < 1e-4);
    }
}

#[test]
fn finer_ways_lead_to_the_same_endpoints_and_share_no_node() {
    let mut params = small();
    params.space.detail = 2.0;
    let (structure, graph, ways, _) = structure(&params);
    let nodes = &graph.space().nodes;
    let bits = |p: Vec3| p.to_array().map(f32::to_bits);
    let mut seen = std::collections::BTreeSet::new();
    for (i, &place) in ways.places.iter().enumerate() {
        assert!(seen.insert(bits(place)), "two branches share {place}");
        assert!(i == 0 || (ways.parents[i] as usize) < i);
    }
    for run in &structure.runs {
        let next = structure.runs.iter().map(|r| r.first).find(|&first| first > run.first);
        let end = next.unwrap_or(structure.members.len() as u32) - 1;
        assert!(seen.contains(&bits(nodes.at(structure.members[end as usize].node))));
    }
    assert!(ways.places.len() > structure.members.len() * 3 / 2, "{}", ways.places.len());
    // Each edge is one of finer nodes.
    let hop = nodes.hop();
    let lengths = (1..ways.places.len()).map(|i| ways.places[i].distance(ways.places[ways.parents[i] as usize]));
    let long = lengths.filter(|length| *length > hop * 1.2).count();
    assert!(long * 50 < ways.places.len(), "{long}");
}

#[test]
fn more_endpoints_than_room_are_told_of() {
    let mut params = small();
    params.iterations[1].endpoints =
        volume(Volume::Cylinder { bottom: 0.9, top: 0.95, radius: 0.1, hollow: 0.0 }, 5000);
    let (_, notes) = grow(&params, Seed::new(1)).unwrap();
    let told = |n: &&String| n.starts_with("endpoints that found a place: ") && n.contains(" of 5000 in iteration 2");
    assert_eq!(notes.iter().filter(told).count(), 1, "{notes:?}");
}

#[test]
fn nothing_forks_below_the_clear_bole() {
    let mut params = small();
    params.bole = 0.3;
    // Height of the region is not quite the plant's: twigs end below or at 1.
    let plant = grown(&params);
    let posed = plant.pose();
    for id in plant.chain_ids().filter(|&id| plant.chain(id).parent.is_some()) {
        assert!(posed.chain(&plant, id)[0].y > 9.0 * 0.29);
    }
}

#[test]
fn no_twigs_hang_down_beside_a_clear_bole() {
    // A crown from 0.35 up, and twigs anywhere around it.
    let mut params = GrowParams { bole: 0.35, ..small() };
    params.iterations[2] = pass(surface(2, 1.0, 400), 0.5);
    let plant = grown(&params);
    let posed = plant.pose();
    let low = 9.0 * 0.2;
    let hanging = |id: &crate::plant::ChainId| posed.chain(&plant, *id).iter().any(|point| point.y < low);
    let hanging = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_some()).filter(hanging).count();
    assert_eq!(hanging, 0);
}

#[test]
fn a_bole_above_the_trunks_top_makes_no_stems() {
    for detail in [1.0, 2.0] {
        let mut params = small();
        params.bole = 0.6;
        params.space.detail = detail;
        let plant = grown(&params);
        assert_eq!(plant.chains().iter().filter(|c| c.parent.is_none()).count(), 1, "{detail}");
        assert!(plant.chains().len() > 20);
    }
}

#[test]
fn a_crown_that_is_shed_is_told_with_what_helps() {
    let note = |slenderness: f32| {
        let notes = grow(&GrowParams { slenderness, ..small() }, Seed::new(7)).unwrap().1;
        notes.into_iter().find(|note| note.contains("shed")).unwrap_or_default()
    };
    assert_eq!(note(10_000.0), "");
    assert!(note(50.0).ends_with("% of all branches; raise `slenderness` or `tip_radius`"), "{}", note(50.0));
}

#[test]
fn many_first_endpoints_make_stems_of_their_own() {
    let mut params = small();
    let shape = Volume::HalfEllipsoid { bottom: 0.3, top: 0.8, radius: 0.35, hollow: 0.7 };
    params.iterations = vec![pass(volume(shape, 10), 0.1)];
    params.bole = 0.15;
    let plant = grown(&params);
    let stems = plant.chains().iter().filter(|c| c.parent.is_none()).count();
    assert!((4..=10).contains(&stems), "{stems}");
    assert!(plant.chains().iter().all(|c| c.origin.y == 0.0 && c.origin.length() < 9.0 * 0.15));
}

#[test]
fn children_of_a_limb_spread_to_its_sides_where_the_edge_decides_the_axis() {
    // A trunk, a limb that rises along x, and twigs.
    let sides = |axis: GuideAxis| {
        let mut params = small();
        let limb = Volume::Point { height: 0.75, out: 0.3, turn: Some(0.0) };
        let twigs = GrowIteration { axis, ..pass(surface(2, 1.0, 120), 0.8) };
        params.iterations = vec![pass(point(0.4), 0.0), pass(volume(limb, 1), 0.8), twigs];
        let (structure, graph, ..) = structure(&params);
        let first = structure.runs.iter().find(|run| run.pass == 2).unwrap().first as usize;
        let before = |i: usize| structure.members[i].parent as usize;
        let leaves_limb = |i: &usize| before(*i) < first && structure.members[before(*i)].vector.x > 0.3;
        let firsts: Vec<usize> = (first..structure.members.len()).filter(leaves_limb).collect();
        assert!(firsts.len() > 10, "{}", firsts.len());
        let nodes = &graph.space().nodes;
        // How far each leans to the side of the limb that its edge leads to.
        let aside = |&i: &usize| {
            let edge = nodes.at(structure.members[i].node) - nodes.at(structure.members[before(i)].node);
            structure.members[i].vector.z * edge.z.signum()
        };
        firsts.iter().map(aside).sum::<f32>() / firsts.len() as f32
    };
    let (vector, edge) = (sides(GuideAxis::Vector), sides(GuideAxis::Edge));
    assert!(edge > 0.08 && edge > vector + 0.05, "{edge} {vector}");
}

#[test]
fn length_and_whims_cost_what_a_species_says() {
    let length = |length_cost: f32, whim: f32| {
        let plant = grown(&GrowParams { length_cost, whim, ..small() });
        let posed = plant.pose();
        let of = |id| posed.chain(&plant, id).windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f32>();
        plant.chain_ids().map(of).sum::<f32>()
    };
    // Where length costs nothing branches run beside each other; where it costs much they leave nearby.
    let (free, usual, dear) = (length(0.0, 0.15), length(0.2, 0.15), length(1.0, 0.15));
    assert!(free > usual && usual > dear, "{free} {usual} {dear}");
    // Without whims plants of a species share the way to the end of their trunks.
    let trunk = |whim: f32, seed: u64| {
        let mut params = GrowParams { seed, whim, ..small() };
        params.iterations = vec![pass(point(0.9), 0.0)];
        grown(&params).points(crate::plant::ChainId(0)).to_vec()
    };
    assert_eq!(trunk(0.0, 1), trunk(0.0, 2));
    assert!((2..6).any(|seed| trunk(0.6, seed) != trunk(0.6, 1)));
}

#[test]
fn a_free_leader_holds_nothing_back() {
    // A trunk with level shoots, of which the uppermost is longer than what is left of the trunk above it.
    let heights = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.92, 1.0];
    let mut places: Vec<Vec3> = heights.map(|y| Vec3::Y * y).to_vec();
    let mut parents: Vec<u32> = (0..11_u32).map(|k| k.saturating_sub(1)).collect();
    for at in [3_usize, 6, 9] {
        let first = places.len() as u32;
        parents.extend([at as u32, first]);
        places.extend([0.15, 0.3].map(|out| Vec3::new(out, heights[at], 0.0)));
    }
    let ways = Ways { places, parents, first: 1.0, fine: 1.0, finer: 0 };
    let reach = |leader: LeaderRule| {
        let params = GrowParams { leader, crookedness: 1.0, bole: 0.0, height: 1.0, ..small() };
        let made = skeleton::skeleton(&ways, &params, None, &|_, _| false).unwrap();
        let upper = made.nodes.iter().filter(|node| node.position.y > 0.85);
        upper.map(|node| node.position.x).fold(0.0, f32::max)
    };
    let (held, free) = (reach(LeaderRule::Held), reach(LeaderRule::Free));
    assert!(held < 0.1 && (free - 0.3).abs() < 1e-3, "{held} {free}");
}

#[test]
fn rules_keep_only_what_lies_lower_or_higher() {
    for (keep, sign) in [(EndpointRule::Lower, -1.0), (EndpointRule::Higher, 1.0)] {
        let mut params = small();
        // Limbs leave the trunk above this height, and the crown reaches below it.
        params.bole = 0.3;
        params.iterations.truncate(1);
        let trunk = structure(&params).0.members.len();
        let crown = Volume::Cylinder { bottom: 0.15, top: 0.7, radius: 0.35, hollow: 0.2 };
        params.iterations = small().iterations;
        params.iterations[1] = GrowIteration { keep, ..pass(volume(crown, 12), 0.6) };
        params.iterations.truncate(2);
        let (structure, graph, _, _) = structure(&params);
        let nodes = &graph.space().nodes;
        let parents: Vec<u32> = structure.members.iter().map(|m| m.parent).collect();
        let mut tips = 0;
        for (i, member) in structure.members.iter().enumerate().skip(trunk) {
            if parents.contains(&(i as u32)) {
                continue;
            }
            tips += 1;
            let mut source = i;
            while source >= trunk {
                source = parents[source] as usize;
            }
            let rise = nodes.at(member.node).y - nodes.at(structure.members[source].node).y;
            assert!(rise * sign > 0.0);
        }
        assert!(tips > 0);
    }
}

#[test]
fn extremes_end_in_a_plant_or_an_error() {
    type Change = fn(&mut GrowParams);
    let changes: [Change; 22] = [
        |p| p.nodes = 16,
        |p| p.nodes = 0,
        |p| p.width = 0.02,
        |p| p.width = 20.0,
        |p| p.width = f32::NAN,
        |p| p.height = 0.01,
        |p| p.height = f32::INFINITY,
        |p| p.tip_radius = 0.0,
        |p| p.allometry = 0.5,
        |p| p.taper = 1000.0,
        |p| p.flare = 10.0,
        |p| p.flare_height = f32::NAN,
        |p| p.crookedness = 1.0,
        |p| p.bole = 1.0,
        |p| p.slenderness = 50.0,
        |p| p.iterations.clear(),
        |p| p.iterations = vec![p.iterations[2].clone(); 20],
        |p| p.iterations[0].endpoints = point(0.0),
        |p| p.iterations[2].endpoints = surface(u32::MAX, 1.0, u32::MAX),
        |p| p.iterations[2].endpoints = surface(0, 0.0, 0),
        |p| p.iterations[1].guide = Guide::Random { low: -12.0, high: 12.0, alpha2: 0.0, h0: 1 },
        |p| p.iterations[1].guide = Guide::Polar { theta: f32::NAN },
    ];
    for (i, change) in changes.iter().enumerate() {
        let mut params = small();
        change(&mut params);
        match grow(&params, Seed::new(1)) {
            Ok((plant, _)) => assert!((plant.height() / params.height - 1.0).abs() < 1e-3, "change {i}"),
            Err(GrowError::OutOfRange { field, .. }) => assert!(!field.is_empty()),
            Err(GrowError::Nothing) => assert_ne!(i, 0),
            Err(other) => panic!("change {i}: {other}"),
        }
    }
}

#[test]
fn shipped_species_have_their_habit() {
    let figures = |name: &str, text: &str| {
        let mut params = species(name, text).unwrap();
        // Coarser than shipped, for time; the habit is the iterations'.
        params.nodes /= 4;
        let (plant, _) = grow(&params, Seed::new(1)).unwrap();
        let stats = PlantStats::of(&plant);
        assert!((300..3000).contains(&stats.chains), "{name}: {}", stats.chains);
        assert!((3..=9).contains(&stats.orders.len()), "{name}: {}", stats.orders.len());
        assert!((stats.height - params.height).abs() < 1e-3);
        stats
    };
    let oak = figures("oak", include_str!("../../../presets/species/oak.ron"));
    let birch = figures("birch", include_str!("../../../presets/species/birch.ron"));
    let shrub = figures("shrub", include_str!("../../../presets/species/shrub.ron"));
    assert!(oak.width > oak.height * 0.85 && birch.width < birch.height * 0.75);
    assert!(oak.base_radius > birch.base_radius * 2.0);
    assert_eq!((oak.stems, birch.stems), (1, 1));
    assert!(shrub.stems >= 5);
}
