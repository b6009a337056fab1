//! The tier on disk: `FOLDER/STAGE/KEY.entry`, a file an entry, safe under any number of processes.
//!
//! An entry is written beside its place and renamed into it; whoever comes second replaces equal bytes by equal bytes. The
//! name that it is written under is drawn by chance: machines and containers that share a folder share process numbers.
//! It carries its key and the hash of what it holds, so that one that was cut off, changed or put elsewhere is a miss.
//! Nothing is flushed: after a loss of power such an entry is damaged and made again. An entry's time of change is the
//! time of its last use; it decides what goes when the folder is full and nothing else.

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::SystemTime;

use super::super::replace::{LEFT, chance};
use super::CacheOptions;
use crate::base::Key;

/// First bytes of an entry.
const MAGIC: [u8; 8] = *b"twcache1";
const HEADER: usize = MAGIC.len() + 64;
const SUFFIX: &str = ".entry";
const TEMPORARY: &str = ".part";
/// Largest entry that is read, bytes.
const MOST_BYTES: u64 = 2 << 30;
/// Room that is made for an entry before it is read.
const CLAIMED: usize = 1 << 24;

/// The folder could not be used.
#[derive(Debug, thiserror::Error)]
#[error("the folder {path} can't be {what}: {source}")]
pub struct CacheError {
    /// The file or folder.
    pub path: PathBuf,
    /// What was tried.
    what: &'static str,
    /// What the system said.
    pub source: io::Error,
}

/// What a cache's folder holds.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct CacheStats {
    /// By stage: its name, entries, bytes.
    pub stages: Vec<(String, u64, u64)>,
    /// All entries.
    pub entries: u64,
    /// Their bytes.
    pub bytes: u64,
}

/// What a key has.
pub(super) enum Found {
    Whole(Vec<u8>),
    Missing,
    /// The entry was not what was written; it is gone.
    Broken(PathBuf),
}

/// A folder of entries.
#[derive(Debug)]
pub(super) struct Store {
    folder: PathBuf,
    limit: u64,
    /// What the names of its parts begin with.
    mark: u64,
    parts: AtomicU64,
    refused: AtomicBool,
}

/// How often an entry is written anew when its folder goes or its part's name is taken.
const TRIES: usize = 8;

impl Store {
    pub(super) fn new(options: &CacheOptions) -> Self {
        let CacheOptions { folder, limit } = options.clone();
        Self { folder, limit, mark: chance(), parts: AtomicU64::new(0), refused: AtomicBool::new(false) }
    }

    /// Where an entry lies.
    pub(super) fn path(&self, stage: &str, key: Key) -> PathBuf {
        self.folder.join(stage).join(key.to_hex() + SUFFIX)
    }

    pub(super) fn get(&self, stage: &str, key: Key) -> Found {
        let path = self.path(stage, key);
        // What can't be opened or is no file is a miss like any other; writing it again will tell.
        let is_file = fs::metadata(&path).is_ok_and(|there| there.is_file());
        let Some(file) = is_file.then(|| fs::File::open(&path).ok()).flatten() else { return Found::Missing };
        match read(&file, key) {
            Some(bytes) => {
                // A folder that can't be written forgets when entries were used.
                let _ = file.set_modified(clock());
                Found::Whole(bytes)
            }
            None => {
                let _ = fs::remove_file(&path);
                Found::Broken(path)
            }
        }
    }

    /// Writes an entry.
    pub(super) fn put(&self, stage: &str, key: Key, bytes: &[u8]) -> Result<(), CacheError> {
        // What is too large to be read again is not kept.
        if self.refused.load(Ordering::Relaxed) || (HEADER + bytes.len()) as u64 > MOST_BYTES {
            return Ok(());
        }
        let path = self.path(stage, key);
        let header = [MAGIC.as_slice(), &key.bytes(), &Key::of_bytes(bytes).bytes()].concat();
        for _ in 0..TRIES {
            let part = self.part(stage);
            let made = fs::create_dir_all(self.folder.join(stage)).and_then(|()| fs::File::create_new(&part));
            let written = made.and_then(|mut file| {
                let written = file.write_all(&header).and_then(|()| file.write_all(bytes));
                drop(file);
                written.and_then(|()| fs::rename(&part, &path)).inspect_err(|_| drop(fs::remove_file(&part)))
            });
            match written {
                // Somebody clears the cache meanwhile, or has a part of that name.
                Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::AlreadyExists) => {}
                Err(source) => return Err(CacheError { path: self.folder.clone(), what: "written", source }),
                Ok(()) => return Ok(()),
            }
        }
        // Not kept; that is no reason to keep nothing more, unless no such folder can be.
        if self.folder.is_dir() {
            return Ok(());
        }
        Err(CacheError { path: self.folder.clone(), what: "made", source: io::ErrorKind::NotFound.into() })
    }

    /// Where an entry is written first.
    fn part(&self, stage: &str) -> PathBuf {
        let number = self.parts.fetch_add(1, Ordering::Relaxed);
        self.folder.join(stage).join(format!("{:016x}-{number}{TEMPORARY}", self.mark))
    }

    /// Stops writing; whether it had not yet.
    pub(super) fn gives_up(&self) -> bool {
        !self.refused.swap(true, Ordering::Relaxed)
    }

    /// Removes entries that were used longest ago until all are within four fifths of the limit, where they are beyond
    /// it, and parts of processes that died.
    pub(super) fn trim(&self) -> Result<(), CacheError> {
        // What can't be written was told, and did not grow.
        if self.refused.load(Ordering::Relaxed) {
            return Ok(());
        }
        let mut entries = entries(&self.folder)?;
        let mut total: u64 = entries.iter().map(|entry| entry.bytes).sum();
        let now = clock();
        for part in entries.iter().filter(|entry| entry.is_part) {
            if now.duration_since(part.used).is_ok_and(|age| age > LEFT) {
                let _ = fs::remove_file(&part.path);
            }
        }
        if total <= self.limit {
            return Ok(());
        }
        // Of equal age by name, so that what goes does not hang on the order of a folder.
        entries.sort_by(|a, b| (a.used, &a.path).cmp(&(b.used, &b.path)));
        for entry in entries.into_iter().filter(|entry| !entry.is_part) {
            if total <= self.limit / 5 * 4 {
                break;
            }
            // Another process may have removed it; either way it counts no longer.
            let _ = fs::remove_file(&entry.path);
            total -= entry.bytes;
        }
        Ok(())
    }
}

/// Now. When entries were used is all that clocks decide here: what is evicted, never what is built.
#[expect(clippy::disallowed_methods, reason = "what was used longest ago is evicted first")]
fn clock() -> SystemTime {
    SystemTime::now()
}

/// The payload of an entry; none when it is not the whole entry of this key.
fn read(file: &fs::File, key: Key) -> Option<Vec<u8>> {
    let length = file.metadata().ok()?.len();
    if length > MOST_BYTES || length < HEADER as u64 {
        return None;
    }
    let mut header = [0; HEADER];
    let mut file = file.take(length);
    file.read_exact(&mut header).ok()?;
    // Not as long as a file with holes in it claims to be.
    let mut bytes = Vec::with_capacity((length as usize - HEADER).min(CLAIMED));
    file.read_to_end(&mut bytes).ok()?;
    let rest = header.strip_prefix(&MAGIC)?;
    let (of, hash) = rest.split_at(32);
    (of == key.bytes() && hash == Key::of_bytes(&bytes).bytes()).then_some(bytes)
}

/// One file of a cache.
struct Listed {
    stage: String,
    path: PathBuf,
    bytes: u64,
    used: SystemTime,
    is_part: bool,
}

/// Every file that is named as Treewright names them, two levels deep; nothing else is looked at.
fn entries(folder: &Path) -> Result<Vec<Listed>, CacheError> {
    let mut found = Vec::new();
    let stages = match fs::read_dir(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(found),
        stages => stages.map_err(|source| CacheError { path: folder.to_path_buf(), what: "read", source })?,
    };
    for stage in stages.flatten() {
        // Links are not followed: what they lead to is not the cache's.
        if !stage.file_type().is_ok_and(|kind| kind.is_dir()) {
            continue;
        }
        let Ok(files) = fs::read_dir(stage.path()) else { continue };
        for file in files.flatten() {
            let name = file.file_name();
            let name = name.to_string_lossy();
            let is_part = name.strip_suffix(TEMPORARY).is_some_and(is_part_name);
            let is_entry = name.strip_suffix(SUFFIX).is_some_and(|key| Key::from_hex(key).is_some());
            let Ok(metadata) = file.metadata() else { continue };
            if (is_part || is_entry) && metadata.is_file() {
                found.push(Listed {
                    stage: stage.file_name().to_string_lossy().into_owned(),
                    path: file.path(),
                    bytes: metadata.len(),
                    used: metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH),
                    is_part,
                });
            }
        }
    }
    Ok(found)
}

fn is_part_name(name: &str) -> bool {
    name.split_once('-').is_some_and(|(mark, number)| {
        [mark, number].iter().all(|part| !part.is_empty() && part.bytes().all(|b| b.is_ascii_hexdigit()))
    })
}

/// What a cache's folder holds; a folder that is not there holds nothing.
///
/// # Errors
///
/// When it can't be read.
pub fn stats(folder: &Path) -> Result<CacheStats, CacheError> {
    let mut all = CacheStats::default();
    let mut by_stage = std::collections::BTreeMap::<String, (u64, u64)>::new();
    for entry in entries(folder)?.into_iter().filter(|entry| !entry.is_part) {
        let stage = by_stage.entry(entry.stage).or_default();
        stage.0 += 1;
        stage.1 += entry.bytes;
        all.entries += 1;
        all.bytes += entry.bytes;
    }
    all.stages = by_stage.into_iter().map(|(stage, (entries, bytes))| (stage, entries, bytes)).collect();
    Ok(all)
}

/// Removes every entry, and folders that are empty then; files of others stay. Returns what was removed.
///
/// # Errors
///
/// When the folder can't be read or an entry can't be removed.
pub fn clear(folder: &Path) -> Result<CacheStats, CacheError> {
    let removed = stats(folder)?;
    for entry in entries(folder)? {
        match fs::remove_file(&entry.path) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                return Err(CacheError { path: entry.path, what: "cleared", source });
            }
            _ => {}
        }
    }
    for (stage, _, _) in &removed.stages {
        // Only succeeds for an empty one, which is meant.
        let _ = fs::remove_dir(folder.join(stage));
    }
    Ok(removed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_processes_write_to_one_part_and_a_cleared_folder_is_made_again() {
        let folder = tempfile::tempdir().unwrap();
        let options = CacheOptions { folder: folder.path().join("kept"), limit: CacheOptions::LIMIT };
        let [one, other] = [Store::new(&options), Store::new(&options)];
        assert_ne!(one.part("a"), other.part("a"));
        // Another's part, of whatever name, is not written into.
        fs::create_dir_all(options.folder.join("a")).unwrap();
        let taken = one.folder.join("a").join(format!("{:016x}-1{TEMPORARY}", one.mark));
        fs::write(&taken, "half").unwrap();
        let key = Key::of_bytes(b"key");
        one.put("a", key, b"whole").unwrap();
        assert_eq!(fs::read(&taken).unwrap(), b"half");
        assert!(matches!(other.get("a", key), Found::Whole(bytes) if bytes == b"whole"));
        // Cleared by others again and again while it is written to: nothing is an error.
        let cleared = std::thread::scope(|scope| {
            let writer = scope.spawn(|| (0..400).try_for_each(|_| one.put("b", key, b"whole")));
            let mut clears = 0;
            while !writer.is_finished() {
                let _ = clear(&options.folder);
                let _ = fs::remove_dir_all(options.folder.join("b"));
                clears += 1;
            }
            writer.join().unwrap().map(|()| clears)
        });
        assert!(cleared.unwrap() > 0);
    }
}
