//! The graph in which plants grow.
//!
//! It does not depend on the plants' seeds, so one serves many plants ([`Graph`]). Where the parameters ask for more detail
//! than an even graph gives, finer nodes come later, along the branches only (`refine`).

use std::sync::Arc;

use glam::Vec3;
use serde::Serialize;

use super::nodes::Nodes;
use super::obstacle::Obstacles;
use super::paths::{Costs, Party, PathSource, Paths};
use super::region::{Column, Region};
use super::solid::Solids;
use super::yao::Edges;
use super::{GrowError, company};
use crate::base::Seed;
use crate::preset::plan::{GrowParams, Guide, GuideAxis, Obstacle};

/// Most nodes of a graph for several plants.
const MOST_SHARED: f32 = 1_000_000.0;

/// The triangles of obstacle files, in the files' own units, by the name that the parameters have.
pub type ObstacleMeshes = std::collections::BTreeMap<String, Vec<[Vec3; 3]>>;

/// Where trees grow: nodes, edges, and how far each node is from the root.
#[derive(Clone, Debug)]
pub(super) struct Space {
    pub(super) nodes: Nodes,
    pub(super) graph: Arc<Edges>,
    /// Fewest edges from the root to each node.
    pub(super) from_root: Vec<u32>,
}

impl Space {
    /// The Yao graph of some nodes without obstacles.
    #[cfg(test)]
    pub(super) fn new(nodes: Nodes) -> Self {
        Self::linked(nodes, &Obstacles::default())
    }

    fn linked(nodes: Nodes, obstacles: &Obstacles) -> Self {
        let graph = Arc::new(Edges::yao(&nodes, obstacles));
        let from_root = graph.hops(&[nodes.root], u32::MAX);
        Self { nodes, graph, from_root }
    }

    /// The space as a plant sees it whose root is that node and which is `share` as tall as the first.
    pub(super) fn seen_from(&self, root: u32, share: f32) -> Self {
        let nodes = self.nodes.seen_from(root, share);
        Self { nodes, graph: self.graph.clone(), from_root: self.graph.hops(&[root], u32::MAX) }
    }

    fn bytes(&self) -> usize {
        self.nodes.bytes() + self.graph.bytes() + size_of_val(self.from_root.as_slice())
    }
}

/// What a graph is made from; equal parameters make equal graphs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GraphParams {
    /// Address of all randomness.
    seed: u64,
    /// In the order in which their plants grow.
    patches: Vec<PatchParams>,
    obstacles: Vec<Obstacle>,
}

/// The part of a graph that some plants of a company share. Its lengths are heights of the first of them, and its origin that of
/// the first plant of all.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct PatchParams {
    /// Who grows here, by number from 0.
    plants: Vec<usize>,
    /// Nodes, about.
    nodes: u32,
    /// Foot along x and z, radius and height of each plant's cylinder.
    columns: Vec<[f32; 4]>,
    clearance: f32,
    /// Heights a metre, where there are obstacles or a foot is elsewhere; else 0.
    per_metre: f32,
}

impl GraphParams {
    /// The graph that a plant starts from.
    ///
    /// # Errors
    ///
    /// When a parameter is out of range or a shape is not there.
    pub fn of(params: &GrowParams, solids: &Solids) -> Result<Self, GrowError> {
        super::checked(params, solids)?;
        Ok(Self::with_heights(params, &super::heights(params, solids)))
    }

    /// As [`of`](Self::of), given how high the plants reach in regions of height 1, the first one's first.
    pub(super) fn with_heights(params: &GrowParams, tops: &[f32]) -> Self {
        let space = &params.space;
        let solid = !space.obstacles.is_empty();
        let patch = |plants: Vec<usize>| {
            let first = company::member(params, plants[0]);
            let unit = first.height / tops[plants[0]];
            let column = |&i: &usize| {
                let (own, [x, z]) = (company::member(params, i), company::stands(params, i));
                let share = own.height / tops[i] / unit;
                [x / unit, z / unit, own.width * 0.5 * share, share]
            };
            PatchParams {
                nodes: first.nodes,
                columns: plants.iter().map(column).collect(),
                plants,
                clearance: if solid { space.clearance / unit } else { 0.0 },
                per_metre: if solid { 1.0 / unit } else { 0.0 },
            }
        };
        Self {
            seed: space.graph_seed,
            patches: company::groups(params, tops).into_iter().map(patch).collect(),
            obstacles: space.obstacles.clone(),
        }
    }
}

impl PatchParams {
    fn region(&self, obstacles: &[Obstacle], meshes: &ObstacleMeshes) -> Result<Region, GrowError> {
        let column = |&[x, z, radius, height]: &[f32; 4]| Column { foot: Vec3::new(x, 0.0, z), radius, height };
        let obstacles = Obstacles::scaled(obstacles, self.clearance, self.per_metre, meshes)?;
        Ok(Region::new(self.columns.iter().map(column).collect(), obstacles))
    }
}

/// A graph for any number of plants with the same [`GraphParams`].
#[derive(Clone, Debug)]
pub struct Graph {
    params: GraphParams,
    patches: Vec<Patch>,
}

/// The part of a graph that some plants share.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// Who grows here, by number from 0.
    pub(super) plants: Vec<usize>,
    pub(super) region: Region,
    pub(super) space: Space,
    /// The nodes where the plants stand, in their order.
    pub(super) roots: Vec<u32>,
    /// Address of its randomness.
    pub(super) seed: Seed,
}

impl Graph {
    /// Scatters and links the nodes. Linear in their number.
    ///
    /// # Errors
    ///
    /// When an obstacle's mesh is not in `meshes`, not finite or too large.
    pub fn new(params: &GraphParams, meshes: &ObstacleMeshes) -> Result<Self, GrowError> {
        let seed = Seed::new(params.seed).child("graph");
        let patch = |of: &PatchParams| {
            let region = of.region(&params.obstacles, meshes)?;
            let (nodes, roots) = Nodes::even(&region, shared(of.nodes, &region), seed);
            let space = Space::linked(nodes, region.obstacles());
            Ok(Patch { plants: of.plants.clone(), region, space, roots, seed })
        };
        let patches = params.patches.iter().map(patch).collect::<Result<_, GrowError>>()?;
        Ok(Self { params: params.clone(), patches })
    }

    /// What it was made from.
    #[must_use]
    pub fn params(&self) -> &GraphParams {
        &self.params
    }

    /// The parts of it, in the order in which their plants grow.
    pub(super) fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// The part in which the first plant grows.
    pub(super) fn own(&self) -> &Patch {
        self.patches.iter().find(|patch| patch.plants.contains(&0)).unwrap_or(&self.patches[0])
    }

    /// The nodes and edges among which the first plant grows.
    pub(super) fn space(&self) -> &Space {
        &self.own().space
    }

    /// How many nodes it has.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.patches.iter().map(|patch| patch.space.nodes.len()).sum()
    }

    /// How many edges leave them.
    #[must_use]
    pub fn edges(&self) -> usize {
        let edges = self.patches.iter().flat_map(|patch| patch.space.graph.edges.iter().flatten());
        edges.filter(|&&target| target != super::yao::NONE).count()
    }

    /// Bytes of its arrays.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.patches.iter().map(|patch| patch.space.bytes()).sum()
    }

    /// Places of the nodes among which the first plant grows, in its heights.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.space().nodes.positions
    }

    /// For each of these nodes the one that its edge in each octant leads to; `u32::MAX` for none.
    #[must_use]
    pub fn links(&self) -> &[[u32; 8]] {
        &self.space().graph.edges
    }

    /// The node at the foot of the first plant.
    #[must_use]
    pub fn root(&self) -> u32 {
        self.space().nodes.root
    }

    /// How far an octant looks for a node, in heights of the first plant.
    #[must_use]
    pub fn reach(&self) -> f32 {
        self.space().nodes.disc * super::yao::REACH
    }

    /// The least cost of every node from the first plant's root with upright guiding vectors: one whole pass.
    #[must_use]
    pub fn costs_from_root(&self) -> Vec<f32> {
        let sources = [PathSource { node: self.root(), vector: Vec3::Y, lean: 0.0, closed: false }];
        let guide = Guide::Constant { alpha: 0.0 };
        let (nodes, seed, axis) = (&self.space().nodes, Seed::new(1), GuideAxis::Vector);
        let party =
            Party { nodes, sources: &sources, guide: &guide, axis, light: Vec3::ZERO, seed, costs: Costs::USUAL };
        let all: Vec<u32> = (0..nodes.len() as u32).collect();
        Paths::find_among(&self.space().graph, &[party], &all, None, seed).into_costs()
    }
}

/// The nodes of a region in which several plants have as many each as one has alone.
fn shared(count: u32, region: &Region) -> u32 {
    (count as f32 * region.crowding()).min((count as f32).max(MOST_SHARED)) as u32
}
