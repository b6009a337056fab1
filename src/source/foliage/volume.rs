//! The inside of a closed surface, in cells.
//!
//! A cell is inside where rays along at least two of the three axes say so by the parity of their crossings. A surface
//! that is open on one side (a cone without its base) has odd crossings along one axis only, and that axis does not vote
//! there. Memory is fixed, time linear in triangles times the cells that they cover.

use glam::Vec3;

/// Cells along the longest side.
const CELLS: usize = 40;

/// The cells inside of a surface.
#[derive(Debug)]
pub(super) struct Volume {
    low: Vec3,
    cell: f32,
    size: [usize; 3],
    inside: Vec<bool>,
}

impl Volume {
    /// Of triangles; none where they span nothing.
    pub(super) fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<Self> {
        let (low, high) =
            positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let longest = (high - low).max_element();
        if !(longest > 0.0 && longest.is_finite()) {
            return None;
        }
        let cell = longest / CELLS as f32;
        let size = (high - low).to_array().map(|side| ((side / cell).ceil() as usize).clamp(1, CELLS));
        let mut votes = vec![0_u8; size[0] * size[1] * size[2]];
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            // Rays through the middles of columns, a hair off so that they meet no edge of a regular mesh.
            let middle = |i: usize, k: usize| low[k] + (i as f32 + 0.5 + 0.013 * (k as f32 + 1.0)) * cell;
            let mut crossings: Vec<Vec<f32>> = vec![Vec::new(); size[a] * size[b]];
            for t in triangles {
                let [p, q, r] = t.map(|i| positions[i as usize]);
                let area = (q[a] - p[a]) * (r[b] - p[b]) - (q[b] - p[b]) * (r[a] - p[a]);
                if area == 0.0 {
                    continue;
                }
                let range = |k: usize| {
                    let (l, h) = (p[k].min(q[k]).min(r[k]), p[k].max(q[k]).max(r[k]));
                    let at = |v: f32| ((v - low[k]) / cell - 1.0).max(0.0) as usize;
                    at(l)..(at(h) + 3).min(size[k])
                };
                for j in range(b) {
                    for i in range(a) {
                        let (x, y) = (middle(i, a), middle(j, b));
                        let edge = |s: Vec3, t: Vec3| ((s[a] - x) * (t[b] - y) - (s[b] - y) * (t[a] - x)) / area;
                        let w = [edge(q, r), edge(r, p), edge(p, q)];
                        if w.iter().all(|w| *w >= 0.0) {
                            crossings[j * size[a] + i].push(w[0] * p[axis] + w[1] * q[axis] + w[2] * r[axis]);
                        }
                    }
                }
            }
            for j in 0..size[b] {
                for i in 0..size[a] {
                    let hits = &mut crossings[j * size[a] + i];
                    if hits.len() % 2 == 1 {
                        continue;
                    }
                    hits.sort_by(f32::total_cmp);
                    for pair in hits.chunks_exact(2) {
                        for k in 0..size[axis] {
                            let z = middle(k, axis);
                            if z >= pair[0] && z <= pair[1] {
                                let mut at = [0; 3];
                                (at[axis], at[a], at[b]) = (k, i, j);
                                votes[(at[2] * size[1] + at[1]) * size[0] + at[0]] += 1;
                            }
                        }
                    }
                }
            }
        }
        Some(Self { low, cell, size, inside: votes.into_iter().map(|v| v >= 2).collect() })
    }

    /// Whether a point is inside.
    pub(super) fn contains(&self, p: Vec3) -> bool {
        let at = (p - self.low) / self.cell;
        let mut index = [0; 3];
        for k in 0..3 {
            if !(at[k] >= 0.0 && at[k] < self.size[k] as f32) {
                return false;
            }
            index[k] = at[k] as usize;
        }
        self.inside[(index[2] * self.size[1] + index[1]) * self.size[0] + index[0]]
    }

    /// Middles of all cells inside, in order.
    pub(super) fn cells(&self) -> impl Iterator<Item = Vec3> {
        self.inside.iter().enumerate().filter(|(_, inside)| **inside).map(|(i, _)| {
            let at = [i % self.size[0], i / self.size[0] % self.size[1], i / (self.size[0] * self.size[1])];
            self.low + (Vec3::from_array(at.map(|k| k as f32)) + 0.5) * self.cell
        })
    }

    /// Edge of a cell.
    pub(super) fn cell(&self) -> f32 {
        self.cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An octahedron of radius 1, perhaps without its lower half.
    fn octahedron(open: bool) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let points = vec![Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z, Vec3::Y, Vec3::NEG_Y];
        let upper = (0..4).map(|i| [(i + 1) % 4, i, 4]);
        let lower = (0..4).map(|i| [i, (i + 1) % 4, 5]);
        (points, if open { upper.collect() } else { upper.chain(lower).collect() })
    }

    #[test]
    fn cells_fill_the_volume_and_no_more() {
        for open in [false, true] {
            let (points, triangles) = octahedron(open);
            let volume = Volume::new(&points, &triangles).unwrap();
            let filled = volume.cells().count() as f32 * volume.cell() * volume.cell() * volume.cell();
            let truth = if open { 2.0 / 3.0 } else { 4.0 / 3.0 };
            assert!((filled / truth - 1.0).abs() < 0.08, "{open}: {filled} {truth}");
            assert!(volume.contains(Vec3::Y * 0.5) && !volume.contains(Vec3::ONE * 0.9));
            assert_eq!(volume.contains(Vec3::Y * -0.5), !open);
        }
        assert!(Volume::new(&[Vec3::ONE; 3], &[[0, 1, 2]]).is_none());
    }
}
