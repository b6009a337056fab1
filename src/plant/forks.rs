//! Forks of a plant: what Murray's exponent is measured on, and its streams by Strahler's order.
//!
//! A fork is a place of a chain where others leave it; those that leave within one radius of each other are one fork.
//! Radii are read at the chains' own points, clear of the fork where there is a point between it and the next one: at
//! the last point one radius below it, at the first point one radius above it, and for a child at its first point
//! outside its parent or at its own first fork. Reading between points would read the taper from one to the next instead of the wood.
//!
//! *Murray's exponent* is the x that brings the predicted radii `(Σ r_child^x)^(1/x)` nearest to the measured ones: least
//! squares of the difference of their logarithms, over all forks with equal weight, so that a thousand twigs don't drown
//! in one trunk's square metres nor the other way round. The chain above the fork counts as a child. A grid over 0.5 to 8,
//! then a golden section; at most [`MOST_FORKS`] forks, taken evenly.
//!
//! *Strahler's order* is 1 at a tip; where two streams of one order meet, the next begins. Unlike Gravelius order it does
//! not depend on which branch is called the leader, so the bifurcation ratio rests on it.

use serde::Serialize;

use super::{ChainId, Curve, Plant};
use crate::base::math;

/// Most forks that the exponent is fitted to.
const MOST_FORKS: usize = 2048;
/// Fewest forks that an exponent is fitted to.
const FEWEST_FORKS: usize = 3;
/// Range of the exponents that are tried.
const RANGE: (f64, f64) = (0.5, 8.0);
/// Arc-length parameters closer than this are one place.
const ROUNDING: f64 = 1e-5;

/// Murray's exponent as measured on a plant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MurrayFit {
    /// x of `r_parent^x = Σ r_child^x`, 0.5..=8; an end of this range means that no exponent fits. 0 with fewer than 3
    /// forks.
    pub exponent: f32,
    /// Forks measured.
    pub forks: usize,
    /// Root mean square of `ln(measured / predicted)` parent radius with it: 0.1 is about 10 %.
    pub residual: f32,
}

/// Radii at one fork, metres.
struct Fork {
    below: f64,
    /// The chain above, then each child; as spans of [`Forks::children`].
    children: std::ops::Range<usize>,
}

/// All forks of a plant.
struct Forks {
    forks: Vec<Fork>,
    children: Vec<f64>,
}

impl Forks {
    /// Linear in points, `n log n` in the children of one chain.
    fn of(plant: &Plant, children: &[Vec<ChainId>]) -> Self {
        let mut found = Self { forks: Vec::new(), children: Vec::new() };
        for id in plant.chain_ids() {
            let mut leaving = children[id.index()].clone();
            if leaving.is_empty() {
                continue;
            }
            leaving.sort_by(|a, b| plant.chain(*a).location.total_cmp(&plant.chain(*b).location).then(a.cmp(b)));
            let curve = Curve::new(plant.points(id));
            let length = f64::from(curve.length());
            if length <= 0.0 {
                continue;
            }
            let (at, radii) = (curve.parameters(), plant.radii(id));
            let radius = |t: f64| f64::from(curve.value(radii, t));
            // Clusters: (first location, last location, first child, one past the last).
            let mut clusters: Vec<(f64, f64, usize, usize)> = Vec::new();
            for (i, &child) in leaving.iter().enumerate() {
                let t = f64::from(plant.chain(child).location);
                match clusters.last_mut() {
                    Some(last) if (t - last.1) * length < radius(last.1) => (last.1, last.3) = (t, i + 1),
                    _ => clusters.push((t, t, i, i + 1)),
                }
            }
            for (k, &(from, to, first, end)) in clusters.iter().enumerate() {
                let before = if k > 0 { clusters[k - 1].1 } else { 0.0 };
                let after = clusters.get(k + 1).map_or(1.0, |next| next.0);
                let clear = radius(from) / length;
                // A location and the point it means are a rounding error apart.
                let under = at.partition_point(|&t| t <= from - clear);
                let below = if under > 0 && at[under - 1] > before + ROUNDING {
                    f64::from(radii[under - 1])
                } else {
                    radius(from)
                };
                let start = found.children.len();
                // At the very tip nothing of the chain is left above.
                if to < 1.0 - ROUNDING {
                    let over = at.partition_point(|&t| t < to + clear.max(ROUNDING));
                    let next = at.partition_point(|&t| t <= to + ROUNDING);
                    let over = if at.get(over).is_some_and(|&t| t <= after + ROUNDING) { over } else { next };
                    found.children.push(f64::from(radii[over.min(radii.len() - 1)]));
                }
                for &child in &leaving[first..end] {
                    let own = Curve::new(plant.points(child));
                    let (arc, radii) = (own.parameters(), plant.radii(child));
                    let next = children[child.index()].iter().map(|c| f64::from(plant.chain(*c).location));
                    let fork = next.fold(0.5, f64::min);
                    let out = (clear * length / f64::from(own.length()).max(1e-12)).min(fork);
                    let outside = arc.partition_point(|&t| t < out).clamp(1, radii.len() - 1);
                    found.children.push(f64::from(radii[outside]));
                }
                let sound = below > 0.0 && found.children[start..].iter().all(|r| *r > 0.0);
                if sound && found.children.len() - start >= 2 {
                    found.forks.push(Fork { below, children: start..found.children.len() });
                } else {
                    found.children.truncate(start);
                }
            }
        }
        found
    }

    /// Mean of the squared logarithm of measured over predicted radius.
    fn error(&self, exponent: f64) -> f64 {
        let stride = self.forks.len().div_ceil(MOST_FORKS).max(1);
        let (mut sum, mut count) = (0.0, 0);
        for fork in self.forks.iter().step_by(stride) {
            // Relative to the parent's, so that no power leaves the numbers.
            let carried: f64 =
                self.children[fork.children.clone()].iter().map(|r| math::pow64(r / fork.below, exponent)).sum();
            let off = math::ln64(carried) / exponent;
            sum += off * off;
            count += 1;
        }
        sum / f64::from(count.max(1))
    }
}

/// Measures Murray's exponent.
pub(super) fn murray(plant: &Plant, children: &[Vec<ChainId>]) -> MurrayFit {
    let forks = Forks::of(plant, children);
    let count = forks.forks.len();
    if count < FEWEST_FORKS {
        return MurrayFit { exponent: 0.0, forks: count, residual: 0.0 };
    }
    // Evenly in the logarithm: the grid first, since the sum of many forks may have several valleys.
    const STEPS: usize = 32;
    let at = |k: f64| RANGE.0 * math::pow64(RANGE.1 / RANGE.0, (k / STEPS as f64).clamp(0.0, 1.0));
    let errors: Vec<f64> = (0..=STEPS).map(|k| forks.error(at(k as f64))).collect();
    let best = (0..=STEPS).min_by(|&a, &b| errors[a].total_cmp(&errors[b])).unwrap_or(0) as f64;
    let (mut low, mut high) = (best - 1.0, best + 1.0);
    let golden = 0.618_033_988_75;
    for _ in 0..16 {
        let (a, b) = (high - (high - low) * golden, low + (high - low) * golden);
        if forks.error(at(a)) <= forks.error(at(b)) {
            high = b;
        } else {
            low = a;
        }
    }
    let exponent = at((low + high) * 0.5);
    MurrayFit { exponent: exponent as f32, forks: count, residual: forks.error(exponent).sqrt() as f32 }
}

/// How many streams there are of each Strahler order, from 1; a plant of one bare stem has one stream of order 1.
pub(super) fn strahler(plant: &Plant, children: &[Vec<ChainId>]) -> Vec<usize> {
    let mut streams: Vec<usize> = Vec::new();
    let mut begin = |order: usize| {
        if streams.len() < order {
            streams.resize(order, 0);
        }
        streams[order - 1] += 1;
    };
    let mut orders = vec![1_usize; plant.chains().len()];
    for id in plant.chain_ids().rev() {
        let mut leaving = children[id.index()].clone();
        leaving.sort_by(|a, b| plant.chain(*b).location.total_cmp(&plant.chain(*a).location).then(a.cmp(b)));
        begin(1);
        let mut order = 1;
        for child in leaving {
            let other = orders[child.index()];
            if other == order {
                order += 1;
                begin(order);
            } else {
                order = order.max(other);
            }
        }
        orders[id.index()] = order;
    }
    streams
}

/// The bifurcation ratio: how many streams of one Strahler order there are for one of the next, as the slope of the
/// logarithm of their number over the order, by least squares. 0 with fewer than two orders.
pub(super) fn bifurcation_ratio(streams: &[usize]) -> f32 {
    let n = streams.len() as f64;
    if n < 2.0 {
        return 0.0;
    }
    let mean_order = (n - 1.0) * 0.5;
    let logs: Vec<f64> = streams.iter().map(|&s| math::ln64(s.max(1) as f64)).collect();
    let mean_log = logs.iter().sum::<f64>() / n;
    let (mut slope, mut spread) = (0.0, 0.0);
    for (i, log) in logs.iter().enumerate() {
        let order = i as f64 - mean_order;
        slope += order * (log - mean_log);
        spread += order * order;
    }
    math::pow64(std::f64::consts::E, -slope / spread) as f32
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Seed;
    use crate::plant::PlantBuilder;

    /// A stem with `n` branches, each radius by the exponent.
    fn comb(n: u32, exponent: f64, noise: f32) -> Plant {
        let mut builder = PlantBuilder::new();
        let count = n as usize;
        let radius = |tips: usize| (0.01 * math::pow64(tips as f64, 1.0 / exponent)) as f32;
        // Two points an internode, so that the radius steps at the fork and not before.
        let (mut points, mut radii) = (vec![Vec3::ZERO], vec![radius(count + 1)]);
        for i in 0..count {
            points.extend([Vec3::Y * (i + 1) as f32, Vec3::Y * ((i + 1) as f32 + 1e-3)]);
            radii.extend([radius(count + 1 - i), radius(count - i)]);
        }
        points.push(Vec3::Y * (count + 1) as f32);
        radii.push(radius(1));
        let seed = Seed::new(3);
        for (i, r) in radii.iter_mut().enumerate() {
            *r *= 1.0 + noise * seed.at(i as u64).range(-1.0, 1.0);
        }
        let stem = builder.stem(Vec3::ZERO, &points, &radii);
        for i in 0..count {
            let location = (i + 1) as f32 / (count + 1) as f32;
            builder.branch(stem, location, &[Vec3::ZERO, Vec3::X * 0.9], &[0.01, 0.01]);
        }
        builder.finish().unwrap()
    }

    #[test]
    fn the_exponent_that_made_the_radii_is_found() {
        for exponent in [1.6, 2.0, 2.49, 3.0] {
            let plant = comb(24, exponent, 0.0);
            let fit = murray(&plant, &plant.children());
            assert!((f64::from(fit.exponent) - exponent).abs() < 0.01, "{fit:?}");
            assert!(fit.forks == 24 && fit.residual < 1e-3, "{fit:?}");
        }
    }

    #[test]
    fn noise_of_a_scan_moves_the_exponent_little() {
        let plant = comb(200, 2.2, 0.03);
        let fit = murray(&plant, &plant.children());
        assert!((fit.exponent - 2.2).abs() < 0.4 && fit.residual > 0.005, "{fit:?}");
    }

    #[test]
    fn too_few_forks_have_no_exponent() {
        let plant = comb(2, 2.0, 0.0);
        assert_eq!(murray(&plant, &plant.children()).exponent, 0.0);
    }

    #[test]
    fn a_binary_tree_halves_its_streams_from_order_to_order() {
        let mut builder = PlantBuilder::new();
        let way = [Vec3::ZERO, Vec3::Y];
        let mut chains = vec![(builder.stem(Vec3::ZERO, &way, &[0.1, 0.1]), 1)];
        // Each chain is joined by one of its own kind at four heights: a chain of level k carries k branches.
        let mut next = Vec::new();
        for level in 1..=4 {
            for &(id, at) in &chains {
                let location = 0.2 * level as f32;
                next.push((builder.branch(id, location, &way, &[0.1, 0.1]), at + 1));
            }
            chains.append(&mut next);
        }
        let plant = builder.finish().unwrap();
        let streams = strahler(&plant, &plant.children());
        assert_eq!(streams, [16, 8, 4, 2, 1]);
        assert!((bifurcation_ratio(&streams) - 2.0).abs() < 1e-5);
        assert_eq!(bifurcation_ratio(&[7]), 0.0);
    }
}
