//! Which of the candidates are kept.
//!
//! - `All`: the first ones.
//! - `Inspiring` (2017 TVCG, 4.5): k-means of the scores (`cluster.rs`), one tree of each cluster. The paper takes ⌈√(N/2)⌉ clusters of N
//!   trees and keeps one each; here the preset says how many are kept, and makes 2·k² candidates for k kept ones unless it
//!   says otherwise, which is the same number.
//! - `Diverse`: farthest-point sampling (Gonzalez 1985), begun at the tree that is farthest from its nearest source.
//! - `Natural`: the trees nearest to the first source, the second, … in turn.
//!
//! What a designer decided goes before: trees to keep are kept, and stand for their cluster, their source or their place
//! among those far from each other; trees to reject are as if they were not there.
//!
//! Trees that the filter rejects are passed over. Where fewer are left than are to be kept, those that depart least from
//! their sources' kind are taken all the same, and that is told. Kept trees come in the order of the candidates.

use super::cluster::{clusters, representative};
use super::examine::Examined;
use super::score::Scores;
use crate::preset::plan::{Decided, Pick};

/// What was picked.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// Indices of the kept candidates, rising.
    pub kept: Vec<usize>,
    /// How many the filter rejected.
    pub rejected: usize,
    /// How many of the kept ones it had rejected.
    pub in_spite: usize,
    /// Least difference of two kept trees, where `Diverse` asked for one.
    pub apart: Option<f32>,
}

/// Why nothing can be picked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PickError {
    /// Fewer candidates than are to be kept.
    #[error("{candidates} candidates for {keep} trees to keep")]
    TooFew {
        /// How many there are.
        candidates: usize,
        /// How many are asked for.
        keep: usize,
    },
    /// No two candidates are as far apart as asked for.
    #[error(
        "selects nothing: no two of the {candidates} candidates are {asked} apart, the farthest picked are {found:.3}"
    )]
    Apart {
        /// How many there are.
        candidates: usize,
        /// The bound.
        asked: f32,
        /// Distance of the two that were picked first.
        found: f32,
    },
}

/// Picks `keep` of the candidates; `botany` is the departure up to which the filter lets trees through.
///
/// # Errors
///
/// When there are too few candidates, or no two of them are as far apart as `Diverse` wants.
pub fn pick(how: Pick, keep: usize, botany: f32, trees: &[Examined], scores: &Scores) -> Result<Picked, PickError> {
    pick_decided(how, keep, &Decided::default(), botany, trees, scores)
}

/// As [`pick`], where some trees are kept or passed over in any case; of more than `keep` such ones the first are kept.
///
/// # Errors
///
/// As [`pick`].
pub fn pick_decided(
    how: Pick,
    keep: usize,
    decided: &Decided,
    botany: f32,
    trees: &[Examined],
    scores: &Scores,
) -> Result<Picked, PickError> {
    let mut must: Vec<usize> = decided.keep.iter().copied().filter(|&i| i < trees.len()).take(keep).collect();
    must.sort_unstable();
    must.dedup();
    let open: Vec<usize> = (0..trees.len()).filter(|i| must.contains(i) || !decided.reject.contains(i)).collect();
    if open.len() < keep {
        return Err(PickError::TooFew { candidates: open.len(), keep });
    }
    let good: Vec<usize> =
        open.iter().copied().filter(|i| trees[*i].departure.by <= botany || must.contains(i)).collect();
    let rejected = open.len() - good.len();
    if good.len() <= keep {
        let mut kept = good;
        let mut rest: Vec<usize> = open.iter().copied().filter(|i| !kept.contains(i)).collect();
        rest.sort_by(|&a, &b| trees[a].departure.by.total_cmp(&trees[b].departure.by).then(a.cmp(&b)));
        let in_spite = keep - kept.len();
        kept.extend(&rest[..in_spite]);
        kept.sort_unstable();
        let apart = (matches!(how, Pick::Diverse { .. }) && keep > 1).then(|| nearest_two(&kept, trees, scores));
        return Ok(Picked { kept, rejected, in_spite, apart });
    }
    let (mut kept, mut apart) = (must, None);
    let left = keep - kept.len();
    match how {
        Pick::All => {
            let others: Vec<usize> = good.iter().copied().filter(|i| !kept.contains(i)).take(left).collect();
            kept.extend(others);
        }
        Pick::Inspiring => {
            let points: Vec<Vec<f32>> = good.iter().map(|&i| scores.each[i].summands(&scores.params)).collect();
            let found = clusters(&points, keep);
            let open = found.iter().filter(|c| !c.iter().any(|&i| kept.contains(&good[i])));
            let new: Vec<usize> = open.filter_map(|c| representative(&points, c)).map(|i| good[i]).take(left).collect();
            kept.extend(new);
            // Fewer different trees than asked for: the next ones in order.
            let rest: Vec<usize> = good.iter().copied().filter(|i| !kept.contains(i)).collect();
            kept.extend(rest.into_iter().take(keep - kept.len()));
        }
        Pick::Natural => kept = nearest(keep, kept, &good, scores),
        Pick::Diverse { apart: asked } => {
            let (found, least, first) = farthest(keep, kept, &good, trees, scores);
            if keep > 1 && first < asked {
                return Err(PickError::Apart { candidates: good.len(), asked, found: first });
            }
            kept = found;
            apart = (keep > 1).then_some(least);
        }
    }
    kept.sort_unstable();
    Ok(Picked { kept, rejected, in_spite: 0, apart })
}

/// The trees nearest to each source in turn, beside those that are kept.
fn nearest(keep: usize, mut kept: Vec<usize>, good: &[usize], scores: &Scores) -> Vec<usize> {
    let sources = scores.each.first().map_or(0, |s| s.from_sources.len());
    let mut taken = vec![false; scores.each.len()];
    kept.iter().for_each(|&i| taken[i] = true);
    let orders: Vec<Vec<usize>> = (0..sources)
        .map(|s| {
            let mut order = good.to_vec();
            let far = |i: usize| scores.each[i].from_sources[s].total;
            order.sort_by(|&a, &b| far(a).total_cmp(&far(b)).then(a.cmp(&b)));
            order
        })
        .collect();
    let mut next = vec![0; sources];
    for turn in 0.. {
        if kept.len() == keep || sources == 0 {
            break;
        }
        let s = turn % sources;
        while next[s] < orders[s].len() && taken[orders[s][next[s]]] {
            next[s] += 1;
        }
        if let Some(&tree) = orders[s].get(next[s]) {
            taken[tree] = true;
            kept.push(tree);
        }
    }
    kept
}

/// Least difference of two of some trees.
fn nearest_two(of: &[usize], trees: &[Examined], scores: &Scores) -> f32 {
    let below = |(i, &a): (usize, &usize)| scores.between(trees, a, &of[i + 1..]);
    of.iter().enumerate().flat_map(below).map(|d| d.total).fold(f32::INFINITY, f32::min)
}

/// Trees that are far from each other and from those that are kept; the least difference of two of them, and that of the first two.
fn farthest(
    keep: usize,
    mut kept: Vec<usize>,
    good: &[usize],
    trees: &[Examined],
    scores: &Scores,
) -> (Vec<usize>, f32, f32) {
    let to_source = |i: usize| scores.each[i].from_sources.iter().map(|d| d.total).fold(f32::INFINITY, f32::min);
    let better = |a: (f32, usize), b: (f32, usize)| if b.0 > a.0 { b } else { a };
    let start = good.iter().map(|&i| (to_source(i), i)).reduce(better).map_or(0, |(_, i)| i);
    if kept.is_empty() {
        kept.push(start);
    }
    let mut far = vec![f32::INFINITY; good.len()];
    let (mut least, mut first) = (f32::INFINITY, 0.0);
    for i in 0..kept.len() - 1 {
        let differences = scores.between(trees, kept[i], good);
        for (far, difference) in far.iter_mut().zip(differences) {
            *far = far.min(difference.total);
        }
        let others = scores.between(trees, kept[i], &kept[i + 1..]);
        least = others.iter().map(|d| d.total).fold(least, f32::min);
        // What is decided needs not be apart as asked.
        first = f32::INFINITY;
    }
    while kept.len() < keep {
        let last = kept[kept.len() - 1];
        for (far, difference) in far.iter_mut().zip(scores.between(trees, last, good)) {
            *far = far.min(difference.total);
        }
        let open = far.iter().zip(good).filter(|(_, i)| !kept.contains(i)).map(|(f, i)| (*f, *i));
        let Some((distance, next)) = open.reduce(better) else { break };
        if kept.len() == 1 {
            first = distance;
        }
        least = least.min(distance);
        kept.push(next);
    }
    (kept, least, first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::preset::plan::{FilterParams, MatchParams, ScoreParams};
    use crate::relate::fuzzy_family;
    use crate::relate::random_plant::{Oddity, random_plant};
    use crate::select::{Sources, examine, scores};

    const FILTER: FilterParams = FilterParams { collisions: 0.01, rise: 0.01, botany: 1.0 };
    const EVEN: ScoreParams = ScoreParams { crown: 0.5, ratio: 0.1, topology: 0.4, sources: Vec::new() };

    fn candidates(count: u64) -> (Vec<Examined>, Scores) {
        let plant = |name| random_plant(Seed::new(8).child(name), 60, Oddity::Tame);
        let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
        let family = fuzzy_family(plant("a"), plant("b"), &matching).unwrap();
        let sources = Sources::of(&family, &FILTER);
        let trees: Vec<Examined> = (0..count)
            .map(|i| {
                let progress = 0.1 + 0.8 * Seed::new(5).at(i).unit();
                let (tree, kins) = family.blend_with_kins(&crate::blend::sample(&family, 0, 1, Seed::new(i), progress));
                examine(&tree, &kins, &sources, &FILTER)
            })
            .collect();
        let scores = scores(&trees, &sources, &EVEN);
        (trees, scores)
    }

    #[test]
    fn every_pick_keeps_as_many_different_trees_as_asked() {
        let (trees, scores) = candidates(32);
        for how in [Pick::All, Pick::Inspiring, Pick::Natural, Pick::Diverse { apart: 0.0 }] {
            for keep in [1, 2, 5, 31, 32] {
                let picked = pick(how, keep, 1e9, &trees, &scores).unwrap();
                assert!(picked.kept.len() == keep && picked.kept.windows(2).all(|w| w[0] < w[1]), "{how:?} {keep}");
                assert_eq!((picked.rejected, picked.in_spite), (0, 0));
            }
        }
    }

    #[test]
    fn diverse_trees_are_farther_apart_than_the_first_ones_and_natural_ones_nearer_their_sources() {
        let (trees, scores) = candidates(32);
        let of = |how| pick(how, 4, 1e9, &trees, &scores).unwrap();
        let all = scores.diversity(&trees, &of(Pick::All).kept);
        let diverse = of(Pick::Diverse { apart: 0.0 });
        assert!(scores.diversity(&trees, &diverse.kept) > all);
        let least =
            diverse.kept.iter().enumerate().flat_map(|(i, &a)| scores.between(&trees, a, &diverse.kept[i + 1..]));
        let least = least.map(|d| d.total).fold(f32::INFINITY, f32::min);
        assert!((least - diverse.apart.unwrap()).abs() < 1e-6);
        let near = |kept: &[usize]| -> f32 {
            let nearest =
                |i: &usize| scores.each[*i].from_sources.iter().map(|d| d.total).fold(f32::INFINITY, f32::min);
            kept.iter().map(nearest).sum()
        };
        assert!(near(&of(Pick::Natural).kept) < near(&of(Pick::All).kept));
    }

    #[test]
    fn inspiring_trees_stand_for_clusters_of_scores() {
        let (trees, scores) = candidates(32);
        let kept = pick(Pick::Inspiring, 4, 1e9, &trees, &scores).unwrap().kept;
        let points: Vec<Vec<f32>> = scores.each.iter().map(|s| s.summands(&EVEN)).collect();
        for cluster in clusters(&points, 4) {
            assert_eq!(cluster.iter().filter(|i| kept.contains(i)).count(), 1);
        }
    }

    #[test]
    fn rejected_trees_are_replaced_and_the_least_bad_kept_when_nothing_else_is_left() {
        let (mut trees, scores) = candidates(12);
        for (i, tree) in trees.iter_mut().enumerate() {
            tree.departure.by = if i % 2 == 0 { 2.0 + i as f32 } else { 0.0 };
        }
        let picked = pick(Pick::All, 3, 1.0, &trees, &scores).unwrap();
        assert_eq!((picked.kept.as_slice(), picked.rejected, picked.in_spite), (&[1, 3, 5][..], 6, 0));
        let picked = pick(Pick::Inspiring, 8, 1.0, &trees, &scores).unwrap();
        assert_eq!((picked.kept.as_slice(), picked.in_spite), (&[0, 1, 2, 3, 5, 7, 9, 11][..], 2));
    }

    #[test]
    fn what_is_decided_goes_before_every_way_of_picking() {
        let (trees, scores) = candidates(32);
        for how in [Pick::All, Pick::Inspiring, Pick::Natural, Pick::Diverse { apart: 0.0 }] {
            for keep in [2, 5, 29] {
                let free = pick(how, keep, 1e9, &trees, &scores).unwrap().kept;
                let out = (0..32).find(|i| !free.contains(i)).unwrap();
                let decided = Decided { keep: vec![out], reject: vec![free[0]] };
                let kept = pick_decided(how, keep, &decided, 1e9, &trees, &scores).unwrap().kept;
                assert!(kept.contains(&out) && !kept.contains(&free[0]), "{how:?} {keep}");
                assert!(kept.len() == keep && kept.windows(2).all(|w| w[0] < w[1]), "{how:?} {keep} {kept:?}");
                // What was picked freely and is then kept stays as it was.
                let again = Decided { keep: free.clone(), reject: Vec::new() };
                assert_eq!(pick_decided(how, keep, &again, 1e9, &trees, &scores).unwrap().kept, free);
            }
        }
        let all = Decided { keep: Vec::new(), reject: (0..31).collect() };
        let found = pick_decided(Pick::All, 2, &all, 1e9, &trees, &scores);
        assert_eq!(found, Err(PickError::TooFew { candidates: 1, keep: 2 }));
    }

    #[test]
    fn what_cannot_be_picked_is_an_error() {
        let (trees, scores) = candidates(8);
        assert_eq!(pick(Pick::All, 9, 1.0, &trees, &scores), Err(PickError::TooFew { candidates: 8, keep: 9 }));
        let far = pick(Pick::Diverse { apart: 1.0 }, 2, 1e9, &trees, &scores);
        assert!(matches!(far, Err(PickError::Apart { candidates: 8, .. })), "{far:?}");
    }
}
