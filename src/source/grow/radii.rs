//! Radii of a grown plant: Murray's rule with the species' exponent, taper, and the flare of the roots.
//!
//! The rule is a bookkeeping of loads (2017 TVCG, Eq. 3; Murray 1927; the pipe model of Shinozaki et al. 1964): a tip
//! carries 1, a fork carries what its branches carry, and every metre of wood adds `taper`, the twigs that are too fine to
//! be grown here or that the branch has shed. A load L is a radius of `tip_radius · L^(1/x)`. So forks obey
//! `r^x = Σ r_child^x` exactly, also with taper, and between two forks a branch thins steadily instead of being a pipe.
//!
//! A stem widens at the ground by the share `flare`, which falls with the square of the way up and is gone
//! `flare_height` radii (of the stem without it) above. It is part of the plant's radii, so that meshes, colliders and
//! blends have it; a blend at a corner copies it like all else. Points are added to the stem there, on its own
//! polyline, which moves nothing: branches stand by arc length.
//!
//! Rejected: averaging radii along an axis to hide the steps at forks. It hid the exponent, too: of plants grown with 2.1
//! one measured 2.9. The mesh eases the steps instead (`mesh/rings.rs`).

use glam::Vec3;

use crate::base::math;
use crate::plant::{Curve, Plant, PlantBuilder};
use crate::preset::plan::GrowParams;

/// Points that a flare gets at least.
const FLARE_POINTS: usize = 6;

/// The plant with radii by the species' rule, metres. Linear in points, `n log n` in the children of one chain.
pub(super) fn with_radii(plant: &Plant, params: &GrowParams) -> Plant {
    let loads = loads(plant, f64::from(params.taper));
    let radius = |load: f64| params.tip_radius * math::pow64(load, 1.0 / f64::from(params.allometry)) as f32;
    let mut builder = PlantBuilder::reusing(Plant::default(), plant.chains().len(), plant.all_points().len(), 0);
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let span = plant.span(id);
        let radii: Vec<f32> = loads[span].iter().map(|&load| radius(load)).collect();
        match chain.parent {
            None => {
                let (points, radii) = flared(plant.points(id), radii, params);
                builder.stem(chain.origin, &points, &radii);
            }
            Some(parent) => {
                builder.branch(parent, chain.location, plant.points(id), &radii);
            }
        }
    }
    // The chains are those of a sound plant, and the radii are finite and not negative.
    builder.finish().unwrap_or_else(|_| plant.clone())
}

/// What every point of a plant carries, in tips; `taper` is what a metre of wood adds.
fn loads(plant: &Plant, taper: f64) -> Vec<f64> {
    let mut loads = vec![0.0_f64; plant.all_points().len()];
    // What leaves each chain: (location, load).
    let mut leaving: Vec<Vec<(f32, f64)>> = vec![Vec::new(); plant.chains().len()];
    for id in plant.chain_ids().rev() {
        let mut children = std::mem::take(&mut leaving[id.index()]);
        // From the tip down; ties by value keep the sum independent of the order of siblings.
        children.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)));
        let curve = Curve::new(plant.points(id));
        let (parameters, length) = (curve.parameters(), f64::from(curve.length()));
        let mut next = 0;
        let mut carried = 1.0;
        for (i, parameter) in plant.span(id).zip(&parameters).rev() {
            // A child counts for the points at and below it, give or take rounding.
            while next < children.len() && f64::from(children[next].0) >= parameter - 1e-6 {
                carried += children[next].1;
                next += 1;
            }
            loads[i] = carried + taper * length * (1.0 - parameter);
        }
        let chain = plant.chain(id);
        if let Some(parent) = chain.parent {
            leaving[parent.index()].push((chain.location, loads[plant.span(id).start]));
        }
    }
    loads
}

/// A stem's points and radii with its flare.
fn flared(points: &[Vec3], radii: Vec<f32>, params: &GrowParams) -> (Vec<Vec3>, Vec<f32>) {
    let reach = params.flare_height * radii[0];
    let length = Curve::new(points).length();
    if params.flare <= 0.0 || reach <= 0.0 || length <= 0.0 {
        return (points.to_vec(), radii);
    }
    let reach = reach.min(length);
    let step = reach / FLARE_POINTS as f32;
    let (mut more, mut wide) = (Vec::with_capacity(points.len() + FLARE_POINTS), Vec::new());
    let mut arc = 0.0;
    let mut put = |point: Vec3, radius: f32, arc: f32| {
        let left = (1.0 - arc / reach).max(0.0);
        more.push(point);
        wide.push(radius * (1.0 + params.flare * left * left));
    };
    put(points[0], radii[0], 0.0);
    for i in 1..points.len() {
        let way = points[i - 1].distance(points[i]);
        let within = (reach - arc).min(way).max(0.0);
        let cuts = (within / step).ceil().min(FLARE_POINTS as f32) as usize;
        for k in 1..=cuts {
            let t = within * k as f32 / cuts as f32 / way;
            if t < 1.0 - 1e-3 {
                put(points[i - 1].lerp(points[i], t), radii[i - 1] + (radii[i] - radii[i - 1]) * t, arc + way * t);
            }
        }
        arc += way;
        put(points[i], radii[i], arc);
    }
    (more, wide)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::plant::{ChainId, PlantStats};

    fn base(plant: &Plant, id: ChainId) -> f32 {
        plant.radii(id)[0]
    }

    fn params(tip_radius: f32, allometry: f32, taper: f32, flare: f32) -> GrowParams {
        let text = "(height: 9.0, iterations: [(endpoints: Volume(shape: Point(height: 0.5), count: 1))])";
        let species = crate::preset::species("s.ron", text).unwrap();
        GrowParams { tip_radius, allometry, taper, flare, flare_height: 4.0, ..species }
    }

    fn fork() -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0], &[1.0, 1.0, 1.0]);
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 3.0], &[0.5, 0.5]);
        builder.finish().unwrap()
    }

    #[test]
    fn a_fork_obeys_the_rule_and_taper_counts_metres_as_tips() {
        let plant = with_radii(&fork(), &params(0.01, 2.0, 0.0, 0.0));
        assert_eq!(plant.radii(ChainId(0)), [0.01 * 2.0_f32.sqrt(), 0.01 * 2.0_f32.sqrt(), 0.01]);
        let plant = with_radii(&fork(), &params(0.01, 2.0, 2.0, 0.0));
        // Tips 2, metres of wood 5 above the ground.
        assert!((base(&plant, ChainId(0)) - 0.01 * 12.0_f32.sqrt()).abs() < 1e-7);
        assert!((base(&plant, ChainId(1)) - 0.01 * 7.0_f32.sqrt()).abs() < 1e-7);
        let [fork, above] = [plant.radii(ChainId(0))[1], 0.01 * 3.0_f32.sqrt()];
        assert!((fork * fork - (above * above + base(&plant, ChainId(1)) * base(&plant, ChainId(1)))).abs() < 1e-8);
    }

    #[test]
    fn the_flare_widens_the_foot_and_moves_no_branch() {
        let bare = with_radii(&fork(), &params(0.1, 2.0, 0.0, 0.0));
        let plant = with_radii(&fork(), &params(0.1, 2.0, 0.0, 0.5));
        assert!((base(&plant, ChainId(0)) / base(&bare, ChainId(0)) - 1.5).abs() < 1e-5);
        assert!(plant.points(ChainId(0)).len() >= bare.points(ChainId(0)).len() + 4);
        assert!(plant.radii(ChainId(0)).windows(2).all(|r| r[1] <= r[0]));
        // Four radii of 14 cm up it is gone.
        let curve = Curve::new(plant.points(ChainId(0)));
        assert!((curve.value(plant.radii(ChainId(0)), 0.3) - base(&bare, ChainId(0))).abs() < 1e-5);
        let (a, b) = (bare.pose(), plant.pose());
        let tip = |posed: &crate::plant::Posed, p: &Plant| posed.chain(p, ChainId(1))[1];
        assert!(tip(&a, &bare).distance(tip(&b, &plant)) < 1e-6);
    }

    #[test]
    fn the_exponent_that_is_asked_for_is_measured() {
        let seed = Seed::new(5);
        let mut builder = PlantBuilder::new();
        let points: Vec<Vec3> = (0..40).map(|i| Vec3::Y * i as f32).collect();
        let stem = builder.stem(Vec3::ZERO, &points, &[1.0; 40]);
        for i in 1..200_u64 {
            let parent = ChainId(seed.at(i).index(i as usize) as u32);
            let parent = if builder.so_far().chain(parent).order > 5 { stem } else { parent };
            let count = builder.so_far().points(parent).len();
            let fork = 1 + seed.child("fork").at(i).index(count - 2);
            let location = fork as f32 / (count - 1) as f32;
            let way: Vec<Vec3> = (0..12).map(|k| Vec3::X * k as f32 * 0.5).collect();
            builder.branch(parent, location, &way, &[1.0; 12]);
        }
        let plant = builder.finish().unwrap();
        for exponent in [1.8, 2.3, 3.0] {
            let stats = PlantStats::of(&with_radii(&plant, &params(0.005, exponent, 0.0, 0.0)));
            assert!((stats.murray.exponent - exponent).abs() < 0.05, "{exponent}: {:?}", stats.murray);
        }
    }
}
