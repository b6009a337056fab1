//! `cargo run --release --example formats -- [FOLDER]`: reads every mesh and skeleton of a folder with a MANIFEST.tsv (the
//! test data) and prints what each holds. Ends with an error where a count is not the manifest's.

#![expect(clippy::print_stdout, reason = "a program that prints")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use treewright::plant::PlantStats;
use treewright::preset::plan::{ImportParams, UpAxis};
use treewright::source::import;
use treewright::source::scene::{self, Scene};

fn main() {
    let data = std::env::args_os()
        .nth(1)
        .or_else(|| std::env::var_os("TREEWRIGHT_DATA"))
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")), PathBuf::from);
    let manifest = std::fs::read_to_string(data.join("MANIFEST.tsv")).expect("the folder has a MANIFEST.tsv");
    println!(
        "{:<36} {:<14} {:>8} {:>8} {:>5} {:>5} {:>5} {:>3} {:<24} notes",
        "file", "format", "vertices", "tris", "parts", "mats", "imgs", "up", "size"
    );
    let mut wrong = 0;
    for line in manifest.lines() {
        let cells: Vec<&str> = line.split('\t').collect();
        match cells[..] {
            [name, _, _, "mesh", triangles, _, notes] => wrong += mesh(&data, name, triangles, notes),
            [name, _, _, "skeleton", ..] if !name.ends_with(".drf") => wrong += skeleton(&data, name),
            _ => {}
        }
    }
    if wrong > 0 {
        println!("{wrong} files are not as the manifest says");
        std::process::exit(1);
    }
}

/// A file with what it names.
fn input(data: &Path, name: &str) -> (Vec<u8>, BTreeMap<String, Vec<u8>>) {
    let path = data.join(name);
    let bytes = std::fs::read(&path).unwrap_or_default();
    let mut beside: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    for _ in 0..3 {
        for file in import::refers(&bytes, name, &borrowed(&beside)) {
            if let Ok(bytes) = std::fs::read(path.with_file_name(&file)) {
                beside.insert(file, bytes);
            }
        }
    }
    (bytes, beside)
}

fn borrowed(files: &BTreeMap<String, Vec<u8>>) -> scene::Files<'_> {
    files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect()
}

fn size(scene: &Scene) -> [f32; 3] {
    let all = || scene.parts.iter().flat_map(|p| &p.positions);
    let low = all().copied().reduce(|a, b| a.min(b)).unwrap_or_default();
    (all().copied().reduce(|a, b| a.max(b)).unwrap_or_default() - low).to_array()
}

/// Prints a mesh; 1 where the manifest says otherwise.
fn mesh(data: &Path, name: &str, triangles: &str, notes: &str) -> u32 {
    let (bytes, beside) = input(data, name);
    let format = scene::sniff(&bytes).map_or("?", scene::MeshFormat::name);
    let scene = match scene::read(&bytes, name, &borrowed(&beside)) {
        Ok(scene) => scene,
        Err(errors) => {
            println!("{name}: {errors:?}");
            return 1;
        }
    };
    let up = match scene.up.0 {
        UpAxis::Y => "Y",
        UpAxis::Z => "Z",
        UpAxis::Detect => "?",
    };
    let size = size(&scene);
    println!(
        "{:<36} {:<14} {:>8} {:>8} {:>5} {:>5} {:>5} {:>3} {:<24} {}",
        name.trim_start_matches("mesh/"),
        format,
        scene.vertices(),
        scene.triangles(),
        scene.parts.len(),
        scene.materials.len(),
        scene.images.len(),
        up,
        size.map(|s| format!("{s:.2}")).join(" × "),
        scene.notes.join("; ")
    );
    // "size [52.63, 64.73, 53.53];"
    let stated = notes.split_once("size [").and_then(|(_, rest)| rest.split_once(']')).map_or("", |(size, _)| size);
    let stated: Vec<f32> = stated.split(", ").filter_map(|n| n.parse().ok()).collect();
    let same = stated.len() == 3 && stated.iter().zip(size).all(|(a, b)| (a - b).abs() <= 0.0051);
    // "verts 24060;": as another reader counts them, which splits or joins corners in its own way where the format has none.
    let vertices = notes.split_once("verts ").and_then(|(_, rest)| rest.split_once(';')).map_or("", |(n, _)| n);
    println!("  {:<34} the manifest says {vertices} vertices", "");
    let fits = same && scene.triangles().to_string() == triangles;
    if !fits {
        println!("  the manifest says {triangles} triangles, size {stated:?}");
    }
    u32::from(!fits)
}

/// Prints a skeleton; 1 where it is none.
fn skeleton(data: &Path, name: &str) -> u32 {
    let (bytes, beside) = input(data, name);
    match import::import_with(&bytes, name, &borrowed(&beside), &ImportParams::default()) {
        Ok(found) => {
            let stats = PlantStats::of(&found.plant);
            println!(
                "{:<36} {:<14} {:>8} {:>8} {:>5} {:>5} {:>5} {:>3} {:<24} {}",
                name.trim_start_matches("skeleton/"),
                found.format.name(),
                stats.points,
                "-",
                stats.chains,
                "-",
                "-",
                "Y",
                format!("{:.2} m high", stats.height),
                found.notes.join("; ")
            );
            u32::from(stats.stems != 1)
        }
        Err(errors) => {
            println!("{name}: {errors:?}");
            1
        }
    }
}
