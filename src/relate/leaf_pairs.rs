//! Leaves in correspondence (2017 CAVW, 5 and 6.2): within the lobes of matched chains, greedily by similarity, and the
//! leaf between two.
//!
//! The similarity is the weighted sum of how far apart the leaves are along the chain, in length, width and orientation;
//! lengths and widths are metres, each mixed by itself.
//! The most similar pair goes first; each leaf of the larger lobe that is left over goes with the leaf of the smaller
//! that it resembles most. So one leaf splits into several, or several merge into one, and in a matched lobe no leaf
//! is left alone as long as the other has leaves of the same picture. What is left over is pooled under the next matched chain
//! (`leaf_pools.rs`). Leaves whose pictures don't go together, and those without a partner there, grow and wilt in size: by the square root of their share, so that their area follows it
//! (by the share itself a crown would be half bare half way), and with their shoot while that is short.
//!
//! Each picture of one source goes with one of the other (the most often worn with the most often worn), those that are left over of
//! the more with one that has a partner, or else there would be as many pictures between as pairs. Leaves choose among all the
//! partners of their picture. A leaf between two wears slot `first + i` for pair `i` of
//! [`PairedSlots::pairs`]; where both sources wear the same slot it stays.
//!
//! Time: a lobe of a × b leaves takes a·b·log; a lobe of more than [`MOST_PAIRS`] pairs is first cut into stretches along
//! the chain.

use std::collections::{BTreeMap, BTreeSet};

use super::Family;
use super::family::NONE;
use super::kernel::{Blender, Feed};
use crate::base::{Rotation, math};
use crate::plant::{ChainId, Leaf, PlantBuilder};

/// Most pairs of leaves that are compared at once.
const MOST_PAIRS: usize = 1 << 12;
/// Leaves of a shoot are so much longer than it, of what both are when grown, at most.
const SHOOT: f32 = 1.6;
/// From the lots by which sources share leaves to those by which they come out; and how far a shoot covers, as a share of a leaf's lot,
/// when it does, and beyond that of the rest when it is as long as its source has it.
const OTHER_LOTS: f32 = 61.0;
const EARLY: f32 = 0.75;
const SOON: f32 = 0.02;
/// Weights of location, size, width and orientation.
const WEIGHTS: [f32; 4] = [0.5, 0.15, 0.1, 0.25];

/// Leaves of two sources that are one, or one alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafPair {
    /// The kin of both, in whose shares the leaf goes from one to the other.
    pub(super) kin: u32,
    /// By source: the kin that the leaf stands on, the same or one below it (`leaf_pools.rs`).
    pub(super) on: [u32; 2],
    /// By source: index of the leaf, or none.
    pub(super) leaves: [u32; 2],
    /// By source: whether this is the one of several pairs that shows the leaf where its source is alone on the kin.
    pub(super) shows: [bool; 2],
    /// The slot between.
    pub(super) slot: u16,
}

impl LeafPair {
    /// Whether it is of a leaf of each source.
    pub(super) fn is_whole(&self) -> bool {
        !self.leaves.contains(&NONE)
    }
}

/// All pairs of a family, kin after kin.
#[derive(Clone, Debug)]
pub(super) struct LeafPairs {
    pub(super) pairs: Vec<LeafPair>,
}

/// Which slots leaves in correspondence wear.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PairedSlots {
    /// Slots of the first and of the second source; the i-th pair has slot `first + i` in between.
    pub pairs: Vec<(u16, u16)>,
    /// The first slot in between.
    pub first: u16,
}

impl PairedSlots {
    /// The slot between two.
    pub(super) fn between(&mut self, pair: (u16, u16)) -> u16 {
        if pair.0 == pair.1 {
            return pair.0;
        }
        let known = self.pairs.iter().position(|p| *p == pair).unwrap_or_else(|| {
            self.pairs.push(pair);
            self.pairs.len() - 1
        });
        self.first.saturating_add(known as u16)
    }
}

impl Family {
    /// Puts the leaves of a family of two sources in correspondence, and says which pictures are worn between. `first` is
    /// the first slot that no source uses. A family of another number of sources stays as it is.
    #[must_use]
    pub fn pair_leaves(mut self, first: u16) -> (Self, PairedSlots) {
        let mut slots = PairedSlots { pairs: Vec::new(), first };
        if self.plants.len() != 2 {
            return (self, slots);
        }
        let partner = partners([&self.plants[0], &self.plants[1]].map(|p| p.leaves()));
        // By source and chain.
        let borne: Vec<Vec<Vec<u32>>> = self
            .plants
            .iter()
            .map(|plant| {
                let mut borne = vec![Vec::new(); plant.chains().len()];
                plant.leaves().iter().enumerate().for_each(|(i, leaf)| borne[leaf.chain.index()].push(i as u32));
                borne
            })
            .collect();
        let mut pairs = Vec::new();
        for k in 0..self.kin_count() {
            let lobe = |s: usize| match self.row(k)[s].chain {
                NONE => &[][..],
                chain => &borne[s][ChainId(chain).index()],
            };
            let found = self.pair_lobes(k as u32, lobe(0), lobe(1), &partner, &mut slots);
            pairs.extend(found);
        }
        self.pool_leaves(&mut pairs, &borne, &partner, &mut slots);
        self.leaf_pairs = Some(LeafPairs { pairs });
        (self, slots)
    }

    fn pair_lobes(
        &self,
        kin: u32,
        a: &[u32],
        b: &[u32],
        partner: &[(u16, u16)],
        slots: &mut PairedSlots,
    ) -> Vec<LeafPair> {
        let leaf = |s: usize, i: u32| &self.plants[s].leaves()[i as usize];
        let mut found: Vec<LeafPair> = Vec::new();
        // A leaf that comes or goes takes part in the change of pictures, or a crown would be of two kinds.
        let mut alone = |s: usize, i: u32| {
            let mut leaves = [NONE; 2];
            leaves[s] = i;
            let own = leaf(s, i).slot;
            let pair = partner.iter().find(|pair| if s == 0 { pair.0 == own } else { pair.1 == own });
            let slot = pair.map_or(own, |pair| slots.between(*pair));
            found.push(LeafPair { kin, on: [kin; 2], leaves, shows: [true; 2], slot });
        };
        if a.is_empty() || b.is_empty() {
            a.iter().for_each(|&i| alone(0, i));
            b.iter().for_each(|&i| alone(1, i));
            return found;
        }
        // Only leaves whose pictures go together.
        let of = |s: usize, leaves: &[u32], slots: &[u16]| -> Vec<u32> {
            leaves.iter().copied().filter(|&i| slots.contains(&leaf(s, i).slot)).collect()
        };
        let (mut paired_a, mut paired_b) = (BTreeSet::new(), BTreeSet::new());
        let mut matched: Vec<(u32, u32, (u16, u16))> = Vec::new();
        for [slots_a, slots_b] in together(partner) {
            let (own, other) = (of(0, a, &slots_a), of(1, b, &slots_b));
            let along = |s: usize, i: u32| leaf(s, i).location;
            for (i, j) in greedy(own, other, &along, &|i, j| unlike(leaf(0, i), leaf(1, j))) {
                paired_a.insert(i);
                paired_b.insert(j);
                matched.push((i, j, (leaf(0, i).slot, leaf(1, j).slot)));
            }
        }
        a.iter().filter(|i| !paired_a.contains(i)).for_each(|&i| alone(0, i));
        b.iter().filter(|j| !paired_b.contains(j)).for_each(|&j| alone(1, j));
        let (mut shown_a, mut shown_b) = (BTreeSet::new(), BTreeSet::new());
        for (i, j, pair) in matched {
            let slot = slots.between(pair);
            let shows = [shown_a.insert(i), shown_b.insert(j)];
            found.push(LeafPair { kin, on: [kin; 2], leaves: [i, j], shows, slot });
        }
        found
    }
}

/// Pairs of leaves `a` of the first source and `b` of the second, of which every one of both is in one at least. `along` says where a leaf is, by source: those of more than [`MOST_PAIRS`] pairs are cut there.
pub(super) fn greedy(
    mut a: Vec<u32>,
    mut b: Vec<u32>,
    along: &dyn Fn(usize, u32) -> f32,
    unlike: &dyn Fn(u32, u32) -> f32,
) -> Vec<(u32, u32)> {
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let sort = |s: usize, own: &mut [u32]| {
        own.sort_by(|&i, &j| along(s, i).total_cmp(&along(s, j)).then(i.cmp(&j)));
    };
    sort(0, &mut a);
    sort(1, &mut b);
    let mut pairs = Vec::with_capacity(a.len().max(b.len()));
    let mut stretches = vec![(&a[..], &b[..])];
    while let Some((a, b)) = stretches.pop() {
        if a.len() * b.len() > MOST_PAIRS && a.len().min(b.len()) > 1 {
            let ((low_a, high_a), (low_b, high_b)) = (a.split_at(a.len() / 2), b.split_at(b.len() / 2));
            stretches.extend([(high_a, high_b), (low_a, low_b)]);
            continue;
        }
        let (na, nb) = (a.len(), b.len());
        if na.min(nb) == 1 {
            pairs.extend(a.iter().flat_map(|&i| b.iter().map(move |&j| (i, j))));
            continue;
        }
        let mut costs: Vec<(f32, u32, u32)> = (0..na)
            .flat_map(|i| (0..nb).map(move |j| (i, j)))
            .map(|(i, j)| (unlike(a[i], b[j]), i as u32, j as u32))
            .collect();
        costs.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let (mut taken_a, mut taken_b) = (vec![false; na], vec![false; nb]);
        // One each, then whoever is left.
        for one_each in [true, false] {
            for &(_, i, j) in &costs {
                let (x, y) = (i as usize, j as usize);
                let free = if one_each { !taken_a[x] && !taken_b[y] } else { !taken_a[x] || !taken_b[y] };
                if free {
                    (taken_a[x], taken_b[y]) = (true, true);
                    pairs.push((a[x], b[y]));
                }
            }
        }
    }
    pairs
}

/// How unlike two leaves are, 0..=1.
fn unlike(a: &Leaf, b: &Leaf) -> f32 {
    apart((a.location - b.location).abs(), (a, a.orientation), (b, b.orientation))
}

/// The same of leaves that are some way apart, 0..=1, with their orientations.
pub(super) fn apart(way: f32, a: (&Leaf, Rotation), b: (&Leaf, Rotation)) -> f32 {
    let ratio = |x: f32, y: f32| if x.max(y) > 0.0 { (x - y).abs() / x.max(y) } else { 0.0 };
    let dot = a.1.v.dot(b.1.v) + a.1.w * b.1.w;
    let turn = math::acos(dot.abs().min(1.0)) * std::f32::consts::FRAC_2_PI;
    let (a, b) = (a.0, b.0);
    way * WEIGHTS[0]
        + ratio(a.size, b.size) * WEIGHTS[1]
        + ratio(a.size * a.form.width(), b.size * b.form.width()) * WEIGHTS[2]
        + turn * WEIGHTS[3]
}

/// Which slots go together: those that both sources wear go with themselves, the others in order of how many leaves
/// wear them, round the smaller set.
fn partners(leaves: [&[Leaf]; 2]) -> Vec<(u16, u16)> {
    let worn = leaves.map(|leaves| {
        let mut slots: BTreeMap<u16, usize> = BTreeMap::new();
        leaves.iter().for_each(|leaf| *slots.entry(leaf.slot).or_default() += 1);
        let mut slots: Vec<(u16, usize)> = slots.into_iter().collect();
        slots.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
        slots.into_iter().map(|slot| slot.0).collect::<Vec<u16>>()
    });
    let mut pairs: Vec<(u16, u16)> = worn[0].iter().filter(|s| worn[1].contains(s)).map(|&s| (s, s)).collect();
    let [a, b] = [0, 1].map(|s| worn[s].iter().copied().filter(|slot| !worn[1 - s].contains(slot)).collect::<Vec<_>>());
    if !a.is_empty() && !b.is_empty() {
        pairs.extend((0..a.len().max(b.len())).map(|i| (a[i % a.len()], b[i % b.len()])));
    }
    pairs
}

/// Slots of both sources any of which may go with any: where a slot has several partners, leaves choose among all of theirs.
pub(super) fn together(partners: &[(u16, u16)]) -> Vec<[Vec<u16>; 2]> {
    let mut all: Vec<[Vec<u16>; 2]> = Vec::new();
    for &(a, b) in partners {
        match all.iter_mut().find(|[of_a, of_b]| of_a.contains(&a) || of_b.contains(&b)) {
            Some([of_a, of_b]) => {
                (!of_a.contains(&a)).then(|| of_a.push(a));
                (!of_b.contains(&b)).then(|| of_b.push(b));
            }
            None => all.push([vec![a], vec![b]]),
        }
    }
    all
}

impl Blender<'_> {
    /// Adds the leaves of the kins that are there; of those that go from one kin to another it tells which they are and of which
    /// pair.
    pub(super) fn pair_up(&self, pairs: &LeafPairs, builder: &mut PlantBuilder) -> Vec<(usize, LeafPair)> {
        let family = self.family;
        let (mut count, mut travelling) = (0, Vec::new());
        let mut add = |leaf: Leaf| {
            builder.leaf(leaf);
            count += 1;
            count - 1
        };
        for pair in &pairs.pairs {
            let stands = |s: usize| pair.leaves[s] != NONE && self.chains[pair.on[s] as usize] != NONE;
            let leaf = |s: usize| &family.plants[s].leaves()[pair.leaves[s] as usize];
            let k = pair.kin as usize;
            if stands(0) && stands(1) && self.feeds[k] == Feed::Several {
                let between = between(leaf(0), leaf(1), self.share(k)[1], pair.slot);
                let (chain, degree) = (ChainId(self.chains[pair.on[0] as usize]), self.grown[k]);
                let (size, offset) = (between.size * grown(degree), between.offset * degree);
                let index = add(Leaf { chain, size, offset, ..between });
                if pair.on != [pair.kin; 2] {
                    travelling.push((index, *pair));
                }
                continue;
            }
            for s in (0..2).filter(|&s| stands(s)) {
                let on = pair.on[s] as usize;
                let (share, degree) = (self.share(on)[s], self.grown[on]);
                if share > 0.0 && (pair.shows[s] || self.feeds[on] == Feed::Several) {
                    let own = *leaf(s);
                    let (size, offset) = (own.size * (share.sqrt() * grown(degree)), own.offset * degree);
                    add(Leaf { chain: ChainId(self.chains[on]), size, offset, slot: pair.slot, ..own });
                }
            }
        }
        travelling
    }
}

/// How long leaves are on a chain that has grown so far, as a share: their area follows it, but on shoots that are hardly there
/// they are no longer than those, or all leaves of a limb would stand in a ball.
fn grown(degree: f32) -> f32 {
    degree.sqrt().min(degree * SHOOT)
}

/// How long the leaf with a lot of 0..1 is on such a chain, as a share: they come out by their lots, and grow fast, so that all of them
/// cover what as many would that are [`grown`] as far. With all of them small a limb at a tenth of its length wore leaves of a sixth of
/// their size: trees of a dollhouse within the tree.
pub(super) fn emerged(degree: f32, lot: f32) -> f32 {
    let whole = grown(degree) * grown(degree);
    // Lots that share sources out would leave some of them bare: others of the same leaves.
    let lot = (lot * OTHER_LOTS).fract();
    let (first, last) = (EARLY * lot, lot + SOON * (1.0 - lot));
    ((whole - first) / (last - first)).clamp(0.0, 1.0)
}

/// The leaf at share `t` of the second.
pub(super) fn between(a: &Leaf, b: &Leaf, t: f32, slot: u16) -> Leaf {
    let mix = |x: f32, y: f32| x * (1.0 - t) + y * t;
    Leaf {
        chain: a.chain,
        location: mix(a.location, b.location).clamp(0.0, 1.0),
        orientation: a.orientation.slerp(b.orientation, t),
        size: mix(a.size, b.size),
        slot,
        offset: a.offset * (1.0 - t) + b.offset * t,
        form: a.form.between(b.form, [a.size, b.size], t),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::LeafForm;

    fn leaf(size: f32, form: LeafForm) -> Leaf {
        Leaf { form, ..Leaf::new(ChainId(0), 0.5, Rotation::about(glam::Vec3::X, 0.2), size, 0) }
    }

    #[test]
    fn length_and_width_of_a_leaf_both_go_straight_from_one_to_the_other() {
        let (slim, broad) = (leaf(0.2, LeafForm::Flat(0.25)), leaf(0.1, LeafForm::Flat(2.0)));
        for t in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let found = between(&slim, &broad, t, 0);
            assert!((found.size - (0.2 - 0.1 * t)).abs() < 1e-6);
            let width = found.size * found.form.width();
            assert!((width - (0.05 + 0.15 * t)).abs() < 1e-6, "{t}: {width}");
        }
        // Of no length, or both square, nothing odd comes of it.
        let none = between(&leaf(0.0, LeafForm::Flat(0.5)), &leaf(0.0, LeafForm::Flat(1.5)), 0.5, 0);
        assert_eq!(none.form, LeafForm::Flat(1.0));
        let square = between(&leaf(0.2, LeafForm::Square), &leaf(0.1, LeafForm::Square), 0.3, 0);
        assert_eq!(square.form, LeafForm::Square);
    }

    #[test]
    fn leaves_of_a_slot_with_several_partners_go_with_all_of_them() {
        let plant = |slots: &[u16]| {
            let mut builder = crate::plant::PlantBuilder::new();
            let stem = builder.stem(glam::Vec3::ZERO, &[glam::Vec3::ZERO, glam::Vec3::Y], &[0.1, 0.1]);
            for (i, &slot) in slots.iter().enumerate() {
                let location = (i as f32 + 0.5) / slots.len() as f32;
                builder.leaf(Leaf { chain: stem, location, slot, ..leaf(0.1, LeafForm::Square) });
            }
            builder.finish().unwrap()
        };
        let (a, b) = (plant(&[0; 12]), plant(&[1, 2, 3, 1, 2, 3, 1, 2, 1]));
        for (from, to) in [(a.clone(), b.clone()), (b, a)] {
            let kin = crate::relate::Kin { parent: None, members: vec![Some(ChainId(0)); 2] };
            let (family, slots) = Family::new(vec![from, to], &[kin]).unwrap().pair_leaves(9);
            let pairs = &family.leaf_pairs.as_ref().unwrap().pairs;
            assert!(pairs.iter().all(|pair| !pair.leaves.contains(&NONE)), "{pairs:?}");
            assert_eq!((pairs.len(), slots.pairs.len()), (12, 3));
            for pair in pairs {
                let worn = [0, 1].map(|s| family.plants[s].leaves()[pair.leaves[s] as usize].slot);
                assert_eq!(slots.pairs[usize::from(pair.slot - 9)], (worn[0], worn[1]));
            }
        }
    }

    #[test]
    fn leaves_are_alike_by_their_widths_whatever_the_ratio_to_their_lengths() {
        let (slim, broad) = (leaf(0.2, LeafForm::Flat(0.5)), leaf(0.1, LeafForm::Flat(1.0)));
        assert!((unlike(&slim, &broad) - 0.5 * WEIGHTS[1]).abs() < 1e-3);
        assert!((unlike(&slim, &leaf(0.1, LeafForm::Flat(0.5))) - 0.5 * (WEIGHTS[1] + WEIGHTS[2])).abs() < 1e-3);
    }

    #[test]
    fn leaves_come_out_one_after_the_other_each_soon_as_large_as_it_was() {
        let lots = || (0..1000).map(|i| (i as f32 + 0.5) / 1000.0);
        for degree in [0.1_f32, 0.3, 0.7, 0.95] {
            let sizes: Vec<f32> = lots().map(|lot| emerged(degree, lot)).filter(|size| *size > 0.0).collect();
            let area: f32 = sizes.iter().map(|size| size * size).sum::<f32>() / 1000.0;
            let whole = grown(degree) * grown(degree);
            // Shoots that are hardly there have fewer.
            let least = if degree < 0.2 { 0.5 } else { 0.95 };
            assert!((least..1.2).contains(&(area / whole)), "{degree}: {area} of {whole}");
            let small = sizes.iter().filter(|size| **size < 0.5).count();
            assert!(small * 2 < sizes.len(), "{degree}: {small} of {}", sizes.len());
            // Whichever source they are of.
            for third in [0.0, 0.34, 0.67] {
                let of = |lot: &f32| (third..third + 0.33).contains(lot) && emerged(degree, *lot) > 0.0;
                let share = lots().filter(of).count() as f32 / 330.0;
                assert!((share - sizes.len() as f32 / 1000.0).abs() < 0.03, "{degree} {third}: {share}");
            }
        }
        for lot in lots().chain([0.0, 1.0]) {
            assert!(emerged(0.0, lot) == 0.0 && emerged(1.0, lot) == 1.0);
            assert!((1..=100).all(|i| emerged(i as f32 * 0.01, lot) >= emerged(i as f32 * 0.01 - 0.01, lot)));
        }
    }

    #[test]
    fn leaves_of_a_shoot_cover_what_it_has_grown_and_are_no_longer_than_it_while_it_is_short() {
        for degree in [0.45_f32, 0.7, 1.0] {
            assert!((grown(degree) * grown(degree) - degree).abs() < 1e-5);
        }
        for degree in [0.0, 0.02, 0.1, 0.3] {
            assert!(grown(degree) <= degree * 1.61, "{degree}: {}", grown(degree));
        }
    }
}
