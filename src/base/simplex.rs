//! Even spreads over the weights of several things.

use super::math;

/// The `index`-th point of an even spread over the weights of `sources` sources: non-negative, adding up to 1. The
/// first points stay where they are however many are taken.
///
/// Points of Roberts's R sequence (2018, "The unreasonable effectiveness of quasirandom sequences") in `sources − 1`
/// dimensions; the gaps between a point's sorted coordinates are uniform on the simplex when the point is in the cube.
#[must_use]
pub fn simplex_point(sources: usize, index: u64) -> Vec<f32> {
    let dimensions = sources.saturating_sub(1);
    // The root of x^(d+1) = x + 1.
    let mut root = 2.0_f64;
    for _ in 0..40 {
        root = math::pow64(1.0 + root, 1.0 / (dimensions as f64 + 1.0));
    }
    let mut cuts = Vec::with_capacity(sources);
    let mut step = 1.0_f64;
    for _ in 0..dimensions {
        step /= root;
        // Whole turns first, so that large indices lose no digits.
        cuts.push((0.5 + step * (index as f64 + 1.0)).fract());
    }
    cuts.sort_by(f64::total_cmp);
    cuts.push(1.0);
    let mut last = 0.0;
    cuts.iter()
        .map(|cut| {
            let gap = cut - last;
            last = *cut;
            gap as f32
        })
        .collect()
}
