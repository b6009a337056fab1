//! Fronds: long bent sheets, as a palm has them, become one card each, bent and folded as they are.
//!
//! One flat card would lose the bend, and slices of a frond fall apart where trees are blended or leaves thinned. So the
//! midrib is the circle's arc nearest to the sheet's middle, and the halves lean by what their points do. The picture shows
//! the frond unrolled: all fronds of a material share that of the first.

use glam::{DMat4, DVec4, Vec2, Vec3};

use super::card::Card;
use super::component::Component;
use super::near::Near;
use super::picture::{CardCorner, CardPicture};
use crate::base::math;
use crate::source::scene::Part;

/// Places along a frond at which its middle is sought.
const PLACES: usize = 6;
/// Steepest that a half leans, rise over run: beyond, its points say nothing about a plane.
const STEEP: f32 = 4.0;
/// Bends below this share of the chord say nothing about which way a frond bends.
const STRAIGHT: f32 = 0.03;
/// Farthest that a tip turns, radians: along a chord, nothing says how far one has gone round.
const ROUND: f32 = 2.6;

/// A frond unrolled.
struct Unrolled {
    card: Card,
    /// Of each point, on the picture: across and down, 0..=1.
    places: Vec<Vec2>,
}

/// A circle's arc from one end of a chord to the other.
struct Arc {
    base: Vec3,
    /// Unit: along the chord, and to the side that the arc bulges to.
    along: Vec3,
    up: Vec3,
    chord: f32,
    /// How far it turns from end to end, radians.
    turn: f32,
}

impl Arc {
    /// At a share of the chord: the share of the arc, the place there, and the direction away from the centre.
    fn at(&self, share: f32) -> (f32, Vec3, Vec3) {
        let on_chord = self.base + self.along * (share * self.chord);
        if self.turn < 1e-3 {
            return (share, on_chord, self.up);
        }
        let (sin_half, cos_half) = math::sin_cos(self.turn * 0.5);
        let sin = (2.0 * share - 1.0) * sin_half;
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        let radius = self.chord * 0.5 / sin_half;
        let of_arc = math::atan2(sin, cos) / self.turn + 0.5;
        (of_arc, on_chord + self.up * (radius * (cos - cos_half)), self.up * cos + self.along * sin)
    }

    fn length(&self) -> f32 {
        let half = self.turn * 0.5;
        self.chord * if half < 1e-3 { 1.0 } else { half / math::sin_cos(half).0 }
    }
}

/// The arc along the middle of points, from the end of `c`'s longest axis that is nearer to the wood.
fn midrib(at: &[Vec3], c: &Component, near: &Near) -> Option<Arc> {
    let along = |p: Vec3, axis: Vec3| (p - c.centre).dot(axis);
    let end = |axis: Vec3| at.iter().copied().max_by(|a, b| along(*a, axis).total_cmp(&along(*b, axis)));
    let far = |p: Vec3| near.find(p).map_or(0.0, |(_, d)| d);
    let axis = if far(end(c.axes[0])?) < far(end(-c.axes[0])?) { -c.axes[0] } else { c.axes[0] };
    let [first, last] = [-axis, axis].map(|way| end(way).map(|p| along(p, axis)));
    let (first, chord) = (first?, last? - first?);
    if !(chord > 0.0 && chord.is_finite()) {
        return None;
    }
    let share = |p: Vec3| (along(p, axis) - first) / chord;
    // Means of the points about each place, told by how far they are off the chord's line through the centre.
    let off = |p: Vec3| p - c.centre - axis * along(p, axis);
    let middles = (0..PLACES).filter_map(|k| {
        let t = k as f32 / (PLACES - 1) as f32;
        let weights = at.iter().map(|p| (1.0 - (share(*p) - t).abs() * (PLACES - 1) as f32 / 0.8).max(0.0));
        let (sum, weight) = at.iter().zip(weights).fold((Vec3::ZERO, 0.0), |(s, w), (p, v)| (s + off(*p) * v, w + v));
        (weight > 1e-4).then(|| (t, sum / weight))
    });
    let middles: Vec<(f32, Vec3)> = middles.collect();
    let (&(from, base), &(to, tip)) = (middles.first()?, middles.last()?);
    let line = |t: f32| base.lerp(tip, if to > from { (t - from) / (to - from) } else { 0.0 });
    // Which way it bends: the sag of a parabola through both ends, by least squares.
    let bulge = |t: f32| 4.0 * t * (1.0 - t);
    let (sum, squares) = middles.iter().fold((Vec3::ZERO, 0.0), |(sum, squares), (t, p)| {
        (sum + (*p - line(*t)) * bulge(*t), squares + bulge(*t) * bulge(*t))
    });
    let sag = sum / f32::max(squares, 1e-6);
    let sag = sag - axis * sag.dot(axis);
    // A straight one shows its upper face to the sky.
    let flat = c.axes[1].cross(axis).normalize_or(crate::base::Frame::along(axis).z);
    let flat = flat * if flat.y < 0.0 { -1.0 } else { 1.0 };
    let up = if sag.length() > STRAIGHT * chord { sag.normalize() } else { flat };
    let across = axis.cross(up);
    // How far it bends: the parabola of a midrib from which both halves lean, by least squares. Halves that lean pull the
    // mean down where they are wide.
    let (mut squares, mut products) = (DMat4::from_diagonal(DVec4::splat(1e-9)), DVec4::ZERO);
    for p in at {
        let (t, off) = (share(*p), off(*p));
        let beside = (off - line(t)).dot(across).abs() / chord;
        let row = DVec4::new(1.0, f64::from(t), f64::from(bulge(t)), f64::from(beside));
        squares += DMat4::from_cols(row * row.x, row * row.y, row * row.z, row * row.w);
        products += row * f64::from(off.dot(up) / chord);
    }
    let [start, rise, sag, _] = (squares.inverse() * products).to_array().map(|share| share as f32 * chord);
    let ends = [(0.0, start), (1.0, start + rise)];
    let ends = ends.map(|(t, height)| {
        let beside = across * line(t).dot(across);
        c.centre + axis * (first + chord * t) + beside + up * height
    });
    let along = (ends[1] - ends[0]).normalize_or(axis);
    let up = (up - along * up.dot(along)).normalize_or(up);
    let chord = ends[0].distance(ends[1]);
    // One that hollows after all bends the other way.
    let (up, sag) = if sag < 0.0 { (-up, -sag) } else { (up, sag) };
    let turn = if sag > STRAIGHT * chord { (4.0 * math::atan2(2.0 * sag, chord)).min(ROUND) } else { 0.0 };
    Some(Arc { base: ends[0], along, up, chord, turn })
}

fn unroll(part: &Part, c: &Component, near: &Near, slot: u16) -> Option<Unrolled> {
    let at: Vec<Vec3> = c.points.iter().map(|&i| part.positions[i as usize]).collect();
    let arc = midrib(&at, c, near)?;
    let across = arc.along.cross(arc.up);
    // Of each point its share of the arc, how far it is beside it, and how high above.
    let places = at.iter().map(|p| {
        let (share, place, up) = arc.at(((*p - arc.base).dot(arc.along) / arc.chord).clamp(0.0, 1.0));
        Vec3::new(share, (*p - place).dot(across), (*p - place).dot(up))
    });
    let places: Vec<Vec3> = places.collect();
    // How each half leans and how high it is at the midrib: the line through its points, seen along the midrib.
    let lines = [-1.0, 1.0].map(|sign| {
        let on = || places.iter().filter(move |p| p.y * sign >= 0.0).map(move |p| Vec2::new(p.y * sign, p.z));
        let mean = on().sum::<Vec2>() / on().count().max(1) as f32;
        let (squares, products) = on().map(|p| p - mean).fold((0.0, 0.0), |(s, m), d| (s + d.x * d.x, m + d.x * d.y));
        let slope = if squares > 0.0 { (products / squares).clamp(-STEEP, STEEP) } else { 0.0 };
        (slope, mean.y - slope * mean.x)
    });
    let slope = (lines[0].0 + lines[1].0) * 0.5;
    let slant = (1.0 + slope * slope).sqrt();
    let width = places.iter().fold(0.0_f32, |width, p| width.max(p.y.abs() * slant)) * 2.0;
    let length = arc.length();
    let (sin, cos) = math::sin_cos(arc.turn * 0.5);
    let (y, z) = (arc.along * cos + arc.up * sin, arc.up * cos - arc.along * sin);
    let card = Card {
        base: arc.base + arc.up * ((lines[0].1 + lines[1].1) * 0.5),
        axes: [y.cross(z), y, z],
        length,
        width,
        slot,
        bend: Some((arc.turn, -math::atan2(slope, 1.0))),
    };
    let on_picture = |p: &Vec3| Vec2::new(p.y * slant / width + 0.5, 1.0 - p.x);
    let is_sound = length.is_finite() && width > 0.0 && width.is_finite();
    is_sound.then(|| Unrolled { card, places: places.iter().map(on_picture).collect() })
}

/// The card of a frond; none where it has no extent.
pub(super) fn card(part: &Part, c: &Component, near: &Near, slot: u16) -> Option<Card> {
    unroll(part, c, near, slot).map(|frond| frond.card)
}

/// The picture of a frond, less what it takes from its material.
pub(super) fn picture(part: &Part, c: &Component, near: &Near, plain: &CardPicture) -> CardPicture {
    let Some(frond) = unroll(part, c, near, 0) else { return plain.clone() };
    let order: std::collections::BTreeMap<u32, usize> = c.points.iter().enumerate().map(|(k, &i)| (i, k)).collect();
    let corner = |at: u32, i: u32| CardCorner {
        at: frond.places[order[&at]],
        uv: part.uvs.get(i as usize).copied().unwrap_or(Vec2::ZERO),
        color: part.colors.get(i as usize).map_or([1.0; 3], |c| [c[0], c[1], c[2]]),
    };
    CardPicture {
        width: frond.card.width / frond.card.length,
        triangles: c.triangles.iter().zip(&c.corners).map(|(t, own)| [0, 1, 2].map(|k| corner(t[k], own[k]))).collect(),
        ..plain.clone()
    }
}
