//! `Family::blend`: the one kernel that makes a tree (2017 TVCG, 4.3; N-way, 4.6).
//!
//! Each kin's chain is the weighted sum of its members' shapes, laid on one branching vector, times the degree of
//! growth, turned by the interpolated branching vector and linked to the parent at the interpolated location. Branching
//! vectors are turned by successive slerps, each weighted by its share of what came before: for two members it is the
//! paper's quaternion interpolation, and a share that goes to zero drops out without a jump.
//!
//! A kin that is fed by one member only takes that chain vertex by vertex, unturned. So a corner is the source itself,
//! bit by bit.
//!
//! # Radii
//!
//! The paper interpolates radii linearly and then replaces them by the allometric rule (Eq. 3), which at a corner would
//! overwrite the source's own. Here the rule is a correction: linear radii are scaled by `(A / E)^0.4`, with A what the
//! rule says the blended chain must carry (its tip, and the children that are there) and E what its sources carry in
//! its shares, both summed at the blended locations. A equals E at the corners; a bough whose children have not grown is
//! thinner. Three guards: the scale stays below [`MOST_THICKENING`]; a chain tapers wherever its linear radii do (a
//! child that is missing would otherwise leave a waist); and a child's base is at most as thick against its parent as in
//! its sources, or as thick as the parent.
//!
//! Rejected: blending the ratio of actual to ruled radius. Where one source is a scan whose twigs are all of one radius
//! (ratio 5 at the trunk) and the other obeys the rule with many tips, the middle comes out 3 times as thick as both.

use glam::Vec3;

use super::family::{Family, NONE};
use super::{KinId, Weights};
use crate::base::Rotation;
use crate::plant::{ChainId, Leaf, Plant, PlantBuilder, carried, carrier, counts, measure_parameters, value_at};

/// How far the allometric rule may thicken a chain over its sources' radii.
const MOST_THICKENING: f64 = 8.0;

/// What feeds a kin.
#[derive(Clone, Copy, PartialEq)]
enum Feed {
    /// It is absent.
    Nothing,
    /// One member: the source's index.
    One(u32),
    /// Several members.
    Several,
}

/// A blend on its way: weights made sensible, and what was built so far.
struct Blend<'a> {
    family: &'a Family,
    /// Normalized over members, kin after kin.
    shares: Vec<f32>,
    degrees: Vec<f32>,
    feeds: Vec<Feed>,
    /// Each kin's chain in the plant that is built.
    chains: Vec<u32>,
    /// The kin of each chain.
    kins: Vec<u32>,
    builder: PlantBuilder,
    /// Arc-length parameters of all points built.
    parameters: Vec<f64>,
}

impl Family {
    /// Makes the tree that `weights` describes. Linear in the points of the kins and leaves that are present; `n log n`
    /// in the children of one kin.
    ///
    /// Chains come in the order of the kins; where a single source feeds all of them, in the order of that source. A
    /// leaf of a source is there at its size × the source's share of the kin × the kin's degree of growth. A plant has a
    /// chain: when every kin is absent, the first kin stands there alone, as its first member has it.
    #[must_use]
    pub fn blend(&self, weights: &Weights) -> Plant {
        let mut blend = Blend::new(self, weights);
        let sole = blend.sole_source();
        blend.place(sole);
        blend.apply_rule();
        blend.fit_to_parents();
        blend.leaves();
        blend.builder.finish_trusted()
    }
}

impl<'a> Blend<'a> {
    fn new(family: &'a Family, weights: &Weights) -> Self {
        let (kins, sources) = (family.kin_count(), family.plants.len());
        let mut shares = vec![0.0_f32; kins * sources];
        let mut degrees = vec![0.0_f32; kins];
        let mut feeds = vec![Feed::Nothing; kins];
        for k in 0..kins {
            let parent = family.parents[k];
            let degree = weights.degree(KinId(k as u32));
            // Written so that NaN is absent.
            if !(degree > 0.0) || (parent != NONE && feeds[parent as usize] == Feed::Nothing) {
                continue;
            }
            let row = &mut shares[k * sources..(k + 1) * sources];
            let mut sum = 0.0_f64;
            for ((share, &given), member) in row.iter_mut().zip(weights.shares(KinId(k as u32))).zip(family.row(k)) {
                if member.chain != NONE && given > 0.0 && given.is_finite() {
                    *share = given;
                    sum += f64::from(given);
                }
            }
            if sum <= 0.0 {
                continue;
            }
            let mut feed = Feed::Nothing;
            for (s, share) in row.iter_mut().enumerate() {
                *share = (f64::from(*share) / sum) as f32;
                if *share > 0.0 {
                    feed = if feed == Feed::Nothing { Feed::One(s as u32) } else { Feed::Several };
                }
            }
            feeds[k] = feed;
            degrees[k] = degree.min(1.0);
        }
        if feeds.iter().all(|f| *f == Feed::Nothing) {
            let source = family.row(0).iter().position(|m| m.chain != NONE).unwrap_or(0);
            shares[source] = 1.0;
            degrees[0] = 1.0;
            feeds[0] = Feed::One(source as u32);
        }
        Self {
            family,
            shares,
            degrees,
            feeds,
            chains: vec![NONE; kins],
            kins: Vec::with_capacity(kins),
            builder: PlantBuilder::new(),
            parameters: Vec::new(),
        }
    }

    fn share(&self, kin: usize) -> &[f32] {
        let sources = self.family.plants.len();
        &self.shares[kin * sources..(kin + 1) * sources]
    }

    /// The source that feeds all kins that are present, each of its chains at most once.
    fn sole_source(&self) -> Option<usize> {
        let mut sole = None;
        for (k, feed) in self.feeds.iter().enumerate() {
            match *feed {
                Feed::Nothing => {}
                Feed::Several => return None,
                Feed::One(s) => {
                    let chain = self.family.row(k)[s as usize].chain;
                    let stands = self.family.primary[s as usize][chain as usize] == k as u32;
                    if !stands || sole.is_some_and(|other| other != s) {
                        return None;
                    }
                    sole = Some(s);
                }
            }
        }
        sole.map(|s| s as usize)
    }

    /// Shapes, linear radii, locations.
    fn place(&mut self, sole: Option<usize>) {
        let family = self.family;
        let (mut chains, mut points) = (0, 0);
        for (k, feed) in self.feeds.iter().enumerate() {
            let len = match *feed {
                Feed::Nothing => continue,
                Feed::One(s) => {
                    family.plants[s as usize].span(ChainId(family.row(k)[s as usize].chain)).len()
                }
                Feed::Several => family.blocks[k].1 as usize,
            };
            chains += 1;
            points += len;
        }
        let leaves = family.leaf_sites.len();
        self.builder = PlantBuilder::with_capacity(chains, points, leaves);
        self.parameters.reserve(points);
        match sole {
            Some(source) => family.primary[source].iter().for_each(|&k| self.place_kin(k as usize)),
            None => (0..family.kin_count()).for_each(|k| self.place_kin(k)),
        }
    }

    fn place_kin(&mut self, k: usize) {
        let family = self.family;
        let feed = self.feeds[k];
        if feed == Feed::Nothing {
            return;
        }
        let row = family.row(k);
        let sources = family.plants.len();
        let shares = &self.shares[k * sources..(k + 1) * sources];
        let degree = self.degrees[k];
        let parent = family.parents[k];
        let weighted = || row.iter().zip(shares).enumerate().filter(|(_, (_, share))| **share > 0.0);
        let origin_of = |s: usize| family.plants[s].chain(ChainId(row[s].chain)).origin;
        let (location, origin) = match feed {
            // Not through the sum, which would take the sign off a zero.
            Feed::One(s) => (row[s as usize].location, origin_of(s as usize)),
            _ => {
                let location = weighted().fold(0.0_f32, |l, (_, (m, share))| l + m.location * share);
                let origin = weighted().fold(Vec3::ZERO, |o, (s, (_, share))| o + origin_of(s) * *share);
                (location.clamp(0.0, 1.0), origin)
            }
        };
        let parent = (parent != NONE).then(|| ChainId(self.chains[parent as usize]));
        let id = self.builder.open(parent, location, origin);
        self.chains[k] = id.0;
        self.kins.push(k as u32);
        match feed {
            Feed::One(s) => {
                let plant = &family.plants[s as usize];
                let chain = ChainId(row[s as usize].chain);
                self.parameters.extend_from_slice(&family.parameters[s as usize][plant.span(chain)]);
                let points = plant.points(chain).iter().map(|p| *p * degree);
                self.builder.extend(points, plant.radii(chain).iter().map(|r| r * degree));
            }
            _ => {
                let (start, len) = (family.blocks[k].0 as usize, family.blocks[k].1 as usize);
                let turn = turn_of(weighted().map(|(_, (m, share))| (m.turn, *share)));
                let (x, y, z) =
                    (turn.rotate(Vec3::X) * degree, turn.rotate(Vec3::Y) * degree, turn.rotate(Vec3::Z) * degree);
                // Each weighted member's share and place in the block.
                let fed = || {
                    let members = row.iter().zip(shares).filter(|(m, _)| m.chain != NONE).map(|(_, share)| *share);
                    members.enumerate().filter(|(_, share)| *share > 0.0)
                };
                let points = (0..len).map(|i| {
                    let p = fed().fold(Vec3::ZERO, |p, (m, share)| p + family.shapes[start + m * len + i] * share);
                    x * p.x + y * p.y + z * p.z
                });
                let radii = (0..len).map(|i| {
                    fed().fold(0.0, |r, (m, share)| r + family.shape_radii[start + m * len + i] * share) * degree
                });
                self.builder.extend(points, radii);
                measure_parameters(self.builder.so_far().points(id), &mut self.parameters);
            }
        }
    }

    /// Scales the linear radii by the allometric rule, from the tips down.
    fn apply_rule(&mut self) {
        let family = self.family;
        // What the rule says that each chain carries at its base, as radius^2.5.
        let mut loads = vec![0.0_f64; self.kins.len()];
        // Location, what the child carries, what the sources' child carries.
        let mut events: Vec<(f32, f64, f64)> = Vec::new();
        for id in (0..self.kins.len()).rev() {
            let k = self.kins[id] as usize;
            let degree = f64::from(self.degrees[k]);
            events.clear();
            for &child in &family.children[family.child_range(k)] {
                let (mut expected, mut location, mut sum) = (0.0_f64, 0.0_f32, 0.0_f32);
                for (s, (member, share)) in family.row(child as usize).iter().zip(self.share(k)).enumerate() {
                    if member.chain != NONE && *share > 0.0 && self.is_expected(child, s) {
                        expected += member.rule * f64::from(*share);
                        location += member.location * share;
                        sum += share;
                    }
                }
                let expected = carried(expected * degree);
                let chain = self.chains[child as usize];
                if chain != NONE {
                    let location = self.builder.so_far().chain(ChainId(chain)).location;
                    events.push((location, loads[chain as usize], expected));
                } else if sum > 0.0 {
                    events.push((location / sum, 0.0, expected));
                }
            }
            // From the tip down; ties by value, so that no order of siblings shows in the sum.
            events.sort_unstable_by(|a, b| {
                b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)).then(b.2.total_cmp(&a.2))
            });
            let span = self.builder.so_far().span(ChainId(id as u32));
            let radii = &mut self.builder.radii_mut()[span.clone()];
            let parameters = &self.parameters[span];
            let tip = f64::from(radii[radii.len() - 1]);
            let (mut load, mut expected) = (carried(tip), carried(tip));
            let (mut scale, mut next) = (1.0_f32, 0);
            let (mut linear_above, mut above) = (radii[radii.len() - 1], radii[radii.len() - 1]);
            for (radius, &parameter) in radii.iter_mut().zip(parameters).rev() {
                let before = next;
                while next < events.len() && counts(events[next].0, parameter) {
                    load += events[next].1;
                    expected += events[next].2;
                    next += 1;
                }
                if next > before {
                    scale = if load == expected || expected <= 0.0 {
                        1.0
                    } else {
                        carrier(load / expected).min(MOST_THICKENING) as f32
                    };
                }
                let linear = *radius;
                // A corner is left alone to the last bit; elsewhere the chain tapers as its linear radii do.
                if scale != 1.0 || above != linear_above {
                    let taper = if linear < linear_above { above * (linear / linear_above) } else { above };
                    *radius = (linear * scale).max(taper);
                }
                (linear_above, above) = (linear, *radius);
            }
            // At the base all children count, also those that rounding keeps above the first vertex.
            load += events[next..].iter().map(|e| e.1).sum::<f64>();
            loads[id] = load;
        }
    }

    /// Whether a kin counts for what its parent's source carries. Of kins that share the source's chain each that is
    /// present does, as it carries, too; when none is, the first. Walks round those that share the chain.
    fn is_expected(&self, kin: u32, source: usize) -> bool {
        let mut twin = self.family.row(kin as usize)[source].twin;
        if twin == NONE || self.chains[kin as usize] != NONE {
            return true;
        }
        while twin != kin {
            if twin < kin || self.chains[twin as usize] != NONE {
                return false;
            }
            twin = self.family.row(twin as usize)[source].twin;
        }
        true
    }

    /// Keeps the bases of children within their parents, from the stems up.
    fn fit_to_parents(&mut self) {
        for id in 0..self.kins.len() {
            let plant = self.builder.so_far();
            let chain = *plant.chain(ChainId(id as u32));
            let Some(parent) = chain.parent else { continue };
            let k = self.kins[id] as usize;
            let parent_span = plant.span(parent);
            let there = value_at(&self.parameters[parent_span], plant.radii(parent), chain.location);
            let members = self.family.row(k).iter().zip(self.share(k)).filter(|(_, share)| **share > 0.0);
            let most = there * members.fold(0.0_f32, |sum, (m, share)| sum + m.stoutness * share);
            let span = plant.span(ChainId(id as u32));
            let base = plant.radii(ChainId(id as u32))[0];
            // A hair of room for rounding, or corners would be touched. NaN, of an infinite limit on a parent without
            // thickness, limits nothing.
            if base > most * (1.0 + 1e-5) {
                let scale = most / base;
                self.builder.radii_mut()[span].iter_mut().for_each(|r| *r *= scale);
            }
        }
    }

    fn leaves(&mut self) {
        let family = self.family;
        let sources = family.plants.len();
        for site in &family.leaf_sites {
            let k = site.kin as usize;
            let share = self.shares[k * sources + site.source as usize];
            if self.chains[k] == NONE || share <= 0.0 {
                continue;
            }
            let leaf = family.plants[site.source as usize].leaves()[site.leaf as usize];
            let size = leaf.size * (share * self.degrees[k]);
            self.builder.leaf(Leaf { chain: ChainId(self.chains[k]), size, ..leaf });
        }
    }
}

/// Rotations averaged by their shares, which need not add up to 1.
fn turn_of(mut turns: impl Iterator<Item = (Rotation, f32)>) -> Rotation {
    let Some((mut mean, mut sum)) = turns.next() else { return Rotation::IDENTITY };
    for (turn, share) in turns {
        sum += share;
        mean = mean.slerp(turn, share / sum);
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::plant::Curve;
    use crate::preset::plan::MatchParams;
    use crate::relate::random_plant::{Oddity, random_plant};
    use crate::relate::{Kin, fuzzy_family};

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    fn pair(seed: u64, most: usize, oddity: Oddity) -> Family {
        let plant = |name| random_plant(Seed::new(seed).child(name), most, oddity);
        fuzzy_family(plant("a"), plant("b"), &EVEN).unwrap()
    }

    /// The same share of the second source everywhere.
    fn even(family: &Family, t: f32) -> Weights {
        let mut weights = Weights::new(family.kin_count(), 2);
        for kin in family.kin_ids() {
            let degree = match (family.member(kin, 0), family.member(kin, 1)) {
                (Some(_), None) => 1.0 - t,
                (None, _) => t,
                _ => 1.0,
            };
            weights.set(kin, &[1.0 - t, t], degree);
        }
        weights
    }

    #[test]
    fn a_corner_is_its_source_to_the_last_bit() {
        for seed in 0..150 {
            let oddity = if seed % 3 == 0 { Oddity::Tame } else { Oddity::Wild };
            let family = pair(seed, 60, oddity);
            for (s, source) in family.sources().iter().enumerate() {
                assert!(family.blend(&family.corner(s)) == *source, "seed {seed}, source {s}");
            }
        }
    }

    #[test]
    fn a_member_bears_the_same_chain_whether_taken_whole_or_through_the_resampled_sum() {
        // Just off the corner the resampled, turned sum is used: the tree must not jump.
        for seed in 0..60 {
            let family = pair(seed, 40, Oddity::Tame);
            for s in 0..2 {
                let source = &family.sources()[s];
                let posed = source.pose();
                let blended = family.blend(&even(&family, if s == 0 { 1e-6 } else { 1.0 - 1e-6 }));
                let off = blended.pose();
                let present: Vec<KinId> = family.kin_ids().collect();
                for (chain, kin) in present.iter().enumerate() {
                    let Some(own) = family.member(*kin, s) else { continue };
                    let id = ChainId(chain as u32);
                    for i in 0..=8 {
                        let t = f64::from(i) / 8.0;
                        let (a, b) = (posed.curve(source, own).point(t), off.curve(&blended, id).point(t));
                        assert!(a.distance(b) < source.height() * 2e-4, "seed {seed} kin {kin:?}: {a} {b}");
                        let radius = |plant: &Plant, id| Curve::new(plant.points(id)).value(plant.radii(id), t);
                        let (a, b) = (radius(source, own), radius(&blended, id));
                        assert!((a - b).abs() < source.height() * 2e-3, "seed {seed} kin {kin:?}: {a} {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn every_blend_is_a_plant_whatever_the_weights() {
        for seed in 0..150 {
            let family = pair(seed, 40, Oddity::Wild);
            let draw = Seed::new(seed).child("weights");
            let mut weights = Weights::new(family.kin_count(), 2);
            for kin in family.kin_ids() {
                let d = draw.at(u64::from(kin.0));
                let odd = [0.0, 1.0, f32::NAN, f32::INFINITY, -1.0, 1e-30, 3e38, 2.0];
                let any = |d: Seed| if d.at(0).unit() < 0.3 { odd[d.at(1).index(8)] } else { d.at(2).unit() };
                weights.set(kin, &[any(d.child("a")), any(d.child("b"))], any(d.child("d")));
            }
            // `finish_trusted` validates in this profile.
            let plant = family.blend(&weights);
            assert!(!plant.chains().is_empty());
        }
        let family = pair(1, 10, Oddity::Tame);
        assert_eq!(family.blend(&Weights::new(0, 0)).chains().len(), 1);
    }

    #[test]
    fn shapes_radii_origins_and_locations_meet_half_way() {
        let tree = |x: f32, height: f32, reach: Vec3, location: f32, radius: f32| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::X * x, &[Vec3::ZERO, Vec3::Y * height], &[radius, radius * 0.5]);
            builder.branch(stem, location, &[Vec3::ZERO, reach], &[radius * 0.2, radius * 0.2]);
            builder.finish().unwrap()
        };
        let (a, b) = (tree(0.0, 2.0, Vec3::X, 0.2, 0.1), tree(1.0, 4.0, Vec3::Z * 3.0, 0.6, 0.2));
        let family = fuzzy_family(a, b, &EVEN).unwrap();
        let plant = family.blend(&even(&family, 0.5));
        let (stem, branch) = (plant.chain(ChainId(0)), plant.chain(ChainId(1)));
        assert_eq!(stem.origin, Vec3::X * 0.5);
        assert_eq!(plant.points(ChainId(0))[1], Vec3::Y * 3.0);
        assert!((branch.location - 0.4).abs() < 1e-6);
        // Slerp of the branching vectors: between the two at their mean length, where a linear blend would be shorter.
        let tip = plant.points(ChainId(1))[1];
        assert!((tip - Vec3::new(2.0, 0.0, 2.0) * 0.5_f32.sqrt()).length() < 1e-5, "{tip}");
        assert!((plant.radii(ChainId(0))[1] - 0.075).abs() < 1e-6);
    }

    #[test]
    fn growth_scales_a_chain_and_its_leaves_and_thins_its_parent() {
        let bare = |builder: &mut PlantBuilder| {
            builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0], &[0.2, 0.15, 0.1])
        };
        let mut builder = PlantBuilder::new();
        bare(&mut builder);
        let a = builder.finish().unwrap();
        let mut builder = PlantBuilder::new();
        let stem = bare(&mut builder);
        let twig = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.1, 0.05]);
        builder.leaf(Leaf { chain: twig, location: 1.0, orientation: Rotation::IDENTITY, size: 0.3, slot: 2 });
        let b = builder.finish().unwrap();
        let family = fuzzy_family(a, b, &EVEN).unwrap();
        let mut weights = family.corner(1);
        weights.set(KinId(1), &[0.0, 1.0], 0.5);
        let plant = family.blend(&weights);
        assert_eq!(plant.points(ChainId(1))[1], Vec3::X * 0.5);
        assert_eq!(plant.radii(ChainId(1)), [0.05, 0.025]);
        assert_eq!(plant.leaves()[0].size, 0.15);
        let radii = plant.radii(ChainId(0));
        assert!(radii[0] < 0.2 && radii[0] > radii[1] && radii[2] == 0.1, "{radii:?}");
        weights.set(KinId(1), &[0.0, 1.0], 0.0);
        let plant = family.blend(&weights);
        assert!(plant.chains().len() == 1 && plant.leaves().is_empty());
    }

    #[test]
    fn children_stay_within_their_parents_and_chains_taper() {
        for seed in 0..80 {
            let family = pair(seed, 40, Oddity::Tame);
            let plant = family.blend(&even(&family, Seed::new(seed).child("t").unit()));
            for id in plant.chain_ids() {
                let radii = plant.radii(id);
                assert!(radii.windows(2).all(|w| w[1] <= w[0] * 1.0001), "seed {seed} {id:?}: {radii:?}");
                let chain = plant.chain(id);
                let Some(parent) = chain.parent else { continue };
                let there = Curve::new(plant.points(parent)).value(plant.radii(parent), f64::from(chain.location));
                // The tame sources themselves may be stouter than their parent where it tapers.
                let kin = family.row(id.index());
                let most = kin.iter().filter(|m| m.chain != NONE).fold(1.0_f32, |s, m| s.max(m.stoutness));
                assert!(radii[0] <= there * most * 1.001, "seed {seed} {id:?}: {} {there} {most}", radii[0]);
            }
        }
    }

    #[test]
    fn three_sources_and_shared_members_have_their_corners() {
        for seed in 0..30 {
            let plants: Vec<Plant> =
                (0..3).map(|i| random_plant(Seed::new(seed).child("n").at(i), 12, Oddity::Wild)).collect();
            // Kins that hold one source each, then doubled for the second source (as a split would), then one that
            // joins the first stems of all.
            let stem = |_: usize| Some(ChainId(0));
            let mut kins = vec![Kin { parent: None, members: (0..3).map(stem).collect() }];
            for (s, plant) in plants.iter().enumerate() {
                let mut own: Vec<KinId> = vec![KinId(0)];
                for id in plant.chain_ids().skip(1) {
                    own.push(KinId(kins.len() as u32));
                    let parent = plant.chain(id).parent.map(|p| own[p.index()]);
                    let members: Vec<_> = (0..3).map(|m| (m == s).then_some(id)).collect();
                    if s == 1 {
                        kins.push(Kin { parent, members: members.clone() });
                    }
                    kins.push(Kin { parent, members });
                }
            }
            let family = Family::new(plants, &kins).unwrap();
            for (s, source) in family.sources().iter().enumerate() {
                assert!(family.blend(&family.corner(s)) == *source, "seed {seed}, source {s}");
            }
        }
    }
}
