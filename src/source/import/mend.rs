//! Parents by id, cycles, radii: what must hold before pieces can be joined.

use crate::base::{Diagnostic, Groups, Span, counted, math};

use super::piece::{Piece, Read, Shape};
use super::table::Errors;

/// Rows for each that may name a parent that doesn't exist: 5 %.
const ROWS_A_LOST_PARENT: usize = 20;

/// Finds each piece's parent. A parent below zero, or 0 where no row is called 0, marks a root.
///
/// # Errors
///
/// For each id that is there twice, and for each parent that doesn't exist if they are more than 5 % of the rows.
pub(super) fn parents(read: &mut Read, file: &str, notes: &mut Vec<String>) -> Result<(), Vec<Diagnostic>> {
    let pieces = &mut read.pieces;
    let mut ids: Vec<(i64, u32)> = pieces.iter().enumerate().map(|(i, p)| (p.id, i as u32)).collect();
    ids.sort_unstable();
    let mut errors = Errors::new(file);
    let place = |line| Some(Span::point(line, 1));
    for pair in ids.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let (first, second) = (pieces[pair[0].1 as usize].line, pieces[pair[1].1 as usize].line);
        errors.add(place(second), "id", || {
            (
                format!("the id {} is there already, in line {first}", pair[0].0),
                "each row needs an id of its own".into(),
            )
        });
    }
    let mut lost = Vec::new();
    for (i, piece) in pieces.iter_mut().enumerate() {
        let parent = piece.parent_id;
        match ids.binary_search_by_key(&parent, |&(id, _)| id) {
            Ok(at) => piece.parent = Some(ids[at].1),
            Err(_) if parent <= 0 => {}
            Err(_) => lost.push(i),
        }
    }
    if lost.len() * ROWS_A_LOST_PARENT > pieces.len() {
        for &i in &lost {
            errors.add(place(pieces[i].line), "parent", || {
                (
                    format!("no row has the id {}", pieces[i].parent_id),
                    "the file may be cut off; a few such rows would be bridged, more than 5 % are an error".into(),
                )
            });
        }
    }
    if !errors.is_empty() {
        return Err(errors.into_list());
    }
    if !lost.is_empty() {
        notes.push(format!(
            "{} with a parent that doesn't exist, the first in line {}: bridged to other wood",
            counted(lost.len(), "row", "rows"),
            pieces[lost[0]].line
        ));
    }
    if read.shape == Shape::Nodes {
        for i in 0..pieces.len() {
            if let Some(parent) = pieces[i].parent {
                pieces[i].start = pieces[parent as usize].end;
            }
        }
    }
    Ok(())
}

/// The children of all pieces, by the pieces' parents, in order of index.
pub(super) fn children(pieces: &[Piece]) -> Groups {
    Groups::of(pieces.len(), (0..).zip(pieces).filter_map(|(i, piece)| Some((piece.parent?, i))))
}

/// The pieces that can be reached from some roots, parents before children.
pub(super) fn order(pieces: &[Piece], roots: &[u32]) -> Vec<u32> {
    let children = children(pieces);
    let mut order = roots.to_vec();
    let mut next = 0;
    while next < order.len() {
        order.extend_from_slice(children.get(order[next] as usize));
        next += 1;
    }
    order
}

/// The pieces without a parent.
pub(super) fn roots(pieces: &[Piece]) -> Vec<u32> {
    (0..pieces.len() as u32).filter(|&i| pieces[i as usize].parent.is_none()).collect()
}

/// Cuts every cycle of parents at its first row, which becomes a root; returns all pieces, parents before children.
pub(super) fn cut_cycles(read: &mut Read, notes: &mut Vec<String>) -> Vec<u32> {
    let pieces = &mut read.pieces;
    let reached = order(pieces, &roots(pieces));
    if reached.len() == pieces.len() {
        return reached;
    }
    // 0: not seen; 1: leads to a root; i + 2: seen on the walk from piece i.
    let mut seen = vec![0_u32; pieces.len()];
    for i in reached {
        seen[i as usize] = 1;
    }
    let mut cut = Vec::new();
    for i in 0..pieces.len() as u32 {
        let mut at = i;
        while seen[at as usize] == 0 {
            seen[at as usize] = i + 2;
            match pieces[at as usize].parent {
                Some(parent) => at = parent,
                None => break,
            }
        }
        if seen[at as usize] != i + 2 || pieces[at as usize].parent.is_none() {
            continue;
        }
        let (mut first, mut next) = (at, pieces[at as usize].parent);
        while let Some(p) = next.filter(|&p| p != at) {
            first = first.min(p);
            next = pieces[p as usize].parent;
        }
        pieces[first as usize].parent = None;
        if read.shape == Shape::Nodes {
            pieces[first as usize].start = pieces[first as usize].end;
        }
        cut.push(pieces[first as usize].line);
    }
    notes.push(format!(
        "{} of rows that are their own ancestors cut, the first in line {}",
        counted(cut.len(), "ring", "rings"),
        cut.iter().min().copied().unwrap_or(0)
    ));
    order(pieces, &roots(pieces))
}

/// Fills in radii that are zero: the mean of the nearest ones below and above, else 0.7 of the one below, else the one
/// above; by the allometric rule where the whole file has none.
pub(super) fn radii(pieces: &mut [Piece], order: &[u32], notes: &mut Vec<String>) {
    let missing = pieces.iter().filter(|p| p.radius <= 0.0).count();
    if missing == 0 {
        return;
    }
    if missing == pieces.len() {
        let mut tips = vec![0_u32; pieces.len()];
        for &i in order.iter().rev() {
            tips[i as usize] = tips[i as usize].max(1);
            if let Some(parent) = pieces[i as usize].parent {
                tips[parent as usize] += tips[i as usize];
            }
        }
        let most = f64::from(tips.iter().copied().max().unwrap_or(1));
        let top = pieces.iter().fold(0.0_f64, |h, p| h.max(p.end.length()));
        for (piece, tips) in pieces.iter_mut().zip(tips) {
            piece.radius = top / 60.0 * math::pow64(f64::from(tips) / most, 0.4);
        }
        notes.push(
            "no row has a radius: all were set by the allometric rule, a sixtieth of the height at the base".into(),
        );
        return;
    }
    let mut above = vec![0.0_f64; pieces.len()];
    for &i in order.iter().rev() {
        let piece = pieces[i as usize];
        let own = if piece.radius > 0.0 { piece.radius } else { above[i as usize] };
        if let Some(parent) = piece.parent {
            above[parent as usize] = above[parent as usize].max(own);
        }
    }
    for &i in order {
        let i = i as usize;
        if pieces[i].radius <= 0.0 {
            let below = pieces[i].parent.map_or(0.0, |p| pieces[p as usize].radius);
            pieces[i].radius = match (below > 0.0, above[i] > 0.0) {
                (true, true) => (below + above[i]) * 0.5,
                (true, false) => below * 0.7,
                (false, _) => above[i],
            };
        }
    }
    notes.push(format!("{} without a radius: taken from the neighbours", counted(missing, "row", "rows")));
}
