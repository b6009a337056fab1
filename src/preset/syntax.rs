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
const MOST_LEVELS: u32 = 64;
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
            Self::Float(_) => "a number",
            Self::Text(_) => "a text",
            Self::Name(_) => "a name",
            Self::Record(None, _) => "fields in ( )",
            Self::Record(Some(_), _) => "a kind with fields",
            Self::Tuple(None, _) => "values without names in ( )",
            Self::Tuple(Some(_), _) => "a kind with values without names",
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
    let mut parser =
        Parser { lexer: Lexer::new(text), token: Token::End, span: Span::point(1, 1), values: 0, level: 0, report };
    parser.advance();
    if parser.token == Token::End {
        report.whole("the file is empty", "a preset starts with ( and ends with )");
        return None;
    }
    let node = parser.value();
    if node.is_some() && parser.token != Token::End && parser.values <= MOST_VALUES {
        let shown = parser.shown();
        parser.error(parser.span, format!("{shown} after the end"), "one value in ( ) makes the file");
    }
    node
}

struct Parser<'t, 'r> {
    lexer: Lexer<'t>,
    token: Token,
    span: Span,
    values: usize,
    level: u32,
    report: &'r Report<'r>,
}

impl Parser<'_, '_> {
    fn error(&self, span: Span, message: impl Into<String>, hint: impl Into<String>) {
        self.report.at(span, "", message, hint);
    }

    fn advance(&mut self) -> (Token, Span) {
        let (token, span) = self.lexer.token();
        for fault in self.lexer.faults.drain(..) {
            self.report.at(fault.span, "", fault.message, fault.hint);
        }
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
            self.error(self.span, message, "");
            self.values = MOST_VALUES + 1;
            self.lexer = Lexer::new("");
            self.token = Token::End;
        }
    }

    /// Enters a bracket: its place, or none beyond the deepest level.
    fn open(&mut self) -> Option<Span> {
        if self.level == MOST_LEVELS {
            self.give_up(format!("brackets nest deeper than {MOST_LEVELS} levels"));
            return None;
        }
        self.level += 1;
        Some(self.advance().1)
    }

    /// `( … )`, behind the name of a kind or alone.
    fn round(&mut self, name: Option<Name>) -> Option<Node> {
        let open = self.open()?;
        let mut fields = Vec::new();
        let mut items = Vec::new();
        self.entries(open, ')', |parser| {
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
        let span = join(name.as_ref().map_or(open, |name| name.span), end);
        if !fields.is_empty() && !items.is_empty() {
            self.error(items[0].span, "a value without a name among named fields", "write `name: value`");
            return None;
        }
        let value = if items.is_empty() { Value::Record(name, fields) } else { Value::Tuple(name, items) };
        Some(Node { span, value })
    }

    fn list(&mut self) -> Option<Node> {
        let open = self.open()?;
        let mut items = Vec::new();
        self.entries(open, ']', |parser| {
            items.push(parser.value()?);
            Some(())
        });
        Some(Node { span: join(open, self.closed(']')), value: Value::List(items) })
    }

    fn map(&mut self) -> Option<Node> {
        let open = self.open()?;
        let mut entries = Vec::new();
        self.entries(open, '}', |parser| {
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
        Some(Node { span: join(open, self.closed('}')), value: Value::Map(entries) })
    }

    /// Entries parted by commas, up to the closing bracket, which is left as the token at hand where it is there.
    fn entries(&mut self, open: Span, close: char, mut entry: impl FnMut(&mut Self) -> Option<()>) {
        loop {
            match self.token {
                Token::Mark(c) if c == close => return,
                Token::End | Token::Mark(')' | ']' | '}') => {
                    self.unclosed(open, close);
                    return;
                }
                _ => {}
            }
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
                _ => {
                    let shown = self.shown();
                    self.error(self.span, format!("a comma is missing before {shown}"), "");
                    if matches!(self.token, Token::Mark(':')) {
                        self.skip_entry();
                    }
                }
            }
        }
    }

    fn unclosed(&mut self, open: Span, close: char) {
        if self.values <= MOST_VALUES {
            let opening = match close {
                ')' => '(',
                ']' => '[',
                _ => '{',
            };
            let place = match self.token {
                Token::End => "at the file's end".to_string(),
                _ => format!("at line {}, before {}", self.span.line, self.shown()),
            };
            self.error(open, format!("this `{opening}` is not closed"), format!("a `{close}` is missing {place}"));
        }
    }

    /// Leaves a bracket: the place of the closing one, which is consumed where it is there.
    fn closed(&mut self, close: char) -> Span {
        self.level -= 1;
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
