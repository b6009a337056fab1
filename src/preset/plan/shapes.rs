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
    /// It bends: the square root velocity function moves on a great circle, the square root of the length linearly.
    Elastic,
    /// Every point moves straight, as in the paper: it gets shorter where directions differ.
    Straight,
}
