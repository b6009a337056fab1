//! Alpha as it will be once a picture is packed.
//!
//! An atlas changes alpha between neighbours so that its mips keep what level 0 covers ([`preserve_alpha`]), and alpha
//! between neighbours is where the outline of a magnified card lies: cards cover 3 to 6 % more than before. Where a
//! picture will lie is not known here; any place shows how it fares.

use crate::bake::{Rect, preserve_alpha};

/// Texels around a picture.
const GUTTER: u32 = 4;
/// Edge of the squares that the last mip which is kept is made of.
const SQUARE: u32 = 32;

/// The alpha of a picture of `width` by `height` texels as an atlas keeps it.
pub(super) fn as_packed(alpha: &[u8], (width, height): (u32, u32)) -> Vec<u8> {
    let (w, h) = (width as usize, height as usize);
    if w == 0 || alpha.len() != w * h {
        return alpha.to_vec();
    }
    let padded = |edge: u32| (edge + 2 * GUTTER).next_multiple_of(SQUARE);
    let (wide, high) = (padded(width), padded(height));
    let place = |y: usize| (y + GUTTER as usize) * wide as usize + GUTTER as usize;
    let mut sheet = vec![0_u8; wide as usize * high as usize];
    for (y, row) in alpha.chunks_exact(w).enumerate() {
        sheet[place(y)..][..w].copy_from_slice(row);
    }
    preserve_alpha(&mut sheet, (wide, high), &[Rect { x: GUTTER, y: GUTTER, width, height }]);
    (0..h).flat_map(|y| sheet[place(y)..][..w].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_solid_stays_so_and_no_more() {
        let alpha: Vec<u8> = (0..50 * 37_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let packed = as_packed(&alpha, (50, 37));
        assert_eq!(packed.len(), alpha.len());
        assert!(alpha.iter().zip(&packed).all(|(a, b)| (*a >= 128) == (*b >= 128)));
        assert!(alpha != packed);
        assert_eq!(as_packed(&[1, 2, 3], (2, 2)), [1, 2, 3]);
    }
}
