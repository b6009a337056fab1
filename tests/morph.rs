//! Sequences as sets: frames from source to source, one atlas, a clip that plays through them, the same on any threads.

#![cfg(feature = "cli")]

mod tiny;

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use glam::Vec3;
use treewright::build::make_set;
use treewright::plant::{PlantBuilder, dump};

/// A grown source, a scan, and sequences of them.
fn set() -> String {
    let variants = r#"variants: [
        Source("a"), Source("b"),
        Morph(from: "a", to: "b", frames: 4, leaf: "willow", animation: Clip(seconds: 2.0, leaves: 10)),
        Grow(of: "a", frames: 3),
        Morph(from: "b", to: "a", frames: 3, animation: None),
    ]"#;
    tiny::scanned()
        .replace("\"a\": Import", "\"a\": Grow(species: \"species/tiny.ron\", seed: 1), \"b\": Import")
        .replace("variants: [Source(\"a\")]", variants)
        .replace("atlas: (size: 256)", "atlas: (size: 1024)")
}

fn built(threads: &str) -> BTreeMap<String, Vec<u8>> {
    let project = tiny::project();
    fs::write(project.path().join("steps.ron"), set()).unwrap();
    let out = project.path().join("out");
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    command.arg("build").arg(project.path().join("steps.ron")).arg("--out").arg(&out).arg("--jobs").arg(threads);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(tiny::is_whole(&out.join("steps"), "steps"));
    tiny::files(&out.join("steps"))
}

/// Positions of the first mesh, as bits.
fn positions(files: &BTreeMap<String, Vec<u8>>, name: &str) -> Vec<Vec<[u32; 3]>> {
    let bytes = &files[name];
    let read = gltf::Gltf::from_slice(bytes).unwrap();
    let blob = read.blob.as_deref().unwrap();
    let mesh = read.meshes().next().unwrap();
    let of = |primitive: gltf::Primitive<'_>| {
        let accessor = primitive.get(&gltf::Semantic::Positions).unwrap();
        let start = accessor.view().unwrap().offset();
        let vectors = blob[start..start + accessor.count() * 12].chunks_exact(12);
        let number = |v: &[u8], i: usize| u32::from_le_bytes(v[4 * i..4 * i + 4].try_into().unwrap());
        vectors.map(|v| [0, 1, 2].map(|i| number(v, i))).collect()
    };
    mesh.primitives().map(of).collect()
}

#[test]
fn frames_start_and_end_as_the_sources_and_clips_play_through_all() {
    let files = built("2");
    let manifest: serde_json::Value = serde_json::from_slice(&files["steps.manifest.json"]).unwrap();
    let variants = manifest["variants"].as_array().unwrap();
    assert_eq!(variants.len(), 2 + 4 + 3 + 3);
    assert_eq!(variants[3]["recipe"]["morph"], serde_json::json!(["a", "b"]));
    // Frame 1 of the morph is source a, the last of growth, too; frame 1 of the way back is source b.
    let of = |number: usize| positions(&files, &format!("steps_{number:03}.glb"));
    assert_eq!(of(1), of(3));
    assert_eq!(of(1), of(9));
    assert_eq!(of(2), of(10));
    assert_eq!(of(1), of(12));
    // The target wears another leaf, whose size and angle its twigs follow.
    assert_ne!(of(2), of(6));
    assert_ne!(of(4), of(5));
    let clips = manifest["clips"].as_array().unwrap();
    assert_eq!(clips.len(), 2);
    assert_eq!(clips[0]["frames"].as_array().unwrap().len(), 4);
    assert_eq!(clips[0]["trunk_support"].as_array().unwrap().len(), 4);
    for (clip, keys) in [("steps_clip_001.glb", 4), ("steps_clip_002.glb", 3)] {
        let read = gltf::Gltf::from_slice(&files[clip]).unwrap();
        let wood = read.meshes().next().unwrap().primitives().next().unwrap();
        assert_eq!(wood.morph_targets().count(), keys - 1);
        assert_eq!(read.animations().next().unwrap().channels().count(), 1 + 2 * keys);
        // The atlas and the bark are the set's.
        assert!(read.images().all(|image| match image.source() {
            gltf::image::Source::Uri { uri, .. } => files.contains_key(uri),
            gltf::image::Source::View { .. } => false,
        }));
    }
}

#[test]
fn sequences_are_the_same_on_one_thread_and_on_many() {
    assert!(built("1") == built("4"));
}

/// A stem whose tip is a fork of so many branches, no two of one girth.
fn fork(count: usize) -> Vec<u8> {
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.1, 0.05]);
    for (lean, radius) in [(0.1, 0.05), (1.0, 0.03), (-1.0, 0.02)].into_iter().take(count) {
        builder.branch(stem, 1.0, &[Vec3::ZERO, Vec3::new(lean, 1.0, 0.0)], &[radius, 0.01]);
    }
    dump(&builder.finish().unwrap()).into_bytes()
}

#[test]
fn thresholds_of_patterns_change_what_lies_between_and_nothing_else() {
    let frames = |patterns: &str| {
        let preset = format!(
            "(sources: {{\"a\": Import(file: \"three.plant\"), \"b\": Import(file: \"one.plant\")}}, \
             variants: [Morph(from: \"a\", to: \"b\", frames: 3, animation: None{patterns})], \
             foliage: (density: 0), bark: (resolution: 64), lods: [Full], atlas: (size: 256))"
        );
        let files = [("steps.ron", preset.into_bytes()), ("three.plant", fork(3)), ("one.plant", fork(1))];
        let made = make_set("steps.ron", files.map(|(name, bytes)| (name.to_owned(), bytes)).into()).unwrap();
        let files: BTreeMap<String, Vec<u8>> =
            made.files.into_iter().map(|(name, bytes)| (name, bytes.to_vec())).collect();
        [1, 2, 3].map(|frame| positions(&files, &format!("steps_{frame:03}.glb")))
    };
    // As usual the fork's heir goes with the one branch, and the others wilt; all alike, they merge into it.
    let (usual, wide) = (frames(""), frames(", patterns: (angle: 90, radius: 2)"));
    assert!(usual[0] == wide[0] && usual[2] == wide[2], "the ends are the sources");
    assert!(usual[1] != wide[1]);
}

/// The pictures that the clip of a growing plant names, and whether the set holds them.
fn worn_by_clip(engines: &str) -> Vec<(String, bool)> {
    let preset = format!(
        "(sources: {{\"a\": Import(file: \"three.plant\")}}, variants: [Grow(of: \"a\", frames: 2)], engines: [{engines}], \
         foliage: (density: 0), bark: (resolution: 64), lods: [Full], atlas: (size: 256))"
    );
    let files = [("steps.ron", preset.into_bytes()), ("three.plant", fork(3))];
    let made = make_set("steps.ron", files.map(|(name, bytes)| (name.to_owned(), bytes)).into()).unwrap();
    let files: BTreeMap<String, Vec<u8>> = made.files.into_iter().map(|(name, bytes)| (name, bytes.to_vec())).collect();
    let clip = &files["steps_clip_001.glb"];
    let length = u32::from_le_bytes(clip[12..16].try_into().unwrap()) as usize;
    let root: serde_json::Value = serde_json::from_slice(&clip[20..20 + length]).unwrap();
    let images = root["images"].as_array().unwrap().iter().map(|image| image["uri"].as_str().unwrap().to_owned());
    images.map(|uri| (uri.clone(), files.contains_key(&uri))).collect()
}

#[test]
fn a_clip_wears_what_every_engine_of_the_set_reads() {
    for (engines, ending) in [
        ("Web(textures: Ktx2), Godot, Unreal", ".png"),
        ("Web(textures: Ktx2), Unity(textures: Ktx2)", ".ktx2"),
        ("Godot(textures: Webp), Web(textures: Ktx2)", ".webp"),
        ("Unity(textures: Ktx2), Godot(textures: Webp)", ".png"),
    ] {
        let worn = worn_by_clip(engines);
        assert!(!worn.is_empty() && worn.iter().all(|(uri, is_there)| uri.ends_with(ending) && *is_there), "{worn:?}");
    }
}
