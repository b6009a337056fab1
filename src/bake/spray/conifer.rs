//! Twig ends of conifers: shoots with needles, and branchlets of scales.
//!
//! What is told from afar is how shoots stand: between them the picture is clear, and its outline is a comb. A body that is
//! solid from rim to rim reads as one broad leaf.

use glam::Vec2;

use super::{Growth, Part, Place, Seat, Tissue, rod};
use crate::base::{Seed, math};

/// A shoot that bears needles.
struct Shoot {
    place: Place,
    /// In picture space.
    length: f32,
    /// Share of it below the first needle.
    bare: f32,
    depth: f32,
}

/// How needles stand on their shoots.
struct Needles {
    /// Along one length of the picture, all around the shoot.
    dense: f32,
    /// Length, in picture space.
    long: f32,
    /// Angle to the shoot at its base and its tip, radians.
    away: [f32; 2],
    /// Half width at the base, in picture space.
    width: f32,
    /// How many leave from one place.
    bundle: u64,
}

/// A branch end of pine: crooked shoots that are bare but for their ends, and there a tuft of long needles, two and two. Tufts
/// are small and stand apart: five large brushes in a fan read as one leaf of a maple.
pub(super) fn pine(seed: Seed, growth: Growth) -> Vec<Part> {
    let lean = seed.child("lean").range(-0.1, 0.1);
    let bend = seed.child("bend").range(-0.1, 0.1);
    let main = wood(seat(lean, 0.3, seed), 0.86, bend, 0.011);
    let mut shoots = vec![Shoot { place: main.place, length: 0.86, bare: 0.74, depth: 0.45 }];
    let mut parts = vec![main];
    let axis = Axis { lean, bend, spread: growth.spread };
    for (k, up) in (0..).zip([0.2, 0.29, 0.37, 0.47, 0.54, 0.63, 0.72]) {
        let Side { seed, sign, up, angle } = axis.side(seed, k, (0.03, |off| up + off), [0.75, 1.15]);
        // Short ones stand between long ones.
        let share = if k % 3 == 1 { 0.62 } else { 1.0 };
        let length = share * (0.6 - 0.5 * up) * seed.child("length").range(0.85, 1.15);
        let (shoot, side) = branchlet(&shoots[0], up, angle, (length, -sign * 0.2), seed);
        shoots.push(Shoot { bare: (1.0 - 0.2 / length).clamp(0.1, 0.7), ..shoot });
        parts.push(side);
    }
    let needles = Needles {
        dense: 420.0,
        long: 0.118,
        away: [1.35, 0.45],
        width: 0.0032 * growth.enlarge.clamp(0.8, 1.6),
        bundle: 2,
    };
    needled(&mut parts, &shoots, &needles, seed);
    parts
}

/// A spray of spruce: a flat comb of shoots, each as long as it is low, with short needles that stand off all around.
pub(super) fn spruce(seed: Seed, growth: Growth) -> Vec<Part> {
    const SIDES: u64 = 15;
    let lean = seed.child("lean").range(-0.06, 0.06);
    let bend = seed.child("bend").range(-0.1, 0.1);
    let main = wood(seat(lean, 0.5, seed), 0.94, bend, 0.010);
    let mut shoots = vec![Shoot { place: main.place, length: 0.94, bare: 0.05, depth: 0.55 }];
    let mut parts = vec![main];
    let axis = Axis { lean, bend, spread: growth.spread };
    for k in 0..SIDES {
        let up = |off: f32| 0.06 + 0.86 * (k as f32 + off) / SIDES as f32;
        let Side { seed, sign, up, angle } = axis.side(seed, k, (0.3, up), [0.92, 1.12]);
        let length = (0.08 + 0.32 * (1.0 - up)) * seed.child("length").range(0.82, 1.08);
        let (shoot, side) = branchlet(&shoots[0], up, angle, (length, -sign * 0.14), seed);
        // The longest fork again.
        for (j, at) in [0.38, 0.62].into_iter().enumerate().filter(|_| length > 0.2) {
            let seed = seed.child("fork").at(j as u64);
            let turn = if j == 0 { sign } else { -sign };
            let angle = angle - sign * 0.28 * at + turn * growth.spread * seed.child("angle").range(0.6, 0.8);
            let (fork, side) = branchlet(&shoot, at, angle, (0.34 * length, 0.0), seed);
            shoots.push(fork);
            parts.push(side);
        }
        shoots.push(shoot);
        parts.push(side);
    }
    let needles = Needles {
        dense: 240.0,
        long: 0.056,
        away: [1.1, 0.6],
        width: 0.0036 * growth.enlarge.clamp(0.8, 1.8),
        bundle: 1,
    };
    needled(&mut parts, &shoots, &needles, seed);
    parts
}

/// A spray of cypress: cords of scales that branch and branch again, none thicker than the next.
pub(super) fn cypress(seed: Seed, growth: Growth) -> Vec<Part> {
    const SIDES: u64 = 14;
    let lean = seed.child("lean").range(-0.08, 0.08);
    let bend = seed.child("bend").range(-0.1, 0.1);
    let width = 0.0145 * growth.enlarge.clamp(0.7, 1.7);
    let mut parts = Vec::new();
    let main = cord(seat(lean, 0.4, seed), 0.95, bend, width * 1.2);
    let axis = Axis { lean, bend, spread: growth.spread };
    for k in 0..SIDES {
        let up = |off: f32| 0.05 + 0.85 * (k as f32 + off) / SIDES as f32;
        let Side { seed, sign, up, angle } = axis.side(seed, k, (0.3, up), [0.75, 1.0]);
        let length = (0.12 + 0.3 * (1.0 - up)) * seed.child("length").range(0.75, 1.1);
        let depth = 0.2 + 0.6 * seed.child("depth").unit();
        let origin = main.place.to_picture(Vec2::new(0.0, up));
        let side = cord(Seat { origin, ..seat(angle, depth, seed) }, length, -sign * 0.2, width);
        let count = (length * 33.0) as u64;
        for j in 0..count {
            let seed = seed.child("branchlet").at(j);
            let turn = if j % 2 == 0 { sign } else { -sign };
            let at = 0.14 + 0.84 * (j as f32 + seed.child("at").unit()) / count as f32;
            let origin = side.place.to_picture(Vec2::new(0.0, at));
            let angle = angle - sign * 0.4 * at + turn * growth.spread * seed.child("angle").range(0.5, 0.85);
            let length = (0.04 + 0.1 * (1.0 - at)) * seed.child("length").range(0.7, 1.2);
            let depth = depth + seed.child("depth").range(-0.15, 0.15);
            let scales = cord(Seat { origin, ..seat(angle, depth, seed) }, length, -turn * 0.15, width * 0.85);
            parts.push(Part { young: at, ..scales });
        }
        parts.push(side);
    }
    parts.push(main);
    parts
}

/// What side shoots stand on.
#[derive(Clone, Copy)]
struct Axis {
    /// Radians to the right of +Y, at its base.
    lean: f32,
    /// As of a [`Place`].
    bend: f32,
    /// As of [`Growth`].
    spread: f32,
}

/// Where a side shoot stands.
struct Side {
    seed: Seed,
    /// 1 to the right, -1 to the left.
    sign: f32,
    /// Share of the axis.
    up: f32,
    /// Radians to the right of +Y.
    angle: f32,
}

impl Axis {
    /// One of its side shoots, which leave to the right and the left in turn: `up` by what is drawn between minus and plus `off`, at
    /// an angle to the axis between two, radians.
    fn side(self, seed: Seed, k: u64, (off, up): (f32, impl Fn(f32) -> f32), between: [f32; 2]) -> Side {
        let seed = seed.child("side").at(k);
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let up = up(seed.child("at").range(-off, off));
        let away = self.spread * seed.child("angle").range(between[0], between[1]);
        Side { seed, sign, up, angle: self.lean + 2.0 * self.bend * up + sign * away }
    }
}

/// A seat at the picture's foot.
fn seat(angle: f32, depth: f32, seed: Seed) -> Seat {
    Seat { origin: Vec2::ZERO, angle, depth, seed }
}

fn wood(at: Seat, length: f32, bend: f32, radius: f32) -> Part {
    let seed = at.seed.child("wood");
    rod(Tissue::Wood, Seat { seed, ..at }, length, bend, [radius, radius * 0.6])
}

/// A shoot in scales, blunt at its end.
fn cord(at: Seat, length: f32, bend: f32, radius: f32) -> Part {
    rod(Tissue::Needle, at, length, bend, [radius, radius * 0.7])
}

/// A side shoot of a spruce's, at a share of its length.
fn branchlet(on: &Shoot, at: f32, angle: f32, (length, bend): (f32, f32), seed: Seed) -> (Shoot, Part) {
    let origin = on.place.to_picture(Vec2::new(0.0, at));
    let depth = on.depth + seed.child("depth").range(-0.2, 0.15);
    let part = wood(Seat { origin, ..seat(angle, depth - 0.05, seed) }, length, bend, 0.006);
    (Shoot { place: part.place, length, bare: 0.0, depth }, part)
}

/// Adds the needles of shoots. Seen from the side: those that point at the viewer or away are shorter.
fn needled(parts: &mut Vec<Part>, shoots: &[Shoot], needles: &Needles, seed: Seed) {
    for (s, shoot) in shoots.iter().enumerate() {
        let count = (shoot.length * (1.0 - shoot.bare) * needles.dense) as u64;
        let toward = math::atan2(shoot.place.along.x, shoot.place.along.y);
        for i in 0..count {
            let seed = seed.child("shoot").at(s as u64).at(i);
            let t = (i as f32 + seed.child("at").unit()) / count as f32;
            let up = shoot.bare + (1.0 - shoot.bare) * t;
            let origin = shoot.place.to_picture(Vec2::new(0.0, up));
            let (sin, cos) = math::sin_cos(seed.child("around").unit() * std::f32::consts::TAU);
            let away = (needles.away[0] + (needles.away[1] - needles.away[0]) * t) * cos;
            let long = needles.long * (0.7 + 0.3 * cos.abs()) * seed.child("size").range(0.8, 1.1);
            let depth = shoot.depth + 0.22 * sin + 0.08 * seed.child("depth").unit();
            for twin in 0..needles.bundle {
                let seed = seed.at(twin);
                let angle = toward + 2.0 * shoot.place.bend * up + away + seed.child("spread").range(-0.1, 0.1);
                let bend = seed.child("bend").range(-0.09, 0.09);
                let width = [needles.width, needles.width * 0.4];
                let mut needle = rod(Tissue::Needle, Seat { origin, angle, depth, seed }, long, bend, width);
                needle.slope[0] = 0.5 * sin;
                needle.young = t;
                parts.push(needle);
            }
        }
    }
}
