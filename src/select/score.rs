//! Inspiring scores (2017 TVCG, 4.5): how much a tree differs from each of its sources, in crown and topology.
//!
//! A difference has three parts, each 0..=1 and without metres: the Hausdorff distance of the crowns, crown bases laid on
//! each other, over the mean of their reaches; the difference of the crown ratios; and the constrained edit distance of
//! the topologies over the nodes of both. Their weighted sum is the difference of two trees, and the weighted sum over the
//! sources the score.
//!
//! Trees are scored in groups of [`GROUP`] whose members share what is known of pairs of subtrees.

use rayon::prelude::*;
use serde::Serialize;

use super::edit_distance::{Memory, distance};
use super::examine::{Examined, Sources};
use super::profile::Profile;
use super::topology::{Shape, Shapes};
use crate::preset::plan::ScoreParams;

/// Trees that share a memory.
const GROUP: usize = 16;

/// How two trees differ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Of the crowns, 0..=1.
    pub crown: f32,
    /// Of the crown ratios, 0..=1.
    pub ratio: f32,
    /// Of the topologies, 0..=1.
    pub topology: f32,
    /// All three, weighted.
    pub total: f32,
}

/// What a tree's score is made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// The weighted sum over the sources.
    pub inspiring: f32,
    /// From each source, in the family's order.
    pub from_sources: Vec<Difference>,
}

impl Score {
    /// What the score is the sum of: the weighted parts of each difference.
    #[must_use]
    pub fn summands(&self, params: &ScoreParams) -> Vec<f32> {
        let count = self.from_sources.len();
        let parts = |(s, d): (usize, &Difference)| {
            let own = params.of_source(s, count);
            [params.crown * d.crown, params.ratio * d.ratio, params.topology * d.topology].map(|part| part * own)
        };
        self.from_sources.iter().enumerate().flat_map(parts).collect()
    }
}

/// The scores of some trees, and what further comparisons of them need.
#[derive(Clone, Debug)]
pub struct Scores {
    /// One a tree.
    pub each: Vec<Score>,
    pub(super) params: ScoreParams,
    pub(super) shapes: Shapes,
    pub(super) of_trees: Vec<Shape>,
}

/// Scores trees against the sources of their family; on all threads.
#[must_use]
pub fn scores(trees: &[Examined], sources: &Sources, params: &ScoreParams) -> Scores {
    let mut shapes = Shapes::default();
    let of_sources: Vec<Shape> = sources.profiles.iter().map(|p| shapes.insert(&p.topology)).collect();
    let of_trees: Vec<Shape> = trees.iter().map(|t| shapes.insert(&t.profile.topology)).collect();
    let groups: Vec<Vec<Score>> = trees
        .par_chunks(GROUP)
        .zip(of_trees.par_chunks(GROUP))
        .map(|(trees, own)| {
            let mut memory = Memory::default();
            let score = |(tree, &shape): (&Examined, &Shape)| {
                let compare = |(source, &other): (&Profile, &Shape)| {
                    let edits = distance(&shapes, &mut memory, shape, other);
                    let nodes = shapes.size(shape) + shapes.size(other);
                    difference(&tree.profile, source, edits as f32 / nodes as f32, params)
                };
                let from_sources: Vec<Difference> = sources.profiles.iter().zip(&of_sources).map(compare).collect();
                let count = from_sources.len();
                let weighed = from_sources.iter().enumerate().map(|(s, d)| d.total * params.of_source(s, count));
                Score { inspiring: weighed.sum(), from_sources }
            };
            trees.iter().zip(own).map(score).collect()
        })
        .collect();
    Scores { each: groups.into_iter().flatten().collect(), params: params.clone(), shapes, of_trees }
}

impl Scores {
    /// The difference of tree `a` from each of `others`; on all threads.
    #[must_use]
    pub fn between(&self, trees: &[Examined], a: usize, others: &[usize]) -> Vec<Difference> {
        let groups: Vec<Vec<Difference>> = others
            .par_chunks(GROUP)
            .map(|group| {
                let mut memory = Memory::default();
                let compare = |&b: &usize| {
                    let edits = distance(&self.shapes, &mut memory, self.of_trees[a], self.of_trees[b]);
                    let nodes = self.shapes.size(self.of_trees[a]) + self.shapes.size(self.of_trees[b]);
                    let topology = edits as f32 / nodes as f32;
                    difference(&trees[a].profile, &trees[b].profile, topology, &self.params)
                };
                group.iter().map(compare).collect()
            })
            .collect();
        groups.into_iter().flatten().collect()
    }

    /// Mean difference of all pairs of some trees, 0..=1; 0 for fewer than two.
    #[must_use]
    pub fn diversity(&self, trees: &[Examined], of: &[usize]) -> f32 {
        let mut sum = 0.0_f64;
        for (i, &a) in of.iter().enumerate() {
            sum += self.between(trees, a, &of[i + 1..]).iter().map(|d| f64::from(d.total)).sum::<f64>();
        }
        let pairs = of.len() * of.len().saturating_sub(1) / 2;
        if pairs == 0 { 0.0 } else { (sum / pairs as f64) as f32 }
    }
}

fn difference(a: &Profile, b: &Profile, topology: f32, params: &ScoreParams) -> Difference {
    let reach = (a.crown.reach() + b.crown.reach()) * 0.5;
    let crown = if reach > 0.0 { (a.crown.distance(&b.crown) / reach).min(1.0) } else { 0.0 };
    let ratio = (a.crown_ratio - b.crown_ratio).abs();
    let total = params.crown * crown + params.ratio * ratio + params.topology * topology;
    Difference { crown, ratio, topology, total }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::preset::plan::{FilterParams, MatchParams};
    use crate::relate::random_plant::{Oddity, random_plant};
    use crate::relate::{Family, fuzzy_family};
    use crate::select::examine;

    const EVEN: ScoreParams = ScoreParams { crown: 0.4, ratio: 0.2, topology: 0.4, sources: Vec::new() };
    const FILTER: FilterParams = FilterParams { collisions: 1.0, rise: 0.0, botany: 1000.0 };

    fn family(seed: u64) -> Family {
        let plant = |name| random_plant(Seed::new(seed).child(name), 40, Oddity::Tame);
        fuzzy_family(plant("a"), plant("b"), &MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 }).unwrap()
    }

    #[test]
    fn a_source_differs_by_nothing_from_itself_and_as_much_either_way() {
        for seed in 0..10 {
            let family = family(seed);
            let sources = Sources::of(&family, &FILTER);
            let trees: Vec<Examined> = family.sources().iter().map(|p| examine(p, &[], &sources, &FILTER)).collect();
            let scores = scores(&trees, &sources, &EVEN);
            assert_eq!(scores.each[0].from_sources[0].total, 0.0);
            assert_eq!(scores.each[1].from_sources[1].total, 0.0);
            let there = scores.each[0].from_sources[1];
            assert_eq!(there, scores.each[1].from_sources[0]);
            assert!([there.crown, there.ratio, there.topology].iter().all(|d| (0.0..=1.0).contains(d)));
            assert_eq!(scores.between(&trees, 0, &[1])[0], there);
            let sum: f32 = scores.each[0].summands(&EVEN).iter().sum();
            assert!((sum - scores.each[0].inspiring).abs() < 1e-6);
            assert!((scores.diversity(&trees, &[0, 1]) - there.total).abs() < 1e-6);
            // To differ from the first source counts thrice as much as to differ from the second.
            let first = ScoreParams { sources: vec![3.0, 1.0], ..EVEN };
            let weighed = super::scores(&trees, &sources, &first);
            assert!((weighed.each[0].inspiring - 0.5 * there.total).abs() < 1e-6);
            assert!((weighed.each[1].inspiring - 1.5 * there.total).abs() < 1e-6);
            let sum: f32 = weighed.each[1].summands(&first).iter().sum();
            assert!((sum - weighed.each[1].inspiring).abs() < 1e-6);
        }
    }
}
