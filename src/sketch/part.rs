//! Where an open sketch acts: about the part of the silhouette that it replaces (2018, 5.1).
//!
//! Mean value coordinates reach through all of a cage, so a bump on one side would pull a little at every lobe, and at the
//! stem that bears the other side. So lobes take part as near as they are to what lies between the old part and the
//! line: those within it wholly, others less and less, and none beyond [`FAR`] of the part's length. Filling, depth, rims and
//! pruning keep to the same. A closed sketch acts everywhere.

use glam::Vec2;

use super::outline::Edges;
use crate::base::math;

/// How far from what is replaced a sketch acts: over the length of the part, and at most over the crown's size.
const FAR: (f32, f32) = (0.5, 0.25);
/// Share of that within which it acts wholly.
const WHOLE: f32 = 0.2;

/// The part of a crown about which a sketch acts.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// What lies between the old part and the line.
    between: Edges,
    far: f32,
}

impl Part {
    /// The part of a crown of this size between a part of its silhouette and the line that replaces it; both run the same
    /// way.
    pub(super) fn new(old: &[Vec2], line: &[Vec2], size: f32) -> Self {
        let length: f32 = old.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let between: Vec<Vec2> = old.iter().chain(line.iter().rev()).copied().collect();
        Self { between: Edges::new(&between), far: (length * FAR.0).min(size * FAR.1) }
    }

    /// How much the sketch acts at a place, 0..=1.
    pub(super) fn at(&self, p: Vec2) -> f32 {
        let (inside, off) = self.between.at(p);
        if inside {
            return 1.0;
        }
        1.0 - math::smoothstep(self.far * WHOLE, self.far.max(1e-9), off.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sketch_acts_between_the_old_part_and_the_line_and_less_and_less_beside() {
        let old = [Vec2::ZERO, Vec2::Y * 4.0];
        let line = [Vec2::ZERO, Vec2::new(3.0, 2.0), Vec2::Y * 4.0];
        let part = Part::new(&old, &line, 100.0);
        assert_eq!([part.at(Vec2::new(1.0, 2.0)), part.at(Vec2::new(-2.1, 2.0))], [1.0, 0.0]);
        let along: Vec<f32> = (0..40).map(|i| part.at(Vec2::new(i as f32 * -0.06, 2.0))).collect();
        assert!(along.windows(2).all(|pair| pair[1] <= pair[0] && pair[0] - pair[1] < 0.1), "{along:?}");
    }
}
