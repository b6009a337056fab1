//! The Karcher mean of some curves and how each runs along it (2018 TOG, Eq. 3).
//!
//! Gradient descent as in Srivastava et al. 2011: all curves are registered to the mean, the mean becomes the average of
//! their turned and reparameterized functions, brought back to unit norm; the first curve is the first guess. Rounds end when the
//! curves agree with their mean no better than before, by [`LEAST_GAIN`] each.

use glam::DVec3;

use super::curve::ElasticCurve;
use super::monotone::Monotone;
use super::register::{Registration, register};
use super::rotation::turned;

/// Most rounds of descent.
const ROUNDS: usize = 12;
/// Rounds end when one gains less than this a curve, as in [`register`].
const LEAST_GAIN: f64 = 1e-4;

/// For each curve the map from the mean's parameter to its own.
pub(super) fn registered_to_mean(curves: &[ElasticCurve]) -> Vec<Monotone> {
    let found = mean(curves).1;
    found.into_iter().map(|r| Monotone::new(r.gamma)).collect()
}

/// The mean and how each curve runs along it.
fn mean(curves: &[ElasticCurve]) -> (ElasticCurve, Vec<Registration>) {
    let mut mean = curves[0].clone();
    let mut found: Vec<Registration> = curves.iter().map(|c| register(&mean, c)).collect();
    // Straight curves and equal ones need no descent.
    let bent = found.iter().any(|r| r.gamma.len() > 2);
    let agreed = |found: &[Registration]| found.iter().map(|r| r.agreement).sum::<f64>() / curves.len() as f64;
    // The first curve agrees with itself wholly, which says nothing.
    let mut last = f64::NEG_INFINITY;
    for _ in 0..if bent { ROUNDS } else { 0 } {
        let next = average(curves, &found);
        let registered: Vec<Registration> = curves.iter().map(|c| register(&next, c)).collect();
        let agreement = agreed(&registered);
        // A step back is none that descent takes; registration may, since its paths are a lattice's.
        if agreement <= last {
            break;
        }
        (mean, found) = (next, registered);
        if agreement - last < LEAST_GAIN {
            break;
        }
        last = agreement;
    }
    (mean, found)
}

/// The average function, of unit norm.
fn average(curves: &[ElasticCurve], found: &[Registration]) -> ElasticCurve {
    let count = curves[0].q().len();
    let last = (count - 1) as f64;
    let mut sum = vec![DVec3::ZERO; count];
    for (curve, registration) in curves.iter().zip(found) {
        let q = curve.q();
        let gamma = &registration.gamma;
        for (i, to) in sum.iter_mut().enumerate() {
            let u = i as f64 / last;
            let next = gamma.partition_point(|g| g.0 < u).clamp(1, gamma.len() - 1);
            let (a, b) = (gamma[next - 1], gamma[next]);
            let slope = (b.1 - a.1) / (b.0 - a.0);
            let place = ((a.1 + (u - a.0) * slope) * last).clamp(0.0, last);
            let (low, f) = (place as usize, place - (place as usize) as f64);
            let here = if low + 1 < count { q[low].lerp(q[low + 1], f) } else { q[count - 1] };
            *to += turned(&registration.turn, here) * slope.sqrt();
        }
    }
    let norm = (sum.iter().map(|q| q.length_squared()).sum::<f64>() / last).sqrt();
    if norm > 0.0 {
        sum.iter_mut().for_each(|q| *q /= norm);
    }
    ElasticCurve::of_q(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use glam::Vec3;

    #[test]
    fn curves_agree_with_their_mean_better_than_with_each_other() {
        for i in 0..10 {
            let curve = |k: u64| {
                let seed = Seed::new(i).at(k);
                let mut points = vec![Vec3::ZERO];
                for j in 0..14 {
                    let bend = Vec3::new(crate::base::math::sin(j as f32 * 0.6 + seed.unit()), 1.0, 0.0);
                    points.push(points[j] + bend + seed.at(j as u64).direction() * 0.4);
                }
                ElasticCurve::new(&points)
            };
            let curves: Vec<ElasticCurve> = (0..4).map(curve).collect();
            let (mean, found) = mean(&curves);
            let to_mean: f64 = found.iter().map(|r| r.agreement).sum();
            let to_first: f64 = curves.iter().map(|c| register(&curves[0], c).agreement).sum();
            // Equal functions agree by 1, also where corners cost the samples some of their norm.
            assert!(to_mean > to_first - 1.0 + 0.9, "{to_mean} {to_first}");
            assert!(mean.q().iter().all(|q| q.is_finite()));
        }
        let straight = ElasticCurve::new(&[Vec3::ZERO, Vec3::Y]);
        assert!(registered_to_mean(&vec![straight; 3]).iter().all(|m| m.knots() == [(0.0, 0.0), (1.0, 1.0)]));
    }

    #[test]
    fn another_round_from_the_mean_would_gain_nothing() {
        for i in 0..10 {
            let curve = |k: u64| {
                let seed = Seed::new(i).child("far").at(k);
                let mut points = vec![Vec3::ZERO];
                for j in 0..14 {
                    let bend = Vec3::new(crate::base::math::sin(j as f32 * 0.6 + 3.0 * seed.unit()), 1.0, 0.0);
                    points.push(points[j] + bend + seed.at(j as u64).direction() * 0.4);
                }
                ElasticCurve::new(&points)
            };
            let curves: Vec<ElasticCurve> = (0..5).map(curve).collect();
            let (_, found) = mean(&curves);
            let next = average(&curves, &found);
            let agreed: f64 = found.iter().map(|r| r.agreement).sum();
            let then: f64 = curves.iter().map(|c| register(&next, c).agreement).sum();
            // A round may gain a little more than the one before.
            assert!(then - agreed < 15.0 * LEAST_GAIN, "{i}: {agreed} {then}");
        }
    }
}
