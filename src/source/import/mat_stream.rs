//! The elements of a MAT-file, read from front to back, whether packed or not.

use std::io::Read;

/// Longest field name, and most fields of a struct.
const MOST_FIELDS: (usize, usize) = (256, 1000);

/// What stands before an element.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tag {
    pub(super) kind: u32,
    pub(super) size: u64,
    /// Where it began; its data is padded to 8 bytes from there.
    small: bool,
}

/// A matrix' header.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matrix {
    pub(super) class: u8,
    complex: bool,
    elements: u64,
    /// Position in the stream where it ends.
    end: u64,
}

impl Matrix {
    /// The product of its dimensions.
    pub(super) fn elements(&self) -> u64 {
        self.elements
    }
}

/// Elements from front to back.
pub(super) struct Stream<'a> {
    from: &'a mut dyn Read,
    big: bool,
    at: u64,
    most: u64,
}

impl<'a> Stream<'a> {
    /// At most `most` bytes are read.
    pub(super) fn new(from: &'a mut dyn Read, big: bool, most: u64) -> Self {
        Self { from, big, at: 0, most }
    }

    /// Bytes that may still be read.
    pub(super) fn left(&self) -> u64 {
        self.most - self.at
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), String> {
        if bytes.len() as u64 > self.left() {
            return Err(format!("it needs more than {} bytes", self.most));
        }
        self.from.read_exact(bytes).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => format!("the data end after {} bytes", self.at),
            _ => format!("the packed data are damaged after {} bytes", self.at),
        })?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    fn skip(&mut self, mut size: u64) -> Result<(), String> {
        let mut bytes = [0; 4096];
        while size > 0 {
            let part = size.min(4096) as usize;
            self.fill(&mut bytes[..part])?;
            size -= part as u64;
        }
        Ok(())
    }

    fn word(&mut self) -> Result<u32, String> {
        let mut b = [0; 4];
        self.fill(&mut b)?;
        Ok(if self.big { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) })
    }

    /// The next element's tag. The data of a small one lies in the tag's second half and is next to be read.
    pub(super) fn tag(&mut self) -> Result<Tag, String> {
        let first = self.word()?;
        if first >> 16 != 0 {
            let size = first >> 16;
            if size > 4 {
                return Err(format!("a small element of {size} bytes"));
            }
            return Ok(Tag { kind: first & 0xffff, size: u64::from(size), small: true });
        }
        Ok(Tag { kind: first, size: u64::from(self.word()?), small: false })
    }

    /// Goes past what fills an element up, once all of its data was read.
    pub(super) fn pad(&mut self, tag: &Tag) -> Result<(), String> {
        let unit = if tag.small { 4 } else { 8 };
        self.skip((unit - tag.size % unit) % unit)
    }

    /// Goes past an element.
    fn pass(&mut self, tag: &Tag) -> Result<(), String> {
        self.skip(tag.size)?;
        self.pad(tag)
    }

    /// The header of a matrix of `size` bytes, up to its name; none for an empty one.
    pub(super) fn matrix(&mut self, size: u64) -> Result<Option<Matrix>, String> {
        if size == 0 {
            return Ok(None);
        }
        let end = self.at + size;
        let flags = self.tag()?;
        if flags.kind != 6 || flags.size != 8 {
            return Err("a matrix without flags".to_owned());
        }
        let word = self.word()?;
        self.word()?;
        let dimensions = self.tag()?;
        if dimensions.kind != 5 || dimensions.size > 32 * 4 || dimensions.size % 4 != 0 {
            return Err("a matrix without dimensions".to_owned());
        }
        let mut elements = 1_u64;
        for _ in 0..dimensions.size / 4 {
            elements = elements.saturating_mul(u64::from(self.word()?));
        }
        self.pad(&dimensions)?;
        let name = self.tag()?;
        self.pass(&name)?;
        if self.at > end {
            return Err("a matrix shorter than its header".to_owned());
        }
        Ok(Some(Matrix { class: word as u8, complex: word & 0x800 != 0, elements, end }))
    }

    /// Bytes of a matrix that are not read yet.
    pub(super) fn left_of(&self, matrix: &Matrix) -> u64 {
        matrix.end.saturating_sub(self.at)
    }

    /// Goes to the end of a matrix.
    pub(super) fn finish(&mut self, matrix: &Matrix) -> Result<(), String> {
        if self.at > matrix.end {
            return Err("an element that is longer than the matrix it is in".to_owned());
        }
        self.skip(self.left_of(matrix))
    }

    /// The names of a struct's fields.
    pub(super) fn field_names(&mut self) -> Result<Vec<String>, String> {
        let length = self.tag()?;
        if length.kind != 5 || length.size != 4 {
            return Err("a struct without the length of its fields' names".to_owned());
        }
        let length_of = self.word()? as usize;
        self.pad(&length)?;
        let names = self.tag()?;
        let sound = length_of > 0 && length_of <= MOST_FIELDS.0 && names.size % length_of as u64 == 0;
        if !sound || names.size / length_of as u64 > MOST_FIELDS.1 as u64 {
            return Err("a struct with more or longer fields than there can be".to_owned());
        }
        let mut out = Vec::new();
        let mut bytes = vec![0; length_of];
        for _ in 0..names.size / length_of as u64 {
            self.fill(&mut bytes)?;
            let end = bytes.iter().position(|&b| b == 0).unwrap_or(length_of);
            out.push(String::from_utf8_lossy(&bytes[..end]).into_owned());
        }
        self.pad(&names)?;
        Ok(out)
    }

    /// The real numbers of a matrix of `size` bytes; nothing where it holds something else.
    pub(super) fn numbers(&mut self, size: u64, most: usize, out: &mut Vec<f64>) -> Result<(), String> {
        let Some(matrix) = self.matrix(size)? else { return Ok(()) };
        if !(6..=15).contains(&matrix.class) || matrix.complex {
            return self.finish(&matrix);
        }
        let data = self.tag()?;
        let width = match data.kind {
            1 | 2 => 1,
            3 | 4 => 2,
            5..=7 => 4,
            9 | 12 | 13 => 8,
            _ => return self.finish(&matrix),
        };
        let count = data.size / width;
        if count > most as u64 {
            return Err(format!("{count} numbers are more than a file of this size can hold"));
        }
        if count != matrix.elements {
            return Err(format!("{count} numbers in a matrix of {}", matrix.elements));
        }
        let mut bytes = [0; 8];
        for _ in 0..count {
            let b = &mut bytes[..width as usize];
            self.fill(b)?;
            if self.big {
                b.reverse();
            }
            if out.len() == out.capacity() {
                out.reserve_exact(out.len() / 4 + 64);
            }
            out.push(number(data.kind, bytes));
        }
        self.skip(data.size % width)?;
        self.finish(&matrix)
    }
}

/// A number of a kind from its bytes, the least significant first.
fn number(kind: u32, b: [u8; 8]) -> f64 {
    let four = [b[0], b[1], b[2], b[3]];
    match kind {
        1 => f64::from(b[0].cast_signed()),
        2 => f64::from(b[0]),
        3 => f64::from(i16::from_le_bytes([b[0], b[1]])),
        4 => f64::from(u16::from_le_bytes([b[0], b[1]])),
        5 => f64::from(i32::from_le_bytes(four)),
        6 => f64::from(u32::from_le_bytes(four)),
        7 => f64::from(f32::from_le_bytes(four)),
        12 => i64::from_le_bytes(b) as f64,
        13 => u64::from_le_bytes(b) as f64,
        _ => f64::from_le_bytes(b),
    }
}
