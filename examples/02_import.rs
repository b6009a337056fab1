//! Imports a skeleton: parents that are missing are bridged, and what was mended is told.
//!
//! `cargo run --release --example 02_import`

#![expect(clippy::print_stdout, reason = "a program that prints")]

use treewright::preset::plan::{ImportHeight, ImportParams};
use treewright::source::import::import;

/// SWC, Z up, with a twig whose parent (9) is not in the file.
const SKELETON: &str = "\
1 1 0 0 0 0.10 -1
2 5 0 0 1 0.08 1
3 5 0 0 2 0.05 2
4 5 0.4 0 2.5 0.03 3
5 5 -0.4 0 2.6 0.03 3
6 5 0 0.3 1.8 0.02 2
7 5 0.1 0.3 2.2 0.02 -1
8 5 0.1 0.3 2.6 0.01 7
";

fn main() {
    // The format is told by what the file holds; meshes, scans and skeletons all come in by this door.
    let params = ImportParams { height: ImportHeight::Metres(6.0), ..ImportParams::default() };
    match import(SKELETON.as_bytes(), "twig.swc", &params) {
        Ok(imported) => {
            let plant = imported.plant;
            println!("{}: {} chains, {:.1} m high", imported.format.name(), plant.chains().len(), plant.height());
            imported.notes.iter().for_each(|note| println!("  {note}"));
        }
        Err(errors) => errors.iter().for_each(|error| println!("{error}")),
    }

    // What is wrong with a file is told with its place and the way to mend it.
    let broken = SKELETON.replace("0.4 0 2.5", "0.4 zero 2.5").replace(" 0.01 7", "");
    let errors = import(broken.as_bytes(), "broken.swc", &ImportParams::default());
    errors.err().iter().flatten().for_each(|error| println!("{error}"));
}
