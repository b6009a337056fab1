//! Simple colliders: capsules along the trunk and the thick limbs.
//!
//! Each chain whose wood is thick enough is cut into capsules up to where it is thin, greedily: a capsule grows as long as every point between
//! its ends stays within some share of a radius of its axis and the radius doesn't change by more than a third: the smallest of
//! [`TOLERANCES`] by which there are no more capsules than asked for. Where even the largest leaves more, the thickest are kept. Cost is
//! linear in the points, since a capsule spans at most `SPAN` of them.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::base::math;
use crate::plant::{Plant, Posed};
use crate::preset::plan::ColliderParams;

/// Most points between a capsule's ends.
const SPAN: usize = 32;
/// How far a chain may lie from a capsule's axis, as shares of its radius. With a half alone a trunk of a scan stood out of its capsules
/// by more than a third of its radius, where half of those that were asked for were never made.
const TOLERANCES: [f32; 4] = [0.15, 0.22, 0.33, 0.5];

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
    let fits =
        |within: &f32| Some(along(plant, posed, params.least_radius, *within)).filter(|all| all.len() <= params.most);
    let [.., last] = TOLERANCES;
    let mut found = TOLERANCES.iter().find_map(fits).unwrap_or_else(|| along(plant, posed, params.least_radius, last));
    // Stable, so that equally thick ones stay in the plant's order.
    found.sort_by(|p, q| q.radius.total_cmp(&p.radius));
    found.truncate(params.most);
    found
}

/// Capsules of all chains as far as they are thick, no part of which lies farther than `within` radii from an axis.
fn along(plant: &Plant, posed: &Posed, least_radius: f32, within: f32) -> Vec<Capsule> {
    let mut found = Vec::new();
    let (mut points, mut radii) = (Vec::new(), Vec::new());
    for id in plant.chain_ids() {
        thick_part((posed.chain(plant, id), plant.radii(id)), least_radius, (&mut points, &mut radii));
        let mut first = 0;
        while first + 1 < points.len() {
            let most = points.len().min(first + 1 + SPAN);
            let mut last = first + 1;
            while last + 1 < most && is_straight((&points, &radii), (first, last + 1), within) {
                last += 1;
            }
            let radius = (radii[first] + radii[last]) * 0.5;
            if points[first] != points[last] {
                found.push(Capsule { a: points[first].to_array(), b: points[last].to_array(), radius });
            }
            first = last;
        }
    }
    found
}

/// A chain up to the last place that is so thick; thinner places on the way are noise of scans. Where it thins by more than
/// a third between two points there are points between, for one capsule would be too thick at one end.
fn thick_part((all, own): (&[Vec3], &[f32]), least: f32, (points, radii): (&mut Vec<Vec3>, &mut Vec<f32>)) {
    points.clear();
    radii.clear();
    let Some(thick) = own.iter().rposition(|&r| r >= least) else { return };
    points.push(all[0]);
    radii.push(own[0].max(least));
    for i in 1..all.len().min(thick + 2) {
        let (before, here) = (own[i - 1].max(least), own[i].max(least));
        // The last stretch ends where it is as thin as that.
        let end = if i > thick { (own[i - 1] - least) / (own[i - 1] - own[i]) } else { 1.0 };
        if end <= 0.0 {
            return;
        }
        let ratio = here / before;
        let parts = (math::ln(ratio).abs() / math::ln(1.5)).ceil().max(1.0);
        for k in 1..=parts as u32 {
            let r = before * math::pow(ratio, k as f32 / parts);
            let share = if parts > 1.0 { (r - before) / (here - before) } else { 1.0 };
            points.push(all[i - 1].lerp(all[i], share * end));
            radii.push(r);
        }
    }
}

fn is_straight((points, radii): (&[Vec3], &[f32]), (first, last): (usize, usize), within: f32) -> bool {
    if radii[last] < radii[first] * (2.0 / 3.0) || radii[last] > radii[first] * 1.5 {
        return false;
    }
    let (a, along) = (points[first], points[last] - points[first]);
    let length = along.length_squared();
    (first + 1..last).all(|i| {
        let t = if length > 0.0 { ((points[i] - a).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        points[i].distance(a + along * t) <= within * radii[i]
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

    #[test]
    fn a_bow_is_followed_as_closely_as_there_are_capsules_for_it() {
        let points: Vec<Vec3> = (0..=24).map(|i| Vec3::new(0.004 * (i * i) as f32, 0.2 * i as f32, 0.0)).collect();
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &points, &[0.2; 25]);
        let plant = builder.finish().unwrap();
        let off = |most: usize| {
            let found = capsules(&plant, &plant.pose(), &ColliderParams { most, ..ColliderParams::default() });
            assert!(found.len() <= most);
            let away = |p: &Vec3| {
                let to = |c: &Capsule| {
                    let (a, b) = (Vec3::from(c.a), Vec3::from(c.b));
                    p.distance(a + (b - a) * ((*p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0))
                };
                found.iter().map(to).fold(f32::MAX, f32::min)
            };
            points.iter().map(away).fold(0.0, f32::max)
        };
        let (few, many) = (off(4), off(32));
        assert!(many <= 0.15 * 0.2 + 1e-6 && few > many && few <= 0.5 * 0.2 + 1e-6, "{few} {many}");
    }

    #[test]
    fn trunks_of_few_points_and_noisy_scans_have_capsules_up_to_where_they_are_thin() {
        let of = |points: &[Vec3], radii: &[f32]| {
            let mut builder = PlantBuilder::new();
            builder.stem(Vec3::ZERO, points, radii);
            let plant = builder.finish().unwrap();
            capsules(&plant, &plant.pose(), &ColliderParams { least_radius: 0.05, ..ColliderParams::default() })
        };
        let (low, high) = (Vec3::ZERO, Vec3::Y * 10.0);
        // Two points: one in twelve of the way is too thin, and no capsule stands out by half.
        let found = of(&[low, high], &[0.29, 0.02]);
        let top = found.iter().map(|c| c.b[1]).fold(0.0, f32::max);
        assert!((top - 10.0 * 0.24 / 0.27).abs() < 1e-3, "{top}");
        for capsule in &found {
            let own = [capsule.a, capsule.b].map(|end| 0.29 - 0.027 * end[1]);
            assert!(own.iter().all(|r| (capsule.radius / r - 1.0).abs() < 0.3), "{capsule:?}");
        }
        // A thin base and a thin place in the middle.
        let points: Vec<Vec3> = (0..6).map(|i| Vec3::Y * i as f32).collect();
        let found = of(&points, &[0.04, 0.2, 0.2, 0.049, 0.2, 0.01]);
        let ends = found.iter().fold((9.0_f32, 0.0_f32), |(l, h), c| (l.min(c.a[1]), h.max(c.b[1])));
        assert!(ends.0 == 0.0 && ends.1 > 4.7 && ends.1 < 5.0, "{found:?}");
        assert_eq!(of(&[low, high], &[0.04, 0.03]), []);
    }
}
