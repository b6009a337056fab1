//! Sources: what variants are made from, read or grown.

mod glb;

pub use glb::{
    GlbError, GlbInfo, ImageInfo, Instance, LodInfo, LodLevel, MaterialInfo, MeshInfo, PrimitiveInfo, read_glb,
    read_gltf,
};
