//! Least-cost paths with guiding vectors that are set on the way (2015, 3.1.2): Dijkstra's algorithm in which
//! finalizing a node fixes its guiding vector, and with it the weights `d (1 - e·v)` of the edges that leave it.
//!
//! One thing is added to the paper's weight: length costs a little ([`Costs::length`]). Where it costs nothing, as in the
//! paper, a twig on the far side of the crown is a whip that comes straight from the foot of the trunk, however many
//! branches it passes; at 0.3 twigs leave nearly at right angles and curl.
//!
//! A weight depends on the path to its node, so this is no shortest-path problem of one fixed graph; but every weight is
//! fixed before it is used and none is negative, so each node is finalized once and its path is a tree's. Equal costs
//! come as the frontier has them.
//!
//! Plants that share a graph would share their ways too, the trunk first. So every pass has whims: a node is a little
//! dearer or cheaper in it ([`Costs::whim`]) than in the next. They have an address of their own, whoever takes part.
//!
//! Several plants grow in one pass. A node belongs to the plant that reaches it at the least cost, so each keeps to its
//! own part of the space as crowns in a stand do, and no two ever share a node.

use std::hint::black_box;

use glam::Vec3;
use rayon::prelude::*;

use super::frontier::Frontier;
use super::guide::{self, Sines, Step};
use super::nodes::Nodes;
use super::yao::{Edges, NONE};
use crate::base::Seed;
use crate::preset::plan::{GrowParams, Guide, GuideAxis, USUAL_LENGTH_COST, USUAL_WHIM};

/// Costs by length below which buckets would be so narrow that nodes are better taken one by one.
const NARROW: f32 = 0.02;

/// What paths of a plant cost beside the paper's weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Costs {
    /// What a unit of length costs on a path that follows its guiding vectors; 0 in the paper.
    pub(super) length: f32,
    /// By how much a node may be dearer or cheaper than what the paper says, as a share; 0 in the paper.
    pub(super) whim: f32,
}

impl Costs {
    /// Where nothing else is told.
    pub(super) const USUAL: Self = Self { length: USUAL_LENGTH_COST, whim: USUAL_WHIM };

    /// Those of a species.
    pub(super) fn of(params: &GrowParams) -> Self {
        Self { length: params.length_cost, whim: params.whim }
    }
}

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
pub(super) struct State {
    /// Where its path leaves the structure.
    pub(super) source: u32,
    /// Edges from there, in hops.
    pub(super) hops: f32,
    pub(super) vector: Vec3,
}

/// How vectors turn along the paths of one plant.
#[derive(Clone, Debug)]
pub(super) struct Turning<'a> {
    pub(super) guide: &'a Guide,
    axis: GuideAxis,
    /// Unit vector towards the light, times how strongly vectors bend to it at a hop.
    pub(super) light: Vec3,
    /// Address of its randomness.
    pub(super) seed: Seed,
    /// What [`guide::asks`] says of the guide.
    asks: (bool, bool),
    sines: Sines,
}

/// A step of a path as a plant's rule sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stepping {
    /// Along the edge.
    pub(super) edge: Vec3,
    /// Which share of a hop the edge is.
    pub(super) share: f32,
    /// What the path's source leans by.
    pub(super) lean: f32,
    /// The node that is reached.
    pub(super) node: u32,
}

impl<'a> Turning<'a> {
    pub(super) fn new(guide: &'a Guide, axis: GuideAxis, light: Vec3, seed: Seed) -> Self {
        Self { guide, axis, light, seed, asks: guide::asks(guide), sines: Sines::new(guide) }
    }

    /// The state after a step; where the node that is reached lies, and how high the path's source, is asked only by rules
    /// that depend on it.
    pub(super) fn after(
        &self,
        state: State,
        step: Stepping,
        position: impl Fn() -> Vec3,
        source_height: impl Fn() -> f32,
    ) -> State {
        let Stepping { edge, share, lean, node } = step;
        let reached = state.hops + share;
        let place = if self.asks.0 { position() } else { Vec3::ZERO };
        let height = if self.asks.1 { source_height() } else { 0.0 };
        let is_set = self.asks.0 && guide::is_set(self.guide, height);
        let (mut vector, mut from) = (state.vector, state.hops);
        // A finer edge may end one hop and begin the next: it turns by its part of each.
        loop {
            let hops = (from + 1e-3) as u32 + 1;
            let to = if (hops as f32) < reached - 1e-3 { hops as f32 } else { reached };
            let step = Step {
                vector,
                edge,
                axis: self.axis,
                position: place,
                hops,
                source: state.source,
                source_height: height,
                node,
                // Only sources lean, and only on the first hop.
                lean: if hops <= 1 { lean } else { 0.0 },
            };
            let turned = step.turned(self.guide, &self.sines, self.seed);
            // A field's vector is that of the place, however short the step to it.
            vector = towards(vector, turned, if is_set { 1.0 } else { to - from });
            if to >= reached {
                break;
            }
            from = to;
        }
        if self.light != Vec3::ZERO {
            vector = (vector + self.light * share).normalize_or(vector);
        }
        State { source: state.source, hops: reached, vector }
    }
}

/// Where a node is and how dear, -1..=1, of what the whims of a plant allow.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
struct Spot {
    at: Vec3,
    whim: f32,
}

/// A node of the bucket that is being finalized.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    node: u32,
    cost: f32,
    at: Vec3,
    vector: Vec3,
    costs: Costs,
}

/// One plant's part in a pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Party<'a> {
    /// The nodes as this plant sees them: its root at the origin, itself one high.
    pub(super) nodes: &'a Nodes,
    /// The nodes of its structure; no two parties have one in common.
    pub(super) sources: &'a [PathSource],
    /// How its guiding vectors turn, and about which axis.
    pub(super) guide: &'a Guide,
    pub(super) axis: GuideAxis,
    /// Unit vector towards the light, times how strongly vectors bend to it at a hop.
    pub(super) light: Vec3,
    /// Address of its randomness.
    pub(super) seed: Seed,
    /// What its paths cost.
    pub(super) costs: Costs,
}

/// The least-cost paths of one pass. Costs are kept by themselves: every neighbour of every finalized node is asked for its
/// cost, most of them for nothing else, and alone they stay near the core where places and states do not.
#[derive(Clone, Debug)]
pub(super) struct Paths {
    costs: Vec<f32>,
    /// The node before each; itself at a source, [`NONE`] where nothing leads.
    before: Vec<u32>,
    /// [`FINAL`] and [`WANTED`].
    marks: Vec<u8>,
    states: Vec<State>,
}

/// A node whose path is known, or through which none may lead.
const FINAL: u8 = 1;
/// A node to which a path is asked for.
const WANTED: u8 = 2;

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
        let axis = GuideAxis::Vector;
        let party = Party { nodes, sources, guide, axis, light: Vec3::ZERO, seed, costs: Costs::USUAL };
        Self::find_among(graph, &[party], targets, None, seed)
    }

    /// Finds the paths from the sources of all parties to all targets, and stops when every target that can be reached
    /// is. A node belongs to the party that reaches it at the least cost, in lengths of the first. At most 255 parties.
    /// Where `ways` are given, paths use those nodes only. `whims` is the address of the pass's whims.
    ///
    /// Linear in the nodes finalized until then, and in how many buckets their costs spread over.
    pub(super) fn find_among(
        graph: &Edges,
        parties: &[Party<'_>],
        targets: &[u32],
        ways: Option<&[bool]>,
        whims: Seed,
    ) -> Self {
        let count = graph.edges.len();
        let blank = State { source: NONE, hops: 0.0, vector: Vec3::Y };
        // One whim for all plants of a pass: they share no node.
        let whims = whims.child("whim");
        let whim = |i: usize| 2.0 * whims.at(i as u64).unit() - 1.0;
        let positions = parties.first().map_or(&[][..], |first| &first.nodes.positions);
        let spot = |(i, &at): (usize, &Vec3)| Spot { at, whim: whim(i) };
        let spots: Vec<Spot> = positions.par_iter().enumerate().with_min_len(4096).map(spot).collect();
        let costs = match ways {
            // What costs less than nothing is never reached more cheaply.
            Some(ways) => ways.iter().map(|&open| if open { f32::INFINITY } else { -1.0 }).collect(),
            None => vec![f32::INFINITY; count],
        };
        let mut paths = Self { costs, before: vec![NONE; count], marks: vec![0; count], states: vec![blank; count] };
        let Some(first) = parties.first() else { return paths };
        // What an edge costs at least, over its length.
        let least = parties.iter().map(|party| party.costs.length * (1.0 - party.costs.whim)).fold(f32::MAX, f32::min);
        let mut frontier = if least < NARROW {
            Frontier::one_by_one(first.nodes.disc * NARROW)
        } else {
            Frontier::new(first.nodes.disc * least * 0.999)
        };
        let mut leans = vec![0.0_f32; count];
        // Which party a source belongs to.
        let mut owners = vec![0_u8; count];
        for (p, party) in parties.iter().enumerate() {
            for &PathSource { node, vector, lean, closed } in party.sources {
                let i = node as usize;
                leans[i] = lean;
                owners[i] = p as u8;
                (paths.costs[i], paths.before[i]) = (0.0, node);
                paths.marks[i] = if closed { FINAL } else { 0 };
                paths.states[i] = State { source: node, hops: 0.0, vector };
                if !closed {
                    frontier.push(0.0, node);
                }
            }
        }
        let mut missing = 0;
        for &t in targets {
            let mark = &mut paths.marks[t as usize];
            missing += usize::from(*mark & WANTED == 0);
            *mark |= WANTED;
        }
        let turnings: Vec<Turning<'_>> =
            parties.iter().map(|party| Turning::new(party.guide, party.axis, party.light, party.seed)).collect();
        let alone = parties.len() == 1;
        // A bucket at a time, in sweeps over what does not depend on each other, so that the waits for memory overlap. Two of them
        // only read ahead, in loops so short that many reads are under way at once; where one branches, it is on what is likely.
        let (mut bucket, mut arrivals, mut steps, mut offers) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        while missing > 0 && frontier.take(&mut bucket) {
            arrivals.clear();
            black_box(bucket.iter().fold(0, |read, &(_, node)| {
                let before = paths.before[node as usize] as usize;
                read ^ spots[node as usize].at.x.to_bits() ^ spots[before].at.x.to_bits() ^ paths.states[before].source
            }));
            for &(cost, node) in bucket.iter().rev() {
                let mark = paths.marks[node as usize];
                // A node is added again whenever it gets cheaper.
                if cost > paths.costs[node as usize] || mark & FINAL != 0 {
                    continue;
                }
                let (at, before) = (spots[node as usize].at, paths.before[node as usize]);
                let state = paths.states[before as usize];
                let owner = if alone { 0 } else { usize::from(owners[state.source as usize]) };
                let vector = if before == node {
                    state.vector
                } else {
                    let nodes = parties[owner].nodes;
                    let lean = if state.hops < 1.0 { leans[state.source as usize] } else { 0.0 };
                    let step = Stepping { edge: at - spots[before as usize].at, share: 1.0, lean, node };
                    let after = turnings[owner].after(state, step, || nodes.at(node), || nodes.at(state.source).y);
                    paths.states[node as usize] = after;
                    after.vector
                };
                paths.marks[node as usize] = mark | FINAL;
                if mark & WANTED != 0 {
                    missing -= 1;
                    if missing == 0 {
                        break;
                    }
                }
                arrivals.push(Arrival { node, cost, at, vector, costs: parties[owner].costs });
            }
            // What is as cheap already stays so, since costs only fall; that is most of the neighbours.
            // Nothing branches here: a wrong guess, and half would be, ends the reading ahead.
            black_box(arrivals.iter().fold(0, |read, arrival| read ^ graph.edges[arrival.node as usize][0]));
            steps.resize(steps.len().max(arrivals.len() * 8 + 1), (0, 0));
            offers.resize(steps.len(), (0.0, 0, 0));
            let mut dearer = 0;
            for (from, &Arrival { node, cost, .. }) in arrivals.iter().enumerate() {
                for target in graph.edges[node as usize] {
                    let target = if target == NONE { node } else { target };
                    steps[dearer] = (from as u32, target);
                    dearer += usize::from(paths.costs[target as usize] > cost);
                }
            }
            let mut cheaper = 0;
            for &(from, target) in &steps[..dearer] {
                let (Arrival { node, cost, at: here, vector, costs }, Spot { at, whim }) =
                    (arrivals[from as usize], spots[target as usize]);
                let cost = cost + weight(at - here, vector, costs.length) * (1.0 + costs.whim * whim);
                offers[cheaper] = (cost, node, target);
                cheaper += usize::from(cost < paths.costs[target as usize]);
            }
            for &(cost, node, target) in &offers[..cheaper] {
                let t = target as usize;
                // In graphs with shorter edges than they say a node may be finalized already; it stays as it is.
                if cost < paths.costs[t] && paths.marks[t] & FINAL == 0 {
                    (paths.costs[t], paths.before[t]) = (cost, node);
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
        self.marks[node as usize] & FINAL != 0
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

/// `d (1 + length - e·v)`, with rounding kept from going below zero.
pub(super) fn weight(edge: Vec3, vector: Vec3, length: f32) -> f32 {
    (edge.length() * (1.0 + length) - edge.dot(vector)).max(0.0)
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
    fn a_finer_way_turns_as_much_a_hop_wherever_its_nodes_lie() {
        let up = |v: Vec3| crate::base::math::angle(Vec3::Y, v).to_degrees();
        let guide = Guide::Piecewise { alpha1: 30_f32.to_radians(), alpha2: 0.0, h0: 1 };
        let start = Vec3::new(1.0, 1.0, 0.0).normalize();
        for share in [0.3, 0.4, 0.55, 0.7, 1.0] {
            let turning = Turning::new(&guide, GuideAxis::Vector, Vec3::ZERO, Seed::new(1));
            let mut state = State { source: 0, hops: 0.0, vector: start };
            while state.hops < 1.5 {
                let step = Stepping { edge: state.vector, share, lean: 0.0, node: 1 };
                state = turning.after(state, step, || Vec3::ZERO, || 0.0);
            }
            assert!((up(state.vector) - 75.0).abs() < 1.0, "{share}: {}", up(state.vector));
        }
        // A field's vectors are those of the place.
        let aside = crate::preset::plan::FieldPart {
            primitive: crate::preset::plan::FieldPrimitive::Uniform { lean: std::f32::consts::FRAC_PI_2, turn: 0.0 },
            weight: 1.0,
            region: crate::preset::plan::FieldRegion::Everywhere,
        };
        let field = Guide::Field { parts: vec![aside] };
        let turning = Turning::new(&field, GuideAxis::Vector, Vec3::ZERO, Seed::new(1));
        let step = Stepping { edge: Vec3::Y, share: 0.4, lean: 0.0, node: 1 };
        let state = turning.after(State { source: 0, hops: 0.0, vector: Vec3::Y }, step, || Vec3::Y, || 0.0);
        assert!((state.vector - Vec3::X).length() < 1e-6, "{}", state.vector);
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
        for costs in [Costs::USUAL, Costs { length: 0.0, whim: 0.0 }, Costs { length: 0.01, whim: 0.9 }] {
            let party = Party {
                nodes: &nodes,
                sources: &source,
                guide: &STRAIGHT,
                axis: GuideAxis::Vector,
                light: Vec3::ZERO,
                seed: Seed::new(1),
                costs,
            };
            let paths = Paths::find_among(&graph, &[party], &all, None, Seed::new(1));
            assert_eq!(paths.into_costs(), bellman_and_ford(&nodes, &graph, costs), "{costs:?}");
        }
    }

    /// Costs of all nodes from the root under upright vectors.
    fn bellman_and_ford(nodes: &Nodes, graph: &Edges, of: Costs) -> Vec<f32> {
        let mut costs = vec![f32::INFINITY; nodes.len()];
        costs[nodes.root as usize] = 0.0;
        let mut changed = true;
        while changed {
            changed = false;
            for i in 0..nodes.len() as u32 {
                for j in graph.leaving(i) {
                    let whim = 1.0 + of.whim * (2.0 * Seed::new(1).child("whim").at(u64::from(j)).unit() - 1.0);
                    let cost = costs[i as usize] + weight(nodes.at(j) - nodes.at(i), Vec3::Y, of.length) * whim;
                    if cost < costs[j as usize] {
                        costs[j as usize] = cost;
                        changed = true;
                    }
                }
            }
        }
        costs
    }

    #[test]
    fn whims_are_those_of_the_pass_whoever_comes_first() {
        // What stands in the way is a party of its own, and has a seed that never changes.
        let nodes = Nodes::scatter(400, 0.8, Seed::new(6));
        let graph = Edges::yao(&nodes, &Obstacles::default());
        let all: Vec<u32> = (0..nodes.len() as u32).collect();
        let node = nodes.nearest(Vec3::new(0.3, 0.5, 0.0));
        let wall = [PathSource { node, vector: Vec3::Y, lean: 0.0, closed: true }];
        let root = [PathSource { node: nodes.root, vector: Vec3::Y, lean: 0.0, closed: false }];
        let party = |sources, seed| Party {
            nodes: &nodes,
            sources,
            guide: &STRAIGHT,
            axis: GuideAxis::Vector,
            light: Vec3::ZERO,
            seed: Seed::new(seed),
            costs: Costs::USUAL,
        };
        let costs = |parties: &[Party<'_>], whims| {
            Paths::find_among(&graph, parties, &all, None, Seed::new(whims)).into_costs()
        };
        let (first, last) = ([party(&wall[..], 0), party(&root[..], 1)], [party(&root[..], 1), party(&wall[..], 0)]);
        assert_eq!(costs(&first, 1), costs(&last, 1));
        assert_ne!(costs(&first, 1), costs(&first, 2));
    }
}
