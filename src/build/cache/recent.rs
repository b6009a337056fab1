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
        kept.used = self.uses;
        Some(kept.value.clone())
    }

    /// Keeps a value, and forgets those used longest ago while all weigh more than `most`.
    pub(super) fn insert(&mut self, key: Key, value: Value, weight: usize, most: usize) {
        self.uses += 1;
        self.weight += weight;
        if let Some(old) = self.values.insert(key, Kept { used: self.uses, weight, value }) {
            self.weight -= old.weight;
        }
        while self.weight > most && self.values.len() > 1 {
            let oldest = self.values.iter().min_by_key(|(_, kept)| kept.used).map(|(key, _)| *key);
            let Some(old) = oldest.and_then(|key| self.values.remove(&key)) else { return };
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
        assert_eq!(recent.weight, 1);
    }
}
