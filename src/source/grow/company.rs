//! Plants in company: who shares a graph with whom, and what those that come later find taken.
//!
//! A graph is as fine as its first plant wants it. One a tenth as high would find a thousandth of its nodes there, and one that
//! stands far off needs none of them. So plants share a graph where their cylinders meet and the lowest is at least half as high as
//! the highest ([`ALIKE`]); the others have graphs of their own. The highest grow first, and what lies near their wood is
//! taken: crowns of trees leave a shrub the room below and between them.

use glam::{Vec2, Vec3};

use super::space::Space;
use crate::plant::Plant;
use crate::preset::plan::{Company, Endpoints, GrowParams, Volume};

/// How many times lower than the highest a plant may be to share its graph.
const ALIKE: f32 = 2.0;
/// How many plants without room are named.
const TOLD: usize = 8;

/// One plant of several, by number from 0.
pub(super) fn member(params: &GrowParams, i: usize) -> &GrowParams {
    i.checked_sub(1).and_then(|i| params.space.beside.get(i)).map_or(params, |beside| &beside.params)
}

/// Where it stands, metres from the first.
pub(super) fn stands(params: &GrowParams, i: usize) -> [f32; 2] {
    i.checked_sub(1).and_then(|i| params.space.beside.get(i)).map_or([0.0; 2], |beside| beside.at)
}

/// The plant that stands nearest to one of several, and how far away; none where it stands alone.
pub(super) fn nearest(params: &GrowParams, i: usize) -> Option<(usize, f32)> {
    let away = |j: usize| Vec2::from(stands(params, i)).distance(Vec2::from(stands(params, j)));
    let others = (0..=params.space.beside.len()).filter(|j| *j != i).map(|j| (j, away(j)));
    others.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Which plants share a graph, in the order in which they grow: the highest first, and in a group the lowest number first. `tops` says how
/// high each reaches in a region of height 1.
pub(super) fn groups(params: &GrowParams, tops: &[f32]) -> Vec<Vec<usize>> {
    let heights: Vec<f32> = tops.iter().enumerate().map(|(i, top)| member(params, i).height / top).collect();
    let meet = |&i: &usize, &j: &usize| {
        let radius = |i: usize| member(params, i).width * 0.5 * heights[i];
        Vec2::from(stands(params, i)).distance(Vec2::from(stands(params, j))) < radius(i) + radius(j)
    };
    let mut left: Vec<usize> = (0..heights.len()).collect();
    left.sort_by(|&i, &j| heights[j].total_cmp(&heights[i]).then(i.cmp(&j)));
    let mut groups = Vec::new();
    while let Some(&highest) = left.first() {
        let alike = |&i: &usize| heights[i] * ALIKE >= heights[highest];
        let mut group = vec![highest];
        let mut next = 0;
        while let Some(&of) = group.get(next) {
            let found: Vec<usize> =
                left.iter().copied().filter(|i| alike(i) && !group.contains(i) && meet(&of, i)).collect();
            group.extend(found);
            next += 1;
        }
        left.retain(|i| !group.contains(i));
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// A plant that has grown.
pub(super) struct Grown {
    pub(super) plant: Plant,
    /// About how long the edges of its graph are, metres.
    pub(super) hop: f32,
}

/// Which nodes lie within half a hop of the wood of plants that have grown, `metres` being how long the space's unit is.
pub(super) fn taken<'g>(space: &Space, metres: f32, grown: impl Iterator<Item = &'g Grown>) -> Vec<bool> {
    let nodes = &space.nodes;
    let mut taken = vec![false; nodes.len()];
    let lattice = &nodes.grid.lattice;
    let (low, high) = (lattice.low, lattice.low + Vec3::from(lattice.size.map(|n| n as f32)) * lattice.edge);
    for Grown { plant, hop } in grown {
        let posed = plant.pose();
        for id in plant.chain_ids() {
            let (points, radii) = (posed.chain(plant, id), plant.radii(id));
            for (ends, thick) in points.windows(2).zip(radii.windows(2)) {
                // No finer than the space, whose edges lead past what lies between its nodes.
                let reach = (hop * 0.5 / metres).max(thick[0].max(thick[1]) / metres + nodes.hop() * 0.5);
                let [a, b] = [ends[0] / metres, ends[1] / metres];
                if a.max(b).cmplt(low - reach).any() || a.min(b).cmpgt(high + reach).any() {
                    continue;
                }
                let steps = (a.distance(b) / reach * 2.0).ceil().clamp(1.0, 1e4) as u32;
                for step in 0..=steps {
                    let at = a.lerp(b, step as f32 / steps as f32);
                    let [from, to] = [lattice.cell(at - reach), lattice.cell(at + reach)];
                    for y in from[1]..=to[1] {
                        for z in from[2]..=to[2] {
                            for node in nodes.grid.row([from[0], to[0]], y, z) {
                                taken[node as usize] |= nodes.at(node).distance_squared(at) <= reach * reach;
                            }
                        }
                    }
                }
            }
        }
    }
    taken
}

/// Which plants found no room, by number from 0 and in order, and what helps; `hop` is how long the edges of their graph are, metres.
/// They are left out for it, but for a first one that others only stand beside.
pub(super) fn crowded(params: &GrowParams, stunted: &[usize], hop: f32) -> String {
    let (many, all) = (stunted.len(), params.space.beside.len() + 1);
    let one = |&number: &usize| {
        let [x, z] = stands(params, number);
        let from = nearest(params, number);
        let from = from.map_or_else(String::new, |(other, away)| format!(", {away:.2} m from number {}", other + 1));
        format!("number {} of {:.1} m at ({x}, {z}){from}", number + 1, member(params, number).height)
    };
    let told: Vec<String> = stunted.iter().take(TOLD).map(one).collect();
    let more = if many > TOLD { format!("; and {} more", many - TOLD) } else { String::new() };
    let stays = params.space.company != Company::Kept && stunted.contains(&0);
    let gone = match (stays, many) {
        (true, 1) => "",
        (true, _) => " and all but number 1 are left out",
        (false, 1) => " and is left out",
        (false, _) => " and are left out",
    };
    let leans = stunted.iter().any(|&number| leans(member(params, number)));
    let lower = if leans { ", lower the `out` of the point at which their trunks end" } else { "" };
    format!(
        "{many} of {all} plants found no room to grow{gone}: {}{more}; the ways that wood may take are {hop:.2} m apart: move \
         them farther apart or away from obstacles{lower}, or raise their species' `nodes`, which brings ways closer together",
        told.join("; ")
    )
}

/// Whether a trunk ends at a point beside its foot, which may be another's ground.
fn leans(params: &GrowParams) -> bool {
    let first = params.iterations.first().map(|iteration| &iteration.endpoints);
    matches!(first, Some(Endpoints::Volume { shape: Volume::Point { out, .. }, .. }) if *out > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::plan::Beside;

    fn stand(plants: &[(f32, f32)]) -> GrowParams {
        let of = |height: f32| GrowParams { height, width: 1.0, ..super::super::tests::small() };
        let mut params = of(plants[0].1);
        params.space.beside =
            plants[1..].iter().map(|&(x, height)| Beside { params: of(height), at: [x, 0.0] }).collect();
        params
    }

    #[test]
    fn plants_without_room_are_told_as_left_out_but_for_the_first() {
        let told = |stunted: &[usize]| crowded(&stand(&[(0.0, 10.0), (1.0, 10.0), (2.0, 10.0)]), stunted, 0.5);
        assert!(
            told(&[1]).contains("1 of 3 plants found no room to grow and is left out: number 2 of"),
            "{}",
            told(&[1])
        );
        assert!(told(&[0]).contains("grow: number 1 of") && !told(&[0]).contains("`out`"));
        // Of a stand none is the first.
        let mut kept = stand(&[(0.0, 10.0), (1.0, 10.0), (2.0, 10.0)]);
        kept.space.company = Company::Kept;
        let shape = Volume::Point { height: 0.98, out: 0.12, turn: None };
        if let Endpoints::Volume { shape: of, .. } = &mut kept.iterations[0].endpoints {
            *of = shape.clone();
        }
        for beside in &mut kept.space.beside {
            beside.params.iterations.clone_from(&kept.iterations);
        }
        let of_stand = crowded(&kept, &[0, 2], 0.5);
        assert!(
            of_stand.contains("grow and are left out: number 1") && of_stand.contains("lower the `out`"),
            "{of_stand}"
        );
        assert!(told(&[1, 2]).contains("grow and are left out: number 2"));
        assert!(told(&[0, 2]).contains("grow and all but number 1 are left out: number 1"), "{}", told(&[0, 2]));
    }

    #[test]
    fn those_share_a_graph_that_meet_and_are_alike_in_height() {
        let groups = |plants: &[(f32, f32)]| groups(&stand(plants), &vec![1.0; plants.len()]);
        assert_eq!(groups(&[(0.0, 10.0)]), [[0]]);
        assert_eq!(groups(&[(0.0, 10.0), (9.0, 10.0), (18.0, 10.0)]), [[0, 1, 2]]);
        assert_eq!(groups(&[(0.0, 10.0), (11.0, 10.0), (1.0, 6.0)]), [vec![0, 2], vec![1]]);
        // A shrub first, under a tree that comes later.
        assert_eq!(groups(&[(0.0, 1.0), (2.0, 10.0), (0.5, 1.2)]), [vec![1], vec![0, 2]]);
        // Between a tree and a shrub: a young tree is alike to the tree, not to the shrub.
        assert_eq!(groups(&[(0.0, 10.0), (0.0, 5.0), (0.0, 2.5), (0.0, 2.0)]), [[0, 1], [2, 3]]);
    }
}
