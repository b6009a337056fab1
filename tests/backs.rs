//! Backs of leaves: each leaf's triangle again from behind, with the front's normals, in every file and every budget.

#![cfg(feature = "cli")]

mod tiny;

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use gltf::Semantic;

/// Leaves on a scan, all profiles, and a clip.
fn built(mesh: &str) -> BTreeMap<String, Vec<u8>> {
    let project = tiny::project();
    let variants = "variants: [Source(\"a\"), Grow(of: \"a\", frames: 3, animation: Clip(seconds: 1.0, leaves: 10))]";
    let more = "lods: [Full, Thinned(triangles: 0.5), BillboardCloud(cards: 4), CrossedQuads], \
                engines: [Generic, Godot, Unity, Unreal, Bevy]";
    let preset = tiny::scanned()
        .replace("variants: [Source(\"a\")]", variants)
        .replace("density: 0.1, most: 20", "most: 60")
        .replace("lods: [Full]", &format!("{more}, mesh: (wind: Attributes, leaves: Flat, {mesh})"))
        .replace("atlas: (size: 256)", "atlas: (size: 1024)");
    fs::write(project.path().join("set.ron"), preset).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    command.args(["build", "set.ron", "--out", "out"]).current_dir(project.path());
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let folder = project.path().join("out/set");
    assert!(tiny::is_whole(&folder, "set"));
    tiny::files(&folder)
}

/// A primitive's triangles, as places with normals in bits, and whether it is of leaves.
struct Drawn {
    leaf: bool,
    double_sided: bool,
    triangles: Vec<[[u32; 6]; 3]>,
    sets: usize,
}

fn drawn(file: &[u8]) -> Vec<Vec<Drawn>> {
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(file).unwrap();
    let blob = blob.unwrap();
    // Every accessor has a view of its own.
    let bytes = |accessor: &gltf::Accessor<'_>| {
        let view = accessor.view().unwrap();
        &blob[view.offset()..view.offset() + view.length()]
    };
    let one = |primitive: gltf::Primitive<'_>| {
        let vectors = |semantic: &Semantic| bytes(&primitive.get(semantic).unwrap()).as_chunks::<12>().0;
        let number = |v: &[u8; 12], i: usize| u32::from_le_bytes(v[4 * i..4 * i + 4].try_into().unwrap());
        let vertices: Vec<[u32; 6]> = vectors(&Semantic::Positions)
            .iter()
            .zip(vectors(&Semantic::Normals))
            .map(|(p, n)| std::array::from_fn(|i| if i < 3 { number(p, i) } else { number(n, i - 3) }))
            .collect();
        let indices = primitive.indices().unwrap();
        assert_eq!(indices.data_type(), gltf::accessor::DataType::U16);
        let indices: Vec<u16> = bytes(&indices).as_chunks().0.iter().map(|i| u16::from_le_bytes(*i)).collect();
        let material = primitive.material();
        Drawn {
            leaf: material.name().unwrap().ends_with("_leaf"),
            double_sided: material.double_sided(),
            triangles: indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| vertices[usize::from(i)])).collect(),
            sets: primitive.attributes().filter(|(semantic, _)| matches!(semantic, Semantic::TexCoords(_))).count(),
        }
    };
    // Colliders wear nothing.
    let shown = |primitive: &gltf::Primitive<'_>| primitive.material().index().is_some();
    document.meshes().map(|mesh| mesh.primitives().filter(shown).map(one).collect()).collect()
}

/// The triangles, each from its least corner on, in order.
fn sorted(triangles: impl Iterator<Item = [[u32; 6]; 3]>) -> Vec<[[u32; 6]; 3]> {
    let turned = |[a, b, c]: [[u32; 6]; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap();
    let mut all: Vec<_> = triangles.map(turned).collect();
    all.sort_unstable();
    all
}

#[test]
fn doubled_leaves_are_closed_with_the_fronts_normals_in_every_file() {
    let (plain, doubled) = (built("backs: DoubleSided"), built(""));
    let mut leaves = 0;
    for (name, file) in doubled.iter().filter(|(name, _)| name.ends_with(".glb")) {
        let before = drawn(&plain[name]);
        let is_crossed = |mesh: usize| (!name.contains("clip") && mesh == 3) || name.contains("_LOD3");
        for (i, (mesh, before)) in drawn(file).into_iter().zip(before).enumerate() {
            for (part, before) in mesh.into_iter().zip(before) {
                assert_eq!(part.sets, before.sets, "{name} {i}");
                if !part.leaf {
                    continue;
                }
                leaves += 1;
                assert!(!part.double_sided && before.double_sided, "{name} {i}");
                if is_crossed(i) {
                    assert_eq!(part.triangles.len(), before.triangles.len(), "{name} {i}");
                    continue;
                }
                let turned = part.triangles.iter().map(|&[a, b, c]| [a, c, b]);
                assert_eq!(
                    sorted(turned),
                    sorted(part.triangles.iter().copied()),
                    "{name} {i}: a triangle has no back"
                );
            }
        }
    }
    assert!(leaves > 4 * 5 * 4, "{leaves} primitives of leaves");
}

#[test]
fn budgets_and_the_manifest_count_backs() {
    let levels = |mesh: &str| {
        let manifest: serde_json::Value = serde_json::from_slice(&built(mesh)["set.manifest.json"]).unwrap();
        let level = |level: &serde_json::Value| {
            let count = |what: &str| level[what].as_u64().unwrap();
            assert_eq!(count("triangles"), count("bark_triangles") + count("leaf_triangles"));
            (count("bark_triangles"), count("leaf_triangles"), count("triangles"))
        };
        manifest["variants"][0]["levels"].as_array().unwrap().iter().map(level).collect::<Vec<_>>()
    };
    let (plain, doubled) = (levels("backs: DoubleSided"), levels(""));
    assert_eq!((doubled[0].0, doubled[0].1), (plain[0].0, plain[0].1 * 2));
    assert!(doubled[1].2 * 20 <= doubled[0].2 * 11, "{doubled:?}");
    assert_eq!(doubled[3].1, plain[3].1, "crossed quads stand back to back");
    let most = doubled[0].2 * 4 / 5;
    let bounded = levels(&format!("most: {most}"));
    assert!(bounded[0].2 <= most && bounded[0].2 * 10 > most * 8, "{bounded:?} of {most}");
}
