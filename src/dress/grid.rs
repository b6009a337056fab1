//! A uniform grid over points: the points near a place without looking at the others.

use glam::Vec3;

/// Most cells a grid has; a larger box gets larger cells.
const MOST_CELLS: f32 = 2_000_000.0;

/// Points sorted by cell.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    low: Vec3,
    cell: f32,
    size: [usize; 3],
    /// Where each cell's points start in `items`; one more than cells.
    starts: Vec<u32>,
    items: Vec<u32>,
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
        let mut grid =
            Self { low, cell, size, starts: vec![0; size[0] * size[1] * size[2] + 1], items: vec![0; points.len()] };
        for &p in points {
            let at = grid.index(grid.place(p));
            grid.starts[at + 1] += 1;
        }
        for i in 1..grid.starts.len() {
            grid.starts[i] += grid.starts[i - 1];
        }
        let mut next = grid.starts.clone();
        for (i, &p) in points.iter().enumerate() {
            let at = grid.index(grid.place(p));
            grid.items[next[at] as usize] = i as u32;
            next[at] += 1;
        }
        grid
    }

    /// The nearest of the points `points`, the ones the grid was made of, that is nearer than `within` to `centre`, and
    /// its squared distance; of several equally near the first.
    pub(super) fn nearest(&self, points: &[Vec3], centre: Vec3, within: f32) -> Option<(f32, u32)> {
        let mut best = (within * within, u32::MAX);
        // Where something is near, little has to be looked through.
        for radius in [self.cell.min(within), within] {
            let (low, high) = (self.place(centre - radius), self.place(centre + radius));
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    // A row of cells lies together.
                    let from = self.starts[self.index([low[0], y, z])] as usize;
                    let to = self.starts[self.index([high[0], y, z]) + 1] as usize;
                    for &i in &self.items[from..to] {
                        let distance = points[i as usize].distance_squared(centre);
                        if distance < best.0 || (distance == best.0 && i < best.1 && best.1 != u32::MAX) {
                            best = (distance, i);
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

    /// Whether one of the points `points`, the ones the grid was made of, lies within `radius` of `centre`.
    pub(super) fn any(&self, points: &[Vec3], centre: Vec3, radius: f32) -> bool {
        let (low, high) = (self.place(centre - radius), self.place(centre + radius));
        let within = |&i: &u32| points[i as usize].distance_squared(centre) < radius * radius;
        (low[2]..=high[2]).any(|z| {
            (low[1]..=high[1]).any(|y| {
                let from = self.starts[self.index([low[0], y, z])] as usize;
                let to = self.starts[self.index([high[0], y, z]) + 1] as usize;
                self.items[from..to].iter().any(within)
            })
        })
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
            assert_eq!(grid.nearest(&points, centre, 1.1).map(|(_, p)| p as usize), nearest);
            assert_eq!(grid.any(&points, centre, 1.1), !inside.is_empty());
        }
    }
}
