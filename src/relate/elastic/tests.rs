//! Tests of elastic families: correspondence, corners, and the metric of their shape space.

use super::*;
use crate::base::Seed;
use crate::plant::{ChainId, Plant, PlantStats};
use crate::preset::plan::{ChainPath, ElasticParams};
use crate::relate::random_plant::{Oddity, random_plant};
use crate::relate::{Blender, Family, KinId, Weights};

fn family(seed: u64, count: u64, oddity: Oddity, path: ChainPath) -> Family {
    let plants = (0..count).map(|i| random_plant(Seed::new(seed).at(i), 40, oddity)).collect();
    elastic_family(plants, &ElasticParams { path, ..ElasticParams::default() }).unwrap()
}

/// The weighted mean of the sources: what has no member has no length.
pub(super) fn even(family: &Family, shares: &[f32]) -> Weights {
    let mut weights = Weights::new(family.kin_count(), shares.len());
    let whole: f32 = shares.iter().sum();
    for kin in family.kin_ids() {
        let held: f32 = (0..shares.len()).filter(|&s| family.member(kin, s).is_some()).map(|s| shares[s]).sum();
        let held = held / whole;
        weights.set(kin, shares, held);
    }
    weights
}

#[test]
fn every_chain_is_in_one_kin_and_corners_are_the_sources() {
    for seed in 0..30 {
        let oddity = if seed % 2 == 0 { Oddity::Tame } else { Oddity::Wild };
        let path = if seed % 3 == 0 { ChainPath::Straight } else { ChainPath::Elastic };
        let family = family(seed, 2 + seed % 3, oddity, path);
        for (s, plant) in family.sources().iter().enumerate() {
            let mut seen = vec![0; plant.chains().len()];
            family.kin_ids().filter_map(|k| family.member(k, s)).for_each(|c| seen[c.index()] += 1);
            assert!(seen.iter().all(|n| *n == 1));
            assert!(family.blend(&family.corner(s)) == *plant, "seed {seed}, source {s}");
            let shares: Vec<f32> = (0..family.sources().len()).map(|i| if i == s { 1.0 } else { 0.0 }).collect();
            assert!(family.blend(&even(&family, &shares)) == *plant);
        }
    }
}

#[test]
fn just_off_a_corner_nothing_jumps() {
    for seed in 0..20 {
        let path = if seed % 2 == 0 { ChainPath::Straight } else { ChainPath::Elastic };
        let family = family(seed, 2, Oddity::Tame, path);
        for s in 0..2 {
            let source = &family.sources()[s];
            let t = if s == 0 { 1e-6 } else { 1.0 - 1e-6 };
            let (off, kins) = family.blend_with_kins(&even(&family, &[1.0 - t, t]));
            let (posed, near) = (source.pose(), off.pose());
            for (id, &kin) in off.chain_ids().zip(&kins) {
                let Some(own) = family.member(kin, s) else { continue };
                for i in 0..=4 {
                    let t = f64::from(i) / 4.0;
                    let (a, b) = (posed.curve(source, own).point(t), near.curve(&off, id).point(t));
                    assert!(a.distance(b) < source.height() * 1e-3, "seed {seed} {kin:?}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn the_same_plant_matches_itself_chain_by_chain_and_the_order_of_sources_changes_nothing() {
    for seed in 0..10 {
        let plant = random_plant(Seed::new(seed), 60, Oddity::Tame);
        let other = random_plant(Seed::new(seed).child("other"), 60, Oddity::Tame);
        let twins = elastic_family(vec![plant.clone(), plant.clone()], &ElasticParams::default()).unwrap();
        assert_eq!(twins.kin_count(), plant.chains().len());
        assert!(twins.kin_ids().all(|k| twins.member(k, 0) == twins.member(k, 1)));
        let corner = |family: &Family, s| family.shape_point(&family.corner(s)).unwrap();
        assert_eq!(corner(&twins, 0).distance(&corner(&twins, 1)), 0.0);
        let pair =
            |a: &Plant, b: &Plant| elastic_family(vec![a.clone(), b.clone()], &ElasticParams::default()).unwrap();
        let (there, back) = (pair(&plant, &other), pair(&other, &plant));
        assert_eq!(there.kin_count(), back.kin_count());
        for kin in there.kin_ids() {
            let members = |f: &Family, a, b| (f.member(kin, a), f.member(kin, b));
            assert_eq!(members(&there, 0, 1), members(&back, 1, 0));
        }
    }
}

#[test]
fn matched_branches_keep_their_order_along_every_source() {
    for seed in 0..20 {
        let family = family(seed, 3, Oddity::Tame, ChainPath::Elastic);
        for kin in family.kin_ids() {
            for s in 0..3 {
                let places: Vec<f32> = family.children(kin).filter_map(|c| family.place_on(c, s)).collect();
                assert!(places.windows(2).all(|w| w[0] <= w[1] + 1e-5), "seed {seed}: {places:?}");
            }
        }
    }
}

#[test]
fn equal_steps_are_equally_far_and_the_length_is_the_distance() {
    for seed in 0..16 {
        let family = family(seed, 2, Oddity::Tame, ChainPath::Elastic);
        let point = |t: f32| family.shape_point(&even(&family, &[1.0 - t, t])).unwrap();
        let whole = point(0.0).distance(&point(1.0));
        let points: Vec<ShapePoint> = (0..=8).map(|i| point(i as f32 / 8.0)).collect();
        for pair in points.windows(2) {
            assert!((pair[0].distance(&pair[1]) - whole / 8.0).abs() < whole * 1e-4, "seed {seed}");
        }
        assert!((points[4].distance(&points[0]) - points[4].distance(&points[8])).abs() < whole * 1e-4);
    }
}

#[test]
fn the_elastic_metric_is_a_metric_on_one_family() {
    for seed in 0..8 {
        let family = family(seed, 4, Oddity::Tame, ChainPath::Elastic);
        let draw = |i: u64| {
            let shares: Vec<f32> = (0..4)
                .map(|s| {
                    let u = Seed::new(seed).at(i).at(s).unit();
                    u * u * u
                })
                .collect();
            family.shape_point(&even(&family, &shares)).unwrap()
        };
        let mut points: Vec<ShapePoint> = (0..4).map(|s| family.shape_point(&family.corner(s)).unwrap()).collect();
        points.extend((0..5).map(draw));
        for a in &points {
            for b in &points {
                assert_eq!(a.distance(b), b.distance(a));
                for c in &points {
                    assert!(a.distance(c) <= (a.distance(b) + b.distance(c)) * (1.0 + 1e-9));
                }
            }
        }
    }
}

#[test]
fn a_chain_that_turns_keeps_its_length_and_what_is_placed_is_what_the_point_says() {
    for seed in 0..10 {
        let family = family(seed, 2, Oddity::Tame, ChainPath::Elastic);
        let (plant, kins) = family.blend_with_kins(&even(&family, &[0.5, 0.5]));
        assert_eq!(PlantStats::of(&plant).topology_continuity, 1.0);
        let length = |p: &Plant, id: ChainId| crate::plant::Curve::new(p.points(id)).length();
        for (id, &kin) in plant.chain_ids().zip(&kins) {
            let members: Vec<f32> =
                (0..2).map(|s| family.member(kin, s).map_or(0.0, |c| length(&family.sources()[s], c))).collect();
            let wanted = (members[0] + members[1]) * 0.5;
            assert!((length(&plant, id) - wanted).abs() < wanted * 1e-3 + 1e-6, "{kin:?}");
        }
    }
}

#[test]
fn blends_one_after_the_other_are_those_of_new_blenders() {
    let family = family(5, 3, Oddity::Wild, ChainPath::Elastic);
    let mut blender = Blender::new(&family);
    for i in 0..20 {
        let shares: Vec<f32> = (0..3).map(|s| Seed::new(i).at(s).unit()).collect();
        let weights = even(&family, &shares);
        assert!(blender.blend(&weights) == family.blend(&weights));
    }
    assert!(family.member(KinId(0), 0).is_some());
}
