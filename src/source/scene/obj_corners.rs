//! From corners of OBJ faces, which name position, texture coordinate and normal apart, to parts with one index a
//! vertex.
//!
//! Corners that name the same three become one vertex of their part. They are found by a chain at each position, at
//! most 64 links of it: a file that hangs thousands of texture coordinates on one position gets vertices of its own for
//! the rest instead of a search that grows with the square.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};

use super::obj::Vertices;
use super::polygon::Cutter;
use super::{Object, Part, Scene};
use crate::base::counted;

/// Longest way along a chain.
const MOST_LINKS: usize = 64;

/// What a corner of a face names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub(super) vertex: u32,
    pub(super) uv: u32,
    pub(super) normal: u32,
}

impl Corner {
    /// No index.
    pub(super) const NONE: u32 = u32::MAX;
}

/// Appends; grows by a quarter, so that a reader's memory stays in bounds of its file.
pub(super) fn push<T>(list: &mut Vec<T>, value: T) {
    if list.len() == list.capacity() {
        list.reserve_exact(list.len() / 4 + 4);
    }
    list.push(value);
}

/// A vertex of a part.
#[derive(Clone, Copy, Debug)]
struct Link {
    part: u32,
    uv: u32,
    normal: u32,
    /// Index in its part.
    index: u32,
    /// The next vertex at the same position, or `Corner::NONE`.
    next: u32,
}

/// The parts under way.
#[derive(Debug)]
pub(super) struct Parts {
    from: Vertices,
    /// How many positions, texture coordinates and normals the file has.
    pub(super) limits: [usize; 3],
    heads: Vec<u32>,
    links: Vec<Link>,
    parts: Vec<Part>,
    /// Whether a part has any texture coordinate, and lacks any normal.
    states: Vec<(bool, bool)>,
    objects: Vec<Object>,
    /// Numbers of objects by name and the one around it.
    numbers: BTreeMap<(String, Option<usize>), usize>,
    /// Parts by object and material.
    names: BTreeMap<(usize, Option<usize>), usize>,
    /// The last part of each material.
    latest: BTreeMap<Option<usize>, usize>,
    /// The part that the last face went to, until name or material change.
    current: Option<usize>,
    /// Parts that were put into another one because there were too many.
    merged: usize,
    most: usize,
    polygon: u32,
    cutter: Cutter,
}

impl Parts {
    pub(super) fn new(from: Vertices, bytes: usize) -> Self {
        Self {
            limits: [from.positions.len(), from.uvs.len(), from.normals.len()],
            heads: vec![Corner::NONE; from.positions.len()],
            links: Vec::new(),
            parts: Vec::new(),
            states: Vec::new(),
            objects: Vec::new(),
            numbers: BTreeMap::new(),
            names: BTreeMap::new(),
            latest: BTreeMap::new(),
            current: None,
            merged: 0,
            // A part takes some hundred bytes; names of a few letters must not grow into a large list of them.
            most: 64 + bytes / 128,
            polygon: 0,
            cutter: Cutter::for_file(bytes),
            from,
        }
    }

    /// Name or material changed.
    pub(super) fn leave(&mut self) {
        self.current = None;
    }

    /// Whether more materials may be made up.
    pub(super) fn may_add(&self) -> bool {
        self.parts.len() < self.most
    }

    /// The number of what faces are of, by its name and that of the object around it.
    pub(super) fn object(&mut self, object: &str, group: &str) -> usize {
        let mut number = |name: &str, parent: Option<usize>| {
            let next = self.objects.len();
            let key = (name.to_owned(), parent);
            match self.numbers.get(&key) {
                Some(&known) => known,
                // There are as many as there may be parts.
                None if next >= self.most => next - 1,
                None => {
                    push(&mut self.objects, Object { name: name.to_owned(), parent });
                    self.numbers.insert(key, next);
                    next
                }
            }
        };
        match (object, group) {
            ("", group) => number(group, None),
            (object, "") => number(object, None),
            (object, group) => {
                let parent = number(object, None);
                number(group, Some(parent))
            }
        }
    }

    fn part(&mut self, object: usize, material: Option<usize>) -> usize {
        if let Some(current) = self.current {
            return current;
        }
        let key = (object, material);
        let found = match self.names.get(&key) {
            Some(&known) => known,
            None if self.parts.len() >= self.most => {
                self.merged += 1;
                self.latest.get(&material).copied().unwrap_or(self.parts.len() - 1)
            }
            None => {
                self.parts.push(Part { name: self.objects[object].name.clone(), object, material, ..Part::default() });
                self.states.push((false, false));
                self.names.insert(key, self.parts.len() - 1);
                self.latest.insert(material, self.parts.len() - 1);
                self.parts.len() - 1
            }
        };
        self.current = Some(found);
        found
    }

    /// Adds a face of three corners or more.
    pub(super) fn face(&mut self, corners: &mut [Corner], object: usize, material: Option<usize>) {
        let part = self.part(object, material);
        for corner in corners.iter_mut() {
            corner.vertex = self.vertex(part, *corner);
        }
        let Part { triangles, faces, positions, .. } = &mut self.parts[part];
        let polygon = self.polygon;
        let index = |i: usize| corners[i].vertex;
        self.cutter.cut(
            corners.len(),
            |i| positions[index(i) as usize],
            |t| {
                push(triangles, t.map(|i| index(i as usize)));
                push(faces, polygon);
            },
        );
        self.polygon = self.polygon.saturating_add(1);
    }

    fn vertex(&mut self, part: usize, corner: Corner) -> u32 {
        let head = self.heads[corner.vertex as usize];
        let mut at = head;
        for _ in 0..MOST_LINKS {
            let Some(link) = self.links.get(at as usize) else { break };
            if (link.part, link.uv, link.normal) == (part as u32, corner.uv, corner.normal) {
                return link.index;
            }
            at = link.next;
        }
        let out = &mut self.parts[part];
        let index = out.positions.len() as u32;
        push(&mut out.positions, self.from.positions[corner.vertex as usize]);
        let uv = self.from.uvs.get(corner.uv as usize);
        if !self.from.uvs.is_empty() {
            push(&mut out.uvs, uv.copied().unwrap_or(Vec2::ZERO));
        }
        let normal = self.from.normals.get(corner.normal as usize);
        if !self.from.normals.is_empty() {
            push(&mut out.normals, normal.copied().unwrap_or(Vec3::ZERO));
        }
        if let Some(&[r, g, b]) = self.from.colors.get(corner.vertex as usize) {
            push(&mut out.colors, [r, g, b, 1.0]);
        }
        let state = &mut self.states[part];
        state.0 |= uv.is_some();
        state.1 |= normal.is_none();
        let link = Link { part: part as u32, uv: corner.uv, normal: corner.normal, index, next: head };
        self.heads[corner.vertex as usize] = self.links.len() as u32;
        push(&mut self.links, link);
        index
    }

    /// Hands the parts over.
    pub(super) fn finish(mut self, scene: &mut Scene) {
        for (part, (any_uv, lacks_normal)) in self.parts.iter_mut().zip(&self.states) {
            if !any_uv {
                part.uvs = Vec::new();
            }
            if *lacks_normal {
                part.normals = Vec::new();
            }
        }
        if self.merged > 0 {
            let groups = counted(self.merged, "group", "groups");
            scene.notes.push(format!("{groups} put together with others: there are too many"));
        }
        scene.notes.extend(self.cutter.note());
        scene.parts = self.parts;
        scene.objects = self.objects;
    }
}
