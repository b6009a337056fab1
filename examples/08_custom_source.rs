//! Hands a tree of its own making to a preset: a spiral palm that no species file describes.
//!
//! `cargo run --release --example 08_custom_source`

#![expect(clippy::print_stdout, reason = "a program that prints")]

use std::collections::BTreeMap;

use treewright::base::math::sin_cos;
use treewright::build::make_set;
use treewright::plant::{Plant, PlantBuilder, PlantError, dump};

use glam::Vec3;

const PRESET: &str = r#"(
    seed: 3,
    sources: { "palm": Import(file: "spiral.plant"), "tall": Import(file: "spiral.plant", height: 6.0) },
    variants: [Blend(of: ["palm", "tall"], count: 2)],
    foliage: (leaf: "willow", most: 800),
    lods: [Full, CrossedQuads],
    atlas: (size: 512),
)"#;

/// A leaning stem with fronds in a spiral; points of a chain are relative to where it begins.
fn spiral() -> Result<Plant, PlantError> {
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(
        Vec3::ZERO,
        &[Vec3::ZERO, Vec3::new(0.1, 1.5, 0.0), Vec3::new(0.4, 3.0, 0.0), Vec3::new(0.9, 4.0, 0.0)],
        &[0.14, 0.11, 0.1, 0.08],
    );
    for i in 0..21 {
        let (sin, cos) = sin_cos(i as f32 * 2.399_963);
        let out = Vec3::new(cos, 0.0, sin);
        let arch = [Vec3::ZERO, out * 0.6 + Vec3::Y * 0.5, out * 1.3 + Vec3::Y * 0.5, out * 1.8 - Vec3::Y * 0.1];
        builder.branch(stem, 0.8 + 0.0095 * i as f32, &arch, &[0.03, 0.025, 0.02, 0.006]);
    }
    builder.finish()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let files = BTreeMap::from([
        ("palms.ron".to_owned(), PRESET.as_bytes().to_vec()),
        ("spiral.plant".to_owned(), dump(&spiral()?).into_bytes()),
    ]);
    let folder = std::path::Path::new("out/palms");
    std::fs::create_dir_all(folder)?;
    for (name, bytes) in make_set("palms.ron", files)?.files {
        std::fs::write(folder.join(&name), &bytes)?;
        println!("out/palms/{name}: {} bytes", bytes.len());
    }
    Ok(())
}
