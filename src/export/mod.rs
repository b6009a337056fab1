//! Assets: meshes, pictures and figures as the bytes that engines read.
//!
//! [`glb()`] writes one variant with all its levels, [`encode_maps`] the pictures that a set
//! shares, [`clip_glb`] a sequence with its animation, [`Manifest`] says what was made and measured, [`capsules`] are colliders. Everything here
//! returns bytes; `build` decides where they go.

mod clip;
mod collider;
mod glb;
mod manifest;
mod packed;
mod plot;
mod png;
mod profile;
#[cfg(test)]
mod tests;

pub use clip::{ClipIn, ClipLeaves, clip_glb};
pub use collider::{Capsule, ColliderParams, capsules};
pub use glb::{AssetIn, AssetLevel, ExportError, MaterialTextures, SetMaterials, glb, level_name};
pub use manifest::{
    AssetEntry, AtlasEntry, Bounds, ClipEntry, FileEntry, ImpostorEntry, LevelEntry, MANIFEST_FORMAT, Manifest,
    MeasuredErrors, TextureEntry, VariantEntry, WindEntry, switch_distance,
};
pub use plot::{Curve, plot};
pub use png::{EncodedMaps, PngKind, encode, encode_maps, encode_maps_by};
pub use profile::engine_files;
