//! The words of a preset's text: RON's tokens, each with its place.
//!
//! A subset of RON 0.12: what presets have no use for (characters, bytes, ranges, number suffixes, extensions, raw
//! identifiers) is refused with a sentence of its own, so whatever is accepted here `ron` accepts too. One token at a
//! time, in linear time; nothing is kept.

use crate::base::Span;

/// A token.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// `(`, `)`, `[`, `]`, `{`, `}`, `,` or `:`.
    Mark(char),
    /// A name: of a field, a kind, or `true` and `false`.
    Name(String),
    /// A whole number; the largest there is when it is larger.
    Integer(i128),
    /// Any other number; infinite when it is too large to hold, NaN when the text says so.
    Float(f64),
    /// A text, its escapes resolved.
    Text(String),
    /// Something that is no token, and has been reported.
    Broken,
    /// The end of the text.
    End,
}

/// What is wrong with the text, and the hint that goes with it.
pub(super) struct Fault {
    /// Where.
    pub(super) span: Span,
    /// What is wrong.
    pub(super) message: String,
    /// How to mend it.
    pub(super) hint: String,
}

/// Reads tokens off a text.
pub(super) struct Lexer<'t> {
    rest: &'t str,
    line: u32,
    column: u32,
    /// What was wrong with the tokens so far and has not been fetched yet.
    pub(super) faults: Vec<Fault>,
    /// Whether a text or comment was not closed: brackets that it swallowed are missing then.
    pub(super) torn: bool,
}

/// What lines begin with that a version control leaves where it could not merge.
const CONFLICT: [&str; 4] = ["<<<<<<<", "=======", ">>>>>>>", "|||||||"];

/// Whether a character looks like a space or like nothing.
fn is_unseen(c: char) -> bool {
    c.is_whitespace()
        || matches!(c, '\u{AD}' | '\u{200B}'..='\u{200D}' | '\u{202A}'..='\u{202E}' | '\u{2060}'..='\u{2069}' | '\u{FEFF}')
}

impl<'t> Lexer<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        // Some editors put a byte-order mark before UTF-8; it says nothing.
        Self {
            rest: text.strip_prefix('\u{feff}').unwrap_or(text),
            line: 1,
            column: 1,
            faults: Vec::new(),
            torn: false,
        }
    }

    fn peek(&self) -> Option<char> {
        self.rest.chars().next()
    }

    fn bump(&mut self) -> Option<char> {
        let c = self.peek()?;
        self.rest = &self.rest[c.len_utf8()..];
        if c == '\n' {
            self.line += 1;
            self.column = 1;
        } else {
            self.column += 1;
        }
        Some(c)
    }

    fn eat(&mut self, word: &str) -> bool {
        let eaten = self.rest.starts_with(word);
        if eaten {
            for _ in word.chars() {
                self.bump();
            }
        }
        eaten
    }

    fn take_while(&mut self, accept: impl Fn(char) -> bool) -> &'t str {
        let start = self.rest;
        while self.peek().is_some_and(&accept) {
            self.bump();
        }
        &start[..start.len() - self.rest.len()]
    }

    fn here(&self) -> (u32, u32) {
        (self.line, self.column)
    }

    fn since(&self, (line, column): (u32, u32)) -> Span {
        Span { line, column, end_line: self.line, end_column: self.column }
    }

    fn fault(&mut self, span: Span, message: impl Into<String>, hint: impl Into<String>) -> Token {
        self.faults.push(Fault { span, message: message.into(), hint: hint.into() });
        Token::Broken
    }

    /// The next token and its place.
    pub(super) fn token(&mut self) -> (Token, Span) {
        self.skip_blank();
        let start = self.here();
        let token = match self.peek() {
            None => Token::End,
            Some(c @ ('(' | ')' | '[' | ']' | '{' | '}' | ',' | ':')) => {
                self.bump();
                Token::Mark(c)
            }
            Some('"') => self.text(start),
            Some('r') if self.rest[1..].starts_with(['"', '#']) => self.raw_text(start),
            Some('b') if self.rest[1..].starts_with(['"', '\'']) => {
                self.bump();
                self.fault(self.since(start), "bytes have no place in a preset", "write a text in double quotes")
            }
            Some('\'') => self.single_quoted(start),
            Some('#') => {
                self.take_while(|c| c != '\n');
                self.fault(self.since(start), "a preset takes no `#`", "leave attributes out; a comment starts with //")
            }
            Some('0'..='9' | '+' | '-' | '.') => self.number(start),
            Some(c) if c == '_' || c.is_alphabetic() => {
                let name = self.take_while(|c| c == '_' || c.is_alphanumeric());
                if matches!(name, "inf" | "inff32" | "inff64") {
                    Token::Float(f64::INFINITY)
                } else if matches!(name, "NaN" | "NaNf32" | "NaNf64") {
                    Token::Float(f64::NAN)
                } else if name.is_ascii() {
                    Token::Name(name.to_string())
                } else {
                    let message = format!("unexpected `{}`", name.chars().take(40).collect::<String>());
                    self.fault(self.since(start), message, "names are of plain letters; texts stand in double quotes")
                }
            }
            Some(c) => {
                self.bump();
                let hint = match c {
                    ';' => "separate with a comma",
                    '=' => "write `name: value`",
                    '“' | '”' | '„' | '«' | '»' => "texts stand in straight double quotes",
                    _ => "",
                };
                let broken = self.fault(self.since(start), format!("unexpected `{}`", c.escape_debug()), hint);
                // What was meant is plain, so what follows is read as if it stood there.
                match c {
                    ';' => Token::Mark(','),
                    '=' => Token::Mark(':'),
                    _ => broken,
                }
            }
        };
        (token, self.since(start))
    }

    /// Whitespace and comments.
    fn skip_blank(&mut self) {
        loop {
            self.take_while(|c| {
                matches!(
                    c,
                    ' ' | '\t'
                        | '\n'
                        | '\r'
                        | '\x0B'
                        | '\x0C'
                        | '\u{85}'
                        | '\u{200E}'
                        | '\u{200F}'
                        | '\u{2028}'
                        | '\u{2029}'
                )
            });
            if self.rest.starts_with("//") {
                self.take_while(|c| c != '\n');
            } else if self.rest.starts_with("/*") {
                self.block_comment();
            } else if self.column == 1 && CONFLICT.iter().any(|mark| self.rest.starts_with(mark)) {
                let start = self.here();
                self.take_while(|c| c != '\n');
                let hint = "keep one of its sides, and remove the lines that begin with <, =, > or |";
                self.fault(self.since(start), "a conflict that a merge left", hint);
            } else if let Some(c) = self.peek().filter(|c| is_unseen(*c)) {
                // Pasted from a page or a chat; what was meant is plain, so it is read as a blank.
                let start = self.here();
                self.take_while(is_unseen);
                let message = format!("a blank that is none to readers of text, U+{:04X}", u32::from(c));
                self.fault(self.since(start), message, "delete it, and type a plain space where there is to be one");
            } else {
                return;
            }
        }
    }

    /// A block comment; they nest.
    fn block_comment(&mut self) {
        let start = self.here();
        let mut level = 0_usize;
        loop {
            if self.eat("/*") {
                level += 1;
            } else if self.eat("*/") {
                level -= 1;
                if level == 0 {
                    return;
                }
            } else if self.bump().is_none() {
                let (line, column) = start;
                let span = Span { line, column, end_line: line, end_column: column + 2 };
                self.torn = true;
                self.fault(span, "this comment is never closed", "end it with */");
                return;
            }
        }
    }

    /// `"…"`, on one line.
    fn text(&mut self, start: (u32, u32)) -> Token {
        self.bump();
        let mut text = String::new();
        let mut sound = true;
        loop {
            let at = self.here();
            match self.peek() {
                None | Some('\n') => {
                    self.torn = true;
                    return self.fault(self.since(start), "this text is never closed", "end it with a double quote");
                }
                Some('"') => {
                    self.bump();
                    return if sound { Token::Text(text) } else { Token::Broken };
                }
                Some('\\') => {
                    self.bump();
                    match self.escape() {
                        Some(c) => text.push(c),
                        None => {
                            let hint = "between folders write /, for a backslash \\\\";
                            self.fault(self.since(at), "a backslash with no meaning", hint);
                            sound = false;
                        }
                    }
                }
                Some(c) => {
                    text.push(c);
                    self.bump();
                }
            }
        }
    }

    /// What follows a backslash. Leaves what it cannot read, but for one character.
    fn escape(&mut self) -> Option<char> {
        // A quote or a line's end is left alone, so that an unknown escape before it does not swallow the text's end.
        match self.peek()? {
            '\n' => None,
            '"' => self.bump(),
            c => {
                self.bump();
                match c {
                    '\\' | '\'' => Some(c),
                    'n' => Some('\n'),
                    'r' => Some('\r'),
                    't' => Some('\t'),
                    '0' => Some('\0'),
                    'x' => {
                        let digits = self.hex_digits(2);
                        let value = u8::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 2)?;
                        value.is_ascii().then_some(value.into())
                    }
                    'u' => {
                        if !self.eat("{") {
                            return None;
                        }
                        let digits = self.hex_digits(6);
                        let value = u32::from_str_radix(digits, 16).ok()?;
                        self.eat("}").then_some(value).and_then(char::from_u32)
                    }
                    _ => None,
                }
            }
        }
    }

    fn hex_digits(&mut self, most: usize) -> &'t str {
        let start = self.rest;
        for _ in 0..most {
            if self.peek().is_some_and(|c| c.is_ascii_hexdigit()) {
                self.bump();
            }
        }
        &start[..start.len() - self.rest.len()]
    }

    /// `r"…"`, `r#"…"#`, …
    fn raw_text(&mut self, start: (u32, u32)) -> Token {
        self.bump();
        let hashes = self.take_while(|c| c == '#').len();
        if !self.eat("\"") {
            return self.fault(self.since(start), "a name takes no `r#`", "write the name alone");
        }
        let body = self.rest;
        // Each quote is looked at once: the run of # behind it is skipped whether it closes the text or not.
        loop {
            self.take_while(|c| c != '"');
            let length = body.len() - self.rest.len();
            if self.bump().is_none() {
                self.torn = true;
                let hint = format!("end it with \"{}", "#".repeat(hashes.min(8)));
                return self.fault(self.since(start), "this raw text is never closed", hint);
            }
            let mut seen = 0;
            while seen < hashes && self.eat("#") {
                seen += 1;
            }
            if seen == hashes {
                return Token::Text(body[..length].to_string());
            }
        }
    }

    fn single_quoted(&mut self, start: (u32, u32)) -> Token {
        self.bump();
        self.take_while(|c| !matches!(c, '\'' | '\n' | ',' | ')'));
        self.eat("'");
        self.fault(self.since(start), "single quotes have no meaning here", "write texts in double quotes")
    }

    fn number(&mut self, start: (u32, u32)) -> Token {
        let begin = self.rest;
        while let Some(c) = self.peek() {
            let read = &begin[..begin.len() - self.rest.len()];
            let sign_of_exponent =
                matches!(c, '+' | '-') && (read.is_empty() || (read.ends_with(['e', 'E']) && !has_radix(read)));
            if !(sign_of_exponent || matches!(c, '.' | '_') || c.is_ascii_alphanumeric()) {
                break;
            }
            self.bump();
        }
        let literal = &begin[..begin.len() - self.rest.len()];
        match value_of(literal) {
            Ok(token) => token,
            Err((message, hint)) => self.fault(self.since(start), message, hint),
        }
    }
}

fn has_radix(literal: &str) -> bool {
    let digits = literal.trim_start_matches(['+', '-']);
    digits.starts_with("0x") || digits.starts_with("0b") || digits.starts_with("0o")
}

/// The value of a number's literal, or what is wrong with it and a hint.
fn value_of(literal: &str) -> Result<Token, (String, &'static str)> {
    let shown: String = literal.chars().take(40).collect();
    let (negative, digits) = match literal.as_bytes().first() {
        Some(b'-') => (true, &literal[1..]),
        Some(b'+') => (false, &literal[1..]),
        _ => (false, literal),
    };
    let bad = |hint| Err((format!("`{shown}` is no number"), hint));
    match digits {
        "inf" => return Ok(Token::Float(if negative { f64::NEG_INFINITY } else { f64::INFINITY })),
        "NaN" => return Ok(Token::Float(f64::NAN)),
        _ => {}
    }
    let (radix, parts) = match digits.get(..2) {
        Some("0x") => (16, &digits[2..]),
        Some("0o") => (8, &digits[2..]),
        Some("0b") => (2, &digits[2..]),
        _ => (10, digits),
    };
    // An underscore may part digits, but RON lets none stand before the first, nor beside a point or exponent.
    let parted = |d: &str| {
        let bytes = d.as_bytes();
        bytes.iter().enumerate().all(|(i, &b)| {
            b != b'_'
                || (i > 0
                    && i + 1 < bytes.len()
                    && bytes[i - 1].is_ascii_hexdigit()
                    && bytes[i + 1].is_ascii_hexdigit())
        })
    };
    if !parted(parts) {
        return bad("an underscore stands between two digits only");
    }
    let body: String = parts.chars().filter(|&c| c != '_').collect();
    let whole = !body.is_empty() && body.chars().all(|c| c.is_digit(radix));
    if whole {
        let size = i128::from_str_radix(&body, radix).unwrap_or(i128::MAX);
        return Ok(Token::Integer(if negative { -size } else { size }));
    }
    let float = radix == 10
        && body.starts_with(|c: char| c.is_ascii_digit() || c == '.')
        && body.contains(|c: char| c.is_ascii_digit())
        && body.chars().all(|c| c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '+' | '-'));
    match body.parse::<f64>() {
        Ok(size) if float => Ok(Token::Float(if negative { -size } else { size })),
        _ if body.contains("..") => bad("a range has no place here; give its ends in the fields made for them"),
        _ if body.contains(|c: char| c.is_ascii_alphabetic()) => bad("write the number alone, without a unit"),
        _ => bad(""),
    }
}
