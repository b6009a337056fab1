//! From sketches to a deformation: cages moved, lobes spread over what is drawn, branches bent after them, what lies
//! outside pruned. A sketch that is the crown's own silhouette changes nothing: lobes spread as far as the sketch differs
//! from it.

use std::sync::Arc;

use glam::{Vec2, Vec3};

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
use super::sketched::Sketched;
use super::spine::{Guided, Handle, Spines};
use super::stem::Leads;
use super::svg::{Drawing, SketchError};
use super::trim::{Field, trimmed};
use crate::base::math;
use crate::preset::plan::SketchRules;

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
    /// From where on they wilt, and count as covering what is drawn.
    pub rules: SketchRules,
}

impl<'d> Sketch<'d> {
    /// One drawing, as large as the crown, followed as presets do unless they tell otherwise.
    #[must_use]
    pub fn of(front: &'d Drawing) -> Self {
        Self { front, side: None, size: SketchSize::Crown, method: Method::Adaptive, rules: SketchRules::default() }
    }
}

/// How lobes follow a sketch. All but [`Adaptive`](Self::Adaptive) are the paper's: branches follow their tips alone and
/// without bounds, depth stays, and neither drawn trunks nor stems' feet hold anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By the multiscale cage tree whose cages adapt, at the rim by the outline itself, spread over what is drawn, pruned
    /// outside of it, within bounds that keep branches natural.
    Adaptive,
    /// The paper's: by the cage tree whose cages adapt, pruned outside of what is drawn (5.2 to 5.4).
    Paper,
    /// The same without pruning (Fig. 8): by the cage tree whose cages adapt (5.4.1).
    AdaptiveCages,
    /// By the cage tree alone: the paper's baseline (5.3, Fig. 6b).
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
        let adaptive = sketch.method == Method::Adaptive;
        if adaptive {
            lead(sketch.front, &front.placing, &self.charts[0]);
        }
        let mut targets = vec![front];
        if let (Some(chart), Some(side)) = (self.charts.get(1), sketch.side) {
            let target = self.target(chart, side, size, Some(targets[0].region.bounds()), false)?;
            if adaptive {
                lead(side, &target.placing, chart);
            }
            targets.push(target);
        }
        let guided = Guided { leads, standing: adaptive, bounded: adaptive };
        let chart = &self.charts[0];
        let front = &targets[0];
        let changed = self.changed(chart, front);
        let vertices = self.moved(chart, &front.ring, sketch, changed);
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
        let depth = self.depth(chart, &front.region, targets.len(), adaptive);
        let mut told: Vec<Vec3> = self
            .handles
            .iter()
            .zip(&seen)
            .zip(&chart.seen)
            .zip(&near)
            .map(|(((handle, is), was), near)| {
                let way = chart.plane.lifted(handle.position, *is - *was) + depth(handle.position) * *near;
                if adaptive { chart.plane.grounded(handle.position, way, self.floor()) } else { way }
            })
            .collect();
        let mut wilts = vec![false; self.plant.chains().len()];
        // Of the paper's pruning there is no limit.
        let rules = SketchRules { wilting: if adaptive { sketch.rules.wilting } else { 1.0 }, ..sketch.rules };
        let prunes = matches!(sketch.method, Method::Adaptive | Method::Paper);
        // What would have wilted beyond that.
        let mut spared = 0.0_f32;
        if prunes {
            spared = prune::pruned(self, chart, &vertices, &front.region, &near, &rules, &mut wilts);
        }
        if let (Some(chart), Some(side)) = (self.charts.get(1), targets.get(1)) {
            let changed = self.changed(chart, side);
            let vertices = self.moved(chart, &side.ring, sketch, changed);
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
                let shares = vec![changed; seen.len()];
                self.fill(chart, &side.region, &mut seen, &weights, &shares, Freedom::Level);
            }
            if prunes {
                let everywhere = vec![1.0; seen.len()];
                spared =
                    spared.max(prune::pruned(self, chart, &vertices, &side.region, &everywhere, &rules, &mut wilts));
            }
            for ((told, handle), (is, was)) in told.iter_mut().zip(&self.handles).zip(seen.iter().zip(&chart.seen)) {
                *told += chart.plane.lifted(handle.position, Vec2::new(is.x - was.x, 0.0));
            }
        }
        // Of a sketch that changes something.
        let drawn = shares.iter().any(|share| *share > 0.0).then(|| Field::of(&front.region, self.reach));
        if drawn.is_some() {
            leader::calm(self, chart, &mut told, &shares);
        }
        let shift = if adaptive {
            self.spines.moved(&self.positions, &told, &guided)
        } else {
            self.moved_by_tips(&told, &guided)
        };
        let (shift, likeness) = match &drawn {
            Some(drawn) => {
                spared = spared.max(prune::left_outside(self, chart, drawn, &shift, &near, &rules, &mut wilts));
                trimmed((self, &guided), chart, drawn, &wilts, &mut told, &shares, shift)
            }
            None => (shift, None),
        };
        // From above a drawing has no lowest.
        let low = (chart.plane.steepness() == 0.0).then(|| targets[0].region.bounds()[0].y);
        let as_large = |(target, chart): (Target, &Chart)| {
            let foot = self.fitted(chart, round).foot * (1.0 - scale);
            let ring = target.ring.iter().map(|p| *p * scale + foot).collect();
            (target.region.moved(Vec2::splat(scale), foot), (chart.root.clone(), ring))
        };
        let (targets, outlines) = targets.into_iter().zip(&self.charts).map(as_large).unzip();
        let (sketcher, along) = (self.clone(), Along::default());
        let made = Sketched {
            sketcher,
            shift,
            wilts,
            told,
            shares,
            along,
            guided,
            likeness,
            spared,
            scale,
            targets,
            outlines,
        };
        Ok(if drawn.is_some() { made.risen(low) } else { made })
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
    fn moved(&self, chart: &Chart, root: &[Vec2], sketch: &Sketch<'_>, changed: f32) -> Vec<Vec2> {
        let share = match sketch.method {
            Method::Adaptive => changed,
            // They adapt however little changes.
            Method::Paper | Method::AdaptiveCages => 1.0,
            Method::Baseline | Method::OneCage => 0.0,
        };
        chart.cages.moved(root, (share > 0.0).then_some((share, sketch.rules.covering * self.size)))
    }

    /// How every point moves when branches follow what their tips are told and nothing else (5.3, step 3).
    fn moved_by_tips(&self, told: &[Vec3], guided: &Guided) -> Vec<Vec3> {
        let is_tip = |i: &usize| self.handles.get(i + 1).is_none_or(|next| next.chain != self.handles[*i].chain);
        let tips: Vec<usize> = (0..self.handles.len()).filter(is_tip).collect();
        let handles: Vec<Handle> = tips.iter().map(|&i| self.handles[i]).collect();
        let told: Vec<Vec3> = tips.iter().map(|&i| told[i]).collect();
        Spines::bind(&self.plant, &self.plant.pose(), &handles).moved(&self.positions, &told, guided)
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
    fn depth(&self, chart: &Chart, target: &Region, views: usize, may: bool) -> impl Fn(Vec3) -> Vec3 + use<> {
        let scale = (target.area() / chart.area.max(1e-12)).sqrt().clamp(0.2, 4.0);
        let middle = self.positions.iter().fold(Vec3::ZERO, |s, p| s + *p) / self.positions.len().max(1) as f32;
        // What gets higher by it stays on the ground.
        let from = middle.with_y(self.foot.y);
        let (plane, grows) = (chart.plane, may && views == 1 && self.views.kind != ViewKind::FrontKept);
        move |p| match plane {
            ViewPlane::From { right, up } if grows => {
                let away = right.cross(up);
                away * (away.dot(p - from) * (scale - 1.0))
            }
            _ => Vec3::ZERO,
        }
    }
}

/// Lobes beside the silhouette are matched with the sketch's outline itself, and not by way of the cages between. Past the
/// paper, which has the vertices of cages that lie at covered segments as constraints (5.4.1) and no lobe that skips a
/// cage: it gives up the hierarchy at the rim for a crown that follows the outline there.
fn matched(chart: &Chart, ring: &[Vec2], seen: &mut [Vec2]) {
    let by_root = chart.handles_by_root(ring);
    for ((seen, by_root), rim) in seen.iter_mut().zip(by_root).zip(&chart.rim) {
        *seen = seen.lerp(by_root, *rim);
    }
}
