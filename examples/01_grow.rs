//! Grows a tree of a species, then two more on the same graph, which is the dearest part of growing.
//!
//! `cargo run --release --example 01_grow`

#![expect(clippy::print_stdout, reason = "a program that prints")]

use treewright::base::Seed;
use treewright::plant::{PlantStats, dump};
use treewright::preset::species;
use treewright::source::grow::{Graph, GraphParams, ObstacleMeshes, Solids, grow, grow_on};

const OAK: &str = include_str!("../presets/species/oak.ron");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let params = species("oak.ron", OAK).map_err(|errors| errors[0].to_string())?;

    let (oak, notes) = grow(&params, Seed::new(1))?;
    println!("{} chains, {:.1} m high; {} notes", oak.chains().len(), oak.height(), notes.len());

    // Endpoints within meshes or outlines are read into `Solids`; this species names none.
    let graph = Graph::new(&GraphParams::of(&params, &Solids::new())?, &ObstacleMeshes::new())?;
    for seed in [2, 3] {
        let (oak, _) = grow_on(&graph, &params, &Solids::new(), Seed::new(seed))?;
        let stats = PlantStats::of(&oak);
        println!("seed {seed}: {} chains, Gravelius orders up to {}", stats.chains, stats.orders.len());
    }

    // A plant as text, exact to the bit: for tests, for people, and as a source of presets (see 08_custom_source).
    println!("{} bytes as text", dump(&oak).len());
    Ok(())
}
