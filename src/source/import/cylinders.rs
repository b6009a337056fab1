//! Rows of cylinders to pieces.

use glam::DVec3;

use crate::base::Diagnostic;

use super::columns::{self, Column, Far};
use super::piece::{Piece, Read, Shape, push};
use super::table::{Errors, Row, Table, shortened};

/// Largest coordinate, far beyond any map grid in millimetres.
const FARTHEST: f64 = 1e11;
/// Largest length or radius, in file units.
const LARGEST: f64 = 1e7;
/// Largest id.
const LAST_ID: f64 = 9e15;

/// A row under way: its cells, and whether all of them were sound so far.
pub(super) struct Cells<'a, 'e> {
    pub(super) table: &'a Table<'a>,
    pub(super) row: Row<'a>,
    pub(super) cells: &'e [&'a [u8]],
    pub(super) errors: &'e mut Errors,
}

impl Cells<'_, '_> {
    fn wrong(&mut self, column: usize, field: &str, message: &str, hint: &str) -> f64 {
        let cell = self.cells.get(column).copied().unwrap_or_default();
        let shown = shortened(&String::from_utf8_lossy(cell.get(..200).unwrap_or(cell)));
        let span = self.table.span(self.row, self.cells, column);
        self.errors.add(Some(span), field, || (message.replace("{}", &shown), hint.to_owned()));
        0.0
    }

    /// A finite number whose amount is at most `most`; 0 after an error.
    pub(super) fn number(&mut self, column: Column, field: &str, most: f64) -> f64 {
        match self.cells.get(column.at).map(|cell| self.table.number(cell)) {
            Some(Some(number)) if !number.is_finite() => self.wrong(
                column.at,
                field,
                "`{}` is not a finite number",
                "remove the row, or mend it in the program that wrote it",
            ),
            Some(Some(number)) if number.abs() > most => {
                self.wrong(column.at, field, "`{}` is out of all bounds", "lengths and coordinates are metres")
            }
            Some(Some(number)) => number * column.factor,
            _ => self.wrong(column.at, field, "`{}` is not a number", "numbers are written as 1.25 or 1.25e-3"),
        }
    }

    /// A coordinate.
    pub(super) fn coordinate(&mut self, column: Column, field: &str) -> f64 {
        self.number(column, field, FARTHEST)
    }

    /// A length or radius, not negative.
    pub(super) fn size(&mut self, column: Column, field: &str) -> f64 {
        let number = self.number(column, field, LARGEST);
        if number < 0.0 { self.wrong(column.at, field, "`{}` is negative", "it must be zero or more") } else { number }
    }

    /// A whole number.
    pub(super) fn whole(&mut self, column: Column, field: &str) -> i64 {
        let number = self.number(column, field, LAST_ID);
        if number.fract() == 0.0 {
            number as i64
        } else {
            self.wrong(column.at, field, "`{}` is not a whole number", "ids are whole numbers");
            0
        }
    }

    /// A whole number, or none where the cell holds anything else: a column that only helps.
    fn hint(&self, column: Option<Column>) -> i64 {
        column
            .and_then(|c| self.table.number(self.cells.get(c.at)?))
            .filter(|n| n.fract() == 0.0 && n.abs() <= LAST_ID)
            .map_or(Piece::NONE, |n| n as i64)
    }
}

/// An error when a row hasn't the right number of columns.
pub(super) fn check_width(table: &Table<'_>, row: Row<'_>, cells: &[&[u8]], width: usize, errors: &mut Errors) -> bool {
    if cells.len() == width {
        return true;
    }
    let column = table.span(row, &[], 0);
    errors.add(Some(column), "", || {
        let hint = if cells.len() < width { "the row, or the file, may be cut off" } else { "check the separators" };
        (format!("the row has {} columns, expected are {width}", cells.len()), hint.into())
    });
    false
}

const NO_PARENT: [&[u8]; 5] = [b"", b"NA", b"NaN", b"nan", b"null"];

/// Reads the rows after the header.
///
/// # Errors
///
/// Whatever is wrong with the header or any row.
pub(super) fn read(mut table: Table<'_>, header: &Row<'_>) -> Result<Read, Vec<Diagnostic>> {
    let columns = columns::read(&table, *header)?;
    let mut errors = Errors::new(table.file);
    let mut pieces: Vec<Piece> = Vec::new();
    let mut origin = None;
    let mut cells = Vec::new();
    while let Some(row) = table.next()? {
        table.split(row, columns.width, &mut cells);
        if !check_width(&table, row, &cells, columns.width, &mut errors) {
            continue;
        }
        let mut at = Cells { table: &table, row, cells: &cells, errors: &mut errors };
        let point = |at: &mut Cells<'_, '_>, c: [Column; 3], names: [&str; 3]| {
            DVec3::new(at.coordinate(c[0], names[0]), at.coordinate(c[1], names[1]), at.coordinate(c[2], names[2]))
        };
        let start = point(&mut at, columns.start, ["start_x", "start_y", "start_z"]);
        let far = match columns.far {
            Far::End(end) => point(&mut at, end, ["end_x", "end_y", "end_z"]) - start,
            Far::Axis(axis, length) => {
                let axis = point(&mut at, axis, ["axis_x", "axis_y", "axis_z"]);
                let length = at.size(length, "length");
                axis.normalize_or_zero() * length
            }
        };
        let radius = at.size(columns.radius, "radius");
        let id = columns.id.map_or(pieces.len() as i64 + 1, |c| at.whole(c, "id"));
        let rootless = at.cells.get(columns.parent.at).is_some_and(|c| NO_PARENT.contains(c));
        let parent_id = if rootless { -1 } else { at.whole(columns.parent, "parent") };
        let (axis, extension_id, order) = (at.hint(columns.axis), at.hint(columns.extension), at.hint(columns.order));
        if errors.is_empty() {
            // Subtracted in double precision, row by row: a tree stands hundreds of metres from a scan's origin, or
            // thousands of kilometres from a map's.
            let start = start - *origin.get_or_insert(start);
            let end = start + far;
            push(
                &mut pieces,
                Piece { start, end, radius, id, parent_id, parent: None, axis, extension_id, order, line: row.line },
            );
        }
    }
    if !errors.is_empty() {
        return Err(errors.into_list());
    }
    if pieces.is_empty() {
        return Err(vec![
            Diagnostic::new(table.file, "the file has a header but no rows").with_hint("the file may be cut off"),
        ]);
    }
    Ok(Read { format: columns.format, shape: Shape::Cylinders, pieces })
}
