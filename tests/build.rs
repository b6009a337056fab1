//! The command builds every shipped preset into whole, valid, repeatable sets, and says what is wrong with a bad one.

#![cfg(feature = "cli")]
#![expect(clippy::print_stderr, reason = "says what was skipped")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use treewright::build::{BuildOptions, Builder};
use treewright::source::glb::read_glb;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn treewright(arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    command.current_dir(root());
    arguments.iter().for_each(|a| {
        command.arg(a);
    });
    command.output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Every file below a folder, by its path there, but for what the output folder keeps for itself (lock and index).
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut work = vec![folder.to_path_buf()];
    while let Some(next) = work.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                work.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().replace('\\', "/");
                if !name.starts_with(".treewright-") {
                    found.insert(name, fs::read(&path).unwrap());
                }
            }
        }
    }
    found
}

/// Of the shipped presets one of every kind, built once for all tests; `.ci/run` builds all.
const SETS: [&str; 5] = ["bare", "conifers", "four_ways", "grove", "topiary"];

fn shipped() -> &'static BTreeMap<String, Vec<u8>> {
    static BUILT: OnceLock<BTreeMap<String, Vec<u8>>> = OnceLock::new();
    BUILT.get_or_init(|| {
        let out = tempfile::tempdir().unwrap();
        let presets = SETS.map(|name| format!("presets/{name}.ron"));
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"build"];
        arguments.extend(presets.iter().map(|p| p as &dyn AsRef<std::ffi::OsStr>));
        let out_path = out.path();
        arguments.extend([&"--out" as &dyn AsRef<std::ffi::OsStr>, &out_path]);
        let output = treewright(&arguments);
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        files(out.path())
    })
}

fn manifests() -> impl Iterator<Item = (String, serde_json::Value)> {
    shipped()
        .iter()
        .filter(|(name, _)| name.ends_with(".manifest.json"))
        .map(|(name, bytes)| (name.clone(), serde_json::from_slice(bytes).unwrap()))
}

/// A small preset that builds in a moment, in a folder of its own with the shipped species.
fn small_project() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("species")).unwrap();
    fs::copy(root().join("presets/species/shrub.ron"), folder.path().join("species/shrub.ron")).unwrap();
    fs::write(folder.path().join("small.ron"), SMALL).unwrap();
    folder
}

const SMALL: &str = r#"(
    seed: 1,
    sources: {
        "a": Grow(species: "species/shrub.ron", seed: 1),
    },
    variants: [Source("a")],
    foliage: (leaf: "beech", density: 0.3, most: 300),
    lods: [Full, CrossedQuads],
    atlas: (size: 512),
)"#;

#[test]
fn shipped_presets_become_whole_sets() {
    assert_eq!(manifests().count(), SETS.len());
    for (name, manifest) in manifests() {
        let folder = name.split('/').next().unwrap();
        for file in manifest["files"].as_array().unwrap() {
            let path = format!("{folder}/{}", file["file"].as_str().unwrap());
            let bytes = shipped().get(&path).unwrap_or_else(|| panic!("{path} is missing"));
            assert_eq!(file["blake3"], treewright::base::Key::of_bytes(bytes).to_hex(), "{path}");
        }
        let listed = manifest["files"].as_array().unwrap().len() + 1;
        assert_eq!(shipped().keys().filter(|k| k.starts_with(&format!("{folder}/"))).count(), listed, "{folder}");
        assert!(shipped().contains_key(&format!("{folder}/{folder}_contact.png")));
    }
}

#[test]
fn every_variant_is_connected_and_gets_coarser_from_level_to_level() {
    for (name, manifest) in manifests() {
        let variants = manifest["variants"].as_array().unwrap();
        assert!(!variants.is_empty(), "{name}");
        for variant in variants {
            assert_eq!(variant["topology_continuity"], 1.0, "{name}: {}", variant["name"]);
            let levels = variant["levels"].as_array().unwrap();
            let triangles: Vec<u64> = levels.iter().map(|l| l["triangles"].as_u64().unwrap()).collect();
            let coverage: Vec<f64> = levels.iter().map(|l| l["screen_coverage"].as_f64().unwrap()).collect();
            assert!(triangles.windows(2).all(|w| w[1] < w[0]), "{name}: {triangles:?}");
            assert!(coverage.windows(2).all(|w| w[1] < w[0]), "{name}: {coverage:?}");
        }
    }
}

#[test]
fn variants_stand_in_the_order_of_the_preset() {
    let project = small_project();
    let grown = |height: f32| format!("Grow(species: \"species/shrub.ron\", seed: 1, height: {height:?})");
    let (low, high) = (grown(1.0), grown(2.0));
    let preset = SMALL
        .replace("\"a\": Grow(species: \"species/shrub.ron\", seed: 1)", &format!("\"low\": {low}, \"high\": {high}"))
        .replace("Source(\"a\")", "Source(\"low\"), Source(\"high\")");
    fs::write(project.path().join("small.ron"), preset).unwrap();
    let out = project.path().join("out");
    let output = treewright(&[&"build", &project.path().join("small.ron"), &"--out", &out]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("small/small.manifest.json")).unwrap()).unwrap();
    let variants = manifest["variants"].as_array().unwrap();
    let heights: Vec<f64> = variants.iter().map(|v| v["height"].as_f64().unwrap()).collect();
    assert_eq!(heights.iter().map(|h| h.round()).collect::<Vec<_>>(), [1.0, 2.0], "{heights:?}");
    // And each file holds the tree that the manifest says it does.
    for (variant, height) in variants.iter().zip(heights) {
        let bytes = fs::read(out.join("small").join(variant["file"].as_str().unwrap())).unwrap();
        let glb = gltf::Gltf::from_slice(&bytes).unwrap();
        let tops = glb.meshes().flat_map(|mesh| mesh.primitives().map(|p| p.bounding_box().max[1]).collect::<Vec<_>>());
        let top = f64::from(tops.fold(0.0, f32::max));
        assert!((top - height).abs() < 0.3 * height, "{}: {top} of {height}", variant["name"]);
    }
}

#[test]
fn every_asset_reads_back_with_its_levels_and_materials() {
    let mut count = 0;
    for (name, bytes) in shipped().iter().filter(|(name, _)| name.ends_with(".glb")) {
        let info = read_glb(bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(info.meshes.len() >= 3, "{name}");
        assert!(info.extensions_required.is_empty(), "{name}");
        let has_leaves = info.materials.iter().any(|material| material.name.ends_with("_leaf"));
        // Nothing comes through wood.
        let lets_through = has_leaves && !name.starts_with("bare/");
        let told = if lets_through { &["KHR_materials_diffuse_transmission", "MSFT_lod"][..] } else { &["MSFT_lod"] };
        assert_eq!(info.extensions_used, told, "{name}");
        // A second reader agrees.
        let other = gltf::Gltf::from_slice(bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(other.meshes().len(), info.meshes.len(), "{name}");
        count += 1;
    }
    assert!(count >= 12, "{count} assets");
}

#[test]
fn blue_of_leaf_pictures_is_what_they_let_through_and_depth_on_impostors_alone() {
    let mut sheets = 0;
    for (name, manifest) in manifests() {
        let set = name.split('/').next().unwrap();
        let orm =
            manifest["textures"].as_array().unwrap().iter().find(|t| t["material"] == "leaf" && t["map"] == "orm");
        assert_eq!(orm.unwrap()["channels"], serde_json::json!(["occlusion", "roughness", "transmission"]), "{name}");
        let picture = |map: &str| image::load_from_memory(&shipped()[&format!("{set}/{set}_leaf_{map}.png")]).unwrap();
        let (color, orm) = (picture("color").into_rgba8(), picture("orm").into_rgb8());
        let levels = manifest["variants"].as_array().unwrap().iter().flat_map(|v| v["levels"].as_array().unwrap());
        let impostors: Vec<&serde_json::Value> = levels.map(|l| &l["impostor"]).filter(|i| !i.is_null()).collect();
        sheets += impostors.len();
        let size = [f64::from(color.width()), f64::from(color.height())];
        let place = |sheet: &serde_json::Value, at: [u32; 2]| {
            let corner = |key: &str, k: usize| sheet[key][k].as_f64().unwrap() * size[k];
            (0..2).all(|k| (corner("uv_min", k)..corner("uv_max", k)).contains(&(f64::from(at[k]) + 0.5)))
        };
        let (mut leaves, mut depths) = (Vec::new(), vec![Vec::new(); impostors.len()]);
        for (x, y, orm) in orm.enumerate_pixels().filter(|(x, y, _)| color.get_pixel(*x, *y).0[3] >= 128) {
            let sheet = impostors.iter().position(|sheet| place(sheet, [x, y]));
            sheet.map_or(&mut leaves, |sheet| &mut depths[sheet]).push(orm.0[2]);
        }
        // No blade lets more than 0.54 through; depths reach to the near side of the sphere and to the far one.
        let (most, some) = (leaves.iter().max(), leaves.iter().filter(|blue| **blue > 5).count());
        assert!(most.is_none_or(|most| *most <= 138) && some * 2 >= leaves.len(), "{name}: {most:?} {some}");
        for depths in depths {
            let (near, far) = (depths.iter().max().unwrap(), depths.iter().min().unwrap());
            assert!(*near > 170 && *far < 85, "{name}: {far} to {near}");
        }
    }
    assert!(sheets > 3, "{sheets}");
}

#[test]
fn a_second_build_changes_nothing_and_one_thread_makes_the_same_bytes() {
    let project = small_project();
    let out = project.path().join("out");
    let build = |force: bool, threads: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
        command.arg("build").arg(project.path()).arg("--out").arg(&out).env("RAYON_NUM_THREADS", threads);
        if force {
            command.arg("--force");
        }
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        (files(&out), errors(&output))
    };
    let (first, _) = build(false, "2");
    let (second, said) = build(false, "2");
    assert_eq!(first, second);
    assert!(said.contains("nothing had changed"), "{said}");
    let (third, _) = build(true, "1");
    assert!(first == third, "one thread made other bytes");
}

#[test]
fn leaves_on_cards_of_every_shape_become_sets_and_hulls_are_listed() {
    let project = small_project();
    let preset = project.path().join("small.ron");
    let out = project.path().join("out");
    let mut triangles = BTreeMap::new();
    for leaves in ["Flat", "Folded", "Bent", "CutOut(corners: 12)"] {
        let more = format!(
            "mesh: (leaves: {leaves}, backs: DoubleSided, wind: Attributes), colliders: (crown: 2, corners: 16), engines: [Generic, Godot, Web],"
        );
        let lods = "lods: [Full, Thinned(triangles: 0.5), CrossedQuads],";
        fs::write(&preset, SMALL.replace("lods: [Full, CrossedQuads],", &format!("{lods} {more}"))).unwrap();
        let made = treewright(&[&"build", &preset, &"--out", &out]);
        assert!(made.status.success(), "{leaves}: {}", errors(&made));
        let text = fs::read_to_string(out.join("small/small.manifest.json")).unwrap();
        let variant = &serde_json::from_str::<serde_json::Value>(&text).unwrap()["variants"][0];
        let hulls = variant["hulls"].as_array().unwrap();
        assert!(!hulls.is_empty() && hulls.len() <= 2, "{leaves}");
        for hull in hulls {
            let count = |what: &str| hull[what].as_array().unwrap().len();
            assert!(count("points") <= 16 && count("triangles") == 2 * count("points") - 4, "{leaves}");
        }
        let count = |level: usize, of: &str| variant["levels"][level][of].as_u64().unwrap();
        assert!(count(1, "triangles") <= count(0, "triangles") * 11 / 20, "{leaves}");
        let (leaf, all) = (count(0, "leaf_triangles"), variant["leaves"].as_u64().unwrap());
        triangles.insert(leaves, leaf as f64 / all as f64);
    }
    assert_eq!((triangles["Flat"], triangles["Folded"], triangles["Bent"]), (2.0, 4.0, 8.0));
    assert!((4.0..=8.0).contains(&triangles["CutOut(corners: 12)"]), "{triangles:?}");
}

#[test]
fn the_gallery_keeps_what_it_says_of_sets_of_other_folders() {
    let out = tempfile::tempdir().unwrap();
    for (name, words) in [("first", "Shrubs & <others>."), ("second", "More of them.")] {
        let project = small_project();
        fs::remove_file(project.path().join("small.ron")).unwrap();
        fs::write(project.path().join(format!("{name}.ron")), format!("// {words}\n{SMALL}")).unwrap();
        let made = treewright(&[&"build", &project.path(), &"--out", &out.path()]);
        assert!(made.status.success(), "{}", errors(&made));
    }
    let page = fs::read_to_string(out.path().join("gallery.html")).unwrap();
    for words in ["<p>Shrubs &amp; &lt;others&gt;.</p>", "<p>More of them.</p>"] {
        assert_eq!(page.matches(words).count(), 1, "{words}");
    }
}

#[test]
fn a_level_that_is_unlike_its_tree_is_told_with_what_helps() {
    let project = small_project();
    let preset = project.path().join("small.ron");
    let told = |lods: &str| {
        fs::write(&preset, SMALL.replace("[Full, CrossedQuads]", lods)).unwrap();
        let made = treewright(&[&"build", &preset, &"--out", &project.path().join("out")]);
        assert!(made.status.success(), "{}", errors(&made));
        errors(&made).lines().find(|line| line.contains("lods[1]")).map(str::to_owned)
    };
    let note = told("[Full, Thinned(triangles: 0.01)]").expect("a hundredth is not the tree");
    assert!(note.contains("unlike") && note.contains("raise its `triangles`"), "{note}");
    assert_eq!(told("[Full, Thinned(triangles: 0.6)]"), None);
}

#[test]
fn budgets_in_triangles_are_kept() {
    let project = small_project();
    let preset = project.path().join("small.ron");
    let built = |most: u32| {
        let lods = format!("lods: [Full, Thinned(most: {}), CrossedQuads], mesh: (most: {most}),", most / 3);
        fs::write(&preset, SMALL.replace("lods: [Full, CrossedQuads],", &lods)).unwrap();
        let made = treewright(&[&"build", &preset, &"--out", &project.path().join("out")]);
        assert!(made.status.success(), "{}", errors(&made));
        let text = fs::read_to_string(project.path().join("out/small/small.manifest.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
        let levels = manifest["variants"][0]["levels"].as_array().unwrap().clone();
        (levels.iter().map(|level| level["triangles"].as_u64().unwrap()).collect::<Vec<_>>(), errors(&made))
    };
    let (free, _) = built(1_000_000);
    let most = free[0] as u32 / 2;
    let (levels, said) = built(most);
    assert!(levels[0] <= u64::from(most) && levels[1] <= u64::from(most) / 3, "{levels:?} of {most}");
    assert!(levels[0] > u64::from(most) * 9 / 10 && !said.contains(".most"), "{levels:?} of {most}: {said}");
}

#[test]
fn a_file_whose_stems_go_on_below_the_ground_is_read_back_as_the_tree_that_it_was() {
    let project = small_project();
    let at = |name: &str| project.path().join(name);
    let out = at("out");
    let built = |name: &str, preset: &str| {
        fs::write(at(name), preset).unwrap();
        let output = treewright(&[&"build", &at(name), &"--out", &out]);
        assert!(output.status.success(), "{}", errors(&output));
        let set = name.trim_end_matches(".ron");
        let manifest = fs::read(out.join(set).join(format!("{set}.manifest.json"))).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
        let of = &manifest["variants"][0];
        [of["height"].as_f64().unwrap(), of["bounds"]["max"][1].as_f64().unwrap()]
    };
    // A mesh loses some twigs on its way back, whatever is below it.
    let again = |set: &str| {
        let file = format!("Import(file: \"out/{set}/{set}_001.glb\")");
        SMALL.replace("Grow(species: \"species/shrub.ron\", seed: 1)", &file)
    };
    built("plain.ron", SMALL);
    built("sunk.ron", &SMALL.replace("lods: [Full, CrossedQuads]", "mesh: (below: 1.0), lods: [Full]"));
    let [plain, sunk] = [built("a.ron", &again("plain")), built("b.ron", &again("sunk"))];
    assert!(plain.into_iter().zip(sunk).all(|(a, b)| (a - b).abs() < 0.01), "{plain:?} {sunk:?}");
}

#[test]
fn what_a_small_skeleton_has_no_room_for_is_told_with_what_helps() {
    let project = small_project();
    let preset = project.path().join("small.ron");
    let swc = "1 1 0 0 0 .1 -1\n2 5 0 0 1 .08 1\n3 5 0 0 2 .05 2\n4 5 .4 0 2.5 .03 3\n5 5 -.4 0 2.6 .03 3\n6 5 0 .3 1.8 .02 2\n";
    fs::write(project.path().join("sk.swc"), swc).unwrap();
    let told = |foliage: &str| {
        let text = SMALL
            .replace("Grow(species: \"species/shrub.ron\", seed: 1)", "Import(file: \"sk.swc\")")
            .replace("density: 0.3, most: 300", foliage);
        fs::write(&preset, text).unwrap();
        let made = treewright(&[&"build", &preset, &"--out", &project.path().join("out")]);
        assert!(made.status.success(), "{}", errors(&made));
        errors(&made).lines().find(|line| line.contains("foliage.density")).map(str::to_owned)
    };
    let note = told("density: 4").expect("its branches are full");
    assert!(note.contains("1 of 1 tree would have more leaves than its branches have room for"), "{note}");
    assert_eq!(told("density: 1"), None);
}

#[test]
fn leaves_that_are_too_few_and_sources_that_nothing_is_made_of_are_told() {
    let project = small_project();
    let preset = project.path().join("small.ron");
    let told = |foliage: &str, sources: &str| {
        let text = SMALL.replace("density: 0.3, most: 300", foliage).replace("\n    },\n    variants", sources);
        fs::write(&preset, text).unwrap();
        let made = treewright(&[&"build", &preset, &"--out", &project.path().join("out")]);
        assert!(made.status.success(), "{}", errors(&made));
        errors(&made)
    };
    let (one, two) =
        ("\n    },\n    variants", "\n \"b\": Grow(species: \"species/shrub.ron\", seed: 2),\n    },\n    variants");
    let said = told("density: 0.3, most: 20000", one);
    assert!(!said.contains("foliage.most") && !said.contains("no variant"), "{said}");
    let said = told("density: 2, most: 200", one);
    let note = said.lines().find(|line| line.contains("foliage.most")).expect("200 are few");
    assert!(note.contains("1 of 1 tree would") && note.contains("raise `most`"), "{note}");
    let said = told("density: 2, most: 200, size: 0.02", one);
    assert!(said.contains("as long as asked for (0.020 m)") && !said.contains("foliage.size"), "{said}");
    let said = told("density: 0.3, most: 300, size: 0.2", one);
    let note = said.lines().find(|line| line.contains("foliage.size")).expect("such twigs are as large as the shrub");
    assert!(
        note.contains("pictures of twigs are up to") && note.contains("leave `size` out, or ask for 0.0"),
        "{note}"
    );
    let said = told("density: 0.3, most: 20000", two);
    assert!(said.contains("sources[\"b\"]: no variant is made of it"), "{said}");
}

#[test]
fn an_atlas_with_too_little_room_for_cards_is_told_with_one_that_has_it() {
    let project = small_project();
    let preset = project.path().join("small.ron");
    let told = |size: &str, lods: &str| {
        let text = SMALL.replace("size: 512", size).replace("[Full, CrossedQuads]", lods);
        fs::write(&preset, text).unwrap();
        let out = project.path().join("out");
        let made = treewright(&[&"build", &preset, &"--out", &out]);
        assert!(made.status.success(), "{}", errors(&made));
        let text = fs::read_to_string(out.join("small/small.manifest.json")).unwrap();
        let notes = serde_json::from_str::<serde_json::Value>(&text).unwrap()["notes"].clone();
        notes
            .as_array()
            .unwrap()
            .iter()
            .filter_map(|n| n.as_str())
            .find(|n| n.starts_with("atlas: at"))
            .map(str::to_owned)
    };
    let cloud = "[Full, BillboardCloud(cards: 48)]";
    let note = told("size: 256", cloud).expect("48 cards of 64 texels do not fit 256");
    assert!(note.contains("at 256 texels") && note.contains("`atlas: (size: 512)`"), "{note}");
    assert_eq!(told("size: 512", cloud), None);
    // Leaves leave two quads room.
    assert_eq!(told("size: 512", "[Full, CrossedQuads]"), None);
}

#[test]
fn thin_wood_without_colliders_and_the_set_of_light_maps_are_told() {
    let project = small_project();
    let preset = project.path().join("small.ron");
    let told = |fields: &str| {
        fs::write(&preset, SMALL.replace("lods:", &format!("{fields}\n    lods:"))).unwrap();
        let out = project.path().join("out");
        let made = treewright(&[&"build", &preset, &"--out", &out]);
        assert!(made.status.success(), "{}", errors(&made));
        let text = fs::read_to_string(out.join("small/small.manifest.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
        let notes = manifest["notes"].as_array().unwrap().iter().filter_map(|n| n.as_str());
        let note = notes.filter(|n| n.starts_with("colliders.thick")).map(str::to_owned).next();
        (note, manifest["lightmap"].clone())
    };
    let (note, lightmap) = told("mesh: (lightmap: 512), colliders: (thick: 9.5),");
    let note = note.expect("no shrub is that thick");
    assert!(note.contains("1 of 1 variants has no collider") && note.contains("9.5 m"), "{note}");
    assert_eq!(lightmap, serde_json::json!({ "attribute": "TEXCOORD_1", "texels": 512 }));
    assert_eq!(told("colliders: (thick: 0.001),"), (None, serde_json::Value::Null));
    assert_eq!(told("colliders: (thick: 9.5, capsules: 0),").0, None);
}

#[test]
fn edits_in_one_process_end_in_the_bytes_of_a_fresh_build() {
    let folder = small_project();
    let preset = folder.path().join("small.ron");
    let lods = "lods: [Full, Thinned(triangles: 0.5), BillboardCloud(cards: 6), CrossedQuads]";
    let two = "\"b\": Grow(species: \"species/shrub.ron\", seed: 2),\n    },\n    variants";
    let first = SMALL.replace("lods: [Full, CrossedQuads]", lods).replace("},\n    variants", two);
    let edits = [
        first.clone(),
        first.replace("cards: 6", "cards: 9"),
        first.replace("density: 0.3", "density: 0.3, color: \"#a06a20\""),
        first.replace("[Source(\"a\")]", "[Source(\"a\"), Source(\"b\")]"),
        first.replace("triangles: 0.5", "triangles: 0.3"),
        // Cards of more texels.
        first.replace("size: 512", "size: 1024"),
    ];
    let builder = Builder::new(BuildOptions::new(folder.path().join("warm")));
    for (i, text) in edits.iter().enumerate() {
        fs::write(&preset, text).unwrap();
        builder.build(std::slice::from_ref(&preset), &|_| {}).unwrap();
        let fresh = folder.path().join(format!("fresh{i}"));
        Builder::new(BuildOptions::new(fresh.clone())).build(std::slice::from_ref(&preset), &|_| {}).unwrap();
        assert!(files(&folder.path().join("warm/small")) == files(&fresh.join("small")), "edit {i}");
    }
}

#[test]
fn what_a_preset_no_longer_makes_is_removed_and_nothing_else() {
    let project = small_project();
    let out = project.path().join("out");
    let preset = project.path().join("small.ron");
    fs::write(
        &preset,
        SMALL.replace(r#"[Source("a")]"#, r#"[Source("a"), Source("b")]"#).replace(
            r#""a": Grow(species: "species/shrub.ron", seed: 1),"#,
            r#""a": Grow(species: "species/shrub.ron", seed: 1), "b": Grow(species: "species/shrub.ron", seed: 2),"#,
        ),
    )
    .unwrap();
    let build = || treewright(&[&"build", &preset, &"--out", &out]);
    assert_eq!(build().status.code(), Some(0));
    let mine = out.join("small/notes.txt");
    fs::write(&mine, "mine").unwrap();
    assert!(out.join("small/small_002.glb").exists());
    fs::write(&preset, SMALL).unwrap();
    let output = build();
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert!(!out.join("small/small_002.glb").exists());
    assert_eq!(fs::read_to_string(mine).unwrap(), "mine");
}

#[test]
fn a_set_whose_preset_is_gone_is_told_until_its_folder_is_deleted() {
    let project = small_project();
    let out = project.path().join("out");
    let folder = project.path();
    let (kept, gone) = (folder.join("small.ron"), folder.join("gone.ron"));
    fs::copy(&kept, &gone).unwrap();
    let build = |how: &str| {
        let all: [&dyn AsRef<std::ffi::OsStr>; 5] = [&"build", &folder, &"--out", &out, &how];
        let output = treewright(&all[..if how.is_empty() { 4 } else { 5 }]);
        (output.status.code(), errors(&output).contains("gone.ron, is gone"))
    };
    assert_eq!(build(""), (Some(0), false));
    fs::remove_file(&gone).unwrap();
    // It is told, and nothing that a build would make is missing.
    assert_eq!(build("--check"), (Some(0), true));
    // Also once what the folder remembers was written again.
    for how in ["--dry-run", "", "--force", ""] {
        assert_eq!(build(how), (Some(0), true), "{how}");
        assert!(out.join("gone/gone_001.glb").exists());
    }
    fs::remove_dir_all(out.join("gone")).unwrap();
    assert_eq!(build("--check"), (Some(0), false));
}

#[test]
fn a_bad_preset_names_file_line_and_fix_and_leaves_the_old_set() {
    let project = small_project();
    let out = project.path().join("out");
    let preset = project.path().join("small.ron");
    assert_eq!(treewright(&[&"build", &preset, &"--out", &out]).status.code(), Some(0));
    let before = files(&out);
    fs::write(&preset, SMALL.replace("density: 0.3", "densty: 0.3").replace("size: 512", "size: 500")).unwrap();
    let output = treewright(&[&"build", &preset, &"--out", &out]);
    let said = errors(&output);
    assert_eq!(output.status.code(), Some(1));
    assert!(said.contains("small.ron:7:"), "{said}");
    assert!(said.contains("density"), "no suggestion: {said}");
    assert!(said.contains("small.ron:9:"), "only the first error is told: {said}");
    assert!(files(&out) == before);
}

#[test]
fn a_missing_scan_is_an_error_at_its_line() {
    let project = small_project();
    let preset = project.path().join("small.ron");
    fs::write(&preset, SMALL.replace(r#"Grow(species: "species/shrub.ron", seed: 1)"#, r#"Import(file: "gone.csv")"#))
        .unwrap();
    let output = treewright(&[&"build", &preset, &"--out", &project.path().join("out")]);
    let said = errors(&output);
    assert_eq!(output.status.code(), Some(1));
    assert!(said.contains("small.ron:4:") && said.contains("gone.csv"), "{said}");
}

#[test]
fn wrong_usage_is_exit_code_2() {
    assert_eq!(treewright(&[&"build", &"presets"]).status.code(), Some(2));
    assert_eq!(treewright(&[&"grow"]).status.code(), Some(2));
    assert_eq!(treewright(&[&"build", &"no/such/folder", &"--out", &"target/none"]).status.code(), Some(1));
}

#[test]
fn the_set_of_scans_is_twelve_connected_hybrids() {
    let data = std::env::var_os("TREEWRIGHT_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from);
    if !data.is_dir() {
        assert!(std::env::var_os("CI").is_none(), "the test data is missing: {}", data.display());
        eprintln!("skipped: no test data at {}", data.display());
        return;
    }
    let project = tempfile::tempdir().unwrap();
    fs::create_dir_all(project.path().join("presets/species")).unwrap();
    let oak = "presets/species/oak.ron";
    fs::copy(root().join(oak), project.path().join(oak)).unwrap();
    fs::create_dir_all(project.path().join("scans")).unwrap();
    for name in ["itsme_tree_2.csv", "rtwig_small.csv"] {
        fs::copy(data.join("skeleton").join(name), project.path().join("scans").join(name)).unwrap();
    }
    let text = fs::read_to_string(root().join("examples/scans.ron")).unwrap();
    let text = text.replace("../../shared/data/skeleton/", "scans/").replace("../presets/", "presets/");
    let preset = project.path().join("scans.ron");
    fs::write(&preset, text).unwrap();
    let out = project.path().join("out");
    let output = treewright(&[&"build", &preset, &"--out", &out]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert!(errors(&output).contains("bridged"), "what was bridged is not told: {}", errors(&output));
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("scans/scans.manifest.json")).unwrap()).unwrap();
    let variants = manifest["variants"].as_array().unwrap();
    assert_eq!(variants.len(), 12);
    for variant in variants {
        assert_eq!(variant["topology_continuity"], 1.0, "{}", variant["name"]);
        assert!(variant["leaves"].as_u64().unwrap() > 200, "{} is bare", variant["name"]);
    }
}
