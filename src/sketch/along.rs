//! On the way: in-between crowns are held against the interpolated silhouette, and their rims give way.
//!
//! The paper asks that in-betweens resemble the straight interpolation of the crown's silhouette and the sketched one, and
//! measures it by the discrete Fréchet distance (2018, 6, Fig. 11). Points that go straight ways come near it, but a lobe
//! that lies behind the rim now and at it later, or a branch that wilts, leaves a dent. So at [`KEYS`] times the crown is
//! looked at as it is then, and lobes at its rim move by what the rim is off, as at the end (`sketch/trim.rs`); the round
//! that comes nearest by that distance is kept, so no key is worse than straight ways. Between keys the corrections follow
//! a spline through them, and there is none at either end.
//!
//! Limits: the front view only. Some rounds of drawing the whole tree for each key, so only animations ask for it.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::crown::{CLOSE, Crown};
use super::outline::{discrete_frechet, resampled};
use super::raster::{Grid, Mask};
use super::region::{Fill, Region};
use super::sketched::Sketched;
use super::spine::Guided;
use super::stem::Leads;
use super::trim::{Depths, between, give_way};
use crate::plant::Plant;

/// Times between the ends at which crowns are looked at.
const KEYS: usize = 7;
/// Rounds at most.
const ROUNDS: usize = 2;
/// Places of an outline.
const PLACES: usize = 240;
/// Cells along the longest edge.
const CELLS: usize = 120;

/// How points move beside their straight ways, at [`KEYS`] times.
#[derive(Clone, Debug, Default)]
pub(super) struct Along(Vec<Vec<Vec3>>);

impl Along {
    /// For a tree that is drawn; `shares` is how far its sketch differs from the crown about each handle, 0..=1.
    pub(super) fn of(sketched: &Sketched, told: &[Vec3], shares: &[f32]) -> Self {
        let (from, to) = (outline(sketched, &sketched.sketcher.plant), outline(sketched, &sketched.straight(1.0)));
        let same = shares.iter().all(|share| *share <= 1e-6);
        if same || from.is_empty() || to.is_empty() || sketched.sketcher.leaves.is_empty() {
            return Self::default();
        }
        let key = |k: usize| {
            let t = (k + 1) as f32 / (KEYS + 1) as f32;
            let reference: Vec<Vec2> = from.iter().zip(&to).map(|(a, b)| a.lerp(*b, t)).collect();
            correction(sketched, told, t, &reference, shares)
        };
        Self((0..KEYS).into_par_iter().map(key).collect())
    }

    /// Where a point is beside its straight way at a time.
    pub(super) fn at(&self, point: usize, weights: &[f32; KEYS]) -> Vec3 {
        self.0
            .iter()
            .zip(weights)
            .fold(Vec3::ZERO, |sum, (shift, w)| if *w == 0.0 { sum } else { sum + shift[point] * *w })
    }

    /// How much of each key's correction there is at a time: a Catmull-Rom spline through keys, zero at the ends.
    pub(super) fn weights(t: f32) -> [f32; KEYS] {
        let mut weights = [0.0; KEYS];
        let at = t.clamp(0.0, 1.0) * (KEYS + 1) as f32;
        let i = (at as usize).min(KEYS);
        let f = at - i as f32;
        let spline = [
            f * (-0.5 + f * (1.0 - 0.5 * f)),
            1.0 + f * f * (1.5 * f - 2.5),
            f * (0.5 + f * (2.0 - 1.5 * f)),
            f * f * (0.5 * f - 0.5),
        ];
        for (knot, weight) in (i as isize - 1..).zip(spline) {
            // Knot 0 and knot KEYS + 1 are the ends.
            if let Some(weights) = usize::try_from(knot - 1).ok().and_then(|key| weights.get_mut(key)) {
                *weights = weight;
            }
        }
        weights
    }
}

/// The outline of a tree's crown in the first view, as places; empty where it has none.
fn outline(sketched: &Sketched, plant: &Plant) -> Vec<Vec2> {
    let posed = plant.pose();
    let silhouette = Crown::of(plant, &posed).map(|crown| crown.silhouette(&sketched.sketcher.charts[0].plane));
    silhouette.filter(|ring| ring.len() > 2).map_or_else(Vec::new, |ring| resampled(&ring, PLACES))
}

/// The correction at a time, which brings the crown's outline nearer to a reference.
fn correction(sketched: &Sketched, told: &[Vec3], t: f32, reference: &[Vec2], shares: &[f32]) -> Vec<Vec3> {
    let sketcher = &*sketched.sketcher;
    let chart = &sketcher.charts[0];
    let target = Region::of(&[reference.to_vec()], Fill::NonZero);
    let bounds = target.bounds();
    let margin = (bounds[1] - bounds[0]).max_element() * 0.12 + sketcher.reach;
    let grid = Grid::over(bounds, CELLS, margin);
    let drawn = Depths::of(&Mask::of_region(&target, grid));
    // Stems go straight to where they are led.
    let guided = Guided { leads: Leads::NONE, ..sketched.guided.clone() };
    let mut wish: Vec<Vec3> = told.iter().map(|told| *told * t).collect();
    let straight = sketcher.spines.moved(&sketcher.positions, &wish, &guided);
    let mut aside = vec![Vec3::ZERO; sketcher.positions.len()];
    let mut best = (f32::INFINITY, aside.clone());
    for round in 0..=ROUNDS {
        let plant = sketched.made(&|i| sketched.shift[i] * t + aside[i], t, false);
        let posed = plant.pose();
        let Some(crown) = Crown::of(&plant, &posed) else { break };
        let distance = discrete_frechet(&resampled(&crown.silhouette(&chart.plane), PLACES), reference);
        if distance >= best.0 {
            break;
        }
        best = (distance, aside.clone());
        if round == ROUNDS {
            break;
        }
        let covered = Depths::covered(&crown.seen(&chart.plane), grid, sketcher.size * CLOSE);
        let handles = wish.iter_mut().zip(&sketcher.handles).zip(&sketcher.on).zip(shares);
        for (((wish, handle), (point, f)), share) in handles {
            let place = handle.position + between(&sketched.shift, *point, *f) * t + between(&aside, *point, *f);
            *wish += give_way(sketcher, chart, grid, [&covered, &drawn], place, *share);
        }
        let moved = sketcher.spines.moved(&sketcher.positions, &wish, &guided);
        aside.iter_mut().zip(moved.iter().zip(&straight)).for_each(|(aside, (a, b))| *aside = *a - *b);
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_met_at_its_time_and_the_ends_are_left_alone() {
        assert_eq!(Along::weights(0.0), [0.0; KEYS]);
        assert_eq!(Along::weights(1.0), [0.0; KEYS]);
        for k in 0..KEYS {
            let weights = Along::weights((k + 1) as f32 / (KEYS + 1) as f32);
            for (i, weight) in weights.iter().enumerate() {
                assert!((weight - if i == k { 1.0 } else { 0.0 }).abs() < 1e-5, "{k}: {weights:?}");
            }
        }
        // No jump anywhere.
        let steps: Vec<[f32; KEYS]> = (0..=1000).map(|i| Along::weights(i as f32 / 1000.0)).collect();
        for pair in steps.windows(2) {
            assert!(pair[0].iter().zip(&pair[1]).all(|(a, b)| (a - b).abs() < 0.02));
        }
    }
}
