//! `Family::blend`: the one kernel that makes a tree (2017 TVCG, 4.3; N-way, 4.6).
//!
//! Each kin's chain is the weighted sum of its members' shapes, laid on one branching vector, times the degree of
//! growth, turned by the interpolated branching vector and linked to the parent at the interpolated location
//! (`relate/place.rs`); then radii follow Eq. 3 (`relate/rule.rs`). A kin that is fed by one member only takes that
//! chain vertex by vertex, unturned. So a corner is the source itself, bit by bit.
//!
//! A [`Blender`] keeps what it made of each kin. From one state of a batch to the next only the kins of the task pack
//! change, as the paper has it ("only chains involved in the blending task pack are interpolated, whereas the others
//! remain unchanged"): only these are summed again, and radii are only followed from there to the root. The result
//! is that of a new blender, to the last bit.
//!
//! Memory: about 40 bytes for each point of the longest form of every kin.

use glam::Vec3;

use super::family::{Family, NONE};
use super::leaf_pairs::emerged;
use super::weights::Run;
use super::{KinId, Weights};
use crate::plant::{ChainId, Leaf, Plant, PlantBuilder};

/// What feeds a kin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Feed {
    /// It is absent.
    Nothing,
    /// One member: the source's index.
    One(u32),
    /// Several members.
    Several,
}

/// Makes trees of one family, one after the other; see the head of this file.
#[derive(Clone, Debug)]
pub struct Blender<'f> {
    pub(super) family: &'f Family,
    /// Normalized over members, kin after kin.
    pub(super) shares: Vec<f32>,
    pub(super) degrees: Vec<f32>,
    /// How shares run along each kin.
    pub(super) runs: Vec<Run>,
    /// Which kins keep their source's radii.
    pub(super) kept: Vec<bool>,
    pub(super) feeds: Vec<Feed>,
    /// Where each kin's points start in the arrays below, with room for its longest form.
    pub(super) first: Vec<u32>,
    /// How many it has now.
    pub(super) len: Vec<u32>,
    pub(super) points: Vec<Vec3>,
    /// Radii before and after the rule.
    pub(super) linear: Vec<f32>,
    pub(super) radii: Vec<f32>,
    /// Arc-length parameters.
    pub(super) parameters: Vec<f64>,
    /// How long each kin is, and its degree as far as its parent has room for it.
    pub(super) lengths: Vec<f32>,
    pub(super) grown: Vec<f32>,
    pub(super) location: Vec<f32>,
    pub(super) origin: Vec<Vec3>,
    /// What each kin's base asks of its parent, as radius^2.5.
    pub(super) load: Vec<f64>,
    /// What scales a kin's radii so that its base fits its parent.
    pub(super) fit: Vec<f32>,
    /// Kins whose feed, shares or degree are not those of the last blend.
    pub(super) moved: Vec<bool>,
    /// Kins whose radii may not be those of the last blend.
    pub(super) touched: Vec<bool>,
    /// Address of the times of growth units in the last blend.
    pub(super) unit_seed: u64,
    /// Share of its size that a leaf has at least.
    least_leaf: f32,
    /// Room for one sum: x, y, z of a chain.
    pub(super) sum: Vec<f32>,
    /// Room for the children of one kin: location, what the child carries, what the sources' child carries.
    pub(super) events: Vec<(f32, f64, f64)>,
    /// The kin of each chain of the last tree.
    kins: Vec<KinId>,
    /// Each kin's chain in it.
    pub(super) chains: Vec<u32>,
}

impl Family {
    /// Makes the tree that `weights` describes. Linear in the points of the kins and leaves that are present; `n log n`
    /// in the children of one kin. For many trees of one family take a [`Blender`].
    ///
    /// Chains come in the order of the kins; where a single source feeds all of them, in the order of that source. A
    /// kin bears of each source as many of its leaves as the source's share says, drawn by lot, the same ones as long as the
    /// share is the same: crowns cover what sources do, with as many leaves. Of a kin that has not grown they come one after the
    /// other, each soon as large as its source has it. (Leaves that are to move from one source to the other are put in pairs,
    /// [`pair_leaves`](Self::pair_leaves).) A plant has a chain: when every kin is absent, the first kin stands there alone, as
    /// its first member has it.
    #[must_use]
    pub fn blend(&self, weights: &Weights) -> Plant {
        Blender::new(self).blend(weights)
    }

    /// [`blend`](Self::blend), and the kin of each chain.
    #[must_use]
    pub fn blend_with_kins(&self, weights: &Weights) -> (Plant, Vec<KinId>) {
        let mut blender = Blender::new(self);
        let plant = blender.blend(weights);
        (plant, blender.kins)
    }
}

impl<'f> Blender<'f> {
    /// A blender that has made nothing yet.
    #[must_use]
    pub fn new(family: &'f Family) -> Self {
        let (kins, sources) = (family.kin_count(), family.plants.len());
        let mut first = Vec::with_capacity(kins + 1);
        let mut points = 0_u32;
        for k in 0..kins {
            first.push(points);
            let alone = |(s, chain): (usize, u32)| family.plants[s].span(ChainId(chain)).len() as u32;
            let chains = family.row(k).iter().map(|m| m.chain).enumerate().filter(|(_, chain)| *chain != NONE);
            points += chains.map(alone).max().unwrap_or(0).max(family.blocks[k].1);
        }
        first.push(points);
        let points = points as usize;
        Self {
            family,
            shares: vec![0.0; kins * sources],
            degrees: vec![0.0; kins],
            runs: vec![Run::Even; kins],
            kept: vec![false; kins],
            feeds: vec![Feed::Nothing; kins],
            first,
            len: vec![0; kins],
            points: vec![Vec3::ZERO; points],
            linear: vec![0.0; points],
            radii: vec![0.0; points],
            parameters: vec![0.0; points],
            lengths: vec![0.0; kins],
            grown: vec![0.0; kins],
            location: vec![0.0; kins],
            origin: vec![Vec3::ZERO; kins],
            load: vec![0.0; kins],
            fit: vec![1.0; kins],
            moved: vec![false; kins],
            touched: vec![false; kins],
            unit_seed: 0,
            least_leaf: 0.0,
            sum: Vec::new(),
            events: Vec::new(),
            kins: Vec::with_capacity(kins),
            chains: vec![NONE; kins],
        }
    }

    /// The tree that `weights` describes; see [`Family::blend`].
    #[must_use]
    pub fn blend(&mut self, weights: &Weights) -> Plant {
        let mut plant = Plant::default();
        self.blend_into(weights, &mut plant);
        plant
    }

    /// As [`blend`](Self::blend), into the memory of a plant that is no longer needed.
    pub fn blend_into(&mut self, weights: &Weights, plant: &mut Plant) {
        self.weigh(weights);
        let family = self.family;
        for k in 0..self.feeds.len() {
            if self.feeds[k] == Feed::Nothing {
                continue;
            }
            let parent = family.parents[k];
            if self.moved[k] || parent != NONE && self.moved[parent as usize] {
                let grown = self.degrees[k].min(self.room(k));
                self.moved[k] |= grown != self.grown[k];
                self.grown[k] = grown;
            }
            if self.moved[k] {
                self.place(k);
                self.lengths[k] = self.length(k);
            }
            // A branch sits at a boundary of its parent by units, wherever that is now, and on elastic curves likewise; elsewhere no
            // farther along it than it grew.
            if parent != NONE && (self.moved[k] || self.moved[parent as usize]) {
                self.location[k] = self.own_location(k);
                self.location[k] = match &family.elastic {
                    Some(elastic) => self.locate_elastic(k, elastic),
                    None => self.locate(k),
                };
                self.location[k] = self.no_farther(k);
            }
        }
        if family.elastic.is_some() {
            self.keep_radii();
        } else {
            self.apply_rule();
            self.fit_to_parents();
        }
        *plant = self.assemble(std::mem::take(plant)).scaled(self.size());
        if let (Some(forked), Some(source)) = (&family.forked, self.whole_source()) {
            plant.clone_from(&forked.sources[source]);
        }
    }

    /// The kin of each chain of the tree made last.
    #[must_use]
    pub fn kins(&self) -> &[KinId] {
        &self.kins
    }

    /// Where a kin's points are.
    pub(super) fn span(&self, kin: usize) -> std::ops::Range<usize> {
        let first = self.first[kin] as usize;
        first..first + self.len[kin] as usize
    }

    pub(super) fn share(&self, kin: usize) -> &[f32] {
        let sources = self.family.plants.len();
        &self.shares[kin * sources..(kin + 1) * sources]
    }

    /// Makes the weights sensible and finds out which kins they move.
    pub(super) fn weigh(&mut self, weights: &Weights) {
        let family = self.family;
        let (kins, sources) = (family.kin_count(), family.plants.len());
        let mut row = vec![0.0_f32; sources];
        let mut any = false;
        let other_times = family.units.is_some() && self.unit_seed != weights.units();
        self.unit_seed = weights.units();
        self.least_leaf = weights.least_leaf();
        for k in 0..kins {
            let feed = self.fed(k, weights, &mut row);
            any |= feed != Feed::Nothing;
            let degree = if feed == Feed::Nothing { 0.0 } else { weights.degree(KinId(k as u32)).min(1.0) };
            self.take(k, feed, &row, degree);
            self.moved[k] |= other_times && feed != Feed::Nothing;
            let run = weights.run(KinId(k as u32));
            let kept = weights.keeps(KinId(k as u32));
            self.moved[k] |= self.runs[k] != run || self.kept[k] != kept;
            (self.runs[k], self.kept[k]) = (run, kept);
        }
        self.move_sharers();
        if !any && kins > 0 {
            let source = family.row(0).iter().position(|m| m.chain != NONE).unwrap_or(0);
            row.fill(0.0);
            row[source] = 1.0;
            self.take(0, Feed::One(source as u32), &row, 1.0);
        }
    }

    /// What feeds a kin, its normalized shares into `row`; parents must have been weighed.
    fn fed(&self, k: usize, weights: &Weights, row: &mut [f32]) -> Feed {
        row.fill(0.0);
        let (kin, parent) = (KinId(k as u32), self.family.parents[k]);
        // NaN has not grown.
        let grown = weights.degree(kin) > 0.0;
        if !grown || (parent != NONE && self.feeds[parent as usize] == Feed::Nothing) {
            return Feed::Nothing;
        }
        let (mut sum, mut feed) = (0.0_f64, Feed::Nothing);
        let members = self.family.row(k).iter().zip(weights.shares(kin)).enumerate();
        for ((s, (member, &given)), share) in members.zip(row.iter_mut()) {
            if member.chain != NONE && given > 0.0 && given.is_finite() {
                *share = given;
                sum += f64::from(given);
                feed = if feed == Feed::Nothing { Feed::One(s as u32) } else { Feed::Several };
            }
        }
        match feed {
            Feed::Nothing => {}
            Feed::One(s) => row[s as usize] = 1.0,
            Feed::Several => {
                let mut left = Feed::Nothing;
                for (s, share) in row.iter_mut().enumerate() {
                    *share = (f64::from(*share) / sum) as f32;
                    // Against a huge share a tiny one is nothing.
                    if *share > 0.0 {
                        left = if left == Feed::Nothing { Feed::One(s as u32) } else { Feed::Several };
                    }
                }
                feed = left;
            }
        }
        feed
    }

    fn take(&mut self, k: usize, feed: Feed, row: &[f32], degree: f32) {
        let sources = row.len();
        let own = &mut self.shares[k * sources..(k + 1) * sources];
        let same = self.feeds[k] == feed && self.degrees[k] == degree && own == row;
        self.moved[k] = !same;
        if !same {
            own.copy_from_slice(row);
            self.feeds[k] = feed;
            self.degrees[k] = degree;
        }
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

    /// The source that is there alone, whole and full-grown.
    fn whole_source(&self) -> Option<usize> {
        let source = self.sole_source()?;
        let is_grown = |(feed, degree): (&Feed, &f32)| *feed == Feed::Nothing || *degree == 1.0;
        let is_whole =
            self.kins.len() == self.family.primary[source].len() && self.feeds.iter().zip(&self.degrees).all(is_grown);
        is_whole.then_some(source)
    }

    /// The plant of what was placed.
    fn assemble(&mut self, used: Plant) -> Plant {
        let family = self.family;
        self.kins.clear();
        self.chains.fill(NONE);
        let present = |k: &u32| self.feeds[*k as usize] != Feed::Nothing;
        let sole = self.sole_source();
        let order: Vec<u32> = match sole {
            Some(source) => family.primary[source].iter().copied().filter(present).collect(),
            None => (0..family.kin_count() as u32).filter(present).collect(),
        };
        let points = order.iter().map(|&k| self.len[k as usize] as usize).sum();
        let mut builder = PlantBuilder::reusing(used, order.len(), points, family.leaf_sites.len());
        for &kin in &order {
            let k = kin as usize;
            let parent = family.parents[k];
            let parent = (parent != NONE).then(|| ChainId(self.chains[parent as usize]));
            let span = self.span(k);
            let (points, radii) = (&self.points[span.clone()], &self.radii[span]);
            let id = builder.chain(parent, self.location[k], self.origin[k], points, radii);
            if self.fit[k] != 1.0 {
                let fit = self.fit[k];
                let end = builder.radii_mut().len();
                builder.radii_mut()[end - points.len()..].iter_mut().for_each(|r| *r *= fit);
            }
            self.chains[k] = id.0;
            self.kins.push(KinId(kin));
        }
        // A source alone has its leaves in its own order.
        if let (Some(pairs), None) = (&family.leaf_pairs, sole) {
            let travelling = self.pair_up(pairs, &mut builder);
            return self.travel(builder.finish_trusted(), &travelling);
        }
        for site in &family.leaf_sites {
            let k = site.kin as usize;
            if self.chains[k] == NONE || !self.wins(k, site.source as usize, site.lot) {
                continue;
            }
            let leaf = family.plants[site.source as usize].leaves()[site.leaf as usize];
            let out = emerged(self.grown[k], site.lot).max(self.least_leaf);
            if out <= 0.0 {
                continue;
            }
            let (size, offset) = (leaf.size * out, leaf.offset * self.grown[k]);
            let location = match &family.elastic {
                Some(elastic) => self.located_on(k, elastic, site.source as usize, leaf.location),
                None => leaf.location,
            };
            builder.leaf(Leaf { chain: ChainId(self.chains[k]), location, size, offset, ..leaf });
        }
        builder.finish_trusted()
    }

    /// Whether a lot is one of a source's on a kin: sources have as many, one after the other, as their shares say.
    fn wins(&self, kin: usize, source: usize, lot: f32) -> bool {
        let (before, others) = self.share(kin).split_at(source);
        let Some((&share, after)) = others.split_first() else { return false };
        let first: f32 = before.iter().sum();
        // Sums of shares are nearly one, and the last lots are somebody's.
        let is_last = after.iter().all(|share| *share <= 0.0);
        share > 0.0 && lot >= first && (is_last || lot < first + share)
    }
}
