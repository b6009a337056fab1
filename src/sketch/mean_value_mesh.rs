//! Mean value coordinates of a point in a closed triangle mesh (Ju, Schaefer and Warren 2005, Fig. 4): the point is the sum
//! of the mesh's vertices by them, and they add up to 1. Defined everywhere; on a triangle they are its own corners'.

use glam::DVec3;

use crate::base::math;

/// Nearer than this share of the mesh's size counts as on a vertex; angles, radians, this near to flat as on a triangle.
const ON: f64 = 1e-9;

/// The coordinates of `p` in a closed mesh, one for each vertex. Triangles are counter-clockwise seen from outside. A mesh
/// without volume gives the mean of its vertices where nothing else is said.
pub(super) fn mean_value_mesh(vertices: &[DVec3], triangles: &[[u32; 3]], p: DVec3) -> Vec<f64> {
    let away: Vec<DVec3> = vertices.iter().map(|v| *v - p).collect();
    let far: Vec<f64> = away.iter().map(|d| d.length()).collect();
    let size = far.iter().copied().fold(0.0, f64::max);
    let only = |set: &[(usize, f64)]| {
        let total: f64 = set.iter().map(|(_, w)| w).sum();
        let mut weights = vec![0.0; vertices.len()];
        set.iter().for_each(|(i, w)| weights[*i] += w / total);
        weights
    };
    if let Some(at) = far.iter().position(|d| *d <= ON * size) {
        return only(&[(at, 1.0)]);
    }
    let unit: Vec<DVec3> = away.iter().zip(&far).map(|(d, length)| *d / *length).collect();
    let mut weights = vec![0.0_f64; vertices.len()];
    for triangle in triangles {
        let t = triangle.map(|i| i as usize);
        // Sides of the spherical triangle; `k`'s lies across from corner `k`.
        let chord: [f64; 3] = std::array::from_fn(|k| (unit[t[(k + 1) % 3]] - unit[t[(k + 2) % 3]]).length() * 0.5);
        let side = chord.map(|c| 2.0 * math::asin64(c.min(1.0)));
        let sine = chord.map(|c| 2.0 * c * (1.0 - c * c).max(0.0).sqrt());
        let half = side.iter().sum::<f64>() * 0.5;
        if std::f64::consts::PI - half < ON {
            let corner = |k: usize| (t[k], sine[k] * far[t[(k + 1) % 3]] * far[t[(k + 2) % 3]]);
            return only(&[corner(0), corner(1), corner(2)]);
        }
        let whole = math::sin64(half);
        let cosine: [f64; 3] = std::array::from_fn(|k| {
            let over = sine[(k + 1) % 3] * sine[(k + 2) % 3];
            2.0 * whole * math::sin64(half - side[k]) / over - 1.0
        });
        let sign = unit[t[0]].dot(unit[t[1]].cross(unit[t[2]])).signum();
        let normal = cosine.map(|c| sign * (1.0 - c * c).max(0.0).sqrt());
        // In the triangle's plane but outside of it: it takes no part.
        if normal.iter().any(|s| s.abs() <= ON || !s.is_finite()) {
            continue;
        }
        for k in 0..3 {
            let (next, last) = ((k + 1) % 3, (k + 2) % 3);
            weights[t[k]] += (side[k] - cosine[next] * side[last] - cosine[last] * side[next])
                / (far[t[k]] * sine[next] * normal[last]);
        }
    }
    let sum: f64 = weights.iter().sum();
    let all: f64 = weights.iter().map(|w| w.abs()).sum();
    if !(sum.is_finite() && sum.abs() > 1e-9 * all) || sum == 0.0 {
        return vec![1.0 / vertices.len().max(1) as f64; vertices.len()];
    }
    weights.iter().map(|w| w / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    /// A cube of edge 2 about the origin.
    fn cube() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|q: &[u32; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        ((0..8).map(corner).collect(), triangles)
    }

    #[test]
    fn points_come_back_inside_and_outside_and_on_the_mesh() {
        let (vertices, triangles) = cube();
        let place = |axis: u64, i: u64| f64::from(Seed::new(axis).at(i).range(-1.6, 1.6));
        let mut points: Vec<DVec3> = (0..200).map(|i| DVec3::new(place(1, i), place(2, i), place(3, i))).collect();
        points.extend([vertices[3], DVec3::new(0.3, -0.2, 1.0), DVec3::new(1.0, 0.5, 1.0), DVec3::ZERO]);
        for p in points {
            let weights = mean_value_mesh(&vertices, &triangles, p);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{p}");
            let back: DVec3 = vertices.iter().zip(&weights).map(|(v, w)| *v * *w).sum();
            assert!(back.distance(p) < 1e-6, "{p} {back}");
            if p.abs().max_element() < 1.0 {
                assert!(weights.iter().all(|w| *w > 0.0), "{p} {weights:?}");
            }
        }
    }

    #[test]
    fn a_vertex_is_its_own_and_a_mesh_without_volume_gives_finite_weights() {
        let (vertices, triangles) = cube();
        let weights = mean_value_mesh(&vertices, &triangles, vertices[5]);
        assert!(weights[5] == 1.0 && weights.iter().sum::<f64>() == 1.0);
        for flat in [DVec3::new(1.0, 1.0, 0.0), DVec3::X, DVec3::ZERO] {
            let vertices: Vec<DVec3> = vertices.iter().map(|v| *v * flat).collect();
            for p in [DVec3::splat(0.3), DVec3::new(0.3, 0.2, 0.0), DVec3::X * 3.0] {
                assert!(mean_value_mesh(&vertices, &triangles, p).iter().all(|w| w.is_finite()), "{flat} {p}");
            }
        }
    }
}
