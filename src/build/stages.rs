//! The stages as the pipeline calls them: each takes its own part of the plan and the results of earlier ones.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use rayon::prelude::*;

use super::pipeline::Inputs;
use crate::bake::{self, Maps};
use crate::base::{Diagnostic, Key, Note, Seed};
use crate::blend;
use crate::plant::Plant;
use crate::preset::Plan;
use crate::preset::plan::{BarkArt, LeafArt, MatchParams, Source, SourceRecipe, Variant};
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
            let key = Key::stage("grow", grow::VERSION).params(params).finish();
            remember(&memory.sources, key, || {
                grow::grow(params, Seed::new(params.seed).child("grow"))
                    .map(|(plant, notes)| SourcePlant { plant, notes })
                    .map_err(|error| {
                        vec![Diagnostic::new(format!("source {}", source.name), error.to_string())]
                    })
            })
        }
        SourceRecipe::Import(params) => {
            let input = &inputs[&params.file];
            let key = Key::stage("import", import::VERSION).params(params).input(Key::of_bytes(&input.bytes)).finish();
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
pub(super) fn pictures(
    plan: &Plan,
    inputs: &Inputs,
    memory: &Memory,
) -> Result<Arc<Pictures>, Vec<Diagnostic>> {
    let seed = Seed::new(plan.seed);
    let mut key = Key::stage("pictures", bake::ART_VERSION)
        .number(plan.seed)
        .number(u64::from(plan.dress.pictures))
        .params(&plan.leaf_art)
        .params(&plan.bark_art);
    for file in super::pipeline::picture_files(plan) {
        key = key.input(Key::of_bytes(&inputs[file].bytes));
    }
    remember(&memory.pictures, key.finish(), || {
        let leaves = match &plan.leaf_art {
            LeafArt::Made { shape, color, variation, size } => (0..u32::from(plan.dress.pictures))
                .into_par_iter()
                .map(|picture| bake::leaf_maps(*shape, *color, *variation, *size, picture, seed.child("leaves")))
                .collect(),
            LeafArt::Files { color, normal } => vec![user_maps(inputs, bake::PictureUse::Leaf, color, normal, "")?],
        };
        let bark = match &plan.bark_art {
            BarkArt::Made { pattern, color, size } => bake::bark_maps(*pattern, *color, *size, seed.child("bark")),
            BarkArt::Files { color, normal, roughness } => {
                user_maps(inputs, bake::PictureUse::Bark, color, normal, roughness)?
            }
        };
        Ok(Pictures { leaves, bark })
    })
}

/// Decodes pictures of the user's; an empty name is a map that was not given.
fn user_maps(
    inputs: &Inputs,
    usage: bake::PictureUse,
    color: &str,
    normal: &str,
    roughness: &str,
) -> Result<Maps, Vec<Diagnostic>> {
    let bytes = |file: &str| inputs.get(file).map(|input| input.bytes.as_slice());
    let color_bytes = bytes(color).unwrap_or_default();
    bake::maps_from_images(usage, color_bytes, bytes(normal), bytes(roughness)).map_err(|error| {
        let shown = |file: &str| inputs.get(file).map_or_else(|| file.to_owned(), |input| input.shown.clone());
        let file = match error.map {
            bake::ArtMap::Color => shown(color),
            bake::ArtMap::Normal => shown(normal),
            bake::ArtMap::Roughness => shown(roughness),
        };
        vec![Diagnostic::new(file, error.to_string())]
    })
}

/// Matches every pair of sources that a variant blends, each once.
pub(super) fn families(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Families {
    let mut pairs: Vec<(usize, usize, MatchParams)> = Vec::new();
    for variant in &plan.variants {
        if let Variant::Blend { from, to, matching, .. } = variant {
            if !pairs.contains(&(*from, *to, *matching)) {
                pairs.push((*from, *to, *matching));
            }
        }
    }
    pairs
        .into_par_iter()
        .map(|(from, to, matching)| {
            let family = relate::fuzzy_family(&sources[from].plant, &sources[to].plant, &matching);
            ((from, to, matching), family)
        })
        .collect()
}

/// One variant, bare.
pub(super) fn variant(variant: &Variant, sources: &[Arc<SourcePlant>], families: &Families, seed: Seed) -> Plant {
    match variant {
        Variant::Source(index) => sources[*index].plant.clone(),
        Variant::Blend { from, to, matching, batch, progress } => {
            let pair = (*from, *to, *matching);
            let family = families.iter().find(|(key, _)| *key == pair).map(|(_, family)| family);
            let family = family.expect("families holds every pair that a variant blends");
            family.blend(&blend::sample(family, seed.child("schedule").at(*batch), *progress))
        }
    }
}

/// What a variant is, in words: the address of its randomness.
pub(super) fn identity(plan: &Plan, variant: &Variant) -> String {
    match variant {
        Variant::Source(index) => format!("source {}", plan.sources[*index].name),
        Variant::Blend { from, to, batch, progress, .. } => {
            let name = |index: usize| &plan.sources[index].name;
            format!("blend {} {} batch {batch} at {progress:.4}", name(*from), name(*to))
        }
    }
}
