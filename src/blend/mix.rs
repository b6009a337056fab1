//! The plain mix: the same shares everywhere (2017 TVCG, 4.6).

use crate::relate::{Family, Weights};

/// Every kin at the given shares of the sources, grown to the degree that the sources which have it amount to. So a
/// branch that only a 30 % source has stands at 30 % of its length. Shares need not add up to 1; what is missing is 0.
#[must_use]
pub fn mix(family: &Family, shares: &[f32]) -> Weights {
    let sources = family.sources().len();
    let clean: Vec<f32> =
        (0..sources).map(|s| shares.get(s).copied().filter(|w| w.is_finite() && *w > 0.0).unwrap_or(0.0)).collect();
    let sum: f32 = clean.iter().sum();
    let mut weights = Weights::new(family.kin_count(), sources);
    for kin in family.kin_ids() {
        let (mut own, mut standing) = (0.0, false);
        for (s, share) in clean.iter().enumerate() {
            if *share > 0.0 && family.member(kin, s).is_some() {
                own += share;
                standing |= family.is_primary(kin, s);
            }
        }
        // A kin that only doubles members which other kins stand for would lie inside them.
        weights.set(kin, &clean, if standing && sum > 0.0 { own / sum } else { 0.0 });
    }
    weights
}
