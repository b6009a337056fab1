//! What `inspect` tells of a plant: chains by order, heights, radii, branching angles, length ratios and the topology
//! continuity ratio.

use glam::Vec3;
use serde::Serialize;

use super::{ChainId, Curve, Plant, Posed};
use crate::base::math;

/// Spread of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Distribution {
    /// How many values.
    pub count: usize,
    /// Smallest value.
    pub min: f32,
    /// 25th percentile.
    pub lower: f32,
    /// Median.
    pub median: f32,
    /// 75th percentile.
    pub upper: f32,
    /// Largest value.
    pub max: f32,
}

impl Distribution {
    /// The spread of some values; all zero when there are none.
    #[must_use]
    pub fn of(mut values: Vec<f32>) -> Self {
        values.sort_by(f32::total_cmp);
        let at = |q: f32| match values.len() {
            0 => 0.0,
            n => values[((n - 1) as f32 * q + 0.5) as usize],
        };
        Self { count: values.len(), min: at(0.0), lower: at(0.25), median: at(0.5), upper: at(0.75), max: at(1.0) }
    }
}

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
    /// By order, from 1.
    pub orders: Vec<OrderStats>,
}

impl PlantStats {
    /// Measures a plant; linear in its points, but for sorting.
    #[must_use]
    pub fn of(plant: &Plant) -> Self {
        let posed = plant.pose();
        let lengths: Vec<f32> = plant.chain_ids().map(|id| Curve::new(plant.points(id)).length()).collect();
        let deepest = plant.chains().iter().map(|c| c.order).max().unwrap_or(0);
        let orders = (1..=deepest)
            .map(|order| {
                let ids: Vec<ChainId> = plant.chain_ids().filter(|&id| plant.chain(id).order == order).collect();
                let each =
                    |f: &dyn Fn(ChainId) -> Option<f32>| Distribution::of(ids.iter().filter_map(|&id| f(id)).collect());
                OrderStats {
                    order,
                    chains: ids.len(),
                    length: each(&|id| Some(lengths[id.index()])),
                    base_radius: each(&|id| Some(plant.radii(id)[0])),
                    branching_angle: each(&|id| branching_angle(plant, &posed, id)),
                    length_ratio: each(&|id| {
                        let parent = lengths[plant.chain(id).parent?.index()];
                        (parent > 0.0).then(|| lengths[id.index()] / parent)
                    }),
                }
            })
            .collect();
        let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
        for p in posed.positions() {
            (low, high) = (low.min(*p), high.max(*p));
        }
        Self {
            height: high.y,
            width: (high.x - low.x).max(high.z - low.z),
            stems: plant.chains().iter().filter(|c| c.parent.is_none()).count(),
            chains: plant.chains().len(),
            points: plant.all_points().len(),
            leaves: plant.leaves().len(),
            wood_length: lengths.iter().sum(),
            base_radius: plant
                .chain_ids()
                .filter(|&id| plant.chain(id).parent.is_none())
                .fold(0.0, |r, id| r.max(plant.radii(id)[0])),
            topology_continuity: topology_continuity(plant, &posed),
            orders,
        }
    }
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
