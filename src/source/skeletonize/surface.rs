//! From a welded mesh to pieces of surface, each an edge-manifold by itself.
//!
//! Triangles belong together across edges that just two of them share. An edge of three or more is where separate
//! skins touch (tubes that share a ring, a branch whose base is a polygon of the trunk): each becomes a piece of its
//! own, with its own copy of the vertices, and the pieces are joined again as limbs. A vertex of very many triangles is
//! copied too, so that no later step pays for its valence.

use glam::DVec3;
use rayon::prelude::*;

use super::weld::{Welded, root};

/// Most triangles at a vertex of a piece: a hub of more, the middle of a cap, is copied for each so many of them.
const MOST_AT_A_VERTEX: usize = 128;

/// Connected triangles, no edge with more than two of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// The pieces of a mesh, largest number of triangles first.
pub(super) fn surfaces(welded: &Welded) -> Vec<Surface> {
    let triangles = &welded.triangles;
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(triangles.len() * 3);
    for (t, &[a, b, c]) in triangles.iter().enumerate() {
        sides.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], t as u32)));
    }
    sides.par_sort_unstable();
    let mut group: Vec<u32> = (0..triangles.len() as u32).collect();
    for run in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, s), (_, t)] = *run {
            let (a, b) = (root(&mut group, s), root(&mut group, t));
            group[a.max(b) as usize] = a.min(b);
        }
    }
    drop(sides);
    for t in 0..triangles.len() as u32 {
        group[t as usize] = root(&mut group, t);
    }
    let mut members: Vec<u32> = (0..triangles.len() as u32).collect();
    members.par_sort_unstable_by_key(|&t| (group[t as usize], t));
    let mut found: Vec<Surface> = Vec::new();
    let mut name = vec![u32::MAX; welded.positions.len()];
    let mut used = vec![0_usize; welded.positions.len()];
    for run in members.chunk_by(|&a, &b| group[a as usize] == group[b as usize]) {
        let mut surface = Surface::default();
        for &t in run {
            let corners = triangles[t as usize].map(|v| {
                let v = v as usize;
                if name[v] == u32::MAX || used[v] >= MOST_AT_A_VERTEX {
                    name[v] = surface.positions.len() as u32;
                    used[v] = 0;
                    surface.positions.push(welded.positions[v]);
                }
                used[v] += 1;
                name[v]
            });
            surface.triangles.push(corners);
        }
        for &t in run {
            for v in triangles[t as usize] {
                name[v as usize] = u32::MAX;
            }
        }
        found.push(surface);
    }
    found.sort_by_key(|s| std::cmp::Reverse(s.triangles.len()));
    found
}

impl Surface {
    /// The neighbours of each vertex, rising, each once; and for each how many triangles the edge to it has.
    pub(super) fn neighbours(&self) -> Neighbours {
        let n = self.positions.len();
        let mut first = vec![0_u32; n + 1];
        for &v in self.triangles.iter().flatten() {
            first[v as usize + 1] += 2;
        }
        for v in 0..n {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut all = vec![(0_u32, 1_u32); first[n] as usize];
        for &[a, b, c] in &self.triangles {
            for [u, v] in [[a, b], [b, c], [c, a], [b, a], [c, b], [a, c]] {
                all[next[u as usize] as usize].0 = v;
                next[u as usize] += 1;
            }
        }
        // Rows are sorted, and closed up where a neighbour is there twice.
        let mut kept = 0;
        for v in 0..n {
            let (from, to) = (first[v] as usize, next[v] as usize);
            all[from..to].sort_unstable();
            first[v] = kept as u32;
            for k in from..to {
                if kept > first[v] as usize && all[kept - 1].0 == all[k].0 {
                    all[kept - 1].1 += 1;
                } else {
                    all[kept] = all[k];
                    kept += 1;
                }
            }
        }
        first[n] = kept as u32;
        all.truncate(kept);
        Neighbours { first, all }
    }

    /// Area of all triangles.
    pub(super) fn area(&self) -> f64 {
        self.triangles.iter().map(|&t| area(t, &self.positions)).sum()
    }

    /// For each vertex a third of the area of its triangles.
    pub(super) fn shares(&self) -> Vec<f64> {
        let mut shares = vec![0.0; self.positions.len()];
        for &t in &self.triangles {
            let third = area(t, &self.positions) / 3.0;
            for v in t {
                shares[v as usize] += third;
            }
        }
        shares
    }
}

/// The neighbours of all vertices, in one array.
#[derive(Clone, Debug)]
pub(super) struct Neighbours {
    first: Vec<u32>,
    all: Vec<(u32, u32)>,
}

impl Neighbours {
    /// How many vertices there are.
    pub(super) fn len(&self) -> usize {
        self.first.len() - 1
    }

    /// Each vertex' neighbours in turn.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[(u32, u32)]> {
        self.first.windows(2).map(|w| &self.all[w[0] as usize..w[1] as usize])
    }
}

impl std::ops::Index<usize> for Neighbours {
    type Output = [(u32, u32)];

    fn index(&self, v: usize) -> &Self::Output {
        &self.all[self.first[v] as usize..self.first[v + 1] as usize]
    }
}

/// Area of a triangle.
pub(super) fn area([a, b, c]: [u32; 3], positions: &[DVec3]) -> f64 {
    let a = positions[a as usize];
    (positions[b as usize] - a).cross(positions[c as usize] - a).length() * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_skins_on_one_edge_are_three_pieces_and_two_are_one() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
        let three = Welded { positions, triangles: vec![[0, 1, 2], [0, 1, 3], [1, 0, 4]], dropped: 0 };
        assert_eq!(surfaces(&three).len(), 3);
        let two = Welded { triangles: vec![[0, 1, 2], [0, 1, 3]], ..three };
        let found = surfaces(&two);
        assert_eq!((found.len(), found[0].positions.len()), (1, 4));
    }

    #[test]
    fn a_giant_fan_is_cut_into_small_ones() {
        let n = 5000_u32;
        let mut positions = vec![DVec3::ZERO];
        positions.extend((0..n).map(|i| DVec3::new(f64::from(i), 1.0, 0.0)));
        let triangles = (1..n).map(|i| [0, i, i + 1]).collect();
        let found = surfaces(&Welded { positions, triangles, dropped: 0 });
        assert_eq!(found.len(), 1);
        assert!(found[0].neighbours().iter().all(|n| n.len() <= MOST_AT_A_VERTEX + 1));
    }
}
