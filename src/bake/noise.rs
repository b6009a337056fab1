//! Lattice noise that tiles: gradient noise, its octaves, and cell (Worley) noise.
//!
//! Coordinates are in lattice cells; a field repeats after `period` cells along each axis, so a picture that spans
//! `period` cells has no seam. Only additions, products, floors and square roots are used: the same bits everywhere.
//! Sources: Perlin 2002, "Improving Noise" (the fade curve); Worley 1996, "A Cellular Texture Basis Function".

use crate::base::Seed;

/// One field of noise: an address and the cells after which it repeats.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    seed: u32,
    period: [i32; 2],
}

/// What [`Noise::cells`] finds at a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Distance to the border between the nearest cell and its neighbour, in widths of a cell; 0 on the border. The
    /// tile counts as square, so in long cells borders are as wide across as along.
    pub(super) border: f32,
    /// Offset from the nearest cell's centre, in cells.
    pub(super) offset: [f32; 2],
    /// Bits that name the nearest cell.
    pub(super) id: u32,
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
    pub(super) fn octaves(self, u: f32, v: f32, octaves: u32) -> f32 {
        let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
        let mut field = self;
        for i in 0..octaves {
            sum += weight * field.at(u, v);
            total += weight;
            weight *= 0.5;
            field = Self { period: [field.period[0] * 2, field.period[1] * 2], ..self.shifted(i + 1) };
        }
        if total > 0.0 { 1.4 * sum / total } else { 0.0 }
    }

    /// The cell at a place given as shares of the tile. Centres lie in the middle of their lattice cell, displaced by
    /// up to half of `jitter` (0..=1) along each axis.
    pub(super) fn cells(self, u: f32, v: f32, jitter: f32) -> Cell {
        let (x, y) = (u * self.period[0] as f32, v * self.period[1] as f32);
        let ((bx, dx), (by, dy)) = (split(x), split(y));
        let mut near = [(0.0_f32, 0.0_f32); 9];
        let (mut best, mut best_at, mut id) = (f32::MAX, 0, 0);
        let rows = [-1, 0, 1].map(|oy| self.row(wrap(by + oy, self.period[1])));
        for (k, slot) in near.iter_mut().enumerate() {
            let (ox, oy) = (k as i32 % 3 - 1, k as i32 / 3 - 1);
            let h = in_row(rows[k / 3], wrap(bx + ox, self.period[0]));
            let rx = ox as f32 + 0.5 + 0.5 * jitter * low(h) - dx;
            let ry = oy as f32 + 0.5 + 0.5 * jitter * high(h) - dy;
            *slot = (rx, ry);
            let d = rx * rx + ry * ry;
            if d < best {
                (best, best_at, id) = (d, k, scramble(h));
            }
        }
        let (cx, cy) = near[best_at];
        let squash = self.period[1] as f32 / self.period[0] as f32;
        let mut border = f32::MAX;
        for (k, &(rx, ry)) in near.iter().enumerate() {
            let (ex, ey) = (rx - cx, ry - cy);
            // Distance to the perpendicular bisector of the two centres; its gradient as seen in the square tile.
            let length = (ex * ex + ey * ey * squash * squash).sqrt();
            if k != best_at && length > 1e-6 {
                border = border.min((0.5 * (rx + cx) * ex + 0.5 * (ry + cy) * ey) / length);
            }
        }
        Cell { border: border.max(0.0), offset: [-cx, -cy], id }
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
            let (a, b) = (noise.cells(u, v, 0.8), noise.cells(u + 1.0, v + 1.0, 0.8));
            assert!(a.id == b.id && (a.border - b.border).abs() < 1e-4);
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

    #[test]
    fn the_border_of_a_cell_is_where_its_name_changes() {
        let noise = Noise::new(Seed::new(3), 6, 6);
        let mut before = noise.cells(0.0, 0.37, 0.9);
        for i in 1..2000 {
            let cell = noise.cells(i as f32 / 2000.0, 0.37, 0.9);
            if cell.id != before.id {
                assert!(cell.border < 0.02 && before.border < 0.02, "{cell:?}");
            }
            before = cell;
        }
    }
}
