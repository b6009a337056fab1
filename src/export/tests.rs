//! What the writers promise, by this crate's own checked reader and by the `gltf` crate.

use glam::{Vec2, Vec3};

use super::*;
use crate::mesh::{Mesh, TreeMesh, Wind};
use crate::preset::plan::{Engine, TextureFormat};
use crate::source::glb::read_glb;

/// `quads` quads side by side, four vertices each.
fn quads(quads: usize) -> Mesh {
    let mut mesh = Mesh::default();
    for q in 0..quads {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            mesh.positions.push(Vec3::new(q as f32 + x, y * 0.1, 0.0));
            mesh.uvs.push(Vec2::new(x, 1.0 - y));
        }
        mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| i + 4 * q as u32));
    }
    let n = mesh.positions.len();
    mesh.normals = vec![Vec3::Z; n];
    mesh.tangents = vec![[1.0, 0.0, 0.0, 1.0]; n];
    mesh.occlusion = (0..n).map(|i| (i % 256) as u8).collect();
    mesh
}

fn tree(bark: usize, leaf: usize) -> TreeMesh {
    TreeMesh { bark: quads(bark), leaf: quads(leaf) }
}

fn write(trees: &[TreeMesh]) -> Result<Vec<u8>, ExportError> {
    let share = |i: usize| 0.5 / (1 + i * i) as f32;
    let levels: Vec<_> = trees
        .iter()
        .enumerate()
        .map(|(i, mesh)| AssetLevel { mesh, screen_coverage: share(i), impostor: None, wind: None })
        .collect();
    let materials = SetMaterials::of("two words", TextureFormat::Png);
    glb(&AssetIn { name: "oak_001", seed: 41, below: 0.0, levels: &levels, materials: &materials })
}

#[test]
fn what_is_written_is_read_back() {
    let trees = [tree(2, 3), tree(1, 1), tree(0, 1)];
    let bytes = write(&trees).unwrap();
    assert_eq!(bytes, write(&trees).unwrap());
    let info = read_glb(&bytes).unwrap();
    assert_eq!(info.generator, format!("Treewright {}", env!("CARGO_PKG_VERSION")));
    let names: Vec<&str> = info.meshes.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["oak_001_LOD0", "oak_001_LOD1", "oak_001_LOD2"]);
    assert_eq!(info.meshes.iter().map(|m| m.triangles()).collect::<Vec<_>>(), [10, 4, 2]);
    assert_eq!(info.instances.len(), 1);
    let levels: Vec<_> = info.lods[0].levels.iter().map(|l| (l.node.as_str(), l.mesh, l.screen_coverage)).collect();
    let expected =
        [("oak_001", Some(0), Some(0.5)), ("oak_001_LOD1", Some(1), Some(0.25)), ("oak_001_LOD2", Some(2), Some(0.1))];
    assert_eq!(levels, expected);
    assert_eq!((info.extensions_used.as_slice(), info.extensions_required.len()), (&["MSFT_lod".to_owned()][..], 0));
    assert_eq!(info.images[0].uri, "two%20words_bark_color.png");
    assert_eq!((info.materials[1].alpha_mode.as_str(), info.materials[1].double_sided), ("MASK", true));
    assert_eq!(info.bounds(), Some([[0.0, 0.0, 0.0], [3.0, 0.1, 0.0]]));
    for (mesh, tree) in trees.iter().enumerate() {
        for (primitive, part) in [&tree.bark, &tree.leaf].into_iter().filter(|p| !p.indices.is_empty()).enumerate() {
            let positions: Vec<Vec3> = info.positions(mesh, primitive).unwrap().into_iter().map(Vec3::from).collect();
            assert_eq!(positions, part.positions);
            assert_eq!(info.triangles(mesh, primitive).unwrap().as_flattened(), part.indices);
        }
    }
}

#[test]
fn the_gltf_crate_agrees() {
    let mesh = tree(2, 3);
    let bytes = write(&[mesh.clone(), tree(1, 1)]).unwrap();
    let file = gltf::Gltf::from_slice(&bytes).unwrap();
    let bin = file.blob.as_deref().unwrap();
    let root = file.default_scene().unwrap().nodes().next().unwrap();
    assert_eq!(root.name(), Some("oak_001"));
    let leaf = root.mesh().unwrap().primitives().nth(1).unwrap();
    // The crate is built without its reader, so take the bytes where its accessors say they lie.
    let bytes = |a: gltf::Accessor<'_>| {
        let at = a.view().unwrap().offset() + a.offset();
        bin[at..at + a.count() * a.size()].to_vec()
    };
    let attribute = |semantic| bytes(leaf.get(&semantic).unwrap());
    let floats = |b: Vec<u8>| -> Vec<f32> { b.as_chunks().0.iter().map(|&c| f32::from_le_bytes(c)).collect() };
    let expected: Vec<f32> = mesh.leaf.positions.iter().flat_map(|p| p.to_array()).collect();
    assert_eq!(floats(attribute(gltf::Semantic::Positions)), expected);
    assert_eq!(floats(attribute(gltf::Semantic::Tangents)), mesh.leaf.tangents.as_flattened());
    assert_eq!(attribute(gltf::Semantic::Colors(0))[20..24], [5, 5, 5, 255]);
    let indices: Vec<u32> =
        bytes(leaf.indices().unwrap()).as_chunks().0.iter().map(|&c| u16::from_le_bytes(c).into()).collect();
    assert_eq!(indices, mesh.leaf.indices);
    assert_eq!(leaf.material().alpha_mode(), gltf::material::AlphaMode::Mask);
    for accessor in file.accessors() {
        let view = accessor.view().unwrap();
        assert_eq!((view.offset() % 4, accessor.offset()), (0, 0));
    }
}

#[test]
fn indices_are_16_bit_as_long_as_they_can_be() {
    for (count, size) in [(16_383, 2), (17_500, 4)] {
        let bytes = write(&[tree(count, 0)]).unwrap();
        let file = gltf::Gltf::from_slice(&bytes).unwrap();
        let indices = file.meshes().next().unwrap().primitives().next().unwrap().indices().unwrap();
        assert_eq!(indices.size(), size);
        let last = read_glb(&bytes).unwrap().triangles(0, 0).unwrap().last().copied();
        let n = 4 * count as u32;
        assert_eq!(last, Some([n - 4, n - 2, n - 1]));
    }
}

#[test]
fn one_level_has_no_extension_and_unused_materials_are_left_out() {
    let bytes = write(&[tree(1, 0)]).unwrap();
    let info = read_glb(&bytes).unwrap();
    assert!(info.extensions_used.is_empty() && info.lods.is_empty());
    assert_eq!((info.materials.len(), info.images.len()), (1, 3));
}

#[test]
fn broken_meshes_are_refused_and_rounding_is_mended() {
    assert!(matches!(write(&[]), Err(ExportError::NoLevels { .. })));
    assert!(matches!(write(&[tree(0, 0)]), Err(ExportError::EmptyLevel { level: 0, .. })));
    let with = |change: fn(&mut Mesh)| {
        let mut mesh = tree(1, 0);
        change(&mut mesh.bark);
        write(&[mesh])
    };
    let refused: [fn(&mut Mesh); 7] = [
        |m| m.indices[0] = 4,
        |m| m.positions[0].x = f32::NAN,
        |m| m.occlusion.truncate(3),
        |m| m.uvs[1].y = f32::INFINITY,
        |m| m.indices.truncate(5),
        |m| m.lightmap.push(glam::Vec2::ZERO),
        |m| m.lightmap = vec![glam::Vec2::NAN; m.positions.len()],
    ];
    for change in refused {
        assert!(matches!(with(change), Err(ExportError::Mesh { .. })));
    }
    let mended = with(|m| {
        m.normals[0] = Vec3::ZERO;
        m.tangents[0] = [f32::NAN; 4];
        m.indices.extend([1, 1, 2]);
    });
    assert_eq!(read_glb(&mended.unwrap()).unwrap().meshes[0].triangles(), 2);
}

#[test]
fn pictures_survive_the_encoder_and_hold_no_ancillary_chunk() {
    let pixels: Vec<u8> = (0..5 * 3 * 4).map(|i| (i * 37 % 256) as u8).collect();
    let png = encode(&pixels, 5, 3, PngKind::Rgba).unwrap();
    assert_eq!(image::load_from_memory(&png).unwrap().into_rgba8().into_raw(), pixels);
    let mut chunks = Vec::new();
    let mut at = 8;
    while at < png.len() {
        chunks.push(&png[at + 4..at + 8]);
        at += 12 + u32::from_be_bytes([png[at], png[at + 1], png[at + 2], png[at + 3]]) as usize;
    }
    assert!(chunks.iter().all(|c| [&b"IHDR"[..], b"IDAT", b"IEND"].contains(c)), "{chunks:?}");
    assert!(encode(&pixels, 5, 4, PngKind::Rgba).is_err() && encode(&[], 0, 0, PngKind::Rgb).is_err());
}

#[test]
fn colliders_have_the_names_that_each_engine_knows() {
    use crate::preset::plan::Engine;
    let mesh = tree(2, 2);
    let levels = [AssetLevel { mesh: &mesh, screen_coverage: 0.1, impostor: None, wind: None }];
    let materials = SetMaterials::of("oak", TextureFormat::Png);
    let asset = AssetIn { name: "oak_001", seed: 1, below: 0.0, levels: &levels, materials: &materials };
    let capsules = [Capsule { a: [0.0; 3], b: [0.0, 1.0, 0.0], radius: 0.2 }];
    let hull = Hull {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    };
    let hulls = [hull.clone(), hull];
    let names = |colliders: Colliders<'_>, engine: Engine| -> Vec<String> {
        let files = engine_files(&asset, colliders, engine).unwrap();
        let of = |file: &(String, Vec<u8>)| read_glb(&file.1).unwrap().meshes;
        files.iter().flat_map(of).map(|mesh| mesh.name).filter(|name| name != "oak_001_LOD0").collect()
    };
    let all = Colliders { capsules: &capsules, hulls: &hulls };
    let godot = ["oak_001_0-convcolonly", "oak_001_crown_0-convcolonly", "oak_001_crown_1-convcolonly"];
    assert_eq!(names(all, Engine::Godot), godot);
    let plain = ["oak_001_collider_0", "oak_001_crown_0", "oak_001_crown_1"];
    assert_eq!(names(all, Engine::Unity), plain);
    assert_eq!(names(all, Engine::Bevy), plain);
    let numbered = ["UCX_oak_001_LOD0_00", "UCX_oak_001_LOD0_01", "UCX_oak_001_LOD0_02"];
    assert_eq!(names(all, Engine::Unreal), numbered);
    assert_eq!(names(all, Engine::Web), [""; 0]);
    let only = Colliders { capsules: &[], hulls: &hulls[..1] };
    assert_eq!(names(only, Engine::Unity), ["oak_001_crown_0"]);
    assert_eq!(names(Colliders::default(), Engine::Unity), [""; 0]);
}

#[test]
fn wind_is_in_texture_sets_and_in_files_for_bevy_in_an_attribute_of_its_own() {
    let mesh = tree(1, 1);
    let wind = |mesh: &Mesh| Wind {
        weights: vec![[0.5, 0.25, 0.75]; mesh.positions.len()],
        pivots: vec![Vec3::new(1.0, 2.0, 3.0); mesh.positions.len()],
        leaves: vec![glam::Vec2::new(0.125, 0.625); mesh.positions.len()],
    };
    let winds = [wind(&mesh.bark), wind(&mesh.leaf)];
    let levels = [AssetLevel { mesh: &mesh, screen_coverage: 0.1, impostor: None, wind: Some(&winds) }];
    let materials = SetMaterials::of("set", TextureFormat::Png);
    let asset = AssetIn { name: "oak_001", seed: 1, below: 0.0, levels: &levels, materials: &materials };
    for engine in [Engine::Generic, Engine::Godot, Engine::Unity, Engine::Bevy] {
        let files = engine_files(&asset, Colliders::default(), engine).unwrap();
        let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&files[0].1).unwrap();
        let bytes = blob.unwrap();
        let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
        // The first vertex' numbers.
        let first = |semantic: gltf::Semantic| {
            let accessor = primitive.get(&semantic)?;
            let start = accessor.view()?.offset() + accessor.offset();
            let numbers = bytes[start..][..accessor.size()].chunks(4);
            Some(numbers.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect::<Vec<f32>>())
        };
        let set = |k: u32| first(gltf::Semantic::TexCoords(k));
        let own = first(gltf::Semantic::Extras("WIND".to_owned()));
        let of_leaf = first(gltf::Semantic::Extras("WIND_LEAF".to_owned()));
        assert_eq!(if engine == Engine::Bevy { of_leaf } else { set(4) }, Some(vec![0.125, 0.625]), "{engine:?}");
        assert_eq!(set(1), Some(vec![0.4, 0.75]), "{engine:?}");
        if engine == Engine::Bevy {
            assert_eq!((set(2), set(3), own), (None, None, Some(vec![1.0, 2.0, 3.0, 0.25])));
        } else {
            assert_eq!((set(2), set(3), own), (Some(vec![1.0, 2.0]), Some(vec![3.0, 0.25]), None), "{engine:?}");
        }
    }
}

#[test]
fn beside_light_maps_bevy_reads_bend_and_phase_from_an_attribute_of_their_own() {
    let mut mesh = tree(2, 3);
    for part in [&mut mesh.bark, &mut mesh.leaf] {
        part.lightmap = vec![glam::Vec2::ZERO; part.positions.len()];
    }
    let wind = [&mesh.bark, &mesh.leaf].map(|part| Wind {
        pivots: vec![glam::Vec3::ONE; part.positions.len()],
        weights: vec![[0.5, 0.25, 0.75]; part.positions.len()],
        leaves: vec![glam::Vec2::ZERO; part.positions.len()],
    });
    let levels = [AssetLevel { mesh: &mesh, screen_coverage: 0.1, impostor: None, wind: Some(&wind) }];
    let materials = SetMaterials::of("set", TextureFormat::Png);
    let asset = AssetIn { name: "oak_001", seed: 1, below: 0.0, levels: &levels, materials: &materials };
    for engine in [Engine::Bevy, Engine::Generic] {
        let files = engine_files(&asset, Colliders::default(), engine).unwrap();
        let gltf::Gltf { document, .. } = gltf::Gltf::from_slice(&files[0].1).unwrap();
        let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
        let has = |semantic: gltf::Semantic| primitive.get(&semantic).is_some();
        let own = ["WIND", "WIND_BEND", "WIND_LEAF"].map(|name| has(gltf::Semantic::Extras(name.to_owned())));
        let is_bevy = engine == Engine::Bevy;
        assert!(own == [is_bevy; 3] && has(gltf::Semantic::TexCoords(1)), "{engine:?}");
        assert_eq!(has(gltf::Semantic::TexCoords(2)), !is_bevy, "{engine:?}");
    }
}

#[test]
fn wind_for_the_web_is_packed_too() {
    let mesh = tree(3, 5);
    let wind = [&mesh.bark, &mesh.leaf].map(|part| Wind {
        weights: vec![[0.5, 0.25, 0.75]; part.positions.len()],
        pivots: part.positions.clone(),
        leaves: vec![glam::Vec2::ZERO; part.positions.len()],
    });
    let levels = [AssetLevel { mesh: &mesh, screen_coverage: 0.1, impostor: None, wind: Some(&wind) }];
    let materials = SetMaterials::of("set", TextureFormat::Png);
    let asset = AssetIn { name: "oak_001", seed: 1, below: 0.0, levels: &levels, materials: &materials };
    let files = engine_files(&asset, Colliders::default(), Engine::Web).unwrap();
    let gltf::Gltf { document, .. } = gltf::Gltf::from_slice_without_validation(&files[0].1).unwrap();
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives()) {
        let count = primitive.get(&gltf::Semantic::Positions).unwrap().count();
        let told = [1, 2, 3, 4].map(|set| {
            let accessor = primitive.get(&gltf::Semantic::TexCoords(set)).unwrap();
            (accessor.count(), accessor.data_type(), accessor.normalized())
        });
        let of = |is_share| (count, gltf::accessor::DataType::U16, is_share);
        assert_eq!(told, [of(true), of(false), of(false), of(true)]);
    }
}

#[test]
fn positions_for_the_web_are_whole_numbers_that_the_node_scales() {
    let mesh = tree(2, 3);
    let levels = [AssetLevel { mesh: &mesh, screen_coverage: 0.1, impostor: None, wind: None }];
    let materials = SetMaterials::of("set", TextureFormat::Png);
    let asset = AssetIn { name: "oak_001", seed: 1, below: 0.0, levels: &levels, materials: &materials };
    let files = engine_files(&asset, Colliders::default(), Engine::Web).unwrap();
    let json: serde_json::Value = {
        let bytes = &files[0].1;
        let length = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
        serde_json::from_slice(&bytes[20..20 + length]).unwrap()
    };
    let accessor =
        &json["accessors"][json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].as_u64().unwrap() as usize];
    assert!(accessor["normalized"].as_bool() != Some(true) && accessor["componentType"] == 5123);
    let node = json["nodes"].as_array().unwrap().iter().find(|node| node.get("mesh").is_some()).unwrap();
    // The widest of the quads reach 3 m along x.
    let metres = accessor["max"][0].as_f64().unwrap() * node["scale"][0].as_f64().unwrap();
    assert!(metres > 0.5 && metres < 3.01, "{metres}");
}

#[test]
fn leaves_say_in_every_file_what_they_let_through_and_ask_nobody_to_read_it() {
    const NAME: &str = "KHR_materials_diffuse_transmission";
    let mesh = tree(2, 3);
    let levels = [AssetLevel { mesh: &mesh, screen_coverage: 0.1, impostor: None, wind: None }];
    let engines = [Engine::Generic, Engine::Web, Engine::Godot, Engine::Unity, Engine::Unreal, Engine::Bevy];
    for (engine, through) in engines.into_iter().flat_map(|engine| [(engine, 84), (engine, 0)]) {
        let materials = SetMaterials::of("set", TextureFormat::Png).letting_through(through);
        let asset = AssetIn { name: "oak_001", seed: 1, below: 0.0, levels: &levels, materials: &materials };
        let (_, bytes) = &engine_files(&asset, Colliders::default(), engine).unwrap()[0];
        let length = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
        let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        let [bark, leaf] = [0, 1].map(|i| &json["materials"][i]);
        let lists = |list: &str| json[list].as_array().is_some_and(|all| all.iter().any(|used| used == NAME));
        assert!(!lists("extensionsRequired") && lists("extensionsUsed") == (through > 0), "{engine:?}");
        // Blue is no metal.
        assert_eq!(
            (&leaf["name"], leaf["pbrMetallicRoughness"]["metallicFactor"].as_f64()),
            (&"set_leaf".into(), Some(0.0))
        );
        assert!(bark["extensions"][NAME].is_null());
        let told = &leaf["extensions"][NAME];
        assert_eq!(told["diffuseTransmissionFactor"].as_f64(), (through > 0).then_some(0.329), "{engine:?}");
        if through > 0 {
            let color = &leaf["pbrMetallicRoughness"]["baseColorTexture"]["index"];
            assert_eq!(&told["diffuseTransmissionColorTexture"]["index"], color);
        }
    }
}
