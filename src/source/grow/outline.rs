//! The silhouettes of an SVG, what they cover as seen, and the half profile that they sweep when they are revolved.
//!
//! Every visible path counts as filled, by its own fill rule; paths that overlap are one silhouette. Curves are cut into
//! [`PIECES`] straight pieces. The profile is rasterized once, in [`ROWS`] rows, finer than any graph. Both halves of an
//! unequal silhouette count: a ring belongs to it where either half does.
//!
//! Limits: [`MOST_SEGMENTS`], and those of `base/svg.rs`. Coordinates behind a `rotate()` are as exact as the platform's sine.

use glam::Vec2;

use super::solid::SolidError;
use crate::base::{SvgError, read_svg};

/// Most straight pieces of an outline.
const MOST_SEGMENTS: usize = 100_000;
/// Straight pieces of a curve.
const PIECES: u32 = 16;
/// Rows of a profile.
pub(super) const ROWS: usize = 512;

/// A filled path.
#[derive(Clone, Debug)]
pub(super) struct Silhouette {
    /// Closed rings; the first point follows the last.
    pub(super) rings: Vec<Vec<Vec2>>,
    /// Whether the even-odd rule fills it; else the non-zero rule.
    even_odd: bool,
}

/// The filled paths of an SVG, y down.
pub(super) fn silhouettes(bytes: &[u8]) -> Result<Vec<Silhouette>, SolidError> {
    let tree = read_svg(bytes).map_err(|error| match error {
        SvgError::Unreadable(why) => SolidError::Unreadable(why),
        SvgError::TooLarge { found, what, most } => SolidError::TooLarge { found, what, most },
    })?;
    let mut found = Vec::new();
    let mut pieces = 0_usize;
    let mut work = vec![tree.root()];
    while let Some(group) = work.pop() {
        for node in group.children() {
            match node {
                usvg::Node::Group(group) => work.push(group),
                usvg::Node::Path(path) if path.is_visible() => {
                    let mut rings = rings(path);
                    rings.retain(|ring| ring.len() > 2);
                    pieces += rings.iter().map(Vec::len).sum::<usize>();
                    if pieces > MOST_SEGMENTS {
                        return Err(SolidError::TooLarge { found: pieces, what: "pieces", most: MOST_SEGMENTS });
                    }
                    let even_odd = path.fill().is_some_and(|fill| fill.rule() == usvg::FillRule::EvenOdd);
                    found.extend((!rings.is_empty()).then_some(Silhouette { rings, even_odd }));
                }
                _ => {}
            }
        }
    }
    if found.is_empty() { Err(SolidError::Unreadable("the SVG file fills no path".to_owned())) } else { Ok(found) }
}

/// The rings of a path on the canvas.
fn rings(path: &usvg::Path) -> Vec<Vec<Vec2>> {
    use usvg::tiny_skia_path::{PathSegment, Point};
    let transform = path.abs_transform();
    let place = |p: Point| {
        Vec2::new(
            transform.sx * p.x + transform.kx * p.y + transform.tx,
            transform.ky * p.x + transform.sy * p.y + transform.ty,
        )
    };
    let mut rings = Vec::new();
    let mut ring: Vec<Vec2> = Vec::new();
    for segment in path.data().segments() {
        let from = ring.last().copied().unwrap_or_default();
        let along = (1..=PIECES).map(|i| i as f32 / PIECES as f32);
        match segment {
            PathSegment::MoveTo(p) => rings.push(std::mem::replace(&mut ring, vec![place(p)])),
            PathSegment::LineTo(p) => ring.push(place(p)),
            PathSegment::QuadTo(b, c) => {
                let (b, c) = (place(b), place(c));
                ring.extend(along.map(|t| from.lerp(b, t).lerp(b.lerp(c, t), t)));
            }
            PathSegment::CubicTo(b, c, d) => {
                let (b, c, d) = (place(b), place(c), place(d));
                ring.extend(along.map(|t| {
                    let (p, q, r) = (from.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
                    p.lerp(q, t).lerp(q.lerp(r, t), t)
                }));
            }
            PathSegment::Close => {}
        }
    }
    rings.push(ring);
    rings
}

/// Columns, and for each row and column whether the middle of the cell lies in a silhouette on either side of the axis.
/// Silhouettes have height 1, y up from 0, their axis at x = 0 and reach `half` to either side.
pub(super) fn profile(silhouettes: &[Silhouette], half: f32) -> (usize, Vec<bool>) {
    let columns = (half * ROWS as f32).ceil().max(1.0) as usize;
    (columns, rasterized(silhouettes, columns, |from, to| [(from, to), (-to, -from)]))
}

/// Columns from the left edge on, and for each row and column whether the middle of the cell lies in a silhouette; as
/// [`profile`], but either side by itself.
pub(super) fn seen(silhouettes: &[Silhouette], half: f32) -> (usize, Vec<bool>) {
    let columns = (2.0 * half * ROWS as f32).ceil().max(1.0) as usize;
    (columns, rasterized(silhouettes, columns, |from, to| [(from + half, to + half)]))
}

/// The cells that silhouettes cover, row by row; `spans` says where a piece of a row lies.
fn rasterized<const N: usize>(
    silhouettes: &[Silhouette],
    columns: usize,
    spans: impl Fn(f32, f32) -> [(f32, f32); N],
) -> Vec<bool> {
    let mut inside = vec![false; columns * ROWS];
    for Silhouette { rings, even_odd } in silhouettes {
        // Where the outline crosses the middle of each row, and which way.
        let mut crossings: Vec<Vec<(f32, i32)>> = vec![Vec::new(); ROWS];
        for (a, b) in rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1))) {
            let (low, high, way) = if a.y < b.y { (a, b, 1) } else { (b, a, -1) };
            let row = |y: f32| (y * ROWS as f32 - 0.5).ceil().clamp(0.0, ROWS as f32) as usize;
            for (r, at) in crossings.iter_mut().enumerate().take(row(high.y)).skip(row(low.y)) {
                let y = (r as f32 + 0.5) / ROWS as f32;
                at.push((low.x + (high.x - low.x) * ((y - low.y) / (high.y - low.y)), way));
            }
        }
        for (r, at) in crossings.iter_mut().enumerate() {
            at.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut winding = 0;
            for pair in at.windows(2) {
                winding = if *even_odd { winding ^ 1 } else { winding + pair[0].1 };
                if winding == 0 {
                    continue;
                }
                for (from, to) in spans(pair[0].0, pair[1].0) {
                    let column = |x: f32| (x * ROWS as f32 - 0.5).ceil().clamp(0.0, columns as f32) as usize;
                    inside[r * columns + column(from)..r * columns + column(to).max(column(from))].fill(true);
                }
            }
        }
    }
    inside
}
