//! Points that look for the shoot that is nearest to them, while shoots come in rounds.
//!
//! Points are sorted once into cells of a lattice and kept by eights of one cell. In a round the new shoots are sorted into
//! the same lattice, and each eight goes through the rows of cells around its own, from the middle outwards, as long as one
//! of its points may find something nearer there. A shoot is compared with eight points at once, and where rows start is
//! looked up for all of them: five times as fast as asking for one point after the other.

use glam::Vec3;
use rayon::prelude::*;

use super::lattice::{Lattice, bounds};

/// Points that are compared with a shoot at once.
const LANES: usize = 8;
/// Cells, for each point, at most.
const CELLS: usize = 16;
/// No shoot.
const NOBODY: i32 = -1;

/// Points and the nearest shoot of each so far.
#[derive(Debug)]
pub(super) struct Seekers {
    lattice: Lattice,
    /// How far a shoot may lie from a point, and how near it has to come to take it; metres.
    influence: f32,
    kill: f32,
    eights: Vec<Eight>,
    /// Where each point is: its eight, times [`LANES`], and its lane.
    slots: Vec<u32>,
    /// Rows of cells around one, by their squared distance from it in cells.
    rows: Vec<(i32, i32, f32)>,
}

/// Points of one cell. What is missing of eight is infinitely far and has been reached.
#[derive(Clone, Debug)]
struct Eight {
    cell: [u16; 3],
    x: [f32; LANES],
    y: [f32; LANES],
    z: [f32; LANES],
    /// Squared distance of the nearest shoot so far, and the shoot.
    distance: [f32; LANES],
    shoot: [i32; LANES],
    /// Nothing pulls here any more.
    done: [bool; LANES],
}

/// Shoots of a round in the order of cells.
struct Fresh {
    starts: Vec<u32>,
    all: Vec<([f32; 3], i32)>,
}

impl Seekers {
    /// Linear in points and cells.
    pub(super) fn new(points: &[Vec3], influence: f32, kill: f32) -> Self {
        let (low, high) = bounds(points);
        // Two cells to each side are enough, whichever way the last bit is rounded.
        let lattice = Lattice::new((low, high), influence * 0.501, points.len() * CELLS + 64);
        let (starts, items) = lattice.sort(points);
        let mut slots = vec![0; points.len()];
        let mut eights = Vec::new();
        for (cell, ends) in starts.windows(2).enumerate() {
            for group in items[ends[0] as usize..ends[1] as usize].chunks(LANES) {
                let far = [f32::INFINITY; LANES];
                let rows = cell / lattice.size[0];
                let cell = [cell % lattice.size[0], rows % lattice.size[1], rows / lattice.size[1]].map(|c| c as u16);
                let mut eight =
                    Eight { cell, x: far, y: far, z: far, distance: far, shoot: [NOBODY; LANES], done: [true; LANES] };
                for (lane, &i) in group.iter().enumerate() {
                    let p = points[i as usize];
                    (eight.x[lane], eight.y[lane], eight.z[lane]) = (p.x, p.y, p.z);
                    eight.done[lane] = false;
                    slots[i as usize] = (eights.len() * LANES + lane) as u32;
                }
                eights.push(eight);
            }
        }
        let around = (influence / lattice.cell).ceil().clamp(1.0, 64.0) as i32;
        let gap = |cells: i32| (cells.abs() - 1).max(0) as f32;
        let mut rows: Vec<(i32, i32, f32)> = (-around..=around)
            .flat_map(|z| (-around..=around).map(move |y| (y, z, gap(y) * gap(y) + gap(z) * gap(z))))
            .collect();
        // The middle first, then by distance: ties stay in order.
        rows.sort_by_key(|&(y, z, _)| y * y + z * z);
        Self { lattice, influence, kill, eights, slots, rows }
    }

    /// Shoots have come, the first of them number `first`: points that are nearer to one than to any before are its from now
    /// on, the lowest number among equals. Where they `take`, those that one comes near are done. Pure of the number of
    /// threads.
    pub(super) fn meet(&mut self, shoots: &[Vec3], first: u32, take: bool) {
        let (starts, items) = self.lattice.sort(shoots);
        let all = items.into_iter().map(|i| (shoots[i as usize].to_array(), (first + i) as i32)).collect();
        let fresh = Fresh { starts, all };
        let Self { lattice, influence, kill, eights, rows, .. } = self;
        let (most, near) = (*influence * *influence, *kill * *kill);
        let one = |eight: &mut Eight| {
            if eight.done != [true; LANES] {
                eight.meet(&fresh, (lattice, rows), (most, take.then_some(near)));
            }
        };
        eights.par_iter_mut().with_min_len(64).for_each(one);
    }

    /// The nearest shoot of a point that looks for one still.
    pub(super) fn nearest(&self, point: u32) -> Option<u32> {
        let slot = self.slots[point as usize] as usize;
        let eight = &self.eights[slot / LANES];
        let lane = slot % LANES;
        if eight.done[lane] { None } else { u32::try_from(eight.shoot[lane]).ok() }
    }

    /// A point gives up.
    pub(super) fn give_up(&mut self, point: u32) {
        let slot = self.slots[point as usize] as usize;
        self.eights[slot / LANES].done[slot % LANES] = true;
    }
}

impl Eight {
    fn meet(
        &mut self,
        fresh: &Fresh,
        (lattice, rows): (&Lattice, &[(i32, i32, f32)]),
        (most, near): (f32, Option<f32>),
    ) {
        // What a shoot has to beat to matter to each point.
        let limit: [f32; LANES] = std::array::from_fn(|k| match near {
            _ if self.done[k] => -1.0,
            Some(near) => self.distance[k].max(near).min(most),
            None => most,
        });
        let (mut least, mut whose) = ([most; LANES], [NOBODY; LANES]);
        // The farthest of these, squared, in cells; a little more, since rounding must not pass over a shoot that is as near.
        let in_cells = 1.001 / (lattice.cell * lattice.cell);
        let mut farthest = limit.into_iter().fold(0.0, f32::max) * in_cells;
        let [x, y, z] = self.cell.map(i32::from);
        let [wide, high, deep] = lattice.size.map(|size| size as i32);
        for &(dy, dz, gap) in rows {
            let (row, slab) = (y + dy, z + dz);
            if gap > farthest || row < 0 || row >= high || slab < 0 || slab >= deep {
                continue;
            }
            let mut side = 1_i32;
            while gap + (side * side) as f32 <= farthest {
                side += 1;
            }
            let line = (slab * high + row) * wide;
            let (from, to) = (line + (x - side).max(0), line + (x + side).min(wide - 1));
            let range = fresh.starts[from as usize] as usize..fresh.starts[to as usize + 1] as usize;
            if range.is_empty() {
                continue;
            }
            for &([x, y, z], shoot) in &fresh.all[range] {
                for k in 0..LANES {
                    let d = [x - self.x[k], y - self.y[k], z - self.z[k]];
                    let d = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                    let is_nearer = (d < least[k]) | ((d == least[k]) & (shoot < whose[k]));
                    least[k] = if is_nearer { d } else { least[k] };
                    whose[k] = if is_nearer { shoot } else { whose[k] };
                }
            }
            farthest =
                limit.iter().zip(&least).fold(0.0_f32, |far, (limit, least)| far.max(limit.min(*least))) * in_cells;
        }
        for k in 0..LANES {
            if whose[k] == NOBODY {
                continue;
            }
            if least[k] < self.distance[k] {
                (self.distance[k], self.shoot[k]) = (least[k], whose[k]);
            }
            self.done[k] |= near.is_some_and(|near| least[k] < near);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn strewn(count: u64, seed: u64) -> Vec<Vec3> {
        (0..count).map(|i| Seed::new(seed).at(i).direction() * Seed::new(seed + 1).at(i).range(0.0, 4.0)).collect()
    }

    #[test]
    fn every_point_knows_its_nearest_shoot_of_all_rounds() {
        let (points, influence, kill) = (strewn(700, 1), 1.1, 0.2);
        let mut seekers = Seekers::new(&points, influence, kill);
        let mut nearest = vec![(f32::INFINITY, None); points.len()];
        let mut done = vec![false; points.len()];
        let mut first = 0;
        for round in 0..4 {
            let mut shoots = strewn(60 + 200 * round, 10 + round);
            // Two at one place, and one far away.
            shoots.extend([shoots[5], Vec3::splat(90.0)]);
            seekers.meet(&shoots, first, round > 0);
            for (i, p) in points.iter().enumerate().filter(|(i, _)| !done[*i]).collect::<Vec<_>>() {
                for (k, shoot) in (first..).zip(&shoots) {
                    let d = (*shoot - *p).length_squared();
                    if d < nearest[i].0 && d < influence * influence {
                        nearest[i] = (d, Some(k));
                    }
                    done[i] |= round > 0 && d < kill * kill;
                }
            }
            for i in 0..points.len() {
                let wanted = if done[i] { None } else { nearest[i].1 };
                assert_eq!(seekers.nearest(i as u32), wanted, "{round} {i}");
            }
            let gives_up = (0..700).find(|i| !done[*i]).unwrap();
            seekers.give_up(gives_up as u32);
            done[gives_up] = true;
            first += shoots.len() as u32;
        }
        assert!(done.iter().filter(|d| **d).count() > 20 && nearest.iter().any(|n| n.1.is_none() || n.1 > Some(60)));
    }

    #[test]
    fn nobody_and_nothing_are_fine() {
        let mut none = Seekers::new(&[], 1.0, 0.1);
        none.meet(&[Vec3::ONE], 0, true);
        let mut one = Seekers::new(&[Vec3::ONE], 1.0, 0.1);
        one.meet(&[], 0, false);
        assert_eq!(one.nearest(0), None);
        one.meet(&[Vec3::ZERO, Vec3::new(1.0, 1.0, 0.5)], 7, false);
        assert_eq!(one.nearest(0), Some(8));
    }
}
