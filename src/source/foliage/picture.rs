//! What imported leaves and bark look like: pictures still encoded, and which part of them a card shows.
//!
//! Nothing is drawn here: `bake::card_maps` makes the maps.

use glam::{Vec2, Vec3};

use super::decide::{Piece, Role};
use super::tone::Tones;
use crate::source::scene::{Alpha, Files, Scene, Transmission};

/// How the notes begin that a bark's picture can't be worn, and that there are several: of no concern where another bark is.
pub(crate) const NO_BARK: &str = "the bark's picture is not used";
pub(crate) const MANY_BARKS: &str = "the wood has";

/// The pictures of an imported plant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Art {
    /// Encoded pictures that leaves and bark name by index.
    pub images: Vec<Vec<u8>>,
    /// One for each slot.
    pub leaves: Vec<LeafPicture>,
    /// Of the wood; none where the plant brings no colour of its own.
    pub bark: Option<BarkPicture>,
}

/// What the leaves of a slot wear.
#[derive(Clone, Debug, PartialEq)]
pub enum LeafPicture {
    /// Part of a picture, or a coloured outline.
    Card(CardPicture),
    /// A made spray of leaves: what fills a closed crown.
    Spray {
        /// Linear.
        color: [f32; 3],
        /// Whether they are needles.
        needles: bool,
    },
}

/// Triangles in a card, each with its part of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct CardPicture {
    /// Width over height of the card.
    pub width: f32,
    /// Three corners a triangle.
    pub triangles: Vec<[CardCorner; 3]>,
    /// Linear factor of colour and alpha.
    pub color: [f32; 4],
    /// Index of the colour picture.
    pub image: Option<usize>,
    /// Index of the normal map.
    pub normal: Option<usize>,
    /// Index of a picture whose green is the roughness.
    pub roughness: Option<usize>,
    /// Index of a picture whose alpha, or where it has none whose brightness, is the alpha.
    pub alpha: Option<usize>,
    /// What the leaf lets through, its picture by index; none where the file doesn't say.
    pub transmission: Option<Transmission>,
    /// Alpha below which nothing is seen.
    pub cutoff: f32,
}

impl CardPicture {
    /// Whether nothing in the file colours it: no picture that can be read, no factor, no colours of corners.
    pub(super) fn is_blank(&self) -> bool {
        let is_white = |color: &[f32]| color.iter().all(|c| *c > 0.98);
        self.image.is_none() && is_white(&self.color) && self.triangles.iter().flatten().all(|c| is_white(&c.color))
    }
}

/// A corner of a triangle in a card.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CardCorner {
    /// Place in the card: x 0..=1 to the right, y 0..=1 down; the base is at the bottom.
    pub at: Vec2,
    /// Place in the pictures, v down; repeats beyond 0..=1.
    pub uv: Vec2,
    /// Linear colour, a factor.
    pub color: [f32; 3],
}

/// What the wood wears.
#[derive(Clone, Debug, PartialEq)]
pub struct BarkPicture {
    /// Linear factor of the colour.
    pub color: [f32; 3],
    /// Index of the colour picture, where it tiles.
    pub image: Option<usize>,
    /// Index of the normal map.
    pub normal: Option<usize>,
    /// Index of a picture whose green is the roughness.
    pub roughness: Option<usize>,
}

/// The pictures of a scene that are worn, each once.
#[derive(Debug)]
pub(super) struct Gallery<'a> {
    scene: &'a Scene,
    files: &'a Files<'a>,
    /// Those taken, as they are encoded.
    pub(super) images: Vec<Vec<u8>>,
    /// Index in the scene, and where it is here.
    known: Vec<(usize, Option<usize>)>,
}

impl<'a> Gallery<'a> {
    pub(super) fn new(scene: &'a Scene, files: &'a Files<'a>) -> Self {
        Self { scene, files, images: Vec::new(), known: Vec::new() }
    }

    /// The index of a scene's picture here; none where its file is missing.
    pub(super) fn add(&mut self, image: Option<usize>) -> Option<usize> {
        let image = image?;
        if let Some((_, index)) = self.known.iter().find(|(i, _)| *i == image) {
            return *index;
        }
        let index = self.scene.image_bytes(image, self.files).map(|bytes| {
            self.images.push(bytes.to_vec());
            self.images.len() - 1
        });
        self.known.push((image, index));
        index
    }
}

/// The bark: of the material that most of the wood wears, and what there is to say of it. Its picture only where it is more
/// than a few texels of a palette on the wood, and shows nothing but bark.
pub(super) fn bark(
    scene: &Scene,
    tones: &Tones<'_>,
    pieces: &[Piece],
    gallery: &mut Gallery<'_>,
    notes: &mut Vec<String>,
) -> Option<BarkPicture> {
    let wood = || pieces.iter().filter(|p| p.role == Role::Wood).map(|p| &p.component);
    let mut areas: Vec<(Option<usize>, f32)> = Vec::new();
    for c in wood() {
        let material = scene.parts[c.part].material;
        match areas.iter_mut().find(|(m, _)| *m == material) {
            Some((_, area)) => *area += c.area,
            None => areas.push((material, c.area)),
        }
    }
    let (material, _) = *areas.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let of = || wood().filter(|c| scene.parts[c.part].material == material);
    if !of().any(|c| tones.is_colored(&scene.parts[c.part])) {
        return None;
    }
    // How much of the picture the wood spans, by the mean span of its triangles' coordinates.
    let (mut spread, mut low, mut high, mut sum, mut area) = (0.0_f32, Vec2::MAX, Vec2::MIN, Vec3::ZERO, 0.0_f32);
    let mut is_mapped = false;
    for c in of() {
        let part = &scene.parts[c.part];
        for t in &c.corners {
            for &i in t.iter().filter(|_| !part.uvs.is_empty()) {
                let uv = part.uvs[i as usize];
                (low, high) = (low.min(uv), high.max(uv));
            }
            if !part.uvs.is_empty() {
                let [a, b, c] = t.map(|i| part.uvs[i as usize]);
                spread += (a.max(b).max(c) - a.min(b).min(c)).max_element();
                is_mapped = true;
            }
            sum += tones.of_triangle(part, *t);
            area += 1.0;
        }
    }
    let described = material.and_then(|m| scene.materials.get(m));
    // A palette is touched in spots. A picture of the bark is spread over each triangle, and repeats or fills its picture, or
    // is bark all over: then a strip of it, wrapped round each piece of a branch, stands for all.
    let size = (high - low).abs();
    let is_spread = is_mapped && spread / area.max(1.0) > 0.02;
    // Where leaves wear the same picture it shows them, too. Wood that is coloured otherwise than the picture on the whole wears
    // islands of an unwrapped mesh, and repeated it would show what lies between them.
    let image_of = |m: Option<usize>| m.and_then(|m| scene.materials.get(m))?.color_image;
    let is_foliage = |p: &Piece| matches!(p.role, Role::Leaf | Role::Frond | Role::Crown);
    let shares = |p: &Piece| {
        let theirs = image_of(scene.parts[p.component.part].material);
        is_foliage(p) && theirs.is_some() && theirs == image_of(material)
    };
    let is_like = material.is_none_or(|m| tones.is_like(m, sum / area.max(1.0)));
    let fills = size.max_element() > 1.05 || (size.min_element() >= 0.4 && is_like);
    let is_bark = (fills || material.is_some_and(|m| tones.is_even(m))) && !pieces.iter().any(shares);
    let opaque = described.is_none_or(|m| m.alpha == Alpha::Opaque);
    let image = described.filter(|_| is_spread && is_bark && opaque).and_then(|m| gallery.add(m.color_image));
    let normal = described.filter(|_| image.is_some()).and_then(|m| gallery.add(m.normal_image));
    let roughness = described.filter(|_| image.is_some()).and_then(|m| gallery.add(m.roughness_image));
    let color = match (image, described) {
        (Some(_), Some(m)) => [m.color[0], m.color[1], m.color[2]],
        _ => (sum / area.max(1.0)).to_array(),
    };
    let has_picture = described.and_then(|m| scene.image_bytes(m.color_image?, gallery.files)).is_some();
    let why = match (is_mapped, opaque, is_spread, is_bark) {
        (false, ..) => Some("the wood has no texture coordinates (UVs)"),
        (_, false, ..) => Some("its material is see-through, as that of leaves is"),
        (.., true, false) => Some("the wood wears a part of it, and the rest shows something else"),
        _ => None,
    };
    if let Some(why) = why.filter(|_| has_picture) {
        let named = described.map_or("", |m| m.name.as_str());
        notes.push(format!(
            "{NO_BARK}: {why}; a plain bark is made in its mean colour (material \"{named}\"). \
             `bark: (texture: Files(color: \"…\"))` names a picture of bark alone"
        ));
    }
    let mut barks: Vec<usize> =
        areas.iter().filter_map(|(m, _)| m.and_then(|m| scene.materials.get(m))?.color_image).collect();
    barks.sort_unstable();
    barks.dedup();
    if barks.len() > 1 && image.is_some() {
        let (named, count) = (described.map_or("", |m| m.name.as_str()), barks.len());
        notes.push(format!("{MANY_BARKS} {count} barks: all of it wears that of \"{named}\", of which there is most"));
    }
    Some(BarkPicture { color, image, normal, roughness })
}
