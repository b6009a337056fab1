//! Several stems against fewer: splitting and merging (what 2017 TVCG lists under its limits, section 6).
//!
//! Between a shrub and a tree the paper's one-to-none lets all stems but one wilt. Here each stem that is left over
//! shares the partner that it resembles most: one trunk splits into the stems of a shrub, and they merge into it. What
//! grows on the shared trunk is matched against what grows on all of its stems at once; a branch of the trunk goes with
//! the stem whose branch is its partner, or, without one, with the stem that leans its way.
//!
//! A trunk alone must bear all of its branches. So whatever goes with another stem than the first has a second kin on
//! the first, a stand-in ([`Family::is_stand_in`]), which is shown only where the trunk's source is alone; there it lies
//! exactly where the other stands.

use rayon::prelude::*;

use super::fuzzy::match_siblings;
use super::nway::match_nway;
use super::topology_tree::TopologyTree;
use super::{Family, FamilyError, Kin, KinId};
use crate::plant::{ChainId, Plant};
use crate::preset::plan::MatchParams;

/// The family of two plants whose surplus stems merge with those of the other.
///
/// # Errors
///
/// When a plant has no chain or holds a length beyond all measure; see [`FamilyError`].
pub fn merged_family(from: Plant, to: Plant, params: &MatchParams) -> Result<Family, FamilyError> {
    let plants = vec![from, to];
    let trees: Vec<TopologyTree> = plants.par_iter().map(TopologyTree::of).collect();
    let kins = match_merged(&trees[0], &trees[1], params);
    Family::new(plants, &kins)
}

/// The kins of two plants whose surplus stems merge; see the head of this file.
#[must_use]
pub fn match_merged(from: &TopologyTree, to: &TopologyTree, params: &MatchParams) -> Vec<Kin> {
    if from.stems().len() == to.stems().len() {
        return match_nway(&[from, to], params);
    }
    // `many` has the more stems; its place in a kin's members.
    let (many, few, place) = if from.stems().len() > to.stems().len() { (from, to, 0) } else { (to, from, 1) };
    let mut build = Build { many, few, place, params, kins: Vec::new() };
    for (&trunk, stems) in few.stems().iter().zip(build.shares()) {
        build.trunk(trunk, &stems);
    }
    build.kins
}

struct Build<'t> {
    many: &'t TopologyTree,
    few: &'t TopologyTree,
    place: usize,
    params: &'t MatchParams,
    kins: Vec<Kin>,
}

impl Build<'_> {
    /// For each trunk its stems, its own partner first.
    fn shares(&self) -> Vec<Vec<ChainId>> {
        let (trunks, stems) = (self.few.stems(), self.many.stems());
        let mut shares: Vec<Vec<ChainId>> = vec![Vec::new(); trunks.len()];
        for (trunk, stem, _) in match_siblings(self.few, trunks, self.many, stems, self.params) {
            shares[trunks.iter().position(|t| *t == trunk).unwrap_or(0)].push(stem);
        }
        for &stem in stems {
            if shares.iter().any(|own| own.contains(&stem)) {
                continue;
            }
            // The cheapest trunk for it alone.
            let alone = match_siblings(self.many, &[stem], self.few, trunks, self.params);
            let trunk = alone.first().and_then(|pair| trunks.iter().position(|t| *t == pair.1)).unwrap_or(0);
            shares[trunk].push(stem);
        }
        shares
    }

    fn push(&mut self, parent: Option<KinId>, many: Option<ChainId>, few: Option<ChainId>) -> KinId {
        let members = if self.place == 0 { vec![many, few] } else { vec![few, many] };
        self.kins.push(Kin { parent, members });
        KinId(self.kins.len() as u32 - 1)
    }

    fn trunk(&mut self, trunk: ChainId, stems: &[ChainId]) {
        let kins: Vec<KinId> = stems.iter().map(|&stem| self.push(None, Some(stem), Some(trunk))).collect();
        // Which stem bears each branch: branches of all stems in order of id, as matching wants them.
        let mut below: Vec<(ChainId, usize)> =
            stems.iter().enumerate().flat_map(|(i, &s)| self.many.children(s).iter().map(move |&c| (c, i))).collect();
        below.sort_unstable();
        let ids: Vec<ChainId> = below.iter().map(|b| b.0).collect();
        let limbs = self.few.children(trunk);
        let mut partner: Vec<Option<ChainId>> = vec![None; limbs.len()];
        let mut alone: Vec<bool> = vec![true; ids.len()];
        for (branch, limb, _) in match_siblings(self.many, &ids, self.few, limbs, self.params) {
            if let (Ok(b), Ok(l)) = (ids.binary_search(&branch), limbs.binary_search(&limb)) {
                (alone[b], partner[l]) = (false, Some(branch));
            }
        }
        for (&limb, partner) in limbs.iter().zip(partner) {
            let stem = match partner {
                Some(branch) => below[ids.binary_search(&branch).unwrap_or(0)].1,
                None => self.leaning(stems, limb),
            };
            self.pair(kins[stem], partner, Some(limb));
            if stem > 0 {
                self.pair(kins[0], None, Some(limb));
            }
        }
        for (&(branch, stem), alone) in below.iter().zip(alone) {
            if alone {
                self.pair(kins[stem], Some(branch), None);
            }
        }
    }

    /// The stem that leans most to the side where a limb of the trunk leaves.
    fn leaning(&self, stems: &[ChainId], limb: ChainId) -> usize {
        let side = |v: glam::Vec3| v * glam::Vec3::new(1.0, 0.0, 1.0);
        let out = side(self.few.node(limb).direction);
        let lean = |i: usize| side(self.many.node(stems[i]).direction).dot(out);
        (0..stems.len()).max_by(|&a, &b| lean(a).total_cmp(&lean(b)).then(b.cmp(&a))).unwrap_or(0)
    }

    /// A kin of the given members, and all that they bear, matched level by level.
    fn pair(&mut self, parent: KinId, many: Option<ChainId>, few: Option<ChainId>) {
        let mut work = vec![(parent, many, few)];
        while let Some((parent, many, few)) = work.pop() {
            let kin = self.push(Some(parent), many, few);
            let own = many.map_or(&[][..], |c| self.many.children(c));
            let other = few.map_or(&[][..], |c| self.few.children(c));
            let matched = if own.is_empty() || other.is_empty() {
                Vec::new()
            } else {
                match_siblings(self.many, own, self.few, other, self.params)
            };
            let left: Vec<ChainId> = matched.iter().map(|pair| pair.0).collect();
            let mut right: Vec<ChainId> = matched.iter().map(|pair| pair.1).collect();
            right.sort_unstable();
            work.extend(matched.iter().map(|pair| (kin, Some(pair.0), Some(pair.1))));
            // `left` is in order: matching sorts by the first side.
            work.extend(own.iter().filter(|c| left.binary_search(c).is_err()).map(|&c| (kin, Some(c), None)));
            work.extend(other.iter().filter(|c| right.binary_search(c).is_err()).map(|&c| (kin, None, Some(c))));
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Seed;
    use crate::plant::PlantBuilder;
    use crate::relate::random_plant::{Oddity, random_plant};

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    #[test]
    fn both_ends_are_the_sources_whatever_the_numbers_of_stems() {
        for seed in 0..40 {
            let plant = |name| random_plant(Seed::new(seed).child(name), 50, Oddity::Wild);
            let (a, b) = (plant("a"), plant("b"));
            let family = merged_family(a.clone(), b.clone(), &EVEN).unwrap();
            assert!(family.blend(&family.corner(0)) == a && family.blend(&family.corner(1)) == b, "seed {seed}");
        }
    }

    #[test]
    fn a_shrub_of_three_rods_shares_the_trunk() {
        let mut builder = PlantBuilder::new();
        let up = [Vec3::ZERO, Vec3::Y * 2.0];
        for i in 0..3 {
            let lean = Vec3::new([-1.0, 0.0, 1.0][i], 2.0, 0.1);
            let rod = builder.stem(lean * 0.05 * Vec3::new(1.0, 0.0, 1.0), &[Vec3::ZERO, lean], &[0.05, 0.02]);
            builder.branch(rod, 0.5, &[Vec3::ZERO, Vec3::X], &[0.02, 0.01]);
        }
        let shrub = builder.finish().unwrap();
        let mut builder = PlantBuilder::new();
        let trunk = builder.stem(Vec3::ZERO, &up, &[0.2, 0.1]);
        (0..5).for_each(|i| {
            builder.branch(trunk, 0.4 + 0.1 * i as f32, &[Vec3::ZERO, Seed::new(i).direction()], &[0.05, 0.01]);
        });
        let tree = builder.finish().unwrap();
        let family = merged_family(shrub.clone(), tree.clone(), &EVEN).unwrap();
        let trunks: Vec<KinId> = family.kin_ids().filter(|&k| family.parent(k).is_none()).collect();
        assert!(trunks.iter().all(|&k| family.member(k, 1) == Some(ChainId(0))) && trunks.len() == 3);
        // Whatever lies on the second and third rod stands in on the first.
        let stand_ins = family.kin_ids().filter(|&k| family.is_stand_in(k)).count();
        let aside = family
            .kin_ids()
            .filter(|&k| family.member(k, 1).is_some() && family.parent(k).is_some_and(|p| p.0 == 1 || p.0 == 2))
            .count();
        assert!(stand_ins == aside && aside > 0, "{stand_ins} {aside}");
        assert!(family.blend(&family.corner(0)) == shrub && family.blend(&family.corner(1)) == tree);
    }
}
