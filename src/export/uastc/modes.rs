//! UASTC's modes: what a block of each holds, its endpoints' steps and its two-subset patterns.
//!
//! Of the 19 modes these twelve are written. Those left out (three subsets, luminance with alpha, 32 weights) gain less than a
//! tenth of a decibel on bark and leaves. Source: Binomial, "UASTC LDR 4x4 Texture Specification", tables of modes, patterns
//! and ranges; ASTC specification (Khronos Data Format 1.3, 23.11 to 23.13) for ranges and weights.

use std::sync::LazyLock;

/// What a block of a mode holds.
#[derive(Debug)]
pub(super) struct Mode {
    /// The bits that say so, and how many.
    pub(super) code: (u8, u32),
    /// Of each weight.
    pub(super) weight_bits: u32,
    /// Which of [`RANGES`] endpoints are in.
    pub(super) range: usize,
    /// 1 or 2.
    pub(super) subsets: usize,
    /// 2 where one channel has weights of its own.
    pub(super) planes: usize,
    /// 3 or 4.
    pub(super) channels: usize,
    /// How many bits are spent on hints for BC1, which are left at none: 1 or 2.
    pub(super) bc1_bits: u32,
    /// Whether five bits tell a shift of ETC1's colours, left at none.
    pub(super) has_bias: bool,
}

/// Sixteen weights, opaque.
pub(super) static FINE: Mode = opaque((0x1, 4), 4, 4, 1, 1);
/// Two subsets of eight weights, coarse endpoints, opaque.
pub(super) static TWO_FINE: Mode = opaque((0x1D, 5), 3, 0, 2, 1);
/// Two subsets of four weights, opaque.
pub(super) static TWO: Mode = opaque((0x13, 5), 2, 1, 2, 1);
/// Eight weights, exact endpoints, opaque.
pub(super) static EXACT: Mode = opaque((0xB, 5), 3, 5, 1, 1);
/// One channel apart from the others, four weights, opaque.
pub(super) static APART: Mode = opaque((0x1B, 5), 2, 3, 1, 2);
/// Two subsets of four weights, coarse endpoints.
pub(super) static ALPHA_TWO: Mode = alpha((0xF, 5), 2, 0, (2, 1), 2, true);
/// Sixteen weights.
pub(super) static ALPHA_FINE: Mode = alpha((0x2, 3), 4, 2, (1, 1), 1, false);
/// Alpha apart, four weights.
pub(super) static ALPHA_APART: Mode = alpha((0x0, 2), 2, 2, (1, 2), 1, false);
/// Eight weights, fine endpoints.
pub(super) static ALPHA_EIGHT: Mode = alpha((0x6, 3), 3, 4, (1, 1), 1, false);
/// Alpha apart, two weights, exact endpoints.
pub(super) static ALPHA_EDGE: Mode = alpha((0x1F, 5), 1, 5, (1, 2), 2, true);
/// Four weights, exact endpoints.
pub(super) static ALPHA_EXACT: Mode = alpha((0xD, 5), 2, 5, (1, 1), 2, true);
/// The bits that say that a block is of one colour.
pub(super) const SOLID: (u8, u32) = (0x17, 5);

const fn opaque(code: (u8, u32), weight_bits: u32, range: usize, subsets: usize, planes: usize) -> Mode {
    Mode { code, weight_bits, range, subsets, planes, channels: 3, bc1_bits: 2, has_bias: true }
}

const fn alpha(
    code: (u8, u32),
    weight_bits: u32,
    range: usize,
    (subsets, planes): (usize, usize),
    bc1_bits: u32,
    has_bias: bool,
) -> Mode {
    Mode { code, weight_bits, range, subsets, planes, channels: 4, bc1_bits, has_bias }
}

/// Weights by their number of bits, in 64ths.
pub(super) const fn weights(bits: u32) -> &'static [u8] {
    match bits {
        1 => &[0, 64],
        2 => &[0, 21, 43, 64],
        3 => &[0, 9, 18, 27, 37, 46, 55, 64],
        _ => &[0, 4, 8, 12, 17, 21, 25, 29, 35, 39, 43, 47, 52, 56, 60, 64],
    }
}

/// What a number of several in one code is, beside its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Digit {
    /// Nothing.
    None,
    /// One of three; five of them share eight bits.
    Trit,
    /// One of five; three of them share seven bits.
    Quint,
}

/// Steps of endpoints.
pub(super) struct Range {
    /// Plain bits of each.
    pub(super) bits: u32,
    /// What comes before them.
    pub(super) digit: Digit,
    /// What each code means, 0..=255.
    pub(super) values: Vec<u8>,
    /// The code that is nearest to each value.
    pub(super) nearest: [u8; 256],
}

/// Of 16, 40, 48, 160, 192 and 256 steps.
pub(super) static RANGES: LazyLock<[Range; 6]> = LazyLock::new(|| {
    [
        Range::new(4, Digit::None, 0, ""),
        Range::new(3, Digit::Quint, 26, "cb0000cbc"),
        Range::new(4, Digit::Trit, 22, "dcb000dcb"),
        Range::new(5, Digit::Quint, 6, "edcb0000e"),
        Range::new(6, Digit::Trit, 5, "fedcb000f"),
        Range::new(8, Digit::None, 0, ""),
    ]
});

impl Range {
    /// `c` and `b` are the specification's C and B; a letter of B is a bit of the code, `a` the lowest.
    fn new(bits: u32, digit: Digit, c: u32, b: &str) -> Self {
        let digits = match digit {
            Digit::None => 1,
            Digit::Trit => 3,
            Digit::Quint => 5,
        };
        let value = |code: u32| {
            let (plain, high) = (code & ((1 << bits) - 1), code >> bits);
            if digit == Digit::None {
                // Four bits twice, or eight as they are.
                return if bits == 4 { plain * 17 } else { plain };
            }
            let bit = |letter: u8| if letter == b'0' { 0 } else { plain >> (letter - b'a') & 1 };
            let b = b.bytes().fold(0, |sum, letter| sum << 1 | bit(letter));
            let all = if plain & 1 == 1 { 511 } else { 0 };
            let value = (high * c + b) ^ all;
            all & 0x80 | value >> 2
        };
        let values: Vec<u8> = (0..digits << bits).map(|code| value(code) as u8).collect();
        let nearest = std::array::from_fn(|wanted| {
            let far = |code: &usize| (usize::from(values[*code]).abs_diff(wanted), values[*code]);
            (0..values.len()).min_by_key(far).unwrap_or(0) as u8
        });
        Self { bits, digit, values, nearest }
    }
}

/// The patterns of two subsets: bit `i` is the subset of texel `i`.
pub(super) static PATTERNS: [u16; 30] = [
    0xCCCC, 0x8888, 0x1111, 0xECC8, 0x377F, 0xFEEC, 0x0137, 0x137F, 0xC800, 0x0013, 0xFE80, 0x17FF, 0x0017, 0x00FF,
    0xFFF0, 0x0FFF, 0xFF71, 0x8EFF, 0x08CE, 0x008C, 0x7310, 0xCEFF, 0x7331, 0x088C, 0xCEEF, 0x6666, 0xF00F, 0x5555,
    0x0F0F, 0x36C9,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_span_all_values_in_even_steps() {
        for (range, levels) in RANGES.iter().zip([16, 40, 48, 160, 192, 256]) {
            let mut sorted = range.values.clone();
            sorted.sort_unstable();
            assert_eq!((sorted.len(), sorted[0], sorted[levels - 1]), (levels, 0, 255));
            let widest = sorted.windows(2).map(|p| p[1] - p[0]).max().unwrap();
            // The two halves of a range meet in a wider step: 123 and 132 of forty.
            assert!(
                sorted.windows(2).all(|p| p[0] < p[1]) && usize::from(widest) <= 255 / (levels - 1) + 3,
                "{levels}: {widest}"
            );
            for value in 0..=255_u8 {
                let found = range.values[usize::from(range.nearest[usize::from(value)])];
                assert!(found.abs_diff(value) <= widest.div_ceil(2));
            }
        }
    }
}
