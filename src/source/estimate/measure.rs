//! What is measured on a plant to grow more like it: the same on the plant that is given and on trial trees.
//!
//! Lengths are over the plant's height, angles degrees, unless said otherwise. Branches are told apart by length and not
//! by order, since a scan's orders depend on every missed twig: the *limbs* are those that are at least [`LIMB`] of the
//! longest, and no fewer than one and a half times the root of the number of branches; the rest is cut into groups of
//! falling length.

use glam::Vec3;

use super::radii::{Carried, Rule, fit};
use crate::base::math;
use crate::plant::{BranchMeasures, ChainId, Plant, Posed, measure_branches};

/// Share of the longest branch from which on a branch is a limb.
const LIMB: f32 = 0.35;
/// Most limbs.
const MOST_LIMBS: usize = 300;
/// Slices of the height in which the trunk is compared with the rest.
const SLICES: usize = 24;
/// Share of the wood's cross section that makes a stem the trunk.
const LEADS: f32 = 0.3;

/// Branches of about one length.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Group {
    pub(super) count: usize,
    /// Median.
    pub(super) length: f32,
    /// Median branching angle.
    pub(super) angle: f32,
    /// Median turn away from upright over a plant height of arc.
    pub(super) bend: f32,
    /// How far from the plant's base the innermost 5 % of their tips are, over the outermost.
    pub(super) inner: f32,
}

/// A measured plant.
#[derive(Clone, Debug)]
pub(super) struct Measures {
    /// Metres.
    pub(super) height: f32,
    /// Height and distance from the axis of each stem's tip.
    pub(super) stem_tips: Vec<[f32; 2]>,
    /// Median inclination of the stems where they start.
    pub(super) stem_lean: f32,
    /// How high the first stem leads.
    pub(super) trunk: f32,
    /// Below this hardly any branch leaves.
    pub(super) bole: f32,
    /// Of the first stem, metres, without its flare.
    pub(super) base_radius: f32,
    /// As in a species.
    pub(super) flare: f32,
    /// As in a species, radii.
    pub(super) flare_height: f32,
    /// 95 % of branches are shorter in radii of their base.
    pub(super) slenderness: f32,
    /// Median arc length over chord of the longer branches.
    pub(super) winding: f32,
    /// Of the radii.
    pub(super) rule: Rule,
    /// The limbs as a group.
    pub(super) limbs: Group,
    /// Height and distance from the axis of their tips.
    pub(super) limb_tips: Vec<[f32; 2]>,
    /// Inclination from the vertical with which a limb leaves: at the ground and at the top.
    pub(super) limb_start: [f32; 2],
    /// The other branches, longest first.
    pub(super) groups: Vec<Group>,
    /// Nine tenths of all tips are nearer to the axis.
    pub(super) out: f32,
    /// All but stems.
    pub(super) branches: usize,
}

/// One branch.
struct Branch {
    length: f32,
    angle: f32,
    base: f32,
    /// From the vertical where it leaves, and near its tip.
    inclination: [f32; 2],
    tip: [f32; 2],
    from_root: f32,
}

impl Measures {
    /// Measures a plant; `like` another whose number of limbs and groups it takes. Linear in points but for sorting.
    pub(super) fn of(plant: &Plant, like: Option<&Self>) -> Self {
        let posed = plant.pose();
        let rows = measure_branches(plant);
        let height = plant.height().max(1e-6);
        let (tips, wood) = carried(plant, &rows);
        let first = leading(plant, &tips);
        let (mut branches, mut stems, mut stem_leans) = (Vec::new(), Vec::new(), Vec::new());
        for id in plant.chain_ids() {
            let branch = Branch::of(plant, &posed, id, &rows[id.index()], height);
            if plant.chain(id).parent.is_some() {
                branches.push(branch);
            } else {
                stems.push(branch.tip);
                stem_leans.push(branch.inclination[0]);
            }
        }
        let all = branches.len();
        let out = quantile(branches.iter().map(|b| b.tip[1]).collect(), 0.9);
        branches.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.base.total_cmp(&b.base)));
        let longest = branches.first().map_or(0.0, |b| b.length);
        let limbs = like.map_or_else(
            || {
                let long = branches.iter().filter(|b| b.length >= longest * LIMB).count();
                // One limb may be far longer than all others.
                let least = (1.5 * (branches.len() as f32).sqrt()).ceil() as usize;
                long.max(least).min(branches.len()).min(MOST_LIMBS)
            },
            |like| like.limbs.count.min(branches.len()),
        );
        let rest = branches.split_off(limbs);
        let parts = like.map_or_else(|| group_count(rest.len()), |like| like.groups.len());
        let mut groups = Vec::new();
        for part in 0..parts {
            groups.push(Group::of(&rest[rest.len() * part / parts..rest.len() * (part + 1) / parts]));
        }
        let (base_radius, flare, flare_height) = foot(plant, first);
        let radii: Vec<Carried> = plant
            .chain_ids()
            .map(|id| {
                let radius = if id == first { base_radius } else { rows[id.index()].base_radius };
                Carried { tips: tips[id.index()], wood: wood[id.index()], radius }
            })
            .collect();
        let windings = plant.chain_ids().filter(|id| rows[id.index()].length > 0.05 * height).map(|id| {
            let points = posed.chain(plant, id);
            rows[id.index()].length / points[points.len() - 1].distance(points[0]).max(1e-6)
        });
        let slender = rows.iter().filter(|r| r.order > 1).filter_map(|r| r.slenderness).collect();
        Self {
            height,
            trunk: trunk(plant, &posed, first, height),
            bole: bole(plant, &posed, &wood, height),
            stem_tips: stems,
            stem_lean: quantile(stem_leans, 0.5),
            base_radius,
            flare,
            flare_height,
            slenderness: quantile(slender, 0.95),
            winding: quantile(windings.collect(), 0.5),
            rule: fit(&radii),
            limbs: Group::of(&branches),
            limb_tips: branches.iter().map(|b| b.tip).collect(),
            limb_start: line(branches.iter().map(|b| [b.base, b.inclination[0]])),
            groups,
            out,
            branches: all,
        }
    }
}

/// Into how many groups the branches that are no limbs are cut.
const fn group_count(branches: usize) -> usize {
    match branches {
        0 => 0,
        1..15 => 1,
        15..120 => 2,
        _ => 3,
    }
}

impl Branch {
    fn of(plant: &Plant, posed: &Posed, id: ChainId, row: &BranchMeasures, height: f32) -> Self {
        let curve = posed.curve(plant, id);
        let points = posed.chain(plant, id);
        let (base, tip) = (points[0], points[points.len() - 1]);
        let inclination = |from: f64, to: f64| {
            let way = curve.point(to) - curve.point(from);
            if way == Vec3::ZERO { 0.0 } else { math::angle(Vec3::Y, way).to_degrees() }
        };
        Self {
            length: row.length / height,
            angle: row.branching_angle.unwrap_or(0.0),
            base: base.y / height,
            inclination: [inclination(0.0, 0.2), inclination(0.7, 1.0)],
            tip: [tip.y / height, (tip.x * tip.x + tip.z * tip.z).sqrt() / height],
            from_root: tip.length() / height,
        }
    }
}

impl Group {
    fn of(branches: &[Branch]) -> Self {
        let each = |f: &dyn Fn(&Branch) -> f32| branches.iter().map(f).collect::<Vec<f32>>();
        let far = branches.iter().fold(1e-6_f32, |far, b| far.max(b.from_root));
        Self {
            count: branches.len(),
            length: quantile(each(&|b| b.length), 0.5),
            angle: quantile(each(&|b| b.angle), 0.5),
            bend: quantile(each(&|b| (b.inclination[1] - b.inclination[0]) / b.length.max(0.01)), 0.5),
            inner: quantile(each(&|b| b.from_root), 0.05) / far,
        }
    }
}

/// The value at a share of a sample; 0 of none.
pub(super) fn quantile(mut values: Vec<f32>, share: f32) -> f32 {
    values.retain(|v| v.is_finite());
    values.sort_unstable_by(f32::total_cmp);
    values.get(((values.len().max(1) - 1) as f32 * share + 0.5) as usize).copied().unwrap_or(0.0)
}

/// Least squares of a line through points, at 0 and at 1; their mean where they have no spread.
fn line(points: impl Iterator<Item = [f32; 2]> + Clone) -> [f32; 2] {
    let n = points.clone().count().max(1) as f32;
    let mean = points.clone().fold([0.0_f32; 2], |m, p| [m[0] + p[0] / n, m[1] + p[1] / n]);
    let (mut slope, mut spread) = (0.0_f32, 0.0_f32);
    for p in points {
        slope += (p[0] - mean[0]) * (p[1] - mean[1]);
        spread += (p[0] - mean[0]) * (p[0] - mean[0]);
    }
    let slope = if spread > 1e-3 * n { slope / spread } else { 0.0 };
    [mean[1] - slope * mean[0], mean[1] + slope * (1.0 - mean[0])]
}

/// Tips and wood (metres) of each chain with all it bears.
fn carried(plant: &Plant, rows: &[BranchMeasures]) -> (Vec<f32>, Vec<f32>) {
    let mut tips = vec![1.0_f32; rows.len()];
    let mut wood: Vec<f32> = rows.iter().map(|r| r.length).collect();
    for id in plant.chain_ids().rev() {
        if let Some(parent) = plant.chain(id).parent {
            tips[parent.index()] += tips[id.index()];
            wood[parent.index()] += wood[id.index()];
        }
    }
    (tips, wood)
}

/// Radius of the foot of the stem that bears most, without its flare, metres.
pub(super) fn base_radius(plant: &Plant) -> f32 {
    let (tips, _) = carried(plant, &measure_branches(plant));
    foot(plant, leading(plant, &tips)).0
}

/// The stem that bears most tips, the first of equals.
fn leading(plant: &Plant, tips: &[f32]) -> ChainId {
    let stems = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_none());
    stems.max_by_key(|id| (tips[id.index()] as u64, std::cmp::Reverse(id.0))).unwrap_or(ChainId(0))
}

/// Radius of a stem's foot without its flare, the flare and its height. The stem from 8 % of its length on is taken to
/// go on below as it does above.
fn foot(plant: &Plant, stem: ChainId) -> (f32, f32, f32) {
    let curve = crate::plant::Curve::new(plant.points(stem));
    let radius = |t: f64| curve.value(plant.radii(stem), t);
    let (low, high) = (radius(0.08), radius(0.2));
    let straight = (low + (low - high).max(0.0) * 0.08 / 0.12).max(1e-6);
    let flare = (radius(0.0) / straight - 1.0).clamp(0.0, 2.0);
    let reach = (1..=8).find(|&k| radius(f64::from(k) * 0.01) <= straight * 1.03).unwrap_or(8);
    let flare_height = reach as f32 * 0.02 * curve.length() / straight;
    (if flare > 0.05 { straight } else { radius(0.0).max(1e-6) }, if flare > 0.05 { flare } else { 0.0 }, flare_height)
}

/// How high up a stem holds its share of the wood's cross section; all the way up where it always does.
fn trunk(plant: &Plant, posed: &Posed, stem: ChainId, height: f32) -> f32 {
    let (mut own, mut all) = ([0.0_f32; SLICES], [0.0_f32; SLICES]);
    for id in plant.chain_ids() {
        let (points, radii) = (posed.chain(plant, id), plant.radii(id));
        for i in 1..points.len() {
            let (a, b) = (points[i - 1].y / height, points[i].y / height);
            let at = |y: f32| (y * SLICES as f32 - 0.5).clamp(-1.0, SLICES as f32);
            let (from, to) = (at(a.min(b)), at(a.max(b)));
            for slice in (from + 1.0).floor() as usize..=(to.floor().max(0.0) as usize).min(SLICES - 1) {
                if (slice as f32) <= to && (slice as f32) > from {
                    all[slice] += radii[i] * radii[i];
                    own[slice] += if id == stem { radii[i] * radii[i] } else { 0.0 };
                }
            }
        }
    }
    let leads = (0..SLICES).take_while(|&s| own[s] >= all[s] * LEADS || all[s] == 0.0).count();
    (leads as f32 / SLICES as f32).min(1.0)
}

/// The height below which a 30th of the branches' wood leaves the stems.
fn bole(plant: &Plant, posed: &Posed, wood: &[f32], height: f32) -> f32 {
    let on_stem = |id: &ChainId| plant.chain(*id).order == 2;
    let mut leaving: Vec<(f32, f32)> =
        plant.chain_ids().filter(on_stem).map(|id| (posed.chain(plant, id)[0].y / height, wood[id.index()])).collect();
    leaving.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let all: f32 = leaving.iter().map(|l| l.1).sum();
    let mut sum = 0.0;
    for (at, wood) in leaving {
        sum += wood;
        if sum >= all / 30.0 {
            return at.clamp(0.0, 0.9);
        }
    }
    0.0
}
