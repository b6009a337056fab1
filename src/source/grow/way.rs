//! The cheapest way along one branch through the nodes around it, Dijkstra's algorithm on a few dozen nodes.
//!
//! As in the whole graph (`yao`), a node has an edge to the nearest node in each octant; and one to the next node of
//! the coarse course that the branch had, so that there always is a way. That costs [`DEAR`] times as much.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::Vec3;

use super::paths::State;

/// How far an octant looks, in discs of the nodes.
const REACH: f32 = 2.5;
/// How much more the edges of the coarse course cost.
const DEAR: f32 = 3.0;

/// A node that a branch may take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) at: Vec3,
    /// The segment of the coarse course that it is nearest to.
    pub(super) segment: u32,
}

/// A place where the branch may leave its bearer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    /// Its name.
    pub(super) index: u32,
    pub(super) at: Vec3,
    pub(super) vector: Vec3,
    /// The angle that the vector leans by on the first hop.
    pub(super) lean: f32,
}

/// A way that was found.
#[derive(Clone, Debug)]
pub(super) struct Way {
    /// The name of the entry where it begins.
    pub(super) entry: u32,
    /// Places and guiding vectors from the first node on.
    pub(super) nodes: Vec<(Vec3, Vec3)>,
}

/// What is known of a node on the way: entries first, spots after them.
struct Node {
    at: Vec3,
    segment: u32,
    /// Whether it is on the coarse course.
    own: bool,
    cost: f32,
    before: u32,
    entry: u32,
    state: State,
    done: bool,
}

/// The cheapest way from any of some entries to the last node of the coarse course. `spots` come by their segments, each
/// segment's own end before what is around it. `after` is the state that a step leads to: from a state and a place to a
/// place and spot, by how much its entry leans. Edges that are `barred` are left out where there are others.
pub(super) fn cheapest(
    entries: &[Entry],
    spots: &[Spot],
    begin: State,
    disc: f32,
    after: &dyn Fn(State, Vec3, Vec3, u32, f32) -> State,
    barred: &dyn Fn(Vec3, Vec3) -> bool,
    weight: &dyn Fn(Vec3, Vec3) -> f32,
) -> Way {
    let count = entries.len();
    let node = |at, segment, own, entry: u32, cost, vector| {
        let state = State { vector, ..begin };
        Node { at, segment, own, cost, before: u32::MAX, entry, state, done: false }
    };
    let mut nodes: Vec<Node> =
        entries.iter().enumerate().map(|(i, e)| node(e.at, 0, false, i as u32, 0.0, e.vector)).collect();
    let mut segment = u32::MAX;
    for spot in spots {
        nodes.push(node(spot.at, spot.segment, spot.segment != segment, 0, f32::INFINITY, Vec3::Y));
        segment = spot.segment;
    }
    // Where each segment's nodes begin; spots have no gaps in their segments.
    let segments = spots.last().map_or(0, |spot| spot.segment + 1) as usize;
    let mut starts = vec![nodes.len(); segments + 1];
    for i in (count..nodes.len()).rev() {
        starts[nodes[i].segment as usize] = i;
    }
    let target = starts[segments - 1];
    let mut frontier: BinaryHeap<Reverse<(u32, u32)>> = (0..count as u32).map(|i| Reverse((0, i))).collect();
    while let Some(Reverse((_, i))) = frontier.pop() {
        let here = i as usize;
        if nodes[here].done {
            continue;
        }
        nodes[here].done = true;
        if nodes[here].before != u32::MAX {
            let before = &nodes[nodes[here].before as usize];
            let lean = entries[before.entry as usize].lean;
            let (entry, state) = (before.entry, after(before.state, before.at, nodes[here].at, i, lean));
            (nodes[here].entry, nodes[here].state) = (entry, state);
        }
        if here == target {
            break;
        }
        for (to, dear) in leaving(&nodes, &starts, here, count, disc, barred) {
            let next = &nodes[to as usize];
            let weight = weight(next.at - nodes[here].at, nodes[here].state.vector) * if dear { DEAR } else { 1.0 };
            let cost = nodes[here].cost + weight;
            if !next.done && cost < next.cost {
                nodes[to as usize].cost = cost;
                nodes[to as usize].before = i;
                // Costs are never negative, so their bits have their order.
                frontier.push(Reverse((cost.to_bits(), to)));
            }
        }
    }
    let mut found = Vec::new();
    let mut at = target;
    while at >= count && nodes[at].before != u32::MAX {
        found.push((nodes[at].at, nodes[at].state.vector));
        at = nodes[at].before as usize;
    }
    found.reverse();
    Way { entry: entries[nodes[target].entry as usize].index, nodes: found }
}

/// The nodes that edges lead to from one, and whether these are dear.
fn leaving(
    nodes: &[Node],
    starts: &[usize],
    from: usize,
    entries: usize,
    disc: f32,
    barred: &dyn Fn(Vec3, Vec3) -> bool,
) -> impl Iterator<Item = (u32, bool)> + use<> {
    let Node { at, segment, own, .. } = nodes[from];
    let segments = starts.len() - 1;
    let segment = segment as usize;
    let near = starts[segment.saturating_sub(2)]..starts[(segment + 3).min(segments)];
    let mut best = [(REACH * disc * REACH * disc, u32::MAX); 8];
    for to in near {
        let d = nodes[to].at - at;
        let octant = usize::from(d.x < 0.0) | usize::from(d.y < 0.0) << 1 | usize::from(d.z < 0.0) << 2;
        let square = d.length_squared();
        if to != from && square < best[octant].0 {
            best[octant] = (square, to as u32);
        }
    }
    for (_, to) in &mut best {
        if *to != u32::MAX && barred(at, nodes[*to as usize].at) {
            *to = u32::MAX;
        }
    }
    // From an entry to the first node of the course, from there to the next.
    let next = match (from < entries, own) {
        (true, _) => Some(starts[0]),
        (false, true) if segment + 1 < segments => Some(starts[segment + 1]),
        _ => None,
    };
    let edges = best.into_iter().filter(|b| b.1 != u32::MAX).map(|(_, to)| (to, false));
    edges.chain(next.map(|to| (to as u32, true)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    const UPRIGHT: State = State { source: 0, hops: 0.0, vector: Vec3::Y };

    fn found(spots: &[Spot], entries: &[Entry], barred: &dyn Fn(Vec3, Vec3) -> bool) -> Way {
        let after = |state: State, _: Vec3, _: Vec3, _: u32, _: f32| state;
        cheapest(entries, spots, UPRIGHT, 0.5, &after, barred, &|edge, v| edge.length() * 1.2 - edge.dot(v))
    }

    fn entry(index: u32, at: Vec3) -> Entry {
        Entry { index, at, vector: Vec3::Y, lean: 0.0 }
    }

    /// Two segments upwards, each with its end and some nodes around it.
    fn spots() -> Vec<Spot> {
        (0..2_u32)
            .flat_map(|segment| {
                let y = segment as f32;
                let around = (0..30).map(move |i| {
                    let seed = Seed::new(u64::from(segment)).at(i);
                    Vec3::new(seed.at(0).range(-0.4, 0.4), y + seed.at(1).unit(), seed.at(2).range(-0.4, 0.4))
                });
                std::iter::once(Vec3::new(0.3, y + 1.0, 0.0)).chain(around).map(move |at| Spot { at, segment })
            })
            .collect()
    }

    #[test]
    fn the_way_ends_where_it_must_and_takes_finer_edges() {
        let way = found(&spots(), &[entry(7, Vec3::ZERO)], &|_, _| false);
        assert_eq!((way.entry, way.nodes[way.nodes.len() - 1].0), (7, Vec3::new(0.3, 2.0, 0.0)));
        let mut last = Vec3::ZERO;
        for (at, _) in &way.nodes {
            assert!(at.distance(last) < REACH * 0.5);
            last = *at;
        }
        assert!(way.nodes.len() >= 4);
    }

    #[test]
    fn it_begins_at_the_entry_from_which_it_is_cheapest() {
        let entries = [entry(1, Vec3::new(-2.0, 0.0, 0.0)), entry(4, Vec3::new(0.1, 0.2, 0.0))];
        assert_eq!(found(&spots(), &entries, &|_, _| false).entry, 4);
    }

    #[test]
    fn where_nothing_else_is_it_takes_the_coarse_course() {
        let alone: Vec<Spot> =
            (0..3).map(|segment| Spot { at: Vec3::Y * (segment as f32 * 3.0 + 3.0), segment }).collect();
        let way = found(&alone, &[entry(0, Vec3::ZERO)], &|_, _| true);
        assert_eq!(way.nodes.iter().map(|n| n.0.y).collect::<Vec<_>>(), [3.0, 6.0, 9.0]);
    }
}
