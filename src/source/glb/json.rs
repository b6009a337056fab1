//! The part of the glTF 2.0 schema that the reader looks at, as plain structs.
//!
//! Own structs instead of `gltf_json`'s: that crate cuts 64-bit indices to 32 bits without a word, and builds many more
//! objects than are needed here. Unknown fields are skipped; `serde_json` bounds the depth at 128.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Root {
    pub(super) asset: Asset,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<View>,
    pub(super) buffers: Vec<Buffer>,
    pub(super) extensions_used: Vec<String>,
    pub(super) extensions_required: Vec<String>,
    pub(super) images: Vec<Image>,
    pub(super) materials: Vec<Material>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) nodes: Vec<Node>,
    pub(super) scene: Option<u64>,
    pub(super) scenes: Vec<Scene>,
    pub(super) textures: Vec<Texture>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Asset {
    pub(super) version: String,
    pub(super) generator: String,
    /// Anything, of whoever wrote the file.
    pub(super) extras: serde_json::Value,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<u64>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) shape: String,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) min: Option<Vec<f64>>,
    pub(super) max: Option<Vec<f64>>,
    pub(super) sparse: Option<Box<Sparse>>,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    pub(super) count: u64,
    pub(super) indices: SparsePart,
    pub(super) values: SparsePart,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparsePart {
    pub(super) buffer_view: u64,
    #[serde(default)]
    pub(super) byte_offset: u64,
    /// Of indices only.
    #[serde(default)]
    pub(super) component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub(super) buffer: u64,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<u64>,
    #[serde(default)]
    pub(super) extensions: ViewExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub(super) meshopt: Option<Box<Meshopt>>,
    #[serde(rename = "KHR_meshopt_compression")]
    pub(super) khr_meshopt: Option<Box<Meshopt>>,
}

/// Where a packed view's bytes are, and what they unpack to.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Meshopt {
    pub(super) buffer: u64,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: u64,
    pub(super) count: u64,
    pub(super) mode: String,
    #[serde(default)]
    pub(super) filter: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: u64,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Image {
    pub(super) name: String,
    pub(super) uri: Option<String>,
    pub(super) buffer_view: Option<u64>,
    pub(super) mime_type: String,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Material {
    pub(super) name: String,
    pub(super) alpha_mode: String,
    pub(super) alpha_cutoff: Option<f32>,
    pub(super) double_sided: bool,
    pub(super) pbr_metallic_roughness: Option<Box<Pbr>>,
    pub(super) normal_texture: Option<Box<TextureUse>>,
    pub(super) extensions: MaterialExtensions,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Pbr {
    pub(super) base_color_factor: Option<[f32; 4]>,
    pub(super) base_color_texture: Option<TextureUse>,
    pub(super) metallic_roughness_texture: Option<TextureUse>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub(super) glossiness: Option<Box<Glossiness>>,
    #[serde(rename = "KHR_materials_diffuse_transmission")]
    pub(super) diffuse_transmission: Option<Box<Transmission>>,
    #[serde(rename = "KHR_materials_transmission")]
    pub(super) transmission: Option<Box<Transmission>>,
}

/// Of one of the two extensions.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Transmission {
    #[serde(rename = "diffuseTransmissionFactor", alias = "transmissionFactor")]
    pub(super) factor: f32,
    #[serde(rename = "diffuseTransmissionTexture", alias = "transmissionTexture")]
    pub(super) texture: Option<TextureUse>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Glossiness {
    pub(super) diffuse_factor: Option<[f32; 4]>,
    pub(super) diffuse_texture: Option<TextureUse>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureUse {
    pub(super) index: u64,
    #[serde(default)]
    pub(super) tex_coord: u32,
    #[serde(default)]
    pub(super) extensions: TextureUseExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct TextureUseExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(super) transform: Option<TextureTransform>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureTransform {
    #[serde(default)]
    pub(super) offset: [f32; 2],
    #[serde(default)]
    pub(super) rotation: f32,
    pub(super) scale: Option<[f32; 2]>,
    pub(super) tex_coord: Option<u32>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Texture {
    pub(super) source: Option<u64>,
    pub(super) extensions: TextureExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    pub(super) webp: Option<Box<TextureSource>>,
}

#[derive(Deserialize)]
pub(super) struct TextureSource {
    pub(super) source: u64,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Mesh {
    pub(super) name: String,
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: BTreeMap<String, u64>,
    pub(super) indices: Option<u64>,
    pub(super) material: Option<u64>,
    pub(super) mode: Option<u32>,
    #[serde(default)]
    pub(super) extensions: PrimitiveExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub(super) draco: Option<IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: String,
    pub(super) mesh: Option<u64>,
    pub(super) children: Vec<u64>,
    pub(super) matrix: Option<Box<[f32; 16]>>,
    pub(super) translation: Option<[f32; 3]>,
    pub(super) rotation: Option<[f32; 4]>,
    pub(super) scale: Option<[f32; 3]>,
    pub(super) extras: Extras,
    pub(super) extensions: Extensions,
}

/// What an application adds to a node: anything, of which only the levels' coverage is kept.
#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum Extras {
    Known {
        #[serde(rename = "MSFT_screencoverage")]
        coverage: Box<[f64]>,
    },
    Other(IgnoredAny),
}

impl Default for Extras {
    fn default() -> Self {
        Self::Other(IgnoredAny)
    }
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Extensions {
    #[serde(rename = "MSFT_lod")]
    pub(super) msft_lod: Option<MsftLod>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) instancing: Option<Box<Instancing>>,
}

/// Accessors of the places of a node's copies, by `TRANSLATION`, `ROTATION` and `SCALE`.
#[derive(Deserialize)]
pub(super) struct Instancing {
    pub(super) attributes: BTreeMap<String, u64>,
}

#[derive(Deserialize)]
pub(super) struct MsftLod {
    pub(super) ids: Vec<u64>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Scene {
    pub(super) nodes: Vec<u64>,
}
