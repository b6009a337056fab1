//! Parameters of variants: blends, how their sources are matched, and which trees of many are kept.

use serde::Serialize;

/// One output of a set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Variant {
    /// A source as it is; index into the plan's sources.
    Source(usize),
    /// A tree between sources.
    Blend {
        /// Index into the plan's blends.
        blend: usize,
        /// Which of its trees.
        tree: BlendTree,
    },
    /// A point of a shape space.
    Shape {
        /// Index into the plan's shapes.
        shape: usize,
        /// A share for each source, or for the source and its reflection; they add up to 1.
        shares: Vec<f32>,
    },
    /// A frame of a sequence.
    Frame {
        /// Index into the plan's morphs.
        morph: usize,
        /// Which frame, from 0.
        frame: u32,
    },
    /// One of the kept trees of a selection.
    Selected {
        /// Index into the plan's selections.
        selection: usize,
        /// Which of its kept trees, from 0.
        place: usize,
    },
    /// A variant whose crown follows a sketch.
    Sketched {
        /// Index into the plan's sketches.
        sketch: usize,
        /// What it was before.
        of: Box<Variant>,
    },
}

/// A tree of a blend.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum BlendTree {
    /// One tree out of a stochastic batch.
    State {
        /// Which batch of the entry; each has a schedule of its own.
        batch: u64,
        /// How far into the batch the tree is taken, 0..=1.
        progress: f32,
        /// How far its tasks move in a step; 1 is the usual.
        pace: f32,
    },
    /// A point of the space that the sources span (4.6).
    Point {
        /// A share for each source; they add up to 1.
        shares: Vec<f32>,
        /// How far each branch's own shares may stray from them, 0..=1.
        scatter: f32,
        /// Address of the straying.
        draw: u64,
    },
}

/// A blend: sources in correspondence, and how trees are taken from between them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlendParams {
    /// Which entry of the preset's variants it is.
    pub entry: usize,
    /// Indices of the sources, in the order of the preset; two for batches.
    pub of: Vec<usize>,
    /// Weights of the matching cost.
    pub matching: MatchParams,
    /// What becomes of stems without a partner.
    pub stems: StemRule,
    /// What is put in correspondence.
    pub scale: BlendScale,
    /// How thick chains are; not written where it is as usual, so that such plans keep their keys.
    #[serde(skip_serializing_if = "RadiusRule::is_usual")]
    pub radii: RadiusRule,
    /// Which chains take part.
    pub only: OnlyParams,
    /// What is removed of trees that no selection filters; `botany` says nothing here. None leaves them as they are.
    pub filter: Option<FilterParams>,
}

/// What becomes of the stems that one source has more than the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum StemRule {
    /// They grow and wilt like all chains without a partner, and show while they have come far enough.
    Apart,
    /// They split from stems of the other, and merge with them.
    Merge,
    /// They grow and wilt like all chains without a partner.
    Grow,
}

/// How thick chains of a blend are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum RadiusRule {
    /// Linear between the sources, corrected by the allometric rule where chains have not grown.
    Corrected,
    /// By the allometric rule from the tips on (2017 TVCG, Eq. 3).
    Ruled,
}

impl RadiusRule {
    /// Whether it is the one of presets that say nothing.
    #[must_use]
    pub fn is_usual(&self) -> bool {
        *self == Self::Corrected
    }
}

/// What is put in correspondence along matched chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum BlendScale {
    /// Chains as a whole, by arc length.
    Chain,
    /// The growth units between matched branches, each with a time of its own.
    GrowthUnit,
}

/// Which chains take part in a blend; all when nothing is asked. Demands of one kind are alternatives, demands of
/// different kinds must all hold.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct OnlyParams {
    /// Gravelius orders, from and to.
    pub orders: Vec<(u16, u16)>,
    /// Heights of a chain's base as shares of the plant's height, from and to, 0..=1.
    pub heights: Vec<(f32, f32)>,
    /// Names of parts.
    pub parts: Vec<String>,
}

/// Weights of the matching cost (2017 TVCG, Eq. 2); they add up to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MatchParams {
    /// w_M: crown shape.
    pub crown: f32,
    /// w_v: branching vector.
    pub direction: f32,
    /// w_CR: crown ratio.
    pub ratio: f32,
}

impl Default for MatchParams {
    /// As in presets that say nothing else: 0.5, 0.3, 0.2.
    fn default() -> Self {
        Self { crown: 0.5, direction: 0.3, ratio: 0.2 }
    }
}

/// What makes branches of a place alike and two of them opposite (2017 CAVW, Eq. 1 and 3).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PatternParams {
    /// θ of Eq. 1: standard deviation of branching angles up to which branches are alike, radians.
    pub angle: f32,
    /// r_t of Eq. 1: standard deviation of radii up to which branches are alike, as a share of their mean.
    pub radius: f32,
    /// θ of Eq. 3: how far the divergence of two opposite branches may be from half a turn, radians.
    pub divergence: f32,
}

impl Default for PatternParams {
    /// 10 degrees and a fifth; 30 degrees as in the paper.
    fn default() -> Self {
        Self { angle: 10.0_f32.to_radians(), radius: 0.2, divergence: 30.0_f32.to_radians() }
    }
}

/// Trees of which only some are kept (2017 TVCG, 4.4 and 4.5).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Selection {
    /// The preset's field that asks for it, as `variants[2]`; errors and notes of later stages name it.
    pub field: String,
    /// All that may be kept, in the order in which they take the place of rejected ones.
    pub candidates: Vec<Variant>,
    /// How many are kept.
    pub keep: usize,
    /// Which of them are kept or passed over in any case; not written where there are none, so that such plans keep
    /// their keys.
    #[serde(skip_serializing_if = "Decided::is_empty")]
    pub decided: Decided,
    /// Which of the rest.
    pub pick: Pick,
    /// What makes trees differ.
    pub scores: ScoreParams,
    /// What is mended and rejected before.
    pub filter: FilterParams,
}

/// Trees of an entry that a designer decided about, by number from 0, rising.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Decided {
    /// Those that are in the set in any case.
    pub keep: Vec<usize>,
    /// Those that never are.
    pub reject: Vec<usize>,
}

impl Decided {
    /// Whether nothing was decided.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.keep.is_empty() && self.reject.is_empty()
    }
}

/// Where a variant comes from, for who edits the preset; it says nothing about the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Which entry of the preset's variants makes it, from 0.
    pub entry: usize,
    /// Its number among the trees of the entry, from 1, as `keep` and `reject` count; none where the entry can't decide
    /// about single trees, or a selection finds out which it is.
    pub number: Option<usize>,
}

/// Which candidates are kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Pick {
    /// The first that the filter lets through.
    All,
    /// One of each cluster of scores.
    Inspiring,
    /// Those that are farthest from each other.
    Diverse {
        /// Least distance of two of them, 0..=1.
        apart: f32,
    },
    /// Those that are nearest to the sources, each source in turn.
    Natural,
}

/// Weights of the difference between two trees (2017 TVCG, 4.5): the first three add up to 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScoreParams {
    /// Shape of the crown.
    pub crown: f32,
    /// Share of the trunk that bears the crown.
    pub ratio: f32,
    /// Topology: which branch bears which.
    pub topology: f32,
    /// Of the difference from each source; empty where all count the same, so that such plans keep their keys.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<f32>,
}

impl ScoreParams {
    /// What the difference from a source counts: 1 on average over all of `count`.
    #[must_use]
    pub fn of_source(&self, source: usize, count: usize) -> f32 {
        let sum: f32 = self.sources.iter().sum();
        self.sources.get(source).map_or(1.0, |weight| weight * count as f32 / sum)
    }
}

/// What is mended and rejected.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FilterParams {
    /// Share of the smaller branch's surface that may lie inside another branch at the coarsest scale, 0..=1; 1 for
    /// all of it.
    pub collisions: f32,
    /// How much more of it from scale to scale, 0..=1.
    pub rise: f32,
    /// How far a tree may lie beyond its sources in proportions and in where its wood is, in units of a usual spread,
    /// 0..=1000; 1000 for any distance.
    pub botany: f32,
}

impl FilterParams {
    /// What is done where no other filter is asked for: branches that run into each other go, and all trees stay.
    pub const CLEARED: Self = Self { collisions: 0.01, rise: 0.01, botany: 1000.0 };
}
