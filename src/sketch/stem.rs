//! A drawn trunk leads the stem: the trunk's middle line is where the tree's stem is seen to stand.
//!
//! Cages know crowns only. Past the paper, which draws no trunks: up to where a trunk is drawn, points of the thickest stem
//! are moved sideways onto its middle line, at the heights that cages give them; above, the stem leaves the line gradually for
//! where its cage has it. Other stems go along with it. Handles on the line instead were too few: a trunk drawn straight
//! was bent by whatever lobes did above the last of them.
//!
//! The line is one of heights: of a trunk that overhangs the part next to the one below is taken, of several pieces the
//! largest. A trunk that forks leads as far as it is one: up one of its arms, the way that was taken before, the stem broke off to the side at the
//! fork, and the other arm stayed empty.

use glam::{Vec2, Vec3};

use super::fit::Placing;
use super::frame::ViewPlane;
use super::region::{Fill, Region};
use super::svg::Drawing;
use crate::base::math;

/// Rows in which a trunk is cut.
const ROWS: usize = 64;
/// How high both arms of a trunk go on for it to fork, in rows.
const ARM: usize = 8;
/// How far above the line the stem follows it still, over the line's height: under its crown, and as far beside that as half of its
/// width. There it has to come over to it, and stood beside it as a post.
const FADE: (f32, f32) = (0.8, 0.2);
/// The part of the line, from its top, whose direction it goes on in.
const TOP: f32 = 0.15;
/// Steepest that it leans there, sideways over upwards.
const LEAN: f32 = 1.5;

/// Of the height of an outline, what may be a trunk's foot, and what of it lies above; how wide that is at most, of the
/// outline's width, and how many times as wide the one may be as the other.
const FOOT: [[f32; 2]; 2] = [[0.0, 0.05], [0.07, 0.14]];
const NARROW: f32 = 0.28;
const FLARE: f32 = 2.5;

/// The middle of a drawn trunk from its foot up, in even rows; empty where none is drawn.
pub(super) fn midline(trunk: &Region) -> Vec<Vec2> {
    let ring = trunk.outline();
    let [low, high] = super::fit::ends(ring);
    let tall = high.y - low.y;
    if !(tall > 0.0 && tall.is_finite()) {
        return Vec::new();
    }
    let height = |row: usize| low.y + tall * (row as f32 + 0.5) / ROWS as f32;
    let rows: Vec<Vec<[f32; 2]>> = (0..ROWS).map(|row| spans(ring, height(row))).collect();
    let mut line: Vec<Vec2> = Vec::with_capacity(ROWS);
    let mut widths: Vec<f32> = Vec::with_capacity(ROWS);
    let mut high = high;
    let mut on: Option<[f32; 2]> = None;
    for (row, spans) in rows.iter().enumerate() {
        let wide = |s: &&[f32; 2]| s[1] - s[0];
        let near = |s: &&[f32; 2], x: f32| ((s[0] + s[1]) * 0.5 - x).abs();
        if on.is_some_and(|on| spans.iter().filter(|arm| goes_on(&rows[row..], on, **arm)).count() > 1) {
            high.y = height(row);
            break;
        }
        let found = match line.last() {
            None => spans.iter().max_by(|a, b| wide(a).total_cmp(&wide(b))),
            Some(p) => spans.iter().min_by(|a, b| near(a, p.x).total_cmp(&near(b, p.x))),
        };
        if let Some(span) = found {
            line.push(Vec2::new((span[0] + span[1]) * 0.5, height(row)));
            widths.push(span[1] - span[0]);
            on = Some(*span);
        }
    }
    widths.sort_by(f32::total_cmp);
    let width = widths.get(widths.len() / 2).copied().unwrap_or(0.0);
    // An end that is cut aslant is half of it only, which lies to one side.
    let ends = if tall > 3.0 * width { width * 0.5 } else { 0.0 };
    line.retain(|p| p.y >= low.y + ends && p.y <= high.y - ends);
    let (Some(&first), Some(&last)) = (line.first(), line.last()) else { return Vec::new() };
    let reach = width.max(tall * TOP);
    let foot = first + Vec2::new(lean(&line, reach), 1.0) * (low.y - first.y);
    let top = last + Vec2::new(lean(line.iter().rev(), reach), 1.0) * (high.y - last.y);
    line.insert(0, foot);
    line.push(top);
    line
}

/// Whether a stretch of the first of some rows lies on `below` and goes on upwards as an arm does.
fn goes_on(rows: &[Vec<[f32; 2]>], below: [f32; 2], arm: [f32; 2]) -> bool {
    let meet = |a: [f32; 2], b: [f32; 2]| a[0] < b[1] && b[0] < a[1];
    let mut on = arm;
    meet(below, arm)
        && rows.len() >= ARM
        && rows[1..ARM].iter().all(|spans| {
            let next = spans.iter().find(|span| meet(on, **span));
            next.is_some_and(|span| {
                on = *span;
                true
            })
        })
}

/// Whether an outline ends below in something like a trunk: narrow, and nearly as wide at its foot as above it.
pub(super) fn stands(outline: &Region) -> bool {
    let [low, high] = outline.bounds();
    let size = high - low;
    if !(size.min_element() > 0.0 && size.is_finite()) {
        return false;
    }
    let wide = |[from, to]: [f32; 2]| {
        let at = |part: f32| low.y + size.y * part;
        let corners =
            [(low.x, from), (high.x, from), (high.x, to), (low.x, to)].map(|(x, part)| Vec2::new(x, at(part)));
        let strip = Region::of(&[corners.to_vec()], Fill::NonZero);
        outline.intersection(&strip).area() / (size.x * size.y * (to - from))
    };
    let [foot, above] = FOOT.map(wide);
    above < NARROW && foot < FLARE * above && above < FLARE * foot
}

/// How a line leans from its first point for a height up or down, sideways over upwards.
fn lean<'p>(line: impl IntoIterator<Item = &'p Vec2>, reach: f32) -> f32 {
    let mut line = line.into_iter();
    let Some(first) = line.next() else { return 0.0 };
    let last = line.take_while(|p| (p.y - first.y).abs() <= reach).last().unwrap_or(first);
    if last.y == first.y { 0.0 } else { ((last.x - first.x) / (last.y - first.y)).clamp(-LEAN, LEAN) }
}

/// The stretches of a height that lie inside of a ring, from the left.
fn spans(ring: &[Vec2], y: f32) -> Vec<[f32; 2]> {
    let mut crossings: Vec<f32> = (0..ring.len())
        .filter_map(|i| {
            let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
            ((a.y <= y) != (b.y <= y)).then(|| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)))
        })
        .collect();
    crossings.sort_by(f32::total_cmp);
    crossings.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// Where a stem is led in one direction.
#[derive(Clone, Debug)]
struct Line {
    /// To the right in the picture.
    right: Vec3,
    /// From the foot up, metres.
    points: Vec<Vec2>,
    lean: f32,
    /// How far above its top a stem follows it still, over its height.
    fade: f32,
}

/// Where drawn trunks lead a stem; nowhere where none is drawn.
#[derive(Clone, Debug, Default)]
pub(super) struct Leads(Vec<Line>);

impl Leads {
    /// Nowhere.
    pub(super) const NONE: Self = Self(Vec::new());

    /// Leads by the trunk of a drawing that is placed in a plane. Wherever it stands there, it is bent to begin at the
    /// tree's foot, seen at `foot`; an outline that is revolved has its trunk upright on the axis.
    pub(super) fn add(&mut self, drawing: &Drawing, placing: &Placing, plane: &ViewPlane, foot: Vec2) {
        let mut points = placing.line(&midline(&drawing.trunk));
        let (Some(&first), Some(&top)) = (points.first(), points.last()) else { return };
        if !(top.y > foot.y && top.y > first.y) {
            return;
        }
        for p in &mut points {
            *p += (foot - first) * ((top.y - p.y) / (top.y - first.y));
        }
        let [low, high] = placing.region(&drawing.crown).bounds();
        let beside = (low.x - points[points.len() - 1].x).max(points[points.len() - 1].x - high.x).max(0.0);
        let fade = FADE.0 + (FADE.1 - FADE.0) * math::smoothstep(0.0, 0.5, beside / (high.x - low.x).max(1e-6));
        match *plane {
            // Level: only such views have trunks.
            ViewPlane::From { right, .. } => {
                let lean = lean(points.iter().rev(), TOP * (top.y - foot.y));
                self.0.push(Line { right, points, lean, fade });
            }
            ViewPlane::Round { axis } => self.0.extend([Vec3::X, Vec3::Z].map(|right| {
                let points = points.iter().map(|p| Vec2::new(right.dot(axis), p.y)).collect();
                Line { right, points, lean: 0.0, fade: FADE.0 }
            })),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How a point of the stem moves that would be at `place`.
    pub(super) fn onto(&self, place: Vec3) -> Vec3 {
        self.each(place.y, |line, x| x - line.right.dot(place))
    }

    /// How a point of another stem moves that would be moved by `shift` to a height, where the stem that is led moves by
    /// `with`.
    pub(super) fn along(&self, height: f32, shift: Vec3, with: Vec3) -> Vec3 {
        self.each(height, |line, _| line.right.dot(with - shift))
    }

    fn each(&self, height: f32, way: impl Fn(&Line, f32) -> f32) -> Vec3 {
        self.0.iter().fold(Vec3::ZERO, |sum, line| {
            let (x, share) = line.at(height);
            if share > 0.0 { sum + line.right * (way(line, x) * share) } else { sum }
        })
    }
}

impl Line {
    /// Where it is at a height, and how far a stem follows it there, 0..=1.
    fn at(&self, y: f32) -> (f32, f32) {
        let (first, top) = (self.points[0], self.points[self.points.len() - 1]);
        if y <= first.y {
            return (first.x, 1.0);
        }
        if y >= top.y {
            let above = y - top.y;
            let share = 1.0 - math::smoothstep(0.0, self.fade * (top.y - first.y), above);
            return (top.x + self.lean * above, share);
        }
        let i = self.points.partition_point(|p| p.y <= y).clamp(1, self.points.len() - 1);
        let (a, b) = (self.points[i - 1], self.points[i]);
        let f = if b.y > a.y { (y - a.y) / (b.y - a.y) } else { 0.0 };
        (a.x + (b.x - a.x) * f, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_on_a_trunk_stand_and_others_do_not() {
        let stand = |body: &str| {
            let text = format!("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 10 10'>{body}</svg>");
            stands(&Drawing::read(text.as_bytes()).unwrap().crown)
        };
        for body in [
            "<circle cx='5' cy='3' r='3'/><rect x='4.5' y='5' width='1' height='5'/>",
            "<path d='M5 0L9 7H5.7L6 10H4L4.3 7H1Z'/>",
        ] {
            assert!(stand(body), "{body}");
        }
        for body in [
            "<circle cx='5' cy='5' r='4'/>",
            "<path d='M5 0L9 10H1Z'/>",
            "<path d='M5 10L1 0H9Z'/>",
            "<path d='M5 10Q0 5 2 2Q5 0 5 3Q5 0 8 2Q10 5 5 10Z'/>",
            "<rect x='4' width='2' height='10'/>",
        ] {
            assert!(!stand(body), "{body}");
        }
    }

    fn line(body: &str) -> Vec<Vec2> {
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\"><circle cx='5' cy='2' r='2'/>{body}</svg>"
        );
        midline(&Drawing::read(text.as_bytes()).unwrap().trunk)
    }

    #[test]
    fn the_middle_of_a_trunk_is_that_of_its_rows_whatever_its_ends_are_like() {
        let straight = line("<rect id='trunk' x='3' y='4' width='1' height='6'/>");
        assert!(straight.iter().all(|p| (p.x - 3.5).abs() < 1e-4));
        assert!((straight[0].y + 10.0).abs() < 1e-4 && (straight[straight.len() - 1].y + 4.0).abs() < 1e-4);
        // A stroke that leans ends aslant: its foot is the line's end all the same.
        let leaning = line("<line id='trunk' x1='2' y1='10' x2='5' y2='4' stroke='#000'/>");
        let on = |p: &Vec2| (p.x - (2.0 + (p.y + 10.0) * 0.5)).abs();
        assert!(leaning.iter().all(|p| on(p) < 0.05), "{leaning:?}");
        // An open line is what its stroke covers, not what it bends round.
        let bent = line("<path id='trunk' fill='none' stroke='#000' stroke-width='0.5' d='M5 10Q8 7 5 4'/>");
        let most = bent.iter().map(|p| p.x).fold(0.0, f32::max);
        assert!((most - 6.5).abs() < 0.1 && (bent[0].x - 5.0).abs() < 0.3, "{bent:?}");
        assert!(line("").is_empty());
        // One that forks ends there, with arms of whatever width; a lug beside it is no arm.
        for (right, wide) in [(6.0, 0.5), (8.0, 1.0)] {
            let fork =
                line(&format!("<path id='trunk' d='M4.6 10V7L2 4H3L5 6.4L{right} 4H{}L5.4 7V10Z'/>", right + wide));
            let top = fork[fork.len() - 1];
            assert!((top.y + 6.4).abs() < 0.2 && fork.iter().all(|p| (p.x - 5.0).abs() < 0.4), "{fork:?}");
        }
        let lug = line("<path id='trunk' d='M4.5 10V4H5.5V7L6 6.8V7.4L5.5 8V10Z'/>");
        assert!((lug[lug.len() - 1].y + 4.0).abs() < 1e-3, "{lug:?}");
    }

    #[test]
    fn a_stem_stands_on_the_line_up_to_its_top_and_is_free_well_above() {
        let text = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\"><circle cx='5' cy='2' r='2'/>\
                    <rect id='trunk' x='3' y='4' width='1' height='6'/></svg>";
        let drawing = Drawing::read(text.as_bytes()).unwrap();
        let placing = Placing { scale: Vec2::ONE, shift: Vec2::new(0.0, 9.0) };
        let mut leads = Leads::default();
        // The foot is a metre below and half a metre left of where the drawing has it.
        leads.add(&drawing, &placing, &ViewPlane::of(0.0, 0.0), Vec2::new(3.0, -2.0));
        for (y, x) in [(-2.0, 3.0), (1.5, 3.25), (5.0, 3.5)] {
            let place = Vec3::new(1.0, y, 7.0);
            assert!((place + leads.onto(place)).distance(Vec3::new(x, y, 7.0)) < 0.02, "{y}");
        }
        assert_eq!(leads.onto(Vec3::new(1.0, 11.0, 7.0)), Vec3::ZERO);
    }
}
