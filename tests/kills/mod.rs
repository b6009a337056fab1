//! Kills builds and watchers at random moments, and looks at what they leave: as a reader finds it before anybody mends
//! it, and after the next build. Used by `tests/faults.rs` with a few kills and by `examples/figures` with 500.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::tiny;

/// What was found.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Found {
    /// Processes that were killed before they had done their work.
    pub(crate) cut_off: usize,
    /// Those that had done it.
    pub(crate) ended: usize,
    /// Sets that a reader found neither wholly old nor wholly new after a kill.
    pub(crate) torn: usize,
    /// Files of the user's that were lost or changed.
    pub(crate) lost: usize,
    /// Next builds that failed, or made something else than they should.
    pub(crate) wrong: usize,
    /// Files and folders that nobody needs and that are still there after the next build.
    pub(crate) left: usize,
}

impl Found {
    /// Whether every kill left what it should.
    pub(crate) fn is_good(&self) -> bool {
        (self.torn, self.lost, self.wrong, self.left) == (0, 0, 0, 0)
    }
}

/// What is killed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Victim {
    Build,
    Watch,
}

/// Kills `count` processes of `program`, which runs treewright with the arguments that it is given.
pub(crate) fn kill(program: &dyn Fn(&Path, &[&str]) -> Command, victim: Victim, count: usize) -> Found {
    let project = tiny::project();
    let folder = project.path().join("out/grown");
    // The pages of all sets are mended by who makes such pages: not by the build of one preset.
    let what = if victim == Victim::Watch { "." } else { "grown.ron" };
    let run = || {
        let mut command = program(project.path(), &["build", what, "--out", "out"]);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap().success()
    };
    let write = |seed: usize| {
        let text = tiny::GROWN.replace("seed: 1,\n    sources", &format!("seed: {seed},\n    sources"));
        fs::write(project.path().join("grown.ron"), text).unwrap();
    };
    assert!(run(), "the project does not build");
    // How long a build takes here.
    let longest = (0..3)
        .map(|i| {
            write(1_000_000 + i);
            let start = Instant::now();
            assert!(run());
            start.elapsed()
        })
        .max()
        .unwrap();
    let mine = folder.join("mine.txt");
    fs::write(&mine, "mine").unwrap();
    let mut random = Random(0x5851_f42d_4c95_7f2d);
    let mut found = Found::default();
    for i in 0..count {
        // Every eighth build begins with no set at all.
        let from_nothing = victim == Victim::Build && i % 8 == 7;
        if from_nothing {
            fs::remove_dir_all(&folder).unwrap();
        }
        let old = visible(&folder);
        let delay = longest.mul_f64(1.15 * random.unit());
        let done = match victim {
            Victim::Build => {
                write(i + 2);
                let mut command = program(project.path(), &["build", "grown.ron", "--out", "out"]);
                let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
                let mut child = child.unwrap();
                std::thread::sleep(delay);
                let _ = child.kill();
                child.wait().unwrap().success()
            }
            Victim::Watch => {
                let mut command = program(project.path(), &["watch", ".", "--out", "out"]);
                let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
                let mut child = child.unwrap();
                let said = BufReader::new(child.stderr.take().unwrap()).lines();
                let rests = said.map_while(Result::ok).any(|line| line.starts_with("watching"));
                assert!(rests, "the watcher never came to rest");
                write(i + 2);
                std::thread::sleep(Duration::from_millis(20) + delay);
                let _ = child.kill();
                let _ = child.wait();
                seed_of(&visible(&folder)) == Some(i + 2)
            }
        };
        if done {
            found.ended += 1;
        } else {
            found.cut_off += 1;
        }
        // What a reader finds.
        let mut now = visible(&folder);
        let kept = now.remove("mine.txt");
        found.lost += usize::from(!from_nothing && kept.as_deref() != Some(b"mine".as_slice()));
        let mut before = old;
        before.remove("mine.txt");
        let is_old = now == before;
        let is_new = is_whole(&now) && seed_of(&now) == Some(i + 2);
        found.torn += usize::from(!is_old && !is_new);
        // What the next build makes of it.
        let built = run();
        let mut after = visible(&folder);
        found.lost += usize::from(!from_nothing && after.remove("mine.txt").as_deref() != Some(b"mine".as_slice()));
        found.wrong += usize::from(!built || !is_whole(&after) || seed_of(&after) != Some(i + 2));
        let of_sets = ["grown", ".treewright-lock", ".treewright-index"];
        // What a watcher makes beside the sets.
        let of_all = ["gallery.html", "gallery.species", ".treewright-species"];
        let known = |name: &str| of_sets.contains(&name) || (victim == Victim::Watch && of_all.contains(&name));
        found.left += names(&project.path().join("out")).iter().filter(|name| !known(name)).count();
        found.left += names(&folder).iter().filter(|name| name.starts_with('.')).count();
        fs::write(&mine, "mine").unwrap();
    }
    found
}

/// The names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
}

/// The files that a reader looks at: those whose names don't begin with a dot.
fn visible(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = tiny::files(folder);
    files.retain(|name, _| !name.starts_with('.'));
    files
}

/// Whether there are exactly the files that the manifest lists, each with its hash, and the manifest.
fn is_whole(files: &BTreeMap<String, Vec<u8>>) -> bool {
    let Some(manifest) = manifest(files) else { return false };
    let listed = manifest["files"].as_array().unwrap();
    let whole = |entry: &serde_json::Value| {
        let bytes = files.get(entry["file"].as_str().unwrap());
        bytes.is_some_and(|bytes| entry["blake3"] == treewright::base::Key::of_bytes(bytes).to_hex())
    };
    listed.iter().all(whole) && files.len() == listed.len() + 1
}

fn manifest(files: &BTreeMap<String, Vec<u8>>) -> Option<serde_json::Value> {
    serde_json::from_slice(files.get("grown.manifest.json")?).ok()
}

fn seed_of(files: &BTreeMap<String, Vec<u8>>) -> Option<usize> {
    manifest(files)?["seed"].as_u64().map(|seed| seed as usize)
}

/// xorshift64*, so that a run can be repeated as far as the machine's timing lets it.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
