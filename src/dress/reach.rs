//! Whether wood is near a place: asked some hundred thousand times of a tree, mostly of places that are clearly far from all
//! wood or close to some. Places are looked for cell by cell, so that those with no wood in reach are never drawn.
//!
//! So the squared distance to the nearest point is known in bounds for each cell of a fine lattice, by a distance transform
//! of the cells that hold points (an axis after the other: Felzenszwalb and Huttenlocher 2012), and only between those
//! bounds points are looked at.

use glam::Vec3;
use rayon::prelude::*;

use super::lattice::{Lattice, bounds};

/// Points whose distances are taken together.
const LANES: usize = 8;
/// Cells of bounds along the farthest reach.
const FINE: f32 = 0.2501;
/// Cells that one task goes through.
const TOGETHER: usize = 1 << 14;
/// Bounds of cells that no point is within reach of.
const FAR: u8 = u8::MAX;

/// Points, and how far from them places are.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    /// The points by cell, an axis at a time, with [`LANES`] more.
    lattice: Lattice,
    starts: Vec<u32>,
    axes: [Vec<f32>; 3],
    /// Cells, and the square of the least and of the greatest distance from a place there to the nearest point, in cells.
    fine: Lattice,
    bounds: Vec<[u8; 2]>,
    /// The square of the farthest reach, in cells.
    most: u8,
}

/// A cell from which wood is in reach.
pub(super) struct Cell<'a> {
    reach: &'a Reach,
    pub(super) number: u64,
    /// Its lowest corner.
    pub(super) low: Vec3,
    bounds: [u8; 2],
}

impl Cell<'_> {
    /// Whether one of the points lies within `radius`, at most the farthest, of a place in the cell; the place is asked for where
    /// it matters.
    #[inline]
    pub(super) fn reaches(&self, radius: f32, place: impl FnOnce() -> Vec3) -> bool {
        let [least, most] = self.bounds.map(f32::from);
        let wanted = radius * radius / (self.reach.fine.cell * self.reach.fine.cell);
        // Rounding must not decide.
        least * 0.999 <= wanted && (most * 1.001 < wanted || self.reach.holds(place(), radius))
    }
}

impl Reach {
    /// Of points that are asked for within at most `farthest` metres, about `count` times. Linear in points and in cells, which
    /// are no more than a few for each question.
    pub(super) fn new(points: &[Vec3], farthest: f32, count: usize) -> Self {
        let (low, high) = bounds(points);
        let lattice = Lattice::new((low, high), farthest * 0.5, points.len() * 16 + 64);
        let (starts, items) = lattice.sort(points);
        let mut axes = [0, 1, 2].map(|axis| items.iter().map(|&i| points[i as usize][axis]).collect::<Vec<f32>>());
        axes.iter_mut().for_each(|axis| axis.extend([f32::INFINITY; LANES]));

        let fine = Lattice::new((low - farthest, high + farthest), farthest * FINE, count.max(4096));
        let reach = (farthest / fine.cell).ceil().clamp(1.0, 8.0) as usize;
        let mut held = vec![FAR; fine.count()];
        points.iter().for_each(|&p| held[fine.index(fine.place(p))] = 0);
        // Between two cells so far apart along an axis, places are a cell nearer or farther.
        let gap = |cells: usize| cells.saturating_sub(1) as u8;
        let span = |cells: usize| cells as u8 + 1;
        let squares = |of: &dyn Fn(usize) -> u8| (0..=reach).map(|cells| of(cells) * of(cells)).collect::<Vec<u8>>();
        let most = transformed(held.clone(), fine.size, &squares(&span));
        let least = transformed(held, fine.size, &squares(&gap));
        let bounds = least.into_iter().zip(most).map(<[u8; 2]>::from).collect();
        // A cast rounds down, as whole squares may.
        let most = (farthest * farthest / (fine.cell * fine.cell) * 1.001).min(f32::from(FAR - 1)) as u8;
        Self { lattice, starts, axes, fine, bounds, most }
    }

    /// What `add` adds for each cell that wood is in reach of, in their order.
    pub(super) fn of_cells<T: Send>(&self, add: impl Fn(&Cell<'_>, &mut Vec<T>) + Sync) -> Vec<T> {
        let [wide, high, _] = self.fine.size;
        let some = |(part, bounds): (usize, &[[u8; 2]])| {
            let mut all = Vec::new();
            for (i, &bounds) in bounds.iter().enumerate().filter(|(_, bounds)| bounds[0] <= self.most) {
                let number = part * TOGETHER + i;
                let (x, row) = (number % wide, number / wide);
                let place = Vec3::new(x as f32, (row % high) as f32, (row / high) as f32);
                let low = self.fine.low + place * self.fine.cell;
                add(&Cell { reach: self, number: number as u64, low, bounds }, &mut all);
            }
            all
        };
        self.bounds.par_chunks(TOGETHER).enumerate().map(some).collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Edge of the cells, metres.
    pub(super) const fn edge(&self) -> f32 {
        self.fine.cell
    }

    /// Whether one of the points lies within `radius` of `centre`, point by point.
    fn holds(&self, centre: Vec3, radius: f32) -> bool {
        let lattice = &self.lattice;
        let (low, high) = (lattice.place(centre - radius), lattice.place(centre + radius));
        let own = lattice.place(centre);
        let most = radius * radius;
        let within = |y: usize, z: usize| {
            let [first, last] = [low[0], high[0]].map(|x| lattice.index([x, y, z]));
            (self.starts[first] as usize..self.starts[last + 1] as usize)
                .step_by(LANES)
                .any(|first| self.distance(first, centre) < most)
        };
        // The middle first: where something is near, it is there.
        if within(own[1], own[2]) {
            return true;
        }
        let off = |axis: usize, place: usize| {
            let low = lattice.low[axis] + place as f32 * lattice.cell;
            (low - centre[axis]).max(centre[axis] - low - lattice.cell).max(0.0)
        };
        (low[2]..=high[2]).any(|z| {
            let off_z = off(2, z);
            (low[1]..=high[1]).any(|y| {
                let off_y = off(1, y);
                // Rounding must not pass over a point that is as near.
                (off_y * off_y + off_z * off_z) * 0.999 <= most && (y, z) != (own[1], own[2]) && within(y, z)
            })
        })
    }

    /// The least squared distance of some points from `centre`, in the order of cells. There may be some past the row that
    /// is asked for: they are points as well, and whoever is near enough is looked for anyway.
    #[inline]
    fn distance(&self, first: usize, centre: Vec3) -> f32 {
        let lanes = |axis: &[f32]| axis[first..].first_chunk::<LANES>().copied().unwrap_or([f32::INFINITY; LANES]);
        let [xs, ys, zs] = &self.axes;
        let (xs, ys, zs) = (lanes(xs), lanes(ys), lanes(zs));
        let mut least = f32::INFINITY;
        for k in 0..LANES {
            let d = [xs[k] - centre.x, ys[k] - centre.y, zs[k] - centre.z];
            let d = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            least = if d < least { d } else { least };
        }
        least
    }
}

/// For each cell the least sum, over all cells, of that cell's value and a cost for each axis by how many cells they are apart;
/// `costs` ends where no other counts.
fn transformed(mut values: Vec<u8>, [wide, high, deep]: [usize; 3], costs: &[u8]) -> Vec<u8> {
    let mut sums = vec![FAR; values.len()];
    // To the next cell along each axis, and how many there are.
    for (stride, count) in [(1, wide), (wide, high), (wide * high, deep)] {
        for (from, to) in values.chunks_exact(stride * count).zip(sums.chunks_exact_mut(stride * count)) {
            to.fill(FAR);
            for (apart, &cost) in costs.iter().enumerate().take(count) {
                let part = (count - apart) * stride;
                lower(&mut to[apart * stride..], &from[..part], cost);
                lower(&mut to[..part], &from[apart * stride..], cost);
            }
        }
        std::mem::swap(&mut values, &mut sums);
    }
    values
}

/// Lowers sums to what others and a cost make, where that is less.
#[inline]
fn lower(sums: &mut [u8], others: &[u8], cost: u8) {
    for (sum, &other) in sums.iter_mut().zip(others) {
        *sum = (*sum).min(other.saturating_add(cost));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    /// What is told of a place, in whichever cell it lies; false in none.
    fn any(reach: &Reach, place: Vec3, radius: f32) -> bool {
        let within = |p: Vec3| p.min_element() >= 0.0 && p.max_element() < reach.edge();
        let of = |cell: &Cell<'_>, all: &mut Vec<bool>| {
            all.extend(within(place - cell.low).then(|| cell.reaches(radius, || place)));
        };
        reach.of_cells(of).contains(&true)
    }

    #[test]
    fn whether_a_point_is_near_is_told_for_all_distances() {
        let points: Vec<Vec3> =
            (0..300).map(|i| Seed::new(1).at(i).direction() * Seed::new(2).at(i).range(0.0, 4.0)).collect();
        for count in [0, 20_000] {
            let reach = Reach::new(&points, 0.9, count);
            let (mut near, mut asked) = (0, 0);
            for i in 0..600 {
                let seed = Seed::new(3).at(i);
                let (centre, radius) = (seed.direction() * seed.at(7).range(0.0, 6.0), 0.9 * seed.at(8).unit());
                let is_near = points.iter().any(|p| p.distance_squared(centre) < radius * radius);
                assert_eq!(any(&reach, centre, radius), is_near, "{centre} {radius}");
                (near, asked) = (near + u32::from(is_near), asked + 1);
            }
            assert!(near > asked / 10 && near < asked * 9 / 10, "{near} of {asked}");
        }
    }

    #[test]
    fn cells_come_in_their_order_and_only_where_wood_is_in_reach() {
        let points = [Vec3::ZERO, Vec3::new(9.0, 0.0, 2.0)];
        let reach = Reach::new(&points, 1.0, 100_000);
        let cells = reach.of_cells(|cell, all| all.push((cell.number, cell.low)));
        assert!(cells.is_sorted_by(|a, b| a.0 < b.0) && cells.len() < reach.fine.count() / 4);
        let far = |low: Vec3| points.iter().all(|p| p.distance(low + reach.edge() * 0.5) > 1.0 + 3.0 * reach.edge());
        assert!(cells.len() > 200 && !cells.iter().any(|cell| far(cell.1)));
    }

    #[test]
    fn nothing_is_near_where_there_is_nothing() {
        assert!(!any(&Reach::new(&[], 1.0, 9), Vec3::ZERO, 1.0));
        let one = Reach::new(&[Vec3::ONE], 1.0, 9);
        assert!(any(&one, Vec3::ONE * 1.2, 0.5) && !any(&one, Vec3::ONE * 9.0, 1.0));
    }
}
