//! A benchmark for every stage, on one oak of the shipped species and on the shipped set.
//!
//! `cargo bench`. Times are a process's own; compare within one run.

use std::path::{Path, PathBuf};

use divan::Bencher;
use treewright::base::Seed;
use treewright::build::pipeline::{dress_params, make_set, read_inputs, set_key};
use treewright::build::{Cache, load_preset};
use treewright::plant::Plant;
use treewright::preset::plan::{BarkArt, LeafArt, MatchParams, Plan};
use treewright::relate::{Family, fuzzy_family};
use treewright::source::grow::grow;
use treewright::{bake, blend, dress, export, lod, preset};

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
    bencher.bench(|| dress::dress(&oak, &dress_params(&plan), Seed::new(1)));
}

#[divan::bench(sample_count = 20)]
fn mesh_a_dressed_oak(bencher: Bencher<'_, '_>) {
    let plan = plan();
    let oak = dress::dress(&oak(1), &dress_params(&plan), Seed::new(1));
    bencher.bench(|| lod::mesh_levels(&oak, &plan.mesh, &[], Seed::new(1)));
}

fn pictures(plan: &Plan) -> (Vec<bake::Maps>, bake::Maps) {
    let seed = Seed::new(1);
    let LeafArt::Made { shape, color, variation, size, .. } = plan.leaf_art else { panic!("the leaf is a made one") };
    let leaves = (0..4).map(|i| bake::leaf_maps(shape, color, variation, size, i, seed)).collect();
    let BarkArt::Made { pattern, color, size } = plan.bark_art else { panic!("the bark is a made one") };
    (leaves, bake::bark_maps(pattern, color, size, seed))
}

fn dressed(plan: &Plan) -> Plant {
    dress::dress(&oak(1), &dress_params(plan), Seed::new(1))
}

#[divan::bench(sample_count = 10)]
fn make_leaves_and_bark(bencher: Bencher<'_, '_>) {
    let plan = plan();
    bencher.bench(|| pictures(&plan));
}

#[divan::bench(sample_count = 5)]
fn lod_ladder_of_an_oak(bencher: Bencher<'_, '_>) {
    let plan = plan();
    let (oak, (leaves, bark)) = (dressed(&plan), pictures(&plan));
    bencher.bench(|| lod::ladder(&oak, &plan.mesh, &plan.lods, &leaves, &bark, Seed::new(1)));
}

#[divan::bench(sample_count = 10)]
fn pack_an_atlas(bencher: Bencher<'_, '_>) {
    let plan = plan();
    let (leaves, bark) = pictures(&plan);
    let ladder = lod::ladder(&dressed(&plan), &plan.mesh, &plan.lods, &leaves, &bark, Seed::new(1));
    // As many cards as eight variants have.
    let palette = lod::palette(&leaves, &bark);
    let cards: Vec<bake::Maps> = ladder.tiles.iter().map(|tile| tile.maps(&palette)).collect();
    let tiles: Vec<&bake::Maps> = leaves.iter().chain((0..8).flat_map(|_| &cards)).collect();
    bencher.bench(|| bake::pack(&tiles, &plan.atlas));
}

#[divan::bench(sample_count = 20)]
fn export_a_glb(bencher: Bencher<'_, '_>) {
    let plan = plan();
    let (leaves, bark) = pictures(&plan);
    let ladder = lod::ladder(&dressed(&plan), &plan.mesh, &plan.lods, &leaves, &bark, Seed::new(1));
    let levels: Vec<export::AssetLevel<'_>> = ladder
        .levels
        .iter()
        .map(|level| export::AssetLevel {
            mesh: &level.mesh,
            screen_coverage: level.screen_coverage,
            impostor: None,
            wind: None,
        })
        .collect();
    let materials = export::SetMaterials::of("oak", treewright::preset::plan::TextureFormat::Png);
    let asset = export::AssetIn { name: "oak_001", seed: 1, below: 0.0, levels: &levels, materials: &materials };
    bencher.bench(|| export::glb(&asset));
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn whole_set(bencher: Bencher<'_, '_>) {
    let loaded = load_preset(&file("presets/avenue.ron")).unwrap();
    let inputs = read_inputs(&loaded).unwrap();
    let key = set_key(&loaded.plan, &inputs);
    bencher.bench(|| make_set(&loaded.plan, &inputs, key, &Cache::default(), &|_| {}));
}
