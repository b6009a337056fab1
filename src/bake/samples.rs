//! Where triangles lie among the samples of a picture: projection, snapping, boxes, edges and the runs of rows within them.
//!
//! Vertices are snapped to 1/256 of a sample and edges tested in integers with the top-left rule, so that triangles which
//! share an edge neither overlap nor leave a gap.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::raster::View;
use crate::mesh::Mesh;

/// Snapping: units a sample.
pub(super) const SUBSAMPLE: f32 = 256.0;
/// Farthest snapped coordinate that is drawn; keeps products of edges within 64 bits.
const FARTHEST: f32 = 200_000.0 * SUBSAMPLE;
/// Columns that are stepped through rather than divided for.
const NARROW: i64 = 10;
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
    view: View,
    scale: Vec2,
    middle: Vec2,
}

impl Projection {
    fn new(view: &View, grid: Grid) -> Self {
        let middle = Vec2::new(grid.columns as f32, grid.rows as f32) * (0.5 * SUBSAMPLE);
        Self { view: *view, scale: middle / Vec2::new(view.half_width, view.half_height), middle }
    }

    #[inline]
    fn point(&self, p: Vec3) -> Point {
        let local = self.view.frame.to_local(p - self.view.centre);
        let (x, y) = (self.middle.x + local.x * self.scale.x, self.middle.y - local.y * self.scale.y);
        // Written so that NaN fails it.
        if x.abs() < FARTHEST && y.abs() < FARTHEST && local.z.is_finite() {
            Point { x: round(x), y: round(y), depth: local.z }
        } else {
            Point::NOWHERE
        }
    }
}

/// `(v + 0.5).floor()` without a call: baselines of x86 have no instruction for it.
#[inline]
fn round(v: f32) -> i32 {
    let v = v + 0.5;
    let cut = v as i32;
    cut - i32::from(cut as f32 > v)
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

pub(super) fn corner_points(points: &[Point], corners: [u32; 3]) -> Option<[Point; 3]> {
    let at = |i: u32| points.get(i as usize).copied().filter(|p| p.x != i32::MIN);
    Some([at(corners[0])?, at(corners[1])?, at(corners[2])?])
}

/// First and last column and row of the samples whose centres a triangle's box holds.
#[inline]
pub(super) fn extent(p: [Point; 3], grid: Grid) -> Option<Extent> {
    let span = |a: i32, b: i32, c: i32, size: usize| {
        // A centre lies at 256 i + 128. Shifts round down.
        let low = ((a.min(b).min(c) - 128 + 255) >> 8).max(0);
        let high = ((a.max(b).max(c) - 128) >> 8).min(size as i32 - 1);
        (low <= high).then_some((low as usize, high as usize))
    };
    Some((span(p[0].x, p[1].x, p[2].x, grid.columns)?, span(p[0].y, p[1].y, p[2].y, grid.rows)?))
}

/// Whether the triangle covers one of the samples of its box.
pub(super) fn holds_any(mut p: [Point; 3], x: (usize, usize), y: (usize, usize)) -> bool {
    if edge(p[0], p[1], p[2].x, p[2].y) < 0 {
        p.swap(1, 2);
    }
    let edges = [(p[1], p[2]), (p[2], p[0]), (p[0], p[1])];
    let inside = |x: usize, y: usize| {
        let (x, y) = (x as i32 * 256 + 128, y as i32 * 256 + 128);
        edges.iter().all(|&(p, q)| edge(p, q, x, y) >= i64::from(!top_left(p, q)))
    };
    (y.0..=y.1).any(|y| (x.0..=x.1).any(|x| inside(x, y)))
}

/// The columns of a row that lie within all edges. `e` are the edges' values at the first of `columns`, each growing by
/// `step` a column and inside where at least `bias`.
///
/// Quotients of whole numbers below 2^53 round to the right side of every whole number in double precision, which
/// divides four times as fast.
#[inline]
pub(super) fn span(e: [i64; 3], step: [i64; 3], bias: [i64; 3], columns: (usize, usize)) -> Option<(usize, usize)> {
    let count = (columns.1 - columns.0) as i64;
    if count < NARROW {
        return narrow_span([e[0] - bias[0], e[1] - bias[1], e[2] - bias[2]], step, columns);
    }
    let (mut low, mut high) = (0, count);
    for k in 0..3 {
        let short = bias[k] - e[k];
        if step[k] > 0 {
            if short > 0 {
                low = low.max(up(short as f64 / step[k] as f64));
            }
        } else if step[k] < 0 {
            if short > 0 {
                return None;
            }
            high = high.min((short as f64 / step[k] as f64) as i64);
        } else if short > 0 {
            return None;
        }
    }
    (low <= high).then(|| (columns.0 + low as usize, columns.0 + high as usize))
}

/// As [`span`] of few columns, most of what trees are made of: stepping through them costs less than dividing. `e` is not
/// negative inside.
#[inline]
fn narrow_span(mut e: [i64; 3], step: [i64; 3], columns: (usize, usize)) -> Option<(usize, usize)> {
    let mut column = columns.0;
    // The sign of all three at once.
    while e[0] | e[1] | e[2] < 0 {
        if column == columns.1 {
            return None;
        }
        column += 1;
        e = [e[0] + step[0], e[1] + step[1], e[2] + step[2]];
    }
    let first = column;
    while column < columns.1 {
        e = [e[0] + step[0], e[1] + step[1], e[2] + step[2]];
        if e[0] | e[1] | e[2] < 0 {
            break;
        }
        column += 1;
    }
    Some((first, column))
}

/// The next whole number of a value that is not negative.
#[inline]
fn up(v: f64) -> i64 {
    let cut = v as i64;
    cut + i64::from((cut as f64) < v)
}

/// Twice the signed area of the triangle (p, q, (x, y)).
pub(super) fn edge(p: Point, q: Point, x: i32, y: i32) -> i64 {
    i64::from(q.x - p.x) * i64::from(y - p.y) - i64::from(q.y - p.y) * i64::from(x - p.x)
}

/// Whether samples on the edge belong to the triangle: one of each pair of opposite directions.
pub(super) fn top_left(p: Point, q: Point) -> bool {
    q.y < p.y || (q.y == p.y && q.x > p.x)
}
