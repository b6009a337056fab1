//! The implausibility filter (2017 TVCG, 4.4): which branches run into each other so much that one has to go.
//!
//! Two branches (chains) collide as much as the share of the smaller one's surface that lies inside the other: the paper's
//! "ratio of the intersected area to the smaller surface area". It is 0 where they pass, 1 where one is swallowed, and
//! serious above a threshold that rises linearly with scale. The scale of a pair is the Gravelius order of the finer of
//! the two: stems against stems are the coarsest.
//!
//! Of a serious pair the finer one goes with all that it bears, among equals the one that bears less wood; coarse
//! pairs are settled first, the worst first, and pairs that lost one are settled with it.
//!
//! Past the paper:
//! - the collar of a branch, where it is still in its parent's wood, does not count (`wood.rs`); or every branch would
//!   collide;
//! - a pair of kins that collides in a source as well may do so as much as there ([`Habits`]): what a scan looks like is
//!   not the blend's fault, and a corner stays its source;
//! - stems that merge into one (kins that share a member, `stems: Merge`) lie in one another on the way, and what they
//!   bear leaves through all of them: neither counts. (Counted, a shrub's rods that merge into an oak lost 14 of their
//!   limbs and rods a tree.)
//!
//! The area is that of [`RING`] strips along the surface of each segment, each as long as its middle line is inside the
//! other branch's tapered capsules, which is solved for and not sampled. Only pairs whose touching sections, then
//! segments, are long enough to be serious come so far (`capsules.rs`). Within 3 % on crossing cylinders.

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use super::capsules::{Contact, Sections, near_stretch};
use super::wood::{Wood, strip};
use crate::base::math;
use crate::plant::{ChainId, Plant, Posed};
use crate::preset::plan::FilterParams;
use crate::relate::{Family, KinId};

/// Lines along a surface.
const RING: usize = 16;
/// Two branches that collide seriously.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// The one that stays.
    pub stays: ChainId,
    /// The one that goes.
    pub goes: ChainId,
    /// Share of the smaller one's surface inside the other, 0..=1.
    pub ratio: f32,
    /// Gravelius order of the finer one.
    pub scale: u16,
}

/// A kin that shares no member.
const ALONE: u32 = u32::MAX;

/// How much kins collide in the sources of a family: what is a source's own habit is no fault of a blend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Habits {
    /// Pairs of kins, the lower first, and the greatest ratio; sorted.
    pairs: Vec<(u32, u32, f32)>,
    /// For each kin the first of those on the same parent that share a member with it, and the same for its parent;
    /// [`ALONE`] where none does. Empty where none in the family does.
    shared: Vec<(u32, u32)>,
    /// Serious collisions of each source.
    pub(super) of_sources: Vec<usize>,
}

impl Habits {
    /// Looks at every source of a family.
    #[must_use]
    pub fn of(family: &Family, params: &FilterParams) -> Self {
        let mut pairs = Vec::new();
        let mut of_sources = Vec::new();
        let look = |plant: &Plant| serious(plant, &Wood::of(plant, &Posed::of_bearers(plant)), params, &|_, _| 0.0);
        let each: Vec<Vec<Collision>> = family.sources().par_iter().map(look).collect();
        for (s, found) in each.into_iter().enumerate() {
            of_sources.push(found.len());
            for c in found {
                let (a, b) = (family.primary(s, c.stays).0, family.primary(s, c.goes).0);
                pairs.push((a.min(b), a.max(b), c.ratio));
            }
        }
        pairs.sort_by(|x, y| (x.0, x.1).cmp(&(y.0, y.1)).then(y.2.total_cmp(&x.2)));
        pairs.dedup_by_key(|p| (p.0, p.1));
        Self { pairs, shared: shared(family), of_sources }
    }

    /// The ratio up to which two kins may collide.
    fn ratio(&self, a: KinId, b: KinId) -> f32 {
        if let (Some(own), Some(other)) = (self.shared.get(a.index()), self.shared.get(b.index())) {
            let within = |stem: u32, other: &(u32, u32)| stem != ALONE && (stem == other.0 || stem == other.1);
            if within(own.0, other) || within(other.0, own) {
                return f32::INFINITY;
            }
        }
        let wanted = (a.0.min(b.0), a.0.max(b.0));
        // A tenth more, as the same two branches are never bent quite the same way in a blend.
        self.pairs.binary_search_by_key(&wanted, |p| (p.0, p.1)).map_or(0.0, |i| self.pairs[i].2 * 1.1)
    }
}

/// What [`Habits::shared`] holds.
fn shared(family: &Family) -> Vec<(u32, u32)> {
    let mut own = vec![ALONE; family.kin_count()];
    for source in 0..family.sources().len() {
        let mut first: BTreeMap<(Option<KinId>, ChainId), KinId> = BTreeMap::new();
        for kin in family.kin_ids() {
            let Some(chain) = family.member(kin, source) else { continue };
            let before = *first.entry((family.parent(kin), chain)).or_insert(kin);
            if before != kin {
                own[before.index()] = before.0;
                own[kin.index()] = before.0;
            }
        }
    }
    if own.iter().all(|k| *k == ALONE) {
        return Vec::new();
    }
    family.kin_ids().map(|kin| (own[kin.index()], family.parent(kin).map_or(ALONE, |p| own[p.index()]))).collect()
}

/// The threshold at a scale.
fn threshold(params: &FilterParams, scale: u16) -> f32 {
    params.collisions + params.rise * f32::from(scale.saturating_sub(1))
}

/// The collisions for which a branch has to go, coarsest and worst first. `kins` gives the kin of each chain; an empty
/// slice stands for a plant that belongs to no family.
#[must_use]
pub fn collisions(
    plant: &Plant,
    posed: &Posed,
    kins: &[KinId],
    habits: &Habits,
    params: &FilterParams,
) -> Vec<Collision> {
    let habit = |a: usize, b: usize| match (kins.get(a), kins.get(b)) {
        (Some(&a), Some(&b)) => habits.ratio(a, b),
        _ => 0.0,
    };
    let found = serious(plant, &Wood::of(plant, posed), params, &habit);
    // Parents come before children, so what hangs on a branch that goes is known when it is met.
    let mut gone = vec![false; plant.chains().len()];
    let mut settled = Vec::new();
    for collision in found {
        let lost = |id: ChainId| {
            let mut at = Some(id);
            while let Some(chain) = at {
                if gone[chain.index()] {
                    return true;
                }
                at = plant.chain(chain).parent;
            }
            false
        };
        if !lost(collision.goes) && !lost(collision.stays) {
            gone[collision.goes.index()] = true;
            settled.push(collision);
        }
    }
    settled
}

/// All serious collisions, coarsest and worst first.
fn serious(plant: &Plant, wood: &Wood, params: &FilterParams, habit: &dyn Fn(usize, usize) -> f32) -> Vec<Collision> {
    let sections = Sections::of(wood);
    let touching = sections.touching(wood);
    let mut borne: Option<Vec<f32>> = None;
    let (mut found, mut contacts) = (Vec::new(), Vec::new());
    for pair in touching.chunk_by(|x, y| x.chains == y.chains) {
        let (a, b) = (pair[0].chains.0 as usize, pair[0].chains.1 as usize);
        let (order_a, order_b) = (plant.chains()[a].order, plant.chains()[b].order);
        let scale = order_a.max(order_b);
        let first_is_smaller = wood.surfaces[a] <= wood.surfaces[b];
        let least = wood.surfaces[a].min(wood.surfaces[b]);
        let mut limit = threshold(params, scale) * least;
        if least <= 0.0 || limit >= least || sections.at_most(wood, pair, first_is_smaller) <= limit {
            continue;
        }
        limit = limit.max(habit(a, b) * least);
        sections.contacts(wood, pair, &mut contacts);
        if at_most(wood, &contacts, first_is_smaller) <= limit {
            continue;
        }
        let area = intersected_area(wood, &contacts, first_is_smaller);
        if area <= limit {
            continue;
        }
        let borne = borne.get_or_insert_with(|| borne_surfaces(plant, wood));
        let first_goes = (order_b, borne[a], b) < (order_a, borne[b], a);
        let (goes, stays) = if first_goes { (a, b) } else { (b, a) };
        let id = |i: usize| ChainId(i as u32);
        found.push(Collision { stays: id(stays), goes: id(goes), ratio: (area / least).min(1.0), scale });
    }
    found.sort_by(|x, y| {
        x.scale.cmp(&y.scale).then(y.ratio.total_cmp(&x.ratio)).then((x.goes, x.stays).cmp(&(y.goes, y.stays)))
    });
    found
}

/// Surface of each chain and all that it bears.
fn borne_surfaces(plant: &Plant, wood: &Wood) -> Vec<f32> {
    let mut borne = wood.surfaces.clone();
    for i in (0..borne.len()).rev() {
        if let Some(parent) = plant.chains()[i].parent {
            borne[parent.index()] += borne[i];
        }
    }
    borne
}

/// The smaller branch's segment of a contact, and the other's.
fn sides(contact: &Contact, first_is_smaller: bool) -> (usize, usize) {
    let (i, j) = (contact.segments.0 as usize, contact.segments.1 as usize);
    if first_is_smaller { (i, j) } else { (j, i) }
}

/// A bound from above for the area: each touching segment inside as far as it is near the other's axis.
fn at_most(wood: &Wood, pair: &[Contact], first_is_smaller: bool) -> f32 {
    let bound = |contact: &Contact| {
        let (i, j) = sides(contact, first_is_smaller);
        let (from, to) = stretch(wood, i, j);
        strip(wood.points[i].distance(wood.points[i + 1]) * (to - from), wood.radii[i], wood.radii[i + 1])
    };
    pair.iter().map(bound).sum()
}

/// The stretch of segment `i`, as shares of it, that can be within reach of segment `j`.
fn stretch(wood: &Wood, i: usize, j: usize) -> (f32, f32) {
    let reach = wood.radii[i].max(wood.radii[i + 1]) + wood.radii[j].max(wood.radii[j + 1]);
    let ends = |k: usize| (wood.points[k], wood.points[k + 1]);
    near_stretch(ends(i), ends(j), reach)
}

/// Area of the smaller branch's surface inside the other, square metres.
fn intersected_area(wood: &Wood, pair: &[Contact], first_is_smaller: bool) -> f32 {
    let mut sides: Vec<(usize, usize)> = pair.iter().map(|c| sides(c, first_is_smaller)).collect();
    sides.sort_unstable();
    let mut area = 0.0;
    let mut inside: Vec<(f32, f32)> = Vec::new();
    for touching in sides.chunk_by(|x, y| x.0 == y.0) {
        let i = touching[0].0;
        let (a, b) = (wood.points[i], wood.points[i + 1]);
        let (length, radius, taper) = (a.distance(b), wood.radii[i], wood.radii[i + 1] - wood.radii[i]);
        let axis = (b - a).normalize_or(Vec3::Y);
        let across = axis.any_orthonormal_vector();
        let other = axis.cross(across);
        let mut sum = 0.0;
        for (x, y) in ring() {
            let out = across * *x + other * *y;
            inside.clear();
            for &(_, j) in touching {
                let (from, to) = stretch(wood, i, j);
                swallowed(wood, j, (a + out * radius, b - a + out * taper), (from, to), &mut inside);
            }
            inside.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.total_cmp(&y.1)));
            let mut done = 0.0_f32;
            for &(from, to) in &inside {
                let from = from.max(done);
                if to > from {
                    sum += strip(length * (to - from), radius + taper * from, radius + taper * to);
                    done = to;
                }
            }
        }
        area += sum / RING as f32;
    }
    area
}

/// The parts of a line (start and way) between two shares of it that lie in a segment's tapered capsule; a hair more, so
/// that twins that share a surface are inside each other.
fn swallowed(wood: &Wood, segment: usize, line: (Vec3, Vec3), part: (f32, f32), inside: &mut Vec<(f32, f32)>) {
    const HAIR: f32 = 1.0001;
    let (c, d) = (wood.points[segment], wood.points[segment + 1]);
    let (near, far) = (wood.radii[segment] * HAIR, wood.radii[segment + 1] * HAIR);
    let (along, start, way) = (d - c, line.0 - c, line.1);
    let square = along.length_squared();
    let ball =
        |start: Vec3, radius: f32| (way.length_squared(), start.dot(way), start.length_squared() - radius * radius);
    if square <= 0.0 {
        below_zero(ball(start, near), part, inside);
        return;
    }
    // Where on the segment's axis the line's points are: `at + rate·s`.
    let (at, rate) = (start.dot(along) / square, way.dot(along) / square);
    let (across, drift) = (start - along * at, way - along * rate);
    let (radius, growth) = (near + (far - near) * at, (far - near) * rate);
    let body = (
        drift.length_squared() - growth * growth,
        across.dot(drift) - radius * growth,
        across.length_squared() - radius * radius,
    );
    let balls = (ball(start, near), ball(line.0 - d, far));
    if rate.abs() < 1e-12 {
        below_zero(
            if at < 0.0 {
                balls.0
            } else if at > 1.0 {
                balls.1
            } else {
                body
            },
            part,
            inside,
        );
        return;
    }
    // The line passes the ball at one end, the body, the ball at the other.
    let (x, y) = (-at / rate, (1.0 - at) / rate);
    let (first, last, from, to) = if rate > 0.0 { (balls.0, balls.1, x, y) } else { (balls.1, balls.0, y, x) };
    let (from, to) = (from.clamp(part.0, part.1), to.clamp(part.0, part.1));
    below_zero(first, (part.0, from), inside);
    below_zero(body, (from, to), inside);
    below_zero(last, (to, part.1), inside);
}

/// Where `a s² + 2 b s + c <= 0` between two values of `s`.
fn below_zero((a, b, c): (f32, f32, f32), (low, high): (f32, f32), found: &mut Vec<(f32, f32)>) {
    if low >= high {
        return;
    }
    let root = b * b - a * c;
    let mut cuts = [low, high, high, high];
    if root > 0.0 {
        // Without cancellation; what is not a number or beyond the ends cuts nothing.
        let q = if b >= 0.0 { -b - root.sqrt() } else { -b + root.sqrt() };
        let (x, y) = (q / a, c / q);
        let (x, y) = if x <= y { (x, y) } else { (y, x) };
        if x > low && x < high {
            cuts[1] = x;
        }
        if y > cuts[0] && y < high {
            cuts[if cuts[1] < high { 2 } else { 1 }] = y;
        }
    }
    for pair in cuts.windows(2) {
        let mid = (pair[0] + pair[1]) * 0.5;
        if pair[0] < pair[1] && (a * mid + 2.0 * b) * mid + c <= 0.0 {
            found.push((pair[0], pair[1]));
        }
    }
}

/// Points on the unit circle, turned by half a step so that none lies on an axis.
fn ring() -> &'static [(f32, f32); RING] {
    static POINTS: std::sync::LazyLock<[(f32, f32); RING]> = std::sync::LazyLock::new(|| {
        std::array::from_fn(|k| {
            let (sin, cos) = math::sin_cos((k as f32 + 0.5) * std::f32::consts::TAU / RING as f32);
            (cos, sin)
        })
    });
    &POINTS
}

#[cfg(test)]
mod tests {
    use super::super::capsules::{Touch, distance_squared};
    use super::*;
    use crate::base::Seed;
    use crate::plant::PlantBuilder;
    use crate::relate::random_plant::{Oddity, random_plant};

    const PAPER: FilterParams = FilterParams { collisions: 0.01, rise: 0.01, botany: 0.0 };

    /// Two limbs on a stem, the second through the first at right angles, of these radii.
    fn crossing(first: f32, second: f32, offset: f32) -> Plant {
        let mut builder = PlantBuilder::new();
        let points: Vec<Vec3> = (0..=8).map(|i| Vec3::Y * i as f32).collect();
        let stem = builder.stem(Vec3::ZERO, &points, &[0.1; 9]);
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 4.0], &[first; 2]);
        // Leaves the stem lower down, rises beside it and crosses the first limb 2 m out.
        let way = [Vec3::ZERO, Vec3::new(2.0, 0.0, -2.0), Vec3::new(2.0, 2.0 + offset, -2.0)];
        let way = [way[0], way[1], way[2], way[2] + Vec3::Z * 4.0];
        builder.branch(stem, 0.25, &way, &[second; 4]);
        builder.finish().unwrap()
    }

    fn measured(plant: &Plant) -> Vec<Collision> {
        collisions(plant, &plant.pose(), &[], &Habits::default(), &PAPER)
    }

    fn contacts_of_the_limbs(wood: &Wood) -> Vec<Contact> {
        let sections = Sections::of(wood);
        let touching: Vec<Touch> = sections.touching(wood).into_iter().filter(|t| t.chains == (1, 2)).collect();
        let mut found = Vec::new();
        sections.contacts(wood, &touching, &mut found);
        assert!(sections.at_most(wood, &touching, true) >= at_most(wood, &found, true));
        found
    }

    /// Area of the second limb's surface in the first: 8 r² for equal cylinders (half of Steinmetz' solid's).
    #[test]
    fn the_area_of_crossing_cylinders_is_that_of_the_textbook() {
        for radius in [0.05_f32, 0.1, 0.2] {
            let plant = crossing(radius, radius, 0.0);
            let posed = plant.pose();
            let wood = Wood::of(&plant, &posed);
            let pair = contacts_of_the_limbs(&wood);
            let area = intersected_area(&wood, &pair, true);
            let exact = 8.0 * radius * radius;
            assert!((area / exact - 1.0).abs() < 0.03, "{radius}: {area} {exact}");
            assert!(at_most(&wood, &pair, true) >= area);
        }
    }

    /// A thin limb through a thick one is inside for about twice the thick one's radius.
    #[test]
    fn a_thin_limb_through_a_thick_one_is_swallowed_for_its_width() {
        let plant = crossing(0.2, 0.01, 0.0);
        let wood = Wood::of(&plant, &plant.pose());
        let pair = contacts_of_the_limbs(&wood);
        let exact = std::f32::consts::TAU * 0.01 * 0.4;
        let area = intersected_area(&wood, &pair, false);
        assert!((area / exact - 1.0).abs() < 0.03, "{area} {exact}");
    }

    #[test]
    fn a_serious_collision_takes_the_branch_that_bears_less_and_a_near_miss_none() {
        // 8 r² against 2 π r · 4: 0.032 at r = 0.1, above 0.02 at scale 2.
        let found = measured(&crossing(0.1, 0.1, 0.0));
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].stays, found[0].goes, found[0].scale), (ChainId(2), ChainId(1), 2));
        assert!((found[0].ratio - 0.032).abs() < 0.002, "{found:?}");
        // Twigs of 3 cm: 0.0095.
        assert!(measured(&crossing(0.03, 0.03, 0.0)).is_empty());
        assert!(measured(&crossing(0.1, 0.1, 0.21)).is_empty());
    }

    /// Against all segments of all pairs of branches, without boxes, sections or bounds.
    #[test]
    fn no_serious_pair_is_lost_to_a_bound() {
        let mut met = 0;
        for s in 0..24 {
            let plant = random_plant(Seed::new(s), 60, if s % 4 == 3 { Oddity::Wild } else { Oddity::Tame });
            let wood = Wood::of(&plant, &plant.pose());
            let pair = |c: &Collision| (c.stays.0.min(c.goes.0) as usize, c.stays.0.max(c.goes.0) as usize);
            let mut found: Vec<(usize, usize)> = serious(&plant, &wood, &PAPER, &|_, _| 0.0).iter().map(pair).collect();
            found.sort_unstable();
            let segments = |chain: usize| wood.span(chain).skip(1).map(|i| i - 1);
            let thick = |i: usize| wood.radii[i].max(wood.radii[i + 1]);
            let apart = |i: usize, j: usize| {
                let p = &wood.points;
                distance_squared(p[i], p[i + 1], p[j], p[j + 1])
            };
            let mut all = Vec::new();
            for a in 0..plant.chains().len() {
                for b in a + 1..plant.chains().len() {
                    let touch = |i: usize, j: usize| apart(i, j) < (thick(i) + thick(j)) * (thick(i) + thick(j));
                    let of = |i: usize| segments(b).filter(move |&j| touch(i, j)).map(move |j| (i as u32, j as u32));
                    let contacts: Vec<Contact> =
                        segments(a).flat_map(of).map(|segments| Contact { segments }).collect();
                    let least = wood.surfaces[a].min(wood.surfaces[b]);
                    let limit = threshold(&PAPER, plant.chains()[a].order.max(plant.chains()[b].order)) * least;
                    if intersected_area(&wood, &contacts, wood.surfaces[a] <= wood.surfaces[b]) > limit && limit < least
                    {
                        all.push((a, b));
                    }
                }
            }
            met += all.len();
            assert_eq!(found, all, "seed {s}");
        }
        assert!(met > 20, "{met}");
    }

    #[test]
    fn thresholds_rise_with_scale() {
        assert_eq!(threshold(&PAPER, 1), 0.01);
        assert!((threshold(&PAPER, 4) - 0.04).abs() < 1e-7);
    }

    #[test]
    fn a_branch_that_runs_within_its_parent_collides_and_one_that_leaves_does_not() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 8.0], &[0.2, 0.2]);
        builder.branch(stem, 0.3, &[Vec3::ZERO, Vec3::new(0.05, 3.0, 0.0)], &[0.1, 0.1]);
        builder.branch(stem, 0.3, &[Vec3::ZERO, Vec3::new(0.0, 2.0, 2.0)], &[0.1, 0.1]);
        let found = measured(&builder.finish().unwrap());
        assert_eq!(found.iter().map(|c| (c.stays, c.goes)).collect::<Vec<_>>(), [(ChainId(0), ChainId(1))]);
    }

    #[test]
    fn a_swallowed_twin_goes_and_what_it_bears_is_not_settled_again() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 8.0], &[0.2, 0.2]);
        for _ in 0..2 {
            let limb = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 3.0], &[0.05, 0.05]);
            builder.branch(limb, 0.5, &[Vec3::ZERO, Vec3::X], &[0.02, 0.02]);
        }
        let found = measured(&builder.finish().unwrap());
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].stays, found[0].goes), (ChainId(1), ChainId(3)));
        assert!(found[0].ratio > 0.9);
    }

    #[test]
    fn stems_that_merge_may_lie_in_one_another_and_bear_limbs_through_each_other() {
        use crate::preset::plan::MatchParams;
        let plant = |stems: &[f32], thick: f32| {
            let mut builder = PlantBuilder::new();
            for x in stems {
                let way = [Vec3::ZERO, Vec3::Y * 4.0];
                let stem = builder.stem(Vec3::X * *x, &way, &[thick, thick]);
                builder.branch(stem, 0.8, &[Vec3::ZERO, Vec3::X * (0.5 - x.abs()) * 4.0], &[0.02, 0.02]);
            }
            builder.finish().unwrap()
        };
        let (shrub, tree) = (plant(&[-0.2, 0.0, 0.2], 0.05), plant(&[0.0], 0.3));
        let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
        let family = crate::relate::merged_family(shrub, tree, &matching).unwrap();
        let habits = Habits::of(&family, &PAPER);
        let (blend, kins) = family.blend_with_kins(&crate::blend::sample(&family, 0, 1, Seed::new(1), 0.8));
        let found = |kins: &[KinId]| collisions(&blend, &blend.pose(), kins, &habits, &PAPER).len();
        assert!(found(&[]) >= 2, "{}", found(&[]));
        assert_eq!(found(&kins), 0);
    }

    #[test]
    fn what_collides_in_a_source_may_collide_as_much_in_its_blends() {
        use crate::preset::plan::MatchParams;
        let plant = crossing(0.1, 0.1, 0.0);
        let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
        let family = crate::relate::fuzzy_family(plant.clone(), crossing(0.1, 0.1, 0.3), &matching).unwrap();
        let habits = Habits::of(&family, &PAPER);
        assert_eq!(habits.of_sources, [1, 0]);
        let (corner, kins) = family.blend_with_kins(&family.corner(0));
        assert!(corner == plant);
        assert!(collisions(&corner, &corner.pose(), &kins, &habits, &PAPER).is_empty());
    }
}
