//! The numbers of a PLY file's body, one by one, whether text or binary.

use super::lines::shown;
use crate::base::{Diagnostic, Span};

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Body {
    Text,
    Little,
    Big,
}

impl Body {
    pub(super) fn of(word: &[u8]) -> Option<Self> {
        match word {
            b"ascii" => Some(Self::Text),
            b"binary_little_endian" => Some(Self::Little),
            b"binary_big_endian" => Some(Self::Big),
            _ => None,
        }
    }
}

/// Types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    pub(super) fn of(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The greatest value of an integer; none for floats.
    pub(super) fn most(self) -> Option<f32> {
        match self {
            Self::I8 => Some(127.0),
            Self::U8 => Some(255.0),
            Self::I16 => Some(32_767.0),
            Self::U16 => Some(65_535.0),
            Self::I32 => Some(i32::MAX as f32),
            Self::U32 => Some(u32::MAX as f32),
            Self::F32 | Self::F64 => None,
        }
    }
}

/// A place in the body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    line: u32,
    at: usize,
}

/// Reads the body from front to back.
#[derive(Clone, Debug)]
pub(super) struct Values<'a> {
    file: &'a str,
    body: Body,
    rest: &'a [u8],
    line: u32,
    /// Byte of the file.
    at: usize,
}

impl<'a> Values<'a> {
    pub(super) fn new(file: &'a str, body: Body, rest: &'a [u8], line: u32, at: usize) -> Self {
        Self { file, body, rest, line: line + 1, at }
    }

    /// Bytes left.
    pub(super) fn left(&self) -> usize {
        self.rest.len()
    }

    pub(super) fn place(&self) -> Place {
        Place { line: self.line, at: self.at }
    }

    /// An error where the reader stands.
    pub(super) fn fail(&self, message: String) -> Vec<Diagnostic> {
        self.fail_at(self.place(), message)
    }

    /// An error at a place: a line of text, a byte of a binary body.
    pub(super) fn fail_at(&self, place: Place, message: String) -> Vec<Diagnostic> {
        vec![match self.body {
            Body::Text => Diagnostic::new(self.file, message).with_span(Some(Span::point(place.line, 1))),
            _ => Diagnostic::new(self.file, format!("{message} (byte {})", place.at)),
        }]
    }

    fn take(&mut self, size: usize) -> Result<&'a [u8], Vec<Diagnostic>> {
        match self.rest.split_at_checked(size) {
            Some((bytes, rest)) => {
                self.rest = rest;
                self.at += size;
                Ok(bytes)
            }
            None => Err(self.fail("the file ends before its data do".to_owned())),
        }
    }

    fn word(&mut self) -> Result<&'a [u8], Vec<Diagnostic>> {
        loop {
            match self.rest.first() {
                None => return Err(self.fail("the file ends before its data do".to_owned())),
                Some(b'\n') => self.line = self.line.saturating_add(1),
                Some(b) if b.is_ascii_whitespace() => {}
                Some(_) => break,
            }
            self.rest = &self.rest[1..];
        }
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        Ok(word)
    }

    /// The next number.
    pub(super) fn number(&mut self, kind: Kind) -> Result<f64, Vec<Diagnostic>> {
        if self.body == Body::Text {
            let word = self.word()?;
            let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
            return number.ok_or_else(|| self.fail(format!("`{}` is not a number", shown(word))));
        }
        let bytes = self.take(kind.size())?;
        let mut b = [0_u8; 8];
        b[..bytes.len()].copy_from_slice(bytes);
        if self.body == Body::Big {
            b[..bytes.len()].reverse();
        }
        let four = [b[0], b[1], b[2], b[3]];
        Ok(match kind {
            Kind::I8 => f64::from(b[0].cast_signed()),
            Kind::U8 => f64::from(b[0]),
            Kind::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
            Kind::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
            Kind::I32 => f64::from(i32::from_le_bytes(four)),
            Kind::U32 => f64::from(u32::from_le_bytes(four)),
            Kind::F32 => f64::from(f32::from_le_bytes(four)),
            Kind::F64 => f64::from_le_bytes(b),
        })
    }

    /// The count of a list; no more than there are bytes left.
    pub(super) fn count(&mut self, kind: Kind) -> Result<u64, Vec<Diagnostic>> {
        let place = self.place();
        let count = self.number(kind)?;
        if count >= 0.0 && count.fract() == 0.0 && count <= self.rest.len() as f64 {
            Ok(count as u64)
        } else {
            Err(self.fail_at(place, format!("a list claims {count} entries, {} bytes are left", self.rest.len())))
        }
    }

    /// Goes past some numbers.
    pub(super) fn skip(&mut self, kind: Kind, count: u64) -> Result<(), Vec<Diagnostic>> {
        if self.body == Body::Text {
            (0..count).try_for_each(|_| self.word().map(drop))
        } else {
            // A count is at most the bytes that are left, so this doesn't overflow.
            self.take((count as usize).saturating_mul(kind.size())).map(drop)
        }
    }
}
