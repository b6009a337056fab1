//! Simple colliders: capsules along the trunk and the thick limbs.
//!
//! Each chain whose wood is thick enough is cut into capsules, greedily: a capsule grows as long as every point between
//! its ends stays within half a radius of its axis and the radius doesn't change by more than a third. Cost is linear in
//! the points, since a capsule spans at most `SPAN` of them. The thickest are kept.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::plant::{Plant, Posed};
use crate::preset::plan::ColliderParams;

/// Most points between a capsule's ends.
const SPAN: usize = 32;

/// A capsule: everything within `radius` of the segment from `a` to `b`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capsule {
    /// One end of the axis, metres.
    pub a: [f32; 3],
    /// The other end, metres.
    pub b: [f32; 3],
    /// Metres.
    pub radius: f32,
}

/// Capsules for a plant's trunk and thick limbs, thickest first. A plant that is thin all over has none.
#[must_use]
pub fn capsules(plant: &Plant, posed: &Posed, params: &ColliderParams) -> Vec<Capsule> {
    let mut found = Vec::new();
    for id in plant.chain_ids() {
        let (points, radii) = (posed.chain(plant, id), plant.radii(id));
        // Radii fall towards the tip but for noise in scans, so the thick part is a run from the base.
        let thick = radii.iter().take_while(|&&r| r >= params.least_radius).count();
        let mut first = 0;
        while first + 1 < thick {
            let most = thick.min(first + 1 + SPAN);
            let mut last = first + 1;
            while last + 1 < most && is_straight(points, radii, first, last + 1) {
                last += 1;
            }
            let radius = (radii[first] + radii[last]) * 0.5;
            if points[first] != points[last] {
                found.push(Capsule { a: points[first].to_array(), b: points[last].to_array(), radius });
            }
            first = last;
        }
    }
    // Stable, so that equally thick ones stay in the plant's order.
    found.sort_by(|p, q| q.radius.total_cmp(&p.radius));
    found.truncate(params.most);
    found
}

fn is_straight(points: &[Vec3], radii: &[f32], first: usize, last: usize) -> bool {
    if radii[last] < radii[first] * (2.0 / 3.0) || radii[last] > radii[first] * 1.5 {
        return false;
    }
    let (a, along) = (points[first], points[last] - points[first]);
    let length = along.length_squared();
    (first + 1..last).all(|i| {
        let t = if length > 0.0 { ((points[i] - a).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        points[i].distance(a + along * t) <= 0.5 * radii[i]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn a_straight_trunk_is_one_capsule_and_twigs_are_none() {
        let points: Vec<Vec3> = (0..9).map(|i| Vec3::Y * i as f32).collect();
        let mut builder = PlantBuilder::new();
        let trunk = builder.stem(Vec3::X, &points, &[0.2; 9]);
        builder.branch(trunk, 0.5, &points[..3], &[0.02; 3]);
        let plant = builder.finish().unwrap();
        let found = capsules(&plant, &plant.pose(), &ColliderParams::default());
        assert_eq!(found, [Capsule { a: [1.0, 0.0, 0.0], b: [1.0, 8.0, 0.0], radius: 0.2 }]);
    }

    #[test]
    fn a_bend_parts_capsules_and_the_thickest_are_kept() {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y + Vec3::X], &[0.3, 0.25, 0.2]);
        let plant = builder.finish().unwrap();
        let of = |most| capsules(&plant, &plant.pose(), &ColliderParams { most, ..ColliderParams::default() });
        assert_eq!(of(9).len(), 2);
        assert_eq!(of(1)[0].b, [0.0, 1.0, 0.0]);
    }
}
