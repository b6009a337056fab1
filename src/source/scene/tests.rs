//! Exact small meshes of every format, and the real ones against their manifest.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::*;

fn text(text: &str, files: &Files<'_>) -> Scene {
    read(text.as_bytes(), "it", files).unwrap_or_else(|e| panic!("{e:?}"))
}

const MTL: &str =
    "newmtl leaf\nKd 0.5 0.5 0.5\nmap_Kd -bm 1.0 -o 0 0 tex\\my leaf.png\nmap_d mask.png\nbump -bm 2 n.png\n";

#[test]
fn obj_corners_groups_materials_and_negative_indices_are_read() {
    let obj = "mtllib a b.mtl\no tree\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nvn 0 0 1\n\
               usemtl leaf\nf 1/1/1 2/2/1 3/2/1 \\\n 4/1/1\ng wood\nusemtl none\nf -4 -3 -2\n";
    assert_eq!(refers(obj.as_bytes(), &Files::new()), ["a b.mtl"]);
    let files = Files::from([("a b.mtl".to_owned(), MTL.as_bytes())]);
    assert_eq!(refers(obj.as_bytes(), &files), ["mask.png", "n.png", "tex/my leaf.png"]);
    let scene = text(obj, &files);
    assert_eq!((scene.parts.len(), scene.triangles(), scene.vertices()), (2, 3, 7));
    let leaf = &scene.parts[0];
    assert_eq!((leaf.name.as_str(), leaf.triangles.as_slice()), ("tree", [[0, 1, 2], [0, 2, 3]].as_slice()));
    assert_eq!(leaf.faces, [0, 0]);
    assert_eq!(leaf.uvs[1], Vec2::new(1.0, 0.75));
    assert_eq!((leaf.normals[0], scene.parts[1].normals.len()), (Vec3::Z, 0));
    let material = &scene.materials[leaf.material.unwrap()];
    assert_eq!((material.name.as_str(), material.alpha), ("leaf", Alpha::Mask(0.5)));
    let image = |i: Option<usize>| scene.images[i.unwrap()].clone();
    assert_eq!(image(material.color_image), Image::File("tex/my leaf.png".into()));
    assert_eq!(image(material.alpha_image), Image::File("mask.png".into()));
    assert_eq!(image(material.normal_image), Image::File("n.png".into()));
    assert_eq!(scene.materials[scene.parts[1].material.unwrap()].name, "none");
    assert!(scene.notes.iter().any(|n| n.contains("1 material is")), "{:?}", scene.notes);
}

#[test]
fn groups_of_an_obj_are_known_with_the_objects_around_them() {
    let face = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\n";
    let scene =
        text(&format!("o a\n{face}g wood\n{face}o b\ng wood\n{face}o\ng wood\n{face}o a\n{face}"), &Files::new());
    let of = |name: &str, parent| Object { name: name.into(), parent };
    assert_eq!(
        scene.objects,
        [of("a", None), of("wood", Some(0)), of("b", None), of("wood", Some(2)), of("wood", None)]
    );
    let parts: Vec<(&str, usize, usize)> =
        scene.parts.iter().map(|part| (part.name.as_str(), part.object, part.triangles.len())).collect();
    assert_eq!(parts, [("a", 0, 2), ("wood", 1, 1), ("wood", 3, 1), ("wood", 4, 1)]);
}

#[test]
fn what_draco_compressed_is_told_with_the_command_that_undoes_it() {
    let gltf = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "extensionsUsed":["KHR_draco_mesh_compression"],"extensionsRequired":["KHR_draco_mesh_compression"],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"extensions":
        {"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}],
        "accessors":[{"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
        {"componentType":5123,"count":3,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":4}],"buffers":[{"byteLength":4,"uri":"data:;base64,AAAAAA=="}]}"#;
    let error = read(gltf.as_bytes(), "it", &Files::new()).unwrap_err().remove(0);
    assert!(error.message.contains("`KHR_draco_mesh_compression`"), "{error}");
    assert!(error.hint.contains("`npx @gltf-transform/cli copy in.glb out.glb`"), "{error:?}");
}

fn files(owned: &BTreeMap<String, Vec<u8>>) -> Files<'_> {
    owned.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect()
}

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("TREEWRIGHT_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "the test data is missing");
    #[expect(clippy::print_stderr, reason = "says what was skipped")]
    {
        eprintln!("no test data, skipped");
    }
    None
}

#[test]
fn every_real_mesh_has_the_triangles_of_its_manifest() {
    let Some(data) = data() else { return };
    let manifest = std::fs::read_to_string(data.join("MANIFEST.tsv")).unwrap();
    let mut count = 0;
    for line in manifest.lines() {
        let cells: Vec<&str> = line.split('\t').collect();
        if cells[3] != "mesh" {
            continue;
        }
        let path = data.join(cells[0]);
        let bytes = std::fs::read(&path).unwrap();
        let mut beside: BTreeMap<String, Vec<u8>> = BTreeMap::new();
        for _ in 0..3 {
            for name in refers(&bytes, &files(&beside)) {
                beside.insert(name.clone(), std::fs::read(path.with_file_name(name)).unwrap());
            }
        }
        let scene = read(&bytes, cells[0], &files(&beside)).unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(scene.triangles().to_string(), cells[4], "{}", cells[0]);
        count += 1;
    }
    assert_eq!(count, 16);
}

#[test]
fn vertices_beyond_all_bounds_are_told_with_the_part_that_has_them() {
    for (far, good) in [("1e6", true), ("2e7", false), ("1e30", false)] {
        let obj = format!("o tree\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\no stray\nv 0 {far} 0\nf 1 2 4\n");
        match read(obj.as_bytes(), "it.obj", &Files::new()) {
            Ok(scene) => assert!(good && scene.triangles() == 2, "{far}"),
            Err(errors) => {
                assert!(!good && errors.len() == 1 && errors[0].file == "it.obj", "{far}: {errors:?}");
                assert!(errors[0].message.starts_with("`stray`: a vertex lies ") && !errors[0].hint.is_empty());
            }
        }
    }
    // Also where it comes first.
    let obj = "o stray\nv 0 9e9 0\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\no tree\nf 2 3 4\n";
    let errors = read(obj.as_bytes(), "it.obj", &Files::new()).expect_err("it is far");
    assert!(errors[0].message.starts_with("`stray`"), "{errors:?}");
}

#[test]
fn sparse_elements_must_rise_and_be_there() {
    // Three vertices of zeros, two of which are replaced.
    let gltf = |places: [u8; 2]| {
        let points = [[1.0_f32, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mut bytes = places.to_vec();
        bytes.extend([0, 0]);
        bytes.extend(points.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
            "accessors":[{"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0],"sparse":{"count":2,
            "indices":{"bufferView":0,"componentType":5121},"values":{"bufferView":1}}}],
            "bufferViews":[{"buffer":0,"byteLength":2},{"buffer":0,"byteOffset":4,"byteLength":24}],
            "buffers":[{"uri":"it.bin","byteLength":28}]}"#;
        let files = Files::from([("it.bin".to_owned(), bytes.as_slice())]);
        read(text.as_bytes(), "it.gltf", &files)
    };
    assert_eq!(gltf([1, 2]).expect("they rise").parts[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    for wrong in [[1, 3], [2, 1], [1, 1], [0, 255]] {
        let errors = gltf(wrong).expect_err("they don't");
        assert!(errors[0].message.contains("sparse"), "{wrong:?}: {errors:?}");
    }
}
