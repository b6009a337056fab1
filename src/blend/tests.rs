//! Tests of batches: sequences of trees between two sources.

use glam::Vec3;

use super::*;
use crate::base::{Seed, simplex_point};
use crate::plant::{Plant, PlantStats};
use crate::preset::plan::MatchParams;
use crate::relate::random_plant::{Oddity, random_plant};
use crate::relate::{Blender, Family, KinId, Weights, fuzzy_family, merged_family, nway_family};

const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

fn pair(seed: u64, oddity: Oddity) -> Family {
    let plant = |name| random_plant(Seed::new(seed).child(name), 40, oddity);
    fuzzy_family(plant("a"), plant("b"), &EVEN).unwrap()
}

#[test]
fn a_batch_runs_from_the_source_to_the_target() {
    for seed in 0..20 {
        let family = pair(seed, Oddity::Wild);
        let tasks = Tasks::new(&family, 0, 1);
        let states: Vec<State> = tasks.batch(Seed::new(seed), 1.0).collect();
        assert!(states.len() < 400, "{}", states.len());
        assert!(family.blend(&tasks.weights(&states[0])) == family.sources()[0]);
        assert!(family.blend(&tasks.weights(&states[states.len() - 1])) == family.sources()[1]);
        let progress: Vec<f32> = states.iter().map(|state| tasks.progress(state)).collect();
        assert!(progress.windows(2).all(|p| p[1] > p[0] - 1e-6));
    }
}

#[test]
fn grow_and_wilt_rules_hold_in_every_state() {
    for seed in 0..10 {
        let family = pair(seed, Oddity::Tame);
        let tasks = Tasks::new(&family, 0, 1);
        for state in tasks.batch(Seed::new(seed), 1.0) {
            let weights = tasks.weights(&state);
            for kin in family.kin_ids() {
                let Some(parent) = family.parent(kin) else { continue };
                assert!(weights.degree(kin) <= weights.degree(parent) + 1e-6);
            }
        }
    }
}

#[test]
fn no_state_has_a_floating_chain() {
    for seed in 0..4 {
        let family = pair(seed, Oddity::Tame);
        let tasks = Tasks::new(&family, 0, 1);
        for state in tasks.batch(Seed::new(seed), 1.0).step_by(5) {
            let weights = tasks.weights(&state);
            let plant = family.blend(&weights);
            let shown = family.kin_ids().filter(|&k| weights.degree(k) > 0.0).count();
            assert_eq!(plant.chains().len(), shown);
            assert_eq!(PlantStats::of(&plant).topology_continuity, 1.0);
        }
    }
}

#[test]
fn seeds_make_batches_that_differ_and_the_same_seed_the_same() {
    let family = pair(3, Oddity::Tame);
    let half = |seed| sample(&family, 0, 1, Seed::new(seed), 0.5);
    assert!(half(1) == half(1));
    assert!(half(1) != half(2));
    assert!(family.blend(&half(1)) != family.blend(&half(2)));
}

#[test]
fn a_sample_is_the_nearest_state_of_its_batch() {
    let family = pair(4, Oddity::Tame);
    let tasks = Tasks::new(&family, 0, 1);
    let seed = Seed::new(9);
    for i in 0..=10 {
        let wanted = i as f32 / 10.0;
        let found = tasks.progress(&tasks.sample(seed, wanted, 1.0));
        let least =
            tasks.batch(seed, 1.0).map(|state| (tasks.progress(&state) - wanted).abs()).fold(f32::INFINITY, f32::min);
        assert!(((found - wanted).abs() - least).abs() < 1e-5);
    }
    assert!(family.blend(&sample(&family, 0, 1, seed, 0.0)) == family.sources()[0]);
    assert!(family.blend(&sample(&family, 0, 1, seed, 1.0)) == family.sources()[1]);
}

#[test]
fn sources_that_are_not_there_give_an_empty_batch() {
    let family = pair(5, Oddity::Tame);
    let tasks = Tasks::new(&family, 0, 7);
    assert_eq!(tasks.batch(Seed::new(1), 1.0).count(), 0);
    assert!(tasks.in_betweens(Seed::new(1), 5, 0.0, 1.0).is_empty());
    assert_eq!(sample(&family, 7, 0, Seed::new(1), 0.5).kins(), family.kin_count());
}

#[test]
fn any_number_of_in_betweens_spreads_over_the_way_and_no_two_are_equal() {
    let family = pair(6, Oddity::Tame);
    let tasks = Tasks::new(&family, 0, 1);
    for trees in [1, 7, 60, 300] {
        let states = tasks.in_betweens(Seed::new(2), trees, 0.1, 0.9);
        assert_eq!(states.len(), trees);
        let progress: Vec<f32> = states.iter().map(|state| tasks.progress(state)).collect();
        for (i, p) in progress.iter().enumerate() {
            let wanted = 0.1 + 0.8 * (i as f32 + 0.5) / trees as f32;
            assert!((p - wanted).abs() < 0.06, "{trees} trees: {p} {wanted}");
        }
        let doubled = states.windows(2).filter(|w| w[0] == w[1]).count();
        assert!(doubled * 20 <= trees, "{doubled} of {trees}");
    }
}

#[test]
fn trees_of_a_batch_are_those_of_single_blends_to_the_last_bit() {
    for seed in 0..12 {
        let oddity = if seed % 2 == 0 { Oddity::Tame } else { Oddity::Wild };
        let family = pair(seed, oddity);
        let tasks = Tasks::new(&family, 0, 1);
        let states: Vec<State> = tasks.batch(Seed::new(seed), 1.0).collect();
        let made = tasks.map_trees(&states, &|i, plant: &Plant, _| *plant == family.blend(&tasks.weights(&states[i])));
        assert!(made.into_iter().all(|same| same), "seed {seed}");
        // There and back, and far jumps.
        let mut blender = Blender::new(&family);
        for i in 0..30 {
            let state = &states[Seed::new(seed).at(i).index(states.len())];
            let weights = tasks.weights(state);
            assert!(blender.blend(&weights) == family.blend(&weights), "seed {seed}");
        }
    }
}

#[test]
fn a_partial_blend_leaves_the_rest_as_it_was() {
    let family = pair(11, Oddity::Tame);
    let part = |kin: KinId| family.parent(kin).is_some_and(|p| family.parent(p).is_none());
    let tasks = Tasks::partial(&family, 0, 1, &part);
    assert!(tasks.count() > 0);
    for state in tasks.batch(Seed::new(3), 1.0).step_by(7) {
        let weights = tasks.weights(&state);
        let (plant, kins) = family.blend_with_kins(&weights);
        for (id, &kin) in plant.chain_ids().zip(&kins) {
            if part(kin) {
                continue;
            }
            let own = family.member(kin, 0).expect("what takes no part is the first source's");
            assert_eq!(plant.points(id), family.sources()[0].points(own));
        }
        assert_eq!(PlantStats::of(&plant).topology_continuity, 1.0);
    }
    // Nothing takes part: the first source.
    let none = Tasks::partial(&family, 0, 1, &|_| false);
    let state = none.sample(Seed::new(1), 0.7, 1.0);
    assert!(none.count() == 0 && family.blend(&none.weights(&state)) == family.sources()[0]);
}

#[test]
fn stems_that_merge_show_no_stand_in_on_the_way() {
    for seed in 0..10 {
        let plant = |name| random_plant(Seed::new(seed).child(name), 40, Oddity::Tame);
        let (a, b) = (plant("a"), plant("b"));
        let family = merged_family(a, b, &EVEN).unwrap();
        let tasks = Tasks::new(&family, 0, 1);
        let states: Vec<State> = tasks.batch(Seed::new(seed), 1.0).collect();
        for state in &states[1..states.len() - 1] {
            let weights = tasks.weights(state);
            assert!(family.kin_ids().all(|k| !family.is_stand_in(k) || weights.degree(k) == 0.0));
        }
        let end = family.blend(&tasks.weights(&states[states.len() - 1]));
        assert!(end == family.sources()[1]);
    }
}

/// Farthest that any place on a chain (by kin and arc length) moves from one tree to the other, over `height`.
fn moved(family: &Family, a: &Weights, b: &Weights) -> f32 {
    let (a, kins_a) = family.blend_with_kins(a);
    let (b, kins_b) = family.blend_with_kins(b);
    let (posed_a, posed_b) = (a.pose(), b.pose());
    let mut most = 0.0_f32;
    for (id, kin) in a.chain_ids().zip(&kins_a) {
        let Ok(other) = kins_b.binary_search(kin) else { continue };
        let other = crate::plant::ChainId(other as u32);
        for i in 0..=8 {
            let t = f64::from(i) / 8.0;
            most = most.max(posed_a.curve(&a, id).point(t).distance(posed_b.curve(&b, other).point(t)));
        }
    }
    most / a.height().max(b.height())
}

#[test]
fn a_smaller_step_moves_every_point_less() {
    for seed in 0..6 {
        let family = pair(seed, Oddity::Tame);
        let tasks = Tasks::new(&family, 0, 1);
        let states: Vec<State> = tasks.batch(Seed::new(seed), 1.0).collect();
        for pair in states.windows(2).skip(3).step_by(9) {
            let at = |share| tasks.between(&pair[0], &pair[1], share);
            let whole = moved(&family, &at(0.4), &at(0.6));
            let tenth = moved(&family, &at(0.49), &at(0.51));
            let hundredth = moved(&family, &at(0.499), &at(0.501));
            assert!(tenth <= whole * 0.3 + 1e-4, "{whole} {tenth}");
            assert!(hundredth <= whole * 0.03 + 1e-4, "{whole} {hundredth}");
        }
    }
}

#[test]
fn a_mix_has_its_corners_and_scatter_keeps_them() {
    for seed in 0..10 {
        let plants: Vec<Plant> = (0..4).map(|i| random_plant(Seed::new(seed).at(i), 30, Oddity::Tame)).collect();
        let family = nway_family(plants.clone(), &EVEN).unwrap();
        for (s, plant) in plants.iter().enumerate() {
            let shares: Vec<f32> = (0..4).map(|i| if i == s { 2.0 } else { 0.0 }).collect();
            assert!(family.blend(&mix(&family, &shares)) == *plant);
            assert!(family.blend(&scattered(&family, &shares, 1.0, Seed::new(4))) == *plant);
        }
        let shares = [0.4, 0.3, 0.2, 0.1];
        let even = family.blend(&mix(&family, &shares));
        assert!(family.blend(&scattered(&family, &shares, 0.0, Seed::new(4))) == even);
        let other = family.blend(&scattered(&family, &shares, 0.7, Seed::new(4)));
        assert!(other != even && other != family.blend(&scattered(&family, &shares, 0.7, Seed::new(5))));
        assert_eq!(PlantStats::of(&other).topology_continuity, 1.0);
    }
}

#[test]
fn a_young_limb_of_a_mix_bears_what_it_has_grown_past() {
    let tree = |limb: bool| {
        let mut builder = crate::plant::PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.05]);
        builder.branch(stem, 0.9, &[Vec3::ZERO, Vec3::X], &[0.02, 0.01]);
        if limb {
            let limb = builder.branch(stem, 0.3, &[Vec3::ZERO, Vec3::Z * 2.0], &[0.04, 0.02]);
            for k in 1..20 {
                builder.branch(limb, k as f32 / 20.0, &[Vec3::ZERO, Vec3::Y * 0.5], &[0.01, 0.01]);
            }
        }
        builder.finish().unwrap()
    };
    let family = nway_family(vec![tree(false), tree(true)], &EVEN).unwrap();
    let twigs = |share: f32| family.blend(&mix(&family, &[1.0 - share, share])).chains().len() - 3;
    assert!((2..=4).contains(&twigs(0.1)) && (13..=15).contains(&twigs(0.5)), "{} {}", twigs(0.1), twigs(0.5));
    assert_eq!(twigs(0.99), 19);
}

#[test]
fn a_mix_of_three_goes_continuously_from_one_to_the_next() {
    let plants: Vec<Plant> = (0..3).map(|i| random_plant(Seed::new(77).at(i), 30, Oddity::Tame)).collect();
    let family = nway_family(plants, &EVEN).unwrap();
    let at = |t: f32| mix(&family, &[0.5 - t, 0.2 + t, 0.3]);
    let whole = moved(&family, &at(0.1), &at(0.2));
    let tenth = moved(&family, &at(0.15), &at(0.16));
    let hundredth = moved(&family, &at(0.15), &at(0.151));
    assert!(tenth <= whole * 0.3 + 1e-4 && hundredth <= whole * 0.03 + 1e-4, "{whole} {tenth} {hundredth}");
}

#[test]
fn samples_of_the_simplex_are_even_and_more_of_them_keep_the_first() {
    for sources in 2..6 {
        let many: Vec<Vec<f32>> = (0..400).map(|i| simplex_point(sources, i)).collect();
        for shares in &many {
            assert_eq!(shares.len(), sources);
            assert!((shares.iter().sum::<f32>() - 1.0).abs() < 1e-5 && shares.iter().all(|w| *w >= 0.0));
        }
        // Means of the uniform law on the simplex: 1/N; squares: 2/(N(N+1)).
        let n = sources as f32;
        for s in 0..sources {
            let mean = many.iter().map(|w| w[s]).sum::<f32>() / 400.0;
            let square = many.iter().map(|w| w[s] * w[s]).sum::<f32>() / 400.0;
            assert!((mean - 1.0 / n).abs() < 0.02, "{sources}: {mean}");
            assert!((square - 2.0 / (n * (n + 1.0))).abs() < 0.02, "{sources}: {square}");
        }
        // No two near each other among the first of them.
        let first = &many[..24];
        let near = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max);
        for i in 0..24 {
            for j in 0..i {
                assert!(near(&first[i], &first[j]) > 0.015, "{sources}: {i} {j}");
            }
        }
    }
}

#[test]
fn samples_of_one_run_are_those_of_a_run_each() {
    for s in 0..6 {
        let family = pair(s, Oddity::Tame);
        let tasks = Tasks::new(&family, 0, 1);
        let places = [0.7, 0.0, 1.0, 0.31, 0.3, 0.3, 0.999, 0.02, 1.5, -1.0, f32::NAN];
        for pace in [0.2, 1.0, 4.0] {
            let states = tasks.samples(Seed::new(s), &places, pace);
            for (place, state) in places.iter().zip(states) {
                assert!(state == tasks.sample(Seed::new(s), *place, pace), "seed {s}, {place} at pace {pace}");
            }
        }
    }
}
