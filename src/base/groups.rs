//! Items in groups, in two flat arrays: a counting sort, which is linear and keeps each group's items in their order.

/// The items of each of some groups.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Groups {
    /// Where each group's begin in `items`; one more than groups.
    pub(crate) starts: Vec<u32>,
    /// All items, group by group.
    pub(crate) items: Vec<u32>,
}

impl Groups {
    /// Of pairs of a group, below `count`, and an item; they are gone through twice.
    pub(crate) fn of(count: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut starts = vec![0_u32; count + 1];
        pairs.clone().for_each(|(group, _)| starts[group as usize + 1] += 1);
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![0_u32; starts[count] as usize];
        for (group, item) in pairs {
            let slot = &mut next[group as usize];
            items[*slot as usize] = item;
            *slot += 1;
        }
        Self { starts, items }
    }

    /// The items of a group.
    #[inline]
    pub(crate) fn get(&self, group: usize) -> &[u32] {
        &self.items[self.starts[group] as usize..self.starts[group + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_group_has_its_items_in_their_order() {
        let pairs = [(2, 5), (0, 9), (2, 1), (3, 4), (2, 5)];
        let groups = Groups::of(5, pairs.into_iter());
        let all: Vec<&[u32]> = (0..5).map(|group| groups.get(group)).collect();
        assert_eq!(all, [&[9][..], &[], &[5, 1, 5], &[4], &[]]);
        assert_eq!(Groups::of(0, std::iter::empty()).starts, [0]);
    }
}
