//! What the colours of a baked picture are mixed from, so that a new tint repaints cards instead of baking them again.
//!
//! A [`Palette`] holds each picture of leaves and bark, reduced to 32 × 32 texels of linear light. A [`Recipe`] names, for
//! each pixel of a baked picture, up to four of those texels and their shares, which hold the shade of the wood and leaves
//! there too. Shapes, normals and alpha don't hang on colours, so a recipe stays as long as they do.
//!
//! Limits: shares are bytes, 204 for a whole pixel; of a pixel that shows more than four texels the largest shares stand for all; 16,383
//! pictures (what lies beyond is white).

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::picture::Repeat;
use super::{Maps, srgb};
use crate::base::{Key, bulk};

/// Most texels that a pixel is mixed from.
const MOST: usize = 4;
/// The share of a byte that is all of a pixel: what is brightened by up to a quarter has room.
const WHOLE: f32 = 204.0;
/// The texel that is white.
const WHITE: u32 = 0xff_ffff;

/// Pictures as recipes know them.
#[derive(Clone, Debug, PartialEq)]
pub struct Palette {
    colors: Vec<Vec3>,
}

impl Palette {
    /// Texels along an edge.
    pub(super) const EDGE: u32 = 32;
    /// Texels of a picture.
    pub(super) const TEXELS: u32 = Self::EDGE * Self::EDGE;

    /// The pictures of bark and leaves in the order in which surfaces hold them.
    #[must_use]
    pub fn new<'a>(pictures: impl Iterator<Item = &'a Maps>) -> Self {
        let pictures: Vec<&Maps> = pictures.collect();
        let colors = pictures.par_iter().flat_map_iter(|maps| reduced(maps)).collect();
        Self { colors }
    }

    /// Of pictures of one colour each.
    #[must_use]
    pub fn plain(colors: impl Iterator<Item = [u8; 3]>) -> Self {
        let texels = |c: [u8; 3]| std::iter::repeat_n(Vec3::from(c.map(srgb::decode)), Self::TEXELS as usize);
        Self { colors: colors.flat_map(texels).collect() }
    }

    /// The key of its content.
    #[must_use]
    pub fn key(&self) -> Key {
        Key::of_bytes(bytemuck::cast_slice(&self.colors))
    }

    /// The columns of a picture that its `i`-th column of texels stands for, or rows.
    pub(super) fn span(i: usize, size: usize) -> std::ops::Range<usize> {
        let first = i * size / Self::EDGE as usize;
        first..((i + 1) * size / Self::EDGE as usize).max(first + 1)
    }

    /// The texel of the `picture`-th picture at a place of it.
    #[inline]
    pub(super) fn place(picture: u32, uv: Vec2, repeat: Repeat) -> u32 {
        let at = |t: f32| {
            let t = if repeat == Repeat::Tiled { t - t.floor() } else { t };
            ((t * Self::EDGE as f32) as u32).min(Self::EDGE - 1)
        };
        picture.saturating_mul(Self::TEXELS).saturating_add(at(uv.y) * Self::EDGE + at(uv.x))
    }
}

/// A picture's texels, averaged by alpha.
fn reduced(maps: &Maps) -> Vec<Vec3> {
    let (width, height) = (maps.width as usize, maps.height as usize);
    let edge = Palette::EDGE as usize;
    if width == 0 || height == 0 || maps.color.len() < width * height {
        return vec![Vec3::ONE; edge * edge];
    }
    let mut colors = Vec::with_capacity(edge * edge);
    for y in 0..edge {
        for x in 0..edge {
            let (mut sum, mut weight) = (Vec3::ZERO, 0.0_f32);
            for row in Palette::span(y, height) {
                for c in &maps.color[row * width..][Palette::span(x, width)] {
                    // The small share keeps a wholly clear place at its own colour.
                    let w = f32::from(c[3]) + 0.25;
                    sum += Vec3::new(srgb::decode(c[0]), srgb::decode(c[1]), srgb::decode(c[2])) * w;
                    weight += w;
                }
            }
            colors.push(sum / weight);
        }
    }
    colors
}

/// What each pixel of a picture is mixed from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recipe {
    /// Texels of the palette that each pixel takes, 0 where nothing is.
    #[serde(with = "bulk")]
    counts: Vec<u8>,
    /// Texel times 256, and share of [`WHOLE`].
    #[serde(with = "bulk")]
    parts: Vec<u32>,
}

impl Recipe {
    /// Adds a pixel of these texels (`u32::MAX` is white) and shares, which are sorted.
    pub(super) fn push(&mut self, mixed: &mut Vec<(u32, f32)>) {
        if mixed.len() > 1 {
            mixed.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            mixed.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
        }
        let all: f32 = mixed.iter().map(|m| m.1).sum();
        if mixed.len() > MOST {
            mixed.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            mixed.truncate(MOST);
        }
        let kept: f32 = mixed.iter().map(|m| m.1).sum();
        let scale = if kept > 0.0 { WHOLE * all / kept } else { 0.0 };
        self.counts.push(mixed.len() as u8);
        let part = |&(place, share): &(u32, f32)| place.min(WHITE) << 8 | (share * scale + 0.5).min(255.0) as u32;
        self.parts.extend(mixed.iter().map(part));
    }

    /// One after the other.
    pub(super) fn joined(all: Vec<Self>) -> Self {
        let mut all = all.into_iter();
        let mut whole = all.next().unwrap_or_default();
        for recipe in all {
            whole.counts.extend(recipe.counts);
            whole.parts.extend(recipe.parts);
        }
        whole
    }

    /// Recipes of pictures of one size, `width` pixels wide, laid out as one picture in rows of `columns`.
    #[must_use]
    pub fn sheet(frames: &[&Self], columns: usize, width: usize) -> Self {
        let (columns, width) = (columns.max(1), width.max(1));
        let total = |count: fn(&Self) -> usize| frames.iter().map(|frame| count(frame)).sum();
        let mut whole = Self {
            counts: Vec::with_capacity(total(|f| f.counts.len())),
            parts: Vec::with_capacity(total(|f| f.parts.len())),
        };
        for block in frames.chunks(columns) {
            let mut starts = vec![0_usize; block.len()];
            for line in 0..block[0].counts.len() / width {
                for (frame, start) in block.iter().zip(&mut starts) {
                    let counts = &frame.counts[line * width..(line + 1) * width];
                    let parts: usize = counts.iter().map(|c| usize::from(*c)).sum();
                    whole.counts.extend_from_slice(counts);
                    whole.parts.extend_from_slice(&frame.parts[*start..*start + parts]);
                    *start += parts;
                }
            }
        }
        whole
    }

    /// The colours that a palette gives, sRGB; black where nothing is.
    #[must_use]
    pub fn paint(&self, palette: &Palette) -> Vec<[u8; 3]> {
        let mut parts = self.parts.iter();
        let color = |&count: &u8| {
            let mut sum = Vec3::ZERO;
            for part in parts.by_ref().take(usize::from(count)) {
                let color = palette.colors.get((part >> 8) as usize).copied().unwrap_or(Vec3::ONE);
                sum += color * ((part & 255) as f32 * (1.0 / WHOLE));
            }
            [srgb::encode(sum.x), srgb::encode(sum.y), srgb::encode(sum.z)]
        };
        self.counts.iter().map(color).collect()
    }

    /// For each pixel the mean of what is told of the palette's texels, as they take part in it; 0 where nothing is, and for
    /// texels that nothing is told of.
    pub(crate) fn mean(&self, told: &[u8]) -> Vec<u8> {
        let mut parts = self.parts.iter();
        let mean = |&count: &u8| {
            let (mut sum, mut all) = (0, 0);
            for part in parts.by_ref().take(usize::from(count)) {
                sum += (part & 255) * told.get((part >> 8) as usize).map_or(0, |&told| u32::from(told));
                all += part & 255;
            }
            (sum + all / 2).checked_div(all).unwrap_or(0) as u8
        };
        self.counts.iter().map(mean).collect()
    }

    /// Makes what it paints so much brighter, up to 1.25 times, in linear light.
    pub(crate) fn brighten(&mut self, gain: f32) {
        let scaled = std::array::from_fn::<u32, 256, _>(|share| (share as f32 * gain + 0.5).clamp(0.0, 255.0) as u32);
        self.parts.iter_mut().for_each(|part| *part = *part & !255 | scaled[(*part & 255) as usize]);
    }

    /// For each pixel whether it is mixed from anything.
    pub(crate) fn shown(&self) -> impl Iterator<Item = bool> {
        self.counts.iter().map(|count| *count > 0)
    }

    /// For each pixel which share of it, in the shade there, is mixed from the first so many pictures; zero where nothing is.
    pub(crate) fn share_of_first(&self, pictures: u32) -> impl Iterator<Item = f32> {
        let end = pictures.saturating_mul(Palette::TEXELS);
        let mut parts = self.parts.iter();
        self.counts.iter().map(move |&count| {
            let (mut own, mut all) = (0, 0);
            for part in parts.by_ref().take(usize::from(count)) {
                all += part & 255;
                own += if part >> 8 < end { part & 255 } else { 0 };
            }
            if all > 0 { own as f32 / all as f32 } else { 0.0 }
        })
    }

    /// Whether it is one of a picture of so many pixels.
    #[must_use]
    pub fn is_of(&self, pixels: usize) -> bool {
        let parts: usize = self.counts.iter().map(|c| usize::from(*c)).sum();
        self.counts.len() == pixels && parts == self.parts.len()
    }

    /// About how many bytes it takes.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.counts.len() + self.parts.len() * 4
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{Picture, Shading, Surface, View, survey};
    use crate::base::Frame;
    use crate::mesh::Mesh;

    #[test]
    fn brightening_scales_what_is_painted_in_linear_light() {
        let mut recipe = Recipe::default();
        recipe.push(&mut vec![(0, 0.6), (1, 0.2)]);
        recipe.push(&mut vec![(WHITE, 1.0)]);
        recipe.push(&mut vec![(0, 1.0)]);
        let palette = Palette { colors: vec![Vec3::splat(0.5), Vec3::splat(0.3)] };
        let linear = |recipe: &Recipe| recipe.paint(&palette).iter().map(|c| srgb::decode(c[0])).collect::<Vec<_>>();
        let before = linear(&recipe);
        for gain in [0.8, 1.2] {
            let mut brighter = recipe.clone();
            brighter.brighten(gain);
            let after = linear(&brighter);
            assert!((after[0] / before[0] - gain).abs() < 0.02, "{gain}: {before:?} {after:?}");
            // Nothing is whiter than white, but what wears one texel alone has as much room as what is mixed.
            assert!((after[2] / before[2] - gain).abs() < 0.02, "{gain}: {before:?} {after:?}");
            assert!((after[1] - gain.min(1.0)).abs() < 0.01, "{gain}: {after:?}");
        }
    }

    #[test]
    fn the_share_of_the_first_pictures_is_theirs_of_what_is_shown() {
        let mut recipe = Recipe::default();
        for mixed in [vec![(5, 0.6), (Palette::TEXELS, 0.2)], vec![], vec![(2 * Palette::TEXELS, 0.5)], vec![(9, 0.1)]]
        {
            recipe.push(&mut mixed.clone());
        }
        let shares = |pictures: u32| recipe.share_of_first(pictures).collect::<Vec<f32>>();
        let off = |all: Vec<f32>, wanted: [f32; 4]| all.iter().zip(wanted).any(|(a, b)| (a - b).abs() > 0.01);
        assert!(!off(shares(0), [0.0; 4]) && !off(shares(1), [0.75, 0.0, 0.0, 1.0]), "{:?}", shares(1));
        assert!(!off(shares(2), [1.0, 0.0, 0.0, 1.0]));
    }

    #[test]
    fn means_are_by_share_and_texels_beyond_what_is_told_count_as_nothing() {
        let mut recipe = Recipe::default();
        for mixed in [vec![(0, 0.6), (1, 0.2)], vec![], vec![(1, 0.3), (WHITE, 0.3)], vec![(1, 0.05)]] {
            recipe.push(&mut mixed.clone());
        }
        let means = recipe.mean(&[0, 200]);
        assert!(means.iter().zip([50, 0, 100, 200]).all(|(mean, wanted)| mean.abs_diff(wanted) <= 1), "{means:?}");
    }

    fn plain(color: [u8; 3]) -> Maps {
        let [r, g, b] = color;
        Maps {
            width: 8,
            height: 8,
            color: vec![[r, g, b, 255]; 64],
            normal: vec![[128, 128, 255]; 64],
            orm: vec![[255; 3]; 64],
        }
    }

    /// Squares side by side, each wearing its own picture; the last one is shaded.
    fn squares(count: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..count {
            let first = mesh.positions.len() as u32;
            for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                mesh.positions.push(Vec3::new(i as f32 + x, y, 0.0));
                mesh.uvs.push(Vec2::new(x, 1.0 - y));
                mesh.occlusion.push(if i + 1 == count { 128 } else { 255 });
                mesh.tiles.push(i);
            }
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
        }
        mesh.normals = vec![Vec3::Z; mesh.positions.len()];
        mesh
    }

    #[test]
    fn what_is_painted_is_what_was_drawn_also_in_other_colours() {
        let maps = [[200, 40, 60], [20, 220, 30], [90, 90, 250]].map(plain);
        let pictures: Vec<Picture> = maps.iter().map(Picture::new).collect();
        let mesh = squares(3);
        let view = View::new(Frame::WORLD, Vec3::new(1.5, 0.5, 0.0), 1.5, 0.5);
        // Six columns of two pixels a square, but for five, which mix.
        let surface = Surface { mesh: &mesh, pictures: &pictures, repeat: Repeat::Cutout, closed: false };
        for columns in [6, 5] {
            let (target, recipe) = survey(&[surface], &view, columns, 2, 4, &Shading::Albedo);
            assert!(recipe.is_of(2 * columns as usize) && !recipe.is_of(7));
            let painted = recipe.paint(&Palette::new(maps.iter()));
            for (painted, drawn) in painted.iter().zip(&target.color) {
                let drawn = drawn.to_array().map(srgb::encode);
                assert!(painted.iter().zip(drawn).all(|(a, b)| a.abs_diff(b) <= 2), "{painted:?} {drawn:?}");
            }
            let red = recipe.paint(&Palette::new([[255, 0, 0]; 3].map(plain).iter()));
            assert!(red.iter().all(|c| c[0] >= 180 && c[1] == 0 && c[2] == 0), "{red:?}");
        }
    }

    #[test]
    fn many_parts_become_four_that_weigh_as_much_and_frames_lie_side_by_side() {
        let mut recipe = Recipe::default();
        let mut mixed: Vec<(u32, f32)> = (0..9).map(|i| (i, 1.0 / 9.0)).collect();
        recipe.push(&mut mixed);
        recipe.push(&mut Vec::new());
        let sum: u32 = recipe.parts.iter().map(|p| p & 255).sum();
        assert_eq!((recipe.counts.as_slice(), recipe.parts.len()), (&[4, 0][..], 4));
        assert!(sum.abs_diff(WHOLE as u32) <= 2, "{sum}");
        let mut other = Recipe::default();
        other.push(&mut vec![(u32::MAX, 1.0)]);
        other.push(&mut vec![(7, 0.5), (7, 0.5)]);
        let sheet = Recipe::sheet(&[&recipe, &other], 2, 1);
        assert_eq!(sheet.counts, [4, 1, 0, 1]);
        assert_eq!(sheet.parts[4..], [0xff_ffff << 8 | WHOLE as u32, 7 << 8 | WHOLE as u32]);
    }
}
