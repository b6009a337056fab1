//! A benchmark for every stage, on one oak of the shipped species and on the shipped set.
//!
//! `cargo bench`. Times are a process's own; compare within one run.

#![expect(missing_docs, reason = "divan's macros make items without docs")]

use std::path::{Path, PathBuf};

use divan::Bencher;
use treewright::base::Seed;
use treewright::build::pipeline::{make_set, read_inputs, set_key};
use treewright::build::{Memory, load_preset};
use treewright::plant::Plant;
use treewright::preset::plan::{MatchParams, Plan};
use treewright::relate::{Family, fuzzy_family};
use treewright::source::grow::grow;
use treewright::{bake, blend, dress, export, lod, mesh, preset};

fn main() {
    divan::main();
}

fn file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn oak(seed: u64) -> Plant {
    let text = std::fs::read_to_string(file("presets/species/oak.ron")).unwrap();
    let params = preset::species("oak.ron", &text).unwrap();
    grow(&params, Seed::new(seed)).unwrap().0
}

fn plan() -> Plan {
    load_preset(&file("presets/avenue.ron")).unwrap().plan
}

const MATCHING: MatchParams = MatchParams { crown: 0.5, direction: 0.25, ratio: 0.25 };

fn family() -> Family {
    fuzzy_family(oak(1), oak(2), &MATCHING).unwrap()
}

#[divan::bench(sample_count = 10)]
fn grow_an_oak(bencher: Bencher<'_, '_>) {
    bencher.bench(|| oak(1));
}

#[divan::bench(sample_count = 10)]
fn match_two_oaks(bencher: Bencher<'_, '_>) {
    let (a, b) = (oak(1), oak(2));
    bencher.with_inputs(|| (a.clone(), b.clone())).bench_values(|(a, b)| fuzzy_family(a, b, &MATCHING));
}

#[divan::bench]
fn blend_two_oaks(bencher: Bencher<'_, '_>) {
    let family = family();
    let weights = blend::sample(&family, 0, 1, Seed::new(3), 0.5);
    bencher.bench(|| family.blend(&weights));
}

#[divan::bench(sample_count = 10)]
fn schedule_half_a_batch(bencher: Bencher<'_, '_>) {
    let family = family();
    bencher.bench(|| blend::sample(&family, 0, 1, Seed::new(3), 0.5));
}

#[divan::bench(sample_count = 10)]
fn dress_an_oak(bencher: Bencher<'_, '_>) {
    let (oak, plan) = (oak(1), plan());
    bencher.bench(|| dress::dress(&oak, &plan.dress, Seed::new(1)));
}

#[divan::bench(sample_count = 20)]
fn mesh_a_dressed_oak(bencher: Bencher<'_, '_>) {
    let plan = plan();
    let oak = dress::dress(&oak(1), &plan.dress, Seed::new(1));
    bencher.bench(|| {
        let posed = oak.pose();
        let bark = mesh::tubes(&oak, &posed, &mesh::TubeDetail::full(&plan.mesh));
        let leaf = mesh::leaf_cards(&oak, &posed, &mesh::all_cards(&oak), mesh::CardShape::Folded);
        (bark, leaf)
    });
}
