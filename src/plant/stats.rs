//! What `inspect` tells of a plant: its size, and by order the spread of lengths, radii, branching angles, length and
//! radius ratios and slenderness; bifurcation ratio, Murray's exponent and the topology continuity ratio.
//!
//! Everything is measured on the plant alone, so that a scan, a grown tree and a blend are measured alike. The names and
//! units of the fields are those of `inspect --json`; fields are added, never renamed.

use glam::Vec3;
use serde::Serialize;

use super::forks::{MurrayFit, bifurcation_ratio, murray, strahler};
use super::{ChainId, Curve, Distribution, Plant, Posed};
use crate::base::math;

/// The chains of one order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrderStats {
    /// Gravelius order, from 1.
    pub order: u16,
    /// How many chains.
    pub chains: usize,
    /// Arc lengths, metres.
    pub length: Distribution,
    /// Radii at the base, metres.
    pub base_radius: Distribution,
    /// Angles between a chain and its parent where it leaves it, degrees; none for order 1.
    pub branching_angle: Distribution,
    /// Chain length over parent length; none for order 1.
    pub length_ratio: Distribution,
    /// Radius at the chain's base over the parent's where it leaves it; none for order 1.
    pub radius_ratio: Distribution,
    /// Chain length over its own base radius.
    pub slenderness: Distribution,
}

/// One chain in figures; the rows that [`OrderStats`] sums up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BranchMeasures {
    /// Gravelius order, from 1.
    pub order: u16,
    /// Arc length, metres.
    pub length: f32,
    /// Radius at the base, metres.
    pub base_radius: f32,
    /// Length over base radius; none for a chain without thickness.
    pub slenderness: Option<f32>,
    /// Degrees between the chain's first 15 % and its parent's axis where it leaves; none for a stem.
    pub branching_angle: Option<f32>,
    /// Length over the parent's; none for a stem.
    pub length_ratio: Option<f32>,
    /// Base radius over the parent's radius there; none for a stem and on a parent without thickness.
    pub radius_ratio: Option<f32>,
}

/// A plant in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlantStats {
    /// Height of the highest point of an axis, metres.
    pub height: f32,
    /// Largest horizontal extent, metres.
    pub width: f32,
    /// Stems.
    pub stems: usize,
    /// All chains.
    pub chains: usize,
    /// All points of all chains.
    pub points: usize,
    /// All leaves.
    pub leaves: usize,
    /// Summed arc length of all chains, metres.
    pub wood_length: f32,
    /// Thickest stem's radius at its base, metres.
    pub base_radius: f32,
    /// Share of the branches whose base lies inside its parent's wood (2017 TVCG, Fig. 11), 0..=1; 1 without branches.
    pub topology_continuity: f32,
    /// Branches that end without bearing another.
    pub tips: usize,
    /// How many streams of one Strahler order there are for one of the next (slope of their logarithm over all orders,
    /// least squares); 0 where nothing forks. Real trees: 3 to 6.
    pub bifurcation_ratio: f32,
    /// Streams by Strahler order, from 1, the tips.
    pub strahler: Vec<usize>,
    /// Murray's exponent, least squares over all forks; see `plant/forks.rs`.
    pub murray: MurrayFit,
    /// By Gravelius order, from 1.
    pub orders: Vec<OrderStats>,
}

/// What the manifest tells of a plant. The rest of its [`PlantStats`] takes twenty times as long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlantBrief {
    pub(crate) height: f32,
    pub(crate) base_radius: f32,
    pub(crate) topology_continuity: f32,
    pub(crate) chains: usize,
    pub(crate) leaves: usize,
}

impl PlantBrief {
    /// Measures a plant; linear in its points.
    pub(crate) fn of(plant: &Plant, posed: &Posed) -> Self {
        let stems = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_none());
        Self {
            height: posed.positions().iter().fold(0.0, |height, p| height.max(p.y)),
            base_radius: stems.fold(0.0, |r, id| r.max(plant.radii(id)[0])),
            topology_continuity: topology_continuity(plant, posed),
            chains: plant.chains().len(),
            leaves: plant.leaves().len(),
        }
    }
}

impl PlantStats {
    /// Measures a plant; linear in its points, but for sorting.
    #[must_use]
    pub fn of(plant: &Plant) -> Self {
        let posed = plant.pose();
        let branches = measure(plant, &posed);
        let children = plant.children();
        let streams = strahler(plant, &children);
        let deepest = branches.iter().map(|b| b.order).max().unwrap_or(0);
        let mut by_order: Vec<Vec<BranchMeasures>> = vec![Vec::new(); usize::from(deepest)];
        for branch in &branches {
            by_order[usize::from(branch.order) - 1].push(*branch);
        }
        let orders = by_order.iter().zip(1..).map(|(branches, order)| OrderStats::of(order, branches)).collect();
        let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
        for p in posed.positions() {
            (low, high) = (low.min(*p), high.max(*p));
        }
        let PlantBrief { height, base_radius, topology_continuity, chains, leaves } = PlantBrief::of(plant, &posed);
        Self {
            height,
            width: (high.x - low.x).max(high.z - low.z),
            stems: plant.chains().iter().filter(|c| c.parent.is_none()).count(),
            chains,
            points: plant.all_points().len(),
            leaves,
            wood_length: branches.iter().map(|b| b.length).sum(),
            base_radius,
            topology_continuity,
            tips: children.iter().filter(|c| c.is_empty()).count(),
            bifurcation_ratio: bifurcation_ratio(&streams),
            strahler: streams,
            murray: murray(plant, &children),
            orders,
        }
    }
}

impl OrderStats {
    /// Sums up the branches of one order.
    fn of(order: u16, branches: &[BranchMeasures]) -> Self {
        let each = |f: fn(&BranchMeasures) -> Option<f32>| Distribution::of(branches.iter().filter_map(f).collect());
        Self {
            order,
            chains: branches.len(),
            length: each(|b| Some(b.length)),
            base_radius: each(|b| Some(b.base_radius)),
            branching_angle: each(|b| b.branching_angle),
            length_ratio: each(|b| b.length_ratio),
            radius_ratio: each(|b| b.radius_ratio),
            slenderness: each(|b| b.slenderness),
        }
    }
}

/// Measures every chain, in order of id; linear in points.
#[must_use]
pub fn measure_branches(plant: &Plant) -> Vec<BranchMeasures> {
    measure(plant, &plant.pose())
}

fn measure(plant: &Plant, posed: &Posed) -> Vec<BranchMeasures> {
    let lengths: Vec<f32> = plant.chain_ids().map(|id| posed.curve(plant, id).length()).collect();
    let over = |value: f32, by: f32| (by > 0.0).then(|| value / by);
    plant
        .chain_ids()
        .map(|id| {
            let chain = plant.chain(id);
            let (length, base_radius) = (lengths[id.index()], plant.radii(id)[0]);
            let there =
                |parent: ChainId| posed.curve(plant, parent).value(plant.radii(parent), f64::from(chain.location));
            BranchMeasures {
                order: chain.order,
                length,
                base_radius,
                slenderness: over(length, base_radius),
                branching_angle: branching_angle(plant, posed, id),
                length_ratio: chain.parent.and_then(|parent| over(length, lengths[parent.index()])),
                radius_ratio: chain.parent.and_then(|parent| over(base_radius, there(parent))),
            }
        })
        .collect()
}

/// Degrees between a chain's first stretch and its parent's direction there.
fn branching_angle(plant: &Plant, posed: &Posed, id: ChainId) -> Option<f32> {
    let chain = plant.chain(id);
    let axis = posed.frame(chain.parent?, chain.location).y;
    let points = posed.chain(plant, id);
    let first = Curve::new(points).point(0.15) - points[0];
    (first.length() > 0.0).then(|| math::angle(axis, first).to_degrees())
}

/// Share of the branches whose first world position lies within the parent's tapered wood.
///
/// Measured on world positions against all of the parent's segments, so that it does not assume what the type promises.
fn topology_continuity(plant: &Plant, posed: &Posed) -> f32 {
    let (mut inside, mut all) = (0_usize, 0_usize);
    // A tolerance for rounding only: a millionth of the plant's extent.
    let extent = posed.positions().iter().fold(0.0_f32, |e, p| e.max(p.length()));
    for id in plant.chain_ids() {
        let Some(parent) = plant.chain(id).parent else { continue };
        let base = posed.chain(plant, id)[0];
        let axis = posed.chain(plant, parent);
        let radii = plant.radii(parent);
        all += 1;
        let holds = |i: usize| {
            let (a, b) = (axis[i - 1], axis[i]);
            let along = b - a;
            let t = if along == Vec3::ZERO {
                0.0
            } else {
                ((base - a).dot(along) / along.length_squared()).clamp(0.0, 1.0)
            };
            let radius = radii[i - 1] + (radii[i] - radii[i - 1]) * t;
            base.distance(a + along * t) <= radius + extent * 1e-6
        };
        // The segment at the location nearly always holds it; only a branch that is off looks at all of them.
        let near = posed.curve(plant, parent).segment(f64::from(plant.chain(id).location)).0 + 1;
        inside += usize::from((near < axis.len() && holds(near)) || (1..axis.len()).any(holds));
    }
    if all == 0 { 1.0 } else { inside as f32 / all as f32 }
}
