//! Planes for a billboard cloud: few planes that all leaves lie near to.
//!
//! The cost of leaves on a plane is area × (distance² + λ(1 − |n·n'|)), that of twigs, whose direction is d,
//! area × (distance² + λ|n·d|). Planes are seeded one after the other, each the
//! best of some random candidates, by how much they lower the total (stochastic search: Lacewell et al. 2006), with
//! directions spread by the golden angle so that some of them face any viewer. K-planes follows: leaves go to their
//! cheapest plane, planes move to the middle of their leaves. More are seeded than asked for; those whose leaves lose
//! least by going elsewhere are taken away. Directions stay as seeded: planes fitted freely line up with each other and
//! the tree vanishes when it is seen along them.

use glam::Vec3;
use rayon::prelude::*;

use crate::base::{Seed, math};

/// Candidates for each seeded plane.
const CANDIDATES: u64 = 10;
/// Units that candidates are tried on.
const TRIED: usize = 1500;
/// Rounds of k-planes.
const ROUNDS: usize = 6;
/// Seeded planes for each one asked for.
const SPARE: f32 = 1.25;
/// λ as a share of the square of the distance between planes.
const FACING: f32 = 2.0;
/// Planes that are looked at together.
const LANES: usize = 8;
/// How much planes lean, at most: sine of the elevation of their normals.
const LEAN: f32 = 0.8;

/// Leaves that stay together, or a piece of a twig.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unit {
    pub(super) centre: Vec3,
    /// Unit vector, either way round: the normal of leaves, the direction of a twig.
    pub(super) way: Vec3,
    pub(super) is_twig: bool,
    pub(super) area: f32,
}

impl Unit {
    /// How far it is from lying along a plane with a normal, 0..=1.
    fn stands(&self, normal: Vec3) -> f32 {
        let along = normal.dot(self.way).abs();
        if self.is_twig { along } else { 1.0 - along }
    }
}

/// The points x with `normal · x = offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) normal: Vec3,
    pub(super) offset: f32,
}

impl Plane {
    fn cost(&self, unit: &Unit, lambda: f32) -> f32 {
        let distance = self.normal.dot(unit.centre) - self.offset;
        unit.area * (distance * distance + lambda * unit.stands(self.normal))
    }

    /// Distance of a point, metres.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        (self.normal.dot(p) - self.offset).abs()
    }
}

/// At most `count` planes, and for each unit the plane that it goes to.
pub(super) fn fit(units: &[Unit], count: usize, seed: Seed) -> (Vec<Plane>, Vec<usize>) {
    if units.is_empty() || count == 0 {
        return (Vec::new(), Vec::new());
    }
    let (low, high) = units.iter().fold((Vec3::MAX, Vec3::MIN), |(l, h), u| (l.min(u.centre), h.max(u.centre)));
    let gap = (high - low).length() / count as f32;
    let lambda = FACING * gap * gap;
    let mut planes = seeded(units, (count as f32 * SPARE).ceil() as usize, lambda, seed);
    for _ in 0..ROUNDS {
        settle(units, &mut planes, lambda);
    }
    while planes.len() > count {
        remove_least(units, &mut planes, count, lambda);
        settle(units, &mut planes, lambda);
    }
    let homes = nearest(units, &planes, lambda).into_iter().map(|n| n.0).collect();
    (planes, homes)
}

/// Greedy stochastic seeding.
fn seeded(units: &[Unit], count: usize, lambda: f32, seed: Seed) -> Vec<Plane> {
    let step = units.len().div_ceil(TRIED);
    let tried: Vec<&Unit> = units.iter().step_by(step).collect();
    let mut paid = vec![f32::INFINITY; tried.len()];
    let mut planes = Vec::with_capacity(count);
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    for i in 0..count {
        let mut best: Option<(f32, Plane)> = None;
        for c in 0..CANDIDATES {
            let here = seed.at(i as u64).at(c);
            let lean = here.at(0).range(-LEAN, LEAN);
            let (sin, cos) = math::sin_cos(golden * i as f32 + here.at(1).range(-0.3, 0.3));
            let flat = (1.0 - lean * lean).sqrt();
            let normal = Vec3::new(cos * flat, lean, sin * flat);
            let plane = Plane { normal, offset: normal.dot(tried[here.at(2).index(tried.len())].centre) };
            let total: f32 = tried.iter().zip(&paid).map(|(u, p)| p.min(plane.cost(u, lambda))).sum();
            if best.is_none_or(|b| total < b.0) {
                best = Some((total, plane));
            }
        }
        let Some((_, plane)) = best else { break };
        for (u, p) in tried.iter().zip(&mut paid) {
            *p = p.min(plane.cost(u, lambda));
        }
        planes.push(plane);
    }
    planes
}

/// Planes, a coordinate at a time, filled up with such as cost infinitely much.
struct Lanes {
    axes: [Vec<[f32; LANES]>; 3],
    offsets: Vec<[f32; LANES]>,
}

impl Lanes {
    fn new(planes: &[Plane]) -> Self {
        let of = |get: &dyn Fn(&Plane) -> f32, none: f32| -> Vec<[f32; LANES]> {
            let lane = |part: &[Plane]| std::array::from_fn(|k| part.get(k).map_or(none, get));
            planes.chunks(LANES).map(lane).collect()
        };
        Self {
            axes: std::array::from_fn(|axis| of(&|plane| plane.normal[axis], 0.0)),
            offsets: of(&|plane| plane.offset, f32::INFINITY),
        }
    }

    /// The cheapest plane for a unit, and how much dearer the next best is; `costs` are used again.
    fn nearest(&self, unit: &Unit, lambda: f32, costs: &mut Vec<[f32; LANES]>) -> (usize, f32) {
        let [x, y, z] = &self.axes;
        let (centre, way) = (unit.centre, unit.way);
        // As `Plane::cost` has it: `stands` is the share along a plane's normal of twigs, and what is left of one of leaves.
        let (whole, sign) = if unit.is_twig { (0.0, 1.0) } else { (1.0, -1.0) };
        costs.clear();
        for (((x, y), z), offset) in x.iter().zip(y).zip(z).zip(&self.offsets) {
            costs.push(std::array::from_fn(|k| {
                let distance = x[k] * centre.x + y[k] * centre.y + z[k] * centre.z - offset[k];
                let along = (x[k] * way.x + y[k] * way.y + z[k] * way.z).abs();
                unit.area * (distance * distance + lambda * (whole + sign * along))
            }));
        }
        let best = least(costs);
        // What costs infinitely much may be no plane at all.
        let is_best = |cost: &f32| *cost == best && best < f32::INFINITY;
        let home = costs.as_flattened().iter().position(is_best).unwrap_or(0);
        costs.as_flattened_mut()[home] = f32::INFINITY;
        (home, least(costs) - best)
    }
}

/// The least of some costs; what is no number is none.
fn least(costs: &[[f32; LANES]]) -> f32 {
    let mut least = [f32::INFINITY; LANES];
    for costs in costs {
        for (least, cost) in least.iter_mut().zip(costs) {
            *least = if *cost < *least { *cost } else { *least };
        }
    }
    least.into_iter().fold(f32::INFINITY, f32::min)
}

/// For each unit its cheapest plane and how much dearer the next best is.
fn nearest(units: &[Unit], planes: &[Plane], lambda: f32) -> Vec<(usize, f32)> {
    let lanes = Lanes::new(planes);
    units.par_iter().with_min_len(256).map_init(Vec::new, |costs, unit| lanes.nearest(unit, lambda, costs)).collect()
}

/// One round of k-planes.
fn settle(units: &[Unit], planes: &mut Vec<Plane>, lambda: f32) {
    let mut sums = vec![(0.0_f32, 0.0_f32); planes.len()];
    for (unit, (home, _)) in units.iter().zip(nearest(units, planes, lambda)) {
        sums[home].0 += unit.area * planes[home].normal.dot(unit.centre);
        sums[home].1 += unit.area;
    }
    for (plane, (sum, area)) in planes.iter_mut().zip(&sums) {
        if *area > 0.0 {
            plane.offset = sum / area;
        }
    }
    if !sums.iter().any(|s| s.1 > 0.0) {
        planes.truncate(1);
        return;
    }
    let mut used = sums.iter().map(|s| s.1 > 0.0);
    planes.retain(|_| used.next().unwrap_or(false));
}

/// Takes the planes away whose leaves lose least; half of what is too much at a time, since losses change.
fn remove_least(units: &[Unit], planes: &mut Vec<Plane>, count: usize, lambda: f32) {
    let mut loss = vec![0.0_f32; planes.len()];
    for (home, dearer) in nearest(units, planes, lambda) {
        loss[home] += dearer;
    }
    let mut order: Vec<usize> = (0..planes.len()).collect();
    order.sort_by(|&a, &b| loss[a].total_cmp(&loss[b]).then(a.cmp(&b)));
    let surplus = (planes.len() - count).div_ceil(2);
    let mut gone = vec![false; planes.len()];
    order[..surplus].iter().for_each(|&i| gone[i] = true);
    let mut gone = gone.into_iter();
    planes.retain(|_| !gone.next().unwrap_or(false));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(count: u64, place: impl Fn(Seed) -> Vec3) -> Vec<Unit> {
        (0..count)
            .map(|i| {
                let seed = Seed::new(6).at(i);
                let (way, is_twig) = (seed.at(9).direction(), i % 3 == 0);
                Unit { centre: place(seed), way, is_twig, area: 0.5 + seed.at(8).unit() }
            })
            .collect()
    }

    #[test]
    fn a_ball_is_cut_into_thin_slices_that_face_all_ways() {
        let units = units(4000, |s| s.at(0).direction() * math::cbrt(s.at(1).unit()) * 3.0);
        let (planes, homes) = fit(&units, 48, Seed::new(1));
        assert!(planes.len() <= 48 && planes.len() >= 40);
        let mean = units.iter().zip(&homes).map(|(u, &h)| planes[h].distance(u.centre)).sum::<f32>() / 4000.0;
        assert!(mean < 0.12, "{mean}");
        for k in 0..8 {
            let (sin, cos) = math::sin_cos(k as f32 * 0.39);
            let facing = planes.iter().filter(|p| p.normal.dot(Vec3::new(cos, 0.0, sin)).abs() > 0.7).count();
            assert!(facing >= planes.len() / 5, "{facing} of {} face view {k}", planes.len());
        }
    }

    #[test]
    fn twigs_go_to_planes_that_they_lie_along() {
        let units: Vec<Unit> = units(3000, |s| s.at(0).direction() * math::cbrt(s.at(1).unit()) * 3.0)
            .into_iter()
            .map(|unit| Unit { is_twig: true, ..unit })
            .collect();
        let (planes, homes) = fit(&units, 48, Seed::new(1));
        let stands = |unit: &Unit, home: &usize| planes[*home].normal.dot(unit.way).abs();
        let mean = units.iter().zip(&homes).map(|(u, h)| stands(u, h)).sum::<f32>() / 3000.0;
        // Of planes drawn by lot it is a half.
        assert!(mean < 0.3, "{mean}");
    }

    #[test]
    fn planes_looked_at_together_cost_what_each_does() {
        let units = units(500, |s| s.at(0).direction() * 3.0);
        for count in [1, 7, 8, 21] {
            let one =
                |i: u64| Plane { normal: Seed::new(9).at(i).direction(), offset: Seed::new(9).at(i).at(5).unit() };
            let planes: Vec<Plane> = (0..count).map(one).collect();
            for (unit, (home, dearer)) in units.iter().zip(nearest(&units, &planes, 0.3)) {
                let mut costs: Vec<f32> = planes.iter().map(|plane| plane.cost(unit, 0.3)).collect();
                let best = costs.swap_remove(home);
                let next = costs.into_iter().fold(f32::INFINITY, f32::min);
                assert!(best <= next && (dearer == next - best), "{count}: {home} {dearer}");
            }
        }
    }

    #[test]
    fn degenerate_units_are_answered() {
        assert!(fit(&[], 5, Seed::new(1)).0.is_empty());
        let (planes, homes) = fit(&units(100, |_| Vec3::ONE), 5, Seed::new(1));
        assert!(!planes.is_empty() && planes.len() <= 5 && homes.iter().all(|&h| h < planes.len()));
        let broken = [Unit { centre: Vec3::NAN, way: Vec3::NAN, is_twig: false, area: f32::NAN }];
        assert!(fit(&broken, 3, Seed::new(1)).1.len() == 1);
    }
}
