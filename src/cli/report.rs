//! What people read: errors with their line and a hint, progress, summaries.

use std::io::{ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use indicatif::{ProgressBar, ProgressStyle};

use super::args::MessageFormat;
use super::messages;
use crate::base::{Diagnostic, Span, counted};
use crate::build::{BuildError, Happened, Progress, SetState, SetStatus};

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    /// Wrong presets or inputs, all of them.
    #[error("{} errors", .0.len())]
    Diagnostics(Vec<Diagnostic>),
    /// A build of which not everything could be built.
    #[error("{} errors", .0.diagnostics.len())]
    Build(BuildError),
    /// Arguments that don't go together, one sentence.
    #[error("{0}")]
    Usage(String),
    /// Anything else, one sentence.
    #[error("{0}")]
    Other(String),
}

impl From<BuildError> for Failure {
    fn from(error: BuildError) -> Self {
        Self::Build(error)
    }
}

/// Writes what was asked for to standard output. A reader that has seen enough, as `head`, is no error.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Failure::Other(format!("can't write the result: {e}"))),
        _ => Ok(()),
    }
}

/// Writes a line to standard error. Nobody may listen any more, as behind `2>&1 | head`: what is being built is built all
/// the same.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Prints a failure to standard error.
pub(super) fn failure(failure: &Failure) {
    match failure {
        Failure::Diagnostics(diagnostics) | Failure::Build(BuildError { diagnostics, .. }) => {
            for diagnostic in diagnostics {
                say(&format!("{}\n", rendered(diagnostic)));
            }
            let files = diagnostics.iter().map(|d| &d.file).collect::<std::collections::BTreeSet<_>>().len();
            let errors = counted(diagnostics.len(), "error", "errors");
            say(&format!("{errors} in {}", counted(files, "file", "files")));
        }
        Failure::Other(message) | Failure::Usage(message) => say(&format!("error: {message}")),
    }
}

/// A diagnostic with the line it is about, and that which asks for the file, where the files can still be read.
pub(super) fn rendered(diagnostic: &Diagnostic) -> String {
    let renderer = if std::io::stderr().is_terminal() { Renderer::styled() } else { Renderer::plain() };
    let Diagnostic { file, span, field, message, hint, asked_by } = diagnostic;
    let title = if field.is_empty() { message.clone() } else { format!("{field}: {message}") };
    let text = lines_of(file, *span);
    let asks = asked_by.as_ref().map(|by| (by, lines_of(&by.file, by.span), format!("`{}` asks for it", by.field)));
    let mut group = Group::with_title(Level::ERROR.primary_title(&title));
    group = shown(group, (file, *span), &text, (AnnotationKind::Primary, ""));
    if let Some((by, text, label)) = &asks {
        group = shown(group, (&by.file, by.span), text, (AnnotationKind::Context, label));
    }
    if !hint.is_empty() {
        group = group.element(Level::HELP.message(hint));
    }
    renderer.render(&[group]).to_string()
}

/// The text of a file in which a place is to be shown; empty where it can't be.
fn lines_of(file: &str, span: Option<Span>) -> String {
    // What is a pipe or a device, or very large, has no lines to show: reading it could take for ever.
    let shows = |m: std::fs::Metadata| span.is_some() && m.is_file() && m.len() < 4 << 20;
    let text = std::fs::metadata(file).is_ok_and(shows).then(|| std::fs::read(file).ok());
    let text = text.flatten().map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    // The mark that some editors begin a file with counts as no column.
    text.strip_prefix('\u{feff}').unwrap_or(&text).to_owned()
}

/// A group of a message with a place in a file more: the line where there is one, else the file's name and what is known of
/// the place.
fn shown<'a>(
    group: Group<'a>,
    (file, span): (&'a str, Option<Span>),
    text: &'a str,
    (kind, label): (AnnotationKind, &'a str),
) -> Group<'a> {
    if let Some(range) = span.and_then(|span| byte_range(text, span)) {
        let mark = kind.span(range);
        let mark = if label.is_empty() { mark } else { mark.label(label) };
        return group.element(Snippet::source(text).path(file).annotation(mark));
    }
    let mut origin = annotate_snippets::Origin::path(file);
    if let Some(span) = span {
        origin = origin.line(span.line as usize).char_column(span.column as usize);
    }
    let group = group.element(origin);
    if label.is_empty() { group } else { group.element(Level::NOTE.message(label)) }
}

/// The bytes of a span; none when the text has no such place.
fn byte_range(text: &str, span: Span) -> Option<std::ops::Range<usize>> {
    let offset = |line: u32, column: u32| {
        let start: usize = text.split_inclusive('\n').take(line as usize - 1).map(str::len).sum();
        let rest = text.get(start..)?;
        let end = rest.find('\n').unwrap_or(rest.len());
        let within = rest[..end].char_indices().nth(column as usize - 1).map_or(end, |(i, _)| i);
        Some(start + within)
    };
    (span.line >= 1 && span.column >= 1 && span.line as usize <= text.lines().count().max(1)).then_some(())?;
    let (start, end) = (offset(span.line, span.column)?, offset(span.end_line.max(1), span.end_column.max(1))?);
    Some(start..end.max(start))
}

/// Shows a build's progress: one bar over all steps on a terminal, a line a set elsewhere.
pub(super) struct Meter {
    format: MessageFormat,
    bar: Option<ProgressBar>,
    sets: Mutex<()>,
}

impl Meter {
    /// A meter for a build with no steps known yet.
    pub(super) fn new(format: MessageFormat) -> Self {
        let bar = (format == MessageFormat::Text && std::io::stderr().is_terminal()).then(|| {
            let style = ProgressStyle::with_template("{spinner} [{bar:32}] {pos}/{len} {msg}")
                .expect("the template is well-formed")
                .progress_chars("=> ");
            let bar = ProgressBar::new(0).with_style(style);
            bar.enable_steady_tick(Duration::from_millis(120));
            bar
        });
        Self { format, bar, sets: Mutex::new(()) }
    }

    /// A meter that only prints lines.
    pub(super) fn plain() -> Self {
        Self { format: MessageFormat::Text, bar: None, sets: Mutex::new(()) }
    }

    /// Takes one event.
    pub(super) fn take(&self, progress: &Progress<'_>) {
        if self.format == MessageFormat::Json {
            let _one_at_a_time = self.sets.lock();
            messages::progress(progress);
            return;
        }
        match (&self.bar, progress) {
            (Some(bar), Progress::Steps(count)) => bar.inc_length(*count as u64),
            (Some(bar), Progress::Step { set, what }) => {
                bar.inc(1);
                bar.set_message(format!("{set}: {what}"));
            }
            (_, Progress::Waiting) => self.line("waiting: another treewright builds into the output folder"),
            (_, Progress::Set { outcome, folder }) => self.line(&summary(folder, outcome)),
            (None, _) => {}
        }
    }

    /// Tells what a build would find in a set, and what it would do.
    pub(super) fn status(&self, status: &SetStatus, force: bool) {
        if self.format == MessageFormat::Json {
            messages::status(status);
            return;
        }
        let what = match &status.state {
            SetState::Current if force => "nothing has changed, and --force builds it all the same".to_owned(),
            SetState::Current => "nothing to do".to_owned(),
            SetState::New => "not built yet".to_owned(),
            SetState::Changed => "the preset, or a file that it reads, has changed since it was built".to_owned(),
            SetState::Damaged { files } => format!("changed or removed by somebody: {}", files.join(", ")),
            SetState::Orphaned { preset } => {
                format!("its preset, {}, is gone; delete the folder if nobody needs it", preset.display())
            }
        };
        self.line(&format!("{}: {what}", status.folder.display()));
    }

    /// Tells that all went well.
    pub(super) fn end(&self, sets: usize) {
        if self.format == MessageFormat::Json {
            messages::end(sets);
        }
    }

    /// Prints a line above the bar.
    pub(super) fn line(&self, text: &str) {
        let _one_at_a_time = self.sets.lock();
        match &self.bar {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    /// Clears the bar.
    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn summary(folder: &Path, outcome: &crate::build::Outcome) -> String {
    let variants = counted(outcome.variants, "variant", "variants");
    let mut text = format!("{}: {variants} in {}", outcome.set, folder.display());
    match outcome.happened {
        Happened::Current => text += ", nothing had changed",
        Happened::Shard { trees } => {
            text = format!("{}: {} made for the cache", outcome.set, counted(trees, "tree", "trees"))
        }
        Happened::Built => {
            let c = &outcome.committed;
            let (written, removed) = (counted(c.written.len(), "file", "files"), c.removed.len());
            let took = outcome.took.as_secs_f64();
            text += &format!(", {written} written, {} unchanged, {removed} removed, {took:.2} s", c.unchanged);
        }
    }
    for note in &outcome.notes {
        text += &format!("\n  note: {note}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_before_the_text_moves_no_underline() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ron");
        std::fs::write(&path, "\u{feff}(seed: x)").unwrap();
        let span = Span { line: 1, column: 8, end_line: 1, end_column: 9 };
        let text = rendered(&Diagnostic::new(path.to_string_lossy(), "wrong").with_span(Some(span)));
        let at = |part: &str| text.lines().find_map(|line| line.find(part));
        assert!(at("x)").is_some() && at("x)") == at("^"), "{text}");
    }
}
