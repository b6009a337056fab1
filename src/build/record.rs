//! What the last build left in a set's folder: its key and the files it owns, read back from the manifest.

use std::collections::BTreeSet;
use std::path::Path;

use rayon::iter::Either;
use rayon::prelude::*;
use serde::Deserialize;

use super::output::{Owned, Stamps, is_plain};
use super::stamp::{self, Stamp};
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
    let bytes = stamp::bytes(&folder.join(&name)).ok()?;
    let mut record: Record = serde_json::from_slice(&bytes).ok()?;
    if record.generator != GENERATOR {
        return None;
    }
    record.manifest = Some((name, Key::of_bytes(&bytes)));
    Some(record)
}

/// The files that the next build may write over. Where the manifest is there and can't be read any more, as after a merge of a
/// version control or a copy that was cut off, it is one that somebody changed, and of the others it is those whose hash it still
/// tells.
pub(super) fn owned(folder: &Path, set: &str) -> Owned {
    if let Some(record) = read(folder, set) {
        return record.owned();
    }
    let Some(bytes) = broken(folder, set) else { return Owned::new() };
    let text = String::from_utf8_lossy(&bytes);
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let told = names.filter(|name| text.contains(&format!("\"{name}\"")));
    let still = told.filter_map(|name| {
        let key = Key::of_bytes(&stamp::bytes(&folder.join(&name)).ok()?);
        text.contains(&key.to_hex()).then_some((name, key))
    });
    still.chain([(manifest_name(set), Key::of_bytes(b""))]).collect()
}

/// Whether what has the manifest's name was Treewright's and can't be read any more.
pub(super) fn is_broken(folder: &Path, set: &str) -> bool {
    broken(folder, set).is_some()
}

/// The bytes of a manifest that can't be read any more: empty, cut off in its first line, or with the mark in it that Treewright
/// wrote it. What another program wrote under that name is none.
fn broken(folder: &Path, set: &str) -> Option<Vec<u8>> {
    let path = folder.join(manifest_name(set));
    if !std::fs::symlink_metadata(&path).is_ok_and(|there| there.is_file()) {
        return None;
    }
    let bytes = stamp::bytes(&path).ok()?;
    let mark = format!("\"generator\": \"{GENERATOR}\"");
    let is_marked = || bytes.windows(mark.len()).any(|part| part == mark.as_bytes());
    let is_start = || format!("{{\n  {mark}").as_bytes().starts_with(&bytes);
    let is_ours = match serde_json::from_slice::<serde_json::Value>(&bytes) {
        Ok(value) => value["generator"] == GENERATOR,
        Err(_) => is_start() || is_marked(),
    };
    (is_ours && serde_json::from_slice::<Record>(&bytes).is_err()).then_some(bytes)
}

impl Record {
    /// The files of the set with their hashes, the manifest among them.
    pub(super) fn owned(&self) -> Owned {
        // Whoever may write into the folder may have written the manifest: it names nothing elsewhere.
        let plain = self.files.iter().filter(|f| is_plain(&f.file));
        let listed = plain.filter_map(|f| Some((f.file.clone(), Key::from_hex(&f.blake3)?)));
        listed.chain(self.manifest.clone()).collect()
    }

    /// The files that are not there with their hash; also those whose hash the record does not tell.
    pub(super) fn damaged(&self, folder: &Path) -> Vec<String> {
        self.compared(folder, &Stamps::new()).err().unwrap_or_default()
    }

    /// Every file of the set with stamp and hash, those that have a stamp as far as they were compared already; or the
    /// files that are not as the record tells.
    pub(super) fn compared(&self, folder: &Path, known: &Stamps) -> Result<Vec<Compared>, Vec<String>> {
        let owned = self.owned();
        let names: BTreeSet<&String> = self.files.iter().map(|file| &file.file).chain(owned.keys()).collect();
        let compare = |name: &&String| {
            let name = name.as_str();
            let key = *owned.get(name).ok_or_else(|| name.to_owned())?;
            if let Some(stamp) = known.get(name) {
                return Ok((name.to_owned(), Some(*stamp), key));
            }
            match stamp::read_at(&folder.join(name)) {
                Ok((bytes, stamp)) if Key::of_bytes(&bytes) == key => Ok((name.to_owned(), stamp, key)),
                _ => Err(name.to_owned()),
            }
        };
        let (good, bad): (Vec<_>, Vec<_>) = names.par_iter().map(compare).partition_map(|found| match found {
            Ok(good) => Either::Left(good),
            Err(bad) => Either::Right(bad),
        });
        if bad.is_empty() { Ok(good) } else { Err(bad) }
    }
}

/// A file's name, stamp where it did not change meanwhile, and hash.
pub(super) type Compared = (String, Option<Stamp>, Key);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_that_is_none_any_more_may_be_written_over_and_nobody_elses() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.manifest.json");
        assert!(!is_broken(folder.path(), "a") && owned(folder.path(), "a").is_empty());
        std::fs::write(folder.path().join("a.glb"), "old").unwrap();
        std::fs::write(folder.path().join("b.glb"), "edited").unwrap();
        let of = |name: &str| format!("{{\"file\": \"{name}\", \"blake3\": \"{}\"}}", Key::of_bytes(b"old").to_hex());
        let whole = format!(
            "{{\n  \"generator\": \"{GENERATOR}\",\n  \"key\": \"00\",\n  \"files\": [{}, {}]\n}}",
            of("a.glb"),
            of("b.glb")
        );
        let conflict = whole.replace(
            "  \"key\": \"00\",\n",
            "<<<<<<< HEAD\n  \"key\": \"00\",\n=======\n  \"key\": \"01\",\n>>>>>>> b\n",
        );
        let merged = whole.replace("  \"key\": \"00\",\n", "  \"key\": \"00\",\n  \"key\": \"01\",\n");
        let less = format!("{{\"generator\": \"{GENERATOR}\"}}");
        for (text, broken) in [
            ("", true),
            (&whole[..9], true),
            (&whole[..50], true),
            (&conflict, true),
            (&merged, true),
            (&less, true),
            (&whole, false),
            ("{\"generator\": \"another tool\"}", false),
            ("// no JSON\n{\"generator\": \"another tool\"}", false),
            ("a list of mine", false),
            ("[]", false),
        ] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(is_broken(folder.path(), "a"), broken, "{text}");
            assert_eq!(owned(folder.path(), "a").contains_key("a.manifest.json"), broken || text == whole, "{text}");
        }
        // Of the others those that are as it tells.
        std::fs::write(&path, conflict).unwrap();
        assert_eq!(owned(folder.path(), "a").into_keys().collect::<Vec<_>>(), ["a.glb", "a.manifest.json"]);
    }

    #[test]
    fn a_manifest_owns_nothing_outside_of_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let hash = Key::of_bytes(b"x").to_hex();
        let file = |name: &str| format!("{{\"file\": \"{name}\", \"blake3\": \"{hash}\"}}");
        let names = ["a.glb", "../a.glb", "/dev/zero", "b/a.glb", "..", ""].map(file).join(",");
        let text = format!("{{\"generator\": \"{GENERATOR}\", \"key\": \"{hash}\", \"files\": [{names}]}}");
        std::fs::write(folder.path().join("a.manifest.json"), text).unwrap();
        let record = read(folder.path(), "a").unwrap();
        assert_eq!(record.owned().into_keys().collect::<Vec<_>>(), ["a.glb", "a.manifest.json"]);
        // What is owned elsewhere counts as changed by somebody.
        assert_eq!(record.damaged(folder.path()).len(), 6);
    }
}
