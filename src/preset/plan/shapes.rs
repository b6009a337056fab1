//! Parameters of the shape space (2018 TOG): correspondence by elastic curves, geodesics, means, symmetry.

use serde::Serialize;

/// How sources are put in elastic correspondence (2018 TOG, section 3).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ElasticParams {
    /// What a branch without a partner costs, as a distance along its parent, 0..=1; the paper has 0.1.
    pub epsilon: f32,
    /// What opposite directions of two branches cost, as a distance along their parent, 0..=1; the paper has 0.
    pub direction: f32,
    /// What a branch of no length costs against a long one, likewise; the paper has 0.
    pub length: f32,
    /// What two matched branches do between their ends.
    pub path: ChainPath,
}

impl Default for ElasticParams {
    fn default() -> Self {
        Self { epsilon: 0.1, direction: 0.1, length: 0.05, path: ChainPath::Elastic }
    }
}

/// What a branch does on its way from one form to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum ChainPath {
    /// It bends: the square root velocity function moves on a great circle, and the length linearly.
    Elastic,
    /// Every point moves straight, as in the paper: it gets shorter where directions differ.
    Straight,
}

/// Whether plants may turn about the vertical to be nearer to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Facing {
    /// They stay as they stand.
    Fixed,
    /// They are turned to where they are nearest.
    Free,
}

/// The vertical plane that a plant is reflected across.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum MirrorPlane {
    /// The one of least asymmetry.
    Best,
    /// The one that runs towards this azimuth, radians from the front (+z) towards +x.
    At(f32),
}

/// What becomes of branches that are too short for where they stand (2018 TOG, section 4).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum SmallRule {
    /// They stay.
    Kept,
    /// They are left out.
    Removed {
        /// How much of the difference of the sources' branches is allowed below the shorter ones, 0..=10.
        alpha: f32,
    },
}

/// What a shape space is spanned by.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum ShapeKind {
    /// Several sources.
    Sources {
        /// Whether those behind the first are turned.
        facing: Facing,
        /// By how much more they are, radians from the front (+z) towards +x; not written where it is zero, so that such
        /// plans keep their keys.
        #[serde(skip_serializing_if = "is_zero")]
        turn: f32,
    },
    /// Several sources in the correspondence of blends, whose branches keep no order: ways lead through trees of other topologies.
    Orthants {
        /// Whether those behind the first are turned.
        facing: Facing,
        /// By how much more they are, radians from the front (+z) towards +x.
        turn: f32,
    },
    /// One source and its reflection.
    Mirror {
        /// Across which plane.
        plane: MirrorPlane,
    },
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references")]
fn is_zero(turn: &f32) -> bool {
    *turn == 0.0
}

/// A shape space that trees are taken from (2018 TOG).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShapeParams {
    /// Which entry of the preset's variants it is.
    pub entry: usize,
    /// Indices of the sources, in the order of the preset.
    pub of: Vec<usize>,
    /// What spans it.
    pub kind: ShapeKind,
    /// How the sources are matched.
    pub elastic: ElasticParams,
    /// What becomes of small branches.
    pub small: SmallRule,
}
