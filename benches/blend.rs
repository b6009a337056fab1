//! Benchmarks of matching and blending. `cargo bench --bench blend`; the rows of the paper's Table 1 are figures.

use std::path::Path;

use divan::Bencher;
use treewright::base::{Seed, simplex_point};
use treewright::blend::{Tasks, mix};
use treewright::plant::Plant;
use treewright::preset::plan::MatchParams;
use treewright::relate::{Blender, Family, TopologyTree, fuzzy_family, match_fuzzy, nway_family};
use treewright::source::grow::grow;
use treewright::{preset, select};

fn main() {
    divan::main();
}

const MATCHING: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

/// An oak cut down to its coarsest chains.
fn oak(seed: u64, chains: usize) -> Plant {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("presets/species/oak.ron");
    let params = preset::species("oak.ron", &std::fs::read_to_string(path).unwrap()).unwrap();
    let plant = grow(&params, Seed::new(seed)).unwrap().0;
    let mut order: Vec<_> = plant.chain_ids().collect();
    order.sort_by_key(|&id| (plant.chain(id).order, id));
    select::without(&plant, order.get(chains..).unwrap_or(&[]))
}

fn family() -> Family {
    fuzzy_family(oak(1, 213), oak(2, 594), &MATCHING).unwrap()
}

#[divan::bench]
fn match_600(bencher: Bencher<'_, '_>) {
    let (a, b) = (TopologyTree::of(&oak(1, 600)), TopologyTree::of(&oak(2, 600)));
    bencher.bench(|| match_fuzzy(&a, &b, &MATCHING));
}

#[divan::bench(sample_count = 20)]
fn family_of_a_pair(bencher: Bencher<'_, '_>) {
    let (a, b) = (oak(1, 213), oak(2, 594));
    bencher.with_inputs(|| (a.clone(), b.clone())).bench_values(|(a, b)| fuzzy_family(a, b, &MATCHING));
}

#[divan::bench(sample_count = 20)]
fn schedule_317_states(bencher: Bencher<'_, '_>) {
    let family = family();
    let tasks = Tasks::new(&family, 0, 1);
    bencher.bench(|| tasks.in_betweens(Seed::new(1), 317, 0.0, 1.0));
}

#[divan::bench]
fn one_tree_from_nothing(bencher: Bencher<'_, '_>) {
    let family = family();
    let tasks = Tasks::new(&family, 0, 1);
    let weights = tasks.weights(&tasks.sample(Seed::new(1), 0.5, 1.0));
    bencher.bench(|| family.blend(&weights));
}

#[divan::bench(sample_count = 20)]
fn blend_317_trees_on_one_thread(bencher: Bencher<'_, '_>) {
    let family = family();
    let tasks = Tasks::new(&family, 0, 1);
    let states = tasks.in_betweens(Seed::new(1), 317, 0.0, 1.0);
    bencher.bench(|| {
        let (mut blender, mut plant) = (Blender::new(&family), Plant::default());
        states.iter().for_each(|state| blender.blend_into(&tasks.weights(state), &mut plant));
    });
}

#[divan::bench]
fn mix_4way_500(bencher: Bencher<'_, '_>) {
    let family = nway_family((1..5).map(|seed| oak(seed, 500)).collect(), &MATCHING).unwrap();
    let (mut blender, mut plant, mut turn) = (Blender::new(&family), Plant::default(), 0);
    bencher.bench_local(|| {
        turn += 1;
        blender.blend_into(&mix(&family, &simplex_point(4, turn)), &mut plant);
    });
}
