//! How many sides a tube has, and how far out they lie.

use std::sync::LazyLock;

use super::TubeDetail;
use crate::base::math;

/// Sides of a tube whose largest radius is `radius`, on a plant whose thickest tube has radius `thickest`, metres: by the
/// square root of the radius, since that is how far from the eye a given flaw is seen on it, but no more than keep the
/// polygon within the detail's error of the circle; and as many as keep it within `error`, which is the tube's own, as far as the
/// detail lets it have them. 3..=64.
pub(super) fn sides(radius: f32, thickest: f32, detail: &TubeDetail, error: f32) -> u32 {
    let usual = detail.sides.clamp(3, 64);
    let most = detail.most_sides.clamp(usual, 64);
    let share = if thickest > 0.0 { (radius / thickest).clamp(0.0, 1.0).sqrt() } else { 0.0 };
    let by_radius = usual as f32 * share;
    // Distance of a chord's middle from the circle: r (1 - cos(π / n)).
    let by_error = || {
        if detail.error > 0.0 && radius > detail.error {
            std::f32::consts::PI / math::acos(1.0 - detail.error * 0.5 / radius).max(1e-3)
        } else if detail.error > 0.0 {
            3.0
        } else {
            usual as f32
        }
    };
    // A polygon as wide as the circle in the mean of all views strays by r π² / 3n² at the middles of its sides.
    let needed = if error > 0.0 { std::f32::consts::PI * (radius / (3.0 * error)).sqrt() } else { 0.0 };
    // Of twigs, which are most, the other is not asked.
    let usually = if by_radius < 3.5 { 3 } else { ((by_radius.min(by_error()) + 0.5) as u32).clamp(3, usual) };
    usually.max((needed.ceil() as u32).min(most))
}

/// By sides, how far out corners and the middles of sides stand; fewer than three count as three.
static OUT: LazyLock<[(f32, f32); 65]> = LazyLock::new(|| {
    std::array::from_fn(|sides| {
        let half = std::f32::consts::PI / sides.max(3) as f32;
        let (sin, cos) = math::sin_cos(half);
        (half / sin, half / sin * cos)
    })
});

/// How much farther out corners stand than the circle, so that a prism of up to 64 sides is as wide in the mean of all views as what is
/// round: with corners on the circle one of three sides would cover 17 % too little, and twigs of coarse levels would fade.
/// [`sides`] counts on it.
pub(super) fn out_of_corners(sides: u32) -> f32 {
    OUT[sides.min(64) as usize].0
}

/// How far out the middles of the sides are then, as a share of the radius.
pub(super) fn out_of_middles(sides: u32) -> f32 {
    OUT[sides.min(64) as usize].1
}
