//! Which column of a table of cylinders holds what, by the names that the programs in the field give them.
//!
//! Names are compared without case, blanks, underscores, dots and units: `start_x`, `startX` and `start.x` are the same.
//! A unit in parentheses is honoured: `radius (mm)`. `start_point` and `axis_direction` span three columns, as do two
//! empty names after them.

use crate::base::Diagnostic;

use super::Format;
use super::table::{Errors, Row, Table};

/// A column and the factor that makes its numbers metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Column {
    pub(super) at: usize,
    pub(super) factor: f64,
}

/// How a row gives the far end of its cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Far {
    /// By its coordinates.
    End([Column; 3]),
    /// By direction and length.
    Axis([Column; 3], Column),
}

/// The columns of a table of cylinders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Columns {
    pub(super) format: Format,
    /// None where rows are numbered from 1.
    pub(super) id: Option<Column>,
    pub(super) parent: Column,
    pub(super) start: [Column; 3],
    pub(super) far: Far,
    pub(super) radius: Column,
    pub(super) axis: Option<Column>,
    pub(super) extension: Option<Column>,
    pub(super) order: Option<Column>,
    /// Columns a row has.
    pub(super) width: usize,
}

/// What a column can be; the three coordinates of a triple follow one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Id,
    Parent,
    Start(usize),
    End(usize),
    Direction(usize),
    Length,
    Radius,
    Axis,
    Extension,
    Order,
}

const ROLES: usize = 16;

impl Role {
    const fn slot(self) -> usize {
        match self {
            Self::Id => 0,
            Self::Parent => 1,
            Self::Start(k) => 2 + k,
            Self::End(k) => 5 + k,
            Self::Direction(k) => 8 + k,
            Self::Length => 11,
            Self::Radius => 12,
            Self::Axis => 13,
            Self::Extension => 14,
            Self::Order => 15,
        }
    }
}

fn role(name: &str) -> Option<(Role, bool)> {
    let one = |role| Some((role, false));
    match name {
        "id" | "cylid" | "cylinderid" | "cylinder" => return one(Role::Id),
        "parent" | "parentid" | "parentcylinder" | "parentcylid" => return one(Role::Parent),
        "length" | "cyllength" | "lengthcyl" => return one(Role::Length),
        "radius" | "radiuscyl" | "cylradius" => return one(Role::Radius),
        "branch" | "branchid" | "axisid" => return one(Role::Axis),
        "extension" | "extensionid" => return one(Role::Extension),
        "branchorder" | "branchingorder" => return one(Role::Order),
        "start" | "startpoint" => return Some((Role::Start(0), true)),
        "end" | "endpoint" => return Some((Role::End(0), true)),
        "axis" | "axisdirection" | "direction" => return Some((Role::Direction(0), true)),
        _ => {}
    }
    let last = name.chars().last()?;
    let axis = "xyz".find(last).or_else(|| "123".find(last))?;
    match &name[..name.len() - 1] {
        "start" | "startpoint" => one(Role::Start(axis)),
        "end" | "endpoint" => one(Role::End(axis)),
        "axis" | "axisdirection" | "direction" | "dir" => one(Role::Direction(axis)),
        _ => None,
    }
}

/// The bare name and the factor of its unit.
fn bare(cell: &[u8]) -> (String, f64) {
    let text = String::from_utf8_lossy(cell.get(..64).unwrap_or(cell)).to_lowercase();
    let (name, unit) = text.split_once(['(', '[']).unwrap_or((&text, ""));
    let factor = match unit.trim_matches([')', ']', ' ']) {
        "mm" => 0.001,
        "cm" => 0.01,
        _ => 1.0,
    };
    (name.chars().filter(char::is_ascii_alphanumeric).collect(), factor)
}

/// Reads a header.
///
/// # Errors
///
/// One error for each column that is missing or there twice.
pub(super) fn read(table: &Table<'_>, header: Row<'_>) -> Result<Columns, Vec<Diagnostic>> {
    let mut errors = Errors::new(table.file);
    let mut cells = Vec::new();
    table.split(header, 0, &mut cells);
    let mut found: [Option<Column>; ROLES] = [None; ROLES];
    let (mut at, mut index, mut spans, mut archi, mut simple) = (0, 0, false, false, false);
    while index < cells.len() {
        let (name, factor) = bare(cells[index]);
        archi |= name == "cylid";
        simple |= name == "reversebranchorder" || name == "growthlength";
        let Some((role, triple)) = role(&name) else {
            (at, index) = (at + 1, index + 1);
            continue;
        };
        // A lone `axis` or `start` beside `axis_x`, `start_x` would be something else; none of the formats has one.
        let wide = if triple { 3 } else { 1 };
        for k in 0..wide {
            let slot = &mut found[role.slot() + k];
            if slot.is_some() {
                errors.add(Some(table.span(header, &cells, index)), &name, || {
                    (format!("the column `{name}` is there twice"), "name each column once".into())
                });
                break;
            }
            *slot = Some(Column { at: at + k, factor });
        }
        spans |= triple;
        at += wide;
        index += 1;
        if triple
            && cells.get(index).is_some_and(|c| c.is_empty())
            && cells.get(index + 1).is_some_and(|c| c.is_empty())
        {
            index += 2;
        }
    }
    let mut need = |role: Role, name: &str| {
        let column = found[role.slot()];
        if column.is_none() {
            errors.add(Some(table.span(header, &cells, 0)), name, || {
                (
                    format!("the header has no column `{name}`"),
                    "needed are parent, radius, start_x/y/z, and end_x/y/z or axis_x/y/z with length".into(),
                )
            });
        }
        column.unwrap_or(Column { at: 0, factor: 1.0 })
    };
    let parent = need(Role::Parent, "parent");
    let radius = need(Role::Radius, "radius");
    let start = [(0, "start_x"), (1, "start_y"), (2, "start_z")].map(|(k, name)| need(Role::Start(k), name));
    let far = if found[Role::End(0).slot()].is_some() {
        Far::End([(0, "end_x"), (1, "end_y"), (2, "end_z")].map(|(k, name)| need(Role::End(k), name)))
    } else {
        Far::Axis(
            [(0, "axis_x"), (1, "axis_y"), (2, "axis_z")].map(|(k, name)| need(Role::Direction(k), name)),
            need(Role::Length, "length"),
        )
    };
    if !errors.is_empty() {
        return Err(errors.into_list());
    }
    let format = match () {
        () if archi => Format::Archi,
        () if simple => Format::SimpleForest,
        () if spans => Format::TreeQsmText,
        () => Format::TreeQsmCsv,
    };
    let optional = |role: Role| found[role.slot()];
    Ok(Columns {
        format,
        id: optional(Role::Id),
        parent,
        start,
        far,
        radius,
        axis: optional(Role::Axis),
        extension: optional(Role::Extension),
        order: optional(Role::Order),
        width: at,
    })
}
