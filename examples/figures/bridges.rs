//! Where a plant has wood that its file leaves out.
//!
//! Low-poly trees often stop their trunk inside of each layer of the crown, where nobody sees it. A plant is one, so its axis
//! goes on through the gap, and what is swept there has no wood to be measured against. Such a stretch lies along one
//! chain, beside no wood that is as near as its own surface, between two pieces of wood that don't hang together; an axis that
//! strays from the one piece that it was found in is none.

use std::collections::BTreeMap;

use glam::Vec3;
use treewright::plant::Plant;
use treewright::source::skeletonize::Wood;

use crate::surface::Surface;

/// How far from the axis, in its radii, a file has wood where it has any.
const NEAR: f32 = 1.3;
/// Least stations of a bridge, five to a hundredth of the height: shorter ones are where a branch leaves its parent.
const LEAST: usize = 10;
/// How much nearer, for each length along the axis, wood comes that lies ahead or behind and not beside.
const AHEAD: f32 = 0.3;

/// Places along a plant's axes, and whether each lies on a bridge.
pub(crate) struct Bridges {
    stations: Vec<(Vec3, bool)>,
    /// Their share of the length of all axes.
    pub(crate) share: f64,
}

impl Bridges {
    /// `placed` are the wood's positions in the plant's place, `surface` the wood there.
    pub(crate) fn new(plant: &Plant, wood: &Wood, placed: &[Vec3], surface: &Surface) -> Self {
        let pieces = pieces(wood, placed);
        let posed = plant.pose();
        let step = plant.height() * 0.002;
        let mut all = Self { stations: Vec::new(), share: 0.0 };
        for id in plant.chain_ids() {
            let points = posed.chain(plant, id);
            // Each station's place, and the piece about it.
            let mut chain: Vec<(Vec3, Option<usize>)> = Vec::new();
            for (pair, radii) in points.windows(2).zip(plant.radii(id).windows(2)) {
                let along = (pair[1] - pair[0]).normalize_or_zero();
                let count = ((pair[0].distance(pair[1]) / step).ceil() as usize).clamp(1, 10_000);
                for k in 0..count {
                    let t = (k as f32 + 0.5) / count as f32;
                    let (p, radius) = (pair[0].lerp(pair[1], t), radii[0] + (radii[1] - radii[0]) * t);
                    let (distance, corner) = surface.nearest(p);
                    let (ahead, behind) = (p + along * (step * 0.5), p - along * (step * 0.5));
                    let slope = (surface.nearest(ahead).0 - surface.nearest(behind).0) / step;
                    let near = distance <= (radius * NEAR).max(step) && slope.abs() <= AHEAD;
                    chain.push((p, near.then(|| pieces.get(&bits(corner)).copied()).flatten()));
                }
            }
            let mut k = 0;
            while k < chain.len() {
                let last = (k..chain.len()).find(|&j| chain[j].1.is_some()).unwrap_or(chain.len());
                let ends = (k.checked_sub(1).and_then(|j| chain[j].1), chain.get(last).and_then(|s| s.1));
                let bridge = last - k >= LEAST && matches!(ends, (Some(a), Some(b)) if a != b);
                all.stations.extend(chain[k..last].iter().map(|s| (s.0, bridge)));
                all.stations.extend(chain.get(last).map(|s| (s.0, false)));
                k = last + 1;
            }
        }
        let bridged = all.stations.iter().filter(|s| s.1).count();
        all.share = bridged as f64 / all.stations.len().max(1) as f64;
        all
    }

    /// Whether a place of the swept surface is that of a bridge.
    pub(crate) fn holds(&self, p: Vec3) -> bool {
        if self.share == 0.0 {
            return false;
        }
        let nearest = self.stations.iter().min_by(|a, b| a.0.distance_squared(p).total_cmp(&b.0.distance_squared(p)));
        nearest.is_some_and(|s| s.1)
    }
}

fn bits(p: Vec3) -> [u32; 3] {
    p.to_array().map(|v| (v + 0.0).to_bits())
}

/// The piece of wood that each place of a corner belongs to.
fn pieces(wood: &Wood, placed: &[Vec3]) -> BTreeMap<[u32; 3], usize> {
    let mut names: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    let mut sets: Vec<usize> = Vec::new();
    for t in &wood.triangles {
        let corners = t.map(|v| {
            let next = names.len();
            *names.entry(bits(placed[v as usize])).or_insert(next)
        });
        sets.extend(sets.len()..names.len());
        for pair in [[0, 1], [1, 2]] {
            let [a, b] = pair.map(|k| crate::foliage::find(&mut sets, corners[k]));
            sets[a.max(b)] = a.min(b);
        }
    }
    names.into_iter().map(|(place, name)| (place, crate::foliage::find(&mut sets, name))).collect()
}
