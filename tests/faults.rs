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

/// A command that the rights of files hold for: root passes them all, so it gives the project to nobody and runs as that.
#[cfg(unix)]
fn ruled(project: &Path, arguments: &[&str]) -> Output {
    use std::os::unix::fs::{MetadataExt, chown};
    use std::os::unix::process::CommandExt;
    const NOBODY: u32 = 65534;
    let mut command = command(project, arguments);
    // Who makes a file owns it.
    let mark = tempfile::NamedTempFile::new().unwrap();
    if fs::metadata(mark.path()).unwrap().uid() == 0 {
        let mut left = vec![project.to_path_buf()];
        while let Some(path) = left.pop() {
            std::os::unix::fs::lchown(&path, Some(NOBODY), Some(NOBODY)).unwrap();
            if path.is_dir() {
                left.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
            }
        }
        chown(project, Some(NOBODY), Some(NOBODY)).unwrap();
        command.uid(NOBODY).gid(NOBODY);
    }
    command.output().unwrap()
}

#[cfg(unix)]
fn allow(path: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
}

#[cfg(unix)]
#[test]
fn a_set_that_may_not_be_written_is_told_and_built_once_it_may_be() {
    let project = tiny::project();
    let build = ["build", "grown.ron", "--out", "out"];
    let set = project.path().join("out/grown");
    assert_eq!(ruled(project.path(), &build).status.code(), Some(0));
    fs::write(project.path().join("grown.ron"), tiny::GROWN.replace("density: 0.1", "density: 0.2")).unwrap();
    let old = tiny::files(&set);
    allow(&set, 0o555);
    for _ in 0..2 {
        let output = ruled(project.path(), &build);
        assert_eq!(output.status.code(), Some(1), "{}", errors(&output));
        assert!(errors(&output).contains("no right to write"), "{}", errors(&output));
        assert!(tiny::files(&set) == old && !project.path().join("out/.treewright-grown.next").exists());
    }
    // A folder of that kind, left by a build that was cut off, is in nobody's way.
    let next = project.path().join("out/.treewright-grown.next");
    fs::create_dir(&next).unwrap();
    fs::write(next.join(".treewright-exchange.json"), "[]").unwrap();
    allow(&next, 0o555);
    allow(&set, 0o755);
    let output = ruled(project.path(), &build);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert!(tiny::is_whole(&set, "grown") && tiny::files(&set) != old && !next.exists());
}

#[cfg(unix)]
#[test]
fn a_lock_and_sets_that_can_only_be_read_are_enough_for_who_shares_or_compares_them() {
    let project = tiny::project();
    let build = ["build", "grown.ron", "--out", "out"];
    let out = project.path().join("out");
    assert_eq!(ruled(project.path(), &build).status.code(), Some(0));
    // Another user's lock.
    allow(&out.join(".treewright-lock"), 0o444);
    fs::write(project.path().join("grown.ron"), tiny::GROWN.replace("density: 0.1", "density: 0.2")).unwrap();
    let output = ruled(project.path(), &build);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert!(errors(&output).contains(" written, "), "{}", errors(&output));
    // What is current needs nothing, not even a lock.
    for name in [".treewright-lock", ".treewright-index"] {
        fs::remove_file(out.join(name)).unwrap();
    }
    allow(&out, 0o555);
    let output = ruled(project.path(), &build);
    allow(&out, 0o755);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert!(errors(&output).contains("nothing had changed"), "{}", errors(&output));
}

/// What somebody keeps under a name that builds use.
#[test]
fn a_folder_in_the_place_of_the_new_one_is_left_alone() {
    let project = tiny::project();
    let build = ["build", "grown.ron", "--out", "out"];
    builds(project.path(), &build);
    let theirs = project.path().join("out/.treewright-grown.next");
    fs::create_dir(&theirs).unwrap();
    fs::write(theirs.join("file"), "mine").unwrap();
    fs::write(project.path().join("grown.ron"), tiny::GROWN.replace("density: 0.1", "density: 0.2")).unwrap();
    assert!(builds(project.path(), &build).contains(" written, "));
    assert!(builds(project.path(), &build).contains("nothing had changed"));
    assert_eq!(fs::read_to_string(theirs.join("file")).unwrap(), "mine");
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
    let again = builds(project.path(), &["build", "grown.ron", "--force", "--out", "out", "--cache", "kept"]);
    assert!(!again.contains("damaged"), "{again}");
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
fn what_of_the_page_can_not_be_written_is_told_by_its_own_name() {
    let project = tiny::project();
    for name in [".treewright-species", "gallery.html"] {
        let path = project.path().join("out").join(name);
        let _ = fs::remove_file(&path);
        fs::create_dir_all(path.join("mine")).unwrap();
        let said = fails(project.path(), &["build", ".", "--out", "out"]);
        assert!(said.contains(&format!("out/{name}")) && said.contains("a folder is where a file"), "{said}");
        assert!(tiny::is_whole(&project.path().join("out/grown"), "grown"));
        fs::remove_dir_all(path).unwrap();
        builds(project.path(), &["build", ".", "--out", "out"]);
    }
}

#[test]
fn read_only_files_of_a_set_are_told_and_kept() {
    let project = tiny::project();
    let set = project.path().join("out/grown");
    builds(project.path(), &["build", "grown.ron", "--out", "out"]);
    let mark = |is: bool| {
        for name in tiny::files(&set).keys() {
            let mut rights = fs::metadata(set.join(name)).unwrap().permissions();
            rights.set_readonly(is);
            fs::set_permissions(set.join(name), rights).unwrap();
        }
    };
    mark(true);
    let old = tiny::files(&set);
    builds(project.path(), &["build", "grown.ron", "--out", "out", "--force"]);
    fs::write(project.path().join("grown.ron"), tiny::GROWN.replace("density: 0.1", "density: 0.2")).unwrap();
    let said = fails(project.path(), &["build", "grown.ron", "--out", "out"]);
    assert!(said.contains("read-only") && said.contains("p4 edit") && said.contains("out/grown"), "{said}");
    assert!(tiny::files(&set) == old && fs::metadata(set.join("grown_001.glb")).unwrap().permissions().readonly());
    mark(false);
    builds(project.path(), &["build", "grown.ron", "--out", "out"]);
    assert!(tiny::is_whole(&set, "grown") && tiny::files(&set) != old);
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
    // A scan out of the project, where that is not wanted.
    let elsewhere = tempfile::tempdir().unwrap();
    fs::write(elsewhere.path().join("tree.swc"), tiny::SCAN).unwrap();
    let climbing = format!("../{}/tree.swc", elsewhere.path().file_name().unwrap().to_string_lossy());
    fs::write(at("climbing.ron"), import(&climbing)).unwrap();
    builds(project.path(), &["build", "climbing.ron", "--out", "alone"]);
    let said = fails(project.path(), &["build", "climbing.ron", "--out", "other", "--root", "."]);
    assert!(said.contains("climbing.ron:4:") && said.contains("outside of the project"), "{said}");
    fs::remove_file(at("climbing.ron")).unwrap();
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

/// A command in namespaces of its own, where it may mount; its standard output when that can be had here.
#[cfg(target_os = "linux")]
fn isolated(project: &Path, script: &str) -> Option<String> {
    let run = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "sh", "-ec", script]);
        command.current_dir(project).env("TREEWRIGHT", env!("CARGO_BIN_EXE_treewright")).output().ok()
    };
    if !run("mount -t tmpfs -o size=64k tmpfs art").is_some_and(|output| output.status.success()) {
        eprintln!("skipped: nothing can be mounted here");
        return None;
    }
    let output = run(script)?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", errors(&output));
    Some(said)
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_and_a_read_only_one_are_told_and_the_old_set_stays() {
    let project = tiny::project();
    fs::create_dir(project.path().join("small")).unwrap();
    let script = r#"
        mount -t tmpfs -o size=16m tmpfs small
        $TREEWRIGHT build grown.ron --out small/out --cache small/kept
        echo mine > small/out/grown/mine.txt
        cp -r small/out/grown before
        sed -i '0,/seed: 1/s//seed: 2/' grown.ron
        head -c 32m /dev/zero > small/filler 2> /dev/null || true
        if $TREEWRIGHT build grown.ron --out small/out --cache small/kept 2>> said; then exit 3; fi
        diff -r small/out/grown before
        if $TREEWRIGHT estimate species/tiny.ron --out small/species.ron 2>> said; then exit 5; fi
        if $TREEWRIGHT inspect scans/tiny.swc --dump small/dump.ron 2>> said; then exit 6; fi
        test ! -e small/species.ron -a ! -e small/dump.ron
        test "$(ls -A small/out | sort | tr '\n' ' ')" = ".treewright-index .treewright-lock grown "
        mount -o remount,ro small
        if $TREEWRIGHT build grown.ron --out small/out 2>> said; then exit 4; fi
        diff -r small/out/grown before
        mount -o remount,rw small
        rm small/filler
        $TREEWRIGHT build grown.ron --out small/out --cache small/kept
        rm small/out/grown/mine.txt
        cp -r small/out/grown after
        cat said
    "#;
    let Some(said) = isolated(project.path(), script) else { return };
    assert!(said.contains("the disk is full; the old set is untouched"), "{said}");
    assert!(said.contains("there is no right to write it"), "{said}");
    assert!(tiny::is_whole(&project.path().join("after"), "grown"));
}

#[cfg(target_os = "linux")]
#[test]
fn paths_that_are_no_text_links_and_long_names_are_built_or_told() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::symlink;
    let project = tiny::project();
    let at = |name: &str| project.path().join(name);
    // A folder whose name is no text, of presets and of sets.
    let odd = project.path().join(OsStr::from_bytes(b"odd\xff\xfe"));
    fs::create_dir(&odd).unwrap();
    for name in ["species", "art", "grown.ron"] {
        symlink(at(name), odd.join(name)).unwrap();
    }
    for _ in 0..2 {
        let mut build = command(project.path(), &["build"]);
        let output = build.arg(&odd).arg("--out").arg(odd.join("out")).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        assert!(tiny::is_whole(&odd.join("out/grown"), "grown"));
    }
    // The set would be called after it.
    let odd_file = project.path().join(OsStr::from_bytes(b"odd\xff.ron"));
    fs::copy(at("grown.ron"), &odd_file).unwrap();
    let output = command(project.path(), &["build", "--out", "out"]).arg(&odd_file).output().unwrap();
    assert!(output.status.code() == Some(1) && errors(&output).contains("not UTF-8"), "{}", errors(&output));
    fs::remove_file(odd_file).unwrap();
    // A set's folder, and a folder of sets, that are links; and a link of the user's among the files of a set.
    fs::create_dir_all(at("elsewhere/set")).unwrap();
    symlink(at("elsewhere"), at("out")).unwrap();
    symlink(at("elsewhere/set"), at("elsewhere/grown")).unwrap();
    symlink("nowhere", at("elsewhere/set/mine")).unwrap();
    for seed in [1, 2, 3] {
        let text = tiny::GROWN.replace("seed: 1,\n    sources", &format!("seed: {seed},\n    sources"));
        fs::write(at("grown.ron"), text).unwrap();
        builds(project.path(), &["build", "grown.ron", "--out", "out"]);
        assert!(fs::symlink_metadata(at("elsewhere/grown")).unwrap().is_symlink());
        assert_eq!(fs::read_link(at("elsewhere/set/mine")).unwrap(), Path::new("nowhere"));
        builds(project.path(), &["build", "grown.ron", "--out", "plain"]);
        if seed == 1 {
            symlink("nowhere", at("plain/grown/mine")).unwrap();
        }
        assert_eq!(fs::read_link(at("plain/grown/mine")).unwrap(), Path::new("nowhere"));
        assert_eq!(tiny::files(&at("plain/grown")), tiny::files(&at("elsewhere/set")));
    }
    // A link that leads nowhere, where a file of the set belongs.
    fs::create_dir_all(at("linked/grown")).unwrap();
    symlink("nowhere", at("linked/grown/grown_001.glb")).unwrap();
    let said = fails(project.path(), &["build", "grown.ron", "--out", "linked"]);
    assert!(said.contains("grown_001.glb") && said.contains("did not write it"), "{said}");
    // The longest name that a set may have, in a folder as deep as that leaves room for; and what is longer.
    let (longest, longer) = ("n".repeat(64), "n".repeat(65));
    for name in [&longest, &longer] {
        fs::copy(at("grown.ron"), at(&format!("{name}.ron"))).unwrap();
    }
    let deep = |levels: usize| vec!["d".repeat(200); levels].join("/");
    builds(project.path(), &["build", &format!("{longest}.ron"), "--out", &deep(15)]);
    assert!(tiny::is_whole(&at(&deep(15)).join(&longest), &longest));
    let said = fails(project.path(), &["build", &format!("{longer}.ron"), "--out", "long"]);
    assert!(said.contains("longer than 64"), "{said}");
    for out in [deep(21), "d".repeat(300)] {
        let said = fails(project.path(), &["build", "grown.ron", "--out", &out]);
        assert!(said.contains("too long for the file system"), "{said}");
    }
}

#[test]
fn a_file_that_is_no_plant_is_told_where_the_preset_names_it_by_checks_too() {
    let project = tiny::project();
    let at = |name: &str| project.path().join(name);
    let point = "Plant(chains: [(parent: None, location: 0.0, origin: (0.0, 0.0, 0.0), \
        points: [(0.0, 0.0, 0.0, 0.1), (0.0, 0.0, 0.0, 0.1)])], leaves: [])";
    fs::write(at("scans/point.plant"), point).unwrap();
    for (file, why) in [("art/leaf.png", "leaf.png: "), ("scans/point.plant", "no branch of the plant has any length")]
    {
        fs::write(at("wrong.ron"), tiny::scanned().replace("scans/tiny.swc", file)).unwrap();
        for arguments in [&["check", "wrong.ron"][..], &["build", "wrong.ron", "--out", "out"]] {
            let said = fails(project.path(), arguments);
            for part in ["wrong.ron:4:", "sources[\"a\"].file", why, "1 error in 1 file"] {
                assert!(said.contains(part), "{part} is not said: {said}");
            }
        }
    }
}

#[test]
fn leaves_and_bark_of_a_source_that_brings_none_are_refused_by_checks_too() {
    let project = tiny::project();
    for preset in [tiny::GROWN.to_owned(), tiny::scanned()] {
        for (old, field) in [("Files(color: \"art/leaf.png\")", "leaf"), ("Files(color: \"art/bark.png\")", "bark")] {
            fs::write(project.path().join("wrong.ron"), preset.replace(old, "From(\"a\")")).unwrap();
            for arguments in [&["check", "wrong.ron"][..], &["build", "wrong.ron", "--out", "out"]] {
                let said = fails(project.path(), arguments);
                for part in ["wrong.ron:", field, "of its own", "= help: name a source", "1 error in 1 file"] {
                    assert!(said.contains(part), "{part} is not said: {said}");
                }
            }
        }
    }
}

#[test]
fn the_gallery_holds_every_set_that_is_there_as_its_preset_tells_of_it() {
    let project = tiny::project();
    let at = |name: &str| project.path().join(name);
    let page = || fs::read_to_string(at("out/gallery.html")).unwrap();
    builds(project.path(), &["build", ".", "--out", "out"]);
    // Built by itself, then found current.
    fs::write(at("solo.ron"), tiny::GROWN).unwrap();
    builds(project.path(), &["build", "solo.ron", "--out", "out"]);
    builds(project.path(), &["build", ".", "--out", "out"]);
    assert!(page().contains("id=\"solo\"") && page().contains("id=\"grown\""));
    // A comment is no input of a set.
    fs::write(at("solo.ron"), format!("// A lone tree.\n{}", tiny::GROWN)).unwrap();
    builds(project.path(), &["build", ".", "--out", "out"]);
    assert!(page().contains("A lone tree."));
    let written = fs::metadata(at("out/gallery.html")).unwrap().modified().unwrap();
    builds(project.path(), &["build", ".", "--out", "out"]);
    assert_eq!(fs::metadata(at("out/gallery.html")).unwrap().modified().unwrap(), written, "nothing had changed");
    // What goes is gone, and a wrong preset beside it is no reason to tell of it.
    fs::remove_file(at("solo.ron")).unwrap();
    fs::remove_dir_all(at("out/solo")).unwrap();
    fs::write(at("wrong.ron"), "(").unwrap();
    fails(project.path(), &["build", ".", "-k", "--out", "out"]);
    assert!(!page().contains("solo") && page().contains("id=\"grown\""));
}

#[cfg(target_os = "linux")]
#[test]
fn pipes_and_devices_are_told_and_never_waited_for() {
    let project = tiny::project();
    let pipe = |name: &str| {
        fs::create_dir_all(project.path().join(name).parent().unwrap()).unwrap();
        assert!(Command::new("mkfifo").arg(project.path().join(name)).status().unwrap().success());
    };
    // Opening a pipe waits for a writer: only the time limit would end that.
    let told = |arguments: &[&str]| {
        let mut command = Command::new("timeout");
        let program = env!("CARGO_BIN_EXE_treewright");
        let output = command.arg("60").arg(program).args(arguments).current_dir(project.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", errors(&output));
        errors(&output)
    };
    pipe("pipe.ron");
    pipe("species/pipe.ron");
    fs::write(project.path().join("b.ron"), tiny::GROWN.replace("tiny.ron", "pipe.ron")).unwrap();
    pipe("out/grown/grown_001.glb");
    for arguments in
        [&["check", "pipe.ron"][..], &["check", "/dev/zero"], &["check", "b.ron"], &["inspect", "/dev/zero"]]
    {
        assert!(told(arguments).contains("it is not a file"), "{arguments:?}");
    }
    assert!(told(&["build", "grown.ron", "--out", "out"]).contains("a pipe or a device"));
    // In place of a manifest it is none, and the folder not ours.
    pipe("other/grown/grown.manifest.json");
    told(&["build", "grown.ron", "--out", "other"]);
    // A folder's presets are files; a species beside them that is none has no sheet.
    fs::remove_file(project.path().join("b.ron")).unwrap();
    builds(project.path(), &["build", ".", "--out", "sets"]);
    assert!(project.path().join("sets/gallery.species/tiny_contact.png").is_file());
    assert!(fs::read_to_string(project.path().join("sets/gallery.html")).unwrap().contains("id=\"species-tiny\""));
}

#[test]
fn outputs_hang_on_neither_threads_nor_locale_cache_or_order() {
    let project = tiny::project();
    fs::write(project.path().join("scan.ron"), tiny::scanned()).unwrap();
    let orders = [["grown.ron", "scan.ron"], ["scan.ron", "grown.ron"]];
    let mut seen = std::collections::BTreeMap::new();
    for (i, (threads, locale)) in [("1", "C"), ("2", "de_DE.UTF-8"), ("8", "tr_TR.UTF-8")].into_iter().enumerate() {
        for (k, order) in orders.into_iter().enumerate() {
            for cache in ["none", "cold", "warm"] {
                let out = format!("out{i}{k}{cache}");
                let kept = format!("kept{i}{k}");
                let mut arguments = vec!["build", order[0], order[1], "--out", &out, "--jobs", threads];
                if cache != "none" {
                    arguments.extend(["--cache", &kept]);
                }
                let output =
                    command(project.path(), &arguments).env("LC_ALL", locale).env("LANG", locale).output().unwrap();
                assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
                let sets = ["grown", "scan"].map(|set| tiny::files(&project.path().join(&out).join(set)));
                assert!(sets.iter().all(|files| files.len() > 5));
                seen.entry(sets).or_insert_with(Vec::new).push(out);
            }
        }
    }
    assert_eq!(seen.len(), 1, "{:?}", seen.values());
}
