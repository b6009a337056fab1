//! Data files that can't be read: each is one error that names the preset, the place and the field that asked for the
//! file, the file, and what to do.

#![cfg(feature = "cli")]

mod tiny;

use std::fs;
use std::path::Path;
use std::process::Command;

/// A mesh as glTF: a triangle with something of it put in another's place.
fn gltf(old: &str, new: &str) -> String {
    let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"gone.bin"}]}"#;
    assert!(text.contains(old));
    text.replace(old, new)
}

/// What `Import` is asked to read: name and content.
fn scans() -> Vec<(&'static str, Vec<u8>)> {
    let mat = |version: &[u8], rest: &[u8]| {
        let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
        bytes.resize(124, b' ');
        [&bytes, version, b"IM", rest].concat()
    };
    let cylinders = "radius,length,start_1,start_2,start_3,axis_1,axis_2,axis_3,parent\n";
    let ply = |count: &str| format!("ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nend_header\n0\n");
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    vec![
        ("huge.gltf", gltf("\"count\":3", "\"count\":4000000000").into_bytes()),
        ("missing.gltf", gltf("gone.bin", "gone.bin").into_bytes()),
        ("outside.gltf", gltf("gone.bin", "../../../../gone.bin").into_bytes()),
        ("ring.gltf", gltf("{\"mesh\":0}", "{\"mesh\":0,\"children\":[0]}").into_bytes()),
        ("cut.gltf", gltf("gone.bin", "gone.bin").as_bytes()[..200].to_vec()),
        ("empty.gltf", br#"{"asset":{"version":"2.0"}}"#.to_vec()),
        ("cut.glb", b"glTF\x02\0\0\0\0\x01\0\0JSON".to_vec()),
        ("index.obj", format!("{corners}f 1 2 9\n").into_bytes()),
        ("many.obj", format!("{corners}{}", "f 1 2 9\n".repeat(50)).into_bytes()),
        ("points.obj", corners.as_bytes().to_vec()),
        ("sheet.obj", format!("{corners}f 1 2 3\n").into_bytes()),
        ("huge.ply", ply("4000000000").into_bytes()),
        ("none.ply", ply("1").into_bytes()),
        ("kind.ply", b"ply\nformat ascii 9.0\nend_header\n".to_vec()),
        ("ring.swc", b"1 1 0 0 0 0.1 3\n2 5 0 0 0 0.08 1\n3 5 0 0 0 0.05 2\n".to_vec()),
        ("twice.swc", b"1 1 0 0 0 0.1 -1\n1 5 0 0 1 0.08 1\n".to_vec()),
        ("cut.swc", b"1 1 0 0 0 0.1 -1\n2 5 0 0 1\n".to_vec()),
        ("orphans.swc", b"1 1 0 0 0 0.1 77\n2 5 0 0 1 0.08 88\n".to_vec()),
        ("far.swc", b"1 1 0 0 0 0.1 -1\n2 5 0 0 1e30 0.08 1\n".to_vec()),
        ("cut.csv", format!("{cylinders}0.1,1,0,0\n").into_bytes()),
        ("head.csv", cylinders.as_bytes().to_vec()),
        ("words.csv", b"hello,world\nfoo,bar\n".to_vec()),
        ("latin.csv", b"radius,l\xe4nge,x\n1,2,3\n".to_vec()),
        (
            "cell.txt",
            b"radius (m)\tlength (m)\tstart_point\taxis_direction\tparent\n0.1\tx\t0\t0\t0\t0\t0\t1\t0\n".to_vec(),
        ),
        ("cut.mat", mat(b"\x00\x01", b"\x0f\0\0\0\0\0\x01\0abc")),
        ("head.mat", mat(b"\x00\x01", b"")),
        ("hdf.mat", b"\x89HDF\r\n\x1a\n".to_vec()),
        ("bad.mtg", b"CODE:\tFORM-A\n".to_vec()),
        ("empty", Vec::new()),
        ("zeros", vec![0; 100]),
        ("letter.txt", b"Dear Sir or Madam,\n".to_vec()),
        ("plant.dump", b"Plant(chains: 1".to_vec()),
        ("species.ron", tiny::SPECIES.as_bytes().to_vec()),
        ("preset.ron", tiny::GROWN.as_bytes().to_vec()),
    ]
}

/// What `Grow` is asked to read.
fn species() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("preset.ron", tiny::GROWN.as_bytes().to_vec()),
        ("word.ron", tiny::SPECIES.replace("nodes", "noodles").into_bytes()),
        ("cut.ron", tiny::SPECIES.trim_end_matches([')', '\n']).as_bytes().to_vec()),
        ("latin.ron", b"(height: \xe4)".to_vec()),
        ("empty.ron", Vec::new()),
        ("scan.swc", tiny::SCAN.as_bytes().to_vec()),
    ]
}

/// What a shape, a sketch and pictures are asked to be.
fn drawings() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("cut.svg", b"<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0".to_vec()),
        ("none.svg", b"<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'></svg>".to_vec()),
        ("cut.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec()),
        ("text.png", b"hello".to_vec()),
        ("empty.png", Vec::new()),
    ]
}

/// A project with presets that each ask for one such file: the preset's name, the field that asks, and the file.
fn project() -> (tempfile::TempDir, Vec<(String, String, String)>) {
    let project = tiny::project();
    let mut asked = Vec::new();
    let mut ask = |file: &str, content: &[u8], field: &str, old: &str, new: &str| {
        let name = format!("p{}.ron", asked.len());
        fs::create_dir_all(project.path().join("data")).unwrap();
        fs::write(project.path().join("data").join(file), content).unwrap();
        let text = tiny::GROWN.replace(old, &new.replace("FILE", &format!("data/{file}")));
        assert_ne!(text, tiny::GROWN);
        fs::write(project.path().join(&name), text).unwrap();
        asked.push((name, field.to_owned(), format!("data/{file}")));
    };
    let grow = r#"Grow(species: "species/tiny.ron", seed: 1)"#;
    for (file, content) in scans() {
        ask(file, &content, "sources[\"a\"].file", grow, "Import(file: \"FILE\")");
    }
    for (file, content) in species() {
        ask(&format!("s_{file}"), &content, "sources[\"a\"].species", grow, "Grow(species: \"FILE\")");
    }
    ask("l.swc", b"1 1 0 0 0 0.1 -1\n2 5 0 0 1\n", "sources[\"a\"].like", grow, "Grow(like: \"FILE\")");
    let obstacle = "Grow(species: \"species/tiny.ron\", obstacles: [Mesh(file: \"FILE\", x: 3.0)])";
    ask("o.obj", b"v 0 0 0\nf 1 2 9\n", "sources[\"a\"].obstacles", grow, obstacle);
    for (file, content) in drawings() {
        let (field, old, new) = if file.ends_with("svg") {
            ("variants[0].crown", "Source(\"a\")", "Sketch(of: \"a\", crown: \"FILE\")")
        } else {
            ("foliage.leaf.color", "art/leaf.png", "FILE")
        };
        ask(file, &content, field, old, new);
    }
    let standing = b"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'><circle cx='4' cy='3' r='3'/>\
        <rect id='trunk' x='3' y='5' width='2' height='4'/></svg>";
    let above = "Sketch(of: \"a\", crown: \"FILE\", elevation: 60.0)";
    ask("trunk.svg", standing, "variants[0].crown", "Source(\"a\")", above);
    let over =
        "Sketch(of: \"a\", crown: \"sketches/crown.svg\", then: [(crown: \"sketches/crown.svg\"), (crown: \"FILE\")])";
    fs::create_dir_all(project.path().join("sketches")).unwrap();
    fs::write(project.path().join("sketches/crown.svg"), standing).unwrap();
    ask(
        "over.svg",
        b"<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0",
        "variants[0].then[1].crown",
        "Source(\"a\")",
        over,
    );
    (project, asked)
}

/// The errors that a command tells, one a text.
fn told(project: &Path, arguments: &[&str]) -> Vec<String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    let output = command.current_dir(project).args(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!said.contains("panicked"), "{said}");
    said.split("error: ").skip(1).map(str::to_owned).collect()
}

/// What an error lacks.
fn lacks(error: &str, preset: &str, field: &str, file: &str) -> Vec<String> {
    let parts = [format!("{preset}:"), field.to_owned(), file.to_owned(), "= help: ".to_owned()];
    parts.into_iter().filter(|part| !error.contains(part)).collect()
}

#[test]
fn a_data_file_that_can_not_be_read_is_one_error_with_preset_place_field_file_and_fix() {
    let (project, asked) = project();
    let told = told(project.path(), &["check", "."]);
    let mut wrong = Vec::new();
    for (preset, field, file) in &asked {
        let own: Vec<&String> = told.iter().filter(|error| error.contains(&format!("/{preset}:"))).collect();
        match own[..] {
            [one] if lacks(one, preset, field, file).is_empty() => {}
            [one] => wrong.push(format!("{file}: no {:?} in {one}", lacks(one, preset, field, file))),
            _ => wrong.push(format!("{file}: {} errors: {own:?}", own.len())),
        }
    }
    assert!(wrong.is_empty() && told.len() == asked.len(), "{} of {}\n{}", told.len(), asked.len(), wrong.join("\n"));
}

#[test]
fn a_build_tells_the_same_and_leaves_the_set_as_it_was() {
    let project = tiny::project();
    let at = |name: &str| project.path().join(name);
    let build = ["build", "grown.ron", "--out", "out"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    let built = command.current_dir(project.path()).args(build).output().unwrap();
    assert!(built.status.success() && tiny::is_whole(&at("out/grown"), "grown"));
    let before = tiny::files(&at("out/grown"));
    fs::write(at("grown.ron"), tiny::scanned()).unwrap();
    fs::write(at("scans/tiny.swc"), "1 1 0 0 0 0.1 -1\n2 5 0 0 1\n").unwrap();
    let told = told(project.path(), &build);
    assert_eq!(told.len(), 1);
    assert_eq!(lacks(&told[0], "grown.ron", "sources[\"a\"].file", "scans/tiny.swc:2:"), [""; 0], "{}", told[0]);
    assert_eq!(tiny::files(&at("out/grown")), before);
}
