//! A page beside the sets that shows them all: contact sheets, what each preset says of itself, variants and triangles;
//! and below them the species, each with what it says of itself and three trees of it.
//!
//! It is one file of HTML without scripts, made of the manifests, so that it can be opened from a disk or put on any
//! server. A file of that name that Treewright did not write is left alone.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::Deserialize;

use super::output::{OutputError, Turn};
use super::replace::replace_in;
use super::stamp::{self, Stamp};
use super::{Specimen, record, specimens};
use crate::base::{Diagnostic, counted};

/// Name of the page.
pub const GALLERY: &str = "gallery.html";
/// What its first line says; without it the file is somebody's own.
const MARK: &str = "<!-- Made by treewright: gallery of the sets in this folder. -->\n";

const STYLE: &str = "\
:root{color-scheme:light dark}\
body{font:16px/1.5 system-ui,sans-serif;max-width:80rem;margin:2rem auto;padding:0 1rem}\
section{margin:0 0 3rem}\
h2{margin:0}\
p{margin:.25rem 0 .75rem;opacity:.8}\
img{max-width:100%;height:auto;border-radius:.5rem;border:1px solid #8884}\
";

/// Writes the page for the sets in `out`, with what is said of each preset (file and text); tells whether it is there.
/// It is replaced as a whole, and only where it would be another one.
///
/// # Errors
///
/// When `out` can't be read or written: about the file that it is.
pub fn gallery(out: &Path, presets: &[PathBuf]) -> Result<bool, Diagnostic> {
    Shown::default().gallery(out, presets)
}

/// What the page shows of sets, by their folders, and of which manifests: who watches asks after each save, and reads those only
/// that are others then.
#[derive(Debug, Default)]
pub(super) struct Shown(Mutex<BTreeMap<PathBuf, (Stamp, Set)>>);

/// What the page shows of a manifest.
#[derive(Clone, Debug, Deserialize)]
struct Set {
    set: String,
    variants: Vec<Variant>,
}

#[derive(Clone, Debug, Deserialize)]
struct Variant {
    levels: Vec<Level>,
}

#[derive(Clone, Debug, Deserialize)]
struct Level {
    triangles: u64,
}

impl Shown {
    /// As [`gallery`].
    pub(super) fn gallery(&self, out: &Path, presets: &[PathBuf]) -> Result<bool, Diagnostic> {
        let mut sets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        written(out, presets, &mut sets)
    }
}

fn written(out: &Path, presets: &[PathBuf], known: &mut BTreeMap<PathBuf, (Stamp, Set)>) -> Result<bool, Diagnostic> {
    let refused = |path: PathBuf| move |source: io::Error| OutputError::Io { path, source }.diagnostic();
    let mut pages = || pages(out, presets, known).map_err(refused(out.to_path_buf()));
    let is_current = |(old, new): (String, String)| old == new;
    match pages()?.map(is_current) {
        Some(false) => {}
        current => return Ok(current.is_some()),
    }
    // Of two builds into one folder the later sees the sets of both.
    let turn = Turn::take(out, || {}).map_err(|error| error.diagnostic())?;
    let Some((_, new)) = pages()? else { return Ok(false) };
    replace_in(&turn, &out.join(GALLERY), new.as_bytes()).map_err(refused(out.join(GALLERY)))?;
    Ok(true)
}

/// The page as it is, empty where there is none, and as it is to be; none where Treewright did not write it.
fn pages(
    out: &Path,
    presets: &[PathBuf],
    known: &mut BTreeMap<PathBuf, (Stamp, Set)>,
) -> io::Result<Option<(String, String)>> {
    let old = match fs::read(out.join(GALLERY)) {
        // An empty one was cut off, and holds nothing of anybody.
        Ok(old) if !old.is_empty() && !old.starts_with(MARK.as_bytes()) => return Ok(None),
        Ok(old) => String::from_utf8_lossy(&old).into_owned(),
        Err(_) => String::new(),
    };
    let about: BTreeMap<String, String> = presets
        .iter()
        .filter_map(|preset| {
            let text = fs::read_to_string(preset).ok()?;
            Some((preset.file_stem()?.to_string_lossy().into_owned(), escaped(&first_comment(&text))))
        })
        .collect();
    let mut before = std::mem::take(known);
    let mut sets = Vec::new();
    for entry in fs::read_dir(out)?.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path().join(record::manifest_name(&name));
        let now = stamp::now();
        let kept = before.remove(&path).filter(|(stamp, _)| Stamp::at(&path) == Some(*stamp));
        let read = || {
            let (bytes, stamp) = stamp::read_at(&path).ok()?;
            Some((stamp, serde_json::from_slice::<Set>(&bytes).ok()?))
        };
        let Some((stamp, set)) = kept.map(|(stamp, set)| (Some(stamp), set)).or_else(read) else { continue };
        if let Some(stamp) = stamp.filter(|stamp| !stamp.is_racy(now)) {
            known.insert(path, (stamp, set.clone()));
        }
        sets.push(set);
    }
    sets.sort_by(|a, b| a.set.cmp(&b.set));
    let mut html = format!(
        "{MARK}<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width\">\n<title>Trees</title>\n<style>{STYLE}</style>\n<h1>{}</h1>\n",
        counted(sets.len(), "set", "sets")
    );
    for set in &sets {
        // Sets of other presets were made into this folder earlier.
        section(&mut html, set, about.get(&set.set).map_or_else(|| said_of(&old, &set.set), String::as_str));
    }
    let species = specimens(out);
    if !species.is_empty() {
        let _ = writeln!(html, "<h1>{} species</h1>", species.len());
    }
    for specimen in &species {
        of_species(&mut html, specimen);
    }
    Ok(Some((old, html)))
}

/// What stands in a preset's comment before anything else, up to the first empty line of it.
pub(super) fn first_comment(text: &str) -> String {
    let lines = text.lines().map(str::trim).skip_while(|line| line.is_empty());
    let comment = lines.map_while(|line| line.strip_prefix("//")).map(str::trim).take_while(|line| !line.is_empty());
    comment.collect::<Vec<_>>().join(" ")
}

/// What a page says of a set, as HTML; empty where it says nothing.
fn said_of<'a>(page: &'a str, set: &str) -> &'a str {
    let name = escaped(set);
    let head = format!("<section id=\"{name}\">\n<h2>{name}</h2>\n<p>");
    // The last paragraph is that of its variants.
    let Some((said, rest)) = page.split_once(&head).and_then(|(_, rest)| rest.split_once("</p>\n")) else { return "" };
    if rest.starts_with("<p>") { said } else { "" }
}

/// `about` is HTML.
fn section(html: &mut String, set: &Set, about: &str) {
    let name = escaped(&set.set);
    let triangles: Vec<u64> = set.variants.iter().filter_map(|v| v.levels.first()).map(|l| l.triangles).collect();
    let (low, high) = (triangles.iter().min().copied().unwrap_or(0), triangles.iter().max().copied().unwrap_or(0));
    let triangles = if low == high { low.to_string() } else { format!("{low} to {high}") };
    let levels = set.variants.first().map_or(0, |v| v.levels.len());
    let variants = counted(set.variants.len(), "variant", "variants");
    let levels = counted(levels, "level", "levels");
    let about = if about.is_empty() { String::new() } else { format!("<p>{about}</p>\n") };
    let _ = write!(
        html,
        "<section id=\"{name}\">\n<h2>{name}</h2>\n{about}<p>{variants}, {levels} of detail, {triangles} \
         triangles at the first</p>\n<a href=\"{0}/{0}_contact.png\"><img loading=\"lazy\" alt=\"contact sheet of \
         {name}: a row a variant, a column a level of detail\" src=\"{0}/{0}_contact.png\"></a>\n</section>\n",
        linked(&set.set)
    );
}

fn of_species(html: &mut String, specimen: &Specimen) {
    let name = escaped(&specimen.name);
    let _ = writeln!(html, "<section id=\"species-{name}\">\n<h2>{name}</h2>");
    if !specimen.about.is_empty() {
        let _ = writeln!(html, "<p>{}</p>", escaped(&specimen.about));
    }
    let _ = match &specimen.wrong {
        Some(wrong) => writeln!(html, "<p>No picture: {}.</p>", escaped(wrong)),
        None => writeln!(
            html,
            "<a href=\"{0}\"><img loading=\"lazy\" alt=\"three bare trees of {name}, side by side\" src=\"{0}\"></a>",
            specimen.sheet()
        ),
    };
    html.push_str("</section>\n");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A name as part of a URL.
fn linked(name: &str) -> String {
    let mut link = String::new();
    for byte in name.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' => link.push(char::from(byte)),
            _ => drop(write!(link, "%{byte:02X}")),
        }
    }
    link
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_presets_first_words_are_taken_up_to_an_empty_line() {
        let text = "\n// A hedge,\n// of two kinds.\n//\n// Build it: so\n( seed: 1 )";
        assert_eq!(first_comment(text), "A hedge, of two kinds.");
        assert_eq!(first_comment("( seed: 1 ) // no"), "");
    }

    #[test]
    fn names_do_not_break_the_page() {
        assert_eq!(escaped("a<b>&\""), "a&lt;b&gt;&amp;&quot;");
        assert_eq!(linked("a b/\u{e9}"), "a%20b%2F%C3%A9");
    }

    #[test]
    fn a_manifest_is_read_again_where_it_is_another_and_not_before() {
        let out = tempfile::tempdir().unwrap();
        let manifest = out.path().join("oak/oak.manifest.json");
        fs::create_dir(out.path().join("oak")).unwrap();
        let shown = Shown::default();
        let page = || {
            shown.gallery(out.path(), &[]).unwrap();
            fs::read_to_string(out.path().join(GALLERY)).unwrap()
        };
        let write = |triangles: u32| {
            let text =
                format!("{{\"set\": \"oak\", \"variants\": [{{\"levels\": [{{\"triangles\": {triangles}}}]}}]}}");
            fs::write(&manifest, text).unwrap();
            // As if it had been written a while ago.
            let file = fs::File::options().write(true).open(&manifest).unwrap();
            let long_ago = file.metadata().unwrap().modified().unwrap()
                - std::time::Duration::from_secs(60 + u64::from(triangles));
            file.set_modified(long_ago).unwrap();
        };
        write(1234);
        assert!(page().contains(", 1234 triangles"));
        assert_eq!(shown.0.lock().unwrap().len(), 1);
        shown.0.lock().unwrap().values_mut().for_each(|(_, set)| set.variants[0].levels[0].triangles = 99);
        assert!(page().contains(", 99 triangles"), "it was read again");
        write(4321);
        assert!(page().contains(", 4321 triangles"));
        fs::remove_dir_all(out.path().join("oak")).unwrap();
        assert!(page().contains("<h1>0 sets</h1>") && shown.0.lock().unwrap().is_empty());
    }

    #[test]
    fn a_page_of_somebody_else_stays() {
        let out = tempfile::tempdir().unwrap();
        assert!(gallery(out.path(), &[]).unwrap());
        assert!(gallery(out.path(), &[]).unwrap());
        fs::write(out.path().join(GALLERY), "mine").unwrap();
        assert!(!gallery(out.path(), &[]).unwrap());
        assert_eq!(fs::read(out.path().join(GALLERY)).unwrap(), b"mine");
        let pages =
            fs::read_dir(out.path()).unwrap().filter(|e| !e.as_ref().unwrap().path().ends_with(".treewright-lock"));
        assert_eq!(pages.count(), 1);
    }
}
