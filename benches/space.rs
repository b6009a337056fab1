//! Benchmarks of the shape space. `cargo bench --bench space`; the rows of the paper's Table 2 are figures.

use std::path::Path;

use divan::Bencher;
use treewright::base::Seed;
use treewright::blend::shape::{
    Comparison, Metric, Reflection, TreeGeodesic, TreePoint, distance, frechet_mean, weighted_mean,
};
use treewright::plant::Plant;
use treewright::preset::plan::ElasticParams;
use treewright::relate::{ElasticCurve, elastic_family, register};
use treewright::source::grow::grow;
use treewright::{preset, select};

fn main() {
    divan::main();
}

/// An oak cut down to its coarsest chains.
fn oak(seed: u64, chains: usize) -> Plant {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("presets/species/oak.ron");
    let params = preset::species("oak.ron", &std::fs::read_to_string(path).unwrap()).unwrap();
    let plant = grow(&params, Seed::new(seed)).unwrap().0;
    let mut order: Vec<_> = plant.chain_ids().collect();
    order.sort_by_key(|&id| (plant.chain(id).order, id));
    select::without(&plant, order.get(chains..).unwrap_or(&[])).without_leaves()
}

#[divan::bench]
fn register_two_branches(bencher: Bencher<'_, '_>) {
    let (a, b) = (oak(1, 30), oak(2, 30));
    let curve = |plant: &Plant| ElasticCurve::new(plant.points(plant.chain_ids().nth(3).unwrap()));
    let (a, b) = (curve(&a), curve(&b));
    bencher.bench(|| register(&a, &b));
}

#[divan::bench(sample_count = 20)]
fn family_of_28_and_790_nodes(bencher: Bencher<'_, '_>) {
    let (a, b) = (oak(1, 14), oak(2, 395));
    bencher.with_inputs(|| vec![a.clone(), b.clone()]).bench_values(|p| elastic_family(p, &ElasticParams::default()));
}

#[divan::bench(sample_count = 20)]
fn family_of_five(bencher: Bencher<'_, '_>) {
    let plants: Vec<Plant> = (1..6).map(|seed| oak(seed, 200)).collect();
    bencher.with_inputs(|| plants.clone()).bench_values(|p| elastic_family(p, &ElasticParams::default()));
}

#[divan::bench]
fn tree_on_a_geodesic(bencher: Bencher<'_, '_>) {
    let family = elastic_family(vec![oak(1, 150), oak(2, 180)], &ElasticParams::default()).unwrap();
    bencher.bench(|| family.blend(&weighted_mean(&family, &[0.5, 0.5])));
}

#[divan::bench]
fn qed_geodesic(bencher: Bencher<'_, '_>) {
    let family = elastic_family(vec![oak(1, 150), oak(2, 180)], &ElasticParams::default()).unwrap();
    let (a, b) = (TreePoint::of(&family, 0), TreePoint::of(&family, 1));
    bencher.bench(|| TreeGeodesic::new(&a, &b).length());
}

#[divan::bench(sample_count = 10)]
fn sturms_mean_of_five(bencher: Bencher<'_, '_>) {
    let family = elastic_family((1..6).map(|s| oak(s, 200)).collect(), &ElasticParams::default()).unwrap();
    let points: Vec<TreePoint> = (0..5).map(|s| TreePoint::of(&family, s)).collect();
    bencher.bench(|| frechet_mean(&points, &[1.0; 5], 10));
}

#[divan::bench(sample_count = 20)]
fn distance_of_two(bencher: Bencher<'_, '_>) {
    let (a, b) = (oak(1, 150), oak(2, 180));
    bencher.bench(|| distance(&a, &b, &Comparison::by(Metric::Qed)));
}

#[divan::bench(sample_count = 10)]
fn best_mirror_plane(bencher: Bencher<'_, '_>) {
    let plant = oak(1, 80);
    bencher.bench(|| Reflection::best(&plant, &ElasticParams::default()).unwrap().azimuth());
}
