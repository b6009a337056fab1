//! k-means of scores (2017 TVCG, 4.5).
//!
//! The paper clusters "the trees' inspiring scores". A score is a weighted sum of differences from the sources; here the
//! summands are clustered, a coordinate each, not the sum. Clusters of sums (on a line, where the optimum can be had
//! exactly) were measured first: the trees they gave differed from each other by 1.10 times as much as random ones on street
//! oaks and by 0.96 times on birch and oak, since a tree near the one source has the same sum as one near the other.
//!
//! Deterministic without a seed: centres start at the points that are farthest from each other (Gonzalez 1985), and Lloyd's
//! rounds go on until nothing changes, [`MOST_ROUNDS`] at most.

/// Most rounds; real ones need ten.
const MOST_ROUNDS: usize = 64;

/// Splits points into at most `k` clusters around their means. Gives each cluster's members as indices, rising; no cluster
/// is empty, so there are fewer than `k` where there are fewer different points. Coordinates that are missing or not
/// numbers count as 0. `rounds · k · points · coordinates`.
#[must_use]
pub fn clusters(points: &[Vec<f32>], k: usize) -> Vec<Vec<usize>> {
    let width = points.iter().map(Vec::len).max().unwrap_or(0);
    let clean = |p: &Vec<f32>| (0..width).map(|i| p.get(i).copied().filter(|x| x.is_finite()).unwrap_or(0.0)).collect();
    let points: Vec<Vec<f32>> = points.iter().map(clean).collect();
    let mut centres = starts(&points, k);
    let mut own = vec![usize::MAX; points.len()];
    for _ in 0..MOST_ROUNDS {
        let next: Vec<usize> = points.iter().map(|p| nearest(p, &centres)).collect();
        if next == own {
            break;
        }
        own = next;
        for (c, centre) in centres.iter_mut().enumerate() {
            let members: Vec<usize> = (0..points.len()).filter(|&i| own[i] == c).collect();
            // A centre that lost all its members stays where it is.
            if !members.is_empty() {
                *centre = mean(&points, &members);
            }
        }
    }
    let members = |c: usize| (0..points.len()).filter(|&i| own[i] == c).collect::<Vec<usize>>();
    (0..centres.len()).map(members).filter(|m| !m.is_empty()).collect()
}

/// The member of a cluster that is nearest its mean; the first among equals. None of an empty one.
#[must_use]
pub fn representative(points: &[Vec<f32>], cluster: &[usize]) -> Option<usize> {
    let mean = mean(points, cluster);
    let far = |i: usize| square(&points[i], &mean);
    cluster.iter().copied().min_by(|&a, &b| far(a).total_cmp(&far(b)).then(a.cmp(&b)))
}

/// Points far from each other, as many as there are different ones and `k` at most; the first is the one farthest from
/// the mean of all.
fn starts(points: &[Vec<f32>], k: usize) -> Vec<Vec<f32>> {
    let all: Vec<usize> = (0..points.len()).collect();
    let middle = mean(points, &all);
    let mut far: Vec<f32> = points.iter().map(|p| square(p, &middle)).collect();
    let mut centres: Vec<Vec<f32>> = Vec::new();
    while centres.len() < k.min(points.len()) {
        let most = all.iter().copied().reduce(|a, b| if far[b] > far[a] { b } else { a });
        let Some(next) = most.filter(|&i| centres.is_empty() || far[i] > 0.0) else { break };
        for (far, point) in far.iter_mut().zip(points) {
            let d = square(point, &points[next]);
            *far = if centres.is_empty() { d } else { far.min(d) };
        }
        centres.push(points[next].clone());
    }
    centres
}

fn nearest(point: &[f32], centres: &[Vec<f32>]) -> usize {
    let mut best = (f32::INFINITY, 0);
    for (c, centre) in centres.iter().enumerate() {
        let d = square(point, centre);
        if d < best.0 {
            best = (d, c);
        }
    }
    best.1
}

fn mean(points: &[Vec<f32>], members: &[usize]) -> Vec<f32> {
    let width = points.first().map_or(0, Vec::len);
    let mut sum = vec![0.0_f64; width];
    for &i in members {
        sum.iter_mut().zip(&points[i]).for_each(|(s, x)| *s += f64::from(*x));
    }
    sum.into_iter().map(|s| (s / members.len().max(1) as f64) as f32).collect()
}

fn square(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn cloud(seed: u64, n: u64) -> Vec<Vec<f32>> {
        (0..n).map(|i| (0..4).map(|d| Seed::new(seed).at(i).at(d).unit()).collect()).collect()
    }

    #[test]
    fn heaps_are_found_and_their_centres_stand_for_them() {
        let centre = |i: usize| [[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]][i % 3];
        let points: Vec<Vec<f32>> = (0..30)
            .map(|i| {
                let off = if i < 3 { 0.0 } else { 1.0 };
                let d = Seed::new(i as u64).direction() * off;
                vec![centre(i)[0] + d.x, centre(i)[1] + d.y]
            })
            .collect();
        let heaps = clusters(&points, 3);
        assert_eq!(heaps.len(), 3);
        for heap in &heaps {
            assert!(heap.len() == 10 && heap.iter().all(|i| i % 3 == heap[0] % 3));
            assert!(square(&points[representative(&points, heap).unwrap()], &centre(heap[0])) < 1.0);
        }
    }

    #[test]
    fn every_point_is_in_the_cluster_whose_mean_is_nearest() {
        for seed in 0..20 {
            let points = cloud(seed, 60);
            let found = clusters(&points, 7);
            let means: Vec<Vec<f32>> = found.iter().map(|c| mean(&points, c)).collect();
            for (c, cluster) in found.iter().enumerate() {
                assert!(cluster.iter().all(|&i| nearest(&points[i], &means) == c), "seed {seed}");
            }
            let mut all = found.concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..60));
        }
    }

    #[test]
    fn odd_requests_are_taken() {
        assert!(clusters(&[], 3).is_empty());
        assert!(clusters(&cloud(1, 5), 0).concat().is_empty());
        assert_eq!(clusters(&vec![vec![1.0]; 9], 4), [(0..9).collect::<Vec<_>>()]);
        assert_eq!(clusters(&[vec![f32::NAN], vec![], vec![3.0]], 9).len(), 2);
        assert_eq!(representative(&[], &[]), None);
    }
}
