//! The pictures that ladders are made with.

use std::sync::Arc;

use rayon::prelude::*;

use super::measure::Wardrobe;
use super::packed::kept;
use crate::bake::{Maps, Palette, Picture, card_cuts};
use crate::mesh::CardCut;
use crate::plant::{Leaf, LeafForm};
use crate::preset::plan::LeafCards;

/// What ladders of one set start from: the leaf pictures by slot and the bark, in plain colours.
#[derive(Clone, Debug)]
pub struct Stock {
    pub(super) wardrobe: Wardrobe,
    pub(super) palette: Palette,
    pub(super) cuts: Vec<CardCut>,
    alphas: Vec<Vec<u8>>,
}

impl Stock {
    /// Makes the mips; colours are not looked at, and alpha is as an atlas keeps it.
    #[must_use]
    pub fn new(leaf_art: &[Maps], bark: &Maps) -> Self {
        let (leaves, brown) = ([96, 118, 58], [112, 98, 84]);
        let ((leaf_pictures, alphas), bark) = rayon::join(
            || {
                let alphas = kept(leaf_art);
                let made = leaf_art.par_iter().zip(&alphas);
                (made.map(|(maps, alpha)| Picture::plain(maps, leaves).cut_by(alpha)).collect(), alphas)
            },
            || Picture::plain(bark, brown),
        );
        let palette = Palette::plain(std::iter::once(brown).chain(leaf_art.iter().map(|_| leaves)));
        let wardrobe = Wardrobe { leaves: leaf_pictures, bark: Arc::new(vec![bark]) };
        Self { wardrobe, palette, cuts: Vec::new(), alphas }
    }

    /// The same pictures, as surfaces wear them.
    #[must_use]
    pub fn wardrobe(&self) -> &Wardrobe {
        &self.wardrobe
    }

    /// Alpha of the leaf pictures as an atlas keeps it, by slot: made so that their mips show as much.
    #[must_use]
    pub fn alphas(&self) -> &[Vec<u8>] {
        &self.alphas
    }

    /// What of a leaf's card is drawn, 0..=1, where cards are cut out.
    #[must_use]
    pub fn drawn(&self, leaf: &Leaf) -> f32 {
        let Some([flat, folded, _]) = self.cuts.get(usize::from(leaf.slot)).map(CardCut::areas) else { return 1.0 };
        match leaf.form {
            LeafForm::Frond { .. } => 1.0,
            LeafForm::Flat(_) => flat,
            LeafForm::Square => folded,
        }
    }

    /// Bytes that it takes, about.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.wardrobe.leaves.iter().chain(&*self.wardrobe.bark).map(Picture::weight).sum()
    }

    /// With the outlines of the leaf pictures, where leaves are to be cut out.
    #[must_use]
    pub fn cut(self, leaf_art: &[Maps], leaves: LeafCards) -> Self {
        Self { cuts: card_cuts(leaf_art, leaves), ..self }
    }
}

/// The palette that [`Tile`](super::Tile)s are painted with: bark, then leaf pictures by slot.
#[must_use]
pub fn palette(leaf_art: &[Maps], bark: &Maps) -> Palette {
    Palette::new(std::iter::once(bark).chain(leaf_art))
}
