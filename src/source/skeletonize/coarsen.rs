//! Large surfaces are coarsened before they are contracted: the axis of a trunk doesn't need a hundred sides.
//!
//! Shortest edges first, each into its middle, as long as the surface stays one (the link condition: the ends share no
//! neighbours but those of the edge's own faces). So a thin twig keeps three sides and is never pinched off, which
//! clustering on a grid would do, and branches that touch never merge.

use glam::DVec3;

use super::surface::Surface;
use super::web::Web;

/// A surface of fewer vertices, and where each vertex of the finer one went.
pub(super) struct Coarse {
    pub(super) surface: Surface,
    pub(super) home: Vec<u32>,
}

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
        for k in 0..web.links[a as usize].len() {
            let b = web.links[a as usize][k];
            if b > a {
                if web.faces_on(a, b) == 1 {
                    border[a as usize] = true;
                    border[b as usize] = true;
                }
                web.offer(positions[a as usize].distance_squared(positions[b as usize]), b, a);
            }
        }
    }
    while web.alive > most {
        let Some((_, from, to)) = web.take() else { break };
        web.count(from);
        web.count(to);
        let on = web.faces_on(from, to);
        let edge_of_border = border[from as usize] && border[to as usize];
        if on == 0 || web.shared(from, to) != on || (edge_of_border && on != 1) || web.left <= 4 {
            continue;
        }
        let (a, b) = (positions[from as usize], positions[to as usize]);
        // The border keeps its place.
        positions[to as usize] = match (border[from as usize], border[to as usize]) {
            (true, false) => a,
            (false, true) => b,
            _ => (a + b) * 0.5,
        };
        border[to as usize] |= border[from as usize];
        web.collapse(from, to);
        for k in 0..web.links[to as usize].len() {
            let near = web.links[to as usize][k];
            web.offer(positions[to as usize].distance_squared(positions[near as usize]), near, to);
        }
    }
    rebuilt(surface, &web, &positions)
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
        let edges: usize = coarse.surface.neighbours().iter().map(Vec::len).sum::<usize>() / 2;
        assert_eq!(coarse.surface.positions.len() + coarse.surface.triangles.len(), edges);
        assert!(coarse.home.iter().all(|&h| (h as usize) < coarse.surface.positions.len()));
    }
}
