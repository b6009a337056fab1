//! Finer ways: every branch takes its course anew through nodes that are closer together than the graph's.
//!
//! The paper's largest limit is the resolution of its graph: with 150,000 nodes a path from the ground to the top has
//! hardly 50 edges, and an even graph that is twice as fine takes eight times the nodes, nearly all of which no branch
//! comes near (2015, 4). Here the even graph decides which branches there are and where they end. Then density follows
//! the tree: only along the branches are there finer nodes, `detail` times closer together, and each branch finds its way
//! through those once more, by the same weights and guiding vectors. Angles a hop mean the same lengths as before, an edge
//! of these nodes being a part of a hop, or of two, so a species keeps its shape.
//!
//! What keeps branches apart in the graph is that paths share no node. So it is here: a finer node belongs to the branch
//! that is nearest to it, and to no other ([`WIDE`] discs around it at most), and a branch's own nodes of the graph are
//! among them. A branch leaves its bearer at the node of the bearer's finer course from which its way is the cheapest, among
//! those within a hop of where it left it before. Branches of one generation need nothing of each other and are found in
//! parallel.
//!
//! Limits: which branches there are is as coarse as the graph. Time and memory are linear in the wood's length times
//! `detail`, but for the finer points themselves, of which all in the tree's box are looked at.

use glam::Vec3;
use rayon::prelude::*;

use super::grid::{Boxes, Lattice};
use super::guide;
use super::nodes::Nodes;
use super::paths::{State, Stepping, Turning, weight};
use super::region::Region;
use super::space::Patch;
use super::structure::Structure;
use super::tile::{Layer, tile};
use super::way::{self, Entry, Spot};
use crate::base::Seed;
use crate::preset::plan::GrowParams;

/// Finer nodes are at most this many of their discs from their branch.
const WIDE: f32 = 1.5;
/// How much closer together they are than `detail` says: between few nodes edges are longer than between many. Measured.
const CLOSER: f32 = 0.88;
/// And at least this many from the graph's nodes on it.
const APART: f32 = 0.7;

/// The axes of a plant before they are smoothed: its root at the origin, itself about one high.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ways {
    pub(super) places: Vec<Vec3>,
    /// Parents before children; the root is its own.
    pub(super) parents: Vec<u32>,
    /// How high the ways of the first pass reach: no clear bole ends above it.
    pub(super) first: f32,
    /// Edges in a hop of the graph.
    pub(super) fine: f32,
    /// How many finer nodes there were to choose from.
    pub(super) finer: usize,
}

impl Ways {
    /// The axes of a structure along the edges of its graph.
    pub(super) fn of(structure: &Structure, nodes: &Nodes) -> Self {
        let places = structure.members.iter().map(|m| nodes.at(m.node)).collect();
        let parents = structure.members.iter().map(|m| m.parent).collect();
        Self { places, parents, first: structure.first(nodes), fine: 1.0, finer: 0 }
    }
}

/// A plant whose axes are refined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planned<'a> {
    pub(super) params: &'a GrowParams,
    pub(super) structure: &'a Structure,
    /// The nodes as the plant sees them.
    pub(super) nodes: &'a Nodes,
    /// Address of the randomness of each pass, by its number.
    pub(super) seeds: &'a [Seed],
    /// Unit vector towards the light, times how strongly vectors bend to it at a hop.
    pub(super) light: Vec3,
}

/// One way of a plant's structure.
struct Run<'a> {
    plant: usize,
    turning: Turning<'a>,
    pass: usize,
    /// The member that it leaves, and its own.
    from: u32,
    members: std::ops::Range<u32>,
    /// The run that the member belongs to that it leaves; none at the root.
    bearer: Option<u32>,
    /// Runs on the way to the root.
    generation: u32,
}

/// A run's finer course.
#[derive(Clone, Debug, Default)]
struct Course {
    /// Where on its bearer's it begins; of no meaning at the root.
    begin: u32,
    places: Vec<Vec3>,
    vectors: Vec<Vec3>,
}

/// The axes of plants that share a graph, `detail` times finer than its edges; in each plant's own lengths.
pub(super) fn refined(graph: &Patch, plants: &[Planned<'_>], detail: f32) -> Vec<Ways> {
    let nodes = &graph.space.nodes;
    let runs = runs(plants);
    let disc = nodes.disc / detail * CLOSER;
    let spots = spots(graph, plants, &runs, disc);
    let scale = Scale { disc, hop: nodes.hop(), region: &graph.region, nodes };
    let mut courses: Vec<Course> = vec![Course::default(); runs.len()];
    let last = runs.iter().map(|run| run.generation).max().unwrap_or(0);
    let mut generations: Vec<Vec<u32>> = vec![Vec::new(); last as usize + 1];
    for (r, run) in runs.iter().enumerate() {
        generations[run.generation as usize].push(r as u32);
    }
    for generation in generations {
        let found: Vec<Course> = generation
            .par_iter()
            .with_min_len(16)
            .map(|&r| {
                let run = &runs[r as usize];
                let bearer = run.bearer.map(|b| &courses[b as usize]);
                scale.course(&plants[run.plant], run, bearer, &spots[r as usize])
            })
            .collect();
        for (r, course) in generation.into_iter().zip(found) {
            courses[r as usize] = course;
        }
    }
    plants.iter().enumerate().map(|(p, plant)| joined(p, plant, nodes, &runs, &courses, &spots, detail)).collect()
}

/// The runs of all plants.
fn runs<'a>(plants: &[Planned<'a>]) -> Vec<Run<'a>> {
    let mut runs: Vec<Run<'a>> = Vec::new();
    for (plant, &Planned { params, structure, seeds, light, .. }) in plants.iter().enumerate() {
        let offset = runs.len() as u32;
        let mut holders: Vec<Option<u32>> = vec![None; structure.members.len()];
        for (i, run) in structure.runs.iter().enumerate() {
            let end = structure.runs.get(i + 1).map_or(structure.members.len() as u32, |next| next.first);
            let from = structure.members[run.first as usize].parent;
            let bearer = holders[from as usize];
            let generation = bearer.map_or(0, |b| runs[b as usize].generation + 1);
            holders[run.first as usize..end as usize].fill(Some(offset + i as u32));
            let pass = run.pass as usize;
            let iteration = &params.iterations[pass];
            let turning = Turning::new(&iteration.guide, iteration.axis, light, seeds[pass]);
            runs.push(Run { plant, turning, pass, from, members: run.first..end, bearer, generation });
        }
    }
    runs
}

/// A run's segments: the run, and the ends of one.
struct Segment {
    run: u32,
    /// Which of the run's it is.
    index: u32,
    ends: [Vec3; 2],
    /// From the first end to the second, and one over its length's square.
    along: Vec3,
    inverse: f32,
}

/// The finer nodes of each run, by the run's segments, the graph's own among them.
fn spots(graph: &Patch, plants: &[Planned<'_>], runs: &[Run<'_>], disc: f32) -> Vec<Vec<Spot>> {
    let nodes = &graph.space.nodes;
    let mut segments = Vec::new();
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for (r, run) in runs.iter().enumerate() {
        let members = &plants[run.plant].structure.members;
        for (index, i) in run.members.clone().enumerate() {
            let member = members[i as usize];
            let ends = [nodes.at(members[member.parent as usize].node), nodes.at(member.node)];
            (low, high) = (low.min(ends[0].min(ends[1])), high.max(ends[0].max(ends[1])));
            let along = ends[1] - ends[0];
            let inverse = 1.0 / along.length_squared().max(f32::MIN_POSITIVE);
            segments.push(Segment { run: r as u32, index: index as u32, ends, along, inverse });
        }
    }
    let mut spots: Vec<Vec<Spot>> = vec![Vec::new(); runs.len()];
    for segment in &segments {
        spots[segment.run as usize].push(Spot { at: segment.ends[1], segment: segment.index });
    }
    if segments.is_empty() {
        return spots;
    }
    let wide = WIDE * disc;
    (low, high) = (low - wide, high + wide);
    let lattice = Lattice::covering(low, high, nodes.disc.max((high - low).max_element() / 512.0));
    let around = |s: &Segment| {
        let (a, b) = (s.ends[0].min(s.ends[1]) - wide, s.ends[0].max(s.ends[1]) + wide);
        (lattice.cell(a), lattice.cell(b))
    };
    let near = Boxes::of(&lattice, &segments.iter().map(around).collect::<Vec<_>>());
    let owner = |p: Vec3| {
        let mut best = (wide * wide, u32::MAX);
        for &i in near.at(lattice.index(lattice.cell(p))) {
            let Segment { ends, along, inverse, .. } = &segments[i as usize];
            let off = p - ends[0];
            let t = (off.dot(*along) * inverse).clamp(0.0, 1.0);
            let square = (off - *along * t).length_squared();
            if square < best.0 {
                best = (square, i);
            }
        }
        if best.1 == u32::MAX {
            return None;
        }
        let least = (APART * disc) * (APART * disc);
        let apart = segments[best.1 as usize].ends.iter().all(|end| end.distance_squared(p) >= least);
        (apart && graph.region.holds(p)).then_some(best.1)
    };
    let density = tile().density(disc);
    let layer = Layer::new(tile().edge(density), graph.seed.child("fine"));
    for (at, i) in layer.points(low, high, owner) {
        let Segment { run, index, .. } = segments[i as usize];
        spots[run as usize].push(Spot { at, segment: index });
    }
    spots.par_iter_mut().with_min_len(64).for_each(|spots| spots.sort_by_key(|spot| spot.segment));
    spots
}

/// Lengths of a graph and its finer nodes, in heights of the first plant.
struct Scale<'a> {
    disc: f32,
    hop: f32,
    region: &'a Region,
    nodes: &'a Nodes,
}

impl Scale<'_> {
    /// The finer course of a run whose bearer's is known.
    fn course(&self, plant: &Planned<'_>, run: &Run<'_>, bearer: Option<&Course>, spots: &[Spot]) -> Course {
        let Planned { params, structure, .. } = *plant;
        let fork = structure.members[run.from as usize].node;
        let (at, foot) = (self.nodes.at(fork), self.nodes.at(plant.nodes.root));
        let share = self.nodes.disc / plant.nodes.disc;
        let seen = |p: Vec3| (p - foot) / share;
        let iteration = &params.iterations[run.pass];
        // What leaves above the clear bole leaves there on a finer course as well; lower it would be a stem of its own.
        let bole = params.bole.min(structure.first(plant.nodes));
        let is_stem = seen(at).y < bole;
        // Where it may begin, and with which vector.
        let entry = |index: u32, at: Vec3, kept: Vec3| {
            let (vector, lean) = guide::start(iteration.start, &iteration.guide, kept, seen(at));
            Entry { index, at, vector, lean }
        };
        let entries: Vec<Entry> = match bearer {
            None => vec![entry(0, at, Vec3::Y)],
            Some(course) => {
                let far = |i: usize| course.places[i].distance_squared(at);
                let is_high = |&i: &usize| seen(course.places[i]).y >= bole;
                let nearest = |may: &dyn Fn(&usize) -> bool| {
                    let places = (0..course.places.len()).filter(|i| may(i));
                    places.min_by(|&a, &b| far(a).total_cmp(&far(b)))
                };
                let nearest = nearest(&|i| is_stem || is_high(i)).or_else(|| nearest(&|_| true)).unwrap_or(0);
                let near = |&i: &usize| i == nearest || (far(i) < self.hop * self.hop && is_high(&i));
                let ids = (0..course.places.len()).filter(near);
                ids.map(|i| entry(i as u32, course.places[i], course.vectors[i])).collect()
            }
        };
        let after = |state: State, from: Vec3, to: Vec3, spot: u32, lean: f32| {
            let edge = to - from;
            let share = (edge.length() / self.hop).min(1.0);
            // A name of its own for what chance decides at a node.
            let node = fork.wrapping_add(spot << 8);
            run.turning.after(state, Stepping { edge, share, lean, node }, || seen(to), || seen(at).y)
        };
        let begin = State { source: fork, hops: 0.0, vector: Vec3::Y };
        let obstacles = self.region.obstacles();
        let barred = |a: Vec3, b: Vec3| !obstacles.is_empty() && obstacles.bar(a, b);
        let weight = |edge: Vec3, vector: Vec3| weight(edge, vector, params.length_cost);
        let way = way::cheapest(&entries, spots, begin, self.disc, &after, &barred, &weight);
        let begin = way.entry;
        let (places, vectors) = way.nodes.into_iter().unzip();
        Course { begin, places, vectors }
    }
}

/// The axes of one plant from the courses of its runs.
fn joined(
    plant: usize,
    planned: &Planned<'_>,
    nodes: &Nodes,
    runs: &[Run<'_>],
    courses: &[Course],
    spots: &[Vec<Spot>],
    detail: f32,
) -> Ways {
    let (foot, share) = (nodes.at(planned.nodes.root), nodes.disc / planned.nodes.disc);
    let mut axes = Ways {
        places: vec![Vec3::ZERO],
        parents: vec![0],
        first: planned.structure.first(planned.nodes),
        fine: detail,
        finer: 0,
    };
    let mut firsts = vec![0_u32; runs.len()];
    for (r, (run, course)) in runs.iter().zip(courses).enumerate().filter(|(_, (run, _))| run.plant == plant) {
        firsts[r] = axes.places.len() as u32;
        axes.finer += spots[r].len() - run.members.len();
        let mut parent = run.bearer.map_or(0, |bearer| firsts[bearer as usize] + course.begin);
        for place in &course.places {
            axes.parents.push(parent);
            parent = axes.places.len() as u32;
            axes.places.push((*place - foot) / share);
        }
    }
    axes
}
