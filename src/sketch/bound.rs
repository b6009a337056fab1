//! A plant bound to its cages: made once, and drawn on as often as a designer likes.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::cages::Cages;
use super::crown::Crown;
use super::frame::ViewPlane;
use super::lobe::LobeSurface;
use super::mean_value::mean_value;
use super::outline::resampled;
use super::raster::{Grid, Mask};
use super::region::{Fill, Region, twice_signed_area};
use super::spine::{Handle, Spines, arcs};
use super::svg::SketchError;
use crate::base::math;
use crate::plant::{ChainId, Plant, Posed};
use crate::relate::{PatternParams, groups};

/// Chains longer than this share of the crown's size have handles between base and tip as well.
const LONG: f32 = 0.1;
/// How far from a crown's middle a stem stands that its outline is revolved about, over the crown's reach.
const BELOW: f32 = 0.5;
/// How near to the silhouette lobes are matched with it alone, and from where not at all, over the crown's size.
const RIM: (f32, f32) = (0.05, 0.3);

/// Where sketches of a plant are seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SketchViews {
    /// Azimuth of the front in radians; 0 looks from +z, so that +x is to the right.
    pub azimuth: f32,
    /// Elevation of the front in radians, -π/2..=π/2; 0 is level, π/2 looks straight down on a plan of the crown, azimuth at
    /// its lower edge. Other than 0 only where the front is the only view. See 2018, 5.1.
    pub elevation: f32,
    /// How many views there are.
    pub kind: ViewKind,
    /// How much of a sketch's detail is kept, 0..=1: from 24 to 168 places along its outline.
    pub detail: f32,
}

/// How many views there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewKind {
    /// The front; the crown gets as much deeper as the outline's area gets larger, by the root.
    Front,
    /// The front; depth stays as it is.
    FrontKept,
    /// The front, and the side at a right angle, from the azimuth plus 90 degrees.
    FrontAndSide,
    /// All round: the outline's halves are revolved about the stem's foot where a lone stem stands below its crown, so that
    /// it stays its axis, else about the crown's middle.
    Revolved,
    /// The same about the foot of the thickest stem, which is the axis of an outline that is drawn with its trunk.
    RevolvedAboutFoot,
}

/// A crown as one view sees it.
#[derive(Clone, Debug)]
pub(super) struct Chart {
    pub(super) plane: ViewPlane,
    /// Its silhouette, as fine as it was found.
    pub(super) outline: Vec<Vec2>,
    pub(super) area: f32,
    /// The silhouette as the root cage.
    pub(super) root: Vec<Vec2>,
    pub(super) cages: Cages,
    /// Where handles are seen.
    pub(super) seen: Vec<Vec2>,
    /// The cage of each handle, and how it follows that one's vertices.
    cage: Vec<u32>,
    first: Vec<u32>,
    weights: Vec<f32>,
    /// Coordinates of each handle in the root.
    in_root: Vec<f32>,
    /// How near each handle is to the silhouette, 0..=1: 1 at it.
    pub(super) rim: Vec<f32>,
}

impl ViewKind {
    /// Whether an outline is revolved.
    pub(super) fn is_round(self) -> bool {
        matches!(self, Self::Revolved | Self::RevolvedAboutFoot)
    }
}

/// A plant bound to the cages of its lobes: [`draw`](Self::draw) on it.
#[derive(Clone, Debug)]
pub struct Sketcher {
    pub(super) plant: Arc<Plant>,
    pub(super) positions: Vec<Vec3>,
    pub(super) handles: Vec<Handle>,
    pub(super) spines: Spines,
    pub(super) charts: Vec<Chart>,
    pub(super) views: SketchViews,
    pub(super) reach: f32,
    pub(super) size: f32,
    pub(super) height: f32,
    /// The foot of the thickest stem.
    pub(super) foot: Vec3,
    /// The point of its branch before each leaf, and the share of the way to the next.
    pub(super) leaves: Vec<(u32, f32)>,
    /// The same for each handle.
    pub(super) on: Vec<(u32, f32)>,
    /// Where each leaf is and how far it covers about, metres; empty where branches are the crown.
    pub(super) discs: Vec<(Vec3, f32)>,
}

impl Sketcher {
    /// Binds a plant. `n log n` in its chains, linear in points and leaves.
    ///
    /// # Errors
    ///
    /// When it has no crown that has an extent, and when a view is raised that has to be level.
    pub fn bind(plant: Arc<Plant>, views: SketchViews) -> Result<Self, SketchError> {
        let raised = match views.kind {
            ViewKind::Front | ViewKind::FrontKept => None,
            ViewKind::FrontAndSide => Some("a view from the side"),
            ViewKind::Revolved | ViewKind::RevolvedAboutFoot => Some("an outline that is revolved"),
        };
        if let Some(what) = raised.filter(|_| views.elevation != 0.0) {
            return Err(SketchError::Raised { what });
        }
        let elevation = if views.elevation.is_finite() {
            views.elevation.clamp(-std::f32::consts::FRAC_PI_2, std::f32::consts::FRAC_PI_2)
        } else {
            0.0
        };
        let posed = plant.pose();
        let crown = Crown::of(&plant, &posed).ok_or(SketchError::NoCrown)?;
        let foot = thickest_stem(&plant).map_or(Vec3::ZERO, |id| plant.chain(id).origin);
        let about_foot = views.kind == ViewKind::RevolvedAboutFoot || stands_below(&plant, &crown, foot);
        let above = if about_foot { foot } else { crown.middle };
        let axis = Vec3::new(above.x, 0.0, above.z);
        let front = ViewPlane::of(views.azimuth, elevation);
        let planes = match views.kind {
            ViewKind::Front | ViewKind::FrontKept => vec![front],
            ViewKind::FrontAndSide => {
                vec![front, ViewPlane::of(views.azimuth + std::f32::consts::FRAC_PI_2, 0.0)]
            }
            ViewKind::Revolved | ViewKind::RevolvedAboutFoot => vec![ViewPlane::Round { axis }],
        };
        let outlines: Vec<Vec<Vec2>> = planes.iter().map(|plane| crown.silhouette(plane)).collect();
        if outlines.iter().any(|o| o.len() < 3 || twice_signed_area(o) <= 0.0) {
            return Err(SketchError::NoCrown);
        }
        let handles = handles(&plant, &posed, &crown, &planes[0], &outlines[0]);
        let spines = Spines::bind(&plant, &posed, &handles);
        let groups = groups(&plant, &posed, &PatternParams::default());
        let detail = if views.detail.is_finite() { views.detail.clamp(0.0, 1.0) } else { 0.5 };
        let count = 24 + 2 * (72.0 * detail) as usize;
        let charts = planes
            .into_iter()
            .zip(outlines)
            .map(|(plane, outline)| {
                let root = resampled(&outline, count);
                let deep = |p: &Vec3| plane.seen(*p).extend(plane.depth(*p));
                let own: Vec<Vec<Vec3>> = crown.own.iter().map(|own| own.iter().map(deep).collect()).collect();
                let cages = Cages::bind(&plant, &groups, &own, &root, crown.size);
                Chart::new(plane, outline, root, cages, &plant, &handles, &crown)
            })
            .collect();
        let leaves = plant
            .leaves()
            .par_iter()
            .map(|leaf| {
                let (i, f) = posed.curve(&plant, leaf.chain).segment(f64::from(leaf.location));
                ((plant.span(leaf.chain).start + i) as u32, f)
            })
            .collect();
        let on = handles
            .iter()
            .map(|h| {
                let curve = posed.curve(&plant, h.chain);
                let (i, f) = curve.segment((h.arc / f64::from(curve.length()).max(1e-12)).min(1.0));
                ((plant.span(h.chain).start + i) as u32, f)
            })
            .collect();
        let discs = if crown.discs.len() == plant.leaves().len() { crown.discs } else { Vec::new() };
        let (positions, height) = (posed.positions().to_vec(), plant.height());
        let (reach, size) = (crown.reach, crown.size);
        Ok(Self { plant, positions, handles, spines, charts, views, reach, size, height, foot, leaves, on, discs })
    }

    /// The plant as it was bound.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// How many handles cages move, and how many cages the first view has.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.handles.len(), self.charts[0].cages.len())
    }
}

impl Chart {
    fn new(
        plane: ViewPlane,
        outline: Vec<Vec2>,
        root: Vec<Vec2>,
        cages: Cages,
        plant: &Plant,
        handles: &[Handle],
        crown: &Crown,
    ) -> Self {
        let area = Region::of(std::slice::from_ref(&outline), Fill::NonZero).area();
        let seen: Vec<Vec2> = handles.iter().map(|h| plane.seen(h.position)).collect();
        let cage: Vec<u32> = handles
            .iter()
            .map(|h| {
                let points = plant.span(h.chain).len();
                let tip = points > 0 && !crown.own[h.chain.index()].is_empty() && h.weight > 0.0;
                if tip { cages.inner(h.chain) } else { cages.outer(h.chain) }
            })
            .collect();
        let in_root: Vec<f32> = seen.par_iter().flat_map_iter(|p| mean_value(&[&root], *p)).collect();
        let mut holds = vec![false; cages.len()];
        cage.iter().for_each(|c| holds[*c as usize] = true);
        let surfaces: Vec<Option<LobeSurface>> =
            (0..cages.len()).into_par_iter().map(|c| if holds[c] { cages.surface(c as u32) } else { None }).collect();
        // In a lobe by its surface, in the crown itself by its silhouette.
        let coordinates = |i: usize| match &surfaces[cage[i] as usize] {
            Some(surface) => surface.weights(seen[i].extend(plane.depth(handles[i].position))),
            None => in_root[i * root.len()..][..root.len()].to_vec(),
        };
        let of: Vec<Vec<f32>> = (0..seen.len()).into_par_iter().map(coordinates).collect();
        let near = |p: &Vec2| root.iter().map(|v| v.distance_squared(*p)).fold(f32::INFINITY, f32::min).sqrt();
        let of_rim = |p: &Vec2| 1.0 - math::smoothstep(crown.size * RIM.0, crown.size * RIM.1, near(p));
        let rim: Vec<f32> = seen.par_iter().map(of_rim).collect();
        let mut first = vec![0_u32];
        let mut weights = Vec::new();
        for own in of {
            weights.extend(own);
            first.push(weights.len() as u32);
        }
        Self { plane, outline, area, root, cages, seen, cage, first, weights, in_root, rim }
    }

    /// Where handles are seen when the vertices of all cages are these.
    pub(super) fn handles(&self, vertices: &[Vec2]) -> Vec<Vec2> {
        let rest = self.cages.rest();
        (0..self.seen.len())
            .map(|i| {
                let weights = &self.weights[self.first[i] as usize..self.first[i + 1] as usize];
                let (was, is) = (self.cages.ring(self.cage[i], rest), self.cages.ring(self.cage[i], vertices));
                let shift = weights.iter().zip(was).zip(is).fold(Vec2::ZERO, |sum, ((w, a), b)| sum + (*b - *a) * *w);
                self.seen[i] + shift
            })
            .collect()
    }

    /// The same by the root cage alone.
    pub(super) fn handles_by_root(&self, root: &[Vec2]) -> Vec<Vec2> {
        let shift: Vec<Vec2> = root.iter().zip(&self.root).map(|(b, a)| *b - *a).collect();
        let by = self.in_root.chunks_exact(root.len()).map(|weights| super::cages::sum(weights, &shift));
        self.seen.iter().zip(by).map(|(p, s)| *p + s).collect()
    }
}

/// The stem that is thickest at its foot, the first of equals.
pub(super) fn thickest_stem(plant: &Plant) -> Option<ChainId> {
    let stems = plant.chain_ids().filter(|id| plant.chain(*id).parent.is_none());
    let thick = |id: &ChainId| plant.radii(*id).first().copied().unwrap_or(0.0);
    stems.max_by(|a, b| thick(a).total_cmp(&thick(b)).then(b.cmp(a)))
}

/// Whether a crown hangs over the foot of a lone stem: nearer to its middle than [`BELOW`] of its reach.
fn stands_below(plant: &Plant, crown: &Crown, foot: Vec3) -> bool {
    let lone = plant.chains().iter().filter(|c| c.parent.is_none()).count() == 1;
    let level = |p: Vec3| (p - crown.middle).with_y(0.0).length();
    let reach = crown.discs.iter().map(|(p, _)| level(*p)).fold(0.0, f32::max);
    lone && level(foot) <= BELOW * reach
}

/// The handles of a plant, chain after chain, along each.
fn handles(plant: &Plant, posed: &Posed, crown: &Crown, plane: &ViewPlane, outline: &[Vec2]) -> Vec<Handle> {
    let grid = Grid::over(super::fit::ends(outline), 96, crown.size * 0.05);
    let within = Mask::of_region(&Region::of(&[outline.to_vec()], Fill::NonZero), grid);
    let mut bears = vec![false; plant.chains().len()];
    // Whether a chain or what it bears has any foliage.
    let mut leafy: Vec<bool> = crown.own.iter().map(|own| !own.is_empty()).collect();
    for id in plant.chain_ids().rev() {
        if let Some(parent) = plant.chain(id).parent {
            bears[parent.index()] = true;
            leafy[parent.index()] |= leafy[id.index()];
        }
    }
    let of = |id: ChainId| -> Vec<Handle> {
        if !leafy[id.index()] {
            return Vec::new();
        }
        let points = posed.chain(plant, id);
        let arc = arcs(points);
        let length = arc[arc.len() - 1];
        let curve = posed.curve(plant, id);
        let long = length as f32 / crown.size;
        let between = match long {
            l if l < LONG => 0,
            l if l < 0.25 => 2,
            l if l < 0.6 => 4,
            _ => 7,
        };
        let mut shares: Vec<f64> = (1..=between).map(|k| f64::from(k) / f64::from(between + 1)).collect();
        shares.retain(|s| within.holds(plane.seen(curve.point(*s))));
        shares.push(1.0);
        let weight = crown.weights[id.index()] / shares.len() as f32;
        shares.into_iter().map(|s| Handle { chain: id, position: curve.point(s), arc: length * s, weight }).collect()
    };
    let all: Vec<Vec<Handle>> = (0..plant.chains().len() as u32).into_par_iter().map(|i| of(ChainId(i))).collect();
    all.into_iter().flatten().collect()
}
