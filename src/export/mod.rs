//! Assets: meshes, pictures and figures as the bytes that engines read.
//!
//! [`glb()`] writes one variant with all its levels, [`encode_maps`] the pictures that a set
//! shares, [`clip_glb`] a sequence with its animation, [`Manifest`] says what was made and measured, [`capsules`] and [`crown_hulls`]
//! are colliders. Everything here returns bytes; `build` decides where they go.

mod clip;
mod collider;
mod convex;
mod crown_hull;
mod extras;
mod glb;
mod ktx2;
mod manifest;
mod packed;
mod plot;
mod png;
mod profile;
#[cfg(test)]
mod tests;
mod textures;
mod uastc;
mod wind;

pub use clip::{ClipIn, ClipLeaves, clip_glb};
pub use collider::{Capsule, capsules};
pub use crown_hull::{Hull, crown_hulls};
pub use glb::{AssetIn, AssetLevel, ExportError, glb, level_name};
pub use ktx2::{MapUse, ktx2};
pub use manifest::{
    AssetEntry, AtlasEntry, Bounds, ClipEntry, FileEntry, ImpostorEntry, LevelEntry, LightmapEntry, MANIFEST_FORMAT,
    Manifest, MeasuredErrors, OutlineErrors, TextureEntry, VariantEntry, WindEntry, switch_distance,
};
pub use plot::{Curve, plot};
pub use png::{EncodedMaps, PngKind, encode, encode_maps, encode_maps_by, encode_quickly};
pub use profile::{Colliders, engine_files};
pub use textures::{MaterialTextures, SetMaterials, webp};
