//! The Fréchet mean of points of tree-shape space (2018 TOG, Eq. 6) by Sturm's algorithm (Sturm 2003): from where it is, the
//! estimate walks along the geodesic towards one point after the other, each time by the share that the point's weight has
//! among those before.
//!
//! Sturm draws the points at random; here they come round in order, which converges as well and is the exact mean after
//! every round where the space is flat.

use super::straighten::TreeGeodesic;
use super::tree_point::TreePoint;

/// The mean of some points of one family with weights above zero, after so many rounds; none of no points.
#[must_use]
pub fn frechet_mean(points: &[TreePoint], weights: &[f64], rounds: usize) -> Option<TreePoint> {
    let weight = |i: usize| weights.get(i).copied().filter(|w| w.is_finite() && *w > 0.0);
    let there: Vec<usize> = (0..points.len()).filter(|&i| weight(i).is_some()).collect();
    let mut mean = points[*there.first()?].clone();
    let mut sum = 0.0;
    for _ in 0..rounds.max(1) {
        for &i in &there {
            let own = weight(i).unwrap_or(0.0);
            sum += own;
            // The first walk starts where it ends.
            if sum > own {
                mean = TreeGeodesic::new(&mean, &points[i]).at(own / sum);
            }
        }
    }
    Some(mean)
}

/// The weighted sum of squared distances from a point: what the mean makes least.
#[must_use]
pub fn variance(mean: &TreePoint, points: &[TreePoint], weights: &[f64]) -> f64 {
    let square = |p: &TreePoint| {
        let length = TreeGeodesic::new(mean, p).length();
        length * length
    };
    points.iter().zip(weights).map(|(p, w)| square(p) * w).sum()
}
