//! How fine the ways are that a plant's branches take through its graph: what finer nodes along them gain.

use super::growth::{self, Tree};
use super::refine::Ways;
use super::space::{Graph, GraphParams, ObstacleMeshes};
use super::{GrowError, Solids, checked};
use crate::base::Seed;
use crate::preset::plan::GrowParams;

/// Half the way over which a path's own course is taken, heights.
const COURSE: f32 = 0.03;

/// The fineness of a plant's paths, before they are smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail {
    /// Nodes of the graph.
    pub nodes: usize,
    /// Finer nodes along the branches.
    pub finer: usize,
    /// Edges from the root to a tip, the median.
    pub path: f32,
    /// Mean length of an edge, heights.
    pub edge: f32,
    /// Mean distance of a node from the middle of its path's course, heights: the crookedness that the graph shows.
    pub stray: f32,
}

/// Measures the paths that some parameters grow.
///
/// # Errors
///
/// When a parameter is out of range, a shape or mesh is not there, or nothing grows.
pub fn detail(params: &GrowParams, solids: &Solids, seed: Seed) -> Result<Detail, GrowError> {
    checked(params, solids)?;
    let graph = Graph::new(&GraphParams::of(params, solids)?, &ObstacleMeshes::new())?;
    let mut trees = [Tree::new(params, 1.0, seed.child("grow").at(params.seed))];
    let ways = growth::grow_all(graph.own(), &mut trees, &[], &params.space, solids);
    let Ways { places, parents, .. } = &ways[0];
    let count = places.len();
    let mut hops = vec![0_u32; count];
    let mut heavy = vec![None; count];
    let mut length = 0.0_f64;
    for i in 1..count {
        let parent = parents[i] as usize;
        hops[i] = hops[parent] + 1;
        heavy[parent] = Some(i);
        length += f64::from(places[i].distance(places[parent]));
    }
    let tips = || (1..count).filter(|&i| heavy[i].is_none());
    if count < 2 {
        return Err(GrowError::Nothing);
    }
    let (mut stray, mut strays) = (0.0_f64, 0_u32);
    for i in 1..count {
        let here = places[i];
        let place = |i: usize| places[i];
        let (mut below, mut above) = (i, i);
        while below != 0 && place(below).distance(here) < COURSE {
            below = parents[below] as usize;
        }
        while let Some(next) = heavy[above].filter(|_| place(above).distance(here) < COURSE) {
            above = next;
        }
        if place(below).distance(here) >= COURSE && place(above).distance(here) >= COURSE {
            let chord = place(above) - place(below);
            let off = here - place(below);
            let foot = chord * (off.dot(chord) / chord.length_squared().max(f32::MIN_POSITIVE));
            stray += f64::from((off - foot).length());
            strays += 1;
        }
    }
    let mut ways_up: Vec<u32> = tips().map(|i| hops[i]).collect();
    ways_up.sort_unstable();
    Ok(Detail {
        nodes: graph.nodes(),
        finer: ways[0].finer,
        path: ways_up[ways_up.len() / 2] as f32,
        edge: (length / (count - 1) as f64) as f32,
        stray: (stray / f64::from(strays.max(1))) as f32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::species;

    #[test]
    fn finer_nodes_along_branches_give_more_and_shorter_edges() {
        let text = "(height: 9.0, nodes: 6000, iterations: [\
            (endpoints: Volume(shape: Point(height: 0.6), count: 1)),\
            (endpoints: Volume(shape: Ellipsoid(bottom: 0.4, top: 0.9, radius: 0.3), count: 12))])";
        let mut params = species("s.ron", text).unwrap();
        params.space.detail = 2.0;
        let fine = detail(&params, &Solids::new(), Seed::new(1)).unwrap();
        params.space.detail = 1.0;
        let even = detail(&params, &Solids::new(), Seed::new(1)).unwrap();
        assert!(fine.nodes == even.nodes && fine.finer < 2 * even.nodes && even.finer == 0, "{fine:?} {even:?}");
        assert!(fine.path > even.path * 1.6 && fine.edge < even.edge * 0.62, "{fine:?} {even:?}");
        assert!(fine.stray < even.stray, "{fine:?} {even:?}");
    }
}
