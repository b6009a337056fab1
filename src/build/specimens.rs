//! Contact sheets of species: three trees of each species file beside the presets, for the gallery.
//!
//! A species says how wood grows; leaves and bark are the presets'. So its sheet shows bare trees, of the seeds 1, 2 and 3,
//! at one scale. The sheets lie in `OUT/gallery.species`, a name that no set can have, and are what a folder's build
//! makes beside its sets: no set hangs on them, `--check` doesn't ask for them, and a species that can't be grown is told
//! in the gallery instead of failing a build that may not even use it.
//!
//! `OUT/.treewright-species` remembers, by species, what its sheet was made from and the sheet's hash: while those are the
//! same nothing is grown. Its paths start from `OUT`, so a copied project has its own. A sheet says that Treewright drew it,
//! also where what is remembered was lost; a file of somebody else's with the name of a sheet stays as it is.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use flate2::Crc;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::output::{OutputError, Turn};
use super::replace::replace_in;
use super::{Cache, Focus, Limits, Loaded, Studio, World, find, gallery, pipeline, stamp};
use crate::bake::{Picture, SheetCell, SheetColors, SheetColumn, SheetLayout, SheetRow};
use crate::base::{Diagnostic, Key, Seed};
use crate::export::{self, PngKind};
use crate::lod::mesh_levels;

/// Folder of the sheets, below the folder of sets.
const FOLDER: &str = "gallery.species";
/// What is remembered of them.
const INDEX: &str = ".treewright-species";
/// Folder of species files, below that of presets.
const SPECIES: &str = "species";
/// Raised when sheets are drawn in another way.
const VERSION: u32 = 2;
/// What a PNG begins with, up to its first chunk's end.
const HEADER: usize = 33;
/// Who drew a sheet, as the text of a PNG (`tEXt`).
const SIGNED: &[u8] = b"tEXtSoftware\0treewright";
/// Seeds of the trees on a sheet.
const SEEDS: [u64; 3] = [1, 2, 3];
/// Largest species file that is looked at, bytes.
const LARGEST: u64 = 1 << 20;

/// One species file and its sheet.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Specimen {
    /// Its name, that of the file without its end.
    pub name: String,
    /// What the file says of itself: its first comment.
    pub about: String,
    /// The first of what is wrong with it, if anything; then it has no sheet.
    pub wrong: Option<String>,
    /// The folder of presets beside which it lies, from the folder of sets.
    folder: String,
    /// Every file that it was grown from, with its hash; none for one that was missing. A path that is no UTF-8 is kept
    /// as near as text can be, and so never found: such a species is drawn anew by every build.
    reads: Vec<(String, Option<String>)>,
    /// Hash of the sheet, or of the file of somebody else's in its place; empty where neither is.
    sheet: String,
}

impl Specimen {
    /// Where its sheet lies, relative to the folder of sets; `/` between folders.
    #[must_use]
    pub fn sheet(&self) -> String {
        format!("{FOLDER}/{}_contact.png", self.name)
    }

    /// Whether the files that it was made from and its sheet are as they were.
    fn is_current(&self, out: &Path) -> bool {
        let hash = |path: &Path| {
            let small = fs::metadata(path).is_ok_and(|m| m.is_file());
            small.then(|| fs::read(path).ok()).flatten().map(|bytes| Key::of_bytes(&bytes).to_hex())
        };
        let is_same = |(path, key): &(String, Option<String>)| hash(&out.join(path)) == *key;
        let has_none = self.wrong.is_some() && self.sheet.is_empty();
        let has_sheet = has_none || hash(&out.join(self.sheet())).is_some_and(|key| key == self.sheet);
        has_sheet && self.reads.iter().all(is_same)
    }
}

/// What is remembered.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Index {
    version: String,
    specimens: Vec<Specimen>,
}

/// The species whose sheets lie in `out`, in order of name.
#[must_use]
pub fn specimens(out: &Path) -> Vec<Specimen> {
    let index = stamp::bytes(&out.join(INDEX)).ok().and_then(|bytes| serde_json::from_slice::<Index>(&bytes).ok());
    index.filter(|index| index.version == version()).unwrap_or_default().specimens
}

fn version() -> String {
    format!("{} {} {VERSION}", env!("CARGO_PKG_VERSION"), pipeline::VERSION)
}

/// What is to be done for a folder's species.
struct Due {
    /// Those of other folders.
    all: Vec<Specimen>,
    /// Those that are as they were.
    kept: Vec<Specimen>,
    /// Those to be drawn, by name and file.
    due: Vec<(String, PathBuf)>,
    /// Those that are gone.
    gone: Vec<Specimen>,
}

impl Due {
    /// For the files `found` in a folder, `named` so from `out`.
    fn of(found: &[(String, PathBuf)], named: &str, out: &Path) -> Self {
        let is_ours = |known: &Specimen| known.folder == named || !out.join(&known.folder).is_dir();
        let (ours, all): (Vec<Specimen>, Vec<Specimen>) = specimens(out).into_iter().partition(is_ours);
        let mut ours: BTreeMap<String, Specimen> = ours.into_iter().map(|known| (known.name.clone(), known)).collect();
        // A species of another folder has the name: the first that was drawn keeps it.
        let files = found.iter().filter(|(name, _)| all.iter().all(|known| known.name != *name));
        let (mut kept, mut due) = (Vec::new(), Vec::new());
        for (name, path) in files {
            match ours.remove(name) {
                Some(known) if known.is_current(out) => kept.push(known),
                _ => due.push((name.clone(), path.clone())),
            }
        }
        Self { all, kept, due, gone: ours.into_values().collect() }
    }

    fn is_nothing(&self) -> bool {
        self.due.is_empty() && self.gone.is_empty()
    }
}

/// Draws the sheets of the species beside a folder of presets (`FOLDER/species/*.ron`) that are not current, and
/// removes those of species that are gone; whether there was anything to do.
///
/// # Errors
///
/// When `out` can't be written: about the file that it is.
pub fn draw_specimens(folder: &Path, out: &Path, limits: &Limits, cache: &Arc<Cache>) -> Result<bool, Diagnostic> {
    drawn_into(folder, out, limits, cache).map_err(|error| error.diagnostic())
}

/// What the file system said of a path.
fn refused(path: &Path) -> impl FnOnce(io::Error) -> OutputError {
    let path = path.to_path_buf();
    move |source| OutputError::Io { path, source }
}

fn drawn_into(folder: &Path, out: &Path, limits: &Limits, cache: &Arc<Cache>) -> Result<bool, OutputError> {
    // The same folder, wherever the build is called from.
    let folder = &folder.canonicalize().map_err(refused(folder))?;
    let shown = out;
    let found = species_files(folder);
    if found.is_empty() && specimens(out).is_empty() {
        return Ok(false);
    }
    fs::create_dir_all(out).map_err(refused(out))?;
    let out = &out.canonicalize().map_err(refused(out))?;
    let named = from(out, folder);
    if Due::of(&found, &named, out).is_nothing() {
        return Ok(false);
    }
    let turn = Turn::take(shown, || {})?;
    // Somebody else may have drawn meanwhile: what is written below is what stands there now, and more.
    let due = Due::of(&found, &named, out);
    if due.is_nothing() {
        return Ok(false);
    }
    let Due { mut all, mut kept, due, gone } = due;
    fs::create_dir_all(out.join(FOLDER)).map_err(refused(&shown.join(FOLDER)))?;
    let made: Vec<Result<Specimen, OutputError>> = due
        .par_iter()
        .map(|(name, path)| {
            let (mut specimen, png) = drawn(folder, out, (name, path), limits, cache);
            let target = out.join(specimen.sheet());
            let told = shown.join(specimen.sheet());
            match (&png, stamp::bytes(&target).ok()) {
                (Some(_), Some(old)) if !is_signed(&old) => {
                    specimen.wrong = Some("a file that Treewright did not write has the name of its sheet".to_owned());
                    specimen.sheet = hex(&old);
                }
                (Some(png), _) => replace_in(&turn, &target, png).map_err(refused(&told))?,
                (None, Some(old)) if is_signed(&old) => fs::remove_file(&target).map_err(refused(&told))?,
                _ => {}
            }
            Ok(specimen)
        })
        .collect();
    for gone in gone {
        let sheet = out.join(gone.sheet());
        if stamp::bytes(&sheet).is_ok_and(|bytes| is_signed(&bytes) && hex(&bytes) == gone.sheet) {
            fs::remove_file(&sheet).map_err(refused(&shown.join(gone.sheet())))?;
        }
    }
    all.append(&mut kept);
    all.extend(made.into_iter().collect::<Result<Vec<_>, _>>()?);
    all.sort_by(|a, b| a.name.cmp(&b.name));
    // Goes only if nothing is in it.
    let _ = fs::remove_dir(out.join(FOLDER));
    let index = Index { version: version(), specimens: all };
    let bytes = serde_json::to_vec(&index).map_err(io::Error::other);
    let written = bytes.and_then(|bytes| replace_in(&turn, &out.join(INDEX), &bytes));
    written.map_err(refused(&shown.join(INDEX)))?;
    Ok(true)
}

/// The way from one folder to a path, both absolute, with `/` between folders.
fn from(folder: &Path, path: &Path) -> String {
    let same = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(same).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(path.components().skip(same)).collect();
    // Of another drive nothing is the same, and the path stays whole.
    find::shown(if same == 0 { path } else { &way })
}

/// The sheet with the text in it that tells who drew it.
fn signed(png: &[u8]) -> Vec<u8> {
    let mut crc = Crc::new();
    crc.update(SIGNED);
    let length = (SIGNED.len() as u32 - 4).to_be_bytes();
    let (header, rest) = png.split_at(HEADER.min(png.len()));
    [header, &length, SIGNED, &crc.sum().to_be_bytes(), rest].concat()
}

/// Whether a file is a sheet of ours, of whatever version.
fn is_signed(bytes: &[u8]) -> bool {
    bytes.get(HEADER + 4..).is_some_and(|rest| rest.starts_with(SIGNED))
}

fn hex(bytes: &[u8]) -> String {
    Key::of_bytes(bytes).to_hex()
}

/// The species files beside a folder's presets, by name: those whose names can be part of a file's name.
fn species_files(folder: &Path) -> Vec<(String, PathBuf)> {
    let Ok(entries) = fs::read_dir(folder.join(SPECIES)) else { return Vec::new() };
    let mut files: Vec<(String, PathBuf)> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|end| end == "ron"))
        .filter(|path| fs::metadata(path).is_ok_and(|m| m.is_file() && m.len() <= LARGEST))
        .filter_map(|path| Some((path.file_stem()?.to_str()?.to_owned(), path)))
        .filter(|(name, _)| name.len() <= 64 && name.bytes().all(|b| b.is_ascii_alphanumeric() || b"_-".contains(&b)))
        .collect();
    files.sort();
    files
}

/// Grows a species and draws its sheet.
fn drawn(
    folder: &Path,
    out: &Path,
    (name, path): (&str, &Path),
    limits: &Limits,
    cache: &Arc<Cache>,
) -> (Specimen, Option<Vec<u8>>) {
    let world = World::within(folder, limits.clone());
    let relative = format!("{SPECIES}/{name}.ron");
    let said = world.read_text(&relative).unwrap_or_default();
    let sources: Vec<String> =
        SEEDS.iter().map(|seed| format!("\"seed-{seed}\": Grow(species: \"{relative}\", seed: {seed})")).collect();
    let variants: Vec<String> = SEEDS.iter().map(|seed| format!("Source(\"seed-{seed}\")")).collect();
    let preset = format!(
        "(sources: {{{}}}, variants: [{}], foliage: (density: 0.0, pictures: 1, resolution: 64), \
         bark: (resolution: 256), lods: [Full])",
        sources.join(", "),
        variants.join(", ")
    );
    let preset_name = "gallery.ron";
    let world = world.with_texts(BTreeMap::from([(preset_name.to_owned(), preset)]));
    let shown = find::shown(path);
    let (made, reads) = match find::load_from(world, preset_name, shown) {
        Ok(loaded) => (sheet(&loaded, cache), loaded.world.reads()),
        Err(failure) => (Err(failure.0), failure.1.reads()),
    };
    let reads = reads.into_iter().map(|(path, key)| (from(out, &path), key.map(Key::to_hex))).collect();
    let (png, wrong) = match made {
        Ok(png) => (Some(signed(&png)), None),
        Err(found) => (None, Some(found.first().map_or_else(String::new, |first| first.message.clone()))),
    };
    let sheet = png.as_deref().map(hex).unwrap_or_default();
    let about = gallery::first_comment(&said);
    (Specimen { name: name.to_owned(), about, wrong, folder: from(out, folder), reads, sheet }, png)
}

fn sheet(loaded: &Loaded, cache: &Arc<Cache>) -> Result<Vec<u8>, Vec<Diagnostic>> {
    let studio = Studio::open(loaded, Focus::Sources, cache.clone())?;
    let meshes: Vec<_> = studio
        .sources()
        .par_iter()
        .filter_map(|plant| mesh_levels(plant, &studio.plan().mesh, &[], Seed::new(0)).into_iter().next())
        .collect();
    let column = |(plant, (mesh, seed))| SheetColumn {
        label: format!("seed {seed}  {:.1} m", crate::plant::Plant::height(plant)),
        shown: String::new(),
        mesh,
    };
    let row = SheetRow {
        label: String::new(),
        columns: studio.sources().iter().zip(meshes.iter().zip(SEEDS)).map(column).collect(),
    };
    let (leaves, bark) = studio.pictures();
    let leaf = leaves.first().unwrap_or(bark);
    let layout = SheetLayout::new(std::slice::from_ref(&row));
    let [bark_picture, leaf_picture] = [bark, leaf].map(Picture::new);
    // All in the first column's way: these are trees, not the levels of one.
    let drawn: Vec<Arc<SheetCell>> = layout
        .cells()
        .iter()
        .map(|&(place, column)| {
            let mesh = row.columns[column].mesh;
            Arc::new(layout.scale(place).draw(0, mesh, &bark_picture, std::slice::from_ref(&leaf_picture)))
        })
        .collect();
    let [bark_colors, leaf_colors] = [bark, leaf].map(|maps| SheetColors::of((maps.width, maps.height), &maps.color));
    let sheet = layout.paint(&drawn, &bark_colors, &|_| vec![&leaf_colors]);
    export::encode_quickly(&sheet.pixels, sheet.width, sheet.height, PngKind::Rgb)
        .map_err(|error| vec![Diagnostic::new("", error.to_string())])
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWIG: &str = "// A twig.\n(height: 2.0, nodes: 500, iterations: [(endpoints: Volume(shape: HalfEllipsoid(\
        bottom: 0.35, top: 0.9, radius: 0.36), count: 6))])";

    #[test]
    fn sheets_follow_their_species_and_nothing_else() {
        let project = tempfile::tempdir().unwrap();
        let (folder, out) = (project.path().join("trees"), project.path().join("out"));
        fs::create_dir_all(folder.join(SPECIES)).unwrap();
        let species = |name: &str| folder.join(SPECIES).join(name);
        fs::write(species("twig.ron"), TWIG).unwrap();
        fs::write(species("bad.ron"), "// Broken.\n(heigth: 2.0)").unwrap();
        fs::write(species("notes.txt"), "no species").unwrap();
        let cache = Arc::new(Cache::default());
        let draw = || draw_specimens(&folder, &out, &Limits::default(), &cache).unwrap();
        let sheet = out.join("gallery.species/twig_contact.png");
        assert!(draw());
        let known = specimens(&out);
        assert_eq!(
            known.iter().map(|s| (s.name.as_str(), s.wrong.is_some())).collect::<Vec<_>>(),
            [("bad", true), ("twig", false)]
        );
        assert_eq!(known[1].about, "A twig.");
        let image = image::load_from_memory(&fs::read(&sheet).unwrap()).unwrap().into_rgb8();
        assert!(image.width() > image.height() && image.pixels().any(|p| p != image.get_pixel(0, 0)));
        assert!(!draw(), "unchanged");
        let first = fs::read(&sheet).unwrap();
        fs::write(species("twig.ron"), TWIG.replace("2.0", "3.0")).unwrap();
        assert!(draw());
        assert_ne!(fs::read(&sheet).unwrap(), first);
        fs::remove_file(&sheet).unwrap();
        assert!(draw(), "a lost sheet is drawn again");
        fs::write(species("bad.ron"), TWIG).unwrap();
        assert!(draw(), "a mended species");
        assert!(specimens(&out).iter().all(|s| s.wrong.is_none()));
        fs::remove_file(species("twig.ron")).unwrap();
        assert_eq!((draw(), sheet.exists(), specimens(&out).len()), (true, false, 1));
        // A file of somebody's stays.
        fs::write(&sheet, "mine").unwrap();
        fs::write(species("twig.ron"), TWIG).unwrap();
        draw();
        assert_eq!(fs::read(&sheet).unwrap(), b"mine");
        assert!(!draw(), "it is still in the way");
        fs::remove_file(&sheet).unwrap();
        assert_eq!((draw(), specimens(&out)[1].wrong.clone()), (true, None));
    }

    #[test]
    fn sheets_are_known_without_the_index_and_a_copied_project_draws_its_own() {
        let project = tempfile::tempdir().unwrap();
        let at = |name: &str| project.path().join(name);
        let draw = |project: &str| {
            draw_specimens(&at(project).join("trees"), &at(project).join("out"), &Limits::default(), &Arc::default())
                .unwrap()
        };
        let sheet = |project: &str| fs::read(at(project).join("out/gallery.species/twig_contact.png")).unwrap();
        fs::create_dir_all(at("a/trees/species")).unwrap();
        fs::write(at("a/trees/species/twig.ron"), TWIG).unwrap();
        assert!(draw("a"));
        let first = sheet("a");
        // The index is of another version, and the species another one.
        let index = fs::read_to_string(at("a/out/.treewright-species")).unwrap();
        fs::write(at("a/out/.treewright-species"), index.replacen("\"version\":\"", "\"version\":\"0", 1)).unwrap();
        fs::write(at("a/trees/species/twig.ron"), TWIG.replace("2.0", "3.0")).unwrap();
        assert!(draw("a"));
        assert!(sheet("a") != first && specimens(&at("a/out"))[0].wrong.is_none());
        // A copy beside it, in which nothing is to be done until one of its own files changes.
        for folder in ["trees/species", "out/gallery.species"] {
            fs::create_dir_all(at("b").join(folder)).unwrap();
        }
        for file in ["trees/species/twig.ron", "out/gallery.species/twig_contact.png", "out/.treewright-species"] {
            fs::copy(at("a").join(file), at("b").join(file)).unwrap();
        }
        assert!(!draw("b"));
        fs::write(at("b/trees/species/twig.ron"), TWIG).unwrap();
        assert!(draw("b"));
        assert!(sheet("b") == first && sheet("a") != first);
    }
}
