//! Prints the figures that this project claims, one JSON object a line, measured on this machine when it is run.
//!
//! `cargo run --release --example figures -- [TOPIC]…`; without a topic all of them. Topics: `line`,
//! `grow`, `import`, `blend`, `space`, `morph`, `sketch`, `lod`, `build`, `page`.
//!
//! Times are medians of several runs in this process after a warm-up. Nothing printed is a constant that someone typed,
//! but the goals.

#![expect(clippy::print_stdout, reason = "a program that prints")]

mod blend;
mod bridges;
mod build;
mod foliage;
mod formats;
mod grow;
mod import;
mod leafy;
mod line;
mod lod;
mod lod_asset;
mod lod_bark;
mod lod_leaf;
mod lod_mesh;
mod lod_screen;
mod lod_speed;
mod lod_table;
mod lod_textures;
mod lod_three;
mod morph;
mod page;
mod plausibility;
mod select;
mod shells;
mod sketch;
mod space;
mod surface;
mod table_1;
mod trees;

#[path = "../../tests/kills/mod.rs"]
mod kills;
#[path = "../../tests/tiny/mod.rs"]
mod tiny;

use std::borrow::Cow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// A measured figure.
pub(crate) struct Figure {
    name: Cow<'static, str>,
    value: f64,
    unit: &'static str,
    goal: &'static str,
    how: String,
}

impl Figure {
    pub(crate) fn new(
        name: impl Into<Cow<'static, str>>,
        value: f64,
        unit: &'static str,
        how: impl Into<String>,
    ) -> Self {
        Self { name: name.into(), value, unit, goal: "", how: how.into() }
    }

    pub(crate) fn goal(mut self, goal: &'static str) -> Self {
        self.goal = goal;
        self
    }

    pub(crate) fn print(&self) {
        let rounded = (self.value * 1e5).round() / 1e5;
        let line = serde_json::json!({
            "figure": self.name, "value": rounded, "unit": self.unit, "goal": self.goal, "how": self.how,
        });
        println!("{line}");
    }
}

/// Median time of `runs` runs after one that is not counted, seconds.
pub(crate) fn seconds(runs: usize, mut run: impl FnMut()) -> f64 {
    run();
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// The project's folder.
pub(crate) fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The folder of real trees, where there is one.
pub(crate) fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("TREEWRIGHT_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// The topics, each with what prints it.
const TOPICS: [(&str, fn()); 10] = [
    ("line", line::print),
    ("grow", grow::print),
    ("import", import::print),
    ("blend", blend::print),
    ("space", space::print),
    ("morph", morph::print),
    ("sketch", sketch::print),
    ("lod", lod::print),
    ("build", build::print),
    ("page", page::print),
];

fn main() -> ExitCode {
    // The figures of builds start the command, which is this program under another name.
    if std::env::var_os(build::AS_COMMAND).is_some() {
        return treewright::cli::run();
    }
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if let Some(unknown) = wanted.iter().find(|w| TOPICS.iter().all(|(name, _)| w != name)) {
        let names: Vec<&str> = TOPICS.iter().map(|(name, _)| *name).collect();
        println!("no topic {unknown}; there are: {}", names.join(", "));
        return ExitCode::from(2);
    }
    for (name, print) in TOPICS {
        if wanted.is_empty() || wanted.iter().any(|w| w == name) {
            print();
        }
    }
    ExitCode::SUCCESS
}
