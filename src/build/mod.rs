//! From presets to sets of files: what a build step, a watcher and an editor call.
//!
//! [`Builder::build`] takes preset files; for each it resolves the plan ([`load_preset`]), reads what the plan names
//! through a [`World`], makes the files of the set ([`pipeline::make_set`]) and commits them as one
//! ([`output::commit`]). A set whose key (version, plan and inputs) is the one in its manifest, and whose files still
//! have the hashes listed there, is left alone.

mod assets;
mod blends;
mod find;
pub mod output;
pub mod pipeline;
mod record;
mod selections;
mod shapes;
mod stages;
mod world;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

pub use find::{Loaded, find_presets, load_preset};
pub use pipeline::{Memory, SetFiles};
pub use world::World;

use crate::base::{Diagnostic, Key, Note};
use output::{Committed, OutputError, Turn};

/// Why a build failed; everything that could be built was.
#[derive(Debug)]
pub struct BuildError {
    /// Everything that is wrong with presets, inputs and the output folder.
    pub diagnostics: Vec<Diagnostic>,
    /// What happened to the sets that could be built.
    pub built: Vec<Outcome>,
    /// Every file that was read or looked for, of the failed sets too, with its content key.
    pub reads: BTreeMap<PathBuf, Option<Key>>,
}

impl BuildError {
    /// Errors before anything was built.
    pub(crate) fn of(diagnostics: Vec<Diagnostic>) -> Self {
        Self { diagnostics, built: Vec::new(), reads: BTreeMap::new() }
    }
}

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.diagnostics.iter().enumerate().try_for_each(|(i, diagnostic)| {
            let separator = if i == 0 { "" } else { "\n" };
            write!(f, "{separator}{diagnostic}")
        })
    }
}

impl std::error::Error for BuildError {}

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
    /// Somebody else builds into the output folder; the build goes on when that is done.
    Waiting,
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
        let loaded: Vec<_> = presets.par_iter().map(|preset| find::load_or_reads(preset)).collect();
        let mut failed = BuildError::of(Vec::new());
        let mut names = Names::default();
        for (preset, loaded) in presets.iter().zip(loaded) {
            let result = match loaded {
                Err((diagnostics, world)) => Err((diagnostics, world.reads())),
                Ok(loaded) => {
                    let built = names.claim(preset, &loaded).and_then(|()| self.set(&loaded, progress));
                    built.map_err(|diagnostics| (loaded.placed(diagnostics), loaded.world.reads()))
                }
            };
            match result {
                Ok(outcome) => failed.built.push(outcome),
                Err((diagnostics, reads)) => {
                    failed.diagnostics.extend(diagnostics);
                    failed.reads.extend(reads);
                }
            }
        }
        if failed.diagnostics.is_empty() { Ok(failed.built) } else { Err(failed) }
    }

    /// Builds one set.
    fn set(&self, loaded: &Loaded, progress: &(dyn Fn(Progress<'_>) + Sync)) -> Result<Outcome, Vec<Diagnostic>> {
        let refused = |error: OutputError| vec![error.diagnostic()];
        let plan = &loaded.plan;
        let folder = self.options.out.join(&plan.name);
        let inputs = pipeline::read_inputs(loaded)?;
        let key = pipeline::set_key(plan, &inputs);
        // Held until the set is written: who waited for it finds the set current and has nothing to do.
        let _turn = Turn::take(&self.options.out, || progress(Progress::Waiting)).map_err(refused)?;
        output::recover(&folder).map_err(refused)?;
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
            let made = pipeline::make_set(plan, &inputs, key, &self.memory, &step)?;
            let owned = old.map(|old| old.owned()).unwrap_or_default();
            outcome.committed = output::commit(&folder, &owned, &made.files).map_err(refused)?;
            outcome.notes = made.notes;
        }
        progress(Progress::Set { outcome: &outcome, folder: &folder });
        Ok(outcome)
    }
}

/// Resolves presets and reads every file that they name as a build would, without building. Returns how many are good.
/// What only growing, matching and packing can find is left to the build.
///
/// # Errors
///
/// All errors of all presets.
pub fn check(presets: &[PathBuf]) -> Result<usize, BuildError> {
    let mut names = Names::default();
    let mut diagnostics = Vec::new();
    for preset in presets {
        let checked = load_preset(preset).and_then(|loaded| {
            names.claim(preset, &loaded)?;
            let inputs = pipeline::read_inputs(&loaded)?;
            pipeline::check_inputs(&loaded.plan, &inputs).map_err(|found| loaded.placed(found))
        });
        diagnostics.extend(checked.err().into_iter().flatten());
    }
    if diagnostics.is_empty() { Ok(presets.len()) } else { Err(BuildError::of(diagnostics)) }
}

/// The names of sets and who has them; upper and lower case are one, as they are to many file systems.
#[derive(Debug, Default)]
struct Names(BTreeMap<String, String>);

impl Names {
    fn claim(&mut self, preset: &Path, loaded: &Loaded) -> Result<(), Vec<Diagnostic>> {
        match self.0.entry(loaded.plan.name.to_lowercase()) {
            Entry::Occupied(other) => {
                let message = format!("its set has the same name as that of {}", other.get());
                Err(vec![Diagnostic::new(find::shown(preset), message).with_hint(
                    "a set is named after its preset: rename one of them, or build them into two output folders",
                )])
            }
            Entry::Vacant(free) => {
                free.insert(find::shown(preset));
                Ok(())
            }
        }
    }
}
