//! The tier in memory: values by key, those used last, up to a sum of weights.

use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::Key;

/// A value of any type.
type Value = Arc<dyn Any + Send + Sync>;

/// Values by key.
#[derive(Debug, Default)]
pub(super) struct Recent {
    values: BTreeMap<Key, Kept>,
    /// The keys by when they were used: a build under a small bound forgets as often as it keeps.
    by_use: BTreeMap<u64, Key>,
    uses: u64,
    weight: usize,
}

#[derive(Debug)]
struct Kept {
    used: u64,
    weight: usize,
    value: Value,
}

impl Recent {
    /// The value of a key, which is now the one used last.
    pub(super) fn get(&mut self, key: Key) -> Option<Value> {
        self.uses += 1;
        let kept = self.values.get_mut(&key)?;
        self.by_use.remove(&kept.used);
        kept.used = self.uses;
        self.by_use.insert(self.uses, key);
        Some(kept.value.clone())
    }

    /// Keeps a value, and forgets those used longest ago while all weigh more than `most`.
    pub(super) fn insert(&mut self, key: Key, value: Value, weight: usize, most: usize) {
        self.uses += 1;
        self.weight += weight;
        if let Some(old) = self.values.insert(key, Kept { used: self.uses, weight, value }) {
            self.weight -= old.weight;
            self.by_use.remove(&old.used);
        }
        self.by_use.insert(self.uses, key);
        while self.weight > most && self.values.len() > 1 {
            let oldest = self.by_use.pop_first();
            let Some(old) = oldest.and_then(|(_, key)| self.values.remove(&key)) else { return };
            self.weight -= old.weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_keeps_what_was_used_last() {
        let mut recent = Recent::default();
        let keys: Vec<Key> = (0..4_u8).map(|i| Key::of_bytes(&[i])).collect();
        recent.insert(keys[0], Arc::new(0), 40, 100);
        recent.insert(keys[1], Arc::new(1), 40, 100);
        assert!(recent.get(keys[0]).is_some());
        recent.insert(keys[2], Arc::new(2), 40, 100);
        let left: Vec<bool> = keys.iter().map(|key| recent.get(*key).is_some()).collect();
        assert_eq!(left, [true, false, true, false]);
        // One that is heavier than all may be is kept alone: it was asked for.
        recent.insert(keys[3], Arc::new(3), 1000, 100);
        assert!(recent.get(keys[3]).is_some() && recent.get(keys[2]).is_none());
        recent.insert(keys[3], Arc::new(4), 1, 100);
        assert_eq!((recent.weight, recent.values.len(), recent.by_use.len()), (1, 1, 1));
    }
}
