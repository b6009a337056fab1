//! Noise by table, for pictures of a million places: the lattice's random values are made once, octaves of places in a
//! row are summed a row at a time, and borders of cells are measured only where they are asked for.
//!
//! Gives the values of [`Noise::at`] and [`Noise::octaves`]; cells are Worley's (1996, "A Cellular Texture Basis
//! Function"). Tables hold one entry for each lattice point of the finest octave.

use super::noise::{Noise, mix};

/// Octaves of gradient noise that tile.
#[derive(Clone, Debug)]
pub(super) struct Octaves {
    tables: Vec<Table>,
    /// What the weighted sum is multiplied and divided by.
    scale: (f32, f32),
}

/// One octave: the gradients of its lattice, the first column and row repeated at the end.
#[derive(Clone, Debug)]
struct Table {
    gradients: Vec<[f32; 2]>,
    columns: usize,
    rows: usize,
    weight: f32,
}

impl Octaves {
    /// As [`Noise::at`].
    pub(super) fn single(field: Noise) -> Self {
        Self { tables: vec![Table::new(field, 1.0)], scale: (1.0, 1.0) }
    }

    /// As [`Noise::octaves`].
    pub(super) fn new(field: Noise, octaves: u32) -> Self {
        let tables: Vec<Table> = field.each_octave(octaves).map(|(field, weight)| Table::new(field, weight)).collect();
        let total: f32 = tables.iter().map(|t| t.weight).sum();
        Self { tables, scale: (1.4, total.max(1e-6)) }
    }

    /// The value at a place given as shares of the tile.
    pub(super) fn at(&self, u: f32, v: f32) -> f32 {
        let sum = self.tables.iter().fold(0.0, |sum, table| sum + table.weight * table.at(u, v));
        self.scale.0 * sum / self.scale.1
    }

    /// The values at the middles of `size` pixels in a row.
    pub(super) fn row(&self, v: f32, size: usize) -> Vec<f32> {
        let mut values = vec![0.0; size];
        self.tables.iter().for_each(|table| table.add_row(v, &mut values));
        values.iter_mut().for_each(|value| *value = self.scale.0 * *value / self.scale.1);
        values
    }
}

impl Table {
    fn new(field: Noise, weight: f32) -> Self {
        let [columns, rows] = field.period();
        let place = |i: usize| (i % (columns + 1) % columns, i / (columns + 1) % rows);
        let gradients = (0..(columns + 1) * (rows + 1)).map(|i| field.vector(place(i).0, place(i).1)).collect();
        Self { gradients, columns, rows, weight }
    }

    fn at(&self, u: f32, v: f32) -> f32 {
        let (x, dx) = split(u * self.columns as f32, self.columns);
        let (y, dy) = split(v * self.rows as f32, self.rows);
        let first = y * (self.columns + 1) + x;
        let corner = |at: usize, ox: f32, oy: f32| self.gradients[at][0] * ox + self.gradients[at][1] * oy;
        let next = first + self.columns + 1;
        let (sx, sy) = (fade(dx), fade(dy));
        let top = mix(corner(first, dx, dy), corner(first + 1, dx - 1.0, dy), sx);
        let bottom = mix(corner(next, dx, dy - 1.0), corner(next + 1, dx - 1.0, dy - 1.0), sx);
        1.5 * mix(top, bottom, sy)
    }

    /// Adds the weighted values of a row of pixels. In one lattice cell everything but the place is constant.
    fn add_row(&self, v: f32, out: &mut [f32]) {
        let size = out.len();
        let (y, dy) = split(v * self.rows as f32, self.rows);
        let sy = fade(dy);
        // The first pixel whose middle lies in a column.
        let start = |x: usize| (2 * x * size).saturating_sub(self.columns).div_ceil(2 * self.columns).min(size);
        for x in 0..self.columns {
            let first = y * (self.columns + 1) + x;
            let next = first + self.columns + 1;
            let [a, b, c, d] = [first, first + 1, next, next + 1].map(|i| self.gradients[i]);
            let (from, to) = (start(x), start(x + 1));
            for (i, out) in out[from..to].iter_mut().enumerate() {
                let dx = ((from + i) as f32 + 0.5) / size as f32 * self.columns as f32 - x as f32;
                let sx = fade(dx);
                let top = mix(a[0] * dx + a[1] * dy, b[0] * (dx - 1.0) + b[1] * dy, sx);
                let bottom = mix(c[0] * dx + c[1] * (dy - 1.0), d[0] * (dx - 1.0) + d[1] * (dy - 1.0), sx);
                *out += self.weight * (1.5 * mix(top, bottom, sy));
            }
        }
    }
}

/// What [`Cells`] finds at a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Offset from the nearest cell's centre, in cells.
    pub(super) offset: [f32; 2],
    /// Bits that name the nearest cell.
    pub(super) id: u32,
}

/// Cell noise that tiles: centres in the middle of their lattice cell, displaced along each axis.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// Centres in their cell and names, with one more cell on every side.
    centres: Vec<([f32; 2], u32)>,
    columns: usize,
    rows: usize,
}

impl Cells {
    /// The cells of a field; centres are displaced by up to half of `jitter`, 0..=1.
    pub(super) fn new(field: Noise, jitter: f32) -> Self {
        let [columns, rows] = field.period();
        let centres = (0..(columns + 2) * (rows + 2))
            .map(|i| {
                let (x, y) = ((i % (columns + 2) + columns - 1) % columns, (i / (columns + 2) + rows - 1) % rows);
                let [a, b] = field.vector(x, y);
                ([0.5 + 0.5 * jitter * a, 0.5 + 0.5 * jitter * b], field.name(x, y))
            })
            .collect();
        Self { centres, columns, rows }
    }

    /// The nearest centre as seen from a place given as shares of the tile.
    pub(super) fn nearest(&self, u: f32, v: f32) -> Cell {
        self.around(u, v).0
    }

    /// The nearest centre, and the distance to the border between its cell and a neighbour's, in widths of a cell; 0 on
    /// the border. The tile counts as square, so in long cells borders are as wide across as along.
    pub(super) fn bordered(&self, u: f32, v: f32) -> (Cell, f32) {
        let (cell, near) = self.around(u, v);
        let [cx, cy] = cell.offset.map(|o| -o);
        let squash = self.rows as f32 / self.columns as f32;
        let mut distances = [f32::MAX; 9];
        for (distance, &[rx, ry]) in distances.iter_mut().zip(&near) {
            let (ex, ey) = (rx - cx, ry - cy);
            // Distance to the perpendicular bisector of the two centres; its gradient as seen in the square tile.
            let length = (ex * ex + ey * ey * squash * squash).sqrt();
            let away = (0.5 * (rx + cx) * ex + 0.5 * (ry + cy) * ey) / length.max(1e-6);
            *distance = if length > 1e-6 { away } else { f32::MAX };
        }
        let border = distances.into_iter().fold(f32::MAX, |a, b| if b < a { b } else { a });
        (cell, border.max(0.0))
    }

    /// The nearest centre, and the nine about the place, relative to it.
    fn around(&self, u: f32, v: f32) -> (Cell, [[f32; 2]; 9]) {
        let (x, dx) = split(u * self.columns as f32, self.columns);
        let (y, dy) = split(v * self.rows as f32, self.rows);
        let mut near = [[0.0_f32; 2]; 9];
        let (mut best, mut best_at) = (f32::MAX, 0);
        for oy in 0..3 {
            let first = (y + oy) * (self.columns + 2) + x;
            for (ox, (centre, _)) in self.centres[first..first + 3].iter().enumerate() {
                let rx = ox as f32 - 1.0 + centre[0] - dx;
                let ry = oy as f32 - 1.0 + centre[1] - dy;
                let k = oy * 3 + ox;
                near[k] = [rx, ry];
                let d = rx * rx + ry * ry;
                if d < best {
                    (best, best_at) = (d, k);
                }
            }
        }
        let id = self.centres[(y + best_at / 3) * (self.columns + 2) + x + best_at % 3].1;
        (Cell { offset: near[best_at].map(|c| -c), id }, near)
    }
}

/// The lattice cell of a coordinate, wrapped, and the place in it.
fn split(x: f32, period: usize) -> (usize, f32) {
    // Without SSE 4.1 `f32::floor` is a call; a cast and a comparison are not.
    let cut = x as i32;
    let floor = if x < cut as f32 { cut - 1 } else { cut };
    let period = period as i32;
    let cell = if floor >= 0 && floor < period { floor } else { floor.rem_euclid(period) };
    (cell as usize, x - floor as f32)
}

fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn tables_and_rows_are_the_noise_they_stand_for() {
        let noise = Noise::new(Seed::new(4), 7, 5);
        let octaves = Octaves::new(noise, 3);
        for j in 0..40 {
            let v = (j as f32 + 0.5) / 40.0;
            let row = octaves.row(v, 100);
            for (i, value) in row.iter().enumerate() {
                let u = (i as f32 + 0.5) / 100.0;
                assert!((noise.octaves(u, v, 3) - value).abs() < 1e-4);
                assert!((noise.octaves(u, v, 3) - octaves.at(u + 1.0, v - 1.0)).abs() < 1e-3);
            }
        }
        assert!((Octaves::single(noise).at(0.3, 0.4) - noise.at(0.3, 0.4)).abs() < 1e-5);
    }

    #[test]
    fn a_row_of_fewer_pixels_than_cells_is_filled() {
        let octaves = Octaves::new(Noise::new(Seed::new(4), 90, 50), 2);
        let row = octaves.row(0.3, 16);
        assert!((0..16).all(|i| (octaves.at((i as f32 + 0.5) / 16.0, 0.3) - row[i]).abs() < 1e-3));
    }

    #[test]
    fn the_border_of_a_cell_is_where_its_name_changes() {
        let cells = Cells::new(Noise::new(Seed::new(3), 6, 6), 0.9);
        let mut before = cells.bordered(0.0, 0.37);
        for i in 1..2000 {
            let here = cells.bordered(i as f32 / 2000.0, 0.37);
            if here.0.id != before.0.id {
                assert!(here.1 < 0.02 && before.1 < 0.02, "{here:?}");
            }
            before = here;
        }
    }

    #[test]
    fn cells_repeat_after_one_tile() {
        let cells = Cells::new(Noise::new(Seed::new(1), 5, 3), 0.8);
        for i in 0..50 {
            let (u, v) = (i as f32 * 0.017, i as f32 * 0.013);
            let (a, b) = (cells.bordered(u, v), cells.bordered(u + 1.0, v + 1.0));
            assert!(a.0.id == b.0.id && (a.1 - b.1).abs() < 1e-4);
            assert_eq!(cells.nearest(u, v).id, a.0.id);
        }
    }
}
