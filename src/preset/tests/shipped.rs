//! The presets and species that ship with Treewright.

use std::fs;
use std::path::{Path, PathBuf};

use super::*;

/// The `*.ron` files of a folder below `presets`, in order of name.
fn texts(folder: &str) -> Vec<(String, String)> {
    let folder = presets().join(folder);
    let mut files: Vec<PathBuf> =
        fs::read_dir(&folder).expect("the folder is there").map(|f| f.unwrap().path()).collect();
    files.sort();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "ron"));
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    files.iter().map(|path| (name(path), fs::read_to_string(path).expect("reads"))).collect()
}

fn presets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("presets")
}

fn told(found: Vec<Diagnostic>) -> String {
    found.iter().map(|diagnostic| format!("{diagnostic}\n")).collect()
}

#[test]
fn every_shipped_preset_loads_and_is_ron() {
    let shipped = texts("");
    assert!(
        shipped.iter().any(|(name, _)| name == "avenue.ron") && shipped.iter().any(|(name, _)| name == "grove.ron")
    );
    for (name, text) in shipped {
        let read = &mut |path: &str| fs::read_to_string(presets().join(path)).map_err(|e| e.to_string());
        let plan = load(&format!("presets/{name}"), &text, read).map_err(told);
        assert!(plan.is_ok(), "{}", plan.unwrap_err());
        assert!(ron::from_str::<ron::Value>(&text).is_ok(), "{name}");
    }
}

#[test]
fn every_shipped_species_loads_and_is_ron() {
    let shipped = texts("species");
    assert!(shipped.len() >= 3);
    for (name, text) in shipped {
        let grown = species(&name, &text).map_err(told);
        assert!(grown.is_ok(), "{}", grown.unwrap_err());
        assert!(ron::from_str::<ron::Value>(&text).is_ok(), "{name}");
    }
}
