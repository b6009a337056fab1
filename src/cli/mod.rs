//! The command line: what is asked, what is said, and the exit code.
//!
//! Exit codes: 0 done, 1 a preset, an input or the output folder is wrong, 2 wrong usage. Progress goes to standard
//! error, as bars on a terminal and as plain lines elsewhere; results go to standard output.

mod args;
mod build;
mod cache;
mod distance;
mod estimate;
mod inspect;
mod messages;
mod new;
mod over;
mod plan;
#[cfg(feature = "preview")]
mod preview;
mod report;
mod watch;

use std::process::ExitCode;

use clap::Parser;

use args::{Arguments, Command};

/// Runs the command line of this process.
#[must_use]
pub fn run() -> ExitCode {
    // clap ends the process with 2 on wrong usage, with 0 on --help and --version.
    let arguments = Arguments::parse();
    let mut json = false;
    if let Command::Build(build) = &arguments.command {
        json = build.message_format == args::MessageFormat::Json;
    }
    let result = arguments.command.start_threads().and_then(|()| match arguments.command {
        Command::Build(build) => build::run(&build),
        Command::Cache(cache) => cache::run(&cache),
        Command::Check(check) => build::check(&check),
        Command::Distance(distance) => distance::run(&distance),
        Command::Estimate(estimate) => estimate::run(&estimate),
        Command::Inspect(inspect) => inspect::run(&inspect),
        Command::New(new) => new::run(&new),
        Command::Plan(plan) => plan::run(&plan),
        #[cfg(feature = "preview")]
        Command::Preview(preview) => preview::run(&preview),
        Command::Step(step) => plan::step(&step),
        Command::Schema(schema) => match schema.of {
            args::SchemaOf::Presets => report::print(&crate::preset::describe()),
            args::SchemaOf::Json => report::print(&crate::preset::describe_json()),
            args::SchemaOf::Messages => report::print(messages::DESCRIBED),
        },
        Command::Watch(watch) => watch::run(&watch),
    });
    let code = match &result {
        Ok(()) => 0,
        Err(report::Failure::Usage(_)) => 2,
        Err(_) => 1,
    };
    match &result {
        Ok(()) => {}
        Err(failure) if json => messages::failure(failure),
        Err(failure) => report::failure(failure),
    }
    match messages::lost() {
        Some(why) => {
            report::failure(&report::Failure::Other(why.clone()));
            ExitCode::from(code.max(1))
        }
        None => ExitCode::from(code),
    }
}
