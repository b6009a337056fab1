//! Convex hulls around the crown: volumes for triggers, sight and simple collisions.
//!
//! A hull has few corners: the farthest points of the crown are taken until there are so many ([`super::convex`]), pushed
//! outward where others stick out of their faces, and the hull of those is enlarged about its middle until it holds all. Where several are asked for, the largest is cut in two by
//! the plane across an axis that leaves the least volume, again and again: tiers of a conifer come apart by height, a wide
//! crown by its sides. Planes are chosen on some of the points, so the cost is linear in all.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::convex::{Convex, inner_hull};
use crate::mesh::Mesh;
use crate::plant::{Plant, Posed};

/// Points that planes are chosen on.
const LOOKED_AT: usize = 1500;
/// Corners of the hulls that are compared.
const ROUGH: usize = 24;
/// Places along an axis where a plane may cut, as shares of the way.
const CUTS: [f32; 5] = [0.3, 0.4, 0.5, 0.6, 0.7];

/// Rounds of pushing corners outward, and how far of what sticks out of their faces.
const ROUNDS: usize = 12;
const PUSH: f64 = 0.6;

/// A closed convex surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Hull {
    /// Corners, metres.
    pub points: Vec<[f32; 3]>,
    /// Three corners a triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Hull {
    /// The points and indices of a mesh.
    pub(super) fn mesh(&self) -> (Vec<Vec3>, Vec<u32>) {
        (self.points.iter().map(|p| Vec3::from_array(*p)).collect(), self.triangles.as_flattened().to_vec())
    }

    /// How far a point lies outside, metres; at most zero inside.
    #[must_use]
    pub fn outside(&self, point: [f32; 3]) -> f32 {
        let corner = |i: u32| Vec3::from_array(self.points[i as usize]).as_dvec3();
        let p = Vec3::from_array(point).as_dvec3();
        let above = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            (b - a).cross(c - a).normalize_or_zero().dot(p - a)
        };
        self.triangles.iter().map(above).fold(f64::NEG_INFINITY, f64::max) as f32
    }
}

/// At most `count` hulls of at most `corners` (8 at least) corners each that hold all corners of the finest level's leaves
/// and the tips of all branches, each in one of them; of a plant without leaves, all of its branches and what of its stems is
/// above the lowest of them. The largest first.
#[must_use]
pub fn crown_hulls(plant: &Plant, posed: &Posed, leaf: &Mesh, count: usize, corners: usize) -> Vec<Hull> {
    if count == 0 {
        return Vec::new();
    }
    let mut points: Vec<Vec3> = leaf.positions.iter().copied().filter(|p| p.is_finite()).collect();
    let branches = || plant.chain_ids().filter(|id| plant.chain(*id).parent.is_some());
    if points.is_empty() {
        let lowest = branches().map(|id| posed.chain(plant, id)[0].y).fold(f32::MAX, f32::min);
        for id in plant.chain_ids() {
            let is_stem = plant.chain(id).parent.is_none();
            for (p, r) in posed.chain(plant, id).iter().zip(plant.radii(id)).filter(|(p, _)| !is_stem || p.y >= lowest)
            {
                points.extend([Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|way| [*p - way * *r, *p + way * *r]));
            }
        }
    } else {
        points.extend(branches().filter_map(|id| posed.chain(plant, id).last()));
    }
    if points.is_empty() {
        points.extend_from_slice(posed.positions());
    }
    if points.is_empty() {
        return Vec::new();
    }
    let mut parts = vec![Part::new(points)];
    while parts.len() < count {
        let largest = (0..parts.len()).max_by(|a, b| parts[*a].volume.total_cmp(&parts[*b].volume).then(b.cmp(a)));
        let Some(halves) = largest.and_then(|i| Some((i, parts[i].cut()?))) else { break };
        let (i, [low, high]) = halves;
        parts[i] = low;
        parts.push(high);
    }
    parts.sort_by(|a, b| b.volume.total_cmp(&a.volume));
    parts.iter().filter_map(|part| around(&part.points, corners.max(8))).collect()
}

/// Some of the crown's points.
struct Part {
    points: Vec<Vec3>,
    /// Of the hull around some of them, cubic metres.
    volume: f64,
}

impl Part {
    fn new(points: Vec<Vec3>) -> Self {
        let volume = rough(points.iter().step_by(points.len() / LOOKED_AT + 1).copied());
        Self { points, volume }
    }

    /// Both halves by the plane that leaves the least volume; none where no plane has points on both sides.
    fn cut(&self) -> Option<[Self; 2]> {
        let some: Vec<Vec3> = self.points.iter().step_by(self.points.len() / LOOKED_AT + 1).copied().collect();
        let (low, high) = some.iter().fold((Vec3::MAX, Vec3::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        let mut best: Option<(f64, usize, f32)> = None;
        for axis in 0..3 {
            for share in CUTS {
                let at = low[axis] + (high[axis] - low[axis]) * share;
                let side = |below: bool| rough(some.iter().copied().filter(|p| (p[axis] < at) == below));
                let left = side(true) + side(false);
                if best.is_none_or(|b| left < b.0) {
                    best = Some((left, axis, at));
                }
            }
        }
        let (_, axis, at) = best?;
        let (below, above): (Vec<Vec3>, Vec<Vec3>) = self.points.iter().partition(|p| p[axis] < at);
        (!below.is_empty() && !above.is_empty()).then(|| [Self::new(below), Self::new(above)])
    }
}

fn rough(points: impl Iterator<Item = Vec3>) -> f64 {
    let points: Vec<DVec3> = points.map(Vec3::as_dvec3).collect();
    inner_hull(&points, ROUGH).map_or(0.0, |hull| hull.volume())
}

/// A hull of at most so many corners that holds all points.
fn around(points: &[Vec3], corners: usize) -> Option<Hull> {
    let all: Vec<DVec3> = points.iter().map(|p| p.as_dvec3()).collect();
    // Nothing but the corners of the exact hull matters.
    let exact = inner_hull(&all, usize::MAX)?;
    let mut convex = inner_hull(&exact.points, corners)?;
    let mut best = enlarged(&convex, &exact.points);
    for _ in 0..ROUNDS {
        convex = inner_hull(&pushed(&convex, &exact.points), corners)?;
        let found = enlarged(&convex, &exact.points);
        if found.volume() < best.volume() {
            best = found;
        }
    }
    // A hair more, for the rounding of corners and what lies within a step of the grid.
    let centre = best.centre();
    let corner = |p: &DVec3| (centre + (*p - centre) * (1.0 + 1e-5)).as_vec3().to_array();
    Some(Hull { points: best.points.iter().map(corner).collect(), triangles: best.triangles })
}

/// A hull enlarged about its middle until it holds some points.
fn enlarged(convex: &Convex, points: &[DVec3]) -> Convex {
    let centre = convex.centre();
    let least = |(normal, offset): (DVec3, f64)| {
        let depth = offset - normal.dot(centre);
        let reach = points.iter().map(|p| normal.dot(*p - centre)).fold(0.0, f64::max);
        if depth > 0.0 { reach / depth } else { 1.0 }
    };
    let grow = convex.planes().map(least).fold(1.0, f64::max);
    Convex {
        points: convex.points.iter().map(|p| centre + (*p - centre) * grow).collect(),
        triangles: convex.triangles.clone(),
    }
}

/// The corners of a hull, each moved outward as its faces ask for: a part of what sticks out of them.
fn pushed(convex: &Convex, points: &[DVec3]) -> Vec<DVec3> {
    let mut moves = vec![(DVec3::ZERO, 0.0); convex.points.len()];
    for (triangle, (normal, offset)) in convex.triangles.iter().zip(convex.planes()) {
        let out = points.iter().map(|p| normal.dot(*p) - offset).fold(0.0, f64::max);
        for &i in triangle {
            let of = &mut moves[i as usize];
            *of = (of.0 + normal * out, of.1 + 1.0);
        }
    }
    convex.points.iter().zip(moves).map(|(p, (way, count))| *p + way / f64::max(count, 1.0) * PUSH).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::plant::PlantBuilder;

    fn stem() -> Plant {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.1]);
        builder.finish().unwrap()
    }

    fn leaves(points: Vec<Vec3>) -> Mesh {
        Mesh { positions: points, ..Mesh::default() }
    }

    #[test]
    fn hulls_hold_every_leaf_and_keep_to_their_corners() {
        let plant = stem();
        let posed = plant.pose();
        for seed in 0..12 {
            let seed = Seed::new(seed);
            let place = |i: u64| seed.at(i).direction() * seed.at(i).child("r").range(0.5, 3.0) + Vec3::Y * 4.0;
            let leaf = leaves((0..3000).map(place).collect());
            for (count, corners) in [(1, 64), (1, 12), (3, 32), (6, 8)] {
                let hulls = crown_hulls(&plant, &posed, &leaf, count, corners);
                assert_eq!(hulls.len(), count);
                assert!(hulls.iter().all(|hull| hull.points.len() <= corners && hull.points.len() >= 4));
                let lost = leaf.positions.iter().filter(|p| hulls.iter().all(|h| h.outside(p.to_array()) > 0.0));
                assert_eq!(lost.count(), 0, "{count} of {corners}");
                assert_eq!(hulls, crown_hulls(&plant, &posed, &leaf, count, corners));
            }
        }
    }

    #[test]
    fn two_crowns_come_apart_and_few_corners_cost_little() {
        let plant = stem();
        let posed = plant.pose();
        let ball = |i: u64, at: Vec3| Seed::new(i).direction() * 1.5 + at;
        let leaf =
            leaves((0..4000).map(|i| ball(i, if i % 2 == 0 { Vec3::X * 5.0 } else { Vec3::X * -5.0 })).collect());
        let volume = |hulls: &[Hull]| -> f64 {
            let of = |hull: &Hull| Convex {
                points: hull.points.iter().map(|p| Vec3::from_array(*p).as_dvec3()).collect(),
                triangles: hull.triangles.clone(),
            };
            hulls.iter().map(|hull| of(hull).volume()).sum()
        };
        let balls = 2.0 * 4.0 / 3.0 * std::f64::consts::PI * 1.5 * 1.5 * 1.5;
        let [one, two, coarse] = [(1, 64), (2, 64), (2, 16)]
            .map(|(count, corners)| volume(&crown_hulls(&plant, &posed, &leaf, count, corners)));
        assert!(one > balls * 2.5, "{one} {balls}");
        assert!(two < balls * 1.15, "{two} {balls}");
        assert!(coarse < balls * 1.9, "{coarse} {balls}");
    }

    #[test]
    fn bare_and_flat_plants_have_hulls_too() {
        let plant = stem();
        let posed = plant.pose();
        for leaf in [leaves(vec![]), leaves(vec![Vec3::ONE]), leaves(vec![Vec3::NAN]), leaves(vec![Vec3::X, Vec3::Z])] {
            let hulls = crown_hulls(&plant, &posed, &leaf, 4, 32);
            assert!(!hulls.is_empty() && hulls.iter().all(|hull| hull.points.len() >= 4), "{leaf:?}");
        }
        assert!(crown_hulls(&plant, &posed, &leaves(vec![Vec3::ONE]), 0, 32).is_empty());
    }
}
