//! Presets from outside: what broken ones are answered, word for word, whether the shipped ones load, and whether the
//! described schema is the one in the documentation.
//!
//! `presets/broken.txt` holds broken presets, each with its diagnostics. After a change of wording or schema run with
//! `BLESS` set, and read the difference.

use std::fs;
use std::path::{Path, PathBuf};

use treewright::base::Diagnostic;
use treewright::preset::{describe, describe_json, load, species};

const GOLDEN: &str = include_str!("presets/broken.txt");
const SCHEMA: &str = include_str!("../src/preset/schema.md");
const SCHEMA_JSON: &str = include_str!("../src/preset/schema.json");
const OAK: &str = "(height: 12.0, iterations: [(endpoints: Surface(k: 4, count: 300))])";
/// One error, though its point would be far out of the least region.
const WIDE: &str = "(height: 6.0, width: 62, iterations: [(endpoints: Volume(shape: Point(height: 0.5, out: 0.3)))])";
const BROKEN_SPECIES: &str = r#"(
    height: 12.0, nodes: 100, tip_radius: 1.0,
    iterations: [
        (endpoints: Volume(shape: Sphere(radius: 1.0), count: 1)),
        (endpoints: Volume(shape: Cone(bottom: 0.9, top: 0.3, radius: 0.7), count: 30), guide: Random(low: 120, high: 30)),
        (endpoints: Volume(shape: Mesh(file: "/abs.obj", bottom: 0.1, top: 0.9), count: 3, density: 5.0)),
        (endpoints: Volume(shape: Outline(file: "a.svg", bottom: 0.1, top: 0.9)), guide: Split(height: 0.5, lower: Split(), upper: Constant(alpha: 1000))),
        (endpoints: Surface(k: 2, count: 9), guide: Field(parts: [(primitive: Helix()), (primitive: Helical(), region: Layer(bottom: 0.9, top: 0.2)), (weight: 1)])),
        (endpoints: Surface(k: 31, t: 60, count: 300), guide: Piecewise(frist: 30.0), kept: Any, start: ByHeight()),
        (guide: Polar(theta: 400)),
    ],
)"#;

fn answer(text: &str) -> String {
    let mut reads = Vec::new();
    let result = load("presets/case.ron", text, &mut |path| {
        reads.push(path.to_string());
        match path {
            "species/oak.ron" => Ok(OAK.to_string()),
            "species/broken.ron" => Ok(BROKEN_SPECIES.to_string()),
            "../shared/typo.ron" => Ok("(height: 12.0,, iterations: [".to_string()),
            "species/wide.ron" => Ok(WIDE.to_string()),
            "species/preset.ron" => Ok("(sources: {}, variants: [])".to_string()),
            _ => Err("no such file".to_string()),
        }
    });
    reads.sort_unstable();
    assert!(reads.windows(2).all(|pair| pair[0] != pair[1]), "a file was read twice: {reads:?}");
    match result {
        Ok(_) => "sound\n".to_string(),
        Err(found) => found.iter().map(|diagnostic| format!("{diagnostic}\n")).collect(),
    }
}

#[test]
fn broken_presets_are_answered_as_the_golden_says() {
    let mut told = String::new();
    for case in GOLDEN.split("=== ").skip(1) {
        let (name, rest) = case.split_once('\n').expect("a case has a name");
        let (text, _) = rest.split_once("---\n").expect("a case has an answer");
        told.push_str(&format!("=== {name}\n{text}---\n{}", answer(text)));
    }
    if std::env::var_os("BLESS").is_some() {
        fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/presets/broken.txt"), &told).expect("writes");
    }
    for (told, golden) in told.split("=== ").zip(GOLDEN.split("=== ")) {
        assert_eq!(told, golden, "\n{told}");
    }
    assert!(GOLDEN.matches("=== ").count() >= 25 && !GOLDEN.contains("---\nsound"));
}

/// The `*.ron` files of a folder below `presets`, in order of name.
fn texts(folder: &str) -> Vec<(String, String)> {
    let folder = presets().join(folder);
    let mut files: Vec<PathBuf> =
        fs::read_dir(&folder).expect("the folder is there").map(|f| f.unwrap().path()).collect();
    files.sort();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "ron"));
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    files.iter().map(|path| (name(path), fs::read_to_string(path).expect("reads"))).collect()
}

fn presets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("presets")
}

fn told(found: Vec<Diagnostic>) -> String {
    found.iter().map(|diagnostic| format!("{diagnostic}\n")).collect()
}

#[test]
fn every_shipped_preset_loads_and_is_ron() {
    let shipped = texts("");
    assert!(
        shipped.iter().any(|(name, _)| name == "avenue.ron") && shipped.iter().any(|(name, _)| name == "grove.ron")
    );
    for (name, text) in shipped {
        let read = &mut |path: &str| fs::read_to_string(presets().join(path)).map_err(|e| e.to_string());
        let plan = load(&format!("presets/{name}"), &text, read).map_err(told);
        assert!(plan.is_ok(), "{}", plan.unwrap_err());
        assert!(ron::from_str::<ron::Value>(&text).is_ok(), "{name}");
    }
}

#[test]
fn every_shipped_species_loads_and_is_ron() {
    let shipped = texts("species");
    assert!(shipped.len() >= 3);
    for (name, text) in shipped {
        let grown = species(&name, &text).map_err(told);
        assert!(grown.is_ok(), "{}", grown.unwrap_err());
        assert!(ron::from_str::<ron::Value>(&text).is_ok(), "{name}");
    }
}

#[test]
fn every_shipped_preset_and_species_says_what_it_shows() {
    let shipped = [texts(""), texts("species")].concat();
    assert!(shipped.len() >= 20);
    for (name, text) in shipped {
        let comment = text.lines().next().and_then(|line| line.strip_prefix("// ")).unwrap_or_default();
        assert!(comment.len() > 20 && comment.chars().next().is_some_and(char::is_uppercase), "{name}: {comment}");
    }
}

#[test]
fn the_descriptions_are_up_to_date() {
    for (file, told, golden) in [("schema.md", describe(), SCHEMA), ("schema.json", describe_json(), SCHEMA_JSON)] {
        if std::env::var_os("BLESS").is_some() {
            fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/preset").join(file), &told).expect("writes");
            continue;
        }
        for (told, golden) in told.lines().zip(golden.lines()) {
            assert_eq!(told, golden, "run this test with BLESS set and read the difference");
        }
        assert_eq!(told.len(), golden.len(), "{file}");
    }
}
