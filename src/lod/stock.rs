//! The pictures that ladders are made with.

use std::sync::Arc;

use rayon::prelude::*;

use super::measure::Wardrobe;
use super::packed::kept;
use crate::bake::{Asked, Maps, Palette, Picture, card_cuts};
use crate::mesh::CardCut;
use crate::preset::plan::LeafCards;

/// What ladders of one set start from: the leaf pictures by slot and the bark, in plain colours.
#[derive(Clone, Debug)]
pub struct Stock {
    pub(super) wardrobe: Wardrobe,
    pub(super) palette: Palette,
    pub(super) cuts: Vec<CardCut>,
    asked: Vec<Asked>,
}

impl Stock {
    /// Makes the mips; colours are not looked at, and alpha is as an atlas keeps it.
    #[must_use]
    pub fn new(leaf_art: &[Maps], bark: &Maps) -> Self {
        let (leaves, brown) = ([96, 118, 58], [112, 98, 84]);
        let ((leaf_pictures, asked), bark) = rayon::join(
            || {
                let (alphas, asked) = kept(leaf_art);
                let made = leaf_art.par_iter().zip(alphas);
                (made.map(|(maps, alpha)| Picture::plain(maps, leaves).cut_by(&alpha)).collect(), asked)
            },
            || Picture::plain(bark, brown),
        );
        let palette = Palette::plain(std::iter::once(brown).chain(leaf_art.iter().map(|_| leaves)));
        let wardrobe = Wardrobe { leaves: leaf_pictures, bark: Arc::new(vec![bark]) };
        Self { wardrobe, palette, cuts: Vec::new(), asked }
    }

    /// The same pictures, as surfaces wear them.
    #[must_use]
    pub fn wardrobe(&self) -> &Wardrobe {
        &self.wardrobe
    }

    /// What the mips of the leaf pictures are asked for, by slot, where they are packed: nothing where no atlas holds them.
    #[must_use]
    pub fn asked(&self) -> &[Asked] {
        &self.asked
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
