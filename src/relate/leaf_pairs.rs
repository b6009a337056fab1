//! Leaves in correspondence (2017 CAVW, 5 and 6.2): within the lobes of matched chains, greedily by similarity, and the
//! leaf between two.
//!
//! The similarity is the weighted sum of how far apart the leaves are along the chain, in length, width and orientation;
//! lengths and widths are metres, each mixed by itself.
//! The most similar pair goes first; each leaf of the larger lobe that is left over goes with the leaf of the smaller
//! that it resembles most. So one leaf splits into several, or several merge into one, and in a matched lobe no leaf
//! is left alone as long as the other has leaves of the same picture. Leaves whose pictures don't go together, and those
//! of lobes without a partner, grow and wilt in size: by the square root of their share, so that their area follows it
//! (by the share itself a crown would be half bare half way), and with their shoot while that is short.
//!
//! Each picture of one source goes with one of the other (the most often worn with the most often worn), or else there would
//! be as many pictures between as pairs. A leaf between two wears slot `first + i` for pair `i` of
//! [`PairedSlots::pairs`]; where both sources wear the same slot it stays.
//!
//! Time: a lobe of a × b leaves takes a·b·log; a lobe of more than [`MOST_PAIRS`] pairs is first cut into stretches along
//! the chain.

use std::collections::{BTreeMap, BTreeSet};

use super::Family;
use super::family::NONE;
use super::kernel::{Blender, Feed};
use crate::base::math;
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

/// Leaves of two sources that are one on a kin, or one alone.
#[derive(Clone, Copy, Debug)]
struct LeafPair {
    kin: u32,
    /// By source: index of the leaf, or none.
    leaves: [u32; 2],
    /// By source: whether this is the one of several pairs that shows the leaf where its source is alone on the kin.
    shows: [bool; 2],
    /// The slot between.
    slot: u16,
}

/// All pairs of a family, kin after kin.
#[derive(Clone, Debug)]
pub(super) struct LeafPairs {
    pairs: Vec<LeafPair>,
}

/// Which slots leaves in correspondence wear.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PairedSlots {
    /// Slots of the first and of the second source; the i-th pair has slot `first + i` in between.
    pub pairs: Vec<(u16, u16)>,
    /// The first slot in between.
    pub first: u16,
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
        let mut between = |pair: (u16, u16)| {
            if pair.0 == pair.1 {
                return pair.0;
            }
            let known = slots.pairs.iter().position(|p| *p == pair).unwrap_or_else(|| {
                slots.pairs.push(pair);
                slots.pairs.len() - 1
            });
            slots.first.saturating_add(known as u16)
        };
        // A leaf that comes or goes takes part in the change of pictures, or a crown would be of two kinds.
        let mut alone = |s: usize, i: u32| {
            let mut leaves = [NONE; 2];
            leaves[s] = i;
            let own = leaf(s, i).slot;
            let pair = partner.iter().find(|pair| if s == 0 { pair.0 == own } else { pair.1 == own });
            let slot = pair.map_or(own, |pair| between(*pair));
            found.push(LeafPair { kin, leaves, shows: [true; 2], slot });
        };
        if a.is_empty() || b.is_empty() {
            a.iter().for_each(|&i| alone(0, i));
            b.iter().for_each(|&i| alone(1, i));
            return found;
        }
        // Only leaves whose pictures go together.
        let of = |s: usize, leaves: &[u32], pair: &(u16, u16)| -> Vec<u32> {
            let slot = if s == 0 { pair.0 } else { pair.1 };
            leaves.iter().copied().filter(|&i| leaf(s, i).slot == slot).collect()
        };
        let (mut paired_a, mut paired_b) = (BTreeSet::new(), BTreeSet::new());
        let mut matched: Vec<(u32, u32, (u16, u16))> = Vec::new();
        for pair in partner {
            let (own, other) = (of(0, a, pair), of(1, b, pair));
            if own.is_empty() || other.is_empty() {
                continue;
            }
            let own: Vec<u32> = own.into_iter().filter(|i| !paired_a.contains(i)).collect();
            let other: Vec<u32> = other.into_iter().filter(|i| !paired_b.contains(i)).collect();
            for (i, j) in self.greedy(own, other) {
                paired_a.insert(i);
                paired_b.insert(j);
                matched.push((i, j, *pair));
            }
        }
        a.iter().filter(|i| !paired_a.contains(i)).for_each(|&i| alone(0, i));
        b.iter().filter(|j| !paired_b.contains(j)).for_each(|&j| alone(1, j));
        let (mut shown_a, mut shown_b) = (BTreeSet::new(), BTreeSet::new());
        for (i, j, pair) in matched {
            let slot = between(pair);
            found.push(LeafPair { kin, leaves: [i, j], shows: [shown_a.insert(i), shown_b.insert(j)], slot });
        }
        found
    }

    /// Pairs of leaves, of which every one of both sides is in one at least.
    fn greedy(&self, mut a: Vec<u32>, mut b: Vec<u32>) -> Vec<(u32, u32)> {
        if a.is_empty() || b.is_empty() {
            return Vec::new();
        }
        let leaf = |s: usize, i: u32| &self.plants[s].leaves()[i as usize];
        let along = |s: usize, own: &mut [u32]| {
            own.sort_by(|&i, &j| leaf(s, i).location.total_cmp(&leaf(s, j).location).then(i.cmp(&j)));
        };
        along(0, &mut a);
        along(1, &mut b);
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
                .map(|(i, j)| (unlike(leaf(0, a[i]), leaf(1, b[j])), i as u32, j as u32))
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
}

/// How unlike two leaves are, 0..=1.
fn unlike(a: &Leaf, b: &Leaf) -> f32 {
    let ratio = |x: f32, y: f32| if x.max(y) > 0.0 { (x - y).abs() / x.max(y) } else { 0.0 };
    let dot = a.orientation.v.dot(b.orientation.v) + a.orientation.w * b.orientation.w;
    let turn = math::acos(dot.abs().min(1.0)) * std::f32::consts::FRAC_2_PI;
    (a.location - b.location).abs() * WEIGHTS[0]
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

impl Blender<'_> {
    /// Adds the leaves of the kins that are there.
    pub(super) fn pair_up(&self, pairs: &LeafPairs, builder: &mut PlantBuilder) {
        let family = self.family;
        for pair in &pairs.pairs {
            let k = pair.kin as usize;
            if self.chains[k] == NONE {
                continue;
            }
            let shares = self.share(k);
            let (chain, degree) = (ChainId(self.chains[k]), self.grown[k]);
            let leaf = |s: usize| &family.plants[s].leaves()[pair.leaves[s] as usize];
            let fed = self.feeds[k];
            match pair.leaves {
                [a, b] if a != NONE && b != NONE && fed == Feed::Several => {
                    let between = between(leaf(0), leaf(1), shares[1], pair.slot);
                    let (size, offset) = (between.size * grown(degree), between.offset * degree);
                    builder.leaf(Leaf { chain, size, offset, ..between });
                }
                _ => {
                    for (s, share) in shares.iter().enumerate().take(2) {
                        let shows = pair.shows[s] || fed == Feed::Several;
                        if pair.leaves[s] != NONE && *share > 0.0 && shows {
                            let own = *leaf(s);
                            let (size, offset) = (own.size * (share.sqrt() * grown(degree)), own.offset * degree);
                            builder.leaf(Leaf { chain, size, offset, slot: pair.slot, ..own });
                        }
                    }
                }
            }
        }
    }
}

/// How long leaves are on a chain that has grown so far, as a share: their area follows it, but on shoots that are hardly there
/// they are no longer than those, or all leaves of a limb would stand in a ball.
pub(crate) fn grown(degree: f32) -> f32 {
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
fn between(a: &Leaf, b: &Leaf, t: f32, slot: u16) -> Leaf {
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
    use crate::base::Rotation;
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
