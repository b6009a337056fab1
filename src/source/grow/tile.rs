//! A cube of Poisson-disc points that repeats without a seam, from which every graph's nodes are copied.
//!
//! Throwing darts for 150,000 nodes costs more than all the rest of a tree (0.4 of 0.7 s when it was done for each graph).
//! The points of one cube, whose opposite faces fit, are thrown once in a process; a graph takes copies side by side,
//! shifted and turned into one of 48 positions by its own seed. Copies of a shuffled lattice would show; here the
//! period is thirty discs in all three directions and paths never run along it, so it is not seen.
//!
//! Grid-based dart throwing. A round throws one dart into every cell of a grid three discs wide, each round shifts the grid
//! by a random amount: cells as wide as the disc need fewer rounds, but whoever comes first in a cell decides where its
//! neighbours can lie, and a lattice showed: twice as many points in the upper half of a cell as in the lower.

use std::sync::OnceLock;

use glam::Vec3;
use rayon::prelude::*;

use crate::base::{Seed, math};

/// Points of the cube, about.
const POINTS: f32 = 16_384.0;
/// Rounds of darts: eight for each cube as wide as the disc. More hardly add points.
const ROUNDS: u64 = 8 * 27;
/// Points for each cube as wide as the disc, after that many rounds; measured.
const FILL: f32 = 0.52;
/// Cells of a round along an edge of the cube, each about three discs wide.
const COARSE: u32 = 10;

/// Points in the unit cube, no two of which are closer than `disc`, also across its faces.
#[derive(Debug)]
pub(super) struct Tile {
    points: Vec<Vec3>,
    disc: f32,
}

/// The one cube. The first call makes it, in some milliseconds.
pub(super) fn tile() -> &'static Tile {
    static TILE: OnceLock<Tile> = OnceLock::new();
    TILE.get_or_init(Tile::new)
}

impl Tile {
    fn new() -> Self {
        let disc = math::cbrt(FILL / POINTS);
        let seed = Seed::new(0).child("tile");
        let mut darts = Darts::new(disc);
        for round in 0..ROUNDS {
            let seed = seed.at(round);
            let shift = seed.child("shift");
            let shift = Vec3::new(shift.at(0).unit(), shift.at(1).unit(), shift.at(2).unit());
            for cell in 0..COARSE * COARSE * COARSE {
                let seed = seed.at(u64::from(cell));
                let jitter = Vec3::new(seed.at(0).unit(), seed.at(1).unit(), seed.at(2).unit());
                let cell =
                    Vec3::new((cell % COARSE) as f32, (cell / COARSE % COARSE) as f32, (cell / COARSE / COARSE) as f32);
                darts.throw((cell + jitter) / COARSE as f32 + shift);
            }
        }
        Self { points: darts.points, disc }
    }

    /// How many points a unit of volume has where none are closer than `disc`.
    pub(super) fn density(&self, disc: f32) -> f32 {
        // As for `Layer::new`, whose discs are a few last digits smaller.
        let edge = disc / (self.disc * SEAM);
        self.points.len() as f32 / (edge * edge * edge).max(f32::MIN_POSITIVE)
    }

    /// How large the cube must be for `density` points in a unit of volume.
    pub(super) fn edge(&self, density: f32) -> f32 {
        math::cbrt(self.points.len() as f32 / density.max(f32::MIN_POSITIVE))
    }
}

/// What rounding at the seam between copies leaves of a disc.
const SEAM: f32 = 0.9999;

/// The tile laid through all space.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    points: Vec<Vec3>,
    /// Edge of a copy.
    pub(super) edge: f32,
    /// No two points are closer than this.
    pub(super) disc: f32,
    offset: Vec3,
}

impl Layer {
    /// Copies with that edge, shifted and turned by `seed`.
    pub(super) fn new(edge: f32, seed: Seed) -> Self {
        let tile = tile();
        let position = seed.child("turn").index(48);
        let turned = |p: &Vec3| {
            let p = match position / 8 {
                0 => *p,
                1 => Vec3::new(p.y, p.z, p.x),
                2 => Vec3::new(p.z, p.x, p.y),
                3 => Vec3::new(p.y, p.x, p.z),
                4 => Vec3::new(p.x, p.z, p.y),
                _ => Vec3::new(p.z, p.y, p.x),
            };
            let flip = |bit: usize, x: f32| if position >> bit & 1 == 1 { 1.0 - x } else { x };
            Vec3::new(flip(0, p.x), flip(1, p.y), flip(2, p.z)) * edge
        };
        let shift = seed.child("shift");
        let offset = Vec3::new(shift.at(0).unit(), shift.at(1).unit(), shift.at(2).unit()) * -edge;
        let disc = tile.disc * edge * SEAM;
        Self { points: tile.points.iter().map(turned).collect(), edge, disc, offset }
    }

    /// The points in a box for which `keep` has a value, with it; copies in order, parallel over them.
    pub(super) fn points<T: Send>(
        &self,
        low: Vec3,
        high: Vec3,
        keep: impl Fn(Vec3) -> Option<T> + Sync,
    ) -> Vec<(Vec3, T)> {
        let from = ((low - self.offset) / self.edge).floor();
        let to = ((high - self.offset) / self.edge).floor();
        let count = |from: f32, to: f32| (to - from + 1.0).clamp(1.0, 4096.0) as u32;
        let [across, up, deep] = [count(from.x, to.x), count(from.y, to.y), count(from.z, to.z)];
        let parts = self.points.len().div_ceil(CHUNK);
        let work = across as usize * up as usize * deep as usize * parts;
        let made: Vec<Vec<(Vec3, T)>> = (0..work)
            .into_par_iter()
            .map(|i| {
                let (copy, part) = ((i / parts) as u32, i % parts);
                let at = Vec3::new((copy % across) as f32, (copy / across % up) as f32, (copy / across / up) as f32);
                let origin = self.offset + (from + at) * self.edge;
                let points = &self.points[part * CHUNK..((part + 1) * CHUNK).min(self.points.len())];
                points
                    .iter()
                    .map(|p| origin + *p)
                    .filter(|p| p.cmpge(low).all() && p.cmple(high).all())
                    .filter_map(|p| keep(p).map(|value| (p, value)))
                    .collect()
            })
            .collect();
        made.into_iter().flatten().collect()
    }
}

/// Points of one piece of parallel work.
const CHUNK: usize = 4096;

/// Points of the unit cube, wrapped around, no two of which are closer than a disc.
struct Darts {
    points: Vec<Vec3>,
    /// Cells along an edge, each at least a disc wide.
    size: u32,
    /// The last point of each cell.
    last: Vec<u32>,
    /// The point before it in the same cell.
    before: Vec<u32>,
    square: f32,
}

impl Darts {
    fn new(disc: f32) -> Self {
        let size = (1.0 / disc).floor() as u32;
        Self {
            points: Vec::new(),
            size,
            last: vec![u32::MAX; (size * size * size) as usize],
            before: Vec::new(),
            square: disc * disc,
        }
    }

    /// Keeps a point unless one lies within the disc around it.
    fn throw(&mut self, point: Vec3) {
        let point = point - point.floor();
        let cell = (point * self.size as f32).floor();
        let cell = [cell.x, cell.y, cell.z].map(|c| (c as u32).min(self.size - 1));
        let [xs, ys, zs] = cell.map(|c| [c, (c + self.size - 1) % self.size, (c + 1) % self.size]);
        // Own cell first: most darts of the later rounds are refused there or beside it.
        for y in ys {
            for z in zs {
                for x in xs {
                    if self.refuses([x, y, z], point) {
                        return;
                    }
                }
            }
        }
        let cell = self.index(cell);
        self.before.push(self.last[cell]);
        self.last[cell] = self.points.len() as u32;
        self.points.push(point);
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        ((y * self.size + z) * self.size + x) as usize
    }

    fn refuses(&self, cell: [u32; 3], point: Vec3) -> bool {
        let mut i = self.last[self.index(cell)];
        while i != u32::MAX {
            let d = (self.points[i as usize] - point).abs();
            // The shorter way around.
            let d = d.min(Vec3::ONE - d);
            if d.length_squared() < self.square {
                return true;
            }
            i = self.before[i as usize];
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_keep_the_disc_across_their_seams() {
        let layer = Layer::new(1.0, Seed::new(4));
        let points = layer.points(Vec3::splat(-0.12), Vec3::splat(0.13), |_| Some(()));
        assert!(points.len() > 200);
        for (i, (a, ())) in points.iter().enumerate() {
            assert!(points[..i].iter().all(|(b, ())| a.distance(*b) >= layer.disc));
        }
    }

    #[test]
    fn no_lattice_shows_in_the_points() {
        let tile = tile();
        assert!((tile.points.len() as f32 / POINTS - 1.0).abs() < 0.02, "{}", tile.points.len());
        // Fractions of a coordinate by the disc are even: a lattice would crowd some bins.
        let mut bins = [0_u32; 8];
        for p in &tile.points {
            bins[(((p.y / tile.disc).fract() * 8.0) as usize).min(7)] += 1;
        }
        let mean = tile.points.len() as f32 / 8.0;
        assert!(bins.iter().all(|&b| (b as f32 / mean - 1.0).abs() < 0.12), "{bins:?}");
    }
}
