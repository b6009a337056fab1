//! Draws from the Gaussian that some points have about their mean, as shares of the points.

use super::{Seed, math};

/// Shares of some points drawn from a Gaussian about their mean, in the space that they span.
///
/// With the sample covariance of the points, a draw is `mean + spread · Σ g_s (x_s - mean) / √(n - 1)` with standard normal
/// `g_s`: an affine combination of them. It is bounded: its deviation from the mean shrinks by `1 / (1 + n·d)` for the
/// share that goes down farthest, by d, which keeps every share above zero and hardly touches small ones.
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
            let variance = narrow.iter().map(|w| (w - 1.0 / n) * (w - 1.0 / n)).sum::<f32>() / 4000.0;
            let wanted = 1e-4 * (1.0 - 1.0 / n) / (n - 1.0);
            assert!((variance / wanted - 1.0).abs() < 0.2, "{sources}: {variance} {wanted}");
        }
    }
}
