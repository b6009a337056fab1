//! The hierarchy of line-swept spheres around a plant's wood, and the pairs of segments that touch (2017 TVCG, 4.4).
//!
//! Wood is cut into *pieces* of up to [`PIECE`] segments of one branch, each within a line-swept sphere (a capsule) from
//! its first to its last point. Pieces are sorted along a space-filling curve (Morton 1966); runs of [`LEAF`] of them are
//! the leaves of a binary tree of boxes, level after level in flat arrays. One descent of the tree against itself finds
//! boxes that overlap, then capsules of pieces, then capsules of segments.
//!
//! Building is n log n in the pieces, the descent is n log n and what touches. Above the pieces there are boxes, since
//! two boxes are told apart by 6 comparisons and two capsules by a closest-point search.
//!
//! Limits: a plant in which more than [`MOST_CONTACTS`] pairs of segments a segment touch (nothing that grows) is looked
//! at up to there.

use glam::Vec3;

use super::wood::Wood;

/// Most segments of a piece.
const PIECE: usize = 4;
/// Pieces of a leaf of the tree.
const LEAF: usize = 4;
/// Most touching pairs, a segment.
const MOST_CONTACTS: usize = 64;

/// Two segments of different branches whose capsules touch, by the points where they begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Contact {
    /// The branches, the first with the smaller index.
    pub(super) chains: (u32, u32),
    /// The segment of each.
    pub(super) segments: (u32, u32),
}

#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const NONE: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.low.x <= other.high.x
            && other.low.x <= self.high.x
            && self.low.z <= other.high.z
            && other.low.z <= self.high.z
            && self.low.y <= other.high.y
            && other.low.y <= self.high.y
    }
}

/// A run of segments of one branch.
#[derive(Clone, Copy, Debug)]
struct Piece {
    bounds: Bounds,
    chain: u32,
    /// Its first point.
    first: u32,
    /// How many segments.
    segments: u32,
    /// Of the capsule from its first to its last point.
    radius: f32,
}

/// All pairs of segments that touch, sorted.
pub(super) fn contacts(wood: &Wood) -> Vec<Contact> {
    let pieces = sorted_pieces(wood);
    let levels = levels(&pieces);
    let mut found = Vec::new();
    let most = wood.points.len() * MOST_CONTACTS;
    // Pairs of boxes of one level; a box against itself stands for all pairs within it.
    let mut work: Vec<(usize, usize, usize)> = vec![(levels.len() - 1, 0, 0)];
    while let Some((level, i, j)) = work.pop() {
        if found.len() >= most {
            break;
        }
        if i != j && !levels[level][i].overlaps(&levels[level][j]) {
            continue;
        }
        if level == 0 {
            let run = |k: usize| k * LEAF..((k + 1) * LEAF).min(pieces.len());
            for p in run(i) {
                if i != j && !pieces[p].bounds.overlaps(&levels[0][j]) {
                    continue;
                }
                let others = if i == j { p + 1..run(j).end } else { run(j) };
                for q in others {
                    if pieces[p].chain != pieces[q].chain && pieces[p].bounds.overlaps(&pieces[q].bounds) {
                        touching_segments(wood, &pieces[p], &pieces[q], &mut found);
                    }
                }
            }
            continue;
        }
        let below = levels[level - 1].len();
        for a in 2 * i..(2 * i + 2).min(below) {
            for b in 2 * j..(2 * j + 2).min(below) {
                if i != j || a <= b {
                    work.push((level - 1, a, b));
                }
            }
        }
    }
    found.sort_unstable();
    found
}

/// The pieces of all branches along a space-filling curve.
fn sorted_pieces(wood: &Wood) -> Vec<Piece> {
    let chains = wood.surfaces.len();
    let mut pieces: Vec<Piece> = Vec::with_capacity(wood.points.len() / PIECE + chains);
    let mut whole = Bounds::NONE;
    for chain in 0..chains {
        let span = wood.span(chain);
        let mut first = span.start;
        while first + 1 < span.end {
            let last = (first + PIECE).min(span.end - 1);
            let mut bounds = Bounds::NONE;
            let (a, b) = (wood.points[first], wood.points[last]);
            let along = b - a;
            let scale = 1.0 / along.length_squared().max(f32::MIN_POSITIVE);
            let mut radius = 0.0_f32;
            for k in first..=last {
                // The capsule of a segment is as thick as its thicker end.
                let r = wood.radii[k.max(first + 1) - 1].max(wood.radii[k]).max(wood.radii[(k + 1).min(last)]);
                let p = wood.points[k];
                bounds = bounds.with(Bounds { low: p - r, high: p + r });
                let t = ((p - a).dot(along) * scale).clamp(0.0, 1.0);
                radius = radius.max(p.distance(a + along * t) + r);
            }
            whole = whole.with(bounds);
            let (chain, segments) = (chain as u32, (last - first) as u32);
            pieces.push(Piece { bounds, chain, first: first as u32, segments, radius });
            first = last;
        }
    }
    let scale = 1023.0 / (whole.high - whole.low).max_element().max(f32::MIN_POSITIVE);
    let mut order: Vec<u64> = pieces
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let c = ((p.bounds.low + p.bounds.high) * 0.5 - whole.low) * scale;
            // A cast of NaN gives 0, of what is too large the most.
            let code = spread(c.x as u32) | spread(c.y as u32) << 1 | spread(c.z as u32) << 2;
            (u64::from(code) << 32) | i as u64
        })
        .collect();
    order.sort_unstable();
    order.into_iter().map(|key| pieces[(key & 0xffff_ffff) as usize]).collect()
}

/// The lowest 10 bits with two zeros between each.
fn spread(x: u32) -> u32 {
    let x = x.min(1023);
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// Boxes of runs of pieces, then of pairs of the level below, up to a single one.
fn levels(pieces: &[Piece]) -> Vec<Vec<Bounds>> {
    let unite = |run: &[Bounds]| run.iter().fold(Bounds::NONE, |all, b| all.with(*b));
    let mut levels: Vec<Vec<Bounds>> =
        vec![pieces.chunks(LEAF).map(|run| run.iter().fold(Bounds::NONE, |all, p| all.with(p.bounds))).collect()];
    if pieces.is_empty() {
        levels[0].push(Bounds::NONE);
    }
    while levels[levels.len() - 1].len() > 1 {
        let next = levels[levels.len() - 1].chunks(2).map(unite).collect();
        levels.push(next);
    }
    levels
}

fn touching_segments(wood: &Wood, p: &Piece, q: &Piece, found: &mut Vec<Contact>) {
    let end = |piece: &Piece| (piece.first + piece.segments) as usize;
    let (a, b) = (wood.points[p.first as usize], wood.points[end(p)]);
    let (c, d) = (wood.points[q.first as usize], wood.points[end(q)]);
    let reach = p.radius + q.radius;
    if distance_squared(a, b, c, d) >= reach * reach {
        return;
    }
    for i in p.first as usize..end(p) {
        for j in q.first as usize..end(q) {
            let reach = wood.radii[i].max(wood.radii[i + 1]) + wood.radii[j].max(wood.radii[j + 1]);
            let apart = distance_squared(wood.points[i], wood.points[i + 1], wood.points[j], wood.points[j + 1]);
            if apart < reach * reach {
                let (i, j) = (i as u32, j as u32);
                found.push(match p.chain < q.chain {
                    true => Contact { chains: (p.chain, q.chain), segments: (i, j) },
                    false => Contact { chains: (q.chain, p.chain), segments: (j, i) },
                });
            }
        }
    }
}

/// Squared distance of the segments `ab` and `cd` (Ericson, Real-Time Collision Detection, 5.1.9).
pub(super) fn distance_squared(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> f32 {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, vv, uv) = (u.dot(u), v.dot(v), u.dot(v));
    let (uw, vw) = (u.dot(w), v.dot(w));
    let cross = uu * vv - uv * uv;
    let mut s = if cross > 1e-9 * uu * vv { ((uv * vw - vv * uw) / cross).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = 0.0;
    if vv > 0.0 {
        t = (uv * s + vw) / vv;
        if !(0.0..=1.0).contains(&t) {
            t = t.clamp(0.0, 1.0);
            s = if uu > 0.0 { ((uv * t - uw) / uu).clamp(0.0, 1.0) } else { 0.0 };
        }
    } else if uu > 0.0 {
        s = (-uw / uu).clamp(0.0, 1.0);
    }
    (w + u * s - v * t).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn the_descent_finds_what_trying_all_pairs_finds() {
        for seed in 0..30 {
            let plant = random_plant(Seed::new(seed), 60, if seed % 2 == 0 { Oddity::Tame } else { Oddity::Wild });
            let wood = Wood::of(&plant, &plant.pose());
            let mut all = Vec::new();
            for a in 0..plant.chains().len() {
                for b in a + 1..plant.chains().len() {
                    for i in wood.span(a).skip(1).map(|i| i - 1) {
                        for j in wood.span(b).skip(1).map(|j| j - 1) {
                            let r = &wood.radii;
                            let reach = r[i].max(r[i + 1]) + r[j].max(r[j + 1]);
                            let p = &wood.points;
                            if distance_squared(p[i], p[i + 1], p[j], p[j + 1]) < reach * reach {
                                let (chains, segments) = ((a as u32, b as u32), (i as u32, j as u32));
                                all.push(Contact { chains, segments });
                            }
                        }
                    }
                }
            }
            assert!(contacts(&wood) == all, "seed {seed}");
        }
    }

    #[test]
    fn segment_distances_are_those_of_dense_samples() {
        for k in 0..300 {
            let seed = Seed::new(k);
            let at = |i: u64| seed.at(i).direction() * seed.at(i + 9).range(0.0, 2.0);
            let (a, b, c) = (at(0), at(1), at(2));
            // Every third pair is parallel.
            let d = if k % 3 == 0 { c + (b - a) * 0.5 } else { at(3) };
            let mut least = f32::MAX;
            for i in 0..=100 {
                for j in 0..=100 {
                    least = least.min(a.lerp(b, i as f32 / 100.0).distance_squared(c.lerp(d, j as f32 / 100.0)));
                }
            }
            let found = distance_squared(a, b, c, d);
            assert!(found <= least + 1e-5 && found.sqrt() > least.sqrt() - 0.05, "{k}: {found} {least}");
        }
    }

    #[test]
    fn no_wood_has_no_contacts() {
        assert!(contacts(&Wood { starts: vec![0], ..Wood::default() }).is_empty());
    }
}
