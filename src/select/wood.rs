//! A posed plant's wood in flat arrays: each branch's axis with radii from where it has left its parent's wood.
//!
//! A branch starts inside its parent, so its first stretch, the collar, lies in foreign wood by nature. The collar ends
//! where the branch's surface is clear of the parent's, seen along the tangent of the parent there, and at
//! [`LONGEST_COLLAR`] parent's radii at the latest: what is still inside then runs inside.

use glam::Vec3;

use crate::plant::{Curve, Plant, Posed};

/// A collar's most, in the parent's radii where the branch leaves: what a branch as thick as its parent needs that leaves at
/// 15 degrees.
const LONGEST_COLLAR: f32 = 8.0;

/// Axes and radii of all branches beyond their collars.
#[derive(Clone, Debug, Default)]
pub(super) struct Wood {
    /// Points of the axes, branch after branch, metres.
    pub(super) points: Vec<Vec3>,
    /// Radii there.
    pub(super) radii: Vec<f32>,
    /// Where the points of each chain begin; one more at the end.
    pub(super) starts: Vec<u32>,
    /// Surface of each whole chain, collar included, square metres.
    pub(super) surfaces: Vec<f32>,
}

impl Wood {
    /// Linear in the points of a plant.
    pub(super) fn of(plant: &Plant, posed: &Posed) -> Self {
        let count = plant.all_points().len();
        let mut wood = Self {
            points: Vec::with_capacity(count + plant.chains().len()),
            radii: Vec::with_capacity(count + plant.chains().len()),
            starts: Vec::with_capacity(plant.chains().len() + 1),
            surfaces: Vec::with_capacity(plant.chains().len()),
        };
        for id in plant.chain_ids() {
            wood.starts.push(wood.points.len() as u32);
            let (points, radii) = (posed.chain(plant, id), plant.radii(id));
            let areas = points.windows(2).zip(radii.windows(2)).map(|(p, r)| strip(p[0].distance(p[1]), r[0], r[1]));
            wood.surfaces.push(areas.sum());
            let chain = plant.chain(id);
            let Some(parent) = chain.parent else {
                wood.points.extend_from_slice(points);
                wood.radii.extend_from_slice(radii);
                continue;
            };
            let bearer = Curve::value(&posed.curve(plant, parent), plant.radii(parent), f64::from(chain.location));
            let along = posed.frame(parent, chain.location).y;
            wood.push_beyond_collar(points, radii, along, bearer);
        }
        wood.starts.push(wood.points.len() as u32);
        wood
    }

    /// Adds a branch from the end of its collar on a parent of radius `bearer` that runs `along`.
    fn push_beyond_collar(&mut self, points: &[Vec3], radii: &[f32], along: Vec3, bearer: f32) {
        let base = points[0];
        let mut walked = 0.0_f32;
        let mut before = -(bearer + radii[0]);
        for i in 1..points.len() {
            let step = points[i].distance(points[i - 1]);
            let offset = points[i] - base;
            let clear = (offset - along * offset.dot(along)).length() - (bearer + radii[i]);
            let end = LONGEST_COLLAR * bearer;
            // Shares of this step after which the branch is clear, and the collar at its end.
            let free = if clear >= 0.0 { Some(before / (before - clear)) } else { None };
            let over = if walked + step > end { Some((end - walked) / step) } else { None };
            if let Some(t) = [free, over].into_iter().flatten().min_by(f32::total_cmp) {
                let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
                self.points.push(points[i - 1].lerp(points[i], t));
                self.radii.push(radii[i - 1] + (radii[i] - radii[i - 1]) * t);
                self.points.extend_from_slice(&points[i..]);
                self.radii.extend_from_slice(&radii[i..]);
                return;
            }
            walked += step;
            before = clear;
        }
    }

    /// Where a chain's points lie; empty for one that never leaves its collar.
    pub(super) fn span(&self, chain: usize) -> std::ops::Range<usize> {
        self.starts[chain] as usize..self.starts[chain + 1] as usize
    }
}

/// Surface of a stretch of wood, without its ends: square metres. The slope of its side is left out, below 1 % for
/// wood.
pub(super) fn strip(length: f32, from: f32, to: f32) -> f32 {
    std::f32::consts::PI * (from + to) * length
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{ChainId, PlantBuilder};

    #[test]
    fn a_branch_begins_where_it_has_left_its_parent() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.1]);
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.05, 0.05]);
        // Inside the stem for good.
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::Y], &[0.05, 0.05]);
        // A stub within it.
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 0.1], &[0.01, 0.01]);
        let plant = builder.finish().unwrap();
        let wood = Wood::of(&plant, &plant.pose());
        assert!((wood.points[wood.span(1).start].x - 0.15).abs() < 1e-6);
        assert!((wood.points[wood.span(2).start].y - 2.8).abs() < 1e-6);
        assert!(wood.span(3).is_empty());
        let stem_surface = std::f32::consts::TAU * 0.1 * 4.0;
        assert!((wood.surfaces[ChainId(0).index()] - stem_surface).abs() < 1e-5);
    }
}
