//! The nearest wood to a point: a bounding volume hierarchy over pieces.
//!
//! A hierarchy and not a grid, since a hostile or just sparse file may put its pieces anywhere: a grid's empty cells are
//! then most of the search. Built by median splits, so its depth is the logarithm of the number of pieces. A search
//! weighs at most [`MOST_CANDIDATES`] pieces, nearest boxes first.

use glam::DVec3;

use super::piece::Piece;

/// Pieces in a leaf.
const LEAF: usize = 4;
/// Most pieces that one search weighs.
const MOST_CANDIDATES: usize = 1024;

#[derive(Clone, Copy, Debug)]
struct Volume {
    low: DVec3,
    high: DVec3,
    /// Largest radius inside.
    radius: f64,
    first: u32,
    last: u32,
    /// Index of the second half's volume, the first one's follows its parent; 0 for a leaf.
    second: u32,
}

/// Pieces by place.
#[derive(Debug)]
pub(super) struct Nearest {
    volumes: Vec<Volume>,
    items: Vec<u32>,
}

impl Nearest {
    /// Sorts pieces into a hierarchy: n log n.
    pub(super) fn new(pieces: &[Piece]) -> Self {
        let mut items: Vec<u32> = (0..pieces.len() as u32).collect();
        let mut volumes = Vec::with_capacity(pieces.len() / 2 + 1);
        if !items.is_empty() {
            build(pieces, &mut items, 0, &mut volumes);
        }
        Self { volumes, items }
    }

    /// The piece with the least cost. `cost` gets a piece's index and returns none for pieces that don't qualify; it
    /// must not be below the distance to the piece's surface, nor below `share` of that to its axis.
    pub(super) fn find(&self, p: DVec3, share: f64, mut cost: impl FnMut(u32) -> Option<f64>) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let mut left = MOST_CANDIDATES;
        let bound = |v: &Volume| {
            let distance = (v.low - p).max(p - v.high).max(DVec3::ZERO).length();
            (distance - v.radius).max(distance * share)
        };
        let mut stack = vec![0_u32];
        while let Some(at) = stack.pop() {
            let Some(volume) = self.volumes.get(at as usize) else { continue };
            if best.is_some_and(|(_, least)| bound(volume) >= least) {
                continue;
            }
            if volume.second == 0 {
                for &item in &self.items[volume.first as usize..volume.last as usize] {
                    let Some(value) = cost(item) else { continue };
                    if best.is_none_or(|(_, least)| value < least) {
                        best = Some((item, value));
                    }
                    left -= 1;
                    if left == 0 {
                        return best;
                    }
                }
            } else {
                let (a, b) = (at + 1, volume.second);
                let nearer = bound(&self.volumes[a as usize]) <= bound(&self.volumes[b as usize]);
                stack.extend(if nearer { [b, a] } else { [a, b] });
            }
        }
        best
    }
}

fn build(pieces: &[Piece], items: &mut [u32], first: usize, volumes: &mut Vec<Volume>) {
    let here = volumes.len();
    let mut volume = Volume {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
        radius: 0.0,
        first: first as u32,
        last: (first + items.len()) as u32,
        second: 0,
    };
    for &i in &*items {
        let piece = &pieces[i as usize];
        volume.low = volume.low.min(piece.start).min(piece.end);
        volume.high = volume.high.max(piece.start).max(piece.end);
        volume.radius = volume.radius.max(piece.radius);
    }
    volumes.push(volume);
    if items.len() <= LEAF {
        return;
    }
    let size = volume.high - volume.low;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = items.len() / 2;
    let key = |i: u32| pieces[i as usize].start[axis] + pieces[i as usize].end[axis];
    items.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    let (low, high) = items.split_at_mut(middle);
    // The selection leaves each half in an order that depends on its steps only, and those on the data only.
    build(pieces, low, first, volumes);
    volumes[here].second = volumes.len() as u32;
    build(pieces, high, first + middle, volumes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn the_nearest_piece_is_found_among_many() {
        let seed = Seed::new(7);
        let pieces: Vec<Piece> = (0..300)
            .map(|i| {
                let start = seed.at(i).direction().as_dvec3() * 4.0;
                let end = start + seed.at(1000 + i).direction().as_dvec3() * 0.3;
                Piece::stretch(start, end, 0.01)
            })
            .collect();
        let nearest = Nearest::new(&pieces);
        for k in 0..50 {
            let p = seed.at(5000 + k).direction().as_dvec3() * 4.1;
            let distance = |i: u32| pieces[i as usize].distance(p);
            let (found, cost) = nearest.find(p, 0.3, |i| (i % 3 != 0).then(|| distance(i))).unwrap();
            let truth = (0..300).filter(|i| i % 3 != 0).map(distance).fold(f64::MAX, f64::min);
            assert_eq!(distance(found), truth);
            assert_eq!(cost, truth);
        }
        assert!(Nearest::new(&[]).find(DVec3::ZERO, 0.3, |_| Some(1.0)).is_none());
    }
}
