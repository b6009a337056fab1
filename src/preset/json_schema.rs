//! The same tables as JSON Schema (draft 2020-12), for editors and generators of presets.
//!
//! Presets are RON; the schema is of their JSON form, in which RON's own libraries and other generators write them: fields
//! in ( ) and maps are objects, lists arrays, `Full` is `"Full"`, `Source("oak")` is `{"Source": "oak"}` and `Blend(of: …)`
//! is `{"Blend": {"of": …}}`. What a schema can't say (a name that no source has, an atlas that is too small) is left to
//! `treewright check`. A default that is no JSON stands in the description.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::schema::{Choice, Default, Field, Form, Kind, Record};

/// Definitions by their titles, with the table that each is of: two may have one title.
type Defs = BTreeMap<String, (usize, Value)>;

/// The schema of presets and species as JSON, either of the two at its root; `src/preset/schema.json` holds it.
#[must_use]
pub fn describe_json() -> String {
    let mut defs = Defs::new();
    let roots = [&super::set::SET, &super::species::SPECIES].map(|record| of_record(record, &mut defs));
    let defs: Map<String, Value> = defs.into_iter().map(|(name, (_, made))| (name, made)).collect();
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A preset or a species of Treewright",
        "$comment": "Of the JSON form of RON: fields and maps are objects, Full is \"Full\", Source(\"a\") is {\"Source\": \"a\"}.",
        "anyOf": roots,
        "$defs": defs,
    });
    let mut text = serde_json::to_string_pretty(&schema).expect("plain values serialize");
    text.push('\n');
    text
}

/// A reference to the definition of a table, which is made when it is first asked for.
fn named(title: &str, table: usize, defs: &mut Defs, make: impl FnOnce(&mut Defs) -> Value) -> Value {
    let plain = title.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "_");
    let mut name = plain.clone();
    let mut number = 1;
    while defs.get(&name).is_some_and(|(other, _)| *other != table) {
        number += 1;
        name = format!("{plain}_{number}");
    }
    if !defs.contains_key(&name) {
        // Known while it is made: definitions may name themselves.
        defs.insert(name.clone(), (table, Value::Null));
        let made = make(defs);
        defs.insert(name.clone(), (table, made));
    }
    json!({ "$ref": format!("#/$defs/{name}") })
}

fn of_record(record: &'static Record, defs: &mut Defs) -> Value {
    named(record.title, std::ptr::from_ref(record).addr(), defs, |defs| {
        let properties: Map<String, Value> =
            record.fields.iter().map(|field| (field.name.to_owned(), of_field(field, defs))).collect();
        let must = |field: &&Field| matches!(field.default, Default::Required);
        let required: Vec<&str> = record.fields.iter().filter(must).map(|field| field.name).collect();
        json!({
            "title": record.title,
            "description": record.about,
            "type": "object",
            "properties": properties,
            "required": required,
            "additionalProperties": false,
        })
    })
}

fn of_field(field: &'static Field, defs: &mut Defs) -> Value {
    let mut value = of_kind(field.kind, defs);
    let mut about = field.about.to_owned();
    if let Kind::Number { unit, .. } | Kind::Integer { unit, .. } = field.kind
        && !unit.is_empty()
    {
        about = if about.is_empty() { unit.to_owned() } else { format!("{about}; {unit}") };
    }
    match field.default {
        Default::Required => {}
        Default::Is(text) => match serde_json::from_str::<Value>(text) {
            Ok(default) => value["default"] = default,
            Err(_) => about += &format!(" (default: {text})"),
        },
        Default::Else(text) => about += &format!(" (default: {text})"),
    }
    value["description"] = json!(about.trim());
    value
}

/// A bound as it is written in the tables.
fn bound(value: f32) -> Value {
    let exact: f64 = value.to_string().parse().unwrap_or_else(|_| f64::from(value));
    json!(exact)
}

fn of_kind(kind: Kind, defs: &mut Defs) -> Value {
    match kind {
        Kind::Number { low, high, .. } => json!({ "type": "number", "minimum": bound(low), "maximum": bound(high) }),
        Kind::Integer { low, high: u64::MAX, .. } => json!({ "type": "integer", "minimum": low }),
        Kind::Integer { low, high, .. } => json!({ "type": "integer", "minimum": low, "maximum": high }),
        Kind::Color => json!({ "type": "string", "pattern": "^#[0-9a-fA-F]{6}$" }),
        Kind::Text(_) => json!({ "type": "string" }),
        Kind::Fields(record) => of_record(record, defs),
        Kind::Choice(choice) => of_choice(choice, defs),
        Kind::WordOrChoice(words, choice) => json!({ "anyOf": [{ "enum": words }, of_choice(choice, defs)] }),
        Kind::ListOf { choice, low, high } => {
            json!({ "type": "array", "items": of_choice(choice, defs), "minItems": low, "maxItems": high })
        }
        Kind::Rows { record, low, high } => {
            json!({ "type": "array", "items": of_record(record, defs), "minItems": low, "maxItems": high })
        }
        Kind::Texts { low, high, .. } => {
            json!({ "type": "array", "items": { "type": "string" }, "minItems": low, "maxItems": high })
        }
        Kind::Numbers { low, high, most, .. } => {
            let of = json!({ "type": "integer", "minimum": low, "maximum": high });
            json!({ "type": "array", "items": of, "maxItems": most })
        }
        Kind::Named { choice, low, high } => {
            let of = of_choice(choice, defs);
            json!({ "type": "object", "additionalProperties": of, "minProperties": low, "maxProperties": high })
        }
        Kind::Shares { low, high, least, most, .. } => {
            let of = json!({ "type": "number", "minimum": bound(low), "maximum": bound(high) });
            json!({ "type": "object", "additionalProperties": of, "minProperties": least, "maxProperties": most })
        }
    }
}

fn of_choice(choice: &'static Choice, defs: &mut Defs) -> Value {
    named(choice.title, std::ptr::from_ref(choice).addr(), defs, |defs| {
        let kinds = choice.kinds.iter().map(|kind| {
            let holds = match kind.form {
                Form::Plain => return json!({ "const": kind.name, "description": kind.about }),
                Form::One(record) => {
                    let whole = of_record(record, defs);
                    match record.fields {
                        [field, ..] => json!({ "anyOf": [of_field(field, defs), whole] }),
                        [] => whole,
                    }
                }
                Form::Fields(record) => of_record(record, defs),
            };
            json!({
                "description": kind.about,
                "type": "object",
                "properties": { kind.name: holds },
                "required": [kind.name],
                "additionalProperties": false,
            })
        });
        let kinds: Vec<Value> = kinds.collect();
        json!({ "title": choice.title, "oneOf": kinds })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every reference below a value.
    fn references<'a>(value: &'a Value, into: &mut Vec<&'a str>) {
        match value {
            Value::Object(fields) => {
                into.extend(fields.get("$ref").and_then(Value::as_str));
                fields.values().for_each(|value| references(value, into));
            }
            Value::Array(values) => values.iter().for_each(|value| references(value, into)),
            _ => {}
        }
    }

    #[test]
    fn every_reference_is_defined_and_ranges_are_those_of_the_tables() {
        let schema: Value = serde_json::from_str(&describe_json()).unwrap();
        let mut all = Vec::new();
        references(&schema, &mut all);
        assert!(all.len() > 40, "{}", all.len());
        for reference in all {
            let found = schema.pointer(reference.strip_prefix('#').unwrap());
            assert!(found.is_some_and(Value::is_object), "{reference}");
        }
        let of = |path: &str| schema.pointer(path).unwrap_or_else(|| panic!("{path}"));
        let preset = "/$defs/preset_of_a_set";
        assert_eq!(*of(&format!("{preset}/required")), json!(["sources", "variants"]));
        assert_eq!(*of(&format!("{preset}/properties/seed/default")), json!(1));
        assert_eq!(*of(&format!("{preset}/properties/variants/maxItems")), json!(4096));
        let density = "/$defs/foliage/properties/density";
        assert_eq!(of(density)["type"], "number");
        assert!(of(density)["minimum"].as_f64() < of(density)["maximum"].as_f64());
    }
}
