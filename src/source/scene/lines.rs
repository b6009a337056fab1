//! Lines of OBJ and MTL files: statements with their line number, words and numbers in them.
//!
//! Lines end with LF, CRLF or a lone CR; a backslash at the end continues a statement on the next line; `#` starts a
//! comment only at a line's beginning (names may hold one). Works on bytes: only what is used must be UTF-8.

use crate::base::{Diagnostic, Span, counted};

/// Most errors that are listed.
const MOST_ERRORS: usize = 20;

/// A statement: its first word and what follows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Statement<'a> {
    /// The first word.
    pub(super) word: &'a [u8],
    /// The rest, trimmed; may hold line ends after backslashes.
    pub(super) rest: &'a [u8],
    /// Line of the first word, from 1.
    pub(super) line: u32,
}

/// The statements of a file.
#[derive(Clone, Debug)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    line: u32,
}

impl<'a> Lines<'a> {
    pub(super) fn of(text: &'a [u8]) -> Self {
        Self { rest: text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text), line: 0 }
    }

    /// The next line with its end's length; advances past it.
    fn cut(&mut self) -> &'a [u8] {
        let end = self.rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        let skip = if self.rest[end..].starts_with(b"\r\n") { end + 2 } else { (end + 1).min(self.rest.len()) };
        self.rest = &self.rest[skip..];
        self.line = self.line.saturating_add(1);
        line
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        while !self.rest.is_empty() {
            let whole = self.rest;
            let first = self.cut();
            let line = self.line;
            let mut text = first;
            if text.trim_ascii_start().first().is_none_or(|&b| b == b'#') {
                continue;
            }
            while text.ends_with(b"\\") && !self.rest.is_empty() {
                self.cut();
                let mut end = whole.len() - self.rest.len();
                while end > 0 && matches!(whole[end - 1], b'\n' | b'\r') {
                    end -= 1;
                }
                // An empty line ends the statement: it has nothing that could go on.
                if end <= text.len() {
                    break;
                }
                text = &whole[..end];
            }
            let text = text.trim_ascii();
            let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
            return Some(Statement { word: &text[..end], rest: text[end..].trim_ascii(), line });
        }
        None
    }
}

impl<'a> Statement<'a> {
    /// The words after the first.
    pub(super) fn words(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        self.rest.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty() && *w != b"\\")
    }

    /// What follows the first word, as a name; broken UTF-8 replaced.
    pub(super) fn name(&self) -> String {
        String::from_utf8_lossy(self.rest).into_owned()
    }
}

/// A finite number.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    let number: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    number.is_finite().then_some(number)
}

/// At most 40 characters of something for a message, control characters replaced.
pub(super) fn shown(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes.get(..200).unwrap_or(bytes));
    let mut short: String = text.chars().take(40).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if text.chars().nth(40).is_some() {
        short.push('…');
    }
    short
}

/// Errors of a text file, at most 20 and one that counts the rest.
#[derive(Debug)]
pub(super) struct Errors<'a> {
    file: &'a str,
    list: Vec<Diagnostic>,
    more: usize,
}

impl<'a> Errors<'a> {
    pub(super) fn new(file: &'a str) -> Self {
        Self { file, list: Vec::new(), more: 0 }
    }

    /// An error in a line.
    pub(super) fn add(&mut self, line: u32, message: impl FnOnce() -> String) {
        if self.list.len() < MOST_ERRORS {
            let place = Some(Span::point(line, 1));
            self.list.push(Diagnostic::new(self.file, message()).with_span(place));
        } else {
            self.more += 1;
        }
    }

    /// Nothing, or all of them.
    pub(super) fn check(mut self) -> Result<(), Vec<Diagnostic>> {
        if self.more > 0 {
            self.list
                .push(Diagnostic::new(self.file, format!("and {}", counted(self.more, "more error", "more errors"))));
        }
        if self.list.is_empty() { Ok(()) } else { Err(self.list) }
    }
}
