//! Stanford PLY: text, little-endian and big-endian binary.
//!
//! Of vertices are read `x y z`, normals, texture coordinates (`s t`, `u v`, `texture_u texture_v`) and colours (integers
//! as sRGB, floats as they are, if within 0..=1); of faces the list `vertex_indices` or `vertex_index` and the list
//! `texcoord`, two numbers a corner, which unshares the vertices. `tristrips` are taken apart. All other properties and
//! elements are skipped. A comment `TextureFile NAME` names the colour picture. One part.
//!
//! Everything is checked against the bytes that are there before anything is kept: counts are claims. Lists are walked
//! once for their sizes and once for their content.
//!
//! Up: the format does not say. Source: Turk, The PLY polygon file format, 1994.

use glam::{DVec3, Vec2};

use super::lines::shown;
use super::ply_values::{Body, Kind, Values};
use super::polygon::Cutter;
use super::{Image, Material, Part, Scene, reference};
use crate::base::{Diagnostic, Span, math};

/// Longest header, bytes.
const MOST_HEADER: usize = 1 << 20;
/// Most elements and properties of a header.
const MOST_PROPERTIES: usize = 1000;
/// Farthest a first vertex may be from the origin before positions are counted from it.
const FAR: f64 = 1e4;

/// Whether the magic word is there.
pub(super) fn is_ply(text: &[u8]) -> bool {
    text.starts_with(b"ply") && text.get(3).is_some_and(u8::is_ascii_whitespace)
}

/// A property of an element.
#[derive(Debug)]
struct Property {
    name: String,
    kind: Kind,
    /// Kind of the count, for a list.
    list: Option<Kind>,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Debug)]
struct Header<'a> {
    body: Body,
    elements: Vec<Element>,
    texture: Option<String>,
    rest: &'a [u8],
    /// Where `rest` begins: line and byte.
    line: u32,
    at: usize,
}

fn header<'a>(bytes: &'a [u8], file: &str) -> Result<Header<'a>, Vec<Diagnostic>> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut rest = text;
    let mut line = 0_u32;
    let mut out = Header { body: Body::Text, elements: Vec::new(), texture: None, rest: &[], line: 0, at: 0 };
    let mut format = false;
    let mut total = 0;
    loop {
        let end = rest.iter().take(MOST_HEADER).position(|&b| b == b'\n' || b == b'\r');
        let fail = |message: String| vec![Diagnostic::new(file, message).with_span(Some(Span::point(line + 1, 1)))];
        let Some(end) = end else { return Err(fail("the header has no end_header".to_owned())) };
        let row = rest[..end].trim_ascii();
        let skip = if rest[end..].starts_with(b"\r\n") { end + 2 } else { end + 1 };
        rest = &rest[skip..];
        line += 1;
        let fail = |message: String| vec![Diagnostic::new(file, message).with_span(Some(Span::point(line, 1)))];
        if text.len() - rest.len() > MOST_HEADER {
            return Err(fail("the header is longer than 1 MiB".to_owned()));
        }
        let words: Vec<&[u8]> = row.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).take(8).collect();
        match &words[..] {
            [b"ply"] if line == 1 => {}
            [] | [b"obj_info", ..] => {}
            [b"comment", b"TextureFile", ..] => {
                let at = row.windows(11).position(|w| w == b"TextureFile").map_or(row.len(), |at| at + 11);
                out.texture = reference::path(&String::from_utf8_lossy(&row[at..]));
            }
            [b"comment", ..] => {}
            [b"format", kind, _version, ..] => {
                out.body = Body::of(kind).ok_or_else(|| fail(format!("`{}` is no PLY format", shown(kind))))?;
                format = true;
            }
            [b"element", name, count] => {
                let count = std::str::from_utf8(count).ok().and_then(|c| c.parse().ok());
                let count = count.ok_or_else(|| fail(format!("`{}` states no count", shown(row))))?;
                total += 1;
                out.elements.push(Element {
                    name: String::from_utf8_lossy(name).into_owned(),
                    count,
                    properties: vec![],
                });
            }
            [b"property", kind @ .., name] => {
                let of = |word: &[u8]| Kind::of(word).ok_or_else(|| fail(format!("`{}` is no type", shown(word))));
                let (kind, list) = match kind {
                    [kind] => (of(kind)?, None),
                    [b"list", count, kind] => (of(kind)?, Some(of(count)?)),
                    _ => return Err(fail(format!("`{}` is no property", shown(row)))),
                };
                let element = out.elements.last_mut();
                let element = element.ok_or_else(|| fail("a property before any element".to_owned()))?;
                total += 1;
                element.properties.push(Property { name: String::from_utf8_lossy(name).to_lowercase(), kind, list });
            }
            [b"end_header"] => break,
            _ => return Err(fail(format!("`{}` does not belong into a header", shown(row)))),
        }
        if total > MOST_PROPERTIES {
            return Err(fail(format!("more than {MOST_PROPERTIES} elements and properties")));
        }
    }
    if !format {
        return Err(vec![Diagnostic::new(file, "the header states no format")]);
    }
    out.at = bytes.len() - rest.len();
    (out.rest, out.line) = (rest, line);
    Ok(out)
}

/// The picture that the header names.
pub(super) fn refers(bytes: &[u8]) -> Vec<String> {
    header(bytes, "").ok().and_then(|h| h.texture).into_iter().collect()
}

/// Where a vertex' numbers go.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Slot {
    Skip,
    Position(usize),
    Normal(usize),
    Uv(usize),
    Color(usize),
}

fn slot(property: &Property) -> Slot {
    if property.list.is_some() {
        return Slot::Skip;
    }
    match property.name.as_str() {
        "x" => Slot::Position(0),
        "y" => Slot::Position(1),
        "z" => Slot::Position(2),
        "nx" => Slot::Normal(0),
        "ny" => Slot::Normal(1),
        "nz" => Slot::Normal(2),
        "s" | "u" | "texture_u" | "texture_s" => Slot::Uv(0),
        "t" | "v" | "texture_v" | "texture_t" => Slot::Uv(1),
        "red" | "r" | "diffuse_red" => Slot::Color(0),
        "green" | "g" | "diffuse_green" => Slot::Color(1),
        "blue" | "b" | "diffuse_blue" => Slot::Color(2),
        "alpha" | "a" | "diffuse_alpha" => Slot::Color(3),
        _ => Slot::Skip,
    }
}

/// Reads a PLY; see [`super::read`].
pub(super) fn read(bytes: &[u8], file: &str) -> Result<Scene, Vec<Diagnostic>> {
    let header = header(bytes, file)?;
    let mut values = Values::new(file, header.body, header.rest, header.line, header.at);
    let mut reader = Reader { part: Part::default(), origin: DVec3::ZERO, cutter: Cutter::for_file(bytes.len()) };
    let mut faces: Vec<(Values<'_>, &Element)> = Vec::new();
    let mut vertices = false;
    for element in &header.elements {
        // Each element takes a byte at least, unless it has no property at all.
        let least = element.properties.len() as u64;
        if least > 0 && element.count > values.left() as u64 / least {
            return Err(
                values.fail(format!("the header claims {} of `{}`, which don't fit", element.count, element.name))
            );
        }
        match element.name.as_str() {
            "vertex" if !vertices => {
                vertices = true;
                reader.vertices(element, &mut values)?;
            }
            "face" | "tristrips" => {
                faces.push((values.clone(), element));
                skip(element, &mut values)?;
            }
            _ => skip(element, &mut values)?,
        }
    }
    // Faces may stand before the vertices that they name.
    for (mut values, element) in faces {
        reader.faces(element, &mut values)?;
    }
    let mut scene = Scene { origin: reader.origin, ..Scene::default() };
    scene.notes.extend(reader.cutter.note());
    if let Some(name) = header.texture {
        scene.images.push(Image::File(name));
        scene.materials.push(Material { color_image: Some(0), double_sided: true, ..Material::default() });
        reader.part.material = Some(0);
    }
    scene.parts.push(reader.part);
    Ok(scene)
}

/// Walks over all elements; gives errors where the file ends before they do.
fn skip(element: &Element, values: &mut Values<'_>) -> Result<(), Vec<Diagnostic>> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for _ in 0..element.count {
        for property in &element.properties {
            skip_property(property, values)?;
        }
    }
    Ok(())
}

fn skip_property(property: &Property, values: &mut Values<'_>) -> Result<(), Vec<Diagnostic>> {
    let count = match property.list {
        Some(kind) => values.count(kind)?,
        None => 1,
    };
    values.skip(property.kind, count)
}

/// What is under way.
struct Reader {
    part: Part,
    origin: DVec3,
    cutter: Cutter,
}

impl Reader {
    fn vertices(&mut self, element: &Element, values: &mut Values<'_>) -> Result<(), Vec<Diagnostic>> {
        let slots: Vec<Slot> = element.properties.iter().map(slot).collect();
        let has = |slot: Slot| slots.contains(&slot);
        if !(0..3).all(|k| has(Slot::Position(k))) {
            return Err(values.fail("vertices without x, y and z".to_owned()));
        }
        let normals = (0..3).all(|k| has(Slot::Normal(k)));
        let uvs = (0..2).all(|k| has(Slot::Uv(k)));
        let colors = (0..3).all(|k| has(Slot::Color(k)));
        let n = element.count as usize;
        let part = &mut self.part;
        part.positions.reserve_exact(n);
        if normals {
            part.normals.reserve_exact(n);
        }
        if uvs {
            part.uvs.reserve_exact(n);
        }
        if colors {
            part.colors.reserve_exact(n);
        }
        for _ in 0..element.count {
            let (mut position, mut normal) = ([0.0_f64; 3], [0.0_f64; 3]);
            let (mut uv, mut color) = ([0.0_f64; 2], [1.0_f32; 4]);
            let place = values.place();
            for (property, slot) in element.properties.iter().zip(&slots) {
                if *slot == Slot::Skip {
                    skip_property(property, values)?;
                    continue;
                }
                let value = values.number(property.kind)?;
                match *slot {
                    Slot::Position(k) => position[k] = value,
                    Slot::Normal(k) => normal[k] = value,
                    Slot::Uv(k) => uv[k] = value,
                    Slot::Color(k) => color[k] = channel(value, property.kind, k),
                    Slot::Skip => {}
                }
            }
            let point = DVec3::from_array(position);
            if part.positions.is_empty() && point.is_finite() && point.abs().max_element() > FAR {
                self.origin = point;
            }
            let point = (point - self.origin).as_vec3();
            if !point.is_finite() {
                return Err(values.fail_at(place, "a vertex is not finite".to_owned()));
            }
            part.positions.push(point);
            if normals {
                part.normals.push(DVec3::from_array(normal).normalize_or_zero().as_vec3());
            }
            if uvs {
                let uv = Vec2::new(uv[0] as f32, (1.0 - uv[1]) as f32);
                part.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
            }
            if colors {
                part.colors.push(color);
            }
        }
        Ok(())
    }

    fn faces(&mut self, element: &Element, values: &mut Values<'_>) -> Result<(), Vec<Diagnostic>> {
        let strips = element.name == "tristrips";
        let named = |p: &Property, names: &[&str]| p.list.is_some() && names.contains(&p.name.as_str());
        let corners = element.properties.iter().position(|p| named(p, &["vertex_indices", "vertex_index"]));
        let Some(corners) = corners else {
            return Err(values.fail("faces without a list vertex_indices".to_owned()));
        };
        let wedge = element.properties.iter().position(|p| !strips && named(p, &["texcoord"]));
        let mut count = Counter::default();
        let start = values.clone();
        for _ in 0..element.count {
            for (i, property) in element.properties.iter().enumerate() {
                if i == corners {
                    let n = values.count(property.list.unwrap_or(Kind::U8))?;
                    count.corners += n as usize;
                    count.triangles += (n as usize).saturating_sub(2);
                    values.skip(property.kind, n)?;
                } else {
                    skip_property(property, values)?;
                }
            }
        }
        *values = start;
        self.part.triangles.reserve_exact(count.triangles);
        self.part.faces.reserve_exact(count.triangles);
        let mut unshared = wedge.map(|_| Unshared::for_corners(count.corners));
        let mut list: Vec<u32> = Vec::new();
        let mut uvs: Vec<f32> = Vec::new();
        for face in 0..element.count {
            list.clear();
            uvs.clear();
            for (i, property) in element.properties.iter().enumerate() {
                if i == corners {
                    self.corners(property, strips, values, &mut list)?;
                } else if Some(i) == wedge {
                    for _ in 0..values.count(property.list.unwrap_or(Kind::U8))? {
                        uvs.push(values.number(property.kind)? as f32);
                    }
                } else {
                    skip_property(property, values)?;
                }
            }
            let face = face as u32;
            if strips {
                self.strips(&list, face);
                continue;
            }
            let Part { triangles, faces, positions, .. } = &mut self.part;
            let first = triangles.len();
            self.cutter.cut(
                list.len(),
                |i| positions[list[i] as usize],
                |t| {
                    triangles.push(t);
                    faces.push(face);
                },
            );
            if let Some(unshared) = &mut unshared {
                unshared.corners(&mut list, &uvs);
            }
            for corner in triangles[first..].iter_mut().flatten() {
                *corner = list[*corner as usize];
            }
        }
        if let Some(unshared) = unshared {
            unshared.finish(&mut self.part);
        }
        Ok(())
    }

    fn corners(
        &self,
        property: &Property,
        strips: bool,
        values: &mut Values<'_>,
        list: &mut Vec<u32>,
    ) -> Result<(), Vec<Diagnostic>> {
        let vertices = self.part.positions.len();
        for _ in 0..values.count(property.list.unwrap_or(Kind::U8))? {
            let place = values.place();
            let index = values.number(property.kind)?;
            if strips && index == -1.0 {
                list.push(u32::MAX);
            } else if index >= 0.0 && index < vertices as f64 && index.fract() == 0.0 {
                list.push(index as u32);
            } else {
                return Err(values.fail_at(place, format!("a face names vertex {index} of {vertices}")));
            }
        }
        Ok(())
    }

    /// Strips end at `u32::MAX`.
    fn strips(&mut self, list: &[u32], face: u32) {
        for strip in list.split(|&i| i == u32::MAX) {
            for (i, t) in strip.windows(3).enumerate() {
                self.part.triangles.push(if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] });
                self.part.faces.push(face);
            }
        }
    }
}

/// Integers are sRGB but for alpha, floats are taken as they are.
fn channel(value: f64, kind: Kind, k: usize) -> f32 {
    let value = value as f32;
    let value = if value.is_finite() { value } else { 1.0 };
    match kind.most() {
        Some(most) if k < 3 => math::srgb_to_linear((value / most).clamp(0.0, 1.0)),
        Some(most) => (value / most).clamp(0.0, 1.0),
        None => value.clamp(0.0, 1.0),
    }
}

#[derive(Default)]
struct Counter {
    corners: usize,
    triangles: usize,
}

/// Vertices anew, one a corner, for faces that carry texture coordinates of their own.
struct Unshared {
    from: Vec<u32>,
    uvs: Vec<Vec2>,
}

impl Unshared {
    fn for_corners(corners: usize) -> Self {
        Self { from: Vec::with_capacity(corners), uvs: Vec::with_capacity(corners) }
    }

    fn corners(&mut self, list: &mut [u32], uvs: &[f32]) {
        for (k, corner) in list.iter_mut().enumerate() {
            self.from.push(*corner);
            *corner = (self.from.len() - 1) as u32;
            let uv = uvs.get(2 * k..2 * k + 2).map_or(Vec2::ZERO, |uv| Vec2::new(uv[0], 1.0 - uv[1]));
            self.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
        }
    }

    fn finish(self, part: &mut Part) {
        fn gathered<T: Copy>(list: &[T], from: &[u32]) -> Vec<T> {
            if list.is_empty() { Vec::new() } else { from.iter().map(|&i| list[i as usize]).collect() }
        }
        part.positions = gathered(&part.positions, &self.from);
        part.normals = gathered(&part.normals, &self.from);
        part.colors = gathered(&part.colors, &self.from);
        part.uvs = self.uvs;
    }
}
