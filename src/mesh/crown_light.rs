//! How much of the sky a place in the crown sees: one rule for bark and leaves, baked into vertices.
//!
//! The crown is the convex hull of the branches and leaves. Foliage darkens with depth below the hull, and a place low
//! in the crown sees less sky than one at its top. It is a look, not a measurement: rays through a crown of thousands of
//! masked cards would cost a second a tree, and the hull's depth gives the same gradient. The depth is looked up between
//! the corners of a grid, since every vertex asks for it.

use glam::Vec3;

use crate::plant::{Crown, Plant, Posed};

/// The darkest that a place deep inside gets, of 1. Engines multiply the albedo with it and cast the crown's shadows besides: with
/// a third, half of a sunlit crown was black in three.js.
const DARKEST: f32 = 0.55;
/// What a bare crown keeps of the darkening.
const BARE: f32 = 0.25;
/// How often leaves cover the outline of a full crown, cards taken whole: with fewer it is no volume. Half of what the
/// thinnest crown of the shipped sets has; maples and poplars that others modelled with a few hundred leaves have 0.5 to 2.
const FULL: f32 = 3.0;
/// Cells along each edge of the grid of depths.
const CELLS: usize = 16;

/// The crown of a plant as light sees it.
#[derive(Clone, Debug)]
pub struct CrownLight {
    /// Depth below the hull at the corners of the grid over the crown's box, metres, x first, then y; empty for no crown.
    depths: Vec<f32>,
    low: Vec3,
    high: Vec3,
    /// Cells of the grid a metre.
    cells: Vec3,
    /// Of half the edges of the box, or what is left of them where it is flat: one over their squares.
    bulge: Vec3,
    /// One over the depth at which it is as dark as it gets, and one over the height of the box; per metre.
    darkness: f32,
    rise: f32,
    strength: f32,
    fullness: f32,
}

impl CrownLight {
    /// Reads a plant's crown; linear in points and leaves, times [`crate::plant::DIRECTIONS`].
    #[must_use]
    pub fn of(plant: &Plant, posed: &Posed) -> Self {
        // Leaves are the crown; where there are none, the branches are.
        let mut points: Vec<Vec3> = plant
            .leaves()
            .iter()
            .zip(posed.leaves(plant))
            .map(|(l, p)| p.position + p.frame.y * (l.size * 0.5))
            .collect();
        let leafy = !points.is_empty();
        if !leafy {
            for id in plant.chain_ids().filter(|&id| plant.chain(id).parent.is_some()) {
                points.extend(posed.chain(plant, id).last());
            }
        }
        if points.is_empty() {
            points.extend_from_slice(posed.positions());
        }
        points.retain(|p| p.is_finite());
        let (mut low, mut high) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MIN));
        for &p in &points {
            (low, high) = (low.min(p), high.max(p));
        }
        if points.is_empty() {
            (low, high) = (Vec3::ZERO, Vec3::ZERO);
        }
        let centre = (low + high) * 0.5;
        let mut crown = Crown::new(centre);
        crown.add_all(&points);
        let dark = if crown.is_empty() { 0.0 } else { crown.depth(centre) * 0.8 };
        let step = (high - low) / CELLS as f32;
        let depths = if crown.is_empty() { Vec::new() } else { crown.depths::<{ CELLS + 1 }>(low, step) };
        let dark = dark.max(1e-6);
        let edges = (high - low).max(Vec3::splat(1e-6));
        // Of the ellipsoid in the box, seen from the three sides.
        let outline = std::f32::consts::FRAC_PI_4 * (edges.x * edges.y + edges.y * edges.z + edges.x * edges.z) / 3.0;
        let area: f32 = plant.leaves().iter().map(|l| l.size * l.size * l.form.width()).sum();
        let fullness = if leafy { (area / (outline * FULL)).clamp(0.0, 1.0) } else { 0.0 };
        let half = ((high - low) * 0.5).max(Vec3::splat(dark * 0.25 + 1e-6));
        Self {
            depths,
            low,
            high,
            cells: step.max(Vec3::splat(1e-30)).recip(),
            bulge: (half * half).recip(),
            darkness: dark.recip(),
            rise: (high.y - low.y).max(1e-6).recip(),
            strength: BARE + (1.0 - BARE) * fullness,
            fullness,
        }
    }

    /// How much of a volume the crown is: 1 where its leaves hide what is behind them, 0 where there are none.
    pub(super) const fn fullness(&self) -> f32 {
        self.fullness
    }

    /// Depth below the hull; 0 outside of the crown's box.
    fn depth(&self, point: Vec3) -> f32 {
        if !(point.cmpge(self.low).all() && point.cmple(self.high).all()) {
            return 0.0;
        }
        let at = ((point - self.low) * self.cells).min(Vec3::splat(CELLS as f32));
        // A cast is the floor of what is not below zero.
        let [x, y, z] = at.to_array().map(|v| (v as u32).min(CELLS as u32 - 1));
        let f = at - Vec3::new(x as f32, y as f32, z as f32);
        let row = CELLS + 1;
        let first = (z as usize * row + y as usize) * row + x as usize;
        let edge = |i: usize| self.depths[i] + (self.depths[i + 1] - self.depths[i]) * f.x;
        let face = |i: usize| edge(i) + (edge(i + row) - edge(i)) * f.y;
        face(first) + (face(first + row * row) - face(first)) * f.z
    }

    /// Middle of the crown's box.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        (self.low + self.high) * 0.5
    }

    /// The direction outward through `point`, unit: of a full crown from its middle, as the normal of the ellipsoid of
    /// its proportions, up at the very middle. Leaves of a crown that one sees through are lit from above wherever they are.
    #[must_use]
    pub fn outward(&self, point: Vec3) -> Vec3 {
        let of_crown = ((point - self.centre()) * self.lean()).normalize_or(Vec3::Y);
        if self.fullness == 1.0 {
            return of_crown;
        }
        (of_crown * self.fullness + Vec3::Y * (1.0 - self.fullness)).normalize_or(Vec3::Y)
    }

    /// What a way from the middle is multiplied with to look outward. Engines turn the normals of a card's back round. Normals
    /// that lean on the horizon keep the far rim of a crown, which is seen from behind, from looking down into the dark.
    pub(super) fn lean(&self) -> Vec3 {
        self.bulge * Vec3::new(1.0, 0.65, 1.0)
    }

    /// Share of the sky that a place sees, 255 is all.
    #[must_use]
    pub fn shade(&self, point: Vec3) -> u8 {
        if self.depths.is_empty() {
            return 255;
        }
        let depth = (self.depth(point) * self.darkness).clamp(0.0, 1.0);
        let level = ((point.y - self.low.y) * self.rise).clamp(0.0, 1.0);
        // Below the crown half of the sky is hidden at the trunk, and less towards the rim.
        let under = (1.0 - level) * 0.33;
        // Quick at first, then slowly: light falls off exponentially in a turbid medium.
        let inside = 1.0 - (1.0 - depth) * (1.0 - depth);
        let dark = (inside * 0.82 + under + 0.18 * inside * (1.0 - level)).min(1.0) * (1.0 - DARKEST);
        (255.0 * (1.0 - dark * self.strength) + 0.5) as u8
    }
}
