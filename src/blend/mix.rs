//! Blends of any number of sources by weights (2017 TVCG, 4.6).
//!
//! A plain mix takes the same shares everywhere. A scattered one draws shares and degree of each kin about them, as if
//! every kin's tasks stood at a time of their own: so trees of the same weights differ as those of batches do.

use crate::base::Seed;
use crate::relate::{Family, KinId, Weights};

/// How far along a branch grows while buds come, a share of its growth: one at location `l` of a branch comes when that
/// has grown to `YOUNG`·`l`, and both are full-grown together. With a degree for all that a limb bears, one at a tenth of
/// its length bore its whole crown on it: a ball of leaves on the trunk.
const YOUNG: f32 = 0.7;

/// Every kin at the given shares of the sources, grown to the degree that the sources which have it amount to. So a
/// branch that only a 30 % source has stands at 30 % of its length, and bears what a branch so young does.
/// Shares need not add up to 1; what is missing is 0.
#[must_use]
pub fn mix(family: &Family, shares: &[f32]) -> Weights {
    scattered(family, shares, 0.0, Seed::new(0))
}

/// As [`mix`], with shares and degrees drawn about those given: at `scatter` 1 a share may go up to twice its value or
/// down to nothing. No branch is more grown than the one that bears it, and a source alone stays as it is.
#[must_use]
pub fn scattered(family: &Family, shares: &[f32], scatter: f32, seed: Seed) -> Weights {
    let sources = family.sources().len();
    let clean: Vec<f32> =
        (0..sources).map(|s| shares.get(s).copied().filter(|w| w.is_finite() && *w > 0.0).unwrap_or(0.0)).collect();
    let mut weights = Weights::new(family.kin_count(), sources);
    let mut given = clean.iter().enumerate().filter(|(_, share)| **share > 0.0);
    match (given.next(), given.next()) {
        (None, _) => return weights,
        // A source alone: where kins share its chains, only those that stand for them.
        (Some((only, _)), None) => return family.corner(only),
        _ => {}
    }
    let sum: f64 = clean.iter().map(|w| f64::from(*w)).sum();
    let scatter = if scatter.is_finite() { scatter.clamp(0.0, 1.0) } else { 0.0 };
    let mut own = vec![0.0_f32; sources];
    let mut degrees: Vec<f32> = vec![0.0; family.kin_count()];
    for kin in family.kin_ids() {
        if family.is_stand_in(kin) {
            continue;
        }
        let draw = seed.at(u64::from(kin.0));
        let has = |s: usize| family.member(kin, s).is_some();
        let held = clean.iter().enumerate().filter(|(s, _)| has(*s)).map(|(_, w)| f64::from(*w)).sum::<f64>();
        let held = (held / sum).min(1.0) as f32;
        for (s, share) in own.iter_mut().enumerate() {
            *share = clean[s] * (1.0 + scatter * draw.at(s as u64).range(-1.0, 1.0));
        }
        // Nothing at 0 and 1, most half way.
        let swing = 4.0 * held * (1.0 - held) * scatter * 0.5;
        let drawn = (held + swing * draw.child("degree").range(-1.0, 1.0)).clamp(0.0, 1.0);
        let degree = family.parent(kin).map_or(drawn, |parent| {
            let bearer = degrees[parent.index()];
            let bud = YOUNG * location(family, kin, &clean);
            drawn.min(if bearer < 1.0 { ((bearer - bud) / (1.0 - bud)).max(0.0) } else { 1.0 })
        });
        degrees[kin.index()] = degree;
        weights.set(kin, &own, degree);
    }
    weights
}

/// Where a kin leaves its bearer on the mean of the sources that have it.
fn location(family: &Family, kin: KinId, shares: &[f32]) -> f32 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for (s, share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
        if let Some(chain) = family.member(kin, s) {
            sum += family.sources()[s].chain(chain).location * share;
            weight += share;
        }
    }
    if weight > 0.0 { (sum / weight).clamp(0.0, 1.0) } else { 0.0 }
}
