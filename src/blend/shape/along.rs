//! Points between plants in elastic correspondence: geodesics, weighted means and samples are all shares of the sources.
//!
//! In an elastic family no two sources order their branches differently, so all lie in one orthant of tree space (or on
//! its boundary) and the geodesic of two is the weighted mean at every share. A branch that a source lacks is there with zero length: at the
//! summed share h of those that have it, it has h² of its length (its root grows evenly) or, where chains go
//! straight, h.

use crate::base::{Seed, math};
use crate::preset::plan::ChainPath;
use crate::relate::{Family, Weights};

/// The weighted mean of an elastic family's sources: at shares `[1 - t, t]` the point `t` of the geodesic from the first to the
/// second. Shares below zero and those that are no numbers count as zero; all zero is the first source.
#[must_use]
pub fn weighted_mean(family: &Family, shares: &[f32]) -> Weights {
    let sources = family.sources().len();
    let clean: Vec<f32> =
        (0..sources).map(|s| shares.get(s).copied().filter(|w| w.is_finite() && *w > 0.0).unwrap_or(0.0)).collect();
    let there: Vec<usize> = (0..sources).filter(|&s| clean[s] > 0.0).collect();
    if let [] | [_] = there[..] {
        return family.corner(there.first().copied().unwrap_or(0));
    }
    let whole: f64 = clean.iter().map(|w| f64::from(*w)).sum();
    let mut weights = Weights::new(family.kin_count(), sources);
    for kin in family.kin_ids() {
        let held: f64 = there.iter().filter(|&&s| family.member(kin, s).is_some()).map(|&s| f64::from(clean[s])).sum();
        let held = (held / whole).min(1.0);
        let degree = match family.chain_path() {
            Some(ChainPath::Elastic) => held * held,
            _ => held,
        };
        weights.set(kin, &clean, degree as f32);
    }
    weights
}

/// Shares of a plant drawn from a Gaussian about the mean of some plants, in the tangent space that they span there.
///
/// With the sample covariance of the plants, a draw is `mean + spread · Σ g_s (x_s - mean) / √(n - 1)` with standard normal
/// `g_s`: an affine combination of the plants. The kernel extrapolates nothing, so a draw is bounded: its deviation from the
/// mean shrinks by `1 / (1 + n·d)` for the share that goes down farthest, by d, which keeps every share
/// above zero and hardly touches small ones.
#[must_use]
pub fn gaussian_shares(sources: usize, spread: f32, seed: Seed) -> Vec<f32> {
    let count = sources.max(1) as f32;
    let draws: Vec<f32> = (0..sources as u64).map(|s| normal(seed.at(s))).collect();
    let mean = draws.iter().sum::<f32>() / count;
    let scale = spread / (count - 1.0).max(1.0).sqrt();
    let deviations: Vec<f32> = draws.iter().map(|g| (g - mean) * scale).collect();
    let down = deviations.iter().fold(0.0_f32, |d, x| d.max(-x));
    let bound = 1.0 / (1.0 + count * down);
    deviations.iter().map(|d| 1.0 / count + d * bound).collect()
}

/// A standard normal number (Box and Muller 1958).
fn normal(seed: Seed) -> f32 {
    let (a, b) = (1.0 - seed.at(0).unit(), seed.at(1).unit());
    (-2.0 * math::ln(a)).sqrt() * math::cos(b * std::f32::consts::TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_stay_between_the_sources_about_their_mean() {
        for sources in 2..6 {
            let draws: Vec<Vec<f32>> = (0..2000).map(|i| gaussian_shares(sources, 1.0, Seed::new(3).at(i))).collect();
            for shares in &draws {
                assert!((shares.iter().sum::<f32>() - 1.0).abs() < 1e-5 && shares.iter().all(|w| *w > 0.0));
            }
            for s in 0..sources {
                let mean = draws.iter().map(|w| w[s]).sum::<f32>() / 2000.0;
                assert!((mean - 1.0 / sources as f32).abs() < 0.02, "{sources}: {mean}");
            }
            // A narrow one is the Gaussian itself.
            let narrow: Vec<f32> = (0..4000).map(|i| gaussian_shares(sources, 0.01, Seed::new(4).at(i))[0]).collect();
            let n = sources as f32;
            let variance = narrow.iter().map(|w| (w - 1.0 / n).powi(2)).sum::<f32>() / 4000.0;
            let wanted = 1e-4 * (1.0 - 1.0 / n) / (n - 1.0);
            assert!((variance / wanted - 1.0).abs() < 0.2, "{sources}: {variance} {wanted}");
        }
    }
}
