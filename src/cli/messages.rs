//! The messages of `--message-format json`, for build systems and editors; `messages.md` describes them.

use std::sync::OnceLock;

use serde::Serialize;

use super::report::{Failure, print};
use crate::base::{Diagnostic, Note};
use crate::build::{Happened, Progress, SetState, SetStatus};

/// What `treewright schema messages` prints.
pub(super) const DESCRIBED: &str = include_str!("messages.md");

/// One line.
#[derive(Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
enum Message<'a> {
    Waiting,
    Steps {
        count: usize,
    },
    Step {
        set: &'a str,
        what: &'a str,
    },
    Set {
        set: &'a str,
        folder: String,
        variants: usize,
        state: &'static str,
        written: &'a [String],
        unchanged: usize,
        removed: &'a [String],
        seconds: f64,
    },
    Status {
        set: &'a str,
        folder: String,
        state: &'static str,
        files: &'a [String],
    },
    Note {
        set: &'a str,
        #[serde(flatten)]
        note: &'a Note,
    },
    Error(&'a Diagnostic),
    End {
        sets: usize,
        errors: usize,
    },
}

/// Why a line could not be written, if one couldn't.
static LOST: OnceLock<String> = OnceLock::new();

/// The build itself goes on when a line can't be written; at its end that is told.
fn say(message: &Message<'_>) {
    if let Ok(text) = serde_json::to_string(message)
        && let Err(failure) = print(&(text + "\n"))
    {
        let _ = LOST.set(failure.to_string());
    }
}

/// Why not all was said.
pub(super) fn lost() -> Option<&'static String> {
    LOST.get()
}

/// Tells what a build tells.
pub(super) fn progress(progress: &Progress<'_>) {
    match progress {
        Progress::Waiting => say(&Message::Waiting),
        Progress::Steps(count) => say(&Message::Steps { count: *count }),
        Progress::Step { set, what } => say(&Message::Step { set, what }),
        Progress::Set { outcome, folder } => {
            let set = outcome.set.as_str();
            let state = match outcome.happened {
                Happened::Current => "current",
                Happened::Built => "built",
                Happened::Shard { .. } => "shard",
            };
            let committed = &outcome.committed;
            let (written, removed) = (&committed.written, &committed.removed);
            let (folder, unchanged, variants) = (shown(folder), committed.unchanged, outcome.variants);
            outcome.notes.iter().for_each(|note| say(&Message::Note { set, note }));
            let seconds = (outcome.took.as_secs_f64() * 1e3).round() / 1e3;
            say(&Message::Set { set, folder, variants, state, written, unchanged, removed, seconds });
        }
    }
}

/// Tells what a build would find.
pub(super) fn status(status: &SetStatus) {
    let (state, files): (_, &[String]) = match &status.state {
        SetState::Current => ("current", &[]),
        SetState::New => ("new", &[]),
        SetState::Changed => ("changed", &[]),
        SetState::Damaged { files } => ("damaged", files),
        SetState::Orphaned { .. } => ("orphaned", &[]),
    };
    say(&Message::Status { set: &status.set, folder: shown(&status.folder), state, files });
}

/// Tells everything that is wrong, and that the build has ended.
pub(super) fn failure(failure: &Failure) {
    let error = |diagnostic: &Diagnostic| say(&Message::Error(diagnostic));
    let (sets, errors) = match failure {
        Failure::Diagnostics(diagnostics) => {
            diagnostics.iter().for_each(error);
            (0, diagnostics.len())
        }
        Failure::Build(failed) => {
            failed.diagnostics.iter().for_each(error);
            (failed.built.len(), failed.diagnostics.len())
        }
        Failure::Other(message) | Failure::Usage(message) => {
            error(&Diagnostic::new("", message.as_str()));
            (0, 1)
        }
    };
    say(&Message::End { sets, errors });
}

/// Tells that the build has ended well.
pub(super) fn end(sets: usize) {
    say(&Message::End { sets, errors: 0 });
}

fn shown(path: &std::path::Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}
