//! What the last build left in a set's folder: its key and the files it owns, read back from the manifest.

use std::fs;
use std::path::Path;

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

    /// Whether every file is there with its hash.
    pub(super) fn is_whole(&self, folder: &Path) -> bool {
        let owned = self.owned();
        owned.len() == self.files.len() + 1
            && owned.iter().all(|(name, key)| fs::read(folder.join(name)).is_ok_and(|b| Key::of_bytes(&b) == *key))
    }
}
