//! Where the kernel puts a kin of an elastic family (2018 TOG, section 4, and what it lists under its limits).
//!
//! A chain's form is a point of three spaces: its length, a number; its turn against the kin's branching vector, a
//! rotation; and its square root velocity function at unit norm, a point on a sphere. A blend is the weighted mean in each:
//! linear, by the mean of rotations (`relate/turns.rs`), on great circles. So a chain on its way between two is as long as they are on average,
//! however far it bends; where points move straight (the paper's metric) a chain that turns by 90° is a third shorter in
//! the middle. Straight lines between square root velocity functions themselves are the textbook's geodesic of open
//! curves, but shorten a chain that turns by 90° by a half; and with the root of the length going evenly, branches that
//! come out of nothing do most of their growing at the end: the largest jump in length was 1.8 times that of straight
//! paths. Both were dropped.
//!
//! More than two functions have their Fréchet mean by Karcher's descent from the middle of the chord: the step is the mean of
//! the ways to the members. Points on the sphere are kept as coefficients of the members, so a step costs a handful of products
//! whatever the chain's length.
//!
//! Radii are blended linearly; the allometric rule is not applied, since a path that it bends is no geodesic. A
//! child stands where it does along the shared parameter, so it neither slides past its neighbours nor leaves its parent.

use glam::Vec3;

use super::blocks::Elastic;
use crate::base::{Rotation, math};
use crate::plant::ChainId;
use crate::preset::plan::ChainPath;
use crate::relate::family::NONE;
use crate::relate::kernel::{Blender, Feed};
use crate::relate::place::measure;
use crate::relate::turns::turn_of;

/// Most steps of a descent, and the step at which it ends, radians.
const STEPS: usize = 64;
const ENDS: f64 = 1e-9;

/// The form of a kin of several members, without its place.
pub(super) struct Form {
    pub(super) turn: Rotation,
    /// Metres.
    pub(super) length: f64,
    /// Members that are there: coefficients of their functions.
    pub(super) coefficients: Vec<f64>,
}

impl Blender<'_> {
    /// The form of a kin that several members feed.
    pub(super) fn form(&self, k: usize, elastic: &Elastic) -> Form {
        let row = self.family.row(k);
        let shares: Vec<f64> =
            row.iter().zip(self.share(k)).filter(|(m, _)| m.chain != NONE).map(|(_, s)| f64::from(*s)).collect();
        let length = elastic.lengths[k].iter().zip(&shares).map(|(l, w)| l * w).sum();
        Form {
            turn: turn_of(row, self.share(k), &self.family.order),
            length,
            coefficients: mean_on_sphere(&elastic.angles[k], &shares),
        }
    }

    /// Places a kin that several members feed.
    pub(in crate::relate) fn place_elastic(&mut self, k: usize, elastic: &Elastic) {
        let family = self.family;
        let degree = self.degrees[k];
        let first = self.first[k] as usize;
        let (start, len) = (family.blocks[k].0 as usize * 4, family.blocks[k].1 as usize);
        self.len[k] = len as u32;
        let block = |place: usize| &family.shapes[start + place * 4 * len..start + (place + 1) * 4 * len];
        let row = family.row(k);
        let shares: Vec<f32> =
            row.iter().zip(self.share(k)).filter(|(m, _)| m.chain != NONE).map(|(_, share)| *share).collect();
        let weights: Vec<f32>;
        let form = match elastic.path {
            ChainPath::Elastic => {
                let form = self.form(k, elastic);
                weights = form.coefficients.iter().map(|c| *c as f32).collect();
                Some(form)
            }
            ChainPath::Straight => {
                weights = shares.clone();
                None
            }
        };
        self.sum.clear();
        self.sum.resize(3 * len, 0.0);
        let linear = &mut self.linear[first..first + len];
        linear.fill(0.0);
        for (place, (&weight, &share)) in weights.iter().zip(&shares).enumerate() {
            if share <= 0.0 {
                continue;
            }
            let (shape, radii) = block(place).split_at(3 * len);
            self.sum.iter_mut().zip(shape).for_each(|(to, from)| *to += from * weight);
            linear.iter_mut().zip(radii).for_each(|(to, from)| *to += from * share);
        }
        linear.iter_mut().for_each(|r| *r *= degree);
        let (xs, rest) = self.sum.split_at(len);
        let (ys, zs) = rest.split_at(len);
        let points = &mut self.points[first..first + len];
        let shown = |i: usize| Vec3::new(xs[i], ys[i], zs[i]);
        match form {
            Some(form) => {
                let norm: f64 = self.sum.iter().map(|z| f64::from(*z) * f64::from(*z)).sum();
                let scale = if norm > 0.0 { (form.length / norm) as f32 * degree } else { 0.0 };
                let (x, y, z) = (form.turn.rotate(Vec3::X), form.turn.rotate(Vec3::Y), form.turn.rotate(Vec3::Z));
                let mut at = Vec3::ZERO;
                for (i, to) in points.iter_mut().enumerate() {
                    let q = shown(i);
                    let step = q * (q.length() * scale);
                    at += x * step.x + y * step.y + z * step.z;
                    *to = at;
                }
            }
            None => points.iter_mut().enumerate().for_each(|(i, to)| *to = shown(i) * degree),
        }
        measure(points, &mut self.parameters[first..first + len]);
    }

    /// Where a kin of an elastic family leaves its parent, which must have been placed.
    pub(in crate::relate) fn locate_elastic(&self, k: usize, elastic: &Elastic) -> f32 {
        let family = self.family;
        let p = family.parents[k];
        if p == NONE {
            return self.location[k];
        }
        let p = p as usize;
        if self.feeds[k] == self.feeds[p] && self.feeds[k] != Feed::Several {
            return self.location[k];
        }
        // Kins without a place of their own stand where they do on their members: on a chain beside its own reflection that is
        // the shared parameter, since what bends out of the plane gets shorter, and the rest longer.
        let own = elastic.shared[k].at;
        let at = if own.is_nan() { f64::from(self.location[k]) } else { own };
        let place = match self.feeds[p] {
            Feed::Several => self.arc_length(p, elastic, at),
            _ if own.is_nan() => at,
            Feed::One(s) => {
                let row = family.row(p);
                let before = row[..s as usize].iter().filter(|m| m.chain != NONE).count();
                elastic.shared[p].maps.get(before).map_or(at, |map| map.at(at))
            }
            Feed::Nothing => at,
        };
        (place as f32).clamp(0.0, 1.0)
    }

    /// The arc-length parameter of a place on a kin that several members feed, by the parameter that they share.
    fn arc_length(&self, k: usize, elastic: &Elastic, shared: f64) -> f64 {
        let slots = &elastic.slots[k];
        let parameters = &self.parameters[self.span(k)];
        let next = slots.partition_point(|&u| u <= shared).clamp(1, slots.len() - 1);
        let span = slots[next] - slots[next - 1];
        let f = if span > 0.0 { ((shared - slots[next - 1]) / span).clamp(0.0, 1.0) } else { 0.0 };
        parameters[next - 1] + (parameters[next] - parameters[next - 1]) * f
    }

    /// Where what stands on a member of a kin is on the kin: arc-length parameters.
    pub(in crate::relate) fn located_on(&self, k: usize, elastic: &Elastic, source: usize, location: f32) -> f32 {
        if self.feeds[k] != Feed::Several {
            return location;
        }
        let before = self.family.row(k)[..source].iter().filter(|m| m.chain != NONE).count();
        let own = f64::from(location);
        let shared = elastic.shared[k].maps.get(before).map_or(own, |map| map.back(own));
        (self.arc_length(k, elastic, shared) as f32).clamp(0.0, 1.0)
    }

    /// The radii as they were placed, for families whose paths no rule may bend.
    pub(in crate::relate) fn keep_radii(&mut self) {
        for k in 0..self.feeds.len() {
            if self.moved[k] && self.feeds[k] != Feed::Nothing {
                let span = self.span(k);
                let (radii, linear) = (&mut self.radii, &self.linear);
                radii[span.clone()].copy_from_slice(&linear[span]);
            }
        }
    }

    /// The chain that alone feeds a kin.
    pub(super) fn only(&self, k: usize, source: u32) -> ChainId {
        ChainId(self.family.row(k)[source as usize].chain)
    }
}

/// Coefficients of a point on the great circle from one unit vector to another, at a share of the way.
fn great_circle(share: f64, angle: f64) -> (f64, f64) {
    let sine = math::sin64(angle);
    // No way at all, or none that is shortest.
    if sine < 1e-6 {
        return (1.0 - share, share);
    }
    (math::sin64((1.0 - share) * angle) / sine, math::sin64(share * angle) / sine)
}

/// The weighted Fréchet mean of unit vectors with these angles between them, as coefficients.
fn mean_on_sphere(angles: &[f64], weights: &[f64]) -> Vec<f64> {
    let count = weights.len();
    let there: Vec<usize> = (0..count).filter(|&m| weights[m] > 0.0).collect();
    let mut coefficients = vec![0.0; count];
    let Some(&first) = there.first() else { return coefficients };
    coefficients[first] = 1.0;
    if let [a, b] = there[..] {
        let share = weights[b] / (weights[a] + weights[b]);
        (coefficients[a], coefficients[b]) = great_circle(share, angles[a * count + b]);
        return coefficients;
    }
    let products: Vec<f64> = angles.iter().map(|angle| math::cos64(*angle)).collect();
    let product = |a: &[f64], m: usize| there.iter().map(|&i| a[i] * products[i * count + m]).sum::<f64>();
    let norm = |a: &[f64]| there.iter().map(|&m| a[m] * product(a, m)).sum::<f64>().max(0.0).sqrt();
    let whole: f64 = there.iter().map(|&m| weights[m]).sum();
    let chord: Vec<f64> = weights.iter().map(|w| w.max(0.0) / whole).collect();
    let length = norm(&chord);
    // Functions that cancel out have no middle; then it is the way from the first.
    if length > 1e-6 {
        coefficients = chord.iter().map(|c| c / length).collect();
    }
    for _ in 0..STEPS {
        let mut step = vec![0.0; count];
        let mut along = 0.0;
        for &m in &there {
            let cosine = product(&coefficients, m).clamp(-1.0, 1.0);
            let sine = (1.0 - cosine * cosine).sqrt();
            let per = weights[m] / whole * if sine > 1e-9 { math::acos64(cosine) / sine } else { 1.0 };
            step[m] += per;
            along += per * cosine;
        }
        there.iter().for_each(|&m| step[m] -= along * coefficients[m]);
        let length = norm(&step);
        if length < ENDS {
            break;
        }
        let (sin, cos) = (math::sin64(length) / length, math::cos64(length));
        there.iter().for_each(|&m| coefficients[m] = coefficients[m] * cos + step[m] * sin);
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_vectors_at_right_angles_have_their_middle() {
        let right = std::f64::consts::FRAC_PI_2;
        let angles = [0.0, right, right, right, 0.0, right, right, right, 0.0];
        let mean = mean_on_sphere(&angles, &[1.0, 1.0, 1.0]);
        let middle = 1.0 / 3.0_f64.sqrt();
        assert!(mean.iter().all(|c| (c - middle).abs() < 1e-9), "{mean:?}");
        // Heavier ones are nearer, and the ways to all add up to nothing.
        let weights = [0.2, 0.5, 0.3];
        let mean = mean_on_sphere(&angles, &weights);
        assert!((mean.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-9);
        let way = |m: usize| weights[m] * math::acos64(mean[m]) / (1.0 - mean[m] * mean[m]).sqrt();
        let back: f64 = (0..3).map(|m| way(m) * mean[m]).sum();
        assert!((0..3).all(|m| (way(m) - back * mean[m]).abs() < 1e-7), "{mean:?}");
        // Two: exactly on the great circle.
        let pair = mean_on_sphere(&angles, &[1.0, 0.0, 3.0]);
        assert!((pair[0] - math::sin64(right * 0.25)).abs() < 1e-12 && pair[1] == 0.0);
        // Of one vector nothing but itself.
        assert_eq!(mean_on_sphere(&[0.0; 9], &[0.2, 0.5, 0.3]).iter().map(|c| (c * 1e9).round()).sum::<f64>(), 1e9);
    }
}
