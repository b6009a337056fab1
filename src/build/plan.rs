//! A build as a graph of commands that share no folder: sources, one command a tree, the textures, the set. Each names
//! every file that it reads and writes, so that a farm, Bazel or Ninja with a remote executor may run it anywhere; run in
//! order, they write what one build would, byte by byte.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::builder::read;
use super::record::manifest_name;
use super::{BuildError, Limits, Loaded, find, pipeline};

/// What a command makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StepKind {
    /// Sources and pictures.
    Sources,
    /// One tree with its levels of detail.
    Tree {
        /// Its place in the set, from 0.
        place: usize,
    },
    /// The textures of the set.
    Atlas,
    /// The files of the set.
    Set,
}

/// One command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Step {
    /// What it makes.
    #[serde(flatten)]
    pub kind: StepKind,
    /// Its arguments, the program's name left out.
    pub arguments: Vec<String>,
    /// Every file that it reads, `/` between folders.
    pub inputs: Vec<String>,
    /// Files that it writes. Of a set the manifest and the variants: what else there is, the manifest tells.
    pub outputs: Vec<String>,
}

/// The commands that build some presets into `out`, by way of part files in `parts`; each comes after those that it needs.
///
/// # Errors
///
/// All errors of all presets and of the files that they read.
pub fn plan(presets: &[PathBuf], out: &Path, parts: &Path) -> Result<Vec<Step>, BuildError> {
    let (sets, mut failed) = read(presets, &Limits::default());
    let mut steps = Vec::new();
    for loaded in &sets {
        match pipeline::read_inputs(loaded) {
            Ok(_) => steps_of(loaded, out, parts, &mut steps),
            Err(diagnostics) => failed.diagnostics.extend(diagnostics),
        }
    }
    if failed.diagnostics.is_empty() { Ok(steps) } else { Err(failed) }
}

fn steps_of(loaded: &Loaded, out: &Path, parts: &Path, steps: &mut Vec<Step>) {
    let set = &loaded.plan.name;
    let part = |name: &str| find::shown(&parts.join(format!("{set}_{name}.part")));
    let files: Vec<String> =
        loaded.world.reads().iter().filter(|(_, key)| key.is_some()).map(|(path, _)| find::shown(path)).collect();
    let places = 0..loaded.plan.variants.len();
    let trees: Vec<String> = places.clone().map(|place| part(&format!("{:03}", place + 1))).collect();
    let mut step = |kind: StepKind, name: &str, given: &[String], write: [&str; 2], outputs: Vec<String>| {
        let mut arguments = vec!["step".to_owned(), name.to_owned(), loaded.preset.clone()];
        if let StepKind::Tree { place } = kind {
            arguments.extend(["--place".to_owned(), (place + 1).to_string()]);
        }
        arguments.extend(given.iter().flat_map(|part| ["--given".to_owned(), part.clone()]));
        arguments.extend(write.map(str::to_owned));
        let inputs = files.iter().chain(given).cloned().collect();
        steps.push(Step { kind, arguments, inputs, outputs });
    };
    let sources = part("sources");
    step(StepKind::Sources, "sources", &[], ["--part", &sources], vec![sources.clone()]);
    let mut given = vec![sources];
    for (place, tree) in places.zip(&trees) {
        step(StepKind::Tree { place }, "tree", &given, ["--part", tree], vec![tree.clone()]);
    }
    given.extend(trees);
    let atlas = part("atlas");
    step(StepKind::Atlas, "atlas", &given, ["--part", &atlas], vec![atlas.clone()]);
    given.push(atlas);
    let folder = out.join(set);
    let mut outputs = vec![find::shown(&folder.join(manifest_name(set)))];
    outputs.extend((1..=loaded.plan.variants.len()).map(|i| find::shown(&folder.join(format!("{set}_{i:03}.glb")))));
    step(StepKind::Set, "set", &given, ["--out", &find::shown(out)], outputs);
}

/// The commands as a file for Ninja; `program` is what is run.
#[must_use]
pub fn ninja(steps: &[Step], program: &str) -> String {
    let mut text = format!("# Written by `treewright plan`.\ntreewright = {}\n\n", program.replace('$', "$$"));
    // A part whose bytes stay is not written, and what is made of it is not made again.
    text += "rule treewright\n  command = $treewright $arguments\n  description = treewright $what\n  restat = 1\n";
    for step in steps {
        let paths = |paths: &[String]| paths.iter().map(|path| escaped(path)).collect::<Vec<_>>().join(" ");
        let (first, others) = step.outputs.split_at(1.min(step.outputs.len()));
        let _ = write!(text, "\nbuild {}", paths(first));
        if !others.is_empty() {
            let _ = write!(text, " | {}", paths(others));
        }
        let _ = writeln!(text, ": treewright {}", paths(&step.inputs));
        let arguments: Vec<String> = step.arguments.iter().map(|argument| quoted(argument)).collect();
        let _ = writeln!(text, "  arguments = {}", arguments.join(" "));
        let _ = writeln!(text, "  what = {} {}", step.arguments[1], first.concat().replace('$', "$$"));
    }
    text
}

/// A path in a rule of Ninja's.
fn escaped(path: &str) -> String {
    path.replace('$', "$$").replace(' ', "$ ").replace(':', "$:")
}

/// An argument as the shell that Ninja calls reads it.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./+,=@%".contains(c);
    let text = argument.replace('$', "$$");
    if argument.chars().all(plain) && !argument.is_empty() {
        text
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}
