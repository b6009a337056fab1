//! A baked picture before it has colours: its alpha, its relief, and what its colours are mixed from.

use serde::{Deserialize, Serialize};

use crate::bake::{Maps, Palette, Recipe, dilate_color, dilate_relief, mix_beside};
use crate::base::bulk;

/// A picture that cards or impostors wear; rows from the top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tile {
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// 128 and more is solid. As an atlas keeps it: made so that its mips show as much.
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
    /// How much of each texel was drawn, of 255; the rest is of the colour of what is beside it.
    #[serde(with = "bulk")]
    pub drawn: Vec<u8>,
}

/// How much of a texel was drawn, 0..=1, as a tile holds it.
pub(super) fn share(covered: f32) -> u8 {
    (covered * 255.0 + 0.5) as u8
}

/// Alpha where anything was drawn, and none elsewhere: an impostor's frames are solid beside it, too.
fn shown<'a>(alpha: &'a [u8], recipe: &'a Recipe) -> impl Iterator<Item = u8> + 'a {
    alpha.iter().zip(recipe.shown()).map(|(alpha, is_shown)| if is_shown { *alpha } else { 0 })
}

impl Tile {
    /// A tile whose normals and material are spread under its clear texels, and under those that nothing was drawn on.
    pub(super) fn new(
        (width, height): (u32, u32),
        alpha: Vec<u8>,
        mut normal: Vec<[u8; 3]>,
        mut orm: Vec<[u8; 3]>,
        (recipe, drawn): (Recipe, Vec<u8>),
    ) -> Self {
        let shown: Vec<u8> = shown(&alpha, &recipe).collect();
        dilate_relief(&shown, &mut normal, &mut orm, (width, height));
        Self { width, height, alpha, normal, orm, recipe, drawn }
    }

    /// Its colours, also under its clear texels, and its alpha.
    #[must_use]
    pub fn color(&self, palette: &Palette) -> Vec<[u8; 4]> {
        let mut painted = self.recipe.paint(palette);
        mix_beside(&mut painted, &self.drawn, self.width as usize);
        let mut color: Vec<[u8; 4]> =
            painted.into_iter().zip(shown(&self.alpha, &self.recipe)).map(|([r, g, b], a)| [r, g, b, a]).collect();
        dilate_color(&mut color, self.width, self.height);
        color.iter_mut().zip(&self.alpha).for_each(|(color, alpha)| color[3] = *alpha);
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
        let lengths = [self.alpha.len(), self.normal.len(), self.orm.len(), self.drawn.len()];
        texels > 0 && lengths == [texels; 4] && self.recipe.is_of(texels)
    }

    /// About how many bytes it takes.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.alpha.len() * 8 + self.recipe.weight()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{Picture, Repeat, Shading, Surface, View, survey};
    use crate::base::Frame;
    use crate::mesh::Mesh;
    use glam::Vec3;

    #[test]
    fn what_is_solid_beside_what_was_drawn_has_its_colour_and_relief() {
        // The left half of the picture is drawn, all of it is solid.
        let corners = [(-1.0, -1.0), (0.0, -1.0), (0.0, 1.0), (-1.0, 1.0)];
        let mesh = Mesh {
            positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
            normals: vec![Vec3::Z; 4],
            uvs: vec![glam::Vec2::splat(0.5); 4],
            occlusion: vec![255; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        };
        let green = Maps {
            width: 1,
            height: 1,
            color: vec![[40, 160, 20, 255]],
            normal: vec![[128, 128, 255]],
            orm: vec![[255; 3]],
        };
        let pictures = [Picture::new(&green)];
        let surface = Surface { mesh: &mesh, pictures: &pictures, repeat: Repeat::Cutout, closed: false };
        let view = View::new(Frame::WORLD, Vec3::ZERO, 1.0, 1.0);
        let (target, recipe) = survey(&[surface], &view, 8, 8, 2, &Shading::Albedo);
        let covered = target.coverage.iter().map(|covered| share(*covered)).collect();
        let drawn = |i: usize| i % 8 < 4;
        let normal = (0..64).map(|i| if drawn(i) { [200, 128, 220] } else { [0; 3] }).collect();
        let orm = (0..64).map(|i| if drawn(i) { [90, 200, 7] } else { [0; 3] }).collect();
        let tile = Tile::new((8, 8), vec![255; 64], normal, orm, (recipe, covered));
        let maps = tile.maps(&Palette::new(std::iter::once(&green)));
        assert!(maps.color.iter().all(|c| c[3] == 255 && c[1].abs_diff(160) < 3 && c[0].abs_diff(40) < 3));
        assert!(maps.normal.iter().all(|n| n[0] > 190) && maps.orm.iter().all(|o| *o == [90, 200, 7]));
    }

    #[test]
    fn a_texel_that_a_twig_crosses_is_mostly_of_the_leaf_beside_it() {
        // A leaf over the left texel, a twig over a fifth of the right one.
        let square = |left: f32, right: f32| {
            [(left, -1.0), (right, -1.0), (right, 1.0), (left, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0))
        };
        let mesh = Mesh {
            positions: [square(-1.0, 0.0), square(0.4, 0.6)].concat(),
            normals: vec![Vec3::Z; 8],
            uvs: vec![glam::Vec2::splat(0.5); 8],
            occlusion: vec![255; 8],
            tiles: vec![0, 0, 0, 0, 1, 1, 1, 1],
            indices: vec![0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7],
            ..Mesh::default()
        };
        let plain = |color: [u8; 4]| Maps {
            width: 1,
            height: 1,
            color: vec![color],
            normal: vec![[128, 128, 255]],
            orm: vec![[255; 3]],
        };
        let maps = [plain([240, 180, 210, 255]), plain([30, 20, 10, 255])];
        let pictures = maps.each_ref().map(Picture::new);
        let surface = Surface { mesh: &mesh, pictures: &pictures, repeat: Repeat::Cutout, closed: false };
        let view = View::new(Frame::WORLD, Vec3::ZERO, 1.0, 1.0);
        let (target, recipe) = survey(&[surface], &view, 2, 1, 10, &Shading::Albedo);
        let covered: Vec<u8> = target.coverage.iter().map(|covered| share(*covered)).collect();
        assert!(covered[0] == 255 && covered[1].abs_diff(51) < 3, "{covered:?}");
        let of = |drawn: Vec<u8>| {
            let relief = (vec![[128, 128, 255]; 2], vec![[255; 3]; 2]);
            let tile = Tile::new((2, 1), vec![255; 2], relief.0, relief.1, (recipe.clone(), drawn));
            tile.color(&Palette::new(maps.iter()))
        };
        let color = of(covered);
        assert!(color[0][0].abs_diff(240) < 2 && (190..235).contains(&color[1][0]), "{color:?}");
        // What stands alone in its texel is as dark as it is.
        let alone = of(vec![255; 2]);
        assert!(alone[1][0] < 33, "{alone:?}");
    }
}
