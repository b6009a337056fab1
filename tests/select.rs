//! Picks in whole sets: as many trees as asked for, reasons in the manifest, and what selects nothing is an error at its
//! line.

use std::fs;
use std::path::Path;

use treewright::base::Diagnostic;
use treewright::build::pipeline::{SetFiles, make_set, read_inputs, set_key};
use treewright::build::{Cache, load_preset};
use treewright::preset::place;

/// A set of two shrubs and what the entry gives of them.
fn preset(entry: &str) -> String {
    format!(
        r#"(
    sources: {{"a": Grow(species: "species/shrub.ron", seed: 1), "b": Grow(species: "species/shrub.ron", seed: 4)}},
    variants: [
        {entry},
    ],
    foliage: (leaf: "beech", density: 0.1, most: 50, resolution: 64),
    bark: (resolution: 64),
    lods: [Full, CrossedQuads],
    atlas: (size: 512),
)"#
    )
}

fn built(entry: &str) -> Result<SetFiles, Vec<Diagnostic>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("species")).unwrap();
    fs::copy(root.join("presets/species/shrub.ron"), folder.path().join("species/shrub.ron")).unwrap();
    let file = folder.path().join("small.ron");
    fs::write(&file, preset(entry)).unwrap();
    let loaded = load_preset(&file).unwrap();
    let inputs = read_inputs(&loaded).unwrap();
    make_set(&loaded.plan, &inputs, set_key(&loaded.plan, &inputs), &Cache::default(), &|_| {})
}

fn manifest(files: &SetFiles) -> serde_json::Value {
    serde_json::from_slice(&files.files.last().unwrap().1).unwrap()
}

#[test]
fn a_pick_keeps_as_many_trees_as_asked_and_the_manifest_tells_why() {
    let made = built(r#"Blend(of: ["a", "b"], count: 2, pick: Inspiring, candidates: 10)"#).unwrap();
    let manifest = manifest(&made);
    let variants = manifest["variants"].as_array().unwrap();
    assert_eq!(variants.len(), 2);
    for variant in variants {
        let told = &variant["recipe"]["selected"];
        assert_eq!((told["pick"].as_str(), told["candidates"].as_u64()), (Some("Inspiring"), Some(10)));
        assert!(told["score"]["inspiring"].as_f64().unwrap() > 0.0, "{told}");
        assert_eq!(told["score"]["from_sources"].as_array().unwrap().len(), 2);
        assert_eq!(variant["topology_continuity"], 1.0);
    }
    assert_ne!(variants[0]["seed"], variants[1]["seed"]);
}

#[test]
fn a_filter_that_rejects_all_keeps_the_least_bad_and_warns() {
    // Blends are never quite in the range of both; with no room at all some depart.
    let entry = r#"Blend(of: ["a", "b"], count: 3, filter: Plausible(botany: 0), candidates: 3)"#;
    let made = built(entry).unwrap();
    let departs = |v: &serde_json::Value| v["recipe"]["selected"]["departure"].as_f64().unwrap() > 0.0;
    let manifest = manifest(&made);
    let bad = manifest["variants"].as_array().unwrap().iter().filter(|v| departs(v)).count();
    assert_eq!(manifest["variants"].as_array().unwrap().len(), 3);
    let warned = made.notes.iter().any(|n| n.about == "variants[0]" && n.message.contains("least bad"));
    assert_eq!(warned, bad > 0, "{:?}", made.notes);
    assert!(bad > 0);
}

#[test]
fn a_bound_that_no_two_trees_keep_is_an_error_at_its_line() {
    let entry = r#"Blend(of: ["a", "b"], count: 2, pick: Diverse(apart: 1.0), candidates: 4, filter: None)"#;
    let errors = built(entry).unwrap_err();
    assert_eq!((errors.len(), errors[0].field.as_str()), (1, "variants[0].pick"));
    assert!(errors[0].message.starts_with("selects nothing"), "{}", errors[0]);
    assert_eq!(place(&preset(entry), &errors[0].field).unwrap().line, 4);
}
