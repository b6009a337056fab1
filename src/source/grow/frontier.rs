//! The frontier of Dijkstra's algorithm: a radix heap (Ahuja, Mehlhorn, Orlin, Tarjan 1990).
//!
//! What is taken out never gets smaller, so entries are kept in buckets by the highest bit in which they differ from what
//! was taken last; each entry moves to lower buckets only. On the graphs here it takes two thirds of the time of a binary
//! heap. Costs are compared as bits (they are never negative), with the node's index after them.

/// Nodes with their costs.
#[derive(Clone, Debug)]
pub(super) struct Frontier {
    buckets: Vec<Vec<u64>>,
    /// What was taken last.
    last: u64,
}

impl Default for Frontier {
    fn default() -> Self {
        Self { buckets: vec![Vec::new(); 65], last: 0 }
    }
}

impl Frontier {
    /// Adds a node. One that would come before the node taken last comes next after it.
    pub(super) fn push(&mut self, cost: f32, node: u32) {
        let mut key = u64::from(cost.to_bits()) << 32 | u64::from(node);
        if key < self.last {
            key = ((self.last >> 32) + 1) << 32 | u64::from(node);
        }
        self.place(key);
    }

    fn place(&mut self, key: u64) {
        let bucket = 64 - (key ^ self.last).leading_zeros();
        self.buckets[bucket as usize].push(key);
    }

    /// Takes the node of the least cost, the smallest of equals.
    pub(super) fn pop(&mut self) -> Option<u32> {
        if self.buckets[0].is_empty() {
            let bucket = self.buckets.iter().position(|bucket| !bucket.is_empty())?;
            let keys = std::mem::take(&mut self.buckets[bucket]);
            self.last = keys.iter().copied().min().unwrap_or(self.last);
            for &key in &keys {
                self.place(key);
            }
            // Its room is used again.
            let mut keys = keys;
            keys.clear();
            self.buckets[bucket] = keys;
        }
        self.buckets[0].pop().map(|key| key as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn nodes_come_by_cost_and_equals_by_index() {
        let mut frontier = Frontier::default();
        let mut expected = Vec::new();
        for i in 0..500_u32 {
            let cost = Seed::new(3).at(u64::from(i)).index(40) as f32 * 0.25;
            frontier.push(cost, i);
            expected.push((cost.to_bits(), i));
        }
        expected.sort_unstable();
        let mut found = Vec::new();
        while let Some(node) = frontier.pop() {
            found.push(node);
        }
        assert_eq!(found, expected.into_iter().map(|(_, node)| node).collect::<Vec<_>>());
    }

    #[test]
    fn pushing_while_taking_keeps_the_order() {
        let mut frontier = Frontier::default();
        frontier.push(0.0, 0);
        let (mut costs, mut last) = (vec![0.0_f32], 0.0);
        while let Some(node) = frontier.pop() {
            let cost = costs[node as usize];
            assert!(cost >= last);
            last = cost;
            for k in 0..3 {
                if costs.len() < 2000 {
                    costs.push(cost + Seed::new(u64::from(node)).at(k).unit());
                    frontier.push(costs[costs.len() - 1], costs.len() as u32 - 1);
                }
            }
        }
        assert_eq!(frontier.pop(), None);
    }

    #[test]
    fn a_cost_below_the_last_comes_next() {
        let mut frontier = Frontier::default();
        frontier.push(2.0, 1);
        frontier.push(3.0, 2);
        assert_eq!(frontier.pop(), Some(1));
        frontier.push(2.0, 0);
        assert_eq!([frontier.pop(), frontier.pop(), frontier.pop()], [Some(0), Some(2), None]);
    }
}
