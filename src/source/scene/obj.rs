//! Wavefront OBJ.
//!
//! The file is gone through twice: first for the vertices, then for the faces, which go straight into their parts; so
//! no list of all faces is kept. A part is a group (or object) in one material; groups of one name
//! in two objects are two. Read are `v` (with colours after the
//! coordinates, taken as sRGB), `vt`, `vn`, `f` with negative and missing indices, `o`, `g`, `usemtl`, `mtllib`. Left
//! out are points, lines, curves and smoothing groups.
//!
//! Up: the format does not say. Unit: none.
//!
//! Source: Wavefront, Advanced Visualizer manual, appendix B1.

use std::collections::BTreeMap;

use glam::{DVec3, Vec2, Vec3};

use super::lines::{Errors, Lines, Statement, number, shown};
use super::obj_corners::{Corner, Parts, push};
use super::{Files, Scene, mtl, reference};
use crate::base::{Diagnostic, counted, math};

/// Words that begin a statement of OBJ.
const WORDS: [&[u8]; 42] = [
    b"v",
    b"vt",
    b"vn",
    b"vp",
    b"f",
    b"fo",
    b"o",
    b"g",
    b"s",
    b"l",
    b"p",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"mg",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"shadow_obj",
    b"trace_obj",
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"curv",
    b"curv2",
    b"surf",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"ctech",
    b"stech",
    b"call",
    b"csh",
    b"bsp",
    b"bzp",
];

/// Statements that are looked at to tell an OBJ.
const SNIFFED: usize = 1000;

/// Farthest a first vertex may be from the origin before positions are counted from it.
const FAR: f64 = 1e4;

/// Whether the first statements are words of OBJ, a vertex among them.
pub(super) fn is_obj(text: &[u8]) -> bool {
    let mut vertex = false;
    for statement in Lines::of(text).take(SNIFFED) {
        if !WORDS.contains(&statement.word) {
            return false;
        }
        vertex |= statement.word == b"v" && statement.words().take(3).all(|w| number(w).is_some());
    }
    vertex
}

/// The material libraries that a `mtllib` names: one name with blanks, or several that end in `.mtl`.
fn libraries(statement: &Statement<'_>) -> Vec<String> {
    let whole = statement.name();
    let ends: Vec<usize> =
        whole.to_ascii_lowercase().match_indices(".mtl").map(|(at, found)| at + found.len()).collect();
    let mut names = Vec::new();
    let mut from = 0;
    for end in ends {
        let more = whole[end..].starts_with(char::is_whitespace);
        if more || end == whole.len() {
            names.extend(reference::path(&whole[from..end]));
            from = end;
        }
    }
    if names.is_empty() { reference::path(&whole).into_iter().collect() } else { names }
}

/// The libraries that an OBJ names, and the pictures that those name as far as they are there.
pub(super) fn refers(bytes: &[u8], files: &Files<'_>) -> Vec<String> {
    let mut names: Vec<String> = Lines::of(bytes).filter(|s| s.word == b"mtllib").flat_map(|s| libraries(&s)).collect();
    names.sort();
    names.dedup();
    let pictures: Vec<String> =
        names.iter().filter_map(|n| Some((n, files.get(n)?))).flat_map(|(n, b)| mtl::refers(n, b)).collect();
    names.extend(pictures);
    names
}

/// What the first pass collects.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub(super) origin: DVec3,
    pub(super) positions: Vec<Vec3>,
    /// sRGB; none, or one a position.
    pub(super) colors: Vec<[f32; 3]>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
}

/// Reads an OBJ; see [`super::read`].
pub(super) fn read(bytes: &[u8], file: &str, files: &Files<'_>) -> Result<Scene, Vec<Diagnostic>> {
    let mut errors = Errors::new(file);
    let (vertices, libraries) = vertices(bytes, &mut errors);
    errors.check()?;
    if u32::try_from(vertices.positions.len()).is_err() {
        return Err(vec![Diagnostic::new(file, "the file has more than 4,294,967,295 vertices")]);
    }
    let mut scene = Scene { origin: vertices.origin, ..Scene::default() };
    let library = mtl::read_all(&libraries, file, files, &mut scene)?;
    let mut errors = Errors::new(file);
    faces(bytes, vertices, &library, &mut scene, &mut errors);
    errors.check()?;
    Ok(scene)
}

fn vertices(bytes: &[u8], errors: &mut Errors<'_>) -> (Vertices, Vec<String>) {
    let mut out = Vertices::default();
    let mut libraries = Vec::new();
    let mut numbers: Vec<f64> = Vec::new();
    for statement in Lines::of(bytes) {
        let kind = statement.word;
        if kind == b"mtllib" {
            libraries.extend(self::libraries(&statement));
            continue;
        }
        if !matches!(kind, b"v" | b"vt" | b"vn") {
            continue;
        }
        numbers.clear();
        let least = if kind == b"vt" { 1 } else { 3 };
        let mut sound = true;
        for word in statement.words().take(8) {
            match number(word) {
                Some(value) => numbers.push(value),
                // A normal of a degenerate face is often written as nan; nothing hangs on it.
                None if kind != b"v" => numbers.push(0.0),
                None => {
                    errors.add(statement.line, || format!("`{}` is not a finite number", shown(word)));
                    sound = false;
                    break;
                }
            }
        }
        if sound && numbers.len() < least {
            let word = shown(kind);
            let count = numbers.len();
            errors.add(statement.line, || format!("`{word}` has {count} numbers, needed are {least}"));
            sound = false;
        }
        if !sound {
            continue;
        }
        match kind {
            b"v" => vertex(&mut out, &numbers, &statement, errors),
            b"vt" => {
                let v = numbers.get(1).copied().unwrap_or(0.0);
                push(&mut out.uvs, finite2(Vec2::new(numbers[0] as f32, (1.0 - v) as f32)));
            }
            _ => {
                let normal = DVec3::new(numbers[0], numbers[1], numbers[2]).normalize_or_zero();
                push(&mut out.normals, normal.as_vec3());
            }
        }
    }
    libraries.sort();
    libraries.dedup();
    (out, libraries)
}

fn finite2(uv: Vec2) -> Vec2 {
    if uv.is_finite() { uv } else { Vec2::ZERO }
}

fn vertex(out: &mut Vertices, numbers: &[f64], statement: &Statement<'_>, errors: &mut Errors<'_>) {
    let point = DVec3::new(numbers[0], numbers[1], numbers[2]);
    if out.positions.is_empty() && point.abs().max_element() > FAR {
        out.origin = point;
    }
    let position = (point - out.origin).as_vec3();
    if !position.is_finite() {
        errors.add(statement.line, || format!("the vertex `{}` is out of all bounds", shown(statement.rest)));
        return;
    }
    let color = match numbers.len() {
        6 => Some([numbers[3], numbers[4], numbers[5]]),
        7.. => Some([numbers[4], numbers[5], numbers[6]]),
        _ => None,
    };
    if color.is_some() && out.colors.is_empty() {
        out.colors.resize(out.positions.len(), [1.0; 3]);
    }
    if color.is_some() || !out.colors.is_empty() {
        let linear = |c: f64| math::srgb_to_linear((c as f32).clamp(0.0, 1.0));
        push(&mut out.colors, color.unwrap_or([1.0; 3]).map(linear));
    }
    push(&mut out.positions, position);
}

/// The second pass: faces into parts.
fn faces(
    bytes: &[u8],
    vertices: Vertices,
    library: &BTreeMap<String, usize>,
    scene: &mut Scene,
    errors: &mut Errors<'_>,
) {
    let mut parts = Parts::new(vertices, bytes.len());
    let mut materials: BTreeMap<String, Option<usize>> = BTreeMap::new();
    let (mut object, mut group) = (String::new(), String::new());
    let mut of: Option<usize> = None;
    let mut material = None;
    let mut undefined = 0_usize;
    // How many of each were stated so far: negative indices count back from there.
    let mut seen = [0_i64; 3];
    let mut corners: Vec<Corner> = Vec::new();
    let mut left_out = 0_usize;
    for statement in Lines::of(bytes) {
        match statement.word {
            b"v" => seen[0] += 1,
            b"vt" => seen[1] += 1,
            b"vn" => seen[2] += 1,
            b"o" => {
                object = statement.name();
                group.clear();
                of = None;
                parts.leave();
            }
            b"g" => {
                group = statement.name();
                of = None;
                parts.leave();
            }
            b"usemtl" => {
                parts.leave();
                let name = statement.name();
                material = match materials.get(&name) {
                    Some(known) => *known,
                    None => {
                        let found = library.get(&name).copied().or_else(|| {
                            undefined += 1;
                            parts.may_add().then(|| {
                                scene.materials.push(mtl::undefined(&name));
                                scene.materials.len() - 1
                            })
                        });
                        materials.insert(name, found);
                        found
                    }
                };
            }
            b"f" | b"fo" => {
                corners.clear();
                let mut sound = true;
                for word in statement.words() {
                    match corner(word, &seen, &parts.limits) {
                        Ok(corner) => push(&mut corners, corner),
                        Err(why) => {
                            errors.add(statement.line, || format!("corner `{}` {why}", shown(word)));
                            sound = false;
                            break;
                        }
                    }
                }
                if !sound {
                } else if corners.len() < 3 {
                    left_out += 1;
                } else {
                    let plain = group.is_empty() || group == "off" || group == "default";
                    let of = *of.get_or_insert_with(|| parts.object(&object, if plain { "" } else { &group }));
                    parts.face(&mut corners, of, material);
                }
            }
            b"l" | b"p" | b"curv" | b"curv2" | b"surf" => left_out += 1,
            _ => {}
        }
    }
    if undefined > 0 {
        let are = counted(undefined, "material is", "materials are");
        scene.notes.push(format!("{are} used but not defined by any file that was found"));
    }
    if left_out > 0 {
        let what = counted(
            left_out,
            "point, line, curve or face of fewer than three corners",
            "points, lines, curves or faces of fewer than three corners",
        );
        scene.notes.push(format!("{what} left out"));
    }
    parts.finish(scene);
    super::keep_used(scene);
}

/// A corner's indices, checked; `seen` is what negative ones count back from, `limits` what the file holds at all.
fn corner(word: &[u8], seen: &[i64; 3], limits: &[usize; 3]) -> Result<Corner, String> {
    let mut out = [Corner::NONE; 3];
    for (k, text) in word.split(|&b| b == b'/').enumerate() {
        if k == 3 {
            return Err("has more than three indices".to_owned());
        }
        if text.is_empty() && k > 0 {
            continue;
        }
        let index: i64 = std::str::from_utf8(text).ok().and_then(|t| t.parse().ok()).ok_or("is no index".to_owned())?;
        let what = ["vertex", "texture coordinate", "normal"][k];
        let at = match index {
            0 => return Err(format!("names {what} 0; they count from 1")),
            1.. => index - 1,
            _ => seen[k].saturating_add(index),
        };
        match usize::try_from(at) {
            Ok(found) if found < limits[k] => out[k] = found as u32,
            // Many exporters leave out texture coordinates and normals that their faces name; only shape is needed.
            _ if k > 0 && limits[k] == 0 => {}
            _ => return Err(format!("names {what} {index}; the file has {}", limits[k])),
        }
    }
    Ok(Corner { vertex: out[0], uv: out[1], normal: out[2] })
}
