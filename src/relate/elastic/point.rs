//! A blend of an elastic family as a point of shape space, and the distance of two.
//!
//! The elastic metric is a product over the kins. A kin's chain counts by its length L, its turn R, its square root
//! velocity function at unit norm q̂, its radii r and, for stems, where it stands, o:
//!
//! ```text
//! d² = Σ over kins  (L - L')² + κ² (∠(R, R')² + ∠(q̂, q̂')²)  +  ∫ (r - r')² du  +  |o - o'|²
//! ```
//!
//! Kins that move along their parent (`relate/elastic/mirror.rs`) also count how far. A chain without length has no direction: all of these are one point of the space. So what the first two terms give is at
//! most L + L', by way of nothing (the quotient metric of gluing them together, as edges of the paper's trees are collapsed).
//! κ is `√2/π` of the least length among the kin's sources, for which that way is never the shorter one between two
//! of them, and the geodesic is where the kernel puts a blend: all terms move evenly. Being a quotient of a
//! product of metric spaces, it is a metric: symmetric, zero for equal chains only, with the triangle inequality.
//! Lengths of a geodesic and distances agree to rounding. Its unit is the metre.

use glam::{DVec3, Vec3};

use super::blocks::{Elastic, angle};
use crate::base::Rotation;
use crate::preset::plan::ChainPath;
use crate::relate::Weights;
use crate::relate::family::{Family, NONE};
use crate::relate::kernel::{Blender, Feed};

/// A point of the shape space that the sources of an elastic family span.
#[derive(Clone, Debug)]
pub struct ShapePoint {
    kins: Vec<Place>,
}

/// A kin's part of it.
#[derive(Clone, Debug)]
struct Place {
    length: f64,
    turn: Rotation,
    /// Unit function; empty for kins of one source, which have one form.
    form: Vec<f32>,
    /// Radii times the roots of the widths of their slots.
    stout: Vec<f64>,
    origin: DVec3,
    /// Place along the parent, for kins that move along it: location times the parent's length.
    along: f64,
    kappa: f64,
}

impl Family {
    /// The point that weights describe; none where the family is in no elastic correspondence or its chains go straight.
    #[must_use]
    pub fn shape_point(&self, weights: &Weights) -> Option<ShapePoint> {
        let elastic = self.elastic.as_ref().filter(|e| e.path == ChainPath::Elastic)?;
        let mut blender = Blender::new(self);
        blender.weigh(weights);
        Some(ShapePoint { kins: (0..self.kin_count()).map(|k| blender.shape_place(k, elastic)).collect() })
    }
}

impl Blender<'_> {
    fn shape_place(&self, k: usize, elastic: &Elastic) -> Place {
        let family = self.family;
        let row = family.row(k);
        let degree = f64::from(self.degrees[k]);
        let least = elastic.lengths[k].iter().fold(f64::INFINITY, |a, b| a.min(*b));
        let kappa = least * std::f64::consts::SQRT_2 / std::f64::consts::PI;
        let mut place = Place {
            length: 0.0,
            turn: Rotation::IDENTITY,
            form: Vec::new(),
            stout: Vec::new(),
            origin: DVec3::ZERO,
            along: 0.0,
            kappa,
        };
        if self.feeds[k] == Feed::Nothing {
            return place;
        }
        let present: Vec<usize> = (0..row.len()).filter(|&s| row[s].chain != NONE).collect();
        let share = self.share(k);
        if family.parents[k] == NONE {
            let origin = present
                .iter()
                .fold(Vec3::ZERO, |o, &s| o + family.plants[s].chain(self.only(k, s as u32)).origin * share[s]);
            place.origin = origin.as_dvec3();
        }
        if elastic.shared[k].at.is_nan() && family.parents[k] != NONE {
            let parent = &elastic.lengths[family.parents[k] as usize];
            let reach = parent.iter().fold(0.0_f64, |a, b| a.max(*b));
            place.along = f64::from(self.own_location(k)) * reach;
        }
        let len = family.blocks[k].1 as usize;
        if len == 0 {
            place.length = elastic.lengths[k][0] * degree;
            place.stout = vec![elastic.stout[k] * degree];
            return place;
        }
        let start = family.blocks[k].0 as usize * 4;
        let block = |i: usize| family.shapes[start + i * 4 * len..start + (i + 1) * 4 * len].split_at(3 * len);
        let slots = &elastic.slots[k];
        let width = |i: usize| {
            let (low, high) = (slots[i.saturating_sub(1)], slots[(i + 1).min(len - 1)]);
            ((high - low) * 0.5).max(0.0).sqrt() * degree
        };
        let stout =
            |i: usize| present.iter().enumerate().map(|(m, &s)| f64::from(block(m).1[i] * share[s])).sum::<f64>();
        place.stout = (0..len).map(|i| stout(i) * width(i)).collect();
        if let Feed::One(s) = self.feeds[k] {
            let m = present.iter().position(|&p| p == s as usize).unwrap_or(0);
            place.length = elastic.lengths[k][m] * degree;
            place.turn = row[s as usize].turn;
            place.form = block(m).0.to_vec();
        } else {
            let form = self.form(k, elastic);
            place.length = form.length * degree;
            place.turn = form.turn;
            let mut sum = vec![0.0_f64; 3 * len];
            for (m, c) in form.coefficients.iter().enumerate() {
                sum.iter_mut().zip(block(m).0).for_each(|(to, z)| *to += c * f64::from(*z));
            }
            let norm = sum.iter().map(|z| z * z).sum::<f64>().sqrt();
            place.form = sum.iter().map(|z| (z / norm) as f32).collect();
        }
        place
    }
}

impl ShapePoint {
    /// The distance to another point of the same family, metres.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f64 {
        self.kins.iter().zip(&other.kins).map(|(a, b)| a.square_distance(b)).sum::<f64>().sqrt()
    }
}

impl Place {
    fn square_distance(&self, other: &Self) -> f64 {
        let square = |x: f64| x * x;
        let mut pose = square(self.length - other.length);
        if self.length > 0.0 && other.length > 0.0 {
            let form = angle(self.form.iter().zip(&other.form).map(|(a, b)| f64::from(*a) - f64::from(*b)));
            pose += square(self.kappa) * (square(turn_between(self.turn, other.turn)) + square(form));
            pose += square(self.along - other.along);
            pose = pose.min(square(self.length + other.length));
        }
        let (own, others) = (&self.stout, &other.stout);
        let at = |of: &[f64], i: usize| of.get(i).copied().unwrap_or(0.0);
        let stout: f64 = (0..own.len().max(others.len())).map(|i| square(at(own, i) - at(others, i))).sum();
        // A stem that is not there stands nowhere.
        let apart =
            if self.length > 0.0 && other.length > 0.0 { self.origin.distance_squared(other.origin) } else { 0.0 };
        pose + stout + apart
    }
}

/// The angle of the rotation from one to the other, radians.
fn turn_between(a: Rotation, b: Rotation) -> f64 {
    let parts = |r: Rotation| [r.v.x, r.v.y, r.v.z, r.w].map(f64::from);
    let (a, b) = (parts(a), parts(b));
    let sign = if a.iter().zip(&b).map(|(x, y)| x * y).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    2.0 * angle(a.iter().zip(&b).map(|(x, y)| x - sign * y))
}
