//! Views of a crown as planes: from a direction, or round the trunk.

use glam::{Vec2, Vec3};

use crate::base::math;

/// A plane in which a crown is seen: `x` to the right, `y` up, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ViewPlane {
    /// From a level direction: `right` is a horizontal unit vector.
    From {
        /// To the right in the picture.
        right: Vec3,
    },
    /// Round the vertical through `axis`: `x` is the distance from it.
    Round {
        /// A point of the axis.
        axis: Vec3,
    },
}

impl ViewPlane {
    /// As seen from an azimuth in radians; 0 looks from +z, so that +x is to the right.
    pub(super) fn from_azimuth(azimuth: f32) -> Self {
        let (sin, cos) = math::sin_cos(azimuth);
        Self::From { right: Vec3::new(cos, 0.0, -sin) }
    }

    /// Where a point is seen.
    pub(super) fn seen(&self, p: Vec3) -> Vec2 {
        match self {
            Self::From { right } => Vec2::new(right.dot(p), p.y),
            Self::Round { axis } => {
                let out = p - *axis;
                Vec2::new((out.x * out.x + out.z * out.z).sqrt(), p.y)
            }
        }
    }

    /// How far towards the eye a point lies, metres: along the view's own direction, nothing where the view goes all round.
    pub(super) fn depth(&self, p: Vec3) -> f32 {
        match self {
            Self::From { right } => right.cross(Vec3::Y).dot(p),
            Self::Round { .. } => 0.0,
        }
    }

    /// How a point moves in space that is seen to move by `shift`.
    pub(super) fn lifted(&self, p: Vec3, shift: Vec2) -> Vec3 {
        match self {
            Self::From { right } => *right * shift.x + Vec3::Y * shift.y,
            Self::Round { axis } => {
                let out = (p - *axis) * Vec3::new(1.0, 0.0, 1.0);
                let outwards = out.try_normalize().unwrap_or(Vec3::ZERO);
                // Never through the axis.
                outwards * shift.x.max(-out.length()) + Vec3::Y * shift.y
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn what_is_lifted_is_seen_to_move_so() {
        let planes = [
            ViewPlane::from_azimuth(0.0),
            ViewPlane::from_azimuth(1.0),
            ViewPlane::Round { axis: Vec3::new(0.3, 0.0, 0.1) },
        ];
        for plane in planes {
            for i in 0..50 {
                let p = Seed::new(5).at(i).direction() * 3.0;
                let shift = Vec2::new(0.2, -0.1);
                let seen = plane.seen(p + plane.lifted(p, shift));
                assert!(seen.distance(plane.seen(p) + shift) < 1e-5, "{plane:?}");
            }
        }
    }
}
