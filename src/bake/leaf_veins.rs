//! Veins of a blade and the relief that they give it.
//!
//! Pinnate blades: a midrib and side veins at even phases (`leaf_outline::vein_phase`), so veins end in the lobes and
//! teeth that the outline cuts by the same phase. Palmate blades: five main veins from the petiole, each with its own
//! side veins. Veins lie in grooves on the upper face, the blade bulges between them.

use glam::Vec2;

use super::leaf_outline::{PALMATE_VEINS, pinnate, vein_phase};
use crate::base::math;
use crate::preset::plan::LeafShape;

/// A place on a blade.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relief {
    /// How much of a vein the place shows, 0..=1.
    pub(super) vein: f32,
    /// Height over the blade's plane, in blade lengths.
    pub(super) height: f32,
}

/// The relief at (x, y) in blade space, veins no thinner than `footprint` (a pixel's width in blade lengths; thinner
/// ones fade instead).
pub(super) fn relief(shape: LeafShape, x: f32, y: f32, footprint: f32) -> Relief {
    if shape == LeafShape::Maple { palmate(x, y, footprint) } else { feathered(shape, x, y, footprint) }
}

fn feathered(shape: LeafShape, x: f32, y: f32, footprint: f32) -> Relief {
    let form = pinnate(shape);
    let across = x.abs();
    let taper = (1.0 - 0.75 * y).max(0.2);
    let midrib = line(across, (0.011 * taper).max(form.half_width * 0.02), footprint);
    let phase = vein_phase(form, if x < 0.0 { -1.0 } else { 1.0 }, x, y);
    let off = (phase - phase.floor() - 0.5).abs();
    // Phase to distance: veins are `1 / veins` apart along the midrib, and slanted.
    let slant = 1.0 / (form.veins * (1.0 + form.slope * form.slope).sqrt());
    let reach = (1.0 - across / (form.half_width * 1.05)).clamp(0.0, 1.0);
    // Narrow leaves show little of their side veins.
    let bold = math::smoothstep(0.03, 0.2, form.half_width);
    let side = 0.8 * bold * line(off * slant, 0.0055 * (0.35 + 0.65 * reach), footprint) * reach.min(0.25) * 4.0;
    // Finer veins between, square to the side veins, offset from one field to the next.
    let rungs = form.veins * 2.3;
    let cross = across * rungs + 0.37 * phase.floor();
    let fine = 0.28 * line((cross - cross.floor() - 0.5).abs() / rungs, 0.0022, footprint);
    let groove = (1.0 - across / (0.14 * form.half_width)).max(0.0);
    // The bulge between two veins has its creases on them.
    let height =
        0.24 * bold * slant * (4.0 * off * (1.0 - off)) * reach.min(0.5) - 0.05 * form.half_width * groove * groove;
    Relief { vein: midrib.max(side).max(fine), height }
}

fn palmate(x: f32, y: f32, footprint: f32) -> Relief {
    let p = Vec2::new(x.abs(), y);
    let mut vein = 0.0_f32;
    let mut nearest = f32::MAX;
    let mut bulge = 0.0;
    for (i, end) in [Vec2::new(0.0, 1.0), PALMATE_VEINS[0], PALMATE_VEINS[1]].into_iter().enumerate() {
        let length = end.length();
        let along_axis = end / length;
        let along = p.dot(along_axis);
        let side = along_axis.perp_dot(p);
        let across = side.abs();
        let share = (along / length).clamp(0.0, 1.0);
        let away = if along < 0.0 { p.length() } else { across };
        vein = vein.max(line(away, 0.010 * (1.0 - 0.7 * share), footprint) * if along < length { 1.0 } else { 0.0 });
        // A place belongs to the main vein with the smallest angle to it.
        let angle = if along > 0.0 { across / along.max(1e-4) } else { f32::MAX };
        if angle < nearest {
            nearest = angle;
            let start = along - 0.9 * across;
            let phase = start * 9.0 + if side < 0.0 { 0.45 } else { 0.0 } + i as f32 * 0.3;
            let off = (phase - phase.floor() - 0.5).abs();
            let fade = (1.0 - across / 0.3).clamp(0.0, 1.0);
            vein = vein.max(0.7 * line(off / 12.1, 0.0045 * (0.3 + 0.7 * fade), footprint) * fade);
            let groove = (1.0 - across / 0.045).max(0.0);
            bulge = 0.018 * (4.0 * off * (1.0 - off)) * fade - 0.014 * groove * groove;
        }
    }
    Relief { vein, height: bulge }
}

/// A line of a half width, seen through pixels of `footprint`: 1 on it, 0 beside it.
fn line(distance: f32, half_width: f32, footprint: f32) -> f32 {
    let half = half_width.max(0.6 * footprint);
    let strength = half_width / half;
    (1.0 - (distance / half - 0.4) / 0.9).clamp(0.0, 1.0) * strength
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_midrib_is_a_vein_in_a_groove_on_every_blade() {
        for shape in
            [LeafShape::Oak, LeafShape::Birch, LeafShape::Beech, LeafShape::Willow, LeafShape::Ash, LeafShape::Maple]
        {
            let middle = relief(shape, 0.0, 0.4, 0.001);
            let beside = relief(shape, 0.012, 0.4, 0.001);
            assert!(middle.vein > 0.9, "{shape:?} {middle:?}");
            assert!(beside.height > middle.height, "{shape:?} {middle:?} {beside:?}");
        }
    }

    #[test]
    fn veins_fade_and_do_not_thicken_when_pixels_are_coarse() {
        let sum = |footprint: f32| -> f32 {
            (0..1000).map(|i| relief(LeafShape::Beech, i as f32 * 0.0003, 0.4, footprint).vein).sum()
        };
        let (sharp, coarse) = (sum(0.001), sum(0.02));
        assert!(coarse < sharp * 1.7 && coarse > sharp * 0.4, "{sharp} {coarse}");
    }
}
