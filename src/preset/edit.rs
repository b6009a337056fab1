//! Edits of a preset's or species' text that leave everything else as it stands: comments, order, blanks, line ends.
//!
//! A value is replaced where it stands; a field that the text does not give is added behind the last one of its group,
//! on a line of its own where that has one; an item is added to a list in the same way. Each edit is read back before
//! it is accepted: a text that is well-formed stays so, and no edit can touch what it does not name. Linear in the
//! text for each edit.

use super::place::step;
use super::report::Report;
use super::syntax::{Node, Value, tree};
use crate::base::Span;

/// Most edits at a time.
const MOST_EDITS: usize = 256;

/// One change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Edit {
    /// Gives a field a value, in RON; its path is as diagnostics write it (`variants[2].count`).
    Set {
        /// The field.
        path: String,
        /// Its value.
        value: String,
    },
    /// Adds an item at the end of a list.
    Append {
        /// The list.
        path: String,
        /// The item.
        value: String,
    },
    /// Takes a field out, with its line where it has one of its own.
    Remove {
        /// The field.
        path: String,
    },
}

impl Edit {
    /// The field that it is about.
    #[must_use]
    pub fn path(&self) -> &str {
        match self {
            Self::Set { path, .. } | Self::Append { path, .. } | Self::Remove { path } => path,
        }
    }
}

/// Why a text can't be edited.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// It is not well-formed; mending it comes first.
    #[error("the file has an error; mend it first: {0}")]
    Broken(String),
    /// No such field or list.
    #[error("there is no place for `{0}`")]
    NoPlace(String),
    /// The value is none.
    #[error("`{0}` is no value")]
    NoValue(String),
    /// Too many at a time.
    #[error("more than {MOST_EDITS} edits")]
    TooMany,
}

/// Makes some edits, one after the other.
///
/// # Errors
///
/// The first edit that can't be made; see [`EditError`].
pub fn edited(text: &str, edits: &[Edit]) -> Result<String, EditError> {
    if edits.len() > MOST_EDITS {
        return Err(EditError::TooMany);
    }
    let mut text = text.to_owned();
    for edit in edits {
        text = one(&text, edit)?;
    }
    Ok(text)
}

/// The value of a field as the text gives it.
#[must_use]
pub fn value_of<'t>(text: &'t str, path: &str) -> Option<&'t str> {
    let root = read(text).ok()?;
    let (node, rest) = down(&root, path);
    rest.is_empty().then(|| bytes(text, node.span)).flatten().map(|range| &text[range])
}

fn read(text: &str) -> Result<Node, EditError> {
    let report = Report::new("");
    let root = tree(text, &report);
    match (root, report.into_diagnostics().into_iter().next()) {
        (Some(root), None) => Ok(root),
        (_, found) => Err(EditError::Broken(found.map(|d| d.message).unwrap_or_default())),
    }
}

/// The innermost group on the way to a field, and what of the path it lacks.
fn down<'n, 'p>(root: &'n Node, path: &'p str) -> (&'n Node, &'p str) {
    let (mut node, mut rest) = (root, path);
    while let Some((inner, behind)) = step(node, rest) {
        (node, rest) = (inner, behind.trim_start_matches('.'));
    }
    (node, rest)
}

fn one(text: &str, edit: &Edit) -> Result<String, EditError> {
    let root = read(text)?;
    let no_place = || EditError::NoPlace(edit.path().to_owned());
    let made = match edit {
        Edit::Set { path, value } => {
            sound(value)?;
            let (node, rest) = down(&root, path);
            let range = bytes(text, node.span).ok_or_else(no_place)?;
            if rest.is_empty() {
                splice(text, range, value)
            } else {
                let Value::Record(_, fields) = &node.value else { return Err(no_place()) };
                let added = field(rest, value).ok_or_else(no_place)?;
                let last = fields.last().map(|(name, node)| (name.span, node.span));
                add(text, range, last, &added).ok_or_else(no_place)?
            }
        }
        Edit::Append { path, value } => {
            sound(value)?;
            let (node, rest) = down(&root, path);
            let (Value::List(items), true) = (&node.value, rest.is_empty()) else { return Err(no_place()) };
            let range = bytes(text, node.span).ok_or_else(no_place)?;
            add(text, range, items.last().map(|item| (item.span, item.span)), value).ok_or_else(no_place)?
        }
        Edit::Remove { path } => {
            let (group, name) = path.rsplit_once('.').unwrap_or(("", path));
            let (node, rest) = down(&root, group);
            let (Value::Record(_, fields), true) = (&node.value, rest.is_empty()) else { return Err(no_place()) };
            let found = fields.iter().position(|(known, _)| known.text == name);
            // What is not there need not be taken out.
            let Some(at) = found else { return Ok(text.to_owned()) };
            let start = bytes(text, fields[at].0.span).ok_or_else(no_place)?.start;
            let end = bytes(text, fields[at].1.span).ok_or_else(no_place)?.end;
            let before = (at > 0).then(|| bytes(text, fields[at - 1].1.span)).flatten().map(|range| range.end);
            remove(text, start, end, before)
        }
    };
    read(&made).map_err(|_| no_place())?;
    Ok(made)
}

/// Whether a text is one value.
fn sound(value: &str) -> Result<(), EditError> {
    let ok = value.len() <= 1 << 16 && !value.contains("//") && !value.contains("/*") && read(value).is_ok();
    if ok { Ok(()) } else { Err(EditError::NoValue(value.chars().take(40).collect())) }
}

/// `name: value`, with groups around it for a path of several names.
fn field(path: &str, value: &str) -> Option<String> {
    let name_like = |name: &str| !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    let mut names = path.split('.').rev();
    let last = names.next().filter(|name| name_like(name))?;
    let mut made = format!("{last}: {value}");
    for name in names {
        if !name_like(name) {
            return None;
        }
        made = format!("{name}: ({made})");
    }
    Some(made)
}

/// Adds an entry at the end of a bracket, written as the last entry is.
fn add(text: &str, bracket: std::ops::Range<usize>, last: Option<(Span, Span)>, entry: &str) -> Option<String> {
    let Some((first, last)) = last else {
        // Behind what the brackets hold: comments stay in front.
        let close = bracket.end.checked_sub(1)?;
        let inner = text[..close].trim_end_matches([' ', '\t']).len();
        return Some(if text[..inner].ends_with('\n') {
            let indent = &text[inner..close];
            let line_end = if text[..inner].ends_with("\r\n") { "\r\n" } else { "\n" };
            format!("{}{indent}    {entry},{line_end}{}", &text[..inner], &text[inner..])
        } else {
            splice(text, close..close, entry)
        });
    };
    let (start, end) = (bytes(text, first)?.start, bytes(text, last)?.end);
    let line = text[..start].rfind('\n').map_or(0, |at| at + 1);
    let own_line = line > bracket.start && text[line..start].bytes().all(|b| matches!(b, b' ' | b'\t'));
    let comma = Some(gap(text, end)).filter(|at| text[*at..].starts_with(','));
    if !own_line {
        return Some(match comma {
            Some(at) => splice(text, at + 1..at + 1, &format!(" {entry},")),
            None => splice(text, end..end, &format!(", {entry}")),
        });
    }
    let indent = &text[line..start];
    let behind = comma.map_or(end, |at| at + 1);
    // A comment on the same line belongs to the entry before.
    let rest = text[behind..].find('\n').map_or(text.len() - behind, |at| at);
    let tail = &text[behind..behind + rest];
    let comment = tail.trim_start().starts_with("//");
    let at = if comment { behind + tail.trim_end_matches('\r').len() } else { behind };
    let line_end = if text[..line].ends_with("\r\n") { "\r\n" } else { "\n" };
    let added = format!("{line_end}{indent}{entry},");
    let made = splice(text, at..at, &added);
    Some(if comma.is_none() { splice(&made, end..end, ",") } else { made })
}

/// Takes an entry out, with its comma, and with its line where nothing else stands on it; `before` is where the entry
/// before it ends.
fn remove(text: &str, start: usize, end: usize, before: Option<usize>) -> String {
    let comma = Some(gap(text, end)).filter(|at| text[*at..].starts_with(','));
    let line = text[..start].rfind('\n').map_or(0, |at| at + 1);
    let mut to = comma.map_or(end, |at| at + 1);
    let alone = line > 0 && text[line..start].bytes().all(|b| matches!(b, b' ' | b'\t'));
    let rest = text[to..].find('\n').map(|at| to + at + 1);
    match rest {
        Some(next) if alone && text[to..next].trim().is_empty() => return splice(text, line..next, ""),
        _ => {}
    }
    if comma.is_some() {
        // The blank behind the comma goes with it.
        to += text[to..].len() - text[to..].trim_start_matches([' ', '\t']).len();
        return splice(text, start..to, "");
    }
    // The last one: the comma before it goes, where nothing but blanks lies between.
    match before.filter(|before| text[*before..start].trim() == ",") {
        Some(before) => splice(text, before..end, ""),
        None => splice(text, start..end, ""),
    }
}

fn splice(text: &str, range: std::ops::Range<usize>, with: &str) -> String {
    format!("{}{with}{}", &text[..range.start], &text[range.end..])
}

/// Behind blanks and comments.
fn gap(text: &str, mut at: usize) -> usize {
    loop {
        let rest = &text[at..];
        let blank = rest.len() - rest.trim_start().len();
        at += blank;
        let rest = &text[at..];
        if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if rest.starts_with("/*") {
            let mut depth = 0_usize;
            let mut i = 0;
            loop {
                if rest[i..].starts_with("/*") {
                    depth += 1;
                    i += 2;
                } else if rest[i..].starts_with("*/") {
                    depth -= 1;
                    i += 2;
                } else if let Some(c) = rest[i..].chars().next() {
                    i += c.len_utf8();
                } else {
                    break;
                }
                if depth == 0 {
                    break;
                }
            }
            at += i;
        } else {
            return at;
        }
    }
}

/// The bytes of a place; columns count letters, behind a byte-order mark.
fn bytes(text: &str, span: Span) -> Option<std::ops::Range<usize>> {
    let mark = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    let text = &text[mark..];
    let offset = |line: u32, column: u32| {
        let start: usize = text.split_inclusive('\n').take((line as usize).checked_sub(1)?).map(str::len).sum();
        let rest = text.get(start..)?;
        rest.char_indices()
            .map(|(i, _)| i)
            .chain([rest.len()])
            .nth((column as usize).checked_sub(1)?)
            .map(|i| start + i)
    };
    let (start, end) = (offset(span.line, span.column)?, offset(span.end_line, span.end_column)?);
    (start <= end).then_some(mark + start..mark + end)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(path: &str, value: &str) -> Edit {
        Edit::Set { path: path.to_owned(), value: value.to_owned() }
    }

    fn append(path: &str, value: &str) -> Edit {
        Edit::Append { path: path.to_owned(), value: value.to_owned() }
    }

    fn remove(path: &str) -> Edit {
        Edit::Remove { path: path.to_owned() }
    }

    const TEXT: &str = "// An avenue.\n(\n    seed: 41, // the answer less one\n    /* two */\n    sources: {\"bröad\": \
        Grow(species: \"oak.ron\", seed: 1), \"b\": Grow(species: \"oak.ron\")},\n    variants: [\n        \
        Source(\"b\"),\n        Blend(of: [\"bröad\", \"b\"], count: 6) // six\n    ],\n    foliage: ()\n)\n";

    #[test]
    fn nothing_but_the_value_changes() {
        let made = edited(TEXT, &[set("sources[\"bröad\"].seed", "7"), set("variants[1].count", "8")]).unwrap();
        assert_eq!(made, TEXT.replace("seed: 1)", "seed: 7)").replace("count: 6", "count: 8"));
        assert_eq!(value_of(&made, "variants[1].count"), Some("8"));
        assert_eq!(value_of(&made, "atlas.size"), None);
    }

    #[test]
    fn what_is_not_there_is_added_in_the_style_of_what_is() {
        let added = |edit: Edit| edited(TEXT, &[edit]).unwrap();
        assert_eq!(added(set("sources[\"b\"].height", "9.0")), TEXT.replace("oak.ron\")}", "oak.ron\", height: 9.0)}"));
        assert_eq!(added(set("foliage.density", "0.5")), TEXT.replace("foliage: ()", "foliage: (density: 0.5)"));
        assert_eq!(
            added(set("atlas.size", "512")),
            TEXT.replace("foliage: ()", "foliage: (),\n    atlas: (size: 512),")
        );
        assert_eq!(
            added(append("variants", "Source(\"bröad\")")),
            TEXT.replace("count: 6) // six", "count: 6), // six\n        Source(\"bröad\"),")
        );
        assert_eq!(edited("(a: [1])", &[append("a", "2")]).unwrap(), "(a: [1, 2])");
        assert_eq!(edited("(a: [1,])", &[append("a", "2")]).unwrap(), "(a: [1, 2,])");
        assert_eq!(edited("(a: [])", &[append("a", "2")]).unwrap(), "(a: [2])");
        assert_eq!(edited("(\r\n  a: 1,\r\n)", &[set("b", "2")]).unwrap(), "(\r\n  a: 1,\r\n  b: 2,\r\n)");
    }

    #[test]
    fn what_is_taken_out_leaves_the_rest_as_it_was() {
        assert_eq!(edited(TEXT, &[remove("variants[1].count")]).unwrap(), TEXT.replace(", count: 6", ""));
        assert_eq!(
            edited(TEXT, &[remove("sources[\"bröad\"].species")]).unwrap(),
            TEXT.replace("(species: \"oak.ron\", seed", "(seed")
        );
        assert_eq!(edited("(\n  a: 1,\n  // of b\n  b: 2,\n)", &[remove("b")]).unwrap(), "(\n  a: 1,\n  // of b\n)");
        assert_eq!(
            edited(TEXT, &[remove("atlas.size"), remove("nothing")]),
            Err(EditError::NoPlace("atlas.size".into()))
        );
        assert_eq!(edited(TEXT, &[remove("nothing")]).unwrap(), TEXT);
    }

    #[test]
    fn added_and_taken_out_again_it_is_the_old_text() {
        let there_and_back = [set("variants[1].keep", "[3, 5]"), remove("variants[1].keep")];
        assert_eq!(edited(TEXT, &there_and_back).unwrap(), TEXT);
    }

    #[test]
    fn what_cannot_be_done_is_told_and_does_nothing() {
        for (edit, error) in [
            (set("variants[9].count", "1"), EditError::NoPlace("variants[9].count".into())),
            (set("variants", "[1"), EditError::NoValue("[1".into())),
            (set("seed", "1, evil: 2"), EditError::NoValue("1, evil: 2".into())),
            (set("seed", "1 // x"), EditError::NoValue("1 // x".into())),
            (set("seed.a b", "1"), EditError::NoPlace("seed.a b".into())),
            (append("seed", "1"), EditError::NoPlace("seed".into())),
        ] {
            assert_eq!(edited(TEXT, &[edit]), Err(error));
        }
        assert!(matches!(edited("(a: 1", &[set("a", "2")]), Err(EditError::Broken(_))));
        assert_eq!(edited(TEXT, &vec![set("seed", "1"); 257]), Err(EditError::TooMany));
    }

    #[test]
    fn every_number_of_the_shipped_presets_can_be_set_and_set_back() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/presets");
        let mut tried = 0;
        for entry in std::fs::read_dir(folder).unwrap().chain(std::fs::read_dir(format!("{folder}/species")).unwrap()) {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "ron") {
                continue;
            }
            let text = std::fs::read_to_string(path).unwrap();
            let mut fields = Vec::new();
            numbers(&read(&text).unwrap(), String::new(), &mut fields);
            for field in fields {
                let old = value_of(&text, &field).unwrap().to_owned();
                let other = edited(&text, &[set(&field, "12345")]).unwrap();
                assert_eq!(other.len() + old.len(), text.len() + 5);
                assert_eq!(edited(&other, &[set(&field, &old)]).unwrap(), text);
                tried += 1;
            }
        }
        assert!(tried > 500, "{tried}");
    }

    fn numbers(node: &Node, path: String, into: &mut Vec<String>) {
        let named = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
        match &node.value {
            Value::Integer(_) | Value::Float(_) => into.push(path),
            Value::Record(_, fields) => fields.iter().for_each(|(name, node)| numbers(node, named(&name.text), into)),
            Value::List(items) => {
                items.iter().enumerate().for_each(|(i, node)| numbers(node, format!("{path}[{i}]"), into));
            }
            Value::Map(entries) => entries.iter().for_each(|(key, node)| {
                if let Value::Text(key) = &key.value {
                    numbers(node, format!("{path}[\"{key}\"]"), into);
                }
            }),
            _ => {}
        }
    }
}
