//! A variant of a built set as it can be drawn: the meshes of one level out of its GLB, the pictures out of its
//! textures.
//!
//! What is shown is what was written, not what was meant: the files are read back by the checked reader that imports
//! use. Pure: bytes in, meshes and pictures out.

use glam::{Vec2, Vec3};

use crate::bake::{Maps, Picture};
use crate::mesh::{Mesh, TreeMesh};
use crate::source::glb::{GlbInfo, read_glb};

/// Largest edge of a texture that is drawn with, texels: larger ones are left out.
const LARGEST: u32 = 8192;

/// What all trees of a set wear.
#[derive(Clone, Debug)]
pub(super) struct Wear {
    /// The atlas, alone; or the pictures that leaves name by their tiles.
    pub(super) leaf: Vec<Picture>,
    /// Tiling bark.
    pub(super) bark: Vec<Picture>,
}

impl Wear {
    /// The base colours and normals of a set, each a PNG; what can't be read is white.
    #[must_use]
    pub(super) fn of_png(leaf: [&[u8]; 2], bark: [&[u8]; 2]) -> Self {
        let (leaf, bark) = rayon::join(|| picture(leaf), || picture(bark));
        Self { leaf: vec![leaf], bark: vec![bark] }
    }
}

fn picture([color, normal]: [&[u8]; 2]) -> Picture {
    let decoded = |bytes: &[u8]| {
        let mut reader = image::ImageReader::with_format(std::io::Cursor::new(bytes), image::ImageFormat::Png);
        let mut limits = image::Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(LARGEST), Some(LARGEST));
        reader.limits(limits);
        reader.decode().ok().map(image::DynamicImage::into_rgba8)
    };
    let Some(color) = decoded(color) else { return blank() };
    let normal = decoded(normal).filter(|n| n.dimensions() == color.dimensions());
    let count = color.width() as usize * color.height() as usize;
    Picture::new(&Maps {
        width: color.width(),
        height: color.height(),
        normal: normal
            .map_or_else(|| vec![[128, 128, 255]; count], |n| n.pixels().map(|p| [p.0[0], p.0[1], p.0[2]]).collect()),
        color: color.pixels().map(|p| p.0).collect(),
        orm: vec![[255; 3]; count],
    })
}

/// One white texel.
pub(super) fn blank() -> Picture {
    Picture::new(&Maps { width: 0, height: 0, color: Vec::new(), normal: Vec::new(), orm: Vec::new() })
}

/// One level of a variant, by the name of its mesh as the manifest tells it; none where the file can't be read or holds
/// no such mesh.
#[must_use]
pub(super) fn level(bytes: &[u8], mesh: &str) -> Option<TreeMesh> {
    let info = read_glb(bytes).ok()?;
    let index = info.meshes.iter().position(|m| m.name == mesh)?;
    let mut tree = TreeMesh::default();
    for (i, primitive) in info.meshes[index].primitives.iter().enumerate() {
        let is_leaf = primitive.material.is_some_and(|m| info.materials[m].name.ends_with("_leaf"));
        let to = if is_leaf { &mut tree.leaf } else { &mut tree.bark };
        *to = part(&info, index, i)?;
    }
    Some(tree)
}

fn part(info: &GlbInfo<'_>, mesh: usize, primitive: usize) -> Option<Mesh> {
    let positions = info.positions(mesh, primitive).ok()?;
    let numbers = |name: &str| info.attribute::<3>(mesh, primitive, name, None).ok().flatten();
    let count = positions.len();
    let normals = numbers("NORMAL").map_or_else(|| vec![Vec3::Y; count], |n| n.0.into_iter().map(Vec3::from).collect());
    let uvs = info.attribute::<2>(mesh, primitive, "TEXCOORD_0", None).ok().flatten();
    let tangents = info.attribute::<4>(mesh, primitive, "TANGENT", None).ok().flatten();
    let occlusion = numbers("COLOR_0");
    Some(Mesh {
        positions: positions.into_iter().map(Vec3::from).collect(),
        normals,
        tangents: tangents.map_or_else(|| vec![[1.0, 0.0, 0.0, 1.0]; count], |t| t.0),
        uvs: uvs.map_or_else(|| vec![Vec2::ZERO; count], |u| u.0.into_iter().map(Vec2::from).collect()),
        occlusion: occlusion.map_or_else(
            || vec![255; count],
            |o| o.0.into_iter().map(|c| (c[0].clamp(0.0, 1.0) * 255.0) as u8).collect(),
        ),
        indices: info.triangles(mesh, primitive).ok()?.into_flattened(),
        ..Mesh::default()
    })
}
