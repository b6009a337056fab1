//! How far a level of detail is from the full tree, as it is seen at a given size.
//!
//! Views stand on the upper part of a sphere, from level to [`STEEPEST`], evenly by area (a golden spiral). Both trees are
//! drawn with alpha test and supersampling; a pixel belongs to the silhouette when at least half of its samples do. The
//! intersection of the two silhouettes over their union is the IoU; the coverage ratio compares sums of coverage, which is
//! what popping of brightness follows; colour is compared by the mean of the lit pixels, and FLIP compares the pictures
//! before a sky.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::flip::flip;
use crate::bake::{Light, Maps, Picture, Repeat, Shading, Surface, Target, View, rasterize};
use crate::base::{Frame, math};
use crate::mesh::{Mesh, TreeMesh};

/// Sine of the elevation of the steepest view: 45 degrees. At the size at which the second level takes over, that is a
/// viewer a hundred metres above the ground.
const STEEPEST: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Samples along a tree's height, at least: where silhouettes are compared, and where colours alone are.
const LINES: u32 = 270;
const COLOR_LINES: u32 = 150;
/// The sky behind the trees when pictures are compared, linear light.
const SKY: Vec3 = Vec3::new(0.42, 0.55, 0.70);

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

    /// What a level shows.
    #[must_use]
    pub fn dressed<'a>(&'a self, tree: &'a TreeMesh) -> [Surface<'a>; 2] {
        [
            Surface { mesh: &tree.bark, pictures: &self.bark, repeat: Repeat::Tiled },
            Surface { mesh: &tree.leaf, pictures: &self.leaves, repeat: Repeat::Cutout },
        ]
    }
}

/// How far a level is from the full one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Height of the tree in the pictures that were compared, pixels.
    pub pixels: u32,
    /// How many views.
    pub views: u32,
    /// Silhouette intersection over union, mean of the views, 0..=1.
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

/// The full tree, drawn from all views at one size.
#[derive(Clone, Debug)]
pub struct Reference {
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
        let (views, size) = self::views(tree, pixels, views);
        Self::of(tree, wardrobe, (pixels, LINES), views, size)
    }

    /// As [`new`](Self::new), from every `step`-th of so many directions, for their colours.
    pub(super) fn some(tree: &TreeMesh, wardrobe: &Wardrobe, pixels: u32, (count, step): (u32, usize)) -> Self {
        let (views, size) = self::views(tree, pixels, count);
        Self::of(tree, wardrobe, (pixels, COLOR_LINES), views.into_iter().skip(step / 2).step_by(step).collect(), size)
    }

    fn of(
        tree: &TreeMesh,
        wardrobe: &Wardrobe,
        (pixels, lines): (u32, u32),
        views: Vec<View>,
        size: (u32, u32),
    ) -> Self {
        // As many samples along the tree at any size: what a pixel holds is a matter of the tree, not of mips.
        let samples = lines.div_ceil(pixels.max(1)).clamp(2, 9);
        let mut made = Self { views, targets: Vec::new(), pixels, samples };
        made.targets = made.draw(tree, wardrobe, size, &Shading::Lit(Light::DAY));
        made
    }

    fn draw(&self, tree: &TreeMesh, wardrobe: &Wardrobe, size: (u32, u32), shading: &Shading) -> Vec<Target> {
        self.views
            .par_iter()
            .map(|view| rasterize(&wardrobe.dressed(tree), view, size.0, size.1, self.samples, shading))
            .collect()
    }

    /// Bytes that it takes, about.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.targets.iter().map(|target| target.coverage.len() * 36).sum()
    }

    /// Compares a level with the full tree, FLIP included.
    #[must_use]
    pub fn measure(&self, tree: &TreeMesh, wardrobe: &Wardrobe) -> Measured {
        self.measure_from(&|_| tree.clone(), wardrobe, Asked::All)
    }

    /// As [`Reference::measure`], of a level that may turn to the viewer: `seen` is what a view shows.
    #[must_use]
    pub fn measure_from(
        &self,
        seen: &(dyn Fn(&View) -> TreeMesh + Sync),
        wardrobe: &Wardrobe,
        asked: Asked,
    ) -> Measured {
        let Some(first) = self.targets.first() else { return Measured::same(self.pixels) };
        let shading = if asked == Asked::All { Shading::Lit(Light::DAY) } else { Shading::Nothing };
        let drawn: Vec<Target> = self
            .views
            .par_iter()
            .map(|view| {
                let surfaces = seen(view);
                rasterize(&wardrobe.dressed(&surfaces), view, first.width, first.height, self.samples, &shading)
            })
            .collect();
        let measured = self.compare(&drawn);
        if asked == Asked::Silhouette {
            return Measured { color: 0.0, ..measured };
        }
        let flips: Vec<f32> = (self.targets.par_iter().zip(&drawn))
            .map(|(a, b)| flip(&before_sky(a), &before_sky(b), a.width as usize))
            .collect();
        Measured { flip: flips.iter().sum::<f32>() / flips.len() as f32, ..measured }
    }

    fn compare(&self, drawn: &[Target]) -> Measured {
        let count = self.targets.len() as f32;
        let same = Measured::same(self.pixels);
        let mut sum = Measured { views: self.targets.len() as u32, iou: 0.0, coverage: 0.0, ..same };
        for (a, b) in self.targets.iter().zip(drawn) {
            let iou = silhouette_iou(a, b);
            sum.iou += iou / count;
            sum.worst_iou = sum.worst_iou.min(iou);
            sum.coverage += covered_ratio(a, b) / count;
            sum.color += (mean_color(a) - mean_color(b)).length() / count;
        }
        sum
    }
}

/// A picture over the sky.
fn before_sky(target: &Target) -> Vec<Vec3> {
    target.color.iter().zip(&target.coverage).map(|(&c, &w)| SKY * (1.0 - w) + c * w).collect()
}

/// Of the pixels that are half covered or more.
fn silhouette_iou(a: &Target, b: &Target) -> f32 {
    let (mut both, mut either) = (0_u32, 0_u32);
    for (&a, &b) in a.coverage.iter().zip(&b.coverage) {
        let (a, b) = (a >= 0.5, b >= 0.5);
        both += u32::from(a && b);
        either += u32::from(a || b);
    }
    if either == 0 { 1.0 } else { both as f32 / either as f32 }
}

/// Covered area of `b` over that of `a`; 1 where `a` is empty.
fn covered_ratio(a: &Target, b: &Target) -> f32 {
    let (area, other) = (a.coverage.iter().sum::<f32>(), b.coverage.iter().sum::<f32>());
    if area > 0.0 { other / area } else { 1.0 }
}

/// Mean of what is covered, in sRGB.
fn mean_color(target: &Target) -> Vec3 {
    let area: f32 = target.coverage.iter().sum();
    let sum: Vec3 = target.color.iter().zip(&target.coverage).map(|(&c, &w)| c * w).sum();
    let mean = sum / area.max(1e-6);
    let srgb = |l: f32| math::linear_to_srgb(l.min(1.0));
    Vec3::new(srgb(mean.x), srgb(mean.y), srgb(mean.z))
}

/// Corners of the box around both primitives; zero where there are no vertices.
pub(super) fn bounds(tree: &TreeMesh) -> (Vec3, Vec3) {
    let all = [&tree.bark, &tree.leaf].into_iter().flat_map(|m: &Mesh| m.positions.iter()).filter(|p| p.is_finite());
    let (low, high) = all.fold((Vec3::MAX, Vec3::MIN), |(l, h), &p| (l.min(p), h.max(p)));
    if low.cmple(high).all() { (low, high) } else { (Vec3::ZERO, Vec3::ZERO) }
}
