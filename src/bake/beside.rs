//! Colours of texels that little was drawn on.
//!
//! A texel of a card or of an impostor is solid or not, and of many that are solid a small part was drawn. Where that is a twig between
//! leaves, all of the texel was as dark as the twig: clouds of pale leaves had blobs of bark as large as their leaves. So what
//! was not drawn of a texel is of the colour of what was drawn on it and beside it.

use glam::Vec3;

use super::srgb;

/// Colours times what was drawn of them, and that, added up.
#[derive(Clone, Copy, Default)]
struct Weighed {
    color: Vec3,
    share: f32,
}

impl Weighed {
    fn new([r, g, b]: [u8; 3], share: u8) -> Self {
        let share = f32::from(share);
        Self { color: Vec3::new(srgb::decode(r), srgb::decode(g), srgb::decode(b)) * share, share }
    }

    fn add(&mut self, other: &Self) {
        self.color += other.color;
        self.share += other.share;
    }

    fn mean(&self) -> Vec3 {
        self.color / self.share
    }
}

/// Mixes the colours of texels of which a share was drawn, of 255, with those of the eight around them, in linear light and by what was
/// drawn of each. Those that all was drawn of, and those that nothing was, stay as they are. Rows are `width` texels; does nothing where
/// the two are not of one length.
pub(crate) fn mix_beside(colors: &mut [[u8; 3]], drawn: &[u8], width: usize) {
    if width == 0 || colors.len() != drawn.len() || !drawn.iter().any(|share| (1..u8::MAX).contains(share)) {
        return;
    }
    let all: Vec<Weighed> = colors.iter().zip(drawn).map(|(&color, &share)| Weighed::new(color, share)).collect();
    let rows: Vec<&[Weighed]> = all.chunks(width).collect();
    let mut columns = vec![Weighed::default(); width + 2];
    for (y, (colors, drawn)) in colors.chunks_mut(width).zip(drawn.chunks(width)).enumerate() {
        columns.fill(Weighed::default());
        for row in &rows[y.saturating_sub(1)..(y + 2).min(rows.len())] {
            columns[1..].iter_mut().zip(*row).for_each(|(sum, texel)| sum.add(texel));
        }
        for (x, (color, &share)) in colors.iter_mut().zip(drawn).enumerate() {
            if share == 0 || share == u8::MAX {
                continue;
            }
            let mut around = columns[x];
            around.add(&columns[x + 1]);
            around.add(&columns[x + 2]);
            let (mean, own) = (around.mean(), rows[y][x].mean());
            *color = (mean + (own - mean) * (f32::from(share) / 255.0)).to_array().map(srgb::encode);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BARK: [u8; 3] = [30, 20, 10];
    const LEAF: [u8; 3] = [240, 180, 210];

    #[test]
    fn a_twig_of_which_little_was_drawn_is_of_the_colour_of_the_leaves_beside_it() {
        // Leaves all over but for a column of bark, of which more is drawn from row to row.
        let shares = [13, 64, 128, 204, 255];
        let mut colors = vec![LEAF; 25];
        let mut drawn = vec![255; 25];
        for (y, share) in shares.into_iter().enumerate() {
            (colors[5 * y + 2], drawn[5 * y + 2]) = (BARK, share);
        }
        let before = colors.clone();
        mix_beside(&mut colors, &drawn, 5);
        let column: Vec<u8> = (0..5).map(|y| colors[5 * y + 2][0]).collect();
        assert!(column[0] > 220 && column.is_sorted_by(|a, b| a > b) && column[4] == BARK[0], "{column:?}");
        // In linear light.
        let [own, mean, mixed] = [BARK[0], LEAF[0], column[1]].map(srgb::decode);
        let share = (mean - mixed) / (mean - own);
        assert!((0.25..0.5).contains(&share), "{share}");
        assert!((0..25).all(|i| i % 5 == 2 || colors[i] == before[i]));
    }

    #[test]
    fn a_twig_alone_stays_as_dark_as_it_is() {
        let mut colors = vec![[0; 3]; 42];
        let mut drawn = vec![0; 42];
        for i in (3..42).step_by(7) {
            (colors[i], drawn[i]) = (BARK, 20);
        }
        let before = colors.clone();
        mix_beside(&mut colors, &drawn, 7);
        assert_eq!(colors, before);
    }

    #[test]
    fn pictures_of_any_size_are_mixed_at_their_rims() {
        for (width, height) in [(1, 1), (1, 5), (5, 1), (2, 3)] {
            let mut colors = vec![BARK; width * height];
            mix_beside(&mut colors, &vec![90; width * height], width);
            assert!(colors.iter().all(|color| *color == BARK), "{width} {height}");
        }
        let mut colors = vec![BARK; 3];
        mix_beside(&mut colors, &[9, 9], 3);
        mix_beside(&mut [], &[], 0);
        assert_eq!(colors, [BARK; 3]);
    }
}
