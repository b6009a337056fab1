//! Real plants and the shipped species side by side: branching angle, length ratio and radius ratio by order,
//! bifurcation ratio and Murray's exponent, each as its median and the range from 10 to 90 %.
//!
//! `cargo run --release --example plausibility -- [SEEDS] [--like]`. Measured plants are marked with *, others were made by
//! programs and only stand beside. A species whose median of a trait lies outside of what the measured plants span (from
//! the lowest lower quartile to the highest upper quartile) is told with the reason that stands in its file behind
//! "Unlike the measured trees", or flagged. With `--like` also how near trees come that are grown like each plant.

#![expect(clippy::print_stdout, reason = "a program that prints")]

use std::path::{Path, PathBuf};

use treewright::base::Seed;
use treewright::plant::{Distribution, Habit, Plant, Span, Trait};
use treewright::preset::plan::{GrowParams, ImportParams};
use treewright::preset::species;
use treewright::source::estimate::estimate;
use treewright::source::grow::grow;
use treewright::source::import::import;

/// What the names of measured plants' files start with.
const REAL: [&str; 4] = ["itsme_", "rtwig_", "mtg_", "plantgeom_"];
/// What a species says that is not like measured trees; the reason follows.
const REASON: &str = "Unlike the measured trees";

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let seeds = words.iter().find_map(|w| w.parse().ok()).unwrap_or(3);
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let data = std::env::var_os("TREEWRIGHT_DATA").map_or_else(|| root.join("../shared/data"), PathBuf::from);
    let plants = plants(&data.join("skeleton"));
    if plants.is_empty() {
        println!("no skeletons below {}; set TREEWRIGHT_DATA", data.display());
        return;
    }
    let is_real = |name: &str| REAL.iter().any(|real| name.starts_with(real));
    let habits: Vec<(String, Habit)> = plants.iter().map(|(name, plant)| (name.clone(), Habit::of(plant))).collect();
    let real: Vec<Habit> = habits.iter().filter(|(name, _)| is_real(name)).map(|(_, habit)| habit.clone()).collect();
    let span = Span::of(&real);
    let mut rows: Vec<(String, Habit)> = Vec::new();
    for (name, habit) in habits {
        rows.push((if is_real(&name) { format!("* {name}") } else { format!("  {name}") }, habit));
    }
    let mut verdicts = Vec::new();
    for file in files(&root.join("presets/species"), &["ron"]) {
        let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        match grown(&name, &text, seeds) {
            Ok(habit) => {
                verdicts.push(verdict(&name, &text, &habit, &span));
                rows.push((format!("  {name}"), habit));
            }
            Err(why) => verdicts.push(format!("{name}: not grown: {why}")),
        }
    }
    table(&rows, &span);
    println!("\nSpecies, {seeds} seeds each, against the span of {} measured plants:", real.len());
    verdicts.iter().for_each(|verdict| println!("  {verdict}"));
    if words.iter().any(|w| w == "--like") {
        likeness(&plants);
    }
}

/// One block a trait: a line a plant.
fn table(rows: &[(String, Habit)], span: &Span) {
    let traits = rows[0].1.traits();
    for (i, of) in traits.iter().enumerate() {
        let range = span.ranges[i].map_or_else(|| "-".to_owned(), |[low, high]| format!("{low:.2} to {high:.2}"));
        println!("\n{}; the measured ones span {range}", label(of));
        for (name, habit) in rows {
            let d = Distribution::of(habit.traits()[i].values.clone());
            match d.count {
                0 => println!("  {name:<36} -"),
                1 => println!("  {name:<36} {:>7.2}", d.median),
                n => println!("  {name:<36} {:>7.2}  [{:.2} .. {:.2}]  of {n}", d.median, d.low, d.high),
            }
        }
    }
}

fn label(of: &Trait) -> String {
    match of.order {
        0 => of.name.to_owned(),
        4 => format!("{}, order 4 and above", of.name),
        order => format!("{}, order {order}", of.name),
    }
}

fn verdict(name: &str, text: &str, habit: &Habit, span: &Span) -> String {
    let outside = habit.outside(span);
    if outside.is_empty() {
        return format!("{name}: within");
    }
    let told: Vec<String> = outside
        .iter()
        .map(|(of, median)| {
            let range = habit.traits().iter().zip(&span.ranges).find(|(t, _)| t == of).and_then(|(_, range)| *range);
            let [low, high] = range.unwrap_or_default();
            format!("{} {median:.2}, not {low:.2} to {high:.2}", label(of))
        })
        .collect();
    let reason = reason(text).map_or_else(|| "UNEXPLAINED".to_owned(), |reason| format!("its file says: {reason}"));
    format!("{name}: {}; {reason}", told.join("; "))
}

/// The sentence behind [`REASON`] in a file's comments.
fn reason(text: &str) -> Option<String> {
    let comments: Vec<&str> = text.lines().filter_map(|line| line.trim().strip_prefix("//")).map(str::trim).collect();
    let comments = comments.join(" ");
    let (_, reason) = comments.split_once(REASON)?;
    Some(reason.trim_start_matches([':', ',', ' ']).split(". ").next().unwrap_or_default().to_owned())
}

/// Distances of trees grown like each plant, and of a birch and an oak.
fn likeness(plants: &[(String, Plant)]) {
    println!("\nDistance of habits, 0 to 1: five trees grown like the plant, and shipped species");
    for (name, plant) in plants {
        let habit = Habit::of(plant);
        let mean = |params: &GrowParams| {
            let distances: Vec<f32> = (100..105)
                .filter_map(|seed| {
                    let params = GrowParams { seed, ..params.clone() };
                    let (plant, _) = grow(&params, Seed::new(seed).child("grow")).ok()?;
                    Some(habit.distance(&Habit::of(&plant)))
                })
                .collect();
            distances.iter().sum::<f32>() / distances.len().max(1) as f32
        };
        match estimate(plant) {
            Err(error) => println!("  {name}: {error}"),
            Ok(estimate) => {
                let others: Vec<String> = ["birch", "oak"]
                    .iter()
                    .filter_map(|other| {
                        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("presets/species/{other}.ron"));
                        let mut params = species(other, &std::fs::read_to_string(file).ok()?).ok()?;
                        params.nodes = 20_000;
                        Some(format!("{other} {:.3}", mean(&params)))
                    })
                    .collect();
                println!("  {name}: {:.3}; {}", mean(&estimate.params), others.join(", "));
            }
        }
    }
}

fn grown(name: &str, text: &str, seeds: u64) -> Result<Habit, String> {
    let params = species(name, text).map_err(|errors| format!("{} errors", errors.len()))?;
    let mut habits = Vec::new();
    for seed in 1..=seeds.max(1) {
        let params = GrowParams { seed, ..params.clone() };
        let (plant, _) = grow(&params, Seed::new(seed).child("grow")).map_err(|error| error.to_string())?;
        habits.push(Habit::of(&plant));
    }
    let mut all = habits.swap_remove(0);
    habits.iter().for_each(|habit| all.add(habit));
    Ok(all)
}

fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).map(|entries| entries.flatten().map(|entry| entry.path()).collect());
    let mut files: Vec<PathBuf> = entries.unwrap_or_default();
    files.retain(|file| file.extension().is_some_and(|e| extensions.iter().any(|x| e == *x)));
    files.sort();
    files
}

fn plants(folder: &Path) -> Vec<(String, Plant)> {
    let params = ImportParams::default();
    files(folder, &["csv", "txt", "swc"])
        .into_iter()
        .filter_map(|file| {
            let name = file.file_name()?.to_string_lossy().into_owned();
            Some((name.clone(), import(&std::fs::read(&file).ok()?, &name, &params).ok()?.plant))
        })
        .collect()
}
