//! How far a surface is from the tubes of its limb: by that, of two limbs of one piece the better is told.
//!
//! The middle of each triangle and those of its sides stand for its area; how far they are from the nearest of the
//! tubes, inside or out, is measured in the piece's own thickness, twice its volume over its area, which of a tube is the
//! radius.

use glam::DVec3;

use super::surface::{Surface, area};
use crate::source::import::limb::Limb;

/// Triangles that are looked at.
const SAMPLE: usize = 1_500;

/// The mean distance of a closed surface from a limb's tubes, in its own thickness; infinite where it has none. Triangles that
/// face the axis are those of an inner skin, and say nothing.
pub(super) fn stray(surface: &Surface, limb: &Limb) -> f64 {
    let middle = surface.positions.iter().sum::<DVec3>() / surface.positions.len().max(1) as f64;
    let at = |v: u32| surface.positions[v as usize] - middle;
    let volume: f64 = surface.triangles.iter().map(|t| at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0).sum();
    let thick = 2.0 * volume.abs() / surface.area();
    let step = surface.triangles.len() / SAMPLE + 1;
    let (mut sum, mut weight) = (0.0, 0.0);
    for t in surface.triangles.iter().step_by(step) {
        let [a, b, c] = t.map(|v| surface.positions[v as usize]);
        let normal = (b - a).cross(c - a) * volume.signum();
        for place in [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0] {
            let nearest = limb.edges.iter().map(|e| outside(limb, *e, place));
            let nearest = nearest.reduce(|a, b| if b.0 < a.0 { b } else { a });
            let Some((far, axis)) = nearest else { return f64::INFINITY };
            if (place - axis).dot(normal) >= 0.0 {
                sum += far.abs() * area(*t, &surface.positions);
                weight += area(*t, &surface.positions);
            }
        }
    }
    let stray = sum / weight / thick;
    if stray.is_nan() { f64::INFINITY } else { stray }
}

/// How far a place is outside of one stretch of a limb, less than zero inside; and the place on its axis.
fn outside(limb: &Limb, [a, b]: [u32; 2], place: DVec3) -> (f64, DVec3) {
    let (a, b) = (limb.nodes[a as usize], limb.nodes[b as usize]);
    let way = b.position - a.position;
    let square = way.length_squared();
    let t = if square > 0.0 { ((place - a.position).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 };
    let axis = a.position + way * t;
    (place.distance(axis) - (a.radius + (b.radius - a.radius) * t), axis)
}

#[cfg(test)]
mod tests {
    use super::super::cap::closed;
    use super::super::shapes;
    use super::*;

    #[test]
    fn a_tube_is_near_its_axis_and_far_from_another() {
        let path: Vec<DVec3> = (0..6).map(|k| DVec3::Y * f64::from(k)).collect();
        let tube = closed(&shapes::tube(&path, &[0.5; 6], 16));
        let of = |shift: DVec3, radius: f64| {
            let ends = [path[0], path[5]].map(|p| (p + shift, radius));
            stray(&tube, &Limb::path(&ends))
        };
        let own = of(DVec3::ZERO, 0.5);
        assert!(own < 0.15, "{own}");
        assert!(of(DVec3::X, 0.5) > 0.6 && of(DVec3::ZERO, 0.1) > 0.6);
        assert_eq!(stray(&tube, &Limb::default()), f64::INFINITY);
    }
}
