//! How well outlines of a level agree with the full tree's, at all sizes at once.
//!
//! The full tree is drawn once from all views, a bit a sample, and so is a level; pixels of two, three or more samples an
//! edge are then counted from the same bits. Colours play no part, so that a new tint changes no threshold.

use std::sync::OnceLock;

use glam::Vec2;
use rayon::prelude::*;

use super::lacks::{Lacks, Wanted};
use super::measure::{Measured, bounds, views};
use crate::bake::{Areas, Cutout, Repeat, Shape, Silhouette, View};
use crate::base::{Frame, once};
use crate::mesh::TreeMesh;

/// Every which view is looked at in searches.
const SOME: usize = 3;
/// Pixels that are carved are so many samples wide, and so many in rough drawings: areas are as well known by a quarter of
/// the samples.
pub(super) const CARVED: usize = 4;
const ROUGH: usize = 2;
/// Edge of pixels that are compared on more than one raster, samples.
const LARGE: usize = 5;
/// Points that are looked at together.
const LANES: usize = 8;
/// Widths and heights of views, of the tree's there: a level's cards reach a little farther. And the most samples along an edge.
const ROOM: f32 = 1.1;
const LARGEST: f32 = 8192.0;
/// How far pixels that are carved are drawn from a half.
const CONTRAST: f32 = 1.5;

/// The outlines of a full tree from all views, each as wide and high as the tree is there.
#[derive(Debug)]
pub struct Outlines {
    views: Vec<View>,
    /// Samples along the tree's height, and along a metre.
    lines: f32,
    per_metre: f32,
    drawn: Vec<Silhouette>,
    /// What pixels are to cover that are carved.
    wanted: OnceLock<Wanted>,
}

impl Outlines {
    /// Draws `tree` from `count` directions so that it is `lines` samples high.
    pub(super) fn new(tree: &TreeMesh, cutouts: &[&Cutout], lines: f32, count: u32) -> Self {
        let (low, high) = bounds(tree);
        let lines = lines.max(1.0);
        let per_metre = lines / (high.y - low.y).max(1e-3);
        let views = views(tree, 1, count).0.par_iter().map(|view| around(tree, view, per_metre)).collect();
        let mut made = Self { views, lines, per_metre, drawn: Vec::new(), wanted: OnceLock::new() };
        made.drawn = made.draw(tree, cutouts);
        made
    }

    /// Columns and rows of samples of a view: whole pixels of the size that is carved, so that rough drawings have the same.
    fn size(&self, view: &View) -> (usize, usize) {
        let samples = |half: f32| (2.0 * half * self.per_metre + 0.5) as usize;
        (samples(view.half_width), samples(view.half_height))
    }

    /// Bytes that it takes, about.
    #[must_use]
    pub fn weight(&self) -> usize {
        let of = |view: &View| {
            let ((columns, rows), carved) = (self.size(view), CARVED * CARVED);
            columns.next_multiple_of(64) * rows / 8 + columns * rows / carved * size_of::<f32>()
        };
        self.views.iter().map(of).sum()
    }

    /// A level from the same views.
    pub(super) fn draw(&self, tree: &TreeMesh, cutouts: &[&Cutout]) -> Vec<Silhouette> {
        self.views.par_iter().map(|view| self.one(view, tree, cutouts)).collect()
    }

    /// What a level that turns to the viewer has for each view.
    pub(super) fn for_each_view<T: Send>(&self, of: impl Fn(&View) -> T + Send + Sync) -> Vec<T> {
        self.views.par_iter().map(of).collect()
    }

    /// As [`draw`](Self::draw), of such a level: `shown` is its leaves and what cuts them out.
    pub(super) fn draw_each<T: Sync>(
        &self,
        of: &[T],
        shown: impl Fn(&T) -> (TreeMesh, Cutout) + Sync,
    ) -> Vec<Silhouette> {
        let one = |(view, of): (&View, &T)| {
            let (tree, cutout) = shown(of);
            self.one(view, &tree, &[&cutout])
        };
        self.views.par_iter().zip(of).map(one).collect()
    }

    /// Covered area over the full tree's, mean of every third view, of such a level.
    pub(super) fn ratio_of_some_of_each<T: Sync>(
        &self,
        of: &[T],
        shown: impl Fn(&T) -> (TreeMesh, Cutout) + Sync,
    ) -> f32 {
        self.mean_of_some(|i, full| {
            let (tree, cutout) = shown(&of[i]);
            over(full.count(), self.one(&self.views[i], &tree, &[&cutout]).count())
        })
    }

    /// What a level lacks, drawn roughly from every `step`-th view, the first of them `from`.
    pub(super) fn lacks(&self, (from, step): (usize, usize), tree: &TreeMesh, cutouts: &[&Cutout]) -> Lacks {
        let views: Vec<usize> = (from..self.views.len()).step_by(step).collect();
        let new = || Wanted::new(&self.views, &self.drawn, (CARVED, CONTRAST));
        once(&self.wanted, new).lacks(&views, CARVED / ROUGH, &|view| self.rough(&self.views[view], tree, cutouts))
    }

    fn rough(&self, view: &View, tree: &TreeMesh, cutouts: &[&Cutout]) -> Silhouette {
        let (columns, rows) = self.size(view);
        outline(tree, cutouts, view, (columns / ROUGH, rows / ROUGH))
    }

    /// Covered area over the full tree's, mean of every third view.
    pub(super) fn ratio_of_some(&self, tree: &TreeMesh, cutouts: &[&Cutout]) -> f32 {
        self.mean_of_some(|i, full| over(full.count(), self.one(&self.views[i], tree, cutouts).count()))
    }

    /// The same, drawn roughly.
    pub(super) fn rough_ratio_of_some(&self, tree: &TreeMesh, cutouts: &[&Cutout]) -> f32 {
        let samples = (ROUGH * ROUGH) as u64;
        self.mean_of_some(|i, full| over(full.count(), self.rough(&self.views[i], tree, cutouts).count() * samples))
    }

    fn mean_of_some(&self, of: impl Fn(usize, &Silhouette) -> f32 + Sync) -> f32 {
        let some = self.drawn.par_iter().enumerate().skip(1).step_by(SOME);
        let all: Vec<f32> = some.map(|(i, full)| of(i, full)).collect();
        all.iter().sum::<f32>() / all.len().max(1) as f32
    }

    /// One view.
    pub(super) fn one(&self, view: &View, tree: &TreeMesh, cutouts: &[&Cutout]) -> Silhouette {
        outline(tree, cutouts, view, self.size(view))
    }

    /// Covered area over the full tree's, mean of the views.
    pub(super) fn ratio(&self, drawn: &[Silhouette]) -> f32 {
        let ratio = |(a, b): (&Silhouette, &Silhouette)| ratio(a, b);
        self.drawn.iter().zip(drawn).map(ratio).sum::<f32>() / self.drawn.len().max(1) as f32
    }

    /// The full tree's, summed up for many sizes.
    pub(super) fn areas(&self) -> Vec<Areas> {
        areas(&self.drawn)
    }

    /// How a level agrees with the full tree at pixels of `size` samples an edge; colours are not looked at.
    pub(super) fn agreement(&self, (full, level): (&[Areas], &[Areas]), size: usize) -> Measured {
        let pixels = ((self.lines / size.max(1) as f32 + 0.5) as u32).max(1);
        let count = self.drawn.len().max(1) as f32;
        let of = |(a, b): (&Areas, &Areas)| (iou(a, b, size), over(u64::from(a.count()), u64::from(b.count())));
        let of: Vec<(f32, f32)> = full.par_iter().zip(level).map(of).collect();
        let mut sum = Measured { views: of.len() as u32, iou: 0.0, coverage: 0.0, ..Measured::same(pixels) };
        for (iou, ratio) in of {
            sum.iou += iou / count;
            sum.worst_iou = sum.worst_iou.min(iou);
            sum.coverage += ratio / count;
        }
        sum
    }
}

/// The part of a view that a tree takes, and some room around it for what a level adds.
fn around(tree: &TreeMesh, view: &View, per_metre: f32) -> View {
    let Frame { x, y, .. } = view.frame;
    // Several points at once; what is no number is neither less nor more.
    let (mut low, mut high) = ([[f32::MAX; LANES]; 2], [[f32::MIN; LANES]; 2]);
    for part in [&tree.bark, &tree.leaf].into_iter().flat_map(|mesh| mesh.positions.chunks(LANES)) {
        for (k, &p) in part.iter().enumerate() {
            let off = p - view.centre;
            for (axis, along) in [x.dot(off), y.dot(off)].into_iter().enumerate() {
                low[axis][k] = if along < low[axis][k] { along } else { low[axis][k] };
                high[axis][k] = if along > high[axis][k] { along } else { high[axis][k] };
            }
        }
    }
    let low = Vec2::from(low.map(|lanes| lanes.into_iter().fold(f32::MAX, f32::min)));
    let high = Vec2::from(high.map(|lanes| lanes.into_iter().fold(f32::MIN, f32::max)));
    let (low, high) = if low.cmple(high).all() { (low, high) } else { (Vec2::ZERO, Vec2::ZERO) };
    let samples = |length: f32| ((length * ROOM * per_metre).min(LARGEST) as usize + 1).next_multiple_of(CARVED);
    let half = |length: f32| 0.5 * samples(length) as f32 / per_metre;
    let (middle, size) = ((low + high) * 0.5, high - low);
    View::new(view.frame, view.centre + x * middle.x + y * middle.y, half(size.x), half(size.y))
}

/// Drawings summed up for many sizes.
pub(super) fn areas(drawn: &[Silhouette]) -> Vec<Areas> {
    drawn.par_iter().map(Silhouette::areas).collect()
}

fn outline(tree: &TreeMesh, cutouts: &[&Cutout], view: &View, (columns, rows): (usize, usize)) -> Silhouette {
    let bark = Shape { mesh: &tree.bark, cutouts: &[], repeat: Repeat::Tiled, closed: true };
    let leaf = Shape { mesh: &tree.leaf, cutouts, repeat: Repeat::Cutout, closed: false };
    // Wood first: it asks for no texels.
    Silhouette::new(&[bark, leaf], view, columns, rows)
}

fn ratio(a: &Silhouette, b: &Silhouette) -> f32 {
    over(a.count(), b.count())
}

fn over(area: u64, other: u64) -> f32 {
    if area > 0 { other as f32 / area as f32 } else { 1.0 }
}

/// Of the pixels that are half covered or more: where they are large, mean of four rasters that lie half a pixel apart, since
/// a tree that is few pixels high stands on any.
fn iou(a: &Areas, b: &Areas, size: usize) -> f32 {
    let half = size / 2;
    let all = [(0, 0), (half, half), (half, 0), (0, half)];
    let rasters = if size < LARGE { &all[..1] } else { &all[..] };
    rasters.iter().map(|&from| iou_from(a, b, size, from)).sum::<f32>() / rasters.len() as f32
}

fn iou_from(a: &Areas, b: &Areas, size: usize, from: (usize, usize)) -> f32 {
    let (both, either) = a.overlap(b, size, from);
    if either == 0 { 1.0 } else { both as f32 / either as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{Shading, Surface, rasterize};
    use crate::base::Seed;
    use crate::mesh::{CrownLight, Mesh, TubeDetail, Wood};
    use crate::plant::PlantBuilder;
    use crate::preset::plan::{Forks, MeshParams};
    use glam::Vec3;

    #[test]
    fn small_trees_are_compared_on_four_rasters() {
        let square = |left: f32| {
            let corners = [(left, -1.0), (left + 2.0, -1.0), (left + 2.0, 1.0), (left, 1.0)];
            let mesh = Mesh {
                positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
                normals: vec![Vec3::Z; 4],
                indices: vec![0, 1, 2, 0, 2, 3],
                ..Mesh::default()
            };
            let shape = Shape { mesh: &mesh, cutouts: &[], repeat: Repeat::Tiled, closed: false };
            Silhouette::new(&[shape], &View::new(Frame::WORLD, Vec3::ZERO, 2.0, 2.0), 80, 80).areas()
        };
        // Four pixels wide at ten samples, and aside by less than half of one, which the first raster does not see.
        let (full, level) = (square(-1.0), square(-0.8));
        assert_eq!(iou_from(&full, &level, 10, (0, 0)), 1.0);
        assert!((0.6..0.95).contains(&iou(&full, &level, 10)), "{}", iou(&full, &level, 10));
        assert_eq!(iou(&full, &full, 10), 1.0);
    }

    #[test]
    fn wood_is_seen_without_its_backs_as_with_them() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::new(0.1, 1.0, 0.0), Vec3::Y * 2.0], &[0.2, 0.15, 0.1]);
        for i in 0..30 {
            let seed = Seed::new(9).at(i);
            let way = (seed.direction() + Vec3::Y * 0.5) * 0.8;
            builder.branch(stem, seed.at(1).range(0.2, 1.0), &[Vec3::ZERO, way * 0.5, way], &[0.05, 0.03, 0.01]);
        }
        let plant = builder.finish().unwrap();
        let posed = plant.pose();
        let light = CrownLight::of(&plant, &posed);
        for forks in [Forks::Collar, Forks::Plain] {
            let params = MeshParams { forks, ..MeshParams::told(8, 0.004) };
            let detail = TubeDetail::full(&params);
            let bark = Wood::of(&plant, &posed, &detail).mesh(&light, &detail);
            let tree = TreeMesh { bark, ..TreeMesh::default() };
            let (views, (columns, rows)) = views(&tree, 200, 8);
            for view in views {
                let drawn = |closed: bool| {
                    let shape = Shape { mesh: &tree.bark, cutouts: &[], repeat: Repeat::Tiled, closed };
                    let surface = Surface { mesh: &tree.bark, pictures: &[], repeat: Repeat::Tiled, closed };
                    let seen = rasterize(&[surface], &view, columns, rows, 1, &Shading::Albedo);
                    (Silhouette::new(&[shape], &view, columns as usize, rows as usize), seen)
                };
                let ((outline, seen), (with_backs, seen_with_backs)) = (drawn(true), drawn(false));
                assert_eq!(outline, with_backs);
                assert_eq!(seen.coverage, seen_with_backs.coverage);
                let differ = seen.depth.iter().zip(&seen_with_backs.depth).filter(|(a, b)| (*a - *b).abs() > 0.01);
                // Snapped, a back may come before a front at an edge.
                assert!(differ.count() * 1000 < outline.count() as usize);
            }
        }
    }
}
