//! `Family::blend`: the one kernel that makes a tree (2017 TVCG, 4.3; N-way, 4.6).
//!
//! Each kin's chain is the weighted sum of its members' shapes, laid on one branching vector, times the degree of
//! growth, turned by the interpolated branching vector and linked to the parent at the interpolated location. Branching
//! vectors are turned by successive slerps, each weighted by its share of what came before: for two members it is the
//! paper's quaternion interpolation, and a share that goes to zero drops out without a jump.
//!
//! Where members bend different ways their mean is shorter than they are (by 1 to 3 % as a rule, by a third at worst), so
//! it is stretched until its tip is as far from its base as theirs are on average, at most 1.5 times.
//!
//! A kin that is fed by one member only takes that chain vertex by vertex, unturned. So a corner is the source itself,
//! bit by bit.
//!
//! # Radii
//!
//! The paper interpolates radii linearly and then replaces them by the allometric rule (Eq. 3), which at a corner would
//! overwrite the source's own. Here the rule is a correction: linear radii are scaled by `(A / E)^0.4`, with A what the
//! blended chain carries (its tip, and the children that are there) and E what its sources carry in its shares, both
//! summed at the blended locations. A equals E at the corners; a bough whose children have not grown is thinner, and a
//! slim trunk whose limbs are still the other source's is stouter. Three guards: no chain's base gets thicker than its thickest
//! member's (limbs of the other source would make a trunk three times as thick as both); a chain tapers wherever its linear radii do (a
//! child that is missing would otherwise leave a waist); and a child's base is at most as thick against its parent as in
//! its sources, or as thick as the parent.
//!
//! Rejected: blending the ratio of actual to ruled radius. Where one source is a scan whose twigs are all of one radius
//! (ratio 5 at the trunk) and the other obeys the rule with many tips, the middle comes out 3 times as thick as both.
//! Rejected: A and E from the tips up, not from the children's radii: a scan's trunk (12 cm, twigs of 2 cm) then stays
//! slim under the full crown of an oak (44 cm, twigs of 4 mm), since many thin twigs weigh less than few thick ones.

use glam::Vec3;

use super::family::{Family, NONE};
use super::{KinId, Weights};
use crate::base::Rotation;
use crate::plant::{ChainId, Leaf, Plant, PlantBuilder, carried, carrier, counts, measure_parameters, value_at};

/// How far a chain may be stretched to reach as far as its members do on average.
const MOST_STRETCH: f32 = 1.5;

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
    /// leaf of a source is there at its size × the source's share of the kin × the kin's degree of growth, as far from the axis × that degree. A plant has a
    /// chain: when every kin is absent, the first kin stands there alone, as its first member has it.
    #[must_use]
    pub fn blend(&self, weights: &Weights) -> Plant {
        self.blend_with_kins(weights).0
    }

    /// [`blend`](Self::blend), and the kin of each chain.
    #[must_use]
    pub fn blend_with_kins(&self, weights: &Weights) -> (Plant, Vec<KinId>) {
        let mut blend = Blend::new(self, weights);
        let sole = blend.sole_source();
        blend.place(sole);
        blend.apply_rule();
        blend.fit_to_parents();
        blend.leaves();
        (blend.builder.finish_trusted(), blend.kins.into_iter().map(KinId).collect())
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
            // NaN has not grown.
            let grown = degree > 0.0;
            if !grown || (parent != NONE && feeds[parent as usize] == Feed::Nothing) {
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
                Feed::One(s) => family.plants[s as usize].span(ChainId(family.row(k)[s as usize].chain)).len(),
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
                let mean =
                    |i: usize| fed().fold(Vec3::ZERO, |p, (m, share)| p + family.shapes[start + m * len + i] * share);
                let reach =
                    fed().fold(0.0, |r, (m, share)| r + family.shapes[start + m * len + len - 1].length() * share);
                let stretch = reach / mean(len - 1).length();
                // NaN where all tips come back to their bases.
                let stretch = if stretch > 1.0 { stretch.min(MOST_STRETCH) } else { 1.0 };
                let points = (0..len).map(|i| {
                    let p = mean(i) * stretch;
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
        let sources = family.plants.len();
        // What each chain's base asks of its parent, as radius^2.5.
        let mut loads = vec![0.0_f64; self.kins.len()];
        // Location, what the child carries, what the sources' child carries.
        let mut events: Vec<(f32, f64, f64)> = Vec::new();
        for id in (0..self.kins.len()).rev() {
            let k = self.kins[id] as usize;
            let degree = self.degrees[k];
            events.clear();
            for &child in &family.children[family.child_range(k)] {
                let (mut expected, mut location, mut sum) = (0.0_f32, 0.0_f32, 0.0_f32);
                for (s, (member, share)) in family.row(child as usize).iter().zip(self.share(k)).enumerate() {
                    if member.chain != NONE && *share > 0.0 && self.is_expected(child, s) {
                        expected += member.base * share;
                        location += member.location * share;
                        sum += share;
                    }
                }
                let expected = carried(f64::from(expected * degree));
                let chain = self.chains[child as usize];
                if chain != NONE {
                    let location = self.builder.so_far().chain(ChainId(chain)).location;
                    events.push((location, loads[chain as usize], expected));
                } else if sum > 0.0 {
                    events.push((location / sum, 0.0, expected));
                }
            }
            // From the tip down; ties by value, so that no order of siblings shows in the sum.
            events.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)).then(b.2.total_cmp(&a.2)));
            let span = self.builder.so_far().span(ChainId(id as u32));
            let radii = &mut self.builder.radii_mut()[span.clone()];
            let parameters = &self.parameters[span];
            let tip = f64::from(radii[radii.len() - 1]);
            let (mut load, mut expected) = (carried(tip), carried(tip));
            let (thickest, mean) = family
                .row(k)
                .iter()
                .zip(&self.shares[k * sources..])
                .fold((0.0_f32, 0.0_f32), |(thickest, mean), (member, share)| {
                    (thickest.max(member.base), mean + member.base * share)
                });
            let most = if mean > 0.0 { (thickest / mean).max(1.0) } else { 1.0 };
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
                        (carrier(load / expected) as f32).min(most)
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
            loads[id] = carried(f64::from(radii[0]));
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
            let offset = leaf.offset * self.degrees[k];
            self.builder.leaf(Leaf { chain: ChainId(self.chains[k]), size, offset, ..leaf });
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
