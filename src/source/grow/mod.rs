//! Growth by guiding vectors: Xu and Mould, "Procedural Tree Modeling with Guiding Vectors", 2015.
//!
//! A tree is the union of least-cost paths through an irregular graph. Nodes are scattered and linked once (`nodes`,
//! `yao`); each iteration names places where branches may end (`endpoints`), finds the paths to them from the whole tree
//! so far, while every node's guiding vector turns a little from that of the node before it (`guide`, `paths`), and adds
//! the chosen ones (`structure`). What remains is to take the graph's crookedness out (`skeleton`) and to give radii (`radii`).
//!
//! Limits: no two paths share a node without sharing the way to it, so axes never cross, but thick wood may touch. Twigs
//! and leaves are a later stage's. Time is `n log n` in nodes; memory about 120 bytes a node.

mod endpoints;
mod field;
#[cfg(test)]
mod figures;
mod grid;
mod guide;
mod nodes;
mod outline;
mod paths;
mod radii;
mod shed;
mod skeleton;
mod solid;
mod structure;
#[cfg(test)]
mod tests;
mod volume;
mod yao;

pub use solid::{ShapeFile, ShapeReading, Solid, SolidError, Solids};

use std::collections::BTreeSet;

use nodes::Nodes;
use paths::Paths;
use structure::Structure;
use yao::Graph;

use crate::base::Seed;
use crate::plant::{Plant, PlantError};
use crate::preset::plan::{
    Count, EndpointRule, Endpoints, FieldPrimitive, FieldRegion, GrowIteration, GrowParams, Guide, GuideStart,
    Sampling, Volume,
};

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
    /// No iteration added a branch.
    #[error("no branch was reached: every iteration's endpoints lie outside the region or at the root")]
    Nothing,
    /// What was grown is no plant.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

/// Grows a plant: `params.height` metres tall, its root at the origin, without leaves.
///
/// All randomness is addressed below `seed` and `params.seed`. The notes tell of endpoints that were asked for and are
/// not there; they name iterations from 1.
///
/// # Errors
///
/// When a parameter is out of range or nothing grows.
pub fn grow(params: &GrowParams, seed: Seed) -> Result<(Plant, Vec<String>), GrowError> {
    grow_in(params, &Solids::new(), seed)
}

/// As [`grow`], for a species whose volumes name files: `solids` holds their shapes.
///
/// # Errors
///
/// As for [`grow`], and when a shape is not there.
pub fn grow_in(params: &GrowParams, solids: &Solids, seed: Seed) -> Result<(Plant, Vec<String>), GrowError> {
    check(params)?;
    if let Some(missing) = shape_files(params).into_iter().find(|file| !solids.contains_key(file)) {
        return Err(GrowError::Shape(missing.file));
    }
    let seed = seed.child("grow").at(params.seed);
    let space = Space::new(Nodes::scatter(params.nodes, params.width, seed));
    let mut structure = Structure::new(&space.nodes);
    let mut notes = Vec::new();
    for (i, iteration) in params.iterations.iter().enumerate() {
        extend(&mut structure, &space, solids, iteration, params, seed.child("iteration").at(i as u64), |note| {
            notes.push(format!("iteration {}: {note}", i + 1));
        });
    }
    let skeleton = skeleton::skeleton(&structure, &space.nodes, params);
    let plant = radii::with_radii(&skeleton.ok_or(GrowError::Nothing)?.into_plant()?, params);
    let (plant, slim) = shed::shed(&plant, params.slenderness);
    if slim > 0 {
        let s = if slim == 1 { "" } else { "es" };
        notes.push(format!("{slim} branch{s} longer than {} times the radius shed", params.slenderness));
    }
    Ok((plant, notes))
}

/// The files whose shapes a species needs, in order and each once.
#[must_use]
pub fn shape_files(params: &GrowParams) -> BTreeSet<ShapeFile> {
    let of = |iteration: &GrowIteration| match &iteration.endpoints {
        Endpoints::Volume { shape, .. } => volume::file(shape),
        Endpoints::Surface { .. } => None,
    };
    params.iterations.iter().filter_map(of).collect()
}

/// Where trees grow: nodes, edges, and how far each node is from the root.
struct Space {
    nodes: Nodes,
    graph: Graph,
    /// Fewest edges from the root to each node.
    from_root: Vec<u32>,
}

impl Space {
    fn new(nodes: Nodes) -> Self {
        let graph = Graph::yao(&nodes);
        let from_root = graph.hops(&[nodes.root], u32::MAX);
        Self { nodes, graph, from_root }
    }
}

/// One iteration: candidates, paths, the rule, the choice (2015, 3.1.2 to 3.1.4).
fn extend(
    structure: &mut Structure,
    space: &Space,
    solids: &Solids,
    iteration: &GrowIteration,
    params: &GrowParams,
    seed: Seed,
    mut note: impl FnMut(String),
) {
    let Space { nodes, graph, .. } = space;
    let endpoints = &iteration.endpoints;
    let wanted = endpoints::count(endpoints, solids, params.width) as usize;
    let candidates = endpoints::candidates(endpoints, solids, space, structure, seed);
    if wanted == 0 {
        return;
    }
    if candidates.is_empty() {
        note("no node is free where its branches should end".to_owned());
        return;
    }
    // Only the rules need the paths to all candidates; otherwise the choice comes first and saves most of the search.
    let chosen = match iteration.keep {
        EndpointRule::Any => endpoints::choose(endpoints, &candidates, nodes, wanted, seed),
        EndpointRule::Lower | EndpointRule::Higher => candidates,
    };
    let sources = structure.sources(nodes, iteration.start, &iteration.guide, params.bole);
    let paths = Paths::find(nodes, graph, &sources, &chosen, &iteration.guide, seed);
    let (reached, lost): (Vec<u32>, Vec<u32>) = chosen.into_iter().partition(|&n| paths.reached(n));
    if !lost.is_empty() {
        note(format!("no path leads to {} of {} endpoints", lost.len(), lost.len() + reached.len()));
    }
    let height = |n: u32| nodes.at(n).y;
    let kept = match iteration.keep {
        EndpointRule::Any => reached,
        EndpointRule::Lower | EndpointRule::Higher => {
            let lower = iteration.keep == EndpointRule::Lower;
            let kept: Vec<u32> = reached
                .into_iter()
                .filter(
                    |&n| if lower { height(n) < height(paths.source(n)) } else { height(n) > height(paths.source(n)) },
                )
                .collect();
            endpoints::choose(endpoints, &kept, nodes, wanted, seed)
        }
    };
    if kept.len() < wanted {
        note(format!("{} of {wanted} endpoints found a place", kept.len()));
    }
    for end in kept {
        structure.add(&paths, end);
    }
}

/// The ranges that the rest relies on.
fn check(params: &GrowParams) -> Result<(), GrowError> {
    let within = |field: &str, value: f32, low: f32, high: f32| {
        // A NaN is in no range.
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(GrowError::OutOfRange { field: field.to_owned(), value, low, high })
        }
    };
    within("height", params.height, 0.01, 1000.0)?;
    within("nodes", params.nodes as f32, 16.0, 400_000.0)?;
    within("width", params.width, 0.02, 20.0)?;
    within("crookedness", params.crookedness, 0.0, 1.0)?;
    within("bole", params.bole, 0.0, 1.0)?;
    within("slenderness", params.slenderness, 50.0, 10_000.0)?;
    within("tip_radius", params.tip_radius, 0.0, 10.0)?;
    within("allometry", params.allometry, 0.5, 10.0)?;
    within("taper", params.taper, 0.0, 1000.0)?;
    within("flare", params.flare, 0.0, 10.0)?;
    within("flare_height", params.flare_height, 0.0, 100.0)?;
    within("the number of iterations", params.iterations.len() as f32, 1.0, 32.0)?;
    for (i, iteration) in params.iterations.iter().enumerate() {
        let at =
            |name: &str, value: f32, low: f32, high: f32| within(&format!("iterations[{i}].{name}"), value, low, high);
        guide_within(&iteration.guide, &|name, value, low, high| at(&format!("guide.{name}"), value, low, high), 8)?;
        if let GuideStart::ByHeight { low, high } = iteration.start {
            at("start.low", low, -TURN, TURN).and(at("start.high", high, -TURN, TURN))?;
        }
        if let Endpoints::Volume { sampling: Sampling::Whorls { spacing }, .. }
        | Endpoints::Surface { sampling: Sampling::Whorls { spacing }, .. } = iteration.endpoints
        {
            at("endpoints.sampling.spacing", spacing, 0.001, 10.0)?;
        }
        match iteration.endpoints {
            Endpoints::Surface { t, .. } => at("endpoints.t", t, 0.0, 1.0)?,
            Endpoints::Volume { ref shape, count, .. } => {
                let (low, high, reach, hollow) = match *shape {
                    Volume::Point { height, out } => (height, height, out, 0.0),
                    Volume::Ellipsoid { bottom, top, radius, hollow }
                    | Volume::HalfEllipsoid { bottom, top, radius, hollow }
                    | Volume::Cone { bottom, top, radius, hollow }
                    | Volume::Cylinder { bottom, top, radius, hollow } => (bottom, top, radius, hollow),
                    Volume::Box { bottom, top, width, depth, hollow } => (bottom, top, width.max(depth), hollow),
                    Volume::Mesh { bottom, top, .. } | Volume::Outline { bottom, top, .. } => (bottom, top, 0.0, 0.0),
                };
                at("endpoints.shape.bottom", low, -10.0, 10.0)?;
                at("endpoints.shape.top", high, -10.0, 10.0)?;
                at("endpoints.shape.radius", reach, 0.0, 20.0)?;
                at("endpoints.shape.hollow", hollow, 0.0, 1.0)?;
                if let Count::Density(density) = count {
                    at("endpoints.density", density, 0.0, 1e6)?;
                }
            }
        }
    }
    Ok(())
}

/// Largest turn, radians.
const TURN: f32 = 4.0 * std::f32::consts::PI;

/// The ranges of a guide, splits at most `deep` deep.
fn guide_within(
    guide: &Guide,
    at: &dyn Fn(&str, f32, f32, f32) -> Result<(), GrowError>,
    deep: u32,
) -> Result<(), GrowError> {
    let angle = |name: &str, value: f32| at(name, value, -TURN, TURN);
    match guide {
        Guide::Constant { alpha } => angle("alpha", *alpha),
        Guide::Piecewise { alpha1, alpha2, .. } => angle("alpha1", *alpha1).and(angle("alpha2", *alpha2)),
        Guide::Random { low, high, alpha2, .. } => {
            angle("low", *low).and(angle("high", *high)).and(angle("alpha2", *alpha2))
        }
        Guide::Polar { theta } => angle("theta", *theta),
        Guide::Split { height, lower, upper } => {
            at("height", *height, -10.0, 10.0)?;
            at("how deep splits go", 9.0 - deep as f32, 1.0, 8.0)?;
            guide_within(lower, at, deep - 1).and_then(|()| guide_within(upper, at, deep - 1))
        }
        Guide::Field { parts } => {
            at("the number of parts", parts.len() as f32, 1.0, 64.0)?;
            for part in parts {
                at("weight", part.weight, -1000.0, 1000.0)?;
                match part.primitive {
                    FieldPrimitive::Uniform { lean, turn } => angle("lean", lean).and(angle("turn", turn))?,
                    FieldPrimitive::Helical { rise } => angle("rise", rise)?,
                    FieldPrimitive::Rotational { height, .. }
                    | FieldPrimitive::Spherical { height }
                    | FieldPrimitive::Radial { height } => at("height", height, -10.0, 10.0)?,
                    FieldPrimitive::Outward => {}
                }
                let (low, high, soft) = match part.region {
                    FieldRegion::Everywhere => (0.0, 0.0, 0.0),
                    FieldRegion::Layer { bottom, top, soft } => (bottom, top, soft),
                    FieldRegion::Ball { height, radius, soft } => (height, radius, soft),
                    FieldRegion::Core { radius, soft } => (0.0, radius, soft),
                };
                at("region", low, -10.0, 10.0).and(at("region", high, -10.0, 10.0))?;
                at("region.soft", soft, 0.0, 10.0)?;
            }
            Ok(())
        }
    }
}
