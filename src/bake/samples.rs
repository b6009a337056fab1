//! Where triangles lie among the samples of a picture: projection, snapping, boxes and the runs of rows within them.
//!
//! Vertices are snapped to 1/256 of a sample. An edge is followed from row to row in whole numbers, from its upper end or
//! the first row that is asked for, the same way for the triangles on both sides of it: they neither overlap nor leave a
//! gap. Most triangles of a tree cover a row or two, and then an edge or two are all that is looked at.

use std::ops::{Add, Mul, Range, Sub};

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::raster::View;
use crate::mesh::Mesh;

/// Snapping: units a sample.
pub(super) const SUBSAMPLE: f32 = 256.0;
/// Farthest snapped coordinate that is drawn; keeps products of edges within 64 bits.
const FARTHEST: f32 = 200_000.0 * SUBSAMPLE;
/// Samples of a picture that one task fills.
pub(super) const SMALL: usize = 1 << 16;
/// First and last column, first and last row.
pub(super) type Extent = ((usize, usize), (usize, usize));

/// A projected vertex, in 1/256 samples; `x` is `i32::MIN` where it can't be drawn.
#[derive(Clone, Copy)]
pub(super) struct Point {
    pub(super) x: i32,
    pub(super) y: i32,
    pub(super) depth: f32,
}

impl Point {
    const NOWHERE: Self = Self { x: i32::MIN, y: 0, depth: 0.0 };
}

/// Samples of a picture.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// Where a mesh's vertices lie in a picture.
struct Projection {
    /// Units a metre, to the right and down.
    across: Vec3,
    down: Vec3,
    towards: Vec3,
    /// Of the world's origin: units, and metres before the view's middle.
    origin: Vec3,
}

impl Projection {
    fn new(view: &View, grid: Grid) -> Self {
        let middle = Vec2::new(grid.columns as f32, grid.rows as f32) * (0.5 * SUBSAMPLE);
        let scale = middle / Vec2::new(view.half_width, view.half_height);
        let (across, down, towards) = (view.frame.x * scale.x, view.frame.y * -scale.y, view.frame.z);
        let off = Vec3::new(across.dot(view.centre), down.dot(view.centre), towards.dot(view.centre));
        Self { across, down, towards, origin: middle.extend(0.0) - off }
    }

    #[inline]
    fn point(&self, p: Vec3) -> Point {
        let (x, y) = (self.across.dot(p) + self.origin.x, self.down.dot(p) + self.origin.y);
        let depth = self.towards.dot(p) + self.origin.z;
        // Written so that NaN fails it.
        if x.abs() < FARTHEST && y.abs() < FARTHEST && depth.is_finite() {
            Point { x: round(x), y: round(y), depth }
        } else {
            Point::NOWHERE
        }
    }
}

/// `(v + 0.5).floor()` of what is within [`FARTHEST`]: baselines of x86 have no instruction for it. To this sum floats of 64 bits
/// are whole numbers, which their lower bits hold; a little less than a half is taken off before it is rounded to the nearest. Floats
/// of 32 bits that are less than a whole number once a half is added to them are so by 2^-26 at least.
#[inline]
fn round(v: f32) -> i32 {
    const WHOLE: f64 = ((1_u64 << 52) + (1_u64 << 51)) as f64;
    const HALF: f64 = 0.5 - 1.0 / (1_u64 << 27) as f64;
    (f64::from(v + 0.5) - HALF + WHOLE).to_bits() as i32
}

pub(super) fn project(mesh: &Mesh, view: &View, grid: Grid) -> Vec<Point> {
    let projection = Projection::new(view, grid);
    if grid.columns * grid.rows <= SMALL {
        return mesh.positions.iter().map(|&p| projection.point(p)).collect();
    }
    mesh.positions.par_iter().with_min_len(4096).map(|&p| projection.point(p)).collect()
}

/// As [`project`], on this thread, into points that are used again.
pub(super) fn project_into(mesh: &Mesh, view: &View, grid: Grid, points: &mut Vec<Point>) {
    let projection = Projection::new(view, grid);
    points.clear();
    points.extend(mesh.positions.iter().map(|&p| projection.point(p)));
}

pub(super) fn corner_points<const N: usize>(points: &[Point], corners: [u32; N]) -> Option<[Point; N]> {
    let at = |i: u32| points.get(i as usize).copied().filter(|p| p.x != i32::MIN);
    let mut found = [Point::NOWHERE; N];
    for (found, corner) in found.iter_mut().zip(corners) {
        *found = at(corner)?;
    }
    Some(found)
}

/// First and last column and row of the samples whose centres the box around some corners holds.
#[inline]
pub(super) fn extent<const N: usize>(p: [Point; N], grid: Grid) -> Option<Extent> {
    let span = |of: [i32; N], size: usize| {
        let (low, high) = of.into_iter().fold((i32::MAX, i32::MIN), |(low, high), v| (low.min(v), high.max(v)));
        // A centre lies at 256 i + 128. Shifts round down.
        let (low, high) = (((low - 128 + 255) >> 8).max(0), ((high - 128) >> 8).min(size as i32 - 1));
        (low <= high).then_some((low as usize, high as usize))
    };
    Some((span(p.map(|p| p.x), grid.columns)?, span(p.map(|p| p.y), grid.rows)?))
}

/// Whether the triangle covers a sample.
pub(super) fn holds_any(p: [Point; 3], grid: Grid) -> bool {
    let mut any = false;
    scan(p, grid, 0..grid.rows, |_, _, _| any = true);
    any
}

/// Calls `put` with the row and the first and the end of the columns of each run of samples that a triangle covers within
/// some rows. Samples on an upper or left edge belong to it, those on a lower or right one don't.
#[inline]
pub(super) fn scan(p: [Point; 3], grid: Grid, rows: Range<usize>, put: impl FnMut(usize, usize, usize)) {
    if extent(p, grid).is_some() {
        scan_box(p, grid, rows, put);
    }
}

/// As [`scan`], of a triangle whose box is known to hold samples.
#[inline]
pub(super) fn scan_box(p: [Point; 3], grid: Grid, rows: Range<usize>, mut put: impl FnMut(usize, usize, usize)) {
    let [top, middle, bottom] = by_height(p);
    let (first, turn, end) = (row_from(top.y, &rows), row_from(middle.y, &rows), row_from(bottom.y, &rows));
    // Where the middle corner lies of the edge between the others; negative on its right.
    let bulge = edge(top, bottom, middle.x, middle.y);
    if first == end || bulge == 0 {
        return;
    }
    let mut long = Side::new(top, bottom, first);
    for (from, to, rows) in [(top, middle, first..turn), (middle, bottom, turn..end)] {
        if rows.is_empty() {
            continue;
        }
        let mut short = Side::new(from, to, rows.start);
        for row in rows {
            let (a, b) = (grid.column(long.next()), grid.column(short.next()));
            let (left, right) = if bulge < 0 { (a, b) } else { (b, a) };
            if left < right {
                put(row, left, right);
            }
        }
    }
}

/// The first of some rows whose middle is not above a height.
#[inline]
pub(super) fn row_from(y: i32, rows: &Range<usize>) -> usize {
    ((y + 127) >> 8).clamp(rows.start as i32, rows.end as i32) as usize
}

/// Farthest that the corners of a [`Small`] triangle lie apart along an axis, units: products of edges are far below 2^31.
const SMALL_SPAN: i32 = 6 * SUBSAMPLE as i32;

/// A triangle or parallelogram of few samples, told by its edges at each of them: sides that are followed from row to row take
/// divisions, which cost more than a look at every sample of the box, and what corners have is mixed by the same edges.
pub(super) struct Small<const N: usize> {
    /// At the middle of the box's first sample, to the next column and to the next row: of the edge from each corner but one to
    /// the next, squared units, positive within.
    first: [i32; N],
    across: [i32; N],
    down: [i32; N],
    /// Least that a sample of it has: 0 for upper and left edges, which belong to it, else 1.
    least: [i32; N],
    /// Twice the area of its first three corners, squared units.
    area: i32,
    columns: (usize, usize),
    rows: (usize, usize),
}

impl<const N: usize> Small<N> {
    /// None for what is larger, or has no area, or has corners that don't all turn the same way.
    #[inline]
    pub(super) fn new(p: [Point; N], (columns, rows): Extent) -> Option<Self> {
        let span = |of: [i32; N]| {
            let (low, high) = of.into_iter().fold((i32::MAX, i32::MIN), |(low, high), v| (low.min(v), high.max(v)));
            high - low
        };
        if span(p.map(|p| p.x)) > SMALL_SPAN || span(p.map(|p| p.y)) > SMALL_SPAN {
            return None;
        }
        let turn = |k: usize| {
            let [a, b, c] = [p[k], p[(k + 1) % N], p[(k + 2) % N]];
            (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
        };
        let area = turn(0);
        let sign = area.signum();
        if area == 0 || N > 3 && (1..N).any(|k| turn(k).signum() != sign) {
            return None;
        }
        let (x, y) = ((columns.0 as i32) * 256 + 128, (rows.0 as i32) * 256 + 128);
        let (mut first, mut across, mut down, mut least) = ([0; N], [0; N], [0; N], [0; N]);
        for k in 0..N {
            let (from, to) = (p[(k + 1) % N], p[(k + 2) % N]);
            let (dx, dy) = ((to.x - from.x) * sign, (to.y - from.y) * sign);
            first[k] = dx * (y - from.y) - dy * (x - from.x);
            (across[k], down[k]) = (-dy * 256, dx * 256);
            least[k] = i32::from(!(dy < 0 || dy == 0 && dx > 0));
        }
        Some(Self { first, across, down, least, area: area.abs(), columns, rows })
    }

    /// Calls `put` with the row, the column and the weights of the first three corners, times the area, at each sample that it
    /// covers within some rows; beyond the line from the third to the first the second's is negative.
    #[inline]
    pub(super) fn each(&self, rows: Range<usize>, mut put: impl FnMut(usize, usize, [i32; 3])) {
        let rows = self.rows.0.max(rows.start)..(self.rows.1 + 1).min(rows.end);
        if rows.is_empty() {
            return;
        }
        // A few rows at most: no product overflows.
        let down = (rows.start - self.rows.0) as i32;
        let mut line: [i32; N] = std::array::from_fn(|k| self.first[k] + self.down[k] * down);
        for row in rows {
            let mut at = line;
            for column in self.columns.0..=self.columns.1 {
                if at.iter().zip(self.least).fold(0, |any, (at, least)| any | (at - least)) >= 0 {
                    let (a, c) = (at[0], at[N - 1]);
                    put(row, column, [a, self.area - a - c, c]);
                }
                at = std::array::from_fn(|k| at[k] + self.across[k]);
            }
            line = std::array::from_fn(|k| line[k] + self.down[k]);
        }
    }

    /// One over the sum of the weights.
    #[inline]
    pub(super) fn inverse(&self) -> f32 {
        1.0 / self.area as f32
    }
}

/// What three corners have, mixed by the weights of a [`Small`].
#[inline]
pub(super) fn mixed<V: Copy + Add<Output = V> + Mul<f32, Output = V>>([a, b, c]: [V; 3], at: [i32; 3]) -> V {
    a * at[0] as f32 + b * at[1] as f32 + c * at[2] as f32
}

/// Corners from the top down.
#[inline]
fn by_height([mut a, mut b, mut c]: [Point; 3]) -> [Point; 3] {
    if b.y < a.y {
        std::mem::swap(&mut a, &mut b);
    }
    if c.y < b.y {
        std::mem::swap(&mut b, &mut c);
    }
    if b.y < a.y {
        std::mem::swap(&mut a, &mut b);
    }
    [a, b, c]
}

/// By how little a [`Side`] may pass a sample that is then taken to lie on it, in units times 2^16: more than its rounding
/// comes to along a [`Small`] triangle, and less than half of one over the height of those, so that both find the same.
const TIE: i64 = 16;

/// An edge of a triangle, row by row: triangles on both sides of it have the same.
pub(super) struct Side {
    /// Where it crosses the middle of the row, in units times 2^16.
    x: i64,
    /// To the next row.
    step: i64,
}

impl Side {
    /// From the upper to the lower end, from the middle of `row` on.
    #[inline]
    pub(super) fn new(upper: Point, lower: Point, row: usize) -> Self {
        // Rows have the height of 256 units, and so has the lower end at least one below the upper.
        let slope = f64::from(lower.x - upper.x) / f64::from(lower.y - upper.y) * 65536.0;
        let down = row as i64 * 256 + 128 - i64::from(upper.y);
        let along = (slope * down as f64) as i64;
        // An edge without rows may have any slope, and nobody looks at it.
        Self { x: (i64::from(upper.x) << 16).wrapping_add(along), step: (slope * 256.0) as i64 }
    }

    /// So many rows further up.
    #[inline]
    pub(super) fn back(self, rows: usize) -> Self {
        Self { x: self.x.wrapping_sub(self.step.wrapping_mul(rows as i64)), ..self }
    }

    /// Where it crosses the middle of the row; then it goes on to the next.
    #[inline]
    pub(super) fn next(&mut self) -> i64 {
        let x = self.x;
        self.x = x.wrapping_add(self.step);
        x
    }
}

impl Grid {
    /// The first column whose middle is not left of where a [`Side`] crosses a row.
    #[inline]
    pub(super) fn column(self, x: i64) -> usize {
        let column = x.wrapping_add((127 << 16) + 0xffff - TIE) >> 24;
        column.clamp(0, self.columns as i64) as usize
    }
}

/// What three corners have, at all samples: affine, since views are orthographic. In double precision, because slivers have
/// steep slopes.
#[derive(Clone, Copy)]
pub(super) struct Plane<V> {
    /// At the middle of the first sample of all, to the next column and to the next row.
    origin: V,
    pub(super) across: V,
    pub(super) down: V,
}

impl<V: Copy + Add<Output = V> + Sub<Output = V> + Mul<f64, Output = V>> Plane<V> {
    /// Nothing sensible where the corners have no area.
    #[inline]
    pub(super) fn new(p: [Point; 3], [va, vb, vc]: [V; 3]) -> Self {
        let [a, b, c] = p.map(|p| DVec2::new(f64::from(p.x), f64::from(p.y)) * (1.0 / f64::from(SUBSAMPLE)));
        let (ab, ac) = (b - a, c - a);
        let inverse = 1.0 / ab.perp_dot(ac);
        let (vb, vc) = ((vb - va) * inverse, (vc - va) * inverse);
        let (across, down) = (vb * ac.y - vc * ab.y, vc * ab.x - vb * ac.x);
        Self { origin: va + across * (0.5 - a.x) + down * (0.5 - a.y), across, down }
    }

    /// At the middle of a sample.
    #[inline]
    pub(super) fn at(&self, column: usize, row: usize) -> V {
        self.origin + self.across * column as f64 + self.down * row as f64
    }
}

/// Whether a triangle looks away from the viewer, or is seen edge on.
#[inline]
pub(super) fn is_back(p: [Point; 3]) -> bool {
    edge(p[0], p[1], p[2].x, p[2].y) >= 0
}

/// Twice the signed area of the triangle (p, q, (x, y)).
pub(super) fn edge(p: Point, q: Point, x: i32, y: i32) -> i64 {
    i64::from(q.x - p.x) * i64::from(y - p.y) - i64::from(q.y - p.y) * i64::from(x - p.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn rounding_is_that_of_floats() {
        let near = |i: u64| f32::from_bits(Seed::new(9).at(i).bits() as u32);
        let whole =
            |i: u64| (0..9).map(move |k| f32::from_bits((i as f32 * 0.5).to_bits().wrapping_add(k).wrapping_sub(4)));
        let far = (0..4000).flat_map(|i| whole(i * 25_601));
        for v in (0..200_000).map(near).chain((0..4000).flat_map(whole)).chain(far).flat_map(|v| [v, -v]) {
            if v.abs() < FARTHEST {
                assert_eq!(round(v), (v + 0.5).floor() as i32, "{v}");
            }
        }
    }

    #[test]
    fn a_triangle_covers_the_samples_within_it_and_no_others() {
        let grid = Grid { columns: 40, rows: 40 };
        let mut seen = 0;
        for i in 0..300 {
            let at = |k: u64| Seed::new(3).at(i).at(k).range(-2000.0, 12_000.0) as i32;
            let p = [0, 2, 4].map(|k| Point { x: at(k), y: at(k + 1), depth: 0.0 });
            let mut covered = [[false; 40]; 40];
            scan(p, grid, 0..40, |row, left, right| covered[row][left..right].fill(true));
            for (y, row) in covered.iter().enumerate() {
                for (x, covered) in row.iter().enumerate() {
                    let (x, y) = (x as i32 * 256 + 128, y as i32 * 256 + 128);
                    let sides = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| edge(p[a], p[b], x, y).signum());
                    // What lies on an edge belongs to one of two neighbours.
                    if !sides.contains(&0) {
                        assert_eq!(*covered, sides[0] == sides[1] && sides[1] == sides[2], "{i}: {x} {y}");
                    }
                    seen += u32::from(*covered);
                }
            }
        }
        assert!(seen > 10_000, "{seen}");
    }

    #[test]
    fn small_triangles_cover_what_sides_do_and_mix_what_corners_have() {
        let grid = Grid { columns: 12, rows: 12 };
        let (mut seen, mut of_edges) = (0, 0);
        for i in 0..4000 {
            // Every other on a lattice that holds the middles of samples: many edges pass through some.
            let step = if i % 2 == 0 { 128 } else { 1 };
            let at = |k: u64| Seed::new(4).at(i).at(k).index((SMALL_SPAN / step) as usize) as i32 * step + 640;
            let p = [0, 2, 4].map(|k| Point { x: at(k), y: at(k + 1), depth: 0.0 });
            let Some(extent) = extent(p, grid) else { continue };
            let (mut by_sides, mut by_edges) = (Vec::new(), Vec::new());
            let rows = [4..6, 0..12, 9000..9032][i as usize % 3].clone();
            scan(p, grid, rows.clone(), |row, left, right| by_sides.extend((left..right).map(|column| (row, column))));
            if let Some(small) = Small::new(p, extent) {
                let inverse = small.inverse();
                small.each(rows, |row, column, at| {
                    by_edges.push((row, column));
                    let place = mixed(p.map(|p| Vec2::new(p.x as f32, p.y as f32) * inverse), at);
                    let middle = Vec2::new(column as f32, row as f32) * 256.0 + 128.0;
                    assert!(place.distance(middle) < 0.1, "{i}: {place} {middle}");
                    of_edges += u32::from(at.contains(&0));
                });
            }
            seen += by_edges.len();
            assert_eq!(by_edges, by_sides, "{i}");
        }
        assert!(seen > 3000 && of_edges > 300, "{seen} {of_edges}");
        let far = |x: i32| Point { x, y: x / 2, depth: 0.0 };
        let large = [far(0), far(SMALL_SPAN + 1), Point { x: 0, y: 300, depth: 0.0 }];
        assert!(Small::new(large, extent(large, grid).unwrap()).is_none());
    }
}
