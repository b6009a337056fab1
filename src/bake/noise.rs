//! Lattice noise that tiles: gradient noise and its octaves; `noise_table` has them by the row, and cells.
//!
//! Coordinates are in lattice cells; a field repeats after `period` cells along each axis, so a picture that spans
//! `period` cells has no seam. Only additions, products, floors and square roots are used: the same bits everywhere.
//! Sources: Perlin 2002, "Improving Noise" (the fade curve).

use crate::base::Seed;

/// One field of noise: an address and the cells after which it repeats.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    seed: u32,
    period: [i32; 2],
}

impl Noise {
    /// The field at `seed` that repeats after `columns` × `rows` cells, each at least 1.
    pub(super) fn new(seed: Seed, columns: u32, rows: u32) -> Self {
        let clamp = |n: u32| n.clamp(1, 1 << 20) as i32;
        Self { seed: (seed.bits() >> 32) as u32, period: [clamp(columns), clamp(rows)] }
    }

    /// The same field at another address.
    pub(super) const fn shifted(self, by: u32) -> Self {
        Self { seed: scramble(self.seed ^ by.wrapping_mul(0x9e37_79b9)), period: self.period }
    }

    /// Gradient noise at a place given as shares of the tile, about -1..=1, mean 0.
    #[cfg(test)]
    pub(super) fn at(self, u: f32, v: f32) -> f32 {
        self.gradient(u * self.period[0] as f32, v * self.period[1] as f32)
    }

    /// Gradient noise at lattice coordinates, about -1..=1, mean 0.
    pub(super) fn gradient(self, x: f32, y: f32) -> f32 {
        let ((fx, dx), (fy, dy)) = (split(x), split(y));
        let x0 = wrap(fx, self.period[0]);
        let y0 = wrap(fy, self.period[1]);
        let x1 = if x0 + 1 == self.period[0] { 0 } else { x0 + 1 };
        let y1 = if y0 + 1 == self.period[1] { 0 } else { y0 + 1 };
        let (h0, h1) = (self.row(y0), self.row(y1));
        let corner = |cx: i32, row: u32, ox: f32, oy: f32| {
            let h = in_row(row, cx);
            low(h) * ox + high(h) * oy
        };
        let (sx, sy) = (fade(dx), fade(dy));
        let top = mix(corner(x0, h0, dx, dy), corner(x1, h0, dx - 1.0, dy), sx);
        let bottom = mix(corner(x0, h1, dx, dy - 1.0), corner(x1, h1, dx - 1.0, dy - 1.0), sx);
        1.5 * mix(top, bottom, sy)
    }

    /// The sum of `octaves` fields, each of twice the frequency and half the strength of the one before; about
    /// -1..=1. `u`, `v` are shares of the tile.
    #[cfg(test)]
    pub(super) fn octaves(self, u: f32, v: f32, octaves: u32) -> f32 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (field, weight) in self.each_octave(octaves) {
            sum += weight * field.at(u, v);
            total += weight;
        }
        if total > 0.0 { 1.4 * sum / total } else { 0.0 }
    }

    /// The fields of [`octaves`](Self::octaves) and their weights.
    pub(super) fn each_octave(self, octaves: u32) -> impl Iterator<Item = (Self, f32)> {
        (0..octaves).scan((self, 1.0), move |(field, weight), i| {
            let this = (*field, *weight);
            *field = Self { period: [field.period[0] * 2, field.period[1] * 2], ..self.shifted(i + 1) };
            *weight *= 0.5;
            Some(this)
        })
    }

    /// Columns and rows after which the field repeats.
    pub(super) fn period(self) -> [usize; 2] {
        self.period.map(|n| n as usize)
    }

    /// The random vector of a lattice point, each component -1..=1.
    pub(super) fn vector(self, x: usize, y: usize) -> [f32; 2] {
        let h = in_row(self.row(y as i32), x as i32);
        [low(h), high(h)]
    }

    /// Bits that name a lattice point.
    pub(super) fn name(self, x: usize, y: usize) -> u32 {
        scramble(in_row(self.row(y as i32), x as i32))
    }

    fn row(self, y: i32) -> u32 {
        scramble((y as u32).wrapping_add(self.seed))
    }
}

/// The bits of a lattice point in a row.
const fn in_row(row: u32, x: i32) -> u32 {
    scramble((x as u32).wrapping_mul(0x9e37_79b1) ^ row)
}

/// A number in 0.0..1.0 from the bits of a cell, another one for each `salt`.
pub(super) fn unit(id: u32, salt: u32) -> f32 {
    (scramble(id ^ salt.wrapping_mul(0x85eb_ca6b)) >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Linear interpolation.
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Floor and fraction. Without SSE 4.1 `f32::floor` is a call; a cast and a comparison are not.
fn split(x: f32) -> (i32, f32) {
    let cut = x as i32;
    let floor = if x < cut as f32 { cut - 1 } else { cut };
    (floor, x - floor as f32)
}

/// `i` modulo `period`; most places lie in the tile or just beside it, where no division is needed.
fn wrap(i: i32, period: i32) -> i32 {
    if i >= 0 && i < period {
        i
    } else if i < 0 && i + period >= 0 {
        i + period
    } else {
        i.rem_euclid(period)
    }
}

fn low(h: u32) -> f32 {
    (h & 0xffff) as f32 * (1.0 / 32_767.5) - 1.0
}

fn high(h: u32) -> f32 {
    (h >> 16) as f32 * (1.0 / 32_767.5) - 1.0
}

fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// An integer mixer with low bias (Wellons 2018, "lowbias32").
const fn scramble(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_repeat_after_one_tile_and_not_before() {
        let noise = Noise::new(Seed::new(1), 5, 3);
        for i in 0..50 {
            let (u, v) = (i as f32 * 0.017, i as f32 * 0.013);
            assert!((noise.at(u, v) - noise.at(u + 1.0, v)).abs() < 1e-4);
            assert!((noise.octaves(u, v, 4) - noise.octaves(u, v - 1.0, 4)).abs() < 1e-3);
        }
        assert!((noise.at(0.13, 0.2) - noise.at(0.33, 0.2)).abs() > 1e-3);
    }

    #[test]
    fn gradient_noise_is_centred_and_bounded() {
        let noise = Noise::new(Seed::new(2), 64, 64);
        let values: Vec<f32> = (0..4096).map(|i| noise.gradient(i as f32 * 0.37, i as f32 * 0.11)).collect();
        let mean = values.iter().sum::<f32>() / 4096.0;
        assert!(mean.abs() < 0.05, "{mean}");
        assert!(values.iter().all(|v| v.abs() < 1.6) && values.iter().any(|v| v.abs() > 0.3));
    }
}
