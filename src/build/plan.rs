//! A build as a graph of commands that share no folder: sources, one command a tree, the textures, the set. Each names
//! every file that it reads and writes, so that a farm, Bazel or Ninja with a remote executor may run it anywhere; run in
//! order, they write what one build would, byte by byte.
//!
//! Ninja hands a command to the shell as one argument, of which systems take 128 KiB: what a step is given stands in a file
//! there, where it is more than one part.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::assets::names;
use super::builder::read;
use super::record::manifest_name;
use super::{BuildError, Limits, Loaded, find, pipeline};
use crate::base::Diagnostic;
use crate::export::level_name;
use crate::preset::plan::{Engine, Profile};

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
    /// Files that it writes. Of a set the manifest and, for each engine, the first file of each variant: what else there is,
    /// the manifest tells.
    pub outputs: Vec<String>,
}

impl Step {
    /// The parts that it is given.
    fn given(&self) -> &[String] {
        let count = self.arguments.iter().filter(|argument| *argument == "--given").count();
        &self.inputs[self.inputs.len() - count..]
    }
}

/// The commands that build some presets into `out`, by way of part files in `parts`; each comes after those that it needs,
/// and reads within `limits`.
///
/// # Errors
///
/// All errors of all presets and of the files that they read.
pub fn plan(presets: &[PathBuf], out: &Path, parts: &Path, limits: &Limits) -> Result<Vec<Step>, BuildError> {
    let (sets, mut failed) = read(presets, limits);
    let mut steps = Vec::new();
    for loaded in &sets {
        match pipeline::read_inputs(loaded) {
            Ok(_) => steps_of(loaded, (out, parts), &told(limits), &mut steps),
            Err(diagnostics) => failed.diagnostics.extend(diagnostics),
        }
    }
    if failed.diagnostics.is_empty() { Ok(steps) } else { Err(failed) }
}

/// The options that tell a command limits which are not the usual ones.
fn told(limits: &Limits) -> Vec<String> {
    let usual = Limits::default();
    let file = (limits.file != usual.file).then(|| ["--max-file".to_owned(), limits.file.to_string()]);
    let root = limits.root.as_ref().map(|root| ["--root".to_owned(), find::shown(root)]);
    [file, root].into_iter().flatten().flatten().collect()
}

fn steps_of(loaded: &Loaded, (out, parts): (&Path, &Path), limits: &[String], steps: &mut Vec<Step>) {
    let set = &loaded.plan.name;
    let part = |name: &str| {
        let path = find::shown(&parts.join(format!("{set}_{name}.part")));
        // `--given @FILE` is a list of parts.
        if path.starts_with('@') { format!("./{path}") } else { path }
    };
    let files: Vec<String> =
        loaded.world.reads().iter().filter(|(_, key)| key.is_some()).map(|(path, _)| find::shown(path)).collect();
    let places = 0..loaded.plan.variants.len();
    let trees: Vec<String> = places.clone().map(|place| part(&format!("{:03}", place + 1))).collect();
    let mut step = |kind: StepKind, name: &str, given: &[String], write: [&str; 2], outputs: Vec<String>| {
        let mut arguments = vec!["step".to_owned(), name.to_owned(), loaded.preset.clone()];
        arguments.extend_from_slice(limits);
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
    for name in names(&loaded.plan) {
        let of = |profile: &Profile| find::shown(&folder.join(first_file(&name, profile.engine)));
        outputs.extend(loaded.plan.engines.iter().map(of));
    }
    step(StepKind::Set, "set", &given, ["--out", &find::shown(out)], outputs);
}

/// The file of a variant that an engine gets whatever the variant holds.
fn first_file(name: &str, engine: Engine) -> String {
    match engine {
        Engine::Generic => format!("{name}.glb"),
        Engine::Godot => format!("{name}.godot.glb"),
        Engine::Unity => format!("{name}.unity.glb"),
        Engine::Unreal => format!("{}.unreal.glb", level_name(name, 0)),
        Engine::Bevy => format!("{name}.bevy.glb"),
        Engine::Web => format!("{name}.web.glb"),
    }
}

/// The commands as a file for Ninja; `program` is what is run.
///
/// # Errors
///
/// The paths that Ninja has no way to write: those with a `|` or a line's end.
pub fn ninja(steps: &[Step], program: &str) -> Result<String, BuildError> {
    let paths: BTreeSet<&String> = steps.iter().flat_map(|step| step.inputs.iter().chain(&step.outputs)).collect();
    let wrong = paths.into_iter().filter(|path| path.contains(['|', '\n', '\r'])).map(|path| {
        let shown = path.escape_debug().to_string();
        Diagnostic::new(shown, "a file for Ninja can't name a path with `|` or a line's end in it")
            .with_hint("rename it, or take the plan as JSON")
    });
    let wrong: Vec<Diagnostic> = wrong.collect();
    if !wrong.is_empty() {
        return Err(BuildError::of(wrong));
    }
    let mut text = format!("# Written by `treewright plan`.\ntreewright = {}\n\n", program.replace('$', "$$"));
    // A part whose bytes stay is not written, and what is made of it is not made again.
    let rule = "\n  command = $treewright $arguments\n  description = treewright $what\n  restat = 1\n";
    let of_parts = "  rspfile = $given\n  rspfile_content = $in_newline\n";
    let _ = write!(text, "rule treewright{rule}\nrule treewright_of_parts{rule}{of_parts}");
    for step in steps {
        let paths = |paths: &[String]| paths.iter().map(|path| escaped(path)).collect::<Vec<_>>().join(" ");
        let (first, others) = step.outputs.split_at(1.min(step.outputs.len()));
        let _ = write!(text, "\nbuild {}", paths(first));
        if !others.is_empty() {
            let _ = write!(text, " | {}", paths(others));
        }
        let mut arguments = step.arguments.clone();
        let given = step.given();
        if let [_, .., last] = given {
            // Inputs end in what the step is given.
            let files = &step.inputs[..step.inputs.len() - given.len()];
            let _ = writeln!(text, ": treewright_of_parts {} | {}", paths(given), paths(files));
            // Beside the parts, by the last of them, which is another one for each such step.
            let list = format!("{last}.given");
            let _ = writeln!(text, "  given = {}", list.replace('$', "$$"));
            let first = arguments.iter().position(|argument| argument == "--given").unwrap_or(arguments.len());
            arguments.splice(first..first + 2 * given.len(), ["--given".to_owned(), format!("@{list}")]);
        } else {
            let _ = writeln!(text, ": treewright {}", paths(&step.inputs));
        }
        let arguments: Vec<String> = arguments.iter().map(|argument| quoted(argument)).collect();
        let _ = writeln!(text, "  arguments = {}", arguments.join(" "));
        let _ = writeln!(text, "  what = {} {}", step.arguments[1], first.concat().replace('$', "$$"));
    }
    Ok(text)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn step(given: usize, file: &str) -> Step {
        let parts: Vec<String> = (0..given).map(|i| format!("parts/{i} a.part")).collect();
        let mut arguments = vec!["step".to_owned(), "atlas".to_owned(), file.to_owned()];
        arguments.extend(parts.iter().flat_map(|part| ["--given".to_owned(), part.clone()]));
        arguments.extend(["--part", "parts/atlas.part"].map(str::to_owned));
        let inputs = [vec![file.to_owned()], parts].concat();
        Step { kind: StepKind::Atlas, arguments, inputs, outputs: vec!["parts/atlas.part".to_owned()] }
    }

    #[test]
    fn a_command_stays_short_whatever_it_is_given() {
        let text = ninja(&[step(5000, "a.ron"), step(1, "a.ron")], "treewright").unwrap();
        let commands: Vec<&str> = text.lines().filter(|line| line.starts_with("  arguments")).collect();
        assert_eq!(
            commands,
            [
                "  arguments = step atlas a.ron --given '@parts/4999 a.part.given' --part parts/atlas.part",
                "  arguments = step atlas a.ron --given 'parts/0 a.part' --part parts/atlas.part",
            ]
        );
        assert!(text.contains("treewright_of_parts parts/0$ a.part parts/1$ a.part ") && text.contains(" | a.ron\n"));
    }

    #[test]
    fn a_path_that_ninja_has_no_letters_for_is_an_error() {
        for file in ["a|b.ron", "a\nb.ron"] {
            let error = ninja(&[step(0, file)], "treewright").unwrap_err();
            assert!(error.to_string().starts_with(&file.escape_debug().to_string()), "{error}");
        }
    }
}
