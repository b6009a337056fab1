//! Limbs: axes found in pieces of surface, which nobody has told what grows from what.
//!
//! A limb is a tree in the sense of graphs. Here each gets its base, becomes pieces as a structure model's rows do, and
//! takes the same way from there: `connect` finds the wood that it grows from, `trace` the place on its axis.
//!
//! Joined, no place is much wider than all beside it (`calm`).
//!
//! The base of a limb is one of its thickest ends: of those the one that touches other wood or the ground, of several
//! that do the thickest, of those alike the one on the thickest wood. The limb with the most wood stands on its thickest
//! end near the ground; where it is thicker above that end, the end is a root, and the base is where the roots meet.

use glam::{DVec3, Vec3};

use super::connect;
use super::mend;
use super::nearest::Nearest;
use super::piece::{Piece, Shape};
use super::trace::Node;
use super::{trace, upright};
use crate::base::counted;
use crate::plant::Plant;
use crate::preset::plan::{ImportHeight, UpAxis};

/// The share of the thickest end's radius from which an end may be the base.
const THICK: f64 = 0.6;
/// Up to which ratio two radii count as alike.
const ALIKE: f64 = 1.15;
/// Most ends that are weighed.
const MOST_ENDS: usize = 64;
/// The share of the greatest radius near the ground below which the lowest end of a trunk is a root.
const ROOT: f64 = 0.55;
/// The share of the height below which an end of the main limb is its foot.
const FOOT: f64 = 0.15;
/// How much of the height is near the ground.
const NEAR_GROUND: f64 = 0.25;

/// A place on an axis, in the file's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::source) struct LimbNode {
    pub(in crate::source) position: DVec3,
    pub(in crate::source) radius: f64,
}

/// A tree of nodes without a root.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::source) struct Limb {
    pub(in crate::source) nodes: Vec<LimbNode>,
    pub(in crate::source) edges: Vec<[u32; 2]>,
}

impl Limb {
    /// One axis.
    pub(in crate::source) fn path(nodes: &[(DVec3, f64)]) -> Self {
        Self {
            nodes: nodes.iter().map(|&(position, radius)| LimbNode { position, radius }).collect(),
            edges: (1..nodes.len() as u32).map(|i| [i - 1, i]).collect(),
        }
    }

    /// The neighbours of each node.
    pub(in crate::source) fn links(&self) -> Vec<Vec<u32>> {
        let mut links = vec![Vec::new(); self.nodes.len()];
        for &[a, b] in &self.edges {
            links[a as usize].push(b);
            links[b as usize].push(a);
        }
        links
    }

    /// Nodes in an order with parents first when `root` is the base, each with its parent's place in that order.
    fn rooted(&self, root: u32) -> Vec<(LimbNode, Option<u32>)> {
        let links = self.links();
        let mut seen = vec![false; self.nodes.len()];
        let mut order: Vec<(u32, Option<u32>)> = vec![(root, None)];
        seen[root as usize] = true;
        let mut next = 0;
        while next < order.len() {
            for &n in &links[order[next].0 as usize] {
                if !std::mem::replace(&mut seen[n as usize], true) {
                    order.push((n, Some(next as u32)));
                }
            }
            next += 1;
        }
        order.into_iter().map(|(n, parent)| (self.nodes[n as usize], parent)).collect()
    }

    fn length(&self, [a, b]: [u32; 2]) -> f64 {
        self.nodes[a as usize].position.distance(self.nodes[b as usize].position)
    }

    /// Radius squared times length, summed.
    pub(in crate::source) fn wood(&self) -> f64 {
        let square = |v: u32| self.nodes[v as usize].radius * self.nodes[v as usize].radius;
        self.edges.iter().map(|&e| (square(e[0]) + square(e[1])) * 0.5 * self.length(e)).sum()
    }
}

/// Limbs made one plant.
#[derive(Debug)]
pub(in crate::source) struct Tree {
    pub(in crate::source) plant: Plant,
    /// Which of the file's axes points up: `Y` or `Z`.
    pub(in crate::source) up: UpAxis,
    /// What was added to places, in the file's unit, once upright.
    pub(in crate::source) shift: DVec3,
    /// What they were multiplied with then.
    pub(in crate::source) factor: f64,
}

/// Roots every limb and joins all into one plant; what was bridged or dropped goes to `notes`. `up` may be `Detect`.
///
/// # Errors
///
/// When there is no limb with a length, or nothing rises above the base.
///
/// `height` is that of the box around the whole tree, as `SkeletonParams` has both.
pub(in crate::source) fn join(
    mut limbs: Vec<Limb>,
    up: UpAxis,
    (height, around): (ImportHeight, Option<[Vec3; 2]>),
    notes: &mut Vec<String>,
) -> Result<Tree, String> {
    limbs.retain(|limb| limb.edges.iter().any(|&e| limb.length(e) > 0.0));
    if limbs.is_empty() {
        return Err("the wood has no axis with any length".into());
    }
    let up = stand(&mut limbs, up, notes);
    // No wood is without any thickness.
    let thickest = limbs.iter().flat_map(|l| &l.nodes).fold(0.0_f64, |r, n| r.max(n.radius));
    limbs.iter_mut().flat_map(|l| &mut l.nodes).for_each(|n| n.radius = n.radius.max(thickest * 1e-4));
    let roots = bases(&limbs, notes);
    let mut pieces: Vec<Piece> = Vec::new();
    for (limb, root) in limbs.iter().zip(roots) {
        let first = pieces.len() as u32;
        let nodes = limb.rooted(root);
        for &(node, parent) in &nodes {
            let start = parent.map_or(node.position, |p| nodes[p as usize].0.position);
            let piece = Piece::stretch(start, node.position, node.radius);
            pieces.push(Piece { id: pieces.len() as i64, parent: parent.map(|p| first + p), ..piece });
        }
    }
    let order = mend::order(&pieces, &mend::roots(&pieces));
    let before = pieces[0].start;
    let (order, joined) = connect::connect(&mut pieces, order, Shape::Nodes);
    let shift = pieces[0].start - before;
    let (mut nodes, gaps) = trace::trace(&pieces, &order, Shape::Nodes);
    calm(&mut nodes);
    // Crowns and fronds rise above the wood.
    let top = around.into_iter().flatten().map(|corner| f64::from(if up == UpAxis::Z { corner.z } else { corner.y }));
    let top = top.fold(0.0, |top: f64, y| top.max(y + shift.y));
    let factor = upright::scale(&mut nodes, height, top, notes)?;
    joined.note_of_limbs(limbs.len(), factor, notes);
    gaps.note(factor, notes);
    let plant = upright::skeleton(&nodes).into_plant().map_err(|error| format!("the wood makes no plant: {error}"))?;
    Ok(Tree { plant, up, shift, factor })
}

/// How much wider than all beside it a node may be before it is what two pieces of wood have at their joint.
const SWOLLEN: f64 = 2.0;

/// Gives nodes between others that are much wider than all of these the radius of the widest: the open base of a piece is as wide as
/// its collar, which stood on thin limbs as a plate.
fn calm(nodes: &mut [Node]) {
    let mut beside = vec![(0.0_f64, 0_u32); nodes.len()];
    let mut meet = |at: usize, other: usize| {
        beside[at].0 = beside[at].0.max(nodes[other].radius);
        beside[at].1 += 1;
    };
    for (i, node) in nodes.iter().enumerate() {
        if let Some(parent) = node.parent {
            meet(i, parent as usize);
            meet(parent as usize, i);
        }
    }
    for (node, (most, count)) in nodes.iter_mut().zip(beside) {
        // A trunk may well be wider at its foot, and a limb at its end.
        if count > 1 && node.parent.is_some() && node.radius > most * SWOLLEN {
            node.radius = most;
        }
    }
}

/// Turns all limbs so that Y points up. In doubt, it is the axis along which the most wood runs.
fn stand(limbs: &mut [Limb], up: UpAxis, notes: &mut Vec<String>) -> UpAxis {
    let up = match up {
        UpAxis::Detect => {
            let thickest = limbs.iter().flat_map(|l| &l.nodes).fold(f64::MIN_POSITIVE, |r, n| r.max(n.radius));
            let mut sum = DVec3::ZERO;
            for limb in &*limbs {
                for &[a, b] in &limb.edges {
                    let (a, b) = (limb.nodes[a as usize], limb.nodes[b as usize]);
                    let thick = (a.radius + b.radius) * 0.5 / thickest;
                    sum += (b.position - a.position).abs() * (thick * thick);
                }
            }
            if sum.y.max(sum.z) < sum.y.min(sum.z) * 1.2 {
                notes.push("which axis points up is a guess; say so in the preset if the tree lies".into());
            }
            if sum.y > sum.z { UpAxis::Y } else { UpAxis::Z }
        }
        given => given,
    };
    if up == UpAxis::Z {
        for node in limbs.iter_mut().flat_map(|l| &mut l.nodes) {
            let p = node.position;
            node.position = DVec3::new(p.x, p.z, -p.y);
        }
    }
    up
}

/// The base of each limb.
fn bases(limbs: &[Limb], notes: &mut Vec<String>) -> Vec<u32> {
    let mut pieces = Vec::new();
    let mut owner: Vec<u32> = Vec::new();
    for (l, limb) in limbs.iter().enumerate() {
        for &[a, b] in &limb.edges {
            let (a, b) = (limb.nodes[a as usize], limb.nodes[b as usize]);
            pieces.push(Piece::stretch(a.position, b.position, (a.radius + b.radius) * 0.5));
            owner.push(l as u32);
        }
    }
    let nearest = Nearest::new(&pieces);
    let nodes = || limbs.iter().flat_map(|l| &l.nodes);
    let ground = nodes().fold(f64::INFINITY, |y, n| y.min(n.position.y));
    let height = nodes().fold(f64::NEG_INFINITY, |y, n| y.max(n.position.y)) - ground;
    let most = (0..limbs.len()).max_by(|&a, &b| limbs[a].wood().total_cmp(&limbs[b].wood()).then(b.cmp(&a)));
    let mut roots = 0;
    let mut found = Vec::with_capacity(limbs.len());
    for (l, limb) in limbs.iter().enumerate() {
        let links = limb.links();
        let mut ends: Vec<u32> = (0..links.len() as u32).filter(|&v| links[v as usize].len() == 1).collect();
        let at = |v: u32| limb.nodes[v as usize];
        ends.sort_by(|&a, &b| at(b).radius.total_cmp(&at(a).radius).then(a.cmp(&b)));
        ends.truncate(MOST_ENDS);
        let thickest = ends.first().map_or(0.0, |&v| at(v).radius);
        // How far an end is from what could bear it, other wood of its own thickness or the ground, and how thick that is.
        let bearer = |v: u32| {
            let node = at(v);
            let other = nearest.find(node.position, 0.0, |i| {
                let piece = &pieces[i as usize];
                (owner[i as usize] != l as u32 && piece.radius >= node.radius * 0.7)
                    .then(|| (piece.distance(node.position) - piece.radius).max(0.0))
            });
            let low = node.position.y - ground;
            let wood = other.map_or((f64::INFINITY, 0.0), |o| (o.1, pieces[o.0 as usize].radius));
            let (gap, thick) = if low < wood.0 { (low, f64::INFINITY) } else { wood };
            (if gap <= node.radius.max(height * 0.005) { 0.0 } else { gap }, thick)
        };
        // The first of two ends unless the second is evidently better: radii of two ends are never just equal.
        let better = |a: (u32, (f64, f64)), b: (u32, (f64, f64))| {
            let thicker = |x: f64, y: f64| x > y * ALIKE;
            let ((v, (v_gap, v_bears)), (w, (w_gap, w_bears))) = (a, b);
            let second = if v_gap > 0.0 || w_gap > 0.0 {
                w_gap < v_gap
            } else if thicker(at(w).radius, at(v).radius) || thicker(at(v).radius, at(w).radius) {
                at(w).radius > at(v).radius
            } else if thicker(w_bears, v_bears) || thicker(v_bears, w_bears) {
                w_bears > v_bears
            } else {
                at(w).position.y < at(v).position.y
            };
            if second { b } else { a }
        };
        let thick = ends.iter().copied().filter(|&v| at(v).radius >= thickest * THICK);
        let mut base = thick.map(|v| (v, bearer(v))).reduce(better).map_or(0, |b| b.0);
        if Some(l) == most {
            let near_ground = |share: f64| ground + height * share;
            let ends = (0..links.len() as u32).filter(|&v| links[v as usize].len() == 1);
            let lower = |a: u32, b: u32| {
                let thicker = at(b).radius > at(a).radius * 1.25;
                let lower = at(b).radius > at(a).radius * 0.8 && at(b).position.y < at(a).position.y;
                if thicker || lower { b } else { a }
            };
            let foot = ends.filter(|&v| at(v).position.y <= near_ground(FOOT)).reduce(lower);
            base = foot.unwrap_or(base);
            let low = (0..links.len() as u32).filter(|&v| at(v).position.y <= near_ground(NEAR_GROUND));
            let widest = low.reduce(|a, b| if at(b).radius > at(a).radius { b } else { a });
            if let Some(widest) =
                widest.filter(|&w| at(base).radius < at(w).radius * ROOT && links[w as usize].len() > 2)
            {
                base = widest;
                roots += links[widest as usize].iter().filter(|&&n| at(n).position.y < at(widest).position.y).count();
            }
        }
        found.push(base);
    }
    if roots > 0 {
        notes.push(format!("{} below the base of the trunk", counted(roots, "root", "roots")));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_is_no_wider_than_all_beside_it_and_feet_and_ends_may_be() {
        let radii = |radii: [f64; 5]| {
            let mut nodes: Vec<Node> = (0_u32..)
                .zip(radii)
                .map(|(i, radius)| Node { position: DVec3::Y * f64::from(i), radius, parent: i.checked_sub(1) })
                .collect();
            calm(&mut nodes);
            nodes.into_iter().map(|node| node.radius).collect::<Vec<_>>()
        };
        assert_eq!(radii([0.5, 0.04, 0.2, 0.03, 0.02]), [0.5, 0.04, 0.04, 0.03, 0.02]);
        let kept = [0.5, 0.04, 0.07, 0.03, 0.2];
        assert_eq!(radii(kept), kept);
    }
}
