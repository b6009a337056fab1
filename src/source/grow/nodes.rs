//! The graph's nodes: a Poisson-disc distribution in the region where the plant will stand (2015, 3.1.1).
//!
//! They are copied from one cube of points (`tile`). The finer ones in which a plant's ways are taken at last are not
//! among them (`refine`).
//!
//! Lengths here and in all of `grow` are plant heights: the region of one plant is a cylinder of height 1 with the root
//! at the centre of its foot. A cylinder, since a box of the same width spends a fifth of its nodes in corners that no
//! crown reaches.

use glam::Vec3;

use super::grid::Grid;
use super::region::Region;
use super::tile::{Layer, tile};
use crate::base::Seed;

/// Edge of the cells of the grid, in discs. Measured on even graphs: 1.25 to 1.8 differ by a tenth.
const CELL: f32 = 1.5;
/// Mean length of the edges that paths take, in discs; measured.
const EDGE: f32 = 1.4;

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
    #[cfg(test)]
    pub(super) fn scatter(count: u32, width: f32, seed: Seed) -> Self {
        Self::even(&Region::cylinder(width), count, seed).0
    }

    /// About `count` nodes spread evenly in a region; and which of them are the roots of its plants.
    pub(super) fn even(region: &Region, count: u32, seed: Seed) -> (Self, Vec<u32>) {
        let edge = tile().edge(count as f32 / region.volume());
        let layer = Layer::new(edge, seed.child("nodes"));
        let (low, high) = region.bounds();
        let mut points = region.roots();
        let roots = points.len();
        let square = layer.disc * layer.disc;
        let (inside, feet) = (|p: Vec3| region.holds(p).then_some(()), points.clone());
        let free = |p: &Vec3| feet.iter().all(|foot| foot.distance_squared(*p) >= square);
        points.extend(layer.points(low, high, inside).into_iter().map(|(p, ())| p).filter(free));
        let (nodes, places) = Self::placed(&points, layer.disc);
        (nodes, places[..roots].to_vec())
    }

    /// Nodes at given places, the first of them the root; they are put in the order of a grid's cells.
    #[cfg(test)]
    pub(super) fn from_positions(points: Vec<Vec3>, disc: f32) -> Self {
        Self::placed(&points, disc).0
    }

    /// As [`from_positions`](Self::from_positions); and where each point is now.
    fn placed(points: &[Vec3], disc: f32) -> (Self, Vec<u32>) {
        let (grid, order) = Grid::sort(points, disc * CELL);
        let positions: Vec<Vec3> = order.iter().map(|&i| points[i as usize]).collect();
        let mut places = vec![0; points.len()];
        for (place, &i) in order.iter().enumerate() {
            places[i as usize] = place as u32;
        }
        let root = places.first().copied().unwrap_or(0);
        (Self { positions, grid, root, disc }, places)
    }

    /// About how long the edges of paths are.
    pub(super) fn hop(&self) -> f32 {
        self.disc * EDGE
    }

    /// Bytes of its arrays.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.positions.as_slice()) + self.grid.bytes()
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

    /// The nodes as a plant sees them whose foot is at `foot` and which is `share` as tall as the first.
    pub(super) fn seen_from(&self, root: u32, share: f32) -> Self {
        let foot = self.at(root);
        let mut seen = self.clone();
        seen.positions.iter_mut().for_each(|p| *p = (*p - foot) / share);
        seen.grid.lattice.low = (seen.grid.lattice.low - foot) / share;
        seen.grid.lattice.edge /= share;
        Self { root, disc: self.disc / share, ..seen }
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
}
