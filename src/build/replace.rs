//! Single files that readers see whole, the old or the new, whenever they look and whenever a writer is killed.

use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

use super::output::Turn;

/// For how long nobody writes at a file: what is older was left by somebody who was killed.
pub(super) const LEFT: Duration = Duration::from_hours(1);

/// Replaces a file, whose permissions stay, or writes a new one; not where it holds these bytes. What was left beside it by
/// somebody who was killed is removed, after an hour.
///
/// # Errors
///
/// When the folder can't be written. The file is as it was then.
#[cfg(any(feature = "cli", feature = "preview", test))]
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace_after(LEFT, path, bytes)
}

/// As [`replace`], of a file that is only written by who has the turn. What was left beside it is removed at once: nobody
/// else is writing.
///
/// # Errors
///
/// When the folder can't be written. The file is as it was then.
pub(super) fn replace_in(turn: &Turn, path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace_after(if turn.is_alone() { Duration::ZERO } else { LEFT }, path, bytes)
}

fn replace_after(left: Duration, path: &Path, bytes: &[u8]) -> io::Result<()> {
    // A pipe or device, `/dev/stdout` say, holds nothing to be replaced.
    if fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        return fs::write(path, bytes);
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if fs::read(path).is_ok_and(|old| old == bytes) {
        sweep(path, &name, left);
        return Ok(());
    }
    if super::output::is_read_only(path) {
        let why = "it is read-only; check it out (`p4 edit`) or make it writable";
        return Err(io::Error::new(io::ErrorKind::ReadOnlyFilesystem, why));
    }
    let beside = path.with_file_name(format!("{}{}{END}", start(&name), chance()));
    let file = fs::File::create_new(&beside)?;
    let write = |mut file: fs::File| {
        file.write_all(bytes)?;
        file.sync_all()?;
        if let Ok(old) = fs::metadata(path) {
            file.set_permissions(old.permissions())?;
        }
        fs::rename(&beside, path)
    };
    write(file).inspect_err(|_| drop(fs::remove_file(&beside)))?;
    sweep(path, &name, left);
    Ok(())
}

/// A number that no other writer has: machines and containers that share a folder share process numbers. It names files that are
/// renamed or removed, and decides nothing of what is built.
pub(super) fn chance() -> u64 {
    use std::hash::{BuildHasher, RandomState};
    RandomState::new().hash_one(std::process::id())
}

/// How what is written beside a file is named: the start, a number that no other writer has, the end.
fn start(name: &str) -> String {
    format!(".{name}.")
}
const END: &str = ".new";

/// Removes what was left beside a file that was just written, `left` before it or earlier. Times are those of the file
/// system: no clock is asked.
fn sweep(path: &Path, name: &str, left: Duration) {
    let time = |path: &Path| fs::symlink_metadata(path).and_then(|m| m.modified()).ok();
    let (Some(now), Some(folder), start) = (time(path), path.parent(), start(name)) else { return };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let found = entry.file_name();
        let number = found.to_str().and_then(|found| found.strip_prefix(&start)?.strip_suffix(END));
        let is_ours = number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
        let age = |then| now.duration_since(then).unwrap_or_default();
        if is_ours && time(&entry.path()).is_some_and(|then| age(then) >= left) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_what_a_killed_writer_left_goes_after_an_hour() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        replace(&at("page.html"), b"old").unwrap();
        let long_ago = fs::metadata(at("page.html")).unwrap().modified().unwrap() - LEFT * 2;
        for (name, is_old) in [
            (".page.html.12.new", true),
            (".page.html.13.new", false),
            (".page.html.mine.new", true),
            ("page.html.12.new", true),
            (".other.html.12.new", true),
        ] {
            let file = fs::File::create_new(at(name)).unwrap();
            if is_old {
                file.set_modified(long_ago).unwrap();
            }
        }
        replace(&at("page.html"), b"new").unwrap();
        assert_eq!(fs::read(at("page.html")).unwrap(), b"new");
        assert!(!at(".page.html.12.new").exists());
        let left = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, 5, "a writer at work, and files of others, stay");
        let turn = Turn::take(folder.path(), || {}).unwrap();
        replace_in(&turn, &at("page.html"), b"newer").unwrap();
        assert!(!at(".page.html.13.new").exists(), "who has the turn is the only writer");
        let left = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, 5, "the lock came, and files of others stay");
        assert!(replace(&at("none/page.html"), b"new").is_err());
        let mut rights = fs::metadata(at("page.html")).unwrap().permissions();
        rights.set_readonly(true);
        fs::set_permissions(at("page.html"), rights).unwrap();
        assert!(replace(&at("page.html"), b"newer").is_ok(), "it holds that already");
        assert!(replace(&at("page.html"), b"newest").is_err_and(|error| error.to_string().contains("read-only")));
        assert_eq!(fs::read(at("page.html")).unwrap(), b"newer");
    }
}
