//! A checked reader of binary glTF 2.0, for `inspect` and for meshes as sources.
//!
//! The `gltf` crate's reader panics on hostile files (a header length below 12, huge or zero accessor counts), so nothing
//! is handed to it. Here every length, offset, stride, count and index is checked against the bytes that are there before
//! anything is touched or allocated: what is allocated is bounded by a constant times the size of the file, whatever the
//! file claims. Sparse and quantized attributes (`KHR_mesh_quantization`), base64 in the text and files beside it are
//! read, and so is what meshopt packed (`unpack`) and copies by EXT_mesh_gpu_instancing.
//!
//! Limits: what Draco compressed is counted but not read; skins, morph targets and animations are ignored.
//!
//! Source: glTF 2.0 specification, 3.6, 3.7 and 4.4; MSFT_lod vendor extension.

mod accessor;
mod budget;
pub(super) mod buffers;
mod json;
pub(super) mod look;
mod scene;
#[cfg(test)]
mod tests;
mod unpack;

use std::collections::BTreeMap;

use serde::Serialize;

use accessor::{Elements, Layout};
use buffers::Buffers;

/// Why a file can't be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GlbError {
    /// The first bytes aren't a GLB 2.0 header.
    #[error("no binary glTF 2.0 file: {0}")]
    Container(String),
    /// The JSON is none, or not glTF.
    #[error("the glTF text can't be read: {0}")]
    Json(String),
    /// Something refers to what isn't there.
    #[error("{0}")]
    Broken(String),
    /// Valid, but beyond this reader.
    #[error("{0}")]
    Unsupported(String),
    /// Vertices that only a Draco decoder can read.
    #[error("its vertices are compressed by Draco (`KHR_draco_mesh_compression`), which is not read")]
    Draco,
}

impl GlbError {
    /// What helps; empty where nothing is known to.
    #[must_use]
    pub const fn help(&self) -> &'static str {
        match self {
            Self::Draco => {
                "`npx @gltf-transform/cli copy in.glb out.glb` writes the file without it; or export it again with the \
                 exporter's compression off (Blender: Data > Compression). meshopt's compression is read"
            }
            _ => "",
        }
    }
}

/// What a file holds.
#[derive(Clone, Debug, Serialize)]
pub struct GlbInfo<'a> {
    /// The tool that wrote it; empty when it doesn't say.
    pub generator: String,
    /// All meshes.
    pub meshes: Vec<MeshInfo>,
    /// All materials.
    pub materials: Vec<MaterialInfo>,
    /// All images.
    pub images: Vec<ImageInfo>,
    /// Each mesh that the default scene shows, with its place; LOD0 only where there are levels.
    pub instances: Vec<Instance>,
    /// Each node with `MSFT_lod` levels.
    pub lods: Vec<LodInfo>,
    /// The nodes of the default scene with a mesh in or below them, parents first: their names and which of these is the parent.
    #[serde(skip)]
    pub(super) nodes: Vec<(String, Option<usize>)>,
    /// Extensions used, as the file says.
    pub extensions_used: Vec<String>,
    /// Extensions without which the file can't be shown right.
    pub extensions_required: Vec<String>,
    /// What buffers hold; none for one that is in a file that is missing.
    #[serde(skip)]
    buffers: Buffers<'a>,
    #[serde(skip)]
    layouts: Vec<Layout>,
    /// How far stems go on below the ground, metres, as a file of Treewright's own tells.
    #[serde(skip)]
    pub(super) below: f32,
    /// What materials wear and pictures hold.
    #[serde(skip)]
    pub(super) look: look::Look,
}

/// A mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshInfo {
    /// Empty when it has none.
    pub name: String,
    /// Its primitives.
    pub primitives: Vec<PrimitiveInfo>,
}

impl MeshInfo {
    /// Triangles of all primitives.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        self.primitives.iter().fold(0, |sum, p| sum.saturating_add(p.triangles))
    }

    /// Vertices of all primitives.
    #[must_use]
    pub fn vertices(&self) -> u64 {
        self.primitives.iter().fold(0, |sum, p| sum.saturating_add(p.vertices))
    }
}

/// A primitive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PrimitiveInfo {
    /// Index of its material.
    pub material: Option<usize>,
    /// Vertices, as its positions count them.
    pub vertices: u64,
    /// Triangles; 0 for points and lines.
    pub triangles: u64,
    /// Names of its attributes, sorted.
    pub attributes: Vec<String>,
    /// Least and greatest position as the file states them, in the mesh's own space; none where it doesn't.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// glTF's number of the mode; 4 is a list of triangles.
    pub mode: u32,
    /// Accessors, one for each of `attributes`.
    #[serde(skip)]
    accessors: Vec<u32>,
    #[serde(skip)]
    indices: Option<u32>,
    /// Whether Draco holds the data.
    #[serde(skip)]
    draco: bool,
}

/// A material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialInfo {
    /// Empty when it has none.
    pub name: String,
    /// `OPAQUE`, `MASK` or `BLEND`.
    pub alpha_mode: String,
    /// Cut-off of `MASK`.
    pub alpha_cutoff: f32,
    /// Whether both faces show.
    pub double_sided: bool,
}

/// An image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImageInfo {
    /// Empty when it has none.
    pub name: String,
    /// The file it is in, percent-encoded as in the file; empty when it is embedded. Data URIs are cut after the comma.
    pub uri: String,
    /// Bytes that it takes inside the file; 0 for a file of its own.
    pub embedded_bytes: u64,
    /// As the file says, may be empty.
    pub mime_type: String,
}

/// A mesh in the default scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Instance {
    /// Name of its node.
    pub node: String,
    /// Which of the scene's nodes that is.
    #[serde(skip)]
    pub(super) at: usize,
    /// Index of the mesh.
    pub mesh: usize,
    /// From the mesh's space to the scene's, column by column.
    pub matrix: [f32; 16],
}

impl Instance {
    /// A point of the mesh, in the scene.
    #[must_use]
    pub fn place(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let m = &self.matrix;
        std::array::from_fn(|i| m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i])
    }
}

/// A node's levels of detail by `MSFT_lod`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LodInfo {
    /// Name of the node that carries the finest level.
    pub node: String,
    /// The levels, finest first.
    pub levels: Vec<LodLevel>,
}

/// A level of detail.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LodLevel {
    /// Name of its node.
    pub node: String,
    /// Index of its mesh; none where the node has children instead.
    pub mesh: Option<usize>,
    /// `MSFT_screencoverage` of the level, where stated.
    pub screen_coverage: Option<f32>,
}

/// Reads a binary glTF file that stands alone.
///
/// # Errors
///
/// When it is no GLB 2.0 file, is cut off, or refers to what isn't there.
pub fn read_glb(bytes: &[u8]) -> Result<GlbInfo<'_>, GlbError> {
    let (text, bin) = chunks(bytes)?;
    read(text, bin, true, &BTreeMap::new())
}

/// Reads the text of a `.gltf` file; what is in files beside it can be counted, not read.
///
/// # Errors
///
/// When it isn't glTF 2.0, or refers to what isn't there.
pub fn read_gltf(text: &[u8]) -> Result<GlbInfo<'_>, GlbError> {
    read_with(text, &BTreeMap::new())
}

/// Reads a glTF file, binary or text, with the files that it names.
///
/// # Errors
///
/// When it isn't glTF 2.0, or refers to what isn't there. A missing file is an error only once its data is asked for.
pub fn read_with<'a>(bytes: &'a [u8], files: &BTreeMap<String, &'a [u8]>) -> Result<GlbInfo<'a>, GlbError> {
    if bytes.starts_with(b"glTF") {
        let (text, bin) = chunks(bytes)?;
        read(text, bin, true, files)
    } else {
        read(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), &[], false, files)
    }
}

/// An attribute: the first `N` numbers of each vertex, and how many a vertex has.
type Numbers<const N: usize> = (Vec<[f32; N]>, usize);

impl GlbInfo<'_> {
    /// Positions of a primitive, in the mesh's own space.
    ///
    /// # Errors
    ///
    /// When the primitive isn't there, or its data isn't in this file or is compressed.
    pub fn positions(&self, mesh: usize, primitive: usize) -> Result<Vec<[f32; 3]>, GlbError> {
        let elements = self.elements(self.primitive(mesh, primitive)?, "POSITION")?;
        Ok(elements.map_or_else(Vec::new, |e| (0..e.len()).map(|i| e.get(i)).collect()))
    }

    /// An attribute's elements; none where the primitive has no such one.
    fn elements(&self, primitive: &PrimitiveInfo, name: &str) -> Result<Option<Elements<'_>>, GlbError> {
        if primitive.draco {
            return Err(GlbError::Draco);
        }
        let Ok(at) = primitive.attributes.binary_search_by(|a| a.as_str().cmp(name)) else { return Ok(None) };
        self.layouts[primitive.accessors[at] as usize].elements(&self.buffers).map(Some)
    }

    /// An attribute of some vertices (all where none are given), its first `N` numbers each, and how many a vertex has.
    pub(crate) fn attribute<const N: usize>(
        &self,
        mesh: usize,
        primitive: usize,
        name: &str,
        vertices: Option<&[u32]>,
    ) -> Result<Option<Numbers<N>>, GlbError> {
        let Some(elements) = self.elements(self.primitive(mesh, primitive)?, name)? else { return Ok(None) };
        let numbers = match vertices {
            Some(vertices) => vertices.iter().map(|&i| elements.get(i as usize)).collect(),
            None => (0..elements.len()).map(|i| elements.get(i)).collect(),
        };
        Ok(Some((numbers, elements.components())))
    }

    /// Triangles of a primitive by index into its positions; strips and fans are taken apart, points and lines give none.
    ///
    /// # Errors
    ///
    /// As for [`positions`](Self::positions), and when an index is out of range.
    pub fn triangles(&self, mesh: usize, primitive: usize) -> Result<Vec<[u32; 3]>, GlbError> {
        let primitive = self.primitive(mesh, primitive)?;
        let count = self.elements(primitive, "POSITION")?.map_or(0, |e| e.len());
        let indices = match primitive.indices {
            Some(accessor) => self.layouts[accessor as usize].elements(&self.buffers)?.indices(count)?,
            None => (0..u32::try_from(count).map_err(|_| GlbError::Unsupported("too many vertices".into()))?).collect(),
        };
        let strip = |i: usize| {
            let (a, b) = if i.is_multiple_of(2) { (i + 1, i + 2) } else { (i + 2, i + 1) };
            [indices[i], indices[a], indices[b]]
        };
        let runs = indices.len().saturating_sub(2);
        Ok(match primitive.mode {
            4 => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            5 => (0..runs).map(strip).collect(),
            6 => (0..runs).map(|i| [indices[i + 1], indices[i + 2], indices[0]]).collect(),
            _ => Vec::new(),
        })
    }

    /// Least and greatest corner of the default scene by the stated bounds of its primitives; none where nothing is
    /// stated.
    #[must_use]
    pub fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        let mut all: Option<[[f32; 3]; 2]> = None;
        for instance in &self.instances {
            for [low, high] in self.meshes[instance.mesh].primitives.iter().filter_map(|p| p.bounds) {
                for corner in 0..8 {
                    let p = std::array::from_fn(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] });
                    let p = instance.place(p);
                    let [least, most] = all.get_or_insert([p, p]);
                    for k in 0..3 {
                        least[k] = least[k].min(p[k]);
                        most[k] = most[k].max(p[k]);
                    }
                }
            }
        }
        all
    }

    /// Bytes of a buffer, if they are there.
    pub(super) fn bytes(&self, buffer: usize, start: usize, length: usize) -> Option<&[u8]> {
        self.buffers.get(buffer)?.as_deref().ok()?.get(start..)?.get(..length)
    }

    fn primitive(&self, mesh: usize, primitive: usize) -> Result<&PrimitiveInfo, GlbError> {
        let found = self.meshes.get(mesh).and_then(|m| m.primitives.get(primitive));
        found.ok_or_else(|| GlbError::Broken(format!("there is no primitive {primitive} in a mesh {mesh}")))
    }
}

/// The JSON and the binary chunk of a container.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), GlbError> {
    let broken = |what: &str| GlbError::Container(what.to_owned());
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (Some(magic), Some(version), Some(length)) = (bytes.get(..4), word(4), word(8)) else {
        return Err(broken("it is shorter than a header"));
    };
    if magic != b"glTF" {
        return Err(broken("it does not begin with \"glTF\""));
    }
    if version != 2 {
        return Err(broken(&format!("it states version {version}")));
    }
    let length = length as usize;
    if length < 12 || length > bytes.len() {
        return Err(broken(&format!("its header states {length} bytes, the file has {}", bytes.len())));
    }
    let mut rest = &bytes[12..length];
    let mut text = None;
    let mut bin: &[u8] = &[];
    let mut first = true;
    while !rest.is_empty() {
        let Some((header, body)) = rest.split_at_checked(8) else {
            return Err(broken("it ends inside a chunk's header"));
        };
        let size = u32::from_le_bytes([header[0], header[1], header[2], header[3]]) as usize;
        let Some((chunk, after)) = body.split_at_checked(size) else {
            return Err(broken(&format!("a chunk of {size} bytes has only {}", body.len())));
        };
        match (&header[4..], first) {
            (b"JSON", true) => text = Some(chunk),
            (b"BIN\0", false) if bin.is_empty() => bin = chunk,
            (_, true) => return Err(broken("its first chunk is not JSON")),
            // The specification: chunks of other kinds are to be skipped.
            (_, false) => {}
        }
        first = false;
        rest = after;
    }
    text.map(|text| (text, bin)).ok_or_else(|| broken("it has no JSON chunk"))
}

fn read<'a>(
    text: &[u8],
    bin: &'a [u8],
    container: bool,
    files: &BTreeMap<String, &'a [u8]>,
) -> Result<GlbInfo<'a>, GlbError> {
    if budget::is_dense(text) {
        return Err(GlbError::Unsupported("its text holds far more objects than a file of its size should".to_owned()));
    }
    let mut root: json::Root = serde_json::from_slice(text).map_err(|e| GlbError::Json(e.to_string()))?;
    if root.asset.version.split('.').next() != Some("2") {
        return Err(GlbError::Json(format!("it states glTF version {:?}, not \"2.0\"", root.asset.version)));
    }
    accessor::check_views(&root)?;
    let mut buffers = buffers::buffers(&root, bin, container, files)?;
    unpack::unpack(&mut root, &mut buffers)?;
    let layouts = accessor::layouts(&root)?;
    let meshes = root.meshes.iter().enumerate().map(|(i, m)| mesh(i, m, &root, &layouts)).collect::<Result<_, _>>()?;
    let images = root.images.iter().map(|image| self::image(image, &root)).collect::<Result<_, _>>()?;
    let (nodes, instances) = scene::instances(&root, &layouts, &buffers)?;
    Ok(GlbInfo {
        instances,
        nodes,
        lods: scene::lods(&root)?,
        meshes,
        images,
        look: look::Look::of(&root, &buffers)?,
        materials: root.materials.into_iter().map(material).collect(),
        below: below(&root.asset),
        generator: root.asset.generator,
        extensions_used: root.extensions_used,
        extensions_required: root.extensions_required,
        buffers,
        layouts,
    })
}

/// What a file of Treewright's own tells of its stems; zero of others.
fn below(asset: &json::Asset) -> f32 {
    let told = asset.extras.get("below").and_then(serde_json::Value::as_f64).unwrap_or(0.0) as f32;
    if asset.generator.starts_with("Treewright ") && told.is_finite() { told.max(0.0) } else { 0.0 }
}

/// The files that a glTF names, binary or text, as far as its text can be read.
pub(super) fn named_files(bytes: &[u8]) -> Vec<String> {
    /// Only what names files.
    #[derive(serde::Deserialize, Default)]
    #[serde(default)]
    struct Names {
        buffers: Vec<Uri>,
        images: Vec<Uri>,
    }
    #[derive(serde::Deserialize, Default)]
    #[serde(default)]
    struct Uri {
        uri: Option<String>,
    }
    let text = if bytes.starts_with(b"glTF") {
        chunks(bytes).map_or(&[][..], |(text, _)| text)
    } else {
        bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
    };
    if budget::is_dense(text) {
        return Vec::new();
    }
    let names: Names = serde_json::from_slice(text).unwrap_or_default();
    names.buffers.iter().chain(&names.images).filter_map(|n| buffers::file_name(n.uri.as_deref()?)).collect()
}

fn mesh(index: usize, mesh: &json::Mesh, root: &json::Root, layouts: &[Layout]) -> Result<MeshInfo, GlbError> {
    let primitive = |(i, p): (usize, &json::Primitive)| {
        let what = |part: &str| format!("mesh {index}, primitive {i}: {part}");
        let of = |accessor: u64, part: &str| {
            let at = usize::try_from(accessor).ok().filter(|&a| a < layouts.len());
            at.ok_or_else(|| GlbError::Broken(what(&format!("{part} names accessor {accessor}, which is not there"))))
        };
        let &position = p
            .attributes
            .get("POSITION")
            .ok_or_else(|| GlbError::Unsupported(what("it has no positions (compressed, or none at all)")))?;
        let position = of(position, "POSITION")?;
        let positions = &layouts[position];
        if positions.components != 3 {
            return Err(GlbError::Broken(what("positions are not of three components")));
        }
        let mut accessors = Vec::new();
        for (name, &accessor) in &p.attributes {
            let at = of(accessor, name)?;
            if layouts[at].count != positions.count {
                return Err(GlbError::Broken(what(&format!("{name} has another count than POSITION"))));
            }
            accessors.push(at as u32);
        }
        let indices = p.indices.map(|a| of(a, "indices")).transpose()?;
        let corners = indices.map_or(positions.count, |l| layouts[l].count);
        let mode = p.mode.unwrap_or(4);
        if p.material.is_some_and(|m| m >= root.materials.len() as u64) {
            return Err(GlbError::Broken(what("its material is not there")));
        }
        Ok(PrimitiveInfo {
            material: p.material.map(|m| m as usize),
            vertices: positions.count,
            triangles: match mode {
                4 => corners / 3,
                5 | 6 => corners.saturating_sub(2),
                _ => 0,
            },
            attributes: p.attributes.keys().cloned().collect(),
            bounds: accessor::bounds(&root.accessors[position], positions),
            mode,
            accessors,
            indices: indices.map(|l| l as u32),
            draco: p.extensions.draco.is_some(),
        })
    };
    let primitives = mesh.primitives.iter().enumerate().map(primitive).collect::<Result<_, _>>()?;
    Ok(MeshInfo { name: mesh.name.clone(), primitives })
}

fn image(image: &json::Image, root: &json::Root) -> Result<ImageInfo, GlbError> {
    let mut info = ImageInfo {
        name: image.name.clone(),
        uri: String::new(),
        embedded_bytes: 0,
        mime_type: image.mime_type.clone(),
    };
    if let Some(view) = image.buffer_view {
        let view = usize::try_from(view).ok().and_then(|v| root.buffer_views.get(v));
        let view = view
            .ok_or_else(|| GlbError::Broken(format!("image {:?} names a buffer view that is not there", image.name)))?;
        info.embedded_bytes = view.byte_length;
    } else if let Some(uri) = &image.uri {
        match uri.split_once(',') {
            Some((head, data)) if uri.starts_with("data:") => {
                info.uri = format!("{head},");
                info.embedded_bytes = data.len() as u64;
            }
            _ => info.uri.clone_from(uri),
        }
    }
    Ok(info)
}

fn material(material: json::Material) -> MaterialInfo {
    MaterialInfo {
        name: material.name,
        alpha_mode: if material.alpha_mode.is_empty() { "OPAQUE".to_owned() } else { material.alpha_mode },
        alpha_cutoff: material.alpha_cutoff.unwrap_or(0.5),
        double_sided: material.double_sided,
    }
}
