//! What meshes cover of a picture: one bit a sample, no depth, no colour.
//!
//! Levels of detail are compared by their outlines, and that is all that their thresholds hang on. A bit a sample can be
//! counted for pixels of any whole number of samples, so that one drawing serves all sizes at which a level may take
//! over. Triangles whose samples are all covered already are left after a look at a word or two, and alpha is tested for
//! bits only that are still clear. Snapping and edge rule are those of [`rasterize`](super::rasterize).
//!
//! One picture is drawn by one thread: views are what callers spread.

use glam::Vec2;

use super::Cutout;
use super::cutout::{Level, TEXEL};
use super::picture::Repeat;
use super::raster::View;
use super::samples::{Grid, Point, corner_points, edge, extent, project_into, span, top_left};
use crate::mesh::Mesh;

/// Most samples along an edge.
const LARGEST: usize = 8192;

/// How many bits of a number are set.
const ONES: [u8; 1 << 10] = {
    let mut ones = [0; 1 << 10];
    let mut i = 1;
    while i < ones.len() {
        ones[i] = ones[i / 2] + (i % 2) as u8;
        i += 1;
    }
    ones
};

/// A mesh and the pictures that it is cut out by.
#[derive(Clone, Copy, Debug)]
pub struct Shape<'a> {
    /// Where `tiles` is empty all of it wears the first picture.
    pub mesh: &'a Mesh,
    /// Indexed by the mesh's `tiles`. Triangles without a picture are solid.
    pub cutouts: &'a [&'a Cutout],
    /// Tiled pictures are opaque.
    pub repeat: Repeat,
}

/// Which samples are covered; rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Silhouette {
    columns: usize,
    rows: usize,
    /// 64-bit words a row.
    words: usize,
    bits: Vec<u64>,
}

impl Silhouette {
    /// Draws what shapes cover of a view, on `columns` by `rows` samples, each clamped to 1..=8192.
    #[must_use]
    pub fn new(shapes: &[Shape<'_>], view: &View, columns: usize, rows: usize) -> Self {
        let (columns, rows) = (columns.clamp(1, LARGEST), rows.clamp(1, LARGEST));
        let words = columns.div_ceil(64);
        let mut drawn = Self { columns, rows, words, bits: vec![0; words * rows] };
        let grid = Grid { columns, rows };
        let mut points: Vec<Point> = Vec::new();
        for shape in shapes {
            project_into(shape.mesh, view, grid, &mut points);
            for corners in shape.mesh.indices.as_chunks::<3>().0 {
                drawn.add(shape, *corners, &points, grid);
            }
        }
        drawn
    }

    /// Samples that are covered.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.bits.iter().map(|w| u64::from(w.count_ones())).sum()
    }

    /// Covered samples of each pixel of `size` by `size` samples, 1..=64; what is left over at the right and below is
    /// dropped.
    #[must_use]
    pub fn pixels(&self, size: usize) -> Vec<u16> {
        let size = size.clamp(1, 64);
        let (width, height) = (self.columns / size, self.rows / size);
        let mask = if size == 64 { u64::MAX } else { (1 << size) - 1 };
        let mut counts = vec![0_u16; width * height];
        for (y, line) in counts.chunks_exact_mut(width.max(1)).enumerate() {
            for row in y * size..(y + 1) * size {
                let words = &self.bits[row * self.words..][..self.words];
                for (x, count) in line.iter_mut().enumerate() {
                    let (word, bit) = (x * size / 64, x * size % 64);
                    let mut part = words[word] >> bit;
                    if bit + size > 64 {
                        part |= words[word + 1] << (64 - bit);
                    }
                    // Baselines of x86 have no instruction that counts bits.
                    *count += match ONES.get((part & mask) as usize) {
                        Some(&ones) => u16::from(ones),
                        None => (part & mask).count_ones() as u16,
                    };
                }
            }
        }
        counts
    }

    fn add(&mut self, shape: &Shape<'_>, mut corners: [u32; 3], points: &[Point], grid: Grid) {
        let Some(mut p) = corner_points(points, corners) else { return };
        let Some((columns, rows)) = extent(p, grid) else { return };
        let mut area = edge(p[0], p[1], p[2].x, p[2].y);
        if area < 0 {
            corners.swap(1, 2);
            p.swap(1, 2);
            area = -area;
        }
        if area == 0 {
            return;
        }
        let [a, b, c] = p;
        let edges = [(b, c), (c, a), (a, b)];
        let bias = edges.map(|(p, q)| i64::from(!top_left(p, q)));
        let step = edges.map(|(p, q)| -i64::from(q.y - p.y) * 256);
        let mut cut: Option<Cut<'_>> = None;
        let down = edges.map(|(p, q)| i64::from(q.x - p.x) * 256);
        let mut below = edges.map(|(p, q)| edge(p, q, columns.0 as i32 * 256 + 128, rows.0 as i32 * 256 + 128));
        for row in rows.0..=rows.1 {
            let e = below;
            below = [e[0] + down[0], e[1] + down[1], e[2] + down[2]];
            let line = &mut self.bits[row * self.words..][..self.words];
            if is_full(line, columns) {
                continue;
            }
            let Some((left, right)) = span(e, step, bias, columns) else { continue };
            let cut = cut.get_or_insert_with(|| Cut::new(shape, corners, area, step));
            let (start, by) = (cut.uv(e[1], e[2]), cut.by);
            for (word, bits) in line.iter_mut().enumerate().take(right / 64 + 1).skip(left / 64) {
                let from = if word == left / 64 { u64::MAX << (left % 64) } else { u64::MAX };
                let to = if word == right / 64 { u64::MAX >> (63 - right % 64) } else { u64::MAX };
                let mut open = from & to & !*bits;
                if cut.level.is_none() {
                    *bits |= open;
                    continue;
                }
                let mut covered = 0;
                while open != 0 {
                    let bit = open.trailing_zeros();
                    open &= open - 1;
                    let column = (word * 64 + bit as usize - columns.0) as i64;
                    covered |= u64::from(cut.covers([start[0] + by[0] * column, start[1] + by[1] * column])) << bit;
                }
                *bits |= covered;
            }
        }
    }
}

/// How a triangle is cut out.
struct Cut<'a> {
    /// None for what is solid.
    level: Option<&'a Level>,
    magnified: bool,
    /// Texels at the first corner, and towards the others.
    uv: [Vec2; 3],
    inverse: f32,
    /// To the next column, in units of [`TEXEL`].
    by: [i64; 2],
}

impl<'a> Cut<'a> {
    fn new(shape: &Shape<'a>, corners: [u32; 3], area: i64, step: [i64; 3]) -> Self {
        let mesh = shape.mesh;
        let inverse = 1.0 / area as f32;
        let mut cut = Self { level: None, magnified: false, uv: [Vec2::ZERO; 3], inverse, by: [0; 2] };
        if shape.repeat == Repeat::Tiled {
            return cut;
        }
        let tile = if mesh.tiles.is_empty() { Some(0) } else { mesh.tiles.get(corners[0] as usize).copied() };
        let Some(&picture) = tile.and_then(|t| shape.cutouts.get(t as usize)) else { return cut };
        let [a, b, c] = corners.map(|c| mesh.uvs.get(c as usize).copied().unwrap_or(Vec2::ZERO));
        let (ub, uc) = (b - a, c - a);
        let texels = (ub.x * uc.y - ub.y * uc.x).abs() * picture.texels();
        let share = texels * inverse * (256.0 * 256.0);
        let level = picture.at(picture.level(share));
        cut.uv = [a, ub, uc].map(|uv| uv * level.size());
        cut.by = units((cut.uv[1] * step[1] as f32 + cut.uv[2] * step[2] as f32) * inverse);
        (cut.level, cut.magnified) = (Some(level), share < 1.0);
        cut
    }

    /// Where the edges opposite to the second and third corner have these values, in units of [`TEXEL`].
    fn uv(&self, b: i64, c: i64) -> [i64; 2] {
        units(self.uv[0] + (self.uv[1] * b as f32 + self.uv[2] * c as f32) * self.inverse)
    }

    #[inline]
    fn covers(&self, [x, y]: [i64; 2]) -> bool {
        match self.level {
            None => true,
            Some(level) if self.magnified => level.covers_about(x, y),
            Some(level) => level.covers_at(x, y),
        }
    }
}

/// Texels in units of [`TEXEL`], so far from none that steps along a row stay numbers. `as` takes NaN to 0.
fn units(texels: Vec2) -> [i64; 2] {
    [texels.x, texels.y].map(|v| (v * TEXEL as f32).clamp(-1e15, 1e15) as i64)
}

/// Whether all bits of a range of columns, ends included, are set.
fn is_full(line: &[u64], (left, right): (usize, usize)) -> bool {
    let (first, last) = (left / 64, right / 64);
    let (from, to) = (u64::MAX << (left % 64), u64::MAX >> (63 - right % 64));
    if first == last {
        return line[first] & from & to == from & to;
    }
    line[first] & from == from && line[last] & to == to && line[first + 1..last].iter().all(|w| *w == u64::MAX)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bake::{Maps, Picture, Shading, Surface, rasterize};
    use crate::base::{Frame, Seed};

    fn front(half: f32) -> View {
        View::new(Frame::WORLD, Vec3::ZERO, half, half)
    }

    /// Triangles of any size, strewn.
    fn strewn(count: u64) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..count {
            let seed = Seed::new(8).at(i);
            let middle = seed.direction() * 1.2;
            for k in 0..3 {
                mesh.positions.push(middle + seed.at(k).direction() * seed.at(9).range(0.01, 0.9));
                mesh.uvs.push(Vec2::new(seed.at(20 + k).unit(), seed.at(30 + k).unit()));
                mesh.tiles.push(i as u32 % 3);
                mesh.indices.push(mesh.indices.len() as u32);
            }
        }
        mesh.normals = vec![Vec3::Z; mesh.positions.len()];
        mesh
    }

    #[test]
    fn it_covers_what_the_rasterizer_draws() {
        let maps = |hole: u32| {
            let color = (0..64 * 64).map(|i| [9, 9, 9, if (i % 64 / 8 + i / 512) % hole == 0 { 255 } else { 0 }]);
            Maps {
                width: 64,
                height: 64,
                color: color.collect(),
                normal: vec![[128, 128, 255]; 4096],
                orm: vec![[255; 3]; 4096],
            }
        };
        let pictures = [Picture::new(&maps(2)), Picture::new(&maps(3))];
        let cutouts: Vec<&Cutout> = pictures.iter().map(Picture::cutout).collect();
        let mesh = strewn(300);
        for repeat in [Repeat::Cutout, Repeat::Tiled] {
            let drawn = Silhouette::new(&[Shape { mesh: &mesh, cutouts: &cutouts, repeat }], &front(1.5), 130, 130);
            let surface = Surface { mesh: &mesh, pictures: &pictures, repeat };
            let target = rasterize(&[surface], &front(1.5), 130, 130, 1, &Shading::Nothing);
            let differ = drawn.pixels(1).iter().zip(&target.coverage).filter(|(a, b)| **a as f32 != **b).count();
            // Coordinates are stepped here: a sample on the edge of a texel may fall to either side.
            assert!(differ <= 130 * 130 / 200 && drawn.count() > 3000, "{differ} of {}", drawn.count());
        }
    }

    #[test]
    fn pixels_of_any_size_add_up() {
        let mesh = strewn(60);
        let drawn =
            Silhouette::new(&[Shape { mesh: &mesh, cutouts: &[], repeat: Repeat::Tiled }], &front(1.5), 150, 90);
        for size in [1, 2, 3, 5, 10, 15, 30] {
            let sum: u64 = drawn.pixels(size).iter().map(|c| u64::from(*c)).sum();
            assert_eq!(sum, drawn.count(), "{size}");
        }
        assert_eq!(drawn.pixels(64).len(), 2);
    }

    #[test]
    fn broken_meshes_cover_nothing() {
        let mut mesh = strewn(1);
        mesh.indices = vec![0, 1, 99, 2];
        mesh.positions[1] = Vec3::NAN;
        let shapes = [Shape { mesh: &mesh, cutouts: &[], repeat: Repeat::Cutout }];
        assert_eq!(Silhouette::new(&shapes, &front(f32::NAN), 0, 0).count(), 0);
        assert_eq!(Silhouette::new(&shapes, &front(1.0), 64, 64).count(), 0);
    }
}
