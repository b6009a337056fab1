//! `Family`: N plants in correspondence, prepared for blending.
//!
//! The union of the plants' chains: a kin has a parent kin and, for each source, the member chain or none. Several kins
//! may share a member (split and merge). What a blend needs of a kin is worked out here once: its members resampled at
//! the union of their arc-length parameters and turned onto one branching vector (2017 TVCG, 4.3), and how thick
//! each member is where it stands.
//!
//! Limits: memory is sources × (all points of a kin's members), so it grows with the square of the number of sources.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::Weights;
use super::alignment::alignment;
use super::burden::Burden;
use super::elastic::{Elastic, canonical_order};
use super::forked::Forked;
use super::leaf_pairs::LeafPairs;
use super::resample::{Polyline, resample};
use super::size::Sizes;
use super::topology_tree::branching_vector;
use super::turns::reference;
use super::units::Units;
use crate::base::{Rotation, Seed, math};
use crate::plant::{ChainId, Curve, Plant, value_at};

/// From one lot along a kin to the next, of 2³² (the golden section): any few that follow each other are spread evenly.
const STRIDE: u32 = 0x9E37_79B9;

/// Index of a kin in its family.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct KinId(pub u32);

impl KinId {
    /// The index as `usize`.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Chains that are taken for one and the same: what a matching says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kin {
    /// The kin it branches from; an earlier one; none for stems.
    pub parent: Option<KinId>,
    /// For each source the chain, or none.
    pub members: Vec<Option<ChainId>>,
}

/// Why kins are no correspondence of their plants.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FamilyError {
    /// No plant, or one without chains.
    #[error("a family needs plants with chains")]
    Empty,
    /// A plant with a coordinate or radius so large that sums of it lose their meaning.
    #[error("source {source_index} holds a length beyond 1e12 metres")]
    TooLarge {
        /// The source.
        source_index: usize,
    },
    /// A kin whose parent does not come before it.
    #[error("kin {0:?} does not come after its parent")]
    BadParent(KinId),
    /// A kin without any member, with a wrong number of them, or with a chain that does not exist.
    #[error("kin {0:?} does not name a chain or none for each source")]
    BadMembers(KinId),
    /// A member whose parent chain is not a member of the parent kin.
    #[error("kin {kin:?} has a member of source {source_index} that grows on no member of the parent kin")]
    Adopted {
        /// The kin.
        kin: KinId,
        /// The source.
        source_index: usize,
    },
    /// A chain that is a member of no kin whose ancestors stand for its own.
    #[error("chain {chain:?} of source {source_index} belongs to no kin")]
    Orphan {
        /// The chain.
        chain: ChainId,
        /// Its source.
        source_index: usize,
    },
}

/// Longest length in a source, metres.
const LONGEST: f32 = 1e12;

/// Not a member, not a kin.
pub(super) const NONE: u32 = u32::MAX;

/// A member of a kin, or the lack of one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    /// The chain, or [`NONE`].
    pub(super) chain: u32,
    /// Location on the parent.
    pub(super) location: f32,
    /// Turns the kin's branching vector (that of its member of reference) to this member's.
    pub(super) turn: Rotation,
    /// Half the angle of that turn, radians.
    pub(super) half_angle: f32,
    /// How many kins on the same parent kin share this chain, itself included.
    pub(super) sharers: u32,
    /// Its radius at the base, metres.
    pub(super) base: f32,
    /// The next kin on the same parent kin that shares this chain, in a ring; [`NONE`] when there is no other.
    pub(super) twin: u32,
    /// Its radius at the base over its parent's radius there, but at least 1: how thick a blend may make it. Infinite
    /// where the parent has no thickness.
    pub(super) stoutness: f32,
}

/// A member on its way into a block.
#[derive(Clone, Debug)]
pub(super) struct Line<'a> {
    pub(super) parameters: Cow<'a, [f64]>,
    pub(super) points: Cow<'a, [Vec3]>,
    pub(super) radii: Cow<'a, [f32]>,
}

/// Where a leaf may stand: on a kin, for its source.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafSite {
    pub(super) source: u32,
    pub(super) kin: u32,
    pub(super) leaf: u32,
    /// Its lot, 0..1: sources share these out, and each shows the leaves whose lots are its own. The `i`-th leaves along a
    /// kin have the same lot, so that of all sources' one is there; lots follow each other evenly.
    pub(super) lot: f32,
}

/// N plants in correspondence. See the head of this file.
#[derive(Clone, Debug)]
pub struct Family {
    /// The sources, brought to one size where [`Family::at_one_size`] says so.
    pub(super) plants: Vec<Plant>,
    /// The sources in the order in which sums over more than two of them run; of two as they are.
    pub(super) order: Vec<u32>,
    /// Arc-length parameters of all points of each source.
    pub(super) parameters: Vec<Vec<f64>>,
    /// How long each chain of each source is.
    pub(super) lengths: Vec<Vec<f32>>,
    pub(super) parents: Vec<u32>,
    /// Kin after kin, a source each.
    pub(super) members: Vec<Member>,
    /// The kins that grow on each kin: `children[first_child[k]..first_child[k + 1]]`.
    pub(super) first_child: Vec<u32>,
    pub(super) children: Vec<u32>,
    /// For each kin of several members where its block starts in `shapes`, counted in points, and how many points a
    /// member has; 0 for the others. A block holds the members in order of source.
    pub(super) blocks: Vec<(u32, u32)>,
    /// Resampled members, turned onto the kin's branching vector: for each member all x, then all y, z and radii.
    pub(super) shapes: Vec<f32>,
    /// The arc-length parameter of each slot of the blocks: those of a block start where it does.
    pub(super) slots: Vec<f32>,
    /// Leaves in correspondence, where they are; see [`Family::pair_leaves`].
    pub(super) leaf_pairs: Option<LeafPairs>,
    /// For kins that share a source's chain, by kin and source: what each bears of it.
    pub(super) burdens: BTreeMap<(u32, u32), Burden>,
    /// Kins that only stand in for one source's chain where that source is alone; see [`Family::is_stand_in`].
    pub(super) stand_ins: Vec<bool>,
    /// Growth units, where they are asked for.
    pub(super) units: Option<Units>,
    /// How members run along each other, where the family is in elastic correspondence.
    pub(super) elastic: Option<Elastic>,
    /// For each source the kin that stands for each of its chains.
    pub(super) primary: Vec<Vec<u32>>,
    /// In order of source and leaf.
    pub(super) leaf_sites: Vec<LeafSite>,
    /// The sources' own sizes, where `plants` were brought to one.
    pub(super) sizes: Option<Sizes>,
    /// The sources as they came, where `plants` are views of them with stems for the limbs of main forks.
    pub(super) forked: Option<Forked>,
}

impl Family {
    /// Prepares plants and their correspondence; `n log n` in their points.
    ///
    /// # Errors
    ///
    /// When the kins are no correspondence of the plants; see [`FamilyError`].
    pub fn new(plants: Vec<Plant>, kins: &[Kin]) -> Result<Self, FamilyError> {
        if plants.is_empty() || plants.iter().any(|p| p.chains().is_empty()) {
            return Err(FamilyError::Empty);
        }
        // So that no sum or square in a blend can overflow.
        let fits = |p: &Plant| {
            p.all_points().iter().chain(p.chains().iter().map(|c| &c.origin)).all(|v| v.abs().max_element() <= LONGEST)
                && p.all_radii().iter().all(|r| *r <= LONGEST)
        };
        if let Some(source_index) = plants.iter().position(|p| !fits(p)) {
            return Err(FamilyError::TooLarge { source_index });
        }
        check(&plants, kins)?;
        let primary = primaries(&plants, kins)?;
        let parents: Vec<u32> = kins.iter().map(|k| k.parent.map_or(NONE, |p| p.0)).collect();
        let (first_child, children) = child_lists(&parents);
        let curves: Vec<Vec<Curve<'_>>> =
            plants.iter().map(|of| of.chain_ids().map(|id| Curve::new(of.points(id))).collect()).collect();
        let parameters = curves.iter().map(|of| of.iter().flat_map(Curve::parameters).collect()).collect();
        let lengths = curves.iter().map(|of| of.iter().map(Curve::length).collect()).collect();
        drop(curves);
        let order = match plants.len() {
            0..=2 => (0..plants.len() as u32).collect(),
            _ => canonical_order(&plants).into_iter().map(|s| s as u32).collect(),
        };
        let mut family = Self {
            order,
            blocks: Vec::with_capacity(kins.len()),
            members: Vec::with_capacity(kins.len() * plants.len()),
            shapes: Vec::new(),
            slots: Vec::new(),
            leaf_pairs: None,
            burdens: BTreeMap::new(),
            stand_ins: stand_ins(kins, &primary),
            units: None,
            elastic: None,
            leaf_sites: leaf_sites(&plants, kins),
            sizes: None,
            forked: None,
            plants,
            parameters,
            lengths,
            parents,
            first_child,
            children,
            primary,
        };
        family.prepare(kins);
        family.lay_blocks();
        family.link_twins();
        Ok(family)
    }

    /// The sources.
    #[must_use]
    pub fn sources(&self) -> &[Plant] {
        let whole = self.forked.as_ref().map_or(&self.plants, |forked| &forked.sources);
        self.sizes.as_ref().map_or(whole, |sizes| &sizes.sources)
    }

    /// How many kins.
    #[must_use]
    pub fn kin_count(&self) -> usize {
        self.parents.len()
    }

    /// All kins, parents before children.
    pub fn kin_ids(&self) -> impl DoubleEndedIterator<Item = KinId> + ExactSizeIterator + use<> {
        (0..self.parents.len() as u32).map(KinId)
    }

    /// The kin that a kin grows on.
    #[must_use]
    pub fn parent(&self, kin: KinId) -> Option<KinId> {
        Some(self.parents[kin.index()]).filter(|&p| p != NONE).map(KinId)
    }

    /// The kins that grow on a kin, in order.
    pub fn children(&self, kin: KinId) -> impl Iterator<Item = KinId> + '_ {
        self.child_range(kin.index()).map(|i| KinId(self.children[i]))
    }

    /// The chain that `source` gives to a kin.
    #[must_use]
    pub fn member(&self, kin: KinId, source: usize) -> Option<ChainId> {
        let chain = self.row(kin.index()).get(source)?.chain;
        (chain != NONE).then_some(ChainId(chain))
    }

    /// The kin that stands for a source's chain when nothing but that source is shown: of several that share the
    /// chain, the first.
    #[must_use]
    pub fn primary(&self, source: usize, chain: ChainId) -> KinId {
        KinId(self.primary[source][chain.index()])
    }

    /// Whether a kin is the one that stands for its member of `source`; see [`primary`](Self::primary).
    #[must_use]
    pub fn is_primary(&self, kin: KinId, source: usize) -> bool {
        self.member(kin, source).is_some_and(|chain| self.primary(source, chain) == kin)
    }

    /// Whether a kin is shown only where its source is alone: its one member is shared by a kin elsewhere that stands
    /// for it on the way to other sources (split and merge).
    #[must_use]
    pub fn is_stand_in(&self, kin: KinId) -> bool {
        self.stand_ins[kin.index()]
    }

    /// The weights that give a source back.
    #[must_use]
    pub fn corner(&self, source: usize) -> Weights {
        let mut weights = Weights::new(self.kin_count(), self.plants.len());
        let shares: Vec<f32> = (0..self.plants.len()).map(|s| if s == source { 1.0 } else { 0.0 }).collect();
        for kin in self.kin_ids() {
            weights.set(kin, &shares, if self.is_primary(kin, source) { 1.0 } else { 0.0 });
        }
        weights
    }

    /// How many kins on the same parent kin share the chain that `source` gives to a kin, itself included; 0 without.
    #[must_use]
    pub fn sharers(&self, kin: KinId, source: usize) -> usize {
        self.row(kin.index()).get(source).filter(|m| m.chain != NONE).map_or(0, |m| m.sharers as usize)
    }

    pub(super) fn row(&self, kin: usize) -> &[Member] {
        &self.members[kin * self.plants.len()..(kin + 1) * self.plants.len()]
    }

    pub(super) fn child_range(&self, kin: usize) -> std::ops::Range<usize> {
        self.first_child[kin] as usize..self.first_child[kin + 1] as usize
    }

    /// Ties the kins that share a chain on one parent kin into rings.
    fn link_twins(&mut self) {
        let sources = self.plants.len();
        for s in 0..sources {
            // Sorted by parent kin and chain, sharers are neighbours.
            let mut held: Vec<(u32, u32, u32)> = (0..self.parents.len())
                .map(|k| (self.parents[k], self.members[k * sources + s].chain, k as u32))
                .filter(|held| held.1 != NONE)
                .collect();
            held.sort_unstable();
            for ring in held.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|ring| ring.len() > 1) {
                for (i, sharer) in ring.iter().enumerate() {
                    let member = &mut self.members[sharer.2 as usize * sources + s];
                    member.twin = ring[(i + 1) % ring.len()].2;
                    member.sharers = ring.len() as u32;
                }
                let kins: Vec<u32> = ring.iter().map(|sharer| sharer.2).collect();
                for &kin in &kins {
                    let burden = Burden::of(self, kin, &kins, s);
                    self.burdens.insert((kin, s as u32), burden);
                }
            }
        }
    }

    /// Fills `members`.
    fn prepare(&mut self, kins: &[Kin]) {
        for kin in kins {
            let of = |&s: &u32| Some(branching_vector(self.plants[s as usize].points(kin.members[s as usize]?)));
            let vectors: Vec<Vec3> = self.order.iter().filter_map(of).collect();
            let reference = vectors.get(reference(&vectors)).copied().unwrap_or(Vec3::Y);
            for (s, member) in kin.members.iter().enumerate() {
                let Some(id) = *member else {
                    self.members.push(Member {
                        chain: NONE,
                        location: 0.0,
                        turn: Rotation::IDENTITY,
                        half_angle: 0.0,
                        sharers: 1,
                        base: 0.0,
                        twin: NONE,
                        stoutness: 1.0,
                    });
                    continue;
                };
                let plant = &self.plants[s];
                let direction = branching_vector(plant.points(id));
                let turn = if direction == reference {
                    Rotation::IDENTITY
                } else {
                    // The shorter arc, as slerp takes it.
                    match alignment(reference, direction) {
                        turn if turn.w < 0.0 => Rotation { v: -turn.v, w: -turn.w },
                        turn => turn,
                    }
                };
                self.members.push(Member {
                    chain: id.0,
                    location: plant.chain(id).location,
                    turn,
                    half_angle: math::atan2(turn.v.length(), turn.w),
                    sharers: 1,
                    base: plant.radii(id)[0],
                    twin: NONE,
                    stoutness: stoutness(plant, &self.parameters[s], id),
                });
            }
        }
    }

    /// Fills `blocks` and the shapes, by arc length or by growth units.
    pub(super) fn lay_blocks(&mut self) {
        self.blocks.clear();
        self.shapes.clear();
        self.slots.clear();
        let mut units = self.units.take();
        let mut elastic = self.elastic.take();
        elastic.iter_mut().for_each(Elastic::clear);
        for k in 0..self.parents.len() {
            let row = self.row(k);
            let present: Vec<usize> = (0..row.len()).filter(|&s| row[s].chain != NONE).collect();
            let start = (self.shapes.len() / 4) as u32;
            let spans: Vec<(usize, std::ops::Range<usize>)> =
                present.iter().map(|&s| (s, self.plants[s].span(ChainId(row[s].chain)))).collect();
            let whole = |(s, span): &(usize, std::ops::Range<usize>)| Line {
                parameters: Cow::Borrowed(&self.parameters[*s][span.clone()]),
                points: Cow::Borrowed(&self.plants[*s].all_points()[span.clone()]),
                radii: Cow::Borrowed(&self.plants[*s].all_radii()[span.clone()]),
            };
            if present.len() < 2 {
                self.blocks.push((start, 0));
                if let (Some(elastic), Some(span)) = (&mut elastic, spans.first()) {
                    elastic.alone(&whole(span));
                }
                continue;
            }
            let lines: Vec<Line<'_>> = spans
                .iter()
                .enumerate()
                .map(|(place, span)| match (&elastic, &units) {
                    (Some(elastic), _) => elastic.cut(k, place, &whole(span)),
                    (None, Some(units)) => units.cut(k, span.0, &whole(span)),
                    (None, None) => whole(span),
                })
                .collect();
            let lines: Vec<Polyline<'_>> = lines
                .iter()
                .map(|line| Polyline { parameters: &line.parameters, points: &line.points, radii: &line.radii })
                .collect();
            let slots = resample(&lines);
            let count = slots.parameters.len();
            if let Some(elastic) = &mut elastic {
                let turned = |place: usize, v: Vec3| row[present[place]].turn.inverse().rotate(v);
                let mut block = elastic.encode(&slots, &turned, present.len());
                self.blocks.push((start, count as u32));
                self.shapes.append(&mut block);
                continue;
            }
            let mut block = Vec::with_capacity(4 * count * present.len());
            for (place, &s) in present.iter().enumerate() {
                let back = row[s].turn.inverse();
                let member = place * count..(place + 1) * count;
                let turned: Vec<Vec3> = slots.points[member.clone()].iter().map(|p| back.rotate(*p)).collect();
                for axis in 0..3 {
                    block.extend(turned.iter().map(|p| p[axis]));
                }
                block.extend_from_slice(&slots.radii[member]);
            }
            self.blocks.push((start, count as u32));
            self.shapes.append(&mut block);
            // Blocks start at quarters of `shapes`; of two members every other slot has no parameter of its own.
            self.slots.resize(start as usize, 0.0);
            self.slots.extend(slots.parameters.iter().map(|t| *t as f32));
            if let Some(units) = &mut units {
                units.coordinates.extend(slots.parameters);
            }
        }
        self.units = units;
        self.elastic = elastic;
    }
}

fn check(plants: &[Plant], kins: &[Kin]) -> Result<(), FamilyError> {
    for (i, kin) in kins.iter().enumerate() {
        let id = KinId(i as u32);
        if kin.parent.is_some_and(|p| p.index() >= i) {
            return Err(FamilyError::BadParent(id));
        }
        let known = |(m, plant): (&Option<ChainId>, &Plant)| m.is_none_or(|c| c.index() < plant.chains().len());
        if kin.members.len() != plants.len()
            || kin.members.iter().all(Option::is_none)
            || !kin.members.iter().zip(plants).all(known)
        {
            return Err(FamilyError::BadMembers(id));
        }
        for (source_index, member) in kin.members.iter().enumerate() {
            let Some(chain) = *member else { continue };
            let bearer = kin.parent.and_then(|p| kins[p.index()].members[source_index]);
            let right = bearer == plants[source_index].chain(chain).parent;
            // A stem's kin may not hang on another kin, even one that lacks this source.
            if !right || (bearer.is_none() && kin.parent.is_some()) {
                return Err(FamilyError::Adopted { kin: id, source_index });
            }
        }
    }
    Ok(())
}

fn primaries(plants: &[Plant], kins: &[Kin]) -> Result<Vec<Vec<u32>>, FamilyError> {
    let mut primary: Vec<Vec<u32>> = plants.iter().map(|p| vec![NONE; p.chains().len()]).collect();
    for (i, kin) in kins.iter().enumerate() {
        for (s, member) in kin.members.iter().enumerate() {
            let Some(chain) = *member else { continue };
            let stands = match plants[s].chain(chain).parent {
                None => true,
                Some(parent) => kin.parent.is_some_and(|k| primary[s][parent.index()] == k.0),
            };
            let slot = &mut primary[s][chain.index()];
            if stands && *slot == NONE {
                *slot = i as u32;
            }
        }
    }
    for (source_index, chains) in primary.iter().enumerate() {
        if let Some(chain) = chains.iter().position(|&k| k == NONE) {
            return Err(FamilyError::Orphan { chain: ChainId(chain as u32), source_index });
        }
    }
    Ok(primary)
}

/// Kins with one member that they stand for while another kin holds it, too.
fn stand_ins(kins: &[Kin], primary: &[Vec<u32>]) -> Vec<bool> {
    let mut holders: Vec<Vec<u32>> = primary.iter().map(|chains| vec![0; chains.len()]).collect();
    let members = |kin: &Kin| kin.members.iter().enumerate().filter_map(|(s, m)| Some((s, (*m)?.index()))).collect();
    let all: Vec<Vec<(usize, usize)>> = kins.iter().map(members).collect();
    for &(s, chain) in all.iter().flatten() {
        holders[s][chain] += 1;
    }
    let stands = |(k, members): (usize, &Vec<(usize, usize)>)| match members[..] {
        [(s, chain)] => holders[s][chain] > 1 && primary[s][chain] == k as u32,
        _ => false,
    };
    all.iter().enumerate().map(stands).collect()
}

fn child_lists(parents: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0_u32; parents.len() + 1];
    for &p in parents.iter().filter(|&&p| p != NONE) {
        first[p as usize + 1] += 1;
    }
    for k in 0..parents.len() {
        first[k + 1] += first[k];
    }
    let mut next = first.clone();
    let mut children = vec![0; first[parents.len()] as usize];
    for (k, &p) in parents.iter().enumerate().filter(|(_, p)| **p != NONE) {
        children[next[p as usize] as usize] = k as u32;
        next[p as usize] += 1;
    }
    (first, children)
}

fn leaf_sites(plants: &[Plant], kins: &[Kin]) -> Vec<LeafSite> {
    let mut sites = Vec::new();
    for (s, plant) in plants.iter().enumerate().filter(|(_, plant)| !plant.leaves().is_empty()) {
        let mut holders: Vec<Vec<u32>> = vec![Vec::new(); plant.chains().len()];
        for (k, kin) in kins.iter().enumerate() {
            if let Some(chain) = kin.members[s] {
                holders[chain.index()].push(k as u32);
            }
        }
        let ranks = ranks(plant);
        for (i, leaf) in plant.leaves().iter().enumerate() {
            // 24 bits, from where the kin's lots begin.
            let turns =
                |kin: u32| (Seed::new(u64::from(kin)).bits() as u32).wrapping_add(ranks[i].wrapping_mul(STRIDE));
            let lot = |kin: u32| (turns(kin) >> 8) as f32 / (1 << 24) as f32;
            let on = holders[leaf.chain.index()].iter();
            sites.extend(on.map(|&kin| LeafSite { source: s as u32, kin, leaf: i as u32, lot: lot(kin) }));
        }
    }
    sites
}

/// Of each leaf, how many come before it along its chain.
fn ranks(plant: &Plant) -> Vec<u32> {
    let leaves = plant.leaves();
    let mut order: Vec<usize> = (0..leaves.len()).collect();
    order.sort_by(|&i, &j| leaves[i].location.total_cmp(&leaves[j].location).then(i.cmp(&j)));
    let mut borne = vec![0; plant.chains().len()];
    let mut ranks = vec![0; leaves.len()];
    for i in order {
        let next = &mut borne[leaves[i].chain.index()];
        ranks[i] = *next;
        *next += 1;
    }
    ranks
}

/// Base radius over the parent's radius at the location, at least 1.
fn stoutness(plant: &Plant, parameters: &[f64], id: ChainId) -> f32 {
    let chain = plant.chain(id);
    let Some(parent) = chain.parent else { return 1.0 };
    let there = value_at(&parameters[plant.span(parent)], plant.radii(parent), chain.location);
    let own = plant.radii(id)[0];
    // On a parent without thickness anything goes.
    if own <= there {
        1.0
    } else if there > own * 1e-6 {
        own / there
    } else {
        f32::INFINITY
    }
}
