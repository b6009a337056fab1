//! Makes a whole set in memory, from a preset and a species to GLB bytes: for editors and servers without a folder.
//!
//! `cargo run --release --example 07_set`

#![expect(clippy::print_stdout, reason = "a program that prints")]

use std::collections::BTreeMap;

use treewright::build::make_set;

const PRESET: &str = r##"(
    seed: 3,
    sources: {
        "low": Grow(species: "shrub.ron", seed: 1, height: 2.0),
        "high": Grow(species: "shrub.ron", seed: 2, height: 3.0),
    },
    variants: [Blend(of: ["low", "high"], count: 2)],
    foliage: (leaf: "birch", most: 1500, color: "#6a8a35"),
    bark: (texture: "papery", resolution: 256),
    lods: [Full, Thinned(triangles: 0.4), CrossedQuads],
    atlas: (size: 512),
)"##;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shrub = include_str!("../presets/species/shrub.ron");
    let files = BTreeMap::from([
        ("shrubs.ron".to_owned(), PRESET.as_bytes().to_vec()),
        ("shrub.ron".to_owned(), shrub.as_bytes().to_vec()),
    ]);
    let set = make_set("shrubs.ron", files)?;
    for (name, bytes) in &set.files {
        println!("{name}: {} bytes", bytes.len());
    }
    set.notes.iter().for_each(|note| println!("{}", note.message));
    Ok(())
}
