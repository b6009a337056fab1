//! From the structure of graph nodes to a skeleton with radii, ready to be cut into chains.
//!
//! Paths through an irregular graph are visibly crooked; the paper names it as the one difference to other methods
//! (2015, 4). Here every node is drawn towards the middle of its neighbours along the axis it lies on, a few times; a
//! fork lies on its thickest axis, and the branches follow it. Tips and the root stay. Then each edge gets a midpoint on
//! the smooth curve through its neighbours, since the graph is coarse (fifty edges from the ground to the top).

use glam::Vec3;

use super::nodes::Nodes;
use super::structure::Structure;
use crate::base::math;
use crate::plant::{Skeleton, SkeletonNode};

/// No node.
const NONE: u32 = u32::MAX;
/// Times that every node is drawn towards its neighbours.
const PASSES: u32 = 6;
/// Times that the thickest wood is drawn before.
const STIFF: u32 = 50;
/// A branch from the root's own node counts as a stem of its own from this share of the thickest's radius.
const STEM: f32 = 0.45;

/// A tree of places with radii; parents before children, the root first and its own parent.
struct Axes {
    places: Vec<Vec3>,
    parents: Vec<u32>,
    /// The child that carries the most; none at a tip.
    heavy: Vec<u32>,
    radii: Vec<f32>,
}

/// The skeleton of a structure, `height` metres tall; none where nothing rises above the ground.
pub(super) fn skeleton(
    structure: &Structure,
    nodes: &Nodes,
    height: f32,
    crookedness: f32,
    tip_radius: f32,
    exponent: f32,
) -> Option<Skeleton> {
    let places = structure.members.iter().map(|m| nodes.at(m.node)).collect();
    let parents = structure.members.iter().map(|m| m.parent).collect();
    let mut axes = Axes::new(places, parents, tip_radius, exponent);
    axes.smooth(crookedness);
    let mut axes = axes.refined();
    let top = axes.places.iter().fold(0.0_f32, |t, p| t.max(p.y));
    if top <= 0.0 {
        return None;
    }
    let scale = height / top;
    axes.places.iter_mut().for_each(|p| *p *= scale);
    Some(axes.into_skeleton())
}

impl Axes {
    /// Radii by the allometric rule: a node's radius to the `exponent` is the sum of its children's, and a tip's is
    /// `tip_radius`.
    fn new(places: Vec<Vec3>, parents: Vec<u32>, tip_radius: f32, exponent: f32) -> Self {
        // Count tips instead of adding powers: exact, and no order of summation.
        let mut tips = vec![0_u32; places.len()];
        let mut heavy = vec![NONE; places.len()];
        for i in (0..places.len()).rev() {
            tips[i] = tips[i].max(1);
            let parent = parents[i] as usize;
            if parent != i {
                let best = heavy[parent];
                if best == NONE || tips[i] >= tips[best as usize] {
                    heavy[parent] = i as u32;
                }
                tips[parent] += tips[i];
            }
        }
        let radius = |tips: u32| tip_radius * math::pow64(f64::from(tips), 1.0 / f64::from(exponent)) as f32;
        let radii = tips.into_iter().map(radius).collect();
        Self { places, parents, heavy, radii }
    }

    /// Draws nodes towards the middle of their neighbours along their axis: not at all for a crookedness of 1, half the
    /// way each time for 0. All are drawn [`PASSES`] times, thick wood more often before: it sways less than twigs do,
    /// and its bends are as long as its crowns of nodes are wide. Radii are drawn likewise but never across a fork into
    /// a thinner branch, so that steps at forks become tapers.
    fn smooth(&mut self, crookedness: f32) {
        let share = 0.5 * (1.0 - crookedness);
        let thickest = self.radii[0];
        for pass in (0..PASSES + STIFF).rev() {
            let before = self.places.clone();
            for i in 1..before.len() {
                let often = PASSES as f32 + STIFF as f32 * (self.radii[i] / thickest);
                if self.heavy[i] != NONE && (pass as f32) < often {
                    let middle = (before[self.parents[i] as usize] + before[self.heavy[i] as usize]) * 0.5;
                    self.places[i] = before[i].lerp(middle, share);
                }
            }
        }
        for _ in 0..3 {
            let before = self.radii.clone();
            for i in 1..before.len() {
                let (parent, heavy) = (self.parents[i] as usize, self.heavy[i]);
                if heavy != NONE && self.heavy[parent] as usize == i {
                    self.radii[i] = before[i] * 0.5 + (before[parent] + before[heavy as usize]) * 0.25;
                }
            }
        }
    }

    /// The same tree with a node in the middle of each edge, on the cubic through the four nodes along the axis
    /// (Catmull-Rom at one half).
    fn refined(&self) -> Self {
        let count = self.places.len();
        let mut refined = Self {
            places: Vec::with_capacity(count * 2),
            parents: Vec::with_capacity(count * 2),
            heavy: Vec::new(),
            radii: Vec::with_capacity(count * 2),
        };
        // Where each node of the coarse tree lies in the fine one.
        let mut fine = vec![0_u32; count];
        for i in 0..count {
            let parent = self.parents[i] as usize;
            if parent != i {
                let (a, b) = (self.places[parent], self.places[i]);
                // A side branch starts afresh at its fork: the axis that it leaves does not bend it.
                let on_axis = self.heavy[parent] as usize == i && self.parents[parent] as usize != parent;
                let before = if on_axis { self.places[self.parents[parent] as usize] } else { a };
                let after = if self.heavy[i] == NONE { b } else { self.places[self.heavy[i] as usize] };
                let radius = if self.heavy[parent] as usize == i {
                    (self.radii[parent] + self.radii[i]) * 0.5
                } else {
                    self.radii[i]
                };
                refined.places.push((a + b) * 0.5625 - (before + after) * 0.0625);
                refined.parents.push(fine[parent]);
                refined.radii.push(radius);
            }
            fine[i] = refined.places.len() as u32;
            refined.places.push(self.places[i]);
            refined.parents.push(if parent == i { 0 } else { fine[i] - 1 });
            refined.radii.push(self.radii[i]);
        }
        refined
    }

    /// The skeleton. Thick branches from the root's own node are stems of their own, each set apart from the centre by
    /// its radius: a shrub.
    fn into_skeleton(self) -> Skeleton {
        let from_root = |i: usize| i != 0 && self.parents[i] == 0;
        let thickest = (0..self.places.len()).filter(|&i| from_root(i)).fold(0.0_f32, |r, i| r.max(self.radii[i]));
        let stems: Vec<usize> =
            (0..self.places.len()).filter(|&i| from_root(i) && self.radii[i] >= thickest * STEM).collect();
        let mut nodes: Vec<SkeletonNode> = Vec::with_capacity(self.places.len() + stems.len());
        nodes.push(SkeletonNode { position: self.places[0], radius: self.radii[0], parent: None });
        let mut shifted = vec![0_u32; self.places.len()];
        for i in 1..self.places.len() {
            let mut parent = shifted[self.parents[i] as usize];
            if stems.len() > 1 && stems.contains(&i) {
                let away = Vec3::new(self.places[i].x, 0.0, self.places[i].z).normalize_or(Vec3::ZERO);
                parent = nodes.len() as u32;
                nodes.push(SkeletonNode { position: away * self.radii[i], radius: self.radii[i], parent: None });
            }
            shifted[i] = nodes.len() as u32;
            nodes.push(SkeletonNode { position: self.places[i], radius: self.radii[i], parent: Some(parent) });
        }
        Skeleton { nodes }
    }
}
