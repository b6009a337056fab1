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
use crate::preset::plan::{BarkArt, DressParams, LeafArt, MatchParams, Source, SourceRecipe, Variant};
use crate::relate::{self, Family};
use crate::source::{grow, import};

/// Sources and pictures by their keys, kept between builds of one process. A hit never changes a byte.
#[derive(Debug, Default)]
pub struct Memory {
    sources: Mutex<BTreeMap<Key, Arc<SourcePlant>>>,
    pictures: Mutex<BTreeMap<Key, Arc<Pictures>>>,
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
    kept: &Mutex<BTreeMap<Key, Arc<T>>>,
    key: Key,
    make: impl FnOnce() -> Result<T, Vec<Diagnostic>>,
) -> Result<Arc<T>, Vec<Diagnostic>> {
    let lock = || kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(value) = lock().get(&key) {
        return Ok(value.clone());
    }
    let value = Arc::new(make()?);
    lock().insert(key, value.clone());
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
            let key = Key::stage("grow", 1).params(params).finish();
            remember(&memory.sources, key, || {
                grow::grow(params, Seed::new(params.seed).child("grow"))
                    .map(|(plant, notes)| SourcePlant { plant, notes })
                    .map_err(|error| vec![Diagnostic::new(format!("source {}", source.name), error.to_string())])
            })
        }
        SourceRecipe::Import(params) => {
            let input = &inputs[&params.file];
            let key = Key::stage("import", 1).params(params).input(Key::of_bytes(&input.bytes)).finish();
            remember(&memory.sources, key, || {
                import::import(&input.bytes, &input.shown, params)
                    .map(|imported| SourcePlant { plant: imported.plant, notes: imported.notes })
            })
        }
    }
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
    remember(&memory.pictures, key.finish(), || {
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
        let file = match error.file() {
            ArtFile::Color => files[0],
            ArtFile::Normal => files[1],
            ArtFile::Roughness => files[2],
        };
        let shown = inputs.get(file).map_or(file, |input| input.shown.as_str());
        vec![Diagnostic::new(shown, error.to_string())]
    })
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
                let pair = format!("{} and {}", plan.sources[from].name, plan.sources[to].name);
                vec![Diagnostic::new(format!("sources {pair}"), error.to_string())]
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
