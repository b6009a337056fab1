//! Leaves that there are fewer of than are wanted, since a preset's `most` allows no more or branches have no room for them:
//! those that are there are longer for it, which is told where it shows.

use super::trees::Tree;
use super::wardrobe::{Dressing, Wardrobe, picture_span};
use crate::base::{Note, counted};
use crate::preset::Plan;
use crate::preset::plan::Variant;

/// How much longer than asked for leaves are told of.
const LONGER: f32 = 1.35;

/// A tree whose leaves are longer than asked for.
#[derive(Clone, Copy)]
struct Longer {
    /// How many times.
    times: f32,
    /// The length that was asked for, metres.
    asked: f32,
    /// Whether it has as many leaves as it may have.
    has_most: bool,
}

impl Longer {
    fn of(plan: &Plan, wardrobe: &Wardrobe, variant: &Variant, tree: &Tree) -> Option<Self> {
        // Sketches make trees and leaves larger by themselves.
        let Some(Dressing::Made { params, first, .. }) = wardrobe.dressing(plan, variant) else { return None };
        if matches!(variant, Variant::Sketched { .. }) {
            return None;
        }
        let asked = params.leaf_size.min(params.leaf_share * tree.plant.pose().extent());
        let pictures = first..first.saturating_add(plan.dress.pictures);
        // Of those that are made: what a source brings is as long as it is.
        let made = tree.plant.leaves().iter().filter(|leaf| pictures.contains(&leaf.slot));
        let longest = made.map(|leaf| leaf.size).fold(0.0, f32::max);
        let times = longest / (asked * (1.0 + params.leaf_spread)).max(1e-6);
        let has_most = tree.plant.leaves().len() >= params.most_leaves as usize;
        (times >= LONGER).then_some(Self { times, asked, has_most })
    }
}

/// One note for all trees of a set that may not have more leaves, and one for those that have no room for more where the
/// preset asks for more than usual.
pub(super) fn notes(plan: &Plan, wardrobe: &Wardrobe, trees: &[Tree]) -> Vec<Note> {
    let longer = plan.variants.iter().zip(trees).filter_map(|(v, tree)| Longer::of(plan, wardrobe, v, tree));
    let (cut, full): (Vec<Longer>, Vec<Longer>) = longer.partition(|longer| longer.has_most);
    let told = |some: &[Longer], about: &str, why: String, help: &str| {
        let worst = some.iter().copied().reduce(|a, b| if b.times > a.times { b } else { a })?;
        let (times, asked) = (worst.times, worst.asked / picture_span(plan));
        let trees = counted(trees.len(), "tree", "trees");
        let longer = format!("so leaves are up to {times:.1} times as long as asked for ({asked:.3} m)");
        Some(Note { about: about.to_owned(), message: format!("{} of {trees} {why}, {longer}: {help}", some.len()) })
    };
    let why = format!("would have more leaves than `most: {}` allows", plan.dress.most_leaves);
    let cut = told(&cut, "foliage.most", why, "raise `most`, lower `density`, or ask for a larger `size`");
    let why = "would have more leaves than its branches have room for".to_owned();
    let help = "lower `density`, or ask for a larger `size`";
    let full = told(if plan.own_density > 1.0 { &full } else { &[] }, "foliage.density", why, help);
    cut.into_iter().chain(full).collect()
}
