//! The arguments.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Turns a few source trees and a preset into a set of engine-ready tree variants.
#[derive(Debug, Parser)]
#[command(name = "treewright", version, max_term_width = 100)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Builds presets into sets of assets.
    Build(BuildArguments),
    /// Reads presets and what they name, and reports every error, without building.
    Check(CheckArguments),
    /// Writes a species file that grows plants like a scan or skeleton.
    Estimate(EstimateArguments),
    /// Tells what a plant, a source or an asset holds.
    Inspect(InspectArguments),
    /// Starts a preset of your own, with its species file, every line explained.
    New(NewArguments),
    /// Prints every field of presets and species, with range, unit and default, as Markdown.
    Schema,
    /// Builds, then rebuilds the sets that a saved file touches, until interrupted.
    Watch(WatchArguments),
}

#[derive(Debug, Args)]
pub(super) struct BuildArguments {
    /// Preset files, or folders whose *.ron files are presets (folders inside them are not searched).
    #[arg(required = true, value_name = "PRESET|DIR")]
    pub(super) presets: Vec<PathBuf>,
    /// The folder that the sets are written to, each into a folder of its own name.
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Builds sets also when nothing that they depend on has changed.
    #[arg(long)]
    pub(super) force: bool,
    /// How many threads to use; all cores unless RAYON_NUM_THREADS says otherwise.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) jobs: Option<u16>,
}

#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// Preset files, or folders whose *.ron files are presets.
    #[arg(required = true, value_name = "PRESET|DIR")]
    pub(super) presets: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct EstimateArguments {
    /// The plant to grow like: a scan or skeleton, a plant dump or a species file.
    pub(super) file: PathBuf,
    /// The species file that is written; without it the text goes to standard output.
    #[arg(short, long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct InspectArguments {
    /// A scan or skeleton (TreeQSM CSV or text, SWC, …), a plant dump, a species file or a GLB.
    pub(super) file: PathBuf,
    /// Prints JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Also writes the plant as readable RON.
    #[arg(long, value_name = "FILE")]
    pub(super) dump: Option<PathBuf>,
    /// Seed that a species file is grown with.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// A second plant: tells what the trunk bears while the first turns into it.
    #[arg(long, value_name = "FILE")]
    pub(super) morph_to: Option<PathBuf>,
    /// Also plots that as SVG.
    #[arg(long, value_name = "FILE", requires = "morph_to")]
    pub(super) plot: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct NewArguments {
    /// Name of the set: letters, digits, _ and -.
    pub(super) name: String,
    /// The folder that gets NAME.ron and species/NAME.ron.
    #[arg(long, value_name = "DIR", default_value = "presets")]
    pub(super) folder: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct WatchArguments {
    /// The folder whose *.ron files are presets.
    pub(super) folder: PathBuf,
    /// The folder that the sets are written to.
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
}
