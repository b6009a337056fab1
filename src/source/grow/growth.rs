//! The iterations of growth: candidates, paths, the rule, the choice (2015, 3.1.2 to 3.1.4), for one plant or for several
//! that share a graph.
//!
//! Plants that grow together take each iteration together, in one pass of paths (`paths`): a node belongs to the plant that
//! reaches it at the least cost, and an endpoint that a neighbour reaches first is lost to it. So crowns meet in the middle,
//! as in a stand, and no plant enters another.
//!
//! Light bends guiding vectors towards it at every hop, and leaves fewer endpoints on the side away from it.

use std::borrow::Cow;

use glam::Vec3;

use super::endpoints;
use super::paths::{Costs, Party, PathSource, Paths};
use super::refine::{Planned, Ways, refined};
use super::solid::Solids;
use super::space::{Graph, GraphParams, ObstacleMeshes, Patch, Space};
use super::structure::Structure;
use super::volume;
use crate::base::Seed;
use crate::preset::plan::{EndpointRule, Endpoints, GrowIteration, GrowParams, GrowSpace, Guide, GuideAxis, Light};

/// By how much light of strength 1 bends a vector at a hop, of its own length.
const BEND: f32 = 0.35;
/// Detail from which ways are refined.
const FINER: f32 = 1.05;
/// Share of the endpoints that light of strength 1 takes from the side away from it.
const SHADE: f32 = 0.85;

/// A plant as it grows.
#[derive(Clone, Debug)]
pub(super) struct Tree<'a> {
    pub(super) params: &'a GrowParams,
    /// Its height over that of the first plant.
    share: f32,
    seed: Seed,
    /// What grew so far.
    pub(super) structure: Structure,
    /// What is to be told.
    pub(super) notes: Vec<String>,
    /// Iterations that gave fewer branches than were asked for.
    short: Vec<Short>,
}

/// An iteration in which some endpoints found no place.
#[derive(Clone, Copy, Debug)]
struct Short {
    /// From 0.
    iteration: usize,
    wanted: usize,
    found: usize,
    /// Places that neighbours are nearer to, and that no path leads to.
    taken: usize,
    lost: usize,
}

/// One sentence about all of them; none where there is none.
fn short_of_places(short: &[Short]) -> Option<String> {
    let one = |s: &Short| format!("{} of {} in iteration {}", s.found, s.wanted, s.iteration + 1);
    let each = short.iter().map(one).collect::<Vec<_>>().join(", ");
    let sum = |of: fn(&Short) -> usize| short.iter().map(of).sum::<usize>();
    let reason = |n: usize, what: &str| if n == 0 { String::new() } else { format!("; {what} {n} of those tried") };
    let taken = reason(sum(|s| s.taken), "neighbours are nearer to");
    let lost = reason(sum(|s| s.lost), "no path leads to");
    (!short.is_empty()).then(|| format!("endpoints that found a place: {each}{taken}{lost}"))
}

impl<'a> Tree<'a> {
    /// A plant that is yet to grow, `share` as tall as the first.
    pub(super) fn new(params: &'a GrowParams, share: f32, seed: Seed) -> Self {
        Self { params, share, seed, structure: Structure::empty(), notes: Vec::new(), short: Vec::new() }
    }

    /// Its height over that of the first plant.
    pub(super) fn share(&self) -> f32 {
        self.share
    }

    /// Address of the randomness of an iteration.
    fn seed_of(&self, iteration: usize) -> Seed {
        self.seed.child("iteration").at(iteration as u64)
    }
}

/// Grows all plants of a patch, but not where its nodes are `taken`; gives back the ways of their branches.
pub(super) fn grow_all(
    patch: &Patch,
    trees: &mut [Tree<'_>],
    taken: &[bool],
    space: &GrowSpace,
    solids: &Solids,
) -> Vec<Ways> {
    let views = run(patch, trees, taken, space.light, solids);
    for tree in trees.iter_mut() {
        let params = tree.params;
        let cut =
            (1..).zip(&params.iterations).filter_map(|(i, iteration)| cut_off(i, iteration, params.width, solids));
        tree.notes.splice(0..0, cut);
    }
    let detail = space.detail;
    if detail < FINER {
        return trees.iter().zip(&views).map(|(tree, view)| Ways::of(&tree.structure, &view.nodes)).collect();
    }
    let light = bending(space.light);
    let seeds: Vec<Vec<Seed>> =
        trees.iter().map(|tree| (0..tree.params.iterations.len()).map(|i| tree.seed_of(i)).collect()).collect();
    let plants: Vec<Planned<'_>> = trees
        .iter()
        .zip(&views)
        .zip(&seeds)
        .map(|((tree, view), seeds)| Planned {
            params: tree.params,
            structure: &tree.structure,
            nodes: &view.nodes,
            seeds,
            light,
        })
        .collect();
    refined(patch, &plants, detail)
}

/// What is to be told of an iteration, by number from 1, whose volume reaches beyond the graph's region.
fn cut_off(number: usize, iteration: &GrowIteration, width: f32, solids: &Solids) -> Option<String> {
    let Endpoints::Volume { shape, .. } = &iteration.endpoints else { return None };
    let (share, wide) = volume::beside(shape, solids, width)?;
    // Rounded up, so that what is told is enough.
    let wide = (wide * 100.0).ceil() / 100.0;
    let name = volume::name(shape);
    Some(format!(
        "iteration {number}: {:.1} % of the {name} that is its `shape` lies outside of the graph's region, where no branch \
         ends; all of it is inside from a `width` of {wide} on, which is {width}",
        share * 100.0
    ))
}

/// How high a plant reaches alone in a region of height 1, on a coarse graph.
pub(super) fn height_alone(params: &GrowParams, solids: &Solids) -> f32 {
    let alone = GrowParams {
        nodes: (params.nodes / 4).max(16),
        space: GrowSpace { detail: 1.0, graph_seed: params.space.graph_seed, ..GrowSpace::default() },
        ..params.clone()
    };
    let Ok(graph) = Graph::new(&GraphParams::with_heights(&alone, &[1.0]), &ObstacleMeshes::new()) else { return 1.0 };
    let mut trees = [Tree::new(&alone, 1.0, Seed::new(1))];
    let patch = graph.own();
    run(patch, &mut trees, &[], Light::default(), solids);
    let top = trees[0].structure.members.iter().fold(0.0_f32, |top, m| top.max(patch.space.nodes.at(m.node).y));
    if top > 0.05 { top } else { 1.0 }
}

/// Takes all iterations from the root on; gives back the space as each plant sees it.
fn run<'g>(
    patch: &'g Patch,
    trees: &mut [Tree<'_>],
    taken: &[bool],
    light: Light,
    solids: &Solids,
) -> Vec<Cow<'g, Space>> {
    let space = &patch.space;
    let view = |(tree, &root): (&Tree<'_>, &u32)| {
        let own = root == space.nodes.root && space.nodes.at(root) == Vec3::ZERO;
        if own { Cow::Borrowed(space) } else { Cow::Owned(space.seen_from(root, tree.share)) }
    };
    let views: Vec<Cow<'g, Space>> = trees.iter().zip(&patch.roots).map(view).collect();
    for (tree, view) in trees.iter_mut().zip(&views) {
        tree.structure = Structure::new(&view.nodes);
        tree.notes.clear();
        tree.short.clear();
    }
    let iterations = trees.iter().map(|t| t.params.iterations.len()).max().unwrap_or(0);
    for i in 0..iterations {
        pass(trees, &views, taken, i, light, solids);
    }
    for tree in trees {
        tree.notes.extend(short_of_places(&tree.short));
    }
    views
}

/// One iteration of one plant, whatever its parameters' own iterations are.
#[cfg(test)]
pub(super) fn extend(
    structure: &mut Structure,
    space: &Space,
    solids: &Solids,
    iteration: &GrowIteration,
    params: &GrowParams,
    seed: Seed,
    note: impl FnMut(String),
) {
    let params = GrowParams { iterations: vec![iteration.clone()], ..params.clone() };
    let mut tree = Tree::new(&params, 1.0, seed);
    tree.structure = structure.clone();
    let mut trees = [tree];
    pass(&mut trees, &[Cow::Borrowed(space)], &[], 0, Light::default(), solids);
    let [tree] = trees;
    *structure = tree.structure;
    tree.notes.into_iter().chain(short_of_places(&tree.short)).for_each(note);
}

/// What a plant takes into a pass.
struct Wish<'a> {
    iteration: Option<&'a GrowIteration>,
    /// Keeps all that are reached.
    rule: EndpointRule,
    wanted: usize,
    chosen: Vec<u32>,
    /// The nodes that paths may use, where these are confined.
    ways: Option<Vec<bool>>,
    sources: Vec<PathSource>,
    seed: Seed,
    costs: Costs,
}

/// One iteration of all plants; nodes that are `taken` belong to none, where there are such.
fn pass(trees: &mut [Tree<'_>], views: &[Cow<'_, Space>], taken: &[bool], i: usize, light: Light, solids: &Solids) {
    let direction = Vec3::from(light.direction).normalize_or(Vec3::Y);
    let held = |trees: &[Tree<'_>], own: usize, node: u32| {
        taken.get(node as usize).is_some_and(|taken| *taken)
            || trees.iter().enumerate().any(|(other, tree)| other != own && tree.structure.holds(node))
    };
    let mut wishes = Vec::with_capacity(trees.len());
    for t in 0..trees.len() {
        let (params, view) = (trees[t].params, &*views[t]);
        let (seed, costs) = (trees[t].seed_of(i), Costs::of(params));
        let Some(iteration) = params.iterations.get(i) else {
            let sources = trees[t].structure.members.iter().map(|m| closed(m.node)).collect();
            wishes.push(Wish {
                iteration: None,
                rule: EndpointRule::Any,
                wanted: 0,
                chosen: Vec::new(),
                ways: None,
                sources,
                seed,
                costs,
            });
            continue;
        };
        let wanted = endpoints::count(&iteration.endpoints, solids, params.width) as usize;
        let structure = &trees[t].structure;
        let sources = structure.sources(&view.nodes, iteration.start, &iteration.guide, params.bole);
        let (mut candidates, ways) =
            endpoints::candidates(&iteration.endpoints, solids, view, (structure, &sources), seed);
        candidates.retain(|&node| !held(trees, t, node));
        // Light chooses among more places than are asked for: a single one, a trunk's end say, is grown to in any light.
        if candidates.len() > wanted {
            let is_lit = |node: &u32| lit(view.nodes.at(*node), direction, light.strength, seed, *node);
            let in_light: Vec<u32> = candidates.iter().copied().filter(is_lit).collect();
            if !in_light.is_empty() {
                candidates = in_light;
            }
        }
        if candidates.is_empty() && wanted > 0 {
            trees[t].notes.push(format!("iteration {}: no node is free where its branches should end", i + 1));
        }
        // Only the rules need the paths to all candidates; otherwise the choice comes first and saves most of the search.
        let rule = iteration.keep;
        let chosen = match rule {
            EndpointRule::Any => endpoints::choose(&iteration.endpoints, &candidates, &view.nodes, wanted, seed),
            EndpointRule::Lower | EndpointRule::Higher => candidates,
        };
        wishes.push(Wish { iteration: Some(iteration), rule, wanted, chosen, ways, sources, seed, costs });
    }
    let straight = Guide::Constant { alpha: 0.0 };
    let others: Vec<PathSource> = (0..).zip(taken).filter(|(_, taken)| **taken).map(|(node, _)| closed(node)).collect();
    let mut parties: Vec<Party<'_>> = wishes
        .iter()
        .zip(views)
        .map(|(wish, view)| Party {
            nodes: &view.nodes,
            sources: &wish.sources,
            guide: wish.iteration.map_or(&straight, |iteration| &iteration.guide),
            axis: wish.iteration.map_or(GuideAxis::Vector, |iteration| iteration.axis),
            light: bending(light),
            seed: wish.seed,
            costs: wish.costs,
        })
        .collect();
    // Whims are the first plant's, also where others stand in its way.
    let whims = wishes.first().map_or(Seed::new(0), |wish| wish.seed);
    if !others.is_empty() {
        // The plants' own nodes come first, wherever others stand.
        let nodes = &views[0].nodes;
        let (light, seed, costs) = (Vec3::ZERO, Seed::new(0), parties.first().map_or(Costs::USUAL, |own| own.costs));
        let axis = GuideAxis::Vector;
        parties.insert(0, Party { nodes, sources: &others, guide: &straight, axis, light, seed, costs });
    }
    let targets: Vec<u32> = wishes.iter().flat_map(|wish| wish.chosen.iter().copied()).collect();
    if targets.is_empty() {
        trees.iter_mut().for_each(|tree| tree.structure.passes += 1);
        return;
    }
    let paths = Paths::find_among(&views[0].graph, &parties, &targets, confined(&wishes).as_deref(), whims);
    for (t, wish) in wishes.into_iter().enumerate() {
        let (tree, view) = (&mut trees[t], &*views[t]);
        let Wish { iteration, rule, wanted, chosen, seed, .. } = wish;
        let asked = !chosen.is_empty();
        let (reached, lost): (Vec<u32>, Vec<u32>) = chosen.into_iter().partition(|&n| paths.reached(n));
        let (reached, taken): (Vec<u32>, Vec<u32>) =
            reached.into_iter().partition(|&n| tree.structure.holds(paths.source(n)));
        let height = |n: u32| view.nodes.at(n).y;
        let kept = match rule {
            EndpointRule::Any => reached,
            EndpointRule::Lower | EndpointRule::Higher => {
                let lower = rule == EndpointRule::Lower;
                let right = |&n: &u32| {
                    let (end, start) = (height(n), height(paths.source(n)));
                    if lower { end < start } else { end > start }
                };
                let right: Vec<u32> = reached.into_iter().filter(right).collect();
                match iteration {
                    Some(iteration) => endpoints::choose(&iteration.endpoints, &right, &view.nodes, wanted, seed),
                    None => right,
                }
            }
        };
        if asked && kept.len() < wanted {
            let (found, taken, lost) = (kept.len(), taken.len(), lost.len());
            tree.short.push(Short { iteration: i, wanted, found, taken, lost });
        }
        for &end in &kept {
            tree.structure.add(&paths, end);
        }
        tree.structure.passes += 1;
    }
}

/// The nodes that any of some plants' paths may use; none where one of them may use all.
fn confined(wishes: &[Wish<'_>]) -> Option<Vec<bool>> {
    let mut all: Option<Vec<bool>> = None;
    for wish in wishes.iter().filter(|wish| !wish.chosen.is_empty()) {
        let ways = wish.ways.as_ref()?;
        match &mut all {
            None => all = Some(ways.clone()),
            Some(all) => all.iter_mut().zip(ways).for_each(|(all, way)| *all |= way),
        }
    }
    all
}

/// A node that takes part in no pass but stands in the way.
const fn closed(node: u32) -> PathSource {
    PathSource { node, vector: Vec3::Y, lean: 0.0, closed: true }
}

/// How light bends vectors at a hop.
fn bending(light: Light) -> Vec3 {
    Vec3::from(light.direction).normalize_or(Vec3::Y) * (light.strength * BEND)
}

/// Whether light leaves an endpoint where it is: all on the side of the light, fewer on the other.
fn lit(p: Vec3, direction: Vec3, strength: f32, seed: Seed, node: u32) -> bool {
    if strength == 0.0 {
        return true;
    }
    let side = Vec3::new(p.x, 0.0, p.z).normalize_or(Vec3::ZERO).dot(direction);
    seed.child("light").at(u64::from(node)).unit()
        >= strength * SHADE * (0.5 - side * 0.5).clamp(0.0, 1.0) * flatness(direction)
}

/// How much of a direction is across and not up.
fn flatness(direction: Vec3) -> f32 {
    Vec3::new(direction.x, 0.0, direction.z).length()
}

#[cfg(test)]
mod tests {
    use super::{Short, short_of_places};

    #[test]
    fn what_a_plant_lacks_is_one_sentence_that_says_nothing_twice() {
        let short = |iteration, wanted, found, taken, lost| Short { iteration, wanted, found, taken, lost };
        let told = |all: &[Short]| short_of_places(all).unwrap_or_default();
        assert_eq!(
            told(&[short(1, 100, 96, 4, 0), short(3, 2200, 2150, 46, 3)]),
            "endpoints that found a place: 96 of 100 in iteration 2, 2150 of 2200 in iteration 4; neighbours are nearer to 50 \
             of those tried; no path leads to 3 of those tried"
        );
        assert_eq!(told(&[short(0, 9, 8, 0, 0)]), "endpoints that found a place: 8 of 9 in iteration 1");
        assert_eq!(short_of_places(&[]), None);
    }
}
