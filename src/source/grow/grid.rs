//! A uniform grid over points that lie about evenly: who is near whom, without ever asking all pairs.
//!
//! On Poisson-disc points a grid answers neighbour queries faster than trees do (kiddo, rstar), and sorting the points
//! by cell makes everything that walks from neighbour to neighbour find them in its cache.

use glam::Vec3;

use crate::base::Groups;

/// Cells of a box.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// Smallest corner.
    pub(super) low: Vec3,
    /// Edge of a cell.
    pub(super) edge: f32,
    /// Cells along x, y, z; each at least one.
    pub(super) size: [u32; 3],
}

impl Lattice {
    /// Most cells along an axis: keeps indices in range whatever the box.
    const MOST: f32 = 1_000_000.0;

    /// The cells of edge `edge` that cover a box.
    pub(super) fn covering(low: Vec3, high: Vec3, edge: f32) -> Self {
        let cells = ((high - low) / edge).floor();
        let size = [cells.x, cells.y, cells.z].map(|c| c.clamp(0.0, Self::MOST) as u32 + 1);
        Self { low, edge, size }
    }

    /// How many cells.
    pub(super) fn cells(&self) -> usize {
        self.size.iter().map(|&s| s as usize).product()
    }

    /// The cell of a point; of one outside the box, the nearest.
    pub(super) fn cell(&self, point: Vec3) -> [u32; 3] {
        let p = (point - self.low) / self.edge;
        // `as` saturates and takes NaN to 0.
        [(p.x as u32).min(self.size[0] - 1), (p.y as u32).min(self.size[1] - 1), (p.z as u32).min(self.size[2] - 1)]
    }

    /// Position of a cell in arrays over cells.
    pub(super) fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (y as usize * self.size[2] as usize + z as usize) * self.size[0] as usize + x as usize
    }

    /// Calls for the position of every cell from one to another.
    pub(super) fn each(&self, from: [u32; 3], to: [u32; 3], mut call: impl FnMut(usize)) {
        for y in from[1]..=to[1] {
            for z in from[2]..=to[2] {
                let first = self.index([from[0], y, z]);
                (first..=first + (to[0] - from[0]) as usize).for_each(&mut call);
            }
        }
    }

    /// First and last cell of the up to 27 at and around one.
    pub(super) fn around(&self, cell: [u32; 3]) -> [[u32; 3]; 2] {
        [cell.map(|c| c.saturating_sub(1)), [0, 1, 2].map(|axis| (cell[axis] + 1).min(self.size[axis] - 1))]
    }
}

/// Points sorted by the cell they lie in.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// The cells.
    pub(super) lattice: Lattice,
    /// Where each cell's points begin; one more at the end.
    starts: Vec<u32>,
}

impl Grid {
    /// Sorts points by cell: the grid, and the order in which the points must be put. Linear.
    pub(super) fn sort(points: &[Vec3], edge: f32) -> (Self, Vec<u32>) {
        let (mut low, mut high) = points.first().map_or((Vec3::ZERO, Vec3::ZERO), |&first| (first, first));
        for &p in points {
            (low, high) = (low.min(p), high.max(p));
        }
        let lattice = Lattice::covering(low, high, edge);
        let cells: Vec<u32> = points.iter().map(|&p| lattice.index(lattice.cell(p)) as u32).collect();
        let Groups { starts, items } = Groups::of(lattice.cells(), cells.iter().copied().zip(0..));
        (Self { lattice, starts }, items)
    }

    /// The points of the cells `from..=to` along x, by their places in the sorted order.
    pub(super) fn row(&self, [from, to]: [u32; 2], y: u32, z: u32) -> std::ops::Range<u32> {
        let start = self.lattice.index([from, y, z]);
        self.starts[start]..self.starts[start + (to - from) as usize + 1]
    }

    /// Bytes that it holds.
    pub(super) fn bytes(&self) -> usize {
        self.starts.len() * size_of::<u32>()
    }

    /// The points of a cell, by their places in the sorted order.
    #[cfg(test)]
    pub(super) fn points(&self, cell: [u32; 3]) -> std::ops::Range<u32> {
        let i = self.lattice.index(cell);
        self.starts[i]..self.starts[i + 1]
    }
}

/// Which of some boxes reach into each cell.
#[derive(Clone, Debug)]
pub(super) struct Boxes {
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Boxes {
    /// Enters boxes, each given by its first and its last cell. Linear in the cells that they reach into.
    pub(super) fn of(lattice: &Lattice, boxes: &[([u32; 3], [u32; 3])]) -> Self {
        let mut starts = vec![0_u32; lattice.cells() + 1];
        let mut members = Vec::new();
        for fill in [false, true] {
            for (i, (a, b)) in boxes.iter().enumerate() {
                for y in a[1]..=b[1] {
                    for z in a[2]..=b[2] {
                        let cell = lattice.index([a[0], y, z]);
                        for start in &mut starts[cell..=cell + (b[0] - a[0]) as usize] {
                            if fill {
                                // Filled from the end, so that starts are right when all are in.
                                *start -= 1;
                                members[*start as usize] = i as u32;
                            } else {
                                *start += 1;
                            }
                        }
                    }
                }
            }
            if !fill {
                let mut sum = 0;
                for start in &mut starts {
                    sum += *start;
                    *start = sum;
                }
                members = vec![0_u32; sum as usize];
            }
        }
        Self { starts, members }
    }

    /// The boxes that reach into a cell.
    pub(super) fn at(&self, cell: usize) -> &[u32] {
        &self.members[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn boxes_are_found_in_every_cell_that_they_reach_into() {
        let lattice = Lattice::covering(Vec3::ZERO, Vec3::ONE, 0.2);
        let boxes: Vec<([u32; 3], [u32; 3])> = (0..40)
            .map(|i| {
                let seed = Seed::new(9).at(i);
                let [a, b] = [0, 3].map(|k| [0, 1, 2].map(|axis| seed.at(k + axis).index(5) as u32));
                (std::array::from_fn(|x| a[x].min(b[x])), std::array::from_fn(|x| a[x].max(b[x])))
            })
            .collect();
        let entered = Boxes::of(&lattice, &boxes);
        for cell in (0..125_u32).map(|i| [i % 5, i / 5 % 5, i / 25]) {
            let mut found = entered.at(lattice.index(cell)).to_vec();
            found.sort_unstable();
            let inside = |(a, b): &([u32; 3], [u32; 3])| (0..3).all(|x| (a[x]..=b[x]).contains(&cell[x]));
            let expected: Vec<u32> = (0..40).filter(|&i| inside(&boxes[i as usize])).collect();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn every_point_is_found_in_its_cell_once() {
        let points: Vec<Vec3> = (0..500).map(|i| Seed::new(2).at(i).direction() * 3.0).collect();
        let (grid, order) = Grid::sort(&points, 0.7);
        let mut seen = vec![0; points.len()];
        for (place, &i) in order.iter().enumerate() {
            assert!(grid.points(grid.lattice.cell(points[i as usize])).contains(&(place as u32)));
            seen[i as usize] += 1;
        }
        assert!(seen.iter().all(|&s| s == 1));
    }

    #[test]
    fn points_outside_and_broken_ones_have_a_cell() {
        let lattice = Lattice::covering(Vec3::ZERO, Vec3::ONE, 0.3);
        assert_eq!(lattice.size, [4, 4, 4]);
        assert_eq!(lattice.cell(Vec3::splat(9.0)), [3, 3, 3]);
        assert_eq!(lattice.cell(Vec3::new(-1.0, f32::NAN, 0.5)), [0, 0, 1]);
        assert_eq!(lattice.around([0, 3, 1]), [[0, 2, 0], [1, 3, 2]]);
    }
}
