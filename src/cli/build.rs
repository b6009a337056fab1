//! `treewright build` and `treewright check`.

use std::fs;

use super::args::{BuildArguments, CheckArguments};
use super::report::{Failure, Meter, print};
use crate::build::{
    BuildOptions, Builder, GALLERY, Happened, SetState, SetStatus, depfile, draw_specimens, find_presets, gallery,
};

/// Builds every preset that was named.
pub(super) fn run(arguments: &BuildArguments) -> Result<(), Failure> {
    if let Some(jobs) = arguments.jobs {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(jobs))
            .build_global()
            .map_err(|e| Failure::Other(e.to_string()))?;
    }
    let options = BuildOptions {
        cache: arguments.cache.options(),
        force: arguments.force,
        keep_going: arguments.keep_going,
        shard: arguments.shard,
        limits: arguments.limits.limits(),
        ..BuildOptions::new(&arguments.out)
    };
    if options.shard.is_some() && options.cache.is_none() {
        let why = "--shard needs a cache that all shards share: give --cache DIR, or set TREEWRIGHT_CACHE";
        return Err(Failure::Other(why.to_owned()));
    }
    let presets = find_presets(&arguments.presets)?;
    let meter = Meter::new(arguments.message_format);
    let builder = Builder::new(options);
    if arguments.check || arguments.dry_run {
        let status = builder.status(&presets)?;
        return tell(arguments, &meter, &status);
    }
    let result = builder.build(&presets, &|progress| meter.take(&progress));
    meter.finish();
    let outcomes = result?;
    // Of a folder of presets there is a page that shows them all and its species; it is written when one of them changed.
    let folders = arguments.presets.iter().filter(|path| path.is_dir());
    let folders: Vec<_> = if arguments.shard.is_none() { folders.collect() } else { Vec::new() };
    if !folders.is_empty() {
        let page = arguments.out.join(GALLERY);
        let refused = |e| Failure::Other(format!("can't write {}: {e}", page.display()));
        let mut changed = !page.exists() || outcomes.iter().any(|outcome| outcome.happened == Happened::Built);
        for folder in folders {
            let limits = arguments.limits.limits();
            changed |= draw_specimens(folder, &arguments.out, &limits, &builder.cache()).map_err(refused)?;
        }
        if changed {
            gallery(&arguments.out, &presets).map_err(refused)?;
        }
    }
    if let Some(path) = &arguments.depfile {
        fs::write(path, depfile(&outcomes, &arguments.out))
            .map_err(|e| Failure::Other(format!("can't write {}: {e}", path.display())))?;
    }
    meter.end(outcomes.len());
    Ok(())
}

/// Tells what a build would do, or what is not as it should be.
fn tell(arguments: &BuildArguments, meter: &Meter, status: &[SetStatus]) -> Result<(), Failure> {
    for set in status {
        meter.status(set);
    }
    let wrong = status.iter().filter(|set| set.state != SetState::Current || arguments.force).count();
    if arguments.check && wrong > 0 {
        let sets = if wrong == 1 { "set is" } else { "sets are" };
        return Err(Failure::Other(format!("{wrong} {sets} not what the presets make; `treewright build` makes them")));
    }
    meter.end(status.len());
    Ok(())
}

/// Reads every preset that was named and what it names, and reports all errors.
pub(super) fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let good = crate::build::check(&find_presets(&arguments.presets)?)?;
    print(&format!("{good} preset{} good\n", if good == 1 { " is" } else { "s are" }))
}
