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
/// Only if a plant is none that the builder made.
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
