//! What goes wrong around a build: killed processes, two at once, folders and files in the way, hostile presets.

#![cfg(feature = "cli")]
#![expect(clippy::print_stderr, reason = "says what was skipped")]

mod kills;
mod tiny;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn command(project: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    command.current_dir(project).args(arguments).stdin(Stdio::null());
    command
}

fn run(project: &Path, arguments: &[&str]) -> Output {
    command(project, arguments).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Builds and expects exit code 1; what was said.
fn fails(project: &Path, arguments: &[&str]) -> String {
    let output = run(project, arguments);
    let said = errors(&output);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    said
}

fn builds(project: &Path, arguments: &[&str]) -> String {
    let output = run(project, arguments);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    errors(&output)
}

#[test]
fn builds_and_watchers_killed_at_any_moment_leave_the_old_set_or_the_new_one() {
    // `examples/figures` kills 500.
    let victims = [(kills::Victim::Build, 24), (kills::Victim::Watch, 8)];
    let found = victims.map(|(victim, count)| kills::kill(&command, victim, count));
    assert!(found.iter().all(kills::Found::is_good), "{found:?}");
    assert!(found[0].cut_off > 0 && found[0].ended + found[1].ended > 0, "{found:?}");
}

#[test]
fn eight_builds_at_once_into_one_folder_and_one_cache_end_in_one_whole_set() {
    let project = tiny::project();
    let children: Vec<_> = (0..8)
        .map(|_| {
            let arguments = ["build", "grown.ron", "--force", "--out", "out", "--cache", "kept"];
            let mut command = command(project.path(), &arguments);
            command.stderr(Stdio::piped()).spawn().unwrap()
        })
        .collect();
    for child in children {
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    }
    assert!(tiny::is_whole(&project.path().join("out/grown"), "grown"));
    builds(project.path(), &["build", "grown.ron", "--out", "alone"]);
    assert_eq!(tiny::files(&project.path().join("out/grown")), tiny::files(&project.path().join("alone/grown")));
    assert!(!builds(project.path(), &["build", "grown.ron", "--force", "--out", "out", "--cache", "kept"]).contains("note"));
    let others: Vec<String> = tiny::files(&project.path().join("out")).into_keys().collect();
    assert!(others.iter().all(|name| [".treewright-lock", ".treewright-index"].contains(&name.as_str())), "{others:?}");
}

#[test]
fn an_output_folder_that_can_not_be_is_named_with_a_way_out() {
    let project = tiny::project();
    let at = |name: &str| project.path().join(name);
    fs::write(at("file"), "mine").unwrap();
    for out in ["file", "file/below"] {
        let said = fails(project.path(), &["build", "grown.ron", "--out", out]);
        assert!(said.contains("a file is where a folder is needed") && said.contains(out), "{said}");
        assert!(said.contains("--out"), "no way out: {said}");
    }
    assert_eq!(fs::read_to_string(at("file")).unwrap(), "mine");

    // A folder where a file of the set belongs, and a file where the set's folder belongs.
    fs::create_dir_all(at("out/grown/grown_001.glb")).unwrap();
    let said = fails(project.path(), &["build", "grown.ron", "--out", "out"]);
    assert!(said.contains("grown_001.glb"), "{said}");
    assert_eq!(tiny::files(&at("out/grown")).len(), 0, "something was written beside it");
    fs::create_dir(at("out2")).unwrap();
    fs::write(at("out2/grown"), "mine").unwrap();
    let said = fails(project.path(), &["build", "grown.ron", "--out", "out2"]);
    assert!(said.contains("out2/grown") && said.contains("a file is where a folder is needed"), "{said}");

    let mut rights = fs::metadata(at("art")).unwrap().permissions();
    rights.set_readonly(true);
    fs::create_dir(at("sealed")).unwrap();
    fs::set_permissions(at("sealed"), rights).unwrap();
    if fs::write(at("sealed/probe"), "").is_ok() {
        eprintln!("skipped: this user may write into read-only folders");
    } else {
        let said = fails(project.path(), &["build", "grown.ron", "--out", "sealed"]);
        assert!(said.contains("there is no right to write it") && said.contains("sealed"), "{said}");
    }
}

#[test]
fn a_file_of_somebody_elses_is_not_replaced() {
    let project = tiny::project();
    let folder = project.path().join("out/grown");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("grown_001.glb"), "mine").unwrap();
    let said = fails(project.path(), &["build", "grown.ron", "--out", "out"]);
    assert!(said.contains("grown_001.glb") && said.contains("did not write it"), "{said}");
    // Nor one that another program's manifest lists.
    fs::write(folder.join("grown.manifest.json"), r#"{"generator":"x","key":"","files":[{"file":"grown_001.glb"}]}"#)
        .unwrap();
    let said = fails(project.path(), &["build", "grown.ron", "--out", "out"]);
    assert!(said.contains("1 more"), "{said}");
    assert_eq!(fs::read_to_string(folder.join("grown_001.glb")).unwrap(), "mine");
    assert_eq!(tiny::files(&folder).len(), 2);
}

#[test]
fn hostile_presets_are_errors_that_name_file_and_place() {
    let project = tiny::project();
    let at = |name: &str| project.path().join(name);
    let import = |file: &str| tiny::scanned().replace("scans/tiny.swc", file);
    fs::write(at("scans/bad.csv"), "1,2\nx").unwrap();
    fs::write(
        at("species/none.ron"),
        tiny::SPECIES.replace("bottom: 0.35, top: 0.9, radius: 0.36", "bottom: 0.98, top: 0.99, radius: 0.001"),
    )
    .unwrap();
    fs::write(at("art/text.png"), "no picture").unwrap();
    let cases: [(&str, Vec<u8>, &[&str]); 11] = [
        ("empty", Vec::new(), &["empty.ron", "the file is empty"]),
        ("binary", b"(\n  seed: \xff\xfe)".to_vec(), &["binary.ron", "UTF-8", "line 2"]),
        ("deep", vec![b'('; 5_000_000], &["deep.ron", "larger than"]),
        ("nested", vec![b'('; 100_000], &["nested.ron:1:"]),
        ("folder", import("scans").into_bytes(), &["folder.ron:4:", "sources[\"a\"].file", "it is a folder"]),
        ("gone", import("scans/gone.csv").into_bytes(), &["gone.ron:4:", "sources[\"a\"].file", "no such file"]),
        ("outside", import("/etc/passwd").into_bytes(), &["outside.ron:4:", "absolute"]),
        ("scan", import("scans/bad.csv").into_bytes(), &["scans/bad.csv:1:"]),
        (
            "bare",
            tiny::GROWN.replace("tiny.ron", "none.ron").into_bytes(),
            &["bare.ron:4:14", "sources[\"a\"]", "help:"],
        ),
        (
            "art",
            tiny::GROWN.replace("leaf.png", "text.png").into_bytes(),
            &["art.ron:7:", "foliage.leaf.color", "text.png"],
        ),
        ("cut", b"(\n  sources: {".to_vec(), &["cut.ron:2:", "not closed"]),
    ];
    for (name, text, _) in &cases {
        fs::write(at(&format!("{name}.ron")), text).unwrap();
    }
    for (name, _, parts) in &cases {
        let said = fails(project.path(), &["build", &format!("{name}.ron"), "--out", "alone"]);
        for part in *parts {
            assert!(said.contains(part), "{name}: {part} is not said: {said}");
        }
        assert!(said.len() < 4000, "{name}: too much is said");
    }
    // All at once: every error is told, and the good preset among them is built.
    let said = fails(project.path(), &["build", ".", "--keep-going", "--out", "out"]);
    for (name, _, parts) in &cases {
        assert!(parts.iter().all(|part| said.contains(part)), "{name} is not told: {said}");
    }
    assert!(tiny::is_whole(&at("out/grown"), "grown"));
    // And checking finds all but what only growing can find.
    let said = fails(project.path(), &["check", "."]);
    for (name, _, parts) in cases.iter().filter(|(name, ..)| *name != "bare") {
        assert!(parts.iter().all(|part| said.contains(part)), "{name} is not checked: {said}");
    }
    fs::create_dir(at("folder_named.ron")).unwrap();
    let said = fails(project.path(), &["build", "folder_named.ron", "--out", "out"]);
    assert!(said.contains("holds no preset"), "{said}");
}

#[test]
fn two_presets_of_one_name_are_told_before_one_overwrites_the_other() {
    let project = tiny::project();
    let at = |name: &str| project.path().join(name);
    for folder in ["species", "art"] {
        fs::create_dir_all(at("more").join(folder)).unwrap();
        for entry in fs::read_dir(at(folder)).unwrap() {
            let path = entry.unwrap().path();
            fs::copy(&path, at("more").join(folder).join(path.file_name().unwrap())).unwrap();
        }
    }
    fs::write(at("more/Grown.ron"), tiny::GROWN).unwrap();
    for arguments in [vec!["build", "-k", "grown.ron", "more", "--out", "out"], vec!["check", "grown.ron", "more"]] {
        let said = fails(project.path(), &arguments);
        assert!(said.contains("same name") && said.contains("grown.ron") && said.contains("Grown.ron"), "{said}");
    }
    assert!(tiny::is_whole(&at("out/grown"), "grown"));
    // The same preset named twice is one.
    assert!(
        builds(project.path(), &["build", "grown.ron", "./grown.ron", ".", "--out", "out"])
            .contains("nothing had changed")
    );
}
