//! Leaves of twigs without a partner (2017 CAVW, 5 and 6.2): "every single leaf" goes from one tree to the other.
//!
//! Lobes of matched chains are paired by `leaf_pairs.rs`. But the twigs that bear most leaves are many, of unlike numbers and
//! depths in two trees, and most of them have no partner: their leaves would all wilt and grow, as those of no matching at all do.
//! In the spirit of Rule 3 what is left over is pooled under the next matched pair of chains above it, and matched there greedily.
//! The similarity is that of leaves in a lobe, with their distance on the straightened chain, in its lengths, for the one along it.
//! No leaf goes farther than [`REACH`] lengths of the chain: what has no like so near among what is left over joins the leaf that it
//! resembles most of all that the other tree has there. What is too far from all is pooled again under the next matched chain
//! down, and at last comes and goes with its twig.
//!
//! On the way such a leaf goes along the wood: it stays on its own twig, which wilts, then goes down that, along the matched chain
//! and up the twig of the other tree, which grows, and stays there. Each has a time of its own for it ([`GOES`], [`LASTS`]), and all have
//! the size between. Rejected: the straight line from twig to twig, on which leaves hang in the air (the paper's Fig. 11).

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;

use super::Family;
use super::family::NONE;
use super::kernel::Blender;
use super::leaf_pairs::{LeafPair, PairedSlots, apart, between, greedy, together};
use crate::base::{Rotation, math};
use crate::plant::{ChainId, Leaf, Plant, Posed};

/// How far leaves go at most, in lengths of the matched chain that bears both.
const REACH: f32 = 0.35;
/// How many leaves on either side along that chain one without a like looks at: cost stays linear in the leaves.
const BESIDE: usize = 256;
/// Shares of the matched chain between which leaves are half way along the wood, one after the other, and how long before and after that
/// they are under way: while there is much of both twigs, or they would stand in a ball on what is left of one.
const GOES: [f32; 2] = [0.3, 0.7];
const LASTS: f32 = 0.2;
/// From one leaf's time to the next: the golden section, so that any few are spread evenly.
const STRIDE: f32 = 0.618_034;

/// How the leaves of two sources are matched ([`Family::leaf_matches`]): how many there are on the way from one to the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeafMatches {
    /// Of both sources, in lobes of matched chains.
    pub lobes: usize,
    /// Of both sources, on twigs without a partner under matched chains.
    pub pooled: usize,
    /// Of one source, which come or go.
    pub alone: usize,
}

/// A leaf as seen from a chain that bears it.
#[derive(Clone, Copy)]
struct Seen {
    /// On the chain made straight along y, in its lengths.
    place: Vec3,
    /// Against the chain's frame where it leaves it.
    orientation: Rotation,
}

impl Family {
    /// How the leaves of two sources are matched; none before [`pair_leaves`](Self::pair_leaves).
    #[must_use]
    pub fn leaf_matches(&self) -> Option<LeafMatches> {
        let pairs = &self.leaf_pairs.as_ref()?.pairs;
        let mut found = LeafMatches::default();
        for pair in pairs.iter().filter(|pair| !self.stand_ins[pair.kin as usize]) {
            match (pair.is_whole(), pair.on == [pair.kin; 2]) {
                (false, _) => found.alone += 1,
                (true, true) => found.lobes += 1,
                (true, false) => found.pooled += 1,
            }
        }
        Some(found)
    }

    /// Gives leaves that are alone a partner under the next matched chain; `borne` are leaves by source and chain.
    pub(super) fn pool_leaves(
        &self,
        pairs: &mut Vec<LeafPair>,
        borne: &[Vec<Vec<u32>>],
        partner: &[(u16, u16)],
        slots: &mut PairedSlots,
    ) {
        let whole = |k: u32| self.row(k as usize).iter().all(|member| member.chain != NONE);
        let matched = |mut k: u32| {
            while !whole(k) {
                k = self.parents[k as usize];
                if k == NONE {
                    return None;
                }
            }
            Some(k)
        };
        // By matched kin, and there by source: what is alone.
        let mut pools: BTreeMap<u32, [Vec<Stand>; 2]> = BTreeMap::new();
        for pair in pairs.iter().filter(|pair| !pair.is_whole() && !self.stand_ins[pair.kin as usize]) {
            let s = usize::from(pair.leaves[0] == NONE);
            if let Some(kin) = matched(pair.kin) {
                pools.entry(kin).or_default()[s].push((pair.leaves[s], pair.kin));
            }
        }
        if pools.is_empty() {
            return;
        }
        let posed: Vec<Posed> = self.plants.iter().map(Plant::pose).collect();
        let stands = |pair: &LeafPair| [0, 1].map(|s| (s, (pair.leaves[s], pair.on[s])));
        let mut shown: BTreeSet<(usize, Stand)> =
            pairs.iter().filter(|pair| pair.is_whole()).flat_map(stands).collect();
        let mut found = Vec::new();
        // From the twigs down: kins come after those that they grow on.
        while let Some((kin, pool)) = pools.pop_last() {
            let pairs = self.pooled(kin, &pool, borne, partner, &posed);
            let down = Some(self.parents[kin as usize]).filter(|k| *k != NONE).and_then(matched);
            for s in 0..2 {
                let paired: BTreeSet<Stand> = pairs.iter().map(|pair| pair[s]).collect();
                if let (Some(down), true) = (down, pool[s].iter().any(|stand| !paired.contains(stand))) {
                    let left = pool[s].iter().filter(|stand| !paired.contains(stand));
                    pools.entry(down).or_default()[s].extend(left);
                }
            }
            for stands in pairs {
                let [a, b] = [0, 1].map(|s| self.plants[s].leaves()[stands[s].0 as usize].slot);
                let shows = [0, 1].map(|s| shown.insert((s, stands[s])));
                let (on, leaves) = (stands.map(|stand| stand.1), stands.map(|stand| stand.0));
                found.push(LeafPair { kin, on, leaves, shows, slot: slots.between((a, b)) });
            }
        }
        let taken: BTreeSet<(usize, Stand)> = found.iter().flat_map(stands).collect();
        pairs.retain(|pair| {
            let s = usize::from(pair.leaves[0] == NONE);
            pair.is_whole() || !taken.contains(&(s, (pair.leaves[s], pair.kin)))
        });
        pairs.append(&mut found);
    }

    /// Pairs of leaves under a matched kin, by source: of what is left over there, with each other or with any that the other has.
    fn pooled(
        &self,
        kin: u32,
        pool: &[Vec<Stand>; 2],
        borne: &[Vec<Vec<u32>>],
        partner: &[(u16, u16)],
        posed: &[Posed],
    ) -> Vec<[Stand; 2]> {
        let seen: [Vec<Seen>; 2] =
            [0, 1].map(|s| pool[s].iter().map(|stand| self.seen(kin, s, stand.0, &posed[s])).collect());
        let leaf = |s: usize, stand: Stand| &self.plants[s].leaves()[stand.0 as usize];
        let cost = |i: u32, j: u32| {
            let (own, other) = (seen[0][i as usize], seen[1][j as usize]);
            let way = own.place.distance(other.place).min(1.0);
            apart(
                way,
                (leaf(0, pool[0][i as usize]), own.orientation),
                (leaf(1, pool[1][j as usize]), other.orientation),
            )
        };
        let along = |s: usize, i: u32| seen[s][i as usize].place.y;
        let mut pairs: Vec<[Stand; 2]> = Vec::new();
        for stars in together(partner) {
            let [a, b] = [0, 1].map(|s| {
                let own = 0..pool[s].len() as u32;
                own.filter(|&i| stars[s].contains(&leaf(s, pool[s][i as usize]).slot)).collect::<Vec<u32>>()
            });
            let found = greedy(a, b, &along, &cost);
            let near = |&(i, j): &(u32, u32)| seen[0][i as usize].place.distance(seen[1][j as usize].place) <= REACH;
            pairs.extend(found.into_iter().filter(near).map(|(i, j)| [pool[0][i as usize], pool[1][j as usize]]));
        }
        // Whoever has no like, or is too far from it, joins any that is near.
        for s in 0..2 {
            let paired: BTreeSet<Stand> = pairs.iter().map(|pair| pair[s]).collect();
            let open: Vec<Stand> = pool[s].iter().copied().filter(|stand| !paired.contains(stand)).collect();
            if open.is_empty() {
                continue;
            }
            let others = self.borne_under(kin, 1 - s, &borne[1 - s]).into_iter();
            let mut others: Vec<(Stand, Seen)> =
                others.map(|other| (other, self.seen(kin, 1 - s, other.0, &posed[1 - s]))).collect();
            others.sort_by(|a, b| a.1.place.y.total_cmp(&b.1.place.y).then(a.0.cmp(&b.0)));
            for stand in open {
                let (own, at) = (leaf(s, stand), self.seen(kin, s, stand.0, &posed[s]));
                let here = others.partition_point(|other| other.1.place.y < at.place.y);
                let beside = here.saturating_sub(BESIDE)..others.len().min(here + BESIDE);
                let mut best: Option<(f32, Stand)> = None;
                for (other, place) in &others[beside] {
                    let way = at.place.distance(place.place);
                    let like = leaf(1 - s, *other);
                    let slots = if s == 0 { (own.slot, like.slot) } else { (like.slot, own.slot) };
                    if way > REACH || !partner.contains(&slots) {
                        continue;
                    }
                    let cost = apart(way, (own, at.orientation), (like, place.orientation));
                    if best.is_none_or(|best| cost < best.0) {
                        best = Some((cost, *other));
                    }
                }
                pairs.extend(best.map(|(_, other)| if s == 0 { [stand, other] } else { [other, stand] }));
            }
        }
        pairs
    }

    /// The leaves of a source on a kin and all below it.
    fn borne_under(&self, kin: u32, source: usize, borne: &[Vec<u32>]) -> Vec<Stand> {
        let (mut work, mut found) = (vec![kin], Vec::new());
        while let Some(k) = work.pop() {
            let chain = self.row(k as usize)[source].chain;
            if self.stand_ins[k as usize] || chain == NONE {
                continue;
            }
            found.extend(borne[chain as usize].iter().map(|&leaf| (leaf, k)));
            work.extend(self.child_range(k as usize).map(|i| self.children[i]));
        }
        found
    }

    /// A leaf of a source as seen from its chain on a kin above it.
    fn seen(&self, kin: u32, source: usize, leaf: u32, posed: &Posed) -> Seen {
        let plant = &self.plants[source];
        let own = &plant.leaves()[leaf as usize];
        let bearer = ChainId(self.row(kin as usize)[source].chain);
        let (mut chain, mut location) = (own.chain, own.location);
        while let (true, Some(parent)) = (chain != bearer, plant.chain(chain).parent) {
            (chain, location) = (parent, plant.chain(chain).location);
        }
        let (at, pose) = (posed.at(plant, bearer, location), posed.leaf(plant, own));
        let length = self.lengths[source][bearer.index()].max(1e-6);
        Seen {
            place: at.frame.to_local(pose.position - at.position) / length + Vec3::Y * location,
            orientation: at.frame.rotation().inverse().after(pose.frame.rotation()),
        }
    }
}

/// A leaf, and the kin that it stands on.
type Stand = (u32, u32);

impl Blender<'_> {
    /// The plant with leaves that go from one kin to another where they are between the two.
    pub(super) fn travel(&self, plant: Plant, travelling: &[(usize, LeafPair)]) -> Plant {
        if travelling.is_empty() {
            return plant;
        }
        let posed = plant.pose();
        let mut leaves = plant.leaves().to_vec();
        for (turn, (index, pair)) in travelling.iter().enumerate() {
            let share = self.share(pair.kin as usize)[1];
            let ends = [0, 1].map(|s| {
                let (on, own) = (pair.on[s] as usize, self.family.plants[s].leaves()[pair.leaves[s] as usize]);
                Leaf { chain: ChainId(self.chains[on]), offset: own.offset * self.grown[on], ..own }
            });
            let half = GOES[0] + (GOES[1] - GOES[0]) * (turn as f32 * STRIDE).fract();
            let way = math::smoothstep(half - LASTS, half + LASTS, share);
            let bearer = ChainId(self.chains[pair.kin as usize]);
            let (chain, location) = along_wood(&plant, &posed, bearer, ends.map(|end| (end.chain, end.location)), way);
            let [a, b] = ends.map(|leaf| posed.leaf(&plant, &leaf));
            let [off_a, off_b] = ends.map(|leaf| posed.frame(leaf.chain, leaf.location).to_world(leaf.offset));
            let frame = posed.frame(chain, location);
            let turned = a.frame.rotation().slerp(b.frame.rotation(), way);
            leaves[*index] = Leaf {
                chain,
                location,
                orientation: frame.rotation().inverse().after(turned),
                offset: frame.to_local(off_a.lerp(off_b, way)),
                ..between(&ends[0], &ends[1], share, pair.slot)
            };
        }
        plant.with_leaves(leaves)
    }
}

/// The place at a share of the way along the wood from one place to another, over a chain that bears both.
fn along_wood(plant: &Plant, posed: &Posed, bearer: ChainId, ends: [(ChainId, f32); 2], way: f32) -> (ChainId, f32) {
    let length = |chain: ChainId| posed.curve(plant, chain).length();
    // Down to the bearer: chain, and from where on it.
    let down = |(mut chain, mut location): (ChainId, f32)| {
        let mut legs = Vec::new();
        while let (true, Some(parent)) = (chain != bearer, plant.chain(chain).parent) {
            legs.push((chain, location, length(chain) * location));
            (chain, location) = (parent, plant.chain(chain).location);
        }
        (legs, location)
    };
    let ((from, foot), (to, other)) = (down(ends[0]), down(ends[1]));
    let across = length(bearer) * (other - foot).abs();
    let sum = |legs: &[(ChainId, f32, f32)]| legs.iter().map(|leg| leg.2).sum::<f32>();
    let whole = sum(&from) + across + sum(&to);
    if way <= 0.0 || way >= 1.0 || whole.is_nan() || whole <= 0.0 {
        return ends[usize::from(way > 0.5)];
    }
    let mut left = whole * way;
    for &(chain, location, leg) in &from {
        if left < leg {
            return (chain, location * (1.0 - left / leg));
        }
        left -= leg;
    }
    if left < across {
        return (bearer, (foot + (other - foot) * (left / across)).clamp(0.0, 1.0));
    }
    left -= across;
    for &(chain, location, leg) in to.iter().rev() {
        if left < leg {
            return (chain, location * (left / leg));
        }
        left -= leg;
    }
    ends[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, math};
    use crate::blend::morph;
    use crate::plant::PlantBuilder;
    use crate::preset::plan::{MatchParams, PatternParams};
    use crate::relate::pattern_family;

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    /// A trunk with limbs, and on each of them twigs of some leaves.
    fn tree(limbs: usize, twigs: usize, leaves: usize, slot: u16) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 6.0], &[0.2, 0.05]);
        for i in 0..limbs {
            let (sin, cos) = math::sin_cos(i as f32 * 2.4);
            let location = 0.3 + 0.6 * i as f32 / limbs as f32;
            let limb = builder.branch(stem, location, &[Vec3::ZERO, Vec3::new(cos, 0.5, sin) * 2.0], &[0.05, 0.02]);
            for k in 0..twigs {
                let way = Seed::new(i as u64).at(k as u64).direction() * 0.4;
                let twig =
                    builder.branch(limb, 0.2 + 0.8 * k as f32 / twigs as f32, &[Vec3::ZERO, way], &[0.01, 0.004]);
                for j in 0..leaves {
                    let turn = Rotation::about(Vec3::Y, j as f32);
                    builder.leaf(Leaf::new(twig, (j as f32 + 1.0) / leaves as f32, turn, 0.1, slot));
                }
            }
        }
        builder.finish().unwrap()
    }

    #[test]
    fn leaves_of_twigs_without_a_partner_travel_too_along_the_wood() {
        let (a, b) = (tree(5, 12, 4, 0), tree(5, 4, 5, 1));
        for (from, to) in [(&a, &b), (&b, &a)] {
            let family = pattern_family(from.clone(), to.clone(), &EVEN, &PatternParams::default()).unwrap();
            let family = family.pair_leaves(9).0;
            let found = family.leaf_matches().unwrap();
            assert!(found.pooled > 0 && found.alone * 10 <= found.lobes + found.pooled, "{found:?}");
            assert!(family.blend(&family.corner(0)) == *from && family.blend(&family.corner(1)) == *to);
            let mut last: Option<Vec<Vec3>> = None;
            for step in 0..=100 {
                let t = (step as f32 / 100.0).clamp(1e-5, 1.0 - 1e-5);
                let tree = family.blend(&morph(&family, 0, 1, t));
                let posed = tree.pose();
                let places: Vec<Vec3> = tree.leaves().iter().map(|leaf| posed.leaf(&tree, leaf).position).collect();
                assert!(tree.leaves().iter().all(|leaf| leaf.offset.length() < 1e-6), "{step}: they are on wood");
                // Of full size all the way.
                let small = tree.leaves().iter().filter(|leaf| leaf.size < 0.09).count();
                assert!(small <= found.alone, "{step}: {small}");
                if let Some(last) = last {
                    assert!(last.len() == places.len() && last.iter().zip(&places).all(|(p, q)| p.distance(*q) < 0.2));
                }
                if step == 0 || step == 100 {
                    let end = if step == 0 { from } else { to };
                    let own = end.pose();
                    let of_end: Vec<Vec3> = end.leaves().iter().map(|leaf| own.leaf(end, leaf).position).collect();
                    let near = |p: &&Vec3| of_end.iter().any(|q| q.distance(**p) < 1e-3);
                    assert!(places.iter().filter(near).count() >= places.len() - found.alone);
                }
                last = Some(places);
            }
        }
    }
}
