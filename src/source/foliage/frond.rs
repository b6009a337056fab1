//! Fronds: long bent sheets, as a palm has them, become a few cards along their spine.
//!
//! One flat card would lose the bend and a chain with many leaves the outline. So a frond is cut across into slices of
//! equal length along its chord, and along its spine into two halves, which lean as the frond's do: most are folded, and
//! one card across would show them edge-on to whoever stands below. Each half of a slice is a card from one point of the
//! spine to the next, from the spine to the frond's edge. The pictures show the frond unrolled: all fronds of a material
//! share those of the first, one a card.

use glam::{Vec2, Vec3};

use super::card::Card;
use super::component::Component;
use super::near::Near;
use super::picture::{CardCorner, CardPicture};
use crate::source::scene::Part;

/// Slices of a frond.
const SLICES: usize = 5;
/// How far each slice goes on under the next, as a share of its length: where a frond bends, its slices would gape.
const OVER: f32 = 0.06;
/// Steepest that a half leans, rise over run: beyond, its points say nothing about a plane.
const STEEP: f32 = 4.0;

/// A frond unrolled: along its spine and across.
struct Unrolled {
    spine: [Vec3; SLICES + 1],
    /// From the spine along each half: where distances from the spine are below zero, and above.
    halves: [Vec3; 2],
    /// For each point its share of the chord and its distance from the spine, seen from above.
    places: Vec<Vec2>,
    /// For each slice how wide its halves are, seen from above.
    widths: [[f32; 2]; SLICES],
    /// What widths from above are multiplied with along each half.
    slants: [f32; 2],
}

fn unroll(part: &Part, c: &Component, near: &Near) -> Option<Unrolled> {
    let at: Vec<Vec3> = c.points.iter().map(|&i| part.positions[i as usize]).collect();
    // The end that is nearer to the wood is the base.
    let along = |p: Vec3, axis: Vec3| (p - c.centre).dot(axis);
    let ends = |axis: Vec3| at.iter().copied().max_by(|a, b| along(*a, axis).total_cmp(&along(*b, axis)));
    let (high, low) = (ends(c.axes[0])?, ends(-c.axes[0])?);
    let far = |p: Vec3| near.find(p).map_or(0.0, |(_, d)| d);
    let axis = if far(high) < far(low) { -c.axes[0] } else { c.axes[0] };
    let (first, last) = at.iter().fold((f32::MAX, f32::MIN), |(l, h), p| {
        let d = along(*p, axis);
        (l.min(d), h.max(d))
    });
    let length = last - first;
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
    let share = |p: Vec3| (along(p, axis) - first) / length;
    // The spine: means of the points about each cut; an empty one lies between its neighbours.
    let mut spine = [None; SLICES + 1];
    for (k, place) in spine.iter_mut().enumerate() {
        let t = k as f32 / SLICES as f32;
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0_f32);
        for p in &at {
            let gap = (share(*p) - t).abs() * SLICES as f32;
            if gap < 0.8 {
                sum += *p * (1.0 - gap);
                weight += 1.0 - gap;
            }
        }
        if weight > 1e-4 {
            let mean = sum / weight;
            *place = Some(mean + axis * (t * length + first - along(mean, axis)));
        }
    }
    let known: Vec<(f32, Vec3)> = spine.iter().enumerate().filter_map(|(k, p)| Some((k as f32, (*p)?))).collect();
    let spine: [Vec3; SLICES + 1] = std::array::from_fn(|k| {
        let next = known.partition_point(|(at, _)| *at < k as f32).min(known.len().saturating_sub(1));
        let before = next.saturating_sub(usize::from(known[next].0 > k as f32));
        let (a, b) = (known[before], known[next]);
        let f = if b.0 > a.0 { (k as f32 - a.0) / (b.0 - a.0) } else { 0.0 };
        a.1.lerp(b.1, f)
    });
    // Across lies at right angles to the plane in which the spine bends; of a straight one along the second direction.
    let sag = spine[SLICES / 2] - (spine[0] + spine[SLICES]) * 0.5;
    let sag = sag - axis * sag.dot(axis);
    let across = if sag.length() > 0.03 * length { axis.cross(sag).normalize_or(c.axes[1]) } else { c.axes[1] };
    let up = axis.cross(across);
    let middle = |t: f32, spine: &[Vec3; SLICES + 1]| {
        let k = ((t * SLICES as f32) as usize).min(SLICES - 1);
        spine[k].lerp(spine[k + 1], t * SLICES as f32 - k as f32)
    };
    let places: Vec<Vec2> = at
        .iter()
        .map(|p| {
            let t = share(*p).clamp(0.0, 1.0);
            Vec2::new(t, (*p - middle(t, &spine)).dot(across))
        })
        .collect();
    // Each half's lean and its height at the spine: the line through its points, seen along the spine.
    let mut lines = [(0.0_f32, 0.0_f32); 2];
    for (half, line) in lines.iter_mut().enumerate() {
        let sign = if half == 0 { -1.0 } else { 1.0 };
        let on = || places.iter().zip(&at).filter(|(place, _)| place.y * sign >= 0.0);
        let rise = |p: &Vec3, t: f32| (*p - middle(t, &spine)).dot(up);
        let count = on().count().max(1) as f32;
        let (y, z) = on().fold((0.0, 0.0), |(y, z), (place, p)| (y + place.y * sign, z + rise(p, place.x)));
        let (y, z) = (y / count, z / count);
        let (yy, yz) = on().fold((0.0, 0.0), |(yy, yz), (place, p)| {
            let (dy, dz) = (place.y * sign - y, rise(p, place.x) - z);
            (yy + dy * dy, yz + dy * dz)
        });
        let slope = if yy > 0.0 { (yz / yy).clamp(-STEEP, STEEP) } else { 0.0 };
        *line = (slope, z - slope * y);
    }
    let ridge = (lines[0].1 + lines[1].1) * 0.5;
    let spine = spine.map(|p| p + up * ridge);
    let halves = [(up * lines[0].0 - across).normalize_or(-across), (up * lines[1].0 + across).normalize_or(across)];
    let slants = lines.map(|(slope, _)| (1.0 + slope * slope).sqrt());
    // As wide as the slice's points and what its edges cross.
    let mut widths = [[0.0_f32; 2]; SLICES];
    let order: std::collections::BTreeMap<u32, usize> = c.points.iter().enumerate().map(|(k, &i)| (i, k)).collect();
    for t in &c.triangles {
        let corner = t.map(|i| places[order[&i]]);
        for k in 0..3 {
            let (a, b) = (corner[k], corner[(k + 1) % 3]);
            for (slice, halves) in widths.iter_mut().enumerate() {
                let (low, high) = ((slice as f32 - OVER) / SLICES as f32, ((slice + 1) as f32 + OVER) / SLICES as f32);
                for cut in [a.x, low, high] {
                    let inside = |t: f32| t >= low - 1e-5 && t <= high + 1e-5;
                    let f = if b.x == a.x { 0.0 } else { (cut - a.x) / (b.x - a.x) };
                    if inside(cut) && (0.0..=1.0).contains(&f) {
                        let y = a.y + (b.y - a.y) * f;
                        let width = &mut halves[usize::from(y > 0.0)];
                        *width = width.max(y.abs());
                    }
                }
            }
        }
    }
    Some(Unrolled { spine, halves, places, widths, slants })
}

/// The cards of a frond, base first, one half after the other, with `slots` onwards for their pictures; empty where it has
/// no extent.
pub(super) fn cards(part: &Part, c: &Component, near: &Near, slots: u16) -> Vec<Card> {
    let Some(frond) = unroll(part, c, near) else { return Vec::new() };
    let card = |(half, k): (usize, usize)| {
        let along = frond.spine[k + 1] - frond.spine[k];
        let y = along.try_normalize()?;
        let out = (frond.halves[half] - y * y.dot(frond.halves[half])).try_normalize()?;
        let (length, width) = (along.length(), frond.widths[k][half] * frond.slants[half]);
        // Both halves face the same way.
        let x = if half == 0 { -out } else { out };
        (length.is_finite() && width > 0.0 && width.is_finite()).then_some(Card {
            base: frond.spine[k] + out * (width * 0.5) - along * OVER,
            axes: [x, y, x.cross(y)],
            length: length * (1.0 + 2.0 * OVER),
            width,
            slot: slots + (half * SLICES + k) as u16,
        })
    };
    (0..2).flat_map(|half| (0..SLICES).map(move |k| (half, k))).filter_map(card).collect()
}

/// The pictures of a frond's slices, less what they take from its material.
pub(super) fn pictures(part: &Part, c: &Component, near: &Near, plain: &CardPicture) -> Vec<CardPicture> {
    let Some(frond) = unroll(part, c, near) else { return vec![plain.clone(); 2 * SLICES] };
    let order: std::collections::BTreeMap<u32, usize> = c.points.iter().enumerate().map(|(k, &i)| (i, k)).collect();
    let picture = |(half, k): (usize, usize)| {
        let width = frond.widths[k][half].max(1e-12);
        // From the frond's edge to the spine in the first half, from the spine to the edge in the second.
        let edge = if half == 0 { 1.0 } else { 0.0 };
        let corner = |i: u32| {
            let place = frond.places[order[&i]];
            CardCorner {
                at: Vec2::new(
                    place.y / width + edge,
                    1.0 - (place.x * SLICES as f32 - k as f32 + OVER) / (1.0 + 2.0 * OVER),
                ),
                uv: part.uvs.get(i as usize).copied().unwrap_or(Vec2::ZERO),
                color: part.colors.get(i as usize).map_or([1.0; 3], |c| [c[0], c[1], c[2]]),
            }
        };
        CardPicture {
            width: width * frond.slants[half]
                / (frond.spine[k].distance(frond.spine[k + 1]) * (1.0 + 2.0 * OVER)).max(1e-12),
            triangles: c.triangles.iter().map(|t| t.map(corner)).collect(),
            ..plain.clone()
        }
    };
    (0..2).flat_map(|half| (0..SLICES).map(move |k| (half, k))).map(picture).collect()
}
