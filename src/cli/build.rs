//! `treewright build` and `treewright check`.

use super::args::{BuildArguments, CheckArguments};
use super::report::{Failure, Meter};
use crate::build::{BuildOptions, Builder, find_presets};

/// Builds every preset that was named; a set that fails does not keep the others from being built.
pub(super) fn run(arguments: &BuildArguments) -> Result<(), Failure> {
    if let Some(jobs) = arguments.jobs {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(jobs))
            .build_global()
            .map_err(|e| Failure::Other(e.to_string()))?;
    }
    let presets = find_presets(&arguments.presets)?;
    let meter = Meter::new();
    let builder = Builder::new(BuildOptions { out: arguments.out.clone(), cache: None, force: arguments.force });
    let result = builder.build(&presets, &|progress| meter.take(&progress));
    meter.finish();
    result.map(drop).map_err(Failure::from)
}

/// Reads every preset that was named and what it names, and reports all errors.
pub(super) fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let good = crate::build::check(&find_presets(&arguments.presets)?)?;
    Meter::plain().line(&format!("{good} preset{} good", if good == 1 { " is" } else { "s are" }));
    Ok(())
}
