//! Hostile files: mutations of a small file of every format that is read. No panic, no hang; a file is read or refused
//! with an error that names it. The fuzz targets in `fuzz/` do the same for longer, and measure memory.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use treewright::base::{Diagnostic, Seed};
use treewright::preset::plan::ImportParams;
use treewright::source::grow::{ShapeReading, Solid, obstacle_triangles};
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
            let images = [material.color_image, material.normal_image, material.roughness_image, material.alpha_image];
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

/// Files of trees that fuzzing starts from; presets and cache entries have tests of their own.
fn tree_seeds() -> Vec<PathBuf> {
    let mut seeds = files("fuzz/seeds");
    seeds.retain(|seed| !["preset", "entry"].iter().any(|kind| seed.parent().is_some_and(|p| p.ends_with(kind))));
    seeds
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
    let seeds = tree_seeds();
    assert!(seeds.len() >= 15);
    for seed in seeds {
        let bytes = std::fs::read(&seed).unwrap();
        assert!(read(&bytes).is_ok_and(|n| n > 0), "{}: {:?}", seed.display(), read(&bytes));
    }
}

#[test]
fn no_mutation_hurts() {
    for file in tree_seeds() {
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

/// Damages a file many times and counts how often it is read all the same.
fn read_damaged(file: &str, rounds: u64, read: impl Fn(&[u8]) -> bool) {
    let whole = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap();
    assert!(read(&whole), "{file}");
    let sound = (0..rounds).filter(|&round| read(&mutated(&whole, Seed::new(round)))).count();
    assert!(sound > 5 && (sound as u64) < rounds, "{file}: {sound} of {rounds} are read");
}

#[test]
fn no_mutation_of_a_shape_hurts() {
    // What a species takes its endpoints from: an outline and a mesh. What is read holds places or none, and can be asked.
    let asked = |read: Result<Solid, _>| match read {
        Ok(solid) => {
            assert!(solid.bounds().iter().all(|corner| corner.is_finite()));
            let probe = |k: u64| Seed::new(k).direction() + glam::Vec3::Y * 0.5;
            let _ = (0..20).filter(|&k| solid.holds(probe(k))).count();
            true
        }
        Err(error) => {
            let error: treewright::source::grow::SolidError = error;
            assert!(error.to_string().chars().count() < 600);
            false
        }
    };
    read_damaged("presets/species/cypress.svg", 600, |bytes| asked(Solid::read(bytes, ShapeReading::Outline)));
    read_damaged("presets/species/hawthorn.obj", 200, |bytes| asked(Solid::read(bytes, ShapeReading::MeshY)));
}

#[test]
fn no_mutation_of_an_obstacle_hurts() {
    read_damaged("fuzz/seeds/gltf/container", 400, |bytes| match obstacle_triangles(bytes) {
        Ok(triangles) => !triangles.is_empty(),
        Err(error) => {
            assert!(!error.is_empty() && error.chars().count() < 600);
            false
        }
    });
}

#[test]
fn no_mutation_of_a_preset_hurts() {
    for file in files("fuzz/seeds/preset") {
        let whole = std::fs::read(&file).unwrap();
        let load = |bytes: &[u8]| {
            let text = String::from_utf8_lossy(bytes).into_owned();
            let mut parts = text.split("\n--8<--\n");
            let preset = parts.next().unwrap_or_default();
            treewright::preset::load("it", preset, &mut |_| parts.next().map(str::to_owned).ok_or("gone".to_owned()))
        };
        assert!(load(&whole).is_ok(), "{}: {:?}", file.display(), load(&whole).err());
        for round in 0..300 {
            if let Err(errors) = load(&mutated(&whole, Seed::new(round))) {
                assert!(!errors.is_empty() && errors.iter().all(|e| !e.message.is_empty()), "{errors:?}");
            }
        }
    }
}

#[test]
fn no_mutation_of_a_cache_entry_hurts() {
    let seeds = files("fuzz/seeds/entry");
    assert!(!seeds.is_empty());
    for file in seeds {
        let whole = std::fs::read(&file).unwrap();
        let end = whole.iter().position(|byte| *byte == b'\n').unwrap();
        let stage = std::str::from_utf8(&whole[..end]).unwrap();
        let sound = |bytes: &[u8]| treewright::build::entry_is_sound(stage, bytes).unwrap();
        assert!(sound(&whole[end + 1..]), "{}", file.display());
        // What claims to be sound needs not be; what is cut off can't be.
        for round in 0..400 {
            let _ = sound(&mutated(&whole[end + 1..], Seed::new(round)));
        }
        (0..whole.len() - end - 1)
            .step_by(whole.len() / 200 + 1)
            .for_each(|cut| assert!(!sound(&whole[end + 1..][..cut])));
    }
    assert_eq!(treewright::build::entry_is_sound("nothing", b""), None);
}

#[test]
fn what_fuzzing_found_stays_mended() {
    for find in files("fuzz/finds") {
        let _ = read(&std::fs::read(&find).unwrap());
    }
}

/// A file of many short lines, or of one long one: few bytes for each row, face, part or name. Were the reading of any of
/// them quadratic, this one test would take the better part of an hour.
#[test]
fn dense_files_are_read_in_step_with_their_length() {
    const ROWS: usize = 20_000;
    let many = |head: &str, line: &dyn Fn(usize) -> String| -> Vec<u8> {
        std::iter::once(head.to_owned()).chain((0..ROWS).map(line)).collect::<String>().into_bytes()
    };
    let triangle = "v 0 0 0\nv 0 1 0\nv 1 0 0\n";
    let graph = "CODE:\tFORM-A\nCLASSES:\nA 1\nMTG:\nENTITY-CODE\tLength\n/A1\t1\n";
    let cylinders = "parent,radius,start_x,start_y,start_z,end_x,end_y,end_z\n";

    // What makes a plant or is refused by name, but always ends.
    for (kind, bytes) in [
        ("a chain of rows", many(graph, &|_| "^<A\t1\n".into())),
        ("a chain of rows without a length", many(graph, &|_| "^<A\n".into())),
        ("a branch on each branch", many(graph, &|_| "^+A\t1\n".into())),
        ("a chain in one row", many(&format!("{graph}^"), &|_| "<A".into())),
        ("cylinders at one place", many(cylinders, &|_| "0,1,0,0,0,0,0,1\n".into())),
        (
            "cylinders that all name the first",
            many(cylinders, &|i| format!("{},1,0,0,{i},1,0,{i}\n", usize::from(i > 0))),
        ),
        ("nodes in a chain", many("", &|i| format!("{} 0 0 {} 1 1 {i}\n", i + 1, i % 10))),
    ] {
        if let Err(errors) = read(&bytes) {
            assert!(!errors.is_empty() && errors.iter().all(|e| e.file == "it"), "{kind}: {errors:?}");
        }
    }

    // What must be read, and to how many triangles.
    let names: String = (0..ROWS).map(|i| format!("newmtl {i}\n")).collect();
    let materials = [&b"mtllib a.mtl\nv 0 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 3\n"[..], names.as_bytes()].join(PART);
    for (kind, bytes, triangles) in [
        ("a material for each face", many(triangle, &|i| format!("usemtl {i}\nf 1 2 3\n")), ROWS),
        ("two materials in turn", many(triangle, &|i| format!("usemtl {}\nf 1 2 3\n", i % 2)), ROWS),
        ("a group for each face", many(triangle, &|i| format!("g {i}\nf 1 2 3\n")), ROWS),
        ("corners of one place", many(triangle, &|_| "f 1 2 3\n".into()), ROWS),
        ("a material file of names", materials, 1),
    ] {
        assert_eq!(read(&bytes).ok(), Some(triangles), "{kind}");
    }

    // One face of all vertices: on a circle, which is cut into all its triangles, and at one place, which has none.
    let circle = |i: usize| {
        let (sin, cos) = treewright::base::math::sin_cos(i as f32 / ROWS as f32 * std::f32::consts::TAU);
        format!("v {cos:.6} {sin:.6} 0\n")
    };
    let corners: String = (1..=ROWS).map(|i| format!(" {i}")).collect();
    let face = [many("", &circle), format!("f{corners}\n").into_bytes()].concat();
    assert!(read(&face).is_ok_and(|n| n <= ROWS - 2 && n > 0));
    let _ = read(&many(&format!("{triangle}f"), &|_| " 1".into()));
}
