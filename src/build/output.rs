//! Sets of files that land whole or not at all.
//!
//! Where the file system can, the set's folder is swapped for a new one in a single step (`exchange`), so that a reader
//! sees the complete old set or the complete new one at any moment, also after a kill.
//!
//! Elsewhere new and changed files are first written beside their targets under names of their own
//! (`.treewright-NNNN.part`), then a journal that lists every step is renamed into place: that rename is the commit. Then
//! the parts are renamed over their targets, files that the set no longer has are removed, and the journal goes. A build
//! that is killed before the commit leaves the old set untouched; one that is killed in the milliseconds after it is
//! finished by whoever opens the folder next ([`recover`]); until then files are whole, but of two sets.
//!
//! Parts are flushed to the disk before anything names them. Files whose bytes do not change are not written, so engines
//! do not reload them. Two processes that build into one output folder take turns ([`Turn`]): without, one would clear
//! the other's parts.
//!
//! What belongs to Treewright is what the set's last record (the manifest's list of files and hashes) names. A file with
//! a target's name that is not on that list is somebody else's: the commit is refused before anything is written. A file
//! that is on the list but was changed since is never removed.

mod error;
mod exchange;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::stamp::{self, Stamp};
use crate::base::Key;
pub(super) use error::OutputError;

const LOCK: &str = ".treewright-lock";
const JOURNAL: &str = ".treewright-commit.json";
const PART_PREFIX: &str = ".treewright-";
const PART_SUFFIX: &str = ".part";

/// The steps of a commit that are still to be done.
#[derive(Debug, Serialize, Deserialize)]
struct Journal {
    /// (part, target)
    rename: Vec<(String, String)>,
    /// The files that go, and the hashes of what they were: one that somebody changes before this is carried out stays.
    remove: Vec<(String, String)>,
}

/// What a commit did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Committed {
    /// Files written because they are new or changed.
    pub written: Vec<String>,
    /// Files left as they were.
    pub unchanged: usize,
    /// Files removed because the set has them no longer.
    pub removed: Vec<String>,
    /// Of those that were written, the ones that somebody had changed since Treewright wrote them.
    pub edited: Vec<String>,
}

/// The right to write into an output folder, until dropped.
///
/// It is the system's lock on the empty file `.treewright-lock` there. The file stays, since removing it would race with
/// a process that has just opened it, but the lock never outlives its process, however that ends. On file systems
/// without locks (some network drives) everybody has the turn.
#[derive(Debug)]
pub(super) struct Turn {
    _file: fs::File,
    is_alone: bool,
}

impl Turn {
    /// Waits for the turn; `wait` is called once when somebody else has it.
    ///
    /// # Errors
    ///
    /// When the folder or the file can't be made.
    pub(super) fn take(out: &Path, wait: impl FnOnce()) -> Result<Self, OutputError> {
        fs::create_dir_all(out).map_err(|source| OutputError::Io { path: out.to_path_buf(), source })?;
        let path = out.join(LOCK);
        let file = Self::open(&path).map_err(|source| OutputError::Io { path, source })?;
        let is_alone = match file.try_lock() {
            Ok(()) => true,
            Err(fs::TryLockError::WouldBlock) => {
                wait();
                // An error here is one of a file system that can't wait; see above.
                file.lock().is_ok()
            }
            Err(fs::TryLockError::Error(_)) => false,
        };
        Ok(Self { _file: file, is_alone })
    }

    /// Whether nobody else can have the turn: not where the file system has no locks.
    pub(super) fn is_alone(&self) -> bool {
        self.is_alone
    }

    /// Takes the turn if nobody has it; none also where the folder can't be written.
    pub(super) fn at_once(out: &Path) -> Option<Self> {
        let file = Self::open(&out.join(LOCK)).ok()?;
        let lock = file.try_lock();
        let is_alone = lock.is_ok();
        (!matches!(lock, Err(fs::TryLockError::WouldBlock))).then_some(Self { _file: file, is_alone })
    }

    /// Another user's lock may be there to be read only, which is enough to lock it.
    fn open(path: &Path) -> io::Result<fs::File> {
        let own = fs::OpenOptions::new().create(true).truncate(false).write(true).open(path);
        own.or_else(|error| fs::File::open(path).map_err(|_| error))
    }
}

/// Whether nothing is left in or beside a set's folder of a commit that was cut off.
pub(super) fn is_settled(folder: &Path) -> bool {
    let next = exchange::next(folder).is_some_and(|next| next.exists());
    !next && ![JOURNAL, exchange::MARK].iter().any(|name| folder.join(name).exists())
}

/// Whether a name is one that only a commit uses.
fn is_ours(name: &str) -> bool {
    let is_part = name.starts_with(PART_PREFIX) && name.ends_with(PART_SUFFIX);
    is_part || [JOURNAL, exchange::MARK].contains(&name)
}

/// The files that a set owns: name and hash, from its last record.
pub(super) type Owned = BTreeMap<String, Key>;

/// Ends a commit that was cut off after its journal was in place, and clears parts of one that was cut off before.
///
/// # Errors
///
/// When the file system refuses.
pub(super) fn recover(folder: &Path) -> Result<(), OutputError> {
    recover_by(&mut Hand::free(), folder)
}

fn recover_by(hand: &mut Hand, folder: &Path) -> Result<(), OutputError> {
    exchange::settle(hand, folder)?;
    let journal = folder.join(JOURNAL);
    match stamp::bytes(&journal) {
        Ok(bytes) => {
            // A journal is renamed into place whole; one that can't be read isn't ours to act on.
            if let Ok(journal) = serde_json::from_slice::<Journal>(&bytes) {
                carry_out(hand, folder, &journal)?;
            }
            hand.remove(&journal)?;
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => {}
        Err(source) => return Err(OutputError::Io { path: journal, source }),
    }
    let Ok(entries) = fs::read_dir(folder) else { return Ok(()) };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(PART_PREFIX) && name.ends_with(PART_SUFFIX) {
            hand.remove(&entry.path())?;
        }
    }
    Ok(())
}

/// Makes `folder` hold exactly `files` of the set, as one commit.
///
/// # Errors
///
/// When a file that Treewright did not write is in the way or the file system refuses. The old set is then complete, or,
/// when a rename was refused in the midst of a commit by journal (a program holds one of the files), the next build ends
/// it.
#[cfg(test)]
fn commit(folder: &Path, owned: &Owned, files: &[Named<Vec<u8>>]) -> Result<Committed, OutputError> {
    commit_stamped(folder, owned, files).map(|(committed, _)| committed)
}

/// As [`commit`]; with the stamps of all files as they were written or compared, where there are any.
pub(super) fn commit_stamped<B: AsRef<[u8]> + Sync>(
    folder: &Path,
    owned: &Owned,
    files: &[Named<B>],
) -> Result<(Committed, Stamps), OutputError> {
    let mut hand = Hand::free();
    let is_new = !folder.exists();
    let result = commit_by(&mut hand, folder, owned, files);
    if result.is_err() {
        // Best effort: the next build clears or ends what is left.
        let _ = recover(folder);
        if is_new {
            // Goes only if nothing is in it.
            let _ = fs::remove_dir(folder);
        }
    }
    result.map(|committed| (committed, hand.stamps))
}

/// A file's name and bytes.
type Named<B> = (String, B);

/// The stamps of a set's files, by name.
pub(super) type Stamps = BTreeMap<String, Stamp>;

fn commit_by<B: AsRef<[u8]> + Sync>(
    hand: &mut Hand,
    folder: &Path,
    owned: &Owned,
    files: &[Named<B>],
) -> Result<Committed, OutputError> {
    fs::create_dir_all(folder).map_err(|source| OutputError::Io { path: folder.to_path_buf(), source })?;
    recover(folder)?;
    let mut committed = Committed::default();
    let mut changed: Vec<(&str, &[u8])> = Vec::new();
    let mut foreign = Vec::new();
    // Whether each is there already, or was changed since it was written, and its stamp.
    let there = |(name, bytes): &Named<B>| {
        stamp::read_at(&folder.join(name)).map(|(old, stamp)| {
            let is_same = old == bytes.as_ref();
            let is_edited = !is_same && owned.get(name).is_some_and(|key| Key::of_bytes(&old) != *key);
            (is_same, is_edited, stamp)
        })
    };
    let found: Vec<io::Result<(bool, bool, Option<Stamp>)>> = files.par_iter().map(there).collect();
    for ((name, bytes), found) in files.iter().zip(found) {
        let (path, bytes) = (folder.join(name), bytes.as_ref());
        match found {
            Ok((true, _, stamp)) => {
                hand.stamps.extend(stamp.map(|stamp| (name.clone(), stamp)));
                committed.unchanged += 1;
            }
            Ok(_) if !owned.contains_key(name) => foreign.push(name.clone()),
            Ok((_, is_edited, _)) => {
                committed.edited.extend(is_edited.then(|| name.clone()));
                changed.push((name, bytes));
            }
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                // A link that leads nowhere is somebody's.
                if fs::symlink_metadata(&path).is_ok() && !owned.contains_key(name) {
                    foreign.push(name.clone());
                } else {
                    changed.push((name, bytes));
                }
            }
            Err(source) => return Err(OutputError::Io { path, source }),
        }
    }
    if !foreign.is_empty() {
        return Err(OutputError::Foreign { folder: folder.to_path_buf(), names: foreign });
    }
    let kept: BTreeSet<&String> = files.iter().map(|(name, _)| name).collect();
    for (name, key) in owned.iter().filter(|(name, _)| !kept.contains(name)) {
        if is_still(&folder.join(name), key) {
            committed.removed.push(name.clone());
        }
    }
    if changed.is_empty() && committed.removed.is_empty() {
        return Ok(committed);
    }
    let touched = changed.iter().map(|(name, _)| *name).chain(committed.removed.iter().map(String::as_str));
    let kept: Vec<String> = touched.filter(|name| is_read_only(&folder.join(name))).map(str::to_owned).collect();
    if !kept.is_empty() {
        return Err(OutputError::ReadOnly { folder: folder.to_path_buf(), names: kept });
    }
    committed.written = changed.iter().map(|(name, _)| (*name).to_owned()).collect();
    if !exchange::commit(hand, folder, &changed, &committed.removed)? {
        let remove = committed.removed.iter().filter_map(|name| Some((name.clone(), owned.get(name)?.to_hex())));
        by_journal(hand, folder, &changed, remove.collect())?;
    }
    Ok(committed)
}

/// Writes parts and a journal, and carries it out.
fn by_journal(
    hand: &mut Hand,
    folder: &Path,
    changed: &[(&str, &[u8])],
    remove: Vec<(String, String)>,
) -> Result<(), OutputError> {
    let mut journal = Journal { rename: Vec::new(), remove };
    for (i, (name, bytes)) in changed.iter().enumerate() {
        let part = format!("{PART_PREFIX}{i:04}{PART_SUFFIX}");
        hand.write_as(&folder.join(&part), bytes, name)?;
        journal.rename.push((part, (*name).to_owned()));
    }
    let text = serde_json::to_vec(&journal).expect("a journal of names serializes");
    let part = folder.join(format!("{PART_PREFIX}journal{PART_SUFFIX}"));
    hand.write(&part, &text)?;
    hand.rename(&part, &folder.join(JOURNAL))?;
    carry_out(hand, folder, &journal)?;
    hand.remove(&folder.join(JOURNAL))
}

/// Does what is left of a journal; every step may have been done already.
fn carry_out(hand: &mut Hand, folder: &Path, journal: &Journal) -> Result<(), OutputError> {
    for (part, target) in &journal.rename {
        let (Some(part), Some(target)) = (inside(folder, part), inside(folder, target)) else { continue };
        if part.exists() {
            hand.rename(&part, &target)?;
        }
    }
    for (name, key) in &journal.remove {
        let (Some(path), Some(key)) = (inside(folder, name), Key::from_hex(key)) else { continue };
        if is_still(&path, &key) {
            hand.remove(&path)?;
        }
    }
    Ok(())
}

/// Whether somebody marked a file as one that is not to be changed. A link in its place bears no such mark.
pub(super) fn is_read_only(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|there| there.is_file() && there.permissions().readonly())
}

/// Whether a file is what it was when its set was recorded.
fn is_still(path: &Path, key: &Key) -> bool {
    stamp::bytes(path).is_ok_and(|bytes| Key::of_bytes(&bytes) == *key)
}

/// A plain file name's path; none for a name that would lead out of the folder.
fn inside(folder: &Path, name: &str) -> Option<PathBuf> {
    is_plain(name).then(|| folder.join(name))
}

/// Whether a name is one of a file in a folder, and leads nowhere else.
pub(super) fn is_plain(name: &str) -> bool {
    !name.is_empty() && name != "." && name != ".." && !name.contains(['/', '\\', ':'])
}

/// Changes files, one step at a time; tests cut it off before any of its steps, as a kill would.
struct Hand {
    left: usize,
    /// Whether folders may be swapped.
    exchanges: bool,
    /// Of what was written or compared, by the name that it gets.
    stamps: Stamps,
}

impl Hand {
    /// A hand that is not cut off.
    const fn free() -> Self {
        Self { left: usize::MAX, exchanges: cfg!(target_os = "linux"), stamps: Stamps::new() }
    }

    fn step(&mut self, path: &Path, change: impl FnOnce() -> io::Result<()>) -> Result<(), OutputError> {
        let result = match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                change()
            }
            None => Err(io::ErrorKind::Interrupted.into()),
        };
        result.map_err(|source| OutputError::Io { path: path.to_path_buf(), source })
    }

    fn write(&mut self, path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        self.write_as(path, bytes, &name)
    }

    /// Writes a file that will be called `name`. Two steps: a kill between them leaves half a file.
    fn write_as(&mut self, path: &Path, bytes: &[u8], name: &str) -> Result<(), OutputError> {
        let (first, rest) = bytes.split_at(bytes.len() / 2);
        let mut open = None;
        self.step(path, || open.insert(fs::File::create(path)?).write_all(first))?;
        let mut stamp = None;
        self.step(path, || {
            let Some(mut file) = open else { return Ok(()) };
            file.write_all(rest)?;
            file.sync_data()?;
            stamp = Stamp::of(&file.metadata()?);
            Ok(())
        })?;
        self.stamps.extend(stamp.map(|stamp| (name.to_owned(), stamp)));
        Ok(())
    }

    fn rename(&mut self, from: &Path, to: &Path) -> Result<(), OutputError> {
        self.step(to, || fs::rename(from, to))
    }

    fn remove(&mut self, path: &Path) -> Result<(), OutputError> {
        self.step(path, || match fs::remove_file(path) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => Err(e),
            _ => Ok(()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(list: &[(&str, &str)]) -> Vec<(String, Vec<u8>)> {
        list.iter().map(|(n, b)| ((*n).to_owned(), b.as_bytes().to_vec())).collect()
    }

    fn owned(list: &[(&str, &str)]) -> Owned {
        list.iter().map(|(n, b)| ((*n).to_owned(), Key::of_bytes(b.as_bytes()))).collect()
    }

    fn listing(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn only_changed_files_are_written_and_stale_ones_removed() {
        let folder = tempfile::tempdir().unwrap();
        let old = [("a", "1"), ("b", "2"), ("c", "3")];
        commit(folder.path(), &Owned::new(), &files(&old)).unwrap();
        let committed = commit(folder.path(), &owned(&old), &files(&[("a", "1"), ("b", "new")])).unwrap();
        let as_wanted =
            Committed { written: vec!["b".into()], unchanged: 1, removed: vec!["c".into()], ..Committed::default() };
        assert_eq!(committed, as_wanted);
        assert_eq!(listing(folder.path()), ["a", "b"]);
        // What somebody changed is written anew, and told.
        fs::write(folder.path().join("b"), "painted over").unwrap();
        let new = [("a", "1"), ("b", "new")];
        let committed = commit(folder.path(), &owned(&new), &files(&[("a", "2"), ("b", "new")])).unwrap();
        assert_eq!((committed.written.len(), committed.edited), (2, vec!["b".to_owned()]));
    }

    #[test]
    fn a_file_of_the_users_is_neither_replaced_nor_removed() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("b"), "mine").unwrap();
        let error = commit(folder.path(), &Owned::new(), &files(&[("a", "1"), ("b", "2")])).unwrap_err();
        assert!(matches!(error, OutputError::Foreign { .. }), "{error}");
        assert_eq!(listing(folder.path()), ["b"]);
        // On the list, but changed since: kept as well.
        commit(folder.path(), &owned(&[("b", "ours")]), &files(&[("a", "1")])).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("b")).unwrap(), "mine");
    }

    #[test]
    fn a_read_only_file_is_neither_replaced_nor_removed_and_what_stays_as_it_is_may_be_one() {
        let folder = tempfile::tempdir().unwrap();
        let old = [("a", "1"), ("b", "2"), ("c", "3")];
        commit(folder.path(), &Owned::new(), &files(&old)).unwrap();
        let mark = |name: &str, is: bool| {
            let path = folder.path().join(name);
            let mut rights = fs::metadata(&path).unwrap().permissions();
            rights.set_readonly(is);
            fs::set_permissions(&path, rights).unwrap();
        };
        ["a", "b", "c"].iter().for_each(|name| mark(name, true));
        for (new, first) in
            [(vec![("a", "1"), ("b", "new")], "b and 1 more are"), (vec![("a", "1"), ("b", "2")], "c is")]
        {
            let error = commit(folder.path(), &owned(&old), &files(&new)).unwrap_err();
            assert!(matches!(error, OutputError::ReadOnly { .. }), "{error}");
            assert!(error.diagnostic().message.starts_with(&format!("{first} read-only")), "{error}");
            assert_eq!(listing(folder.path()), ["a", "b", "c"]);
            assert_eq!(fs::read_to_string(folder.path().join("b")).unwrap(), "2");
        }
        ["b", "c"].iter().for_each(|name| mark(name, false));
        let committed = commit(folder.path(), &owned(&old), &files(&[("a", "1"), ("b", "new")])).unwrap();
        assert_eq!((committed.written.len(), committed.unchanged, committed.removed.len()), (1, 1, 1));
        assert!(is_read_only(&folder.path().join("a")));
    }

    #[test]
    fn turns_are_taken_one_after_the_other() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("new/out");
        let first = Turn::take(&out, || panic!("nobody else is there")).unwrap();
        let (asked, asks) = std::sync::mpsc::channel();
        let (took, takes) = std::sync::mpsc::channel();
        let second = std::thread::spawn(move || {
            let turn = Turn::take(&out, || asked.send(()).unwrap());
            took.send(()).unwrap();
            turn.unwrap();
        });
        asks.recv().unwrap();
        assert!(takes.try_recv().is_err(), "two have the turn");
        drop(first);
        takes.recv().unwrap();
        second.join().unwrap();
    }

    #[test]
    fn a_kill_before_any_step_leaves_the_old_set_or_one_that_the_next_build_ends() {
        // Once on a file system that can swap folders and once by journal.
        let steps = [true, false].map(killed_at_every_step);
        assert!(steps[0] > 10 && steps[1] > 10, "{steps:?}");
    }

    /// How many kills there were.
    fn killed_at_every_step(exchanges: bool) -> usize {
        let hand = |left| Hand { left, exchanges, ..Hand::free() };
        let (old, new) = (
            [("a", "old a"), ("b", "same"), ("c", "old c"), ("m", "1")],
            [("a", "new a"), ("b", "same"), ("d", "new d"), ("m", "2")],
        );
        let read = |folder: &Path| -> Vec<(String, String)> {
            let text = |name: &String| fs::read_to_string(folder.join(name)).unwrap();
            listing(folder).into_iter().map(|name| (name.clone(), text(&name))).collect()
        };
        let with_mine = |set: &[(&str, &str)]| -> Vec<(String, String)> {
            set.iter()
                .chain(&[("mine", "mine")])
                .map(|(n, t)| ((*n).to_owned(), (*t).to_owned()))
                .collect::<std::collections::BTreeSet<_>>()
                .into_iter()
                .collect()
        };
        let (mut kept_old, mut made_new) = (0, 0);
        for left in 0.. {
            let out = tempfile::tempdir().unwrap();
            let folder = out.path().join("set");
            commit(&folder, &Owned::new(), &files(&old)).unwrap();
            fs::write(folder.join("mine"), "mine").unwrap();
            if commit_by(&mut hand(left), &folder, &owned(&old), &files(&new)).is_ok() {
                assert_eq!((read(&folder), listing(out.path())), (with_mine(&new), vec!["set".to_owned()]));
                assert!(kept_old >= 7 && made_new >= 5, "{kept_old} old, {made_new} new");
                return left;
            }
            // What a reader finds meanwhile is whole: nothing but old and new texts under the sets' names.
            let found: Vec<_> = read(&folder).into_iter().filter(|(name, _)| !name.starts_with('.')).collect();
            for (name, text) in &found {
                let known = |set: &[(&str, &str)]| set.contains(&(name, text));
                assert!(known(&old) || known(&new) || name == "mine", "{name}: {text:?} after {left} steps");
            }
            // Swapped folders are even of one set.
            let one = found == with_mine(&old) || found == with_mine(&new);
            assert!(one || !exchanges || !cfg!(target_os = "linux"), "{found:?} after {left} steps");
            // The process that mends is killed as well, at each of its steps.
            for again in 0..20 {
                let _ = recover_by(&mut hand(again % 4), &folder);
            }
            recover(&folder).unwrap();
            assert!(is_settled(&folder) && listing(out.path()) == ["set"], "{:?}", listing(out.path()));
            match read(&folder) {
                now if now == with_mine(&old) => kept_old += 1,
                now if now == with_mine(&new) => made_new += 1,
                now => panic!("after {left} steps: {now:?}"),
            }
        }
        unreachable!("a commit has an end")
    }

    #[test]
    fn a_swap_carries_over_what_was_saved_meanwhile_and_folders_keep_it_from_happening() {
        let out = tempfile::tempdir().unwrap();
        let folder = out.path().join("set");
        let (old, new) = ([("a", "old"), ("b", "same")], [("a", "new"), ("b", "same")]);
        commit(&folder, &Owned::new(), &files(&old)).unwrap();
        fs::write(folder.join("mine"), "mine").unwrap();
        let whole = listing(&folder);
        fs::write(folder.join("deleted"), "mine").unwrap();
        // Cut off right after the swap: the clearing of the old folder has begun with nothing.
        let swapped = (0..).find(|&left| {
            let result = commit_by(&mut Hand { left, ..Hand::free() }, &folder, &owned(&old), &files(&new));
            let swapped = folder.join(exchange::MARK).exists();
            if !swapped {
                recover(&folder).unwrap();
            }
            swapped || result.is_ok()
        });
        if !folder.join(exchange::MARK).exists() {
            return assert!(swapped.is_some());
        }
        fs::remove_file(folder.join("deleted")).unwrap();
        let left = exchange::next(&folder).unwrap();
        fs::write(left.join("saved"), "meanwhile").unwrap();
        fs::remove_file(left.join("mine")).unwrap();
        fs::write(left.join("mine"), "saved by rename").unwrap();
        // By a machine whose clock is behind.
        let file = fs::File::options().write(true).open(left.join("mine")).unwrap();
        file.set_modified(std::time::UNIX_EPOCH).unwrap();
        recover(&folder).unwrap();
        assert_eq!(listing(&folder), [whole, vec!["saved".to_owned()]].concat());
        assert_eq!(fs::read_to_string(folder.join("mine")).unwrap(), "saved by rename");
        assert_eq!(fs::read_to_string(folder.join("a")).unwrap(), "new");
        // A folder of the user's can't be linked: the journal leaves it where it is.
        fs::create_dir(folder.join("theirs")).unwrap();
        fs::write(folder.join("theirs/file"), "mine").unwrap();
        let committed = commit(&folder, &owned(&new), &files(&old)).unwrap();
        assert_eq!((committed.written, committed.unchanged), (vec!["a".to_owned()], 1));
        assert_eq!(fs::read_to_string(folder.join("theirs/file")).unwrap(), "mine");
        assert!(is_settled(&folder));
    }

    #[test]
    fn a_commit_that_was_cut_off_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("a"), "old").unwrap();
        fs::write(at("stale"), "old").unwrap();
        fs::write(at("edited"), "by somebody, after the kill").unwrap();
        fs::write(at(".treewright-0000.part"), "new").unwrap();
        let renames = r#"[[".treewright-0000.part","a"],["gone.part","b"],["../x","y"]]"#;
        let old = Key::of_bytes(b"old").to_hex();
        let removed = format!(r#"[["stale","{old}"],["edited","{old}"],["../../etc","{old}"]]"#);
        fs::write(at(JOURNAL), format!(r#"{{"rename":{renames},"remove":{removed}}}"#)).unwrap();
        recover(folder.path()).unwrap();
        assert_eq!(listing(folder.path()), ["a", "edited"]);
        assert_eq!(fs::read_to_string(at("a")).unwrap(), "new");
    }

    #[test]
    fn a_commit_that_was_cut_off_before_its_journal_leaves_the_old_set() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a"), "old").unwrap();
        fs::write(folder.path().join(".treewright-0000.part"), "half").unwrap();
        recover(folder.path()).unwrap();
        assert_eq!(listing(folder.path()), ["a"]);
        assert_eq!(fs::read_to_string(folder.path().join("a")).unwrap(), "old");
    }
}
