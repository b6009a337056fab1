//! Thick shells: axes through the middles of layers, for pieces that a contraction leaves askew.
//!
//! A trunk about as thick as high, a stump, or a bole with roots has no length to contract along: the Laplacian draws it to
//! where most of its vertices are, and what was the foot is somewhere in a tube that leans. So such a piece is cut into
//! layers of equal distance from its foot, over the surface, and its axis goes through the middles of the rounds between
//! them (Verroust and Lazarus 2000, "Extracting Skeletal Curves from 3D Scattered Data"; the graph of the layers is that of
//! Reeb). Distances run across the triangles, not along edges alone, and a layer's border cuts through them, so that a trunk of
//! two rings of vertices has as many layers as one of twenty.
//!
//! Past the paper: the foot is all that is lowest, not a point, so that layers of a flared trunk are level; and a round's
//! radius is that of the disc of its area, which the ridges of a flute or the neck of a fork say little about. And a round
//! inside another of its layer is the inner skin of a wall, as of a hollow trunk: both are one.
//!
//! Limits: pieces of at most [`MOST_TRIANGLES`]; a limb that hangs to the ground is a foot of its own. Whether a piece's layers
//! or its contraction is its limb is for `fit` to say.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::surface::Surface;
use super::weld::root;
use crate::source::import::limb::{Limb, LimbNode};

/// Most triangles of a piece that is cut into layers.
pub(super) const MOST_TRIANGLES: usize = 20_000;
/// Layers from the foot to what is farthest from it.
const LAYERS: f64 = 32.0;
/// Shares of the height that may be foot: a trunk that is cut level needs next to none, one that is cut askew or stands on
/// roots of all heights more.
pub(super) const FEET: [f64; 3] = [0.03, 0.1, 0.2];
/// Most stretches of a limb: a piece of more is no thick one.
const MOST_STRETCHES: usize = 4_000;
/// How far from the middle of a round, in its radii, that of one inside it lies at most.
const NESTED: f64 = 0.7;
/// Rounds of a layer, the widest first, in which others are sought.
const MOST_AROUND: usize = 32;
/// Passes of pruning: a spur on a spur goes with the second.
const PASSES: usize = 4;
/// Places on an edge from which the distance of the corner across is sought.
const PLACES: u32 = 8;
/// How far a branch must come out of the wood that bears it, in radii of that.
const OUT: f64 = 1.3;
/// How far beside the axis, in radii of the last round, the farthest place of a blunt end lies.
const BLUNT: f64 = 0.5;
/// Radius of a pointed end, a share of that of the last round.
const POINT: f64 = 0.2;

/// The limb of a piece whose foot is a share of its height, where it is lowest along `up`; none where it has no layers.
pub(super) fn limb(surface: &Surface, up: DVec3, share: f64) -> Option<Limb> {
    let height = |v: usize| surface.positions[v].dot(up);
    let all = 0..surface.positions.len();
    let (low, high) = all.clone().map(height).fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
    let foot: Vec<u32> = all.filter(|&v| height(v) <= low + (high - low) * share).map(|v| v as u32).collect();
    let far = distances(surface, &foot);
    let most = far.iter().copied().fold(0.0, f64::max);
    if !most.is_finite() || most <= 0.0 {
        return None;
    }
    let cut = Cut::new(surface, &far, most / LAYERS);
    let mut graph = cut.graph(surface, &far, up, low)?;
    graph.open_rounds();
    for _ in 0..PASSES {
        if !graph.prune() {
            break;
        }
    }
    let limb = graph.limb();
    (1..=MOST_STRETCHES).contains(&limb.edges.len()).then_some(limb)
}

/// A distance, as a heap has it: the least first, then the first vertex.
#[derive(PartialEq)]
struct Reached(f64, u32);

impl Eq for Reached {}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

/// How far each vertex is from the nearest of some, over the surface: along edges, and straight across triangles from places
/// on the side that was reached.
fn distances(surface: &Surface, from: &[u32]) -> Vec<f64> {
    let at = |v: u32| surface.positions[v as usize];
    let mut on: Vec<Vec<u32>> = vec![Vec::new(); surface.positions.len()];
    for (i, t) in surface.triangles.iter().enumerate() {
        t.iter().for_each(|&v| on[v as usize].push(i as u32));
    }
    let mut far = vec![f64::INFINITY; surface.positions.len()];
    let mut done = vec![false; surface.positions.len()];
    let mut next: BinaryHeap<Reverse<Reached>> = BinaryHeap::new();
    for &v in from {
        far[v as usize] = 0.0;
        next.push(Reverse(Reached(0.0, v)));
    }
    while let Some(Reverse(Reached(_, v))) = next.pop() {
        if std::mem::replace(&mut done[v as usize], true) {
            continue;
        }
        for &t in &on[v as usize] {
            let t = surface.triangles[t as usize];
            for k in 0..3 {
                let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                if done[c as usize] || (a != v && b != v) {
                    continue;
                }
                // From the other end, too, where that was reached; from this one alone elsewhere.
                let ends = [a, b].map(|e| if done[e as usize] { e } else { v });
                let best = (0..=PLACES).map(|i| {
                    let s = f64::from(i) / f64::from(PLACES);
                    let [x, y] = ends.map(|e| far[e as usize]);
                    x + (y - x) * s + at(ends[0]).lerp(at(ends[1]), s).distance(at(c))
                });
                let best = best.fold(f64::INFINITY, f64::min);
                if best < far[c as usize] {
                    far[c as usize] = best;
                    next.push(Reverse(Reached(best, c)));
                }
            }
        }
    }
    far
}

/// A surface cut into layers: what of it hangs together in each, and the rounds between them.
struct Cut {
    /// For each triangle, the number of its part in the first layer that it is in; parts of the next follow.
    first: Vec<u32>,
    /// For each vertex the layer that it is in.
    layer: Vec<u32>,
    /// For each part of a triangle, the first of the parts that it hangs together with.
    region: Vec<u32>,
    rounds: Vec<Round>,
}

/// The border between two layers, as far as it is one.
struct Round {
    border: u32,
    middle: DVec3,
    radius: f64,
    /// The regions on either side.
    below: u32,
    above: u32,
}

/// A place where an edge crosses the border of two layers.
#[derive(Clone)]
struct Crossing {
    place: DVec3,
    /// The crossings beside it on each of the edge's triangles.
    beside: [u32; 2],
    border: u32,
    /// The part of a triangle below.
    below: u32,
}

const NONE: u32 = u32::MAX;

impl Cut {
    fn new(surface: &Surface, far: &[f64], step: f64) -> Self {
        let layer: Vec<u32> = far.iter().map(|f| (f / step) as u32).collect();
        let span = |vertices: &[u32]| {
            let layers = vertices.iter().map(|&v| layer[v as usize]);
            layers.fold((u32::MAX, 0), |(low, high), l| (low.min(l), high.max(l)))
        };
        let mut first = Vec::with_capacity(surface.triangles.len());
        let mut parts = 0;
        for t in &surface.triangles {
            first.push(parts);
            let (low, high) = span(t);
            parts += high - low + 1;
        }
        let part = |t: u32, layer: u32| first[t as usize] + layer - span(&surface.triangles[t as usize]).0;
        let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(surface.triangles.len() * 3);
        for (t, &[a, b, c]) in surface.triangles.iter().enumerate() {
            sides.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], t as u32)));
        }
        sides.sort_unstable();
        let mut region: Vec<u32> = (0..parts).collect();
        let mut crossings: Vec<Crossing> = Vec::new();
        // For each triangle, those on its sides: which border, and which crossing.
        let mut on: Vec<Vec<(u32, u32)>> = vec![Vec::new(); surface.triangles.len()];
        for run in sides.chunk_by(|a, b| a.0 == b.0) {
            let [a, b] = run[0].0;
            let (low, high) = span(&[a, b]);
            for layer in low..=high {
                for pair in run.windows(2) {
                    let [x, y] = [pair[0].1, pair[1].1].map(|t| root(&mut region, part(t, layer)));
                    region[x.max(y) as usize] = x.min(y);
                }
            }
            for border in low + 1..=high {
                let (x, y) = (far[a as usize], far[b as usize]);
                let s = ((f64::from(border) * step - x) / (y - x)).clamp(0.0, 1.0);
                let place = surface.positions[a as usize].lerp(surface.positions[b as usize], s);
                run.iter().for_each(|&(_, t)| on[t as usize].push((border, crossings.len() as u32)));
                crossings.push(Crossing { place, beside: [NONE; 2], border, below: part(run[0].1, border - 1) });
            }
        }
        for list in &mut on {
            list.sort_unstable();
            for pair in list.chunk_by(|a, b| a.0 == b.0) {
                let [(_, x), (_, y)] = *pair else { continue };
                for (one, other) in [(x, y), (y, x)] {
                    let beside = &mut crossings[one as usize].beside;
                    beside[usize::from(beside[0] != NONE)] = other;
                }
            }
        }
        for part in 0..parts {
            region[part as usize] = root(&mut region, part);
        }
        let rounds = rounds(&crossings).into_iter().map(|round| {
            let (middle, radius) = disc(&round.iter().map(|&c| crossings[c as usize].place).collect::<Vec<_>>());
            let Crossing { border, below, .. } = crossings[round[0] as usize];
            // The part above is the next of the same triangle.
            Round { border, middle, radius, below: region[below as usize], above: region[below as usize + 1] }
        });
        let rounds = rounds.collect();
        Self { first, layer, region, rounds }
    }

    /// For each round the one that it is inside of, or itself.
    fn around(&self) -> Vec<u32> {
        let mut around: Vec<u32> = (0..self.rounds.len() as u32).collect();
        let mut order = around.clone();
        let round = |i: u32| &self.rounds[i as usize];
        order.sort_by(|&a, &b| {
            let wider = round(b).radius.total_cmp(&round(a).radius);
            round(a).border.cmp(&round(b).border).then(wider).then(a.cmp(&b))
        });
        for layer in order.chunk_by(|&a, &b| round(a).border == round(b).border) {
            for (k, &i) in layer.iter().enumerate() {
                let holds = |j: &&u32| {
                    around[**j as usize] == **j
                        && round(**j).middle.distance(round(i).middle) < round(**j).radius * NESTED
                };
                if let Some(&j) = layer[..k.min(MOST_AROUND)].iter().find(holds) {
                    around[i as usize] = j;
                }
            }
        }
        around
    }

    /// The rounds, linked where a region lies between them, with an end wherever there is none.
    fn graph(&self, surface: &Surface, far: &[f64], up: DVec3, low: f64) -> Option<Graph> {
        if self.rounds.is_empty() {
            return None;
        }
        let mut graph = Graph::default();
        graph.nodes.extend(self.rounds.iter().map(|r| LimbNode { position: r.middle, radius: r.radius }));
        // The farthest vertex of each region: of a triangle's corner, the part in its own layer.
        let mut tips = vec![NONE; self.region.len()];
        for (t, corners) in surface.triangles.iter().enumerate() {
            let lowest = corners.iter().map(|&v| self.layer[v as usize]).min()?;
            for &v in corners {
                let part = self.first[t] + self.layer[v as usize] - lowest;
                let tip = &mut tips[self.region[part as usize] as usize];
                if *tip == NONE || (far[v as usize], Reverse(v)) > (far[*tip as usize], Reverse(*tip)) {
                    *tip = v;
                }
            }
        }
        let around = self.around();
        let mut beside: Vec<(u32, u32)> = Vec::new();
        for (i, round) in self.rounds.iter().enumerate() {
            beside.extend([(round.below, i as u32), (round.above, i as u32)]);
        }
        beside.sort_unstable();
        for run in beside.chunk_by(|a, b| a.0 == b.0) {
            let region = run[0].0;
            let thicker = |a: u32, b: u32| {
                if graph.nodes[b as usize].radius > graph.nodes[a as usize].radius { b } else { a }
            };
            let hub = run.iter().map(|r| around[r.1 as usize]).reduce(thicker)?;
            let LimbNode { position, radius } = graph.nodes[hub as usize];
            let is_first = run.iter().all(|r| self.rounds[r.1 as usize].below == region);
            let is_last = run.iter().all(|r| self.rounds[r.1 as usize].above == region);
            graph.edges.extend(run.iter().map(|r| [hub, around[r.1 as usize]]).filter(|[a, b]| a != b));
            if run.iter().all(|r| around[r.1 as usize] != r.1) {
                // The end of an inner skin is none of the tree's.
            } else if is_first {
                graph.end(hub, LimbNode { position: position - up * (position.dot(up) - low), radius });
            } else if is_last && tips[region as usize] != NONE {
                graph.tips.push((hub, surface.positions[tips[region as usize] as usize]));
            }
        }
        Some(graph)
    }
}

/// Crossings in order, a border at a time; those of open ones from end to end.
fn rounds(crossings: &[Crossing]) -> Vec<Vec<u32>> {
    let mut seen = vec![false; crossings.len()];
    let mut rounds = Vec::new();
    for is_end in [true, false] {
        for start in 0..crossings.len() {
            if seen[start] || (is_end && crossings[start].beside[1] != NONE) {
                continue;
            }
            let mut round = Vec::new();
            let mut at = start as u32;
            loop {
                seen[at as usize] = true;
                round.push(at);
                match crossings[at as usize].beside.into_iter().find(|&c| c != NONE && !seen[c as usize]) {
                    Some(on) => at = on,
                    None => break,
                }
            }
            rounds.push(round);
        }
    }
    rounds
}

/// Middle of a round's outline, and the radius of the disc of its area.
fn disc(round: &[DVec3]) -> (DVec3, f64) {
    let sides = || (0..round.len()).map(|k| (round[k], round[(k + 1) % round.len()]));
    let (mut middle, mut outline, mut area) = (DVec3::ZERO, 0.0, DVec3::ZERO);
    for (a, b) in sides() {
        middle += (a + b) * (0.5 * a.distance(b));
        outline += a.distance(b);
        area += (a - round[0]).cross(b - round[0]) * 0.5;
    }
    let middle = if outline > 0.0 { middle / outline } else { round[0] };
    (middle, (area.length() / std::f64::consts::PI).sqrt())
}

/// Rounds and ends, and what lies between them.
#[derive(Default)]
struct Graph {
    nodes: Vec<LimbNode>,
    edges: Vec<[u32; 2]>,
    /// For rounds that nothing follows, the place that is farthest on.
    tips: Vec<(u32, DVec3)>,
    links: Vec<Vec<u32>>,
}

impl Graph {
    fn end(&mut self, at: u32, node: LimbNode) {
        self.edges.push([at, self.nodes.len() as u32]);
        self.nodes.push(node);
    }

    /// Keeps a spanning tree, thick wood first, and puts an end to what nothing follows.
    fn open_rounds(&mut self) {
        let thin = |e: &[u32; 2]| self.nodes[e[0] as usize].radius.min(self.nodes[e[1] as usize].radius);
        let mut edges = self.edges.clone();
        edges.sort_by(|x, y| thin(y).total_cmp(&thin(x)).then(x.cmp(y)));
        let mut sets: Vec<u32> = (0..self.nodes.len() as u32).collect();
        let tree = edges.into_iter().filter(|&[a, b]| {
            let (x, y) = (root(&mut sets, a), root(&mut sets, b));
            sets[x as usize] = y;
            x != y
        });
        self.edges = tree.collect();
        for (at, tip) in std::mem::take(&mut self.tips) {
            let LimbNode { position, radius } = self.nodes[at as usize];
            let before = self.edges.iter().find_map(|&[a, b]| if b == at { Some(a) } else { (a == at).then_some(b) });
            let along = before.and_then(|b| (position - self.nodes[b as usize].position).try_normalize());
            let along = along.or_else(|| (tip - position).try_normalize()).unwrap_or(DVec3::Y);
            let ahead = (tip - position).dot(along);
            let beside = (tip - position - along * ahead).length();
            if ahead <= 0.0 {
                continue;
            }
            // A blunt end is farthest at its rim.
            if beside > radius * BLUNT {
                self.end(at, LimbNode { position: position + along * ahead, radius });
            } else {
                self.end(at, LimbNode { position: tip, radius: radius * POINT });
            }
        }
        self.links = vec![Vec::new(); self.nodes.len()];
        for &[a, b] in &self.edges {
            self.links[a as usize].push(b);
            self.links[b as usize].push(a);
        }
    }

    /// Takes off the branches that don't come out of the wood which bears them, the least first, but no way on that is the
    /// last; whether there was any.
    fn prune(&mut self) -> bool {
        let at = |v: u32| self.nodes[v as usize];
        let spur = |end: u32| {
            let mut branch = vec![end];
            let mut on = *self.links[end as usize].first()?;
            while self.links[on as usize].len() == 2 {
                let before = branch[branch.len() - 1];
                branch.push(on);
                on = *self.links[on as usize].iter().find(|&&n| n != before)?;
            }
            let is_fork = self.links[on as usize].len() > 2;
            let reach = branch.iter().map(|&v| at(v).position.distance(at(on).position) + at(v).radius * 0.5);
            let reach = reach.fold(0.0, f64::max) / at(on).radius.max(f64::MIN_POSITIVE);
            (is_fork && reach < OUT).then_some((reach, on, branch))
        };
        let ends = (0..self.links.len() as u32).filter(|&v| self.links[v as usize].len() == 1);
        let mut spurs: Vec<_> = ends.filter_map(spur).collect();
        spurs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2[0].cmp(&b.2[0])));
        let any = !spurs.is_empty();
        for (_, fork, branch) in spurs {
            if self.links[fork as usize].len() > 2 {
                let last = branch[branch.len() - 1];
                self.links[fork as usize].retain(|&n| n != last);
                branch.into_iter().for_each(|v| self.links[v as usize].clear());
            }
        }
        any
    }

    fn limb(&self) -> Limb {
        let mut limb = Limb::default();
        let mut name = vec![NONE; self.nodes.len()];
        for (v, name) in name.iter_mut().enumerate().filter(|(v, _)| !self.links[*v].is_empty()) {
            *name = limb.nodes.len() as u32;
            limb.nodes.push(self.nodes[v]);
        }
        for (a, near) in self.links.iter().enumerate() {
            let later = near.iter().filter(|&&b| b as usize > a);
            limb.edges.extend(later.map(|&b| [name[a], name[b as usize]]));
        }
        limb
    }
}

#[cfg(test)]
mod tests {
    use super::super::cap::closed;
    use super::super::shapes;
    use super::*;

    #[test]
    fn the_layers_of_a_tube_lie_on_its_axis_however_few_rings_it_has() {
        let path = [DVec3::ZERO, DVec3::new(0.5, 3.0, 0.0)];
        let tube = closed(&shapes::tube(&path, &[1.0, 0.8], 12));
        let limb = limb(&tube, DVec3::Y, FEET[1]).unwrap();
        assert!(limb.nodes.len() > 20, "{}", limb.nodes.len());
        assert!(limb.links().iter().all(|links| links.len() <= 2));
        for node in limb.nodes.iter().filter(|n| (0.5..2.5).contains(&n.position.y)) {
            let t = node.position.y / 3.0;
            let beside = node.position.distance(path[0].lerp(path[1], t));
            assert!(beside < 0.1 && (node.radius - (1.0 - 0.2 * t)).abs() < 0.1, "{node:?}");
        }
    }

    #[test]
    fn a_hollow_trunk_has_one_axis_and_its_outer_radius() {
        // Down the inner skin and up the outer one.
        let inner = [3.0, 2.0, 1.0, 0.5].map(|y| (y, 0.6));
        let outer = [0.5, 1.0, 2.0, 3.0].map(|y| (y, 1.0));
        let mut wall = Surface::default();
        for (k, (y, radius)) in (0_u32..).zip(inner.into_iter().chain(outer)) {
            for s in 0..12 {
                let angle = f64::from(s) / 12.0 * std::f64::consts::TAU;
                wall.positions.push(DVec3::new(libm::cos(angle) * radius, y, libm::sin(angle) * radius));
                let (a, b) = (k * 12 + s, k * 12 + (s + 1) % 12);
                if k < 7 {
                    wall.triangles.extend([[a, b, b + 12], [a, b + 12, a + 12]]);
                }
            }
        }
        let limb = limb(&wall, DVec3::Y, FEET[1]).unwrap();
        assert!(limb.links().iter().all(|links| links.len() <= 2));
        assert!(limb.nodes.iter().all(|n| n.position.with_y(0.0).length() < 0.1), "{:?}", limb.nodes);
        let inner = limb.nodes.iter().filter(|n| (n.radius - 1.0).abs() > 0.1).count();
        assert!(inner <= 1, "{:?}", limb.nodes);
    }

    #[test]
    fn distances_run_straight_across_triangles() {
        // A square of four, from one side to the other.
        let positions = [[0., 0.], [0., 1.], [1., 0.5], [2., 0.], [2., 1.]];
        let positions = positions.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
        let triangles = vec![[0, 2, 1], [0, 3, 2], [3, 4, 2], [4, 1, 2]];
        let far = distances(&Surface { positions, triangles }, &[0, 1]);
        assert_eq!(far[..3], [0.0, 0.0, 1.0]);
        assert!((far[3] - 2.0).abs() < 0.01 && far[3] == far[4], "{far:?}");
    }
}
