//! Alpha coverage: how much of a cut-out picture is left in its mips, and a correction that keeps it.
//!
//! Engines box-filter the mips of a PNG, and thin leaves then fall below the cut-off: the tree dissolves with distance
//! (three.js #20522, godot-proposals #9152). Castaño's remedy (2010, "Computing Alpha Mipmaps") scales the alpha of each
//! mip, but a PNG has none. So level 0 gets a halo: transparent texels near the leaf get an alpha below the cut-off, which
//! doesn't show at level 0 and lifts the averages, and the leaf's own border may get less than full alpha, which lowers
//! them. The settings are those with the least of the largest errors of the first four mips.
//!
//! Limits: the halo stays below the cut-off, so it can't restore everything; under bilinear magnification it moves the
//! visible edge by up to 0.4 of a texel. Colour under alpha must be dilated, as everywhere here.

use serde::{Deserialize, Serialize};

use super::Maps;

/// Alpha at which a leaf's texel is solid: the cut-off of the `MASK` material, as a share of full alpha.
pub const ALPHA_CUTOFF: f32 = 0.5;

/// Mips that the correction looks at.
const MIPS: usize = 4;
/// Largest alpha of the halo.
const MOST_HALO: u32 = 126;
/// The first alpha that is solid.
const SOLID: u8 = 128;
/// Blocks that settings are tried on.
const SAMPLED: usize = 600;

/// Share of solid texels at each mip, level 0 first, at most `levels` of them; box-filtered as engines do. Empty
/// for a picture without texels or whose arrays aren't of its size.
#[must_use]
pub fn coverage(maps: &Maps, levels: usize) -> Vec<f32> {
    let alpha: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
    coverage_of(alpha, maps.width as usize, maps.height as usize, levels)
}

/// Coverage before and after a correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoverageReport {
    /// Share of solid texels, level 0 to 4, as the picture was.
    pub before: Vec<f32>,
    /// The same as it is now.
    pub after: Vec<f32>,
    /// Alpha of the halo beside the leaf, 0..=126.
    pub halo: u8,
}

/// Raises alpha around what is solid, below the cut-off, and lowers that of what is solid beside it, above the cut-off, so
/// that the first four mips keep level 0's coverage as nearly as that can. What is solid at level 0 stays so, and no more.
///
/// How far the halo reaches, how strong it is and how soft the edge are tried out on a share of the picture's blocks: the
/// least of the largest errors is taken.
pub fn preserve_coverage(maps: &mut Maps) -> CoverageReport {
    let (width, height) = (maps.width as usize, maps.height as usize);
    let alpha: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
    let before = coverage_of(alpha.clone(), width, height, MIPS + 1);
    if before.is_empty() {
        return CoverageReport { after: before.clone(), before, halo: 0 };
    }
    let near = distance(&alpha, width, height);
    let inside = border(&alpha, width, height);
    let blocks = blocks(&alpha, &near, &inside, width, height);
    let mut best = (f32::INFINITY, Halo { strength: 0, reach: 1, edge: 255 });
    for edge in [255, 205, 165, 130] {
        for reach in [1, 2, 4, 7, 11] {
            for strength in (0..=MOST_HALO).step_by(14) {
                let halo = Halo { strength, reach, edge };
                let worst = worst(&blocks, halo);
                if worst < best.0 {
                    best = (worst, halo);
                }
            }
        }
    }
    let halo = best.1;
    for (i, color) in maps.color.iter_mut().enumerate() {
        color[3] = halo.alpha(alpha[i], near[i], inside[i]);
    }
    CoverageReport { before, after: coverage(maps, MIPS + 1), halo: halo.strength as u8 }
}

/// What is done to alpha.
#[derive(Clone, Copy)]
struct Halo {
    /// Alpha beside what is solid.
    strength: u32,
    /// Texels until it is gone.
    reach: u32,
    /// Most alpha of solid texels that have a clear neighbour.
    edge: u8,
}

impl Halo {
    /// Of a texel with this alpha, so far from what is solid, on the border of it or not.
    fn alpha(self, alpha: u8, near: u8, border: bool) -> u8 {
        match u32::from(near) {
            0 if border => alpha.min(self.edge),
            0 => alpha,
            d if d > self.reach => alpha,
            d => alpha.max((self.strength * (self.reach + 1 - d) / self.reach) as u8),
        }
    }
}

/// A square of texels that becomes one texel in the last mip: alpha, distance to what is solid, and border.
type Block = Vec<(u8, u8, bool)>;

/// Some of the blocks that show anything, at even steps.
fn blocks(alpha: &[u8], near: &[u8], border: &[bool], width: usize, height: usize) -> Vec<Block> {
    const EDGE: usize = 1 << MIPS;
    let (columns, rows) = (width / EDGE, height / EDGE);
    let at = |block: usize, i: usize| (block / columns * EDGE + i / EDGE) * width + block % columns * EDGE + i % EDGE;
    let shown: Vec<usize> = (0..columns * rows)
        .filter(|&block| (0..EDGE * EDGE).step_by(5).any(|i| u32::from(near[at(block, i)]) <= 12))
        .collect();
    let step = shown.len().div_ceil(SAMPLED).max(1);
    let block = |&b: &usize| -> Block {
        let texel = |i| {
            let k = at(b, i);
            (alpha[k], near[k], border[k])
        };
        (0..EDGE * EDGE).map(texel).collect()
    };
    shown.iter().step_by(step).map(block).collect()
}

/// The largest share by which a mip's coverage is off level 0's.
fn worst(blocks: &[Block], halo: Halo) -> f32 {
    let mut solid = [0_u32; MIPS + 1];
    for block in blocks {
        let mut alpha: Vec<u8> = block.iter().map(|&(a, near, border)| halo.alpha(a, near, border)).collect();
        let mut edge = 1 << MIPS;
        for (level, solid) in solid.iter_mut().enumerate() {
            *solid += (alpha.iter().filter(|&&a| a >= SOLID).count() as u32) << (2 * level);
            edge /= 2;
            let sum = |i: usize| {
                let (x, y) = (i % edge * 2, i / edge * 2);
                let row = |y: usize| u32::from(alpha[y * edge * 2 + x]) + u32::from(alpha[y * edge * 2 + x + 1]);
                ((row(y) + row(y + 1) + 2) / 4) as u8
            };
            alpha = (0..edge * edge).map(sum).collect();
        }
    }
    let first = solid[0].max(1) as f32;
    solid.iter().map(|&s| (s as f32 / first - 1.0).abs()).fold(0.0, f32::max)
}

/// Solid texels with a clear one beside them.
fn border(alpha: &[u8], width: usize, height: usize) -> Vec<bool> {
    let clear = |x: usize, y: usize| alpha[y * width + x] < SOLID;
    (0..alpha.len())
        .map(|i| {
            let (x, y) = (i % width, i / width);
            alpha[i] >= SOLID
                && ((x > 0 && clear(x - 1, y))
                    || (x + 1 < width && clear(x + 1, y))
                    || (y > 0 && clear(x, y - 1))
                    || (y + 1 < height && clear(x, y + 1)))
        })
        .collect()
}

fn coverage_of(mut alpha: Vec<u8>, mut width: usize, mut height: usize, levels: usize) -> Vec<f32> {
    let mut shares = Vec::new();
    if alpha.len() != width * height {
        return shares;
    }
    while shares.len() < levels && !alpha.is_empty() {
        let solid = alpha.iter().filter(|&&a| f32::from(a) >= ALPHA_CUTOFF * 255.0).count();
        shares.push(solid as f32 / alpha.len() as f32);
        if width == 1 && height == 1 {
            break;
        }
        let (w, h) = ((width / 2).max(1), (height / 2).max(1));
        let mut next = Vec::with_capacity(w * h);
        for y in 0..h {
            let rows = [(2 * y).min(height - 1) * width, (2 * y + 1).min(height - 1) * width];
            for x in 0..w {
                let columns = [(2 * x).min(width - 1), (2 * x + 1).min(width - 1)];
                let sum: u32 =
                    rows.iter().flat_map(|r| columns.iter().map(move |c| r + c)).map(|i| u32::from(alpha[i])).sum();
                next.push(((sum + 2) / 4) as u8);
            }
        }
        (alpha, width, height) = (next, w, h);
    }
    shares
}

/// City-block distance to the next solid texel, at most 255; 0 for what is solid.
fn distance(alpha: &[u8], width: usize, height: usize) -> Vec<u8> {
    let mut near: Vec<u8> =
        alpha.iter().map(|&a| if f32::from(a) >= ALPHA_CUTOFF * 255.0 { 0 } else { u8::MAX }).collect();
    let step = |near: &mut [u8], to: usize, from: usize| near[to] = near[to].min(near[from].saturating_add(1));
    for i in 0..near.len() {
        if i % width > 0 {
            step(&mut near, i, i - 1);
        }
        if i >= width {
            step(&mut near, i, i - width);
        }
    }
    for i in (0..near.len()).rev() {
        if i % width + 1 < width {
            step(&mut near, i, i + 1);
        }
        if i + width < width * height {
            step(&mut near, i, i + width);
        }
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, math};

    fn stripes(period: usize) -> Maps {
        let n = 64 * 64;
        let color = (0..n).map(|i| [90, 120, 60, if i % 64 % period < 2 { 255 } else { 0 }]).collect();
        Maps { width: 64, height: 64, color, normal: vec![[128, 128, 255]; n], orm: vec![[255, 200, 0]; n] }
    }

    #[test]
    fn coverage_counts_solid_texels_and_halves_the_mips() {
        assert_eq!(coverage(&stripes(4), 3), [0.5, 0.5, 1.0]);
        assert_eq!(coverage(&stripes(64), 9).len(), 7);
    }

    /// Thirty leaves of 14 by 3 texels, strewn.
    fn strewn() -> Maps {
        let mut maps = stripes(64);
        maps.color.iter_mut().for_each(|c| c[3] = 0);
        for i in 0..30 {
            let seed = Seed::new(i);
            let (x, y) = (seed.at(0).range(0.0, 63.0), seed.at(1).range(0.0, 63.0));
            let (sin, cos) = math::sin_cos(seed.at(2).range(0.0, 6.3));
            for k in 0..14 * 3 * 4 {
                let (along, across) = (f32::from(k as u8 / 6) / 2.0, f32::from(k as u8 % 6) / 2.0);
                let (px, py) = (x + along * cos - across * sin, y + along * sin + across * cos);
                if (0.0..64.0).contains(&px) && (0.0..64.0).contains(&py) {
                    maps.color[py as usize * 64 + px as usize][3] = 255;
                }
            }
        }
        maps
    }

    #[test]
    fn correction_leaves_level_0_and_brings_the_mips_nearer() {
        let mut maps = strewn();
        let solid = |m: &Maps| m.color.iter().map(|c| c[3] >= 128).collect::<Vec<_>>();
        let was = solid(&maps);
        let report = preserve_coverage(&mut maps);
        assert_eq!(solid(&maps), was);
        let error = |c: &[f32]| c[1..].iter().map(|v| (v - c[0]).abs()).fold(0.0, f32::max);
        assert!(error(&report.after) < error(&report.before), "{report:?}");
    }

    #[test]
    fn nothing_stays_nothing() {
        let mut maps = stripes(64);
        maps.color.iter_mut().for_each(|c| c[3] = 0);
        assert_eq!(preserve_coverage(&mut maps).after, [0.0; 5]);
        let mut none = Maps { width: 0, height: 0, color: vec![], normal: vec![], orm: vec![] };
        assert!(preserve_coverage(&mut none).before.is_empty());
    }
}
