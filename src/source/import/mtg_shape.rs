//! The shape of an MTG: its entities as pieces.
//!
//! With coordinates, each entity that has them is a node, and grows from the nearest one that has them on the way back
//! to the root; one that is divided and has coordinates is the base of its axis.
//!
//! Without them, each entity that is not divided is a stretch of its length. Along an axis (`<`) it turns around itself by
//! the roll and bends by the bend; an axis that branches off (`+`) leaves its carrier's surface at the angle of insertion
//! (60° where none is stated), the first lateral in the direction of the carrier's side, further ones at the same entity
//! turned by the phyllotaxy; on an axis without any roll all laterals count, so that they alternate. The side of an
//! axis that is not upright lies level, so that its laterals do (plagiotropy). That is how Xplo draws the coffee of the
//! test data, whose trunk and first-order axes come out within a millimetre; its sides of single laterals on
//! second-order axes are not in the file.
//!
//! Units. A dressing file states them in parts of a millimetre. Else lengths are in the largest of metre, centimetre
//! and millimetre that makes the plant at most 20 m high (what is measured organ by organ is small), and diameters in
//! the largest tenth of it that makes the base at most 0.12 of the height thick. Both are noted; `height` in the preset
//! overrides.

use glam::DVec3;

use crate::base::{Diagnostic, math};

use super::Format;
use super::mtg::{Feature, Graph};
use super::piece::{Piece, Read, Shape};

/// Highest plant that a unit is taken for, metres.
const HIGHEST: f64 = 20.0;
/// Thickest base over the height.
const THICKEST: f64 = 0.12;
/// Where nothing is stated, degrees.
const INSERTION: f64 = 60.0;
const PHYLLOTAXY: f64 = 180.0;

/// No entity.
const NONE: u32 = u32::MAX;

/// Pieces of the graph, in metres.
///
/// # Errors
///
/// When no entity has coordinates or a length.
pub(super) fn pieces(
    graph: &Graph,
    dressing: Option<&[u8]>,
    file: &str,
    notes: &mut Vec<String>,
) -> Result<Read, Vec<Diagnostic>> {
    let placed = graph.entities.iter().enumerate().any(|(i, _)| position(graph, i).is_some());
    let mut pieces = if placed { by_coordinates(graph) } else { by_lengths(graph) };
    if pieces.is_empty() {
        let message = "no entity has coordinates (XX, YY, ZZ) or a length (Length)";
        return Err(vec![Diagnostic::new(file, message).with_hint("the import needs one of the two")]);
    }
    units(&mut pieces, dressing, notes);
    Ok(Read { format: Format::Mtg, shape: Shape::Nodes, pieces })
}

fn position(graph: &Graph, entity: usize) -> Option<DVec3> {
    let of = |feature| graph.get(entity, feature);
    Some(DVec3::new(of(Feature::X)?, of(Feature::Y)?, of(Feature::Z)?))
}

/// Radius at an entity's end, in units of the file; 0 where nothing is stated.
fn radius(graph: &Graph, entity: usize) -> f64 {
    let half = |feature| graph.get(entity, feature).map(|d| d * 0.5);
    let stated = half(Feature::TopDiameter).or_else(|| graph.get(entity, Feature::Radius));
    stated.or_else(|| half(Feature::Diameter)).unwrap_or(0.0).max(0.0)
}

fn piece(id: usize, from: u32, start: DVec3, end: DVec3, radius: f64, axis: i64, line: u32) -> Piece {
    Piece {
        start,
        end,
        radius,
        id: id as i64,
        parent_id: if from == NONE { -1 } else { i64::from(from) },
        parent: None,
        axis,
        extension_id: Piece::NONE,
        order: Piece::NONE,
        line,
    }
}

/// How the next entity goes on from the last one that is drawn before it.
#[derive(Clone, Copy)]
struct Back {
    /// The piece of that one, or `NONE`.
    piece: u32,
    /// The entity at which a branch began since then, or `NONE`.
    branch: u32,
}

/// For each entity the piece that stands for it, or how those after it go back to one.
struct Ways(Vec<Back>);

impl Ways {
    fn new(graph: &Graph) -> Self {
        Self(Vec::with_capacity(graph.entities.len()))
    }

    /// How the next entity goes back.
    fn back(&self, graph: &Graph) -> Back {
        let i = self.0.len();
        let entity = &graph.entities[i];
        if entity.from as usize == i {
            return Back { piece: NONE, branch: NONE };
        }
        let back = self.0[entity.from as usize];
        if entity.edge == b'+' { Back { branch: i as u32, ..back } } else { back }
    }

    /// The next entity is drawn by a piece, or not at all.
    fn push(&mut self, drawn: Option<usize>, back: Back) {
        self.0.push(drawn.map_or(back, |piece| Back { piece: piece as u32, branch: NONE }));
    }
}

fn by_coordinates(graph: &Graph) -> Vec<Piece> {
    let mut ways = Ways::new(graph);
    let mut out: Vec<Piece> = Vec::new();
    let mut origin = None;
    for (i, entity) in graph.entities.iter().enumerate() {
        let back = ways.back(graph);
        let Some(point) = position(graph, i).filter(|_| entity.wood) else {
            ways.push(None, back);
            continue;
        };
        let point = point - *origin.get_or_insert(point);
        let id = out.len();
        let axis = match out.get(back.piece as usize) {
            Some(from) if back.branch == NONE => from.axis,
            _ => id as i64,
        };
        out.push(piece(id, back.piece, point, point, radius(graph, i), axis, entity.line));
        ways.push(Some(id), back);
    }
    out
}

/// How a stretch lies: where it heads, and which side its laterals leave from. Single precision keeps a file's memory
/// in bounds; positions are summed in double.
#[derive(Clone, Copy)]
struct Lie {
    heading: glam::Vec3,
    side: glam::Vec3,
    /// Laterals so far: on the axis up to here, and at this stretch.
    on_axis: u32,
    here: u32,
    /// Whether the axis ever turned around itself.
    rolled: bool,
    /// Whether it bends up.
    rises: bool,
}

fn by_lengths(graph: &Graph) -> Vec<Piece> {
    let mut ways = Ways::new(graph);
    let mut out: Vec<Piece> = Vec::new();
    let mut lies: Vec<Lie> = Vec::new();
    for (i, entity) in graph.entities.iter().enumerate() {
        let back = ways.back(graph);
        let length = graph.get(i, Feature::Length).filter(|l| *l >= 0.0 && entity.wood && !entity.divided);
        let Some(length) = length else {
            ways.push(None, back);
            continue;
        };
        // What an axis states about itself stands where it branches off, on a wider scale than its first stretch.
        let stated = |feature| {
            let of_axis = || (back.branch != NONE).then(|| graph.get(back.branch as usize, feature)).flatten();
            graph.get(i, feature).or_else(of_axis)
        };
        let own = radius(graph, i);
        let on = back.piece as usize;
        let (mut start, mut lie, mut axis) = (DVec3::ZERO, Lie::upright(), out.len() as i64);
        if back.piece == NONE {
            // A root has a base, which is a node of its own.
            out.push(piece(out.len(), NONE, start, start, own, axis, entity.line));
            lies.push(lie);
        } else if back.branch == NONE {
            (start, lie, axis) = (out[on].end, lies[on], out[on].axis);
            if graph.get(i, Feature::TopDiameter).is_none() && own > 0.0 {
                // A diameter is that of the base, which is where the one before ends.
                out[on].radius = own;
            }
        } else {
            let carrier = &mut lies[on];
            let turns = if carrier.rolled { carrier.here } else { carrier.on_axis };
            let turn = (f64::from(turns) * stated(Feature::Phyllotaxy).unwrap_or(PHYLLOTAXY)) as f32;
            let angle = stated(Feature::Insertion).unwrap_or(INSERTION) as f32;
            (carrier.here, carrier.on_axis) = (carrier.here.saturating_add(1), carrier.on_axis.saturating_add(1));
            lie = carrier.branch(turn, angle, stated(Feature::Stiffness).unwrap_or(0.0) < 0.0);
            start = out[on].end + carrier.side_at(turn).as_dvec3() * out[on].radius;
        }
        lie = lie.along(
            graph.get(i, Feature::Roll).unwrap_or(0.0) as f32,
            graph.get(i, Feature::Bend).unwrap_or(0.0) as f32,
        );
        let end = start + lie.heading.as_dvec3() * (length * f64::from(entity.repeat));
        let from = if back.piece == NONE { out.len() as u32 - 1 } else { back.piece };
        ways.push(Some(out.len()), back);
        out.push(piece(out.len(), from, end, end, own, axis, entity.line));
        lies.push(lie);
    }
    out
}

impl Lie {
    fn upright() -> Self {
        Self { heading: glam::Vec3::Z, side: glam::Vec3::X, on_axis: 0, here: 0, rolled: false, rises: true }
    }

    /// The next stretch of the axis: turned around itself, then bent up or down, degrees.
    fn along(self, roll: f32, bend: f32) -> Self {
        let side = turned(self.side, self.heading, roll);
        let level = self.heading.cross(glam::Vec3::Z);
        let bend = if self.rises { bend } else { -bend };
        let (heading, side) = match level.try_normalize().filter(|_| bend != 0.0) {
            Some(level) => (turned(self.heading, level, bend), turned(side, level, bend)),
            None => (self.heading, side),
        };
        Self { heading, side, here: 0, rolled: self.rolled || roll != 0.0, ..self }
    }

    /// The side, turned around the axis.
    fn side_at(&self, turn: f32) -> glam::Vec3 {
        turned(self.side, self.heading, turn)
    }

    /// An axis that branches off at an angle.
    fn branch(&self, turn: f32, angle: f32, rises: bool) -> Self {
        let side = self.side_at(turn);
        let (sin, cos) = math::sin_cos(angle.to_radians());
        let heading = (self.heading * cos + side * sin).normalize_or(glam::Vec3::Z);
        let level = glam::Vec3::Z.cross(heading).try_normalize().unwrap_or(glam::Vec3::X);
        Self { heading, side: level, on_axis: 0, here: 0, rolled: false, rises }
    }
}

/// A vector turned around an axis of length 1, degrees (Rodrigues).
fn turned(v: glam::Vec3, axis: glam::Vec3, degrees: f32) -> glam::Vec3 {
    let (sin, cos) = math::sin_cos(degrees.to_radians());
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

/// Makes the pieces metres.
fn units(pieces: &mut [Piece], dressing: Option<&[u8]>, notes: &mut Vec<String>) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for piece in pieces.iter() {
        low = low.min(piece.end);
        high = high.max(piece.end);
    }
    let size = (high - low).max_element();
    let thickest = pieces.iter().fold(0.0_f64, |r, p| r.max(p.radius)) * 2.0;
    let (length, diameter) = match dressing.map(dressed) {
        Some((length, diameter)) => (0.001 / length, 0.001 / diameter),
        None => {
            let (name, unit) = [("metres", 1.0), ("centimetres", 0.01), ("millimetres", 0.001)]
                .into_iter()
                .find(|(_, unit)| size * unit <= HIGHEST)
                .unwrap_or(("millimetres", 0.001));
            let parts = [1.0, 0.1, 0.01, 0.001].into_iter().find(|part| thickest * part <= THICKEST * size);
            let parts = parts.unwrap_or(0.001);
            let tenths = if parts < 1.0 { format!(", diameters in {parts} of them") } else { String::new() };
            notes.push(format!("lengths are taken as {name}{tenths}; `height` in the preset sets the size"));
            (unit, unit * parts)
        }
    };
    for piece in pieces {
        piece.start *= length;
        piece.end *= length;
        piece.radius *= diameter;
    }
}

/// `LengthUnit` and `DiameterUnit` of a dressing file: parts of a millimetre.
fn dressed(text: &[u8]) -> (f64, f64) {
    let mut units = (1.0, 1.0);
    for line in text.split(|&b| b == b'\n' || b == b'\r') {
        let line = String::from_utf8_lossy(line.get(..200).unwrap_or(line));
        let Some((name, value)) = line.split_once('=') else { continue };
        let value = value.trim().parse::<f64>().ok().filter(|v| (1e-6..=1e6).contains(v));
        match (name.trim(), value) {
            ("LengthUnit", Some(value)) => units.0 = value,
            ("DiameterUnit", Some(value)) => units.1 = value,
            _ => {}
        }
    }
    units
}
