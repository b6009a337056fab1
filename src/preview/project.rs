//! The project as the page shows it: every preset with its set, what is wrong with it, and what is being built.
//!
//! A set stays shown while its preset is broken or its next build runs: it is the last good one on disk.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;
use serde_json::{Value, json};

use super::desk::{Standing, standings};
use crate::base::Diagnostic;
use crate::build::{BuildError, Happened, Progress, load_preset};
use crate::export::{Manifest, VariantEntry};
use crate::watch::Event;

/// Lines shown before and after the one that is wrong.
const AROUND: u32 = 2;
/// Longest line that is shown, letters.
const LONGEST: usize = 400;
/// Largest file that lines are shown of, bytes.
const LARGEST: u64 = 4 << 20;
/// Most errors that are shown of a preset.
const MOST_ERRORS: usize = 50;

/// See the head of this file.
pub(super) struct Project {
    /// The folder of presets, its real path.
    pub(super) folder: PathBuf,
    out: PathBuf,
    three: Option<String>,
    presets: BTreeMap<PathBuf, Preset>,
    /// The preset that is being built.
    current: Option<PathBuf>,
    /// What is wrong with the folder itself.
    errors: Vec<ErrorView>,
    revision: u64,
    idle: bool,
    polling: Option<String>,
}

/// A preset and its set.
struct Preset {
    /// The file's name.
    file: String,
    /// The set's name.
    set: String,
    manifest: Option<Arc<Manifest>>,
    /// Where the variants stand in the text; empty until the set is what the text means.
    standings: Vec<Standing>,
    rejected: Vec<(usize, u64)>,
    building: bool,
    steps: (usize, usize),
    errors: Vec<ErrorView>,
    notes: Vec<String>,
    took: f64,
}

/// An error as the page shows it.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ErrorView {
    file: String,
    line: u32,
    column: u32,
    field: String,
    message: String,
    hint: String,
    /// The preset's file and field that ask for the file; empty where it is the preset.
    asked_by: String,
    /// Lines of the file: number and text.
    lines: Vec<(u32, String)>,
    /// Of the line that is wrong the first and the last letter, from 0.
    mark: [u32; 2],
}

impl Project {
    pub(super) fn new(folder: &Path, out: &Path, three: Option<String>) -> Self {
        Self {
            folder: folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf()),
            out: out.to_path_buf(),
            three,
            presets: BTreeMap::new(),
            current: None,
            errors: Vec::new(),
            revision: 0,
            idle: false,
            polling: None,
        }
    }

    /// A set and its folder, by the set's name.
    pub(super) fn set(&self, name: &str) -> Option<(Arc<Manifest>, PathBuf)> {
        let manifest = self.presets.values().filter_map(|p| p.manifest.as_ref()).find(|m| m.set == name)?;
        Some((manifest.clone(), self.out.join(&manifest.set)))
    }

    /// The path of a preset by its file's name.
    pub(super) fn preset(&self, file: &str) -> Option<PathBuf> {
        self.presets.iter().find(|(_, preset)| preset.file == file).map(|(path, _)| path.clone())
    }

    /// Takes what the watcher tells; what the page is to be told.
    pub(super) fn take(&mut self, event: Event<'_>) -> Option<Value> {
        let news = match event {
            Event::Preset(path) => {
                let out = &self.out;
                let preset = self.presets.entry(path.to_path_buf()).or_insert_with(|| Preset::new(path, out));
                (preset.building, preset.steps) = (true, (0, 0));
                self.current = Some(path.to_path_buf());
                self.idle = false;
                json!({ "what": "building", "preset": preset.file })
            }
            Event::Build(progress) => return self.progress(&progress),
            Event::Orphaned(_) | Event::Unwritten(_) => return None,
            Event::Failed(error) => self.failed(&error),
            Event::Polling { every, why } => {
                self.polling =
                    Some(why.unwrap_or_else(|| format!("files are looked at every {} ms", every.as_millis())));
                json!({ "what": "polling" })
            }
            Event::Idle { .. } => {
                self.presets.retain(|path, _| path.is_file());
                self.current = None;
                self.idle = true;
                json!({ "what": "idle" })
            }
        };
        Some(self.told(news))
    }

    fn told(&mut self, mut news: Value) -> Value {
        self.revision += 1;
        news["revision"] = json!(self.revision);
        news
    }

    fn now(&mut self) -> Option<&mut Preset> {
        self.current.as_ref().and_then(|path| self.presets.get_mut(path))
    }

    fn progress(&mut self, progress: &Progress<'_>) -> Option<Value> {
        match progress {
            Progress::Steps(more) => {
                self.now()?.steps.1 += more;
                None
            }
            Progress::Waiting => Some(self.told(json!({ "what": "waiting" }))),
            Progress::Step { .. } => {
                let preset = self.now()?;
                preset.steps.0 += 1;
                let (done, all) = preset.steps;
                // Every twentieth part is enough for a bar.
                (all > 0 && done * 20 / all != (done - 1) * 20 / all)
                    .then(|| json!({ "what": "step", "preset": preset.file, "done": done, "all": all }))
            }
            Progress::Set { outcome, folder } => {
                let manifest = manifest(folder, &outcome.set);
                self.errors.clear();
                let path = self.current.clone()?;
                let preset = self.now()?;
                preset.building = false;
                preset.errors.clear();
                if let (Some(manifest), Ok(loaded)) = (&manifest, load_preset(&path)) {
                    (preset.standings, preset.rejected) = standings(&loaded, manifest);
                }
                preset.set.clone_from(&outcome.set);
                if outcome.happened == Happened::Built {
                    preset.took = outcome.took.as_secs_f64();
                }
                if let Some(manifest) = manifest {
                    preset.notes.clone_from(&manifest.notes);
                    preset.manifest = Some(Arc::new(manifest));
                }
                let news = json!({ "what": "built", "preset": preset.file, "set": preset.set });
                Some(self.told(news))
            }
        }
    }

    fn failed(&mut self, error: &BuildError) -> Value {
        let folder = self.folder.clone();
        let errors: Vec<ErrorView> =
            error.diagnostics.iter().take(MOST_ERRORS).map(|d| ErrorView::of(d, &folder)).collect();
        match self.now() {
            Some(preset) => {
                preset.building = false;
                preset.errors = errors;
                json!({ "what": "failed", "preset": preset.file })
            }
            None => {
                self.errors = errors;
                json!({ "what": "failed" })
            }
        }
    }

    /// All of it, for the page.
    pub(super) fn state(&self) -> Value {
        json!({
            "revision": self.revision,
            "idle": self.idle,
            "folder": self.folder.file_name().map(|n| n.to_string_lossy()),
            "three": self.three,
            "polling": self.polling,
            "errors": self.errors,
            "sets": self.presets.values().map(Preset::view).collect::<Vec<_>>(),
        })
    }
}

/// The manifest of a set; none where it can't be read.
fn manifest(folder: &Path, set: &str) -> Option<Manifest> {
    let text = std::fs::read_to_string(folder.join(format!("{set}.manifest.json"))).ok()?;
    Manifest::from_json(&text).ok().filter(|m| m.set == set)
}

impl Preset {
    /// A preset that is seen for the first time, with the set that an earlier run may have left.
    fn new(path: &Path, out: &Path) -> Self {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let manifest = manifest(&out.join(&stem), &stem).map(Arc::new);
        Self {
            file: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            set: stem,
            notes: manifest.as_ref().map(|m| m.notes.clone()).unwrap_or_default(),
            manifest,
            standings: Vec::new(),
            rejected: Vec::new(),
            building: false,
            steps: (0, 0),
            errors: Vec::new(),
            took: 0.0,
        }
    }

    fn view(&self) -> Value {
        let variants = self.manifest.iter().flat_map(|m| m.variants.iter().enumerate()).map(|(i, v)| {
            let mut told = variant(i, v);
            let standing = self.standings.get(i).copied().unwrap_or_default();
            told["number"] = json!(standing.number);
            told["kept"] = json!(standing.kept);
            told
        });
        json!({
            "preset": self.file,
            "set": self.set,
            "key": self.manifest.as_ref().map(|m| &m.key),
            "building": self.building,
            "done": self.steps.0,
            "all": self.steps.1,
            "errors": self.errors,
            "notes": self.notes,
            "took": self.took,
            "rejected": self.rejected,
            "wind": self.manifest.as_ref().is_some_and(|m| m.wind.is_some()),
            "textures": self.manifest.as_ref().map(|m| &m.textures),
            "variants": variants.collect::<Vec<_>>(),
        })
    }
}

fn variant(index: usize, of: &VariantEntry) -> Value {
    let levels: Vec<Value> = of
        .levels
        .iter()
        .map(|level| {
            json!({
                "mesh": level.mesh,
                "kind": level.kind,
                "triangles": level.triangles,
                "coverage": level.screen_coverage,
                "distance": finite(level.switch_distance),
                "iou": level.measured.map(|m| m.iou_mean),
                "flip": level.measured.map(|m| m.flip),
            })
        })
        .collect();
    json!({
        "index": index,
        "name": of.name,
        "file": of.file,
        // A number of 64 bits is more than a page's numbers hold.
        "seed": of.seed.to_string(),
        "height": of.height,
        "leaves": of.leaves,
        "chains": of.chains,
        "triangles": of.levels.first().map_or(0, |l| l.triangles),
        "score": of.recipe["selected"]["score"]["inspiring"].as_f64(),
        "levels": levels,
        "recipe": of.recipe,
        "bounds": of.bounds,
    })
}

fn finite(value: f32) -> Option<f32> {
    value.is_finite().then_some(value)
}

impl ErrorView {
    /// An error with the lines it is about, where its file lies in the project's folder.
    pub(super) fn of(diagnostic: &Diagnostic, folder: &Path) -> Self {
        let Diagnostic { file, span, field, message, hint, asked_by } = diagnostic;
        let name = Path::new(file).canonicalize().ok();
        let inside = name.filter(|path| path.starts_with(folder) && path.is_file());
        let shown = inside.as_deref().and_then(|path| path.strip_prefix(folder).ok());
        let text = inside
            .as_deref()
            .filter(|path| std::fs::metadata(path).is_ok_and(|m| m.len() <= LARGEST))
            .and_then(|path| std::fs::read(path).ok())
            .map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
            .unwrap_or_default();
        let (line, column) = span.map_or((0, 0), |s| (s.line, s.column));
        let numbered = text.lines().zip(1_u32..).map(|(text, n)| (n, text.chars().take(LONGEST).collect::<String>()));
        let lines: Vec<(u32, String)> = numbered.filter(|(n, _)| line > 0 && n.abs_diff(line) <= AROUND).collect();
        let end = span.map_or(0, |s| if s.end_line == s.line { s.end_column } else { u32::MAX });
        let width = lines.iter().find(|(n, _)| *n == line).map_or(0, |(_, text)| text.chars().count() as u32);
        let start = column.saturating_sub(1).min(width);
        Self {
            file: shown.map_or_else(|| file.clone(), |path| path.to_string_lossy().replace('\\', "/")),
            line,
            column,
            field: field.clone(),
            message: message.clone(),
            hint: hint.clone(),
            asked_by: asked_by.as_ref().map(|by| format!("{}: {}", by.file, by.field)).unwrap_or_default(),
            lines,
            mark: [start, end.saturating_sub(1).clamp(start, width.max(start + 1))],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Span;

    #[test]
    fn errors_show_lines_of_files_of_the_project_and_of_no_other() {
        let all = tempfile::tempdir().unwrap();
        let folder = all.path().canonicalize().unwrap().join("presets");
        std::fs::create_dir(&folder).unwrap();
        for name in ["presets/a.ron", "secret.ron"] {
            std::fs::write(all.path().join(name), "one\ntwo\nthree\nfour\nfive\nsix\n").unwrap();
        }
        let at = |file: &str| {
            let shown = folder.join(file).to_string_lossy().into_owned();
            let span = Span { line: 4, column: 2, end_line: 4, end_column: 4 };
            ErrorView::of(&Diagnostic::new(shown, "wrong").with_span(Some(span)), &folder)
        };
        let inside = at("a.ron");
        assert_eq!(inside.file, "a.ron");
        assert_eq!(inside.lines.iter().map(|l| l.0).collect::<Vec<_>>(), [2, 3, 4, 5, 6]);
        assert_eq!((inside.lines[2].1.as_str(), inside.mark), ("four", [1, 3]));
        assert!(at("../secret.ron").lines.is_empty());
        assert!(at("missing.ron").lines.is_empty());
    }

    #[test]
    fn news_are_numbered_and_a_broken_preset_keeps_its_set() {
        let folder = tempfile::tempdir().unwrap();
        let preset = folder.path().join("a.ron");
        std::fs::write(&preset, "()").unwrap();
        let mut project = Project::new(folder.path(), folder.path(), None);
        let first = project.take(Event::Preset(&preset)).unwrap();
        assert_eq!((first["what"].as_str(), first["revision"].as_u64()), (Some("building"), Some(1)));
        let error = BuildError::of(vec![Diagnostic::new("a.ron", "wrong")]);
        assert_eq!(project.take(Event::Failed(error)).unwrap()["preset"], "a.ron");
        let state = project.state();
        assert_eq!(state["sets"][0]["errors"][0]["message"], "wrong");
        assert_eq!(state["sets"][0]["building"], false);
        std::fs::remove_file(&preset).unwrap();
        project.take(Event::Idle { files: 0 });
        assert_eq!(project.state()["sets"].as_array().map(Vec::len), Some(0));
    }
}
