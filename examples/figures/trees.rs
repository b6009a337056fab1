//! The wood of the real meshes, and what is known of it.
//!
//! Here wood is told by names and colours alone, as a person would: what is measured is skeletons, not that choice.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use treewright::plant::Plant;
use treewright::preset::plan::{ImportHeight, ImportParams, UpAxis};
use treewright::source::import::import;
use treewright::source::scene::{Alpha, Files, Part, Scene, read, refers};
use treewright::source::skeletonize::Wood;

/// A mesh of the data folder.
pub(crate) struct Tree {
    /// File name without its ending.
    pub(crate) name: String,
    pub(crate) wood: Wood,
    pub(crate) up: UpAxis,
    /// The true skeleton beside it.
    pub(crate) truth: Option<Plant>,
}

/// Words in the names of what is no wood.
const LEAFY: [&str; 7] = ["leaf", "leaves", "leafs", "green", "petiole", "peduncle", "fruit"];

/// All meshes of the data folder that can be read.
pub(crate) fn trees(data: &Path) -> Vec<Tree> {
    let mut files: Vec<PathBuf> = Vec::new();
    let mut folders = vec![data.join("mesh")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("the data folder can be read").flatten() {
            let path = entry.path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    files.sort();
    files.iter().filter_map(|f| tree(data, f)).collect()
}

fn tree(data: &Path, path: &Path) -> Option<Tree> {
    let name = path.file_stem()?.to_str()?.to_owned();
    if !["glb", "obj", "ply"].contains(&path.extension()?.to_str()?) {
        return None;
    }
    let bytes = std::fs::read(path).ok()?;
    let mut beside: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    let files = |beside: &BTreeMap<String, Vec<u8>>| -> Vec<String> {
        let files: Files<'_> = beside.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        refers(&bytes, &files)
    };
    for _ in 0..3 {
        for name in files(&beside) {
            if let Ok(bytes) = std::fs::read(path.with_file_name(&name)) {
                beside.insert(name, bytes);
            }
        }
    }
    let files: Files<'_> = beside.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
    let scene = read(&bytes, &name, &files).ok()?;
    let truth = [format!("{name}.swc"), format!("pyhelios_{name}_qsm.txt")].into_iter().find_map(|file| {
        let bytes = std::fs::read(data.join("skeleton").join(&file)).ok()?;
        let params = ImportParams { file: String::new(), up: UpAxis::Detect, height: ImportHeight::AsIs };
        Some(import(&bytes, &file, &params).ok()?.plant)
    });
    Some(Tree { name, up: scene.up.0, wood: wood(&scene), truth })
}

fn wood(scene: &Scene) -> Wood {
    let shoots = scene.parts.iter().any(|part| part.name == "shoot");
    let is_wood = |part: &Part| {
        let material = part.material.map(|m| &scene.materials[m]);
        let name = material.map_or_else(String::new, |m| m.name.to_lowercase());
        let leafy = LEAFY.iter().any(|w| name.contains(w) || part.name.to_lowercase().contains(w));
        let opaque = material.is_none_or(|m| m.alpha == Alpha::Opaque);
        if shoots { part.name == "shoot" } else { opaque && !leafy }
    };
    let mut wood = Wood::of(scene, |i| is_wood(&scene.parts[i]));
    // Where only the vertices' colours tell: bark is more red than green.
    let mut colors = Vec::new();
    for part in scene.parts.iter().filter(|p| is_wood(p)) {
        colors.extend((0..part.positions.len()).map(|v| part.colors.get(v).copied().unwrap_or([1.0, 0.0, 0.0, 1.0])));
    }
    if colors.iter().any(|c| c[1] > c[0]) {
        wood.triangles.retain(|t| colors[t[0] as usize][0] > colors[t[0] as usize][1]);
    }
    wood
}
