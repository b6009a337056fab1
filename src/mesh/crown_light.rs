//! How much of the sky a place in the crown sees: one rule for bark and leaves, baked into vertices.
//!
//! The crown is the convex hull of the branches and leaves. Foliage darkens with depth below the hull, and a place low
//! in the crown sees less sky than one at its top. It is a look, not a measurement: rays through a crown of thousands of
//! masked cards would cost a second a tree, and the hull's depth gives the same gradient.

use glam::Vec3;

use crate::plant::{Crown, Plant, Posed};

/// The darkest that a place deep inside gets, of 1.
const DARKEST: f32 = 0.34;
/// What a bare crown (no leaves at all) keeps of the darkening.
const BARE: f32 = 0.25;

/// The crown of a plant as light sees it.
#[derive(Clone, Debug)]
pub struct CrownLight {
    crown: Crown,
    low: Vec3,
    high: Vec3,
    /// Depth at which it is as dark as it gets, metres.
    dark: f32,
    strength: f32,
}

impl CrownLight {
    /// Reads a plant's crown; linear in points and leaves, times [`crate::plant::DIRECTIONS`].
    #[must_use]
    pub fn of(plant: &Plant, posed: &Posed) -> Self {
        // Leaves are the crown; where there are none, the branches are.
        let mut points: Vec<Vec3> = plant
            .leaves()
            .iter()
            .map(|l| posed.leaf(plant, l))
            .zip(plant.leaves())
            .map(|(p, l)| p.position + p.frame.y * (l.size * 0.5))
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
        points.iter().for_each(|&p| crown.add(p));
        let dark = if crown.is_empty() { 0.0 } else { crown.depth(centre) * 0.8 };
        Self { crown, low, high, dark: dark.max(1e-6), strength: if leafy { 1.0 } else { BARE } }
    }

    /// Middle of the crown's box.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        (self.low + self.high) * 0.5
    }

    /// The direction from the crown's middle outward through `point`, as the normal of the ellipsoid of the crown's
    /// proportions; unit, up at the very middle.
    #[must_use]
    pub fn outward(&self, point: Vec3) -> Vec3 {
        let half = ((self.high - self.low) * 0.5).max(Vec3::splat(self.dark * 0.25 + 1e-6));
        let d = (point - self.centre()) / half / half;
        // Engines turn the normals of a card's back round. Normals that lean on the horizon keep the far rim of a crown,
        // which is seen from behind, from looking down into the dark.
        Vec3::new(d.x, d.y * 0.65, d.z).normalize_or(Vec3::Y)
    }

    /// Share of the sky that a place sees, 255 is all.
    #[must_use]
    pub fn shade(&self, point: Vec3) -> u8 {
        if self.crown.is_empty() {
            return 255;
        }
        let depth = (self.crown.depth(point) / self.dark).clamp(0.0, 1.0);
        let height = (self.high.y - self.low.y).max(1e-6);
        let level = ((point.y - self.low.y) / height).clamp(0.0, 1.0);
        // Below the crown half of the sky is hidden at the trunk, and less towards the rim.
        let under = (1.0 - level) * 0.22;
        // Quick at first, then slowly: light falls off exponentially in a turbid medium.
        let inside = 1.0 - (1.0 - depth) * (1.0 - depth);
        let dark = (inside * (1.0 - DARKEST - 0.12) + under + 0.12 * inside * (1.0 - level)).min(1.0 - DARKEST);
        (255.0 * (1.0 - dark * self.strength) + 0.5) as u8
    }
}
