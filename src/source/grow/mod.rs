//! Growth by guiding vectors: Xu and Mould, "Procedural Tree Modeling with Guiding Vectors", 2015.
//!
//! A tree is the union of least-cost paths through an irregular graph. Nodes are scattered and linked once (`nodes`,
//! `yao`); each iteration names places where branches may end (`endpoints`), finds the paths to them from the whole tree
//! so far, while every node's guiding vector turns a little from that of the node before it (`guide`, `paths`), and adds
//! the chosen ones (`structure`). What remains is to take the graph's crookedness out (`skeleton`) and to give radii (`radii`).
//!
//! Several plants may share the space (`growth`), obstacles stand in it (`obstacle`), and ways may be finer than
//! the graph (`refine`). At the end, wood that overlaps away from forks is moved apart (`overlap`).
//!
//! Limits: no two paths share a node without sharing the way to it, so axes never cross. Twigs and leaves are a later
//! stage's. Time is `n log n` in nodes; memory about 52 bytes a node for a graph and 46 for a pass over it.

mod check;
mod company;
mod detail;
mod endpoints;
mod field;
#[cfg(test)]
mod figures;
mod frontier;
mod grid;
mod growth;
mod guide;
mod leader;
mod nodes;
mod obstacle;
mod outline;
mod overlap;
mod paths;
#[cfg(test)]
mod promises;
mod radii;
mod refine;
mod region;
mod shed;
mod skeleton;
mod solid;
mod space;
mod structure;
#[cfg(test)]
mod tests;
mod tile;
mod volume;
mod way;
mod yao;

#[cfg(test)]
use growth::extend;
#[cfg(test)]
use space::Space;

use std::collections::BTreeSet;

use glam::Vec3;

use company::Grown;
pub use detail::{Detail, detail};
use growth::Tree;
pub use obstacle::{Obstacles, obstacle_triangles};
pub use overlap::{Mended, crossings, mend_overlaps, overlaps};
pub use solid::{ShapeFile, ShapeReading, Solid, SolidError, Solids};
use space::Patch;
pub use space::{Graph, GraphParams, ObstacleMeshes};

use crate::base::{Seed, counted};
use crate::plant::{Plant, PlantBuilder, PlantError, Skeleton};
use crate::preset::plan::{Company, Endpoints, GrowParams, Obstacle};

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
    /// A volume names a file whose shape is not given.
    #[error("the shape {0} that endpoints are taken from is not there")]
    Shape(String),
    /// An obstacle names a file whose mesh is not given.
    #[error("the mesh of the obstacle {0} is not there")]
    NoMesh(String),
    /// Obstacles have too many triangles, or places that are not finite.
    #[error("the obstacles' meshes are broken or have more than 500000 triangles")]
    BadMesh,
    /// The graph was made from other parameters.
    #[error("the graph was made for other parameters: number of nodes, width, graph seed, neighbours or obstacles")]
    OtherGraph,
    /// A plant of several, which others leave no room.
    #[error(
        "plant {number} of {of} found no room to grow: {away:.2} m from it stands plant {nearest}, and the ways that wood \
         may take are {hop:.2} m apart"
    )]
    Crowded {
        /// Which plant, from 1.
        number: usize,
        /// How many there are.
        of: usize,
        /// The nearest to it, from 1.
        nearest: usize,
        /// How far away that stands, metres.
        away: f32,
        /// About how long the edges of the graph are, metres.
        hop: f32,
    },
    /// No iteration added a branch.
    #[error("no branch was reached: every iteration's endpoints lie outside the region or at the root")]
    Nothing,
    /// What was grown is no plant.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

/// Share of its height below which a plant among others has not grown.
const STUNTED: f32 = 0.35;
/// Share of a plant's branches whose loss is told with what helps.
const MUCH: f32 = 0.4;

/// Grows a plant: `params.height` metres tall, its root at the origin, without leaves.
///
/// All randomness is addressed below `seed` and `params.seed`, but for that of the graph, which is addressed by
/// `params.space.graph_seed` alone. The notes tell of endpoints that were asked for and are not there (they name iterations
/// from 1), and of branches that were moved or dropped.
///
/// # Errors
///
/// When a parameter is out of range, nothing grows, or the species needs files (see [`grow_among`]).
pub fn grow(params: &GrowParams, seed: Seed) -> Result<(Plant, Vec<String>), GrowError> {
    grow_in(params, &Solids::new(), seed)
}

/// As [`grow`], for a species whose volumes name files: `solids` holds their shapes.
///
/// # Errors
///
/// As for [`grow`], and when a shape is not there.
pub fn grow_in(params: &GrowParams, solids: &Solids, seed: Seed) -> Result<(Plant, Vec<String>), GrowError> {
    grow_among(params, solids, &ObstacleMeshes::new(), seed)
}

/// As [`grow_in`], given the meshes of the obstacles.
///
/// # Errors
///
/// As for [`grow_in`], and when a mesh is not there.
pub fn grow_among(
    params: &GrowParams,
    solids: &Solids,
    meshes: &ObstacleMeshes,
    seed: Seed,
) -> Result<(Plant, Vec<String>), GrowError> {
    grow_on(&Graph::new(&GraphParams::of(params, solids)?, meshes)?, params, solids, seed)
}

/// As [`grow_among`], on a graph that is there already and may have served other plants: the same bytes.
///
/// # Errors
///
/// When a parameter is out of range, a shape is not there, the graph is not that of [`GraphParams::of`] these parameters,
/// or nothing grows.
pub fn grow_on(
    graph: &Graph,
    params: &GrowParams,
    solids: &Solids,
    seed: Seed,
) -> Result<(Plant, Vec<String>), GrowError> {
    checked(params, solids)?;
    let tops = heights(params, solids);
    if *graph.params() != GraphParams::with_heights(params, &tops) {
        return Err(GrowError::OtherGraph);
    }
    let kept = params.space.company == Company::Kept;
    let bound = !params.space.beside.is_empty() || !params.space.obstacles.is_empty();
    let mut grown: Vec<Option<Grown>> = tops.iter().map(|_| None).collect();
    let mut notes: Vec<Vec<String>> = vec![Vec::new(); tops.len()];
    let mut stunted: Vec<(usize, f32)> = Vec::new();
    // How long a patch's unit is, metres.
    let unit = |patch: &Patch| company::member(params, patch.plants[0]).height / tops[patch.plants[0]];
    for patch in graph.patches() {
        if !kept && grown[0].is_some() {
            // Nobody that comes later is in the first one's way.
            break;
        }
        let unit = unit(patch);
        let hop = patch.space.nodes.hop() * unit;
        let mut trees: Vec<Tree<'_>> = patch.plants.iter().map(|&i| tree(params, &tops, i, unit, seed)).collect();
        let earlier = || grown.iter().flatten();
        let taken = if earlier().next().is_some() { company::taken(&patch.space, unit, earlier()) } else { Vec::new() };
        let ways = growth::grow_all(patch, &mut trees, &taken, &params.space, solids);
        for (place, &i) in patch.plants.iter().enumerate() {
            let (tree, foot) = (&trees[place], patch.space.nodes.at(patch.roots[place]));
            // A plant that shares its space keeps the scale that neighbours and obstacles have.
            let scale = bound.then(|| tree.params.height / tops[i]);
            let share = tree.share();
            let barred = |a: Vec3, b: Vec3| patch.region.obstacles().bar(a * share + foot, b * share + foot);
            let Some(skeleton) = skeleton::skeleton(&ways[place], tree.params, scale, &barred) else {
                if i == 0 {
                    return Err(match company::nearest(params, 0) {
                        Some((nearest, away)) => {
                            GrowError::Crowded { number: 1, of: tops.len(), nearest: nearest + 1, away, hop }
                        }
                        None => GrowError::Nothing,
                    });
                }
                stunted.push((i, hop));
                continue;
            };
            let top = skeleton.nodes.iter().fold(0.0_f32, |top, node| top.max(node.position.y));
            let low = tops.len() > 1 && top < tree.params.height * STUNTED;
            if low {
                stunted.push((i, hop));
            }
            // A tuft at another's foot is no tree. One beside which others stand was asked for, and stays.
            if !low || (i == 0 && !kept) {
                let plant;
                (plant, notes[i]) = finished(skeleton, tree.params, company::stands(params, i), bound)?;
                if !low {
                    notes[i].splice(0..0, tree.notes.iter().cloned());
                }
                grown[i] = Some(Grown { plant, hop });
            }
        }
    }
    let mut told: Vec<String> = Vec::new();
    stunted.sort_by_key(|(i, _)| *i);
    stunted.retain(|(i, _)| kept || *i == 0);
    if let Some(&(number, hop)) = stunted.first() {
        if kept && stunted.len() == tops.len() {
            let (nearest, away) = company::nearest(params, number).unwrap_or((number, 0.0));
            return Err(GrowError::Crowded { number: number + 1, of: tops.len(), nearest: nearest + 1, away, hop });
        }
        let numbers: Vec<usize> = stunted.iter().map(|(i, _)| *i).collect();
        told.push(company::crowded(params, &numbers, hop));
    }
    let plants = grown.into_iter().enumerate().filter(|(i, _)| kept || *i == 0);
    for (i, plant_notes) in notes.into_iter().enumerate().filter(|(i, _)| kept || *i == 0) {
        let named = |note: String| if i == 0 { note } else { format!("plant {}: {note}", i + 1) };
        told.extend(plant_notes.into_iter().map(named));
    }
    let plant = joined(plants.filter_map(|(_, grown)| Some(grown?.plant)).collect())?;
    let (obstacles, first) = (graph.own().region.obstacles(), unit(graph.own()));
    let barred = |a: Vec3, b: Vec3| obstacles.bar(a / first, b / first);
    let among: Option<&dyn Fn(Vec3, Vec3) -> bool> = if obstacles.is_empty() { None } else { Some(&barred) };
    let (mended, overlap, heights) = overlap::mend_among(&plant, among);
    // The highest twig may be among what was moved or dropped.
    let plant = if bound || overlap.found == 0 { mended } else { shed::as_high_as(heights, mended) };
    told.extend(mended_notes(overlap));
    Ok((plant, told))
}

/// A plant of several that is yet to grow, in a patch whose unit is that long, metres.
fn tree<'a>(params: &'a GrowParams, tops: &[f32], i: usize, unit: f32, seed: Seed) -> Tree<'a> {
    let own = company::member(params, i);
    let seed = seed.child("grow").at(params.seed);
    let seed = match i.checked_sub(1) {
        None => seed,
        Some(beside) => seed.child("beside").at(beside as u64).at(own.seed),
    };
    Tree::new(own, own.height / tops[i] / unit, seed)
}

/// A plant with its radii, without branches that are too slim, where it stands; and what is to be told of it.
fn finished(
    mut skeleton: Skeleton,
    params: &GrowParams,
    [x, z]: [f32; 2],
    bound: bool,
) -> Result<(Plant, Vec<String>), GrowError> {
    if x != 0.0 || z != 0.0 {
        skeleton.nodes.iter_mut().for_each(|n| n.position += Vec3::new(x, 0.0, z));
    }
    let plant = radii::with_radii(&skeleton.into_plant()?, params);
    let (slenderness, all) = (params.slenderness, plant.chains().len());
    let (plant, slim) = if bound { shed::shed_in_place(&plant, slenderness) } else { shed::shed(&plant, slenderness) };
    let mut notes = Vec::new();
    if slim > 0 {
        let lost = 1.0 - plant.chains().len() as f32 / all as f32;
        // Most of a crown is no blemish that was mended, but a species that asks for what it forbids.
        let much = if lost > MUCH {
            format!(
                ", and with them {:.0} % of all branches; raise `slenderness` or `tip_radius`",
                (lost * 100.0).min(99.0)
            )
        } else {
            String::new()
        };
        notes.push(format!(
            "{} longer than {slenderness} times the radius shed (`slenderness`){much}",
            counted(slim, "branch", "branches")
        ));
    }
    Ok((plant, notes))
}

/// The files whose shapes a species and its neighbours need, in order and each once.
#[must_use]
pub fn shape_files(params: &GrowParams) -> BTreeSet<ShapeFile> {
    std::iter::once(params)
        .chain(params.space.beside.iter().map(|beside| &beside.params))
        .flat_map(|params| &params.iterations)
        .flat_map(|iteration| match &iteration.endpoints {
            Endpoints::Volume { shape, .. } => volume::files(shape),
            Endpoints::Surface { .. } => Vec::new(),
        })
        .collect()
}

/// The files whose meshes stand in a plant's way, as its parameters name them.
pub fn obstacle_files(params: &GrowParams) -> impl Iterator<Item = &String> {
    params.space.obstacles.iter().filter_map(|obstacle| match obstacle {
        Obstacle::Mesh { file, .. } => Some(file),
        Obstacle::Box { .. } => None,
    })
}

/// Whether parameters are in their ranges and their shapes there.
fn checked(params: &GrowParams, solids: &Solids) -> Result<(), GrowError> {
    check::check(params)?;
    match shape_files(params).into_iter().find(|file| !solids.contains_key(file)) {
        Some(missing) => Err(GrowError::Shape(missing.file)),
        None => Ok(()),
    }
}

/// What was done about branches that grow into each other.
fn mended_notes(Mended { found, dropped, left }: Mended) -> Vec<String> {
    let moved = found.saturating_sub(dropped + left);
    let what = |count: usize, done: &str| {
        let (branches, others) = if count == 1 { ("branch", "another") } else { ("branches", "others") };
        (count > 0).then(|| format!("{count} {branches} {done} {others}"))
    };
    let still = if left == 1 { "still grows into" } else { "still grow into" };
    [what(moved, "moved out of"), what(dropped, "dropped that grew into"), what(left, still)]
        .into_iter()
        .flatten()
        .collect()
}

/// One plant of several.
fn joined(mut plants: Vec<Plant>) -> Result<Plant, PlantError> {
    if plants.len() == 1 {
        return Ok(plants.remove(0));
    }
    let mut builder = PlantBuilder::new();
    for plant in plants {
        let mut places = Vec::with_capacity(plant.chains().len());
        for id in plant.chain_ids() {
            let chain = plant.chain(id);
            let (points, radii) = (plant.points(id), plant.radii(id));
            places.push(match chain.parent {
                None => builder.stem(chain.origin, points, radii),
                Some(parent) => builder.branch(places[parent.index()], chain.location, points, radii),
            });
        }
    }
    builder.finish()
}

/// How high each plant reaches in a region of height 1 when it grows alone, the first one's first; 1 where that does not
/// matter, since a plant that shares its space with nothing is scaled to its height at the end.
fn heights(params: &GrowParams, solids: &Solids) -> Vec<f32> {
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
            let top = growth::height_alone(params, solids);
            known.push((params, top));
            top
        })
        .collect()
}

/// Whether two plants reach equally high alone: of one species, whatever their size and seed.
fn alike(a: &GrowParams, b: &GrowParams) -> bool {
    let of = |p: &GrowParams| (p.nodes, p.width, p.bole, p.length_cost, p.whim);
    of(a) == of(b) && a.iterations == b.iterations
}
