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
//! Limits: a sibling set of more than [`MOST_CELLS`] candidate pairs is cut in halves along the parent, both sides at
//! the median of their locations, until it fits; matches then stay within their band. So time grows with the number of
//! siblings, not with its cube.

use rayon::prelude::*;

use super::assignment::assign;
use super::topology_tree::TopologyTree;
use super::{Family, FamilyError, Kin, KinId};
use crate::plant::{ChainId, Crown, Plant};
use crate::preset::plan::MatchParams;

/// Most cells of one cost matrix: 512 × 1024 siblings, 4 MB, some 50 ms.
pub const MOST_CELLS: usize = 1 << 19;

/// Cost matrices below this are filled on one thread.
const PARALLEL_CELLS: usize = 1 << 13;

/// For each chain of `from` the chain of `to` that it is matched with, if any; one-to-one.
#[must_use]
pub fn match_fuzzy(from: &TopologyTree, to: &TopologyTree, params: &MatchParams) -> Vec<Option<ChainId>> {
    let mut partner = vec![None; from.nodes().len()];
    let mut level: Vec<(&[ChainId], &[ChainId])> = vec![(from.stems(), to.stems())];
    while !level.is_empty() {
        // In the order of the level, whatever thread finishes first.
        let matched: Vec<Vec<(ChainId, ChainId)>> =
            level.par_iter().map(|(a, b)| match_siblings(from, a, to, b, params)).collect();
        level.clear();
        for (a, b) in matched.into_iter().flatten() {
            partner[a.index()] = Some(b);
            let (below_a, below_b) = (from.children(a), to.children(b));
            if !below_a.is_empty() && !below_b.is_empty() {
                level.push((below_a, below_b));
            }
        }
    }
    partner
}

/// The family of two plants under [`match_fuzzy`]: a kin for each chain of `from`, in its order, then one for each
/// unmatched chain of `to`.
///
/// # Errors
///
/// When a plant has no chain or holds a length beyond all measure; see [`FamilyError`].
pub fn fuzzy_family(from: Plant, to: Plant, params: &MatchParams) -> Result<Family, FamilyError> {
    let (tree_a, tree_b) = rayon::join(|| TopologyTree::of(&from), || TopologyTree::of(&to));
    let partner = match_fuzzy(&tree_a, &tree_b, params);
    let mut kin_of = vec![None; to.chains().len()];
    let mut kins: Vec<Kin> = Vec::with_capacity(partner.len());
    for id in from.chain_ids() {
        let other = partner[id.index()];
        if let Some(other) = other {
            kin_of[other.index()] = Some(KinId(kins.len() as u32));
        }
        kins.push(Kin { parent: from.chain(id).parent.map(|p| KinId(p.0)), members: vec![Some(id), other] });
    }
    for id in to.chain_ids() {
        if kin_of[id.index()].is_none() {
            kin_of[id.index()] = Some(KinId(kins.len() as u32));
            let parent = to.chain(id).parent.and_then(|p| kin_of[p.index()]);
            kins.push(Kin { parent, members: vec![None, Some(id)] });
        }
    }
    Family::new(vec![from, to], &kins)
}

/// Matches two sets of siblings; every one of the smaller set gets a partner.
fn match_siblings(
    from: &TopologyTree,
    a: &[ChainId],
    to: &TopologyTree,
    b: &[ChainId],
    params: &MatchParams,
) -> Vec<(ChainId, ChainId)> {
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
        let line = |&i: &usize| -> Vec<f64> {
            let node = from.node(a[i]);
            columns
                .iter()
                .map(|&j| {
                    let other = to.node(b[j]);
                    let crown = crowns_a[i].distance(&crowns_b[j]).min(1.0);
                    let direction = (node.direction - other.direction).length() * 0.5;
                    let ratio = (node.crown_ratio - other.crown_ratio).abs();
                    f64::from(crown * params.crown + direction * params.direction + ratio * params.ratio)
                })
                .collect()
        };
        let costs: Vec<f64> = if rows.len() * columns.len() < PARALLEL_CELLS {
            rows.iter().flat_map(line).collect()
        } else {
            rows.par_iter().map(line).collect::<Vec<_>>().concat()
        };
        let answer = assign(&costs, rows.len(), columns.len());
        pairs.extend(answer.iter().zip(rows).filter_map(|(column, &i)| column.map(|c| (a[i], b[columns[c]]))));
    }
    pairs
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
    use crate::plant::PlantBuilder;
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
        let (a, b) = (wide(720, 1), wide(760, 2));
        let matched = match_plants(&a, &b);
        assert!(matched.iter().all(Option::is_some));
        // The lower half goes with the lower half.
        let mut partners: Vec<(f32, f32)> = a
            .chain_ids()
            .skip(1)
            .map(|id| (a.chain(id).location, b.chain(matched[id.index()].unwrap()).location))
            .collect();
        partners.sort_by(|x, y| x.0.total_cmp(&y.0));
        let (low, high) = partners.split_at(360);
        let top = low.iter().map(|p| p.1).fold(0.0, f32::max);
        assert!(high.iter().all(|p| p.1 >= top));
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
