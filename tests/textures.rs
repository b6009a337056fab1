//! Textures in the formats that engines ask for: what is written, listed, kept and taken away.

#![cfg(feature = "cli")]

#[expect(dead_code, reason = "other tests take more of it")]
mod tiny;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

fn says(project: &Path, code: i32, arguments: &[&str], threads: &str) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    let output = command.current_dir(project).args(arguments).env("RAYON_NUM_THREADS", threads).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

/// The files of a set by name.
fn set(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fs::read_dir(folder)
        .unwrap()
        .flatten()
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect()
}

fn write(project: &Path, engines: &str) {
    let preset = tiny::GROWN.replace("atlas: (size: 256),", &format!("atlas: (size: 256), engines: {engines},"));
    fs::write(project.join("grown.ron"), preset).unwrap();
}

fn with(set: &BTreeMap<String, Vec<u8>>, end: &str) -> Vec<String> {
    set.keys().filter(|name| name.ends_with(end)).cloned().collect()
}

const MAPS: [&str; 6] = ["bark_color", "bark_normal", "bark_orm", "leaf_color", "leaf_normal", "leaf_orm"];

#[test]
fn each_engine_gets_the_textures_it_asks_for_and_others_go_away() {
    let project = tiny::project();
    let (at, out) = (project.path(), project.path().join("out/grown"));
    let build = ["build", "grown.ron", "--out", "out"];
    write(at, "[Generic, Godot(textures: Webp), Web(textures: Ktx2)]");
    says(at, 0, &build, "2");
    let all = set(&out);
    for end in ["png", "webp", "ktx2"] {
        for map in MAPS {
            assert!(all.contains_key(&format!("grown_{map}.{end}")), "{map}.{end}");
        }
    }
    // What the manifest says is what there is.
    let manifest: serde_json::Value = serde_json::from_slice(&all["grown.manifest.json"]).unwrap();
    let textures = manifest["textures"].as_array().unwrap();
    assert_eq!(textures.len(), 18);
    for texture in textures {
        let file = texture["file"].as_str().unwrap();
        let bytes = &all[file];
        let stated = [texture["width"].as_u64().unwrap() as u32, texture["height"].as_u64().unwrap() as u32];
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        if file.ends_with(".ktx2") {
            assert_eq!(bytes[..12], *b"\xABKTX 20\xBB\r\n\x1A\n");
            assert_eq!(([word(20), word(24)], u64::from(word(40))), (stated, texture["mips"].as_u64().unwrap()));
            assert!(stated.iter().all(|side| side % 4 == 0));
            // Colour is sRGB, all else linear: the descriptor's transfer function.
            let transfer = bytes[word(48) as usize + 14];
            assert_eq!(transfer, if texture["map"] == "color" { 2 } else { 1 }, "{file}");
        } else {
            let image = image::load_from_memory(bytes).unwrap();
            assert_eq!(([image.width(), image.height()], texture.get("mips")), (stated, None));
            let png = image::load_from_memory(&all[&file.replace(".webp", ".png")]).unwrap();
            assert!(png == image, "{file} has other texels than the PNG");
        }
    }
    for (file, extension, end) in [
        ("grown_001.glb", None, ".png"),
        ("grown_001.godot.glb", Some("EXT_texture_webp"), ".webp"),
        ("grown_001.web.glb", Some("KHR_texture_basisu"), ".ktx2"),
    ] {
        let bytes = &all[file];
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let root: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        let images = root["images"].as_array().unwrap();
        assert!(!images.is_empty() && images.iter().all(|image| all.contains_key(image["uri"].as_str().unwrap())));
        assert!(images.iter().all(|image| image["uri"].as_str().unwrap().ends_with(end)), "{file}");
        let required = root["extensionsRequired"].as_array().cloned().unwrap_or_default();
        for texture in root["textures"].as_array().unwrap() {
            let source = match extension {
                None => &texture["source"],
                Some(extension) => {
                    assert!(required.contains(&extension.into()) && texture.get("source").is_none(), "{file}");
                    &texture["extensions"][extension]["source"]
                }
            };
            assert!((source.as_u64().unwrap() as usize) < images.len());
        }
    }
    // The same on one thread, and nothing to do afterwards; a lost file is missed and made again.
    says(at, 0, &["build", "grown.ron", "--out", "one"], "1");
    assert!(set(&at.join("one/grown")) == all);
    says(at, 0, &["build", "grown.ron", "--out", "out", "--check"], "2");
    fs::remove_file(out.join("grown_leaf_orm.ktx2")).unwrap();
    let said = says(at, 1, &["build", "grown.ron", "--out", "out", "--check"], "2");
    assert!(said.contains("grown_leaf_orm.ktx2"), "{said}");
    says(at, 0, &build, "2");
    assert!(set(&out) == all);

    // Nobody takes PNG any more.
    write(at, "[Web(textures: Ktx2)]");
    says(at, 0, &build, "2");
    let web = set(&out);
    assert_eq!((with(&web, ".png"), with(&web, ".webp")), (vec!["grown_contact.png".to_owned()], vec![]));
    assert_eq!(with(&web, ".glb"), ["grown_001.web.glb"]);
    let ktx = with(&web, ".ktx2");
    assert_eq!(ktx.len(), 6);
    assert!(ktx.iter().all(|name| web[name] == all[name]));
}

#[test]
fn a_kept_texture_is_not_encoded_again() {
    let project = tiny::project();
    let at = project.path();
    write(at, "[Web(textures: Ktx2)]");
    says(at, 0, &["build", "grown.ron", "--out", "out", "--cache", "kept"], "2");
    let kept = |stage: &str| fs::read_dir(at.join("kept").join(stage)).map_or(0, |all| all.flatten().count());
    assert!(kept("ktx2") > 0 && kept("png") == 0 && kept("webp") == 0);
    let before = kept("ktx2");
    // Another seed of the tree changes no picture of bark and leaf; nothing is added for them.
    let preset = fs::read_to_string(at.join("grown.ron")).unwrap().replace("seed: 1)", "seed: 2)");
    fs::write(at.join("grown.ron"), preset).unwrap();
    says(at, 0, &["build", "grown.ron", "--out", "out", "--cache", "kept"], "2");
    assert_eq!(kept("ktx2"), before);
}
