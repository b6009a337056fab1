//! Elastic correspondence of plants, two or many (2018 TOG, section 3): curves are registered, their bifurcations
//! matched, and the same is done for every set of matched subtrees, level by level.
//!
//! - *Two.* The parameter that a pair shares is the mean of its own, so no side is the reference.
//! - *Many.* Curves are registered to their Karcher mean. The one with the most bifurcations is the reference; the others'
//!   are matched to it one after the other and added to it where they have no partner; then each is taken out and
//!   matched again against the finished reference.
//! - *Refinement.* The registration is bent to pass through the matched bifurcations. Those without a partner stand on the other
//!   chains where the refined registration puts them (the paper's artificial points with subtrees of zero length), so
//!   their order never conflicts: plants in elastic correspondence lie in one orthant and its boundary.
//! - *Stems.* The longest ones go together; the others by direction, place and length, at least cost. The paper makes them
//!   branches of the longest, which would move them.
//! - *Order of the plants.* Plants are taken in an order that depends on what they are only, so that the result is the
//!   same, bit by bit, whatever order they are given in.

use std::cmp::Ordering;

use glam::Vec3;
use rayon::prelude::*;

use super::bifurcation::{Bifurcation, match_bifurcations};
use super::curve::ElasticCurve;
use super::karcher::registered_to_mean;
use super::monotone::Monotone;
use super::register::register;
use crate::plant::{ChainId, Curve, Plant};
use crate::preset::plan::ElasticParams;
use crate::relate::assignment::assign;
use crate::relate::topology_tree::branching_vector;
use crate::relate::{Kin, KinId};

/// How far a simplified registration may be off, as a share of the chain: a quarter of a sample.
const SIMPLIFIED: f64 = 0.005;
/// Least distance of bifurcations along the shared parameter.
const APART: f64 = 1e-5;
/// Most stems that are assigned by cost; more go together by length.
const MOST_STEMS: usize = 128;

/// How the members of a kin run along the parameter that they share.
#[derive(Clone, Debug, Default)]
pub(in crate::relate) struct Shared {
    /// For each member that is there, in order of source, its map from the shared parameter to its own.
    pub(in crate::relate) maps: Vec<Monotone>,
    /// Where the kin stands on its parent, by the parent's shared parameter; NaN where it goes by its members' places.
    pub(in crate::relate) at: f64,
}

/// Kins and how their members are registered.
#[derive(Clone, Debug)]
pub(in crate::relate) struct Correspondence {
    pub(in crate::relate) kins: Vec<Kin>,
    pub(in crate::relate) shared: Vec<Shared>,
}

/// A plant made ready.
pub(super) struct Side<'a> {
    pub(super) plant: &'a Plant,
    /// Children of each chain, from its base to its tip.
    pub(super) children: Vec<Vec<ChainId>>,
    /// The longest first.
    pub(super) stems: Vec<ChainId>,
}

impl<'a> Side<'a> {
    pub(super) fn new(plant: &'a Plant) -> Self {
        let mut children = plant.children();
        let place = |&id: &ChainId| plant.chain(id).location;
        children.iter_mut().for_each(|c| c.sort_by(|a, b| place(a).total_cmp(&place(b)).then(a.cmp(b))));
        let mut stems: Vec<(f32, ChainId)> = plant
            .chain_ids()
            .filter(|&id| plant.chain(id).parent.is_none())
            .map(|id| (Curve::new(plant.points(id)).length(), id))
            .collect();
        stems.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        Self { plant, children, stems: stems.into_iter().map(|s| s.1).collect() }
    }

    pub(super) fn branch(&self, id: ChainId, at: f64) -> Bifurcation {
        let points = self.plant.points(id);
        let length = f64::from(Curve::new(points).length());
        Bifurcation { at, direction: branching_vector(points), length }
    }
}

/// A place on a kin where branches leave: what of each plant does.
#[derive(Clone, Debug)]
pub(super) struct Slot {
    pub(super) at: f64,
    /// For each plant the branch there.
    pub(super) members: Vec<Option<(ChainId, Bifurcation)>>,
}

impl Slot {
    fn of(at: f64, plants: usize, plant: usize, chain: ChainId, branch: Bifurcation) -> Self {
        let mut members = vec![None; plants];
        members[plant] = Some((chain, branch));
        Self { at, members }
    }

    /// Mean direction and length of what leaves here.
    fn mean(&self) -> Bifurcation {
        let there = || self.members.iter().flatten();
        let count = there().count().max(1) as f64;
        let direction = there().fold(Vec3::ZERO, |sum, m| sum + m.1.direction).normalize_or(Vec3::Y);
        Bifurcation { at: self.at, direction, length: there().map(|m| m.1.length).sum::<f64>() / count }
    }
}

/// The elastic correspondence of some plants, every one with a chain.
pub(in crate::relate) fn correspondence(plants: &[Plant], params: &ElasticParams) -> Correspondence {
    let order = canonical_order(plants);
    let sides: Vec<Side<'_>> = order.par_iter().map(|&i| Side::new(&plants[i])).collect();
    let mut kins: Vec<Kin> = Vec::new();
    let mut shared: Vec<Shared> = Vec::new();
    let mut level: Vec<(Option<KinId>, Slot)> = stems(&sides).into_iter().map(|slot| (None, slot)).collect();
    while !level.is_empty() {
        // In the order of the level, whatever thread finishes first.
        let joined: Vec<(Vec<Monotone>, Vec<Slot>)> =
            level.par_iter().with_min_len(4).map(|(_, slot)| join(&sides, slot, params)).collect();
        let mut next = Vec::new();
        for ((parent, slot), (maps, slots)) in level.into_iter().zip(joined) {
            let id = KinId(kins.len() as u32);
            let mut members = vec![None; plants.len()];
            let mut own: Vec<(usize, Monotone)> = Vec::new();
            let there = slot.members.iter().enumerate().filter_map(|(i, m)| Some((i, m.as_ref()?.0)));
            let mut maps = maps.into_iter();
            for (i, chain) in there {
                members[order[i]] = Some(chain);
                own.extend(maps.next().map(|map| (order[i], map)));
            }
            own.sort_by_key(|m| m.0);
            kins.push(Kin { parent, members });
            shared.push(Shared { maps: own.into_iter().map(|m| m.1).collect(), at: slot.at });
            next.extend(slots.into_iter().map(|slot| (Some(id), slot)));
        }
        level = next;
    }
    Correspondence { kins, shared }
}

/// Indices of the plants by what they hold.
pub(crate) fn canonical_order(plants: &[Plant]) -> Vec<usize> {
    let compare = |a: &Plant, b: &Plant| {
        let sizes = (a.chains().len(), a.all_points().len()).cmp(&(b.chains().len(), b.all_points().len()));
        let bits = |p: &Vec3| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits()];
        let points = || a.all_points().iter().map(bits).cmp(b.all_points().iter().map(bits));
        let places = |p: &Plant| p.chains().iter().map(|c| (c.parent, c.location.to_bits())).collect::<Vec<_>>();
        let radii = || a.all_radii().iter().map(|r| r.to_bits()).cmp(b.all_radii().iter().map(|r| r.to_bits()));
        sizes
            .then_with(points)
            .then_with(radii)
            .then_with(|| if a == b { Ordering::Equal } else { places(a).cmp(&places(b)) })
    };
    let mut order: Vec<usize> = (0..plants.len()).collect();
    order.sort_by(|&i, &j| compare(&plants[i], &plants[j]).then(i.cmp(&j)));
    order
}

/// Stems that go together, the longest first.
fn stems(sides: &[Side<'_>]) -> Vec<Slot> {
    let mut slots: Vec<Slot> = Vec::new();
    for (s, side) in sides.iter().enumerate() {
        let own: Vec<(ChainId, Bifurcation)> = side.stems.iter().map(|&id| (id, side.branch(id, 0.0))).collect();
        let mut partner: Vec<Option<usize>> = vec![None; own.len()];
        if !slots.is_empty() && !own.is_empty() {
            partner[0] = Some(0);
            let (free, rest) = (&slots[1..], &own[1..]);
            if free.len().max(rest.len()) > MOST_STEMS {
                (1..own.len().min(slots.len())).for_each(|i| partner[i] = Some(i));
            } else if !free.is_empty() && !rest.is_empty() {
                let origin = |s: usize, id: ChainId| sides[s].plant.chain(id).origin;
                let size = slots[0].mean().length.max(own[0].1.length).max(1e-6);
                let costs: Vec<f64> = rest
                    .iter()
                    .flat_map(|(id, branch)| {
                        free.iter().map(move |slot| {
                            let mean = slot.mean();
                            let (other, of) = slot
                                .members
                                .iter()
                                .enumerate()
                                .find_map(|(i, m)| Some((i, m.as_ref()?.0)))
                                .unwrap_or((s, *id));
                            let apart = f64::from(origin(s, *id).distance(origin(other, of))) / size;
                            f64::from(branch.direction.distance(mean.direction))
                                + apart
                                + (branch.length - mean.length).abs() / size
                        })
                    })
                    .collect();
                for (i, j) in assign(&costs, rest.len(), free.len()).into_iter().enumerate() {
                    partner[i + 1] = j.map(|j| j + 1);
                }
            }
        }
        for ((chain, branch), partner) in own.into_iter().zip(partner) {
            match partner {
                Some(slot) => slots[slot].members[s] = Some((chain, branch)),
                None => slots.push(Slot::of(0.0, sides.len(), s, chain, branch)),
            }
        }
    }
    slots
}

/// Registers the members of a kin and matches what they bear: the maps of the members, and the slots along the kin.
pub(super) fn join(sides: &[Side<'_>], kin: &Slot, params: &ElasticParams) -> (Vec<Monotone>, Vec<Slot>) {
    let members: Vec<(usize, ChainId)> =
        kin.members.iter().enumerate().filter_map(|(s, m)| Some((s, m.as_ref()?.0))).collect();
    let place = |s: usize, id: ChainId| f64::from(sides[s].plant.chain(id).location);
    if let [(s, chain)] = members[..] {
        let slot = |&id: &ChainId| {
            let at = place(s, id);
            Slot::of(at, sides.len(), s, id, sides[s].branch(id, at))
        };
        return (Vec::new(), sides[s].children[chain.index()].iter().map(slot).collect());
    }
    let curves: Vec<ElasticCurve> =
        members.iter().map(|&(s, id)| ElasticCurve::new(sides[s].plant.points(id))).collect();
    let maps = match &curves[..] {
        [first, second] => {
            let gamma = register(first, second).gamma;
            let own = gamma.iter().map(|g| ((g.0 + g.1) * 0.5, g.0)).collect();
            let other = gamma.iter().map(|g| ((g.0 + g.1) * 0.5, g.1)).collect();
            vec![Monotone::new(own), Monotone::new(other)]
        }
        _ => registered_to_mean(&curves),
    };
    let maps: Vec<Monotone> = maps.into_iter().map(|map| map.simplified(SIMPLIFIED)).collect();
    let branches: Vec<Vec<(ChainId, Bifurcation)>> = members
        .iter()
        .zip(&maps)
        .map(|(&(s, chain), map)| {
            let back = map.inverse();
            let children = sides[s].children[chain.index()].iter();
            children.map(|&id| (id, sides[s].branch(id, back.at(place(s, id))))).collect()
        })
        .collect();
    // The most bifurcations; of equals the first.
    let reference = (0..members.len()).rev().max_by_key(|&m| branches[m].len()).unwrap_or(0);
    let mut slots: Vec<Slot> = Vec::new();
    let merged = |slots: &[Slot], m: usize| merge(slots, sides.len(), members[m].0, &branches[m], params);
    slots = merged(&slots, reference);
    for m in (0..members.len()).filter(|&m| m != reference) {
        slots = merged(&slots, m);
    }
    if members.len() > 2 {
        for m in (0..members.len()).filter(|&m| m != reference) {
            slots.iter_mut().for_each(|slot| slot.members[members[m].0] = None);
            slots.retain(|slot| slot.members.iter().any(Option::is_some));
            slots = merged(&slots, m);
        }
    }
    spread(&mut slots);
    let refined = members.iter().zip(&maps).map(|(&(s, _), map)| {
        let anchors: Vec<(f64, f64)> =
            slots.iter().filter_map(|slot| Some((slot.at, place(s, slot.members[s].as_ref()?.0)))).collect();
        map.through(&anchors)
    });
    (refined.collect(), slots)
}

/// Matches a plant's branches to the slots and puts those without a partner between them, in order.
fn merge(
    slots: &[Slot],
    plants: usize,
    plant: usize,
    branches: &[(ChainId, Bifurcation)],
    params: &ElasticParams,
) -> Vec<Slot> {
    let reference: Vec<Bifurcation> = slots.iter().map(Slot::mean).collect();
    let own: Vec<Bifurcation> = branches.iter().map(|b| b.1).collect();
    let mut pairs = match_bifurcations(&reference, &own, params);
    pairs.push((slots.len(), branches.len()));
    let mut all: Vec<Slot> = Vec::with_capacity(slots.len() + branches.len());
    let (mut i, mut j) = (0, 0);
    for (slot, branch) in pairs {
        // Up to the next pair, both sides in order of place.
        while i < slot || j < branch {
            let from_slots = j >= branch || (i < slot && slots[i].at <= own[j].at);
            if from_slots {
                all.push(slots[i].clone());
                i += 1;
            } else {
                let (chain, own) = branches[j];
                all.push(Slot::of(own.at, plants, plant, chain, own));
                j += 1;
            }
        }
        if slot < slots.len() {
            let mut matched = slots[slot].clone();
            let count = matched.members.iter().flatten().count() as f64;
            matched.at = (matched.at * count + own[branch].at) / (count + 1.0);
            matched.members[plant] = Some(branches[branch]);
            all.push(matched);
            (i, j) = (slot + 1, branch + 1);
        }
    }
    // A matched pair stands between its two places: what lies between the two must not overtake it.
    let mut low = 0.0_f64;
    for slot in &mut all {
        low = low.max(slot.at);
        slot.at = low;
    }
    all
}

/// Makes the places of slots rise strictly, inside of 0..1.
fn spread(slots: &mut [Slot]) {
    let apart = APART.min(0.5 / (slots.len() + 1) as f64);
    let mut low = 0.0;
    for slot in slots.iter_mut() {
        slot.at = slot.at.max(low + apart);
        low = slot.at;
    }
    let mut high = 1.0;
    for slot in slots.iter_mut().rev() {
        slot.at = slot.at.min(high - apart);
        high = slot.at;
    }
}
