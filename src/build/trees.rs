//! The stages of one tree: dressed, and every level of detail. Keyed by the content of what goes in, so that a tree is
//! made again only when it, its parameters or its pictures did change, whichever way they came about.

use std::sync::{Arc, OnceLock};

use super::cache::{Cache, Entry, Stage};
use super::sketches::Drawn;
use super::stages::{LeafPictures, Pictures, SourcePlant, Wardrobe};
use crate::bake::{self, Maps};
use crate::base::{Key, KeyBuilder, Note, Seed};
use crate::lod::{self, Ladder, Memory, Outlines, Piece, Reference, Rung, Stock};
use crate::mesh::{Mesh, TreeMesh, check_indices};
use crate::plant::Plant;
use crate::preset::Plan;
use crate::preset::plan::{AtlasParams, Lod, Variant};

/// The stages with their versions.
const DRESS: Stage = Stage("dress", 3);
const SKETCH: Stage = Stage("sketch", 3);
const LADDER: Stage = Stage("ladder", 16);
/// One level; kept in memory only, for edits of one of several.
const LEVEL: Stage = Stage("level", 11);
/// What levels are measured with; kept in memory only.
const OUTLINES: Stage = Stage("outlines", 1);
const REFERENCE: Stage = Stage("reference", 1);
/// Pictures that are ready to be drawn; kept in memory only.
const STOCK: Stage = Stage("stock", 1);

/// Share of an atlas that pictures and their gutters are reckoned to fill.
const FILLED: f64 = 0.93;
/// Largest edge of an atlas.
const LARGEST: u32 = 8192;

/// A tree of a set.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// With leaves.
    pub(super) plant: Arc<Plant>,
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
    /// All of the wardrobe's pictures but their colours, and the mean edge of cards' pictures, once somebody asks.
    looks: OnceLock<(Key, u32)>,
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

    /// A variant with leaves, its crown as a sketch has it where there is one.
    pub(super) fn shaped(&self, variant: &Variant, dressed: Arc<Plant>) -> Arc<Plant> {
        let Variant::Sketched { sketch, .. } = variant else { return dressed };
        let drawn = &self.sketches[*sketch];
        let params = self.plan.sketches[*sketch].told();
        let key = SKETCH.key().input(content(&*dressed)).params(&params).input(drawn.key).finish();
        self.made(SKETCH, key, || drawn.sketched(&dressed).map_or_else(|| (*dressed).clone(), |s| s.at(1.0)))
    }

    /// A variant with leaves, and every level of it.
    pub(super) fn levels(&self, plant: Arc<Plant>, seed: Seed) -> Tree {
        let (mesh, lods) = (&self.plan.mesh, &self.plan.lods);
        let content = content(&*plant);
        let (shapes, edge) =
            *once(&self.looks, || (self.wardrobe.pictures.shapes(), texels(self.plan, &self.wardrobe.pictures)));
        let tree = |stage: KeyBuilder| stage.input(content).input(shapes).params(mesh);
        let key = tree(LADDER.key()).params(lods).number(u64::from(edge)).number(seed.bits()).finish();
        let of_tree = tree(LEVEL.key()).number(seed.bits()).finish();
        let made = self.made(LADDER, key, || {
            let stock = || &**once(&self.stock, || stock(self.plan, &self.wardrobe.pictures, self.cache));
            lod::ladder_by(&plant, mesh, lods, (&stock, edge), seed, &Known { cache: self.cache, of: of_tree })
        });
        Tree { plant, ladder: made, key, of: of_tree }
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

/// What a cell holds, made where it holds nothing yet, by all who come at the same time. `get_or_init` would hang: a thread
/// that makes it in parallel may take over the work of another who waits for it.
pub(super) fn once<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    if let Some(held) = cell.get() {
        return held;
    }
    let made = make();
    cell.get_or_init(|| made)
}

/// Says so where an atlas is so small that cards lose more than a quarter of their texels along an edge: that costs more of
/// a cloud's silhouette than anything else.
pub(super) fn small_atlas(plan: &Plan, pictures: &Pictures) -> Option<Note> {
    let has_cards = plan.lods.iter().any(|lod| matches!(lod, Lod::BillboardCloud { .. }));
    let size = plan.atlas.size;
    let at = |size: u32| {
        let atlas = AtlasParams { size, ..plan.atlas.clone() };
        texels(&Plan { atlas, ..plan.clone() }, pictures)
    };
    let (own, usual) = (at(size), lod::CARD_TEXELS);
    let is_enough = |texels: u32| texels * 4 >= usual * 3;
    if !has_cards || is_enough(own) {
        return None;
    }
    let mut larger = std::iter::successors(Some(size), |size| Some(size * 2)).take_while(|&size| size <= LARGEST);
    let better = larger.find(|&size| is_enough(at(size)))?;
    let message = format!(
        "at {size} texels an edge, cards have {own} of {usual} texels along theirs; `atlas: (size: {better})` would give \
         them {}",
        at(better)
    );
    Some(Note { about: "atlas".to_owned(), message })
}

/// The mean edge of the cards' pictures with which all of a set are likely to fit its atlas: pictures that are drawn
/// smaller are sharper than those that are scaled when they are packed. In eighths of the usual, so that one more variant
/// seldom changes the others. Up to twice the usual where impostors are all that wants room: thin twigs need it, and cards
/// gain nothing.
fn texels(plan: &Plan, pictures: &Pictures) -> u32 {
    let cell = |edge: f64| {
        let edge = edge + f64::from(plan.atlas.gutter) + 4.0;
        edge * edge
    };
    let art: f64 = pictures
        .leaves
        .iter()
        .map(|maps| cell(f64::from(maps.width)) * f64::from(maps.height) / f64::from(maps.width.max(1)))
        .sum();
    let tree = |texels: u32| -> f64 {
        let of = |level: &Lod| {
            lod::pictures(level, texels)
                .into_iter()
                .map(|(count, edge)| f64::from(count) * cell(f64::from(edge)))
                .sum::<f64>()
        };
        plan.lods.iter().map(of).sum()
    };
    let room = f64::from(plan.atlas.size) * f64::from(plan.atlas.size) * FILLED - art;
    let finest =
        if plan.lods.iter().any(|lod| matches!(lod, Lod::BillboardCloud { .. } | Lod::CrossedQuads)) { 8 } else { 16 };
    let steps = (2..=finest).rev().map(|eighths| lod::CARD_TEXELS * eighths / 8);
    let fits =
        |texels: &u32| tree(*texels) * plan.variants.len() as f64 <= room && squares_fit(plan, pictures, *texels);
    steps.clone().find(fits).unwrap_or(lod::CARD_TEXELS / 4)
}

/// Whether the leaf pictures and the sheets of all variants have places: of large squares area tells little.
fn squares_fit(plan: &Plan, pictures: &Pictures, texels: u32) -> bool {
    let sheets = plan.lods.iter().filter(|lod| matches!(lod, Lod::Impostor { .. }));
    let edges: Vec<u32> = sheets.flat_map(|lod| lod::pictures(lod, texels)).map(|(_, edge)| edge).collect();
    let mut sizes: Vec<(u32, u32)> = pictures.leaves.iter().map(|maps| (maps.width, maps.height)).collect();
    sizes.extend(edges.iter().flat_map(|&edge| std::iter::repeat_n((edge, edge), plan.variants.len())));
    sizes.is_empty() || bake::Layout::new(&sizes, &[], &plan.atlas).is_ok_and(|layout| layout.scale == 1.0)
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
