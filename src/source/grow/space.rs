//! The graph in which plants grow.
//!
//! It does not depend on the plants' seeds, so one serves many plants ([`Graph`]). Where the parameters ask for more detail
//! than an even graph gives, finer nodes come later, along the branches only (`refine`).

use std::sync::Arc;

use glam::Vec3;
use serde::Serialize;

use super::GrowError;
use super::nodes::Nodes;
use super::obstacle::Obstacles;
use super::paths::{Party, PathSource, Paths};
use super::region::{Column, Region};
use super::solid::Solids;
use super::yao::Edges;
use crate::base::Seed;
use crate::preset::plan::{GrowParams, Guide, Obstacle};

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
    /// Nodes, about.
    nodes: u32,
    /// Address of all randomness.
    seed: u64,
    /// Foot along x and z, radius and height of each plant's cylinder, in heights of the first; none for one plant.
    columns: Vec<[f32; 4]>,
    /// The cylinder of the first plant: its width.
    width: f32,
    obstacles: Vec<Obstacle>,
    /// Heights.
    clearance: f32,
    /// Heights a metre, where there are obstacles; else 0.
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
        let first = params.height / tops[0];
        let columns = space.beside.iter().zip(&tops[1..]).map(|(beside, top)| {
            let share = beside.params.height / top / first;
            [beside.at[0] / first, beside.at[1] / first, beside.params.width * 0.5 * share, share]
        });
        let solid = !space.obstacles.is_empty();
        Self {
            nodes: params.nodes,
            seed: space.graph_seed,
            columns: columns.collect(),
            width: params.width,
            obstacles: space.obstacles.clone(),
            clearance: if solid { space.clearance / first } else { 0.0 },
            per_metre: if solid { 1.0 / first } else { 0.0 },
        }
    }

    fn region(&self, meshes: &ObstacleMeshes) -> Result<Region, GrowError> {
        let mut columns = vec![Column { foot: Vec3::ZERO, radius: self.width * 0.5, height: 1.0 }];
        columns.extend(self.columns.iter().map(|&[x, z, radius, height]| Column {
            foot: Vec3::new(x, 0.0, z),
            radius,
            height,
        }));
        let obstacles = Obstacles::scaled(&self.obstacles, self.clearance, self.per_metre, meshes)?;
        Ok(Region::new(columns, obstacles))
    }
}

/// A graph for any number of plants with the same [`GraphParams`].
#[derive(Clone, Debug)]
pub struct Graph {
    params: GraphParams,
    region: Region,
    space: Space,
    /// The nodes where the plants stand, the first one's first.
    roots: Vec<u32>,
}

impl Graph {
    /// Scatters and links the nodes. Linear in their number.
    ///
    /// # Errors
    ///
    /// When an obstacle's mesh is not in `meshes`, not finite or too large.
    pub fn new(params: &GraphParams, meshes: &ObstacleMeshes) -> Result<Self, GrowError> {
        let region = params.region(meshes)?;
        let seed = Seed::new(params.seed).child("graph");
        let (nodes, roots) = Nodes::even(&region, shared(params.nodes, &region), seed);
        let space = Space::linked(nodes, region.obstacles());
        Ok(Self { params: params.clone(), region, space, roots })
    }

    /// What it was made from.
    #[must_use]
    pub fn params(&self) -> &GraphParams {
        &self.params
    }

    /// How many nodes it has.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.space.nodes.len()
    }

    /// How many edges leave its nodes.
    #[must_use]
    pub fn edges(&self) -> usize {
        self.space.graph.edges.iter().flatten().filter(|&&target| target != super::yao::NONE).count()
    }

    /// Bytes of its arrays.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.space.bytes()
    }

    /// Places of its nodes, in heights of the first plant.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.space.nodes.positions
    }

    /// For each node the node that its edge in each octant leads to; `u32::MAX` for none.
    #[must_use]
    pub fn links(&self) -> &[[u32; 8]] {
        &self.space.graph.edges
    }

    /// The node at the foot of the first plant.
    #[must_use]
    pub fn root(&self) -> u32 {
        self.space.nodes.root
    }

    /// How far an octant looks for a node, in heights of the first plant.
    #[must_use]
    pub fn reach(&self) -> f32 {
        self.space.nodes.disc * super::yao::REACH
    }

    /// The least cost of every node from the first plant's root with upright guiding vectors: one whole pass.
    #[must_use]
    pub fn costs_from_root(&self) -> Vec<f32> {
        let sources = [PathSource { node: self.root(), vector: Vec3::Y, lean: 0.0, closed: false }];
        let guide = Guide::Constant { alpha: 0.0 };
        let (nodes, seed) = (&self.space.nodes, Seed::new(1));
        let party = Party { nodes, sources: &sources, guide: &guide, light: Vec3::ZERO, seed };
        let all: Vec<u32> = (0..nodes.len() as u32).collect();
        Paths::find_among(&self.space.graph, &[party], &all, None).into_costs()
    }

    pub(super) fn space(&self) -> &Space {
        &self.space
    }

    pub(super) fn roots(&self) -> &[u32] {
        &self.roots
    }

    pub(super) fn region(&self) -> &Region {
        &self.region
    }

    /// Address of its randomness.
    pub(super) fn seed(&self) -> Seed {
        Seed::new(self.params.seed).child("graph")
    }
}

/// The nodes of a region in which several plants have as many each as one has alone.
fn shared(count: u32, region: &Region) -> u32 {
    (count as f32 * region.crowding()).min((count as f32).max(MOST_SHARED)) as u32
}
