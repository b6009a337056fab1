//! The branching-pattern-aware topology tree (2017 CAVW, 4.1): nodes ⟨GC, GOL, GR, Gv, Gp⟩, which are the groups of
//! chains that leave one place together, and edges from each group to those that grow on its chains.
//!
//! The outer lobe of a chain is the hull of the leaves and wood that it bears above its crown base; that of a group is the
//! hull of its chains' lobes, measured from the mean of their crown bases. A node takes 0.9 kB, and the inner lobe of a chain
//! with leaves 0.8 kB.

use glam::Vec3;

use super::chain_traits::{ChainTraits, traits};
use super::pattern::{Pattern, groups};
use super::topology_tree::TopologyTree;
use crate::plant::{ChainId, Crown, Plant};
use crate::preset::plan::PatternParams;

/// A group of chains, seen together with all that they bear.
#[derive(Clone, Debug)]
pub struct PatternNode {
    /// GC: the chains, in order of id.
    pub chains: Vec<ChainId>,
    /// How many grow from there: the chains, and the parent's continuation where it is like them.
    pub count: usize,
    /// What they leave; none for the stems.
    pub parent: Option<ChainId>,
    /// How they stand.
    pub pattern: Pattern,
    /// Hybrid order.
    pub order: u16,
    /// GOL: the group outer lobe.
    pub lobe: Crown,
    /// GR: mean of the chains' outer lobe ratios.
    pub ratio: f32,
    /// Gv: mean branching vector, in the frame of the parent; not of unit length where the chains part.
    pub direction: Vec3,
    /// Gp: mean location on the parent.
    pub location: f32,
    /// Mean divergence between neighbours, radians.
    pub divergence: f32,
}

/// A plant as groups of chains. The first node is the stems'.
#[derive(Clone, Debug)]
pub struct PatternTree {
    topology: TopologyTree,
    traits: Vec<ChainTraits>,
    nodes: Vec<PatternNode>,
    /// The nodes that grow on each chain: `first[c]..first[c + 1]`, from base to tip.
    first: Vec<u32>,
}

impl PatternTree {
    /// Describes a plant; linear in its points and leaves but for sorts.
    #[must_use]
    pub fn of(plant: &Plant, params: &PatternParams) -> Self {
        let posed = plant.pose();
        let mut topology = TopologyTree::of(plant);
        let leaves = own_leaves(plant, &posed);
        let traits = traits(plant, &posed, &leaves);
        with_leaves(&mut topology, plant, leaves);
        let groups = groups(plant, &posed, params);
        let mut first = vec![0_u32; plant.chains().len() + 1];
        first[0] = 1;
        groups.iter().filter_map(|g| g.parent).for_each(|p| first[p.index() + 1] += 1);
        (1..first.len()).for_each(|i| first[i] += first[i - 1]);
        let nodes = groups
            .into_iter()
            .map(|group| {
                let own = || group.chains.iter().map(|&c| topology.node(c));
                let share = 1.0 / group.chains.len().max(1) as f32;
                let anchor = own().fold(Vec3::ZERO, |sum, n| sum + n.crown.anchor()) * share;
                let lobe = match group.chains[..] {
                    [one] => topology.node(one).crown.clone(),
                    _ => {
                        let mut lobe = Crown::new(anchor);
                        own().for_each(|n| lobe.merge(&n.crown));
                        lobe
                    }
                };
                let ratio = own().map(|n| n.crown_ratio).sum::<f32>() * share;
                let direction = own().fold(Vec3::ZERO, |sum, n| sum + n.direction) * share;
                PatternNode {
                    parent: group.parent,
                    count: group.count,
                    pattern: group.pattern,
                    order: group.order,
                    location: group.location,
                    divergence: group.divergence,
                    chains: group.chains,
                    lobe,
                    ratio,
                    direction,
                }
            })
            .collect();
        Self { topology, traits, nodes, first }
    }

    /// The nodes: the stems', then those on each chain, from its base to its tip.
    #[must_use]
    pub fn nodes(&self) -> &[PatternNode] {
        &self.nodes
    }

    /// The node of the stems.
    #[must_use]
    pub fn root(&self) -> &PatternNode {
        &self.nodes[0]
    }

    /// The nodes that grow on a chain, from its base to its tip.
    #[must_use]
    pub fn on(&self, chain: ChainId) -> &[PatternNode] {
        &self.nodes[self.first[chain.index()] as usize..self.first[chain.index() + 1] as usize]
    }

    /// The chains one by one.
    #[must_use]
    pub fn topology(&self) -> &TopologyTree {
        &self.topology
    }

    /// What else a chain is told by.
    pub(super) fn traits(&self, chain: ChainId) -> &ChainTraits {
        &self.traits[chain.index()]
    }
}

/// The hulls of the leaves that each chain bears itself.
fn own_leaves(plant: &Plant, posed: &crate::plant::Posed) -> Vec<Option<Crown>> {
    let mut hulls: Vec<Option<Crown>> = vec![None; plant.chains().len()];
    for leaf in plant.leaves() {
        let pose = posed.leaf(plant, leaf);
        let hull = &mut hulls[leaf.chain.index()];
        hull.get_or_insert_with(|| Crown::new(pose.position)).add(pose.position + pose.frame.y * (leaf.size * 0.5));
    }
    hulls
}

/// Widens the crowns by the leaves that each chain and its substructure bear.
fn with_leaves(topology: &mut TopologyTree, plant: &Plant, mut hulls: Vec<Option<Crown>>) {
    for id in plant.chain_ids().rev() {
        let Some(hull) = hulls[id.index()].take() else { continue };
        topology.widen(id, &hull);
        if let Some(parent) = plant.chain(id).parent {
            match &mut hulls[parent.index()] {
                Some(own) => own.merge(&hull),
                none => *none = Some(hull),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn nodes_hang_on_the_chains_that_bear_them() {
        for seed in 0..40 {
            let plant = random_plant(Seed::new(seed), 60, Oddity::Wild);
            let tree = PatternTree::of(&plant, &PatternParams::default());
            assert!(tree.root().chains.iter().all(|&c| plant.chain(c).parent.is_none()));
            let mut found = tree.root().chains.len();
            for id in plant.chain_ids() {
                for node in tree.on(id) {
                    assert!(node.parent == Some(id) && node.chains.iter().all(|&c| plant.chain(c).parent == Some(id)));
                    found += node.chains.len();
                }
                assert!(tree.on(id).windows(2).all(|pair| pair[0].location <= pair[1].location));
            }
            assert_eq!(found, plant.chains().len());
        }
    }

    #[test]
    fn outer_lobes_hold_the_leaves_below_them() {
        let plant = random_plant(Seed::new(8), 60, Oddity::Tame);
        let (posed, tree) = (plant.pose(), PatternTree::of(&plant, &PatternParams::default()));
        for leaf in plant.leaves() {
            let pose = posed.leaf(&plant, leaf);
            assert!(tree.root().lobe.depth(pose.position + pose.frame.y * (leaf.size * 0.5)) > -1e-3);
        }
    }
}
