//! Pictures: the CPU rasterizer, made bark and leaves, atlas packing.

mod atlas;
mod coverage;
mod resample;
mod skyline;

pub use atlas::{Atlas, AtlasError, Rect, pack};
pub use coverage::{ALPHA_CUTOFF, CoverageReport, coverage, preserve_coverage};

/// A material's maps, all of one size, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Maps {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// sRGB colour and linear alpha.
    pub color: Vec<[u8; 4]>,
    /// Tangent-space normal, +Y up (glTF), 128 is zero.
    pub normal: Vec<[u8; 3]>,
    /// Occlusion, roughness, metalness (glTF's channel order).
    pub orm: Vec<[u8; 3]>,
}
