//! The stages in order: from a plan and its inputs to the files of a set. Reads like a table of contents.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use glam::Vec3;
use rayon::prelude::*;

use super::record::manifest_name;
use super::World;
use crate::bake::{self, Atlas, Maps};
use crate::base::{Diagnostic, Key, Note, Seed};
use crate::export::{self, Manifest};
use crate::lod::{self, Ladder};
use crate::mesh::TreeMesh;
use crate::plant::Plant;
use crate::preset::Plan;
use crate::preset::plan::{BarkArt, LeafArt, MatchParams, Source, SourceRecipe, Variant};
use crate::relate::Family;
use crate::source::{grow, import};
use crate::{blend, dress};

/// Raised whenever a stage's output changes for the same parameters and inputs, so that current sets are built again.
const PIPELINE_VERSION: u32 = 1;

/// The bytes that a plan's files hold: path as the plan has it, bytes, and the name that is shown to people.
pub type Inputs = BTreeMap<String, InputFile>;

/// One file that a plan names.
#[derive(Clone, Debug)]
pub struct InputFile {
    /// What it holds.
    pub bytes: Vec<u8>,
    /// What it is called in messages.
    pub shown: String,
}

/// The files of a set.
#[derive(Clone, Debug)]
pub struct SetFiles {
    /// Name and bytes; the manifest is the last.
    pub files: Vec<(String, Vec<u8>)>,
    /// What was mended, bridged or dropped.
    pub notes: Vec<Note>,
}

/// Sources and pictures by their keys, kept between builds of one process. A hit never changes a byte.
#[derive(Debug, Default)]
pub struct Memory {
    sources: Mutex<BTreeMap<Key, Arc<SourcePlant>>>,
    pictures: Mutex<BTreeMap<Key, Arc<Pictures>>>,
}

/// A source and what was mended in it.
#[derive(Clone, Debug)]
struct SourcePlant {
    plant: Plant,
    notes: Vec<String>,
}

/// What leaves and bark wear.
#[derive(Clone, Debug)]
struct Pictures {
    leaves: Vec<Maps>,
    bark: Maps,
}

/// Reads every file that a plan names.
///
/// # Errors
///
/// One for each file that can't be read, in the preset.
pub fn read_inputs(plan: &Plan, preset: &str, world: &World) -> Result<Inputs, Vec<Diagnostic>> {
    let mut inputs = Inputs::new();
    let mut errors = Vec::new();
    for (file, field) in files_of(plan) {
        if inputs.contains_key(&file) {
            continue;
        }
        match world.read(&file) {
            Ok(bytes) => {
                let shown = super::find::shown(&world.path(&file));
                inputs.insert(file, InputFile { bytes, shown });
            }
            Err(why) => errors.push(
                Diagnostic::new(preset, format!("can't read {file}: {why}"))
                    .with_field(field)
                    .with_hint("paths are relative to the preset's folder"),
            ),
        }
    }
    if errors.is_empty() { Ok(inputs) } else { Err(errors) }
}

/// The files that a plan names, each with the field that names it.
fn files_of(plan: &Plan) -> Vec<(String, String)> {
    let mut files = Vec::new();
    for source in &plan.sources {
        if let SourceRecipe::Import(params) = &source.recipe {
            files.push((params.file.clone(), format!("sources.{}.file", source.name)));
        }
    }
    if let LeafArt::Files { color, normal } = &plan.leaf_art {
        files.push((color.clone(), "foliage.leaf.color".to_owned()));
        files.push((normal.clone(), "foliage.leaf.normal".to_owned()));
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
    let mut key = Key::stage(concat!("set ", env!("CARGO_PKG_VERSION")), PIPELINE_VERSION).params(plan);
    for (file, input) in inputs {
        key = key.params(file).input(Key::of_bytes(&input.bytes));
    }
    key.finish()
}

/// How many times [`make_set`] tells of a step.
#[must_use]
pub fn steps(plan: &Plan) -> usize {
    plan.sources.len() + 2 * plan.variants.len() + 4
}

/// Makes every file of a set. Pure: the same plan, inputs and version give the same bytes on any number of threads.
///
/// # Errors
///
/// Everything that is wrong with the sources, or the first thing that is wrong with the pictures.
pub fn make_set(
    plan: &Plan,
    inputs: &Inputs,
    key: Key,
    memory: &Memory,
    step: &(dyn Fn(&str) + Sync),
) -> Result<SetFiles, Vec<Diagnostic>> {
    let seed = Seed::new(plan.seed);
    let sources = make_sources(plan, inputs, memory, step)?;
    let pictures = make_pictures(plan, inputs, memory, seed)?;
    step("leaves and bark");
    let families = make_families(plan, &sources);
    step("matching");

    let made: Vec<(Plant, Ladder)> = plan
        .variants
        .par_iter()
        .map(|variant| {
            // Addressed by what the variant is, not by its place in the list: adding one changes no other.
            let seed = seed.child(&identity(plan, variant));
            let bare = make_variant(variant, &sources, &families, seed);
            let plant = dress::dress(&bare, &plan.dress, seed.child("dress"));
            step("dressed");
            let ladder =
                lod::ladder(&plant, &plan.mesh, &plan.lods, &pictures.leaves, &pictures.bark, seed.child("lod"));
            step("levels of detail");
            (plant, ladder)
        })
        .collect();
    let (plants, ladders): (Vec<Plant>, Vec<Ladder>) = made.into_iter().unzip();

    let atlas = make_atlas(plan, &pictures, &ladders)?;
    step("atlas");
    let levels = place(&ladders, &atlas, pictures.leaves.len());
    let set = assets::SetParts { plan, key, plants: &plants, ladders: &ladders, levels: &levels, atlas: &atlas };
    let mut notes = source_notes(plan, &sources);
    let files = assets::files(&set, &pictures.bark, &mut notes)?;
    step("written");
    Ok(SetFiles { files, notes })
}
