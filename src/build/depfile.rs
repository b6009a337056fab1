//! What sets were made from, for build systems: a dependency file in Makefile syntax, as Ninja, Make and CMake read it.

use std::fmt::Write;
use std::path::Path;

use super::Outcome;
use super::record::manifest_name;

/// One rule a set: its manifest, written last of all its files, hangs on every file that was read. Files that were
/// looked for and not found are left out, since Make takes a missing one for an error.
#[must_use]
pub fn depfile(outcomes: &[Outcome], out: &Path) -> String {
    let mut text = String::new();
    for outcome in outcomes {
        let manifest = out.join(&outcome.set).join(manifest_name(&outcome.set));
        let _ = write!(text, "{}:", escaped(&manifest));
        for (file, _) in outcome.reads.iter().filter(|(_, key)| key.is_some()) {
            let _ = write!(text, " \\\n  {}", escaped(file));
        }
        text.push('\n');
    }
    text
}

/// A path as the three read it: `/` between folders, blanks and `#` behind a backslash, `$` doubled.
fn escaped(path: &Path) -> String {
    let mut text = String::new();
    for c in super::find::shown(path).chars() {
        match c {
            ' ' | '#' => text.extend(['\\', c]),
            '$' => text.push_str("$$"),
            c => text.push(c),
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
        assert_eq!(text, expected);
    }
}
