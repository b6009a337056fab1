//! The last rounds: what the leaves then really cover is held against the sketch, and lobes at the rim give way.
//!
//! Cages, filling and the bounds of branches (`sketch/spine.rs`) leave a rim that lies a little off the outline. Depth below
//! the silhouette as it is and depth below the sketch, each a distance field, differ at a lobe by how far the rim beside it
//! is off, so the lobe moves by the difference along the sketch's gradient. Deep inside nothing moves. The round that comes
//! nearest is kept, so the result is never worse than without.

use glam::{Vec2, Vec3};

use super::bound::{Chart, Sketcher};
use super::crown::CLOSE;
use super::frame::ViewPlane;
use super::leader::calm;
use super::raster::{Grid, Mask};
use super::region::Region;
use super::spine::Guided;
use crate::base::math;

/// Rounds at most.
const ROUNDS: usize = 3;
/// Cells along the longest edge.
const CELLS: usize = 120;
/// Share of what the rim is off that a round takes away.
const GAIN: f32 = 0.8;
/// Depth below the sketch up to which lobes move freely, and from which not at all, over the crown's size.
const DEEP: (f32, f32) = (0.04, 0.22);
/// Farthest that a lobe moves in a round, over the crown's size.
const FARTHEST: f32 = 0.05;

/// Depth below what is drawn, and around it.
pub(super) struct Field {
    grid: Grid,
    depths: Depths,
}

impl Field {
    /// Of a sketch whose crown's leaves reach so far about where they stand.
    pub(super) fn of(target: &Region, reach: f32) -> Self {
        let bounds = target.bounds();
        // Some cells at least lie around it, whatever the leaves: beyond the grid all is as at its edge.
        let margin = (bounds[1] - bounds[0]).max_element() * 0.12 + reach;
        let grid = Grid::over(bounds, CELLS, margin);
        Self { grid, depths: Depths::of(&Mask::of_region(target, grid)) }
    }

    /// Metres; below zero outside.
    pub(super) fn at(&self, p: Vec2) -> f32 {
        self.depths.at(self.grid, p)
    }
}

/// Improves what handles are told in a view, each by its share of the way; gives back how points move, which was
/// `shift`, and how like the sketch the crown is then: none of crowns that are not leaves.
pub(super) fn trimmed(
    (sketcher, guided): (&Sketcher, &Guided),
    chart: &Chart,
    field: &Field,
    wilts: &[bool],
    told: &mut Vec<Vec3>,
    shares: &[f32],
    mut shift: Vec<Vec3>,
) -> (Vec<Vec3>, Option<f32>) {
    if sketcher.discs.is_empty() {
        return (shift, None);
    }
    let Field { grid, depths: drawn } = field;
    let grid = *grid;
    let inside: Vec<bool> = drawn.0.iter().map(|d| *d > 0.0).collect();
    let mut covered = cover(sketcher, chart, grid, wilts, &shift);
    let mut best = likeness(&covered, &inside);
    let mut next = told.clone();
    for _ in 0..ROUNDS {
        let handles = next.iter_mut().zip(&sketcher.handles).zip(&sketcher.on).zip(shares);
        for (((told, handle), (point, f)), share) in handles {
            let place = handle.position + between(&shift, *point, *f);
            *told += give_way(sketcher, chart, grid, [&covered, drawn], place, *share);
        }
        calm(sketcher, chart, &mut next, shares);
        let moved = sketcher.spines.moved(&sketcher.positions, &next, guided);
        let now = cover(sketcher, chart, grid, wilts, &moved);
        let near = likeness(&now, &inside);
        if near <= best {
            break;
        }
        best = near;
        (shift, covered) = (moved, now);
        told.clone_from(&next);
    }
    (shift, Some(best))
}

/// How a lobe moves whose rim is off: `covered` is the depth below the silhouette as it is, `drawn` that below the wanted
/// one.
pub(super) fn give_way(
    sketcher: &Sketcher,
    chart: &Chart,
    grid: Grid,
    [covered, drawn]: [&Depths; 2],
    place: Vec3,
    share: f32,
) -> Vec3 {
    let most = FARTHEST * sketcher.size;
    let seen = chart.plane.seen(place);
    let (is, wanted) = (covered.at(grid, seen), drawn.at(grid, seen));
    let free = 1.0 - math::smoothstep(DEEP.0 * sketcher.size, DEEP.1 * sketcher.size, wanted.max(0.0));
    let way = drawn.inwards(grid, seen) * ((is - wanted) * GAIN * free * share).clamp(-most, most);
    chart.plane.grounded(place, chart.plane.lifted(place, way), sketcher.floor())
}

/// The shift of a place between points.
pub(super) fn between(shift: &[Vec3], point: u32, f: f32) -> Vec3 {
    let a = shift[point as usize];
    if f == 0.0 { a } else { a.lerp(shift.get(point as usize + 1).copied().unwrap_or(a), f) }
}

/// What leaves cover when points have moved: gaps are closed as in the crown's own silhouette.
fn cover(sketcher: &Sketcher, chart: &Chart, grid: Grid, wilts: &[bool], shift: &[Vec3]) -> Depths {
    let round = matches!(chart.plane, ViewPlane::Round { .. });
    let mut discs: Vec<(Vec2, f32)> = Vec::with_capacity(sketcher.discs.len() * (1 + usize::from(round)));
    for ((place, radius), (of, (point, f))) in
        sketcher.discs.iter().zip(sketcher.plant.leaves().iter().zip(&sketcher.leaves))
    {
        if !wilts[of.chain.index()] {
            let seen = chart.plane.seen(*place + between(shift, *point, *f));
            discs.push((seen, *radius));
            if round {
                discs.push((Vec2::new(-seen.x, seen.y), *radius));
            }
        }
    }
    Depths::covered(&discs, grid, sketcher.size * CLOSE)
}

/// Cells of both over cells of either.
fn likeness(covered: &Depths, inside: &[bool]) -> f32 {
    let (mut both, mut either) = (0_u32, 0_u32);
    for (depth, inside) in covered.0.iter().zip(inside) {
        both += u32::from(*depth > 0.0 && *inside);
        either += u32::from(*depth > 0.0 || *inside);
    }
    both as f32 / either.max(1) as f32
}

/// Depth below an outline at the middles of cells, metres; below zero outside.
pub(super) struct Depths(Vec<f32>);

impl Depths {
    /// Below the outline of what discs cover, with gaps closed that are narrower than twice `close`.
    pub(super) fn covered(discs: &[(Vec2, f32)], grid: Grid, close: f32) -> Self {
        Self(Mask::of_discs(discs, grid, close).1.into_iter().map(|d| d * grid.cell).collect())
    }

    pub(super) fn of(mask: &Mask) -> Self {
        let free = Mask { grid: mask.grid, inside: mask.inside.iter().map(|inside| !inside).collect() };
        let of = |(inner, outer): (f32, f32)| if inner > 0.0 { inner - 0.5 } else { 0.5 - outer };
        Self(mask.depths().into_iter().zip(free.depths()).map(|depths| of(depths) * mask.grid.cell).collect())
    }

    fn cell(grid: Grid, p: Vec2) -> (usize, Vec2) {
        let most = Vec2::new(grid.width as f32 - 1.001, grid.height as f32 - 1.001);
        let at = ((p - grid.origin) / grid.cell - 0.5).clamp(Vec2::ZERO, most.max(Vec2::ZERO));
        let (x, y) = (at.x as usize, at.y as usize);
        (y * grid.width + x, at - Vec2::new(x as f32, y as f32))
    }

    /// At a place; beyond the grid as at its edge.
    pub(super) fn at(&self, grid: Grid, p: Vec2) -> f32 {
        let (i, f) = Self::cell(grid, p);
        let row = |i: usize| self.0[i] + (self.0[i + 1] - self.0[i]) * f.x;
        row(i) + (row(i + grid.width) - row(i)) * f.y
    }

    /// The direction in which it gets deeper; zero on a ridge.
    fn inwards(&self, grid: Grid, p: Vec2) -> Vec2 {
        let step = grid.cell * 1.5;
        let along = |d: Vec2| self.at(grid, p + d) - self.at(grid, p - d);
        (Vec2::new(along(Vec2::X * step), along(Vec2::Y * step)) / (2.0 * step)).clamp_length_max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::region::Fill;
    use super::*;

    #[test]
    fn depths_are_distances_to_the_outline_and_grow_inwards() {
        let square = vec![Vec2::ZERO, Vec2::X * 4.0, Vec2::splat(4.0), Vec2::Y * 4.0];
        let region = Region::of(&[square], Fill::NonZero);
        let grid = Grid::over(region.bounds(), 120, 1.0);
        let depths = Depths::of(&Mask::of_region(&region, grid));
        for (p, depth) in [(Vec2::new(0.5, 2.0), 0.5), (Vec2::new(2.0, 3.7), 0.3), (Vec2::new(-0.4, 2.0), -0.4)] {
            assert!((depths.at(grid, p) - depth).abs() < grid.cell, "{p}: {}", depths.at(grid, p));
        }
        assert!(depths.inwards(grid, Vec2::new(0.5, 2.0)).distance(Vec2::X) < 0.05);
        assert!(depths.inwards(grid, Vec2::new(2.0, 3.7)).distance(Vec2::NEG_Y) < 0.05);
    }
}
