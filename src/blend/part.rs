//! Partial blending: which kins take part (2017 TVCG, 5.1: "a set of user-defined task packs containing operations on
//! the branches that users are interested in").
//!
//! A kin is chosen by its Gravelius order, by how high its base stands, or by a named part of a source. Demands of one
//! kind are alternatives, demands of different kinds must all hold: orders 2 or 3, and above the middle. The order is that of the
//! first source that has the kin. Its height is where it stands on the first source, which the rest stays as, and where it would
//! stand there as the others have it: a limb of the upper half that comes to be a shoot at the other's foot takes no part. A part
//! is asked of every source that has one of that name.

use glam::Vec3;

use crate::base::math;
use crate::plant::{ChainId, Plant, Posed};
use crate::preset::plan::{OnlyParams, PartRegion};
use crate::relate::{Family, KinId, Weights};

/// Which kins take part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chosen {
    kins: Vec<bool>,
}

impl Chosen {
    /// Whether a kin takes part.
    #[must_use]
    pub fn has(&self, kin: KinId) -> bool {
        self.kins.get(kin.index()).copied().unwrap_or(false)
    }

    /// How many do.
    #[must_use]
    pub fn count(&self) -> usize {
        self.kins.iter().filter(|part| **part).count()
    }

    /// The weights with every kin that takes no part as the first source has it.
    ///
    /// What bears one of those stays, too: as much of it as the others' lack of it would take goes to the first source's.
    #[must_use]
    pub fn hold(&self, family: &Family, mut weights: Weights) -> Weights {
        let first: Vec<f32> = (0..family.sources().len()).map(|s| if s == 0 { 1.0 } else { 0.0 }).collect();
        let mut bears = vec![false; family.kin_count()];
        // Bearers come before what they bear.
        for kin in family.kin_ids().rev() {
            let stays = if self.has(kin) {
                let degree = weights.degree(kin).clamp(0.0, 1.0);
                if bears[kin.index()] && degree < 1.0 {
                    let shares = weights.shares(kin);
                    let has = |s: usize| family.member(kin, s).is_some();
                    let sum: f32 = shares.iter().enumerate().filter(|(s, _)| has(*s)).map(|(_, w)| w).sum();
                    let scale = if sum > 0.0 { degree / sum } else { 0.0 };
                    let mut own: Vec<f32> = shares.iter().map(|w| w * scale).collect();
                    own[0] += 1.0 - degree;
                    weights.set(kin, &own, 1.0);
                }
                bears[kin.index()]
            } else {
                let stays = family.is_primary(kin, 0);
                weights.set(kin, &first, if stays { 1.0 } else { 0.0 });
                weights.keep(kin);
                stays
            };
            if let Some(parent) = family.parent(kin) {
                bears[parent.index()] |= stays;
            }
        }
        weights
    }
}

/// The kins that meet the demands. `parts` names regions of sources: the source's index in the family, the name.
#[must_use]
pub fn chosen(family: &Family, only: &OnlyParams, parts: &[(usize, &str, PartRegion)]) -> Chosen {
    let posed: Vec<Placed> = family.sources().iter().map(Placed::of).collect();
    let wanted: Vec<(usize, PartRegion)> =
        parts.iter().filter(|part| only.parts.iter().any(|name| name == part.1)).map(|part| (part.0, part.2)).collect();
    let takes_part = |kin: KinId| {
        let mut members = (0..posed.len()).filter_map(|s| family.member(kin, s).map(|chain| (s, chain)));
        let Some((s, chain)) = members.clone().next() else { return false };
        let order = family.sources()[s].chain(chain).order;
        let in_height = |(s, chain): (usize, ChainId)| {
            let height = stands(family, &posed, kin, s, chain);
            only.heights.iter().any(|(low, high)| (*low..=*high).contains(&height))
        };
        (only.orders.is_empty() || only.orders.iter().any(|(low, high)| (*low..=*high).contains(&order)))
            && (only.heights.is_empty() || members.clone().all(in_height))
            && (only.parts.is_empty()
                || members.any(|(s, chain)| {
                    let own = wanted.iter().filter(|part| part.0 == s);
                    own.clone().any(|part| posed[s].lies_in(&family.sources()[s], chain, part.1))
                }))
    };
    Chosen { kins: family.kin_ids().map(takes_part).collect() }
}

/// How high a kin stands on the first source, or would stand there as another source has it, as a share of its height; as in its own
/// source where the first has nothing that bears it.
fn stands(family: &Family, posed: &[Placed], kin: KinId, source: usize, chain: ChainId) -> f32 {
    let own = posed[source].height_of(chain);
    if source == 0 {
        return own;
    }
    let (mut kin, mut chain) = (kin, chain);
    while let Some(parent) = family.parent(kin) {
        if let Some(bearer) = family.member(parent, 0) {
            let location = family.sources()[source].chain(chain).location;
            return posed[0].height_at(&family.sources()[0], bearer, location);
        }
        let Some(above) = family.member(parent, source) else { break };
        (kin, chain) = (parent, above);
    }
    own
}

/// Where the chains of a source stand.
struct Placed {
    posed: Posed,
    /// Base and tip of each chain.
    ends: Vec<(Vec3, Vec3)>,
    height: f32,
}

impl Placed {
    fn of(plant: &Plant) -> Self {
        let posed = plant.pose();
        let ends = plant.chain_ids().map(|id| {
            let points = posed.chain(plant, id);
            (points[0], points[points.len() - 1])
        });
        let height = posed.positions().iter().fold(0.0_f32, |top, p| top.max(p.y));
        Self { ends: ends.collect(), height: height.max(1e-6), posed }
    }

    /// Of a place on a chain, as a share of the plant's.
    fn height_at(&self, plant: &Plant, chain: ChainId, location: f32) -> f32 {
        let place = self.posed.curve(plant, chain).point(f64::from(location));
        (place.y / self.height).clamp(0.0, 1.0)
    }

    /// Of a chain's base, as a share of the plant's.
    fn height_of(&self, chain: ChainId) -> f32 {
        (self.ends[chain.index()].0.y / self.height).clamp(0.0, 1.0)
    }

    fn lies_in(&self, plant: &Plant, chain: ChainId, region: PartRegion) -> bool {
        match region {
            PartRegion::Branch(number) => {
                let mut at = Some(chain);
                while let Some(id) = at {
                    if id.0 == number {
                        return true;
                    }
                    at = plant.chain(id).parent;
                }
                false
            }
            PartRegion::Region { low, high, azimuth, within } => {
                let tip = self.ends[chain.index()].1;
                // From the front (+z) towards +x.
                let own = math::atan2(tip.x, tip.z);
                let turn = std::f32::consts::TAU;
                let apart = (own - azimuth).rem_euclid(turn);
                (low..=high).contains(&self.height_of(chain)) && apart.min(turn - apart) <= within
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::preset::plan::MatchParams;
    use crate::relate::fuzzy_family;
    use crate::relate::random_plant::{Oddity, random_plant};

    fn family() -> Family {
        let plant = |i| random_plant(Seed::new(21).at(i), 50, Oddity::Tame);
        fuzzy_family(plant(0), plant(1), &MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 }).unwrap()
    }

    #[test]
    fn demands_of_different_kinds_must_all_hold() {
        let family = family();
        let count = |only: &OnlyParams| chosen(&family, only, &[]).count();
        assert_eq!(count(&OnlyParams::default()), family.kin_count());
        let orders = OnlyParams { orders: vec![(2, 3)], ..OnlyParams::default() };
        let heights = OnlyParams { heights: vec![(0.5, 1.0)], ..OnlyParams::default() };
        let both = OnlyParams { orders: vec![(2, 3)], heights: vec![(0.5, 1.0)], ..OnlyParams::default() };
        assert!(count(&both) < count(&orders) && count(&both) < count(&heights) && count(&both) > 0);
        let either = OnlyParams { orders: vec![(2, 2), (3, 3)], ..OnlyParams::default() };
        assert_eq!(count(&either), count(&orders));
        assert_eq!(count(&OnlyParams { orders: vec![(40, 60)], ..OnlyParams::default() }), 0);
    }

    #[test]
    fn what_stays_is_borne_by_what_stays_at_every_weight() {
        use crate::blend::mix;
        let family = family();
        // Trunks do not take part with what is thin: but limbs do, and bear it.
        let only = OnlyParams { orders: vec![(2, 2)], ..OnlyParams::default() };
        let chosen = chosen(&family, &only, &[]);
        let own = |kin: &KinId| !chosen.has(*kin) && family.member(*kin, 0).is_some();
        let (held, alone) = (family.kin_ids().filter(own).count(), |kin: &KinId| family.member(*kin, 1).is_none());
        assert!(family.kin_ids().any(|k| chosen.has(k) && alone(&k) && family.children(k).any(|c| own(&c))));
        let mut blender = crate::relate::Blender::new(&family);
        for share in [0.0, 0.001, 0.3, 0.9, 0.999, 1.0] {
            let weights = chosen.hold(&family, mix(&family, &[1.0 - share, share]));
            let tree = blender.blend(&weights);
            let there: Vec<KinId> = blender.kins().to_vec();
            assert_eq!(there.iter().filter(|kin| own(kin)).count(), held, "{share}");
            // And as long as in the first source.
            for (i, kin) in there.iter().enumerate().filter(|(_, kin)| own(kin)) {
                let length = |plant: &Plant, id| crate::plant::Curve::new(plant.points(id)).length();
                let first = length(&family.sources()[0], family.member(*kin, 0).unwrap());
                let bearer = family.parent(*kin).map_or(1.0, |parent| weights.degree(parent));
                assert!((length(&tree, ChainId(i as u32)) - first).abs() < 1e-3 * first && bearer == 1.0, "{share}");
            }
        }
    }

    #[test]
    fn what_takes_no_part_is_as_thick_as_it_was_and_nothing_comes_up_elsewhere() {
        let family = family();
        let only = OnlyParams { heights: vec![(0.6, 1.0)], ..OnlyParams::default() };
        let chosen = chosen(&family, &only, &[]);
        assert!(chosen.count() > 0);
        let first = &family.sources()[0];
        let tasks = crate::blend::Tasks::partial(&family, 0, 1, &|kin| chosen.has(kin));
        let held = chosen.hold(&family, crate::blend::mix(&family, &[0.1, 0.9]));
        let top = Placed::of(first).height;
        let own: Vec<f32> = first.chain_ids().map(|id| Placed::of(first).ends[id.index()].0.y).collect();
        for weights in [tasks.weights(&tasks.sample(Seed::new(3), 0.9, 1.0)), held] {
            let mut blender = crate::relate::Blender::new(&family);
            let tree = blender.blend(&weights);
            let placed = Placed::of(&tree);
            for (i, &kin) in blender.kins().iter().enumerate() {
                let (id, member) = (ChainId(i as u32), family.member(kin, 0));
                if let (false, Some(chain)) = (chosen.has(kin), member) {
                    assert_eq!(tree.radii(id), first.radii(chain), "{kin:?}");
                }
                // A branch that is of the other source stands no lower than what was asked for, but for what its bearer bends.
                let low = own.get(member.map_or(usize::MAX, ChainId::index)).copied().unwrap_or(0.6 * top);
                let y = placed.ends[i].0.y;
                assert!(!chosen.has(kin) || y > low.min(0.6 * top) - 0.15 * top, "{kin:?}: {y} of {top}");
            }
        }
    }

    #[test]
    fn a_part_is_a_branch_with_all_it_bears_or_a_region() {
        let family = family();
        let only = OnlyParams { parts: vec!["limb".to_owned()], ..OnlyParams::default() };
        let limb = family.kin_ids().find(|&k| family.member(k, 0).is_some_and(|c| c.0 == 4)).unwrap();
        let chosen_kins = chosen(&family, &only, &[(0, "limb", PartRegion::Branch(4))]);
        assert!(chosen_kins.has(limb));
        for kin in family.kin_ids().filter(|&k| chosen_kins.has(k) && k != limb) {
            assert!(chosen_kins.has(family.parent(kin).unwrap()));
        }
        let half = |azimuth: f32| {
            let region = PartRegion::Region { low: 0.0, high: 1.0, azimuth, within: std::f32::consts::FRAC_PI_2 };
            chosen(&family, &only, &[(0, "limb", region)]).count()
        };
        let all = family.kin_ids().filter(|&k| family.member(k, 0).is_some()).count();
        assert_eq!(half(0.3) + half(0.3 + std::f32::consts::PI), all);
        assert_eq!(chosen(&family, &only, &[(0, "other", PartRegion::Branch(0))]).count(), 0);
    }
}
