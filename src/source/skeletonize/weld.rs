//! Vertices that lie at one place become one.
//!
//! Exporters double vertices along texture seams, and some write every triangle's corners anew; without welding a
//! tube is an open strip, or loose triangles. Equal positions are merged first, then those within [`NEAR`] of the
//! median edge, since the two ends of a ring are often `sin(0)` and `sin(2π)` of a single-precision library.
//!
//! Near pairs are found by four grids, each shifted by a quarter of a cell along all axes: two points nearer than a
//! quarter of a cell in every axis can be parted by a cell's border in at most one grid an axis, so one of the four
//! holds both in one cell. n log n, whatever the points.

use glam::DVec3;
use rayon::prelude::*;

/// Share of the median edge within which vertices are one.
const NEAR: f64 = 2e-3;
/// The same as a share of the extent, whichever is less: single precision can't tell more apart.
const RESOLUTION: f64 = 4e-6;

/// A mesh whose vertices all lie apart, without triangles that have fewer than three of them, or the same three.
#[derive(Clone, Debug, Default)]
pub(super) struct Welded {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Triangles that had fewer than three vertices apart, or were there twice.
    pub(super) dropped: usize,
}

/// Welds a mesh. Positions must be finite, indices in range. `coarser` multiplies the distance within which vertices
/// are one.
pub(super) fn weld(positions: &[DVec3], triangles: &[[u32; 3]], coarser: f64) -> Welded {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &p in positions {
        low = low.min(p);
        high = high.max(p);
    }
    let mut merged = equal(positions);
    let reach = (median_edge(positions, triangles) * NEAR).min(low.distance(high) * RESOLUTION) * coarser;
    if reach > 0.0 && reach.is_finite() {
        for quarter in 0..4 {
            near(positions, low, reach * 4.0, f64::from(quarter) * 0.25, &mut merged);
        }
    }
    // Roots by path compression; each stands for its set and is the first of it.
    for i in 0..merged.len() {
        merged[i] = merged[merged[i] as usize];
    }
    let mut name = vec![u32::MAX; positions.len()];
    let mut welded = Welded::default();
    for &triangle in triangles {
        let [a, b, c] = triangle.map(|v| merged[v as usize]);
        if a == b || b == c || c == a {
            welded.dropped += 1;
            continue;
        }
        let corner = |v: u32, welded: &mut Welded, name: &mut Vec<u32>| {
            if name[v as usize] == u32::MAX {
                name[v as usize] = welded.positions.len() as u32;
                welded.positions.push(positions[v as usize]);
            }
            name[v as usize]
        };
        let triangle = [a, b, c].map(|v| corner(v, &mut welded, &mut name));
        welded.triangles.push(triangle);
    }
    once(&mut welded);
    welded
}

/// Keeps the first of triangles with the same corners, whichever way round: two-sided meshes hold each face twice.
fn once(welded: &mut Welded) {
    let mut keys: Vec<([u32; 3], u32)> = welded.triangles.iter().zip(0..).map(|(&t, i)| (sorted(t), i)).collect();
    keys.par_sort_unstable();
    let mut keep = vec![true; keys.len()];
    for pair in keys.windows(2) {
        if pair[0].0 == pair[1].0 {
            keep[pair[1].1 as usize] = false;
            welded.dropped += 1;
        }
    }
    let mut kept = keep.iter();
    welded.triangles.retain(|_| *kept.next().unwrap_or(&true));
}

fn sorted(mut t: [u32; 3]) -> [u32; 3] {
    t.sort_unstable();
    t
}

/// For each point the first that lies at the very same place.
fn equal(positions: &[DVec3]) -> Vec<u32> {
    // Adding zero makes -0 and 0 one.
    let bits = |p: DVec3| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
    let mut keys: Vec<([u64; 3], u32)> = positions.iter().zip(0..).map(|(&p, i)| (bits(p), i)).collect();
    keys.par_sort_unstable();
    let mut merged: Vec<u32> = (0..positions.len() as u32).collect();
    let mut first = 0;
    for i in 1..keys.len() {
        if keys[i].0 == keys[first].0 {
            merged[keys[i].1 as usize] = keys[first].1;
        } else {
            first = i;
        }
    }
    merged
}

/// Joins the sets of points that share a cell of a grid.
fn near(positions: &[DVec3], low: DVec3, cell: f64, shift: f64, merged: &mut [u32]) {
    let place = |p: DVec3| ((p - low) / cell + shift).floor().to_array().map(|x| x as i64);
    let mut keys: Vec<([i64; 3], u32)> =
        positions.iter().zip(0_u32..).filter(|&(_, i)| merged[i as usize] == i).map(|(&p, i)| (place(p), i)).collect();
    keys.par_sort_unstable();
    for pair in keys.windows(2) {
        if pair[0].0 == pair[1].0 {
            let (a, b) = (root(merged, pair[0].1), root(merged, pair[1].1));
            merged[a.max(b) as usize] = a.min(b);
        }
    }
    for i in 0..merged.len() as u32 {
        merged[i as usize] = root(merged, i);
    }
}

/// The first point of a set; halves the way for the next search.
pub(super) fn root(parents: &mut [u32], mut i: u32) -> u32 {
    while parents[i as usize] != i {
        parents[i as usize] = parents[parents[i as usize] as usize];
        i = parents[i as usize];
    }
    i
}

/// Median length of the edges that have one; 0 where none has.
fn median_edge(positions: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    // A sample is enough for a tolerance, and keeps two million triangles cheap.
    let step = triangles.len() / 60_000 + 1;
    let mut lengths: Vec<f64> = triangles
        .iter()
        .step_by(step)
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| positions[a as usize].distance(positions[b as usize]))
        .filter(|&l| l > 0.0)
        .collect();
    if lengths.is_empty() {
        return 0.0;
    }
    let middle = lengths.len() / 2;
    *lengths.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seams_close_and_what_is_apart_stays_apart() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        // Two triangles of one square, each with its own corners, one off by a rounding error, and one that is flat.
        let positions =
            [p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(-0.0, 0.0), p(1.0, 1.0 + 1e-7), p(0.0, 1.0), p(0.0, 1e-8)];
        let welded = weld(&positions, &[[0, 1, 2], [3, 4, 5], [0, 3, 6], [2, 0, 1]], 1.0);
        assert_eq!(welded.positions.len(), 4);
        assert_eq!(welded.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(welded.dropped, 2);
    }

    #[test]
    fn all_vertices_equal_leave_nothing() {
        let welded = weld(&[DVec3::ONE; 300], &(0..100).map(|i| [i, i + 100, i + 200]).collect::<Vec<_>>(), 1.0);
        assert!(welded.triangles.is_empty() && welded.positions.is_empty());
        assert!(weld(&[], &[], 1.0).triangles.is_empty());
    }
}
