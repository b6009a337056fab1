//! Build, watch, cache: how long a designer waits, and what is left when processes are killed.
//!
//! The latencies are taken from the write of the file to the moment at which the watcher tells that the set is written,
//! which comes after the last rename. TREEWRIGHT_KILLS sets how many processes are killed (500), TREEWRIGHT_FUZZ how many
//! seconds damaged presets and cache entries are read (4). BUILD_PARTS names the parts to be measured, all where it is not
//! set: latencies, unchanged, cache, kills, at_once, same_bytes, hostile, damaged, game.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use treewright::build::{BuildOptions, Builder, Happened, Progress};
use treewright::watch::{Event, Next, WatchOptions, Watcher};

use crate::kills::{Victim, kill};
use crate::{Figure, root, tiny};

/// Asks this program to be the command.
pub(crate) const AS_COMMAND: &str = "TREEWRIGHT_FIGURES_AS_COMMAND";

/// The parts and what prints them.
const PARTS: [(&str, fn()); 9] = [
    ("latencies", latencies),
    ("unchanged", unchanged),
    ("cache", cache),
    ("kills", kills),
    ("at_once", at_once),
    ("same_bytes", same_bytes),
    ("hostile", hostile),
    ("damaged", damaged),
    ("game", game),
];

pub(crate) fn print() {
    let wanted = std::env::var("BUILD_PARTS").ok();
    for (name, part) in PARTS {
        if wanted.as_ref().is_none_or(|wanted| wanted.split(',').any(|w| w == name)) {
            part();
        }
    }
}

/// The command `treewright`, which this program is as well.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("this program has a path"));
    command.env(AS_COMMAND, "1").env_remove("TREEWRIGHT_CACHE").current_dir(folder).args(arguments);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn runs(folder: &Path, arguments: &[&str]) -> bool {
    command(folder, arguments).status().is_ok_and(|status| status.success())
}

fn number(name: &str, otherwise: usize) -> usize {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Twelve variants of two bushes.
const TWELVE: &str = r##"(
    seed: 1,
    sources: {
        "low": Grow(species: "species/shrub.ron", seed: 1, height: 2.0),
        "high": Grow(species: "species/shrub.ron", seed: 2, height: 3.0),
    },
    variants: [Source("low"), Source("high"), Blend(of: ["low", "high"], count: 10, from: 0.2, to: 0.8)],
    foliage: (leaf: "birch", density: 1.0, most: 3000, color: "#6a8a35"),
    lods: [Full, Thinned(triangles: 0.4), BillboardCloud(cards: 24), CrossedQuads],
    atlas: (size: 1024),
)
"##;

/// A watcher of one preset.
struct Watched {
    folder: tempfile::TempDir,
    built: Receiver<(Instant, usize)>,
}

impl Watched {
    fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder can be made");
        fs::create_dir(folder.path().join("species")).expect("the folder is ours");
        let shrub = root().join("presets/species/shrub.ron");
        fs::copy(shrub, folder.path().join("species/shrub.ron")).expect("the species is shipped");
        fs::write(folder.path().join("twelve.ron"), TWELVE).expect("the folder is ours");
        let (say, built) = channel();
        let mut watcher = Watcher::new(WatchOptions::new(folder.path(), folder.path().join("out")));
        // Ends with the process.
        std::thread::spawn(move || {
            watcher.run(&|event| {
                if let Event::Build(Progress::Set { outcome, .. }) = event
                    && outcome.happened == Happened::Built
                {
                    let _ = say.send((Instant::now(), outcome.committed.written.len()));
                }
                Next::Watch
            });
        });
        let watched = Self { folder, built };
        watched.built.recv().expect("the first build ends");
        watched
    }

    /// Median of 20 edits, or of as many (five at least) as half a minute has room for, and how it was measured.
    fn edits(&self, edit: impl Fn(usize) -> (&'static str, String)) -> (f64, String) {
        let (mut times, mut written) = (Vec::new(), 0);
        let begin = Instant::now();
        for i in 0..20 {
            if i >= 5 && begin.elapsed() > Duration::from_secs(30) {
                break;
            }
            let (file, text) = edit(i);
            // An editor's user is not that quick, and the watcher shall rest.
            std::thread::sleep(Duration::from_millis(60));
            let start = Instant::now();
            fs::write(self.folder.path().join(file), text).expect("the folder is ours");
            let (end, files) = self.built.recv_timeout(Duration::from_secs(300)).expect("an edit is built");
            times.push((end - start).as_secs_f64());
            written = files;
        }
        let (count, threads) = (times.len(), rayon::current_num_threads());
        let how = format!(
            "from the write to the last rename, watching 12 bushes, {written} files written, median of {count}, {threads} threads"
        );
        (median(times), how)
    }
}

fn latencies() {
    let watched = Watched::start();
    let threads = rayon::current_num_threads();
    let (time, how) = watched.edits(|i| ("twelve.ron", TWELVE.replace("#6a8a35", &format!("#6a{:02x}35", 0x70 + i))));
    Figure::new("build.latency_tint", time * 1e3, "ms", how).goal("<= 150 ms").print();
    let more = |i: usize| TWELVE.replace("count: 10", &format!("count: {}", 11 + i));
    let (time, how) = watched.edits(|i| ("twelve.ron", more(i)));
    Figure::new("build.latency_one_more_variant", time * 1e3, "ms", how + ", each edit one more")
        .goal("<= 400 ms")
        .print();
    let cards = |i: usize| TWELVE.replace("cards: 24", &format!("cards: {}", 25 + i));
    let (time, how) = watched.edits(|i| ("twelve.ron", cards(i)));
    Figure::new("build.latency_lod_budget", time, "s", how + ", each edit a card more").goal("<= 1 s").print();
    let share = |i: usize| TWELVE.replace("triangles: 0.4", &format!("triangles: {}", 0.39 - 0.005 * i as f32));
    let (time, how) = watched.edits(|i| ("twelve.ron", share(i)));
    Figure::new("build.latency_lod_share", time, "s", how + ", each edit fewer triangles at LOD1")
        .goal("<= 1 s")
        .print();
    let bush = fs::read_to_string(root().join("presets/species/shrub.ron")).expect("the species is shipped");
    let finer = |i: usize| bush.replacen("nodes: 60000", &format!("nodes: {}", 58_000 + 100 * i), 1);
    assert_ne!(finer(0), bush, "the species is another one");
    let whole = {
        let folder = watched.folder.path();
        fs::write(folder.join("twelve.ron"), TWELVE).expect("the folder is ours");
        let _ = watched.built.recv_timeout(Duration::from_secs(300));
        let times = (0..3).map(|i| {
            let out = folder.join(format!("cold{i}"));
            let start = Instant::now();
            let builder = Builder::new(BuildOptions::new(out));
            builder.build(&[folder.join("twelve.ron")], &|_| {}).expect("the set builds");
            start.elapsed().as_secs_f64()
        });
        median(times.collect())
    };
    let (time, how) = watched.edits(|i| ("species/shrub.ron", finer(i)));
    Figure::new("build.latency_species", time / whole, "times the set's build", how).goal("<= 1").print();
    Figure::new(
        "build.twelve_cold",
        whole,
        "s",
        format!("the set built with nothing known, median of 3, {threads} threads"),
    )
    .print();
}

/// A hundred presets of ten variants each, built once and kept.
fn unchanged() {
    let folder = root().join("target/figures/hundred");
    let _ = fs::create_dir_all(folder.join("species"));
    let _ = fs::create_dir_all(folder.join("art"));
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        if fs::read_to_string(&path).ok().as_deref() != Some(text) {
            fs::write(path, text).expect("the target folder can be written");
        }
    };
    write("species/tiny.ron", tiny::SPECIES);
    for (name, green) in [("leaf", 120), ("bark", 70)] {
        let path = folder.join(format!("art/{name}.png"));
        if !path.exists() {
            tiny::picture(&path, green);
        }
    }
    for i in 0..100 {
        let sources: String =
            (0..10).map(|k| format!("\"s{k}\": Grow(species: \"species/tiny.ron\", seed: {}),", i * 10 + k)).collect();
        let variants: Vec<String> = (0..10).map(|k| format!("Source(\"s{k}\")")).collect();
        let text = tiny::GROWN
            .replace(r#""a": Grow(species: "species/tiny.ron", seed: 1),"#, &sources)
            .replace(r#"[Source("a")]"#, &format!("[{}]", variants.join(", ")));
        write(&format!("set{i:03}.ron"), &text);
    }
    let build = || runs(&folder, &["build", ".", "--out", "out"]);
    assert!(build() && build(), "the sets build");
    let times: Vec<f64> = (0..9)
        .map(|_| {
            let start = Instant::now();
            assert!(build());
            start.elapsed().as_secs_f64()
        })
        .collect();
    let how = "a process from start to end, 100 presets of 10 variants, nothing touched, median of 9";
    Figure::new("build.unchanged", median(times) * 1e3, "ms", how).goal("<= 100 ms").print();
}

/// What a second machine saves.
fn cache() {
    let project = tempfile::tempdir().expect("a folder can be made");
    fs::create_dir(project.path().join("species")).expect("the folder is ours");
    fs::copy(root().join("presets/species/shrub.ron"), project.path().join("species/shrub.ron")).expect("shipped");
    fs::write(project.path().join("twelve.ron"), TWELVE).expect("the folder is ours");
    let time = |out: &str| {
        let start = Instant::now();
        assert!(runs(project.path(), &["build", "twelve.ron", "--out", out, "--cache", "kept"]), "the set builds");
        start.elapsed().as_secs_f64()
    };
    let (cold, warm) = (time("cold"), time("warm"));
    let how = format!("12 bushes built in another folder with a warm cache over a cold one, {cold:.2} s");
    Figure::new("build.warm_over_cold", warm / cold, "ratio", how).print();
}

fn kills() {
    let count = number("TREEWRIGHT_KILLS", 500);
    // A watcher takes longer to start and to kill.
    for (name, victim, count) in
        [("builds", Victim::Build, count * 4 / 5), ("watchers", Victim::Watch, count.div_ceil(5))]
    {
        let found = kill(&command, victim, count);
        let bad = found.torn + found.lost + found.wrong + found.left;
        assert_eq!(found.is_good(), bad == 0);
        let how = format!("of {count} {name} killed at random moments: {found:?}");
        Figure::new(format!("build.kills_of_{name}"), bad as f64, "bad", how)
            .goal("0 torn, 0 lost, 0 wrong, 0 left")
            .print();
    }
}

/// Every file below a folder, but for what an output folder keeps for itself.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = PathBuf::from(entry.file_name());
        if entry.path().is_dir() {
            all.extend(tree(&entry.path()).into_iter().map(|(below, bytes)| (name.join(below), bytes)));
        } else if !name.to_string_lossy().starts_with(".treewright-") {
            all.insert(name, fs::read(entry.path()).expect("it can be read"));
        }
    }
    all
}

fn at_once() {
    let project = tiny::project();
    assert!(runs(project.path(), &["build", "grown.ron", "--out", "alone"]), "it builds");
    let mut bad = 0;
    for round in 0..5 {
        let (out, kept) = (format!("out{round}"), format!("kept{round}"));
        let arguments = ["build", "grown.ron", "--force", "--out", &out, "--cache", &kept];
        let children: Vec<_> = (0..8).map(|_| command(project.path(), &arguments).spawn()).collect();
        for child in children {
            bad += usize::from(!child.and_then(|mut child| child.wait()).is_ok_and(|status| status.success()));
        }
        bad += usize::from(!tiny::is_whole(&project.path().join(&out).join("grown"), "grown"));
        bad += usize::from(tree(&project.path().join(&out)) != tree(&project.path().join("alone")));
    }
    let how = "failures in 5 rounds of 8 processes that build one set into one folder with one cache";
    Figure::new("build.eight_at_once", bad as f64, "bad", how).goal("0").print();

    assert!(runs(project.path(), &["build", "grown.ron", "--out", "shards", "--cache", "shared", "--shard", "1/4"]));
    let shards: Vec<_> = (2..=4)
        .map(|i| {
            let shard = format!("{i}/4");
            command(project.path(), &["build", "grown.ron", "--out", "shards", "--cache", "shared", "--shard", &shard])
                .spawn()
        })
        .collect();
    for shard in shards {
        let _ = shard.and_then(|mut shard| shard.wait());
    }
    assert!(runs(project.path(), &["build", "grown.ron", "--out", "shards", "--cache", "shared"]));
    let same = tree(&project.path().join("shards")) == tree(&project.path().join("alone"));
    let how = "4 shards in processes of their own with one cache, merged, against a single build";
    Figure::new("build.shards_same", f64::from(u8::from(same)), "of 1", how).goal("1").print();
}

/// The same bytes, however they come about.
fn same_bytes() {
    let project = tiny::project();
    let text = tiny::GROWN
        .replace(r#"seed: 1),"#, r#"seed: 1), "b": Grow(species: "species/tiny.ron", seed: 2),"#)
        .replace(r#"[Source("a")]"#, r#"[Source("a"), Source("b"), Blend(of: ["a", "b"], count: 3)]"#);
    fs::write(project.path().join("five.ron"), &text).expect("the folder is ours");
    let mut seen = BTreeSet::new();
    let mut ways = 0;
    for threads in ["1", "2", "8"] {
        for locale in ["C", "de_DE.UTF-8", "tr_TR.UTF-8"] {
            for cache in ["none", "cold", "warm"] {
                for order in [["five.ron", "grown.ron"], ["grown.ron", "five.ron"]] {
                    ways += 1;
                    let (out, kept) = (format!("out{ways}"), format!("kept{threads}{locale}{}", order[0]));
                    let mut arguments = vec!["build", order[0], order[1], "--out", &out, "--jobs", threads];
                    if cache != "none" {
                        arguments.extend(["--cache", &kept]);
                    }
                    let mut command = command(project.path(), &arguments);
                    command.env("LC_ALL", locale).env("LANG", locale);
                    assert!(command.status().is_ok_and(|status| status.success()), "it builds");
                    let folder = project.path().join(&out);
                    seen.insert(tree(&folder));
                    let _ = fs::remove_dir_all(folder);
                }
            }
        }
    }
    let how = format!(
        "different outputs of {ways} builds on 1, 2 and 8 threads, 3 locales, without, with a cold and with a warm cache, presets in 2 orders"
    );
    Figure::new("build.outputs_of_all_ways", seen.len() as f64, "outputs", how).goal("1").print();
}

fn hostile() {
    let project = tiny::project();
    let many = |head: &str, unit: &str, count: usize, tail: &str| format!("{head}{}{tail}", unit.repeat(count));
    let cases: [(&str, String); 6] = [
        (
            "variants",
            many(
                "(sources: {\"a\": Grow(species: \"species/tiny.ron\")}, variants: [",
                "Source(\"a\"),",
                1_000_000,
                "])",
            ),
        ),
        ("count", tiny::GROWN.replace(r#"Source("a")"#, r#"Blend(of: ["a", "a"], count: 1000000)"#)),
        ("sizes", tiny::GROWN.replace("size: 256", "size: 1e300")),
        ("height", tiny::GROWN.replace("seed: 1),", "seed: 1, height: 1e300),")),
        ("nesting", "(".repeat(200_000)),
        ("outside", tiny::scanned().replace("scans/tiny.swc", "../../../../../../etc/passwd")),
    ];
    let mut worst = (0.0_f64, "");
    for (name, text) in &cases {
        let file = format!("{name}.ron");
        fs::write(project.path().join(&file), text).expect("the folder is ours");
        let start = Instant::now();
        let status =
            command(project.path(), &["build", &file, "--out", "out", "--root", "."]).status().expect("it starts");
        let time = start.elapsed().as_secs_f64();
        assert_eq!(status.code(), Some(1), "{name} is no error");
        if time > worst.0 {
            worst = (time, name);
        }
    }
    let how = format!("the slowest error of {} hostile presets: {}", cases.len(), worst.1);
    Figure::new("build.hostile_preset", worst.0, "s", how).goal("<= 1 s").print();
}

/// Damaged presets and cache entries, over and over.
fn damaged() {
    let seconds = Duration::from_secs(number("TREEWRIGHT_FUZZ", 4) as u64);
    let mut seeds: Vec<Vec<u8>> = vec![tiny::GROWN.into(), TWELVE.into(), tiny::scanned().into_bytes()];
    let shipped = fs::read_dir(root().join("presets")).into_iter().flatten().flatten();
    seeds.extend(shipped.filter_map(|entry| fs::read(entry.path()).ok()));
    let mut random = 0x9e37_79b9_7f4a_7c15_u64;
    let mut below = |n: usize| {
        random ^= random >> 12;
        random ^= random << 25;
        random ^= random >> 27;
        (random.wrapping_mul(0x2545_f491_4f6c_dd1d) % n.max(1) as u64) as usize
    };
    let (start, mut count, mut worst) = (Instant::now(), 0, Duration::ZERO);
    while start.elapsed() < seconds {
        let mut bytes = seeds[below(seeds.len())].clone();
        for _ in 0..1 + below(5) {
            let (at, span) = (below(bytes.len()), 1 + below(40));
            match below(5) {
                _ if bytes.is_empty() => bytes.push(b'('),
                0 => bytes[at] = below(128) as u8,
                1 => drop(bytes.drain(at..(at + span).min(bytes.len()))),
                2 => {
                    let copy = bytes[at..(at + span).min(bytes.len())].to_vec();
                    let to = below(bytes.len());
                    bytes.splice(to..to, copy);
                }
                3 => {
                    let other = &seeds[below(seeds.len())];
                    let from = below(other.len());
                    bytes.splice(at..at, other[from..(from + span).min(other.len())].iter().copied());
                }
                _ => {
                    let special: [&[u8]; 6] = [b"1e300", b"-1", b"\"", b"/*", b"[", b"18446744073709551616"];
                    bytes.splice(at..at, special[below(6)].iter().copied());
                }
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        let began = Instant::now();
        // Whether it is good does not matter; a panic ends this program.
        let _ = treewright::preset::load("damaged.ron", &text, &mut |_| Ok(tiny::SPECIES.to_owned()));
        worst = worst.max(began.elapsed());
        count += 1;
    }
    let how = format!("the slowest of {count} damaged presets, none of which panics");
    Figure::new("build.damaged_preset", worst.as_secs_f64() * 1e3, "ms", how).goal("<= 1000 ms").print();
}

/// The sample game, built by CMake and Ninja.
fn game() {
    let script = root().join("examples/game/try.sh");
    let program = std::env::current_exe().expect("this program has a path");
    let run = Command::new("sh").arg(script).env("TREEWRIGHT", program).env(AS_COMMAND, "1").output();
    match run {
        Ok(run) if run.status.success() => {
            let said = String::from_utf8_lossy(&run.stdout).into_owned();
            let last = said.lines().last().unwrap_or_default().to_owned();
            Figure::new("build.game_rebuilds_what_an_edit_touches", 1.0, "of 1", last).goal("1").print();
        }
        Ok(run) if run.status.code() == Some(77) => {
            Figure::new("build.game_rebuilds_what_an_edit_touches", 0.0, "of 1", "no Ninja here: nothing was measured")
                .print();
        }
        other => {
            let how = other.map(|run| String::from_utf8_lossy(&run.stderr).into_owned()).unwrap_or_default();
            Figure::new("build.game_rebuilds_what_an_edit_touches", 0.0, "of 1", how).goal("1").print();
        }
    }
}
