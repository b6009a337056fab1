//! The wood of the real meshes, and what is known of it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::Vec3;
use treewright::plant::Plant;
use treewright::preset::plan::{ImportParams, UpAxis};
use treewright::source::foliage::{self, Overrides};
use treewright::source::import::import;
use treewright::source::scene::{Files, read, refers};
use treewright::source::skeletonize::Wood;

/// A mesh of the data folder.
pub(crate) struct Tree {
    /// File name without its ending.
    pub(crate) name: String,
    pub(crate) wood: Wood,
    /// Least and greatest corner of all that the file draws, leaves too.
    pub(crate) bounds: (Vec3, Vec3),
    pub(crate) up: UpAxis,
    /// The true skeleton beside it.
    pub(crate) truth: Option<Plant>,
}

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
        Some(import(&bytes, &file, &ImportParams::default()).ok()?.plant)
    });
    let drawn = scene.parts.iter().flat_map(|p| p.triangles.iter().flatten().map(|&v| p.positions[v as usize]));
    let bounds = drawn.fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let parts = foliage::split(&scene, &files, &Overrides::default());
    let wood = Wood { positions: parts.wood_positions, triangles: parts.wood };
    Some(Tree { name, up: scene.up.0, wood, bounds, truth })
}
