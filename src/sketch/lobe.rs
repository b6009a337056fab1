//! Surfaces of lobes: how what lies in a lobe follows its cage (2018, 5.3, steps 2 and 3).
//!
//! A lobe is a closed surface whose silhouette is its cage: over the cage's plane it rises as an ellipsoid does, as deep as
//! what it holds, to both sides alike. When the cage changes, the surface follows by Laplacian deformation with cotangent
//! weights, the cage's vertices held (Eq. 1); places in the lobe follow the surface by mean value coordinates in the mesh.
//! Both are linear, so that a place's coordinates in the surface, times how the surface follows, are its weights of the
//! cage's own vertices: found once, and a frame does no more than with the cage alone.
//!
//! Eq. 1 is solved for each coordinate by itself, and a view's cages don't move along the view: a lobe keeps its depth
//! wherever a sketch takes its silhouette. Surfaces are their own mirror images in the cage's plane, so half of one is solved for.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::laplace::extended;
use super::mean_value_mesh::mean_value_mesh;

/// Depth of the parallel between silhouette and pole over the pole's, and its width over the silhouette's: at 45 degrees.
const PARALLEL: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Least half depth of a lobe over the reach of its cage: leaves in one plane make no surface.
const THICK: f64 = 0.25;

/// The surface of a lobe, bound to its cage.
#[derive(Clone, Debug)]
pub(super) struct LobeSurface {
    /// Silhouette, front parallel, front pole, back parallel, back pole; depth is along z.
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// For silhouette, parallel and pole their weights of the cage's vertices.
    follows: Vec<f64>,
    sides: usize,
}

impl LobeSurface {
    /// The surface over a convex cage, counter-clockwise, between two depths.
    pub(super) fn over(cage: &[Vec2], [near, far]: [f32; 2]) -> Self {
        let n = cage.len();
        let cage: Vec<DVec2> = cage.iter().map(|v| v.as_dvec2()).collect();
        let middle = cage.iter().sum::<DVec2>() / n.max(1) as f64;
        let reach = cage.iter().map(|v| v.distance(middle)).fold(0.0, f64::max);
        let (near, far) = (f64::from(near), f64::from(far));
        let (depth, half) = ((near + far) * 0.5, ((far - near).abs() * 0.5).max(reach * THICK));
        let mut vertices: Vec<DVec3> = cage.iter().map(|v| v.extend(depth)).collect();
        for side in [1.0, -1.0] {
            let on = |v: &DVec2| middle.lerp(*v, PARALLEL).extend(depth + side * half * PARALLEL);
            vertices.extend(cage.iter().map(on));
            vertices.push(middle.extend(depth + side * half));
        }
        let front = Self::shell(n, n);
        let follows = follows(&vertices, &front, n);
        let back = Self::shell(n, 2 * n + 1).into_iter().map(|[a, b, c]| [a, c, b]);
        let triangles = front.iter().copied().chain(back).collect();
        Self { vertices, triangles, follows, sides: n }
    }

    /// Triangles of one half, whose parallel starts at a vertex; outwards where it lies in front.
    fn shell(n: usize, parallel: usize) -> Vec<[u32; 3]> {
        let pole = parallel + n;
        let of = |k: usize| {
            let next = (k + 1) % n;
            [[k, next, parallel + next], [k, parallel + next, parallel + k], [parallel + k, parallel + next, pole]]
        };
        (0..n).flat_map(of).map(|t| t.map(|i| i as u32)).collect()
    }

    /// How a place in the lobe follows the cage: a weight for each vertex; they add up to 1. `p` is in the view's plane, with
    /// its depth as z.
    pub(super) fn weights(&self, p: Vec3) -> Vec<f32> {
        let n = self.sides;
        let mut weights = vec![0.0; n];
        let coordinates = mean_value_mesh(&self.vertices, &self.triangles, p.as_dvec3());
        for (vertex, w) in coordinates.into_iter().enumerate() {
            // The back follows as the front does.
            let half = if vertex > 2 * n { vertex - n - 1 } else { vertex };
            let own = &self.follows[half * n..][..n];
            weights.iter_mut().zip(own).for_each(|(weight, follows)| *weight += w * follows);
        }
        weights.into_iter().map(|w| w as f32).collect()
    }
}

/// How silhouette, parallel and pole of a surface follow its silhouette, by the triangles of one half: `n` weights a vertex.
fn follows(vertices: &[DVec3], half: &[[u32; 3]], n: usize) -> Vec<f64> {
    let count = 2 * n + 1;
    let mut rows = vec![0.0; count * count];
    for triangle in half {
        let t = triangle.map(|i| i as usize);
        for k in 0..3 {
            let (i, j) = (t[(k + 1) % 3], t[(k + 2) % 3]);
            let (a, b) = (vertices[i] - vertices[t[k]], vertices[j] - vertices[t[k]]);
            let cotangent = (a.dot(b) / a.cross(b).length().max(1e-300)).clamp(1e-3, 1e3);
            rows[i * count + j] += cotangent;
            rows[j * count + i] += cotangent;
        }
    }
    // Of unit sum. A vertex of the silhouette has its neighbours of this half twice over, which is the same row; what is
    // not on the silhouette stands for its mirror image too.
    for (i, row) in rows.chunks_exact_mut(count).enumerate() {
        let sum: f64 = row.iter().sum::<f64>().max(1e-300);
        let counts = if i < n { 1.0 } else { std::f64::consts::SQRT_2 };
        row.iter_mut().for_each(|w| *w *= counts / sum);
        row[i] = -counts;
    }
    extended(&rows, count, &(0..n).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math;

    fn cage(n: usize) -> Vec<Vec2> {
        let at = |k: usize| math::sin_cos(std::f32::consts::TAU * (k as f32 + 0.5) / n as f32);
        (0..n).map(at).map(|(sin, cos)| Vec2::new(3.0 + 2.0 * cos, 1.0 + sin)).collect()
    }

    /// Where a place is when its cage has moved.
    fn moved(surface: &LobeSurface, was: &[Vec2], p: Vec3, to: impl Fn(Vec2) -> Vec2) -> Vec2 {
        let shift = surface.weights(p).iter().zip(was).map(|(w, v)| (to(*v) - *v) * *w).sum::<Vec2>();
        p.truncate() + shift
    }

    #[test]
    fn surfaces_are_closed_and_face_outwards() {
        let LobeSurface { vertices, triangles, .. } = LobeSurface::over(&cage(12), [-1.0, 3.0]);
        let mut edges = std::collections::BTreeMap::new();
        let mut volume = 0.0;
        for t in &triangles {
            (0..3).for_each(|k| *edges.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1);
            let [a, b, c] = t.map(|i| vertices[i as usize]);
            volume += a.dot(b.cross(c)) / 6.0;
        }
        assert!(edges.iter().all(|((a, b), count)| *count == 1 && edges.contains_key(&(*b, *a))));
        // Below an ellipsoid's of these half axes, above that of its octahedron.
        let axes = 2.0 * 1.0 * 2.0;
        assert!(volume > 4.0 / 3.0 * axes && volume < 4.0 / 3.0 * std::f64::consts::PI * axes, "{volume}");
    }

    #[test]
    fn what_lies_in_a_lobe_goes_with_its_cage() {
        let was = cage(12);
        let surface = LobeSurface::over(&was, [-1.0, 1.0]);
        for p in [Vec3::new(3.0, 1.0, 0.0), Vec3::new(4.0, 1.2, 0.4), Vec3::new(1.8, 0.8, -0.5)] {
            assert!((surface.weights(p).iter().sum::<f32>() - 1.0).abs() < 1e-5);
            // All of it goes along; its mirror image in the cage's plane goes the same way.
            let away = moved(&surface, &was, p, |v| v + Vec2::new(0.4, -0.3));
            assert!(away.distance(p.truncate() + Vec2::new(0.4, -0.3)) < 1e-5);
            let wide = |p| moved(&surface, &was, p, |v| Vec2::new(3.0 + (v.x - 3.0) * 1.5, v.y));
            assert!(wide(p).distance(wide(p * Vec3::new(1.0, 1.0, -1.0))) < 1e-5);
            // Wider by a half: so is what lies inside, about.
            let grown = (wide(p).x - 3.0, (p.x - 3.0) * 1.5);
            assert!((grown.0 - grown.1).abs() < 0.15 && (wide(p).y - p.y).abs() < 0.02, "{grown:?}");
        }
        // A vertex of the cage is its own.
        let at = was[2].extend(0.0);
        assert!(moved(&surface, &was, at, |v| if v == was[2] { v * 2.0 } else { v }).distance(was[2] * 2.0) < 1e-4);
    }

    #[test]
    fn a_pull_at_one_side_is_felt_there_most() {
        let was = cage(12);
        let surface = LobeSurface::over(&was, [-1.0, 1.0]);
        let pull = |p: Vec3| moved(&surface, &was, p, |v| if v.x > 4.5 { v + Vec2::X } else { v }).x - p.x;
        let felt: Vec<f32> = (0..9).map(|i| pull(Vec3::new(1.4 + 0.4 * i as f32, 1.0, 0.0))).collect();
        assert!(felt[1..].windows(2).all(|pair| pair[1] > pair[0]), "{felt:?}");
        assert!(felt[8] > 0.6 && felt[..2].iter().all(|f| f.abs() < 0.01), "{felt:?}");
    }

    #[test]
    fn odd_lobes_give_finite_weights() {
        for (cage, depth) in [
            (vec![Vec2::ONE; 12], [0.0, 0.0]),
            (cage(12), [1.0, 1.0]),
            (vec![Vec2::ZERO, Vec2::X, Vec2::X * 2.0], [0.0, 1.0]),
        ] {
            let surface = LobeSurface::over(&cage, depth);
            for p in [Vec3::ONE, Vec3::ZERO, Vec3::new(9.0, -3.0, 0.2)] {
                let weights = surface.weights(p);
                assert!(weights.iter().all(|w| w.is_finite()), "{weights:?}");
            }
        }
    }
}
