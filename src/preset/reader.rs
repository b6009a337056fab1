//! Reads checked values out of a tree, by the tables of the schema.
//!
//! Every getter gives a usable value, whatever the text says: what is wrong goes to the report, and the default (or the
//! low end of the range) stands in, so that reading goes on and finds the next error. A plan made of stand-ins is
//! never handed out: the caller asks the report.

use std::borrow::Cow;

use super::nearest::nearest;
use super::report::Report;
use super::schema::{Choice, Default, Field, Form, Kind, NOTHING, Record};
use super::syntax::{Name, Node, Value, tree};
use crate::base::{Span, counted};

/// A group of fields that is being read.
pub(super) struct Reader<'t, 'r> {
    report: &'r Report<'r>,
    record: &'static Record,
    /// Path of the group, as `variants[2]`; empty at the top.
    path: String,
    /// Place of the group; none for one that is absent and read from defaults.
    span: Option<Span>,
    fields: &'t [(Name, Node)],
}

/// Which of a field's words, or a kind.
pub(super) enum Pick {
    /// The word's index.
    Word(usize),
    /// A kind.
    Kind,
}

/// A value at hand: where it stands, what it is called.
pub(super) struct Item<'t> {
    /// The value, or its default.
    pub(super) node: Cow<'t, Node>,
    /// Path of the field.
    pub(super) path: String,
    /// Whether the text holds it; a default has no place in it.
    pub(super) given: bool,
}

impl Item<'_> {
    /// The place in the text, if it is there.
    pub(super) fn span(&self) -> Option<Span> {
        self.given.then_some(self.node.span)
    }
}

/// A number that the preset tells, with its noun.
pub(super) fn many(n: u64, one: &str, many: &str) -> String {
    counted(usize::try_from(n).unwrap_or(usize::MAX), one, many)
}

impl<'t, 'r> Reader<'t, 'r> {
    /// Reads the fields of `node`, and reports those that the record doesn't know and those that stand twice.
    pub(super) fn new(report: &'r Report<'r>, record: &'static Record, item: &'t Item<'_>) -> Self {
        let fields: &[_] = match &item.node.value {
            Value::Record(None, fields) => fields,
            Value::Record(Some(name), fields) => {
                let message = format!("expected fields in ( ), found the kind `{}`", clip(&name.text));
                report.at(item.span(), &item.path, message, "leave the name before the bracket out");
                fields
            }
            other => {
                let message = format!("expected fields in ( ), found {}", other.is_called());
                report.at(item.span(), &item.path, message, names_hint(record));
                // Nothing of it can be read; its required fields would only be missed on top.
                return Self { report, record, path: item.path.clone(), span: None, fields: &[] };
            }
        };
        Self::of_fields(report, record, item.path.clone(), item.span(), fields)
    }

    /// Reads fields that stand behind a kind's name.
    pub(super) fn of_fields(
        report: &'r Report<'r>,
        record: &'static Record,
        path: String,
        span: Option<Span>,
        fields: &'t [(Name, Node)],
    ) -> Self {
        let reader = Self { report, record, path, span, fields };
        for (i, (name, _)) in fields.iter().enumerate() {
            if report.is_full() {
                break;
            }
            let path = reader.path_of(&clip(&name.text));
            if record.field(&name.text).is_none() {
                let hint = match nearest(&name.text, record.names()) {
                    Some(meant) => format!("did you mean `{meant}`? {}", names_hint(record)),
                    None => names_hint(record),
                };
                report.at(name.span, &path, "unknown field", hint);
            } else if let Some((first, _)) =
                fields[..i.min(record.fields.len() * 4)].iter().find(|f| f.0.text == name.text)
            {
                let message = format!("given twice; first on line {}", first.span.line);
                report.at(name.span, &path, message, "leave one of the two out");
            }
        }
        reader
    }

    pub(super) fn report(&self) -> &'r Report<'r> {
        self.report
    }

    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// Place of the group.
    pub(super) fn span(&self) -> Option<Span> {
        self.span
    }

    fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_string() } else { format!("{}.{name}", self.path) }
    }

    fn schema(&self, name: &str) -> &'static Field {
        self.record.field(name).expect("resolvers ask for fields of their own record")
    }

    /// Whether the text gives the field.
    pub(super) fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|(key, _)| key.text == name)
    }

    /// Reports an error about a field of this group.
    pub(super) fn fault(&self, name: &str, message: impl Into<String>, hint: impl Into<String>) {
        let span = self.fields.iter().find(|(key, _)| key.text == name).map(|(_, node)| node.span).or(self.span);
        self.report.at(span, &self.path_of(name), message, hint);
    }

    /// Reports those of `names` that the text gives, but not the field `switch`, which is off by default: without it they
    /// do nothing. Who tells the switch, and be it as off, knows.
    pub(super) fn needs(&self, switch: &str, names: &[&str], hint: &str) {
        for name in names.iter().filter(|name| self.has(name) && !self.has(switch)) {
            self.fault(name, format!("has no meaning without `{switch}`"), hint);
        }
    }

    /// The field's value or its default; none when it is required and missing (reported), or when something else
    /// decides.
    pub(super) fn item(&self, name: &str) -> Option<Item<'t>> {
        let path = self.path_of(name);
        if let Some((_, node)) = self.fields.iter().find(|(key, _)| key.text == name) {
            let given = |node| Some(Item { node: Cow::Borrowed(node), path: path.clone(), given: true });
            return match &node.value {
                // What people who know RON's Option write.
                Value::Tuple(Some(some), items) if some.text == "Some" && items.len() == 1 => {
                    self.report.at(some.span, &path, "`Some` has no meaning here", "write the value alone");
                    given(&items[0])
                }
                _ => given(node),
            };
        }
        match self.schema(name).default {
            Default::Is(text) => {
                let node = tree(text, self.report)?;
                Some(Item { node: Cow::Owned(node), path, given: false })
            }
            Default::Else(_) => None,
            Default::Required => {
                self.missing(name, "");
                None
            }
        }
    }

    /// Reports that a field must be given, and when it need not.
    pub(super) fn missing(&self, name: &str, unless: &str) {
        // An unreadable group is reported once, not for every field; so is a field with a slip in its name.
        let slip = |(key, _): &(Name, Node)| {
            self.record.field(&key.text).is_none() && nearest(&key.text, self.record.names()) == Some(name)
        };
        if self.span.is_some() && !self.report.is_full() && !self.fields.iter().any(slip) {
            let hint = format!("give {}{unless}", self.schema(name).kind.told());
            self.report.at(self.span, &self.path_of(name), "missing", hint);
        }
    }

    /// A number in its range.
    pub(super) fn number(&self, name: &str) -> f32 {
        let Kind::Number { low, .. } = self.schema(name).kind else { return 0.0 };
        self.number_or(name, low)
    }

    /// A number in its range; `other` where the field is absent and has no default of its own.
    pub(super) fn number_or(&self, name: &str, other: f32) -> f32 {
        let kind = self.schema(name).kind;
        let Kind::Number { low, high, unit } = kind else { return other };
        let Some(item) = self.item(name) else { return other };
        let value = match item.node.value {
            Value::Integer(value) => value as f64,
            Value::Float(value) => value,
            _ => {
                self.mistyped(&item, kind);
                return other;
            }
        };
        // Compared in single precision, so that the ends of the range as written are inside; NaN is never written.
        let single = value as f32;
        if (low..=high).contains(&single) {
            // -0.0 would be another hash for the same preset.
            single + 0.0
        } else {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let shown = match value {
                _ if value.is_nan() => "`NaN`".to_string(),
                _ if value.is_infinite() => "infinity".to_string(),
                _ if value.abs() > 1e9 => format!("{value:e}"),
                _ => value.to_string(),
            };
            let message = format!("{shown} is out of range: {low} to {high}{unit}");
            self.report.at(item.span(), &item.path, message, "");
            // The near end, so that what hangs on it is not wrong, too.
            if value.is_nan() { other } else { single.clamp(low, high) }
        }
    }

    /// A whole number in its range.
    pub(super) fn integer(&self, name: &str) -> u64 {
        let Kind::Integer { low, .. } = self.schema(name).kind else { return 0 };
        self.integer_or(name, low)
    }

    /// A whole number in its range; `other` where the field is absent and has no default of its own.
    pub(super) fn integer_or(&self, name: &str, other: u64) -> u64 {
        let kind = self.schema(name).kind;
        let Kind::Integer { low, high, unit } = kind else { return other };
        let Some(item) = self.item(name) else { return other };
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        match item.node.value {
            Value::Integer(value) => match u64::try_from(value) {
                Ok(value) if (low..=high).contains(&value) => return value,
                _ if high == u64::MAX && value < low.into() => {
                    self.report.at(
                        item.span(),
                        &item.path,
                        format!("{value} is out of range: {low} or more{unit}"),
                        "",
                    );
                }
                _ => {
                    let message = format!("{value} is out of range: {low} to {high}{unit}");
                    self.report.at(item.span(), &item.path, message, "");
                }
            },
            _ => self.mistyped(&item, kind),
        }
        other
    }

    /// As [`integer`](Self::integer), for ranges within 32 bits.
    pub(super) fn count(&self, name: &str) -> u32 {
        u32::try_from(self.integer(name)).unwrap_or(u32::MAX)
    }

    /// A quoted text.
    pub(super) fn text(&self, name: &str) -> Option<(String, Item<'t>)> {
        let item = self.item(name)?;
        match &item.node.value {
            Value::Text(text) => Some((text.clone(), item)),
            _ => {
                self.mistyped(&item, self.schema(name).kind);
                None
            }
        }
    }

    /// A colour as linear light, 0..=1; none where the field is absent or wrong.
    pub(super) fn color(&self, name: &str) -> Option<[f32; 3]> {
        let (text, item) = self.text(name)?;
        let color = linear(&text);
        if color.is_none() {
            let message = format!("\"{}\" is no colour", clip(&text));
            self.report.at(item.span(), &item.path, message, "six hexadecimal digits behind #, as \"#4a6b2c\"");
        }
        color
    }

    /// Which of the words or kinds of a field is given; none where it is neither (reported).
    pub(super) fn pick(&self, name: &str, item: &Item<'_>) -> Option<Pick> {
        let kind = self.schema(name).kind;
        let Kind::WordOrChoice(words, choice) = kind else { return None };
        match &item.node.value {
            Value::Text(text) => {
                let found = words.iter().position(|word| word == text);
                if found.is_none() {
                    let all: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
                    let meant = nearest(text, words.iter().copied()).map(|word| format!("\"{word}\""));
                    let message = format!("there is no \"{}\"", clip(text));
                    self.report.at(item.span(), &item.path, message, there_are(meant, &all));
                }
                found.map(Pick::Word)
            }
            Value::Name(word) if choice.kinds.iter().all(|kind| kind.name != word) => {
                let message = format!("expected a text in quotes, found the name `{}`", clip(word));
                let hint = match words.contains(&word.as_str()) {
                    true => format!("write \"{word}\""),
                    false => format!("give {}", kind.told()),
                };
                self.report.at(item.span(), &item.path, message, hint);
                None
            }
            Value::Name(_) | Value::Record(Some(_), _) | Value::Tuple(Some(_), _) => Some(Pick::Kind),
            _ => {
                self.mistyped(item, kind);
                None
            }
        }
    }

    /// The one of `names` that `item` gives; reported where it is none of them.
    pub(super) fn reference(&self, item: &Item<'_>, what: &str, names: &[&str]) -> Option<usize> {
        let (typed, found) = match &item.node.value {
            Value::Text(text) => (text, names.iter().position(|name| name == text)),
            other => {
                let hint = match other {
                    Value::Name(name) if names.contains(&name.as_str()) => format!("write \"{}\"", clip(name)),
                    _ => String::new(),
                };
                let message = format!("expected a {what}'s name in quotes, found {}", other.is_called());
                self.report.at(item.span(), &item.path, message, hint);
                return None;
            }
        };
        if found.is_none() {
            self.no_such(item.span(), &item.path, what, typed, names);
        }
        found
    }

    /// Reports a name that is none of `names`.
    pub(super) fn no_such(&self, span: impl Into<Option<Span>>, path: &str, what: &str, typed: &str, names: &[&str]) {
        // Where there is no name at all, what should give some is wrong, and that has been said.
        if self.report.is_full() || names.is_empty() {
            return;
        }
        let quote = |name: &&str| format!("\"{}\"", clip(name));
        let all: Vec<String> = names.iter().take(16).map(quote).collect();
        let meant = nearest(typed, names.iter().copied()).map(|name| quote(&name));
        let message = format!("there is no {what} \"{}\"", clip(typed));
        self.report.at(span, path, message, there_are(meant, &all));
    }

    /// A kind and a reader of its fields, handed to `read`; none where it is absent or wrong.
    pub(super) fn choice<T>(
        &self,
        name: &str,
        read: impl FnOnce(&'static str, &Reader<'_, 'r>) -> Option<T>,
    ) -> Option<T> {
        let kind = self.schema(name).kind;
        let (Kind::Choice(choice) | Kind::WordOrChoice(_, choice)) = kind else { return None };
        let item = self.item(name)?;
        self.kind(choice, &item, read)
    }

    /// As [`choice`](Self::choice), for a value at hand.
    pub(super) fn kind<T>(
        &self,
        choice: &'static Choice,
        item: &Item<'_>,
        read: impl FnOnce(&'static str, &Reader<'_, 'r>) -> Option<T>,
    ) -> Option<T> {
        let node = &*item.node;
        let (name, span) = match &node.value {
            Value::Name(name) => (name, node.span),
            Value::Record(Some(name), _) | Value::Tuple(Some(name), _) => (&name.text, name.span),
            other => {
                let message = format!("expected {}, found {}", Kind::Choice(choice).told(), other.is_called());
                let meant = |text: &String| {
                    let same = choice.names().find(|name| name.eq_ignore_ascii_case(text));
                    same.or_else(|| nearest(text, choice.names()))
                };
                let hint = match other {
                    Value::Text(text) => {
                        meant(text).map_or_else(String::new, |name| format!("write {name}, without quotes"))
                    }
                    _ => String::new(),
                };
                self.report.at(item.span(), &item.path, message, hint);
                return None;
            }
        };
        let Some(kind) = choice.kinds.iter().find(|kind| kind.name == name) else {
            let all: Vec<String> = choice.names().map(String::from).collect();
            let hint = there_are(nearest(name, choice.names()).map(|meant| format!("`{meant}`")), &all);
            self.report.at(item.given.then_some(span), &item.path, format!("there is no kind `{}`", clip(name)), hint);
            return None;
        };
        let record = match kind.form {
            Form::Plain => &NOTHING,
            Form::One(record) | Form::Fields(record) => record,
        };
        let mut one = Vec::new();
        let fields: &[(Name, Node)] = match &node.value {
            Value::Record(_, fields) => fields,
            Value::Tuple(_, items) => {
                if let (Form::One(record), [only]) = (kind.form, &items[..]) {
                    one.push((Name { span: only.span, text: record.fields[0].name.to_string() }, only.clone()));
                } else {
                    let message = format!("`{name}` takes named fields, found values without names");
                    self.report.at(item.span(), &item.path, message, names_hint(record));
                    return None;
                }
                &one
            }
            _ => &[],
        };
        let reader = Reader::of_fields(self.report, record, item.path.clone(), item.span(), fields);
        read(kind.name, &reader)
    }

    /// A group of fields, handed to `read`; an absent one is read from the defaults of its fields.
    pub(super) fn group<T>(&self, name: &str, read: impl FnOnce(&Reader<'_, 'r>) -> T) -> Option<T> {
        let Kind::Fields(record) = self.schema(name).kind else { return None };
        let item = self.item(name)?;
        Some(read(&Reader::new(self.report, record, &item)))
    }

    /// The items of a list, between `low` and `high` of them; none where it is absent or no list.
    pub(super) fn list(&self, name: &str) -> Vec<Item<'t>> {
        let kind = self.schema(name).kind;
        let (low, high) = match kind {
            Kind::ListOf { low, high, .. } | Kind::Rows { low, high, .. } | Kind::Texts { low, high, .. } => {
                (low, high)
            }
            Kind::Numbers { most, .. } => (0, most),
            _ => return Vec::new(),
        };
        let Some(item) = self.item(name) else { return Vec::new() };
        let Item { node, path, given } = item;
        let called = node.value.is_called();
        let span = given.then_some(node.span);
        let items: Vec<Cow<'t, Node>> = match node {
            Cow::Borrowed(Node { value: Value::List(items), .. }) => {
                items.iter().map(Cow::Borrowed).collect::<Vec<_>>()
            }
            Cow::Owned(Node { value: Value::List(items), .. }) => items.into_iter().map(Cow::Owned).collect(),
            _ => {
                let hint = format!("give {}", kind.told());
                self.report.at(span, &path, format!("expected a list in [ ], found {called}"), hint);
                return Vec::new();
            }
        };
        if !(low..=high).contains(&items.len()) {
            self.report.at(span, &path, entries(items.len(), kind), "");
        }
        items
            .into_iter()
            .take(high)
            .enumerate()
            .map(|(i, node)| Item { node, path: format!("{path}[{i}]"), given })
            .collect()
    }

    /// The whole numbers of a list that are in their range.
    pub(super) fn numbers(&self, name: &str) -> Vec<u64> {
        let Kind::Numbers { low, high, .. } = self.schema(name).kind else { return Vec::new() };
        let number = |item: Item<'t>| {
            let message = match item.node.value {
                Value::Integer(value) => match u64::try_from(value) {
                    Ok(value) if (low..=high).contains(&value) => return Some(value),
                    _ => format!("{value} is out of range: {low} to {high}"),
                },
                ref other => format!("expected a whole number, {low} to {high}, found {}", other.is_called()),
            };
            self.report.at(item.span(), &item.path, message, "");
            None
        };
        self.list(name).into_iter().filter_map(number).collect()
    }

    /// The entries of a map from names, with the place of each name.
    pub(super) fn map(&self, name: &str) -> Vec<(Name, Item<'t>)> {
        let kind = self.schema(name).kind;
        let (Kind::Named { low, high, .. } | Kind::Shares { least: low, most: high, .. }) = kind else {
            return Vec::new();
        };
        let Some(item) = self.item(name) else { return Vec::new() };
        if !item.given {
            return Vec::new();
        }
        let Cow::Borrowed(Node { value: Value::Map(given), .. }) = item.node else {
            let message = format!("expected a map in {{ }}, found {}", item.node.value.is_called());
            self.report.at(item.span(), &item.path, message, "write {\"name\": …}");
            return Vec::new();
        };
        if !(low..=high).contains(&given.len()) {
            self.report.at(item.span(), &item.path, entries(given.len(), kind), "");
        }
        let mut found = Vec::new();
        for (key, node) in given.iter().take(high) {
            let Value::Text(text) = &key.value else {
                let message = format!("expected a name in quotes, found {}", key.value.is_called());
                self.report.at(key.span, &item.path, message, "write {\"name\": …}");
                continue;
            };
            let path = format!("{}[\"{}\"]", item.path, clip(text));
            let name = Name { span: key.span, text: text.clone() };
            found.push((name, Item { node: Cow::Borrowed(node), path, given: true }));
        }
        found
    }

    /// The numbers of a map from names, in the order of the text, with the place of each name.
    pub(super) fn shares(&self, name: &str) -> Vec<(Name, Item<'t>, f32)> {
        let kind = self.schema(name).kind;
        let Kind::Shares { low, high, .. } = kind else { return Vec::new() };
        let number = |(name, item): (Name, Item<'t>)| {
            let value = match item.node.value {
                Value::Integer(value) => value as f64,
                Value::Float(value) => value,
                _ => {
                    let message = format!("expected a number, {low} to {high}, found {}", item.node.value.is_called());
                    self.report.at(item.span(), &item.path, message, "");
                    return None;
                }
            };
            if !(low..=high).contains(&(value as f32)) {
                let shown = if value.is_finite() { value.to_string() } else { "it".to_string() };
                self.report.at(item.span(), &item.path, format!("{shown} is out of range: {low} to {high}"), "");
                return None;
            }
            // -0.0 would be another hash for the same preset.
            Some((name, item, value as f32 + 0.0))
        };
        self.map(name).into_iter().filter_map(number).collect()
    }

    fn mistyped(&self, item: &Item<'_>, kind: Kind) {
        let found = match &item.node.value {
            Value::Name(name) => format!("the name `{}`", clip(name)),
            other => other.is_called().to_string(),
        };
        let hint = match (&item.node.value, kind) {
            // What people who know RON's Option write.
            (Value::Name(name), _) if name == "None" => "leave the field out",
            (Value::Text(_), Kind::Number { .. } | Kind::Integer { .. }) => {
                "write the number alone, without quotes or unit"
            }
            (Value::Float(_), Kind::Integer { .. }) => "write it without a point",
            _ => "",
        };
        self.report.at(item.span(), &item.path, format!("expected {}, found {found}", kind.told()), hint);
    }
}

/// A user's word for a message: of bounded length, on one line.
pub(super) fn clip(text: &str) -> String {
    let mut shown: String = text.chars().take(40).flat_map(char::escape_debug).collect();
    if text.chars().nth(40).is_some() {
        shown.push('…');
    }
    shown
}

/// A wrong number of entries.
fn entries(count: usize, kind: Kind) -> String {
    let entries = if count == 1 { "entry" } else { "entries" };
    format!("{count} {entries}; expected {}", kind.told())
}

/// What there is, behind the name that was probably meant.
fn there_are(meant: Option<String>, all: &[String]) -> String {
    let (start, there) = match meant {
        Some(meant) => (format!("did you mean {meant}? "), "There"),
        None => (String::new(), "there"),
    };
    match all {
        [] => start,
        [only] => format!("{start}{there} is only {only}"),
        _ => format!("{start}{there} are {}", all.join(", ")),
    }
}

fn names_hint(record: &Record) -> String {
    if record.fields.is_empty() {
        "it takes no fields".to_string()
    } else {
        format!("its fields are {}", record.names().collect::<Vec<_>>().join(", "))
    }
}

/// `#rrggbb` in sRGB as linear light (IEC 61966-2-1).
pub(super) fn linear(text: &str) -> Option<[f32; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let channel = |i: usize| {
        let value = u8::from_str_radix(&digits[i..i + 2], 16).ok()?;
        Some(crate::base::math::srgb_to_linear(f32::from(value) / 255.0))
    };
    Some([channel(0)?, channel(2)?, channel(4)?])
}
