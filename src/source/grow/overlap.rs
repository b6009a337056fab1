//! Branches that grow into each other: found, moved apart, and dropped where that does not help.
//!
//! Paths share no node but those before their fork, so axes never cross in the graph. But nodes are points and wood is
//! thick, and smoothing draws axes off their nodes. So the finished plant is checked, capsule against capsule: the
//! closest places of any two segments of different chains, with the radii there. Overlapping is right at forks. A place is
//! at its fork while its branch has not yet left the wood of its kin, for at most [`ZONE`] radii; and so are two places
//! less than [`FORK`] times their radii apart along the wood. The way along the wood is measured to the closest place on
//! a capsule, never to its end: a branch's first capsule may be long, and to its end the way is long at the fork itself.
//! That alone told of 3,200 overlaps in 15,800 branches of the shipped species, where there are 82.
//!
//! A branch is mended when more than [`LIMIT`] of its surface lies in others, or when its axis crosses another's: where
//! the two come closer than [`CROSSING`] of the sum of their radii, away from forks. That is how the promise is checked that
//! axes never cross, on the polylines as they are in the end, smoothed and mended. The thinner of two is pushed to the
//! side on which it passes, its neighbourhood with it and what it bears on it; its base stands. A branch that would be
//! pushed through an obstacle stays where it was. What still overlaps after [`ROUNDS`] is dropped if it is a twig that
//! bears nothing, at most [`DROPPED`] of the branches; the rest stays and is told of.
//!
//! Later rounds look only where something was moved.
//!
//! Limits: a capsule that lies in several others counts the deepest. At most [`MOST_LOOKS`] capsules are held against one,
//! so that wood thicker than its own spacing ends in bounded time; what lies beyond is not seen. `n log n` in points:
//! capsules are found by cells.

use glam::Vec3;
use rayon::prelude::*;

use super::grid::{Boxes, Lattice};
use crate::plant::{ChainId, Plant, PlantBuilder, Posed};

/// Share of a branch's surface that may lie in others.
const LIMIT: f32 = 0.01;
/// Up to this many times the sum of their radii along the wood, two places are at a fork.
const FORK: f32 = 6.0;
/// A branch is at its own fork, while it touches its kin, for at most this many times its bearer's radius and its own.
const ZONE: f32 = 12.0;
/// Axes cross where they are closer than this share of the sum of their radii.
const CROSSING: f32 = 0.1;
/// How often branches are moved apart before what is left is dropped.
const ROUNDS: u32 = 4;
/// Share of a plant's branches that may be dropped.
const DROPPED: f32 = 0.03;
/// Least sine of the angle between two axes that pass each other; below it they run side by side.
const ACROSS: f32 = 0.3;
/// Over how many times its own way a place that is moved takes its neighbours along, on either side.
const SPREAD: f32 = 5.0;
/// How much further than needed places are moved.
const FURTHER: f32 = 1.1;
/// Most capsules that one is held against.
const MOST_LOOKS: usize = 512;

/// What was found and done; counts of branches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mended {
    /// Of which more than a hundredth overlapped, or that crossed another.
    pub found: usize,
    /// Dropped twigs.
    pub dropped: usize,
    /// Still overlapping.
    pub left: usize,
}

/// A plant in the world, with all that is asked of its points.
struct Wood<'a> {
    plant: &'a Plant,
    posed: Posed,
    /// Of each point.
    chain: Vec<u32>,
    /// Way from the root along the wood, of each point.
    arc: Vec<f32>,
    /// Of each chain: the way at its base, and how long it is at its fork at most.
    base: Vec<(f32, f32)>,
}

impl<'a> Wood<'a> {
    fn of(plant: &'a Plant) -> Self {
        let posed = Posed::of_bearers(plant);
        let count = plant.all_points().len();
        let (mut chain, mut arc) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut base = Vec::with_capacity(plant.chains().len());
        let stems = plant.chain_ids().filter(|id| plant.chain(*id).parent.is_none());
        let thickest = stems.map(|id| plant.radii(id)[0]).fold(0.0, f32::max);
        for id in plant.chain_ids() {
            let curve = posed.curve(plant, id);
            let radii = plant.radii(id);
            let (start, zone) = plant.chain(id).parent.map_or((0.0, 2.0 * ZONE * thickest), |parent| {
                let location = f64::from(plant.chain(id).location);
                let below = posed.curve(plant, parent);
                let start: (f32, f32) = base[parent.index()];
                let thick = below.value(plant.radii(parent), location);
                (start.0 + below.length() * location as f32, ZONE * (thick + radii[0]))
            });
            base.push((start, zone));
            let length = curve.length();
            chain.extend(std::iter::repeat_n(id.0, radii.len()));
            arc.extend(curve.parameters().into_iter().map(|t| start + t as f32 * length));
        }
        Self { plant, posed, chain, arc, base }
    }

    fn at(&self, i: usize) -> Vec3 {
        self.posed.positions()[i]
    }

    fn radius(&self, i: usize) -> f32 {
        self.plant.all_radii()[i]
    }

    /// Radius a share along the capsule that ends in a point.
    fn radius_at(&self, i: usize, t: f32) -> f32 {
        self.radius(i - 1) + (self.radius(i) - self.radius(i - 1)) * t
    }

    fn is_first(&self, i: usize) -> bool {
        i == 0 || self.chain[i] != self.chain[i - 1]
    }

    /// The way along the wood between two places, each a share along the capsule that ends in a point; between stems it
    /// leads along the ground.
    fn way(&self, (a, s): (usize, f32), (b, t): (usize, f32)) -> f32 {
        let parent = |c: u32| self.plant.chain(ChainId(c)).parent;
        let arc = |i: usize, t: f32| self.arc[i - 1] + (self.arc[i] - self.arc[i - 1]) * t;
        let (here, there) = (arc(a, s), arc(b, t));
        let (mut x, mut y) = ((self.chain[a], here), (self.chain[b], there));
        while x.0 != y.0 {
            // A parent's index is smaller than its children's.
            let climbs = if x.0 > y.0 { &mut x } else { &mut y };
            let Some(below) = parent(climbs.0) else {
                let between = self.foot(x.0).distance(self.foot(y.0));
                return here + there + between;
            };
            *climbs = (below.0, self.base[climbs.0 as usize].0);
        }
        here + there - 2.0 * x.1.min(y.1)
    }

    /// Where the stem stands that bears a chain.
    fn foot(&self, mut chain: u32) -> Vec3 {
        while let Some(parent) = self.plant.chain(ChainId(chain)).parent {
            chain = parent.0;
        }
        self.plant.chain(ChainId(chain)).origin
    }
}

/// The capsules between each point and the one before it on its chain, by cells.
struct Capsules {
    lattice: Lattice,
    boxes: Boxes,
    /// The points in which the capsules end.
    ends: Vec<u32>,
}

impl Capsules {
    /// Of the whole plant, or of what lies in the cells where some chains are.
    fn of(wood: &Wood<'_>, active: Option<&[bool]>) -> Self {
        let count = wood.chain.len();
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut size = 0.0_f64;
        for i in 0..count {
            (low, high) = (low.min(wood.at(i)), high.max(wood.at(i)));
            let way = if wood.is_first(i) { 0.0 } else { wood.arc[i] - wood.arc[i - 1] };
            size += f64::from(way + 2.0 * wood.radius(i));
        }
        let mean = (size / count.max(1) as f64) as f32;
        let mut edge = (mean * 1.5).max((high - low).max_element() / 256.0).max(1e-6);
        loop {
            let lattice = Lattice::covering(low, high, edge);
            let cells = |i: usize| {
                let (a, b) = (wood.at(i), wood.at(i - 1));
                let r = wood.radius(i).max(wood.radius(i - 1));
                (lattice.cell(a.min(b) - r), lattice.cell(a.max(b) + r))
            };
            let all = (0..count).filter(|&i| !wood.is_first(i));
            let (ends, boxes): (Vec<u32>, Vec<_>) = if let Some(active) = active {
                // Coarse cells are enough to say what is far away.
                let coarse = Lattice::covering(low, high, edge * 4.0);
                let mut busy = vec![false; coarse.cells()];
                for i in all.clone().filter(|&i| active[wood.chain[i] as usize]) {
                    let reach = Vec3::splat(wood.radius(i).max(wood.radius(i - 1)) + edge);
                    let (a, b) = (wood.at(i).min(wood.at(i - 1)) - reach, wood.at(i).max(wood.at(i - 1)) + reach);
                    coarse.each(coarse.cell(a), coarse.cell(b), |cell| busy[cell] = true);
                }
                let near = |i: usize| {
                    let r = Vec3::splat(wood.radius(i).max(wood.radius(i - 1)));
                    let (a, b) = (wood.at(i).min(wood.at(i - 1)) - r, wood.at(i).max(wood.at(i - 1)) + r);
                    let mut any = false;
                    coarse.each(coarse.cell(a), coarse.cell(b), |cell| any |= busy[cell]);
                    any
                };
                all.filter(|&i| near(i)).map(|i| (i as u32, cells(i))).unzip()
            } else {
                all.map(|i| (i as u32, cells(i))).unzip()
            };
            let sizes = boxes.iter().map(|(a, b)| (0..3).map(|i| (b[i] - a[i] + 1) as usize).product::<usize>());
            if sizes.sum::<usize>() > count * 24 + 100_000 {
                edge *= 2.0;
                continue;
            }
            let boxes = Boxes::of(&lattice, &boxes);
            return Self { lattice, boxes, ends };
        }
    }

    /// The capsules in the cells of a box, some more than once.
    fn near(&self, low: Vec3, high: Vec3) -> impl Iterator<Item = u32> {
        let (a, b) = (self.lattice.cell(low), self.lattice.cell(high));
        (a[1]..=b[1])
            .flat_map(move |y| (a[2]..=b[2]).flat_map(move |z| (a[0]..=b[0]).map(move |x| [x, y, z])))
            .flat_map(|cell| self.boxes.at(self.lattice.index(cell)).iter().map(|&i| self.ends[i as usize]))
            .take(MOST_LOOKS)
    }
}

/// The deepest overlap of a capsule.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hit {
    /// Share of the capsule's surface that is inside.
    share: f32,
    /// The point in which the other's capsule ends.
    other: u32,
    /// Where on the own capsule, as a share.
    at: f32,
    /// The way out, for the thinner of two; zero for the thicker.
    out: Vec3,
    /// Whether the axes cross.
    crosses: bool,
}

/// Where a point's disc meets the capsule that ends in another, as a share along that, and the sum of their radii there.
fn meeting(wood: &Wood<'_>, i: usize, j: usize) -> Option<(f32, f32)> {
    let (foot, along) = (wood.at(j - 1), wood.at(j) - wood.at(j - 1));
    let t = ((wood.at(i) - foot).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    let reach = wood.radius_at(j, t) + wood.radius(i);
    (wood.at(i).distance_squared(foot + along * t) < reach * reach).then_some((t, reach))
}

/// Which points are at the fork of their chain: it has not left the wood of its kin yet. Chains that are not `active` are
/// as they were `before`.
fn fused(wood: &Wood<'_>, capsules: &Capsules, active: &[bool], before: Vec<bool>) -> Vec<bool> {
    let ids: Vec<ChainId> = wood.plant.chain_ids().filter(|id| active[id.index()]).collect();
    let ends: Vec<usize> = ids
        .par_iter()
        .with_min_len(32)
        .map(|&id| {
            let span = wood.plant.span(id);
            let (start, zone) = wood.base[id.index()];
            let mut last = span.start;
            for i in span.start + 1..span.end {
                if wood.arc[i] - start > zone {
                    break;
                }
                let touches = capsules.near(wood.at(i) - wood.radius(i), wood.at(i) + wood.radius(i)).any(|j| {
                    let j = j as usize;
                    wood.chain[j] != id.0
                        && meeting(wood, i, j)
                            .is_some_and(|(t, reach)| wood.way((i, 1.0), (j, t)) <= zone + ZONE * reach)
                });
                if !touches {
                    break;
                }
                last = i;
            }
            last
        })
        .collect();
    let mut fused = before;
    for (id, end) in ids.iter().zip(ends) {
        let span = wood.plant.span(*id);
        fused[span.start..=end].fill(true);
        fused[end + 1..span.end].fill(false);
    }
    fused
}

/// The closest places of two segments, as shares along them (Ericson 2005, 5.1.9); neither has no length.
fn closest([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> (f32, f32) {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, vv, uv) = (u.length_squared(), v.length_squared(), u.dot(v));
    let (uw, vw) = (u.dot(w), v.dot(w));
    let across = uu * vv - uv * uv;
    let s = if across > 1e-6 * uu * vv { ((uv * vw - uw * vv) / across).clamp(0.0, 1.0) } else { 0.5 };
    let t = (uv * s + vw) / vv;
    if (0.0..=1.0).contains(&t) {
        return (s, t);
    }
    let t = t.clamp(0.0, 1.0);
    (((uv * t - uw) / uu).clamp(0.0, 1.0), t)
}

/// The deepest overlap of the capsule that ends in a point with those of other chains.
fn hit(wood: &Wood<'_>, capsules: &Capsules, fused: &[bool], i: usize) -> Option<Hit> {
    if wood.is_first(i) || fused[i] {
        return None;
    }
    let (own, ends) = (wood.chain[i], [wood.at(i - 1), wood.at(i)]);
    let length = ends[0].distance(ends[1]);
    if length <= 0.0 {
        return None;
    }
    let heading = (ends[1] - ends[0]) / length;
    let mut deepest: Option<Hit> = None;
    let thick = wood.radius(i).max(wood.radius(i - 1));
    for j in capsules.near(ends[0].min(ends[1]) - thick, ends[0].max(ends[1]) + thick) {
        let j = j as usize;
        let other = [wood.at(j - 1), wood.at(j)];
        if own == wood.chain[j] || other[0] == other[1] {
            continue;
        }
        let (s, t) = closest(ends, other);
        let (r, theirs) = (wood.radius_at(i, s), wood.radius_at(j, t));
        let off = ends[0].lerp(ends[1], s) - other[0].lerp(other[1], t);
        let (far, reach) = (off.length(), r + theirs);
        if far >= reach {
            continue;
        }
        let way = wood.way((i, s), (j, t));
        if way <= FORK * reach || (fused[j] && way <= wood.base[wood.chain[j] as usize].1 + ZONE * reach) {
            continue;
        }
        let across = heading.cross((other[1] - other[0]).normalize_or(Vec3::ZERO));
        let sine = across.length();
        // How long the one is inside the other, and how deep on the mean.
        let inside = (2.0 * (reach * reach - far * far).sqrt() / sine.max(1e-3)).min(length);
        let depth = ((reach - far) / (2.0 * r).max(f32::MIN_POSITIVE)).min(1.0);
        let share = depth * (2.0 / 3.0) * inside / length;
        let thinner = (r, wood.chain[j]) <= (theirs, own);
        // Where axes cross, all places go to the side on which their axis passes; each its own way out, those before and
        // behind the other would part and never get free.
        let out = if !thinner {
            Vec3::ZERO
        } else if sine >= ACROSS {
            let across = across / sine;
            let side = off.dot(across);
            across * ((reach - side.abs()) * FURTHER).copysign(side)
        } else {
            let across = (other[1] - other[0]).any_orthogonal_vector().normalize_or(Vec3::X);
            off.try_normalize().unwrap_or(across) * ((reach - far) * FURTHER)
        };
        let crosses = far < CROSSING * reach;
        let rank = (crosses, share, out.length_squared());
        if deepest.is_none_or(|d| rank > (d.crosses, d.share, d.out.length_squared())) {
            deepest = Some(Hit { share, other: j as u32, at: s, out, crosses });
        }
    }
    deepest
}

/// The overlaps of some chains.
struct Found {
    hits: Vec<(usize, Hit)>,
    /// How much of each chain's surface lies in others.
    shares: Vec<f32>,
    /// Which chains' axes cross others.
    crossed: Vec<bool>,
    /// Which points are at the fork of their chain.
    fused: Vec<bool>,
}

impl Found {
    /// Whether a chain must be mended.
    fn bad(&self, chain: usize) -> bool {
        self.shares[chain] > LIMIT || self.crossed[chain]
    }

    fn count(&self) -> usize {
        (0..self.shares.len()).filter(|&chain| self.bad(chain)).count()
    }
}

/// Looks at all chains, or, where a round was there `before`, at those that are `active` since.
fn find(wood: &Wood<'_>, active: &[bool], before: Option<Vec<bool>>) -> Found {
    let capsules = Capsules::of(wood, before.as_ref().map(|_| active));
    let fused = match before {
        None => fused(wood, &capsules, &vec![true; active.len()], vec![false; wood.chain.len()]),
        Some(before) => fused(wood, &capsules, active, before),
    };
    let points: Vec<usize> = (0..wood.chain.len()).filter(|&i| active[wood.chain[i] as usize]).collect();
    let all: Vec<Option<Hit>> = points.par_iter().with_min_len(256).map(|&i| hit(wood, &capsules, &fused, i)).collect();
    let hits: Vec<(usize, Hit)> = points.into_iter().zip(all).filter_map(|(i, hit)| Some((i, hit?))).collect();
    let mut surface = vec![(0.0_f64, 0.0_f64); active.len()];
    let mut crossed = vec![false; active.len()];
    let area = |i: usize| f64::from(wood.radius(i) * (wood.arc[i] - wood.arc[i - 1]));
    for i in (0..wood.chain.len()).filter(|&i| !wood.is_first(i)) {
        surface[wood.chain[i] as usize].1 += area(i);
    }
    for (i, hit) in &hits {
        surface[wood.chain[*i] as usize].0 += area(*i) * f64::from(hit.share);
        crossed[wood.chain[*i] as usize] |= hit.crosses;
    }
    let shares = surface.iter().map(|(inside, all)| if *all > 0.0 { (inside / all) as f32 } else { 0.0 }).collect();
    Found { hits, shares, crossed, fused }
}

/// The plant with the points of overlapping chains moved out, those around them part of the way, and which chains that
/// concerns. Bases stand, and what a branch bears goes with it.
/// Chains that are `pinned` stay.
fn moved(wood: &Wood<'_>, found: &Found, pinned: &[bool]) -> (Plant, Vec<bool>) {
    let plant = wood.plant;
    let mut own = vec![Vec3::ZERO; wood.chain.len()];
    let mut active: Vec<bool> = (0..found.shares.len()).map(|chain| found.bad(chain)).collect();
    for (i, hit) in &found.hits {
        let pair = [wood.chain[*i], wood.chain[hit.other as usize]].map(|c| c as usize);
        if !pair.iter().any(|&c| found.bad(c)) || hit.out == Vec3::ZERO || pinned[pair[0]] {
            continue;
        }
        active[pair[0]] = true;
        active[pair[1]] = true;
        let span = plant.span(ChainId(wood.chain[*i]));
        let edge = wood.arc[*i] - wood.arc[*i - 1];
        let (centre, width) = (wood.arc[*i - 1] + edge * hit.at, hit.out.length() * SPREAD + edge * 2.0);
        let mut grow = |k: usize| {
            let near = 1.0 - (wood.arc[k] - centre).abs() / width;
            if near <= 0.0 {
                return false;
            }
            let wish = hit.out * (near * near * (3.0 - 2.0 * near));
            if wish.length_squared() > own[k].length_squared() {
                own[k] = wish;
            }
            true
        };
        let _ = (*i..span.end).all(&mut grow);
        let _ = (span.start + 1..*i).rev().all(&mut grow);
    }
    let mut builder = PlantBuilder::new();
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let span = plant.span(id);
        let radii = plant.radii(id);
        let carried = chain.parent.is_some_and(|parent| active[parent.index()]);
        active[id.index()] |= carried;
        let frame = chain.parent.map(|parent| wood.posed.frame(parent, chain.location));
        let local = |v: Vec3| frame.map_or(v, |frame| frame.to_local(v));
        let points: Vec<Vec3> = plant
            .points(id)
            .iter()
            .zip(&own[span])
            .map(|(p, own)| if *own == Vec3::ZERO { *p } else { *p + local(*own) })
            .collect();
        match chain.parent {
            None => builder.stem(chain.origin, &points, radii),
            Some(parent) => builder.branch(parent, chain.location, &points, radii),
        };
    }
    (builder.finish().unwrap_or_else(|_| plant.clone()), active)
}

/// The plant without the thinnest of the twigs that overlap too much, but no more than a share of its branches; and how
/// many these were.
fn dropped(plant: &Plant, found: &Found) -> (Plant, usize) {
    let mut bears = vec![false; plant.chains().len()];
    plant.chains().iter().filter_map(|c| c.parent).for_each(|p| bears[p.index()] = true);
    let mut twigs: Vec<ChainId> = plant
        .chain_ids()
        .filter(|id| found.bad(id.index()) && !bears[id.index()] && plant.chain(*id).parent.is_some())
        .collect();
    twigs.sort_by(|a, b| plant.radii(*a)[0].total_cmp(&plant.radii(*b)[0]).then(a.cmp(b)));
    twigs.truncate((plant.chains().len() as f32 * DROPPED).max(1.0) as usize);
    let mut gone = vec![false; bears.len()];
    twigs.iter().for_each(|id| gone[id.index()] = true);
    let mut builder = PlantBuilder::new();
    let mut places: Vec<Option<ChainId>> = Vec::with_capacity(gone.len());
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let (points, radii) = (plant.points(id), plant.radii(id));
        places.push(match chain.parent {
            _ if gone[id.index()] => None,
            None => Some(builder.stem(chain.origin, points, radii)),
            Some(parent) => places[parent.index()].map(|p| builder.branch(p, chain.location, points, radii)),
        });
    }
    (builder.finish().unwrap_or_else(|_| plant.clone()), twigs.len())
}

/// The chains of `after` that an obstacle bars though it did not bar them `before`; chains of both are the same ones.
fn newly_barred(before: &Plant, after: &Plant, barred: &dyn Fn(Vec3, Vec3) -> bool) -> Vec<bool> {
    let (a, b) = (Posed::of_bearers(before), Posed::of_bearers(after));
    let within = |posed: &Posed, plant: &Plant, id| posed.chain(plant, id).windows(2).any(|s| barred(s[0], s[1]));
    let ids = after.chain_ids();
    ids.map(|id| a.chain(before, id) != b.chain(after, id) && within(&b, after, id) && !within(&a, before, id))
        .collect()
}

/// The plant with some chains, and those that bear them, as they were `before`; `pinned` is told which.
fn put_back(before: &Plant, after: &Plant, back: &[bool], pinned: &mut [bool]) -> Plant {
    for id in before.chain_ids().filter(|id| back[id.index()]) {
        let mut at = Some(id);
        while let Some(id) = at.filter(|id| !pinned[id.index()]) {
            pinned[id.index()] = true;
            at = before.chain(id).parent;
        }
    }
    let mut builder = PlantBuilder::new();
    for id in after.chain_ids() {
        let chain = after.chain(id);
        let points = if pinned[id.index()] { before.points(id) } else { after.points(id) };
        match chain.parent {
            None => builder.stem(chain.origin, points, after.radii(id)),
            Some(parent) => builder.branch(parent, chain.location, points, after.radii(id)),
        };
    }
    builder.finish().unwrap_or_else(|_| before.clone())
}

/// How many branches of a plant lie in others with more than a hundredth of their surface, away from forks.
#[must_use]
pub fn overlaps(plant: &Plant) -> usize {
    let found = find(&Wood::of(plant), &vec![true; plant.chains().len()], None);
    found.shares.iter().filter(|share| **share > LIMIT).count()
}

/// How many branches of a plant have an axis that crosses another's away from forks: closer than a tenth of the sum of
/// their radii.
#[must_use]
pub fn crossings(plant: &Plant) -> usize {
    let found = find(&Wood::of(plant), &vec![true; plant.chains().len()], None);
    found.crossed.iter().filter(|crossed| **crossed).count()
}

/// The plant with its overlapping and crossing branches moved apart, twigs for which that does not help dropped, and what
/// was done. Radii stay as they are. Leaves are not kept.
#[must_use]
pub fn mend_overlaps(plant: &Plant) -> (Plant, Mended) {
    mend_among(plant, None)
}

/// As [`mend_overlaps`], among obstacles: `barred` says whether one is between two places. No branch is moved into one.
pub(super) fn mend_among(plant: &Plant, barred: Option<&dyn Fn(Vec3, Vec3) -> bool>) -> (Plant, Mended) {
    let mut mended = Mended::default();
    let mut rest = plant.clone();
    let mut active = vec![true; plant.chains().len()];
    let mut pinned = vec![false; plant.chains().len()];
    let mut fused = None;
    for round in 0..=ROUNDS {
        let wood = Wood::of(&rest);
        let found = find(&wood, &active, fused);
        mended.left = found.count();
        if round == 0 {
            mended.found = mended.left;
        }
        if mended.left == 0 {
            break;
        }
        let next = if round < ROUNDS {
            let (mut next, changed) = moved(&wood, &found, &pinned);
            // What is put back moves what it bears, so it may take a few times; each pins more chains.
            while let Some(barred) = barred {
                let back = newly_barred(&rest, &next, barred);
                let fresh = |(back, pinned): (&bool, &bool)| *back && !*pinned;
                if !back.iter().zip(&pinned).any(fresh) {
                    break;
                }
                next = put_back(&rest, &next, &back, &mut pinned);
            }
            active = changed;
            next
        } else {
            let (next, dropped) = dropped(&rest, &found);
            mended.dropped = dropped;
            mended.left -= dropped;
            next
        };
        fused = Some(found.fused);
        rest = next;
    }
    (rest, mended)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Skeleton, SkeletonNode};
    use crate::preset::species;
    use crate::source::grow::grow;

    fn chain(nodes: &mut Vec<SkeletonNode>, from: Option<u32>, points: &[Vec3], radius: f32) {
        let mut parent = from;
        for &position in points {
            nodes.push(SkeletonNode { position, radius, parent });
            parent = Some(nodes.len() as u32 - 1);
        }
    }

    /// A trunk, a limb that leaves it, and a twig of the trunk whose way leads through the limb.
    fn crossing(offset: f32) -> Skeleton {
        let mut nodes = Vec::new();
        let up: Vec<Vec3> = (0..=40).map(|i| Vec3::Y * (i as f32 * 0.1)).collect();
        chain(&mut nodes, None, &up, 0.1);
        let limb: Vec<Vec3> = (1..=30).map(|i| Vec3::new(i as f32 * 0.1, 1.0, 0.0)).collect();
        chain(&mut nodes, Some(10), &limb, 0.05);
        let twig: Vec<Vec3> = (1..=30).map(|i| Vec3::new(i as f32 * 0.08, 2.0 - i as f32 * 0.08, offset)).collect();
        chain(&mut nodes, Some(20), &twig, 0.01);
        Skeleton { nodes }
    }

    fn plant(skeleton: Skeleton) -> Plant {
        skeleton.into_plant().unwrap()
    }

    #[test]
    fn what_is_apart_stays_as_it_is() {
        let apart = plant(crossing(0.3));
        assert_eq!(mend_overlaps(&apart), (apart, Mended::default()));
    }

    #[test]
    fn a_twig_through_a_limb_goes_around_it() {
        let before = plant(crossing(0.004));
        let (after, mended) = mend_overlaps(&before);
        // The limb, too, has more than a hundredth of its surface in the twig.
        assert_eq!(mended, Mended { found: 2, dropped: 0, left: 0 });
        assert_eq!((after.chains(), overlaps(&after), crossings(&after)), (before.chains(), 0, 0));
        // No farther than it must, and its base and tip not at all.
        let (a, b) = (before.pose(), after.pose());
        let far = a.positions().iter().zip(b.positions()).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!((0.05..0.09).contains(&far), "{far}");
        for id in before.chain_ids() {
            let (a, b) = (a.chain(&before, id), b.chain(&after, id));
            assert_eq!((a.first(), a.last()), (b.first(), b.last()));
        }
    }

    #[test]
    fn a_branch_is_not_moved_through_an_obstacle() {
        let before = plant(crossing(0.004));
        // A wall close to the twig, on the side to which it would go.
        let wall = |a: Vec3, b: Vec3| (a.z - 0.02) * (b.z - 0.02) <= 0.0;
        assert!(before.pose().positions().iter().all(|p| p.z < 0.02));
        let (after, mended) = mend_among(&before, Some(&wall));
        assert!(after.pose().positions().iter().all(|p| p.z < 0.02));
        assert!(mended.dropped + mended.left > 0, "{mended:?}");
    }

    #[test]
    fn axes_that_cross_are_found_and_moved_apart_however_long_the_branches() {
        // Wood of a millimetre: the crossing is far less than a hundredth of its surface.
        let mut skeleton = crossing(0.0);
        skeleton.nodes.iter_mut().for_each(|n| n.radius = 0.001);
        let crossed = plant(skeleton);
        assert_eq!((overlaps(&crossed), crossings(&crossed)), (0, 2));
        let (after, mended) = mend_overlaps(&crossed);
        assert_eq!((mended.found, mended.left, crossings(&after)), (2, 0, 0));
    }

    #[test]
    fn axes_that_cross_between_their_points_are_found() {
        // Segments of a metre, wood of a centimetre: no point is near the other axis.
        let mut nodes = Vec::new();
        chain(&mut nodes, None, &[Vec3::ZERO, Vec3::Y, Vec3::Y * 4.0], 0.02);
        chain(&mut nodes, Some(1), &[Vec3::new(1.0, 1.0, 0.0), Vec3::new(2.0, 1.0, 0.0)], 0.02);
        chain(&mut nodes, Some(2), &[Vec3::new(1.5, 1.5, 0.0), Vec3::new(1.5, 0.5, 0.0)], 0.02);
        let crossed = plant(Skeleton { nodes });
        let wood = Wood::of(&crossed);
        let hits = find(&wood, &[true; 3], None).hits;
        assert_eq!(hits.len(), 2, "{hits:?}");
        assert!(hits.iter().all(|(_, hit)| (hit.at - 0.5).abs() < 1e-3));
    }

    #[test]
    fn forks_are_no_overlaps_however_long_their_first_segments() {
        let mut nodes = Vec::new();
        let up: Vec<Vec3> = (0..=8).map(|i| Vec3::Y * (i as f32 * 0.5)).collect();
        chain(&mut nodes, None, &up, 0.1);
        for fork in 1..8_u32 {
            let (sin, cos) = crate::base::math::sin_cos(fork as f32);
            let base = up[fork as usize];
            for steep in [0.4, 1.5] {
                let way = |t: f32| base + Vec3::new(cos * t, steep * t, sin * t);
                chain(&mut nodes, Some(fork), &[way(0.9), way(1.3)], 0.03);
            }
        }
        assert_eq!(overlaps(&plant(Skeleton { nodes })), 0);
    }

    #[test]
    fn a_twig_inside_a_limb_leaves_it_or_is_dropped() {
        let mut skeleton = crossing(0.3);
        let inside: Vec<Vec3> = (0..25).map(|i| Vec3::new(2.9 - i as f32 * 0.08, 1.0, 0.0)).collect();
        chain(&mut skeleton.nodes, Some(40), &inside, 0.001);
        let (rest, mended) = mend_overlaps(&plant(skeleton));
        assert!(mended.found >= 1 && mended.left == 0, "{mended:?}");
        assert_eq!(overlaps(&rest), 0);
    }

    #[test]
    fn wood_thicker_than_its_spacing_ends() {
        let mut skeleton = crossing(0.0);
        skeleton.nodes.iter_mut().for_each(|n| n.radius = 50.0);
        let (rest, _) = mend_overlaps(&plant(skeleton));
        assert!(!rest.chains().is_empty());
    }

    #[test]
    fn grown_plants_overlap_nowhere_or_say_where() {
        let text = "(height: 9.0, nodes: 6000, iterations: [\
            (endpoints: Volume(shape: Point(height: 0.6), count: 1)),\
            (endpoints: Volume(shape: Ellipsoid(bottom: 0.2, top: 0.9, radius: 0.4), count: 60)),\
            (endpoints: Surface(k: 2, count: 400))])";
        let mut params = species("s.ron", text).unwrap();
        params.tip_radius = 0.03;
        let mut told = 0;
        for seed in 1..5 {
            let (plant, notes) = grow(&params, crate::base::Seed::new(seed)).unwrap();
            let left = notes.iter().any(|note| note.contains("still grow"));
            told += usize::from(left || notes.iter().any(|note| note.contains("moved out of")));
            assert!(left || overlaps(&plant) == 0, "{notes:?}");
            assert!((plant.height() - 9.0).abs() < 1e-3);
        }
        assert!(told > 0);
    }
}
