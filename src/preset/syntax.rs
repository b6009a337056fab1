//! A preset's text as a tree of values, each with its place: RON without the types.
//!
//! `serde` stops at the first error and forgets where valid values stood. This tree keeps the place of every value, so
//! that all errors are reported at once, each where it is, those about a value's meaning too (a source that does not
//! exist). After a syntax error reading goes on behind the next comma.
//!
//! Limits: 4 MB of text, 64 levels, 100,000 values. Time and memory are linear in the text.

use super::report::Report;
use super::token::{Lexer, Token};
use crate::base::Span;

/// Longest text, bytes.
pub(super) const MOST_BYTES: usize = 4 << 20;
/// Deepest nesting of brackets.
const MOST_LEVELS: usize = 64;
/// Most values in one text.
const MOST_VALUES: usize = 100_000;

/// A value and its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) span: Span,
    pub(super) value: Value,
}

/// A name and its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Name {
    pub(super) span: Span,
    pub(super) text: String,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Bool(bool),
    Integer(i128),
    Float(f64),
    Text(String),
    /// `Full`: a kind without fields.
    Name(String),
    /// `(a: 1)`, `Kind(a: 1)`, `()` or `Kind()`.
    Record(Option<Name>, Vec<(Name, Node)>),
    /// `(1, 2)` or `Kind(1, 2)`; not empty.
    Tuple(Option<Name>, Vec<Node>),
    /// `[1, 2]`.
    List(Vec<Node>),
    /// `{"a": 1}`.
    Map(Vec<(Node, Node)>),
}

impl Value {
    /// What it is, for "expected …, found …".
    pub(super) fn is_called(&self) -> &'static str {
        match self {
            Self::Bool(_) => "true or false",
            Self::Integer(_) => "a whole number",
            Self::Float(_) => "a number with a point",
            Self::Text(_) => "a text",
            Self::Name(_) => "a name",
            Self::Record(None, _) => "fields in ( )",
            Self::Tuple(None, _) => "values without names in ( )",
            Self::Record(Some(_), _) | Self::Tuple(Some(_), _) => "a kind",
            Self::List(_) => "a list",
            Self::Map(_) => "a map",
        }
    }
}

/// Reads a text; none when it has no meaning as a whole, and then the report says why. A text with errors that could
/// be stepped over gives a tree too: ask the report.
pub(super) fn tree(text: &str, report: &Report<'_>) -> Option<Node> {
    if text.len() > MOST_BYTES {
        report.whole(format!("the file is larger than {} MB", MOST_BYTES >> 20), "presets are a few kilobytes");
        return None;
    }
    let mut parser = Parser {
        lexer: Lexer::new(text),
        token: Token::End,
        span: Span::point(1, 1),
        values: 0,
        behind_number: false,
        open: Vec::new(),
        report,
    };
    parser.advance();
    while parser.token == Token::Broken {
        parser.advance();
    }
    if parser.token == Token::End {
        report.whole("the file is empty", "its fields stand between ( and )");
        return None;
    }
    let node = parser.value()?;
    match parser.token {
        Token::End => {}
        Token::Mark(':') if matches!(node.value, Value::Name(_)) => {
            parser.error(node.span, "the brackets around the file's fields are missing", "start with ( and end with )");
        }
        // More likely a bracket too many further up, and that has been said.
        _ if !report.is_clean() => {}
        _ => {
            let shown = parser.shown();
            parser.error(parser.span, format!("{shown} after the end"), "one pair of ( ) makes the file");
        }
    }
    Some(node)
}

/// What people write behind numbers; no field has such a name.
const UNITS: [&str; 16] = [
    "m", "cm", "mm", "km", "metre", "metres", "meter", "meters", "px", "pixel", "pixels", "texels", "deg", "degree",
    "degrees", "percent",
];

struct Parser<'t, 'r> {
    lexer: Lexer<'t>,
    token: Token,
    span: Span,
    values: usize,
    /// Whether a number stands before the token at hand.
    behind_number: bool,
    /// The brackets that are open, by what closes them.
    open: Vec<char>,
    report: &'r Report<'r>,
}

impl Parser<'_, '_> {
    fn error(&self, span: Span, message: impl Into<String>, hint: impl Into<String>) {
        // Behind a limit nothing is read, so nothing that seems to be missing is.
        if self.values <= MOST_VALUES {
            self.report.at(span, "", message, hint);
        }
    }

    fn advance(&mut self) -> (Token, Span) {
        let (token, span) = self.lexer.token();
        for fault in self.lexer.faults.drain(..) {
            self.report.at(fault.span, "", fault.message, fault.hint);
        }
        self.behind_number = matches!(self.token, Token::Integer(_) | Token::Float(_));
        (std::mem::replace(&mut self.token, token), std::mem::replace(&mut self.span, span))
    }

    /// The token at hand, for a message.
    fn shown(&self) -> String {
        match &self.token {
            Token::Mark(c) => format!("`{c}`"),
            Token::Name(name) => format!("`{}`", name.chars().take(40).collect::<String>()),
            Token::Integer(_) | Token::Float(_) => "a number".into(),
            Token::Text(_) => "a text".into(),
            Token::Broken => "something unreadable".into(),
            Token::End => "the file's end".into(),
        }
    }

    /// A value; none when there is none, reported, and nothing is consumed that ends something else.
    fn value(&mut self) -> Option<Node> {
        self.values += 1;
        if self.values > MOST_VALUES {
            self.give_up(format!("more than {MOST_VALUES} values in one file"));
            return None;
        }
        match self.token {
            Token::Mark('(') => self.round(None),
            Token::Mark('[') => self.list(),
            Token::Mark('{') => self.map(),
            Token::Mark(_) | Token::End => {
                let shown = self.shown();
                self.error(self.span, format!("expected a value, found {shown}"), "");
                None
            }
            _ => {
                let (token, span) = self.advance();
                let value = match token {
                    Token::Integer(value) => Value::Integer(value),
                    Token::Float(value) => Value::Float(value),
                    Token::Text(text) => Value::Text(text),
                    Token::Name(text) => match text.as_str() {
                        "true" => Value::Bool(true),
                        "false" => Value::Bool(false),
                        "None" => Value::Name(text),
                        _ if self.token == Token::Mark('(') => return self.round(Some(Name { span, text })),
                        _ => Value::Name(text),
                    },
                    _ => return None,
                };
                Some(Node { span, value })
            }
        }
    }

    /// Ends reading: what follows could only repeat the error.
    fn give_up(&mut self, message: String) {
        if self.token != Token::End {
            self.report.at(self.span, "", message, "");
            self.values = MOST_VALUES + 1;
            self.lexer = Lexer::new("");
            self.token = Token::End;
        }
    }

    /// Enters a bracket: its place, or none beyond the deepest level.
    fn open(&mut self, close: char) -> Option<Span> {
        if self.open.len() == MOST_LEVELS {
            self.give_up(format!("brackets nest deeper than {MOST_LEVELS} levels"));
            return None;
        }
        self.open.push(close);
        Some(self.advance().1)
    }

    /// `( … )`, behind the name of a kind or alone.
    fn round(&mut self, name: Option<Name>) -> Option<Node> {
        let open = self.open(')')?;
        let mut fields = Vec::new();
        let mut items = Vec::new();
        let ended = self.entries(open, ')', |parser| {
            let node = parser.value()?;
            if parser.token != Token::Mark(':') {
                items.push(node);
                return Some(());
            }
            parser.advance();
            let name = match node.value {
                Value::Name(text) => Some(Name { span: node.span, text }),
                // A field may have any name, these two also.
                Value::Bool(value) => Some(Name { span: node.span, text: value.to_string() }),
                Value::Text(_) => {
                    parser.error(node.span, "a field's name stands without quotes", "quoted names belong into { }");
                    None
                }
                other => {
                    parser.error(node.span, format!("expected a field's name, found {}", other.is_called()), "");
                    None
                }
            };
            let value = parser.value()?;
            fields.extend(name.map(|name| (name, value)));
            Some(())
        });
        let end = self.closed(')');
        ended?;
        let span = join(name.as_ref().map_or(open, |name| name.span), end);
        if !fields.is_empty() && !items.is_empty() {
            self.error(items[0].span, "a value without a name among named fields", "write `name: value`");
            return None;
        }
        if name.as_ref().is_some_and(|name| name.text == "Some") && items.len() != 1 {
            self.error(span, "`Some` holds one value", "write the value alone");
            return None;
        }
        let value = if items.is_empty() { Value::Record(name, fields) } else { Value::Tuple(name, items) };
        Some(Node { span, value })
    }

    fn list(&mut self) -> Option<Node> {
        let open = self.open(']')?;
        let mut items = Vec::new();
        let ended = self.entries(open, ']', |parser| {
            items.push(parser.value()?);
            Some(())
        });
        let span = join(open, self.closed(']'));
        ended.map(|()| Node { span, value: Value::List(items) })
    }

    fn map(&mut self) -> Option<Node> {
        let open = self.open('}')?;
        let mut entries = Vec::new();
        let ended = self.entries(open, '}', |parser| {
            let key = parser.value()?;
            if parser.token != Token::Mark(':') {
                let shown = parser.shown();
                parser.error(
                    parser.span,
                    format!("expected `:` after the key, found {shown}"),
                    "write `\"key\": value`",
                );
                return None;
            }
            parser.advance();
            let value = parser.value()?;
            entries.push((key, value));
            Some(())
        });
        let span = join(open, self.closed('}'));
        ended.map(|()| Node { span, value: Value::Map(entries) })
    }

    /// Entries parted by commas, up to the closing bracket, which is left as the token at hand where it is there.
    /// None when they run into what stands around them, which has been reported.
    fn entries(&mut self, open: Span, close: char, mut entry: impl FnMut(&mut Self) -> Option<()>) -> Option<()> {
        loop {
            match self.token {
                Token::Mark(c) if c == close => return Some(()),
                Token::Mark(c @ (')' | ']' | '}')) if !self.open.contains(&c) => {
                    // Nothing else can have been meant by it.
                    self.error(self.span, format!("`{c}` where `{close}` should be"), "");
                    self.token = Token::Mark(close);
                    return Some(());
                }
                Token::End | Token::Mark(')' | ']' | '}') => {
                    self.unclosed(open, close, &self.shown(), self.span.line);
                    return Some(());
                }
                _ => {}
            }
            let (shown, line) = (self.shown(), self.span.line);
            if entry(self).is_none() {
                self.skip_entry();
            }
            match self.token {
                Token::Mark(',') => {
                    self.advance();
                }
                Token::Mark(')' | ']' | '}') | Token::End => {}
                // Already reported.
                Token::Broken => self.skip_entry(),
                Token::Mark(':') if close == ']' => {
                    // A field's name in a list: the list has ended before it.
                    self.unclosed(open, close, &shown, line);
                    return None;
                }
                Token::Name(ref unit) if self.behind_number && UNITS.contains(&unit.as_str()) => {
                    let message = format!("`{unit}` behind a number");
                    self.error(
                        self.span,
                        message,
                        "write the number alone: `treewright schema` tells each field's unit",
                    );
                    self.advance();
                    if self.token == Token::Mark(',') {
                        self.advance();
                    }
                }
                _ => {
                    let shown = self.shown();
                    self.error(self.span, format!("a comma is missing before {shown}"), "");
                    if self.token == Token::Mark(':') {
                        self.skip_entry();
                    }
                }
            }
        }
    }

    /// Reports an open bracket; `found` stands on `line` where it should have been closed.
    fn unclosed(&self, open: Span, close: char, found: &str, line: u32) {
        let at_end = self.token == Token::End;
        if at_end && self.lexer.torn {
            return;
        }
        let opening = match close {
            ')' => '(',
            ']' => '[',
            _ => '{',
        };
        let place = if at_end { "at the file's end".to_string() } else { format!("on line {line}, before {found}") };
        self.error(open, format!("this `{opening}` is not closed"), format!("a `{close}` is missing {place}"));
    }

    /// Leaves a bracket: the place of the closing one, which is consumed where it is there.
    fn closed(&mut self, close: char) -> Span {
        self.open.pop();
        if self.token == Token::Mark(close) { self.advance().1 } else { self.span }
    }

    /// To the comma or closing bracket that ends the entry at hand.
    fn skip_entry(&mut self) {
        let mut level = 0_u32;
        loop {
            match self.token {
                Token::End => return,
                Token::Mark(',' | ')' | ']' | '}') if level == 0 => return,
                Token::Mark('(' | '[' | '{') => level += 1,
                Token::Mark(')' | ']' | '}') => level -= 1,
                _ => {}
            }
            self.advance();
        }
    }
}

fn join(start: Span, end: Span) -> Span {
    Span { end_line: end.end_line, end_column: end.end_column, ..start }
}
