//! Figures of plausibility: shipped species against real plants, and trees grown like a scan against the scan.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use treewright::base::Seed;
use treewright::plant::{Habit, Plant, Span};
use treewright::preset::plan::{GrowParams, ImportParams};
use treewright::preset::species;
use treewright::source::estimate::estimate;
use treewright::source::grow::{Solid, Solids, grow, grow_in, shape_files};
use treewright::source::import::import;

use crate::{Figure, data, root};

/// Files of measured plants; the others in the folder were made by programs.
const REAL: [&str; 4] = ["itsme_", "rtwig_", "mtg_", "plantgeom_"];
/// Trees grown like each scan.
const TREES: u64 = 10;

/// Prints them.
pub(crate) fn print() {
    let Some(data) = data() else {
        Figure::new("grow.plausible_species", 0.0, "species", "no data folder: nothing was measured").print();
        return;
    };
    let plants = real(&data.join("skeleton"));
    let habits: Vec<Habit> = plants.iter().map(|(_, plant)| Habit::of(plant)).collect();
    let span = Span::of(&habits);

    let all = files(&root().join("presets/species"), &["ron"]);
    let told: Vec<(String, bool, bool)> = all
        .par_iter()
        .filter_map(|file| {
            let text = std::fs::read_to_string(file).expect("the species can be read");
            let habit = grown(file, &species(&file.display().to_string(), &text).expect("the species is good"), 3)?;
            let name = file.file_stem()?.to_string_lossy().into_owned();
            Some((name, habit.outside(&span).is_empty(), text.contains("Unlike the measured trees")))
        })
        .collect();
    let within = told.iter().filter(|t| t.1).count();
    let explained = told.iter().filter(|t| t.1 || t.2).count();
    let silent: Vec<&str> = told.iter().filter(|t| !t.1 && !t.2).map(|t| t.0.as_str()).collect();
    let how = format!(
        "of {} species whose medians lie where {} measured plants do, 3 seeds; {explained} do or say why not",
        all.len(),
        plants.len()
    );
    Figure::new("grow.plausible_species", within as f64, "species", how).goal("all, or explained").print();
    Figure::new("grow.explained_species", explained as f64, "species", format!("of {}; not: {silent:?}", all.len()))
        .goal("all")
        .print();

    let rows: Vec<(f32, f32)> = plants.par_iter().filter_map(|(_, plant)| like(plant)).collect();
    let mean = |f: fn(&(f32, f32)) -> f32| rows.iter().map(|r| f64::from(f(r))).sum::<f64>() / rows.len().max(1) as f64;
    let how = format!(
        "distance of {TREES} trees grown like a scan over that of {TREES} birches and {TREES} oaks, mean {:.3} over {:.3} of {} scans",
        mean(|r| r.0),
        mean(|r| r.1),
        rows.len()
    );
    let ratio = mean(|r| r.0 / r.1.max(1e-6));
    Figure::new("grow.like_scan", ratio, "ratio", how).goal("< 0.7").print();
}

/// Mean distance of trees grown like a plant, and of trees of species that have nothing to do with it.
fn like(plant: &Plant) -> Option<(f32, f32)> {
    let habit = Habit::of(plant);
    let params = estimate(plant).ok()?.params;
    let near = mean_distance(&habit, &params)?;
    let mut far = Vec::new();
    for text in ["oak", "birch"] {
        let file = root().join(format!("presets/species/{text}.ron"));
        let text = std::fs::read_to_string(&file).expect("the species can be read");
        let mut params = species("other", &text).expect("the species is good");
        params.nodes = params.nodes.min(30_000);
        far.push(mean_distance(&habit, &params)?);
    }
    Some((near, far.iter().sum::<f32>() / far.len() as f32))
}

fn mean_distance(habit: &Habit, params: &GrowParams) -> Option<f32> {
    let distances: Vec<f32> = (100..100 + TREES)
        .into_par_iter()
        .filter_map(|seed| {
            let params = GrowParams { seed, ..params.clone() };
            let (grown, _) = grow(&params, Seed::new(seed).child("grow")).ok()?;
            Some(habit.distance(&Habit::of(&grown)))
        })
        .collect();
    (distances.len() as u64 == TREES).then(|| distances.iter().sum::<f32>() / TREES as f32)
}

/// The habit of several plants of a species; none where it can't be grown.
fn grown(file: &Path, params: &GrowParams, seeds: u64) -> Option<Habit> {
    let mut solids = Solids::new();
    for shape in shape_files(params) {
        let bytes = std::fs::read(file.with_file_name(&shape.file)).ok()?;
        let solid = Solid::read(&bytes, shape.reading).ok()?;
        solids.insert(shape, solid);
    }
    let mut habit: Option<Habit> = None;
    for seed in 1..=seeds {
        let params = GrowParams { seed, ..params.clone() };
        let (plant, _) = grow_in(&params, &solids, Seed::new(seed).child("grow")).ok()?;
        let next = Habit::of(&plant);
        match &mut habit {
            Some(habit) => habit.add(&next),
            None => habit = Some(next),
        }
    }
    habit
}

/// The files of a folder with one of some extensions, in order of name.
fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .map(|entries| entries.flatten().map(|entry| entry.path()).collect())
        .unwrap_or_default();
    files.retain(|file| file.extension().is_some_and(|e| extensions.iter().any(|x| e == *x)));
    files.sort();
    files
}

/// Name and plant of every skeleton in a folder that was measured on a real tree.
fn real(folder: &Path) -> Vec<(String, Plant)> {
    skeletons(folder).into_iter().filter(|(name, _)| REAL.iter().any(|real| name.starts_with(real))).collect()
}

/// Name and plant of every skeleton in a folder.
fn skeletons(folder: &Path) -> Vec<(String, Plant)> {
    let params = ImportParams::default();
    files(folder, &["csv", "txt", "swc"])
        .into_iter()
        .filter_map(|file| {
            let name = file.file_name()?.to_string_lossy().into_owned();
            let imported = import(&std::fs::read(&file).ok()?, &name, &params).ok()?;
            Some((name, imported.plant))
        })
        .collect()
}
