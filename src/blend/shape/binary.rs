//! The maximal binary tree that a point is parameterized by (2018 TOG, 4.1), as far as the point uses it.
//!
//! Every node has two children: the axis goes on to one side, the branch that leaves goes to the other. Where several branches
//! leave at one place the node is split, and the new nodes are joined by virtual edges without attributes. The full tree of this
//! depth has `2^(depth + 1) - 1` nodes, nearly all of them without attributes; here are only those on the way to an edge, at
//! most two for each edge and branch.

use super::tree_point::TreePoint;

/// Which child of its parent a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// On along the axis.
    Along,
    /// Out along a branch.
    Branch,
}

/// A node and the edge that leads to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BinaryNode {
    /// Index of its parent; none for roots.
    pub parent: Option<u32>,
    /// Which child it is.
    pub side: Side,
    /// Edges from the root.
    pub depth: u32,
    /// Kin and edge of its axis; none for a virtual edge.
    pub edge: Option<(u32, u32)>,
}

/// The used part of a maximal binary tree.
#[derive(Clone, Debug)]
pub struct BinaryTree {
    nodes: Vec<BinaryNode>,
}

impl BinaryTree {
    /// The tree of a point; linear in its edges and branches.
    #[must_use]
    pub fn of(point: &TreePoint) -> Self {
        let mut nodes: Vec<BinaryNode> = Vec::new();
        // The node that each kin starts from.
        let mut starts: Vec<Option<u32>> = vec![None; point.axes.len()];
        for (k, axis) in point.axes.iter().enumerate() {
            let mut add = |parent: Option<u32>, side: Side, edge: Option<(u32, u32)>| {
                let depth = parent.map_or(0, |p: u32| nodes[p as usize].depth + 1);
                nodes.push(BinaryNode { parent, side, depth, edge });
                nodes.len() as u32 - 1
            };
            let mut at = add(starts[k], Side::Branch, Some((k as u32, 0)));
            for (g, group) in axis.groups.iter().enumerate() {
                for (i, &child) in group.iter().enumerate() {
                    if i > 0 {
                        at = add(Some(at), Side::Along, None);
                    }
                    starts[child as usize] = Some(at);
                }
                at = add(Some(at), Side::Along, Some((k as u32, g as u32 + 1)));
            }
        }
        Self { nodes }
    }

    /// Its nodes, parents first.
    #[must_use]
    pub fn nodes(&self) -> &[BinaryNode] {
        &self.nodes
    }

    /// Edges on the longest way from a root.
    #[must_use]
    pub fn depth(&self) -> u32 {
        self.nodes.iter().map(|n| n.depth).max().unwrap_or(0)
    }

    /// Where a node stands in the maximal tree: turns from the root, as runs of one kind.
    #[must_use]
    pub fn address(&self, node: u32) -> Vec<(Side, u32)> {
        let mut runs: Vec<(Side, u32)> = Vec::new();
        let mut at = Some(node);
        while let Some(held) = at.and_then(|n| self.nodes.get(n as usize)) {
            if held.parent.is_some() {
                match runs.last_mut() {
                    Some(run) if run.0 == held.side => run.1 += 1,
                    _ => runs.push((held.side, 1)),
                }
            }
            at = held.parent;
        }
        runs.reverse();
        runs
    }
}
