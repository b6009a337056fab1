//! Growth by guiding vectors: Xu and Mould, "Procedural Tree Modeling with Guiding Vectors", 2015.
//!
//! A tree is the union of least-cost paths through an irregular graph. Nodes are scattered and linked once (`nodes`,
//! `yao`); each iteration names places where branches may end (`endpoints`), finds the paths to them from the whole tree
//! so far, while every node's guiding vector turns a little from that of the node before it (`guide`, `paths`), and adds
//! the chosen ones (`structure`). What remains is to take the graph's crookedness out and give radii (`skeleton`).
//!
//! Limits: no two paths share a node without sharing the way to it, so axes never cross, but thick wood may touch. Twigs
//! and leaves are a later stage's. Time is `n log n` in nodes; memory about 120 bytes a node.

mod check;
mod endpoints;
mod frontier;
mod growth;
mod grid;
mod guide;
mod near;
mod nodes;
mod obstacle;
mod paths;
mod region;
mod shed;
mod skeleton;
mod space;
mod structure;
#[cfg(test)]
mod tests;
mod tile;
mod yao;

use std::borrow::Cow;

use growth::Tree;
pub use obstacle::obstacle_triangles;
pub use space::{Graph, GraphParams, ObstacleMeshes};

use crate::base::Seed;
use crate::plant::{Plant, PlantError, Skeleton};
use crate::preset::plan::{Company, GrowParams};

/// Why nothing could be grown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GrowError {
    /// A parameter that is not finite or out of its range.
    #[error("{field} is {value}, outside {low} to {high}")]
    OutOfRange {
        /// Which parameter, as `iterations[1].radius`.
        field: String,
        /// Its value.
        value: f32,
        /// Smallest allowed.
        low: f32,
        /// Largest allowed.
        high: f32,
    },
    /// An obstacle names a file whose mesh is not given.
    #[error("the mesh of the obstacle {0} is not there")]
    NoMesh(String),
    /// Obstacles have too many triangles, or places that are not finite.
    #[error("the obstacles' meshes are broken or have more than 500000 triangles")]
    BadMesh,
    /// The graph was made from other parameters.
    #[error("the graph was made for other parameters: number of nodes, width, graph seed, neighbours or obstacles")]
    OtherGraph,
    /// No iteration added a branch.
    #[error("no branch was reached: every iteration's endpoints lie outside the region or at the root")]
    Nothing,
    /// What was grown is no plant.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

/// Grows a plant: `params.height` metres tall, its root at the origin, without leaves.
///
/// All randomness is addressed below `seed` and `params.seed`, but for that of the graph, which is addressed by
/// `params.space.graph_seed` alone. The notes tell of endpoints that were asked for and are not there (they name iterations
/// from 1), and of branches that were moved or dropped.
///
/// # Errors
///
/// When a parameter is out of range, nothing grows, or an obstacle is a mesh (see [`grow_among`]).
pub fn grow(params: &GrowParams, seed: Seed) -> Result<(Plant, Vec<String>), GrowError> {
    grow_among(params, &ObstacleMeshes::new(), seed)
}

/// As [`grow`], given the meshes of its obstacles.
///
/// # Errors
///
/// When a parameter is out of range, a mesh is not there, or nothing grows.
pub fn grow_among(
    params: &GrowParams,
    meshes: &ObstacleMeshes,
    seed: Seed,
) -> Result<(Plant, Vec<String>), GrowError> {
    grow_on(&Graph::new(&GraphParams::of(params)?, meshes)?, params, seed)
}

/// As [`grow_among`], on a graph that is there already and may have served other plants: the same bytes.
///
/// # Errors
///
/// When a parameter is out of range, the graph is not that of [`GraphParams::of`] these parameters, or nothing grows.
pub fn grow_on(graph: &Graph, params: &GrowParams, seed: Seed) -> Result<(Plant, Vec<String>), GrowError> {
    check::check(params)?;
    let tops = heights(params);
    if *graph.params() != GraphParams::with_heights(params, &tops) {
        return Err(GrowError::OtherGraph);
    }
    let first = params.height / tops[0];
    let seed = seed.child("grow").at(params.seed);
    let beside = params.space.beside.iter().zip(&tops[1..]).enumerate().map(|(i, (beside, top))| {
        let seed = seed.child("beside").at(i as u64).at(beside.params.seed);
        Tree::new(&beside.params, beside.params.height / top / first, seed)
    });
    let mut trees: Vec<Tree<'_>> = std::iter::once(Tree::new(params, 1.0, seed)).chain(beside).collect();
    let graph = growth::grow_all(graph, &mut trees, &params.space);

    let bound = !params.space.beside.is_empty() || !params.space.obstacles.is_empty();
    let mut notes = Vec::new();
    let mut plants: Vec<Skeleton> = Vec::new();
    for (i, tree) in trees.iter().enumerate() {
        if i > 0 && params.space.company == Company::LeftOut {
            break;
        }
        // A plant that shares its space keeps the scale that neighbours and obstacles have.
        let scale = bound.then(|| tree.params.height / tops[i]);
        let view = if i == 0 { Cow::Borrowed(&graph.space().nodes) } else { Cow::Owned(tree.nodes(&graph, i)) };
        let skeleton = skeleton::skeleton(&tree.structure, &view, tree.params, scale);
        notes.extend(tree.notes.iter().map(|note| if i == 0 { note.clone() } else { format!("plant {}: {note}", i + 1) }));
        match skeleton {
            Some(skeleton) if i == 0 => plants.push(skeleton),
            Some(mut skeleton) => {
                let [x, z] = params.space.beside[i - 1].at;
                skeleton.nodes.iter_mut().for_each(|n| n.position += glam::Vec3::new(x, 0.0, z));
                plants.push(skeleton);
            }
            None if i == 0 => return Err(GrowError::Nothing),
            None => notes.push(format!("plant {}: nothing grew", i + 1)),
        }
    }
    let (plant, slim) = shed::shed(&joined(plants).into_plant()?, params.slenderness);
    if slim > 0 {
        let s = if slim == 1 { "" } else { "es" };
        notes.push(format!("{slim} branch{s} longer than {} times the radius shed", params.slenderness));
    }
    Ok((plant, notes))
}

/// One skeleton of several.
fn joined(skeletons: Vec<Skeleton>) -> Skeleton {
    let mut all = Skeleton::default();
    for skeleton in skeletons {
        let first = all.nodes.len() as u32;
        all.nodes.extend(skeleton.nodes.into_iter().map(|mut node| {
            node.parent = node.parent.map(|p| p + first);
            node
        }));
    }
    all
}

/// How high each plant reaches in a region of height 1 when it grows alone, the first one's first; 1 where that does not
/// matter, since a plant that shares its space with nothing is scaled to its height at the end.
fn heights(params: &GrowParams) -> Vec<f32> {
    let space = &params.space;
    if space.beside.is_empty() && space.obstacles.is_empty() {
        return vec![1.0];
    }
    let mut known: Vec<(&GrowParams, f32)> = Vec::new();
    std::iter::once(params)
        .chain(space.beside.iter().map(|beside| &beside.params))
        .map(|params| {
            // Plants of one species and seed are measured once.
            if let Some((_, top)) = known.iter().find(|(other, _)| alike(other, params)) {
                return *top;
            }
            let top = growth::height_alone(params);
            known.push((params, top));
            top
        })
        .collect()
}

/// Whether two plants reach equally high alone: of one species, whatever their size and seed.
fn alike(a: &GrowParams, b: &GrowParams) -> bool {
    (a.nodes, a.width, &a.iterations, a.bole) == (b.nodes, b.width, &b.iterations, b.bole)
}
