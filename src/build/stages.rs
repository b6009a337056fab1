//! The stages as the pipeline calls them: each takes its own part of the plan and the results of earlier ones.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use rayon::prelude::*;

use super::pipeline::Inputs;
use crate::bake::{self, ArtFile, ArtLimits, ArtUse, Maps};
use crate::base::{Diagnostic, Key, Note, Seed};
use crate::blend;
use crate::plant::Plant;
use crate::preset::Plan;
use crate::preset::plan::{BarkArt, DressParams, GrowParams, LeafArt, MatchParams, Source, SourceRecipe, Variant};
use crate::relate::{self, Family};
use crate::source::{grow, import};

/// Sources and pictures by their keys, kept between builds of one process: those used last. A hit never changes a byte.
#[derive(Debug, Default)]
pub struct Memory {
    sources: Mutex<Kept<SourcePlant>>,
    graphs: Mutex<Kept<grow::Graph>>,
    pictures: Mutex<Kept<Pictures>>,
}

/// Most sources kept, and most pictures of sets.
const MOST_KEPT: (usize, usize) = (64, 8);
/// Most graphs kept: each takes some megabytes.
const MOST_GRAPHS: usize = 4;

/// Values by key, each with the time of its last use.
#[derive(Debug)]
struct Kept<T> {
    values: BTreeMap<Key, (u64, Arc<T>)>,
    uses: u64,
}

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self { values: BTreeMap::new(), uses: 0 }
    }
}

impl<T> Kept<T> {
    fn get(&mut self, key: Key) -> Option<Arc<T>> {
        self.uses += 1;
        let (used, value) = self.values.get_mut(&key)?;
        *used = self.uses;
        Some(value.clone())
    }

    /// Keeps a value, and forgets the one that was used longest ago when there are more than `most`.
    fn insert(&mut self, key: Key, value: Arc<T>, most: usize) {
        self.uses += 1;
        self.values.insert(key, (self.uses, value));
        if self.values.len() > most {
            let oldest = self.values.iter().min_by_key(|(_, (used, _))| *used).map(|(key, _)| *key);
            oldest.and_then(|key| self.values.remove(&key));
        }
    }
}

/// A source and what was mended in it.
#[derive(Clone, Debug)]
pub(super) struct SourcePlant {
    /// The plant.
    pub(super) plant: Plant,
    /// What was bridged or dropped.
    notes: Vec<String>,
}

/// What leaves and bark wear.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    /// One for each slot.
    pub(super) leaves: Vec<Maps>,
    /// Tiling.
    pub(super) bark: Maps,
}

/// Two sources in correspondence, by their indices and the weights that matched them.
pub(super) type Families = Vec<((usize, usize, MatchParams), Family)>;

/// The value of a key, made if it is not there. Two threads may make the same one; both get equal values.
fn remember<T>(
    kept: &Mutex<Kept<T>>,
    most: usize,
    key: Key,
    make: impl FnOnce() -> Result<T, Vec<Diagnostic>>,
) -> Result<Arc<T>, Vec<Diagnostic>> {
    let lock = || kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(value) = lock().get(key) {
        return Ok(value);
    }
    let value = Arc::new(make()?);
    lock().insert(key, value.clone(), most);
    Ok(value)
}

/// Grows or imports every source.
pub(super) fn sources(
    plan: &Plan,
    inputs: &Inputs,
    memory: &Memory,
    step: &(dyn Fn(&str) + Sync),
) -> Result<Vec<Arc<SourcePlant>>, Vec<Diagnostic>> {
    let made: Vec<Result<Arc<SourcePlant>, Vec<Diagnostic>>> = plan
        .sources
        .par_iter()
        .map(|source| {
            let result = one_source(source, inputs, memory);
            step("source");
            result
        })
        .collect();
    let mut plants = Vec::new();
    let mut errors = Vec::new();
    for result in made {
        match result {
            Ok(plant) => plants.push(plant),
            Err(mut diagnostics) => errors.append(&mut diagnostics),
        }
    }
    if errors.is_empty() { Ok(plants) } else { Err(errors) }
}

fn one_source(source: &Source, inputs: &Inputs, memory: &Memory) -> Result<Arc<SourcePlant>, Vec<Diagnostic>> {
    match &source.recipe {
        SourceRecipe::Grow(params) => {
            let mut key = Key::stage("grow", 2).params(params);
            for shape in grow::shape_files(params) {
                key = key.input(Key::of_bytes(&inputs[&shape.file].bytes));
            }
            for file in grow::obstacle_files(params) {
                key = key.input(Key::of_bytes(&inputs[file].bytes));
            }
            remember(&memory.sources, MOST_KEPT.0, key.finish(), || {
                let solids = solids(source, params, inputs)?;
                let graph = graph(source, params, &solids, inputs, memory)?;
                grow::grow_on(&graph, params, &solids, Seed::new(params.seed).child("grow"))
                    .map(|(plant, notes)| SourcePlant { plant, notes })
                    .map_err(|error| vec![grow_diagnostic(source, &error)])
            })
        }
        SourceRecipe::Import(params) => {
            let input = &inputs[&params.file];
            let key = Key::stage("import", 1).params(params).input(Key::of_bytes(&input.bytes)).finish();
            remember(&memory.sources, MOST_KEPT.0, key, || {
                import::import(&input.bytes, &input.shown, params)
                    .map(|imported| SourcePlant { plant: imported.plant, notes: imported.notes })
            })
        }
    }
}

/// Reads the shapes that a species' volumes name.
fn solids(source: &Source, params: &GrowParams, inputs: &Inputs) -> Result<grow::Solids, Vec<Diagnostic>> {
    let read = |shape: grow::ShapeFile| {
        let input = &inputs[&shape.file];
        grow::Solid::read(&input.bytes, shape.reading).map(|solid| (shape, solid)).map_err(|error| {
            let message = format!("its species takes endpoints from {}: {error}", input.shown);
            Diagnostic::new("", message).with_field(format!("sources[\"{}\"].species", source.name))
        })
    };
    let (solids, errors): (Vec<_>, Vec<_>) = grow::shape_files(params).into_iter().map(read).partition(Result::is_ok);
    let errors: Vec<Diagnostic> = errors.into_iter().filter_map(Result::err).collect();
    if errors.is_empty() { Ok(solids.into_iter().flatten().collect()) } else { Err(errors) }
}

/// The graph that a source grows on, which sources of one species share.
fn graph(
    source: &Source,
    params: &GrowParams,
    solids: &grow::Solids,
    inputs: &Inputs,
    memory: &Memory,
) -> Result<Arc<grow::Graph>, Vec<Diagnostic>> {
    let wrong = |error: grow::GrowError| vec![grow_diagnostic(source, &error)];
    let of = grow::GraphParams::of(params, solids).map_err(wrong)?;
    let mut key = Key::stage("graph", 1).params(&of);
    for file in grow::obstacle_files(params) {
        key = key.input(Key::of_bytes(&inputs[file].bytes));
    }
    remember(&memory.graphs, MOST_GRAPHS, key.finish(), || {
        let meshes = obstacle_meshes(source, params, inputs)?;
        grow::Graph::new(&of, &meshes).map_err(wrong)
    })
}

/// Reads the meshes that stand in a source's way.
fn obstacle_meshes(
    source: &Source,
    params: &GrowParams,
    inputs: &Inputs,
) -> Result<grow::ObstacleMeshes, Vec<Diagnostic>> {
    let read = |file: &String| {
        let input = &inputs[file];
        grow::obstacle_triangles(&input.bytes).map(|mesh| (file.clone(), mesh)).map_err(|error| {
            let message = format!("the obstacle {} can't be read: {error}", input.shown);
            Diagnostic::new("", message).with_field(format!("sources[\"{}\"].obstacles", source.name))
        })
    };
    let (meshes, errors): (Vec<_>, Vec<_>) = grow::obstacle_files(params).map(read).partition(Result::is_ok);
    let errors: Vec<Diagnostic> = errors.into_iter().filter_map(Result::err).collect();
    if errors.is_empty() { Ok(meshes.into_iter().flatten().collect()) } else { Err(errors) }
}

/// What is wrong with a species that did not grow.
fn grow_diagnostic(source: &Source, error: &grow::GrowError) -> Diagnostic {
    let hint = match error {
        grow::GrowError::OutOfRange { .. } => "the species file that the source names has this field",
        grow::GrowError::NoMesh(_) | grow::GrowError::BadMesh | grow::GrowError::OtherGraph => {
            "the source's `obstacles` name it"
        }
        grow::GrowError::Shape(_) => "the species file that the source names names it in turn",
        grow::GrowError::Nothing | grow::GrowError::Plant(_) => {
            "in the species file, widen the shapes that endpoints are taken from or raise `nodes`"
        }
    };
    Diagnostic::new("", error.to_string()).with_field(format!("sources[\"{}\"]", source.name)).with_hint(hint)
}

/// What was mended in the sources, each under its source's name.
pub(super) fn source_notes(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Vec<Note> {
    let of = |(source, made): (&Source, &Arc<SourcePlant>)| {
        made.notes
            .iter()
            .map(|message| Note { about: source.name.clone(), message: message.clone() })
            .collect::<Vec<_>>()
    };
    plan.sources.iter().zip(sources).flat_map(of).collect()
}

/// Makes or reads the pictures of leaves and bark.
pub(super) fn pictures(plan: &Plan, inputs: &Inputs, memory: &Memory) -> Result<Arc<Pictures>, Vec<Diagnostic>> {
    let seed = Seed::new(plan.seed);
    let mut key = Key::stage("pictures", 1)
        .number(plan.seed)
        .number(u64::from(plan.dress.pictures))
        .params(&plan.leaf_art)
        .params(&plan.bark_art);
    for file in picture_files(plan) {
        key = key.input(Key::of_bytes(&inputs[file].bytes));
    }
    remember(&memory.pictures, MOST_KEPT.1, key.finish(), || {
        let leaves = match &plan.leaf_art {
            LeafArt::Made { shape, color, variation, size } => (0..u32::from(plan.dress.pictures))
                .into_par_iter()
                .map(|picture| bake::leaf_maps(*shape, *color, *variation, *size, picture, seed.child("leaves")))
                .collect(),
            LeafArt::Files { color, normal } => vec![user_maps(inputs, ArtUse::Leaf, [color, normal, ""])?],
        };
        let bark = match &plan.bark_art {
            BarkArt::Made { pattern, color, size } => bake::bark_maps(*pattern, *color, *size, seed.child("bark")),
            BarkArt::Files { color, normal, roughness } => user_maps(inputs, ArtUse::Bark, [color, normal, roughness])?,
        };
        Ok(Pictures { leaves, bark })
    })
}

/// The files that a plan's pictures are read from.
fn picture_files(plan: &Plan) -> Vec<&String> {
    let mut files = Vec::new();
    if let LeafArt::Files { color, normal } = &plan.leaf_art {
        files.extend([color, normal]);
    }
    if let BarkArt::Files { color, normal, roughness } = &plan.bark_art {
        files.extend([color, normal, roughness]);
    }
    files.retain(|file| !file.is_empty());
    files
}

/// Decodes pictures of the user's: colour, normal, roughness; an empty name is a map that was not given.
fn user_maps(inputs: &Inputs, usage: ArtUse, files: [&str; 3]) -> Result<Maps, Vec<Diagnostic>> {
    let bytes = |file: &str| inputs.get(file).map(|input| input.bytes.as_slice());
    let [color, normal, roughness] = files.map(bytes);
    bake::maps_from_images(color.unwrap_or_default(), normal, roughness, usage, ArtLimits::default()).map_err(|error| {
        let (map, file) = match error.file() {
            ArtFile::Color => ("color", files[0]),
            ArtFile::Normal => ("normal", files[1]),
            ArtFile::Roughness => ("roughness", files[2]),
        };
        let group = match usage {
            ArtUse::Leaf => "foliage.leaf",
            ArtUse::Bark => "bark.texture",
        };
        let shown = inputs.get(file).map_or(file, |input| input.shown.as_str());
        vec![Diagnostic::new("", format!("{shown}: {error}")).with_field(format!("{group}.{map}"))]
    })
}

/// Reads the user's pictures and forgets them.
pub(super) fn check_pictures(plan: &Plan, inputs: &Inputs) -> Result<(), Vec<Diagnostic>> {
    if let LeafArt::Files { color, normal } = &plan.leaf_art {
        user_maps(inputs, ArtUse::Leaf, [color, normal, ""])?;
    }
    if let BarkArt::Files { color, normal, roughness } = &plan.bark_art {
        user_maps(inputs, ArtUse::Bark, [color, normal, roughness])?;
    }
    Ok(())
}

/// Imports the scans and reads the shapes of species, and forgets them.
pub(super) fn check_imports(plan: &Plan, inputs: &Inputs) -> Result<(), Vec<Diagnostic>> {
    let checked: Vec<Result<(), Vec<Diagnostic>>> = plan
        .sources
        .par_iter()
        .map(|source| match &source.recipe {
            SourceRecipe::Import(_) => one_source(source, inputs, &Memory::default()).map(drop),
            SourceRecipe::Grow(params) => {
                solids(source, params, inputs)?;
                obstacle_meshes(source, params, inputs).map(drop)
            }
        })
        .collect();
    let errors: Vec<Diagnostic> = checked.into_iter().filter_map(Result::err).flatten().collect();
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// The parameters of dressing, with the length of the picture that leaves are shown by: a spray spans several leaves.
pub(super) fn dress_params(plan: &Plan) -> DressParams {
    let span = match plan.leaf_art {
        LeafArt::Made { shape, .. } => bake::spray_span(shape),
        LeafArt::Files { .. } => 1.0,
    };
    DressParams { leaf_size: plan.dress.leaf_size * span, ..plan.dress.clone() }
}

/// Matches every pair of sources that a variant blends, each once.
pub(super) fn families(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Result<Families, Vec<Diagnostic>> {
    let mut pairs: Vec<(usize, usize, MatchParams)> = Vec::new();
    for variant in &plan.variants {
        if let Variant::Blend { from, to, matching, .. } = variant
            && !pairs.contains(&(*from, *to, *matching))
        {
            pairs.push((*from, *to, *matching));
        }
    }
    pairs
        .into_par_iter()
        .map(|(from, to, matching)| {
            let family = relate::fuzzy_family(sources[from].plant.clone(), sources[to].plant.clone(), &matching);
            let family = family.map_err(|error| {
                let (from, to) = (&plan.sources[from].name, &plan.sources[to].name);
                let message = format!("can't be blended with \"{to}\": {error}");
                vec![Diagnostic::new("", message).with_field(format!("sources[\"{from}\"]"))]
            })?;
            Ok(((from, to, matching), family))
        })
        .collect()
}

/// One variant, bare.
pub(super) fn variant(plan: &Plan, variant: &Variant, sources: &[Arc<SourcePlant>], families: &Families) -> Plant {
    match variant {
        Variant::Source(index) => sources[*index].plant.clone(),
        Variant::Blend { from, to, matching, batch, progress } => {
            let pair = (*from, *to, *matching);
            let family = families.iter().find(|(key, _)| *key == pair).map(|(_, family)| family);
            let family = family.expect("families holds every pair that a variant blends");
            // Trees of one batch are states of one schedule, so its address holds the pair and the batch only.
            let name = |index: usize| plan.sources[index].name.as_str();
            let seed = Seed::new(plan.seed).child("schedule").child(name(*from)).child(name(*to)).at(*batch);
            family.blend(&blend::sample(family, 0, 1, seed, *progress))
        }
    }
}

/// What a variant is, for the manifest, and the address of its randomness: what it is and not its place in the list, so
/// that adding a variant changes no other.
pub(super) fn identity(plan: &Plan, variant: &Variant) -> (serde_json::Value, Seed) {
    let name = |index: usize| plan.sources[index].name.as_str();
    let recipe = match variant {
        Variant::Source(index) => serde_json::json!({ "source": name(*index) }),
        Variant::Blend { from, to, matching, batch, progress } => serde_json::json!({
            "blend": [name(*from), name(*to)], "batch": batch, "progress": progress, "matching": matching,
        }),
    };
    let seed = Seed::new(plan.seed).child("variant").child(&recipe.to_string());
    (recipe, seed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_keeps_what_was_used_last() {
        let mut kept = Kept::default();
        let keys: Vec<Key> = (0..3_u8).map(|i| Key::of_bytes(&[i])).collect();
        kept.insert(keys[0], Arc::new(0), 2);
        kept.insert(keys[1], Arc::new(1), 2);
        assert_eq!(kept.get(keys[0]).as_deref(), Some(&0));
        kept.insert(keys[2], Arc::new(2), 2);
        let left: Vec<Option<i32>> = keys.iter().map(|key| kept.get(*key).map(|value| *value)).collect();
        assert_eq!(left, [Some(0), None, Some(2)]);
    }
}
