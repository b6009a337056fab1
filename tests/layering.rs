//! The layers of ARCHITECTURE.md hold: a folder imports from those above it only, the layers from `base` to `export`
//! touch no file system, clock, environment, terminal or thread-pool set-up, and files stay short.

use std::fs;
use std::path::{Path, PathBuf};

/// From the bottom of the dependency order up.
const LAYERS: &[&[&str]] = &[
    &["base"],
    &["plant"],
    &["preset"],
    &["source"],
    &["relate"],
    &["blend"],
    &["sketch"],
    &["select"],
    &["dress"],
    &["mesh"],
    &["bake"],
    &["lod"],
    &["export"],
    &["build"],
    &["watch"],
    &["preview"],
    &["cli"],
];

/// What a pure layer must not name.
const IMPURE: &[&str] = &[
    "std::fs",
    "std::env",
    "std::net",
    "std::process",
    "std::time",
    "std::thread",
    "std::io::stdin",
    "std::io::stdout",
    "std::io::stderr",
    "println!",
    "eprintln!",
    "ThreadPoolBuilder",
];

fn rust_files(folder: &Path, into: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            rust_files(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

fn source_files() -> Vec<(String, String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    files
        .into_iter()
        .map(|path| {
            let name = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
            let layer = name.split('/').next().unwrap().to_owned();
            (name, layer, fs::read_to_string(&path).unwrap())
        })
        .collect()
}

fn rank(layer: &str) -> Option<usize> {
    LAYERS.iter().position(|names| names.contains(&layer))
}

/// The folders that a file names after `crate::`, also within braces.
fn imports(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for line in text.lines().filter(|l| !l.trim_start().starts_with("//")) {
        for (at, _) in line.match_indices("crate::") {
            let rest = &line[at + "crate::".len()..];
            let list = rest.strip_prefix('{').map_or(rest, |r| r.split('}').next().unwrap_or(r));
            let parts: Vec<&str> = if rest.starts_with('{') { list.split(',').collect() } else { vec![rest] };
            for part in parts {
                let end = part.trim().find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(part.trim().len());
                found.push(&part.trim()[..end]);
            }
        }
    }
    found
}

#[test]
fn a_folder_imports_from_those_above_it_only() {
    let mut wrong = Vec::new();
    for (name, layer, text) in source_files() {
        let Some(own) = rank(&layer) else {
            if name.contains('/') {
                wrong.push(format!("{name}: folder {layer} has no place in the layers"));
            }
            continue;
        };
        // Tests may be made of what stands below.
        for import in imports(text.split("#[cfg(test)]\nmod tests {").next().unwrap()) {
            match rank(import) {
                Some(other) if other > own || (other == own && import != layer) => {
                    wrong.push(format!("{name} imports crate::{import}"));
                }
                _ => {}
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_layers_from_base_to_export_are_pure() {
    let mut wrong = Vec::new();
    let build = rank("build").unwrap();
    let files = source_files();
    for (name, layer, text) in &files {
        // Files of tests may read data and say that it is absent, and try numbers of threads.
        let (folder, file) = name.rsplit_once('/').unwrap_or(("", name));
        let declared = format!("#[cfg(test)]\nmod {};", file.trim_end_matches(".rs"));
        let above = [format!("{folder}/mod.rs"), format!("{folder}.rs")];
        let tests = name.contains("/tests/")
            || files.iter().any(|(other, _, text)| above.contains(other) && text.contains(&declared));
        if tests || rank(layer).is_none_or(|own| own >= build) {
            continue;
        }
        let code = text.split("#[cfg(test)]").next().unwrap();
        for (i, line) in code.lines().enumerate().filter(|(_, l)| !l.trim_start().starts_with("//")) {
            wrong.extend(IMPURE.iter().filter(|w| line.contains(**w)).map(|w| format!("{name}:{}: {w}", i + 1)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_file_has_one_idea() {
    let long: Vec<String> = source_files()
        .into_iter()
        .map(|(name, _, text)| (name, text.lines().count()))
        .filter(|(_, lines)| *lines > 700)
        .map(|(name, lines)| format!("{name}: {lines} lines"))
        .collect();
    assert!(long.is_empty(), "{}", long.join("\n"));
}

#[test]
fn every_file_says_what_it_is() {
    let mute: Vec<String> =
        source_files().into_iter().filter(|(_, _, text)| !text.starts_with("//!")).map(|(name, ..)| name).collect();
    assert!(mute.is_empty(), "{}", mute.join("\n"));
}

#[test]
fn the_reader_of_imports_sees_braces_and_paths() {
    assert_eq!(imports("use crate::{base::Seed, plant};\nlet x = crate::lod::y; // ok"), ["base", "plant", "lod"]);
    assert!(imports("// use crate::lod;").is_empty());
}
