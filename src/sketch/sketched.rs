//! The tree at any time on the way to a sketch.
//!
//! In-betweens are straight ways of points (2018, 5.3: the transformation is interpolated), so their silhouettes lie near
//! the interpolated ones; where they don't, rims give way (`sketch/along.rs`).

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::along::Along;
use super::bound::Sketcher;
use super::region::Region;
use super::spine::{Guided, arcs};
use crate::base::Frame;
use crate::plant::{Chain, ChainId, Curve, Leaf, Plant, PlantBuilder, STATIONS, frame_at};

/// A deformation that shapes a plant's crown.
#[derive(Clone, Debug)]
pub struct Sketched {
    pub(super) sketcher: Arc<Sketcher>,
    /// How every point moves until the end.
    pub(super) shift: Vec<Vec3>,
    pub(super) wilts: Vec<bool>,
    /// What lobes were told, and how far the sketch differs from the crown about each: what in-betweens are found from.
    pub(super) told: Vec<Vec3>,
    pub(super) shares: Vec<f32>,
    pub(super) along: Along,
    /// Where a drawn trunk leads the stem.
    pub(super) guided: Guided,
    pub(super) likeness: Option<f32>,
    pub(super) spared: f32,
    /// How many times as large the whole tree gets about its foot, wood and leaves.
    pub(super) scale: f32,
    /// What is drawn, in the plane of each view, metres.
    pub targets: Vec<Region>,
    /// For each view the outline of the crown as it was, and what becomes of each of its places.
    pub outlines: Vec<(Vec<Vec2>, Vec<Vec2>)>,
}

impl Sketched {
    /// How many branches wilt, and how many there are.
    #[must_use]
    pub fn wilting(&self) -> (usize, usize) {
        (self.wilts.iter().filter(|w| **w).count(), self.wilts.len())
    }

    /// Which share of the foliage lies outside of the sketch beyond the half that may wilt, and is drawn in by its limbs, 0..=1; 0
    /// by other methods than [`Method::Adaptive`](super::Method::Adaptive).
    #[must_use]
    pub const fn spared(&self) -> f32 {
        self.spared
    }

    /// What the crown's silhouette and the sketch from the front have in common over what either covers, 0..=1; none of crowns that are
    /// not leaves, of sketches that change nothing, and by other methods than [`Method::Adaptive`](super::Method::Adaptive).
    #[must_use]
    pub const fn likeness(&self) -> Option<f32> {
        self.likeness
    }

    /// For each branch that stays: how much longer it gets; how far it turns, radians; and how much further than its
    /// neighbours do, parent and next siblings, radians.
    #[must_use]
    pub fn strains(&self) -> Vec<[f32; 3]> {
        let strains = self.sketcher.spines.strains(&self.sketcher.positions, &self.shift);
        let turns: Vec<f32> = strains.iter().map(|s| s.1).collect();
        let beyond = |i: usize| {
            let most = self.sketcher.spines.most_of_neighbours(i, &turns);
            most.map_or(0.0, |most| (turns[i] - most).max(0.0))
        };
        let stay = (0..strains.len()).filter(|i| !self.wilts[*i]);
        stay.map(|i| [strains[i].0, strains[i].1, beyond(i)]).collect()
    }

    /// The same with in-betweens whose crowns follow the interpolated silhouette more closely than straight ways do
    /// (2018, Fig. 11). Takes some twenty drawings of the tree; both ends stay as they are.
    #[must_use]
    pub fn following(mut self) -> Self {
        self.along = Along::of(&self, &self.told, &self.shares);
        self
    }

    /// The tree at a time 0..=1: at 0 the plant as it was, at 1 as sketched, without what wilts.
    #[must_use]
    pub fn at(&self, t: f32) -> Plant {
        if t.is_nan() || t <= 0.0 {
            return (*self.sketcher.plant).clone();
        }
        self.on_the_way(t.min(1.0), t >= 1.0)
    }

    /// The tree at a time, with all branches and leaves it ever has: those that have wilted are as good as without size.
    #[must_use]
    pub fn key(&self, t: f32) -> Plant {
        self.on_the_way(t.clamp(0.0, 1.0), false)
    }

    /// The tree at a time when every point goes a straight way.
    pub(super) fn straight(&self, t: f32) -> Plant {
        self.made(&|i| self.shift[i] * t, t, t >= 1.0)
    }

    fn on_the_way(&self, t: f32, finished: bool) -> Plant {
        let weights = Along::weights(t);
        self.made(&|i| self.shift[i] * t + self.along.at(i, &weights), t, finished)
    }

    /// What bends between lobes stays above the ground where they do, and limbs in a level view, where lobes may be drawn to hang below it,
    /// above the lowest of them and their own base: in a narrow foot of a crown a trunk dived into the ground and came out again, and limbs
    /// went on far below the crown. Nothing is brought higher than it was by that. And no limb sags deeper below the straight way to its
    /// first lobe than it did: base and lobe go ways of their own, and what is between followed each for a while.
    fn keep_up(&self, places: &mut [Vec3], t: f32) {
        let Sketcher { plant, positions, spines, handles, charts, foot, .. } = &*self.sketcher;
        let (stems, limbs) = if charts[0].plane.steepness() == 0.0 {
            let lobes = handles.iter().zip(&self.told).map(|(handle, way)| handle.position.y + way.y * t);
            let lowest = lobes.fold(f32::INFINITY, f32::min);
            (foot.y.min(lowest), lowest)
        } else {
            (foot.y, foot.y)
        };
        for id in plant.chain_ids() {
            let span = plant.span(id);
            // Its bearer is where it stays.
            let floor = spines.base(id.index()).map_or(stems, |(point, f)| {
                let below = places[point as usize];
                let base = if f == 0.0 { below } else { below.lerp(places[point as usize + 1], f) };
                limbs.min(base.y)
            });
            for i in span.clone() {
                places[i].y = places[i].y.max(floor.min(positions[i].y));
            }
            let lobe = spines.first_handle(id.index()).filter(|_| plant.chain(id).parent.is_some());
            if let Some(lobe) = lobe {
                tighten(&mut places[span.clone()], &positions[span], handles[lobe].arc);
            }
        }
    }

    /// The tree when points have moved, and what wilts has done so for a time.
    pub(super) fn made(&self, moved: &(dyn Fn(usize) -> Vec3 + Sync), t: f32, finished: bool) -> Plant {
        let Sketcher { plant, positions, spines, leaves, foot, .. } = &*self.sketcher;
        let place = |(i, p): (usize, &Vec3)| *p + moved(i);
        let mut places: Vec<Vec3> = positions.par_iter().enumerate().with_min_len(4096).map(place).collect();
        if self.guided.bounded {
            self.keep_up(&mut places, t);
        }
        let left = (1.0 - t).max(1e-4);
        let scale = 1.0 + (self.scale - 1.0) * t;
        let mut bears = vec![false; plant.chains().len()];
        plant.chains().iter().filter_map(|c| c.parent).for_each(|p| bears[p.index()] = true);
        // Where on the bent axis each point lies, 0..=1; base and whole length for each chain.
        let arc = arc_shares(plant, &places);
        let on = |(i, f): (u32, f32)| {
            let (a, b) = (arc[i as usize], arc.get(i as usize + 1).copied().unwrap_or(1.0));
            (if f == 0.0 { a } else { a + (b - a) * f }).clamp(0.0, 1.0)
        };
        let mut frames: Vec<[Frame; STATIONS + 1]> = Vec::with_capacity(plant.chains().len());
        let mut builder = PlantBuilder::reusing(
            Plant::default(),
            plant.chains().len(),
            plant.all_points().len(),
            plant.leaves().len(),
        );
        let mut named: Vec<Option<ChainId>> = Vec::with_capacity(plant.chains().len());
        let (mut local, mut radii) = (Vec::new(), Vec::new());
        let nothing = [Frame::WORLD; STATIONS + 1];
        for id in plant.chain_ids() {
            let i = id.index();
            let Chain { origin, parent, .. } = *plant.chain(id);
            let wilts = self.wilts[i];
            if wilts && finished {
                frames.push(nothing);
                named.push(None);
                continue;
            }
            let location = spines.base(i).map_or(0.0, on);
            let frame = parent.map_or(Frame::WORLD, |p| frame_at(&frames[p.index()], location));
            let own = &places[plant.span(id)];
            let size = if wilts { left * scale } else { scale };
            local.clear();
            local.extend(own.iter().map(|p| frame.to_local(*p - own[0]) * size));
            radii.clear();
            radii.extend(plant.radii(id).iter().map(|r| r * size));
            frames.push(if bears[i] { Curve::new(&local).frames(frame) } else { nothing });
            let parent = parent.and_then(|p| named[p.index()]);
            let origin = if scale == 1.0 { origin } else { *foot + (origin - foot) * scale };
            named.push(Some(builder.chain(parent, location, origin, &local, &radii)));
        }
        for (leaf, place) in plant.leaves().iter().zip(leaves) {
            if let Some(chain) = named[leaf.chain.index()] {
                let size = if self.wilts[leaf.chain.index()] { left * scale } else { scale };
                builder.leaf(Leaf {
                    chain,
                    location: on(*place),
                    size: leaf.size * size,
                    offset: leaf.offset * size,
                    ..*leaf
                });
            }
        }
        builder.finish_trusted()
    }
}

/// Lets what lies before an arc length of a branch, as it was, sag no deeper below the straight way there than it did.
fn tighten(places: &mut [Vec3], were: &[Vec3], until: f64) {
    let arcs = arcs(were);
    let end = arcs.partition_point(|arc| *arc < until).min(arcs.len() - 1);
    let (from, to) = ([were[0].y, places[0].y], [were[end].y, places[end].y]);
    for i in 1..end {
        let share = (arcs[i] / arcs[end]) as f32;
        let [was, is] = [0, 1].map(|k| from[k] + (to[k] - from[k]) * share);
        places[i].y = places[i].y.max(is + (were[i].y - was).min(0.0));
    }
}

/// For each point its share of its chain's length, 0..=1.
fn arc_shares(plant: &Plant, places: &[Vec3]) -> Vec<f32> {
    let mut arc = vec![0.0_f32; places.len()];
    for id in plant.chain_ids() {
        let span = plant.span(id);
        let mut length = 0.0_f64;
        for i in span.clone().skip(1) {
            length += f64::from(places[i].distance(places[i - 1]));
            arc[i] = length as f32;
        }
        if length > 0.0 {
            arc[span.clone()].iter_mut().for_each(|a| *a = (f64::from(*a) / length) as f32);
        } else {
            let last = span.len().max(2) - 1;
            arc[span].iter_mut().enumerate().for_each(|(k, a)| *a = k as f32 / last as f32);
        }
    }
    arc
}
