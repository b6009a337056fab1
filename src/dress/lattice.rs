//! Equal cells over a box, and how things are sorted into them.

use glam::Vec3;

use crate::base::Groups;

/// Most cells; a larger box gets larger cells.
const MOST_CELLS: f32 = 2_000_000.0;

/// Cells over a box. Places outside belong to the nearest cell at its rim.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    pub(super) low: Vec3,
    /// Edge of a cell, metres.
    pub(super) cell: f32,
    pub(super) size: [usize; 3],
}

impl Lattice {
    /// Over the box from `low` to `high`, of cells of about `cell` metres, at most `most` of them.
    pub(super) fn new((low, high): (Vec3, Vec3), cell: f32, most: usize) -> Self {
        let extent = high - low;
        let mut cell = cell.max(extent.max_element() * 1e-3).max(1e-6);
        let most = MOST_CELLS.min(most as f32);
        let cells = |c: f32| (extent.x / c + 1.0) * (extent.y / c + 1.0) * (extent.z / c + 1.0);
        while cells(cell) > most {
            cell *= 1.3;
        }
        Self { low, cell, size: [0, 1, 2].map(|a| (extent[a] / cell) as usize + 1) }
    }

    /// How many cells.
    pub(super) const fn count(&self) -> usize {
        self.size[0] * self.size[1] * self.size[2]
    }

    /// The cell that a place lies in.
    #[inline]
    pub(super) fn place(&self, p: Vec3) -> [usize; 3] {
        let q = (p - self.low) / self.cell;
        // A cast saturates: below zero is 0.
        [0, 1, 2].map(|a| (q[a] as usize).min(self.size[a] - 1))
    }

    /// Its number: along x first, then y.
    #[inline]
    pub(super) const fn index(&self, place: [usize; 3]) -> usize {
        (place[2] * self.size[1] + place[1]) * self.size[0] + place[0]
    }

    /// Sorts points by cell, each cell's in their order: where each cell's start, one more than cells, and the points.
    pub(super) fn sort(&self, points: &[Vec3]) -> (Vec<u32>, Vec<u32>) {
        let cells: Vec<u32> = points.iter().map(|&p| self.index(self.place(p)) as u32).collect();
        let Groups { starts, items } = Groups::of(self.count(), cells.iter().copied().zip(0..));
        (starts, items)
    }
}

/// The box around some points; nothing but the origin of none.
pub(super) fn bounds(points: &[Vec3]) -> (Vec3, Vec3) {
    let Some(&first) = points.first() else { return (Vec3::ZERO, Vec3::ZERO) };
    points.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)))
}
