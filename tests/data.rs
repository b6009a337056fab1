//! Real scans and skeletons import, and broken versions of them are refused with one clear error each.

#![cfg(feature = "cli")]
#![expect(clippy::print_stderr, reason = "says what was skipped")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use treewright::plant::PlantStats;
use treewright::preset::plan::ImportParams;
use treewright::source::import::import;

/// The folder of skeletons; none, with a word about it, where the data is absent, which CI does not allow.
fn skeletons() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("TREEWRIGHT_DATA").map_or_else(beside, PathBuf::from).join("skeleton");
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "the test data is missing: {}", folder.display());
    eprintln!("skipped: no test data at {}", folder.display());
    None
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| ["csv", "txt", "swc"].iter().any(|x| e == *x)))
        .collect();
    files.sort();
    files
}

fn params() -> ImportParams {
    ImportParams { file: String::new(), ..ImportParams::default() }
}

fn inspect(file: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_treewright")).arg("inspect").arg(file).output().unwrap()
}

#[test]
fn every_skeleton_imports_as_one_upright_connected_plant() {
    let Some(folder) = skeletons() else { return };
    let files = files(&folder);
    assert!(files.len() >= 10, "{} files", files.len());
    for file in files {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let imported =
            import(&std::fs::read(&file).unwrap(), &name, &params()).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        let stats = PlantStats::of(&imported.plant);
        assert_eq!(stats.stems, 1, "{name}");
        assert!((stats.topology_continuity - 1.0).abs() < f32::EPSILON, "{name}: {}", stats.topology_continuity);
        assert!(stats.height > 0.5 * stats.width.min(1.0), "{name} lies down: {} m", stats.height);
        let low = imported.plant.pose().positions().iter().map(|p| p.y).fold(f32::MAX, f32::min);
        assert!(low > -0.2 * stats.height, "{name} starts at {low} m");
    }
}

#[test]
fn a_broken_skeleton_gives_one_clear_error_and_exit_code_1() {
    let Some(folder) = skeletons() else { return };
    let scratch = tempfile::tempdir().unwrap();
    for file in files(&folder) {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let bytes = std::fs::read(&file).unwrap();
        let mut cut = bytes[..bytes.len() * 2 / 3].to_vec();
        // In the middle of a row's numbers.
        while cut.last().is_some_and(|b| !b.is_ascii_digit()) {
            cut.pop();
        }
        let end = cut.iter().rposition(|&b| b == b'\n').unwrap();
        cut.truncate(end + 1 + (cut.len() - end).min(9));
        let binary: Vec<u8> = bytes.iter().enumerate().map(|(i, b)| if i % 3 == 0 { *b ^ 0xa5 } else { *b }).collect();
        let mut hostile = bytes.clone();
        let last = hostile.trim_ascii_end().iter().rposition(|&b| b == b'\n').unwrap();
        let row: Vec<u8> =
            hostile[last + 1..].iter().flat_map(|b| if *b == b'.' { b"e300.".to_vec() } else { vec![*b] }).collect();
        hostile.truncate(last + 1);
        hostile.extend(row);
        for (what, bytes) in [("truncated", cut), ("binary", binary), ("empty", Vec::new()), ("hostile", hostile)] {
            let path = scratch.path().join(format!("{what}_{name}"));
            std::fs::write(&path, bytes).unwrap();
            let output = inspect(&path);
            let error = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(1), "{what} {name}: {error}");
            assert!(error.contains(&format!("{what}_{name}")), "{what} {name} is not named: {error}");
            assert!(!error.contains("panicked"), "{error}");
        }
    }
}
