//! How far a place is from a plant so far: a distance transform on a grid, asked everywhere between its cells.
//!
//! Cells that hold a point of the plant are at 0; two sweeps carry distances to the neighbours (a chamfer of weights 1, √2
//! and √3, at most 8 % too long; Borgefors 1986). Good enough to say where a graph should be fine.

use glam::Vec3;

use super::grid::Lattice;

/// Distances at the middles of cells.
#[derive(Clone, Debug)]
pub(super) struct Near {
    lattice: Lattice,
    distances: Vec<f32>,
}

impl Near {
    /// The distances to some points within a box, by cells of that edge. Linear in cells.
    pub(super) fn new(points: impl Iterator<Item = Vec3>, low: Vec3, high: Vec3, edge: f32) -> Self {
        let lattice = Lattice::covering(low, high, edge);
        let mut distances = vec![f32::INFINITY; lattice.cells()];
        for p in points {
            distances[lattice.index(lattice.cell(p))] = 0.0;
        }
        let [across, up, deep] = lattice.size.map(|s| s as i32);
        let forth: Vec<([i32; 3], f32)> = (0..13_i32)
            .map(|i| {
                // The thirteen neighbours that come before a cell in the order of memory.
                let offset = [i % 3 - 1, i / 9 - 1, i / 3 % 3 - 1];
                let steps = offset.iter().filter(|o| **o != 0).count() as f32;
                (offset, steps.sqrt() * edge)
            })
            .collect();
        for back in [false, true] {
            for k in 0..distances.len() as i32 {
                let i = if back { distances.len() as i32 - 1 - k } else { k };
                let (x, z, y) = (i % across, i / across % deep, i / across / deep);
                let mut best = distances[i as usize];
                for &([dx, dy, dz], way) in &forth {
                    let [dx, dy, dz] = if back { [-dx, -dy, -dz] } else { [dx, dy, dz] };
                    let (nx, ny, nz) = (x + dx, y + dy, z + dz);
                    if (0..across).contains(&nx) && (0..up).contains(&ny) && (0..deep).contains(&nz) {
                        best = best.min(distances[((ny * deep + nz) * across + nx) as usize] + way);
                    }
                }
                distances[i as usize] = best;
            }
        }
        Self { lattice, distances }
    }

    /// The distance of a place, linearly between the middles of cells.
    pub(super) fn at(&self, p: Vec3) -> f32 {
        let q = (p - self.lattice.low) / self.lattice.edge - 0.5;
        let base = q.floor();
        let f = q - base;
        let cell = |offset: Vec3| {
            let c = (base + offset).max(Vec3::ZERO);
            let c = [c.x, c.y, c.z];
            let c: [u32; 3] = std::array::from_fn(|axis| (c[axis] as u32).min(self.lattice.size[axis] - 1));
            self.distances[self.lattice.index(c)]
        };
        let along = |y: f32, z: f32| {
            let (a, b) = (cell(Vec3::new(0.0, y, z)), cell(Vec3::new(1.0, y, z)));
            a + (b - a) * f.x
        };
        let across = |y: f32| {
            let (a, b) = (along(y, 0.0), along(y, 1.0));
            a + (b - a) * f.z
        };
        let (a, b) = (across(0.0), across(1.0));
        a + (b - a) * f.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn distances_are_right_to_a_cell_and_a_twelfth() {
        let points = [Vec3::new(0.2, 0.3, -0.4), Vec3::new(-0.5, 0.9, 0.1)];
        let near = Near::new(points.into_iter(), Vec3::new(-1.0, 0.0, -1.0), Vec3::ONE, 0.05);
        for i in 0..500 {
            let seed = Seed::new(9).at(i);
            let p = Vec3::new(seed.at(0).range(-1.0, 1.0), seed.at(1).unit(), seed.at(2).range(-1.0, 1.0));
            let real = points.iter().map(|q| q.distance(p)).fold(f32::INFINITY, f32::min);
            assert!((near.at(p) - real).abs() < 0.1 + real * 0.085, "{} for {real}", near.at(p));
        }
    }
}
