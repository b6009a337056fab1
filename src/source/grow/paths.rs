//! Least-cost paths with guiding vectors that are set on the way (2015, 3.1.2): Dijkstra's algorithm in which
//! finalizing a node fixes its guiding vector, and with it the weights `d (1 - e·v)` of the edges that leave it.
//!
//! One thing is added to the paper's weight: length costs a little ([`LENGTH`]). Where it costs nothing, a twig on the far
//! side of the crown is a whip that comes straight from the foot of the trunk, however many branches it passes; at 0.3
//! twigs leave nearly at right angles and curl.
//!
//! A weight depends on the path to its node, so this is no shortest-path problem of one fixed graph; but every weight is
//! fixed before it is used and none is negative, so each node is finalized once and its path is a tree's. Costs are
//! compared as bits (they are never negative) with the node's index after them, so equal costs have one order.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::Vec3;

use super::guide::Step;
use super::nodes::Nodes;
use super::yao::{Graph, NONE};
use crate::base::Seed;
use crate::preset::plan::Guide;

/// What a unit of length costs on a path that follows its guiding vectors.
const LENGTH: f32 = 0.2;

/// A node of the structure so far, with the guiding vector it starts with.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathSource {
    /// The node.
    pub(super) node: u32,
    /// A unit vector.
    pub(super) vector: Vec3,
    /// Angle by which the vector leans on the first hop, see [`start`](super::guide::start).
    pub(super) lean: f32,
    /// Whether no path may leave it nor pass through it.
    pub(super) closed: bool,
}

/// What the algorithm knows of a node.
#[derive(Clone, Copy, Debug)]
struct State {
    cost: f32,
    /// The node before it; itself at a source.
    before: u32,
    /// Where its path leaves the structure.
    source: u32,
    /// Edges from there.
    hops: u32,
    vector: Vec3,
    finalized: bool,
}

/// The least-cost paths of one pass.
#[derive(Clone, Debug)]
pub(super) struct Paths {
    states: Vec<State>,
}

impl Paths {
    /// Finds the paths from `sources` to all `targets`, and stops when every target that can be reached is.
    ///
    /// `n log n` in the nodes finalized until then.
    pub(super) fn find(
        nodes: &Nodes,
        graph: &Graph,
        sources: &[PathSource],
        targets: &[u32],
        guide: &Guide,
        seed: Seed,
    ) -> Self {
        let blank =
            State { cost: f32::INFINITY, before: NONE, source: NONE, hops: 0, vector: Vec3::Y, finalized: false };
        let mut states = vec![blank; nodes.len()];
        let mut frontier = BinaryHeap::with_capacity(sources.len() + 1024);
        let mut leans = vec![0.0_f32; nodes.len()];
        for &PathSource { node, vector, lean, closed } in sources {
            leans[node as usize] = lean;
            states[node as usize] = State { cost: 0.0, before: node, source: node, vector, finalized: closed, ..blank };
            if !closed {
                frontier.push(Reverse(key(0.0, node)));
            }
        }
        let mut wanted = vec![false; nodes.len()];
        for &t in targets {
            wanted[t as usize] = true;
        }
        let mut missing = wanted.iter().filter(|&&w| w).count();
        while let Some(Reverse(top)) = frontier.pop() {
            let node = top as u32;
            let state = states[node as usize];
            if state.finalized {
                continue;
            }
            let here = nodes.at(node);
            let mut vector = state.vector;
            if state.before != node {
                let edge = (here - nodes.at(state.before)).normalize_or(Vec3::Y);
                // Only sources lean.
                let lean = leans[state.before as usize];
                let step = Step {
                    vector,
                    edge,
                    position: here,
                    hops: state.hops,
                    source: state.source,
                    source_height: nodes.at(state.source).y,
                    node,
                    lean,
                };
                vector = step.turned(guide, seed);
            }
            states[node as usize].vector = vector;
            states[node as usize].finalized = true;
            if wanted[node as usize] {
                missing -= 1;
                if missing == 0 {
                    break;
                }
            }
            for target in graph.leaving(node) {
                let next = &mut states[target as usize];
                if next.finalized {
                    continue;
                }
                let cost = state.cost + weight(nodes.at(target) - here, vector);
                if cost < next.cost {
                    // Until the node is finalized, its vector is that of the node before it.
                    *next = State {
                        cost,
                        before: node,
                        source: state.source,
                        hops: state.hops + 1,
                        vector,
                        finalized: false,
                    };
                    frontier.push(Reverse(key(cost, target)));
                }
            }
        }
        Self { states }
    }

    /// Whether a path leads to a node.
    pub(super) fn reached(&self, node: u32) -> bool {
        self.states[node as usize].finalized
    }

    /// The node before this one on its path; itself in the structure.
    pub(super) fn before(&self, node: u32) -> u32 {
        self.states[node as usize].before
    }

    /// Where a node's path leaves the structure.
    pub(super) fn source(&self, node: u32) -> u32 {
        self.states[node as usize].source
    }

    /// A finalized node's guiding vector.
    pub(super) fn vector(&self, node: u32) -> Vec3 {
        self.states[node as usize].vector
    }
}

/// `d (1 + LENGTH - e·v)`, with rounding kept from going below zero.
fn weight(edge: Vec3, vector: Vec3) -> f32 {
    (edge.length() * (1.0 + LENGTH) - edge.dot(vector)).max(0.0)
}

/// Orders by cost, then by node.
fn key(cost: f32, node: u32) -> u64 {
    u64::from(cost.to_bits()) << 32 | u64::from(node)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRAIGHT: Guide = Guide::Constant { alpha: 0.0 };

    fn node_at(nodes: &Nodes, p: Vec3) -> u32 {
        nodes.nearest(p)
    }

    fn path(paths: &Paths, mut node: u32) -> Vec<u32> {
        let mut path = vec![node];
        while paths.before(node) != node {
            node = paths.before(node);
            path.push(node);
        }
        path.reverse();
        path
    }

    #[test]
    fn a_path_follows_the_vector_before_it_turns() {
        // A diamond: up and then across, or straight across and up. The upright vector makes the first the cheaper.
        let up = Vec3::new(0.05, 1.0, 0.0);
        let side = Vec3::new(1.0, 0.05, 0.0);
        let end = Vec3::new(1.1, 1.1, 0.0);
        let nodes = Nodes::from_positions(vec![Vec3::ZERO, up, side, end], 1.0);
        let [root, up, end] = [Vec3::ZERO, up, end].map(|p| node_at(&nodes, p));
        let side = node_at(&nodes, side);
        let mut edges = vec![[NONE; 8]; 4];
        edges[root as usize][..2].copy_from_slice(&[up, side]);
        edges[up as usize][0] = end;
        edges[side as usize][0] = end;
        let graph = Graph { edges };
        let source = [PathSource { node: root, vector: Vec3::Y, lean: 0.0, closed: false }];
        // Turning to the horizontal after one hop makes the way across free; the way up from the side costs.
        let guide = Guide::Piecewise { alpha1: std::f32::consts::FRAC_PI_2, alpha2: 0.0, h0: 1 };
        let paths = Paths::find(&nodes, &graph, &source, &[end], &guide, Seed::new(1));
        assert_eq!(path(&paths, end), [root, up, end]);
        assert!((paths.vector(up) - Vec3::X).length() < 1e-4);
        assert_eq!(paths.source(end), root);
    }

    #[test]
    fn what_no_edge_leads_to_is_not_reached() {
        let nodes = Nodes::from_positions(vec![Vec3::ZERO, Vec3::Y, Vec3::Y * 9.0], 1.0);
        let graph = Graph::yao(&nodes);
        let far = node_at(&nodes, Vec3::Y * 9.0);
        let source = [PathSource { node: nodes.root, vector: Vec3::Y, lean: 0.0, closed: false }];
        let paths = Paths::find(&nodes, &graph, &source, &[far], &STRAIGHT, Seed::new(1));
        assert!(!paths.reached(far) && paths.reached(node_at(&nodes, Vec3::Y)));
    }

    #[test]
    fn costs_are_those_of_bellman_and_ford_where_vectors_do_not_turn() {
        let nodes = Nodes::scatter(400, 0.8, Seed::new(6));
        let graph = Graph::yao(&nodes);
        let all: Vec<u32> = (0..nodes.len() as u32).collect();
        let source = [PathSource { node: nodes.root, vector: Vec3::Y, lean: 0.0, closed: false }];
        let paths = Paths::find(&nodes, &graph, &source, &all, &STRAIGHT, Seed::new(1));
        let mut costs = vec![f32::INFINITY; nodes.len()];
        costs[nodes.root as usize] = 0.0;
        let mut changed = true;
        while changed {
            changed = false;
            for i in 0..nodes.len() as u32 {
                for j in graph.leaving(i) {
                    let cost = costs[i as usize] + weight(nodes.at(j) - nodes.at(i), Vec3::Y);
                    if cost < costs[j as usize] {
                        costs[j as usize] = cost;
                        changed = true;
                    }
                }
            }
        }
        let found: Vec<f32> = paths.states.iter().map(|s| s.cost).collect();
        assert_eq!(found, costs);
    }
}
