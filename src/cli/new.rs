//! `treewright new`: a preset to start from, with its species file. Existing files are never overwritten.

use std::fs;

use super::args::NewArguments;
use super::over::write_new;
use super::report::{Failure, Meter};

/// The species that a new preset starts with: the shipped birch.
const SPECIES: &str = include_str!("../../presets/species/birch.ron");

/// The text of a new preset; `NAME` stands for its name.
const PRESET: &str = r#"// NAME: two young trees and four between them.
//
// Metres, degrees; `treewright schema` tells all fields.
// Build it:  treewright build FOLDER/NAME.ron --out out
(
    // Another seed gives other blends and leaves.
    seed: 1,

    // Whole trees to start from: grown from a species file, or scanned, as Import(file: "scans/tree.csv").
    sources: {
        "low": Grow(species: "species/NAME.ron", seed: 1, height: 7.0),
        "high": Grow(species: "species/NAME.ron", seed: 2, height: 9.0),
    },

    // What the set holds: sources as they are, and trees on the way from one to another (0 is "low", 1 is "high").
    variants: [
        Source("low"),
        Source("high"),
        Blend(of: ["low", "high"], count: 4, from: 0.2, to: 0.8),
    ],

    // "oak", "birch", "beech", "maple", "willow", "ash", "pine", "linden", "poplar", "elm", "olive", "palm", "spruce", "cypress",
    // or a picture of your own, as Files(color: "leaf.png").
    foliage: (leaf: "birch", density: 1.0),

    // From fine to coarse. Each takes over where it is measured to look like the full tree, which is far away. Where that is
    // too dear: Thinned(triangles: 0.4, screen: 0.5) takes over where the tree covers half of the screen's height,
    // Thinned(most: 5000) has so many triangles at most, and mesh: (most: 20000) bounds the full level.
    lods: [Full, Thinned(triangles: 0.4), BillboardCloud(cards: 48), Impostor],

    atlas: (size: 2048),
)
"#;

/// Writes the two files.
pub(super) fn run(arguments: &NewArguments) -> Result<(), Failure> {
    let NewArguments { name, folder } = arguments;
    let shown = folder.to_string_lossy().replace('\\', "/");
    let text = filled(name, &shown);
    let preset = format!("{name}.ron");
    check(name, &text)?;
    let files = [(folder.join("species").join(&preset), SPECIES), (folder.join(&preset), text.as_str())];
    if let Some((taken, _)) = files.iter().find(|(path, _)| path.exists()) {
        return Err(Failure::Other(format!("{} exists; choose another name or --folder", taken.display())));
    }
    fs::create_dir_all(folder.join("species")).map_err(|e| Failure::Other(format!("can't make {shown}: {e}")))?;
    for (path, text) in &files {
        write_new(path, text)?;
        Meter::plain().line(&format!("wrote {}", path.display()));
    }
    Ok(())
}

/// The text for a name and a folder, which may hold the words that stand for them.
fn filled(name: &str, folder: &str) -> String {
    PRESET.split("FOLDER").map(|part| part.replace("NAME", name)).collect::<Vec<_>>().join(folder)
}

/// Takes the reader's word on whether the name may become part of file names, and whether the preset is good.
fn check(name: &str, text: &str) -> Result<(), Failure> {
    let plan = crate::preset::load(&format!("{name}.ron"), text, &mut |_| Ok(SPECIES.to_owned()));
    if plan.map_err(Failure::Diagnostics)?.name == name {
        Ok(())
    } else {
        Err(Failure::Other(format!("{name} is a path; give a name, and the folder as --folder")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_preset_has_no_error_and_a_bad_name_has() {
        let check = |name: &str| check(name, &filled(name, "presets"));
        assert!(check("lime_2").is_ok());
        for name in ["a b", "../x", "x/y", "", "con", "a\nb", "a\"b"] {
            assert!(check(name).is_err(), "{name:?}");
        }
    }

    #[test]
    fn a_name_and_a_folder_may_be_called_as_what_stands_for_them() {
        let text = filled("FOLDER", "NAMES");
        assert!(text.starts_with("// FOLDER: ") && text.contains("build NAMES/FOLDER.ron"), "{text}");
    }
}
