//! Cards that bend to what they show: heights over a plane on a coarse grid.
//!
//! A plane through a crown passes leaves at some distance. A grid of a few cells follows them: the heights of its corners
//! are the mean of the leaves around, by their area and nearness (a tent as wide as two cells), and what that leaves
//! over is fitted again (back-fitting; Hastie and Tibshirani 1990). Corners without leaves near them stay in the plane.
//! Leaves are still drawn along the plane's normal, so that a card is one picture whatever its heights are.

use glam::Vec2;

/// Cells along an edge at most.
const MOST: usize = 5;
/// Passes over what is left.
const PASSES: usize = 4;
/// Pulls corners to the plane, as a share of a leaf of mean area.
const PLANAR: f32 = 0.15;

/// Cells along an edge with which so many cards have no more than some triangles; 0 where they are to be flat.
pub(super) fn cells(cards: u32, triangles: usize) -> usize {
    (1..=MOST).rev().find(|cells| triangles_of(cards, *cells) <= triangles).unwrap_or(0)
}

/// Triangles that so many cards have at most.
pub(super) fn most_triangles(cards: u32) -> usize {
    triangles_of(cards, MOST)
}

fn triangles_of(cards: u32, cells: usize) -> usize {
    (cards as usize).saturating_mul(2 * cells * cells)
}

/// Heights of a card's corners over its plane, metres.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bend {
    /// Cells along an edge; 0 of a flat card.
    cells: usize,
    heights: Vec<f32>,
}

impl Bend {
    /// No heights.
    pub(super) const FLAT: Self = Self { cells: 0, heights: Vec::new() };

    /// Follows leaves at places of the card (-1..=1, v up), so many metres over its plane, of some area, by so many cells
    /// along an edge.
    pub(super) fn to(leaves: &[(Vec2, f32, f32)], cells: usize) -> Self {
        let area: f32 = leaves.iter().map(|l| l.2).sum();
        if cells == 0 || !(area > 0.0 && area.is_finite()) {
            return Self::FLAT;
        }
        let corners_in_all = (cells + 1) * (cells + 1);
        let mut bend = Self { cells, heights: vec![0.0; corners_in_all] };
        let planar = PLANAR * area / leaves.len() as f32;
        for _ in 0..PASSES {
            let mut sums = vec![(0.0_f32, planar); corners_in_all];
            for &(at, height, area) in leaves {
                let left = height - bend.at(at);
                for (corner, weight) in bend.corners(at) {
                    sums[corner].0 += left * area * weight;
                    sums[corner].1 += area * weight;
                }
            }
            bend.heights.iter_mut().zip(sums).for_each(|(h, (sum, weight))| *h += sum / weight);
        }
        if bend.heights.iter().all(|h| h.is_finite()) { bend } else { Self::FLAT }
    }

    /// Cells along an edge; 0 of a flat card.
    pub(super) fn cells(&self) -> usize {
        self.cells
    }

    /// The height at a place of the card, metres.
    pub(super) fn at(&self, at: Vec2) -> f32 {
        if self.cells == 0 {
            return 0.0;
        }
        self.corners(at).iter().map(|&(corner, weight)| self.heights[corner] * weight).sum()
    }

    /// The corners of the cell that a place lies in, and how near it is to each.
    fn corners(&self, at: Vec2) -> [(usize, f32); 4] {
        let cells = self.cells;
        let place = |v: f32| {
            let v = ((v * 0.5 + 0.5) * cells as f32).clamp(0.0, cells as f32);
            let cell = (v as usize).min(cells.saturating_sub(1));
            (cell, v - cell as f32)
        };
        let ((x, fx), (y, fy)) = (place(at.x), place(at.y));
        let corner = |dx: usize, dy: usize| (y + dy) * (cells + 1) + x + dx;
        [
            (corner(0, 0), (1.0 - fx) * (1.0 - fy)),
            (corner(1, 0), fx * (1.0 - fy)),
            (corner(0, 1), (1.0 - fx) * fy),
            (corner(1, 1), fx * fy),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn leaves(height: impl Fn(Vec2) -> f32) -> Vec<(Vec2, f32, f32)> {
        (0..400)
            .map(|i| {
                let seed = Seed::new(4).at(i);
                let at = Vec2::new(seed.at(0).range(-1.0, 1.0), seed.at(1).range(-1.0, 1.0));
                (at, height(at), seed.at(2).range(0.5, 1.5))
            })
            .collect()
    }

    #[test]
    fn a_bend_follows_leaves_that_lie_on_a_surface() {
        let saddle = |at: Vec2| at.x * at.y * 0.3 + 0.1;
        let leaves = leaves(saddle);
        let bend = Bend::to(&leaves, MOST);
        let off = leaves.iter().map(|l| (bend.at(l.0) - l.1).abs()).sum::<f32>() / leaves.len() as f32;
        assert!(off < 0.01, "{off}");
    }

    #[test]
    fn no_leaves_or_broken_ones_bend_nothing() {
        assert_eq!(Bend::to(&[], MOST), Bend::FLAT);
        assert_eq!(Bend::to(&[(Vec2::NAN, f32::NAN, f32::NAN)], MOST), Bend::FLAT);
        assert_eq!(Bend::to(&[(Vec2::ZERO, f32::INFINITY, 1.0)], MOST), Bend::FLAT);
        assert_eq!(Bend::to(&leaves(|_| 0.3), 0), Bend::FLAT);
    }

    #[test]
    fn cards_have_as_many_cells_as_their_triangles_allow() {
        assert_eq!([48 * 50, 48 * 50 - 1, 48 * 2, 48 * 2 - 1, 0].map(|most| cells(48, most)), [5, 4, 1, 0, 0]);
    }
}
