//! Filling: lobes flow into what of a sketch cages that adapt (`sketch/adapt.rs`) leave uncovered. Past the paper, whose cages see
//! outlines only.
//!
//! What lobes cover is a density over the cells of the sketch, capped where a cell is covered, and it diffuses (as in
//! Gastner and Newman's cartograms, 2004) with walls at the sketch's outline and at its holes. Lobes swim along, first
//! on a coarse grid, then on a fine one: what is void fills from what is beside it, lobes that are neighbours stay so, and
//! the result moves smoothly with the sketch. It fills the inside too, which the outline's segments don't see, and takes
//! the same time whatever the number of cages. Where cages cover the sketch by themselves there is no flow ([`OPEN`]).
//!
//! What is lost by it: hierarchy, since handles move and no cage passes it on to finer ones, so that a lobe keeps together
//! only as far as the flow is smooth; and locality, since a gap anywhere moves lobes all over the sketch a little. Open
//! sketches bring that back for the part that they replace (`sketch/part.rs`).

use glam::Vec2;

use super::raster::{Grid, Mask};
use super::region::Region;
use crate::base::math;

/// Density of a cell that nothing covers, over that of a covered one: an end to how far one lobe can spread.
const FLOOR: f32 = 0.12;
/// Share of the mean density at which a cell counts as covered.
const COVERED: f32 = 0.55;
/// What a cell hands to a neighbour in a step, of their difference.
const HANDED: f32 = 0.22;
/// Cells along the longest edge, and steps, of each round.
const ROUNDS: [(f32, usize); 4] = [(0.35, 40), (0.35, 40), (1.0, 50), (1.0, 50)];

/// How far inside of the sketch lobes are kept, and how far what they fill goes, over what leaves reach beyond them.
const KEPT: f32 = 0.5;
const FILLED: f32 = 1.3;
/// Share of a sketch left uncovered from which lobes spread, and from which they spread freely: where the cages' own
/// way covers it, spreading would only blur it.
const OPEN: (f32, f32) = (0.005, 0.06);
/// Lobes before and after one, in order of height, that it is ranked with.
const BESIDE: usize = 30;
/// Share of the way that a rank moves a lobe.
const RANKED: f32 = 0.75;

/// Which way lobes may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Freedom {
    /// In the plane.
    Plane,
    /// Level only: heights are another view's.
    Level,
}

/// Where lobes may be: a sketch without the rim that leaves reach over.
#[derive(Clone, Debug)]
pub(super) struct Basin {
    mask: Mask,
    nearest: Option<Vec<u32>>,
    rounds: Vec<Mask>,
    reach: f32,
}

impl Basin {
    /// The basin of a region for lobes whose leaves reach `reach` beyond them; `cells` along its longest edge.
    pub(super) fn new(region: &Region, reach: f32, cells: usize) -> Self {
        let fine = inner(region, reach * KEPT, cells);
        let rounds =
            ROUNDS.iter().map(|(share, _)| inner(region, reach * FILLED, (cells as f32 * share) as usize)).collect();
        let nearest = fine.nearest_inside();
        Self { mask: fine, nearest, rounds, reach }
    }

    /// The nearest place inside; the place itself where it is inside.
    pub(super) fn held(&self, p: Vec2, freedom: Freedom) -> Vec2 {
        let grid = self.mask.grid;
        if self.mask.holds(p) && within(grid, p) {
            return p;
        }
        let Some(nearest) = &self.nearest else { return p };
        let (x, y) = grid.cell_of(p);
        let to = match freedom {
            Freedom::Plane => nearest[y * grid.width + x] as usize,
            Freedom::Level => {
                let row = &self.mask.inside[y * grid.width..][..grid.width];
                let found = (0..grid.width).filter(|&c| row[c]).min_by_key(|&c| c.abs_diff(x));
                found.map_or(nearest[y * grid.width + x] as usize, |c| y * grid.width + c)
            }
        };
        // The near rim of that cell rather than its middle: places that come from one side stay apart.
        let middle = grid.middle(to % grid.width, to / grid.width);
        let half = Vec2::splat(grid.cell * 0.45);
        let held = p.clamp(middle - half, middle + half);
        if freedom == Freedom::Level { Vec2::new(held.x, p.y) } else { held }
    }

    /// Moves the lobes of each row, in their order, towards an even spread over what of the row is inside: flow alone
    /// is slow where heights are given and a row is much wider than its lobes.
    fn ranked(&self, places: &mut [Vec2]) {
        let grid = self.mask.grid;
        let mut sorted: Vec<usize> = (0..places.len()).collect();
        sorted.sort_by(|&a, &b| places[a].y.total_cmp(&places[b].y).then(a.cmp(&b)));
        let old = places.to_vec();
        for (k, &i) in sorted.iter().enumerate() {
            // Those of nearly its height.
            let near = &sorted[k.saturating_sub(BESIDE)..(k + BESIDE + 1).min(sorted.len())];
            let near = || near.iter().map(|&j| old[j]).filter(|p| (p.y - old[i].y).abs() <= grid.cell * 3.0);
            let (count, left) = near().fold((0, 0), |(n, l), p| (n + 1, l + usize::from(p.x < old[i].x)));
            let rank = (left as f32 + 0.5) / count.max(1) as f32;
            let (_, y) = grid.cell_of(old[i]);
            let row = &self.mask.inside[y * grid.width..][..grid.width];
            let open = row.iter().filter(|inside| **inside).count();
            let at = rank * open as f32;
            if let Some(column) = (0..grid.width).filter(|&c| row[c]).nth(at as usize) {
                let x = grid.origin.x + (column as f32 + at.fract()) * grid.cell;
                places[i].x += (x - places[i].x) * RANKED;
            }
        }
    }

    /// Moves lobes, each of a weight, until they cover the basin.
    pub(super) fn fill(&self, places: &mut [Vec2], weights: &[f32], freedom: Freedom) {
        if self.nearest.is_none() || places.is_empty() {
            return;
        }
        places.iter_mut().for_each(|p| *p = self.held(*p, freedom));
        if freedom == Freedom::Level {
            self.ranked(places);
        }
        let share = math::smoothstep(OPEN.0, OPEN.1, self.uncovered(places));
        if share <= 1e-4 {
            return;
        }
        let kept = places.to_vec();
        for (mask, (_, steps)) in self.rounds.iter().zip(ROUNDS) {
            let drift = drift(mask, places, weights, steps, freedom);
            for p in places.iter_mut() {
                let moved = *p + interpolated(&drift, mask.grid, *p);
                *p = self.held(moved, freedom);
            }
        }
        // The straight way may lead through a hole.
        for (p, kept) in places.iter_mut().zip(kept) {
            let part = kept.lerp(*p, share);
            // Level is to the last bit.
            let y = if freedom == Freedom::Level { kept.y } else { part.y };
            *p = self.held(Vec2::new(part.x, y), freedom);
        }
    }

    /// Share of the basin that no lobe's leaves reach.
    fn uncovered(&self, places: &[Vec2]) -> f32 {
        let Mask { grid, inside } = &self.mask;
        let mut taken = vec![false; grid.len()];
        for p in places {
            let (x, y) = grid.cell_of(*p);
            taken[y * grid.width + x] = true;
        }
        let free: Vec<bool> = taken.iter().map(|t| !t).collect();
        let away = Mask { grid: *grid, inside: free }.depths();
        let far = self.reach * 2.0 / grid.cell + 1.0;
        let open = away.iter().zip(inside).filter(|(d, inside)| **inside && **d > far).count();
        open as f32 / self.mask.count().max(1) as f32
    }
}

fn within(grid: Grid, p: Vec2) -> bool {
    let high = grid.origin + Vec2::new(grid.width as f32, grid.height as f32) * grid.cell;
    p.cmpge(grid.origin).all() && p.cmple(high).all()
}

/// A region as cells, without its rim; where it is narrower than two rims, its middle line stays.
fn inner(region: &Region, reach: f32, cells: usize) -> Mask {
    let bounds = region.bounds();
    let size = (bounds[1] - bounds[0]).max_element();
    let grid = Grid::over(bounds, cells, size / cells.max(4) as f32 * 1.5);
    let mut mask = Mask::of_region(region, grid);
    let depth = mask.depths();
    let rim = reach / grid.cell;
    let (w, h) = (grid.width, grid.height);
    let ridge = |i: usize| {
        let (x, y) = (i % w, i / w);
        let near = (y.saturating_sub(1)..(y + 2).min(h))
            .flat_map(|y| (x.saturating_sub(1)..(x + 2).min(w)).map(move |x| y * w + x));
        near.map(|j| depth[j]).fold(0.0, f32::max) <= depth[i] + 0.3
    };
    let inside: Vec<bool> =
        (0..grid.len()).map(|i| mask.inside[i] && (depth[i] > rim || (depth[i] > 0.5 && ridge(i)))).collect();
    mask.inside = inside;
    mask
}

/// How far lobes drift from each cell's middle while the density spreads.
fn drift(mask: &Mask, places: &[Vec2], weights: &[f32], steps: usize, freedom: Freedom) -> Vec<Vec2> {
    let grid = mask.grid;
    let (w, h) = (grid.width, grid.height);
    let cells = mask.count().max(1);
    let mut density = vec![0.0_f32; grid.len()];
    for (p, weight) in places.iter().zip(weights) {
        splat(&mut density, grid, *p, *weight);
    }
    // What fell beyond the rim counts for the cell beside it, by one step of blur over all cells.
    let density = blurred(&density, w, h);
    let total: f32 = density.iter().zip(&mask.inside).filter(|(_, i)| **i).map(|(d, _)| *d).sum();
    let covered = (total / cells as f32 * COVERED).max(f32::MIN_POSITIVE);
    let mut rho: Vec<f32> = density
        .iter()
        .zip(&mask.inside)
        .map(|(d, inside)| if *inside { FLOOR + (d / covered).min(1.0) } else { 0.0 })
        .collect();
    let inside: Vec<u32> = (0..grid.len() as u32).filter(|&i| mask.inside[i as usize]).collect();
    // Tracers at the middles of all cells inside, in cells.
    let mut tracers: Vec<Vec2> =
        inside.iter().map(|&i| Vec2::new((i as usize % w) as f32, (i as usize / w) as f32)).collect();
    let (mut right, mut up) = (vec![0.0_f32; grid.len()], vec![0.0_f32; grid.len()]);
    let level = freedom == Freedom::Level;
    for _ in 0..steps {
        for &i in &inside {
            let i = i as usize;
            let here = rho[i];
            right[i] = if i % w + 1 < w && mask.inside[i + 1] { HANDED * (here - rho[i + 1]) } else { 0.0 };
            up[i] = if !level && i + w < rho.len() && mask.inside[i + w] { HANDED * (here - rho[i + w]) } else { 0.0 };
        }
        for t in &mut tracers {
            let v = velocity(&right, &up, &rho, w, h, *t);
            *t += v;
        }
        for &i in &inside {
            let i = i as usize;
            rho[i] -= right[i] + up[i];
            if right[i] != 0.0 {
                rho[i + 1] += right[i];
            }
            if up[i] != 0.0 {
                rho[i + w] += up[i];
            }
        }
    }
    let mut drift = vec![Vec2::ZERO; grid.len()];
    for (&i, t) in inside.iter().zip(&tracers) {
        let from = Vec2::new((i as usize % w) as f32, (i as usize / w) as f32);
        drift[i as usize] = (*t - from) * grid.cell;
    }
    // Cells outside take what the nearest inside does, so that interpolation at the rim is not held back.
    if let Some(nearest) = mask.nearest_inside() {
        for i in 0..drift.len() {
            if !mask.inside[i] {
                drift[i] = drift[nearest[i] as usize];
            }
        }
    }
    drift
}

/// The velocity at a place, in cells a step, from what passes between cells.
fn velocity(right: &[f32], up: &[f32], rho: &[f32], w: usize, h: usize, p: Vec2) -> Vec2 {
    let x = (p.x + 0.5).clamp(0.0, w as f32 - 1.0);
    let y = (p.y + 0.5).clamp(0.0, h as f32 - 1.0);
    let (cx, cy) = (x as usize, y as usize);
    let i = cy * w + cx;
    let here = rho[i].max(FLOOR * 0.5);
    let (left, below) = (if cx > 0 { right[i - 1] } else { 0.0 }, if cy > 0 { up[i - w] } else { 0.0 });
    let (fx, fy) = (x - cx as f32, y - cy as f32);
    Vec2::new(left + (right[i] - left) * fx, below + (up[i] - below) * fy) / here
}

fn splat(density: &mut [f32], grid: Grid, p: Vec2, weight: f32) {
    let at = ((p - grid.origin) / grid.cell - 0.5)
        .clamp(Vec2::ZERO, Vec2::new(grid.width as f32 - 1.001, grid.height as f32 - 1.001));
    let (x, y) = (at.x as usize, at.y as usize);
    let (fx, fy) = (at.x - x as f32, at.y - y as f32);
    let i = y * grid.width + x;
    density[i] += weight * (1.0 - fx) * (1.0 - fy);
    density[i + 1] += weight * fx * (1.0 - fy);
    density[i + grid.width] += weight * (1.0 - fx) * fy;
    density[i + grid.width + 1] += weight * fx * fy;
}

fn blurred(values: &[f32], w: usize, h: usize) -> Vec<f32> {
    let at = |x: usize, y: usize| values[y * w + x];
    let row: Vec<f32> = (0..w * h)
        .map(|i| {
            let (x, y) = (i % w, i / w);
            (at(x.saturating_sub(1), y) + 2.0 * at(x, y) + at((x + 1).min(w - 1), y)) * 0.25
        })
        .collect();
    let at = |x: usize, y: usize| row[y * w + x];
    (0..w * h)
        .map(|i| {
            let (x, y) = (i % w, i / w);
            (at(x, y.saturating_sub(1)) + 2.0 * at(x, y) + at(x, (y + 1).min(h - 1))) * 0.25
        })
        .collect()
}

fn interpolated(field: &[Vec2], grid: Grid, p: Vec2) -> Vec2 {
    let at = ((p - grid.origin) / grid.cell - 0.5)
        .clamp(Vec2::ZERO, Vec2::new(grid.width as f32 - 1.001, grid.height as f32 - 1.001));
    let (x, y) = (at.x as usize, at.y as usize);
    let (fx, fy) = (at.x - x as f32, at.y - y as f32);
    let i = y * grid.width + x;
    field[i].lerp(field[i + 1], fx).lerp(field[i + grid.width].lerp(field[i + grid.width + 1], fx), fy)
}

#[cfg(test)]
mod tests {
    use super::super::region::Fill;
    use super::*;
    use crate::base::Seed;

    fn square() -> Region {
        Region::of(&[vec![Vec2::ZERO, Vec2::X * 4.0, Vec2::splat(4.0), Vec2::Y * 4.0]], Fill::NonZero)
    }

    fn lobes(low: f32, high: f32) -> Vec<Vec2> {
        (0..600).map(|i| Vec2::new(Seed::new(3).at(i).range(low, high), Seed::new(4).at(i).range(low, high))).collect()
    }

    fn covered(region: &Region, places: &[Vec2]) -> f32 {
        let grid = Grid::over(region.bounds(), 40, 0.0);
        let discs: Vec<(Vec2, f32)> = places.iter().map(|p| (*p, 0.15)).collect();
        Mask::of_discs(&discs, grid, 0.1).0.overlap(&Mask::of_region(region, grid))
    }

    #[test]
    fn a_heap_in_a_corner_comes_to_cover_the_square() {
        let region = square();
        let mut places = lobes(0.2, 2.6);
        let before = covered(&region, &places);
        Basin::new(&region, 0.1, 48).fill(&mut places, &[1.0; 600], Freedom::Plane);
        let after = covered(&region, &places);
        assert!(before < 0.55 && after > 0.85, "{before} {after}");
        assert!(places.iter().all(|p| p.cmpge(Vec2::ZERO).all() && p.cmple(Vec2::splat(4.0)).all()));
    }

    #[test]
    fn what_covers_a_square_already_hardly_moves() {
        let region = square();
        let mut places = lobes(0.1, 3.9);
        let before = places.clone();
        Basin::new(&region, 0.1, 48).fill(&mut places, &[1.0; 600], Freedom::Plane);
        let mean = places.iter().zip(&before).map(|(a, b)| a.distance(*b)).sum::<f32>() / 600.0;
        assert!(mean < 0.12, "{mean}");
    }

    #[test]
    fn level_flow_keeps_heights_and_holes_stay_empty() {
        let ring =
            |low: f32, high: f32| vec![Vec2::splat(low), Vec2::new(high, low), Vec2::splat(high), Vec2::new(low, high)];
        let region = Region::of(&[ring(0.0, 4.0), ring(1.0, 3.0)], Fill::EvenOdd);
        let basin = Basin::new(&region, 0.05, 48);
        let mut places = lobes(0.1, 3.9);
        let before = places.clone();
        basin.fill(&mut places, &[1.0; 600], Freedom::Level);
        for (p, was) in places.iter().zip(&before) {
            assert!(p.y == was.y);
            assert!(!(p.cmpgt(Vec2::splat(1.1)).all() && p.cmplt(Vec2::splat(2.9)).all()), "{p}");
        }
    }
}
