//! Thin wood for the cards: ribbons instead of tubes.
//!
//! A twig on a card is a texel wide; three vertices a ring would be wasted. Each segment is two crossed ribbons as wide
//! as the wood, and knows where it stands, so that it can go to the card that it is nearest to.

use glam::{Vec2, Vec3};

use super::planes::Unit;
use crate::mesh::{CrownLight, Mesh};
use crate::plant::{Plant, Posed};

/// One segment of thin wood.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    a: Vec3,
    b: Vec3,
    radii: (f32, f32),
    shade: u8,
}

impl Segment {
    /// Its middle.
    pub(super) fn centre(&self) -> Vec3 {
        (self.a + self.b) * 0.5
    }

    /// What planes are fitted to, its area times `share`.
    pub(super) fn unit(&self, share: f32) -> Unit {
        let along = self.b - self.a;
        let area = (self.radii.0 + self.radii.1) * along.length() * share;
        Unit { centre: self.centre(), way: along.normalize_or_zero(), is_twig: true, area: area + 1e-12 }
    }

    /// Adds its ribbons; `along` metres of bark make one tile.
    pub(super) fn add(&self, mesh: &mut Mesh, tile: f32) {
        let Some(axis) = (self.b - self.a).try_normalize() else { return };
        let frame = crate::base::Frame::along(axis);
        let v = self.a.y / tile;
        for (side, face) in [(frame.x, frame.z), (frame.z, frame.x)] {
            let first = mesh.positions.len() as u32;
            for (p, r, dv) in [(self.a, self.radii.0, 0.0), (self.b, self.radii.1, self.a.distance(self.b) / tile)] {
                for s in [-1.0, 1.0] {
                    mesh.positions.push(p + side * (r * s));
                    mesh.normals.push((side * s + face).normalize_or(face));
                    mesh.uvs.push(Vec2::new(s * r / tile, v + dv));
                    mesh.occlusion.push(self.shade);
                }
            }
            mesh.indices.extend([first, first + 1, first + 3, first, first + 3, first + 2]);
        }
    }
}

/// The segments of all chains that are shown and that `tubes` drops at such a radius.
pub(super) fn thin_wood(
    (plant, posed, shown): (&Plant, &Posed, &[bool]),
    light: &CrownLight,
    min_radius: f32,
) -> Vec<Segment> {
    let thick = plant.thick(min_radius);
    let mut segments = Vec::new();
    for id in plant.chain_ids().filter(|id| shown[id.index()] && !thick[id.index()]) {
        let radii = plant.radii(id);
        let points = posed.chain(plant, id);
        let shade = light.shade(points[points.len() / 2]);
        for (p, r) in points.windows(2).zip(radii.windows(2)) {
            segments.push(Segment { a: p[0], b: p[1], radii: (r[0], r[1]), shade });
        }
    }
    segments
}
