//! The Yao-8 graph (2015, 3.1.1; Yao 1977): from every node an edge to the nearest node in each octant around it.
//!
//! Nodes lie in the order of their grid's cells, so a row of cells is one run of nodes. A node looks at the runs around
//! it in growing blocks of cells, and stops when no octant can find anything nearer outside the block; an octant that is
//! settled takes no part in the next. Distance and index are compared as one integer, since a branch that guesses wrong
//! costs more than the distance. An octant looks [`REACH`] discs far: one that reaches farther holds a ball of a disc's radius
//! and so a node, unless the region ends there. Longer edges are found along its walls only, and least-cost paths take them:
//! the fewer edges, the straighter a path. With 4 discs the trunk of a slim cypress ran up the side of its crown.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::Vec3;
use rayon::prelude::*;

use super::nodes::Nodes;
use super::obstacle::Obstacles;
use crate::base::Seed;

/// No edge in this octant.
pub(super) const NONE: u32 = u32::MAX;

/// How far an octant looks, in discs.
pub(super) const REACH: f32 = 2.75;

/// Outgoing edges of every node, one an octant; [`NONE`] where the octant is empty.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Edges {
    /// Targets; the octant's index has bit 0 for x, 1 for y, 2 for z, set where the target lies on the lower side.
    pub(super) edges: Vec<[u32; 8]>,
}

impl Edges {
    /// Links the nodes; an edge that an obstacle bars is left out. Linear in their number, parallel over nodes.
    pub(super) fn yao(nodes: &Nodes, obstacles: &Obstacles) -> Self {
        let clear = obstacles.is_empty();
        let edges = (0..nodes.len() as u32).into_par_iter().with_min_len(512).map(|i| {
            let mut found = link(nodes, i);
            if !clear {
                for target in &mut found {
                    if *target != NONE && obstacles.bar(nodes.at(i), nodes.at(*target)) {
                        *target = NONE;
                    }
                }
            }
            found
        });
        Self { edges: edges.collect() }
    }

    /// Edges that are known already.
    #[cfg(test)]
    pub(super) fn given(edges: Vec<[u32; 8]>) -> Self {
        Self { edges }
    }

    /// Bytes that they hold.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.edges.as_slice())
    }

    /// The edges that leave a node.
    pub(super) fn leaving(&self, node: u32) -> impl Iterator<Item = u32> + use<> {
        self.edges[node as usize].into_iter().filter(|&target| target != NONE)
    }

    /// Fewest edges from any of `sources` to each node; `u32::MAX` beyond `most` or where no path leads.
    pub(super) fn hops(&self, sources: &[u32], most: u32) -> Vec<u32> {
        let mut hops = vec![u32::MAX; self.edges.len()];
        for &s in sources {
            hops[s as usize] = 0;
        }
        let (mut rim, mut next) = (sources.to_vec(), Vec::new());
        let mut hop = 0_u32;
        while !rim.is_empty() && hop < most {
            hop += 1;
            // Nothing branches within, since half of the guesses would be wrong.
            next.resize(next.len().max(rim.len() * 8 + 1), NONE);
            let mut found = 0;
            for &node in &rim {
                for target in self.edges[node as usize] {
                    let target = if target == NONE { node } else { target };
                    let known = &mut hops[target as usize];
                    next[found] = target;
                    found += usize::from(*known == u32::MAX);
                    *known = (*known).min(hop);
                }
            }
            rim.clear();
            rim.extend_from_slice(&next[..found]);
        }
        hops
    }

    /// The same with edges that count for `irregular` more or less than one, 0..=1, each by chance; infinite where it is more
    /// than `most`. A graph's shortest ways are the lucky ones: at 1 nodes are about half as far as by number.
    pub(super) fn irregular_hops(&self, sources: &[u32], most: f32, irregular: f32, seed: Seed) -> Vec<f32> {
        let mut hops = vec![f32::INFINITY; self.edges.len()];
        let mut rim = BinaryHeap::new();
        for &s in sources {
            hops[s as usize] = 0.0;
            rim.push(Reverse((0, s)));
        }
        while let Some(Reverse((bits, node))) = rim.pop() {
            let here = f32::from_bits(bits);
            if here > hops[node as usize] {
                continue;
            }
            for target in self.leaving(node) {
                let chance = seed.at(u64::from(node)).at(u64::from(target)).unit();
                let to = here + 1.0 + irregular * (2.0 * chance - 1.0);
                if to <= most && to < hops[target as usize] {
                    hops[target as usize] = to;
                    // Never negative, so bits have the order of numbers.
                    rim.push(Reverse((to.to_bits(), target)));
                }
            }
        }
        hops
    }
}

/// The octant of `to` seen from `from`.
#[cfg(test)]
fn octant(from: Vec3, to: Vec3) -> usize {
    usize::from(to.x < from.x) | usize::from(to.y < from.y) << 1 | usize::from(to.z < from.z) << 2
}

/// The nearest nodes found so far: square of the distance and index, as one number a octant.
struct Nearest {
    node: u32,
    here: Vec3,
    best: [u64; 8],
}

impl Nearest {
    /// Looks at a run of nodes.
    fn look(&mut self, nodes: &Nodes, run: std::ops::Range<u32>) {
        let places = &nodes.positions[run.start as usize..run.end as usize];
        for (other, there) in run.zip(places) {
            let d = *there - self.here;
            let octant = usize::from(d.x < 0.0) | usize::from(d.y < 0.0) << 1 | usize::from(d.z < 0.0) << 2;
            // Squares are never negative, so their bits have their order.
            let key = u64::from(d.length_squared().to_bits()) << 32 | u64::from(other);
            let key = if other == self.node { u64::MAX } else { key };
            self.best[octant] = self.best[octant].min(key);
        }
    }

    fn square(&self, octant: usize) -> f32 {
        f32::from_bits((self.best[octant] >> 32) as u32)
    }
}

/// The nearest node in each octant around `node`; of equally near ones, that with the smallest index.
fn link(nodes: &Nodes, node: u32) -> [u32; 8] {
    let here = nodes.at(node);
    let lattice = &nodes.grid.lattice;
    let cell = lattice.cell(here);
    let reach = nodes.disc * REACH;
    let most = (reach / lattice.edge).ceil() as u32 + 1;
    let mut nearest = Nearest { node, here, best: [u64::from((reach * reach).to_bits()) << 32 | u64::from(NONE); 8] };
    // Way from the node to the lower and the upper end of its cell.
    let inner = here - (lattice.low + Vec3::new(cell[0] as f32, cell[1] as f32, cell[2] as f32) * lattice.edge);
    let mut open = 0xff_u8;
    for ring in 1..=most {
        let low = cell.map(|c| c.saturating_sub(ring));
        let high = [0, 1, 2].map(|axis| (cell[axis] + ring).min(lattice.size[axis] - 1));
        // Which sides of the node any open octant is on.
        let sides: [[bool; 2]; 3] = std::array::from_fn(|axis| {
            let lower = (0..8).fold(0_u8, |mask, o| mask | u8::from(o >> axis & 1 == 1) << o);
            [open & lower != 0, open & !lower != 0]
        });
        let range = |axis: usize| {
            let from = if sides[axis][0] { low[axis] } else { cell[axis] };
            let to = if sides[axis][1] { high[axis] } else { cell[axis] };
            (from, to)
        };
        let ((x0, x1), (y0, y1), (z0, z1)) = (range(0), range(1), range(2));
        for y in y0..=y1 {
            for z in z0..=z1 {
                let ends = ring > 1 && y.abs_diff(cell[1]) < ring && z.abs_diff(cell[2]) < ring;
                if !ends {
                    nearest.look(nodes, nodes.grid.row([x0, x1], y, z));
                    continue;
                }
                // Only the two ends of the row are new.
                for x in [x0, x1] {
                    if x.abs_diff(cell[0]) == ring {
                        nearest.look(nodes, nodes.grid.row([x, x], y, z));
                    }
                }
            }
        }
        // What was not looked at yet lies at least as far away as the block's faces on the octant's side.
        let block = ring as f32 * lattice.edge;
        for octant in 0..8 {
            let mut unseen = f32::INFINITY;
            for axis in 0..3 {
                let lower = octant >> axis & 1 == 1;
                let ends = if lower { low[axis] == 0 } else { high[axis] == lattice.size[axis] - 1 };
                if !ends {
                    let face = if lower { inner[axis] + block } else { lattice.edge - inner[axis] + block };
                    unseen = unseen.min(face);
                }
            }
            // A little less, since a point's cell is found with rounding.
            unseen *= 0.9999;
            if unseen * unseen > nearest.square(octant) {
                open &= !(1 << octant);
            }
        }
        if open == 0 {
            break;
        }
    }
    nearest.best.map(|key| key as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_lead_to_the_nearest_node_in_each_octant() {
        let nodes = Nodes::scatter(900, 0.7, Seed::new(5));
        let graph = Edges::yao(&nodes, &Obstacles::default());
        for i in 0..nodes.len() as u32 {
            let mut best = [(nodes.disc * nodes.disc * REACH * REACH, NONE); 8];
            for j in 0..nodes.len() as u32 {
                let square = nodes.at(i).distance_squared(nodes.at(j));
                let b = &mut best[octant(nodes.at(i), nodes.at(j))];
                if i != j && square < b.0 {
                    *b = (square, j);
                }
            }
            assert_eq!(graph.edges[i as usize], best.map(|(_, j)| j), "node {i}");
        }
    }

    #[test]
    fn a_star_of_eight_is_linked_to_its_centre() {
        let mut points = vec![Vec3::ZERO];
        for o in 0..8 {
            let side = |bit: i32| if o >> bit & 1 == 1 { -1.0 } else { 1.0 };
            points.push(Vec3::new(side(0), side(1), side(2)));
        }
        let nodes = Nodes::from_positions(points, 1.0);
        let graph = Edges::yao(&nodes, &Obstacles::default());
        for (o, &target) in graph.edges[nodes.root as usize].iter().enumerate() {
            assert_eq!(octant(Vec3::ZERO, nodes.at(target)), o);
        }
    }

    #[test]
    fn only_at_the_walls_an_octant_is_empty() {
        let nodes = Nodes::scatter(6000, 0.7, Seed::new(5));
        let graph = Edges::yao(&nodes, &Obstacles::default());
        let (away, mut inside) = (nodes.disc * REACH, 0);
        for i in 0..nodes.len() as u32 {
            let p = nodes.at(i);
            let out = Vec3::new(p.x, 0.0, p.z).length();
            if out < 0.35 - away && p.y > away && p.y < 1.0 - away {
                inside += 1;
                assert_eq!(graph.leaving(i).count(), 8, "{p}");
            }
        }
        assert!(inside > 1000, "{inside}");
    }

    #[test]
    fn no_way_is_shorter_along_a_wall() {
        // Edges that are longer than any inside would draw paths to the wall.
        let nodes = Nodes::scatter(20_000, 0.1, Seed::new(2));
        let graph = Edges::yao(&nodes, &Obstacles::default());
        let far = (0..nodes.len() as u32).flat_map(|i| graph.leaving(i).map(move |to| (i, to)));
        let longest = far.map(|(i, to)| nodes.at(i).distance(nodes.at(to))).fold(0.0, f32::max);
        let wide = 1.0 + 3.0_f32.sqrt();
        assert!(longest <= nodes.disc * (wide + 0.05), "{longest} of {}", nodes.disc);
    }

    #[test]
    fn irregular_hops_are_hops_more_or_less_and_without_chance_the_same() {
        let nodes = Nodes::scatter(3000, 0.7, Seed::new(5));
        let graph = Edges::yao(&nodes, &Obstacles::default());
        let hops = graph.hops(&[nodes.root], 9);
        let of = |irregular, seed| graph.irregular_hops(&[nodes.root], 9.5, irregular, Seed::new(seed));
        for (even, counted) in hops.iter().zip(of(0.0, 1)) {
            assert!(
                if *even == u32::MAX { counted.is_infinite() } else { counted == *even as f32 },
                "{even} {counted}"
            );
        }
        let (some, much) = (of(0.3, 1), of(1.0, 1));
        let mut levels = [0, 0];
        for (even, (some, much)) in hops.iter().zip(some.iter().zip(&much)).filter(|(even, _)| (2..6).contains(*even)) {
            assert!(*some >= *even as f32 * 0.7 - 1e-4 && *some <= *even as f32 * 1.3 + 1e-4, "{even} {some}");
            levels[0] += usize::from(some.round() != *even as f32);
            levels[1] += usize::from(much.round() != *even as f32);
        }
        assert!(levels[0] > 20 && levels[1] > levels[0], "{levels:?}");
        assert!(of(0.3, 1) == some && of(0.3, 2) != some);
    }

    #[test]
    fn hops_count_edges() {
        let points = (0..6).map(|i| Vec3::new(0.1 * i as f32, i as f32, 0.0)).collect();
        let nodes = Nodes::from_positions(points, 1.0);
        let hops = Edges::yao(&nodes, &Obstacles::default()).hops(&[nodes.root], 4);
        let mut by_height: Vec<(f32, u32)> = nodes.positions.iter().map(|p| p.y).zip(hops).collect();
        by_height.sort_by(|a, b| a.0.total_cmp(&b.0));
        let hops: Vec<u32> = by_height.into_iter().map(|(_, h)| h).collect();
        assert_eq!(hops, [0, 1, 2, 3, 4, u32::MAX]);
    }
}
