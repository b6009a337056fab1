//! What stages made, kept by what it was made from, so that a build makes only what changed.
//!
//! Two tiers: the memory of this process (a watcher's, mostly), and a folder that the user names and that builds, shards
//! and machines may share ([`store`]). A key is the stage, its version, its own parameters and the keys of its inputs;
//! where an input is itself made by a stage, its *content* is the key, so that an edit which leaves a stage's output as
//! it was goes no further. A hit or a miss never changes a byte. An entry that was damaged is made again, and told.

mod parts;
mod recent;
mod store;

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::Limits;
use crate::base::{Diagnostic, Key, KeyBuilder, Note};
pub use parts::PartError;
use parts::Parts;
use recent::Recent;
pub use store::{CacheError, CacheStats, clear, stats};
use store::{Found, Store};

/// Raised whenever a type that is kept changes its layout, so that old entries are not read as something else; a test
/// below notices. (What a stage makes of the same input is the stage's own version.)
const LAYOUT: u32 = 7;

/// Where results are kept between processes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CacheOptions {
    /// The folder; it is made when it is not there. Only files that Treewright wrote are ever removed from it.
    pub folder: PathBuf,
    /// Most bytes that it may hold after a build; what was used longest ago goes first.
    pub limit: u64,
}

impl CacheOptions {
    /// Bytes that a cache may hold unless it is told otherwise: 4 GiB.
    pub const LIMIT: u64 = 4 << 30;
}

/// A value that the cache keeps.
pub(super) trait Entry: Serialize + DeserializeOwned + Send + Sync + 'static {
    /// About how many bytes it takes in memory.
    fn weight(&self) -> usize;

    /// Whether later stages can trust it. Entries come from a folder that anybody may write to.
    fn is_sound(&self) -> bool;
}

impl Entry for Vec<u8> {
    fn weight(&self) -> usize {
        self.len()
    }

    fn is_sound(&self) -> bool {
        true
    }
}

/// What stages made, by key.
#[derive(Debug)]
pub struct Cache {
    /// Largest sum of what is kept in memory, bytes.
    most: usize,
    memory: Mutex<Recent>,
    store: Option<Store>,
    parts: Option<Parts>,
    notes: Mutex<Vec<Note>>,
}

/// Name and number of a stage; the number is raised whenever its output changes for the same parameters and inputs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage(pub(super) &'static str, pub(super) u32);

impl Stage {
    /// Starts the key of something that the stage makes.
    pub(super) fn key(self) -> KeyBuilder {
        Key::stage(self.0, self.1).number(u64::from(LAYOUT))
    }
}

impl Default for Cache {
    fn default() -> Self {
        Self {
            most: Limits::default().memory,
            memory: Mutex::default(),
            store: None,
            parts: None,
            notes: Mutex::default(),
        }
    }
}

impl Cache {
    /// A cache that keeps no more than `most` bytes in memory.
    pub(super) fn within(self, most: usize) -> Self {
        Self { most, ..self }
    }

    /// A cache with nothing in memory, and what is in a folder where one is given.
    #[must_use]
    pub fn new(options: Option<&CacheOptions>) -> Self {
        Self { store: options.map(Store::new), ..Self::default() }
    }

    /// A cache of what some part files hold, which remembers what is made beside it for [`part`](Self::part).
    ///
    /// # Errors
    ///
    /// The first file that is no whole part.
    pub(super) fn of_parts(files: &[PathBuf]) -> Result<Self, PartError> {
        Ok(Self { parts: Some(Parts::read(files)?), ..Self::default() })
    }

    /// A part file of everything that was made and not given.
    pub(super) fn part(&self) -> Vec<u8> {
        self.parts.as_ref().map(Parts::made).unwrap_or_default()
    }

    /// The value of a key: from memory, from the folder, or made. Two threads may make the same one; both get equal
    /// values.
    pub(super) fn remember<T: Entry>(
        &self,
        stage: Stage,
        key: Key,
        make: impl FnOnce() -> Result<T, Vec<Diagnostic>>,
    ) -> Result<Arc<T>, Vec<Diagnostic>> {
        if let Some(value) = self.recent(key) {
            return Ok(value);
        }
        if let Some(value) = self.stored::<T>(stage, key) {
            return Ok(self.keep(key, value));
        }
        let value = make()?;
        // Plain data always serializes; without an entry the next build makes it again.
        if (self.store.is_some() || self.parts.is_some())
            && let Ok(bytes) = postcard::to_stdvec(&value)
        {
            if let Some(store) = &self.store
                && let Err(error) = store.put(stage.0, key, &bytes)
                && store.gives_up()
            {
                self.note(format!("{error}; nothing more is written to it"));
            }
            if let Some(parts) = &self.parts {
                parts.add(key, bytes);
            }
        }
        Ok(self.keep(key, value))
    }

    /// As [`remember`](Self::remember), for what is cheaper to make than to read: kept in memory only. `weight` in bytes.
    pub(super) fn remember_here<T: Send + Sync + 'static>(
        &self,
        key: Key,
        weight: impl FnOnce(&T) -> usize,
        make: impl FnOnce() -> Result<T, Vec<Diagnostic>>,
    ) -> Result<Arc<T>, Vec<Diagnostic>> {
        if let Some(value) = self.recent(key) {
            return Ok(value);
        }
        let value = make()?;
        let weight = weight(&value);
        let value = Arc::new(value);
        self.memory().insert(key, value.clone(), weight, self.most);
        Ok(value)
    }

    /// What has to be told since it was asked last: damaged entries, a folder that can't be written.
    pub(super) fn take_notes(&self) -> Vec<Note> {
        std::mem::take(&mut *self.notes.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }

    /// Removes what was used longest ago, where the folder holds more than it may.
    pub(super) fn trim(&self) {
        if let Some(Err(error)) = self.store.as_ref().map(Store::trim) {
            self.note(error.to_string());
        }
    }

    fn recent<T: Send + Sync + 'static>(&self, key: Key) -> Option<Arc<T>> {
        self.memory().get(key)?.downcast().ok()
    }

    fn keep<T: Entry>(&self, key: Key, value: T) -> Arc<T> {
        let (weight, value) = (value.weight(), Arc::new(value));
        self.memory().insert(key, value.clone(), weight, self.most);
        value
    }

    fn stored<T: Entry>(&self, stage: Stage, key: Key) -> Option<T> {
        if let Some(bytes) = self.parts.as_ref().and_then(|parts| parts.given(key))
            && let Ok((value, [])) = postcard::take_from_bytes::<T>(bytes)
            && value.is_sound()
        {
            return Some(value);
        }
        let store = self.store.as_ref()?;
        let broken = match store.get(stage.0, key) {
            Found::Missing => return None,
            Found::Whole(bytes) => match postcard::take_from_bytes::<T>(&bytes) {
                Ok((value, [])) if value.is_sound() => return Some(value),
                _ => store.path(stage.0, key),
            },
            Found::Broken(path) => path,
        };
        self.note(format!("the entry {} was damaged; it is made again", broken.display()));
        None
    }

    fn memory(&self) -> std::sync::MutexGuard<'_, Recent> {
        self.memory.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn note(&self, message: String) {
        let note = Note::new("cache", message);
        self.notes.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(note);
    }
}

#[cfg(test)]
mod tests;
