//! Where the kernel puts a kin: shape, linear radii and location (2017 TVCG, 4.3).
//!
//! Branching vectors are turned by the mean of the members' turns (`turns.rs`), for two members the paper's quaternion
//! interpolation.
//!
//! Where members bend different ways their mean is shorter than they are (by 1 to 3 % as a rule, by a third at worst), so
//! it is stretched until its tip is as far from its base as theirs are on average, at most 1.5 times.
//!
//! Kins that share a member have the radii that `burden.rs` tells.

use glam::Vec3;

use super::family::NONE;
use super::kernel::{Blender, Feed};
use super::turns::turn_of;
use crate::plant::ChainId;

/// How far a chain may be stretched to reach as far as its members do on average.
const MOST_STRETCH: f32 = 1.5;

impl Blender<'_> {
    /// The members' locations in a kin's shares.
    pub(super) fn own_location(&self, k: usize) -> f32 {
        let row = self.family.row(k);
        match self.feeds[k] {
            // Not through the sum, which would take the sign off a zero.
            Feed::One(s) => row[s as usize].location,
            _ => {
                let sum = row.iter().zip(self.share(k)).fold(0.0_f32, |l, (m, share)| l + m.location * share);
                sum.clamp(0.0, 1.0)
            }
        }
    }

    /// Places a kin that is present.
    pub(super) fn place(&mut self, k: usize) {
        let family = self.family;
        let row = family.row(k);
        let degree = self.grown[k];
        let first = self.first[k] as usize;
        if let Feed::One(s) = self.feeds[k] {
            let plant = &family.plants[s as usize];
            let chain = ChainId(row[s as usize].chain);
            let own = plant.span(chain);
            let span = first..first + own.len();
            self.len[k] = own.len() as u32;
            self.location[k] = self.own_location(k);
            self.origin[k] = plant.chain(chain).origin;
            self.parameters[span.clone()].copy_from_slice(&family.parameters[s as usize][own]);
            self.points[span.clone()].iter_mut().zip(plant.points(chain)).for_each(|(to, p)| *to = *p * degree);
            self.linear[span.clone()].iter_mut().zip(plant.radii(chain)).for_each(|(to, r)| *to = r * degree);
            if let Some(sharer) = self.sharer(k, s as usize) {
                let along = self.linear[span.clone()].iter_mut().zip(&self.parameters[span]);
                along.for_each(|(r, t)| *r *= sharer.thickness(*t as f32, 1.0));
            }
            return;
        }
        if self.place_by_points(k) {
            return;
        }
        let sources = family.plants.len();
        let shares = &self.shares[k * sources..(k + 1) * sources];
        let weighted = || row.iter().zip(shares).enumerate().filter(|(_, (_, share))| **share > 0.0);
        self.location[k] = self.own_location(k);
        self.origin[k] = weighted()
            .fold(Vec3::ZERO, |o, (s, (m, share))| o + family.plants[s].chain(ChainId(m.chain)).origin * *share);
        if let Some(elastic) = &family.elastic {
            self.place_elastic(k, elastic);
            return;
        }
        if family.units.is_some() && self.unit_seed != 0 {
            self.len[k] = family.blocks[k].1;
            self.place_by_units(k, self.unit_seed);
            return;
        }
        let sharers: Vec<_> = match family.burdens.is_empty() {
            true => Vec::new(),
            false => (0..sources).map(|s| self.sharer(k, s)).collect(),
        };
        let turn = turn_of(row, shares, &family.order);
        let (start, len) = (family.blocks[k].0 as usize * 4, family.blocks[k].1 as usize);
        self.len[k] = len as u32;
        self.sum.clear();
        self.sum.resize(3 * len, 0.0);
        let linear = &mut self.linear[first..first + len];
        linear.fill(0.0);
        // Members in order of source; each block's place is counted over all that the kin has.
        let present = row.iter().zip(shares).enumerate().filter(|(_, (m, _))| m.chain != NONE);
        let mut reach = 0.0_f32;
        for (place, (s, (_, &share))) in present.enumerate() {
            if share <= 0.0 {
                continue;
            }
            let block = &family.shapes[start + place * 4 * len..start + (place + 1) * 4 * len];
            let (shape, radii) = block.split_at(3 * len);
            self.sum.iter_mut().zip(shape).for_each(|(to, from)| *to += from * share);
            if let Some(sharer) = sharers.get(s).and_then(Option::as_ref) {
                let slots = &family.slots[start / 4..];
                let thick = radii.iter().zip(slots).map(|(r, slot)| r * sharer.thickness(*slot, share));
                linear.iter_mut().zip(thick).for_each(|(to, r)| *to += r);
            } else {
                linear.iter_mut().zip(radii).for_each(|(to, from)| *to += from * share);
            }
            let tip = Vec3::new(shape[len - 1], shape[2 * len - 1], shape[3 * len - 1]);
            reach += tip.length() * share;
        }
        linear.iter_mut().for_each(|r| *r *= degree);
        let (xs, rest) = self.sum.split_at(len);
        let (ys, zs) = rest.split_at(len);
        let scale = degree * stretch(reach, Vec3::new(xs[len - 1], ys[len - 1], zs[len - 1]).length());
        let (x, y, z) = (turn.rotate(Vec3::X) * scale, turn.rotate(Vec3::Y) * scale, turn.rotate(Vec3::Z) * scale);
        let points = &mut self.points[first..first + len];
        for (to, ((px, py), pz)) in points.iter_mut().zip(xs.iter().zip(ys).zip(zs)) {
            *to = x * *px + y * *py + z * *pz;
        }
        measure(points, &mut self.parameters[first..first + len]);
    }
}

/// What stretches a mean whose tip is `length` from its base until it is `reach` from it, within bounds.
pub(super) fn stretch(reach: f32, length: f32) -> f32 {
    let stretch = reach / length;
    // NaN where all tips come back to their bases.
    if stretch > 1.0 { stretch.min(MOST_STRETCH) } else { 1.0 }
}

/// Arc-length parameters of a polyline; spread evenly where it has no length.
pub(super) fn measure(points: &[Vec3], out: &mut [f64]) {
    let mut length = 0.0_f64;
    out[0] = 0.0;
    for (pair, t) in points.windows(2).zip(&mut out[1..]) {
        length += f64::from((pair[1] - pair[0]).length());
        *t = length;
    }
    let last = (points.len().max(2) - 1) as f64;
    if length > 0.0 {
        let scale = 1.0 / length;
        out.iter_mut().for_each(|t| *t *= scale);
    } else {
        out.iter_mut().enumerate().for_each(|(i, t)| *t = i as f64 / last);
    }
}
