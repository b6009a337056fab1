//! Connectivity surgery: a contracted surface loses its faces, edge by edge, until only axes are left.
//!
//! Au et al. 2008, section 5. Edges that bear a face are collapsed in order of a cost: the shape cost sums the squared
//! distances of the place that is kept to the lines of the edges that were merged into either end (`F_a`, weight 1); the
//! sampling cost is the edge's length times the lengths that it makes its neighbours' edges grow by (`F_b`, weight 0.1).
//! Costs that rose since they were offered are offered again.

use glam::{DMat3, DVec3};

use super::surface::Surface;
use super::web::Web;

/// Weight of the sampling cost.
const SAMPLING: f64 = 0.1;

/// Axes: nodes, edges between them, and the node that each vertex went into.
pub(super) struct Axes {
    pub(super) count: usize,
    pub(super) edges: Vec<[u32; 2]>,
    pub(super) home: Vec<u32>,
}

/// Collapses a surface whose vertices have contracted to `places`; none when that takes too many steps.
pub(super) fn thin(surface: &Surface, places: &[DVec3]) -> Option<Axes> {
    let mut web = Web::new(surface);
    let mut lines: Vec<Lines> = vec![Lines::default(); places.len()];
    for (v, near) in web.links.iter().enumerate() {
        for &n in near {
            lines[v].add(places[v], places[n as usize]);
        }
    }
    let spread = |web: &Web, v: u32| {
        let at = places[v as usize];
        web.links[v as usize].iter().map(|&n| at.distance(places[n as usize])).sum::<f64>()
    };
    let cost = |lines: &[Lines], spread: f64, from: u32, to: u32| {
        let (a, b) = (places[from as usize], places[to as usize]);
        lines[from as usize].distance(b) + lines[to as usize].distance(b) + SAMPLING * a.distance(b) * spread
    };
    for v in 0..places.len() as u32 {
        let wide = spread(&web, v);
        for k in 0..web.links[v as usize].len() {
            let to = web.links[v as usize][k];
            web.offer(cost(&lines, wide, v, to), v, to);
        }
    }
    while web.left > 0 {
        let (offered, from, to) = web.take()?;
        web.count(from);
        web.count(to);
        if web.faces_on(from, to) == 0 {
            continue;
        }
        let now = cost(&lines, spread(&web, from), from, to);
        if now > offered * (1.0 + 1e-9) {
            web.offer(now, from, to);
            continue;
        }
        web.collapse(from, to);
        let gained = lines[from as usize];
        lines[to as usize].merge(&gained);
        let wide = spread(&web, to);
        for k in 0..web.links[to as usize].len() {
            let near = web.links[to as usize][k];
            if web.faces_on(to, near) > 0 {
                web.count(near);
                let its = spread(&web, near);
                web.offer(cost(&lines, its, near, to), near, to);
                web.offer(cost(&lines, wide, to, near), to, near);
            }
        }
    }
    let ends = web.ends();
    let mut name = vec![u32::MAX; ends.len()];
    let mut count = 0;
    for (v, &end) in ends.iter().enumerate() {
        if v as u32 == end {
            name[v] = count;
            count += 1;
        }
    }
    let mut edges = Vec::new();
    for (v, near) in web.links.iter().enumerate().filter(|&(v, _)| ends[v] == v as u32) {
        edges.extend(near.iter().filter(|&&n| n > v as u32).map(|&n| [name[v], name[n as usize]]));
    }
    edges.sort_unstable();
    Some(Axes { count: count as usize, edges, home: ends.into_iter().map(|e| name[e as usize]).collect() })
}

/// The squared distance to a number of lines, as a quadric.
#[derive(Clone, Copy, Debug)]
struct Lines {
    square: DMat3,
    linear: DVec3,
    constant: f64,
}

impl Default for Lines {
    fn default() -> Self {
        Self { square: DMat3::ZERO, linear: DVec3::ZERO, constant: 0.0 }
    }
}

impl Lines {
    /// Adds the line through two points; nothing where they are one.
    fn add(&mut self, a: DVec3, b: DVec3) {
        let Some(along) = (b - a).try_normalize() else { return };
        let across =
            DMat3::from_cols(DVec3::X - along * along.x, DVec3::Y - along * along.y, DVec3::Z - along * along.z);
        let moved = across * a;
        self.square += across;
        self.linear -= moved;
        self.constant += moved.dot(a);
    }

    fn merge(&mut self, other: &Self) {
        self.square += other.square;
        self.linear += other.linear;
        self.constant += other.constant;
    }

    fn distance(&self, p: DVec3) -> f64 {
        (p.dot(self.square * p) + 2.0 * self.linear.dot(p) + self.constant).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::cap::closed;
    use super::super::contract::contract;
    use super::super::shapes;
    use super::*;

    #[test]
    fn lines_measure_squared_distances() {
        let mut lines = Lines::default();
        lines.add(DVec3::new(0.0, 1.0, 0.0), DVec3::new(5.0, 1.0, 0.0));
        lines.add(DVec3::new(2.0, 0.0, 3.0), DVec3::new(2.0, 9.0, 3.0));
        assert!((lines.distance(DVec3::new(4.0, 3.0, 3.0)) - (4.0 + 9.0 + 4.0)).abs() < 1e-9);
    }

    #[test]
    fn a_tube_becomes_a_path_and_a_fork_one_node_of_three_edges() {
        let path: Vec<DVec3> = (0..20).map(|k| DVec3::Y * 0.2 * f64::from(k)).collect();
        let surface = shapes::tube(&path, &[0.1; 20], 6);
        let surface = closed(&surface);
        let axes = thin(&surface, &contract(&surface).unwrap()).unwrap();
        assert_eq!(axes.edges.len() + 1, axes.count);
        assert!(axes.count >= 8, "{}", axes.count);
        let fork = closed(&shapes::fork());
        let axes = thin(&fork, &contract(&fork).unwrap()).unwrap();
        let mut valence = vec![0; axes.count];
        axes.edges.iter().flatten().for_each(|&v| valence[v as usize] += 1);
        assert_eq!(axes.edges.len() + 1, axes.count);
        assert_eq!(valence.iter().filter(|&&v| v == 3).count(), 1, "{valence:?}");
        assert!(valence.iter().all(|&v| (1..=3).contains(&v)));
    }
}
