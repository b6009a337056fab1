//! Leaves that there are fewer of than are wanted, since a preset's `most` allows no more: those that stay are longer for it,
//! which is told where it shows.

use super::trees::Tree;
use super::wardrobe::{Dressing, Wardrobe, picture_span};
use crate::base::Note;
use crate::preset::Plan;
use crate::preset::plan::Variant;

/// How much longer than asked for leaves are told of.
const LONGER: f32 = 1.35;

/// One note for all trees of a set.
pub(super) fn notes(plan: &Plan, wardrobe: &Wardrobe, trees: &[Tree]) -> Option<Note> {
    let longer = |(variant, tree): (&Variant, &Tree)| {
        // Sketches make trees and leaves larger by themselves.
        let Some(Dressing::Made { params, .. }) = wardrobe.dressing(plan, variant) else { return None };
        if matches!(variant, Variant::Sketched { .. }) || tree.plant.leaves().len() < params.most_leaves as usize {
            return None;
        }
        let asked = params.leaf_size.min(params.leaf_share * tree.plant.pose().extent());
        let longest = tree.plant.leaves().iter().map(|leaf| leaf.size).fold(0.0, f32::max);
        Some((longest / (asked * (1.0 + params.leaf_spread)).max(1e-6), asked))
    };
    let cut: Vec<(f32, f32)> = plan.variants.iter().zip(trees).filter_map(longer).filter(|l| l.0 >= LONGER).collect();
    let worst = cut.iter().copied().reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    let (times, most) = (worst.0, plan.dress.most_leaves);
    let message = format!(
        "{} of {} trees would have more leaves than `most: {most}` allows, so theirs are up to {times:.1} times as long as \
         asked for ({:.3} m): raise `most`, lower `density`, or ask for a larger `size`",
        cut.len(),
        trees.len(),
        worst.1 / picture_span(plan)
    );
    Some(Note { about: "foliage.most".to_owned(), message })
}
