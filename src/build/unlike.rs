//! Levels of detail that are unlike their trees where they take over: the manifest tells the figures of all, and these are
//! told aloud, with what helps.

use super::trees::Tree;
use crate::base::Note;
use crate::lod::{Level, Measured};
use crate::preset::Plan;
use crate::preset::plan::Lod;

/// Overlap of outlines below which a level is another tree, and how far what it covers may be off.
const ALIKE: f32 = 0.7;
const COVERS: f32 = 0.15;

/// One note a level of the preset that is unlike the tree in some variants, of the worst of them, and one where it has more
/// triangles than the level before.
pub(super) fn notes(plan: &Plan, trees: &[Tree]) -> Vec<Note> {
    let mut notes = Vec::new();
    for (place, lod) in plan.lods.iter().enumerate().skip(1) {
        let about = format!("lods[{place}]");
        let levels =
            || trees.iter().zip(1..).filter_map(|(tree, n)| Some((n, tree.ladder.levels.get(place - 1..=place)?)));
        let is_unlike = |level: &Level| level.measured.iou < ALIKE || (level.measured.coverage - 1.0).abs() > COVERS;
        let unlike: Vec<(i32, &Level)> =
            levels().map(|(n, pair)| (n, &pair[1])).filter(|(_, level)| is_unlike(level)).collect();
        if let Some((n, worst)) = unlike.iter().min_by(|a, b| a.1.measured.iou.total_cmp(&b.1.measured.iou)) {
            let help = match lod.lod {
                Lod::Thinned { .. } => "raise its `triangles`",
                Lod::BillboardCloud { .. } => "give it more `cards`, or the atlas a larger `size`",
                _ => "give it a smaller `screen`, or put a level before it",
            };
            let (many, all) = (unlike.len(), trees.len());
            let are = if many == 1 { "variant is unlike its tree" } else { "variants are unlike their trees" };
            let of_all = if many == all { String::new() } else { format!(" of {all}") };
            let Measured { iou, pixels, coverage, .. } = worst.measured;
            let message = format!(
                "{many}{of_all} {are} where it takes over: outlines of number {n} overlap by {iou:.2} of 1 at {pixels} pixels, \
                 and cover {coverage:.2} times as much; {help}"
            );
            notes.push(Note { about: about.clone(), message });
        }
        let grown = levels().find(|(_, pair)| pair[1].triangles > pair[0].triangles);
        if let Some((n, [before, after])) = grown {
            let message = format!(
                "number {n} has {} triangles here and {} in the level before; leave one of the two out",
                after.triangles, before.triangles
            );
            notes.push(Note { about, message });
        }
    }
    notes
}
