//! What a mesh file holds, whatever its format: triangles in parts, materials, and where the pictures are.
//!
//! Every mesh reader ends in it; telling wood from leaves and finding skeletons start from it. Plain data in the file's
//! own unit and axes; node transforms are applied, polygons cut into triangles.
//!
//! [`read`] is the one door: the format is told by the content, never by the name. What a file names in other files
//! (materials, pictures, buffers) is asked for by [`refers`], in as many rounds as it takes, and handed in as [`Files`]:
//! nothing is read here. A missing material or picture costs a note, a missing buffer is an error.
//!
//! Limits: memory stays below 20 times what is read (all files together) plus 1 MiB; a file that would need more (the
//! same large mesh placed over and over) is refused. Animations, skins, curves, points and lines are left out.

mod gltf;
mod levels;
mod lines;
mod mtl;
mod obj;
mod obj_corners;
mod objects;
mod ply;
mod ply_values;
mod polygon;
mod reference;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use glam::{DVec3, Vec2, Vec3};

use crate::base::Diagnostic;
use crate::preset::plan::UpAxis;

/// Files that a mesh names: their bytes by the name that [`refers`] gave for them.
pub type Files<'a> = BTreeMap<String, &'a [u8]>;

/// The formats of meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Binary glTF 2.0.
    Glb,
    /// glTF 2.0 as text.
    Gltf,
    /// Wavefront OBJ.
    Obj,
    /// Stanford PLY.
    Ply,
}

impl MeshFormat {
    /// The format's name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Glb => "GLB",
            Self::Gltf => "glTF",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
        }
    }
}

/// Which mesh format some bytes are, by their content; none if they are something else.
///
/// GLB and PLY have magic numbers. A glTF text is a JSON object with a member `asset`. An OBJ is text whose first 1000
/// statements are words of OBJ only and hold a vertex.
#[must_use]
pub fn sniff(bytes: &[u8]) -> Option<MeshFormat> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.starts_with(b"glTF") {
        Some(MeshFormat::Glb)
    } else if ply::is_ply(text) {
        Some(MeshFormat::Ply)
    } else if gltf::is_gltf(text) {
        Some(MeshFormat::Gltf)
    } else if obj::is_obj(text) {
        Some(MeshFormat::Obj)
    } else {
        None
    }
}

/// Reads a mesh of any format. `file` is the name that errors carry; `files` holds what the mesh names, as far as it is
/// there. Linear in the size of all files, but for concave polygons.
///
/// # Errors
///
/// What is wrong with the file, at its line or byte; that it is no mesh; that it holds no triangle.
pub fn read(bytes: &[u8], file: &str, files: &Files<'_>) -> Result<Scene, Vec<Diagnostic>> {
    let mut scene = match sniff(bytes) {
        Some(MeshFormat::Glb | MeshFormat::Gltf) => gltf::read(bytes, file, files),
        Some(MeshFormat::Obj) => obj::read(bytes, file, files),
        Some(MeshFormat::Ply) => ply::read(bytes, file),
        None => Err(vec![Diagnostic::new(file, "this is no mesh").with_hint("read are glTF, GLB, OBJ and PLY")]),
    }?;
    levels::keep_finest(&mut scene);
    let missing = |image: &Image| match image {
        Image::File(name) if !files.contains_key(name) => Some(format!("the picture {name} is missing")),
        _ => None,
    };
    scene.notes.extend(scene.images.iter().filter_map(missing));
    if scene.triangles() == 0 {
        return Err(vec![
            Diagnostic::new(file, "the file holds no triangle")
                .with_hint("export the tree's mesh, not points or curves"),
        ]);
    }
    if let Some(far) = out_of_bounds(&scene) {
        return Err(vec![
            Diagnostic::new(file, far).with_hint("mend it or its node's scale in the modeller: a tree is metres high"),
        ]);
    }
    Ok(scene)
}

/// Farthest that two vertices may lie apart, in any unit: ten kilometres of a file in millimetres.
const LARGEST: f32 = 1e7;

/// What is told of a mesh whose vertices lie farther apart than those of anything that is a tree: of the fewest that are apart.
fn out_of_bounds(scene: &Scene) -> Option<String> {
    let all = || scene.parts.iter().flat_map(|part| part.positions.iter().map(move |p| (part, *p)));
    let first = all().next()?.1;
    let apart = |p: Vec3, q: Vec3| (p - q).abs().max_element();
    let far = all().filter(|(_, p)| apart(*p, first) > LARGEST).count();
    let (part, at) = match far {
        0 => return None,
        // It is the first that is astray.
        _ if 2 * far > all().count() => all().next()?,
        _ => all().find(|(_, p)| apart(*p, first) > LARGEST)?,
    };
    let distance = all().map(|(_, p)| apart(p, at)).fold(0.0, f32::max);
    let name = if part.name.is_empty() { String::new() } else { format!("`{}`: ", part.name) };
    Some(format!("{name}a vertex lies {distance:e} from others, which is out of all bounds"))
}

/// The files that a mesh names and that `files` lacks, in rising order: paths relative to the mesh's folder, `/` between
/// folders. Call it again with what could be read until it names nothing new: an OBJ names its MTL, that its pictures.
/// Nothing for what can't be read at all: [`read`] tells why.
#[must_use]
pub fn refers(bytes: &[u8], files: &Files<'_>) -> Vec<String> {
    let mut names = match sniff(bytes) {
        Some(MeshFormat::Glb | MeshFormat::Gltf) => gltf::refers(bytes),
        Some(MeshFormat::Obj) => obj::refers(bytes, files),
        Some(MeshFormat::Ply) => ply::refers(bytes),
        None => Vec::new(),
    };
    names.sort();
    names.dedup();
    names.retain(|name| !files.contains_key(name));
    names
}

/// Drops the materials and pictures that no part uses, and counts the rest anew.
fn keep_used(scene: &mut Scene) {
    let mut materials: Vec<Option<usize>> = vec![None; scene.materials.len()];
    let mut kept = Vec::new();
    for part in &mut scene.parts {
        let Some(material) = part.material else { continue };
        let index = *materials[material].get_or_insert_with(|| {
            kept.push(std::mem::take(&mut scene.materials[material]));
            kept.len() - 1
        });
        part.material = Some(index);
    }
    scene.materials = kept;
    let mut images: Vec<Option<usize>> = vec![None; scene.images.len()];
    let mut left = Vec::new();
    for material in &mut scene.materials {
        let named = [
            &mut material.color_image,
            &mut material.normal_image,
            &mut material.roughness_image,
            &mut material.alpha_image,
        ];
        for image in named.into_iter().chain(material.transmission.as_mut().map(|through| &mut through.image)) {
            let Some(old) = *image else { continue };
            *image = Some(*images[old].get_or_insert_with(|| {
                left.push(scene.images[old].clone());
                left.len() - 1
            }));
        }
    }
    scene.images = left;
}

/// A name by which a mesh names a file, as a path that works.
pub(super) fn path_of(written: &str) -> Option<String> {
    reference::path(written)
}

/// What a file beside the mesh is called in messages.
fn beside(file: &str, name: &str) -> String {
    file.rsplit_once('/').map_or_else(|| name.to_owned(), |(folder, _)| format!("{folder}/{name}"))
}

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
    /// What the file calls its pieces: nodes of glTF, objects and groups of OBJ; parents first. PLY has none.
    pub objects: Vec<Object>,
    /// What was left out or mended while reading, one sentence each.
    pub notes: Vec<String>,
    /// The point of the file that all positions are relative to, in the file's unit and axes: the origin, but where a
    /// file keeps its tree so far from it (a map's coordinates) that single precision would lose its shape.
    pub origin: DVec3,
}

impl Scene {
    /// Triangles of all parts.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|part| part.triangles.len()).sum()
    }

    /// Vertices of all parts.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.parts.iter().map(|part| part.positions.len()).sum()
    }

    /// The encoded bytes of a picture; none where its file is missing.
    #[must_use]
    pub fn image_bytes<'a>(&'a self, image: usize, files: &Files<'a>) -> Option<&'a [u8]> {
        match self.images.get(image)? {
            Image::Embedded(bytes) => Some(bytes),
            Image::File(name) => files.get(name).copied(),
        }
    }
}

/// Which axis a format says is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneUp(pub UpAxis);

impl Default for SceneUp {
    fn default() -> Self {
        Self(UpAxis::Detect)
    }
}

/// A piece of a scene that has a name.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Object {
    /// May be empty.
    pub name: String,
    /// The object that it is a part of, index into [`Scene::objects`].
    pub parent: Option<usize>,
}

/// Triangles of one material.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Part {
    /// The file's name for it (object, group, mesh or node); may be empty.
    pub name: String,
    /// Index into [`Scene::objects`], where there are any.
    pub object: usize,
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
#[derive(Clone, Debug, PartialEq)]
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
    /// Picture whose green is the roughness.
    pub roughness_image: Option<usize>,
    /// Alpha in a picture of its own (OBJ's `map_d`).
    pub alpha_image: Option<usize>,
    /// What it lets through; none where the file doesn't say.
    pub transmission: Option<Transmission>,
}

/// Light that falls on one face and leaves a surface on the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// Share of the light that is not mirrored, 0..=1, a factor of the picture's.
    pub factor: f32,
    /// Picture, index into [`Scene::images`].
    pub image: Option<usize>,
    /// Which of its channels, 0 red to 3 alpha.
    pub channel: usize,
}

impl Default for Material {
    /// Opaque, white, of no picture.
    fn default() -> Self {
        Self {
            name: String::new(),
            alpha: Alpha::Opaque,
            double_sided: false,
            color: [1.0; 4],
            color_image: None,
            normal_image: None,
            roughness_image: None,
            alpha_image: None,
            transmission: None,
        }
    }
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
    /// In a file of its own: a name that [`refers`] gave, relative to the mesh's folder.
    File(String),
}
