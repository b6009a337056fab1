//! Mixes four trees by weights: one family, and any point between its members.
//!
//! `cargo run --release --example 04_mix`

#![expect(clippy::print_stdout, reason = "a program that prints")]

use treewright::base::Seed;
use treewright::blend::mix;
use treewright::preset::plan::MatchParams;
use treewright::preset::species;
use treewright::relate::{Blender, nway_family};
use treewright::source::grow::grow;

const SPECIES: [&str; 4] = [
    include_str!("../presets/species/oak.ron"),
    include_str!("../presets/species/birch.ron"),
    include_str!("../presets/species/elm.ron"),
    include_str!("../presets/species/zelkova.ron"),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut plants = Vec::new();
    for (seed, text) in (1..).zip(SPECIES) {
        let params = species("species.ron", text).map_err(|errors| errors[0].to_string())?;
        plants.push(grow(&params, Seed::new(seed))?.0);
    }
    let family = nway_family(plants, &MatchParams::default())?;
    let mut blender = Blender::new(&family);
    for shares in [[1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [0.25; 4], [0.1, 0.1, 0.1, 0.7]] {
        let tree = blender.blend(&mix(&family, &shares));
        println!("{shares:?}: {} chains, {:.1} m high", tree.chains().len(), tree.height());
    }
    Ok(())
}
