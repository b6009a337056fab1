//! Rising piecewise linear maps of 0..=1 onto itself: how parameters of one curve run along another.

/// Knots `(from, to)`, both never falling, from `(0, 0)` to `(1, 1)`.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::relate) struct Monotone {
    knots: Vec<(f64, f64)>,
}

impl Monotone {
    /// The map through some knots.
    pub(super) fn new(knots: Vec<(f64, f64)>) -> Self {
        debug_assert!(knots.windows(2).all(|w| w[0].0 <= w[1].0 && w[0].1 <= w[1].1));
        Self { knots }
    }

    pub(super) fn knots(&self) -> &[(f64, f64)] {
        &self.knots
    }

    /// The inverse.
    pub(super) fn inverse(&self) -> Self {
        Self { knots: self.knots.iter().map(|&(a, b)| (b, a)).collect() }
    }

    /// The value at `x`.
    pub(in crate::relate) fn at(&self, x: f64) -> f64 {
        interpolated(&self.knots, x, |k| k)
    }

    /// Where the value is `y`: what the inverse has there.
    pub(in crate::relate) fn back(&self, y: f64) -> f64 {
        interpolated(&self.knots, y, |(from, to)| (to, from))
    }

    /// The same map bent to pass through anchors, strictly rising in `from`, never falling in `to`, between the ends.
    pub(super) fn through(&self, anchors: &[(f64, f64)]) -> Self {
        if anchors.is_empty() {
            return self.clone();
        }
        let mut knots = vec![(0.0, 0.0)];
        let mut low = (0.0, 0.0);
        for &high in anchors.iter().chain(&[(1.0, 1.0)]) {
            let (from, to) = (self.at(low.0), self.at(high.0));
            let span = to - from;
            for &(x, y) in self.knots.iter().filter(|k| k.0 > low.0 && k.0 < high.0) {
                let share = if span > 1e-9 { (y - from) / span } else { (x - low.0) / (high.0 - low.0) };
                knots.push((x, low.1 + (high.1 - low.1) * share.clamp(0.0, 1.0)));
            }
            if high.0 > low.0 {
                knots.push(high);
            }
            low = high;
        }
        Self { knots }
    }

    /// Fewer knots, at most `tolerance` off.
    pub(super) fn simplified(&self, tolerance: f64) -> Self {
        let mut keep = vec![false; self.knots.len()];
        let last = self.knots.len() - 1;
        (keep[0], keep[last]) = (true, true);
        let mut spans = vec![(0, last)];
        while let Some((a, b)) = spans.pop() {
            let ends = [self.knots[a], self.knots[b]];
            let off = |i: usize| (self.knots[i].1 - interpolated(&ends, self.knots[i].0, |k| k)).abs();
            let Some(worst) = (a + 1..b).max_by(|&i, &j| off(i).total_cmp(&off(j))) else { continue };
            if off(worst) > tolerance {
                keep[worst] = true;
                spans.push((a, worst));
                spans.push((worst, b));
            }
        }
        Self { knots: self.knots.iter().zip(keep).filter(|(_, keep)| *keep).map(|(k, _)| *k).collect() }
    }
}

/// The value at `x` of the line through knots, each as `read`; the lower one where several share it.
fn interpolated(knots: &[(f64, f64)], x: f64, read: impl Fn((f64, f64)) -> (f64, f64)) -> f64 {
    let next = knots.partition_point(|&k| read(k).0 < x);
    if next == 0 {
        return read(knots[0]).1;
    }
    if next == knots.len() {
        return read(knots[next - 1]).1;
    }
    let (low, high) = (read(knots[next - 1]), read(knots[next]));
    let span = high.0 - low.0;
    if span > 0.0 { low.1 + (high.1 - low.1) * ((x - low.0) / span) } else { low.1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_compose_bend_and_invert() {
        let map = Monotone::new(vec![(0.0, 0.0), (0.5, 0.2), (1.0, 1.0)]);
        assert!((map.inverse().at(map.at(0.3)) - 0.3).abs() < 1e-12);
        assert_eq!(map.back(0.1), map.inverse().at(0.1));
        let bent = map.through(&[(0.4, 0.4), (0.8, 0.45)]);
        assert_eq!((bent.at(0.4), bent.at(0.8), bent.at(1.0)), (0.4, 0.45, 1.0));
        assert!(bent.knots().windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 <= w[1].1));
        assert_eq!(map.through(&[]), map);
    }

    #[test]
    fn a_simplified_map_is_near() {
        let knots = (0..=50).map(|i| f64::from(i) / 50.0).map(|x| (x, x * x)).collect();
        let map = Monotone::new(knots);
        let less = map.simplified(0.01);
        assert!(less.knots().len() < 10);
        assert!((0..=50).all(|i| (less.at(f64::from(i) / 50.0) - map.at(f64::from(i) / 50.0)).abs() <= 0.01));
    }
}
