//! Alpha coverage.

/// Alpha at which a leaf's texel is solid: the cut-off of the `MASK` material, as a share of full alpha.
pub const ALPHA_CUTOFF: f32 = 0.5;
