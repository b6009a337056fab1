//! Orthonormal frames and unit quaternions, in scalar arithmetic.
//!
//! `glam::Quat` uses SIMD whose order of summation differs between platforms; `clippy.toml` bans it in the library, and
//! these few operations take its place.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::math;

/// A right-handed orthonormal frame; `y` runs along the axis of the chain it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First cross direction.
    pub x: Vec3,
    /// Along the axis.
    pub y: Vec3,
    /// Second cross direction, `x × y`.
    pub z: Vec3,
}

impl Frame {
    /// The world's axes: `y` is up.
    pub const WORLD: Self = Self { x: Vec3::X, y: Vec3::Y, z: Vec3::Z };

    /// The world's frame turned by the least rotation that brings its `y` to `axis` (a unit vector).
    #[must_use]
    pub fn along(axis: Vec3) -> Self {
        Self::WORLD.transported(axis)
    }

    /// This frame turned by the least rotation that brings `y` to `axis` (a unit vector): one step of a
    /// rotation-minimizing frame.
    #[must_use]
    pub fn transported(self, axis: Vec3) -> Self {
        let both = self.y + axis;
        let towards = 1.0 + self.y.dot(axis);
        // What stands at right angles to the one direction moves along their sum only. Where they are nearly opposite the sum
        // says little.
        let x = if towards > 0.01 {
            self.x - both * (self.x.dot(axis) / towards)
        } else {
            Rotation::between(self.y, axis).rotate(self.x)
        };
        // Gram-Schmidt against the new axis, so that long runs of steps don't drift away from orthonormal.
        let x = (x - axis * x.dot(axis)).try_normalize().unwrap_or_else(|| any_orthogonal(axis));
        Self { x, y: axis, z: x.cross(axis) }
    }

    /// As [`transported`](Self::transported), for one of some hundred steps: what rounding adds, a ten-millionth a step, stays.
    #[inline]
    pub(crate) fn turned(self, axis: Vec3) -> Self {
        let towards = 1.0 + self.y.dot(axis);
        if towards <= 0.01 {
            return self.transported(axis);
        }
        let x = self.x - (self.y + axis) * (self.x.dot(axis) / towards);
        Self { x, y: axis, z: x.cross(axis) }
    }

    /// The frames that `first` becomes [`transported`](Self::transported) from one of some axes to the next: as
    /// [`turned`](Self::turned), and no step waits for a quotient of the one before.
    pub(crate) fn along_all<const N: usize>(first: Self, axes: &[Vec3; N]) -> [Self; N] {
        let mut frames = [first; N];
        let mut ways = [Vec3::ZERO; N];
        let mut before = first.y;
        // Axes that are nearly opposite to the one before, of which there are next to none.
        let mut back = false;
        for (way, &axis) in ways.iter_mut().zip(axes) {
            let towards = 1.0 + before.dot(axis);
            back |= towards <= 0.01;
            *way = (before + axis) / towards;
            before = axis;
        }
        let (mut x, mut y) = (first.x, first.y);
        for (frame, (&axis, &way)) in frames.iter_mut().zip(axes.iter().zip(&ways)) {
            if back && 1.0 + y.dot(axis) <= 0.01 {
                x = Self { x, y, z: x.cross(y) }.transported(axis).x;
            } else {
                x -= way * x.dot(axis);
            }
            y = axis;
            *frame = Self { x, y, z: x.cross(y) };
        }
        frames
    }

    /// The vector with coordinates `v` in this frame, in the world.
    #[must_use]
    pub fn to_world(self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// The coordinates in this frame of the world's vector `v`.
    #[must_use]
    pub fn to_local(self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// The rotation that brings the world's axes to this frame's.
    #[must_use]
    pub fn rotation(self) -> Rotation {
        Rotation::from_axes(self.x, self.y, self.z)
    }
}

/// A rotation, as a unit quaternion `x i + y j + z k + w`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rotation {
    /// Imaginary part.
    pub v: Vec3,
    /// Real part.
    pub w: f32,
}

impl Rotation {
    /// No rotation.
    pub const IDENTITY: Self = Self { v: Vec3::ZERO, w: 1.0 };

    /// By `angle` radians about the unit vector `axis`.
    #[must_use]
    pub fn about(axis: Vec3, angle: f32) -> Self {
        let (sin, cos) = math::sin_cos(angle * 0.5);
        Self { v: axis * sin, w: cos }
    }

    /// The least rotation from the unit vector `from` to the unit vector `to`.
    #[must_use]
    pub fn between(from: Vec3, to: Vec3) -> Self {
        let w = 1.0 + from.dot(to);
        if w < 1e-6 {
            return Self { v: any_orthogonal(from), w: 0.0 };
        }
        Self { v: from.cross(to), w }.normalized()
    }

    /// The rotation that brings the world's axes to the orthonormal right-handed `x`, `y`, `z`.
    #[must_use]
    pub fn from_axes(x: Vec3, y: Vec3, z: Vec3) -> Self {
        // Shepperd's method: divide by the largest component only.
        let trace = x.x + y.y + z.z;
        let (v, w) = if trace > 0.0 {
            let s = (trace + 1.0).sqrt() * 2.0;
            (Vec3::new(y.z - z.y, z.x - x.z, x.y - y.x) / s, 0.25 * s)
        } else if x.x > y.y && x.x > z.z {
            let s = (1.0 + x.x - y.y - z.z).sqrt() * 2.0;
            (Vec3::new(0.25 * s, (y.x + x.y) / s, (z.x + x.z) / s), (y.z - z.y) / s)
        } else if y.y > z.z {
            let s = (1.0 + y.y - x.x - z.z).sqrt() * 2.0;
            (Vec3::new((y.x + x.y) / s, 0.25 * s, (z.y + y.z) / s), (z.x - x.z) / s)
        } else {
            let s = (1.0 + z.z - x.x - y.y).sqrt() * 2.0;
            (Vec3::new((z.x + x.z) / s, (z.y + y.z) / s, 0.25 * s), (x.y - y.x) / s)
        };
        Self { v, w }.normalized()
    }

    /// `v` turned by this rotation.
    #[must_use]
    pub fn rotate(self, v: Vec3) -> Vec3 {
        let t = self.v.cross(v) * 2.0;
        v + t * self.w + self.v.cross(t)
    }

    /// First `first`, then this rotation.
    #[must_use]
    pub fn after(self, first: Self) -> Self {
        Self {
            v: first.v * self.w + self.v * first.w + self.v.cross(first.v),
            w: self.w * first.w - self.v.dot(first.v),
        }
        .normalized()
    }

    /// The opposite rotation.
    #[must_use]
    pub fn inverse(self) -> Self {
        Self { v: -self.v, w: self.w }
    }

    /// Spherical interpolation along the shorter arc: `self` at 0, `other` at 1.
    #[must_use]
    pub fn slerp(self, other: Self, t: f32) -> Self {
        let dot = self.v.dot(other.v) + self.w * other.w;
        let (other, dot) = if dot < 0.0 { (Self { v: -other.v, w: -other.w }, -dot) } else { (other, dot) };
        if dot > 0.9995 {
            return Self { v: self.v.lerp(other.v, t), w: self.w + (other.w - self.w) * t }.normalized();
        }
        let theta = math::acos(dot);
        let scale = 1.0 / math::sin(theta);
        let (a, b) = (math::sin((1.0 - t) * theta) * scale, math::sin(t * theta) * scale);
        Self { v: self.v * a + other.v * b, w: self.w * a + other.w * b }.normalized()
    }

    fn normalized(self) -> Self {
        let length = (self.v.length_squared() + self.w * self.w).sqrt();
        if length > 0.0 { Self { v: self.v / length, w: self.w / length } } else { Self::IDENTITY }
    }
}

/// A unit vector at right angles to `v`.
fn any_orthogonal(v: Vec3) -> Vec3 {
    let other = if v.x.abs() < 0.6 { Vec3::X } else { Vec3::Z };
    v.cross(other).normalize_or(Vec3::X)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn rotation_between_brings_one_to_the_other() {
        for i in 0..200 {
            let (a, b) = (Seed::new(1).at(i).direction(), Seed::new(2).at(i).direction());
            assert!((Rotation::between(a, b).rotate(a) - b).length() < 1e-5);
        }
        assert!((Rotation::between(Vec3::X, -Vec3::X).rotate(Vec3::X) + Vec3::X).length() < 1e-6);
    }

    #[test]
    fn axes_and_back() {
        for i in 0..200 {
            let frame = Frame::along(Seed::new(5).at(i).direction());
            let rotation = frame.rotation();
            assert!((rotation.rotate(Vec3::X) - frame.x).length() < 1e-5);
            assert!((rotation.rotate(Vec3::Y) - frame.y).length() < 1e-5);
            assert!((rotation.rotate(Vec3::Z) - frame.z).length() < 1e-5);
        }
    }

    #[test]
    fn slerp_ends_at_its_ends_and_halves_the_angle() {
        let (a, b) = (Rotation::IDENTITY, Rotation::about(Vec3::Z, 2.0));
        assert!((a.slerp(b, 1.0).rotate(Vec3::X) - b.rotate(Vec3::X)).length() < 1e-5);
        let half = a.slerp(b, 0.5).rotate(Vec3::X);
        assert!((half - Rotation::about(Vec3::Z, 1.0).rotate(Vec3::X)).length() < 1e-5);
    }

    #[test]
    fn a_run_of_turns_is_that_of_transports() {
        for i in 0..100 {
            let seed = Seed::new(4).at(i);
            let mut transported = Frame::WORLD;
            let run: [Frame; 17] = std::array::from_fn(|k| {
                // Steps of any angle, half turns nearly among them.
                let aside = seed.at(k as u64).direction() * if i % 2 == 0 { 0.3 } else { 2.0 };
                transported = transported.transported((transported.y + aside).normalize_or(-transported.y));
                transported
            });
            let turned = Frame::along_all(Frame::WORLD, &run.map(|frame| frame.y));
            let mut one = Frame::WORLD;
            for (turned, transported) in turned.iter().zip(&run) {
                one = one.turned(transported.y);
                assert!(one.x.distance(turned.x) < 1e-4 && one.z.distance(turned.z) < 1e-4);
                assert!(turned.x.distance(transported.x) < 1e-4 && turned.z.distance(transported.z) < 1e-4);
                assert!(turned.x.dot(turned.y).abs() < 1e-4 && (turned.x.length() - 1.0).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn transport_keeps_a_frame_orthonormal() {
        let mut frame = Frame::WORLD;
        for i in 0..1000 {
            frame = frame.transported(Seed::new(9).at(i).direction());
        }
        assert!(frame.x.dot(frame.y).abs() < 1e-5 && (frame.x.length() - 1.0).abs() < 1e-5);
        assert!((frame.x.cross(frame.y) - frame.z).length() < 1e-5);
    }
}
