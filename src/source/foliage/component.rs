//! Connected pieces of a mesh, and the measures that tell sheets, tubes and lumps apart.
//!
//! Pieces hang together by edges between equal positions, not by indices: many files share no vertices at all. Pieces that
//! meet in a point only are separate, as are parts of different materials. Triangles that lie on each other (leaves
//! modelled back to back) count once. Measures are those of pieces whose triangles all face one side: where a file turns
//! some of a sheet's triangles over, they are turned back.

use glam::{DVec3, Vec3};

use crate::source::scene::Part;

/// Most that a blade holds, as [`Component::bulk`]: crowns, however slim and ragged, hold three times as much and more.
const BLADE: f32 = 0.012;
/// The same of a board, and least [`Component::sheet`] of one.
const BOARD: f32 = 0.02;
const FACED: f32 = 0.85;
/// Least square of a blade's area over its volume and length: 13 for tubes however thin, about 4 times width over
/// thickness for blades.
const FLAT: f32 = 30.0;
/// Widest that a blade is, as a share of its length: shorter closed pieces are the skirts of firs, or clumps.
const SLIM: f32 = 0.5;

/// A connected piece of one part.
#[derive(Clone, Debug)]
pub(super) struct Component {
    /// Index of the part.
    pub(super) part: usize,
    /// Corners by index into the part's positions, each position by one index only; no triangle twice.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The same corners as the file has them: at a seam of the texture one position has several, each with coordinates and
    /// a colour of its own.
    pub(super) corners: Vec<[u32; 3]>,
    /// Each position once, in the order in which the triangles name them.
    pub(super) points: Vec<u32>,
    /// Edges of one triangle only.
    pub(super) open: usize,
    /// Square units.
    pub(super) area: f32,
    /// Length of the sum of the area vectors over the area: 1 for a flat sheet, about 0 for tubes and closed pieces.
    pub(super) facing: f32,
    /// Share of the area that is seen along the thinnest direction: 1 for sheets, open or closed, 0.64 for tubes.
    pub(super) sheet: f32,
    /// Volume inside over the area to the power of 1.5: 0.094 for a ball, 0.005 for a blade with a thickness. Says little
    /// about a piece with many open edges.
    pub(super) bulk: f32,
    /// Unit: of the area vectors' sum where it says something, else the thinnest direction.
    pub(super) normal: Vec3,
    /// Mean of the points.
    pub(super) centre: Vec3,
    /// Principal directions, longest first.
    pub(super) axes: [Vec3; 3],
    /// Extents along them.
    pub(super) extents: [f32; 3],
    /// Least corner.
    pub(super) low: Vec3,
    /// Greatest corner.
    pub(super) high: Vec3,
}

/// The pieces of a part, in the order of their first triangles; n log n.
pub(super) fn components(part: &Part, index: usize) -> Vec<Component> {
    let weld = weld(&part.positions);
    let welded: Vec<[u32; 3]> = part.triangles.iter().map(|t| t.map(|c| weld[c as usize])).collect();
    connected(part, index, &welded, &part.triangles)
}

/// The pieces that some triangles of a part make, whose corners name each position by one index only; `corners` are the
/// same as the file has them.
pub(super) fn connected(part: &Part, index: usize, welded: &[[u32; 3]], corners: &[[u32; 3]]) -> Vec<Component> {
    let mut sets: Vec<u32> = (0..welded.len() as u32).collect();
    let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(welded.len() * 3);
    for (i, t) in welded.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            if a != b {
                edges.push(([a.min(b), a.max(b)], i as u32));
            }
        }
    }
    edges.sort_unstable();
    for pair in edges.windows(2) {
        if pair[0].0 == pair[1].0 {
            let (a, b) = (root(&mut sets, pair[0].1), root(&mut sets, pair[1].1));
            sets[a.max(b) as usize] = a.min(b);
        }
    }
    let mut order: Vec<(u32, u32)> = (0..welded.len() as u32).map(|i| (root(&mut sets, i), i)).collect();
    order.sort_unstable();
    let pieces = order.chunk_by(|a, b| a.0 == b.0);
    let both = |(_, i): &(u32, u32)| (welded[*i as usize], corners[*i as usize]);
    pieces.filter_map(|piece| component(part, index, piece.iter().map(both))).collect()
}

/// For each position the first index with the same one.
fn weld(positions: &[Vec3]) -> Vec<u32> {
    // Adding zero makes one zero of both.
    let key = |i: u32| positions[i as usize].to_array().map(|v| (v + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (key(i), i));
    let mut weld = vec![0; positions.len()];
    for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
        same.iter().for_each(|&i| weld[i as usize] = same[0]);
    }
    weld
}

fn root(sets: &mut [u32], mut i: u32) -> u32 {
    while sets[i as usize] != i {
        sets[i as usize] = sets[sets[i as usize] as usize];
        i = sets[i as usize];
    }
    i
}

fn component(part: &Part, index: usize, both: impl Iterator<Item = ([u32; 3], [u32; 3])>) -> Option<Component> {
    let at = |i: u32| part.positions[i as usize];
    let (mut triangles, mut corners): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
        both.filter(|(t, _)| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).unzip();
    let mut seen: Vec<([u32; 3], usize)> = triangles
        .iter()
        .enumerate()
        .map(|(i, t)| {
            let mut key = *t;
            key.sort_unstable();
            (key, i)
        })
        .collect();
    seen.sort_unstable();
    let mut keep = vec![true; triangles.len()];
    for pair in seen.windows(2) {
        keep[pair[1].1] = pair[0].0 != pair[1].0;
    }
    for list in [&mut triangles, &mut corners] {
        let mut kept = keep.iter();
        list.retain(|_| kept.next() == Some(&true));
    }
    let mut points = Vec::new();
    let mut known = std::collections::BTreeSet::new();
    for &c in triangles.iter().flatten() {
        if known.insert(c) {
            points.push(c);
        }
    }
    let Sides { open, turned } = sides(&triangles);
    let vectors: Vec<DVec3> = triangles
        .iter()
        .zip(&turned)
        .map(|(t, turned)| {
            let [a, b, c] = t.map(|c| at(c).as_dvec3());
            (b - a).cross(c - a) * if *turned { -0.5 } else { 0.5 }
        })
        .collect();
    let area: f64 = vectors.iter().map(|v| v.length()).sum();
    if !(area > 0.0 && area.is_finite()) {
        return None;
    }
    let sum: DVec3 = vectors.iter().sum();
    let centre = points.iter().map(|&i| at(i).as_dvec3()).sum::<DVec3>() / points.len() as f64;
    let axes = principal(points.iter().map(|&i| at(i).as_dvec3() - centre));
    let extents = axes.map(|axis| {
        let along = points.iter().map(|&i| (at(i).as_dvec3() - centre).dot(axis));
        let (low, high) = along.fold((f64::MAX, f64::MIN), |(low, high), d| (low.min(d), high.max(d)));
        (high - low) as f32
    });
    let facing = (sum.length() / area) as f32;
    let pyramids = triangles.iter().zip(&vectors).map(|(t, v)| (at(t[0]).as_dvec3() - centre).dot(*v) / 3.0);
    let bulk = (pyramids.sum::<f64>().abs() / (area * area.sqrt())) as f32;
    let sheet = (vectors.iter().map(|v| v.dot(axes[2]).abs()).sum::<f64>() / area) as f32;
    let normal = if facing > 0.3 { sum.normalize_or(axes[2]) } else { axes[2] };
    let ends = |(low, high): (Vec3, Vec3), &i: &u32| (low.min(at(i)), high.max(at(i)));
    let (low, high) = points.iter().fold((Vec3::MAX, Vec3::MIN), ends);
    Some(Component {
        part: index,
        triangles,
        corners,
        points,
        open,
        area: area as f32,
        facing,
        sheet,
        bulk,
        normal: normal.as_vec3(),
        centre: centre.as_vec3(),
        axes: axes.map(|a| a.as_vec3()),
        extents,
        low,
        high,
    })
}

/// Which sides the triangles of a piece face.
struct Sides {
    /// Edges of one triangle only.
    open: usize,
    /// Of each triangle whether it faces the other side than the first does, going from neighbour to neighbour.
    turned: Vec<bool>,
}

fn sides(triangles: &[[u32; 3]]) -> Sides {
    // Both ends of an edge in rising order, its triangle, and whether that goes along it so.
    let mut edges: Vec<([u32; 2], u32, bool)> = Vec::with_capacity(triangles.len() * 3);
    for (i, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            edges.push(([a.min(b), a.max(b)], i as u32, a < b));
        }
    }
    edges.sort_unstable();
    let open = edges.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).count();
    let mut turned = vec![false; triangles.len()];
    // Two triangles that face one side go along their edge in opposite directions.
    let pairs: Vec<(u32, u32, bool)> = edges
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|same| match same {
            [a, b] => Some((a.1, b.1, a.2 == b.2)),
            _ => None,
        })
        .collect();
    if pairs.iter().all(|(_, _, unlike)| !unlike) {
        return Sides { open, turned };
    }
    let mut links: Vec<Vec<(u32, bool)>> = vec![Vec::new(); triangles.len()];
    for (a, b, unlike) in pairs {
        links[a as usize].push((b, unlike));
        links[b as usize].push((a, unlike));
    }
    let mut seen = vec![false; triangles.len()];
    for first in 0..triangles.len() as u32 {
        let mut work = vec![first];
        while let Some(i) = work.pop() {
            seen[i as usize] = true;
            for &(next, unlike) in &links[i as usize] {
                if !std::mem::replace(&mut seen[next as usize], true) {
                    turned[next as usize] = turned[i as usize] != unlike;
                    work.push(next);
                }
            }
        }
    }
    Sides { open, turned }
}

/// Principal directions of points about the origin, longest first, right-handed: cyclic Jacobi on their covariance.
fn principal(points: impl Iterator<Item = DVec3>) -> [DVec3; 3] {
    let mut m = [[0.0_f64; 3]; 3];
    for p in points {
        for (i, row) in m.iter_mut().enumerate() {
            for (j, cell) in row.iter_mut().enumerate() {
                *cell += p[i] * p[j];
            }
        }
    }
    let mut v = [DVec3::X, DVec3::Y, DVec3::Z];
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q] == 0.0 {
                continue;
            }
            let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
            let t = if theta >= 0.0 { 1.0 } else { -1.0 } / (theta.abs() + (theta * theta + 1.0).sqrt());
            let t = if t.is_finite() { t } else { 0.0 };
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut m {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (a, b) = (m[p], m[q]);
            m[p] = std::array::from_fn(|k| c * a[k] - s * b[k]);
            m[q] = std::array::from_fn(|k| s * a[k] + c * b[k]);
            (v[p], v[q]) = (v[p] * c - v[q] * s, v[p] * s + v[q] * c);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a: &usize, &b: &usize| m[b][b].total_cmp(&m[a][a]).then(a.cmp(&b)));
    let first = v[order[0]].normalize_or(DVec3::X);
    let second = (v[order[1]] - first * first.dot(v[order[1]])).normalize_or(first.any_orthonormal_vector());
    [first, second, first.cross(second)]
}

impl Component {
    /// Longest extent.
    pub(super) fn length(&self) -> f32 {
        self.extents[0]
    }

    /// Whether it is a sheet, open or two-sided.
    pub(super) fn is_sheet(&self) -> bool {
        self.facing > 0.5 || (self.sheet > 0.85 && self.extents[2] < 0.35 * self.extents[1])
    }

    /// Whether it is a piece of a round tube without its ends, long or short, so that nearly all its triangles are at a rim.
    pub(super) fn is_open_tube(&self) -> bool {
        let [long, middle, short] = self.extents;
        let is_round = middle > 0.8 * long || short > 0.8 * middle;
        is_round
            && self.facing < 0.05
            && self.sheet < 0.7
            && self.open * 5 >= self.triangles.len() * 4
            && self.triangles.len() >= 8
    }

    /// Whether it is a long blade with a thickness, however bent or folded: closed but for a tip or so, with next to nothing
    /// inside.
    pub(super) fn is_blade(&self) -> bool {
        self.bulk < BLADE && self.is_slim()
    }

    /// Whether it is a blade that may be thicker, as it shows nearly all of its area along one direction: no tube or lump
    /// does, whatever its colour, and no twig.
    pub(super) fn is_board(&self) -> bool {
        self.bulk < BOARD && self.sheet > FACED && self.is_slim()
    }

    fn is_slim(&self) -> bool {
        let is_flat = self.area.sqrt() > FLAT * self.bulk * self.length();
        self.open * 8 <= self.triangles.len() && is_flat && self.extents[1] < SLIM * self.length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Part {
        Part {
            positions: positions.iter().map(|p| Vec3::from_array(*p)).collect(),
            triangles: triangles.to_vec(),
            faces: (0..triangles.len() as u32).collect(),
            ..Part::default()
        }
    }

    #[test]
    fn a_quad_without_shared_vertices_is_one_sheet() {
        let quad = part(
            &[[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 0., 0.], [2., 1., 0.], [0., 1., 0.]],
            &[[0, 1, 2], [3, 4, 5]],
        );
        let all = components(&quad, 0);
        assert_eq!(all.len(), 1);
        assert_eq!((all[0].points.len(), all[0].triangles.len(), all[0].open), (4, 2, 4));
        assert!((all[0].area - 2.0).abs() < 1e-6 && (all[0].facing - 1.0).abs() < 1e-6 && all[0].is_sheet());
        assert!((all[0].normal - Vec3::Z).length() < 1e-6 && all[0].extents[2] < 1e-6);
    }

    #[test]
    fn leaves_that_touch_in_a_point_are_apart_and_doubled_ones_count_once() {
        let mesh = part(
            &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [-1., 0., 0.], [0., -1., 0.]],
            &[[0, 1, 2], [0, 3, 4], [2, 1, 0]],
        );
        let all = components(&mesh, 3);
        assert_eq!(all.iter().map(|c| c.triangles.len()).collect::<Vec<_>>(), [1, 1]);
        assert_eq!(all[0].part, 3);
    }

    #[test]
    fn tubes_are_no_sheets() {
        let n = 8_u32;
        let ring = |y: f32, bend: f32| {
            (0..n).map(move |i| {
                let (sin, cos) = crate::base::math::sin_cos(i as f32 / n as f32 * std::f32::consts::TAU);
                [cos * 0.1 + bend, y, sin * 0.1]
            })
        };
        let positions: Vec<[f32; 3]> = ring(0.0, 0.0).chain(ring(1.0, 0.4)).chain(ring(2.0, 1.5)).collect();
        let triangles: Vec<[u32; 3]> = (0..2)
            .flat_map(|r| {
                (0..n).flat_map(move |i| {
                    let (a, b) = (r * n + i, r * n + (i + 1) % n);
                    [[a, a + n, b], [b, a + n, b + n]]
                })
            })
            .collect();
        let tube = &components(&part(&positions, &triangles), 0)[0];
        assert!(!tube.is_sheet() && tube.facing < 0.2, "{} {}", tube.facing, tube.sheet);
    }
}
