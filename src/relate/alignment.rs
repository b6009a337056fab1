//! How one branching vector is turned to another (2017 TVCG, 4.3: "a rigid transformation estimated from their
//! branching vectors").
//!
//! Two vectors leave the twist about them open, and it shows: branches arch up or hang down, and on opposite sides of a
//! trunk the least rotation from one to the other leads over the top, so that on the way a branch lies along the trunk,
//! and arches are blended with each other's mirror images. So the turn is made of one about the parent's axis, by the
//! difference of the azimuths, and the least rotation for what remains, the difference of the inclinations. A branch then
//! sweeps round its parent, and what bends outwards meets what bends outwards. Near the axis azimuths mean nothing: there
//! the first part fades out.

use glam::Vec3;

use crate::base::{Rotation, math};

/// Sines of the inclination between which the turn about the parent's axis fades in: 9 and 27 degrees.
const FADE: (f32, f32) = (0.15, 0.45);

/// The rotation that brings the unit vector `from` to the unit vector `to`, both in a frame whose `y` is the axis of the
/// parent.
pub(super) fn alignment(from: Vec3, to: Vec3) -> Rotation {
    let slant = |v: Vec3| (v.x * v.x + v.z * v.z).sqrt();
    let share = math::smoothstep(FADE.0, FADE.1, slant(from).min(slant(to)));
    // The angle between the horizontal parts, from `from` to `to`, right-handed about y.
    let azimuth = math::atan2(from.z * to.x - from.x * to.z, from.x * to.x + from.z * to.z);
    let round = Rotation::about(Vec3::Y, azimuth * share);
    Rotation::between(round.rotate(from), to).after(round)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn any_vector_is_brought_to_any_other() {
        for i in 0..500 {
            let (a, b) = (Seed::new(1).at(i).direction(), Seed::new(2).at(i).direction());
            assert!((alignment(a, b).rotate(a) - b).length() < 1e-5);
            // The axis of nearly half a turn comes from a cross product that has lost half its digits.
            assert!((alignment(a, -a).rotate(a) + a).length() < 1e-2);
        }
        assert!((alignment(Vec3::Y, -Vec3::Y).rotate(Vec3::Y) + Vec3::Y).length() < 1e-5);
        assert!((alignment(Vec3::Y, Vec3::X).rotate(Vec3::Y) - Vec3::X).length() < 1e-5);
    }

    #[test]
    fn branches_on_opposite_sides_sweep_round_their_parent_with_their_arch() {
        let branch = |azimuth: f32| Rotation::about(Vec3::Y, azimuth).rotate(Vec3::new(0.8, 0.6, 0.0));
        let turn = alignment(branch(0.0), branch(3.0));
        // Half way it is as steep as at both ends.
        let half = Rotation::IDENTITY.slerp(turn, 0.5).rotate(branch(0.0));
        assert!((half - branch(1.5)).length() < 1e-5, "{half}");
        // What points up from the one points up from the other.
        let up = turn.rotate(Vec3::new(-0.6, 0.8, 0.0));
        assert!((up.y - 0.8).abs() < 1e-5, "{up}");
    }

    #[test]
    fn along_the_axis_the_least_rotation_is_taken() {
        let (a, b) = (Vec3::new(0.05, 1.0, 0.0).normalize(), Vec3::new(-0.05, 1.0, 0.0).normalize());
        assert!((alignment(a, b).rotate(Vec3::Z) - Vec3::Z).length() < 1e-5);
    }
}
