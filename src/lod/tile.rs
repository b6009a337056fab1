//! A baked picture before it has colours: its alpha, its relief, and what its colours are mixed from.

use serde::{Deserialize, Serialize};

use crate::bake::{Maps, Palette, Recipe, dilate, dilate_color};
use crate::base::bulk;

/// A picture that cards or impostors wear; rows from the top.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tile {
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// 128 and more is solid.
    #[serde(with = "bulk")]
    pub alpha: Vec<u8>,
    /// As in [`Maps`]; goes on under clear texels.
    #[serde(with = "bulk")]
    pub normal: Vec<[u8; 3]>,
    /// As in [`Maps`]; goes on under clear texels.
    #[serde(with = "bulk")]
    pub orm: Vec<[u8; 3]>,
    /// Where colours come from: the palette of the bark, then the leaf pictures by slot.
    pub recipe: Recipe,
}

impl Tile {
    /// A tile whose normals and material are spread under its clear texels.
    pub(super) fn new(
        (width, height): (u32, u32),
        alpha: Vec<u8>,
        normal: Vec<[u8; 3]>,
        orm: Vec<[u8; 3]>,
        recipe: Recipe,
    ) -> Self {
        let mut maps = Maps { width, height, color: alpha.iter().map(|&a| [0, 0, 0, a]).collect(), normal, orm };
        dilate(&mut maps);
        Self { width, height, alpha, normal: maps.normal, orm: maps.orm, recipe }
    }

    /// Its colours, also under its clear texels, and its alpha.
    #[must_use]
    pub fn color(&self, palette: &Palette) -> Vec<[u8; 4]> {
        let painted = self.recipe.paint(palette);
        let mut color: Vec<[u8; 4]> =
            painted.into_iter().zip(&self.alpha).map(|([r, g, b], &a)| [r, g, b, a]).collect();
        dilate_color(&mut color, self.width, self.height);
        color
    }

    /// Its maps in the colours of a palette.
    #[must_use]
    pub fn maps(&self, palette: &Palette) -> Maps {
        self.with_colors(self.color(palette))
    }

    /// Its maps before they have colours.
    #[must_use]
    pub fn uncolored(&self) -> Maps {
        self.with_colors(self.alpha.iter().map(|&a| [0, 0, 0, a]).collect())
    }

    /// Its maps with these colours, one a texel.
    #[must_use]
    pub fn with_colors(&self, color: Vec<[u8; 4]>) -> Maps {
        let (normal, orm) = (self.normal.clone(), self.orm.clone());
        Maps { width: self.width, height: self.height, color, normal, orm }
    }

    /// Whether every array has an entry for each texel.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        let texels = self.width as usize * self.height as usize;
        let lengths = [self.alpha.len(), self.normal.len(), self.orm.len()];
        texels > 0 && lengths == [texels; 3] && self.recipe.is_of(texels)
    }

    /// About how many bytes it takes.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.alpha.len() * 7 + self.recipe.weight()
    }
}
