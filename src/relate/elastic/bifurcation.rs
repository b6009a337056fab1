//! Matching of the bifurcations along two registered chains (2018 TOG, section 3, Eq. 2), under the paper's uniqueness
//! and ordering constraints, by dynamic programming.
//!
//! A pair costs its squared distance along the chain, a bifurcation without a partner ε². The paper counts those of the
//! source only; here each side counts half, which is the same energy but for a constant, and symmetric. Past the paper, a
//! pair also costs what its branches differ in direction and length (weights of zero leave that out): by place alone a limb
//! to the left goes with one to the right that happens to stand as high, and swings round the trunk on the way.
//!
//! Pairs farther apart than ε gain nothing, so only those within are looked at, the [`MOST_NEAR`] nearest of each, and
//! the heaviest rising chain of them is found with a Fenwick tree: `n log n`, no matrix.

use glam::Vec3;

use crate::preset::plan::ElasticParams;

/// Most partners that are looked at for one bifurcation.
const MOST_NEAR: usize = 64;

/// A branch where it leaves its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bifurcation {
    /// Parameter 0..=1 that both chains share.
    pub at: f64,
    /// Branching vector, in the parent's frame.
    pub direction: Vec3,
    /// Arc length, metres.
    pub length: f64,
}

/// The matched pairs, rising in both; each list in order of `at`.
#[must_use]
pub fn match_bifurcations(own: &[Bifurcation], other: &[Bifurcation], params: &ElasticParams) -> Vec<(usize, usize)> {
    let reach = f64::from(params.epsilon);
    let mut tree = Prefix::new(other.len());
    // Pair, weight of the best chain that ends with it, the pair before.
    let mut pairs: Vec<(usize, usize, Option<usize>)> = Vec::new();
    let mut row: Vec<(usize, f64)> = Vec::new();
    let mut best: Option<(f64, usize)> = None;
    for (i, a) in own.iter().enumerate() {
        row.clear();
        let (low, high) = near(other, a.at, reach);
        for (j, b) in other.iter().enumerate().take(high).skip(low) {
            let gain = reach * reach - cost(a, b, params);
            if gain > 0.0 {
                row.push((j, gain));
            }
        }
        // All of a row ask before any of it answers: one partner each.
        let found: Vec<(usize, f64, Option<usize>)> = row
            .iter()
            .map(|&(j, gain)| {
                let before = tree.most_below(j);
                (j, gain + before.map_or(0.0, |b| b.0), before.map(|b| b.1))
            })
            .collect();
        for (j, sum, before) in found {
            let pair = pairs.len();
            pairs.push((i, j, before));
            tree.raise(j, sum, pair);
            if best.is_none_or(|b| sum > b.0) {
                best = Some((sum, pair));
            }
        }
    }
    let mut matched = Vec::new();
    let mut at = best.map(|b| b.1);
    while let Some(pair) = at {
        matched.push((pairs[pair].0, pairs[pair].1));
        at = pairs[pair].2;
    }
    matched.reverse();
    matched
}

/// Which of `other` are within reach, but only the nearest.
fn near(other: &[Bifurcation], at: f64, reach: f64) -> (usize, usize) {
    let (mut low, mut high) =
        (other.partition_point(|b| b.at < at - reach), other.partition_point(|b| b.at <= at + reach));
    while high - low > MOST_NEAR {
        if at - other[low].at > other[high - 1].at - at { low += 1 } else { high -= 1 }
    }
    (low, high)
}

/// The squared distance of a pair.
fn cost(a: &Bifurcation, b: &Bifurcation, params: &ElasticParams) -> f64 {
    let square = |x: f64| x * x;
    let longer = a.length.max(b.length);
    let shrunk = if longer > 0.0 { 1.0 - a.length.min(b.length) / longer } else { 0.0 };
    square(a.at - b.at)
        + square(f64::from(params.direction) * 0.5 * f64::from(a.direction.distance(b.direction)))
        + square(f64::from(params.length) * shrunk)
}

/// The greatest value at any place before one, with its owner; values only rise (Fenwick 1994).
struct Prefix {
    tree: Vec<Option<(f64, usize)>>,
}

impl Prefix {
    fn new(count: usize) -> Self {
        Self { tree: vec![None; count + 1] }
    }

    fn most_below(&self, place: usize) -> Option<(f64, usize)> {
        let mut best: Option<(f64, usize)> = None;
        let mut i = place;
        while i > 0 {
            if let Some(found) = self.tree[i]
                && best.is_none_or(|b| found.0 > b.0)
            {
                best = Some(found);
            }
            i &= i - 1;
        }
        best
    }

    fn raise(&mut self, place: usize, value: f64, owner: usize) {
        let mut i = place + 1;
        while i < self.tree.len() {
            if self.tree[i].is_none_or(|held| value > held.0) {
                self.tree[i] = Some((value, owner));
            }
            i += i & i.wrapping_neg();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    const PAPER: ElasticParams =
        ElasticParams { epsilon: 0.1, direction: 0.0, length: 0.0, path: crate::preset::plan::ChainPath::Elastic };

    fn at(places: &[f64]) -> Vec<Bifurcation> {
        places.iter().map(|&at| Bifurcation { at, direction: Vec3::X, length: 1.0 }).collect()
    }

    #[test]
    fn neighbours_match_in_order_and_what_is_far_stays_alone() {
        let pairs = match_bifurcations(&at(&[0.1, 0.3, 0.32, 0.9]), &at(&[0.12, 0.31, 0.6]), &PAPER);
        assert_eq!(pairs.len(), 2);
        assert_eq!(pairs[0], (0, 0));
        assert!(pairs[1] == (1, 1) || pairs[1] == (2, 1));
        assert!(match_bifurcations(&at(&[0.2]), &at(&[0.31]), &PAPER).is_empty());
    }

    #[test]
    fn direction_and_length_decide_among_neighbours() {
        let mut own = at(&[0.5, 0.51]);
        let mut other = at(&[0.505]);
        (own[1].direction, other[0].direction) = (Vec3::Z, Vec3::Z);
        assert_eq!(match_bifurcations(&own, &other, &ElasticParams::default()), [(1, 0)]);
        other[0].direction = -Vec3::X;
        own[1].direction = Vec3::X;
        // Opposite ways: nothing is gained by any pair.
        assert!(match_bifurcations(&own, &other, &ElasticParams::default()).is_empty());
    }

    /// The greatest gain over all matchings that keep the order.
    fn exhaustive(own: &[Bifurcation], other: &[Bifurcation], params: &ElasticParams) -> f64 {
        let (Some((a, rest)), false) = (own.split_first(), other.is_empty()) else { return 0.0 };
        let reach = f64::from(params.epsilon);
        let mut best = exhaustive(rest, other, params);
        for (j, b) in other.iter().enumerate() {
            best = best.max(reach * reach - cost(a, b, params) + exhaustive(rest, &other[j + 1..], params));
        }
        best
    }

    #[test]
    fn no_other_matching_that_keeps_the_order_is_better() {
        for i in 0..80 {
            let list = |name: &str, count: u64| {
                let seed = Seed::new(i).child(name);
                let mut list: Vec<Bifurcation> = (0..count)
                    .map(|k| Bifurcation {
                        at: f64::from(seed.at(k).range(0.3, 0.6)),
                        direction: seed.at(k).direction(),
                        length: f64::from(seed.at(k).child("l").range(0.1, 2.0)),
                    })
                    .collect();
                list.sort_by(|a, b| a.at.total_cmp(&b.at));
                list
            };
            let (own, other) = (list("a", 6), list("b", 5));
            for params in [PAPER, ElasticParams::default()] {
                let pairs = match_bifurcations(&own, &other, &params);
                assert!(pairs.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 < w[1].1));
                let gain: f64 = pairs.iter().map(|&(i, j)| 0.01 - cost(&own[i], &other[j], &params)).sum();
                let most = exhaustive(&own, &other, &params);
                // epsilon is an f32.
                assert!((gain - most).abs() < 1e-8 * (1.0 + most) + 1e-8, "{gain} {most}");
            }
        }
    }

    #[test]
    fn the_same_list_matches_itself() {
        let own = at(&[0.1, 0.1, 0.1, 0.4, 0.400_001]);
        let all: Vec<(usize, usize)> = (0..5).map(|i| (i, i)).collect();
        assert_eq!(match_bifurcations(&own, &own, &PAPER), all);
    }
}
