//! From sketches to a deformation: cages moved, lobes spread over what is drawn, branches bent after them, what lies
//! outside pruned; and the tree at any time on the way.
//!
//! In-betweens are straight ways of points (2018, 5.3: the transformation is interpolated), so their silhouettes lie near
//! the interpolated ones; where they don't, rims give way (`sketch/along.rs`). A sketch that is the crown's own silhouette changes nothing: lobes spread as far as the
//! sketch differs from it.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::adapt;
use super::along::Along;
use super::bound::{Chart, Sketcher, ViewKind};
use super::fill::{Basin, Freedom};
use super::fit::{Fitted, Placing, SketchSize, fitting, placed, placed_beside};
use super::frame::ViewPlane;
use super::leader;
use super::outline::{hull, replaced, resampled};
use super::part::Part;
use super::prune;
use super::region::{Fill, Region};
use super::spine::{Guided, arcs};
use super::stem::Leads;
use super::svg::{Drawing, SketchError};
use super::trim::trimmed;
use crate::base::{Frame, math};
use crate::plant::{Chain, ChainId, Curve, Leaf, Plant, PlantBuilder, STATIONS, frame_at};

/// Mean way of a silhouette's places, over the crown's size, from which lobes spread freely.
const CHANGED: f32 = 0.03;
/// Cells along the longest edge on which lobes spread, without detail and for all of it.
const CELLS: (f32, f32) = (40.0, 64.0);

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Sketch<'d> {
    /// From the front, or what is revolved.
    pub front: &'d Drawing,
    /// From the side, where the sketcher has that view.
    pub side: Option<&'d Drawing>,
    /// How large it is.
    pub size: SketchSize,
    /// How lobes follow it.
    pub method: Method,
}

/// How lobes follow a sketch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By the multiscale cage tree whose cages adapt, spread over what is drawn, pruned outside of it.
    Adaptive,
    /// By the cage tree whose cages adapt (5.4.1), and nothing else.
    AdaptiveCages,
    /// By the cage tree alone: the paper's baseline (5.3).
    Baseline,
    /// By one cage, the crown's silhouette: what the paper compares with (Fig. 12).
    OneCage,
}

/// What is drawn for one view.
struct Target {
    region: Region,
    /// The root cage for it.
    ring: Vec<Vec2>,
    /// How many of that one's places the sketch is about, and which part of the crown where that is not all.
    about: usize,
    part: Option<Part>,
    /// Where the drawing stands.
    placing: Placing,
}

/// A deformation that shapes a plant's crown.
#[derive(Clone, Debug)]
pub struct Sketched {
    pub(super) sketcher: Arc<Sketcher>,
    /// How every point moves until the end.
    pub(super) shift: Vec<Vec3>,
    wilts: Vec<bool>,
    /// What lobes were told, and how far the sketch differs from the crown about each: what in-betweens are found from.
    pub(super) told: Vec<Vec3>,
    shares: Vec<f32>,
    along: Along,
    /// Where a drawn trunk leads the stem.
    pub(super) guided: Guided,
    likeness: Option<f32>,
    /// How many times as large the whole tree gets about its foot, wood and leaves.
    scale: f32,
    /// What is drawn, in the plane of each view, metres.
    pub targets: Vec<Region>,
    /// For each view the outline of the crown as it was, and what becomes of each of its places.
    pub outlines: Vec<(Vec<Vec2>, Vec<Vec2>)>,
}

impl Sketcher {
    /// Finds the deformation for a sketch.
    ///
    /// # Errors
    ///
    /// When an open line is drawn where closed shapes are needed, a trunk where the view is not level, or nothing is.
    pub fn draw(self: &Arc<Self>, sketch: &Sketch<'_>) -> Result<Sketched, SketchError> {
        let round = self.views.kind.is_round();
        if sketch.front.trunk.area() > 0.0 && self.charts[0].plane.steepness() != 0.0 {
            return Err(SketchError::Raised { what: "a trunk" });
        }
        let (size, scale) = fitting(sketch.front, sketch.size, &self.fitted(&self.charts[0], round), round);
        let front = self.target(&self.charts[0], sketch.front, size, None, round)?;
        let mut leads = Leads::NONE;
        let mut lead = |drawing: &Drawing, placing: &Placing, chart: &Chart| {
            leads.add(drawing, placing, &chart.plane, chart.plane.seen(self.foot));
        };
        if sketch.method == Method::Adaptive {
            lead(sketch.front, &front.placing, &self.charts[0]);
        }
        let mut targets = vec![front];
        if let (Some(chart), Some(side)) = (self.charts.get(1), sketch.side) {
            let target = self.target(chart, side, size, Some(targets[0].region.bounds()), false)?;
            if sketch.method == Method::Adaptive {
                lead(side, &target.placing, chart);
            }
            targets.push(target);
        }
        let guided = Guided { leads, standing: sketch.method == Method::Adaptive };
        let chart = &self.charts[0];
        let adaptive = sketch.method == Method::Adaptive;
        let front = &targets[0];
        let changed = self.changed(chart, front);
        let vertices = self.moved(chart, &front.ring, sketch.method, changed);
        let mut seen = match sketch.method {
            Method::OneCage => chart.handles_by_root(&front.ring),
            _ => chart.handles(&vertices),
        };
        let weights: Vec<f32> = self.spread(chart);
        // How much the sketch acts about each lobe, and how far lobes spread there.
        let near: Vec<f32> = match &front.part {
            Some(part) if adaptive => chart.seen.iter().map(|p| part.at(*p)).collect(),
            _ => vec![1.0; chart.seen.len()],
        };
        let shares: Vec<f32> = near.iter().map(|near| if adaptive { changed * near } else { 0.0 }).collect();
        if adaptive {
            matched(chart, &front.ring, &mut seen);
            if front.part.is_some() {
                seen.iter_mut().zip(&chart.seen).zip(&near).for_each(|((is, was), near)| *is = was.lerp(*is, *near));
            }
            self.fill(chart, &front.region, &mut seen, &weights, &shares, Freedom::Plane);
        }
        let depth = self.depth(chart, &front.region, targets.len());
        let mut told: Vec<Vec3> = self
            .handles
            .iter()
            .zip(&seen)
            .zip(&chart.seen)
            .zip(&near)
            .map(|(((handle, is), was), near)| {
                let way = chart.plane.lifted(handle.position, *is - *was) + depth(handle.position) * *near;
                chart.plane.grounded(handle.position, way, self.floor())
            })
            .collect();
        let mut wilts = if adaptive { prune::pruned(self, chart, &vertices, &front.region, &near) } else { Vec::new() };
        wilts.resize(self.plant.chains().len(), false);
        if let (Some(chart), Some(side)) = (self.charts.get(1), targets.get(1)) {
            let changed = self.changed(chart, side);
            let vertices = self.moved(chart, &side.ring, sketch.method, changed);
            let by = if sketch.method == Method::OneCage {
                chart.handles_by_root(&side.ring)
            } else {
                chart.handles(&vertices)
            };
            // Heights are the front's; the side says how deep the crown is there.
            let mut seen: Vec<Vec2> =
                by.iter().zip(&self.handles).zip(&told).map(|((p, h), d)| Vec2::new(p.x, h.position.y + d.y)).collect();
            if adaptive {
                let heights: Vec<f32> = seen.iter().map(|p| p.y).collect();
                matched(chart, &side.ring, &mut seen);
                seen.iter_mut().zip(heights).for_each(|(p, y)| p.y = y);
                let everywhere = vec![1.0; seen.len()];
                let shares = vec![changed; seen.len()];
                self.fill(chart, &side.region, &mut seen, &weights, &shares, Freedom::Level);
                let outside = prune::pruned(self, chart, &vertices, &side.region, &everywhere);
                wilts.iter_mut().zip(outside).for_each(|(w, o)| *w |= o);
            }
            for ((told, handle), (is, was)) in told.iter_mut().zip(&self.handles).zip(seen.iter().zip(&chart.seen)) {
                *told += chart.plane.lifted(handle.position, Vec2::new(is.x - was.x, 0.0));
            }
        }
        let mut shares = shares;
        if adaptive && chart.plane.steepness() == 0.0 {
            leader::calm(self, chart, &front.region, &mut told, &shares);
            shares = leader::without_stems(self, shares);
        }
        let shift = self.spines.moved(&self.positions, &told, &guided);
        if adaptive {
            prune::left_outside(self, chart, &front.region, &shift, &near, &mut wilts);
        }
        let (shift, likeness) = trimmed((self, &guided), chart, &front.region, &wilts, &mut told, &shares, shift);
        let as_large = |(target, chart): (Target, &Chart)| {
            let foot = self.fitted(chart, round).foot * (1.0 - scale);
            let ring = target.ring.iter().map(|p| *p * scale + foot).collect();
            (target.region.moved(Vec2::splat(scale), foot), (chart.root.clone(), ring))
        };
        let (targets, outlines) = targets.into_iter().zip(&self.charts).map(as_large).unzip();
        let (sketcher, along) = (self.clone(), Along::default());
        Ok(Sketched { sketcher, shift, wilts, told, shares, along, guided, likeness, scale, targets, outlines })
    }

    /// The crown that drawings of a view are fitted to.
    fn fitted<'c>(&self, chart: &'c Chart, round: bool) -> Fitted<'c> {
        let seen = chart.plane.seen(self.foot);
        let foot = Vec2::new(if round { 0.0 } else { seen.x }, seen.y);
        let steepness = chart.plane.steepness().abs();
        let (low, height) = if steepness == 0.0 {
            (foot.y, self.height)
        } else {
            let seen = self.positions.iter().map(|p| chart.plane.seen(*p).y);
            let (low, high) = seen.fold((foot.y, foot.y), |(low, high), y| (low.min(y), high.max(y)));
            (low, high - low)
        };
        Fitted { outline: &chart.outline, area: chart.area, foot, low, height, steepness }
    }

    /// The lowest that lobes are brought in raised views, metres: their leaves end on the ground.
    pub(super) fn floor(&self) -> f32 {
        self.foot.y + self.reach
    }

    /// What is drawn in a view's plane.
    fn target(
        &self,
        chart: &Chart,
        drawing: &Drawing,
        size: SketchSize,
        front: Option<[Vec2; 2]>,
        round: bool,
    ) -> Result<Target, SketchError> {
        let fitted = self.fitted(chart, round);
        let count = chart.root.len();
        if drawing.is_open() {
            if round || front.is_some() {
                return Err(SketchError::Open);
            }
            let placing = placed(drawing, size, &fitted, false);
            let line = placing.line(&drawing.open);
            let made = replaced(&chart.outline, &line, count).ok_or(SketchError::Empty)?;
            let region = Region::of(std::slice::from_ref(&made.ring), Fill::NonZero);
            if region.area() <= chart.area * 1e-3 {
                return Err(SketchError::Empty);
            }
            let part = Some(Part::new(&made.part, &made.line, self.size));
            return Ok(Target { region, ring: made.places, about: made.gone, part, placing });
        }
        let placing = match front {
            Some(front) => placed_beside(drawing, front, size, &fitted),
            None => placed(drawing, size, &fitted, round),
        };
        let region = placing.region(&drawing.crown);
        let region = if round { region.mirrored() } else { region };
        if region.area().is_nan() || region.area() <= 0.0 {
            return Err(SketchError::Empty);
        }
        // Pieces that don't touch share what lies round them all.
        let outline = if region.largest() < region.area() * 0.9 {
            hull(&region.rings().concat())
        } else {
            region.outline().to_vec()
        };
        Ok(Target { region, ring: resampled(&outline, count), about: count, part: None, placing })
    }

    /// The vertices of a view's cages under a root, which `changed` as much.
    fn moved(&self, chart: &Chart, root: &[Vec2], method: Method, changed: f32) -> Vec<Vec2> {
        let adapts = matches!(method, Method::Adaptive | Method::AdaptiveCages) && changed > 0.0;
        chart.cages.moved(root, adapts.then_some((changed, adapt::NEAR * self.size)))
    }

    /// How much each handle covers.
    fn spread(&self, chart: &Chart) -> Vec<f32> {
        let reach = self.size * 0.1;
        let of = |(handle, seen): (&super::spine::Handle, &Vec2)| match chart.plane {
            // A ring far from the axis is longer.
            ViewPlane::Round { .. } => handle.weight / (seen.x + reach),
            ViewPlane::From { .. } => handle.weight,
        };
        self.handles.iter().zip(&chart.seen).map(of).collect()
    }

    fn fill(
        &self,
        chart: &Chart,
        target: &Region,
        seen: &mut [Vec2],
        weights: &[f32],
        shares: &[f32],
        freedom: Freedom,
    ) {
        if shares.iter().all(|share| *share <= 1e-6) {
            return;
        }
        let cells = CELLS.0 + (CELLS.1 - CELLS.0) * self.views.detail.clamp(0.0, 1.0);
        let basin = Basin::new(target, self.reach, cells as usize);
        let mut spread = seen.to_vec();
        basin.fill(&mut spread, weights, freedom);
        let round = matches!(chart.plane, ViewPlane::Round { .. });
        for ((seen, to), share) in seen.iter_mut().zip(spread).zip(shares) {
            let to = if round { Vec2::new(to.x.max(0.0), to.y) } else { to };
            *seen = seen.lerp(to, *share);
        }
    }

    /// How much a sketch differs from the crown where it acts, 0..=1: what a sketch that is the crown's own outline leaves
    /// undone.
    fn changed(&self, chart: &Chart, target: &Target) -> f32 {
        let ways = target.ring.iter().zip(&chart.root).map(|(a, b)| a.distance(*b));
        let way = ways.sum::<f32>() / target.about.max(1) as f32;
        math::smoothstep(0.0, CHANGED * self.size, way)
    }

    /// How depth follows a single view: as much as the crown grows in it, unless it is kept.
    fn depth(&self, chart: &Chart, target: &Region, views: usize) -> impl Fn(Vec3) -> Vec3 + use<> {
        let scale = (target.area() / chart.area.max(1e-12)).sqrt().clamp(0.2, 4.0);
        let middle = self.positions.iter().fold(Vec3::ZERO, |s, p| s + *p) / self.positions.len().max(1) as f32;
        // What gets higher by it stays on the ground.
        let from = middle.with_y(self.foot.y);
        let (plane, grows) = (chart.plane, views == 1 && self.views.kind != ViewKind::FrontKept);
        move |p| match plane {
            ViewPlane::From { right, up } if grows => {
                let away = right.cross(up);
                away * (away.dot(p - from) * (scale - 1.0))
            }
            _ => Vec3::ZERO,
        }
    }
}

impl Sketched {
    /// How many branches wilt, and how many there are.
    #[must_use]
    pub fn wilting(&self) -> (usize, usize) {
        (self.wilts.iter().filter(|w| **w).count(), self.wilts.len())
    }

    /// What the crown's silhouette and the sketch from the front have in common over what either covers, 0..=1; none of crowns without leaves
    /// and of sketches that change nothing.
    #[must_use]
    pub const fn likeness(&self) -> Option<f32> {
        self.likeness
    }

    /// For each branch that stays: how much longer it gets; how far it turns, radians; and how much further than its
    /// neighbours do, parent and next siblings, radians.
    #[must_use]
    pub fn strains(&self) -> Vec<[f32; 3]> {
        let strains = self.sketcher.spines.strains(&self.sketcher.positions, &self.shift);
        let turns: Vec<f32> = strains.iter().map(|s| s.1).collect();
        let beyond = |i: usize| {
            let most = self.sketcher.spines.most_of_neighbours(i, &turns);
            most.map_or(0.0, |most| (turns[i] - most).max(0.0))
        };
        let stay = (0..strains.len()).filter(|i| !self.wilts[*i]);
        stay.map(|i| [strains[i].0, strains[i].1, beyond(i)]).collect()
    }

    /// The same with in-betweens whose crowns follow the interpolated silhouette more closely than straight ways do
    /// (2018, Fig. 11). Takes some twenty drawings of the tree; both ends stay as they are.
    #[must_use]
    pub fn following(mut self) -> Self {
        self.along = Along::of(&self, &self.told, &self.shares);
        self
    }

    /// The tree at a time 0..=1: at 0 the plant as it was, at 1 as sketched, without what wilts.
    #[must_use]
    pub fn at(&self, t: f32) -> Plant {
        if t.is_nan() || t <= 0.0 {
            return (*self.sketcher.plant).clone();
        }
        self.on_the_way(t.min(1.0), t >= 1.0)
    }

    /// The tree at a time, with all branches and leaves it ever has: those that have wilted are as good as without size.
    #[must_use]
    pub fn key(&self, t: f32) -> Plant {
        self.on_the_way(t.clamp(0.0, 1.0), false)
    }

    /// The tree at a time when every point goes a straight way.
    pub(super) fn straight(&self, t: f32) -> Plant {
        self.made(&|i| self.shift[i] * t, t, t >= 1.0)
    }

    fn on_the_way(&self, t: f32, finished: bool) -> Plant {
        let weights = Along::weights(t);
        self.made(&|i| self.shift[i] * t + self.along.at(i, &weights), t, finished)
    }

    /// What bends between lobes stays above the ground where they do, and limbs in a level view, where lobes may be drawn to hang below it,
    /// above the lowest of them and their own base: in a narrow foot of a crown a trunk dived into the ground and came out again, and limbs
    /// went on far below the crown. Nothing is brought higher than it was by that. And no limb sags deeper below the straight way to its
    /// first lobe than it did: base and lobe go ways of their own, and what is between followed each for a while.
    fn keep_up(&self, places: &mut [Vec3], t: f32) {
        let Sketcher { plant, positions, spines, handles, charts, foot, .. } = &*self.sketcher;
        let (stems, limbs) = if charts[0].plane.steepness() == 0.0 {
            let lobes = handles.iter().zip(&self.told).map(|(handle, way)| handle.position.y + way.y * t);
            let lowest = lobes.fold(f32::INFINITY, f32::min);
            (foot.y.min(lowest), lowest)
        } else {
            (foot.y, foot.y)
        };
        for id in plant.chain_ids() {
            let span = plant.span(id);
            // Its bearer is where it stays.
            let floor = spines.base(id.index()).map_or(stems, |(point, f)| {
                let below = places[point as usize];
                let base = if f == 0.0 { below } else { below.lerp(places[point as usize + 1], f) };
                limbs.min(base.y)
            });
            for i in span.clone() {
                places[i].y = places[i].y.max(floor.min(positions[i].y));
            }
            let lobe = spines.first_handle(id.index()).filter(|_| plant.chain(id).parent.is_some());
            if let Some(lobe) = lobe {
                tighten(&mut places[span.clone()], &positions[span], handles[lobe].arc);
            }
        }
    }

    /// The tree when points have moved, and what wilts has done so for a time.
    pub(super) fn made(&self, moved: &(dyn Fn(usize) -> Vec3 + Sync), t: f32, finished: bool) -> Plant {
        let Sketcher { plant, positions, spines, leaves, foot, .. } = &*self.sketcher;
        let place = |(i, p): (usize, &Vec3)| *p + moved(i);
        let mut places: Vec<Vec3> = positions.par_iter().enumerate().with_min_len(4096).map(place).collect();
        self.keep_up(&mut places, t);
        let left = (1.0 - t).max(1e-4);
        let scale = 1.0 + (self.scale - 1.0) * t;
        let mut bears = vec![false; plant.chains().len()];
        plant.chains().iter().filter_map(|c| c.parent).for_each(|p| bears[p.index()] = true);
        // Where on the bent axis each point lies, 0..=1; base and whole length for each chain.
        let arc = arc_shares(plant, &places);
        let on = |(i, f): (u32, f32)| {
            let (a, b) = (arc[i as usize], arc.get(i as usize + 1).copied().unwrap_or(1.0));
            (if f == 0.0 { a } else { a + (b - a) * f }).clamp(0.0, 1.0)
        };
        let mut frames: Vec<[Frame; STATIONS + 1]> = Vec::with_capacity(plant.chains().len());
        let mut builder = PlantBuilder::reusing(
            Plant::default(),
            plant.chains().len(),
            plant.all_points().len(),
            plant.leaves().len(),
        );
        let mut named: Vec<Option<ChainId>> = Vec::with_capacity(plant.chains().len());
        let (mut local, mut radii) = (Vec::new(), Vec::new());
        let nothing = [Frame::WORLD; STATIONS + 1];
        for id in plant.chain_ids() {
            let i = id.index();
            let Chain { origin, parent, .. } = *plant.chain(id);
            let wilts = self.wilts[i];
            if wilts && finished {
                frames.push(nothing);
                named.push(None);
                continue;
            }
            let location = spines.base(i).map_or(0.0, on);
            let frame = parent.map_or(Frame::WORLD, |p| frame_at(&frames[p.index()], location));
            let own = &places[plant.span(id)];
            let size = if wilts { left * scale } else { scale };
            local.clear();
            local.extend(own.iter().map(|p| frame.to_local(*p - own[0]) * size));
            radii.clear();
            radii.extend(plant.radii(id).iter().map(|r| r * size));
            frames.push(if bears[i] { Curve::new(&local).frames(frame) } else { nothing });
            let parent = parent.and_then(|p| named[p.index()]);
            let origin = if scale == 1.0 { origin } else { *foot + (origin - foot) * scale };
            named.push(Some(builder.chain(parent, location, origin, &local, &radii)));
        }
        for (leaf, place) in plant.leaves().iter().zip(leaves) {
            if let Some(chain) = named[leaf.chain.index()] {
                let size = if self.wilts[leaf.chain.index()] { left * scale } else { scale };
                builder.leaf(Leaf {
                    chain,
                    location: on(*place),
                    size: leaf.size * size,
                    offset: leaf.offset * size,
                    ..*leaf
                });
            }
        }
        builder.finish_trusted()
    }
}

/// Lobes beside the silhouette are matched with the sketch's outline itself, and not by way of the cages between: the
/// vertices that lie at covered segments are the paper's constraints (5.4.1).
fn matched(chart: &Chart, ring: &[Vec2], seen: &mut [Vec2]) {
    let by_root = chart.handles_by_root(ring);
    for ((seen, by_root), rim) in seen.iter_mut().zip(by_root).zip(&chart.rim) {
        *seen = seen.lerp(by_root, *rim);
    }
}

/// Lets what lies before an arc length of a branch, as it was, sag no deeper below the straight way there than it did.
fn tighten(places: &mut [Vec3], were: &[Vec3], until: f64) {
    let arcs = arcs(were);
    let end = arcs.partition_point(|arc| *arc < until).min(arcs.len() - 1);
    let (from, to) = ([were[0].y, places[0].y], [were[end].y, places[end].y]);
    for i in 1..end {
        let share = (arcs[i] / arcs[end]) as f32;
        let [was, is] = [0, 1].map(|k| from[k] + (to[k] - from[k]) * share);
        places[i].y = places[i].y.max(is + (were[i].y - was).min(0.0));
    }
}

/// For each point its share of its chain's length, 0..=1.
fn arc_shares(plant: &Plant, places: &[Vec3]) -> Vec<f32> {
    let mut arc = vec![0.0_f32; places.len()];
    for id in plant.chain_ids() {
        let span = plant.span(id);
        let mut length = 0.0_f64;
        for i in span.clone().skip(1) {
            length += f64::from(places[i].distance(places[i - 1]));
            arc[i] = length as f32;
        }
        if length > 0.0 {
            arc[span.clone()].iter_mut().for_each(|a| *a = (f64::from(*a) / length) as f32);
        } else {
            let last = span.len().max(2) - 1;
            arc[span].iter_mut().enumerate().for_each(|(k, a)| *a = k as f32 / last as f32);
        }
    }
    arc
}
