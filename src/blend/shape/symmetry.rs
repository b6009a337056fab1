//! Reflection symmetry of a plant: how far it is from symmetric, across which vertical plane, and the nearest symmetric
//! plant (2018 TOG, section 6).
//!
//! The asymmetry is the length of the way from a plant to its reflection, in a correspondence that is its own inverse
//! (`relate/elastic/mirror.rs`): the elastic distance, or where chains go straight the paper's QED. The middle of the geodesic between the two is symmetric, and by the triangle inequality no
//! symmetric plant of that family is nearer.
//!
//! The best plane is searched among [`COARSE`] and then refined by halving steps: asymmetry jumps where branches change partners,
//! so it is no smooth function that could be descended.

use glam::Vec3;
use rayon::prelude::*;

use super::along::weighted_mean;
use super::straighten::TreeGeodesic;
use super::tree_point::TreePoint;
use crate::plant::{Curve, Plant};
use crate::preset::plan::ElasticParams;
use crate::relate::{Family, FamilyError, mirror_family, turned};

/// Planes that are tried first, evenly over half a turn.
const COARSE: usize = 18;
/// Halvings of the step about the best.
const HALVINGS: usize = 5;

/// A plant beside its reflection.
#[derive(Clone, Debug)]
pub struct Reflection {
    family: Family,
    azimuth: f32,
}

impl Reflection {
    /// Across the vertical plane through the origin that runs towards `azimuth`, radians from +z towards +x.
    ///
    /// # Errors
    ///
    /// When the plant has no chain or holds a length beyond all measure.
    pub fn across(plant: &Plant, azimuth: f32, params: &ElasticParams) -> Result<Self, FamilyError> {
        Ok(Self { family: mirror_family(turned(plant, -azimuth), params)?, azimuth })
    }

    /// Across the plane of least asymmetry.
    ///
    /// # Errors
    ///
    /// As [`across`](Self::across).
    pub fn best(plant: &Plant, params: &ElasticParams) -> Result<Self, FamilyError> {
        let bare = plant.clone().without_leaves();
        let half = std::f32::consts::PI;
        let step = half / COARSE as f32;
        let tried = |azimuth: f32| Self::across(&bare, azimuth, params).map(|r| (r.asymmetry(), azimuth));
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
        Self::across(plant, best.1, params)
    }

    /// The plane: radians from +z towards +x.
    #[must_use]
    pub fn azimuth(&self) -> f32 {
        self.azimuth
    }

    /// The plant, turned so that the plane is x = 0, and its reflection.
    #[must_use]
    pub fn family(&self) -> &Family {
        &self.family
    }

    /// How far the plant is from its reflection, metres: by the elastic metric, where chains go straight by QED.
    #[must_use]
    pub fn asymmetry(&self) -> f64 {
        let point = |s: usize| self.family.shape_point(&self.family.corner(s));
        match (point(0), point(1)) {
            (Some(a), Some(b)) => a.distance(&b),
            _ => TreeGeodesic::new(&TreePoint::of(&self.family, 0), &TreePoint::of(&self.family, 1)).length(),
        }
    }

    /// The farthest that a place on a chain is from the place on its partner's image, metres; of a chain without a partner its
    /// length.
    #[must_use]
    pub fn deviation(&self) -> f32 {
        let [own, image] = self.family.sources() else { return 0.0 };
        let posed = [own.pose(), image.pose()];
        let mut most = 0.0_f32;
        for kin in self.family.kin_ids() {
            let members = [self.family.member(kin, 0), self.family.member(kin, 1)];
            most = most.max(match members {
                [Some(a), Some(b)] => {
                    let (a, b) = (posed[0].curve(own, a), posed[1].curve(image, b));
                    let apart = |i: u32| {
                        let t = f64::from(i) / 16.0;
                        let (p, q): (Vec3, Vec3) = (a.point(t), b.point(t));
                        p.distance(q)
                    };
                    (0..=16).map(apart).fold(0.0, f32::max)
                }
                [Some(a), None] => Curve::new(own.points(a)).length(),
                [None, Some(b)] => Curve::new(image.points(b)).length(),
                [None, None] => 0.0,
            });
        }
        most
    }

    /// The plant made symmetric by an amount: 0 leaves it as it is, 1 is the middle of the way to its reflection, 2 its
    /// reflection.
    #[must_use]
    pub fn symmetrized(&self, amount: f32) -> Plant {
        let to = if amount.is_finite() { amount.clamp(0.0, 2.0) * 0.5 } else { 0.0 };
        turned(&self.family.blend(&weighted_mean(&self.family, &[1.0 - to, to])), self.azimuth)
    }
}
