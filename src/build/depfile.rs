//! What sets were made from, for build systems: a dependency file in Makefile syntax, as Ninja, Make and CMake read it.

use std::path::Path;

use super::Outcome;
use super::record::manifest_name;

/// One rule a set: its manifest, written last of all its files, hangs on every file that was read. Files that were
/// looked for and not found are left out, since Make takes a missing one for an error.
#[must_use]
pub fn depfile(outcomes: &[Outcome], out: &Path) -> Vec<u8> {
    let mut text = Vec::new();
    for outcome in outcomes {
        let manifest = out.join(&outcome.set).join(manifest_name(&outcome.set));
        text.extend(escaped(&manifest));
        text.push(b':');
        for (file, _) in outcome.reads.iter().filter(|(_, key)| key.is_some()) {
            text.extend(b" \\\n  ");
            text.extend(escaped(file));
        }
        text.push(b'\n');
    }
    text
}

/// A path as the three read it: `/` between folders, blanks and `#` behind a backslash, `$` doubled; the bytes of its
/// names as the system has them, which need not be UTF-8.
fn escaped(path: &Path) -> Vec<u8> {
    let mut text = Vec::new();
    for &byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b' ' | b'#' => text.extend([b'\\', byte]),
            b'$' => text.extend(b"$$"),
            b'\\' if cfg!(windows) => text.push(b'/'),
            byte => text.push(byte),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::PathBuf;

    use super::super::Outcome;
    use super::*;
    use crate::base::Key;

    #[test]
    fn every_file_that_was_there_is_named_and_escaped() {
        let key = Some(Key::of_bytes(b""));
        let reads: BTreeMap<PathBuf, Option<Key>> =
            [("presets/a b.ron", key), ("presets/gone.ron", None), ("presets/x$#.csv", key)]
                .into_iter()
                .map(|(path, key)| (path.into(), key))
                .collect();
        let outcome = Outcome::current("oak".into(), 1, reads);
        let text = depfile(&[outcome], Path::new("out dir"));
        let expected = "out\\ dir/oak/oak.manifest.json: \\\n  presets/a\\ b.ron \\\n  presets/x$$\\#.csv\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }

    #[cfg(unix)]
    #[test]
    fn a_name_that_is_no_utf_8_is_that_of_the_file() {
        use std::os::unix::ffi::OsStrExt;
        let path = PathBuf::from(std::ffi::OsStr::from_bytes(b"tr\xffes/a.ron"));
        let reads = BTreeMap::from([(path, Some(Key::of_bytes(b"")))]);
        let text = depfile(&[Outcome::current("a".into(), 1, reads)], Path::new("out"));
        assert_eq!(text, b"out/a/a.manifest.json: \\\n  tr\xffes/a.ron\n");
    }
}
