//! Materials of OBJ files (MTL).
//!
//! `Kd` is the colour where there is no picture (it is left aside where there is one, as most exporters write a grey
//! there); `d` or `1 - Tr` is the alpha; `map_Kd`, `map_d` and `norm`, `map_Bump` or `bump` are pictures. Their options
//! (`-bm 1.0`) are skipped. A material with `map_d` is cut off at one half. OBJ shows both faces of everything.
//!
//! Source: Wavefront, MTL material format, 1995; `norm` as in the PBR extension that modellers write.

use std::collections::BTreeMap;

use super::lines::{Errors, Lines, Statement, number, shown};
use super::{Alpha, Files, Image, Material, Scene, reference};
use crate::base::Diagnostic;

/// Most materials of a library in relation to its size: one takes some hundred bytes.
const BYTES_EACH: usize = 16;

/// The pictures that a library names, beside the mesh.
pub(super) fn refers(name: &str, bytes: &[u8]) -> Vec<String> {
    Lines::of(bytes).filter_map(|s| is_map(&s).then(|| picture(&s, name)).flatten()).collect()
}

fn is_map(statement: &Statement<'_>) -> bool {
    let word = statement.word.to_ascii_lowercase();
    matches!(&word[..], b"map_kd" | b"map_d" | b"map_opacity" | b"map_tr" | b"norm" | b"map_bump" | b"bump" | b"map_kn")
}

/// The path of a map, relative to the mesh's folder: that of its library goes before it.
fn picture(statement: &Statement<'_>, library: &str) -> Option<String> {
    let mut rest = statement.rest;
    while rest.starts_with(b"-") {
        let (option, after) = word(rest);
        rest = after;
        let (least, most) = match option {
            b"-o" | b"-s" | b"-t" => (1, 3),
            b"-mm" => (2, 2),
            _ => (1, 1),
        };
        for k in 0..most {
            let (value, after) = word(rest);
            if k >= least && number(value).is_none() {
                break;
            }
            rest = after;
        }
    }
    let written = String::from_utf8_lossy(rest);
    let path = reference::path(&written)?;
    match library.rsplit_once('/') {
        Some((folder, _)) => reference::path(&format!("{folder}/{path}")),
        None => Some(path),
    }
}

fn word(text: &[u8]) -> (&[u8], &[u8]) {
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    (&text[..end], text[end..].trim_ascii_start())
}

/// A material that is used but defined nowhere.
pub(super) fn undefined(name: &str) -> Material {
    Material { name: name.to_owned(), double_sided: true, ..Material::default() }
}

/// Reads all libraries into the scene; returns where each name is. A library that is missing costs a note.
///
/// # Errors
///
/// A number that is none, with its library and line.
pub(super) fn read_all(
    libraries: &[String],
    file: &str,
    files: &Files<'_>,
    scene: &mut Scene,
) -> Result<BTreeMap<String, usize>, Vec<Diagnostic>> {
    let mut names = BTreeMap::new();
    let mut images = Images::default();
    for library in libraries {
        match files.get(library) {
            Some(bytes) => {
                let shown = super::beside(file, library);
                let mut errors = Errors::new(&shown);
                self::library(library, bytes, scene, &mut images, &mut names, &mut errors);
                errors.check()?;
            }
            None => scene.notes.push(format!("materials are left out: {library} is missing")),
        }
    }
    Ok(names)
}

fn library(
    library: &str,
    bytes: &[u8],
    scene: &mut Scene,
    images: &mut Images,
    names: &mut BTreeMap<String, usize>,
    errors: &mut Errors<'_>,
) {
    let most = scene.materials.len() + 64 + bytes.len() / BYTES_EACH;
    let mut current: Option<usize> = None;
    let mut bump = None;
    for statement in Lines::of(bytes) {
        let word = statement.word.to_ascii_lowercase();
        if word == b"newmtl" {
            let name = statement.name();
            // The first of a name counts; the rest of a list that is too long is used as undefined.
            current = (!names.contains_key(&name) && scene.materials.len() < most).then(|| {
                scene.materials.push(undefined(&name));
                names.insert(name, scene.materials.len() - 1);
                scene.materials.len() - 1
            });
            bump = None;
            continue;
        }
        let Some(index) = current else { continue };
        let mut map = |scene: &mut Scene| picture(&statement, library).map(|name| images.index(name, scene));
        match &word[..] {
            b"map_kd" => scene.materials[index].color_image = map(scene),
            b"map_pr" => scene.materials[index].roughness_image = map(scene),
            b"map_d" | b"map_opacity" | b"map_tr" => {
                let image = map(scene);
                scene.materials[index].alpha_image = image;
            }
            b"norm" | b"map_kn" => {
                scene.materials[index].normal_image = map(scene);
                bump = Some(());
            }
            b"map_bump" | b"bump" if bump.is_none() => scene.materials[index].normal_image = map(scene),
            b"kd" | b"d" | b"tr" => factor(&statement, &word, &mut scene.materials[index], errors),
            _ => {}
        }
    }
    for material in &mut scene.materials {
        if material.color_image.is_some() {
            material.color = [1.0, 1.0, 1.0, material.color[3]];
        }
        material.alpha = match (material.alpha_image, material.color[3]) {
            (Some(_), _) => Alpha::Mask(0.5),
            (None, alpha) if alpha < 1.0 => Alpha::Blend,
            _ => Alpha::Opaque,
        };
    }
}

/// `Kd`, `d` and `Tr`.
fn factor(statement: &Statement<'_>, word: &[u8], material: &mut Material, errors: &mut Errors<'_>) {
    let mut values = [0.0; 3];
    let mut count = 0;
    for text in statement.words().filter(|w| *w != b"-halo").take(3) {
        // Spectral and CIE colours are left aside.
        if count == 0 && matches!(text, b"spectral" | b"xyz") {
            return;
        }
        let Some(value) = number(text) else {
            errors.add(statement.line, || format!("`{}` is not a finite number", shown(text)));
            return;
        };
        values[count] = (value as f32).clamp(0.0, 1.0);
        count += 1;
    }
    match (word, count) {
        (_, 0) => {}
        (b"kd", 1) => material.color = [values[0], values[0], values[0], material.color[3]],
        (b"kd", _) => material.color = [values[0], values[1], values[2], material.color[3]],
        (b"d", _) => material.color[3] = values[0],
        // Some exporters write both; an alpha that was stated stays.
        _ if material.color[3] == 1.0 => material.color[3] = 1.0 - values[0],
        _ => {}
    }
}

/// Pictures by name.
#[derive(Debug, Default)]
struct Images(BTreeMap<String, usize>);

impl Images {
    fn index(&mut self, name: String, scene: &mut Scene) -> usize {
        *self.0.entry(name).or_insert_with_key(|name| {
            scene.images.push(Image::File(name.clone()));
            scene.images.len() - 1
        })
    }
}
