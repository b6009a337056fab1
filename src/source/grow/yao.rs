//! The Yao-8 graph (2015, 3.1.1; Yao 1977): from every node an edge to the nearest node in each octant around it.
//!
//! Cells are visited from near to far until no octant can find anything nearer; each cell knows which octants can reach
//! it, so a node at the rim of the region, some of whose octants are empty, does not look at every point around. An
//! octant looks [`REACH`] discs far: in a Poisson-disc distribution that is empty only where the region ends.

use glam::Vec3;
use rayon::prelude::*;

use super::nodes::Nodes;

/// No edge in this octant.
pub(super) const NONE: u32 = u32::MAX;

/// How far an octant looks, in discs.
pub(super) const REACH: f32 = 4.0;

/// Outgoing edges of every node, one an octant; [`NONE`] where the octant is empty.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Graph {
    /// Targets; the octant's index has bit 0 for x, 1 for y, 2 for z, set where the target lies on the lower side.
    pub(super) edges: Vec<[u32; 8]>,
}

/// A cell near a node's own.
struct Step {
    offset: [i32; 3],
    /// Square of the least distance between points of the two cells.
    nearest: f32,
    /// Which octants of a point in the own cell meet the other.
    octants: u8,
}

impl Graph {
    /// Links the nodes. Linear in their number, parallel over nodes.
    pub(super) fn yao(nodes: &Nodes) -> Self {
        let reach = nodes.disc * REACH;
        let steps = steps(nodes.grid.lattice.edge, reach);
        let edges =
            (0..nodes.len() as u32).into_par_iter().with_min_len(512).map(|i| link(nodes, &steps, reach, i)).collect();
        Self { edges }
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
        let mut rim = sources.to_vec();
        let mut next = Vec::new();
        for hop in 1..=most {
            for &node in &rim {
                for target in self.leaving(node) {
                    if hops[target as usize] == u32::MAX {
                        hops[target as usize] = hop;
                        next.push(target);
                    }
                }
            }
            if next.is_empty() {
                break;
            }
            std::mem::swap(&mut rim, &mut next);
            next.clear();
        }
        hops
    }
}

/// The octant of `to` seen from `from`.
fn octant(from: Vec3, to: Vec3) -> usize {
    usize::from(to.x < from.x) | usize::from(to.y < from.y) << 1 | usize::from(to.z < from.z) << 2
}

/// The cells within reach, near ones first.
fn steps(edge: f32, reach: f32) -> Vec<Step> {
    let far = (reach / edge).ceil() as i32;
    let mut steps = Vec::new();
    for y in -far..=far {
        for z in -far..=far {
            for x in -far..=far {
                let offset = [x, y, z];
                let nearest = offset.map(|o| (o.abs() - 1).max(0) as f32 * edge);
                let nearest = nearest.iter().map(|d| d * d).sum::<f32>();
                if nearest <= reach * reach {
                    let meets = |bit: u8| {
                        (0..3).all(|axis| if bit >> axis & 1 == 1 { offset[axis] <= 0 } else { offset[axis] >= 0 })
                    };
                    let octants = (0..8).filter(|&bit| meets(bit)).fold(0, |mask, bit| mask | 1 << bit);
                    steps.push(Step { offset, nearest, octants });
                }
            }
        }
    }
    // A stable sort, so that ties keep the order of the loops above.
    steps.sort_by(|a, b| a.nearest.total_cmp(&b.nearest));
    steps
}

/// The nearest node in each octant around `node`; of equally near ones, that with the smallest index.
fn link(nodes: &Nodes, steps: &[Step], reach: f32, node: u32) -> [u32; 8] {
    let here = nodes.at(node);
    let lattice = &nodes.grid.lattice;
    let cell = lattice.cell(here);
    let mut found = [NONE; 8];
    let mut squares = [reach * reach; 8];
    let mut open = 0xff_u8;
    let mut shell = 0.0;
    for step in steps {
        if step.nearest > shell {
            shell = step.nearest;
            open = (0..8).filter(|&o| squares[o] >= shell).fold(0, |mask, o| mask | 1 << o);
            if open == 0 {
                break;
            }
        }
        if step.octants & open == 0 {
            continue;
        }
        let Some(cell) = shifted(cell, step.offset, lattice.size) else { continue };
        for other in nodes.grid.points(cell) {
            let there = nodes.at(other);
            let square = here.distance_squared(there);
            let o = octant(here, there);
            if other != node && (square < squares[o] || (square == squares[o] && other < found[o])) {
                squares[o] = square;
                found[o] = other;
            }
        }
    }
    found
}

fn shifted(cell: [u32; 3], offset: [i32; 3], size: [u32; 3]) -> Option<[u32; 3]> {
    let mut shifted = [0; 3];
    for axis in 0..3 {
        shifted[axis] = cell[axis].checked_add_signed(offset[axis]).filter(|&c| c < size[axis])?;
    }
    Some(shifted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn edges_lead_to_the_nearest_node_in_each_octant() {
        let nodes = Nodes::scatter(900, 0.7, Seed::new(5));
        let graph = Graph::yao(&nodes);
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
        let graph = Graph::yao(&nodes);
        for (o, &target) in graph.edges[nodes.root as usize].iter().enumerate() {
            assert_eq!(octant(Vec3::ZERO, nodes.at(target)), o);
        }
    }

    #[test]
    fn hops_count_edges() {
        let points = (0..6).map(|i| Vec3::new(0.1 * i as f32, i as f32, 0.0)).collect();
        let nodes = Nodes::from_positions(points, 1.0);
        let hops = Graph::yao(&nodes).hops(&[nodes.root], 4);
        let mut by_height: Vec<(f32, u32)> = nodes.positions.iter().map(|p| p.y).zip(hops).collect();
        by_height.sort_by(|a, b| a.0.total_cmp(&b.0));
        let hops: Vec<u32> = by_height.into_iter().map(|(_, h)| h).collect();
        assert_eq!(hops, [0, 1, 2, 3, 4, u32::MAX]);
    }
}
