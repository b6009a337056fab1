//! Grown plants lie where measured ones do, and trees grown like a scan are like it. In short; the whole table is
//! `cargo run --release --example plausibility`.

#![expect(clippy::print_stderr, reason = "says what was skipped")]

use std::path::{Path, PathBuf};

use treewright::base::Seed;
use treewright::plant::{Habit, Plant, Span};
use treewright::preset::plan::{GrowParams, ImportParams};
use treewright::preset::species;
use treewright::source::estimate::estimate;
use treewright::source::grow::grow;
use treewright::source::import::import;

/// The folder of skeletons; none, with a word about it, where the data is absent, which CI does not allow.
fn skeletons() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("TREEWRIGHT_DATA").map_or_else(beside, PathBuf::from).join("skeleton");
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "the test data is missing: {}", folder.display());
    eprintln!("skipped: no test data at {}", folder.display());
    None
}

const REAL: [&str; 6] = [
    "itsme_buttressed_1.csv",
    "itsme_tree_2.csv",
    "rtwig_small.csv",
    "rtwig_small_simpleforest.csv",
    "mtg_apple_agraf.swc",
    "plantgeom_coffee.swc",
];

fn scan(folder: &Path, name: &str) -> Plant {
    let params = ImportParams::default();
    import(&std::fs::read(folder.join(name)).unwrap(), name, &params).unwrap().plant
}

fn tree(params: &GrowParams, seed: u64) -> Plant {
    grow(&GrowParams { seed, ..params.clone() }, Seed::new(seed).child("grow")).unwrap().0
}

/// A shipped species, coarser than shipped.
fn shipped(name: &str) -> GrowParams {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("presets/species/{name}.ron"));
    let params = species(name, &std::fs::read_to_string(file).unwrap()).unwrap();
    GrowParams { nodes: params.nodes / 5, ..params }
}

#[test]
fn shipped_species_lie_within_what_measured_plants_span() {
    let Some(folder) = skeletons() else { return };
    let span = Span::of(&REAL.map(|name| Habit::of(&scan(&folder, name))));
    assert!(span.ranges.iter().all(Option::is_some), "{span:?}");
    for name in ["oak", "birch", "shrub"] {
        let mut habit = Habit::of(&tree(&shipped(name), 1));
        habit.add(&Habit::of(&tree(&shipped(name), 2)));
        let outside: Vec<String> =
            habit.outside(&span).iter().map(|(of, median)| format!("{} {}: {median}", of.name, of.order)).collect();
        assert!(outside.is_empty(), "{name}: {outside:?} {span:?}");
    }
    // A test that a mere broom would pass is none.
    let text = "(height: 9.0, nodes: 4000, width: 0.3, allometry: 1.0, iterations: [
        (endpoints: Volume(shape: Cylinder(bottom: 0.9, top: 1.0, radius: 0.05), count: 60)),
    ])";
    let broom = Habit::of(&tree(&species("broom", text).unwrap(), 1));
    assert!(!broom.outside(&span).is_empty());
}

#[test]
fn trees_grown_like_a_scan_are_nearer_to_it_than_another_species() {
    let Some(folder) = skeletons() else { return };
    for name in ["rtwig_small.csv", "itsme_buttressed_1.csv"] {
        let scan = scan(&folder, name);
        let habit = Habit::of(&scan);
        let estimate = estimate(&scan).unwrap();
        let near = habit.distance(&Habit::of(&tree(&estimate.params, 77)));
        let far = habit.distance(&Habit::of(&tree(&shipped("oak"), 77)));
        assert!(near < far * 0.85, "{name}: {near} {far}\n{}", estimate.text);
    }
}
