//! A chain as a curve of 50 equidistant samples (2018 TOG, section 2) and its square root velocity function (section 3).
//!
//! The samples are interpolated by a uniform cubic B-spline with natural ends, the best fit there is: it passes through
//! all of them. Its derivative gives the velocity, so `q = f' / √|f'|` follows corners of the polyline smoothly. The curve
//! is scaled to unit length first. A chain without length has q = 0 everywhere and is registered by its parameter.

use glam::{DVec3, Vec3};

use crate::plant::Curve;

/// Samples of a curve.
pub const SAMPLES: usize = 50;
/// A curve whose velocity turns less than this from end to end (chord of unit vectors) is straight.
const STRAIGHT: f64 = 0.02;

/// A chain of unit length by its square root velocity function.
#[derive(Clone, Debug)]
pub struct ElasticCurve {
    /// At parameters `i / (SAMPLES - 1)`; all zero for a chain without length.
    q: Vec<DVec3>,
    straight: bool,
}

impl ElasticCurve {
    /// Samples a polyline of at least one point.
    #[must_use]
    pub fn new(points: &[Vec3]) -> Self {
        let curve = Curve::new(points);
        let last = (SAMPLES - 1) as f64;
        let samples: Vec<DVec3> = (0..SAMPLES).map(|i| curve.point(i as f64 / last).as_dvec3()).collect();
        Self::of_samples(&samples)
    }

    /// The curve through equidistant samples, at least three.
    pub(super) fn of_samples(samples: &[DVec3]) -> Self {
        let length: f64 = samples.windows(2).map(|w| w[0].distance(w[1])).sum();
        if length <= 0.0 || samples.len() < 3 {
            return Self { q: vec![DVec3::ZERO; samples.len()], straight: true };
        }
        let scale = 1.0 / length;
        let control = control_points(samples);
        let last = samples.len() - 1;
        let half = last as f64 * 0.5 * scale;
        let velocity = |i: usize| {
            // Natural ends: the control points beyond them mirror the inner ones.
            let before = if i == 0 { control[0] * 2.0 - control[1] } else { control[i - 1] };
            let after = if i == last { control[last] * 2.0 - control[last - 1] } else { control[i + 1] };
            (after - before) * half
        };
        let q: Vec<DVec3> = (0..=last)
            .map(|i| {
                let v = velocity(i);
                let speed = v.length();
                if speed > 0.0 { v / speed.sqrt() } else { DVec3::ZERO }
            })
            .collect();
        let unit = |q: &DVec3| q.normalize_or_zero();
        let first = unit(&q[0]);
        let straight = q.iter().all(|q| unit(q).distance(first) < STRAIGHT);
        Self { q, straight }
    }

    /// The square root velocity function at the samples.
    #[must_use]
    pub fn q(&self) -> &[DVec3] {
        &self.q
    }

    /// Whether it points one way all along: reparameterization gains nothing then.
    pub(super) fn is_straight(&self) -> bool {
        self.straight
    }

    /// A curve given by its function itself.
    pub(super) fn of_q(q: Vec<DVec3>) -> Self {
        Self { q, straight: false }
    }
}

/// Control points of the uniform cubic B-spline through some points: `(c[i-1] + 4 c[i] + c[i+1]) / 6 = p[i]`, and
/// `c = p` at the ends.
fn control_points(points: &[DVec3]) -> Vec<DVec3> {
    let last = points.len() - 1;
    let mut control = points.to_vec();
    // Thomas' algorithm on the inner points.
    let mut upper = vec![0.0_f64; points.len()];
    for i in 1..last {
        let pivot = 1.0 / (4.0 - if i > 1 { upper[i - 1] } else { 0.0 });
        let right = points[i] * 6.0 - control[i - 1] - if i + 1 == last { points[last] } else { DVec3::ZERO };
        upper[i] = pivot;
        control[i] = right * pivot;
    }
    for i in (1..last.saturating_sub(1)).rev() {
        control[i] = control[i] - control[i + 1] * upper[i];
    }
    control
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_passes_through_its_points() {
        let points: Vec<DVec3> = (0..12).map(|i| DVec3::new(f64::from(i), f64::from(i * i % 5), 1.0)).collect();
        let c = control_points(&points);
        assert!(c[0] == points[0] && c[11] == points[11]);
        for i in 1..11 {
            let at = (c[i - 1] + c[i] * 4.0 + c[i + 1]) / 6.0;
            assert!(at.distance(points[i]) < 1e-12, "{i}: {at}");
        }
    }

    #[test]
    fn a_curve_has_unit_length_and_q_the_square_root_of_its_speed() {
        // A quarter of a circle: constant speed, turning.
        let points: Vec<Vec3> = (0..80)
            .map(|i| {
                let (s, c) = crate::base::math::sin_cos(i as f32 / 79.0 * 1.5);
                Vec3::new(c - 1.0, s, 0.0) * 3.0
            })
            .collect();
        let curve = ElasticCurve::new(&points);
        assert!(curve.q().iter().all(|q| (q.length() - 1.0).abs() < 5e-3) && !curve.is_straight());
        assert!(ElasticCurve::new(&[Vec3::ZERO, Vec3::Y]).is_straight());
        assert!(ElasticCurve::new(&[Vec3::ZERO; 3]).q().iter().all(|q| *q == DVec3::ZERO));
    }
}
