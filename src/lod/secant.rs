//! Search for the gain with which a level covers what the full tree does.
//!
//! Coverage follows the gain of alpha, or how far leaves and wood are enlarged, nearly in a line whose slope no two trees share:
//! cards hide each other. So steps are secants. Which texels are solid goes in steps: once a gain is too little and one too much, no step
//! leads out of the two.

use std::ops::RangeInclusive;

use crate::bake::Silhouette;

/// Gains nearer to each other say nothing of the slope.
const APART: f32 = 1e-3;

/// A search as far as it has come.
#[derive(Clone, Debug)]
pub(super) struct Secant {
    /// By how much what is covered grows with the gain.
    slope: f32,
    slopes: RangeInclusive<f32>,
    gains: RangeInclusive<f32>,
    before: Option<(f32, f32)>,
    /// The nearest gains that are too little and too much, and by how much.
    ends: [Option<(f32, f32)>; 2],
}

impl Secant {
    /// With the slope that is taken at first, those that are believed, and the gains that may be.
    pub(super) const fn new(slope: f32, slopes: RangeInclusive<f32>, gains: RangeInclusive<f32>) -> Self {
        Self { slope, slopes, gains, before: None, ends: [None; 2] }
    }

    /// The gain to try after one with which so much more is covered than should be, as a share.
    pub(super) fn next(&mut self, gain: f32, off: f32) -> f32 {
        self.ends[usize::from(off > 0.0)] = Some((gain, off));
        let other = self.ends[usize::from(off <= 0.0)].or(self.before);
        if let Some((g, o)) = other.filter(|other| (gain - other.0).abs() > APART) {
            self.slope = within(&self.slopes, (off - o) / (gain - g));
        }
        self.before = Some((gain, off));
        let next = within(&self.gains, gain - off / self.slope);
        match self.ends.map(|end| end.map(|end| end.0)) {
            [Some(a), Some(b)] if next <= a.min(b) || next >= a.max(b) => (a + b) * 0.5,
            _ => next,
        }
    }

    /// From a gain on, `make`s a level until it covers what the full tree does but for `near`: by what `some` of the views tell
    /// until those say it does, and then by all of them. Gives back the level that did best by all views, and its outlines.
    pub(super) fn settle<T>(
        mut self,
        mut gain: f32,
        (rounds, near): (usize, f32),
        mut make: impl FnMut(f32) -> T,
        some: impl Fn(&T) -> f32,
        all: impl Fn(&T) -> (f32, Vec<Silhouette>),
    ) -> (T, Vec<Silhouette>) {
        // The least that was off as far as is known, and at which gain; of levels that were looked at from all sides what there is.
        let mut least = (f32::INFINITY, gain);
        let mut best: Option<(f32, T, Vec<Silhouette>)> = None;
        // By how much more is covered than some views say.
        let mut unseen = 0.0;
        for _ in 1..rounds {
            let made = make(gain);
            let rough = some(&made);
            let mut off = rough + unseen;
            if off.abs() < near {
                let (seen, drawn) = all(&made);
                (off, unseen) = (seen, seen - rough);
                if off.abs() < near {
                    return (made, drawn);
                }
                if best.as_ref().is_none_or(|best| off.abs() < best.0) {
                    best = Some((off.abs(), made, drawn));
                }
            }
            if off.abs() < least.0 {
                least = (off.abs(), gain);
            }
            let next = self.next(gain, off);
            if next == gain {
                break;
            }
            gain = next;
        }
        let mut made = make(gain);
        if (some(&made) + unseen).abs() > least.0 {
            made = make(least.1);
        }
        let (off, drawn) = all(&made);
        best.filter(|best| best.0 <= off.abs()).map_or((made, drawn), |(_, made, drawn)| (made, drawn))
    }
}

fn within(range: &RangeInclusive<f32>, value: f32) -> f32 {
    value.clamp(*range.start(), *range.end())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search() -> Secant {
        Secant::new(0.5, 0.1..=2.0, 0.3..=4.0)
    }

    /// Where it ends and how many levels were made, of coverage by gain; some of the views say so much more.
    fn found(coverage: impl Fn(f32) -> f32, some: f32) -> (f32, usize) {
        let mut made = 0;
        let make = |gain: f32| {
            made += 1;
            gain
        };
        let off = |gain: &f32| coverage(*gain) - 1.0;
        let (gain, _) = search().settle(1.0, (9, 0.01), make, |gain| off(gain) + some, |gain| (off(gain), Vec::new()));
        (gain, made)
    }

    #[test]
    fn a_line_is_found_at_once_and_a_bend_soon() {
        let (gain, made) = found(|gain| 0.6 + 0.8 * gain, 0.0);
        assert!((gain - 0.5).abs() < 0.02 && made <= 3, "{gain} {made}");
        let (gain, made) = found(|gain| 1.4 * gain.sqrt(), 0.05);
        assert!((1.4 * gain.sqrt() - 1.0).abs() < 0.01 && made <= 7, "{gain} {made}");
    }

    #[test]
    fn steps_stay_between_too_little_and_too_much() {
        // It jumps at 0.7, and nothing between covers as much as it should.
        let mut search = search();
        let (mut gain, mut low, mut high) = (1.0, 0.0_f32, 5.0_f32);
        for _ in 0..9 {
            let too_little = gain < 0.7;
            if too_little {
                low = low.max(gain);
            } else {
                high = high.min(gain);
            }
            gain = search.next(gain, if too_little { -0.2 } else { 0.1 });
            assert!(gain > low && gain < high, "{gain} of {low} to {high}");
        }
        assert!(high - low < 0.1, "{low} to {high}");
    }

    #[test]
    fn what_never_covers_enough_ends_at_once_at_the_largest_gain() {
        let (gain, made) = found(|gain| 0.2 + 0.01 * gain, 0.0);
        assert!(gain == 4.0 && made <= 4, "{gain} {made}");
    }

    #[test]
    fn where_nothing_is_near_enough_the_nearest_that_was_tried_is_taken() {
        // A little too little up to a gain, and far too much from there on: wherever that is, the last one that is tried may be either.
        for jump in (1..=12).map(|i| 1.0 + 0.013 * i as f32) {
            let (gain, _) = found(|gain| if gain < jump { 0.98 } else { 1.08 }, 0.0);
            assert!(gain < jump, "{gain} of {jump}");
        }
    }
}
