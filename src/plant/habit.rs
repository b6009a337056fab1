//! The habit of a plant: the samples by which plants are compared, as distributions and not as single trees.
//!
//! *Traits* are what `inspect` tells by order: branching angle, length ratio and radius ratio of the orders 2, 3 and
//! those above together (scans have few orders), bifurcation ratio and Murray's exponent. A [`Span`] holds what several
//! plants span; [`Habit::outside`] tells where another leaves it.
//!
//! *Shape* is where the wood lies: by height and by distance from the axis, each over the plant's height; and the
//! lengths and base radii of branches, over the plant's height.
//!
//! [`Habit::distance`] is the mean of the distances (Kolmogorov and Smirnov) of all these samples, and of how many times
//! more branches one has, a tenfold number counting as 1. 0 for a plant and itself, near 1 for two that share nothing.

use super::stats::{BranchMeasures, measure_branches};
use super::{Curve, Distribution, Plant, PlantStats, distribution_distance};
use crate::base::math;

/// The orders that traits are told by; the last stands for all above, too.
const ORDERS: [u16; 3] = [2, 3, 4];
/// Most places of wood in a sample.
const MOST_PLACES: f32 = 20_000.0;
/// Fewest values of a trait for which a plant counts.
const FEWEST: usize = 5;

/// A measured quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Trait {
    /// What it is, with its unit.
    pub name: &'static str,
    /// Gravelius order; 4 for 4 and above, 0 for the whole plant.
    pub order: u16,
    /// Its values; one a plant where `order` is 0.
    pub values: Vec<f32>,
}

/// Samples of one plant, or of several of a kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Habit {
    traits: Vec<Trait>,
    /// Height of wood, its distance from the axis, lengths and radii of branches; all over the plant's height.
    shape: [Vec<f32>; 4],
    /// Branches, over all plants.
    branches: usize,
    plants: usize,
}

/// What several plants span in each trait.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// In the order of [`Habit::traits`]: the lowest lower quartile and the highest upper quartile of plants that have
    /// at least 5 values (one for a trait of the whole plant); none where no plant has.
    pub ranges: Vec<Option<[f32; 2]>>,
}

impl Habit {
    /// Measures a plant; linear in points but for sorting.
    #[must_use]
    pub fn of(plant: &Plant) -> Self {
        let rows = measure_branches(plant);
        let stats = PlantStats::of(plant);
        let mut traits = Vec::new();
        type Measure = fn(&BranchMeasures) -> Option<f32>;
        let each: [(&'static str, Measure); 3] = [
            ("branching angle, degrees", |b| b.branching_angle),
            ("length ratio", |b| b.length_ratio),
            ("radius ratio", |b| b.radius_ratio),
        ];
        for (name, measure) in each {
            for order in ORDERS {
                let values = rows.iter().filter(|b| b.order.min(4) == order).filter_map(measure).collect();
                traits.push(Trait { name, order, values });
            }
        }
        let some = |value: f32| if value > 0.0 { vec![value] } else { Vec::new() };
        traits.push(Trait { name: "bifurcation ratio", order: 0, values: some(stats.bifurcation_ratio) });
        traits.push(Trait { name: "Murray's exponent", order: 0, values: some(stats.murray.exponent) });

        let height = stats.height.max(f32::MIN_POSITIVE);
        let branches: Vec<&BranchMeasures> = rows.iter().filter(|b| b.order > 1).collect();
        let posed = plant.pose();
        let step = (stats.wood_length / MOST_PLACES).max(height / 200.0);
        let (mut heights, mut reaches) = (Vec::new(), Vec::new());
        for id in plant.chain_ids() {
            let curve: Curve<'_> = posed.curve(plant, id);
            let count = (curve.length() / step).ceil().max(1.0) as u32;
            for k in 0..count {
                let p = curve.point((f64::from(k) + 0.5) / f64::from(count));
                heights.push(p.y / height);
                reaches.push((p.x * p.x + p.z * p.z).sqrt() / height);
            }
        }
        let shape = [
            heights,
            reaches,
            branches.iter().map(|b| b.length / height).collect(),
            branches.iter().map(|b| b.base_radius / height).collect(),
        ];
        Self { traits, shape, branches: branches.len(), plants: 1 }
    }

    /// The traits, always the same ones in the same order.
    #[must_use]
    pub fn traits(&self) -> &[Trait] {
        &self.traits
    }

    /// How many plants it was measured on.
    #[must_use]
    pub fn plants(&self) -> usize {
        self.plants
    }

    /// Adds the samples of another plant.
    pub fn add(&mut self, other: &Self) {
        for (mine, theirs) in self.traits.iter_mut().zip(&other.traits) {
            mine.values.extend_from_slice(&theirs.values);
        }
        for (mine, theirs) in self.shape.iter_mut().zip(&other.shape) {
            mine.extend_from_slice(theirs);
        }
        self.branches += other.branches;
        self.plants += other.plants;
    }

    /// How far two habits lie apart, 0..=1; traits that neither has count for nothing.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f32 {
        let (mut sum, mut count) = (0.0_f32, 0.0_f32);
        for (a, b) in self.traits.iter().zip(&other.traits) {
            if a.order > 0 && !(a.values.is_empty() && b.values.is_empty()) {
                sum += distribution_distance(&a.values, &b.values);
                count += 1.0;
            }
        }
        for (a, b) in self.shape.iter().zip(&other.shape) {
            sum += distribution_distance(a, b);
            count += 1.0;
        }
        let each = |habit: &Self| (habit.branches.max(1) as f32) / habit.plants as f32;
        let folds = math::ln(each(self) / each(other)).abs() / std::f32::consts::LN_10;
        (sum + folds.min(1.0)) / (count + 1.0)
    }

    /// The traits whose median lies outside of a span, with their medians; those with fewer than 5 values and those
    /// that the span has no range for are left out.
    #[must_use]
    pub fn outside(&self, span: &Span) -> Vec<(&Trait, f32)> {
        self.traits
            .iter()
            .zip(&span.ranges)
            .filter_map(|(of, range)| {
                let [low, high] = (*range)?;
                let spread = Distribution::of(of.values.clone());
                let tells = of.order == 0 && spread.count > 0 || spread.count >= FEWEST;
                (tells && !(low..=high).contains(&spread.median)).then_some((of, spread.median))
            })
            .collect()
    }
}

impl Span {
    /// What some plants span.
    #[must_use]
    pub fn of(plants: &[Habit]) -> Self {
        let traits = plants.first().map_or(0, |habit| habit.traits.len());
        let ranges = (0..traits)
            .map(|i| {
                let spreads = plants
                    .iter()
                    .map(|habit| (habit.traits[i].order, Distribution::of(habit.traits[i].values.clone())))
                    .filter(|(order, spread)| *order == 0 && spread.count > 0 || spread.count >= FEWEST);
                spreads.fold(None, |range: Option<[f32; 2]>, (_, spread)| {
                    let [low, high] = range.unwrap_or([f32::MAX, f32::MIN]);
                    Some([low.min(spread.lower), high.max(spread.upper)])
                })
            })
            .collect();
        Self { ranges }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::plant::PlantBuilder;

    /// A pole with `count` branches that leave at `angle` degrees.
    fn pole(count: u32, angle: f32) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 10.0], &[0.2, 0.1]);
        let (sin, cos) = math::sin_cos(angle.to_radians());
        for i in 0..count {
            let way = Vec3::new(sin, cos, 0.0) * (1.0 + 0.01 * i as f32);
            builder.branch(stem, 0.3 + 0.5 * i as f32 / count as f32, &[Vec3::ZERO, way], &[0.05, 0.01]);
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_plant_is_at_no_distance_from_itself_and_far_from_another() {
        let (a, b) = (Habit::of(&pole(20, 60.0)), Habit::of(&pole(20, 30.0)));
        assert_eq!(a.distance(&a), 0.0);
        assert!(a.distance(&b) > 0.15 && (a.distance(&b) - b.distance(&a)).abs() < 1e-6);
        let mut twice = a.clone();
        twice.add(&a);
        assert_eq!((twice.plants(), twice.distance(&a)), (2, 0.0));
    }

    #[test]
    fn a_median_outside_of_what_the_others_span_is_told() {
        let span = Span::of(&[Habit::of(&pole(20, 40.0)), Habit::of(&pole(20, 60.0))]);
        assert!(Habit::of(&pole(20, 50.0)).outside(&span).is_empty());
        let steep = Habit::of(&pole(20, 20.0));
        let outside: Vec<_> = steep.outside(&span).into_iter().filter(|(of, _)| of.order > 0).collect();
        assert_eq!(outside.len(), 1);
        assert_eq!((outside[0].0.name, outside[0].0.order), ("branching angle, degrees", 2));
        assert!((outside[0].1 - 20.0).abs() < 0.01);
        // Too few branches say nothing.
        assert!(Habit::of(&pole(3, 20.0)).outside(&span).iter().all(|(of, _)| of.order == 0));
    }
}
