//! Blends two trees into many, keeps those that are plausible and tells how much they differ.
//!
//! `cargo run --release --example 03_blend`

#![expect(clippy::print_stdout, reason = "a program that prints")]

use treewright::base::Seed;
use treewright::blend::Tasks;
use treewright::plant::Plant;
use treewright::preset::plan::MatchParams;
use treewright::preset::species;
use treewright::relate::{Blender, fuzzy_family};
use treewright::select::{Topology, edit_distance};
use treewright::source::grow::grow;

const BIRCH: &str = include_str!("../presets/species/birch.ron");
const SHRUB: &str = include_str!("../presets/species/shrub.ron");

fn grown(text: &str, seed: u64) -> Result<Plant, Box<dyn std::error::Error>> {
    let params = species("species.ron", text).map_err(|errors| errors[0].to_string())?;
    Ok(grow(&params, Seed::new(seed))?.0)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Which chain of one corresponds to which of the other is found once ...
    let family = fuzzy_family(grown(BIRCH, 1)?, grown(SHRUB, 2)?, &MatchParams::default())?;
    println!("{} kins of two plants", family.kin_count());

    // ... and every tree in between is then a matter of microseconds: some chains have grown, wilted or changed.
    let tasks = Tasks::new(&family, 0, 1);
    let mut blender = Blender::new(&family);
    let mut trees = Vec::new();
    for i in 0..6 {
        let state = tasks.sample(Seed::new(7).at(i), 0.2 + 0.1 * i as f32, 1.0);
        trees.push(blender.blend(&tasks.weights(&state)));
    }
    let first = Topology::of(&trees[0]);
    for (i, tree) in trees.iter().enumerate() {
        let distance = edit_distance(&first, &Topology::of(tree));
        println!(
            "tree {i}: {} chains, {:.1} m, edit distance {distance} to the first",
            tree.chains().len(),
            tree.height()
        );
    }
    Ok(())
}
