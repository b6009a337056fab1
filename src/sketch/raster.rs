//! Regions as cells of a grid: what points cover, distances, closing, and the outline back as a polygon.
//!
//! Distances are exact (Felzenszwalb and Huttenlocher 2012), outlines are contours of a distance (marching squares), so that
//! they lie between cells.

use glam::Vec2;

use super::region::Region;

/// Where the cells of a grid lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    /// Lower left corner.
    pub(super) origin: Vec2,
    /// Edge of a cell.
    pub(super) cell: f32,
    /// Cells in a row.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
}

impl Grid {
    /// A grid over a box with a margin, about `cells` along its longest edge.
    pub(super) fn over([low, high]: [Vec2; 2], cells: usize, margin: f32) -> Self {
        let (low, high) = (low - margin, high + margin);
        let size = (high - low).max(Vec2::splat(1e-6));
        let cell = size.max_element() / cells.max(4) as f32;
        let count = |edge: f32| ((edge / cell).ceil() as usize).clamp(2, cells.max(4) + 1);
        Self { origin: low, cell, width: count(size.x), height: count(size.y) }
    }

    /// The middle of a cell.
    pub(super) fn middle(&self, x: usize, y: usize) -> Vec2 {
        self.origin + Vec2::new(x as f32 + 0.5, y as f32 + 0.5) * self.cell
    }

    /// The cell that holds a place, or the nearest.
    pub(super) fn cell_of(&self, p: Vec2) -> (usize, usize) {
        let at = ((p - self.origin) / self.cell).floor();
        let within = |v: f32, count: usize| v.clamp(0.0, (count - 1) as f32) as usize;
        (within(at.x, self.width), within(at.y, self.height))
    }

    /// How many cells.
    pub(super) fn len(&self) -> usize {
        self.width * self.height
    }
}

/// Cells that are inside.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mask {
    /// Where.
    pub(super) grid: Grid,
    /// Row after row from below.
    pub(super) inside: Vec<bool>,
}

impl Mask {
    /// The cells whose middles lie in a region.
    pub(super) fn of_region(region: &Region, grid: Grid) -> Self {
        let mut crossings: Vec<Vec<f32>> = vec![Vec::new(); grid.height];
        for ring in region.rings() {
            for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
                let row =
                    |y: f32| ((y - grid.origin.y) / grid.cell - 0.5).ceil().clamp(0.0, grid.height as f32) as usize;
                for (r, at) in crossings.iter_mut().enumerate().take(row(high.y)).skip(row(low.y)) {
                    let y = grid.origin.y + (r as f32 + 0.5) * grid.cell;
                    at.push(low.x + (high.x - low.x) * ((y - low.y) / (high.y - low.y)));
                }
            }
        }
        let mut inside = vec![false; grid.len()];
        for (r, mut at) in crossings.into_iter().enumerate() {
            at.sort_by(f32::total_cmp);
            for pair in at.chunks_exact(2) {
                let column =
                    |x: f32| ((x - grid.origin.x) / grid.cell - 0.5).ceil().clamp(0.0, grid.width as f32) as usize;
                inside[r * grid.width + column(pair[0])..r * grid.width + column(pair[1]).max(column(pair[0]))]
                    .fill(true);
            }
        }
        Self { grid, inside }
    }

    /// What discs cover, closed over gaps narrower than twice `close`.
    pub(super) fn of_discs(discs: &[(Vec2, f32)], grid: Grid, close: f32) -> (Self, Vec<f32>) {
        let mut covered = vec![false; grid.len()];
        for &(p, radius) in discs.iter().filter(|d| d.0.is_finite()) {
            let (x0, y0) = grid.cell_of(p - radius);
            let (x1, y1) = grid.cell_of(p + radius);
            for y in y0..=y1 {
                for x in x0..=x1 {
                    covered[y * grid.width + x] |= grid.middle(x, y).distance_squared(p) <= radius * radius;
                }
            }
            let (x, y) = grid.cell_of(p);
            covered[y * grid.width + x] = true;
        }
        let close = (close / grid.cell).max(0.5);
        let near = distances(&covered, grid);
        let outside: Vec<bool> = near.iter().map(|d| *d > close).collect();
        let depth: Vec<f32> = distances(&outside, grid).iter().map(|d| d - close).collect();
        (Self { grid, inside: depth.iter().map(|d| *d > 0.0).collect() }, depth)
    }

    /// How many cells are inside.
    pub(super) fn count(&self) -> usize {
        self.inside.iter().filter(|i| **i).count()
    }

    /// Whether the cell at a place is inside.
    pub(super) fn holds(&self, p: Vec2) -> bool {
        let (x, y) = self.grid.cell_of(p);
        self.inside[y * self.grid.width + x]
    }

    #[cfg(test)]
    /// Cells of both over cells of either, 0..=1; masks of one grid.
    pub(super) fn overlap(&self, other: &Self) -> f32 {
        let (mut both, mut either) = (0_u32, 0_u32);
        for (a, b) in self.inside.iter().zip(&other.inside) {
            both += u32::from(*a && *b);
            either += u32::from(*a || *b);
        }
        if either == 0 { 0.0 } else { both as f32 / either as f32 }
    }

    /// From the middle of each cell to that of the nearest outside, in cells.
    pub(super) fn depths(&self) -> Vec<f32> {
        let outside: Vec<bool> = self.inside.iter().map(|i| !i).collect();
        distances(&outside, self.grid)
    }

    /// For each cell the nearest one inside; none where there is none.
    pub(super) fn nearest_inside(&self) -> Option<Vec<u32>> {
        self.inside.contains(&true).then(|| nearest(&self.inside, self.grid).1)
    }
}

/// Distance from each cell's middle to that of the nearest set one, in cells; far where none is set.
fn distances(set: &[bool], grid: Grid) -> Vec<f32> {
    let mut squares = nearest(set, grid).0;
    // What lies beyond the grid is outside as well.
    squares.iter_mut().for_each(|s| *s = s.sqrt());
    squares
}

const FAR: f32 = 1e12;

/// Squared distance to the nearest set cell, and which it is.
fn nearest(set: &[bool], grid: Grid) -> (Vec<f32>, Vec<u32>) {
    let (w, h) = (grid.width, grid.height);
    // Along columns first: the nearest set cell of the column.
    let mut square = vec![FAR; w * h];
    let mut which = vec![0_u32; w * h];
    for x in 0..w {
        for order in 0..2 {
            let mut last: Option<usize> = None;
            for k in 0..h {
                let y = if order == 0 { k } else { h - 1 - k };
                let i = y * w + x;
                if set[i] {
                    last = Some(y);
                }
                if let Some(from) = last {
                    let d = y.abs_diff(from) as f32;
                    if d * d < square[i] {
                        (square[i], which[i]) = (d * d, (from * w + x) as u32);
                    }
                }
            }
        }
    }
    // Then the lower envelope of the parabolas of each row.
    let (mut out, mut from) = (square.clone(), which.clone());
    let (mut at, mut start) = (vec![0_usize; w], vec![0.0_f32; w + 1]);
    for y in 0..h {
        let row = &square[y * w..][..w];
        let mut k = 0;
        (at[0], start[0], start[1]) = (0, f32::NEG_INFINITY, f32::INFINITY);
        for q in 1..w {
            let meet = |v: usize| {
                let (qf, vf) = (q as f32, v as f32);
                ((row[q] + qf * qf) - (row[v] + vf * vf)) / (2.0 * (qf - vf))
            };
            let mut s = meet(at[k]);
            while k > 0 && s <= start[k] {
                k -= 1;
                s = meet(at[k]);
            }
            k += 1;
            (at[k], start[k], start[k + 1]) = (q, s, f32::INFINITY);
        }
        let mut k = 0;
        for x in 0..w {
            while start[k + 1] < x as f32 {
                k += 1;
            }
            let d = x as f32 - at[k] as f32;
            out[y * w + x] = (d * d + row[at[k]]).min(FAR);
            from[y * w + x] = which[y * w + at[k]];
        }
    }
    (out, from)
}

/// The rings where a value given at the middles of cells crosses zero, positive on their left; beyond the grid it is negative.
pub(super) fn contours(values: &[f32], grid: Grid) -> Vec<Vec<Vec2>> {
    let (w, h) = (grid.width as isize, grid.height as isize);
    let value = |x: isize, y: isize| {
        if x < 0 || y < 0 || x >= w || y >= h { -0.5 } else { values[(y * w + x) as usize] }
    };
    // A crossing lies on the edge from a cell to its right or upper neighbour: (2 · cell + direction).
    let wide = (w + 2) as usize;
    let edge = |x: isize, y: isize, up: usize| (((y + 1) as usize * wide + (x + 1) as usize) << 1) | up;
    let place = |e: usize| {
        let cell = e >> 1;
        let (x, y) = ((cell % wide) as isize - 1, (cell / wide) as isize - 1);
        let (nx, ny) = if e & 1 == 1 { (x, y + 1) } else { (x + 1, y) };
        let (a, b) = (value(x, y), value(nx, ny));
        let t = if a == b { 0.5 } else { (a / (a - b)).clamp(0.0, 1.0) };
        let (p, q) = (Vec2::new(x as f32, y as f32), Vec2::new(nx as f32, ny as f32));
        grid.origin + (p.lerp(q, t) + 0.5) * grid.cell
    };
    let mut next = vec![usize::MAX; (wide * (h + 2) as usize) << 1];
    let mut order = Vec::new();
    for y in -1..h {
        for x in -1..w {
            let corners = [value(x, y), value(x + 1, y), value(x + 1, y + 1), value(x, y + 1)].map(|v| v > 0.0);
            // The four edges of the square, counter-clockwise from below.
            let edges = [edge(x, y, 0), edge(x + 1, y, 1), edge(x, y + 1, 0), edge(x, y, 1)];
            let mut ends = Vec::new();
            for k in 0..4 {
                let (a, b) = (corners[k], corners[(k + 1) % 4]);
                if a != b {
                    // Walking counter-clockwise, the ring leaves where inside ends and comes in where it begins.
                    ends.push((edges[k], a));
                }
            }
            // Inside lies left of the way from where the square's rim leaves it to where that enters it: pair neighbours.
            for k in 0..ends.len() {
                let (from, leaves) = ends[k];
                if leaves {
                    let to = ends[(k + ends.len() - 1) % ends.len()].0;
                    next[from] = to;
                    order.push(from);
                }
            }
        }
    }
    let mut rings = Vec::new();
    for start in order {
        let mut ring = Vec::new();
        let mut e = start;
        while next[e] != usize::MAX {
            ring.push(place(e));
            e = std::mem::replace(&mut next[e], usize::MAX);
        }
        if ring.len() > 2 {
            rings.push(ring);
        }
    }
    rings
}

#[cfg(test)]
mod tests {
    use super::super::region::{Fill, twice_signed_area};
    use super::*;
    use crate::base::Seed;

    #[test]
    fn distances_are_those_to_the_nearest_cell() {
        let grid = Grid { origin: Vec2::ZERO, cell: 1.0, width: 23, height: 17 };
        for seed in 0..20 {
            let set: Vec<bool> = (0..grid.len() as u64).map(|i| Seed::new(seed).at(i).unit() < 0.03).collect();
            let found = distances(&set, grid);
            for (i, d) in found.iter().enumerate().filter(|_| set.contains(&true)) {
                let best = (0..grid.len())
                    .filter(|&j| set[j])
                    .map(|j| grid.middle(i % 23, i / 23).distance(grid.middle(j % 23, j / 23)));
                assert!((best.fold(f32::INFINITY, f32::min) - d).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_disc_is_outlined_and_comes_back() {
        let grid = Grid::over([Vec2::splat(-1.0), Vec2::ONE], 100, 0.2);
        let (mask, depth) = Mask::of_discs(&[(Vec2::ZERO, 1.0)], grid, 0.05);
        let rings = contours(&depth, grid);
        assert_eq!(rings.len(), 1);
        let area = twice_signed_area(&rings[0]) * 0.5;
        assert!((area - std::f64::consts::PI).abs() < 0.15, "{area}");
        let back = Mask::of_region(&Region::of(&rings, Fill::NonZero), grid);
        assert!(back.overlap(&mask) > 0.97);
    }

    #[test]
    fn holes_are_rings_of_their_own_the_other_way() {
        let grid = Grid { origin: Vec2::ZERO, cell: 1.0, width: 9, height: 9 };
        let values: Vec<f32> = (0..81)
            .map(|i| {
                let (x, y): (i32, i32) = (i % 9 - 4, i / 9 - 4);
                if (2..=3).contains(&x.abs().max(y.abs())) { 0.5 } else { -0.5 }
            })
            .collect();
        let mut areas: Vec<f64> = contours(&values, grid).iter().map(|r| twice_signed_area(r) * 0.5).collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas.len(), 2);
        assert!(areas[0] < -5.0 && areas[1] > 40.0, "{areas:?}");
    }
}
