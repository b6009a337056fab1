//! Skeletonize: the wood of a mesh becomes a [`Plant`].
//!
//! 1. `weld`: vertices at one place become one; flat and double triangles go.
//! 2. `surface`: pieces of surface that hang together, each an edge-manifold.
//! 3. Each piece by itself, in parallel: `tube` where it is evidently a swept ring, `prism` where it has two ends and
//!    nothing between, else `coarsen` if it is large, closed by `cap` and `contract`ed (Laplacian contraction, Au et al.
//!    2008), then `surgery` and `sleeve`: a limb of nodes with radii, which `facets` mends where the trunk is low-poly. Where
//!    `fit` says that such a limb is far from its surface, as of shells as thick as they are high, `layers` of equal distance
//!    from the foot give another.
//! 4. `import/limb`: limbs get their base, and are joined by proximity, direction and radius as the fragments of a
//!    structure model are; then Gravelius orders.
//!
//! Bounded: n log n in vertices and triangles; a piece is contracted at [`MOST_VERTICES`] at most; whatever would take
//! more than its share of steps gives its longest way for an axis instead, and a note. The same bytes on any platform and
//! number of threads: plain double precision in one order, pieces collected by index.

mod cap;
mod cholesky;
mod coarsen;
mod contract;
mod facets;
mod fit;
mod layers;
mod prism;
#[cfg(test)]
mod shapes;
mod sleeve;
mod surface;
mod surgery;
mod tube;
mod web;
mod weld;

#[cfg(test)]
mod tests;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::import::limb::{Limb, join};
use super::scene::Scene;
use crate::base::counted;
use crate::plant::Plant;
use crate::preset::plan::{ImportHeight, UpAxis};
use surface::Surface;

/// Most vertices of a piece of surface that is contracted as it is.
pub const MOST_VERTICES: usize = 8_000;
/// Larger pieces are coarsened first: to one of so many of their vertices, as far as that is more, for what was scanned or
/// modelled so finely may have twigs to show for it.
const ONE_OF: usize = 25;
/// Most vertices that are contracted of a coarsened piece.
const MOST_OF_MANY: usize = 40_000;
/// Most pieces of surface: of a soup of loose triangles the largest are taken.
pub const MOST_PIECES: usize = 100_000;
/// From how far a contraction's tubes are from their surface, in its own thickness, its layers are asked.
/// Contractions of slim trees are 0.05 to 0.3 off, of stumps, baobabs and boles with roots 0.6 to 3.
const ASKEW: f64 = 0.35;
/// How much nearer they must be.
const NEARER: f64 = 0.7;
/// Least area of a piece that may be a thick shell, a share of the largest piece's: a twig's own volume says too little.
const MAIN: f64 = 0.2;
/// Least triangles of a piece of wood.
const LEAST_TRIANGLES: usize = 4;

/// The wood of a tree: triangles, in the file's unit and axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wood {
    /// Finite.
    pub positions: Vec<Vec3>,
    /// Corners by index into `positions`, every index in range; either way round.
    pub triangles: Vec<[u32; 3]>,
}

impl Wood {
    /// All triangles of those parts of a scene for which `is_wood` says so; it gets the part's index.
    #[must_use]
    pub fn of(scene: &Scene, is_wood: impl Fn(usize) -> bool) -> Self {
        let mut wood = Self::default();
        for (_, part) in scene.parts.iter().enumerate().filter(|(i, _)| is_wood(*i)) {
            let first = wood.positions.len() as u32;
            wood.positions.extend_from_slice(&part.positions);
            wood.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        wood
    }
}

/// How axes are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Method {
    /// By rings where a piece is evidently a tube, by contraction elsewhere.
    #[default]
    ByPiece,
    /// By contraction wherever there is anything between two ends: slower, for comparison.
    Contraction,
}

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkeletonParams {
    /// Which axis of the file points up.
    pub up: UpAxis,
    /// Height to scale the plant to.
    pub height: ImportHeight,
    /// How axes are found.
    pub method: Method,
    /// Lowest and highest corner of the box around the whole tree, in the file's unit, which `height` is that of; the wood's
    /// where none is known.
    pub around: Option<[Vec3; 2]>,
}

/// From the file's unit and axes to the plant's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Which of the file's axes points up: `Y` or `Z`.
    pub up: UpAxis,
    shift: DVec3,
    factor: f64,
}

impl Placement {
    /// A point of the file, in the plant's metres.
    #[must_use]
    pub fn point(&self, p: Vec3) -> Vec3 {
        ((self.upright(p.as_dvec3()) + self.shift) * self.factor).as_vec3()
    }

    /// A direction of the file, in the plant's axes; its length stays.
    #[must_use]
    pub fn direction(&self, v: Vec3) -> Vec3 {
        self.upright(v.as_dvec3()).as_vec3()
    }

    /// What lengths are multiplied with.
    #[must_use]
    pub fn scale(&self) -> f32 {
        self.factor as f32
    }

    fn upright(&self, p: DVec3) -> DVec3 {
        if self.up == UpAxis::Z { DVec3::new(p.x, p.z, -p.y) } else { p }
    }
}

/// A mesh's plant.
#[derive(Clone, Debug)]
pub struct Skeletonized {
    /// Upright, connected, metres, the main stem's base at the origin, no leaves.
    pub plant: Plant,
    /// Where the file's points are in it.
    pub placement: Placement,
    /// What was bridged, dropped or guessed, one sentence each with its figures.
    pub notes: Vec<String>,
}

/// Why wood makes no plant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SkeletonError(String);

/// Finds the axes of wood.
///
/// # Errors
///
/// When no triangle has an area, all are loose, or nothing rises above the base.
pub fn skeletonize(wood: &Wood, params: &SkeletonParams) -> Result<Skeletonized, SkeletonError> {
    let mut notes = Vec::new();
    let pieces = pieces(wood, &mut notes);
    if pieces.is_empty() {
        let why = if notes.is_empty() {
            "there is no wood: no triangle has an area"
        } else {
            "there is no wood: what is taken for it are loose pieces of one to three triangles, too few for a branch"
        };
        return Err(SkeletonError(why.into()));
    }
    let largest = pieces.iter().map(Surface::area).fold(0.0, f64::max);
    let may_be_thick = |piece: &Surface| params.method == Method::ByPiece && piece.area() >= largest * MAIN;
    let up = |piece: &Surface| may_be_thick(piece).then_some(params.up);
    let mut found: Vec<Found> = pieces.par_iter().map(|piece| limb(piece, params.method, up(piece))).collect();
    by_faces(&mut found);
    let by = |way: Way| found.iter().filter(|f| f.way == way).count();
    let total = found.len();
    let pieces = |n: usize| counted(n, "piece of surface", "pieces of surface");
    let tubes = by(Way::Tube);
    let (sticks, lost) = (by(Way::Stick), found.iter().filter(|f| f.limb.is_none()).count());
    if tubes < total {
        let contracted = by(Way::Contracted);
        let layered = by(Way::Layered);
        let thick = if layered > 0 { format!(", {layered} cut into layers") } else { String::new() };
        let tubes = counted(tubes, "tube", "tubes");
        notes.push(format!("{}: {tubes}, {contracted} contracted{thick}", pieces(total)));
    }
    if sticks > 0 {
        notes.push(format!("{} without an axis to contract to: taken as straight", pieces(sticks)));
    }
    if lost > 0 {
        notes.push(format!("{} without any length dropped", pieces(lost)));
    }
    let limbs = found.into_iter().filter_map(|f| f.limb).collect();
    let tree = join(limbs, params.up, (params.height, params.around), &mut notes).map_err(SkeletonError)?;
    let placement = Placement { up: tree.up, shift: tree.shift, factor: tree.factor };
    Ok(Skeletonized { plant: tree.plant, placement, notes })
}

/// The pieces of surface worth an axis.
fn pieces(wood: &Wood, notes: &mut Vec<String>) -> Vec<Surface> {
    let positions: Vec<DVec3> = wood.positions.iter().map(|p| p.as_dvec3()).collect();
    let welded = weld::weld(&positions, &wood.triangles, 1.0);
    drop(positions);
    let mut pieces = surface::surfaces(&welded);
    let all = pieces.len();
    pieces.retain(|p| p.triangles.len() >= LEAST_TRIANGLES || is_spike(p));
    pieces.truncate(MOST_PIECES);
    if pieces.len() < all {
        let left = all - pieces.len();
        notes.push(format!("{} of few triangles left out", counted(left, "loose piece", "loose pieces")));
    }
    pieces
}

/// Whether a piece is three triangles around a tip: the finest twigs of trees, ours too, are.
fn is_spike(piece: &Surface) -> bool {
    piece.triangles.len() == 3 && piece.positions.len() == 4 && prism::prism(piece).is_some()
}

/// What a piece of surface became.
struct Found {
    limb: Option<Limb>,
    way: Way,
    /// How far its faces are from the axis, as a share of the distance of its vertices.
    faces: f64,
}

/// How a piece's axis was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Tube,
    Contracted,
    Layered,
    Stick,
}

/// Where the piece of most wood has coarse faces, all limbs with coarse faces get the radius of those.
fn by_faces(found: &mut [Found]) {
    let wood = |f: &Found| f.limb.as_ref().map_or(0.0, Limb::wood);
    let trunk = found.iter().max_by(|a, b| wood(a).total_cmp(&wood(b)));
    if trunk.is_none_or(|trunk| trunk.faces >= facets::COARSE) {
        return;
    }
    for Found { limb, faces, .. } in found {
        if let Some(limb) = limb.as_mut().filter(|_| *faces < facets::COARSE) {
            limb.nodes.iter_mut().for_each(|n| n.radius *= *faces);
        }
    }
}

/// `up` tells which axis points up, of a piece that may be a thick shell.
fn limb(piece: &Surface, method: Method, up: Option<UpAxis>) -> Found {
    if method == Method::ByPiece
        && let Some((limb, faces)) = tube::tube(piece)
    {
        return Found { limb: Some(limb), way: Way::Tube, faces };
    }
    if let Some((limb, faces)) = prism::prism(piece) {
        return Found { limb: Some(limb), way: Way::Tube, faces };
    }
    match contracted(piece) {
        Some((limb, faces)) if !limb.edges.is_empty() => match up.and_then(|up| layered(piece, &limb, up)) {
            Some(limb) => Found { limb: Some(limb), way: Way::Layered, faces: 1.0 },
            None => Found { limb: Some(limb), way: Way::Contracted, faces },
        },
        _ => Found { limb: sleeve::stick(&piece.positions, &piece.shares()), way: Way::Stick, faces: 1.0 },
    }
}

/// The limb of a piece's layers, where its contraction is far from it and they are much nearer.
fn layered(piece: &Surface, contracted: &Limb, up: UpAxis) -> Option<Limb> {
    if piece.triangles.len() > layers::MOST_TRIANGLES {
        return None;
    }
    let closed = cap::closed(piece);
    let stray = fit::stray(&closed, contracted);
    if stray <= ASKEW {
        return None;
    }
    let ways: &[DVec3] = match up {
        UpAxis::Y => &[DVec3::Y],
        UpAxis::Z => &[DVec3::Z],
        UpAxis::Detect => &[DVec3::Y, DVec3::Z],
    };
    let feet = ways.iter().flat_map(|&up| layers::FEET.map(|share| (up, share)));
    let limbs = feet.filter_map(|(up, share)| layers::limb(&closed, up, share));
    let (near, limb) = limbs.map(|limb| (fit::stray(&closed, &limb), limb)).min_by(|a, b| a.0.total_cmp(&b.0))?;
    (near < stray * NEARER).then_some(limb)
}

fn contracted(piece: &Surface) -> Option<(Limb, f64)> {
    // Near the origin, where the quadrics of the surgery keep their digits.
    let middle = piece.positions.iter().sum::<DVec3>() / piece.positions.len().max(1) as f64;
    let mut piece = piece.clone();
    piece.positions.iter_mut().for_each(|p| *p -= middle);
    let closed = cap::closed(&piece);
    let mut most = (piece.positions.len() / ONE_OF).clamp(MOST_VERTICES, MOST_OF_MANY);
    let (coarse, places) = loop {
        let coarse = coarsen::coarsen(&closed, most);
        if let Some(places) = contract::contract(&coarse.surface) {
            break (coarse, places);
        }
        if coarse.surface.positions.len() > most || most < 500 {
            return None;
        }
        most /= 4;
    };
    let mut axes = surgery::thin(&coarse.surface, &places)?;
    axes.home = coarse.home.iter().map(|&h| axes.home[h as usize]).collect();
    let (mut limb, faces) = sleeve::limb(&piece, &axes);
    limb.nodes.iter_mut().for_each(|n| n.position += middle);
    Some((limb, faces))
}
