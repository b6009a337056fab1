//! What a designer drew: the areas, open lines and trunk of an SVG, as polygons.
//!
//! - Transforms, groups, `use`, styles and basic shapes are resolved by usvg; every visible path counts.
//! - A filled path is its area by its own fill rule, with its stroke where it has one. The crown is the union of all.
//! - A path that is stroked but not filled is an outline: what it encloses counts as filled. Where its ends don't meet it
//!   is closed by a straight line if they are near each other ([`NEAR`]) or if the file encloses something elsewhere.
//!   Otherwise the file is an *open sketch*, which replaces the part of the crown that it runs along.
//! - What has the id `trunk`, or lies in a group of that id, is no part of the crown (`trunk-2` and the like are too).
//!   An open line there is as wide as its stroke.
//! - What has the id `foot`, a dot say, marks with its middle where the tree's foot is seen, and is no part of the crown. It
//!   places a drawing where no trunk does: a plan has none.
//!
//! Coordinates are the SVG's canvas with y turned up. Pictures and texts are not read, nor is anything beside the given
//! bytes. Limits: those of `base/svg.rs`, [`MOST_POINTS`] points, [`MOST_CROSSINGS`] places where outlines cross; more is an
//! error, so that no file takes unbounded time.

use glam::Vec2;
use usvg::tiny_skia_path::{Path, PathSegment, Point, Transform};

use super::region::{Fill, Region, crossings};
use super::stem;
use crate::base::{SvgError, counted, read_svg};

/// Most points of all its outlines.
pub(super) const MOST_POINTS: usize = 100_000;
/// Most crossings of its outlines: clipping takes some ten microseconds for each.
const MOST_CROSSINGS: usize = 100_000;
/// Straight pieces of a curve.
const PIECES: u32 = 12;
/// Ends nearer than this share of a line's length count as one.
const NEAR: f32 = 0.15;
/// Coordinates beyond this share of the canvas and more are no drawing.
const FARTHEST: f32 = 1e6;

/// What can't be read as a sketch.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SketchError {
    /// No SVG, or a broken one.
    #[error("can't be read as SVG: {0}")]
    Unreadable(String),
    /// More than can be drawn with.
    #[error("has {found} {what}; at most {most} are read")]
    TooLarge {
        /// How many.
        found: usize,
        /// Of what.
        what: &'static str,
        /// The limit.
        most: usize,
    },
    /// No area and no line.
    #[error("draws no crown: it has no visible path with an area or a length beside what is marked as trunk or foot")]
    Empty,
    /// Nothing but pictures and texts.
    #[error("draws no crown: it has nothing but pictures and texts, which are not read; trace them to paths")]
    Unread,
    /// An open line where only closed shapes make sense.
    #[error("is an open line, which shapes one view only")]
    Open,
    /// What stands upright or is seen from several sides, drawn in a view that is not level.
    #[error("has {what}, which needs a level view: leave the elevation at 0")]
    Raised {
        /// What needs one.
        what: &'static str,
    },
    /// A plant without points that could be shaped.
    #[error("the plant has no crown that could be shaped")]
    NoCrown,
}

/// The note about a crown that stands on something narrow.
pub(crate) const LIKE_A_TRUNK: &str =
    "its lowest part is as narrow as a trunk, and taken for crown: give what is the trunk the id `trunk`";

/// A drawing, on its canvas with y up.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// The union of all that is drawn, the trunk apart.
    pub crown: Region,
    /// The trunk, where one is marked.
    pub trunk: Region,
    /// The open sketch: a line that replaces a part of the crown's silhouette. Empty for a closed sketch.
    pub open: Vec<Vec2>,
    /// Where the tree's foot is seen, where that is marked.
    pub foot: Option<Vec2>,
    /// Lower left and upper right corner of the canvas.
    pub canvas: [Vec2; 2],
    /// What was closed, untangled or left out.
    pub notes: Vec<String>,
}

impl Drawing {
    /// Reads an SVG.
    ///
    /// # Errors
    ///
    /// When it is none, draws nothing, or is too large.
    pub fn read(bytes: &[u8]) -> Result<Self, SketchError> {
        let tree = read_svg(bytes).map_err(|error| match error {
            SvgError::Unreadable(why) => SketchError::Unreadable(why),
            SvgError::TooLarge { found, what, most } => SketchError::TooLarge { found, what, most },
        })?;
        let mut reading = Reading::default();
        let mut work = vec![(tree.root(), false)];
        while let Some((group, trunk)) = work.pop() {
            for node in group.children() {
                match node {
                    usvg::Node::Group(group) if is_called(group.id(), "foot") => {
                        reading.foot = reading.foot.or(middle(group.abs_bounding_box()));
                    }
                    usvg::Node::Path(path) if is_called(path.id(), "foot") => {
                        reading.foot = reading.foot.or(middle(path.abs_bounding_box()));
                    }
                    usvg::Node::Group(group) => work.push((group, trunk || is_trunk(group.id()))),
                    usvg::Node::Path(path) if path.is_visible() => reading.path(path, trunk || is_trunk(path.id()))?,
                    usvg::Node::Image(_) | usvg::Node::Text(_) => reading.skipped += 1,
                    _ => {}
                }
            }
        }
        let size = tree.size();
        let drawing = reading.finish([Vec2::new(0.0, -size.height()), Vec2::new(size.width(), 0.0)]);
        // The reader of SVGs leaves out what it is not to read, and says nothing of it.
        let has = |tag: &[u8]| bytes.windows(tag.len()).any(|part| part == tag);
        match drawing {
            Err(SketchError::Empty) if has(b"<image") || has(b"<text") => Err(SketchError::Unread),
            drawing => drawing,
        }
    }

    /// Whether it replaces a part of a crown only.
    #[must_use]
    pub fn is_open(&self) -> bool {
        !self.open.is_empty()
    }
}

fn is_trunk(id: &str) -> bool {
    is_called(id, "trunk")
}

/// Whether an id is a name, or begins with it: `trunk`, `Trunk-2`.
fn is_called(id: &str, name: &str) -> bool {
    let Some((start, rest)) = id.split_at_checked(name.len()) else { return false };
    start.eq_ignore_ascii_case(name) && rest.chars().next().is_none_or(|c| !c.is_alphabetic())
}

/// The middle of a box on the canvas, y up.
fn middle(of: usvg::Rect) -> Option<Vec2> {
    let middle = Vec2::new(of.x() + of.width() * 0.5, -(of.y() + of.height() * 0.5));
    (middle.is_finite() && middle.abs().max_element() < FARTHEST).then_some(middle)
}

#[derive(Default)]
struct Reading {
    crown: Vec<Region>,
    trunk: Vec<Region>,
    /// Lines whose ends don't meet, and the area of their strokes.
    open: Vec<(Vec<Vec2>, Region, bool)>,
    /// Where the foot is marked.
    foot: Option<Vec2>,
    points: usize,
    skipped: usize,
    tangled: usize,
}

impl Reading {
    fn path(&mut self, path: &usvg::Path, trunk: bool) -> Result<(), SketchError> {
        let lines = flatten(path.data(), path.abs_transform());
        let stroke = path.stroke().filter(|stroke| stroke.opacity().get() > 0.0);
        let fill = path.fill().filter(|fill| fill.opacity().get() > 0.0);
        let band = stroke.and_then(|stroke| {
            // The stroker works on the path before its transform.
            let scale = path.abs_transform().get_scale();
            path.data().stroke(&stroke.to_tiny_skia(), scale.0.max(scale.1).clamp(1e-3, 1e3))
        });
        let band = band.map(|band| flatten(&band, path.abs_transform())).unwrap_or_default();
        self.points += lines.iter().map(|line| line.points.len()).sum::<usize>();
        self.points += band.iter().map(|line| line.points.len()).sum::<usize>();
        if self.points > MOST_POINTS {
            return Err(SketchError::TooLarge { found: self.points, what: "points", most: MOST_POINTS });
        }
        let rings = |lines: &[Line]| lines.iter().map(|l| l.points.clone()).collect::<Vec<_>>();
        clippable(&[rings(&lines), rings(&band)].concat())?;
        let band = Region::of(&rings(&band), Fill::NonZero);
        match (fill, stroke) {
            (Some(fill), _) => {
                let rule = if fill.rule() == usvg::FillRule::EvenOdd { Fill::EvenOdd } else { Fill::NonZero };
                let area = Region::of(&rings(&lines), rule);
                self.tangled += usize::from(area.pieces() > lines.len());
                self.add(trunk, area.union(&band));
            }
            (None, Some(_)) => {
                for line in lines {
                    if line.closed || line.gap() <= NEAR * line.length() {
                        let area = Region::of(&[line.points], Fill::NonZero);
                        self.add(trunk, area.union(&band));
                    } else {
                        self.open.push((line.points, band.clone(), trunk));
                    }
                }
            }
            (None, None) => {}
        }
        Ok(())
    }

    fn add(&mut self, trunk: bool, area: Region) {
        if area.area() > 0.0 {
            if trunk { self.trunk.push(area) } else { self.crown.push(area) }
        }
    }

    fn finish(mut self, canvas: [Vec2; 2]) -> Result<Drawing, SketchError> {
        let mut notes = Vec::new();
        let mut open = Vec::new();
        // An open line is a sketch of its own only where nothing else is drawn; the trunk's never is.
        let lone = self.crown.is_empty();
        let longest = |lines: &[(Vec<Vec2>, Region, bool)]| {
            let of_crown = (0..lines.len()).filter(|&i| !lines[i].2);
            of_crown.max_by(|&a, &b| length(&lines[a].0).total_cmp(&length(&lines[b].0)).then(b.cmp(&a)))
        };
        let sketch = if lone { longest(&self.open) } else { None };
        let mut closed = 0;
        for (i, (points, band, trunk)) in std::mem::take(&mut self.open).into_iter().enumerate() {
            if sketch == Some(i) {
                open = points;
            } else if trunk {
                // A trunk's line is as wide as its stroke: closed, it would be what the line bends round.
                self.add(trunk, band);
            } else if !lone {
                closed += 1;
                let area = Region::of(&[points], Fill::NonZero).union(&band);
                self.add(trunk, area);
            } else {
                self.skipped += 1;
            }
        }
        if closed > 0 {
            let were = counted(closed, "line was", "lines were");
            notes.push(format!("{were} closed by a straight line from end to start"));
        }
        if self.tangled > 0 {
            let cross = counted(self.tangled, "of its paths crosses itself", "of its paths cross themselves");
            notes.push(format!("{cross}; what is filled by the fill rule counts"));
        }
        if self.skipped > 0 {
            let are = if self.skipped == 1 { "is" } else { "are" };
            notes.push(format!("{} of its pictures, texts and further open lines {are} not read", self.skipped));
        }
        for regions in [&self.crown, &self.trunk] {
            clippable(&regions.iter().flat_map(Region::rings).map(<[Vec2]>::to_vec).collect::<Vec<_>>())?;
        }
        let (crown, trunk) = (Region::union_of(&self.crown), Region::union_of(&self.trunk));
        // Where crown and trunk overlap, the crown is the crown.
        if crown.area() <= 0.0 && open.len() < 2 {
            return Err(SketchError::Empty);
        }
        if crown.pieces() > 1 {
            notes.push(format!("the crown is of {} pieces that don't touch", crown.pieces()));
        }
        if trunk.area() <= 0.0 && stem::stands(&crown) {
            notes.push(LIKE_A_TRUNK.into());
        }
        Ok(Drawing { crown, trunk, open, foot: self.foot, canvas, notes })
    }
}

/// An error where rings cross too often to be clipped.
fn clippable(rings: &[Vec<Vec2>]) -> Result<(), SketchError> {
    let found = crossings(rings);
    let what = "places, about, where its outlines cross";
    if found > MOST_CROSSINGS { Err(SketchError::TooLarge { found, what, most: MOST_CROSSINGS }) } else { Ok(()) }
}

struct Line {
    points: Vec<Vec2>,
    closed: bool,
}

impl Line {
    fn gap(&self) -> f32 {
        self.points.first().zip(self.points.last()).map_or(0.0, |(a, b)| a.distance(*b))
    }

    fn length(&self) -> f32 {
        length(&self.points)
    }
}

/// Length of a polyline.
pub(super) fn length(points: &[Vec2]) -> f32 {
    points.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

/// The lines of a path on the canvas, y up; points that are not finite or beyond all measure are left out.
fn flatten(path: &Path, transform: Transform) -> Vec<Line> {
    let place = |p: Point| {
        Vec2::new(
            transform.sx * p.x + transform.kx * p.y + transform.tx,
            -(transform.ky * p.x + transform.sy * p.y + transform.ty),
        )
    };
    let mut lines: Vec<Line> = Vec::new();
    let mut line = Line { points: Vec::new(), closed: false };
    for segment in path.segments() {
        let from = line.points.last().copied().unwrap_or_default();
        let along = (1..=PIECES).map(|i| i as f32 / PIECES as f32);
        match segment {
            PathSegment::MoveTo(p) => {
                lines.push(std::mem::replace(&mut line, Line { points: vec![place(p)], closed: false }));
            }
            PathSegment::LineTo(p) => line.points.push(place(p)),
            PathSegment::QuadTo(b, c) => {
                let (b, c) = (place(b), place(c));
                line.points.extend(along.map(|t| from.lerp(b, t).lerp(b.lerp(c, t), t)));
            }
            PathSegment::CubicTo(b, c, d) => {
                let (b, c, d) = (place(b), place(c), place(d));
                line.points.extend(along.map(|t| {
                    let (p, q, r) = (from.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
                    p.lerp(q, t).lerp(q.lerp(r, t), t)
                }));
            }
            PathSegment::Close => line.closed = true,
        }
    }
    lines.push(line);
    for line in &mut lines {
        line.points.retain(|p| p.is_finite() && p.abs().max_element() < FARTHEST);
    }
    lines.retain(|line| line.points.len() > 1 && line.length() > 0.0);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(body: &str) -> Result<Drawing, SketchError> {
        let text = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\">{body}</svg>");
        Drawing::read(text.as_bytes())
    }

    fn area(body: &str) -> f32 {
        read(body).unwrap().crown.area()
    }

    #[test]
    fn a_tangle_is_an_error_before_it_is_clipped() {
        let line = |i: usize| {
            if i.is_multiple_of(2) {
                format!("M0 {}L10 {}", i as f32 / 80.0, i as f32 / 80.0)
            } else {
                format!("M{} 0L{} 10", i as f32 / 80.0, i as f32 / 80.0)
            }
        };
        // As one path of strokes, and as a path a stroke.
        let lines: Vec<String> = (0..800).map(line).collect();
        let style = "fill=\"none\" stroke=\"black\" stroke-width=\"0.001\"";
        let one = format!("<path {style} d=\"{}\"/>", lines.join(""));
        let many: String = lines.iter().map(|line| format!("<path {style} d=\"{line}\"/>")).collect();
        let crown = "<circle cx=\"5\" cy=\"5\" r=\"4\"/>";
        for body in [format!("{crown}{one}"), format!("{crown}{many}")] {
            assert!(matches!(read(&body), Err(SketchError::TooLarge { most: MOST_CROSSINGS, .. })));
        }
        assert!(read(&format!("{crown}{}", many[..many.len() / 20 / 60 * 60].rsplit_once("<path").unwrap().0)).is_ok());
    }

    #[test]
    fn shapes_unite_and_holes_stay_holes() {
        assert!((area("<rect width='4' height='4'/><rect x='2' width='4' height='4'/>") - 24.0).abs() < 1e-3);
        let frame = "<path fill-rule='evenodd' d='M0 0H8V8H0Z M2 2H6V6H2Z'/>";
        assert!((area(frame) - 48.0).abs() < 1e-3);
        assert_eq!(read(frame).unwrap().crown.rings().len(), 2);
        assert!((area("<g transform='translate(1 1) scale(2)'><rect width='1' height='2'/></g>") - 8.0).abs() < 1e-3);
    }

    #[test]
    fn outlines_count_as_filled_and_strokes_as_wide() {
        assert!((area("<path fill='none' stroke='#000' stroke-width='2' d='M2 2H6V6H2Z'/>") - 36.0).abs() < 1e-2);
        let line = "<rect width='1' height='1'/><path fill='none' stroke='#000' stroke-width='2' d='M5 2V6'/>";
        assert!((area(line) - 9.0).abs() < 1e-2);
    }

    #[test]
    fn a_lone_open_line_is_an_open_sketch_and_a_nearly_closed_one_is_not() {
        let open = read("<path fill='none' stroke='#000' d='M1 5C1 1 9 1 9 5'/>").unwrap();
        assert!(open.is_open() && open.crown.area() == 0.0);
        let closed = read("<path fill='none' stroke='#000' stroke-width='0.01' d='M1 1H9V9H1V1.2'/>").unwrap();
        assert!(!closed.is_open() && (closed.crown.area() - 64.0).abs() < 0.2);
    }

    #[test]
    fn a_marked_trunk_is_no_crown() {
        let drawn =
            read("<circle cx='5' cy='3' r='3'/><g id='trunk'><rect x='4' y='6' width='2' height='4'/></g>").unwrap();
        assert!((drawn.trunk.area() - 8.0).abs() < 1e-3 && (drawn.crown.area() - 28.0).abs() < 0.3);
        assert!(!is_trunk("trunks") && is_trunk("Trunk-2") && is_trunk("trunk"));
    }

    #[test]
    fn a_marked_foot_is_its_middle_and_no_crown() {
        let drawn = read("<rect width='4' height='4'/><g id='Foot'><circle cx='6' cy='3' r='1'/></g>").unwrap();
        assert!(drawn.foot.unwrap().distance(Vec2::new(6.0, -3.0)) < 1e-4 && (drawn.crown.area() - 16.0).abs() < 1e-3);
        assert_eq!(read("<rect id='footing' width='4' height='4'/>").unwrap().foot, None);
        assert_eq!(read("<circle id='foot' cx='6' cy='3' r='1'/>").unwrap_err(), SketchError::Empty);
    }

    #[test]
    fn what_is_no_sketch_is_an_error_and_what_is_odd_a_note() {
        assert!(matches!(Drawing::read(b"<html>"), Err(SketchError::Unreadable(_))));
        assert_eq!(read("").unwrap_err(), SketchError::Empty);
        assert_eq!(read("<path d='M1 1'/>").unwrap_err(), SketchError::Empty);
        assert_eq!(read("<rect width='0' height='4'/>").unwrap_err(), SketchError::Empty);
        assert_eq!(read("<rect width='4' height='4' display='none'/>").unwrap_err(), SketchError::Empty);
        let bow = read("<path d='M0 0L8 8V0L0 8Z'/>").unwrap();
        assert!(
            (bow.crown.area() - 32.0).abs() < 1e-2
                && bow.notes.iter().any(|n| n.contains("1 of its paths crosses itself"))
        );
        let round = |i: u32| Vec2::from_angle(i as f32 / 60_000.0 * std::f32::consts::TAU) * 4.0 + 5.0;
        let many: String = (0..60_000).map(round).map(|p| format!("L{} {}", p.x, p.y)).collect();
        let huge = format!("<path d='M9 5{many}Z'/><path d='M9 5{many}Z'/>");
        assert!(matches!(read(&huge), Err(SketchError::TooLarge { what: "points", .. })));
    }
}
