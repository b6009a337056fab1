//! Branches to the right place on an axis, where a file names a neighbour of it.

use super::mend::children;
use super::piece::Piece;

/// Moves branches along their parent's axis, where the file tells axes, to the piece that is nearest to their start.
/// Links from one piece of an axis to the next stay, so no ring can arise. Returns each piece
/// that was moved, and where to.
pub(super) fn move_along_axes(pieces: &mut [Piece]) -> Vec<(usize, u32)> {
    const MOST_STEPS: usize = 16;
    let children = children(pieces);
    let mut moves = Vec::new();
    for (i, piece) in pieces.iter().enumerate() {
        let Some(parent) = piece.parent.filter(|&p| !piece.carries_on(&pieces[p as usize])) else { continue };
        let gap = |p: u32| pieces[p as usize].distance(piece.start) - pieces[p as usize].radius;
        let (mut at, mut least) = (parent, gap(parent));
        for _ in 0..MOST_STEPS {
            let here = &pieces[at as usize];
            let down = here.parent.filter(|&p| here.carries_on(&pieces[p as usize]));
            let up = children.get(at as usize).iter().copied().take(64).find(|&c| pieces[c as usize].carries_on(here));
            let next = [down, up].into_iter().flatten().map(|n| (gap(n), n)).min_by(|a, b| a.0.total_cmp(&b.0));
            match next {
                Some((gap, n)) if least > 0.0 && gap < least => (at, least) = (n, gap),
                _ => break,
            }
        }
        if at != parent {
            moves.push((i, at));
        }
    }
    for &(i, at) in &moves {
        pieces[i].parent = Some(at);
    }
    moves
}

/// A branch's first node often lies on its parent's axis, between two nodes, and hangs on the lower or on the upper one:
/// the way between runs inside the wood. Such a piece is made to start at the nearest place of the axis.
pub(super) fn out_of_wood(pieces: &mut [Piece], order: &[u32]) -> usize {
    let children = children(pieces);
    let mut moves = Vec::new();
    for &i in order {
        let by_radius = |a: u32, b: u32| if pieces[b as usize].radius > pieces[a as usize].radius { b } else { a };
        let Some(sibling) = children.get(i as usize).iter().copied().reduce(by_radius) else { continue };
        for &c in children.get(i as usize).iter().filter(|&&c| c != sibling) {
            let child = &pieces[c as usize];
            let held = |&other: &u32| {
                let wood = &pieces[other as usize];
                let t = wood.nearest(child.end);
                let foot = wood.start.lerp(wood.end, t);
                let within = if other == i { t > 0.0 && t < 1.0 } else { t > 0.0 };
                (within && foot.distance(child.end) < wood.radius * 0.5).then_some((c, other, foot))
            };
            if child.length() > 0.0 {
                moves.extend([sibling, i].iter().find_map(held));
            }
        }
    }
    for &(c, other, foot) in &moves {
        pieces[c as usize].parent = Some(other);
        pieces[c as usize].start = foot;
    }
    moves.len()
}
