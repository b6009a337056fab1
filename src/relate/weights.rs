//! `Weights`: one blend, as plain numbers. Modes choose them, [`Family::blend`](super::Family::blend) carries them out.

use serde::Serialize;

use super::KinId;
use crate::base::Seed;

/// For each kin a share for each source and a degree of growth.
///
/// Shares are normalized over the members that a kin has; whatever is not a number above zero counts as zero, and
/// degrees above 1 as 1. A kin with degree 0, or none of whose members has a share, is absent together with all that it
/// bears.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Weights {
    sources: usize,
    shares: Vec<f32>,
    degrees: Vec<f32>,
    /// Address of the times of growth units; 0 for all at once.
    units: u64,
    /// How shares run along each kin; empty where all are even.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    runs: Vec<Run>,
    /// Kins that are as their source has them, radii and all, whatever becomes of what they bear; empty where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    kept: Vec<bool>,
    /// Share of its size that a leaf has at least; with 0 those that did not come out yet are left off.
    #[serde(skip)]
    least_leaf: f32,
}

/// How the shares of two members run along a kin (2017 CAVW, 6.1): `t` is the share of the later source, `s` the
/// arc-length parameter. See `relate/point_weights.rs`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize)]
pub enum Run {
    /// The same everywhere.
    #[default]
    Even,
    /// A copy leaves the chain that it shares, its tip first.
    Split,
    /// A chain joins the one that it will share, its base first.
    Merge,
}

impl Weights {
    /// All zero, for `kins` kins over `sources` sources.
    #[must_use]
    pub fn new(kins: usize, sources: usize) -> Self {
        Self {
            sources,
            shares: vec![0.0; kins * sources],
            degrees: vec![0.0; kins],
            units: 0,
            runs: Vec::new(),
            kept: Vec::new(),
            least_leaf: 0.0,
        }
    }

    /// Sets one kin: a share for each source, in their order, and the degree of growth 0..=1. Shares that are missing
    /// are 0, those too many ignored, as is a kin that does not exist.
    pub fn set(&mut self, kin: KinId, shares: &[f32], degree: f32) {
        let Some(slot) = self.degrees.get_mut(kin.index()) else { return };
        *slot = degree;
        let own = &mut self.shares[kin.index() * self.sources..(kin.index() + 1) * self.sources];
        for (s, slot) in own.iter_mut().enumerate() {
            *slot = shares.get(s).copied().unwrap_or(0.0);
        }
    }

    /// Sets how the shares of one kin run along it; counts where exactly two sources feed it.
    pub fn set_run(&mut self, kin: KinId, run: Run) {
        if self.runs.is_empty() && run != Run::Even {
            self.runs = vec![Run::Even; self.degrees.len()];
        }
        if let Some(slot) = self.runs.get_mut(kin.index()) {
            *slot = run;
        }
    }

    /// How the shares of one kin run along it.
    #[must_use]
    pub fn run(&self, kin: KinId) -> Run {
        self.runs.get(kin.index()).copied().unwrap_or_default()
    }

    /// Has a kin keep the radii of its source, whatever becomes of what it bears.
    pub fn keep(&mut self, kin: KinId) {
        self.kept.resize(self.degrees.len(), false);
        if let Some(slot) = self.kept.get_mut(kin.index()) {
            *slot = true;
        }
    }

    /// Whether it does.
    #[must_use]
    pub fn keeps(&self, kin: KinId) -> bool {
        self.kept.get(kin.index()).copied().unwrap_or(false)
    }

    /// The same weights, for families [by units](super::Family::by_units) with every growth unit at a time of its own.
    #[must_use]
    pub fn with_unit_seed(mut self, seed: Seed) -> Self {
        self.units = seed.bits();
        self
    }

    /// Address of the times of growth units; 0 for all at once.
    pub(super) fn units(&self) -> u64 {
        self.units
    }

    /// The same weights, with every leaf of the chains that are there, of a share of its size at least: keys of an animation
    /// have the same leaves.
    #[must_use]
    pub(crate) fn with_least_leaf(mut self, share: f32) -> Self {
        self.least_leaf = share;
        self
    }

    /// Share of its size that a leaf has at least.
    pub(super) fn least_leaf(&self) -> f32 {
        self.least_leaf
    }

    /// How many kins.
    #[must_use]
    pub fn kins(&self) -> usize {
        self.degrees.len()
    }

    /// How many sources.
    #[must_use]
    pub fn sources(&self) -> usize {
        self.sources
    }

    /// One kin's share for each source; empty for a kin that does not exist.
    #[must_use]
    pub fn shares(&self, kin: KinId) -> &[f32] {
        self.shares.get(kin.index() * self.sources..(kin.index() + 1) * self.sources).unwrap_or(&[])
    }

    /// One kin's degree of growth; 0 for a kin that does not exist.
    #[must_use]
    pub fn degree(&self, kin: KinId) -> f32 {
        self.degrees.get(kin.index()).copied().unwrap_or(0.0)
    }
}
