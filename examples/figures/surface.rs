//! Mean distance between two surfaces, both ways.

use glam::Vec3;

/// Triangles of a surface, to be measured from; a hierarchy of boxes, split at medians.
pub(crate) struct Surface {
    triangles: Vec<[Vec3; 3]>,
    boxes: Vec<(Vec3, Vec3)>,
}

const LEAF: usize = 4;

impl Surface {
    pub(crate) fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let mut triangles: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let mut boxes =
            vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); (triangles.len() / LEAF + 1).next_power_of_two() * 4];
        sort(&mut triangles, &mut boxes, 0);
        Self { triangles, boxes }
    }

    /// Distance of a point.
    fn distance(&self, p: Vec3) -> f32 {
        self.nearest(p).0
    }

    /// Distance of a point, and a corner of the triangle that is nearest.
    pub(crate) fn nearest(&self, p: Vec3) -> (f32, Vec3) {
        let mut best = (f32::INFINITY, p);
        self.search(p, 0, 0, self.triangles.len(), &mut best);
        (best.0.sqrt(), best.1)
    }

    fn search(&self, p: Vec3, at: usize, first: usize, last: usize, best: &mut (f32, Vec3)) {
        if last - first <= LEAF {
            for &t in &self.triangles[first..last] {
                let square = squared(p, t);
                if square < best.0 {
                    *best = (square, t[0]);
                }
            }
            return;
        }
        let middle = (first + last) / 2;
        let away = |b: usize| {
            let (low, high) = self.boxes[b];
            (low - p).max(p - high).max(Vec3::ZERO).length_squared()
        };
        let (a, b) = (at * 2 + 1, at * 2 + 2);
        let mut ways = [(away(a), a, first, middle), (away(b), b, middle, last)];
        if ways[1].0 < ways[0].0 {
            ways.swap(0, 1);
        }
        for (bound, at, first, last) in ways {
            if bound < best.0 {
                self.search(p, at, first, last, best);
            }
        }
    }

    /// Mean distance of points spread evenly by area over this surface from the other; of those that count.
    pub(crate) fn mean_to(&self, other: &Self, samples: usize, counts: impl Fn(Vec3) -> bool) -> f64 {
        let area = |t: &[Vec3; 3]| f64::from((t[1] - t[0]).cross(t[2] - t[0]).length()) * 0.5;
        let whole: f64 = self.triangles.iter().map(area).sum();
        let step = whole / samples as f64;
        let (mut sum, mut counted, mut count, mut at, mut next) = (0.0, 0_u64, 0_u64, 0.0, step * 0.5);
        for t in &self.triangles {
            at += area(t);
            while next < at {
                // A low-discrepancy pair, folded into the triangle.
                let (u, v) =
                    ((count as f64 * 0.754_877_67).fract() as f32, (count as f64 * 0.569_840_29).fract() as f32);
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let p = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v;
                if counts(p) {
                    sum += f64::from(other.distance(p));
                    counted += 1;
                }
                count += 1;
                next += step;
            }
        }
        sum / counted.max(1) as f64
    }
}

fn sort(triangles: &mut [[Vec3; 3]], boxes: &mut [(Vec3, Vec3)], at: usize) {
    let grow = |b: (Vec3, Vec3), t: &[Vec3; 3]| t.iter().fold(b, |(low, high), &p| (low.min(p), high.max(p)));
    boxes[at] = triangles.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), grow);
    if triangles.len() <= LEAF {
        return;
    }
    let size = boxes[at].1 - boxes[at].0;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let middle = triangles.len() / 2;
    let key = |t: &[Vec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
    triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
    let (low, high) = triangles.split_at_mut(middle);
    sort(low, boxes, at * 2 + 1);
    sort(high, boxes, at * 2 + 2);
}

/// Squared distance of a point from a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
fn squared(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.length_squared();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.length_squared();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (ap - ab * (d1 / (d1 - d3).max(f32::MIN_POSITIVE))).length_squared();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.length_squared();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * (d2 / (d2 - d6).max(f32::MIN_POSITIVE))).length_squared();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6)).max(f32::MIN_POSITIVE);
        return (bp - (c - b) * t).length_squared();
    }
    let whole = (va + vb + vc).max(f32::MIN_POSITIVE);
    (ap - ab * (vb / whole) - ac * (vc / whole)).length_squared()
}
