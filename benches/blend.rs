//! Benchmarks of blending, a function at a time. `cargo bench --bench blend`; whole stages are figures.

#[path = "../examples/figures/table_1.rs"]
mod table_1;

use divan::Bencher;
use table_1::{FILTER, MATCHING, ROWS, SCORES};
use treewright::base::Seed;
use treewright::blend::{self, Tasks};
use treewright::plant::Plant;
use treewright::preset::plan::Pick;
use treewright::relate::{Family, KinId, fuzzy_family};
use treewright::select::{self, Examined, Habits, Profile, Sources, Topology};

fn main() {
    divan::main();
}

/// The Salix pair.
fn family() -> Family {
    let (a, b) = ROWS[0].plants();
    fuzzy_family(a, b, &MATCHING).unwrap()
}

#[divan::bench(sample_count = 20)]
fn family_of_a_pair(bencher: Bencher<'_, '_>) {
    let (a, b) = ROWS[0].plants();
    bencher.with_inputs(|| (a.clone(), b.clone())).bench_values(|(a, b)| fuzzy_family(a, b, &MATCHING));
}

#[divan::bench(sample_count = 20)]
fn schedule_a_row(bencher: Bencher<'_, '_>) {
    let family = family();
    let tasks = Tasks::new(&family, 0, 1);
    bencher.bench(|| tasks.in_betweens(Seed::new(1), ROWS[0].trees, 0.0, 1.0));
}

#[divan::bench]
fn one_tree_from_nothing(bencher: Bencher<'_, '_>) {
    let family = family();
    let tasks = Tasks::new(&family, 0, 1);
    let weights = tasks.weights(&tasks.sample(Seed::new(1), 0.5, 1.0));
    bencher.bench(|| family.blend(&weights));
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
