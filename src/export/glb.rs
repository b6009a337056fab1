//! One variant as a binary glTF 2.0 file.
//!
//! The scene holds one root node that carries LOD0; lower levels are further nodes outside the scene, named by `MSFT_lod`
//! on the root with `MSFT_screencoverage` in its extras, so a loader that doesn't know the extension shows LOD0 and
//! nothing else. All levels share the origin. Textures are files beside the GLB, shared by the set. WebP and KTX2 are named by
//! their extensions, which are required then: a PNG to fall back on would have to lie beside each.
//!
//! What leaves let through stands in the blue of their ORM map, which metalness leaves free (the leaf material's metallic
//! factor is zero; bark's map is black there). `KHR_materials_diffuse_transmission` wants a texture's alpha, so it is told the mean, and the base colour for the colour;
//! it is never required.
//!
//! Limits: what is structurally wrong (array lengths, indices, a position that isn't finite) is an error; what rounding
//! may leave behind upstream is mended here, because a single such vertex would fail the Khronos validator: triangles
//! with two equal corners are dropped, normals and tangents are brought to unit length (a zero normal points up), and a
//! tangent's sign is 1 or -1. Every accessor has a buffer view of its own, so that a reader can take positions alone.
//!
//! Source: glTF 2.0 specification, 3.6 and 4.4; MSFT_lod vendor extension.

use std::borrow::Cow;

use glam::Vec3;
use gltf_json as json;
use json::Index;
use json::validation::Checked::Valid;
use json::validation::USize64;

use super::ImpostorEntry;
use super::extras::{AssetExtras, Coverage, raw};
use super::packed::Cube;
use super::textures::SetMaterials;
use crate::mesh::{Mesh, TreeMesh, Wind};
use crate::preset::plan::{Backs, TextureFormat};

/// One level of detail.
#[derive(Clone, Copy, Debug)]
pub struct AssetLevel<'a> {
    /// Its two primitives; one may be empty, not both.
    pub mesh: &'a TreeMesh,
    /// The level is shown down to this share of the screen's height, 0..=1, less from level to level. Of the last level
    /// it is the cull point.
    pub screen_coverage: f32,
    /// The layout of an impostor's sheet, told in the mesh's extras.
    pub impostor: Option<&'a ImpostorEntry>,
    /// Wind of bark and leaves; none where it was not asked for.
    pub wind: Option<&'a [Wind; 2]>,
}

/// A variant to be written.
#[derive(Clone, Copy, Debug)]
pub struct AssetIn<'a> {
    /// Name of the variant and of its root node, as `oak_avenue_007`.
    pub name: &'a str,
    /// The preset's seed, told in the file's extras.
    pub seed: u64,
    /// How far stems go on below the ground, metres: told there, too, so that the file is read back as the tree that it was.
    pub below: f32,
    /// The levels, finest first.
    pub levels: &'a [AssetLevel<'a>],
    /// The set's materials.
    pub materials: &'a SetMaterials,
}

/// Why an asset can't be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// There is no level.
    #[error("{name}: has no level of detail")]
    NoLevels {
        /// The asset.
        name: String,
    },
    /// A level has no triangle.
    #[error("{name}: level {level} has no triangle")]
    EmptyLevel {
        /// The asset.
        name: String,
        /// From 0.
        level: usize,
    },
    /// Screen coverages aren't shares that fall from level to level.
    #[error(
        "{name}: screen coverage {value} of level {level} is no share of the screen below that of the level before"
    )]
    Coverage {
        /// The asset.
        name: String,
        /// From 0.
        level: usize,
        /// The value.
        value: f32,
    },
    /// A mesh isn't one: lengths, indices or positions.
    #[error("{name}: {what}")]
    Mesh {
        /// The level's mesh and primitive.
        name: String,
        /// What is wrong with it.
        what: String,
    },
    /// Larger than the 4 GiB that a GLB can state.
    #[error("{name}: larger than 4 GiB")]
    TooLarge {
        /// The asset.
        name: String,
    },
    /// A picture whose arrays aren't of the stated size.
    #[error("picture of {width} x {height} pixels: {what}")]
    Picture {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// What is wrong with it.
        what: String,
    },
}

/// Name of a level's mesh and, below the first, of its node: `NAME_LOD2`.
#[must_use]
pub fn level_name(name: &str, level: usize) -> String {
    format!("{name}_LOD{level}")
}

/// Writes a variant as GLB; the same input gives the same bytes.
///
/// # Errors
///
/// See [`ExportError`]; the first thing that is wrong, in level order.
pub fn glb(asset: &AssetIn<'_>) -> Result<Vec<u8>, ExportError> {
    write(asset, None)
}

/// As [`glb()`], quantized and packed.
pub(super) fn web(asset: &AssetIn<'_>) -> Result<Vec<u8>, ExportError> {
    let levels = asset.levels.iter().flat_map(|l| [&l.mesh.bark, &l.mesh.leaf]);
    write(asset, Some(Cube::around(levels.flat_map(|mesh| &mesh.positions).filter(|p| p.is_finite()))))
}

fn write(asset: &AssetIn<'_>, cube: Option<Cube>) -> Result<Vec<u8>, ExportError> {
    check_levels(asset)?;
    let mut writer = Writer { cube, ..Writer::new(asset.materials) };
    if cube.is_none() {
        let meshes = asset.levels.iter().flat_map(|level| [&level.mesh.bark, &level.mesh.leaf]);
        let bytes = meshes.map(|mesh| mesh.positions.len() * 52 + mesh.indices.len() * 4).sum::<usize>();
        writer.bin.reserve_exact(bytes + asset.levels.len() * 8192);
    }
    for (i, level) in asset.levels.iter().enumerate() {
        writer.level(&level_name(asset.name, i), i, level)?;
    }
    writer.finish(asset)
}

pub(super) fn check_levels(asset: &AssetIn<'_>) -> Result<(), ExportError> {
    let name = || asset.name.to_owned();
    if asset.levels.is_empty() {
        return Err(ExportError::NoLevels { name: name() });
    }
    let mut above = f32::INFINITY;
    for (level, l) in asset.levels.iter().enumerate() {
        let value = l.screen_coverage;
        if !(value < above && (0.0..=1.0).contains(&value)) {
            return Err(ExportError::Coverage { name: name(), level, value });
        }
        above = value;
        if l.mesh.bark.indices.is_empty() && l.mesh.leaf.indices.is_empty() {
            return Err(ExportError::EmptyLevel { name: name(), level });
        }
    }
    Ok(())
}

/// Which of the two materials.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Bark,
    Leaf,
}

/// A file under construction: the JSON tree and the binary chunk.
pub(super) struct Writer<'a> {
    pub(super) root: json::Root,
    bin: Vec<u8>,
    materials: &'a SetMaterials,
    /// Made on first use, so that no file names a material that it doesn't use.
    bark: Option<Index<json::Material>>,
    leaf: Option<Index<json::Material>>,
    /// The cube that positions are quantized in; none where they stay as they are.
    cube: Option<Cube>,
    /// Whether wind goes into an attribute of an own name: see [`wind`](Self::wind).
    pub(super) custom: bool,
    /// Bytes of the fallback buffer that packed views name.
    pub(super) unpacked: usize,
}

impl<'a> Writer<'a> {
    pub(super) fn new(materials: &'a SetMaterials) -> Self {
        Self {
            root: json::Root::default(),
            bin: Vec::new(),
            materials,
            bark: None,
            leaf: None,
            cube: None,
            custom: false,
            unpacked: 0,
        }
    }

    /// Adds a level's mesh.
    pub(super) fn level(&mut self, name: &str, level: usize, of: &AssetLevel<'_>) -> Result<(), ExportError> {
        let mut primitives = Vec::with_capacity(2);
        for (part, suffix, mesh) in [(Part::Bark, "bark", &of.mesh.bark), (Part::Leaf, "leaf", &of.mesh.leaf)] {
            let wrong = |what| ExportError::Mesh { name: format!("{name} {suffix}"), what };
            let triangles = proper_triangles(mesh).map_err(wrong)?;
            if !triangles.is_empty() {
                let wind = of.wind.map(|wind| &wind[usize::from(part == Part::Leaf)]);
                let wind = wind.filter(|wind| wind.fits(mesh));
                primitives.push(match (self.cube, wind) {
                    (Some(cube), wind) => {
                        self.packed_primitive(part, mesh, triangles.into_owned(), cube, wind).map_err(wrong)?
                    }
                    (None, wind) => {
                        let mut primitive = self.primitive(part, mesh, &triangles);
                        wind.into_iter().for_each(|wind| self.wind(&mut primitive, wind, mesh));
                        primitive
                    }
                });
            }
        }
        if primitives.is_empty() {
            return Err(ExportError::EmptyLevel { name: name.to_owned(), level });
        }
        self.root.meshes.push(json::Mesh {
            extensions: None,
            extras: of.impostor.and_then(|impostor| raw(&serde_json::json!({ "impostor": impostor }))),
            name: Some(name.to_owned()),
            primitives,
            weights: None,
        });
        Ok(())
    }

    pub(super) fn primitive(&mut self, part: Part, mesh: &Mesh, triangles: &[u32]) -> json::mesh::Primitive {
        use json::accessor::{ComponentType, Type};
        use json::mesh::Semantic;

        let count = mesh.positions.len();
        let mut attributes = std::collections::BTreeMap::new();

        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &p in &mesh.positions {
            (low, high) = (low.min(p), high.max(p));
        }
        let view = self.array_view(mesh.positions.iter().map(|p| p.to_array().map(f32::to_le_bytes)));
        let positions = self.accessor(view, count, ComponentType::F32, Type::Vec3);
        let accessor = &mut self.root.accessors[positions.value()];
        accessor.min = Some(serde_json::json!(low.to_array()));
        accessor.max = Some(serde_json::json!(high.to_array()));
        attributes.insert(Valid(Semantic::Positions), positions);

        let normals = mesh.normals.iter().map(|&n| unit(n, Vec3::Y));
        let view = self.array_view(normals.map(|n| n.to_array().map(f32::to_le_bytes)));
        attributes.insert(Valid(Semantic::Normals), self.accessor(view, count, ComponentType::F32, Type::Vec3));

        let tangents = mesh.tangents.iter().map(|&[x, y, z, w]| {
            let t = unit(Vec3::new(x, y, z), Vec3::X);
            [t.x, t.y, t.z, if w < 0.0 { -1.0 } else { 1.0 }].map(f32::to_le_bytes)
        });
        let view = self.array_view(tangents);
        attributes.insert(Valid(Semantic::Tangents), self.accessor(view, count, ComponentType::F32, Type::Vec4));

        let view = self.array_view(mesh.uvs.iter().map(|uv| uv.to_array().map(f32::to_le_bytes)));
        attributes.insert(Valid(Semantic::TexCoords(0)), self.accessor(view, count, ComponentType::F32, Type::Vec2));

        if !mesh.lightmap.is_empty() {
            let view = self.array_view(mesh.lightmap.iter().map(|uv| uv.to_array().map(f32::to_le_bytes)));
            let accessor = self.accessor(view, count, ComponentType::F32, Type::Vec2);
            attributes.insert(Valid(Semantic::TexCoords(1)), accessor);
        }

        let view = self.array_view(mesh.occlusion.iter().map(|&o| [[o, o, o, 255]]));
        let color = self.accessor(view, count, ComponentType::U8, Type::Vec4);
        self.root.accessors[color.value()].normalized = true;
        attributes.insert(Valid(Semantic::Colors(0)), color);

        // 65,535 restarts a strip on some hardware, so the largest index in 16 bits is 65,534.
        let (view, kind) = if count <= usize::from(u16::MAX) {
            (self.index_view(triangles.iter().map(|&i| [(i as u16).to_le_bytes()])), ComponentType::U16)
        } else {
            (self.index_view(triangles.iter().map(|&i| [i.to_le_bytes()])), ComponentType::U32)
        };
        let indices = self.accessor(view, triangles.len(), kind, Type::Scalar);

        json::mesh::Primitive {
            attributes,
            extensions: None,
            extras: None,
            indices: Some(indices),
            material: Some(self.material(part)),
            mode: Valid(json::mesh::Mode::Triangles),
            targets: None,
        }
    }

    /// Of vertices: values of `N` numbers each.
    pub(super) fn array_view<const B: usize, const N: usize>(
        &mut self,
        values: impl Iterator<Item = [[u8; B]; N]>,
    ) -> Index<json::buffer::View> {
        self.view(values, Some(json::buffer::Target::ArrayBuffer))
    }

    fn index_view<const B: usize>(&mut self, values: impl Iterator<Item = [[u8; B]; 1]>) -> Index<json::buffer::View> {
        self.view(values, Some(json::buffer::Target::ElementArrayBuffer))
    }

    /// Of what is no vertex and no index, as the values of an animation.
    pub(super) fn plain_view<const B: usize>(
        &mut self,
        values: impl Iterator<Item = [[u8; B]; 1]>,
    ) -> Index<json::buffer::View> {
        self.view(values, None)
    }

    fn view<const B: usize, const N: usize>(
        &mut self,
        values: impl Iterator<Item = [[u8; B]; N]>,
        target: Option<json::buffer::Target>,
    ) -> Index<json::buffer::View> {
        let start = self.append(values);
        self.root.push(json::buffer::View {
            buffer: Index::new(0),
            byte_length: USize64::from(self.bin.len() - start),
            byte_offset: Some(USize64::from(start)),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        })
    }

    /// Appends values to the binary chunk, from a multiple of four on; gives back where they start.
    pub(super) fn append<const B: usize, const N: usize>(
        &mut self,
        values: impl Iterator<Item = [[u8; B]; N]>,
    ) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let start = self.bin.len();
        self.bin.reserve(values.size_hint().0 * B * N);
        // Several bytes at a time: most of what a file takes.
        values.for_each(|value| self.bin.extend_from_slice(value.as_flattened()));
        start
    }

    /// A mesh of positions and triangles only, without a material.
    pub(super) fn plain_mesh(&mut self, name: &str, points: &[Vec3], triangles: &[u32]) -> Index<json::Mesh> {
        use json::accessor::{ComponentType, Type};
        let (low, high) = points.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
        let view = self.array_view(points.iter().map(|p| p.to_array().map(f32::to_le_bytes)));
        let positions = self.accessor(view, points.len(), ComponentType::F32, Type::Vec3);
        let accessor = &mut self.root.accessors[positions.value()];
        accessor.min = Some(serde_json::json!(low.to_array()));
        accessor.max = Some(serde_json::json!(high.to_array()));
        let view = self.index_view(triangles.iter().map(|i| [i.to_le_bytes()]));
        let indices = self.accessor(view, triangles.len(), ComponentType::U32, Type::Scalar);
        self.root.push(json::Mesh {
            extensions: None,
            extras: None,
            name: Some(name.to_owned()),
            primitives: vec![json::mesh::Primitive {
                attributes: [(Valid(json::mesh::Semantic::Positions), positions)].into(),
                extensions: None,
                extras: None,
                indices: Some(indices),
                material: None,
                mode: Valid(json::mesh::Mode::Triangles),
                targets: None,
            }],
            weights: None,
        })
    }

    pub(super) fn accessor(
        &mut self,
        view: Index<json::buffer::View>,
        count: usize,
        component: json::accessor::ComponentType,
        shape: json::accessor::Type,
    ) -> Index<json::Accessor> {
        self.root.push(json::Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Valid(json::accessor::GenericComponentType(component)),
            extensions: None,
            extras: None,
            type_: Valid(shape),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        })
    }

    pub(super) fn material(&mut self, part: Part) -> Index<json::Material> {
        let made = if part == Part::Bark { self.bark } else { self.leaf };
        if let Some(index) = made {
            return index;
        }
        let materials = self.materials;
        let wrap = if part == Part::Bark {
            json::texture::WrappingMode::Repeat
        } else {
            json::texture::WrappingMode::ClampToEdge
        };
        let sampler = self.root.push(json::texture::Sampler {
            mag_filter: Some(Valid(json::texture::MagFilter::Linear)),
            min_filter: Some(Valid(json::texture::MinFilter::LinearMipmapLinear)),
            name: None,
            wrap_s: Valid(wrap),
            wrap_t: Valid(wrap),
            extensions: None,
            extras: None,
        });
        let (suffix, maps) = if part == Part::Bark { ("bark", &materials.bark) } else { ("leaf", &materials.leaf) };
        let color = self.texture(&maps.color, sampler);
        let normal = self.texture(&maps.normal, sampler);
        let orm = self.texture(&maps.orm, sampler);
        let info = |index| json::texture::Info { index, tex_coord: 0, extensions: None, extras: None };
        let mut material = json::Material {
            name: Some(format!("{}_{suffix}", materials.set)),
            pbr_metallic_roughness: json::material::PbrMetallicRoughness {
                base_color_texture: Some(info(color)),
                metallic_roughness_texture: Some(info(orm)),
                ..Default::default()
            },
            normal_texture: Some(json::material::NormalTexture {
                index: normal,
                scale: 1.0,
                tex_coord: 0,
                extensions: None,
                extras: None,
            }),
            occlusion_texture: Some(json::material::OcclusionTexture {
                index: orm,
                strength: json::material::StrengthFactor(1.0),
                tex_coord: 0,
                extensions: None,
                extras: None,
            }),
            ..Default::default()
        };
        if part == Part::Leaf {
            material.alpha_mode = Valid(json::material::AlphaMode::Mask);
            material.alpha_cutoff = Some(json::material::AlphaCutoff(crate::bake::ALPHA_CUTOFF));
            material.double_sided = materials.backs == Backs::DoubleSided;
            // The blue channel holds what is let through, and the depth of impostors.
            material.pbr_metallic_roughness.metallic_factor = json::material::StrengthFactor(0.0);
            material.extensions = self.diffuse_transmission(color);
        }
        let index = self.root.push(material);
        if part == Part::Bark {
            self.bark = Some(index);
        } else {
            self.leaf = Some(index);
        }
        index
    }

    /// What the leaf material says about light that comes through, of leaves that let some.
    fn diffuse_transmission(&mut self, color: Index<json::Texture>) -> Option<json::extensions::material::Material> {
        const NAME: &str = "KHR_materials_diffuse_transmission";
        if self.materials.transmission == 0 {
            return None;
        }
        self.root.extensions_used.push(NAME.to_owned());
        let mut extensions = json::extensions::material::Material::default();
        // Three decimals tell a byte.
        let factor = (f64::from(self.materials.transmission) / 0.255).round() / 1000.0;
        let color = serde_json::json!({ "index": color.value() });
        let told = serde_json::json!({ "diffuseTransmissionFactor": factor, "diffuseTransmissionColorTexture": color });
        extensions.others.insert(NAME.to_owned(), told);
        Some(extensions)
    }

    fn texture(&mut self, file: &str, sampler: Index<json::texture::Sampler>) -> Index<json::Texture> {
        let needed = match self.materials.textures {
            TextureFormat::Png => None,
            TextureFormat::Webp => Some("EXT_texture_webp"),
            TextureFormat::Ktx2 => Some("KHR_texture_basisu"),
        };
        let image = self.root.push(json::Image {
            buffer_view: None,
            mime_type: None,
            name: None,
            uri: Some(uri(file).into_owned()),
            extensions: None,
            extras: None,
        });
        let Some(needed) = needed else {
            let sampler = Some(sampler);
            return self.root.push(json::Texture {
                name: None,
                sampler,
                source: image,
                extensions: None,
                extras: None,
            });
        };
        if !self.root.extensions_used.iter().any(|used| used == needed) {
            self.root.extensions_used.push(needed.to_owned());
            self.root.extensions_required.push(needed.to_owned());
        }
        let mut extensions = json::extensions::texture::Texture::default();
        extensions.others.insert(needed.to_owned(), serde_json::json!({ "source": image.value() }));
        self.root.push(json::Texture {
            name: None,
            sampler: Some(sampler),
            // No other picture stands in for it: what can't read it says so, instead of showing a white tree.
            source: Index::new(u32::MAX),
            extensions: Some(extensions),
            extras: None,
        })
    }

    /// Adds nodes and packs both chunks.
    fn finish(mut self, asset: &AssetIn<'_>) -> Result<Vec<u8>, ExportError> {
        let count = asset.levels.len();
        for level in 0..count {
            let name = if level == 0 { asset.name.to_owned() } else { level_name(asset.name, level) };
            self.root.nodes.push(json::Node {
                mesh: Some(Index::new(level as u32)),
                name: Some(name),
                scale: self.cube.map(|cube| [cube.edge / 65535.0; 3]),
                translation: self.cube.map(|cube| cube.low.to_array()),
                ..Default::default()
            });
        }
        if count > 1 {
            let root = &mut self.root.nodes[0];
            let mut extensions = json::extensions::scene::Node::default();
            let ids: Vec<usize> = (1..count).collect();
            extensions.others.insert("MSFT_lod".to_owned(), serde_json::json!({ "ids": ids }));
            root.extensions = Some(extensions);
            let coverage: Vec<f32> = asset.levels.iter().map(|l| l.screen_coverage).collect();
            root.extras = raw(&Coverage { coverage });
            self.root.extensions_used.push("MSFT_lod".to_owned());
        }
        self.seal((asset.name, asset.seed, asset.below), vec![Index::new(0)])
    }

    /// Adds the scene with its root nodes and packs both chunks.
    pub(super) fn seal(
        mut self,
        (name, seed, below): (&str, u64, f32),
        nodes: Vec<Index<json::Node>>,
    ) -> Result<Vec<u8>, ExportError> {
        self.root.scenes.push(json::Scene { extensions: None, extras: None, name: Some(name.to_owned()), nodes });
        self.root.scene = Some(Index::new(0));
        self.root.asset = json::Asset {
            generator: Some(concat!("Treewright ", env!("CARGO_PKG_VERSION")).to_owned()),
            extras: raw(&AssetExtras {
                set: &self.materials.set,
                variant: name,
                seed,
                below: (below > 0.0).then_some(below),
            }),
            ..Default::default()
        };
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.root.buffers.push(json::Buffer {
            byte_length: USize64::from(self.bin.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        if self.unpacked > 0 {
            let mut extensions = json::extensions::buffer::Buffer::default();
            let fallback = serde_json::json!({ "fallback": true });
            extensions.others.insert("EXT_meshopt_compression".to_owned(), fallback);
            self.root.buffers.push(json::Buffer {
                byte_length: USize64::from(self.unpacked),
                name: None,
                uri: None,
                extensions: Some(extensions),
                extras: None,
            });
            for extension in ["KHR_mesh_quantization", "EXT_meshopt_compression"] {
                self.root.extensions_used.push(extension.to_owned());
                self.root.extensions_required.push(extension.to_owned());
            }
        }
        let too_large = || ExportError::TooLarge { name: name.to_owned() };
        let text = json::serialize::to_vec(&self.root).map_err(|_| too_large())?;
        container(text, self.bin).ok_or_else(too_large)
    }
}

/// The two chunks in a GLB container (glTF 2.0, 4.4); none above 4 GiB. `bin` has a length divisible by four.
fn container(mut text: Vec<u8>, mut bin: Vec<u8>) -> Option<Vec<u8>> {
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = u32::try_from(12 + 8 + text.len() + 8 + bin.len()).ok()?;
    let mut out = Vec::with_capacity(28 + text.len());
    out.extend_from_slice(b"glTF");
    out.extend_from_slice(&2_u32.to_le_bytes());
    out.extend_from_slice(&total.to_le_bytes());
    out.extend_from_slice(&(text.len() as u32).to_le_bytes());
    out.extend_from_slice(b"JSON");
    out.extend_from_slice(&text);
    out.extend_from_slice(&(bin.len() as u32).to_le_bytes());
    out.extend_from_slice(b"BIN\0");
    // Moved up in the memory that it has, if there is room; new memory costs more than the move.
    bin.splice(0..0, out);
    Some(bin)
}

/// A mesh's indices without triangles that have two equal corners, after all that a writer relies on was checked.
pub(super) fn proper_triangles(mesh: &Mesh) -> Result<Cow<'_, [u32]>, String> {
    if mesh.indices.is_empty() {
        return Ok(Cow::Borrowed(&[]));
    }
    let count = mesh.positions.len();
    for (what, length) in [
        ("normals", mesh.normals.len()),
        ("tangents", mesh.tangents.len()),
        ("texture coordinates", mesh.uvs.len()),
        ("occlusion values", mesh.occlusion.len()),
    ] {
        if length != count {
            return Err(format!("{count} positions but {length} {what}"));
        }
    }
    if !mesh.lightmap.is_empty() && mesh.lightmap.len() != count {
        return Err(format!("{count} positions but {} light map coordinates", mesh.lightmap.len()));
    }
    if !mesh.indices.len().is_multiple_of(3) {
        return Err(format!("{} indices are no triangles", mesh.indices.len()));
    }
    if let Some(index) = mesh.indices.iter().find(|&&i| i as usize >= count) {
        return Err(format!("index {index} of {count} vertices"));
    }
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("position {i} is not finite"));
    }
    if let Some(i) = mesh.uvs.iter().position(|uv| !uv.is_finite()) {
        return Err(format!("texture coordinate {i} is not finite"));
    }
    if let Some(i) = mesh.lightmap.iter().position(|uv| !uv.is_finite()) {
        return Err(format!("light map coordinate {i} is not finite"));
    }
    let triangles = mesh.indices.as_chunks::<3>().0;
    let is_proper = |t: &&[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    if triangles.iter().all(|t| is_proper(&t)) {
        return Ok(Cow::Borrowed(&mesh.indices));
    }
    Ok(Cow::Owned(triangles.iter().filter(is_proper).flatten().copied().collect()))
}

/// `v` at unit length; `otherwise` when it has no direction. Vectors that are units but for rounding stay as they are.
pub(super) fn unit(v: Vec3, otherwise: Vec3) -> Vec3 {
    if (v.length_squared() - 1.0).abs() < 1e-5 { v } else { v.try_normalize().unwrap_or(otherwise) }
}

/// A relative file name as a URI reference: all but RFC 3986's unreserved characters and `/` percent-encoded.
fn uri(file: &str) -> Cow<'_, str> {
    let plain = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'.' | b'_' | b'~' | b'/');
    if file.bytes().all(plain) {
        return Cow::Borrowed(file);
    }
    let mut out = String::with_capacity(file.len() * 3);
    for b in file.bytes() {
        if plain(b) {
            out.push(char::from(b));
        } else {
            out.push_str(&format!("%{b:02X}"));
        }
    }
    Cow::Owned(out)
}
