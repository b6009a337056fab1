//! What a mesh file holds, whatever its format: triangles in parts, materials, and where the pictures are.
//!
//! Every mesh reader ends in it; telling wood from leaves and finding skeletons start from it. Plain data in the file's
//! own unit and axes; node transforms are applied, polygons cut into triangles.

use glam::{Vec2, Vec3};

use crate::preset::plan::UpAxis;

/// A mesh file's content.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Scene {
    /// What is drawn with one material each; several parts may share one.
    pub parts: Vec<Part>,
    /// The materials that parts name.
    pub materials: Vec<Material>,
    /// The pictures that materials name.
    pub images: Vec<Image>,
    /// The up axis, where the format fixes it (glTF: `Y`); else `Detect`.
    pub up: SceneUp,
    /// What was left out or mended while reading, one sentence each.
    pub notes: Vec<String>,
}

/// Which axis a format says is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneUp(pub UpAxis);

impl Default for SceneUp {
    fn default() -> Self {
        Self(UpAxis::Detect)
    }
}

/// Triangles of one material.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Part {
    /// The file's name for it (object, group, mesh or node); may be empty.
    pub name: String,
    /// Index into [`Scene::materials`].
    pub material: Option<usize>,
    /// Finite positions.
    pub positions: Vec<Vec3>,
    /// One a position, or none.
    pub normals: Vec<Vec3>,
    /// One a position, or none; `v` runs down the picture as in glTF.
    pub uvs: Vec<Vec2>,
    /// Linear colour, one a position, or none.
    pub colors: Vec<[f32; 4]>,
    /// Corners by index into `positions`, every index in range.
    pub triangles: Vec<[u32; 3]>,
    /// Which polygon of the file each triangle was cut from, rising; one a triangle.
    pub faces: Vec<u32>,
}

/// How a surface looks, as far as it matters here.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Material {
    /// May be empty.
    pub name: String,
    /// Whether and how its alpha counts.
    pub alpha: Alpha,
    /// Whether both faces show.
    pub double_sided: bool,
    /// Linear base colour and alpha, a factor of the picture's.
    pub color: [f32; 4],
    /// Colour picture, index into [`Scene::images`].
    pub color_image: Option<usize>,
    /// Normal map.
    pub normal_image: Option<usize>,
    /// Alpha in a picture of its own (OBJ's `map_d`).
    pub alpha_image: Option<usize>,
}

/// How alpha counts.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Alpha {
    /// Not at all.
    #[default]
    Opaque,
    /// Cut off below this.
    Mask(f32),
    /// Blended.
    Blend,
}

/// A picture, still encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Image {
    /// In the file: PNG, JPEG or WebP.
    Embedded(Vec<u8>),
    /// In a file of its own, as written, relative to the mesh's folder.
    File(String),
}
