//! Gravelius order: from a bare skeleton of nodes to chains.
//!
//! Where several segments leave a node, the one with the smallest branching angle carries on its parent's chain and the
//! others start chains of the next order (2017 TVCG, 4.1). Two things keep the rule stable on real data. The angle is
//! taken over a span of a few radii, since single segments of a scan or of a graph point anywhere. And a segment whose
//! radius is below [`CONTENDER`] of the thickest sibling's cannot carry on the chain, however straight it happens to
//! leave: otherwise an aligned twig takes the trunk's name.

use glam::Vec3;

use super::curve::{Curve, frame_at};
use super::{ChainId, Plant, PlantBuilder, PlantError};
use crate::base::{Frame, math};

/// The share of the thickest sibling's radius below which a segment does not carry on its parent's chain.
const CONTENDER: f32 = 0.6;

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
        // Heaviest way up from each node, to take a direction over a span that crosses forks.
        let mut heavy: Vec<Option<u32>> = vec![None; count];
        for i in (0..count).rev() {
            heavy[i] = children[i]
                .iter()
                .copied()
                .max_by(|&a, &b| nodes[a as usize].radius.total_cmp(&nodes[b as usize].radius).then(b.cmp(&a)));
        }

        let mut builder = PlantBuilder::new();
        // (first node of the chain after its base, base node, parent chain, location, frame of the base)
        let mut work: Vec<(Vec<u32>, Option<(ChainId, f32, Frame)>)> = Vec::new();
        for &root in roots.iter().rev() {
            if !children[root as usize].is_empty() {
                work.push((vec![root], None));
            }
        }
        while let Some((start, attach)) = work.pop() {
            let mut path = start;
            while let Some(next) = carry_on(&nodes, &children, &heavy, &path) {
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
            let frames = curve.frames(frame);
            let parameters = curve.parameters();
            for (k, &node) in path.iter().enumerate().rev() {
                let on_path = path.get(k + 1).copied();
                // A branch's base belongs to its parent's chain, which lists what else leaves there.
                if k == 0 && attach.is_some() {
                    continue;
                }
                for &child in children[node as usize].iter().rev() {
                    if Some(child) != on_path {
                        let location = (parameters[k] as f32).clamp(0.0, 1.0);
                        work.push((vec![node, child], Some((id, location, frame_at(&frames, location)))));
                    }
                }
            }
        }
        builder.finish()
    }
}

/// The child that carries on the chain whose nodes so far are `path`.
fn carry_on(nodes: &[SkeletonNode], children: &[Vec<u32>], heavy: &[Option<u32>], path: &[u32]) -> Option<u32> {
    let here = path[path.len() - 1] as usize;
    let options = &children[here];
    if options.len() <= 1 {
        return options.first().copied();
    }
    let position = nodes[here].position;
    let thickest = options.iter().fold(0.0_f32, |r, &c| r.max(nodes[c as usize].radius));
    let span = (nodes[here].radius * 3.0).max(1e-6);
    let back = path.iter().rev().map(|&n| nodes[n as usize].position).find(|p| p.distance(position) >= span);
    let incoming = match back.or_else(|| path.first().map(|&n| nodes[n as usize].position)) {
        Some(p) if p != position => (position - p).normalize_or(Vec3::Y),
        _ => Vec3::Y,
    };
    let angle = |child: u32| {
        let mut node = child;
        while nodes[node as usize].position.distance(position) < span {
            match heavy[node as usize] {
                Some(next) => node = next,
                None => break,
            }
        }
        math::angle(incoming, nodes[node as usize].position - position)
    };
    options
        .iter()
        .copied()
        .filter(|&c| nodes[c as usize].radius >= thickest * CONTENDER)
        .map(|c| (angle(c), c))
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        .map(|(_, c)| c)
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
        let doubled =
            Skeleton { nodes: vec![node(0.0, 0.0, 0.1, None), node(0.0, 0.0, 0.2, Some(0)), node(0.0, 1.0, 0.1, Some(1))] };
        assert_eq!(doubled.into_plant().unwrap().points(ChainId(0)).len(), 2);
        assert!(Skeleton { nodes: vec![node(0.0, f32::NAN, 0.1, None)] }.into_plant().is_err());
        assert!(Skeleton::default().into_plant().is_err());
    }
}
