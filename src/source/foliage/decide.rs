//! What each piece of a mesh is: wood, leaf, crown or something to leave out.
//!
//! In this order: what the preset says; names (of the material, the part, the picture); transparency; then form and colour.
//! A piece of which a part is green and a part is not (a low tree of one skin that wears one palette) is cut in two
//! by the colour of its triangles.

use glam::Vec3;

use super::component::{Component, components, connected};
use super::near::Near;
use super::tone::{Tones, is_green};
use super::words::{Hint, hint};
use super::{Overrides, sample};
use crate::source::scene::{Alpha, Image, Part, Scene};

/// What a piece is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    /// Trunk and branches.
    Wood,
    /// A leaf, or a card with several.
    Leaf,
    /// A long bent sheet, such as the frond of a palm.
    Frond,
    /// A closed volume full of leaves.
    Crown,
    /// A stalk of a leaf.
    Stalk,
    /// Flower or fruit.
    Fruit,
    /// A flat piece painted on the bark.
    Patch,
    /// What the tree stands in or on: a disc of ground, a pot.
    Ground,
}

/// Cosine with the way up from which a sheet is level, and the share of its area that faces one way.
const LEVEL: f32 = 0.98;
/// How thick the ground may be, as a share of its width, and how far above the lowest place, of the scene's size.
const FLOOR: f32 = 0.02;
/// Least width of the ground, as a share of the scene's size.
const WIDE: f32 = 0.2;

/// A piece and what it is.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// The piece.
    pub(super) component: Component,
    /// What it is.
    pub(super) role: Role,
}

/// What a part is by its names, the preset and transparency.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Said {
    hint: Option<Hint>,
    /// The preset said so.
    firm: bool,
    /// Nothing but transparency says so: wood may wear another corner of the same picture.
    faint: bool,
}

fn said(scene: &Scene, part: &Part, overrides: &Overrides) -> Said {
    let material = part.material.and_then(|m| scene.materials.get(m));
    let name = material.map_or("", |m| m.name.as_str());
    let picture = match material.and_then(|m| scene.images.get(m.color_image?)) {
        Some(Image::File(file)) => file.as_str(),
        _ => "",
    };
    let named = |list: &[String]| {
        list.iter().any(|wanted| {
            let wanted = wanted.to_lowercase();
            !wanted.is_empty() && [name, part.name.as_str()].iter().any(|n| n.to_lowercase() == wanted)
        })
    };
    if named(&overrides.leaves) {
        return Said { hint: Some(Hint::Leaf), firm: true, faint: false };
    }
    if named(&overrides.wood) {
        return Said { hint: Some(Hint::Wood), firm: true, faint: false };
    }
    let by_name = hint(name).or_else(|| hint(&part.name)).or_else(|| hint(picture));
    let see_through = material.is_some_and(|m| m.alpha != Alpha::Opaque || m.alpha_image.is_some());
    Said { hint: by_name.or(see_through.then_some(Hint::Leaf)), firm: false, faint: by_name.is_none() }
}

/// All pieces of a scene, in the order of its parts.
pub(super) fn pieces(scene: &Scene, tones: &Tones<'_>, overrides: &Overrides) -> Vec<Piece> {
    let (low, high) = scene
        .parts
        .iter()
        .flat_map(|part| part.triangles.iter().flatten().map(|&i| part.positions[i as usize]))
        .fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let size = (high - low).max_element();
    let mut found: Vec<Piece> = Vec::new();
    let mut open: Vec<(Component, bool)> = Vec::new();
    // Where all is called a pot, it is a plant's in one.
    let is_ground = |part: &Part| said(scene, part, overrides).hint == Some(Hint::Ground);
    let only_ground = scene.parts.iter().all(is_ground);
    for (index, part) in scene.parts.iter().enumerate() {
        let mut said = said(scene, part, overrides);
        said.hint = said.hint.filter(|&hint| hint != Hint::Ground || !only_ground);
        for component in components(part, index) {
            match said.hint {
                Some(Hint::Leaf) if said.faint && is_stem(part, &component, tones) => {
                    found.push(Piece { component, role: Role::Wood });
                }
                Some(hint) => {
                    let role = by_hint(hint, &component, size, said.firm);
                    found.push(Piece { component, role });
                }
                None => {
                    for (piece, green) in by_color(part, component, tones) {
                        open.push((piece, green));
                    }
                }
            }
        }
    }
    let named = found.len();
    // What has no name: sheets and green lumps are foliage, all else is wood.
    let colored = scene.parts.iter().any(|part| tones.is_colored(part));
    let mut doubtful = Vec::new();
    for (component, green) in open {
        let compact = component.extents[2] > 0.3 * component.extents[0];
        let role = if !green && is_floor(&component, low, high) {
            Role::Ground
        } else if green && is_cap(&component, size) {
            Role::Crown
        } else if component.is_sheet() || ((green || !colored) && component.is_blade()) {
            sheet_role(&component, size)
        } else if green && (compact || component.length() < 0.5 * size) {
            if compact && component.length() > 0.08 * size { Role::Crown } else { sheet_role(&component, size) }
        } else if !colored && compact && component.open == 0 && component.length() > 0.25 * size {
            doubtful.push(found.len());
            Role::Wood
        } else {
            Role::Wood
        };
        found.push(Piece { component, role });
    }
    crowns_without_color(&mut found, &doubtful, size);
    patches(scene, &mut found, named);
    ensure_wood(&mut found);
    found.sort_by_key(|piece| piece.component.part);
    found
}

fn by_hint(hint: Hint, component: &Component, size: f32, firm: bool) -> Role {
    match hint {
        Hint::Wood => Role::Wood,
        Hint::Stalk => Role::Stalk,
        Hint::Fruit => Role::Fruit,
        Hint::Ground => Role::Ground,
        Hint::Leaf => {
            let compact = component.extents[2] > 0.2 * component.extents[0];
            if is_cap(component, size) {
                Role::Crown
            } else if component.is_sheet() || component.is_blade() {
                sheet_role(component, size)
            } else if compact && component.length() > 0.08 * size {
                Role::Crown
            } else if !firm && !compact && component.extents[1] < 0.15 * component.length() {
                Role::Stalk
            } else {
                Role::Leaf
            }
        }
    }
}

/// Longer than wide, round and not green: wood, though its material is cut out by alpha for leaves on the same picture.
fn is_stem(part: &Part, component: &Component, tones: &Tones<'_>) -> bool {
    let [long, middle, _] = component.extents;
    let green = |t: &&[u32; 3]| is_green(tones.of_triangle(part, **t));
    middle < 0.5 * long
        && component.triangles.len() >= 6
        && !component.is_sheet()
        && component.triangles.iter().filter(green).count() * 2 < component.triangles.len()
}

/// A wide cone or dome without its floor: it faces one way as a sheet does, but is round and deep.
fn is_cap(component: &Component, size: f32) -> bool {
    let [long, middle, short] = component.extents;
    component.triangles.len() >= 8
        && long > 0.12 * size
        && middle > 0.7 * long
        && short > 0.12 * long
        && component.facing < 0.95
}

/// A wide flat sheet, level in the file's axes, under all that there is between the corners `low` and `high`: the ground that
/// a tree was shown on.
fn is_floor(component: &Component, low: Vec3, high: Vec3) -> bool {
    let [long, middle, short] = component.extents;
    let size = (high - low).max_element();
    // Of the axes that may point up each.
    let under = |axis: usize, bottom: f32| {
        let across = [(axis + 1) % 3, (axis + 2) % 3].map(|k| component.high[k] - component.low[k]);
        component.normal[axis].abs() > LEVEL
            && (component.centre[axis] - bottom).abs() < FLOOR * size
            && (high[axis] - low[axis]) > across[0].min(across[1]) * 0.5
    };
    component.facing > LEVEL
        && long > WIDE * size
        && middle > 0.5 * long
        && short < FLOOR * long
        && (under(1, low.y) || under(2, low.z))
}

/// A leaf, or a frond where it is long, bent and made of more than a few triangles.
fn sheet_role(component: &Component, size: f32) -> Role {
    let long = component.length() > 0.18 * size && component.triangles.len() >= 12;
    let bent = component.extents[2] > 0.06 * component.length();
    if long && bent { Role::Frond } else { Role::Leaf }
}

/// A piece, cut in two where both colours have a share of it; each with whether it is green.
fn by_color(part: &Part, component: Component, tones: &Tones<'_>) -> Vec<(Component, bool)> {
    if !tones.is_colored(part) {
        return vec![(component, false)];
    }
    let green: Vec<bool> = component.triangles.iter().map(|t| is_green(tones.of_triangle(part, *t))).collect();
    let share = green.iter().filter(|g| **g).count() as f32 / green.len() as f32;
    if !(0.08..=0.92).contains(&share) || component.is_sheet() {
        return vec![(component, share > 0.5)];
    }
    let mut cut = Vec::new();
    for wanted in [false, true] {
        let keep = component.triangles.iter().zip(&green).filter(|(_, g)| **g == wanted).map(|(t, _)| *t);
        let keep: Vec<[u32; 3]> = keep.collect();
        cut.extend(connected(part, component.part, &keep).into_iter().map(|c| (c, wanted)));
    }
    cut
}

/// In a scene without colours: a closed lump that stands clear of the ground is a crown, if something else does not.
fn crowns_without_color(found: &mut [Piece], doubtful: &[usize], size: f32) {
    let low = found.iter().map(|p| p.component.low).fold(Vec3::MAX, Vec3::min);
    let grounded = |c: &Component| (c.low - low).min_element() <= 0.02 * size;
    for &i in doubtful {
        let lump = &found[i].component;
        let stands = |p: &Piece| p.role == Role::Wood && p.component.low.y < lump.low.y && grounded(&p.component);
        if found.iter().enumerate().any(|(k, p)| k != i && !doubtful.contains(&k) && stands(p)) {
            found[i].role = Role::Crown;
        }
    }
}

/// Flat pieces of few triangles that hug the wood all over are paint on it.
/// Only pieces without a name, which come after the first `named`, are asked: leaves may lie on the bark, too.
fn patches(scene: &Scene, found: &mut [Piece], named: usize) {
    let few = |p: &Piece| p.role == Role::Leaf && p.component.triangles.len() <= 4;
    if !found[named..].iter().any(few) || !found.iter().any(|p| p.role == Role::Wood) {
        return;
    }
    let near = Near::new(sample(scene, found, &[Role::Wood]).into_iter());
    for piece in &mut found[named..] {
        if !few(piece) {
            continue;
        }
        let c = &piece.component;
        let at = |i: &u32| scene.parts[c.part].positions[*i as usize];
        let far = c.points.iter().map(at).chain([c.centre]).filter_map(|p| near.find(p)).map(|(_, d)| d);
        if far.fold(0.0, f32::max) < 0.2 * c.length() {
            piece.role = Role::Patch;
        }
    }
}

/// Where nothing is wood, what reaches the lowest point and is no leaf is; or else the largest piece.
fn ensure_wood(found: &mut [Piece]) {
    if found.is_empty() || found.iter().any(|p| p.role == Role::Wood) {
        return;
    }
    let lump = |p: &&mut Piece| matches!(p.role, Role::Crown | Role::Frond | Role::Stalk | Role::Ground);
    if let Some(piece) = found.iter_mut().filter(lump).max_by(|a, b| a.component.area.total_cmp(&b.component.area)) {
        piece.role = Role::Wood;
    }
}
