//! Filtering and measuring a bare candidate in one pass over its pose.

use rayon::prelude::*;

use super::collide::{Collision, Habits, collisions};
use super::profile::Profile;
use super::proportions::{Departure, Proportions};
use crate::plant::{ChainId, Plant, PlantBuilder, Posed};
use crate::preset::plan::FilterParams;
use crate::relate::{Family, KinId};

/// The sources of a family, measured: what candidates are held against.
#[derive(Clone, Debug)]
pub struct Sources {
    /// One a source, in the family's order.
    pub profiles: Vec<Profile>,
    /// How they collide with themselves.
    pub habits: Habits,
}

impl Sources {
    /// Measures every source of a family.
    #[must_use]
    pub fn of(family: &Family, params: &FilterParams) -> Self {
        let profiles = family.sources().par_iter().map(|plant| Profile::of(plant, &Posed::of_bearers(plant))).collect();
        let habits = if params.collisions < 1.0 { Habits::of(family, params) } else { Habits::default() };
        Self { profiles, habits }
    }

    /// For each source, how many of its own branches the filter would have removed: sources stay as they are, so this is
    /// for a note.
    #[must_use]
    pub fn own_collisions(&self) -> &[usize] {
        &self.habits.of_sources
    }
}

/// A candidate, filtered and measured.
#[derive(Clone, Debug)]
pub struct Examined {
    /// Collisions that cost a branch, coarsest and worst first.
    pub collisions: Vec<Collision>,
    /// How far it is from its sources' kind, after the removal.
    pub departure: Departure,
    /// What it measures, after the removal.
    pub profile: Profile,
}

impl Examined {
    /// The branches that go, each with all that it bears.
    #[must_use]
    pub fn gone(&self) -> Vec<ChainId> {
        self.collisions.iter().map(|c| c.goes).collect()
    }
}

/// Filters and measures a candidate. `kins` gives the kin of each chain, as `Family::blend_with_kins` does; an empty
/// slice stands for a plant that belongs to no family.
#[must_use]
pub fn examine(plant: &Plant, kins: &[KinId], sources: &Sources, params: &FilterParams) -> Examined {
    let posed = Posed::of_bearers(plant);
    let found =
        if params.collisions < 1.0 { collisions(plant, &posed, kins, &sources.habits, params) } else { Vec::new() };
    let gone = if found.is_empty() {
        Vec::new()
    } else {
        let roots: Vec<ChainId> = found.iter().map(|c| c.goes).collect();
        with_descendants(plant, &roots)
    };
    let profile = Profile::of_kept(plant, &posed, &gone);
    let kinds: Vec<&Proportions> = sources.profiles.iter().map(|p| &p.proportions).collect();
    Examined { collisions: found, departure: profile.proportions.departure(&kinds), profile }
}

/// For each chain whether it or what bears it is among `roots`.
fn with_descendants(plant: &Plant, roots: &[ChainId]) -> Vec<bool> {
    let mut gone = vec![false; plant.chains().len()];
    for root in roots {
        if let Some(slot) = gone.get_mut(root.index()) {
            *slot = true;
        }
    }
    for i in 0..gone.len() {
        gone[i] |= plant.chains()[i].parent.is_some_and(|p| gone[p.index()]);
    }
    gone
}

/// The plant without some branches and all that they bear, leaves among them. What stays is not moved. A plant of which
/// nothing would stay is left as it is.
#[must_use]
pub fn without(plant: &Plant, branches: &[ChainId]) -> Plant {
    let gone = with_descendants(plant, branches);
    if branches.is_empty() || gone.iter().all(|g| *g) {
        return plant.clone();
    }
    let mut builder = PlantBuilder::new();
    let mut new = vec![ChainId(0); gone.len()];
    for id in plant.chain_ids().filter(|id| !gone[id.index()]) {
        let chain = plant.chain(id);
        let (points, radii) = (plant.points(id), plant.radii(id));
        new[id.index()] = match chain.parent {
            None => builder.stem(chain.origin, points, radii),
            Some(parent) => builder.branch(new[parent.index()], chain.location, points, radii),
        };
    }
    for leaf in plant.leaves().iter().filter(|leaf| !gone[leaf.chain.index()]) {
        builder.leaf(crate::plant::Leaf { chain: new[leaf.chain.index()], ..*leaf });
    }
    builder.finish_trusted()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::preset::plan::MatchParams;
    use crate::relate::random_plant::{Oddity, random_plant};

    const PAPER: FilterParams = FilterParams { collisions: 0.01, rise: 0.01, botany: 1.0 };

    #[test]
    fn what_is_measured_before_the_removal_is_what_stands_after_it() {
        let mut removed = 0;
        for s in 0..20 {
            let seed = Seed::new(s);
            let plant = |name| random_plant(seed.child(name), 60, Oddity::Tame);
            let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
            let family = crate::relate::fuzzy_family(plant("a"), plant("b"), &matching).unwrap();
            let sources = Sources::of(&family, &PAPER);
            let weights = crate::blend::sample(&family, 0, 1, seed, 0.5);
            let (blend, kins) = family.blend_with_kins(&weights);
            let seen = examine(&blend, &kins, &sources, &PAPER);
            let left = without(&blend, &seen.gone());
            removed += seen.collisions.len();
            let after = Profile::of(&left, &left.pose());
            assert_eq!(after.topology, seen.profile.topology);
            assert!((after.crown.distance(&seen.profile.crown)) < 1e-4);
            assert_eq!(after.crown_ratio, seen.profile.crown_ratio);
        }
        assert!(removed > 10, "{removed}");
    }

    #[test]
    fn a_corner_passes_unharmed() {
        for s in 0..10 {
            let plant = |name| random_plant(Seed::new(s).child(name), 60, Oddity::Wild);
            let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
            let family = crate::relate::fuzzy_family(plant("a"), plant("b"), &matching).unwrap();
            let sources = Sources::of(&family, &PAPER);
            for source in 0..2 {
                let (corner, kins) = family.blend_with_kins(&family.corner(source));
                let seen = examine(&corner, &kins, &sources, &PAPER);
                assert!(seen.collisions.is_empty() && seen.departure.by == 0.0, "{s} {source}");
            }
        }
    }

    #[test]
    fn leaves_go_with_their_branch_and_a_whole_plant_never_goes() {
        let plant = random_plant(Seed::new(3), 40, Oddity::Tame);
        let last = ChainId(plant.chains().len() as u32 - 1);
        let left = without(&plant, &[last]);
        assert_eq!(left.chains().len() + 1, plant.chains().len());
        assert_eq!(left.leaves().len(), plant.leaves().iter().filter(|l| l.chain != last).count());
        let stems: Vec<ChainId> = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_none()).collect();
        assert!(without(&plant, &stems) == plant);
    }
}
