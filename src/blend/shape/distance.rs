//! How far plants are from each other in shape space.
//!
//! Each pair gets a correspondence of its own, so the triangle inequality may fail where three of them disagree (how often
//! is counted by `figures -- space`); within one family the same metrics obey it. A distance does not depend on the order
//! of the two, to the last bit, and is zero between equal plants.
//!
//! Facing: the paper's distances change when a tree turns about its trunk. With [`Facing::Free`] the least over all
//! orientations is taken: [`COARSE`] of them, and halving steps about the best, the plant itself unturned among them.

use rayon::prelude::*;

use super::straighten::TreeGeodesic;
use super::tree_point::TreePoint;
use crate::plant::Plant;
use crate::preset::plan::{ChainPath, ElasticParams, Facing};
use crate::relate::{FamilyError, canonical_order, elastic_family, turned};

/// Orientations that are tried first, evenly over a turn.
const COARSE: usize = 16;
/// Halvings of the step about the best.
const HALVINGS: usize = 4;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Quotient Euclidean distance (2018 TOG, 4.2): root of the summed squares of what edges change by, metres.
    Qed,
    /// Its L1 variant, the tree edit distance: the sum of what edges change by, metres.
    Edit,
    /// The elastic metric of [`ShapePoint`](crate::relate::ShapePoint), in which bending shortens no path: root metres.
    Elastic,
}

/// The distance of two plants.
///
/// # Errors
///
/// When a plant has no chain or holds a length beyond all measure.
pub fn distance(
    a: &Plant,
    b: &Plant,
    metric: Metric,
    facing: Facing,
    params: &ElasticParams,
) -> Result<f64, FamilyError> {
    let mut pair = [a.clone().without_leaves(), b.clone().without_leaves()];
    if canonical_order(&pair)[0] == 1 {
        pair.swap(0, 1);
    }
    let [a, b] = pair;
    Ok(match facing {
        Facing::Fixed => one(&a, &b, metric, params)?,
        Facing::Free => nearest_facing(&a, &b, metric, params)?.0,
    })
}

fn one(a: &Plant, b: &Plant, metric: Metric, params: &ElasticParams) -> Result<f64, FamilyError> {
    let path = if metric == Metric::Elastic { ChainPath::Elastic } else { ChainPath::Straight };
    let family = elastic_family(vec![a.clone(), b.clone()], &ElasticParams { path, ..*params })?;
    if metric == Metric::Elastic {
        let point = |s: usize| family.shape_point(&family.corner(s));
        return Ok(point(0).zip(point(1)).map_or(f64::INFINITY, |(a, b)| a.distance(&b)));
    }
    let way = TreeGeodesic::new(&TreePoint::of(&family, 0), &TreePoint::of(&family, 1));
    Ok(if metric == Metric::Qed { way.length() } else { way.edit_length() })
}

/// The least distance over the orientations of the second plant, and the angle by which it is turned for it, radians.
///
/// # Errors
///
/// As [`distance`].
pub fn nearest_facing(a: &Plant, b: &Plant, metric: Metric, params: &ElasticParams) -> Result<(f64, f32), FamilyError> {
    let step = std::f32::consts::TAU / COARSE as f32;
    let tried = |angle: f32| {
        let at = if angle == 0.0 { one(a, b, metric, params) } else { one(a, &turned(b, angle), metric, params) };
        at.map(|distance| (distance, angle))
    };
    let coarse: Vec<(f64, f32)> =
        (0..COARSE).into_par_iter().map(|i| tried(i as f32 * step)).collect::<Result<_, _>>()?;
    let least =
        |all: &[(f64, f32)]| all.iter().copied().fold((f64::INFINITY, 0.0), |b, x| if x.0 < b.0 { x } else { b });
    let mut best = least(&coarse);
    let mut wide = step * 0.5;
    for _ in 0..HALVINGS {
        let near: Vec<(f64, f32)> =
            [best.1 - wide, best.1 + wide].into_par_iter().map(tried).collect::<Result<_, _>>()?;
        best = least(&[best, near[0], near[1]]);
        wide *= 0.5;
    }
    Ok(best)
}

/// The distances of all pairs, row after row.
///
/// # Errors
///
/// The index of the first plant of a pair that can't be compared, and why.
pub fn distance_matrix(
    plants: &[Plant],
    metric: Metric,
    facing: Facing,
    params: &ElasticParams,
) -> Result<Vec<Vec<f64>>, FamilyError> {
    let count = plants.len();
    let pairs: Vec<(usize, usize)> = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j))).collect();
    let found: Vec<f64> = pairs
        .par_iter()
        .map(|&(i, j)| distance(&plants[i], &plants[j], metric, facing, params))
        .collect::<Result<_, _>>()?;
    let mut matrix = vec![vec![0.0; count]; count];
    for ((i, j), found) in pairs.into_iter().zip(found) {
        (matrix[i][j], matrix[j][i]) = (found, found);
    }
    Ok(matrix)
}
