//! Benchmarks of leafy morphing. `cargo bench --bench leafy`; the rows of the paper's Table 2 are figures.

mod foliage;

use std::path::Path;

use divan::Bencher;
use glam::Vec3;
use treewright::bake::{LeafMorph, leaf_maps};
use treewright::base::Seed;
use treewright::blend::morph;
use treewright::dress::dress;
use treewright::mesh::{CardShape, TubeDetail, all_cards, leaf_cards, tubes};
use treewright::plant::Plant;
use treewright::preset;
use treewright::preset::plan::{LeafShape, MatchParams, MeshParams};
use treewright::relate::{Family, PatternParams, PatternTree, groups, lobes, match_patterns, pattern_family};
use treewright::source::grow::grow;

fn main() {
    divan::main();
}

const MATCHING: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

/// A dressed tree of a shipped species.
fn leafy(species: &str, seed: u64) -> Plant {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("presets/species/{species}.ron"));
    let params = preset::species(species, &std::fs::read_to_string(path).unwrap()).unwrap();
    dress(&grow(&params, Seed::new(seed)).unwrap().0, &foliage::foliage(5000), Seed::new(seed))
}

fn family() -> Family {
    pattern_family(leafy("oak", 1), leafy("shrub", 2), &MATCHING, &PatternParams::default()).unwrap().pair_leaves(100).0
}

#[divan::bench(sample_count = 20)]
fn order_and_groups(bencher: Bencher<'_, '_>) {
    let plant = leafy("oak", 1);
    let posed = plant.pose();
    bencher.bench(|| groups(&plant, &posed, &PatternParams::default()));
}

#[divan::bench(sample_count = 20)]
fn pattern_tree(bencher: Bencher<'_, '_>) {
    let plant = leafy("oak", 1);
    bencher.bench(|| PatternTree::of(&plant, &PatternParams::default()));
}

#[divan::bench(sample_count = 20)]
fn lobes_of_5000_leaves(bencher: Bencher<'_, '_>) {
    let plant = leafy("oak", 1);
    let (posed, tree) = (plant.pose(), PatternTree::of(&plant, &PatternParams::default()));
    let places: Vec<Vec3> = plant.leaves().iter().map(|leaf| posed.leaf(&plant, leaf).position).collect();
    bencher.bench(|| lobes(&plant, &posed, &tree, &places));
}

#[divan::bench(sample_count = 20)]
fn one_to_many_matching(bencher: Bencher<'_, '_>) {
    let tree = |plant: &Plant| PatternTree::of(plant, &PatternParams::default());
    let (a, b) = (tree(&leafy("oak", 1)), tree(&leafy("shrub", 2)));
    bencher.bench(|| match_patterns(&a, &b, &MATCHING));
}

#[divan::bench(sample_count = 20)]
fn a_frame(bencher: Bencher<'_, '_>) {
    let family = family();
    bencher.bench(|| family.blend(&morph(&family, 0, 1, 0.4)));
}

#[divan::bench(sample_count = 20)]
fn a_frame_with_its_mesh(bencher: Bencher<'_, '_>) {
    let family = family();
    let detail = TubeDetail::full(&MeshParams { bark_tile: 1.5, ..MeshParams::told(12, 0.004) });
    bencher.bench(|| {
        let plant = family.blend(&morph(&family, 0, 1, 0.4));
        let posed = plant.pose();
        let cards = all_cards(&plant);
        rayon::join(|| tubes(&plant, &posed, &detail), || leaf_cards(&plant, &posed, &cards, CardShape::Folded))
    });
}

#[divan::bench(sample_count = 20)]
fn a_picture_between(bencher: Bencher<'_, '_>) {
    let made = |shape| leaf_maps(shape, [0.1, 0.2, 0.05], 0.3, 256, 0, Seed::new(1));
    let (a, b) = (made(LeafShape::Oak), made(LeafShape::Willow));
    let morph = LeafMorph::new(&a, &b);
    bencher.bench(|| morph.at(0.5));
}
