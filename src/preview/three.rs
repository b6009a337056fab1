//! three.js, where the machine has it: the page never asks another server for anything.
//!
//! `npm install three` beside the presets is enough. Some files of the package are served, and the shader of impostors that
//! engines are given, with the names that they import each other by turned into names beside them, since a browser knows no
//! packages.

use std::path::{Path, PathBuf};

/// What is served: the name, and where it lies in the package.
const FILES: [(&str, &str); 6] = [
    ("three.module.js", "build/three.module.js"),
    ("three.core.js", "build/three.core.js"),
    ("OrbitControls.js", "examples/jsm/controls/OrbitControls.js"),
    ("GLTFLoader.js", "examples/jsm/loaders/GLTFLoader.js"),
    ("BufferGeometryUtils.js", "examples/jsm/utils/BufferGeometryUtils.js"),
    ("SkeletonUtils.js", "examples/jsm/utils/SkeletonUtils.js"),
];
/// The shader of impostors, which imports three.js.
const IMPOSTOR: (&str, &str) = ("impostor.js", include_str!("../../examples/engines/impostor.js"));
/// Largest file of it that is served, bytes.
const LARGEST: u64 = 8 << 20;

/// The package, as it was found.
#[derive(Clone, Debug)]
pub(super) struct Three {
    folder: PathBuf,
    pub(super) version: String,
}

/// Finds the package.
///
/// # Errors
///
/// When a folder was named that is not it.
pub(super) fn found(named: Option<&Path>, presets: &Path) -> Result<Option<Three>, String> {
    if let Some(folder) = named {
        let why =
            || format!("{} is not the folder of the package three (it lacks build/three.module.js)", folder.display());
        return at(folder).map(Some).ok_or_else(why);
    }
    let here = std::env::current_dir().unwrap_or_default();
    let presets = presets.canonicalize().unwrap_or_else(|_| presets.to_path_buf());
    let all = presets.ancestors().chain(here.ancestors());
    Ok(all.map(|folder| folder.join("node_modules/three")).find_map(|folder| at(&folder)))
}

fn at(folder: &Path) -> Option<Three> {
    let text = std::fs::read_to_string(folder.join("package.json")).ok()?;
    let package: serde_json::Value = serde_json::from_str(&text).ok()?;
    let version = package["version"].as_str()?.to_owned();
    folder.join(FILES[0].1).is_file().then(|| Three { folder: folder.to_path_buf(), version })
}

impl Three {
    /// A file of it as the page imports it.
    pub(super) fn file(&self, name: &str) -> Option<String> {
        if name == IMPOSTOR.0 {
            return Some(beside(IMPOSTOR.1));
        }
        let (_, path) = FILES.iter().find(|(known, _)| *known == name)?;
        let path = self.folder.join(path);
        let fits = std::fs::metadata(&path).is_ok_and(|m| m.len() <= LARGEST);
        let text = fits.then(|| std::fs::read_to_string(path).ok()).flatten()?;
        Some(beside(&text))
    }
}

/// A module whose imports name files beside it.
fn beside(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 64);
    let mut rest = text;
    while let Some(at) = rest.find(" from '") {
        let (before, behind) = rest.split_at(at + " from '".len());
        out.push_str(before);
        let end = behind.find('\'').unwrap_or(behind.len());
        let name = &behind[..end];
        match name {
            "three" => out.push_str("./three.module.js"),
            _ if name.ends_with(".js") => {
                out.push_str("./");
                out.push_str(name.rsplit('/').next().unwrap_or(name));
            }
            _ => out.push_str(name),
        }
        rest = &behind[end..];
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imports_name_files_beside() {
        let text = "import {\n A,\n B\n} from 'three';\nimport { c } from '../utils/C.js'; export * from './core.js';";
        let told =
            "import {\n A,\n B\n} from './three.module.js';\nimport { c } from './C.js'; export * from './core.js';";
        assert_eq!(beside(text), told);
        assert_eq!(beside("x from '"), "x from '");
    }

    #[test]
    fn only_the_package_itself_is_taken_and_only_its_modules_served() {
        let folder = tempfile::tempdir().unwrap();
        assert!(found(Some(folder.path()), folder.path()).is_err());
        std::fs::create_dir(folder.path().join("build")).unwrap();
        std::fs::write(folder.path().join("package.json"), "{\"version\": \"0.1\"}").unwrap();
        std::fs::write(folder.path().join("build/three.module.js"), "export {} from './three.core.js'").unwrap();
        let three = found(Some(folder.path()), folder.path()).unwrap().unwrap();
        assert_eq!(three.version, "0.1");
        assert!(three.file("three.module.js").is_some());
        assert!(three.file("impostor.js").unwrap().contains("} from './three.module.js'"));
        for name in ["package.json", "../package.json", "build/three.module.js", ""] {
            assert_eq!(three.file(name), None, "{name}");
        }
    }
}
