//! Views of a crown as planes: from a direction, or round the trunk (2018, 5.1: "from a certain viewpoint").
//!
//! Views are orthographic. A level one shows an elevation, one that looks straight down a plan. In a raised view, height and
//! depth are seen in one, so what is drawn low may be meant to lie near: what would come below the ground is brought
//! along the line of sight up to it ([`ViewPlane::grounded`]), where it is seen at the same place.

use glam::{Vec2, Vec3};

use crate::base::math;

/// Farthest along the line of sight that a point is brought, over how far it would be below the ground.
const SLANT: f32 = 3.0;

/// A plane in which a crown is seen: `x` to the right, `y` up, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ViewPlane {
    /// From a direction, the third of a right-handed frame of unit vectors.
    From {
        /// To the right in the picture; horizontal.
        right: Vec3,
        /// Up in the picture; upright in a level view.
        up: Vec3,
    },
    /// Round the vertical through `axis`: `x` is the distance from it.
    Round {
        /// A point of the axis.
        axis: Vec3,
    },
}

impl ViewPlane {
    /// As seen from an azimuth and an elevation in radians: azimuth 0 looks from +z, so that +x is to the right; elevation
    /// 0 is level, a quarter turn looks straight down, with the front below in the picture.
    pub(super) fn of(azimuth: f32, elevation: f32) -> Self {
        let (sin, cos) = math::sin_cos(azimuth);
        let (steep, level) = math::sin_cos(elevation);
        let up = if elevation == 0.0 { Vec3::Y } else { Vec3::new(-sin * steep, level, -cos * steep) };
        Self::From { right: Vec3::new(cos, 0.0, -sin), up }
    }

    /// Sine of the elevation, -1..=1: 0 for level views.
    pub(super) fn steepness(&self) -> f32 {
        match self {
            Self::From { right, up } => right.cross(*up).y,
            Self::Round { .. } => 0.0,
        }
    }

    /// Where a point is seen.
    pub(super) fn seen(&self, p: Vec3) -> Vec2 {
        match self {
            Self::From { right, up } => Vec2::new(right.dot(p), up.dot(p)),
            Self::Round { axis } => {
                let out = p - *axis;
                Vec2::new((out.x * out.x + out.z * out.z).sqrt(), p.y)
            }
        }
    }

    /// How far towards the eye a point lies, metres: along the view's own direction, nothing where the view goes all round.
    pub(super) fn depth(&self, p: Vec3) -> f32 {
        match self {
            Self::From { right, up } => right.cross(*up).dot(p),
            Self::Round { .. } => 0.0,
        }
    }

    /// How a point moves in space that is seen to move by `shift`.
    pub(super) fn lifted(&self, p: Vec3, shift: Vec2) -> Vec3 {
        match self {
            Self::From { right, up } => *right * shift.x + *up * shift.y,
            Self::Round { axis } => {
                let out = (p - *axis) * Vec3::new(1.0, 0.0, 1.0);
                let outwards = out.try_normalize().unwrap_or(Vec3::ZERO);
                // Never through the axis.
                outwards * shift.x.max(-out.length()) + Vec3::Y * shift.y
            }
        }
    }

    /// The way of a point that does not lead below a height, or below the point's own where that is lower. In a raised view
    /// it goes on along the line of sight, as far as [`SLANT`] allows, and then straight up. Level views leave
    /// every way as it is: there, what is drawn below the ground is meant to hang there.
    pub(super) fn grounded(&self, p: Vec3, way: Vec3, floor: f32) -> Vec3 {
        let steepness = self.steepness();
        let Self::From { right, up } = self else { return way };
        let sunk = floor.min(p.y) - (p.y + way.y);
        if steepness == 0.0 || sunk <= 0.0 {
            return way;
        }
        let along = right.cross(*up) * (sunk / steepness).clamp(-SLANT * sunk, SLANT * sunk);
        way + along + Vec3::Y * (sunk - along.y).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn what_is_lifted_is_seen_to_move_so() {
        let planes = [
            ViewPlane::of(0.0, 0.0),
            ViewPlane::of(1.0, 0.0),
            ViewPlane::of(0.4, 0.7),
            ViewPlane::of(2.0, -std::f32::consts::FRAC_PI_2),
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

    #[test]
    fn a_plan_has_the_front_below_and_level_views_are_upright_to_the_bit() {
        let plan = ViewPlane::of(0.0, std::f32::consts::FRAC_PI_2);
        assert!(plan.seen(Vec3::new(1.0, 5.0, 2.0)).distance(Vec2::new(1.0, -2.0)) < 1e-5);
        // From +x, half up: what is high is up, what is near, at +x, is down, and +z is to the left.
        let half = ViewPlane::of(std::f32::consts::FRAC_PI_2, std::f32::consts::FRAC_PI_4);
        let root = std::f32::consts::FRAC_1_SQRT_2;
        assert!(half.seen(Vec3::new(1.0, 3.0, 2.0)).distance(Vec2::new(-2.0, 2.0 * root)) < 1e-5);
        for i in 0..50 {
            let p = Seed::new(6).at(i).direction() * 3.0;
            let level = ViewPlane::of(0.1 * i as f32, 0.0);
            assert_eq!((level.seen(p).y, level.lifted(p, Vec2::Y).y, level.steepness()), (p.y, 1.0, 0.0));
        }
    }

    #[test]
    fn what_would_come_below_the_ground_stays_on_it_where_it_is_seen() {
        let sunk = (Vec3::new(0.5, 2.0, 1.0), Vec3::new(0.2, -2.5, 0.3));
        for elevation in [0.5_f32, 1.0, std::f32::consts::FRAC_PI_2, -0.8] {
            let plane = ViewPlane::of(0.3, elevation);
            let way = plane.grounded(sunk.0, sunk.1, 0.25);
            assert!((sunk.0.y + way.y - 0.25).abs() < 1e-5, "{elevation}");
            assert!(plane.seen(sunk.0 + way).distance(plane.seen(sunk.0 + sunk.1)) < 1e-5, "{elevation}");
            // What is above it goes its way, and what was below is not lifted.
            assert_eq!(plane.grounded(sunk.0, Vec3::Y, 0.25), Vec3::Y);
            assert_eq!(plane.grounded(Vec3::NEG_Y, Vec3::X, 0.25), Vec3::X);
        }
        // Nearly level, it is not thrown far away.
        let way = ViewPlane::of(0.0, 0.01).grounded(sunk.0, sunk.1, 0.25);
        assert!((sunk.0.y + way.y - 0.25).abs() < 1e-5 && (way - sunk.1).length() < 4.0, "{way}");
        assert_eq!(ViewPlane::of(0.3, 0.0).grounded(sunk.0, sunk.1, 0.25), sunk.1);
    }
}
