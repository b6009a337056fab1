//! Where a sketch stands and how large it is: from its canvas to metres in the plane of a view.
//!
//! A crown that is drawn alone stands where the crown's foot is in a level view, and has its middle on the crown's middle in
//! a plan, which has no foot; between, the part of both boxes that comes to lie on each other rises with the sine of the
//! elevation. A marked foot, as a trunk, places it exactly.

use glam::Vec2;

use super::region::Region;
use super::stem::midline;
use super::svg::Drawing;

/// How large a sketch is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SketchSize {
    /// As much area as the crown has as it is seen, at the crown's foot, or about its middle where it is seen from straight
    /// above; with a trunk, the height of the tree.
    Crown,
    /// The box of the crown as it is seen, whatever that does to the sketch's proportions.
    Stretched,
    /// As `Crown`, and the whole tree as much larger or smaller as gives all that is drawn this height in metres, in the plane of
    /// the view. Of an open line it is the height of the canvas: the line is placed by it, and the tree stays as large
    /// as it is.
    Metres(f32),
}

/// The crown that a sketch is fitted to, in the plane of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted<'c> {
    /// Its silhouette.
    pub(super) outline: &'c [Vec2],
    /// Area of that.
    pub(super) area: f32,
    /// Where the tree's foot is seen.
    pub(super) foot: Vec2,
    /// The lowest that is seen of the tree; the foot's in a level view.
    pub(super) low: f32,
    /// Height of the tree from there as it is seen, metres.
    pub(super) height: f32,
    /// How far the view is from level to straight up or down, 0..=1.
    pub(super) steepness: f32,
}

/// A scale and a shift that bring a drawing into a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placing {
    pub(super) scale: Vec2,
    pub(super) shift: Vec2,
}

impl Placing {
    pub(super) fn region(&self, region: &Region) -> Region {
        region.moved(self.scale, self.shift)
    }

    pub(super) fn line(&self, line: &[Vec2]) -> Vec<Vec2> {
        line.iter().map(|p| *p * self.scale + self.shift).collect()
    }
}

/// Places a drawing; `round` for one that is revolved, whose axis is its middle.
pub(super) fn placed(drawing: &Drawing, size: SketchSize, crown: &Fitted<'_>, round: bool) -> Placing {
    let [low, high] = ends(crown.outline);
    let height = crown.height.max(1e-3);
    if drawing.is_open() {
        // The canvas is a picture of the tree as it is seen, from its lowest to its highest; the foot is in the middle, at
        // the trunk's, or where it is marked.
        let [from, to] = drawing.canvas;
        let tall = match size {
            SketchSize::Metres(metres) => metres,
            _ => height,
        };
        let scale = tall / (to.y - from.y).max(1e-6);
        let shift = match (midline(&drawing.trunk).first(), drawing.foot) {
            (None, Some(foot)) => crown.foot - foot * scale,
            (trunk, _) => {
                let middle = trunk.map_or((from.x + to.x) * 0.5, |foot| foot.x);
                Vec2::new(crown.foot.x, crown.low) - Vec2::new(middle, from.y) * scale
            }
        };
        return Placing { scale: Vec2::splat(scale), shift };
    }
    let [drawn_low, drawn_high] = drawing.crown.bounds();
    let drawn = (drawn_high - drawn_low).max(Vec2::splat(1e-6));
    let trunk = drawing.trunk.area() > 0.0;
    let bottom = if trunk { drawn_low.y.min(drawing.trunk.bounds()[0].y) } else { drawn_low.y };
    let foot = midline(&drawing.trunk).first().map_or((drawn_low.x + drawn_high.x) * 0.5, |foot| foot.x);
    let scale = match size {
        SketchSize::Stretched => (high - low).max(Vec2::splat(1e-4)) / drawn,
        SketchSize::Metres(metres) => Vec2::splat(metres / (drawn_high.y - bottom).max(1e-6)),
        SketchSize::Crown if trunk => Vec2::splat(height / (drawn_high.y - bottom).max(1e-6)),
        SketchSize::Crown => {
            let area = if round {
                drawing.crown.moved(Vec2::ONE, middle_shift(drawn_low, drawn_high)).mirrored().area()
            } else {
                drawing.crown.area()
            };
            Vec2::splat((crown.area / area.max(1e-12)).sqrt())
        }
    };
    if let Some(mark) = drawing.foot.filter(|_| !trunk && !round && size != SketchSize::Stretched) {
        return Placing { scale, shift: crown.foot - mark * scale };
    }
    let centre = if round { 0.0 } else { (low.x + high.x) * 0.5 };
    let by_trunk = trunk && size != SketchSize::Stretched;
    // The trunk stands on the foot; a crown alone hangs where the crown did, and a stretched one as high up as that.
    let from = if trunk { foot } else { (drawn_low.x + drawn_high.x) * 0.5 };
    let to = if trunk && !round { crown.foot.x } else { centre };
    // Of a crown alone the lower edge lies on the crown's, or the middle on its middle.
    let risen = 0.5 * crown.steepness;
    let floor = if by_trunk { crown.foot.y } else { low.y + (high.y - low.y) * risen };
    let from_y = if by_trunk { bottom } else { drawn_low.y + (drawn_high.y - drawn_low.y) * risen };
    Placing { scale, shift: Vec2::new(to - from * scale.x, floor - from_y * scale.y) }
}

fn middle_shift(low: Vec2, high: Vec2) -> Vec2 {
    Vec2::new(-(low.x + high.x) * 0.5, 0.0)
}

/// Places a drawing seen from the side, as tall and as high up as the crown from the front was drawn.
pub(super) fn placed_beside(drawing: &Drawing, front: [Vec2; 2], size: SketchSize, crown: &Fitted<'_>) -> Placing {
    let [low, high] = ends(crown.outline);
    let [drawn_low, drawn_high] = drawing.crown.bounds();
    let drawn = (drawn_high - drawn_low).max(Vec2::splat(1e-6));
    let up = (front[1].y - front[0].y).max(1e-4) / drawn.y;
    let across = if size == SketchSize::Stretched { (high.x - low.x).max(1e-4) / drawn.x } else { up };
    // A trunk stands on the foot, from this side too.
    let trunk = midline(&drawing.trunk).first().copied().or(drawing.foot).map(|p| p.x);
    let (from, to) =
        trunk.map_or(((drawn_low.x + drawn_high.x) * 0.5, (low.x + high.x) * 0.5), |foot| (foot, crown.foot.x));
    Placing { scale: Vec2::new(across, up), shift: Vec2::new(to - from * across, front[0].y - drawn_low.y * up) }
}

/// The size to which a tree is deformed, and how many times as large it is afterwards: 1 unless a size in metres is told, and where a
/// line replaces a part of the crown only.
pub(super) fn fitting(drawing: &Drawing, size: SketchSize, crown: &Fitted<'_>, round: bool) -> (SketchSize, f32) {
    if !matches!(size, SketchSize::Metres(_)) || drawing.is_open() {
        return (size, 1.0);
    }
    let [own, usual] = [size, SketchSize::Crown].map(|size| placed(drawing, size, crown, round).scale.y);
    match own / usual {
        times if times.is_finite() => (SketchSize::Crown, times.clamp(1e-3, 1e3)),
        _ => (size, 1.0),
    }
}

/// Lower left and upper right corner of a ring.
pub(super) fn ends(ring: &[Vec2]) -> [Vec2; 2] {
    let (low, high) = ring.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    if low.is_finite() { [low, high] } else { [Vec2::ZERO; 2] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawing(body: &str) -> Drawing {
        let text = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\">{body}</svg>");
        Drawing::read(text.as_bytes()).unwrap()
    }

    const CROWN: [Vec2; 4] = [Vec2::new(-2.0, 3.0), Vec2::new(4.0, 3.0), Vec2::new(4.0, 9.0), Vec2::new(-2.0, 9.0)];

    fn fitted(size: SketchSize, body: &str) -> [Vec2; 2] {
        fitted_from(0.0, size, body)
    }

    fn fitted_from(steepness: f32, size: SketchSize, body: &str) -> [Vec2; 2] {
        let crown = Fitted { outline: &CROWN, area: 36.0, foot: Vec2::ZERO, low: 0.0, height: 10.0, steepness };
        let drawing = drawing(body);
        placed(&drawing, size, &crown, false).region(&drawing.crown).bounds()
    }

    #[test]
    fn sketches_stand_where_the_crown_stood() {
        let wide = "<rect x='1' y='1' width='8' height='2'/>";
        let [low, high] = fitted(SketchSize::Crown, wide);
        assert!(low.distance(Vec2::new(-5.0, 3.0)) < 1e-3 && high.distance(Vec2::new(7.0, 6.0)) < 1e-3);
        let [low, high] = fitted(SketchSize::Stretched, wide);
        assert!(low.distance(CROWN[0]) < 1e-3 && high.distance(CROWN[2]) < 1e-3);
        let [low, high] = fitted(SketchSize::Metres(4.0), wide);
        assert!(low.distance(Vec2::new(-7.0, 3.0)) < 1e-3 && high.distance(Vec2::new(9.0, 7.0)) < 1e-3);
    }

    #[test]
    fn a_marked_trunk_stands_on_the_ground() {
        let body = "<rect x='2' width='6' height='6'/><rect id='trunk' x='4' y='6' width='2' height='4'/>";
        let [low, high] = fitted(SketchSize::Crown, body);
        assert!(low.distance(Vec2::new(-3.0, 4.0)) < 1e-3 && high.distance(Vec2::new(3.0, 10.0)) < 1e-3);
    }

    #[test]
    fn a_plan_lies_on_the_crown_s_middle_and_what_is_between_between() {
        let wide = "<rect x='1' y='1' width='8' height='2'/>";
        for (steepness, low) in [(0.0, 3.0), (0.5, 3.75), (1.0, 4.5)] {
            let [a, b] = fitted_from(steepness, SketchSize::Crown, wide);
            assert!(a.distance(Vec2::new(-5.0, low)) < 1e-3 && b.distance(Vec2::new(7.0, low + 3.0)) < 1e-3);
            let [a, b] = fitted_from(steepness, SketchSize::Stretched, wide);
            assert!(a.distance(CROWN[0]) < 1e-3 && b.distance(CROWN[2]) < 1e-3);
        }
        let [low, high] = fitted_from(1.0, SketchSize::Metres(4.0), wide);
        assert!(low.distance(Vec2::new(-7.0, 4.0)) < 1e-3 && high.distance(Vec2::new(9.0, 8.0)) < 1e-3);
    }

    #[test]
    fn a_marked_foot_stands_where_the_foot_is_seen() {
        let body = "<rect x='1' y='1' width='8' height='2'/><circle id='foot' cx='2' cy='4' r='0.3'/>";
        for steepness in [0.0, 0.6, 1.0] {
            let [low, high] = fitted_from(steepness, SketchSize::Metres(4.0), body);
            assert!(low.distance(Vec2::new(-2.0, 2.0)) < 1e-3 && high.distance(Vec2::new(14.0, 6.0)) < 1e-3);
        }
    }

    #[test]
    fn a_line_in_metres_is_placed_in_metres_and_the_tree_stays_as_large_as_it_is() {
        let crown = Fitted { outline: &CROWN, area: 36.0, foot: Vec2::X, low: -1.0, height: 10.0, steepness: 0.5 };
        let line = "<path fill='none' stroke='#000' d='M2 2Q5 0 8 2'/>";
        for (mark, at) in
            [("", Vec2::new(-5.0, 15.0)), ("<circle id='foot' cx='4' cy='6' r='1'/>", Vec2::new(-3.0, 8.0))]
        {
            let drawing = drawing(&format!("{line}{mark}"));
            let placing = placed(&drawing, SketchSize::Metres(20.0), &crown, false);
            assert!(placing.line(&drawing.open)[0].distance(at) < 1e-3, "{mark}");
            assert_eq!(fitting(&drawing, SketchSize::Metres(20.0), &crown, false), (SketchSize::Metres(20.0), 1.0));
        }
    }
}
