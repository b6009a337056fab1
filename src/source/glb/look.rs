//! What a glTF file's materials wear: colours, pictures, and how pictures lie on a surface.

use super::buffers::{self, Buffers};
use super::{GlbError, json};

/// Materials and pictures.
#[derive(Clone, Debug, Default)]
pub(crate) struct Look {
    /// One for each material.
    pub(crate) materials: Vec<Wear>,
    /// One for each image of the file.
    pub(crate) images: Vec<Picture>,
    /// Names of extensions that the file can't do without and that aren't read.
    pub(crate) unread: Vec<String>,
}

/// What a material wears.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wear {
    /// Linear.
    pub(crate) color: [f32; 4],
    /// Index of the image.
    pub(crate) color_image: Option<usize>,
    /// Index of the image.
    pub(crate) normal_image: Option<usize>,
    /// Index of the image whose green is the roughness.
    pub(crate) roughness_image: Option<usize>,
    /// What is let through: a factor above 0, the index of an image, and which of its channels.
    pub(crate) transmission: Option<(f32, Option<usize>, usize)>,
    /// How the colour picture lies, and the others.
    pub(crate) placing: Placing,
    /// Whether others that lie otherwise were left out.
    pub(crate) is_less: bool,
}

/// Which texture coordinates count, and what is done to them (KHR_texture_transform).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Placing {
    /// Number of the set.
    pub(crate) set: u32,
    /// Offset, rotation in radians, scale; none where they stay as they are.
    pub(crate) transform: Option<([f32; 2], f32, [f32; 2])>,
}

/// A picture.
#[derive(Clone, Debug)]
pub(crate) enum Picture {
    /// Buffer, first byte and length.
    View(usize, usize, usize),
    /// Decoded from the text.
    Inline(Vec<u8>),
    /// In a file of this name.
    File(String),
    /// Nowhere.
    None,
}

/// Extensions that are read, or that change nothing that is.
const READ: [&str; 11] = [
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_texture_webp",
    "KHR_materials_pbrSpecularGlossiness",
    "MSFT_lod",
    "KHR_lights_punctual",
    "KHR_xmp_json_ld",
    "KHR_node_visibility",
];

impl Look {
    pub(super) fn of(root: &json::Root, buffers: &Buffers<'_>) -> Result<Self, GlbError> {
        let image = |used: &json::TextureUse| {
            let texture = usize::try_from(used.index).ok().and_then(|t| root.textures.get(t));
            let texture =
                texture.ok_or_else(|| GlbError::Broken(format!("texture {} is named but not there", used.index)))?;
            let source = texture.extensions.webp.as_ref().map(|w| w.source).or(texture.source);
            match source.map(|s| usize::try_from(s).ok().filter(|&s| s < root.images.len())) {
                Some(None) => Err(GlbError::Broken(format!("texture {} names no image that is there", used.index))),
                found => Ok(found.flatten()),
            }
        };
        let wear = |material: &json::Material| {
            let pbr = material.pbr_metallic_roughness.as_deref();
            let gloss = material.extensions.glossiness.as_deref();
            let color = pbr.and_then(|p| p.base_color_texture.as_ref());
            let color = color.or_else(|| gloss.and_then(|g| g.diffuse_texture.as_ref()));
            let factor = pbr.and_then(|p| p.base_color_factor).or_else(|| gloss.and_then(|g| g.diffuse_factor));
            let (diffuse, clear) = (&material.extensions.diffuse_transmission, &material.extensions.transmission);
            let through = [(diffuse, 3), (clear, 0)].into_iter().find_map(|(stated, channel)| {
                let stated = stated.as_deref().filter(|stated| stated.factor > 0.0)?;
                Some((stated.factor.min(1.0), stated.texture.as_ref(), channel))
            });
            let through = through
                .map(|(factor, texture, channel)| Ok((factor, texture.map(image).transpose()?.flatten(), channel)));
            let normal = material.normal_texture.as_deref();
            let rough = pbr.and_then(|p| p.metallic_roughness_texture.as_ref());
            // One set of coordinates is kept: what lies otherwise would be strewn over the wrong places.
            let own = color.or(normal).or(rough).map(placing).unwrap_or_default();
            let alike = |used: &&json::TextureUse| placing(used) == own;
            Ok(Wear {
                is_less: [normal, rough].into_iter().flatten().any(|used| !alike(&used)),
                transmission: through.transpose()?,
                color: factor.unwrap_or([1.0; 4]),
                color_image: color.map(image).transpose()?.flatten(),
                normal_image: normal.filter(alike).map(image).transpose()?.flatten(),
                roughness_image: rough.filter(alike).map(image).transpose()?.flatten(),
                placing: own,
            })
        };
        let required = root.extensions_required.iter();
        let unread = required.filter(|e| !READ.contains(&e.as_str()) && !e.starts_with("KHR_materials_"));
        Ok(Self {
            materials: root.materials.iter().map(wear).collect::<Result<_, _>>()?,
            images: root.images.iter().map(|i| picture(i, root, buffers)).collect(),
            unread: unread.cloned().collect(),
        })
    }
}

fn placing(used: &json::TextureUse) -> Placing {
    let transform = used.extensions.transform.as_ref();
    Placing {
        set: transform.and_then(|t| t.tex_coord).unwrap_or(used.tex_coord),
        transform: transform.map(|t| (t.offset, t.rotation, t.scale.unwrap_or([1.0; 2]))),
    }
}

/// A picture's place. One that is broken is none: a tree has a shape without it.
fn picture(image: &json::Image, root: &json::Root, buffers: &Buffers<'_>) -> Picture {
    let view = image.buffer_view.and_then(|v| root.buffer_views.get(usize::try_from(v).ok()?));
    if let Some(view) = view {
        // Views were checked to lie in their buffers as stated, and those to be as long as stated where they are there.
        let (buffer, start, length) = (view.buffer as usize, view.byte_offset as usize, view.byte_length as usize);
        let there = buffers.get(buffer).is_some_and(Result::is_ok);
        return if there { Picture::View(buffer, start, length) } else { Picture::None };
    }
    match &image.uri {
        Some(uri) if uri.starts_with("data:") => {
            buffers::inline(uri).and_then(buffers::base64).map_or(Picture::None, Picture::Inline)
        }
        Some(uri) => buffers::file_name(uri).map_or(Picture::None, Picture::File),
        None => Picture::None,
    }
}
