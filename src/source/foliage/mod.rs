//! Wood and leaves told apart, and leaves brought to the plant that the wood became.
//!
//! 1. [`split`]: pieces of the mesh (`component`) are wood, leaves, fronds, crowns or dropped (`decide`, by names
//!    in `words` and colours in `tone`).
//! 2. `card`: every leaf becomes a flat card with base, direction, normal, length, width and the number of its picture;
//!    leaves that wear the same part of a picture, or have the same outline, share it.
//! 3. [`attach`]: each card is put on the nearest suitable chain of the plant; crowns are filled with chains and leaves.
//!
//! Decisions. Each sheet is one leaf: of two crossed quads each is a leaf of its own, so counts are those of the file and
//! the look stays. Two cards on top of each other, front and back of one leaf, are one. A leaf that is bent, folded or
//! cut out as a polygon becomes the flat card that fits it best, with the polygon drawn into its picture. Stalks of leaves
//! are dropped; the leaf keeps its place by its offset from the axis. Fruit and flowers are dropped and counted.

mod attach;
mod card;
mod component;
mod decide;
mod fill;
mod frond;
#[cfg(test)]
mod kinds;
mod near;
mod picture;
#[cfg(test)]
mod tests;
mod tone;
mod volume;
mod words;

use glam::Vec3;

use crate::base::counted;
use crate::preset::plan::UpAxis;
use crate::source::scene::{Files, Part, Scene};

pub use attach::attach;
pub use card::Card;
pub use picture::{Art, BarkPicture, CardCorner, CardPicture, LeafPicture};
pub(crate) use picture::{MANY_BARKS, NO_BARK};

use decide::{Piece, Role};

/// How the note on leaves begins that nothing colours; it is of no concern where other pictures are worn.
pub(crate) const WHITE: &str = "leaves have no picture that can be read, and are white";

/// The note on a mesh that is wood alone; who dresses it says in what.
pub(crate) const BARE: &str = "brings no leaves";
/// What the note on filled crowns says between what was done and which leaves they wear, of no concern where other leaves are.
pub(crate) const MADE_LEAVES: &str = ": made leaves, ";
/// What the note on leaves says that nothing maps their picture to; likewise.
pub(crate) const UNMAPPED: &str = "a picture and no texture coordinates (UVs)";

/// What a preset says about the parts of a mesh: names of materials or parts, whatever their capitals.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Overrides {
    /// Of leaves.
    pub leaves: Vec<String>,
    /// Of wood.
    pub wood: Vec<String>,
}

/// The names of `overrides` that no material and no part has.
#[must_use]
pub fn unmatched<'a>(scene: &Scene, overrides: &'a Overrides) -> Vec<&'a str> {
    let there = |wanted: &&str| {
        let same = |name: &str| name.to_lowercase() == wanted.to_lowercase();
        scene.materials.iter().any(|m| same(&m.name)) || scene.parts.iter().any(|p| same(&p.name))
    };
    overrides.leaves.iter().chain(&overrides.wood).map(String::as_str).filter(|name| !there(name)).collect()
}

/// A mesh, told apart; in the scene's own unit and axes.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// Corners of the wood.
    pub wood_positions: Vec<Vec3>,
    /// The wood's triangles.
    pub wood: Vec<[u32; 3]>,
    /// One a leaf.
    pub cards: Vec<Card>,
    /// Closed volumes to be filled with leaves.
    pub crowns: Vec<CrownVolume>,
    /// Lowest and highest corner of the box around wood, leaves and crowns.
    pub bounds: [Vec3; 2],
    /// Pictures of the leaves by slot, and of the bark.
    pub art: Art,
    /// What was dropped, joined or guessed, one sentence each.
    pub notes: Vec<String>,
}

/// A closed volume full of leaves.
#[derive(Clone, Debug, Default)]
pub struct CrownVolume {
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Triangles, from outside counter-clockwise where the file says so.
    pub triangles: Vec<[u32; 3]>,
    /// First of the slots that its leaves wear, and how many there are.
    pub slots: (u16, u16),
}

/// Tells wood, leaves and crowns of a mesh apart. `files` holds the pictures that the mesh names. n log n in triangles.
#[must_use]
pub fn split(scene: &Scene, files: &Files<'_>, overrides: &Overrides) -> Parts {
    let tones = tone::Tones::new(scene, files);
    let pieces = decide::pieces(scene, &tones, overrides);
    let mut parts = Parts::default();
    let count = |role| pieces.iter().filter(|p| p.role == role).count();
    for (role, one, many, rest) in [
        (Role::Stalk, "stalk of leaves was", "stalks of leaves were", "; their leaves keep their places"),
        (Role::Fruit, "flower or fruit was", "flowers or fruit were", ""),
        (Role::Patch, "flat piece painted on the bark was", "flat pieces painted on the bark were", ""),
        (Role::Ground, "piece of ground, or of a pot, was", "pieces of ground, or of a pot, were", ""),
    ] {
        let n = count(role);
        if n > 0 {
            parts.notes.push(format!("{} dropped{rest}", counted(n, one, many)));
        }
    }
    let crowns = count(Role::Crown);
    if crowns > 0 {
        let were = counted(crowns, "closed crown was", "closed crowns were");
        let filled = || pieces.iter().filter(|p| p.role == Role::Crown).map(|p| &scene.parts[p.component.part]);
        let leaf = match (filled().any(|part| !has_needles(scene, part)), filled().any(|part| has_needles(scene, part)))
        {
            (true, true) => "\"beech\" and \"pine\"",
            (_, false) => "\"beech\"",
            (false, true) => "\"pine\"",
        };
        let theirs = if crowns == 1 { "its colour" } else { "their colours" };
        parts.notes.push(format!(
            "{were} filled with branches and leaves{MADE_LEAVES}{leaf} in {theirs}; `foliage: (leaf: …)` names others"
        ));
    }
    let kept = pieces.iter().filter(|p| matches!(p.role, Role::Wood | Role::Leaf | Role::Frond | Role::Crown));
    let boxed = |[low, high]: [Vec3; 2], p: &Piece| [low.min(p.component.low), high.max(p.component.high)];
    parts.bounds = kept.fold([Vec3::MAX, Vec3::MIN], boxed);
    let mut gallery = picture::Gallery::new(scene, files);
    card::cards(scene, &tones, &pieces, &mut gallery, &mut parts);
    for piece in &pieces {
        let c = &piece.component;
        let part = &scene.parts[c.part];
        match piece.role {
            Role::Wood => {
                let first = parts.wood_positions.len() as u32;
                let (positions, triangles) = own(part, c);
                parts.wood_positions.extend(positions);
                parts.wood.extend(triangles.iter().map(|t| t.map(|i| i + first)));
            }
            Role::Crown => {
                let (positions, triangles) = own(part, c);
                let sum = c.corners.iter().fold(Vec3::ZERO, |sum, t| sum + tones.of_triangle(part, *t));
                let color = (sum / c.triangles.len() as f32).to_array();
                // Leaves shade each other, the lump of the file does not.
                let color = color.map(|c| (c * 1.3).min(1.0));
                let slots = spray_slots(&mut parts.art, color, has_needles(scene, part));
                parts.crowns.push(CrownVolume { positions, triangles, slots });
            }
            _ => {}
        }
    }
    if parts.wood.is_empty() && !parts.crowns.is_empty() {
        stem(scene.up.0, &mut parts);
    }
    if parts.art.leaves.iter().any(|leaf| matches!(leaf, LeafPicture::Card(card) if card.is_blank())) {
        let help = "name a leaf in the preset, `foliage: (leaf: \"oak\")`, or import a file with PNG or JPEG pictures";
        parts.notes.push(format!("{WHITE}; {help}"));
    }
    parts.art.bark = picture::bark(scene, &tones, &pieces, &mut gallery, &mut parts.notes);
    parts.art.images = gallery.images;
    parts
}

/// Where a made stem ends, as a share of the height of what it bears, and how thick it is, likewise.
const STEM: (f32, f32) = (0.75, 0.02);

/// Makes the stem of a bush that is nothing but crowns: upright, below the middle of them all, and hidden by them.
fn stem(up: UpAxis, parts: &mut Parts) {
    let points = || parts.crowns.iter().flat_map(|crown| &crown.positions).copied();
    let (low, high) = points().fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let (up, x, z) = if up == UpAxis::Z { (Vec3::Z, Vec3::X, Vec3::Y) } else { (Vec3::Y, Vec3::Z, Vec3::X) };
    let height = (high - low).dot(up);
    let middle = (low + high) * 0.5;
    let foot = middle - up * (middle - low).dot(up);
    let (rings, sides) = (5_u32, 8_u32);
    for ring in 0..rings {
        let share = ring as f32 / (rings - 1) as f32;
        for side in 0..sides {
            let (sin, cos) = crate::base::math::sin_cos(side as f32 * std::f32::consts::TAU / sides as f32);
            let radius = height * STEM.1 * (1.0 - 0.8 * share);
            parts.wood_positions.push(foot + up * (height * STEM.0 * share) + (x * cos + z * sin) * radius);
        }
    }
    for ring in 0..rings - 1 {
        for side in 0..sides {
            let (a, b) = (ring * sides + side, ring * sides + (side + 1) % sides);
            parts.wood.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
        }
    }
    parts.notes.push("the mesh has no wood: a thin stem was made inside its crown, as of a bush".to_owned());
}

/// Whether a part is called as conifers are, or its material is.
fn has_needles(scene: &Scene, part: &Part) -> bool {
    let material = part.material.and_then(|m| scene.materials.get(m)).map_or("", |m| m.name.as_str());
    [part.name.as_str(), material].iter().any(|name| words::is_conifer(name))
}

/// Pictures of sprays that fill one crown.
const SPRAYS: u16 = 3;
/// Most pictures of a plant, so that crowns of all colours of the rainbow fit an atlas.
const MOST_SLOTS: usize = 64;

/// The slots of sprays of a colour, made if there are none that are alike.
fn spray_slots(art: &mut Art, color: [f32; 3], needles: bool) -> (u16, u16) {
    let gap = |leaf: &LeafPicture| match leaf {
        LeafPicture::Spray { color: other, needles: same } if *same == needles => {
            Some(color.iter().zip(other).fold(0.0_f32, |gap, (a, b)| gap.max((a - b).abs())))
        }
        _ => None,
    };
    let found = art.leaves.iter().map(gap).enumerate().filter_map(|(i, gap)| Some((gap?, i)));
    if let Some((gap, i)) = found.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        && (gap < 0.02 || art.leaves.len() >= MOST_SLOTS)
    {
        return (i as u16, SPRAYS);
    }
    let first = art.leaves.len() as u16;
    art.leaves.extend((0..SPRAYS).map(|_| LeafPicture::Spray { color, needles }));
    (first, SPRAYS)
}

/// A piece's own positions and triangles.
fn own(part: &Part, c: &component::Component) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut order: Vec<(u32, u32)> = c.points.iter().enumerate().map(|(k, &i)| (i, k as u32)).collect();
    order.sort_unstable();
    let find = |i: u32| order.binary_search_by_key(&i, |o| o.0).map_or(0, |k| order[k].1);
    let positions = c.points.iter().map(|&i| part.positions[i as usize]).collect();
    (positions, c.triangles.iter().map(|t| t.map(find)).collect())
}

/// Most points of [`sample`] beyond the corners of the triangles.
const MOST_SAMPLES: usize = 400_000;

/// Points over the surface of all pieces of some roles, about as far apart as a hundredth of what they span; further
/// where that would be too many.
fn sample(scene: &Scene, pieces: &[Piece], roles: &[Role]) -> Vec<Vec3> {
    let wanted = || pieces.iter().filter(|p| roles.contains(&p.role)).map(|p| &p.component);
    let (low, high) = wanted().fold((Vec3::MAX, Vec3::MIN), |(low, high), c| (low.min(c.low), high.max(c.high)));
    let area: f32 = wanted().map(|c| c.area).sum();
    // Corners of a triangle's grid: so many along its longest edge, so many across.
    let grid = |positions: &[Vec3], t: &[u32; 3], gap: f32| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let across = (b - a).cross(c - a).length() / longest.max(1e-30);
        [longest, across].map(|side| ((side / gap).ceil().min(200.0) as usize).max(1))
    };
    let mut gap = ((high - low).max_element() * 0.01).max((area / 3e5).sqrt()).max(1e-30);
    let mut fits = false;
    for _ in 0..24 {
        let all: usize = wanted()
            .flat_map(|c| c.triangles.iter().map(|t| (&scene.parts[c.part].positions, t)))
            .map(|(positions, t)| {
                let [along, across] = grid(positions, t, gap);
                along * across - 1
            })
            .sum();
        fits = gap.is_finite() && all <= MOST_SAMPLES;
        if fits {
            break;
        }
        gap *= 1.6;
    }
    let mut points = Vec::new();
    for c in wanted() {
        let positions = &scene.parts[c.part].positions;
        points.extend(c.points.iter().map(|&i| positions[i as usize]));
        // Lengths beyond all bounds: the corners must do.
        for t in c.triangles.iter().filter(|_| fits) {
            let [along, across] = grid(positions, t, gap);
            let mut t = *t;
            // Its longest edge first.
            let edge = |t: &[u32; 3]| positions[t[0] as usize].distance(positions[t[1] as usize]);
            let turned = |k: usize| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            t = (1..3).map(turned).fold(t, |best, next| if edge(&next) > edge(&best) { next } else { best });
            let [a, b, c] = t.map(|i| positions[i as usize]);
            for j in 0..across {
                let v = j as f32 / across as f32;
                for i in 0..along {
                    let u = (i as f32 + 0.5) / along as f32 * (1.0 - v);
                    if along * across > 1 {
                        points.push(a + (b - a) * u + (c - a) * v);
                    }
                }
            }
        }
    }
    points
}
