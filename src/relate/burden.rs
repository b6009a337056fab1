//! How thick kins are that share a chain (split and merge).
//!
//! Where several kins share a member, several stems lie in one trunk at its end of the way. Each is as thick as what it
//! bears of the trunk's branches asks for by Eq. 3 of 2017 TVCG, at every point of its way: the trunk's radius by `p^0.4`,
//! with `p` the part that leaves it from there up. What another bears counts with it as far as both have come to where the
//! trunk stands, where they lie in each other, and where that other is not shown. So in the middle the stems together are as
//! thick as the trunk, and at its end each is the trunk.
//!
//! Rejected: an equal part for each. Stems that bear little were stumps, stout up to where another bears the fork; and the
//! first that came to its place was all of the trunk, with a sixth of its limbs.

use super::family::{Family, NONE};
use super::kernel::{Blender, Feed};
use super::point_weights::point_weight;
use super::rule::two_fifths;
use super::weights::Run;
use crate::plant::{ChainId, carried};

/// Of what a chain carries along its way the part that grows on one of the kins that share it: from the tip down, the location
/// of each branch, and the part from there to the next one below.
#[derive(Clone, Debug)]
pub(super) struct Burden(Vec<(f32, f32)>);

impl Burden {
    /// Of the chain that `source` gives to a kin, which `kins` share.
    pub(super) fn of(family: &Family, kin: u32, kins: &[u32], source: usize) -> Self {
        let tip = family.plants[source].radii(ChainId(family.row(kin as usize)[source].chain)).last();
        let tip = tip.map_or(0.0, |r| carried(f64::from(*r)));
        // Location, what is carried there, and whether this kin bears it.
        let mut branches: Vec<(f32, f64, bool)> = Vec::new();
        for &bearer in kins {
            let borne = family.child_range(bearer as usize).map(|i| family.children[i] as usize);
            let members = borne.filter(|&k| !family.stand_ins[k]).map(|k| &family.row(k)[source]);
            let known = members.filter(|m| m.chain != NONE);
            branches.extend(known.map(|m| (m.location, carried(f64::from(m.base)), bearer == kin)));
        }
        branches.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)));
        let (mut own, mut all) = (tip / kins.len() as f64, tip);
        let part = |own: f64, all: f64| if all > 0.0 { (own / all) as f32 } else { 1.0 / kins.len() as f32 };
        let mut steps = vec![(f32::INFINITY, part(own, all))];
        for (location, load, is_own) in branches {
            all += load;
            own += if is_own { load } else { 0.0 };
            steps.push((location, part(own, all)));
        }
        Self(steps)
    }

    /// The part at a location, 0..=1.
    fn at(&self, location: f32) -> f32 {
        self.0[self.0.partition_point(|step| step.0 >= location).max(1) - 1].1
    }
}

/// A kin that shares the chain that a source gives it, and the others that do.
pub(super) struct Sharer<'b> {
    own: &'b Burden,
    /// Of each other one its burden and, where it is shown, how its share runs along it.
    others: Vec<(&'b Burden, Option<Share>)>,
    /// Whether it takes one part all along: growth units are not told by arc length.
    is_even: bool,
}

/// How a source's share runs along a kin.
struct Share {
    /// Whether the source is the second one, whose weights runs tell.
    second: bool,
    run: Run,
    share: f32,
}

impl Share {
    fn at(&self, location: f32) -> f32 {
        if self.second {
            point_weight(self.run, location, self.share)
        } else {
            1.0 - point_weight(self.run, location, 1.0 - self.share)
        }
    }
}

impl<'f> Blender<'f> {
    /// The kin as one of those that share the chain that `source` gives it; none where it is alone.
    pub(super) fn sharer(&self, k: usize, source: usize) -> Option<Sharer<'f>> {
        let family = self.family;
        let own = family.burdens.get(&(k as u32, source as u32))?;
        let mut others = Vec::new();
        let mut twin = family.row(k)[source].twin;
        while twin != NONE && twin != k as u32 {
            let row = family.row(twin as usize);
            let share = Share {
                second: row[..source].iter().any(|m| m.chain != NONE),
                run: self.runs[twin as usize],
                share: self.share(twin as usize)[source],
            };
            let shown = self.feeds[twin as usize] != Feed::Nothing;
            others.extend(family.burdens.get(&(twin, source as u32)).map(|b| (b, shown.then_some(share))));
            twin = row[source].twin;
        }
        Some(Sharer { own, others, is_even: family.units.is_some() })
    }

    /// Kins that share a chain are as thick as the others let them be: when one has moved all are placed anew.
    pub(super) fn move_sharers(&mut self) {
        for &(k, source) in self.family.burdens.keys() {
            let mut twin = self.family.row(k as usize)[source as usize].twin;
            while twin != NONE && twin != k && !self.moved[k as usize] {
                self.moved[k as usize] = self.moved[twin as usize];
                twin = self.family.row(twin as usize)[source as usize].twin;
            }
        }
    }
}

impl Sharer<'_> {
    /// The weight of the source's radii at a location where its share is `share`.
    pub(super) fn thickness(&self, location: f32, share: f32) -> f32 {
        let location = if self.is_even { 0.0 } else { location };
        let near = come(share);
        let (mut part, mut is_whole) = (self.own.at(location), true);
        for (burden, other) in &self.others {
            let near = other.as_ref().map_or(1.0, |other| near.min(come(other.at(location))));
            part += burden.at(location) * near;
            is_whole &= near >= 1.0;
        }
        // A corner is the source itself, whatever parts add up to.
        if is_whole { share } else { share * two_fifths(f64::from(part.min(1.0))) as f32 }
    }
}

/// How much of kins with this share of a source lies where the source's chain does: little before the last of the way.
fn come(share: f32) -> f32 {
    let square = share * share;
    let fourth = square * square;
    fourth * fourth
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use crate::base::math;
    use crate::plant::{Plant, PlantBuilder, carried};
    use crate::preset::plan::MatchParams;
    use crate::relate::{Blender, Family, KinId, Weights, merged_family};

    /// Three rods of a branch each, and a trunk that forks into three limbs at its middle.
    fn shrub_and_tree() -> Family {
        let mut builder = PlantBuilder::new();
        for i in 0..3 {
            let lean = Vec3::new([-1.0, 0.0, 1.0][i], 2.0, 0.1);
            let rod = builder.stem(lean * Vec3::new(0.05, 0.0, 0.05), &[Vec3::ZERO, lean], &[0.02, 0.02]);
            builder.branch(rod, 0.5, &[Vec3::ZERO, lean * Vec3::new(1.0, 0.1, 1.0)], &[0.01, 0.01]);
        }
        let shrub = builder.finish().unwrap();
        let mut builder = PlantBuilder::new();
        let line: Vec<Vec3> = [0.0, 0.5, 1.0, 1.1, 1.5, 2.0].iter().map(|y| Vec3::Y * *y).collect();
        let trunk = builder.stem(Vec3::ZERO, &line, &[0.2, 0.2, 0.2, 0.05, 0.05, 0.02]);
        for x in [-1.0, 0.0, 1.0] {
            builder.branch(trunk, 0.5, &[Vec3::ZERO, Vec3::new(x, 0.2, 0.1)], &[0.12, 0.1]);
        }
        merged_family(shrub, builder.finish().unwrap(), &MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 })
            .unwrap()
    }

    /// The trees that follow each other from one blender, with the share of the tree that each stem and all that it bears has.
    fn blends(family: &Family, shares: &[[f32; 3]]) -> Vec<Plant> {
        let mut blender = Blender::new(family);
        let stem_of = |mut kin: KinId| {
            while let Some(parent) = family.parent(kin) {
                kin = parent;
            }
            family.kin_ids().filter(|&k| family.parent(k).is_none()).position(|k| k == kin).unwrap()
        };
        let weights = |of: &[f32; 3]| {
            let mut weights = Weights::new(family.kin_count(), 2);
            for kin in family.kin_ids().filter(|&kin| !family.is_stand_in(kin)) {
                let t = of[stem_of(kin)];
                let [has_a, has_b] = [0, 1].map(|s| family.member(kin, s).is_some());
                let degree = if has_a && has_b {
                    1.0
                } else if has_b {
                    t
                } else {
                    1.0 - t
                };
                weights.set(kin, &[1.0 - t, t], degree);
            }
            weights
        };
        shares.iter().map(|of| blender.blend(&weights(of))).collect()
    }

    fn stems(plant: &Plant) -> Vec<(f32, f32)> {
        let stems = plant.chain_ids().filter(|&c| plant.chain(c).parent.is_none());
        stems.map(|c| (plant.radii(c)[0], *plant.radii(c).last().unwrap())).collect()
    }

    #[test]
    fn the_first_stem_at_its_place_is_as_thick_as_its_limbs_ask() {
        let family = shrub_and_tree();
        let tree = &blends(&family, &[[1.0, 0.0, 0.0]])[0];
        // One limb of three: a third of what the trunk carries, but for the tip.
        let third = 0.2 * math::pow(1.0 / 3.0, 0.4);
        let (base, tip) = stems(tree)[0];
        assert!((base - third).abs() < 0.01 * third, "{base} {third}");
        assert!((tip - 0.02 * math::pow(1.0 / 3.0, 0.4)).abs() < 1e-4, "{tip}");
    }

    #[test]
    fn stems_that_all_came_are_the_trunk_each_and_in_the_middle_it_together() {
        let family = shrub_and_tree();
        let trees = blends(&family, &[[0.5; 3], [1.0; 3], [0.5; 3]]);
        assert!(stems(&trees[1]).iter().all(|(base, _)| (base - 0.2).abs() < 1e-6), "{:?}", stems(&trees[1]));
        let sum: f64 = stems(&trees[0]).iter().map(|(base, _)| carried(f64::from(*base))).sum();
        // Half of it is the rods' own radius.
        let half = 3.0 * carried(0.5 * 0.02 + 0.5 * 0.2 * math::pow64(1.0 / 3.0, 0.4));
        assert!((sum / half - 1.0).abs() < 0.05, "{sum} {half}");
        // What one came to does not hang on what the others were before.
        assert!(trees[0] == trees[2]);
        let anew = blends(&family, &[[1.0, 0.2, 0.9]]);
        assert!(blends(&family, &[[1.0; 3], [1.0, 0.2, 0.9]])[1] == anew[0]);
    }
}
