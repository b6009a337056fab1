//! What is wrong with a file that a preset asks for, told so that the preset's author can mend it: every such error passes
//! through here, whatever reads the file.
//!
//! What is wrong at a place in the file is told there, with the field that asks for the file beside it; what is wrong with
//! the file as a whole is told at that field. Either way the error names both files and says what helps.

use crate::base::{Asked, Diagnostic};

/// The errors of a file with what asks for it.
#[must_use]
pub(crate) fn asked_for(found: Vec<Diagnostic>, by: &Asked) -> Vec<Diagnostic> {
    let told = |error: Diagnostic| match error.span {
        Some(_) => error.asked_by(by.clone()),
        None => {
            let message = if error.field.is_empty() {
                format!("{}: {}", error.file, error.message)
            } else {
                format!("{}: {}: {}", error.file, error.field, error.message)
            };
            let at_field = Diagnostic::new(&by.file, message).with_span(by.span).with_field(&by.field);
            at_field.with_hint(error.hint)
        }
    };
    found.into_iter().map(told).collect()
}

/// The errors of a file that no person writes, as one with what helps: where one row is wrong, many are, for one reason.
#[must_use]
pub(crate) fn data_asked_for(mut found: Vec<Diagnostic>, by: &Asked) -> Vec<Diagnostic> {
    let more = found.len().saturating_sub(1);
    found.truncate(1);
    let mut told = asked_for(found, by);
    for error in &mut told {
        if more > 0 {
            error.message.push_str("; more errors follow in the file");
        }
        if error.hint.is_empty() {
            error.hint =
                format!("the file may be cut off or damaged: export it again, or name another in `{}`", by.field);
        }
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Span;

    #[test]
    fn both_files_are_named_wherever_the_error_stands() {
        let by = Asked { file: "oak.ron".into(), span: Some(Span::point(4, 30)), field: "sources[\"a\"].file".into() };
        let whole = asked_for(vec![Diagnostic::new("a.csv", "the file is empty")], &by).remove(0);
        assert_eq!(whole.to_string(), "oak.ron:4:30: sources[\"a\"].file: a.csv: the file is empty");
        let cell = Diagnostic::new("a.csv", "`x` is no number").with_span(Some(Span::point(2, 5))).with_field("radius");
        let told = data_asked_for(vec![cell.clone(), cell], &by);
        assert_eq!(told.len(), 1);
        let text = told[0].to_string();
        for part in ["a.csv:2:5: radius: `x` is no number; more", "name another", "oak.ron:4:30: sources[\"a\"].file"] {
            assert!(text.contains(part), "{part} in {text}");
        }
    }
}
