//! World positions and frames of a plant: the one pass from relative to absolute.

use std::sync::OnceLock;

use glam::Vec3;

use super::curve::{Curve, STATIONS, frame_at, tangent_at};
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
    /// The frame in which each chain's points are given.
    starts: Vec<Frame>,
    /// Where in `frames` each chain's are; [`NONE`] where it has one frame all along.
    framed: Vec<u32>,
    frames: Vec<[Frame; STATIONS + 1]>,
    /// Those of the plant's leaves, once somebody asks: every level of detail does.
    leaves: OnceLock<Vec<Pose>>,
}

/// Of a chain without frames of its own.
const NONE: u32 = u32::MAX;

impl Posed {
    /// Poses every chain, parents first; linear in the number of points.
    pub(super) fn of(plant: &Plant) -> Self {
        Self::with_frames(plant, &vec![true; plant.chains().len()], None)
    }

    /// As [`of`](Self::of), but with frames of those chains only that bear chains; the others have one frame all along,
    /// that of their parent where they leave it. Frames are most of the cost, and most chains bear nothing.
    pub(crate) fn of_bearers(plant: &Plant) -> Self {
        Self::with_frames(plant, &bearing(plant), None)
    }

    /// The longest edge of the box around all axes, metres; 0 of a plant without points.
    #[must_use]
    pub fn extent(&self) -> f32 {
        let ends = self.positions.iter().fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(*p), high.max(*p)));
        (ends.1 - ends.0).max_element().max(0.0)
    }

    /// As [`of_bearers`](Self::of_bearers), of a plant that was posed `before` so and has the same chains with as many points,
    /// of which those that are `changed` may have another shape; what leaves a changed chain is changed, too.
    pub(crate) fn of_changed(plant: &Plant, before: &Self, changed: &[bool]) -> Self {
        Self::with_frames(plant, &bearing(plant), Some((before, changed)))
    }

    fn with_frames(plant: &Plant, framed: &[bool], known: Option<(&Self, &[bool])>) -> Self {
        let mut positions = vec![Vec3::ZERO; plant.all_points().len()];
        let mut arc = Vec::with_capacity(positions.len());
        let count = plant.chains().len();
        let (mut starts, mut places) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut frames: Vec<[Frame; STATIONS + 1]> = Vec::with_capacity(framed.iter().filter(|own| **own).count());
        for id in plant.chain_ids() {
            let chain = plant.chain(id);
            if let Some((known, _)) = known.filter(|(_, changed)| !changed[id.index()]) {
                let span = plant.span(id);
                positions[span.clone()].copy_from_slice(&known.positions[span.clone()]);
                arc.extend_from_slice(&known.arc[span]);
                starts.push(known.starts[id.index()]);
                let own = known.frames.get(known.framed[id.index()] as usize);
                places.push(if own.is_some() { frames.len() as u32 } else { NONE });
                frames.extend(own);
                continue;
            }
            let (base, frame) = match chain.parent {
                None => (chain.origin, Frame::WORLD),
                Some(parent) => {
                    let span = plant.span(parent);
                    // Posing turns the parent's polyline but does not change its arc lengths.
                    let curve = Curve::measured(&positions[span.clone()], &arc[span]);
                    let location = chain.location;
                    let own = frame_of(&frames, &places, &starts, parent, location);
                    (curve.point(f64::from(location)), own)
                }
            };
            let points = plant.points(id);
            for (position, &point) in positions[plant.span(id)].iter_mut().zip(points) {
                *position = base + frame.to_world(point);
            }
            let start = arc.len();
            Curve::measure(points, &mut arc);
            starts.push(frame);
            if framed[id.index()] {
                places.push(frames.len() as u32);
                frames.push(Curve::measured(points, &arc[start..]).frames(frame));
            } else {
                places.push(NONE);
            }
        }
        Self { positions, arc, starts, framed: places, frames, leaves: OnceLock::new() }
    }

    /// Gives some chains the frames that [`of_bearers`](Self::of_bearers) left out.
    pub(crate) fn frame_chains(&mut self, plant: &Plant, chains: impl Iterator<Item = ChainId>) {
        for id in chains.filter(|id| self.framed[id.index()] == NONE).collect::<Vec<_>>() {
            if self.framed[id.index()] == NONE {
                self.framed[id.index()] = self.frames.len() as u32;
                let curve = Curve::measured(plant.points(id), &self.arc[plant.span(id)]);
                self.frames.push(curve.frames(self.starts[id.index()]));
            }
        }
    }

    /// World positions of all points, in the order of [`Plant::all_points`].
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Height of the highest point of any axis above the origin, metres.
    #[must_use]
    pub(crate) fn height(&self) -> f32 {
        self.positions.iter().fold(0.0, |top, p| top.max(p.y))
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
        Pose { position: curve.point(f64::from(location)), frame: self.frame(id, location) }
    }

    /// Frame on a chain's axis at arc-length parameter `location`; cheaper than [`at`](Self::at).
    #[must_use]
    pub fn frame(&self, id: ChainId, location: f32) -> Frame {
        frame_of(&self.frames, &self.framed, &self.starts, id, location)
    }

    /// Direction of a chain's axis at arc-length parameter `location`: `y` of its [`frame`](Self::frame), for less.
    #[must_use]
    pub fn tangent(&self, id: ChainId, location: f32) -> Vec3 {
        match self.frames.get(self.framed[id.index()] as usize) {
            Some(frames) => tangent_at(frames, location),
            None => self.starts[id.index()].y,
        }
    }

    /// [`leaf`](Self::leaf) of every leaf of the plant that was posed, made once.
    #[must_use]
    pub fn leaves(&self, plant: &Plant) -> &[Pose] {
        self.leaves.get_or_init(|| plant.leaves().iter().map(|leaf| self.leaf(plant, leaf)).collect())
    }

    /// Base point of a leaf, and its own axes in the world (`y` base to tip, `z` out of its upper face).
    #[must_use]
    pub fn leaf(&self, plant: &Plant, leaf: &Leaf) -> Pose {
        let pose = self.at(plant, leaf.chain, leaf.location);
        let axis = |v| pose.frame.to_world(leaf.orientation.rotate(v));
        let offset = if leaf.offset == Vec3::ZERO { Vec3::ZERO } else { pose.frame.to_world(leaf.offset) };
        let (x, y) = (axis(Vec3::X), axis(Vec3::Y));
        Pose { position: pose.position + offset, frame: Frame { x, y, z: x.cross(y) } }
    }
}

/// Which chains bear chains.
fn bearing(plant: &Plant) -> Vec<bool> {
    let mut bears = vec![false; plant.chains().len()];
    plant.chains().iter().filter_map(|c| c.parent).for_each(|p| bears[p.index()] = true);
    bears
}

/// The frame of a chain at arc-length parameter `location`.
fn frame_of(frames: &[[Frame; STATIONS + 1]], framed: &[u32], starts: &[Frame], id: ChainId, location: f32) -> Frame {
    match frames.get(framed[id.index()] as usize) {
        Some(frames) => frame_at(frames, location),
        None => starts[id.index()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn a_pose_after_a_change_is_that_of_the_changed_plant() {
        let mut moved = false;
        for seed in 0..10 {
            let plant = random_plant(Seed::new(seed), 50, Oddity::Wild);
            let before = Posed::of_bearers(&plant);
            let mut changed: Vec<bool> =
                plant.chain_ids().map(|id| Seed::new(seed).child("bent").at(u64::from(id.0)).unit() < 0.2).collect();
            let mut builder = crate::plant::PlantBuilder::new();
            for id in plant.chain_ids() {
                let chain = plant.chain(id);
                let bent = f32::from(u8::from(changed[id.index()]));
                let points: Vec<Vec3> = plant.points(id).iter().map(|p| *p + Vec3::X * (p.y * bent)).collect();
                match chain.parent {
                    None => builder.stem(chain.origin, &points, plant.radii(id)),
                    Some(parent) => {
                        changed[id.index()] |= changed[parent.index()];
                        builder.branch(parent, chain.location, &points, plant.radii(id))
                    }
                };
            }
            let Ok(bent) = builder.finish() else { continue };
            let (all, some) = (Posed::of_bearers(&bent), Posed::of_changed(&bent, &before, &changed));
            assert!(all.positions == some.positions && all.arc == some.arc, "{seed}");
            moved |= all.positions != before.positions;
            assert!(all.starts == some.starts && all.framed == some.framed && all.frames == some.frames);
        }
        assert!(moved);
    }

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
            let mut more = some.clone();
            more.frame_chains(&plant, plant.chain_ids());
            for id in plant.chain_ids() {
                for t in [0.0, 0.3, 0.77, 1.0] {
                    assert!(all.frame(id, t) == more.frame(id, t) && all.frame(id, t).y == all.tangent(id, t));
                }
            }
        }
    }
}
