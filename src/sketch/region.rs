//! A region of the plane: polygons with holes, their union and what they have in common.
//!
//! Polygons are clipped by i_overlay, a sweep in whole numbers: exact whatever crosses, and the same on every platform
//! (Vatti 1992 is what the paper names; results are the same). Its grid is 2^30 steps over the box of what is given.
//!
//! Rings run counter-clockwise round areas and clockwise round holes, y up; the first point follows the last.

use glam::{DVec2, Vec2};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::simplify::SimplifyShape;
use i_overlay::float::single::SingleFloatOverlay;

use crate::base::Seed;

/// Pairs of edges that are looked at for crossings.
const LOOKS: u64 = 1 << 18;

/// About how often the edges of some rings cross: exactly where they are few, else by pairs drawn by lot, with the same lots
/// each time. Clipping takes time and memory by it.
#[must_use]
pub(super) fn crossings(rings: &[Vec<Vec2>]) -> usize {
    let edges = |ring: &Vec<Vec2>| {
        let next = ring.iter().cycle().skip(1);
        ring.iter().zip(next).map(|(a, b)| [a.as_dvec2(), b.as_dvec2()]).collect::<Vec<_>>()
    };
    let edges: Vec<[DVec2; 2]> = rings.iter().flat_map(edges).collect();
    let cross = |i: usize, j: usize| {
        let ([a, b], [c, d]) = (edges[i], edges[j]);
        let side = |from: DVec2, to: DVec2, p: DVec2| (to - from).perp_dot(p - from);
        side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
    };
    let count = edges.len();
    let pairs = count as u64 * (count as u64).saturating_sub(1) / 2;
    if pairs <= LOOKS {
        return (0..count).map(|i| (0..i).filter(|&j| cross(i, j)).count()).sum();
    }
    let seed = Seed::new(0).child("crossings");
    let lots = (0..LOOKS).filter(|&k| cross(seed.at(2 * k).index(count), seed.at(2 * k + 1).index(count)));
    (lots.count() as u64 * pairs / LOOKS) as usize
}

type Contours = Vec<Vec<[f32; 2]>>;

/// Which places a path fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// Those that it winds round.
    NonZero,
    /// Those that it winds round an odd number of times.
    EvenOdd,
}

/// Polygons with holes, none of which overlap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Region {
    /// The rings of each piece, the outer one first.
    pieces: Vec<Vec<Vec<Vec2>>>,
}

impl Region {
    /// What some rings fill; they may cross themselves and each other.
    #[must_use]
    pub fn of(rings: &[Vec<Vec2>], fill: Fill) -> Self {
        let rings: Contours = rings.iter().filter(|ring| ring.len() > 2).map(|ring| contour(ring)).collect();
        if rings.is_empty() {
            return Self::default();
        }
        let rule = if fill == Fill::EvenOdd { FillRule::EvenOdd } else { FillRule::NonZero };
        Self::from_shapes(rings.simplify_shape(rule))
    }

    /// The union with another.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        if other.pieces.is_empty() {
            return self.clone();
        }
        Self::from_shapes(self.contours().overlay(&other.contours(), OverlayRule::Union, FillRule::NonZero))
    }

    /// The union of many.
    #[must_use]
    pub fn union_of(regions: &[Self]) -> Self {
        let all: Contours = regions.iter().flat_map(Self::contours).collect();
        if all.is_empty() { Self::default() } else { Self::from_shapes(all.simplify_shape(FillRule::NonZero)) }
    }

    /// What both have in common.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        if self.pieces.is_empty() || other.pieces.is_empty() {
            return Self::default();
        }
        Self::from_shapes(self.contours().overlay(&other.contours(), OverlayRule::Intersect, FillRule::NonZero))
    }

    /// How many pieces that don't touch.
    #[must_use]
    pub fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// All rings, those of one piece after the other.
    #[must_use]
    pub fn rings(&self) -> Vec<&[Vec2]> {
        self.pieces.iter().flatten().map(Vec::as_slice).collect()
    }

    /// The outer ring of the largest piece; empty where there is none.
    #[must_use]
    pub fn outline(&self) -> &[Vec2] {
        let largest = |a: &&Vec<Vec<Vec2>>, b: &&Vec<Vec<Vec2>>| piece_area(a).total_cmp(&piece_area(b));
        self.pieces.iter().max_by(largest).and_then(|piece| piece.first()).map_or(&[], Vec::as_slice)
    }

    /// Its area.
    #[must_use]
    pub fn area(&self) -> f32 {
        self.pieces.iter().map(|piece| piece_area(piece)).sum::<f64>() as f32
    }

    /// The area of its largest piece.
    #[must_use]
    pub fn largest(&self) -> f32 {
        self.pieces.iter().map(|piece| piece_area(piece)).fold(0.0, f64::max) as f32
    }

    /// Lower left and upper right corner; both zero where it is empty.
    #[must_use]
    pub fn bounds(&self) -> [Vec2; 2] {
        let points = self.pieces.iter().flatten().flatten();
        let (low, high) = points.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        if low.is_finite() { [low, high] } else { [Vec2::ZERO; 2] }
    }

    /// Every point `p` at `p * scale + shift`.
    #[must_use]
    pub fn moved(&self, scale: Vec2, shift: Vec2) -> Self {
        let ring = |ring: &Vec<Vec2>| ring.iter().map(|p| *p * scale + shift).collect();
        Self { pieces: self.pieces.iter().map(|piece| piece.iter().map(ring).collect()).collect() }
    }

    /// With its image in the y axis.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let flip = |ring: &&[Vec2]| ring.iter().rev().map(|p| Vec2::new(-p.x, p.y)).collect::<Vec<_>>();
        let image: Vec<Vec<Vec2>> = self.rings().iter().map(flip).collect();
        self.union(&Self::of(&image, Fill::NonZero))
    }

    fn contours(&self) -> Contours {
        self.pieces.iter().flatten().map(|ring| contour(ring)).collect()
    }

    fn from_shapes(shapes: Vec<Contours>) -> Self {
        let ring = |ring: Vec<[f32; 2]>| ring.into_iter().map(Vec2::from_array).collect();
        let mut pieces: Vec<Vec<Vec<Vec2>>> =
            shapes.into_iter().map(|shape| shape.into_iter().map(ring).collect()).collect();
        pieces.retain(|piece: &Vec<Vec<Vec2>>| piece_area(piece) > 0.0);
        Self { pieces }
    }
}

fn contour(ring: &[Vec2]) -> Vec<[f32; 2]> {
    ring.iter().map(|p| p.to_array()).collect()
}

/// Twice the signed area of a ring, positive counter-clockwise.
pub(super) fn twice_signed_area(ring: &[Vec2]) -> f64 {
    let Some(&origin) = ring.first() else { return 0.0 };
    let next = ring.iter().skip(1).chain(ring.first());
    ring.iter().zip(next).map(|(a, b)| (*a - origin).as_dvec2().perp_dot((*b - origin).as_dvec2())).sum()
}

fn piece_area(piece: &[Vec<Vec2>]) -> f64 {
    let mut rings = piece.iter().map(|ring| twice_signed_area(ring).abs() * 0.5);
    let outer = rings.next().unwrap_or(0.0);
    outer - rings.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f32, y: f32, edge: f32) -> Vec<Vec2> {
        vec![Vec2::new(x, y), Vec2::new(x + edge, y), Vec2::new(x + edge, y + edge), Vec2::new(x, y + edge)]
    }

    #[test]
    fn clipping_gives_the_areas_of_the_hand_made_cases() {
        let a = Region::of(&[square(0.0, 0.0, 2.0)], Fill::NonZero);
        let b = Region::of(&[square(1.0, 1.0, 2.0)], Fill::NonZero);
        assert!((a.intersection(&b).area() - 1.0).abs() < 1e-5 && (a.union(&b).area() - 7.0).abs() < 1e-5);
        // A concave U, cut across its arms: two pieces.
        let u: Vec<Vec2> = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
            .map(|(x, y)| Vec2::new(x as f32, y as f32))
            .to_vec();
        let u = Region::of(&[u], Fill::NonZero);
        let bar = Region::of(
            &[vec![Vec2::new(-1.0, 2.0), Vec2::new(2.5, 2.0), Vec2::new(2.5, 4.0), Vec2::new(-1.0, 4.0)]],
            Fill::NonZero,
        );
        let cut = u.intersection(&bar);
        assert_eq!(cut.pieces(), 2);
        assert!((cut.area() - 1.5).abs() < 1e-5 && (cut.largest() - 1.0).abs() < 1e-5);
        // A frame and a square in its hole: nothing.
        let frame = Region::of(&[square(0.0, 0.0, 8.0), square(2.0, 2.0, 4.0)], Fill::EvenOdd);
        assert!((frame.area() - 48.0).abs() < 1e-4);
        let within = Region::of(&[square(2.5, 2.5, 3.0)], Fill::NonZero);
        assert_eq!(frame.intersection(&within).area(), 0.0);
        let over = Region::of(&[square(1.0, 1.0, 2.0)], Fill::NonZero);
        assert!((frame.intersection(&over).area() - 3.0).abs() < 1e-5);
    }

    /// Lines to and fro, as many across others.
    fn hatched(lines: usize) -> Vec<Vec<Vec2>> {
        let to_and_fro = |turn: bool| {
            let corners = (0..lines).flat_map(|i| {
                let (y, ends) = ((i as f32 + 0.5) / lines as f32, [0.0, 1.0]);
                ends.map(|x| if i % 2 == 0 { x } else { 1.0 - x })
                    .map(|x| if turn { Vec2::new(y, x) } else { Vec2::new(x, y) })
            });
            corners.collect()
        };
        vec![to_and_fro(false), to_and_fro(true)]
    }

    #[test]
    fn crossings_are_counted_or_nearly_so() {
        assert_eq!(crossings(&[square(0.0, 0.0, 2.0), square(1.0, 1.0, 2.0)]), 2);
        for lines in [100_usize, 1000] {
            let found = crossings(&hatched(lines)) as f32;
            let known = (lines * lines) as f32;
            assert!((found / known - 1.0).abs() < 0.05, "{lines}: {found}");
        }
        let round: Vec<Vec2> = (0..5000).map(|i| Vec2::from_angle(i as f32 / 5000.0 * std::f32::consts::TAU)).collect();
        assert_eq!(crossings(&[round]), 0);
    }

    #[test]
    fn empty_regions_are_no_trouble() {
        let none = Region::default();
        assert_eq!(none.union(&none).area() + none.intersection(&none).area() + none.mirrored().largest(), 0.0);
        assert!(none.outline().is_empty() && none.bounds() == [Vec2::ZERO; 2]);
        assert_eq!(Region::of(&[vec![Vec2::ZERO; 9]], Fill::NonZero), none);
    }

    #[test]
    fn a_mirrored_region_is_its_own_image() {
        let a = Region::of(&[square(0.5, 0.0, 2.0)], Fill::NonZero).mirrored();
        assert!((a.area() - 8.0).abs() < 1e-4 && a.pieces() == 2);
    }
}
