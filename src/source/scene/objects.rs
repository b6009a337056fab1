//! Which of a file's objects are the tree: those that the preset names, or the first of several trees that stand apart.
//!
//! Packs hold many trees in one file, in a row. Objects whose boxes lie over each other as seen from above are of one tree, as trunk and
//! crown are; what is flat is ground. A tree stands where the lowest of them do and is a quarter as high as the highest at least.

use std::collections::BTreeSet;

use glam::Vec3;

use super::{Scene, keep_used};
use crate::base::Diagnostic;
use crate::preset::plan::UpAxis;

/// Most objects that are looked at.
const MOST: usize = 256;
/// How high a tree is at least, how far its foot is above the lowest and how high what is flat, in shares of the highest.
const LEAST: f32 = 0.25;
const FOOT: f32 = 0.1;
const FLAT: f32 = 0.04;
/// How much ground a tree takes at least, of the one that takes most: less is a post.
const GROUND: f32 = 0.015;
/// Most names that are listed.
const LISTED: usize = 8;

/// A box and the objects in it.
#[derive(Clone)]
struct Stand {
    low: Vec3,
    high: Vec3,
    objects: Vec<usize>,
}

impl Scene {
    /// The names of materials and parts, as a list for people; empty where none has one.
    pub(in crate::source) fn names_told(&self) -> String {
        let materials = self.materials.iter().map(|material| material.name.as_str());
        let all: BTreeSet<&str> = materials.chain(self.parts.iter().map(|part| part.name.as_str())).collect();
        listed(all.into_iter().filter(|name| !name.is_empty()))
    }

    /// Keeps what objects of these names hold, and what is below them; upper and lower case count as the same.
    ///
    /// # Errors
    ///
    /// A name that no object has; the scene is then unchanged.
    pub fn keep_objects(&mut self, names: &[String], file: &str) -> Result<(), Diagnostic> {
        let own: Vec<String> = self.objects.iter().map(|object| object.name.to_lowercase()).collect();
        if let Some(missing) = names.iter().find(|name| !own.contains(&name.to_lowercase())) {
            let known: BTreeSet<&str> =
                self.objects.iter().map(|o| o.name.as_str()).filter(|name| !name.is_empty()).collect();
            let hint = if known.is_empty() {
                "the file names none: leave `objects` out".to_owned()
            } else {
                format!("its objects are {}", listed(known))
            };
            return Err(Diagnostic::new(file, format!("no object is called \"{missing}\"")).with_hint(hint));
        }
        let wanted: BTreeSet<String> = names.iter().map(|name| name.to_lowercase()).collect();
        let mut kept: Vec<bool> = Vec::with_capacity(own.len());
        for (object, name) in self.objects.iter().zip(&own) {
            kept.push(wanted.contains(name) || object.parent.is_some_and(|parent| kept[parent]));
        }
        self.keep_parts(&kept);
        Ok(())
    }

    /// Of several trees that stand apart keeps the first, with a note.
    pub fn keep_first_tree(&mut self, up: UpAxis) {
        let axes = match (up, self.up.0) {
            (UpAxis::Z, _) | (UpAxis::Detect, UpAxis::Z) => &[2][..],
            (UpAxis::Y, _) | (UpAxis::Detect, UpAxis::Y) => &[1],
            (UpAxis::Detect, UpAxis::Detect) => &[1, 2],
        };
        let boxes = self.boxes();
        let Some(trees) = axes.iter().find_map(|&up| self.trees(&boxes, up)) else { return };
        let named = |stand: &Stand| {
            let names = stand.objects.iter().map(|&object| self.objects[object].name.as_str());
            names.filter(|name| !name.is_empty()).collect::<Vec<_>>()
        };
        let others: Vec<Vec<&str>> = trees[1..].iter().map(named).filter(|names| !names.is_empty()).collect();
        let mut note = format!("the file holds {} trees that stand apart: the first is taken", trees.len());
        if let [first, ..] = &others[..] {
            let quoted = first.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
            note += &format!(", `objects: [{quoted}]` takes another ({})", listed(others.iter().map(|names| names[0])));
        }
        let mut kept = vec![false; self.objects.len()];
        trees[0].objects.iter().for_each(|&object| kept[object] = true);
        for i in 0..kept.len() {
            kept[i] |= self.objects[i].parent.is_some_and(|parent| kept[parent]);
        }
        self.notes.push(note);
        self.keep_parts(&kept);
    }

    fn keep_parts(&mut self, kept: &[bool]) {
        self.parts.retain(|part| kept.get(part.object).copied().unwrap_or(true));
        keep_used(self);
    }

    /// The box around each object and all that is below it; none of those without a vertex.
    fn boxes(&self) -> Vec<Option<(Vec3, Vec3)>> {
        let mut boxes: Vec<Option<(Vec3, Vec3)>> = vec![None; self.objects.len()];
        for part in &self.parts {
            let Some(own) = boxes.get_mut(part.object) else { continue };
            for &place in &part.positions {
                *own = Some(own.map_or((place, place), |(low, high)| (low.min(place), high.max(place))));
            }
        }
        for i in (0..boxes.len()).rev() {
            let (Some((low, high)), Some(parent)) = (boxes[i], self.objects[i].parent) else { continue };
            boxes[parent] = Some(boxes[parent].map_or((low, high), |(l, h)| (l.min(low), h.max(high))));
        }
        boxes
    }

    /// Two trees or more that stand apart, in the file's order, where `up` is the axis that points up.
    fn trees(&self, boxes: &[Option<(Vec3, Vec3)>], up: usize) -> Option<Vec<Stand>> {
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); self.objects.len()];
        let mut objects = Vec::new();
        for (i, object) in self.objects.iter().enumerate().filter(|(i, _)| boxes[*i].is_some()) {
            object.parent.map_or(&mut objects, |parent| &mut below[parent]).push(i);
        }
        let mut has_own = vec![false; self.objects.len()];
        // Of PLY there are parts and no objects, and nothing to look at.
        self.parts.iter().filter(|_| !boxes.is_empty()).for_each(|part| has_own[part.object] = true);
        // What holds all others is no tree among them.
        let stands = loop {
            if objects.len() > MOST {
                return None;
            }
            let all = objects.iter().filter_map(|&i| boxes[i].map(|(low, high)| Stand { low, high, objects: vec![i] }));
            let mut all: Vec<Stand> = all.collect();
            let highest = all.iter().map(|stand| stand.high[up] - stand.low[up]).fold(0.0, f32::max);
            all.retain(|stand| stand.high[up] - stand.low[up] > highest * FLAT);
            match &all[..] {
                [one] if !below[one.objects[0]].is_empty() && !has_own[one.objects[0]] => {
                    objects = below[one.objects[0]].clone();
                }
                _ => break all,
            }
        };
        let stands = joined(stands, [(up + 1) % 3, (up + 2) % 3]);
        let height = |stand: &Stand| stand.high[up] - stand.low[up];
        let ground = |stand: &Stand| {
            let size = stand.high - stand.low;
            size[(up + 1) % 3] * size[(up + 2) % 3]
        };
        let most = |of: &dyn Fn(&Stand) -> f32| stands.iter().map(of).fold(0.0, f32::max);
        let (highest, widest) = (most(&height), most(&ground));
        let lowest = stands.iter().map(|stand| stand.low[up]).fold(f32::MAX, f32::min);
        let is_tree = |stand: &&Stand| {
            height(stand) >= highest * LEAST
                && stand.low[up] - lowest <= highest * FOOT
                && ground(stand) >= widest * GROUND
        };
        let mut trees: Vec<Stand> = stands.iter().filter(is_tree).cloned().collect();
        trees.iter_mut().for_each(|tree| tree.objects.sort_unstable());
        trees.sort_by_key(|tree| tree.objects[0]);
        (trees.len() > 1).then_some(trees)
    }
}

/// Those together that lie over each other along both axes.
fn joined(mut stands: Vec<Stand>, axes: [usize; 2]) -> Vec<Stand> {
    let overlap = |a: &Stand, b: &Stand| axes.iter().all(|&k| a.low[k] <= b.high[k] && b.low[k] <= a.high[k]);
    let mut done: Vec<Stand> = Vec::new();
    while let Some(mut stand) = stands.pop() {
        match done.iter().position(|other| overlap(&stand, other)) {
            // Together they may reach others.
            Some(other) => {
                let other = done.swap_remove(other);
                (stand.low, stand.high) = (stand.low.min(other.low), stand.high.max(other.high));
                stand.objects.extend(other.objects);
                stands.push(stand);
            }
            None => done.push(stand),
        }
    }
    done
}

/// Some names in quotes, and how many more there are.
fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let all: Vec<&str> = names.into_iter().collect();
    let shown = all.iter().take(LISTED).map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    match all.len().saturating_sub(LISTED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Object, Part};
    use super::*;

    /// Name, parent, middle, half width, bottom and top.
    type Boxed = (&'static str, Option<usize>, [f32; 2], f32, [f32; 2]);

    /// Objects with a box each.
    fn scene(objects: &[Boxed]) -> Scene {
        let mut made = Scene { up: super::super::SceneUp(UpAxis::Y), ..Scene::default() };
        for (i, &(name, parent, [x, z], half, [low, high])) in objects.iter().enumerate() {
            made.objects.push(Object { name: name.into(), parent });
            if half > 0.0 {
                let corners = [(x - half, low, z - half), (x + half, high, z + half), (x + half, low, z - half)];
                let positions = corners.map(|(x, y, z)| Vec3::new(x, y, z)).to_vec();
                let part =
                    Part { name: name.into(), object: i, positions, triangles: vec![[0, 1, 2]], ..Part::default() };
                made.parts.push(part);
            }
        }
        made
    }

    fn names(scene: &Scene) -> Vec<&str> {
        scene.parts.iter().map(|part| part.name.as_str()).collect()
    }

    #[test]
    fn of_trees_in_a_row_the_first_is_taken_with_its_crown_and_the_others_are_told() {
        let row = [
            ("world", None, [0.0; 2], 0.0, [0.0; 2]),
            ("ground", Some(0), [5.0, 0.0], 30.0, [-0.1, 0.0]),
            ("trees", Some(0), [0.0; 2], 0.0, [0.0; 2]),
            ("oak_trunk", Some(2), [0.0, 0.0], 0.3, [0.0, 4.0]),
            ("elm", Some(2), [10.0, 0.0], 0.0, [0.0; 2]),
            ("bark", Some(4), [10.0, 0.0], 0.3, [0.0, 4.0]),
            ("leaves", Some(4), [10.0, 0.0], 2.0, [2.0, 6.0]),
            ("oak_leaves", Some(2), [0.0, 0.0], 2.0, [2.0, 6.0]),
            ("stone", Some(2), [-5.0, 0.0], 1.0, [0.0, 1.0]),
            ("far", Some(2), [20.0, 0.0], 1.0, [0.0, 5.0]),
        ];
        let mut made = scene(&row);
        made.keep_first_tree(UpAxis::Detect);
        assert_eq!(names(&made), ["oak_trunk", "oak_leaves"]);
        let note = "the file holds 3 trees that stand apart: the first is taken, `objects: [\"elm\"]` takes another (\"elm\", \"far\")";
        assert_eq!(made.notes, [note]);
        let mut named = scene(&row);
        named.keep_objects(&["ELM".into(), "far".into()], "f").unwrap();
        assert_eq!(names(&named), ["bark", "leaves", "far"]);
        assert_eq!(named.names_told(), "\"bark\", \"far\", \"leaves\"");
        let error = named.keep_objects(&["ash".into()], "f").unwrap_err();
        assert_eq!(error.message, "no object is called \"ash\"");
        assert!(error.hint.starts_with("its objects are \"bark\", ") && error.hint.ends_with(" and 2 more"), "{error}");
    }

    #[test]
    fn one_tree_in_many_pieces_stays_whole() {
        let whole = |objects: &[Boxed]| {
            let mut made = scene(objects);
            made.keep_first_tree(UpAxis::Detect);
            made.parts.len() == objects.len() && made.notes.is_empty()
        };
        let trunk = ("trunk", None, [0.0, 0.0], 0.3, [0.0, 4.0]);
        // Clumps of leaves high up, strands that hang to the ground under a crown, a post beside the tree, one object.
        assert!(whole(&[trunk, ("a", None, [3.0, 0.0], 1.0, [3.0, 5.0]), ("b", None, [-3.0, 0.0], 1.0, [3.0, 5.0])]));
        assert!(whole(&[
            trunk,
            ("crown", None, [0.0, 0.0], 3.0, [2.0, 5.0]),
            ("s", None, [2.0, 0.0], 0.2, [0.1, 3.0])
        ]));
        assert!(whole(&[
            trunk,
            ("crown", None, [0.0, 0.0], 3.0, [2.0, 5.0]),
            ("p", None, [5.0, 0.0], 0.1, [0.0, 2.0])
        ]));
        assert!(whole(&[trunk]));
        assert!(whole(&[]));
    }
}
