//! The multi-scale topological tree (2017 TVCG, 4.1): for each chain ⟨chain, crown, crown ratio, branching vector,
//! location⟩, with an edge from each chain to those that leave it.
//!
//! The scale of a node is its Gravelius order. Crowns are hulls in the world, anchored at the crown base
//! (`plant/crown.rs`); branching vectors are seen from the parent's frame. 0.8 kB a chain.

use glam::Vec3;

use crate::plant::{ChainId, Crown, Curve, Plant};

/// The share of a chain's arc length over which its branching vector is taken: long enough to see past the jags of a
/// scan, short enough to be the way the chain leaves.
const DIRECTION_SPAN: f64 = 0.25;

/// A chain seen together with all that it bears.
#[derive(Clone, Debug)]
pub struct TopologyNode {
    /// The chain.
    pub chain: ChainId,
    /// Hull of the chain above its crown base and of all its substructures.
    pub crown: Crown,
    /// Crown height over chain length, both along the chain: 1 − the lowest location that bears a substructure; 1 for
    /// a chain that bears none.
    pub crown_ratio: f32,
    /// Unit vector in which the chain leaves, in the frame of its parent there (the world's for a stem).
    pub direction: Vec3,
    /// Arc-length parameter on the parent.
    pub location: f32,
}

/// All chains of a plant as [`TopologyNode`]s.
#[derive(Clone, Debug)]
pub struct TopologyTree {
    nodes: Vec<TopologyNode>,
    stems: Vec<ChainId>,
    children: Vec<Vec<ChainId>>,
}

impl TopologyTree {
    /// Describes every chain of a plant; linear in its points.
    #[must_use]
    pub fn of(plant: &Plant) -> Self {
        let crowns = Crown::of_chains(plant, &plant.pose());
        let children = plant.children();
        let nodes = plant
            .chain_ids()
            .zip(crowns)
            .map(|(id, crown)| {
                let lowest =
                    children[id.index()].iter().map(|&c| plant.chain(c).location).fold(f32::INFINITY, f32::min);
                TopologyNode {
                    chain: id,
                    crown,
                    crown_ratio: if lowest.is_finite() { 1.0 - lowest } else { 1.0 },
                    direction: branching_vector(plant.points(id)),
                    location: plant.chain(id).location,
                }
            })
            .collect();
        let stems = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_none()).collect();
        Self { nodes, stems, children }
    }

    /// The nodes, in the order of the plant's chains.
    #[must_use]
    pub fn nodes(&self) -> &[TopologyNode] {
        &self.nodes
    }

    /// One chain's node.
    #[must_use]
    pub fn node(&self, chain: ChainId) -> &TopologyNode {
        &self.nodes[chain.index()]
    }

    /// Grows a chain's crown by another hull in the same space.
    pub(super) fn widen(&mut self, chain: ChainId, hull: &Crown) {
        self.nodes[chain.index()].crown.merge(hull);
    }

    /// The nodes at the coarsest scale.
    #[must_use]
    pub fn stems(&self) -> &[ChainId] {
        &self.stems
    }

    /// What leaves a chain, in order of id.
    #[must_use]
    pub fn children(&self, chain: ChainId) -> &[ChainId] {
        &self.children[chain.index()]
    }
}

/// The unit vector in which a polyline leaves its first point; straight on (`y`) when it goes nowhere.
pub(super) fn branching_vector(points: &[Vec3]) -> Vec3 {
    let curve = Curve::new(points);
    let shortest = curve.length() * 1e-4;
    [curve.point(DIRECTION_SPAN), points[points.len() - 1]]
        .into_iter()
        .map(|p| p - points[0])
        .find(|v| v.length() > shortest)
        .map_or(Vec3::Y, |v| v.normalize_or(Vec3::Y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn a_tree_of_two_twigs_reads_as_drawn() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.1]);
        builder.branch(stem, 0.75, &[Vec3::ZERO, Vec3::X], &[0.05, 0.05]);
        builder.branch(stem, 0.25, &[Vec3::ZERO, Vec3::new(0.0, 1.0, 1.0)], &[0.05, 0.05]);
        let tree = TopologyTree::of(&builder.finish().unwrap());
        assert_eq!(tree.node(stem).crown_ratio, 0.75);
        assert_eq!(tree.node(stem).crown.anchor(), Vec3::Y);
        assert_eq!(tree.stems(), [stem]);
        assert_eq!(tree.children(stem), [ChainId(1), ChainId(2)]);
        assert_eq!(tree.node(ChainId(1)).direction, Vec3::X);
        assert_eq!(tree.node(ChainId(1)).crown_ratio, 1.0);
        assert!((tree.node(ChainId(2)).direction - Vec3::new(0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt())).length() < 1e-6);
        assert!(tree.node(stem).crown.contains(Vec3::new(0.0, 2.0, 0.9)));
    }

    #[test]
    fn a_chain_without_length_points_straight_on() {
        assert_eq!(branching_vector(&[Vec3::ZERO, Vec3::ZERO]), Vec3::Y);
        // A fold that comes back to its base within the span still shows where its tip went.
        let fold = [Vec3::ZERO, Vec3::X * 0.5, Vec3::ZERO, Vec3::Z * 3.0];
        assert_eq!(branching_vector(&fold), Vec3::Z);
    }
}
