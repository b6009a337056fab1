//! The middle form of every import: straight stretches of wood.

use glam::DVec3;

use super::Format;

/// A stretch of wood from `start` to `end`: a cylinder of a structure model, or the way from an SWC node's parent to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Base, in the file's units relative to the first row's start; Y up once it stands.
    pub(super) start: DVec3,
    /// Tip, likewise.
    pub(super) end: DVec3,
    /// Radius in the file's units; 0 where the file has none.
    pub(super) radius: f64,
    /// What the file calls it.
    pub(super) id: i64,
    /// What the file says it grows from.
    pub(super) parent_id: i64,
    /// Index of the piece it grows from.
    pub(super) parent: Option<u32>,
    /// The file's number for its axis; [`Piece::NONE`] where the file has none.
    pub(super) axis: i64,
    /// What the file says carries it on; [`Piece::NONE`] where the file has none.
    pub(super) extension_id: i64,
    /// The file's branch order; [`Piece::NONE`] where the file has none.
    pub(super) order: i64,
    /// Line in the file, from 1.
    pub(super) line: u32,
}

impl Piece {
    /// No number in the file.
    pub(super) const NONE: i64 = i64::MIN;

    /// A piece of which the file says nothing else.
    pub(super) fn stretch(start: DVec3, end: DVec3, radius: f64) -> Self {
        let none = Self::NONE;
        Self {
            start,
            end,
            radius,
            id: 0,
            parent_id: -1,
            parent: None,
            axis: none,
            extension_id: none,
            order: none,
            line: 1,
        }
    }

    /// Whether the file says that this piece carries on its parent's axis.
    pub(super) fn carries_on(&self, parent: &Self) -> bool {
        if self.axis != Self::NONE && parent.axis != Self::NONE {
            self.axis == parent.axis
        } else {
            parent.extension_id != Self::NONE && parent.extension_id == self.id
        }
    }

    /// Length, in the file's units.
    pub(super) fn length(&self) -> f64 {
        self.start.distance(self.end)
    }

    /// The parameter 0..=1 of the point of the axis that is nearest to `p`.
    pub(super) fn nearest(&self, p: DVec3) -> f64 {
        nearest_on(self.start, self.end, p)
    }

    /// Distance of `p` from the axis.
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        self.start.lerp(self.end, self.nearest(p)).distance(p)
    }
}

/// The parameter 0..=1 of the point of a segment that is nearest to `p`.
pub(super) fn nearest_on(start: DVec3, end: DVec3, p: DVec3) -> f64 {
    let along = end - start;
    let square = along.length_squared();
    if square > 0.0 { ((p - start).dot(along) / square).clamp(0.0, 1.0) } else { 0.0 }
}

/// Where a file gives radii.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// One for each cylinder.
    Cylinders,
    /// One at the end of each piece.
    Nodes,
}

/// A file's pieces, in its order.
#[derive(Debug)]
pub(super) struct Read {
    pub(super) format: Format,
    pub(super) shape: Shape,
    pub(super) pieces: Vec<Piece>,
}

/// Appends; grows by a quarter, so that a reader's memory stays in bounds of its file.
pub(super) fn push<T>(list: &mut Vec<T>, value: T) {
    if list.len() == list.capacity() {
        list.reserve_exact(list.len() / 4 + 16);
    }
    list.push(value);
}
