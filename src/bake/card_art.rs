//! The pictures of imported leaves and bark: what a mesh's leaf cards show, each in a picture of its own.
//!
//! A card's triangles are drawn flat into the picture, each with its part of the mesh's texture, whatever way round that
//! lies there; a window of a texture comes out texel for texel. Where there is no texture the triangles' colours fill the
//! outline. Normal maps are turned with the texture; where there is none, the relief that luminance suggests takes its
//! place, as for the user's own pictures.
//!
//! Limits: pictures are at most [`LARGEST`] pixels an edge; a texture that can't be decoded is white, with a note.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::dilate::{clean, keep_mean};
use super::leaf_art::{encode_normal, leaf_maps};
use super::resample::resample;
use super::srgb::{decode as linear, encode as srgb};
use super::transmission::USUAL;
use super::user_art::{ArtFile, ArtLimits, ArtUse, decode, normals_of};
use super::{Maps, bark_maps, dilate};
use crate::base::Seed;
use crate::preset::plan::{BarkPattern, LeafShape};
use crate::source::foliage::{Art, CardPicture, LeafPicture};

/// Longest edge of a leaf's picture, and of a bark's, pixels.
const LARGEST: u32 = 512;
const LARGEST_BARK: u32 = 1024;
/// Edge of the picture of an outline without a texture.
const PLAIN: u32 = 160;
/// Samples along a pixel's edge.
const SAMPLES: usize = 2;
/// Roughness of a leaf.
const ROUGH: u8 = 148;

/// A decoded texture: colour with alpha as encoded, or a normal map.
struct Texture {
    width: u32,
    height: u32,
    texels: Vec<[u8; 4]>,
}

impl Texture {
    /// Nearest texel; repeats.
    fn at(&self, uv: Vec2) -> [u8; 4] {
        let place = |t: f32, size: u32| {
            let t = if t.is_finite() { t - t.floor() } else { 0.0 };
            ((t * size as f32) as u32).min(size - 1)
        };
        self.texels[(place(uv.y, self.height) * self.width + place(uv.x, self.width)) as usize]
    }
}

/// The maps of all leaves of an imported plant, by slot, and notes on pictures that could not be used. Sprays that fill
/// closed crowns are drawn by `seed`.
#[must_use]
pub fn card_maps(art: &Art, seed: Seed) -> (Vec<Maps>, Vec<String>) {
    let mut notes = Vec::new();
    let textures = textures(art, &mut notes);
    let maps = art
        .leaves
        .par_iter()
        .enumerate()
        .map(|(i, leaf)| match leaf {
            LeafPicture::Card(card) => draw(card, &textures),
            LeafPicture::Spray { color, needles } => {
                let shape = if *needles { LeafShape::Pine } else { LeafShape::Beech };
                leaf_maps(shape, *color, 0.3, 256, i as u32, seed)
            }
        })
        .collect();
    (maps, notes)
}

/// The maps of an imported plant's bark; none where it brings none, with notes as [`card_maps`]. A bark that is one plain
/// colour gets a faint relief.
#[must_use]
pub fn own_bark_maps(art: &Art, seed: Seed) -> (Option<Maps>, Vec<String>) {
    let mut notes = Vec::new();
    let Some(bark) = &art.bark else { return (None, notes) };
    let image = |index: Option<usize>| index.and_then(|i| art.images.get(i)).map(Vec::as_slice);
    if let Some(color) = image(bark.image) {
        let made = |normal| super::maps_from_images(color, normal, None, None, ArtUse::Bark, ArtLimits::default());
        let maps = made(image(bark.normal)).or_else(|error| {
            notes.push(format!("of the bark {error}"));
            made(None)
        });
        if let Ok(mut maps) = maps {
            for pixel in &mut maps.color {
                for (channel, factor) in pixel.iter_mut().zip(bark.color) {
                    *channel = srgb(linear(*channel) * factor);
                }
            }
            if let Some(bytes) = image(bark.roughness) {
                match decode(bytes, ArtFile::Roughness, ArtLimits::default()) {
                    Ok(rough) => roughen(&mut maps, rough),
                    Err(error) => notes.push(format!("of the bark {error}")),
                }
            }
            // Engines want tiles whose sides are powers of two; shrinking is all that is done.
            let side =
                |n: u32| (n.next_power_of_two() / if n.is_power_of_two() { 1 } else { 2 }).clamp(1, LARGEST_BARK);
            let (width, height) = (side(maps.width), side(maps.height));
            if (width, height) != (maps.width, maps.height) {
                maps = resample(&maps, width, height);
            }
            return (Some(maps), notes);
        }
    }
    (Some(bark_maps(BarkPattern::Smooth, bark.color, 512, seed)), notes)
}

/// Takes the roughness from a picture's green.
fn roughen(maps: &mut Maps, picture: image::DynamicImage) {
    let same = (picture.width(), picture.height()) == (maps.width, maps.height);
    let filter = image::imageops::FilterType::Triangle;
    let picture = if same { picture } else { picture.resize_exact(maps.width, maps.height, filter) };
    for (orm, texel) in maps.orm.iter_mut().zip(picture.into_rgb8().pixels()) {
        orm[1] = texel.0[1];
    }
}

/// Decodes what leaves wear; those that can't be are left out.
fn textures(art: &Art, notes: &mut Vec<String>) -> Vec<Option<Texture>> {
    let mut worn = vec![false; art.images.len()];
    for leaf in &art.leaves {
        if let LeafPicture::Card(card) = leaf {
            let through = card.transmission.and_then(|through| through.image);
            let images = [card.image, card.normal, card.roughness, card.alpha, through];
            images.into_iter().flatten().filter(|i| *i < art.images.len()).for_each(|i| worn[i] = true);
        }
    }
    let decoded: Vec<Result<Option<Texture>, String>> = art
        .images
        .par_iter()
        .zip(&worn)
        .map(|(bytes, worn)| {
            if !worn {
                return Ok(None);
            }
            let image = decode(bytes, ArtFile::Color, ArtLimits::default()).map_err(|e| e.to_string())?.into_rgba8();
            let (width, height) = image.dimensions();
            Ok(Some(Texture { width, height, texels: image.pixels().map(|p| p.0).collect() }))
        })
        .collect();
    decoded
        .into_iter()
        .map(|texture| {
            texture.unwrap_or_else(|error| {
                notes.push(format!("of a leaf {error}"));
                None
            })
        })
        .collect()
}

/// One sample of a card.
#[derive(Clone, Copy, Default)]
struct Sample {
    covered: bool,
    /// Linear.
    color: Vec3,
    alpha: f32,
    normal: Vec3,
    /// 0..=255.
    rough: f32,
    /// What is let through, 0..=255.
    through: f32,
}

/// Draws a card's picture.
fn draw(card: &CardPicture, textures: &[Option<Texture>]) -> Maps {
    let texture = |index: Option<usize>| index.and_then(|i| textures.get(i)?.as_ref());
    let (color, normal, alpha) = (texture(card.image), texture(card.normal), texture(card.alpha));
    let roughness = texture(card.roughness);
    let passed = |uv: Vec2| {
        let Some(through) = card.transmission else { return f32::from(USUAL) };
        through.factor * texture(through.image).map_or(255.0, |t| f32::from(t.at(uv)[through.channel.min(3)]))
    };
    let (width, height) = size(card, color);
    let (columns, rows) = (width as usize * SAMPLES, height as usize * SAMPLES);
    let mut samples = vec![Sample::default(); columns * rows];
    for triangle in &card.triangles {
        let at = triangle.map(|c| c.at * Vec2::new(columns as f32, rows as f32));
        let area = (at[1] - at[0]).perp_dot(at[2] - at[0]);
        if !(area.abs() > 1e-9 && area.is_finite()) {
            continue;
        }
        let turn = texture_axes(triangle, card.width);
        let (low, high) = at.iter().fold((Vec2::MAX, Vec2::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        let range = |low: f32, high: f32, most: usize| {
            (low - 1.0).max(0.0) as usize..((high + 1.0).max(0.0) as usize).min(most)
        };
        for y in range(low.y, high.y, rows) {
            for x in range(low.x, high.x, columns) {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let w = [
                    (at[1] - p).perp_dot(at[2] - p) / area,
                    (at[2] - p).perp_dot(at[0] - p) / area,
                    (at[0] - p).perp_dot(at[1] - p) / area,
                ];
                let sample = &mut samples[y * columns + x];
                if sample.covered || w.iter().any(|w| *w < -1e-3) {
                    continue;
                }
                let uv = (0..3).fold(Vec2::ZERO, |sum, k| sum + triangle[k].uv * w[k]);
                let tint = (0..3).fold(Vec3::ZERO, |sum, k| sum + Vec3::from_array(triangle[k].color) * w[k]);
                let texel = color.map_or([255; 4], |t| t.at(uv));
                // A picture of its own for the alpha may be the colour picture once more.
                let own = alpha.map_or(1.0, |t| {
                    let a = t.at(uv);
                    let opaque = a[3] == 255;
                    f32::from(if opaque { a[0] } else { a[3] }) / 255.0
                });
                let shared = card.alpha.is_some() && card.alpha == card.image;
                *sample = Sample {
                    covered: true,
                    color: Vec3::new(linear(texel[0]), linear(texel[1]), linear(texel[2])) * tint,
                    alpha: if shared { 1.0 } else { own } * f32::from(texel[3]) / 255.0,
                    normal: normal.map_or(Vec3::Z, |t| turned(t.at(uv), turn)),
                    rough: roughness.map_or(f32::from(ROUGH), |t| f32::from(t.at(uv)[1])),
                    through: passed(uv),
                };
            }
        }
    }
    // A picture whose alpha hides everything was not meant to be seen through.
    let seen = samples.iter().any(|s| s.covered && s.alpha * card.color[3] >= 0.5);
    let factor = Vec3::new(card.color[0], card.color[1], card.color[2]);
    let mut maps = Maps { width, height, color: Vec::new(), normal: Vec::new(), orm: Vec::new() };
    for y in 0..height as usize {
        for x in 0..width as usize {
            let (mut light, mut bump, mut cover, mut weight) = (Vec3::ZERO, Vec3::ZERO, 0.0, 1e-6);
            let (mut rough, mut through) = (0.0, 0.0);
            for k in 0..SAMPLES * SAMPLES {
                let s = samples[(y * SAMPLES + k / SAMPLES) * columns + x * SAMPLES + k % SAMPLES];
                if s.covered {
                    let alpha = if seen { s.alpha * card.color[3] } else { 1.0 };
                    let w = alpha + 1e-3;
                    light += s.color * w;
                    bump += s.normal * w;
                    rough += s.rough * w;
                    through += s.through * w;
                    cover += alpha;
                    weight += w;
                }
            }
            let rgb = (light / weight * factor).to_array().map(srgb);
            let a = (cover / (SAMPLES * SAMPLES) as f32).clamp(0.0, 1.0);
            // The cut-off of the file's material becomes the one that is used here.
            let a = (a * 0.5 / card.cutoff.clamp(0.05, 1.0)).min(1.0);
            maps.color.push([rgb[0], rgb[1], rgb[2], (a * 255.0 + 0.5) as u8]);
            maps.normal.push(encode_normal(bump));
            // Where nothing is drawn, the usual.
            let is_drawn = rough > 0.0;
            let mean = |sum: f32, usual: u8| if is_drawn { (sum / weight + 0.5) as u8 } else { usual };
            maps.orm.push([255, mean(rough, ROUGH), mean(through, USUAL)]);
        }
    }
    if color.is_some() && normal.is_none() {
        maps.normal = normals_of(&maps.color, width as usize, height as usize, ArtUse::Leaf);
    }
    dilate(&mut maps);
    clean(&mut maps);
    keep_mean(&mut maps.color, maps.width as usize);
    maps
}

/// Pixels of a card's picture: as many as its part of the texture has.
fn size(card: &CardPicture, texture: Option<&Texture>) -> (u32, u32) {
    let width = if card.width.is_finite() { card.width.clamp(1.0 / 64.0, 64.0) } else { 1.0 };
    let (mut inside, mut there) = (0.0_f32, 0.0_f32);
    for [a, b, c] in &card.triangles {
        inside += (b.at - a.at).perp_dot(c.at - a.at).abs();
        there += (b.uv - a.uv).perp_dot(c.uv - a.uv).abs();
    }
    let texels = match texture {
        Some(t) if inside > 0.0 && there > 0.0 => there / inside * t.width as f32 * t.height as f32,
        _ => (PLAIN * PLAIN) as f32,
    };
    let (w, h) = ((texels * width).sqrt(), (texels / width).sqrt());
    let scale = (LARGEST as f32 / w.max(h)).min(1.0);
    let side = |n: f32| ((n * scale + 0.5) as u32).clamp(8, LARGEST);
    (side(w), side(h))
}

/// Directions in the card (right, up) of the texture's right and up, where a triangle lies; unit.
fn texture_axes(triangle: &[crate::source::foliage::CardCorner; 3], width: f32) -> [Vec2; 2] {
    let place = |k: usize| Vec2::new(triangle[k].at.x * width, -triangle[k].at.y);
    let (p, q) = (place(1) - place(0), place(2) - place(0));
    let (s, t) = (triangle[1].uv - triangle[0].uv, triangle[2].uv - triangle[0].uv);
    let det = s.perp_dot(t);
    if det.abs() < 1e-12 {
        return [Vec2::X, Vec2::Y];
    }
    let right = (p * t.y - q * s.y) / det;
    let down = (q * s.x - p * t.x) / det;
    [right.normalize_or(Vec2::X), (-down).normalize_or(Vec2::Y)]
}

/// A texel of a normal map, turned into the card.
fn turned(texel: [u8; 4], [right, up]: [Vec2; 2]) -> Vec3 {
    let n = [texel[0], texel[1], texel[2]].map(|c| (f32::from(c) - 127.5) / 127.5);
    let flat = right * n[0] + up * n[1];
    Vec3::new(flat.x, flat.y, n[2].max(0.01))
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{ImageFormat, Rgba, RgbaImage};

    use super::*;
    use crate::source::foliage::{BarkPicture, CardCorner};
    use crate::source::scene::Transmission;

    fn png(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
        let image = RgbaImage::from_fn(width, height, |x, y| Rgba(pixel(x, y)));
        let mut bytes = Vec::new();
        image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        bytes
    }

    /// A card over the window of a texture between two corners.
    fn card(low: Vec2, high: Vec2, image: Option<usize>) -> CardPicture {
        let corner = |x: f32, y: f32| CardCorner {
            at: Vec2::new(x, y),
            uv: low + (high - low) * Vec2::new(x, y),
            color: [1.0; 3],
        };
        let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        CardPicture {
            width: 1.0,
            triangles: vec![[a, b, c], [a, c, d]],
            color: [1.0; 4],
            image,
            normal: None,
            roughness: None,
            alpha: None,
            transmission: None,
            cutoff: 0.5,
        }
    }

    fn art(card: CardPicture, images: Vec<Vec<u8>>) -> Art {
        Art { images, leaves: vec![LeafPicture::Card(card)], bark: None }
    }

    #[test]
    fn a_window_of_a_texture_comes_out_texel_for_texel() {
        let pixel =
            |x: u32, y: u32| [(x * 7) as u8, (y * 5) as u8, 90, if (x + y).is_multiple_of(3) { 20 } else { 255 }];
        let art = art(card(Vec2::new(0.5, 0.25), Vec2::new(1.0, 0.75), Some(0)), vec![png(32, 32, pixel)]);
        let (maps, notes) = card_maps(&art, Seed::new(1));
        assert!(notes.is_empty());
        assert_eq!((maps[0].width, maps[0].height), (16, 16));
        for y in 0..16 {
            for x in 0..16 {
                let texel = pixel(x + 16, y + 8);
                assert_eq!(maps[0].color[(y * 16 + x) as usize][3], texel[3]);
                if texel[3] == 255 {
                    assert_eq!(maps[0].color[(y * 16 + x) as usize], texel, "{x} {y}");
                }
            }
        }
    }

    #[test]
    fn an_outline_without_a_texture_is_filled_with_its_colour() {
        let mut card = card(Vec2::ZERO, Vec2::ZERO, None);
        card.triangles.truncate(1);
        card.color = [0.2, 0.5, 0.1, 1.0];
        let maps = &card_maps(&art(card, Vec::new()), Seed::new(1)).0[0];
        let share = maps.color.iter().filter(|c| c[3] > 127).count() as f32 / maps.color.len() as f32;
        assert!((share - 0.5).abs() < 0.01, "{share}");
        assert!(maps.color.iter().all(|c| c[..3] == [srgb(0.2), srgb(0.5), srgb(0.1)]));
    }

    #[test]
    fn normals_turn_with_the_texture() {
        // The texture lies on its side: its right is the card's up.
        let mut turned = card(Vec2::ZERO, Vec2::ONE, Some(0));
        turned.normal = Some(1);
        for triangle in &mut turned.triangles {
            for corner in triangle {
                corner.uv = Vec2::new(1.0 - corner.at.y, corner.at.x);
            }
        }
        let images = vec![png(8, 8, |_, _| [9, 9, 9, 255]), png(8, 8, |_, _| [217, 127, 217, 255])];
        let maps = &card_maps(&art(turned, images), Seed::new(1)).0[0];
        let n = maps.normal[20];
        assert!(n[0].abs_diff(128) <= 1 && n[1] > 205, "{n:?}");
    }

    #[test]
    fn what_a_card_lets_through_is_what_its_file_says_else_the_usual() {
        let pixel = |x: u32, _: u32| [90, 90, 90, if x < 4 { 255 } else { 51 }];
        let drawn = |transmission| {
            let card = CardPicture { transmission, image: Some(0), ..card(Vec2::ZERO, Vec2::ONE, None) };
            let images = vec![png(8, 8, |_, _| [60, 110, 30, 255]), png(8, 8, pixel)];
            let maps = card_maps(&art(card, images), Seed::new(1)).0.remove(0);
            [maps.orm[0][2], maps.orm[7][2]]
        };
        assert_eq!(drawn(None), [USUAL; 2]);
        let told = |image, channel| drawn(Some(Transmission { factor: 0.6, image, channel }));
        assert_eq!((told(None, 3), told(Some(1), 3), told(Some(1), 0)), ([153; 2], [153, 31], [54; 2]));
    }

    #[test]
    fn broken_pictures_are_noted_and_white() {
        let art = art(card(Vec2::ZERO, Vec2::ONE, Some(0)), vec![b"no picture".to_vec()]);
        let (maps, notes) = card_maps(&art, Seed::new(1));
        assert_eq!(notes.len(), 1);
        assert!(maps[0].color.iter().all(|c| *c == [255; 4]));
        let bark = Some(BarkPicture { color: [0.2, 0.1, 0.05], image: Some(0), normal: None, roughness: None });
        let (maps, notes) = own_bark_maps(&Art { bark, ..art }, Seed::new(1));
        assert!(maps.is_some() && notes.len() == 1);
        assert_eq!(own_bark_maps(&Art::default(), Seed::new(1)), (None, Vec::new()));
    }

    #[test]
    fn own_bark_is_tinted_and_its_sides_are_powers_of_two() {
        let bark = Some(BarkPicture { color: [1.0, 0.5, 0.0], image: Some(0), normal: None, roughness: None });
        let art = Art { images: vec![png(48, 16, |_, _| [200, 200, 200, 255])], leaves: Vec::new(), bark };
        let maps = own_bark_maps(&art, Seed::new(1)).0.unwrap();
        assert_eq!((maps.width, maps.height), (32, 16));
        assert!(maps.color.iter().all(|c| c[0] >= 199 && c[1] == srgb(linear(200) * 0.5) && c[2] == 0));
    }
}
