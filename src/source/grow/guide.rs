//! Guiding vectors: how a node's follows from that of the node before it (2015, 3.1.2 and 3.2.1).
//!
//! The paper names two axes of rotation: the cross product of up and the parent's vector (3.1.2), and the one
//! perpendicular to up and the traversed edge (3.2.1). The first keeps a curve in its plane, the second decides where
//! there is no plane yet: over a vertical vector the first is undefined, so the edge's heading takes its place, and over
//! a vertical edge a random one. This is what makes branches leave a trunk on all sides. All that follow a leaning node
//! have one vector by that; a species may ask for the second axis everywhere ([`GuideAxis::Edge`]), by which what follows
//! a limb spreads to both of its sides, as far as the limb points up or down: a level vector along the axis stays.
//!
//! Three rules need no rotation chain of their own: a split chooses between two by where the branch leaves the
//! structure, so a branch keeps its rule to the end (Fig. 17b); a field gives vectors by place (`field`); and a random
//! angle is drawn for the source node, so that all branches of one node share it, as in Fig. 6c.
//!
//! A rotation never carries a vector past up or down: beyond, the axis would turn over and the next step swing back.

use glam::Vec3;

use super::field;
use crate::base::{Seed, math};
use crate::preset::plan::{Guide, GuideAxis, GuideStart};

/// Below this sine of its angle to the vertical a vector has no heading.
const UPRIGHT: f32 = 1e-3;

/// One step of a path, from a finalized node to the one after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Guiding vector of the node that the step leaves.
    pub(super) vector: Vec3,
    /// Along the traversed edge, of any length.
    pub(super) edge: Vec3,
    /// What decides about the axis.
    pub(super) axis: GuideAxis,
    /// Place of the node that the step reaches, plant heights.
    pub(super) position: Vec3,
    /// Edges from the structure to the node that the step reaches, from 1.
    pub(super) hops: u32,
    /// The node of the structure where the path begins.
    pub(super) source: u32,
    /// Its height.
    pub(super) source_height: f32,
    /// The node that the step reaches.
    pub(super) node: u32,
    /// Angle by which the vector leans first, from [`start`]; 0 but on the first hop.
    pub(super) lean: f32,
}

impl Step {
    /// The guiding vector of the node that the step reaches; `sines` are those of the guide.
    pub(super) fn turned(mut self, guide: &Guide, sines: &Sines, seed: Seed) -> Vec3 {
        let guide = rule(guide, self.source_height);
        if let Guide::Field { parts } = guide {
            return field::vector(parts, self.position).unwrap_or(self.vector);
        }
        if self.lean != 0.0 {
            self.vector = self.leaned(seed, self.lean, math::sin_cos(self.lean));
        }
        let angle = self.angle(guide, seed);
        if angle == 0.0 {
            return self.vector;
        }
        self.leaned(seed, angle, sines.of(angle))
    }

    /// The vector turned by an angle about its axis.
    fn leaned(&self, seed: Seed, angle: f32, sines: (f32, f32)) -> Vec3 {
        let of_edge = || heading(self.edge.normalize_or(Vec3::Y));
        let by_chance = || random(seed, self.node);
        match self.axis {
            GuideAxis::Vector => {
                let heading = heading(self.vector).or_else(of_edge).unwrap_or_else(by_chance);
                lean(self.vector, heading, angle, sines)
            }
            GuideAxis::Edge => {
                let heading = of_edge().or_else(|| heading(self.vector)).unwrap_or_else(by_chance);
                lean_beside(self.vector, heading, angle, sines)
            }
        }
    }

    /// By how much a vector turns on this step, radians.
    fn angle(&self, guide: &Guide, seed: Seed) -> f32 {
        let piecewise = |alpha1: f32, alpha2: f32, h0: u32| if self.hops <= h0 { alpha1 } else { alpha2 };
        match *guide {
            Guide::Constant { alpha } => alpha,
            Guide::Piecewise { alpha1, alpha2, h0 } => piecewise(alpha1, alpha2, h0),
            Guide::Random { low, high, alpha2, h0 } => {
                piecewise(seed.child("angle").at(u64::from(self.source)).range(low, high), alpha2, h0)
            }
            Guide::Polar { theta } => {
                let beta = math::angle(Vec3::Y, self.position);
                theta * (beta / std::f32::consts::PI).sqrt()
            }
            // `rule` has taken the first apart as far as it goes, and the second has no angle.
            Guide::Split { .. } | Guide::Field { .. } => 0.0,
        }
    }
}

/// Sines and cosines of the angles that a rule names: millions of steps turn by the same two.
#[derive(Clone, Debug)]
pub(super) struct Sines(Vec<(f32, (f32, f32))>);

impl Sines {
    /// Of all angles that a rule names.
    pub(super) fn new(guide: &Guide) -> Self {
        let mut angles = Vec::new();
        named(guide, &mut angles);
        Self(angles.into_iter().map(|angle| (angle, math::sin_cos(angle))).collect())
    }

    /// Sine and cosine of an angle, named or not.
    fn of(&self, angle: f32) -> (f32, f32) {
        self.0.iter().find(|known| known.0 == angle).map_or_else(|| math::sin_cos(angle), |known| known.1)
    }
}

fn named(guide: &Guide, angles: &mut Vec<f32>) {
    match guide {
        Guide::Constant { alpha } => angles.push(*alpha),
        Guide::Piecewise { alpha1, alpha2, .. } => angles.extend([*alpha1, *alpha2]),
        Guide::Random { alpha2, .. } => angles.push(*alpha2),
        Guide::Split { lower, upper, .. } => {
            named(lower, angles);
            named(upper, angles);
        }
        Guide::Polar { .. } | Guide::Field { .. } => {}
    }
}

/// What a rule asks of a step beyond vectors and hops: whether where it is, and whether how high its branch begins.
pub(super) fn asks(guide: &Guide) -> (bool, bool) {
    match guide {
        Guide::Constant { .. } | Guide::Piecewise { .. } | Guide::Random { .. } => (false, false),
        Guide::Polar { .. } | Guide::Field { .. } => (true, false),
        Guide::Split { lower, upper, .. } => (asks(lower).0 || asks(upper).0, true),
    }
}

/// Whether vectors are set by place and not turned, for a branch that leaves the structure at a height.
pub(super) fn is_set(guide: &Guide, height: f32) -> bool {
    matches!(rule(guide, height), Guide::Field { .. })
}

/// The rule for a branch that leaves the structure at a height.
fn rule(guide: &Guide, height: f32) -> &Guide {
    match guide {
        Guide::Split { height: at, lower, upper } => rule(if height < *at { lower } else { upper }, height),
        other => other,
    }
}

/// The guiding vector with which a node of the structure starts a pass, and the angle by which it leans on the first
/// hop; `kept` is the vector it had. A vector that stands upright has no side to lean to until an edge gives it one.
/// Under a field the structure's vectors are the field's, whatever the start.
pub(super) fn start(start: GuideStart, guide: &Guide, kept: Vec3, position: Vec3) -> (Vec3, f32) {
    if let Guide::Field { parts } = rule(guide, position.y) {
        return (field::vector(parts, position).unwrap_or(kept), 0.0);
    }
    match start {
        GuideStart::Kept => (kept, 0.0),
        GuideStart::ByHeight { low, high } => {
            let angle = (low + (high - low) * position.y.clamp(0.0, 1.0)).clamp(0.0, std::f32::consts::PI);
            match heading(kept) {
                Some(heading) => (lean(Vec3::Y, heading, angle, math::sin_cos(angle)), 0.0),
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

/// `v` turned by `angle` away from up, in the plane of up and `heading` (a horizontal unit vector on `v`'s side); it stops
/// at up and at down. The angle comes with its sine and cosine.
fn lean(v: Vec3, heading: Vec3, angle: f32, (sin, cos): (f32, f32)) -> Vec3 {
    // Sine and cosine of the way from up; the sums' formulas turn it without asking for the angle.
    let (across, up) = (v.dot(heading).max(0.0), v.y);
    let (across, up) = (across * cos + up * sin, up * cos - across * sin);
    if angle.abs() >= std::f32::consts::PI || across < 0.0 {
        return if angle > 0.0 { Vec3::NEG_Y } else { Vec3::Y };
    }
    (heading * across + Vec3::Y * up).normalize_or(Vec3::Y)
}

/// The same for a vector that may lie aside of that plane: what of it does stays, and the rest turns, away from up and
/// towards `heading`.
fn lean_beside(v: Vec3, heading: Vec3, angle: f32, (sin, cos): (f32, f32)) -> Vec3 {
    let (across, up) = (v.dot(heading), v.y);
    let aside = v - heading * across - Vec3::Y * up;
    let (to_across, to_up) = (across * cos + up * sin, up * cos - across * sin);
    // From the side of `heading` it stops at up, and from either side at down.
    let passes = if across >= 0.0 { to_across < 0.0 } else { angle < 0.0 && to_across > 0.0 };
    let flat = if angle.abs() >= std::f32::consts::PI || passes {
        let stop = if angle > 0.0 || across < 0.0 { Vec3::NEG_Y } else { Vec3::Y };
        stop * (across * across + up * up).sqrt()
    } else {
        heading * to_across + Vec3::Y * to_up
    };
    (aside + flat).normalize_or(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::plan::{FieldPart, FieldPrimitive, FieldRegion};

    const SEED: Seed = Seed::new(1);

    fn step(vector: Vec3, edge: Vec3, hops: u32) -> Step {
        let edge = edge.normalize();
        Step {
            vector,
            edge,
            axis: GuideAxis::Vector,
            position: Vec3::Y,
            hops,
            source: 4,
            source_height: 0.5,
            node: 9,
            lean: 0.0,
        }
    }

    impl Step {
        fn by(self, guide: &Guide, seed: Seed) -> Vec3 {
            self.turned(guide, &Sines::new(guide), seed)
        }
    }

    fn piecewise(alpha1: f32, alpha2: f32, h0: u32) -> Guide {
        Guide::Piecewise { alpha1, alpha2, h0 }
    }

    /// Angles from upright after each of `hops` steps of a path that goes on in its own direction.
    fn leans(guide: &Guide, start: Vec3, hops: u32) -> Vec<f32> {
        let mut v = start;
        (1..=hops)
            .map(|h| {
                v = step(v, Vec3::new(1.0, 1.0, 0.0), h).by(guide, SEED);
                math::angle(v, Vec3::Y).to_degrees()
            })
            .collect()
    }

    #[test]
    fn positive_angles_turn_outwards_towards_the_edge() {
        let guide = piecewise(0.5, -0.2, 2);
        let v = step(Vec3::Y, Vec3::new(1.0, 3.0, 0.0), 1).by(&guide, SEED);
        assert!((v - Vec3::new(math::sin(0.5), math::cos(0.5), 0.0)).length() < 1e-5, "{v}");
        // Further on the vector's own heading counts, not the edge's.
        let w = step(v, Vec3::new(-1.0, 0.0, 1.0), 2).by(&guide, SEED);
        assert!((w - Vec3::new(math::sin(1.0), math::cos(1.0), 0.0)).length() < 1e-5, "{w}");
        let u = step(w, Vec3::Z, 3).by(&guide, SEED);
        assert!((u - Vec3::new(math::sin(0.8), math::cos(0.8), 0.0)).length() < 1e-5, "{u}");
    }

    #[test]
    fn a_constant_angle_is_added_at_every_hop() {
        // Fig. 5, left: 4 degrees a hop.
        for (i, lean) in leans(&Guide::Constant { alpha: 4_f32.to_radians() }, Vec3::Y, 20).iter().enumerate() {
            assert!((lean - 4.0 * (i + 1) as f32).abs() < 1e-3, "{i}: {lean}");
        }
    }

    #[test]
    fn equation_one_switches_after_h0_hops() {
        // Fig. 5, right: 6 degrees for 20 hops, then back.
        let leans = leans(&piecewise(6_f32.to_radians(), -6_f32.to_radians(), 20), Vec3::Y, 30);
        for (i, lean) in leans.iter().enumerate() {
            let hop = i as f32 + 1.0;
            let expected = if hop <= 20.0 { 6.0 * hop } else { 120.0 - 6.0 * (hop - 20.0) };
            assert!((lean - expected).abs() < 2e-3, "hop {hop}: {lean}");
        }
    }

    #[test]
    fn with_h0_one_a_branch_leaves_at_its_angle_and_runs_straight() {
        // Fig. 6b.
        let leans = leans(&piecewise(60_f32.to_radians(), 0.0, 1), Vec3::Y, 6);
        assert!(leans.iter().all(|lean| (lean - 60.0).abs() < 1e-3), "{leans:?}");
    }

    #[test]
    fn a_turn_stops_at_up_and_at_down() {
        let much = piecewise(9.0, -9.0, 1);
        let leaning = Vec3::new(0.6, 0.8, 0.0);
        assert!((step(leaning, Vec3::X, 1).by(&much, SEED) + Vec3::Y).length() < 1e-5);
        assert!((step(leaning, Vec3::X, 2).by(&much, SEED) - Vec3::Y).length() < 1e-5);
    }

    #[test]
    fn what_follows_a_leaning_node_spreads_to_its_sides_about_the_edges_axis_only() {
        let guide = piecewise(0.6, 0.0, 1);
        // A limb that rises along x, and edges to its left, ahead and to its right.
        let limb = Vec3::new(0.6, 0.8, 0.0);
        let by = |axis, side: f32| Step { axis, ..step(limb, Vec3::new(1.0, 0.5, side), 1) }.by(&guide, SEED);
        let [left, ahead, right] = [-1.0, 0.0, 1.0].map(|side| by(GuideAxis::Vector, side));
        assert!(left == ahead && ahead == right && ahead.z == 0.0);
        let [left, ahead, right] = [-1.0, 0.0, 1.0].map(|side| by(GuideAxis::Edge, side));
        assert!((ahead - by(GuideAxis::Vector, 0.0)).length() < 1e-5);
        assert!(left.z < -0.2 && right.z > 0.2 && (left.z + right.z).abs() < 1e-5, "{left} {right}");
        // A rotation about the axis that is square to up and the edge: what lies along that stays.
        let axis = Vec3::Y.cross(Vec3::new(1.0, 0.0, 1.0)).normalize();
        assert!((right.dot(axis) - limb.dot(axis)).abs() < 1e-5);
        let across = |v: Vec3| v - axis * v.dot(axis);
        assert!((math::angle(across(limb), across(right)) - 0.6).abs() < 1e-4);
        // Over upright vectors both are one, and a turn stops at up and down.
        for side in [-1.0, 0.3] {
            let of = |axis| Step { axis, ..step(Vec3::Y, Vec3::new(0.4, 1.0, side), 1) }.by(&guide, SEED);
            assert!((of(GuideAxis::Edge) - of(GuideAxis::Vector)).length() < 1e-5);
        }
        for (turn, y) in [(-2.5, 1.0), (2.5, -1.0), (-9.0, 1.0), (9.0, -1.0)] {
            let stopped =
                Step { axis: GuideAxis::Edge, ..step(limb, Vec3::X, 1) }.by(&Guide::Constant { alpha: turn }, SEED);
            assert!((stopped - Vec3::Y * y).length() < 1e-5, "{turn}: {stopped}");
        }
    }

    #[test]
    fn upright_over_an_upright_edge_leans_to_a_random_side() {
        let guide = piecewise(1.0, 0.0, 1);
        let sides: Vec<Vec3> =
            (0..64).map(|node| Step { node, ..step(Vec3::Y, Vec3::Y, 1) }.by(&guide, SEED)).collect();
        assert!(sides.iter().all(|v| (math::angle(*v, Vec3::Y) - 1.0).abs() < 1e-5));
        let mean = sides.iter().sum::<Vec3>() / 64.0;
        assert!(Vec3::new(mean.x, 0.0, mean.z).length() < 0.3, "{mean}");
    }

    #[test]
    fn polar_angles_follow_equation_two() {
        let theta = 25_f32.to_radians();
        for degrees in [0.0_f32, 5.0, 22.5, 45.0, 90.0, 135.0] {
            let (sin, cos) = math::sin_cos(degrees.to_radians());
            let here = Step { position: Vec3::new(0.0, cos, sin) * 0.7, ..step(Vec3::Y, Vec3::X, 5) };
            let turned = math::angle(here.by(&Guide::Polar { theta }, SEED), Vec3::Y);
            assert!((turned - theta * (degrees / 180.0).sqrt()).abs() < 1e-5, "{degrees}: {turned}");
        }
    }

    #[test]
    fn a_random_angle_belongs_to_the_source_and_lasts_h0_hops() {
        let (low, high) = (30_f32.to_radians(), 120_f32.to_radians());
        let guide = Guide::Random { low, high, alpha2: 0.0, h0: 1 };
        let one = step(Vec3::Y, Vec3::X, 1);
        let same = Step { node: 77, ..one }.by(&guide, SEED);
        assert_eq!(one.by(&guide, SEED), same);
        assert_ne!(Step { source: 5, ..one }.by(&guide, SEED), same);
        assert_eq!(step(same, Vec3::Z, 2).by(&guide, SEED), same);
        let angles: Vec<f32> =
            (0..400).map(|source| math::angle(Step { source, ..one }.by(&guide, SEED), Vec3::Y).to_degrees()).collect();
        assert!(angles.iter().all(|a| (29.99..120.01).contains(a)));
        let mean = angles.iter().sum::<f32>() / 400.0;
        assert!((mean - 75.0).abs() < 4.0 && angles.iter().any(|a| *a < 40.0) && angles.iter().any(|a| *a > 110.0));
        // Then α2.
        let on = Guide::Random { low, high, alpha2: -0.1, h0: 1 };
        let next = step(same, Vec3::Z, 2).by(&on, SEED);
        assert!((math::angle(next, Vec3::Y) - math::angle(same, Vec3::Y) + 0.1).abs() < 1e-5);
    }

    #[test]
    fn a_split_is_decided_where_the_branch_leaves() {
        let guide = Guide::Split {
            height: 0.4,
            lower: Box::new(Guide::Constant { alpha: 0.1 }),
            upper: Box::new(piecewise(0.5, -0.2, 3)),
        };
        let turn = |source_height: f32, y: f32| {
            let position = Vec3::Y * y;
            math::angle(Step { source_height, position, ..step(Vec3::Y, Vec3::X, 1) }.by(&guide, SEED), Vec3::Y)
        };
        // However high the branch has climbed, or hung, since.
        assert!((turn(0.39, 0.9) - 0.1).abs() < 1e-5 && (turn(0.4, 0.1) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn a_field_sets_vectors_by_place_alone_and_also_those_of_the_structure() {
        let part = |primitive| FieldPart { primitive, weight: 1.0, region: FieldRegion::Everywhere };
        let guide = Guide::Field { parts: vec![part(FieldPrimitive::Radial { height: 0.0 })] };
        let here = Step { position: Vec3::new(0.3, 0.4, 0.0), ..step(Vec3::NEG_Y, Vec3::Z, 7) };
        assert!((here.by(&guide, SEED) - Vec3::new(0.6, 0.8, 0.0)).length() < 1e-6);
        let by_height = GuideStart::ByHeight { low: 1.0, high: 1.0 };
        assert_eq!(start(by_height, &guide, Vec3::X, Vec3::Y), (Vec3::Y, 0.0));
        // Where the field vanishes, the vector before goes on.
        let centre = Step { position: Vec3::ZERO, ..here };
        assert_eq!(centre.by(&guide, SEED), Vec3::NEG_Y);
        assert_eq!(start(by_height, &guide, Vec3::X, Vec3::ZERO), (Vec3::X, 0.0));
    }

    #[test]
    fn start_by_height_leans_from_low_to_high() {
        let rule = GuideStart::ByHeight { low: 1.2, high: 0.2 };
        let straight = piecewise(0.0, 0.0, 1);
        let middle = Vec3::new(0.0, 0.5, 0.0);
        let (v, lean) = start(rule, &straight, Vec3::X, middle);
        assert!((math::angle(v, Vec3::Y) - 0.7).abs() < 1e-5 && lean == 0.0);
        let (vector, lean) = start(rule, &straight, Vec3::Y, middle);
        let w = Step { lean, ..step(vector, Vec3::new(0.0, 1.0, -1.0), 1) }.by(&straight, SEED);
        assert!((w - Vec3::new(0.0, math::cos(0.7), -math::sin(0.7))).length() < 1e-5, "{w}");
        assert_eq!(start(GuideStart::Kept, &straight, Vec3::X, Vec3::Y), (Vec3::X, 0.0));
    }
}
