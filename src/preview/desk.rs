//! What a designer decides, written back: edits of presets and species, trees to keep and to reject, drawn crowns.
//!
//! A file is written only where it still is what the page saw, where it lies in the project's folder and is one that
//! the preset reads, and where the preset still loads with it; whole or not at all. Comments and order stay
//! ([`crate::preset::edited`]).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::Deserialize;
use serde_json::{Value, json};

use super::drafts::{Change, Stroke, stroke_svgs};
use crate::base::{Diagnostic, Key};
use crate::build::replace::replace;
use crate::build::{Limits, Loaded, load_edited};
use crate::export::Manifest;
use crate::preset::plan::{SketchParams, SketchScale, SourceRecipe};
use crate::preset::{Edit, KnobsOf, edited, knobs, value_of};

/// Why nothing was written.
#[derive(Debug)]
pub(super) enum Refused {
    /// Somebody else was faster: the page must look again.
    Stale,
    /// It is no file that may be written.
    NoFile,
    /// One sentence.
    Wrong(String),
    /// The preset would not load.
    Broken(Vec<Diagnostic>),
}

/// Edits of one file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Save {
    /// The preset's file.
    pub(super) preset: String,
    /// The file, relative to the preset's folder.
    pub(super) file: String,
    /// Hash of the text that the page saw, as [`knobs_of`] told it.
    pub(super) base: String,
    /// Changed fields.
    #[serde(default)]
    pub(super) edits: Vec<Change>,
    /// Items that are added to lists, each a path and a value.
    #[serde(default)]
    pub(super) append: Vec<(String, String)>,
}

/// What becomes of a variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Decision {
    /// The build repeats it.
    Keep,
    /// It is kept no longer.
    Free,
    /// Another takes its place.
    Reject,
    /// All that was rejected in the preset may come back.
    Forgive,
}

/// A decision about a variant.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Decide {
    /// The preset's file.
    pub(super) preset: String,
    /// The variant, from 0.
    pub(super) index: usize,
    /// The key of the set that the page shows.
    pub(super) key: Option<String>,
    /// What becomes of it.
    pub(super) decision: Decision,
}

/// A drawn crown that is kept.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Drawn {
    /// The preset's file.
    pub(super) preset: String,
    /// The source whose crown it is.
    pub(super) of: String,
    /// Name of the SVG, without folder and extension.
    pub(super) name: String,
    /// What was drawn before, each over what the one before gave; the first has the name.
    #[serde(default)]
    pub(super) before: Vec<Stroke>,
    /// What is drawn last.
    #[serde(flatten)]
    pub(super) stroke: Stroke,
    /// Whether an SVG of that name may be replaced.
    #[serde(default)]
    pub(super) replace: bool,
}

/// A variant's place in the preset's text, and what is decided about it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Standing {
    /// Which entry of `variants`.
    pub(super) entry: usize,
    /// Its number there, from 1; none where nothing can be decided about it.
    pub(super) number: Option<u64>,
    /// Whether `keep` has it.
    pub(super) kept: bool,
}

/// Where the variants of a set stand in its preset, and which numbers of each entry are rejected.
#[must_use]
pub(super) fn standings(loaded: &Loaded, manifest: &Manifest) -> (Vec<Standing>, Vec<(usize, u64)>) {
    let of = |(i, origin): (usize, &crate::preset::plan::Origin)| {
        let picked = manifest.variants.get(i).and_then(|v| v.recipe["selected"]["candidate"].as_u64());
        let number = origin.number.map(|n| n as u64).or(picked);
        let kept = number.is_some_and(|n| decided(&loaded.text, origin.entry, "keep").contains(&n));
        Standing { entry: origin.entry, number, kept }
    };
    let standings = loaded.plan.origins.iter().enumerate().map(of).collect();
    let entries = loaded.plan.origins.iter().map(|o| o.entry).max().map_or(0, |last| last + 1);
    let rejected = (0..entries).flat_map(|e| decided(&loaded.text, e, "reject").into_iter().map(move |n| (e, n)));
    (standings, rejected.collect())
}

/// The numbers of `keep` or `reject` of an entry.
fn decided(text: &str, entry: usize, field: &str) -> Vec<u64> {
    value_of(text, &format!("variants[{entry}].{field}")).and_then(|v| ron::from_str(v).ok()).unwrap_or_default()
}

/// The edits that write a decision, and a sentence that says what was done.
///
/// # Errors
///
/// When nothing can be decided about the variant.
pub(super) fn decision(loaded: &Loaded, manifest: &Manifest, asked: &Decide) -> Result<(Vec<Edit>, String), Refused> {
    let (all, rejected) = standings(loaded, manifest);
    if asked.decision == Decision::Forgive {
        let mut entries: Vec<usize> = rejected.iter().map(|r| r.0).collect();
        entries.dedup();
        let edits = entries.iter().map(|e| Edit::Remove { path: format!("variants[{e}].reject") }).collect();
        return Ok((edits, "What was rejected may come back".to_owned()));
    }
    let wrong = |why: &str| Refused::Wrong(why.to_owned());
    let name =
        manifest.variants.get(asked.index).map(|v| v.name.clone()).ok_or_else(|| wrong("there is no such variant"))?;
    let Some(Standing { entry, number: Some(number), .. }) = all.get(asked.index).copied() else {
        return Err(wrong("its entry gives this one tree; edit the entry to change it"));
    };
    let list = |field: &str, change: &dyn Fn(&mut Vec<u64>)| {
        let mut numbers = decided(&loaded.text, entry, field);
        let before = numbers.clone();
        change(&mut numbers);
        numbers.sort_unstable();
        numbers.dedup();
        let path = format!("variants[{entry}].{field}");
        if numbers == before {
            None
        } else if numbers.is_empty() {
            Some(Edit::Remove { path })
        } else {
            Some(Edit::Set { path, value: format!("{numbers:?}") })
        }
    };
    let without = |numbers: &mut Vec<u64>| numbers.retain(|n| *n != number);
    let with = |numbers: &mut Vec<u64>| numbers.push(number);
    let (keep, reject, told) = match asked.decision {
        Decision::Keep => (list("keep", &with), list("reject", &without), format!("{name} is kept: keep has {number}")),
        Decision::Free => (list("keep", &without), None, format!("{name} is kept no longer")),
        _ => (list("keep", &without), list("reject", &with), format!("{name} is rejected; another grows in its place")),
    };
    Ok((keep.into_iter().chain(reject).collect(), told))
}

/// What sliders can set in a file of a preset, and the hash of its text.
///
/// # Errors
///
/// When it is no file of the preset.
pub(super) fn knobs_of(folder: &Path, loaded: &Loaded, file: &str) -> Result<Value, Refused> {
    let own = own_file(loaded);
    let files = files(folder, loaded);
    let path = files.get(file).ok_or(Refused::NoFile)?;
    let text = fs::read_to_string(path).map_err(|_| Refused::NoFile)?;
    let of = if file == own { KnobsOf::Preset } else { KnobsOf::Species };
    let sources: Vec<Value> = loaded
        .plan
        .sources
        .iter()
        .map(|source| {
            let kind = match &source.recipe {
                SourceRecipe::Grow(_) => "grown",
                SourceRecipe::Import(_) => "imported",
                SourceRecipe::Like(_) => "grown like a scan",
            };
            let species = value_of(&loaded.text, &format!("sources[\"{}\"].species", source.name));
            let species: Option<String> = species.and_then(|s| ron::from_str(s).ok());
            // As the preset tells it; a species' own height does nothing then.
            let height = value_of(&loaded.text, &format!("sources[\"{}\"].height", source.name));
            json!({ "name": source.name, "kind": kind, "species": species, "height": height })
        })
        .collect();
    Ok(json!({
        "file": file,
        "base": hash(&text),
        "knobs": knobs(&text, of),
        "files": files.keys().collect::<Vec<_>>(),
        "sources": sources,
    }))
}

fn hash(text: &str) -> String {
    Key::of_bytes(text.as_bytes()).to_hex()
}

fn own_file(loaded: &Loaded) -> String {
    loaded.preset.rsplit('/').next().unwrap_or_default().to_owned()
}

/// The texts of a preset that may be edited, by name relative to its folder: itself, and the species that it reads.
fn files(folder: &Path, loaded: &Loaded) -> BTreeMap<String, PathBuf> {
    let base = loaded.world.path("");
    let inside = |path: &Path| {
        let real = path.canonicalize().ok()?;
        (real.starts_with(folder) && real.is_file() && path.extension().is_some_and(|e| e == "ron")).then_some(real)
    };
    let name = |path: &Path| Some(path.strip_prefix(&base).unwrap_or(path).to_str()?.replace('\\', "/"));
    loaded.world.reads().keys().filter_map(|path| Some((name(path)?, inside(path)?))).collect()
}

/// Writes edits of a file.
///
/// # Errors
///
/// See [`Refused`]; then nothing was written.
pub(super) fn save(folder: &Path, loaded: &Loaded, limits: &Limits, asked: &Save) -> Result<Value, Refused> {
    let files = files(folder, loaded);
    let path = files.get(&asked.file).ok_or(Refused::NoFile)?;
    let mut edits: Vec<Edit> = asked.edits.iter().map(Change::edit).collect();
    let append = asked.append.iter().cloned();
    edits.extend(append.map(|(path, value)| Edit::Append { path, value }));
    let text = write(loaded, limits, (&asked.file, path), &asked.base, &edits)?;
    Ok(json!({ "base": hash(&text) }))
}

/// Writes a decision.
///
/// # Errors
///
/// See [`Refused`]; then nothing was written.
pub(super) fn decide(
    folder: &Path,
    loaded: &Loaded,
    limits: &Limits,
    manifest: &Manifest,
    asked: &Decide,
) -> Result<Value, Refused> {
    if asked.key.as_ref() != Some(&manifest.key) {
        return Err(Refused::Stale);
    }
    let (edits, told) = decision(loaded, manifest, asked)?;
    let own = own_file(loaded);
    let files = files(folder, loaded);
    let path = files.get(&own).ok_or(Refused::NoFile)?;
    write(loaded, limits, (&own, path), &hash(&loaded.text), &edits)?;
    Ok(json!({ "told": told }))
}

/// Writes what is drawn as `sketches/NAME.svg`, what is drawn over it as `sketches/NAME-2.svg` and so on, and an entry of the preset
/// that follows all of it from where it was drawn, as large as it was drawn; entries that follow a drawing of such a name
/// already are brought to that view and size, and those of the first to what is drawn over it now.
///
/// # Errors
///
/// See [`Refused`]; then nothing was written, but where the disk refuses one of several files.
pub(super) fn draw(folder: &Path, loaded: &Loaded, limits: &Limits, asked: &Drawn) -> Result<Value, Refused> {
    let wrong = |why: &str| Refused::Wrong(why.to_owned());
    let name = asked.name.as_str();
    let good =
        (1..=64).contains(&name.len()) && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if !good || crate::preset::beside("", &format!("{name}.svg")).is_none() {
        return Err(wrong("name it with letters a to z, digits, _ and -"));
    }
    if loaded.plan.sources.iter().all(|source| source.name != asked.of) {
        return Err(wrong("there is no such source"));
    }
    let strokes = stroke_svgs(asked.before.iter().chain([&asked.stroke])).map_err(wrong)?;
    let sketches = folder.join("sketches");
    fs::create_dir_all(&sketches).map_err(|e| Refused::Wrong(format!("can't make the folder sketches: {e}")))?;
    // A link named `sketches` may lead elsewhere.
    let sketches = sketches.canonicalize().ok().filter(|real| real.starts_with(folder)).ok_or(Refused::NoFile)?;
    let over = |place: usize| if place == 0 { format!("{name}.svg") } else { format!("{name}-{}.svg", place + 1) };
    let is_there = |place: usize| sketches.join(over(place)).symlink_metadata().is_ok();
    if !asked.replace && (0..strokes.len()).any(is_there) {
        return Err(wrong("there is a sketch of that name; choose another, or replace it"));
    }
    let own = own_file(loaded);
    let all = files(folder, loaded);
    let preset = all.get(&own).ok_or(Refused::NoFile)?;
    let drawn: Vec<Placed<'_>> = strokes
        .iter()
        .enumerate()
        .map(|(i, (stroke, _, height))| Placed { file: over(i), stroke, height: *height })
        .collect();
    let (edits, added) = following(loaded, &asked.of, &drawn);
    let _turn = turn();
    let texts = drawn.iter().zip(&strokes).map(|(placed, (_, svg, _))| (placed.relative(), svg.clone()));
    let edited = Edited::new(loaded, limits, (&own, preset), &edits, texts)?;
    // In this order a build that comes in between finds no name without a file.
    for (placed, (_, svg, _)) in drawn.iter().zip(&strokes) {
        replace(&sketches.join(&placed.file), svg.as_bytes())
            .map_err(|e| Refused::Wrong(format!("can't write {}: {e}", placed.relative())))?;
    }
    edited.write()?;
    Ok(json!({ "file": drawn[0].relative(), "added": added }))
}

/// What is drawn, and where a preset has it.
struct Placed<'s> {
    file: String,
    stroke: &'s Stroke,
    height: f32,
}

impl Placed<'_> {
    fn relative(&self) -> String {
        format!("sketches/{}", self.file)
    }

    fn size(&self) -> String {
        format!("Metres({:.2})", self.height)
    }

    /// Each angle: its field, degrees, and how a plan has it.
    fn angles(&self) -> [(&'static str, f32, f32); 2] {
        let [view, elevation] = self.stroke.direction();
        [("view", self.stroke.view, view), ("elevation", self.stroke.elevation, elevation)]
    }

    /// The fields of a sketch that follows it.
    fn fields(&self) -> String {
        let told = self.angles().into_iter().filter(|angle| angle.2 != 0.0);
        let told: String = told.map(|(name, degrees, _)| format!("{name}: {degrees:?}, ")).collect();
        format!("crown: {:?}, {told}size: {}", self.relative(), self.size())
    }

    /// What brings a sketch to its view and size.
    fn edits(&self, sketch: &SketchParams) -> Vec<Edit> {
        let path = |name: &str| format!("{}.{name}", sketch.field);
        let mut edits = Vec::new();
        for ((name, degrees, told), is) in self.angles().into_iter().zip([sketch.view, sketch.elevation]) {
            match told {
                _ if told == is => {}
                0.0 => edits.push(Edit::Remove { path: path(name) }),
                _ => edits.push(Edit::Set { path: path(name), value: format!("{degrees:?}") }),
            }
        }
        if sketch.size != SketchScale::Metres(self.height) {
            edits.push(Edit::Set { path: path("size"), value: self.size() });
        }
        edits
    }
}

/// The edits by which a preset follows what is drawn, and whether they add an entry. What others wrote into `then` stays as long
/// as nothing is drawn over the first.
fn following(loaded: &Loaded, of: &str, drawn: &[Placed<'_>]) -> (Vec<Edit>, bool) {
    let (first, over) = (&drawn[0], &drawn[1..]);
    let then: Vec<String> = over.iter().map(|placed| format!("({})", placed.fields())).collect();
    let then = format!("[{}]", then.join(", "));
    let (mut edits, mut added) = (Vec::new(), true);
    let stem = first.file.strip_suffix("svg").unwrap_or_default().trim_end_matches('.');
    let is_own = |sketch: &SketchParams| sketch.crown.starts_with(&format!("sketches/{stem}-"));
    for sketch in loaded.plan.drawn() {
        let is_first = sketch.crown == first.relative();
        added &= !is_first;
        let is_as_drawn =
            sketch.then.iter().map(|over| &over.crown).eq(&over.iter().map(Placed::relative).collect::<Vec<_>>());
        let keeps = !is_first || is_as_drawn || (over.is_empty() && !sketch.then.iter().all(is_own));
        for sketch in sketch.each().take(if keeps { usize::MAX } else { 1 }) {
            let placed = drawn.iter().find(|placed| placed.relative() == sketch.crown);
            edits.extend(placed.map(|placed| placed.edits(sketch)).unwrap_or_default());
        }
        if !keeps {
            let path = format!("{}.then", sketch.field);
            edits.push(if over.is_empty() { Edit::Remove { path } } else { Edit::Set { path, value: then.clone() } });
        }
    }
    if added {
        let then = if over.is_empty() { String::new() } else { format!(", then: {then}") };
        let value = format!("Sketch(of: {of:?}, {}{then})", first.fields());
        edits.push(Edit::Append { path: "variants".to_owned(), value });
    }
    (edits, added)
}

/// Edits a file, where it is the one that was seen, sees that the preset still loads, and writes it.
fn write(loaded: &Loaded, limits: &Limits, file: (&str, &Path), base: &str, edits: &[Edit]) -> Result<String, Refused> {
    let _turn = turn();
    if hash(&fs::read_to_string(file.1).map_err(|_| Refused::NoFile)?) != base {
        return Err(Refused::Stale);
    }
    let edited = Edited::new(loaded, limits, file, edits, [])?;
    edited.write()?;
    Ok(edited.new)
}

/// Whoever holds it writes alone: between the look at a file and its replacement no other page changes it.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file with edits that are not written yet, with which the preset loads.
struct Edited<'a> {
    file: &'a str,
    path: &'a Path,
    old: String,
    new: String,
}

impl<'a> Edited<'a> {
    /// `beside` are other files that are to hold other texts then.
    fn new(
        loaded: &Loaded,
        limits: &Limits,
        (file, path): (&'a str, &'a Path),
        edits: &[Edit],
        beside: impl IntoIterator<Item = (String, String)>,
    ) -> Result<Self, Refused> {
        let old = fs::read_to_string(path).map_err(|_| Refused::NoFile)?;
        let new = edited(&old, edits).map_err(|error| Refused::Wrong(error.to_string()))?;
        let texts = BTreeMap::from_iter(beside.into_iter().chain([(file.to_owned(), new.clone())]));
        load_edited(Path::new(&loaded.preset), limits, texts).map_err(Refused::Broken)?;
        Ok(Self { file, path, old, new })
    }

    /// Where nobody else, an editor say, wrote the file meanwhile.
    fn write(&self) -> Result<(), Refused> {
        if fs::read_to_string(self.path).is_ok_and(|text| text != self.old) {
            return Err(Refused::Stale);
        }
        replace(self.path, self.new.as_bytes()).map_err(|e| Refused::Wrong(format!("can't write {}: {e}", self.file)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::load_preset;

    const TEXT: &str = "// two oaks\n(\n    sources: {\n        \"a\": Import(file: \"a.swc\"), // first\n        \"b\": \
        Import(file: \"a.swc\"),\n    },\n    variants: [Source(\"a\"), Blend(of: [\"a\", \"b\"], count: 3)],\n)\n";

    fn project() -> (tempfile::TempDir, PathBuf, Loaded) {
        let folder = tempfile::tempdir().unwrap();
        let real = folder.path().canonicalize().unwrap();
        fs::write(real.join("p.ron"), TEXT).unwrap();
        let loaded = load_preset(&real.join("p.ron")).unwrap();
        (folder, real, loaded)
    }

    fn saved(file: &str, base: &str, value: &str) -> Save {
        let edits = vec![Change { path: "variants[1].count".into(), value: Some(value.into()) }];
        Save { preset: "p.ron".into(), file: file.into(), base: base.into(), edits, append: Vec::new() }
    }

    #[test]
    fn edits_are_saved_with_all_comments_and_only_where_the_text_is_the_one_that_was_seen() {
        let (_folder, real, loaded) = project();
        let limits = Limits::default();
        let base = hash(TEXT);
        save(&real, &loaded, &limits, &saved("p.ron", &base, "5")).unwrap();
        let now = fs::read_to_string(real.join("p.ron")).unwrap();
        assert_eq!(now, TEXT.replace("count: 3", "count: 5"));
        assert!(matches!(save(&real, &loaded, &limits, &saved("p.ron", &base, "6")), Err(Refused::Stale)));
        let base = hash(&now);
        assert!(matches!(save(&real, &loaded, &limits, &saved("p.ron", &base, "-1")), Err(Refused::Broken(_))));
        for file in ["../p.ron", "a.swc", "/etc/passwd", "", "q.ron"] {
            assert!(matches!(save(&real, &loaded, &limits, &saved(file, &base, "6")), Err(Refused::NoFile)), "{file}");
        }
        assert_eq!(fs::read_to_string(real.join("p.ron")).unwrap(), now);
        assert_eq!(fs::read_dir(&real).unwrap().count(), 1, "nothing is left behind");
    }

    /// The entry of a crown that is drawn as `spike`.
    fn entry_of_spike() -> &'static str {
        "count: 3), Sketch(of: \"a\", crown: \"sketches/spike.svg\", size: Metres(4.00))]"
    }

    #[test]
    fn a_crown_is_saved_beside_the_preset_and_named_in_it_once() {
        let (_folder, real, loaded) = project();
        let limits = Limits::default();
        let drawn = |name: &str, replace| Drawn {
            preset: "p.ron".into(),
            of: "a".into(),
            name: name.into(),
            before: Vec::new(),
            stroke: Stroke { points: vec![[-1.0, 1.0], [1.0, 1.0], [0.0, 4.0]], ..Stroke::default() },
            replace,
        };
        for name in ["", "../x", "a b", "x/y", &"n".repeat(65)] {
            assert!(draw(&real, &loaded, &limits, &drawn(name, true)).is_err(), "{name}");
        }
        assert_eq!(draw(&real, &loaded, &limits, &drawn("spike", false)).unwrap()["added"], true);
        let text = fs::read_to_string(real.join("p.ron")).unwrap();
        let entry = entry_of_spike();
        assert_eq!(text, TEXT.replace("count: 3)]", entry));
        let loaded = load_preset(&real.join("p.ron")).unwrap();
        assert!(draw(&real, &loaded, &limits, &drawn("spike", false)).is_err());
        assert_eq!(draw(&real, &loaded, &limits, &drawn("spike", true)).unwrap()["added"], false);
        assert_eq!(fs::read_to_string(real.join("p.ron")).unwrap(), text);
        // Drawn anew from elsewhere, the entry goes along, and comes back.
        let line =
            Stroke { points: vec![[-1.0, 3.0], [0.0, 4.0], [1.0, 3.0]], open: true, view: 35.5, elevation: 40.0 };
        let above = Drawn { stroke: line, ..drawn("spike", true) };
        assert_eq!(draw(&real, &loaded, &limits, &above).unwrap()["added"], false);
        let raised = fs::read_to_string(real.join("p.ron")).unwrap();
        let entry = entry.replace("Metres(4.00))", "Metres(5.00), view: 35.5, elevation: 40.0)");
        assert_eq!(raised, TEXT.replace("count: 3)]", &entry));
        let loaded = load_preset(&real.join("p.ron")).unwrap();
        draw(&real, &loaded, &limits, &drawn("spike", true)).unwrap();
        assert_eq!(fs::read_to_string(real.join("p.ron")).unwrap(), text);
        // What is drawn over it stands beside it, and in its entry: two over one, one other, and none.
        let line =
            |view| Stroke { points: vec![[-1.0, 3.0], [0.0, 4.0], [1.0, 3.0]], open: true, view, elevation: 0.0 };
        let over = |last: Stroke, more: Vec<Stroke>| {
            let loaded = load_preset(&real.join("p.ron")).unwrap();
            let before = std::iter::once(drawn("spike", true).stroke).chain(more).collect();
            let asked = Drawn { before, stroke: last, ..drawn("spike", true) };
            assert_eq!(draw(&real, &loaded, &limits, &asked).unwrap()["added"], false);
            fs::read_to_string(real.join("p.ron")).unwrap()
        };
        let own =
            |then: &str| TEXT.replace("count: 3)]", &format!("{}{then})]", entry_of_spike().trim_end_matches(")]")));
        let told = |n: u32, view: &str| format!("(crown: \"sketches/spike-{n}.svg\", {view}size: Metres(5.00))");
        let two = format!(", then: [{}, {}]", told(2, "view: 90.0, "), told(3, ""));
        assert_eq!(over(line(0.0), vec![line(90.0)]), own(&two));
        assert!(real.join("sketches/spike-3.svg").is_file());
        assert_eq!(over(line(180.0), Vec::new()), own(&format!(", then: [{}]", told(2, "view: 180.0, "))));
        let refused = Drawn { before: vec![line(0.0)], replace: false, ..drawn("spike", false) };
        assert!(draw(&real, &load_preset(&real.join("p.ron")).unwrap(), &limits, &refused).is_err());
        draw(&real, &load_preset(&real.join("p.ron")).unwrap(), &limits, &drawn("spike", true)).unwrap();
        assert_eq!(fs::read_to_string(real.join("p.ron")).unwrap(), text);
        // What somebody wrote over it is kept.
        let theirs =
            text.replace("Metres(4.00))", "Metres(4.00), then: [(crown: \"sketches/spike.svg\", view: 90.0)])");
        fs::write(real.join("p.ron"), &theirs).unwrap();
        let loaded = load_preset(&real.join("p.ron")).unwrap();
        draw(&real, &loaded, &limits, &drawn("spike", true)).unwrap();
        let now = fs::read_to_string(real.join("p.ron")).unwrap();
        assert_eq!(now, theirs.replace("view: 90.0)]", "size: Metres(4.00))]"));
        fs::write(real.join("p.ron"), &text).unwrap();
        let loaded = load_preset(&real.join("p.ron")).unwrap();
        // A preset that somebody breaks meanwhile keeps its drawing.
        let sketch = fs::read(real.join("sketches/spike.svg")).unwrap();
        fs::write(real.join("p.ron"), "(").unwrap();
        let points = vec![[-2.0, 1.0], [2.0, 1.0], [0.0, 5.0]];
        let other = Drawn { stroke: Stroke { points, ..Stroke::default() }, ..drawn("spike", true) };
        assert!(draw(&real, &loaded, &limits, &other).is_err());
        assert_eq!(fs::read(real.join("sketches/spike.svg")).unwrap(), sketch);
    }
}
