//! Why a set could not be written, for people.

use std::io;
use std::path::PathBuf;

use crate::base::Diagnostic;

/// Why a set could not be written.
#[derive(Debug, thiserror::Error)]
pub(in crate::build) enum OutputError {
    /// The file system refused.
    #[error("can't write {path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// Files of the set that are to be replaced or removed and may not be changed: whoever checks files out of a version control, or
    /// has shipped them, marks them so. Where folders decide, as on Unix, replacing them would take the mark away unasked.
    #[error("read-only files in {folder}: {}", .names.join(", "))]
    ReadOnly {
        /// The set's folder.
        folder: PathBuf,
        /// The files.
        names: Vec<String>,
    },
    /// Files with a target's name that Treewright did not write.
    #[error("files in the way that Treewright did not write, in {folder}: {}", .names.join(", "))]
    Foreign {
        /// The set's folder.
        folder: PathBuf,
        /// The files.
        names: Vec<String>,
    },
}

impl OutputError {
    fn kind(&self) -> Option<io::ErrorKind> {
        match self {
            Self::Io { source, .. } => Some(source.kind()),
            Self::ReadOnly { .. } | Self::Foreign { .. } => None,
        }
    }

    /// Whether a test's kill did it.
    pub(super) fn is_cut(&self) -> bool {
        self.kind() == Some(io::ErrorKind::Interrupted)
    }

    /// Whether another way of writing may get through: not past a full disk or a kill.
    pub(super) fn is_refusal(&self) -> bool {
        use io::ErrorKind as Kind;
        !matches!(self.kind(), Some(Kind::StorageFull | Kind::QuotaExceeded | Kind::FileTooLarge | Kind::Interrupted))
    }

    /// The same for people: about the file or folder that is in the way, with what to do.
    #[must_use]
    pub(in crate::build) fn diagnostic(&self) -> Diagnostic {
        let (message, hint) = match self {
            Self::Io { source, .. } => match source.kind() {
                io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => (
                    "a file is where a folder is needed".to_owned(),
                    "give --out another folder, or move the file away",
                ),
                io::ErrorKind::IsADirectory => {
                    ("a folder is where a file is to be written".to_owned(), "move the folder away")
                }
                io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => (
                    "there is no right to write it".to_owned(),
                    "give --out another folder, or close the program that holds the file",
                ),
                io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                    ("the disk is full; the old set is untouched".to_owned(), "make room and build again")
                }
                io::ErrorKind::InvalidFilename => {
                    ("its name is too long for the file system".to_owned(), "give --out a shorter path")
                }
                _ => (format!("it can't be written: {source}"), "mend that and build again"),
            },
            Self::ReadOnly { names, .. } => (
                format!("{} read-only, and the set would be another; nothing was written", some(names, "is", "are")),
                "check it out (`p4 edit`) or make it writable, and build again",
            ),
            Self::Foreign { names, .. } => {
                let more = if names.len() > 1 { format!(" and {} more", names.len() - 1) } else { String::new() };
                (
                    format!("{}{more} in the way: Treewright did not write it, so it will not replace it", names[0]),
                    "move it away, or remove the folder if all in it was built and its manifest was lost",
                )
            }
        };
        let file = match self {
            Self::Io { path, .. } => path,
            Self::ReadOnly { folder, .. } | Self::Foreign { folder, .. } => folder,
        };
        Diagnostic::new(crate::build::find::shown(file), message).with_hint(hint)
    }
}

/// The first of some names and how many there are more, with the verb.
fn some(names: &[String], is: &str, are: &str) -> String {
    let first = names.first().map_or("", String::as_str);
    if names.len() > 1 { format!("{first} and {} more {are}", names.len() - 1) } else { format!("{first} {is}") }
}
