//! Watching: a saved preset, species or source file rebuilds the sets that read it.
//!
//! The folders of every file that the last build read are watched, also of files that are missing, so editors that save
//! by rename are seen; where a folder is missing, the nearest one above it that is there. So is the folder of every link
//! on the way to a file: a link that is put in the place of another leads elsewhere. Reading a file raises access
//! events of its own; only creation, change and removal count. What a build writes wakes nobody, also inside the watched
//! folder, as no preset reads it. A burst of events is one rebuild. What is saved while sets are built is built next: it waits
//! for one set, not for all that are due. After a rebuild come the page that shows all sets and the sets whose preset is gone.
//! A file in a folder that was not watched yet may be saved between its being read and the folder's being watched: what
//! is that young is compared again.
//!
//! When the system watches no more folders for us (Linux limits how many a user may), or not at all, the files are
//! looked at every half second instead (`poll`), and [`Event::Polling`] says so. The same can be asked for, since
//! network drives and some virtual machines' shared folders tell of no change that others make.

mod poll;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use notify::event::{AccessKind, AccessMode, ModifyKind, RenameMode};
use notify::{ErrorKind, EventKind, RecommendedWatcher, RecursiveMode, Watcher as _};

use crate::base::{Diagnostic, Key};
use crate::build::{
    BuildError, BuildOptions, Builder, CacheOptions, Limits, Progress, SetStatus, draw_specimens, find_presets,
};
use crate::build::{Names, stamp};
use poll::Seen;

/// How long it must be quiet before events are acted on: when all files that they are about were closed or put in place
/// by a rename, and when one was begun that nobody has said to be finished (not every system tells of closing). An editor's
/// truncating and writing lie closer; what takes longer, as a checkout, is built more than once, and the last build is the
/// right one.
const SETTLED: Duration = Duration::from_millis(4);
const QUIET: Duration = Duration::from_millis(25);
/// The same while one of the files is gone: programs that remove a picture and rename another to its name, and scanners that hold
/// it in between, take longer, and nobody who deletes a file waits for what comes of it.
const GONE: Duration = Duration::from_millis(200);
/// The longest that events which never cease are waited for.
const PATIENCE: Duration = Duration::from_millis(250);
/// How often files are looked at where the system does not tell.
const POLL: Duration = Duration::from_millis(500);

/// What to watch, and how.
#[derive(Clone, Debug)]
pub struct WatchOptions {
    /// The folder of presets.
    pub folder: PathBuf,
    /// The folder that the sets are written to.
    pub out: PathBuf,
    /// Where stages keep what they made for other processes.
    pub cache: Option<CacheOptions>,
    /// What builds may take.
    pub limits: Limits,
    /// Look at the files this often, and ask the system for nothing.
    pub poll: Option<Duration>,
}

impl WatchOptions {
    /// Asks the system, without a cache on disk.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>, out: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), out: out.into(), cache: None, limits: Limits::default(), poll: None }
    }
}

/// What a watcher tells.
#[derive(Debug)]
pub enum Event<'a> {
    /// A preset, or a file that it reads, was saved, or all is built for the first time: this preset's set comes next.
    /// What is told up to the next such event is about it.
    Preset(&'a Path),
    /// Something of a running build.
    Build(Progress<'a>),
    /// A build failed; the old sets stay.
    Failed(BuildError),
    /// From now on files are looked at every so often.
    Polling {
        /// How often.
        every: Duration,
        /// Why, when it was not asked for.
        why: Option<String>,
    },
    /// The preset of a set is gone; told once.
    Orphaned(&'a SetStatus),
    /// A file of the page that shows all sets can't be written.
    Unwritten(Diagnostic),
    /// All is built; waiting for a file to be saved.
    Idle {
        /// How many files the sets were made from.
        files: usize,
    },
}

/// Watches a folder of presets.
pub struct Watcher {
    folder: PathBuf,
    out: PathBuf,
    limits: Limits,
    /// The sets without a preset that were told.
    orphans: BTreeSet<String>,
    builder: Builder,
    /// What the system tells by; none where it can't or shall not.
    system: Option<RecommendedWatcher>,
    events: Receiver<notify::Result<notify::Event>>,
    /// Keeps the channel open when the system tells nothing.
    _sender: Sender<notify::Result<notify::Event>>,
    watched: BTreeSet<PathBuf>,
    /// For each preset the absolute paths that its last build read.
    reads: BTreeMap<PathBuf, BTreeSet<PathBuf>>,
    polling: Option<Polling>,
}

/// Files are looked at.
struct Polling {
    every: Duration,
    seen: Seen,
    /// To be told, once.
    why: Option<Option<String>>,
}

impl Watcher {
    /// Starts to watch. Where the system can't, files are looked at instead.
    #[must_use]
    pub fn new(options: WatchOptions) -> Self {
        let WatchOptions { folder, out, cache, limits, poll } = options;
        let (sender, events) = channel();
        let mut watcher = Self {
            folder,
            builder: Builder::new(BuildOptions { cache, limits: limits.clone(), ..BuildOptions::new(&out) }),
            out,
            limits,
            orphans: BTreeSet::new(),
            system: None,
            events,
            _sender: sender.clone(),
            watched: BTreeSet::new(),
            reads: BTreeMap::new(),
            polling: poll.map(|every| Polling { every, seen: Seen::default(), why: Some(None) }),
        };
        if watcher.polling.is_none() {
            match notify::recommended_watcher(sender) {
                Ok(system) => watcher.system = Some(system),
                Err(error) => watcher.poll_because(&error),
            }
            let folder = absolute(&watcher.folder);
            watcher.listen_near(&folder.join("preset"));
        }
        watcher
    }

    /// What its builds keep.
    #[must_use]
    pub fn cache(&self) -> std::sync::Arc<crate::build::Cache> {
        self.builder.cache()
    }

    /// Looks at files from now on; what the system still tells is heard as well.
    fn poll_because(&mut self, error: &notify::Error) {
        if self.polling.is_none() {
            let why = match error.kind {
                ErrorKind::MaxFilesWatch => {
                    "the system watches no more folders (fs.inotify.max_user_watches)".to_owned()
                }
                _ => format!("the system can't watch: {error}"),
            };
            self.polling = Some(Polling { every: POLL, seen: Seen::default(), why: Some(Some(why)) });
        }
    }

    /// Builds everything, then rebuilds what saved files touch, until `tell` returns [`Next::Stop`] on
    /// [`Event::Idle`].
    pub fn run(&mut self, tell: &(dyn Fn(Event<'_>) -> Next + Sync)) {
        let mut touched = BTreeSet::new();
        // Presets that are not built yet, where something was saved meanwhile; all to begin with.
        let mut left = find_presets(std::slice::from_ref(&self.folder)).unwrap_or_default();
        loop {
            let start = stamp::now();
            // Looked at before it is read: what changes in between is seen as a change.
            touched.extend(self.look());
            let fresh = self.rebuild(&mut touched, &mut left, tell);
            if let Some(Polling { every, why, .. }) = &mut self.polling
                && let Some(why) = why.take()
            {
                tell(Event::Polling { every: *every, why });
            }
            let late = fresh.iter().filter(|(path, held)| changed_since(path, **held, start));
            let late: BTreeSet<PathBuf> = late.flat_map(|(path, _)| names(path)).collect();
            touched.extend(late);
            if !touched.is_empty() || !left.is_empty() {
                continue;
            }
            self.show(tell);
            let files = self.reads.values().flatten().collect::<BTreeSet<_>>().len();
            if matches!(tell(Event::Idle { files }), Next::Stop) {
                return;
            }
            match self.wait() {
                Some(paths) => touched = paths,
                None => return,
            }
        }
    }

    /// Remembers how the files look, and tells which look otherwise than before; those that are new to it look as ever.
    fn look(&mut self) -> BTreeSet<PathBuf> {
        let Some(polling) = &mut self.polling else { return BTreeSet::new() };
        let presets = find_presets(std::slice::from_ref(&self.folder)).unwrap_or_default();
        let presets: Vec<PathBuf> = presets.iter().flat_map(|preset| names(preset)).collect();
        polling.seen.look(self.reads.values().flatten().chain(&presets))
    }

    /// Builds the presets that read one of the touched files, then those that are left and those that are new; the files
    /// that they read in folders that were not watched before. What is saved meanwhile does not wait for all of them: it is
    /// `touched` afterwards, and what is still to be built `left`.
    fn rebuild(
        &mut self,
        touched: &mut BTreeSet<PathBuf>,
        left: &mut Vec<PathBuf>,
        tell: &(dyn Fn(Event<'_>) -> Next + Sync),
    ) -> BTreeMap<PathBuf, Option<Key>> {
        let (saved, waiting) = (std::mem::take(touched), std::mem::take(left));
        let mut fresh = BTreeMap::new();
        self.listen_near(&absolute(&self.folder).join("preset"));
        let presets = match find_presets(std::slice::from_ref(&self.folder)) {
            Ok(presets) => presets,
            Err(error) => {
                tell(Event::Failed(error));
                return fresh;
            }
        };
        self.reads.retain(|preset, _| presets.contains(preset));
        let is_saved = |preset: &PathBuf| match self.reads.get(preset) {
            Some(reads) => saved.iter().any(|path| concerns(path, reads)),
            None => names(preset).iter().any(|name| saved.contains(name)),
        };
        let is_due = |preset: &PathBuf| waiting.contains(preset) || !self.reads.contains_key(preset);
        let (first, rest): (Vec<&PathBuf>, Vec<&PathBuf>) = presets.iter().partition(|preset| is_saved(preset));
        let rest = rest.into_iter().filter(|preset| is_due(preset));
        let due: Vec<PathBuf> = first.into_iter().chain(rest).cloned().collect();
        let mut taken = Names::default();
        let clashes: BTreeMap<&PathBuf, Vec<Diagnostic>> = (presets.iter())
            .filter_map(|preset| Some((preset, taken.claim(preset, &preset.file_stem()?.to_string_lossy()).err()?)))
            .collect();
        for (i, preset) in due.iter().enumerate() {
            tell(Event::Preset(preset));
            if let Some(clash) = clashes.get(preset) {
                tell(Event::Failed(BuildError::of(clash.clone())));
                self.reads.insert(preset.clone(), names(preset));
                continue;
            }
            let built = self.builder.build(std::slice::from_ref(preset), &|progress| {
                tell(Event::Build(progress));
            });
            let read: BTreeMap<PathBuf, Option<Key>> = match built {
                Ok(outcomes) => outcomes.into_iter().flat_map(|outcome| outcome.reads).collect(),
                Err(mut error) => {
                    let read = std::mem::take(&mut error.reads);
                    tell(Event::Failed(error));
                    read
                }
            };
            let mut reads = names(preset);
            for (path, key) in &read {
                for name in names(path) {
                    let is_new = self.listen_near(&name);
                    if self.polling.as_mut().map_or(is_new, |polling| polling.seen.meet(&name)) {
                        fresh.insert(path.clone(), *key);
                    }
                    reads.insert(name);
                }
            }
            self.reads.insert(preset.clone(), reads);
            if i + 1 < due.len() {
                *touched = self.saved();
                if !touched.is_empty() {
                    *left = due[i + 1..].to_vec();
                    break;
                }
            }
        }
        fresh
    }

    /// Brings the page that shows all sets up to date, and tells of sets whose preset is gone, as a build of the folder does.
    fn show(&mut self, tell: &(dyn Fn(Event<'_>) -> Next + Sync)) {
        let folders = [self.folder.clone()];
        let presets = match find_presets(&folders) {
            Ok(presets) => presets,
            // The last one was deleted.
            Err(_) if self.folder.is_dir() => Vec::new(),
            Err(_) => return,
        };
        // Where nothing was built, there is nothing to show.
        if self.out.is_dir() {
            let drawn = draw_specimens(&self.folder, &self.out, &self.limits, &self.builder.cache());
            if let Err(error) = drawn.and_then(|_| self.builder.gallery(&presets)) {
                tell(Event::Unwritten(error));
            }
        }
        let orphans = self.builder.orphans(&folders, &presets);
        for status in orphans.iter().filter(|status| !self.orphans.contains(&status.set)) {
            tell(Event::Orphaned(status));
        }
        self.orphans = orphans.into_iter().map(|status| status.set).collect();
    }

    /// Waits for files that matter; none when the watcher was shut down.
    fn wait(&mut self) -> Option<BTreeSet<PathBuf>> {
        loop {
            let mut burst = Burst::default();
            let first = match &self.polling {
                None => Some(self.events.recv().ok()?),
                Some(polling) => match self.events.recv_timeout(polling.every) {
                    Ok(event) => Some(event),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => return None,
                },
            };
            burst.paths.extend(self.look());
            // What has gathered during the last build, and what comes until the files are whole.
            for event in first.into_iter().chain(self.events.try_iter()) {
                self.hear(event, &mut burst);
            }
            if let Some(paths) = self.settled(burst) {
                return Some(paths);
            }
        }
    }

    /// What was saved while sets were built; waits for nothing but for files to be whole.
    fn saved(&mut self) -> BTreeSet<PathBuf> {
        let mut burst = Burst { paths: self.look(), ..Burst::default() };
        for event in self.events.try_iter() {
            self.hear(event, &mut burst);
        }
        self.settled(burst).unwrap_or_default()
    }

    /// The paths of a burst when they are whole; none where none of them matters.
    fn settled(&mut self, mut burst: Burst) -> Option<BTreeSet<PathBuf>> {
        let begin = Instant::now();
        let mut last = begin;
        while self.concerns_us(&burst.paths) && begin.elapsed() < PATIENCE {
            let Some(left) = (last + burst.quiet()).checked_duration_since(Instant::now()) else { break };
            let Ok(event) = self.events.recv_timeout(left) else { break };
            // Reading raises events too, and others write beside what is read: neither is waited for.
            if self.hear(event, &mut burst) {
                last = Instant::now();
            }
        }
        // A folder that came or went takes the system's watch along.
        for folder in self.watched.extract_if(.., |folder| burst.paths.contains(folder)) {
            let _ = self.system.as_mut().map(|system| system.unwatch(&folder));
        }
        self.concerns_us(&burst.paths).then_some(burst.paths)
    }

    /// Takes an event into a burst; whether it concerns us.
    fn hear(&self, event: notify::Result<notify::Event>, burst: &mut Burst) -> bool {
        let Ok(event) = event else { return false };
        if event.need_rescan() {
            // The system lost count: anything may have been saved.
            burst.paths.extend(self.reads.values().flatten().cloned());
            return true;
        }
        if !matters(event.kind) {
            return false;
        }
        let paths: Vec<PathBuf> = event.paths.iter().flat_map(|path| names(path)).collect();
        let ours = self.concerns_us(&paths);
        if is_finished(event.kind) {
            burst.begun.retain(|path| !paths.contains(path));
        } else if ours {
            burst.begun.extend(paths.iter().cloned());
        }
        burst.paths.extend(paths);
        ours
    }

    /// Whether a preset, or a file or folder that one reads, is among the paths.
    fn concerns_us<'a>(&self, paths: impl IntoIterator<Item = &'a PathBuf>) -> bool {
        let folder = absolute(&self.folder);
        let preset = |path: &Path| path.extension().is_some_and(|e| e == "ron") && path.parent() == Some(&folder);
        let known = |path: &Path| self.reads.values().any(|reads| concerns(path, reads));
        paths.into_iter().any(|path| known(path) || preset(path) || *path == folder)
    }

    /// Listens to a file's folder, or to the nearest one above that is there; whether that is a new one. When the system
    /// has no room for it, files are looked at from now on.
    fn listen_near(&mut self, path: &Path) -> bool {
        for folder in path.ancestors().skip(1) {
            match self.listen(folder) {
                Ok(new) => return new,
                Err(error) if is_limit(&error) => {
                    self.poll_because(&error);
                    return true;
                }
                // It is not there, or not ours to see.
                Err(_) => {}
            }
        }
        false
    }

    /// Whether a folder was not listened to before.
    fn listen(&mut self, folder: &Path) -> Result<bool, notify::Error> {
        let Some(system) = &mut self.system else { return Ok(false) };
        if self.watched.contains(folder) {
            return Ok(false);
        }
        system.watch(folder, RecursiveMode::NonRecursive)?;
        self.watched.insert(folder.to_path_buf());
        Ok(true)
    }
}

/// Paths that events were about.
#[derive(Default)]
struct Burst {
    paths: BTreeSet<PathBuf>,
    /// Those that may not be whole yet.
    begun: BTreeSet<PathBuf>,
}

impl Burst {
    /// How long it must be quiet.
    fn quiet(&self) -> Duration {
        match self.begun.iter().all(|path| path.symlink_metadata().is_ok()) {
            false => GONE,
            true if self.begun.is_empty() => SETTLED,
            true => QUIET,
        }
    }
}

/// Whether a file is not what it was when it was read at `start` or later.
fn changed_since(path: &Path, held: Option<Key>, start: u64) -> bool {
    match (stamp::Stamp::at(path), held) {
        (None, None) => false,
        (Some(stamp), Some(key)) => {
            stamp.is_racy(start) && std::fs::read(path).is_ok_and(|bytes| Key::of_bytes(&bytes) != key)
        }
        _ => true,
    }
}

/// Whether the system refused for want of room: of watches (`ENOSPC`) or of open files (`EMFILE`, `ENFILE`).
fn is_limit(error: &notify::Error) -> bool {
    match &error.kind {
        ErrorKind::MaxFilesWatch => true,
        ErrorKind::Io(error) => matches!(error.raw_os_error(), Some(23 | 24 | 28)),
        _ => false,
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

/// Whether the files that an event is about are whole: closed after writing, or renamed to their names.
fn is_finished(kind: EventKind) -> bool {
    match kind {
        EventKind::Access(access) => access == AccessKind::Close(AccessMode::Write),
        EventKind::Modify(ModifyKind::Name(mode)) => matches!(mode, RenameMode::To | RenameMode::Both),
        _ => false,
    }
}

/// Whether an event at `path` may change what is read: it is one of the files or a folder above one.
fn concerns(path: &Path, reads: &BTreeSet<PathBuf>) -> bool {
    // Paths below a folder follow it in order.
    reads.range(path.to_path_buf()..).next().is_some_and(|next| next.starts_with(path))
}

/// Most links that are followed: systems follow forty.
const MOST_LINKS: usize = 40;

/// The names that events may give a file: where it lies, and every link on the way there, folders' links too. Each stands
/// under the real path of its folder.
fn names(path: &Path) -> BTreeSet<PathBuf> {
    let mut names = BTreeSet::new();
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let parts = |path: &Path| path.components().rev().map(|part| part.as_os_str().to_owned()).collect::<Vec<_>>();
    let (mut at, mut left, mut links) = (PathBuf::new(), parts(&full), 0);
    while let Some(part) = left.pop() {
        match std::fs::read_link(at.join(&part)) {
            Ok(target) if links < MOST_LINKS => {
                names.insert(absolute(&at).join(part));
                left.extend(parts(&target));
                links += 1;
            }
            _ if part == ".." => drop(at.pop()),
            _ if part == "." => {}
            _ => at.push(part),
        }
    }
    names.insert(absolute(&at));
    names
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

#[cfg(test)]
mod tests {
    use notify::Event;
    use notify::event::{CreateKind, DataChange};

    use super::*;

    #[test]
    fn files_are_waited_for_until_they_are_closed_or_renamed_to_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let preset = folder.path().join("oak.ron");
        std::fs::write(&preset, "()").unwrap();
        let options = WatchOptions { poll: Some(POLL), ..WatchOptions::new(folder.path(), folder.path().join("out")) };
        let watcher = Watcher::new(options);
        let mut burst = Burst::default();
        let mut hear = |kind: EventKind, path: &Path| {
            let ours = watcher.hear(Ok(Event::new(kind).add_path(path.to_path_buf())), &mut burst);
            let whole = burst.begun.is_empty();
            assert_eq!(
                burst.quiet(),
                if whole {
                    SETTLED
                } else if preset.exists() {
                    QUIET
                } else {
                    GONE
                }
            );
            (ours, whole)
        };
        let write = EventKind::Modify(ModifyKind::Data(DataChange::Any));
        let [closed, read] =
            [AccessMode::Write, AccessMode::Read].map(|mode| EventKind::Access(AccessKind::Close(mode)));
        let renamed = |mode| EventKind::Modify(ModifyKind::Name(mode));
        // Begun, read by somebody, written, closed.
        for (kind, whole) in [(write, false), (read, false), (write, false), (closed, true)] {
            assert_eq!(hear(kind, &preset), (kind != read, whole), "{kind:?}");
        }
        // What others write beside it is not waited for.
        let beside = folder.path().join("notes.txt");
        assert_eq!(hear(EventKind::Create(CreateKind::File), &beside), (false, true));
        // Renamed away and another one to its name.
        assert_eq!(hear(renamed(RenameMode::From), &preset), (true, false));
        assert_eq!(hear(renamed(RenameMode::To), &preset), (true, true));
        std::fs::remove_file(&preset).unwrap();
        assert_eq!(hear(EventKind::Remove(notify::event::RemoveKind::File), &preset), (true, false));
        assert!([preset, beside].iter().all(|path| burst.paths.contains(&absolute(path))));
    }

    #[cfg(unix)]
    #[test]
    fn every_link_on_the_way_to_a_file_is_one_of_its_names() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        std::fs::create_dir_all(root.join("kept/v1")).unwrap();
        symlink("kept", root.join("all")).unwrap();
        symlink("./../all/v1", root.join("kept/now")).unwrap();
        let set = |list: &[&str]| list.iter().map(|name| root.join(name)).collect::<BTreeSet<_>>();
        // It need not be there.
        assert_eq!(names(&root.join("kept/now/../now/oak.ron")), set(&["kept/now", "all", "kept/v1/oak.ron"]));
        std::fs::write(root.join("kept/v1/oak.ron"), "").unwrap();
        symlink("oak.ron", root.join("kept/v1/ash.ron")).unwrap();
        assert_eq!(
            names(&root.join("all/now/ash.ron")),
            set(&["all", "kept/now", "kept/v1/ash.ron", "kept/v1/oak.ron"])
        );
        symlink("loop", root.join("loop")).unwrap();
        assert!(names(&root.join("loop/oak.ron")).contains(&root.join("loop")));
    }
}
