//! The small commands: what `inspect`, `new`, `schema` and `check` say, and that what they say can be used.

#![cfg(feature = "cli")]

mod tiny;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn treewright(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_treewright")).current_dir(folder).args(arguments).output().unwrap()
}

fn says(folder: &Path, arguments: &[&str]) -> String {
    let output = treewright(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn fails(folder: &Path, arguments: &[&str]) -> String {
    let output = treewright(folder, arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
    assert!(output.stdout.is_empty() && !said.contains("panicked"), "{said}");
    said
}

/// The tiny project with a scanned preset, and its two sets in `out`.
fn built() -> tempfile::TempDir {
    let project = tiny::project();
    let folder = project.path();
    fs::write(folder.join("scanned.ron"), tiny::scanned()).unwrap();
    assert!(treewright(folder, &["build", ".", "--out", "out"]).status.success());
    project
}

#[test]
fn every_kind_of_file_is_told_and_told_as_json() {
    let project = built();
    let folder = project.path();
    assert!(["grown", "scanned"].iter().all(|set| tiny::is_whole(&folder.join("out").join(set), set)));
    for (file, kind, part) in [
        ("species/tiny.ron", "species", "plant"),
        ("scans/tiny.swc", "SWC", "plant"),
        ("out/grown/grown_001.glb", "glb", "asset"),
        ("art/leaf.png", "PNG", "picture"),
    ] {
        assert!(says(folder, &["inspect", file]).starts_with(&format!("{file} ({kind})")));
        let json: serde_json::Value = serde_json::from_str(&says(folder, &["inspect", file, "--json"])).unwrap();
        assert_eq!(json["kind"], kind);
        assert!(json[part].is_object(), "{json}");
    }
}

#[test]
fn a_picture_is_told_with_its_size_and_channels() {
    let project = tiny::project();
    let said = says(project.path(), &["inspect", "art/leaf.png"]);
    assert_eq!(said, "art/leaf.png (PNG)\n16 x 16 pixels, 4 channels of 8 bits: red, green, blue, alpha\n");
    assert!(fails(project.path(), &["inspect", "art/leaf.png", "--dump", "a.ron"]).contains("a PNG holds no plant"));
}

#[test]
fn a_dump_reads_back_as_the_same_plant() {
    let project = tiny::project();
    let folder = project.path();
    for file in ["species/tiny.ron", "scans/tiny.swc"] {
        let first = says(folder, &["inspect", file, "--dump", "a.ron"]);
        let second = says(folder, &["inspect", "a.ron", "--dump", "b.ron"]);
        assert!(second.starts_with("a.ron (plant)"), "{second}");
        let figures =
            |text: &str| text.lines().skip(1).filter(|l| !l.starts_with("note")).collect::<Vec<_>>().join("\n");
        assert_eq!(figures(&first), figures(&second));
        assert_eq!(fs::read(folder.join("a.ron")).unwrap(), fs::read(folder.join("b.ron")).unwrap());
    }
}

#[test]
fn nothing_is_written_over_what_it_is_made_from() {
    let project = tiny::project();
    let folder = project.path();
    let scan = fs::read(folder.join("scans/tiny.swc")).unwrap();
    let said = fails(folder, &["inspect", "scans/tiny.swc", "--dump", "scans/../scans/tiny.swc"]);
    assert!(said.contains("it is what is read"), "{said}");
    let said = fails(folder, &["distance", "scans/tiny.swc", "species/tiny.ron", "--dendrogram", "scans/tiny.swc"]);
    assert!(said.contains("it is what is read"), "{said}");
    assert_eq!(fs::read(folder.join("scans/tiny.swc")).unwrap(), scan);
}

#[test]
fn a_folder_in_the_place_of_a_file_is_told_as_one() {
    let project = tiny::project();
    for folder in [".", "species", "species/.."] {
        let said = fails(project.path(), &["inspect", folder]);
        assert!(said.contains("it is a folder"), "{said}");
    }
}

#[test]
fn a_wrong_target_is_told_before_the_work() {
    let project = tiny::project();
    fs::write(project.path().join("kept.svg"), "mine").unwrap();
    // What is to be read is not there, which the work would tell first.
    for (command, target) in [
        (&["inspect", "none.swc", "--dump"][..], "grown.ron"),
        (&["inspect", "none.swc", "--dump"], "none/dump.ron"),
        (&["inspect", "none.swc", "--morph-to", "none.swc", "--plot"], "kept.svg"),
        (&["distance", "none.swc", "none.swc", "--dendrogram"], "kept.svg"),
        (&["estimate", "none.swc", "--out"], "species/tiny.ron"),
    ] {
        let said = fails(project.path(), &[command, &[target]].concat());
        assert!(said.contains(&format!("can't write {target}")), "{said}");
    }
}

#[test]
fn a_set_whose_preset_is_gone_is_told_and_no_reason_to_fail() {
    let project = built();
    let folder = project.path();
    fs::remove_file(folder.join("scanned.ron")).unwrap();
    let checked = treewright(folder, &["build", ".", "--out", "out", "--check"]);
    let said = String::from_utf8_lossy(&checked.stderr).into_owned() + &String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success() && said.contains("scanned.ron, is gone"), "{said}");
    fs::write(folder.join("grown.ron"), tiny::GROWN.replace("density: 0.1", "density: 0.2")).unwrap();
    assert!(!treewright(folder, &["build", ".", "--out", "out", "--check"]).status.success());
}

#[test]
fn what_the_trunk_bears_over_a_morph_is_told_and_plotted() {
    let project = tiny::project();
    let folder = project.path();
    let asked = ["inspect", "species/tiny.ron", "--morph-to", "scans/tiny.swc", "--plot", "load.svg"];
    assert!(says(folder, &asked).contains("while it morphs"));
    let plot = fs::read_to_string(folder.join("load.svg")).unwrap();
    assert!(plot.starts_with("<svg") && plot.contains("one-to-many") && plot.contains("2 x the straight line"));
    let json: serde_json::Value = serde_json::from_str(&says(folder, &[&asked[..], &["--json"]].concat())).unwrap();
    assert!(json["trunk_support"].as_f64().is_some_and(|share| (0.0..=1.0).contains(&share)));
    let many = json["morph"]["one_to_many"].as_array().unwrap();
    assert_eq!((many.len(), many[0].as_f64()), (101, json["trunk_support"].as_f64()));
}

#[test]
fn what_can_not_be_inspected_is_said_in_words() {
    let project = tiny::project();
    let folder = project.path();
    fs::write(folder.join("latin.ron"), b"(\xe4)").unwrap();
    fs::write(folder.join("cut.glb"), b"glTF\x02\0\0\0").unwrap();
    fs::write(folder.join("plant.ron"), "Plant(chains: 1").unwrap();
    fs::write(folder.join("nothing"), "").unwrap();
    fs::write(folder.join("cut.png"), &fs::read(folder.join("art/leaf.png")).unwrap()[..20]).unwrap();
    for (file, part) in [
        ("species", "it is a folder"),
        ("gone.csv", "no such file"),
        ("latin.ron", "UTF-8"),
        ("cut.glb", "cut.glb"),
        ("plant.ron", "plant.ron"),
        ("nothing", "empty"),
        ("cut.png", "save the picture again"),
        ("grown.ron", "this is a preset"),
    ] {
        let said = fails(folder, &["inspect", file]);
        assert!(said.contains(part), "{file}: {said}");
    }
}

#[test]
fn a_reader_that_stops_early_is_no_panic() {
    let project = tiny::project();
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    command.current_dir(project.path()).args(["schema"]).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    // Nobody hears the errors either: the exit code is that of errors, not of a panic; and a set is built all the same.
    fs::write(project.path().join("wrong.ron"), "(sources: 1)").unwrap();
    for (arguments, code) in [(&["check", "wrong.ron"][..], 1), (&["build", "grown.ron", "--out", "out"], 0)] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
        command.current_dir(project.path()).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().unwrap().code(), Some(code), "{arguments:?}");
    }
    assert!(tiny::is_whole(&project.path().join("out/grown"), "grown"));
}

#[test]
fn the_schema_that_is_printed_is_the_documented_one() {
    for (file, arguments) in [("schema.md", &["schema"][..]), ("schema.json", &["schema", "json"])] {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/preset").join(file);
        assert_eq!(says(Path::new("."), arguments), fs::read_to_string(shipped).unwrap());
    }
}

#[test]
fn a_new_preset_is_good_and_never_overwrites() {
    let project = tempfile::tempdir().unwrap();
    let folder = project.path();
    says(folder, &["new", "lime"]);
    says(folder, &["check", "presets"]);
    let preset = folder.join("presets/lime.ron");
    fs::write(&preset, "mine").unwrap();
    assert!(fails(folder, &["new", "lime"]).contains("exists"));
    fs::remove_file(&preset).unwrap();
    assert!(fails(folder, &["new", "lime"]).contains("species"), "the species file would be overwritten");
    assert!(!preset.exists());
    assert!(fails(folder, &["new", "a b"]).contains("name"));
    assert!(fails(folder, &["new", "../lime"]).contains("--folder"));
}

#[test]
fn an_estimated_species_is_written_once_and_grows() {
    let project = tiny::project();
    let folder = project.path();
    let told = says(folder, &["estimate", "scans/tiny.swc"]);
    assert!(told.starts_with("// `treewright estimate scans/tiny.swc`") && told.contains("iterations: ["), "{told}");
    says(folder, &["estimate", "scans/tiny.swc", "-o", "species/like.ron"]);
    assert_eq!(fs::read_to_string(folder.join("species/like.ron")).unwrap().trim(), told.trim());
    assert!(fails(folder, &["estimate", "scans/tiny.swc", "-o", "species/like.ron"]).contains("it exists"));
    // What `Grow(like: …)` grows in a preset is what that species grows.
    let preset = "(sources: {\"a\": Grow(like: \"scans/tiny.swc\"), \"b\": Grow(species: \"species/like.ron\")},
        variants: [Source(\"a\"), Source(\"b\")], lods: [Full])";
    fs::write(folder.join("like.ron"), preset).unwrap();
    assert!(treewright(folder, &["build", "like.ron", "--out", "out"]).status.success());
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("out/like/like.manifest.json")).unwrap()).unwrap();
    let of = |i: usize| manifest["variants"][i]["trunk_radius"].as_f64();
    assert!(of(0).is_some() && of(0) == of(1), "{manifest}");
}

#[test]
fn json_of_a_plant_has_the_documented_fields() {
    let project = tiny::project();
    let text = says(project.path(), &["inspect", "species/tiny.ron", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let plant = &json["plant"];
    for field in ["height", "width", "stems", "tips", "bifurcation_ratio", "strahler", "murray", "orders"] {
        assert!(!plant[field].is_null(), "{field}: {text}");
    }
    for field in ["exponent", "forks", "residual"] {
        assert!(plant["murray"][field].is_number(), "{field}: {text}");
    }
    for field in ["length", "base_radius", "branching_angle", "length_ratio", "radius_ratio", "slenderness"] {
        for part in ["count", "min", "low", "lower", "median", "upper", "high", "max"] {
            assert!(plant["orders"][1][field][part].is_number(), "{field}.{part}: {text}");
        }
    }
}

#[test]
fn distances_and_symmetry_are_measured_by_the_costs_that_are_given() {
    let project = tiny::project();
    let folder = project.path();
    // A limb to the one side, and one to the other a little higher.
    let chain = |parent: &str, at: f32, tip: &str| {
        format!("Chain(parent: {parent}, location: {at}, origin: (0, 0, 0), points: [(0, 0, 0, 0.1), {tip}]),")
    };
    let plant = |limbs: &[(f32, f32)]| {
        let limbs = limbs.iter().map(|(at, x)| chain("Some(0)", *at, &format!("({x}, 0.3, 0.2, 0.05)")));
        let chains = chain("None", 0.0, "(0, 4, 0, 0.05)") + &limbs.collect::<String>();
        format!("Plant(chains: [{chains}], leaves: [])")
    };
    let files = ["left.ron", "right.ron", "both.ron"];
    for (file, limbs) in files.iter().zip([&[(0.5, -1.0)][..], &[(0.52, 1.0)], &[(0.5, -1.0), (0.55, 1.0)]]) {
        fs::write(folder.join(file), plant(limbs)).unwrap();
    }
    let told = |more: &[&str]| -> serde_json::Value {
        serde_json::from_str(&says(folder, &[&["distance"], &files[..2], more].concat())).unwrap()
    };
    // By more than that they do not go together.
    let (usual, paper) = (told(&[]), told(&["--direction", "0", "--length", "0"]));
    assert_ne!(told(&["--direction", "1"])["distances"], usual["distances"]);
    assert_eq!(paper["matching"], serde_json::json!({ "epsilon": 0.1, "direction": 0.0, "length": 0.0 }));
    assert_eq!(told(&["--epsilon", "0.1", "--length", "0.05"]), usual);
    assert_ne!(told(&["--direction", "0", "--epsilon", "0.01"])["distances"], usual["distances"]);
    let mirrored = |more: &[&str]| says(folder, &[&["inspect", files[2], "--symmetry", "--json"], more].concat());
    assert_ne!(mirrored(&["--metric", "qed"]), mirrored(&[]));
    assert_ne!(mirrored(&["--epsilon", "0.001"]), mirrored(&[]));
    let of_two = |option, value| vec!["distance", files[0], files[1], option, value];
    let wrong = [of_two("--length", "2"), of_two("--epsilon", "0"), vec!["inspect", files[2], "--direction", "0"]];
    for wrong in &wrong {
        assert_eq!(treewright(folder, wrong).status.code(), Some(2), "{wrong:?}");
    }
    let help = says(folder, &["distance", "--help"]) + &says(folder, &["inspect", "--help"]);
    assert!(["--epsilon", "--direction", "--length"].iter().all(|name| help.matches(name).count() == 2), "{help}");
}

#[test]
fn distances_are_told_as_json_and_csv_and_drawn() {
    let project = tiny::project();
    let folder = project.path();
    let files = ["species/tiny.ron", "scans/tiny.swc", "species/tiny.ron"];
    let with = |more: &[&str]| says(folder, &[&["distance"], &files[..], more].concat());
    for metric in ["qed", "edit", "elastic"] {
        let told: serde_json::Value = serde_json::from_str(&with(&["--metric", metric])).unwrap();
        assert_eq!(told["metric"], metric);
        let at = |i: usize, j: usize| told["distances"][i][j].as_f64().unwrap();
        assert!(at(0, 1) > 0.0 && at(0, 1) == at(1, 0) && at(0, 0) == 0.0 && at(0, 2) == 0.0);
        assert_eq!(told["merges"][0]["of"], serde_json::json!([0, 2]));
    }
    let near: serde_json::Value = serde_json::from_str(&with(&["--turn"])).unwrap();
    let far: serde_json::Value = serde_json::from_str(&with(&[])).unwrap();
    assert!(near["distances"][0][1].as_f64() <= far["distances"][0][1].as_f64());
    let csv = with(&["--format", "csv", "--dendrogram", "tree.svg"]);
    assert!(csv.starts_with("\"\",\"species/tiny.ron\",\"scans/tiny.swc\"") && csv.lines().count() == 4, "{csv}");
    let svg = fs::read_to_string(folder.join("tree.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.matches("<path").count() == 2);
    assert_eq!(treewright(folder, &["distance", "species/tiny.ron"]).status.code(), Some(2));
    assert!(fails(folder, &["distance", "species/tiny.ron", "gone.csv"]).contains("no such file"));
}
