//! How much of each pixel of a row a polygon covers.
//!
//! Every row is cut into four lines; on each, the polygon's spans (non-zero winding) are found and their part of every
//! pixel is exact along x. Cost: the polygon's edges plus the pixels that it covers, for each line.

use glam::Vec2;

/// Lines a row is cut into.
const LINES: usize = 4;

/// Adds the polygon's coverage, 0..=1, of the pixels of row `y` to `out`, whose index 0 is the pixel `x` = 0; gives back
/// the range of pixels that were touched. The polygon is closed, in pixels, y down. `crossings` is scratch space.
pub(super) fn cover_row(
    polygon: &[Vec2],
    y: u32,
    out: &mut [f32],
    crossings: &mut Vec<(f32, i32)>,
) -> std::ops::Range<usize> {
    let (mut first, mut last) = (out.len(), 0);
    for line in 0..LINES {
        let at = y as f32 + (line as f32 + 0.5) / LINES as f32;
        crossings.clear();
        let mut a = match polygon.last() {
            Some(&p) => p,
            None => return 0..0,
        };
        for &b in polygon {
            if (a.y <= at) != (b.y <= at) {
                let x = a.x + (b.x - a.x) * ((at - a.y) / (b.y - a.y));
                crossings.push((x, if a.y < b.y { 1 } else { -1 }));
            }
            a = b;
        }
        crossings.sort_unstable_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        let mut winding = 0;
        let mut start = 0.0;
        for &(x, turn) in crossings.iter() {
            if winding == 0 {
                start = x;
            }
            winding += turn;
            if winding == 0 {
                let (from, to) = (start.clamp(0.0, out.len() as f32), x.clamp(0.0, out.len() as f32));
                if to > from {
                    let (p, q) = (from as usize, (to.ceil() as usize).min(out.len()));
                    for (i, value) in out[p..q].iter_mut().enumerate() {
                        let left = (p + i) as f32;
                        *value += (to.min(left + 1.0) - from.max(left)) * (1.0 / LINES as f32);
                    }
                    first = first.min(p);
                    last = last.max(q);
                }
            }
        }
    }
    if first < last { first..last } else { 0..0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_covers_exactly_its_area() {
        let square = [Vec2::new(0.25, 0.0), Vec2::new(2.5, 0.0), Vec2::new(2.5, 1.0), Vec2::new(0.25, 1.0)];
        let mut row = [0.0; 4];
        let touched = cover_row(&square, 0, &mut row, &mut Vec::new());
        assert_eq!(row, [0.75, 1.0, 0.5, 0.0]);
        assert_eq!(touched, 0..3);
    }

    #[test]
    fn winding_either_way_and_twice_covers_once() {
        let ring = [Vec2::new(0.0, 0.0), Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0)];
        let twice: Vec<Vec2> = ring.iter().chain(&ring).copied().collect();
        let mut row = [0.0; 2];
        cover_row(&twice, 0, &mut row, &mut Vec::new());
        assert_eq!(row, [1.0, 0.0]);
    }

    #[test]
    fn what_lies_outside_the_row_is_cut_off() {
        let wide = [Vec2::new(-9.0, -3.0), Vec2::new(50.0, -3.0), Vec2::new(50.0, 9.0), Vec2::new(-9.0, 9.0)];
        let mut row = [0.0; 3];
        assert_eq!(cover_row(&wide, 2, &mut row, &mut Vec::new()), 0..3);
        assert_eq!(row, [1.0; 3]);
        assert_eq!(cover_row(&[], 2, &mut row, &mut Vec::new()), 0..0);
    }
}
