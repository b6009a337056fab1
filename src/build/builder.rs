//! Building presets: each resolved, its inputs read, its set made and committed, unless it is current.

use std::collections::BTreeMap;
use std::collections::btree_map;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;

use super::index::{Entry, Index, Kept};
use super::output::{self, OutputError, Turn};
use super::pipeline::{Inputs, Share};
use super::record::Compared;
use super::{
    BuildError, BuildOptions, Cache, Happened, Limits, Loaded, Outcome, PartError, Progress, SetFiles, SetState,
    SetStatus, World, find, gallery, pipeline, record, uses,
};
use crate::base::{Diagnostic, Key, Note, counted};

/// Builds sets; keeps grown sources and made pictures in memory between calls, so that a watcher makes them once.
#[derive(Debug)]
pub struct Builder {
    options: BuildOptions,
    cache: Arc<Cache>,
    index: Kept,
    uses: uses::Known,
    shown: gallery::Shown,
}

impl Builder {
    /// A builder with nothing in memory.
    #[must_use]
    pub fn new(options: BuildOptions) -> Self {
        let cache = Arc::new(Cache::new(options.cache.as_ref()).within(options.limits.memory));
        Self::with(options, cache)
    }

    /// A builder that takes what it can from part files, as [`make_part`] writes them.
    ///
    /// # Errors
    ///
    /// The first file that is no whole part.
    pub fn of_parts(options: BuildOptions, parts: &[PathBuf]) -> Result<Self, PartError> {
        let cache = Arc::new(Cache::of_parts(parts)?.within(options.limits.memory));
        Ok(Self::with(options, cache))
    }

    fn with(options: BuildOptions, cache: Arc<Cache>) -> Self {
        let (index, uses, shown) = (Kept::default(), uses::Known::default(), gallery::Shown::default());
        Self { options, cache, index, uses, shown }
    }

    /// What it keeps in memory and on disk, for others who make trees of the same presets.
    #[must_use]
    pub fn cache(&self) -> Arc<Cache> {
        self.cache.clone()
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
        let out = &self.options.out;
        // Where the files lie that another build read, in spite of links, was looked at by nobody.
        let limits = &self.options.limits;
        let trusts = !self.options.force && self.options.shard.is_none() && limits.root.is_none();
        let index = if trusts { self.index.read(out) } else { Arc::default() };
        let (sets, mut failed) = ready(presets, &self.options.limits, |preset| index.current(out, preset, limits.file));
        let mut entries = Vec::new();
        for ready in sets {
            if !failed.diagnostics.is_empty() && !self.options.keep_going {
                failed.reads.extend(ready.reads());
                continue;
            }
            match ready {
                Ready::Current { preset, entry, renewed } => {
                    let outcome = Outcome::current(entry.set.clone(), entry.variants, entry.reads());
                    progress(Progress::Set { outcome: &outcome, folder: &out.join(&entry.set) });
                    failed.built.push(outcome);
                    if renewed {
                        entries.push((preset, entry));
                    }
                }
                Ready::Loaded { preset, mut loaded } => match self.set(&preset, &mut loaded, progress) {
                    Ok((outcome, entry)) => {
                        failed.built.push(outcome);
                        entries.extend(entry.map(|entry| (preset, entry)));
                    }
                    Err(diagnostics) => {
                        failed.diagnostics.extend(loaded.placed(diagnostics));
                        failed.reads.extend(self.uses.presets(&loaded.plan.name));
                        failed.reads.extend(loaded.world.reads());
                    }
                },
            }
        }
        if !entries.is_empty() {
            Index::add(out, entries);
        }
        if failed.diagnostics.is_empty() { Ok(failed.built) } else { Err(failed) }
    }

    /// What a build would find, without building or writing anything; every output is read and hashed.
    ///
    /// # Errors
    ///
    /// All errors of all presets.
    pub fn status(&self, presets: &[PathBuf]) -> Result<Vec<SetStatus>, BuildError> {
        let (sets, mut failed) = read(presets, &self.options.limits);
        let mut found = Vec::new();
        for loaded in &sets {
            match self.status_of(loaded) {
                Ok(status) => found.push(status),
                Err(diagnostics) => failed.diagnostics.extend(loaded.placed(diagnostics)),
            }
        }
        if failed.diagnostics.is_empty() { Ok(found) } else { Err(failed) }
    }

    /// As [`gallery`](super::gallery), of the output folder; remembers what it showed.
    ///
    /// # Errors
    ///
    /// When the output folder can't be read or written: about the file that it is.
    pub fn gallery(&self, presets: &[PathBuf]) -> Result<bool, Diagnostic> {
        self.shown.gallery(&self.options.out, presets)
    }

    /// The sets whose presets, directly in these folders, are gone, as far as the output folder remembers who made them;
    /// none that one of `presets` makes. They are left alone: whoever deletes a preset may still ship its set.
    #[must_use]
    pub fn orphans(&self, folders: &[PathBuf], presets: &[PathBuf]) -> Vec<SetStatus> {
        let out = &self.options.out;
        let status = |(preset, set): (&Path, &str)| SetStatus {
            set: set.to_owned(),
            folder: out.join(set),
            state: SetState::Orphaned { preset: preset.to_path_buf() },
        };
        self.index.read(out).orphans(out, folders, presets).into_iter().map(status).collect()
    }

    fn status_of(&self, loaded: &Loaded) -> Result<SetStatus, Vec<Diagnostic>> {
        let plan = &loaded.plan;
        let folder = self.options.out.join(&plan.name);
        let key = pipeline::set_key(plan, &pipeline::read_inputs(loaded)?);
        let state = match record::read(&folder, &plan.name) {
            None if record::is_broken(&folder, &plan.name) => {
                SetState::Damaged { files: vec![record::manifest_name(&plan.name)] }
            }
            None => SetState::New,
            Some(old) if old.key != key.to_hex() => SetState::Changed,
            Some(old) => match old.damaged(&folder) {
                files if files.is_empty() => SetState::Current,
                files => SetState::Damaged { files },
            },
        };
        Ok(SetStatus { set: plan.name.clone(), folder, state })
    }

    /// Reads what a plan names.
    fn inputs(&self, preset: &Path, loaded: &Loaded) -> Result<Inputs, Vec<Diagnostic>> {
        let inputs = pipeline::read_inputs(loaded)?;
        self.uses.add(&self.options.out, preset, loaded)?;
        Ok(inputs)
    }

    /// The files of a set that is what the preset makes already.
    fn current(&self, loaded: &Loaded, key: Key) -> Option<Vec<Compared>> {
        let folder = self.options.out.join(&loaded.plan.name);
        let is_this = |old: &record::Record| !self.options.force && old.key == key.to_hex();
        let old = record::read(&folder, &loaded.plan.name).filter(is_this)?;
        old.compared(&folder, &output::Stamps::new()).ok()
    }

    /// Builds one set; with it comes what an index remembers of it. The preset is read again where it changed meanwhile.
    fn set(
        &self,
        preset: &Path,
        loaded: &mut Loaded,
        progress: &(dyn Fn(Progress<'_>) + Sync),
    ) -> Result<(Outcome, Option<Entry>), Vec<Diagnostic>> {
        let start = Instant::now();
        let refused = |error: OutputError| vec![error.diagnostic()];
        let name = loaded.plan.name.clone();
        let step = |what: &str| progress(Progress::Step { set: &name, what });
        let folder = self.options.out.join(&name);
        let mut inputs = self.inputs(preset, loaded)?;
        if let Some(shard) = self.options.shard {
            let plan = &loaded.plan;
            progress(Progress::Steps(pipeline::steps(plan)));
            let (trees, notes) = pipeline::make_share(plan, &inputs, &self.cache, Share::Trees(shard), &step)?;
            let mut outcome = Outcome::current(name.clone(), plan.variants.len(), loaded.world.reads());
            outcome.happened = Happened::Shard { trees };
            outcome.notes = notes;
            outcome.took = start.elapsed();
            self.told(loaded, &mut outcome);
            progress(Progress::Set { outcome: &outcome, folder: &folder });
            return Ok((outcome, None));
        }
        let mut key = pipeline::set_key(&loaded.plan, &inputs);
        let mut made = None;
        // Looked at without the turn first, which needs a folder that can be written.
        let mut compared = output::is_settled(&folder).then(|| self.current(loaded, key)).flatten();
        if compared.is_none() {
            // Held until the set is written: who waited for it finds the set current and has nothing to do.
            let _turn = Turn::take(&self.options.out, || progress(Progress::Waiting)).map_err(refused)?;
            // Who had the turn before may have built from newer files than were read here.
            if !loaded.world.is_current() {
                self.reload(preset, loaded)?;
                inputs = self.inputs(preset, loaded)?;
                key = pipeline::set_key(&loaded.plan, &inputs);
            }
            output::recover(&folder).map_err(refused)?;
            compared = self.current(loaded, key);
            if compared.is_none() {
                let plan = &loaded.plan;
                progress(Progress::Steps(pipeline::steps(plan)));
                let set = pipeline::make_set(plan, &inputs, key, &self.cache, &step)?;
                let owned = record::owned(&folder, &name);
                let (committed, stamps) = output::commit_stamped(&folder, &owned, &set.files).map_err(refused)?;
                made = Some((committed, start.elapsed(), set.notes));
                compared = record::read(&folder, &name).and_then(|new| new.compared(&folder, &stamps).ok());
            }
        }
        let mut outcome = Outcome::current(name.clone(), loaded.plan.variants.len(), loaded.world.reads());
        if let Some((committed, took, notes)) = made {
            outcome = Outcome { happened: Happened::Built, committed, took, notes, ..outcome };
            outcome.notes.extend(edited(&outcome.committed.edited));
            self.told(loaded, &mut outcome);
        }
        progress(Progress::Set { outcome: &outcome, folder: &folder });
        let (stamps, began) = loaded.world.stamps();
        let files =
            compared.map(|files| files.into_iter().map(|(name, stamp, key)| Some((name, stamp?, key))).collect());
        let entry = files
            .flatten()
            .and_then(|files: Vec<_>| Entry::new((&name, outcome.variants), began, &outcome.reads, &stamps, files));
        Ok((outcome, entry))
    }

    /// Reads a preset again; what was read of it is known also where it is wrong now.
    fn reload(&self, preset: &Path, loaded: &mut Loaded) -> Result<(), Vec<Diagnostic>> {
        match find::load_or_reads(preset, &self.options.limits) {
            Ok(new) => {
                *loaded = new;
                Ok(())
            }
            Err(failure) => {
                let (diagnostics, world) = *failure;
                loaded.world = world;
                Err(diagnostics)
            }
        }
    }

    /// Adds what the cache has to tell, once it is within its limit, and where in the preset stands what all is about.
    fn told(&self, loaded: &Loaded, outcome: &mut Outcome) {
        self.cache.trim();
        outcome.notes.extend(self.cache.take_notes());
        loaded.noted(&mut outcome.notes);
    }
}

/// What becomes of files that somebody changed since they were written.
fn edited(names: &[String]) -> Option<Note> {
    let (about, more) = (names.first()?, names.len() - 1);
    let others = if more > 0 { format!(" and {}", counted(more, "other file", "other files")) } else { String::new() };
    let message = format!(
        "somebody changed it{others} since Treewright wrote it: written anew; keep changed files under another name, \
         and pictures of your own in the preset"
    );
    Some(Note::new(about.clone(), message))
}

/// Makes the set of one preset out of files in memory: no file is read or written, and what is made is what a build
/// writes. `files` holds the preset, under the path `preset` without folders, and all that it names, by paths relative
/// to it.
///
/// # Errors
///
/// All errors of the preset and what it reads.
pub fn make_set(preset: &str, files: BTreeMap<String, Vec<u8>>) -> Result<SetFiles, BuildError> {
    let loaded =
        find::load_from(World::in_memory(files), preset, preset.to_owned()).map_err(|e| BuildError::of(e.0))?;
    let made = pipeline::read_inputs(&loaded).and_then(|inputs| {
        let key = pipeline::set_key(&loaded.plan, &inputs);
        pipeline::make_set(&loaded.plan, &inputs, key, &Cache::new(None), &|_| {})
    });
    made.map_err(|diagnostics| BuildError::of(loaded.placed(diagnostics)))
}

/// Makes a share of one preset's set, from the presets' files and what earlier parts hold: the bytes of a part file with
/// everything that was made and not given.
///
/// # Errors
///
/// All errors of the preset and what it reads.
pub fn make_part(preset: &Path, share: Share, given: &[PathBuf], limits: &Limits) -> Result<Vec<u8>, BuildError> {
    let cache = Cache::of_parts(given)
        .map_err(|e| BuildError::of(vec![Diagnostic::new(find::shown(&e.path), e.why.clone())]))?;
    let (sets, failed) = read(std::slice::from_ref(&preset.to_path_buf()), limits);
    let Some(loaded) = sets.first() else { return Err(failed) };
    let made = pipeline::read_inputs(loaded)
        .and_then(|inputs| pipeline::make_share(&loaded.plan, &inputs, &cache, share, &|_| {}));
    match made {
        Ok((0, _)) if matches!(share, Share::Trees(_)) => {
            let count = loaded.plan.variants.len();
            Err(BuildError::of(vec![Diagnostic::new(&loaded.preset, format!("the set has only {count} trees"))]))
        }
        Ok(_) => Ok(cache.part()),
        Err(diagnostics) => Err(BuildError::of(loaded.placed(diagnostics))),
    }
}

/// A preset that is to be built.
enum Ready {
    /// Nothing of it was touched since the last build.
    Current { preset: PathBuf, entry: Entry, renewed: bool },
    /// It was read.
    Loaded { preset: PathBuf, loaded: Box<Loaded> },
}

impl Ready {
    /// The files that were read so far, or last.
    fn reads(&self) -> BTreeMap<PathBuf, Option<Key>> {
        match self {
            Self::Current { entry, .. } => entry.reads(),
            Self::Loaded { loaded, .. } => loaded.world.reads(),
        }
    }
}

/// Reads all presets side by side: the good ones, no two of one name, and what is wrong with the others.
pub(super) fn read(presets: &[PathBuf], limits: &Limits) -> (Vec<Loaded>, BuildError) {
    let (sets, failed) = ready(presets, limits, |_| None);
    let loaded = |ready| match ready {
        Ready::Loaded { loaded, .. } => Some(*loaded),
        Ready::Current { .. } => None,
    };
    (sets.into_iter().filter_map(loaded).collect(), failed)
}

/// As [`read`], without reading those that are known to be current; the flag of `current` says that its stamps changed.
fn ready(
    presets: &[PathBuf],
    limits: &Limits,
    current: impl Fn(&Path) -> Option<(Entry, bool)> + Sync,
) -> (Vec<Ready>, BuildError) {
    let one = |preset: &PathBuf| match current(preset) {
        Some((entry, renewed)) => Ok(Ready::Current { preset: preset.clone(), entry, renewed }),
        None => find::load_or_reads(preset, limits)
            .map(|loaded| Ready::Loaded { preset: preset.clone(), loaded: Box::new(loaded) }),
    };
    let all: Vec<_> = presets.par_iter().map(one).collect();
    let mut failed = BuildError::of(Vec::new());
    let mut names = Names::default();
    let mut good = Vec::new();
    for (preset, ready) in presets.iter().zip(all) {
        let claimed = ready.map_err(|failure| (failure.0, failure.1.reads())).and_then(|ready| {
            let set = match &ready {
                Ready::Current { entry, .. } => &entry.set,
                Ready::Loaded { loaded, .. } => &loaded.plan.name,
            };
            match names.claim(preset, set) {
                Ok(()) => Ok(ready),
                Err(diagnostics) => Err((diagnostics, ready.reads())),
            }
        });
        match claimed {
            Ok(ready) => good.push(ready),
            Err((diagnostics, reads)) => {
                failed.diagnostics.extend(diagnostics);
                failed.reads.extend(reads);
            }
        }
    }
    (good, failed)
}

/// Resolves presets and reads every file that they name as a build would, within the same limits, without building. Returns
/// how many are good.
/// What only growing, matching and packing can find is left to the build.
///
/// # Errors
///
/// All errors of all presets.
pub fn check(presets: &[PathBuf], limits: &Limits) -> Result<usize, BuildError> {
    let mut names = Names::default();
    let mut diagnostics = Vec::new();
    for preset in presets {
        let loaded = find::load_or_reads(preset, limits).map_err(|failure| failure.0);
        let checked = loaded.and_then(|loaded| {
            names.claim(preset, &loaded.plan.name)?;
            let inputs = pipeline::read_inputs(&loaded)?;
            pipeline::check_inputs(&loaded.plan, &inputs).map_err(|found| loaded.placed(found))
        });
        diagnostics.extend(checked.err().into_iter().flatten());
    }
    if diagnostics.is_empty() { Ok(presets.len()) } else { Err(BuildError::of(diagnostics)) }
}

/// The names of sets and who has them; upper and lower case are one, as they are to many file systems.
#[derive(Debug, Default)]
pub(crate) struct Names(BTreeMap<String, String>);

impl Names {
    /// Takes a set's name for a preset; the error where another has it.
    pub(crate) fn claim(&mut self, preset: &Path, set: &str) -> Result<(), Vec<Diagnostic>> {
        match self.0.entry(set.to_lowercase()) {
            btree_map::Entry::Occupied(other) => {
                let message = format!("its set has the same name as that of {}", other.get());
                Err(vec![Diagnostic::new(find::shown(preset), message).with_hint(
                    "a set is named after its preset: rename one of them, or build them into two output folders",
                )])
            }
            btree_map::Entry::Vacant(free) => {
                free.insert(find::shown(preset));
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Mutex;

    use super::*;

    const PRESET: &str = "(sources: {\"a\": Grow(species: \"twig.ron\")}, variants: [Source(\"a\")], lods: [Full], \
        foliage: (density: 0.0, pictures: 1, resolution: 64), bark: (resolution: 256), atlas: (size: 256))";
    const TWIG: &str = "(height: 2.0, nodes: 500, iterations: [(endpoints: Volume(shape: HalfEllipsoid(bottom: 0.35, \
        top: 0.9, radius: 0.36), count: 6))])";

    #[test]
    fn who_waited_for_the_turn_builds_what_the_files_hold_then() {
        let project = tempfile::tempdir().unwrap();
        let at = |name: &str| project.path().join(name);
        let (out, preset) = (at("out"), at("oak.ron"));
        fs::write(&preset, PRESET).unwrap();
        fs::write(at("twig.ron"), TWIG).unwrap();
        let builder = Builder::new(BuildOptions::new(&out));
        let turn = Mutex::new(Some(Turn::take(&out, || ()).unwrap()));
        let saved = |text: String| {
            move |progress: Progress<'_>| {
                if matches!(progress, Progress::Waiting) {
                    fs::write(&preset, &text).unwrap();
                    turn.lock().unwrap().take();
                }
            }
        };
        let outcomes =
            builder.build(&[at("oak.ron")], &saved(PRESET.replace("(sources", "(seed: 2, sources"))).unwrap();
        assert_eq!((outcomes.len(), outcomes[0].happened), (1, Happened::Built));
        assert_eq!(builder.status(&[at("oak.ron")]).unwrap()[0].state, SetState::Current);
    }
}
