//! The stages of one tree: dressed, and every level of detail. Keyed by the content of what goes in, so that a tree is
//! made again only when it, its parameters or its pictures did change, whichever way they came about.

use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use super::cache::{Cache, Entry, Stage};
use super::sketches::Drawn;
use super::stages::{LeafPictures, Pictures, SourcePlant};
use super::wardrobe::Wardrobe;
use crate::bake::{self, Maps};
use crate::base::{Key, KeyBuilder, Note, Seed, once};
use crate::lod::{self, Colors, Footing, Ladder, Memory, Outlines, Piece, Reference, Rung, Stock, Texels};
use crate::mesh::{Mesh, TreeMesh, check_indices};
use crate::plant::Plant;
use crate::preset::Plan;
use crate::preset::plan::{AtlasParams, Lod, LodBudget, Variant};

/// The stages with their versions.
const DRESS: Stage = Stage("dress", 20);
const SKETCH: Stage = Stage("sketch", 20);
const LADDER: Stage = Stage("ladder", 61);
/// One level; kept in memory only, for edits of one of several.
const LEVEL: Stage = Stage("level", 55);
/// Where one takes over, likewise.
const FOOTING: Stage = Stage("footing", 16);
/// What colours it has there, likewise.
const COLORS: Stage = Stage("colors", 12);
/// What levels are measured with; kept in memory only.
const OUTLINES: Stage = Stage("outlines", 12);
const REFERENCE: Stage = Stage("reference", 15);
/// Pictures that are ready to be drawn; kept in memory only.
const STOCK: Stage = Stage("stock", 9);

/// Share of an atlas that pictures and their gutters are reckoned to fill.
const FILLED: f64 = 0.93;
/// The same where room is only to be used up.
const USED: f64 = 0.86;
/// Largest edge of an atlas.
const LARGEST: u32 = 8192;

/// A tree of a set.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// With leaves.
    pub(super) plant: Arc<Plant>,
    /// How like its sketch the crown is, 0..=1: of one that is sketched.
    pub(super) likeness: Option<f32>,
    /// Which share of its foliage a sketch would have had wilt and may not, 0..=1.
    pub(super) spared: f32,
    /// Its levels of detail.
    pub(super) ladder: Arc<Ladder>,
    /// The key of those.
    pub(super) key: Key,
    /// The key of all that they are made from, whatever levels are asked for.
    pub(super) of: Key,
}

/// What all trees of a set share.
pub(super) struct Trees<'a> {
    plan: &'a Plan,
    wardrobe: &'a Wardrobe,
    /// All of the wardrobe's pictures but their colours, and how fine pictures are drawn, once somebody asks.
    looks: OnceLock<(Key, Texels)>,
    /// The same, ready to be drawn; made when a ladder is.
    stock: OnceLock<Arc<Stock>>,
    cache: &'a Cache,
    sketches: &'a [Drawn],
}

impl<'a> Trees<'a> {
    pub(super) fn new(plan: &'a Plan, wardrobe: &'a Wardrobe, cache: &'a Cache, sketches: &'a [Drawn]) -> Self {
        Self { plan, wardrobe, looks: OnceLock::new(), stock: OnceLock::new(), cache, sketches }
    }

    /// A variant with leaves.
    pub(super) fn dressed(&self, variant: &Variant, bare: Plant, seed: Seed) -> Arc<Plant> {
        let Some(dressing) = self.wardrobe.dressing(self.plan, variant) else { return Arc::new(bare) };
        let key = DRESS.key().input(content(&bare)).params(&dressing).number(seed.bits()).finish();
        self.made(DRESS, key, || dressing.dress(bare, seed))
    }

    /// A variant with leaves, its crown as a sketch has it where there is one, how like that it is, and which share of its
    /// foliage would have wilted and may not.
    pub(super) fn shaped(&self, variant: &Variant, dressed: Arc<Plant>) -> (Arc<Plant>, Option<f32>, f32) {
        let Variant::Sketched { sketch, .. } = variant else { return (dressed, None, 0.0) };
        let drawn = &self.sketches[*sketch];
        let params = self.plan.sketches[*sketch].told();
        let key = SKETCH.key().input(content(&*dressed)).params(&params).input(drawn.key).finish();
        let made = self.made(SKETCH, key, || match drawn.sketched(&dressed) {
            Some(sketched) => {
                Shaped { plant: Arc::new(sketched.at(1.0)), likeness: sketched.likeness(), spared: sketched.spared() }
            }
            None => Shaped { plant: dressed, likeness: None, spared: 0.0 },
        });
        (Arc::clone(&made.plant), made.likeness, made.spared)
    }

    /// A variant with leaves, and every level of it.
    pub(super) fn levels(&self, (plant, likeness, spared): (Arc<Plant>, Option<f32>, f32), seed: Seed) -> Tree {
        let (mesh, lods) = (&self.plan.mesh, &self.plan.lods);
        let content = content(&*plant);
        let (shapes, texels) =
            *once(&self.looks, || (self.wardrobe.pictures.shapes(), texels(self.plan, &self.wardrobe.pictures)));
        let tree = |stage: KeyBuilder| stage.input(content).input(shapes).params(mesh);
        let key = tree(LADDER.key()).params(lods).params(&texels).number(seed.bits()).finish();
        let of_tree = tree(LEVEL.key()).number(seed.bits()).finish();
        let made = self.made(LADDER, key, || {
            let stock = || &**once(&self.stock, || stock(self.plan, &self.wardrobe.pictures, self.cache));
            lod::ladder_by(&plant, mesh, lods, (&stock, texels), seed, &Known { cache: self.cache, of: of_tree })
        });
        Tree { plant, likeness, spared, ladder: made, key, of: of_tree }
    }

    fn made<T: Entry>(&self, stage: Stage, key: Key, make: impl FnOnce() -> T) -> Arc<T> {
        let made = self.cache.remember(stage, key, || Ok(make()));
        made.expect("what is made of sound parts never fails")
    }
}

/// What is known of a tree's levels, in memory.
struct Known<'a> {
    cache: &'a Cache,
    /// The key of the tree.
    of: Key,
}

impl Known<'_> {
    fn made<T: Send + Sync + 'static>(
        &self,
        key: KeyBuilder,
        weight: impl FnOnce(&T) -> usize,
        make: &mut dyn FnMut() -> T,
    ) -> Arc<T> {
        let made = self.cache.remember_here(key.input(self.of).finish(), weight, || Ok(make()));
        made.expect("what is made of sound parts never fails")
    }
}

impl Memory for Known<'_> {
    fn level(&self, rung: &Rung, make: &mut dyn FnMut() -> Piece) -> Arc<Piece> {
        self.made(LEVEL.key().params(rung), Piece::weight, make)
    }

    fn footing(&self, rung: &Rung, sizes: &[usize], make: &mut dyn FnMut() -> Footing) -> Footing {
        *self.made(FOOTING.key().params(rung).params(&sizes), |_| size_of::<Footing>(), make)
    }

    fn colors(&self, rung: &Rung, pixels: u32, make: &mut dyn FnMut() -> Colors) -> Colors {
        *self.made(COLORS.key().params(rung).number(pixels.into()), |_| size_of::<Colors>(), make)
    }

    fn outlines(&self, lines: u32, make: &mut dyn FnMut() -> Outlines) -> Arc<Outlines> {
        self.made(OUTLINES.key().number(lines.into()), Outlines::weight, make)
    }

    fn reference(&self, pixels: u32, make: &mut dyn FnMut() -> Reference) -> Arc<Reference> {
        self.made(REFERENCE.key().number(pixels.into()), Reference::weight, make)
    }
}

/// A set's pictures but their colours, ready to be drawn.
pub(super) fn stock(plan: &Plan, pictures: &Pictures, cache: &Cache) -> Arc<Stock> {
    let Pictures { leaves, bark } = pictures;
    let key = STOCK.key().input(pictures.shapes()).params(&plan.mesh.leaves).finish();
    let made = cache.remember_here(key, Stock::weight, || Ok(Stock::new(leaves, bark).cut(leaves, plan.mesh.leaves)));
    made.expect("what is made of sound parts never fails")
}

/// Says so where an atlas is so small that cards, quads or sheets of frames lose more than a quarter of their texels along an
/// edge: that costs more of their silhouettes than anything else.
pub(super) fn small_atlas(plan: &Plan, pictures: &Pictures) -> Option<Note> {
    let size = plan.atlas.size;
    let at = |size: u32| {
        let atlas = AtlasParams { size, ..plan.atlas.clone() };
        texels(&Plan { atlas, ..plan.clone() }, pictures)
    };
    let edge = |level: &Lod, texels: Texels| lod::pictures(level, texels).into_iter().map(|(_, edge)| edge).max();
    let (own, usual) = (at(size), Texels::all(lod::CARD_TEXELS));
    let share = |level: &Lod, texels| Some(f64::from(edge(level, texels)?) / f64::from(edge(level, usual)?));
    let is_enough = |level: &Lod, texels| share(level, texels).is_none_or(|share| share >= 0.75);
    let few: Vec<&Lod> = plan.lods.iter().map(|level| &level.lod).filter(|level| !is_enough(level, own)).collect();
    let mut larger = std::iter::successors(Some(size), |size| Some(size * 2)).take_while(|&size| size <= LARGEST);
    let better = larger.find(|&size| few.iter().all(|level| is_enough(level, at(size)))).unwrap_or(LARGEST);
    let one = |level: &&Lod| {
        let what = match level {
            Lod::CrossedQuads => "crossed quads",
            Lod::Impostor { .. } => "sheets of impostors",
            _ => "cards",
        };
        let [own, usual, there] = [own, usual, at(better)].map(|texels| edge(level, texels).unwrap_or(0));
        // Where there is room impostors get more than the usual, which is not what is missed here.
        let there = there.min(usual);
        (format!("{what} have {own} of {usual} texels along theirs"), there.to_string())
    };
    let (told, there): (Vec<String>, Vec<String>) = few.iter().map(one).unzip();
    if told.is_empty() || better == size {
        return None;
    }
    // Of wide gutters the pictures are what little is left between them.
    let gutter = plan.atlas.gutter;
    let is_wider = few.iter().filter_map(|level| edge(level, own)).any(|edge| edge < gutter);
    let or = if is_wider { format!(", and a smaller `gutter` than {gutter} leaves them more") } else { String::new() };
    let message = format!(
        "at {size} texels an edge, {}; `atlas: (size: {better})` would give them {}{or}",
        told.join(", and "),
        there.join(" and ")
    );
    Some(Note::new("atlas", message))
}

/// How fine pictures are drawn so that all of a set are likely to fit its atlas: drawn smaller they are sharper than scaled
/// when they are packed. Room that cards leave goes to impostors, which are seen coarsest of all, and makes them up
/// to twice as fine; cards gain nothing. All go by steps, so that one more variant seldom changes the others.
fn texels(plan: &Plan, pictures: &Pictures) -> Texels {
    let has_cards = plan.lods.iter().any(|level| matches!(level.lod, Lod::BillboardCloud { .. } | Lod::CrossedQuads));
    let edge = plan.atlas.size;
    let space = |texels: Texels| Space::of(plan, pictures, texels);
    let at = |eighths: u32| lod::CARD_TEXELS * eighths / 8;
    let cards =
        (1..=8).rev().map(at).find(|&texels| space(Texels::all(texels)).fits(FILLED, edge, edge)).unwrap_or(at(1));
    // Cards' atlas is not to be higher than it is anyway. What has no cards has thin twigs, or few leaves.
    let least = space(Texels::all(cards));
    let mut lower = (0..edge.ilog2()).map(|k| 1 << k);
    let height = lower.find(|&height| has_cards && least.fits(FILLED, edge, height)).unwrap_or(edge);
    let finer = [16, 14, 12, 10].map(|eighths| Texels { cards, impostors: at(eighths) });
    finer.into_iter().find(|&texels| space(texels).fits(USED, edge, height)).unwrap_or(Texels::all(cards))
}

/// What a set's pictures take of an atlas, about.
struct Space {
    /// Texels of all, gutters included.
    area: f64,
    /// Sizes of the large ones, leaf pictures and sheets of impostors: of large squares area tells little.
    large: Vec<(u32, u32)>,
    gutter: u32,
}

impl Space {
    fn of(plan: &Plan, pictures: &Pictures, texels: Texels) -> Self {
        let gutter = plan.atlas.gutter;
        let mut large: Vec<(u32, u32)> = pictures.leaves.iter().map(|maps| (maps.width, maps.height)).collect();
        let again = bake::echoes(&large, &plan.atlas);
        large.extend(large.clone().iter().cycle().take(again));
        let mut area: f64 = large.iter().map(|&size| cell(size, gutter)).sum();
        let count = plan.variants.len();
        for LodBudget { lod: level, .. } in &plan.lods {
            for (each, edge) in lod::pictures(level, texels) {
                area += cell((edge, edge), gutter) * f64::from(each) * count as f64;
                if matches!(level, Lod::Impostor { .. }) {
                    large.extend(std::iter::repeat_n((edge, edge), count));
                }
            }
        }
        Self { area, large, gutter }
    }

    /// Whether all are likely to fit an atlas of that size, of which they fill so much at most.
    fn fits(&self, filled: f64, width: u32, height: u32) -> bool {
        let params = AtlasParams { size: width, gutter: self.gutter };
        let has_places = |layout: bake::Layout| layout.scale == 1.0 && layout.height <= height;
        self.area <= f64::from(width) * f64::from(height) * filled
            && (self.large.is_empty() || bake::Layout::new(&self.large, &[], &params).is_ok_and(has_places))
    }
}

/// What a picture takes of an atlas.
pub(super) fn cell((width, height): (u32, u32), gutter: u32) -> f64 {
    let room = |texels: u32| f64::from(texels + gutter) + 4.0;
    room(width) * room(height)
}

/// The key of a value's content.
pub(super) fn content(value: &impl serde::Serialize) -> Key {
    Key::of_bytes(&postcard::to_stdvec(value).expect("plain data serializes"))
}

impl Entry for Plant {
    fn weight(&self) -> usize {
        self.all_points().len() * 16 + self.chains().len() * 40 + self.leaves().len() * 60
    }

    /// Reading one goes through the builder.
    fn is_sound(&self) -> bool {
        true
    }
}

/// A plant that was sketched.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Shaped {
    plant: Arc<Plant>,
    likeness: Option<f32>,
    spared: f32,
}

impl Entry for Shaped {
    fn weight(&self) -> usize {
        self.plant.weight()
    }

    fn is_sound(&self) -> bool {
        self.plant.is_sound()
    }
}

impl Entry for Ladder {
    fn weight(&self) -> usize {
        let meshes: usize = self.levels.iter().map(|level| mesh_weight(&level.mesh)).sum();
        meshes + self.tiles.iter().map(lod::Tile::weight).sum::<usize>()
    }

    fn is_sound(&self) -> bool {
        let meshes = self.levels.iter().flat_map(|level| [&level.mesh.bark, &level.mesh.leaf]);
        !self.levels.is_empty() && meshes.into_iter().all(is_even) && self.tiles.iter().all(lod::Tile::is_whole)
    }
}

impl Entry for SourcePlant {
    fn weight(&self) -> usize {
        self.plant.weight() + self.leaf_maps.iter().chain(&self.bark).map(weight).sum::<usize>()
    }

    fn is_sound(&self) -> bool {
        self.leaf_maps.iter().chain(&self.bark).all(is_whole)
    }
}

impl Pictures {
    /// The content of all pictures but their colours: what levels of detail and their places in the atlas hang on.
    pub(super) fn shapes(&self) -> Key {
        let keys = self.leaves.iter().chain([&self.bark]).map(|maps| {
            let alpha: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
            let size = u64::from(maps.width) << 32 | u64::from(maps.height);
            let arrays = [&alpha[..], maps.normal.as_flattened(), maps.orm.as_flattened()].map(Key::of_bytes);
            arrays.into_iter().fold(Key::stage("shape", 1).number(size), |key, array| key.input(array)).finish()
        });
        keys.fold(Key::stage("shapes", 1), |key, one| key.input(one)).finish()
    }
}

impl Entry for LeafPictures {
    fn weight(&self) -> usize {
        self.0.iter().map(weight).sum()
    }

    fn is_sound(&self) -> bool {
        !self.0.is_empty() && self.0.iter().all(is_whole)
    }
}

impl Entry for Maps {
    fn weight(&self) -> usize {
        weight(self)
    }

    fn is_sound(&self) -> bool {
        is_whole(self)
    }
}

pub(super) fn mesh_weight(tree: &TreeMesh) -> usize {
    [&tree.bark, &tree.leaf].map(|mesh| mesh.positions.len() * 64 + mesh.indices.len() * 4).iter().sum()
}

fn weight(maps: &Maps) -> usize {
    maps.color.len() * 10
}

/// Whether every map has a pixel for each place.
fn is_whole(maps: &Maps) -> bool {
    let pixels = maps.width as usize * maps.height as usize;
    pixels > 0 && [maps.color.len(), maps.normal.len(), maps.orm.len()] == [pixels; 3]
}

/// Whether a mesh's arrays go together.
fn is_even(mesh: &Mesh) -> bool {
    let count = mesh.positions.len();
    let all = [mesh.normals.len(), mesh.uvs.len(), mesh.occlusion.len()];
    let some = [mesh.tangents.len(), mesh.lightmap.len(), mesh.tiles.len(), mesh.chains.len()];
    all == [count; 3] && some.iter().all(|&len| len == 0 || len == count) && check_indices(&mesh.indices, count).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many trees with a leaf picture of 256 texels.
    fn set_of(trees: usize, lods: &str, size: u32) -> (Plan, Pictures) {
        const OAK: &str = "(height: 12.0, iterations: [(endpoints: Surface(k: 4, count: 300))])";
        let text = format!(
            "(sources: {{\"a\": Grow(species: \"oak.ron\", seed: 1)}}, variants: [Source(\"a\")], lods: {lods}, \
             atlas: (size: {size}))"
        );
        let loaded = crate::preset::load("set.ron", &text, &mut |_| Ok(OAK.to_owned()));
        let mut plan = loaded.unwrap_or_else(|found| panic!("{found:?}"));
        plan.variants = vec![plan.variants[0].clone(); trees];
        let maps = Maps {
            width: 256,
            height: 256,
            color: vec![[0; 4]; 256 * 256],
            normal: vec![[0; 3]; 256 * 256],
            orm: vec![[0; 3]; 256 * 256],
        };
        (plan, Pictures { leaves: vec![maps.clone()], bark: maps })
    }

    fn texels_of(trees: usize, lods: &str, size: u32) -> Texels {
        let (plan, pictures) = set_of(trees, lods, size);
        texels(&plan, &pictures)
    }

    #[test]
    fn pictures_that_an_atlas_leaves_few_texels_are_told() {
        let told = |trees, lods: &str, size| {
            let (plan, pictures) = set_of(trees, lods, size);
            small_atlas(&plan, &pictures).map_or_else(String::new, |note| note.message)
        };
        let clouds = "[Full, BillboardCloud(cards: 48), Impostor(frames: 8)]";
        let both = told(16, clouds, 1024);
        assert!(both.contains("cards have") && both.contains(", and sheets of impostors have"), "{both}");
        let impostors = told(16, "[Full, Impostor(frames: 8)]", 512);
        assert!(impostors.contains("sheets of impostors have"), "{impostors}");
        // What it advises is enough.
        assert!(!impostors.contains("gutter"), "{impostors}");
        let (mut plan, pictures) = set_of(4, "[Full, BillboardCloud(cards: 48)]", 512);
        plan.atlas.gutter = 32;
        let wide = small_atlas(&plan, &pictures).map_or_else(String::new, |note| note.message);
        assert!(wide.contains("a smaller `gutter` than 32"), "{wide}");
        let size = impostors.split("size: ").nth(1).and_then(|rest| rest.split(')').next()).expect("a size");
        assert_eq!(told(16, "[Full, Impostor(frames: 8)]", size.parse().expect("a number")), "");
        for (trees, lods) in [(1, clouds), (9, "[Full, Thinned(triangles: 0.4)]")] {
            assert_eq!(told(trees, lods, 2048), "");
        }
    }

    #[test]
    fn room_that_cards_leave_goes_to_impostors() {
        let clouds = "[Full, BillboardCloud(cards: 48), Impostor(frames: 8)]";
        let usual = lod::CARD_TEXELS;
        let of = |trees, size| texels_of(trees, clouds, size);
        // Two trees take half of an atlas that is half as high as it is wide.
        let two = of(2, 2048);
        assert!(two.cards == usual && two.impostors > usual, "{two:?}");
        // Sixteen need more than there is: all of theirs are drawn smaller, cards and sheets alike.
        let many = of(16, 2048);
        assert!(many.cards < usual && many.impostors == many.cards, "{many:?}");
        // Without cards it may be as high as it is wide.
        assert_eq!(texels_of(2, "[Full, Impostor(frames: 8)]", 2048), Texels { cards: usual, impostors: usual * 2 });
    }
}
