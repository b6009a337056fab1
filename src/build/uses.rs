//! Sets that are made of each other's files: each build of one would change what the other reads, for ever.
//!
//! A preset may read files of a set, as a tree to start from. What every preset of a [`Builder`](super::Builder) reads of
//! which set is remembered from build to build, since a watcher builds one preset at a time; a preset that comes back to
//! itself that way is refused. What a set's manifest lists is the set's; other files in its folder are anybody's.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::{Loaded, pipeline, record};
use crate::base::{Diagnostic, Key};

/// What one preset reads of sets.
#[derive(Debug)]
struct Uses {
    preset: PathBuf,
    key: Option<Key>,
    /// By set: one of the files.
    sets: BTreeMap<String, PathBuf>,
}

/// What all presets that were built read of sets, by the names of their own.
#[derive(Debug, Default)]
pub(super) struct Known(Mutex<BTreeMap<String, Uses>>);

impl Known {
    /// Remembers what a preset reads of the sets in `out`.
    ///
    /// # Errors
    ///
    /// When it reads its own set, or one that is made from its own.
    pub(super) fn add(&self, out: &Path, preset: &Path, loaded: &Loaded) -> Result<(), Vec<Diagnostic>> {
        let name = &loaded.plan.name;
        let reads = loaded.world.reads();
        let fields: BTreeMap<PathBuf, String> = pipeline::files_of(&loaded.plan)
            .into_iter()
            .map(|(file, field)| (loaded.world.path(&file), field))
            .collect();
        let mut sets = BTreeMap::new();
        for path in reads.iter().filter(|(_, key)| key.is_some()).map(|(path, _)| path) {
            if let Some(set) = set_of(out, path)
                && (fields.contains_key(path) || !sets.contains_key(&set))
            {
                sets.insert(set, path.clone());
            }
        }
        let key = reads.get(preset).copied().flatten();
        let mut all = self.0.lock().expect("nobody panics while the lock is held");
        all.insert(name.clone(), Uses { preset: preset.to_path_buf(), key, sets });
        let Some(way) = way_back(&all, name) else { return Ok(()) };
        let file = &all[name].sets[&way[0]];
        let message = if way[0] == *name {
            format!("{} is written by this preset, so every build would call for another", super::find::shown(file))
        } else {
            let way = way.join("`, that of `");
            let file = super::find::shown(file);
            format!("{file} belongs to the set `{way}`, which is this preset's: every build would call for another")
        };
        let error = Diagnostic::new("", message).with_field(fields.get(file).cloned().unwrap_or_default());
        Err(vec![error.with_hint("copy the file out of the folder of sets, and name the copy")])
    }

    /// The presets on the way from a set back to it: a change of one of them may mend it.
    pub(super) fn presets(&self, set: &str) -> BTreeMap<PathBuf, Option<Key>> {
        let all = self.0.lock().expect("nobody panics while the lock is held");
        let way = way_back(&all, set).unwrap_or_default();
        way.iter().filter_map(|set| all.get(set)).map(|uses| (uses.preset.clone(), uses.key)).collect()
    }
}

/// The set in `out` that wrote a file.
fn set_of(out: &Path, path: &Path) -> Option<String> {
    let real = path.canonicalize().ok()?;
    let (folder, file) = (real.parent()?, real.file_name()?.to_str()?);
    let set = folder.file_name()?.to_str()?;
    let is_below = folder.parent() == Some(&out.canonicalize().ok()?);
    (is_below && record::read(folder, set)?.owned().contains_key(file)).then(|| set.to_owned())
}

/// The sets by which one is made from itself, it the last; the shortest way.
fn way_back(all: &BTreeMap<String, Uses>, name: &str) -> Option<Vec<String>> {
    let mut ways: Vec<Vec<String>> = vec![Vec::new()];
    let mut seen = BTreeSet::new();
    while !ways.is_empty() {
        let mut longer = Vec::new();
        for way in ways {
            let last = way.last().map_or(name, String::as_str);
            // A preset that is gone makes no set any more.
            let Some(uses) = all.get(last).filter(|uses| uses.preset.exists()) else { continue };
            for set in uses.sets.keys() {
                let next = [way.as_slice(), std::slice::from_ref(set)].concat();
                if set == name {
                    return Some(next);
                }
                if seen.insert(set.clone()) {
                    longer.push(next);
                }
            }
        }
        ways = longer;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_back_is_found_however_long_and_none_where_a_preset_is_gone() {
        let folder = tempfile::tempdir().unwrap();
        let preset = folder.path().join("preset.ron");
        std::fs::write(&preset, "").unwrap();
        let uses = |sets: &[&str]| Uses {
            preset: preset.clone(),
            key: None,
            sets: sets.iter().map(|set| ((*set).to_owned(), PathBuf::new())).collect(),
        };
        let of = |list: &[(&str, &[&str])]| -> BTreeMap<String, Uses> {
            list.iter().map(|(name, sets)| ((*name).to_owned(), uses(sets))).collect()
        };
        let mut all = of(&[("a", &["b", "x"]), ("b", &["c", "b"]), ("c", &["a"]), ("d", &["a"]), ("e", &["e"])]);
        let back = |all: &BTreeMap<String, Uses>, name: &str| way_back(all, name).map(|way| way.concat());
        assert_eq!(
            ["a", "b", "c", "d", "e", "x"].map(|name| back(&all, name).unwrap_or_default()),
            ["bca", "b", "abc", "", "e", ""]
        );
        all.get_mut("c").unwrap().preset = folder.path().join("gone.ron");
        assert_eq!(back(&all, "a"), None);
    }
}
