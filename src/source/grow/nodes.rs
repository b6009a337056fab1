//! The graph's nodes: a Poisson-disc distribution in the region where the tree will stand (2015, 3.1.1).
//!
//! Grid-based dart throwing. A round throws one dart into every cell of a grid three discs wide, in memory order, which
//! is faster than throwing anywhere; each round shifts the grid by a random amount. Cells as wide as the disc need fewer
//! rounds, but whoever comes first in a cell decides where its neighbours can lie, and a lattice showed: twice as many
//! nodes in the upper half of a cell as in the lower. The disc's radius follows from the wanted count: after [`ROUNDS`]
//! rounds the discs fill a known share of the region ([`FILL`], measured), so the count comes out within a few percent.
//!
//! Lengths here and in all of `grow` are plant heights: the region is a cylinder of height 1 with the root at the
//! centre of its foot. A cylinder, since a box of the same width spends a fifth of its nodes in corners that no crown
//! reaches.

use glam::Vec3;
use rayon::prelude::*;

use super::grid::{Grid, Lattice};
use crate::base::{Seed, math};

/// Rounds of darts: eight darts for each cube as wide as the disc.
const ROUNDS: u64 = 8 * 27;
/// Edge of the cells of a round, in discs.
const CELL: f32 = 3.0;
/// `count · disc³` over the volume of the region after [`ROUNDS`] rounds, the region grown by [`RIM`] discs.
const FILL: f32 = 0.521;
/// By how much the region counts as larger on all sides, in discs: nodes at its rim have neighbours on one side only.
const RIM: f32 = 0.22;

/// The nodes of a graph, as a structure of arrays, in the order of the cells of their grid.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    /// Positions, plant heights.
    pub(super) positions: Vec<Vec3>,
    /// Where the nodes are found.
    pub(super) grid: Grid,
    /// The node at the origin.
    pub(super) root: u32,
    /// No two nodes are closer than this, plant heights.
    pub(super) disc: f32,
}

impl Nodes {
    /// About `count` nodes in a cylinder of diameter `width`, one of them the root at the origin.
    pub(super) fn scatter(count: u32, width: f32, seed: Seed) -> Self {
        let disc = disc_radius(count, width);
        let radius = width * 0.5;
        let mut darts = Darts::new(disc, radius);
        darts.throw(Vec3::ZERO);
        let seed = seed.child("nodes");
        let inside = |p: Vec3| p.x * p.x + p.z * p.z <= radius * radius && p.y >= 0.0 && p.y <= 1.0;
        for round in 0..ROUNDS {
            let seed = seed.at(round);
            let shift = seed.child("shift");
            let shift = Vec3::new(shift.at(0).unit(), shift.at(1).unit(), shift.at(2).unit()) * (CELL * disc);
            let lattice = Lattice::covering(
                Vec3::new(-radius, 0.0, -radius) - shift,
                Vec3::new(radius, 1.0, radius),
                CELL * disc,
            );
            let [across, layers, rows] = lattice.size;
            // Nearly all darts hit a disc that lies there already; that much is found out in parallel. Those that don't
            // may still hit each other, and are thrown in their order.
            let free = (0..layers * rows).into_par_iter().with_min_len(8).map(|row| {
                let throw = |x: u32| {
                    let seed = seed.at(u64::from(row) * u64::from(across) + u64::from(x));
                    let jitter = Vec3::new(seed.at(0).unit(), seed.at(1).unit(), seed.at(2).unit());
                    let cell = Vec3::new(x as f32, (row / rows) as f32, (row % rows) as f32);
                    lattice.low + (cell + jitter) * lattice.edge
                };
                (0..across).map(throw).filter(|&p| inside(p) && darts.fits(p)).collect::<Vec<Vec3>>()
            });
            for point in free.collect::<Vec<_>>().into_iter().flatten() {
                darts.throw(point);
            }
        }
        Self::from_positions(darts.points, disc)
    }

    /// Nodes at given places, the first of them the root; they are put in the order of a grid's cells.
    pub(super) fn from_positions(points: Vec<Vec3>, disc: f32) -> Self {
        let (grid, order) = Grid::sort(&points, disc * 1.25);
        let positions: Vec<Vec3> = order.iter().map(|&i| points[i as usize]).collect();
        let root = order.iter().position(|&i| i == 0).unwrap_or(0) as u32;
        Self { positions, grid, root, disc }
    }

    /// How many.
    pub(super) fn len(&self) -> usize {
        self.positions.len()
    }

    /// Where one stands.
    pub(super) fn at(&self, node: u32) -> Vec3 {
        self.positions[node as usize]
    }

    /// The node nearest to a point, the first of equals. Linear; called once for each given point.
    pub(super) fn nearest(&self, point: Vec3) -> u32 {
        let mut best = (f32::INFINITY, 0);
        for (i, p) in self.positions.iter().enumerate() {
            let d = p.distance_squared(point);
            if d < best.0 {
                best = (d, i as u32);
            }
        }
        best.1
    }
}

/// The disc radius with which about `count` nodes fit the cylinder.
fn disc_radius(count: u32, width: f32) -> f32 {
    let mut disc = 0.0;
    // The rim depends on the disc: a few rounds settle it, since it is a small share.
    for _ in 0..12 {
        let (radius, height) = (width * 0.5 + RIM * disc, 1.0 + 2.0 * RIM * disc);
        let volume = std::f32::consts::PI * radius * radius * height;
        disc = math::cbrt(FILL * volume / count.max(1) as f32);
    }
    disc
}

/// Points no two of which are closer than a disc's radius.
struct Darts {
    points: Vec<Vec3>,
    lattice: Lattice,
    /// The last point of each cell.
    last: Vec<u32>,
    /// The point before it in the same cell.
    before: Vec<u32>,
    square: f32,
}

impl Darts {
    fn new(disc: f32, radius: f32) -> Self {
        let lattice = Lattice::covering(Vec3::new(-radius, 0.0, -radius), Vec3::new(radius, 1.0, radius), disc);
        Self {
            points: Vec::new(),
            last: vec![u32::MAX; lattice.cells()],
            lattice,
            before: Vec::new(),
            square: disc * disc,
        }
    }

    /// Keeps a point unless one lies within the disc around it.
    fn throw(&mut self, point: Vec3) {
        if self.fits(point) {
            let cell = self.lattice.index(self.lattice.cell(point));
            self.before.push(self.last[cell]);
            self.last[cell] = self.points.len() as u32;
            self.points.push(point);
        }
    }

    /// Whether no point lies within the disc around this one.
    fn fits(&self, point: Vec3) -> bool {
        let here = self.lattice.cell(point);
        // Most darts of the later rounds are refused by a point of their own cell or one beside it.
        if self.refuses(here, point) {
            return false;
        }
        let [low, high] = self.lattice.around(here);
        for y in low[1]..=high[1] {
            for z in low[2]..=high[2] {
                for x in low[0]..=high[0] {
                    if self.refuses([x, y, z], point) {
                        return false;
                    }
                }
            }
        }
        true
    }

    fn refuses(&self, cell: [u32; 3], point: Vec3) -> bool {
        let mut i = self.last[self.lattice.index(cell)];
        while i != u32::MAX {
            if self.points[i as usize].distance_squared(point) < self.square {
                return true;
            }
            i = self.before[i as usize];
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_keep_their_distance_and_their_count() {
        for (count, width) in [(600, 1.0), (4000, 0.3), (8000, 1.2), (2000, 0.1), (2000, 8.0)] {
            let nodes = Nodes::scatter(count, width, Seed::new(u64::from(count)));
            let found = nodes.len() as f32 / count as f32;
            assert!((0.96..1.04).contains(&found), "{found} of {count} at width {width}");
            for (i, a) in nodes.positions.iter().enumerate().step_by(17) {
                let near = nodes.positions.iter().enumerate().filter(|(j, b)| *j != i && a.distance(**b) < nodes.disc);
                assert_eq!(near.count(), 0);
                assert!(a.x * a.x + a.z * a.z <= width * width * 0.2501 && (0.0..=1.0).contains(&a.y));
            }
        }
    }

    #[test]
    fn the_root_stands_at_the_origin() {
        let nodes = Nodes::scatter(800, 0.8, Seed::new(3));
        assert_eq!(nodes.at(nodes.root), Vec3::ZERO);
        assert_eq!(nodes.nearest(Vec3::new(0.0, -1.0, 0.0)), nodes.root);
    }

    #[test]
    fn no_lattice_shows_in_the_nodes() {
        let nodes = Nodes::scatter(20_000, 1.0, Seed::new(8));
        // Fractions of a coordinate by the disc are even: a lattice would crowd some bins.
        let mut bins = [0_u32; 8];
        for p in &nodes.positions {
            let f = (p.y / nodes.disc).fract();
            bins[((f * 8.0) as usize).min(7)] += 1;
        }
        let mean = nodes.len() as f32 / 8.0;
        assert!(bins.iter().all(|&b| (b as f32 / mean - 1.0).abs() < 0.12), "{bins:?}");
    }
}
