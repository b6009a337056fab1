//! Cards that bend to what they show: heights over a plane on a coarse grid.
//!
//! A plane through a crown passes leaves at some distance. A grid of a few cells follows them: the heights of its corners
//! are the mean of the leaves around, by their area and nearness (a tent as wide as two cells), and what that leaves
//! over is fitted again (back-fitting; Hastie and Tibshirani 1990). Corners without leaves near them stay in the plane.
//! Leaves are still drawn along the plane's normal, so that a card is one picture whatever its heights are.

use glam::Vec2;

/// Cells along an edge.
pub(super) const CELLS: usize = 5;
/// Corners along an edge.
const CORNERS: usize = CELLS + 1;
/// Passes over what is left.
const PASSES: usize = 4;
/// Pulls corners to the plane, as a share of a leaf of mean area.
const PLANAR: f32 = 0.15;

/// Heights of a card's corners over its plane, metres.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bend {
    heights: [f32; CORNERS * CORNERS],
}

impl Bend {
    /// No heights.
    pub(super) const FLAT: Self = Self { heights: [0.0; CORNERS * CORNERS] };

    /// Follows leaves at places of the card (-1..=1, v up), so many metres over its plane, of some area.
    pub(super) fn to(leaves: &[(Vec2, f32, f32)]) -> Self {
        let mut bend = Self::FLAT;
        let area: f32 = leaves.iter().map(|l| l.2).sum();
        if !(area > 0.0 && area.is_finite()) {
            return bend;
        }
        let planar = PLANAR * area / leaves.len() as f32;
        for _ in 0..PASSES {
            let mut sums = [(0.0_f32, planar); CORNERS * CORNERS];
            for &(at, height, area) in leaves {
                let left = height - bend.at(at);
                for (corner, weight) in corners(at) {
                    sums[corner].0 += left * area * weight;
                    sums[corner].1 += area * weight;
                }
            }
            bend.heights.iter_mut().zip(sums).for_each(|(h, (sum, weight))| *h += sum / weight);
        }
        if bend.heights.iter().all(|h| h.is_finite()) { bend } else { Self::FLAT }
    }

    /// The height at a place of the card, metres.
    pub(super) fn at(&self, at: Vec2) -> f32 {
        corners(at).iter().map(|&(corner, weight)| self.heights[corner] * weight).sum()
    }
}

/// The corners of the cell that a place lies in, and how near it is to each.
fn corners(at: Vec2) -> [(usize, f32); 4] {
    let place = |v: f32| {
        let v = ((v * 0.5 + 0.5) * CELLS as f32).clamp(0.0, CELLS as f32);
        let cell = (v as usize).min(CELLS - 1);
        (cell, v - cell as f32)
    };
    let ((x, fx), (y, fy)) = (place(at.x), place(at.y));
    let corner = |dx: usize, dy: usize| (y + dy) * CORNERS + x + dx;
    [
        (corner(0, 0), (1.0 - fx) * (1.0 - fy)),
        (corner(1, 0), fx * (1.0 - fy)),
        (corner(0, 1), (1.0 - fx) * fy),
        (corner(1, 1), fx * fy),
    ]
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
        let bend = Bend::to(&leaves);
        let off = leaves.iter().map(|l| (bend.at(l.0) - l.1).abs()).sum::<f32>() / leaves.len() as f32;
        assert!(off < 0.01, "{off}");
    }

    #[test]
    fn no_leaves_or_broken_ones_bend_nothing() {
        assert_eq!(Bend::to(&[]), Bend::FLAT);
        assert_eq!(Bend::to(&[(Vec2::NAN, f32::NAN, f32::NAN)]), Bend::FLAT);
        assert_eq!(Bend::to(&[(Vec2::ZERO, f32::INFINITY, 1.0)]), Bend::FLAT);
    }
}
