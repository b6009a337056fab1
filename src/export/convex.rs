//! Convex hulls of points in space, exact: quickhull (Barber, Dobkin and Huhdanpaa 1996) in whole numbers.
//!
//! Points are rounded to a grid of 2^20 steps along their longest edge. There the side of a plane that a point is on is a
//! sum of products below 2^63, so it is never wrong, whatever is doubled, on a line or in a plane: no tolerance, and the
//! same on every platform. A point that lies in a face's plane does not see it, so no face is without area. The point
//! farthest outside comes next; who stops early has the hull that comes nearest with so many corners. Points that are
//! within a step of one plane get some thickness first.

use std::collections::BTreeMap;

use glam::DVec3;

/// Steps of the grid along the longest edge.
const STEPS: f64 = (1 << 20) as f64;
/// Thickness of what is flat, as a share of its longest edge.
const THIN: f64 = 0.002;

/// A closed convex surface.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Convex {
    /// Its corners; each is a corner of some triangle.
    pub(super) points: Vec<DVec3>,
    /// Counter-clockwise from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

type Grid = [i64; 3];

struct Face {
    corners: [u32; 3],
    /// The faces beyond the edges from each corner to the next.
    beyond: [usize; 3],
    normal: Grid,
    offset: i64,
    length: f64,
    /// Points that it is seen from.
    outside: Vec<u32>,
    /// How far the farthest of them is, in lengths of the normal. Of those that are as far the greatest in order, about
    /// which no other lies.
    far: (i64, Grid, u32),
    is_gone: bool,
}

impl Face {
    fn new(points: &[Grid], corners: [u32; 3]) -> Self {
        let [a, b, c] = corners.map(|i| points[i as usize]);
        let (u, v) = (minus(b, a), minus(c, a));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = DVec3::from_array(normal.map(|n| n as f64)).length();
        let offset = dot(normal, a);
        let far = (0, [0; 3], 0);
        Self { corners, beyond: [usize::MAX; 3], normal, offset, length, outside: Vec::new(), far, is_gone: false }
    }

    /// Keeps a point that it is seen from; whether it is.
    fn keep(&mut self, points: &[Grid], p: u32) -> bool {
        let at = points[p as usize];
        let above = self.above(at);
        if above > 0 {
            self.outside.push(p);
            self.far = self.far.max((above, at, p));
        }
        above > 0
    }

    /// Above zero where a point is outside.
    fn above(&self, p: Grid) -> i64 {
        dot(self.normal, p) - self.offset
    }
}

// Coordinates are below 2^20, so normals are below 2^41 and what is summed here below 2^63.
fn dot(n: Grid, p: Grid) -> i64 {
    n[0] * p[0] + n[1] * p[1] + n[2] * p[2]
}

fn minus(a: Grid, b: Grid) -> Grid {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The hull of some points of at most `most` (four at least) corners, which are some of the points, rounded: where that is fewer than
/// the hull has, points stick out of it, the farthest ones the least. None where no point is finite.
pub(super) fn inner_hull(points: &[DVec3], most: usize) -> Option<Convex> {
    let finite: Vec<DVec3> = points.iter().copied().filter(|p| p.is_finite()).collect();
    let (low, high) =
        finite.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    if finite.is_empty() {
        return None;
    }
    grown(&finite, low, (high - low).max_element(), most).or_else(|| {
        // In one plane, on one line or in one place.
        let thin = ((high - low).max_element() * THIN).max(1e-3);
        let around = |p: &DVec3| {
            let p = *p;
            DVec3::AXES.into_iter().flat_map(move |axis| [p + axis * thin, p - axis * thin])
        };
        let thick: Vec<DVec3> = finite.iter().flat_map(around).collect();
        grown(&thick, low - thin, (high - low).max_element() + 2.0 * thin, most)
    })
}

/// Grows a hull from a tetrahedron; none where the points lie in a plane of the grid.
fn grown(points: &[DVec3], low: DVec3, edge: f64, most: usize) -> Option<Convex> {
    let scale = (STEPS - 1.0) / edge.max(1e-30);
    let grid: Vec<Grid> = points.iter().map(|p| ((*p - low) * scale).round().to_array().map(|v| v as i64)).collect();
    let mut faces = tetrahedron(&grid)?;
    let all = 0..grid.len() as u32;
    for p in all {
        let _ = faces.iter_mut().any(|face| face.keep(&grid, p));
    }
    while corners(&faces) < most.max(4) {
        let Some((from, apex)) = farthest(&faces) else { break };
        add(&mut faces, &grid, from, apex);
    }
    let mut places: BTreeMap<u32, u32> = BTreeMap::new();
    let mut convex = Convex { points: Vec::new(), triangles: Vec::new() };
    for face in faces.iter().filter(|face| !face.is_gone) {
        convex.triangles.push(face.corners.map(|corner| {
            *places.entry(corner).or_insert_with(|| {
                // As they were rounded: the surface is convex with those.
                let [x, y, z] = grid[corner as usize].map(|v| v as f64);
                convex.points.push(low + DVec3::new(x, y, z) / scale);
                convex.points.len() as u32 - 1
            })
        }));
    }
    Some(convex)
}

/// Corners of a closed surface of triangles (Euler).
fn corners(faces: &[Face]) -> usize {
    faces.iter().filter(|face| !face.is_gone).count() / 2 + 2
}

/// Four points that are not in a plane, far from each other, as four faces.
fn tetrahedron(grid: &[Grid]) -> Option<Vec<Face>> {
    let first = (0..grid.len()).min_by_key(|i| grid[*i])?;
    let square = |p: Grid| p.iter().map(|v| (*v as i128) * (*v as i128)).sum::<i128>();
    let cross = |p: Grid, q: Grid| {
        let wide = [p, q].map(|p| p.map(i128::from));
        let [p, q] = wide;
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    };
    let from = |i: usize| minus(grid[i], grid[first]);
    let second = (0..grid.len()).max_by_key(|i| square(from(*i)))?;
    let third = (0..grid.len()).max_by_key(|i| cross(from(second), from(*i)).iter().map(|v| v * v).sum::<i128>())?;
    let base = Face::new(grid, [first, second, third].map(|i| i as u32));
    let fourth = (0..grid.len()).max_by_key(|i| base.above(grid[*i]).unsigned_abs())?;
    let height = base.above(grid[fourth]);
    if height == 0 {
        return None;
    }
    let [a, b, c, d] = [first, second, third, fourth].map(|i| i as u32);
    let (b, c) = if height > 0 { (c, b) } else { (b, c) };
    let mut faces: Vec<Face> = [[a, b, c], [a, c, d], [a, d, b], [b, d, c]].map(|t| Face::new(grid, t)).into();
    let beyond = [[2, 3, 1], [0, 3, 2], [1, 3, 0], [2, 1, 0]];
    faces.iter_mut().zip(beyond).for_each(|(face, beyond)| face.beyond = beyond);
    Some(faces)
}

/// The point that is farthest outside of all, and the face that it is kept at.
fn farthest(faces: &[Face]) -> Option<(usize, u32)> {
    let open = faces.iter().enumerate().filter(|(_, face)| !face.is_gone && face.far.0 > 0);
    let of = |(i, face): (usize, &Face)| (face.far.0 as f64 / face.length, i, face.far.2);
    open.map(of).max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))).map(|(_, face, apex)| (face, apex))
}

/// Takes the faces that a point sees away, and joins what is left to it.
fn add(faces: &mut Vec<Face>, grid: &[Grid], from: usize, apex: u32) {
    let at = grid[apex as usize];
    faces[from].is_gone = true;
    let mut seen = vec![from];
    // Edges between what is seen and what is not: corners, and the face that stays.
    let mut rim: BTreeMap<u32, (u32, usize)> = BTreeMap::new();
    let mut next = 0;
    while next < seen.len() {
        let face = seen[next];
        next += 1;
        for k in 0..3 {
            let beyond = faces[face].beyond[k];
            if faces[beyond].is_gone {
                continue;
            }
            if faces[beyond].above(at) > 0 {
                faces[beyond].is_gone = true;
                seen.push(beyond);
            } else {
                rim.insert(faces[face].corners[k], (faces[face].corners[(k + 1) % 3], beyond));
            }
        }
    }
    let first = faces.len();
    let places: BTreeMap<u32, usize> = rim.keys().copied().zip(first..).collect();
    let before: BTreeMap<u32, usize> = rim.iter().map(|(from, (to, _))| (*to, places[from])).collect();
    for (&from, &(to, beyond)) in &rim {
        let own = places[&from];
        let mut face = Face::new(grid, [from, to, apex]);
        face.beyond = [beyond, places[&to], before[&from]];
        let edge = (0..3).find(|k| faces[beyond].corners[*k] == to).unwrap_or(0);
        faces[beyond].beyond[edge] = own;
        faces.push(face);
    }
    for face in seen {
        for p in std::mem::take(&mut faces[face].outside) {
            let _ = faces[first..].iter_mut().any(|face| face.keep(grid, p));
        }
    }
}

impl Convex {
    /// Unit normal and offset of each triangle.
    pub(super) fn planes(&self) -> impl Iterator<Item = (DVec3, f64)> {
        self.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| self.points[i as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            (normal, normal.dot(a))
        })
    }

    /// The mean of its corners: inside.
    pub(super) fn centre(&self) -> DVec3 {
        self.points.iter().sum::<DVec3>() / self.points.len().max(1) as f64
    }

    /// Cubic metres.
    pub(super) fn volume(&self) -> f64 {
        let centre = self.centre();
        let corner = |i: u32| self.points[i as usize] - centre;
        self.triangles.iter().map(|t| corner(t[0]).cross(corner(t[1])).dot(corner(t[2])) / 6.0).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    /// Closed, wound one way, Euler's formula, convex, every point used.
    fn check(hull: &Convex, about: &str) {
        let mut edges = BTreeMap::new();
        for t in &hull.triangles {
            for (i, j) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let uses = edges.entry((i.min(j), i.max(j))).or_insert((0, 0));
                if i < j { uses.0 += 1 } else { uses.1 += 1 }
            }
        }
        assert!(edges.values().all(|uses| *uses == (1, 1)), "{about}: closed");
        assert_eq!(hull.points.len() + hull.triangles.len(), edges.len() + 2, "{about}: Euler");
        let size = hull.points.iter().fold(0.0_f64, |a, p| a.max(p.abs().max_element()));
        for (normal, offset) in hull.planes() {
            assert!(hull.points.iter().all(|p| normal.dot(*p) <= offset + size * 1e-8), "{about}: convex");
        }
        assert!(hull.volume() > 0.0, "{about}");
    }

    fn cloud(seed: u64, count: u64) -> Vec<DVec3> {
        let seed = Seed::new(seed);
        (0..count).map(|i| (seed.at(i).direction() * seed.at(i).child("r").range(0.2, 5.0)).as_dvec3()).collect()
    }

    #[test]
    fn hulls_of_random_points_are_closed_convex_and_hold_all() {
        for seed in 0..40 {
            let points = cloud(seed, 5 + seed * 17);
            let hull = inner_hull(&points, usize::MAX).unwrap();
            check(&hull, &format!("{seed}"));
            for (normal, offset) in hull.planes() {
                assert!(points.iter().all(|p| normal.dot(*p) <= offset + 1e-4), "{seed}: holds all");
            }
            assert!(hull.points.iter().all(|p| points.iter().any(|q| p.distance(*q) < 2e-5)));
            for most in [4, 8, 20] {
                let few = inner_hull(&points, most).unwrap();
                check(&few, &format!("{seed} of {most}"));
                assert!(few.points.len() <= most && few.volume() <= hull.volume() * 1.000_001);
            }
        }
    }

    #[test]
    fn a_lattice_of_coplanar_and_doubled_points_is_a_box() {
        let mut points = Vec::new();
        for i in 0..5 * 5 * 5 {
            points.extend([DVec3::new((i % 5) as f64, (i / 5 % 5) as f64, (i / 25) as f64); 2]);
        }
        let hull = inner_hull(&points, usize::MAX).unwrap();
        check(&hull, "lattice");
        assert!((hull.volume() - 64.0).abs() < 1e-6);
        for corner in [DVec3::ZERO, DVec3::splat(4.0), DVec3::new(4.0, 0.0, 4.0)] {
            assert!(hull.points.iter().any(|p| p.distance(corner) < 1e-6));
        }
    }

    #[test]
    fn flat_straight_and_single_points_get_some_thickness() {
        let line: Vec<DVec3> = (0..9).map(|i| DVec3::new(1.0, 2.0, 3.0) * f64::from(i)).collect();
        let sheet: Vec<DVec3> = cloud(3, 60).into_iter().map(|p| DVec3::new(p.x, 1.0, p.z)).collect();
        let tilted: Vec<DVec3> = sheet.iter().map(|p| DVec3::new(p.x, p.x + 2.0 * p.z, p.z)).collect();
        for (points, about) in
            [(vec![DVec3::X * 7.0; 3], "a point"), (line, "a line"), (sheet, "a sheet"), (tilted, "a tilted sheet")]
        {
            let hull = inner_hull(&points, usize::MAX).unwrap();
            check(&hull, about);
            for (normal, offset) in hull.planes() {
                assert!(points.iter().all(|p| normal.dot(*p) <= offset + 1e-4), "{about}");
            }
        }
        assert_eq!(inner_hull(&[], 9), None);
        assert_eq!(inner_hull(&[DVec3::NAN, DVec3::INFINITY], 9), None);
        assert!(inner_hull(&[DVec3::NAN, DVec3::ONE], 9).is_some());
    }
}
