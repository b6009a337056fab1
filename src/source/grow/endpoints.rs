//! Where new branches end: in a volume early on (2015, 3.2.2), on a surface around the structure later (3.2.3).
//!
//! The surface may be irregular beyond what the graph makes it: edges then count by chance for more or less than one, both
//! where a surface lies and which part of it is the exclusion zone (3.2.3: "graph distance with random weights").
//! Ways to it are confined to where it lies and a hop further, past the paper: there they run free.
//!
//! Both first name candidates, from which `count` are chosen after the pass so that they keep their distance: graph
//! nodes are a Poisson-disc distribution already, and choosing among them with a larger disc gives the paper's
//! distribution in the volume without a second snapping step. Left to chance alone, endpoints clump and bald patches
//! stay on the crown.

use glam::Vec3;
use rayon::prelude::*;

use super::grid::Lattice;
use super::nodes::Nodes;
use super::paths::PathSource;
use super::solid::Solids;
use super::space::Space;
use super::structure::Structure;
use super::volume;
use super::yao::NONE;
use crate::base::{Seed, math};
use crate::preset::plan::{Count, Endpoints, Sampling, Volume};

/// Most endpoints that a density may ask for.
const MOST: f32 = 50_000.0;

/// How many candidates are looked at together, at first; twice as many in each batch after that, up to a bound, since most
/// are chosen from the first.
const BATCH: usize = 512;
const MOST_BATCH: usize = 16_384;

/// The nodes at which branches may end, without those of the structure, whose `sources` may bear them; in no particular order. The second value has
/// the nodes that ways to them may use, where these are confined: twigs of some hops keep to what lies as near to the
/// structure as their ends, and a hop further.
pub(super) fn candidates(
    endpoints: &Endpoints,
    solids: &Solids,
    space: &Space,
    (structure, sources): (&Structure, &[PathSource]),
    seed: Seed,
) -> (Vec<u32>, Option<Vec<bool>>) {
    let (mut places, ways) = places(endpoints, solids, space, (structure, sources), seed);
    if let Sampling::Whorls { spacing } = sampling(endpoints) {
        places.retain(|&node| (space.nodes.at(node).y / spacing).fract() < 0.25);
    }
    (places, ways)
}

fn sampling(endpoints: &Endpoints) -> Sampling {
    let (Endpoints::Volume { sampling, .. } | Endpoints::Surface { sampling, .. }) = *endpoints;
    sampling
}

fn places(
    endpoints: &Endpoints,
    solids: &Solids,
    space: &Space,
    (structure, sources): (&Structure, &[PathSource]),
    seed: Seed,
) -> (Vec<u32>, Option<Vec<bool>>) {
    let Space { nodes, graph, from_root } = space;
    let free = |node: &u32| !structure.holds(*node);
    match *endpoints {
        Endpoints::Volume { ref shape, .. } => {
            if let Volume::Point { height, out, turn } = *shape {
                let by_lot = || seed.child("side").unit() * std::f32::consts::TAU;
                let (sin, cos) = math::sin_cos(turn.unwrap_or_else(by_lot));
                let point = Vec3::new(out * cos, height, out * sin);
                return (Some(nodes.nearest(point)).filter(free).into_iter().collect(), None);
            }
            let solid = volume::solid(shape, solids);
            let all = (0..nodes.len() as u32).into_par_iter().with_min_len(4096);
            let held = all.filter(|&node| volume::holds(shape, solid, nodes.at(node)));
            (held.filter(free).collect(), None)
        }
        Endpoints::Surface { k, t, irregular, .. } => {
            // What is closed to paths bears none: ways from afar would run down beside a clear bole.
            let sources: Vec<u32> = sources.iter().filter(|source| !source.closed).map(|source| source.node).collect();
            let most = k.saturating_add(1);
            let near = if irregular > 0.0 {
                // Half a hop on either side; what is farther has no number.
                let counted = graph.irregular_hops(&sources, most as f32 + 0.49, irregular, seed.child("near"));
                counted.into_iter().map(|hops| hops.round() as u32).collect()
            } else {
                graph.hops(&sources, most)
            };
            let ways = near.iter().map(|&hops| hops <= most).collect();
            let surface = (0..nodes.len() as u32).filter(|&n| near[n as usize] == k).filter(free);
            // Outermost first. Many nodes are equally many hops from the root; chance decides among them, since their
            // indices run from the ground up.
            let seed = seed.child("surface");
            let irregular_far = (irregular > 0.0 && t < 1.0)
                .then(|| graph.irregular_hops(&[nodes.root], f32::INFINITY, irregular, seed.child("far")));
            let far = |n: u32| {
                std::cmp::Reverse(match &irregular_far {
                    // Distances are never negative, so their bits have their order.
                    Some(far) => far[n as usize].to_bits(),
                    None => from_root[n as usize],
                })
            };
            let mut surface: Vec<_> = surface.map(|n| (far(n), seed.at(u64::from(n)).bits(), n)).collect();
            let kept = (surface.len() as f32 * t.clamp(0.0, 1.0)).ceil() as usize;
            if kept < surface.len() {
                surface.select_nth_unstable(kept);
                surface.truncate(kept);
            }
            (surface.into_iter().map(|(_, _, node)| node).collect(), Some(ways))
        }
    }
}

/// How many endpoints are asked for, in a region of some width.
pub(super) fn count(endpoints: &Endpoints, solids: &Solids, width: f32) -> u32 {
    match *endpoints {
        Endpoints::Volume { shape: Volume::Point { .. }, .. } => 1,
        Endpoints::Volume { count: Count::Number(count), .. } | Endpoints::Surface { count, .. } => count,
        Endpoints::Volume { count: Count::Density(density), ref shape, .. } => {
            (density * volume::measure(shape, solids, width)).clamp(0.0, MOST).round() as u32
        }
    }
}

/// Chooses `count` of some nodes as the endpoints' sampling says.
pub(super) fn choose(endpoints: &Endpoints, candidates: &[u32], nodes: &Nodes, count: usize, seed: Seed) -> Vec<u32> {
    match sampling(endpoints) {
        Sampling::Poisson | Sampling::Whorls { .. } => spread(candidates, nodes, count, seed),
        Sampling::Uniform => {
            let mut order = shuffled(candidates, seed);
            order.truncate(count);
            order
        }
    }
}

/// Nodes in an order of chance that each has by itself.
fn shuffled(nodes: &[u32], seed: Seed) -> Vec<u32> {
    let seed = seed.child("spread");
    let mut order: Vec<(u64, u32)> =
        nodes.par_iter().with_min_len(4096).map(|&n| (seed.at(u64::from(n)).bits(), n)).collect();
    order.par_sort_unstable();
    order.into_iter().map(|(_, node)| node).collect()
}

/// Chooses `count` of some nodes so that they keep their distance: in random order, with a disc that shrinks until
/// enough have found room. Linear in candidates, a few passes.
fn spread(candidates: &[u32], nodes: &Nodes, count: usize, seed: Seed) -> Vec<u32> {
    let order = shuffled(candidates, seed);
    if count >= order.len() {
        return order;
    }
    // Each with its place, and with the square of its distance to a chosen one that keeps it out: most are still kept out
    // by it when the disc has shrunk, and need not look around.
    let mut order: Vec<(u32, f32, Vec3)> =
        order.into_par_iter().with_min_len(4096).map(|n| (n, f32::INFINITY, nodes.at(n))).collect();
    let ends = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = order.iter().fold(ends, |(low, high), (_, _, p)| (low.min(*p), high.max(*p)));
    let mut chosen: Vec<(u32, Vec3)> = Vec::with_capacity(count);
    // Candidates fill a volume or a surface of discs; the larger first guess is the surface's.
    let mut disc = nodes.disc * 1.3 * (order.len() as f32 / count.max(1) as f32).sqrt();
    while chosen.len() < count && !order.is_empty() {
        // At the graph's own disc every candidate has room, which ends the loop.
        let last = disc <= nodes.disc;
        let square = disc * disc;
        let lattice = Lattice::covering(low, high, disc.max(nodes.disc));
        let mut heads = vec![NONE; lattice.cells()];
        let mut links: Vec<u32> = Vec::with_capacity(count);
        let put = |heads: &mut Vec<u32>, links: &mut Vec<u32>, place: u32, at: Vec3| {
            let cell = lattice.index(lattice.cell(at));
            links.push(heads[cell]);
            heads[cell] = place;
        };
        for (place, &(_, at)) in chosen.iter().enumerate() {
            put(&mut heads, &mut links, place as u32, at);
        }
        // Whether one of those chosen is too near, and how near.
        let crowding = |heads: &[u32], links: &[u32], chosen: &[(u32, Vec3)], here: Vec3| {
            let near = |cell: usize| {
                let mut i = heads[cell];
                while i != NONE {
                    let apart = chosen[i as usize].1.distance_squared(here);
                    if apart < square {
                        return Some(apart);
                    }
                    i = links[i as usize];
                }
                None
            };
            // Its own cell first: who is there is the likeliest to be too near, and the nearest.
            let own = lattice.cell(here);
            if let Some(apart) = near(lattice.index(own)) {
                return Some(apart);
            }
            let [from, to] = lattice.around(own);
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    let row = lattice.index([from[0], y, z]);
                    for x in 0..=(to[0] - from[0]) as usize {
                        if let Some(apart) = near(row + x) {
                            return Some(apart);
                        }
                    }
                }
            }
            None
        };
        let mut refused = Vec::new();
        let (mut rest, mut size) = (&mut order[..], BATCH);
        while !rest.is_empty() && chosen.len() < count {
            // Most of a batch are kept out by those chosen before it, which can be asked of all at once; the others in turn.
            let (batch, later) = rest.split_at_mut(size.min(rest.len()));
            rest = later;
            size = (size * 2).min(MOST_BATCH);
            if !last {
                batch.par_iter_mut().with_min_len(BATCH).for_each(|(_, kept_out, here)| {
                    if *kept_out >= square {
                        *kept_out = crowding(&heads, &links, &chosen, *here).unwrap_or(f32::INFINITY);
                    }
                });
            }
            for &mut (node, kept_out, here) in batch {
                if chosen.len() == count {
                    break;
                }
                let near = if last {
                    None
                } else if kept_out < square {
                    Some(kept_out)
                } else {
                    crowding(&heads, &links, &chosen, here)
                };
                match near {
                    Some(apart) => refused.push((node, apart, here)),
                    None => {
                        put(&mut heads, &mut links, chosen.len() as u32, here);
                        chosen.push((node, here));
                    }
                }
            }
        }
        order = refused;
        disc *= 0.85;
    }
    chosen.into_iter().map(|(node, _)| node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::plan::{Guide, GuideStart};

    /// All that is in a structure may bear.
    fn open(structure: &Structure, space: &Space) -> Vec<PathSource> {
        structure.sources(&space.nodes, GuideStart::Kept, &Guide::Constant { alpha: 0.0 }, 0.0)
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
    fn uniform_endpoints_clump_as_chance_has_it() {
        let nodes = Nodes::scatter(4000, 1.0, Seed::new(2));
        let all: Vec<u32> = (0..nodes.len() as u32).collect();
        let chosen = |sampling| {
            let shape = Volume::Cylinder { bottom: 0.0, top: 1.0, radius: 0.5, hollow: 0.0 };
            let endpoints = Endpoints::Volume { shape, count: Count::Number(200), sampling };
            choose(&endpoints, &all, &nodes, 200, Seed::new(7))
        };
        let nearest = |chosen: &[u32]| {
            let to = |n: u32, m: u32| nodes.at(m).distance(nodes.at(n));
            let one = |&n: &u32| chosen.iter().filter(|&&m| m != n).map(|&m| to(n, m)).fold(f32::MAX, f32::min);
            chosen.iter().map(one).sum::<f32>() / chosen.len() as f32
        };
        let (poisson, uniform) = (chosen(Sampling::Poisson), chosen(Sampling::Uniform));
        assert_eq!((poisson.len(), uniform.len()), (200, 200));
        // Mean distance to the nearest: 0.554 / cbrt(density) for chance alone (200 in π/4).
        let expected = 0.554 / crate::base::math::cbrt(200.0 / (std::f32::consts::PI * 0.25));
        assert!((nearest(&uniform) / expected - 1.0).abs() < 0.15, "{} {expected}", nearest(&uniform));
        assert!(nearest(&poisson) > nearest(&uniform) * 1.3);
    }

    #[test]
    fn whorls_are_tiers() {
        let space = Space::new(Nodes::scatter(4000, 1.0, Seed::new(2)));
        let structure = Structure::new(&space.nodes);
        let of = |sampling| {
            let shape = Volume::Cylinder { bottom: 0.0, top: 1.0, radius: 0.5, hollow: 0.0 };
            let endpoints = Endpoints::Volume { shape, count: Count::Number(80), sampling };
            let (candidates, _) =
                candidates(&endpoints, &Solids::new(), &space, (&structure, &open(&structure, &space)), Seed::new(1));
            choose(&endpoints, &candidates, &space.nodes, 80, Seed::new(1))
        };
        let chosen = of(Sampling::Whorls { spacing: 0.2 });
        assert_eq!(chosen.len(), 80);
        let tiers: Vec<usize> = (0..5)
            .map(|tier| {
                let low = tier as f32 * 0.2;
                chosen.iter().filter(|&&n| (low..low + 0.0501).contains(&space.nodes.at(n).y)).count()
            })
            .collect();
        assert_eq!(tiers.iter().sum::<usize>(), 80);
        assert!(tiers.iter().all(|&t| t >= 8), "{tiers:?}");
    }

    #[test]
    fn density_counts_by_volume() {
        let of = |radius| Endpoints::Volume {
            shape: Volume::Cylinder { bottom: 0.2, top: 0.7, radius, hollow: 0.0 },
            count: Count::Density(1000.0),
            sampling: Sampling::Poisson,
        };
        let volume = std::f32::consts::PI * 0.09 * 0.5;
        let counted = count(&of(0.3), &Solids::new(), 1.0) as f32;
        assert!((counted - 1000.0 * volume).abs() < 1000.0 * volume * 0.03, "{counted}");
        // What lies outside the region has no nodes and does not count.
        assert_eq!(count(&of(0.3), &Solids::new(), 0.6), count(&of(9.0), &Solids::new(), 0.6));
    }

    #[test]
    fn a_tip_off_the_axis_stands_on_a_side_of_its_seed() {
        let space = Space::new(Nodes::scatter(3000, 1.0, Seed::new(4)));
        let structure = Structure::new(&space.nodes);
        let tip_to = |turn, seed| {
            let shape = Volume::Point { height: 0.6, out: 0.3, turn };
            let endpoints = Endpoints::Volume { shape, count: Count::Number(1), sampling: Sampling::Poisson };
            let (found, _) = candidates(
                &endpoints,
                &Solids::new(),
                &space,
                (&structure, &open(&structure, &space)),
                Seed::new(seed),
            );
            assert_eq!(found.len(), 1);
            space.nodes.at(found[0])
        };
        let tip = |seed| tip_to(None, seed);
        for seed in 1..9 {
            let p = tip(seed);
            assert!((p.y - 0.6).abs() < space.nodes.disc);
            assert!((Vec3::new(p.x, 0.0, p.z).length() - 0.3).abs() < space.nodes.disc);
        }
        assert!(tip(1).distance(tip(2)) > 0.05);
        // Or on the side that is told: +z, and then -x.
        for seed in 1..4 {
            let [z, x] = [0.5, 1.0].map(|half_turns| tip_to(Some(half_turns * std::f32::consts::PI), seed));
            assert!(z.distance(Vec3::new(0.0, 0.6, 0.3)) < space.nodes.disc);
            assert!(x.distance(Vec3::new(-0.3, 0.6, 0.0)) < space.nodes.disc);
        }
    }

    #[test]
    fn a_surface_lies_exactly_its_hops_away_and_outermost() {
        let space = Space::new(Nodes::scatter(3000, 1.0, Seed::new(4)));
        let structure = Structure::new(&space.nodes);
        let surface = |t| {
            let endpoints = Endpoints::Surface { k: 3, t, irregular: 0.0, count: 9, sampling: Sampling::Poisson };
            candidates(&endpoints, &Solids::new(), &space, (&structure, &open(&structure, &space)), Seed::new(1)).0
        };
        let all = surface(1.0);
        assert!(!all.is_empty() && all.iter().all(|&n| space.from_root[n as usize] == 3));
        assert_eq!(surface(0.5).len(), all.len().div_ceil(2));
        assert!(surface(0.0).is_empty());
    }

    #[test]
    fn an_irregular_surface_is_one_of_its_own_in_each_plant_and_as_large_a_share_of_it_is_kept() {
        let space = Space::new(Nodes::scatter(3000, 1.0, Seed::new(4)));
        let structure = Structure::new(&space.nodes);
        let surface = |irregular, t, seed| {
            let endpoints = Endpoints::Surface { k: 4, t, irregular, count: 9, sampling: Sampling::Poisson };
            let sources = open(&structure, &space);
            let (mut found, ways) =
                candidates(&endpoints, &Solids::new(), &space, (&structure, &sources), Seed::new(seed));
            found.sort_unstable();
            assert!(found.iter().all(|&n| ways.as_ref().unwrap()[n as usize]));
            found
        };
        let spread = |found: &[u32]| {
            let far = |n: &u32| space.nodes.at(*n).length();
            let (low, high) = found.iter().map(far).fold((f32::MAX, 0.0_f32), |(l, h), r| (l.min(r), h.max(r)));
            (high - low) / high
        };
        let (even, rough) = (surface(0.0, 1.0, 1), surface(0.8, 1.0, 1));
        assert!(spread(&rough) > 1.1 * spread(&even), "{} {}", spread(&rough), spread(&even));
        assert!(rough != surface(0.8, 1.0, 2) && even == surface(0.0, 1.0, 2));
        // The exclusion zone is as large, and not where even counting has it.
        let outer = surface(0.8, 0.5, 1);
        assert_eq!(outer.len(), rough.len().div_ceil(2));
        let even_far = |n: &u32| space.from_root[*n as usize];
        let inner = rough.iter().filter(|n| !outer.contains(n));
        assert!(inner.map(even_far).max() > outer.iter().map(even_far).min());
    }

    #[test]
    fn the_exclusion_zone_takes_what_is_nearest_to_the_root() {
        // Fig. 11: around a trunk, the outermost third is farther from the root by hops than all that is left out.
        let space = Space::new(Nodes::scatter(4000, 1.0, Seed::new(4)));
        let mut structure = Structure::new(&space.nodes);
        let tip = space.nodes.nearest(Vec3::Y * 0.6);
        let guide = Guide::Constant { alpha: 0.0 };
        let sources = open(&structure, &space);
        let paths =
            crate::source::grow::paths::Paths::find(&space.nodes, &space.graph, &sources, &[tip], &guide, Seed::new(1));
        structure.add(&paths, tip);
        let surface = |t| {
            let endpoints = Endpoints::Surface { k: 2, t, irregular: 0.0, count: 9, sampling: Sampling::Poisson };
            candidates(&endpoints, &Solids::new(), &space, (&structure, &open(&structure, &space)), Seed::new(1)).0
        };
        let (all, outer) = (surface(1.0), surface(0.3));
        let least = outer.iter().map(|&n| space.from_root[n as usize]).min().unwrap();
        let left_out = all.iter().filter(|n| !outer.contains(n)).map(|&n| space.from_root[n as usize]).max().unwrap();
        assert!(least >= left_out && least > 3, "{least} {left_out}");
        assert_eq!(outer.len(), (all.len() as f32 * 0.3).ceil() as usize);
        // The closed part of the trunk lies hops below its bole, but is no place for a tip.
        let sources = structure.sources(&space.nodes, GuideStart::Kept, &guide, 0.45);
        let near = |k| {
            let endpoints = Endpoints::Surface { k, t: 1.0, irregular: 0.0, count: 9, sampling: Sampling::Poisson };
            candidates(&endpoints, &Solids::new(), &space, (&structure, &sources), Seed::new(1)).0
        };
        assert!(sources.iter().filter(|source| source.closed).count() > 3);
        assert!((1..4).all(|k| near(k).iter().all(|&node| !structure.holds(node))));
    }
}
