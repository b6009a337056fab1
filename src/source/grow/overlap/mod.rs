//! Branches that grow into each other: found, moved apart, and dropped where that does not help.
//!
//! Paths share no node but those before their fork, so axes never cross in the graph. But nodes are points and wood is
//! thick, and smoothing draws axes off their nodes. So the finished plant is checked, capsule against capsule: the
//! closest places of any two segments of different chains, with the radii there. Overlapping is right at forks. A place is
//! at its fork while its branch has not yet left the wood of its kin, for at most [`ZONE`](wood::ZONE) radii; and so are two places
//! less than [`FORK`](find::FORK) times their radii apart along the wood. The way along the wood is measured to the closest place on
//! a capsule, never to its end: a branch's first capsule may be long, and to its end the way is long at the fork itself.
//! That alone told of 3,200 overlaps in 15,800 branches of the shipped species, where there are 82.
//!
//! A branch is mended when more than [`LIMIT`] of its surface lies in others, or when its axis crosses another's: where
//! the two come closer than [`CROSSING`](find::CROSSING) of the sum of their radii, away from forks. That is how the promise is checked that
//! axes never cross, on the polylines as they are in the end, smoothed and mended. The thinner of two is pushed to the
//! side on which it passes, its neighbourhood with it and what it bears on it; its base stands. A branch that would be
//! pushed through an obstacle stays where it was. What still overlaps after [`ROUNDS`] is dropped if it is a twig that
//! bears nothing, at most [`DROPPED`] of the branches; the rest stays and is told of.
//!
//! Later rounds look only where something was moved.
//!
//! Limits: a capsule that lies in several others counts the deepest. At most [`MOST_LOOKS`] capsules are held against one,
//! so that wood thicker than its own spacing ends in bounded time; what lies beyond is not seen. `n log n` in points:
//! capsules are found by cells.

mod find;
mod wood;

use glam::Vec3;

use self::find::{Found, LIMIT, find};
use self::wood::Wood;
use crate::plant::{ChainId, Plant, PlantBuilder, Posed};

/// How often branches are moved apart before what is left is dropped.
const ROUNDS: u32 = 4;
/// Share of a plant's branches that may be dropped.
const DROPPED: f32 = 0.03;
/// Over how many times its own way a place that is moved takes its neighbours along, on either side.
const SPREAD: f32 = 5.0;

/// What was found and done; counts of branches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mended {
    /// Of which more than a hundredth overlapped, or that crossed another.
    pub found: usize,
    /// Dropped twigs.
    pub dropped: usize,
    /// Still overlapping.
    pub left: usize,
}

/// The plant with the points of overlapping chains moved out, those around them part of the way, and which chains that
/// concerns. Bases stand, and what a branch bears goes with it.
/// Chains that are `pinned` stay.
fn moved(wood: &Wood<'_>, found: &Found, pinned: &[bool]) -> (Plant, Vec<bool>) {
    let plant = wood.plant;
    let mut own = vec![Vec3::ZERO; wood.chain.len()];
    let mut active: Vec<bool> = (0..found.shares.len()).map(|chain| found.bad(chain)).collect();
    for (i, hit) in &found.hits {
        let pair = [wood.chain[*i], wood.chain[hit.other as usize]].map(|c| c as usize);
        if !pair.iter().any(|&c| found.bad(c)) || hit.out == Vec3::ZERO || pinned[pair[0]] {
            continue;
        }
        active[pair[0]] = true;
        active[pair[1]] = true;
        let span = plant.span(ChainId(wood.chain[*i]));
        let edge = wood.arc[*i] - wood.arc[*i - 1];
        let (centre, width) = (wood.arc[*i - 1] + edge * hit.at, hit.out.length() * SPREAD + edge * 2.0);
        let mut grow = |k: usize| {
            let near = 1.0 - (wood.arc[k] - centre).abs() / width;
            if near <= 0.0 {
                return false;
            }
            let wish = hit.out * (near * near * (3.0 - 2.0 * near));
            if wish.length_squared() > own[k].length_squared() {
                own[k] = wish;
            }
            true
        };
        let _ = (*i..span.end).all(&mut grow);
        let _ = (span.start + 1..*i).rev().all(&mut grow);
    }
    let mut builder = PlantBuilder::new();
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let span = plant.span(id);
        let radii = plant.radii(id);
        let carried = chain.parent.is_some_and(|parent| active[parent.index()]);
        active[id.index()] |= carried;
        let frame = chain.parent.map(|parent| wood.posed.frame(parent, chain.location));
        let local = |v: Vec3| frame.map_or(v, |frame| frame.to_local(v));
        let points: Vec<Vec3> = plant
            .points(id)
            .iter()
            .zip(&own[span])
            .map(|(p, own)| if *own == Vec3::ZERO { *p } else { *p + local(*own) })
            .collect();
        match chain.parent {
            None => builder.stem(chain.origin, &points, radii),
            Some(parent) => builder.branch(parent, chain.location, &points, radii),
        };
    }
    (builder.finish().unwrap_or_else(|_| plant.clone()), active)
}

/// The plant without the thinnest of the twigs that overlap too much, but no more than a share of its branches; and how
/// many these were.
fn dropped(plant: &Plant, found: &Found) -> (Plant, usize) {
    let mut bears = vec![false; plant.chains().len()];
    plant.chains().iter().filter_map(|c| c.parent).for_each(|p| bears[p.index()] = true);
    let mut twigs: Vec<ChainId> = plant
        .chain_ids()
        .filter(|id| found.bad(id.index()) && !bears[id.index()] && plant.chain(*id).parent.is_some())
        .collect();
    twigs.sort_by(|a, b| plant.radii(*a)[0].total_cmp(&plant.radii(*b)[0]).then(a.cmp(b)));
    twigs.truncate((plant.chains().len() as f32 * DROPPED).max(1.0) as usize);
    let mut gone = vec![false; bears.len()];
    twigs.iter().for_each(|id| gone[id.index()] = true);
    let mut builder = PlantBuilder::new();
    let mut places: Vec<Option<ChainId>> = Vec::with_capacity(gone.len());
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let (points, radii) = (plant.points(id), plant.radii(id));
        places.push(match chain.parent {
            _ if gone[id.index()] => None,
            None => Some(builder.stem(chain.origin, points, radii)),
            Some(parent) => places[parent.index()].map(|p| builder.branch(p, chain.location, points, radii)),
        });
    }
    (builder.finish().unwrap_or_else(|_| plant.clone()), twigs.len())
}

/// The chains of `after` that an obstacle bars though it did not bar them `before`; chains of both are the same ones.
fn newly_barred(before: &Plant, after: &Plant, barred: &dyn Fn(Vec3, Vec3) -> bool) -> Vec<bool> {
    let (a, b) = rayon::join(|| Posed::of_bearers(before), || Posed::of_bearers(after));
    let within = |posed: &Posed, plant: &Plant, id| posed.chain(plant, id).windows(2).any(|s| barred(s[0], s[1]));
    let ids = after.chain_ids();
    ids.map(|id| a.chain(before, id) != b.chain(after, id) && within(&b, after, id) && !within(&a, before, id))
        .collect()
}

/// The plant with some chains, and those that bear them, as they were `before`; `pinned` is told which.
fn put_back(before: &Plant, after: &Plant, back: &[bool], pinned: &mut [bool]) -> Plant {
    for id in before.chain_ids().filter(|id| back[id.index()]) {
        let mut at = Some(id);
        while let Some(id) = at.filter(|id| !pinned[id.index()]) {
            pinned[id.index()] = true;
            at = before.chain(id).parent;
        }
    }
    let mut builder = PlantBuilder::new();
    for id in after.chain_ids() {
        let chain = after.chain(id);
        let points = if pinned[id.index()] { before.points(id) } else { after.points(id) };
        match chain.parent {
            None => builder.stem(chain.origin, points, after.radii(id)),
            Some(parent) => builder.branch(parent, chain.location, points, after.radii(id)),
        };
    }
    builder.finish().unwrap_or_else(|_| before.clone())
}

/// How many branches of a plant lie in others with more than a hundredth of their surface, away from forks.
#[must_use]
pub fn overlaps(plant: &Plant) -> usize {
    let found = find(&Wood::of(plant), &vec![true; plant.chains().len()], None);
    found.shares.iter().filter(|share| **share > LIMIT).count()
}

/// How many branches of a plant have an axis that crosses another's away from forks: closer than a tenth of the sum of
/// their radii.
#[must_use]
pub fn crossings(plant: &Plant) -> usize {
    let found = find(&Wood::of(plant), &vec![true; plant.chains().len()], None);
    found.crossed.iter().filter(|crossed| **crossed).count()
}

/// The plant with its overlapping and crossing branches moved apart, twigs for which that does not help dropped, and what
/// was done. Radii stay as they are. Leaves are not kept.
#[must_use]
pub fn mend_overlaps(plant: &Plant) -> (Plant, Mended) {
    let (plant, mended, _) = mend_among(plant, None);
    (plant, mended)
}

/// As [`mend_overlaps`], among obstacles: `barred` says whether one is between two places. No branch is moved into one.
/// Also gives the plant's heights before and after.
pub(in crate::source::grow) fn mend_among(
    plant: &Plant,
    barred: Option<&dyn Fn(Vec3, Vec3) -> bool>,
) -> (Plant, Mended, [f32; 2]) {
    let mut mended = Mended::default();
    let mut rest = plant.clone();
    let mut active = vec![true; plant.chains().len()];
    let mut pinned = vec![false; plant.chains().len()];
    let (mut fused, mut before) = (None, None);
    let mut heights = [0.0; 2];
    for round in 0..=ROUNDS {
        // Most of a plant stands as it stood.
        let posed = match &before {
            None => Posed::of_bearers(&rest),
            Some(before) => Posed::of_changed(&rest, before, &active),
        };
        let wood = Wood::posed(&rest, posed);
        let found = find(&wood, &active, fused);
        mended.left = found.count();
        heights[1] = wood.posed.height();
        if round == 0 {
            mended.found = mended.left;
            heights[0] = heights[1];
        }
        if mended.left == 0 {
            break;
        }
        let next = if round < ROUNDS {
            let (mut next, changed) = moved(&wood, &found, &pinned);
            // What is put back moves what it bears, so it may take a few times; each pins more chains.
            while let Some(barred) = barred {
                let back = newly_barred(&rest, &next, barred);
                let fresh = |(back, pinned): (&bool, &bool)| *back && !*pinned;
                if !back.iter().zip(&pinned).any(fresh) {
                    break;
                }
                next = put_back(&rest, &next, &back, &mut pinned);
            }
            active = changed;
            next
        } else {
            let (next, dropped) = dropped(&rest, &found);
            mended.dropped = dropped;
            mended.left -= dropped;
            if dropped > 0 {
                heights[1] = next.height();
            }
            next
        };
        fused = Some(found.fused);
        before = Some(wood.posed);
        rest = next;
    }
    (rest, mended, heights)
}

#[cfg(test)]
mod tests;
