//! The last level for engines with a shader for it: a hemi-octahedral impostor (Ryan Brucks 2018, after Cigolle et al.
//! 2014, "A survey of efficient representations for independent unit vectors").
//!
//! The whole tree is drawn from `frames × frames` directions of the upper half sphere, laid out in a square sheet: frame
//! (i, j), counted from the upper left, is seen from the direction whose hemi-octahedral coordinates are
//! `2 (i, j) / (frames − 1) − 1`. Colour has alpha, normals are relative to the frame (x right, y up, z to the viewer)
//! and those that are seen there, of leaves the front's on both sides, and the blue channel of the occlusion-roughness map
//! holds depth: 255 is the near side of the bounding sphere, 0 its far side (the leaf material's metallic factor is zero, so
//! that nothing shines).
//!
//! Frames are as wide as the upright cylinder around the tree, and as high as it is from where they look: with squares
//! around the bounding sphere half the texels of a tree were empty, three quarters of a poplar's. Leaves are drawn flat, and of
//! crowns with very many some that are larger. What of a frame is solid is settled by what the full tree covers between frames
//! ([`super::between`]); wood, which would go, is drawn as lines ([`super::limbs`]), and twigs are as the frame itself has them.
//!
//! The four corners of the square are level views from ±x and ±z. The level's mesh is two crossed rectangles, back to
//! back, that wear those corners: where there is no shader they are shown as they are.
//!
//! A level is settled and measured as its shader shows it ([`super::parallax`]).

use std::borrow::Cow;
use std::ops::RangeInclusive;

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::agree::Outlines;
use super::bake_card::opened;
use super::between::Between;
use super::cloud::{CARD_TEXELS, Scene};
use super::limbs::{Limbs, Lines, Seen};
use super::measure::{Wardrobe, bounds};
use super::packed::as_packed;
use super::parallax::{CROWNS, Facing, TWIGS, Texels};
use super::secant::Secant;
use super::thin::kept;
use super::tile::{Tile, share};
use super::trunk::Trunk;
use crate::bake::{
    Cutout, Design, PictureKind, Recipe, Repeat, Shading, Shape, Silhouette, Surface, Target, View, filled, survey,
};
use crate::base::{Frame, Seed};
use crate::mesh::{CardShape, LeafCard, Mesh, TreeMesh, TubeDetail, add_tangents, all_cards, leaf_cards_in};

/// Texels along the edge of a sheet, where cards have [`CARD_TEXELS`].
const SHEET: u32 = 480;
/// Samples along a texel's edge, of crowns and of twigs: with three a crown's frames agree no better (0.883 of six sets, both)
/// and an asset takes a fifth longer.
const SAMPLES: u32 = 2;
const SAMPLES_TWIGS: u32 = 3;
/// Room around the cylinder, so that neighbouring frames do not mix in the first mip.
const ROOM: f32 = 1.05;
/// Distance of a rectangle from its plane, as a share of the sphere's radius.
const APART: f32 = 0.01;
/// Roughness of leaves, of 255. What is above it tells how far a normal looks away from the viewer, which no normal map can hold
/// that an engine packs: under a sun behind the trees a crown whose normals all look to the viewer is half as bright as it should be.
pub(super) const ROUGHNESS: u8 = 200;
/// Texels around one that coverage is sharpened by, and how far: of leaves, whose holes three mixed frames would close
/// (measured, FLIP 0.077 without and 0.065 with it), and of twigs alone.
const AROUND: usize = 2;
const SHARP: f32 = 0.7;
const SHARP_TWIGS: f32 = 3.0;
/// Rounds in search of the gain, and how coverage follows it at first: measured, 0.35 to 0.7 of crowns, 1 to 1.6 of twigs.
const ROUNDS: usize = 8;
const SLOPE: f32 = 0.6;
const SLOPE_TWIGS: f32 = 1.2;
/// Slopes that are believed, and gains that are tried.
const SLOPES: RangeInclusive<f32> = 0.2..=2.0;
const GAINS: RangeInclusive<f32> = 0.4..=1.8;
/// How near to what the full tree covers is near enough: of twigs less, whose coverage hangs on the views besides (bare trees
/// from others than these: 0.983 to 1.037 by the first, 0.989 to 1.032 by the second).
const NEAR: f32 = 0.008;
const NEAR_TWIGS: f32 = 0.002;
/// Most leaves that frames are drawn with, for each of a frame's texels: what is seen of a denser crown is a part of its leaves.
/// As many as there are: mean IoU of four elms 0.909; four: 0.907; two: 0.900; one 0.897.
const MOST_LEAVES: u32 = 4;
/// Every which level frame is looked at for how much wood is seen.
const COUNTED: usize = 4;

/// Texels along a frame's edge where cards have so many: a sheet of fewer frames shows each of them larger.
pub(super) fn texels(cards: u32, frames: u32) -> u32 {
    (cards.clamp(8, 1024) * SHEET / (CARD_TEXELS * frames.clamp(2, 32))).clamp(8, 256)
}

/// How a sheet of views is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Impostor {
    /// Frames along an edge of the sheet, 2..=32.
    pub frames: u32,
    /// Middle of what each frame shows, metres.
    pub centre: Vec3,
    /// Half the depth that each frame shows, metres.
    pub radius: f32,
    /// Half the width of what each frame shows, metres.
    pub reach: f32,
    /// Half the height of what a level frame shows, metres.
    pub height: f32,
}

impl Impostor {
    /// The axes of a frame: `z` points to its viewer, `y` up in the picture.
    #[must_use]
    pub fn axes(&self, (column, row): (u32, u32)) -> Frame {
        let last = self.frames.saturating_sub(1).max(1) as f32;
        let at = Vec2::new(column as f32, row as f32) / last * 2.0 - 1.0;
        let flat = Vec2::new(at.x - at.y, at.x + at.y) * 0.5;
        let z = Vec3::new(flat.x, (1.0 - flat.x.abs() - flat.y.abs()).max(0.0), flat.y).normalize_or(Vec3::Y);
        // Straight from above no way is up.
        let x = Vec3::Y.cross(z).try_normalize().unwrap_or(Vec3::X);
        Frame { x, y: z.cross(x), z }
    }

    /// Half the width and height of what a frame shows, metres: `reach`, and `height` times the cosine of its elevation
    /// and `reach` times the sine.
    #[must_use]
    pub fn extent(&self, frame: (u32, u32)) -> Vec2 {
        self.extent_from(self.axes(frame).z)
    }

    /// The rectangle in the sheet (0..=1, v down) that a frame takes: its upper left corner and its edge.
    fn rect(&self, (column, row): (u32, u32)) -> (Vec2, f32) {
        let edge = 1.0 / self.frames.max(1) as f32;
        (Vec2::new(column as f32, row as f32) * edge, edge)
    }

    /// Adds a part of a frame, `low` to `high` of -1..=1, as a rectangle.
    fn add(&self, frame: (u32, u32), (low, high): (Vec2, Vec2), trunk: &Trunk, tile: u32, mesh: &mut Mesh) {
        let (axes, extent, (corner, edge)) = (self.axes(frame), self.extent(frame), self.rect(frame));
        let first = mesh.positions.len() as u32;
        for at in [low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)] {
            let on = self.centre + axes.x * (at.x * extent.x) + axes.y * (at.y * extent.y);
            // The rectangles cross in the trunk's line.
            let deep = APART * self.radius + axes.z.dot(trunk.at(on.y) - self.centre);
            mesh.positions.push(on + axes.z * deep);
            mesh.normals.push(axes.z);
            mesh.uvs.push(corner + Vec2::new(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y) * edge);
            mesh.occlusion.push(255);
            mesh.tiles.push(tile);
        }
        mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    }
}

/// An impostor before its alpha is settled.
pub(super) struct Views {
    pub(super) layout: Impostor,
    /// Along a frame's edge.
    texels: u32,
    drawn: Vec<Drawn>,
    /// The mesh for engines without a shader for it.
    quads: Mesh,
}

/// One frame.
struct Drawn {
    /// A half and more is solid.
    alpha: Vec<f32>,
    /// Texels of wood, which is as wide as it is whatever the gain.
    wood: Vec<bool>,
    /// Metres before the middle, smoothed and filled.
    depth: Vec<f32>,
    normal: Vec<[u8; 3]>,
    /// How far normals look away from the viewer, 0..=1.
    away: Vec<f32>,
    /// Of 255.
    open: Vec<u8>,
    recipe: Recipe,
    /// How much of each texel was drawn, of 255; all of those that lines stand for.
    drawn: Vec<u8>,
}

/// Draws an impostor's frames, so many along an edge, for cards of so many texels.
fn impostor(scene: &Scene<'_>, (frames, cards): (u32, u32), wardrobe: &Wardrobe, seed: Seed) -> Views {
    let (frames, texels) = (frames.clamp(2, 32), texels(cards, frames));
    let (low, high) = bounds(scene.full);
    let centre = (low + high) * 0.5;
    let points = || scene.full.bark.positions.iter().chain(&scene.full.leaf.positions).filter(|p| p.is_finite());
    let across = |p: &Vec3| (p.x - centre.x) * (p.x - centre.x) + (p.z - centre.z) * (p.z - centre.z);
    let reach = (points().map(across).fold(0.0_f32, f32::max).sqrt() * ROOM).max(1e-3);
    let height = ((high.y - low.y) * 0.5 * ROOM).max(1e-3);
    let layout = Impostor { frames, centre, radius: (reach * reach + height * height).sqrt(), reach, height };
    let afar = Afar::of(scene, 2.0 * height / texels as f32, texels, seed);
    let (bark, leaf): (&Mesh, &Mesh) = (&afar.wood, afar.few.as_ref().unwrap_or(&afar.leaves));
    let surfaces = [
        Surface { mesh: bark, pictures: &wardrobe.bark, repeat: Repeat::Tiled, closed: true },
        Surface { mesh: leaf, pictures: &wardrobe.leaves, repeat: Repeat::Cutout, closed: false },
    ];
    let is_twigs = scene.wood.bare > 0.5;
    let samples = if is_twigs { SAMPLES_TWIGS } else { SAMPLES };
    let at = |i: u32| (i % frames, i / frames);
    let surveyed: Vec<Surveyed> = (0..frames * frames)
        .into_par_iter()
        .map(|i| {
            let (axes, extent) = (layout.axes(at(i)), layout.extent(at(i)));
            let view = View::new(axes, centre, extent.x, extent.y);
            let (target, recipe) = survey(&surfaces, &view, texels, texels, samples, &Shading::Seen);
            Surveyed::new(target, recipe, wardrobe.bark.len() as u32)
        })
        .collect();
    let level: Vec<((u32, u32), &Seen)> = surveyed
        .iter()
        .zip(0..)
        .filter(|(_, i)| is_level(at(*i), frames))
        .map(|(s, i)| (at(i), &s.wood))
        .step_by(COUNTED)
        .collect();
    let limbs = Limbs::of(scene.plant, scene.posed, &scene.wood.shown).sunk(&scene.full.bark);
    let limbs =
        if is_twigs { limbs.thick(2.0 * height / texels as f32) } else { limbs.enough(&layout, texels, &level) };
    let mut drawn: Vec<Drawn> = surveyed
        .into_par_iter()
        .zip(0..frames * frames)
        .map(|(surveyed, i)| Drawn::new(surveyed, layout.axes(at(i)), &limbs.lines(&layout, at(i), texels), is_twigs))
        .collect();
    // Twigs are a small part of a pixel, and what is to be covered there is drawn away from a half: they would go.
    if !is_twigs {
        fit(&mut drawn, &layout, texels as usize, &afar.shapes(&wardrobe.cutouts()));
    }
    let mut leaf = Mesh::default();
    let trunk = Trunk::of(scene.plant, scene.posed);
    let last = frames - 1;
    for frame in [(0, 0), (last, 0), (0, last), (last, last)] {
        let (axes, extent) = (layout.axes(frame), layout.extent(frame));
        let (mut least, mut most) = (Vec2::splat(1.0), Vec2::splat(-1.0));
        for p in points() {
            let p = Vec2::new(axes.x.dot(*p - centre), axes.y.dot(*p - centre)) / extent;
            (least, most) = (least.min(p), most.max(p));
        }
        if least.cmplt(most).all() {
            layout.add(frame, (least, most), &trunk, 0, &mut leaf);
        }
    }
    // An error only says that the mesh has no triangles to take tangents from.
    let _ = add_tangents(&mut leaf);
    Views { layout, texels, drawn, quads: leaf }
}

/// Settles the alpha of frames by what is seen between them.
fn fit(drawn: &mut [Drawn], layout: &Impostor, texels: usize, full: &[Shape<'_>]) {
    let frames = layout.frames as usize;
    let depth = laid_out(frames, texels, |frame| &drawn[frame].depth);
    let size = (frames * texels, frames * texels);
    let between = Between::new(layout, Texels { all: &depth, wide: size.0, first: (0, 0), size }, full);
    let mut alphas: Vec<Vec<f32>> = drawn.iter_mut().map(|drawn| std::mem::take(&mut drawn.alpha)).collect();
    let deep: Vec<&[f32]> = drawn.iter().map(|drawn| drawn.depth.as_slice()).collect();
    let own: Vec<Vec<f32>> = alphas.clone();
    between.settle(&mut alphas, &deep, texels);
    for ((drawn, alpha), own) in drawn.iter_mut().zip(alphas).zip(own) {
        drawn.alpha = alpha;
        for (i, _) in drawn.wood.iter().enumerate().filter(|(_, is_wood)| **is_wood) {
            drawn.alpha[i] = own[i];
        }
    }
}

/// Whether a frame is one of those along the edges of the sheet, which are level.
fn is_level((column, row): (u32, u32), frames: u32) -> bool {
    column == 0 || row == 0 || column + 1 == frames || row + 1 == frames
}

/// What frames hold, row by row of the sheet of so many frames along an edge, each of so many texels.
pub(super) fn laid_out<'a, T: Copy + 'a>(frames: usize, texels: usize, of: impl Fn(usize) -> &'a [T]) -> Vec<T> {
    let mut all = Vec::with_capacity(frames * frames * texels * texels);
    for (first, line) in (0..frames).flat_map(|row| (0..texels).map(move |line| (row * frames, line * texels))) {
        (first..first + frames).for_each(|frame| all.extend_from_slice(&of(frame)[line..line + texels]));
    }
    all
}

/// A tree as it is seen from afar.
struct Afar<'a> {
    wood: Cow<'a, Mesh>,
    leaves: Cow<'a, Mesh>,
    /// As many leaves as frames show, or none if that is all of them.
    few: Option<Mesh>,
}

impl<'a> Afar<'a> {
    /// Flat leaves, wood without what is a small part of a texel of `texel` metres; frames have `texels` of them along an edge.
    /// Where twigs are seen the tree is as it is.
    fn of(scene: &Scene<'a>, texel: f32, texels: u32, seed: Seed) -> Self {
        if scene.wood.bare > 0.0 {
            let TreeMesh { bark, leaf } = scene.full;
            return Self { wood: Cow::Borrowed(bark), leaves: Cow::Borrowed(leaf), few: None };
        }
        let detail = TubeDetail {
            sides: 5,
            most_sides: 5,
            error: texel * 0.25,
            min_radius: texel * 0.03,
            ..TubeDetail::full(scene.params)
        };
        let flat = |leaves: &[LeafCard]| leaf_cards_in(scene.plant, scene.posed, scene.light, leaves, CardShape::Flat);
        let most = (MOST_LEAVES * texels * texels) as usize;
        let few = || {
            (scene.plant.leaves().len() > most)
                .then(|| flat(&kept(scene.plant, scene.posed, (most, &|_| 1), 1.0, seed)))
        };
        let leaves = || rayon::join(|| flat(&all_cards(scene.plant)), few);
        let (wood, (leaves, few)) = rayon::join(|| scene.wood.mesh(scene.light, &detail), leaves);
        Self { wood: Cow::Owned(wood), leaves: Cow::Owned(leaves), few }
    }

    /// All of it, cut out by the pictures of a wardrobe.
    fn shapes<'s>(&'s self, cutouts: &'s [&'s Cutout]) -> [Shape<'s>; 2] {
        [
            Shape { mesh: &self.wood, cutouts: &[], repeat: Repeat::Tiled, closed: true },
            Shape { mesh: &self.leaves, cutouts, repeat: Repeat::Cutout, closed: false },
        ]
    }
}

/// An impostor, and how it is best shown.
pub(super) struct Settled {
    pub(super) views: Views,
    /// Of the sheet, with which it covers as much as the full tree.
    pub(super) alpha: Vec<u8>,
    /// Its outlines then.
    pub(super) drawn: Vec<Silhouette>,
}

impl Settled {
    /// Draws a tree's frames and finds the gain by secant steps.
    pub(super) fn new(
        scene: &Scene<'_>,
        sheet: (u32, u32),
        wardrobe: &Wardrobe,
        outlines: &Outlines,
        seed: Seed,
    ) -> Self {
        let views = impostor(scene, sheet, wardrobe, seed);
        let edge = (views.layout.frames * views.texels) as usize;
        let depth = laid_out(views.layout.frames as usize, views.texels as usize, |i| &views.drawn[i].depth);
        let depths = Texels { all: &depth, wide: edge, first: (0, 0), size: (edge, edge) };
        let fine = if scene.wood.bare > 0.0 { TWIGS } else { CROWNS };
        let seen = outlines.for_each_view(|view| Facing::new(&views.layout, (view.frame, fine), depths, |deep| *deep));
        let mut design = Design::default();
        let one = |seen: &Facing, sheet: &[u8]| {
            let (width, height) = seen.size();
            let tree = TreeMesh { leaf: seen.quad(), ..TreeMesh::default() };
            (tree, Cutout::new(width, height, seen.alpha(sheet, edge)))
        };
        let (near, steep) = if scene.wood.bare > 0.0 { (NEAR_TWIGS, SLOPE_TWIGS) } else { (NEAR, SLOPE) };
        let (alpha, drawn) = Secant::new(steep, SLOPES, GAINS).settle(
            1.0,
            (ROUNDS, near),
            |gain| views.packed(gain, &mut design),
            |sheet| outlines.ratio_of_some_of_each(&seen, |seen| one(seen, sheet)) - 1.0,
            |sheet| {
                let drawn = outlines.draw_each(&seen, |seen| one(seen, sheet));
                (outlines.ratio(&drawn) - 1.0, drawn)
            },
        );
        Self { alpha, drawn, views }
    }
}

/// A frame as it was drawn.
struct Surveyed {
    target: Target,
    recipe: Recipe,
    wood: Seen,
}

impl Surveyed {
    /// `barks` of the pictures are those of wood.
    fn new(target: Target, recipe: Recipe, barks: u32) -> Self {
        let wood: Vec<f32> = recipe.share_of_first(barks).zip(&target.coverage).map(|(share, c)| share * c).collect();
        let leaves: Vec<f32> = target.coverage.iter().zip(&wood).map(|(all, wood)| all - wood).collect();
        let wood = Seen::new(wood, &leaves, target.width as usize);
        Self { target, recipe, wood }
    }
}

impl Drawn {
    fn new(Surveyed { mut target, recipe, wood: seen }: Surveyed, axes: Frame, lines: &Lines, is_twigs: bool) -> Self {
        let mut depth = depths(&target);
        let is_line = if is_twigs { lines.alpha.iter().map(|line| *line > 0.0).collect() } else { seen.clear };
        let all: f32 = target.coverage.iter().sum();
        let mut drawn: Vec<u8> = target.coverage.iter().map(|covered| share(*covered)).collect();
        // Wood that lines stand for is not to be shown again.
        let rest = &mut target.coverage;
        rest.iter_mut().zip(&is_line).filter(|(_, is_line)| **is_line).for_each(|(covered, _)| *covered = 0.0);
        if is_twigs {
            let solid = lines.alpha.iter().filter(|line| **line >= 0.5).count() as f32;
            let left = (all - solid) / rest.iter().sum::<f32>().max(1e-6);
            rest.iter_mut().for_each(|covered| *covered *= left.clamp(0.0, 1.0));
        }
        let (by, around) = if is_twigs { (SHARP_TWIGS, usize::MAX) } else { (SHARP, 1) };
        sharpen(rest, target.width as usize, by);
        let mut alpha: Vec<f32> =
            alphas(rest, target.width, around).into_iter().map(|a| f32::from(a) / 255.0).collect();
        let mut wood = vec![false; alpha.len()];
        for (i, &line) in lines.alpha.iter().enumerate() {
            if is_line[i] || seen.near[i] && line > alpha[i] {
                alpha[i] = line;
                if line > 0.0 {
                    drawn[i] = if drawn[i] > 0 { u8::MAX } else { 0 };
                    depth[i] = lines.depth[i];
                    // Of twigs alone all there is is made to cover as much as the tree does.
                    wood[i] = !is_twigs;
                }
            }
        }
        let (normal, away) = target.normal.iter().map(|n| held(axes.to_local(*n))).unzip();
        let open = target.occlusion.iter().map(|o| opened(*o)).collect();
        Self { depth, normal, away, open, wood, alpha, recipe, drawn }
    }
}

impl Views {
    /// The mesh, which wears tile `tile`.
    pub(super) fn tree(&self, tile: u32) -> TreeMesh {
        let mut leaf = self.quads.clone();
        leaf.tiles.fill(tile);
        TreeMesh { bark: Mesh::default(), leaf }
    }

    /// The alpha of the whole sheet as an atlas keeps it, with `gain` times the area that the tree covers solid.
    pub(super) fn packed(&self, gain: f32, design: &mut Design) -> Vec<u8> {
        let edge = self.layout.frames * self.texels;
        as_packed(&[self.alpha(gain)], &[(edge, edge)], PictureKind::Frames, design).swap_remove(0)
    }

    /// Alpha of the sheet.
    fn alpha(&self, gain: f32) -> Vec<u8> {
        let texel = |(alpha, is_wood): (&f32, &bool)| {
            let gain = if *is_wood { 1.0 } else { gain };
            (alpha * gain * 255.0 + 0.5).clamp(0.0, 255.0) as u8
        };
        let of = |drawn: &Drawn| drawn.alpha.iter().zip(&drawn.wood).map(texel).collect();
        let alphas: Vec<Vec<u8>> = self.drawn.par_iter().map(of).collect();
        self.laid_out(|frame| &alphas[frame])
    }

    fn laid_out<'a, T: Copy + 'a>(&self, of: impl Fn(usize) -> &'a [T]) -> Vec<T> {
        laid_out(self.layout.frames as usize, self.texels as usize, of)
    }

    /// The sheet with that alpha.
    pub(super) fn sheet(&self, alpha: Vec<u8>) -> Tile {
        let (frames, texels) = (self.layout.frames, self.texels as usize);
        let edge = frames * self.texels;
        let relief = || {
            let orm = |((open, away), deep): ((u8, f32), f32)| {
                let deep = (0.5 + 0.5 * deep / self.layout.radius).clamp(0.0, 1.0);
                let rough = f32::from(ROUGHNESS) + away * f32::from(255 - ROUGHNESS);
                [open, (rough + 0.5) as u8, (deep * 255.0 + 0.5) as u8]
            };
            let open = self.laid_out(|frame| &self.drawn[frame].open);
            let away = self.laid_out(|frame| &self.drawn[frame].away);
            let depth = self.laid_out(|frame| &self.drawn[frame].depth);
            let normal = self.laid_out(|frame| &self.drawn[frame].normal);
            (normal, open.into_iter().zip(away).zip(depth).map(orm).collect())
        };
        let recipes: Vec<&Recipe> = self.drawn.iter().map(|drawn| &drawn.recipe).collect();
        let recipe = || Recipe::sheet(&recipes, frames as usize, texels);
        let ((normal, orm), recipe) = rayon::join(relief, recipe);
        let drawn = self.laid_out(|frame| &self.drawn[frame].drawn);
        Tile::new((edge, edge), alpha, normal, orm, (recipe, drawn))
    }
}

/// A normal, relative to a frame, as its texel holds it: on the viewer's side, and how far it looks away, 0..=1.
pub(super) fn held(normal: Vec3) -> ([u8; 3], f32) {
    let n = normal.with_z(normal.z.max(0.05)).normalize_or(Vec3::Z);
    ([n.x, n.y, n.z].map(|v| (v * 127.0 + 128.5) as u8), (-normal.z).clamp(0.0, 1.0))
}

/// Alpha of a frame's texels: in each row, taken with so many `around` it, as many are solid as the tree covers there, the
/// fullest first. Of twigs alone all rows are one.
///
/// Halftones were tried: error diffusion and an iterated one, drawn from a half by 1 to 4. They keep what each pixel
/// covers and lose two to nine hundredths of IoU, since a pixel holds two texels only; contours between texels keep both.
fn alphas(coverage: &[f32], texels: u32, around: usize) -> Vec<u8> {
    let width = texels as usize;
    let mut alphas = Vec::with_capacity(coverage.len());
    let mut ranked: Vec<f32> = Vec::with_capacity(2 * width);
    for (row, covered) in coverage.chunks_exact(width).enumerate() {
        let rows = row.saturating_sub(around)..row.saturating_add(around).saturating_add(1).min(width);
        let part = &coverage[rows.start * width..rows.end * width];
        ranked.clear();
        ranked.extend(part.iter().filter(|c| **c > 0.0));
        let wanted = (part.iter().sum::<f32>() + 0.5) as usize;
        let last = wanted.saturating_sub(1).min(ranked.len().saturating_sub(1));
        let threshold = (!ranked.is_empty()).then(|| *ranked.select_nth_unstable_by(last, |a, b| b.total_cmp(a)).1);
        // A little past the threshold, which itself must pass after rounding to bytes.
        let threshold = threshold.unwrap_or(0.5).clamp(0.02, 1.0);
        let most = part.iter().copied().fold(threshold, f32::max);
        // Where nearly all is covered, so is the threshold: what is fullest must not be near a half for it, or frames that
        // are mixed with others lose whole rows of a crown.
        let alpha = |c: f32| {
            let above = if c >= most { 1.0 } else { (c - threshold) / (most - threshold) };
            if c < threshold { 0.505 * c / threshold } else { (0.505 * c / threshold).max(0.505 + 0.495 * above) }
        };
        alphas.extend(covered.iter().map(|&c| (alpha(c) * 255.0 + 0.5).clamp(0.0, 255.0) as u8));
    }
    alphas
}

/// Draws coverage away from what is around it, as much being covered in all (unsharp masking): what is solid then follows
/// single branches and leaves more than the places where many of them meet.
fn sharpen(coverage: &mut [f32], width: usize, by: f32) {
    let before = coverage.to_vec();
    let height = before.len() / width.max(1);
    let all: f32 = before.iter().sum();
    for (i, c) in coverage.iter_mut().enumerate().filter(|(_, c)| **c > 0.0) {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(AROUND)..(y + AROUND + 1).min(height);
        let columns = x.saturating_sub(AROUND)..(x + AROUND + 1).min(width);
        let count = rows.len() * columns.len();
        let sum: f32 = rows.flat_map(|row| &before[row * width..][columns.clone()]).sum();
        // More than all of a texel would take from those amid a crown, which have no empty ones around them.
        *c = (*c + by * (*c - sum / count as f32)).clamp(0.0, 1.0);
    }
    let scale = all / coverage.iter().sum::<f32>().max(1e-6);
    coverage.iter_mut().for_each(|c| *c *= scale);
}

/// Depths of a frame's texels, each the mean of those around it, by what they cover: single leaves in front of others would
/// tear the picture when rays are followed to them. Where nothing is they are those around, since rays go past what is seen.
fn depths(target: &Target) -> Vec<f32> {
    let (width, height) = (target.width as usize, target.height as usize);
    let mean = |i: usize| {
        let (x, y) = (i % width, i / width);
        let (mut sum, mut weight) = (0.0_f32, 0.0_f32);
        for row in y.saturating_sub(1)..(y + 2).min(height) {
            for k in row * width + x.saturating_sub(1)..row * width + (x + 2).min(width) {
                if target.coverage[k] > 0.0 {
                    sum += target.depth[k] * target.coverage[k];
                    weight += target.coverage[k];
                }
            }
        }
        if weight > 0.0 { sum / weight } else { 0.0 }
    };
    let depths: Vec<f32> = (0..width * height).map(mean).collect();
    let alphas: Vec<u8> = target.coverage.iter().map(|c| (c * 255.0 + 0.5) as u8).collect();
    let all = filled(&alphas, target.width, target.height, |i| [depths[i]]);
    all.map_or(depths, |all| all.into_iter().map(|[deep]| deep).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Rotation;
    use crate::lod::specimen::{climbed, on_trunk};
    use crate::plant::{Leaf, PlantBuilder};
    use crate::preset::plan::Lod;

    #[test]
    fn axes_are_turned_right_and_corners_are_level() {
        let layout = Impostor { frames: 12, centre: Vec3::ZERO, radius: 1.0, reach: 0.8, height: 0.6 };
        for i in 0..144 {
            let axes = layout.axes((i % 12, i / 12));
            assert!(axes.x.cross(axes.y).distance(axes.z) < 1e-5 && axes.z.y >= 0.0);
        }
        let corners = [(0, 0), (11, 0), (0, 11), (11, 11)].map(|c| layout.axes(c).z);
        for way in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
            assert_eq!(corners.iter().filter(|c| c.distance(way) < 1e-6).count(), 1, "{corners:?}");
        }
    }

    /// 30 by 30 texels: a crown that is thin, 20 wide and high, over a trunk that stands between two columns.
    fn crown_and_trunk(trunk: [f32; 2]) -> Vec<f32> {
        let at = |i: usize| match (i % 30, i / 30) {
            (x, 0..20) if (5..25).contains(&x) => 0.15 + 0.4 * Seed::new(i as u64).unit(),
            (x @ (14 | 15), 20..) => trunk[x - 14],
            _ => 0.0,
        };
        (0..900).map(at).collect()
    }

    /// The sheet's alpha at a place of a frame of `texels` an edge, as a filter has it between texels.
    fn alpha_at(sheet: &Tile, frame: (u32, u32), texels: usize, at: Vec2) -> f32 {
        let (x, y) = (at.x.floor(), at.y.floor());
        let (fx, fy) = (at.x - x, at.y - y);
        let one = |dx: usize, dy: usize| {
            let column = frame.0 as usize * texels + (x as usize + dx).min(texels - 1);
            let row = frame.1 as usize * texels + (y as usize + dy).min(texels - 1);
            f32::from(sheet.alpha[row * sheet.width as usize + column])
        };
        let upper = one(0, 0) * (1.0 - fx) + one(1, 0) * fx;
        let lower = one(0, 1) * (1.0 - fx) + one(1, 1) * fx;
        upper * (1.0 - fy) + lower * fy
    }

    #[test]
    fn a_crown_on_a_thin_leaning_stem_does_not_float() {
        // Two stems from one foot, of a sixth of a texel each, that carry a crown of leaves.
        let mut builder = PlantBuilder::new();
        let ways = [Vec3::new(1.0, 4.0, 0.3), Vec3::new(-0.9, 4.0, 0.4)];
        let trunk = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y + ways[0]], &[0.05, 0.04, 0.02]);
        let limb = builder.branch(trunk, 0.2, &[Vec3::ZERO, ways[1]], &[0.03, 0.015]);
        for (i, chain) in [trunk, limb].into_iter().cycle().take(1200).enumerate() {
            let seed = Seed::new(9).at(i as u64);
            let turned = Rotation::about(seed.at(0).direction(), seed.at(1).range(0.0, 6.0));
            let leaf = Leaf::new(chain, seed.at(2).range(0.85, 1.0), turned, 0.35, 0);
            builder.leaf(Leaf { offset: seed.at(3).direction() * seed.at(4).unit(), ..leaf });
        }
        let plant = builder.finish().unwrap();
        let ladder = climbed(&plant, Lod::Impostor { frames: 10 });
        let (sheet, layout, texels) = (&ladder.tiles[0], ladder.levels[1].impostor.unwrap(), 48);
        let posed = plant.pose();
        for frame in [(0, 0), (4, 0), (9, 3), (2, 9)] {
            let (axes, extent) = (layout.axes(frame), layout.extent(frame));
            for part in 0..40 {
                let point = posed.at(&plant, trunk, 0.01 + 0.014 * part as f32).position;
                let seen = axes.to_local(point - layout.centre);
                let at = Vec2::new(seen.x / extent.x, -seen.y / extent.y) * 0.5 + 0.5;
                let alpha = alpha_at(sheet, frame, texels, at * texels as f32 - 0.5);
                assert!(alpha > 122.0, "{frame:?} {part}: {alpha}");
            }
        }
    }

    #[test]
    fn a_trunk_of_less_than_half_a_pixel_is_whole_in_every_frame() {
        let ladder = climbed(&on_trunk(Vec3::ZERO, (8.0, 0.08), (40, 30)), Lod::Impostor { frames: 10 });
        let (sheet, texels) = (&ladder.tiles[0], 48);
        assert_eq!(sheet.width, 480);
        // Level frames: along the edges of the sheet. The crown begins above half of the height.
        for frame in (0..10).flat_map(|i| [(i, 0), (i, 9), (0, i), (9, i)]) {
            let row = |y: usize| &sheet.alpha[(frame.1 * texels + y) * 480 + frame.0 * texels..][..texels];
            let whole = (26..46).all(|y| row(y).iter().any(|alpha| *alpha >= 128));
            assert!(whole, "{frame:?}");
        }
    }

    #[test]
    fn as_many_texels_are_solid_as_are_covered() {
        let coverage = crown_and_trunk([0.5, 0.5]);
        let covered: f32 = coverage[..30 * 20].iter().sum();
        for around in [1, usize::MAX] {
            let solid = alphas(&coverage, 30, around).iter().take(30 * 20).filter(|a| **a >= 128).count();
            assert!((solid as f32 / covered - 1.0).abs() < 0.1, "{around}: {solid} of {covered}");
        }
    }

    #[test]
    fn what_is_full_is_far_from_a_half_also_amid_a_crown() {
        let is_full = |i: usize| (5..25).contains(&(i % 30)) && (5..25).contains(&(i / 30));
        let mut coverage: Vec<f32> = (0..900).map(|i| if is_full(i) { 1.0 } else { 0.0 }).collect();
        sharpen(&mut coverage, 30, SHARP);
        let alphas = alphas(&coverage, 30, 1);
        let least = (0..900).filter(|i| is_full(*i)).map(|i| alphas[i]).min();
        assert!(least > Some(200), "{least:?}");
    }

    #[test]
    fn sharpened_coverage_has_its_sum_and_more_contrast() {
        let before: Vec<f32> = crown_and_trunk([0.5, 0.2]);
        let spread = |all: &[f32]| all.iter().map(|c| c * c).sum::<f32>();
        let mut last = spread(&before);
        for by in [0.0, SHARP, SHARP_TWIGS] {
            let mut after = before.clone();
            sharpen(&mut after, 30, by);
            assert!((after.iter().sum::<f32>() / before.iter().sum::<f32>() - 1.0).abs() < 1e-3);
            assert!(after.iter().zip(&before).all(|(a, b)| *a >= 0.0 && (*b > 0.0 || *a == 0.0)));
            assert!(by == 0.0 || spread(&after) > last * 1.05, "{by}: {} after {last}", spread(&after));
            last = spread(&after);
        }
    }

    #[test]
    fn rectangles_hold_the_line_of_a_leaning_trunk() {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::X, &[Vec3::ZERO, Vec3::new(2.0, 8.0, 1.0)], &[0.2, 0.1]);
        let plant = builder.finish().unwrap();
        let trunk = Trunk::of(&plant, &plant.pose());
        let layout = Impostor { frames: 8, centre: Vec3::Y * 4.0, radius: 6.0, reach: 4.0, height: 4.0 };
        for frame in [(0, 0), (7, 0), (0, 7), (7, 7)] {
            let mut mesh = Mesh::default();
            layout.add(frame, (Vec2::splat(-1.0), Vec2::splat(1.0)), &trunk, 0, &mut mesh);
            let corners = &mesh.positions;
            let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
            for height in [0.0, 3.0, 8.0] {
                let away = normal.dot(Vec3::new(1.0 + 0.25 * height, height, 0.125 * height) - corners[0]);
                assert!(away.abs() < 1.01 * APART * layout.radius, "{frame:?} {height}: {away}");
            }
        }
    }
}
