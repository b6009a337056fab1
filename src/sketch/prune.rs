//! Branches whose lobes fall outside of a sketch wilt (2018, 5.4.2).
//!
//! From coarse to fine: a cage is clipped with the sketch, and of several pieces the largest counts. Less than
//! [`SketchRules::pruning`] of its area left prunes it with all cages below; nearly all of it left ends the test; else its children are
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
//! Stems never wilt. Past the paper, no more than [`SketchRules::wilting`] of a crown does, what is least inside first: of a sketch that is
//! far from the tree, a crescent say, half a crown comes in that would have gone. While nothing wilted where more would
//! have, a crescent that was thinned by a little had half as many chains again.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::bound::{Chart, Sketcher};
use super::raster::{Grid, Mask};
use super::region::{Fill, Region};
use super::trim::{Field, between};
use crate::plant::{ChainId, Plant};
use crate::preset::plan::SketchRules;

/// Share from which it counts as all inside.
const WHOLE: f32 = 0.98;
/// Cells along the sketch for the quick test.
const CELLS: usize = 96;

/// Has chains wilt whose cages lie outside when the cages of a view have these vertices; `near` is how much the sketch acts
/// about each handle, and where it doesn't at all, no branch wilts by itself. Gives back which share of the foliage more than may
/// would have.
pub(super) fn pruned(
    sketcher: &Sketcher,
    chart: &Chart,
    vertices: &[Vec2],
    target: &Region,
    near: &[f32],
    rules: &SketchRules,
    wilts: &mut [bool],
) -> f32 {
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
            State::Tested if shares[cage] < rules.pruning => State::Pruned,
            State::Tested if shares[cage] >= WHOLE => State::Whole,
            state => state,
        };
    }
    let acts = acted_on(sketcher, near);
    let mut outside: Vec<Option<f32>> = vec![None; plant.chains().len()];
    for id in plant.chain_ids() {
        let Some(parent) = plant.chain(id).parent else { continue };
        let own = chart.cages.outer(id);
        // A small lobe shares its parent's cage, and that one's inner lobe says nothing of it.
        let of_its_own = own != 0 && own != chart.cages.outer(parent);
        if of_its_own && acts[id.index()] && states[own as usize] == State::Pruned {
            outside[id.index()] = Some(shares[own as usize]);
        }
    }
    let mut foliage = vec![0.0_f32; plant.chains().len()];
    sketcher.handles.iter().for_each(|handle| foliage[handle.chain.index()] += handle.weight);
    worst_first(plant, &outside, &foliage, rules.wilting, wilts)
}

/// Has those chains wilt that lie outside, each by how much of it is inside, with all that they bear: the worst first, as
/// long as no more than `most` of the foliage is lost, that of chains that wilt already with it. Where all of a limb is
/// too much, what it bears may go by itself. Gives back which share of all foliage stays by that.
pub(super) fn worst_first(
    plant: &Plant,
    outside: &[Option<f32>],
    foliage: &[f32],
    most: f32,
    wilts: &mut [bool],
) -> f32 {
    // What each chain has with all that it bears and that has not wilted.
    let mut borne: Vec<f64> = foliage.iter().zip(&*wilts).map(|(f, w)| if *w { 0.0 } else { f64::from(*f) }).collect();
    for id in plant.chain_ids().rev() {
        if let Some(parent) = plant.chain(id).parent {
            borne[parent.index()] += borne[id.index()];
        }
    }
    let all: f64 = foliage.iter().map(|f| f64::from(*f)).sum();
    let lost: f64 = foliage.iter().zip(&*wilts).filter(|(_, w)| **w).map(|(f, _)| f64::from(*f)).sum();
    let mut left = all * f64::from(most) * (1.0 + 1e-6) - lost;
    let mut order: Vec<(f32, ChainId)> = plant.chain_ids().filter_map(|id| Some((outside[id.index()]?, id))).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let children = plant.children();
    for (_, id) in order {
        let goes = borne[id.index()];
        if wilts[id.index()] || goes > left {
            continue;
        }
        left -= goes;
        let mut above = plant.chain(id).parent;
        while let Some(parent) = above {
            borne[parent.index()] -= goes;
            above = plant.chain(parent).parent;
        }
        let mut next = vec![id];
        while let Some(id) = next.pop() {
            wilts[id.index()] = true;
            borne[id.index()] = 0.0;
            next.extend(&children[id.index()]);
        }
    }
    let mut would = vec![false; wilts.len()];
    let mut spared = 0.0;
    for id in plant.chain_ids() {
        let i = id.index();
        would[i] = outside[i].is_some() || plant.chain(id).parent.is_some_and(|parent| would[parent.index()]);
        spared += if would[i] && !wilts[i] { f64::from(foliage[i]) } else { 0.0 };
    }
    if all > 0.0 { (spared / all) as f32 } else { 0.0 }
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
/// bear when points move by `shift`: from limbs to twigs. No more than all may lose; gives back
/// which share more of it would have.
pub(super) fn left_outside(
    sketcher: &Sketcher,
    chart: &Chart,
    drawn: &Field,
    shift: &[Vec3],
    near: &[f32],
    rules: &SketchRules,
    wilts: &mut [bool],
) -> f32 {
    let Sketcher { plant, leaves, discs, reach, .. } = sketcher;
    if discs.is_empty() {
        return 0.0;
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
    let mut outside: Vec<Option<f32>> = vec![None; plant.chains().len()];
    for id in plant.chain_ids().filter(|id| plant.chain(*id).parent.is_some() && acts[id.index()]) {
        let [within, all] = held[id.index()];
        if all > 0.0 && within < rules.pruning * all {
            outside[id.index()] = Some(within / all);
        }
    }
    let foliage: Vec<f32> = own.iter().map(|own| own[1]).collect();
    worst_first(plant, &outside, &foliage, rules.wilting, wilts)
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
