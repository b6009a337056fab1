//! World positions and frames of a plant: the one pass from relative to absolute.

use glam::Vec3;
use rayon::prelude::*;

use super::curve::{Curve, STATIONS, frame_at};
use super::{ChainId, Leaf, Plant};
use crate::base::Frame;

/// From how many chains on a plant is posed by all threads, a generation after the other.
const MANY: usize = 512;
/// Chains that a thread takes at least.
const FEW: usize = 64;

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
        let (chains, points) = (plant.chains().len(), plant.all_points().len());
        let mut posed = Self {
            positions: vec![Vec3::ZERO; points],
            arc: vec![0.0; points],
            frames: vec![[Frame::WORLD; STATIONS + 1]; chains],
        };
        if chains < MANY {
            for id in plant.chain_ids() {
                let one = posed.one(plant, id, framed[id.index()]);
                posed.put(plant, id, &one);
            }
            return posed;
        }
        for generation in generations(plant) {
            let ones: Vec<PosedChain> =
                generation.par_iter().with_min_len(FEW).map(|&id| posed.one(plant, id, framed[id.index()])).collect();
            generation.iter().zip(&ones).for_each(|(&id, one)| posed.put(plant, id, one));
        }
        posed
    }

    /// Poses one chain, whose parent is posed.
    fn one(&self, plant: &Plant, id: ChainId, framed: bool) -> PosedChain {
        let chain = plant.chain(id);
        let (base, frame) = match chain.parent {
            None => (chain.origin, Frame::WORLD),
            // Posing turns the parent's polyline but does not change its arc lengths.
            Some(parent) => (
                self.curve(plant, parent).point(f64::from(chain.location)),
                frame_at(&self.frames[parent.index()], chain.location),
            ),
        };
        let points = plant.points(id);
        let curve = Curve::new(points);
        PosedChain {
            positions: points.iter().map(|&point| base + frame.to_world(point)).collect(),
            frames: if framed { curve.frames(frame) } else { [frame; STATIONS + 1] },
            arc: curve.into_arc(),
        }
    }

    fn put(&mut self, plant: &Plant, id: ChainId, one: &PosedChain) {
        let span = plant.span(id);
        self.positions[span.clone()].copy_from_slice(&one.positions);
        self.arc[span].copy_from_slice(&one.arc);
        self.frames[id.index()] = one.frames;
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

/// One chain in the world.
struct PosedChain {
    positions: Vec<Vec3>,
    arc: Vec<f64>,
    frames: [Frame; STATIONS + 1],
}

/// The chains by how many others they stand on: what one generation needs was posed with those before it.
fn generations(plant: &Plant) -> Vec<Vec<ChainId>> {
    let mut depths = vec![0; plant.chains().len()];
    let mut generations: Vec<Vec<ChainId>> = Vec::new();
    for id in plant.chain_ids() {
        let depth = plant.chain(id).parent.map_or(0, |parent| depths[parent.index()] + 1);
        depths[id.index()] = depth;
        if generations.len() <= depth {
            generations.push(Vec::new());
        }
        generations[depth].push(id);
    }
    generations
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn a_pose_of_bearers_has_the_same_positions_and_the_same_frames_where_something_leaves() {
        for seed in 0..10 {
            let plant = random_plant(Seed::new(seed), if seed < 8 { 50 } else { 2 * MANY }, Oddity::Wild);
            let (all, some) = (plant.pose(), Posed::of_bearers(&plant));
            assert!(all.positions == some.positions && all.arc == some.arc);
            for chain in plant.chains() {
                let Some(parent) = chain.parent else { continue };
                assert!(all.frame(parent, chain.location) == some.frame(parent, chain.location));
            }
        }
    }

    #[test]
    fn many_chains_stand_where_each_by_itself_stands() {
        let plant = random_plant(Seed::new(4), 2 * MANY, Oddity::Wild);
        assert!(plant.chains().len() >= MANY);
        let posed = plant.pose();
        for id in plant.chain_ids() {
            let one = posed.one(&plant, id, true);
            assert!(posed.chain(&plant, id) == one.positions && posed.frames[id.index()] == one.frames);
        }
        let foot =
            |id| plant.chain(id).parent.map(|parent| posed.at(&plant, parent, plant.chain(id).location).position);
        for id in plant.chain_ids() {
            let Some(foot) = foot(id) else { continue };
            assert!(posed.chain(&plant, id)[0].distance(foot) < 1e-4 * (1.0 + foot.length()));
        }
    }
}
