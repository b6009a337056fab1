//! Splitting and merging by points (2017 CAVW, 6.1): of a chain that is shared, each kin is a copy, and the points of a
//! copy have weights of their own.
//!
//! With the share `t` of the second source the copy is cut at arc length `1 − t`. Above the cut points have the weight
//! `t`. Below it a split has `b·t` and a merge `min(1, (2 − b)·t)`, with a coefficient `b` in 0..=1 that is proportional
//! to the arc-length parameter `s`. Taken as `b = s` the base would stand still to the end and jump there, and the weight
//! would jump at the cut. So `b = s + t`, which is 1 at the cut, and at every point when `t` is 1. A copy leaves what it
//! shares tip first, as a zip opens; one that joins lies down base first.
//!
//! Each point is turned about the base by the share of the turn that its weight says, so that a copy bends away and is
//! not squeezed. Kins that are fed by two sources only; the others run evenly.

use glam::Vec3;

use super::family::NONE;
use super::kernel::{Blender, Feed};
use super::place::{measure, stretch};
use super::turns::turn_of;
use super::weights::Run;
use crate::plant::ChainId;

/// The weight of the second source at arc-length parameter `s`, when its share of the chain is `t`.
#[must_use]
pub fn point_weight(run: Run, s: f32, t: f32) -> f32 {
    if s > 1.0 - t {
        return t;
    }
    let b = s + t;
    match run {
        Run::Even => t,
        Run::Split => b * t,
        Run::Merge => ((2.0 - b) * t).min(1.0),
    }
}

impl Blender<'_> {
    /// Places a kin whose shares run along it; false where they don't.
    pub(super) fn place_by_points(&mut self, k: usize) -> bool {
        let family = self.family;
        let (run, row) = (self.runs[k], family.row(k));
        if run == Run::Even || self.feeds[k] != Feed::Several || family.units.is_some() {
            return false;
        }
        let sources = family.plants.len();
        let mut fed = (0..sources).filter(|&s| row[s].chain != NONE && self.shares[k * sources + s] > 0.0);
        let (Some(a), Some(b), None) = (fed.next(), fed.next(), fed.next()) else { return false };
        let t = self.shares[k * sources + b];
        let (start, len) = (family.blocks[k].0 as usize, family.blocks[k].1 as usize);
        let place_of = |source: usize| (0..source).filter(|&s| row[s].chain != NONE).count();
        let block = |source: usize| {
            let at = (start + place_of(source) * len) * 4;
            &family.shapes[at..at + 4 * len]
        };
        let (own, other) = (block(a), block(b));
        let first = self.first[k] as usize;
        let degree = self.grown[k];
        self.len[k] = len as u32;
        self.location[k] = self.own_location(k);
        let sharers = [a, b].map(|source| self.sharer(k, source));
        let thick = |source: usize, j: usize, share: f32| {
            let sharer = sharers[usize::from(source == b)].as_ref();
            sharer.map_or(share, |sharer| sharer.thickness(family.slots[start + j], share))
        };
        let mut shares = vec![0.0_f32; sources];
        let mut point = |j: usize| {
            let w = point_weight(run, family.slots[start + j], t);
            (shares[a], shares[b]) = (1.0 - w, w);
            let at = |block: &[f32]| Vec3::new(block[j], block[len + j], block[2 * len + j]);
            let turn = turn_of(row, &shares, &family.order);
            let radius = own[3 * len + j] * thick(a, j, 1.0 - w) + other[3 * len + j] * thick(b, j, w);
            (turn.rotate(at(own) * (1.0 - w) + at(other) * w), radius, w)
        };
        let (tip, _, w) = point(len - 1);
        let far = |block: &[f32]| Vec3::new(block[len - 1], block[2 * len - 1], block[3 * len - 1]).length();
        let scale = degree * stretch(far(own) * (1.0 - w) + far(other) * w, tip.length());
        for j in 0..len {
            let (at, radius, _) = point(j);
            self.points[first + j] = at * scale;
            self.linear[first + j] = radius * degree;
        }
        let w = point_weight(run, 0.0, t);
        let origin = |source: usize| family.plants[source].chain(ChainId(row[source].chain)).origin;
        self.origin[k] = origin(a) * (1.0 - w) + origin(b) * w;
        measure(&self.points[first..first + len], &mut self.parameters[first..first + len]);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_run_from_nothing_to_all_and_never_jump() {
        for run in [Run::Split, Run::Merge] {
            for i in 0..=20 {
                let s = i as f32 / 20.0;
                assert_eq!((point_weight(run, s, 0.0), point_weight(run, s, 1.0)), (0.0, 1.0));
                let mut last = 0.0;
                for k in 0..=1000 {
                    let w = point_weight(run, s, k as f32 / 1000.0);
                    assert!((0.0..=1.0).contains(&w) && w + 1e-6 >= last && w - last < 0.004, "{run:?} {s} {k}");
                    last = w;
                }
            }
        }
    }

    #[test]
    fn a_split_starts_at_the_tip_and_a_merge_at_the_base() {
        for t in [0.2, 0.5, 0.8] {
            assert!(point_weight(Run::Split, 0.0, t) < t && point_weight(Run::Merge, 0.0, t) > t);
            assert_eq!((point_weight(Run::Split, 1.0, t), point_weight(Run::Merge, 1.0, t)), (t, t));
            let cut = 1.0 - t;
            assert!((point_weight(Run::Split, cut, t) - t).abs() < 1e-6);
            assert!((point_weight(Run::Merge, cut, t) - t).abs() < 1e-6);
        }
    }
}
