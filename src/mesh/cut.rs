//! What a picture's outline makes of a leaf card.
//!
//! A folded card has an outline for each half, which meet on the fold: so neither crosses it, and no corner is spent on a
//! line through both. A flat card has one, and a second of few corners for levels of detail.

use glam::Vec2;

use super::ears::ears;

/// A card's corners, u and v each 0..=1, v up from its base, and its triangles, wound as seen from its front.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pattern {
    pub(super) corners: Vec<(f32, f32)>,
    pub(super) triangles: Vec<u32>,
}

impl Pattern {
    fn of(outlines: &[&[Vec2]]) -> Option<Self> {
        let mut pattern = Self { corners: Vec::new(), triangles: Vec::new() };
        for outline in outlines {
            let first = pattern.corners.len() as u32;
            let inside = |p: &Vec2| (0.0..=1.0).contains(&p.x) && (0.0..=1.0).contains(&p.y);
            if !outline.iter().all(inside) {
                return None;
            }
            pattern.corners.extend(outline.iter().map(|p| (p.x, p.y)));
            pattern.triangles.extend(ears(outline)?.as_flattened().iter().map(|k| k + first));
        }
        (!pattern.triangles.is_empty()).then_some(pattern)
    }

    fn area(&self) -> f32 {
        let corner = |i: u32| Vec2::from(self.corners[i as usize]);
        let triangles = self.triangles.as_chunks::<3>().0.iter();
        triangles.map(|t| (corner(t[1]) - corner(t[0])).perp_dot(corner(t[2]) - corner(t[0])) * 0.5).sum()
    }
}

/// The outlines that cards with one picture are cut to.
#[derive(Clone, Debug, PartialEq)]
pub struct CardCut {
    /// Of flat cards.
    pub(super) flat: Pattern,
    /// Of folded ones.
    pub(super) folded: Pattern,
    /// Of flat ones that are seen from afar.
    pub(super) trimmed: Pattern,
}

impl CardCut {
    /// The cut of some outlines: simple polygons, counter-clockwise, u and v each 0..=1, v up from the card's base. `halves`
    /// are those of what lies left and right of u = 0.5; either may be empty. None where one of them is no such polygon.
    #[must_use]
    pub fn new(whole: &[Vec2], halves: [&[Vec2]; 2], trimmed: &[Vec2]) -> Option<Self> {
        let left = halves[0].iter().all(|p| p.x <= 0.5);
        let right = halves[1].iter().all(|p| p.x >= 0.5);
        let halves: Vec<&[Vec2]> = halves.into_iter().filter(|half| !half.is_empty()).collect();
        (left && right).then_some(())?;
        Some(Self { flat: Pattern::of(&[whole])?, folded: Pattern::of(&halves)?, trimmed: Pattern::of(&[trimmed])? })
    }

    /// Share of the card that is drawn: of a flat one, of a folded one, and of one that is seen from afar.
    #[must_use]
    pub fn areas(&self) -> [f32; 3] {
        [&self.flat, &self.folded, &self.trimmed].map(Pattern::area)
    }

    /// The corners that a flat card, a folded one and one that is seen from afar have.
    #[must_use]
    pub fn corners(&self) -> [usize; 3] {
        [&self.flat, &self.folded, &self.trimmed].map(|pattern| pattern.corners.len())
    }

    /// The triangles of a folded card (or of a flat one): their corners in u and v, v up from the card's base.
    #[must_use]
    pub fn triangles(&self, folded: bool) -> Vec<[Vec2; 3]> {
        let pattern = if folded { &self.folded } else { &self.flat };
        let corner = |i: u32| Vec2::from(pattern.corners[i as usize]);
        pattern.triangles.as_chunks::<3>().0.iter().map(|t| t.map(corner)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];

    #[test]
    fn outlines_are_taken_whole_or_not_at_all() {
        let half = |from: f32| SQUARE.map(|p| Vec2::new(p.x * 0.5 + from, p.y));
        let cut = CardCut::new(&SQUARE, [&half(0.0), &half(0.5)], &SQUARE[..3]).unwrap();
        assert_eq!(cut.areas(), [1.0, 1.0, 0.5]);
        assert_eq!(cut.corners(), [4, 8, 3]);
        assert!(CardCut::new(&SQUARE, [&half(0.0), &[]], &SQUARE).is_some());
        assert!(CardCut::new(&SQUARE, [&half(0.5), &half(0.0)], &SQUARE).is_none());
        assert!(CardCut::new(&SQUARE.map(|p| p * 2.0), [&half(0.0), &[]], &SQUARE).is_none());
        assert!(CardCut::new(&SQUARE, [&[], &[]], &SQUARE).is_none());
    }
}
