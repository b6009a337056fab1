//! The file system as a build sees it: bytes come in here and nowhere else, and what was read is remembered.
//!
//! The record is what a watcher listens to and what a dependency file lists; it holds missing files too, since making
//! them changes the outcome.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::Limits;
use super::stamp::{self, Stamp};
use crate::base::Key;
use crate::preset::nearest;

/// What is said of a file that is not there.
const NONE: &str = "there is no such file";
/// What is said of a file that a clone without Git LFS, or one that skipped it, has in the place of a large one.
const POINTER: &str = "it is a Git LFS pointer, not the file itself: run `git lfs pull`";
/// Most entries of a folder that are looked through for the one that was meant.
const MOST_ENTRIES: usize = 4096;

/// Where files are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Disk,
    Memory,
}

/// Reads files relative to one folder and remembers each.
#[derive(Debug)]
pub struct World {
    folder: PathBuf,
    source: Source,
    limits: Limits,
    reads: Mutex<BTreeMap<PathBuf, Option<Key>>>,
    stamps: Mutex<BTreeMap<PathBuf, Stamp>>,
    /// What stands for files, or for what they hold.
    instead: BTreeMap<PathBuf, Vec<u8>>,
    /// When the first file may have been read.
    start: u64,
}

impl World {
    /// A world whose relative paths start at `folder`.
    #[must_use]
    pub fn at(folder: impl Into<PathBuf>) -> Self {
        Self::within(folder, Limits::default())
    }

    /// The same, reading no file beyond `limits`.
    #[must_use]
    pub fn within(folder: impl Into<PathBuf>, limits: Limits) -> Self {
        let (reads, stamps) = (Mutex::default(), Mutex::default());
        let (instead, source) = (BTreeMap::new(), Source::Disk);
        Self { folder: folder.into(), source, limits, reads, stamps, instead, start: stamp::now() }
    }

    /// A world of files in memory, by their paths with `/` between folders; nothing on disk is looked at.
    #[must_use]
    pub fn in_memory(files: BTreeMap<String, Vec<u8>>) -> Self {
        let mut world = Self::at("");
        world.source = Source::Memory;
        world.instead = files.into_iter().map(|(name, bytes)| (world.path(&name), bytes)).collect();
        world
    }

    /// The same, where some files, relative to the folder, hold other texts than they do: edits that are not saved.
    #[must_use]
    pub fn with_texts(mut self, texts: BTreeMap<String, String>) -> Self {
        self.instead = texts.into_iter().map(|(name, text)| (self.path(&name), text.into_bytes())).collect();
        self
    }

    /// The file's bytes; `relative` has `/` between folders.
    ///
    /// # Errors
    ///
    /// One sentence for people, without the file's name.
    pub fn read(&self, relative: &str) -> Result<Vec<u8>, String> {
        let path = self.path(relative);
        let found = match (self.instead.get(&path), self.source) {
            (Some(bytes), Source::Memory) => Ok((bytes.clone(), None)),
            // What is not saved is no input that a build could be repeated from: it is not remembered.
            (Some(bytes), Source::Disk) => return Ok(bytes.clone()),
            (None, Source::Memory) => Err(NONE.to_owned()),
            (None, Source::Disk) => self.allowed(&path).and_then(|()| read_bounded(&path, self.limits.file)),
        };
        let found = found
            .and_then(|(bytes, stamp)| if is_pointer(&bytes) { Err(POINTER.to_owned()) } else { Ok((bytes, stamp)) });
        let (result, stamp) = match found {
            Ok((bytes, stamp)) => (Ok(bytes), stamp),
            Err(why) => (Err(why), None),
        };
        let key = result.as_ref().ok().map(|bytes| Key::of_bytes(bytes));
        let mut stamps = self.stamps.lock().expect("no reader panics while it holds the lock");
        stamps.extend(stamp.map(|stamp| (path.clone(), stamp)));
        drop(stamps);
        self.reads.lock().expect("no reader panics while it holds the lock").insert(path, key);
        result
    }

    /// The file's text.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read), and when the file is no UTF-8.
    pub fn read_text(&self, relative: &str) -> Result<String, String> {
        let bytes = self.read(relative)?;
        String::from_utf8(bytes).map_err(|e| {
            let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count() + 1;
            format!("it is not UTF-8 text (line {line})")
        })
    }

    /// Whether a file may be read, wherever links lead.
    fn allowed(&self, path: &Path) -> Result<(), String> {
        let Some(root) = &self.limits.root else { return Ok(()) };
        let root =
            root.canonicalize().map_err(|e| format!("the folder {} (--root) is not there: {e}", root.display()))?;
        // Of what is not there the folder says where it would be; without that it is told as missing, which it is.
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let Ok(real) = path.canonicalize().or_else(|_| folder.canonicalize()) else { return Ok(()) };
        if real.starts_with(root) { Ok(()) } else { Err("it lies outside of the project's folder (--root)".to_owned()) }
    }

    /// Where a relative path lies.
    #[must_use]
    pub fn path(&self, relative: &str) -> PathBuf {
        relative.split('/').fold(self.folder.clone(), |path, part| match part {
            "" | "." => path,
            ".." => climb(&path),
            part => path.join(part),
        })
    }

    /// Every file that was asked for, with the key of what it held; none for one that could not be read.
    #[must_use]
    pub fn reads(&self) -> BTreeMap<PathBuf, Option<Key>> {
        self.reads.lock().expect("no reader panics while it holds the lock").clone()
    }

    /// Whether every file still holds what was read of it, and what was missing still is. A file that is there and can't be
    /// read may hold anything.
    pub(super) fn is_current(&self) -> bool {
        let (stamps, start) = self.stamps();
        let is_same = |path: &Path, key: Key| {
            let untouched = stamps.get(path).is_some_and(|old| Stamp::at(path) == Some(*old) && !old.is_racy(start));
            untouched || read_bounded(path, self.limits.file).is_ok_and(|(bytes, _)| Key::of_bytes(&bytes) == key)
        };
        self.reads().iter().all(|(path, key)| key.map_or_else(|| fs::metadata(path).is_err(), |key| is_same(path, key)))
    }

    /// The stamps of what was read, and a time before all of it.
    pub(super) fn stamps(&self) -> (BTreeMap<PathBuf, Stamp>, u64) {
        (self.stamps.lock().expect("no reader panics while it holds the lock").clone(), self.start)
    }
}

/// A folder's parent, by name where the name says it, so that shown paths stay short.
fn climb(path: &Path) -> PathBuf {
    match path.file_name() {
        Some(_) if !path.ends_with("..") => path.parent().map_or_else(PathBuf::new, Path::to_path_buf),
        _ => path.join(".."),
    }
}

/// Says that a file is not there, and which one of its folder was probably meant, or that a link is.
fn missing(path: &Path) -> String {
    if fs::symlink_metadata(path).is_ok_and(|there| there.is_symlink()) {
        return format!("{NONE}: the link leads nowhere");
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = fs::read_dir(folder).into_iter().flatten().take(MOST_ENTRIES).flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    // Folders are listed in any order.
    names.sort_unstable();
    let typed = path.file_name().and_then(|name| name.to_str());
    match typed.and_then(|typed| nearest(typed, names.iter().map(String::as_str))) {
        Some(meant) => format!("{NONE}; did you mean `{meant}`?"),
        None => NONE.to_owned(),
    }
}

/// Whether a file only says where Git LFS keeps the one that is meant.
fn is_pointer(bytes: &[u8]) -> bool {
    bytes.len() < 1024 && bytes.starts_with(b"version https://git-lfs.github.com/spec/")
}

fn read_bounded(path: &Path, most: u64) -> Result<(Vec<u8>, Option<Stamp>), String> {
    let explain = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => missing(path),
        std::io::ErrorKind::PermissionDenied => "there is no right to read it".to_owned(),
        std::io::ErrorKind::NotADirectory => "a part of its path is a file, not a folder".to_owned(),
        _ => e.to_string(),
    };
    // Asked before it is opened: opening a pipe waits for somebody to write into it.
    let metadata = fs::metadata(path).map_err(explain)?;
    if !metadata.is_file() {
        return Err(if metadata.is_dir() { "it is a folder" } else { "it is not a file" }.to_owned());
    }
    let mut file = fs::File::open(path).map_err(explain)?;
    // Reads at most one byte more than allowed: a file may grow while it is read.
    let (bytes, stamp) = stamp::read(&mut file, most).map_err(explain)?;
    if bytes.len() as u64 > most {
        let most = if most >> 20 > 0 { format!("{} MiB", most >> 20) } else { format!("{most} bytes") };
        return Err(format!("it is larger than {most}, the most that is read of a file (--max-file)"));
    }
    Ok((bytes, stamp))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_are_remembered_also_the_failed_ones() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.txt"), "text").unwrap();
        let world = World::at(folder.path());
        assert_eq!(world.read_text("./a.txt").unwrap(), "text");
        assert_eq!(world.read("sub/../b.txt").unwrap_err(), "there is no such file; did you mean `a.txt`?");
        let reads = world.reads();
        assert_eq!(reads[&folder.path().join("a.txt")], Some(Key::of_bytes(b"text")));
        assert_eq!(reads[&folder.path().join("b.txt")], None);
    }

    #[test]
    fn files_in_memory_hide_those_on_disk() {
        let files = BTreeMap::from([("a/b.ron".to_owned(), b"text".to_vec())]);
        let world = World::in_memory(files);
        assert_eq!(world.read("a/./c/../b.ron").unwrap(), b"text");
        assert_eq!(world.read("Cargo.toml").unwrap_err(), NONE);
        assert_eq!(world.reads().len(), 2);
    }

    #[test]
    fn what_stands_for_a_large_file_is_told_as_that_until_the_file_comes() {
        let folder = tempfile::tempdir().unwrap();
        let text = "version https://git-lfs.github.com/spec/v1\noid sha256:12ab\nsize 9000000\n";
        fs::write(folder.path().join("oak.glb"), text).unwrap();
        let world = World::at(folder.path());
        assert!(world.read("oak.glb").unwrap_err().contains("git lfs pull"));
        assert_eq!(world.reads()[&folder.path().join("oak.glb")], None);
        fs::write(folder.path().join("oak.glb"), "glTF").unwrap();
        assert_eq!(world.read("oak.glb").unwrap(), b"glTF");
    }

    #[test]
    fn no_more_is_read_than_allowed() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a"), [0; 10]).unwrap();
        let most = |file| Limits { file, ..Limits::default() };
        assert_eq!(World::within(folder.path(), most(10)).read("a").unwrap().len(), 10);
        assert!(World::within(folder.path(), most(9)).read("a").unwrap_err().contains("larger than 9 bytes"));
        let inside = Limits { root: Some(folder.path().join("sub")), ..Limits::default() };
        fs::create_dir(folder.path().join("sub")).unwrap();
        fs::write(folder.path().join("sub/b"), "b").unwrap();
        let world = World::within(folder.path().join("sub"), inside);
        assert_eq!(world.read("b").unwrap(), b"b");
        assert!(world.read("c").unwrap_err().contains("no such file"));
        fs::write(folder.path().join("sub/maple.ron"), "m").unwrap();
        assert!(world.read("mapel.ron").unwrap_err().contains("did you mean `maple.ron`?"));
        assert!(world.read("../a").unwrap_err().contains("outside of the project"));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("gone.ron", folder.path().join("sub/link.ron")).unwrap();
            let world = World::within(folder.path(), Limits::default());
            assert!(world.read("sub/link.ron").unwrap_err().ends_with("the link leads nowhere"));
        }
    }

    #[test]
    fn what_was_read_is_current_until_it_changes_or_what_was_missing_comes() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        fs::write(&a, "one").unwrap();
        let world = World::at(folder.path());
        assert!(world.read("a").is_ok() && world.read("b").is_err() && world.is_current());
        // Of the same size and within a tick, perhaps.
        fs::write(&a, "two").unwrap();
        assert!(!world.is_current());
        fs::write(&a, "one").unwrap();
        assert!(world.is_current(), "touched and not changed");
        fs::write(&b, "").unwrap();
        assert!(!world.is_current());
    }

    #[test]
    fn climbing_leaves_the_folder_by_name() {
        assert_eq!(World::at("a/b").path("../c.ron"), Path::new("a/c.ron"));
        assert_eq!(World::at("").path("../c.ron"), Path::new("../c.ron"));
        assert_eq!(World::at("..").path("../c.ron"), Path::new("../../c.ron").to_path_buf());
    }
}
