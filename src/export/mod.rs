//! Assets: meshes, pictures and figures as the bytes that engines read.
//!
//! [`glb()`] writes one variant with all its levels, [`encode_maps`] the pictures that a set shares. Everything here
//! returns bytes; `build` decides where they go.

mod glb;
mod png;
#[cfg(test)]
mod tests;

pub use glb::{AssetIn, AssetLevel, ExportError, MaterialTextures, SetMaterials, glb, level_name};
pub use png::{EncodedMaps, PngKind, encode, encode_maps};
