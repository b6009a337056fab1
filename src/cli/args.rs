//! The arguments.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use super::report::Failure;
use crate::build::{CacheOptions, Limits, Shard};
use crate::preset::plan::ElasticParams;

/// Turns a few source trees and a preset into a set of engine-ready tree variants.
#[derive(Debug, Parser)]
#[command(name = "treewright", version, max_term_width = 100, after_help = CODES)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Builds presets into sets of assets.
    #[command(after_long_help = LIMITS)]
    Build(BuildArguments),
    /// Tells what a cache holds, or empties it.
    Cache(CacheArguments),
    /// Reads presets and what they name, and reports every error, without building.
    Check(CheckArguments),
    /// Tells how far plants are from each other, and draws which are alike.
    Distance(DistanceArguments),
    /// Writes a species file that grows plants like a scan or skeleton.
    Estimate(EstimateArguments),
    /// Tells what a plant, a source or an asset holds.
    Inspect(InspectArguments),
    /// Starts a preset of your own, with its species file, every line explained.
    New(NewArguments),
    /// Writes a build as a graph of commands that share no folder, for Ninja, Bazel or a farm.
    Plan(PlanArguments),
    /// Shows the sets on a local page that follows every saved file: pictures, levels of detail, mixes, sketches.
    #[cfg(feature = "preview")]
    Preview(PreviewArguments),
    /// Prints every field of presets and species, with range, unit and default, as Markdown or JSON Schema.
    Schema(SchemaArguments),
    /// Runs one command of a `plan`.
    Step(StepArguments),
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
    #[command(flatten)]
    pub(super) jobs: Jobs,
    /// Builds what can be built when a preset is wrong; without, a wrong preset keeps all from being built.
    #[arg(short, long)]
    pub(super) keep_going: bool,
    /// Builds nothing; lists the sets that are not what the presets make, and ends with 1 if there are any. Sets whose preset is
    /// gone are told of, too; a build leaves those alone, and they are no reason to end with 1.
    #[arg(long, conflicts_with_all = ["force", "dry_run", "shard", "depfile"])]
    pub(super) check: bool,
    /// Builds and writes nothing; lists what would be built and why.
    #[arg(long, conflicts_with_all = ["shard", "depfile"])]
    pub(super) dry_run: bool,
    /// Writes which files each set was made from, in Makefile syntax, for Ninja, Make and CMake. The target of a set's
    /// rule is its manifest.
    #[arg(long, value_name = "FILE")]
    pub(super) depfile: Option<PathBuf>,
    /// Makes the Ith of N parts of all trees, into the cache only; when N processes have, a plain build with the same
    /// cache puts the sets together.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub(super) shard: Option<Shard>,
    #[command(flatten)]
    pub(super) cache: CacheFolder,
    #[command(flatten)]
    pub(super) limits: LimitArguments,
    /// What is said: text for people on standard error, or one JSON object a line on standard output, as
    /// `treewright schema messages` tells.
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = MessageFormat::Text)]
    pub(super) message_format: MessageFormat,
}

/// How much of the processor is taken.
#[derive(Debug, Args)]
pub(super) struct Jobs {
    /// How many threads to use; all cores unless RAYON_NUM_THREADS says otherwise.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

impl Command {
    /// Starts the threads that work is spread over, before anything runs on them: where the system has too few left, whoever first
    /// needs them would panic.
    pub(super) fn start_threads(&self) -> Result<(), Failure> {
        let jobs = match self {
            Self::Build(build) => build.jobs.jobs,
            Self::Watch(watch) => watch.jobs.jobs,
            #[cfg(feature = "preview")]
            Self::Preview(preview) => preview.jobs.jobs,
            _ => None,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.map_or(0, usize::from));
        let hint = if jobs.is_some() { "ask for fewer --jobs" } else { "set RAYON_NUM_THREADS to a smaller number" };
        pool.build_global().map_err(|e| Failure::Other(format!("the system gives no more threads ({e}): {hint}")))
    }
}

/// How a build speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum MessageFormat {
    Text,
    Json,
}

/// What may be read.
#[derive(Clone, Debug, Args)]
pub(super) struct ReadArguments {
    /// Largest file that is read; K, M, G mean 1024 each.
    #[arg(long, value_name = "SIZE", default_value = "1G", value_parser = size)]
    max_file: u64,
    /// Reads no file outside of this folder, wherever a preset's paths and links lead: for presets of strangers.
    #[arg(long, value_name = "DIR")]
    root: Option<PathBuf>,
}

impl ReadArguments {
    pub(super) fn limits(&self) -> Limits {
        Limits { file: self.max_file, root: self.root.clone(), ..Limits::default() }
    }
}

/// What may be taken of the machine.
#[derive(Debug, Args)]
pub(super) struct LimitArguments {
    #[command(flatten)]
    read: ReadArguments,
    /// Most bytes of finished stages that are kept in memory between steps and rebuilds.
    #[arg(long, value_name = "SIZE", default_value = "768M", value_parser = size)]
    max_memory: u64,
}

impl LimitArguments {
    pub(super) fn limits(&self) -> Limits {
        let memory = usize::try_from(self.max_memory).unwrap_or(usize::MAX);
        Limits { memory, ..self.read.limits() }
    }
}

/// What is limited, for `--help`.
const LIMITS: &str = "\
Limits: a preset or species is at most 4 MB of text with 100,000 values, nested at most 64 deep; a set has at most 64 \
sources, 4096 variants and 8 levels of detail; an atlas has at most 8192 x 8192 pixels; a path is relative and at most 512 \
letters long, a name at most 64; a mesh names no file above the preset's folder; numbers have the ranges that `treewright \
schema` tells. --root, --max-file, --max-memory, --cache-limit and --jobs bound what a build takes of the machine. Whatever is \
beyond a limit is an error that names it, within a second.

Exit codes: 0 done, 1 a preset, an input or the output folder is wrong, or with --check a set is not what its preset makes; \
2 wrong usage. A set is written whole or not at all; of its files those that somebody else wrote or marked read-only are \
never replaced.";
/// What a command ends with, for `--help`.
const CODES: &str = "Exit codes: 0 done, 1 a preset, an input or an output is wrong, 2 wrong usage.";

#[derive(Debug, Args)]
pub(super) struct CacheFolder {
    /// A folder that keeps what stages made, for later builds, other processes and machines; the environment variable
    /// TREEWRIGHT_CACHE names it as well.
    #[arg(id = "cache_folder", long = "cache", value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Most bytes that the cache may hold after a build: what was used longest ago goes first. K, M, G mean 1024 each.
    #[arg(id = "cache_limit", long = "cache-limit", value_name = "SIZE", default_value = "4G", value_parser = size)]
    limit: u64,
}

impl CacheFolder {
    /// The cache to use, if one was named.
    pub(super) fn options(&self) -> Option<CacheOptions> {
        let named = || std::env::var_os("TREEWRIGHT_CACHE").filter(|name| !name.is_empty()).map(PathBuf::from);
        let folder = self.folder.clone().or_else(named)?;
        Some(CacheOptions { folder, limit: self.limit })
    }
}

#[derive(Debug, Args)]
pub(super) struct CacheArguments {
    #[command(subcommand)]
    pub(super) action: CacheAction,
}

#[derive(Debug, Subcommand)]
pub(super) enum CacheAction {
    /// Entries and bytes by stage.
    Stats {
        #[command(flatten)]
        cache: CacheFolder,
        /// Prints JSON.
        #[arg(long)]
        json: bool,
    },
    /// Removes every entry; files that Treewright did not write stay.
    Clear {
        #[command(flatten)]
        cache: CacheFolder,
    },
}

#[derive(Debug, Args)]
pub(super) struct PlanArguments {
    /// Preset files, or folders whose *.ron files are presets.
    #[arg(required = true, value_name = "PRESET|DIR")]
    pub(super) presets: Vec<PathBuf>,
    /// The folder that the sets are written to.
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// The folder of the files that one command hands to another.
    #[arg(long, value_name = "DIR")]
    pub(super) parts: PathBuf,
    /// A build file for Ninja, or each command with its arguments, inputs and outputs as JSON.
    #[arg(long, value_enum, default_value_t = PlanFormat::Ninja)]
    pub(super) format: PlanFormat,
    /// What Ninja runs.
    #[arg(long, value_name = "COMMAND", default_value = "treewright")]
    pub(super) program: String,
    #[command(flatten)]
    pub(super) limits: ReadArguments,
}

/// How a plan is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum PlanFormat {
    Ninja,
    Json,
}

#[derive(Debug, Args)]
pub(super) struct StepArguments {
    /// What is made.
    #[arg(value_enum)]
    pub(super) what: StepOf,
    /// The preset.
    pub(super) preset: PathBuf,
    /// Which tree, from 1.
    #[arg(long, value_name = "N", required_if_eq("what", "tree"), value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) place: Option<u32>,
    /// Part files of earlier steps; `@FILE` is a file with one a line.
    #[arg(long, value_name = "FILE")]
    pub(super) given: Vec<PathBuf>,
    /// The part file to write; one that holds these bytes already is left alone.
    #[arg(long, value_name = "FILE", required_unless_present = "out", conflicts_with = "out")]
    pub(super) part: Option<PathBuf>,
    /// The folder that the set is written to.
    #[arg(long, value_name = "DIR", required_if_eq("what", "set"))]
    pub(super) out: Option<PathBuf>,
    #[command(flatten)]
    pub(super) limits: ReadArguments,
}

/// What a step makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum StepOf {
    /// Sources and pictures.
    Sources,
    /// One tree with its levels of detail.
    Tree,
    /// The textures of the set.
    Atlas,
    /// The files of the set.
    Set,
}

#[derive(Debug, Args)]
pub(super) struct SchemaArguments {
    /// What is described.
    #[arg(value_enum, default_value_t = SchemaOf::Presets)]
    pub(super) of: SchemaOf,
}

/// What a schema is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum SchemaOf {
    /// Every field of presets and species with range, unit and default, as Markdown.
    Presets,
    /// The same as JSON Schema, of the JSON form of RON: `Source("a")` is {"Source": "a"}.
    Json,
    /// The messages of `build --message-format json`, as Markdown.
    Messages,
}

/// Reads `2/8`: the second of eight.
fn shard(text: &str) -> Result<Shard, String> {
    let wrong = || "a shard is I/N: number I of N, as 1/4 to 4/4".to_owned();
    let (index, of) = text.split_once('/').ok_or_else(wrong)?;
    let number = |text: &str| text.parse::<u32>().ok().filter(|n| (1..=100_000).contains(n)).ok_or_else(wrong);
    let (index, of) = (number(index)?, number(of)?);
    if index > of { Err(wrong()) } else { Ok(Shard { index: index - 1, of }) }
}

/// Reads a number of bytes: `500M`, `4G`.
fn size(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let shift = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" | "B" => 0,
        "K" | "KB" | "KIB" => 10,
        "M" | "MB" | "MIB" => 20,
        "G" | "GB" | "GIB" => 30,
        "T" | "TB" | "TIB" => 40,
        _ => return Err("a size is a whole number with K, M, G or T, as 500M".to_owned()),
    };
    let number = digits.parse::<u64>().map_err(|_| "a size is a whole number with K, M, G or T, as 500M")?;
    number.checked_mul(1 << shift).ok_or_else(|| "that is too much".to_owned())
}

#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// Preset files, or folders whose *.ron files are presets.
    #[arg(required = true, value_name = "PRESET|DIR")]
    pub(super) presets: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) limits: ReadArguments,
}

#[derive(Debug, Args)]
pub(super) struct DistanceArguments {
    /// Scans, skeletons, meshes, plant dumps or species files; at least two.
    #[arg(required = true, num_args = 2.., value_name = "FILE")]
    pub(super) files: Vec<PathBuf>,
    /// What is measured.
    #[arg(long, value_enum, default_value_t = DistanceMetric::Qed)]
    pub(super) metric: DistanceMetric,
    /// Takes the least distance over all turns about the vertical.
    #[arg(long)]
    pub(super) turn: bool,
    /// Scales plants to one size first.
    #[arg(long)]
    pub(super) relative: bool,
    #[command(flatten)]
    pub(super) elastic: ElasticArguments,
    /// How the matrix is printed.
    #[arg(long, value_enum, default_value_t = DistanceFormat::Json)]
    pub(super) format: DistanceFormat,
    /// Also draws the dendrogram (single linkage) as SVG.
    #[arg(long, value_name = "FILE")]
    pub(super) dendrogram: Option<PathBuf>,
    /// Seed that species files are grown with.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    #[command(flatten)]
    pub(super) limits: ReadArguments,
}

/// Which branches are taken for the same, as `matching` of a preset's `Geodesic` says. Wang et al. (2018) have 0.1, 0 and 0.
#[derive(Debug, Args)]
pub(super) struct ElasticArguments {
    /// How far apart two branches may leave and still match, as a share of their parent: 0.001 to 1, 0.1 unless told.
    #[arg(long, value_name = "SHARE", value_parser = |text: &str| share(text, 0.001))]
    epsilon: Option<f64>,
    /// What opposite directions of two branches count against that: 0 to 1, 0.1 unless told; the paper has 0.
    #[arg(long, value_name = "SHARE", value_parser = |text: &str| share(text, 0.0))]
    direction: Option<f64>,
    /// What a branch of no length counts against a long one, likewise: 0.05 unless told; the paper has 0.
    #[arg(long, value_name = "SHARE", value_parser = |text: &str| share(text, 0.0))]
    length: Option<f64>,
}

impl ElasticArguments {
    /// Whether any of them was given.
    pub(super) const fn is_told(&self) -> bool {
        self.epsilon.is_some() || self.direction.is_some() || self.length.is_some()
    }

    /// What they say.
    pub(super) fn params(&self) -> ElasticParams {
        let usual = ElasticParams::default();
        let told = |given: Option<f64>, usual: f32| given.map_or(usual, |given| given as f32);
        ElasticParams {
            epsilon: told(self.epsilon, usual.epsilon),
            direction: told(self.direction, usual.direction),
            length: told(self.length, usual.length),
            ..usual
        }
    }
}

/// A share of something, not below the least.
fn share(text: &str, least: f64) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (least..=1.0).contains(share));
    share.ok_or_else(|| format!("it is a number from {least} to 1"))
}

/// A distance of plants.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum DistanceMetric {
    /// Quotient Euclidean distance of tree-shape space, metres.
    Qed,
    /// Its L1 variant, the tree edit distance, metres.
    Edit,
    /// The elastic metric, in which bending costs no length, metres.
    Elastic,
}

/// A distance of a plant and its reflection.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum SymmetryMetric {
    /// Quotient Euclidean distance of tree-shape space, as in the paper, metres.
    Qed,
    /// The elastic metric, in which bending costs no length, metres.
    Elastic,
}

/// A form of the matrix.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum DistanceFormat {
    /// Names, distances and merges.
    Json,
    /// Names and distances.
    Csv,
}

#[derive(Debug, Args)]
pub(super) struct EstimateArguments {
    /// The plant to grow like: a scan or skeleton, a plant dump or a species file.
    pub(super) file: PathBuf,
    /// The species file that is written; without it the text goes to standard output.
    #[arg(short, long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    #[command(flatten)]
    pub(super) limits: ReadArguments,
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
    /// Also tells how far the plant is from symmetric, and across which vertical plane.
    #[arg(long)]
    pub(super) symmetry: bool,
    /// What the way to the reflection is measured by.
    #[arg(long, value_enum, default_value_t = SymmetryMetric::Elastic, requires = "symmetry")]
    pub(super) metric: SymmetryMetric,
    #[command(flatten)]
    pub(super) elastic: ElasticArguments,
    /// A second plant: tells what the trunk bears while the first turns into it.
    #[arg(long, value_name = "FILE")]
    pub(super) morph_to: Option<PathBuf>,
    /// Also plots that as SVG.
    #[arg(long, value_name = "FILE", requires = "morph_to")]
    pub(super) plot: Option<PathBuf>,
    #[command(flatten)]
    pub(super) limits: ReadArguments,
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
    /// Looks at the files every so many milliseconds instead of asking the system for changes: for network drives and
    /// shared folders of virtual machines. Without it that is done, and said, when the system can't watch.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u32).range(10..=3_600_000))]
    pub(super) poll: Option<u32>,
    #[command(flatten)]
    pub(super) jobs: Jobs,
    #[command(flatten)]
    pub(super) cache: CacheFolder,
    #[command(flatten)]
    pub(super) limits: LimitArguments,
}

/// What `preview` takes.
#[cfg(feature = "preview")]
#[derive(Debug, Args)]
pub(super) struct PreviewArguments {
    /// The folder whose *.ron files are presets.
    pub(super) folder: PathBuf,
    /// The folder that the sets are written to.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(super) out: PathBuf,
    /// The port; 0 takes any that is free.
    #[arg(long, value_name = "N", default_value_t = 8750)]
    pub(super) port: u16,
    /// The address to listen at. Whoever can reach it can read the sets and change the presets: keep to the loopback
    /// unless you trust everybody in the network.
    #[arg(long, value_name = "IP", default_value = "127.0.0.1")]
    pub(super) listen: std::net::IpAddr,
    /// The folder of the package three.js, for the view in space; without it one is looked for in node_modules of the
    /// presets' folder, of the working folder and of those above them. TREEWRIGHT_THREE names it as well.
    #[arg(long, value_name = "DIR")]
    pub(super) three: Option<PathBuf>,
    /// Looks at the files every so many milliseconds instead of asking the system for changes.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u32).range(10..=3_600_000))]
    pub(super) poll: Option<u32>,
    #[command(flatten)]
    pub(super) jobs: Jobs,
    #[command(flatten)]
    pub(super) cache: CacheFolder,
    #[command(flatten)]
    pub(super) limits: LimitArguments,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_fit_each_other_and_shards_and_sizes_are_read() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
        assert_eq!(shard("2/8"), Ok(Shard { index: 1, of: 8 }));
        for wrong in ["0/4", "5/4", "1", "1/0", "a/b", "1/4/2", "-1/3", "1/9999999999"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
        assert_eq!(["17", "2k", "500M", "4GiB"].map(size), [Ok(17), Ok(2048), Ok(500 << 20), Ok(4 << 30)]);
        for wrong in ["", "G", "1.5G", "1X", "99999999999T"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
