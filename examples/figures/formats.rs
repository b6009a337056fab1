//! Figures of the readers: what of the real files is read, and how fast.

use std::collections::BTreeMap;
use std::path::Path;

use treewright::preset::plan::ImportParams;
use treewright::source::{import, scene};

use crate::{Figure, data, seconds};

/// A file and what it names.
struct Input {
    name: String,
    bytes: Vec<u8>,
    beside: BTreeMap<String, Vec<u8>>,
}

impl Input {
    fn read(data: &Path, name: &str) -> Option<Self> {
        let path = data.join(name);
        let bytes = std::fs::read(&path).ok()?;
        let mut input = Self { name: name.to_owned(), bytes, beside: BTreeMap::new() };
        for _ in 0..3 {
            for file in import::refers(&input.bytes, name, &input.files()) {
                if let Ok(bytes) = std::fs::read(path.with_file_name(&file)) {
                    input.beside.insert(file, bytes);
                }
            }
        }
        Some(input)
    }

    fn files(&self) -> scene::Files<'_> {
        self.beside.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect()
    }

    /// Up to the scene of a mesh, or the plant of anything else.
    fn import(&self) -> bool {
        match scene::sniff(&self.bytes) {
            Some(_) => scene::read(&self.bytes, &self.name, &self.files()).is_ok(),
            None => import::import_with(&self.bytes, &self.name, &self.files(), &ImportParams::default()).is_ok(),
        }
    }

    fn megabytes(&self) -> f64 {
        self.bytes.len() as f64 / 1e6
    }
}

/// Prints them.
pub(crate) fn print() {
    let Some(data) = data() else { return };
    let manifest = std::fs::read_to_string(data.join("MANIFEST.tsv")).unwrap_or_default();
    let names: Vec<&str> = manifest.lines().filter_map(|line| line.split('\t').next()).collect();
    let names: Vec<&str> = names.into_iter().filter(|n| n.starts_with("mesh/") || n.starts_with("skeleton/")).collect();
    let (dressing, models): (Vec<&str>, Vec<&str>) = names.iter().partition(|n| n.ends_with(".drf"));
    let inputs: Vec<Input> = models.iter().filter_map(|name| Input::read(&data, name)).collect();
    let read = inputs.iter().filter(|input| input.import()).count();
    // A dressing file is read with its graph.
    let dressed =
        inputs.iter().flat_map(|i| i.beside.keys()).filter(|n| dressing.iter().any(|d| d.ends_with(*n))).count();
    Figure::new(
        "import.files_read",
        (read + dressed) as f64,
        "files",
        format!("of the {} of MANIFEST.tsv", names.len()),
    )
    .goal("= 36")
    .print();
    for (name, ends) in [
        ("import.seconds_per_mb.gltf", ".glb"),
        ("import.seconds_per_mb.obj", ".obj"),
        ("import.seconds_per_mb.ply", ".ply"),
        ("import.seconds_per_mb.mat", ".mat"),
        ("import.seconds_per_mb.mtg", ".mtg"),
        ("import.seconds_per_mb.csv", ".csv"),
        ("import.seconds_per_mb.swc", ".swc"),
    ] {
        let of: Vec<&Input> = inputs.iter().filter(|i| i.name.ends_with(ends)).collect();
        let size: f64 = of.iter().map(|i| i.megabytes()).sum();
        let time = seconds(5, || of.iter().for_each(|input| assert!(input.import())));
        let how =
            format!("median of 5 over {} files, {size:.2} MB; meshes up to their scene, others to the plant", of.len());
        Figure::new(name, time / size, "s/MB", how).print();
    }
}
