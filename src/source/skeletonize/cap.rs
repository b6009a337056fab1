//! Open ends and holes are closed before a contraction.
//!
//! Au's method is for closed meshes: the ring of an open end has no area of its own to shrink to, and the surgery leaves
//! it as a round of edges without faces. Each border that is one simple round is closed by a zigzag between its two sides,
//! which needs no new vertex and gives none more than two new edges.

use super::surface::Surface;

/// The same vertices, with borders closed.
pub(super) fn closed(surface: &Surface) -> Surface {
    let neighbours = surface.neighbours();
    let border = |v: u32| neighbours[v as usize].iter().filter(|n| n.1 == 1).map(|n| n.0);
    let mut seen = vec![false; neighbours.len()];
    let mut closed = surface.clone();
    let mut round = Vec::new();
    for first in 0..neighbours.len() as u32 {
        if seen[first as usize] || border(first).next().is_none() {
            continue;
        }
        round.clear();
        let mut simple = true;
        let mut at = first;
        loop {
            seen[at as usize] = true;
            round.push(at);
            simple &= border(at).count() == 2;
            match border(at).find(|&n| !seen[n as usize]) {
                Some(next) => at = next,
                None => break,
            }
        }
        if !simple || round.len() < 3 || !border(at).any(|n| n == first) {
            continue;
        }
        let (mut low, mut high) = (0, round.len() - 1);
        while high - low >= 2 {
            closed.triangles.push([round[low], round[low + 1], round[high]]);
            low += 1;
            if high - low >= 2 {
                closed.triangles.push([round[low], round[high - 1], round[high]]);
                high -= 1;
            }
        }
    }
    closed
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_tube_open_at_both_ends_becomes_a_sphere() {
        for sides in [3, 4, 7, 12] {
            let surface = shapes::tube(&[DVec3::ZERO, DVec3::Y, DVec3::Y * 2.0], &[0.3; 3], sides);
            let closed = closed(&surface);
            let neighbours = closed.neighbours();
            assert!(neighbours.iter().flatten().all(|n| n.1 == 2), "{sides}");
            let edges = neighbours.iter().map(<[_]>::len).sum::<usize>() / 2;
            assert_eq!(closed.positions.len() + closed.triangles.len(), edges + 2);
        }
    }
}
