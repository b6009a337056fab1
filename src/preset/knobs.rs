//! What can be turned in a text: its numbers, colours and plain choices, each with the range, unit, default and
//! sentence of the schema, and with the value that the text gives. For sliders.
//!
//! Groups that the text does not give are listed with their defaults, lists and maps as far as the text gives them.

use serde::Serialize;

use super::report::Report;
use super::schema::{Choice, Default, Field, Form, Kind, Record};
use super::set::SET;
use super::species::SPECIES;
use super::syntax::{Node, Value, tree};

/// Most knobs of one text.
const MOST_KNOBS: usize = 600;

/// Which kind of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KnobsOf {
    /// A preset.
    Preset,
    /// A species.
    Species,
}

/// Something that can be turned.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Knob {
    /// Path of the field, as edits take it.
    pub path: String,
    /// The group it is in, for people: `iterations[1].endpoints`; empty at the top.
    pub group: String,
    /// The field's name.
    pub name: String,
    /// A sentence about it.
    pub about: String,
    /// What it holds.
    #[serde(flatten)]
    pub turns: Turns,
    /// What the text gives, in RON; the default where it gives nothing.
    pub value: String,
    /// The default, in RON; empty where something else decides.
    pub default: String,
    /// Whether the text gives it.
    pub given: bool,
}

/// What a knob holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Turns {
    /// A number in a range, both ends included.
    Number {
        /// Least.
        low: f64,
        /// Greatest.
        high: f64,
        /// Its unit; may be empty.
        unit: String,
        /// Whether it is whole.
        whole: bool,
    },
    /// A colour, `#rrggbb`.
    Color,
    /// One of some words.
    Word {
        /// As RON has them: with quotes, or plain.
        words: Vec<String>,
    },
}

/// Lists what can be turned in a text; nothing for one that is not well-formed.
#[must_use]
pub fn knobs(text: &str, of: KnobsOf) -> Vec<Knob> {
    let report = Report::new("");
    let Some(root) = tree(text, &report).filter(|_| report.is_clean()) else { return Vec::new() };
    let mut found = Vec::new();
    let record = match of {
        KnobsOf::Preset => &SET,
        KnobsOf::Species => &SPECIES,
    };
    of_record(record, Some(&root), "", &mut found);
    found
}

fn of_record(record: &'static Record, node: Option<&Node>, path: &str, into: &mut Vec<Knob>) {
    let fields = match node.map(|node| &node.value) {
        Some(Value::Record(_, fields)) => fields.as_slice(),
        None => &[],
        // Short forms, as `Source("oak")`, name their field by place: nothing there is a knob that could be set.
        Some(_) => return,
    };
    for field in record.fields {
        let given = fields.iter().find(|(name, _)| name.text == field.name).map(|(_, node)| node);
        let path = if path.is_empty() { field.name.to_owned() } else { format!("{path}.{}", field.name) };
        of_field(field, given, &path, into);
    }
}

fn of_field(field: &'static Field, given: Option<&Node>, path: &str, into: &mut Vec<Knob>) {
    if into.len() >= MOST_KNOBS {
        return;
    }
    let default = match field.default {
        Default::Is(text) => text,
        _ => "",
    };
    let turns = match field.kind {
        // Both ends as the tables write them.
        Kind::Number { low, high, unit } => {
            let exact = |v: f32| v.to_string().parse().unwrap_or_else(|_| f64::from(v));
            Turns::Number { low: exact(low), high: exact(high), unit: unit.to_owned(), whole: false }
        }
        Kind::Integer { low, high, unit } => {
            // What a page's numbers hold exactly.
            let high = high.min(1 << 53) as f64;
            Turns::Number { low: low as f64, high, unit: unit.to_owned(), whole: true }
        }
        Kind::Color => Turns::Color,
        Kind::Choice(choice) if choice.kinds.iter().all(|kind| matches!(kind.form, Form::Plain)) => {
            Turns::Word { words: choice.names().map(str::to_owned).collect() }
        }
        Kind::WordOrChoice(words, choice) => {
            if let Some(node) = given
                && !matches!(node.value, Value::Text(_))
            {
                of_choice(choice, node, path, into);
                return;
            }
            Turns::Word { words: words.iter().map(|word| format!("\"{word}\"")).collect() }
        }
        Kind::Fields(record) => {
            // A group whose defaults are decided elsewhere can't be shown as if it were there.
            if given.is_some() || !matches!(field.default, Default::Else(_)) {
                of_record(record, given, path, into);
            }
            return;
        }
        Kind::Choice(choice) => {
            if let Some(node) = given {
                of_choice(choice, node, path, into);
            }
            return;
        }
        Kind::ListOf { choice, .. } => {
            if let Some(Node { value: Value::List(items), .. }) = given {
                items.iter().enumerate().for_each(|(i, item)| of_choice(choice, item, &format!("{path}[{i}]"), into));
            }
            return;
        }
        Kind::Rows { record, .. } => {
            if let Some(Node { value: Value::List(items), .. }) = given {
                let of = |(i, item)| of_record(record, Some(item), &format!("{path}[{i}]"), into);
                items.iter().enumerate().for_each(of);
            }
            return;
        }
        Kind::Named { choice, .. } => {
            if let Some(Node { value: Value::Map(entries), .. }) = given {
                for (key, node) in entries {
                    if let Value::Text(key) = &key.value {
                        of_choice(choice, node, &format!("{path}[\"{}\"]", super::reader::clip(key)), into);
                    }
                }
            }
            return;
        }
        Kind::Text(_) | Kind::Texts { .. } | Kind::Numbers { .. } | Kind::Shares { .. } => return,
    };
    let value = given.map_or_else(|| Some(default.to_owned()), |node| shown(&node.value));
    let Some(value) = value else { return };
    let group = path.strip_suffix(field.name).unwrap_or(path).trim_end_matches('.').to_owned();
    into.push(Knob {
        path: path.to_owned(),
        group,
        name: field.name.to_owned(),
        about: field.about.to_owned(),
        turns,
        value,
        default: default.to_owned(),
        given: given.is_some(),
    });
}

fn of_choice(choice: &'static Choice, node: &Node, path: &str, into: &mut Vec<Knob>) {
    let (Value::Record(Some(name), _) | Value::Tuple(Some(name), _)) = &node.value else { return };
    let Some(kind) = choice.kinds.iter().find(|kind| kind.name == name.text) else { return };
    if let (Form::Fields(record) | Form::One(record), Value::Record(..)) = (kind.form, &node.value) {
        of_record(record, Some(node), path, into);
    }
}

/// A value of one word as RON has it; none for others.
fn shown(value: &Value) -> Option<String> {
    Some(match value {
        Value::Integer(value) => value.to_string(),
        Value::Float(value) => format!("{value:?}"),
        Value::Text(text) if text.len() <= 64 => format!("{text:?}"),
        Value::Name(name) => name.clone(),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::edit::{Edit, edited};
    use super::*;

    const SHORT: &str = "(sources: {\"a\": Grow(species: \"oak.ron\", seed: 3)}, variants: [Source(\"a\")], \
        foliage: (density: 0.5))";

    #[test]
    fn knobs_have_the_range_of_the_schema_and_the_value_of_the_text() {
        let all = knobs(SHORT, KnobsOf::Preset);
        let find = |path: &str| all.iter().find(|k| k.path == path).unwrap_or_else(|| panic!("{path}: {all:#?}"));
        let density = find("foliage.density");
        assert_eq!((density.value.as_str(), density.given, density.group.as_str()), ("0.5", true, "foliage"));
        assert!(matches!(density.turns, Turns::Number { low, whole: false, .. } if low == 0.0));
        assert_eq!(find("sources[\"a\"].seed").value, "3");
        let size = find("atlas.size");
        assert!(!size.given && size.value == size.default);
        assert!(knobs("(", KnobsOf::Preset).is_empty());
    }

    #[test]
    fn every_knob_of_the_shipped_species_can_be_turned_to_both_ends() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/presets/species");
        let mut tried = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "ron") {
                continue;
            }
            let text = std::fs::read_to_string(path).unwrap();
            for knob in knobs(&text, KnobsOf::Species) {
                let Turns::Number { low, high, whole, .. } = knob.turns else { continue };
                for end in [low, high] {
                    let value = if whole { format!("{end:.0}") } else { format!("{end:?}") };
                    let made = edited(&text, &[Edit::Set { path: knob.path.clone(), value }]).unwrap();
                    let out_of_range = crate::preset::species("s.ron", &made).err().is_some_and(|all| {
                        all.iter().any(|d| d.field == knob.path && d.message.contains("out of range"))
                    });
                    assert!(!out_of_range, "{} {end}", knob.path);
                    tried += 1;
                }
            }
        }
        assert!(tried > 500, "{tried}");
    }
}
