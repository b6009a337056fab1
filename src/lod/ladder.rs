//! The ladder: every level of a tree, and where each takes over.
//!
//! A level takes over at the largest of some sizes at which its silhouette agrees with the full tree's as well as its
//! kind must (IoU of silhouettes at that very size); where it never does, where it agrees best; or where the preset tells it
//! to. Sizes are shares of the screen's height that the tree's height covers, on a screen of [`SCREEN`] lines.
//!
//! Nothing here hangs on colours: shapes, thinning, thresholds and alpha are those of outlines, the colours of tiles are
//! recipes ([`Tile`]), and the differences in colour that are told (FLIP, mean colour) are those of a tree in plain
//! colours, of a few of the views. So a new tint leaves a ladder as it is.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::bench::Bench;
use super::bounded::{Bounded, bounded};
use super::cloud::{CARD_TEXELS, Scene, most_triangles};
use super::impostor::Impostor;
use super::measure::{Measured, bounds};
use super::memory::{Colors, Footing, Forgetful, Memory, Piece, Rung};
use super::sizes::{COARSE, SCREEN, Sizes, dissolves, flatness, sizes};
use super::stock::Stock;
use super::thin::thinned;
use super::tile::Tile;
use crate::bake::{Maps, PictureKind};
use crate::base::{Seed, once};
use crate::mesh::{Cards, CrownLight, Mesh, TreeMesh, TubeDetail, Wood, all_cards, leaf_cards_in, least_leaf};
use crate::plant::{Plant, Posed};
use crate::preset::plan::{ANY, Backs, LeafCards, Lod, LodBudget, MeshParams};

/// Where the last level is no longer drawn, of trees that are measured by their height: four pixels of 1080. At eleven, a hundredth,
/// trees were seen to go.
pub const CULL: f32 = 0.004;
/// A tree's levels of detail.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ladder {
    /// Finest first.
    pub levels: Vec<Level>,
    /// Pictures baked for this tree. A vertex of a leaf mesh whose tile is not below the number of leaf pictures wears
    /// `tiles[tile - leaf pictures]`.
    pub tiles: Vec<Tile>,
}

impl Ladder {
    /// What one of its tiles is of, where so many leaf pictures are.
    #[must_use]
    pub fn kind(&self, leaf_pictures: usize, tile: usize) -> PictureKind {
        let is_worn =
            |level: &Level| level.mesh.leaf.tiles.first().is_some_and(|&worn| worn as usize == leaf_pictures + tile);
        if self.levels.iter().any(|level| level.impostor.is_some() && is_worn(level)) {
            PictureKind::Frames
        } else {
            PictureKind::Card
        }
    }
}

/// One level of detail.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// What it is.
    pub kind: Lod,
    /// Bark and leaves, with tangents.
    pub mesh: TreeMesh,
    /// Of both primitives as they are written: of leaves whose backs are doubled twice as many as are in `mesh`.
    pub triangles: usize,
    /// Smallest height of the tree, as a share of the screen's, at which the level is still shown: below it the next
    /// takes over (`MSFT_screencoverage`); for the last level the point where it is culled. Falls from level to level.
    pub screen_coverage: f32,
    /// Against the full level, at the size at which it takes over; of an impostor as its shader shows it. Colours are
    /// those of a tree in plain colours.
    pub measured: Measured,
    /// The same of an impostor's crossed planes, as they are seen without its shader; outlines only.
    pub plain: Option<Measured>,
    /// How the sheet of an impostor is laid out; it is the one tile of the level's mesh.
    pub impostor: Option<Impostor>,
}

/// How fine the pictures of cards and of impostors are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Texels {
    /// Mean edge of cards' pictures, 8..=1024.
    pub cards: u32,
    /// Of impostors: as in a set whose cards have so many, 8..=1024.
    pub impostors: u32,
}

impl Texels {
    /// The same for both.
    #[must_use]
    pub const fn all(texels: u32) -> Self {
        Self { cards: texels, impostors: texels }
    }

    /// What a level hangs on: none of those without pictures.
    const fn of(self, level: &Lod) -> Option<u32> {
        match level {
            Lod::Full | Lod::Thinned { .. } => None,
            Lod::BillboardCloud { .. } | Lod::CrossedQuads => Some(self.cards),
            Lod::Impostor { .. } => Some(self.impostors),
        }
    }
}

/// How many pictures a level brings at so many texels, about, and their edges.
#[must_use]
pub fn pictures(level: &Lod, texels: Texels) -> Vec<(u32, u32)> {
    match *level {
        Lod::Full | Lod::Thinned { .. } => Vec::new(),
        Lod::BillboardCloud { cards } => vec![(cards, texels.cards)],
        Lod::CrossedQuads => vec![(2, texels.cards * super::crossed::EDGE)],
        Lod::Impostor { frames } => vec![(1, frames.clamp(2, 32) * super::impostor::texels(texels.impostors, frames))],
    }
}

/// Builds all levels of a dressed plant, with card pictures of [`CARD_TEXELS`].
///
/// `leaf_art` are the pictures by slot, `bark` the tiling bark. Pure, and the same on any number of threads.
#[must_use]
pub fn ladder(
    plant: &Plant,
    mesh: &MeshParams,
    lods: &[LodBudget],
    leaf_art: &[Maps],
    bark: &Maps,
    seed: Seed,
) -> Ladder {
    ladder_with(plant, mesh, lods, &Stock::new(leaf_art, bark), Texels::all(CARD_TEXELS), seed)
}

/// As [`ladder`], with pictures of so many texels.
#[must_use]
pub fn ladder_with(
    plant: &Plant,
    mesh: &MeshParams,
    lods: &[LodBudget],
    stock: &Stock,
    texels: Texels,
    seed: Seed,
) -> Ladder {
    ladder_by(plant, mesh, lods, (&|| stock, texels), seed, &Forgetful)
}

/// As [`ladder_with`], by somebody with a memory. The stock is asked for when a level is made.
#[must_use]
pub fn ladder_by<'s>(
    plant: &Plant,
    mesh: &MeshParams,
    lods: &[LodBudget],
    (stock, texels): (&(dyn Fn() -> &'s Stock + Sync), Texels),
    seed: Seed,
    memory: &dyn Memory,
) -> Ladder {
    let posed = plant.pose();
    let mesh = &mesh.on(posed.extent());
    let light = CrownLight::of(plant, &posed);
    // Only outlines are asked of the pictures yet.
    let cuts = if matches!(mesh.leaves, LeafCards::CutOut { .. }) { stock().cuts.as_slice() } else { &[] };
    let cards = Cards::of(mesh.leaves, cuts);
    let wood = OnceLock::new();
    let wood = || once(&wood, || Wood::of(plant, &posed, &TubeDetail::full(mesh)));
    let bound = (mesh.most < ANY).then(|| bounded((plant, &posed, &light), mesh, wood(), cards, seed)).flatten();
    let dressed = Dressed::of(plant, &posed, cards, bound.as_ref());
    let left = OnceLock::new();
    let wood = || bound.as_ref().map_or_else(wood, |bound| once(&left, || wood().only(bound.shown.clone())));
    let (plant, posed, cards) = (dressed.plant, &*dressed.posed, dressed.cards);
    let mut is_new = false;
    let full = memory.level(&Rung { lod: Lod::Full, texels: None, triangles: 0 }, &mut || {
        is_new = true;
        Piece::plain(full_level(&dressed, &light, (wood(), mesh)), Vec::new())
    });
    let flat = flatness(&full.mesh);
    let leaf_of = leaf_of_triangles(plant, posed, cards);
    let scene =
        || Scene { plant, posed, params: mesh, full: &full.mesh, leaf_of: &leaf_of, light: &light, wood: wood() };
    let bench = OnceLock::new();
    let bench = || once(&bench, || Bench::new((&full.mesh, flat), stock(), memory));
    let made = |lods: &[LodBudget]| {
        let mut above = usize::MAX;
        let one = |LodBudget { lod, .. }: &LodBudget| {
            let rung = Rung { lod: lod.clone(), texels: texels.of(lod), triangles: budget(lod, mesh.backs, above) };
            let piece = match lod {
                Lod::Full => Arc::clone(&full),
                _ => memory.level(&rung, &mut || bench().piece(&scene(), cards, &rung, seed)),
            };
            above = piece.triangles(lod.sides(mesh.backs));
            (rung, piece)
        };
        lods.iter().map(one).collect::<Vec<_>>()
    };
    // Of a new tree all is to be made: what is seen from afar hangs on no finer level, and fills the threads beside those.
    let (near, far) = lods.split_at(if is_new { first_far(lods) } else { lods.len() });
    let pieces = if near.is_empty() || far.is_empty() {
        made(lods)
    } else {
        bench().outlines(COARSE);
        let (near, far) = rayon::join(|| made(near), || made(far));
        near.into_iter().chain(far).collect()
    };
    let mut above = 1.0;
    let stand = |(i, (rung, piece)): (usize, &(Rung, Arc<Piece>))| {
        let footing = if rung.lod == Lod::Full {
            Footing { size: 1.0, measured: Measured::same(SCREEN as u32) }
        } else {
            let before = pieces[..i].last().filter(|(of, _)| rung.texels.is_some() && of.texels.is_none());
            let least = before.map_or(0.0, |(of, _)| dissolves(&of.lod, leaf_share(plant, &full.mesh)));
            let Sizes { measured, told } = sizes(&lods[i..], above, flat).at_least(least, (&rung.lod, flat));
            let found = memory.footing(rung, &measured, &mut || bench().takes_over(&rung.lod, &measured, &piece.drawn));
            Footing { size: told.unwrap_or(found.size), ..found }
        };
        above = footing.size;
        footing
    };
    let footings: Vec<Footing> = pieces.iter().enumerate().map(stand).collect();
    // Sizes hang on each other, colours don't.
    let shown = |((rung, piece), footing): (&(Rung, Arc<Piece>), &Footing)| {
        let pixels = footing.measured.pixels;
        match rung.lod {
            Lod::Full => Colors::of(&footing.measured, 1.0),
            _ => memory.colors(rung, pixels, &mut || bench().colors(piece, pixels)),
        }
    };
    let colors: Vec<Colors> = pieces.par_iter().with_max_len(1).zip(&footings).map(shown).collect();
    let mut climb = Climb { flat, tiles: Vec::new(), levels: Vec::new() };
    for (((rung, piece), footing), colors) in pieces.iter().zip(footings).zip(colors) {
        climb.add((&rung.lod, mesh.backs), piece, footing, colors);
    }
    Ladder { levels: climb.levels, tiles: climb.tiles }
}

/// The first of the levels at the end that hang on no other.
fn first_far(lods: &[LodBudget]) -> usize {
    let is_far = |level: &LodBudget| matches!(level.lod, Lod::CrossedQuads | Lod::Impostor { .. });
    lods.iter().rposition(|level| !is_far(level)).map_or(0, |last| last + 1)
}

/// The levels as far as they are made.
struct Climb {
    flat: f32,
    tiles: Vec<Tile>,
    levels: Vec<Level>,
}

impl Climb {
    fn add(&mut self, (lod, backs): (&Lod, Backs), piece: &Piece, Footing { size, measured }: Footing, colors: Colors) {
        let mut mesh = piece.mesh.clone();
        if !piece.tiles.is_empty() {
            // Tiles of levels before come first.
            mesh.leaf.tiles.iter_mut().for_each(|tile| *tile += self.tiles.len() as u32);
            let first = self.tiles.len();
            self.tiles.extend_from_slice(&piece.tiles);
            if colors.gain != 1.0 {
                self.tiles[first..].iter_mut().for_each(|tile| tile.recipe.brighten(colors.gain));
            }
        }
        if let Some(last) = self.levels.last_mut() {
            last.screen_coverage = size;
        }
        self.levels.push(Level {
            kind: lod.clone(),
            mesh,
            triangles: piece.triangles(lod.sides(backs)),
            screen_coverage: (CULL * self.flat).min(size * 0.5),
            measured: Measured { color: colors.color, flip: colors.flip, ..measured },
            plain: colors.plain,
            impostor: piece.impostor,
        });
    }
}

/// Triangles of a cloud: half of those of the level above, and no more than it can have.
fn budget(lod: &Lod, backs: Backs, triangles_above: usize) -> usize {
    let Lod::BillboardCloud { cards } = *lod else { return 0 };
    most_triangles(cards, backs).min(triangles_above / 2)
}

/// The full level and, for each share of its triangles, a thinned one: no cards, nothing measured. For batches that are
/// made while somebody waits; a few milliseconds a tree. Without pictures no leaf is cut out: those are on whole cards, if
/// [`mesh_levels_on`] is not told their outlines.
#[must_use]
pub fn mesh_levels(plant: &Plant, mesh: &MeshParams, shares: &[f32], seed: Seed) -> Vec<TreeMesh> {
    mesh_levels_on(plant, mesh, Cards::of(mesh.leaves, &[]), shares, seed)
}

/// As [`mesh_levels`], with leaves on these cards.
#[must_use]
pub fn mesh_levels_on(plant: &Plant, mesh: &MeshParams, cards: Cards<'_>, shares: &[f32], seed: Seed) -> Vec<TreeMesh> {
    let posed = plant.pose();
    let mesh = &mesh.on(posed.extent());
    let light = CrownLight::of(plant, &posed);
    let wood = Wood::of(plant, &posed, &TubeDetail::full(mesh));
    let bound = (mesh.most < ANY).then(|| bounded((plant, &posed, &light), mesh, &wood, cards, seed)).flatten();
    let dressed = Dressed::of(plant, &posed, cards, bound.as_ref());
    let full = full_level(&dressed, &light, (&wood, mesh));
    let Dressed { plant, posed, cards, .. } = &dressed;
    let wood = bound.as_ref().map_or_else(|| Cow::Borrowed(&wood), |bound| Cow::Owned(wood.only(bound.shown.clone())));
    let scene = Scene { plant, posed, params: mesh, full: &full, leaf_of: &[], light: &light, wood: &wood };
    let at = |&share: &f32| thinned(&scene, *cards, share.into(), 1.0, seed);
    let coarse: Vec<TreeMesh> = shares.iter().map(at).collect();
    let mut levels = vec![full];
    levels.extend(coarse);
    levels
}

/// What the full level shows: the plant, or as much of it as its triangles allow.
struct Dressed<'a> {
    plant: &'a Plant,
    posed: Cow<'a, Posed>,
    cards: Cards<'a>,
    /// Where there is a bound.
    bark: Option<&'a Mesh>,
}

impl<'a> Dressed<'a> {
    fn of(plant: &'a Plant, posed: &'a Posed, cards: Cards<'a>, bound: Option<&'a Bounded<'a>>) -> Self {
        match bound {
            Some(Bounded { plant, bark, cards, .. }) => {
                Self { plant, posed: Cow::Owned(plant.pose()), cards: *cards, bark: Some(bark) }
            }
            None => Self { plant, posed: Cow::Borrowed(posed), cards, bark: None },
        }
    }
}

/// How long most leaves' pictures are, as a share of the tree's height.
fn leaf_share(plant: &Plant, full: &TreeMesh) -> f32 {
    let (low, high) = bounds(full);
    let mut sizes: Vec<f32> = plant.leaves().iter().map(|leaf| leaf.size).collect();
    let middle = sizes.len() / 2;
    let usual = (!sizes.is_empty()).then(|| *sizes.select_nth_unstable_by(middle, f32::total_cmp).1);
    usual.unwrap_or(0.0) / (high.y - low.y).max(1e-3)
}

/// The finest mesh.
fn full_level(dressed: &Dressed<'_>, light: &CrownLight, (wood, params): (&Wood<'_>, &MeshParams)) -> TreeMesh {
    let Dressed { plant, posed, cards, bark } = dressed;
    let bark = || bark.map_or_else(|| wood.mesh(light, &TubeDetail::full(params)), Mesh::clone);
    let (bark, leaf) = rayon::join(bark, || leaf_cards_in(plant, posed, light, &all_cards(plant), *cards));
    TreeMesh { bark, leaf }
}

/// The leaf of each triangle of the full level: `leaf_cards` leaves out what rounding would crush.
fn leaf_of_triangles(plant: &Plant, posed: &Posed, cards: Cards<'_>) -> Vec<u32> {
    let least = least_leaf(posed);
    let shown = |(_, leaf): &(usize, &crate::plant::Leaf)| leaf.size > least && leaf.size.is_finite();
    plant
        .leaves()
        .iter()
        .enumerate()
        .filter(shown)
        .flat_map(|(i, leaf)| std::iter::repeat_n(i as u32, cards.triangles(leaf)))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use glam::{Vec2, Vec3};

    use super::*;
    use crate::bake::View;
    use crate::base::Rotation;
    use crate::lod::bench::{COLORED, VIEWS};
    use crate::lod::{Outlines, Reference};
    use crate::plant::{Leaf, PlantBuilder};

    const PARAMS: MeshParams = MeshParams::told(12, 0.004);

    fn lods() -> [Lod; 4] {
        [Lod::Full, Lod::thinned(0.4), Lod::BillboardCloud { cards: 12 }, Lod::CrossedQuads]
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

    fn build_with(plant: &Plant, stock: &Stock) -> Ladder {
        ladder_with(plant, &PARAMS, &lods().map(LodBudget::from), stock, Texels::all(32), Seed::new(5))
    }

    fn build(plant: &Plant) -> Ladder {
        build_with(plant, &Stock::new(&[maps(255)], &maps(255)))
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
        assert!(ladder.levels[2].mesh.leaf.indices.len() / 3 <= 12 * 50);
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

    /// Remembers levels, in the order in which they were made, and from how many views colours were asked for, by lines.
    #[derive(Default)]
    struct Known(Mutex<Vec<(Rung, Arc<Piece>)>>, Mutex<Vec<(u32, usize)>>);

    impl Memory for Known {
        fn level(&self, rung: &Rung, make: &mut dyn FnMut() -> Piece) -> Arc<Piece> {
            let known =
                || self.0.lock().unwrap().iter().find(|known| known.0 == *rung).map(|known| Arc::clone(&known.1));
            known().unwrap_or_else(|| {
                let made = Arc::new(make());
                self.0.lock().unwrap().push((rung.clone(), Arc::clone(&made)));
                made
            })
        }

        fn footing(&self, rung: &Rung, sizes: &[usize], make: &mut dyn FnMut() -> Footing) -> Footing {
            Forgetful.footing(rung, sizes, make)
        }

        fn colors(&self, rung: &Rung, pixels: u32, make: &mut dyn FnMut() -> Colors) -> Colors {
            Forgetful.colors(rung, pixels, make)
        }

        fn outlines(&self, lines: u32, make: &mut dyn FnMut() -> Outlines) -> Arc<Outlines> {
            Forgetful.outlines(lines, make)
        }

        fn reference(&self, pixels: u32, make: &mut dyn FnMut() -> Reference) -> Arc<Reference> {
            let made = Forgetful.reference(pixels, make);
            self.1.lock().unwrap().push((pixels, made.views()));
            made
        }
    }

    #[test]
    fn an_impostor_is_the_same_made_beside_finer_levels_or_after_them() {
        let (plant, stock) = (plant(400), Stock::new(&[maps(255)], &maps(255)));
        let lods = [Lod::Full, Lod::thinned(0.4), Lod::Impostor { frames: 4 }, Lod::Impostor { frames: 2 }];
        let lods = lods.map(LodBudget::from);
        let memory = Known::default();
        let build = || ladder_by(&plant, &PARAMS, &lods, (&|| &stock, Texels::all(32)), Seed::new(5), &memory);
        let beside = build();
        memory.0.lock().unwrap().truncate(1);
        assert_eq!(beside, build());
        let frames = beside.levels.iter().filter_map(|level| level.impostor.map(|layout| layout.frames));
        assert_eq!(frames.collect::<Vec<_>>(), [4, 2]);
    }

    #[test]
    fn another_budget_leaves_the_levels_below_as_they_are() {
        let (plant, stock) = (plant(2000), Stock::new(&[maps(255)], &maps(255)));
        let memory = Known::default();
        let build = |triangles: f32, memory: &dyn Memory| {
            let lods = [Lod::Full, Lod::thinned(triangles), Lod::CrossedQuads, Lod::Impostor { frames: 4 }];
            ladder_by(&plant, &PARAMS, &lods.map(LodBudget::from), (&|| &stock, Texels::all(32)), Seed::new(5), memory)
        };
        let before = build(0.6, &memory);
        let after = build(0.1, &memory);
        assert_eq!(memory.0.lock().unwrap().len(), 5, "one more level was made");
        assert_eq!(after, build(0.1, &Forgetful));
        assert_ne!(before.levels[1], after.levels[1]);
    }

    #[test]
    fn a_level_takes_over_where_the_preset_tells_it_to() {
        let (plant, stock) = (plant(800), Stock::new(&[maps(255)], &maps(255)));
        let memory = Known::default();
        let build = |screens: [Option<f32>; 4]| {
            let lods: Vec<LodBudget> =
                lods().into_iter().zip(screens).map(|(lod, screen)| LodBudget { lod, screen }).collect();
            ladder_by(&plant, &PARAMS, &lods, (&|| &stock, Texels::all(32)), Seed::new(5), &memory)
        };
        let found = build([None; 4]);
        let levels = memory.0.lock().unwrap().len();
        let told = build([None, Some(0.5), None, Some(0.11)]);
        assert_eq!(memory.0.lock().unwrap().len(), levels, "a level was made anew");
        let ends = |ladder: &Ladder| ladder.levels.iter().map(|level| level.screen_coverage).collect::<Vec<_>>();
        let (ends, found_ends) = (ends(&told), ends(&found));
        assert_eq!((ends[0], ends[2]), (0.5, 0.11));
        assert!(ends[1] < 0.5 && ends[1] > 0.11 && found_ends[0] < 0.5, "{ends:?}, {found_ends:?}");
        assert_eq!(told.levels[1].measured.pixels, 540);
        assert!(told.levels[1].measured.iou < found.levels[1].measured.iou);
        assert!(told.levels.iter().zip(&found.levels).all(|(a, b)| a.mesh == b.mesh));
    }

    #[test]
    fn colours_of_large_pictures_are_compared_from_one_view() {
        let (plant, stock, memory) = (plant(400), Stock::new(&[maps(255)], &maps(255)), Known::default());
        let lods = [(Lod::Full, None), (Lod::thinned(0.4), Some(0.25)), (Lod::CrossedQuads, Some(0.05))];
        let lods = lods.map(|(lod, screen)| LodBudget { lod, screen });
        let _ = ladder_by(&plant, &PARAMS, &lods, (&|| &stock, Texels::all(32)), Seed::new(5), &memory);
        let mut asked = std::mem::take(&mut *memory.1.lock().unwrap());
        asked.sort_unstable();
        assert_eq!(asked, [(54, 2), (270, 1)]);
    }

    #[test]
    fn an_impostor_is_as_bright_as_the_tree() {
        let stock = Stock::new(&[maps(255)], &maps(255));
        let lods = [Lod::Full, Lod::Impostor { frames: 6 }].map(LodBudget::from);
        let ladder = ladder_with(&plant(2000), &PARAMS, &lods, &stock, Texels::all(64), Seed::new(5));
        let level = &ladder.levels[1];
        let (layout, sheet) = (level.impostor.unwrap(), ladder.tiles[0].maps(&stock.palette));
        let full = &ladder.levels[0].mesh;
        let reference = Reference::some(full, &stock.wardrobe, level.measured.pixels, (VIEWS, &COLORED));
        let (gain, _) = reference.matched(&|view: &View| layout.as_seen(view.frame, &sheet, (Vec2::ZERO, Vec2::ONE)));
        assert!((gain - 1.0).abs() < 0.01, "{gain}");
    }

    #[test]
    fn a_bare_plant_and_missing_pictures_are_answered() {
        let bare = plant(0);
        for ladder in [build(&bare), build_with(&plant(40), &Stock::new(&[], &maps(0)))] {
            assert_eq!(ladder.levels.len(), 4);
            let shows = |level: &Level| level.mesh.bark.indices.len() + level.mesh.leaf.indices.len() > 0;
            assert!(ladder.levels.iter().all(shows) && ladder.tiles.iter().all(Tile::is_whole));
        }
    }
}
