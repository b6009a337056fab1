//! Brings the members of one kin to equal numbers of points: each is resampled at the union of all their arc-length
//! parameters.
//!
//! Every vertex of every member survives in place, so corners stay corners. Parameters of different members that lie
//! within [`MERGE`] share a slot, where each member shows its own vertex; two vertices of one member never do. Linear in
//! the sum of the members' vertices, but for one sort.

use glam::Vec3;

/// Largest distance of parameters that share a slot.
const MERGE: f64 = 1e-4;

/// One member as it stands in its plant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polyline<'a> {
    /// Arc-length parameters, 0..=1, never falling.
    pub(super) parameters: &'a [f64],
    /// Points, one a parameter.
    pub(super) points: &'a [Vec3],
    /// Radii, one a parameter.
    pub(super) radii: &'a [f32],
}

/// Members with equal numbers of points.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// The parameter of each slot: the mean of those that share it.
    pub(super) parameters: Vec<f64>,
    /// Points of the first member, then of the second, and so on, one a slot each.
    pub(super) points: Vec<Vec3>,
    /// Radii, likewise.
    pub(super) radii: Vec<f32>,
}

/// Resamples all members.
pub(super) fn resample(members: &[Polyline<'_>]) -> Slots {
    // (parameter, member, vertex), sorted; a member's own vertices stay in order.
    let mut all: Vec<(f64, usize, usize)> = Vec::new();
    for (m, member) in members.iter().enumerate() {
        all.extend(member.parameters.iter().enumerate().map(|(i, &t)| (t, m, i)));
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    // Ends meet whatever lies within MERGE of them: the first vertices are one slot, the last ones another.
    let mut slots: Vec<std::ops::Range<usize>> = Vec::new();
    let mut taken = vec![usize::MAX; members.len()];
    for (k, &(t, m, _)) in all.iter().enumerate() {
        match slots.last_mut() {
            Some(slot) if t - all[slot.start].0 <= MERGE && taken[m] != slot_id(slot) => slot.end = k + 1,
            _ => slots.push(k..k + 1),
        }
        taken[m] = slots.last().map_or(usize::MAX, slot_id);
    }
    let count = slots.len();
    let mean = |slot: &std::ops::Range<usize>| all[slot.clone()].iter().map(|v| v.0).sum::<f64>() / slot.len() as f64;
    let parameters: Vec<f64> = slots.iter().map(mean).collect();
    let (mut points, mut radii) =
        (Vec::with_capacity(count * members.len()), Vec::with_capacity(count * members.len()));
    for (m, member) in members.iter().enumerate() {
        let last = member.parameters.len() - 1;
        // The member's last vertex at or before the slot.
        let mut at = 0;
        for (slot, &t) in slots.iter().zip(&parameters) {
            let own = all[slot.clone()].iter().find(|v| v.1 == m);
            if let Some(&(_, _, vertex)) = own {
                at = vertex;
                points.push(member.points[vertex]);
                radii.push(member.radii[vertex]);
                continue;
            }
            let next = (at + 1).min(last);
            let span = member.parameters[next] - member.parameters[at];
            let f = if span > 0.0 { ((t - member.parameters[at]) / span).clamp(0.0, 1.0) as f32 } else { 0.0 };
            points.push(member.points[at].lerp(member.points[next], f));
            radii.push(member.radii[at] + (member.radii[next] - member.radii[at]) * f);
        }
    }
    Slots { parameters, points, radii }
}

/// A slot is known by where it starts.
fn slot_id(slot: &std::ops::Range<usize>) -> usize {
    slot.start
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(parameters: &[f64]) -> (Vec<Vec3>, Vec<f32>) {
        (parameters.iter().map(|&t| Vec3::Y * t as f32).collect(), parameters.iter().map(|&t| 1.0 - t as f32).collect())
    }

    #[test]
    fn the_union_keeps_every_vertex_and_interpolates_between() {
        let (a, b) = ([0.0, 0.5, 1.0], [0.0, 0.25, 0.500_05, 0.9, 1.0]);
        let ((pa, ra), (pb, rb)) = (line(&a), line(&b));
        let members = [
            Polyline { parameters: &a, points: &pa, radii: &ra },
            Polyline { parameters: &b, points: &pb, radii: &rb },
        ];
        let Slots { parameters, points, radii } = resample(&members);
        assert_eq!(parameters.len(), 5);
        let heights: Vec<f32> = points.iter().map(|p| p.y).collect();
        assert_eq!(heights[..5], [0.0, 0.25, 0.5, 0.9, 1.0]);
        assert_eq!(heights[5..], [0.0, 0.25, 0.500_05, 0.9, 1.0]);
        assert!(radii.iter().zip(&heights).all(|(r, h)| (r + h - 1.0).abs() < 1e-6));
    }

    #[test]
    fn vertices_of_one_member_are_never_merged() {
        let a = [0.0, 0.0, 0.3, 0.300_01, 1.0];
        let b = [0.0, 1.0];
        let ((pa, ra), (pb, rb)) = (line(&a), line(&b));
        let members = [
            Polyline { parameters: &a, points: &pa, radii: &ra },
            Polyline { parameters: &b, points: &pb, radii: &rb },
        ];
        let Slots { parameters, points, .. } = resample(&members);
        assert_eq!(parameters.len(), 5);
        assert_eq!(points[..5], pa[..]);
        assert_eq!(points[9], Vec3::Y);
    }
}
