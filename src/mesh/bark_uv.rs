//! The scale of bark: as many texels a metre on every branch of a tree, within a fifth, around and along alike.
//!
//! Bark that goes round each branch a whole number of times closes without a seam, but on a twig a twentieth as thick as the
//! trunk it is twenty times as fine, and is no longer the trunk's bark. Tools for trees choose one of the two by hand. Here
//! the scale comes first, and the texture closes wherever that costs less than a fifth:
//!
//! - The scale is the trunk's: the tile nearest to the one that is asked for with which the bark closes there. A trunk whose
//!   girth is below a tile has its whole bark in that girth.
//! - Wood takes a whole number of repeats while that is between [`LEAST`] and [`MOST`] of what its girth asks for. Between
//!   these stretches the number runs from one to the next along the wood, so nothing jumps, and below one repeat it is the
//!   girth itself: there the texture does not close, and a seam runs along the branch, on its upper side, where it is
//!   seen the least from the ground. It is a change of picture, not of shading: normals go on.
//! - A stem's flare goes round as often as the wood above it; it is the one place that is coarser than a fifth allows.
//!
//! Mirrored repeats have no seam at any scale; they were dropped, since a trunk that is its own mirror image is seen from
//! afar, a seam from near by. Changing the number at a ring of vertices shows as a ring all round the branch.

use crate::plant::{Plant, Posed};

/// The fewest and most repeats round wood, as shares of what its girth asks for, with which a whole number is taken.
const LEAST: f32 = 1.0 / 1.2;
const MOST: f32 = 1.0 / 0.86;
/// Nor is a whole number taken farther from what the girth asks for than this, so that there is room to get to the next.
const NEAR: f32 = 0.4;
/// Below this share of a tile round wood takes what its girth asks for.
const OPEN: f32 = 0.6;
/// The girth of the trunk in tiles over its whole number: near the upper end of what that number is taken for, since wood
/// gets thinner from there.
const TRUNK: f32 = 1.1;
/// Where along the thickest stem its girth is taken: above a flare.
pub(super) const ABOVE: f64 = 0.08;

/// The scale of a plant's bark.
#[derive(Clone, Copy, Debug)]
pub(super) struct BarkScale {
    /// Metres.
    tile: f32,
}

impl BarkScale {
    /// The scale at which bark closes round the thickest stem, with tiles about as large as asked for, metres.
    pub(super) fn of(plant: &Plant, posed: &Posed, tile: f32) -> Self {
        let tile = tile.max(1e-3);
        let stem = |id: &crate::plant::ChainId| plant.chain(*id).parent.is_none();
        let radius = |id| posed.curve(plant, id).value(plant.radii(id), ABOVE).min(plant.radii(id)[0].max(1e-6));
        let thickest = plant.chain_ids().filter(stem).map(radius).fold(0.0_f32, f32::max);
        let girth = std::f32::consts::TAU * thickest;
        if !(girth > 1e-5 && girth.is_finite()) {
            return Self { tile };
        }
        Self { tile: girth / (TRUNK * (girth / (TRUNK * tile)).round().max(1.0)) }
    }

    /// How often bark goes round wood of some girth, metres.
    pub(super) fn around(self, girth: f32) -> f32 {
        let asked = girth / self.tile;
        let from = |n: f32| (n * MOST.recip()).max(n - NEAR);
        let to = |n: f32| (n * LEAST.recip()).min(n + NEAR);
        // The whole number whose stretch the girth is in or before, and the one before.
        let below = asked.floor();
        let n = if asked <= to(below) { below } else { below + 1.0 };
        let (x0, y0) = if n <= 1.0 { (OPEN, OPEN) } else { (to(n - 1.0), n - 1.0) };
        if asked >= from(n) {
            n
        } else if asked <= x0 {
            asked.max(0.0)
        } else {
            y0 + (n - y0) * (asked - x0) / (from(n) - x0)
        }
    }

    /// Repeats a metre round wood of some girth; those along it are as many.
    pub(super) fn density(self, girth: f32) -> f32 {
        if girth > 0.0 { self.around(girth) / girth } else { 1.0 / self.tile }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn repeats_keep_within_a_fifth_never_jump_and_are_whole_where_they_can() {
        let scale = BarkScale { tile: 1.0 };
        let (mut whole, mut before) = (0, 0.0);
        for step in 1..=6000 {
            let girth = step as f32 * 0.001;
            let around = scale.around(girth);
            let off = around / girth;
            assert!((1.0 / 1.2 - 1e-3..=1.0 / 0.86 + 1e-3).contains(&off), "{girth} {around}");
            assert!(around >= before - 1e-5 && around - before < 0.02, "{girth} {around}");
            whole += usize::from(girth > 0.86 && around.fract() == 0.0);
            before = around;
        }
        assert!(whole > 3500, "{whole}");
    }

    #[test]
    fn the_trunk_closes_whatever_its_girth() {
        for radius in [0.004_f32, 0.05, 0.21, 0.3, 0.77, 2.0] {
            let mut builder = PlantBuilder::new();
            builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 9.0], &[radius, radius]);
            let plant = builder.finish().unwrap();
            let scale = BarkScale::of(&plant, &plant.pose(), 1.5);
            let around = scale.around(std::f32::consts::TAU * radius);
            assert!(around >= 1.0 && around.fract() == 0.0, "{radius} {around}");
            assert!(scale.tile < 1.5 * 1.4, "{radius} {}", scale.tile);
        }
    }
}
