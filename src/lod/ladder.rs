//! The ladder: every level of a tree, and where each takes over.
//!
//! A level takes over at the largest of some sizes at which its silhouette agrees with the full tree's as well as its
//! kind must (IoU of silhouettes drawn at that very size); where it never does, where it agrees best. Sizes are shares of the
//! screen's height that the tree's height covers, on a screen of [`SCREEN`] lines.

use std::collections::BTreeMap;

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::cloud::{CARD_TEXELS, Cloud, CloudParams, Scene, cloud};
use super::crossed::crossed_quads;
use super::impostor::{Impostor, Views, impostor};
use super::measure::{Asked, Measured, Reference, Wardrobe};
use super::thin::thinned;
use crate::bake::{Maps, Picture, View};
use crate::base::Seed;
use crate::mesh::{CardShape, CrownLight, TreeMesh, TubeDetail, add_tangents, all_cards, leaf_cards_in, tubes_in};
use crate::plant::Plant;
use crate::preset::plan::{Lod, MeshParams};

/// Lines of the screen that sizes are measured on.
const SCREEN: f32 = 1080.0;
/// Where the last level is no longer drawn.
pub const CULL: f32 = 0.01;
/// Views of a measurement.
const VIEWS: u32 = 8;

/// A tree's levels of detail.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ladder {
    /// Finest first.
    pub levels: Vec<Level>,
    /// Pictures baked for this tree. A vertex of a leaf mesh whose tile is not below the number of leaf pictures wears
    /// `tiles[tile - leaf pictures]`.
    pub tiles: Vec<Maps>,
}

/// One level of detail.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// What it is.
    pub kind: Lod,
    /// Bark and leaves, with tangents.
    pub mesh: TreeMesh,
    /// Of both primitives.
    pub triangles: usize,
    /// Smallest height of the tree, as a share of the screen's, at which the level is still shown: below it the next
    /// takes over (`MSFT_screencoverage`); for the last level the point where it is culled. Falls from level to level.
    pub screen_coverage: f32,
    /// Against the full level, at the size at which it takes over; of an impostor as its shader shows it.
    pub measured: Measured,
    /// How the sheet of an impostor is laid out; it is the one tile of the level's mesh.
    pub impostor: Option<Impostor>,
}

/// Builds all levels of a dressed plant, with card pictures of [`CARD_TEXELS`].
///
/// `leaf_art` are the pictures by slot, `bark` the tiling bark. Pure, and the same on any number of threads. About 1 s on
/// one core for a tree of 20,000 leaves, most of it baking and measuring.
#[must_use]
pub fn ladder(plant: &Plant, mesh: &MeshParams, lods: &[Lod], leaf_art: &[Maps], bark: &Maps, seed: Seed) -> Ladder {
    ladder_with(plant, mesh, lods, leaf_art, bark, CARD_TEXELS, seed)
}

/// As [`ladder`], with a mean edge of the cards' pictures of `texels`, 8..=1024.
#[must_use]
pub fn ladder_with(
    plant: &Plant,
    mesh: &MeshParams,
    lods: &[Lod],
    leaf_art: &[Maps],
    bark: &Maps,
    texels: u32,
    seed: Seed,
) -> Ladder {
    let posed = plant.pose();
    let light = CrownLight::of(plant, &posed);
    let full = full_level(plant, &posed, &light, mesh);
    let leaf_of = leaf_of_triangles(plant, &posed);
    let scene = Scene { plant, posed: &posed, params: mesh, full: &full, leaf_of: &leaf_of, light: &light };
    let mut wardrobe = Wardrobe::new(leaf_art, bark);
    let mut references = References::default();
    let mut tiles: Vec<Maps> = Vec::new();
    let mut levels: Vec<Level> = Vec::with_capacity(lods.len());
    // Where the level before takes over.
    let mut above = 1.0_f32;
    for (i, lod) in lods.iter().enumerate() {
        let first_tile = (leaf_art.len() + tiles.len()) as u32;
        let mut layout = None;
        let (made, pictures, (size, measured)) = match *lod {
            Lod::Full => (full.clone(), Vec::new(), (1.0, Measured::same(SCREEN as u32))),
            Lod::Thinned { triangles } => {
                let at = |grown: f32| thinned(&scene, triangles, grown, seed.child("thin"));
                let mut made = at(1.0);
                // Fewer, larger leaves hide each other less or more: once more, by what is covered half way down.
                let sizes = sizes(lod, above);
                let reference = references.at(sizes[sizes.len() / 2], &full, &wardrobe);
                let covered = reference.coverage(&made, &wardrobe);
                if (covered - 1.0).abs() > 0.008 {
                    made = at((1.0 / covered.max(0.5)).clamp(0.85, 1.2));
                }
                let at = takes_over(lod, above, &full, &mut references, &wardrobe, |reference| {
                    reference.measure_from(&|_| made.clone(), &wardrobe, Asked::Silhouette)
                });
                let measured = references.at(at, &full, &wardrobe).measure(&made, &wardrobe);
                (made, Vec::new(), (at, measured))
            }
            Lod::BillboardCloud { cards } => {
                let params = CloudParams { cards, texels };
                let mut made = cloud(&scene, params, &wardrobe, first_tile, seed.child("cloud"));
                let with = |made: &Cloud| {
                    let mut dressed = wardrobe.clone();
                    dressed.leaves.extend(made.pictures());
                    dressed
                };
                let at = takes_over(lod, above, &full, &mut references, &wardrobe, |reference| {
                    made.settle(reference, &wardrobe);
                    reference.measure_from(&|_| made.tree.clone(), &with(&made), Asked::Silhouette)
                });
                let reference = references.at(at, &full, &wardrobe);
                made.settle(reference, &wardrobe);
                let measured = reference.measure(&made.tree, &with(&made));
                let tiles = made.tiles();
                (made.tree, tiles, (at, measured))
            }
            Lod::CrossedQuads => {
                let (made, pictures) = crossed_quads(&scene, texels, &wardrobe, first_tile);
                let mut dressed = wardrobe.clone();
                dressed.leaves.extend(pictures.iter().map(Picture::new));
                let at = takes_over(lod, above, &full, &mut references, &wardrobe, |reference| {
                    reference.measure_from(&|_| made.clone(), &dressed, Asked::Silhouette)
                });
                let measured = references.at(at, &full, &wardrobe).measure(&made, &dressed);
                (made, pictures, (at, measured))
            }
            Lod::Impostor { frames } => {
                let views = impostor(&scene, frames, &wardrobe, first_tile);
                layout = Some(views.layout);
                let (at, sheet, measured) = settled(&views, lod, above, &full, &mut references, &wardrobe);
                (views.tree, vec![sheet], (at, measured))
            }
        };
        wardrobe.leaves.extend(pictures.iter().map(Picture::new));
        tiles.extend(pictures);
        above = size;
        if i > 0 {
            levels[i - 1].screen_coverage = above;
        }
        let triangles = (made.bark.indices.len() + made.leaf.indices.len()) / 3;
        levels.push(Level {
            kind: lod.clone(),
            mesh: made,
            triangles,
            screen_coverage: CULL.min(above * 0.5),
            measured,
            impostor: layout,
        });
    }
    Ladder { levels, tiles }
}

/// The full level and, for each share of its triangles, a thinned one: no cards, nothing measured. For batches that are
/// made while somebody waits; a few milliseconds a tree.
#[must_use]
pub fn mesh_levels(plant: &Plant, mesh: &MeshParams, shares: &[f32], seed: Seed) -> Vec<TreeMesh> {
    let posed = plant.pose();
    let light = CrownLight::of(plant, &posed);
    let full = full_level(plant, &posed, &light, mesh);
    let scene = Scene { plant, posed: &posed, params: mesh, full: &full, leaf_of: &[], light: &light };
    let coarse: Vec<TreeMesh> = shares.iter().map(|&share| thinned(&scene, share, 1.0, seed.child("thin"))).collect();
    let mut levels = vec![full];
    levels.extend(coarse);
    levels
}

/// The finest mesh.
fn full_level(plant: &Plant, posed: &crate::plant::Posed, light: &CrownLight, params: &MeshParams) -> TreeMesh {
    let mut bark = tubes_in(plant, posed, light, &TubeDetail::full(params));
    let mut leaf = leaf_cards_in(plant, posed, light, &all_cards(plant), CardShape::Folded);
    // An error only says that a mesh has no triangles to take tangents from.
    let _ = add_tangents(&mut bark);
    let _ = add_tangents(&mut leaf);
    TreeMesh { bark, leaf }
}

/// The leaf of each triangle of the full level: `leaf_cards` leaves out what rounding would crush, and makes two or
/// four of every other.
fn leaf_of_triangles(plant: &Plant, posed: &crate::plant::Posed) -> Vec<u32> {
    let least = posed.positions().iter().fold(0.0_f32, |a, p| a.max(p.abs().max_element())) * 1e-5;
    let shown = |(_, leaf): &(usize, &crate::plant::Leaf)| leaf.size > least;
    plant
        .leaves()
        .iter()
        .enumerate()
        .filter(shown)
        .flat_map(|(i, leaf)| std::iter::repeat_n(i as u32, CardShape::Folded.of(leaf).triangles()))
        .collect()
}

/// The full tree at the sizes that were asked for so far.
#[derive(Default)]
struct References {
    drawn: BTreeMap<u32, Reference>,
}

impl References {
    fn at(&mut self, size: f32, full: &TreeMesh, wardrobe: &Wardrobe) -> &Reference {
        let pixels = (size * SCREEN + 0.5) as u32;
        self.drawn.entry(pixels).or_insert_with(|| Reference::new(full, wardrobe, pixels, VIEWS))
    }
}

/// The sizes at which a level may take over, falling, all below where the one before did.
fn sizes(lod: &Lod, above: f32) -> Vec<f32> {
    let all: &[f32] = match lod {
        Lod::Full => &[1.0],
        Lod::Thinned { .. } => &[0.25, 0.16, 0.11],
        Lod::BillboardCloud { .. } => &[0.09, 0.065, 0.045],
        Lod::CrossedQuads | Lod::Impostor { .. } => &[0.037, 0.03, 0.024],
    };
    let below: Vec<f32> = all.iter().copied().filter(|s| *s < above * 0.9).collect();
    if below.is_empty() { vec![above * 0.75] } else { below }
}

/// Where an impostor takes over, its sheet with as much alpha as the full tree covers there, and what was measured.
fn settled(
    views: &Views,
    lod: &Lod,
    above: f32,
    full: &TreeMesh,
    references: &mut References,
    wardrobe: &Wardrobe,
) -> (f32, Maps, Measured) {
    let tile = wardrobe.leaves.len() as u32;
    let dressed = |sheet: &Maps| {
        let mut dressed = wardrobe.clone();
        dressed.leaves.push(Picture::new(sheet));
        dressed
    };
    let measure = |sheet: &Maps, reference: &Reference, asked: Asked| {
        let seen = |view: &View| TreeMesh {
            leaf: views.layout.seen_from(view.frame, sheet, (Vec2::ZERO, Vec2::ONE), tile),
            ..TreeMesh::default()
        };
        reference.measure_from(&seen, &dressed(sheet), asked)
    };
    let (mut gain, mut sheet) = (1.0_f32, views.sheet(1.0));
    let at = takes_over(lod, above, full, references, wardrobe, |reference| {
        let mut measured = measure(&sheet, reference, Asked::Silhouette);
        for _ in 0..3 {
            if (measured.coverage - 1.0).abs() < 0.01 {
                break;
            }
            // Texels that are moved hide each other.
            gain = (gain + (1.0 - measured.coverage) * 1.1).clamp(0.6, 1.8);
            sheet = views.sheet(gain);
            measured = measure(&sheet, reference, Asked::Silhouette);
        }
        measured
    });
    let measured = measure(&sheet, references.at(at, full, wardrobe), Asked::All);
    (at, sheet, measured)
}

/// By how much a level agrees better with the full one than it must to take over; negative where it does not. Views of the
/// ladder are few; the bounds leave a margin for those between them.
fn agrees(lod: &Lod, measured: &Measured) -> f32 {
    let (mean, worst) = if *lod == Lod::CrossedQuads { (0.8, 0.5) } else { (0.908, 0.862) };
    (measured.iou - mean).min(measured.worst_iou - worst)
}

/// The largest size at which a level and the full one agree well enough; where they never do, the one at which they agree
/// best: small pictures are not always more alike, since outlines are longer there for what they hold.
fn takes_over(
    lod: &Lod,
    above: f32,
    full: &TreeMesh,
    references: &mut References,
    wardrobe: &Wardrobe,
    mut measure: impl FnMut(&Reference) -> Measured,
) -> f32 {
    let mut best = (f32::NEG_INFINITY, above);
    for size in sizes(lod, above) {
        let better = agrees(lod, &measure(references.at(size, full, wardrobe)));
        if better > best.0 {
            best = (better, size);
        }
        if better >= 0.0 {
            break;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Rotation;
    use crate::plant::{Leaf, PlantBuilder};
    use crate::preset::plan::Forks;

    const PARAMS: MeshParams = MeshParams { sides: 12, error: 0.004, bark_tile: 1.0, forks: Forks::Collar };

    fn lods() -> Vec<Lod> {
        vec![Lod::Full, Lod::Thinned { triangles: 0.4 }, Lod::BillboardCloud { cards: 12 }, Lod::CrossedQuads]
    }

    /// A trunk with a ball of twigs and leaves.
    fn plant(leaves: u64) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0, Vec3::Y * 4.0], &[0.2, 0.15, 0.1]);
        for i in 0..40 {
            let seed = Seed::new(3).at(i);
            let way = seed.at(0).direction() * 1.4;
            let twig =
                builder.branch(stem, seed.at(1).range(0.6, 1.0), &[Vec3::ZERO, way * 0.5, way], &[0.03, 0.02, 0.01]);
            for k in 0..leaves / 40 {
                let seed = seed.at(10 + k);
                let orientation = Rotation::about(seed.at(0).direction(), seed.at(1).range(0.0, 6.0));
                builder.leaf(Leaf::new(twig, seed.at(2).unit(), orientation, 0.3, 0));
            }
        }
        builder.finish().unwrap()
    }

    fn maps(alpha: u8) -> Maps {
        Maps {
            width: 16,
            height: 16,
            color: vec![[60, 110, 30, alpha]; 256],
            normal: vec![[128, 128, 255]; 256],
            orm: vec![[255, 200, 0]; 256],
        }
    }

    fn build(plant: &Plant) -> Ladder {
        ladder_with(plant, &PARAMS, &lods(), &[maps(255)], &maps(255), 32, Seed::new(5))
    }

    #[test]
    fn every_level_is_sound_cheaper_and_takes_over_further_away() {
        let ladder = build(&plant(800));
        assert_eq!(ladder.levels.iter().map(|l| l.kind.clone()).collect::<Vec<_>>(), lods());
        for pair in ladder.levels.windows(2) {
            assert!(pair[1].triangles < pair[0].triangles && pair[1].screen_coverage < pair[0].screen_coverage);
        }
        for level in &ladder.levels {
            for mesh in [&level.mesh.bark, &level.mesh.leaf] {
                assert!(crate::mesh::problems(mesh).is_empty(), "{:?} {:?}", level.kind, crate::mesh::problems(mesh));
            }
            assert!(level.mesh.leaf.tiles.iter().all(|t| (*t as usize) < 1 + ladder.tiles.len()));
        }
        assert!(ladder.levels[2].mesh.leaf.indices.len() / 3 <= 12 * 6);
        assert!(ladder.levels[3].triangles <= 12);
    }

    #[test]
    fn thinning_hits_its_budget_and_the_cloud_keeps_the_silhouette() {
        let ladder = build(&plant(2000));
        let share = ladder.levels[1].triangles as f32 / ladder.levels[0].triangles as f32;
        assert!((share - 0.4).abs() < 0.02, "{share}");
        let cloud = ladder.levels[2].measured;
        assert!(cloud.iou > 0.85 && (cloud.coverage - 1.0).abs() < 0.05, "{cloud:?}");
    }

    #[test]
    fn the_ladder_is_the_same_on_one_thread_and_on_many() {
        let plant = plant(400);
        let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        assert_eq!(pool(1).install(|| build(&plant)), pool(3).install(|| build(&plant)));
    }

    #[test]
    fn a_bare_plant_and_missing_pictures_are_answered() {
        let bare = plant(0);
        assert_eq!(build(&bare).levels.len(), 4);
        let none = ladder_with(&plant(40), &PARAMS, &lods(), &[], &maps(0), 32, Seed::new(5));
        assert_eq!(none.levels.len(), 4);
    }
}
