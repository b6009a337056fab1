//! Mean value coordinates of a point in a cage (Ju, Schaefer and Warren 2005; in the plane Floater 2003, and for cages of
//! several rings Hormann and Floater 2006): the point is the sum of the cage's vertices by them, and they add up to 1.
//!
//! `w_i = (tan(α_{i-1}/2) + tan(α_i/2)) / |v_i - p|`, with α_i the signed angle at p of the edge from vertex i to the
//! next, and `tan(α/2) = (|a||b| - a·b) / (a × b)`, which keeps its digits for small angles. They are defined in the
//! whole plane, positive inside a convex cage, and may be negative in a concave one. On an edge the point's own place along
//! it counts, at a vertex that vertex alone.

use glam::{DVec2, Vec2};

/// Nearer than this share of the cage's size to an edge counts as on it.
const ON: f64 = 1e-9;

/// The coordinates of `p` in a cage of some rings, one for each vertex in their order; counter-clockwise areas, clockwise
/// holes. Without a vertex there are none; a cage without area gives the mean of its vertices.
#[must_use]
pub fn mean_value(rings: &[&[Vec2]], p: Vec2) -> Vec<f32> {
    let count: usize = rings.iter().map(|ring| ring.len()).sum();
    let mut weights = vec![0.0_f64; count];
    let p = p.as_dvec2();
    let away: Vec<DVec2> = rings.iter().flat_map(|ring| ring.iter().map(|v| v.as_dvec2() - p)).collect();
    let size = away.iter().map(|d| d.length()).fold(0.0, f64::max);
    let mut first = 0;
    for ring in rings {
        let n = ring.len();
        for i in 0..n {
            let (i, j) = (first + i, first + (i + 1) % n);
            let (a, b) = (away[i], away[j]);
            let (la, lb) = (a.length(), b.length());
            if la <= ON * size {
                return only(count, &[(i, 1.0)]);
            }
            let (cross, dot) = (a.perp_dot(b), a.dot(b));
            if cross.abs() <= ON * size * (b - a).length() {
                if dot <= 0.0 && la + lb > 0.0 {
                    return only(count, &[(i, lb / (la + lb)), (j, la / (la + lb))]);
                }
                // In line with the edge, but not on it: its angle is nothing.
                continue;
            }
            let half = (la * lb - dot) / cross;
            weights[i] += half / la;
            weights[j] += half / lb;
        }
        first += n;
    }
    let sum: f64 = weights.iter().sum();
    if !(sum.is_finite() && sum.abs() > 1e-12 * weights.iter().map(|w| w.abs()).sum::<f64>()) || sum == 0.0 {
        return vec![1.0 / count.max(1) as f32; count];
    }
    weights.iter().map(|w| (w / sum) as f32).collect()
}

fn only(count: usize, set: &[(usize, f64)]) -> Vec<f32> {
    let mut weights = vec![0.0; count];
    set.iter().for_each(|&(i, w)| weights[i] += w as f32);
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn at(rings: &[&[Vec2]], weights: &[f32]) -> Vec2 {
        rings.iter().flat_map(|r| r.iter()).zip(weights).map(|(v, w)| *v * *w).sum()
    }

    const SQUARE: [Vec2; 4] = [Vec2::ZERO, Vec2::new(2.0, 0.0), Vec2::new(2.0, 2.0), Vec2::new(0.0, 2.0)];
    const HOLE: [Vec2; 4] = [Vec2::new(0.5, 0.5), Vec2::new(0.5, 1.5), Vec2::new(1.5, 1.5), Vec2::new(1.5, 0.5)];

    #[test]
    fn the_middle_of_a_square_is_a_quarter_of_each_corner() {
        for w in mean_value(&[&SQUARE], Vec2::ONE) {
            assert!((w - 0.25).abs() < 1e-6);
        }
    }

    #[test]
    fn corners_and_edges_are_their_own() {
        assert_eq!(mean_value(&[&SQUARE], SQUARE[2]), [0.0, 0.0, 1.0, 0.0]);
        assert_eq!(mean_value(&[&SQUARE], Vec2::new(0.5, 0.0)), [0.75, 0.25, 0.0, 0.0]);
    }

    #[test]
    fn points_come_back_in_convex_concave_and_pierced_cages_and_outside() {
        let arrow = [Vec2::ZERO, Vec2::new(2.0, 0.0), Vec2::new(0.6, 0.6), Vec2::new(0.0, 2.0)];
        let cages: [&[&[Vec2]]; 3] = [&[&SQUARE], &[&arrow], &[&SQUARE, &HOLE]];
        for rings in cages {
            for i in 0..300 {
                let p = Vec2::new(Seed::new(1).at(i).range(-1.0, 3.0), Seed::new(2).at(i).range(-1.0, 3.0));
                let weights = mean_value(rings, p);
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-3, "{p}");
                let large = weights.iter().fold(1.0_f32, |m, w| m.max(w.abs()));
                assert!(at(rings, &weights).distance(p) < 2e-5 * large.max(1.0) * 4.0, "{p} {rings:?}");
            }
        }
    }

    #[test]
    fn a_concave_cage_has_a_known_weight_below_zero_and_a_convex_one_has_none() {
        // Behind the dent of an arrow head its tip counts against the point.
        let arrow = [Vec2::ZERO, Vec2::new(4.0, 2.0), Vec2::new(0.0, 4.0), Vec2::new(2.0, 2.0)];
        let weights = mean_value(&[&arrow], Vec2::new(0.05, 0.06));
        assert!(weights.iter().any(|w| *w < 0.0), "{weights:?}");
        for i in 0..100 {
            let p = Vec2::new(Seed::new(1).at(i).range(0.0, 2.0), Seed::new(2).at(i).range(0.0, 2.0));
            assert!(mean_value(&[&SQUARE], p).iter().all(|w| *w >= 0.0));
        }
    }

    #[test]
    fn a_hole_pulls_what_lies_beside_it() {
        // Moving the hole's ring only moves a point at its edge with it, and hardly one at the outer edge.
        let rings: [&[Vec2]; 2] = [&SQUARE, &HOLE];
        let shift = |p: Vec2| {
            let w = mean_value(&rings, p);
            w[4..].iter().sum::<f32>()
        };
        assert!(shift(Vec2::new(0.49, 1.0)) > 0.95 && shift(Vec2::new(0.01, 1.0)).abs() < 0.1);
    }

    #[test]
    fn odd_cages_give_finite_weights() {
        let line = [Vec2::ZERO, Vec2::X, Vec2::X * 2.0];
        for rings in [&[&line[..]][..], &[&line[..1]], &[&[Vec2::ZERO; 5][..]], &[]] {
            assert!(mean_value(rings, Vec2::new(0.3, 0.7)).iter().all(|w| w.is_finite()));
        }
    }
}
