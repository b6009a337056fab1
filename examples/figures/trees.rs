//! The wood of the real meshes, and what is known of it.

use std::path::{Path, PathBuf};

use glam::Vec3;
use treewright::plant::Plant;
use treewright::preset::plan::{ImportParams, UpAxis};
use treewright::source::glb::read_glb;
use treewright::source::import::import;
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
    let bytes = std::fs::read(path).ok()?;
    let (wood, up) = match path.extension()?.to_str()? {
        "glb" => (of_glb(&bytes)?, UpAxis::Y),
        _ => return None,
    };
    let truth = [format!("{name}.swc"), format!("pyhelios_{name}_qsm.txt")].into_iter().find_map(|file| {
        let bytes = std::fs::read(data.join("skeleton").join(&file)).ok()?;
        let params = ImportParams { file: String::new(), ..ImportParams::default() };
        Some(import(&bytes, &file, &params).ok()?.plant)
    });
    Some(Tree { name, wood, up, truth })
}

/// Parts whose material says nothing of leaves, or all where none is left.
fn of_glb(bytes: &[u8]) -> Option<Wood> {
    let info = read_glb(bytes).ok()?;
    let mut wood = Wood::default();
    for instance in &info.instances {
        let mesh = &info.meshes[instance.mesh];
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let material = primitive.material.map(|m| &info.materials[m]);
            let name = material.map_or_else(String::new, |m| m.name.to_lowercase());
            let leafy = ["leaf", "leaves", "leafs", "green"].iter().any(|w| name.contains(w));
            if leafy || material.is_some_and(|m| m.alpha_mode != "OPAQUE") {
                continue;
            }
            let first = wood.positions.len() as u32;
            let positions = info.positions(instance.mesh, p).ok()?;
            wood.positions.extend(positions.into_iter().map(|p| Vec3::from_array(instance.place(p))));
            let triangles = info.triangles(instance.mesh, p).ok()?;
            wood.triangles.extend(triangles.into_iter().map(|t| t.map(|v| v + first)));
        }
    }
    Some(wood)
}
