//! Hierarchical fuzzy correspondences of two plants by crowns (2017 TVCG, 4.2).
//!
//! Level by level: the stems of both plants are matched, then the children of each matched pair (Rules 1 and 2), each
//! time as a least-cost assignment under Eq. 2. What is left over is unmatched with all that it bears. Similarities lie
//! in 0..=1 and don't know metres:
//!
//! - crowns: 1 − the Hausdorff distance with the crown bases laid on each other, each crown measured in the farthest
//!   reach among its own siblings. So trees of different sizes are compared in proportion, and two twigs beside a limb
//!   are alike whichever way they point;
//! - branching vectors: 1 − half the Euclidean distance of the unit vectors;
//! - crown ratios: 1 − their difference.
//!
//! The optimum of a sibling set is found without measuring every pair (`relate/pruned.rs`): eight directions of a crown
//! and the exact rest bound a cost from below.
//!
//! Limits: a sibling set of more than [`MOST_CELLS`] candidate pairs is cut in halves along the parent, both sides at
//! the median of their locations, until it fits; matches then stay within their band.

use rayon::prelude::*;

use super::assignment::assign;
use super::pruned::assign_pruned;
use super::topology_tree::{TopologyNode, TopologyTree};
use crate::plant::{ChainId, Crown, DIRECTIONS};
use crate::preset::plan::MatchParams;

/// Most pairs of siblings that are matched at once: 2048 × 2048, 16 MB of bounds.
pub const MOST_CELLS: usize = 1 << 22;

/// Sibling sets with fewer pairs are measured whole.
const DENSE_CELLS: usize = 1 << 10;
/// Bounds of fewer pairs are worked out on one thread.
const PARALLEL_CELLS: usize = 1 << 14;
/// Directions of a crown that bound a distance.
const COARSE: usize = 8;

/// Chains taken for alike, and at what cost.
pub(super) type Pair = (ChainId, ChainId, f32);

/// For each chain of `from` the chain of `to` that it is matched with, if any; one-to-one.
#[must_use]
pub fn match_fuzzy(from: &TopologyTree, to: &TopologyTree, params: &MatchParams) -> Vec<Option<ChainId>> {
    let mut partner = vec![None; from.nodes().len()];
    let mut level: Vec<(&[ChainId], &[ChainId])> = vec![(from.stems(), to.stems())];
    while !level.is_empty() {
        // In the order of the level, whatever thread finishes first.
        let matched: Vec<Vec<Pair>> = level.par_iter().map(|(a, b)| match_siblings(from, a, to, b, params)).collect();
        level.clear();
        for (a, b, _) in matched.into_iter().flatten() {
            partner[a.index()] = Some(b);
            let (below_a, below_b) = (from.children(a), to.children(b));
            if !below_a.is_empty() && !below_b.is_empty() {
                level.push((below_a, below_b));
            }
        }
    }
    partner
}

/// Matches two sets of siblings; every one of the smaller set gets a partner.
pub(super) fn match_siblings(
    from: &TopologyTree,
    a: &[ChainId],
    to: &TopologyTree,
    b: &[ChainId],
    params: &MatchParams,
) -> Vec<Pair> {
    let (crowns_a, crowns_b) = (scaled_crowns(from, a), scaled_crowns(to, b));
    let by_location = |tree: &TopologyTree, ids: &[ChainId]| {
        let mut order: Vec<usize> = (0..ids.len()).collect();
        order.sort_by(|&i, &j| tree.node(ids[i]).location.total_cmp(&tree.node(ids[j]).location).then(i.cmp(&j)));
        order
    };
    let whole = a.len().min(b.len()) <= 1 || a.len() * b.len() <= MOST_CELLS;
    let (order_a, order_b) = if whole {
        ((0..a.len()).collect(), (0..b.len()).collect())
    } else {
        (by_location(from, a), by_location(to, b))
    };
    let mut pairs = Vec::with_capacity(a.len().min(b.len()));
    let mut bands: Vec<(&[usize], &[usize])> = vec![(&order_a, &order_b)];
    while let Some((rows, columns)) = bands.pop() {
        // Halves of both keep the smaller side the smaller one, so that all of it is matched.
        if rows.len().min(columns.len()) > 1 && rows.len() * columns.len() > MOST_CELLS {
            let (low_a, high_a) = rows.split_at(rows.len() / 2);
            let (low_b, high_b) = columns.split_at(columns.len() / 2);
            bands.extend([(high_a, high_b), (low_a, low_b)]);
            continue;
        }
        let cost = |i: usize, j: usize| {
            let (node, other) = (from.node(a[i]), to.node(b[j]));
            let crown = crowns_a[i].distance(&crowns_b[j]).min(1.0);
            let direction = (node.direction - other.direction).length() * 0.5;
            let ratio = (node.crown_ratio - other.crown_ratio).abs();
            crown * params.crown + direction * params.direction + ratio * params.ratio
        };
        // The smaller side as rows.
        let turned = rows.len() > columns.len();
        let (short, long) = if turned { (columns, rows) } else { (rows, columns) };
        let paired = |r: usize, c: usize| if turned { (long[c], short[r]) } else { (short[r], long[c]) };
        let exact = |r: usize, c: usize| {
            let (i, j) = paired(r, c);
            f64::from(cost(i, j))
        };
        let answer: Vec<usize> = if short.len() * long.len() <= DENSE_CELLS {
            let costs: Vec<f64> =
                (0..short.len() * long.len()).map(|i| exact(i / long.len(), i % long.len())).collect();
            assign(&costs, short.len(), long.len()).into_iter().flatten().collect()
        } else {
            let traits = |tree: &TopologyTree, ids: &[ChainId], crowns: &[Crown], order: &[usize]| {
                Traits::of(order.iter().map(|&i| (tree.node(ids[i]), &crowns[i])))
            };
            let (own, other) = (traits(from, a, &crowns_a, rows), traits(to, b, &crowns_b, columns));
            let (short, long) = if turned { (&other, &own) } else { (&own, &other) };
            assign_pruned(short.len, long.len, &short.bounds(long, params), &exact)
        };
        pairs.extend(answer.iter().enumerate().map(|(r, &c)| {
            let (i, j) = paired(r, c);
            (a[i], b[j], cost(i, j))
        }));
    }
    pairs.sort_unstable_by_key(|pair| (pair.0, pair.1));
    pairs
}

/// What costs of some siblings are bounded by, trait after trait.
struct Traits {
    len: usize,
    /// For each of [`COARSE`] directions the crowns' support there.
    support: Vec<f32>,
    /// x, y and z of branching vectors, then crown ratios.
    direction: [Vec<f32>; 3],
    ratio: Vec<f32>,
}

impl Traits {
    fn of<'a>(siblings: impl ExactSizeIterator<Item = (&'a TopologyNode, &'a Crown)> + Clone) -> Self {
        let support = |d: usize| siblings.clone().map(move |(_, crown)| crown.support(d * DIRECTIONS / COARSE + 11));
        Self {
            len: siblings.len(),
            support: (0..COARSE).flat_map(support).collect(),
            direction: [0, 1, 2].map(|axis| siblings.clone().map(|(node, _)| node.direction[axis]).collect()),
            ratio: siblings.clone().map(|(node, _)| node.crown_ratio).collect(),
        }
    }

    /// Lower bounds of the costs between these siblings and others, row after row.
    fn bounds(&self, other: &Self, params: &MatchParams) -> Vec<f32> {
        let columns = other.len;
        let mut bounds = vec![0.0_f32; self.len * columns];
        let fill = |(row, line): (usize, &mut [f32])| {
            for d in 0..COARSE {
                let own = self.support[d * self.len + row];
                for (most, support) in line.iter_mut().zip(&other.support[d * columns..(d + 1) * columns]) {
                    let apart = (own - support).abs();
                    *most = if apart > *most { apart } else { *most };
                }
            }
            let [x, y, z] = [0, 1, 2].map(|axis| self.direction[axis][row]);
            let ratio = self.ratio[row];
            let [xs, ys, zs] = &other.direction;
            let columns = line.iter_mut().zip(xs).zip(ys).zip(zs).zip(&other.ratio);
            for ((((cost, ox), oy), oz), other_ratio) in columns {
                let (dx, dy, dz) = (x - ox, y - oy, z - oz);
                let direction = (dx * dx + dy * dy + dz * dz).sqrt() * 0.5;
                let crown = if *cost < 1.0 { *cost } else { 1.0 };
                let bound =
                    crown * params.crown + direction * params.direction + (ratio - other_ratio).abs() * params.ratio;
                // A hair below, whatever rounding does to the crown's own sum.
                *cost = bound - 1e-6;
            }
        };
        if bounds.len() < PARALLEL_CELLS {
            bounds.chunks_exact_mut(columns).enumerate().for_each(fill);
        } else {
            bounds.par_chunks_exact_mut(columns).with_min_len(8).enumerate().for_each(fill);
        }
        bounds
    }
}

/// The crowns of some siblings, measured in the farthest reach among them.
fn scaled_crowns(tree: &TopologyTree, ids: &[ChainId]) -> Vec<Crown> {
    let reach = ids.iter().map(|&id| tree.node(id).crown.reach()).fold(0.0, f32::max);
    let scale = if reach > 0.0 { 1.0 / reach } else { 1.0 };
    let scale = if scale.is_finite() { scale } else { 1.0 };
    ids.iter().map(|&id| tree.node(id).crown.scaled(scale)).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Seed;
    use crate::plant::{Plant, PlantBuilder};
    use crate::relate::fuzzy_family;
    use crate::relate::random_plant::{Oddity, random_plant};

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    fn match_plants(a: &Plant, b: &Plant) -> Vec<Option<ChainId>> {
        match_fuzzy(&TopologyTree::of(a), &TopologyTree::of(b), &EVEN)
    }

    /// A trunk with branches of given location and tip.
    fn tree(branches: &[(f32, Vec3)], scale: f32) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0 * scale], &[0.1, 0.1]);
        for &(location, tip) in branches {
            builder.branch(stem, location, &[Vec3::ZERO, tip * scale], &[0.05, 0.05]);
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_plant_matches_itself_chain_by_chain_in_any_size_and_sibling_order() {
        let branches: Vec<(f32, Vec3)> =
            (0..8).map(|i| (0.2 + 0.1 * i as f32, Seed::new(3).at(i).direction() * (0.5 + 0.1 * i as f32))).collect();
        let turned: Vec<(f32, Vec3)> = branches.iter().rev().copied().collect();
        let matched = match_plants(&tree(&branches, 1.0), &tree(&turned, 2.5));
        for i in 0..8_u32 {
            assert_eq!(matched[1 + i as usize], Some(ChainId(8 - i)));
        }
    }

    #[test]
    fn limbs_go_with_limbs_and_twigs_with_twigs() {
        // By direction alone the limb of `a` would go with the twig of `b`.
        let a = tree(&[(0.3, Vec3::X * 3.0), (0.5, Vec3::new(0.2, 0.0, 0.3))], 1.0);
        let b = tree(&[(0.3, Vec3::X * 0.3), (0.5, Vec3::new(2.0, 0.0, 2.5))], 1.0);
        let crowns = MatchParams { crown: 0.8, direction: 0.1, ratio: 0.1 };
        let matched = match_fuzzy(&TopologyTree::of(&a), &TopologyTree::of(&b), &crowns);
        assert_eq!(matched[1..], [Some(ChainId(2)), Some(ChainId(1))]);
        let directions = MatchParams { crown: 0.0, direction: 1.0, ratio: 0.0 };
        let matched = match_fuzzy(&TopologyTree::of(&a), &TopologyTree::of(&b), &directions);
        assert_eq!(matched[1..], [Some(ChainId(1)), Some(ChainId(2))]);
    }

    #[test]
    fn rules_hold_and_the_smaller_sibling_set_is_used_up() {
        for seed in 0..80 {
            let plant = |name| random_plant(Seed::new(seed).child(name), 60, Oddity::Wild);
            let (a, b) = (plant("a"), plant("b"));
            let matched = match_plants(&a, &b);
            let mut used = vec![false; b.chains().len()];
            for id in a.chain_ids() {
                let Some(other) = matched[id.index()] else { continue };
                assert!(!std::mem::replace(&mut used[other.index()], true));
                let (own, partner) = (a.chain(id), b.chain(other));
                assert_eq!(own.order, partner.order);
                assert_eq!(own.parent.map(|p| matched[p.index()]), partner.parent.map(Some));
            }
            let (children_a, children_b) = (a.children(), b.children());
            for id in a.chain_ids() {
                if let Some(other) = matched[id.index()] {
                    let below = children_a[id.index()].iter().filter(|c| matched[c.index()].is_some()).count();
                    assert_eq!(below, children_a[id.index()].len().min(children_b[other.index()].len()));
                }
            }
        }
    }

    #[test]
    fn thousands_of_siblings_are_matched_in_bands() {
        let wide = |count: u64, seed: u64| {
            let branches: Vec<(f32, Vec3)> = (0..count)
                .map(|i| (Seed::new(seed).at(i).unit(), Seed::new(seed).child("tip").at(i).direction()))
                .collect();
            tree(&branches, 1.0)
        };
        let (a, b) = (wide(2060, 1), wide(2100, 2));
        let matched = match_plants(&a, &b);
        assert!(matched.iter().all(Option::is_some));
        // The lower half goes with the lower half.
        let mut partners: Vec<(f32, f32)> = a
            .chain_ids()
            .skip(1)
            .map(|id| (a.chain(id).location, b.chain(matched[id.index()].unwrap()).location))
            .collect();
        partners.sort_by(|x, y| x.0.total_cmp(&y.0));
        let (low, high) = partners.split_at(1030);
        let top = low.iter().map(|p| p.1).fold(0.0, f32::max);
        assert!(high.iter().all(|p| p.1 >= top));
    }

    #[test]
    fn pruning_leaves_the_cost_of_the_whole_matrix() {
        let wide = |count: u64, seed: u64| {
            let branches: Vec<(f32, Vec3)> = (0..count)
                .map(|i| {
                    let at = Seed::new(seed).at(i);
                    (at.unit(), at.child("tip").direction() * at.child("length").range(0.1, 1.0))
                })
                .collect();
            tree(&branches, 1.0)
        };
        let (a, b) = (TopologyTree::of(&wide(90, 1)), TopologyTree::of(&wide(110, 2)));
        let (own, other) = (a.children(ChainId(0)), b.children(ChainId(0)));
        let (crowns_a, crowns_b) = (scaled_crowns(&a, own), scaled_crowns(&b, other));
        let cost = |i: usize, j: usize| {
            let (node, partner) = (a.node(own[i]), b.node(other[j]));
            let crown = crowns_a[i].distance(&crowns_b[j]).min(1.0);
            let direction = (node.direction - partner.direction).length() * 0.5;
            f64::from(crown * 0.5 + direction * 0.3 + (node.crown_ratio - partner.crown_ratio).abs() * 0.2)
        };
        let costs: Vec<f64> = (0..90 * 110).map(|i| cost(i / 110, i % 110)).collect();
        let least: f64 = assign(&costs, 90, 110).iter().enumerate().map(|(i, c)| costs[i * 110 + c.unwrap()]).sum();
        for pairs in [match_siblings(&a, own, &b, other, &EVEN), match_siblings(&b, other, &a, own, &EVEN)] {
            let found: f64 = pairs.iter().map(|pair| f64::from(pair.2)).sum();
            assert!(pairs.len() == 90 && (found - least).abs() < 1e-4, "{found} {least}");
        }
    }

    #[test]
    fn the_family_of_a_match_holds_every_chain_once() {
        let plant = |name| random_plant(Seed::new(5).child(name), 60, Oddity::Wild);
        let (a, b) = (plant("a"), plant("b"));
        let family = fuzzy_family(a.clone(), b.clone(), &EVEN).unwrap();
        let count = |s| family.kin_ids().filter(|&k| family.member(k, s).is_some()).count();
        assert_eq!((count(0), count(1)), (a.chains().len(), b.chains().len()));
    }
}
