//! A plant's own growth from sapling to full size, by the same kernel: a family of one source, whose kins have degrees of
//! growth by age.
//!
//! A branch is born when its bearer has grown past the place where it leaves: at location `l` of a bearer that is born at
//! `b`, at `b + l·(1 − b)·`[`PACE`]. From then on it grows to full size, fast at first and slower later
//! (`1 − (1 − age)^`[`SLOWING`]), and is full-grown when the plant is. As degrees scale a chain whole, a young
//! branch is a small one; it never outgrows its bearer. Leaves of a small branch come out one after the other and are smaller than
//! full-grown ones, though not in proportion.
//!
//! Radii follow the rule of blends, by what a chain carries: but most of a sapling's crown is not born yet, and it would
//! stand on a thread. So wood is at least as thick as elastic similarity has it (McMahon 1973): radius as length^1.5, against
//! the full-grown chain.

use crate::base::math;
use crate::plant::{Leaf, Plant};
use crate::relate::{Family, Weights};

/// Share of its life in which a chain reaches its full length, as far as births on it go. Short, so that leaders are not
/// bare above a sapling's branches: at 0.12, a tree of a twentieth of its age was a bush below a hairline.
const PACE: f32 = 0.04;
/// How much faster young branches grow than old ones.
const SLOWING: f32 = 1.6;

/// Radius of young wood over that of full-grown one: its degree of growth to this power, at least.
const STOUT: f32 = 1.5;
/// The same of leaves.
const LEAFY: f32 = 0.4;

/// The only source of a family at age `t`, 0..=1; at 1 it is the source itself. The stems stand from the start; a chain
/// that is not born yet has the degree `unborn`, and a leaf that did not come out yet that share of its size, which for all
/// but animations is 0; above 0 all ages have the same chains and leaves in the same order.
#[must_use]
pub fn grown(family: &Family, t: f32, unborn: f32) -> Plant {
    let weights = growth(family, t, unborn).with_least_leaf(unborn);
    let (plant, kins) = family.blend_with_kins(&weights);
    let mut radii = plant.all_radii().to_vec();
    let source = &family.sources()[0];
    for (id, kin) in plant.chain_ids().zip(&kins) {
        let Some(own) = family.member(*kin, 0) else { continue };
        let share = math::pow(weights.degree(*kin), STOUT);
        for (radius, full) in radii[plant.span(id)].iter_mut().zip(source.radii(own)) {
            *radius = radius.max(full * share);
        }
    }
    let smaller = |leaf: &Leaf| {
        let degree = weights.degree(kins[leaf.chain.index()]).clamp(0.0, 1.0);
        Leaf { size: leaf.size * math::pow(degree, LEAFY), ..*leaf }
    };
    let leaves = plant.leaves().iter().map(smaller).collect();
    plant.with_radii(radii).with_leaves(leaves)
}

/// The weights of the only source of a family at age `t`, 0..=1; at 1 it is the source itself. The stems stand from the
/// start; a chain that is not born yet has the degree `unborn`, which for all but animations is 0.
fn growth(family: &Family, t: f32, unborn: f32) -> Weights {
    if t.is_nan() || t >= 1.0 {
        return family.corner(0);
    }
    let t = t.max(1e-3);
    let mut weights = Weights::new(family.kin_count(), family.sources().len());
    let mut births = vec![0.0_f32; family.kin_count()];
    let mut degrees = vec![0.0_f32; family.kin_count()];
    for kin in family.kin_ids() {
        let Some(chain) = family.member(kin, 0) else { continue };
        let (birth, most) = match family.parent(kin) {
            None => (0.0, 1.0),
            Some(parent) => {
                let before = births[parent.index()];
                let at = family.sources()[0].chain(chain).location;
                (before + at * (1.0 - before) * PACE, degrees[parent.index()])
            }
        };
        births[kin.index()] = birth;
        let age = ((t - birth) / (1.0 - birth).max(1e-6)).clamp(0.0, 1.0);
        let degree = (1.0 - math::pow(1.0 - age, SLOWING)).min(most).max(unborn);
        degrees[kin.index()] = degree;
        weights.set(kin, &[1.0], degree);
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::plant::{ChainId, PlantStats};
    use crate::relate::random_plant::{Oddity, random_plant};
    use crate::relate::{Kin, KinId};

    #[test]
    fn a_plant_only_grows_and_ends_as_itself() {
        for seed in 0..30 {
            let plant = random_plant(Seed::new(seed), 60, Oddity::Tame);
            let kins: Vec<Kin> = plant
                .chain_ids()
                .map(|c| Kin { parent: plant.chain(c).parent.map(|p| KinId(p.0)), members: vec![Some(c)] })
                .collect();
            let family = Family::new(vec![plant.clone()], &kins).unwrap();
            let (mut wood, mut chains) = (0.0, 0);
            for step in 0..=20 {
                let young = grown(&family, step as f32 / 20.0, 0.0);
                let stats = PlantStats::of(&young);
                assert_eq!(stats.topology_continuity, 1.0);
                assert!(stats.wood_length >= wood - 1e-3 && stats.chains >= chains, "{seed} {step}");
                (wood, chains) = (stats.wood_length, stats.chains);
            }
            assert!(grown(&family, 1.0, 0.0) == plant);
        }
    }

    #[test]
    fn leaves_of_all_ages_are_those_of_the_plant_in_its_order_and_none_is_longer_than_full_grown() {
        let own = |leaf: &Leaf| (leaf.chain, leaf.location, leaf.orientation, leaf.slot, leaf.form);
        for seed in 0..30 {
            let plant = random_plant(Seed::new(seed), 60, Oddity::Tame);
            let kin = |c: ChainId| Kin { parent: plant.chain(c).parent.map(|p| KinId(p.0)), members: vec![Some(c)] };
            let kins: Vec<Kin> = plant.chain_ids().map(kin).collect();
            let family = Family::new(vec![plant.clone()], &kins).unwrap();
            for age in [1e-4, 0.02, 0.2, 0.5, 0.9, 1.0 - 1e-4] {
                let key = grown(&family, age, 1e-4);
                assert!(key.leaves().iter().map(own).eq(plant.leaves().iter().map(own)), "{seed} {age}");
                let longer = |(young, full): (&Leaf, &Leaf)| young.size > full.size;
                assert!(!key.leaves().iter().zip(plant.leaves()).any(longer), "{seed} {age}");
                // A frame has those that came out, as large.
                let frame = grown(&family, age, 0.0);
                let size = |of: &Plant| of.leaves().iter().map(|leaf| leaf.size).sum::<f32>();
                assert!((size(&frame) - size(&key)).abs() <= 1e-3 * size(&plant), "{seed} {age}");
            }
        }
    }

    #[test]
    fn a_sapling_has_branches_up_to_its_leader() {
        for seed in 0..30 {
            let plant = random_plant(Seed::new(seed), 60, Oddity::Tame);
            let kin = |c: ChainId| Kin { parent: plant.chain(c).parent.map(|p| KinId(p.0)), members: vec![Some(c)] };
            let kins: Vec<Kin> = plant.chain_ids().map(kin).collect();
            let family = Family::new(vec![plant.clone()], &kins).unwrap();
            let weights = growth(&family, 0.2, 0.0);
            for kin in family.kin_ids().filter(|&kin| family.parent(kin) == Some(KinId(0))) {
                assert!(weights.degree(kin) > 0.05, "{seed} {kin:?} {}", weights.degree(kin));
            }
        }
    }

    #[test]
    fn young_wood_is_as_stout_as_elastic_similarity_has_it_and_only_gets_thicker() {
        for seed in 0..30 {
            let plant = random_plant(Seed::new(seed), 60, Oddity::Tame);
            let kin = |c: ChainId| Kin { parent: plant.chain(c).parent.map(|p| KinId(p.0)), members: vec![Some(c)] };
            let kins: Vec<Kin> = plant.chain_ids().map(kin).collect();
            let family = Family::new(vec![plant.clone()], &kins).unwrap();
            let stem = |of: &Plant| of.radii(ChainId(0))[0];
            let mut last = 0.0;
            for step in 1..=10 {
                let age = step as f32 / 10.0;
                let young = grown(&family, age, 0.0);
                let length = 1.0 - math::pow(1.0 - age, SLOWING);
                let least = stem(&plant) * math::pow(length, STOUT);
                assert!(stem(&young) >= least * 0.999 && stem(&young) <= stem(&plant) * 1.001, "{seed} {step}");
                assert!(stem(&young) >= last * 0.999, "{seed} {step}");
                last = stem(&young);
            }
        }
    }
}
