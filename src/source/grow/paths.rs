//! Least-cost paths with guiding vectors that are set on the way (2015, 3.1.2): Dijkstra's algorithm in which
//! finalizing a node fixes its guiding vector, and with it the weights `d (1 - e·v)` of the edges that leave it.
//!
//! One thing is added to the paper's weight: length costs a little ([`LENGTH`]). Where it costs nothing, a twig on the far
//! side of the crown is a whip that comes straight from the foot of the trunk, however many branches it passes; at 0.3
//! twigs leave nearly at right angles and curl.
//!
//! A weight depends on the path to its node, so this is no shortest-path problem of one fixed graph; but every weight is
//! fixed before it is used and none is negative, so each node is finalized once and its path is a tree's. Equal costs
//! come in the order of their nodes.
//!
//! Plants that share a graph would share their ways too, the trunk first. So every plant has whims: a node is a little
//! dearer or cheaper to it ([`WHIM`]) than to the next.
//!
//! Several plants grow in one pass. A node belongs to the plant that reaches it at the least cost, so each keeps to its
//! own part of the space as crowns in a stand do, and no two ever share a node.

use glam::Vec3;

use super::frontier::Frontier;
use super::guide::Step;
use super::nodes::Nodes;
use super::yao::{Edges, NONE};
use crate::base::Seed;
use crate::preset::plan::Guide;

/// What a unit of length costs on a path that follows its guiding vectors.
const LENGTH: f32 = 0.2;
/// By how much a node of a plant's own may be dearer or cheaper than what the paper says, as a share.
const WHIM: f32 = 0.15;

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

/// What the algorithm knows of a finalized node.
#[derive(Clone, Copy, Debug)]
struct State {
    /// Where its path leaves the structure.
    source: u32,
    /// Edges from there, in hops.
    hops: f32,
    vector: Vec3,
}

/// One plant's part in a pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Party<'a> {
    /// The nodes as this plant sees them: its root at the origin, itself one high.
    pub(super) nodes: &'a Nodes,
    /// The nodes of its structure; no two parties have one in common.
    pub(super) sources: &'a [PathSource],
    /// How its guiding vectors turn.
    pub(super) guide: &'a Guide,
    /// Unit vector towards the light, times how strongly vectors bend to it at a hop.
    pub(super) light: Vec3,
    /// Address of its randomness.
    pub(super) seed: Seed,
}

/// The least-cost paths of one pass.
#[derive(Clone, Debug)]
pub(super) struct Paths {
    costs: Vec<f32>,
    /// The node before each; itself at a source, [`NONE`] where nothing leads.
    before: Vec<u32>,
    finalized: Vec<bool>,
    states: Vec<State>,
}

impl Paths {
    /// Finds the paths of one plant, see [`find_among`](Self::find_among).
    #[cfg(test)]
    pub(super) fn find(
        nodes: &Nodes,
        graph: &Edges,
        sources: &[PathSource],
        targets: &[u32],
        guide: &Guide,
        seed: Seed,
    ) -> Self {
        let party = Party { nodes, sources, guide, light: Vec3::ZERO, seed };
        Self::find_among(graph, &[party], targets)
    }

    /// Finds the paths from the sources of all parties to all targets, and stops when every target that can be reached
    /// is. A node belongs to the party that reaches it at the least cost, in lengths of the first. At most 255 parties.
    ///
    /// `n log n` in the nodes finalized until then.
    pub(super) fn find_among(graph: &Edges, parties: &[Party<'_>], targets: &[u32]) -> Self {
        let count = graph.edges.len();
        let blank = State { source: NONE, hops: 0.0, vector: Vec3::Y };
        let mut paths = Self {
            costs: vec![f32::INFINITY; count],
            before: vec![NONE; count],
            finalized: vec![false; count],
            states: vec![blank; count],
        };
        let Some(first) = parties.first() else { return paths };
        let mut frontier = Frontier::default();
        let mut leans = vec![0.0_f32; count];
        // Which party a source belongs to.
        let mut owners = vec![0_u8; count];
        for (p, party) in parties.iter().enumerate() {
            for &PathSource { node, vector, lean, closed } in party.sources {
                let i = node as usize;
                leans[i] = lean;
                owners[i] = p as u8;
                paths.costs[i] = 0.0;
                paths.before[i] = node;
                paths.states[i] = State { source: node, hops: 0.0, vector };
                paths.finalized[i] = closed;
                if !closed {
                    frontier.push(0.0, node);
                }
            }
        }
        let mut wanted = vec![false; count];
        for &t in targets {
            wanted[t as usize] = true;
        }
        let mut missing = wanted.iter().filter(|&&w| w).count();
        let whims: Vec<Seed> = parties.iter().map(|party| party.seed.child("whim")).collect();
        while let Some(node) = frontier.pop() {
            let i = node as usize;
            if paths.finalized[i] {
                continue;
            }
            let (here, before) = (first.nodes.at(node), paths.before[i]);
            if before != node {
                let mut state = paths.states[before as usize];
                let owner = usize::from(owners[state.source as usize]);
                let party = &parties[owner];
                let from = first.nodes.at(before);
                let length = here.distance(from);
                let edge = ((here - from) / length.max(f32::MIN_POSITIVE)).normalize_or(Vec3::Y);
                // Where the graph is finer than its parameters say, an edge is a part of a hop.
                let share = if first.nodes.hop > 0.0 { (length / first.nodes.hop).min(1.0) } else { 1.0 };
                state.hops += share;
                let hops = (state.hops - 1e-3).ceil() as u32;
                // Only sources lean, and only on the first hop.
                let lean = if hops <= 1 { leans[state.source as usize] } else { 0.0 };
                let (vector, source) = (state.vector, state.source);
                let step = Step {
                    vector,
                    edge,
                    position: party.nodes.at(node),
                    hops,
                    source,
                    source_height: party.nodes.at(source).y,
                    node,
                    lean,
                };
                let turned = step.turned(party.guide, party.seed);
                state.vector = towards(vector, turned, share);
                if party.light != Vec3::ZERO {
                    state.vector = (state.vector + party.light * share).normalize_or(state.vector);
                }
                paths.states[i] = state;
            }
            paths.finalized[i] = true;
            if wanted[i] {
                missing -= 1;
                if missing == 0 {
                    break;
                }
            }
            let State { vector, source, .. } = paths.states[i];
            let whim = whims[usize::from(owners[source as usize])];
            for target in graph.leaving(node) {
                // A finalized node costs no more than this one, so it is never improved. The whim is drawn last: most
                // nodes cannot be improved even by the least.
                let best = paths.costs[target as usize];
                if best <= paths.costs[i] {
                    continue;
                }
                let weight = weight(first.nodes.at(target) - here, vector);
                if paths.costs[i] + weight * (1.0 - WHIM) >= best {
                    continue;
                }
                let cost = paths.costs[i] + weight * (1.0 + WHIM * (2.0 * whim.at(u64::from(target)).unit() - 1.0));
                if cost < best {
                    paths.costs[target as usize] = cost;
                    paths.before[target as usize] = node;
                    frontier.push(cost, target);
                }
            }
        }
        paths
    }

    /// The cost of every node; infinite where no path leads.
    pub(super) fn into_costs(self) -> Vec<f32> {
        self.costs
    }

    /// Whether a path leads to a node.
    pub(super) fn reached(&self, node: u32) -> bool {
        self.finalized[node as usize]
    }

    /// The node before this one on its path; itself in the structure.
    pub(super) fn before(&self, node: u32) -> u32 {
        self.before[node as usize]
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

/// The unit vector a share of the way from one to another.
fn towards(from: Vec3, to: Vec3, share: f32) -> Vec3 {
    if share >= 1.0 { to } else { from.lerp(to, share).normalize_or(from) }
}

/// `d (1 + LENGTH - e·v)`, with rounding kept from going below zero.
fn weight(edge: Vec3, vector: Vec3) -> f32 {
    (edge.length() * (1.0 + LENGTH) - edge.dot(vector)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::grow::obstacle::Obstacles;

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
        let graph = Edges::given(edges);
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
        let graph = Edges::yao(&nodes, &Obstacles::default());
        let far = node_at(&nodes, Vec3::Y * 9.0);
        let source = [PathSource { node: nodes.root, vector: Vec3::Y, lean: 0.0, closed: false }];
        let paths = Paths::find(&nodes, &graph, &source, &[far], &STRAIGHT, Seed::new(1));
        assert!(!paths.reached(far) && paths.reached(node_at(&nodes, Vec3::Y)));
    }

    #[test]
    fn costs_are_those_of_bellman_and_ford_where_vectors_do_not_turn() {
        let nodes = Nodes::scatter(400, 0.8, Seed::new(6));
        let graph = Edges::yao(&nodes, &Obstacles::default());
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
                    let whim = 1.0 + WHIM * (2.0 * Seed::new(1).child("whim").at(u64::from(j)).unit() - 1.0);
                    let cost = costs[i as usize] + weight(nodes.at(j) - nodes.at(i), Vec3::Y) * whim;
                    if cost < costs[j as usize] {
                        costs[j as usize] = cost;
                        changed = true;
                    }
                }
            }
        }
        assert_eq!(paths.costs, costs);
    }
}
