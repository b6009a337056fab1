//! Results handed from one command to the next as files of their own, where no folder is shared: a farm, Bazel, Ninja
//! with a remote executor. A part holds entries by key, in order of key, so that equal results are equal files.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::Mutex;

use crate::base::Key;

const MAGIC: [u8; 8] = *b"twparts1";
/// Largest part that is read, bytes.
const MOST_BYTES: u64 = 4 << 30;

/// A file is no part.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {why}")]
pub struct PartError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub why: String,
}

/// What was given, and what was made beside it.
#[derive(Debug, Default)]
pub(super) struct Parts {
    given: BTreeMap<Key, Vec<u8>>,
    made: Mutex<BTreeMap<Key, Vec<u8>>>,
}

impl Parts {
    pub(super) fn read(files: &[PathBuf]) -> Result<Self, PartError> {
        let mut given = BTreeMap::new();
        for path in files {
            let wrong = |why: &str| PartError { path: path.clone(), why: why.to_owned() };
            let there = fs::metadata(path).map_err(|e| wrong(&e.to_string()))?;
            if !there.is_file() {
                return Err(wrong("it is no file"));
            }
            if there.len() > MOST_BYTES {
                return Err(wrong("it is larger than any part"));
            }
            let bytes = fs::read(path).map_err(|e| wrong(&e.to_string()))?;
            let why = "it is no part, or not a whole one: run the command that makes it again";
            entries(&bytes, &mut given).ok_or_else(|| wrong(why))?;
        }
        Ok(Self { given, made: Mutex::default() })
    }

    pub(super) fn given(&self, key: Key) -> Option<&[u8]> {
        self.given.get(&key).map(Vec::as_slice)
    }

    pub(super) fn add(&self, key: Key, bytes: Vec<u8>) {
        self.made.lock().unwrap_or_else(std::sync::PoisonError::into_inner).insert(key, bytes);
    }

    /// What was made, as a file: magic, hash of the rest, then key, length and bytes of each entry.
    pub(super) fn made(&self) -> Vec<u8> {
        let made = self.made.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut rest = Vec::new();
        for (key, bytes) in &*made {
            rest.extend(key.bytes());
            rest.extend((bytes.len() as u64).to_le_bytes());
            rest.extend(bytes);
        }
        let mut file = MAGIC.to_vec();
        file.extend(Key::of_bytes(&rest).bytes());
        file.extend(rest);
        file
    }
}

fn entries(bytes: &[u8], all: &mut BTreeMap<Key, Vec<u8>>) -> Option<()> {
    let (hash, mut rest) = bytes.strip_prefix(&MAGIC)?.split_first_chunk::<32>()?;
    if *hash != Key::of_bytes(rest).bytes() {
        return None;
    }
    while let Some((key, after)) = rest.split_first_chunk::<32>() {
        let (length, after) = after.split_first_chunk::<8>()?;
        let (entry, after) = after.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
        all.insert(Key::of(*key), entry.to_vec());
        rest = after;
    }
    rest.is_empty().then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_made_is_given_to_the_next_and_broken_files_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.part");
        let parts = Parts::default();
        let keys = [Key::of_bytes(b"a"), Key::of_bytes(b"b")];
        parts.add(keys[0], vec![1, 2, 3]);
        parts.add(keys[1], Vec::new());
        let whole = parts.made();
        fs::write(&path, &whole).unwrap();
        let next = Parts::read(std::slice::from_ref(&path)).unwrap();
        assert_eq!((next.given(keys[0]), next.given(keys[1])), (Some(&[1, 2, 3][..]), Some(&[][..])));
        assert_eq!(next.given(Key::of_bytes(b"c")), None);
        let mut changed = whole.clone();
        changed[60] ^= 1;
        for broken in [&changed[..], &whole[..whole.len() - 1], &whole[..20], b"", b"no part at all"] {
            fs::write(&path, broken).unwrap();
            let error = Parts::read(std::slice::from_ref(&path)).unwrap_err();
            assert!(error.to_string().contains("a.part"), "{error}");
        }
        assert!(Parts::read(&[folder.path().join("gone")]).is_err());
    }
}
