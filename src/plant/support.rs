//! The trunk support weight (2017 CAVW, 7; after the pipe model of Shinozaki et al. 1964): how much of a tree the trunk
//! that bears most of it bears.
//!
//! A stem bears, at the place of its lowest branch, all the wood and leaves above. Stems that lie in one another there are
//! one trunk as far as their cross-sections overlap: a stem bears, beside its own, the share of every other's that the lens of both discs has
//! of the smaller disc. So a trunk that opens into several stems hands its load over as they part, and not at once because
//! they count as several. The heaviest stem's load over the tree's whole weight is the figure, 0..=1.
//!
//! Wood weighs [`WOOD`], leaves [`LEAF`]; a leaf card's area is its length times its width.

use glam::Vec3;

use super::{Plant, Posed};
use crate::base::math;

/// Green wood, kilograms a cubic metre.
pub const WOOD: f64 = 900.0;
/// Fresh leaves, kilograms a square metre of card; a card is about half covered.
pub const LEAF: f64 = 0.1;

/// What the trunk that bears most bears, as a share of the plant's weight, 0..=1; 0 for a plant without weight.
///
/// Linear in points and leaves, and quadratic in stems up to 256 of them, beyond which each bears its own.
#[must_use]
pub fn trunk_support(plant: &Plant, posed: &Posed) -> f32 {
    let lowest = super::crown::crown_bases(plant);
    // The stem of each chain, and what lies above the lowest branch of each stem.
    let mut stem = vec![0_usize; plant.chains().len()];
    let mut borne: Vec<f64> = vec![0.0; plant.chains().len()];
    let mut whole = 0.0_f64;
    for id in plant.chain_ids() {
        let parent = plant.chain(id).parent;
        stem[id.index()] = parent.map_or(id.index(), |p| stem[p.index()]);
        let (points, radii) = (posed.chain(plant, id), plant.radii(id));
        let parameters = posed.curve(plant, id).parameters();
        let from = if parent.is_some() { 0.0 } else { f64::from(lowest[id.index()]) };
        for i in 1..points.len() {
            let (r, q) = (f64::from(radii[i - 1]), f64::from(radii[i]));
            let volume =
                f64::from(points[i].distance(points[i - 1])) * std::f64::consts::PI * (r * r + r * q + q * q) / 3.0;
            let (low, high) = (parameters[i - 1], parameters[i]);
            let above = if high > low { ((high - from.max(low)) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
            whole += volume * WOOD;
            borne[stem[id.index()]] += volume * WOOD * above;
        }
    }
    for leaf in plant.leaves() {
        let weight = f64::from(leaf.size) * f64::from(leaf.size) * f64::from(leaf.form.width()) * LEAF;
        whole += weight;
        borne[stem[leaf.chain.index()]] += weight;
    }
    if whole.is_nan() || whole <= 0.0 {
        return 0.0;
    }
    let stems: Vec<usize> = (0..stem.len()).filter(|&i| stem[i] == i).collect();
    let mut heaviest = 0.0_f64;
    for &i in &stems {
        let id = super::ChainId(i as u32);
        let at = f64::from(lowest[i]);
        let own = posed.curve(plant, id);
        let (place, axis) = (own.point(at), posed.frame(id, lowest[i]).y);
        let radius = own.value(plant.radii(id), at);
        let mut load = borne[i];
        for &j in stems.iter().filter(|&&j| j != i && stems.len() <= 256) {
            let other = super::ChainId(j as u32);
            let curve = posed.curve(plant, other);
            let (t, off) = crossing(posed.chain(plant, other), &curve.parameters(), place, axis);
            load += borne[j] * f64::from(overlap(radius, curve.value(plant.radii(other), t), off));
        }
        heaviest = heaviest.max(load);
    }
    (heaviest / whole).min(1.0) as f32
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
    fn a_trunk_bears_what_is_above_its_lowest_branch() {
        // Half of its own four metres and the branch's two, of six.
        let plant = stems(1, 0.0);
        assert!((trunk_support(&plant, &plant.pose()) - 4.0 / 6.0).abs() < 1e-5);
    }

    #[test]
    fn stems_in_one_another_bear_together_and_stems_apart_alone() {
        let share = |apart: f32| {
            let plant = stems(3, apart);
            trunk_support(&plant, &plant.pose())
        };
        assert!((share(0.0) - 4.0 / 6.0).abs() < 1e-5);
        assert!((share(1.0) - 4.0 / 18.0).abs() < 1e-5);
        assert!(share(0.05) < share(0.02) && share(0.05) > share(0.15));
    }

    #[test]
    fn a_plant_without_weight_bears_nothing() {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::ZERO], &[0.0, 0.0]);
        let plant = builder.finish().unwrap();
        assert_eq!(trunk_support(&plant, &plant.pose()), 0.0);
    }
}
