//! A polyline by arc length, with frames that depend on its shape only and not on where its points happen to lie.
//!
//! Blending resamples a chain (`relate/family.rs`), and a child must then stand exactly where it stood. Frames at the
//! polyline's own vertices would jump when a location falls on the other side of a vertex by one rounding error. So
//! frames live at `STATIONS + 1` fixed arc-length stations: the tangent there is the chord between the neighbouring
//! stations, frames are carried from one to the next by the least rotation (a rotation-minimizing frame), and between
//! stations the tangent moves along the great arc. Inserting points on the polyline changes nothing; a location that is
//! off by δ turns a child by at most about `16 · δ · bend`.

use std::borrow::Cow;

use glam::Vec3;

use crate::base::Frame;

/// Intervals into which a chain's arc length is cut for its frames.
pub const STATIONS: usize = 16;

/// A polyline parameterized by arc length 0..=1.
#[derive(Clone, Debug)]
pub struct Curve<'a> {
    points: &'a [Vec3],
    /// Arc length from the base up to each point, metres.
    arc: Cow<'a, [f64]>,
}

impl<'a> Curve<'a> {
    /// Measures a polyline of at least one point.
    #[must_use]
    pub fn new(points: &'a [Vec3]) -> Self {
        let mut arc = Vec::with_capacity(points.len());
        Self::measure(points, &mut arc);
        Self { points, arc: Cow::Owned(arc) }
    }

    /// Appends the arc length from the first point up to each.
    pub(super) fn measure(points: &[Vec3], arc: &mut Vec<f64>) {
        let mut length = 0.0_f64;
        arc.push(0.0);
        for pair in points.windows(2) {
            length += pair[0].as_dvec3().distance(pair[1].as_dvec3());
            arc.push(length);
        }
    }

    /// The curve of some points whose arc lengths were measured before.
    pub(super) fn measured(points: &'a [Vec3], arc: &'a [f64]) -> Self {
        Self { points, arc: Cow::Borrowed(arc) }
    }

    /// Total arc length, metres.
    #[must_use]
    pub fn length(&self) -> f32 {
        self.arc[self.arc.len() - 1] as f32
    }

    /// The arc-length parameter of each point, 0..=1; points spread evenly where the length is zero.
    #[must_use]
    pub fn parameters(&self) -> Vec<f64> {
        let length = self.arc[self.arc.len() - 1];
        if length > 0.0 {
            self.arc.iter().map(|a| a / length).collect()
        } else {
            let last = (self.arc.len() - 1).max(1) as f64;
            (0..self.arc.len()).map(|i| i as f64 / last).collect()
        }
    }

    /// The segment that holds parameter `t`, and the fraction along it.
    #[must_use]
    pub fn segment(&self, t: f64) -> (usize, f32) {
        let last = self.arc.len() - 1;
        if last == 0 {
            return (0, 0.0);
        }
        let s = t.clamp(0.0, 1.0) * self.arc[last];
        let i = self.arc[1..last].partition_point(|&a| a <= s);
        let span = self.arc[i + 1] - self.arc[i];
        let f = if span > 0.0 { ((s - self.arc[i]) / span).clamp(0.0, 1.0) } else { 0.0 };
        (i, f as f32)
    }

    /// The point at parameter `t`.
    #[must_use]
    pub fn point(&self, t: f64) -> Vec3 {
        let (i, f) = self.segment(t);
        if i + 1 < self.points.len() { self.points[i].lerp(self.points[i + 1], f) } else { self.points[i] }
    }

    /// A value given at each point (a radius, say), linearly in between.
    #[must_use]
    pub fn value(&self, values: &[f32], t: f64) -> f32 {
        let (i, f) = self.segment(t);
        if i + 1 < values.len() { values[i] + (values[i + 1] - values[i]) * f } else { values[i] }
    }

    /// The frames at the stations; `start` is the frame in which the points are given, seen from the world. The
    /// frames returned are in the world.
    #[must_use]
    pub fn frames(&self, start: Frame) -> [Frame; STATIONS + 1] {
        let step = 1.0 / STATIONS as f64;
        // As `point`, but stations follow each other, so that their segments need not be searched for.
        let last = self.arc.len() - 1;
        let mut at = [self.points[0]; STATIONS + 1];
        if last > 0 {
            // One over a segment's length; any number where it has none, since no station lies beyond its start.
            let per = |i: usize| (self.arc[i + 1] - self.arc[i]).recip().min(f64::MAX);
            let (mut i, mut each) = (0, per(0));
            for (k, place) in at.iter_mut().enumerate() {
                let s = (k as f64 * step) * self.arc[last];
                while i + 1 < last && self.arc[i + 1] <= s {
                    i += 1;
                    each = per(i);
                }
                let f = ((s - self.arc[i]) * each).clamp(0.0, 1.0);
                *place = self.points[i].lerp(self.points[i + 1], f as f32);
            }
        }
        let shortest = self.length() * 1e-4;
        // Directions first: they do not wait for each other, as frames do.
        let mut axes = [start.y; STATIONS + 1];
        let mut axis = start.y;
        for k in 0..=STATIONS {
            let chord = at[(k + 1).min(STATIONS)] - at[k.saturating_sub(1)];
            let length = chord.length();
            // A chain that folds back on itself has no chord here: keep the last direction.
            if length > shortest {
                axis = start.to_world(chord / length);
            }
            axes[k] = axis;
        }
        Frame::along_all(start, &axes)
    }
}

/// A value given at each of some parameters (never falling), at `t`, linearly in between.
pub(crate) fn value_at(parameters: &[f64], values: &[f32], t: f32) -> f32 {
    let t = f64::from(t);
    let next = parameters.partition_point(|&p| p <= t);
    if next == 0 {
        return values[0];
    }
    if next == parameters.len() {
        return values[next - 1];
    }
    let (low, high) = (parameters[next - 1], parameters[next]);
    values[next - 1] + (values[next] - values[next - 1]) * ((t - low) / (high - low)) as f32
}

/// The direction of the axis at parameter `t` between stations: `y` of [`frame_at`], for less.
pub(super) fn tangent_at(frames: &[Frame; STATIONS + 1], t: f32) -> Vec3 {
    let s = t.clamp(0.0, 1.0) * STATIONS as f32;
    let k = (s as usize).min(STATIONS - 1);
    if s == k as f32 {
        return frames[k].y;
    }
    frames[k].y.lerp(frames[k + 1].y, s - k as f32).try_normalize().unwrap_or(frames[k].y)
}

/// The frame at parameter `t` between stations.
pub(crate) fn frame_at(frames: &[Frame; STATIONS + 1], t: f32) -> Frame {
    let s = t.clamp(0.0, 1.0) * STATIONS as f32;
    let k = (s as usize).min(STATIONS - 1);
    if s == k as f32 {
        return frames[k];
    }
    let tangent = frames[k].y.lerp(frames[k + 1].y, s - k as f32);
    match tangent.try_normalize() {
        Some(tangent) => frames[k].turned(tangent),
        None => frames[k],
    }
}
