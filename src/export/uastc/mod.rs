//! UASTC LDR 4×4: textures in blocks of 16 bytes that a browser turns into what its graphics card reads (BC7, ASTC, ETC2).
//!
//! Of each block several modes are tried, simple ones first, and the one that comes nearest is written; what is near enough
//! early is not tried further. Where alpha is a cut-out, a mode that moves a texel across the cut-off pays for it, so that
//! leaves cover as much as they did. A block in which nothing can be seen (alpha 0 throughout) takes one colour.
//!
//! Written here because the `basis-universal` crate took 4.2 s for 1024² texels, its C++ contracts multiplications and
//! additions where a processor can, so that bytes differ between machines, and it keeps no cut-outs; the figures
//! (`figures -- lod`) have this one's time and PSNR. Source: Binomial, "UASTC LDR 4x4 Texture Specification".

mod fit;
mod hints;
mod modes;
mod pack;
#[cfg(test)]
pub(super) mod tests;

use rayon::prelude::*;

use fit::Group;
use hints::Hints;
use modes::{Mode, PATTERNS};
use pack::Coded;

/// What a texture's alpha is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    /// 255 throughout.
    None,
    /// A mask that is cut at 128.
    CutOut,
}

/// Squared difference a block that is near enough: 1.2 steps a channel and texel.
const ENOUGH: u32 = 16 * 3 * 3 / 2;

/// Encodes texels, rows from the top, as rows of blocks; what is missing to a whole block repeats the edge. Texels without
/// alpha have 255.
pub(super) fn encode(texels: &[[u8; 4]], (width, height): (usize, usize), alpha: Alpha) -> Vec<u8> {
    let (wide, high) = (width.div_ceil(4), height.div_ceil(4));
    let mut out = vec![0; wide * high * 16];
    out.par_chunks_mut(wide * 16).enumerate().for_each(|(row, out)| {
        for (column, out) in out.as_chunks_mut::<16>().0.iter_mut().enumerate() {
            let texel = |i: usize| {
                let (x, y) = ((column * 4 + i % 4).min(width - 1), (row * 4 + i / 4).min(height - 1));
                texels[y * width + x]
            };
            *out = block(&std::array::from_fn(texel), alpha);
        }
    });
    out
}

/// The bytes of a block.
fn block(texels: &[[u8; 4]; 16], alpha: Alpha) -> [u8; 16] {
    if texels.iter().all(|t| *t == texels[0]) {
        return pack::solid(texels[0]);
    }
    if texels.iter().all(|t| t[3] == 0) {
        let mean = |c: usize| ((texels.iter().map(|t| u32::from(t[c])).sum::<u32>() + 8) / 16) as u8;
        return pack::solid([mean(0), mean(1), mean(2), 0]);
    }
    let best = best(texels, alpha == Alpha::CutOut);
    best.bytes(&Hints::of(&best.texels()))
}

/// A mode to try, after the best so far.
type Try = fn(&[[u8; 4]; 16], bool, &Coded) -> Coded;

/// What is tried of opaque blocks, and of others.
const OPAQUE: [Try; 4] = [
    |texels, cut, found| apart(texels, &modes::APART, worst_channel(texels, found), cut),
    |texels, cut, _| two(texels, &modes::TWO, cut),
    |texels, cut, _| two(texels, &modes::TWO_FINE, cut),
    |texels, cut, _| one(texels, &modes::EXACT, cut),
];
const CLEAR: [Try; 5] = [
    |texels, cut, _| apart(texels, &modes::ALPHA_APART, 3, cut),
    |texels, cut, _| one(texels, &modes::ALPHA_FINE, cut),
    |texels, cut, _| two(texels, &modes::ALPHA_TWO, cut),
    |texels, cut, _| apart(texels, &modes::ALPHA_EDGE, 3, cut),
    |texels, cut, _| one(texels, &modes::ALPHA_EXACT, cut),
];

/// The mode that comes nearest.
fn best(texels: &[[u8; 4]; 16], cut: bool) -> Coded {
    let (first, tries): (&'static Mode, &[Try]) =
        if texels.iter().all(|t| t[3] == 255) { (&modes::FINE, &OPAQUE) } else { (&modes::ALPHA_EIGHT, &CLEAR) };
    let mut found = one(texels, first, cut);
    for attempt in tries {
        if found.error() <= ENOUGH {
            break;
        }
        let next = attempt(texels, cut, &found);
        if next.error() < found.error() {
            found = next;
        }
    }
    found
}

/// The channels of a mode.
fn channels(mode: &Mode) -> [bool; 4] {
    [true, true, true, mode.channels == 4]
}

/// All texels on one line.
fn one(texels: &[[u8; 4]; 16], mode: &'static Mode, cut: bool) -> Coded {
    let line = Group::of(texels, |_| true, channels(mode), cut).line(mode);
    Coded { mode, pattern: 0, apart: 0, lines: vec![line] }
}

/// One channel on a line of its own.
fn apart(texels: &[[u8; 4]; 16], mode: &'static Mode, apart: usize, cut: bool) -> Coded {
    let (mut others, mut own) = (channels(mode), [false; 4]);
    (others[apart], own[apart]) = (false, true);
    let lines = [others, own].map(|channels| Group::of(texels, |_| true, channels, cut).line(mode));
    Coded { mode, pattern: 0, apart, lines: lines.into() }
}

/// Two subsets, by the pattern that parts the texels best.
fn two(texels: &[[u8; 4]; 16], mode: &'static Mode, cut: bool) -> Coded {
    let pattern = pattern(texels, mode.channels);
    let subset = |i: usize| PATTERNS[pattern] >> i & 1;
    let lines = [0, 1].map(|k| Group::of(texels, |i| subset(i) == k, channels(mode), cut).line(mode));
    Coded { mode, pattern, apart: 0, lines: lines.into() }
}

/// The pattern whose halves' means lie farthest apart, by what that takes off the sum of squares.
fn pattern(texels: &[[u8; 4]; 16], channels: usize) -> usize {
    let all: [i32; 4] = std::array::from_fn(|c| texels.iter().map(|t| i32::from(t[c])).sum());
    let gain = |pattern: u16| -> f32 {
        let mut sums = [0_i32; 4];
        for (i, texel) in texels.iter().enumerate() {
            let is_in = i32::from(pattern >> i & 1);
            for (sum, v) in sums.iter_mut().zip(texel) {
                *sum += is_in * i32::from(*v);
            }
        }
        let count = pattern.count_ones() as i32;
        // The scatter between both, up to a constant: |16 s - n S|² / (n (16 - n)).
        let apart: i32 = (0..channels).map(|c| (16 * sums[c] - count * all[c]) / 16).map(|d| d * d).sum();
        apart as f32 / (count * (16 - count)) as f32
    };
    let gains = PATTERNS.map(gain);
    (1..gains.len()).fold(0, |best, i| if gains[i] > gains[best] { i } else { best })
}

/// The colour channel that a block has worst.
fn worst_channel(texels: &[[u8; 4]; 16], found: &Coded) -> usize {
    let got = found.texels();
    let error =
        |c: usize| -> u32 { texels.iter().zip(&got).map(|(a, b)| u32::from(a[c].abs_diff(b[c]))).map(|d| d * d).sum() };
    let errors = [error(0), error(1), error(2)];
    (1..3).fold(0, |worst, c| if errors[c] > errors[worst] { c } else { worst })
}
