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
