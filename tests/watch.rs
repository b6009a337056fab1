//! A watched folder: whatever a preset reads, saving it builds the sets that read it, and only those.

#![cfg(feature = "cli")]

mod tiny;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use treewright::build::{Happened, Progress};
use treewright::watch::{Event, Next, WatchOptions, Watcher};

/// How long anything may take. A bound, no measure: the tests end as soon as what they wait for is there.
const PATIENCE: Duration = Duration::from_secs(30);

#[derive(Debug, PartialEq)]
enum Said {
    Built(String),
    Current(String),
    Failed(String),
    Orphaned(String),
    Idle,
}

struct Watched {
    project: tempfile::TempDir,
    out: PathBuf,
    said: Receiver<Said>,
}

impl Watched {
    /// Watches the tiny project, also with `more` presets, sets going to `out` in it, and waits for the first build.
    fn start(out: &str, more: &[(&str, &str)]) -> (Self, Vec<Said>) {
        Self::start_by(None, out, more)
    }

    /// The same, looking at the files every so often where `poll` is given.
    fn start_by(poll: Option<Duration>, out: &str, more: &[(&str, &str)]) -> (Self, Vec<Said>) {
        let project = tiny::project();
        for (name, text) in more {
            fs::write(project.path().join(name), text).unwrap();
        }
        let (say, said) = channel();
        let (folder, out) = (project.path().to_path_buf(), project.path().join(out));
        let mut watcher = Watcher::new(WatchOptions { poll, ..WatchOptions::new(&folder, &out) });
        // The thread waits for events when the test ends, and ends with the process.
        std::thread::spawn(move || {
            watcher.run(&|event| {
                let message = match event {
                    Event::Build(Progress::Set { outcome, .. }) if outcome.happened == Happened::Current => {
                        Said::Current(outcome.set.clone())
                    }
                    Event::Build(Progress::Set { outcome, .. }) => Said::Built(outcome.set.clone()),
                    Event::Preset(_) | Event::Build(_) | Event::Polling { .. } => return Next::Watch,
                    Event::Orphaned(status) => Said::Orphaned(status.set.clone()),
                    Event::Unwritten(found) => panic!("{found}"),
                    Event::Failed(error) => Said::Failed(error.to_string()),
                    Event::Idle { .. } => Said::Idle,
                };
                if say.send(message).is_ok() { Next::Watch } else { Next::Stop }
            });
        });
        let watched = Self { project, out, said };
        let first = watched.until_idle();
        (watched, first)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.project.path().join(name)
    }

    fn until_idle(&self) -> Vec<Said> {
        let mut all = Vec::new();
        loop {
            match self.said.recv_timeout(PATIENCE) {
                Ok(Said::Idle) => return all,
                Ok(said) => all.push(said),
                Err(error) => panic!("the watcher never came to rest ({error}); it said {all:?}"),
            }
        }
    }

    /// All that is said until `wanted` was said and the watcher rests.
    fn until(&self, wanted: impl Fn(&Said) -> bool) -> Vec<Said> {
        let start = Instant::now();
        let mut all = Vec::new();
        while start.elapsed() < PATIENCE {
            all.extend(self.until_idle());
            if all.iter().any(&wanted) {
                return all;
            }
        }
        panic!("not said: {all:?}");
    }

    fn until_built(&self, set: &str) -> Vec<Said> {
        self.until(|said| *said == Said::Built(set.to_owned()))
    }

    fn until_failed(&self, part: &str) -> Vec<Said> {
        self.until(|said| matches!(said, Said::Failed(text) if text.contains(part)))
    }

    fn is_whole(&self, set: &str) -> bool {
        tiny::is_whole(&self.out.join(set), set)
    }
}

/// Saves as careful editors do: a new file beside it, renamed over it.
fn save_by_rename(path: &Path, text: &str) {
    let beside = path.with_extension("tmp~");
    fs::write(&beside, text).unwrap();
    fs::rename(beside, path).unwrap();
}

#[test]
fn a_drawing_over_a_drawing_builds_the_set_that_follows_it() {
    let svg = |top: u32| {
        let path = format!("M1 9L9 9L5 {top}Z");
        format!("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 10 10'><path d='{path}'/></svg>")
    };
    let sketch =
        "Sketch(of: \"a\", crown: \"one.svg\", then: [(crown: \"one.svg\"), (crown: \"two.svg\", view: 90.0)])";
    let drawn = tiny::GROWN.replace("Source(\"a\")", sketch);
    let (one, two) = (svg(1), svg(3));
    let (watched, first) = Watched::start("out", &[("drawn.ron", &drawn), ("one.svg", &one), ("two.svg", &two)]);
    assert!(first.contains(&Said::Built("drawn".into())), "{first:?}");
    for (file, top) in [("two.svg", 2), ("one.svg", 0), ("two.svg", 5)] {
        fs::write(watched.path(file), svg(top)).unwrap();
        let said = watched.until_built("drawn");
        assert!(!said.contains(&Said::Built("grown".into())) && watched.is_whole("drawn"), "{file}: {said:?}");
    }
    fs::remove_file(watched.path("two.svg")).unwrap();
    watched.until_failed("variants[0].then[1].crown");
}

#[test]
fn whatever_is_saved_builds_the_sets_that_read_it() {
    let scanned = tiny::scanned();
    let (watched, first) = Watched::start("out", &[("scanned.ron", &scanned)]);
    assert_eq!(first, [Said::Built("grown".into()), Said::Built("scanned".into())]);
    let built = |set: &str, other: &str| {
        let said = watched.until_built(set);
        assert!(!said.contains(&Said::Built(other.to_owned())), "{other} was built too: {said:?}");
        assert!(watched.is_whole(set) && watched.is_whole(other));
    };

    fs::write(watched.path("grown.ron"), tiny::GROWN.replace("seed: 1,\n    sources", "seed: 2,\n    sources"))
        .unwrap();
    built("grown", "scanned");
    fs::write(watched.path("species/tiny.ron"), tiny::SPECIES.replace("height: 3.0", "height: 4.0")).unwrap();
    built("grown", "scanned");
    fs::write(watched.path("scans/tiny.swc"), tiny::SCAN.replace("0.10 -1", "0.12 -1")).unwrap();
    built("scanned", "grown");
    save_by_rename(&watched.path("scanned.ron"), &scanned.replace("density: 0.1", "density: 0.2"));
    built("scanned", "grown");
    save_by_rename(&watched.path("species/tiny.ron"), tiny::SPECIES);
    built("grown", "scanned");
    // Again, since a rename puts another file where the first one was.
    save_by_rename(&watched.path("species/tiny.ron"), &tiny::SPECIES.replace("count: 6", "count: 5"));
    built("grown", "scanned");

    // Both read the leaf.
    tiny::picture(&watched.path("art/leaf.png"), 200);
    let mut said = watched.until_built("grown");
    if !said.contains(&Said::Built("scanned".into())) {
        said.extend(watched.until_built("scanned"));
    }
    assert!(watched.is_whole("grown") && watched.is_whole("scanned"));
}

#[test]
fn a_broken_file_is_told_and_leaves_the_old_set_until_it_is_mended() {
    let (watched, _) = Watched::start("out", &[]);
    let preset = watched.path("grown.ron");
    let before = tiny::files(&watched.out.join("grown"));
    fs::write(&preset, tiny::GROWN.replace("density", "densty")).unwrap();
    watched.until_failed("grown.ron:7:");
    assert!(tiny::files(&watched.out.join("grown")) == before);

    // Mended with a scan that is not there yet, in a folder that is not there yet.
    let scanned = tiny::scanned().replace("scans/", "later/scans/");
    fs::write(&preset, &scanned).unwrap();
    watched.until_failed("later/scans/tiny.swc");
    assert!(tiny::files(&watched.out.join("grown")) == before);
    fs::create_dir_all(watched.path("later/scans")).unwrap();
    fs::write(watched.path("later/scans/tiny.swc"), "1 1 0 0 0 0.1 -1\n2 x").unwrap();
    watched.until_failed("tiny.swc:2:");
    fs::write(watched.path("later/scans/tiny.swc"), tiny::SCAN).unwrap();
    watched.until_built("grown");
    assert!(watched.is_whole("grown"));

    // A folder that goes and comes back, as version control does it.
    fs::rename(watched.path("later"), watched.path("away")).unwrap();
    watched.until_failed("later/scans/tiny.swc");
    fs::rename(watched.path("away"), watched.path("later")).unwrap();
    watched.until(|said| *said == Said::Current("grown".into()));
    fs::write(watched.path("later/scans/tiny.swc"), tiny::SCAN.replace("0.10 -1", "0.13 -1")).unwrap();
    watched.until_built("grown");
}

#[test]
fn presets_come_and_go() {
    let (watched, _) = Watched::start("out", &[]);
    fs::write(watched.path("second.ron"), tiny::scanned()).unwrap();
    watched.until_built("second");
    fs::remove_file(watched.path("second.ron")).unwrap();
    assert_eq!(watched.until_idle().iter().filter(|said| matches!(said, Said::Failed(_))).count(), 0);
    assert!(watched.is_whole("second"), "a deleted preset took its set along");
    fs::remove_file(watched.path("grown.ron")).unwrap();
    watched.until_failed("no preset");
    fs::write(watched.path("third.ron"), tiny::GROWN).unwrap();
    watched.until_built("third");
}

#[test]
fn the_page_of_all_sets_follows_and_sets_without_a_preset_are_told_once() {
    let (watched, _) = Watched::start("out", &[("second.ron", &tiny::scanned())]);
    let page = || fs::read_to_string(watched.out.join("gallery.html")).unwrap();
    assert!(["id=\"grown\"", "id=\"second\"", "tiny_contact.png"].iter().all(|part| page().contains(part)));
    fs::write(watched.path("grown.ron"), format!("// A lone tree.\n{}", tiny::GROWN)).unwrap();
    watched.until(|said| *said == Said::Current("grown".into()));
    assert!(page().contains("A lone tree."));
    fs::remove_file(watched.path("second.ron")).unwrap();
    watched.until(|said| *said == Said::Orphaned("second".into()));
    fs::remove_dir_all(watched.out.join("second")).unwrap();
    fs::write(watched.path("grown.ron"), tiny::GROWN.replace("density: 0.1", "density: 0.2")).unwrap();
    let said = watched.until_built("grown");
    assert!(!said.contains(&Said::Orphaned("second".into())) && !page().contains("second"), "{said:?}");
}

#[test]
fn sets_inside_the_watched_folder_wake_nobody() {
    // Sets lie right beside the presets, and beside the files that they read.
    let (watched, first) = Watched::start(".", &[]);
    assert_eq!(first, [Said::Built("grown".into())]);
    fs::write(watched.path("grown.ron"), tiny::GROWN.replace("density: 0.1", "density: 0.2")).unwrap();
    watched.until_built("grown");
    // A write may be seen half done and then whole; after that it is quiet.
    while watched.said.recv_timeout(Duration::from_secs(1)).is_ok() {}
    for name in ["grown/notes.txt", "grown/grown_001.glb.tmp", "art/unused.png", "notes.txt"] {
        fs::write(watched.path(name), "mine").unwrap();
    }
    assert!(watched.said.recv_timeout(Duration::from_millis(800)).is_err(), "a set's own folder woke the watcher");
}

#[test]
fn files_are_looked_at_where_that_is_asked_for() {
    let every = Some(Duration::from_millis(20));
    let (watched, first) = Watched::start_by(every, "out", &[("scanned.ron", &tiny::scanned())]);
    assert_eq!(first, [Said::Built("grown".into()), Said::Built("scanned".into())]);
    assert!(watched.said.recv_timeout(Duration::from_millis(300)).is_err(), "looking alone built something");
    save_by_rename(&watched.path("species/tiny.ron"), &tiny::SPECIES.replace("height: 3.0", "height: 4.0"));
    let said = watched.until_built("grown");
    assert!(!said.contains(&Said::Built("scanned".into())), "{said:?}");
    // A missing file, a new preset, one that goes, a folder that goes and comes back.
    fs::remove_file(watched.path("scans/tiny.swc")).unwrap();
    watched.until_failed("scans/tiny.swc");
    fs::write(watched.path("scans/tiny.swc"), tiny::SCAN.replace("0.10 -1", "0.12 -1")).unwrap();
    watched.until_built("scanned");
    fs::write(watched.path("second.ron"), tiny::scanned()).unwrap();
    watched.until_built("second");
    fs::remove_file(watched.path("second.ron")).unwrap();
    watched.until_idle();
    fs::rename(watched.path("art"), watched.path("away")).unwrap();
    watched.until_failed("art/leaf.png");
    fs::rename(watched.path("away"), watched.path("art")).unwrap();
    watched.until(|said| *said == Said::Current("grown".into()));
    assert!(["grown", "scanned"].into_iter().all(|set| watched.is_whole(set)));
}

#[test]
fn edits_during_builds_and_bursts_end_in_the_last_one() {
    let (watched, _) = Watched::start("out", &[]);
    let preset = |seed: usize| tiny::GROWN.replace("seed: 1,\n    sources", &format!("seed: {seed},\n    sources"));
    let seed = || {
        let text = fs::read_to_string(watched.out.join("grown/grown.manifest.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap()["seed"].as_u64().unwrap()
    };
    let ends_in = |last: u64| {
        let start = Instant::now();
        while seed() != last {
            assert!(start.elapsed() < PATIENCE, "it ended in {} instead of {last}", seed());
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    // A burst: far less builds than edits.
    for i in 2..42 {
        fs::write(watched.path("grown.ron"), preset(i)).unwrap();
    }
    ends_in(41);
    let built = watched.until_built("grown").len();
    assert!(built < 20, "{built} builds of one burst");
    // Edits at every moment of a build.
    for i in 0..20 {
        fs::write(watched.path("grown.ron"), preset(100 + i)).unwrap();
        std::thread::sleep(Duration::from_millis(13 * i as u64));
    }
    ends_in(119);
    assert!(watched.is_whole("grown"));
}

#[test]
fn a_watched_folder_that_goes_and_comes_back_is_watched_again() {
    let (watched, _) = Watched::start("out", &[]);
    let (here, away) = (watched.path(""), watched.path("").with_extension("away"));
    let here = here.canonicalize().unwrap();
    fs::rename(&here, &away).unwrap();
    watched.until(|said| matches!(said, Said::Failed(_)));
    fs::rename(&away, &here).unwrap();
    watched.until(|said| *said == Said::Current("grown".into()));
    fs::write(watched.path("grown.ron"), tiny::GROWN.replace("density: 0.1", "density: 0.2")).unwrap();
    watched.until_built("grown");
}

/// What a link leads to changes without any of the files that were read.
#[cfg(unix)]
#[test]
fn a_link_that_is_put_in_the_place_of_another_is_seen() {
    use std::os::unix::fs::symlink;
    for poll in [None, Some(Duration::from_millis(20))] {
        let linked = tiny::GROWN.replace("species/tiny.ron", "now/tiny.ron");
        let (watched, _) = Watched::start_by(poll, "out", &[("linked.ron", &linked)]);
        for (version, height) in [("v1", "4.0"), ("v2", "5.0")] {
            fs::create_dir(watched.path(version)).unwrap();
            let species = tiny::SPECIES.replace("height: 3.0", &format!("height: {height}"));
            fs::write(watched.path(&format!("{version}/tiny.ron")), species).unwrap();
        }
        symlink("v1", watched.path("now")).unwrap();
        watched.until_built("linked");
        let first = tiny::files(&watched.out.join("linked"));
        symlink("v2", watched.path("new")).unwrap();
        fs::rename(watched.path("new"), watched.path("now")).unwrap();
        watched.until_built("linked");
        assert!(watched.is_whole("linked") && tiny::files(&watched.out.join("linked")) != first);
        // Where it leads now is watched, too.
        fs::write(watched.path("v2/tiny.ron"), tiny::SPECIES.replace("height: 3.0", "height: 6.0")).unwrap();
        watched.until_built("linked");
    }
}

/// Each build would change what the other reads.
#[test]
fn presets_that_are_made_from_their_own_sets_end_in_an_error_and_not_in_endless_builds() {
    let (watched, _) = Watched::start("out", &[("other.ron", tiny::GROWN)]);
    let from = |file: &str| {
        tiny::GROWN.replace(r#"Grow(species: "species/tiny.ron", seed: 1)"#, &format!("Import(file: \"{file}\")"))
    };
    let preset = watched.path("grown.ron");
    fs::write(&preset, from("out/grown/grown_001.glb")).unwrap();
    watched.until_failed("grown.ron:4:27: sources[\"a\"].file: ");
    // Another set's tree is a source like any other, until that set is made from this one.
    fs::write(&preset, from("out/other/other_001.glb")).unwrap();
    watched.until_built("grown");
    fs::write(watched.path("other.ron"), from("out/grown/grown_001.glb")).unwrap();
    watched.until_failed("other.ron:4:27: sources[\"a\"].file: ");
    assert!(watched.said.recv_timeout(Duration::from_millis(500)).is_err(), "it goes on for ever");
    fs::write(watched.path("other.ron"), tiny::GROWN.replace("seed: 1,\n    sources", "seed: 2,\n    sources"))
        .unwrap();
    watched.until_built("other");
}

/// Linux lets a user namespace have a limit of its own, so that this test need not touch the machine's.
#[cfg(target_os = "linux")]
#[test]
#[expect(clippy::print_stderr, reason = "says what was skipped")]
fn when_the_system_watches_no_more_folders_the_files_are_looked_at_and_that_is_said() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    let project = tiny::project();
    let limited = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "sh", "-c", script]).current_dir(project.path());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let limit = "echo 1 > /proc/sys/user/max_inotify_watches";
    if !limited(limit).status().is_ok_and(|status| status.success()) {
        return eprintln!("skipped: no user namespace with a limit of its own can be had here");
    }
    let program = env!("CARGO_BIN_EXE_treewright");
    let mut child = limited(&format!("{limit} && exec {program} watch . --out out")).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    let mut until = |part: &str| {
        let mut said = Vec::new();
        let found = lines.by_ref().find(|line| {
            said.push(line.clone());
            line.contains(part)
        });
        assert!(found.is_some(), "{part} is not said: {said:?}");
    };
    until("looked at every");
    until("watching");
    for (path, text) in [
        ("species/tiny.ron", tiny::SPECIES.replace("height: 3.0", "height: 4.0")),
        ("grown.ron", tiny::GROWN.replace("density: 0.1", "density: 0.2")),
    ] {
        fs::write(project.path().join(path), text).unwrap();
        until(" written, ");
        until("watching");
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn what_is_saved_meanwhile_is_built_before_what_waits() {
    let project = tiny::project();
    let preset = |name: &str| project.path().join(name);
    for name in ["a.ron", "b.ron", "c.ron"] {
        fs::write(preset(name), tiny::GROWN).unwrap();
    }
    let order = std::sync::Mutex::new(Vec::new());
    let mut watcher = Watcher::new(WatchOptions::new(project.path(), project.path().join("out")));
    watcher.run(&|event| {
        match event {
            Event::Preset(path) => {
                let mut order = order.lock().unwrap();
                order.push(path.file_stem().unwrap().to_string_lossy().into_owned());
                if order.len() == 1 {
                    fs::write(preset("c.ron"), tiny::GROWN.replace("seed: 1,\n    sources", "seed: 2,\n    sources"))
                        .unwrap();
                }
            }
            Event::Failed(error) => panic!("{error}"),
            Event::Idle { .. } => return Next::Stop,
            _ => {}
        }
        Next::Watch
    });
    assert_eq!(*order.lock().unwrap(), ["a", "c", "b", "grown"]);
}

#[test]
fn sets_of_one_name_are_an_error_as_in_a_build() {
    let (watched, first) = Watched::start("out", &[("GROWN.ron", tiny::GROWN)]);
    let failed = |said: &Said| matches!(said, Said::Failed(text) if text.contains("the same name"));
    assert!(first.iter().filter(|said| failed(said)).count() == 1, "{first:?}");
    assert!(first.contains(&Said::Built("GROWN".into())) && !first.contains(&Said::Built("grown".into())), "{first:?}");
    drop(watched);
}

#[test]
fn the_set_of_the_last_preset_is_told_of_when_that_goes() {
    let (watched, _) = Watched::start("out", &[]);
    fs::remove_file(watched.path("grown.ron")).unwrap();
    let said = watched.until(|said| *said == Said::Orphaned("grown".into()));
    assert!(said.iter().any(|said| matches!(said, Said::Failed(_))), "{said:?}");
    assert!(watched.is_whole("grown"));
}
