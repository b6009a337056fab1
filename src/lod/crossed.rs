//! The last level: two crossed cards through the line of the trunk, each baked from the whole tree and shown as two
//! rectangles back to back, so that both cards are lit alike from every side.

use glam::Vec3;
use rayon::prelude::*;

use super::bake_card::{Card, Place};
use super::bent::Bend;
use super::cloud::{Cloud, Scene};
use super::measure::Wardrobe;
use super::trunk::Trunk;
use crate::mesh::Mesh;

/// Texels along the taller edge, in mean edges of a cloud's cards.
pub(super) const EDGE: u32 = 2;
/// Distance of a quad's two sides from its plane, as a share of its height: a third of a pixel at the size at which quads
/// take over, and more than depth buffers confuse there.
const APART: f32 = 0.008;

/// A cloud of two cards, tiles counted from `first_tile` on, its alpha yet to be settled. Their wood is on the cards.
pub(super) fn crossed_quads(scene: &Scene<'_>, texels: u32, wardrobe: &Wardrobe, first_tile: u32) -> Cloud {
    let full = scene.full;
    let trunk = Trunk::of(scene.plant, scene.posed);
    let (foot, along) = (trunk.at(0.0), trunk.along());
    let cards: Vec<Card> = [Vec3::Z, Vec3::X]
        .into_par_iter()
        .filter_map(|z| {
            let z = (z - along * along.dot(z)).normalize();
            let points = full.bark.positions.iter().chain(&full.leaf.positions).copied();
            let place = Place::around(z, foot, points)?;
            let longest = (texels.clamp(8, 1024) * EDGE) as f32;
            let density = longest / (2.0 * place.half.max_element());
            let edge = |half: f32| ((2.0 * half * density).ceil() as u32).max(4);
            let size = (edge(place.half.x), edge(place.half.y));
            let mut card = Card::bake(full, (&place, &Bend::FLAT), size, wardrobe, scene.light)?;
            card.back_to_back(&place, scene.light, place.half.y * 2.0 * APART);
            Some(card)
        })
        .collect();
    Cloud::new(Mesh::default(), cards, first_tile)
}
