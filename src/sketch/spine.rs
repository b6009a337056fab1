//! Branches under their cages: how each follows its base and its handles, and how far (2018, 5.3, step 3).
//!
//! A handle is a place on a branch that a cage moves: the tip, and places between on long ones. A branch takes its base
//! from its parent (forwards) and what its handles do back to its base (backwards), by the weights of `sketch/laplace.rs`.
//!
//! Two bounds keep branches natural. No branch gets longer than [`STRETCH`] times, and none turns further than its
//! neighbours: beyond [`TURN`] more than the most of parent and next siblings. A branch that would only follows its
//! handles so far. Where a trunk is drawn, stems stand on it (`sketch/stem.rs`) whatever handles do. Past the paper, stems
//! leave the ground as they did before: by the weights alone a lobe to one side turned the whole bole, the foot with it, by up
//! to 38 degrees; nor is a step of a stem pressed together to less than half, or half of what is left of a stem that gets shorter. Branches make up for what stems hang back, since each goes where its own handles are told.

use glam::Vec3;

use super::bound::thickest_stem;
use super::laplace;
use super::stem::Leads;
use crate::base::math;
use crate::plant::{ChainId, Plant, Posed};

/// How much longer a branch may get, beyond what the whole tree does.
const STRETCH: f32 = 2.3;
/// What a branch may turn more than its neighbours, radians.
const TURN: f32 = 0.2;
/// What any branch may turn, radians.
const MOST_TURN: f32 = 1.5;
/// Siblings on either side that count as neighbours.
pub(super) const SIBLINGS: usize = 3;
/// Of a stem's length from its foot up, how much of it hangs back behind its handles.
const FOOT: f32 = 0.6;
/// What at least is left of the length of each step along a stem; of one that gets shorter, that part of what is left of all.
pub(super) const PRESSED: f32 = 0.5;
/// Shares of its handles' way that are tried for a branch beyond a bound.
const SHARES: [f32; 7] = [1.0, 0.8, 0.6, 0.45, 0.3, 0.15, 0.0];

/// A place that cages move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Handle {
    /// Its branch.
    pub(super) chain: ChainId,
    /// Where it is, metres.
    pub(super) position: Vec3,
    /// Arc length from its branch's base, metres.
    pub(super) arc: f64,
    /// How much foliage is about it.
    pub(super) weight: f32,
}

/// A branch.
#[derive(Clone, Copy, Debug)]
struct Spine {
    /// The point of the parent before its base, and the share of the way to the next; none for a stem.
    base: Option<(u32, f32)>,
    /// Its points.
    first: u32,
    len: u32,
    /// Its handles.
    handle: u32,
    handles: u32,
    /// Weights of its points: `1 + handles` each.
    weights: u32,
}

/// What branches follow beside their handles.
#[derive(Clone, Debug)]
pub(super) struct Guided {
    /// Where stems are led.
    pub(super) leads: Leads,
    /// Whether stems keep the direction that they have at the foot.
    pub(super) standing: bool,
    /// Whether branches keep within their bounds, and above the ground: past the paper.
    pub(super) bounded: bool,
}

/// All branches of a plant, bound to handles.
#[derive(Clone, Debug)]
pub(super) struct Spines {
    spines: Vec<Spine>,
    /// The thickest stem.
    stem: usize,
    weights: Vec<f32>,
    /// The neighbours of each branch: `neighbours[first[i]..first[i + 1]]`.
    first: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Spines {
    /// Binds a plant's branches to handles, which stand in order of their chains and along them.
    pub(super) fn bind(plant: &Plant, posed: &Posed, handles: &[Handle]) -> Self {
        let stem = thickest_stem(plant).map_or(0, ChainId::index);
        let mut made =
            Self { spines: Vec::new(), stem, weights: Vec::new(), first: Vec::new(), neighbours: Vec::new() };
        let mut next = 0;
        for id in plant.chain_ids() {
            let first = next;
            while handles.get(next).is_some_and(|h| h.chain == id) {
                next += 1;
            }
            let arc = arcs(posed.chain(plant, id));
            let along: Vec<f64> = handles[first..next].iter().map(|h| h.arc).collect();
            let chain = plant.chain(id);
            let base = chain.parent.map(|parent| {
                let (segment, f) = posed.curve(plant, parent).segment(f64::from(chain.location));
                ((plant.span(parent).start + segment) as u32, f)
            });
            let span = plant.span(id);
            made.spines.push(Spine {
                base,
                first: span.start as u32,
                len: span.len() as u32,
                handle: first as u32,
                handles: (next - first) as u32,
                weights: made.weights.len() as u32,
            });
            made.weights.extend(laplace::weights(&arc, &along));
        }
        let children = plant.children();
        let mut stems = Vec::new();
        let mut place = vec![0_u32; plant.chains().len()];
        let mut sorted = children;
        for id in plant.chain_ids() {
            if plant.chain(id).parent.is_none() {
                stems.push(id);
            }
            let list = &mut sorted[id.index()];
            list.sort_by(|a, b| plant.chain(*a).location.total_cmp(&plant.chain(*b).location).then(a.cmp(b)));
            list.iter().enumerate().for_each(|(k, c)| place[c.index()] = k as u32);
        }
        stems.iter().enumerate().for_each(|(k, c)| place[c.index()] = k as u32);
        for id in plant.chain_ids() {
            made.first.push(made.neighbours.len() as u32);
            let parent = plant.chain(id).parent;
            let siblings = parent.map_or(&stems, |p| &sorted[p.index()]);
            let k = place[id.index()] as usize;
            let near = &siblings[k.saturating_sub(SIBLINGS)..(k + SIBLINGS + 1).min(siblings.len())];
            made.neighbours.extend(near.iter().filter(|c| **c != id).map(|c| c.0));
            made.neighbours.extend(parent.map(|p| p.0));
        }
        made.first.push(made.neighbours.len() as u32);
        made
    }

    /// How every point moves when handles move by `handles`; `positions` is where points are.
    pub(super) fn moved(&self, positions: &[Vec3], handles: &[Vec3], guided: &Guided) -> Vec<Vec3> {
        let none = vec![f32::INFINITY; self.spines.len()];
        let free = self.passed(positions, handles, &none, guided);
        if !guided.bounded {
            return free;
        }
        let turns: Vec<f32> = self.spines.iter().map(|s| s.turn(positions, &free)).collect();
        // Turns fall to what neighbours allow; neighbours' fall in turn.
        let mut bounds: Vec<f32> = turns.iter().map(|t| t.min(MOST_TURN)).collect();
        for _ in 0..4 {
            let before = bounds.clone();
            for (i, bound) in bounds.iter_mut().enumerate() {
                let near = &self.neighbours[self.first[i] as usize..self.first[i + 1] as usize];
                if !near.is_empty() {
                    let most = near.iter().map(|n| before[*n as usize]).fold(0.0, f32::max);
                    *bound = bound.min(most + TURN);
                }
            }
        }
        let mut shift = self.passed(positions, handles, &bounds, guided);
        // Where a neighbour is held back by its length, its turn is less than its bound.
        for _ in 0..6 {
            let turns: Vec<f32> = self.spines.iter().map(|s| s.turn(positions, &shift)).collect();
            let mut tighter = false;
            for (i, bound) in bounds.iter_mut().enumerate() {
                let allowed = self.most_of_neighbours(i, &turns).map_or(MOST_TURN, |most| most + TURN);
                tighter |= turns[i] > allowed + 1e-3;
                *bound = bound.min(allowed);
            }
            if !tighter {
                break;
            }
            shift = self.passed(positions, handles, &bounds, guided);
        }
        shift
    }

    /// From stems to twigs, each within its bound of turning.
    fn passed(&self, positions: &[Vec3], handles: &[Vec3], bounds: &[f32], guided: &Guided) -> Vec<Vec3> {
        let mut shift = vec![Vec3::ZERO; positions.len()];
        let mut own: Vec<Vec3> = Vec::new();
        let is_led = !guided.leads.is_empty() && self.stem < self.spines.len();
        // Where its points are, and how they move once that is known.
        let led = if is_led { &positions[self.spines[self.stem].span()] } else { &[] };
        let mut led_by: Vec<Vec3> = Vec::new();
        // The stem that is led comes first, since others go along with it.
        let order = std::iter::once(self.stem).filter(|_| is_led);
        for s in order.chain((0..self.spines.len()).filter(|&s| !is_led || s != self.stem)) {
            let spine = &self.spines[s];
            let base = spine.base.map_or(Vec3::ZERO, |(i, f)| {
                let (a, b) = (shift[i as usize], shift.get(i as usize + 1).copied().unwrap_or_default());
                if f == 0.0 { a } else { a + (b - a) * f }
            });
            let (first, len) = (spine.first as usize, spine.len as usize);
            let columns = spine.handles as usize + 1;
            let weights = &self.weights[spine.weights as usize..][..len * columns];
            let told = &handles[spine.handle as usize..][..columns - 1];
            own.clear();
            own.extend(weights.chunks_exact(columns).map(|w| {
                // What it does beyond its base.
                w[1..].iter().zip(told).fold(Vec3::ZERO, |sum, (w, d)| sum + (*d - base) * *w)
            }));
            let at = &positions[first..first + len];
            if spine.base.is_none() && guided.standing {
                stand(at, &mut own);
            }
            let leads = |place: Vec3, moved: Vec3| match &guided.leads {
                _ if !is_led || spine.base.is_some() => Vec3::ZERO,
                leads if s == self.stem => leads.onto(place + moved),
                leads => leads.along((place + moved).y, moved, with(led, &led_by, place.y)),
            };
            own.iter_mut().zip(at).for_each(|(own, at)| *own += leads(*at, *own));
            let bound = *bounds.get(s).unwrap_or(&0.0);
            let may = |share: f32| !guided.bounded || share == 0.0 || is_natural(at, &own, share, bound);
            let share = SHARES.into_iter().find(|&share| may(share)).unwrap_or(0.0);
            for (k, d) in own.iter().enumerate() {
                let moved = base + *d * share;
                shift[first + k] = moved + leads(at[k], moved);
            }
            // Its base stays on its parent.
            shift[first] = base;
            if is_led && s == self.stem {
                led_by = shift[first..first + len].to_vec();
            }
        }
        shift
    }

    /// How much longer each branch gets, and how far it turns in radians, when points move so.
    pub(super) fn strains(&self, positions: &[Vec3], shift: &[Vec3]) -> Vec<(f32, f32)> {
        self.spines.iter().map(|s| (s.stretch(positions, shift), s.turn(positions, shift))).collect()
    }

    /// The most that parent and next siblings have of a value.
    pub(super) fn most_of_neighbours(&self, chain: usize, values: &[f32]) -> Option<f32> {
        let near = &self.neighbours[self.first[chain] as usize..self.first[chain + 1] as usize];
        near.iter().map(|n| values[*n as usize]).reduce(f32::max)
    }

    /// The first handle of a branch that has any.
    pub(super) fn first_handle(&self, chain: usize) -> Option<usize> {
        let Spine { handle, handles, .. } = self.spines[chain];
        (handles > 0).then_some(handle as usize)
    }

    /// The point of the parent before a branch's base, and the share of the way to the next.
    pub(super) fn base(&self, chain: usize) -> Option<(u32, f32)> {
        self.spines[chain].base
    }
}

impl Spine {
    fn span(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.len) as usize
    }

    fn turn(&self, positions: &[Vec3], shift: &[Vec3]) -> f32 {
        let (a, b) = (self.span().start, self.span().end - 1);
        let was = positions[b] - positions[a];
        math::angle(was, was + shift[b] - shift[a])
    }

    fn stretch(&self, positions: &[Vec3], shift: &[Vec3]) -> f32 {
        let (mut was, mut is) = (0.0, 0.0);
        for i in self.span().skip(1) {
            let step = positions[i] - positions[i - 1];
            was += step.length();
            is += (step + shift[i] - shift[i - 1]).length();
        }
        if was > 1e-6 { is / was } else { 1.0 }
    }
}

/// Lets a stem leave its foot as it did before: there points move along their line from the foot only, farther up more and
/// more as handles have them.
fn stand(points: &[Vec3], own: &mut [Vec3]) {
    let length: f32 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let (foot, last, mut arc) = (points[0], points.len() - 1, 0.0);
    // A stem that gets shorter as a whole does so all along.
    let whole = points[last] - foot;
    let pressed = PRESSED * ((whole + own[last]).length() / whole.length().max(1e-6)).min(1.0);
    for i in 1..points.len() {
        arc += points[i].distance(points[i - 1]);
        let from = points[i] - foot;
        let along = from * (own[i].dot(from) / from.length_squared().max(1e-12));
        own[i] = along.lerp(own[i], math::smoothstep(0.0, FOOT * length.max(1e-6), arc));
        // A crown that comes farther down presses its bole together, but not into a foot that lies on the ground.
        let step = points[i] - points[i - 1];
        let up = step.normalize_or_zero();
        let lacks = pressed * step.length() - (step + own[i] - own[i - 1]).dot(up);
        own[i] += up * lacks.max(0.0);
    }
}

/// Whether a branch that follows its handles by a share is within its bounds.
fn is_natural(points: &[Vec3], own: &[Vec3], share: f32, turn: f32) -> bool {
    let last = points.len() - 1;
    let was = points[last] - points[0];
    let is = was + own[last] * share;
    // The angle's cosine is enough; turns within it are the most.
    if turn < std::f32::consts::PI && math::angle(was, is) > turn + 1e-4 {
        return false;
    }
    let (mut before, mut after) = (0.0, 0.0);
    for i in 1..points.len() {
        let step = points[i] - points[i - 1];
        before += step.length();
        let d = if i == 1 { own[1] } else { own[i] - own[i - 1] };
        after += (step + d * share).length();
    }
    after <= before * STRETCH
}

/// How a stem moves at the height at which another has a point.
fn with(points: &[Vec3], shift: &[Vec3], height: f32) -> Vec3 {
    let Some(above) = points.iter().position(|p| p.y >= height) else {
        return shift.last().copied().unwrap_or_default();
    };
    let below = above.saturating_sub(1);
    let rise = points[above].y - points[below].y;
    let f = if rise > 0.0 { ((height - points[below].y) / rise).clamp(0.0, 1.0) } else { 0.0 };
    shift[below].lerp(shift[above], f)
}

/// Arc length at each point of a polyline.
pub(super) fn arcs(points: &[Vec3]) -> Vec<f64> {
    let mut length = 0.0;
    let steps = points.windows(2).map(|pair| f64::from(pair[0].distance(pair[1])));
    std::iter::once(0.0)
        .chain(steps.map(|step| {
            length += step;
            length
        }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};

    const FREE: Guided = Guided { leads: Leads::NONE, standing: false, bounded: true };

    fn bound(seed: u64) -> (Plant, Posed, Vec<Handle>, Spines) {
        let plant = random_plant(Seed::new(seed), 60, Oddity::Tame);
        let posed = plant.pose();
        let handles: Vec<Handle> = plant
            .chain_ids()
            .map(|id| {
                let points = posed.chain(&plant, id);
                let arc = arcs(points);
                Handle { chain: id, position: points[points.len() - 1], arc: arc[arc.len() - 1], weight: 1.0 }
            })
            .collect();
        let spines = Spines::bind(&plant, &posed, &handles);
        (plant, posed, handles, spines)
    }

    #[test]
    fn tips_go_where_they_are_told_when_all_of_the_tree_is_widened_a_little() {
        let (plant, posed, handles, spines) = bound(1);
        let told: Vec<Vec3> = handles.iter().map(|h| h.position * 0.1).collect();
        let shift = spines.moved(posed.positions(), &told, &FREE);
        for (handle, told) in handles.iter().zip(&told) {
            let tip = plant.span(handle.chain).end - 1;
            assert!(shift[tip].distance(*told) < 1e-3);
        }
    }

    #[test]
    fn a_stem_that_is_told_to_sink_is_not_pressed_into_its_foot() {
        let points: Vec<Vec3> = (0..8).map(|i| Vec3::Y * i as f32).collect();
        // Lower lobes are told to sink by two metres and three, upper ones to rise again.
        let mut own: Vec<Vec3> =
            (0..8).map(|i| Vec3::new(0.2 * i as f32, [0.0, -2.0, -3.0, -2.0, -1.0, 0.0, 0.5, 1.0][i], 0.0)).collect();
        stand(&points, &mut own);
        let at: Vec<Vec3> = points.iter().zip(&own).map(|(p, d)| *p + *d).collect();
        assert!(at[0] == Vec3::ZERO && at.windows(2).all(|pair| pair[1].y - pair[0].y > PRESSED - 1e-4), "{at:?}");
        // What does rise is where it is told.
        assert!((at[7].y - 8.0).abs() < 1e-4, "{at:?}");
    }

    #[test]
    fn without_bounds_every_tip_goes_where_it_is_told() {
        let (plant, posed, handles, spines) = bound(3);
        let told: Vec<Vec3> = (0..handles.len() as u64).map(|i| Seed::new(3).at(i).direction() * 5.0).collect();
        let shift = spines.moved(posed.positions(), &told, &Guided { bounded: false, ..FREE });
        for (handle, told) in handles.iter().zip(&told) {
            assert!(shift[plant.span(handle.chain).end - 1].distance(*told) < 1e-2);
        }
    }

    #[test]
    fn wild_handles_stretch_and_turn_nothing_beyond_the_bounds_and_nothing_comes_off() {
        for seed in 0..10 {
            let (plant, posed, handles, spines) = bound(seed);
            let told: Vec<Vec3> =
                handles.iter().enumerate().map(|(i, _)| Seed::new(seed).at(i as u64).direction() * 5.0).collect();
            let shift = spines.moved(posed.positions(), &told, &FREE);
            let strains = spines.strains(posed.positions(), &shift);
            let turns: Vec<f32> = strains.iter().map(|s| s.1).collect();
            for (i, (stretch, turn)) in strains.into_iter().enumerate() {
                assert!(stretch <= STRETCH + 0.01, "{seed} {i}: {stretch}");
                assert!(turn <= MOST_TURN + 0.01, "{seed} {i}: {turn}");
                let _ = spines.most_of_neighbours(i, &turns);
            }
            for id in plant.chain_ids() {
                let Some((i, f)) = spines.base(id.index()) else { continue };
                let on = shift[i as usize].lerp(shift[(i as usize + 1).min(shift.len() - 1)], f);
                assert!(shift[plant.span(id).start].distance(on) < 1e-4);
            }
        }
    }
}
