//! The scene of a leaf picture: a twig end with its blades, petioles or needles, placed in the picture's plane.
//!
//! Picture space: the base of the twig at the origin, Y up, the picture's upper edge at y = 1, x in -0.5..=0.5. A
//! spray is built in blade lengths, then scaled to fill the picture. How leaves stand (alternate, opposite, in tufts)
//! follows the species.

mod conifer;

use glam::Vec2;

use super::leaf_outline::{outline, pinnate};
use crate::base::{Seed, math};
use crate::preset::plan::LeafShape;

/// Where a part lies: its own space has the base at the origin, runs along +Y for one length and bends sideways.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// The base in picture space.
    pub(super) origin: Vec2,
    /// Unit vector along the part.
    pub(super) along: Vec2,
    /// Length in picture space.
    pub(super) length: f32,
    /// Sideways offset of the tip, in lengths.
    pub(super) bend: f32,
    /// Foreshortening of the length, and of the halves left and right of the axis, 0..=1.
    pub(super) shorten: [f32; 3],
}

impl Place {
    /// Unit vector to the right of the axis.
    pub(super) fn across(&self) -> Vec2 {
        Vec2::new(self.along.y, -self.along.x)
    }

    /// From the part's space to the picture's.
    pub(super) fn to_picture(self, p: Vec2) -> Vec2 {
        let side = if p.x < 0.0 { self.shorten[1] } else { self.shorten[2] };
        let x = p.x * side + self.bend * p.y * p.y;
        self.origin + (self.across() * x + self.along * (p.y * self.shorten[0])) * self.length
    }

    /// From the picture's space to the part's.
    pub(super) fn to_part(self, p: Vec2) -> Vec2 {
        let q = (p - self.origin) / self.length;
        let y = q.dot(self.along) / self.shorten[0];
        let x = q.dot(self.across()) - self.bend * y * y;
        Vec2::new(x / if x < 0.0 { self.shorten[1] } else { self.shorten[2] }, y)
    }
}

/// What a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tissue {
    /// A blade seen from above.
    Blade,
    /// A blade seen from below: paler, its veins raised.
    Underside,
    /// The green stalk of a blade.
    Petiole,
    /// The twig.
    Wood,
    /// A needle.
    Needle,
}

/// One part of the scene.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// What it is.
    pub(super) tissue: Tissue,
    /// Where it lies.
    pub(super) place: Place,
    /// Closed outline in picture space.
    pub(super) outline: Vec<Vec2>,
    /// Slope of the surface towards the viewer: along, and across on the left and right half.
    pub(super) slope: [f32; 3],
    /// Half width at base and tip over the length, for round parts.
    pub(super) radius: [f32; 2],
    /// 0 is farthest back, 1 is nearest.
    pub(super) depth: f32,
    /// Where it stands on its shoot, 0 at the base to 1 at the tip: young leaves are lighter.
    pub(super) young: f32,
    /// Address of its variation.
    pub(super) seed: Seed,
}

/// The parts of a picture, back to front.
#[derive(Clone, Debug)]
pub(super) struct Spray {
    /// Drawn in this order.
    pub(super) parts: Vec<Part>,
    /// Share of the picture's height that the spray fills; below 1 where its width is what limits it.
    pub(super) filled: f32,
}

/// What a picture may change about its spray to fill the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growth {
    /// Scales how many leaves stand on a shoot.
    pub(super) dense: f32,
    /// Scales the blades, not the twig; of fronds and conifers widths alone.
    pub(super) enlarge: f32,
    /// Scales the angles between twig and leaves, and between shoots.
    pub(super) spread: f32,
}

impl Default for Growth {
    fn default() -> Self {
        Self { dense: 1.0, enlarge: 1.0, spread: 1.0 }
    }
}

impl Growth {
    /// One whose spray covers so many times as much, and stands more steeply where the spray fills less than the height.
    pub(super) fn towards(self, shape: LeafShape, times: f32, filled: f32) -> Self {
        let Self { dense, enlarge, spread } = self;
        let times = times.clamp(0.7, 1.4);
        let spread = (spread * filled.clamp(0.85, 1.0)).max(0.7);
        match shape {
            LeafShape::Palm | LeafShape::Pine | LeafShape::Spruce | LeafShape::Cypress => {
                Self { dense, enlarge: (enlarge * times).clamp(0.5, 2.2), spread }
            }
            _ => {
                let dense = if shape == LeafShape::Ash { 1.0 } else { (dense * times).clamp(0.6, 2.2) };
                let most = if matches!(shape, LeafShape::Willow | LeafShape::Olive) { 1.3 } else { 1.15 };
                Self { dense, enlarge: (enlarge * times.sqrt()).clamp(0.9, most), spread }
            }
        }
    }
}

/// Share of its picture that a spray should cover: less where leaves are so narrow that a fuller one would be solid.
pub(super) fn covered(shape: LeafShape) -> f32 {
    match shape {
        LeafShape::Palm | LeafShape::Pine | LeafShape::Ash => 0.38,
        LeafShape::Spruce | LeafShape::Cypress => 0.34,
        LeafShape::Willow | LeafShape::Olive => 0.31,
        _ => 0.42,
    }
}

/// How a species' leaves stand on a twig.
#[derive(Clone, Copy, Debug)]
struct Habit {
    /// Stations along the twig, the terminal leaf not counted.
    nodes: usize,
    /// Leaves at a station: 1 alternate, 2 opposite.
    at_node: usize,
    /// Length of the leafy twig, in blade lengths.
    twig: f32,
    /// Share of the twig below the first station.
    bare: f32,
    /// Angle between twig and leaf at the lowest and the uppermost station, radians.
    angle: [f32; 2],
    /// Petiole over blade length.
    petiole: f32,
    /// Blade size at the lowest station, over the one at the top.
    lower: f32,
    /// Side shoots, to one side and the other in turn; leaves stand as densely on them as on the twig.
    shoots: usize,
    /// Angle between twig and side shoots, least and most, radians.
    turn: [f32; 2],
    /// Length of a side shoot at the twig's base, over the twig's; further up they are shorter.
    reach: f32,
}

fn habit(shape: LeafShape) -> Habit {
    let form = |nodes, at_node, twig, bare, angle, petiole, lower, shoots| Habit {
        nodes,
        at_node,
        twig,
        bare,
        angle,
        petiole,
        lower,
        shoots,
        turn: [0.65, 1.0],
        reach: 0.7,
    };
    match shape {
        LeafShape::Oak => form(12, 1, 4.2, 0.14, [1.2, 0.5], 0.05, 0.85, 5),
        LeafShape::Birch => form(13, 1, 5.0, 0.1, [1.1, 0.6], 0.28, 0.95, 6),
        LeafShape::Beech => form(13, 1, 4.8, 0.1, [1.05, 0.65], 0.08, 0.8, 6),
        LeafShape::Maple => form(5, 2, 3.4, 0.12, [1.1, 0.6], 0.45, 0.8, 4),
        // Narrow strands beside each other: as a fan they would be the lobes of one leaf.
        LeafShape::Willow => {
            Habit { turn: [0.3, 0.56], reach: 1.0, ..form(20, 1, 5.6, 0.04, [0.72, 0.36], 0.05, 0.9, 5) }
        }
        LeafShape::Ash => form(4, 2, 0.95, 0.1, [1.15, 0.4], 0.0, 0.9, 0),
        LeafShape::Linden => form(13, 1, 5.4, 0.1, [1.15, 0.6], 0.4, 0.9, 6),
        LeafShape::Poplar => form(14, 1, 5.6, 0.1, [1.1, 0.6], 0.55, 0.9, 6),
        LeafShape::Elm => form(15, 1, 5.2, 0.08, [1.1, 0.7], 0.06, 0.8, 6),
        LeafShape::Olive => {
            Habit { turn: [0.4, 0.75], reach: 0.85, ..form(13, 2, 6.2, 0.06, [0.85, 0.45], 0.08, 0.9, 5) }
        }
        LeafShape::Pine | LeafShape::Spruce | LeafShape::Cypress | LeafShape::Palm => {
            form(0, 0, 1.0, 0.1, [1.0, 0.5], 0.0, 1.0, 0)
        }
    }
}

/// Leaf lengths that the height of a spray's picture spans, about: a card of height `leaf_size * spray_span(shape)`
/// shows leaves of their true size. 1 for ash, palm and conifers, whose `leaf_size` is that of the whole picture. Means over six
/// pictures; single ones differ by up to a fifth.
#[must_use]
pub fn spray_span(shape: LeafShape) -> f32 {
    match shape {
        LeafShape::Oak | LeafShape::Maple => 5.7,
        LeafShape::Birch => 6.8,
        LeafShape::Beech => 6.5,
        LeafShape::Willow => 6.9,
        LeafShape::Linden | LeafShape::Poplar => 7.6,
        LeafShape::Elm => 7.3,
        LeafShape::Olive => 7.2,
        LeafShape::Ash | LeafShape::Pine | LeafShape::Spruce | LeafShape::Cypress | LeafShape::Palm => 1.0,
    }
}

/// Share of the picture's edge that stays free all around.
const MARGIN: f32 = 0.012;

/// Leaflets in a picture of a palm's frond.
const LEAFLETS: usize = 9;

/// Builds the scene of one picture.
pub(super) fn spray(shape: LeafShape, seed: Seed, growth: Growth) -> Spray {
    let mut parts = match shape {
        LeafShape::Pine => conifer::pine(seed, growth),
        LeafShape::Spruce => conifer::spruce(seed, growth),
        LeafShape::Cypress => conifer::cypress(seed, growth),
        LeafShape::Palm => leaflets(seed, growth),
        _ => leafy_twig(shape, seed, growth),
    };
    let filled = fit(&mut parts);
    parts.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    Spray { parts, filled }
}

/// Scales all parts so that they fill the picture, the origin staying at bottom centre; gives back the share of the
/// height that is filled.
fn fit(parts: &mut Vec<Part>) -> f32 {
    let (mut top, mut wide, mut low) = (1e-3_f32, 1e-3_f32, 0.0_f32);
    for p in parts.iter().flat_map(|p| &p.outline) {
        top = top.max(p.y);
        low = low.min(p.y);
        wide = wide.max(p.x.abs());
    }
    // Leaves that hang below the twig's base would be cut off: the twig then starts lower.
    let lift = Vec2::new(0.0, -low);
    if low < -1e-4 {
        let radius =
            parts.iter().filter(|p| p.tissue == Tissue::Wood).map(|p| p.radius[0] * p.place.length).fold(0.0, f32::max);
        let foot = Vec2::new(0.0, low);
        parts.push(rod(Tissue::Wood, seat(foot, 0.0, 0.44, Seed::new(0)), -low * 1.02, 0.0, [radius; 2]));
    }
    let tall = (1.0 - MARGIN) / (top - low);
    let scale = tall.min((0.5 - MARGIN) / wide);
    let map = |p: Vec2| (p + lift) * scale;
    for part in parts {
        part.place.origin = map(part.place.origin);
        part.place.length *= scale;
        for p in &mut part.outline {
            *p = map(*p);
        }
    }
    scale / tall
}

/// A unit vector at an angle to the right of +Y.
fn heading(angle: f32) -> Vec2 {
    let (sin, cos) = math::sin_cos(angle);
    Vec2::new(sin, cos)
}

/// Where a part is to stand.
#[derive(Clone, Copy, Debug)]
struct Seat {
    origin: Vec2,
    /// Radians to the right of +Y.
    angle: f32,
    depth: f32,
    seed: Seed,
}

fn seat(origin: Vec2, angle: f32, depth: f32, seed: Seed) -> Seat {
    Seat { origin, angle, depth, seed }
}

/// A round, tapering part.
fn rod(tissue: Tissue, seat: Seat, length: f32, bend: f32, radius: [f32; 2]) -> Part {
    let place = Place { origin: seat.origin, along: heading(seat.angle), length, bend, shorten: [1.0; 3] };
    let radius = radius.map(|r| r / length);
    let steps = if bend.abs() < 0.02 { 2 } else { 8 };
    let side = |sign: f32, i: usize| {
        let t = i as f32 / steps as f32;
        place.to_picture(Vec2::new(sign * (radius[0] + (radius[1] - radius[0]) * t), t))
    };
    let mut outline: Vec<Vec2> = (0..=steps).map(|i| side(1.0, i)).collect();
    outline.extend((0..=steps).rev().map(|i| side(-1.0, i)));
    Part { tissue, place, outline, slope: [0.0; 3], radius, depth: seat.depth, young: 0.5, seed: seat.seed }
}

/// A blade at a place; tilt and fold by its seed.
fn blade(shape: LeafShape, seat: Seat, length: f32) -> Part {
    let seed = seat.seed;
    let roll = seed.child("roll").range(-0.55, 0.55);
    let fold = seed.child("fold").range(0.12, 0.45);
    let pitch = seed.child("pitch").range(-0.45, 0.45);
    let slope = [pitch, roll - fold, roll + fold];
    let shorten = slope.map(|s| 1.0 / (1.0 + s * s).sqrt());
    let bend = seed.child("bend").range(-0.13, 0.13);
    let place = Place { origin: seat.origin, along: heading(seat.angle), length, bend, shorten };
    let outline = outline(shape, seed).into_iter().map(|p| place.to_picture(p)).collect();
    let tissue = if seed.child("side").unit() < 0.07 { Tissue::Underside } else { Tissue::Blade };
    Part { tissue, place, outline, slope, radius: [0.0; 2], depth: seat.depth, young: 0.5, seed }
}

fn leafy_twig(shape: LeafShape, seed: Seed, growth: Growth) -> Vec<Part> {
    let habit = habit(shape);
    let mut parts = Vec::new();
    let lean = seed.child("lean").range(-0.12, 0.12);
    let bend = seed.child("twig").range(-0.1, 0.1);
    let wood = rod(Tissue::Wood, seat(Vec2::ZERO, lean, 0.42, seed.child("wood")), habit.twig, bend, [0.026, 0.010]);
    let main = wood.place;
    parts.push(wood);
    shoot(shape, &mut parts, main, growth.dense * habit.nodes as f32, growth, seed);
    let first = if seed.child("first side").unit() < 0.5 { 1.0 } else { -1.0_f32 };
    for k in 0..habit.shoots {
        let seed = seed.child("side shoot").at(k as u64);
        let sign = if k.is_multiple_of(2) { first } else { -first };
        let up = 0.1 + 0.62 * (k as f32 + seed.child("up").range(0.2, 0.8)) / habit.shoots as f32;
        let angle = lean + sign * growth.spread * seed.child("angle").range(habit.turn[0], habit.turn[1]);
        let share = (habit.reach - 0.55 * up) * seed.child("length").range(0.8, 1.15);
        let origin = main.to_picture(Vec2::new(0.0, up));
        let depth = if seed.child("side").unit() < 0.5 { 0.3 } else { 0.5 };
        let wood = rod(
            Tissue::Wood,
            seat(origin, angle, depth, seed.child("wood")),
            habit.twig * share,
            -sign * 0.12,
            [0.016, 0.008],
        );
        let place = wood.place;
        parts.push(wood);
        shoot(shape, &mut parts, place, share * growth.dense * habit.nodes as f32, growth, seed);
    }
    parts
}

/// The leaves along a shoot and the one at its end.
fn shoot(shape: LeafShape, parts: &mut Vec<Part>, place: Place, nodes: f32, growth: Growth, seed: Seed) {
    let Growth { enlarge, spread, .. } = growth;
    let nodes = (nodes + 0.5) as usize;
    let habit = habit(shape);
    let lean = math::atan2(place.along.x, place.along.y);
    let first = seed.child("first").unit() < 0.5;
    for node in 0..nodes {
        let t = (node as f32 + 0.5) / nodes as f32;
        let station = seed.child("node").at(node as u64);
        let up = habit.bare + (1.0 - habit.bare) * (t + station.range(-0.25, 0.25) / nodes as f32);
        let origin = place.to_picture(Vec2::new(0.0, up));
        for k in 0..habit.at_node {
            let seed = station.at(k as u64);
            let right = (node * habit.at_node + k).is_multiple_of(2) != first;
            let sign = if right { 1.0 } else { -1.0 };
            let away = habit.angle[0] + (habit.angle[1] - habit.angle[0]) * t + seed.child("angle").range(-0.28, 0.28);
            let size = (habit.lower + (1.0 - habit.lower) * t) * seed.child("size").range(0.75, 1.1);
            let depth = 0.05 + 0.4 * t + 0.5 * seed.child("depth").unit();
            let turn = lean + 2.0 * place.bend * up + sign * spread * away;
            let first = parts.len();
            leaf(shape, parts, seat(origin, turn, depth, seed), sign, size, enlarge);
            parts[first..].iter_mut().for_each(|part| part.young = t);
        }
    }
    let tip = place.to_picture(Vec2::new(0.0, 1.0));
    let turn = lean + 2.0 * place.bend + seed.child("terminal").range(-0.2, 0.2);
    let first = parts.len();
    leaf(shape, parts, seat(tip, turn, 0.75, seed.child("top")), 1.0, 0.95, enlarge);
    parts[first..].iter_mut().for_each(|part| part.young = 1.0);
}

/// A leaf with its petiole, simple or compound.
fn leaf(shape: LeafShape, parts: &mut Vec<Part>, at: Seat, sign: f32, size: f32, enlarge: f32) {
    if shape == LeafShape::Ash {
        return compound(parts, at, sign, size, enlarge);
    }
    let Seat { origin, angle, depth, seed } = at;
    let stalk = habit(shape).petiole * seed.child("stalk").range(0.8, 1.2);
    let curve = -sign * 0.12;
    let petiole =
        rod(Tissue::Petiole, seat(origin, angle, depth - 0.02, seed.child("petiole")), stalk, curve, [0.011, 0.009]);
    let end = petiole.place.to_picture(Vec2::new(0.0, 1.0));
    parts.push(petiole);
    // Blades turn a little back to the twig's direction, and hang on long petioles.
    let turn = angle + seed.child("turn").range(-0.25, 0.25) - sign * 0.12;
    parts.push(blade(shape, seat(end, turn, depth, seed.child("blade")), size * enlarge));
}

/// A pinnate leaf: pairs of leaflets along a rachis, and one at its end.
fn compound(parts: &mut Vec<Part>, at: Seat, sign: f32, size: f32, enlarge: f32) {
    let Seat { origin, angle, depth, seed } = at;
    let pairs = 5 + seed.child("pairs").index(2);
    let bend = -sign * 0.1 + seed.child("bend").range(-0.08, 0.08);
    let rachis = rod(
        Tissue::Petiole,
        seat(origin, angle, depth - 0.01, seed.child("rachis")),
        size * 0.78,
        bend,
        [0.010, 0.005],
    );
    let place = rachis.place;
    parts.push(rachis);
    for pair in 0..pairs {
        let t = 0.26 + 0.66 * pair as f32 / (pairs - 1) as f32;
        let at = place.to_picture(Vec2::new(0.0, t));
        for (k, side) in [-1.0, 1.0].into_iter().enumerate() {
            let seed = seed.child("leaflet").at(pair as u64).at(k as u64);
            let away = 1.12 - 0.35 * t + seed.child("angle").range(-0.16, 0.16);
            // Only leaflets are enlarged: the leaf keeps its reach.
            let length =
                enlarge * size * 0.36 * (1.0 - 0.5 * (t - 0.55) * (t - 0.55)) * seed.child("size").range(0.88, 1.08);
            let depth = depth + 0.02 * seed.child("depth").unit();
            parts.push(blade(LeafShape::Ash, seat(at, angle + 2.0 * bend * t + side * away, depth, seed), length));
        }
    }
    let end = place.to_picture(Vec2::new(0.0, 1.0));
    parts.push(blade(
        LeafShape::Ash,
        seat(end, angle + 2.0 * bend, depth + 0.02, seed.child("end")),
        enlarge * size * 0.38,
    ));
}

/// Leaflets of a frond, which bears them on one side at the picture's lower edge: side by side, and a little fanned out.
fn leaflets(seed: Seed, growth: Growth) -> Vec<Part> {
    let mut parts = Vec::new();
    for i in 0..LEAFLETS {
        let seed = seed.child("leaflet").at(i as u64);
        // -1 to 1 across the picture.
        let across = (2.0 * i as f32 + 1.0) / LEAFLETS as f32 - 1.0;
        let angle = growth.spread * (0.36 * across + seed.child("angle").range(-0.04, 0.04));
        let length = 1.0 - 0.12 * across * across - 0.1 * seed.child("length").unit();
        let depth = 0.3 + 0.4 * seed.child("depth").unit();
        let mut part = blade(LeafShape::Palm, seat(Vec2::new(across * 0.24, 0.0), angle, depth, seed), length);
        // Only the widths follow: leaflets keep their length.
        let place = part.place;
        for p in &mut part.outline {
            let q = place.to_part(*p);
            *p = place.to_picture(Vec2::new(q.x * growth.enlarge, q.y));
        }
        part.place.shorten[1] *= growth.enlarge;
        part.place.shorten[2] *= growth.enlarge;
        parts.push(part);
    }
    parts
}

/// Half a blade's greatest width over its length; 0 for needles.
pub(super) fn half_width(shape: LeafShape) -> f32 {
    match shape {
        LeafShape::Maple => 0.7,
        LeafShape::Pine | LeafShape::Spruce | LeafShape::Cypress => 0.0,
        _ => pinnate(shape).half_width,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_map_there_and_back() {
        let place = Place {
            origin: Vec2::new(0.1, 0.3),
            along: heading(0.7),
            length: 0.4,
            bend: 0.2,
            shorten: [0.9, 0.8, 0.95],
        };
        for p in [Vec2::new(0.2, 0.5), Vec2::new(-0.3, 0.9), Vec2::ZERO] {
            assert!(place.to_part(place.to_picture(p)).distance(p) < 1e-5);
        }
    }

    #[test]
    fn every_part_lies_in_the_picture() {
        for shape in LeafShape::ALL {
            for s in 0..4 {
                for p in spray(shape, Seed::new(s), Growth::default()).parts.iter().flat_map(|p| &p.outline) {
                    assert!(p.x.abs() <= 0.5 && p.y > -1e-4 && p.y <= 1.0, "{shape:?} {p}");
                }
            }
        }
    }
}
