//! k-means of scores (2017 TVCG, 4.5): a score is one number, and on a line the best clusters are runs of the sorted
//! scores. So the optimum itself is found by dynamic programming (Wang and Song 2011, Ckmeans.1d.dp), in `k · n log n` by
//! divide and conquer, since the best start of the last run never moves down when a score is added. No seeds, no
//! restarts, no rounds to wait for.
//!
//! Rejected: Lloyd's rounds from k-means++ starts. On a line they end in a local optimum that depends on the seed.

/// Splits scores into at most `k` clusters so that the squared distances to the clusters' means add up to the least.
/// Gives each cluster's members as indices into `scores`, clusters by rising score, members by rising score and index.
/// Equal scores may fall into two clusters only when there are fewer different scores than clusters. Scores that are not
/// numbers count as 0.
#[must_use]
pub fn clusters(scores: &[f64], k: usize) -> Vec<Vec<usize>> {
    let clean = |i: usize| if scores[i].is_finite() { scores[i] } else { 0.0 };
    let mut order: Vec<usize> = (0..scores.len()).collect();
    order.sort_by(|&a, &b| clean(a).total_cmp(&clean(b)).then(a.cmp(&b)));
    let n = order.len();
    let k = k.min(n);
    if k == 0 {
        return Vec::new();
    }
    // Measured from the middle, so that squares lose no digits.
    let middle = clean(order[n / 2]);
    let mut sums = vec![(0.0_f64, 0.0_f64); n + 1];
    for (i, &index) in order.iter().enumerate() {
        let x = clean(index) - middle;
        sums[i + 1] = (sums[i].0 + x, sums[i].1 + x * x);
    }
    let runs = Runs { sums };
    // cost[i]: the least for the first i scores in so many clusters; starts[c][i]: where the last one begins.
    let mut cost: Vec<f64> = (0..=n).map(|i| runs.spread(0, i)).collect();
    let mut starts = vec![vec![0_usize; n + 1]];
    for clusters in 1..k {
        let mut next = vec![f64::INFINITY; n + 1];
        let mut start = vec![clusters; n + 1];
        runs.divide(&cost, &mut next, &mut start, (clusters + 1, n), (clusters, n - 1));
        cost = next;
        starts.push(start);
    }
    let mut ends = vec![n];
    for c in (1..k).rev() {
        let end = ends[ends.len() - 1];
        ends.push(starts[c][end]);
    }
    ends.push(0);
    ends.reverse();
    ends.windows(2).map(|w| order[w[0]..w[1]].to_vec()).collect()
}

/// The member of a cluster whose score is nearest the mean; the first among equals.
#[must_use]
pub fn representative(scores: &[f64], cluster: &[usize]) -> Option<usize> {
    let mean = cluster.iter().map(|&i| scores[i]).sum::<f64>() / cluster.len().max(1) as f64;
    cluster.iter().copied().min_by(|&a, &b| {
        let far = |i: usize| (scores[i] - mean).abs();
        far(a).total_cmp(&far(b)).then(a.cmp(&b))
    })
}

/// Sums of sorted scores and of their squares.
struct Runs {
    sums: Vec<(f64, f64)>,
}

impl Runs {
    /// Squared distances of scores `from..to` to their mean, added up.
    fn spread(&self, from: usize, to: usize) -> f64 {
        if to <= from {
            return 0.0;
        }
        let (sum, squares) = (self.sums[to].0 - self.sums[from].0, self.sums[to].1 - self.sums[from].1);
        (squares - sum * sum / (to - from) as f64).max(0.0)
    }

    /// Fills `next` and `start` for the ends `ends.0..=ends.1`, whose best starts lie in `among.0..=among.1`.
    fn divide(&self, cost: &[f64], next: &mut [f64], start: &mut [usize], ends: (usize, usize), among: (usize, usize)) {
        let mut work = vec![(ends, among)];
        while let Some(((low, high), (first, last))) = work.pop() {
            if low > high {
                continue;
            }
            let end = usize::midpoint(low, high);
            let (mut best, mut at) = (f64::INFINITY, first);
            for s in first..=last.min(end - 1) {
                let c = cost[s] + self.spread(s, end);
                if c < best {
                    (best, at) = (c, s);
                }
            }
            (next[end], start[end]) = (best, at);
            work.push(((end + 1, high), (at, last)));
            work.push(((low, end - 1), (first, at)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn spread(scores: &[f64], cluster: &[usize]) -> f64 {
        let mean = cluster.iter().map(|&i| scores[i]).sum::<f64>() / cluster.len() as f64;
        cluster.iter().map(|&i| (scores[i] - mean) * (scores[i] - mean)).sum()
    }

    /// The least over all ways to cut the sorted scores.
    fn brute(sorted: &[f64], k: usize) -> f64 {
        if k == 1 {
            let all: Vec<usize> = (0..sorted.len()).collect();
            return spread(sorted, &all);
        }
        (k - 1..sorted.len())
            .map(|s| {
                let last: Vec<usize> = (s..sorted.len()).collect();
                brute(&sorted[..s], k - 1) + spread(sorted, &last)
            })
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn clusters_are_the_best_there_are() {
        for s in 0..60 {
            let seed = Seed::new(s);
            let n = 1 + seed.child("n").index(14);
            let scores: Vec<f64> = (0..n as u64).map(|i| f64::from(seed.at(i).range(0.0, 5.0))).collect();
            for k in 1..=n.min(5) {
                let found = clusters(&scores, k);
                assert_eq!(found.len(), k);
                let mut sorted = scores.clone();
                sorted.sort_by(f64::total_cmp);
                let cost: f64 = found.iter().map(|c| spread(&scores, c)).sum();
                assert!((cost - brute(&sorted, k)).abs() < 1e-9, "seed {s} k {k}");
                let mut members: Vec<usize> = found.into_iter().flatten().collect();
                members.sort_unstable();
                assert!(members.into_iter().eq(0..n));
            }
        }
    }

    #[test]
    fn three_heaps_are_found_and_their_centres_stand_for_them() {
        let scores = [5.0, 0.1, 9.2, 5.2, 0.0, 9.0, 0.2, 5.1, 9.1];
        let heaps = clusters(&scores, 3);
        let centres: Vec<Option<usize>> = heaps.iter().map(|c| representative(&scores, c)).collect();
        assert_eq!(centres, [Some(1), Some(7), Some(8)]);
    }

    #[test]
    fn odd_requests_are_taken() {
        assert!(clusters(&[], 3).is_empty());
        assert!(clusters(&[1.0], 0).is_empty());
        assert_eq!(clusters(&[1.0, 1.0], 9).len(), 2);
        assert_eq!(clusters(&[f64::NAN, f64::INFINITY, 1.0], 2).concat().len(), 3);
        assert_eq!(representative(&[], &[]), None);
    }
}
