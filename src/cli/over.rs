//! Files that options name. One that is there is replaced only where it is of the kind that the option writes, from a run before: a
//! wrong name on a command line must cost nobody a preset, a species or an asset.

use std::fs::{self, File};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use super::report::Failure;
use crate::build::replace::replace;

/// How much of a file tells its kind.
const HEAD: u64 = 4096;

/// What an option writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `--depfile`: a rule whose target is a manifest.
    Depfile,
    /// `--part`.
    Part,
    /// `--dump`.
    Dump,
    /// `--plot` and `--dendrogram`: an SVG of Treewright's own.
    Drawing,
}

impl Kind {
    /// What it is called.
    const fn name(self) -> &'static str {
        match self {
            Self::Depfile => "depfile of sets",
            Self::Part => "part of a set",
            Self::Dump => "dump of a plant",
            Self::Drawing => "drawing of this command's",
        }
    }

    /// Whether a file with this head is one. An empty file holds nothing that could be lost.
    fn is_of(self, head: &[u8]) -> bool {
        let line = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
        let is_plot = |line: &[u8]| line.ends_with(b"font-size=\"12\">") || line.ends_with(b"font-size=\"13\">");
        head.is_empty()
            || match self {
                Self::Depfile => line.ends_with(b".manifest.json: \\"),
                Self::Part => head.starts_with(b"twparts"),
                Self::Dump => head.starts_with(b"Plant("),
                Self::Drawing => {
                    line.starts_with(b"<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 ") && is_plot(line)
                }
            }
    }
}

fn wrong(path: &Path, why: &str) -> Failure {
    Failure::Other(format!("can't write {}: {why}", path.display()))
}

/// Fails where a file can't be made anew.
pub(super) fn may_make(path: &Path) -> Result<(), Failure> {
    if fs::symlink_metadata(path).is_ok() {
        Err(wrong(path, "it exists; give another name, or remove it first"))
    } else {
        has_folder(path)
    }
}

/// Fails where a file's folder is not there.
fn has_folder(path: &Path) -> Result<(), Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.is_dir() { Ok(()) } else { Err(wrong(path, &format!("there is no folder {}", folder.display()))) }
}

/// Writes a file that is not there yet, whole or not at all.
pub(super) fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    let written = File::create_new(path).and_then(|mut file| {
        let written = file.write_all(text.as_bytes());
        drop(file);
        written.inspect_err(|_| drop(fs::remove_file(path)))
    });
    written.map_err(|e| {
        wrong(path, &if e.kind() == ErrorKind::AlreadyExists { "it exists".to_owned() } else { e.to_string() })
    })
}

/// Fails where a file is there that is of another kind.
pub(super) fn may_replace(path: &Path, kind: Kind) -> Result<(), Failure> {
    // What is not there, or no file, is no loss: writing tells what is wrong.
    if !fs::metadata(path).is_ok_and(|there| there.is_file()) {
        return Ok(());
    }
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    match read {
        Ok(_) if kind.is_of(&head) => Ok(()),
        Ok(_) => {
            Err(wrong(path, &format!("it is there and no {}; give another name, or remove it first", kind.name())))
        }
        Err(e) => Err(wrong(path, &e.to_string())),
    }
}

/// Fails where [`write_over`] would: asked before the work that it is to write.
pub(super) fn may_write(path: &Path, kind: Kind, made_from: &[PathBuf]) -> Result<(), Failure> {
    if let Ok(there) = path.canonicalize()
        && made_from.iter().any(|file| file.canonicalize().is_ok_and(|file| file == there))
    {
        return Err(wrong(path, "it is what is read; give another name"));
    }
    may_replace(path, kind)?;
    has_folder(path)
}

/// Writes a file, whole or not at all, over one of its name and kind; never over what it is made from.
pub(super) fn write_over(path: &Path, bytes: &[u8], kind: Kind, made_from: &[PathBuf]) -> Result<(), Failure> {
    may_write(path, kind, made_from)?;
    replace(path, bytes).map_err(|e| wrong(path, &e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn files_are_replaced_by_those_of_their_kind_and_by_no_others() {
        let mut builder = PlantBuilder::new();
        builder.stem(glam::Vec3::ZERO, &[glam::Vec3::ZERO, glam::Vec3::Y], &[0.1, 0.1]);
        let plant = builder.finish().expect("a pole");
        let names = ["a".to_owned(), "b".to_owned()];
        let plot = crate::export::plot("load", &[], 2.0);
        let tree = crate::blend::shape::dendrogram(&names[..1], &[], "m");
        let files: [(Vec<u8>, Option<Kind>); 9] = [
            (crate::plant::dump(&plant).into_bytes(), Some(Kind::Dump)),
            (plot.into_bytes(), Some(Kind::Drawing)),
            (tree.into_bytes(), Some(Kind::Drawing)),
            (b"out/oak/oak.manifest.json: \\\n  oak.ron\n".to_vec(), Some(Kind::Depfile)),
            (b"twparts1\0\0".to_vec(), Some(Kind::Part)),
            (b"(sources: {}, variants: [])".to_vec(), None),
            (
                b"<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\"><text font-size=\"12\"/></svg>"
                    .to_vec(),
                None,
            ),
            (b"glTF\x02\0\0\0".to_vec(), None),
            (b"out/oak/oak.manifest.json: oak.ron\n\ttreewright build oak.ron\n".to_vec(), None),
        ];
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        for (bytes, own) in files {
            for kind in [Kind::Depfile, Kind::Part, Kind::Dump, Kind::Drawing] {
                fs::write(&path, &bytes).expect("it is written");
                let written = write_over(&path, b"new", kind, &[]);
                let left = fs::read(&path).expect("it is there");
                assert_eq!(written.is_ok(), own == Some(kind), "{kind:?} {:?}", String::from_utf8_lossy(&bytes));
                assert!(left == if own == Some(kind) { b"new".to_vec() } else { bytes.clone() });
            }
        }
        fs::write(&path, b"").expect("it is written");
        assert!(write_over(&path, b"new", Kind::Part, &[]).is_ok());
        fs::write(&path, b"twparts1").expect("it is written");
        assert!(write_over(&path, b"new", Kind::Part, std::slice::from_ref(&path)).is_err());
    }
}
