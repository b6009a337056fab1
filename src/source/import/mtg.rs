//! MTG: multiscale tree graphs, as OpenAlea, AMAPmod and Xplo write them.
//!
//! The head states classes with their scales and the names of features; a row is a code and the features of the last
//! entity in it. A code walks on from the last entity in its own column (`^`) or in the column before: `/` goes into an
//! entity, `<` goes on with its axis, `+` branches off; `<<` and `<.<` stand for a series of which only the last is
//! described. Only one relation matters for the shape: from which entity the walk came.
//!
//! Geometry comes from coordinates where there are any, from lengths, diameters and angles otherwise: `mtg_shape`. What
//! is an organ by its class' name (leaf, fruit, flower, …) is left out.
//!
//! Source: Godin and Caraglio 1998, A multiscale model of plant topological structures; OpenAlea MTG documentation,
//! "File syntax".

use std::collections::BTreeMap;

use crate::base::{Diagnostic, Span, counted};

use super::MOST_ROWS;
use super::mtg_shape;
use super::piece::{Read, push};
use super::table::{Errors, shortened};

/// Most classes and features of a head.
const MOST_NAMES: usize = 1000;
/// Longest series that one code may stand for.
const MOST_SERIES: i64 = 100_000;

/// What a feature means for the shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Feature {
    X,
    Y,
    Z,
    /// Diameter at the entity's end.
    TopDiameter,
    /// Diameter at its base.
    Diameter,
    Radius,
    Length,
    /// Angle between an axis and what it grows from, degrees.
    Insertion,
    /// Turn around the axis from one entity to the next, degrees.
    Roll,
    /// Turn from one lateral to the next, degrees.
    Phyllotaxy,
    /// Bending from one entity to the next, degrees.
    Bend,
    /// Stiffness of an axis; a negative one bends up.
    Stiffness,
}

/// By a feature's name, without case.
fn feature(name: &str) -> Option<Feature> {
    Some(match name.trim().to_ascii_lowercase().as_str() {
        "xx" | "x" | "coordx" => Feature::X,
        "yy" | "y" | "coordy" => Feature::Y,
        "zz" | "z" | "coordz" => Feature::Z,
        "topdia" | "topdiameter" | "top_dia" => Feature::TopDiameter,
        "botdia" | "bottomdiameter" | "bottom_dia" | "width" | "dia" | "diam" | "diameter" => Feature::Diameter,
        "radius" => Feature::Radius,
        "length" | "len" | "internodelength" => Feature::Length,
        "yinsertionangle" | "insertionangle" | "branchingangle" | "insertion" => Feature::Insertion,
        "xeuler" => Feature::Roll,
        "phyllotaxy" | "phyllotaxis" => Feature::Phyllotaxy,
        "stiffnessangle" => Feature::Bend,
        "stifness" | "stiffness" => Feature::Stiffness,
        _ => return None,
    })
}

/// Whether a class' name is that of what carries nothing.
fn is_organ(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let organs = ["leaf", "leaflet", "petiole", "lamina", "limb", "fruit", "flower", "inflorescence", "bud", "feuille"];
    organs.contains(&name.as_str())
}

/// An entity that a row ends in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entity {
    /// The entity from which the walk came; itself for the first.
    pub(super) from: u32,
    /// `/`, `<` or `+`.
    pub(super) edge: u8,
    /// Whether it has entities in it, so that its own measures are those of the whole.
    pub(super) divided: bool,
    /// Whether it is wood.
    pub(super) wood: bool,
    /// How many of a series it stands for, each with the same features.
    pub(super) repeat: u32,
    /// Its first value.
    pub(super) values: u32,
    pub(super) line: u32,
}

/// A file's entities, each after the one from which it comes.
#[derive(Debug, Default)]
pub(super) struct Graph {
    pub(super) entities: Vec<Entity>,
    /// Values of all entities, one after the other.
    values: Vec<(Feature, f64)>,
}

impl Graph {
    /// A feature of an entity.
    pub(super) fn get(&self, entity: usize, feature: Feature) -> Option<f64> {
        let from = self.entities[entity].values as usize;
        let to = self.entities.get(entity + 1).map_or(self.values.len(), |e| e.values as usize);
        self.values.get(from..to)?.iter().find(|(f, _)| *f == feature).map(|(_, v)| *v)
    }
}

/// Whether a text begins as an MTG does: comments, then `CODE`.
pub(super) fn is_mtg(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut lines = text.split(|&b| b == b'\n' || b == b'\r').map(<[u8]>::trim_ascii);
    lines.find(|l| !l.is_empty() && !l.starts_with(b"#")).is_some_and(|l| section(l) == Some("CODE"))
}

/// The section that a line begins.
fn section(line: &[u8]) -> Option<&'static str> {
    let end = line.iter().position(|b| !b.is_ascii_alphabetic()).unwrap_or(line.len());
    let (word, rest) = line.split_at(end);
    // A class may be called CODE as well: a section's name has a colon.
    let colon = rest.trim_ascii_start().first() == Some(&b':');
    ["CODE", "CLASSES", "DESCRIPTION", "FEATURES", "MTG"].into_iter().find(|s| colon && s.as_bytes() == word)
}

/// Where the values of a row stand, and what they mean.
#[derive(Debug)]
struct Layout {
    /// First column that is no code.
    first: usize,
    features: Vec<(usize, Feature)>,
}

/// Reads an MTG to its pieces; `dressing` is the file beside it that states units, if there is one.
///
/// # Errors
///
/// Whatever is wrong with its head or rows.
pub(super) fn read(
    bytes: &[u8],
    dressing: Option<&[u8]>,
    file: &str,
    notes: &mut Vec<String>,
) -> Result<Read, Vec<Diagnostic>> {
    let graph = graph(bytes, file, notes)?;
    // A row that describes a piece of wood has a code and a measure.
    let most = bytes.len() / 12 + 4096;
    mtg_shape::pieces(&graph, most, dressing, file, notes)
}

fn graph(bytes: &[u8], file: &str, notes: &mut Vec<String>) -> Result<Graph, Vec<Diagnostic>> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut errors = Errors::new(file);
    // Scale and whether it is wood.
    let mut classes: BTreeMap<Vec<u8>, bool> = BTreeMap::new();
    let mut current = "";
    let mut layout: Option<Layout> = None;
    let mut walk = Walk::default();
    for (number, line) in text.split(|&b| b == b'\n').enumerate() {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let row = u32::try_from(number + 1).unwrap_or(u32::MAX);
        if number > MOST_ROWS {
            return Err(vec![Diagnostic::new(file, format!("the file has more than {MOST_ROWS} rows"))]);
        }
        let trimmed = line.trim_ascii();
        if trimmed.is_empty() || trimmed.starts_with(b"#") {
            continue;
        }
        if let Some(section) = section(trimmed) {
            current = section;
            continue;
        }
        match (current, &layout) {
            ("CLASSES", _) => {
                let mut words = trimmed.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
                let (name, scale) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
                let scale = std::str::from_utf8(scale).ok().and_then(|s| s.parse::<u32>().ok());
                if scale.is_some() && classes.len() < MOST_NAMES {
                    classes.insert(name.to_vec(), !is_organ(&String::from_utf8_lossy(name)));
                }
            }
            ("MTG", None) => match head(line) {
                Some(found) => layout = Some(found),
                None => {
                    let at = Some(Span::point(row, 1));
                    errors.add(at, "", || {
                        ("expected the row ENTITY-CODE with the names of the features".into(), String::new())
                    });
                    return Err(errors.into_list());
                }
            },
            ("MTG", Some(layout)) => walk.row(line, row, layout, &classes, &mut errors),
            _ => {}
        }
    }
    if !errors.is_empty() {
        return Err(errors.into_list());
    }
    if walk.graph.entities.is_empty() {
        let hint = "after `MTG:` come the row ENTITY-CODE and the entities";
        return Err(vec![Diagnostic::new(file, "the file holds no entity").with_hint(hint)]);
    }
    if walk.organs > 0 {
        let organs = counted(walk.organs, "leaf or other organ", "leaves and other organs");
        notes.push(format!("{organs} of the graph left out"));
    }
    Ok(walk.graph)
}

/// The row that names the features.
fn head(line: &[u8]) -> Option<Layout> {
    let mut features: Vec<(usize, Feature)> = Vec::new();
    let mut first = None;
    for (at, cell) in line.split(|&b| b == b'\t').take(MOST_NAMES).enumerate() {
        let cell = cell.trim_ascii();
        if at == 0 {
            cell.eq_ignore_ascii_case(b"ENTITY-CODE").then_some(())?;
        } else if !cell.is_empty() {
            first.get_or_insert(at);
            let known = feature(&String::from_utf8_lossy(cell));
            // The first column of a name counts.
            features.extend(known.filter(|f| features.iter().all(|(_, g)| g != f)).map(|f| (at, f)));
        }
    }
    Some(Layout { first: first.unwrap_or(usize::MAX), features })
}

/// The walk over the rows.
#[derive(Debug, Default)]
struct Walk {
    graph: Graph,
    /// The last entity of each column.
    last: Vec<u32>,
    /// The number in the last code.
    number: i64,
    organs: usize,
}

impl Walk {
    fn row(&mut self, line: &[u8], row: u32, layout: &Layout, classes: &BTreeMap<Vec<u8>, bool>, errors: &mut Errors) {
        let Some(column) = line.iter().position(|&b| b != b'\t') else { return };
        if column >= layout.first {
            // Values without a code: a row that somebody left behind.
            return;
        }
        let code = line[column..].split(|&b| b == b'\t').next().unwrap_or_default();
        let span = Some(Span::point(row, column as u32 + 1));
        let start = if code.starts_with(b"^") {
            self.last.get(column).copied()
        } else {
            self.last.get(..column.min(self.last.len())).and_then(|l| l.last()).copied()
        };
        if code.starts_with(b"^") && start.is_none() {
            errors.add(span, "", || {
                ("`^` goes on from the last entity of its column, and there is none".into(), "check the tabs".into())
            });
            return;
        }
        match self.code(code.trim_ascii(), start, row, classes) {
            Ok(end) => {
                self.last.truncate(column);
                // Columns that a row jumped over end where this one began.
                let fill = self.last.last().copied().unwrap_or(end);
                self.last.resize(column, fill);
                self.last.push(end);
            }
            Err(at) => {
                let shown = shortened(&String::from_utf8_lossy(code.get(..200).unwrap_or(code)));
                errors.add(Some(Span::point(row, (column + at) as u32 + 1)), "", || {
                    (format!("`{shown}` is no code"), "a code is a chain of /, < or +, a class and a number".into())
                });
                return;
            }
        }
        self.values(line, row, layout, errors);
    }

    /// Walks a code; the place of what can't be read otherwise.
    fn code(
        &mut self,
        code: &[u8],
        start: Option<u32>,
        row: u32,
        classes: &BTreeMap<Vec<u8>, bool>,
    ) -> Result<u32, usize> {
        let mut at = usize::from(code.starts_with(b"^"));
        let mut current = start;
        // The number of the entity before: where a series begins.
        let mut index = self.number;
        while at < code.len() {
            let edge = code[at];
            if !matches!(edge, b'/' | b'<' | b'+') {
                return Err(at);
            }
            at += 1;
            let dotted = code[at..].starts_with(&[b'.', edge]);
            let doubled = edge != b'/' && code.get(at) == Some(&edge);
            at += if dotted { 2 } else { usize::from(doubled) };
            let name = at
                + code[at..]
                    .iter()
                    .position(|b| !b.is_ascii_alphabetic() && *b != b'$' && *b != b'_')
                    .unwrap_or(code.len() - at);
            let class = &code[at..name];
            let digits = code[name..].iter().position(|b| !b.is_ascii_digit()).unwrap_or(code.len() - name);
            if class.is_empty() {
                return Err(at);
            }
            let number: i64 =
                std::str::from_utf8(&code[name..name + digits]).ok().and_then(|d| d.parse().ok()).unwrap_or(0);
            at = name + digits;
            let repeat = if dotted { (number - index).clamp(1, MOST_SERIES) } else { 1 };
            index = number;
            let id = self.graph.entities.len() as u32;
            let wood = classes.get(class).copied().unwrap_or_else(|| !is_organ(&String::from_utf8_lossy(class)));
            if edge == b'/'
                && let Some(whole) = current
            {
                self.graph.entities[whole as usize].divided = true;
            }
            // What grows from an organ is none of the wood either.
            let wood = wood && current.is_none_or(|c| self.graph.entities[c as usize].wood);
            self.organs += usize::from(!wood);
            push(
                &mut self.graph.entities,
                Entity {
                    from: current.unwrap_or(id),
                    edge,
                    divided: false,
                    wood,
                    repeat: repeat as u32,
                    values: self.graph.values.len() as u32,
                    line: row,
                },
            );
            current = Some(id);
        }
        self.number = index;
        current.filter(|_| !code.is_empty() && code != b"^").ok_or(0)
    }

    fn values(&mut self, line: &[u8], row: u32, layout: &Layout, errors: &mut Errors) {
        let mut features = layout.features.iter().peekable();
        let mut from = 0;
        for (at, cell) in line.split(|&b| b == b'\t').enumerate() {
            let Some(&&(column, feature)) = features.peek() else { return };
            let begin = from;
            from += cell.len() + 1;
            if at < column {
                continue;
            }
            features.next();
            let cell = cell.trim_ascii();
            if matches!(cell, b"" | b"NA" | b"nan" | b"NaN" | b"None" | b"?") {
                continue;
            }
            let number = std::str::from_utf8(cell).ok().and_then(|c| c.replace(',', ".").parse::<f64>().ok());
            match number.filter(|n| n.is_finite() && n.abs() <= 1e9) {
                Some(number) => push(&mut self.graph.values, (feature, number)),
                None => {
                    let shown = shortened(&String::from_utf8_lossy(cell.get(..200).unwrap_or(cell)));
                    errors.add(Some(Span::point(row, begin as u32 + 1)), "", || {
                        (format!("`{shown}` is not a number that can be"), "leave unknown values empty".into())
                    });
                }
            }
        }
    }
}
