//! One-to-many correspondences of two plants by their branching patterns (2017 CAVW, 5).
//!
//! Top down, in two phases at each level. First the groups that grow on matched chains are matched one-to-one or
//! one-to-none, as a least-cost assignment under Eq. 4 (Rules 1 and 2). Then, within matched groups (Rule 3), chains are
//! matched greedily with the most similar ones: one-to-one first, and each chain that is left over in the larger group
//! with the chain of the smaller that it resembles most. So one chain of a group may split into several of the other,
//! or several merge into one.
//!
//! The correspondence is one of stars: a centre on one side, one chain or more on the other, a kin for each. What grows
//! on the centre is matched against what grows on all the others at once. A centre alone must bear all its branches, so
//! whatever goes with another kin than the first has a second kin on the first, a stand-in
//! ([`Family::is_stand_in`]), which is shown only where the centre's plant is alone.
//!
//! Eq. 4's terms lie in 0..=1: group outer lobes by Hausdorff distance in the reach among their siblings, branching
//! vectors, ratios, numbers of branches (relative to the larger; a continuation that is like them is one), divergences, and
//! whether both stand in the same pattern: what GC exhibits by the preset's threshold of Eq. 3. The first three have the preset's
//! weights, the others [`COUNT`], [`DIVERGENCE`] and [`PATTERN`]. Chains of matched groups are compared by the first three and by
//! what else Table 1 tells of a chain (`chain_traits`).
//!
//! Limits: a set of more than [`MOST_CELLS`] pairs of groups is cut in halves along the parent, as fuzzy matching does;
//! groups of more than a million pairs of chains are matched in order of id.

use rayon::prelude::*;

use super::assignment::assign;
use super::chain_traits::{ChainTraits, Measure};
use super::forked::viewed;
use super::fuzzy::MOST_CELLS;
use super::pattern_tree::{PatternNode, PatternTree};
use super::pruned::assign_pruned;
use super::topology_tree::TopologyNode;
use super::{Family, FamilyError, Kin, KinId};
use crate::plant::{ChainId, Crown, DIRECTIONS, Plant};
use crate::preset::plan::{MatchParams, PatternParams};

/// Weight of the difference between the numbers of branches.
const COUNT: f32 = 0.1;
/// Weight of the difference between mean divergences.
const DIVERGENCE: f32 = 0.1;
/// Weight of another pattern.
const PATTERN: f32 = 0.05;
/// Sets with fewer pairs are measured whole.
const DENSE_CELLS: usize = 1 << 10;
/// Groups with more pairs of chains are matched in order of id.
const MOST_PAIRS: usize = 1 << 20;
/// Every how many directions of a lobe bound a distance.
const STRIDE: usize = DIRECTIONS / 8;

/// The family of two plants under [`match_patterns`]; `patterns` says which branches are one group. Limbs of main forks are stems on
/// the way (`forked.rs`); its ends are the plants as they are.
///
/// # Errors
///
/// When a plant has no chain or holds a length beyond all measure; see [`FamilyError`].
pub fn pattern_family(
    from: Plant,
    to: Plant,
    params: &MatchParams,
    patterns: &PatternParams,
) -> Result<Family, FamilyError> {
    let plants = vec![from, to];
    if plants.iter().any(|plant| plant.chains().is_empty()) {
        return Err(FamilyError::Empty);
    }
    let (plants, forked) = match viewed(&plants, patterns) {
        Some((views, forked)) => (views, Some(forked)),
        None => (plants, None),
    };
    let trees: Vec<PatternTree> = plants.par_iter().map(|plant| PatternTree::of(plant, patterns)).collect();
    let kins = match_patterns(&trees[0], &trees[1], params);
    let mut family = Family::new(plants, &kins)?;
    family.forked = forked;
    Ok(family)
}

/// A chain of one side and those of the other that it is matched with.
struct Star {
    /// 0 or 1: the side of the centre.
    side: usize,
    centre: ChainId,
    others: Vec<ChainId>,
    /// One for each of the others.
    kins: Vec<KinId>,
    /// By side: whether the first kin (for the centre) or all (for the others) stand for their chains.
    primary: [bool; 2],
}

/// What one star's groups come to.
enum Found {
    /// On the kin at this place: side of the centre, centre, others.
    Star(usize, usize, ChainId, Vec<ChainId>),
    /// A chain of a side alone with all that it bears.
    Alone(usize, usize, ChainId),
}

/// The kins of two plants; see the head of this file.
#[must_use]
pub fn match_patterns(from: &PatternTree, to: &PatternTree, params: &MatchParams) -> Vec<Kin> {
    let mut build = Build { trees: [from, to], params, kins: Vec::new() };
    let root = build.within(from.root(), to.root());
    let mut level: Vec<Star> =
        root.into_iter().map(|(side, centre, others)| build.star(None, side, centre, others, [true; 2])).collect();
    while !level.is_empty() {
        // In the order of the level, whatever thread finishes first.
        let found: Vec<Vec<Found>> = level.par_iter().map(|star| build.below(star)).collect();
        let mut next = Vec::new();
        for (star, found) in level.iter().zip(found) {
            for found in found {
                build.place(star, found, &mut next);
            }
        }
        level = next;
    }
    build.kins
}

struct Build<'t> {
    trees: [&'t PatternTree; 2],
    params: &'t MatchParams,
    kins: Vec<Kin>,
}

impl Build<'_> {
    fn push(&mut self, parent: Option<KinId>, side: usize, own: Option<ChainId>, other: Option<ChainId>) -> KinId {
        let members = if side == 0 { vec![own, other] } else { vec![other, own] };
        self.kins.push(Kin { parent, members });
        KinId(self.kins.len() as u32 - 1)
    }

    fn star(
        &mut self,
        parent: Option<KinId>,
        side: usize,
        centre: ChainId,
        others: Vec<ChainId>,
        primary: [bool; 2],
    ) -> Star {
        let kins = others.iter().map(|&other| self.push(parent, side, Some(centre), Some(other))).collect();
        Star { side, centre, others, kins, primary }
    }

    /// Adds the kins of what was found on a star.
    fn place(&mut self, star: &Star, found: Found, next: &mut Vec<Star>) {
        let (at, own) = match &found {
            Found::Star(at, side, centre, others) => {
                (*at, if *side == star.side { vec![*centre] } else { others.clone() })
            }
            Found::Alone(at, side, chain) if *side == star.side => (*at, vec![*chain]),
            Found::Alone(at, ..) => (*at, Vec::new()),
        };
        match found {
            Found::Star(at, side, centre, others) => {
                let mut primary = star.primary;
                primary[star.side] &= at == 0;
                let star = self.star(Some(star.kins[at]), side, centre, others, primary);
                next.push(star);
            }
            Found::Alone(at, side, chain) => self.alone(star.kins[at], side, chain),
        }
        if at > 0 && star.primary[star.side] {
            own.into_iter().for_each(|chain| self.alone(star.kins[0], star.side, chain));
        }
    }

    /// A chain without a partner, and all that it bears.
    fn alone(&mut self, parent: KinId, side: usize, chain: ChainId) {
        let mut work = vec![(parent, chain)];
        while let Some((parent, chain)) = work.pop() {
            let kin = self.push(Some(parent), side, Some(chain), None);
            work.extend(self.trees[side].topology().children(chain).iter().rev().map(|&c| (kin, c)));
        }
    }

    /// Both phases for what grows on a star.
    fn below(&self, star: &Star) -> Vec<Found> {
        let (own, other) = (self.trees[star.side], self.trees[1 - star.side]);
        let few: Vec<&PatternNode> = own.on(star.centre).iter().collect();
        let many: Vec<(usize, &PatternNode)> =
            star.others.iter().enumerate().flat_map(|(at, &c)| other.on(c).iter().map(move |n| (at, n))).collect();
        let nodes: Vec<&PatternNode> = many.iter().map(|m| m.1).collect();
        let mut found = Vec::new();
        let mut partner: Vec<Option<usize>> = vec![None; few.len()];
        let mut alone = vec![true; many.len()];
        for (f, m) in self.groups(&few, &nodes) {
            (partner[f], alone[m]) = (Some(m), false);
        }
        for (&node, partner) in few.iter().zip(partner) {
            match partner {
                Some(m) => {
                    let (a, b) = if star.side == 0 { (node, nodes[m]) } else { (nodes[m], node) };
                    let stars = self.within(a, b).into_iter();
                    found.extend(stars.map(|(side, centre, others)| Found::Star(many[m].0, side, centre, others)));
                }
                None => {
                    let at = self.leaning(star, node);
                    found.extend(node.chains.iter().map(|&chain| Found::Alone(at, star.side, chain)));
                }
            }
        }
        for ((at, node), alone) in many.iter().zip(alone) {
            if alone {
                found.extend(node.chains.iter().map(|&chain| Found::Alone(*at, 1 - star.side, chain)));
            }
        }
        found
    }

    /// The chain of a star that leans most to the side where a group of its centre leaves.
    fn leaning(&self, star: &Star, node: &PatternNode) -> usize {
        let side = |v: glam::Vec3| v * glam::Vec3::new(1.0, 0.0, 1.0);
        let (out, other) = (side(node.direction), self.trees[1 - star.side].topology());
        let lean = |i: usize| side(other.node(star.others[i]).direction).dot(out);
        (0..star.others.len()).max_by(|&a, &b| lean(a).total_cmp(&lean(b)).then(b.cmp(&a))).unwrap_or(0)
    }

    /// Phase 1: pairs of groups; every one of the smaller set gets a partner.
    fn groups(&self, a: &[&PatternNode], b: &[&PatternNode]) -> Vec<(usize, usize)> {
        if a.is_empty() || b.is_empty() {
            return Vec::new();
        }
        let (scale_a, scale_b) = (scale(a.iter().map(|n| &n.lobe)), scale(b.iter().map(|n| &n.lobe)));
        let lobes_a: Vec<Crown> = a.iter().map(|n| n.lobe.scaled(scale_a)).collect();
        let lobes_b: Vec<Crown> = b.iter().map(|n| n.lobe.scaled(scale_b)).collect();
        let others = |i: usize, j: usize| apart_but_for_lobes(a[i], b[j], self.params);
        let cost = |i: usize, j: usize| lobes_a[i].distance(&lobes_b[j]).min(1.0) * self.params.crown + others(i, j);
        let bound = |i: usize, j: usize| {
            let apart = |d: usize| (lobes_a[i].support(d * STRIDE + 11) - lobes_b[j].support(d * STRIDE + 11)).abs();
            let coarse = (0..8).fold(0.0_f32, |most, d| most.max(apart(d))).min(1.0);
            // A hair below, whatever rounding does.
            coarse * self.params.crown + others(i, j) - 1e-6
        };
        let mut pairs = Vec::new();
        let mut bands: Vec<(Vec<usize>, Vec<usize>)> = vec![((0..a.len()).collect(), (0..b.len()).collect())];
        while let Some((mut rows, mut columns)) = bands.pop() {
            if rows.len().min(columns.len()) > 1 && rows.len() * columns.len() > MOST_CELLS {
                rows.sort_by(|&i, &j| a[i].location.total_cmp(&a[j].location).then(i.cmp(&j)));
                columns.sort_by(|&i, &j| b[i].location.total_cmp(&b[j].location).then(i.cmp(&j)));
                let (high_a, high_b) = (rows.split_off(rows.len() / 2), columns.split_off(columns.len() / 2));
                bands.extend([(high_a, high_b), (rows, columns)]);
                continue;
            }
            let turned = rows.len() > columns.len();
            let (short, long) = if turned { (&columns, &rows) } else { (&rows, &columns) };
            let paired = |r: usize, c: usize| if turned { (long[c], short[r]) } else { (short[r], long[c]) };
            let at = |r: usize, c: usize, measure: &(dyn Fn(usize, usize) -> f32 + Sync)| {
                let (i, j) = paired(r, c);
                measure(i, j)
            };
            let exact = |r: usize, c: usize| f64::from(at(r, c, &cost));
            let cells = short.len() * long.len();
            let answer: Vec<usize> = if cells <= DENSE_CELLS {
                let costs: Vec<f64> = (0..cells).map(|k| exact(k / long.len(), k % long.len())).collect();
                assign(&costs, short.len(), long.len()).into_iter().flatten().collect()
            } else {
                let bounds: Vec<f32> = (0..short.len())
                    .into_par_iter()
                    .flat_map_iter(|r| (0..long.len()).map(move |c| (r, c)))
                    .map(|(r, c)| at(r, c, &bound))
                    .collect();
                assign_pruned(short.len(), long.len(), &bounds, &exact)
            };
            pairs.extend(answer.into_iter().enumerate().map(|(r, c)| paired(r, c)));
        }
        pairs.sort_unstable();
        pairs
    }

    /// Phase 2: stars among the chains of two matched groups, the first of the first plant: side of the centre, centre,
    /// others; the centre's best partner comes first.
    fn within(&self, a: &PatternNode, b: &PatternNode) -> Vec<(usize, ChainId, Vec<ChainId>)> {
        let side = usize::from(a.chains.len() > b.chains.len());
        let (few, many) = if side == 0 { (a, b) } else { (b, a) };
        let mut stars: Vec<(usize, ChainId, Vec<ChainId>)> =
            few.chains.iter().map(|&c| (side, c, Vec::new())).collect();
        let (nf, nm) = (few.chains.len(), many.chains.len());
        if nf == 1 {
            // Whatever the costs; only the order of the others is open.
        } else if nf * nm > MOST_PAIRS {
            many.chains.iter().enumerate().for_each(|(j, &c)| stars[j * nf / nm].2.push(c));
            return stars;
        }
        let node = |side: usize, c: ChainId| self.trees[side].topology().node(c);
        let own: Vec<&TopologyNode> = few.chains.iter().map(|&c| node(side, c)).collect();
        let other: Vec<&TopologyNode> = many.chains.iter().map(|&c| node(1 - side, c)).collect();
        let (scale_f, scale_m) = (scale(own.iter().map(|n| &n.crown)), scale(other.iter().map(|n| &n.crown)));
        let crowns_f: Vec<Crown> = own.iter().map(|n| n.crown.scaled(scale_f)).collect();
        let crowns_m: Vec<Crown> = other.iter().map(|n| n.crown.scaled(scale_m)).collect();
        let traits = |side: usize, chains: &[ChainId]| -> Vec<&ChainTraits> {
            chains.iter().map(|&c| self.trees[side].traits(c)).collect()
        };
        let (traits_f, traits_m) = (traits(side, &few.chains), traits(1 - side, &many.chains));
        let (measure_f, measure_m) = (Measure::of(&traits_f), Measure::of(&traits_m));
        let cost = |i: usize, j: usize| {
            crowns_f[i].distance(&crowns_m[j]).min(1.0) * self.params.crown
                + (own[i].direction - other[j].direction).length() * 0.5 * self.params.direction
                + (own[i].crown_ratio - other[j].crown_ratio).abs() * self.params.ratio
                + traits_f[i].unlike(&measure_f, traits_m[j], &measure_m)
        };
        let mut costs: Vec<(f32, u32, u32)> =
            (0..nf).flat_map(|i| (0..nm).map(move |j| (i, j))).map(|(i, j)| (cost(i, j), i as u32, j as u32)).collect();
        costs.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut taken = vec![false; nm];
        // One each, then whoever is left.
        for one_each in [true, false] {
            for &(_, i, j) in &costs {
                let (star, j) = (&mut stars[i as usize], j as usize);
                if !taken[j] && (!one_each || star.2.is_empty()) {
                    taken[j] = true;
                    star.2.push(many.chains[j]);
                }
            }
        }
        stars
    }
}

/// Eq. 4 without its lobes.
fn apart_but_for_lobes(own: &PatternNode, other: &PatternNode, params: &MatchParams) -> f32 {
    let (own_count, other_count) = (own.count as f32, other.count as f32);
    (own.direction - other.direction).length() * 0.5 * params.direction
        + (own.ratio - other.ratio).abs() * params.ratio
        + (own_count - other_count).abs() / own_count.max(other_count).max(1.0) * COUNT
        + (own.divergence - other.divergence).abs() * std::f32::consts::FRAC_1_PI * DIVERGENCE
        + if own.pattern == other.pattern { 0.0 } else { PATTERN }
}

/// What brings the farthest reach among some crowns to 1.
fn scale<'c>(crowns: impl Iterator<Item = &'c Crown>) -> f32 {
    let reach = crowns.map(Crown::reach).fold(0.0, f32::max);
    let scale = if reach > 0.0 { 1.0 / reach } else { 1.0 };
    if scale.is_finite() { scale } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Seed;
    use crate::plant::PlantBuilder;
    use crate::relate::random_plant::{Oddity, random_plant};

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    #[test]
    fn both_ends_are_the_sources_whatever_the_patterns() {
        for seed in 0..60 {
            let plant = |name| random_plant(Seed::new(seed).child(name), 50, Oddity::Wild);
            let (a, b) = (plant("a"), plant("b"));
            let family = pattern_family(a.clone(), b.clone(), &EVEN, &PatternParams::default()).unwrap();
            assert!(family.blend(&family.corner(0)) == a && family.blend(&family.corner(1)) == b, "seed {seed}");
        }
    }

    /// A trunk with nodes of some branches each at given locations.
    fn nodes(nodes: &[(f32, usize)]) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 8.0], &[0.2, 0.02]);
        for &(location, count) in nodes {
            for i in 0..count {
                let (sin, cos) = crate::base::math::sin_cos(std::f32::consts::TAU * i as f32 / count as f32);
                builder.branch(stem, location, &[Vec3::ZERO, Vec3::new(cos, 0.6, sin)], &[0.03, 0.01]);
            }
        }
        builder.finish().unwrap()
    }

    #[test]
    fn only_chains_of_matched_groups_are_matched_and_one_splits_into_many() {
        let (a, b) = (nodes(&[(0.3, 1), (0.6, 2)]), nodes(&[(0.3, 2), (0.6, 5)]));
        let tree = |p: &Plant| PatternTree::of(p, &PatternParams::default());
        let (ta, tb) = (tree(&a), tree(&b));
        let kins = match_patterns(&ta, &tb, &EVEN);
        let node_of = |t: &PatternTree, c: ChainId| t.nodes().iter().position(|n| n.chains.contains(&c)).unwrap();
        let mut pairs: Vec<(usize, usize)> =
            kins.iter().filter_map(|k| Some((node_of(&ta, k.members[0]?), node_of(&tb, k.members[1]?)))).collect();
        pairs.sort_unstable();
        pairs.dedup();
        // Stems, and two pairs of groups, one-to-one.
        assert_eq!(pairs.len(), 3);
        // Every chain of the second plant has a partner: the first splits.
        assert!(kins.iter().all(|k| k.members[0].is_some()));
        assert_eq!(kins.len(), 1 + 7);
    }

    #[test]
    fn matched_chains_have_matched_parents() {
        for seed in 0..40 {
            let plant = |name| random_plant(Seed::new(seed).child(name), 80, Oddity::Tame);
            let (a, b) = (plant("a"), plant("b"));
            let family = pattern_family(a, b, &EVEN, &PatternParams::default()).unwrap();
            for kin in family.kin_ids() {
                let Some(parent) = family.parent(kin) else { continue };
                for s in 0..2 {
                    assert!(family.member(kin, s).is_none() || family.member(parent, s).is_some());
                }
            }
        }
    }

    /// Pairs of chains, the first plant's first.
    fn pairs(from: &Plant, to: &Plant, patterns: &PatternParams) -> Vec<(u32, u32)> {
        let kins = match_patterns(&PatternTree::of(from, patterns), &PatternTree::of(to, patterns), &EVEN);
        let mut pairs: Vec<(u32, u32)> = kins.iter().filter_map(|k| Some((k.members[0]?.0, k.members[1]?.0))).collect();
        pairs.sort_unstable();
        pairs
    }

    #[test]
    fn chains_of_one_look_go_by_girth_and_stems_by_where_they_stand() {
        let whorl = |radii: [f32; 2]| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 8.0], &[0.2, 0.02]);
            for radius in radii {
                builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[radius, 0.001]);
            }
            builder.finish().unwrap()
        };
        let usual = PatternParams::default();
        // Ids alone would pair 1 with 1.
        assert_eq!(pairs(&whorl([0.06, 0.02]), &whorl([0.02, 0.06]), &usual), [(0, 0), (1, 2), (2, 1)]);
        let stand = |places: [f32; 3]| {
            let mut builder = PlantBuilder::new();
            for x in places {
                builder.stem(Vec3::X * x, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.02]);
            }
            builder.finish().unwrap()
        };
        assert_eq!(pairs(&stand([0.0, 1.0, 2.0]), &stand([4.0, 0.0, 2.0]), &usual), [(0, 1), (1, 2), (2, 0)]);
    }

    #[test]
    fn a_continuation_that_is_like_its_branches_counts_in_eq_4() {
        // A trunk that forks into two that are alike, one of which is its own way on.
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0, Vec3::new(-2.0, 8.0, 0.0)], &[0.1; 3]);
        let twin =
            builder.branch(stem, 4.0 / (4.0 + 20.0_f32.sqrt()), &[Vec3::ZERO, Vec3::new(2.0, 4.0, 0.0)], &[0.1; 2]);
        let plant = builder.finish().unwrap();
        let wide = PatternParams { angle: 0.6, ..PatternParams::default() };
        let tree = PatternTree::of(&plant, &wide);
        let node = &tree.on(stem)[0];
        assert_eq!((node.chains.clone(), node.count), (vec![twin], 2));
        let alone = PatternNode { count: 1, ..node.clone() };
        assert_eq!(apart_but_for_lobes(node, node, &EVEN), 0.0);
        assert!((apart_but_for_lobes(node, &alone, &EVEN) - 0.5 * COUNT).abs() < 1e-6);
        let other = PatternNode { pattern: crate::relate::Pattern::Whorled, ..node.clone() };
        assert!((apart_but_for_lobes(node, &other, &EVEN) - PATTERN).abs() < 1e-6);
    }

    #[test]
    fn thresholds_of_patterns_change_what_is_matched() {
        let fork = |count: usize| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.05]);
            for (lean, radius) in [(0.1, 0.05), (1.0, 0.03), (-1.0, 0.03)].into_iter().take(count) {
                builder.branch(stem, 1.0, &[Vec3::ZERO, Vec3::new(lean, 1.0, 0.0)], &[radius, 0.01]);
            }
            builder.finish().unwrap()
        };
        let (three, one) = (fork(3), fork(1));
        // As usual one of the three goes on and the others are a group that nothing answers to.
        assert_eq!(pairs(&three, &one, &PatternParams::default()).len(), 2);
        // All three alike, by angle and radius: one splits into them.
        let wide = PatternParams { angle: 1.5, radius: 2.0, ..PatternParams::default() };
        assert_eq!(pairs(&three, &one, &wide).len(), 4);
        for half in [PatternParams { radius: 0.2, ..wide }, PatternParams { angle: 0.1, ..wide }] {
            assert_eq!(pairs(&three, &one, &half).len(), 2);
        }
        // And what is opposite hangs on the divergence.
        let none = PatternParams { divergence: 0.0, ..PatternParams::default() };
        let of = |params: &PatternParams| PatternTree::of(&nodes(&[(0.5, 2)]), params).nodes()[1].pattern;
        assert_ne!(of(&PatternParams::default()), of(&none));
    }
}
