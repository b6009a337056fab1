//! Roots: a foot that flares is drawn out into a few buttresses.
//!
//! By how much a ring of a stem is wider than the wood above its flare is shared out by direction: more where a root runs, less
//! between two, as much in the mean. So roots end where the flare does, no skin lies within the wood above it, and bark goes
//! round as on a round foot.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::rings::{Ring, folds};
use crate::base::{Seed, math};
use crate::plant::Curve;

/// Fewest roots of a foot, and how many more there may be at most.
const COUNT: (u32, u32) = (4, 2);
/// How narrow they are: of a root of so many, what is left at an angle off its middle is `exp(narrow · (cos angle − 1))` (von Mises).
const NARROW: f32 = 5.0;
/// How far from even distances they stand, and by how much one may be weaker than another.
const UNEVEN: f32 = 0.3;
const WEAKER: f32 = 0.4;
/// Sides of a foot that shows its roots, for twelve of a round one and at most, and the fewest that can.
const SIDES: u32 = 28;
const LEAST_SIDES: u32 = 8;
/// How upright a stem with roots is: the rise of a metre of it, metres.
const UPRIGHT: f32 = 0.5;
/// How straight it is: the cosine between its foot and any ring there.
const STRAIGHT: f32 = 0.8;
/// Roots that move the skin by less of its error are not drawn.
const WORTH: f32 = 0.5;

/// Sides of a stem whose roots are drawn, where so many are usual: coarse wood gets none for them that it can't pay.
pub(super) const fn sides(usual: u32) -> u32 {
    let wanted = usual * SIDES / 12;
    if wanted < SIDES { wanted } else { SIDES }
}

/// How far up roots run, in radii of the stem at the ground, and as a share of its length at most; and how far at least below
/// the lowest branch, in radii.
const REACH: (f32, f32) = (4.0, 0.12);
const LEAST_REACH: f32 = 0.6;

/// The foot of a stem: as far as it is wider than the wood above.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Foot {
    /// Share of what it is wider that roots take, 0..=1.
    pub(super) share: f32,
    /// Where it ends: length along the stem, and the radius of the wood there, metres.
    end: f32,
    above: f32,
    /// Up to where the stem bears nothing, metres along it: a branch would begin beside the skin between two roots.
    clear: f32,
    /// To which side what it bears is heavier, level.
    pull: Vec2,
}

impl Foot {
    /// Of a stem with these points and radii; one that lies on the ground has no roots all round it.
    pub(super) fn of(points: &[Vec3], radii: &[f32]) -> Self {
        let stands = matches!(points, [foot, next, ..] if (next - foot).normalize_or_zero().y > UPRIGHT);
        if !stands {
            return Self::default();
        }
        let curve = Curve::new(points);
        let length = curve.length();
        let end = (radii[0] * REACH.0).min(length * REACH.1);
        let above = curve.value(radii, f64::from(end / length.max(1e-9)));
        Self { share: 1.0, end, above, clear: f32::INFINITY, pull: Vec2::ZERO }
    }

    /// With such a share of its flare in roots, 0..=1.
    pub(super) fn with(self, share: f32) -> Self {
        Self { share: self.share * share, ..self }
    }

    /// With a branch of such a radius that leaves it so far up and ends so far aside of the foot, metres.
    pub(super) fn bears(&mut self, along: f32, radius: f32, aside: Vec3) {
        self.clear = self.clear.min(along - radius);
        self.pull += Vec2::new(aside.x, aside.z) * (radius * radius);
    }

    /// On these rings: where branches leave the stem before its roots would end, those end with the last ring below the lowest, or
    /// there are none.
    pub(super) fn below_branches(self, rings: &[Ring]) -> Self {
        // Skin runs straight to the first ring beyond them.
        let reach = rings.iter().find(|ring| ring.arc >= self.end).map_or(f32::INFINITY, |ring| ring.arc);
        if self.clear >= reach {
            return self;
        }
        match rings.iter().rfind(|ring| ring.arc <= self.clear) {
            Some(last) if last.arc >= rings[0].radius * LEAST_REACH => {
                Self { end: last.arc, above: last.radius, ..self }
            }
            _ => Self::default(),
        }
    }

    /// By how much its roots are turned, radians: they stand by what the tree bears, so that no two trees have the same, and those of a
    /// tree that changes turn as it does.
    pub(super) fn turn(&self) -> f32 {
        math::atan2(self.pull.y, self.pull.x)
    }

    /// How far the skin lies within a ring between two roots and, times their height, out of it on them, metres.
    pub(super) fn spread(&self, ring: &Ring) -> f32 {
        let fades = 1.0 - math::smoothstep(0.5, 1.0, ring.arc / self.end.max(1e-9));
        self.share * (ring.radius - self.above).max(0.0) * fades
    }

    /// Whether roots are worth drawing on a foot of so many sides with these rings, none of which folds with them.
    pub(super) fn shows(&self, rings: &[Ring], (sides, error): (u32, f32)) -> bool {
        let [first, ..] = rings else { return false };
        let widest = |ring: &Ring| Ring { radius: ring.radius + HIGHEST * self.spread(ring), ..*ring };
        let is_foot = |pair: &&[Ring; 2]| pair[0].arc < self.end;
        let is_straight = |ring: &Ring| ring.tangent.dot(first.tangent) > STRAIGHT;
        let is_sound = |[a, b]: &[Ring; 2]| b.arc <= self.clear && is_straight(b) && !folds(&widest(a), &widest(b));
        sides >= LEAST_SIDES
            && self.spread(first) > error * WORTH
            && rings.array_windows().take_while(is_foot).all(is_sound)
    }
}

/// The highest that a root may be, in spreads.
const HIGHEST: f32 = 2.0;

/// How far out roots are by direction: −1 in the deepest valley, 0 in the mean.
pub(super) struct Roots {
    /// Angle, how narrow, how strong.
    each: Vec<(f32, f32, f32)>,
    mean: f32,
    scale: f32,
}

impl Roots {
    /// Those of a stem by its number, turned by so many radians.
    pub(super) fn of(stem: u32, turn: f32) -> Self {
        const LOOKED_AT: u32 = 128;
        let seed = Seed::new(0).child("roots").at(u64::from(stem));
        let count = COUNT.0 + seed.child("count").index(COUNT.1 as usize + 1) as u32;
        let narrow = NARROW * (count * count) as f32 / 8.0;
        let one = |i: u32| {
            let seed = seed.at(u64::from(i));
            let angle = turn + (i as f32 + UNEVEN * seed.at(0).range(-1.0, 1.0)) / count as f32 * TAU;
            (angle, narrow * seed.at(1).range(0.7, 1.3), 1.0 - WEAKER * seed.at(2).unit())
        };
        let mut roots = Self { each: (0..count).map(one).collect(), mean: 0.0, scale: 1.0 };
        let all: Vec<f32> = (0..LOOKED_AT).map(|i| roots.at(TAU * i as f32 / LOOKED_AT as f32).0).collect();
        roots.mean = all.iter().sum::<f32>() / LOOKED_AT as f32;
        let (low, high) = all.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
        roots.scale = (roots.mean - low).max((high - roots.mean) / HIGHEST).recip();
        roots
    }

    /// The same at the corners of a ring, the first of them again at the end.
    pub(super) fn corners(&self, sides: u32) -> Vec<(f32, f32)> {
        (0..=sides).map(|k| self.at(TAU * (k % sides) as f32 / sides as f32)).collect()
    }

    /// How far out the skin is at an angle, in spreads, and by how much more a radian on.
    fn at(&self, angle: f32) -> (f32, f32) {
        let (mut value, mut slope) = (-self.mean, 0.0);
        for &(middle, narrow, strong) in &self.each {
            let (sin, cos) = math::sin_cos(angle - middle);
            let here = strong * math::exp(narrow * (cos - 1.0));
            value += here;
            slope -= here * narrow * sin;
        }
        (value * self.scale, slope * self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, TubeDetail, closure, problems, tubes};
    use crate::plant::PlantBuilder;
    use crate::preset::plan::MeshParams;

    /// A pole of 30 cm whose foot flares by its own radii or is left to, meshed with so much of that in roots.
    fn pole(radii: &[f32], way: Vec3, roots: f32) -> Mesh {
        let mut builder = PlantBuilder::new();
        let points: Vec<Vec3> = (0..radii.len()).map(|i| way * i as f32 * 0.25).collect();
        builder.stem(Vec3::ZERO, &points, radii);
        let plant = builder.finish().unwrap();
        let mesh = tubes(
            &plant,
            &plant.pose(),
            &TubeDetail::full(&MeshParams { roots, most_sides: 64, ..MeshParams::told(12, 0.01) }),
        );
        assert_eq!((problems(&mesh), closure(&mesh).faulty_edges, closure(&mesh).inside_out), (vec![], 0, 0));
        mesh
    }

    /// The least and largest distance from the axis of vertices between two heights.
    fn girth(mesh: &Mesh, [low, high]: [f32; 2]) -> [f32; 2] {
        let here =
            mesh.positions.iter().filter(|p| (low..high).contains(&p.y)).map(|p| Vec3::new(p.x, 0.0, p.z).length());
        here.fold([f32::MAX, 0.0], |[least, most], r| [least.min(r), most.max(r)])
    }

    #[test]
    fn a_foot_that_flares_has_roots_and_is_round_above() {
        let own = [&[0.45, 0.36, 0.32][..], &[0.3; 17][..]].concat();
        for radii in [&own[..], &[0.3; 20][..]] {
            let (round, rooted) = (pole(radii, Vec3::Y, 0.0), pole(radii, Vec3::Y, 0.7));
            let [least, most] = girth(&round, [-0.01, 0.01]);
            assert!(most < least * 1.01, "{least} {most}");
            let [least, most] = girth(&rooted, [-0.01, 0.01]);
            assert!(most > least * 1.3 && least > 0.3, "{least} {most}");
            let [least, most] = girth(&rooted, [2.0, 4.0]);
            assert!(most < least * 1.02, "{least} {most}");
        }
        // Without sides or upright wood to draw them on there are none.
        assert_eq!(
            pole(&own, Vec3::new(1.0, 0.4, 0.0), 0.7).positions,
            pole(&own, Vec3::new(1.0, 0.4, 0.0), 0.0).positions
        );
    }

    /// Largest distance from the axis by direction, at the ground.
    fn foot_of(branches: &[(f32, Vec3)], flare: f32) -> Vec<(f32, f32)> {
        let mut builder = PlantBuilder::new();
        let points: [Vec3; 20] = std::array::from_fn(|i| Vec3::Y * i as f32 * 0.25);
        let stem = builder.stem(Vec3::ZERO, &points, &[0.3; 20]);
        for (location, way) in branches {
            builder.branch(stem, *location, &[Vec3::ZERO, *way], &[0.05, 0.02]);
        }
        let plant = builder.finish().unwrap();
        let params = MeshParams { roots: 0.7, flare, most_sides: 64, ..MeshParams::told(12, 0.01) };
        let mesh = tubes(&plant, &plant.pose(), &TubeDetail::full(&params));
        assert_eq!((problems(&mesh), closure(&mesh).faulty_edges, closure(&mesh).inside_out), (vec![], 0, 0));
        let low = mesh.positions.iter().filter(|p| p.y.abs() < 0.01);
        low.map(|p| (math::atan2(p.z, p.x), Vec3::new(p.x, 0.0, p.z).length())).collect()
    }

    #[test]
    fn roots_end_below_the_lowest_branch_and_stand_by_what_the_tree_bears() {
        let spread = |foot: &[(f32, f32)]| {
            let [least, most] = foot.iter().fold([f32::MAX, 0.0_f32], |[a, b], p| [a.min(p.1), b.max(p.1)]);
            most / least
        };
        let widest = |foot: &[(f32, f32)]| foot.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
        let (east, west) = (foot_of(&[(0.8, Vec3::X)], 0.38), foot_of(&[(0.8, Vec3::NEG_X)], 0.38));
        assert!(spread(&east) > 1.3 && (widest(&east) - widest(&west)).abs() > 0.3);
        // A branch within the flare leaves roots below it; one at the very ground leaves none, nor does a foot without a flare.
        assert!(spread(&foot_of(&[(0.16, Vec3::X)], 0.38)) > 1.05);
        for foot in [foot_of(&[(0.03, Vec3::X)], 0.38), foot_of(&[], 0.0)] {
            assert!(spread(&foot) < 1.01, "{}", spread(&foot));
        }
        assert!(foot_of(&[], 0.0).iter().all(|p| p.1 < 0.31), "no flare was asked for");
    }

    #[test]
    fn roots_take_as_much_as_valleys_give_and_are_no_deeper_than_the_spread() {
        for stem in 0..50 {
            let roots = Roots::of(stem, stem as f32 * 0.7);
            let all: Vec<(f32, f32)> = (0..360).map(|i| roots.at(TAU * i as f32 / 360.0)).collect();
            let mean = all.iter().map(|at| at.0).sum::<f32>() / 360.0;
            let (low, high) = all.iter().fold((f32::MAX, f32::MIN), |(l, h), at| (l.min(at.0), h.max(at.0)));
            assert!(mean.abs() < 0.01 && low > -1.02 && high < HIGHEST * 1.02, "{stem}: {mean} {low} {high}");
            assert!(low < -0.4 && high > 0.5, "{stem}: {low} {high}");
            let peaks = (0..360).filter(|&i| all[i].0 > all[(i + 359) % 360].0 && all[i].0 >= all[(i + 1) % 360].0);
            let peaks = peaks.count() as u32;
            assert!((2..=COUNT.0 + COUNT.1).contains(&peaks), "{stem}: {peaks}");
            let step = TAU / 360.0;
            let is_slope = |i: usize| {
                let rise = (all[(i + 1) % 360].0 - all[(i + 359) % 360].0) / (2.0 * step);
                (rise - all[i].1).abs() < 0.1
            };
            assert!((0..360).all(is_slope), "{stem}");
        }
    }
}
