//! A block's bits: mode, hints, pattern, endpoints, weights, from the lowest bit up.
//!
//! The first weight of each subset (and plane) is stored without its highest bit, which is 0: where it is not, ends change
//! places and weights are counted from the other end.

use super::fit::{Line, between};
use super::hints::Hints;
use super::modes::{Digit, Mode, PATTERNS, RANGES, SOLID, weights};

/// What a block is in a mode: its lines, a subset or a plane each.
#[derive(Clone)]
pub(super) struct Coded {
    pub(super) mode: &'static Mode,
    /// Number of the pattern, for two subsets.
    pub(super) pattern: usize,
    /// The channel that has weights of its own, for two planes.
    pub(super) apart: usize,
    /// One or two.
    pub(super) lines: Vec<Line>,
}

/// Bits from the lowest up.
#[derive(Default)]
struct Bits {
    all: u128,
    count: u32,
}

impl Bits {
    fn push(&mut self, value: u32, count: u32) {
        self.all |= u128::from(value) << self.count;
        self.count += count;
    }
}

impl Coded {
    /// Sum of squared differences.
    pub(super) fn error(&self) -> u32 {
        self.lines.iter().map(|line| line.error).sum()
    }

    /// Which subset a texel is in.
    fn subset(&self, texel: usize) -> usize {
        if self.mode.subsets == 2 { usize::from(PATTERNS[self.pattern] >> texel & 1) } else { 0 }
    }

    /// By texel and plane: weights, in the block's order.
    fn weights(&self) -> [[u8; 2]; 16] {
        let mut next = [0_usize; 2];
        std::array::from_fn(|texel| {
            if self.mode.planes == 2 {
                return [self.lines[0].weights[texel], self.lines[1].weights[texel]];
            }
            let subset = self.subset(texel);
            let place = next[subset];
            next[subset] += 1;
            [self.lines[subset].weights[place], 0]
        })
    }

    /// Codes of a subset's ends by channel.
    fn codes(&self, subset: usize) -> [[u8; 2]; 4] {
        let mut codes = self.lines[subset].codes;
        if self.mode.planes == 2 {
            codes[self.apart] = self.lines[1].codes[self.apart];
        }
        codes
    }

    /// The texels that a decoder gives.
    pub(super) fn texels(&self) -> [[u8; 4]; 16] {
        let (range, table) = (&RANGES[self.mode.range], weights(self.mode.weight_bits));
        let weights = self.weights();
        std::array::from_fn(|texel| {
            let codes = self.codes(self.subset(texel));
            std::array::from_fn(|c| {
                if c >= self.mode.channels {
                    return 255;
                }
                let plane = usize::from(self.mode.planes == 2 && c == self.apart);
                let [low, high] = codes[c].map(|code| range.values[usize::from(code)]);
                between(low, high, table[usize::from(weights[texel][plane])])
            })
        })
    }

    /// The block's bytes.
    pub(super) fn bytes(&self, hints: &Hints) -> [u8; 16] {
        let mode = self.mode;
        let mut bits = Bits::default();
        bits.push(u32::from(mode.code.0), mode.code.1);
        bits.push(0, mode.bc1_bits);
        bits.push(u32::from(hints.is_flipped), 1);
        bits.push(u32::from(hints.is_near), 1);
        bits.push(hints.tables[0], 3);
        bits.push(hints.tables[1], 3);
        if mode.has_bias {
            bits.push(Hints::NO_BIAS, 5);
        }
        if mode.channels == 4 {
            bits.push(hints.alpha, 8);
        }
        if mode.subsets == 2 {
            bits.push(self.pattern as u32, 5);
        }
        if mode.planes == 2 {
            bits.push(self.apart as u32, 2);
        }
        let mut weights = self.weights();
        let mut codes: Vec<[[u8; 2]; 4]> = (0..mode.subsets).map(|subset| self.codes(subset)).collect();
        let first = |subset: usize| (0..16).find(|&texel| self.subset(texel) == subset).unwrap_or(0);
        let firsts: Vec<usize> = (0..mode.subsets).map(first).collect();
        let last = (1_u8 << mode.weight_bits) - 1;
        for (subset, &first) in firsts.iter().enumerate() {
            for plane in 0..mode.planes {
                if weights[first][plane] <= last / 2 {
                    continue;
                }
                for (texel, weight) in weights.iter_mut().enumerate() {
                    if self.subset(texel) == subset {
                        weight[plane] = last - weight[plane];
                    }
                }
                for (c, ends) in codes[subset].iter_mut().enumerate() {
                    if mode.planes == 1 || (c == self.apart) == (plane == 1) {
                        ends.swap(0, 1);
                    }
                }
            }
        }
        let ends: Vec<u8> = codes.iter().flat_map(|codes| codes[..mode.channels].iter().flatten().copied()).collect();
        push_ends(&mut bits, &ends, mode.range);
        for (texel, weight) in weights.iter().enumerate() {
            let short = u32::from(firsts.contains(&texel));
            for weight in &weight[..mode.planes] {
                bits.push(u32::from(*weight), mode.weight_bits - short);
            }
        }
        bits.all.to_le_bytes()
    }
}

/// Ends as the specification packs them: trits and quints of several together first, then the plain bits of all.
fn push_ends(bits: &mut Bits, ends: &[u8], range: usize) {
    let range = &RANGES[range];
    let (base, together): (u32, usize) = match range.digit {
        Digit::None => (1, ends.len()),
        Digit::Trit => (3, 5),
        Digit::Quint => (5, 3),
    };
    for group in ends.chunks(together) {
        let value = group.iter().rev().fold(0, |sum, &code| sum * base + (u32::from(code) >> range.bits));
        bits.push(value, (base.pow(group.len() as u32) - 1).checked_ilog2().map_or(0, |top| top + 1));
    }
    for &code in ends {
        bits.push(u32::from(code) & ((1 << range.bits) - 1), range.bits);
    }
}

/// The bytes of a block of one colour.
pub(super) fn solid([r, g, b, a]: [u8; 4]) -> [u8; 16] {
    let mut bits = Bits::default();
    bits.push(u32::from(SOLID.0), SOLID.1);
    for channel in [r, g, b, a] {
        bits.push(u32::from(channel), 8);
    }
    let (table, place, base) = Hints::solid([r, g, b]);
    // Five bits a channel, one base for both halves.
    bits.push(1, 1);
    bits.push(table, 3);
    bits.push(place, 2);
    for channel in base {
        bits.push(channel, 5);
    }
    bits.all.to_le_bytes()
}
