//! SWC: one node a row, `id type x y z radius parent`, a parent of -1 for a root (Cannon et al. 1998).
//!
//! Six columns are read as SWC without the type. The type tells nothing about a tree and is not used.

use glam::DVec3;

use crate::base::Diagnostic;

use super::Format;
use super::columns::Column;
use super::cylinders::{Cells, check_width};
use super::piece::{Piece, Read, Shape, push};
use super::table::{Errors, Table};

/// Reads all rows. A root becomes a piece without length; `start` of every other is set once parents are known.
///
/// # Errors
///
/// Whatever is wrong with any row.
pub(super) fn read(mut table: Table<'_>) -> Result<Read, Vec<Diagnostic>> {
    let mut errors = Errors::new(table.file);
    let mut pieces: Vec<Piece> = Vec::new();
    let mut origin = None;
    let mut cells = Vec::new();
    let mut width = 0;
    while let Some(row) = table.next()? {
        table.split(row, if width == 0 { 6 } else { width }, &mut cells);
        if width == 0 {
            width = if cells.len() == 6 { 6 } else { 7 };
        }
        if !check_width(&table, row, &cells, width, &mut errors) {
            continue;
        }
        let column = |k: usize| Column { at: width + k - 7, factor: 1.0 };
        let mut at = Cells { table: &table, row, cells: &cells, errors: &mut errors };
        let id = at.whole(Column { at: 0, factor: 1.0 }, "id");
        let position =
            DVec3::new(at.coordinate(column(2), "x"), at.coordinate(column(3), "y"), at.coordinate(column(4), "z"));
        let radius = at.size(column(5), "radius");
        let parent_id = at.whole(column(6), "parent");
        if errors.is_empty() {
            let position = position - *origin.get_or_insert(position);
            push(
                &mut pieces,
                Piece {
                    start: position,
                    end: position,
                    radius,
                    id,
                    parent_id,
                    parent: None,
                    axis: Piece::NONE,
                    extension_id: Piece::NONE,
                    order: Piece::NONE,
                    line: row.line,
                },
            );
        }
    }
    if errors.is_empty() {
        Ok(Read { format: Format::Swc, shape: Shape::Nodes, pieces })
    } else {
        Err(errors.into_list())
    }
}
