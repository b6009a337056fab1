//! A uniform grid over points: the points near a place without looking at the others.

use glam::Vec3;

/// Most cells a grid has; a larger box gets larger cells.
const MOST_CELLS: f32 = 2_000_000.0;
/// Points whose distances are taken together.
const LANES: usize = 8;

/// Points sorted by cell.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    low: Vec3,
    cell: f32,
    size: [usize; 3],
    /// Where each cell's points start in `items`; one more than cells.
    starts: Vec<u32>,
    items: Vec<u32>,
    /// The points in that order, an axis at a time, with [`LANES`] more.
    axes: [Vec<f32>; 3],
}

impl Grid {
    /// Sorts points into cells of about `cell` metres. Linear in points and cells.
    pub(super) fn new(points: &[Vec3], cell: f32) -> Self {
        let (mut low, mut high) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MIN));
        for &p in points {
            (low, high) = (low.min(p), high.max(p));
        }
        if points.is_empty() {
            (low, high) = (Vec3::ZERO, Vec3::ZERO);
        }
        let extent = high - low;
        let mut cell = cell.max(extent.max_element() * 1e-3).max(1e-6);
        let most = MOST_CELLS.min(points.len() as f32 * 16.0 + 64.0);
        let cells = |c: f32| (extent.x / c + 1.0) * (extent.y / c + 1.0) * (extent.z / c + 1.0);
        while cells(cell) > most {
            cell *= 1.3;
        }
        let size = [0, 1, 2].map(|a| (extent[a] / cell) as usize + 1);
        let starts = vec![0; size[0] * size[1] * size[2] + 1];
        let axes = std::array::from_fn(|_| vec![f32::INFINITY; points.len() + LANES]);
        let mut grid = Self { low, cell, size, starts, items: vec![0; points.len()], axes };
        let cells: Vec<usize> = points.iter().map(|&p| grid.index(grid.place(p))).collect();
        cells.iter().for_each(|&at| grid.starts[at + 1] += 1);
        for i in 1..grid.starts.len() {
            grid.starts[i] += grid.starts[i - 1];
        }
        let mut next = grid.starts.clone();
        for (i, (&p, &at)) in points.iter().zip(&cells).enumerate() {
            let slot = next[at] as usize;
            grid.items[slot] = i as u32;
            p.to_array().into_iter().zip(&mut grid.axes).for_each(|(v, axis)| axis[slot] = v);
            next[at] += 1;
        }
        grid
    }

    /// The nearest of the grid's points that is nearer than `within` to `centre`: its squared distance and its place in
    /// the array the grid was made of; of several equally near the first.
    pub(super) fn nearest(&self, centre: Vec3, within: f32) -> Option<(f32, u32)> {
        let mut best = (within * within, u32::MAX);
        // Where something is near, little has to be looked through.
        for radius in [self.cell.min(within), within] {
            let (low, high) = (self.place(centre - radius), self.place(centre + radius));
            for z in low[2]..=high[2] {
                let off_z = self.off(2, z, centre.z);
                for y in low[1]..=high[1] {
                    let off_y = self.off(1, y, centre.y);
                    // Rounding must not pass over a point that is as near.
                    if (off_y * off_y + off_z * off_z) * 0.999 > best.0 {
                        continue;
                    }
                    let row = self.row(low[0], high[0], y, z);
                    for first in row.step_by(LANES) {
                        let distances = self.distances(first, centre);
                        if least(&distances) <= best.0 {
                            for (&distance, &i) in distances.iter().zip(&self.items[first..]) {
                                if distance < best.0 || (distance == best.0 && i < best.1 && best.1 != u32::MAX) {
                                    best = (distance, i);
                                }
                            }
                        }
                    }
                }
            }
            if best.1 != u32::MAX && best.0 <= radius * radius {
                return Some(best);
            }
        }
        None
    }

    /// Whether one of the grid's points lies within `radius` of `centre`.
    pub(super) fn any(&self, centre: Vec3, radius: f32) -> bool {
        let (low, high, own) = (self.place(centre - radius), self.place(centre + radius), self.place(centre));
        let most = radius * radius;
        let within = |y: usize, z: usize| {
            self.row(low[0], high[0], y, z).step_by(LANES).any(|first| least(&self.distances(first, centre)) < most)
        };
        // The middle first: where something is near, it is there.
        if within(own[1], own[2]) {
            return true;
        }
        (low[2]..=high[2]).any(|z| {
            let off_z = self.off(2, z, centre.z);
            (low[1]..=high[1]).any(|y| {
                let off_y = self.off(1, y, centre.y);
                // Rounding must not pass over a point that is as near.
                (off_y * off_y + off_z * off_z) * 0.999 <= most && (y, z) != (own[1], own[2]) && within(y, z)
            })
        })
    }

    /// Where the points of a row of cells lie in the order of cells.
    fn row(&self, from: usize, to: usize, y: usize, z: usize) -> std::ops::Range<usize> {
        let first = (z * self.size[1] + y) * self.size[0];
        self.starts[first + from] as usize..self.starts[first + to + 1] as usize
    }

    /// The squared distances of some points from `centre`, in the order of cells. There may be some past the row that is
    /// asked for: they are points of the grid as well, and whoever is near enough is looked for anyway.
    #[inline]
    fn distances(&self, first: usize, centre: Vec3) -> [f32; LANES] {
        let lanes = |axis: &[f32]| axis[first..].first_chunk::<LANES>().copied().unwrap_or([f32::INFINITY; LANES]);
        let [xs, ys, zs] = &self.axes;
        let (xs, ys, zs) = (lanes(xs), lanes(ys), lanes(zs));
        let mut distances = [0.0; LANES];
        for k in 0..LANES {
            let d = [xs[k] - centre.x, ys[k] - centre.y, zs[k] - centre.z];
            distances[k] = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        }
        distances
    }

    /// How far a coordinate lies from a slab of cells; 0 inside.
    fn off(&self, axis: usize, place: usize, at: f32) -> f32 {
        let low = self.low[axis] + place as f32 * self.cell;
        (low - at).max(at - low - self.cell).max(0.0)
    }

    fn place(&self, p: Vec3) -> [usize; 3] {
        let q = (p - self.low) / self.cell;
        // A cast saturates: below zero is 0.
        [0, 1, 2].map(|a| (q[a] as usize).min(self.size[a] - 1))
    }

    fn index(&self, place: [usize; 3]) -> usize {
        (place[2] * self.size[1] + place[1]) * self.size[0] + place[0]
    }
}

/// The least of some numbers.
#[inline]
fn least(values: &[f32; LANES]) -> f32 {
    let mut least = f32::INFINITY;
    for &value in values {
        least = if value < least { value } else { least };
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn the_nearest_point_is_never_missed() {
        let points: Vec<Vec3> =
            (0..500).map(|i| Seed::new(1).at(i).direction() * Seed::new(2).at(i).range(0.0, 4.0)).collect();
        let grid = Grid::new(&points, 0.7);
        for i in 0..50 {
            let centre = Seed::new(3).at(i).direction() * 3.0;
            let inside: Vec<usize> = (0..points.len()).filter(|&p| points[p].distance(centre) < 1.1).collect();
            let nearest = inside
                .iter()
                .copied()
                .min_by(|&a, &b| points[a].distance(centre).total_cmp(&points[b].distance(centre)));
            assert_eq!(grid.nearest(centre, 1.1).map(|(_, p)| p as usize), nearest);
            assert_eq!(grid.any(centre, 1.1), !inside.is_empty());
        }
    }
}
