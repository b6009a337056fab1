//! `treewright build` and `treewright check`.

use std::path::{Path, PathBuf};

use super::args::{BuildArguments, CheckArguments};
use super::over::{Kind, may_replace, write_over};
use super::report::{Failure, Meter, print};
use crate::base::counted;
use crate::build::{BuildOptions, Builder, Outcome, SetState, SetStatus, depfile, draw_specimens, find_presets};

/// Builds every preset that was named.
pub(super) fn run(arguments: &BuildArguments) -> Result<(), Failure> {
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
        return Err(Failure::Usage(why.to_owned()));
    }
    if let Some(path) = &arguments.depfile {
        may_replace(path, Kind::Depfile)?;
    }
    let presets = find_presets(&arguments.presets)?;
    let meter = Meter::new(arguments.message_format);
    let builder = Builder::new(options);
    let folders: Vec<PathBuf> = arguments.presets.iter().filter(|path| path.is_dir()).cloned().collect();
    let orphans = || builder.orphans(&folders, &presets);
    if arguments.check || arguments.dry_run {
        return match builder.status(&presets) {
            Ok(status) => tell(arguments, &meter, &[status, orphans()].concat()),
            Err(error) => {
                // Of the good ones, as of the sets that a build would go on with.
                let good = presets
                    .iter()
                    .filter(|_| arguments.keep_going)
                    .filter_map(|preset| builder.status(std::slice::from_ref(preset)).ok());
                good.flatten().for_each(|set| meter.status(&set, arguments.force));
                Err(error.into())
            }
        };
    }
    let result = builder.build(&presets, &|progress| meter.take(&progress));
    meter.finish();
    let shows = (result.is_ok() || arguments.keep_going) && arguments.shard.is_none();
    let shown = if shows { show(arguments, (&folders, &presets), &builder) } else { Ok(()) };
    orphans().iter().for_each(|set| meter.status(set, false));
    let built = match &result {
        Ok(outcomes) => Some(outcomes),
        Err(error) => arguments.keep_going.then_some(&error.built),
    };
    let listed = match (&arguments.depfile, built) {
        (Some(path), Some(outcomes)) => list(path, outcomes, &arguments.out),
        _ => Ok(()),
    };
    let outcomes = result?;
    shown.and(listed)?;
    meter.end(outcomes.len());
    Ok(())
}

/// Writes which files each set was made from.
fn list(path: &Path, outcomes: &[Outcome], out: &Path) -> Result<(), Failure> {
    let names = outcomes.iter().flat_map(|outcome| outcome.reads.keys().map(PathBuf::as_path)).chain([out]);
    let breaks = |name: &&Path| name.as_os_str().as_encoded_bytes().iter().any(|byte| matches!(byte, b'\n' | b'\r'));
    if let Some(name) = names.into_iter().find(breaks) {
        let why = "no depfile can name a path with a line break in it; give it another name";
        return Err(Failure::Other(format!("can't write {}: {}: {why}", path.display(), name.display())));
    }
    write_over(path, &depfile(outcomes, out), Kind::Depfile, &[])
}

/// Of a folder of presets there is a page that shows them all and its species.
fn show(
    arguments: &BuildArguments,
    (folders, presets): (&[PathBuf], &[PathBuf]),
    builder: &Builder,
) -> Result<(), Failure> {
    // Where nothing was built, there is nothing to show.
    if folders.is_empty() || !arguments.out.is_dir() {
        return Ok(());
    }
    let refused = |found| Failure::Diagnostics(vec![found]);
    for folder in folders {
        draw_specimens(folder, &arguments.out, &arguments.limits.limits(), &builder.cache()).map_err(refused)?;
    }
    builder.gallery(presets).map(drop).map_err(refused)
}

/// Tells what a build would do, or what is not as it should be.
fn tell(arguments: &BuildArguments, meter: &Meter, status: &[SetStatus]) -> Result<(), Failure> {
    for set in status {
        meter.status(set, arguments.force);
    }
    // A build leaves sets alone whose preset is gone: nothing that it could make is missing.
    let due = |set: &&SetStatus| match set.state {
        SetState::Orphaned { .. } => false,
        SetState::Current => arguments.force,
        _ => true,
    };
    let wrong = status.iter().filter(due).count();
    if arguments.check && wrong > 0 {
        let sets = counted(wrong, "set is", "sets are");
        return Err(Failure::Other(format!("{sets} not what the presets make; `treewright build` makes them")));
    }
    meter.end(status.len());
    Ok(())
}

/// Reads every preset that was named and what it names, and reports all errors.
pub(super) fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let good = crate::build::check(&find_presets(&arguments.presets)?, &arguments.limits.limits())?;
    print(&format!("{} good\n", counted(good, "preset is", "presets are")))
}
