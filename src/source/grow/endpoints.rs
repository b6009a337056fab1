//! Where new branches end: in a volume early on (2015, 3.2.2), on a surface around the structure later (3.2.3).
//!
//! Both first name candidates, from which `count` are chosen after the pass so that they keep their distance: graph
//! nodes are a Poisson-disc distribution already, and choosing among them with a larger disc gives the paper's
//! distribution in the volume without a second snapping step. Left to chance alone, endpoints clump and bald patches
//! stay on the crown.

use glam::Vec3;

use super::space::Space;
use super::grid::Lattice;
use super::nodes::Nodes;
use super::structure::Structure;
use super::yao::NONE;
use crate::base::Seed;
use crate::preset::plan::{Endpoints, Volume};

/// The nodes at which branches may end, without those of the structure; in no particular order.
pub(super) fn candidates(endpoints: &Endpoints, space: &Space, structure: &Structure, seed: Seed) -> Vec<u32> {
    let Space { nodes, graph, from_root } = space;
    let free = |node: &u32| !structure.holds(*node);
    match *endpoints {
        Endpoints::Volume { ref shape, .. } => {
            if let Volume::Point { height } = *shape {
                return Some(nodes.nearest(Vec3::Y * height)).filter(free).into_iter().collect();
            }
            (0..nodes.len() as u32).filter(|&node| holds(shape, nodes.at(node))).filter(free).collect()
        }
        Endpoints::Surface { hops, proportion, .. } => {
            let sources: Vec<u32> = structure.members.iter().map(|m| m.node).collect();
            let near = graph.hops(&sources, hops);
            let mut surface: Vec<u32> = (0..nodes.len() as u32).filter(|&n| near[n as usize] == hops).collect();
            // Outermost first. Many nodes are equally many hops from the root; chance decides among them, since their
            // indices run from the ground up.
            let seed = seed.child("surface");
            surface.sort_by_key(|&n| (std::cmp::Reverse(from_root[n as usize]), seed.at(u64::from(n)).bits()));
            let kept = (surface.len() as f32 * proportion.clamp(0.0, 1.0)).ceil() as usize;
            surface.truncate(kept);
            surface
        }
    }
}

/// How many endpoints are asked for.
pub(super) fn count(endpoints: &Endpoints) -> u32 {
    match *endpoints {
        Endpoints::Volume { shape: Volume::Point { .. }, .. } => 1,
        Endpoints::Volume { count, .. } | Endpoints::Surface { count, .. } => count,
    }
}

/// Whether a volume holds a point; lengths in plant heights.
fn holds(shape: &Volume, p: Vec3) -> bool {
    let out = p.x * p.x + p.z * p.z;
    // Distance from the centre in units of the half axes; 0 / 0 is NaN and lies in no range.
    let shell = |centre: f32, half: f32, radius: f32, hollow: f32| {
        let up = (p.y - centre) / half;
        let reach = (up * up + out / (radius * radius)).sqrt();
        (hollow..=1.0).contains(&reach)
    };
    match *shape {
        Volume::Point { .. } => false,
        Volume::Ellipsoid { bottom, top, radius, hollow } => {
            shell((bottom + top) * 0.5, (top - bottom) * 0.5, radius, hollow)
        }
        Volume::HalfEllipsoid { bottom, top, radius, hollow } => {
            p.y >= bottom && shell(bottom, top - bottom, radius, hollow)
        }
        Volume::Cone { bottom, top, radius } => {
            let here = radius * (top - p.y) / (top - bottom);
            (bottom..=top).contains(&p.y) && out <= here * here
        }
        Volume::Cylinder { bottom, top, radius } => (bottom..=top).contains(&p.y) && out <= radius * radius,
    }
}

/// Chooses `count` of some nodes so that they keep their distance: in random order, with a disc that shrinks until
/// enough have found room. Linear in candidates, a few passes.
pub(super) fn spread(candidates: &[u32], nodes: &Nodes, count: usize, seed: Seed) -> Vec<u32> {
    let seed = seed.child("spread");
    let mut order = candidates.to_vec();
    order.sort_by_key(|&n| (seed.at(u64::from(n)).bits(), n));
    if count >= order.len() {
        return order;
    }
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &n in &order {
        (low, high) = (low.min(nodes.at(n)), high.max(nodes.at(n)));
    }
    let mut chosen: Vec<u32> = Vec::with_capacity(count);
    // Candidates fill a volume or a surface of discs; the larger first guess is the surface's.
    let mut disc = nodes.disc * 1.3 * (order.len() as f32 / count.max(1) as f32).sqrt();
    while chosen.len() < count && !order.is_empty() {
        // At the graph's own disc every candidate has room, which ends the loop.
        let last = disc <= nodes.disc;
        let lattice = Lattice::covering(low, high, disc.max(nodes.disc));
        let mut heads = vec![NONE; lattice.cells()];
        let mut links: Vec<u32> = Vec::with_capacity(count);
        let put = |heads: &mut Vec<u32>, links: &mut Vec<u32>, place: u32, node: u32| {
            let cell = lattice.index(lattice.cell(nodes.at(node)));
            links.push(heads[cell]);
            heads[cell] = place;
        };
        for (place, &node) in chosen.iter().enumerate() {
            put(&mut heads, &mut links, place as u32, node);
        }
        let mut refused = Vec::new();
        for &node in &order {
            if chosen.len() == count {
                break;
            }
            let here = nodes.at(node);
            let crowded = || {
                let [from, to] = lattice.around(lattice.cell(here));
                for y in from[1]..=to[1] {
                    for z in from[2]..=to[2] {
                        for x in from[0]..=to[0] {
                            let mut i = heads[lattice.index([x, y, z])];
                            while i != NONE {
                                if nodes.at(chosen[i as usize]).distance_squared(here) < disc * disc {
                                    return true;
                                }
                                i = links[i as usize];
                            }
                        }
                    }
                }
                false
            };
            if !last && crowded() {
                refused.push(node);
            } else {
                put(&mut heads, &mut links, chosen.len() as u32, node);
                chosen.push(node);
            }
        }
        order = refused;
        disc *= 0.85;
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_hold_what_they_should() {
        let half = Volume::HalfEllipsoid { bottom: 0.3, top: 0.9, radius: 0.5, hollow: 0.5 };
        assert!(holds(&half, Vec3::new(0.4, 0.31, 0.0)) && holds(&half, Vec3::new(0.0, 0.85, 0.0)));
        assert!(!holds(&half, Vec3::new(0.4, 0.29, 0.0)) && !holds(&half, Vec3::new(0.1, 0.4, 0.0)));
        let cone = Volume::Cone { bottom: 0.2, top: 1.0, radius: 0.4 };
        assert!(holds(&cone, Vec3::new(0.0, 0.6, 0.19)) && !holds(&cone, Vec3::new(0.0, 0.6, 0.21)));
        let flat = Volume::Ellipsoid { bottom: 0.5, top: 0.5, radius: 0.0, hollow: 0.0 };
        assert!(!holds(&flat, Vec3::new(0.0, 0.5, 0.0)));
        assert!(holds(&Volume::Cylinder { bottom: 0.0, top: 0.2, radius: 0.1 }, Vec3::ZERO));
    }

    #[test]
    fn chosen_endpoints_keep_their_distance() {
        let nodes = Nodes::scatter(4000, 1.0, Seed::new(2));
        let all: Vec<u32> = (0..nodes.len() as u32).collect();
        let chosen = spread(&all, &nodes, 60, Seed::new(7));
        assert_eq!(chosen.len(), 60);
        let nearest = |n: u32| {
            chosen.iter().filter(|&&m| m != n).map(|&m| nodes.at(m).distance(nodes.at(n))).fold(f32::MAX, f32::min)
        };
        let closest = chosen.iter().map(|&n| nearest(n)).fold(f32::MAX, f32::min);
        // 60 balls of this diameter fill a good tenth of the cylinder; 60 points left to chance come four times closer.
        assert!(closest > 0.12, "{closest}");
        let mut sorted = chosen.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), 60);
    }

    #[test]
    fn asking_for_all_or_more_gives_all() {
        let nodes = Nodes::scatter(500, 1.0, Seed::new(2));
        let some: Vec<u32> = (3..40).collect();
        let mut chosen = spread(&some, &nodes, 1000, Seed::new(7));
        chosen.sort_unstable();
        assert_eq!(chosen, some);
        assert_eq!(spread(&some, &nodes, 36, Seed::new(7)).len(), 36);
        assert!(spread(&some, &nodes, 0, Seed::new(7)).is_empty());
    }

    #[test]
    fn a_surface_lies_exactly_its_hops_away_and_outermost() {
        let space = Space::new(Nodes::scatter(3000, 1.0, Seed::new(4)));
        let structure = Structure::new(&space.nodes);
        let surface = |proportion| {
            let endpoints = Endpoints::Surface { hops: 3, proportion, count: 9 };
            candidates(&endpoints, &space, &structure, Seed::new(1))
        };
        let all = surface(1.0);
        assert!(!all.is_empty() && all.iter().all(|&n| space.from_root[n as usize] == 3));
        assert_eq!(surface(0.5).len(), all.len().div_ceil(2));
        assert!(surface(0.0).is_empty());
    }
}
