//! Finds where branches overlap and where their axes cross.

use glam::Vec3;
use rayon::prelude::*;

use super::wood::{Capsules, Wood, ZONE};
use crate::plant::ChainId;

/// Share of a branch's surface that may lie in others.
pub(super) const LIMIT: f32 = 0.01;
/// Up to this many times the sum of their radii along the wood, two places are at a fork.
const FORK: f32 = 6.0;
/// Axes cross where they are closer than this share of the sum of their radii.
const CROSSING: f32 = 0.1;
/// Least sine of the angle between two axes that pass each other; below it they run side by side.
const ACROSS: f32 = 0.3;
/// How much further than needed places are moved.
const FURTHER: f32 = 1.1;

/// The deepest overlap of a capsule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// Share of the capsule's surface that is inside.
    pub(super) share: f32,
    /// The point in which the other's capsule ends.
    pub(super) other: u32,
    /// Where on the own capsule, as a share.
    pub(super) at: f32,
    /// The way out, for the thinner of two; zero for the thicker.
    pub(super) out: Vec3,
    /// Whether the axes cross.
    pub(super) crosses: bool,
}

/// Where a point's disc meets the capsule that ends in another, as a share along that, and the sum of their radii there.
pub(super) fn meeting(wood: &Wood<'_>, i: usize, j: usize) -> Option<(f32, f32)> {
    let (foot, along) = (wood.at(j - 1), wood.at(j) - wood.at(j - 1));
    let t = ((wood.at(i) - foot).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    let reach = wood.radius_at(j, t) + wood.radius(i);
    (wood.at(i).distance_squared(foot + along * t) < reach * reach).then_some((t, reach))
}

/// Which points are at the fork of their chain: it has not left the wood of its kin yet. Chains that are not `active` are
/// as they were `before`.
pub(super) fn fused(wood: &Wood<'_>, capsules: &Capsules, active: &[bool], before: Vec<bool>) -> Vec<bool> {
    let ids: Vec<ChainId> = wood.plant.chain_ids().filter(|id| active[id.index()]).collect();
    let ends: Vec<usize> = ids
        .par_iter()
        .with_min_len(32)
        .map(|&id| {
            let span = wood.plant.span(id);
            let (start, zone) = wood.base[id.index()];
            let mut last = span.start;
            for i in span.start + 1..span.end {
                if wood.arc[i] - start > zone {
                    break;
                }
                let touches = capsules.near(wood.at(i) - wood.radius(i), wood.at(i) + wood.radius(i)).any(|j| {
                    let j = j as usize;
                    wood.chain[j] != id.0
                        && meeting(wood, i, j)
                            .is_some_and(|(t, reach)| wood.way((i, 1.0), (j, t)) <= zone + ZONE * reach)
                });
                if !touches {
                    break;
                }
                last = i;
            }
            last
        })
        .collect();
    let mut fused = before;
    for (id, end) in ids.iter().zip(ends) {
        let span = wood.plant.span(*id);
        fused[span.start..=end].fill(true);
        fused[end + 1..span.end].fill(false);
    }
    fused
}

/// The closest places of two segments, as shares along them (Ericson 2005, 5.1.9); neither has no length.
pub(super) fn closest([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> (f32, f32) {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, vv, uv) = (u.length_squared(), v.length_squared(), u.dot(v));
    let (uw, vw) = (u.dot(w), v.dot(w));
    let across = uu * vv - uv * uv;
    let s = if across > 1e-6 * uu * vv { ((uv * vw - uw * vv) / across).clamp(0.0, 1.0) } else { 0.5 };
    let t = (uv * s + vw) / vv;
    if (0.0..=1.0).contains(&t) {
        return (s, t);
    }
    let t = t.clamp(0.0, 1.0);
    (((uv * t - uw) / uu).clamp(0.0, 1.0), t)
}

/// The deepest overlap of the capsule that ends in a point with those of other chains.
pub(super) fn hit(wood: &Wood<'_>, capsules: &Capsules, fused: &[bool], i: usize) -> Option<Hit> {
    if wood.is_first(i) || fused[i] {
        return None;
    }
    let (own, ends) = (wood.chain[i], [wood.at(i - 1), wood.at(i)]);
    let length = ends[0].distance(ends[1]);
    if length <= 0.0 {
        return None;
    }
    let heading = (ends[1] - ends[0]) / length;
    let mut deepest: Option<Hit> = None;
    let thick = wood.radius(i).max(wood.radius(i - 1));
    for j in capsules.near(ends[0].min(ends[1]) - thick, ends[0].max(ends[1]) + thick) {
        let j = j as usize;
        let other = [wood.at(j - 1), wood.at(j)];
        if own == wood.chain[j] || other[0] == other[1] {
            continue;
        }
        let (s, t) = closest(ends, other);
        let (r, theirs) = (wood.radius_at(i, s), wood.radius_at(j, t));
        let off = ends[0].lerp(ends[1], s) - other[0].lerp(other[1], t);
        let (far, reach) = (off.length(), r + theirs);
        if far >= reach {
            continue;
        }
        let way = wood.way((i, s), (j, t));
        if way <= FORK * reach || (fused[j] && way <= wood.base[wood.chain[j] as usize].1 + ZONE * reach) {
            continue;
        }
        let across = heading.cross((other[1] - other[0]).normalize_or(Vec3::ZERO));
        let sine = across.length();
        // How long the one is inside the other, and how deep on the mean.
        let inside = (2.0 * (reach * reach - far * far).sqrt() / sine.max(1e-3)).min(length);
        let depth = ((reach - far) / (2.0 * r).max(f32::MIN_POSITIVE)).min(1.0);
        let share = depth * (2.0 / 3.0) * inside / length;
        let thinner = (r, wood.chain[j]) <= (theirs, own);
        // Where axes cross, all places go to the side on which their axis passes; each its own way out, those before and
        // behind the other would part and never get free.
        let out = if !thinner {
            Vec3::ZERO
        } else if sine >= ACROSS {
            let across = across / sine;
            let side = off.dot(across);
            across * ((reach - side.abs()) * FURTHER).copysign(side)
        } else {
            let across = (other[1] - other[0]).any_orthogonal_vector().normalize_or(Vec3::X);
            off.try_normalize().unwrap_or(across) * ((reach - far) * FURTHER)
        };
        let crosses = far < CROSSING * reach;
        let rank = (crosses, share, out.length_squared());
        if deepest.is_none_or(|d| rank > (d.crosses, d.share, d.out.length_squared())) {
            deepest = Some(Hit { share, other: j as u32, at: s, out, crosses });
        }
    }
    deepest
}

/// The overlaps of some chains.
pub(super) struct Found {
    pub(super) hits: Vec<(usize, Hit)>,
    /// How much of each chain's surface lies in others.
    pub(super) shares: Vec<f32>,
    /// Which chains' axes cross others.
    pub(super) crossed: Vec<bool>,
    /// Which points are at the fork of their chain.
    pub(super) fused: Vec<bool>,
}

impl Found {
    /// Whether a chain must be mended.
    pub(super) fn bad(&self, chain: usize) -> bool {
        self.shares[chain] > LIMIT || self.crossed[chain]
    }

    pub(super) fn count(&self) -> usize {
        (0..self.shares.len()).filter(|&chain| self.bad(chain)).count()
    }
}

/// Looks at all chains, or, where a round was there `before`, at those that are `active` since.
pub(super) fn find(wood: &Wood<'_>, active: &[bool], before: Option<Vec<bool>>) -> Found {
    let capsules = Capsules::of(wood, before.as_ref().map(|_| active));
    let fused = match before {
        None => fused(wood, &capsules, &vec![true; active.len()], vec![false; wood.chain.len()]),
        Some(before) => fused(wood, &capsules, active, before),
    };
    let look = |wanted: &[bool]| -> Vec<(usize, Hit)> {
        let points: Vec<usize> = (0..wood.chain.len()).filter(|&i| wanted[wood.chain[i] as usize]).collect();
        let all: Vec<_> = points.par_iter().with_min_len(256).map(|&i| hit(wood, &capsules, &fused, i)).collect();
        points.into_iter().zip(all).filter_map(|(i, hit)| Some((i, hit?))).collect()
    };
    let mut hits = look(active);
    // Those that a moved one has come into, which did not move themselves.
    let mut met = vec![false; active.len()];
    for (_, hit) in &hits {
        let other = wood.chain[hit.other as usize] as usize;
        met[other] = !active[other];
    }
    if met.contains(&true) {
        hits.extend(look(&met));
    }
    let mut surface = vec![(0.0_f64, 0.0_f64); active.len()];
    let mut crossed = vec![false; active.len()];
    let area = |i: usize| f64::from(wood.radius(i) * (wood.arc[i] - wood.arc[i - 1]));
    for i in (0..wood.chain.len()).filter(|&i| !wood.is_first(i)) {
        surface[wood.chain[i] as usize].1 += area(i);
    }
    for (i, hit) in &hits {
        surface[wood.chain[*i] as usize].0 += area(*i) * f64::from(hit.share);
        crossed[wood.chain[*i] as usize] |= hit.crosses;
    }
    let shares = surface.iter().map(|(inside, all)| if *all > 0.0 { (inside / all) as f32 } else { 0.0 }).collect();
    Found { hits, shares, crossed, fused }
}
