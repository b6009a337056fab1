//! The stages in order: from a plan and its inputs to the files of a set. Reads like a table of contents.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::around::Surroundings;
use super::assets::{self, SetParts};
use super::blends::Blends;
use super::cache::Cache;
use super::morphs::Morphs;
use super::selections::Selected;
use super::sheet::Sheet;
use super::sketches::Drawn;
use super::stages::{SourcePlant, Wanted};
use super::trees::{Tree, Trees};
pub use super::wardrobe::dress_params;
use super::wardrobe::{self, Wardrobe};
use super::{Loaded, Shard, World, blends, clips, facts, morphs, selections, sketches, stages, wears};
use crate::base::{Asked, Diagnostic, Key, Note, once};
use crate::plant::Leaf;
use crate::preset::plan::{BarkArt, LeafArt, SketchParams, SourceRecipe};
use crate::preset::{self, Plan};
use crate::source::scene::Files;
use crate::source::{grow, import};

/// Raised whenever a stage's output changes for the same parameters and inputs, so that current sets are built again.
pub(super) const VERSION: u32 = 99;

/// The bytes that a plan's files hold: path as the plan has it, bytes, and the name that is shown to people.
pub type Inputs = BTreeMap<String, InputFile>;

/// One file that a plan names.
#[derive(Clone, Debug)]
pub struct InputFile {
    /// What it holds.
    pub bytes: Vec<u8>,
    /// What it is called in messages.
    pub shown: String,
    /// Other files that it names: the name in it, and where that lies. Those that are missing have no [`InputFile`].
    pub names: BTreeMap<String, String>,
}

impl InputFile {
    /// The files that it names, as far as they are there.
    pub(super) fn files<'a>(&self, inputs: &'a Inputs) -> Files<'a> {
        let found = |(name, path): (&String, &String)| Some((name.clone(), inputs.get(path)?.bytes.as_slice()));
        self.names.iter().filter_map(found).collect()
    }
}

/// The files of a set.
#[derive(Clone, Debug)]
pub struct SetFiles {
    /// Name and bytes; the manifest is the last.
    pub files: Vec<(String, Arc<[u8]>)>,
    /// What was mended, bridged or dropped.
    pub notes: Vec<Note>,
}

/// Reads every file that a plan names.
///
/// # Errors
///
/// One for each file that can't be read, at the place in the preset that names it.
pub fn read_inputs(loaded: &Loaded) -> Result<Inputs, Vec<Diagnostic>> {
    let Loaded { plan, preset, text, world } = loaded;
    let mut inputs = Inputs::new();
    let mut errors = Vec::new();
    for (file, field) in files_of(plan) {
        if inputs.contains_key(&file) {
            continue;
        }
        match world.read(&file) {
            Ok(bytes) => {
                let shown = super::find::shown(&world.path(&file));
                inputs.insert(file, InputFile { bytes, shown, names: BTreeMap::new() });
            }
            Err(why) => errors.push(
                Diagnostic::new(preset, format!("can't read {file}: {why}"))
                    .with_span(preset::place(text, &field))
                    .with_field(field)
                    .with_hint("paths are relative to the preset's folder"),
            ),
        }
    }
    for source in &plan.sources {
        if let Some(params) = source.recipe.import()
            && let Some(mut input) = inputs.remove(&params.file)
        {
            let result = named_files(&params.file, &mut input, &mut inputs, world);
            inputs.insert(params.file.clone(), input);
            let name = if matches!(source.recipe, SourceRecipe::Like(_)) { "like" } else { "file" };
            let field = format!("sources[\"{}\"].{name}", source.name);
            let by = Asked { file: preset.clone(), span: preset::place(text, &field), field };
            errors.extend(result.err().into_iter().flat_map(|found| preset::data_asked_for(found, &by)));
        }
    }
    if errors.is_empty() { Ok(inputs) } else { Err(errors) }
}

/// Most files that one file may name: more is no tree.
const MOST_NAMED: usize = 1000;

/// Reads what an imported file names (materials, pictures, buffers), and what those name. What is missing is left to the
/// importer, which knows whether it can do without; it is remembered by the world, so that it is read once it is there.
fn named_files(file: &str, input: &mut InputFile, inputs: &mut Inputs, world: &World) -> Result<(), Vec<Diagnostic>> {
    let mut errors = Vec::new();
    // An OBJ names its MTL, that its pictures: the third round finds nothing new.
    for _ in 0..3 {
        let files = input.files(inputs);
        let mut names = import::refers(&input.bytes, file, &files);
        names.retain(|name| !input.names.contains_key(name));
        if names.is_empty() {
            break;
        }
        if input.names.len() + names.len() > MOST_NAMED {
            errors.push(Diagnostic::new(&input.shown, format!("it names more than {MOST_NAMED} other files")));
            break;
        }
        for name in names {
            let Some(path) = preset::beside(file, &name) else {
                let message = format!("it names the file {name}, which lies outside of the preset's folder");
                let hint = "keep what a mesh names inside of the preset's folder, or beside the mesh";
                errors.push(Diagnostic::new(&input.shown, message).with_hint(hint));
                input.names.insert(name, String::new());
                continue;
            };
            // The mesh itself is not among the inputs here, and no material of its own.
            if path != file
                && !inputs.contains_key(&path)
                && let Ok(bytes) = world.read(&path)
            {
                let shown = super::find::shown(&world.path(&path));
                inputs.insert(path.clone(), InputFile { bytes, shown, names: BTreeMap::new() });
            }
            input.names.insert(name, path);
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// The files that a plan names, each with the field that names it.
pub(super) fn files_of(plan: &Plan) -> Vec<(String, String)> {
    let mut files = Vec::new();
    for source in &plan.sources {
        match &source.recipe {
            SourceRecipe::Import(params) => {
                files.push((params.file.clone(), format!("sources[\"{}\"].file", source.name)));
            }
            SourceRecipe::Like(like) => {
                files.push((like.scan.file.clone(), format!("sources[\"{}\"].like", source.name)));
            }
            SourceRecipe::Grow(params) => {
                let field = format!("sources[\"{}\"].species", source.name);
                files.extend(grow::shape_files(params).into_iter().map(|shape| (shape.file, field.clone())));
                let field = format!("sources[\"{}\"].obstacles", source.name);
                files.extend(grow::obstacle_files(params).map(|file| (file.clone(), field.clone())));
            }
        }
    }
    for sketch in plan.drawn().flat_map(SketchParams::each) {
        files.push((sketch.crown.clone(), format!("{}.crown", sketch.field)));
        files.push((sketch.side.clone(), format!("{}.side", sketch.field)));
    }
    if let LeafArt::Files { color, normal, transmission } = &plan.leaf_art {
        files.push((color.clone(), "foliage.leaf.color".to_owned()));
        files.push((normal.clone(), "foliage.leaf.normal".to_owned()));
        files.push((transmission.clone(), "foliage.leaf.transmission".to_owned()));
    }
    if let BarkArt::Files { color, normal, roughness } = &plan.bark_art {
        files.push((color.clone(), "bark.texture.color".to_owned()));
        files.push((normal.clone(), "bark.texture.normal".to_owned()));
        files.push((roughness.clone(), "bark.texture.roughness".to_owned()));
    }
    files.retain(|(file, _)| !file.is_empty());
    files
}

/// What a set depends on.
#[must_use]
pub fn set_key(plan: &Plan, inputs: &Inputs) -> Key {
    let mut key = Key::stage(concat!("set ", env!("CARGO_PKG_VERSION")), VERSION).params(plan);
    for (file, input) in inputs {
        key = key.params(file).input(Key::of_bytes(&input.bytes));
    }
    key.finish()
}

/// Both results, or the errors of both.
fn both<A, B>(
    first: Result<A, Vec<Diagnostic>>,
    second: Result<B, Vec<Diagnostic>>,
) -> Result<(A, B), Vec<Diagnostic>> {
    match (first, second) {
        (Ok(first), Ok(second)) => Ok((first, second)),
        (Err(mut errors), Err(mut more)) => {
            errors.append(&mut more);
            Err(errors)
        }
        (Err(errors), _) | (_, Err(errors)) => Err(errors),
    }
}

/// Reads the scans and pictures that a plan names as a build would, without growing or making anything.
///
/// # Errors
///
/// Everything that is wrong with them.
pub fn check_inputs(plan: &Plan, inputs: &Inputs) -> Result<(), Vec<Diagnostic>> {
    let sketches = sketches::sketches(plan, inputs).map(drop);
    let pictures = both(stages::check_pictures(plan, inputs), sketches).map(drop);
    both(stages::check_imports(plan, inputs), pictures).map(drop)
}

/// How many times [`make_set`] tells of a step.
#[must_use]
pub fn steps(plan: &Plan) -> usize {
    plan.sources.len() + 2 * plan.variants.len() + 5
}

/// What all trees of a set share.
pub(super) struct Prepared {
    pub(super) sources: Vec<Arc<SourcePlant>>,
    pub(super) wardrobe: Wardrobe,
    pub(super) morphs: Morphs,
    pub(super) blended: Blends,
    /// Those of variants, then those of sequences.
    pub(super) sketches: Vec<Drawn>,
}

/// Sources, pictures, and sources in correspondence.
pub(super) fn prepared(
    plan: &Plan,
    inputs: &Inputs,
    cache: &Cache,
    wanted: Wanted,
    step: &(dyn Fn(&str) + Sync),
) -> Result<Prepared, Vec<Diagnostic>> {
    let (sources, pictures) =
        rayon::join(|| stages::sources(plan, inputs, cache, wanted, step), || stages::pictures(plan, inputs, cache));
    let (sources, pictures) = both(sources, pictures)?;
    let sketches = sketches::sketches(plan, inputs)?;
    step("leaves and bark");
    let around = Surroundings::of(plan, &sources, inputs)?;
    let mut wardrobe = wardrobe::wardrobe(plan, &sources, &pictures, around)?;
    let morphs = morphs::morphs(plan, &sketches[plan.sketches.len()..], &mut wardrobe)?;
    let blended = blends::blends(plan, &wardrobe.plants, cache)?;
    step("matching");
    Ok(Prepared { sources, wardrobe, morphs, blended, sketches })
}

/// The trees of some variants, in order.
fn trees(
    plan: &Plan,
    prepared: &Prepared,
    selected: &Selected,
    cache: &Cache,
    places: &[usize],
    step: &(dyn Fn(&str) + Sync),
) -> Vec<Tree> {
    let Prepared { wardrobe, morphs, blended, sketches, .. } = prepared;
    let trees = Trees::new(plan, wardrobe, cache, sketches);
    let one = |&place: &usize| {
        let variant = &plan.variants[place];
        let (_, seed) = blends::identity(plan, variant, selected);
        let bare = blends::variant(plan, variant, &wardrobe.plants, blended, selected, morphs);
        let plant = trees.shaped(variant, trees.dressed(variant, bare, seed.child("dress")));
        step("dressing");
        let tree = trees.levels(plant, seed.child("lod"));
        step("levels of detail");
        tree
    };
    // New variants stand at the end mostly: what takes longest begins first.
    places.par_iter().rev().map(one).collect::<Vec<_>>().into_iter().rev().collect()
}

/// What was mended in the sources, rejected and removed, and what an atlas has no room for.
fn notes(plan: &Plan, prepared: &Prepared, selected: &Selected) -> Vec<Note> {
    let mut notes = wears::notes(plan, &prepared.sources);
    notes.extend(stages::source_notes(plan, &prepared.sources));
    notes.extend(sketches::notes(&prepared.sketches));
    notes.extend(selected.notes.iter().cloned());
    notes.extend(prepared.morphs.note.clone());
    notes.extend(prepared.morphs.spared());
    notes.extend(prepared.wardrobe.note());
    notes.extend(super::fewer::left(plan, &prepared.sources, &prepared.wardrobe.plants));
    notes.extend(super::trees::small_atlas(plan, &prepared.wardrobe.pictures));
    notes
}

/// Makes every file of a set. Pure: the same plan, inputs and version give the same bytes on any number of threads, and
/// whatever the cache holds.
///
/// # Errors
///
/// Everything that is wrong with the sources and pictures; or else what is wrong with the matching or the atlas. Errors
/// about the plan have an empty file name: the plan does not know its text.
pub fn make_set(
    plan: &Plan,
    inputs: &Inputs,
    key: Key,
    cache: &Cache,
    step: &(dyn Fn(&str) + Sync),
) -> Result<SetFiles, Vec<Diagnostic>> {
    let prepared = prepared(plan, inputs, cache, Wanted::Used, step)?;
    let selected = selections::selected(plan, &prepared.blended)?;
    step("picking");
    let places: Vec<usize> = (0..plan.variants.len()).collect();
    let trees = trees(plan, &prepared, &selected, cache, &places, step);
    let pictures = &prepared.wardrobe.pictures;
    let (placed, (sheet, facts)) = rayon::join(
        || assets::place(plan, pictures, &trees, cache),
        || rayon::join(|| Sheet::drawn(plan, pictures, &trees, cache), || facts::facts(plan, &trees, cache)),
    );
    let (placed, sheet, facts) = (placed?, sheet?, facts?);
    let clips = clips::clips(plan, &prepared.morphs, pictures, &placed.packed.layout)?;
    step("atlas");
    let identities: Vec<_> = plan.variants.iter().map(|variant| blends::identity(plan, variant, &selected)).collect();
    let mut notes = notes(plan, &prepared, &selected);
    notes.extend(placed.scaled(plan));
    let stock = OnceLock::new();
    let drawn = |leaf: &Leaf| once(&stock, || super::trees::stock(plan, pictures, cache)).drawn(leaf);
    notes.extend(super::unlike::notes(plan, &trees, &drawn));
    notes.extend(super::fewer::notes(plan, &prepared.wardrobe, &trees));
    notes.extend(placed.small_lightmap(plan));
    notes.extend(facts::bodiless(plan, &facts));
    let (identities, trees, facts, clips, sheet) = (&identities, &trees, &facts, &clips, &sheet);
    let parts = SetParts { cache, plan, key, identities, trees, facts, pictures, clips, sheet, notes: &notes };
    let files = assets::files(&parts, &placed)?;
    step("files");
    Ok(SetFiles { files, notes })
}

/// What of a set is made for the cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// Sources and pictures.
    Sources,
    /// Sources, pictures and some of the trees.
    Trees(Shard),
    /// All that is in the set's textures.
    Atlas,
}

/// Makes a part of a set for the cache: how many trees, and what is to be told.
///
/// # Errors
///
/// As [`make_set`].
pub fn make_share(
    plan: &Plan,
    inputs: &Inputs,
    cache: &Cache,
    share: Share,
    step: &(dyn Fn(&str) + Sync),
) -> Result<(usize, Vec<Note>), Vec<Diagnostic>> {
    let prepared = prepared(plan, inputs, cache, Wanted::Used, step)?;
    let all = 0..plan.variants.len();
    let places: Vec<usize> = match share {
        Share::Sources => return Ok((0, stages::source_notes(plan, &prepared.sources))),
        Share::Trees(shard) => all.filter(|&place| shard.has(place)).collect(),
        Share::Atlas => all.collect(),
    };
    let selected = selections::selected(plan, &prepared.blended)?;
    step("picking");
    let trees = trees(plan, &prepared, &selected, cache, &places, step);
    if share == Share::Atlas {
        assets::textures(plan, &prepared.wardrobe.pictures, &trees, cache)?;
    }
    Ok((places.len(), notes(plan, &prepared, &selected)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::Rect;

    /// The texels of a mip within a picture that pass the alpha test, as an area of level 0.
    fn shows(mip: u32, alpha: &[u8], width: u32, rect: Rect) -> u32 {
        let side = 1 << mip;
        let squares = |from: u32, extent: u32| (from.div_ceil(side)..(from + extent) / side).map(move |i| i * side);
        let passes = |x: u32, y: u32| {
            let row = |y: u32| (x..x + side).map(|x| u32::from(alpha[(y * width + x) as usize])).sum::<u32>();
            (y..y + side).map(row).sum::<u32>() >= 128 * side * side
        };
        let of_row = |y: u32| squares(rect.x, rect.width).filter(|&x| passes(x, y)).count() as u32;
        squares(rect.y, rect.height).map(of_row).sum::<u32>() * side * side
    }

    #[test]
    fn cards_are_in_the_atlas_what_they_were_settled_as() {
        const OAK: &str = "(height: 8.0, iterations: [(endpoints: Surface(k: 4, count: 300))])";
        let text = "(sources: {\"a\": Grow(species: \"oak.ron\", seed: 1), \"b\": Grow(species: \"oak.ron\", seed: 2)}, \
             variants: [Source(\"a\"), Source(\"b\")], foliage: (leaf: \"beech\", most: 600), \
             lods: [Full, BillboardCloud(cards: 12), Impostor(frames: 6)], atlas: (size: 1024))";
        let plan = crate::preset::load("set.ron", text, &mut |_| Ok(OAK.to_owned()));
        let plan = plan.unwrap_or_else(|found| panic!("{found:?}"));
        let cache = Cache::default();
        let prepared = prepared(&plan, &Inputs::new(), &cache, Wanted::Used, &|_| {}).expect("it grows");
        let selected = selections::selected(&plan, &prepared.blended).expect("all are taken");
        let trees = trees(&plan, &prepared, &selected, &cache, &[0, 1], &|_| {});
        let pictures = &prepared.wardrobe.pictures;
        let placed = assets::place(&plan, pictures, &trees, &cache).expect("it fits");
        let (packed, shared) = (&placed.packed, pictures.leaves.len());
        let mut rects = packed.layout.rects[shared..].iter();
        let mut shown = [0; 4];
        for tree in &trees {
            for (tile, &rect) in tree.ladder.tiles.iter().zip(&mut rects) {
                assert_eq!((tile.width, tile.height), (rect.width, rect.height));
                // Where it is in its cell, as it was settled.
                let (x, y) = (rect.x % crate::bake::ALIGN, rect.y % crate::bake::ALIGN);
                let wide = x + rect.width;
                let mut own = vec![0; (wide * (y + rect.height)) as usize];
                for (to, line) in own
                    .chunks_exact_mut(wide as usize)
                    .skip(y as usize)
                    .zip(tile.alpha.chunks_exact(rect.width as usize))
                {
                    to[x as usize..].copy_from_slice(line);
                }
                for (mip, sum) in (0..).zip(&mut shown) {
                    let here = shows(mip, &own, wide, Rect { x, y, ..rect });
                    assert_eq!(shows(mip, &packed.alpha, packed.layout.width, rect), here, "{mip} {rect:?}");
                    *sum += here;
                }
            }
        }
        assert!(shown.iter().all(|&texels| texels > 20_000), "{shown:?}");
    }
}
