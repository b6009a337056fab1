//! The trunk support weight (2017 CAVW, 7; after the pipe model of Shinozaki et al. 1964): how much of a tree the trunk
//! that bears most of it bears.
//!
//! A stem bears at its root all the wood and leaves of it and of its branches. Stems that lie in one another are one trunk as
//! far as their cross-sections overlap: a stem bears, beside its own, the share of every other's load that the lens of
//! both discs has of the smaller disc, as a mean over its clear bole, from the ground up to where branches begin (of stems that
//! share a bole, from where that forks). So a
//! trunk that opens into several stems hands its load over as they part, and not at once because they count as several. The
//! heaviest stem's load over the tree's whole weight is the figure: 1 for a single trunk.
//!
//! Rejected: the overlap at the ground, where the rods of a shrub stand in one another; that just below the lowest branch
//! alone, as a trunk that opens there first would have handed over all it bears while most of its bole is still one; the
//! load above the bole instead of that at the root, which rose and fell on the way with the weight of boles.
//!
//! Wood weighs [`WOOD`], leaves [`LEAF`]; a leaf card's area is its length times its width.

use glam::Vec3;

use super::{ChainId, Plant, Posed};
use crate::base::math;

/// Green wood, kilograms a cubic metre.
const WOOD: f64 = 900.0;
/// Fresh leaves, kilograms a square metre of card; a card is about half covered.
const LEAF: f64 = 0.1;

/// Share of the branches' weight, the lowest, whose mean place is where they begin.
const LOWEST: f64 = 0.1;
/// Places along its clear bole at which a stem is compared with the others.
const BOLE: u32 = 8;
/// What the trunk that bears most bears, as a share of the plant's weight, 0..=1; 0 for a plant without weight.
///
/// Linear in points and leaves, and quadratic in stems up to 256 of them, beyond which each bears its own.
#[must_use]
pub fn trunk_support(plant: &Plant, posed: &Posed) -> f32 {
    trunk_support_by(plant, posed, &|_| 1.0, &|_| 0.0)
}

/// As [`trunk_support`], where `count` says how much of a chain's own wood and leaves there is: on the way of a split
/// several copies of one chain lie in one another, which are together no more than that chain. `bole` says up to which
/// arc-length parameter a stem is one with others that part from it there: its clear bole begins above.
#[must_use]
pub fn trunk_support_by(
    plant: &Plant,
    posed: &Posed,
    count: &dyn Fn(ChainId) -> f32,
    bole: &dyn Fn(ChainId) -> f32,
) -> f32 {
    let loads = Loads::of(plant, posed, count);
    if loads.whole.is_nan() || loads.whole <= 0.0 {
        return 0.0;
    }
    let stems: Vec<ChainId> = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_none()).collect();
    let lowest = f64::from(loads.lowest());
    let mut heaviest = 0.0_f64;
    for &id in &stems {
        let own = posed.curve(plant, id);
        let fork = f64::from(bole(id));
        let clear = (lowest - fork).max(0.0);
        let places: Vec<(Vec3, Vec3, f32)> = (0..BOLE)
            .map(|k| {
                let t = fork + clear * (f64::from(k) + 0.5) / f64::from(BOLE);
                (own.point(t), posed.frame(id, t as f32).y, own.value(plant.radii(id), t))
            })
            .collect();
        let mut load = loads.on[id.index()];
        for &other in stems.iter().filter(|&&other| other != id && stems.len() <= 256) {
            let curve = posed.curve(plant, other);
            let parameters = curve.parameters();
            let shares = places.iter().map(|&(place, axis, radius)| {
                let (t, off) = crossing(posed.chain(plant, other), &parameters, place, axis);
                overlap(radius, curve.value(plant.radii(other), t), off) / BOLE as f32
            });
            load += loads.on[other.index()] * f64::from(shares.sum::<f32>());
        }
        heaviest = heaviest.max(load);
    }
    (heaviest / loads.whole).min(1.0) as f32
}

/// What weighs where.
struct Loads {
    whole: f64,
    /// What each stem bears, itself with it; by chain.
    on: Vec<f64>,
    /// Where on its stem each branch hands over how much.
    branches: Vec<(f32, f64)>,
}

impl Loads {
    fn of(plant: &Plant, posed: &Posed, count: &dyn Fn(ChainId) -> f32) -> Self {
        let mut loads = Self { whole: 0.0, on: vec![0.0; plant.chains().len()], branches: Vec::new() };
        // The stem of each chain, and where what it bears leaves that.
        let mut foot: Vec<(usize, f32)> = Vec::with_capacity(plant.chains().len());
        for id in plant.chain_ids() {
            let chain = plant.chain(id);
            foot.push(match chain.parent {
                None => (id.index(), 0.0),
                Some(parent) if plant.chain(parent).parent.is_none() => (parent.index(), chain.location),
                Some(parent) => foot[parent.index()],
            });
            let (points, radii) = (posed.chain(plant, id), plant.radii(id));
            let mut volume = 0.0;
            for (p, r) in points.windows(2).zip(radii.windows(2)) {
                let (r, q) = (f64::from(r[0]), f64::from(r[1]));
                volume += f64::from(p[0].distance(p[1])) * std::f64::consts::PI * (r * r + r * q + q * q) / 3.0;
            }
            let weight = volume * WOOD * f64::from(count(id));
            let (stem, at) = foot[id.index()];
            loads.add(stem, weight);
            if chain.parent.is_some() {
                loads.branches.push((at, weight));
            }
        }
        for leaf in plant.leaves() {
            let area = f64::from(leaf.size) * f64::from(leaf.size) * f64::from(leaf.form.width());
            loads.add(foot[leaf.chain.index()].0, area * LEAF * f64::from(count(leaf.chain)));
        }
        loads
    }

    fn add(&mut self, stem: usize, weight: f64) {
        self.whole += weight;
        self.on[stem] += weight;
    }

    /// Where the stems' branches begin: the mean place of the [`LOWEST`] of what they weigh; 0 without branches. By
    /// weight, and for all stems at once, so that a bud low on one of them moves nothing; a mean, since the place below
    /// which a share hangs jumps from branch to branch as weights shift.
    fn lowest(&self) -> f32 {
        let mut branches = self.branches.clone();
        branches.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let wanted = branches.iter().map(|b| b.1).sum::<f64>() * LOWEST;
        if wanted.is_nan() || wanted <= 0.0 {
            return 0.0;
        }
        let (mut left, mut sum) = (wanted, 0.0);
        for (at, weight) in branches {
            let share = weight.min(left);
            sum += f64::from(at) * share;
            left -= share;
        }
        (sum / wanted) as f32
    }
}

/// Where a polyline comes nearest to a place, seen along an axis' height: its parameter, and the distance at right
/// angles to the axis.
fn crossing(points: &[Vec3], parameters: &[f64], place: Vec3, axis: Vec3) -> (f64, f32) {
    let mut best = (f32::INFINITY, 0.0, f32::INFINITY);
    for i in 1..points.len() {
        let (a, b) = (points[i - 1], points[i]);
        let (low, high) = ((a - place).dot(axis), (b - place).dot(axis));
        let f = if high != low { (-low / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        let off = a.lerp(b, f) - place;
        let (height, flat) = (off.dot(axis).abs(), off - axis * off.dot(axis));
        if height < best.0 {
            best = (height, parameters[i - 1] + (parameters[i] - parameters[i - 1]) * f64::from(f), flat.length());
        }
    }
    (best.1, best.2)
}

/// Area of the lens of two discs over that of the smaller, 0..=1.
fn overlap(a: f32, b: f32, distance: f32) -> f32 {
    let (large, small) = (a.max(b), a.min(b));
    if distance >= large + small {
        return 0.0;
    }
    if small <= 0.0 || distance <= large - small {
        return 1.0;
    }
    let angle =
        |r: f32, s: f32| math::acos(((distance * distance + r * r - s * s) / (2.0 * distance * r)).clamp(-1.0, 1.0));
    let (p, q) = (angle(large, small), angle(small, large));
    let cap = |r: f32, angle: f32| r * r * (angle - math::sin(angle) * math::cos(angle));
    ((cap(large, p) + cap(small, q)) / (std::f32::consts::PI * small * small)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantBuilder;

    fn stems(count: usize, apart: f32) -> Plant {
        let mut builder = PlantBuilder::new();
        for i in 0..count {
            let stem =
                builder.stem(Vec3::X * apart * i as f32, &[Vec3::ZERO, Vec3::Y * 2.0, Vec3::Y * 4.0], &[0.1, 0.1, 0.1]);
            builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 2.0], &[0.1, 0.1]);
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_single_trunk_bears_all() {
        let plant = stems(1, 0.0);
        assert_eq!(trunk_support(&plant, &plant.pose()), 1.0);
    }

    #[test]
    fn stems_in_one_another_bear_together_and_stems_apart_alone() {
        let share = |apart: f32| {
            let plant = stems(3, apart);
            trunk_support(&plant, &plant.pose())
        };
        assert!((share(0.0) - 1.0).abs() < 1e-6);
        assert!((share(1.0) - 1.0 / 3.0).abs() < 1e-6);
        assert!(share(0.05) < share(0.02) && share(0.05) > share(0.15));
    }

    #[test]
    fn the_heaviest_stem_counts_and_leaves_weigh() {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 3.0], &[0.1, 0.1]);
        builder.stem(Vec3::X, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.1]);
        let plant = builder.finish().unwrap();
        assert!((trunk_support(&plant, &plant.pose()) - 0.75).abs() < 1e-6);
        let half = trunk_support_by(&plant, &plant.pose(), &|id| if id.index() == 0 { 0.5 } else { 1.0 }, &|_| 0.0);
        assert!((half - 0.6).abs() < 1e-6);
    }

    #[test]
    fn a_plant_without_weight_bears_nothing() {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::ZERO], &[0.0, 0.0]);
        let plant = builder.finish().unwrap();
        assert_eq!(trunk_support(&plant, &plant.pose()), 0.0);
    }
}
