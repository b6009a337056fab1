//! Guiding vectors: how a node's follows from that of the node before it (2015, 3.1.2 and 3.2.1).
//!
//! The paper names two axes of rotation: the cross product of up and the parent's vector (3.1.2), and the one
//! perpendicular to up and the traversed edge (3.2.1). The first keeps a curve in its plane, the second decides where
//! there is no plane yet: over a vertical vector the first is undefined, so the edge's heading takes its place, and over
//! a vertical edge a random one. This is what makes branches leave a trunk on all sides.
//!
//! A rotation never carries a vector past up or down: beyond, the axis would turn over and the next step swing back.

use glam::Vec3;

use crate::base::{Rotation, Seed, math};
use crate::preset::plan::{Guide, GuideStart};

/// Below this sine of its angle to the vertical a vector has no heading.
const UPRIGHT: f32 = 1e-3;

/// One step of a path, from a finalized node to the one after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Guiding vector of the node that the step leaves.
    pub(super) vector: Vec3,
    /// Unit vector along the traversed edge.
    pub(super) edge: Vec3,
    /// Place of the node that the step reaches, plant heights.
    pub(super) position: Vec3,
    /// Edges from the structure to the node that the step reaches, from 1.
    pub(super) hops: u32,
    /// The node of the structure where the path begins.
    pub(super) source: u32,
    /// The node that the step reaches.
    pub(super) node: u32,
    /// Angle by which the vector leans first, from [`start`]; 0 but on the first hop.
    pub(super) lean: f32,
}

impl Step {
    /// The guiding vector of the node that the step reaches.
    pub(super) fn turned(mut self, guide: &Guide, seed: Seed) -> Vec3 {
        if self.lean != 0.0 {
            self.vector = lean(self.vector, self.axis(seed), self.lean);
        }
        let angle = match *guide {
            Guide::Piecewise { first, then, switch } => {
                if self.hops <= switch {
                    first
                } else {
                    then
                }
            }
            Guide::Random { low, high } => {
                if self.hops > 1 {
                    return self.vector;
                }
                seed.child("angle").at(u64::from(self.source)).range(low, high)
            }
            Guide::Polar { theta } => {
                let beta = math::angle(Vec3::Y, self.position);
                theta * (beta / std::f32::consts::PI).sqrt()
            }
        };
        if angle == 0.0 {
            return self.vector;
        }
        lean(self.vector, self.axis(seed), angle)
    }

    fn axis(self, seed: Seed) -> Vec3 {
        heading(self.vector).or_else(|| heading(self.edge)).unwrap_or_else(|| random(seed, self.node))
    }
}

/// The guiding vector with which a node of the structure starts a pass, and the angle by which it leans on the first
/// hop; `kept` is the vector it had. A vector that stands upright has no side to lean to until an edge gives it one.
pub(super) fn start(rule: GuideStart, kept: Vec3, position: Vec3) -> (Vec3, f32) {
    match rule {
        GuideStart::Kept => (kept, 0.0),
        GuideStart::ByHeight { low, high } => {
            let angle = (low + (high - low) * position.y.clamp(0.0, 1.0)).clamp(0.0, std::f32::consts::PI);
            match heading(kept) {
                Some(heading) => (lean(Vec3::Y, heading, angle), 0.0),
                None => (Vec3::Y, angle),
            }
        }
    }
}

/// The horizontal direction in which a vector leans; none where it stands upright.
fn heading(v: Vec3) -> Option<Vec3> {
    let flat = Vec3::new(v.x, 0.0, v.z);
    let length = flat.length();
    (length > UPRIGHT).then(|| flat / length)
}

fn random(seed: Seed, node: u32) -> Vec3 {
    let (sin, cos) = math::sin_cos(seed.child("heading").at(u64::from(node)).unit() * std::f32::consts::TAU);
    Vec3::new(cos, 0.0, sin)
}

/// `v` turned by `angle` away from up, about the axis perpendicular to up and `heading`; it stops at up and at down.
fn lean(v: Vec3, heading: Vec3, angle: f32) -> Vec3 {
    let from_up = math::angle(Vec3::Y, v);
    let angle = (from_up + angle).clamp(0.0, std::f32::consts::PI) - from_up;
    Rotation::about(Vec3::Y.cross(heading), angle).rotate(v).normalize_or(Vec3::Y)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEED: Seed = Seed::new(1);

    fn step(vector: Vec3, edge: Vec3, hops: u32) -> Step {
        Step { vector, edge: edge.normalize(), position: Vec3::Y, hops, source: 4, node: 9, lean: 0.0 }
    }

    #[test]
    fn positive_angles_turn_outwards_towards_the_edge() {
        let guide = Guide::Piecewise { first: 0.5, then: -0.2, switch: 2 };
        let v = step(Vec3::Y, Vec3::new(1.0, 3.0, 0.0), 1).turned(&guide, SEED);
        assert!((v - Vec3::new(math::sin(0.5), math::cos(0.5), 0.0)).length() < 1e-5, "{v}");
        // Further on the vector's own heading counts, not the edge's.
        let w = step(v, Vec3::new(-1.0, 0.0, 1.0), 2).turned(&guide, SEED);
        assert!((w - Vec3::new(math::sin(1.0), math::cos(1.0), 0.0)).length() < 1e-5, "{w}");
        let u = step(w, Vec3::Z, 3).turned(&guide, SEED);
        assert!((u - Vec3::new(math::sin(0.8), math::cos(0.8), 0.0)).length() < 1e-5, "{u}");
    }

    #[test]
    fn a_turn_stops_at_up_and_at_down() {
        let much = Guide::Piecewise { first: 9.0, then: -9.0, switch: 1 };
        let leaning = Vec3::new(0.6, 0.8, 0.0);
        assert!((step(leaning, Vec3::X, 1).turned(&much, SEED) + Vec3::Y).length() < 1e-5);
        assert!((step(leaning, Vec3::X, 2).turned(&much, SEED) - Vec3::Y).length() < 1e-5);
    }

    #[test]
    fn upright_over_an_upright_edge_leans_to_a_random_side() {
        let guide = Guide::Piecewise { first: 1.0, then: 0.0, switch: 1 };
        let sides: Vec<Vec3> =
            (0..64).map(|node| Step { node, ..step(Vec3::Y, Vec3::Y, 1) }.turned(&guide, SEED)).collect();
        assert!(sides.iter().all(|v| (math::angle(*v, Vec3::Y) - 1.0).abs() < 1e-5));
        let mean = sides.iter().sum::<Vec3>() / 64.0;
        assert!(Vec3::new(mean.x, 0.0, mean.z).length() < 0.3, "{mean}");
    }

    #[test]
    fn polar_angles_follow_equation_two() {
        let guide = Guide::Polar { theta: 0.4 };
        let mut step = step(Vec3::Y, Vec3::X, 5);
        step.position = Vec3::X;
        let expected = 0.4 * 0.5_f32.sqrt();
        assert!((math::angle(step.turned(&guide, SEED), Vec3::Y) - expected).abs() < 1e-5);
        step.position = Vec3::Y;
        assert_eq!(step.turned(&guide, SEED), Vec3::Y);
    }

    #[test]
    fn a_random_angle_belongs_to_the_source() {
        let guide = Guide::Random { low: 0.5, high: 2.0 };
        let one = step(Vec3::Y, Vec3::X, 1);
        let same = Step { node: 77, ..one }.turned(&guide, SEED);
        assert_eq!(one.turned(&guide, SEED), same);
        assert_ne!(Step { source: 5, ..one }.turned(&guide, SEED), same);
        assert_eq!(step(same, Vec3::Z, 2).turned(&guide, SEED), same);
    }

    #[test]
    fn start_by_height_leans_from_low_to_high() {
        let rule = GuideStart::ByHeight { low: 1.2, high: 0.2 };
        let middle = Vec3::new(0.0, 0.5, 0.0);
        let (v, lean) = start(rule, Vec3::X, middle);
        assert!((math::angle(v, Vec3::Y) - 0.7).abs() < 1e-5 && lean == 0.0);
        let (vector, lean) = start(rule, Vec3::Y, middle);
        let straight = Guide::Piecewise { first: 0.0, then: 0.0, switch: 1 };
        let w = Step { lean, ..step(vector, Vec3::new(0.0, 1.0, -1.0), 1) }.turned(&straight, SEED);
        assert!((w - Vec3::new(0.0, math::cos(0.7), -math::sin(0.7))).length() < 1e-5, "{w}");
        assert_eq!(start(GuideStart::Kept, Vec3::X, Vec3::Y), (Vec3::X, 0.0));
    }
}
