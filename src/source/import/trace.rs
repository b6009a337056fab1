//! From joined pieces to nodes.
//!
//! A piece that carries on its parent's axis starts where the parent ends: the node between them lies at its start. Every
//! other piece starts on its parent's axis: at the foot of its start there, or below, where its own direction, followed
//! back, meets the axis. A start outside the inner half of the parent's wood keeps a node of its own, so that what can
//! be seen of a branch is where the file has it.

use glam::DVec3;

use super::mend::children;
use super::piece::{Piece, Shape, nearest_on};
use crate::base::counted;

/// A node of the skeleton in double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) position: DVec3,
    pub(super) radius: f64,
    pub(super) parent: Option<u32>,
}

/// The gaps between branches and their parents' surfaces that were bridged.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gaps {
    count: usize,
    /// File units.
    largest: f64,
}

impl Gaps {
    /// In words; `scale` makes lengths metres.
    pub(super) fn note(&self, scale: f64, notes: &mut Vec<String>) {
        if self.count > 0 {
            notes.push(format!(
                "{} between a branch and its parent bridged, the largest {:.3} m",
                counted(self.count, "gap", "gaps"),
                self.largest * scale
            ));
        }
    }
}

/// Makes the nodes, parents before children, of the pieces in `order`.
pub(super) fn trace(pieces: &[Piece], order: &[u32], shape: Shape) -> (Vec<Node>, Gaps) {
    let children = children(pieces);
    let mut nodes: Vec<Node> = Vec::with_capacity(order.len() + 1);
    let mut gaps = Gaps::default();
    // The node that each piece starts from, known once its parent is done; and whether it carries the parent's axis on.
    let mut starts: Vec<(u32, bool)> = vec![(0, false); pieces.len()];
    let mut feet: Vec<(f64, u32)> = Vec::new();
    for &i in order {
        let piece = &pieces[i as usize];
        let (from, carries) = match piece.parent {
            None => {
                nodes.push(Node { position: piece.start, radius: piece.radius, parent: None });
                (nodes.len() as u32 - 1, true)
            }
            Some(parent) => {
                let (node, carries) = starts[i as usize];
                let away = nodes[node as usize].position.distance(piece.start);
                let wood = pieces[parent as usize].radius;
                if !carries && away > (0.5 * wood).max(piece.radius) {
                    if away - wood > piece.radius {
                        gaps.count += 1;
                        gaps.largest = gaps.largest.max(away - wood);
                    }
                    nodes.push(Node { position: piece.start, radius: piece.radius, parent: Some(node) });
                    (nodes.len() as u32 - 1, true)
                } else {
                    (node, carries)
                }
            }
        };
        let on = continuation(pieces, piece, children.get(i as usize));
        let base = nodes[from as usize].position;
        let tip = on.map_or(piece.end, |c| pieces[c as usize].start);
        let first = if carries { nodes[from as usize].radius } else { piece.radius };
        let last = match (shape, on) {
            (Shape::Cylinders, Some(c)) => (piece.radius + pieces[c as usize].radius) * 0.5,
            _ => piece.radius,
        };
        let length = base.distance(tip);
        feet.clear();
        for &c in children.get(i as usize) {
            let t = if Some(c) == on { 1.0 } else { foot(&pieces[c as usize], piece, base, tip, length) };
            feet.push((t, c));
        }
        feet.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (mut at, mut done) = (from, 0.0_f64);
        for &(t, c) in &feet {
            if t < 1.0 && (t - done) * length > piece.radius * 0.1 {
                nodes.push(Node { position: base.lerp(tip, t), radius: first + (last - first) * t, parent: Some(at) });
                (at, done) = (nodes.len() as u32 - 1, t);
            }
            starts[c as usize] = (at, false);
        }
        nodes.push(Node { position: tip, radius: last, parent: Some(at) });
        let end = nodes.len() as u32 - 1;
        for &(_, c) in feet.iter().rev().take_while(|&&(t, _)| t >= 1.0) {
            starts[c as usize] = (end, Some(c) == on);
        }
    }
    (nodes, gaps)
}

/// The child that carries on a piece's axis and starts where the piece ends.
fn continuation(pieces: &[Piece], piece: &Piece, children: &[u32]) -> Option<u32> {
    let told = piece.axis != Piece::NONE || piece.extension_id != Piece::NONE;
    let reach = if told { piece.radius.max(piece.length() * 0.25) } else { piece.radius * 0.5 };
    let thickest = children
        .iter()
        .copied()
        .filter(|&c| {
            let child = &pieces[c as usize];
            (!told || child.carries_on(piece)) && child.start.distance(piece.end) <= reach
        })
        .reduce(|a, b| if pieces[b as usize].radius > pieces[a as usize].radius { b } else { a })?;
    Some(thickest)
}

/// Where on the stretch from `base` to `tip` a branch starts, 0..=1.
fn foot(child: &Piece, parent: &Piece, base: DVec3, tip: DVec3, length: f64) -> f64 {
    if length <= 0.0 || child.carries_on(parent) {
        return 1.0;
    }
    let t = nearest_on(base, tip, child.start);
    let away = base.lerp(tip, t).distance(child.start);
    let along = (child.end - child.start).normalize_or_zero().dot((tip - base) / length);
    let across = (1.0 - along * along).max(0.0).sqrt();
    // Back along the branch until it meets the axis, at most as far as it is away.
    let back = if along > 0.0 { away * (along / across.max(1e-3)).min(1.0) } else { 0.0 };
    let t = (t - back / length).max(0.0);
    if (1.0 - t) * length <= parent.radius * 0.1 { 1.0 } else { t }
}
