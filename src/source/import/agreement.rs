//! How well two skeletons of one tree agree: the figures that imports are judged by.
//!
//! Both are sampled along their axes; a sample is covered when the other's axes pass within one and a half of the true
//! radius there, or half a percent of the height. Wood thinner than 2 % of the trunk is left out. n log n.

use glam::Vec3;

use super::nearest::Nearest;
use super::piece::Piece;
use crate::plant::Plant;

/// Radii within which a sample is covered.
const WITHIN: f64 = 1.5;
/// The same as a share of the height, whichever is more.
const WITHIN_HEIGHT: f64 = 0.005;
/// The share of the trunk's radius from which wood counts.
const THICK: f64 = 0.02;

/// How a found plant agrees with the true one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Share of the true length that was found, 0..=1.
    pub length_found: f64,
    /// Share of the found length that is true, 0..=1.
    pub length_true: f64,
    /// Median of the relative error of the radius, over the true length that was found.
    pub radius_error: f64,
    /// Found chains over true ones.
    pub chains: f64,
}

/// Compares a found plant with the true one, both in the same place.
#[must_use]
pub fn agreement(found: &Plant, truth: &Plant) -> Agreement {
    agreement_at(found, Vec3::ZERO, truth)
}

/// The same for a found plant that has to be moved by `shift` to be where the true one is: every plant has the base of
/// its main stem at the origin, and of a shrub another stem may have been taken for that.
#[must_use]
pub fn agreement_at(found: &Plant, shift: Vec3, truth: &Plant) -> Agreement {
    let height = f64::from(truth.height());
    let trunk = trunk(truth);
    let (found_axes, true_axes) = (Axes::of(found, shift), Axes::of(truth, Vec3::ZERO));
    let mut errors = Vec::new();
    let step = height * 0.002;
    let (mut all, mut covered) = (0.0, 0.0);
    true_axes.samples(step, |p, radius, length| {
        if radius < trunk * THICK {
            return;
        }
        all += length;
        if let Some((distance, other)) = found_axes.nearest(p)
            && distance <= (radius * WITHIN).max(height * WITHIN_HEIGHT)
        {
            covered += length;
            errors.push(((other - radius) / radius).abs());
        }
    });
    let length_found = share(covered, all);
    (all, covered) = (0.0, 0.0);
    found_axes.samples(step, |p, radius, length| {
        if radius < trunk * THICK {
            return;
        }
        all += length;
        if let Some((distance, other)) = true_axes.nearest(p)
            && distance <= (other * WITHIN).max(height * WITHIN_HEIGHT)
        {
            covered += length;
        }
    });
    errors.sort_by(f64::total_cmp);
    let chains = found.chains().len() as f64 / truth.chains().len().max(1) as f64;
    let radius_error = errors.get(errors.len() / 2).copied().unwrap_or(1.0);
    Agreement { length_found, length_true: share(covered, all), radius_error, chains }
}

fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

/// Radius of the thickest stem, a little above the ground.
fn trunk(plant: &Plant) -> f64 {
    let stems = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_none());
    let radius = stems.map(|id| {
        let radii = plant.radii(id);
        radii[1.min(radii.len() - 1)]
    });
    f64::from(radius.fold(0.0, f32::max))
}

/// A plant's axes as pieces.
struct Axes {
    pieces: Vec<Piece>,
    /// Radii at both ends of each piece.
    radii: Vec<[f64; 2]>,
    nearest: Nearest,
}

impl Axes {
    fn of(plant: &Plant, shift: Vec3) -> Self {
        let posed = plant.pose();
        let (mut pieces, mut radii) = (Vec::new(), Vec::new());
        for id in plant.chain_ids() {
            let points = posed.chain(plant, id);
            for (pair, r) in points.windows(2).zip(plant.radii(id).windows(2)) {
                let r = [f64::from(r[0]), f64::from(r[1])];
                let [a, b] = [pair[0], pair[1]].map(|p| (p + shift).as_dvec3());
                pieces.push(Piece::stretch(a, b, 0.0));
                radii.push(r);
            }
        }
        let nearest = Nearest::new(&pieces);
        Self { pieces, radii, nearest }
    }

    /// Distance to the nearest axis, and the radius there.
    fn nearest(&self, p: glam::DVec3) -> Option<(f64, f64)> {
        let (i, distance) = self.nearest.find(p, 1.0, |i| Some(self.pieces[i as usize].distance(p)))?;
        let t = self.pieces[i as usize].nearest(p);
        let [a, b] = self.radii[i as usize];
        Some((distance, a + (b - a) * t))
    }

    /// Calls with place, radius and length of each sample.
    fn samples(&self, step: f64, mut each: impl FnMut(glam::DVec3, f64, f64)) {
        for (piece, [a, b]) in self.pieces.iter().zip(&self.radii) {
            let length = piece.length();
            let count = ((length / step.max(1e-9)).ceil() as usize).clamp(1, 10_000);
            for k in 0..count {
                let t = (k as f64 + 0.5) / count as f64;
                each(piece.start.lerp(piece.end, t), a + (b - a) * t, length / count as f64);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Skeleton, SkeletonNode};

    fn pole(bend: f32, radius: f32) -> Plant {
        let node = |x: f32, y: f32, parent| SkeletonNode { position: Vec3::new(x, y, 0.0), radius, parent };
        Skeleton { nodes: vec![node(0.0, 0.0, None), node(0.0, 5.0, Some(0)), node(bend, 10.0, Some(1))] }
            .into_plant()
            .unwrap()
    }

    #[test]
    fn a_plant_agrees_with_itself_and_a_bent_one_by_half() {
        let straight = pole(0.0, 0.1);
        let same = agreement(&straight, &straight);
        assert_eq!((same.length_found, same.length_true, same.radius_error, same.chains), (1.0, 1.0, 0.0, 1.0));
        assert_eq!(agreement_at(&straight, Vec3::X, &straight).length_found, 0.0);
        let bent = agreement(&pole(50.0, 0.12), &straight);
        assert!((bent.length_found - 0.5).abs() < 0.05, "{bent:?}");
        assert!(bent.length_true < 0.2 && (bent.radius_error - 0.2).abs() < 1e-3, "{bent:?}");
    }
}
