//! The last stages: one atlas for all variants, then the files of the set.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cache::{Cache, Entry, Stage};
use super::clips::Clip;
use super::facts::Facts;
use super::record::{GENERATOR, manifest_name};
use super::sheet::{Sheet, facing};
use super::stages::Pictures;
use super::textures::texture_files;
use super::trees::{self, Tree};
use crate::bake::{self, Layout, Maps, Palette, Picked, PictureKind, Rect, SheetColors};
use crate::base::{Diagnostic, Key, Note, Seed, bulk};
use crate::export::{
    self, AssetEntry, AssetIn, AssetLevel, AtlasEntry, Colliders, FileEntry, ImpostorEntry, LevelEntry, LightmapEntry,
    MANIFEST_FORMAT, Manifest, MeasuredErrors, OutlineErrors, SetMaterials, TextureEntry, VariantEntry, WindEntry,
};
use crate::lod::{self, Level, Tile};
use crate::mesh::{Limbs, TreeMesh, Wind};
use crate::preset::Plan;
use crate::preset::plan::{Engine, Lod, Profile, WindData};

/// The stage that packs pictures, with its version.
const ATLAS: Stage = Stage("atlas", 13);
/// Those that are kept in memory only.
const PLACED: Stage = Stage("placed", 3);
const FILES: Stage = Stage("files", 5);
const COLORS: Stage = Stage("colors", 1);

/// Everything that the files of a set are made from.
pub(super) struct SetParts<'a> {
    /// Where encoded pictures are kept.
    pub(super) cache: &'a Cache,
    /// The plan.
    pub(super) plan: &'a Plan,
    /// The set's key.
    pub(super) key: Key,
    /// What each variant is, in words, and its own seed.
    pub(super) identities: &'a [(serde_json::Value, Seed)],
    /// The dressed variants and their levels, with coordinates in their own pictures.
    pub(super) trees: &'a [Tree],
    /// What is told of each tree.
    pub(super) facts: &'a [Arc<Facts>],
    /// What leaves and bark wear.
    pub(super) pictures: &'a Pictures,
    /// The animated files.
    pub(super) clips: &'a [Clip],
    /// The contact sheet before it has colours.
    pub(super) sheet: &'a Sheet,
    /// What was mended in the sources.
    pub(super) notes: &'a [Note],
}

/// An atlas without colours, whose alpha keeps its coverage in every mip.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Packed {
    /// Where pictures lie.
    pub(super) layout: Layout,
    #[serde(with = "bulk")]
    pub(super) alpha: Vec<u8>,
    #[serde(with = "bulk")]
    normal: Vec<[u8; 3]>,
    #[serde(with = "bulk")]
    orm: Vec<[u8; 3]>,
    /// The pictures, and what each is of.
    pub(super) shown: Vec<(Rect, PictureKind)>,
    /// Alpha coverage of its mips.
    coverage: Vec<f32>,
}

impl Entry for Packed {
    fn weight(&self) -> usize {
        self.alpha.len() * 7
    }

    fn is_sound(&self) -> bool {
        let texels = self.layout.width as usize * self.layout.height as usize;
        texels > 0 && [self.alpha.len(), self.normal.len(), self.orm.len()] == [texels; 3] && self.layout.is_sound()
    }
}

/// The atlas and the meshes of all variants with their coordinates in it.
pub(super) struct Placed {
    /// The atlas.
    pub(super) packed: Arc<Packed>,
    /// Its maps.
    maps: Maps,
    /// Colours of the baked pictures, by variant.
    colors: Vec<Arc<Colors>>,
    /// By variant and level.
    meshes: Vec<Arc<Unwrapped>>,
    /// By variant: what its meshes hang on.
    keys: Vec<Key>,
    /// What leaves let through, of 255.
    through: u8,
    /// By variant and level: where an impostor's sheet lies.
    impostors: Vec<Vec<Option<ImpostorEntry>>>,
}

/// The levels of a variant.
#[derive(Debug)]
struct Unwrapped {
    meshes: Vec<TreeMesh>,
    /// Largest edge that a light map's charts take, texels.
    lightmap: u32,
}

impl Placed {
    /// What is told of pictures that the atlas holds only smaller than their levels were measured with.
    pub(super) fn scaled(&self, plan: &Plan) -> Option<Note> {
        // Never more than it is, and of a hair nobody is told.
        let scale = (self.packed.layout.scale * 100.0).floor() / 100.0;
        let message = format!(
            "{} texels an edge hold all pictures only at {scale:.2} of their size, and levels with cards or impostors are coarser \
             than the manifest tells, which is of the whole size; a larger `size` holds them, or fewer variants",
            plan.atlas.size
        );
        (scale < 0.99).then(|| Note::new("atlas", message))
    }

    /// What is told of light maps that have no room for their charts.
    pub(super) fn small_lightmap(&self, plan: &Plan) -> Option<Note> {
        let edges = self.meshes.iter().zip(1..).map(|(unwrapped, n)| (unwrapped.lightmap, n));
        let (edge, n) = edges.filter(|(edge, _)| *edge > plan.lightmap).max()?;
        let message = format!(
            "{} is of so many pieces that {} texels hold them only where they lie closer than two texels, and take \
             each other's light; ask for {}",
            plan.called(n),
            plan.lightmap,
            edge.next_power_of_two()
        );
        Some(Note::new("mesh.lightmap", message))
    }
}

/// What an atlas that does not hold all is told as.
fn does_not_fit(error: &dyn std::fmt::Display) -> Vec<Diagnostic> {
    let hint = "a larger atlas, fewer cards or fewer variants fit";
    vec![Diagnostic::new("", error.to_string()).with_field("atlas.size").with_hint(hint)]
}

/// Packs the pictures of leaves and of all baked cards, but for their colours.
fn packed(plan: &Plan, pictures: &Pictures, trees: &[Tree], cache: &Cache) -> Result<Arc<Packed>, Vec<Diagnostic>> {
    let key = ATLAS.key().input(pictures.shapes()).params(&plan.atlas);
    let key = trees.iter().fold(key, |key, tree| key.input(tree.key)).finish();
    cache.remember(ATLAS, key, || {
        let stock = trees::stock(plan, pictures, cache);
        let alphas = stock.alphas().iter().chain(tiles(trees).map(|tile| &tile.alpha));
        let clear: Vec<Vec<[u8; 4]>> = alphas.map(|alpha| alpha.iter().map(|&a| [0, 0, 0, a]).collect()).collect();
        let (of_leaves, of_tiles) = clear.split_at(pictures.leaves.len());
        let picked: Vec<Picked<'_>> = (pictures.leaves.iter().zip(of_leaves))
            .map(|(maps, color)| Picked { color, ..maps.into() })
            .chain(tiles(trees).zip(of_tiles).map(|(tile, color)| picked(tile, color)))
            .collect();
        let sizes: Vec<(u32, u32)> = picked.iter().map(|p| (p.width, p.height)).collect();
        let own = trees.iter().map(|tree| tree.ladder.tiles.len());
        let groups: Vec<usize> = std::iter::once(pictures.leaves.len()).chain(own).collect();
        let layout = Layout::new(&sizes, &groups, &plan.atlas).map_err(|e| does_not_fit(&e))?;
        let (relief, color) = rayon::join(|| layout.relief(&picked), || layout.color(&picked));
        let (normal, orm) = relief.map_err(|e| does_not_fit(&e))?;
        let mut alpha: Vec<u8> = color.map_err(|e| does_not_fit(&e))?.into_iter().map(|c| c[3]).collect();
        let leaves = pictures.leaves.iter().map(|_| PictureKind::Leaf);
        let baked = trees
            .iter()
            .flat_map(|tree| (0..tree.ladder.tiles.len()).map(|i| tree.ladder.kind(pictures.leaves.len(), i)));
        let shown: Vec<(Rect, PictureKind)> = layout.rects.iter().copied().zip(leaves.chain(baked)).collect();
        // Pictures that are made smaller have other mips, and so have those that begin at other texels than where their levels
        // were settled.
        let coverage = if layout.scale < 1.0 || plan.atlas.gutter != bake::GUTTER {
            bake::preserve_alpha(&mut alpha, layout.size(), &shown).after
        } else {
            bake::coverage_in(&alpha, layout.size(), &shown)
        };
        Ok(Packed { layout, alpha, normal, orm, shown, coverage })
    })
}

/// The baked pictures of all trees.
fn tiles(trees: &[Tree]) -> impl Iterator<Item = &Tile> {
    trees.iter().flat_map(|tree| &tree.ladder.tiles)
}

fn picked<'a>(tile: &'a Tile, color: &'a [[u8; 4]]) -> Picked<'a> {
    Picked { width: tile.width, height: tile.height, color, normal: &tile.normal, orm: &tile.orm }
}

/// The colours of a tree's baked pictures.
pub(super) struct Colors {
    /// Of each, one a texel.
    texels: Vec<Vec<[u8; 4]>>,
    /// As the contact sheet shows them.
    pub(super) sheet: Vec<SheetColors>,
}

impl Colors {
    fn of(tree: &Tree, shared: usize, palette: &Palette) -> Self {
        let texels: Vec<Vec<[u8; 4]>> = tree.ladder.tiles.par_iter().map(|tile| tile.color(palette)).collect();
        let sheet = |(i, (tile, color)): (usize, (&Tile, &Vec<[u8; 4]>))| match facing(&tree.ladder, shared, i) {
            Some(facing) => SheetColors::of(facing.size(), &facing.color(color, tile.width as usize)),
            None => SheetColors::of((tile.width, tile.height), color),
        };
        let sheet = tree.ladder.tiles.par_iter().zip(&texels).enumerate().map(sheet).collect();
        Self { texels, sheet }
    }

    fn weight(&self) -> usize {
        // With mips, of eight bytes a texel.
        self.texels.iter().map(|texels| texels.len() * (4 + 8 * 4 / 3)).sum()
    }
}

/// The atlas in its colours, and those of the baked pictures in it, by tree.
fn painted(
    packed: &Packed,
    pictures: &Pictures,
    trees: &[Tree],
    cache: &Cache,
) -> Result<(Maps, Vec<Arc<Colors>>), Vec<Diagnostic>> {
    let palette = lod::palette(&pictures.leaves, &pictures.bark);
    let worn = palette.key();
    let colors = trees.par_iter().map(|tree| {
        let key = COLORS.key().input(tree.key).input(worn).finish();
        cache.remember_here(key, Colors::weight, || Ok(Colors::of(tree, pictures.leaves.len(), &palette)))
    });
    let colors = colors.collect::<Result<Vec<_>, Vec<Diagnostic>>>()?;
    let texels = colors.iter().flat_map(|colors| &colors.texels);
    let picked: Vec<Picked<'_>> = (pictures.leaves.iter().map(Picked::from))
        .chain(tiles(trees).zip(texels).map(|(tile, color)| picked(tile, color)))
        .collect();
    let mut color = packed.layout.color(&picked).map_err(|e| does_not_fit(&e))?;
    color.iter_mut().zip(&packed.alpha).for_each(|(color, alpha)| color[3] = *alpha);
    let Layout { width, height, .. } = packed.layout;
    Ok((Maps { width, height, color, normal: packed.normal.clone(), orm: packed.orm.clone() }, colors))
}

/// Packs the atlas and encodes all textures, for the cache.
pub(super) fn textures(plan: &Plan, pictures: &Pictures, trees: &[Tree], cache: &Cache) -> Result<(), Vec<Diagnostic>> {
    let packed = packed(plan, pictures, trees, cache)?;
    let (maps, _) = painted(&packed, pictures, trees, cache)?;
    texture_files(plan, &pictures.bark, None, cache)?;
    texture_files(plan, &maps, Some(&packed.shown), cache).map(drop)
}

/// Packs the atlas, and moves every mesh's coordinates there.
pub(super) fn place(
    plan: &Plan,
    pictures: &Pictures,
    trees: &[Tree],
    cache: &Cache,
) -> Result<Placed, Vec<Diagnostic>> {
    let packed = packed(plan, pictures, trees, cache)?;
    let (maps, colors) = painted(&packed, pictures, trees, cache)?;
    let atlas = &packed.layout;
    let shared = pictures.leaves.len();
    // Where each variant's own pictures start, less the shared ones that its tiles count from.
    let starts: Vec<u32> = trees
        .iter()
        .scan(0, |next, tree| {
            let start = *next;
            *next += tree.ladder.tiles.len() as u32;
            Some(start)
        })
        .collect();
    let impostors = trees.iter().zip(&starts).map(|(tree, start)| sheets(tree, atlas, shared as u32, *start)).collect();
    let meshes = trees
        .par_iter()
        .zip(starts)
        .map(|(tree, start)| {
            let own = shared + start as usize..shared + start as usize + tree.ladder.tiles.len();
            let places = (atlas.size(), &atlas.rects[..shared], &atlas.rects[own]);
            let key = PLACED.key().input(tree.key).params(&places).number(u64::from(plan.lightmap)).finish();
            let weight = |made: &Unwrapped| made.meshes.iter().map(trees::mesh_weight).sum();
            let level = |level: &Level| {
                let mut mesh = level.mesh.clone();
                for tile in mesh.leaf.tiles.iter_mut().filter(|tile| **tile as usize >= shared) {
                    *tile += start;
                }
                atlas.place(&mut mesh.leaf).map_err(|e| does_not_fit(&e))?;
                let edge = unwrap_lightmap(plan, &mut mesh)?;
                if level.kind.sides(plan.mesh.backs) > 1 {
                    mesh.leaf.double();
                }
                Ok((mesh, edge))
            };
            let made = cache.remember_here(key, weight, || {
                let levels = tree.ladder.levels.iter().map(level).collect::<Result<Vec<_>, Vec<Diagnostic>>>()?;
                let lightmap = levels.iter().map(|level| level.1).max().unwrap_or(0);
                Ok(Unwrapped { meshes: levels.into_iter().map(|level| level.0).collect(), lightmap })
            })?;
            Ok((made, key))
        })
        .collect::<Result<Vec<_>, Vec<Diagnostic>>>()?;
    let (meshes, keys) = meshes.into_iter().unzip();
    let through = bake::mean_transmission(&pictures.leaves);
    Ok(Placed { packed, maps, colors, meshes, keys, through, impostors })
}

/// Where the sheets of a tree's impostors lie in the atlas, by level; `start` tiles of other trees come before its own.
fn sheets(tree: &Tree, atlas: &Layout, shared: u32, start: u32) -> Vec<Option<ImpostorEntry>> {
    let (width, height) = (atlas.width as f32, atlas.height as f32);
    let sheet = |level: &Level| {
        let layout = level.impostor?;
        let tile = *level.mesh.leaf.tiles.first()?;
        let rect = atlas.rects.get((tile + if tile >= shared { start } else { 0 }) as usize)?;
        Some(ImpostorEntry {
            layout: "hemi-octahedral".to_owned(),
            frames: layout.frames,
            centre: layout.centre.to_array(),
            radius: layout.radius,
            reach: layout.reach,
            height: layout.height,
            uv_min: [rect.x as f32 / width, rect.y as f32 / height],
            uv_max: [(rect.x + rect.width) as f32 / width, (rect.y + rect.height) as f32 / height],
        })
    };
    tree.ladder.levels.iter().map(sheet).collect()
}

/// Gives a level the second UV set that the preset asks for, and tells the edge that it takes.
#[cfg(feature = "lightmap")]
fn unwrap_lightmap(plan: &Plan, level: &mut TreeMesh) -> Result<u32, Vec<Diagnostic>> {
    if plan.lightmap == 0 {
        return Ok(0);
    }
    crate::mesh::unwrap_lightmap(level, plan.lightmap)
        .map_err(|e| vec![Diagnostic::new(format!("set {}", plan.name), e.to_string()).with_field("mesh.lightmap")])
}

/// Without the feature no light maps can be had.
#[cfg(not(feature = "lightmap"))]
fn unwrap_lightmap(plan: &Plan, _: &mut TreeMesh) -> Result<u32, Vec<Diagnostic>> {
    if plan.lightmap == 0 {
        return Ok(0);
    }
    let message = "this Treewright was built without light maps";
    let error = Diagnostic::new(format!("set {}", plan.name), message).with_field("mesh.lightmap");
    Err(vec![error.with_hint("build it with the feature `lightmap`, or leave the field out")])
}

/// The names of a set's variants.
pub(super) fn names(plan: &Plan) -> Vec<String> {
    (1..=plan.variants.len()).map(|i| format!("{}_{i:03}", plan.name)).collect()
}

/// Encodes all files of a set, the manifest last.
pub(super) fn files(parts: &SetParts<'_>, placed: &Placed) -> Result<Vec<NamedFile>, Vec<Diagnostic>> {
    let set = &parts.plan.name;
    let fail = |error: &dyn std::fmt::Display| vec![Diagnostic::new("", error.to_string())];
    let names = names(parts.plan);

    let (glbs, (bark, (leaf, sheet))) = rayon::join(
        || {
            names
                .par_iter()
                .enumerate()
                .map(|(i, name)| kept_files(parts, placed, i, name))
                .collect::<Result<Vec<_>, _>>()
        },
        || {
            rayon::join(
                || texture_files(parts.plan, &parts.pictures.bark, None, parts.cache),
                || {
                    rayon::join(
                        || texture_files(parts.plan, &placed.maps, Some(&placed.packed.shown), parts.cache),
                        || parts.sheet.painted(parts.pictures, &placed.colors),
                    )
                },
            )
        },
    );
    let mut files: Vec<NamedFile> = Vec::new();
    let glbs = glbs?;
    let assets: Vec<Vec<AssetEntry>> = glbs.iter().map(|all| asset_entries(all)).collect();
    files.extend(glbs.iter().flat_map(|all| all.iter()).flat_map(|(_, made)| made.iter().cloned()));
    files.extend(parts.clips.iter().map(|clip| (clip.entry.file.clone(), clip.bytes.as_slice().into())));
    let mut textures = Vec::new();
    for texture in bark?.into_iter().chain(leaf?) {
        files.push((texture.entry.file.clone(), texture.bytes.into()));
        textures.push(texture.entry);
    }
    files.push((format!("{set}_contact.png"), sheet?.into()));
    files.sort();
    let manifest = manifest(parts, placed, textures, &names, (&files, &assets)).map_err(|e| fail(&e))?;
    files.push((manifest_name(set), manifest.into_bytes().into()));
    Ok(files)
}

/// The files of an engine, name and bytes.
type EngineFiles = (Engine, Vec<NamedFile>);

/// What the manifest says about a variant's files.
fn asset_entries(all: &[EngineFiles]) -> Vec<AssetEntry> {
    all.iter()
        .map(|(engine, files)| AssetEntry {
            engine: format!("{engine:?}"),
            files: files.iter().map(|(name, _)| name.clone()).collect(),
        })
        .collect()
}

/// The files of a variant, made when its meshes or what is said in them did change.
fn kept_files(
    parts: &SetParts<'_>,
    placed: &Placed,
    variant: usize,
    name: &str,
) -> Result<Arc<Vec<EngineFiles>>, Vec<Diagnostic>> {
    let (plan, seed) = (parts.plan, parts.identities[variant].1);
    let told = (name, &plan.name, &plan.engines, &plan.wind, &plan.colliders, &placed.impostors[variant]);
    let key = FILES
        .key()
        .input(placed.keys[variant])
        .params(&told)
        .number(seed.bits())
        .number(placed.through.into())
        .finish();
    let weight = |all: &Vec<EngineFiles>| all.iter().flat_map(|(_, made)| made).map(|(_, bytes)| bytes.len()).sum();
    parts.cache.remember_here(key, weight, || {
        engine_files(parts, placed, variant, name).map_err(|e| vec![Diagnostic::new("", e.to_string())])
    })
}

fn engine_files(
    parts: &SetParts<'_>,
    placed: &Placed,
    variant: usize,
    name: &str,
) -> Result<Vec<EngineFiles>, export::ExportError> {
    let tree = &parts.trees[variant];
    let plant = &*tree.plant;
    let winds: Vec<Option<[Wind; 2]>> = if parts.plan.wind == WindData::Attributes {
        let limbs = Limbs::of(plant, &plant.pose());
        let of = |(mesh, level): (&TreeMesh, &Level)| {
            [(&mesh.bark, &level.mesh.bark), (&mesh.leaf, &level.mesh.leaf)]
                .map(|(mesh, made)| limbs.wind(plant, mesh, made))
        };
        placed.meshes[variant].meshes.iter().zip(&tree.ladder.levels).map(|pair| Some(of(pair))).collect()
    } else {
        vec![None; placed.meshes[variant].meshes.len()]
    };
    let levels: Vec<AssetLevel<'_>> = tree
        .ladder
        .levels
        .iter()
        .zip(placed.meshes[variant].meshes.iter().zip(&placed.impostors[variant]))
        .zip(&winds)
        .map(|((level, (mesh, impostor)), wind)| AssetLevel {
            mesh,
            screen_coverage: level.screen_coverage,
            impostor: impostor.as_ref(),
            wind: wind.as_ref(),
        })
        .collect();
    let engines = &parts.plan.engines;
    let Facts { capsules, hulls, .. } = &*parts.facts[variant];
    let colliders = Colliders { capsules, hulls };
    let seed = parts.identities[variant].1.bits();
    let files = |profile: &Profile| {
        let materials = &SetMaterials::of(&parts.plan.name, profile.textures)
            .letting_through(placed.through)
            .drawn_by(parts.plan.mesh.backs);
        let asset = AssetIn { name, seed, below: parts.plan.mesh.below, levels: &levels, materials };
        let made = export::engine_files(&asset, colliders, profile.engine)?;
        Ok((profile.engine, made.into_iter().map(|(name, bytes)| (name, bytes.into())).collect()))
    };
    engines.iter().map(files).collect()
}

/// Whether a set is for any reader of glTF alone.
fn is_generic(plan: &Plan) -> bool {
    plan.engines.iter().all(|profile| profile.engine == Engine::Generic)
}

/// A level's kind as the manifest and the contact sheet name it.
pub(super) fn kind(lod: &Lod) -> &'static str {
    match lod {
        Lod::Full => "Full",
        Lod::Thinned { .. } => "Thinned",
        Lod::BillboardCloud { .. } => "BillboardCloud",
        Lod::CrossedQuads => "CrossedQuads",
        Lod::Impostor { .. } => "Impostor",
    }
}

/// A file's name and bytes.
type NamedFile = (String, Arc<[u8]>);

fn manifest(
    parts: &SetParts<'_>,
    placed: &Placed,
    textures: Vec<TextureEntry>,
    names: &[String],
    (files, assets): (&[NamedFile], &[Vec<AssetEntry>]),
) -> Result<String, serde_json::Error> {
    let plan = parts.plan;
    Manifest {
        generator: GENERATOR.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        format: MANIFEST_FORMAT,
        set: plan.name.clone(),
        key: parts.key.to_hex(),
        seed: plan.seed,
        variants: names.iter().enumerate().map(|(i, name)| variant_entry(parts, placed, &assets[i], i, name)).collect(),
        clips: parts.clips.iter().map(|clip| clip.entry.clone()).collect(),
        wind: (plan.wind == WindData::Attributes).then(|| WindEntry::with_lightmap(plan.lightmap > 0)),
        lightmap: LightmapEntry::of(plan.lightmap),
        textures,
        atlas: Some(AtlasEntry {
            pictures: placed.packed.layout.rects.len() as u64,
            scale: placed.packed.layout.scale,
            transmission: f32::from(placed.through) / 255.0,
            utilisation: placed.packed.layout.utilisation,
            coverage: placed.packed.coverage.clone(),
        }),
        notes: parts.notes.iter().map(|note| format!("{}: {}", note.about, note.message)).collect(),
        files: files.par_iter().map(|(name, bytes)| FileEntry::of(name, bytes)).collect(),
    }
    .to_json()
}

fn variant_entry(
    parts: &SetParts<'_>,
    placed: &Placed,
    assets: &[AssetEntry],
    variant: usize,
    name: &str,
) -> VariantEntry {
    let facts = &parts.facts[variant];
    let Facts { brief, bounds, capsules, hulls, .. } = &**facts;
    let (bounds, meshes) = (*bounds, &placed.meshes[variant].meshes);
    let height = bounds.max[1] - bounds.min[1];
    let levels = parts.trees[variant].ladder.levels.iter().zip(meshes.iter()).enumerate();
    VariantEntry {
        name: name.to_owned(),
        file: assets.iter().flat_map(|asset| &asset.files).next().cloned().unwrap_or_default(),
        assets: if is_generic(parts.plan) { Vec::new() } else { assets.to_vec() },
        seed: parts.identities[variant].1.bits(),
        recipe: parts.identities[variant].0.clone(),
        bounds,
        height: brief.height,
        trunk_radius: brief.base_radius,
        topology_continuity: brief.topology_continuity,
        chains: brief.chains as u64,
        leaves: brief.leaves as u64,
        levels: levels
            .map(|(i, (level, mesh))| LevelEntry {
                impostor: placed.impostors[variant][i].clone(),
                ..level_entry(name, i, level, mesh, height)
            })
            .collect(),
        capsules: capsules.clone(),
        hulls: hulls.clone(),
    }
}

fn level_entry(name: &str, index: usize, level: &Level, mesh: &TreeMesh, height: f32) -> LevelEntry {
    let measured = &level.measured;
    LevelEntry {
        mesh: export::level_name(name, index),
        kind: kind(&level.kind).to_owned(),
        triangles: level.triangles as u64,
        bark_triangles: (mesh.bark.indices.len() / 3) as u64,
        leaf_triangles: (mesh.leaf.indices.len() / 3) as u64,
        vertices: (mesh.bark.positions.len() + mesh.leaf.positions.len()) as u64,
        screen_coverage: level.screen_coverage,
        switch_distance: export::switch_distance(height, level.screen_coverage),
        measured: (index > 0).then_some(MeasuredErrors {
            pixels: measured.pixels,
            views: measured.views,
            iou_mean: measured.iou,
            iou_worst: measured.worst_iou,
            coverage: measured.coverage,
            color: measured.color,
            flip: measured.flip,
        }),
        without_shader: level.plain.map(|plain| OutlineErrors {
            iou_mean: plain.iou,
            iou_worst: plain.worst_iou,
            coverage: plain.coverage,
        }),
        impostor: None,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use crate::export::Manifest;
    use crate::plant::{PlantBuilder, dump};

    /// What a set's manifest tells of a branch on a pole.
    fn manifest(more: &str) -> Manifest {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.1, 0.05]);
        builder.branch(stem, 0.7, &[Vec3::ZERO, Vec3::new(0.9, 0.6, 0.0)], &[0.03, 0.01]);
        let preset = format!(
            "(sources: {{\"a\": Import(file: \"a.plant\")}}, variants: [Source(\"a\")], bark: (resolution: 64), {more})"
        );
        let plan = dump(&builder.finish().unwrap());
        let files = [("s.ron", preset), ("a.plant", plan)].map(|(name, text)| (name.to_owned(), text.into_bytes()));
        let made = crate::build::make_set("s.ron", files.into()).unwrap();
        let (name, manifest) = made.files.last().unwrap();
        assert!(name.ends_with("manifest.json"));
        serde_json::from_slice(manifest).unwrap()
    }

    /// What the mips of a set's atlas cover, of level 0.
    fn mips(gutter: u32) -> Vec<f32> {
        let more =
            format!("foliage: (leaf: \"ash\", resolution: 128), lods: [Full], atlas: (size: 1024, gutter: {gutter})");
        let coverage = manifest(&more).atlas.unwrap().coverage;
        coverage.iter().map(|mip| mip / coverage[0]).collect()
    }

    #[test]
    fn pictures_that_an_atlas_holds_only_smaller_are_told() {
        for (pictures, is_told) in [(16, true), (2, false)] {
            let told = manifest(&format!(
                "foliage: (pictures: {pictures}, resolution: 256), lods: [Full], atlas: (size: 512)"
            ));
            let scale = told.atlas.unwrap().scale;
            let shown = (scale * 100.0).floor() / 100.0;
            let said = told.notes.iter().any(|note| note.contains(&format!("only at {shown:.2} of their size")));
            assert_eq!((said, scale < 1.0), (is_told, is_told), "{:?}", told.notes);
        }
    }

    #[test]
    fn mips_keep_what_level_0_covers_whatever_the_gutter_is() {
        for gutter in [2, 8, 10, 32] {
            let mips = mips(gutter);
            assert!(mips[..4].iter().all(|mip| (mip - 1.0).abs() < 0.04), "{gutter}: {mips:?}");
        }
    }
}
