//! Whether wood is near a place: asked some hundred thousand times of a tree, mostly of places that are clearly far from all
//! wood or close to some.
//!
//! So the squared distance to the nearest point is known in bounds for each cell of a fine lattice, by a distance transform
//! of the cells that hold points (an axis after the other: Felzenszwalb and Huttenlocher 2012), and only between those
//! bounds points are looked at.

use glam::Vec3;

use super::lattice::{Lattice, bounds};

/// Points whose distances are taken together.
const LANES: usize = 8;
/// Cells of bounds along the farthest reach.
const FINE: f32 = 0.2501;
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
        Self { lattice, starts, axes, fine, bounds }
    }

    /// Whether one of the points lies within `radius` of `centre`; `radius` is at most the farthest.
    pub(super) fn any(&self, centre: Vec3, radius: f32) -> bool {
        let q = (centre - self.fine.low) / self.fine.cell;
        let size = self.fine.size;
        // Written so that NaN fails it.
        if !(q.min_element() >= 0.0 && q.x < size[0] as f32 && q.y < size[1] as f32 && q.z < size[2] as f32) {
            return false;
        }
        let cell = self.fine.index([q.x as usize, q.y as usize, q.z as usize]);
        let [least, most] = self.bounds[cell];
        let wanted = radius * radius / (self.fine.cell * self.fine.cell);
        // Rounding must not decide.
        if least == FAR || f32::from(least) * 0.999 > wanted {
            return false;
        }
        f32::from(most) * 1.001 < wanted || self.holds(centre, radius)
    }

    /// As [`any`](Self::any), point by point.
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

    #[test]
    fn whether_a_point_is_near_is_told_for_all_distances() {
        let points: Vec<Vec3> =
            (0..300).map(|i| Seed::new(1).at(i).direction() * Seed::new(2).at(i).range(0.0, 4.0)).collect();
        for count in [0, 2_000_000] {
            let reach = Reach::new(&points, 0.9, count);
            let (mut near, mut asked) = (0, 0);
            for i in 0..4000 {
                let seed = Seed::new(3).at(i);
                let (centre, radius) = (seed.direction() * seed.at(7).range(0.0, 6.0), 0.9 * seed.at(8).unit());
                let is_near = points.iter().any(|p| p.distance_squared(centre) < radius * radius);
                assert_eq!(reach.any(centre, radius), is_near, "{centre} {radius}");
                (near, asked) = (near + u32::from(is_near), asked + 1);
            }
            assert!(near > asked / 10 && near < asked * 9 / 10, "{near} of {asked}");
        }
    }

    #[test]
    fn nothing_is_near_where_there_is_nothing() {
        assert!(!Reach::new(&[], 1.0, 9).any(Vec3::ZERO, 1.0));
        let one = Reach::new(&[Vec3::ONE], 1.0, 9);
        assert!(
            one.any(Vec3::ONE * 1.2, 0.5) && !one.any(Vec3::splat(f32::NAN), 1.0) && !one.any(Vec3::ONE * 9.0, 1.0)
        );
    }
}
