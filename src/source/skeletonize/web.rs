//! A mesh whose edges can be collapsed one after the other, down to a graph without faces.
//!
//! Both the coarsening of large meshes and the surgery that ends a contraction collapse edges in order of a cost. A
//! collapse costs what the valences of its ends are; the sum of all is counted and bounded, so that a mesh made to
//! gather hubs ends in a refusal instead of a quadratic wait.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::surface::Surface;

/// Steps allowed for each vertex, and on top of that.
const MOST_STEPS: (u64, u64) = (20_000, 2_000_000);

/// Vertices, the edges between them and the faces they bear.
#[derive(Debug)]
pub(super) struct Web {
    /// Neighbours of each vertex, in no order.
    pub(super) links: Vec<Vec<u32>>,
    /// The other two corners of each face at a vertex.
    pub(super) faces: Vec<Vec<[u32; 2]>>,
    /// What each vertex was collapsed into; itself while it is there.
    pub(super) into: Vec<u32>,
    /// Faces left.
    pub(super) left: usize,
    /// Vertices left.
    pub(super) alive: usize,
    changes: Vec<u32>,
    heap: BinaryHeap<Reverse<Offer>>,
    steps: u64,
}

/// An edge that may be collapsed: cost as the bits of a number that isn't negative, the ends, how often each had been
/// changed then.
type Offer = (u64, u32, u32, u32, u32);

impl Web {
    /// The web of a surface.
    pub(super) fn new(surface: &Surface) -> Self {
        let n = surface.positions.len();
        let links = surface.neighbours().iter().map(|list| list.iter().map(|n| n.0).collect()).collect();
        let mut faces: Vec<Vec<[u32; 2]>> = vec![Vec::new(); n];
        for &[a, b, c] in &surface.triangles {
            faces[a as usize].push([b, c]);
            faces[b as usize].push([c, a]);
            faces[c as usize].push([a, b]);
        }
        Self {
            links,
            faces,
            into: (0..n as u32).collect(),
            left: surface.triangles.len(),
            alive: n,
            changes: vec![0; n],
            heap: BinaryHeap::new(),
            steps: 0,
        }
    }

    /// Offers to collapse the first end into the second.
    pub(super) fn offer(&mut self, cost: f64, from: u32, to: u32) {
        let changes = |v: u32| self.changes[v as usize];
        self.heap.push(Reverse((cost.max(0.0).to_bits(), from, to, changes(from), changes(to))));
    }

    /// The cheapest edge whose ends haven't changed since it was offered; none when there is none, or when this took more
    /// steps than it may.
    pub(super) fn take(&mut self) -> Option<(f64, u32, u32)> {
        if self.exhausted() {
            return None;
        }
        while let Some(Reverse((cost, from, to, a, b))) = self.heap.pop() {
            if self.changes[from as usize] == a && self.changes[to as usize] == b {
                return Some((f64::from_bits(cost), from, to));
            }
        }
        None
    }

    /// Whether a vertex was collapsed into another.
    pub(super) fn is_gone(&self, v: u32) -> bool {
        self.into[v as usize] != v
    }

    /// Whether the steps allowed are used up.
    pub(super) fn exhausted(&self) -> bool {
        self.steps > MOST_STEPS.0 * self.into.len() as u64 + MOST_STEPS.1
    }

    /// How many faces the edge between two vertices bears.
    pub(super) fn faces_on(&self, a: u32, b: u32) -> usize {
        self.faces[a as usize].iter().filter(|f| f.contains(&b)).count()
    }

    /// How many neighbours two vertices share.
    pub(super) fn shared(&self, a: u32, b: u32) -> usize {
        let other = &self.links[b as usize];
        self.links[a as usize].iter().filter(|n| other.contains(n)).count()
    }

    /// Counts work done with a vertex.
    pub(super) fn count(&mut self, v: u32) {
        self.steps += self.links[v as usize].len() as u64;
    }

    /// Merges `from` into `to`.
    pub(super) fn collapse(&mut self, from: u32, to: u32) {
        let (i, j) = (from as usize, to as usize);
        for [a, b] in std::mem::take(&mut self.faces[i]) {
            self.steps += (self.faces[a as usize].len() + self.faces[b as usize].len()) as u64;
            let corner = |web: &mut Self, at: u32| {
                let list = &mut web.faces[at as usize];
                let found = list.iter().position(|f| f.contains(&from) && (f.contains(&a) || f.contains(&b)));
                found.map(|p| list.swap_remove(p))
            };
            corner(self, a);
            corner(self, b);
            let twice = self.faces[j].iter().any(|f| f.contains(&a) && f.contains(&b));
            if a == to || b == to || twice {
                self.left -= 1;
            } else {
                self.faces[j].push([a, b]);
                self.faces[a as usize].push([b, to]);
                self.faces[b as usize].push([to, a]);
            }
        }
        let links = std::mem::take(&mut self.links[i]);
        for k in links {
            self.steps += self.links[k as usize].len() as u64;
            let near = &mut self.links[k as usize];
            if let Some(p) = near.iter().position(|&n| n == from) {
                near.swap_remove(p);
            }
            if k != to && !near.contains(&to) {
                near.push(to);
                self.links[j].push(k);
            }
        }
        self.steps += self.links[j].len() as u64;
        self.into[i] = to;
        self.alive -= 1;
        self.changes[i] += 1;
        self.changes[j] += 1;
    }

    /// For each vertex the one that it ended in.
    pub(super) fn ends(&self) -> Vec<u32> {
        let mut ends = self.into.clone();
        for v in 0..ends.len() as u32 {
            let mut last = v;
            while ends[last as usize] != last {
                last = ends[last as usize];
            }
            let mut at = v;
            while ends[at as usize] != last {
                at = std::mem::replace(&mut ends[at as usize], last);
            }
        }
        ends
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;
    use glam::DVec3;

    #[test]
    fn collapsing_a_tube_ring_by_ring_leaves_its_axis() {
        let path: Vec<DVec3> = (0..6).map(|k| DVec3::Y * f64::from(k)).collect();
        let surface = shapes::tube(&path, &[0.1; 6], 5);
        let mut web = Web::new(&surface);
        assert_eq!((web.left, web.alive), (50, 30));
        for ring in 0..6 {
            for s in 1..5 {
                web.collapse(ring * 5 + s, ring * 5);
            }
        }
        assert_eq!((web.left, web.alive), (0, 6));
        let ends = web.ends();
        assert!((0..30).all(|v| ends[v as usize] == v / 5 * 5));
        assert_eq!(web.links[0], [5]);
        let mut middle = web.links[10].clone();
        middle.sort_unstable();
        assert_eq!(middle, [5, 15]);
    }
}
