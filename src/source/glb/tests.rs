//! What the reader promises: it reads real files, and no bytes can hurt it.

use std::path::PathBuf;

use super::*;
use crate::base::Seed;

/// A GLB around some text and bytes.
fn container(text: &str, bin: &[u8]) -> Vec<u8> {
    let mut text = text.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((28 + text.len() + bin.len()) as u32).to_le_bytes());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(text);
    out.extend((bin.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}

/// Three quantized positions as a strip, below a node that is moved and scaled.
const SMALL: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
    "nodes":[{"name":"up","translation":[0,5,0],"scale":[2,2,2],"children":[1]},{"name":"leaf","mesh":0}],
    "meshes":[{"name":"m","primitives":[{"attributes":{"POSITION":0},"mode":5}]}],
    "accessors":[{"bufferView":0,"componentType":5120,"normalized":true,"count":4,"type":"VEC3",
                  "min":[-127,0,0],"max":[127,127,0]}],
    "bufferViews":[{"buffer":0,"byteLength":16,"byteStride":4}],"buffers":[{"byteLength":16}]}"#;
const SMALL_BIN: [u8; 16] = [129, 0, 0, 0, 127, 0, 0, 0, 0, 127, 0, 0, 127, 127, 0, 0];

fn read_all(bytes: &[u8]) -> bool {
    let Ok(info) = read_glb(bytes) else { return false };
    for (m, mesh) in info.meshes.iter().enumerate() {
        for p in 0..mesh.primitives.len() {
            let positions = info.positions(m, p).map_or(0, |p| p.len());
            let triangles = info.triangles(m, p).map_or(0, |t| t.len());
            assert!(positions <= bytes.len() && triangles <= bytes.len());
        }
    }
    let _ = info.bounds();
    true
}

#[test]
fn quantized_strips_below_moved_nodes_are_read() {
    let bytes = container(SMALL, &SMALL_BIN);
    let info = read_glb(&bytes).unwrap();
    assert_eq!(info.positions(0, 0).unwrap()[..2], [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    assert_eq!(info.triangles(0, 0).unwrap(), [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(info.bounds(), Some([[-2.0, 5.0, 0.0], [2.0, 7.0, 0.0]]));
    assert!(info.positions(0, 1).is_err() && info.positions(9, 0).is_err());
    let text = read_gltf(SMALL.as_bytes()).unwrap();
    assert_eq!(text.meshes[0].triangles(), 2);
    assert!(matches!(text.positions(0, 0), Err(GlbError::Unsupported(_))));
}

#[test]
fn nodes_with_a_mesh_below_are_kept_with_their_parents_and_others_are_not() {
    let nodes = r#""nodes":[{"name":"up","children":[3,1,2]},{"name":"leaf","mesh":0},{"name":"light"},
        {"name":"tree","children":[4,5]},{"name":"camera"},{"name":"bark","mesh":0}]"#;
    let from = SMALL.find(r#""nodes":[{"name":"up""#).unwrap();
    let to = SMALL.find(r#""meshes""#).unwrap();
    let text = format!("{}{nodes},\n{}", &SMALL[..from], &SMALL[to..]);
    let bytes = container(&text, &SMALL_BIN);
    let info = read_glb(&bytes).unwrap();
    let of = |name: &str, parent| (name.to_owned(), parent);
    assert_eq!(info.nodes, [of("up", None), of("tree", Some(0)), of("bark", Some(1)), of("leaf", Some(0))]);
    assert_eq!(info.instances.iter().map(|instance| instance.at).collect::<Vec<_>>(), [2, 3]);
}

#[test]
fn lies_about_sizes_and_names_are_found() {
    let lies = [
        (r#""count":4"#, r#""count":5"#),
        (r#""count":4"#, r#""count":0"#),
        (r#""count":4"#, r#""count":18446744073709551615"#),
        (r#""byteLength":16,"byteStride":4"#, r#""byteLength":17,"byteStride":4"#),
        (r#""byteLength":16,"byteStride":4"#, r#""byteLength":16,"byteOffset":18446744073709551615"#),
        (r#""byteStride":4"#, r#""byteStride":0"#),
        (r#"[{"byteLength":16}]"#, r#"[{"byteLength":17}]"#),
        (r#""POSITION":0"#, r#""POSITION":4294967296"#),
        (r#""mesh":0"#, r#""mesh":1"#),
        (r#""children":[1]"#, r#""children":[0]"#),
        (r#""children":[1]"#, r#""children":[1,1]"#),
        (r#""VEC3""#, r#""VEC2""#),
        (r#""2.0""#, r#""1.0""#),
    ];
    for (from, to) in lies {
        let text = SMALL.replacen(from, to, 1);
        assert_ne!(text, SMALL);
        assert!(read_glb(&container(&text, &SMALL_BIN)).is_err(), "{to}");
    }
    // What is skipped may nest as it likes, what is kept may not.
    for (field, readable) in [("x", true), ("extras", false)] {
        let nested = format!(r#""{field}":{}{},"name":"leaf""#, "[".repeat(9000), "]".repeat(9000));
        let deep = SMALL.replace(r#""name":"leaf""#, &nested);
        assert_eq!(read_glb(&container(&deep, &SMALL_BIN)).is_ok(), readable);
    }
}

#[test]
fn no_mutation_or_truncation_hurts() {
    let whole = container(SMALL, &SMALL_BIN);
    let mut read = 0;
    for round in 0..6000 {
        let seed = Seed::new(round);
        let mut bytes = whole.clone();
        for k in 0..1 + seed.child("n").index(4) as u64 {
            let at = seed.child("at").at(k).index(bytes.len());
            // Digits grow into large numbers more often than random bytes do.
            let value = seed.child("value").at(k).bits() as u8;
            bytes[at] = if round % 2 == 0 { value } else { b'0' + value % 10 };
        }
        if round % 5 == 0 {
            bytes.truncate(seed.child("cut").index(bytes.len()));
        }
        read += usize::from(read_all(&bytes));
    }
    assert!(read > 100, "mutations should leave some files readable, {read}");
}

#[test]
fn every_real_file_is_read() {
    let data = std::env::var_os("TREEWRIGHT_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")), PathBuf::from);
    let Ok(folder) = std::fs::read_dir(data.join("mesh")) else {
        assert!(std::env::var_os("CI").is_none(), "the test data is missing");
        #[expect(clippy::print_stderr, reason = "says what was skipped")]
        {
            eprintln!("no test data, skipped");
        }
        return;
    };
    let mut files: Vec<PathBuf> = folder.filter_map(|e| Some(e.ok()?.path())).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "glb"));
    files.sort();
    assert!(files.len() >= 10);
    for file in files {
        let bytes = std::fs::read(&file).unwrap();
        let info = read_glb(&bytes).unwrap();
        assert!(!info.instances.is_empty(), "{}", file.display());
        for (m, mesh) in info.meshes.iter().enumerate() {
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                assert_eq!(info.positions(m, p).unwrap().len() as u64, primitive.vertices);
                assert_eq!(info.triangles(m, p).unwrap().len() as u64, primitive.triangles);
            }
        }
        // The head is what most checks look at.
        for round in 0..40 {
            let seed = Seed::new(round);
            let mut bytes = bytes[..bytes.len().min(60_000)].to_vec();
            let length = (bytes.len() as u32).to_le_bytes();
            bytes[8..12].copy_from_slice(&length);
            let at = seed.index(bytes.len().min(4000));
            bytes[at] = seed.child("value").bits() as u8;
            read_all(&bytes);
        }
    }
}

#[test]
fn what_materials_let_through_is_read_of_either_extension() {
    let of = |extension: &str| {
        let materials = format!(
            r#""materials":[{{"extensions":{{{extension}}}}}],"textures":[{{"source":1}}],"images":[{{}},{{}}],"meshes""#
        );
        let text = SMALL.replacen(r#""meshes""#, &materials, 1);
        read_glb(&container(&text, &SMALL_BIN)).map(|info| info.look.materials[0].transmission)
    };
    let diffuse = r#""KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":0.25"#;
    let clear = r#""KHR_materials_transmission":{"transmissionFactor":7,"transmissionTexture":{"index":0}}"#;
    assert_eq!(of(&format!("{diffuse}}}")).unwrap(), Some((0.25, None, 3)));
    assert_eq!(of(clear).unwrap(), Some((1.0, Some(1), 0)));
    assert_eq!(of(&format!("{clear},{diffuse}}}")).unwrap(), Some((0.25, None, 3)));
    // A factor of zero is what is meant where nothing is said.
    assert_eq!(of(r#""KHR_materials_transmission":{"transmissionFactor":0}"#).unwrap(), None);
    assert_eq!(of(r#""KHR_materials_ior":{"ior":1.4}"#).unwrap(), None);
    let broken = format!(r#"{diffuse},"diffuseTransmissionTexture":{{"index":9}}}}"#);
    assert!(of(&broken).is_err());
}

#[test]
fn maps_that_lie_otherwise_than_the_colour_picture_are_left_out() {
    let of = |normal: &str| {
        let turned = r#""extensions":{"KHR_texture_transform":{"scale":[2,2]}}"#;
        let materials = format!(
            r#""materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,{turned}}},
                "metallicRoughnessTexture":{{"index":0,{turned}}}}},"normalTexture":{{"index":0{normal}}}}}],
                "textures":[{{"source":1}}],"images":[{{}},{{}}],"meshes""#
        );
        let text = SMALL.replacen(r#""meshes""#, &materials, 1);
        let look = read_glb(&container(&text, &SMALL_BIN)).unwrap().look;
        let wear = &look.materials[0];
        (wear.color_image, wear.normal_image, wear.roughness_image, wear.is_less)
    };
    let alike = r#","extensions":{"KHR_texture_transform":{"scale":[2,2]}}"#;
    assert_eq!(of(alike), (Some(1), Some(1), Some(1), false));
    for other in ["", r#","texCoord":1"#, r#","extensions":{"KHR_texture_transform":{"scale":[2,3]}}"#] {
        assert_eq!(of(other), (Some(1), None, Some(1), true), "{other}");
    }
}
