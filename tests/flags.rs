//! What a build step asks of the command: comparing, dependency files, messages, caches and shards.

#![cfg(feature = "cli")]
#![expect(clippy::print_stderr, reason = "says what was skipped")]

mod tiny;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn run(project: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    command.current_dir(project).args(arguments).stdin(Stdio::null()).env_remove("TREEWRIGHT_CACHE").output().unwrap()
}

/// Runs and expects an exit code; what was said on standard output and standard error.
fn says(project: &Path, code: i32, arguments: &[&str]) -> (String, String) {
    let output = run(project, arguments);
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let (out, err) = (text(output.stdout), text(output.stderr));
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {out}{err}");
    assert!(!err.contains("panicked"), "{err}");
    (out, err)
}

/// Three variants of two sources.
const THREE: &str = r#"(
    seed: 1,
    sources: {
        "a": Grow(species: "species/tiny.ron", seed: 1),
        "b": Grow(species: "species/tiny.ron", seed: 2),
    },
    variants: [Source("a"), Source("b"), Blend(of: ["a", "b"], count: 1)],
    foliage: (leaf: Files(color: "art/leaf.png"), density: 0.1, most: 20),
    bark: (texture: Files(color: "art/bark.png")),
    lods: [Full, CrossedQuads],
    atlas: (size: 256),
    engines: [Generic, Godot(textures: Webp), Web(textures: Ktx2)],
)
"#;

fn three() -> tempfile::TempDir {
    let project = tiny::project();
    fs::write(project.path().join("three.ron"), THREE).unwrap();
    project
}

/// Every file of a folder and below with its bytes, but for what the output folder keeps for itself (lock and index).
fn tree(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().into_string().unwrap();
        if name.starts_with(".treewright-") {
            continue;
        }
        if entry.path().is_dir() {
            all.extend(tree(&entry.path()).into_iter().map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else {
            all.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    all
}

#[test]
fn check_tells_what_is_not_as_the_presets_make_it_and_writes_nothing() {
    let project = three();
    let at = |name: &str| project.path().join(name);
    let check = ["build", "three.ron", "grown.ron", "--out", "out", "--check"];
    let (_, said) = says(project.path(), 1, &check);
    assert!(said.contains("out/three: not built yet") && said.contains("2 sets are not"), "{said}");
    assert!(!at("out").exists(), "checking made a folder");
    says(project.path(), 0, &["build", "three.ron", "grown.ron", "--out", "out"]);
    let (_, said) = says(project.path(), 0, &check);
    assert_eq!(said.matches("nothing to do").count(), 2, "{said}");
    // A file that is read by one of them, a file that was changed, one that is gone.
    fs::write(at("three.ron"), THREE.replace("seed: 2", "seed: 3")).unwrap();
    fs::write(at("out/grown/grown_001.glb"), "mine").unwrap();
    fs::remove_file(at("out/grown/grown_contact.png")).unwrap();
    let before = tree(&at("out"));
    let (_, said) = says(project.path(), 1, &check);
    assert!(said.contains("out/three: the preset, or a file that it reads, has changed"), "{said}");
    assert!(said.contains("out/grown: changed or removed by somebody: grown_001.glb, grown_contact.png"), "{said}");
    let (_, said) = says(project.path(), 0, &["build", "three.ron", "grown.ron", "--out", "out", "--dry-run"]);
    assert!(said.contains("out/three: the preset") && said.contains("out/grown: changed"), "{said}");
    assert_eq!(tree(&at("out")), before);
    // What is asked for anyway, and what is known beside a wrong preset.
    says(project.path(), 0, &["build", "three.ron", "--out", "out"]);
    let (_, said) = says(project.path(), 0, &["build", "three.ron", "--out", "out", "--dry-run", "--force"]);
    assert!(said.contains("out/three: nothing has changed, and --force builds it"), "{said}");
    fs::write(at("wrong.ron"), "(").unwrap();
    let (_, said) = says(project.path(), 1, &["build", "wrong.ron", "three.ron", "--out", "out", "--check", "-k"]);
    assert!(said.contains("out/three: nothing to do") && said.contains("wrong.ron:1"), "{said}");
    let (_, said) = says(project.path(), 1, &["build", "wrong.ron", "three.ron", "--out", "out", "--check"]);
    assert!(!said.contains("out/three"), "{said}");
}

#[test]
fn a_wrong_preset_keeps_all_from_being_built_unless_the_build_keeps_going() {
    let project = three();
    fs::write(project.path().join("a_wrong.ron"), "(").unwrap();
    let (_, said) = says(project.path(), 1, &["build", ".", "--out", "out"]);
    assert!(said.contains("a_wrong.ron:1") && !project.path().join("out").exists(), "{said}");
    says(project.path(), 1, &["build", ".", "--keep-going", "--out", "out"]);
    assert!(["grown", "three"].iter().all(|set| tiny::is_whole(&project.path().join("out").join(set), set)));
    // What only growing can find stops the sets after it.
    let none = tiny::SPECIES.replace("bottom: 0.35, top: 0.9, radius: 0.36", "bottom: 0.98, top: 0.99, radius: 0.001");
    fs::write(project.path().join("species/none.ron"), none).unwrap();
    fs::write(project.path().join("a_wrong.ron"), tiny::GROWN.replace("tiny.ron", "none.ron")).unwrap();
    says(project.path(), 1, &["build", ".", "--out", "out2"]);
    assert!(!project.path().join("out2/grown").exists());
    says(project.path(), 1, &["build", ".", "-k", "--out", "out2"]);
    assert!(tiny::is_whole(&project.path().join("out2/grown"), "grown"));
}

#[test]
fn the_dependency_file_names_every_file_that_was_read() {
    let project = three();
    fs::write(project.path().join("scan.ron"), tiny::scanned()).unwrap();
    let arguments = ["build", "three.ron", "scan.ron", "--out", "out", "--depfile", "deps.d"];
    for _ in 0..2 {
        // The second build finds all current and tells the same.
        says(project.path(), 0, &arguments);
        let text = fs::read_to_string(project.path().join("deps.d")).unwrap();
        let rules: Vec<&str> = text.lines().filter(|line| !line.starts_with(' ')).collect();
        assert_eq!(rules, ["out/three/three.manifest.json: \\", "out/scan/scan.manifest.json: \\"]);
        let named = |file: &str| text.contains(&format!("\n  {file}"));
        assert!(
            ["three.ron", "scan.ron", "species/tiny.ron", "scans/tiny.swc", "art/leaf.png", "art/bark.png"]
                .into_iter()
                .all(named)
        );
        assert!(project.path().join(rules[0].strip_suffix(": \\").unwrap()).exists());
    }
}

#[test]
fn messages_are_one_object_a_line_and_described() {
    let project = three();
    let events = |code: i32, more: &[&str]| {
        let mut arguments = vec!["build", "--out", "out", "--message-format", "json"];
        arguments.extend(more);
        let (out, err) = says(project.path(), code, &arguments);
        assert_eq!(err, "");
        out.lines().map(|line| serde_json::from_str(line).unwrap()).collect::<Vec<serde_json::Value>>()
    };
    fs::write(project.path().join("wrong.ron"), THREE.replace("seed: 1,\n    s", "seed: -1,\n    s")).unwrap();
    let mut all = events(0, &["three.ron"]);
    let steps = all.iter().filter(|event| event["event"] == "step").count();
    assert_eq!(all[0], serde_json::json!({"event": "steps", "count": steps}));
    let set = &all[all.len() - 2];
    assert_eq!((&set["event"], &set["state"]), (&"set".into(), &"built".into()), "{set}");
    assert_eq!((&set["variants"], &set["folder"]), (&3.into(), &"out/three".into()));
    assert!(set["written"].as_array().unwrap().contains(&"three_003.glb".into()), "{set}");
    assert_eq!(all.last().unwrap(), &serde_json::json!({"event": "end", "sets": 1, "errors": 0}));
    let again = events(0, &["three.ron"]);
    assert_eq!(again[0]["state"], "current");
    all.extend(again);
    let wrong = events(1, &["wrong.ron", "three.ron"]);
    assert_eq!((&wrong[0]["event"], &wrong[0]["field"]), (&"error".into(), &"seed".into()));
    assert_eq!((&wrong[0]["file"], &wrong[0]["span"]["line"]), (&"wrong.ron".into(), &2.into()));
    all.extend(wrong);
    // A note is about a field, and tells where that stands.
    let noted = THREE
        .replace("    sources: {\n", "    sources: {\n        \"c\": Grow(species: \"species/tiny.ron\", seed: 3),\n");
    fs::write(project.path().join("noted.ron"), noted).unwrap();
    let noted = events(0, &["noted.ron"]);
    let note = noted.iter().find(|event| event["about"] == "sources[\"c\"]").unwrap();
    assert_eq!((&note["file"], &note["span"]["line"]), (&"noted.ron".into(), &4.into()), "{note}");
    let (_, said) = says(project.path(), 0, &["build", "--out", "out", "--force", "noted.ron"]);
    assert!(said.contains("\n  note: noted.ron:4:14: sources[\"c\"]: no variant is made of it"), "{said}");
    all.extend(noted);
    let kept_going = events(1, &["wrong.ron", "three.ron", "-k", "--depfile", "deps.d"]);
    assert_eq!(kept_going.last().unwrap(), &serde_json::json!({"event": "end", "sets": 1, "errors": 1}));
    assert!(fs::read_to_string(project.path().join("deps.d")).unwrap().starts_with("out/three/"));
    all.extend(kept_going);
    let status = events(1, &["three.ron", "grown.ron", "--check"]);
    assert_eq!((&status[0]["state"], &status[1]["state"]), (&"current".into(), &"new".into()));
    all.extend(status);
    // Every event and every field of it is described.
    let (described, _) = says(project.path(), 0, &["schema", "messages"]);
    for event in &all {
        let kind = event["event"].as_str().unwrap();
        let line = described.lines().find(|line| line.starts_with(&format!("| `{kind}` |")));
        let line = line.unwrap_or_else(|| panic!("{kind} is not described"));
        for field in event.as_object().unwrap().keys().filter(|field| *field != "event") {
            assert!(line.contains(&format!("`{field}`")), "{field} of {kind} is not described");
        }
    }
}

#[test]
fn a_cache_changes_no_byte_and_is_told_cleared_and_mended() {
    let project = three();
    let at = |name: &str| project.path().join(name);
    let build = |out: &str| says(project.path(), 0, &["build", "three.ron", "--out", out, "--cache", "kept"]).1;
    says(project.path(), 0, &["build", "three.ron", "--out", "plain"]);
    build("cold");
    let kept = tree(&at("kept"));
    build("warm");
    assert_eq!(tree(&at("kept")), kept, "a warm build wrote entries");
    assert!(tree(&at("plain")) == tree(&at("cold")) && tree(&at("cold")) == tree(&at("warm")));
    for stage in ["grow/", "pictures/", "dress/", "ladder/", "png/"] {
        assert!(kept.keys().any(|name| name.starts_with(stage)), "{stage} is not kept");
    }
    // Another leaf density grows nothing again.
    fs::write(at("three.ron"), THREE.replace("density: 0.1", "density: 0.2")).unwrap();
    build("warm");
    let count = |stage: &str| tree(&at("kept")).keys().filter(|name| name.starts_with(stage)).count();
    assert_eq!((count("grow/"), count("pictures/")), (2, 1));
    assert!(count("dress/") > 3);
    fs::write(at("three.ron"), THREE).unwrap();
    // Every entry damaged in some way.
    for (i, name) in kept.keys().enumerate() {
        let mut bytes = kept[name].clone();
        let middle = bytes.len() / 2;
        if i % 2 == 0 {
            bytes.truncate(middle)
        } else {
            bytes[middle] ^= 64
        }
        fs::write(at("kept").join(name), bytes).unwrap();
    }
    let said = build("mended");
    assert!(said.contains("was damaged; it is made again"), "{said}");
    assert!(tree(&at("mended")) == tree(&at("plain")));
    assert!(kept.iter().all(|(name, bytes)| fs::read(at("kept").join(name)).unwrap() == *bytes));
    assert!(!build("again").contains("damaged"));
    let (told, _) = says(project.path(), 0, &["cache", "stats", "--cache", "kept"]);
    assert!(told.contains("ladder") && told.contains("of at most 4096 MiB"), "{told}");
    let (json, _) = says(project.path(), 0, &["cache", "stats", "--cache", "kept", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["entries"], tree(&at("kept")).len());
    fs::write(at("kept/mine.txt"), "mine").unwrap();
    says(project.path(), 0, &["cache", "clear", "--cache", "kept"]);
    assert_eq!(tree(&at("kept")).into_keys().collect::<Vec<_>>(), ["mine.txt"]);
    let (_, said) = says(project.path(), 2, &["cache", "stats"]);
    assert!(said.contains("--cache") && said.contains("TREEWRIGHT_CACHE"), "{said}");
}

#[test]
fn shards_that_share_a_cache_end_in_the_bytes_of_a_single_build() {
    let project = three();
    says(project.path(), 0, &["build", "three.ron", "--out", "plain"]);
    let shards: Vec<_> = (1..=4)
        .map(|i| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
            command.current_dir(project.path()).stderr(Stdio::piped());
            command.args(["build", "three.ron", "--out", "out", "--cache", "kept", "--shard", &format!("{i}/4")]);
            command.spawn().unwrap()
        })
        .collect();
    let made: Vec<String> = shards
        .into_iter()
        .map(|child| {
            let output = child.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(0));
            String::from_utf8(output.stderr).unwrap()
        })
        .collect();
    for (i, said) in made.iter().enumerate() {
        let trees = if i < 3 { "1 tree" } else { "0 trees" };
        assert!(said.contains(&format!("{trees} made for the cache")), "{said}");
    }
    assert!(!project.path().join("out").exists(), "a shard wrote outputs");
    let ladders = tree(&project.path().join("kept")).keys().filter(|name| name.starts_with("ladder/")).count();
    assert_eq!(ladders, 3);
    says(project.path(), 0, &["build", "three.ron", "--out", "out", "--cache", "kept"]);
    assert!(tree(&project.path().join("out")) == tree(&project.path().join("plain")));
    let left = tree(&project.path().join("kept")).keys().filter(|name| name.starts_with("ladder/")).count();
    assert_eq!(left, 3, "the build made a tree again");
    let (_, said) = says(project.path(), 2, &["build", "three.ron", "--out", "out", "--shard", "1/4"]);
    assert!(said.contains("--cache"), "{said}");
    says(project.path(), 2, &["build", "three.ron", "--out", "out", "--shard", "5/4"]);
}

#[test]
fn planned_commands_end_in_the_bytes_of_a_single_build() {
    let project = three();
    says(project.path(), 0, &["build", "three.ron", "--out", "plain"]);
    let plan = ["plan", "three.ron", "--out", "out", "--parts", "parts"];
    let (json, _) = says(project.path(), 0, &[&plan[..], &["--format", "json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let commands = json["commands"].as_array().unwrap();
    let kinds: Vec<&str> = commands.iter().map(|command| command["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["sources", "tree", "tree", "tree", "atlas", "set"]);
    let texts = |command: &serde_json::Value, field: &str| {
        command[field].as_array().unwrap().iter().map(|text| text.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    for command in commands {
        // Each runs where there is nothing but its inputs, as on another machine.
        let elsewhere = tempfile::tempdir().unwrap();
        for input in texts(command, "inputs") {
            let to = elsewhere.path().join(&input);
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::copy(project.path().join(&input), to).unwrap();
        }
        let mut arguments = texts(command, "arguments");
        if command["kind"] == "atlas" {
            // As a list, as Ninja hands it over.
            let given: Vec<String> = arguments.extract_if(.., |argument| argument.ends_with(".part")).collect();
            arguments.retain(|argument| argument != "--given" && argument != "--part");
            let (made, given) = given.split_last().unwrap();
            fs::write(elsewhere.path().join("list"), given.join("\n")).unwrap();
            arguments.extend(["--given", "@list", "--part", made.as_str()].map(str::to_owned));
        }
        says(elsewhere.path(), 0, &arguments.iter().map(String::as_str).collect::<Vec<_>>());
        for output in texts(command, "outputs") {
            assert!(elsewhere.path().join(&output).is_file(), "{output} was not made");
        }
        for (file, bytes) in tree(elsewhere.path()) {
            let to = project.path().join(&file);
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::write(to, bytes).unwrap();
        }
    }
    let made = tree(&project.path().join("out/three"));
    assert!(made.contains_key("three_leaf_color.ktx2") && made.contains_key("three_leaf_color.webp"));
    assert!(made == tree(&project.path().join("plain/three")));
    // A tree is not made again by a later step.
    let size = |part: &str| fs::metadata(project.path().join("parts").join(part)).unwrap().len();
    assert!(size("three_001.part") > 10_000 && size("three_001.part") < size("three_atlas.part"));
    let step = |more: &[&'static str]| [&["step", "tree", "three.ron", "--part", "x.part"], more].concat();
    let (_, said) = says(project.path(), 1, &step(&["--place", "4"]));
    assert!(said.contains("only 3 trees"), "{said}");
    fs::write(project.path().join("parts/three_001.part"), "cut").unwrap();
    let (_, said) = says(project.path(), 1, &step(&["--place", "1", "--given", "parts/three_001.part"]));
    assert!(said.contains("three_001.part") && said.contains("no part"), "{said}");
    says(project.path(), 2, &["step", "tree", "three.ron", "--part", "x.part"]);
    says(project.path(), 2, &["step", "sources", "three.ron", "--place", "1", "--part", "x.part"]);
    says(project.path(), 2, &["step", "sources", "three.ron", "--out", "out"]);
}

/// Who reads them would take half of the messages for all.
#[cfg(target_os = "linux")]
#[test]
fn messages_that_can_not_be_written_are_an_error() {
    let project = three();
    let mut command = Command::new(env!("CARGO_BIN_EXE_treewright"));
    command.current_dir(project.path()).args(["build", "grown.ron", "--out", "out", "--message-format", "json"]);
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let output = command.stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("can't write the result"));
    assert!(tiny::is_whole(&project.path().join("out/grown"), "grown"));
}

#[test]
fn every_file_that_a_plan_names_is_written_whatever_engines_ask_for() {
    let project = three();
    let engines = ["Generic", "Godot", "Unity", "Unreal", "Bevy", "Web"];
    for (i, engine) in engines.iter().enumerate() {
        let set = format!("for_{i}");
        let text =
            tiny::GROWN.replace("atlas: (size: 256),", &format!("atlas: (size: 256),\n    engines: [{engine}],"));
        fs::write(project.path().join(format!("{set}.ron")), text).unwrap();
        let preset = format!("{set}.ron");
        let plan = ["plan", preset.as_str(), "--out", "out", "--parts", "parts", "--format", "json"];
        let json: serde_json::Value = serde_json::from_str(&says(project.path(), 0, &plan).0).unwrap();
        let outputs = json["commands"].as_array().unwrap().last().unwrap()["outputs"].as_array().unwrap();
        assert_eq!(outputs.len(), 2, "{outputs:?}");
        says(project.path(), 0, &["build", preset.as_str(), "--out", "out"]);
        for output in outputs {
            assert!(project.path().join(output.as_str().unwrap()).is_file(), "{engine}: {output} is not there");
        }
    }
}

/// Ninja is what many engines' builds run by; `.ci/run` installs it where it can.
#[test]
fn ninja_builds_a_plan_and_only_what_an_edit_touches() {
    let project = three();
    let program = env!("CARGO_BIN_EXE_treewright");
    let (text, _) =
        says(project.path(), 0, &["plan", "three.ron", "--out", "out", "--parts", "parts", "--program", program]);
    fs::write(project.path().join("build.ninja"), text).unwrap();
    let ninja = || {
        let output = Command::new("ninja").current_dir(project.path()).output();
        match output {
            Ok(output) => {
                let said = String::from_utf8_lossy(&output.stdout).into_owned();
                assert!(output.status.success(), "{said}");
                Some(said)
            }
            Err(_) => None,
        }
    };
    let Some(first) = ninja() else {
        eprintln!("skipped: there is no ninja");
        return;
    };
    assert!(first.contains("[6/6]"), "{first}");
    says(project.path(), 0, &["build", "three.ron", "--out", "plain"]);
    assert!(tree(&project.path().join("out/three")) == tree(&project.path().join("plain/three")));
    assert!(ninja().unwrap().contains("no work to do"));
    // A comment changes no part, so nothing after the parts is run.
    fs::write(project.path().join("three.ron"), THREE.replace("seed: 1,", "seed: 1, // first")).unwrap();
    let again = ninja().unwrap();
    assert!(again.contains("step sources") || again.contains("sources parts"), "{again}");
    assert!(ninja().unwrap().contains("no work to do"));
}

#[test]
fn options_that_name_files_to_write_lose_nobody_a_preset_or_an_asset() {
    let project = three();
    says(project.path(), 0, &["build", "three.ron", "--out", "out"]);
    let before = tree(project.path());
    for (arguments, name) in [
        (&["build", "three.ron", "--out", "out", "--depfile"][..], "three.ron"),
        (&["build", "three.ron", "--out", "out", "--depfile"], "out/three/three_001.glb"),
        (&["step", "sources", "three.ron", "--part"], "species/tiny.ron"),
        (&["inspect", "scans/tiny.swc", "--dump"], "three.ron"),
        (&["inspect", "scans/tiny.swc", "--morph-to", "species/tiny.ron", "--plot"], "art/leaf.png"),
        (&["distance", "scans/tiny.swc", "species/tiny.ron", "--dendrogram"], "three.ron"),
    ] {
        let (_, said) = says(project.path(), 1, &[arguments, &[name]].concat());
        assert!(said.contains(name) && said.contains("give another name"), "{said}");
    }
    assert!(tree(project.path()) == before);
    // Their own are replaced.
    for _ in 0..2 {
        says(project.path(), 0, &["build", "three.ron", "--out", "out", "--depfile", "deps.d"]);
        says(project.path(), 0, &["step", "sources", "three.ron", "--part", "sources.part"]);
        says(project.path(), 0, &["inspect", "scans/tiny.swc", "--dump", "dump.ron"]);
    }
}

#[test]
fn a_manifest_that_a_merge_broke_is_told_and_written_anew() {
    let project = three();
    says(project.path(), 0, &["build", "three.ron", "--out", "out"]);
    let before = tree(&project.path().join("out"));
    let manifest = project.path().join("out/three/three.manifest.json");
    let whole = fs::read_to_string(&manifest).unwrap();
    for broken in [String::new(), whole[..200].to_owned(), format!("<<<<<<< HEAD\n{whole}")] {
        fs::write(&manifest, broken).unwrap();
        let (_, checked) = says(project.path(), 1, &["build", "three.ron", "--out", "out", "--check"]);
        assert!(checked.contains("three.manifest.json"), "{checked}");
        let (_, said) = says(project.path(), 0, &["build", "three.ron", "--out", "out"]);
        assert!(said.contains("1 file written"), "{said}");
        assert!(tree(&project.path().join("out")) == before);
    }
    // Somebody else's of that name stays.
    fs::write(&manifest, "{\"generator\": \"another\"}").unwrap();
    let (_, said) = says(project.path(), 1, &["build", "three.ron", "--out", "out"]);
    assert!(said.contains("Treewright did not write it"), "{said}");
}

#[test]
fn limits_hold_for_sets_that_are_current_too() {
    let project = three();
    says(project.path(), 0, &["build", "three.ron", "--out", "out"]);
    for limit in [["--root", "species"], ["--max-file", "10"]] {
        let (_, said) = says(project.path(), 1, &[&["build", "three.ron", "--out", "out"], &limit[..]].concat());
        assert!(said.contains("three.ron"), "{said}");
    }
    let (_, said) = says(project.path(), 0, &["build", "three.ron", "--out", "out", "--root", "."]);
    assert!(said.contains("nothing had changed"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn threads_that_the_system_does_not_give_are_told() {
    let project = three();
    let run = |threads: &str, arguments: &[&str]| {
        let mut command = Command::new("sh");
        command
            .args(["-c", "ulimit -v 1500000 && exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_treewright")])
            .args(arguments);
        let output = command.current_dir(project.path()).env("RAYON_NUM_THREADS", threads).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, said) = run("", &["build", "three.ron", "--out", "out", "--jobs", "1024"]);
    assert!(code == Some(1) && said.contains("fewer --jobs"), "{said}");
    for command in [&["build", "three.ron", "--out", "out"][..], &["distance", "scans/tiny.swc", "scans/tiny.swc"]] {
        let (code, said) = run("5000", command);
        assert!(code == Some(1) && said.contains("RAYON_NUM_THREADS"), "{said}");
    }
    assert_eq!(run("1", &["build", "three.ron", "--out", "out"]).0, Some(0));
}

#[test]
fn whatever_reads_has_the_limits_of_a_build() {
    let project = three();
    for limit in [["--root", "species"], ["--max-file", "10"]] {
        for command in [
            &["check", "three.ron"][..],
            &["plan", "three.ron", "--out", "out", "--parts", "parts"],
            &["step", "sources", "three.ron", "--part", "x.part"],
            &["step", "set", "three.ron", "--out", "out"],
            &["inspect", "scans/tiny.swc"],
            &["estimate", "scans/tiny.swc"],
            &["distance", "scans/tiny.swc", "scans/tiny.swc"],
        ] {
            let (_, said) = says(project.path(), 1, &[command, &limit[..]].concat());
            assert!(said.contains(limit[0]), "{command:?}: {said}");
        }
    }
    assert!(!project.path().join("out/three").exists());
    // The commands of a plan have the limits that it was made with.
    let plan = ["plan", "three.ron", "--out", "out", "--parts", "parts", "--max-file", "2G", "--root", "."];
    let (text, _) = says(project.path(), 0, &plan);
    let commands: Vec<&str> = text.lines().filter(|line| line.starts_with("  arguments")).collect();
    assert!(
        commands.len() == 6 && commands.iter().all(|line| line.contains("--max-file 2147483648 --root .")),
        "{text}"
    );
}
