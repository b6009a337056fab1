//! Branching patterns (2017 CAVW, 4.1): the hybrid Gravelius and Weibull order (Eq. 1, 2), and which chains leave a
//! node together: alternate, opposite or whorled (Eq. 3).
//!
//! A plant's chains are runs of one Gravelius order already, so at a fork along a chain the chain itself is the branch of
//! the least angle. Where all branches of a fork are alike in angle and radius (Eq. 1) they share the order of what they
//! leave (Weibull), the chain's own continuation among them, and count as one group with it: in the pattern, in the divergence
//! and in [`Group::count`], which Eq. 4 compares. Angles are measured from the axis below the fork, over a stretch of it; radii
//! relative to their mean, so that one threshold serves trunks and twigs.
//!
//! The continuation is counted but is none of [`Group::chains`]: it is a stretch of the parent, which is matched as a whole in
//! its own group. As a chain of its own it would need a partner of its own, so that one axis went two ways from the fork on, and
//! a joint where blends keep axes smooth. So wherever the parent goes on both cases of Eq. 1 give the same chains; they differ
//! in order, number, pattern and divergence.
//!
//! Chains leave at one point when the mean of their radii at the base spans the gap between them along the parent. A tip
//! that ends in a fork has no continuation: there Gravelius gives the order of the parent to the branch of least angle.

use glam::Vec3;
use rayon::prelude::*;

use super::topology_tree::branching_vector;
use crate::base::math;
use crate::plant::{ChainId, Plant, Posed};
use crate::preset::plan::PatternParams;

/// How branches grow from one place (2017 CAVW, Eq. 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pattern {
    /// One branch.
    Alternate,
    /// Two branches on opposite sides.
    Opposite,
    /// Any other number, or two that are not opposite.
    Whorled,
}

/// Chains of one hybrid order that leave a place together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The chains, in order of id.
    pub chains: Vec<ChainId>,
    /// What they leave; none for the stems.
    pub parent: Option<ChainId>,
    /// Mean arc-length parameter on the parent, 0..=1.
    pub location: f32,
    /// Hybrid order, from 1.
    pub order: u16,
    /// How many grow from there: the chains, and the parent's continuation where it is like them.
    pub count: usize,
    /// How they stand.
    pub pattern: Pattern,
    /// Mean angle between neighbours round the parent, radians; 0 for one branch.
    pub divergence: f32,
}

/// The groups of a plant: the stems first, then those on each chain in order of id, from its base to its tip. Every chain
/// is in one group. `n log n` in chains.
#[must_use]
pub fn groups(plant: &Plant, posed: &Posed, params: &PatternParams) -> Vec<Group> {
    let children = plant.children();
    let mut orders = vec![1_u16; plant.chains().len()];
    let forks: Vec<Vec<Fork>> = children
        .par_iter()
        .enumerate()
        .map(|(i, below)| forks(plant, posed, ChainId(i as u32), below, params))
        .collect();
    let stems: Vec<ChainId> = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_none()).collect();
    let mut groups = vec![stem_group(plant, posed, stems, params)];
    for (id, forks) in plant.chain_ids().zip(forks) {
        let own = orders[id.index()];
        for fork in forks {
            for set in fork.sets {
                let order = if set.same { own } else { own.saturating_add(1) };
                set.chains.iter().for_each(|c| orders[c.index()] = order);
                let pattern = pattern(set.count, set.divergence, params);
                let (location, divergence) = (fork.location, set.divergence);
                let (chains, count) = (set.chains, set.count);
                groups.push(Group { chains, parent: Some(id), location, order, count, pattern, divergence });
            }
        }
    }
    groups
}

/// Eq. 3: `count` chains of one order at one place, their mean divergence in radians.
#[must_use]
pub fn pattern(count: usize, divergence: f32, params: &PatternParams) -> Pattern {
    match count {
        0 | 1 => Pattern::Alternate,
        2 if (divergence - std::f32::consts::PI).abs() < params.divergence => Pattern::Opposite,
        _ => Pattern::Whorled,
    }
}

/// The stems of a plant, which stand in one group.
fn stem_group(plant: &Plant, posed: &Posed, stems: Vec<ChainId>, params: &PatternParams) -> Group {
    let axes: Vec<Vec3> = stems.iter().map(|&s| posed.frame(s, 0.0).to_world(Vec3::Y)).collect();
    // Stems lean apart, or else stand apart.
    let middle = stems.iter().fold(Vec3::ZERO, |sum, &s| sum + plant.chain(s).origin) / stems.len().max(1) as f32;
    let ways: Vec<Vec3> = stems
        .iter()
        .zip(&axes)
        .map(|(&s, axis)| {
            let reach = branching_vector(plant.points(s));
            Vec3::new(reach.x + axis.x * 1e-3, 0.0, reach.z)
                + (plant.chain(s).origin - middle) * Vec3::new(1.0, 0.0, 1.0)
        })
        .collect();
    let divergence = divergence(&ways, Vec3::Y);
    let pattern = pattern(stems.len(), divergence, params);
    let count = stems.len();
    Group { chains: stems, parent: None, location: 0.0, order: 1, count, pattern, divergence }
}

/// What leaves a chain at one place.
struct Fork {
    location: f32,
    sets: Vec<Set>,
}

/// Those of one order.
struct Set {
    chains: Vec<ChainId>,
    /// The parent's continuation included.
    count: usize,
    /// Whether they have their parent's order.
    same: bool,
    divergence: f32,
}

/// Where on a chain nothing of it goes on.
const TIP: f32 = 0.995;

fn forks(plant: &Plant, posed: &Posed, id: ChainId, children: &[ChainId], params: &PatternParams) -> Vec<Fork> {
    if children.is_empty() {
        return Vec::new();
    }
    let curve = posed.curve(plant, id);
    let length = curve.length();
    let mut along = children.to_vec();
    along.sort_by(|a, b| plant.chain(*a).location.total_cmp(&plant.chain(*b).location).then(a.cmp(b)));
    let base = |c: ChainId| plant.radii(c)[0];
    let near = |a: &ChainId, b: &ChainId| {
        let gap = (plant.chain(*b).location - plant.chain(*a).location) * length;
        gap <= (base(*a) + base(*b)) * 0.5 + length * 1e-5
    };
    along
        .chunk_by(near)
        .map(|run| {
            let location = run.iter().map(|c| plant.chain(*c).location).sum::<f32>() / run.len() as f32;
            let radius = curve.value(plant.radii(id), f64::from(location));
            // Long enough to see past the jags of a scan.
            let span = if length > 0.0 { (radius * 4.0 / length).clamp(0.02, 0.2) } else { 0.1 };
            let at = |t: f32| curve.point(f64::from(t.clamp(0.0, 1.0)));
            let frame = posed.frame(id, location);
            let axis = (at(location) - at(location - span)).try_normalize().unwrap_or(frame.y);
            let way = |c: ChainId| {
                let own = posed.frame(id, plant.chain(c).location);
                own.to_world(branching_vector(plant.points(c)))
            };
            let mut ways: Vec<Vec3> = run.iter().map(|&c| way(c)).collect();
            let mut radii: Vec<f32> = run.iter().map(|&c| base(c)).collect();
            let goes_on = location < TIP;
            if goes_on {
                ways.push((at(location + span) - at(location)).try_normalize().unwrap_or(frame.y));
                radii.push(curve.value(plant.radii(id), f64::from((location + span * 0.5).min(1.0))));
            }
            let angles: Vec<f32> = ways.iter().map(|w| math::angle(axis, *w)).collect();
            let mean = radii.iter().sum::<f32>() / radii.len() as f32;
            let alike =
                ways.len() > 1 && deviation(&angles) <= params.angle && deviation(&radii) <= params.radius * mean;
            let mut run = run.to_vec();
            let sets = if alike {
                let (count, divergence) = (ways.len(), divergence(&ways, axis));
                run.sort_unstable();
                vec![Set { chains: run, count, same: true, divergence }]
            } else if goes_on {
                ways.pop();
                let (count, divergence) = (ways.len(), divergence(&ways, axis));
                run.sort_unstable();
                vec![Set { chains: run, count, same: false, divergence }]
            } else {
                // At a tip the branch of least angle goes on.
                let heir = (0..run.len()).min_by(|&a, &b| angles[a].total_cmp(&angles[b])).unwrap_or(0);
                ways.remove(heir);
                let heir = Set { chains: vec![run.remove(heir)], count: 1, same: true, divergence: 0.0 };
                let (count, divergence) = (ways.len(), divergence(&ways, axis));
                run.sort_unstable();
                let rest = Set { chains: run, count, same: false, divergence };
                if rest.chains.is_empty() { vec![heir] } else { vec![heir, rest] }
            };
            Fork { location, sets }
        })
        .collect()
}

/// The mean angle between neighbours round an axis, radians: half a turn and less for two.
fn divergence(ways: &[Vec3], axis: Vec3) -> f32 {
    let flat: Vec<Vec3> = ways.iter().map(|w| *w - axis * w.dot(axis)).collect();
    match flat[..] {
        [] | [_] => 0.0,
        [a, b] => math::angle(a, b),
        _ => std::f32::consts::TAU / flat.len() as f32,
    }
}

/// The standard deviation of some numbers.
fn deviation(values: &[f32]) -> f32 {
    let count = values.len().max(1) as f32;
    let mean = values.iter().sum::<f32>() / count;
    (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::plant::PlantBuilder;
    use crate::relate::random_plant::{Oddity, random_plant};

    /// A trunk with nodes of `count` branches each; `noise` in radians on every angle.
    fn known(count: usize, nodes: usize, noise: f32, seed: Seed) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0, Vec3::Y * 8.0], &[0.2, 0.12, 0.02]);
        for node in 0..nodes {
            let start = node as f32 * if count == 1 { 2.4 } else { std::f32::consts::PI / count as f32 };
            for i in 0..count {
                let s = seed.at(node as u64).at(i as u64);
                let off = |name: &str| s.child(name).range(-1.0, 1.0) * noise * 1.73;
                let around = start + std::f32::consts::TAU * i as f32 / count as f32 + off("around");
                let (sin, cos) = math::sin_cos(around);
                let (lift, out) = math::sin_cos(0.7 + off("up"));
                let way = Vec3::new(cos * out, lift, sin * out);
                builder.branch(stem, 0.15 + 0.8 * node as f32 / nodes as f32, &[Vec3::ZERO, way], &[0.03, 0.01]);
            }
        }
        builder.finish().unwrap()
    }

    #[test]
    fn patterns_are_told_through_five_degrees_of_noise() {
        let params = PatternParams::default();
        for (count, wanted) in
            [(1, Pattern::Alternate), (2, Pattern::Opposite), (3, Pattern::Whorled), (5, Pattern::Whorled)]
        {
            let plant = known(count, 30, 5.0_f32.to_radians(), Seed::new(count as u64));
            let found = groups(&plant, &plant.pose(), &params);
            assert_eq!(found.len(), 31, "{count}");
            let right = found[1..].iter().filter(|g| g.pattern == wanted && g.chains.len() == count).count();
            assert!(right >= 29, "{count}: {right} of 30");
        }
    }

    #[test]
    fn like_branches_keep_the_order_and_a_side_branch_does_not() {
        let mut builder = PlantBuilder::new();
        let (left, right) = (Vec3::new(-0.5, 1.0, 0.0), Vec3::new(0.5, 1.0, 0.0));
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0, Vec3::Y * 4.0 + left * 4.0], &[0.1, 0.1, 0.1]);
        let fork = 4.0 / (4.0 + left.length() * 4.0);
        let twin = builder.branch(stem, fork, &[Vec3::ZERO, right], &[0.1, 0.1]);
        let side = builder.branch(stem, 0.2, &[Vec3::ZERO, Vec3::X], &[0.02, 0.01]);
        // The children of a bent axis are given in its frame; turn them back to the world's.
        let plant = builder.finish().unwrap();
        let frame = plant.pose().frame(stem, fork);
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, plant.points(stem), plant.radii(stem));
        builder.branch(stem, fork, &[Vec3::ZERO, frame.to_local(right)], &[0.1, 0.1]);
        builder.branch(stem, 0.2, &[Vec3::ZERO, Vec3::X], &[0.02, 0.01]);
        let plant = builder.finish().unwrap();
        let found = groups(&plant, &plant.pose(), &PatternParams::default());
        let of = |c: ChainId| found.iter().find(|g| g.chains.contains(&c)).unwrap();
        assert_eq!((of(twin).order, of(twin).pattern), (1, Pattern::Opposite));
        assert_eq!((of(side).order, of(side).pattern), (2, Pattern::Alternate));
        // The continuation counts with its like, but is the stem's.
        assert_eq!((of(twin).count, of(twin).chains.len(), of(side).count), (2, 1, 1));
    }

    #[test]
    fn every_chain_of_any_plant_is_in_one_group() {
        for seed in 0..60 {
            let plant = random_plant(Seed::new(seed), 60, Oddity::Wild);
            let found = groups(&plant, &plant.pose(), &PatternParams::default());
            let mut chains: Vec<ChainId> = found.iter().flat_map(|g| g.chains.clone()).collect();
            chains.sort_unstable();
            assert_eq!(chains, plant.chain_ids().collect::<Vec<_>>());
            for group in &found {
                assert!(group.chains.iter().all(|&c| plant.chain(c).parent == group.parent));
            }
        }
    }
}
