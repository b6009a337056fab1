//! The whole line: sets, imports, validity, sameness, the billboard cloud.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use treewright::base::Seed;
use treewright::blend::sample;
use treewright::build::pipeline::{make_set, read_inputs, set_key};
use treewright::build::{BuildOptions, Builder, Cache, SetFiles, find_presets, load_preset};
use treewright::plant::PlantStats;
use treewright::preset::plan::{ImportParams, MatchParams};
use treewright::relate::fuzzy_family;
use treewright::source::grow::grow;
use treewright::source::import::import;

use crate::{Figure, data, root, seconds};

pub(crate) fn print() {
    let scratch = root().join("target/figures");
    std::fs::create_dir_all(&scratch).expect("the target folder can be written");
    let shipped = find_presets(&[root().join("presets")]).expect("presets are shipped");
    let threads = rayon::current_num_threads();

    let time = seconds(3, || {
        let builder = Builder::new(BuildOptions { force: true, ..BuildOptions::new(scratch.join("sets")) });
        builder.build(&shipped, &|_| {}).expect("the shipped presets build");
    });
    let how = format!("{} sets, cold, written to disk, median of 3, {threads} threads", shipped.len());
    Figure::new("line.shipped_sets", time, "s", how).goal("< 20 s on 2 cores").print();

    let mut sets: Vec<PathBuf> = shipped.clone();
    if let Some(data) = data() {
        imports(&data.join("skeleton"));
        if std::env::var_os("TREEWRIGHT_DATA").is_none() {
            let scans = root().join("examples/scans.ron");
            sets.push(scans.clone());
            let time = seconds(3, || drop(made(&scans)));
            Figure::new(
                "line.scan_set",
                time,
                "s",
                "12 variants of two scans and an oak, cold, in memory, median of 3",
            )
            .print();
        }
    } else {
        Figure::new("line.import_files", 0.0, "files", "no data folder: nothing was measured").print();
    }

    blends();
    let made = sameness(&sets);
    continuity_and_cloud(&made);
    valid(&sets, &scratch);
}

/// One set's files, made from nothing.
fn made(preset: &Path) -> SetFiles {
    let loaded = load_preset(preset).expect("the preset is good");
    let inputs = read_inputs(&loaded).expect("its files are there");
    let key = set_key(&loaded.plan, &inputs);
    make_set(&loaded.plan, &inputs, key, &Cache::default(), &|_| {}).expect("it builds")
}

fn imports(folder: &Path) {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("the data folder can be read")
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "csv" || e == "txt" || e == "swc"))
        .collect();
    files.sort();
    let bytes: Vec<(String, Vec<u8>)> =
        files.iter().map(|f| (f.display().to_string(), std::fs::read(f).expect("it can be read"))).collect();
    let params = ImportParams { file: String::new(), ..ImportParams::default() };
    let all = || bytes.iter().map(|(name, bytes)| import(bytes, name, &params)).collect::<Vec<_>>();
    let results = all();
    let good = results.iter().filter(|r| r.is_ok()).count();
    Figure::new(
        "line.import_files",
        good as f64,
        "files",
        format!("imported of {} skeletons that are there", files.len()),
    )
    .goal("all")
    .print();
    let worst = results
        .iter()
        .flatten()
        .map(|imported| PlantStats::of(&imported.plant).topology_continuity)
        .fold(1.0_f32, f32::min);
    Figure::new(
        "line.import_continuity",
        f64::from(worst),
        "share",
        "worst topology continuity of the imported plants",
    )
    .goal("1.0")
    .print();
    let time = seconds(9, || drop(all()));
    Figure::new("line.import_time", time * 1e3 / files.len() as f64, "ms", "a file, mean over all, median of 9 rounds")
        .print();
}

/// The kernel on two oaks of the shipped species.
fn blends() {
    let text = std::fs::read_to_string(root().join("presets/species/oak.ron")).expect("the species is shipped");
    let mut params = treewright::preset::species("oak.ron", &text).expect("the species is good");
    let mut oak = |seed| {
        params.seed = seed;
        grow(&params, Seed::new(seed)).expect("it grows").0
    };
    let (a, b) = (oak(1), oak(2));
    let chains = a.chains().len().max(b.chains().len());
    let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
    let time = seconds(9, || drop(fuzzy_family(a.clone(), b.clone(), &matching)));
    let how = format!("two oaks of up to {chains} chains matched into a family, median of 9");
    Figure::new("line.match_time", time * 1e3, "ms", how).print();
    let family = fuzzy_family(a, b, &matching).expect("they match");
    let weights = sample(&family, 0, 1, Seed::new(3), 0.5);
    let time = seconds(49, || drop(family.blend(&weights)));
    let how = format!("trees a second on one thread, {chains} chains, half way, median of 49");
    Figure::new("line.blends", 1.0 / time, "1/s", how).goal("thousands").print();
}

/// The files of a set, by name.
type Files = Vec<(String, Arc<[u8]>)>;

/// Makes all sets on one and on two threads; gives back the files of the second.
fn sameness(sets: &[PathBuf]) -> Vec<Files> {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        pool.install(|| sets.iter().map(|set| made(set).files).collect::<Vec<_>>())
    };
    let (one, two) = (on(1), on(2));
    let pairs = || one.iter().flatten().zip(two.iter().flatten());
    let equal = pairs().filter(|(a, b)| a == b).count();
    let how = format!("of {} files made on 1 and on 2 threads", pairs().count());
    Figure::new("line.files_equal_at_1_and_2_threads", equal as f64, "files", how).goal("all").print();
    two
}

fn continuity_and_cloud(sets: &[Files]) {
    let mut continuity = 1.0_f64;
    let (mut ious, mut coverages) = (Vec::new(), Vec::new());
    let mut variants = 0;
    for files in sets {
        let (_, manifest) = files.last().expect("a set ends with its manifest");
        let manifest: serde_json::Value = serde_json::from_slice(manifest).expect("the manifest is JSON");
        for variant in manifest["variants"].as_array().into_iter().flatten() {
            variants += 1;
            continuity = continuity.min(variant["topology_continuity"].as_f64().unwrap_or(0.0));
            for level in variant["levels"].as_array().into_iter().flatten() {
                if level["kind"].as_str() == Some("BillboardCloud") {
                    ious.push(level["measured"]["iou_mean"].as_f64().unwrap_or(0.0));
                    coverages.push(level["measured"]["coverage"].as_f64().unwrap_or(0.0));
                }
            }
        }
    }
    let how = format!("worst of {variants} variants of {} sets", sets.len());
    Figure::new("line.topology_continuity", continuity, "share", how.clone()).goal("1.0").print();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
    let least = |v: &[f64]| v.iter().copied().fold(f64::INFINITY, f64::min);
    Figure::new("line.cloud_iou_mean", mean(&ious), "share", format!("{} clouds at their switch size", ious.len()))
        .goal(">= 0.90 (asked of a later step)")
        .print();
    Figure::new("line.cloud_iou_worst", least(&ious), "share", how).print();
    Figure::new("line.cloud_coverage_mean", mean(&coverages), "ratio", "projected coverage against LOD0")
        .goal("0.97 to 1.03 (asked of a later step)")
        .print();
}

/// Runs the Khronos validator, as `.ci/run` does.
fn valid(sets: &[PathBuf], scratch: &Path) {
    let out = scratch.join("valid");
    Builder::new(BuildOptions::new(&out)).build(sets, &|_| {}).expect("the presets build");
    let glbs: usize = std::fs::read_dir(&out)
        .expect("the folder was just written")
        .flatten()
        .filter_map(|set| std::fs::read_dir(set.path()).ok())
        .map(|set| set.flatten().filter(|f| f.path().extension().is_some_and(|e| e == "glb")).count())
        .sum();
    let npm = Command::new("npm")
        .args(["install", "--no-package-lock", "--no-audit", "--no-fund", "--silent"])
        .current_dir(root().join(".ci"))
        .status();
    let run = Command::new("node").arg(root().join(".ci/validate.mjs")).arg(&out).output();
    match (npm, run) {
        (Ok(npm), Ok(run)) if npm.success() => {
            let value = if run.status.success() { glbs as f64 } else { 0.0 };
            let how = format!("of {glbs} GLBs pass the Khronos validator without error or warning");
            Figure::new("line.assets_valid", value, "files", how).goal("all").print();
        }
        _ => Figure::new("line.assets_valid", 0.0, "files", "Node.js or npm is missing: nothing was measured").print(),
    }
}
