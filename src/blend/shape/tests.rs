//! Tests of tree-shape space: metric, geodesics, means, symmetry.

use super::*;
use crate::base::Seed;
use crate::plant::{Curve, Plant, PlantBuilder, PlantStats};
use crate::preset::plan::{ChainPath, ElasticParams, Facing, MatchParams};
use crate::relate::random_plant::{Oddity, random_plant};
use crate::relate::{Family, elastic_family, nway_family};
use glam::Vec3;

const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

/// Families whose sources order their branches as they like, and such that agree.
fn family(seed: u64, count: u64) -> Family {
    let plants = (0..count).map(|i| random_plant(Seed::new(seed).at(i), 40, Oddity::Tame)).collect();
    if seed.is_multiple_of(2) {
        nway_family(plants, &EVEN).unwrap()
    } else {
        elastic_family(plants, &ElasticParams { path: ChainPath::Straight, ..ElasticParams::default() }).unwrap()
    }
}

fn qed(a: &TreePoint, b: &TreePoint) -> f64 {
    TreeGeodesic::new(a, b).length()
}

#[test]
fn qed_and_edit_distance_are_metrics_on_one_family() {
    let mut turns = 0;
    for seed in 0..12 {
        let family = family(seed, 4);
        let mut points: Vec<TreePoint> = (0..4).map(|s| TreePoint::of(&family, s)).collect();
        points.push(TreeGeodesic::new(&points[0], &points[1]).at(0.3));
        points.push(TreeGeodesic::new(&points[2], &points[3]).at(0.6));
        points.push(TreeGeodesic::new(&points[4], &points[5]).midpoint());
        for a in &points {
            assert_eq!(qed(a, a), 0.0);
            for b in &points {
                let way = TreeGeodesic::new(a, b);
                turns += way.turns();
                assert!((way.length() - qed(b, a)).abs() <= way.length() * 1e-9);
                assert!(way.edit_length() >= way.length() * (1.0 - 1e-9));
                for c in &points {
                    assert!(qed(a, c) <= (way.length() + qed(b, c)) * (1.0 + 1e-9), "seed {seed}");
                }
            }
        }
    }
    // Orders of branches that conflict must have been among them.
    assert!(turns > 50, "{turns}");
}

#[test]
fn points_of_a_geodesic_are_evenly_spaced_and_its_pieces_add_up() {
    for seed in 0..16 {
        let family = family(seed, 2);
        let way = TreeGeodesic::new(&TreePoint::of(&family, 0), &TreePoint::of(&family, 1));
        let points: Vec<TreePoint> = (0..=10).map(|i| way.at(f64::from(i) / 10.0)).collect();
        for pair in points.windows(2) {
            assert!((qed(&pair[0], &pair[1]) - way.length() / 10.0).abs() < way.length() * 1e-6, "seed {seed}");
        }
        let middle = way.midpoint();
        assert!((qed(&points[0], &middle) - qed(&middle, &points[10])).abs() < way.length() * 1e-6);
        // Shorter than by the cone, longer than the plain difference of norms.
        for point in &points {
            let plant = point.plant().unwrap();
            assert!(PlantStats::of(&plant).topology_continuity == 1.0 && plant.height() > 0.0);
        }
    }
}

/// A trunk of five equal stretches with branches that leave in the given order.
fn comb(order: &[usize]) -> Plant {
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 5.0], &[0.0, 0.0]);
    for branch in 0..order.len() {
        let place = order.iter().position(|b| *b == branch).unwrap();
        let out = Seed::new(5).at(branch as u64).direction() * Vec3::new(1.0, 0.2, 1.0);
        builder.branch(stem, (place + 1) as f32 / (order.len() + 1) as f32, &[Vec3::ZERO, out], &[0.0; 2]);
    }
    builder.finish().unwrap()
}

/// A family in which branch i goes with branch i.
fn matched(a: &[usize], b: &[usize]) -> Family {
    let plants = vec![comb(a), comb(b)];
    let kins: Vec<crate::relate::Kin> = plants[0]
        .chain_ids()
        .map(|id| crate::relate::Kin {
            parent: plants[0].chain(id).parent.map(|p| crate::relate::KinId(p.0)),
            members: vec![Some(id); 2],
        })
        .collect();
    Family::new(plants, &kins).unwrap()
}

#[test]
fn branches_that_pass_each_other_collapse_the_stretch_between_them() {
    // One stretch of 5/3 m in each that the other can't have: |A| + |B|, by its five landmarks.
    let family = matched(&[0, 1], &[1, 0]);
    let way = TreeGeodesic::new(&TreePoint::of(&family, 0), &TreePoint::of(&family, 1));
    let stretch = 5.0 / 3.0 * ((1.0 + 4.0 + 9.0 + 16.0 + 25.0) / 25.0_f64).sqrt();
    assert!((way.length() - 2.0 * stretch).abs() < 1e-5 && way.turns() == 1, "{}", way.length());
    let middle = way.midpoint();
    assert_eq!(middle.axes[0].groups, [vec![1, 2]]);
    // Two pairs that pass at other places of the trunk: independent legs.
    let family = matched(&[0, 1, 2, 3], &[1, 0, 3, 2]);
    let way = TreeGeodesic::new(&TreePoint::of(&family, 0), &TreePoint::of(&family, 1));
    assert_eq!(way.turns(), 2);
    // All order turned round: one cone.
    let family = matched(&[0, 1, 2], &[2, 1, 0]);
    let way = TreeGeodesic::new(&TreePoint::of(&family, 0), &TreePoint::of(&family, 1));
    assert_eq!(way.turns(), 1);
    assert_eq!(way.midpoint().axes[0].groups, [vec![1, 2, 3]]);
}

#[test]
fn no_path_through_the_same_edges_is_shorter() {
    // All ways of ordering the collapses and expansions of a crossing of four, against the straightened path.
    for seed in 0..24 {
        let mut order: Vec<usize> = (0..4).collect();
        for i in (1..4).rev() {
            order.swap(i, Seed::new(seed).at(i as u64).index(i + 1));
        }
        let family = matched(&[0, 1, 2, 3], &order);
        let (a, b) = (TreePoint::of(&family, 0), TreePoint::of(&family, 1));
        let way = TreeGeodesic::new(&a, &b);
        for i in 0..200 {
            // A way round by a random third point is never shorter.
            let third =
                TreeGeodesic::new(&way.at(f64::from(Seed::new(i).unit())), &TreePoint::of(&family, (i % 2) as usize))
                    .at(f64::from(Seed::new(i).child("at").unit()));
            assert!(qed(&a, &third) + qed(&third, &b) >= way.length() * (1.0 - 1e-9));
        }
    }
}

#[test]
fn sturms_mean_is_the_midpoint_of_two_and_makes_the_variance_least() {
    for seed in 0..6 {
        let family = family(seed, 3);
        let points: Vec<TreePoint> = (0..3).map(|s| TreePoint::of(&family, s)).collect();
        let two = frechet_mean(&points[..2], &[1.0, 1.0], 1).unwrap();
        assert!(qed(&two, &TreeGeodesic::new(&points[0], &points[1]).midpoint()) < 1e-9);
        let mean = frechet_mean(&points, &[1.0; 3], 20).unwrap();
        let least = variance(&mean, &points, &[1.0; 3]);
        for point in &points {
            let off = TreeGeodesic::new(&mean, point).at(0.1);
            assert!(variance(&off, &points, &[1.0; 3]) > least, "seed {seed}");
        }
        assert!(mean.plant().is_ok());
    }
    assert!(frechet_mean(&[], &[], 3).is_none());
}

#[test]
fn the_maximal_tree_is_never_written_out() {
    let family = family(1, 2);
    let point = TreePoint::of(&family, 0);
    let tree = BinaryTree::of(&point);
    let edges: usize = point.axes.iter().map(|a| a.edges.len()).sum();
    assert!(tree.nodes().len() <= 2 * edges);
    // Every node has at most one child on each side, and its address is its depth.
    let mut seen = std::collections::BTreeSet::new();
    for (i, node) in tree.nodes().iter().enumerate() {
        assert!(node.parent.is_none() || seen.insert((node.parent, node.side == Side::Along)));
        let steps: u32 = tree.address(i as u32).iter().map(|run| run.1).sum();
        assert_eq!(steps, node.depth);
    }
    // A trunk with two hundred branches: 2^200 places, some hundred nodes.
    let order: Vec<usize> = (0..200).collect();
    let family = matched(&order, &order);
    let tree = BinaryTree::of(&TreePoint::of(&family, 0));
    assert!(tree.depth() >= 200 && tree.nodes().len() <= 802);
}

#[test]
fn a_distance_is_symmetric_to_the_last_bit_and_zero_for_the_same() {
    for seed in 0..6 {
        let plant = |name| random_plant(Seed::new(seed).child(name), 30, Oddity::Tame);
        let (a, b) = (plant("a"), plant("b"));
        for metric in [Metric::Qed, Metric::Edit, Metric::Elastic] {
            for facing in [Facing::Fixed, Facing::Free] {
                let size = if seed.is_multiple_of(2) { Size::AsIs } else { Size::Relative };
                let how = Comparison { facing, size, ..Comparison::by(metric) };
                let of = |a: &Plant, b: &Plant| distance(a, b, &how).unwrap();
                assert_eq!(of(&a, &a), 0.0);
                let there = of(&a, &b);
                assert!(there > 0.0 && there == of(&b, &a));
            }
        }
    }
}

#[test]
fn a_turned_plant_is_found_again() {
    let plant = random_plant(Seed::new(12), 40, Oddity::Tame);
    let turned = crate::relate::turned(&plant, 1.9);
    let how = Comparison::by(Metric::Elastic);
    let far = distance(&plant, &turned, &how).unwrap();
    let near = distance(&plant, &turned, &Comparison { facing: Facing::Free, ..how }).unwrap();
    assert!(near < far * 0.1, "{near} {far}");
}

#[test]
fn the_best_plane_is_found_on_straight_ways_too() {
    let params = ElasticParams { path: ChainPath::Straight, ..ElasticParams::default() };
    let plant = random_plant(Seed::new(3), 40, Oddity::Tame);
    let best = Reflection::best(&plant, &params).unwrap();
    for i in 0..9 {
        let across = Reflection::across(&plant, i as f32 * std::f32::consts::PI / 9.0, &params).unwrap();
        assert!(across.asymmetry().is_finite() && best.asymmetry() <= across.asymmetry(), "{i}");
    }
    // At the far end it is the reflection.
    let (end, image) = (best.symmetrized(2.0), crate::relate::turned(&best.family().sources()[1], best.azimuth()));
    let (end, image) = (end.pose(), image.pose());
    assert!(end.positions().iter().zip(image.positions()).all(|(a, b)| a.distance(*b) < 1e-4));
}

#[test]
fn what_a_bent_chain_bears_keeps_to_its_points_while_it_is_made_symmetric() {
    // A limb along the plane that swings out of it for a while: that gets shorter, and the rest longer.
    let mut builder = PlantBuilder::new();
    let trunk = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.1]);
    let at = |i: i32| Vec3::new(0.06 * (10 - (i - 25).abs()).max(0) as f32, 0.0, 0.05 * i as f32);
    let points: Vec<Vec3> = (0..=60).map(at).collect();
    let radii: Vec<f32> = (0..=60).map(|i| 0.1 - 0.0015 * i as f32).collect();
    let limb = builder.branch(trunk, 0.5, &points, &radii);
    builder.branch(limb, 0.75, &[Vec3::ZERO, Vec3::Y], &[0.03, 0.01]);
    let plant = builder.finish().unwrap();
    let radius = |plant: &Plant| {
        let twig = plant.chain_ids().find(|&id| plant.chain(id).order == 3).unwrap();
        let limb = plant.chain(twig).parent.unwrap();
        Curve::new(plant.points(limb)).value(plant.radii(limb), f64::from(plant.chain(twig).location))
    };
    let made = Reflection::across(&plant, 0.0, &ElasticParams::default()).unwrap().symmetrized(1.0);
    assert_eq!(made.chains().len(), 3);
    assert!((radius(&made) - radius(&plant)).abs() < 0.002, "{} {}", radius(&made), radius(&plant));
}

#[test]
fn a_symmetrized_plant_is_symmetric() {
    let params = ElasticParams::default();
    for seed in 0..8 {
        let plant = random_plant(Seed::new(seed), 40, Oddity::Tame);
        let reflection = Reflection::across(&plant, 0.4, &params).unwrap();
        assert!(reflection.symmetrized(0.0).chains().len() == plant.chains().len());
        let made = reflection.symmetrized(1.0);
        let again = Reflection::across(&made, 0.4, &params).unwrap();
        assert!(
            again.deviation() < plant.height() * 1e-4,
            "seed {seed}: {} {}",
            again.deviation(),
            reflection.deviation()
        );
        let half = Reflection::across(&reflection.symmetrized(0.5), 0.4, &params).unwrap();
        assert!(half.asymmetry() < reflection.asymmetry());
    }
}
