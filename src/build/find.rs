//! Finding presets, and reading one with everything that it names.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::{BuildError, Limits, World};
use crate::base::{Asked, Diagnostic, Note, Span};
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

/// Whether what lies in a folder is a preset. A link to nowhere is: what reads it says so. Hidden files are none: editors and
/// file managers leave theirs beside what they work on (`.#oak.ron`, `._oak.ron`).
fn is_preset(path: &Path) -> bool {
    let is_hidden = path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
    let is_dangling = || path.is_symlink() && !path.exists();
    path.extension().is_some_and(|e| e == "ron") && !is_hidden && (path.is_file() || is_dangling())
}

/// The preset files that some paths mean: a file is itself, a folder means its `*.ron` files in order of name, hidden
/// ones left out. Folders inside it are not searched; they hold what presets read.
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
            let mut found: Vec<PathBuf> =
                entries.flatten().map(|entry| entry.path()).filter(|p| is_preset(p)).collect();
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
            errors.push(
                Diagnostic::new(shown(path), "there is no such file or folder")
                    .with_hint("name a preset file or a folder of presets"),
            );
        }
    }
    // The same preset named twice, by itself and by its folder, is one. A link to another preset is one of its own name.
    let mut seen = BTreeSet::new();
    presets.retain(|preset| {
        let folder = preset.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf());
        seen.insert(folder.join(preset.file_name().unwrap_or_default()))
    });
    if errors.is_empty() { Ok(presets) } else { Err(BuildError::of(errors)) }
}

/// Reads and resolves one preset.
///
/// # Errors
///
/// Every error in it and in the text files that it names.
pub fn load_preset(path: &Path) -> Result<Loaded, Vec<Diagnostic>> {
    load_or_reads(path, &Limits::default()).map_err(|failure| failure.0)
}

/// As [`load_preset`], where some files, by their names relative to the preset's folder, hold other texts than they do.
///
/// # Errors
///
/// As [`load_preset`].
pub fn load_edited(path: &Path, limits: &Limits, texts: BTreeMap<String, String>) -> Result<Loaded, Vec<Diagnostic>> {
    let world = World::within(path.parent().unwrap_or(Path::new("")), limits.clone()).with_texts(texts);
    load_in(path, world).map_err(|failure| failure.0)
}

/// As [`load_preset`], reading no file beyond `limits`; with the errors comes the world that knows what was read up
/// to them.
pub(super) fn load_or_reads(path: &Path, limits: &Limits) -> Result<Loaded, Box<(Vec<Diagnostic>, World)>> {
    load_in(path, World::within(path.parent().unwrap_or(Path::new("")), limits.clone()))
}

fn load_in(path: &Path, world: World) -> Result<Loaded, Box<(Vec<Diagnostic>, World)>> {
    let Some(name) = path.file_name().unwrap_or_default().to_str() else {
        let error = Diagnostic::new(shown(path), "the file's name is not UTF-8 text")
            .with_hint("rename it: the set and its files are called after it");
        return Err(Box::new((vec![error], world)));
    };
    load_from(world, name, shown(path))
}

/// Reads and resolves the preset `name` of a world; `preset` is how people know it.
pub(super) fn load_from(world: World, name: &str, preset: String) -> Result<Loaded, Box<(Vec<Diagnostic>, World)>> {
    let text = match world.read_text(name) {
        Ok(text) => text,
        Err(why) => {
            let hint = if why.contains("UTF-8") { "save it as UTF-8" } else { "" };
            return Err(Box::new((vec![Diagnostic::new(&preset, why).with_hint(hint)], world)));
        }
    };
    match preset::load(&preset, &text, &mut |relative| world.read_text(relative)) {
        Ok(plan) => Ok(Loaded { plan, preset, text, world }),
        Err(diagnostics) => Err(Box::new((diagnostics, world))),
    }
}

impl Loaded {
    /// Gives notes the place of their field, where the preset has it.
    pub(super) fn noted(&self, notes: &mut [Note]) {
        let whole = preset::place(&self.text, "");
        for note in notes {
            if let span @ Some(_) = preset::place(&self.text, &note.about).filter(|span| Some(*span) != whole) {
                (note.file, note.span) = (self.preset.clone(), span);
            }
        }
    }

    /// Gives errors of later stages, which know fields but no text, the preset's name and the field's place.
    pub(super) fn placed(&self, mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
        let place = |file: &mut String, span: &mut Option<Span>, field: &str| {
            if file.is_empty() {
                file.clone_from(&self.preset);
                *span = if field.is_empty() { None } else { preset::place(&self.text, field) };
            }
        };
        for diagnostic in &mut diagnostics {
            place(&mut diagnostic.file, &mut diagnostic.span, &diagnostic.field);
            if let Some(Asked { file, span, field }) = diagnostic.asked_by.as_deref_mut() {
                place(file, span, field);
            }
        }
        diagnostics
    }
}

/// A path as people read it: `/` between folders.
pub(super) fn shown(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_files_are_no_presets_and_links_to_nowhere_are_some_that_cannot_be_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        for name in ["oak.ron", ".#oak.ron", "._oak.ron", "oak.txt"] {
            fs::write(at(name), "()").expect("it is written");
        }
        fs::create_dir(at("kept.ron")).expect("a folder inside it");
        let presets = find_presets(&[folder.path().to_path_buf()]).expect("there are some");
        assert_eq!(presets, [at("oak.ron")]);
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("gone.ron", at("ash.ron")).expect("a link");
            let presets = find_presets(&[folder.path().to_path_buf()]).expect("there are some");
            assert_eq!(presets, [at("ash.ron"), at("oak.ron")]);
            let errors = load_preset(&at("ash.ron")).expect_err("it leads nowhere");
            assert!(errors[0].file.ends_with("ash.ron"), "{errors:?}");
            // Two sets of one text; and a folder's other name gives it no more presets.
            std::os::unix::fs::symlink("oak.ron", at("yew.ron")).expect("a link");
            std::os::unix::fs::symlink(".", at("again")).expect("a link");
            fs::remove_file(at("ash.ron")).expect("it goes");
            let paths = [folder.path().to_path_buf(), at("again/yew.ron"), at("again")];
            assert_eq!(find_presets(&paths).expect("there are some"), [at("oak.ron"), at("yew.ron")]);
        }
    }
}
