//! Large surfaces are coarsened before they are contracted: the axis of a trunk doesn't need a hundred sides.
//!
//! Short edges first, each into its middle, as long as the surface stays one (the link condition: the ends share no
//! neighbours but those of the edge's own faces). So a thin twig keeps three sides and is never pinched off, which
//! clustering on a grid would do, and branches that touch never merge.
//!
//! Shortest first to the letter needs a queue, whose time was most of the import's: of two million triangles 15 s of 23.
//! Here a bound rises from round to round, and in a round every vertex takes part in one collapse at most, of an edge
//! within the bound: rounds take from a third to a half of what is left to take, and all of them together a few times
//! the first. Linear in vertices; the result differs from that of the queue by the order among edges of like length.

use glam::DVec3;

use super::surface::Surface;
use super::web::Web;

/// A surface of fewer vertices, and where each vertex of the finer one went.
pub(super) struct Coarse {
    pub(super) surface: Surface,
    pub(super) home: Vec<u32>,
}

/// Factor of the bound on an edge's length from one round to the next, when a round has taken what it could.
const WIDER: f64 = 1.2;
/// The share of the vertices that a round must take for the bound to stay.
const WORTH: f64 = 0.04;
/// Most rounds that take nothing: the bound has passed every edge by then.
const MOST_IDLE: u32 = 40;
/// Edges that are looked at for the first bound.
const SAMPLE: usize = 20_000;

/// Collapses edges until at most `most` vertices are left, or nothing may be collapsed any more.
pub(super) fn coarsen(surface: &Surface, most: usize) -> Coarse {
    let n = surface.positions.len();
    if n <= most {
        return Coarse { surface: surface.clone(), home: (0..n as u32).collect() };
    }
    let mut web = Web::new(surface);
    let mut positions = surface.positions.clone();
    let mut border = vec![false; n];
    for a in 0..n as u32 {
        border[a as usize] = web.links[a as usize].iter().any(|&b| web.faces_on(a, b) == 1);
    }
    let mut bound = first_bound(surface);
    let mut alive: Vec<u32> = (0..n as u32).collect();
    // The round in which each vertex took part in a collapse.
    let mut taken = vec![0_u32; n];
    let (mut round, mut idle) = (0_u32, 0_u32);
    while web.alive > most && idle < MOST_IDLE && !web.exhausted() && web.left > 4 {
        round += 1;
        let before = web.alive;
        for &v in &alive {
            if web.alive <= most {
                break;
            }
            if taken[v as usize] == round || web.is_gone(v) {
                continue;
            }
            let Some(to) = shortest(&mut web, &positions, &border, v, bound, |n| taken[n as usize] != round) else {
                continue;
            };
            let (a, b) = (positions[v as usize], positions[to as usize]);
            // The border keeps its place.
            positions[to as usize] = match (border[v as usize], border[to as usize]) {
                (true, false) => a,
                (false, true) => b,
                _ => (a + b) * 0.5,
            };
            border[to as usize] |= border[v as usize];
            taken[to as usize] = round;
            web.collapse(v, to);
        }
        let gone = before - web.alive;
        idle = if gone == 0 { idle + 1 } else { 0 };
        if (gone as f64) < before as f64 * WORTH {
            // Where lengths are worlds apart, the next is found in ever longer leaps.
            bound *= WIDER * WIDER * f64::from(1_u32 << idle.min(30));
        }
        alive.retain(|&v| !web.is_gone(v));
    }
    rebuilt(surface, &web, &positions)
}

/// The square of a length that a tenth of the edges is below; of zero, the smallest there is.
fn first_bound(surface: &Surface) -> f64 {
    let step = surface.triangles.len() / SAMPLE + 1;
    let mut squares: Vec<f64> = surface
        .triangles
        .iter()
        .step_by(step)
        .map(|t| surface.positions[t[0] as usize].distance_squared(surface.positions[t[1] as usize]))
        .filter(|&square| square > 0.0)
        .collect();
    let tenth = squares.len() / 10;
    if squares.is_empty() { 1e-30 } else { *squares.select_nth_unstable_by(tenth, f64::total_cmp).1 }
}

/// The nearest neighbour within the bound that a vertex may be collapsed into.
fn shortest(
    web: &mut Web,
    positions: &[DVec3],
    border: &[bool],
    v: u32,
    bound: f64,
    free: impl Fn(u32) -> bool,
) -> Option<u32> {
    let at = positions[v as usize];
    let mut best: Option<(f64, u32)> = None;
    for k in 0..web.links[v as usize].len() {
        let n = web.links[v as usize][k];
        let square = at.distance_squared(positions[n as usize]);
        let nearer = best.is_none_or(|(least, other)| (square, n) < (least, other));
        if square > bound || !nearer || !free(n) {
            continue;
        }
        web.count(v);
        web.count(n);
        let on = web.faces_on(v, n);
        let edge_of_border = border[v as usize] && border[n as usize];
        if on > 0 && web.shared(v, n) == on && (!edge_of_border || on == 1) {
            best = Some((square, n));
        }
    }
    best.map(|b| b.1)
}

fn rebuilt(surface: &Surface, web: &Web, positions: &[DVec3]) -> Coarse {
    let ends = web.ends();
    let mut name = vec![u32::MAX; ends.len()];
    let mut coarse = Surface::default();
    for (v, &end) in ends.iter().enumerate() {
        if v as u32 == end {
            name[v] = coarse.positions.len() as u32;
            coarse.positions.push(positions[v]);
        }
    }
    // Faces as the web has them: each once, at its least corner.
    for v in 0..surface.positions.len() as u32 {
        for &[a, b] in web.faces[v as usize].iter().filter(|f| v < f[0] && v < f[1]) {
            coarse.triangles.push([v, a, b].map(|v| name[v as usize]));
        }
    }
    let home = ends.iter().map(|&e| name[e as usize]).collect();
    Coarse { surface: coarse, home }
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;

    #[test]
    fn a_fine_tube_keeps_its_length_and_stays_a_tube() {
        let path: Vec<DVec3> = (0..60).map(|k| DVec3::Y * 0.1 * f64::from(k)).collect();
        let surface = shapes::tube(&path, &[0.3; 60], 24);
        let coarse = coarsen(&surface, 200);
        let high = |s: &Surface| s.positions.iter().fold(f64::MIN, |h, p| h.max(p.y));
        assert!(coarse.surface.positions.len() <= 200);
        assert!((high(&coarse.surface) - 5.9).abs() < 1e-9);
        // Euler's number of an open tube.
        let edges: usize = coarse.surface.neighbours().iter().map(<[_]>::len).sum::<usize>() / 2;
        assert_eq!(coarse.surface.positions.len() + coarse.surface.triangles.len(), edges);
        assert!(coarse.home.iter().all(|&h| (h as usize) < coarse.surface.positions.len()));
    }
}
