//! How far along its parent a branch stands, and how long it is, that has come further, or less far, than its parent.
//!
//! Locations are shares of the parent's length (2017 TVCG, 4.3), and branches are as long as lies between their sources, each at its own
//! progress. So limbs of ten metres, which one source has at the end of a bole of three, stood at the end of the other's trunk of
//! fourteen, and boughs of a limb as long on the spur that it had become: of 24 blends of a lime and a zelkova, both 14 m high, nine
//! were up to 7 m higher than that, each by a lone shoot. A branch grows no farther from its parent's base, in metres, than it would on
//! a parent that has come as far as it has, and no longer against its parent than there. Where both have come equally far, as in a
//! plain mix, that changes nothing; nor do branches that take no part, and twigs, short against what bears them, keep their places: pushed
//! down a limb that is longer for now, they left its end bare.

use super::family::{Member, NONE};
use super::kernel::Blender;
use crate::base::math;

/// Lengths that differ by less are the same: rounding moves no branch.
const SAME: f32 = 1.0 + 1e-5;
/// Lengths of a branch, over its parent's, up to which it is a twig there, and from which on it is a limb.
const TWIG: f32 = 0.25;
const LIMB: f32 = 0.75;

impl Blender<'_> {
    /// The location of a kin whose location in its own shares is known.
    pub(super) fn no_farther(&self, k: usize) -> f32 {
        let own = self.location[k];
        match self.against_expected(k) {
            Some((longer, limb)) if longer > SAME => own + (own / longer - own) * limb,
            _ => own,
        }
    }

    /// The most that a kin has grown on its parent, which was placed, 0..=1.
    pub(super) fn room(&self, k: usize) -> f32 {
        match self.against_expected(k) {
            Some((longer, limb)) if longer * SAME < 1.0 => 1.0 + (longer - 1.0) * limb,
            _ => 1.0,
        }
    }

    /// How many times as long a kin's parent is as one would be that has come as far as the kin, and how much of a limb the kin is
    /// on that, 0..=1; none where the kin has no parent, or its sources no such one.
    fn against_expected(&self, k: usize) -> Option<(f32, f32)> {
        let parent = self.family.parents[k];
        if parent == NONE || self.family.elastic.is_some() || self.kept[k] {
            return None;
        }
        let parent = parent as usize;
        if self.share(k) == self.share(parent) {
            return None;
        }
        let length = |kin: usize| {
            let of = |(s, (member, share)): (usize, (&Member, &f32))| match member.chain {
                NONE => 0.0,
                chain => self.family.lengths[s][chain as usize] * share,
            };
            self.family.row(kin).iter().zip(self.share(k)).enumerate().map(of).sum::<f32>()
        };
        let there = length(parent);
        (there > 0.0).then(|| (self.lengths[parent] / there, math::smoothstep(TWIG, LIMB, length(k) / there)))
    }

    /// How long a kin is that was placed.
    pub(super) fn length(&self, k: usize) -> f32 {
        self.points[self.span(k)].windows(2).map(|pair| (pair[1] - pair[0]).length()).sum()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use crate::base::Seed;
    use crate::blend::{Tasks, mix};
    use crate::plant::{Plant, PlantBuilder};
    use crate::preset::plan::MatchParams;
    use crate::relate::fuzzy_family;

    /// A bole with limbs at its end, all of it 14 m high, and a trunk of 14 m with short limbs all along.
    fn vase_and_spindle() -> [Plant; 2] {
        let of = |trunk: f32, limbs: &[(f32, f32)]| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * trunk], &[0.3, 0.2]);
            for (i, &(location, length)) in limbs.iter().enumerate() {
                let (sin, cos) = crate::base::math::sin_cos(i as f32 * 2.4);
                let tip = Vec3::new(cos * 0.3, 1.0, sin * 0.3).normalize() * length;
                builder.branch(stem, location, &[Vec3::ZERO, tip], &[0.1, 0.02]);
            }
            builder.finish().expect("it stands")
        };
        let limbs = [(0.9, 11.0), (0.94, 11.2), (0.97, 11.3), (0.99, 11.4), (1.0, 11.4)];
        let spurs = [(0.3, 1.0), (0.6, 0.9)];
        [of(3.0, &limbs), of(14.0, &spurs)]
    }

    #[test]
    fn limbs_of_a_short_bole_do_not_stand_on_top_of_a_long_trunk() {
        let [vase, spindle] = vase_and_spindle();
        let most = vase.height().max(spindle.height());
        let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
        for pair in [[vase.clone(), spindle.clone()], [spindle, vase]] {
            let family = fuzzy_family(pair[0].clone(), pair[1].clone(), &matching).expect("they match");
            assert!(family.blend(&family.corner(0)) == pair[0] && family.blend(&family.corner(1)) == pair[1]);
            let tasks = Tasks::new(&family, 0, 1);
            for (seed, progress) in (0..6).flat_map(|seed| [0.2, 0.4, 0.6, 0.8].map(|at| (seed, at))) {
                let tree = family.blend(&tasks.weights(&tasks.sample(Seed::new(seed), progress, 1.0)));
                assert!(tree.height() < most * 1.06, "{seed} {progress}: {} of {most}", tree.height());
            }
            // And it moves without a jump.
            let mixed = |i: u8| family.blend(&mix(&family, &[1.0 - f32::from(i) / 50.0, f32::from(i) / 50.0])).height();
            let heights: Vec<f32> = (0..=50).map(mixed).collect();
            assert!(heights.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.4), "{heights:?}");
        }
    }
}
