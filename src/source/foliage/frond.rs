//! Fronds: long bent sheets, as a palm has them, become a few cards along their spine.
//!
//! One flat card would lose the bend and a chain with many leaves the outline. So a frond is cut across into slices of
//! equal length along its chord; each is a card from one point of the spine to the next, as wide as the slice. The
//! pictures show the frond unrolled: all fronds of a material share those of the first, one a slice.

use glam::{Vec2, Vec3};

use super::card::Card;
use super::component::Component;
use super::near::Near;
use super::picture::{CardCorner, CardPicture};
use crate::source::scene::Part;

/// Slices of a frond.
pub(super) const SLICES: usize = 5;

/// A frond unrolled: along its spine and across.
struct Unrolled {
    spine: [Vec3; SLICES + 1],
    across: Vec3,
    /// For each point its share of the chord and its distance from the spine.
    places: Vec<Vec2>,
    /// Width of each slice.
    widths: [f32; SLICES],
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
    let places: Vec<Vec2> = at
        .iter()
        .map(|p| {
            let t = share(*p).clamp(0.0, 1.0);
            let k = ((t * SLICES as f32) as usize).min(SLICES - 1);
            let middle = spine[k].lerp(spine[k + 1], t * SLICES as f32 - k as f32);
            Vec2::new(t, (*p - middle).dot(across))
        })
        .collect();
    // As wide as the slice's points and what its edges cross.
    let mut widths = [0.0_f32; SLICES];
    let order: std::collections::BTreeMap<u32, usize> = c.points.iter().enumerate().map(|(k, &i)| (i, k)).collect();
    for t in &c.triangles {
        let corner = t.map(|i| places[order[&i]]);
        for k in 0..3 {
            let (a, b) = (corner[k], corner[(k + 1) % 3]);
            for (slice, width) in widths.iter_mut().enumerate() {
                for cut in [a.x, slice as f32 / SLICES as f32, (slice + 1) as f32 / SLICES as f32] {
                    let inside = |t: f32| {
                        t >= slice as f32 / SLICES as f32 - 1e-5 && t <= (slice + 1) as f32 / SLICES as f32 + 1e-5
                    };
                    let f = if b.x == a.x { 0.0 } else { (cut - a.x) / (b.x - a.x) };
                    if inside(cut) && (0.0..=1.0).contains(&f) {
                        *width = width.max((a.y + (b.y - a.y) * f).abs() * 2.0);
                    }
                }
            }
        }
    }
    Some(Unrolled { spine, across, places, widths })
}

/// The cards of a frond, base first, with `slots` onwards for their pictures; empty where it has no extent.
pub(super) fn cards(part: &Part, c: &Component, near: &Near, slots: u16) -> Vec<Card> {
    let Some(frond) = unroll(part, c, near) else { return Vec::new() };
    let card = |k: usize| {
        let (base, tip) = (frond.spine[k], frond.spine[k + 1]);
        let y = (tip - base).try_normalize()?;
        let x = (frond.across - y * y.dot(frond.across)).try_normalize()?;
        let (length, width) = (base.distance(tip), frond.widths[k]);
        (length.is_finite() && width > 0.0).then_some(Card {
            base,
            axes: [x, y, x.cross(y)],
            length,
            width,
            slot: slots + k as u16,
        })
    };
    (0..SLICES).filter_map(card).collect()
}

/// The pictures of a frond's slices, less what they take from its material.
pub(super) fn pictures(part: &Part, c: &Component, near: &Near, plain: &CardPicture) -> Vec<CardPicture> {
    let Some(frond) = unroll(part, c, near) else { return vec![plain.clone(); SLICES] };
    let order: std::collections::BTreeMap<u32, usize> = c.points.iter().enumerate().map(|(k, &i)| (i, k)).collect();
    (0..SLICES)
        .map(|k| {
            let width = frond.widths[k].max(1e-12);
            let corner = |i: u32| {
                let place = frond.places[order[&i]];
                CardCorner {
                    at: Vec2::new(place.y / width + 0.5, 1.0 - (place.x * SLICES as f32 - k as f32)),
                    uv: part.uvs.get(i as usize).copied().unwrap_or(Vec2::ZERO),
                    color: part.colors.get(i as usize).map_or([1.0; 3], |c| [c[0], c[1], c[2]]),
                }
            };
            CardPicture {
                width: width / frond.spine[k].distance(frond.spine[k + 1]).max(1e-12),
                triangles: c.triangles.iter().map(|t| t.map(corner)).collect(),
                ..plain.clone()
            }
        })
        .collect()
}
