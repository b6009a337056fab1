//! Where the rings of a tube go: the chain's axis as a smooth curve, the collar at its base, and as few rings as an
//! error bound allows.
//!
//! The axis is the centripetal Catmull-Rom curve through the chain's points (Yuksel et al. 2011), cut finely where it
//! bends. Radii are linear between points, widened by the collar at a fork, the flare at the ground,
//! and shoulders where wood is at once much thinner. Then rings are
//! dropped as Douglas and Peucker (1973) drop points, in position and radius at once, so that the surface moves by less
//! than the bound; in windows of [`WINDOW`] rings, which keeps the worst case linear. Each ring that stays knows up to which
//! bound it does, so that coarser levels are chosen of it and not made anew. At last rings go that would cut into
//! their neighbours, whatever the bound: a bend sharper than the wood is wide has no surface of its own inside.

use glam::Vec3;

use crate::base::math;
use crate::preset::plan::Forks;

/// Candidate rings that are thinned together; the ring between two windows always stays.
const WINDOW: usize = 96;

/// How much a thick axis may thin per metre where a branch has left it: the plant steps there at once from the wood of
/// both to the wood of one, a tree takes its time.
const TAPER: f32 = 0.12;

/// What is left of wood where it is at once too thin to be eased, how far up a shoulder goes there, in what it is thinner by, and in how
/// many parts; where wood goes on for less than so many times as far, it is an end.
const STEP: f32 = 0.6;
const SHOULDER: f32 = 1.3;
const CUTS: usize = 5;
const GOES_ON: f32 = 2.0;

/// How far up a stem may flare, in its radius at the ground.
const FLARED: f32 = 2.5;

/// How many fades up nothing is left of what widens a base, to the last bit.
const FADED: f32 = 24.0;

/// A place on a tube's axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    /// On the axis, metres.
    pub(super) centre: Vec3,
    /// Metres, collar and flare included.
    pub(super) radius: f32,
    /// Arc length from the chain's base, metres.
    pub(super) arc: f32,
    /// Unit direction of the axis, smoothed over about a radius so that rings at a kink don't cut each other.
    pub(super) tangent: Vec3,
    /// Change of radius per metre of axis.
    pub(super) slope: f32,
    /// By how much the surface moves without it, metres; infinite for ends.
    pub(super) worth: f32,
}

/// What widens a tube at its base.
#[derive(Clone, Copy, Debug)]
pub(super) enum Base {
    /// A branch in its parent's wood.
    Fork {
        /// The parent's direction there, unit.
        axis: Vec3,
        /// The parent's radius there, metres.
        parent: f32,
        /// With a collar or without.
        forks: Forks,
    },
    /// A stem on the ground: how much wider than the wood it is at the very bottom, as a share.
    Ground {
        /// 0 leaves it as it is.
        flare: f32,
    },
}

/// How far from its parent's surface a branch is lit like it, in its own radius; half the parent's at most.
const SEAM: f32 = 1.2;
/// How much of the parent's normal a collar takes: less than all, so that no normal turns away from its triangle.
const TAKEN: f32 = 0.8;

impl Base {
    /// Whether no vertex of a ring is lit like the parent: see [`blended`](Self::blended).
    pub(super) fn is_clear_of(&self, foot: Vec3, ring: &Ring) -> bool {
        let Self::Fork { axis, parent, forks: Forks::Collar } = *self else { return true };
        let away = ring.centre - foot;
        let out = (away - axis * away.dot(axis)).length();
        // A hair more than it takes, for rounding.
        out - ring.radius > (parent + (SEAM * ring.radius).min(parent * 0.5).max(1e-6)) * 1.001 + out * 1e-5
    }

    /// The normal of a branch's skin at `place` as light is to see it: where a branch with a collar leaves its parent's
    /// wood, which is taken to be straight from `foot` on, it goes over into the parent's, so that the joint is no crease.
    pub(super) fn blended(&self, foot: Vec3, place: Vec3, normal: Vec3, radius: f32) -> Vec3 {
        let Self::Fork { axis, parent, forks: Forks::Collar } = *self else { return normal };
        let away = place - foot;
        let out = away - axis * away.dot(axis);
        let (squared, seam) = (out.length_squared(), (SEAM * radius).min(parent * 0.5).max(1e-6));
        // A hair more than where it ends, for rounding.
        if squared > (parent + seam) * (parent + seam) * 1.0001 || squared < 1e-30 {
            return normal;
        }
        let length = squared.sqrt();
        let share = 1.0 - math::smoothstep(0.0, seam, length - parent);
        (normal + out * (TAKEN * share / length)).normalize_or(normal)
    }
}

/// Where wood is at once much thinner, as a thick trunk is that many limbs leave at one place: it narrows as far up as it narrows by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shoulder {
    /// Arc length from the chain's base where it begins, how far up it goes, and the radius below, metres.
    at: f32,
    reach: f32,
    wide: f32,
}

impl Shoulder {
    /// The radius at an arc length, where that of the wood alone is `own`.
    pub(super) fn radius(&self, arc: f32, own: f32) -> f32 {
        if arc < self.at {
            return own;
        }
        own + (self.wide - own).max(0.0) * (1.0 - math::smoothstep(0.0, self.reach, arc - self.at))
    }
}

/// Makes a plant's radii of a chain those that it is meshed with: as they are, but thinning no faster than [`TAPER`] where a branch has
/// left. Adds where it has shoulders. Linear in points.
pub(super) fn taper(points: &[Vec3], tapered: &mut [f32], is_stem: bool, shoulders: &mut Vec<Shoulder>) {
    // A stem's own flare is as steep as it is, and what a branch begins with lies in its bearer.
    let flared = if is_stem { FLARED * tapered.first().copied().unwrap_or(0.0) } else { 0.0 };
    let mut along = 0.0;
    let mut rounded = 0.0;
    let mut whole: Option<f32> = None;
    for i in 1..tapered.len().min(points.len()) {
        let step = points[i - 1].distance(points[i]);
        let at = along;
        along += step;
        let before = tapered[i - 1];
        let least = before - step * TAPER;
        if along < flared || tapered[i] >= least {
            continue;
        }
        if tapered[i] > before * STEP {
            tapered[i] = least;
        } else if i > 1 && at >= flared.max(rounded) && step < before - tapered[i] {
            let reach = (before - tapered[i]) * SHOULDER;
            // Short cones and ends are meant to be steep.
            let whole = *whole.get_or_insert_with(|| points.windows(2).map(|ends| ends[0].distance(ends[1])).sum());
            let goes_on = whole - at >= reach * GOES_ON;
            if goes_on {
                shoulders.push(Shoulder { at, reach, wide: before });
                rounded = at + reach;
            }
        }
    }
}

/// What [`add_rings`] works in, to be used again.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    knots: Vec<(Vec3, f32)>,
    rounded: Vec<(Vec3, f32)>,
    fine: Vec<(Vec3, f32, f32)>,
    all: Vec<Ring>,
    stack: Vec<(usize, usize, f32)>,
}

/// Adds the rings of a chain to `to`, base first: at least two, at least `apart` metres from each other, or none for a chain
/// without length. They have no directions yet ([`unfold`]).
///
/// `points`, `radii` and `shoulders` ([`taper`]) are the chain's, in the world, of equal length the first two; radii are raised to
/// `thinnest`. Two points in one place count as one.
pub(super) fn add_rings(
    to: &mut Vec<Ring>,
    (points, radii, shoulders): (&[Vec3], &[f32], &[Shoulder]),
    base: Base,
    (error, thinnest): (f32, f32),
    scratch: &mut Scratch,
) {
    let apart = thinnest;
    let Scratch { knots, rounded, fine, all, stack } = scratch;
    knots.clear();
    for (&p, &r) in points.iter().zip(radii) {
        let r = r.max(thinnest);
        match knots.last_mut() {
            Some(last) if last.0.distance_squared(p) < apart * apart => last.1 = last.1.max(r),
            _ => knots.push((p, r)),
        }
    }
    // The tip is where the plant says, also when the last stretch was too short to stand alone.
    if knots.len() < 2 {
        return;
    }
    if !shoulders.is_empty() {
        round(knots, shoulders, apart, rounded);
    }
    subdivide(knots, error, fine);
    with_base(fine, base, error, apart, all);
    weigh(all, error, stack);
    to.extend(all.iter().filter(|ring| error <= 0.0 || ring.worth > error));
}

/// Gives knots the radii of shoulders, with knots of their own where they bend, `apart` from others.
fn round(knots: &mut Vec<(Vec3, f32)>, shoulders: &[Shoulder], apart: f32, rounded: &mut Vec<(Vec3, f32)>) {
    rounded.clear();
    rounded.push(knots[0]);
    let mut shoulders = shoulders.iter();
    let mut shoulder = shoulders.next();
    let mut along = 0.0;
    for pair in knots.windows(2) {
        let [(a, ra), (b, rb)] = [pair[0], pair[1]];
        let end = along + a.distance(b);
        // One that ends within the step may be followed by another.
        while let Some(round) = shoulder {
            for k in 1..=CUTS {
                let arc = round.at + round.reach * k as f32 / CUTS as f32;
                if arc > along + apart && arc < end - apart {
                    let t = (arc - along) / (end - along);
                    rounded.push((a.lerp(b, t), round.radius(arc, ra + (rb - ra) * t)));
                }
            }
            if round.at + round.reach > end {
                break;
            }
            shoulder = shoulders.next();
        }
        rounded.push((b, shoulder.map_or(rb, |round| round.radius(end, rb))));
        along = end;
    }
    std::mem::swap(knots, rounded);
}

/// Directs rings, and takes some away until none cuts into its neighbours: where thick wood bends sharper than it is wide, the
/// inner side of the tube would fold over, and its triangles face inward. Each round takes at least one and never two in a row, so that
/// rounds are few; two rings never fold.
pub(super) fn unfold(rings: &mut Vec<Ring>, grounded: bool) {
    loop {
        orient(rings);
        // Level with the ground, however the stem leans; only a stem that lies on it keeps its own way.
        if grounded && rings[0].tangent.y > 0.5 {
            let own = std::mem::replace(&mut rings[0].tangent, Vec3::Y);
            if folds(&rings[0], &rings[1]) {
                rings[0].tangent = own;
            }
        }
        let last = rings.len() - 1;
        let Some(first) = (0..last).find(|&i| folds(&rings[i], &rings[i + 1])) else { return };
        let mut gone = vec![false; rings.len()];
        let mut any = false;
        for i in first..last {
            if gone[i] || !folds(&rings[i], &rings[i + 1]) {
                continue;
            }
            // Of the two the one that stands nearer to its other neighbour: the tube loses least with it.
            let room = |k: usize, other: usize| {
                if k == 0 || k == last { f32::INFINITY } else { (rings[k].arc - rings[other].arc).abs() }
            };
            let (before, after) = (room(i, i.saturating_sub(1)), room(i + 1, (i + 2).min(last)));
            let victim = if before < after && !(i > 0 && gone[i - 1]) { i } else { i + 1 };
            if victim > 0 && victim < last {
                gone[victim] = true;
                any = true;
            }
        }
        if !any {
            return;
        }
        let mut gone = gone.into_iter();
        rings.retain(|_| !gone.next().unwrap_or(false));
    }
}

/// Which of two rings and more in a row such a share of their length lies above.
pub(super) fn span_at(rings: &[Ring], location: f32) -> usize {
    let last = rings.len() - 1;
    let arc = rings[last].arc * location;
    rings.partition_point(|ring| ring.arc <= arc).clamp(1, last) - 1
}

/// Moves the first ring to `foot`. Rings that it would fold with go, the next to it first, and how many did is returned: those that
/// are left lie at the end. Two are left at least; where these fold, the first stays where it was.
pub(super) fn stand(rings: &mut [Ring], foot: Vec3) -> usize {
    let first = rings[0];
    if first.centre.distance_squared(foot) < 1e-14 {
        return 0;
    }
    for gone in 0..rings.len() - 1 {
        let left = &mut rings[gone..];
        let next = left[1];
        let way = (next.centre - foot).normalize_or_zero();
        left[0] = Ring { centre: foot, tangent: way, ..first };
        if let Some(after) = left.get(2) {
            let on = (after.centre - next.centre).normalize_or_zero();
            left[1].tangent = (way + on).try_normalize().unwrap_or(next.tangent);
        } else {
            left[1].tangent = way;
        }
        let clear = next.centre.distance(foot) > first.radius.min(next.radius) * 0.05;
        if way != Vec3::ZERO && clear && !folds(&left[0], &left[1]) && left.get(2).is_none_or(|c| !folds(&left[1], c)) {
            return gone;
        }
        left[1] = next;
        left[0] = first;
    }
    0
}

/// Whether one of two rings in a row reaches through the plane of the other.
pub(super) fn folds(a: &Ring, b: &Ring) -> bool {
    let way = b.centre - a.centre;
    let sin = a.tangent.cross(b.tangent).length();
    let turned = a.tangent.dot(b.tangent) < 0.0;
    // A little more than nothing: what rounding leaves must still face outward.
    let least = way.length() * 0.02;
    turned || way.dot(a.tangent) - b.radius * sin < least || way.dot(b.tangent) - a.radius * sin < least
}

/// Points on the smooth axis: (position, radius, arc length).
fn subdivide(knots: &[(Vec3, f32)], error: f32, fine: &mut Vec<(Vec3, f32, f32)>) {
    let last = knots.len() - 1;
    fine.clear();
    fine.push((knots[0].0, knots[0].1, 0.0));
    let mut arc = 0.0;
    let mut bent = 0.0;
    for i in 0..last {
        let (b, c) = (knots[i].0, knots[i + 1].0);
        // Beyond an end the curve goes on as it came.
        let a = if i > 0 { knots[i - 1].0 } else { b + b - c };
        let d = if i + 2 <= last { knots[i + 2].0 } else { c + c - b };
        let length = b.distance(c);
        // A chord of an arc that turns by θ over a length L strays by about θ L / 8; k cuts divide that by k². Below
        // four times the error one cut is enough.
        let after = if i + 2 <= last { most_bend(c - b, d - c) } else { 0.0 };
        let most = after.max(std::mem::replace(&mut bent, after));
        let slight = error * 3.9 / (length * 0.125);
        let cuts = if error <= 0.0 {
            4
        } else if most < slight * slight {
            1
        } else {
            let bend = math::angle(b - a, c - b).max(math::angle(c - b, d - c));
            (bend * length * 0.125 / error).sqrt().clamp(1.0, 6.0) as usize
        };
        for k in 1..=cuts {
            let t = k as f32 / cuts as f32;
            let p = if k == cuts { c } else { catmull_rom(a, b, c, d, t) };
            let r = knots[i].1 + (knots[i + 1].1 - knots[i].1) * t;
            arc += if cuts == 1 { length } else { fine[fine.len() - 1].0.distance(p) };
            fine.push((p, r, arc));
        }
    }
}

/// The square of no less than the angle between two vectors, and of at most 1.6 times as much below a right one: the chord times
/// π/2, since arc tangents are most of the cost where nothing is bent.
fn most_bend(a: Vec3, b: Vec3) -> f32 {
    let both = a.length_squared() * b.length_squared();
    // Rounding must not take a bend away; what has no length has no angle worth cutting, but is asked.
    if !(both > 1e-20 && both.is_finite()) {
        return f32::INFINITY;
    }
    let cosine = a.dot(b) / both.sqrt();
    std::f32::consts::FRAC_PI_2 * std::f32::consts::FRAC_PI_2 * (2.0 - 2.0 * cosine + 1e-5).max(0.0)
}

/// The centripetal Catmull-Rom curve between `b` and `c`, by Barry and Goldman's pyramid.
fn catmull_rom(a: Vec3, b: Vec3, c: Vec3, d: Vec3, t: f32) -> Vec3 {
    let knot = |p: Vec3, q: Vec3| p.distance(q).sqrt().max(1e-4);
    let t0 = 0.0;
    let t1 = t0 + knot(a, b);
    let t2 = t1 + knot(b, c);
    let t3 = t2 + knot(c, d);
    let t = t1 + (t2 - t1) * t;
    let mix = |p: Vec3, q: Vec3, s: f32, e: f32| p * ((e - t) / (e - s)) + q * ((t - s) / (e - s));
    let (a1, a2, a3) = (mix(a, b, t0, t1), mix(b, c, t1, t2), mix(c, d, t2, t3));
    mix(mix(a1, a2, t0, t2), mix(a2, a3, t1, t3), t1, t2)
}

/// Lays the collar or the flare over the fine axis, with rings of their own where they need them.
fn with_base(fine: &[(Vec3, f32, f32)], base: Base, error: f32, apart: f32, rings: &mut Vec<Ring>) {
    let total = fine[fine.len() - 1].2;
    let own = fine[0].1;
    let mut stops = [f32::INFINITY; 5];
    // (where the widening is full, how fast it fades, how wide, widest at the axis)
    let (full, fade, wide, most) = match base {
        Base::Fork { axis, parent, forks } => {
            let surface = emergence(fine, axis, parent).min(total * 0.6);
            let wide = match forks {
                Forks::Collar => (0.36 * own).min((parent * 0.96 - own).max(0.0)),
                Forks::Plain => 0.0,
            };
            let fade = (own * 2.2).min((total - surface) * 0.5).max(apart);
            // A collar that moves the surface by less than the bound is not worth its rings.
            if wide > error * 0.5 {
                stops = [surface * 0.55, surface, surface + fade * 0.45, surface + fade, surface + fade * 2.0];
            } else if forks == Forks::Collar {
                stops[0] = surface;
            }
            (surface, fade, wide, (parent * 0.92).max(own.min(parent)))
        }
        Base::Ground { flare } => {
            let fade = (own * 1.5).min(total * 0.25).max(apart);
            if flare * own > error * 0.5 {
                stops = [fade * 0.3, fade * 0.7, fade * 1.2, fade * 2.0, fade * 3.0];
            }
            (0.0, fade, flare * own, f32::INFINITY)
        }
    };
    rings.clear();
    let mut next = 0;
    let per_fade = fade.recip();
    let mut push = |p: Vec3, r: f32, arc: f32, end: bool| {
        let past = ((arc - full) * per_fade).max(0.0);
        // Steep at the wood it leaves, flat where it ends.
        let r = if wide > 0.0 && past < FADED { r + wide * math::exp(-1.6 * past) } else { r };
        let r = if arc < full { r.min(most) } else { r };
        let ring = Ring { centre: p, radius: r, arc, tangent: Vec3::Y, slope: 0.0, worth: 0.0 };
        match rings.last_mut() {
            Some(last @ Ring { .. }) if arc - last.arc < apart => {
                if end {
                    *last = ring;
                }
            }
            _ => rings.push(ring),
        }
    };
    for i in 0..fine.len() {
        if i > 0 {
            let ((a, ra, sa), (b, rb, sb)) = (fine[i - 1], fine[i]);
            while next < stops.len() && stops[next] < sb {
                if stops[next] > sa {
                    let t = (stops[next] - sa) / (sb - sa);
                    push(a.lerp(b, t), ra + (rb - ra) * t, stops[next], false);
                }
                next += 1;
            }
        }
        push(fine[i].0, fine[i].1, fine[i].2, i + 1 == fine.len());
    }
}

/// Arc length at which a branch leaves a straight parent of radius `parent` with direction `axis`; the whole length if
/// it never does.
fn emergence(fine: &[(Vec3, f32, f32)], axis: Vec3, parent: f32) -> f32 {
    let away = |p: Vec3| {
        let d = p - fine[0].0;
        (d - axis * d.dot(axis)).length()
    };
    for pair in fine.windows(2) {
        let (before, after) = (away(pair[0].0), away(pair[1].0));
        if after >= parent {
            let t = if after > before { ((parent - before) / (after - before)).clamp(0.0, 1.0) } else { 1.0 };
            return pair[0].2 + (pair[1].2 - pair[0].2) * t;
        }
        // A branch that runs inside its parent for long: blend where it is, not at its tip.
        if pair[1].2 > parent * 4.0 {
            return pair[1].2;
        }
    }
    fine[fine.len() - 1].2
}

/// Says what each ring is worth: by how much the surface moves without it, as far as that is more than `error`. With those
/// that are worth more than any error the surface moves by no more than that.
fn weigh(rings: &mut [Ring], error: f32, stack: &mut Vec<(usize, usize, f32)>) {
    let last = rings.len() - 1;
    let error = error.max(0.0);
    for start in (0..last).step_by(WINDOW) {
        let end = (start + WINDOW).min(last);
        (rings[start].worth, rings[end].worth) = (f32::INFINITY, f32::INFINITY);
        stack.push((start, end, f32::INFINITY));
        while let Some((from, to, above)) = stack.pop() {
            let (a, b) = (rings[from], rings[to]);
            let (way, thinner, part) = (b.centre - a.centre, b.radius - a.radius, 1.0 / (b.arc - a.arc).max(1e-9));
            let mut worst = (error, from);
            for (i, ring) in (from + 1..).zip(&rings[from + 1..to]) {
                let t = (ring.arc - a.arc) * part;
                let aside = (ring.centre - a.centre - way * t).length_squared();
                let wider = ring.radius - a.radius - thinner * t;
                // Their sum squared is no more than twice the sum of squares: mostly that says enough. A hair more, for rounding.
                if (aside + wider * wider) * 2.001 > worst.0 * worst.0 {
                    let moved = aside.sqrt() + wider.abs();
                    if moved > worst.0 {
                        worst = (moved, i);
                    }
                }
            }
            if worst.1 > from {
                // Looked at only where the one above is kept.
                let worth = worst.0.min(above);
                rings[worst.1].worth = worth;
                stack.push((from, worst.1, worth));
                stack.push((worst.1, to, worth));
            }
        }
    }
}

/// Tangents and slopes of the rings that stay.
fn orient(rings: &mut [Ring]) {
    let last = rings.len() - 1;
    let mut direction = (rings[last].centre - rings[0].centre).normalize_or(Vec3::Y);
    let mut leave = Vec3::ZERO;
    for i in 0..=last {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
        let come = leave;
        leave = (rings[after].centre - rings[i].centre).normalize_or_zero();
        // The bisector: a mitre joint.
        direction = (leave + come).try_normalize().unwrap_or(direction);
        rings[i].tangent = direction;
        let run = rings[after].arc - rings[before].arc;
        rings[i].slope = if run > 0.0 { (rings[after].radius - rings[before].radius) / run } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The radii at heights of wood of these heights and radii, with its shoulders.
    fn rounded(wood: &[(f32, f32)], is_stem: bool) -> (usize, Vec<(f32, f32)>) {
        let points: Vec<Vec3> = wood.iter().map(|at| Vec3::Y * at.0).collect();
        let mut radii: Vec<f32> = wood.iter().map(|at| at.1).collect();
        let mut shoulders = Vec::new();
        taper(&points, &mut radii, is_stem, &mut shoulders);
        let mut knots: Vec<(Vec3, f32)> = points.into_iter().zip(radii).collect();
        round(&mut knots, &shoulders, 1e-4, &mut Vec::new());
        (shoulders.len(), knots.into_iter().map(|(p, r)| (p.y - wood[0].0, r)).collect())
    }

    fn at(knots: &[(f32, f32)], y: f32) -> f32 {
        let next = knots.iter().position(|knot| knot.0 >= y).unwrap();
        let ((a, ra), (b, rb)) = (knots[next - 1], knots[next]);
        ra + (rb - ra) * (y - a) / (b - a)
    }

    #[test]
    fn a_trunk_that_many_limbs_leave_at_one_place_has_a_shoulder() {
        for last in [7.0, 20.0] {
            let (count, knots) = rounded(&[(0.0, 2.0), (8.0, 2.0), (8.3, 0.8), (8.0 + last, 0.8)], true);
            assert!(
                count == 1 && knots.windows(2).all(|pair| pair[1].0 > pair[0].0 && pair[1].1 <= pair[0].1),
                "{knots:?}"
            );
            assert!(at(&knots, 8.2) > 1.8 && (0.9..1.9).contains(&at(&knots, 8.9)), "{knots:?}");
            // As far up as it narrows by, and a little more.
            assert!(at(&knots, 9.6) < 0.801, "{knots:?}");
        }
        // A second drop above the first leaves no step, nor wood that is thicker farther up.
        let (_, knots) = rounded(&[(0.0, 2.0), (8.0, 2.0), (8.3, 0.8), (8.5, 0.3), (9.0, 0.3), (12.0, 0.3)], true);
        assert!(at(&knots, 9.7) < 0.31 && knots.windows(2).all(|pair| pair[1].1 <= pair[0].1), "{knots:?}");
    }

    #[test]
    fn ends_flares_and_bases_stay_as_steep_as_they_are() {
        let flare = [(0.0, 0.8), (0.3, 0.45), (0.4, 0.2), (5.0, 0.18)];
        assert_eq!(rounded(&flare, true).0, 0);
        assert_eq!(rounded(&[(0.0, 0.5), (0.2, 0.1), (1.0, 0.1)], false).0, 0);
        for end in [&[(8.3, 0.1)][..], &[(8.3, 0.8), (8.4, 0.4), (8.5, 0.1), (8.6, 0.05)], &[(8.3, 0.8), (9.0, 0.8)]] {
            let wood = [&[(0.0, 2.0), (8.0, 2.0)], end].concat();
            assert_eq!(rounded(&wood, true).0, 0, "{end:?}");
        }
    }
}
