//! The polygon of at most eight corners that a card is cut out to.
//!
//! The smallest octagon around the content whose edges run along the axes and the diagonals of the card (a k-DOP with
//! k = 8; Klosowski et al. 1998): convex by construction, so that a fan of triangles fills it.

use glam::Vec2;

/// Corners, counter-clockwise with y up, of the octagon around some points; empty where they have no area.
pub(super) fn octagon(points: impl Iterator<Item = Vec2>) -> Vec<Vec2> {
    // Largest x, x + y, y, y - x, -x, -x - y, -y, x - y.
    let mut reach = [f32::NEG_INFINITY; 8];
    for p in points {
        for (r, d) in reach.iter_mut().zip(DIRECTIONS) {
            *r = r.max(d.dot(p));
        }
    }
    if !reach.iter().all(|r| r.is_finite()) || reach[0] + reach[4] <= 0.0 || reach[2] + reach[6] <= 0.0 {
        return Vec::new();
    }
    let mut corners: Vec<Vec2> = Vec::with_capacity(8);
    let least = (reach[0] + reach[4] + reach[2] + reach[6]) * 0.01;
    for i in 0..8 {
        let j = (i + 1) % 8;
        let (a, b) = (DIRECTIONS[i], DIRECTIONS[j]);
        let corner = Vec2::new(reach[i] * b.y - reach[j] * a.y, a.x * reach[j] - b.x * reach[i]) / a.perp_dot(b);
        // A cut that takes nothing off leaves two corners at one place.
        if corners.last().is_none_or(|c| c.distance(corner) > least) {
            corners.push(corner);
        }
    }
    while corners.len() > 3 && corners[0].distance(corners[corners.len() - 1]) <= least {
        corners.pop();
    }
    corners
}

const DIRECTIONS: [Vec2; 8] = [
    Vec2::new(1.0, 0.0),
    Vec2::new(1.0, 1.0),
    Vec2::new(0.0, 1.0),
    Vec2::new(-1.0, 1.0),
    Vec2::new(-1.0, 0.0),
    Vec2::new(-1.0, -1.0),
    Vec2::new(0.0, -1.0),
    Vec2::new(1.0, -1.0),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, math};

    #[test]
    fn an_octagon_holds_its_points_and_turns_left() {
        for i in 0..200 {
            let seed = Seed::new(2).at(i);
            let points: Vec<Vec2> =
                (0..20).map(|k| Vec2::new(seed.at(k).unit(), seed.at(k + 50).unit() * 0.6)).collect();
            let corners = octagon(points.iter().copied());
            assert!((4..=8).contains(&corners.len()));
            for k in 0..corners.len() {
                let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
                assert!(points.iter().all(|p| (b - a).perp_dot(*p - a) > -0.02));
            }
        }
    }

    #[test]
    fn a_disc_gets_eight_corners_and_a_square_four() {
        let disc = (0..64).map(|i| math::sin_cos(i as f32 * 0.1)).map(|(s, c)| Vec2::new(c, s));
        assert_eq!(octagon(disc).len(), 8);
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vec2::new(x, y));
        assert_eq!(octagon(square.into_iter()).len(), 4);
    }

    #[test]
    fn points_without_an_area_give_nothing() {
        assert!(octagon(std::iter::empty()).is_empty());
        assert!(octagon([Vec2::ONE; 3].into_iter()).is_empty());
        assert!(octagon([Vec2::NAN, Vec2::ONE].into_iter()).is_empty());
    }
}
