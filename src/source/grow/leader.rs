//! Leaders: the one trunk that leads up to the top of a conifer or a poplar, and what it holds back.
//!
//! The paper's trunk is a path as all others are. Drawn straight by its thickness alone, only its foot would be: the upper half of
//! a spruce swayed by a metre, and its tip hung over. So a leader is straightened up to its tip (`skeleton`). And later
//! iterations set shoots of their full length on it up to its very tip, level ones, which read as a flag on a mast. A
//! real leader has apical dominance: what leaves it is no longer than what it has grown since, and the younger, the
//! steeper.
//!
//! Species whose `leader` is free have none.
//!
//! Limits: a tree of several stems has none, nor one that a limb as strong as its trunk leaves below its top.

use glam::Vec3;

use crate::base::{Rotation, math};

/// No node.
const NONE: u32 = u32::MAX;
/// Share of the trunk's radius from which on a limb is its rival. Tried: only limbs that rise by 0.6 of what the trunk does
/// above them. Of young spruces more were leaders, but so were limes and pines.
const RIVAL: f32 = 0.8;
/// Share of the height up to which a leader has none.
const LEADING: f32 = 0.9;
/// How far from the vertical shoots at a leader's tip stand at the least, radians.
const STEEP: f32 = 0.5;

/// The nodes of the leader from the ground to its tip; none where a tree has none. Places and the arrays beside it are of one
/// forest, parents before children; `heavy` is the child of each that carries the most.
pub(super) fn leader(places: &[Vec3], parents: &[u32], heavy: &[u32], radii: &[f32]) -> Vec<usize> {
    let roots = parents.iter().enumerate().filter(|(i, parent)| *i == **parent as usize).count();
    if roots != 1 {
        return Vec::new();
    }
    let mut rivals = vec![0.0_f32; places.len()];
    for (i, &parent) in parents.iter().enumerate() {
        let parent = parent as usize;
        if parent != i && heavy[parent] as usize != i {
            rivals[parent] = rivals[parent].max(radii[i]);
        }
    }
    let leading = places.iter().fold(0.0_f32, |top, p| top.max(p.y)) * LEADING;
    let mut leader = vec![0];
    let mut here = 0;
    while heavy[here] != NONE {
        let next = heavy[here] as usize;
        if rivals[here] > radii[next] * RIVAL && places[here].y < leading {
            return Vec::new();
        }
        leader.push(next);
        here = next;
    }
    if places[here].y < leading { Vec::new() } else { leader }
}

/// Makes branches that leave a leader no longer than what is left of it above them, and steeper by as much as they are shortened.
pub(super) fn hold_back(places: &mut [Vec3], parents: &[u32], leader: &[usize]) {
    let Some(&tip) = leader.last() else { return };
    let mut leads = vec![false; places.len()];
    leader.iter().for_each(|&i| leads[i] = true);
    // Which branch of the leader each node belongs to, by the branch's first node, and the farthest that each goes.
    let mut branch = vec![NONE; places.len()];
    let mut farthest: Vec<(f32, Vec3)> = vec![(0.0, Vec3::ZERO); places.len()];
    for i in 0..places.len() {
        let parent = parents[i] as usize;
        if leads[i] || parent == i {
            continue;
        }
        let first = if leads[parent] { i as u32 } else { branch[parent] };
        branch[i] = first;
        let way = places[i] - places[parents[first as usize] as usize];
        let far = &mut farthest[first as usize];
        if way.length() > far.0 {
            *far = (way.length(), way);
        }
    }
    let left = |base: usize| places[tip].distance(places[base]);
    let held: Vec<Option<(Vec3, f32, Rotation)>> = (0..places.len())
        .map(|i| {
            let base = (branch[i] == i as u32).then(|| parents[i] as usize)?;
            let ((long, way), left) = (farthest[i], left(base));
            (long > left).then(|| {
                let (size, lean) = (left / long, math::angle(Vec3::Y, way));
                let raised = (lean - STEEP).max(0.0) * (1.0 - size);
                let turn =
                    way.cross(Vec3::Y).try_normalize().map_or(Rotation::IDENTITY, |axis| Rotation::about(axis, raised));
                (places[base], size, turn)
            })
        })
        .collect();
    for (place, first) in places.iter_mut().zip(&branch) {
        if let Some(Some((base, size, turn))) = held.get(*first as usize) {
            *place = *base + turn.rotate(*place - *base) * *size;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trunk of ten metres, a node each, with a level branch of two nodes and 3 m at 3, 6 and 9 m, as thick as the trunk
    /// above by `thick`.
    fn mast(thick: f32) -> (Vec<Vec3>, Vec<u32>, Vec<u32>, Vec<f32>) {
        let mut places: Vec<Vec3> = (0..11).map(|k| Vec3::Y * k as f32).collect();
        let mut parents: Vec<u32> = (0..11).map(|k: u32| k.saturating_sub(1)).collect();
        let mut heavy: Vec<u32> = (1..11).chain([NONE]).collect();
        let mut radii: Vec<f32> = (0..11).map(|k| 1.1 - k as f32 * 0.1).collect();
        for at in [3_u32, 6, 9] {
            let first = places.len() as u32;
            for out in [1.5, 3.0] {
                places.push(Vec3::new(out, at as f32, 0.0));
                radii.push(radii[at as usize + 1] * thick);
            }
            parents.extend([at, first]);
            heavy.extend([first + 1, NONE]);
        }
        (places, parents, heavy, radii)
    }

    #[test]
    fn a_trunk_without_a_rival_leads_up_to_its_tip() {
        let (places, parents, heavy, radii) = mast(0.4);
        assert_eq!(leader(&places, &parents, &heavy, &radii), (0..11).collect::<Vec<_>>());
        let (places, parents, heavy, radii) = mast(0.9);
        assert!(leader(&places, &parents, &heavy, &radii).is_empty());
        // A second stem.
        let (mut places, mut parents, mut heavy, mut radii) = mast(0.4);
        parents.push(places.len() as u32);
        places.push(Vec3::X);
        heavy.push(NONE);
        radii.push(0.1);
        assert!(leader(&places, &parents, &heavy, &radii).is_empty());
    }

    #[test]
    fn shoots_near_the_tip_are_held_back_and_steep_and_others_stay() {
        let (mut places, parents, heavy, radii) = mast(0.4);
        let before = places.clone();
        let leader = leader(&places, &parents, &heavy, &radii);
        hold_back(&mut places, &parents, &leader);
        // Seven and four metres are left above the lower two, one above the uppermost.
        assert_eq!(places[..15], before[..15]);
        let way = places[16] - places[9];
        assert!((way.length() - 1.0).abs() < 1e-5 && way.y > 0.6 && way.x > 0.0, "{way}");
        assert!((places[15] - places[9]).distance(way * 0.5) < 1e-5);
        let still = places.clone();
        hold_back(&mut places, &parents, &[]);
        assert_eq!(places, still);
    }
}
