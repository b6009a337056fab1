//! The last level: two crossed cards through the line of the trunk, each baked from the whole tree and shown as two
//! rectangles back to back with normals of the places where they are, so that both cards are lit alike from every side.
//!
//! Seen from between its planes, and from above, a pair of cards is narrower than a round crown, and where they are solid no
//! alpha makes up for it: then they are wider than the tree ([`widen`]).

use glam::Vec3;
use rayon::prelude::*;

use super::agree::Outlines;
use super::bake_card::{Card, Place};
use super::bent::Bend;
use super::cloud::{Cloud, Scene};
use super::measure::Wardrobe;
use super::packed;
use super::trunk::Trunk;
use crate::bake::{Cutout, Silhouette};
use crate::mesh::Mesh;
use crate::plant::{Plant, Posed};

/// Texels along the taller edge, in mean edges of a cloud's cards.
pub(super) const EDGE: u32 = 2;
/// Distance of a quad's two sides from its plane, as a share of its height: a third of a pixel at the size at which quads
/// take over, and more than depth buffers confuse there.
const APART: f32 = 0.008;

/// Rounds in search of the width, how little may be covered, and how wide cards are made at most.
const ROUNDS: usize = 4;
const COVERED: f32 = 0.985;
const WIDEST: f32 = 1.3;

/// Makes the cards of settled quads wider about the trunk until they cover what the full tree does. Gives back their
/// outlines. `worn` are the cutouts of all tiles before their own.
pub(super) fn widen(
    quads: &mut Cloud,
    plant: (&Plant, &Posed),
    (outlines, worn): (&Outlines, &[&Cutout]),
    mut drawn: Vec<Silhouette>,
) -> Vec<Silhouette> {
    let trunk = Trunk::of(plant.0, plant.1);
    let slim = quads.tree.leaf.positions.clone();
    let mut by = 1.0_f32;
    for _ in 0..ROUNDS {
        let ratio = outlines.ratio(&drawn);
        if ratio >= COVERED || ratio <= 0.0 || by >= WIDEST {
            break;
        }
        by = (by / ratio).min(WIDEST);
        for (wide, slim) in quads.tree.leaf.positions.iter_mut().zip(&slim) {
            let axis = trunk.at(slim.y);
            *wide = (axis + (*slim - axis) * by).with_y(slim.y);
        }
        drawn = quads.draw(outlines, worn);
    }
    drawn
}

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
            let edge = |half: f32| packed::edge((2.0 * half * density).ceil() as u32);
            let size = (edge(place.half.x), edge(place.half.y));
            let mut card = Card::bake(full, (&place, &Bend::FLAT), size, wardrobe, scene.light)?;
            card.back_to_back(&place, place.half.y * 2.0 * APART, wardrobe.bark.len() as u32);
            Some(card)
        })
        .collect();
    Cloud::new(Mesh::default(), cards, first_tile)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lod::specimen::{climbed, on_trunk};
    use crate::preset::plan::Lod;

    #[test]
    fn quads_of_a_dense_crown_cover_what_it_does() {
        let ladder = climbed(&on_trunk(Vec3::X, (4.0, 0.2), (60, 60)), Lod::CrossedQuads);
        let level = &ladder.levels[1];
        assert!((level.measured.coverage - 1.0).abs() < 0.03, "{:?}", level.measured);
        assert!(crate::mesh::problems(&level.mesh.leaf).is_empty());
        // They are as high as the tree, and go through its trunk.
        let ends = |mesh: &Mesh| mesh.positions.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p.y), h.max(p.y)));
        let (full, quads) = (ends(&ladder.levels[0].mesh.leaf), ends(&level.mesh.leaf));
        assert!((quads.1 - full.1).abs() < 0.1 * (full.1 - full.0), "{full:?} {quads:?}");
        let middle = level.mesh.leaf.positions.iter().sum::<Vec3>() / level.mesh.leaf.positions.len() as f32;
        assert!((middle - Vec3::X).with_y(0.0).length() < 0.3, "{middle}");
    }

    #[test]
    fn quads_are_lit_by_their_places_and_clouds_move_as_one() {
        let plant = on_trunk(Vec3::X, (4.0, 0.2), (60, 60));
        let quads = climbed(&plant, Lod::CrossedQuads);
        let leaf = &quads.levels[1].mesh.leaf;
        for (corners, normals) in leaf.positions.chunks(4).zip(leaf.normals.chunks(4)) {
            let face = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
            let middle = corners.iter().sum::<Vec3>() / 4.0;
            for (corner, normal) in corners.iter().zip(normals) {
                assert!(normal.dot(face).abs() < 0.2 && normal.dot((*corner - middle).with_y(0.0)) > 0.0, "{normal}");
            }
        }
        // Nothing shines.
        assert!(quads.tiles.iter().all(|tile| tile.orm.iter().all(|orm| orm[1] == 255)));
        let cloud = climbed(&plant, Lod::BillboardCloud { cards: 12 });
        let bark = &cloud.levels[1].mesh.bark;
        assert!(!bark.chains.is_empty() && bark.chains.iter().all(|chain| *chain == crate::mesh::NO_CHAIN));
    }

    #[test]
    fn a_trunk_thinner_than_a_texel_has_no_gap() {
        let ladder = climbed(&on_trunk(Vec3::ZERO, (9.0, 0.02), (60, 60)), Lod::CrossedQuads);
        for tile in &ladder.tiles {
            let (width, height) = (tile.width as usize, tile.height as usize);
            let is_wood: Vec<bool> = tile.recipe.share_of_first(1).map(|wood| wood > 0.9).collect();
            // Below the crown, where nothing hides it.
            let rows = (height * 2 / 3..height - 3).filter(|row| {
                let mut row = row * width..(row + 1) * width;
                row.clone().any(|i| is_wood[i]) && !row.any(|i| is_wood[i] && tile.alpha[i] > 127)
            });
            assert_eq!(rows.count(), 0, "{width} by {height}");
            assert!(is_wood.iter().filter(|is_wood| **is_wood).count() > height / 3);
        }
    }

    #[test]
    fn wood_on_quads_faces_the_viewer_and_leaves_are_lit_as_the_crown() {
        let ladder = climbed(&on_trunk(Vec3::X, (4.0, 0.2), (60, 60)), Lod::CrossedQuads);
        let (mut foot, mut leaves) = (0, 0);
        for tile in &ladder.tiles {
            let (width, height) = (tile.width as usize, tile.height as usize);
            for (i, (wood, normal)) in tile.recipe.share_of_first(1).zip(&tile.normal).enumerate() {
                let is_solid = tile.alpha[i] > 127;
                if is_solid && wood == 1.0 && i / width > height * 9 / 10 {
                    // The rectangle looks down there.
                    assert!(normal[1] > 140, "{normal:?}");
                    foot += 1;
                } else if is_solid && wood == 0.0 {
                    assert_eq!(*normal, [128, 128, 255]);
                    leaves += 1;
                }
            }
        }
        assert!(foot > 4 && leaves > 1000, "{foot} {leaves}");
    }

    #[test]
    fn cards_let_through_what_their_leaves_do_and_wood_nothing() {
        // Pictures of leaves and bark whose blue is 255, which of bark means nothing.
        let plant = on_trunk(Vec3::X, (4.0, 0.2), (60, 60));
        for lod in [Lod::CrossedQuads, Lod::BillboardCloud { cards: 6 }] {
            let ladder = climbed(&plant, lod.clone());
            let (mut wood, mut leaves, mut both) = (0, 0, 0);
            for tile in &ladder.tiles {
                let shares = tile.recipe.share_of_first(1).zip(tile.recipe.shown());
                for (((of_wood, is_shown), orm), alpha) in shares.zip(&tile.orm).zip(&tile.alpha) {
                    if !is_shown || *alpha < 8 {
                        continue;
                    }
                    let through = 255.0 * (1.0 - of_wood);
                    assert!((f32::from(orm[2]) - through).abs() < 2.0, "{lod:?} {of_wood} {orm:?}");
                    wood += usize::from(of_wood == 1.0);
                    leaves += usize::from(of_wood == 0.0);
                    both += usize::from(of_wood > 0.1 && of_wood < 0.9);
                }
            }
            let has_wood = lod == Lod::CrossedQuads;
            assert!(leaves > 1000 && (!has_wood || wood > 20 && both > 20), "{lod:?} {wood} {leaves} {both}");
        }
    }

    #[test]
    fn posts_and_lines_keep_the_colour_of_wood_however_little_of_them_is_drawn() {
        // A trunk that covers a part of each texel, below a crown.
        let plant = on_trunk(Vec3::X, (4.0, 0.004), (60, 60));
        for lod in [Lod::CrossedQuads, Lod::Impostor { frames: 6 }] {
            let tiles = climbed(&plant, lod.clone()).tiles;
            let kept = |tile: &crate::lod::Tile| {
                let texels = tile.recipe.share_of_first(1).zip(&tile.drawn).zip(&tile.alpha);
                texels.filter(|((wood, drawn), alpha)| *wood == 1.0 && **drawn == 255 && **alpha > 127).count()
            };
            assert!(tiles.iter().map(kept).sum::<usize>() > 10, "{lod:?}");
        }
    }
}
