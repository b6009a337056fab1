//! TreeQSM's models as MATLAB keeps them: MAT-files of level 5 (versions 5 to 7).
//!
//! A model is the first struct, at whatever depth and of whatever name, that has the fields `start`, `axis`, `length`,
//! `radius` and `parent` of a TreeQSM `cylinder`; `branch`, `extension` and `BranchOrder` are used where they are there.
//! Everything else is skipped. Compressed elements are unpacked as a stream, so that a small file which unpacks to
//! gigabytes costs no memory; time is bounded by [`MOST_UNPACKED`].
//!
//! Limits: no sparse or complex arrays as columns; files of version 7.3 are HDF5 and refused with a hint.
//!
//! Source: MathWorks, MAT-File Format, R2023b, "Level 5 MAT-File Format"; TreeQSM 2.4.1, treeqsm.m.

use flate2::read::ZlibDecoder;
use glam::DVec3;

use crate::base::Diagnostic;

use super::Format;
use super::mat_stream::{Matrix, Stream};
use super::piece::{Piece, Read, Shape};
use super::table::Errors;

/// Most bytes that compressed elements are unpacked to.
const MOST_UNPACKED: u64 = 1 << 30;
/// How deep structs and cells may lie in each other.
const DEEPEST: usize = 16;
/// Largest coordinate, length and radius, and largest id; as for text.
const FARTHEST: f64 = 1e11;
const LARGEST: f64 = 1e7;
const LAST_ID: f64 = 9e15;

/// Whether the header of a MAT-file of level 5 is there; its text is anything.
pub(super) fn is_mat(bytes: &[u8]) -> bool {
    matches!(bytes.get(124..128), Some([_, 1, b'I', b'M'] | [1, _, b'M', b'I']))
}

/// The columns of a model, cylinder after cylinder.
#[derive(Debug, Default)]
struct Columns {
    /// Three numbers each, column after column.
    start: Vec<f64>,
    axis: Vec<f64>,
    length: Vec<f64>,
    radius: Vec<f64>,
    parent: Vec<f64>,
    branch: Vec<f64>,
    extension: Vec<f64>,
    order: Vec<f64>,
}

impl Columns {
    fn field(&mut self, name: &str) -> Option<&mut Vec<f64>> {
        Some(match name.to_ascii_lowercase().as_str() {
            "start" => &mut self.start,
            "axis" => &mut self.axis,
            "length" => &mut self.length,
            "radius" => &mut self.radius,
            "parent" => &mut self.parent,
            "branch" => &mut self.branch,
            "extension" => &mut self.extension,
            "branchorder" => &mut self.order,
            _ => return None,
        })
    }

    fn is_model(&self) -> bool {
        [&self.start, &self.axis, &self.length, &self.radius, &self.parent].iter().all(|c| !c.is_empty())
    }
}

/// The search for a model.
struct Search {
    /// Most cylinders: a model of a file this size has fewer.
    most: usize,
    found: Option<Columns>,
    /// Models beside the first.
    others: u64,
}

/// Reads the first model.
///
/// # Errors
///
/// When the file is cut off or damaged, holds no model, or a model whose numbers can't be true.
pub(super) fn read(bytes: &[u8], file: &str, notes: &mut Vec<String>) -> Result<Read, Vec<Diagnostic>> {
    let whole = |message: &str, hint: &str| vec![Diagnostic::new(file, message).with_hint(hint)];
    let big = match bytes.get(124..128) {
        Some([_, 1, b'I', b'M']) => false,
        Some([1, _, b'M', b'I']) => true,
        _ => return Err(whole("the header of this MATLAB file is damaged", "the file may be cut off")),
    };
    let mut search = Search { most: bytes.len() / 12 + 4096, found: None, others: 0 };
    let mut rest: &[u8] = &bytes[128..];
    let mut budget = MOST_UNPACKED;
    while rest.len() >= 8 && search.found.is_none() {
        let at = bytes.len() - rest.len();
        let cut = |_| whole(&format!("the element at byte {at} is cut off"), "the file may be cut off");
        let mut plain = Stream::new(&mut rest, big, u64::MAX);
        let tag = plain.tag().map_err(|e| whole(&format!("byte {at}: {e}"), "the file is damaged"))?;
        let size = usize::try_from(tag.size).map_err(|_| cut(()))?;
        let (body, after) = rest.split_at_checked(size).ok_or(()).map_err(cut)?;
        let inside = |e: String| whole(&format!("in the element at byte {at}: {e}"), "the file is damaged or cut off");
        match tag.kind {
            15 => {
                let mut inflated = ZlibDecoder::new(body);
                let mut stream = Stream::new(&mut inflated, big, budget);
                let tag = stream.tag().map_err(inside)?;
                if tag.kind == 14 {
                    search.matrix(&mut stream, tag.size, 0).map_err(inside)?;
                }
                budget = stream.left();
            }
            14 => {
                let mut body = body;
                let mut stream = Stream::new(&mut body, big, size as u64);
                search.matrix(&mut stream, tag.size, 0).map_err(inside)?;
            }
            _ => {}
        }
        // Compressed elements are not padded, others to 8 bytes.
        let padding = if tag.kind == 15 { 0 } else { (8 - size % 8) % 8 };
        rest = after.get(padding..).unwrap_or_default();
    }
    let Search { found, others, .. } = search;
    let columns = found.ok_or_else(|| {
        whole(
            "the file holds no TreeQSM model: no struct with the fields start, axis, length, radius and parent",
            "save the QSM that TreeQSM returns",
        )
    })?;
    if others > 0 {
        notes.push(format!("the file holds {} models; the first is imported", others + 1));
    }
    pieces(&columns, file)
}

impl Search {
    /// Goes through a matrix of `size` bytes; stops once a model is found.
    fn matrix(&mut self, stream: &mut Stream<'_>, size: u64, depth: usize) -> Result<(), String> {
        let Some(matrix) = stream.matrix(size)? else { return Ok(()) };
        match matrix.class {
            1 if depth < DEEPEST => {
                for _ in 0..matrix.elements() {
                    if self.found.is_some() || stream.left_of(&matrix) == 0 {
                        break;
                    }
                    let tag = stream.tag()?;
                    self.matrix(stream, tag.size, depth + 1)?;
                    stream.pad(&tag)?;
                }
            }
            2 if depth < DEEPEST => self.structs(stream, &matrix, depth)?,
            _ => {}
        }
        if self.found.is_some() { Ok(()) } else { stream.finish(&matrix) }
    }

    fn structs(&mut self, stream: &mut Stream<'_>, matrix: &Matrix, depth: usize) -> Result<(), String> {
        let names = stream.field_names()?;
        for _ in 0..matrix.elements() {
            let mut columns = Columns::default();
            for name in &names {
                if stream.left_of(matrix) == 0 {
                    return Ok(());
                }
                let tag = stream.tag()?;
                match columns.field(name) {
                    Some(column) if column.is_empty() => {
                        let wide = matches!(name.to_ascii_lowercase().as_str(), "start" | "axis");
                        let most = self.most * if wide { 3 } else { 1 };
                        stream.numbers(tag.size, most, column).map_err(|e| format!("{name}: {e}"))?;
                    }
                    _ => self.matrix(stream, tag.size, depth + 1)?,
                }
                if self.found.is_some() {
                    return Ok(());
                }
                stream.pad(&tag)?;
            }
            if columns.is_model() {
                self.found = Some(columns);
                self.others = matrix.elements().saturating_sub(1);
                return Ok(());
            }
            if names.is_empty() {
                break;
            }
        }
        Ok(())
    }
}

/// Cylinders to pieces, as from text.
fn pieces(columns: &Columns, file: &str) -> Result<Read, Vec<Diagnostic>> {
    let n = columns.radius.len();
    let mut errors = Errors::new(file);
    for (name, column, wide) in [
        ("start", &columns.start, 3),
        ("axis", &columns.axis, 3),
        ("length", &columns.length, 1),
        ("parent", &columns.parent, 1),
    ] {
        if column.len() != n * wide {
            let message = format!("it has {} numbers, expected are {}", column.len(), n * wide);
            errors.add(None, name, || (message, "the file is damaged".into()));
        }
    }
    if !errors.is_empty() {
        return Err(errors.into_list());
    }
    let mut at = |row: usize, name: &str, value: f64, most: f64| {
        if value.is_finite() && value.abs() <= most {
            return value;
        }
        errors.add(None, name, || {
            (format!("cylinder {}: `{value}` is not a number that can be", row + 1), "mend the model".into())
        });
        0.0
    };
    let mut pieces = Vec::with_capacity(n);
    let mut origin = None;
    for i in 0..n {
        let mut three = |name: &str, column: &[f64]| {
            DVec3::new(
                at(i, name, column[i], FARTHEST),
                at(i, name, column[n + i], FARTHEST),
                at(i, name, column[2 * n + i], FARTHEST),
            )
        };
        let start = three("start", &columns.start);
        let axis = three("axis", &columns.axis).normalize_or_zero();
        let length = at(i, "length", columns.length[i], LARGEST).max(0.0);
        let radius = at(i, "radius", columns.radius[i], LARGEST).max(0.0);
        let parent = at(i, "parent", columns.parent[i], LAST_ID);
        let start = start - *origin.get_or_insert(start);
        let hint = |column: &[f64]| {
            let value = column.get(i).filter(|v| v.fract() == 0.0 && v.abs() <= LAST_ID);
            value.map_or(Piece::NONE, |v| *v as i64)
        };
        pieces.push(Piece {
            start,
            end: start + axis * length,
            radius,
            id: i as i64 + 1,
            parent_id: parent as i64,
            parent: None,
            axis: hint(&columns.branch),
            extension_id: hint(&columns.extension),
            order: hint(&columns.order),
            line: i as u32 + 1,
        });
    }
    if errors.is_empty() {
        Ok(Read { format: Format::TreeQsmMat, shape: Shape::Cylinders, pieces })
    } else {
        Err(errors.into_list())
    }
}
