//! The hierarchy of line-swept spheres around a plant's wood, and what touches in it (2017 TVCG, 4.4).
//!
//! Wood is cut into *sections*: runs of up to [`MOST_SEGMENTS`] segments of one branch, each within a line-swept sphere (a
//! capsule) from its first to its last point, that are nearly straight. Sections are sorted along a space-filling curve
//! (Morton 1966); runs of [`LEAF`] of them are the leaves of a binary tree of boxes, level after level in flat arrays.
//! One descent of the tree against itself finds boxes that overlap, then capsules of sections. Two sections that touch
//! have a bound from above for the surface of the one inside the other, by which nearly all pairs of branches are told
//! apart without a look at their segments; for the rest [`contacts`] gives the segments that touch.
//!
//! Building is n log n in the sections, the descent is n log n and what touches. Above the sections there are boxes, since
//! two boxes are told apart by 6 comparisons and two capsules by a closest-point search.
//!
//! Limits: a plant in which more than [`MOST_TOUCHES`] pairs of sections a point touch (nothing that grows) is looked
//! at up to there.

use glam::Vec3;

use super::wood::{Wood, strip};

/// Most segments of a section.
const MOST_SEGMENTS: usize = 8;
/// A section that leaves its chord by more than its thickness and this share of the chord is cut in two.
const BULGE: f32 = 0.03;
/// Sections of a leaf of the tree.
const LEAF: usize = 4;
/// Most touching pairs, a point.
const MOST_TOUCHES: usize = 64;

/// Two segments of different branches whose capsules touch, by the points where they begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Contact {
    /// The segment of the branch with the smaller index, and of the other.
    pub(super) segments: (u32, u32),
}

/// Two sections of different branches whose capsules touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Touch {
    /// The branches, the first with the smaller index.
    pub(super) chains: (u32, u32),
    /// The section of each.
    sections: (u32, u32),
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
        // Without branches: which of the six fails can't be foretold.
        (self.low.x <= other.high.x)
            & (other.low.x <= self.high.x)
            & (self.low.z <= other.high.z)
            & (other.low.z <= self.high.z)
            & (self.low.y <= other.high.y)
            & (other.low.y <= self.high.y)
    }
}

/// A run of segments of one branch.
#[derive(Clone, Copy, Debug)]
struct Section {
    bounds: Bounds,
    chain: u32,
    /// Its first point.
    first: u32,
    /// How many segments.
    segments: u32,
    /// Of the capsule from its first to its last point.
    radius: f32,
    /// The greatest radius of its wood.
    thickness: f32,
}

/// The sections of a plant's wood, and which of them touch.
#[derive(Clone, Debug)]
pub(super) struct Sections {
    sections: Vec<Section>,
}

impl Sections {
    /// Cuts wood.
    pub(super) fn of(wood: &Wood) -> Self {
        Self { sections: sorted(wood) }
    }

    /// All pairs of sections that touch, sorted by their branches.
    pub(super) fn touching(&self, wood: &Wood) -> Vec<Touch> {
        let sections = &self.sections[..];
        let levels = levels(sections);
        let mut found = Vec::new();
        let most = wood.points.len() * MOST_TOUCHES;
        // Pairs of boxes of one level; a box against itself stands for all pairs within it.
        let mut work: Vec<(usize, usize, usize)> = vec![(levels.len() - 1, 0, 0)];
        while let Some((level, i, j)) = work.pop() {
            if found.len() >= most {
                break;
            }
            if level == 0 {
                let run = |k: usize| k * LEAF..((k + 1) * LEAF).min(sections.len());
                for p in run(i) {
                    if i != j && !sections[p].bounds.overlaps(&levels[0][j]) {
                        continue;
                    }
                    let others = if i == j { p + 1..run(j).end } else { run(j) };
                    for q in others {
                        let (a, b) = (&sections[p], &sections[q]);
                        if a.chain != b.chain && a.bounds.overlaps(&b.bounds) && touch(wood, a, b) {
                            let (p, q) = (p as u32, q as u32);
                            found.push(match a.chain < b.chain {
                                true => Touch { chains: (a.chain, b.chain), sections: (p, q) },
                                false => Touch { chains: (b.chain, a.chain), sections: (q, p) },
                            });
                        }
                    }
                }
                continue;
            }
            let below = &levels[level - 1];
            for a in 2 * i..(2 * i + 2).min(below.len()) {
                for b in 2 * j..(2 * j + 2).min(below.len()) {
                    if (i != j || a <= b) && (a == b || below[a].overlaps(&below[b])) {
                        work.push((level - 1, a, b));
                    }
                }
            }
        }
        found.sort_unstable();
        found
    }

    /// A bound from above for the surface of the first (or second) branch inside the other, by the sections of theirs
    /// that touch. As good as exact for straight sections, the whole of a section that turns back.
    pub(super) fn at_most(&self, wood: &Wood, touching: &[Touch], of_first: bool) -> f32 {
        let bound = |touch: &Touch| {
            let (p, q) = (&self.sections[touch.sections.0 as usize], &self.sections[touch.sections.1 as usize]);
            let (p, q) = if of_first { (p, q) } else { (q, p) };
            let (a, b, c, d) = ends(wood, p, q);
            let winding = winding(wood, p);
            if winding.is_finite() {
                // Whatever is inside the other lies within both radii of its axis, and the axes within their capsules.
                let (from, to) = near_stretch((a, b), (c, d), p.radius + q.radius);
                strip(a.distance(b) * (to - from) * winding, p.thickness, p.thickness)
            } else {
                let run = p.first as usize..(p.first + p.segments) as usize;
                let length: f32 = run.map(|i| wood.points[i].distance(wood.points[i + 1])).sum();
                strip(length, p.thickness, p.thickness)
            }
        };
        // A thousandth for rounding.
        touching.iter().map(bound).sum::<f32>() * 1.001
    }

    /// The segments of two branches that touch, of their sections that do; sorted.
    pub(super) fn contacts(&self, wood: &Wood, touching: &[Touch], found: &mut Vec<Contact>) {
        found.clear();
        for touch in touching {
            let (p, q) = (&self.sections[touch.sections.0 as usize], &self.sections[touch.sections.1 as usize]);
            let (c, d) = (wood.points[q.first as usize], wood.points[(q.first + q.segments) as usize]);
            for i in p.first as usize..(p.first + p.segments) as usize {
                let thick = wood.radii[i].max(wood.radii[i + 1]);
                let reach = thick + q.radius;
                if distance_squared(wood.points[i], wood.points[i + 1], c, d) >= reach * reach * 1.0001 {
                    continue;
                }
                for j in q.first as usize..(q.first + q.segments) as usize {
                    let reach = thick + wood.radii[j].max(wood.radii[j + 1]);
                    let apart =
                        distance_squared(wood.points[i], wood.points[i + 1], wood.points[j], wood.points[j + 1]);
                    if apart < reach * reach {
                        found.push(Contact { segments: (i as u32, j as u32) });
                    }
                }
            }
        }
        found.sort_unstable();
    }
}

/// The ends of two sections.
fn ends(wood: &Wood, p: &Section, q: &Section) -> (Vec3, Vec3, Vec3, Vec3) {
    let end = |s: &Section| (wood.points[s.first as usize], wood.points[(s.first + s.segments) as usize]);
    let ((a, b), (c, d)) = (end(p), end(q));
    (a, b, c, d)
}

fn touch(wood: &Wood, p: &Section, q: &Section) -> bool {
    let (a, b, c, d) = ends(wood, p, q);
    let reach = p.radius + q.radius;
    // A hair more, as segments that just touch must not be lost by rounding.
    distance_squared(a, b, c, d) < reach * reach * 1.0001
}

/// The sections of all branches along a space-filling curve.
fn sorted(wood: &Wood) -> Vec<Section> {
    let chains = wood.surfaces.len();
    let mut sections: Vec<Section> = Vec::with_capacity(wood.points.len() / 4 + chains);
    let mut whole = Bounds::NONE;
    for chain in 0..chains {
        let span = wood.span(chain);
        let mut first = span.start;
        while first + 1 < span.end {
            let mut count = (span.end - 1 - first).min(MOST_SEGMENTS);
            let mut cut = section(wood, chain, first, count);
            let chord = wood.points[first].distance(wood.points[first + count]);
            if count > 1 && cut.radius > cut.thickness * 2.0 && cut.radius - cut.thickness > BULGE * chord {
                count = count.div_ceil(2);
                cut = section(wood, chain, first, count);
            }
            whole = whole.with(cut.bounds);
            sections.push(cut);
            first += count;
        }
    }
    let scale = 1023.0 / (whole.high - whole.low).max_element().max(f32::MIN_POSITIVE);
    let mut order: Vec<u64> = sections
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
    order.into_iter().map(|key| sections[(key & 0xffff_ffff) as usize]).collect()
}

/// The section of so many segments from a point on.
fn section(wood: &Wood, chain: usize, first: usize, count: usize) -> Section {
    let last = first + count;
    let (a, b) = (wood.points[first], wood.points[last]);
    let along = b - a;
    let square = along.length_squared();
    let scale = 1.0 / square.max(f32::MIN_POSITIVE);
    let (mut bulge, mut thickness) = (0.0_f32, wood.radii[first].max(wood.radii[last]));
    for (p, r) in wood.points[first + 1..last].iter().zip(&wood.radii[first + 1..last]) {
        let t = ((*p - a).dot(along) * scale).clamp(0.0, 1.0);
        let apart = p.distance_squared(a + along * t);
        bulge = if apart > bulge { apart } else { bulge };
        thickness = if *r > thickness { *r } else { thickness };
    }
    // The distance of a segment from the chord is greatest at an end, and the thickest stands for all; a hair for rounding.
    let radius = bulge.sqrt() * 1.0001 + thickness;
    let bounds = Bounds { low: a.min(b) - radius, high: a.max(b) + radius };
    Section { bounds, chain: chain as u32, first: first as u32, segments: count as u32, radius, thickness }
}

/// The most that a stretch of a section is longer than its projection on the chord; infinite where it turns back.
fn winding(wood: &Wood, section: &Section) -> f32 {
    let (first, last) = (section.first as usize, (section.first + section.segments) as usize);
    if section.segments == 1 {
        return 1.0;
    }
    let along = wood.points[last] - wood.points[first];
    let square = along.length_squared();
    let most = wood.points[first..=last].windows(2).fold(1.0_f32, |most, p| {
        let step = p[1] - p[0];
        let advance = step.dot(along);
        let ratio = step.length_squared() * square / (advance * advance);
        // A step back winds without end, and so does what is not a number.
        if advance > 0.0 && ratio.is_finite() { most.max(ratio) } else { f32::INFINITY }
    });
    most.sqrt()
}

/// The lowest 10 bits with two zeros between each.
fn spread(x: u32) -> u32 {
    let x = x.min(1023);
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// Boxes of runs of sections, then of pairs of the level below, up to a single one.
fn levels(sections: &[Section]) -> Vec<Vec<Bounds>> {
    let unite = |run: &[Bounds]| run.iter().fold(Bounds::NONE, |all, b| all.with(*b));
    let mut levels: Vec<Vec<Bounds>> =
        vec![sections.chunks(LEAF).map(|run| run.iter().fold(Bounds::NONE, |all, p| all.with(p.bounds))).collect()];
    if sections.is_empty() {
        levels[0].push(Bounds::NONE);
    }
    while levels[levels.len() - 1].len() > 1 {
        let next = levels[levels.len() - 1].chunks(2).map(unite).collect();
        levels.push(next);
    }
    levels
}

/// The stretch of the segment `i`, as shares of it, that can be within `reach` of the segment `j`: where it is inside the
/// slab of points that are nearer than that to the other's line, wider at the ends of the other.
pub(super) fn near_stretch(i: (Vec3, Vec3), j: (Vec3, Vec3), reach: f32) -> (f32, f32) {
    let (u, v) = (i.1 - i.0, j.1 - j.0);
    let length = v.length();
    if length <= 0.0 {
        return (0.0, 1.0);
    }
    let axis = v / length;
    // |w + t·u − its part along the axis|² = reach², a quadratic in t.
    let w = i.0 - j.0;
    let (across, start) = (u - axis * u.dot(axis), w - axis * w.dot(axis));
    let (qa, qb, qc) = (across.length_squared(), across.dot(start), start.length_squared() - reach * reach);
    let (mut from, mut to) = (0.0_f32, 1.0_f32);
    if qa > 1e-12 * u.length_squared() {
        let root = (qb * qb - qa * qc).max(0.0).sqrt();
        (from, to) = ((-qb - root) / qa, (-qb + root) / qa);
    }
    // And between the planes at the ends of the other, `reach` further out.
    let (rise, height) = (u.dot(axis), w.dot(axis));
    if rise.abs() > 1e-6 * length.max(reach) {
        let (x, y) = ((-reach - height) / rise, (length + reach - height) / rise);
        from = from.max(x.min(y));
        to = to.min(x.max(y));
    }
    (from.clamp(0.0, 1.0), to.clamp(0.0, 1.0).max(from.clamp(0.0, 1.0)))
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

    /// All pairs of branches with segments that touch, by trying all.
    fn by_all_pairs(wood: &Wood) -> Vec<((u32, u32), Vec<Contact>)> {
        let mut all = Vec::new();
        let chains = wood.surfaces.len();
        for a in 0..chains {
            for b in a + 1..chains {
                let mut own = Vec::new();
                for i in wood.span(a).skip(1).map(|i| i - 1) {
                    for j in wood.span(b).skip(1).map(|j| j - 1) {
                        let r = &wood.radii;
                        let reach = r[i].max(r[i + 1]) + r[j].max(r[j + 1]);
                        let p = &wood.points;
                        if distance_squared(p[i], p[i + 1], p[j], p[j + 1]) < reach * reach {
                            own.push(Contact { segments: (i as u32, j as u32) });
                        }
                    }
                }
                if !own.is_empty() {
                    all.push(((a as u32, b as u32), own));
                }
            }
        }
        all
    }

    #[test]
    fn the_descent_finds_what_trying_all_pairs_finds() {
        for seed in 0..30 {
            let plant = random_plant(Seed::new(seed), 60, if seed % 2 == 0 { Oddity::Tame } else { Oddity::Wild });
            let wood = Wood::of(&plant, &plant.pose());
            let sections = Sections::of(&wood);
            let mut found = Vec::new();
            for pair in sections.touching(&wood).chunk_by(|x, y| x.chains == y.chains) {
                let mut own = Vec::new();
                sections.contacts(&wood, pair, &mut own);
                if !own.is_empty() {
                    found.push((pair[0].chains, own));
                }
            }
            assert!(found == by_all_pairs(&wood), "seed {seed}");
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
        let wood = Wood { starts: vec![0], ..Wood::default() };
        assert!(Sections::of(&wood).touching(&wood).is_empty());
    }
}
