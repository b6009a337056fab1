//! World positions and frames of a plant: the one pass from relative to absolute.

use glam::Vec3;

use super::curve::{Curve, STATIONS, frame_at};
use super::{ChainId, Leaf, Plant};
use crate::base::Frame;

/// A place on an axis: position and frame in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Metres.
    pub position: Vec3,
    /// `y` along the axis, towards the tip.
    pub frame: Frame,
}

/// A plant in the world.
#[derive(Clone, Debug)]
pub struct Posed {
    positions: Vec<Vec3>,
    /// Arc length from its chain's base up to each point, metres.
    arc: Vec<f64>,
    frames: Vec<[Frame; STATIONS + 1]>,
}

impl Posed {
    /// Poses every chain, parents first; linear in the number of points.
    pub(super) fn of(plant: &Plant) -> Self {
        Self::with_frames(plant, &vec![true; plant.chains().len()])
    }

    /// As [`of`](Self::of), but with frames of those chains only that bear chains; the others have one frame all along,
    /// that of their parent where they leave it. Frames are most of the cost, and most chains bear nothing.
    pub(crate) fn of_bearers(plant: &Plant) -> Self {
        let mut bears = vec![false; plant.chains().len()];
        plant.chains().iter().filter_map(|c| c.parent).for_each(|p| bears[p.index()] = true);
        Self::with_frames(plant, &bears)
    }

    fn with_frames(plant: &Plant, framed: &[bool]) -> Self {
        let mut positions = vec![Vec3::ZERO; plant.all_points().len()];
        let mut arc = Vec::with_capacity(positions.len());
        let mut frames: Vec<[Frame; STATIONS + 1]> = Vec::with_capacity(plant.chains().len());
        for id in plant.chain_ids() {
            let chain = plant.chain(id);
            let (base, frame) = match chain.parent {
                None => (chain.origin, Frame::WORLD),
                Some(parent) => {
                    let span = plant.span(parent);
                    // Posing turns the parent's polyline but does not change its arc lengths.
                    let curve = Curve::measured(&positions[span.clone()], &arc[span]);
                    let location = chain.location;
                    (curve.point(f64::from(location)), frame_at(&frames[parent.index()], location))
                }
            };
            let points = plant.points(id);
            for (position, &point) in positions[plant.span(id)].iter_mut().zip(points) {
                *position = base + frame.to_world(point);
            }
            let curve = Curve::new(points);
            frames.push(if framed[id.index()] { curve.frames(frame) } else { [frame; STATIONS + 1] });
            arc.extend_from_slice(curve.arc());
        }
        Self { positions, arc, frames }
    }

    /// World positions of all points, in the order of [`Plant::all_points`].
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// World positions of one chain's points.
    #[must_use]
    pub fn chain(&self, plant: &Plant, id: ChainId) -> &[Vec3] {
        &self.positions[plant.span(id)]
    }

    /// One chain's axis in the world, by arc length.
    #[must_use]
    pub fn curve(&self, plant: &Plant, id: ChainId) -> Curve<'_> {
        let span = plant.span(id);
        Curve::measured(&self.positions[span.clone()], &self.arc[span])
    }

    /// Position and frame on a chain's axis at arc-length parameter `location`.
    #[must_use]
    pub fn at(&self, plant: &Plant, id: ChainId, location: f32) -> Pose {
        let curve = self.curve(plant, id);
        Pose { position: curve.point(f64::from(location)), frame: frame_at(&self.frames[id.index()], location) }
    }

    /// Frame on a chain's axis at arc-length parameter `location`; cheaper than [`at`](Self::at).
    #[must_use]
    pub fn frame(&self, id: ChainId, location: f32) -> Frame {
        frame_at(&self.frames[id.index()], location)
    }

    /// Base point of a leaf, and its own axes in the world (`y` base to tip, `z` out of its upper face).
    #[must_use]
    pub fn leaf(&self, plant: &Plant, leaf: &Leaf) -> Pose {
        let pose = self.at(plant, leaf.chain, leaf.location);
        let axis = |v| pose.frame.to_world(leaf.orientation.rotate(v));
        Pose {
            position: pose.position + pose.frame.to_world(leaf.offset),
            frame: Frame { x: axis(Vec3::X), y: axis(Vec3::Y), z: axis(Vec3::Z) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn a_pose_of_bearers_has_the_same_positions_and_the_same_frames_where_something_leaves() {
        for seed in 0..10 {
            let plant = random_plant(Seed::new(seed), 50, Oddity::Wild);
            let (all, some) = (plant.pose(), Posed::of_bearers(&plant));
            assert!(all.positions == some.positions && all.arc == some.arc);
            for chain in plant.chains() {
                let Some(parent) = chain.parent else { continue };
                assert!(all.frame(parent, chain.location) == some.frame(parent, chain.location));
            }
        }
    }
}
