//! Collects what is wrong with one file, so that all of it is said at once.

use std::cell::RefCell;

use crate::base::{Diagnostic, Span};

/// Most errors kept of one file; a text of nothing but errors must not fill the memory.
const MOST_ERRORS: usize = 64;

/// The errors of one file so far.
pub(super) struct Report<'f> {
    file: &'f str,
    // Readers of nested values share one report; a cell spares every one of them a mutable borrow.
    found: RefCell<Vec<Diagnostic>>,
    /// Of other files, file after file.
    adopted: RefCell<Vec<Diagnostic>>,
}

impl<'f> Report<'f> {
    pub(super) fn new(file: &'f str) -> Self {
        Self { file, found: RefCell::default(), adopted: RefCell::default() }
    }

    fn push(&self, diagnostic: Diagnostic) {
        let mut found = self.found.borrow_mut();
        if found.len() < MOST_ERRORS {
            found.push(diagnostic);
        } else if found.len() == MOST_ERRORS {
            found.push(Diagnostic::new(self.file, "more errors follow").with_hint("mend the first ones and try again"));
        }
    }

    /// The file's name.
    pub(super) fn file(&self) -> &'f str {
        self.file
    }

    /// An error about the whole file.
    pub(super) fn whole(&self, message: impl Into<String>, hint: impl Into<String>) {
        self.push(Diagnostic::new(self.file, message).with_hint(hint));
    }

    /// An error at a place; `field` is the path of the field, or empty.
    pub(super) fn at(
        &self,
        span: impl Into<Option<Span>>,
        field: &str,
        message: impl Into<String>,
        hint: impl Into<String>,
    ) {
        let diagnostic = Diagnostic::new(self.file, message).with_field(field).with_hint(hint);
        self.push(diagnostic.with_span(span.into()));
    }

    /// Takes over what another file's report found.
    pub(super) fn adopt(&self, diagnostics: Vec<Diagnostic>) {
        self.adopted.borrow_mut().extend(diagnostics);
    }

    /// Whether nothing was found so far.
    pub(super) fn is_clean(&self) -> bool {
        self.found.borrow().is_empty() && self.adopted.borrow().is_empty()
    }

    /// Whether further errors of this file would be dropped, so that looking for them is in vain.
    pub(super) fn is_full(&self) -> bool {
        self.found.borrow().len() > MOST_ERRORS
    }

    /// All that was found: in the order of the text, then what was adopted.
    pub(super) fn into_diagnostics(self) -> Vec<Diagnostic> {
        let mut found = self.found.into_inner();
        // Stable: of several errors at one place the first found stays first; "more errors" has no place and goes last.
        found.sort_by_key(|d| (d.span.is_none(), d.span));
        found.append(&mut self.adopted.into_inner());
        found
    }
}
