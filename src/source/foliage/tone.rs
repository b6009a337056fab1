//! The colour of a mesh's surface: base colour × vertex colour × picture, sampled small.
//!
//! Only for telling green from brown, and bark from palettes: pictures are decoded once and kept at 128 texels an edge at
//! most. Where a part has a picture and no texture coordinates, it has the picture's mean all over.

use std::io::Cursor;

use glam::{Vec2, Vec3};
use image::{ImageReader, Limits};

use crate::base::math;
use crate::source::scene::{Files, Part, Scene};

/// Longest edge that is decoded, texels, and most bytes that decoding may take.
const LARGEST: (u32, u64) = (8192, 512 << 20);
/// Texels that are kept along an edge.
const KEPT: u32 = 128;
/// Blocks along an edge of a picture that are compared, and how far the mean of each may be from that of all, square
/// roots of linear light. Barks stay below 0.1, leaves, palettes and sheets of several stuffs go beyond 0.19.
const BLOCKS: u32 = 4;
const LIKE: f32 = 0.14;

/// A small picture, linear light.
#[derive(Debug)]
struct Small {
    width: u32,
    height: u32,
    texels: Vec<([f32; 3], f32)>,
    /// Mean colour, weighted by alpha.
    mean: Vec3,
}

/// The colours of a scene.
#[derive(Debug)]
pub(super) struct Tones<'a> {
    scene: &'a Scene,
    /// By material.
    pictures: Vec<Option<Small>>,
}

impl<'a> Tones<'a> {
    /// Decodes the colour pictures; those that can't be are white.
    pub(super) fn new(scene: &'a Scene, files: &Files<'_>) -> Self {
        let pictures = scene.materials.iter().map(|m| small(scene.image_bytes(m.color_image?, files)?)).collect();
        Self { scene, pictures }
    }

    /// Linear colour and alpha of a part at some corner weights (adding up to 1) of one of its triangles.
    pub(super) fn at(&self, part: &Part, corners: [u32; 3], weights: [f32; 3]) -> (Vec3, f32) {
        let mut color = Vec3::ONE;
        let mut alpha = 1.0;
        if let Some(m) = part.material.and_then(|m| self.scene.materials.get(m)) {
            color *= Vec3::new(m.color[0], m.color[1], m.color[2]);
            alpha *= m.color[3];
        }
        if !part.colors.is_empty() {
            let mixed = (0..3).fold(Vec3::ZERO, |sum, k| {
                let c = part.colors[corners[k] as usize];
                sum + Vec3::new(c[0], c[1], c[2]) * weights[k]
            });
            color *= mixed;
        }
        if let Some(mean) = self.mean(part) {
            color *= mean;
        } else if let Some(picture) = part.material.and_then(|m| self.pictures.get(m)?.as_ref()) {
            let uv = (0..3).fold(Vec2::ZERO, |sum, k| sum + part.uvs[corners[k] as usize] * weights[k]);
            let (texel, a) = picture.at(uv);
            color *= Vec3::from_array(texel);
            alpha *= a;
        }
        (color, alpha)
    }

    /// The mean colour, linear and weighted by alpha, of a picture that a part has no coordinates for; none where it has
    /// some or no picture.
    fn mean(&self, part: &Part) -> Option<Vec3> {
        part.material.and_then(|m| self.pictures.get(m)?.as_ref()).filter(|_| part.uvs.is_empty()).map(|p| p.mean)
    }

    /// The colour of a material on a part that has no coordinates for its picture, less the colours of its corners; none where
    /// it has some or no picture that can be read.
    pub(super) fn unmapped(&self, part: &Part) -> Option<[f32; 3]> {
        let mean = self.mean(part)?;
        let material = self.scene.materials.get(part.material?)?;
        Some((mean * Vec3::new(material.color[0], material.color[1], material.color[2])).to_array())
    }

    /// Whether a material's picture is of one stuff: opaque, and about as bright and coloured all over.
    pub(super) fn is_even(&self, material: usize) -> bool {
        let Some(Small { width, height, texels, .. }) = self.pictures.get(material).and_then(Option::as_ref) else {
            return false;
        };
        if texels.iter().any(|(_, alpha)| *alpha < 0.99) {
            return false;
        }
        let mut sums = [(Vec3::ZERO, 0.0_f32); (BLOCKS * BLOCKS) as usize];
        for (i, (color, _)) in texels.iter().enumerate() {
            let (x, y) = (i as u32 % width, i as u32 / width);
            let sum = &mut sums[(y * BLOCKS / height * BLOCKS + x * BLOCKS / width) as usize];
            *sum = (sum.0 + Vec3::from_array(*color), sum.1 + 1.0);
        }
        let root = |(sum, count): (Vec3, f32)| (sum / count.max(1.0)).map(f32::sqrt);
        let all = root(sums.iter().fold((Vec3::ZERO, 0.0), |all, sum| (all.0 + sum.0, all.1 + sum.1)));
        sums.iter().filter(|sum| sum.1 > 0.0).all(|sum| (root(*sum) - all).abs().max_element() < LIKE)
    }

    /// Whether a colour, that a material has where it is worn, is about that of its picture on the whole.
    pub(super) fn is_like(&self, material: usize, worn: Vec3) -> bool {
        let picture = self.pictures.get(material).and_then(Option::as_ref).zip(self.scene.materials.get(material));
        picture.is_none_or(|(picture, m)| {
            let whole = picture.mean * Vec3::new(m.color[0], m.color[1], m.color[2]);
            (whole.map(f32::sqrt) - worn.map(f32::sqrt)).abs().max_element() < LIKE
        })
    }

    /// Whether anything tells colours at all: a picture, vertex colours, or a base colour that is not grey.
    pub(super) fn is_colored(&self, part: &Part) -> bool {
        let material = part.material.and_then(|m| self.scene.materials.get(m));
        let tinted = material.is_some_and(|m| m.color[0] != m.color[1] || m.color[1] != m.color[2]);
        !part.colors.is_empty() || tinted || part.material.is_some_and(|m| self.pictures[m].is_some())
    }

    /// The mean colour of a triangle, weighted by alpha.
    pub(super) fn of_triangle(&self, part: &Part, corners: [u32; 3]) -> Vec3 {
        const PLACES: [[f32; 3]; 4] = [[0.34, 0.33, 0.33], [0.7, 0.15, 0.15], [0.15, 0.7, 0.15], [0.15, 0.15, 0.7]];
        let (mut sum, mut weight) = (Vec3::ZERO, 1e-6);
        for place in PLACES {
            let (color, alpha) = self.at(part, corners, place);
            sum += color * (alpha + 1e-4);
            weight += alpha + 1e-4;
        }
        sum / weight
    }
}

/// Whether a linear colour is that of a green leaf.
pub(super) fn is_green(c: Vec3) -> bool {
    c.y > c.x * 1.12 && c.y > c.z * 1.12
}

fn small(bytes: &[u8]) -> Option<Small> {
    let open = || {
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?;
        let mut bounds = Limits::default();
        bounds.max_image_width = Some(LARGEST.0);
        bounds.max_image_height = Some(LARGEST.0);
        bounds.max_alloc = Some(LARGEST.1);
        reader.limits(bounds);
        Some(reader)
    };
    let (width, height) = open()?.into_dimensions().ok()?;
    if width == 0 || height == 0 || width > LARGEST.0 || height > LARGEST.0 {
        return None;
    }
    let full = open()?.decode().ok()?.into_rgba8();
    let (w, h) = (width.min(KEPT), height.min(KEPT));
    let decode: Vec<f32> = (0..256).map(|b| math::srgb_to_linear(b as f32 / 255.0)).collect();
    let mut texels = Vec::with_capacity((w * h) as usize);
    for y in 0..h {
        for x in 0..w {
            let p = full.get_pixel((2 * x + 1) * width / (2 * w), (2 * y + 1) * height / (2 * h)).0;
            texels.push(([p[0], p[1], p[2]].map(|c| decode[usize::from(c)]), f32::from(p[3]) / 255.0));
        }
    }
    let weighed = |sum: Vec3, (c, alpha): &([f32; 3], f32)| sum + Vec3::from_array(*c) * (alpha + 1e-6);
    let mean = texels.iter().fold(Vec3::ZERO, weighed) / texels.iter().map(|(_, alpha)| alpha + 1e-6).sum::<f32>();
    Some(Small { width: w, height: h, texels, mean })
}

impl Small {
    fn at(&self, uv: Vec2) -> ([f32; 3], f32) {
        let place = |t: f32, size: u32| {
            let t = if t.is_finite() { t - t.floor() } else { 0.0 };
            ((t * size as f32) as u32).min(size - 1)
        };
        self.texels[(place(uv.y, self.height) * self.width + place(uv.x, self.width)) as usize]
    }
}
