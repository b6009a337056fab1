//! Skyline bottom-left packing of rectangles into a strip (Jylänki 2010, "A Thousand Ways to Pack the Bin", section 2.4).
//!
//! Own instead of the crate `etagere`: shelves lose the space above lower tiles, and here all sizes are known
//! beforehand. Cost is rectangles × steps of the skyline; the steps are at most the strip's width over the alignment.

/// Places rectangles of the sizes given (width, height), in the order of `order`, into a square of `size`. The corner of
/// each, or none when they do not fit.
pub(super) fn place(sizes: &[(u32, u32)], order: &[usize], size: u32) -> Option<Vec<(u32, u32)>> {
    let mut corners = vec![(0, 0); sizes.len()];
    // Steps from left to right: where each begins and how high the strip is filled there.
    let mut steps: Vec<(u32, u32)> = vec![(0, 0)];
    for &i in order {
        let (width, height) = sizes[i];
        if width > size || height > size {
            return None;
        }
        // Lowest top first, then leftmost.
        let mut best: Option<(u32, u32, usize)> = None;
        for first in 0..steps.len() {
            let x = steps[first].0;
            if x > size - width {
                break;
            }
            let floor = steps[first..].iter().take_while(|s| s.0 < x + width).map(|s| s.1).max().unwrap_or(0);
            if floor <= size - height && best.is_none_or(|(y, ..)| floor < y) {
                best = Some((floor, x, first));
            }
        }
        let (y, x, first) = best?;
        corners[i] = (x, y);
        let right = x + width;
        let after = first + steps[first..].iter().take_while(|s| s.0 < right).count();
        let last_floor = steps[after - 1].1;
        let resumes = steps.get(after).map_or(size, |s| s.0) > right;
        let mut new = vec![(x, y + height)];
        if resumes {
            new.push((right, last_floor));
        }
        steps.splice(first..after, new);
        steps.dedup_by(|b, a| a.1 == b.1);
    }
    Some(corners)
}
