//! The outlines of what a picture shows: contours of its alpha by marching squares (Lorensen and Cline 1987, in the
//! plane), at half alpha, linear between pixels.
//!
//! Outer outlines only: what lies in a hole is left to the alpha itself. Two corners of a cell that touch diagonally are
//! taken apart. Linear in pixels.

use glam::Vec2;

/// Alpha at which a picture begins.
const LEVEL: f32 = 127.5;

/// The outlines of a picture of `width` × `height` alphas, largest first: in pixels, y down, clockwise to the eye, their
/// ends not repeated.
pub(super) fn contours(alpha: &[u8], width: usize, height: usize) -> Vec<Vec<Vec2>> {
    if width == 0 || height == 0 || alpha.len() < width * height {
        return Vec::new();
    }
    // A frame of nothing closes every outline.
    let at = |x: usize, y: usize| {
        if x == 0 || y == 0 || x > width || y > height { 0.0 } else { f32::from(alpha[(y - 1) * width + x - 1]) }
    };
    let columns = width + 2;
    // Crossings: of the edge to the right of a grid point, then of the edge below it.
    let right = |x: usize, y: usize| y * columns + x;
    let count = columns * (height + 2);
    let below = |x: usize, y: usize| count + y * columns + x;
    let mut next = vec![u32::MAX; 2 * count];
    for y in 0..=height {
        for x in 0..=width {
            let corners = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            let case = corners.iter().enumerate().fold(0, |case, (i, a)| case | usize::from(*a > LEVEL) << i);
            let [top, east, bottom, west] = [right(x, y), below(x + 1, y), right(x, y + 1), below(x, y)];
            // What is inside lies to the right.
            let steps: &[(usize, usize)] = match case {
                1 => &[(top, west)],
                2 => &[(east, top)],
                3 => &[(east, west)],
                4 => &[(bottom, east)],
                5 => &[(top, west), (bottom, east)],
                6 => &[(bottom, top)],
                7 => &[(bottom, west)],
                8 => &[(west, bottom)],
                9 => &[(top, bottom)],
                10 => &[(east, top), (west, bottom)],
                11 => &[(east, bottom)],
                12 => &[(west, east)],
                13 => &[(top, east)],
                14 => &[(west, top)],
                _ => &[],
            };
            steps.iter().for_each(|&(from, to)| next[from] = to as u32);
        }
    }
    let point = |edge: usize| {
        let (edge, down) = if edge < count { (edge, false) } else { (edge - count, true) };
        let (x, y) = (edge % columns, edge / columns);
        let (a, b) = (at(x, y), if down { at(x, y + 1) } else { at(x + 1, y) });
        let f = ((LEVEL - a) / (b - a)).clamp(0.0, 1.0);
        let corner = Vec2::new(x as f32 - 0.5, y as f32 - 0.5);
        corner + if down { Vec2::new(0.0, f) } else { Vec2::new(f, 0.0) }
    };
    let mut loops: Vec<(f32, Vec<Vec2>)> = Vec::new();
    for start in 0..next.len() {
        let mut outline = Vec::new();
        let mut edge = start;
        while next[edge] != u32::MAX {
            outline.push(point(edge));
            edge = std::mem::replace(&mut next[edge], u32::MAX) as usize;
        }
        let size = area(&outline);
        if size > 0.0 {
            loops.push((size, outline));
        }
    }
    loops.sort_by(|a, b| b.0.total_cmp(&a.0));
    loops.into_iter().map(|l| l.1).collect()
}

/// The area of a closed polygon, above zero for one that runs clockwise to the eye (y down).
pub(super) fn area(polygon: &[Vec2]) -> f32 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>() * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_has_one_outline_of_its_area() {
        let alpha: Vec<u8> =
            (0..100).map(|i| if (2..8).contains(&(i % 10)) && (3..6).contains(&(i / 10)) { 255 } else { 0 }).collect();
        let found = contours(&alpha, 10, 10);
        assert_eq!(found.len(), 1);
        // Corners are cut.
        assert!((area(&found[0]) - 18.0).abs() < 0.6, "{}", area(&found[0]));
        assert!(found[0].iter().all(|p| (1.9..8.1).contains(&p.x) && (2.9..6.1).contains(&p.y)));
    }

    #[test]
    fn holes_are_no_outlines_and_what_touches_the_edge_is_closed() {
        let ring: Vec<u8> =
            (0..81).map(|i| if (3..6).contains(&(i % 9)) && (3..6).contains(&(i / 9)) { 0 } else { 255 }).collect();
        let found = contours(&ring, 9, 9);
        assert!(found.len() == 1 && (area(&found[0]) - 81.0).abs() < 1.0);
        assert!(contours(&[0; 16], 4, 4).is_empty() && contours(&[], 0, 0).is_empty());
        assert_eq!(contours(&[255], 1, 1).len(), 1);
    }

    #[test]
    fn blades_apart_are_outlines_apart_largest_first() {
        let alpha: Vec<u8> = (0..200).map(|i| if i % 20 < 5 || i % 20 > 16 { 255 } else { 0 }).collect();
        let found = contours(&alpha, 20, 10);
        assert!(found.len() == 2 && area(&found[0]) > area(&found[1]));
    }
}
