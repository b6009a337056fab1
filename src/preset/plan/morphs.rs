//! Parameters of sequences: a morph from one source to another, and a source's own growth, and its way to a sketch.

use serde::Serialize;

use super::{LeafArt, MatchParams, PatternParams, Phyllotaxis, SketchParams};

/// A sequence of frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MorphParams {
    /// Which entry of the preset's variants it is.
    pub entry: usize,
    /// What happens in it.
    pub kind: MorphKind,
    /// How many frames, the ends included; 2 at least.
    pub frames: u32,
    /// Weights of the matching cost, for a morph.
    pub matching: MatchParams,
    /// What makes branches one group, for a morph.
    pub patterns: PatternParams,
    /// What the target's leaves wear.
    pub leaf: TargetLeaf,
    /// The animated file.
    pub clip: Clip,
}

/// What happens in a sequence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum MorphKind {
    /// A source turns into another; indices into the plan's sources.
    Between(usize, usize),
    /// A source grows.
    Growth {
        /// Index into the plan's sources.
        of: usize,
        /// Share of its full age in the first frame, 0..1.
        age: f32,
    },
    /// A source's crown takes a drawn shape.
    Sketch {
        /// Index into the plan's sources.
        of: usize,
        /// What is drawn.
        sketch: SketchParams,
    },
}

/// What leaves wear that dressing puts on the target of a morph.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum TargetLeaf {
    /// What all leaves of the set wear.
    AsSet,
    /// A made leaf of its own.
    Made {
        /// Its picture.
        art: LeafArt,
        /// Length, metres.
        size: f32,
        /// Angle to the twig, radians.
        angle: f32,
        /// How far twigs and leaves hang, 0..=1.
        droop: f32,
        /// Length of a twig, metres.
        twig: f32,
        /// How many leaves there are for one of the usual ones.
        full: f32,
        /// How they follow each other.
        phyllotaxis: Phyllotaxis,
    },
}

/// The animated file of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Clip {
    /// There is none.
    None,
    /// It plays through all frames.
    Play {
        /// How long, seconds.
        seconds: f32,
        /// Most vertices of wood.
        vertices: u32,
        /// Most leaves.
        leaves: u32,
    },
}
