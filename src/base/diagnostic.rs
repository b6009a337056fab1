//! What is said to people: errors with a place and a hint, and notes on what was mended in an input.

use std::fmt;

use serde::Serialize;

/// A place in a text file; line and column count from 1, in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Span {
    /// Line of the first character.
    pub line: u32,
    /// Column of the first character.
    pub column: u32,
    /// Line of the character after the last.
    pub end_line: u32,
    /// Column of the character after the last.
    pub end_column: u32,
}

impl Span {
    /// A single character's place.
    #[must_use]
    pub const fn point(line: u32, column: u32) -> Self {
        Self { line, column, end_line: line, end_column: column + 1 }
    }
}

/// The place in a text that asks for another file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Asked {
    /// The file as the user named it, `/` between folders.
    pub file: String,
    /// The place in the file, where one is known.
    pub span: Option<Span>,
    /// Path of the field, as `sources["oak"].file`.
    pub field: String,
}

/// One error: which file, where in it, which field, what is wrong and how to mend it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Diagnostic {
    /// The file as the user named it, `/` between folders.
    pub file: String,
    /// The place in the file, where one is known.
    pub span: Option<Span>,
    /// Path of the field, as `variants[2].count`; empty when the whole file is meant.
    pub field: String,
    /// What is wrong, one sentence.
    pub message: String,
    /// What to do about it, one sentence; empty when the message says all.
    pub hint: String,
    /// What asks for the file, where that is another one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asked_by: Option<Box<Asked>>,
}

impl Diagnostic {
    /// An error about a whole file.
    #[must_use]
    pub fn new(file: impl Into<String>, message: impl Into<String>) -> Self {
        let (file, message) = (file.into(), message.into());
        Self { file, span: None, field: String::new(), message, hint: String::new(), asked_by: None }
    }

    /// The same error at a place.
    #[must_use]
    pub fn with_span(mut self, span: Option<Span>) -> Self {
        self.span = span;
        self
    }

    /// The same error at a field.
    #[must_use]
    pub fn with_field(mut self, field: impl Into<String>) -> Self {
        self.field = field.into();
        self
    }

    /// The same error, of a file that another one asks for.
    #[must_use]
    pub fn asked_by(mut self, by: Asked) -> Self {
        self.asked_by = Some(Box::new(by));
        self
    }

    /// The same error with a hint.
    #[must_use]
    pub fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = hint.into();
        self
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(span) = self.span {
            write!(f, ":{}:{}", span.line, span.column)?;
        }
        f.write_str(": ")?;
        if !self.field.is_empty() {
            write!(f, "{}: ", self.field)?;
        }
        f.write_str(&self.message)?;
        if !self.hint.is_empty() {
            write!(f, " ({})", self.hint)?;
        }
        if let Some(Asked { file, span, field }) = self.asked_by.as_deref() {
            write!(f, "; asked for by {file}")?;
            if let Some(span) = span {
                write!(f, ":{}:{}", span.line, span.column)?;
            }
            write!(f, ": {field}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}

/// Something that was mended, bridged or dropped on the way, and that a user wants to know: not an error.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Note {
    /// What it is about: path of the preset's field, as `sources["oak"]` or `lods[2]`, which counts from 0 as errors do; or `cache`, or the
    /// name of a file of the set.
    pub about: String,
    /// The preset, where it has the field; empty otherwise.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub file: String,
    /// The place of the field in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub span: Option<Span>,
    /// One sentence with its figures. Variants are called as their files.
    pub message: String,
}

impl Note {
    /// A note without a place.
    #[must_use]
    pub fn new(about: impl Into<String>, message: impl Into<String>) -> Self {
        Self { about: about.into(), file: String::new(), span: None, message: message.into() }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(span) = self.span {
            write!(f, "{}:{}:{}: ", self.file, span.line, span.column)?;
        }
        write!(f, "{}: {}", self.about, self.message)
    }
}
