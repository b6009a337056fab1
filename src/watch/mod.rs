//! Watching: a saved preset, species or source file rebuilds the sets that read it.
//!
//! The folders of every file that the last build read are watched, also of files that are missing, so editors that save
//! by rename are seen. Reading a file raises access events of its own; only creation, change and removal count. What a
//! build writes is told from what people write by the output folder's prefix. A burst of events is one rebuild; events
//! that arrive during a build are taken after it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use notify::event::{AccessKind, AccessMode};
use notify::{EventKind, RecommendedWatcher, RecursiveMode};
use notify_debouncer_full::{DebounceEventResult, Debouncer, RecommendedCache, new_debouncer};

use crate::build::{BuildError, BuildOptions, Builder, Progress, find_presets};

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
    out: PathBuf,
    builder: Builder,
    debouncer: Debouncer<RecommendedWatcher, RecommendedCache>,
    events: Receiver<DebounceEventResult>,
    watched: BTreeSet<PathBuf>,
    /// For each preset the absolute paths that its last build read.
    reads: BTreeMap<PathBuf, BTreeSet<PathBuf>>,
}

impl Watcher {
    /// Starts to watch `folder`; sets go to `out`.
    ///
    /// # Errors
    ///
    /// When the folder can't be watched.
    pub fn new(folder: &Path, out: &Path) -> Result<Self, WatchError> {
        let fail = |source| WatchError { folder: folder.to_path_buf(), source };
        let (sender, events) = channel();
        let debouncer = new_debouncer(QUIET, None, sender).map_err(fail)?;
        let mut watcher = Self {
            folder: folder.to_path_buf(),
            out: absolute(out),
            builder: Builder::new(BuildOptions { out: out.to_path_buf(), force: false }),
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
                (Some(touched), Some(reads)) => !touched.is_disjoint(reads),
                _ => true,
            };
            if !concerned {
                continue;
            }
            let built = self.builder.build(std::slice::from_ref(&preset), &|progress| {
                tell(Event::Build(progress));
            });
            let mut reads = BTreeSet::from([absolute(&preset)]);
            match built {
                Ok(outcomes) => reads.extend(outcomes.iter().flat_map(|o| o.reads.keys()).map(|path| absolute(path))),
                Err(error) => {
                    // What it read is not known now: keep what it read last, and the files that the errors are about.
                    reads.extend(self.reads.get(&preset).cloned().unwrap_or_default());
                    if let BuildError::Input(diagnostics) = &error {
                        reads.extend(diagnostics.iter().map(|d| absolute(Path::new(&d.file))));
                    }
                    tell(Event::Failed(error));
                }
            }
            for path in &reads {
                // A folder that can't be watched (gone, or the system's limit) must not end the others' watching.
                let _ = path.parent().map(|folder| self.listen(folder));
            }
            self.reads.insert(preset, reads);
        }
    }

    /// Waits for files that matter; none when the watcher was shut down.
    fn wait(&self) -> Option<BTreeSet<PathBuf>> {
        loop {
            let mut paths = BTreeSet::new();
            // One batch, then whatever has gathered during the last build.
            let first = self.events.recv().ok()?;
            for batch in std::iter::once(first).chain(self.events.try_iter()) {
                for event in batch.into_iter().flatten() {
                    if matters(event.kind) {
                        paths.extend(event.paths.iter().map(|p| absolute(p)).filter(|p| !p.starts_with(&self.out)));
                    }
                }
            }
            let known = |path: &PathBuf| self.reads.values().any(|reads| reads.contains(path));
            let preset = |path: &PathBuf| {
                path.extension().is_some_and(|e| e == "ron") && path.parent() == Some(&absolute(&self.folder))
            };
            if paths.iter().any(|path| known(path) || preset(path)) {
                return Some(paths);
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
