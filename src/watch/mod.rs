//! Watching: a saved preset, species or source file rebuilds the sets that read it.
//!
//! The folders of every file that the last build read are watched, also of files that are missing, so editors that save
//! by rename are seen; where a folder is missing, the nearest one above it that is there. Reading a file raises access
//! events of its own; only creation, change and removal count. What a build writes wakes nobody, also inside the watched
//! folder, as no preset reads it. A burst of events is one rebuild; events that arrive during a build are taken after it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use notify::event::{AccessKind, AccessMode};
use notify::{EventKind, RecommendedWatcher, RecursiveMode};
use notify_debouncer_full::{DebounceEventResult, Debouncer, RecommendedCache, new_debouncer};

use crate::build::{BuildError, BuildOptions, Builder, CacheOptions, Progress, find_presets};

/// How long a burst of events must be quiet before it is acted on.
const QUIET: Duration = Duration::from_millis(60);

/// What a watcher tells.
#[derive(Debug)]
pub enum Event<'a> {
    /// Something of a running build.
    Build(Progress<'a>),
    /// A build failed; the old sets stay.
    Failed(BuildError),
    /// All is built; waiting for a file to be saved.
    Idle {
        /// How many files the sets were made from.
        files: usize,
    },
}

/// A folder could not be watched.
#[derive(Debug, thiserror::Error)]
#[error("can't watch {folder}: {source}")]
pub struct WatchError {
    /// The folder.
    pub folder: PathBuf,
    /// What the system said.
    pub source: notify::Error,
}

/// Watches a folder of presets.
pub struct Watcher {
    folder: PathBuf,
    builder: Builder,
    debouncer: Debouncer<RecommendedWatcher, RecommendedCache>,
    events: Receiver<DebounceEventResult>,
    watched: BTreeSet<PathBuf>,
    /// For each preset the absolute paths that its last build read.
    reads: BTreeMap<PathBuf, BTreeSet<PathBuf>>,
}

impl Watcher {
    /// Starts to watch `folder`; sets go to `out`, what stages make into a cache where one
    /// is given.
    ///
    /// # Errors
    ///
    /// When the folder can't be watched.
    pub fn new(folder: &Path, out: &Path, cache: Option<CacheOptions>) -> Result<Self, WatchError> {
        let fail = |source| WatchError { folder: folder.to_path_buf(), source };
        let (sender, events) = channel();
        let debouncer = new_debouncer(QUIET, None, sender).map_err(fail)?;
        let mut watcher = Self {
            folder: folder.to_path_buf(),
            builder: Builder::new(BuildOptions { cache, ..BuildOptions::new(out) }),
            debouncer,
            events,
            watched: BTreeSet::new(),
            reads: BTreeMap::new(),
        };
        watcher.listen(&absolute(folder)).map_err(fail)?;
        Ok(watcher)
    }

    /// Builds everything, then rebuilds what saved files touch, until `tell` returns [`Next::Stop`] on
    /// [`Event::Idle`].
    pub fn run(&mut self, tell: &(dyn Fn(Event<'_>) -> Next + Sync)) {
        let mut touched: Option<BTreeSet<PathBuf>> = None;
        loop {
            self.rebuild(touched.as_ref(), tell);
            let files = self.reads.values().flatten().collect::<BTreeSet<_>>().len();
            if matches!(tell(Event::Idle { files }), Next::Stop) {
                return;
            }
            match self.wait() {
                Some(paths) => touched = Some(paths),
                None => return,
            }
        }
    }

    /// Builds the presets that read one of the touched files, or all.
    fn rebuild(&mut self, touched: Option<&BTreeSet<PathBuf>>, tell: &(dyn Fn(Event<'_>) -> Next + Sync)) {
        self.listen_near(&absolute(&self.folder).join("preset"));
        let presets = match find_presets(std::slice::from_ref(&self.folder)) {
            Ok(presets) => presets,
            Err(error) => {
                tell(Event::Failed(error));
                return;
            }
        };
        self.reads.retain(|preset, _| presets.contains(preset));
        for preset in presets {
            let concerned = match (touched, self.reads.get(&preset)) {
                (Some(touched), Some(reads)) => touched.iter().any(|path| concerns(path, reads)),
                _ => true,
            };
            if !concerned {
                continue;
            }
            let built = self.builder.build(std::slice::from_ref(&preset), &|progress| {
                tell(Event::Build(progress));
            });
            let mut reads = BTreeSet::from(names(&preset));
            let read: Vec<PathBuf> = match built {
                Ok(outcomes) => outcomes.into_iter().flat_map(|o| o.reads.into_keys()).collect(),
                Err(error) => {
                    let read = error.reads.keys().cloned().collect();
                    tell(Event::Failed(error));
                    read
                }
            };
            reads.extend(read.iter().flat_map(|path| names(path)));
            for path in &reads {
                self.listen_near(path);
            }
            self.reads.insert(preset, reads);
        }
    }

    /// Waits for files that matter; none when the watcher was shut down.
    fn wait(&mut self) -> Option<BTreeSet<PathBuf>> {
        loop {
            let mut paths = BTreeSet::new();
            // One batch, then whatever has gathered during the last build.
            let first = self.events.recv().ok()?;
            for batch in std::iter::once(first).chain(self.events.try_iter()) {
                for event in batch.into_iter().flatten() {
                    if event.need_rescan() {
                        // The system lost count: anything may have been saved.
                        paths.extend(self.reads.values().flatten().cloned());
                    } else if matters(event.kind) {
                        paths.extend(event.paths.iter().flat_map(|path| names(path)));
                    }
                }
            }
            // A folder that came or went takes the system's watch along.
            for folder in self.watched.extract_if(.., |folder| paths.contains(folder)) {
                let _ = self.debouncer.unwatch(folder);
            }
            let known = |path: &PathBuf| self.reads.values().any(|reads| concerns(path, reads));
            let folder = absolute(&self.folder);
            let preset = |path: &PathBuf| {
                path.starts_with(&folder)
                    && path.extension().is_some_and(|e| e == "ron")
                    && path.parent() == Some(&folder)
            };
            if paths.iter().any(|path| known(path) || preset(path) || *path == folder) {
                return Some(paths);
            }
        }
    }

    /// Listens to a file's folder, or to the nearest one above that is there. A folder that can't be watched (the
    /// system's limit) must not end the others' watching.
    fn listen_near(&mut self, path: &Path) {
        for folder in path.ancestors().skip(1) {
            if self.listen(folder).is_ok() {
                return;
            }
        }
    }

    fn listen(&mut self, folder: &Path) -> Result<(), notify::Error> {
        if self.watched.contains(folder) {
            return Ok(());
        }
        self.debouncer.watch(folder, RecursiveMode::NonRecursive)?;
        self.watched.insert(folder.to_path_buf());
        Ok(())
    }
}

/// Whether a watcher goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Go on.
    Watch,
    /// End.
    Stop,
}

fn matters(kind: EventKind) -> bool {
    match kind {
        EventKind::Create(_) | EventKind::Modify(_) | EventKind::Remove(_) | EventKind::Any => true,
        EventKind::Access(access) => access == AccessKind::Close(AccessMode::Write),
        EventKind::Other => false,
    }
}

/// Whether an event at `path` may change what is read: it is one of the files or a folder above one.
fn concerns(path: &Path, reads: &BTreeSet<PathBuf>) -> bool {
    // Paths below a folder follow it in order.
    reads.range(path.to_path_buf()..).next().is_some_and(|next| next.starts_with(path))
}

/// The names that events may give a file: where it stands, and where a link leads.
fn names(path: &Path) -> [PathBuf; 2] {
    let standing = match (path.parent(), path.file_name()) {
        (Some(folder), Some(name)) => {
            absolute(if folder.as_os_str().is_empty() { Path::new(".") } else { folder }).join(name)
        }
        _ => absolute(path),
    };
    [standing, absolute(path)]
}

/// The absolute path of a file that may not exist: its folder's real path, then its name.
fn absolute(path: &Path) -> PathBuf {
    if let Ok(real) = path.canonicalize() {
        return real;
    }
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    match (full.parent().and_then(|p| p.canonicalize().ok()), full.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => full,
    }
}
