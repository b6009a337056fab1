//! Leaves along the twigs.
//!
//! Sites follow each other along a twig by the golden angle or in two rows, with one at its end. Each site has a place in
//! one fixed, seeded order, and the density says how far down the order leaves are put. In the order the sites of a twig
//! stand close together and those of outer twigs early: so a thin crown has fewer leafy twigs with gaps between them, as a
//! real one has, and not the same twigs with fewer leaves, which looks like confetti. Twigs left bare are dropped.
//!
//! The number of leaves follows from the leaf area index: the area of all cards is the density times [`INDEX`] times the mean
//! area of the crown's shadows from three sides, whatever the size of the tree.

use std::f32::consts::TAU;

use glam::Vec3;
use rayon::prelude::*;

use super::room::{Card, Room};
use super::twig::Wood;
use crate::base::{Frame, Rotation, Seed, math};
use crate::plant::{ChainId, Leaf, Plant, Posed};
use crate::preset::plan::{DressParams, Phyllotaxis};

/// Card area over shadow area at density 1.
const INDEX: f32 = 8.0;
/// Golden angle, radians.
const GOLDEN: f32 = 2.399_963;
/// Largest factor by which leaves are enlarged when there may not be enough of them.
const LARGEST: f32 = 2.0;
/// Sites in a row, for each of those that follow a spiral: leaflets of a frond stand close.
const ROW: f32 = 2.4;
/// Twigs with rows from which on lots choose those that get one more, and what a lot counts among pairs of a row: less than
/// halves of a row of a thousand.
const MANY: usize = 64;
const TIE: f32 = 5e-4;
/// How much smaller leaves in rows are at the end of a twig, where they stand as much closer: with even gaps the ends of fronds fell
/// apart into tufts.
const TAPER: f32 = 0.55;
/// Their mean area, over that of the largest, and how far apart the largest stand, in mean gaps: four fifths of a frond
/// have as many leaves as with even ones.
const TAPERED: f32 = 0.57;
const WIDEST: f32 = 1.36;

/// Cosine of how far from upright a stem may end that is a leader, and how many times as far down as other ends it is as
/// leafy as at its tip: a spruce's was a tuft on a bare mast.
const UPRIGHT: f32 = 0.94;
const LEADER: f32 = 4.0;
/// Ways that a leaf is turned until it is free of obstacles, and how far the last one of a twig's end points aside, radians.
const TURNS: u32 = 12;
const ASIDE: f32 = 1.6;

struct Site {
    chain: ChainId,
    location: f32,
    /// Number along its chain; the phyllotactic angle.
    number: u32,
    terminal: bool,
    /// How much further in than a twig's length it lies on own wood, in twigs.
    inward: f32,
}

/// Puts leaves on a plant with twigs, whose first chains are `bare`'s.
pub(super) fn add(
    bare: &Plant,
    plant: Plant,
    (wood, room): (&Wood, Room<'_>),
    params: &DressParams,
    seed: Seed,
) -> Plant {
    // Frames are wanted of the few twigs only that bear leaves in the end.
    let mut posed = Posed::of_bearers(&plant);
    let leader = leader(bare, &plant, &posed);
    let sites = sites((bare, &plant), &posed, (wood, leader), params);
    let rows = params.phyllotaxis == Phyllotaxis::Distichous;
    let card = wood.leaf * wood.leaf * if rows { TAPERED } else { 1.0 };
    let area = params.density * INDEX * shadow(&posed, wood);
    let want = (area / card.max(1e-8)).min(4e6);
    let allowed = want.min(params.most_leaves as f32).min(sites.len() as f32).max(1.0);
    let scale = (want / allowed).sqrt().clamp(1.0, LARGEST);
    // Of a few fronds all have about as many; of many twigs the first would have all leaves where there are fewer than twigs.
    let tie = if sites.iter().filter(|site| site.terminal).count() < MANY { 0.0 } else { TIE };
    // The fixed order: weighted sampling without replacement (Efraimidis and Spirakis 2006), the smallest keys first.
    let (low, high) = wood.crown.bounds();
    let middle_of_crown = (low + high) * 0.5;
    let deepest = wood.crown.depth((low + high) * 0.5).max(1e-6);
    // How deep each twig lies, 0 at the rim; once a twig, since it costs more than anything else here.
    let insides: Vec<f32> = (0..plant.chains().len() as u32)
        .into_par_iter()
        .map(|id| {
            if (id as usize) < bare.chains().len() {
                return 0.0;
            }
            let middle = posed.curve(&plant, ChainId(id)).point(0.5);
            math::smoothstep(0.1, 0.9, wood.crown.depth(middle) / deepest)
        })
        .collect();
    let mut order: Vec<(f32, u32)> = sites
        .iter()
        .enumerate()
        .map(|(i, site)| {
            let chain = seed.at(u64::from(site.chain.0));
            let key = if site.chain.index() < bare.chains().len() {
                // The plant's own branch ends are leafy first, further in later. Pairs of a row go so that those that stay
                // are as far apart as before: gaps in a frond are seen.
                let lot = address(seed, site).child("order");
                let turn = if rows {
                    halving(site.number / 2) + tie * chain.child("order").unit()
                } else {
                    exponential(lot, 1.0)
                };
                0.06 * turn + 0.3 * site.inward
            } else {
                let inside = insides[site.chain.index()];
                exponential(chain.child("order"), 1.0 - 0.75 * inside)
                    + 0.06 * exponential(address(seed, site).child("order"), if site.terminal { 4.0 } else { 1.0 })
            };
            (key, i as u32)
        })
        .collect();
    // No two are equal, so which come first needs no sorting.
    if (allowed as usize) < order.len() {
        order.select_nth_unstable_by(allowed as usize, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order.truncate(allowed as usize);
    }
    let mut chosen: Vec<u32> = order.into_iter().map(|(_, i)| i).collect();
    chosen.sort_unstable();
    posed.frame_chains(&plant, chosen.iter().map(|&i| sites[i as usize].chain));
    let of_tree = (wood, middle_of_crown, room, leader);
    let leaf = |&i: &u32| leaf(&plant, &posed, of_tree, &sites[i as usize], params, scale, seed);
    let leaves: Vec<Leaf> = chosen.iter().filter_map(leaf).collect();
    let mut leafy = vec![false; plant.chains().len()];
    leaves.iter().for_each(|leaf| leafy[leaf.chain.index()] = true);
    let (mut builder, moved) = super::twig::prune(&plant, bare.chains().len(), &mut leafy);
    for leaf in leaves {
        if let Some(chain) = moved[leaf.chain.index()] {
            builder.leaf(Leaf { chain, ..leaf });
        }
    }
    builder.finish().unwrap_or(plant)
}

/// An exponentially distributed number of mean 1 / `rate`.
fn exponential(seed: Seed, rate: f32) -> f32 {
    -math::ln((seed.unit() + 1e-7).min(1.0)) / rate
}

/// Numbers in 0..1 of which each beginning is spread evenly (van der Corput 1935).
fn halving(number: u32) -> f32 {
    (number.reverse_bits() >> 8) as f32 / (1 << 24) as f32
}

/// The stem of a bare plant that leads upright to the highest of its wood, if any does. What it bears at its end stands up along
/// it: hung over as on a twig, a spruce's top was a flag.
fn leader(bare: &Plant, plant: &Plant, posed: &Posed) -> Option<ChainId> {
    let top = |id: ChainId| posed.chain(plant, id).iter().fold(f32::MIN, |top, p| top.max(p.y));
    let end = |id: ChainId| posed.chain(plant, id).last().map_or(f32::MIN, |p| p.y);
    let stems = bare.chain_ids().filter(|&id| bare.chain(id).parent.is_none());
    let leader = stems.max_by(|&a, &b| end(a).total_cmp(&end(b)))?;
    let leads = bare.chain_ids().all(|id| top(id) <= end(leader)) && posed.tangent(leader, 1.0).y > UPRIGHT;
    leads.then_some(leader)
}

/// How large a leaf of a row is at a place of its twig, against the largest.
fn tapered(location: f32) -> f32 {
    1.0 - TAPER * location * location
}

fn address(seed: Seed, site: &Site) -> Seed {
    seed.at(u64::from(site.chain.0)).at(u64::from(site.number))
}

/// Every place that can bear a leaf: along the twigs, and along the outermost of the plant's own thin wood.
fn sites(
    (bare, plant): (&Plant, &Plant),
    posed: &Posed,
    (wood, leader): (&Wood, Option<ChainId>),
    params: &DressParams,
) -> Vec<Site> {
    let rows = params.phyllotaxis == Phyllotaxis::Distichous;
    let gap = (wood.leaf * 0.3).max(wood.step * 0.2) / if rows { ROW } else { 1.0 };
    let near = params.twig_length * 1.2;
    let mut sites = Vec::new();
    for id in plant.chain_ids() {
        let own = id.index() < bare.chains().len();
        let length = posed.curve(plant, id).length();
        if length <= 0.0 {
            continue;
        }
        let tip = plant.radii(id)[plant.radii(id).len() - 1];
        if own
            && (tip > wood.thin[id.index()]
                || (plant.chain(id).parent.is_none() && posed.chain(plant, id).last().is_none_or(|p| p.y < wood.floor)))
        {
            continue;
        }
        // Without twigs the plant's own branches bear all leaves.
        let near = if params.twig_length > 0.0 { near } else { length };
        let young = if leader == Some(id) { near * LEADER } else { near };
        let leafy = if own { near.max(length * 0.5).min(length * 0.8) } else { length - (gap * 0.4).min(length * 0.4) };
        let count = (leafy / gap) as u32;
        sites.push(Site { chain: id, location: 1.0, number: 0, terminal: true, inward: 0.0 });
        let curve = posed.curve(plant, id);
        let mut back = 0.0;
        for k in 1..=if rows { count.saturating_mul(2) } else { count } {
            if rows {
                back += gap * WIDEST * tapered(1.0 - back / length);
                if back > leafy {
                    break;
                }
            } else {
                back = k as f32 * gap;
            }
            let location = 1.0 - back / length;
            // Leaves grow on young wood only, and on stems in the crown.
            let is_bare = || {
                let is_bole = plant.chain(id).parent.is_none() && curve.point(f64::from(location)).y < wood.floor;
                is_bole || curve.value(plant.radii(id), f64::from(location)) > wood.thin[id.index()]
            };
            if location <= 0.0 || (own && is_bare()) {
                break;
            }
            let inward = if own { ((back - young) / near.max(1e-6)).max(0.0) } else { 0.0 };
            sites.push(Site { chain: id, location, number: k, terminal: false, inward });
        }
    }
    sites
}

/// Mean area of the crown's shadows along x, y and z, square metres, by cells of the reach of a twig.
fn shadow(posed: &Posed, wood: &Wood) -> f32 {
    let cell = (wood.reach * 0.4).max(1e-4);
    let mut total = 0.0;
    for (a, b) in [(0, 2), (0, 1), (1, 2)] {
        let mut cells: Vec<(i32, i32)> = posed
            .positions()
            .iter()
            .filter(|p| p.y >= wood.floor)
            .map(|p| ((p[a] / cell).floor() as i32, (p[b] / cell).floor() as i32))
            .collect();
        cells.sort_unstable();
        cells.dedup();
        total += cells.len() as f32 * cell * cell;
    }
    total / 3.0
}

/// The angle about the twig and the one from it that a leaf is turned to at some try; as they are at the first. The next ones
/// go round, and a leaf at the end of a twig leaves its line, others lie along it.
fn turned((around, angle): (f32, f32), turn: u32, terminal: bool) -> (f32, f32) {
    let share = turn as f32 / TURNS as f32;
    (around + turn as f32 * GOLDEN, if terminal { angle + share * ASIDE } else { angle * (1.0 - 0.7 * share) })
}

/// None for what would hang into the ground, or reach into an obstacle whichever way it is turned.
fn leaf(
    plant: &Plant,
    posed: &Posed,
    (wood, middle, room, leader): (&Wood, Vec3, Room<'_>, Option<ChainId>),
    site: &Site,
    params: &DressParams,
    scale: f32,
    seed: Seed,
) -> Option<Leaf> {
    let s = address(seed, site);
    let pose = posed.at(plant, site.chain, site.location);
    let axis = pose.frame.y;
    let rows = params.phyllotaxis == Phyllotaxis::Distichous;
    let turn = s.child("turn").range(-0.35, 0.35);
    let start = site.number as f32 * GOLDEN + seed.at(u64::from(site.chain.0)).child("start").unit() * TAU + turn;
    let angle = if site.terminal {
        s.child("angle").range(0.0, 0.25)
    } else {
        params.leaf_angle * s.child("angle").range(0.75, 1.2)
    };
    let droop = params.droop * s.child("droop").range(0.4, 1.0);
    let (angle, droop) = if !rows && leader == Some(site.chain) && axis.y > UPRIGHT {
        (angle * site.number.max(1) as f32 / (site.number + 2) as f32, 0.0)
    } else {
        (angle, droop)
    };
    // The upper face looks out of the crown and a little up, with some disorder: a card is looked at from the ground,
    // and one that lies flat shows an edge, or its unlit back.
    let out = (pose.position - middle).normalize_or(Vec3::Y);
    // Which way it is turned; the first is its own, others are for where that one is not free.
    let axes = |turn: u32| {
        let (around, angle) = turned((start, angle), turn, site.terminal);
        let (sin, cos) = math::sin_cos(around);
        let radial = if rows {
            // Level, and to both sides in turn.
            let side = axis.cross(Vec3::Y).try_normalize().unwrap_or(pose.frame.x);
            if (site.number + turn).is_multiple_of(2) { side } else { -side }
        } else {
            pose.frame.x * cos + pose.frame.z * sin
        };
        let (sin, cos) = math::sin_cos(angle);
        let y = axis * cos + radial * sin;
        let y = (y - Vec3::Y * droop).normalize_or(axis);
        let face = if rows {
            // The upper side of the twig, as both rows are a blade's halves.
            radial.cross(axis).dot(Vec3::Y).signum() * radial.cross(axis) + s.child("face").direction() * 0.3
        } else {
            Vec3::new(out.x, out.y * 0.5, out.z) + Vec3::Y * 0.22 + s.child("face").direction() * 0.5
        };
        let z = (face - y * face.dot(y)).try_normalize().unwrap_or_else(|| Frame::along(y).z);
        [y.cross(z), y, z]
    };
    let spread = params.leaf_spread.clamp(0.0, 0.9);
    let taper = if rows { tapered(site.location) } else { 1.0 };
    let size = wood.leaf * scale * taper * (1.0 + spread * s.child("size").range(-1.0, 1.0));
    let card = |axes| Card { base: pose.position, axes, size };
    let [x, y, z] = room.first_free((0..TURNS).map(axes), card)?;
    let local = |v| pose.frame.to_local(v);
    let orientation = Rotation::from_axes(local(x), local(y), local(z));
    let slot = s.child("slot").index(usize::from(params.pictures.max(1))) as u16;
    (card([x, y, z]).lowest() >= wood.ground).then(|| Leaf::new(site.chain, site.location, orientation, size, slot))
}
