//! A piece whose vertices all lie at two ends: a box, a prism, a cone or a stump of one, open or closed.
//!
//! Low-poly trees are made of them. There is nothing between the ends that could contract to an axis, and a closed one has no
//! ring to start from: the axis is the straight line between the middles of the ends.

use glam::DVec3;

use super::facets;
use super::surface::Surface;
use crate::source::import::limb::Limb;

/// The part of the length within which an end's vertices lie.
const END: f64 = 0.25;
/// Most that the distances of an end's vertices from the axis may scatter, a share of their mean.
const SCATTER: f64 = 0.4;
/// The share of an end's widest that its vertices are out by, unless they are the middle of a cap.
const RIM: f64 = 0.3;
/// What a point is taken for, a share of the other end.
const POINT: f64 = 0.02;
/// Least length over the greatest radius.
const SLENDER: f64 = 1.2;
/// Rounds in which the direction is found.
const ROUNDS: usize = 4;

/// The axis of such a piece, and how far its faces are from it, as a share of the distance of its vertices; none for all
/// other pieces.
pub(super) fn prism(surface: &Surface) -> Option<(Limb, f64)> {
    let positions = &surface.positions;
    let far = |from: DVec3| {
        let farther = |a: DVec3, b: DVec3| if b.distance_squared(from) > a.distance_squared(from) { b } else { a };
        positions.iter().copied().reduce(farther)
    };
    let first = far(positions.iter().sum::<DVec3>() / positions.len().max(1) as f64)?;
    let second = far(first)?;
    // From one corner to the farthest one leads askew; the middles of those near either lead along.
    let (mut from, mut to) = (first, second);
    for _ in 0..ROUNDS {
        let along = (to - from).try_normalize()?;
        let t = |p: DVec3| p.dot(along);
        let (low, high) = positions.iter().fold((f64::MAX, f64::MIN), |(l, h), &p| (l.min(t(p)), h.max(t(p))));
        let half = (low + high) * 0.5;
        (from, to) = (rim_middle(positions, |p| t(p) < half)?, rim_middle(positions, |p| t(p) >= half)?);
    }
    let length = from.distance(to);
    let along = (to - from).try_normalize()?;
    let far = |p: DVec3| (p - from).dot(along);
    let (low, high) = positions.iter().fold((f64::MAX, f64::MIN), |(l, h), &p| (l.min(far(p)), h.max(far(p))));
    let t = |p: DVec3| (far(p) - low) / (high - low);
    if positions.iter().any(|&p| (END..=1.0 - END).contains(&t(p))) {
        return None;
    }
    let off = |p: DVec3| ((p - from) - along * (p - from).dot(along)).length();
    let end = |at: &dyn Fn(f64) -> bool| {
        let offs = || positions.iter().filter(|&&p| at(t(p))).map(|&p| off(p));
        let widest = offs().fold(0.0, f64::max);
        let rim = || offs().filter(|&o| o >= widest * RIM);
        let count = rim().count().max(1) as f64;
        let mean = rim().sum::<f64>() / count;
        let scatter = (rim().map(|o| (o - mean) * (o - mean)).sum::<f64>() / count).sqrt();
        (mean, scatter, rim().count())
    };
    let ends = [end(&|t| t < 0.5), end(&|t| t >= 0.5)];
    let widest = ends[0].0.max(ends[1].0);
    let is_end = |&(mean, scatter, count): &(f64, f64, usize)| {
        mean <= widest * POINT || (count >= 3 && scatter <= mean * SCATTER)
    };
    if widest <= 0.0 || length < widest * SLENDER || !ends.iter().all(is_end) {
        return None;
    }
    let [a, b] = ends.map(|(mean, ..)| mean.max(widest * POINT));
    let homes = vec![0; positions.len()];
    let faces = facets::share(surface, &homes, |_| Some((from, along, widest)));
    Some((Limb::path(&[(from, a), (to, b)]), faces))
}

/// The middle of those vertices of one end that are not the middle of its cap.
fn rim_middle(positions: &[DVec3], is_there: impl Fn(DVec3) -> bool) -> Option<DVec3> {
    let mean = |near: &dyn Fn(DVec3) -> bool| {
        let there = positions.iter().filter(|&&p| is_there(p) && near(p));
        let (sum, count) = there.fold((DVec3::ZERO, 0.0), |(sum, count), &p| (sum + p, count + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    let rough = mean(&|_| true)?;
    let reach = positions.iter().filter(|&&p| is_there(p)).fold(0.0_f64, |m, p| m.max(p.distance(rough)));
    mean(&|p| p.distance(rough) >= reach * RIM)
}

#[cfg(test)]
mod tests {
    use super::super::cap::closed;
    use super::super::shapes;
    use super::*;

    #[test]
    fn boxes_prisms_and_cones_have_a_straight_axis_and_bent_ones_none() {
        let path = [DVec3::new(1.0, 0.0, 0.0), DVec3::new(1.5, 2.0, 0.3)];
        for sides in [3, 4, 5, 9] {
            for radii in [[0.3, 0.3], [0.4, 0.2], [0.4, 0.0]] {
                let open = shapes::tube(&path, &radii, sides);
                for surface in [closed(&open), open] {
                    let (limb, faces) = prism(&surface).unwrap();
                    let nodes = if limb.nodes[0].position.y < 1.0 { [0, 1] } else { [1, 0] };
                    for (k, node) in nodes.into_iter().enumerate() {
                        assert!(limb.nodes[node].position.distance(path[k]) < 1e-9, "{sides} {radii:?}");
                        assert!((limb.nodes[node].radius - radii[k]).abs() < 0.01, "{sides} {radii:?}");
                    }
                    assert!(faces < if sides < 6 { facets::COARSE } else { 1.0 });
                }
            }
        }
        let bent = [DVec3::ZERO, DVec3::Y, DVec3::new(1.0, 2.0, 0.0)];
        assert!(prism(&shapes::tube(&bent, &[0.2; 3], 4)).is_none());
        assert!(prism(&shapes::disc(8, 2)).is_none());
        assert!(prism(&shapes::fork()).is_none() && prism(&Surface::default()).is_none());
    }
}
