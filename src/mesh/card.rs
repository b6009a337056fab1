//! Leaves as textured cards.
//!
//! A card's normals are mostly the crown's: the direction outward through the leaf, so that light falls on the tree as
//! on one volume with soft edges and not on a heap of mirrors. Engines turn a double-sided card's normal round on its
//! back; so that this never shows from outside, the side that looks out of the crown is made the front.

use glam::{Vec2, Vec3};

use super::{CrownLight, Mesh};
use crate::base::math;
use crate::plant::{Leaf, LeafForm, Plant, Posed};

/// How much of a card's normal is the crown's, the rest is its own.
const CANOPY: f32 = 0.72;
/// How far the halves of a folded card lean back, radians.
const FOLD: f32 = 0.38;

/// One leaf to be meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafCard {
    /// Index into the plant's leaves.
    pub leaf: usize,
    /// Its size as a factor of the leaf's own.
    pub scale: f32,
}

/// The shape of a card.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CardShape {
    /// A square of two triangles.
    Flat,
    /// Folded along the middle: four triangles, seen from every side.
    Folded,
}

impl CardShape {
    /// The shape of a leaf's card where leaves are drawn in this one: leaves that are flat stay so.
    #[must_use]
    pub const fn of(self, leaf: &Leaf) -> Self {
        match leaf.form {
            LeafForm::Square => self,
            LeafForm::Flat(_) => Self::Flat,
        }
    }

    /// Triangles of a card.
    #[must_use]
    pub const fn triangles(self) -> usize {
        match self {
            Self::Flat => 2,
            Self::Folded => 4,
        }
    }
}

/// A card for each leaf of a plant, at its own size.
#[must_use]
pub fn all_cards(plant: &Plant) -> Vec<LeafCard> {
    (0..plant.leaves().len()).map(|leaf| LeafCard { leaf, scale: 1.0 }).collect()
}

/// Meshes leaves: a card as wide as the leaf's form says, its picture's base in the middle of the lower edge at the
/// leaf's base; flat where the form is, else of `shape`; u, v in 0..=1 of the tile with v = 1 at the base, `tiles` the leaf's slot. A leaf of no size, or that the plant
/// doesn't have, gives nothing. Linear in cards.
#[must_use]
pub fn leaf_cards(plant: &Plant, posed: &Posed, leaves: &[LeafCard], shape: CardShape) -> Mesh {
    leaf_cards_in(plant, posed, &CrownLight::of(plant, posed), leaves, shape)
}

/// As [`leaf_cards`], where the crown's light is known.
#[must_use]
pub fn leaf_cards_in(plant: &Plant, posed: &Posed, light: &CrownLight, leaves: &[LeafCard], shape: CardShape) -> Mesh {
    let corners: usize =
        leaves.iter().filter_map(|card| plant.leaves().get(card.leaf)).map(|leaf| shape.of(leaf).triangles() + 2).sum();
    let mut mesh = Mesh {
        positions: Vec::with_capacity(corners),
        normals: Vec::with_capacity(corners),
        uvs: Vec::with_capacity(corners),
        occlusion: Vec::with_capacity(corners),
        tiles: Vec::with_capacity(corners),
        chains: Vec::with_capacity(corners),
        indices: Vec::with_capacity((corners - 2 * leaves.len().min(corners / 2)) * 3),
        ..Mesh::default()
    };
    let poses = posed.leaves(plant);
    let fold = math::sin_cos(FOLD);
    // Cards that rounding would crush have no area.
    let least = posed.positions().iter().fold(0.0_f32, |a, p| a.max(p.abs().max_element())) * 1e-5;
    for card in leaves {
        let (Some(leaf), Some(pose)) = (plant.leaves().get(card.leaf), poses.get(card.leaf)) else { continue };
        let size = leaf.size * card.scale;
        if !(size > least && size.is_finite()) {
            continue;
        }
        let shape = shape.of(leaf);
        let corners: &[(f32, f32)] = match shape {
            CardShape::Flat => &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
            CardShape::Folded => &[(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.5, 1.0), (0.0, 1.0)],
        };
        let front: &[u32] = match shape {
            CardShape::Flat => &[0, 1, 2, 0, 2, 3],
            CardShape::Folded => &[0, 1, 4, 0, 4, 5, 1, 2, 3, 1, 3, 4],
        };
        let (sin, cos) = if shape == CardShape::Flat { (0.0, 1.0) } else { fold };
        let width = size * leaf.form.width();
        let y = pose.frame.y.normalize_or(Vec3::Y);
        let x = pose.frame.x;
        let x = (x - y * x.dot(y)).try_normalize().unwrap_or_else(|| crate::base::Frame::along(y).x);
        let z = x.cross(y);
        let outward = light.outward(pose.position + y * (size * 0.5));
        let side = if z.dot(outward) < 0.0 { -1.0 } else { 1.0 };
        let first = mesh.positions.len() as u32;
        for &(u, v) in corners {
            let across = (u - 0.5) * width;
            // The halves lean away from the front.
            let position = pose.position + x * (across * cos) + y * (v * size) - z * (across.abs() * sin * side);
            let own = (z * (side * cos)
                + x * (if u < 0.5 {
                    -sin
                } else if u > 0.5 {
                    sin
                } else {
                    0.0
                }))
            .normalize_or(z);
            let normal = (light.outward(position) * CANOPY + own * (1.0 - CANOPY)).normalize_or(outward);
            mesh.positions.push(position);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(u, 1.0 - v));
            mesh.occlusion.push(light.shade(position));
            mesh.tiles.push(u32::from(leaf.slot));
        }
        mesh.chains.resize(mesh.positions.len(), leaf.chain.0);
        for t in front.chunks_exact(3) {
            let [a, b, c] = [t[0] + first, t[1] + first, t[2] + first];
            mesh.indices.extend(if side > 0.0 { [a, b, c] } else { [a, c, b] });
        }
    }
    mesh
}
