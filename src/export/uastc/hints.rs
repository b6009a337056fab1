//! What a block tells a transcoder that makes ETC of it, as phones want it: how to halve it, how bright each half's shades
//! are, and the table of its alpha.
//!
//! Other targets (ASTC, BC7) need none, and BC1's are left at none, which has the transcoder find out by itself. Source:
//! "UASTC LDR 4x4 Texture Specification", hints; ETC2 in Khronos Data Format 1.3, 21.

/// The hints of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Hints {
    /// Whether the halves lie one above the other.
    pub(super) is_flipped: bool,
    /// Whether their colours are near enough for five bits and a difference.
    pub(super) is_near: bool,
    /// Table of each half's shades.
    pub(super) tables: [u32; 2],
    /// Table and multiplier of alpha.
    pub(super) alpha: u32,
}

/// The smaller and the greater shade of each table.
const SHADES: [[i32; 2]; 8] = [[2, 8], [5, 17], [9, 29], [13, 42], [18, 60], [24, 80], [33, 106], [47, 183]];
/// Some of alpha's tables, with their numbers.
const ALPHAS: [(u32, [i32; 8]); 4] = [
    (2, [-2, -5, -8, -13, 1, 4, 7, 12]),
    (8, [-2, -6, -8, -10, 1, 5, 7, 9]),
    (11, [-2, -5, -7, -10, 1, 4, 6, 9]),
    (13, [-1, -2, -3, -10, 0, 1, 2, 9]),
];

impl Hints {
    /// The number that shifts no colour.
    pub(super) const NO_BIAS: u32 = 13;

    /// Those of a block as it is decoded.
    pub(super) fn of(texels: &[[u8; 4]; 16]) -> Self {
        let half = |flipped: bool, i: usize| if flipped { i / 8 } else { i % 4 / 2 };
        let means = |flipped: bool| {
            let mut sums = [[0_i32; 3]; 2];
            for (i, texel) in texels.iter().enumerate() {
                for (sum, &v) in sums[half(flipped, i)].iter_mut().zip(&texel[..3]) {
                    *sum += i32::from(v);
                }
            }
            sums
        };
        // Halves that differ most are most alike in themselves.
        let apart = |[a, b]: [[i32; 3]; 2]| (0..3).map(|c| (a[c] - b[c]) * (a[c] - b[c])).sum::<i32>();
        let [beside, above] = [means(false), means(true)];
        let is_flipped = apart(above) > apart(beside);
        let sums = if is_flipped { above } else { beside };
        let five = sums.map(|sum| sum.map(|s| (s * 31 + 1020) / 2040));
        let is_near = (0..3).all(|c| (-4..=3).contains(&(five[1][c] - five[0][c])));
        let tables = std::array::from_fn(|k| {
            let base = sums[k].iter().sum::<i32>() / 24;
            let grays = texels.iter().enumerate().filter(|(i, _)| half(is_flipped, *i) == k);
            let off: Vec<i32> =
                grays.map(|(_, t)| t[..3].iter().map(|&v| i32::from(v)).sum::<i32>() / 3 - base).collect();
            let error = |[small, great]: [i32; 2]| -> i32 {
                let one = |d: i32| (d.abs() - small).abs().min((d.abs() - great).abs());
                off.iter().map(|&d| one(d) * one(d)).sum()
            };
            (0..8).min_by_key(|&table| error(SHADES[table])).unwrap_or(0) as u32
        });
        Self { is_flipped, is_near, tables, alpha: alpha(texels) }
    }

    /// Table, place in it and base colour of one colour.
    pub(super) fn solid(color: [u8; 3]) -> (u32, u32, [u32; 3]) {
        let mut best = (i32::MAX, 0, 0, [0; 3]);
        for (table, [small, great]) in SHADES.into_iter().enumerate().take(3) {
            for (place, shade) in [-great, -small, small, great].into_iter().enumerate() {
                let mut error = 0;
                let base = color.map(|v| {
                    let wanted = (i32::from(v) - shade).clamp(0, 255);
                    let five = (wanted * 31 + 127) / 255;
                    let got = ((five << 3 | five >> 2) + shade).clamp(0, 255);
                    error += (got - i32::from(v)) * (got - i32::from(v));
                    five as u32
                });
                if error < best.0 {
                    best = (error, table as u32, place as u32, base);
                }
            }
        }
        (best.1, best.2, best.3)
    }
}

/// Table and multiplier that alpha comes out best with.
fn alpha(texels: &[[u8; 4]; 16]) -> u32 {
    let alphas = texels.map(|t| i32::from(t[3]));
    let (low, high) = alphas.iter().fold((255, 0), |(low, high), &a| (low.min(a), high.max(a)));
    if low == high {
        return 13 | 1 << 4;
    }
    let mut best = (i32::MAX, 13 | 1 << 4);
    for (number, table) in ALPHAS {
        let (down, span) = (-table[3], table[7] - table[3]);
        // Rounded, as the transcoder does it.
        let center = low + (2 * (high - low) * down + span) / (2 * span);
        let multiplier = ((2 * (high - low) + span) / (2 * span)).clamp(1, 15);
        let shades = table.map(|shade| (center + shade * multiplier).clamp(0, 255));
        let nearest = |a: i32| shades.iter().map(|s| (s - a) * (s - a)).min().unwrap_or(0);
        let error = alphas.iter().map(|&a| nearest(a)).sum();
        if error < best.0 {
            best = (error, number | (multiplier as u32) << 4);
        }
    }
    best.1
}
