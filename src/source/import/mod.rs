//! Import: any tree mesh, structure model of a laser scan, or skeleton becomes a [`Plant`].
//!
//! [`import_with`] is the one door. The format is told by the content, never by the name:
//!
//! - glTF, GLB, OBJ with MTL, PLY: a mesh, read by [`scene`]; of several trees one (`objects` in the preset);
//! - TreeQSM's cylinders as CSV, as the text that its save function writes, or as a MAT-file of version 5 to 7; SimpleForest
//!   and aRchi CSV; SWC; MTG with coordinates or with lengths and angles;
//! - a plant that [`dump`](crate::plant::dump) wrote, which is how other programs hand over trees of their own making.
//!
//! All models become one middle form, a list of pieces (straight stretches of wood that name the piece they grow
//! from), and take the same way from there:
//!
//! 1. `cylinders`, `swc`, `mat`, `mtg`: to pieces; every number that is none is an error with its place.
//! 2. `mend`: parents found by id, cycles cut, missing radii filled in.
//! 3. `foothold`, `connect`: branches to the nearest place on their axis; links that can't be true and further roots are bridged to the nearest suitable wood.
//! 4. `trace`: pieces to the nodes of a [`Skeleton`](crate::plant::Skeleton); every branch starts on its parent's axis.
//!
//! Up is the axis that the thick wood runs along, Z when in doubt (`upright`); glTF says Y. Units are metres, but for MTG,
//! whose units are told from its size (`mtg_shape`). `up` and `height` in the preset override both.
//!
//! What was mended is said in [`Imported::notes`]. What is an error: no rows, rows cut short, cells that are no number,
//! duplicate ids, numbers out of all bounds, more than [`MOST_ROWS`] rows, and parents that don't exist in more than 5 %
//! of the rows (a file that lost its head; fewer are bridged as further roots). A file cut in mid-row is an error at
//! that row; one cut between two rows holds a smaller tree and can't be told from one. Of a file whose parents are rows
//! that come later the cut leaves parents that don't exist.

mod agreement;
mod columns;
mod connect;
mod cylinders;
mod dumped;
mod foothold;
pub(in crate::source) mod limb;
mod mat;
mod mat_stream;
mod mend;
mod mesh;
mod mtg;
mod mtg_shape;
mod nearest;
mod piece;
mod stranger;
mod swc;
mod table;
mod trace;
mod upright;

#[cfg(test)]
mod tests;

pub use agreement::{Agreement, agreement, agreement_at};

use crate::base::Diagnostic;
use crate::plant::{Plant, PlantError};
use crate::preset::plan::ImportParams;
use crate::source::foliage::Art;
use crate::source::scene::{self, Files, MeshFormat};

/// Most rows that are read.
pub const MOST_ROWS: usize = 10_000_000;

/// What a file turned out to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// TreeQSM's cylinders as CSV, one column a coordinate.
    TreeQsmCsv,
    /// TreeQSM's cylinders as its save function writes them: `start_point` and `axis_direction` span three columns.
    TreeQsmText,
    /// SimpleForest's cylinders.
    SimpleForest,
    /// aRchi's cylinders.
    Archi,
    /// TreeQSM's model as MATLAB keeps it.
    TreeQsmMat,
    /// A multiscale tree graph.
    Mtg,
    /// Nodes of a skeleton, as neurons are stored.
    Swc,
    /// A plant as [`dump`](crate::plant::dump) writes it.
    Dump,
    /// A mesh.
    Mesh(MeshFormat),
}

impl Format {
    /// The format's name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::TreeQsmCsv => "TreeQSM CSV",
            Self::TreeQsmText => "TreeQSM text",
            Self::SimpleForest => "SimpleForest CSV",
            Self::Archi => "aRchi CSV",
            Self::TreeQsmMat => "TreeQSM MAT",
            Self::Mtg => "MTG",
            Self::Swc => "SWC",
            Self::Dump => "plant dump",
            Self::Mesh(format) => format.name(),
        }
    }
}

/// An imported plant.
#[derive(Clone, Debug)]
pub struct Imported {
    /// Upright, connected, metres, the main stem's base at the origin; with leaves where the file has any.
    pub plant: Plant,
    /// What the file was.
    pub format: Format,
    /// What its leaves and its bark look like; the leaves' slots count here.
    pub art: Art,
    /// What was bridged, dropped or filled in, one sentence each with its figures; empty for a flawless file.
    pub notes: Vec<String>,
}

/// The files that a file named `file` needs beside it and that `files` lacks, relative to its folder: materials, pictures
/// and buffers of a mesh (see [`scene::refers`]); the dressing file of an MTG, which has its name and ends in `.drf`.
/// Any of them may be missing. Call it again with what was found until it names nothing new.
#[must_use]
pub fn refers(bytes: &[u8], file: &str, files: &Files<'_>) -> Vec<String> {
    if mtg::is_mtg(bytes) {
        let dressing = dressing(file);
        return if files.contains_key(&dressing) { Vec::new() } else { vec![dressing] };
    }
    scene::refers(bytes, files)
}

/// The name of an MTG's dressing file.
fn dressing(file: &str) -> String {
    let name = file.rsplit_once('/').map_or(file, |(_, name)| name);
    format!("{}.drf", name.rsplit_once('.').map_or(name, |(stem, _)| stem))
}

/// Imports a file that stands alone; see [`import_with`].
///
/// # Errors
///
/// As [`import_with`].
pub fn import(bytes: &[u8], file: &str, params: &ImportParams) -> Result<Imported, Vec<Diagnostic>> {
    import_with(bytes, file, &Files::new(), params)
}

/// Imports a file of any format that is read: the one door.
///
/// `file` is the name that errors carry; nothing is read from it. `files` holds what the file names, as far as it is
/// there (see [`refers`]).
///
/// # Errors
///
/// All that is wrong with the file, at most 20 errors and one that counts the rest; or one error about the whole file.
pub fn import_with(
    bytes: &[u8],
    file: &str,
    files: &Files<'_>,
    params: &ImportParams,
) -> Result<Imported, Vec<Diagnostic>> {
    if let Some(format) = scene::sniff(bytes).filter(|_| !dumped::is_dump(bytes)) {
        return mesh::mesh(scene::read(bytes, file, files)?, files, format, file, params);
    }
    let read =
        || if dumped::is_dump(bytes) { dumped::read(bytes, file, params) } else { model(bytes, file, files, params) };
    let mut made = read()?;
    let kind = made.format.name();
    let told = params.leaves.iter().chain(&params.wood);
    made.notes.extend(told.map(|name| format!("no material or part is called \"{name}\": {kind} has none")));
    made.notes.extend(params.objects.iter().map(|name| format!("no object is called \"{name}\": {kind} has none")));
    Ok(made)
}

/// Reads a structure model or skeleton.
///
/// Linear in the file's size but for sorting and for the search of wood near each further root (n log n); memory stays
/// below about thirty times the file, of which the plant itself is the most.
fn model(bytes: &[u8], file: &str, files: &Files<'_>, params: &ImportParams) -> Result<Imported, Vec<Diagnostic>> {
    let mut notes = Vec::new();
    let mut read = if mat::is_mat(bytes) {
        mat::read(bytes, file, &mut notes)?
    } else if mtg::is_mtg(bytes) {
        mtg::read(bytes, files.get(&dressing(file)).copied(), file, &mut notes)?
    } else {
        let table::Sniffed { table, format } = table::sniff(bytes, file)?;
        match format {
            table::Kind::Swc => swc::read(table)?,
            table::Kind::Cylinders(header) => cylinders::read(table, &header)?,
        }
    };
    mend::parents(&mut read, file, &mut notes)?;
    // Before the way up is told: along a ring of rows wood runs nowhere.
    let order = mend::cut_cycles(&mut read, &mut notes);
    upright::stand(&mut read.pieces, params.up, &mut notes);
    mend::radii(&mut read.pieces, &order, &mut notes);
    let (order, joined) = connect::connect(&mut read.pieces, order, read.shape);
    let (mut nodes, gaps) = trace::trace(&read.pieces, &order, read.shape);
    let format = read.format;
    // Each form is dropped once the next is there: a plant takes as much as all of them.
    drop((read, order));
    // What was mended on the way may be why nothing is left.
    let mended = notes.clone();
    let whole = |message: String, hint: &str| {
        let why: String = mended.iter().map(|note| format!("; {note}")).collect();
        vec![Diagnostic::new(file, message + &why).with_hint(hint)]
    };
    let factor = upright::scale(&mut nodes, params.height, 0.0, &mut notes)
        .map_err(|message| whole(message, "the import needs a tree that rises from its base"))?;
    joined.note(factor, &mut notes);
    gaps.note(factor, &mut notes);
    let skeleton = upright::skeleton(&nodes);
    drop(nodes);
    let plant = skeleton.into_plant().map_err(|error| match error {
        PlantError::Empty => whole("no row has any length".into(), "start and end of every row coincide"),
        other => whole(format!("the rows make no valid plant: {other}"), "check its coordinates and parents"),
    })?;
    Ok(Imported { plant, format, art: Art::default(), notes })
}
