//! The bare topology of plants, with equal subtrees stored once.
//!
//! A plant's chains are a rooted, unordered tree, and most of its subtrees are alike: all bare twigs are one and the same
//! leaf, all limbs with seven bare twigs one and the same star. So trees are kept as *shapes*: a shape is a label and a
//! multiset of smaller shapes, stored once however often it occurs (hash consing). A tree of 600 chains has some 50 of
//! them, and what is known of two shapes is known wherever they occur, also in other trees of the same table.
//!
//! Limits: a plant counts down to order [`MOST_DEPTH`] and to its [`MOST_NODES`] first chains in breadth, coarse orders
//! first; what is beyond is left out.

use crate::plant::Plant;

/// Orders that count.
pub(super) const MOST_DEPTH: u32 = 48;
/// Chains that count.
pub(super) const MOST_NODES: usize = 4096;

/// A rooted, unordered tree with labels: for each node its parent, an earlier one; the first node is the root.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// The parent of each node but the root.
    parents: Vec<u32>,
    /// Empty where all labels are 0.
    labels: Vec<u32>,
}

impl Topology {
    /// A tree by the parents of its nodes, which come before them; the first entry is the root's and is not looked at.
    /// Labels that are missing are 0. A parent that does not come before its child counts as the root.
    #[must_use]
    pub fn new(parents: &[u32], labels: &[u32]) -> Self {
        let mut depth = vec![0_u32; parents.len()];
        let clean = parents.iter().enumerate().map(|(i, &p)| if (p as usize) < i { p } else { 0 });
        let mut clean: Vec<u32> = clean.collect();
        for i in 1..clean.len() {
            // Too deep a node hangs beside its parent.
            if depth[clean[i] as usize] >= MOST_DEPTH {
                clean[i] = clean[clean[i] as usize];
            }
            depth[i] = depth[clean[i] as usize] + 1;
        }
        let mut labels: Vec<u32> = labels.iter().copied().take(clean.len()).collect();
        if labels.iter().all(|l| *l == 0) {
            labels.clear();
        } else {
            labels.resize(clean.len(), 0);
        }
        Self { parents: clean, labels }
    }

    /// The topology of a plant's chains, unlabelled: an edge from each chain to those that leave it. Several stems stand
    /// on a root of their own.
    #[must_use]
    pub fn of(plant: &Plant) -> Self {
        Self::of_kept(plant, &[])
    }

    /// As [`of`](Self::of), without the chains (all that they bear among them) that are marked as gone; an empty `gone`
    /// marks none.
    pub(super) fn of_kept(plant: &Plant, gone: &[bool]) -> Self {
        let here = |i: usize| !gone.get(i).copied().unwrap_or(false);
        let chains = plant.chains();
        let kept = (0..chains.len()).filter(|&i| here(i)).count();
        // The finest orders go when there are too many chains.
        let mut deepest = MOST_DEPTH;
        if kept > MOST_NODES {
            let mut by_order = vec![0_usize; MOST_DEPTH as usize + 2];
            chains.iter().for_each(|c| by_order[usize::from(c.order).min(MOST_DEPTH as usize + 1)] += 1);
            let mut sum = 0;
            let fits = by_order.iter().take_while(|&&n| {
                sum += n;
                sum <= MOST_NODES
            });
            deepest = (fits.count() as u32).saturating_sub(1).max(1);
        }
        let counts = |i: usize| here(i) && u32::from(chains[i].order) <= deepest;
        let stems = (0..chains.len()).filter(|&i| chains[i].parent.is_none() && counts(i)).count();
        let mut parents: Vec<u32> = Vec::with_capacity(kept + 1);
        let mut node = vec![0_u32; chains.len()];
        if stems != 1 {
            parents.push(0);
        }
        for (i, chain) in chains.iter().enumerate().filter(|(i, _)| counts(*i)) {
            if parents.len() >= MOST_NODES {
                break;
            }
            node[i] = parents.len() as u32;
            parents.push(chain.parent.map_or(0, |p| node[p.index()]));
        }
        Self { parents, labels: Vec::new() }
    }

    /// How many nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parents.len()
    }

    /// Whether there is no node.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }
}

/// A shape in its [`Shapes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Shape(pub(super) u32);

/// All shapes of some trees.
#[derive(Clone, Debug, Default)]
pub(super) struct Shapes {
    labels: Vec<u32>,
    sizes: Vec<u32>,
    /// Where the children of each shape end in `children`.
    ends: Vec<u32>,
    /// Shapes of the children, sorted, each as often as it occurs.
    children: Vec<u32>,
    /// Open addressing: shapes by the hash of label and children, `u32::MAX` where free.
    slots: Vec<u32>,
    /// The shapes of unlabelled stars by their number of leaves; `u32::MAX` where not met yet.
    stars: Vec<u32>,
}

const FREE: u32 = u32::MAX;

impl Shapes {
    /// The shape of a whole tree; of a tree without nodes that of a single one.
    pub(super) fn insert(&mut self, tree: &Topology) -> Shape {
        let n = tree.len();
        if n == 0 {
            return self.shape(0, &[]);
        }
        // Children of each node as ranges, filled from the back: a node is finished before its parent is looked at.
        let mut first = vec![0_u32; n + 1];
        tree.parents[1..].iter().for_each(|&p| first[p as usize + 1] += 1);
        for i in 0..n {
            first[i + 1] += first[i];
        }
        let mut fill = first.clone();
        let mut below = vec![0_u32; n - 1];
        let mut last = Shape(0);
        for i in (0..n).rev() {
            let own = &mut below[first[i] as usize..first[i + 1] as usize];
            own.sort_unstable();
            let label = tree.labels.get(i).copied().unwrap_or(0);
            last = self.shape(label, own);
            if i > 0 {
                let slot = &mut fill[tree.parents[i] as usize];
                below[*slot as usize] = last.0;
                *slot += 1;
            }
        }
        last
    }

    /// The shape of this label and these children, sorted.
    fn shape(&mut self, label: u32, children: &[u32]) -> Shape {
        let star = label == 0 && children.iter().all(|&c| self.is_leaf(Shape(c)) && self.labels[c as usize] == 0);
        if star {
            if self.stars.len() <= children.len() {
                self.stars.resize(children.len() + 1, FREE);
            }
            if self.stars[children.len()] == FREE {
                self.stars[children.len()] = self.push(label, children);
            }
            return Shape(self.stars[children.len()]);
        }
        if (self.labels.len() + 1) * 2 > self.slots.len() {
            self.rehash();
        }
        let mut slot = self.slot_of(label, children);
        while self.slots[slot] != FREE {
            let known = Shape(self.slots[slot]);
            if self.label(known) == label && self.children(known) == children {
                return known;
            }
            slot = (slot + 1) & (self.slots.len() - 1);
        }
        let new = self.push(label, children);
        self.slots[slot] = new;
        Shape(new)
    }

    fn push(&mut self, label: u32, children: &[u32]) -> u32 {
        let id = self.labels.len() as u32;
        self.labels.push(label);
        self.sizes.push(1 + children.iter().map(|&c| self.sizes[c as usize]).sum::<u32>());
        self.children.extend_from_slice(children);
        self.ends.push(self.children.len() as u32);
        id
    }

    fn slot_of(&self, label: u32, children: &[u32]) -> usize {
        let mut hash = u64::from(label).wrapping_add(0x9e37_79b9_7f4a_7c15);
        for &c in children {
            hash = (hash ^ u64::from(c)).wrapping_mul(0x0000_0100_0000_01b3);
            hash ^= hash >> 29;
        }
        (hash ^ (hash >> 32)) as usize & (self.slots.len() - 1)
    }

    fn rehash(&mut self) {
        self.slots = vec![FREE; (self.slots.len() * 2).max(256)];
        for id in 0..self.labels.len() as u32 {
            let mut slot = self.slot_of(self.label(Shape(id)), self.children(Shape(id)));
            while self.slots[slot] != FREE {
                slot = (slot + 1) & (self.slots.len() - 1);
            }
            self.slots[slot] = id;
        }
    }

    pub(super) fn label(&self, shape: Shape) -> u32 {
        self.labels[shape.0 as usize]
    }

    /// Nodes of a shape.
    pub(super) fn size(&self, shape: Shape) -> u32 {
        self.sizes[shape.0 as usize]
    }

    /// Children of a shape, sorted.
    pub(super) fn children(&self, shape: Shape) -> &[u32] {
        let i = shape.0 as usize;
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.children[start as usize..self.ends[i] as usize]
    }

    pub(super) fn is_leaf(&self, shape: Shape) -> bool {
        self.sizes[shape.0 as usize] == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn the_order_of_siblings_does_not_matter_and_equal_subtrees_are_stored_once() {
        let mut shapes = Shapes::default();
        let a = shapes.insert(&Topology::new(&[0, 0, 0, 1, 1, 2], &[]));
        let b = shapes.insert(&Topology::new(&[0, 0, 0, 1, 2, 2], &[]));
        assert_eq!(a, b);
        // A leaf, stars of one and two leaves, the tree.
        assert_eq!((shapes.labels.len(), shapes.size(a)), (4, 6));
        assert_ne!(a, shapes.insert(&Topology::new(&[0, 0, 0, 1, 2, 2], &[0, 1])));
    }

    #[test]
    fn a_table_gives_back_what_went_in_however_much_it_holds() {
        let mut shapes = Shapes::default();
        let random = |seed: u64| {
            let seed = Seed::new(seed);
            let parents: Vec<u32> = (0..200_u64).map(|i| seed.at(i).index(i.max(1) as usize) as u32).collect();
            Topology::new(&parents, &[])
        };
        let first: Vec<Shape> = (0..50).map(|s| shapes.insert(&random(s))).collect();
        let again: Vec<Shape> = (0..50).map(|s| shapes.insert(&random(s))).collect();
        assert_eq!(first, again);
        assert!(first.iter().all(|s| shapes.size(*s) == 200));
        let mut distinct = first.clone();
        distinct.sort();
        distinct.dedup();
        assert_eq!(distinct.len(), 50);
    }

    #[test]
    fn endless_depth_and_wrong_parents_are_taken() {
        let line: Vec<u32> = (0..5000_u32).map(|i| i.saturating_sub(1)).collect();
        let tree = Topology::new(&line, &[]);
        assert_eq!(tree.len(), 5000);
        let mut shapes = Shapes::default();
        let none = shapes.insert(&Topology::default());
        assert_eq!(shapes.size(none), 1);
        let shape = shapes.insert(&tree);
        assert_eq!(shapes.size(shape), 5000);
        let odd = shapes.insert(&Topology::new(&[7, 9, 1], &[]));
        assert_eq!(shapes.size(odd), 3);
    }
}
