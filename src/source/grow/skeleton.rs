//! From the ways through nodes to a skeleton with first radii, ready to be cut into chains.
//!
//! Paths through an irregular graph are visibly crooked; the paper names it as the one difference to other methods
//! (2015, 4). Here every node is drawn towards the middle of its neighbours along the axis it lies on, a few times; a
//! fork lies on its thickest axis, and the branches follow it. Tips and the root stay. Then each edge gets a midpoint on
//! the smooth curve through its neighbours where the graph is coarse (fifty edges from the ground to the top).
//!
//! Smoothing moves axes off their nodes, which alone keep them apart. Whether wood overlaps then is told by `overlap`, capsule
//! against capsule.

use glam::Vec3;

use super::leader;
use super::refine::Ways;
use crate::base::math;
use crate::plant::{Skeleton, SkeletonNode};
use crate::preset::plan::{GrowParams, LeaderRule};

/// No node.
const NONE: u32 = u32::MAX;
/// Times that every node is drawn towards its neighbours.
const PASSES: u32 = 6;
/// Wood from this share of the greatest radius is straightened as a whole.
const STIFF: f32 = 0.2;
/// An axis is straightened as one up to where its radius falls below this share.
const SAME: f32 = 0.8;
/// Over how many nodes, far before near.
const STRIDES: [usize; 4] = [12, 6, 3, 1];
/// Edges a hop from which edges need no midpoints.
const FINE: f32 = 1.5;
/// A fork below the clear bole becomes two stems where the thinner branch bears at least this share of the tips of the
/// thicker.
const STEM: f32 = 0.1;
/// How far out a stem of its own stands, as a share of the way that its first node is out.
const APART: f32 = 0.4;

/// A forest of places with radii; parents before children, a root its own parent.
struct Axes {
    places: Vec<Vec3>,
    parents: Vec<u32>,
    /// The child that carries the most; none at a tip.
    heavy: Vec<u32>,
    radii: Vec<f32>,
}

/// The skeleton of a plant's ways; none where nothing rises above the ground. It is as tall as `params` say, or a height of
/// the region is `scale` metres. `barred` says whether an obstacle is between two places; smoothing leads through none.
pub(super) fn skeleton(
    ways: &Ways,
    params: &GrowParams,
    scale: Option<f32>,
    barred: &dyn Fn(Vec3, Vec3) -> bool,
) -> Option<Skeleton> {
    let (places, parents) = stems(ways, params.bole.min(ways.first));
    let mut axes = Axes::new(places, parents, params.tip_radius, params.allometry);
    let fine = ways.fine;
    let paths = axes.places.clone();
    // Smoothed radii hide rivals.
    let leader = match params.leader {
        LeaderRule::Held => leader::leader(&axes.places, &axes.parents, &axes.heavy, &axes.radii),
        LeaderRule::Free => Vec::new(),
    };
    axes.smooth(params.crookedness, fine, &leader);
    leader::hold_back(&mut axes.places, &axes.parents, &leader);
    axes.kept_clear(&paths, barred);
    // Finer ways are fine enough as they are.
    let mut axes = if fine < FINE { axes.refined(barred) } else { axes };
    let top = axes.places.iter().fold(0.0_f32, |t, p| t.max(p.y));
    if top <= 0.0 {
        return None;
    }
    let scale = scale.unwrap_or(params.height / top);
    axes.places.iter_mut().for_each(|p| *p *= scale);
    let parent = |i: usize| (axes.parents[i] as usize != i).then_some(axes.parents[i]);
    let node = |i: usize| SkeletonNode { position: axes.places[i], radius: axes.radii[i], parent: parent(i) };
    Some(Skeleton { nodes: (0..axes.places.len()).map(node).collect() })
}

/// Places and parents of ways whose forks below `bole`, or at the root, are separate stems: the thinner branch of such a
/// fork gets a root of its own beside the first.
fn stems(ways: &Ways, bole: f32) -> (Vec<Vec3>, Vec<u32>) {
    let count = ways.places.len();
    let (tips, heavy) = carried(&ways.parents);
    let mut places = Vec::with_capacity(count);
    let mut parents: Vec<u32> = Vec::with_capacity(count);
    let mut moved = vec![0_u32; count];
    // Whether all wood from the ground to here is below the bole: what hangs down to there from above is no stem.
    let mut low = vec![true; count];
    for (i, (&here, &fork)) in ways.places.iter().zip(&ways.parents).enumerate() {
        let fork = fork as usize;
        let thick = heavy[fork];
        low[i] = i == 0 || (low[fork] && here.y < bole);
        let splits = i != 0 && thick as usize != i && low[fork] && tips[i] as f32 >= tips[thick as usize] as f32 * STEM;
        let mut parent = moved[fork];
        if splits {
            parent = places.len() as u32;
            places.push(Vec3::new(here.x, 0.0, here.z) * APART);
            parents.push(parent);
        }
        moved[i] = places.len() as u32;
        places.push(here);
        parents.push(if i == 0 { 0 } else { parent });
    }
    (places, parents)
}

/// How many tips each node carries, and which of its children carries the most, the first of equals.
fn carried(parents: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut tips = vec![0_u32; parents.len()];
    let mut heavy = vec![NONE; parents.len()];
    for i in (0..parents.len()).rev() {
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
    (tips, heavy)
}

impl Axes {
    /// First radii, by which axes are told apart (`radii` gives the final ones): a node's radius to the `exponent` is the sum of its children's, and a tip's is
    /// `tip_radius`.
    fn new(places: Vec<Vec3>, parents: Vec<u32>, tip_radius: f32, exponent: f32) -> Self {
        // Tips are counted, not powers added: exact, and no order of summation.
        let (tips, heavy) = carried(&parents);
        let radius = |tips: u32| tip_radius * math::pow64(f64::from(tips), 1.0 / f64::from(exponent)) as f32;
        let radii = tips.into_iter().map(radius).collect();
        Self { places, parents, heavy, radii }
    }

    /// Draws nodes towards the middle of their neighbours along their axis: not at all for a crookedness of 1, half the
    /// way each time for 0. Radii are drawn likewise but never across a fork into a thinner branch, so that steps at
    /// forks become tapers.
    ///
    /// Where ways are `fine` times finer than the graph, the same lengths of wood are smoothed, and so the
    /// same shapes are left.
    fn smooth(&mut self, crookedness: f32, fine: f32, leader: &[usize]) {
        let share = 0.5 * (1.0 - crookedness);
        self.straighten(share, fine, leader);
        // Lengths of wood over which passes smooth go with the root of their number.
        for _ in 0..(PASSES as f32 * fine * fine).round() as u32 {
            let before = self.places.clone();
            for i in 0..before.len() {
                if self.heavy[i] != NONE && self.parents[i] as usize != i {
                    let middle = (before[self.parents[i] as usize] + before[self.heavy[i] as usize]) * 0.5;
                    self.places[i] = before[i].lerp(middle, share);
                }
            }
        }
        for _ in 0..(3.0 * fine * fine).round() as u32 {
            let before = self.radii.clone();
            for i in 0..before.len() {
                let (parent, heavy) = (self.parents[i] as usize, self.heavy[i]);
                if heavy != NONE && parent != i && self.heavy[parent] as usize == i {
                    self.radii[i] = before[i] * 0.5 + (before[parent] + before[heavy as usize]) * 0.25;
                }
            }
        }
    }

    /// Puts nodes back to their places on `paths` where smoothing led through an obstacle; paths lead through none.
    fn kept_clear(&mut self, paths: &[Vec3], barred: &dyn Fn(Vec3, Vec3) -> bool) {
        // A node that is put back may bar its neighbour: the number of nodes that are back grows until nothing is barred.
        let mut changed = true;
        while changed {
            changed = false;
            for i in 0..paths.len() {
                let parent = self.parents[i] as usize;
                let back = self.places[i] == paths[i] && self.places[parent] == paths[parent];
                if parent != i && !back && barred(self.places[parent], self.places[i]) {
                    (self.places[parent], self.places[i]) = (paths[parent], paths[i]);
                    changed = true;
                }
            }
        }
    }

    /// Takes the long sway out of thick wood, which neighbours alone hardly feel: a path of forty nodes wanders as a
    /// whole. Nodes are drawn towards the middle between those [`STRIDES`] further down and up their axis, in the measure
    /// of their thickness, a leader in full; what they bear moves with them.
    fn straighten(&mut self, share: f32, fine: f32, leader: &[usize]) {
        let thickest = self.radii.iter().fold(f32::MIN_POSITIVE, |t, r| t.max(*r));
        // What is drawn, and in which measure.
        let mut measures: Vec<f32> =
            self.radii.iter().map(|r| if *r >= thickest * STIFF { r / thickest } else { 0.0 }).collect();
        let mut rank = vec![NONE; self.places.len()];
        for (k, &i) in leader.iter().enumerate() {
            measures[i] = 1.0;
            rank[i] = k as u32;
        }
        let stiff: Vec<usize> = (0..self.places.len()).filter(|&i| measures[i] > 0.0).collect();
        let mut places = self.places.clone();
        for stride in STRIDES {
            let stride = (stride as f32 * fine).round() as usize;
            let span = |&i: &usize| match rank[i] {
                NONE => self.span(i, stride),
                k => {
                    let k = k as usize;
                    let reach = stride.min(k).min(leader.len() - 1 - k);
                    (leader[k - reach], leader[k + reach])
                }
            };
            let spans: Vec<(usize, usize)> = stiff.iter().map(span).collect();
            for _ in 0..PASSES {
                let before = places.clone();
                for (&i, &(below, above)) in stiff.iter().zip(&spans) {
                    let middle = (before[below] + before[above]) * 0.5;
                    places[i] = before[i].lerp(middle, share * measures[i]);
                }
            }
        }
        let mut moved = vec![Vec3::ZERO; places.len()];
        for i in 0..places.len() {
            let drawn = measures[i] > 0.0;
            moved[i] = if drawn { places[i] - self.places[i] } else { moved[self.parents[i] as usize] };
            self.places[i] += moved[i];
        }
    }

    /// The nodes equally many edges below and above one on its axis, at most `stride`; the node itself at either end.
    fn span(&self, node: usize, stride: usize) -> (usize, usize) {
        let (mut below, mut above) = (node, node);
        for _ in 0..stride {
            let (parent, child) = (self.parents[below] as usize, self.heavy[above]);
            if parent == below || child == NONE {
                break;
            }
            // Above a fork of two alike the axis is a limb's: it would tilt the trunk towards the heavier one.
            if self.radii[child as usize] < self.radii[node] * SAME {
                break;
            }
            // The fork that a branch leaves is its first node; the axis below is another's.
            let leaves = self.heavy[parent] as usize != below;
            (below, above) = (parent, child as usize);
            if leaves {
                break;
            }
        }
        (below, above)
    }

    /// The same tree with a node in the middle of each edge, on the cubic through the four nodes along the axis
    /// (Catmull-Rom at one half).
    fn refined(&self, barred: &dyn Fn(Vec3, Vec3) -> bool) -> Self {
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
                let curved = (a + b) * 0.5625 - (before + after) * 0.0625;
                let straight = (a + b) * 0.5;
                refined.places.push(if barred(a, curved) || barred(curved, b) { straight } else { curved });
                refined.parents.push(fine[parent]);
                refined.radii.push(radius);
            }
            fine[i] = refined.places.len() as u32;
            refined.places.push(self.places[i]);
            refined.parents.push(if parent == i { fine[i] } else { fine[i] - 1 });
            refined.radii.push(self.radii[i]);
        }
        refined
    }
}
