//! Tip radius, exponent and taper from the radii of a plant: least squares over all chains of the logarithm of the base
//! radius against what the chain carries, `ln r = ln tip + ln(tips + taper · metres) / x`.
//!
//! Exponent and taper by grid, the tip radius as the intercept. Chains are weighted so that each doubling of tips counts
//! alike: one trunk weighs as much as five hundred twigs. Murray's exponent at forks (`plant/forks.rs`) is no substitute:
//! scans measure twigs too thick and hardly see a trunk thin at a fork, and trees grown with that exponent have
//! trunks like poles.

use crate::base::math;

/// Exponents that are tried.
const EXPONENTS: [f32; 22] =
    [1.2, 1.4, 1.6, 1.7, 1.8, 1.9, 2.0, 2.1, 2.2, 2.3, 2.4, 2.5, 2.6, 2.8, 3.0, 3.2, 3.4, 3.6, 3.8, 4.0, 4.5, 5.0];
/// Tapers that are tried, over the plant's tips per metre of wood.
const TAPERS: [f32; 8] = [0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// What a chain carries at its base, and how thick it is there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carried {
    pub(super) tips: f32,
    /// Wood, metres.
    pub(super) wood: f32,
    /// Metres.
    pub(super) radius: f32,
}

/// The rule that fits best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rule {
    /// Metres.
    pub(super) tip_radius: f32,
    pub(super) allometry: f32,
    /// Tips a metre.
    pub(super) taper: f32,
}

/// Fits the rule; linear in chains.
pub(super) fn fit(chains: &[Carried]) -> Rule {
    let sound = |c: &&Carried| c.radius > 0.0 && c.wood > 0.0 && c.tips >= 1.0;
    let rows: Vec<Carried> = chains.iter().filter(sound).copied().collect();
    let mut classes = [0.0_f32; 33];
    let class = |c: &Carried| (math::ln(c.tips) / std::f32::consts::LN_2).clamp(0.0, 32.0) as usize;
    for row in &rows {
        classes[class(row)] += 1.0;
    }
    let all = rows.iter().fold([0.0_f32; 2], |most, c| [most[0].max(c.tips), most[1].max(c.wood)]);
    let density = if all[1] > 0.0 { all[0] / all[1] } else { 1.0 };
    let mut best = (f64::INFINITY, Rule { tip_radius: 0.004, allometry: 2.2, taper: 0.3 });
    for taper in TAPERS.map(|t| (t * density).min(50.0)) {
        for allometry in EXPONENTS {
            let (mut sum, mut squares, mut weights) = (0.0_f64, 0.0_f64, 0.0_f64);
            for row in &rows {
                let load = row.tips + taper * row.wood;
                let tip = math::ln64(f64::from(row.radius)) - math::ln64(f64::from(load)) / f64::from(allometry);
                let weight = 1.0 / f64::from(classes[class(row)]);
                sum += tip * weight;
                squares += tip * tip * weight;
                weights += weight;
            }
            let mean = sum / weights;
            let error = squares / weights - mean * mean;
            // A NaN, of no rows, is no improvement.
            if error < best.0 - 1e-9 {
                let tip_radius = math::exp(mean as f32).clamp(0.0002, 0.2);
                best = (error, Rule { tip_radius, allometry, taper });
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn the_rule_that_made_the_radii_is_found() {
        let seed = Seed::new(2);
        for (allometry, taper) in [(2.0, 0.0), (2.4, 1.0), (1.6, 0.5)] {
            let chains: Vec<Carried> = (0..300_u64)
                .map(|i| {
                    let tips = math::exp(seed.at(i).range(0.0, 6.0)).floor().max(1.0);
                    let wood = tips * seed.child("wood").at(i).range(0.2, 3.0);
                    let radius = 0.003 * math::pow(tips + taper * wood, 1.0 / allometry);
                    Carried { tips, wood, radius }
                })
                .collect();
            let rule = fit(&chains);
            assert!((rule.allometry - allometry).abs() < 0.21, "{rule:?}");
            assert!((rule.tip_radius / 0.003 - 1.0).abs() < 0.3, "{rule:?}");
        }
    }

    #[test]
    fn nothing_to_fit_gives_a_rule_all_the_same() {
        let bad = Carried { tips: 1.0, wood: 0.0, radius: 0.0 };
        assert_eq!(fit(&[]).allometry, 2.2);
        assert_eq!(fit(&[bad; 3]).allometry, 2.2);
    }
}
