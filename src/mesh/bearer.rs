//! Where a branch begins: in the wood of its bearer, as that is meshed at the same detail.
//!
//! Rings that are dropped let a bearer stray from its chain by as much as the error lets it, and few sides lie within the circle
//! that they stand for: a branch that began on the chain's own axis would hang in the air beside it. Of grown trees at their
//! full detail a third to a half of all forks did, by 2 mm in the middle and 40 at most. So the first ring of a branch stands on
//! the axis of its bearer as that is meshed, and each of its vertices that would still stick out is drawn in. Where hardly
//! anything would be left of the ring (a branch as thick as its bearer, one at the very end of it) the ring stays as it is, and a
//! cap closes it.

use glam::Vec3;

use super::rings::{Ring, span_at};

/// How near to its foot a vertex is drawn at most, as a share of its way: triangles must not vanish.
const LEAST: f32 = 0.04;
/// How far within the skin a vertex is drawn, as a share: rounding must not leave it outside.
const WITHIN: f32 = 0.98;
/// Steps towards the skin.
const STEPS: usize = 6;
/// A branch whose first ring would be narrower than this share of it is closed by a cap instead.
pub(super) const NARROW: f32 = 0.6;

/// Wood that bears a branch, as it is meshed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bearer<'a> {
    /// Two or more, directed.
    pub(super) rings: &'a [Ring],
    /// Whether its end closes in a point.
    pub(super) is_pointed: bool,
    /// The distance of its sides' middles from the axis is a ring's radius times the first, plus the second, metres.
    pub(super) girth: (f32, f32),
    /// Share of its own first ring that is left in the wood that bears it.
    pub(super) left: f32,
}

impl Bearer<'_> {
    /// The place of its axis that is nearest to `foot`, which lies about `location` of its length.
    pub(super) fn nearest(&self, foot: Vec3, location: f32) -> Vec3 {
        let span = span_at(self.rings, location);
        let on = |span: usize| {
            let (a, b) = (self.rings[span].centre, self.rings[span + 1].centre);
            let t = (foot - a).dot(b - a) / (b - a).length_squared().max(1e-12);
            (a + (b - a) * t.clamp(0.0, 1.0), t)
        };
        let (there, t) = on(span);
        // Lengths along the chain and along the rings are not quite the same.
        let beside = if t < 0.0 && span > 0 {
            on(span - 1).0
        } else if t > 1.0 && span + 2 < self.rings.len() {
            on(span + 1).0
        } else {
            there
        };
        if beside.distance_squared(foot) < there.distance_squared(foot) { beside } else { there }
    }

    /// How far the middles of a ring's sides are from the axis, metres.
    fn radius(&self, ring: usize) -> f32 {
        match ring {
            0 => (self.rings[0].radius * self.girth.0 + self.girth.1) * self.left,
            last if self.is_pointed && last + 1 == self.rings.len() => 0.0,
            _ => self.rings[ring].radius * self.girth.0 + self.girth.1,
        }
    }

    /// How far from the axis the skin is, as a share of how far a place is: 1 or more within it, 0 beyond its end. `span` is where
    /// to look first, and where the place was found.
    fn share(&self, place: Vec3, span: &mut usize, allowed: f32) -> f32 {
        let above = |i: usize| (place - self.rings[i].centre).dot(self.rings[i].tangent) > 0.0;
        let last = self.rings.len() - 1;
        while *span + 1 < last && above(*span + 1) {
            *span += 1;
        }
        while *span > 0 && !above(*span) {
            *span -= 1;
        }
        let (a, b) = (&self.rings[*span], &self.rings[*span + 1]);
        let (way, off) = (b.centre - a.centre, place - a.centre);
        let long = way.length().max(1e-9);
        let straight = way / long;
        let along = off.dot(straight);
        // Its own base lies in the ground or in other wood.
        if *span + 1 == last && along - long > allowed {
            return 0.0;
        }
        // Rings at a bend stand aslant, and the skin between them is that much thinner.
        let (cos_a, cos_b) = (a.tangent.dot(straight).max(0.0), b.tangent.dot(straight).max(0.0));
        let (thick, end) = (self.radius(*span) * cos_a, self.radius(*span + 1) * cos_b);
        let least = cos_a.min(cos_b);
        let aslant = (1.0 - least * least).max(0.0).sqrt() * (end - thick).abs() / long * thick.max(end);
        let here = thick + (end - thick) * (along / long).clamp(0.0, 1.0) - aslant + allowed;
        let out = (off - straight * along).length();
        if here >= out { 1.0 } else { here.max(0.0) / out }
    }

    /// How far from its axis at `foot` all is within its skin, metres: what lies nearer needs no look.
    pub(super) fn room(&self, foot: Vec3, span: usize) -> f32 {
        let (a, b) = (&self.rings[span], &self.rings[span + 1]);
        let (way, off) = (b.centre - a.centre, foot - a.centre);
        let long = way.length().max(1e-9);
        let along = (off.dot(way) / (long * long)).clamp(0.0, 1.0);
        let thick = self.radius(span) * (a.tangent.dot(way) / long);
        let here = thick + (self.radius(span + 1) * (b.tangent.dot(way) / long) - thick) * along;
        // Nearer than its ends only where the skin is as thick on.
        (here * 0.5).min((1.0 - along) * long).max(0.0)
    }

    /// Where a vertex at `place` is to be so that it lies within the skin, on its way from `foot`, which does; out of it by what is
    /// `allowed` at most, metres.
    pub(super) fn within(&self, foot: Vec3, place: Vec3, span: usize, allowed: f32) -> Vec3 {
        let mut span = span;
        let share = self.share(place, &mut span, allowed);
        if share >= 1.0 {
            return place;
        }
        // As if the skin were a cylinder, which it mostly nearly is.
        let way = place - foot;
        let mut inside = share * WITHIN;
        if inside <= LEAST || self.share(foot + way * inside, &mut span, allowed) < 1.0 {
            let mut outside = if inside <= LEAST { 1.0 } else { inside };
            inside = LEAST;
            for _ in 0..STEPS {
                let middle = (inside + outside) * 0.5;
                if self.share(foot + way * middle, &mut span, allowed) >= 1.0 {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
            inside *= WITHIN;
        }
        foot + way * inside
    }
}
