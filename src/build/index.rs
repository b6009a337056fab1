//! What the last build saw of every preset's inputs and outputs, so that an unchanged build reads none of them.
//!
//! `OUT/.treewright-index` holds, for each preset by the name that it was called by, every file that its set was made
//! from and every file of the set, each with stamp and hash ([`stamp`](super::stamp)). Where all stamps are the same the
//! set is current, and not even the preset is read. A stamp that is too young to prove anything is settled by the hash;
//! whatever else differs takes the long way, which reads and compares everything.
//!
//! The index is a hint and no more: it is replaced whole under the lock of the output folder, one that can't be read, or
//! that another version or another working folder wrote, is none, and losing it costs one slow build. `--check` takes no set
//! for current by it. It can be wrong in one way that Git's can be as well: a file of the set that is changed in place,
//! keeping its size, by a program that then sets its time back.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use serde::{Deserialize, Serialize};

use super::stamp::{self, Stamp};
use super::{output, pipeline, record};
use crate::base::Key;

const FILE: &str = ".treewright-index";
/// First bytes; the hash of the rest follows.
const MAGIC: [u8; 8] = *b"twindex1";

/// A file as it was seen.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Seen {
    /// As it was called.
    path: PathBuf,
    /// None for one that was not there.
    held: Option<(Stamp, [u8; 32])>,
}

/// A current set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// The set's name.
    pub(super) set: String,
    pub(super) variants: usize,
    /// When the inputs were first looked at, and when the outputs were last.
    times: (u64, u64),
    reads: Vec<Seen>,
    /// By their names in the set's folder.
    outputs: Vec<Seen>,
}

/// What is known of the sets of an output folder.
#[derive(Debug, Default)]
pub(super) struct Index {
    entries: BTreeMap<PathBuf, Entry>,
}

/// The index of an output folder as it was read last: who watches many presets builds one after the other, and would read
/// it whole for each.
#[derive(Debug, Default)]
pub(super) struct Kept(Mutex<Option<(Stamp, Arc<Index>)>>);

impl Kept {
    /// What is there now, read where it is another file than before.
    pub(super) fn read(&self, out: &Path) -> Arc<Index> {
        let mut kept = self.0.lock().expect("no reader panics while it holds the lock");
        // It is only ever replaced, so another one has another inode or time.
        let stamp = Stamp::at(&out.join(FILE));
        if let (Some((old, index)), Some(stamp)) = (&*kept, &stamp)
            && old == stamp
        {
            return index.clone();
        }
        let now = stamp::now();
        let index = Arc::new(Index::read(out));
        *kept = stamp.filter(|stamp| !stamp.is_racy(now)).map(|stamp| (stamp, index.clone()));
        index
    }
}

/// Who may use an index: the same version, called from the same folder.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Owner {
    version: String,
    folder: PathBuf,
}

impl Owner {
    fn here() -> Option<Self> {
        let version = format!("{} {}", env!("CARGO_PKG_VERSION"), pipeline::VERSION);
        Some(Self { version, folder: std::env::current_dir().ok()? })
    }
}

impl Index {
    /// The index of an output folder; an empty one where there is none.
    pub(super) fn read(out: &Path) -> Self {
        let read = || {
            let bytes = stamp::bytes(&out.join(FILE)).ok()?;
            let (hash, rest) = bytes.strip_prefix(&MAGIC)?.split_at_checked(32)?;
            if hash != Key::of_bytes(rest).bytes() {
                return None;
            }
            let (owner, entries): (Owner, _) = postcard::from_bytes(rest).ok()?;
            (Some(owner) == Owner::here()).then_some(entries)
        };
        Self { entries: read().unwrap_or_default() }
    }

    /// What is known of a preset, as far as nothing of it was touched since, and all that it reads is of at most `largest` bytes
    /// a file: the build that it is known from may have had another limit. The stamps that were settled by a hash are renewed
    /// in it; whether there were any.
    pub(super) fn current(&self, out: &Path, preset: &Path, largest: u64) -> Option<(Entry, bool)> {
        let mut entry = self.entries.get(preset)?.clone();
        if entry.reads.iter().filter_map(|seen| seen.held).any(|(stamp, _)| stamp.size() > largest) {
            return None;
        }
        let folder = out.join(&entry.set);
        let (reads, outputs) = entry.times;
        let now = stamp::now();
        let mut renewed = false;
        let same = entry.reads.iter_mut().all(|seen| is_same(&seen.path.clone(), seen, reads, Stamp::eq, &mut renewed))
            && entry.outputs.iter_mut().all(|seen| {
                // Committing a set links its files anew, which their inodes tell as a change.
                is_same(&folder.join(&seen.path), seen, outputs, Stamp::is_same_content, &mut renewed)
            })
            && output::is_settled(&folder);
        if renewed {
            entry.times = (now, now);
        }
        same.then_some((entry, renewed))
    }

    /// The sets whose presets, directly in these folders, are gone, with their presets; none that another preset makes.
    pub(super) fn orphans<'a>(
        &'a self,
        out: &Path,
        folders: &[PathBuf],
        presets: &[PathBuf],
    ) -> Vec<(&'a Path, &'a str)> {
        let known = self.entries.keys().filter(|preset| preset.exists());
        let made: BTreeSet<&OsStr> = presets.iter().chain(known).filter_map(|preset| preset.file_stem()).collect();
        let is_orphan = |preset: &Path, set: &str| {
            let is_of_these = preset.parent().is_some_and(|folder| folders.iter().any(|of| of == folder));
            is_of_these
                && !preset.exists()
                && !made.contains(OsStr::new(set))
                && record::read(&out.join(set), set).is_some()
        };
        let entries = self.entries.iter().map(|(preset, entry)| (preset.as_path(), entry.set.as_str()));
        entries.filter(|(preset, set)| is_orphan(preset, set)).collect()
    }

    /// Remembers entries, forgets presets that are gone with their sets, and writes the index. A folder that can't be written, or in
    /// which somebody else builds just now, stays without.
    pub(super) fn add(out: &Path, entries: Vec<(PathBuf, Entry)>) {
        let Some(_turn) = output::Turn::at_once(out) else { return };
        let mut index = Self::read(out).entries;
        index.retain(|preset, entry| preset.exists() || record::read(&out.join(&entry.set), &entry.set).is_some());
        index.extend(entries);
        // A path that is no text can't be kept, which leaves its preset to the long way.
        index.retain(|preset, entry| postcard::to_stdvec(&(preset, &*entry)).is_ok());
        let Some(Ok(body)) = Owner::here().map(|owner| postcard::to_stdvec(&(owner, index))) else { return };
        let bytes = [MAGIC.as_slice(), &Key::of_bytes(&body).bytes(), &body].concat();
        let part = out.join(format!("{FILE}.part"));
        if fs::write(&part, bytes).and_then(|()| fs::rename(&part, out.join(FILE))).is_err() {
            let _ = fs::remove_file(&part);
        }
    }
}

/// Whether a file is as it was seen at `time`, by its stamp, or by its hash where the stamp proves nothing, which renews
/// the stamp.
fn is_same(path: &Path, seen: &mut Seen, time: u64, is_equal: fn(&Stamp, &Stamp) -> bool, renewed: &mut bool) -> bool {
    let Some((old, hash)) = &mut seen.held else { return fs::metadata(path).is_err() };
    match Stamp::at(path) {
        Some(new) if is_equal(&new, old) && !old.is_racy(time) => true,
        Some(new) if new.is_same_content(old) => {
            *renewed = true;
            let read = stamp::read_at(path);
            read.is_ok_and(|(bytes, stamp)| {
                stamp.inspect(|stamp| *old = *stamp).is_some() && Key::of_bytes(&bytes).bytes() == *hash
            })
        }
        _ => false,
    }
}

impl Entry {
    /// A set that was just built or compared: what was read since `start`, and its files with stamps and hashes. None
    /// where a stamp is missing, as of a file that changed while it was read.
    pub(super) fn new(
        (set, variants): (&str, usize),
        start: u64,
        reads: &BTreeMap<PathBuf, Option<Key>>,
        stamps: &BTreeMap<PathBuf, Stamp>,
        outputs: impl IntoIterator<Item = (String, Stamp, Key)>,
    ) -> Option<Self> {
        let seen = |(path, key): (&PathBuf, &Option<Key>)| {
            let held = match key {
                None => None,
                Some(key) => Some((*stamps.get(path)?, key.bytes())),
            };
            Some(Seen { path: path.clone(), held })
        };
        let reads = reads.iter().map(seen).collect::<Option<_>>()?;
        let output =
            |(name, stamp, key): (String, Stamp, Key)| Seen { path: name.into(), held: Some((stamp, key.bytes())) };
        let outputs = outputs.into_iter().map(output).collect();
        Some(Self { set: set.to_owned(), variants, times: (start, stamp::now()), reads, outputs })
    }

    /// Every file that was read or looked for.
    pub(super) fn reads(&self) -> BTreeMap<PathBuf, Option<Key>> {
        self.reads.iter().map(|seen| (seen.path.clone(), seen.held.map(|(_, hash)| Key::of(hash)))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A preset, a file that is missing, and a set of one file.
    fn project() -> (tempfile::TempDir, [PathBuf; 4]) {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("out/oak")).unwrap();
        let paths = [at("oak.ron"), at("gone.png"), at("out"), at("out/oak/oak.glb")];
        fs::write(&paths[0], "preset").unwrap();
        fs::write(&paths[3], "asset").unwrap();
        (folder, paths)
    }

    fn entry([preset, gone, _, asset]: &[PathBuf; 4], start: u64) -> Entry {
        let key = |path: &PathBuf| Key::of_bytes(&fs::read(path).unwrap());
        let reads = BTreeMap::from([(preset.clone(), Some(key(preset))), (gone.clone(), None)]);
        let stamps = BTreeMap::from([(preset.clone(), Stamp::at(preset).unwrap())]);
        let outputs = [("oak.glb".to_owned(), Stamp::at(asset).unwrap(), key(asset))];
        Entry::new(("oak", 3), start, &reads, &stamps, outputs).unwrap()
    }

    /// As if files had been looked at in the tick in which `path` was written, however long this machine took since.
    fn looked_at_once(paths: &[PathBuf; 4], path: &Path) -> Entry {
        let written = fs::metadata(path).unwrap().modified().unwrap();
        let tick = u64::try_from(written.duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos()).unwrap();
        Entry { times: (tick, tick), ..entry(paths, tick) }
    }

    #[test]
    fn what_nobody_touched_is_current_and_any_touch_is_noticed() {
        let (_folder, paths) = project();
        let [preset, gone, out, asset] = &paths;
        let current = || Index::read(out).current(out, preset, 6);
        assert_eq!(current(), None);
        let add = || Index::add(out, vec![(preset.clone(), entry(&paths, stamp::now()))]);
        Index::add(out, vec![(preset.clone(), looked_at_once(&paths, preset))]);
        // Just written: stamps prove nothing yet, the hashes do, and that is renewed.
        let (renewed, was_renewed) = current().unwrap();
        assert!(was_renewed);
        assert_eq!((renewed.variants, renewed.reads().len()), (3, 2));
        // As if a day had passed.
        let later = stamp::now() + 86_400_000_000_000;
        Index::add(out, vec![(preset.clone(), Entry { times: (later, later), ..renewed })]);
        assert!(!current().unwrap().1);
        assert_eq!(Index::read(out).current(out, preset, 5), None, "a smaller limit than the preset's size");
        let touches: [&dyn Fn(); 5] = [
            &|| fs::write(preset, "other preset").unwrap(),
            &|| fs::write(asset, "other").unwrap(),
            &|| fs::remove_file(asset).unwrap(),
            &|| fs::write(gone, "there").unwrap(),
            &|| fs::write(out.join("oak/.treewright-commit.json"), "{}").unwrap(),
        ];
        for (i, touch) in touches.iter().enumerate() {
            touch();
            assert_eq!(current(), None, "touch {i}");
            fs::write(preset, "preset").unwrap();
            fs::write(asset, "asset").unwrap();
            let _ = fs::remove_file(gone);
            let _ = fs::remove_file(out.join("oak/.treewright-commit.json"));
            add();
            assert!(current().is_some(), "after touch {i}");
        }
    }

    #[test]
    fn a_change_within_a_tick_is_found_by_its_hash() {
        let (_folder, paths) = project();
        let [preset, _, out, asset] = &paths;
        for path in [preset, asset] {
            let old = fs::metadata(path).unwrap().modified().unwrap();
            let stale = looked_at_once(&paths, path);
            // The same size, and the same time, as a clock that stands still would show it.
            let text = fs::read_to_string(path).unwrap().replace('s', "z");
            fs::write(path, text).unwrap();
            fs::File::options().write(true).open(path).unwrap().set_modified(old).unwrap();
            Index::add(out, vec![(preset.clone(), stale)]);
            assert_eq!(Index::read(out).current(out, preset, u64::MAX), None, "{}", path.display());
        }
    }

    #[test]
    fn an_index_is_read_again_when_it_was_replaced_and_not_before() {
        let (_folder, paths) = project();
        let [preset, _, out, _] = &paths;
        let kept = Kept::default();
        assert!(kept.read(out).entries.is_empty());
        Index::add(out, vec![(preset.clone(), entry(&paths, stamp::now()))]);
        assert_eq!(kept.read(out).entries.len(), 1);
        // As if it had been written a while ago.
        let written = fs::metadata(out.join(FILE)).unwrap().modified().unwrap();
        let file = fs::File::options().write(true).open(out.join(FILE)).unwrap();
        file.set_modified(written - std::time::Duration::from_secs(60)).unwrap();
        let first = kept.read(out);
        assert!(Arc::ptr_eq(&first, &kept.read(out)), "read twice");
        fs::remove_file(out.join(FILE)).unwrap();
        assert!(kept.read(out).entries.is_empty());
    }

    #[test]
    fn a_damaged_index_is_none() {
        let (_folder, paths) = project();
        let [preset, _, out, _] = &paths;
        Index::add(out, vec![(preset.clone(), entry(&paths, stamp::now()))]);
        let whole = fs::read(out.join(FILE)).unwrap();
        for i in (0..whole.len()).step_by(7) {
            let mut bytes = whole.clone();
            bytes[i] ^= 16;
            fs::write(out.join(FILE), &bytes).unwrap();
            assert!(Index::read(out).entries.is_empty(), "byte {i}");
            fs::write(out.join(FILE), &whole[..i]).unwrap();
            assert!(Index::read(out).entries.is_empty(), "cut at {i}");
        }
    }
}
