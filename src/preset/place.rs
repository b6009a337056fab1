//! Where a field stands: for errors that later stages find, as a scan that can't be read or a species that grows
//! nothing.

use super::reader::clip;
use super::report::Report;
use super::syntax::{Node, Value, tree};
use crate::base::Span;

/// The place of a field in a preset's or species' text, by its path as diagnostics write it: `sources["scan"].file`,
/// `variants[2].of[0]`. Where the text doesn't give the field, the place of the innermost group around it that it gives;
/// none when the text can't be read.
#[must_use]
pub fn place(text: &str, field: &str) -> Option<Span> {
    let mut node = &tree(text, &Report::new(""))?;
    let mut rest = field;
    while let Some((inner, behind)) = step(node, rest.trim_start_matches('.')) {
        (node, rest) = (inner, behind);
    }
    Some(node.span)
}

/// The value that the first part of a path names, and what is left of the path.
pub(super) fn step<'n, 'p>(node: &'n Node, path: &'p str) -> Option<(&'n Node, &'p str)> {
    match &node.value {
        Value::Record(_, fields) => {
            let (name, rest) = path.split_at(path.find(['.', '[']).unwrap_or(path.len()));
            let (_, inner) = fields.iter().find(|(key, _)| key.text == name)?;
            Some((inner, rest))
        }
        Value::List(items) => {
            let (index, rest) = path.strip_prefix('[')?.split_once(']')?;
            Some((items.get(index.parse::<usize>().ok()?)?, rest))
        }
        Value::Map(entries) => {
            let path = path.strip_prefix("[\"")?;
            entries.iter().find_map(|(key, inner)| match &key.value {
                Value::Text(key) => Some((inner, path.strip_prefix(clip(key).as_str())?.strip_prefix("\"]")?)),
                _ => None,
            })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found_where_they_stand() {
        let text = "(\n  sources: {\"scan\": Import(file: \"x.csv\")},\n  variants: [Source(\"scan\"), Blend(of: [\"a\", \"b\"])],\n)";
        for (field, place_of_it) in [
            ("sources[\"scan\"].file", (2, 34)),
            ("sources[\"scan\"].height", (2, 21)),
            ("sources[\"scan\"]", (2, 21)),
            ("sources[\"x\"].file", (2, 12)),
            ("variants[0].of", (3, 14)),
            ("variants[1].of[1]", (3, 46)),
            ("variants[7]", (3, 13)),
            ("atlas.size", (1, 1)),
            ("", (1, 1)),
            ("[[[", (1, 1)),
            ("sources[", (2, 12)),
        ] {
            let span = place(text, field).expect("reads");
            assert_eq!((span.line, span.column), place_of_it, "{field}");
        }
        assert_eq!(place("", "seed"), None);
    }

    #[test]
    fn every_diagnostic_with_a_value_is_at_the_place_of_its_field() {
        let text = "(sources: {\"a\": Import(file: \"/x\")}, variants: [Source(of: \"b\")], mesh: (sides: 1), lods: [Full, Full])";
        let found = crate::preset::load("a.ron", text, &mut |_| Err(String::new())).unwrap_err();
        assert_eq!(found.len(), 4);
        for diagnostic in found {
            assert_eq!(place(text, &diagnostic.field), diagnostic.span, "{diagnostic}");
        }
    }
}
