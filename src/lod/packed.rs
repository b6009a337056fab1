//! Alpha as it will be once pictures are packed.
//!
//! An atlas changes alpha between neighbours so that its mips keep what level 0 covers ([`Design`]), and alpha
//! between neighbours is where the outline of a magnified card lies: cards cover up to a tenth more or less than before.
//! The set's atlas is not known here, but pictures fare in it as in one of a tree's own: the texels of their mips are of the same
//! squares there. So their alpha is made once, here, and an atlas that holds them at full size leaves it as it is.

use crate::bake::{ALIGN, Design, GUTTER, Layout, Maps, PictureKind, Rect};
use crate::preset::plan::AtlasParams;

/// Texels along the edge of a square of the coarsest mip that is designed.
const SQUARE: u32 = 512;
/// Smallest and largest edge of the atlas.
const EDGES: (u32, u32) = (128, 8192);

/// How far a gain may be from the one that mips were designed with, as a factor. Palms whose clouds ended at twice the gain showed 1.5 of
/// level 0 in their fourth mip, and 1.3 since.
const NEAR: f32 = 1.4;

/// A design of cards whose gain is searched for: what mips are asked for hangs on how much is solid.
#[derive(Default)]
pub(super) struct Designed {
    design: Design,
    /// What it was made with.
    gain: f32,
}

impl Designed {
    /// The design for a gain: that of one before, if it is near.
    pub(super) fn with(&mut self, gain: f32) -> &mut Design {
        if !(self.gain / NEAR..=self.gain * NEAR).contains(&gain) {
            *self = Self { design: Design::default(), gain };
        }
        &mut self.design
    }
}

/// The edge nearest to `texels` with which a picture fills its cell of an atlas.
pub(super) const fn edge(texels: u32) -> u32 {
    let cell = (texels + GUTTER + ALIGN / 2) / ALIGN * ALIGN;
    if cell < ALIGN { ALIGN - GUTTER } else { cell - GUTTER }
}

/// The alphas of leaf pictures as an atlas keeps them, by slot.
pub(super) fn kept(leaves: &[Maps]) -> Vec<Vec<u8>> {
    let alphas: Vec<Vec<u8>> = leaves.iter().map(|maps| maps.color.iter().map(|c| c[3]).collect()).collect();
    let sizes: Vec<(u32, u32)> = leaves.iter().map(|maps| (maps.width, maps.height)).collect();
    as_packed(&alphas, &sizes, PictureKind::Leaf, &mut Design::default())
}

/// The alphas of pictures of some sizes as an atlas keeps them, by what was found of nearly the same ones before. Pictures that
/// no atlas holds are given back as they are.
pub(super) fn as_packed(
    pictures: &[Vec<u8>],
    sizes: &[(u32, u32)],
    kind: PictureKind,
    design: &mut Design,
) -> Vec<Vec<u8>> {
    let texels: u64 = sizes.iter().map(|s| u64::from(s.0 + 2 * GUTTER) * u64::from(s.1 + 2 * GUTTER)).sum();
    let mut edge = EDGES.0;
    while u64::from(edge) * u64::from(edge) < texels && edge < EDGES.1 {
        edge *= 2;
    }
    let layout = loop {
        match Layout::new(sizes, &[], &AtlasParams { size: edge, gutter: GUTTER }) {
            Ok(layout) if layout.scale == 1.0 => break layout,
            _ if edge < EDGES.1 => edge *= 2,
            _ => return pictures.to_vec(),
        }
    };
    let Ok(sheet) = layout.alpha(pictures) else { return pictures.to_vec() };
    let rects: Vec<(Rect, PictureKind)> = layout.rects.iter().map(|rect| (*rect, kind)).collect();
    // No more of the sheet than pictures lie on, in whole squares of the coarsest mip.
    let end = |of: fn(&Rect) -> u32, all: u32| {
        layout.rects.iter().map(of).max().unwrap_or(0).next_multiple_of(SQUARE).min(all)
    };
    let size = (end(|r| r.x + r.width, layout.width), end(|r| r.y + r.height, layout.height));
    let wide = size.0 as usize;
    let rows = sheet.chunks_exact(layout.width as usize).take(size.1 as usize);
    let mut sheet: Vec<u8> = rows.flat_map(|row| &row[..wide]).copied().collect();
    design.move_alpha(&mut sheet, size, &rects);
    let picture = |r: &Rect| -> Vec<u8> {
        let rows = (r.y..r.y + r.height).map(|y| y as usize * wide + r.x as usize);
        rows.flat_map(|start| &sheet[start..start + r.width as usize]).copied().collect()
    };
    layout.rects.iter().map(picture).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mips_are_designed_anew_where_far_more_is_solid() {
        let noise = |limit: u32| -> Vec<u8> {
            (0..64 * 64_u32).map(|i| if i.wrapping_mul(2_654_435_761) >> 24 < limit { 255 } else { 0 }).collect()
        };
        let packed =
            |limit: u32, design: &mut Design| as_packed(&[noise(limit)], &[(64, 64)], PictureKind::Card, design);
        let mut designed = Designed::default();
        packed(40, designed.with(0.5));
        let anew = packed(90, &mut Design::default());
        // A search takes small steps, and what was found holds.
        assert!(packed(90, designed.with(0.6)) != anew);
        assert!(packed(90, designed.with(1.0)) == anew);
        packed(40, designed.with(0.5));
        assert!(packed(90, designed.with(0.6)) != anew);
    }

    #[test]
    fn what_is_solid_stays_so_and_no_more() {
        let noise =
            |count: u32, k: u32| (0..count).map(|i| ((i + k).wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let sizes = [(50, 37), (8, 90), (31, 31)];
        let pictures: Vec<Vec<u8>> = sizes.iter().map(|s| noise(s.0 * s.1, s.0)).collect();
        let packed = as_packed(&pictures, &sizes, PictureKind::Card, &mut Design::default());
        assert_eq!(packed.len(), 3);
        for (before, after) in pictures.iter().zip(&packed) {
            assert_eq!(before.len(), after.len());
            assert!(before.iter().zip(after).all(|(a, b)| (*a >= 128) == (*b >= 128)));
            assert!(before != after);
        }
        assert_eq!(as_packed(&[vec![1, 2, 3]], &[(2, 2)], PictureKind::Card, &mut Design::default()), [[1, 2, 3]]);
        assert!(as_packed(&[], &[], PictureKind::Card, &mut Design::default()).is_empty());
    }
}
