//! The smallest project that builds a whole set: a species of 500 nodes, a scan of six rows and pictures of 16 pixels.
//! A build of it takes about a tenth of a second, so tests can do many.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// One grown source, one variant, the user's own pictures.
pub(crate) const GROWN: &str = r#"(
    seed: 1,
    sources: {
        "a": Grow(species: "species/tiny.ron", seed: 1),
    },
    variants: [Source("a")],
    foliage: (leaf: Files(color: "art/leaf.png"), density: 0.1, most: 20),
    bark: (texture: Files(color: "art/bark.png")),
    lods: [Full],
    atlas: (size: 256),
)
"#;

/// A species that grows in milliseconds.
pub(crate) const SPECIES: &str = r"(
    height: 3.0,
    nodes: 500,
    iterations: [
        (
            endpoints: Volume(shape: HalfEllipsoid(bottom: 0.35, top: 0.9, radius: 0.36), count: 6),
            guide: Piecewise(alpha1: 7.0, alpha2: 0.0, h0: 3),
        ),
    ],
)
";

/// A stem with a fork, as SWC.
pub(crate) const SCAN: &str = "\
1 1 0 0 0 0.10 -1
2 5 0 0 1 0.08 1
3 5 0 0 2 0.05 2
4 5 0.4 0 2.5 0.03 3
5 5 -0.4 0 2.6 0.03 3
6 5 0 0.3 1.8 0.02 2
";

/// The grown preset with a scan for its source.
pub(crate) fn scanned() -> String {
    GROWN.replace(r#"Grow(species: "species/tiny.ron", seed: 1)"#, r#"Import(file: "scans/tiny.swc", up: Z)"#)
}

/// A folder with `grown.ron` and all that it and [`scanned`] name.
pub(crate) fn project() -> tempfile::TempDir {
    let project = tempfile::tempdir().unwrap();
    let at = |name: &str| project.path().join(name);
    for folder in ["species", "scans", "art"] {
        fs::create_dir(at(folder)).unwrap();
    }
    fs::write(at("species/tiny.ron"), SPECIES).unwrap();
    fs::write(at("scans/tiny.swc"), SCAN).unwrap();
    picture(&at("art/leaf.png"), 120);
    picture(&at("art/bark.png"), 70);
    fs::write(at("grown.ron"), GROWN).unwrap();
    project
}

/// Writes a small picture: a disc of one colour on nothing.
pub(crate) fn picture(path: &Path, green: u8) {
    let pixel = |x: u32, y: u32| {
        let inside = x.abs_diff(8).pow(2) + y.abs_diff(8).pow(2) < 40;
        image::Rgba([60, green, 40, if inside { 255 } else { 0 }])
    };
    image::RgbaImage::from_fn(16, 16, pixel).save(path).unwrap();
}

/// Every file in a set's folder by name; the folder may not be there.
pub(crate) fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).map(|entries| entries.map(|e| e.unwrap().path()).collect::<Vec<_>>());
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    entries.unwrap_or_default().iter().filter(|p| p.is_file()).map(|p| (name(p), fs::read(p).unwrap())).collect()
}

/// Whether a folder holds exactly the files that its manifest lists, each with its hash, and the manifest.
pub(crate) fn is_whole(folder: &Path, set: &str) -> bool {
    let files = files(folder);
    let manifest = format!("{set}.manifest.json");
    let Some(bytes) = files.get(&manifest) else { return false };
    let Ok(json) = serde_json::from_slice::<serde_json::Value>(bytes) else { return false };
    let listed = json["files"].as_array().unwrap();
    let whole = |entry: &serde_json::Value| {
        let file = files.get(entry["file"].as_str().unwrap());
        file.is_some_and(|bytes| entry["blake3"] == treewright::base::Key::of_bytes(bytes).to_hex())
    };
    listed.iter().all(whole) && files.len() == listed.len() + 1
}
