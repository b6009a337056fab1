//! `treewright estimate`: a species file that grows plants like a scan, for a designer to edit.
//!
//! What `Grow(like: …)` does inside of a build, written down. Goes to standard output unless a file is named; an existing
//! file is never overwritten.

use super::args::EstimateArguments;
use super::inspect::read_file;
use super::over::{may_make, write_new};
use super::report::{Failure, Meter, print};
use crate::base::Diagnostic;
use crate::source::estimate::estimate;

/// Estimates one file.
pub(super) fn run(arguments: &EstimateArguments) -> Result<(), Failure> {
    if let Some(path) = &arguments.out {
        may_make(path)?;
    }
    let (file, plant) = read_file(&arguments.file, 1, &arguments.limits.limits())?;
    let estimate = estimate(&plant).map_err(|e| {
        let hint = "it needs a tree with a trunk and branches";
        Failure::Diagnostics(vec![Diagnostic::new(&file, format!("can't be grown like: {e}")).with_hint(hint)])
    })?;
    let text = format!(
        "// `treewright estimate {file}`. Trees grown by it lie {:.2} from the plant, 0 alike to 1 nothing in common.\n{}",
        estimate.distance, estimate.text
    );
    match &arguments.out {
        None => print(&text),
        Some(path) => {
            write_new(path, &text)?;
            Meter::plain().line(&format!("wrote {}", path.display()));
            Ok(())
        }
    }
}
