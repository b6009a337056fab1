//! Elastic registration of two curves (2018 TOG, section 3, Eq. 1; Srivastava et al. 2011): the rotation O and the
//! reparameterization γ for which `∫ |q1 - √γ' O q2(γ)|²` is least.
//!
//! Since the functions have unit norm that is the greatest `∫ √γ' q1 · O q2(γ)`. For a rotation, γ is the best lattice
//! path of slopes 1/3 to 3 on the grid of samples, by dynamic programming; for a γ, the rotation is Horn's. The two take
//! turns, from no reparameterization on, and what is best is kept. A lattice step of `(a, b)` counts
//! `√(a b)` times the trapezoidal mean of `q1 · q2` along it, which is the same with the curves swapped: the registration
//! of two curves the other way round is the inverse.
//!
//! Limits: the path stays within [`BAND`] samples of the diagonal (a quarter of the curve); as an alternating search it
//! may end in a local optimum. Against exhaustive search see `figures -- space`.

use glam::DVec3;

use super::curve::ElasticCurve;
use super::rotation::{Turn, UNTURNED, nearest_rotation, turned};

/// Steps of a path, along the first curve and along the second.
pub const STEPS: [(usize, usize); 7] = [(1, 1), (1, 2), (2, 1), (1, 3), (3, 1), (2, 3), (3, 2)];
/// Farthest from the diagonal, samples.
const BAND: usize = 12;
/// Rounds end when one gains less than this.
const LEAST_GAIN: f64 = 1e-4;
/// Most times that the rotation is found.
const ROUNDS: usize = 4;

/// How one curve runs along another.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    /// Parameters of the first curve and of the second, both rising from 0 to 1.
    pub gamma: Vec<(f64, f64)>,
    /// `∫ √γ' q1 · O q2(γ)`, at most 1; the squared distance is twice what is missing.
    pub agreement: f64,
    /// O, by its columns.
    pub(super) turn: Turn,
}

impl Registration {
    fn diagonal(turn: Turn, agreement: f64) -> Self {
        Self { gamma: vec![(0.0, 0.0), (1.0, 1.0)], agreement, turn }
    }
}

/// Registers the second curve to the first.
#[must_use]
pub fn register(first: &ElasticCurve, second: &ElasticCurve) -> Registration {
    let (q1, q2) = (first.q(), second.q());
    let count = q1.len();
    if count != q2.len() || count < 2 || q1 == q2 {
        return Registration::diagonal(UNTURNED, 1.0);
    }
    let turn = nearest_rotation(q1.iter().copied().zip(q2.iter().copied()));
    let apart: Vec<DVec3> = q2.iter().map(|q| turned(&turn, *q)).collect();
    let last = (count - 1) as f64;
    let mut best = Registration::diagonal(turn, along(q1, &apart, &[(0, 0), (count - 1, count - 1)]) / last);
    if first.is_straight() && second.is_straight() {
        return best;
    }
    let mut turn = turn;
    for _ in 0..ROUNDS {
        let turned_q: Vec<DVec3> = q2.iter().map(|q| turned(&turn, *q)).collect();
        let (path, sum) = best_path(q1, &turned_q, BAND.min(count));
        if sum / last <= best.agreement + LEAST_GAIN {
            break;
        }
        let gamma = path.iter().map(|&(i, j)| (i as f64 / last, j as f64 / last)).collect();
        best = Registration { gamma, agreement: sum / last, turn };
        turn = nearest_rotation(samples(&path).map(|(i, j, weight)| (at(q1, i) * weight, at(q2, j))));
    }
    best
}

/// The best path of [`STEPS`] from corner to corner, and its sum; at most `band` off the diagonal.
#[must_use]
pub fn best_path(q1: &[DVec3], q2: &[DVec3], band: usize) -> (Vec<(usize, usize)>, f64) {
    let count = q1.len();
    let dots: Vec<f64> = (0..count * count)
        .map(|cell| {
            let (i, j) = (cell / count, cell % count);
            // Steps look up to three samples back.
            if i.abs_diff(j) <= band + 3 { q1[i].dot(q2[j]) } else { 0.0 }
        })
        .collect();
    let mut sums = vec![f64::NEG_INFINITY; count * count];
    let mut from = vec![u8::MAX; count * count];
    sums[0] = 0.0;
    for i in 1..count {
        for j in i.saturating_sub(band).max(1)..(i + band + 1).min(count) {
            let (mut most, mut step_there) = (f64::NEG_INFINITY, u8::MAX);
            for (s, &(a, b)) in STEPS.iter().enumerate() {
                if a > i || b > j {
                    continue;
                }
                let before = sums[(i - a) * count + j - b];
                if before == f64::NEG_INFINITY {
                    continue;
                }
                let sum = before + step(&dots, count, (i - a, j - b), (a, b));
                if sum > most {
                    (most, step_there) = (sum, s as u8);
                }
            }
            sums[i * count + j] = most;
            from[i * count + j] = step_there;
        }
    }
    let (mut i, mut j) = (count - 1, count - 1);
    let mut path = vec![(i, j)];
    while (i, j) != (0, 0) {
        let Some(&(a, b)) = STEPS.get(from[i * count + j] as usize) else { break };
        (i, j) = (i - a, j - b);
        path.push((i, j));
    }
    path.reverse();
    (path, sums[count * count - 1])
}

/// What a step counts: `√(a b)` times the trapezoidal mean of the products along it.
fn step(dots: &[f64], count: usize, (i, j): (usize, usize), (a, b): (usize, usize)) -> f64 {
    const ROOTS: [f64; 7] =
        [0.0, 1.0, std::f64::consts::SQRT_2, 1.732_050_807_568_877_2, 2.0, 0.0, 2.449_489_742_783_178];
    let parts = a.max(b);
    let mut sum = (dots[i * count + j] + dots[(i + a) * count + j + b]) * 0.5;
    for k in 1..parts {
        // One of the two is whole.
        let (along_a, along_b) = (a * k, b * k);
        let (p, q) = (i + along_a / parts, j + along_b / parts);
        let (f, next) = if a < b {
            ((along_a % parts) as f64 / parts as f64, count)
        } else {
            ((along_b % parts) as f64 / parts as f64, 1)
        };
        let low = dots[p * count + q];
        sum += if f > 0.0 { low + (dots[p * count + q + next] - low) * f } else { low };
    }
    sum * ROOTS[a * b] / parts as f64
}

/// The sum along a path of any steps, by samples of the function.
fn along(q1: &[DVec3], q2: &[DVec3], path: &[(usize, usize)]) -> f64 {
    samples(path).map(|(i, j, weight)| at(q1, i).dot(at(q2, j)) * weight).sum()
}

/// Places along a path, on both curves, with their weights.
fn samples(path: &[(usize, usize)]) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
    path.windows(2).flat_map(|w| {
        let (a, b) = (w[1].0 - w[0].0, w[1].1 - w[0].1);
        let parts = a.max(b).max(1);
        let each = ((a * b) as f64).sqrt() / parts as f64;
        (0..=parts).map(move |k| {
            let f = k as f64 / parts as f64;
            let weight = if k == 0 || k == parts { 0.5 } else { 1.0 };
            (w[0].0 as f64 + a as f64 * f, w[0].1 as f64 + b as f64 * f, each * weight)
        })
    })
}

fn at(q: &[DVec3], place: f64) -> DVec3 {
    let i = (place as usize).min(q.len() - 1);
    let f = place - i as f64;
    if f > 0.0 && i + 1 < q.len() { q[i].lerp(q[i + 1], f) } else { q[i] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn random(seed: Seed, count: usize) -> Vec<DVec3> {
        let drift = seed.child("drift").direction().as_dvec3();
        (0..count).map(|i| (seed.at(i as u64).direction().as_dvec3() + drift).normalize()).collect()
    }

    /// The best sum over all paths of the steps.
    fn exhaustive(q1: &[DVec3], q2: &[DVec3], i: usize, j: usize) -> f64 {
        let last = q1.len() - 1;
        if (i, j) == (last, last) {
            return 0.0;
        }
        let mut best = f64::NEG_INFINITY;
        for (a, b) in STEPS {
            if i + a <= last && j + b <= last {
                let here = along(q1, q2, &[(i, j), (i + a, j + b)]);
                best = best.max(here + exhaustive(q1, q2, i + a, j + b));
            }
        }
        best
    }

    #[test]
    fn dynamic_programming_finds_what_exhaustive_search_finds() {
        for i in 0..60 {
            let seed = Seed::new(i);
            let (q1, q2) = (random(seed.child("a"), 9), random(seed.child("b"), 9));
            let (path, sum) = best_path(&q1, &q2, 9);
            let all = exhaustive(&q1, &q2, 0, 0);
            assert!((sum - all).abs() < 1e-9, "{sum} {all}");
            assert!((along(&q1, &q2, &path) - sum).abs() < 1e-9);
        }
    }

    #[test]
    fn a_curve_is_registered_to_its_own_reparameterization() {
        // A curve that bends in its middle, and the same with the bend a sixth later, turned.
        let bend = |at: f64| {
            let mut samples = vec![DVec3::ZERO];
            for i in 1..50 {
                let s = (i as f64 - 0.5) / 49.0;
                let out = DVec3::new(((s - at) * 12.0).clamp(-1.0, 1.0), 1.0, 0.3 * s);
                samples.push(samples[i - 1] + out.normalize());
            }
            ElasticCurve::of_samples(&samples)
        };
        let (a, b) = (bend(0.4), bend(0.56));
        let found = register(&a, &b);
        let plain = Registration::diagonal(UNTURNED, along(a.q(), b.q(), &[(0, 0), (49, 49)]) / 49.0);
        assert!(found.agreement > plain.agreement + 0.02, "{} {}", found.agreement, plain.agreement);
        let at = found.gamma.iter().find(|g| g.0 >= 0.4).unwrap();
        assert!((at.1 - 0.56).abs() < 0.06, "{at:?}");
        // Swapped, the inverse.
        let back = register(&b, &a);
        assert!((back.agreement - found.agreement).abs() < 1e-3, "{} {}", back.agreement, found.agreement);
        assert_eq!(register(&a, &a).gamma, [(0.0, 0.0), (1.0, 1.0)]);
    }
}
