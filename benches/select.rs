//! Benchmarks of the layer `select`: what a candidate costs. `cargo bench --bench select`.

use std::path::Path;

use divan::Bencher;
use treewright::base::Seed;
use treewright::plant::Plant;
use treewright::preset::plan::{FilterParams, MatchParams, Pick, ScoreParams};
use treewright::relate::{Family, KinId, fuzzy_family};
use treewright::select::{Examined, Habits, Profile, Sources, Topology};
use treewright::source::grow::grow;
use treewright::{blend, preset, select};

fn main() {
    divan::main();
}

const FILTER: FilterParams = FilterParams { collisions: 0.01, rise: 0.01, botany: 2.0 };
const SCORES: ScoreParams = ScoreParams { crown: 0.4, ratio: 0.2, topology: 0.4 };

fn oak(seed: u64) -> Plant {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("presets/species/oak.ron");
    let params = preset::species("oak.ron", &std::fs::read_to_string(path).unwrap()).unwrap();
    grow(&params, Seed::new(seed)).unwrap().0
}

fn family() -> Family {
    fuzzy_family(oak(1), oak(2), &MatchParams { crown: 0.5, direction: 0.25, ratio: 0.25 }).unwrap()
}

fn tree(family: &Family, i: u64) -> (Plant, Vec<KinId>) {
    family.blend_with_kins(&blend::sample(family, 0, 1, Seed::new(i), 0.1 + 0.8 * (i as f32 / 64.0)))
}

#[divan::bench]
fn pose(bencher: Bencher<'_, '_>) {
    let (plant, _) = tree(&family(), 32);
    bencher.bench(|| plant.pose());
}

#[divan::bench]
fn collisions(bencher: Bencher<'_, '_>) {
    let (plant, _) = tree(&family(), 32);
    let posed = plant.pose();
    bencher.bench(|| select::collisions(&plant, &posed, &[], &Habits::default(), &FILTER));
}

#[divan::bench]
fn profile(bencher: Bencher<'_, '_>) {
    let (plant, _) = tree(&family(), 32);
    let posed = plant.pose();
    bencher.bench(|| Profile::of(&plant, &posed));
}

#[divan::bench]
fn examine(bencher: Bencher<'_, '_>) {
    let family = family();
    let sources = Sources::of(&family, &FILTER);
    let (plant, kins) = tree(&family, 32);
    bencher.bench(|| select::examine(&plant, &kins, &sources, &FILTER));
}

#[divan::bench]
fn edit_distance_of_a_pair(bencher: Bencher<'_, '_>) {
    let family = family();
    let (a, b) = (Topology::of(&family.sources()[0]), Topology::of(&tree(&family, 32).0));
    bencher.bench(|| select::edit_distance(&a, &b));
}

fn examined() -> (Sources, Vec<Examined>) {
    let family = family();
    let sources = Sources::of(&family, &FILTER);
    let trees = (0..64)
        .map(|i| {
            let (plant, kins) = tree(&family, i);
            select::examine(&plant, &kins, &sources, &FILTER)
        })
        .collect();
    (sources, trees)
}

#[divan::bench(sample_count = 20)]
fn score_64_trees(bencher: Bencher<'_, '_>) {
    let (sources, trees) = examined();
    bencher.bench(|| select::scores(&trees, &sources, &SCORES));
}

#[divan::bench(sample_count = 20)]
fn pick_8_diverse_of_64(bencher: Bencher<'_, '_>) {
    let (sources, trees) = examined();
    let scores = select::scores(&trees, &sources, &SCORES);
    bencher.bench(|| select::pick(Pick::Diverse { apart: 0.0 }, 8, 1e9, &trees, &scores));
}
