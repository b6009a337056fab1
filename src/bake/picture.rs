//! A material's maps with mips in linear light, ready to be sampled by the rasterizer.
//!
//! Colours are averaged in linear light and weighted by alpha, so that what lies under the alpha never bleeds into a
//! leaf. What passes the alpha test is asked of a [`Cutout`]. Linear light is held as 16-bit integers; sums of these are
//! exact, so nothing depends on their order.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::cutout::level_of;
use super::srgb::decode;
use super::transmission::reduced;
use super::{Cutout, Maps};

/// One sampled point of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Texel {
    /// Linear light.
    pub(crate) color: Vec3,
    /// Tangent-space normal, +Y up, not quite unit length.
    pub(crate) normal: Vec3,
    /// 1 is unoccluded.
    pub(crate) occlusion: f32,
}

#[derive(Clone, Debug)]
struct Level {
    width: u32,
    height: u32,
    /// Linear red, green, blue and alpha, 65535 is one.
    color: Vec<[u16; 4]>,
    /// Normal and occlusion.
    shape: Vec<[u8; 4]>,
}

/// Maps with a chain of mips, for [`rasterize`](super::rasterize). Clones share them.
#[derive(Clone, Debug)]
pub struct Picture {
    levels: Arc<Vec<Level>>,
    cutout: Arc<Cutout>,
    through: Arc<Vec<u8>>,
}

impl Picture {
    /// Makes the mips; about 20 ns a texel. Maps without pixels, or with arrays shorter than their size says, become
    /// one white opaque texel.
    #[must_use]
    pub fn new(maps: &Maps) -> Self {
        Self::cut_out(maps, Cutout::of)
    }

    /// As [`new`](Self::new), with what of the maps passes the alpha test.
    fn cut_out(maps: &Maps, cutout: impl Fn(&Maps) -> Cutout) -> Self {
        let linear = linear_table();
        Self::of(maps, |c| [c[0], c[1], c[2]].map(|v| linear[usize::from(v)]), cutout)
    }

    /// As [`new`](Self::new), of one colour whatever the maps have.
    #[must_use]
    pub fn plain(maps: &Maps, color: [u8; 3]) -> Self {
        let linear = linear_table();
        let color = color.map(|v| linear[usize::from(v)]);
        Self::of(maps, |_| color, Cutout::of)
    }

    fn of(maps: &Maps, color: impl Fn(&[u8; 4]) -> [u16; 3], cutout: impl Fn(&Maps) -> Cutout) -> Self {
        let count = maps.width as usize * maps.height as usize;
        let whole = count > 0 && maps.color.len() >= count && maps.normal.len() >= count && maps.orm.len() >= count;
        let base = if whole {
            let texel = |c: &[u8; 4]| {
                let [r, g, b] = color(c);
                [r, g, b, u16::from(c[3]) * 257]
            };
            Level {
                width: maps.width,
                height: maps.height,
                color: maps.color[..count].iter().map(texel).collect(),
                shape: maps.normal.iter().zip(&maps.orm).take(count).map(|(n, o)| [n[0], n[1], n[2], o[0]]).collect(),
            }
        } else {
            Level { width: 1, height: 1, color: vec![[0xffff; 4]], shape: vec![[128, 128, 255, 255]] }
        };
        let cutout = if whole { cutout(maps) } else { Cutout::new(0, 0, Vec::new()) };
        let mut levels = vec![base];
        while let Some(last) = levels.last().filter(|l| l.width > 1 || l.height > 1) {
            levels.push(half(last));
        }
        Self { levels: Arc::new(levels), cutout: Arc::new(cutout), through: Arc::new(reduced(maps)) }
    }

    /// An atlas, as engines show it: its alpha is made for its mips.
    #[must_use]
    pub fn of_atlas(maps: &Maps) -> Self {
        let alpha = |maps: &Maps| maps.color.iter().map(|c| c[3]).collect();
        Self::cut_out(maps, |maps| Cutout::as_made(maps.width, maps.height, alpha(maps)))
    }

    /// The same, cut out as an atlas keeps it by alpha that is made for its mips; as it was where that is not of its size.
    pub(crate) fn cut_by(self, alpha: &[u8]) -> Self {
        let Level { width, height, .. } = self.levels[0];
        if alpha.len() != width as usize * height as usize {
            return self;
        }
        Self { cutout: Arc::new(Cutout::as_packed(width, height, alpha)), ..self }
    }

    /// Bytes that it takes, about.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.levels.iter().map(|level| level.color.len() * 15).sum()
    }

    /// What of it passes the alpha test.
    #[must_use]
    pub fn cutout(&self) -> &Cutout {
        &self.cutout
    }

    /// What it lets through, of 255, at each texel that a palette has of it.
    pub(crate) fn through(&self) -> &[u8] {
        &self.through
    }

    /// Texels of the full picture.
    pub(super) fn texels(&self) -> f32 {
        self.levels[0].width as f32 * self.levels[0].height as f32
    }

    /// The level at which `area` texels of the full picture become one.
    pub(super) fn level(&self, area: f32) -> usize {
        level_of(area, self.levels.len())
    }

    /// The texel of a level that shows at a place, counted through all levels: the nearest one, or, where they are magnified,
    /// the one of those around that counts most by its alpha.
    pub(super) fn address(&self, level: usize, magnified: bool, (u, v): (f32, f32), repeat: Repeat) -> u32 {
        let level = level.min(self.levels.len() - 1);
        let before: usize = self.levels[..level].iter().map(|l| l.color.len()).sum();
        let level = &self.levels[level];
        let (x0, x1, fx) = neighbours(u, level.width, repeat);
        let (y0, y1, fy) = neighbours(v, level.height, repeat);
        let at = |x: u32, y: u32| y * level.width + x;
        let (x, y) = (if fx < 0.5 { x0 } else { x1 }, if fy < 0.5 { y0 } else { y1 });
        let mut found = at(x, y);
        if magnified {
            let corners = [
                (x0, y0, (1.0 - fx) * (1.0 - fy)),
                (x1, y0, fx * (1.0 - fy)),
                (x0, y1, (1.0 - fx) * fy),
                (x1, y1, fx * fy),
            ];
            let mut most = 0.0;
            for (x, y, w) in corners {
                let w = w * (f32::from(level.color[at(x, y) as usize][3]) + 1.0);
                if w > most {
                    (found, most) = (at(x, y), w);
                }
            }
        }
        before as u32 + found
    }

    /// The colours of all levels, as [`address`](Self::address) counts them; much cheaper than a picture.
    pub(super) fn colors((width, height): (u32, u32), color: &[[u8; 4]]) -> Vec<[u16; 4]> {
        let (mut width, mut height) = (width as usize, height as usize);
        if width * height == 0 || color.len() < width * height {
            return vec![[u16::MAX; 4]];
        }
        let linear = linear_table();
        let texel = |c: &[u8; 4]| {
            let [r, g, b] = [c[0], c[1], c[2]].map(|v| linear[usize::from(v)]);
            [r, g, b, u16::from(c[3]) * 257]
        };
        let mut all: Vec<[u16; 4]> = color[..width * height].iter().map(texel).collect();
        let mut first = 0;
        while width > 1 || height > 1 {
            let (w, h) = ((width / 2).max(1), (height / 2).max(1));
            let fine = &all[first..];
            let next: Vec<[u16; 4]> = (0..h)
                .into_par_iter()
                .with_min_len(32)
                .flat_map_iter(|y| (0..w).map(move |x| mean(fine, (width, height), (w, h), (x, y))))
                .collect();
            first = all.len();
            all.extend(next);
            (width, height) = (w, h);
        }
        all
    }

    /// The nearest texel, or, where they are magnified, those around by their alpha; edges clamped or repeated.
    #[inline]
    pub(super) fn sample(&self, level: usize, magnified: bool, (u, v): (f32, f32), repeat: Repeat) -> Texel {
        let level = &self.levels[level.min(self.levels.len() - 1)];
        let (x0, x1, fx) = neighbours(u, level.width, repeat);
        let (y0, y1, fy) = neighbours(v, level.height, repeat);
        if !magnified {
            let (x, y) = (if fx < 0.5 { x0 } else { x1 }, if fy < 0.5 { y0 } else { y1 });
            let i = (y * level.width + x) as usize;
            let ([r, g, b, _], [x, y, z, open]) = (level.color[i].map(f32::from), level.shape[i].map(f32::from));
            return Texel {
                color: Vec3::new(r, g, b) / 65535.0,
                normal: (Vec3::new(x, y, z) - 128.0) / 127.0,
                occlusion: open / 255.0,
            };
        }
        let mut sum = [0.0_f32; 7];
        let mut total = 0.0_f32;
        for (x, y, w) in
            [(x0, y0, (1.0 - fx) * (1.0 - fy)), (x1, y0, fx * (1.0 - fy)), (x0, y1, (1.0 - fx) * fy), (x1, y1, fx * fy)]
        {
            let i = (y * level.width + x) as usize;
            let (c, s) = (level.color[i], level.shape[i]);
            // A texel counts by its alpha; the small share keeps a wholly clear place at its own colour.
            let w = w * (f32::from(c[3]) + 1.0);
            total += w;
            sum[0] += w * f32::from(c[0]);
            sum[1] += w * f32::from(c[1]);
            sum[2] += w * f32::from(c[2]);
            sum[3] += w * f32::from(s[0]);
            sum[4] += w * f32::from(s[1]);
            sum[5] += w * f32::from(s[2]);
            sum[6] += w * f32::from(s[3]);
        }
        let scale = 1.0 / total.max(1e-20);
        Texel {
            color: Vec3::new(sum[0], sum[1], sum[2]) * (scale / 65535.0),
            normal: (Vec3::new(sum[3], sum[4], sum[5]) * scale - 128.0) / 127.0,
            occlusion: sum[6] * scale / 255.0,
        }
    }
}

/// What happens beyond a picture's edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repeat {
    /// The picture tiles, and is opaque: bark.
    Tiled,
    /// The edge texel goes on, and texels of less than half alpha are holes: leaves and cards.
    Cutout,
}

#[inline]
fn neighbours(t: f32, size: u32, repeat: Repeat) -> (u32, u32, f32) {
    let last = size - 1;
    let t = if t.is_finite() { t } else { 0.0 };
    match repeat {
        Repeat::Tiled => {
            let s = (t - t.floor()) * size as f32 - 0.5;
            let f = s.floor();
            let i = (f as i64).rem_euclid(i64::from(size)) as u32;
            (i, if i == last { 0 } else { i + 1 }, s - f)
        }
        Repeat::Cutout => {
            let s = (t * size as f32 - 0.5).clamp(0.0, last as f32);
            let i = (s as u32).min(last);
            (i, (i + 1).min(last), s - i as f32)
        }
    }
}

/// What a clear texel counts as, of an alpha of 65535.
const CLEAR: f64 = 1.0 / 1024.0;

/// The mean colour, by alpha, of the texels that one texel of a smaller level stands for.
fn mean(fine: &[[u16; 4]], from: (usize, usize), to: (usize, usize), at: (usize, usize)) -> [u16; 4] {
    let span = |i: usize, count: usize, size: usize| i * size / count..(i + 1) * size / count;
    let (mut sum, mut alpha, mut count) = ([0.0_f64; 3], 0.0_f64, 0.0_f64);
    for row in span(at.1, to.1, from.1) {
        for c in &fine[row * from.0..][span(at.0, to.0, from.0)] {
            // Sums of products of 16 bits are exact; the small share keeps a wholly clear place at its own colour.
            let a = f64::from(c[3]) + CLEAR;
            for k in 0..3 {
                sum[k] += a * f64::from(c[k]);
            }
            alpha += a;
            count += 1.0;
        }
    }
    let (scale, count) = (1.0 / alpha, 1.0 / count.max(1.0));
    let [r, g, b] = sum.map(|v| (v * scale + 0.5) as u16);
    [r, g, b, ((alpha * count - CLEAR) + 0.5) as u16]
}

/// The level of half the size; the last row or column of an odd size counts into its neighbour.
fn half(from: &Level) -> Level {
    let (width, height) = ((from.width / 2).max(1), (from.height / 2).max(1));
    let mut color = Vec::with_capacity((width * height) as usize);
    let mut shape = Vec::with_capacity((width * height) as usize);
    let span = |i: u32, count: u32, size: u32| (i * size / count)..((i + 1) * size / count);
    let is_even = from.width.is_multiple_of(2) && from.height.is_multiple_of(2);
    for y in 0..height {
        for x in 0..width {
            if let Some((mean_color, mean_shape)) = is_even.then(|| alike(from, (2 * x, 2 * y))).flatten() {
                color.push(mean_color);
                shape.push(mean_shape);
                continue;
            }
            let (mut sum, mut plain) = ([0_u64; 7], [0_u64; 7]);
            let (mut alpha, mut count) = (0_u64, 0_u64);
            for sy in span(y, height, from.height) {
                for sx in span(x, width, from.width) {
                    let i = (sy * from.width + sx) as usize;
                    let (c, s) = (from.color[i], from.shape[i]);
                    let a = u64::from(c[3]);
                    let all = [c[0], c[1], c[2], s[0].into(), s[1].into(), s[2].into(), s[3].into()].map(u64::from);
                    for k in 0..7 {
                        sum[k] += a * all[k];
                        plain[k] += all[k];
                    }
                    alpha += a;
                    count += 1;
                }
            }
            let mean: [u64; 7] =
                std::array::from_fn(|k| (sum[k] + alpha / 2).checked_div(alpha).unwrap_or(plain[k] / count));
            color.push([mean[0] as u16, mean[1] as u16, mean[2] as u16, (alpha / count) as u16]);
            shape.push([mean[3] as u8, mean[4] as u8, mean[5] as u8, mean[6] as u8]);
        }
    }
    Level { width, height, color, shape }
}

/// The mean of four texels from one on, where all have the same alpha: most do, and weigh alike without a division.
#[inline]
fn alike(from: &Level, (x, y): (u32, u32)) -> Option<([u16; 4], [u8; 4])> {
    let (first, wide) = ((y * from.width + x) as usize, from.width as usize);
    let at = [first, first + 1, first + wide, first + wide + 1];
    let (c, s) = (at.map(|i| from.color[i]), at.map(|i| from.shape[i]));
    let alpha = c[0][3];
    // Means of clear texels are cut off, as they are of any number of them.
    let half = if alpha > 0 { 2 } else { 0 };
    let color = |k: usize| ((c.iter().map(|c| u32::from(c[k])).sum::<u32>() + half) / 4) as u16;
    let shape = |k: usize| ((s.iter().map(|s| u32::from(s[k])).sum::<u32>() + half) / 4) as u8;
    let is_alike = c.iter().all(|c| c[3] == alpha);
    is_alike.then(|| ([color(0), color(1), color(2), alpha], std::array::from_fn(shape)))
}

/// Linear light of each 8-bit sRGB value, 65535 is one.
fn linear_table() -> [u16; 256] {
    std::array::from_fn(|i| (decode(i as u8) * 65535.0 + 0.5) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn maps(width: u32, height: u32, color: impl Fn(u32, u32) -> [u8; 4]) -> Maps {
        let count = (width * height) as usize;
        Maps {
            width,
            height,
            color: (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| color(x, y)).collect(),
            normal: vec![[128, 128, 255]; count],
            orm: vec![[255, 200, 0]; count],
        }
    }

    #[test]
    fn clear_texels_never_colour_the_mips() {
        let picture =
            Picture::new(&maps(64, 64, |x, y| if (x + y) % 2 == 0 { [0, 255, 0, 255] } else { [255, 0, 0, 0] }));
        for level in 0..7 {
            let c = picture.sample(level, true, (0.3, 0.7), Repeat::Cutout).color;
            assert!(c.x < 1e-3 && c.y > 0.999, "level {level}: {c}");
        }
    }

    #[test]
    fn texels_of_one_alpha_are_averaged_as_all_others_are() {
        let noise = |i: u32, k: u64| crate::base::Seed::new(k).at(i.into()).bits();
        for alpha in [u16::MAX, 77, 0] {
            let level = Level {
                width: 64,
                height: 64,
                color: (0..4096).map(|i| [noise(i, 1) as u16, noise(i, 2) as u16, noise(i, 3) as u16, alpha]).collect(),
                shape: (0..4096).map(|i| [4, 5, 6, 7].map(|k| noise(i, k) as u8)).collect(),
            };
            let mean = |at: u32, of: &dyn Fn(usize) -> u64| {
                let (x, y) = (at % 32 * 2, at / 32 * 2);
                let sum: u64 =
                    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(r, d)| of(((y + d) * 64 + x + r) as usize)).iter().sum();
                (u64::from(alpha) * sum + u64::from(alpha) * 2).checked_div(u64::from(alpha) * 4).unwrap_or(sum / 4)
            };
            let smaller = half(&level);
            for at in 0..1024 {
                let (color, shape) = (smaller.color[at as usize], smaller.shape[at as usize]);
                for k in 0..4 {
                    assert_eq!(
                        u64::from(color[k]),
                        if k < 3 { mean(at, &|i| level.color[i][k].into()) } else { alpha.into() }
                    );
                    assert_eq!(u64::from(shape[k]), mean(at, &|i| level.shape[i][k].into()));
                }
            }
        }
    }

    #[test]
    fn broken_maps_and_coordinates_are_answered() {
        let empty = Picture::new(&Maps { width: 9, height: 9, color: vec![], normal: vec![], orm: vec![] });
        assert!(empty.cutout().at(5).shows(true, glam::Vec2::new(f32::NAN, f32::INFINITY)));
        for repeat in [Repeat::Tiled, Repeat::Cutout] {
            let texel = Picture::new(&maps(3, 5, |_, _| [9, 9, 9, 255])).sample(9, true, (f32::NAN, -1e30), repeat);
            assert!(texel.color.is_finite());
        }
    }
}
