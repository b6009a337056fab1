//! How many sides a tube has.

use crate::base::math;

/// Sides of a tube whose largest radius is `radius`, on a plant whose thickest tube has radius `thickest` and `most`
/// sides: by the square root of the radius, since that is how far from the eye a given flaw is seen on it, and never
/// more than keeps the polygon within `error` of the circle. 3..=`most`.
pub(super) fn sides(radius: f32, thickest: f32, most: u32, error: f32) -> u32 {
    let most = most.clamp(3, 64);
    let share = if thickest > 0.0 { (radius / thickest).clamp(0.0, 1.0).sqrt() } else { 0.0 };
    let by_radius = most as f32 * share;
    // Distance of a chord's middle from the circle: r (1 - cos(π / n)).
    let by_error = if error > 0.0 && radius > error {
        std::f32::consts::PI / math::acos(1.0 - error * 0.5 / radius).max(1e-3)
    } else if error > 0.0 {
        3.0
    } else {
        most as f32
    };
    ((by_radius.min(by_error) + 0.5) as u32).clamp(3, most)
}
