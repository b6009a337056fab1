//! Polygons to triangles.
//!
//! Triangles and convex polygons become fans. Others lose ears (Meisters 1975) in the plane of their normal (Newell's
//! sum): at each step a corner that turns the polygon's way and whose triangle holds no other corner. What has no ear
//! left (a polygon that crosses itself) is fanned, as is everything once the work allowed for a file is used up: cutting
//! ears costs up to the cube of the corners, and a file may be one huge star.

use glam::{Vec2, Vec3};

use crate::base::counted;

/// Cuts polygons; keeps its buffers and what work is left.
#[derive(Debug)]
pub(super) struct Cutter {
    corners: Vec<Vec2>,
    left: Vec<u32>,
    /// Corner tests that may still be made.
    work: u64,
    /// Polygons that were fanned although they are concave.
    pub(super) fanned: usize,
}

impl Cutter {
    /// For a file of so many bytes.
    pub(super) fn for_file(bytes: usize) -> Self {
        Self { corners: Vec::new(), left: Vec::new(), work: 1_000_000 + 20 * bytes as u64, fanned: 0 }
    }

    /// What is told of the polygons that were fanned; nothing where none was.
    pub(super) fn note(&self) -> Option<String> {
        let what = counted(self.fanned, "polygon that crosses itself", "polygons that cross themselves");
        (self.fanned > 0).then(|| format!("{what} cut as {}", if self.fanned == 1 { "a fan" } else { "fans" }))
    }

    /// The triangles of a polygon of `n` corners by their numbers; always `n - 2`, in the polygon's turn.
    pub(super) fn cut(&mut self, n: usize, point: impl Fn(usize) -> Vec3, mut triangle: impl FnMut([u32; 3])) {
        let convex = n <= 3 || self.project(n, point);
        let n = n as u32;
        if !convex {
            self.ears(&mut triangle);
            return;
        }
        (2..n).for_each(|i| triangle([0, i - 1, i]));
    }

    /// Lays the polygon into its plane, turning left; whether it is convex (or has no plane).
    fn project(&mut self, n: usize, point: impl Fn(usize) -> Vec3) -> bool {
        let base = point(0);
        let mut normal = Vec3::ZERO;
        for i in 1..n - 1 {
            normal += (point(i) - base).cross(point(i + 1) - base);
        }
        let size = normal.abs();
        if !(size.max_element() > 0.0 && size.is_finite()) {
            return true;
        }
        // Dropping the largest coordinate of the normal keeps the shape's turns, which is all that counts.
        self.corners.clear();
        let flat = |p: Vec3| match (size.x >= size.y && size.x >= size.z, size.y >= size.z) {
            (true, _) => (Vec2::new(p.y, p.z), normal.x),
            (_, true) => (Vec2::new(p.z, p.x), normal.y),
            _ => (Vec2::new(p.x, p.y), normal.z),
        };
        self.corners.reserve_exact(n);
        for i in 0..n {
            let (q, sign) = flat(point(i) - base);
            self.corners.push(if sign < 0.0 { Vec2::new(-q.x, q.y) } else { q });
        }
        let c = &self.corners;
        // Slack for polygons that are not quite plane: one corner barely turning the other way needs no ears.
        let slack = -1e-6 * size.max_element();
        (0..n).all(|i| turn(c[i], c[(i + 1) % n], c[(i + 2) % n]) >= slack)
    }

    fn ears(&mut self, triangle: &mut impl FnMut([u32; 3])) {
        self.left.clear();
        self.left.reserve_exact(self.corners.len());
        self.left.extend(0..self.corners.len() as u32);
        let mut at = 0;
        let mut tried = 0;
        while self.left.len() > 3 {
            let n = self.left.len();
            let (i, j, k) = (at % n, (at + 1) % n, (at + 2) % n);
            self.work = self.work.saturating_sub(n as u64);
            if tried > n || self.work == 0 {
                self.fanned += 1;
                break;
            }
            if self.is_ear(i, j, k) {
                triangle([self.left[i], self.left[j], self.left[k]]);
                self.left.remove(j);
                // The corner before may have become an ear; going on from it keeps triangles from being slivers only.
                at = if j < i { i - 1 } else { i };
                tried = 0;
            } else {
                at = (at + 1) % n;
                tried += 1;
            }
        }
        let left = &self.left;
        (2..left.len()).for_each(|i| triangle([left[0], left[i - 1], left[i]]));
    }

    fn is_ear(&self, i: usize, j: usize, k: usize) -> bool {
        let corner = |n: usize| self.corners[self.left[n] as usize];
        let (a, b, c) = (corner(i), corner(j), corner(k));
        if turn(a, b, c) <= 0.0 {
            return false;
        }
        (0..self.left.len()).filter(|n| ![i, j, k].contains(n)).all(|n| {
            let p = corner(n);
            // Corners may repeat where a hole is joined to the outline; such twins don't block.
            p == a || p == b || p == c || turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0
        })
    }
}

/// Twice the signed area of a triangle, positive for a left turn.
fn turn(a: Vec2, b: Vec2, c: Vec2) -> f32 {
    (b - a).perp_dot(c - b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn area(points: &[Vec3], triangles: &[[u32; 3]]) -> (f32, f32) {
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| points[i as usize]);
            (b - a).cross(c - a).z * 0.5
        };
        (triangles.iter().map(of).sum(), triangles.iter().map(|t| of(t).abs()).sum())
    }

    fn cut(points: &[Vec3]) -> (Vec<[u32; 3]>, usize) {
        let mut cutter = Cutter::for_file(1000);
        let mut out = Vec::new();
        cutter.cut(points.len(), |i| points[i], |t| out.push(t));
        (out, cutter.fanned)
    }

    #[test]
    fn concave_polygons_keep_their_area_and_no_triangle_turns_over() {
        for n in 4..60_u64 {
            // A star around the origin: simple, and concave nearly always.
            let points: Vec<Vec3> = (0..n)
                .map(|i| {
                    let angle = i as f32 / n as f32 * std::f32::consts::TAU;
                    let r = 0.2 + Seed::new(n).child("r").at(i).unit();
                    Vec3::new(crate::base::math::cos(angle) * r, crate::base::math::sin(angle) * r, 0.0)
                })
                .collect();
            let (triangles, fanned) = cut(&points);
            assert_eq!((triangles.len() as u64, fanned), (n - 2, 0));
            let outline: f32 = (0..points.len())
                .map(|i| points[i].truncate().perp_dot(points[(i + 1) % points.len()].truncate()) * 0.5)
                .sum();
            let (signed, unsigned) = area(&points, &triangles);
            assert!((signed - outline).abs() < 1e-4 && (unsigned - outline).abs() < 1e-4, "{n}: {signed} {outline}");
        }
    }

    #[test]
    fn an_arrow_is_cut_across_its_notch() {
        let arrow = [(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
        for turned in 0..4 {
            let mut points = arrow;
            points.rotate_left(turned);
            let (triangles, _) = cut(&points);
            let (signed, unsigned) = area(&points, &triangles);
            assert!((signed - 1.0).abs() < 1e-6 && (unsigned - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_huge_tangle_is_fanned_in_bounded_work() {
        let points: Vec<Vec3> =
            (0..20_000).map(|i| Vec3::new(Seed::new(1).at(i).unit(), Seed::new(2).at(i).unit(), 0.0)).collect();
        let (triangles, fanned) = cut(&points);
        assert_eq!((triangles.len(), fanned), (19_998, 1));
    }
}
