//! `treewright watch`.

use std::time::Duration;

use super::args::WatchArguments;
use super::report::{Failure, Meter, failure};
use crate::base::counted;
use crate::build::Progress;
use crate::watch::{Event, Next, WatchOptions, Watcher};

/// Watches until the process is interrupted.
pub(super) fn run(arguments: &WatchArguments) -> Result<(), Failure> {
    if !arguments.folder.is_dir() {
        return Err(Failure::Other(format!("{} is not a folder", arguments.folder.display())));
    }
    let mut watcher = Watcher::new(WatchOptions {
        cache: arguments.cache.options(),
        limits: arguments.limits.limits(),
        poll: arguments.poll.map(|every| Duration::from_millis(every.into())),
        ..WatchOptions::new(&arguments.folder, &arguments.out)
    });
    let meter = Meter::plain();
    watcher.run(&|event| {
        tell(&meter, &event);
        Next::Watch
    });
    Ok(())
}

/// Tells people what a watcher does.
pub(super) fn tell(meter: &Meter, event: &Event<'_>) {
    match event {
        Event::Preset(_) => {}
        // Some sets take half a minute, and silence looks like a watcher that saw nothing.
        Event::Build(Progress::Steps(steps)) if *steps > 0 => {
            meter.line(&format!("building, {}", counted(*steps, "step", "steps")))
        }
        Event::Build(progress) => meter.take(progress),
        Event::Failed(error) => {
            failure(&Failure::Diagnostics(error.diagnostics.clone()));
            meter.line("the old set stays");
        }
        Event::Orphaned(status) => meter.status(status, false),
        Event::Unwritten(found) => failure(&Failure::Diagnostics(vec![found.clone()])),
        Event::Polling { every, why } => {
            let why = why.as_ref().map(|why| format!("{why}; ")).unwrap_or_default();
            meter.line(&format!("{why}the files are looked at every {} ms", every.as_millis()));
        }
        Event::Idle { files } => meter.line(&format!("watching {}", counted(*files, "file", "files"))),
    }
}
