//! Draws from the Gaussian that some points have about their mean, as shares of the points.

use super::{Seed, math};

/// Share from which on a draw is a copy of one point.
const COPY: f32 = 0.98;
/// Most draws for one that is no copy; of two points at the widest spread one in seven is none.
const TRIES: u64 = 256;

/// Shares of some points drawn from a Gaussian about their mean, in the space that they span.
///
/// With the sample covariance of the points, a draw is `mean + spread · Σ g_s (x_s - mean) / √(n - 1)` with standard normal
/// `g_s`: an affine combination of them, and as it is where no share is below zero. Where one is, it gives way to the nearest
/// shares that are none (Euclidean projection), and where these are nearly those of one point alone, another is drawn. So at
/// `spread` 1 the standard deviation of a share is 0.27 of two points, 0.29 of three, 0.27 of four and 0.18 of eight,
/// where the Gaussian's is `1 / √n`: 0.71, 0.58, 0.50 and 0.35, and the points themselves have `√(n - 1) / n`: 0.50, 0.47,
/// 0.43 and 0.33. At `spread` 0.25 it is within 4 % of the Gaussian's up to four points.
///
/// Rejected: draws that end at the bound, of two points half of all, which are copies of the points; and shrinking
/// each by `1 / (1 + n·d)` for the share that is lowest, by d, which leaves 0.25, 0.18, 0.14 and 0.07.
#[must_use]
pub fn gaussian_shares(sources: usize, spread: f32, seed: Seed) -> Vec<f32> {
    let count = sources.max(1) as f32;
    let drawn = |seed: Seed| -> Vec<f32> {
        let draws: Vec<f32> = (0..sources as u64).map(|s| normal(seed.at(s))).collect();
        let mean = draws.iter().sum::<f32>() / count;
        let scale = spread / (count - 1.0).max(1.0).sqrt();
        nearest(draws.iter().map(|g| 1.0 / count + (g - mean) * scale).collect())
    };
    let is_copy = |shares: &[f32]| sources > 1 && shares.iter().any(|share| *share > COPY);
    let again = (0..TRIES).map(|i| if i == 0 { seed } else { seed.child("again").at(i) });
    again.map(drawn).find(|shares| !is_copy(shares)).unwrap_or_else(|| vec![1.0 / count; sources])
}

/// The nearest shares that are not below zero and add up to 1, of some that add up to 1 (Held, Wolfe and Crowder 1974).
fn nearest(shares: Vec<f32>) -> Vec<f32> {
    if shares.iter().all(|share| *share >= 0.0) {
        return shares;
    }
    let mut sorted = shares.clone();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let (mut sum, mut off) = (0.0_f32, 0.0_f32);
    for (i, share) in sorted.iter().enumerate() {
        sum += share;
        let here = (sum - 1.0) / (i + 1) as f32;
        if *share > here {
            off = here;
        }
    }
    shares.into_iter().map(|share| (share - off).max(0.0)).collect()
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
    fn draws_stray_as_far_as_shares_can_and_small_ones_as_the_gaussian() {
        for (sources, least) in [(2, 0.26), (3, 0.28), (4, 0.25), (8, 0.17)] {
            let deviation = |spread: f32| {
                let n = sources as f32;
                let square = |i| (gaussian_shares(sources, spread, Seed::new(5).at(i))[0] - 1.0 / n) * n.sqrt();
                ((0..3000).map(|i| square(i) * square(i)).sum::<f32>() / 3000.0).sqrt()
            };
            let n = sources as f32;
            assert!(deviation(1.0) > least * n.sqrt(), "{sources}: {}", deviation(1.0));
            // In units of the Gaussian's.
            assert!(sources > 4 || (deviation(0.25) / 0.25 - 1.0).abs() < 0.06, "{sources}: {}", deviation(0.25));
        }
        assert_eq!(nearest(vec![1.25, -0.25]), [1.0, 0.0]);
        assert_eq!(nearest(vec![0.75, 0.5, -0.25]), [0.625, 0.375, 0.0]);
    }

    #[test]
    fn draws_stay_between_the_sources_about_their_mean() {
        for sources in 2..6 {
            let draws: Vec<Vec<f32>> = (0..2000).map(|i| gaussian_shares(sources, 1.0, Seed::new(3).at(i))).collect();
            for shares in &draws {
                assert!(
                    (shares.iter().sum::<f32>() - 1.0).abs() < 1e-5 && shares.iter().all(|w| (0.0..COPY).contains(w))
                );
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
