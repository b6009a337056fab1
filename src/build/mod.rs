//! From presets to sets of files: what a build step, a watcher and an editor call.
//!
//! [`Builder::build`] takes preset files; for each it resolves the plan ([`load_preset`]), reads what the plan names
//! through a [`World`], makes the files of the set ([`pipeline::make_set`]) and commits them as one
//! (`output.rs`). A set whose key (version, plan and inputs) is the one in its manifest, and whose files still
//! have the hashes listed there, is left alone; where nothing was touched since the last build, that is known without
//! reading a file (`index`). [`make_set`] does the same for files in memory, and gives the set's files back.

mod around;
mod assets;
mod blends;
mod builder;
mod cache;
mod clips;
mod depfile;
mod entries;
mod facts;
mod fewer;
mod find;
mod gallery;
mod index;
mod morphs;
mod output;
pub mod pipeline;
mod plan;
mod record;
pub(crate) mod replace;
mod selections;
mod shapes;
mod sheet;
mod sketches;
mod specimens;
mod stages;
pub(crate) mod stamp;
mod studio;
mod textures;
mod trees;
mod turning;
mod unlike;
mod uses;
mod wardrobe;
mod wears;
mod world;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[cfg(feature = "cli")]
pub(crate) use builder::Names;
pub use builder::{Builder, check, make_part, make_set};
pub use cache::{Cache, CacheError, CacheOptions, CacheStats, PartError, clear as clear_cache, stats as cache_stats};
pub use depfile::depfile;
pub use entries::entry_is_sound;
pub use find::{Loaded, find_presets, load_edited, load_preset};
pub use gallery::{GALLERY, gallery};
pub use pipeline::{SetFiles, Share};
pub use plan::{Step, StepKind, ninja, plan};
pub use specimens::{Specimen, draw_specimens, specimens};
pub use studio::{Focus, Studio, StudioStroke, extent};
pub use world::World;

use crate::base::{Diagnostic, Key, Note};
pub use output::Committed;

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
    /// Where stages keep what they made for other processes; without it only this process remembers.
    pub cache: Option<CacheOptions>,
    /// Build also what is current.
    pub force: bool,
    /// Build every set that can be built, also when another one fails. Without, a preset that can't be read keeps all
    /// sets from being built, and a set that fails those after it.
    pub keep_going: bool,
    /// Make only a part of the trees, and only into the cache.
    pub shard: Option<Shard>,
    /// What it may take.
    pub limits: Limits,
}

/// What a build may take of the machine. What a preset may ask for is limited by its schema.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest file that is read, bytes.
    pub file: u64,
    /// Most bytes of finished stages that are kept in memory; what is used at the moment comes on top.
    pub memory: usize,
    /// The folder that everything lies in that may be read, wherever paths and links lead; anywhere without.
    pub root: Option<PathBuf>,
}

impl Default for Limits {
    /// Files of 1 GiB, 768 MiB in memory, from anywhere.
    fn default() -> Self {
        Self { file: 1 << 30, memory: 768 << 20, root: None }
    }
}

impl BuildOptions {
    /// Builds what is not current into `out`, up to the first failure, without a cache on disk.
    #[must_use]
    pub fn new(out: impl Into<PathBuf>) -> Self {
        Self { out: out.into(), cache: None, force: false, keep_going: false, shard: None, limits: Limits::default() }
    }
}

/// One of several processes that share a cache: it makes every `of`th tree of each set, beginning with number `index`.
/// When all have, a plain build finds every tree in the cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0 to `of` - 1.
    pub index: u32,
    /// 1 or more.
    pub of: u32,
}

impl Shard {
    /// Whether the tree in this place is made here.
    #[must_use]
    pub const fn has(self, place: usize) -> bool {
        place as u64 % self.of as u64 == self.index as u64
    }
}

/// What a build did with a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Happened {
    /// Nothing that it depends on had changed.
    Current,
    /// It was made and written.
    Built,
    /// So many of its trees were made for the cache, and nothing was written.
    Shard {
        /// How many.
        trees: usize,
    },
}

/// What a build would find.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SetState {
    /// The outputs are what the preset makes.
    Current,
    /// There is no such set yet.
    New,
    /// The preset, or a file that it reads, has changed since, or Treewright has.
    Changed,
    /// Files were changed or removed by somebody.
    Damaged {
        /// Their names.
        files: Vec<String>,
    },
    /// Its preset is gone.
    Orphaned {
        /// The preset.
        preset: PathBuf,
    },
}

/// A set and what a build would find.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SetStatus {
    /// The set's name.
    pub set: String,
    /// Where it lies.
    pub folder: PathBuf,
    /// What a build would find.
    pub state: SetState,
}

/// What happened to one set.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The set's name.
    pub set: String,
    /// How many variants it has.
    pub variants: usize,
    /// What was done with it.
    pub happened: Happened,
    /// What the commit did.
    pub committed: Committed,
    /// What was mended, bridged or dropped.
    pub notes: Vec<Note>,
    /// Every file that was read or looked for, with its content key.
    pub reads: BTreeMap<PathBuf, Option<Key>>,
    /// From when its inputs were read to the last rename.
    pub took: Duration,
}

impl Outcome {
    /// Of a set that is as it should be.
    fn current(set: String, variants: usize, reads: BTreeMap<PathBuf, Option<Key>>) -> Self {
        let (happened, committed, notes) = (Happened::Current, Committed::default(), Vec::new());
        Self { set, variants, happened, committed, notes, reads, took: Duration::ZERO }
    }
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
