//! The constrained edit distance between unordered, labelled trees (Zhang 1996, "A constrained edit distance between
//! unordered labeled trees", Algorithmica 15): the least number of nodes to insert, delete or relabel, each at cost 1,
//! where disjoint subtrees go to disjoint subtrees. Without that constraint the problem is NP-hard; with it, it is
//!
//! ```text
//! D(a, b) = min( relabel(a, b) + F(a, b),
//!                |b| + min over children c of b of D(a, c) − |c|,
//!                |a| + min over children c of a of D(c, b) − |c| )
//! F(a, b) = the same over forests: the least-cost assignment of a's children to b's, what is left over inserted or
//!           deleted; or one forest within a single child of the other
//! ```
//!
//! It is a metric. Four things make it cheap enough to score every tree of a batch against every source:
//!
//! - shapes, not nodes, are compared, each pair once in a [`Memory`] that trees of one batch share (`topology.rs`);
//! - children that both sides have cancel out: under a metric some best assignment pairs equal ones;
//! - the cases that map a tree into a child of the other are tried only where the difference of sizes, a lower bound of
//!   the distance, leaves them a chance;
//! - stars differ by their leaves.
//!
//! What remains is assigned exactly ([`assign`]), up to [`MOST_CELLS`] pairs of children; beyond, both sides are paired
//! in the order of their sizes, which bounds the distance from above.

use super::topology::{Shape, Shapes, Topology};
use crate::relate::assign;

/// Most pairs of children that are assigned exactly: 384 × 384.
const MOST_CELLS: usize = 384 * 384;

/// What is known of pairs of shapes of one table; open addressing.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    /// Pair and whether it is of forests, plus 1; 0 where free.
    keys: Vec<u64>,
    values: Vec<u32>,
    held: usize,
}

impl Memory {
    fn slot(&self, key: u64) -> usize {
        let mask = self.keys.len() - 1;
        let hash = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut slot = (hash ^ (hash >> 32)) as usize & mask;
        while self.keys[slot] != 0 && self.keys[slot] != key {
            slot = (slot + 1) & mask;
        }
        slot
    }

    fn get(&self, key: u64) -> Option<u32> {
        if self.keys.is_empty() {
            return None;
        }
        let slot = self.slot(key);
        (self.keys[slot] == key).then(|| self.values[slot])
    }

    fn insert(&mut self, key: u64, value: u32) {
        if (self.held + 1) * 2 > self.keys.len() {
            let (keys, values) = (std::mem::take(&mut self.keys), std::mem::take(&mut self.values));
            self.keys = vec![0; (keys.len() * 2).max(256)];
            self.values = vec![0; self.keys.len()];
            for (key, value) in keys.into_iter().zip(values).filter(|(key, _)| *key != 0) {
                let slot = self.slot(key);
                (self.keys[slot], self.values[slot]) = (key, value);
            }
        }
        let slot = self.slot(key);
        self.held += usize::from(self.keys[slot] == 0);
        (self.keys[slot], self.values[slot]) = (key, value);
    }
}

/// Shapes have 31 bits here, so that a pair and the kind of question fit into 64.
fn key(a: Shape, b: Shape, forests: u64) -> u64 {
    (((u64::from(a.0) << 31) | u64::from(b.0)) << 1 | forests) + 1
}

/// The constrained edit distance of two trees, in nodes. 0 exactly where they are equal but for the order of siblings.
#[must_use]
pub fn edit_distance(a: &Topology, b: &Topology) -> u32 {
    let mut shapes = Shapes::default();
    let (a, b) = (shapes.insert(a), shapes.insert(b));
    distance(&shapes, &mut Memory::default(), a, b)
}

/// The distance of two shapes.
pub(super) fn distance(shapes: &Shapes, memory: &mut Memory, a: Shape, b: Shape) -> u32 {
    if a == b {
        return 0;
    }
    // Symmetric, so one order will do.
    let (a, b) = (a.min(b), a.max(b));
    let (size_a, size_b) = (shapes.size(a), shapes.size(b));
    let relabel = u32::from(shapes.label(a) != shapes.label(b));
    if size_a == 1 && size_b == 1 {
        return relabel;
    }
    if let Some(known) = memory.get(key(a, b, 0)) {
        return known;
    }
    let mut best = relabel + forests(shapes, memory, a, b);
    for (whole, other, size, size_other) in [(b, a, size_b, size_a), (a, b, size_a, size_b)] {
        for &child in distinct(shapes.children(whole)) {
            let inner = shapes.size(Shape(child));
            let rest = size - inner;
            if rest + size_other.abs_diff(inner) < best {
                best = best.min(rest + distance(shapes, memory, other, Shape(child)));
            }
        }
    }
    memory.insert(key(a, b, 0), best);
    best
}

/// The distance of what two shapes bear.
fn forests(shapes: &Shapes, memory: &mut Memory, a: Shape, b: Shape) -> u32 {
    let (a, b) = (a.min(b), a.max(b));
    let (size_a, size_b) = (shapes.size(a), shapes.size(b));
    if size_a == 1 || size_b == 1 {
        return size_a + size_b - 2;
    }
    if let Some(known) = memory.get(key(a, b, 1)) {
        return known;
    }
    let mut best = assigned(shapes, memory, shapes.children(a), shapes.children(b));
    for (whole, other, size, size_other) in [(b, a, size_b, size_a), (a, b, size_a, size_b)] {
        for &child in distinct(shapes.children(whole)) {
            let inner = shapes.size(Shape(child));
            let rest = size - inner;
            if inner > 1 && rest + size_other.abs_diff(inner) < best {
                best = best.min(rest + forests(shapes, memory, other, Shape(child)));
            }
        }
    }
    memory.insert(key(a, b, 1), best);
    best
}

/// The first of each run of equal ones; repeats of a child lead to the same cost.
fn distinct(children: &[u32]) -> impl Iterator<Item = &u32> {
    children.iter().enumerate().filter(|(i, c)| *i == 0 || children[i - 1] != **c).map(|(_, c)| c)
}

/// The least cost of assigning children to children, the rest deleted or inserted.
fn assigned(shapes: &Shapes, memory: &mut Memory, a: &[u32], b: &[u32]) -> u32 {
    let (mut rows, mut columns) = without_common(a, b);
    if rows.len() > columns.len() {
        std::mem::swap(&mut rows, &mut columns);
    }
    let size = |&c: &u32| shapes.size(Shape(c));
    let alone: u32 = rows.iter().chain(&columns).map(size).sum();
    if rows.is_empty() {
        return alone;
    }
    if rows.len().saturating_mul(columns.len()) > MOST_CELLS {
        rows.sort_by_key(|c| std::cmp::Reverse(size(c)));
        columns.sort_by_key(|c| std::cmp::Reverse(size(c)));
        let gain = |(r, c): (&u32, &u32)| size(r) + size(c) - distance(shapes, memory, Shape(*r), Shape(*c));
        return alone - rows.iter().zip(&columns).map(gain).sum::<u32>();
    }
    // What a pair saves against deleting one and inserting the other: never below 0, so every row is assigned.
    let mut saved = |r: u32, c: u32| {
        let apart = distance(shapes, memory, Shape(r), Shape(c));
        f64::from(size(&r) + size(&c)) - f64::from(apart)
    };
    if rows[0] == rows[rows.len() - 1] {
        // All rows are alike: the best columns take them.
        let mut gains: Vec<f64> = columns.iter().map(|&c| saved(rows[0], c)).collect();
        gains.sort_by(|x, y| y.total_cmp(x));
        return alone - gains[..rows.len()].iter().sum::<f64>() as u32;
    }
    let mut costs = vec![0.0_f64; rows.len() * columns.len()];
    for (i, &r) in rows.iter().enumerate() {
        // Rows and columns are sorted, so equal ones are neighbours.
        if i > 0 && rows[i - 1] == r {
            costs.copy_within((i - 1) * columns.len()..i * columns.len(), i * columns.len());
            continue;
        }
        for (j, &c) in columns.iter().enumerate() {
            let before = if j > 0 && columns[j - 1] == c { Some(costs[i * columns.len() + j - 1]) } else { None };
            costs[i * columns.len() + j] = before.unwrap_or_else(|| -saved(r, c));
        }
    }
    let answer = assign(&costs, rows.len(), columns.len());
    let gain: f64 = answer.iter().enumerate().filter_map(|(i, c)| Some(-costs[i * columns.len() + (*c)?])).sum();
    alone - gain as u32
}

/// What each of two sorted lists holds that the other doesn't, counted.
fn without_common(a: &[u32], b: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let (mut only_a, mut only_b) = (Vec::new(), Vec::new());
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        match a[i].cmp(&b[j]) {
            std::cmp::Ordering::Equal => (i, j) = (i + 1, j + 1),
            std::cmp::Ordering::Less => {
                only_a.push(a[i]);
                i += 1;
            }
            std::cmp::Ordering::Greater => {
                only_b.push(b[j]);
                j += 1;
            }
        }
    }
    only_a.extend_from_slice(&a[i..]);
    only_b.extend_from_slice(&b[j..]);
    (only_a, only_b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    /// All rooted trees of `n` nodes, as parents in an order that grows from the root, each shape at least once.
    fn all_trees(n: usize) -> Vec<Vec<u32>> {
        let mut trees: Vec<Vec<u32>> = vec![vec![0]];
        for i in 1..n as u32 {
            let grown = |t: &Vec<u32>| {
                // Parents that never fall keep one of the many orders of a tree.
                let least = if t.len() > 1 { t[t.len() - 1] } else { 0 };
                (least..i).map(|p| t.iter().copied().chain([p]).collect::<Vec<u32>>()).collect::<Vec<_>>()
            };
            trees = trees.iter().flat_map(grown).collect();
        }
        trees
    }

    /// The cheapest of all mappings that satisfy Zhang's definition, tried one after the other.
    fn brute(a: &[u32], labels_a: &[u32], b: &[u32], labels_b: &[u32]) -> u32 {
        let mut brute = Brute { a, b, labels_a, labels_b, pairs: Vec::new(), best: u32::MAX };
        brute.go(0);
        brute.best
    }

    struct Brute<'t> {
        a: &'t [u32],
        b: &'t [u32],
        labels_a: &'t [u32],
        labels_b: &'t [u32],
        pairs: Vec<(usize, usize)>,
        best: u32,
    }

    fn ancestors(tree: &[u32], mut node: usize) -> Vec<usize> {
        let mut all = vec![node];
        while node != 0 {
            node = tree[node] as usize;
            all.push(node);
        }
        all
    }

    fn meet(tree: &[u32], x: usize, y: usize) -> usize {
        let above = ancestors(tree, y);
        ancestors(tree, x).into_iter().find(|n| above.contains(n)).unwrap()
    }

    /// Whether `x` is a proper ancestor of `y`.
    fn above(tree: &[u32], x: usize, y: usize) -> bool {
        x != y && ancestors(tree, y).contains(&x)
    }

    impl Brute<'_> {
        fn fits(&self, new: (usize, usize)) -> bool {
            let mut all = self.pairs.clone();
            all.push(new);
            let (a, b) = (self.a, self.b);
            all.iter().all(|p| p.1 != new.1 || *p == new)
                && all.iter().all(|p| {
                    above(a, p.0, new.0) == above(b, p.1, new.1) && above(a, new.0, p.0) == above(b, new.1, p.1)
                })
                && all.iter().all(|p| {
                    all.iter().all(|q| {
                        all.iter().all(|r| above(a, meet(a, p.0, q.0), r.0) == above(b, meet(b, p.1, q.1), r.1))
                    })
                })
        }

        fn go(&mut self, i: usize) {
            if i == self.a.len() {
                let relabelled = self.pairs.iter().filter(|p| self.labels_a[p.0] != self.labels_b[p.1]).count();
                let cost = self.a.len() + self.b.len() - 2 * self.pairs.len() + relabelled;
                self.best = self.best.min(cost as u32);
                return;
            }
            self.go(i + 1);
            for j in 0..self.b.len() {
                if self.fits((i, j)) {
                    self.pairs.push((i, j));
                    self.go(i + 1);
                    self.pairs.pop();
                }
            }
        }
    }

    fn labels(seed: Seed, n: usize) -> Vec<u32> {
        (0..n as u64).map(|i| seed.at(i).index(2) as u32).collect()
    }

    #[test]
    fn every_pair_of_trees_of_up_to_five_nodes_costs_what_trying_all_mappings_finds() {
        let trees: Vec<Vec<u32>> = (1..=5).flat_map(all_trees).collect();
        let zeros = [0; 5];
        let mut checked = 0;
        for (i, a) in trees.iter().enumerate() {
            for b in &trees[i..] {
                let found = edit_distance(&Topology::new(a, &[]), &Topology::new(b, &[]));
                assert_eq!(found, brute(a, &zeros, b, &zeros), "{a:?} {b:?}");
                checked += 1;
            }
        }
        assert!(checked > 200, "{checked}");
    }

    #[test]
    fn labelled_trees_cost_what_trying_all_mappings_finds() {
        let trees: Vec<Vec<u32>> = (1..=4).flat_map(all_trees).collect();
        for (i, a) in trees.iter().enumerate() {
            for (j, b) in trees.iter().enumerate() {
                for k in 0..3 {
                    let seed = Seed::new((i * 1000 + j * 10 + k) as u64);
                    let (la, lb) = (labels(seed.child("a"), a.len()), labels(seed.child("b"), b.len()));
                    let found = edit_distance(&Topology::new(a, &la), &Topology::new(b, &lb));
                    assert_eq!(found, brute(a, &la, b, &lb), "{a:?} {la:?} {b:?} {lb:?}");
                }
            }
        }
    }

    fn random(seed: Seed, most: usize) -> Topology {
        let n = 1 + seed.child("n").index(most);
        let parents: Vec<u32> = (0..n as u64).map(|i| seed.at(i).index(i.max(1) as usize) as u32).collect();
        Topology::new(&parents, &labels(seed.child("labels"), n))
    }

    #[test]
    fn it_is_a_metric() {
        for s in 0..300 {
            let seed = Seed::new(s);
            let [a, b, c] = [0, 1, 2].map(|i| random(seed.at(i), 14));
            let d = edit_distance;
            assert_eq!(d(&a, &a), 0);
            assert_eq!(d(&a, &b), d(&b, &a));
            assert!(d(&a, &c) <= d(&a, &b) + d(&b, &c), "seed {s}");
            let mut shapes = Shapes::default();
            assert_eq!(d(&a, &b) == 0, shapes.insert(&a) == shapes.insert(&b));
            assert!(d(&a, &b) >= a.len().abs_diff(b.len()) as u32);
        }
    }

    #[test]
    fn one_edit_costs_one_node() {
        for s in 0..100 {
            let seed = Seed::new(s);
            let n = 2 + seed.child("n").index(60);
            let parents: Vec<u32> = (0..n as u64).map(|i| seed.at(i).index(i.max(1) as usize) as u32).collect();
            let more: Vec<u32> = parents.iter().copied().chain([seed.child("more").index(n) as u32]).collect();
            assert_eq!(edit_distance(&Topology::new(&parents, &[]), &Topology::new(&more, &[])), 1);
        }
    }

    #[test]
    fn memory_changes_no_answer() {
        let mut shapes = Shapes::default();
        let trees: Vec<Topology> = (0..12).map(|i| random(Seed::new(i), 40)).collect();
        let held: Vec<Shape> = trees.iter().map(|t| shapes.insert(t)).collect();
        let mut memory = Memory::default();
        for (a, ta) in held.iter().zip(&trees) {
            for (b, tb) in held.iter().zip(&trees) {
                assert_eq!(distance(&shapes, &mut memory, *a, *b), edit_distance(ta, tb));
            }
        }
    }

    #[test]
    fn too_many_children_for_an_exact_answer_still_give_a_bound() {
        // 500 different stars against 500 others: more pairs than are assigned.
        let bush = |step: u32| {
            let mut parents = vec![0];
            for limb in 0..500_u32 {
                let at = parents.len() as u32;
                parents.push(0);
                parents.extend(std::iter::repeat_n(at, (limb * 2 + step) as usize % 5 + limb as usize % 3));
            }
            Topology::new(&parents, &[0])
        };
        let (a, b) = (bush(0), bush(1));
        let found = edit_distance(&a, &b);
        assert!(found > 0 && found <= (a.len() + b.len()) as u32);
    }
}
