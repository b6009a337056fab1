//! A family in elastic correspondence: its chains resampled along the parameters that their members share.
//!
//! Under [`ChainPath::Elastic`] a block holds no points but square root velocities: for the interval Δ before a slot
//! `z = Δ / √|Δ|`, whose squares add up to the chain's length and whose products are those of the functions, so nothing
//! is lost in the sampling. They are kept at unit norm beside the length. Under [`ChainPath::Straight`] a block holds points
//! as they are. Radii are themselves in either.

use std::borrow::Cow;

use glam::{DVec3, Vec3};

use super::correspondence::{Correspondence, Shared, correspondence};
use crate::base::math;
use crate::plant::Plant;
use crate::preset::plan::{ChainPath, ElasticParams};
use crate::relate::FamilyError;
use crate::relate::family::{Family, Line};
use crate::relate::resample::Slots;

/// What an elastic family knows of its kins.
#[derive(Clone, Debug)]
pub(in crate::relate) struct Elastic {
    pub(in crate::relate) path: ChainPath,
    pub(super) shared: Vec<Shared>,
    /// For each kin of several members the shared parameter of each slot.
    pub(super) slots: Vec<Vec<f64>>,
    /// For each kin its members' lengths, metres.
    pub(super) lengths: Vec<Vec<f64>>,
    /// For each kin of several members the angles between their functions, radians, row after row.
    pub(super) angles: Vec<Vec<f64>>,
    /// For each kin of one member the norm of its radii.
    pub(super) stout: Vec<f64>,
}

/// The family of some plants in elastic correspondence, which does not depend on their order.
///
/// # Errors
///
/// When a plant has no chain or holds a length beyond all measure; see [`FamilyError`].
pub fn elastic_family(plants: Vec<Plant>, params: &ElasticParams) -> Result<Family, FamilyError> {
    if plants.iter().any(|p| p.chains().is_empty()) {
        return Err(FamilyError::Empty);
    }
    let found = correspondence(&plants, params);
    family_of(plants, found, params.path)
}

/// The family of some plants in a correspondence.
pub(super) fn family_of(plants: Vec<Plant>, found: Correspondence, path: ChainPath) -> Result<Family, FamilyError> {
    let mut family = Family::new(plants, &found.kins)?;
    family.elastic = Some(Elastic {
        path,
        shared: found.shared,
        slots: Vec::new(),
        lengths: Vec::new(),
        angles: Vec::new(),
        stout: Vec::new(),
    });
    family.lay_blocks();
    Ok(family)
}

impl Family {
    /// What matched chains do on their way; none where the family is in no elastic correspondence.
    #[must_use]
    pub fn chain_path(&self) -> Option<ChainPath> {
        self.elastic.as_ref().map(|elastic| elastic.path)
    }

    /// Where a kin stands on a member of its parent kin, also where that source does not have it: arc-length parameter.
    /// None for stems, for kins whose parent the source lacks or that have no place of their own there, and in families that
    /// are in no elastic correspondence.
    #[must_use]
    pub fn place_on(&self, kin: crate::relate::KinId, source: usize) -> Option<f32> {
        let elastic = self.elastic.as_ref()?;
        let parent = self.parent(kin)?;
        if let Some(own) = self.member(kin, source) {
            return Some(self.sources()[source].chain(own).location);
        }
        self.member(parent, source)?;
        let before = (0..source).filter(|&s| self.member(parent, s).is_some()).count();
        let at = elastic.shared[kin.index()].at;
        if at.is_nan() {
            return None;
        }
        Some(elastic.shared[parent.index()].maps.get(before).map_or(at, |map| map.at(at)) as f32)
    }
}

impl Elastic {
    /// Forgets all blocks.
    pub(in crate::relate) fn clear(&mut self) {
        (self.slots, self.lengths) = (Vec::new(), Vec::new());
        (self.angles, self.stout) = (Vec::new(), Vec::new());
    }

    /// Takes note of a kin of one member.
    pub(in crate::relate) fn alone(&mut self, line: &Line<'_>) {
        let length: f64 = line.points.windows(2).map(|w| f64::from(w[0].distance(w[1]))).sum();
        let mean = line.parameters.windows(2).zip(line.radii.windows(2));
        let square: f64 = mean.map(|(t, r)| (t[1] - t[0]) * 0.5 * f64::from(r[0] * r[0] + r[1] * r[1])).sum();
        self.slots.push(Vec::new());
        self.angles.push(Vec::new());
        self.lengths.push(vec![length]);
        self.stout.push(square.sqrt());
    }

    /// A member with a point at each knot of its map, by the shared parameter.
    pub(in crate::relate) fn cut<'a>(&self, kin: usize, place: usize, line: &Line<'a>) -> Line<'a> {
        let knots = self.shared[kin].maps[place].knots();
        let count = line.parameters.len() + knots.len();
        let mut parameters = Vec::with_capacity(count);
        let (mut points, mut radii) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut segment = 0;
        let last = line.parameters.len() - 1;
        let mut vertex = 0;
        for (k, &(u, s)) in knots.iter().enumerate() {
            // Vertices between the last knot and this one.
            while vertex <= last && line.parameters[vertex] < s - 1e-9 {
                let (low, high) = (knots[k.saturating_sub(1)], (u, s));
                if k > 0 && line.parameters[vertex] > low.1 + 1e-9 {
                    let f = (line.parameters[vertex] - low.1) / (high.1 - low.1);
                    parameters.push(low.0 + (high.0 - low.0) * f);
                    points.push(line.points[vertex]);
                    radii.push(line.radii[vertex]);
                }
                vertex += 1;
            }
            while segment + 1 < last && line.parameters[segment + 1] <= s {
                segment += 1;
            }
            let next = (segment + 1).min(last);
            let span = line.parameters[next] - line.parameters[segment];
            let f = if span > 0.0 { ((s - line.parameters[segment]) / span).clamp(0.0, 1.0) as f32 } else { 0.0 };
            let (a, b) = (line.points[segment], line.points[next]);
            parameters.push(u);
            points.push(if f >= 1.0 { b } else { a.lerp(b, f) });
            radii.push(line.radii[segment] + (line.radii[next] - line.radii[segment]) * f);
        }
        Line { parameters: Cow::Owned(parameters), points: Cow::Owned(points), radii: Cow::Owned(radii) }
    }

    /// The block of a kin of several members: `turned` gives the points of each on the kin's branching vector.
    pub(in crate::relate) fn encode(
        &mut self,
        slots: &Slots,
        turned: &dyn Fn(usize, Vec3) -> Vec3,
        members: usize,
    ) -> Vec<f32> {
        let count = slots.parameters.len();
        let mut block = vec![0.0_f32; 4 * count * members];
        let mut lengths = Vec::with_capacity(members);
        for (m, block) in block.chunks_exact_mut(4 * count).enumerate() {
            let points = &slots.points[m * count..(m + 1) * count];
            let radii = &slots.radii[m * count..(m + 1) * count];
            let length: f64 = points.windows(2).map(|w| f64::from(w[0].distance(w[1]))).sum();
            let root = length.sqrt();
            lengths.push(length);
            for i in 0..count {
                let shown = match self.path {
                    ChainPath::Straight => points[i].as_dvec3(),
                    ChainPath::Elastic if i == 0 || root <= 0.0 => DVec3::ZERO,
                    ChainPath::Elastic => {
                        let step = turned(m, points[i] - points[i - 1]).as_dvec3();
                        let size = step.length();
                        if size > 0.0 { step / (size.sqrt() * root) } else { DVec3::ZERO }
                    }
                };
                (block[i], block[count + i], block[2 * count + i]) = (shown.x as f32, shown.y as f32, shown.z as f32);
                block[3 * count + i] = radii[i];
            }
        }
        let shape = |m: usize| &block[4 * count * m..4 * count * m + 3 * count];
        let angles = (0..members * members).map(|cell| {
            let (a, b) = (shape(cell / members), shape(cell % members));
            angle(a.iter().zip(b).map(|(a, b)| f64::from(*a) - f64::from(*b)))
        });
        self.angles.push(angles.collect());
        self.lengths.push(lengths);
        self.slots.push(slots.parameters.clone());
        self.stout.push(0.0);
        block
    }
}

/// The angle between two unit vectors from the components of their difference: zero exactly where they are equal.
pub(super) fn angle(difference: impl Iterator<Item = f64>) -> f64 {
    let chord = difference.map(|d| d * d).sum::<f64>().sqrt();
    2.0 * math::asin64((chord * 0.5).min(1.0))
}
