//! What of a picture passes the alpha test, with mips that keep its share.
//!
//! Each level has an alpha threshold of its own, chosen so that the share of texels that pass is that of the full picture
//! at 0.5 (Castaño, "Computing alpha mipmaps", 2010), and alpha is never tested at a level where no threshold comes near
//! that share: needles and lobes keep their area however small they are drawn. One byte a texel, so that the inner loops
//! of the rasterizers stay in the cache.

use std::sync::OnceLock;

use glam::Vec2;

use super::Maps;
use super::atlas::{GUTTER, corner};

/// The smallest edge, in texels, of a level that alpha is tested at: below it a shape is no more than a dot.
const SMALLEST_EDGE: u32 = 32;
/// Most levels, the full picture included: further mips of an atlas mix pictures, of which one may be far fuller than
/// another. Texels that are smaller than samples are points, and points keep what is covered.
const MOST_LEVELS: usize = 6;

/// One mip.
#[derive(Clone, Debug)]
pub(super) struct Level {
    width: u32,
    height: u32,
    alpha: Vec<u8>,
    /// Where the picture lies in it and how far it goes, texels: all of it, but for what an atlas has around it.
    corner: Vec2,
    extent: Vec2,
    /// Smallest alpha of a texel that is kept. Between texels half of one less is: 127.5 of 255 are a half.
    threshold: u8,
    /// Whether it is seen between texels at any size, and not only where they are magnified.
    pub(super) filtered: bool,
    /// What passes between each texel and those right of it and below, at the middles of sixteen parts: bit 4 y + x. Known
    /// once a picture is magnified; most are not.
    between: OnceLock<Vec<u16>>,
    /// The same, row by row. Known once a run is looked at.
    parts: OnceLock<Parts>,
}

/// What passes of each part of a picture, a bit each.
#[derive(Clone, Debug)]
struct Parts {
    /// Bits a row.
    stride: usize,
    rows: Vec<u64>,
}

impl Parts {
    /// Of the parts of each texel, in rows of `wide`.
    fn of(between: &[u16], wide: usize) -> Self {
        let words = (wide * PARTS).div_ceil(64);
        let mut rows = vec![0_u64; words * PARTS * (between.len() / wide)];
        for (line, rows) in between.chunks_exact(wide).zip(rows.chunks_exact_mut(words * PARTS)) {
            for (x, &of) in line.iter().enumerate().filter(|(_, of)| **of != 0) {
                let (word, bit) = (x * PARTS / 64, x * PARTS % 64);
                (0..PARTS).for_each(|y| rows[y * words + word] |= u64::from(of >> (y * PARTS) & 0xf) << bit);
            }
        }
        Self { stride: words * 64, rows }
    }
}

/// Parts of a texel's edge that are told apart between texels.
const PARTS: usize = 4;
/// Units of places that are whole numbers: taking floats to whole numbers costs more than the look at a texel.
pub(super) const TEXEL: i64 = 1 << 32;

/// Places along a row of samples, in units of [`TEXEL`]: the first, the steps between them, and how many, at most 64.
#[derive(Clone, Copy)]
pub(super) struct Run {
    pub(super) x: i64,
    pub(super) y: i64,
    pub(super) dx: i64,
    pub(super) dy: i64,
    pub(super) count: u32,
}

impl Run {
    /// A bit for each place that is covered; places are clamped to `0..=last`.
    #[inline]
    fn covered(self, last: (i64, i64), covers: impl Fn(i64, i64) -> bool) -> u64 {
        let Self { dx, dy, count, .. } = self;
        let far = i64::from(count.saturating_sub(1));
        let end = (self.x + dx * far, self.y + dy * far);
        let inside = |(x, y): (i64, i64)| (0..=last.0).contains(&x) && (0..=last.1).contains(&y);
        // From the last to the first, which then is the lowest bit: moving each to its place costs more.
        let (mut bits, (mut x, mut y)) = (0, end);
        let mut next = |covers: bool| bits = bits << 1 | u64::from(covers);
        if inside((self.x, self.y)) && inside(end) {
            for _ in 0..count {
                next(covers(x, y));
                (x, y) = (x - dx, y - dy);
            }
        } else {
            for _ in 0..count {
                next(covers(x.clamp(0, last.0), y.clamp(0, last.1)));
                (x, y) = (x - dx, y - dy);
            }
        }
        bits
    }
}

impl Level {
    /// Tested at a half.
    fn new(width: u32, height: u32, alpha: Vec<u8>) -> Self {
        let (corner, extent) = (Vec2::ZERO, Vec2::new(width as f32, height as f32));
        Self {
            width,
            height,
            alpha,
            corner,
            extent,
            threshold: 128,
            filtered: false,
            between: OnceLock::new(),
            parts: OnceLock::new(),
        }
    }

    fn between(&self) -> &[u16] {
        self.between.get_or_init(|| {
            let mut between = Vec::with_capacity(self.alpha.len());
            let rows: Vec<&[u8]> = self.alpha.chunks_exact(self.width as usize).collect();
            for (y, row) in rows.iter().enumerate() {
                let below = rows[(y + 1).min(rows.len() - 1)];
                let last = row.len() - 1;
                let corners = |x: usize| [row[x], row[(x + 1).min(last)], below[x], below[(x + 1).min(last)]];
                between.extend((0..=last).map(|x| parts(corners(x), self.threshold)));
            }
            between
        })
    }

    /// A place of the picture, 0..=1, in texels.
    pub(super) fn place(&self, uv: Vec2) -> Vec2 {
        self.corner + uv * self.extent
    }

    /// Whether the picture covers a point of it, 0..=1: alpha test with edges clamped, of the nearest texel or, where texels
    /// are large, of the four around it.
    #[inline]
    pub(super) fn shows(&self, magnified: bool, uv: Vec2) -> bool {
        let at = self.place(uv);
        if magnified || self.filtered { self.covers_between(at.x, at.y) } else { self.covers(at.x, at.y) }
    }

    /// Whether the texel at a place, in texels, passes; edges are clamped.
    #[inline]
    fn covers(&self, x: f32, y: f32) -> bool {
        // `as` takes NaN to 0 and clamps what is out of range.
        let x = (x as i32).clamp(0, self.width as i32 - 1);
        let y = (y as i32).clamp(0, self.height as i32 - 1);
        self.alpha[y as usize * self.width as usize + x as usize] >= self.threshold
    }

    /// As [`covers`](Self::covers), of the four texels around the place.
    #[inline]
    fn covers_between(&self, x: f32, y: f32) -> bool {
        let (x, y) = self.clamped(x, y);
        let (x0, y0) = (x as i32 as usize, y as i32 as usize);
        match self.between().get(y0 * self.width as usize + x0) {
            Some(0) => return false,
            Some(&u16::MAX) => return true,
            _ => {}
        }
        self.covers_among((x0, y0), (x - x0 as f32, y - y0 as f32))
    }

    /// The same where the four differ, whose upper left is told, and how far from it.
    fn covers_among(&self, (x0, y0): (usize, usize), (fx, fy): (f32, f32)) -> bool {
        let (x1, y1) = ((x0 + 1).min(self.width as usize - 1), (y0 + 1).min(self.height as usize - 1));
        let alpha = |x: usize, y: usize| f32::from(self.alpha[y * self.width as usize + x]);
        let upper = alpha(x0, y0) + (alpha(x1, y0) - alpha(x0, y0)) * fx;
        let lower = alpha(x0, y1) + (alpha(x1, y1) - alpha(x0, y1)) * fx;
        upper + (lower - upper) * fy >= f32::from(self.threshold) - 0.5
    }

    /// As [`covers`](Self::covers) for each place of a run, one bit each.
    #[inline]
    pub(super) fn run(&self, run: Run) -> u64 {
        let wide = self.width as usize;
        let covers = |x: i64, y: i64| {
            let at = (y >> TEXEL.ilog2()) as usize * wide + (x >> TEXEL.ilog2()) as usize;
            self.alpha.get(at).is_some_and(|alpha| *alpha >= self.threshold)
        };
        run.covered((i64::from(self.width) * TEXEL - 1, i64::from(self.height) * TEXEL - 1), covers)
    }

    /// As [`covers_between`](Self::covers_between) to a quarter of a texel, for each place of a run, one bit each.
    #[inline]
    pub(super) fn run_about(&self, run: Run) -> u64 {
        const PART: u32 = TEXEL.ilog2() - PARTS.ilog2();
        let Parts { stride, rows } = self.parts();
        let covers = |x: i64, y: i64| {
            let at = (y >> PART) as usize * stride + (x >> PART) as usize;
            rows.get(at / 64).is_some_and(|word| word >> (at % 64) & 1 != 0)
        };
        let run = Run { x: run.x - TEXEL / 2, y: run.y - TEXEL / 2, ..run };
        run.covered(((i64::from(self.width) - 1) * TEXEL, (i64::from(self.height) - 1) * TEXEL), covers)
    }

    fn parts(&self) -> &Parts {
        self.parts.get_or_init(|| Parts::of(self.between(), self.width as usize))
    }

    /// A place counted from the middle of the first texel to that of the last.
    #[inline]
    fn clamped(&self, x: f32, y: f32) -> (f32, f32) {
        // `max` takes NaN to 0.
        ((x - 0.5).max(0.0).min((self.width - 1) as f32), (y - 0.5).max(0.0).min((self.height - 1) as f32))
    }
}

/// What of the square between four texels passes: upper left and right, lower left and right.
fn parts(corners: [u8; 4], threshold: u8) -> u16 {
    match corners.iter().filter(|a| **a >= threshold).count() {
        0 => return 0,
        4 => return u16::MAX,
        _ => {}
    }
    // In 64ths, so that all is whole: middles lie at odd eighths.
    let [a, b, c, d] = corners.map(i32::from);
    let whole = 2 * PARTS as i32;
    let mut parts = 0;
    for y in 0..PARTS {
        let down = 2 * y as i32 + 1;
        let (left, right) = (a * (whole - down) + c * down, b * (whole - down) + d * down);
        for x in 0..PARTS {
            let along = 2 * x as i32 + 1;
            let alpha = left * (whole - along) + right * along;
            let passes = 2 * alpha >= (2 * i32::from(threshold) - 1) * whole * whole;
            parts |= u16::from(passes) << (y * PARTS + x);
        }
    }
    parts
}

/// The alpha of a picture, ready to be tested.
#[derive(Clone, Debug)]
pub struct Cutout {
    levels: Vec<Level>,
}

impl Cutout {
    /// The alpha of a picture of `width` by `height` texels. No texels, or fewer than that, become one solid texel.
    #[must_use]
    pub fn new(width: u32, height: u32, mut alpha: Vec<u8>) -> Self {
        let count = width as usize * height as usize;
        if count == 0 || alpha.len() < count {
            return Self { levels: vec![Level::new(1, 1, vec![255])] };
        }
        alpha.truncate(count);
        let goal = share(&alpha, 128);
        let mut levels = vec![Level::new(width, height, alpha)];
        while let Some(last) =
            levels.last().filter(|l| (l.width / 2).min(l.height / 2) >= SMALLEST_EDGE && levels.len() < MOST_LEVELS)
        {
            let mut next = half(last);
            let off;
            (next.threshold, off) = threshold(&next.alpha, goal);
            if off > 0.1 * goal {
                break;
            }
            levels.push(next);
        }
        Self { levels }
    }

    /// As [`new`](Self::new), of alpha that is made for its mips (`mip_coverage.rs`), as engines show it: filtered between texels
    /// and cut at a half at every level.
    #[must_use]
    pub fn as_made(width: u32, height: u32, mut alpha: Vec<u8>) -> Self {
        let count = width as usize * height as usize;
        if count == 0 || alpha.len() < count {
            return Self::new(0, 0, Vec::new());
        }
        alpha.truncate(count);
        let mut levels = vec![Level { filtered: true, ..Level::new(width, height, alpha) }];
        while let Some(last) = levels.last().filter(|l| l.width.max(l.height) > 1 && levels.len() < MOST_LEVELS) {
            levels.push(Level { filtered: true, ..half(last) });
        }
        Self { levels }
    }

    /// As [`as_made`](Self::as_made), of one picture as an atlas holds it: its mips are of the same squares there, the edge going on
    /// around it.
    pub(crate) fn as_packed(width: u32, height: u32, alpha: &[u8]) -> Self {
        if width == 0 || height == 0 || alpha.len() < width as usize * height as usize {
            return Self::new(0, 0, Vec::new());
        }
        let (left, above) = corner((width, height), GUTTER);
        let all = |side: u32, first: u32| (first + side + GUTTER / 2).next_multiple_of(1 << (MOST_LEVELS - 1));
        let (wide, high) = (all(width, left), all(height, above));
        let within = |i: u32, first: u32, side: u32| (i.saturating_sub(first)).min(side - 1);
        let row = |y: u32| {
            let line = &alpha[(within(y, above, height) * width) as usize..][..width as usize];
            (0..wide).map(move |x| line[within(x, left, width) as usize])
        };
        let padded = (0..high).flat_map(row).collect();
        let mut cutout = Self::as_made(wide, high, padded);
        for (k, level) in cutout.levels.iter_mut().enumerate() {
            let texel = 1.0 / (1_u32 << k) as f32;
            level.corner = Vec2::new(left as f32, above as f32) * texel;
            level.extent = Vec2::new(width as f32, height as f32) * texel;
        }
        cutout
    }

    /// The alpha of a material's maps.
    #[must_use]
    pub fn of(maps: &Maps) -> Self {
        Self::new(maps.width, maps.height, maps.color.iter().map(|c| c[3]).collect())
    }

    /// Texels of the full picture.
    pub(super) fn texels(&self) -> f32 {
        self.levels[0].extent.x * self.levels[0].extent.y
    }

    /// The level at which `area` texels of the full picture become one.
    pub(super) fn level(&self, area: f32) -> usize {
        level_of(area, self.levels.len())
    }

    /// A level; the last one where there are not so many.
    pub(super) fn at(&self, level: usize) -> &Level {
        &self.levels[level.min(self.levels.len() - 1)]
    }

    /// How many levels alpha is tested at.
    #[cfg(test)]
    pub(super) fn levels(&self) -> usize {
        self.levels.len()
    }
}

/// The one of `count` levels at which `area` texels of the full picture become one.
pub(super) fn level_of(mut area: f32, count: usize) -> usize {
    let mut level = 0;
    while area > 2.0 && level + 1 < count {
        area *= 0.25;
        level += 1;
    }
    level
}

/// The level of half the size, rounded to the nearest as engines do: alpha that is made for its mips (`mip_coverage.rs`) lies close to
/// the cut, and means cut off lost up to a tenth of it by the fourth. The last row or column of an odd size counts into its neighbour.
fn half(from: &Level) -> Level {
    let (width, height) = ((from.width / 2).max(1), (from.height / 2).max(1));
    let wide = from.width as usize;
    let mut alpha = Vec::with_capacity((width * height) as usize);
    let even = from.width.is_multiple_of(2) && from.height.is_multiple_of(2);
    let span = |i: u32, count: u32, size: u32| (i * size / count) as usize..((i + 1) * size / count) as usize;
    for y in 0..height {
        if even {
            let (upper, lower) = from.alpha[2 * y as usize * wide..][..2 * wide].split_at(wide);
            let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
            alpha.extend(
                pairs.map(|(a, b)| {
                    ((u32::from(a[0]) + u32::from(a[1]) + u32::from(b[0]) + u32::from(b[1]) + 2) / 4) as u8
                }),
            );
            continue;
        }
        for x in 0..width {
            let (mut sum, mut count) = (0_u32, 0_u32);
            for row in span(y, height, from.height) {
                for a in &from.alpha[row * wide..][span(x, width, from.width)] {
                    sum += u32::from(*a);
                    count += 1;
                }
            }
            alpha.push(((sum + count / 2) / count.max(1)) as u8);
        }
    }
    Level::new(width, height, alpha)
}

fn share(alpha: &[u8], threshold: u8) -> f64 {
    alpha.iter().filter(|a| **a >= threshold).count() as f64 / alpha.len() as f64
}

/// The threshold at which the share of `alpha` is nearest to `goal`, and how far from it that share is.
fn threshold(alpha: &[u8], goal: f64) -> (u8, f64) {
    let mut count = [0_u64; 256];
    for a in alpha {
        count[usize::from(*a)] += 1;
    }
    let (mut best, mut nearest) = (128, f64::INFINITY);
    let mut above = 0;
    for bin in (1..256).rev() {
        above += count[bin];
        let off = (above as f64 / alpha.len() as f64 - goal).abs();
        // Of equally good ones the nearest to a half.
        if off < nearest || (off == nearest && bin >= 128) {
            (best, nearest) = (bin as u8, off);
        }
    }
    (best, nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn cutout(edge: u32, alpha: impl Fn(u32, u32) -> u8) -> Cutout {
        Cutout::new(edge, edge, (0..edge * edge).map(|i| alpha(i % edge, i / edge)).collect())
    }

    #[test]
    fn thin_stripes_keep_their_coverage_at_every_level() {
        // Needles a pixel wide, one in eight: plain averages would all fall below a half.
        let stripes = cutout(256, |x, _| if x % 8 == 0 { 255 } else { 0 });
        for level in 0..9 {
            let kept = (0..256 * 256).filter(|i| {
                stripes.at(level).shows(false, Vec2::new((i % 256) as f32 / 256.0, (i / 256) as f32 / 256.0))
            });
            assert_eq!(kept.count(), 256 * 32, "level {level}");
        }
        // A disc stays one down to the smallest level.
        let inside = |x: u32, y: u32| (x as i32 - 128).pow(2) + (y as i32 - 128).pow(2) < 90 * 90;
        assert_eq!(cutout(256, |x, y| if inside(x, y) { 255 } else { 0 }).levels(), 4);
    }

    #[test]
    fn between_texels_the_quick_answer_is_the_interpolated_one_at_the_middles_of_its_parts() {
        let noise = |x: u32, y: u32| Seed::new(5).at(u64::from(y * 99 + x)).bits() as u8;
        for alpha in [&noise as &dyn Fn(u32, u32) -> u8, &|x, y| if x + y < 30 { 128 } else { noise(x, y) / 2 + 64 }] {
            let picture = cutout(37, alpha);
            let slow = Level { between: Vec::new().into(), ..picture.levels[0].clone() };
            let mut off = 0;
            for i in 0..40_000_u64 {
                let seed = Seed::new(6).at(i);
                let (x, y) = (seed.at(0).range(-2.0, 40.0), seed.at(1).range(-2.0, 40.0));
                let middle = |v: f32| (((v - 0.5).clamp(0.0, 36.0) * 4.0).floor() + 0.5) / 4.0 + 0.5;
                let units = |v: f32| (f64::from(v) * TEXEL as f64) as i64;
                let run = Run { x: units(x), y: units(y), dx: 0, dy: 0, count: 2 };
                let about = picture.levels[0].run_about(run);
                assert!(about == 0 || about == 3);
                assert_eq!(about == 3, slow.covers_between(middle(x), middle(y)), "{x} {y}");
                off += u32::from(picture.levels[0].covers_between(x, y) != slow.covers_between(x, y));
            }
            // A part of a square so small that none of its sixteenths is half in it.
            assert!(off < 200, "{off}");
        }
    }

    #[test]
    fn a_packed_picture_is_seen_as_the_atlas_that_holds_it_is() {
        let alpha: Vec<u8> = (0..50 * 41).map(|i| (Seed::new(7).at(i / 3).bits() >> 3) as u8).collect();
        // Where the first picture of an atlas lies, its edge going on for as far as a gutter does.
        let first = corner((50, 41), GUTTER);
        let within = |i: u32, first: u32, side: u32| i.saturating_sub(first).min(side - 1);
        let at = |i: u32| within(i / 128, first.1, 41) * 50 + within(i % 128, first.0, 50);
        let sheet = (0..128 * 128).map(|i| alpha[at(i) as usize]).collect();
        let (own, atlas) = (Cutout::as_packed(50, 41, &alpha), Cutout::as_made(128, 128, sheet));
        let mut seen = [0_u32; 2];
        // Coarser ones look beyond the gutter.
        for level in 0..4 {
            for i in 0..4000_u64 {
                let seed = Seed::new(8).at(i);
                let uv = Vec2::new(seed.at(0).unit(), seed.at(1).unit());
                let there = (Vec2::new(first.0 as f32, first.1 as f32) + uv * Vec2::new(50.0, 41.0)) / 128.0;
                let shows = own.at(level).shows(false, uv);
                seen[usize::from(shows)] += 1;
                // But for rounding at the cut-off.
                let near = |by: f32| atlas.at(level).shows(false, there + by) == shows;
                assert!(near(0.0) || near(1e-5) || near(-1e-5), "{level} {uv}");
            }
        }
        assert!(seen.iter().all(|&count| count > 1000), "{seen:?}");
        assert!((own.texels() - 50.0 * 41.0).abs() < 0.1);
    }

    #[test]
    fn made_alpha_is_halved_to_the_nearest_and_cut_at_a_half() {
        let middle = |alpha: [u8; 4]| Cutout::as_made(2, 2, alpha.to_vec()).at(1).shows(false, Vec2::splat(0.5));
        // Means of 127.5 and of 127.25.
        assert!(middle([128, 128, 127, 127]) && !middle([128, 127, 127, 127]));
        // Half way between two texels, and a hair before.
        let pair = Cutout::as_made(2, 1, vec![127, 128]);
        assert!(pair.at(0).shows(false, Vec2::new(0.5, 0.5)) && !pair.at(0).shows(false, Vec2::new(0.49, 0.5)));
    }

    #[test]
    fn nonsense_is_solid_or_clamped() {
        let none = Cutout::new(9, 9, vec![0; 3]);
        assert!(
            none.at(5).shows(true, Vec2::new(f32::NAN, f32::INFINITY))
                && none.at(0).shows(false, Vec2::new(-1e30, f32::NAN))
        );
        let odd = Cutout::new(131, 77, vec![255; 131 * 77]);
        assert!(odd.at(1).shows(false, Vec2::new(2.0, 2.0)));
    }
}
