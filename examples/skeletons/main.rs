//! Prints what is found in the wood of each mesh of the data folder: `cargo run --release --example skeletons`.
//!
//! With names as arguments, only those meshes; with `contraction` among them, by contraction alone.

#![expect(clippy::print_stdout, reason = "a program that prints")]

#[path = "../figures/trees.rs"]
mod trees;

use std::time::Instant;

use treewright::plant::PlantStats;
use treewright::preset::plan::ImportHeight;
use treewright::source::import::agreement;
use treewright::source::skeletonize::{Method, SkeletonParams, skeletonize};

fn main() {
    let names: Vec<String> = std::env::args().skip(1).collect();
    let data = std::env::var_os("TREEWRIGHT_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        std::path::PathBuf::from,
    );
    let method = if names.iter().any(|n| n == "contraction") { Method::Contraction } else { Method::ByPiece };
    let chosen = names.iter().filter(|n| *n != "contraction").count();
    println!("name triangles seconds stems chains height tree | found true radius chains");
    for tree in trees::trees(&data) {
        if chosen > 0 && !names.iter().any(|n| tree.name.contains(n.as_str())) {
            continue;
        }
        let params = SkeletonParams { up: tree.up, height: ImportHeight::AsIs, method, around: None };
        let start = Instant::now();
        let found = skeletonize(&tree.wood, &params);
        let time = start.elapsed().as_secs_f64();
        match found {
            Ok(found) => {
                let stats = PlantStats::of(&found.plant);
                let chains = found.plant.chains().len();
                print!(
                    "{:28} {:7} {time:7.3} {:3} {chains:6} {:8.3} {:8.3}",
                    tree.name,
                    tree.wood.triangles.len(),
                    stats.stems,
                    stats.height,
                    (tree.bounds.1 - tree.bounds.0).max_element()
                );
                if let Some(truth) = &tree.truth {
                    let a = agreement(&found.plant, truth);
                    print!(" | {:.3} {:.3} {:.3} {:.3}", a.length_found, a.length_true, a.radius_error, a.chains);
                }
                println!();
                found.notes.iter().for_each(|n| println!("    {n}"));
            }
            Err(error) => println!("{}: {error}", tree.name),
        }
    }
}
