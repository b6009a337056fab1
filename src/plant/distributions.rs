//! Spreads of a quantity, and how far two of them lie apart.

use serde::Serialize;

/// Spread of a quantity: its smallest and largest value and five quantiles, all values of the sample itself (nearest
/// rank). All zero when there are none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Distribution {
    /// How many values.
    pub count: usize,
    /// Smallest value.
    pub min: f32,
    /// 10th percentile.
    pub low: f32,
    /// 25th percentile.
    pub lower: f32,
    /// Median.
    pub median: f32,
    /// 75th percentile.
    pub upper: f32,
    /// 90th percentile.
    pub high: f32,
    /// Largest value.
    pub max: f32,
}

impl Distribution {
    /// The spread of some values; `n log n`. Values that are no numbers are left out.
    #[must_use]
    pub fn of(mut values: Vec<f32>) -> Self {
        values.retain(|v| !v.is_nan());
        values.sort_unstable_by(f32::total_cmp);
        let at = |q: f32| match values.len() {
            0 => 0.0,
            n => values[((n - 1) as f32 * q + 0.5) as usize],
        };
        Self {
            count: values.len(),
            min: at(0.0),
            low: at(0.1),
            lower: at(0.25),
            median: at(0.5),
            upper: at(0.75),
            high: at(0.9),
            max: at(1.0),
        }
    }
}

/// The distance of two samples after Kolmogorov and Smirnov: the largest difference of their cumulative shares, 0..=1.
/// 1 where just one of them is empty, 0 where both are. Needs no unit and no scale, and a few outliers move it little.
#[must_use]
pub fn distribution_distance(a: &[f32], b: &[f32]) -> f32 {
    if a.is_empty() || b.is_empty() {
        return if a.len() == b.len() { 0.0 } else { 1.0 };
    }
    let sorted = |values: &[f32]| {
        let mut values = values.to_vec();
        values.sort_unstable_by(f32::total_cmp);
        values
    };
    let (a, b) = (sorted(a), sorted(b));
    let (mut i, mut j, mut worst) = (0, 0, 0.0_f64);
    while i < a.len() && j < b.len() {
        let value = if a[i].total_cmp(&b[j]).is_le() { a[i] } else { b[j] };
        while i < a.len() && a[i].total_cmp(&value).is_le() {
            i += 1;
        }
        while j < b.len() && b[j].total_cmp(&value).is_le() {
            j += 1;
        }
        worst = worst.max((i as f64 / a.len() as f64 - j as f64 / b.len() as f64).abs());
    }
    worst as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_of_the_sample() {
        let d = Distribution::of((1..=11).rev().map(|i| i as f32).chain([f32::NAN]).collect());
        assert_eq!((d.count, d.min, d.low, d.median, d.high, d.max), (11, 1.0, 2.0, 6.0, 10.0, 11.0));
        assert_eq!(Distribution::of(Vec::new()).count, 0);
    }

    #[test]
    fn distance_is_the_largest_gap_between_cumulative_shares() {
        assert_eq!(distribution_distance(&[1.0, 2.0, 3.0, 4.0], &[4.0, 2.0, 1.0, 3.0]), 0.0);
        assert_eq!(distribution_distance(&[1.0, 2.0], &[3.0, 4.0]), 1.0);
        assert_eq!(distribution_distance(&[1.0, 1.0, 3.0, 3.0], &[1.0, 2.0, 3.0, 3.0]), 0.25);
        assert_eq!(distribution_distance(&[], &[1.0]), 1.0);
        assert_eq!(distribution_distance(&[], &[]), 0.0);
    }
}
