//! The leafy morph between two sources (2017 CAVW, 6): every chain at once, by one time 0..=1.
//!
//! Kins of both sources morph, those of the second grow, those of the first wilt, each by the time itself. A kin that
//! shares its chain of the first source with others splits from it, one that shares that of the second merges into it;
//! their points have weights of their own ([`Run`]). At 0 and 1 the tree is the source. In between kins come and go with
//! a size of nothing, so nothing pops.

use rayon::prelude::*;

use super::tasks::{Task, Tasks};
use crate::plant::{ChainId, trunk_support_by};
use crate::relate::{Family, Run, Weights};

/// How near to its ends a morph is taken for its source.
const END: f32 = 1e-6;

/// The weights of a morph from one source of a family to another at time `t`. Sources are indices; out of range gives
/// weights of nothing.
#[must_use]
pub fn morph(family: &Family, from: usize, to: usize, t: f32) -> Weights {
    if t.is_nan() || t <= END {
        return family.corner(from);
    }
    if t >= 1.0 - END {
        return family.corner(to);
    }
    let sources = family.sources().len();
    let tasks = Tasks::new(family, from, to);
    let mut weights = Weights::new(family.kin_count(), sources);
    if !tasks.in_range() {
        return weights;
    }
    let mut shares = vec![0.0; sources];
    for kin in family.kin_ids() {
        shares.fill(0.0);
        let degree = match tasks.tasks[kin.index()] {
            Task::Grow => {
                shares[to] = 1.0;
                t
            }
            Task::Wilt => {
                shares[from] = 1.0;
                1.0 - t
            }
            Task::Morph => {
                shares[from] = 1.0 - t;
                shares[to] = t;
                let run = match (family.sharers(kin, from) > 1, family.sharers(kin, to) > 1) {
                    (true, false) => Run::Split,
                    (false, true) => Run::Merge,
                    _ => Run::Even,
                };
                weights.set_run(kin, run);
                1.0
            }
            Task::None | Task::Still | Task::Absent => continue,
        };
        weights.set(kin, &shares, degree);
    }
    weights
}

/// At which time of a morph it has come how far: a part of the time follows the way itself, a little more than half of it the trunk's load.
///
/// Where a trunk splits into stems it hands over its load in a part of the way only, when they part, and all at once to
/// the eye. So the time is drawn out there: with a load `L(share)` it is `(1 − 0.55)·share + 0.55·∫|dL| / |ΔL|`. A load that
/// falls steadily then never changes more than 1.8 times as fast as in a straight line, and nothing moves more than 2.2
/// times as fast as it would. Where no stem splits or merges the time is the share.
#[derive(Clone, Debug, PartialEq)]
pub struct Pace {
    /// Shares and when they are reached, both rising from 0 to 1.
    knots: Vec<(f32, f32)>,
}

/// Part of the time that follows the load.
const LOAD: f32 = 0.55;
/// Even steps in which a pace looks at the load.
const LOOKS: u32 = 32;
/// In how many parts it looks at a step again, over which the load changes by more than twice the mean.
const PARTS: u32 = 16;

impl Pace {
    /// Time and share are one.
    #[must_use]
    pub fn even() -> Self {
        Self { knots: vec![(0.0, 0.0), (1.0, 1.0)] }
    }

    /// The pace between the first two sources of a family; takes as long as 60 to 120 trees where stems split or merge.
    #[must_use]
    pub fn of(family: &Family) -> Self {
        let shared = |kin| family.sharers(kin, 0).max(family.sharers(kin, 1)) > 1;
        if family.sources().len() < 2 || !family.kin_ids().any(|kin| family.parent(kin).is_none() && shared(kin)) {
            return Self::even();
        }
        let even: Vec<f32> = (0..=LOOKS).map(|k| k as f32 / LOOKS as f32).collect();
        let load = support_at(family, &even);
        let whole: f32 = load.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
        if whole.is_nan() || whole < 1e-3 {
            return Self::even();
        }
        let steep = |k: usize| (load[k + 1] - load[k]).abs() * LOOKS as f32 > 2.0 * whole;
        let mut shares = even;
        let finer = |k: usize| (1..PARTS).map(move |part| (k as f32 + part as f32 / PARTS as f32) / LOOKS as f32);
        shares.extend((0..LOOKS as usize).filter(|&k| steep(k)).flat_map(finer));
        shares.sort_by(f32::total_cmp);
        Self::by_load(&shares, &support_at(family, &shares))
    }

    /// By the load at some shares, which rise from 0 to 1.
    fn by_load(shares: &[f32], load: &[f32]) -> Self {
        let whole: f32 = load.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
        let mut sum = 0.0;
        let mut knots = vec![(0.0, 0.0)];
        for (pair, share) in load.windows(2).zip(&shares[1..]) {
            sum += (pair[1] - pair[0]).abs();
            knots.push((*share, (1.0 - LOAD) * share + LOAD * sum / whole));
        }
        if let Some(last) = knots.last_mut() {
            *last = (1.0, 1.0);
        }
        Self { knots }
    }

    /// One that reaches shares at times, both rising from 0 to 1.
    #[cfg(test)]
    pub(crate) fn through(knots: &[(f32, f32)]) -> Self {
        Self { knots: knots.to_vec() }
    }

    /// The share at a time, both 0..=1.
    #[must_use]
    pub fn share(&self, t: f32) -> f32 {
        let last = self.knots.len() - 1;
        let i = self.knots[1..last].partition_point(|knot| knot.1 <= t);
        let (from, to) = (self.knots[i], self.knots[i + 1]);
        let f = if to.1 > from.1 { ((t - from.1) / (to.1 - from.1)).clamp(0.0, 1.0) } else { 0.0 };
        from.0 + (to.0 - from.0) * f
    }
}

/// The trunk support weights ([`trunk_support_by`]) of a morph from the first to the second source of a family, at
/// `steps + 1` evenly spread times.
#[must_use]
pub fn support_over_morph(family: &Family, pace: &Pace, steps: u32) -> Vec<f32> {
    let shares: Vec<f32> = (0..=steps).map(|step| pace.share(step as f32 / steps.max(1) as f32)).collect();
    support_at(family, &shares)
}

/// The same at some shares of the way. Trunks that fork are stems on the way, and are measured so at its ends, too.
pub(crate) fn support_at(family: &Family, shares: &[f32]) -> Vec<f32> {
    shares
        .par_iter()
        .map(|&t| {
            let t = if family.has_forks() { t.clamp(2.0 * END, 1.0 - 2.0 * END) } else { t };
            let (plant, kins) = family.blend_with_kins(&morph(family, 0, 1, t));
            let inside = t > END && t < 1.0 - END;
            let count = |chain: ChainId| {
                let kin = kins[chain.index()];
                // Copies that are one at an end of the way weigh as one there.
                let copies = |source: usize, share: f32| (family.sharers(kin, source).max(1) - 1) as f32 * share;
                if inside { 1.0 / (1.0 + copies(0, 1.0 - t) + copies(1, t)) } else { 1.0 }
            };
            let bole = |chain: ChainId| {
                let kin = kins[chain.index()];
                let at = |source: usize, share: f32| family.bole(kin, source) * share;
                if inside { at(0, 1.0 - t) + at(1, t) } else { 0.0 }
            };
            trunk_support_by(&plant, &plant.pose(), &count, &bole)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::plant::{Plant, PlantStats};
    use crate::preset::plan::{MatchParams, PatternParams};
    use crate::relate::pattern_family;
    use crate::relate::random_plant::{Oddity, random_plant};

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    fn pair(seed: u64, oddity: Oddity) -> (Plant, Plant, Family) {
        let plant = |name| random_plant(Seed::new(seed).child(name), 60, oddity);
        let (a, b) = (plant("a"), plant("b"));
        let family = pattern_family(a.clone(), b.clone(), &EVEN, &PatternParams::default()).unwrap().pair_leaves(100).0;
        (a, b, family)
    }

    #[test]
    fn the_ends_are_the_sources_leaves_and_all() {
        for seed in 0..40 {
            let (a, b, family) = pair(seed, Oddity::Wild);
            assert!(family.blend(&morph(&family, 0, 1, 0.0)) == a && family.blend(&morph(&family, 0, 1, 1.0)) == b);
        }
    }

    #[test]
    fn in_betweens_are_whole_and_keep_their_chains_and_leaves_all_the_way() {
        for seed in 0..30 {
            let (_, _, family) = pair(seed, Oddity::Wild);
            let count = |t: f32| {
                let plant = family.blend(&morph(&family, 0, 1, t));
                assert_eq!(PlantStats::of(&plant).topology_continuity, 1.0);
                (plant.chains().len(), plant.leaves().len())
            };
            let all: Vec<(usize, usize)> = [0.001, 0.25, 0.5, 0.999].map(count).to_vec();
            assert!(all.iter().all(|c| *c == all[0]), "{seed}: {all:?}");
        }
    }

    #[test]
    fn every_leaf_comes_from_its_source_and_goes_to_its_target_without_a_jump() {
        for seed in 0..20 {
            let (a, b, family) = pair(seed, Oddity::Tame);
            let places = |t: f32| -> Vec<(glam::Vec3, f32)> {
                let plant = family.blend(&morph(&family, 0, 1, t));
                let posed = plant.pose();
                plant.leaves().iter().map(|l| (posed.leaf(&plant, l).position, l.size)).collect()
            };
            let reach = 12.0;
            for (end, source, t) in [("first", &a, 1e-5), ("last", &b, 1.0 - 1e-5)] {
                let posed = source.pose();
                let own: Vec<(glam::Vec3, f32)> =
                    source.leaves().iter().map(|l| (posed.leaf(source, l).position, l.size)).collect();
                for (place, size) in places(t).into_iter().filter(|leaf| leaf.1 > 2e-3) {
                    let near = own.iter().map(|o| o.0.distance(place) + (o.1 - size).abs()).fold(f32::MAX, f32::min);
                    assert!(near < 1e-3 * reach, "{seed} {end}: {near}");
                }
            }
            let mut last = places(0.001);
            for step in 1..100 {
                let next = places(0.001 + 0.998 * step as f32 / 99.0);
                for (x, y) in last.iter().zip(&next) {
                    assert!(x.0.distance(y.0) < 0.12 * reach, "{seed} {step}: {}", x.0.distance(y.0));
                }
                last = next;
            }
        }
    }

    /// A tree of one trunk, or a shrub of several rods, with limbs all round.
    fn stems(count: usize, limbs: usize) -> Plant {
        let mut builder = crate::plant::PlantBuilder::new();
        for i in 0..count {
            let around = std::f32::consts::TAU * i as f32 / count as f32;
            let (sin, cos) = crate::base::math::sin_cos(around);
            let lean = if count > 1 { glam::Vec3::new(cos, 0.0, sin) * 0.8 } else { glam::Vec3::ZERO };
            let points: Vec<glam::Vec3> = (0..=8).map(|k| (glam::Vec3::Y * 4.0 + lean) * (k as f32 / 8.0)).collect();
            let radii: Vec<f32> = (0..=8).map(|k| (0.16 - 0.015 * k as f32) / (count as f32).sqrt()).collect();
            let stem = builder.stem(lean * 0.1, &points, &radii);
            for k in 0..limbs {
                let way = Seed::new(7).at(i as u64).at(k as u64).direction();
                let way = glam::Vec3::new(way.x, way.y.abs() * 0.5, way.z) * 1.2;
                let location = 0.25 + 0.7 * k as f32 / limbs as f32;
                builder.branch(stem, location, &[glam::Vec3::ZERO, way * 0.5, way], &[0.03, 0.02, 0.005]);
            }
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_pace_starts_ends_and_never_turns_back() {
        let family = pattern_family(stems(1, 9), stems(4, 3), &EVEN, &PatternParams::default()).unwrap();
        for pace in [Pace::even(), Pace::of(&family)] {
            assert_eq!((pace.share(0.0), pace.share(1.0)), (0.0, 1.0));
            let shares: Vec<f32> = (0..=200).map(|k| pace.share(k as f32 / 200.0)).collect();
            assert!(shares.windows(2).all(|pair| pair[1] >= pair[0] && pair[1] - pair[0] < 2.25 / 200.0));
        }
        assert_eq!(
            Pace::of(&pattern_family(stems(1, 9), stems(1, 5), &EVEN, &PatternParams::default()).unwrap()),
            Pace::even()
        );
    }

    #[test]
    fn a_trunk_hands_its_load_to_the_rods_of_a_shrub_steadily() {
        let steepest = |values: &[f32]| {
            values.windows(2).fold(0.0_f32, |most, w| most.max((w[1] - w[0]).abs())) * (values.len() - 1) as f32
        };
        let (tree, shrub) = (stems(1, 24), stems(5, 8));
        for (a, b) in [(&tree, &shrub), (&shrub, &tree)] {
            let family = pattern_family(a.clone(), b.clone(), &EVEN, &PatternParams::default()).unwrap();
            let many = support_over_morph(&family, &Pace::of(&family), 50);
            let fuzzy = crate::relate::fuzzy_family(a.clone(), b.clone(), &EVEN).unwrap();
            let one = support_over_morph(&fuzzy, &Pace::even(), 50);
            let straight = (many[50] - many[0]).abs();
            assert!(straight > 0.3, "{many:?}");
            assert!(steepest(&many) <= 2.0 * straight, "{} {straight} {many:?}", steepest(&many));
            assert!(steepest(&many) < steepest(&one), "{} {}", steepest(&many), steepest(&one));
        }
    }
}
