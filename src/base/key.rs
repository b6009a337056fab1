//! Content keys: what a stage's output depends on, as one blake3 hash.
//!
//! A key is stage name, stage version, the stage's own parameters and the keys of its inputs (DESIGN.md, "Only what
//! changed"). Hashes decide what is rebuilt; clocks never do.

use std::fmt;

use serde::Serialize;

/// A 256-bit content hash.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key([u8; 32]);

impl Key {
    /// The key of some bytes.
    #[must_use]
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Starts the key of a stage's output.
    #[must_use]
    pub fn stage(name: &str, version: u32) -> KeyBuilder {
        let mut hasher = blake3::Hasher::new();
        frame(&mut hasher, name.as_bytes());
        hasher.update(&version.to_le_bytes());
        KeyBuilder { hasher }
    }

    /// The key that [`to_hex`](Self::to_hex) wrote.
    #[must_use]
    pub fn from_hex(text: &str) -> Option<Self> {
        blake3::Hash::from_hex(text).ok().map(|hash| Self(*hash.as_bytes()))
    }

    /// The key that [`bytes`](Self::bytes) gave.
    #[must_use]
    pub const fn of(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// The key's bytes.
    #[must_use]
    pub const fn bytes(self) -> [u8; 32] {
        self.0
    }

    /// The key as 64 hexadecimal digits.
    #[must_use]
    pub fn to_hex(self) -> String {
        blake3::Hash::from_bytes(self.0).to_hex().to_string()
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.to_hex()[..16])
    }
}

/// Collects what a [`Key`] depends on.
#[derive(Clone, Debug)]
pub struct KeyBuilder {
    hasher: blake3::Hasher,
}

impl KeyBuilder {
    /// Adds parameters by their serialized form.
    #[must_use]
    pub fn params(mut self, params: &impl Serialize) -> Self {
        // JSON of plain structs: field order is the declaration's, floats print shortest-exact, so equal values
        // give equal text. Resolved parameters hold no NaN and no map with non-text keys, so this cannot fail.
        let text = serde_json::to_vec(params).expect("resolved parameters serialize");
        frame(&mut self.hasher, &text);
        self
    }

    /// Adds the key of an input.
    #[must_use]
    pub fn input(mut self, key: Key) -> Self {
        self.hasher.update(&key.0);
        self
    }

    /// Adds a seed or another plain number.
    #[must_use]
    pub fn number(mut self, value: u64) -> Self {
        self.hasher.update(&value.to_le_bytes());
        self
    }

    /// The finished key.
    #[must_use]
    pub fn finish(self) -> Key {
        Key(*self.hasher.finalize().as_bytes())
    }
}

/// Length first, so that no two sequences of parts run into the same bytes.
fn frame(hasher: &mut blake3::Hasher, bytes: &[u8]) {
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    hasher.update(bytes);
}
