//! Textures by name and, beside PNG, as WebP.
//!
//! WebP is lossless, by the `image` crate, on one thread a map: the texels are the PNG's, alpha under clear ones included.

use super::ExportError;
use super::png::{self, PngKind};
use crate::preset::plan::{Backs, TextureFormat};

/// How file names of a format end.
const fn extension(textures: TextureFormat) -> &'static str {
    match textures {
        TextureFormat::Png => "png",
        TextureFormat::Webp => "webp",
        TextureFormat::Ktx2 => "ktx2",
    }
}

/// File names of a material's maps, relative to the GLB, `/` between folders; not yet percent-encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaterialTextures {
    /// Base colour; with alpha for leaves.
    pub color: String,
    /// Tangent-space normal.
    pub normal: String,
    /// Occlusion, roughness, metalness; of leaves what they let through in place of metalness.
    pub orm: String,
}

/// The two materials that all variants of a set share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SetMaterials {
    /// The set's name; materials are named `SET_bark` and `SET_leaf`.
    pub set: String,
    /// What all textures are.
    pub textures: TextureFormat,
    /// Tiling bark.
    pub bark: MaterialTextures,
    /// The atlas.
    pub leaf: MaterialTextures,
    /// What leaves let through, of 255: the mean of the leaf pictures. 0 says nothing about it.
    pub transmission: u8,
    /// Whether the leaves' one is double-sided.
    pub backs: Backs,
}

impl SetMaterials {
    /// The materials of a set with the standard file names, `SET_bark_color.png` to `SET_leaf_orm.png`, or with the
    /// format's extension in place of `png`.
    #[must_use]
    pub fn of(set: &str, textures: TextureFormat) -> Self {
        let suffix = extension(textures);
        let maps = |part: &str| MaterialTextures {
            color: format!("{set}_{part}_color.{suffix}"),
            normal: format!("{set}_{part}_normal.{suffix}"),
            orm: format!("{set}_{part}_orm.{suffix}"),
        };
        Self {
            set: set.to_owned(),
            textures,
            bark: maps("bark"),
            leaf: maps("leaf"),
            transmission: 0,
            backs: Backs::DoubleSided,
        }
    }

    /// The same, of leaves that let so much through.
    #[must_use]
    pub fn letting_through(self, transmission: u8) -> Self {
        Self { transmission, ..self }
    }

    /// The same, of leaves whose backs are drawn so.
    #[must_use]
    pub fn drawn_by(self, backs: Backs) -> Self {
        Self { backs, ..self }
    }
}

/// Encodes bytes of so many by so many pixels of a kind as lossless WebP.
///
/// # Errors
///
/// When the number of bytes isn't width × height × channels, or a side is 0 or above 16,384.
pub fn webp(pixels: &[u8], width: u32, height: u32, kind: PngKind) -> Result<Vec<u8>, ExportError> {
    png::check(pixels, (width, height), kind)?;
    let mut out = Vec::new();
    image::codecs::webp::WebPEncoder::new_lossless(&mut out)
        .encode(pixels, width, height, kind.color())
        .map_err(|error| ExportError::Picture { width, height, what: error.to_string() })?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn webp_gives_every_texel_back() {
        for (kind, channels) in [(PngKind::Rgb, 3), (PngKind::Rgba, 4)] {
            // Colour under clear texels too.
            let pixels: Vec<u8> = (0..37 * 21 * channels).map(|i| (Seed::new(i / 9).bits() % 250) as u8).collect();
            let file = webp(&pixels, 37, 21, kind).unwrap();
            let image = image::load_from_memory_with_format(&file, image::ImageFormat::WebP).unwrap();
            assert_eq!((image.width(), image.height(), image.as_bytes()), (37, 21, &pixels[..]), "{kind:?}");
            assert!(webp(&pixels[1..], 37, 21, kind).is_err() && webp(&[], 0, 3, kind).is_err());
        }
        assert_eq!(
            [TextureFormat::Png, TextureFormat::Webp, TextureFormat::Ktx2].map(extension),
            ["png", "webp", "ktx2"]
        );
    }
}
