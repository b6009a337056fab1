//! How much nearer to an axis the faces of a surface are than its vertices.
//!
//! A ring of many sides has its faces where its vertices are; those of a box are a fifth nearer on average. Where the trunk
//! itself is that coarse, the faces are the tree, and a radius is the mean distance of the surface (Au et al. 2008, section
//! 6); elsewhere tools sweep rings about the axis that they mean, and a twig of three sides has the radius of its corners.

use glam::DVec3;

use super::surface::Surface;

/// The share of the vertices' distance below which a trunk's faces are the tree: between those of five sides, 0.88, and of
/// six, 0.91.
pub(super) const COARSE: f64 = 0.894;
/// Triangles that are looked at.
const SAMPLE: usize = 2_000;
/// Parts that a triangle's edge is cut into.
const PARTS: u32 = 4;
/// Cosine between a face and the axis from which it is a cap.
const CAP: f64 = 0.7;
/// From how far out, in radii, a face is not the axis' own.
const COLLAR: f64 = 1.5;

/// The mean distance of the faces from their axis, as a share of that of their corners; 1 where there is nothing to tell it
/// by. `home` tells each vertex' node, and `line` place, direction and radius of the axis there.
pub(super) fn share(surface: &Surface, home: &[u32], line: impl Fn(usize) -> Option<(DVec3, DVec3, f64)>) -> f64 {
    let step = surface.triangles.len() / SAMPLE + 1;
    let (mut faces, mut corners) = (0.0, 0.0);
    for t in surface.triangles.iter().step_by(step) {
        let at = t.map(|v| Some((surface.positions[v as usize], line(*home.get(v as usize)? as usize)?)));
        let [Some(a), Some(b), Some(c)] = at else { continue };
        // Each corner from its own place on the axis, and what lies between from between, so that a bend is none.
        let ways = [a, b, c].map(|(p, (middle, ..))| p - middle);
        let along = a.1.1;
        let off = |d: DVec3| (d - along * d.dot(along)).length();
        let far = ways.iter().zip([a, b, c]).any(|(&d, (_, (.., radius)))| off(d) > radius * COLLAR);
        let cross = (b.0 - a.0).cross(c.0 - a.0);
        let area = cross.length();
        if far || cross.dot(along).abs() > area * CAP {
            continue;
        }
        let [a, b, c] = ways;
        corners += (off(a) + off(b) + off(c)) / 3.0 * area;
        faces += within(a, b, c).map(off).sum::<f64>() / f64::from(PARTS * PARTS) * area;
    }
    if faces > 0.0 && corners > 0.0 { (faces / corners).min(1.0) } else { 1.0 }
}

/// The middles of the small triangles that a triangle is cut into.
fn within(a: DVec3, b: DVec3, c: DVec3) -> impl Iterator<Item = DVec3> {
    let n = f64::from(PARTS);
    let at = move |u: f64, v: f64| a + (b - a) * (u / n) + (c - a) * (v / n);
    (0..PARTS).flat_map(move |i| {
        (0..PARTS - i).flat_map(move |j| {
            let (i, j) = (f64::from(i), f64::from(j));
            let upright = Some(at(i + 1.0 / 3.0, j + 1.0 / 3.0));
            let turned = (i + j + 2.0 <= n).then(|| at(i + 2.0 / 3.0, j + 2.0 / 3.0));
            [upright, turned].into_iter().flatten()
        })
    })
}

/// The mean distance of a stretch from `a` to `b` from a point.
pub(super) fn mean_distance(middle: DVec3, a: DVec3, b: DVec3) -> f64 {
    let Some(along) = (b - a).try_normalize() else { return middle.distance(a) };
    let (from, to) = ((a - middle).dot(along), (b - middle).dot(along));
    let away = ((a - middle) - along * from).length();
    // The integral of the root of away squared and t squared; there is no logarithm where the stretch leads outwards.
    let integral = |t: f64| {
        let (side, t) = (t.signum(), t.abs());
        let far = (away * away + t * t).sqrt();
        let rest = if away > t * 1e-9 { away * away * crate::base::math::ln64((t + far) / away) } else { 0.0 };
        side * 0.5 * (t * far + rest)
    };
    (integral(to) - integral(from)) / (to - from)
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;

    #[test]
    fn the_faces_of_a_box_are_a_fifth_nearer_than_its_corners_and_those_of_a_pipe_are_not() {
        for (sides, right) in [(3, 0.690), (4, 0.8116), (5, 0.8759), (6, 0.9125), (24, 0.9943)] {
            let path: Vec<DVec3> = (0..6).map(|k| DVec3::Y * f64::from(k)).collect();
            let tube = shapes::tube(&path, &[0.5, 0.45, 0.4, 0.35, 0.3, 0.25], sides);
            let homes: Vec<u32> = (0..tube.positions.len() as u32).map(|v| v / sides).collect();
            let found = share(&tube, &homes, |k| Some((path[k], DVec3::Y, 0.5 - 0.05 * k as f64)));
            assert!((found - right).abs() < 0.01, "{sides} {found}");
            let ring = &tube.positions[..sides as usize];
            let whole: f64 =
                (0..ring.len()).map(|k| mean_distance(DVec3::ZERO, ring[k], ring[(k + 1) % ring.len()])).sum();
            assert!((whole / f64::from(sides) / 0.5 - right).abs() < 0.001, "{sides}");
        }
        assert_eq!(share(&Surface::default(), &[], |_| None), 1.0);
    }
}
