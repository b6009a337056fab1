//! What of a plant is its crown, and how large: the leaves, or the branches of a plant that has none.

use glam::{Vec2, Vec3};

use super::frame::ViewPlane;
use super::raster::{Grid, Mask, contours};
use super::region::{Fill, Region, twice_signed_area};
use crate::plant::{ChainId, Plant, Posed};

/// Fewer leaves make no crown.
const LEAFY: usize = 12;
/// Most that a leaf reaches beyond its place, over the crown's size: cards may show whole boughs.
const MOST_REACH: f32 = 0.06;
/// Gaps that silhouettes close, to each side, over the crown's size.
pub(super) const CLOSE: f32 = 0.03;
/// Cells along the longest edge of the grid that the silhouette is found on.
const CELLS: usize = 160;

/// The parts of a plant that make its crown.
#[derive(Clone, Debug)]
pub(super) struct Crown {
    /// Where it is, and how far it covers about, metres.
    pub(super) discs: Vec<(Vec3, f32)>,
    /// For each chain the places of its own part.
    pub(super) own: Vec<Vec<Vec3>>,
    /// For each chain how much foliage is its own.
    pub(super) weights: Vec<f32>,
    /// How far leaves reach beyond their places, metres.
    pub(super) reach: f32,
    /// Diagonal of its box, metres.
    pub(super) size: f32,
    /// Middle of its box.
    pub(super) middle: Vec3,
}

impl Crown {
    /// The crown of a plant; none where it has no extent.
    pub(super) fn of(plant: &Plant, posed: &Posed) -> Option<Self> {
        let count = plant.chains().len();
        let mut own: Vec<Vec<Vec3>> = vec![Vec::new(); count];
        let mut weights = vec![0.0_f32; count];
        let mut discs: Vec<(Vec3, f32)> = Vec::new();
        if plant.leaves().len() >= LEAFY {
            for leaf in plant.leaves() {
                let pose = posed.leaf(plant, leaf);
                let wide = leaf.size * 0.5;
                let place = pose.position + pose.frame.y * wide;
                discs.push((place, wide * leaf.form.width().clamp(0.3, 1.0)));
                own[leaf.chain.index()].push(place);
                weights[leaf.chain.index()] += leaf.size * leaf.size;
            }
        } else {
            let lone = count == 1;
            for id in plant.chain_ids() {
                let curve = posed.curve(plant, id);
                let from = bare_share(plant, id, lone);
                let length = curve.length();
                let steps = (plant.points(id).len() * 2).clamp(8, 64);
                for k in 0..=steps {
                    let t = k as f32 / steps as f32;
                    if t >= from {
                        let place = curve.point(f64::from(t));
                        discs.push((place, curve.value(plant.radii(id), f64::from(t))));
                        own[id.index()].push(place);
                        weights[id.index()] += length / steps as f32;
                    }
                }
            }
        }
        let sound = |p: &Vec3| p.is_finite() && p.abs().max_element() < 1e6;
        discs.retain(|d| sound(&d.0) && d.1.is_finite());
        own.iter_mut().for_each(|places| places.retain(sound));
        let ends = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = discs.iter().fold(ends, |(l, h), d| (l.min(d.0), h.max(d.0)));
        let size = (high - low).length();
        if !(size.is_finite() && size > 1e-4) {
            return None;
        }
        let mean = discs.iter().map(|d| d.1).sum::<f32>() / discs.len().max(1) as f32;
        discs.iter_mut().for_each(|d| d.1 = d.1.min(size * MOST_REACH));
        Some(Self { discs, own, weights, reach: mean.min(size * MOST_REACH), size, middle: (low + high) * 0.5 })
    }

    /// What is seen of it in a plane.
    pub(super) fn seen(&self, plane: &ViewPlane) -> Vec<(Vec2, f32)> {
        let mut seen: Vec<(Vec2, f32)> = self.discs.iter().map(|d| (plane.seen(d.0), d.1)).collect();
        if matches!(plane, ViewPlane::Round { .. }) {
            let other: Vec<(Vec2, f32)> = seen.iter().map(|(p, r)| (Vec2::new(-p.x, p.y), *r)).collect();
            seen.extend(other);
        }
        seen
    }

    /// Its silhouette in a plane: the outline of its largest piece, counter-clockwise, without gaps narrower than twice
    /// [`CLOSE`] of its size. What other pieces there are is bridged first.
    pub(super) fn silhouette(&self, plane: &ViewPlane) -> Vec<Vec2> {
        let seen = self.seen(plane);
        let grid = grid_over(&seen, self.size, CELLS);
        let mut close = self.size * CLOSE;
        let mut best: Vec<Vec2> = Vec::new();
        // Thin crowns fall to pieces; a wider reach holds them together.
        for _ in 0..5 {
            let (_, depth) = Mask::of_discs(&seen, grid, close);
            let mut rings = contours(&depth, grid);
            rings.retain(|ring| twice_signed_area(ring) > 0.0);
            rings.sort_by(|a, b| twice_signed_area(b).total_cmp(&twice_signed_area(a)));
            let total: f64 = rings.iter().map(|r| twice_signed_area(r)).sum();
            if let Some(first) = rings.into_iter().next() {
                let whole = twice_signed_area(&first) > total * 0.97;
                best = first;
                if whole {
                    break;
                }
            }
            close *= 1.6;
        }
        best
    }
}

/// The share of a chain, from its base, that is no crown where a plant has no leaves.
fn bare_share(plant: &Plant, id: ChainId, lone: bool) -> f32 {
    if plant.chain(id).parent.is_some() {
        return 0.0;
    }
    if lone {
        return 0.4;
    }
    let own = plant.chains().iter().filter(|c| c.parent == Some(id)).map(|c| c.location);
    own.fold(1.0_f32, f32::min).min(0.9)
}

fn grid_over(seen: &[(Vec2, f32)], size: f32, cells: usize) -> Grid {
    let ends = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    let (low, high) = seen.iter().fold(ends, |(l, h), (p, r)| (l.min(*p - *r), h.max(*p + *r)));
    Grid::over([low, high], cells, size * CLOSE * 3.0)
}

/// The silhouette of a plant's crown from an azimuth and an elevation (radians; azimuth 0 looks from +z, elevation 0 is
/// level, π/2 straight down): the region that it covers, with gaps narrower than `2 * close` of its size closed. `x` is to
/// the right, `y` up in the picture, metres from where the origin is seen. Empty for a plant without extent.
///
/// This is what a sketch is compared with; time is linear in leaves and in the 320 cells along its longest edge squared.
#[must_use]
pub fn crown_silhouette(plant: &Plant, azimuth: f32, elevation: f32, close: f32) -> Region {
    let posed = plant.pose();
    let Some(crown) = Crown::of(plant, &posed) else { return Region::default() };
    let plane = ViewPlane::of(azimuth, elevation);
    let seen = crown.seen(&plane);
    let grid = grid_over(&seen, crown.size, CELLS * 2);
    let (_, depth) = Mask::of_discs(&seen, grid, crown.size * close);
    Region::of(&contours(&depth, grid), Fill::NonZero)
}

/// The outline that sketches are matched with: see [`crown_silhouette`]; one ring, counter-clockwise.
#[must_use]
pub fn crown_outline(plant: &Plant, azimuth: f32, elevation: f32) -> Vec<Vec2> {
    let posed = plant.pose();
    Crown::of(plant, &posed).map_or_else(Vec::new, |crown| crown.silhouette(&ViewPlane::of(azimuth, elevation)))
}

/// Area of what two regions have in common over that of what either covers, 0..=1.
#[must_use]
pub fn overlap(a: &Region, b: &Region) -> f32 {
    let either = a.union(b).area();
    if either > 0.0 { a.intersection(b).area() / either } else { 0.0 }
}
