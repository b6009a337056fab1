//! Text to rows of cells, and the errors of both.
//!
//! Works on bytes: a file need not be valid UTF-8 as a whole, only its numbers must be. Lines end with LF, CRLF or a
//! lone CR; a byte order mark, empty lines and lines that start with `#` are skipped. The separator is taken from the
//! first row: a tab, else `;`, else `,`, else blanks. With `;` or a tab a comma can only be a decimal point. Quotes
//! around a cell are dropped; a separator inside quotes is not supported and shows as a wrong number of columns.

use super::stranger::stranger;
use crate::base::{Diagnostic, Span, counted};

use super::MOST_ROWS;

/// Most errors that are listed one by one.
const MOST_ERRORS: usize = 20;

/// Collects errors up to a limit and counts the rest.
#[derive(Debug)]
pub(super) struct Errors {
    file: String,
    list: Vec<Diagnostic>,
    more: usize,
}

impl Errors {
    /// No error yet.
    pub(super) fn new(file: &str) -> Self {
        Self { file: file.to_owned(), list: Vec::new(), more: 0 }
    }

    /// Adds an error; the message is made only when it is listed.
    pub(super) fn add(&mut self, span: Option<Span>, field: &str, text: impl FnOnce() -> (String, String)) {
        if self.list.len() < MOST_ERRORS {
            let (message, hint) = text();
            self.list.push(
                Diagnostic::new(&*self.file, message).with_span(span).with_field(shortened(field)).with_hint(hint),
            );
        } else {
            self.more += 1;
        }
    }

    /// Whether nothing was added.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// All of them, the last one counting what is not listed.
    pub(super) fn into_list(mut self) -> Vec<Diagnostic> {
        if self.more > 0 {
            self.list
                .push(Diagnostic::new(self.file, format!("and {}", counted(self.more, "more error", "more errors"))));
        }
        self.list
    }
}

/// At most 40 characters of some text for a message, control characters replaced.
pub(super) fn shortened(text: &str) -> String {
    let mut short: String = text.chars().take(40).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if text.chars().nth(40).is_some() {
        short.push('…');
    }
    short
}

/// What parts the cells of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    /// This byte, each time.
    Byte(u8),
    /// Runs of blanks and tabs.
    Blanks,
}

/// One row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<'a> {
    /// The line without its end.
    pub(super) text: &'a [u8],
    /// From 1.
    pub(super) line: u32,
}

/// A file of rows.
#[derive(Clone, Debug)]
pub(super) struct Table<'a> {
    pub(super) file: &'a str,
    pub(super) separator: Separator,
    rest: &'a [u8],
    line: u32,
    rows: usize,
}

impl<'a> Table<'a> {
    fn new(bytes: &'a [u8], file: &'a str) -> Self {
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self { file, separator: Separator::Blanks, rest, line: 0, rows: 0 }
    }

    /// The next row that holds anything.
    ///
    /// # Errors
    ///
    /// When there are more than [`MOST_ROWS`].
    pub(super) fn next(&mut self) -> Result<Option<Row<'a>>, Vec<Diagnostic>> {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(self.rest.len());
            let text = &self.rest[..end];
            let skip = if self.rest[end..].starts_with(b"\r\n") { end + 2 } else { (end + 1).min(self.rest.len()) };
            self.rest = &self.rest[skip..];
            self.line = self.line.saturating_add(1);
            let first = text.iter().find(|b| !b.is_ascii_whitespace());
            if first.is_some_and(|&b| b != b'#') {
                self.rows += 1;
                if self.rows > MOST_ROWS + 1 {
                    return Err(vec![
                        Diagnostic::new(self.file, format!("the file has more than {MOST_ROWS} rows"))
                            .with_hint("thin the model out before importing it"),
                    ]);
                }
                return Ok(Some(Row { text, line: self.line }));
            }
        }
        Ok(None)
    }

    /// Splits a row; `cells` is cleared first. Empty cells at the end are dropped where there are more than `width`.
    pub(super) fn split(&self, row: Row<'a>, width: usize, cells: &mut Vec<&'a [u8]>) {
        cells.clear();
        match self.separator {
            Separator::Byte(byte) => cells.extend(row.text.split(|&b| b == byte).map(trimmed)),
            Separator::Blanks => {
                cells.extend(row.text.split(|b| b.is_ascii_whitespace()).filter(|c| !c.is_empty()).map(trimmed));
            }
        }
        while cells.len() > width && cells.last().is_some_and(|c| c.is_empty()) {
            cells.pop();
        }
    }

    /// The place of a cell, which must be a part of the row's text.
    pub(super) fn span(&self, row: Row<'a>, cells: &[&'a [u8]], index: usize) -> Span {
        // Cells are sub-slices of the row, but for those that stand for what a short row lacks.
        let place = cells.get(index).map(|cell| (cell.as_ptr().addr().wrapping_sub(row.text.as_ptr().addr()), *cell));
        let (from, width) = match place {
            Some((from, cell)) if from <= row.text.len() => (from, characters(cell)),
            _ if index == 0 => (0, 0),
            _ => (row.text.len(), 0),
        };
        let column = characters(&row.text[..from]).saturating_add(1);
        Span { line: row.line, column, end_line: row.line, end_column: column.saturating_add(width.max(1)) }
    }

    /// A cell's number.
    pub(super) fn number(&self, cell: &[u8]) -> Option<f64> {
        let text = std::str::from_utf8(cell).ok()?;
        match text.parse() {
            Ok(number) => Some(number),
            Err(_) if self.separator != Separator::Byte(b',') && text.matches(',').count() == 1 => {
                text.replace(',', ".").parse().ok()
            }
            Err(_) => None,
        }
    }
}

/// Characters of some bytes that may be no text.
fn characters(bytes: &[u8]) -> u32 {
    let count = bytes.iter().filter(|&&b| b & 0xc0 != 0x80).count();
    u32::try_from(count).unwrap_or(u32::MAX)
}

fn trimmed(cell: &[u8]) -> &[u8] {
    let cell = cell.trim_ascii();
    match cell {
        [b'"', inner @ .., b'"'] => inner.trim_ascii(),
        _ => cell,
    }
}

/// What the rows of a file are.
#[derive(Debug)]
pub(super) enum Kind<'a> {
    /// Rows of numbers only.
    Swc,
    /// A header, and cylinders after it.
    Cylinders(Row<'a>),
}

/// A file that is rows of a known kind.
#[derive(Debug)]
pub(super) struct Sniffed<'a> {
    /// After the header, if there is one.
    pub(super) table: Table<'a>,
    pub(super) format: Kind<'a>,
}

const READ: &str =
    "read are meshes (glTF, GLB, OBJ, PLY), TreeQSM (CSV, text, MAT), SimpleForest and aRchi CSV, SWC and MTG";

/// Finds out what a file is.
///
/// # Errors
///
/// One error about the whole file when it is empty, binary, or of a kind that is not read.
pub(super) fn sniff<'a>(bytes: &'a [u8], file: &'a str) -> Result<Sniffed<'a>, Vec<Diagnostic>> {
    let refuse = |message: &str, hint: String| Err(vec![Diagnostic::new(file, message).with_hint(hint)]);
    if bytes.starts_with(b"MATLAB") || bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        return refuse(
            "this is a MATLAB file of a version that is not read (7.3 is HDF5), or a part of one",
            format!("save it in MATLAB with `save(file, 'QSM', '-v7')`; {READ}"),
        );
    }
    if let Some((what, help)) = stranger(bytes) {
        return refuse(&format!("{what}, and no tree"), format!("{help}; {READ}"));
    }
    if let Some(at) = bytes.iter().position(|&b| b == 0) {
        // Who names a mesh has a broken one.
        let begins = [("glb", "`glTF`"), ("ply", "`ply`")];
        let named = begins.iter().find(|(end, _)| file.to_ascii_lowercase().ends_with(&format!(".{end}")));
        return match named {
            Some((end, first)) => refuse(
                &format!("the file is no {}: it doesn't begin with {first}", end.to_uppercase()),
                "export it again".into(),
            ),
            None => refuse(&format!("the file is binary: byte {at} is NUL"), READ.into()),
        };
    }
    let mut table = Table::new(bytes, file);
    let start = table.clone();
    let Some(first) = table.next()? else {
        return refuse("the file is empty", READ.into());
    };
    table.separator = [b'\t', b';', b',']
        .into_iter()
        .find(|b| first.text.contains(b))
        // "1 2 3,5" has blanks between its numbers: the comma is a decimal point.
        .filter(|&b| b != b',' || !decimal_commas(first.text))
        .map_or(Separator::Blanks, Separator::Byte);
    let mut cells = Vec::new();
    table.split(first, 0, &mut cells);
    if !cells.is_empty() && cells.iter().all(|cell| table.number(cell).is_some()) {
        // Rows of numbers with tabs may hold runs of them.
        let separator = if table.separator == Separator::Byte(b'\t') { Separator::Blanks } else { table.separator };
        let table = Table { separator, ..start };
        table.split(first, 0, &mut cells);
        if !(6..=7).contains(&cells.len()) {
            return Err(vec![
                Diagnostic::new(file, format!("the first row holds {} numbers and no header", cells.len()))
                    .with_span(Some(table.span(first, &[], 0)))
                    .with_hint("SWC has 7 columns and no header, cylinders need a header"),
            ]);
        }
        return Ok(Sniffed { table, format: Kind::Swc });
    }
    if cells.len() < 3 {
        let shown = shortened(&String::from_utf8_lossy(first.text.get(..200).unwrap_or(first.text)));
        return Err(vec![
            Diagnostic::new(file, format!("the first row is neither a header nor numbers: `{shown}`"))
                .with_span(Some(table.span(first, &cells, 0)))
                .with_hint(READ),
        ]);
    }
    Ok(Sniffed { table, format: Kind::Cylinders(first) })
}

/// Whether every comma stands between two digits and there are blanks as well.
fn decimal_commas(text: &[u8]) -> bool {
    let text = text.trim_ascii();
    text.contains(&b' ')
        && text.windows(3).filter(|w| w[1] == b',').all(|w| w[0].is_ascii_digit() && w[2].is_ascii_digit())
}
