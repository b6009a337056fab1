//! `treewright watch`.

use super::args::WatchArguments;
use super::report::{Failure, Meter, failure};
use crate::watch::{Event, Next, Watcher};

/// Watches until the process is interrupted.
pub(super) fn run(arguments: &WatchArguments) -> Result<(), Failure> {
    if !arguments.folder.is_dir() {
        return Err(Failure::Other(format!("{} is not a folder", arguments.folder.display())));
    }
    let mut watcher = Watcher::new(&arguments.folder, &arguments.out, arguments.cache.options())
        .map_err(|error| Failure::Other(error.to_string()))?;
    let meter = Meter::plain();
    watcher.run(&|event| {
        match event {
            Event::Build(progress) => meter.take(&progress),
            Event::Failed(error) => {
                failure(&Failure::from(error));
                meter.line("the old set stays");
            }
            Event::Idle { files } => meter.line(&format!("watching {files} files")),
        }
        Next::Watch
    });
    Ok(())
}
