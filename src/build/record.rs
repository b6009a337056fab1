//! What the last build left in a set's folder: its key and the files it owns, read back from the manifest.

use std::fs;
use std::path::Path;

use rayon::prelude::*;
use serde::Deserialize;

use super::output::Owned;
use crate::base::Key;

/// Who a manifest says it is by.
pub(super) const GENERATOR: &str = "treewright";

/// The part of a manifest that the next build needs.
#[derive(Debug, Deserialize)]
pub(super) struct Record {
    generator: String,
    /// Key of the set, hexadecimal.
    pub(super) key: String,
    files: Vec<FileRecord>,
    #[serde(skip)]
    manifest: Option<(String, Key)>,
}

#[derive(Debug, Deserialize)]
struct FileRecord {
    file: String,
    blake3: String,
}

/// Name of a set's manifest.
pub(super) fn manifest_name(set: &str) -> String {
    format!("{set}.manifest.json")
}

/// Reads a set's record; none where there is none or it can't be read, which means that nothing there is Treewright's.
pub(super) fn read(folder: &Path, set: &str) -> Option<Record> {
    let name = manifest_name(set);
    let bytes = fs::read(folder.join(&name)).ok()?;
    let mut record: Record = serde_json::from_slice(&bytes).ok()?;
    if record.generator != GENERATOR {
        return None;
    }
    record.manifest = Some((name, Key::of_bytes(&bytes)));
    Some(record)
}

impl Record {
    /// The files of the set with their hashes, the manifest among them.
    pub(super) fn owned(&self) -> Owned {
        let listed = self.files.iter().filter_map(|f| Some((f.file.clone(), Key::from_hex(&f.blake3)?)));
        listed.chain(self.manifest.clone()).collect()
    }

    /// The files that are not there with their hash; also those whose hash the record does not tell.
    pub(super) fn damaged(&self, folder: &Path) -> Vec<String> {
        let owned = self.owned();
        let is_whole = |name: &str| {
            let key = owned.get(name);
            key.is_some_and(|key| fs::read(folder.join(name)).is_ok_and(|bytes| Key::of_bytes(&bytes) == *key))
        };
        self.files.par_iter().map(|file| &file.file).filter(|name| !is_whole(name)).cloned().collect()
    }
}
