//! Swapping a set's folder for a new one in a single step of the file system.
//!
//! The new folder is made whole beside the old one (`OUT/.treewright-NAME.next`): changed files are written, all others
//! are linked, also those of the user's; then Linux' `renameat2(RENAME_EXCHANGE)` swaps the two names. At every moment
//! before it, what bears the set's name is the complete old set, and after it the complete new one, kill or no kill.
//! What is left of the old folder is cleared then, or by the next build ([`settle`]). A file that somebody saved into the
//! old folder between the linking and the swap is carried over.
//!
//! The mark, a file in the new folder, tells on which side of the swap a build was cut off: it lists what of the old
//! folder was replaced or removed, so that everything else there is known to be somebody else's, and the inodes of what was
//! linked, so that no clock is asked whether somebody saved another file under that name since.
//!
//! Limits: where the file system can't swap or link, where the set's folder is a link, holds folders (which can't be
//! linked), may not be written or belongs to another user, and on systems other than Linux, the caller goes on to the journal.
//! Extended attributes of the folder itself are lost. A program that stands *in* the folder stays in the old one: shells have to
//! enter it again, and watchers that are bound to the folder instead of its name see links go. Engines that watch by
//! name or look at times see changed files only: what is linked keeps its inode and times. The manifest's hashes tell
//! what changed in any case.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Hand, OutputError, is_ours, stamp};

/// Name of the mark.
pub(super) const MARK: &str = ".treewright-exchange.json";

/// What the mark holds.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Mark {
    /// The names of the old folder that were replaced or removed.
    gone: BTreeSet<String>,
    /// The inodes of those that were linked.
    linked: BTreeMap<String, u64>,
}

impl Mark {
    /// One that isn't ours names nothing; an earlier version's names what is gone.
    fn read(bytes: &[u8]) -> Self {
        let of_names = || serde_json::from_slice(bytes).map(|gone| Self { gone, ..Self::default() });
        serde_json::from_slice(bytes).or_else(|_| of_names()).unwrap_or_default()
    }

    /// Whether a file in the old folder was saved there after it was linked, and nothing else was in the new one since.
    fn was_saved(&self, name: Option<&str>, old: &Path, new: &Path) -> bool {
        let (was, now) = (inode(old), inode(new));
        match name.and_then(|name| self.linked.get(name)) {
            Some(linked) => was != Some(*linked) && (now.is_none() || now == Some(*linked)),
            None => now.is_none() || was != now && is_newer(old, new),
        }
    }
}

/// Where the new folder is made, beside the old one.
pub(super) fn next(folder: &Path) -> Option<PathBuf> {
    let name = folder.file_name()?;
    let mut beside = OsString::from(".treewright-");
    beside.push(name);
    beside.push(".next");
    Some(folder.parent()?.join(beside))
}

/// Makes `folder` hold the files in `write` and no longer those in `remove`, in one step; false where that can't be done,
/// which leaves everything as it was.
pub(super) fn commit(
    hand: &mut Hand,
    folder: &Path,
    write: &[(&str, &[u8])],
    remove: &[String],
) -> Result<bool, OutputError> {
    let Some(next) = next(folder).filter(|_| hand.exchanges) else { return Ok(false) };
    let Some(others) = linkable(folder) else { return Ok(false) };
    // What has the name already is nobody's that we know: a build that was cut off was settled before this.
    match hand.step(&next, || fs::create_dir(&next)) {
        Ok(()) => {}
        Err(error) if error.is_refusal() => return Ok(false),
        Err(error) => return Err(error),
    }
    match prepared(hand, folder, &next, write, remove, &others) {
        Ok(true) => {}
        Ok(false) => return discard(hand, &next).map(|()| false),
        Err(error) if error.is_refusal() => return discard(hand, &next).map(|()| false),
        Err(error) => {
            let _ = discard(hand, &next);
            return Err(error);
        }
    }
    match hand.step(folder, || swap(&next, folder)) {
        Ok(()) => settle(hand, folder).map(|()| true),
        Err(error) if error.is_cut() => Err(error),
        Err(_) => discard(hand, &next).map(|()| false),
    }
}

/// The names of all files in a folder; none where one of them is a folder, or it is itself a link.
fn linkable(folder: &Path) -> Option<Vec<OsString>> {
    if !fs::symlink_metadata(folder).is_ok_and(|metadata| metadata.is_dir()) {
        return None;
    }
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).ok()? {
        let entry = entry.ok()?;
        if entry.file_type().ok()?.is_dir() {
            return None;
        }
        names.push(entry.file_name());
    }
    Some(names)
}

/// Makes the new folder; false where it would not be the user's as the old one is.
fn prepared(
    hand: &mut Hand,
    folder: &Path,
    next: &Path,
    write: &[(&str, &[u8])],
    remove: &[String],
    others: &[OsString],
) -> Result<bool, OutputError> {
    let gone: BTreeSet<&str> = write.iter().map(|(name, _)| *name).chain(remove.iter().map(String::as_str)).collect();
    let is_replaced = |name: &OsString| name.to_str().is_some_and(|name| gone.contains(name) || is_ours(name));
    let others: Vec<&OsString> = others.iter().filter(|name| !is_replaced(name)).collect();
    let linked =
        others.iter().filter_map(|name| Some((name.to_str()?.to_owned(), inode(&folder.join(name))?))).collect();
    let mark = Mark { gone: gone.iter().map(|name| (*name).to_owned()).collect(), linked };
    let mark = serde_json::to_vec(&mark).expect("names and numbers serialize");
    hand.write(&next.join(MARK), &mark)?;
    if !is_alike(folder, next) {
        return Ok(false);
    }
    for (name, bytes) in write {
        hand.write(&next.join(name), bytes)?;
    }
    for name in others {
        hand.step(&folder.join(name), || fs::hard_link(folder.join(name), next.join(name)))?;
    }
    Ok(true)
}

/// Removes a new folder that was never swapped: all in it are copies or links. The mark goes last, so that this can be
/// cut off as well.
fn discard(hand: &mut Hand, next: &Path) -> Result<(), OutputError> {
    give_way(next);
    for entry in fs::read_dir(next).into_iter().flatten().flatten() {
        if entry.file_name() != MARK {
            hand.remove(&entry.path())?;
        }
    }
    hand.remove(&next.join(MARK))?;
    remove_folder(hand, next)
}

/// Ends or takes back a swap that was cut off, wherever that was.
pub(super) fn settle(hand: &mut Hand, folder: &Path) -> Result<(), OutputError> {
    let Some(next) = next(folder) else { return Ok(()) };
    let mark = folder.join(MARK);
    if next.join(MARK).exists() {
        discard(hand, &next)?;
    } else if let Ok(bytes) = stamp::bytes(&mark) {
        // A mark comes with the folder, so it is whole.
        clear_old(hand, folder, &next, &Mark::read(&bytes))?;
    } else if next.exists() {
        // Cut off before the mark: empty. What is not empty is nobody's that we know.
        let _ = fs::remove_dir(&next);
    }
    // Whoever is cut off before this finds the mark without an old folder, and removes it.
    if !next.exists() { hand.remove(&mark) } else { Ok(()) }
}

/// Lets what was made of a set's folder be cleared: it has the rights of that, which somebody may have taken away since.
fn give_way(folder: &Path) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Where that is refused, the clearing tells.
        let _ = fs::set_permissions(folder, fs::Permissions::from_mode(0o700));
    }
    #[cfg(not(unix))]
    let _ = folder;
}

/// Clears the old folder after a swap, and carries over what somebody saved there meanwhile.
fn clear_old(hand: &mut Hand, folder: &Path, old: &Path, mark: &Mark) -> Result<(), OutputError> {
    give_way(old);
    for entry in fs::read_dir(old).into_iter().flatten().flatten() {
        let (from, to) = (entry.path(), folder.join(entry.file_name()));
        let name = entry.file_name();
        let name = name.to_str();
        let replaced = name.is_some_and(|name| mark.gone.contains(name) || is_ours(name));
        if !replaced && mark.was_saved(name, &from, &to) {
            hand.rename(&from, &to)?;
        } else {
            hand.remove(&from)?;
        }
    }
    remove_folder(hand, old)
}

fn remove_folder(hand: &mut Hand, folder: &Path) -> Result<(), OutputError> {
    hand.step(folder, || match fs::remove_dir(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    })
}

/// Whether the first was changed after the second: asked only where the mark does not know the file.
fn is_newer(first: &Path, second: &Path) -> bool {
    let time = |path: &Path| fs::symlink_metadata(path).and_then(|metadata| metadata.modified()).ok();
    time(first) > time(second)
}

#[cfg(target_os = "linux")]
fn swap(first: &Path, second: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, first, CWD, second, RenameFlags::EXCHANGE)?)
}

/// The inode of what has a name; both folders lie on one device.
#[cfg(target_os = "linux")]
fn inode(path: &Path) -> Option<u64> {
    use std::os::unix::fs::MetadataExt;
    fs::symlink_metadata(path).map(|metadata| metadata.ino()).ok()
}

/// Gives the new folder the rights of the old; whether it has the same owner and lies on the same device.
#[cfg(target_os = "linux")]
fn is_alike(old: &Path, new: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (Ok(old), Ok(now)) = (fs::metadata(old), fs::metadata(new)) else { return false };
    let of = |m: &fs::Metadata| (m.uid(), m.gid(), m.dev());
    of(&old) == of(&now) && fs::set_permissions(new, old.permissions()).is_ok()
}

#[cfg(not(target_os = "linux"))]
fn swap(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(not(target_os = "linux"))]
fn inode(_: &Path) -> Option<u64> {
    None
}

#[cfg(not(target_os = "linux"))]
fn is_alike(_: &Path, _: &Path) -> bool {
    false
}
