//! `treewright plan` and `treewright step`: a build as a graph of commands, and one of them.

use std::fs;
use std::path::Path;

use super::args::{MessageFormat, PlanArguments, PlanFormat, StepArguments, StepOf};
use super::report::{Failure, Meter, print};
use crate::build::{self, BuildOptions, Builder, Shard, Share, find_presets, make_part, ninja};

/// Prints the graph.
pub(super) fn run(arguments: &PlanArguments) -> Result<(), Failure> {
    let presets = find_presets(&arguments.presets)?;
    let steps = build::plan(&presets, &arguments.out, &arguments.parts)?;
    match arguments.format {
        PlanFormat::Ninja => print(&ninja(&steps, &arguments.program)),
        PlanFormat::Json => {
            let text = serde_json::to_string_pretty(&serde_json::json!({ "commands": steps }));
            print(&(text.map_err(|e| Failure::Other(e.to_string()))? + "\n"))
        }
    }
}

/// Runs one step.
pub(super) fn step(arguments: &StepArguments) -> Result<(), Failure> {
    let wrong = |message: &str| Err(Failure::Other(message.to_owned()));
    let share = match (arguments.what, arguments.place) {
        (StepOf::Sources, None) => Share::Sources,
        // The only tree of its share: every so manieth, counted from its place, is beyond any set.
        (StepOf::Tree, Some(place)) => Share::Trees(Shard { index: place - 1, of: u32::MAX }),
        (StepOf::Atlas, None) => Share::Atlas,
        (StepOf::Set, None) => return set(arguments),
        _ => return wrong("--place goes with the step `tree` and with no other"),
    };
    let Some(path) = &arguments.part else { return wrong("this step writes a part: give --part FILE") };
    let bytes = make_part(&arguments.preset, share, &arguments.given)?;
    write(path, &bytes).map_err(|e| Failure::Other(format!("can't write {}: {e}", path.display())))
}

/// Puts the set together.
fn set(arguments: &StepArguments) -> Result<(), Failure> {
    let Some(out) = &arguments.out else { return Err(Failure::Other("a set needs --out DIR".to_owned())) };
    let presets = find_presets(std::slice::from_ref(&arguments.preset))?;
    let builder =
        Builder::of_parts(BuildOptions::new(out), &arguments.given).map_err(|e| Failure::Other(e.to_string()))?;
    let meter = Meter::new(MessageFormat::Text);
    let result = builder.build(&presets, &|progress| meter.take(&progress));
    meter.finish();
    result.map(drop).map_err(Failure::from)
}

/// Writes a file whole or not at all, and not at all when it holds these bytes.
fn write(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    if fs::read(path).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}.new", std::process::id()));
    let written = fs::write(&name, bytes).and_then(|()| fs::rename(&name, path));
    if written.is_err() {
        let _ = fs::remove_file(&name);
    }
    written
}
