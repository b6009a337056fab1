//! Endpoints and weights of some texels: a line through their colours, and each texel's place on it.
//!
//! The line is the principal axis of the colours; its ends are then moved by least squares for the weights that were found,
//! and both are kept in whole steps all along. Everything is IEEE addition, multiplication, division and square root in a
//! fixed order, so that bytes are the same on every machine.

use super::modes::{Mode, RANGES, weights};

/// What leaving the texel's side of the cut-off costs, as squared difference: as much as alpha wrong by 24.
const CROSSED: u32 = 576;

/// The texels that a line is for, in a block's order.
pub(super) struct Group {
    colors: [[u8; 4]; 16],
    count: usize,
    /// Which channels it is for.
    channels: [bool; 4],
    /// Whether alpha may not cross the cut-off.
    cut: bool,
}

/// A line and the places on it.
#[derive(Clone)]
pub(super) struct Line {
    /// Codes of both ends, by channel.
    pub(super) codes: [[u8; 2]; 4],
    /// By texel of the group.
    pub(super) weights: [u8; 16],
    /// Sum of squared differences, with what crossing costs.
    pub(super) error: u32,
}

impl Group {
    /// The texels of a block that `has`, for some of its channels.
    pub(super) fn of(block: &[[u8; 4]; 16], has: impl Fn(usize) -> bool, channels: [bool; 4], cut: bool) -> Self {
        let mut group = Self { colors: [[0; 4]; 16], count: 0, channels, cut: cut && channels[3] };
        for color in (0..16).filter(|&i| has(i)).map(|i| &block[i]) {
            for (to, (from, wanted)) in group.colors[group.count].iter_mut().zip(color.iter().zip(channels)) {
                *to = if wanted { *from } else { 0 };
            }
            group.count += 1;
        }
        group
    }

    fn texels(&self) -> &[[u8; 4]] {
        &self.colors[..self.count]
    }

    /// The best line found in a mode.
    pub(super) fn line(&self, mode: &Mode) -> Line {
        let mut best = self.placed(self.axis_ends(), mode);
        for _ in 0..2 {
            if best.error == 0 {
                break;
            }
            let Some(ends) = self.refined(&best, mode) else { break };
            let next = self.placed(ends, mode);
            if next.error >= best.error {
                break;
            }
            best = next;
        }
        best
    }

    /// The ends of the principal axis.
    fn axis_ends(&self) -> [[f32; 4]; 2] {
        let (mut low, mut high, mut mean) = ([255.0_f32; 4], [0.0_f32; 4], [0.0_f32; 4]);
        for color in self.texels() {
            for c in 0..4 {
                let v = f32::from(color[c]);
                (low[c], high[c], mean[c]) = (low[c].min(v), high[c].max(v), mean[c] + v);
            }
        }
        let count = self.count as f32;
        mean = mean.map(|sum| sum / count);
        let mut spread = [[0.0_f32; 4]; 4];
        for color in self.texels() {
            let d: [f32; 4] = std::array::from_fn(|c| f32::from(color[c]) - mean[c]);
            for (row, a) in spread.iter_mut().zip(d) {
                for (sum, b) in row.iter_mut().zip(d) {
                    *sum += a * b;
                }
            }
        }
        // Starts from the row that holds most: no other is so surely not across the axis.
        let most = (1..4).fold(0, |most, c| if spread[c][c] > spread[most][most] { c } else { most });
        let mut axis = spread[most];
        for _ in 0..5 {
            let next: [f32; 4] = std::array::from_fn(|r| dot(spread[r], axis));
            let size = next.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
            if size <= 0.0 {
                break;
            }
            axis = next.map(|v| v / size);
        }
        let length = dot(axis, axis).sqrt();
        if length <= 0.0 {
            return [mean, mean];
        }
        axis = axis.map(|v| v / length);
        let (mut first, mut last) = (f32::MAX, f32::MIN);
        for color in self.texels() {
            let along = dot(std::array::from_fn(|c| f32::from(color[c]) - mean[c]), axis);
            (first, last) = (first.min(along), last.max(along));
        }
        [first, last].map(|t| std::array::from_fn(|c| mean[c] + axis[c] * t))
    }

    /// The ends that suit the weights best; none where all weights are alike.
    fn refined(&self, line: &Line, mode: &Mode) -> Option<[[f32; 4]; 2]> {
        let table = weights(mode.weight_bits);
        let (mut aa, mut ab, mut bb) = (0.0_f32, 0.0_f32, 0.0_f32);
        let (mut ax, mut bx) = ([0.0_f32; 4], [0.0_f32; 4]);
        for (color, weight) in self.texels().iter().zip(line.weights) {
            let b = f32::from(table[usize::from(weight)]) / 64.0;
            let a = 1.0 - b;
            aa += a * a;
            ab += a * b;
            bb += b * b;
            for c in 0..4 {
                let v = f32::from(color[c]);
                ax[c] += a * v;
                bx[c] += b * v;
            }
        }
        let det = aa * bb - ab * ab;
        if det < 1e-3 {
            return None;
        }
        Some([
            std::array::from_fn(|c| (ax[c] * bb - bx[c] * ab) / det),
            std::array::from_fn(|c| (bx[c] * aa - ax[c] * ab) / det),
        ])
    }

    /// Ends in whole steps, and the weights that come nearest with them.
    fn placed(&self, ends: [[f32; 4]; 2], mode: &Mode) -> Line {
        let range = &RANGES[mode.range];
        let mut codes = [[0_u8; 2]; 4];
        let mut values = [[0_u8; 4]; 2];
        for c in (0..4).filter(|&c| self.channels[c]) {
            for e in 0..2 {
                codes[c][e] = range.nearest[usize::from((ends[e][c] + 0.5).clamp(0.0, 255.0) as u8)];
                values[e][c] = range.values[usize::from(codes[c][e])];
            }
        }
        let table = weights(mode.weight_bits);
        let mut colors = [[0_i32; 4]; 16];
        for (color, &weight) in colors.iter_mut().zip(table) {
            *color = std::array::from_fn(|c| i32::from(between(values[0][c], values[1][c], weight)));
        }
        let start: [f32; 4] = std::array::from_fn(|c| f32::from(values[0][c]));
        let way: [f32; 4] = std::array::from_fn(|c| f32::from(values[1][c]) - start[c]);
        let length = dot(way, way);
        let last = table.len() - 1;
        let scale = if length > 0.0 { last as f32 / length } else { 0.0 };
        let mut line = Line { codes, weights: [0; 16], error: 0 };
        for (texel, weight) in self.texels().iter().zip(&mut line.weights) {
            let at = dot(std::array::from_fn(|c| f32::from(texel[c]) - start[c]), way) * scale;
            let at = (at + 0.5).clamp(0.0, last as f32) as usize;
            let mut best = u32::MAX;
            for (w, color) in colors.iter().enumerate().take((at + 1).min(last) + 1).skip(at.saturating_sub(1)) {
                let mut error = 0;
                for c in 0..4 {
                    let d = color[c] - i32::from(texel[c]);
                    error += (d * d) as u32;
                }
                if self.cut && (color[3] >= 128) != (texel[3] >= 128) {
                    error += CROSSED;
                }
                if error < best {
                    (best, *weight) = (error, w as u8);
                }
            }
            line.error += best;
        }
        line
    }
}

fn dot(a: [f32; 4], b: [f32; 4]) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}

/// Between two ends by a weight in 64ths, as decoders do it (ASTC, linear).
pub(super) fn between(low: u8, high: u8, weight: u8) -> u8 {
    let (low, high, weight) = (u32::from(low) * 257, u32::from(high) * 257, u32::from(weight));
    ((low * (64 - weight) + high * weight + 32) >> 6 >> 8) as u8
}
