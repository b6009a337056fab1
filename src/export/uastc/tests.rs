//! What is encoded is decoded here from the bits alone, as the specification has it.

use super::modes::{Digit, RANGES, SOLID, weights};
use super::*;
use crate::base::Seed;

/// Reads bits from the lowest up.
struct Reader(u128);

impl Reader {
    fn take(&mut self, count: u32) -> usize {
        let value = self.0 & ((1 << count) - 1);
        self.0 >>= count;
        value as usize
    }
}

/// All modes that are written.
fn all_modes() -> [&'static Mode; 11] {
    use modes::*;
    [
        &FINE,
        &TWO_FINE,
        &TWO,
        &EXACT,
        &APART,
        &ALPHA_TWO,
        &ALPHA_FINE,
        &ALPHA_APART,
        &ALPHA_EIGHT,
        &ALPHA_EDGE,
        &ALPHA_EXACT,
    ]
}

/// The texels of a block.
pub(in super::super) fn decode(bytes: [u8; 16]) -> [[u8; 4]; 16] {
    let mut bits = Reader(u128::from_le_bytes(bytes));
    let starts = |(code, count): (u8, u32)| bits.0 & ((1 << count) - 1) == u128::from(code);
    if starts(SOLID) {
        bits.take(SOLID.1);
        return [std::array::from_fn(|_| bits.take(8) as u8); 16];
    }
    let mode = all_modes().into_iter().find(|mode| starts(mode.code)).expect("a mode");
    let has_alpha = mode.channels == 4;
    bits.take(mode.code.1 + mode.bc1_bits + 8 + if mode.has_bias { 5 } else { 0 });
    if has_alpha {
        assert!(bits.take(8) >= 16, "alpha's multiplier");
    }
    let pattern = if mode.subsets == 2 { PATTERNS[bits.take(5)] } else { 0 };
    let apart = if mode.planes == 2 { bits.take(2) } else { 9 };
    let range = &RANGES[mode.range];
    let count = mode.channels * 2 * mode.subsets;
    let mut digits = Vec::new();
    let (together, base, sizes): (usize, usize, &[u32]) = match range.digit {
        Digit::None => (count, 1, &[]),
        Digit::Trit => (5, 3, &[2, 4, 5, 7, 8]),
        Digit::Quint => (3, 5, &[3, 5, 7]),
    };
    while digits.len() < count {
        let here = together.min(count - digits.len());
        let mut value = if base > 1 { bits.take(sizes[here - 1]) } else { 0 };
        for _ in 0..here {
            digits.push(value % base);
            value /= base;
        }
    }
    let ends: Vec<u8> = digits.into_iter().map(|d| range.values[d << range.bits | bits.take(range.bits)]).collect();
    let subset = |i: usize| usize::from(pattern >> i & 1);
    let first: Vec<usize> = (0..mode.subsets).map(|s| (0..16).find(|&i| subset(i) == s).unwrap()).collect();
    let table = weights(mode.weight_bits);
    std::array::from_fn(|i| {
        let short = u32::from(first.contains(&i));
        let at: Vec<u32> = (0..mode.planes).map(|_| u32::from(table[bits.take(mode.weight_bits - short)])).collect();
        std::array::from_fn(|c| {
            if c == 3 && !has_alpha {
                return 255;
            }
            let k = (subset(i) * mode.channels + c) * 2;
            let w = at[usize::from(c == apart)];
            let [low, high] = [ends[k], ends[k + 1]].map(|v| u32::from(v) << 8 | u32::from(v));
            (((low * (64 - w) + high * w + 32) / 64) >> 8) as u8
        })
    })
}

fn noise(seed: u64) -> [[u8; 4]; 16] {
    let seed = Seed::new(seed);
    std::array::from_fn(|i| std::array::from_fn(|c| seed.at(i as u64 * 4 + c as u64).bits() as u8))
}

#[test]
fn every_mode_says_what_it_means() {
    for k in 0..200 {
        let texels = noise(k);
        for mode in all_modes() {
            let mut coded = vec![];
            match (mode.subsets, mode.planes) {
                (2, _) => coded.push(two(&texels, mode, false)),
                (_, 2) => coded.extend((0..mode.channels).map(|c| apart(&texels, mode, c, false))),
                _ => coded.push(one(&texels, mode, false)),
            }
            for coded in coded {
                let got = coded.texels();
                assert_eq!(decode(coded.bytes(&Hints::of(&got))), got, "{mode:?}");
                let error: u32 = texels
                    .iter()
                    .zip(&got)
                    .flat_map(|(a, b)| (0..mode.channels).map(|c| u32::from(a[c].abs_diff(b[c])).pow(2)))
                    .sum();
                assert_eq!(error, coded.error());
            }
        }
    }
}

#[test]
fn one_colour_stays_it_and_what_is_clear_is_one_colour() {
    let color = [7, 200, 90, 255];
    assert_eq!(decode(block(&[color; 16], Alpha::None)), [color; 16]);
    let mut clear = noise(3);
    clear.iter_mut().for_each(|t| t[3] = 0);
    let got = decode(block(&clear, Alpha::CutOut));
    assert!(got.iter().all(|t| *t == got[0] && t[3] == 0));
}

#[test]
fn two_colours_and_ramps_come_out_right() {
    for pattern in PATTERNS {
        let texels =
            std::array::from_fn(|i| if pattern >> i & 1 == 1 { [10, 20, 30, 255] } else { [90, 140, 60, 255] });
        let got = decode(block(&texels, Alpha::None));
        assert!(got.iter().flatten().zip(texels.iter().flatten()).all(|(a, b)| a.abs_diff(*b) <= 2), "{got:?}");
    }
    let ramp = std::array::from_fn(|i| [i as u8 * 9, 40 + i as u8 * 5, 30, 255]);
    let got = decode(block(&ramp, Alpha::None));
    assert!(got.iter().flatten().zip(ramp.iter().flatten()).all(|(a, b)| a.abs_diff(*b) <= 4), "{got:?}");
}

#[test]
fn cut_outs_stay_on_their_side() {
    let (mut crossed, mut all) = (0, 0);
    for k in 0..4000 {
        let seed = Seed::new(k);
        // A leaf's edge across the block, colour with some noise; alpha keeps 8 steps off the cut-off.
        let (dx, dy, at) = (seed.at(0).range(-1.0, 1.0), seed.at(1).range(-1.0, 1.0), seed.at(2).range(-2.0, 2.0));
        let texels: [[u8; 4]; 16] = std::array::from_fn(|i| {
            let soft = ((i % 4) as f32 - 1.5) * dx + ((i / 4) as f32 - 1.5) * dy + at;
            let alpha = (128.0 + soft * 110.0).clamp(0.0, 255.0) as u8;
            let alpha = if alpha >= 128 { alpha.max(136) } else { alpha.min(119) };
            let n = seed.child("n").at(i as u64).range(-12.0, 12.0);
            [(70.0 + n) as u8, (110.0 + n) as u8, (40.0 + n * 0.5) as u8, alpha]
        });
        let got = decode(block(&texels, Alpha::CutOut));
        all += 16;
        crossed += texels.iter().zip(&got).filter(|(a, b)| (a[3] >= 128) != (b[3] >= 128)).count();
    }
    assert!(crossed * 1000 <= all, "{crossed} of {all}");
}

#[test]
fn pictures_of_any_size_are_whole_blocks_and_the_edge_repeats() {
    for (width, height) in [(1, 1), (2, 2), (5, 3), (8, 12)] {
        let texels: Vec<[u8; 4]> = (0..width * height).map(|i| [i as u8, 2 * i as u8, 9, 255]).collect();
        let bytes = encode(&texels, (width, height), Alpha::None);
        assert_eq!(bytes.len(), width.div_ceil(4) * height.div_ceil(4) * 16);
    }
    let bytes = encode(&[[1, 2, 3, 255]], (1, 1), Alpha::None);
    assert_eq!(decode(bytes.try_into().unwrap()), [[1, 2, 3, 255]; 16]);
}
