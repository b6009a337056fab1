//! The README's tables of levels, as Markdown: `LOD_PARTS=table`.

use std::collections::BTreeMap;

use treewright::lod::Measured;

use crate::lod::{Kind, Summary};

/// Kinds of levels, in the order of the columns.
const KINDS: [(&str, &str); 4] = [
    ("Thinned", "thinned to 40 % of the triangles"),
    ("BillboardCloud", "48 cards"),
    ("Impostor", "impostor, 8 triangles"),
    ("CrossedQuads", "crossed quads, 8 triangles"),
];

/// A tree whose LOD1 is compared with what a simplifier makes of its LOD0.
pub(crate) struct Against {
    pub(crate) tree: String,
    pub(crate) pixels: u32,
    /// Of the ladder and of the simplifier: triangles, what was measured, and leaf area over LOD0's.
    pub(crate) both: [(usize, Measured, f32); 2],
}

/// Levels by set, and the simplifier's.
pub(crate) fn print(kinds: &BTreeMap<String, Kind>, against: &[Against]) {
    let of = |kind: &str| kinds.get(kind).map_or(&[][..], |kind| kind.measured.as_slice());
    let set_of = |name: &str| name.split(' ').next().unwrap_or_default().to_owned();
    let mut sets: Vec<String> = KINDS.iter().flat_map(|kind| of(kind.0)).map(|level| set_of(&level.0)).collect();
    sets.sort();
    sets.dedup();
    let shown: Vec<_> = KINDS.iter().filter(|kind| !of(kind.0).is_empty()).collect();
    println!("| set | {} |", shown.iter().map(|kind| kind.1).collect::<Vec<_>>().join(" | "));
    println!("|---|{}", "---|".repeat(shown.len()));
    let row = |name: &str, is_of: &dyn Fn(&str) -> bool| {
        let cells = shown.iter().map(|kind| cell(of(kind.0).iter().filter(|level| is_of(&level.0))));
        println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
    };
    for set in &sets {
        row(set, &|level| set_of(level) == *set);
    }
    row("all", &|_| true);
    println!("\n| tree, pixels | triangles | by | IoU | coverage | FLIP | leaf area |\n|---|---|---|---|---|---|---|");
    for Against { tree, pixels, both } in against {
        for ((triangles, m, area), who) in both.iter().zip(["ladder", "simplifier"]) {
            let (iou, worst) = (m.iou, m.worst_iou);
            println!(
                "| {tree}, {pixels} | {triangles} | {who} | {iou:.3}, {worst:.3} | {:.3} | {:.3} | {area:.3} |",
                m.coverage, m.flip
            );
        }
    }
}

/// Pixels, IoU (mean, worst view), coverage (least, most), FLIP (worst level's mean).
fn cell<'a>(levels: impl Iterator<Item = &'a (String, Measured)> + Clone) -> String {
    if levels.clone().next().is_none() {
        return String::new();
    }
    let s = Summary::of(levels.map(|level| &level.1));
    let (low, high) = s.pixels;
    let pixels = if low == high { format!("{low}") } else { format!("{low} to {high}") };
    format!("{pixels} px: {:.2}, {:.2}; {:.2} to {:.2}; {:.2}", s.iou, s.worst, s.coverage.0, s.coverage.1, s.flip)
}
