//! How far a level of detail is from the full tree, as it is seen at a given size.
//!
//! Views stand on the upper part of a sphere, from level to [`STEEPEST`], evenly by area (a golden spiral). Both trees are
//! drawn with alpha test and supersampling; a pixel belongs to the silhouette when at least half of its samples do. The
//! intersection of the two silhouettes over their union is the IoU; the coverage ratio compares sums of coverage, which is
//! what popping of brightness follows ([`super::agree`]); colour is compared by the mean of the lit pixels, and FLIP compares
//! the pictures before a sky.

use std::borrow::Cow;
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::agree::Outlines;
use super::flip::flip;
use crate::bake::{Areas, Cutout, Light, Maps, Picture, Shading, Surface, Target, View, rasterize};
use crate::base::{Frame, math};
use crate::mesh::{Mesh, TreeMesh};

/// Sine of the elevation of the steepest view: 45 degrees. At the size at which the second level takes over, that is a
/// viewer a hundred metres above the ground.
const STEEPEST: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Samples along a tree's height, at least: where silhouettes are compared, and where colours alone are.
const LINES: u32 = 270;
const COLOR_LINES: u32 = 126;
/// The sky behind the trees when pictures are compared, linear light.
const SKY: Vec3 = Vec3::new(0.42, 0.55, 0.70);
/// As plain readers of glTF light a leaf: nothing comes through it.
const LIGHT: Light = Light { translucency: 0.0, ..Light::DAY };
/// Of linear light (ITU-R BT.709).
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);
/// By how much a level's pictures are brightened at least and at most.
const BRIGHTENED: (f32, f32) = (0.75, 1.25);

/// The pictures that the levels of one tree wear.
#[derive(Clone, Debug)]
pub struct Wardrobe {
    /// Leaf pictures by slot, then the tiles of the ladder.
    pub leaves: Vec<Picture>,
    /// Bark; shared, since no level changes it.
    pub bark: Arc<Vec<Picture>>,
}

impl Wardrobe {
    /// Makes the mips of leaf pictures and bark.
    #[must_use]
    pub fn new(leaf_art: &[Maps], bark: &Maps) -> Self {
        let (leaves, bark) = rayon::join(|| leaf_art.par_iter().map(Picture::new).collect(), || Picture::new(bark));
        Self { leaves, bark: Arc::new(vec![bark]) }
    }

    /// Of a set's files.
    #[must_use]
    pub fn of_atlas(atlas: &Maps, bark: &Maps) -> Self {
        Self { leaves: vec![Picture::of_atlas(atlas)], bark: Arc::new(vec![Picture::new(bark)]) }
    }

    /// What cuts leaves and cards out, by tile.
    pub(super) fn cutouts(&self) -> Vec<&Cutout> {
        self.leaves.iter().map(Picture::cutout).collect()
    }

    /// What a level shows.
    #[must_use]
    pub fn dressed<'a>(&'a self, tree: &'a TreeMesh) -> [Surface<'a>; 2] {
        Surface::of_tree(tree, &self.bark, &self.leaves)
    }
}

/// How far a level is from the full one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Height of the tree in the pictures that were compared, pixels.
    pub pixels: u32,
    /// How many views.
    pub views: u32,
    /// Silhouette intersection over union, mean of the views, 0..=1; of a level that is small where it takes over, mean of
    /// four rasters of pixels.
    pub iou: f32,
    /// The worst view's.
    pub worst_iou: f32,
    /// Covered area over the full level's, mean of the views.
    pub coverage: f32,
    /// Distance of the mean colours, sRGB with 1 for white, mean of the views.
    pub color: f32,
    /// FLIP of the pictures, frame and sky included, mean of the views; 0 where it was not asked for.
    pub flip: f32,
}

impl Measured {
    /// A tree against itself.
    #[must_use]
    pub const fn same(pixels: u32) -> Self {
        Self { pixels, views: 0, iou: 1.0, worst_iou: 1.0, coverage: 1.0, color: 0.0, flip: 0.0 }
    }
}

/// What is to be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Silhouettes and coverage; colour and FLIP stay zero.
    Silhouette,
    /// Everything.
    All,
}

/// What a view shows of a level, and what that wears.
pub type Seen<'a> = dyn Fn(&View) -> (Cow<'a, TreeMesh>, Cow<'a, Wardrobe>) + Sync + 'a;

/// The full tree, drawn from all views at one size.
#[derive(Clone, Debug)]
pub struct Reference {
    /// With what the full tree covers, where silhouettes are compared.
    outlines: Option<Arc<(Outlines, Vec<Areas>)>>,
    views: Vec<View>,
    targets: Vec<Target>,
    pixels: u32,
    samples: u32,
}

/// Views of a tree that is `pixels` high in them, and the width and height of their pictures, pixels.
pub(super) fn views(tree: &TreeMesh, pixels: u32, count: u32) -> (Vec<View>, (u32, u32)) {
    let (low, high) = bounds(tree);
    let centre = (low + high) * 0.5;
    let half = (high - low).max(Vec3::splat(1e-3)) * 0.5;
    let radius = (half.x * half.x + half.z * half.z).sqrt();
    // A tenth of room for what a level adds; the steepest view sees most of the crown's breadth.
    let per_metre = pixels.max(1) as f32 / (2.0 * half.y);
    let wide = radius * 1.1;
    let tall = (half.y + radius * STEEPEST).max(half.y) * 1.1;
    let size = |half: f32| (2.0 * half * per_metre).ceil().clamp(1.0, 2048.0) as u32;
    let (width, height) = (size(wide), size(tall));
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let count = count.max(1);
    let view = |i: u32| {
        let sin = STEEPEST * (i as f32 + 0.5) / count as f32;
        let cos = (1.0 - sin * sin).sqrt();
        let half = (0.5 * width as f32 / per_metre, 0.5 * height as f32 / per_metre);
        let mut view = View::level(golden * (i as f32 + 0.27), centre, half.0, half.1);
        let Frame { x, y, z } = view.frame;
        view.frame = Frame { x, y: y * cos - z * sin, z: z * cos + y * sin };
        view
    };
    ((0..count).map(view).collect(), (width, height))
}

impl Reference {
    /// Draws `tree` so that it is `pixels` high, from `views` directions.
    #[must_use]
    pub fn new(tree: &TreeMesh, wardrobe: &Wardrobe, pixels: u32, views: u32) -> Self {
        let (all, size) = self::views(tree, pixels, views);
        let made = Self::of(tree, wardrobe, (pixels, LINES), all, size);
        let outlines = Outlines::new(tree, &wardrobe.cutouts(), (pixels.max(1) * made.samples) as f32, views);
        let areas = outlines.areas();
        Self { outlines: Some(Arc::new((outlines, areas))), ..made }
    }

    /// As [`new`](Self::new), from some of so many directions, for their colours.
    pub(super) fn some(tree: &TreeMesh, wardrobe: &Wardrobe, pixels: u32, (count, which): (u32, &[usize])) -> Self {
        let (views, size) = self::views(tree, pixels, count);
        let some = which.iter().filter_map(|&i| views.get(i).copied()).collect();
        Self::of(tree, wardrobe, (pixels, COLOR_LINES), some, size)
    }

    fn of(
        tree: &TreeMesh,
        wardrobe: &Wardrobe,
        (pixels, lines): (u32, u32),
        views: Vec<View>,
        size: (u32, u32),
    ) -> Self {
        // As many samples along the tree at any size: what a pixel holds is a matter of the tree, not of mips.
        let samples = lines.div_ceil(pixels.max(1)).clamp(2, 16);
        let mut made = Self { outlines: None, views, targets: Vec::new(), pixels, samples };
        made.targets = made.draw(tree, wardrobe, size, &Shading::Lit(LIGHT));
        made
    }

    fn draw(&self, tree: &TreeMesh, wardrobe: &Wardrobe, size: (u32, u32), shading: &Shading) -> Vec<Target> {
        self.views
            .par_iter()
            .map(|view| rasterize(&wardrobe.dressed(tree), view, size.0, size.1, self.samples, shading))
            .collect()
    }

    /// How many views it was drawn from.
    #[cfg(test)]
    pub(super) const fn views(&self) -> usize {
        self.targets.len()
    }

    /// Bytes that it takes, about.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.targets.iter().map(|target| target.coverage.len() * 36).sum()
    }

    /// Compares a level with the full tree, FLIP included.
    #[must_use]
    pub fn measure(&self, tree: &TreeMesh, wardrobe: &Wardrobe) -> Measured {
        self.measure_from(&|_| (Cow::Borrowed(tree), Cow::Borrowed(wardrobe)), Asked::All)
    }

    /// As [`Reference::measure`], of a level that may turn to the viewer: `seen` is what a view shows.
    #[must_use]
    pub fn measure_from(&self, seen: &Seen<'_>, asked: Asked) -> Measured {
        let measured = self.silhouettes(seen);
        if asked == Asked::Silhouette { measured } else { self.colors(&self.seen(seen), measured) }
    }

    /// As [`Reference::measure_from`] everything, of a level whose pictures are to be made so much brighter that it is as bright
    /// as the full tree: measured as it is then.
    pub(super) fn matched(&self, seen: &Seen<'_>) -> (f32, Measured) {
        let mut drawn = self.seen(seen);
        let (full, level) = (luminance(&self.targets), luminance(&drawn));
        let gain = if level > 0.0 { (full / level).clamp(BRIGHTENED.0, BRIGHTENED.1) } else { 1.0 };
        drawn.iter_mut().flat_map(|target| &mut target.color).for_each(|c| *c *= gain);
        (gain, self.colors(&drawn, self.silhouettes(seen)))
    }

    /// A level that may turn to the viewer, from all views.
    fn seen(&self, seen: &Seen<'_>) -> Vec<Target> {
        let shading = Shading::Lit(LIGHT);
        let draw = |(view, full): (&View, &Target)| {
            let (tree, wardrobe) = seen(view);
            rasterize(&wardrobe.dressed(&tree), view, full.width, full.height, self.samples, &shading)
        };
        self.views.par_iter().zip(&self.targets).map(draw).collect()
    }

    /// How its silhouettes agree; as of the full tree where they are not compared.
    fn silhouettes(&self, seen: &Seen<'_>) -> Measured {
        let Some(of_full) = &self.outlines else { return Measured::same(self.pixels) };
        let (outlines, full) = &**of_full;
        let drawn = outlines.for_each_view(|view| {
            let (tree, wardrobe) = seen(view);
            outlines.one(view, &tree, &wardrobe.cutouts()).areas()
        });
        Measured { pixels: self.pixels, ..outlines.agreement((full, &drawn), self.samples as usize) }
    }

    /// The differences in colour as well.
    fn colors(&self, drawn: &[Target], measured: Measured) -> Measured {
        let count = self.targets.len().max(1) as f32;
        let of = |(a, b): (&Target, &Target)| {
            let flip = flip(&before_sky(a), &before_sky(b), a.width as usize);
            (flip, (mean_color(a) - mean_color(b)).length())
        };
        let all: Vec<(f32, f32)> = self.targets.par_iter().zip(drawn).map(of).collect();
        let (flip, color) = all.iter().fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
        Measured { flip: flip / count, color: color / count, ..measured }
    }
}

/// Mean over the views of what is covered, each view as much as the others.
fn luminance(targets: &[Target]) -> f32 {
    targets.iter().map(|target| mean_light(target).dot(LUMINANCE)).sum::<f32>() / targets.len().max(1) as f32
}

/// A picture over the sky.
fn before_sky(target: &Target) -> Vec<Vec3> {
    target.color.iter().zip(&target.coverage).map(|(&c, &w)| SKY * (1.0 - w) + c * w).collect()
}

/// Mean of what is covered, linear.
fn mean_light(target: &Target) -> Vec3 {
    let area: f32 = target.coverage.iter().sum();
    let sum: Vec3 = target.color.iter().zip(&target.coverage).map(|(&c, &w)| c * w).sum();
    sum / area.max(1e-6)
}

/// The same in sRGB.
fn mean_color(target: &Target) -> Vec3 {
    let mean = mean_light(target);
    let srgb = |l: f32| math::linear_to_srgb(l.min(1.0));
    Vec3::new(srgb(mean.x), srgb(mean.y), srgb(mean.z))
}

/// Corners of the box around both primitives; zero where there are no vertices.
pub(super) fn bounds(tree: &TreeMesh) -> (Vec3, Vec3) {
    let all = [&tree.bark, &tree.leaf].into_iter().flat_map(|m: &Mesh| m.positions.iter()).filter(|p| p.is_finite());
    let (low, high) = all.fold((Vec3::MAX, Vec3::MIN), |(l, h), &p| (l.min(p), h.max(p)));
    if low.cmple(high).all() { (low, high) } else { (Vec3::ZERO, Vec3::ZERO) }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    /// A card, seen from all sides.
    fn card() -> TreeMesh {
        let corners = [(-1.0, 0.0), (1.0, 0.0), (1.0, 2.0), (-1.0, 2.0)];
        let leaf = Mesh {
            positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
            normals: vec![Vec3::Z; 4],
            uvs: corners.map(|(x, y)| Vec2::new(0.5 + 0.5 * x, 1.0 - 0.5 * y)).to_vec(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        };
        TreeMesh { leaf, ..TreeMesh::default() }
    }

    fn green(linear: f32) -> Wardrobe {
        let byte = |share: f32| (math::linear_to_srgb(linear * share) * 255.0 + 0.5) as u8;
        let color = [byte(0.5), byte(1.0), byte(0.2), 255];
        let maps = Maps {
            width: 4,
            height: 4,
            color: vec![color; 16],
            normal: vec![[128, 128, 255]; 16],
            orm: vec![[255; 3]; 16],
        };
        Wardrobe::new(std::slice::from_ref(&maps), &maps)
    }

    #[test]
    fn a_darker_level_is_brightened_to_the_full_one_within_bounds() {
        let reference = Reference::new(&card(), &green(0.3), 40, 4);
        for (level, gain) in [(0.3, 1.0), (0.27, 1.111), (0.34, 0.882), (0.1, 1.25), (0.9, 0.75)] {
            let (found, measured) = reference.matched(&|_| (Cow::Owned(card()), Cow::Owned(green(level))));
            assert!((found - gain).abs() < 0.02, "{level}: {found}");
            let matched = (0.25..0.4).contains(&level);
            assert_eq!(measured.color < 0.01, matched, "{level}: {measured:?}");
        }
    }
}
