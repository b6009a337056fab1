//! The billboard cloud: leaves and thin wood on a few cards, thick wood as coarse tubes.
//!
//! Limbs stay tubes as long as they are wide enough to be seen, within a budget of triangles. Each leaf goes to a plane
//! ([`super::planes`]), thin wood to the one that is nearest; where leaves are too few to hide the wood
//! ([`Wood`]), planes are fitted to both. Each plane's content is baked to one card ([`super::bake_card`]). Every card has the same
//! texels a metre, and bends to its leaves ([`super::bent`]). What of a card is solid is settled by how the whole tree is
//! seen: texels grow where views lack something ([`super::lacks`]), then the gain of all alpha is found by comparing
//! coverage with the full level's, by secant steps.
//!
//! Measured on two oaks at equal sizes, mean IoU: flat cards 0.841, carved 0.861, and bent with planes that face as their
//! leaves do 0.868. Texels count most: eight limes lost 0.09 with 16 of them along a card's edge instead of 64, and 96 or 128
//! bring less than 0.01. Long steps of carving leave texels at their bounds, among which no gain chooses.

use std::ops::{Range, RangeInclusive};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::agree::Outlines;
use super::bake_card::{Card, Place};
use super::bent::{self, Bend};
use super::measure::{Wardrobe, bounds};
use super::packed::{self, Designed};
use super::planes::{self, Plane, Unit};
use super::secant::Secant;
use super::thin::append;
use super::tile::Tile;
use super::twigs::{Segment, thin_wood};
use crate::bake::{Cutout, Silhouette};
use crate::base::Seed;
use crate::mesh::{CrownLight, Mesh, NO_CHAIN, TreeMesh, TubeDetail, Wood};
use crate::plant::{LeafForm, Plant, Posed};
use crate::preset::plan::{Backs, MeshParams};

/// Mean edge of a card's picture, in texels: twelve trees of 48 cards with their gutters, crossed quads and leaf
/// pictures fill an atlas of 2048² at this size.
pub const CARD_TEXELS: u32 = 64;
/// Most triangles of a cloud's limbs.
const LIMBS: usize = 1100;
/// Radius of the thinnest limb that is a tube, as a share of the tree's height: about a quarter of a pixel wide where
/// the cloud takes over.
const VISIBLE: f32 = 0.0025;
/// Errors of its limbs, and of rougher ones where triangles are few, as shares of the tree's height; each has a side less.
const ERRORS: [f32; 4] = [0.006, 0.01, 0.02, 0.04];
/// How often the error of a bare tree's limbs is halved at most.
const FINER: u32 = 3;
/// Longest edge of a card's picture, in mean edges.
const LONGEST: u32 = 4;
/// Rounds of carving, every which view each looks at (ordered subsets: Hudson and Larkin 1994), and the first one's step.
const CARVINGS: usize = 5;
const SUBSETS: usize = 3;
const STEP: f32 = 1.5;
/// Rounds in search of the alpha's gain, and how far coverage may be off.
const ROUNDS: usize = 6;
const CLOSE: f32 = 0.012;
/// Gain that search starts from, and how coverage follows it: measured, carved cards cover too much once they are packed, and
/// most crowns end between 0.42 and 0.61, palms at 1.03.
const GAIN: f32 = 0.55;
const SLOPE: f32 = 0.52;
/// Slopes that are believed, and gains that are tried.
const SLOPES: RangeInclusive<f32> = 0.1..=2.0;
const GAINS: RangeInclusive<f32> = 0.3..=4.0;

/// Parameters of a cloud.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CloudParams {
    /// Most cards.
    pub cards: u32,
    /// Mean edge of a card's picture, texels.
    pub texels: u32,
    /// Of limbs and cards: cards bend to their leaves by as many cells as limbs leave triangles for, and limbs alone may have more.
    pub triangles: usize,
}

/// What all baked levels start from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    pub(super) plant: &'a Plant,
    pub(super) posed: &'a Posed,
    pub(super) params: &'a MeshParams,
    /// The full level, leaves in the order of `leaf_of`.
    pub(super) full: &'a TreeMesh,
    /// The leaf of each leaf triangle of the full level.
    pub(super) leaf_of: &'a [u32],
    pub(super) light: &'a CrownLight,
    /// Ready to be meshed at any detail.
    pub(super) wood: &'a Wood<'a>,
}

/// A cloud, or crossed quads: its mesh, its cards, and their alpha.
pub(super) struct Cloud {
    /// Tiles counted from the first on.
    pub(super) tree: TreeMesh,
    cards: Vec<Card>,
    /// Of each card as an atlas keeps it, once it is settled.
    alphas: Vec<Vec<u8>>,
}

/// Triangles that a cloud of so many cards has at most.
pub(super) fn most_triangles(cards: u32, backs: Backs) -> usize {
    LIMBS + bent::most_triangles(cards) * backs.sides()
}

/// A cloud as a level's mesh, tiles counted from `first_tile` on, its alpha yet to be settled.
pub(super) fn cloud(scene: &Scene<'_>, params: CloudParams, wardrobe: &Wardrobe, first_tile: u32, seed: Seed) -> Cloud {
    let thickest = scene.plant.all_radii().iter().fold(0.0_f32, |a, &r| a.max(r));
    let (low, high) = bounds(scene.full);
    // A bare tree is its limbs: they may take the triangles by which cards would bend.
    let budget = LIMBS + (params.triangles.saturating_sub(LIMBS) as f32 * scene.wood.bare) as usize;
    // Of a level with few triangles a third is for limbs, whatever the cards are: a crown without its trunk floats.
    let sides = scene.params.backs.sides();
    let budget =
        budget.min(params.triangles.saturating_sub(2 * params.cards as usize * sides).max(params.triangles / 3));
    let (mut bark, min_radius) = limbs(scene, (thickest, high.y - low.y), budget);
    // Cards stand for leaves of many limbs and bend with the whole tree: wood that swung on its own would leave them.
    bark.chains.fill(NO_CHAIN);
    let left = params.triangles.saturating_sub(bark.indices.len() / 3) / sides;
    let count = params.cards.min((left / 2) as u32).max(1);
    let cells = bent::cells(count, left);

    let (mut units, unit_of) = sprays(scene);
    let twigs = thin_wood((scene.plant, scene.posed, &scene.wood.shown), scene.light, min_radius);
    let leaves = units.len();
    if scene.wood.bare > 0.0 {
        units.extend(twigs.iter().map(|twig| twig.unit(scene.wood.bare)));
    }
    let (planes, homes) = planes::fit(&units, count as usize, seed);
    let contents = sort_out(scene, &planes, (&homes, &unit_of), (&twigs, &homes[leaves..]));
    let cards = bake(scene, (&planes, &contents), (&units, &homes), (params.texels, cells), wardrobe);
    Cloud::new(bark, cards, first_tile)
}

impl Cloud {
    /// Cards beside some wood.
    pub(super) fn new(bark: Mesh, cards: Vec<Card>, first_tile: u32) -> Self {
        let mut leaf = Mesh::default();
        for (k, card) in cards.iter().enumerate() {
            append(&mut leaf, &card.mesh, first_tile + k as u32);
        }
        Self { tree: TreeMesh { bark, leaf }, cards, alphas: Vec::new() }
    }

    /// Of wood that leaves nothing for cards: its triangles over those of the full level.
    pub(super) fn share_of_wood(&self, full: &TreeMesh) -> Option<f32> {
        let count = |tree: &TreeMesh| (tree.bark.indices.len() + tree.leaf.indices.len()) as f32;
        let is_wood = self.cards.is_empty() && !self.tree.bark.indices.is_empty();
        is_wood.then(|| count(&self.tree) / count(full).max(1.0))
    }

    /// Moves alpha to where the full tree is seen from all views and away from where it is not.
    pub(super) fn carve(&mut self, outlines: &Outlines, worn: &[&Cutout]) {
        for round in 0..CARVINGS {
            let own: Vec<Cutout> = self.cards.par_iter().map(|card| card.outline(1.0)).collect();
            let lacks = outlines.lacks((round % SUBSETS, SUBSETS), &self.tree, &among(worn, &own));
            let step = STEP / (1.0 + 0.5 * round as f32);
            self.cards.par_iter_mut().for_each(|card| card.adjust(&lacks, step));
        }
    }

    /// Sets the gain so that the whole tree covers what the full one does once its cards are packed, by secant steps: by rough
    /// drawings of some of the views until those say it does, then by all. `worn` are the cutouts of all tiles before its own.
    /// Gives back its outlines.
    pub(super) fn settle(&mut self, outlines: &Outlines, worn: &[&Cutout]) -> Vec<Silhouette> {
        let mut designed = Designed::default();
        let rounds = if self.cards.is_empty() { 1 } else { ROUNDS };
        let settled = Secant::new(SLOPE, SLOPES, GAINS).settle(
            GAIN,
            (rounds, CLOSE),
            |gain| {
                let alphas = Card::packed(&self.cards, gain, designed.with(gain));
                (Card::cutouts(&self.cards, &alphas), alphas)
            },
            |(own, _)| outlines.rough_ratio_of_some(&self.tree, &among(worn, own)) - 1.0,
            |(own, _)| {
                let drawn = outlines.draw(&self.tree, &among(worn, own));
                (outlines.ratio(&drawn) - 1.0, drawn)
            },
        );
        let ((_, alphas), drawn) = settled;
        self.alphas = alphas;
        drawn
    }

    /// Its outlines as it is.
    pub(super) fn draw(&self, outlines: &Outlines, worn: &[&Cutout]) -> Vec<Silhouette> {
        outlines.draw(&self.tree, &among(worn, &Card::cutouts(&self.cards, &self.alphas)))
    }

    /// The finished pictures.
    pub(super) fn tiles(&self) -> Vec<Tile> {
        self.cards.par_iter().zip(&self.alphas).map(|(card, alpha)| card.finish(alpha.clone())).collect()
    }
}

/// The cutouts of all tiles: those before the cards' own, and these.
fn among<'a>(worn: &[&'a Cutout], own: &'a [Cutout]) -> Vec<&'a Cutout> {
    worn.iter().copied().chain(own).collect()
}

/// Coarse tubes of the limbs that are wide enough to be seen, or as many as the budget holds, thickest first, and the
/// radius of the thinnest. What is left of the budget of a bare tree makes them rounder.
fn limbs(scene: &Scene<'_>, (thickest, height): (f32, f32), budget: usize) -> (Mesh, f32) {
    let with = |rough: u32, min_radius: f32, finer: u32| TubeDetail {
        sides: 6 - rough + 2 * finer,
        most_sides: if rough > 0 { 6 - rough } else { scene.params.most_sides },
        error: height * ERRORS[rough as usize] / (1 << finer) as f32,
        min_radius,
        ..TubeDetail::full(scene.params)
    };
    // Where triangles are so few that the trunk takes all of them, it is as rough as it must be.
    let is_enough = |rough: &u32| scene.wood.count(&with(*rough, thickest * 0.5, 0)) <= budget;
    let rough = (0..3).find(is_enough).unwrap_or(3);
    let at = |min_radius: f32, finer: u32| with(rough, min_radius, finer);
    let fits = |min_radius: f32, finer: u32| scene.wood.count(&at(min_radius, finer)) <= budget;
    // Limbs of a bare tree are seen down to the thinnest.
    let visible = VISIBLE * (1.0 - 0.9 * scene.wood.bare);
    let (mut thin, mut thick) = ((height * visible).min(thickest * 0.5), thickest * 0.5);
    if fits(thin, 0) {
        thick = thin;
    } else if !fits(thick, 0) {
        // A thicket of stems of one girth: as many as there is room for, and none where that is for none of them.
        (thin, thick) = (thick, thickest * 1.001);
    }
    for _ in 0..5 {
        let middle = (thin * thick).sqrt();
        if fits(middle, 0) {
            thick = middle;
        } else {
            thin = middle;
        }
    }
    let finest = if scene.wood.bare > 0.0 { FINER } else { 0 };
    let finer = (1..=finest).rev().find(|&finer| fits(thick, finer)).unwrap_or(0);
    (scene.wood.mesh(scene.light, &at(thick, finer)), thick)
}

/// A unit for each leaf, which is a spray of blades already, and for each quad of a frond, which no plane lies along; for each
/// of the full level's leaf triangles its unit.
fn sprays(scene: &Scene<'_>) -> (Vec<Unit>, Vec<u32>) {
    let (leaves, poses) = (scene.plant.leaves(), scene.posed.leaves(scene.plant));
    let mut order: Vec<usize> = (0..leaves.len()).collect();
    order.sort_by(|&a, &b| {
        let key = |i: usize| (leaves[i].chain, leaves[i].location);
        key(a).0.cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1)).then(a.cmp(&b))
    });
    let mut triangles = vec![0..0; leaves.len()];
    for (t, &leaf) in scene.leaf_of.iter().enumerate() {
        let own: &mut Range<usize> = &mut triangles[leaf as usize];
        *own = if own.end == 0 { t..t + 1 } else { own.start..t + 1 };
    }
    let mesh = &scene.full.leaf;
    let mut unit_of = vec![0_u32; scene.leaf_of.len()];
    let mut units: Vec<Unit> = Vec::with_capacity(leaves.len());
    for i in order {
        let (leaf, own) = (leaves[i], triangles[i].clone());
        if let LeafForm::Frond { .. } = leaf.form {
            for quad in own.step_by(2) {
                unit_of[quad..=quad + 1].fill(units.len() as u32);
                let corners: [Vec3; 6] = std::array::from_fn(|k| mesh.positions[mesh.indices[3 * quad + k] as usize]);
                let centre = corners.iter().sum::<Vec3>() / 6.0;
                let normal = corners.as_chunks::<3>().0.iter().map(|[a, b, c]| (b - a).cross(c - a)).sum::<Vec3>();
                let area = normal.length() * 0.5 + 1e-12;
                units.push(Unit { centre, way: normal.normalize_or(Vec3::Y), is_twig: false, area });
            }
            continue;
        }
        unit_of[own].fill(units.len() as u32);
        let (pose, area) = (poses[i], leaf.size * leaf.size * leaf.form.width() + 1e-12);
        let centre = pose.position + pose.frame.y * (leaf.size * 0.5);
        units.push(Unit { centre, way: pose.frame.z.normalize_or(Vec3::Y), is_twig: false, area });
    }
    (units, unit_of)
}

/// What each plane's card shows: leaves, and twigs, which go to the nearest where nothing is told of them.
fn sort_out(
    scene: &Scene<'_>,
    planes: &[Plane],
    (homes, unit_of): (&[usize], &[u32]),
    (twigs, twig_homes): (&[Segment], &[usize]),
) -> Vec<TreeMesh> {
    let mut contents = vec![TreeMesh::default(); planes.len()];
    if planes.is_empty() {
        return contents;
    }
    let mut corners: Vec<Vec<u32>> = vec![Vec::new(); planes.len()];
    for (triangle, &unit) in scene.full.leaf.indices.as_chunks::<3>().0.iter().zip(unit_of) {
        corners[homes[unit as usize]].extend_from_slice(triangle);
    }
    for (content, corners) in contents.iter_mut().zip(&corners) {
        content.leaf = part(&scene.full.leaf, corners);
    }
    let nearest = |twig: &Segment| {
        let (centre, mut best) = (twig.centre(), 0);
        for (k, plane) in planes.iter().enumerate() {
            if plane.distance(centre) < planes[best].distance(centre) {
                best = k;
            }
        }
        best
    };
    let home = |(i, twig): (usize, &Segment)| twig_homes.get(i).copied().unwrap_or_else(|| nearest(twig));
    let all: Vec<usize> = twigs.par_iter().enumerate().with_min_len(256).map(home).collect();
    for (twig, home) in twigs.iter().zip(all) {
        twig.add(&mut contents[home].bark, scene.params.bark_tile.max(1e-3));
    }
    contents
}

/// The triangles with the given corners as a mesh of their own.
fn part(mesh: &Mesh, corners: &[u32]) -> Mesh {
    let mut used: Vec<u32> = corners.to_vec();
    used.sort_unstable();
    used.dedup();
    let pick = |i: &u32| *i as usize;
    Mesh {
        positions: used.iter().map(|i| mesh.positions[pick(i)]).collect(),
        normals: used.iter().map(|i| mesh.normals[pick(i)]).collect(),
        uvs: used.iter().map(|i| mesh.uvs[pick(i)]).collect(),
        occlusion: used.iter().map(|i| mesh.occlusion[pick(i)]).collect(),
        tiles: used.iter().map(|i| mesh.tiles[pick(i)]).collect(),
        indices: corners.iter().map(|c| used.partition_point(|u| u < c) as u32).collect(),
        ..Mesh::default()
    }
}

/// Bakes all cards at one density of texels.
fn bake(
    scene: &Scene<'_>,
    (planes, contents): (&[Plane], &[TreeMesh]),
    (units, homes): (&[Unit], &[usize]),
    (texels, cells): (u32, usize),
    wardrobe: &Wardrobe,
) -> Vec<Card> {
    let places: Vec<Option<Place>> = planes
        .iter()
        .zip(contents)
        .map(|(plane, content)| {
            // Wood among leaves is seen where these are.
            let (leaf, wood) = (&content.leaf.positions, &content.bark.positions);
            let wood = if scene.wood.bare > 0.0 { wood.as_slice() } else { &[] };
            if leaf.is_empty() && wood.is_empty() {
                return None;
            }
            let points = || leaf.iter().chain(wood).copied();
            let centre = points().sum::<Vec3>() / points().count() as f32;
            let outward = plane.normal.dot(centre - scene.light.centre());
            let z = if outward < 0.0 { -plane.normal } else { plane.normal };
            let on = centre + plane.normal * (plane.offset - plane.normal.dot(centre));
            Place::around(z, on, points())
        })
        .collect();
    let area: f32 = places.iter().flatten().map(Place::area).sum();
    let count = places.iter().flatten().count();
    let texels = texels.clamp(8, 1024);
    let density = texels as f32 * (count as f32 / area.max(1e-12)).sqrt();
    let edge = |half: f32| packed::edge(((2.0 * half * density).ceil() as u32).clamp(4, texels * LONGEST));
    let mut leaves: Vec<Vec<(Vec2, f32, f32)>> = vec![Vec::new(); planes.len()];
    for (unit, &home) in units.iter().zip(homes) {
        if let Some(place) = &places[home] {
            let (at, height) = place.over(unit.centre);
            leaves[home].push((at, height, unit.area));
        }
    }
    places
        .par_iter()
        .zip(contents)
        .zip(&leaves)
        .filter_map(|((place, content), leaves)| {
            let place = place.as_ref()?;
            Card::bake(
                content,
                (place, &Bend::to(leaves, cells)),
                (edge(place.half.x), edge(place.half.y)),
                wardrobe,
                scene.light,
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Rotation;
    use crate::lod::ladder;
    use crate::lod::specimen::{climbed, on_trunk, plain};
    use crate::plant::{Leaf, PlantBuilder};
    use crate::preset::plan::{Lod, LodBudget};

    #[test]
    fn cards_bend_by_what_limbs_leave_of_half_the_level_above() {
        let cards = 6;
        let plant = on_trunk(Vec3::ZERO, (4.0, 0.15), (24, 6));
        let ladder = climbed(&plant, Lod::BillboardCloud { cards });
        let [full, cloud] = [0, 1].map(|i| &ladder.levels[i]);
        let limbs = cloud.mesh.bark.indices.len() / 3;
        // Less than what limbs may have in all, and far less than what they have here.
        assert!(full.triangles / 2 < LIMBS && limbs < full.triangles / 8, "{limbs} of {}", full.triangles);
        let (bent, flat) = (cloud.mesh.leaf.indices.len() / 3, cards as usize * 8);
        assert!(bent > flat && cloud.triangles <= full.triangles / 2, "{bent} of {}", full.triangles);
    }

    #[test]
    fn a_crown_keeps_its_trunk_however_few_triangles_there_are() {
        let plant = on_trunk(Vec3::ZERO, (4.0, 0.15), (24, 12));
        for most in [60, 120, 400] {
            let params = MeshParams { most, ..MeshParams::told(6, 0.01) };
            let lods = [Lod::Full, Lod::BillboardCloud { cards: 48 }].map(LodBudget::from);
            let maps = plain();
            let ladder = ladder(&plant, &params, &lods, std::slice::from_ref(&maps), &maps, Seed::new(1));
            let cloud = &ladder.levels[1];
            let [wood, cards] = [&cloud.mesh.bark, &cloud.mesh.leaf].map(|mesh| mesh.indices.len() / 3);
            assert!(
                wood > 0 && cards > 0 && wood + 2 * cards <= ladder.levels[0].triangles / 2 + 4,
                "{most}: {wood} {cards}"
            );
        }
    }

    #[test]
    fn fronds_go_to_cards_by_pieces_since_no_plane_lies_along_them() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.15, 0.1]);
        for i in 0..12 {
            let (sin, cos) = crate::base::math::sin_cos(i as f32 * 2.4);
            let out = Vec3::new(cos, 0.3 * (i % 3) as f32, sin).normalize();
            let side = out.cross(Vec3::Y).normalize();
            let orientation = Rotation::from_axes(side, out, side.cross(out));
            let form = LeafForm::Frond { width: 0.25, arch: 1.6, fold: 0.4 };
            builder.leaf(Leaf { form, ..Leaf::new(stem, 1.0, orientation, 1.6, 0) });
        }
        let cloud = &climbed(&builder.finish().unwrap(), Lod::BillboardCloud { cards: 32 }).levels[1];
        assert!(cloud.measured.iou > 0.75, "{}", cloud.measured.iou);
    }
}
