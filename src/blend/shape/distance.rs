//! How far plants are from each other in shape space.
//!
//! Each pair gets a correspondence of its own, so the triangle inequality may fail where three of them disagree (how often
//! is counted by `figures -- space`); within one family the same metrics obey it. A distance does not depend on the order
//! of the two, to the last bit, and is zero between equal plants.
//!
//! Facing: the paper's distances change when a tree turns about its trunk. With [`Facing::Free`] the least over all
//! orientations is taken: [`COARSE`] of them, and halving steps about the best, the plant itself unturned among them.

use glam::Vec3;
use rayon::prelude::*;

use super::straighten::TreeGeodesic;
use super::tree_point::TreePoint;
use crate::plant::{Curve, Plant, PlantBuilder};
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
    /// The elastic metric of [`ShapePoint`](crate::relate::ShapePoint), in which bending shortens no path, metres.
    Elastic,
}

/// Whether the size of plants counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// A young tree is far from an old one; and a small plant is nearer to most than these are to each other.
    AsIs,
    /// Plants are scaled until the squares of their chains' lengths add up to 1 first.
    Relative,
}

/// How plants are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// What is measured.
    pub metric: Metric,
    /// Whether plants may turn about the vertical.
    pub facing: Facing,
    /// Whether their size counts.
    pub size: Size,
    /// How branches are matched.
    pub elastic: ElasticParams,
}

impl Comparison {
    /// By a metric, as plants stand and as large as they are.
    #[must_use]
    pub fn by(metric: Metric) -> Self {
        Self { metric, facing: Facing::Fixed, size: Size::AsIs, elastic: ElasticParams::default() }
    }
}

/// The distance of two plants.
///
/// # Errors
///
/// When a plant has no chain or holds a length beyond all measure.
pub fn distance(a: &Plant, b: &Plant, how: &Comparison) -> Result<f64, FamilyError> {
    let bare = |plant: &Plant| match how.size {
        Size::AsIs => plant.clone().without_leaves(),
        Size::Relative => relative(plant),
    };
    let mut pair = [bare(a), bare(b)];
    if canonical_order(&pair)[0] == 1 {
        pair.swap(0, 1);
    }
    let [a, b] = pair;
    Ok(match how.facing {
        Facing::Fixed => one(&a, &b, how.metric, &how.elastic)?,
        Facing::Free => nearest_facing(&a, &b, how.metric, &how.elastic)?.0,
    })
}

/// The plant without leaves, of unit size.
fn relative(plant: &Plant) -> Plant {
    let square = |id| {
        let length = f64::from(Curve::new(plant.points(id)).length());
        length * length
    };
    let size = plant.chain_ids().map(square).sum::<f64>().sqrt();
    if !(size > 0.0 && size.is_finite()) {
        return plant.clone().without_leaves();
    }
    let scale = (1.0 / size) as f32;
    let mut builder = PlantBuilder::new();
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let points: Vec<Vec3> = plant.points(id).iter().map(|p| *p * scale).collect();
        let radii: Vec<f32> = plant.radii(id).iter().map(|r| r * scale).collect();
        builder.chain(chain.parent, chain.location, chain.origin * scale, &points, &radii);
    }
    builder.finish_trusted()
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
/// As [`distance`].
pub fn distance_matrix(plants: &[Plant], how: &Comparison) -> Result<Vec<Vec<f64>>, FamilyError> {
    let count = plants.len();
    let pairs: Vec<(usize, usize)> = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j))).collect();
    let found: Vec<f64> =
        pairs.par_iter().map(|&(i, j)| distance(&plants[i], &plants[j], how)).collect::<Result<_, _>>()?;
    let mut matrix = vec![vec![0.0; count]; count];
    for ((i, j), found) in pairs.into_iter().zip(found) {
        (matrix[i][j], matrix[j][i]) = (found, found);
    }
    Ok(matrix)
}
