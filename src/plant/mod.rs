//! `Plant`, the intermediate representation: every source ends in it, every later stage starts from it.
//!
//! An arena of chains, parents before children. A chain is a maximal run of one Gravelius order: an axis as a polyline
//! with radii. Points are relative to the chain's own base, in the frame that [`Pose`] finds on the parent's axis, so no
//! operation can make a branch that floats, and a child follows when its parent bends.

mod allometry;
mod builder;
mod crown;
mod curve;
mod distributions;
mod dump;
mod forks;
mod habit;
mod order;
mod pose;
mod stats;
mod stored;
mod support;
mod validate;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub(crate) use allometry::carried;
pub use allometry::{ALLOMETRIC_EXPONENT, rule_radii};
pub use builder::PlantBuilder;
pub use crown::{Crown, DIRECTIONS};
pub use curve::{Curve, STATIONS};
pub(crate) use curve::{frame_at, value_at};
pub use distributions::{Distribution, distribution_distance};
pub use dump::{dump, undump};
pub use forks::MurrayFit;
pub use habit::{Habit, Span, Trait};
pub use order::{Skeleton, SkeletonNode};
pub use pose::{Pose, Posed};
pub(crate) use stats::PlantBrief;
pub use stats::{BranchMeasures, OrderStats, PlantStats, measure_branches};
pub use support::{trunk_support, trunk_support_by};
pub use validate::PlantError;

use crate::base::{Rotation, math};

/// Index of a chain in its plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ChainId(pub u32);

impl ChainId {
    /// The index as `usize`.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// One axis of a plant, without its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    /// The chain it branches from; none for a stem.
    pub parent: Option<ChainId>,
    /// Where on the parent's axis: arc-length parameter, 0 at the parent's base, 1 at its tip.
    pub location: f32,
    /// Gravelius order: 1 for a stem, one more than the parent's otherwise.
    pub order: u16,
    /// Where a stem stands, metres; zero for every other chain.
    pub origin: Vec3,
    first: u32,
    len: u32,
}

/// One leaf: the septuple of 2017 CAVW, 4.3 (chain, place on it, width and height, three of orientation, texture), and how
/// far from the axis it stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leaf {
    /// The chain that bears it.
    pub chain: ChainId,
    /// Where on the chain's axis: arc-length parameter 0..=1.
    pub location: f32,
    /// Turns the leaf's own axes (`y` from its base to its tip, `z` out of its upper face) into the frame of the chain's
    /// axis at `location`.
    pub orientation: Rotation,
    /// Length from base to tip, metres.
    pub size: f32,
    /// Which leaf picture it wears.
    pub slot: u16,
    /// From the axis to the leaf's base, metres, in the frame of the chain's axis at `location`: a petiole that has no
    /// chain of its own. Zero for leaves that stand on the axis.
    pub offset: Vec3,
    /// The card that it is drawn as.
    pub form: LeafForm,
}

impl Leaf {
    /// A leaf that stands on the axis and is drawn as a square.
    #[must_use]
    pub const fn new(chain: ChainId, location: f32, orientation: Rotation, size: f32, slot: u16) -> Self {
        Self { chain, location, orientation, size, slot, offset: Vec3::ZERO, form: LeafForm::Square }
    }

    /// A frond as a flat leaf from its base to its tip; others as they are.
    pub(crate) fn straight(self) -> Self {
        let LeafForm::Frond { width, arch, .. } = self.form else { return self };
        let half = arch * 0.5;
        let chord = if half.abs() < 1e-3 { 1.0 } else { math::sin_cos(half).0 / half };
        let orientation = self.orientation.after(Rotation::about(Vec3::X, -half));
        Self { orientation, size: self.size * chord, form: LeafForm::Flat(width / chord.max(1e-3)), ..self }
    }
}

/// The card that a leaf is drawn as.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub enum LeafForm {
    /// As wide as it is long; folded along its middle where triangles allow.
    #[default]
    Square,
    /// Flat, this many times as wide as it is long: a card that a mesh brought along.
    Flat(f32),
    /// A long sheet that is bent and folded by itself, as a palm's frond is, however the leaf lies.
    Frond {
        /// Laid flat, over the length along the midrib.
        width: f32,
        /// How far the tip is turned away from the upper face, radians: the midrib is a circle's arc.
        arch: f32,
        /// How far the halves lean away from the upper face, radians.
        fold: f32,
    },
}

impl LeafForm {
    /// Width over length.
    #[must_use]
    pub const fn width(self) -> f32 {
        match self {
            Self::Square => 1.0,
            Self::Flat(width) | Self::Frond { width, .. } => width,
        }
    }

    /// Whether all that it is told by is a finite number, and its width not below zero.
    pub(super) const fn is_sound(self) -> bool {
        let (arch, fold) = self.bend();
        self.width().is_finite() && self.width() >= 0.0 && arch.is_finite() && fold.is_finite()
    }

    /// A frond's arch and fold, radians; zero of others, which lie flat or as the mesh is asked to bend them.
    const fn bend(self) -> (f32, f32) {
        match self {
            Self::Square | Self::Flat(_) => (0.0, 0.0),
            Self::Frond { arch, fold, .. } => (arch, fold),
        }
    }

    /// The form at share `t` of the way to another, of leaves of two lengths, metres: the width of the leaf goes as
    /// straight from one to the other as its length does (2017 CAVW, 6.2).
    #[must_use]
    pub fn between(self, other: Self, sizes: [f32; 2], t: f32) -> Self {
        let mix = |a: f32, b: f32| a * (1.0 - t) + b * t;
        let (length, wide) = (mix(sizes[0], sizes[1]), mix(sizes[0] * self.width(), sizes[1] * other.width()));
        // Of no length, none is wider than the other.
        let width = match wide / length {
            width if length > 0.0 && width.is_finite() => width,
            _ => mix(self.width(), other.width()),
        };
        match (self, other) {
            (Self::Square, Self::Square) => Self::Square,
            (Self::Square | Self::Flat(_), Self::Square | Self::Flat(_)) => Self::Flat(width),
            _ => {
                let (a, b) = (self.bend(), other.bend());
                Self::Frond { width, arch: mix(a.0, b.0), fold: mix(a.1, b.1) }
            }
        }
    }
}

/// A tree or shrub: chains with points and radii, and leaves.
///
/// Built by [`PlantBuilder`] only; every invariant is stated in `plant/validate.rs`.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Plant {
    chains: Vec<Chain>,
    points: Vec<Vec3>,
    radii: Vec<f32>,
    leaves: Vec<Leaf>,
}

impl Plant {
    /// All chains, parents before children.
    #[must_use]
    pub fn chains(&self) -> &[Chain] {
        &self.chains
    }

    /// The ids of all chains, parents before children.
    pub fn chain_ids(&self) -> impl DoubleEndedIterator<Item = ChainId> + ExactSizeIterator + use<> {
        (0..self.chains.len() as u32).map(ChainId)
    }

    /// One chain.
    #[must_use]
    pub fn chain(&self, id: ChainId) -> &Chain {
        &self.chains[id.index()]
    }

    /// A chain's axis, base first: metres, relative to its base, in the frame of its parent. The first point is zero.
    #[must_use]
    pub fn points(&self, id: ChainId) -> &[Vec3] {
        &self.points[self.span(id)]
    }

    /// A chain's radii, metres, one a point.
    #[must_use]
    pub fn radii(&self, id: ChainId) -> &[f32] {
        &self.radii[self.span(id)]
    }

    /// Where a chain's points and radii lie in [`all_points`](Self::all_points), [`all_radii`](Self::all_radii) and
    /// in the arrays of a [`Posed`] plant.
    #[must_use]
    pub fn span(&self, id: ChainId) -> std::ops::Range<usize> {
        let chain = &self.chains[id.index()];
        chain.first as usize..(chain.first + chain.len) as usize
    }

    /// The points of all chains, chain after chain.
    #[must_use]
    pub fn all_points(&self) -> &[Vec3] {
        &self.points
    }

    /// The radii of all chains, chain after chain.
    #[must_use]
    pub fn all_radii(&self) -> &[f32] {
        &self.radii
    }

    /// All leaves.
    #[must_use]
    pub fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    /// The same plant without its leaves.
    #[must_use]
    pub fn without_leaves(mut self) -> Self {
        self.leaves.clear();
        self
    }

    /// The same plant with other slots and forms of its leaves.
    #[must_use]
    pub(crate) fn rewear(mut self, wear: impl Fn(usize, &Leaf) -> (u16, LeafForm)) -> Self {
        for (i, leaf) in self.leaves.iter_mut().enumerate() {
            (leaf.slot, leaf.form) = wear(i, leaf);
        }
        self
    }

    /// The same plant, its wood `factor` times as large; leaves keep their size, as those of saplings do.
    #[must_use]
    pub(crate) fn scaled(mut self, factor: f32) -> Self {
        if factor != 1.0 {
            self.chains.iter_mut().for_each(|chain| chain.origin *= factor);
            self.points.iter_mut().for_each(|point| *point *= factor);
            self.radii.iter_mut().for_each(|radius| *radius *= factor);
            self.leaves.iter_mut().for_each(|leaf| leaf.offset *= factor);
        }
        self
    }

    /// The same plant with other radii, one a point.
    #[must_use]
    pub(crate) fn with_radii(mut self, radii: Vec<f32>) -> Self {
        self.radii = radii;
        debug_assert_eq!(validate::validate(&self), Ok(()));
        self
    }

    /// The same plant with other leaves, each on a chain of it.
    #[must_use]
    pub(crate) fn with_leaves(mut self, leaves: Vec<Leaf>) -> Self {
        self.leaves = leaves;
        debug_assert_eq!(validate::validate(&self), Ok(()));
        self
    }

    /// The same plant with those leaves for which `keep` gives one.
    #[must_use]
    pub(crate) fn keep_leaves(mut self, keep: impl Fn(usize, &Leaf) -> Option<Leaf>) -> Self {
        self.leaves = self.leaves.iter().enumerate().filter_map(|(i, leaf)| keep(i, leaf)).collect();
        self
    }

    /// For each chain its children, in order of id.
    #[must_use]
    pub fn children(&self) -> Vec<Vec<ChainId>> {
        let mut children = vec![Vec::new(); self.chains.len()];
        for id in self.chain_ids() {
            if let Some(parent) = self.chain(id).parent {
                children[parent.index()].push(id);
            }
        }
        children
    }

    /// Which chains have such a radius somewhere, metres, as all that bear them have.
    pub(crate) fn thick(&self, radius: f32) -> Vec<bool> {
        let mut thick = vec![false; self.chains.len()];
        for id in self.chain_ids() {
            let widest = self.radii(id).iter().fold(0.0_f32, |a, &r| a.max(r));
            thick[id.index()] = widest >= radius && self.chain(id).parent.is_none_or(|p| thick[p.index()]);
        }
        thick
    }

    /// World positions and frames.
    #[must_use]
    pub fn pose(&self) -> Posed {
        Posed::of(self)
    }

    /// Height of the highest point of any axis above the origin, metres.
    #[must_use]
    pub fn height(&self) -> f32 {
        Posed::of_bearers(self).height()
    }
}
