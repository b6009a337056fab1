//! Leaf points: candidate places for foliage, seeded in the volume of the crown (2017 TVCG, 4.3).
//!
//! The volume is the convex hull of the crown, a little swollen. Points are denser towards its outer shell, where a
//! crown's light and leaves are, and those that no twig could reach are dropped; so the convex hull's empty corners stay
//! empty, and a crown of several limbs keeps its gaps.

use glam::Vec3;

use super::reach::Reach;
use super::twig::Wood;
use crate::base::{Seed, math};

/// Most candidates that are drawn, kept or not.
const MOST_DRAWN: usize = 600_000;
/// Share of the candidates kept deep inside, of 1 at the hull.
const INSIDE: f32 = 0.22;

/// Points in the crown within reach of the wood, in addressed order; about one for each `spacing³` of the shell.
pub(super) fn leaf_points(wood: &Wood, seed: Seed) -> Vec<Vec3> {
    let (low, high) = wood.crown.bounds();
    let (low, high) = (low - wood.swell, high + wood.swell);
    let size = high - low;
    let volume = size.x * size.y * size.z;
    let want = volume / (wood.spacing * wood.spacing * wood.spacing);
    let drawn = (want.clamp(64.0, MOST_DRAWN as f32)) as usize;
    let centre = (wood.crown.bounds().0 + wood.crown.bounds().1) * 0.5;
    let deepest = wood.crown.depth(centre).max(1e-6);
    let wooded = Reach::new(&wood.near, wood.reach, drawn);
    let clumps = seed.child("clumps");
    let per_cell = drawn as f32 * wooded.edge() * wooded.edge() * wooded.edge() / volume.max(1e-20);
    let kept = |p: Vec3, s: Seed| {
        // Foliage comes in clumps with gaps between.
        if s.at(5).unit() > math::smoothstep(0.18, 0.5, clump(p / (wood.reach * 1.1), clumps)) {
            return false;
        }
        let depth = wood.crown.depth(p);
        if depth < -wood.swell {
            return false;
        }
        let inside = (depth / deepest).clamp(0.0, 1.0);
        let share = 1.0 - (1.0 - INSIDE) * math::smoothstep(0.1, 0.75, inside);
        s.at(3).unit() <= share
    };
    // Every draw has its own address, so the tests may come in any order: the cheap ones that fail often come first.
    wooded.of_cells(|cell, points| {
        let seed = seed.at(cell.number);
        let count = (per_cell + seed.at(0).unit()) as u64;
        for s in (1..=count).map(|k| seed.at(k)) {
            let p = || cell.low + wooded.edge() * Vec3::new(s.at(0).unit(), s.at(1).unit(), s.at(2).unit());
            // Near wood always, far from it rarely: foliage clusters about the branches that carry it.
            if !cell.reaches(wood.reach * s.at(4).unit().sqrt(), p) {
                continue;
            }
            let p = p();
            if p.y >= wood.floor && p.y <= wood.top && kept(p, s) {
                points.push(p);
            }
        }
    })
}

/// Smooth noise with features of about 1, 0..=1: the eight corners' random values, eased.
fn clump(p: Vec3, seed: Seed) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (Vec3::splat(3.0) - f * 2.0);
    // Cells are counted from a corner far away, so that they are never negative.
    let at = |v: f32| [(v + 1_048_576.0) as u64, (v + 1.0 + 1_048_576.0) as u64];
    let (ys, zs) = (at(cell.y), at(cell.z));
    let columns = at(cell.x).map(|x| ys.map(|y| seed.at(x).at(y)));
    let corner = |x: usize, y: usize, z: usize| columns[x][y].at(zs[z]).unit();
    let row = |y: usize, z: usize| corner(0, y, z) * (1.0 - f.x) + corner(1, y, z) * f.x;
    let face = |z: usize| row(0, z) * (1.0 - f.y) + row(1, z) * f.y;
    face(0) * (1.0 - f.z) + face(1) * f.z
}
