//! Hostile files: mutations of a small file of every format that is read. No panic, no hang; a file is read or refused
//! with an error that names it. The fuzz targets in `fuzz/` do the same for longer, and measure memory.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use treewright::base::{Diagnostic, Seed};
use treewright::preset::plan::ImportParams;
use treewright::source::{import, scene};

/// What parts the files of a seed: the first is imported, the others are what it names, in the order it asks for them.
const PART: &[u8] = b"\n--8<--\n";

fn parts(bytes: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.windows(PART.len()).position(|w| w == PART) {
        parts.push(&rest[..at]);
        rest = &rest[at + PART.len()..];
    }
    parts.push(rest);
    parts
}

/// Reads an input up to its middle form, or to a plant where it is no mesh.
fn read(bytes: &[u8]) -> Result<usize, Vec<Diagnostic>> {
    let mut files = parts(bytes).into_iter();
    let main = files.next().unwrap_or_default();
    let mut beside: BTreeMap<String, &[u8]> = scene::Files::new();
    for _ in 0..3 {
        for name in import::refers(main, "it", &beside) {
            if let Some(file) = files.next() {
                beside.insert(name, file);
            }
        }
    }
    if scene::sniff(main).is_some() {
        let scene = scene::read(main, "it", &beside)?;
        for part in &scene.parts {
            let n = part.positions.len();
            assert!(part.positions.iter().all(|p| p.is_finite()));
            assert!([part.normals.len(), part.uvs.len(), part.colors.len()].iter().all(|&m| m == 0 || m == n));
            assert!(part.triangles.iter().flatten().all(|&i| (i as usize) < n));
            assert!(part.faces.len() == part.triangles.len() && part.faces.is_sorted());
            assert!(part.material.is_none_or(|m| m < scene.materials.len()));
        }
        for material in &scene.materials {
            let images = [material.color_image, material.normal_image, material.alpha_image];
            assert!(images.into_iter().flatten().all(|i| i < scene.images.len()));
        }
        return Ok(scene.triangles());
    }
    let plant = import::import_with(main, "it", &beside, &ImportParams::default())?.plant;
    Ok(plant.chains().len())
}

fn files(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
            if entry.is_dir() { folders.push(entry) } else { found.push(entry) }
        }
    }
    found.sort();
    found
}

/// One of many ways to damage a file.
fn mutated(whole: &[u8], seed: Seed) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for k in 0..1 + seed.child("n").index(4) as u64 {
        let seed = seed.child("change").at(k);
        let at = seed.child("at").index(bytes.len().max(1));
        let value = seed.child("value").bits();
        match seed.child("kind").index(7) {
            _ if bytes.is_empty() => {}
            0 => bytes[at] = value as u8,
            // Digits grow into large numbers more often than random bytes do.
            1 => bytes[at] = b'0' + (value % 10) as u8,
            2 => bytes.truncate(at),
            3 => {
                let end = (at + 1 + value as usize % 40).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
            4 => {
                let end = (at + 1 + value as usize % 40).min(bytes.len());
                bytes.drain(at..end);
            }
            5 => {
                let special: [&[u8]; 8] =
                    [b"-1", b"nan", b"1e400", b"99999999999", b"\xff\xff\xff\xff", b"\n", b"\t", b"/"];
                bytes.splice(at..at, special[value as usize % 8].iter().copied());
            }
            _ => bytes[at] ^= 1 << (value % 8),
        }
    }
    bytes
}

#[test]
fn seeds_are_read_whole() {
    let seeds = files("fuzz/seeds");
    assert!(seeds.len() >= 15);
    for seed in seeds {
        let bytes = std::fs::read(&seed).unwrap();
        assert!(read(&bytes).is_ok_and(|n| n > 0), "{}: {:?}", seed.display(), read(&bytes));
    }
}

#[test]
fn no_mutation_hurts() {
    for file in files("fuzz/seeds") {
        let whole = std::fs::read(&file).unwrap();
        let mut sound = 0;
        for round in 0..800 {
            match read(&mutated(&whole, Seed::new(round))) {
                Ok(_) => sound += 1,
                Err(errors) => {
                    assert!(!errors.is_empty() && errors.len() <= 21, "{}", file.display());
                    assert!(
                        errors.iter().all(|e| !e.file.is_empty() && e.to_string().chars().count() < 600),
                        "{errors:?}"
                    );
                }
            }
        }
        assert!(sound > 10 && sound < 800, "{}: {sound} of 800 are read", file.display());
    }
}

#[test]
fn what_fuzzing_found_stays_mended() {
    for find in files("fuzz/finds") {
        let _ = read(&std::fs::read(&find).unwrap());
    }
}
