//! From presets to sets of files: what a build step, a watcher and an editor call.
//!
//! [`Builder::build`] takes preset files; for each it resolves the plan ([`load_preset`]), reads what the plan names
//! through a [`World`], makes the files of the set ([`pipeline::make_set`]) and commits them as one
//! ([`output::commit`]). A set whose key (version, plan and inputs) is the one in its manifest, and whose files still
//! have the hashes listed there, is left alone.

mod assets;
mod find;
pub mod output;
pub mod pipeline;
mod record;
mod stages;
mod world;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

pub use find::{Loaded, find_presets, load_preset};
pub use pipeline::{Memory, SetFiles};
pub use world::World;

use crate::base::{Diagnostic, Key, Note};
use output::Committed;

/// Why a build failed; everything that could be built was.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Presets or inputs are wrong.
    #[error("{} errors in presets and inputs", .0.len())]
    Input(Vec<Diagnostic>),
    /// A set could not be written.
    #[error(transparent)]
    Output(#[from] output::OutputError),
}

/// How to build.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// The folder that sets are written to, each into a folder of its own name.
    pub out: PathBuf,
    /// Build also what is current.
    pub force: bool,
}

/// What happened to one set.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The set's name.
    pub set: String,
    /// How many variants it has.
    pub variants: usize,
    /// Whether nothing that the set depends on had changed.
    pub current: bool,
    /// What the commit did.
    pub committed: Committed,
    /// What was mended, bridged or dropped.
    pub notes: Vec<Note>,
    /// Every file that was read or looked for, with its content key.
    pub reads: BTreeMap<PathBuf, Option<Key>>,
}

/// What a build tells while it runs.
#[derive(Debug)]
pub enum Progress<'a> {
    /// So many steps more will be taken.
    Steps(usize),
    /// One step was taken.
    Step {
        /// The set.
        set: &'a str,
        /// What was done.
        what: &'a str,
    },
    /// A set is done.
    Set {
        /// What happened.
        outcome: &'a Outcome,
        /// Where it lies.
        folder: &'a Path,
    },
}

/// Builds sets; keeps grown sources and made pictures in memory between calls, so that a watcher makes them once.
#[derive(Debug)]
pub struct Builder {
    options: BuildOptions,
    memory: Memory,
}

impl Builder {
    /// A builder with nothing in memory.
    #[must_use]
    pub fn new(options: BuildOptions) -> Self {
        Self { options, memory: Memory::default() }
    }

    /// Builds the sets of some preset files, in their order.
    ///
    /// # Errors
    ///
    /// All errors of all presets; the sets of the good ones are built and written.
    pub fn build(
        &self,
        presets: &[PathBuf],
        progress: &(dyn Fn(Progress<'_>) + Sync),
    ) -> Result<Vec<Outcome>, BuildError> {
        let loaded: Vec<_> = presets.par_iter().map(|preset| load_preset(preset)).collect();
        let mut errors = Vec::new();
        let mut outcomes = Vec::new();
        let mut names: BTreeMap<String, &Path> = BTreeMap::new();
        for (preset, loaded) in presets.iter().zip(loaded) {
            let built = loaded.and_then(|loaded| match names.insert(loaded.plan.name.to_lowercase(), preset) {
                Some(other) => Err(vec![
                    Diagnostic::new(
                        find::shown(preset),
                        format!("its set has the same name as that of {}", find::shown(other)),
                    )
                    .with_hint("rename one of the preset files; a set is named after its preset"),
                ]),
                None => self.set(&loaded, progress).map_err(|error| match error {
                    BuildError::Input(diagnostics) => diagnostics,
                    BuildError::Output(error) => vec![Diagnostic::new(find::shown(preset), error.to_string())],
                }),
            });
            match built {
                Ok(outcome) => outcomes.push(outcome),
                Err(mut diagnostics) => errors.append(&mut diagnostics),
            }
        }
        if errors.is_empty() { Ok(outcomes) } else { Err(BuildError::Input(errors)) }
    }

    /// Builds one set.
    fn set(&self, loaded: &Loaded, progress: &(dyn Fn(Progress<'_>) + Sync)) -> Result<Outcome, BuildError> {
        let plan = &loaded.plan;
        let folder = self.options.out.join(&plan.name);
        output::recover(&folder)?;
        let inputs = pipeline::read_inputs(loaded).map_err(BuildError::Input)?;
        let key = pipeline::set_key(plan, &inputs);
        let old = record::read(&folder, &plan.name);
        let mut outcome = Outcome {
            set: plan.name.clone(),
            variants: plan.variants.len(),
            current: false,
            committed: Committed::default(),
            notes: Vec::new(),
            reads: loaded.world.reads(),
        };
        if !self.options.force && old.as_ref().is_some_and(|old| old.key == key.to_hex() && old.is_whole(&folder)) {
            outcome.current = true;
        } else {
            let step = |what: &str| progress(Progress::Step { set: &plan.name, what });
            progress(Progress::Steps(pipeline::steps(plan)));
            let made = pipeline::make_set(plan, &inputs, key, &self.memory, &step).map_err(BuildError::Input)?;
            let owned = old.map(|old| old.owned()).unwrap_or_default();
            outcome.committed = output::commit(&folder, &owned, &made.files)?;
            outcome.notes = made.notes;
        }
        progress(Progress::Set { outcome: &outcome, folder: &folder });
        Ok(outcome)
    }
}
