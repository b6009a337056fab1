//! `treewright cache`: what a cache holds, and emptying it.

use std::fmt::Write;

use super::args::{CacheAction, CacheArguments, CacheFolder};
use super::report::{Failure, print};
use crate::base::counted;
use crate::build::{CacheError, CacheOptions, CacheStats, cache_stats, clear_cache};

/// Tells or empties.
pub(super) fn run(arguments: &CacheArguments) -> Result<(), Failure> {
    let other = |error: CacheError| Failure::Other(error.to_string());
    match &arguments.action {
        CacheAction::Stats { cache, json } => {
            let options = named(cache)?;
            let stats = cache_stats(&options.folder).map_err(other)?;
            if *json {
                let text = serde_json::to_string_pretty(&stats).map_err(|e| Failure::Other(e.to_string()))?;
                return print(&(text + "\n"));
            }
            print(&told(&options, &stats))
        }
        CacheAction::Clear { cache } => {
            let options = named(cache)?;
            let removed = clear_cache(&options.folder).map_err(other)?;
            let (entries, bytes) = (removed.entries, removed.bytes);
            let entries = counted(entries as usize, "entry", "entries");
            print(&format!("{}: removed {entries}, {}\n", options.folder.display(), size(bytes)))
        }
    }
}

fn named(cache: &CacheFolder) -> Result<CacheOptions, Failure> {
    let none = || Failure::Usage("which cache? Give --cache DIR, or set TREEWRIGHT_CACHE".to_owned());
    cache.options().ok_or_else(none)
}

fn told(options: &CacheOptions, stats: &CacheStats) -> String {
    let (folder, limit) = (options.folder.display(), size(options.limit));
    let entries = counted(stats.entries as usize, "entry", "entries");
    let mut text = format!("{folder}: {entries}, {} of at most {limit}\n", size(stats.bytes));
    for (stage, entries, bytes) in &stats.stages {
        // Writing to a string never fails.
        let _ = writeln!(text, "  {stage:<10} {entries:>7} entries {:>10}", size(*bytes));
    }
    text
}

/// Bytes for people.
fn size(bytes: u64) -> String {
    match bytes {
        0..=9_999 => format!("{bytes} B"),
        10_000..=9_999_999 => format!("{} KiB", bytes >> 10),
        10_000_000..=9_999_999_999 => format!("{} MiB", bytes >> 20),
        _ => format!("{} GiB", bytes >> 30),
    }
}
