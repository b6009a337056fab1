//! A plain reference for growth: neighbours by a k-d tree, paths by Dijkstra's algorithm with the standard binary heap.
//!
//! Written as one would in an afternoon, over the same nodes and with the same result; one thread.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::Vec3;

/// A k-d tree in an array: the middle of a range is its node.
pub struct KdTree<'a> {
    points: &'a [Vec3],
    order: Vec<u32>,
}

impl<'a> KdTree<'a> {
    /// Sorts the points.
    pub fn new(points: &'a [Vec3]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let length = order.len();
        split(points, &mut order, 0, length, 0);
        Self { points, order }
    }

    /// The nearest point within `reach` in each octant around a point; `u32::MAX` for none.
    pub fn octants(&self, node: u32, reach: f32) -> [u32; 8] {
        let mut best = [(reach * reach, u32::MAX); 8];
        self.visit(node, 0, self.order.len(), 0, &mut best);
        best.map(|(_, node)| node)
    }

    fn visit(&self, node: u32, from: usize, to: usize, axis: usize, best: &mut [(f32, u32); 8]) {
        if from >= to {
            return;
        }
        let here = self.points[node as usize];
        let middle = usize::midpoint(from, to);
        let other = self.order[middle];
        let there = self.points[other as usize];
        if other != node {
            let square = here.distance_squared(there);
            let octant =
                usize::from(there.x < here.x) | usize::from(there.y < here.y) << 1 | usize::from(there.z < here.z) << 2;
            if (square, other) < best[octant] {
                best[octant] = (square, other);
            }
        }
        let off = here[axis] - there[axis];
        let next = (axis + 1) % 3;
        let (near, far) =
            if off < 0.0 { ((from, middle), (middle + 1, to)) } else { ((middle + 1, to), (from, middle)) };
        self.visit(node, near.0, near.1, next, best);
        // The far side matters to the octants that reach across.
        let worst = (0..8)
            .filter(|octant| (octant >> axis & 1 == 1) == (off >= 0.0))
            .fold(0.0_f32, |worst, octant| worst.max(best[octant].0));
        if off * off <= worst {
            self.visit(node, far.0, far.1, next, best);
        }
    }
}

fn split(points: &[Vec3], order: &mut [u32], from: usize, to: usize, axis: usize) {
    if to - from < 2 {
        return;
    }
    let middle = usize::midpoint(from, to);
    order[from..to]
        .select_nth_unstable_by(middle - from, |a, b| points[*a as usize][axis].total_cmp(&points[*b as usize][axis]));
    split(points, order, from, middle, (axis + 1) % 3);
    split(points, order, middle + 1, to, (axis + 1) % 3);
}

/// The Yao-8 edges of some points.
pub fn yao(points: &[Vec3], reach: f32) -> Vec<[u32; 8]> {
    let tree = KdTree::new(points);
    (0..points.len() as u32).map(|i| tree.octants(i, reach)).collect()
}

/// Least costs from a root to all nodes, with upright guiding vectors.
pub fn dijkstra(points: &[Vec3], edges: &[[u32; 8]], root: u32) -> Vec<f32> {
    let mut costs = vec![f32::INFINITY; points.len()];
    let mut done = vec![false; points.len()];
    let mut heap = BinaryHeap::new();
    costs[root as usize] = 0.0;
    heap.push(Reverse((0_u32, root)));
    while let Some(Reverse((_, node))) = heap.pop() {
        if std::mem::replace(&mut done[node as usize], true) {
            continue;
        }
        for &target in edges[node as usize].iter().filter(|&&t| t != u32::MAX) {
            let edge = points[target as usize] - points[node as usize];
            let cost = costs[node as usize] + (edge.length() * 1.2 - edge.y).max(0.0);
            if cost < costs[target as usize] {
                costs[target as usize] = cost;
                heap.push(Reverse((cost.to_bits(), target)));
            }
        }
    }
    costs
}
