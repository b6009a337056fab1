//! Pictures: the CPU rasterizer, made bark and leaves, atlas packing.

mod atlas;
mod bark_art;
mod bark_height;
mod beside;
mod card_art;
mod card_cut;
mod contact_sheet;
mod contour;
mod contour_match;
mod coverage;
mod cutout;
mod dilate;
mod draft;
mod dye;
mod leaf_art;
mod leaf_morph;
mod leaf_outline;
mod leaf_turn;
mod leaf_veins;
mod letters;
mod mip_coverage;
mod mips;
mod noise;
mod noise_table;
mod picture;
mod picture_info;
mod quads;
mod raster;
mod recipe;
mod resample;
mod samples;
mod shade;
mod shader;
mod silhouette;
mod skyline;
mod spray;
mod srgb;
mod transmission;
mod user_art;

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

pub(crate) use atlas::{ALIGN, GUTTER};
pub use atlas::{Atlas, AtlasError, Layout, Picked, Rect, Relief, echoes, pack};
pub use bark_art::bark_maps;
pub(crate) use beside::mix_beside;
pub use card_art::{card_maps, own_bark_maps};
pub use card_cut::{card_cut, card_cuts};
pub use contact_sheet::{Sheet, SheetCell, SheetColors, SheetColumn, SheetLayout, SheetRow, SheetScale};
pub use cutout::Cutout;
pub use dilate::{dilate, dilate_color};
pub(crate) use dilate::{dilate_relief, filled};
pub use leaf_art::{LeafPicture, leaf_maps};
pub use leaf_morph::LeafMorph;
pub use leaf_turn::{has_green, turned_leaf};
pub(crate) use mip_coverage::Design;
pub use mip_coverage::{
    ALPHA_CUTOFF, CoverageReport, PictureKind, coverage, coverage_in, coverage_of_mips, preserve_alpha,
    preserve_coverage,
};
pub use mips::{AlphaUse, mips, mips_of, to_blocks};
pub use picture::{Picture, Repeat};
pub use picture_info::{PictureInfo, picture_info};
pub use raster::{Surface, Target, View, rasterize, survey};
pub use recipe::{Palette, Recipe};
pub use shade::{Light, Shading};
pub use silhouette::{Areas, Shape, Silhouette};
pub use spray::spray_span;
pub(crate) use srgb::{decode as srgb_linear, encode as srgb_byte};
pub use transmission::mean_transmission;
pub use user_art::{ArtError, ArtFile, ArtLimits, ArtUse, maps_from_images};

use crate::base::bulk;

/// A material's maps, all of one size, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Maps {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// sRGB colour and linear alpha.
    #[serde(with = "bulk")]
    pub color: Vec<[u8; 4]>,
    /// Tangent-space normal, +Y up (glTF), 128 is zero.
    #[serde(with = "bulk")]
    pub normal: Vec<[u8; 3]>,
    /// Occlusion, roughness, metalness (glTF's channel order). Leaves are no metal: their third channel is the share of the light
    /// they scatter that comes out on their far side, that of an impostor its depth.
    #[serde(with = "bulk")]
    pub orm: Vec<[u8; 3]>,
}

impl Maps {
    /// Square maps of `size` pixels an edge from colour, normal and occlusion-roughness-metalness by pixel.
    fn square(size: u32, pixels: &[([u8; 4], [u8; 3], [u8; 3])]) -> Self {
        Self {
            width: size,
            height: size,
            color: pixels.iter().map(|p| p.0).collect(),
            normal: pixels.iter().map(|p| p.1).collect(),
            orm: pixels.iter().map(|p| p.2).collect(),
        }
    }

    /// Columns and rows where no side is longer than `edge`, 1 or more, in the same proportions.
    pub(crate) fn size_within(&self, edge: u32) -> (u32, u32) {
        let longest = self.width.max(self.height).max(1);
        let side = |side: u32| (u64::from(side) * u64::from(edge) / u64::from(longest)).max(1) as u32;
        if longest <= edge { (self.width, self.height) } else { (side(self.width), side(self.height)) }
    }

    /// The same maps with no side longer than `edge`, shrunk where they are larger.
    pub(crate) fn within(&self, edge: u32) -> Cow<'_, Self> {
        let (width, height) = self.size_within(edge);
        self.resized(width, height)
    }

    /// The same maps with other sides, 1 or more each, whatever their proportions.
    pub(crate) fn resized(&self, width: u32, height: u32) -> Cow<'_, Self> {
        if (width, height) == (self.width, self.height) {
            return Cow::Borrowed(self);
        }
        Cow::Owned(resample::resample(self, width, height))
    }
}
