//! Finding presets, and reading one with everything that it names.

use std::fs;
use std::path::{Path, PathBuf};

use super::{BuildError, World};
use crate::base::Diagnostic;
use crate::preset::{self, Plan};

/// A preset, resolved, and the world that its relative paths start from.
#[derive(Debug)]
pub struct Loaded {
    /// The plan.
    pub plan: Plan,
    /// The preset file as it is shown to people.
    pub preset: String,
    /// What the file holds.
    pub text: String,
    /// Reads relative to the preset's folder.
    pub world: World,
}

/// The preset files that some paths mean: a file is itself, a folder means its `*.ron` files in order of name. Folders
/// inside it are not searched; they hold what presets read.
///
/// # Errors
///
/// Every path that does not exist, and every folder without a preset.
pub fn find_presets(paths: &[PathBuf]) -> Result<Vec<PathBuf>, BuildError> {
    let mut presets: Vec<PathBuf> = Vec::new();
    let mut errors = Vec::new();
    for path in paths {
        if path.is_dir() {
            let entries = match fs::read_dir(path) {
                Ok(entries) => entries,
                Err(error) => {
                    errors.push(Diagnostic::new(shown(path), format!("the folder can't be read: {error}")));
                    continue;
                }
            };
            let mut found: Vec<PathBuf> = entries
                .flatten()
                .map(|entry| entry.path())
                .filter(|p| p.extension().is_some_and(|e| e == "ron") && p.is_file())
                .collect();
            found.sort();
            if found.is_empty() {
                errors.push(
                    Diagnostic::new(shown(path), "the folder holds no preset")
                        .with_hint("presets are the *.ron files directly in it"),
                );
            }
            presets.append(&mut found);
        } else if path.exists() {
            presets.push(path.clone());
        } else {
            errors.push(Diagnostic::new(shown(path), "there is no such file or folder"));
        }
    }
    // The same preset named twice, by itself and by its folder, is one.
    let mut seen = Vec::new();
    presets.retain(|preset| {
        let identity = fs::canonicalize(preset).unwrap_or_else(|_| preset.clone());
        let new = !seen.contains(&identity);
        if new {
            seen.push(identity);
        }
        new
    });
    if errors.is_empty() { Ok(presets) } else { Err(BuildError::Input(errors)) }
}

/// Reads and resolves one preset.
///
/// # Errors
///
/// Every error in it and in the text files that it names.
pub fn load_preset(path: &Path) -> Result<Loaded, Vec<Diagnostic>> {
    let preset = shown(path);
    let folder = path.parent().unwrap_or(Path::new(""));
    let world = World::at(folder);
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text = world.read_text(&name).map_err(|why| vec![Diagnostic::new(&preset, why)])?;
    let plan = preset::load(&preset, &text, &mut |relative| world.read_text(relative))?;
    Ok(Loaded { plan, preset, text, world })
}

/// A path as people read it: `/` between folders.
pub(super) fn shown(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}
