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
/// Least width of the ground, as a share of the scene's size, and of what is as green as a leaf, as a share of the scene's
/// own width.
const WIDE: f32 = 0.2;
const LAWN: f32 = 0.7;
/// Least thickness of a bush, as a share of its length.
const ROUND: f32 = 0.4;
/// Fewest triangles of a frond.
const FEWEST: usize = 6;
/// How thick a slab of ground may be, as a share of its width.
const SLAB: f32 = 0.1;
/// How much wider a lump without a colour is than the stem below it, if it is a crown.
const WIDER: f32 = 1.3;

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
    /// Its material is see-through.
    through: bool,
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
        return Said { hint: Some(Hint::Leaf), firm: true, faint: false, through: false };
    }
    if named(&overrides.wood) {
        return Said { hint: Some(Hint::Wood), firm: true, faint: false, through: false };
    }
    let by_name = hint(name).or_else(|| hint(&part.name)).or_else(|| hint(picture));
    let see_through = material.is_some_and(|m| m.alpha != Alpha::Opaque || m.alpha_image.is_some());
    let by_look = see_through.then_some(Hint::Leaf);
    Said { hint: by_name.or(by_look), firm: false, faint: by_name.is_none(), through: see_through }
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
    // Where all is called a pot, it is a plant's in one; where all is called berries, a bush with some.
    let only = |hint| scene.parts.iter().all(|part| said(scene, part, overrides).hint == Some(hint));
    let whole = [Hint::Ground, Hint::Fruit].map(|hint| (hint, only(hint)));
    for (index, part) in scene.parts.iter().enumerate() {
        let mut said = said(scene, part, overrides);
        let material = part.material.and_then(|m| scene.materials.get(m)).map_or("", |m| m.name.as_str());
        let by_material = hint(material);
        said.hint = said.hint.filter(|&hint| !whole.contains(&(hint, true)) || by_material == Some(Hint::Fruit));
        for component in components(part, index) {
            match said.hint {
                Some(Hint::Leaf) if said.faint && is_stem(part, &component, tones) => {
                    found.push(Piece { component, role: Role::Wood });
                }
                Some(Hint::Wood) if said.through && !said.firm && component.is_sheet() => {
                    // "branch": a picture of one, with its leaves.
                    let role = sheet_role(&component, size);
                    found.push(Piece { component, role });
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
        let role = if is_floor(&component, low, high, green) {
            Role::Ground
        } else if green && component.is_open_tube() {
            // A culm of bamboo, a green shoot.
            Role::Wood
        } else if green && is_cap(&component, size) {
            Role::Crown
        } else if component.is_sheet() || component.is_board() || ((green || !colored) && component.is_blade()) {
            sheet_role(&component, size)
        } else if green && (compact || component.length() < 0.5 * size) {
            if compact && component.length() > 0.08 * size { Role::Crown } else { sheet_role(&component, size) }
        } else {
            if !colored && is_lump(&component, size) {
                doubtful.push(found.len());
            }
            Role::Wood
        };
        found.push(Piece { component, role });
    }
    crowns_without_color(&mut found, &doubtful, size);
    patches(scene, &mut found, named);
    ensure_wood(&mut found, size);
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
            } else if component.is_sheet() || component.is_blade() || component.is_board() {
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
        && component.corners.iter().filter(green).count() * 2 < component.triangles.len()
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

/// A wide flat sheet or slab, level in the file's axes, under all that there is between the corners `low` and `high`: the
/// ground that a tree was shown on. A green one may be a leaf, unless it is about as wide as all else.
fn is_floor(component: &Component, low: Vec3, high: Vec3, green: bool) -> bool {
    let [long, middle, short] = component.extents;
    let size = (high - low).max_element();
    // Of the axes that may point up each.
    let under = |axis: usize, bottom: f32| {
        let others = [(axis + 1) % 3, (axis + 2) % 3];
        let across = others.map(|k| component.high[k] - component.low[k]);
        let is_lawn = others.iter().zip(across).all(|(&k, side)| side >= LAWN * (high[k] - low[k]));
        component.normal[axis].abs() > LEVEL
            && (component.low[axis] - bottom).abs() < FLOOR * size
            && component.high[axis] - component.low[axis] < SLAB * long
            && (high[axis] - low[axis]) > across[0].min(across[1]) * 0.5
            && (!green || is_lawn)
    };
    let is_flat = component.facing > LEVEL && short < FLOOR * long;
    let is_slab = component.open == 0 && component.sheet > 0.8 && short < SLAB * long;
    (is_flat || is_slab) && long > WIDE * size && middle > 0.5 * long && (under(1, low.y) || under(2, low.z))
}

/// A leaf, or a frond where it is long, bent and made of more than a few triangles, or much bent.
fn sheet_role(component: &Component, size: f32) -> Role {
    let long = component.length() > 0.18 * size;
    // Few triangles are a leaf that is folded, unless they turn as far as a frond does.
    let bent = component.extents[2] > if component.triangles.len() >= 12 { 0.06 } else { 0.15 } * component.length();
    if long && bent && component.triangles.len() >= FEWEST { Role::Frond } else { Role::Leaf }
}

/// A piece, cut in two where both colours have a share of it; each with whether it is green.
fn by_color(part: &Part, component: Component, tones: &Tones<'_>) -> Vec<(Component, bool)> {
    if !tones.is_colored(part) {
        return vec![(component, false)];
    }
    let green: Vec<bool> = component.corners.iter().map(|t| is_green(tones.of_triangle(part, *t))).collect();
    let share = green.iter().filter(|g| **g).count() as f32 / green.len() as f32;
    if !(0.08..=0.92).contains(&share) || component.is_sheet() {
        return vec![(component, share > 0.5)];
    }
    let mut cut = Vec::new();
    for wanted in [false, true] {
        let keep = |list: &[[u32; 3]]| -> Vec<[u32; 3]> {
            list.iter().zip(&green).filter(|(_, g)| **g == wanted).map(|(t, _)| *t).collect()
        };
        let pieces = connected(part, component.part, &keep(&component.triangles), &keep(&component.corners));
        cut.extend(pieces.into_iter().map(|c| (c, wanted)));
    }
    cut
}

/// Something round and thick, closed or open on one side: a ball, a cone, a box.
fn is_lump(component: &Component, size: f32) -> bool {
    let [long, middle, short] = component.extents;
    let is_round = short > 0.25 * long && (component.sheet < 0.68 || middle > 0.5 * long);
    let is_closed = component.open * 8 <= component.triangles.len() || (component.open > 0 && is_cap_like(component));
    is_round && is_closed && component.length() > 0.08 * size
}

/// Open along one rim only, of not much more than a third of its triangles, as a cone without its floor is.
fn is_cap_like(component: &Component) -> bool {
    component.open * 5 <= component.triangles.len() * 2 && component.extents[1] > 0.5 * component.extents[0]
}

/// In a scene without colours: a lump that stands clear of the ground is a crown, if something thinner does not. Of stacked
/// pieces of one trunk none is that much wider than the lowest.
fn crowns_without_color(found: &mut [Piece], doubtful: &[usize], size: f32) {
    let low = found.iter().map(|p| p.component.low).fold(Vec3::MAX, Vec3::min);
    let grounded = |c: &Component| (c.low - low).min_element() <= 0.02 * size;
    let thickness = |c: &Component| (c.area / (std::f32::consts::PI * c.length())).min(c.extents[1]);
    let wood = |p: &&Piece| p.role == Role::Wood;
    let lowest = found.iter().filter(wood).map(|p| p.component.low.y).fold(f32::MAX, f32::min);
    let crowns: Vec<usize> = doubtful
        .iter()
        .copied()
        .filter(|&i| {
            let lump = &found[i].component;
            let stands = |c: &Component| c.low.y < lump.low.y && grounded(c) && lump.extents[1] > WIDER * thickness(c);
            let is_stem = |k: usize, p: &Piece| !doubtful.contains(&k) || p.component.low.y <= lowest;
            found.iter().enumerate().any(|(k, p)| k != i && wood(&p) && is_stem(k, p) && stands(&p.component))
        })
        .collect();
    for i in crowns {
        found[i].role = Role::Crown;
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

/// Where nothing is wood, the largest piece that is no leaf is; unless it is as round as a bush, which is all crown.
fn ensure_wood(found: &mut [Piece], size: f32) {
    if found.is_empty() || found.iter().any(|p| p.role == Role::Wood) {
        return;
    }
    let of = |role| found.iter().filter(move |p| p.role == role).map(|p| &p.component);
    let bulk = of(Role::Crown).max_by(|a, b| a.area.total_cmp(&b.area));
    if bulk.is_some_and(|c| c.extents[2] > ROUND * c.length() && c.length() > 0.3 * size) {
        return;
    }
    let lump = |p: &&mut Piece| matches!(p.role, Role::Crown | Role::Frond | Role::Stalk | Role::Ground);
    if let Some(piece) = found.iter_mut().filter(lump).max_by(|a, b| a.component.area.total_cmp(&b.component.area)) {
        piece.role = Role::Wood;
    }
}
