//! Triangles of a small polygon by cutting off ears (Meisters 1975).
//!
//! Of all ears the best-shaped is cut first, so that few slivers are left. Cubic in corners at worst: for outlines of a
//! few dozen, made once a picture.

use glam::Vec2;

/// Triangles of a simple polygon whose corners run counter-clockwise, as indices of its corners, wound likewise: two fewer
/// than corners. None where the polygon crosses itself, or has corners in one place or on one line.
pub(super) fn ears(polygon: &[Vec2]) -> Option<Vec<[u32; 3]>> {
    let mut left: Vec<usize> = (0..polygon.len()).collect();
    let mut triangles = Vec::with_capacity(left.len().saturating_sub(2));
    while left.len() >= 3 {
        let count = left.len();
        let corner = |i: usize| [(i + count - 1) % count, i, (i + 1) % count].map(|k| left[k]);
        let best = (0..count)
            .filter_map(|i| {
                let at = corner(i);
                let [a, b, c] = at.map(|k| polygon[k]);
                let double_area = (b - a).perp_dot(c - a);
                let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
                // Height over the longest edge.
                let shape = double_area / longest.max(f32::MIN_POSITIVE);
                let is_free = || left.iter().all(|k| at.contains(k) || !holds([a, b, c], polygon[*k]));
                (shape > 1e-4 && is_free()).then_some((shape, i))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        triangles.push(corner(best.1).map(|k| k as u32));
        left.remove(best.1);
    }
    (polygon.len() >= 3 && triangles.len() + 2 == polygon.len()).then_some(triangles)
}

/// Whether a counter-clockwise triangle holds a point, its edges included.
fn holds([a, b, c]: [Vec2; 3], p: Vec2) -> bool {
    [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).perp_dot(p - *from) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, math};

    fn area(polygon: &[Vec2]) -> f32 {
        let next = polygon.iter().cycle().skip(1);
        polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>() * 0.5
    }

    #[test]
    fn triangles_of_random_stars_cover_them_once() {
        for seed in 0..200 {
            let seed = Seed::new(seed);
            let count = 3 + seed.child("count").index(20);
            let star: Vec<Vec2> = (0..count)
                .map(|k| {
                    let (sin, cos) = math::sin_cos(std::f32::consts::TAU * k as f32 / count as f32);
                    Vec2::new(cos, sin) * seed.at(k as u64).range(0.2, 1.0)
                })
                .collect();
            let triangles = ears(&star).expect("a star is simple");
            assert_eq!(triangles.len(), count - 2);
            let each = |t: &[u32; 3]| {
                let area = area(&t.map(|k| star[k as usize]));
                assert!(area > 0.0);
                area
            };
            let sum: f32 = triangles.iter().map(each).sum();
            assert!((sum - area(&star)).abs() < 1e-5, "{sum} {}", area(&star));
        }
    }

    #[test]
    fn what_is_no_polygon_has_no_triangles() {
        let of = |points: &[(f32, f32)]| ears(&points.iter().map(|p| Vec2::new(p.0, p.1)).collect::<Vec<_>>());
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[(0.0, 0.0), (1.0, 0.0)]), None);
        assert_eq!(of(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]), None);
        // Clockwise, crossing itself, and not a number.
        assert_eq!(of(&[(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)]), None);
        assert_eq!(of(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]), None);
        assert_eq!(of(&[(0.0, 0.0), (1.0, f32::NAN), (1.0, 1.0)]), None);
        assert_eq!(of(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]).map(|t| t.len()), Some(2));
    }
}
