//! Which pictures of a set turn with the season: those that came with sources or are the user's own. Each is worn in copies of
//! several colours where there are few, so that a crown is not all of one.

use rayon::prelude::*;

use crate::bake::{self, Maps};
use crate::base::Seed;
use crate::preset::plan::LeafTurn;

/// The pictures of a set by slot, and what becomes of each.
pub(super) struct Rack<'a> {
    turn: Option<&'a LeafTurn>,
    pub(super) pictures: Vec<Maps>,
    /// Which of the colours of the season each takes; none of those that keep their own.
    colors: Vec<Option<u32>>,
}

/// Where pictures hang.
#[derive(Clone, Copy)]
pub(super) struct Hung {
    /// The first slot.
    pub(super) first: u16,
    /// How many slots there are.
    pub(super) count: u16,
    /// How many there are of each picture, one beside the other.
    copies: u16,
}

impl<'a> Rack<'a> {
    pub(super) fn new(turn: Option<&'a LeafTurn>) -> Self {
        Self { turn, pictures: Vec::new(), colors: Vec::new() }
    }

    /// Adds pictures that keep their colours.
    pub(super) fn hang(&mut self, pictures: &[Maps]) -> Hung {
        let first = self.pictures.len() as u16;
        self.pictures.extend_from_slice(pictures);
        self.colors.resize(self.pictures.len(), None);
        Hung { first, count: pictures.len() as u16, copies: 1 }
    }

    /// Adds pictures that turn, where something does.
    pub(super) fn hang_to_turn(&mut self, pictures: &[Maps]) -> Hung {
        let Some(turn) = self.turn else { return self.hang(pictures) };
        let first = self.pictures.len() as u16;
        let copies = turn.copies(pictures.len());
        let all = pictures.iter().flat_map(|maps| std::iter::repeat_n(maps, copies.into()));
        self.pictures.extend(all.cloned());
        let count = self.pictures.len() as u16 - first;
        self.colors.extend((0..u32::from(count)).map(Some));
        Hung { first, count, copies }
    }

    /// The pictures as `fit` has them, in their colours.
    pub(super) fn turned(self, fit: impl Fn(Maps) -> Maps + Sync) -> Vec<Maps> {
        let turned = |(maps, color): (Maps, Option<u32>)| match (self.turn, color) {
            (Some(turn), Some(color)) => bake::turned_leaf(fit(maps), turn, color),
            _ => fit(maps),
        };
        self.pictures.into_par_iter().zip(self.colors).map(turned).collect()
    }
}

impl Hung {
    /// The slot of a leaf that wore the source's picture of that index.
    pub(super) fn slot(&self, picture: u16, leaf: Seed) -> u16 {
        self.first + picture * self.copies + leaf.child("turn").index(self.copies.into()) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOLD: LeafTurn = LeafTurn::Colors { first: [0.4, 0.2, 0.02], last: [0.2, 0.2, 0.02] };

    fn maps(color: [u8; 3]) -> Maps {
        let [r, g, b] = color;
        Maps { width: 1, height: 1, color: vec![[r, g, b, 255]], normal: vec![[128; 3]], orm: vec![[255; 3]] }
    }

    #[test]
    fn pictures_of_sources_turn_in_several_colours_and_made_ones_stay() {
        let green = [80, 120, 40];
        let mut rack = Rack::new(Some(&GOLD));
        let own = rack.hang_to_turn(&[maps(green), maps(green)]);
        let made = rack.hang(&[maps(green)]);
        assert_eq!(((own.first, own.count), (made.first, made.count)), ((0, 4), (4, 1)));
        let turned = rack.turned(|maps| maps);
        let mut colors: Vec<_> = turned.iter().map(|maps| maps.color[0]).collect();
        assert_eq!((colors.len(), &colors[4][..3]), (5, &green[..]));
        colors.dedup();
        assert!(colors.len() == 5 && colors[..4].iter().all(|c| c[0] >= c[1]), "{colors:?}");
        // Leaves of each picture wear all of its copies, and no other's.
        let slots = |picture| (0..64).map(move |k| own.slot(picture, Seed::new(7).at(k)));
        assert!(slots(0).all(|slot| slot < 2) && slots(1).all(|slot| (2..4).contains(&slot)));
        assert!([0, 1].iter().all(|slot| slots(0).any(|s| s == *slot)));
    }

    #[test]
    fn one_colour_needs_no_copies() {
        let first = [0.4, 0.2, 0.02];
        let plain = LeafTurn::Colors { first, last: first };
        for turn in [None, Some(&plain), Some(&LeafTurn::Lighter { gain: [1.5; 3] })] {
            let mut rack = Rack::new(turn);
            let hung = rack.hang_to_turn(&[maps([80, 120, 40])]);
            assert_eq!((hung.count, hung.slot(0, Seed::new(1))), (1, 0));
        }
    }
}
