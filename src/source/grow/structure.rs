//! The tree as it grows: the nodes that paths have reached so far, parents before children (2015, 3.1.4).

use glam::Vec3;

use super::guide;
use super::nodes::Nodes;
use super::paths::{PathSource, Paths};
use super::yao::NONE;
use crate::preset::plan::{Guide, GuideStart};

/// One node of the structure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    /// The graph's node.
    pub(super) node: u32,
    /// The member before it; itself at the root.
    pub(super) parent: u32,
    /// Its guiding vector, from the pass that made it.
    pub(super) vector: Vec3,
}

/// A way that was added at once: from a member that was there before to an endpoint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    /// Its first member; the others follow it.
    pub(super) first: u32,
    /// Which pass added it, from 0.
    pub(super) pass: u32,
}

/// A tree of graph nodes.
#[derive(Clone, Debug)]
pub(super) struct Structure {
    /// Parents before children; the root first.
    pub(super) members: Vec<Member>,
    /// The ways that its members were added in, in order; all members but the root belong to one.
    pub(super) runs: Vec<Run>,
    /// Passes that were taken so far.
    pub(super) passes: u32,
    /// For each graph node its place among the members.
    places: Vec<u32>,
}

impl Structure {
    /// The root alone, with an upright guiding vector.
    pub(super) fn new(nodes: &Nodes) -> Self {
        let mut places = vec![NONE; nodes.len()];
        places[nodes.root as usize] = 0;
        let root = Member { node: nodes.root, parent: 0, vector: Vec3::Y };
        Self { members: vec![root], runs: Vec::new(), passes: 0, places }
    }

    /// Of a plant that is yet to grow.
    pub(super) fn empty() -> Self {
        Self { members: Vec::new(), runs: Vec::new(), passes: 0, places: Vec::new() }
    }

    /// Whether a graph node belongs to it.
    pub(super) fn holds(&self, node: u32) -> bool {
        self.places[node as usize] != NONE
    }

    /// How high the ways of the first pass reach.
    pub(super) fn first(&self, nodes: &Nodes) -> f32 {
        let end = self.runs.iter().find(|run| run.pass > 0).map_or(self.members.len(), |run| run.first as usize);
        self.members[..end].iter().map(|m| nodes.at(m.node).y).fold(0.0, f32::max)
    }

    /// The members as the sources of a pass. Those below the clear bole bear nothing and are closed to paths; a
    /// structure that is nowhere higher starts at its top.
    pub(super) fn sources(&self, nodes: &Nodes, start: GuideStart, guide: &Guide, bole: f32) -> Vec<PathSource> {
        let top = self.members.iter().map(|m| nodes.at(m.node).y).fold(0.0, f32::max);
        let bole = bole.min(top);
        self.members
            .iter()
            .map(|m| {
                let position = nodes.at(m.node);
                let (vector, lean) = guide::start(start, guide, m.vector, position);
                PathSource { node: m.node, vector, lean, closed: position.y < bole }
            })
            .collect()
    }

    /// Adds the path to a node that was reached. Linear in what it adds: a path is followed until it meets the
    /// structure, so paths that share a way share its members.
    pub(super) fn add(&mut self, paths: &Paths, end: u32) {
        let mut way = Vec::new();
        let mut node = end;
        while !self.holds(node) {
            way.push(node);
            node = paths.before(node);
        }
        if !way.is_empty() {
            self.runs.push(Run { first: self.members.len() as u32, pass: self.passes });
        }
        let mut parent = self.places[node as usize];
        for &node in way.iter().rev() {
            let place = self.members.len() as u32;
            self.places[node as usize] = place;
            self.members.push(Member { node, parent, vector: paths.vector(node) });
            parent = place;
        }
    }
}
