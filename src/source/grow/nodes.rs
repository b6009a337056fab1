//! The graph's nodes: a Poisson-disc distribution in the region where the plant will stand (2015, 3.1.1).
//!
//! They are copied from one cube of points (`tile`). An even graph takes one layer of copies. A graph whose density
//! follows a plant takes three: a coarse one everywhere, a middle one and a fine one near the plant, and drops what lies
//! too near to a node of a coarser layer. The count of nodes is given, and how far "near" reaches follows from it.
//!
//! Lengths here and in all of `grow` are plant heights: the region of one plant is a cylinder of height 1 with the root
//! at the centre of its foot. A cylinder, since a box of the same width spends a fifth of its nodes in corners that no
//! crown reaches.

use glam::Vec3;
use rayon::prelude::*;

use super::grid::Grid;
use super::region::Region;
use super::tile::{Layer, tile};
use crate::base::Seed;

/// Edge of the cells of the grid, in discs of the finest layer. Measured on even graphs: 1.25 to 1.8 differ by a tenth.
const CELL: f32 = 1.5;
/// Nodes of different layers are at least this share of the finer disc apart.
const APART: f32 = 0.75;
/// How far the middle layer reaches, over how far the fine one does.
const MIDDLE: f32 = 2.0;
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
    /// No two nodes of the finest layer are closer than this, plant heights.
    pub(super) disc: f32,
    /// The disc of the coarsest layer.
    pub(super) widest: f32,
    /// Length of an edge that counts as one hop, where the graph is finer than its parameters say; 0 where every edge
    /// does.
    pub(super) hop: f32,
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
        let (nodes, places) = Self::placed(&points, layer.disc, layer.disc);
        (nodes, places[..roots].to_vec())
    }

    /// As [`even`](Self::even) with `count` nodes in all, but `detail` times finer than those would be evenly spread
    /// where `distance` is small, and no finer than `coarse`, whose nodes are all kept, where it is great. The second
    /// value says where each node of `coarse` is now.
    pub(super) fn following(
        region: &Region,
        coarse: &Self,
        count: u32,
        detail: f32,
        seed: Seed,
        distance: impl Fn(Vec3) -> f32 + Sync,
    ) -> (Self, Vec<u32>) {
        let seed = seed.child("following");
        let density = count as f32 / region.volume();
        let fine = Layer::new(tile().edge(density) / detail, seed.child("fine"));
        let ratio = (coarse.disc / fine.disc).sqrt().max(1.0);
        let middle = Layer::new(fine.edge * ratio, seed.child("middle"));
        let reach = reach(coarse, count, density * region.volume() * detail * detail * detail, ratio, &distance);
        let mut points = coarse.positions.clone();
        let (low, high) = region.bounds();
        for (layer, most) in [(&middle, reach * MIDDLE), (&fine, reach)] {
            // Where the plant is everywhere, coarse layers would fill the gaps of the fine one.
            let added = layer.points(low, high, |p| (distance(p) <= most && region.holds(p)).then_some(()));
            let (held, order) = Grid::sort(&points, layer.disc);
            let sorted: Vec<Vec3> = order.iter().map(|&i| points[i as usize]).collect();
            let square = (layer.disc * APART) * (layer.disc * APART);
            let free = |p: &Vec3| {
                let [from, to] = held.lattice.around(held.lattice.cell(*p));
                (from[1]..=to[1]).all(|y| {
                    (from[2]..=to[2]).all(|z| {
                        let row = held.row([from[0], to[0]], y, z);
                        sorted[row.start as usize..row.end as usize].iter().all(|q| q.distance_squared(*p) >= square)
                    })
                })
            };
            let added: Vec<Vec3> = added.into_par_iter().map(|(p, ())| p).filter(free).collect();
            points.extend(added);
        }
        let (mut nodes, places) = Self::placed(&points, fine.disc, coarse.widest);
        nodes.root = places[coarse.root as usize];
        nodes.hop = EDGE * fine.disc * detail;
        (nodes, places)
    }

    /// Nodes at given places, the first of them the root; they are put in the order of a grid's cells.
    #[cfg(test)]
    pub(super) fn from_positions(points: Vec<Vec3>, disc: f32) -> Self {
        Self::placed(&points, disc, disc).0
    }

    /// As [`from_positions`](Self::from_positions); and where each point is now.
    fn placed(points: &[Vec3], disc: f32, widest: f32) -> (Self, Vec<u32>) {
        let (grid, order) = Grid::sort(points, disc * CELL);
        let positions: Vec<Vec3> = order.iter().map(|&i| points[i as usize]).collect();
        let mut places = vec![0; points.len()];
        for (place, &i) in order.iter().enumerate() {
            places[i as usize] = place as u32;
        }
        let root = places.first().copied().unwrap_or(0);
        (Self { positions, grid, root, disc, widest, hop: 0.0 }, places)
    }

    /// How many edges near a plant make a hop.
    pub(super) fn edges_in_a_hop(&self) -> f32 {
        if self.hop > 0.0 { self.hop / (EDGE * self.disc) } else { 1.0 }
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
        Self { root, disc: self.disc / share, widest: self.widest / share, hop: self.hop / share, ..seen }
    }
}

/// How far the fine layer may reach so that all layers together have about `count` nodes: each coarse node stands for its
/// share of the region. `fine` is how many nodes the fine layer would have everywhere.
fn reach(coarse: &Nodes, count: u32, fine: f32, ratio: f32, distance: &(impl Fn(Vec3) -> f32 + Sync)) -> f32 {
    let mut distances: Vec<f32> = coarse.positions.par_iter().map(|p| distance(*p)).collect();
    distances.sort_unstable_by(f32::total_cmp);
    let all = distances.len() as f32;
    let (per_fine, per_middle) = (fine / all - 1.0, fine / (ratio * ratio * ratio) / all - 1.0);
    let nodes = |reach: f32| {
        let within = |most: f32| distances.partition_point(|d| *d <= most) as f32;
        let near = within(reach);
        all + near * per_fine + (within(reach * MIDDLE) - near) * per_middle
    };
    let (mut low, mut high) = (0.0, distances.last().copied().unwrap_or(0.0));
    for _ in 0..24 {
        let middle = (low + high) * 0.5;
        if nodes(middle) <= count as f32 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
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
    fn nodes_that_follow_a_line_are_as_many_as_asked_and_finer_near_it() {
        let region = Region::cylinder(1.0);
        let (even, _) = Nodes::even(&region, 12_000, Seed::new(5));
        let (coarse, _) = Nodes::even(&region, 4000, Seed::new(5));
        let off_axis = |p: Vec3| Vec3::new(p.x, 0.0, p.z).length();
        let (nodes, places) = Nodes::following(&region, &coarse, 12_000, 2.0, Seed::new(5), off_axis);
        assert!((nodes.len() as f32 / 12_000.0 - 1.0).abs() < 0.15, "{}", nodes.len());
        assert!((nodes.disc * 2.0 / even.disc - 1.0).abs() < 1e-3);
        for (i, &place) in places.iter().take(coarse.len()).enumerate() {
            assert_eq!(nodes.at(place), coarse.at(i as u32));
        }
        assert_eq!(nodes.at(nodes.root), Vec3::ZERO);
        let near = |nodes: &Nodes| nodes.positions.iter().filter(|p| off_axis(**p) < 0.08).count() as f32;
        assert!(near(&nodes) > near(&even) * 6.5, "{} and {}", near(&nodes), near(&even));
        for (i, a) in nodes.positions.iter().enumerate().step_by(37) {
            let near = nodes.positions.iter().enumerate();
            assert!(near.filter(|(j, b)| *j != i && a.distance(**b) < nodes.disc * APART * 0.999).count() == 0);
        }
    }
}
