//! Points between plants in elastic correspondence: geodesics, weighted means and samples are all shares of the sources.
//!
//! In an elastic family no two sources order their branches differently, so all lie in one orthant of tree space (or on
//! its boundary) and the geodesic of two is the weighted mean at every share. A branch that a source lacks is there with zero length.

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
        weights.set(kin, &clean, held as f32);
    }
    weights
}
