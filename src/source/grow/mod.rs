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

use glam::{Vec2, Vec3};

pub use detail::{Detail, detail};
use growth::Tree;
pub use obstacle::{Obstacles, obstacle_triangles};
pub use overlap::{Mended, crossings, mend_overlaps, overlaps};
pub use solid::{ShapeFile, ShapeReading, Solid, SolidError, Solids};
pub use space::{Graph, GraphParams, ObstacleMeshes};

use crate::base::{Seed, counted};
use crate::plant::{Plant, PlantBuilder, PlantError};
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

/// Share of its height below which a plant among others has not grown, and how many of such are named.
const STUNTED: f32 = 0.35;
const TOLD: usize = 8;
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
    let first = params.height / tops[0];
    let seed = seed.child("grow").at(params.seed);
    let beside = params.space.beside.iter().zip(&tops[1..]).enumerate().map(|(i, (beside, top))| {
        let seed = seed.child("beside").at(i as u64).at(beside.params.seed);
        Tree::new(&beside.params, beside.params.height / top / first, seed)
    });
    let mut trees: Vec<Tree<'_>> = std::iter::once(Tree::new(params, 1.0, seed)).chain(beside).collect();
    let ways = growth::grow_all(graph, &mut trees, &params.space, solids);

    let bound = !params.space.beside.is_empty() || !params.space.obstacles.is_empty();
    let mut notes = Vec::new();
    let mut plants: Vec<Plant> = Vec::new();
    let mut stunted: Vec<usize> = Vec::new();
    for (i, tree) in trees.iter().enumerate() {
        if i > 0 && params.space.company == Company::LeftOut {
            break;
        }
        let named = |note: String| if i == 0 { note } else { format!("plant {}: {note}", i + 1) };
        // A plant that shares its space keeps the scale that neighbours and obstacles have.
        let scale = bound.then(|| tree.params.height / tops[i]);
        let (region, foot, share) = (graph.region(), graph.space().nodes.at(graph.roots()[i]), tree.share());
        let barred = |a: Vec3, b: Vec3| region.obstacles().bar(a * share + foot, b * share + foot);
        let Some(mut skeleton) = skeleton::skeleton(&ways[i], tree.params, scale, &barred) else {
            if i == 0 {
                return Err(match nearest(params, 0) {
                    Some((nearest, away)) => {
                        let hop = graph.space().nodes.hop() * first;
                        GrowError::Crowded { number: 1, of: trees.len(), nearest: nearest + 1, away, hop }
                    }
                    None => GrowError::Nothing,
                });
            }
            stunted.push(i + 1);
            continue;
        };
        let top = skeleton.nodes.iter().fold(0.0_f32, |top, node| top.max(node.position.y));
        if trees.len() > 1 && top < tree.params.height * STUNTED {
            stunted.push(i + 1);
        } else {
            notes.extend(tree.notes.iter().cloned().map(named));
        }
        if i > 0 {
            let [x, z] = params.space.beside[i - 1].at;
            skeleton.nodes.iter_mut().for_each(|n| n.position += Vec3::new(x, 0.0, z));
        }
        let plant = radii::with_radii(&skeleton.into_plant()?, tree.params);
        let (slenderness, all) = (tree.params.slenderness, plant.chains().len());
        let (plant, slim) =
            if bound { shed::shed_in_place(&plant, slenderness) } else { shed::shed(&plant, slenderness) };
        if slim > 0 {
            let lost = 1.0 - plant.chains().len() as f32 / all as f32;
            // Most of a crown is no blemish that was mended, but a species that asks for what it forbids.
            let much = if lost > MUCH {
                format!(", and with them {:.0} % of all branches; raise `slenderness` or `tip_radius`", lost * 100.0)
            } else {
                String::new()
            };
            notes.push(named(format!(
                "{} longer than {slenderness} times the radius shed{much}",
                counted(slim, "branch", "branches")
            )));
        }
        plants.push(plant);
    }
    if !stunted.is_empty() {
        notes.insert(0, crowded(params, &stunted, graph.space().nodes.hop() * first));
    }
    let plant = joined(plants)?;
    // Obstacles stand in heights of the first plant.
    let obstacles = graph.region().obstacles();
    let barred = |a: Vec3, b: Vec3| obstacles.bar(a / first, b / first);
    let among: Option<&dyn Fn(Vec3, Vec3) -> bool> = if obstacles.is_empty() { None } else { Some(&barred) };
    let (mended, overlap, heights) = overlap::mend_among(&plant, among);
    // The highest twig may be among what was moved or dropped.
    let plant = if bound || overlap.found == 0 { mended } else { shed::as_high_as(heights, mended) };
    notes.extend(told(overlap));
    Ok((plant, notes))
}

/// Where a plant of several stands, metres from the first.
fn stands(params: &GrowParams, i: usize) -> [f32; 2] {
    i.checked_sub(1).and_then(|i| params.space.beside.get(i)).map_or([0.0; 2], |beside| beside.at)
}

/// The plant that stands nearest to one of several, and how far away; none where it stands alone.
fn nearest(params: &GrowParams, i: usize) -> Option<(usize, f32)> {
    let away = |j: usize| Vec2::from(stands(params, i)).distance(Vec2::from(stands(params, j)));
    let others = (0..=params.space.beside.len()).filter(|j| *j != i).map(|j| (j, away(j)));
    others.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Which plants found no room, by number from 1 and place, and what helps.
fn crowded(params: &GrowParams, stunted: &[usize], hop: f32) -> String {
    let (many, all) = (stunted.len(), params.space.beside.len() + 1);
    let one = |&number: &usize| {
        let [x, z] = stands(params, number - 1);
        let from = nearest(params, number - 1);
        let from = from.map_or_else(String::new, |(other, away)| format!(", {away:.2} m from number {}", other + 1));
        format!("number {number} of {:.1} m at ({x}, {z}){from}", height(params, number - 1))
    };
    let told: Vec<String> = stunted.iter().take(TOLD).map(one).collect();
    let more = if many > TOLD { format!("; and {} more", many - TOLD) } else { String::new() };
    format!(
        "{many} of {all} plants found no room to grow: {}{more}; the ways that wood may take are {hop:.2} m apart: move \
         them farther apart or away from obstacles, or raise their species' `nodes`, which brings ways closer together",
        told.join("; ")
    )
}

/// How tall a plant of several is to be, metres.
fn height(params: &GrowParams, i: usize) -> f32 {
    i.checked_sub(1).and_then(|i| params.space.beside.get(i)).map_or(params.height, |beside| beside.params.height)
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
fn told(Mended { found, dropped, left }: Mended) -> Vec<String> {
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
    (a.nodes, a.width, &a.iterations, a.bole) == (b.nodes, b.width, &b.iterations, b.bole)
}
