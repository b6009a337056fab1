//! What a preset may say, as data: every field with its kind, unit, range, default and a sentence about it.
//!
//! These tables are the one place where ranges and defaults stand. The reader checks by them, an absent field is read
//! from its default's text, error messages name the range and the unit from here, and [`describe`] prints them for
//! people; so they cannot disagree.

use std::fmt::Write as _;

/// A group of named fields: `(a: 1, b: 2)`.
pub(super) struct Record {
    /// Heading in the description.
    pub(super) title: &'static str,
    /// A sentence or two.
    pub(super) about: &'static str,
    /// The fields, in the order of the description.
    pub(super) fields: &'static [Field],
}

/// A field.
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    pub(super) default: Default,
    pub(super) about: &'static str,
}

/// What a field holds.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    /// A number in a range, both ends included; the unit may be empty.
    Number { low: f32, high: f32, unit: &'static str },
    /// A whole number in a range, both ends included.
    Integer { low: u64, high: u64, unit: &'static str },
    /// `"#rrggbb"`.
    Color,
    /// A quoted text; what it names.
    Text(&'static str),
    /// Fields of its own.
    Fields(&'static Record),
    /// One of several kinds.
    Choice(&'static Choice),
    /// One of some quoted texts, or one of several kinds.
    WordOrChoice(&'static [&'static str], &'static Choice),
    /// A list of kinds, `low` to `high` of them.
    ListOf { choice: &'static Choice, low: usize, high: usize },
    /// A list of `low` to `high` groups of fields.
    Rows { record: &'static Record, low: usize, high: usize },
    /// A list of `low` to `high` texts.
    Texts { what: &'static str, low: usize, high: usize },
    /// A list of at most `most` whole numbers of a range, both ends included.
    Numbers { what: &'static str, low: u64, high: u64, most: usize },
    /// A map from names to kinds, `low` to `high` of them.
    Named { choice: &'static Choice, low: usize, high: usize },
    /// A map from names to numbers of a range, both ends included, `least` to `most` of them.
    Shares { what: &'static str, low: f32, high: f32, least: usize, most: usize },
}

/// What holds when a field is absent.
#[derive(Clone, Copy)]
pub(super) enum Default {
    /// It must be there.
    Required,
    /// This text in its place.
    Is(&'static str),
    /// Something else decides, as this says.
    Else(&'static str),
}

/// A choice between kinds.
pub(super) struct Choice {
    pub(super) title: &'static str,
    pub(super) kinds: &'static [KindOf],
}

/// One kind of a choice.
#[derive(Clone, Copy)]
pub(super) struct KindOf {
    pub(super) name: &'static str,
    pub(super) form: Form,
    pub(super) about: &'static str,
}

/// How a kind is written.
#[derive(Clone, Copy)]
pub(super) enum Form {
    /// `Full`.
    Plain,
    /// `Source("oak")`, or with the field's name.
    One(&'static Record),
    /// `Blend(of: …)`.
    Fields(&'static Record),
}

impl Record {
    /// The field of a name.
    pub(super) fn field(&self, name: &str) -> Option<&'static Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// All names.
    pub(super) fn names(&self) -> impl Iterator<Item = &'static str> + Clone + use<> {
        self.fields.iter().map(|field| field.name)
    }
}

impl Choice {
    /// All names.
    pub(super) fn names(&self) -> impl Iterator<Item = &'static str> + Clone + use<> {
        self.kinds.iter().map(|kind| kind.name)
    }
}

/// A record that holds no field.
pub(super) static NOTHING: Record = Record { title: "", about: "", fields: &[] };

/// The schema of presets and species for people, as Markdown:
///
#[doc = include_str!("schema.md")]
#[must_use]
pub fn describe() -> String {
    let mut out = String::new();
    for (start, record) in [("A preset", &super::set::SET), ("A species", &super::species::SPECIES)] {
        let _ = writeln!(out, "# {start}\n");
        let mut told: Vec<usize> = Vec::new();
        describe_record(record, &mut told, &mut out);
    }
    out.push_str(&super::look::describe_leaves());
    out
}

fn describe_record(record: &'static Record, told: &mut Vec<usize>, out: &mut String) {
    // By its place: two may have one title.
    let table = std::ptr::from_ref(record).addr();
    if told.contains(&table) {
        return;
    }
    told.push(table);
    let _ = writeln!(out, "## {}\n\n{}\n", record.title, record.about);
    if record.fields.is_empty() {
        return;
    }
    let _ = writeln!(out, "| field | holds | default | |\n|---|---|---|---|");
    for field in record.fields {
        let default = match field.default {
            Default::Required => "must be given".to_string(),
            Default::Is(text) => format!("`{text}`"),
            Default::Else(text) => text.to_string(),
        };
        let _ = writeln!(out, "| `{}` | {} | {default} | {} |", field.name, field.kind.told(), field.about);
    }
    out.push('\n');
    for field in record.fields {
        match field.kind {
            Kind::Fields(record) | Kind::Rows { record, .. } => describe_record(record, told, out),
            Kind::Choice(choice)
            | Kind::WordOrChoice(_, choice)
            | Kind::ListOf { choice, .. }
            | Kind::Named { choice, .. } => describe_choice(choice, told, out),
            _ => {}
        }
    }
}

fn describe_choice(choice: &'static Choice, told: &mut Vec<usize>, out: &mut String) {
    // By its place: two may have one title.
    let table = std::ptr::from_ref(choice).addr();
    if told.contains(&table) {
        return;
    }
    told.push(table);
    let _ = writeln!(out, "## {}\n", choice.title);
    for kind in choice.kinds {
        let form = match kind.form {
            Form::Plain => kind.name.to_string(),
            Form::One(record) => format!("{}({})", kind.name, record.fields[0].name),
            Form::Fields(record) => {
                let fields: Vec<&str> = record.names().collect();
                format!("{}({})", kind.name, fields.join(", "))
            }
        };
        let _ = writeln!(out, "- `{form}`: {}", kind.about);
    }
    out.push('\n');
    for kind in choice.kinds {
        if let Form::One(record) | Form::Fields(record) = kind.form {
            describe_record(record, told, out);
        }
    }
}

impl Kind {
    /// What it holds, for messages and the description.
    pub(super) fn told(self) -> String {
        let with_unit = |range: String, unit: &str| if unit.is_empty() { range } else { format!("{range} {unit}") };
        match self {
            Self::Number { low, high, unit } => with_unit(format!("a number, {low} to {high}"), unit),
            Self::Integer { low, high, unit } if high == u64::MAX => {
                with_unit(format!("a whole number, {low} or more"), unit)
            }
            Self::Integer { low, high, unit } => with_unit(format!("a whole number, {low} to {high}"), unit),
            Self::Color => "a colour in quotes, as \"#4a6b2c\"".to_string(),
            Self::Text(what) => format!("{what} in quotes"),
            Self::Fields(_) => "fields in ( )".to_string(),
            Self::Choice(choice) => one_of(choice.names()),
            Self::WordOrChoice(words, choice) => {
                let words = words.iter().map(|word| format!("\"{word}\""));
                one_of(words.chain(choice.names().map(String::from)))
            }
            Self::ListOf { choice, low, high } => {
                format!("a list of {low} to {high}, each {}", one_of(choice.names()))
            }
            Self::Rows { low, high, .. } => format!("a list of {low} to {high} groups of fields"),
            Self::Texts { what, low, high } if low == high => format!("a list of {low} {what}"),
            Self::Texts { what, low, high } => format!("a list of {low} to {high} {what}"),
            Self::Numbers { what, low, high, most } => format!("a list of up to {most} {what}, each {low} to {high}"),
            Self::Named { choice, low, high } => {
                format!("a map of {low} to {high} names, each to {}", one_of(choice.names()))
            }
            Self::Shares { what, low, high, least, most } => {
                format!("a map of {least} to {most} {what}, each to a number, {low} to {high}")
            }
        }
    }
}

/// `a`, `a or b`, `a, b or c`.
fn one_of<T: ToString>(names: impl IntoIterator<Item = T>) -> String {
    let mut names: Vec<String> = names.into_iter().map(|name| name.to_string()).collect();
    let last = names.pop().unwrap_or_default();
    if names.is_empty() { last } else { format!("{} or {last}", names.join(", ")) }
}
