//! Guiding vectors set directly by a field (2015, 3.2.1 and Fig. 8): weighted sums of primitives, each with a region in
//! which it counts, as Wejchert and Haumann composed flows ("Animation aerodynamics", 1991).
//!
//! A field is evaluated at nodes only, as the paper says of its vectors. Primitives are unit vectors wherever they are
//! anything: strength is the weight's part, and the paper's weights compare directions. Where primitives vanish (on their
//! axis or centre) or cancel each other there is no direction; a node there keeps the vector of the one before it, since
//! paths bridge singularities anyway.

use glam::Vec3;

use crate::base::math;
use crate::preset::plan::{FieldAxis, FieldPart, FieldPrimitive, FieldRegion};

/// Shorter sums have no direction.
const VANISHED: f32 = 1e-4;

/// The field's unit vector at a point; none where it vanishes. Lengths in plant heights.
pub(super) fn vector(parts: &[FieldPart], at: Vec3) -> Option<Vec3> {
    let sum: Vec3 =
        parts.iter().map(|part| primitive(part.primitive, at) * (part.weight * share(part.region, at))).sum();
    let length = sum.length();
    (length > VANISHED).then(|| sum / length)
}

/// A unit vector, or zero.
fn primitive(primitive: FieldPrimitive, at: Vec3) -> Vec3 {
    let flat = Vec3::new(at.x, 0.0, at.z).normalize_or_zero();
    let from = |height: f32| at - Vec3::Y * height;
    match primitive {
        FieldPrimitive::Uniform { lean, turn } => {
            let ((out, up), (z, x)) = (math::sin_cos(lean), math::sin_cos(turn));
            Vec3::new(out * x, up, out * z)
        }
        FieldPrimitive::Helical { rise } => {
            let (up, round) = math::sin_cos(rise);
            // On the axis it goes straight up or down.
            if flat == Vec3::ZERO { Vec3::Y * up.signum() } else { flat.cross(Vec3::Y) * -round + Vec3::Y * up }
        }
        FieldPrimitive::Rotational { axis, height } => {
            let axis = match axis {
                FieldAxis::X => Vec3::X,
                FieldAxis::Y => Vec3::Y,
                FieldAxis::Z => Vec3::Z,
            };
            axis.cross(from(height)).normalize_or_zero()
        }
        FieldPrimitive::Spherical { height } => {
            let out = from(height).normalize_or_zero();
            (Vec3::Y - out * out.y).normalize_or_zero()
        }
        FieldPrimitive::Radial { height } => from(height).normalize_or_zero(),
        FieldPrimitive::Outward => flat,
    }
}

/// How much a region lets through at a point, 0..=1.
fn share(region: FieldRegion, at: Vec3) -> f32 {
    let (beyond, soft) = match region {
        FieldRegion::Everywhere => return 1.0,
        FieldRegion::Layer { bottom, top, soft } => ((bottom - at.y).max(at.y - top), soft),
        FieldRegion::Ball { height, radius, soft } => ((at - Vec3::Y * height).length() - radius, soft),
        FieldRegion::Core { radius, soft } => (Vec3::new(at.x, 0.0, at.z).length() - radius, soft),
    };
    if beyond <= 0.0 {
        1.0
    } else if beyond >= soft {
        0.0
    } else {
        1.0 - math::smoothstep(0.0, soft, beyond)
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;

    fn part(primitive: FieldPrimitive, weight: f32) -> FieldPart {
        FieldPart { primitive, weight, region: FieldRegion::Everywhere }
    }

    fn at(primitive: FieldPrimitive, p: [f32; 3]) -> Vec3 {
        vector(&[part(primitive, 1.0)], Vec3::from_array(p)).unwrap_or(Vec3::ZERO)
    }

    fn close(a: Vec3, b: Vec3) -> bool {
        (a - b).length() < 1e-5
    }

    #[test]
    fn a_helix_goes_round_and_up_at_its_angle() {
        let helix = FieldPrimitive::Helical { rise: FRAC_PI_4 };
        let s = 0.5_f32.sqrt();
        assert!(close(at(helix, [0.3, 0.5, 0.0]), Vec3::new(0.0, s, -s)), "{}", at(helix, [0.3, 0.5, 0.0]));
        assert!(close(at(helix, [0.0, 0.1, 0.2]), Vec3::new(s, s, 0.0)));
        assert!(close(at(helix, [0.0, 0.5, 0.0]), Vec3::Y));
        // Streamlines stay at their distance: the vector has no part along the radius.
        assert!(at(helix, [0.3, 0.5, 0.4]).dot(Vec3::new(0.3, 0.0, 0.4)).abs() < 1e-6);
    }

    #[test]
    fn a_rotation_circles_its_axis() {
        let about_z = FieldPrimitive::Rotational { axis: FieldAxis::Z, height: 0.5 };
        assert!(close(at(about_z, [0.2, 0.5, 0.9]), Vec3::Y));
        assert!(close(at(about_z, [0.0, 0.9, 0.0]), Vec3::NEG_X));
        assert!(close(at(FieldPrimitive::Rotational { axis: FieldAxis::X, height: 0.5 }, [0.0, 0.9, 0.0]), Vec3::Z));
        assert!(close(
            at(FieldPrimitive::Rotational { axis: FieldAxis::Y, height: 0.0 }, [1.0, 0.3, 0.0]),
            Vec3::NEG_Z
        ));
        assert_eq!(at(about_z, [0.0, 0.5, 0.7]), Vec3::ZERO);
    }

    #[test]
    fn spheres_are_climbed_upwards_along_their_surface() {
        let spheres = FieldPrimitive::Spherical { height: 0.5 };
        assert!(close(at(spheres, [0.3, 0.5, 0.0]), Vec3::Y));
        for p in [[0.2, 0.3, 0.1], [-0.1, 0.9, 0.3], [0.4, 0.5, -0.2]] {
            let v = at(spheres, p);
            let out = Vec3::from_array(p) - Vec3::Y * 0.5;
            assert!(v.dot(out).abs() < 1e-6 && v.y > 0.0 && (v.length() - 1.0).abs() < 1e-6);
        }
        assert_eq!(at(spheres, [0.0, 1.0, 0.0]), Vec3::ZERO);
    }

    #[test]
    fn uniform_radial_and_outward_point_where_they_say() {
        let leaning = FieldPrimitive::Uniform { lean: FRAC_PI_2, turn: FRAC_PI_2 };
        assert!(close(at(leaning, [0.0; 3]), Vec3::Z));
        assert!(close(
            at(FieldPrimitive::Radial { height: 0.5 }, [0.0, 0.0, 0.5]),
            Vec3::new(0.0, -1.0, 1.0).normalize()
        ));
        assert!(close(at(FieldPrimitive::Outward, [3.0, 9.0, 4.0]), Vec3::new(0.6, 0.0, 0.8)));
    }

    #[test]
    fn parts_add_by_weight_and_cancel_to_nothing() {
        let (up, out) = (FieldPrimitive::Uniform { lean: 0.0, turn: 0.0 }, FieldPrimitive::Outward);
        let p = Vec3::new(0.5, 0.2, 0.0);
        let sum = vector(&[part(up, 3.0), part(out, 4.0)], p).unwrap();
        assert!(close(sum, Vec3::new(0.8, 0.6, 0.0)));
        assert!(close(vector(&[part(out, -2.0)], p).unwrap(), Vec3::NEG_X));
        assert_eq!(vector(&[part(up, 1.0), part(up, -1.0)], p), None);
        assert_eq!(vector(&[], p), None);
    }

    #[test]
    fn regions_are_whole_inside_and_fade_over_their_soft_rim() {
        let layer = FieldRegion::Layer { bottom: 0.4, top: 0.6, soft: 0.2 };
        let ball = FieldRegion::Ball { height: 0.5, radius: 0.1, soft: 0.2 };
        let core = FieldRegion::Core { radius: 0.1, soft: 0.0 };
        let up = |y| Vec3::Y * y;
        assert_eq!([share(layer, up(0.4)), share(layer, up(0.6)), share(layer, up(0.85))], [1.0, 1.0, 0.0]);
        assert!((share(layer, up(0.7)) - 0.5).abs() < 1e-5 && (share(layer, up(0.3)) - 0.5).abs() < 1e-5);
        assert!((share(ball, Vec3::new(0.2, 0.5, 0.0)) - 0.5).abs() < 1e-5);
        assert_eq!(share(ball, up(0.55)), 1.0);
        assert_eq!([share(core, Vec3::X * 0.09), share(core, Vec3::X * 0.11)], [1.0, 0.0]);
        assert_eq!(share(FieldRegion::Everywhere, Vec3::MAX), 1.0);
    }
}
