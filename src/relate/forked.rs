//! Trunks that fork above the ground, as stems of their own (2017 CAVW, 4.1, Fig. 2 and 10).
//!
//! The paper takes branches of a fork that are alike for one whorl of one order, the trunk's own way on among them, and splits a
//! trunk into them as into the stems of a shrub. Here a chain goes on through such a fork (`pattern.rs`), and the others are its
//! branches: one-to-one they would start as twigs high on another trunk and slide down it, which Section 7 holds against
//! Wang et al. 2016. So for matching and for what lies between, each of them is a stem: along the bole that they share, and on.
//! What splits, merges, bears and matches stems then does so for them. A view has the chains and leaves of its plant, of the same
//! ids and at the same places; the ends of the way are the sources as they are ([`Family::sources`]).
//!
//! A fork counts whose whorl (Eq. 1) has the stems' order and carries [`MAIN`] of what the trunk does half way up to it: forks
//! of a leader near its tip are no forks of the trunk, and a trunk that forks into two of its girth later is not made of a hundred.
//! Limits: a tip that ends in a fork has no way on, and stays what it is; two trees with as many stems, whose forks make as many of
//! them, are matched as they are.

use glam::Vec3;

use super::pattern::groups;
use super::{Family, KinId};
use crate::base::Frame;
use crate::plant::{ChainId, Curve, Leaf, Plant, PlantBuilder, Posed, STATIONS, carried, frame_at};
use crate::preset::plan::PatternParams;

/// Share of what a trunk carries half way up to a fork that the limbs of a main fork carry.
const MAIN: f64 = 0.5;

/// What a family's plants are views of.
#[derive(Clone, Debug)]
pub(super) struct Forked {
    /// The sources as they came.
    pub(super) sources: Vec<Plant>,
    /// By source and chain: up to where a stem is one with another, as an arc-length parameter.
    boles: Vec<Vec<f32>>,
}

/// Plants whose main limbs are stems, and what that was made of; none where it changes nothing for matching.
pub(super) fn viewed(plants: &[Plant], params: &PatternParams) -> Option<(Vec<Plant>, Forked)> {
    let views: Vec<Option<View>> = plants.iter().map(|plant| View::of(plant, params)).collect();
    let stems = |plant: &Plant| plant.chains().iter().filter(|chain| chain.parent.is_none()).count();
    let own: Vec<usize> = plants.iter().map(stems).collect();
    let seen: Vec<usize> =
        views.iter().zip(&own).map(|(v, own)| v.as_ref().map_or(*own, |v| stems(&v.plant))).collect();
    let same = |counts: &[usize]| counts.windows(2).all(|pair| pair[0] == pair[1]);
    if views.iter().all(Option::is_none) || same(&own) && same(&seen) {
        return None;
    }
    let (mut seen, mut boles) = (Vec::new(), Vec::new());
    for (plant, view) in plants.iter().zip(views) {
        let (view, bole) =
            view.map_or_else(|| (plant.clone(), vec![0.0; plant.chains().len()]), |view| (view.plant, view.boles));
        seen.push(view);
        boles.push(bole);
    }
    Some((seen, Forked { sources: plants.to_vec(), boles }))
}

impl Family {
    /// Whether the limbs of a main fork are stems on the way.
    #[must_use]
    pub(crate) fn has_forks(&self) -> bool {
        self.forked.is_some()
    }

    /// Up to where the stem that a source gives to a kin is one with another of it, as an arc-length parameter: the bole of a
    /// trunk that forks. 0 for all else.
    #[must_use]
    pub(crate) fn bole(&self, kin: KinId, source: usize) -> f32 {
        let bole = |chain: ChainId| self.forked.as_ref().map_or(0.0, |forked| forked.boles[source][chain.index()]);
        self.member(kin, source).map_or(0.0, bole)
    }
}

/// The way of a limb from the root on, in the world.
struct Line {
    points: Vec<Vec3>,
    radii: Vec<f32>,
    /// Arc-length parameter at which the limb leaves the bole.
    fork: f32,
}

/// A plant whose main limbs are stems.
struct View {
    plant: Plant,
    boles: Vec<f32>,
}

impl View {
    /// None where no trunk forks.
    fn of(plant: &Plant, params: &PatternParams) -> Option<Self> {
        let posed = plant.pose();
        let mut lines: Vec<Option<Line>> = plant.chain_ids().map(|_| None).collect();
        let mut boles = vec![0.0_f32; plant.chains().len()];
        for group in groups(plant, &posed, params) {
            let Some(parent) = group.parent.filter(|_| group.order == 1 && group.count > group.chains.len()) else {
                continue;
            };
            let line = &lines[parent.index()];
            if line.is_none() && plant.chain(parent).parent.is_some() {
                continue;
            }
            let (points, radii) = match line {
                Some(line) => (&line.points[..], &line.radii[..]),
                None => (posed.chain(plant, parent), plant.radii(parent)),
            };
            let bole = Curve::new(points);
            let along = |location: f32| along(line.as_ref(), location);
            let at = f64::from(along(group.location));
            let on = along((group.location + 0.02).min(1.0));
            let load = |radius: f32| carried(f64::from(radius));
            let limbs: f64 = group.chains.iter().map(|&limb| load(plant.radii(limb)[0])).sum();
            if limbs + load(bole.value(radii, f64::from(on))) < MAIN * load(bole.value(radii, at * 0.5)) {
                continue;
            }
            let made: Vec<(ChainId, Line)> = group
                .chains
                .iter()
                .map(|&limb| {
                    let at = f64::from(along(plant.chain(limb).location));
                    (limb, Line::through((points, radii), at, posed.chain(plant, limb), plant.radii(limb)))
                })
                .collect();
            boles[parent.index()] = boles[parent.index()].max(at as f32);
            for (limb, line) in made {
                boles[limb.index()] = line.fork;
                lines[limb.index()] = Some(line);
            }
        }
        lines.iter().any(Option::is_some).then(|| Self { plant: rooted(plant, &posed, &lines), boles })
    }
}

impl Line {
    /// Along a bole as far as `at`, and on along a limb.
    fn through((bole, bole_radii): (&[Vec3], &[f32]), at: f64, limb: &[Vec3], limb_radii: &[f32]) -> Self {
        let curve = Curve::new(bole);
        let below = curve.parameters().iter().take_while(|t| **t < at).count();
        let (mut points, mut radii) = (bole[..below].to_vec(), bole_radii[..below].to_vec());
        let girth = curve.value(bole_radii, at);
        points.push(limb[0]);
        radii.push(girth);
        // From the bole's girth to the limb's within a radius, as it comes out of it.
        let first = limb.get(1).map_or(0.0, |next| next.distance(limb[0]));
        let ease = (girth / first).min(0.5);
        if ease > 0.0 && first > 0.0 {
            points.push(limb[0].lerp(limb[1], ease));
            radii.push(limb_radii[0] + (limb_radii[1] - limb_radii[0]) * ease);
        }
        points.extend(&limb[1..]);
        radii.extend(&limb_radii[1..]);
        let (own, whole) = (Curve::new(limb).length(), Curve::new(&points).length());
        Self { fork: if whole > 0.0 { (1.0 - own / whole).clamp(0.0, 1.0) } else { 0.0 }, points, radii }
    }
}

/// Where on a limb's whole way a location of the limb is.
fn along(line: Option<&Line>, location: f32) -> f32 {
    line.map_or(location, |line| (line.fork + location * (1.0 - line.fork)).min(1.0))
}

/// The plant with some chains as stems; everything stays where it is in the world.
fn rooted(plant: &Plant, posed: &Posed, lines: &[Option<Line>]) -> Plant {
    let mut builder = PlantBuilder::new();
    let mut moved: Vec<bool> = Vec::with_capacity(lines.len());
    let mut frames: Vec<[Frame; STATIONS + 1]> = Vec::with_capacity(lines.len());
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let line = lines[id.index()].as_ref();
        let parent = chain.parent.filter(|_| line.is_none());
        let location = parent.map_or(0.0, |p| along(lines[p.index()].as_ref(), chain.location));
        let start = parent.map_or(Frame::WORLD, |p| frame_at(&frames[p.index()], location));
        let is_moved = line.is_some() || parent.is_some_and(|p| moved[p.index()]);
        let local: Vec<Vec3> = match line {
            Some(line) => line.points.iter().map(|p| *p - line.points[0]).collect(),
            None if is_moved => {
                let own = posed.chain(plant, id);
                own.iter().map(|p| start.to_local(*p - own[0])).collect()
            }
            None => plant.points(id).to_vec(),
        };
        let origin = line.map_or(chain.origin, |line| line.points[0]);
        let radii = line.map_or(plant.radii(id), |line| &line.radii);
        builder.chain(parent, location, origin, &local, radii);
        frames.push(Curve::new(&local).frames(start));
        moved.push(is_moved);
    }
    for leaf in plant.leaves() {
        let at = leaf.chain.index();
        builder.leaf(if moved[at] {
            let location = along(lines[at].as_ref(), leaf.location);
            let (before, after) = (posed.frame(leaf.chain, leaf.location), frame_at(&frames[at], location));
            let orientation = after.rotation().inverse().after(before.rotation()).after(leaf.orientation);
            Leaf { location, orientation, offset: after.to_local(before.to_world(leaf.offset)), ..*leaf }
        } else {
            *leaf
        });
    }
    builder.finish_trusted()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, math};
    use crate::blend::{Pace, morph, support_over_morph};
    use crate::preset::plan::MatchParams;
    use crate::relate::random_plant::{Oddity, random_plant};
    use crate::relate::{fuzzy_family, pattern_family};

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    fn out(i: usize, all: usize) -> Vec3 {
        let (sin, cos) = math::sin_cos(std::f32::consts::TAU * i as f32 / all as f32);
        Vec3::new(cos, 0.0, sin)
    }

    /// Adds limbs all round a chain.
    fn limbs(builder: &mut PlantBuilder, on: ChainId, count: usize, from: f32) {
        for k in 0..count {
            let way = out(k * 5, 13) * 1.5 + Vec3::Y * 0.5;
            let location = from + (0.95 - from) * k as f32 / count as f32;
            builder.branch(on, location, &[Vec3::ZERO, way * 0.5, way], &[0.04, 0.03, 0.012]);
        }
    }

    /// One trunk of 8 m with 24 limbs.
    fn single() -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0, Vec3::Y * 8.0], &[0.2, 0.11, 0.02]);
        limbs(&mut builder, stem, 24, 0.3);
        builder.finish().unwrap()
    }

    /// A bole of 1 m that forks into three stems that are alike, with eight limbs each.
    fn forked() -> Plant {
        let way = |i: usize| out(i, 3) * 2.5 + Vec3::Y * 6.5;
        let mut points = vec![Vec3::ZERO, Vec3::Y * 0.5, Vec3::Y];
        let mut radii = vec![0.2, 0.2, 0.2];
        for k in 0..=8 {
            points.push(Vec3::Y + way(0) * (0.02 + 0.98 * k as f32 / 8.0));
            radii.push(0.12 - 0.013 * k as f32);
        }
        let fork = 1.0 / (1.0 + way(0).length());
        let mut builder = PlantBuilder::new();
        let trunk = builder.stem(Vec3::ZERO, &points, &radii);
        let frame = builder.so_far().pose().frame(trunk, fork);
        for i in 1..3 {
            let limb: Vec<Vec3> = (0..=8).map(|k| frame.to_local(way(i) * (k as f32 / 8.0))).collect();
            builder.branch(trunk, fork, &limb, &radii[3..]);
        }
        for stem in 0..3 {
            limbs(&mut builder, ChainId(stem), 8, if stem == 0 { 0.4 } else { 0.3 });
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_trunk_hands_its_load_to_the_stems_of_a_fork_and_none_slides_down_it() {
        let (single, forked) = (single(), forked());
        for (from, to) in [(&single, &forked), (&forked, &single)] {
            let patterns = PatternParams::default();
            let family = pattern_family(from.clone(), to.clone(), &EVEN, &patterns).unwrap();
            assert!(family.blend(&family.corner(0)) == *from && family.blend(&family.corner(1)) == *to);
            let mut support = support_over_morph(&family, &Pace::of(&family), 40);
            let one = fuzzy_family(from.clone(), to.clone(), &EVEN).unwrap();
            let others = support_over_morph(&one, &Pace::even(), 40);
            assert!(others.iter().all(|load| *load == 1.0));
            // On the way, and where it ends: as many stems, all of them on the ground.
            let mut apart = Vec::new();
            for step in 1..40 {
                let tree = family.blend(&morph(&family, 0, 1, step as f32 / 40.0));
                let posed = tree.pose();
                let stems: Vec<ChainId> = tree.chain_ids().filter(|&id| tree.chain(id).parent.is_none()).collect();
                assert!(stems.len() == 3 && stems.iter().all(|&id| posed.chain(&tree, id)[0].length() < 1e-3));
                let tips: Vec<Vec3> = stems.iter().map(|&id| *posed.chain(&tree, id).last().unwrap()).collect();
                assert!(tips.iter().all(|tip| tip.y > 7.0), "{step}: {tips:?}");
                apart.push(tips[0].distance(tips[1]));
            }
            if from == &forked {
                support.reverse();
                apart.reverse();
            }
            assert!(support[0] > 0.99 && support[40] < 0.4 && support[39] < 0.4, "{support:?}");
            assert!(support.windows(2).all(|pair| pair[1] < pair[0] + 0.02), "{support:?}");
            assert!(apart.windows(2).all(|pair| pair[1] >= pair[0]) && apart[0] < 0.3 && apart[38] > 4.0, "{apart:?}");
        }
    }

    #[test]
    fn a_view_has_all_of_its_plant_where_it_was() {
        let patterns = PatternParams { angle: 3.0, radius: 5.0, ..PatternParams::default() };
        let mut viewed = 0;
        for seed in 0..60 {
            let plant = random_plant(Seed::new(seed), 60, Oddity::Tame);
            let Some(view) = View::of(&plant, &patterns) else { continue };
            viewed += 1;
            let (before, after) = (plant.pose(), view.plant.pose());
            assert_eq!(view.plant.chains().len(), plant.chains().len());
            for id in plant.chain_ids() {
                let (own, seen) = (before.chain(&plant, id), after.chain(&view.plant, id));
                // A stem's way ends with the limb's own.
                let tip = |k: usize| own[own.len() - 1 - k].distance(seen[seen.len() - 1 - k]);
                assert!((0..own.len() - 1).all(|k| tip(k) < 1e-3), "{seed} {id:?}");
            }
            for (own, seen) in plant.leaves().iter().zip(view.plant.leaves()) {
                let (own, seen) = (before.leaf(&plant, own), after.leaf(&view.plant, seen));
                assert!(own.position.distance(seen.position) < 1e-3 && own.frame.x.distance(seen.frame.x) < 1e-3);
            }
        }
        assert!(viewed > 20, "{viewed}");
    }

    #[test]
    fn ends_are_the_sources_whatever_forks_are_stems() {
        let patterns = PatternParams { angle: 3.0, radius: 5.0, ..PatternParams::default() };
        let mut seen = 0;
        for seed in 0..40 {
            let plant = |name| random_plant(Seed::new(seed).child(name), 50, Oddity::Wild);
            let (a, b) = (plant("a"), plant("b"));
            let family = pattern_family(a.clone(), b.clone(), &EVEN, &patterns).unwrap().pair_leaves(100).0;
            seen += usize::from(family.forked.is_some());
            assert!(family.sources() == [a.clone(), b.clone()]);
            let mut blender = crate::relate::Blender::new(&family);
            for (weights, wanted) in [(morph(&family, 0, 1, 0.0), &a), (morph(&family, 0, 1, 1.0), &b)] {
                let between = blender.blend(&morph(&family, 0, 1, 0.4));
                assert!(blender.blend(&weights) == *wanted, "{seed}");
                assert_eq!(blender.kins().len(), wanted.chains().len());
                assert!(blender.blend(&morph(&family, 0, 1, 0.4)) == between, "{seed}");
            }
        }
        assert!(seen > 10, "{seen}");
    }
}
