//! Branches whose lobes fall outside of a sketch wilt (2018, 5.4.2).
//!
//! From coarse to fine: a cage is clipped with the sketch, and of several pieces the largest counts. Less than
//! [`LEAST`] of its area left prunes it with all cages below; nearly all of it left ends the test; else its children are
//! tested. Cages clear of the outline are judged by its distance, so that only those that cross it are clipped.
//!
//! What the paper leaves open:
//!
//! - Cages are tested as the root moves them, before lobes spread (`sketch/fill.rs`): spreading moves handles, not cages, and
//!   keeps them inside, so after it hardly anything would be outside. A lobe that spreading would have brought in wilts all the same.
//! - What the bounds of branches (`sketch/spine.rs`) then keep outside wilts as well ([`left_outside`]).
//! - The root is not tested. It has become the sketch's own outline, so nearly all of it is inside, and by the second test
//!   nothing would ever be pruned.
//! - A chain is judged by its outer lobe. Where it bears others, its inner lobe alone may lie outside, but the chain can't
//!   wilt without what it bears, whose own lobes are inside or pruned by themselves; its own leaves are brought in
//!   with its handles. Where it bears none, both lobes are one.
//!
//! Stems never wilt, and where a sketch would take most of a crown, nothing does: it is then far from the tree, and a
//! bare pole is not what was meant.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::bound::{Chart, Sketcher};
use super::raster::{Grid, Mask};
use super::region::{Fill, Region};
use super::trim::{Field, between};

/// Share of a cage's area inside the sketch below which it is pruned.
const LEAST: f32 = 0.3;
/// Share from which it counts as all inside.
const WHOLE: f32 = 0.98;
/// Most of a crown's foliage that may wilt.
const MOST: f32 = 0.5;
/// Cells along the sketch for the quick test.
const CELLS: usize = 96;

/// Which chains wilt when the cages of a view have these vertices; `near` is how much the sketch acts about each handle, and
/// where it doesn't at all, no branch wilts by itself.
pub(super) fn pruned(
    sketcher: &Sketcher,
    chart: &Chart,
    vertices: &[Vec2],
    target: &Region,
    near: &[f32],
) -> Vec<bool> {
    let plant = &sketcher.plant;
    let count = chart.cages.len();
    let shares: Vec<f32> = shares(chart, vertices, target);
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        Pruned,
        Whole,
        Tested,
    }
    let mut states = vec![State::Tested; count];
    for cage in 1..count {
        let above = states[chart.cages.parent(cage as u32) as usize];
        states[cage] = match above {
            State::Tested if shares[cage] < LEAST => State::Pruned,
            State::Tested if shares[cage] >= WHOLE => State::Whole,
            state => state,
        };
    }
    let acts = acted_on(sketcher, near);
    let mut wilts = vec![false; plant.chains().len()];
    let (mut lost, mut all) = (0.0_f32, 0.0_f32);
    for id in plant.chain_ids() {
        wilts[id.index()] = match plant.chain(id).parent {
            None => false,
            Some(parent) => {
                let own = chart.cages.outer(id);
                // A small lobe shares its parent's cage, and that one's inner lobe says nothing of it.
                let of_its_own = own != chart.cages.outer(parent);
                wilts[parent.index()]
                    || (of_its_own && acts[id.index()] && own != 0 && states[own as usize] == State::Pruned)
            }
        };
    }
    for handle in &sketcher.handles {
        all += handle.weight;
        lost += if wilts[handle.chain.index()] { handle.weight } else { 0.0 };
    }
    if lost > all * MOST { vec![false; wilts.len()] } else { wilts }
}

/// For each chain whether the sketch acts about any of its handles.
fn acted_on(sketcher: &Sketcher, near: &[f32]) -> Vec<bool> {
    let mut acts = vec![false; sketcher.plant.chains().len()];
    for (handle, near) in sketcher.handles.iter().zip(near) {
        acts[handle.chain.index()] |= *near > 0.0;
    }
    acts
}

/// Has those chains wilt, too, that their bounds keep outside ([`super::spine`]), judged by their leaves and those of what they
/// bear when points move by `shift`: from limbs to twigs. No more than all may lose.
pub(super) fn left_outside(
    sketcher: &Sketcher,
    chart: &Chart,
    drawn: &Field,
    shift: &[Vec3],
    near: &[f32],
    wilts: &mut [bool],
) {
    let Sketcher { plant, leaves, discs, reach, .. } = sketcher;
    if discs.is_empty() {
        return;
    }
    let acts = acted_on(sketcher, near);
    // Of each chain: leaves that are within, and all, by themselves and with what it bears and keeps.
    let mut own = vec![[0.0_f32; 2]; plant.chains().len()];
    for ((leaf, (place, radius)), (point, f)) in plant.leaves().iter().zip(discs).zip(leaves) {
        let is_within = drawn.at(chart.plane.seen(*place + between(shift, *point, *f))) > -*reach;
        let own = &mut own[leaf.chain.index()];
        let area = radius * radius;
        *own = [own[0] + if is_within { area } else { 0.0 }, own[1] + area];
    }
    let mut held = own.clone();
    for id in plant.chain_ids().rev() {
        if let Some(parent) = plant.chain(id).parent.filter(|_| !wilts[id.index()]) {
            let [within, all] = held[id.index()];
            let of = &mut held[parent.index()];
            *of = [of[0] + within, of[1] + all];
        }
    }
    let mut left = wilts.to_vec();
    for id in plant.chain_ids() {
        let Some(parent) = plant.chain(id).parent else { continue };
        let [within, all] = held[id.index()];
        let is_outside = all > 0.0 && within < LEAST * all && acts[id.index()];
        left[id.index()] |= left[parent.index()] || is_outside;
    }
    let lost: f32 = left.iter().zip(&own).filter(|(left, _)| **left).map(|(_, own)| own[1]).sum();
    let all: f32 = own.iter().map(|own| own[1]).sum();
    if lost <= all * MOST {
        wilts.copy_from_slice(&left);
    }
}

/// For each cage the share of its area that the largest piece inside the sketch has.
fn shares(chart: &Chart, vertices: &[Vec2], target: &Region) -> Vec<f32> {
    let bounds = target.bounds();
    let size = (bounds[1] - bounds[0]).max_element();
    let grid = Grid::over(bounds, CELLS, size * 0.02);
    let mask = Mask::of_region(target, grid);
    let inside = mask.depths();
    let outside = Mask { grid, inside: mask.inside.iter().map(|i| !i).collect() }.depths();
    let edge = grid.origin + Vec2::new(grid.width as f32, grid.height as f32) * grid.cell;
    (0..chart.cages.len() as u32)
        .into_par_iter()
        .with_min_len(64)
        .map(|cage| {
            let ring = chart.cages.ring(cage, vertices);
            if cage == 0 {
                return 1.0;
            }
            let middle = ring.iter().fold(Vec2::ZERO, |s, p| s + *p) / ring.len().max(1) as f32;
            let radius = ring.iter().map(|p| p.distance(middle)).fold(0.0, f32::max) / grid.cell + 1.5;
            let (x, y) = grid.cell_of(middle);
            let i = y * grid.width + x;
            let beyond = (middle - middle.clamp(grid.origin, edge)).length() / grid.cell;
            if beyond == 0.0 && inside[i] > radius {
                return 1.0;
            }
            if beyond + outside[i] > radius + 1.5 && beyond > radius || (beyond == 0.0 && outside[i] > radius) {
                return 0.0;
            }
            let region = Region::of(&[ring.to_vec()], Fill::NonZero);
            let area = region.area();
            if area > 0.0 { region.intersection(target).largest() / area } else { 1.0 }
        })
        .collect()
}
