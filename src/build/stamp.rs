//! What the system tells of a file without reading it, and when that is enough to know its content.
//!
//! As Git's index does: a file whose size, times and inode are those that it had when its bytes were last hashed was not
//! touched since, with one exception. Clocks of file systems stand still for some milliseconds (whole seconds on old
//! ones), and a file that is changed twice within one such tick shows one time; so a stamp proves nothing when the file
//! was changed less than a tick before it was looked at ([`Stamp::is_racy`]), and then the bytes are hashed again. A
//! stamp only ever says that nothing was touched. Whether something *changed* is for hashes to say.

use std::fs::{self, File, Metadata};
use std::io::{self, Read};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

/// Longest tick of file systems that keep parts of seconds, nanoseconds: a timer's interrupt at 100 Hz, twice.
const TICK: u64 = 20_000_000;
/// Tick of those that don't: FAT counts two seconds.
const COARSE: u64 = 2_000_000_000;

/// Size, times and inode of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Stamp {
    size: u64,
    /// Of the last change, nanoseconds since 1970.
    modified: u64,
    /// Of the last change of the inode, which nobody can set back; 0 where the system has none.
    changed: u64,
    inode: u64,
}

impl Stamp {
    /// What the system tells.
    pub(crate) fn of(metadata: &Metadata) -> Option<Self> {
        let modified = metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
        let (changed, inode) = inode(metadata);
        Some(Self { size: metadata.len(), modified: u64::try_from(modified.as_nanos()).ok()?, changed, inode })
    }

    /// The stamp of what lies at `path` now.
    pub(crate) fn at(path: &Path) -> Option<Self> {
        fs::metadata(path).ok().filter(Metadata::is_file).as_ref().and_then(Self::of)
    }

    /// How large the file is, bytes.
    pub(crate) const fn size(&self) -> u64 {
        self.size
    }

    /// Whether both are of one file with one content, but for what renaming and linking change.
    pub(crate) fn is_same_content(&self, other: &Self) -> bool {
        (self.size, self.modified, self.inode) == (other.size, other.modified, other.inode)
    }

    /// Whether the file may have been changed once more without another stamp, after it was looked at at `time`.
    pub(crate) const fn is_racy(&self, time: u64) -> bool {
        let tick = if self.modified.is_multiple_of(1_000_000_000) { COARSE } else { TICK };
        self.modified.saturating_add(tick) >= time
    }
}

/// The clock that stamps are compared with.
#[expect(
    clippy::disallowed_methods,
    reason = "tells whether a stamp is old enough to be trusted; hashes decide otherwise"
)]
pub(crate) fn now() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// A file's bytes, at most `most` of them and one, and its stamp when it did not change while it was read.
pub(crate) fn read(file: &mut File, most: u64) -> io::Result<(Vec<u8>, Option<Stamp>)> {
    let before = file.metadata()?;
    let mut bytes = Vec::with_capacity(usize::try_from(before.len().min(most)).unwrap_or(0) + 1);
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    let after = file.metadata()?;
    let stamp = Stamp::of(&before).filter(|stamp| Stamp::of(&after) == Some(*stamp));
    Ok((bytes, stamp))
}

/// A whole file with its stamp.
pub(crate) fn read_at(path: &Path) -> io::Result<(Vec<u8>, Option<Stamp>)> {
    // Asked before it is opened: opening a pipe waits for somebody to write into it.
    let metadata = fs::metadata(path)?;
    if !metadata.is_file() && !metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "a pipe or a device is in its place"));
    }
    read(&mut File::open(path)?, u64::MAX - 1)
}

/// A whole file; an error where something else is in its place, which might never end.
pub(crate) fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    read_at(path).map(|(bytes, _)| bytes)
}

#[cfg(unix)]
fn inode(metadata: &Metadata) -> (u64, u64) {
    use std::os::unix::fs::MetadataExt;
    let changed = metadata.ctime().wrapping_mul(1_000_000_000).wrapping_add(metadata.ctime_nsec());
    (changed.cast_unsigned(), metadata.ino())
}

/// Without inodes the time of creation tells a file that replaced another.
#[cfg(not(unix))]
fn inode(metadata: &Metadata) -> (u64, u64) {
    let created = metadata.created().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
    (0, created.map_or(0, |time| u64::try_from(time.as_nanos()).unwrap_or(0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_changes_with_the_file_and_is_trusted_a_tick_later() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        assert_eq!((Stamp::at(&path), Stamp::at(folder.path())), (None, None));
        fs::write(&path, "one").unwrap();
        let (bytes, stamp) = read_at(&path).unwrap();
        let stamp = stamp.unwrap();
        assert_eq!((bytes.as_slice(), Stamp::at(&path)), (b"one".as_slice(), Some(stamp)));
        fs::write(&path, "three").unwrap();
        assert_ne!(Stamp::at(&path), Some(stamp));
        // A file of the same size and time in its place is another one.
        fs::write(folder.path().join("b"), "one").unwrap();
        let time = UNIX_EPOCH + std::time::Duration::from_nanos(stamp.modified);
        File::options().write(true).open(folder.path().join("b")).unwrap().set_modified(time).unwrap();
        fs::rename(folder.path().join("b"), &path).unwrap();
        assert!(!Stamp::at(&path).unwrap().is_same_content(&stamp));
        let at = |modified| Stamp { modified, ..stamp };
        assert!(at(5_000_000_001).is_racy(5_000_000_001) && at(5_000_000_001).is_racy(5_010_000_000));
        assert!(!at(5_000_000_001).is_racy(5_030_000_000) && at(5_000_000_000).is_racy(6_900_000_000));
        assert!(at(9_000_000_001).is_racy(5_000_000_000), "a time to come proves nothing");
    }
}
