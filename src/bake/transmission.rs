//! How much light leaves let through: the blue of their ORM map, where other materials keep metalness.
//!
//! It is the share of the light scattered by a leaf that leaves it on the far side: what falls on its back, times its
//! colour, times this, is seen from the front (glTF's `diffuseTransmissionFactor`). Thin summer leaves scatter about as much
//! forward as back; leathery ones and needles keep most. Veins, stalks and wood are thick, and what lies behind a blade takes
//! some of its light: less than it would keep alone, since light comes from more than one side and sprays are not flat. (As a
//! product of what all blades let through, sprays were black but for their rims: oaks let 0.25 through in the mean, olives 0.05; now
//! it is 0.31 and 0.10.)
//!
//! Limits: tables, not spectra; what is let through has the colour of the face. Of a picture that tells nothing about it
//! each place lets [`USUAL`] through: a dark twig in it is told from a leaf by its colour, which multiplies it.

use super::spray::Tissue;
use super::{Maps, Palette};
use crate::preset::plan::LeafShape;

/// Of leaves that nothing is known of, of 255.
pub(super) const USUAL: u8 = 102;

/// Of a blade between its veins, half-way to its margin; of a needle.
const fn tissue(shape: LeafShape) -> f32 {
    match shape {
        LeafShape::Beech | LeafShape::Birch | LeafShape::Linden => 0.5,
        LeafShape::Maple => 0.47,
        LeafShape::Ash => 0.44,
        LeafShape::Elm | LeafShape::Poplar | LeafShape::Willow => 0.42,
        LeafShape::Oak => 0.4,
        LeafShape::Palm => 0.22,
        LeafShape::Olive => 0.16,
        LeafShape::Pine | LeafShape::Spruce | LeafShape::Cypress => 0.06,
    }
}

/// Of a place of a blade: `vein` 0..=1 as much of one as it shows, `outward` 0 on the midrib and 1 on the margin.
pub(super) fn of_blade(shape: LeafShape, vein: f32, outward: f32) -> f32 {
    tissue(shape) * (0.92 + 0.16 * outward.clamp(0.0, 1.0)) * (1.0 - 0.8 * vein.clamp(0.0, 1.0))
}

/// Of a part of a spray, as a whole: of blades without their veins.
pub(super) const fn of_part(shape: LeafShape, part: Tissue) -> f32 {
    match part {
        Tissue::Blade | Tissue::Underside | Tissue::Needle => tissue(shape),
        Tissue::Petiole => 0.04,
        Tissue::Wood => 0.0,
    }
}

/// What of the light from behind a part leaves to those in front of it.
pub(super) const fn behind(part: Tissue) -> f32 {
    match part {
        Tissue::Blade | Tissue::Underside => 0.6,
        Tissue::Petiole | Tissue::Needle => 0.85,
        Tissue::Wood => 0.3,
    }
}

/// The same of all parts behind, whose shares were multiplied.
pub(super) const fn shaded(left: f32) -> f32 {
    0.35 + 0.65 * left
}

/// What leaf pictures let through, of 255: the mean of all that they show.
#[must_use]
pub fn mean_transmission(pictures: &[Maps]) -> u8 {
    let (mut through, mut shown) = (0_u64, 0_u64);
    for maps in pictures {
        for (color, orm) in maps.color.iter().zip(&maps.orm) {
            through += u64::from(color[3]) * u64::from(orm[2]);
            shown += u64::from(color[3]);
        }
    }
    (through + shown / 2).checked_div(shown).map_or(0, |mean| mean.min(255) as u8)
}

/// What a picture lets through at each texel of a [`Palette`], of 255, averaged by alpha.
pub(super) fn reduced(maps: &Maps) -> Vec<u8> {
    let (width, height, edge) = (maps.width as usize, maps.height as usize, Palette::EDGE as usize);
    let is_whole = width * height > 0 && maps.color.len() >= width * height && maps.orm.len() >= width * height;
    if !is_whole {
        return vec![0; edge * edge];
    }
    let mut means = Vec::with_capacity(edge * edge);
    for y in 0..edge {
        for x in 0..edge {
            let (mut sum, mut weight) = (0_u64, 0_u64);
            for row in Palette::span(y, height) {
                let texels = row * width..(row + 1) * width;
                let (colors, orms) = (&maps.color[texels.clone()], &maps.orm[texels]);
                for i in Palette::span(x, width) {
                    // The small share keeps a wholly clear place at what goes on under it.
                    let own = u64::from(colors[i][3]) * 4 + 1;
                    sum += own * u64::from(orms[i][2]);
                    weight += own;
                }
            }
            means.push(((sum + weight / 2) / weight.max(1)) as u8);
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::leaf_maps;
    use crate::base::Seed;

    fn picture(shape: LeafShape) -> Maps {
        leaf_maps(shape, [0.06, 0.11, 0.02], 0.3, 256, 0, Seed::new(3))
    }

    #[test]
    fn veins_let_less_through_than_the_blade_beside_them_and_margins_most() {
        for shape in LeafShape::ALL {
            let [midrib, side, blade, margin] =
                [(1.0, 0.0), (0.5, 0.5), (0.0, 0.5), (0.0, 1.0)].map(|(vein, out)| of_blade(shape, vein, out));
            assert!(midrib < 0.3 * blade && midrib < side && side < blade && blade < margin, "{shape:?}");
            assert!(of_part(shape, Tissue::Wood) == 0.0 && margin <= 1.0);
        }
    }

    #[test]
    fn thin_leaves_let_more_through_than_leathery_ones_and_needles_nearly_nothing() {
        let of = |shape| mean_transmission(&[picture(shape)]);
        let [beech, oak, palm, olive, pine] =
            [LeafShape::Beech, LeafShape::Oak, LeafShape::Palm, LeafShape::Olive, LeafShape::Pine].map(of);
        assert!(beech > oak && oak > palm && palm > olive && olive > pine, "{beech} {oak} {palm} {olive} {pine}");
        assert!((60..115).contains(&oak) && pine < 16, "{oak} {pine}");
        assert_eq!(mean_transmission(&[]), 0);
    }

    #[test]
    fn a_made_picture_shows_the_twig_dark_blades_light_and_blades_over_blades_between() {
        for shape in [LeafShape::Oak, LeafShape::Beech, LeafShape::Elm] {
            let maps = picture(shape);
            let all = || maps.color.iter().zip(&maps.orm).filter(|(color, _)| color[3] == 255);
            let single = of_part(shape, Tissue::Blade) * 255.0;
            let count = |from: f32, to: f32| {
                all().filter(|(_, orm)| (from * single..to * single).contains(&f32::from(orm[2]))).count()
            };
            // Wood, then what lies behind another blade or is a vein, then a single blade.
            let (dark, double, light) = (count(0.0, 0.02), count(0.3, 0.8), count(0.85, 1.1));
            assert!(dark > 50 && double > 500 && light > 4000, "{shape:?} {dark} {double} {light}");
            assert_eq!(count(1.1, 9.0), 0, "{shape:?}");
        }
    }
}
