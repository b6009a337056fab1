//! Looking at files, where the system does not tell of changes: their stamps, read every so often.
//!
//! Only files that a build read, or looked for, and the presets are looked at, not whole folders; some hundred files take
//! about a millisecond. Links are looked at as such, too: another one may lead elsewhere. A file that is changed twice within one tick of the file system's clock, and read in between, is
//! not seen the second time.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::build::stamp::Stamp;

/// How files looked.
#[derive(Debug, Default)]
pub(super) struct Seen {
    stamps: BTreeMap<PathBuf, Look>,
}

/// A file's stamp, and that of the link in its place.
type Look = (Option<Stamp>, Option<Stamp>);

fn look_at(path: &Path) -> Look {
    let link = std::fs::symlink_metadata(path).ok().filter(std::fs::Metadata::is_symlink);
    (Stamp::at(path), link.as_ref().and_then(Stamp::of))
}

impl Seen {
    /// Looks at `files`; those that changed, came or went since the last time, and those that it never looked at, as a new
    /// preset.
    pub(super) fn look<'a>(&mut self, files: impl IntoIterator<Item = &'a PathBuf>) -> BTreeSet<PathBuf> {
        let new: BTreeMap<PathBuf, Look> = files.into_iter().map(|path| (path.clone(), look_at(path))).collect();
        let differs = |path: &&PathBuf| self.stamps.get(*path) != new.get(*path);
        let changed = new.keys().chain(self.stamps.keys()).filter(differs).cloned().collect();
        self.stamps = new;
        changed
    }

    /// Looks at a file that was just read, so that the next look finds nothing new; whether it never looked at it.
    pub(super) fn meet(&mut self, file: &Path) -> bool {
        let is_new = !self.stamps.contains_key(file);
        if is_new {
            self.stamps.insert(file.to_path_buf(), look_at(file));
        }
        is_new
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn files_that_change_come_and_go_are_seen_once() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        fs::write(&a, "one").unwrap();
        let both = [a.clone(), b.clone()];
        let set = |paths: &[&PathBuf]| paths.iter().map(|path| (*path).clone()).collect::<BTreeSet<_>>();
        let mut seen = Seen::default();
        assert!(seen.meet(&a) && !seen.meet(&a));
        assert_eq!(seen.look(&both), set(&[&b]));
        assert_eq!(seen.look(&both), set(&[]));
        fs::write(&a, "other").unwrap();
        fs::write(&b, "new").unwrap();
        assert_eq!(seen.look(&both), set(&[&a, &b]));
        fs::remove_file(&b).unwrap();
        assert_eq!((seen.look(&both), seen.look([&a])), (set(&[&b]), set(&[&b])));
    }
}
