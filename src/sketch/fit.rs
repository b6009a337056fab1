//! Where a sketch stands and how large it is: from its canvas to metres in the plane of a view.

use glam::Vec2;

use super::region::Region;
use super::stem::midline;
use super::svg::Drawing;

/// How large a sketch is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SketchSize {
    /// As much area as the crown has, at the crown's foot; with a trunk, the height of the tree.
    Crown,
    /// The box of the crown, whatever that does to the sketch's proportions.
    Stretched,
    /// This height in metres of all that is drawn: with a trunk on the ground, without one at the crown's foot.
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
    /// Height of the tree, metres.
    pub(super) height: f32,
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
        // The canvas is a picture of the tree: from the ground to its top, the foot in the middle, or at the trunk's.
        let [from, to] = drawing.canvas;
        let tall = match size {
            SketchSize::Metres(metres) => metres,
            _ => height,
        };
        let scale = tall / (to.y - from.y).max(1e-6);
        let middle = midline(&drawing.trunk).first().map_or((from.x + to.x) * 0.5, |foot| foot.x);
        let shift = crown.foot - Vec2::new(middle, from.y) * scale;
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
    let centre = if round { 0.0 } else { (low.x + high.x) * 0.5 };
    let by_trunk = trunk && size != SketchSize::Stretched;
    // The trunk stands on the foot; a crown alone hangs where the crown did, and a stretched one as high up as that.
    let from = if trunk { foot } else { (drawn_low.x + drawn_high.x) * 0.5 };
    let to = if trunk && !round { crown.foot.x } else { centre };
    let floor = if by_trunk { crown.foot.y } else { low.y };
    let from_y = if by_trunk { bottom } else { drawn_low.y };
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
    let trunk = midline(&drawing.trunk).first().map(|p| p.x);
    let (from, to) =
        trunk.map_or(((drawn_low.x + drawn_high.x) * 0.5, (low.x + high.x) * 0.5), |foot| (foot, crown.foot.x));
    Placing { scale: Vec2::new(across, up), shift: Vec2::new(to - from * across, front[0].y - drawn_low.y * up) }
}

/// How much larger a sketch makes a tree than the same sketch would that is as large as its crown: its height, and its
/// crown. Both are 1 unless a size in metres is told.
pub(super) fn grown(drawing: &Drawing, size: SketchSize, crown: &Fitted<'_>, round: bool) -> [f32; 2] {
    let SketchSize::Metres(metres) = size else { return [1.0; 2] };
    let both = if drawing.is_open() {
        [metres / crown.height.max(1e-3); 2]
    } else {
        let [own, usual] = [size, SketchSize::Crown].map(|size| placed(drawing, size, crown, round));
        let top = |placing: &Placing| drawing.crown.bounds()[1].y * placing.scale.y + placing.shift.y - crown.foot.y;
        [top(&own) / top(&usual), own.scale.y / usual.scale.y]
    };
    both.map(|share| if share.is_finite() { share.clamp(1e-3, 1e3) } else { 1.0 })
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
        let crown = Fitted { outline: &CROWN, area: 36.0, foot: Vec2::ZERO, height: 10.0 };
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
}
