//! Self-adaptive cages: those beside what of their parent's outline no cage covers are pulled over it (2018, 5.4.1).
//!
//! A parent's outline falls into segments that some child lies at, O, and segments that none does, F. What borders an F
//! segment reaches over it: a child's vertices at O are held, those that follow on along its own outline go to places of F
//! by arc length, and what is left of the child's cage follows by Laplacian deformation (Eq. 1 on a ring). Parents go before
//! children, so what is pulled takes all finer cages with it.
//!
//! What the paper leaves open:
//!
//! - A child beside O_i and one beside O_j both reach over F; each does so to its middle, or they would lie over one another.
//! - Of the children at O_i those reach that lie where F begins; all of a long O_i drawn into F would leave it bare.
//! - A child goes no further over F than [`FARTHEST`] times the arc that it has for it: a twig does not cover half of a crown.
//!   What stays open is left to the flow (`sketch/fill.rs`).
//! - A cage that would get smaller by it, which folds, stays as it is.

use std::ops::Range;

use glam::Vec2;

use super::laplace::extended;
use super::outline::{Edges, Ring};
use super::region::twice_signed_area;

/// How far a child's arc is drawn out along F.
const FARTHEST: f32 = 2.0;
/// Most places that an outline is looked at.
const MOST_PLACES: usize = 512;

/// An end of an F segment: where it is, the nearest place that is covered, and which way F goes on from there.
#[derive(Clone, Copy)]
struct End {
    place: usize,
    forwards: bool,
    /// Half of the segment.
    reach: f32,
}

/// Spreads children over what none of them covers of their parent's outline. `near` is how near to it counts as covered,
/// metres; they go `share` of the way, 0..=1.
pub(super) fn cover(parent: &[Vec2], children: &[Range<usize>], places: &mut [Vec2], share: f32, near: f32) {
    let ring = Ring::new(parent);
    let length = ring.length();
    // All of so small a cage is near.
    if !(length > 6.0 * near && near > 0.0) {
        return;
    }
    let count = ((length / near * 2.0).ceil() as usize).clamp(8, MOST_PLACES);
    let step = length / count as f32;
    let outline: Vec<Vec2> = (0..count).map(|k| ring.at(k as f32 * step)).collect();
    let at: Vec<Vec<bool>> = children.iter().map(|c| lies_at(&places[c.clone()], &outline, near)).collect();
    let mut covered = vec![false; count];
    at.iter().for_each(|at| covered.iter_mut().zip(at).for_each(|(covered, at)| *covered |= at));
    let Some(first) = covered.iter().position(|c| *c) else { return };
    let mut ends: Vec<End> = Vec::new();
    let mut open = 0;
    for k in 1..=count {
        let place = (first + k) % count;
        if !covered[place] {
            open += 1;
            continue;
        }
        let reach = (open + 1) as f32 * step * 0.5;
        if open > 0 && reach >= near {
            ends.push(End { place: (place + count - open - 1) % count, forwards: true, reach });
            ends.push(End { place, forwards: false, reach });
        }
        open = 0;
    }
    if ends.is_empty() {
        return;
    }
    for (child, at) in children.iter().zip(&at) {
        let own: Vec<End> = ends.iter().copied().filter(|end| at[end.place]).collect();
        if own.is_empty() {
            continue;
        }
        let cage = &mut places[child.clone()];
        let held: Vec<bool> = cage.iter().map(|v| is_near(*v, &outline, at, near)).collect();
        if let Some(to) = pulled(cage, held, &own, &ring, step) {
            cage.iter_mut().zip(to).for_each(|(place, to)| *place = place.lerp(to, share));
        }
    }
}

/// Which places of an outline a cage lies at: they are in it, or near to it.
fn lies_at(cage: &[Vec2], outline: &[Vec2], near: f32) -> Vec<bool> {
    let middle = cage.iter().sum::<Vec2>() / cage.len().max(1) as f32;
    let reach = cage.iter().map(|v| v.distance(middle)).fold(0.0, f32::max) + near;
    let mut at: Vec<bool> = outline.iter().map(|p| p.distance_squared(middle) <= reach * reach).collect();
    if !at.contains(&true) {
        return at;
    }
    let edges = Edges::new(cage);
    for (at, p) in at.iter_mut().zip(outline).filter(|(at, _)| **at) {
        let (inside, off) = edges.at(*p);
        *at = inside || off <= near * near;
    }
    at
}

/// Whether a vertex of a cage is near to a part of the outline that its cage lies at.
fn is_near(vertex: Vec2, outline: &[Vec2], at: &[bool], near: f32) -> bool {
    outline.iter().zip(at).any(|(p, at)| *at && p.distance(vertex) <= near)
}

/// A cage that reaches over what is open beside it; none where it would fold.
fn pulled(cage: &[Vec2], mut held: Vec<bool>, ends: &[End], ring: &Ring<'_>, step: f32) -> Option<Vec<Vec2>> {
    let n = cage.len();
    let mut to = cage.to_vec();
    // Where it borders F it stays, so that it is drawn out and not away.
    let anchor = |end: &End| {
        let border = ring.at(end.place as f32 * step);
        (0..n).min_by(|a, b| cage[*a].distance(border).total_cmp(&cage[*b].distance(border))).unwrap_or(0)
    };
    let anchors: Vec<usize> = ends.iter().map(anchor).collect();
    anchors.iter().for_each(|a| held[*a] = true);
    let stays = held.clone();
    for (end, anchor) in ends.iter().zip(anchors) {
        let next = |i: usize| if end.forwards { (i + 1) % n } else { (i + n - 1) % n };
        // What of the cage's outline is free from there on, and how far along each vertex is.
        let mut free: Vec<(usize, f32)> = Vec::new();
        let (mut i, mut arc) = (anchor, 0.0);
        loop {
            let following = next(i);
            arc += cage[i].distance(cage[following]);
            i = following;
            if stays[i] {
                break;
            }
            free.push((i, arc));
        }
        let half = arc * 0.5;
        let along = half.min(end.reach);
        let drawn = end.reach.min(along * FARTHEST);
        let taken = free.iter().take_while(|(_, arc)| *arc <= along).count().max(1);
        for &(vertex, arc) in free.iter().take(taken).filter(|(_, arc)| *arc <= half) {
            if !held[vertex] {
                let way = drawn * (arc / along.max(1e-12)).min(1.0);
                to[vertex] = ring.at(end.place as f32 * step + if end.forwards { way } else { -way });
                held[vertex] = true;
            }
        }
    }
    let fixed: Vec<usize> = (0..n).filter(|i| held[*i]).collect();
    let follows = extended(&laplacian(cage), n, &fixed);
    for (i, own) in follows.chunks_exact(fixed.len()).enumerate().filter(|(i, _)| !held[*i]) {
        to[i] = cage[i] + fixed.iter().zip(own).map(|(k, w)| (to[*k] - cage[*k]) * *w as f32).sum::<Vec2>();
    }
    (to.iter().all(|p| p.is_finite()) && twice_signed_area(&to) >= twice_signed_area(cage)).then_some(to)
}

/// Rows of a closed ring's Laplacian, by the lengths of its edges.
fn laplacian(ring: &[Vec2]) -> Vec<f64> {
    let n = ring.len();
    let edge: Vec<f64> = (0..n).map(|i| f64::from(ring[i].distance(ring[(i + 1) % n]))).collect();
    let least = edge.iter().sum::<f64>() / n.max(1) as f64 * 1e-3;
    let near = |i: usize| 1.0 / edge[i].max(least).max(1e-300);
    let mut rows = vec![0.0; n * n];
    for i in 0..n {
        let (before, after) = (near((i + n - 1) % n), near(i));
        rows[i * n + i] -= 1.0;
        rows[i * n + (i + n - 1) % n] += before / (before + after);
        rows[i * n + (i + 1) % n] += after / (before + after);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math;

    fn round(middle: Vec2, radius: f32) -> Vec<Vec2> {
        let at = |k: usize| math::sin_cos(std::f32::consts::TAU * k as f32 / 12.0);
        (0..12).map(at).map(|(sin, cos)| middle + Vec2::new(cos, sin) * radius).collect()
    }

    /// A parent of 4 by 2 with children in it, which have spread; and how much of its outline they then lie at.
    fn spread(children: &[Vec<Vec2>], share: f32) -> (Vec<Vec<Vec2>>, [f32; 2]) {
        let parent = [Vec2::ZERO, Vec2::X * 4.0, Vec2::new(4.0, 2.0), Vec2::Y * 2.0];
        let mut places = parent.to_vec();
        let mut rings = Vec::new();
        for child in children {
            rings.push(places.len()..places.len() + child.len());
            places.extend(child);
        }
        let outline: Vec<Vec2> = (0..240).map(|k| Ring::new(&parent).at(k as f32 * 0.05)).collect();
        let lies = |places: &[Vec2]| {
            let at: Vec<Vec<bool>> = rings.iter().map(|r| lies_at(&places[r.clone()], &outline, 0.1)).collect();
            (0..outline.len()).filter(|k| at.iter().any(|at| at[*k])).count() as f32 / outline.len() as f32
        };
        let before = lies(&places);
        cover(&parent, &rings, &mut places, share, 0.1);
        assert_eq!(places[..4], parent);
        let after = lies(&places);
        (rings.iter().map(|r| places[r.clone()].to_vec()).collect(), [before, after])
    }

    #[test]
    fn cages_beside_a_gap_reach_over_it_and_stay_where_they_cover() {
        // Two that leave the middle of a wide cage open, above and below.
        let children = [round(Vec2::new(0.9, 1.0), 0.95), round(Vec2::new(3.1, 1.0), 0.95)];
        let (made, [before, after]) = spread(&children, 1.0);
        assert!(after > before + 0.15, "{before} {after}");
        for (was, is) in children.iter().zip(&made) {
            assert!(twice_signed_area(is) > twice_signed_area(was));
            assert!(
                is.iter().all(|p| p.cmpge(Vec2::splat(-0.06)).all() && p.cmple(Vec2::new(4.06, 2.0001)).all()),
                "{is:?}"
            );
            // The far side is covered, and stays.
            let outer = if was[0].x < 2.0 { 6 } else { 0 };
            assert!(was[outer] == is[outer], "{outer}: {is:?}");
        }
        // Each goes to the middle, as its neighbour does.
        for (a, b) in made[0].iter().zip(&made[1]) {
            assert!(a.x < 2.2 && b.x > 1.8, "{a} {b}");
        }
    }

    #[test]
    fn half_of_the_way_is_half_and_none_is_none() {
        let children = [round(Vec2::new(0.9, 1.0), 0.95), round(Vec2::new(3.1, 1.0), 0.95)];
        let [none, half, whole] = [0.0, 0.5, 1.0].map(|share| spread(&children, share).0);
        assert!(none[..] == children[..]);
        for ((a, b), c) in none[0].iter().zip(&half[0]).zip(&whole[0]) {
            assert!(a.midpoint(*c).distance(*b) < 1e-6);
        }
    }

    #[test]
    fn what_is_covered_or_touched_nowhere_stays() {
        let all = [vec![Vec2::ZERO, Vec2::X * 4.0, Vec2::new(4.0, 2.0), Vec2::Y * 2.0]];
        assert!(spread(&all, 1.0).0[..] == all[..]);
        let inside = [round(Vec2::new(2.0, 1.0), 0.5)];
        assert!(spread(&inside, 1.0).0[..] == inside[..]);
    }

    #[test]
    fn a_small_cage_does_not_cover_all_that_is_open_and_odd_ones_stay_finite() {
        let small = round(Vec2::new(0.25, 0.25), 0.25);
        let (made, [before, after]) = spread(std::slice::from_ref(&small), 1.0);
        assert!(after > before && after < 0.4, "{before} {after}");
        let far = made[0].iter().map(|p| p.x.max(p.y)).fold(0.0, f32::max);
        assert!(far < 2.0, "{far}");
        for odd in [vec![Vec2::splat(0.02); 12], vec![Vec2::ZERO, Vec2::X * 0.1, Vec2::X * 0.2]] {
            assert!(spread(&[odd, small.clone()], 1.0).0.iter().flatten().all(|p| p.is_finite()));
        }
    }
}
