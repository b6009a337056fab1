//! How one level is made and measured: against the full level, whose outlines and colours are drawn when somebody asks.

use std::sync::{Arc, OnceLock};

use glam::Vec2;
use rayon::prelude::*;

use super::agree::{Outlines, areas};
use super::cloud::{CARD_TEXELS, CloudParams, Scene, cloud};
use super::crossed::{crossed_quads, widen};
use super::impostor::Settled;
use super::measure::{Measured, Reference, Wardrobe};
use super::memory::{Colors, Footing, Memory, Piece, Rung};
use super::parallax::CROWNS;
use super::sizes::{COARSE, FINE, SCREEN, agrees, chosen, lines, share};
use super::stock::Stock;
use super::thin::{Share, thinned_as_seen};
use super::tile::Tile;
use crate::bake::{Areas, Cutout, Maps, Picture, Silhouette, View};
use crate::base::{Seed, once};
use crate::mesh::{Cards, TreeMesh};
use crate::preset::plan::Lod;

/// Views of a measurement (fewer of thinned levels, which agree from everywhere alike), and those of them that are looked at
/// for colours: one from where the sun stands and one against it. Of pictures of more lines, which are of thinned levels in the
/// full tree's own pictures, the first tells enough.
pub(super) const VIEWS: u32 = 16;
pub(super) const COLORED: [usize; 2] = [5, 9];
const MANY_LINES: u32 = 128;

/// The full level's outlines, and those summed up for many sizes.
type Shown = (Arc<Outlines>, OnceLock<Vec<Areas>>);

/// The views that are looked at for colours in pictures of so many lines.
const fn colored(pixels: u32) -> &'static [usize] {
    if pixels > MANY_LINES { COLORED.split_at(1).0 } else { &COLORED }
}

/// What levels are measured with.
pub(super) struct Bench<'a> {
    full: &'a TreeMesh,
    flat: f32,
    stock: &'a Stock,
    /// Of the leaf pictures.
    cutouts: Vec<&'a Cutout>,
    fine: OnceLock<Shown>,
    coarse: OnceLock<Shown>,
    memory: &'a dyn Memory,
}

impl<'a> Bench<'a> {
    pub(super) fn new((full, flat): (&'a TreeMesh, f32), stock: &'a Stock, memory: &'a dyn Memory) -> Self {
        let cutouts = stock.wardrobe.cutouts();
        Self { full, flat, stock, cutouts, fine: OnceLock::new(), coarse: OnceLock::new(), memory }
    }

    /// Makes a level.
    pub(super) fn piece(&self, scene: &Scene<'_>, cards: Cards<'_>, rung: &Rung, seed: Seed) -> Piece {
        let lod = &rung.lod;
        let texels = rung.texels.unwrap_or(CARD_TEXELS);
        let wardrobe = &self.stock.wardrobe;
        let first_tile = wardrobe.leaves.len() as u32;
        match *lod {
            Lod::Full => Piece::plain(self.full.clone(), Vec::new()),
            Lod::Thinned { triangles: of_full, most } => {
                let seen = (&*self.outlines(COARSE), self.cutouts.as_slice());
                let made = thinned_as_seen(scene, cards, Share { of_full, most }, seen, seed);
                let drawn = self.outlines(FINE).draw(&made, &self.cutouts);
                Piece::plain(made, drawn)
            }
            Lod::BillboardCloud { .. } | Lod::CrossedQuads => {
                let mut made = match *lod {
                    Lod::BillboardCloud { cards } => {
                        let params = CloudParams { cards, texels, triangles: rung.triangles };
                        cloud(scene, params, wardrobe, first_tile, seed.child("cloud"))
                    }
                    _ => crossed_quads(scene, texels, wardrobe, first_tile),
                };
                let outlines = self.outlines(lines(lod));
                if let Some(share) = made.share_of_wood(self.full) {
                    let seen = (&*outlines, self.cutouts.as_slice());
                    let mesh = thinned_as_seen(scene, cards, share.into(), seen, seed);
                    let drawn = outlines.draw(&mesh, &self.cutouts);
                    return Piece::plain(mesh, drawn);
                }
                made.carve(&outlines, &self.cutouts);
                let mut drawn = made.settle(&outlines, &self.cutouts);
                if *lod == Lod::CrossedQuads {
                    drawn = widen(&mut made, (scene.plant, scene.posed), (&outlines, &self.cutouts), drawn);
                }
                let tiles = made.tiles();
                Piece { tiles, ..Piece::plain(made.tree, drawn) }
            }
            Lod::Impostor { frames } => {
                let Settled { views, alpha, drawn } =
                    Settled::new(scene, (frames, texels), wardrobe, &self.outlines(COARSE), seed);
                let mesh = views.tree(first_tile);
                Piece { tiles: vec![views.sheet(alpha)], impostor: Some(views.layout), ..Piece::plain(mesh, drawn) }
            }
        }
    }

    /// Its colours where the tree is so many pixels high, and by how much the sheet of an impostor is to be brighter to be as bright as
    /// it: solid texels are those that show most, and lighter than what stands between them. (Cards matched so were 0.95 as bright
    /// as six trees in three.js, and are 1.00 as they are.)
    pub(super) fn colors(&self, piece: &Piece, pixels: u32) -> Colors {
        let reference = self.reference(pixels);
        match (piece.impostor, piece.tiles.as_slice()) {
            (Some(layout), [sheet]) => {
                let maps = sheet.maps(&self.stock.palette);
                let seen = |view: &View| layout.worn((view.frame, CROWNS), &maps, (Vec2::ZERO, Vec2::ONE));
                let (gain, measured) = reference.matched(&seen);
                Colors { plain: Some(self.plain(&piece.mesh, sheet, pixels)), ..Colors::of(&measured, gain) }
            }
            (_, []) => Colors::of(&reference.measure(&piece.mesh, &self.stock.wardrobe), 1.0),
            (_, own) => Colors::of(&reference.measure(&piece.mesh, &self.wearing(own)), 1.0),
        }
    }

    /// How the outlines of an impostor's crossed planes agree, which are seen where there is no shader for it.
    fn plain(&self, planes: &TreeMesh, sheet: &Tile, pixels: u32) -> Measured {
        let (outlines, full) = self.shown(COARSE);
        let cutout = Cutout::as_packed(sheet.width, sheet.height, &sheet.alpha);
        // It is the first picture after those of the leaves.
        let drawn = outlines.draw(planes, &vec![&cutout; self.stock.wardrobe.leaves.len() + 1]);
        let size = COARSE as f32 * self.flat / pixels.max(1) as f32 + 0.5;
        let full = once(full, || outlines.areas());
        outlines.agreement((full, &areas(&drawn)), size as usize)
    }

    /// The full tree's outlines on so many samples.
    pub(super) fn outlines(&self, lines: u32) -> Arc<Outlines> {
        Arc::clone(&self.shown(lines).0)
    }

    fn shown(&self, lines: u32) -> &Shown {
        let kept = if lines == FINE { &self.fine } else { &self.coarse };
        let views = match lines {
            FINE => VIEWS * 3 / 8,
            // Twigs lie over each other from one side and beside each other from the next.
            _ if self.full.leaf.indices.is_empty() => VIEWS * 2,
            _ => VIEWS,
        };
        let mut make = || Outlines::new(self.full, &self.cutouts, lines as f32 * self.flat, views);
        once(kept, || (self.memory.outlines(lines, &mut make), OnceLock::new()))
    }

    /// The size of some, from the largest down, at which a level takes over.
    pub(super) fn takes_over(&self, lod: &Lod, sizes: &[usize], drawn: &[Silhouette]) -> Footing {
        let (outlines, full) = self.shown(lines(lod));
        let (full, drawn) = (once(full, || outlines.areas()), areas(drawn));
        let mut found: Vec<(f32, Measured)> = Vec::with_capacity(sizes.len());
        let mut better: Vec<f32> = Vec::with_capacity(sizes.len());
        for &size in sizes {
            let measured = outlines.agreement((full, &drawn), size);
            better.push(agrees(lod, &measured));
            found.push((share((lines(lod), self.flat), size), measured));
            if better.last().is_some_and(|better| *better >= 0.0) {
                break;
            }
        }
        let none = (share((lines(lod), self.flat), 1), Measured::same(SCREEN as u32));
        let (size, measured) = chosen(&better).map_or(none, |size| found[size]);
        Footing { size, measured }
    }

    /// What a level wears that has tiles of its own.
    fn wearing(&self, own: &[Tile]) -> Wardrobe {
        let blank = Picture::new(&Maps { width: 0, height: 0, color: vec![], normal: vec![], orm: vec![] });
        let mut leaves: Vec<Picture> = vec![blank; self.stock.wardrobe.leaves.len()];
        leaves.par_extend(own.par_iter().map(|tile| Picture::of_atlas(&tile.maps(&self.stock.palette))));
        Wardrobe { leaves, bark: self.stock.wardrobe.bark.clone() }
    }

    fn reference(&self, pixels: u32) -> Arc<Reference> {
        let mut make = || Reference::some(self.full, &self.stock.wardrobe, pixels, (VIEWS, colored(pixels)));
        self.memory.reference(pixels, &mut make)
    }
}
