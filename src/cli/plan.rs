//! `treewright plan` and `treewright step`: a build as a graph of commands, and one of them.

use std::fs;
use std::path::{Path, PathBuf};

use super::args::{MessageFormat, PlanArguments, PlanFormat, StepArguments, StepOf};
use super::over::{Kind, may_replace, write_over};
use super::report::{Failure, Meter, print};
use crate::build::{self, BuildOptions, Builder, Shard, Share, find_presets, make_part, ninja};

/// Prints the graph.
pub(super) fn run(arguments: &PlanArguments) -> Result<(), Failure> {
    let presets = find_presets(&arguments.presets)?;
    let steps = build::plan(&presets, &arguments.out, &arguments.parts, &arguments.limits.limits())?;
    match arguments.format {
        PlanFormat::Ninja => print(&ninja(&steps, &arguments.program)?),
        PlanFormat::Json => {
            let text = serde_json::to_string_pretty(&serde_json::json!({ "commands": steps }));
            print(&(text.map_err(|e| Failure::Other(e.to_string()))? + "\n"))
        }
    }
}

/// Runs one step.
pub(super) fn step(arguments: &StepArguments) -> Result<(), Failure> {
    let wrong = |message: &str| Err(Failure::Usage(message.to_owned()));
    let share = match (arguments.what, arguments.place) {
        (StepOf::Sources, None) => Share::Sources,
        // The only tree of its share: every so manieth, counted from its place, is beyond any set.
        (StepOf::Tree, Some(place)) => Share::Trees(Shard { index: place - 1, of: u32::MAX }),
        (StepOf::Atlas, None) => Share::Atlas,
        (StepOf::Set, None) => return set(arguments),
        _ => return wrong("--place goes with the step `tree` and with no other"),
    };
    let Some(path) = &arguments.part else { return wrong("this step writes a part: give --part FILE") };
    may_replace(path, Kind::Part)?;
    let given = given(arguments)?;
    let bytes = make_part(&arguments.preset, share, &given, &arguments.limits.limits())?;
    write(path, &bytes, &given)
}

/// Puts the set together.
fn set(arguments: &StepArguments) -> Result<(), Failure> {
    let Some(out) = &arguments.out else { return Err(Failure::Usage("a set needs --out DIR".to_owned())) };
    let presets = find_presets(std::slice::from_ref(&arguments.preset))?;
    let options = BuildOptions { limits: arguments.limits.limits(), ..BuildOptions::new(out) };
    let builder = Builder::of_parts(options, &given(arguments)?).map_err(|e| Failure::Other(e.to_string()))?;
    let meter = Meter::new(MessageFormat::Text);
    let result = builder.build(&presets, &|progress| meter.take(&progress));
    meter.finish();
    result.map(drop).map_err(Failure::from)
}

/// The parts that were given; `@FILE` is a file with a part a line, which may be quoted as Ninja does.
fn given(arguments: &StepArguments) -> Result<Vec<PathBuf>, Failure> {
    let mut parts = Vec::new();
    for part in &arguments.given {
        match part.to_str().and_then(|part| part.strip_prefix('@')) {
            None => parts.push(part.clone()),
            Some(list) => {
                let text = fs::read_to_string(list);
                let text = text.map_err(|e| Failure::Other(format!("can't read {list} (--given): {e}")))?;
                parts.extend(text.lines().filter(|line| !line.is_empty()).map(|line| PathBuf::from(unquoted(line))));
            }
        }
    }
    Ok(parts)
}

/// A path without the quotes of a shell around it.
fn unquoted(line: &str) -> String {
    let inside = |quote: char| line.strip_prefix(quote).and_then(|line| line.strip_suffix(quote));
    match (inside('\''), inside('"')) {
        (Some(inside), _) => inside.replace("'\\''", "'"),
        (None, Some(inside)) => inside.to_owned(),
        (None, None) => line.to_owned(),
    }
}

/// Writes a file, and the folder that it is to be in.
fn write(path: &Path, bytes: &[u8], given: &[PathBuf]) -> Result<(), Failure> {
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    made.map_err(|e| Failure::Other(format!("can't write {}: {e}", path.display())))?;
    write_over(path, bytes, Kind::Part, given)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_read_as_ninja_quotes_them() {
        assert_eq!(
            ["a.part", "'a b.part'", r"'a'\''b'", "\"a b\""].map(unquoted),
            ["a.part", "a b.part", "a'b", "a b"]
        );
    }
}
