//! Correspondences of N plants: pairwise matches joined by transitivity (2017 TVCG, 4.6, Algorithm 2).
//!
//! Level by level, the children of one kin are matched for every pair of sources (Algorithm 1), which gives a graph
//! with at most one edge from a chain to each other source. A path in it visits each source once and is a kin by
//! transitivity; the longest paths are taken first, among equals the one of the least summed cost. What no path takes
//! is alone with all that it bears.
//!
//! The paper matches each pair of trees whole beforehand and cuts what hangs on parents that ended in different kins.
//! Here children are matched when their parents are known to be kin: for pairs whose parents were matched that is the
//! same assignment, and where the parents are kin by transitivity only their children are matched as well, which the paper's
//! order leaves to chance.
//!
//! Limits: of up to 8 sources all paths that could be the cheapest are looked at, `(N−1)!` a chain at worst; of more those that a
//! search of [`STEPS`] from each chain finds, the nearest chains first. Time grows with `N²` assignments.

use std::cmp::Ordering;
use std::collections::BTreeSet;

use rayon::prelude::*;

use super::fuzzy::{Pair, match_siblings};
use super::topology_tree::TopologyTree;
use super::{Family, FamilyError, Kin, KinId};
use crate::plant::{ChainId, Plant};
use crate::preset::plan::MatchParams;

/// Steps of a search from one chain, dead ends included: of up to eight sources more than all their paths have (13,700), and of
/// more.
const STEPS: [usize; 2] = [1 << 14, 1 << 12];
/// So many sources are looked at whole.
const WHOLE: usize = 8;

/// The family of some plants under [`match_nway`].
///
/// # Errors
///
/// When a plant has no chain or holds a length beyond all measure; see [`FamilyError`].
pub fn nway_family(plants: Vec<Plant>, params: &MatchParams) -> Result<Family, FamilyError> {
    let trees: Vec<TopologyTree> = plants.par_iter().map(TopologyTree::of).collect();
    let kins = match_nway(&trees.iter().collect::<Vec<_>>(), params);
    Family::new(plants, &kins)
}

/// The family of two plants under [`match_nway`].
///
/// # Errors
///
/// As [`nway_family`].
pub fn fuzzy_family(from: Plant, to: Plant, params: &MatchParams) -> Result<Family, FamilyError> {
    nway_family(vec![from, to], params)
}

/// The kins of some plants, ordered by their first source and its chain; every chain is in exactly one.
#[must_use]
pub fn match_nway(trees: &[&TopologyTree], params: &MatchParams) -> Vec<Kin> {
    let stems: Vec<&[ChainId]> = trees.iter().map(|tree| tree.stems()).collect();
    let mut kins: Vec<Kin> = Vec::new();
    let mut level: Vec<(Option<KinId>, Vec<&[ChainId]>)> = vec![(None, stems)];
    while !level.is_empty() {
        // In the order of the level, whatever thread finishes first.
        let joined: Vec<Vec<Vec<Option<ChainId>>>> =
            level.par_iter().map(|(_, siblings)| join_siblings(trees, siblings, params)).collect();
        let mut next = Vec::new();
        for ((parent, _), found) in level.iter().zip(joined) {
            for members in found {
                let id = KinId(kins.len() as u32);
                let below: Vec<&[ChainId]> = trees
                    .iter()
                    .zip(&members)
                    .map(|(tree, m)| m.map_or(&[][..], |chain| tree.children(chain)))
                    .collect();
                if below.iter().any(|children| !children.is_empty()) {
                    next.push((Some(id), below));
                }
                kins.push(Kin { parent: *parent, members });
            }
        }
        level = next;
    }
    sorted(kins)
}

/// Kins in the order of their first members. A parent has a member wherever its child has one, so it stays ahead.
fn sorted(kins: Vec<Kin>) -> Vec<Kin> {
    let key = |kin: &Kin| kin.members.iter().enumerate().find_map(|(s, m)| m.map(|chain| (s, chain)));
    let mut order: Vec<usize> = (0..kins.len()).collect();
    order.sort_by_key(|&k| key(&kins[k]));
    let mut place = vec![0_u32; kins.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old] = new as u32;
    }
    let moved = |kin: &Kin| Kin { parent: kin.parent.map(|p| KinId(place[p.index()])), members: kin.members.clone() };
    order.iter().map(|&k| moved(&kins[k])).collect()
}

/// Joins the siblings of all sources; each is in one of the groups.
fn join_siblings(trees: &[&TopologyTree], siblings: &[&[ChainId]], params: &MatchParams) -> Vec<Vec<Option<ChainId>>> {
    let sources = trees.len();
    let bearing: Vec<usize> = (0..sources).filter(|&s| !siblings[s].is_empty()).collect();
    // Nodes of the connection graph, source after source.
    let mut first = vec![0_usize; sources + 1];
    for s in 0..sources {
        first[s + 1] = first[s] + siblings[s].len();
    }
    let count = first[sources];
    let mut edges: Vec<Option<(u32, f32)>> = vec![None; count * sources];
    for (i, &p) in bearing.iter().enumerate() {
        for &q in &bearing[i + 1..] {
            let node = |s: usize, chain: ChainId| siblings[s].binary_search(&chain).map(|i| first[s] + i);
            let pairs: Vec<Pair> = match_siblings(trees[p], siblings[p], trees[q], siblings[q], params);
            for (a, b, cost) in pairs {
                if let (Ok(a), Ok(b)) = (node(p, a), node(q, b)) {
                    edges[a * sources + q] = Some((b as u32, cost));
                    edges[b * sources + p] = Some((a as u32, cost));
                }
            }
        }
    }
    let mut taken = vec![false; count];
    let mut groups: Vec<Vec<Option<ChainId>>> = Vec::new();
    let source_of = |node: u32| first.partition_point(|&f| f <= node as usize) - 1;
    let chain_of = |node: u32| {
        let s = source_of(node);
        (s, siblings[s][node as usize - first[s]])
    };
    for length in (2..=bearing.len()).rev() {
        for path in paths(&edges, &mut taken, sources, length, &source_of) {
            let mut members = vec![None; sources];
            for node in path {
                let (s, chain) = chain_of(node);
                members[s] = Some(chain);
            }
            groups.push(members);
        }
    }
    for node in (0..count as u32).filter(|&node| !taken[node as usize]) {
        let (s, chain) = chain_of(node);
        let mut members = vec![None; sources];
        members[s] = Some(chain);
        groups.push(members);
    }
    groups
}

/// The paths of one length, each the cheapest that none before it has taken a chain of; they are taken.
///
/// Of each start only its cheapest path is kept, and sought anew when one of its chains was taken meanwhile: of eight sources of 200
/// siblings there are some hundred megabytes of paths.
fn paths(
    edges: &[Option<(u32, f32)>],
    taken: &mut [bool],
    sources: usize,
    length: usize,
    source_of: &impl Fn(u32) -> usize,
) -> Vec<Vec<u32>> {
    let before = taken.to_vec();
    let graph = Graph { edges, taken: &before, sources };
    let bearing = (0..taken.len() as u32).map(source_of).collect::<BTreeSet<_>>().len();
    let is_whole = bearing <= WHOLE;
    let can: Vec<bool> = (0..taken.len() as u32)
        .map(|node| !before[node as usize] && graph.reached(node, source_of) >= length)
        .collect();
    let cheapest = |start: u32, now: &[bool]| -> Option<Path> {
        if now[start as usize] || !can[start as usize] {
            return None;
        }
        let left = STEPS[usize::from(!is_whole)];
        let mut walk = Walk { graph, length, left, now, is_whole, best: None };
        walk.from(&mut vec![start], &mut vec![source_of(start)], 0.0);
        walk.best
    };
    let mut best: Vec<Option<Path>> = (0..taken.len() as u32).map(|start| cheapest(start, taken)).collect();
    let mut found = Vec::new();
    loop {
        let there = best.iter().enumerate().filter_map(|(start, path)| Some((start, path.as_ref()?)));
        let Some((start, path)) = there.min_by(|a, b| order(a.1, b.1)) else { return found };
        let is_free = path.1.iter().all(|&node| !taken[node as usize]);
        if is_free && let Some((_, path)) = best[start].take() {
            path.iter().for_each(|&node| taken[node as usize] = true);
            found.push(path);
        } else {
            best[start] = cheapest(start as u32, taken);
        }
    }
}

/// What a path costs, and its nodes.
type Path = (f32, Vec<u32>);

/// The cheapest first.
fn order(a: &Path, b: &Path) -> Ordering {
    a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1))
}

/// Which chains of which sources were matched.
#[derive(Clone, Copy)]
struct Graph<'a> {
    /// By node and source.
    edges: &'a [Option<(u32, f32)>],
    taken: &'a [bool],
    sources: usize,
}

impl<'a> Graph<'a> {
    /// The nodes beside one that are not taken, with their sources and costs.
    fn beside(self, node: u32) -> impl Iterator<Item = (usize, u32, f32)> + 'a {
        let own = &self.edges[node as usize * self.sources..][..self.sources];
        let free = move |(s, edge): (usize, &Option<(u32, f32)>)| edge.map(|(next, cost)| (s, next, cost));
        own.iter().enumerate().filter_map(free).filter(move |(_, next, _)| !self.taken[*next as usize])
    }

    /// How many sources can be reached from a node, its own included: no path from there is longer.
    fn reached(self, start: u32, source_of: &impl Fn(u32) -> usize) -> usize {
        let mut seen = BTreeSet::from([start]);
        let mut ends = vec![start];
        while let Some(node) = ends.pop() {
            ends.extend(self.beside(node).map(|(_, next, _)| next).filter(|next| seen.insert(*next)));
        }
        seen.into_iter().map(source_of).collect::<BTreeSet<_>>().len()
    }
}

/// Looks for the cheapest path of one length.
struct Walk<'a> {
    /// As it was before any path of this length was taken, so that a search takes the same steps each time.
    graph: Graph<'a>,
    length: usize,
    /// Steps that may still be taken.
    left: usize,
    /// What is taken by now.
    now: &'a [bool],
    /// Whether the steps suffice for all paths; then those are left out that can't be the cheapest.
    is_whole: bool,
    best: Option<Path>,
}

impl Walk<'_> {
    /// Goes on from the end of a path, to the nearest chain first; each path is found from one of its ends only.
    fn from(&mut self, path: &mut Vec<u32>, visited: &mut Vec<usize>, cost: f32) {
        if path.len() == self.length {
            if visited[0] < visited[visited.len() - 1] && path.iter().all(|&node| !self.now[node as usize]) {
                let found = (cost, path.clone());
                if self.best.as_ref().is_none_or(|best| order(&found, best).is_lt()) {
                    self.best = Some(found);
                }
            }
            return;
        }
        let mut ways: Vec<(usize, u32, f32)> = self.graph.beside(path[path.len() - 1]).collect();
        ways.retain(|(s, ..)| !visited.contains(s));
        ways.sort_by(|a, b| a.2.total_cmp(&b.2));
        for (s, next, edge) in ways {
            // No edge costs less than nothing, but for rounding.
            let is_dear = self.best.as_ref().is_some_and(|best| cost + edge > best.0 + 1e-4);
            if self.is_whole && (self.now[next as usize] || is_dear) {
                continue;
            }
            if self.left == 0 {
                return;
            }
            self.left -= 1;
            path.push(next);
            visited.push(s);
            self.from(path, visited, cost + edge);
            path.pop();
            visited.pop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::match_fuzzy;
    use crate::relate::random_plant::{Oddity, random_plant};

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    fn plants(seed: u64, count: u64, most: usize) -> Vec<Plant> {
        (0..count).map(|i| random_plant(Seed::new(seed).at(i), most, Oddity::Tame)).collect()
    }

    #[test]
    fn two_plants_are_matched_as_a_pair() {
        for seed in 0..30 {
            let plants = plants(seed, 2, 50);
            let (a, b) = (TopologyTree::of(&plants[0]), TopologyTree::of(&plants[1]));
            let partner = match_fuzzy(&a, &b, &EVEN);
            let kins = match_nway(&[&a, &b], &EVEN);
            for kin in &kins[..plants[0].chains().len()] {
                assert_eq!(kin.members[1], partner[kin.members[0].unwrap().index()]);
            }
        }
    }

    #[test]
    fn every_chain_is_in_one_kin_and_the_family_has_its_corners() {
        for seed in 0..20 {
            let plants = plants(seed, 4, 40);
            let family = nway_family(plants.clone(), &EVEN).unwrap();
            for (s, plant) in plants.iter().enumerate() {
                let mut seen = vec![0; plant.chains().len()];
                family.kin_ids().filter_map(|k| family.member(k, s)).for_each(|c| seen[c.index()] += 1);
                assert!(seen.iter().all(|n| *n == 1));
                assert!(family.blend(&family.corner(s)) == *plant);
            }
        }
    }

    #[test]
    fn the_same_plant_n_times_is_one_plant() {
        let plant = random_plant(Seed::new(8), 60, Oddity::Tame);
        let family = nway_family(vec![plant.clone(); 4], &EVEN).unwrap();
        assert_eq!(family.kin_count(), plant.chains().len());
        assert!(family.kin_ids().all(|k| (0..4).all(|s| family.member(k, s) == Some(ChainId(k.0)))));
    }

    #[test]
    fn many_sources_of_which_some_bear_less_end_soon() {
        // Where a source has fewer branches no path visits all, which a search of all orders finds out in years.
        let family = nway_family(plants(5, 16, 30), &EVEN).unwrap();
        assert!(family.kin_ids().any(|k| (0..16).filter(|&s| family.member(k, s).is_some()).count() > 12));
    }

    #[test]
    fn longer_paths_go_before_shorter_ones() {
        // Random siblings: whoever is alone could not have joined a path of the longest length that is left.
        let plants = plants(3, 3, 60);
        let trees: Vec<TopologyTree> = plants.iter().map(TopologyTree::of).collect();
        let trees: Vec<&TopologyTree> = trees.iter().collect();
        let kins = match_nway(&trees, &EVEN);
        let stems: Vec<usize> =
            plants.iter().map(|p| p.chains().iter().filter(|c| c.parent.is_none()).count()).collect();
        let whole = kins.iter().filter(|k| k.parent.is_none() && k.members.iter().all(Option::is_some)).count();
        assert!(whole >= 1 && whole <= *stems.iter().min().unwrap());
        // Two pairs of the least source's stems that meet in a third make a path of three.
        assert!(kins.iter().any(|k| k.members.iter().flatten().count() == 3));
    }

    /// As the paper has it: all paths of a length, in the order of their costs.
    fn all_paths(
        edges: &[Option<(u32, f32)>],
        taken: &mut [bool],
        sources: usize,
        length: usize,
        source_of: &impl Fn(u32) -> usize,
    ) -> Vec<Vec<u32>> {
        let mut all: Vec<Path> = Vec::new();
        let mut open: Vec<Path> = (0..taken.len() as u32).map(|start| (0.0, vec![start])).collect();
        while let Some((cost, path)) = open.pop() {
            let (first, last) = (path[0], path[path.len() - 1]);
            if path.len() == length {
                if source_of(first) < source_of(last) {
                    all.push((cost, path));
                }
                continue;
            }
            for (s, edge) in edges[last as usize * sources..][..sources].iter().enumerate() {
                if let Some((next, more)) = *edge
                    && path.iter().all(|&node| source_of(node) != s)
                {
                    open.push((cost + more, [&path[..], &[next]].concat()));
                }
            }
        }
        all.retain(|path| path.1.iter().all(|&node| !taken[node as usize]));
        all.sort_by(order);
        let mut found = Vec::new();
        for (_, path) in all {
            if path.iter().all(|&node| !taken[node as usize]) {
                path.iter().for_each(|&node| taken[node as usize] = true);
                found.push(path);
            }
        }
        found
    }

    #[test]
    fn the_cheapest_paths_one_by_one_are_those_of_all_paths_in_order() {
        for seed in 0..40 {
            let seed = Seed::new(seed);
            let (sources, each) = (3 + seed.child("sources").index(4), 1 + seed.child("each").index(6));
            let count = sources * each;
            // Assignments of every pair of sources, some of them missing, some costs the same.
            let mut edges: Vec<Option<(u32, f32)>> = vec![None; count * sources];
            for p in 0..sources {
                for q in p + 1..sources {
                    let draw = seed.at((p * sources + q) as u64);
                    let turn = draw.index(each);
                    for i in 0..each {
                        let (a, b) = (p * each + i, q * each + (i + turn) % each);
                        let cost = (draw.at(i as u64).unit() * 5.0).round() / 5.0;
                        if draw.child("there").at(i as u64).unit() < 0.8 {
                            edges[a * sources + q] = Some((b as u32, cost));
                            edges[b * sources + p] = Some((a as u32, cost));
                        }
                    }
                }
            }
            let source_of = |node: u32| node as usize / each;
            let (mut own, mut other) = (vec![false; count], vec![false; count]);
            for length in (2..=sources).rev() {
                let found = paths(&edges, &mut own, sources, length, &source_of);
                assert_eq!(found, all_paths(&edges, &mut other, sources, length, &source_of), "{length}");
            }
        }
    }
}
