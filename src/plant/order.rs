//! Gravelius order: from a bare skeleton of nodes to chains.
//!
//! Where several segments leave a node, the one with the smallest branching angle carries on its parent's chain and the
//! others start chains of the next order (2017 TVCG, 4.1). Three things keep the rule stable on real data:
//!
//! - The angle is taken over a span that grows with what is above ([`SPAN`]), since single segments of a scan or of a
//!   graph point anywhere, and a limb that bends away from the trunk often leaves it in line.
//! - A stub, whose longest way up is below [`STUB`] of its longest sibling's, can't carry on the chain, however thick:
//!   otherwise the dead knobs of a scanned branch cut it into a chain each.
//! - A segment whose radius is below [`CONTENDER`] of the thickest of the rest can't either, however straight it
//!   happens to leave; otherwise an aligned twig takes the trunk's name. Among those that can, being thinner or
//!   shorter counts as an angle ([`THIN`], [`SHORT`]).
//!
//! Measured on a digitised apple tree, the angle over three radii alone let a horizontal limb take the trunk at a third
//! of its height, and the leader passed through orders 2 to 5 on its way up.

use glam::Vec3;

use super::curve::{Curve, frame_at};
use super::{ChainId, Plant, PlantBuilder, PlantError};
use crate::base::{Frame, math};

/// The share of the thickest sibling's radius below which a segment does not carry on its parent's chain.
const CONTENDER: f32 = 0.5;
/// The share of the longest sibling's way up below which a segment is a stub.
const STUB: f32 = 0.15;
/// Span for directions, as a share of the longest way up from the fork; three radii at least.
const SPAN: f32 = 0.2;
/// Radians that a segment of half the thickest sibling's radius counts as more bent than it is.
const THIN: f32 = 0.5;
/// Radians that a segment of half the longest sibling's way up counts as more bent than it is.
const SHORT: f32 = 0.3;
/// Most nodes that one direction looks along, so that a fork costs no more than that.
const MOST_STEPS: usize = 256;

/// A node of a [`Skeleton`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkeletonNode {
    /// Metres, Y up, in the world.
    pub position: Vec3,
    /// Radius of the wood here, metres.
    pub radius: f32,
    /// Index of an earlier node; none where a stem starts.
    pub parent: Option<u32>,
}

/// A rooted forest of nodes, parents before children: what growing and importing produce.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skeleton {
    /// The nodes; every parent has a smaller index than its children.
    pub nodes: Vec<SkeletonNode>,
}

impl Skeleton {
    /// Orders the skeleton and cuts it into chains. Nodes at the place of their parent are merged into it; a stem
    /// without any length is dropped.
    ///
    /// # Errors
    ///
    /// When a number is not finite, a parent does not come before its child, or nothing with a length is left.
    pub fn into_plant(self) -> Result<Plant, PlantError> {
        let mut nodes = self.nodes;
        let count = nodes.len();
        for (i, node) in nodes.iter().enumerate() {
            let chain = ChainId(i as u32);
            if !node.position.is_finite() {
                return Err(PlantError::BadNumber { chain, what: "coordinate" });
            }
            if node.parent.is_some_and(|p| p as usize >= i) {
                return Err(PlantError::BadParent(chain));
            }
        }
        // A node on top of its parent hands its children up. Ancestors are final when a node is reached.
        let mut alias: Vec<u32> = (0..count as u32).collect();
        for i in 0..count {
            if let Some(parent) = nodes[i].parent {
                let parent = alias[parent as usize];
                nodes[i].parent = Some(parent);
                if nodes[i].position == nodes[parent as usize].position {
                    alias[i] = parent;
                    let radius = nodes[i].radius.max(nodes[parent as usize].radius);
                    nodes[parent as usize].radius = radius;
                }
            }
        }
        let mut children: Vec<Vec<u32>> = vec![Vec::new(); count];
        let mut roots = Vec::new();
        for i in 0..count as u32 {
            match nodes[i as usize].parent {
                _ if alias[i as usize] != i => {}
                Some(parent) => children[parent as usize].push(i),
                None => roots.push(i),
            }
        }
        let forks = Forks::new(&nodes, children);
        let mut builder = PlantBuilder::new();
        let mut work: Vec<Start> = Vec::new();
        for &root in roots.iter().rev() {
            if !forks.children[root as usize].is_empty() {
                work.push(Start { path: vec![root], attach: None });
            }
        }
        while let Some(Start { mut path, attach }) = work.pop() {
            while let Some(next) = forks.carry_on(&nodes, &path) {
                path.push(next);
            }
            let base = nodes[path[0] as usize].position;
            let frame = attach.map_or(Frame::WORLD, |(_, _, frame)| frame);
            let points: Vec<Vec3> = path.iter().map(|&n| frame.to_local(nodes[n as usize].position - base)).collect();
            let mut radii: Vec<f32> = path.iter().map(|&n| nodes[n as usize].radius).collect();
            let id = match attach {
                None => builder.stem(base, &points, &radii),
                Some((parent, location, _)) => {
                    // The base point is the parent's node: the branch starts with its own radius there.
                    radii[0] = radii[1];
                    builder.branch(parent, location, &points, &radii)
                }
            };
            let curve = Curve::new(&points);
            // Frames are dear, and most chains bear nothing.
            let mut frames = None;
            let parameters = curve.parameters();
            for (k, &node) in path.iter().enumerate().rev() {
                let on_path = path.get(k + 1).copied();
                // A branch's base belongs to its parent's chain, which lists what else leaves there.
                if k == 0 && attach.is_some() {
                    continue;
                }
                for &child in forks.children[node as usize].iter().rev() {
                    if Some(child) != on_path {
                        let location = (parameters[k] as f32).clamp(0.0, 1.0);
                        let frames = frames.get_or_insert_with(|| curve.frames(frame));
                        let attach = Some((id, location, frame_at(frames, location)));
                        work.push(Start { path: vec![node, child], attach });
                    }
                }
            }
        }
        builder.finish()
    }
}

/// A chain that is yet to be followed.
struct Start {
    /// Its first nodes: a root, or a node of its parent's chain and the first of its own.
    path: Vec<u32>,
    /// The parent chain, the location on it, and the frame there.
    attach: Option<(ChainId, f32, Frame)>,
}

/// What is above each node.
struct Forks {
    children: Vec<Vec<u32>>,
    /// Longest way up from a node to a tip, metres.
    reach: Vec<f32>,
    /// The thickest child, the one with the longest way up among equals: directions follow it across forks.
    heavy: Vec<Option<u32>>,
}

impl Forks {
    fn new(nodes: &[SkeletonNode], children: Vec<Vec<u32>>) -> Self {
        let mut reach = vec![0.0_f32; nodes.len()];
        let mut heavy = vec![None; nodes.len()];
        for i in (0..nodes.len()).rev() {
            for &c in &children[i] {
                let way = reach[c as usize] + nodes[c as usize].position.distance(nodes[i].position);
                reach[i] = reach[i].max(way);
            }
            heavy[i] = children[i].iter().copied().max_by(|&a, &b| {
                let key = |c: u32| (nodes[c as usize].radius, reach[c as usize]);
                let (a_key, b_key) = (key(a), key(b));
                a_key.0.total_cmp(&b_key.0).then(a_key.1.total_cmp(&b_key.1)).then(b.cmp(&a))
            });
        }
        Self { children, reach, heavy }
    }

    /// The child that carries on the chain whose nodes so far are `path`.
    fn carry_on(&self, nodes: &[SkeletonNode], path: &[u32]) -> Option<u32> {
        let here = path[path.len() - 1] as usize;
        let options = &self.children[here];
        if options.len() <= 1 {
            return options.first().copied();
        }
        let position = nodes[here].position;
        let way = |c: u32| self.reach[c as usize] + nodes[c as usize].position.distance(position);
        let longest = options.iter().fold(0.0_f32, |l, &c| l.max(way(c)));
        let grown = || options.iter().copied().filter(|&c| way(c) >= longest * STUB);
        let thickest = grown().fold(0.0_f32, |r, c| r.max(nodes[c as usize].radius));
        let span = (nodes[here].radius * 3.0).max(longest * SPAN).max(1e-6);
        let mut back = path.iter().rev().take(MOST_STEPS).map(|&n| nodes[n as usize].position);
        let from = back.clone().find(|p| p.distance(position) >= span).or_else(|| back.next_back());
        let incoming = match from {
            Some(p) if p != position => (position - p).normalize_or(Vec3::Y),
            _ => Vec3::Y,
        };
        let bend = |child: u32| {
            let mut node = child;
            for _ in 0..MOST_STEPS {
                match self.heavy[node as usize] {
                    Some(next) if nodes[node as usize].position.distance(position) < span => node = next,
                    _ => break,
                }
            }
            let radius = nodes[child as usize].radius;
            let halvings =
                |most: f32, own: f32| if own > 0.0 { math::ln(most / own) / std::f32::consts::LN_2 } else { 0.0 };
            math::angle(incoming, nodes[node as usize].position - position)
                + halvings(thickest, radius) * THIN
                + halvings(longest, way(child)) * SHORT
        };
        grown()
            .filter(|&c| nodes[c as usize].radius >= thickest * CONTENDER)
            .map(|c| (bend(c), c))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, c)| c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(x: f32, y: f32, radius: f32, parent: Option<u32>) -> SkeletonNode {
        SkeletonNode { position: Vec3::new(x, y, 0.0), radius, parent }
    }

    #[test]
    fn the_straightest_of_the_thick_carries_on() {
        let plant = Skeleton {
            nodes: vec![
                node(0.0, 0.0, 0.2, None),
                node(0.0, 1.0, 0.2, Some(0)),
                node(0.3, 2.0, 0.18, Some(1)),
                node(-2.0, 2.0, 0.19, Some(1)),
                node(0.0, 2.0, 0.01, Some(1)),
            ],
        }
        .into_plant()
        .unwrap();
        let orders: Vec<u16> = plant.chains().iter().map(|c| c.order).collect();
        assert_eq!(orders, [1, 2, 2]);
        assert_eq!(plant.points(ChainId(0)).len(), 3);
        assert_eq!(plant.points(ChainId(0))[2], Vec3::new(0.3, 2.0, 0.0));
    }

    #[test]
    fn a_thick_stub_does_not_cut_a_chain() {
        let plant = Skeleton {
            nodes: vec![
                node(0.0, 0.0, 0.02, None),
                node(0.0, 1.0, 0.02, Some(0)),
                node(0.05, 1.05, 0.02, Some(1)),
                node(0.0, 2.0, 0.005, Some(1)),
            ],
        }
        .into_plant()
        .unwrap();
        assert_eq!(plant.points(ChainId(0))[2], Vec3::new(0.0, 2.0, 0.0));
    }

    #[test]
    fn a_limb_that_leaves_in_line_and_bends_away_does_not_take_the_leaders_name() {
        let plant = Skeleton {
            nodes: vec![
                node(0.0, 0.0, 0.02, None),
                node(0.0, 1.0, 0.02, Some(0)),
                node(0.0, 1.1, 0.015, Some(1)),
                node(1.0, 1.3, 0.015, Some(2)),
                node(2.0, 1.3, 0.01, Some(3)),
                node(-0.04, 1.1, 0.015, Some(1)),
                node(0.0, 1.4, 0.015, Some(5)),
                node(0.0, 3.0, 0.01, Some(6)),
            ],
        }
        .into_plant()
        .unwrap();
        assert_eq!(plant.points(ChainId(0)).last(), Some(&Vec3::new(0.0, 3.0, 0.0)));
    }

    #[test]
    fn ordering_is_not_quadratic_where_radii_are_huge() {
        // Every direction would look along the whole plant; a fork at each node makes that quadratic.
        let mut nodes = vec![node(0.0, 0.0, 1e6, None)];
        for i in 0..20_000_u32 {
            nodes.push(node(0.0, (i + 1) as f32, 1e6, Some(if i == 0 { 0 } else { 2 * i - 1 })));
            nodes.push(node(1.0, (i + 1) as f32, 1e6, Some(if i == 0 { 0 } else { 2 * i - 1 })));
        }
        let plant = Skeleton { nodes }.into_plant().unwrap();
        assert_eq!(plant.points(ChainId(0)).len(), 20_001);
    }

    #[test]
    fn positions_survive_the_frames() {
        let mut nodes = vec![node(1.0, 0.0, 0.2, None)];
        for i in 1..200_u32 {
            let parent = (i * 7) % i;
            let p = nodes[parent as usize].position + crate::base::Seed::new(4).at(u64::from(i)).direction();
            nodes.push(SkeletonNode { position: p, radius: 0.3 / i as f32, parent: Some(parent) });
        }
        let plant = Skeleton { nodes: nodes.clone() }.into_plant().unwrap();
        let posed = plant.pose();
        for n in &nodes {
            let nearest = posed.positions().iter().map(|p| p.distance(n.position)).fold(f32::MAX, f32::min);
            assert!(nearest < 1e-4, "{nearest}");
        }
    }

    #[test]
    fn doubled_nodes_are_merged_and_bad_ones_refused() {
        let doubled = Skeleton {
            nodes: vec![node(0.0, 0.0, 0.1, None), node(0.0, 0.0, 0.2, Some(0)), node(0.0, 1.0, 0.1, Some(1))],
        };
        assert_eq!(doubled.into_plant().unwrap().points(ChainId(0)).len(), 2);
        assert!(Skeleton { nodes: vec![node(0.0, f32::NAN, 0.1, None)] }.into_plant().is_err());
        assert!(Skeleton::default().into_plant().is_err());
    }
}
