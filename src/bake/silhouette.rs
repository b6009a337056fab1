//! What meshes cover of a picture: one bit a sample, no depth, no colour.
//!
//! Levels of detail are compared by their outlines, and that is all that their thresholds hang on. A bit a sample can be
//! counted for pixels of any whole number of samples, so that one drawing serves all sizes at which a level may take
//! over. Triangles whose samples are all covered already are left after a look at a word or two, and alpha is tested for
//! bits only that are still clear. Snapping and edge rule are those of [`rasterize`](super::rasterize).
//!
//! One picture is drawn by one thread: views are what callers spread. Wood takes two fifths of a full tree's outline, its sides
//! two triangles at a time. Tried, with no gain: slopes by a table of inverses; summed-area tables by which runs of samples are
//! told to be clear (of a card's two thirds are, and asking costs what looking does), or whole cells of it; levels found without
//! a loop.

use glam::{DVec2, Vec2};

use super::Cutout;
use super::cutout::{Level, Run, TEXEL};
use super::picture::Repeat;
use super::quads::{is_parallelogram, joined, scan_quad};
use super::raster::View;
use super::samples::{
    Extent, Grid, Plane, Point, SUBSAMPLE, corner_points, edge, extent, is_back, project_into, scan_box,
};
use crate::mesh::Mesh;

/// Most samples along an edge.
const LARGEST: usize = 8192;
/// Most rows of a triangle's box that is looked at as a whole.
const FEW: usize = 32;

/// How many of the first bits of a byte are set, for each number of them from one to eight.
const FIRST: [[u8; 8]; 256] = {
    let mut first = [[0; 8]; 256];
    let mut byte = 0;
    while byte < first.len() {
        let (mut bit, mut sum) = (0, 0);
        while bit < 8 {
            sum += (byte >> bit & 1) as u8;
            first[byte][bit] = sum;
            bit += 1;
        }
        byte += 1;
    }
    first
};

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
    /// Backs are always hidden, and left out.
    pub closed: bool,
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

/// A summed-area table (Crow 1984) of the samples that are covered.
#[derive(Clone, Debug)]
pub struct Areas {
    columns: usize,
    rows: usize,
    /// Covered samples above and left of each corner.
    sums: Vec<u32>,
}

impl Areas {
    /// All covered samples.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.sums.last().copied().unwrap_or(0)
    }

    /// Pixels that both or either of two drawings cover by half or more, of pixels of `size` by `size` samples that begin at
    /// column and row `from`, 0..=`size`. Those at the rims are whole, what lies beyond is clear.
    #[must_use]
    pub fn overlap(&self, other: &Self, size: usize, from: (usize, usize)) -> (u32, u32) {
        let size = size.max(1);
        let half = (size * size).div_ceil(2) as u32;
        let (columns, rows) = (self.columns.min(other.columns), self.rows.min(other.rows));
        let ends = |from: usize, count: usize| (from..count).step_by(size).chain([count]);
        let (mut both, mut either) = (0, 0);
        let mut above = 0;
        for below in ends(from.1, rows) {
            // Of the rows above and below the pixels, at the corners of each.
            let [own, others] =
                [self, other].map(|of| [above, below].map(|row| &of.sums[row * (of.columns + 1)..][..=columns]));
            let area = |x: usize| (own[1][x] - own[0][x], others[1][x] - others[0][x]);
            let mut left = (0, 0);
            for x in ends(from.0, columns) {
                let right = area(x);
                let (a, b) = (right.0 - left.0 >= half, right.1 - left.1 >= half);
                both += u32::from(a & b);
                either += u32::from(a | b);
                left = right;
            }
            above = below;
        }
        (both, either)
    }
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
            let mut rest = shape.mesh.indices.as_chunks::<3>().0;
            while let [corners, others @ ..] = rest {
                rest = others;
                let pair = others.first().map(|second| [*corners, *second]);
                if pair.is_some_and(|pair| drawn.add_pair(shape, pair, &points, grid)) {
                    rest = &others[1..];
                } else {
                    drawn.add(shape, *corners, &points, grid);
                }
            }
        }
        drawn
    }

    /// Some samples, counted row by row, in order.
    pub(crate) fn of(columns: usize, rows: usize, covered: impl Iterator<Item = usize>) -> Self {
        let words = columns.div_ceil(64);
        let mut bits = vec![0_u64; words * rows];
        let (mut row, mut first) = (0, 0);
        for i in covered {
            while i >= first + columns {
                (row, first) = (row + 1, first + columns);
            }
            let column = i - first;
            bits[row * words + column / 64] |= 1 << (column % 64);
        }
        Self { columns, rows, words, bits }
    }

    /// Columns and rows of samples.
    #[must_use]
    pub const fn size(&self) -> (usize, usize) {
        (self.columns, self.rows)
    }

    /// Bytes that it takes, about.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.bits.len() * size_of::<u64>()
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

    /// Its samples summed up, for pixels of many sizes.
    #[must_use]
    pub fn areas(&self) -> Areas {
        let stride = self.columns + 1;
        let mut sums = vec![0_u32; stride * (self.rows + 1)];
        for (row, words) in self.bits.chunks_exact(self.words).enumerate() {
            let (above, line) = sums[row * stride..][..2 * stride].split_at_mut(stride);
            let (above, above_rest) = above[1..].as_chunks::<8>();
            let (line, rest) = line[1..].as_chunks_mut::<8>();
            let first = |byte: usize| &FIRST[(words[byte / 8] >> (byte % 8 * 8) & 0xff) as usize];
            let whole = line.len();
            let mut sum = 0;
            for (byte, (above, line)) in above.iter().zip(line).enumerate() {
                let first = first(byte);
                *line = std::array::from_fn(|bit| above[bit] + sum + u32::from(first[bit]));
                sum += u32::from(first[7]);
            }
            for (bit, (above, line)) in above_rest.iter().zip(rest).enumerate() {
                *line = above + sum + u32::from(first(whole)[bit]);
            }
        }
        Areas { columns: self.columns, rows: self.rows, sums }
    }

    fn add(&mut self, shape: &Shape<'_>, corners: [u32; 3], points: &[Point], grid: Grid) {
        let Some(p) = corner_points(points, corners) else { return };
        if shape.closed && is_back(p) {
            return;
        }
        let Some(extent) = extent(p, grid).filter(|&extent| self.is_open(extent)) else { return };
        let rows = extent.1.0..extent.1.1 + 1;
        if shape.repeat == Repeat::Tiled {
            scan_box(p, grid, rows, |row, left, right| self.cover(row, left, right));
        } else {
            let mut run = self.runs(shape, (corners, p), extent);
            scan_box(p, grid, rows, |row, left, right| run.add(row, left, right));
        }
    }

    /// Two triangles that are a parallelogram, or solid, or that show nothing new; false where they are to be drawn one by one.
    /// Most are behind others, and told so before anything else is asked of them.
    #[inline]
    fn add_pair(&mut self, shape: &Shape<'_>, pair: [[u32; 3]; 2], points: &[Point], grid: Grid) -> bool {
        let Some(corners) = joined(pair) else { return false };
        let Some(p) = corner_points(points, corners) else { return false };
        if shape.closed {
            let backs = [is_back([p[0], p[1], p[2]]), is_back([p[0], p[2], p[3]])];
            if backs[0] || backs[1] {
                return backs[0] && backs[1];
            }
        }
        let Some(extent) = extent(p, grid).filter(|&extent| self.is_open(extent)) else { return true };
        let rows = extent.1.0..extent.1.1 + 1;
        // What is solid has no picture that would have to be one of both.
        if shape.repeat == Repeat::Tiled {
            return scan_quad(p, grid, rows, |row, left, right| self.cover(row, left, right));
        }
        if !is_parallelogram(shape.mesh, corners, p) {
            return false;
        }
        let mut run = self.runs(shape, (pair[0], [p[0], p[1], p[2]]), extent);
        scan_quad(p, grid, rows, |row, left, right| run.add(row, left, right))
    }

    /// Covers a run of samples.
    #[inline]
    fn cover(&mut self, row: usize, left: usize, right: usize) {
        let (first, last) = (left / 64, (right - 1) / 64);
        let (from, to) = (u64::MAX << (left % 64), u64::MAX >> (63 - (right - 1) % 64));
        let line = &mut self.bits[row * self.words..][..=last];
        if first == last {
            line[last] |= from & to;
        } else {
            line[first] |= from;
            line[first + 1..last].fill(u64::MAX);
            line[last] |= to;
        }
    }

    /// Whether a box may hold samples that are clear: most of a crown are small, and others cover all of them.
    #[inline]
    fn is_open(&self, (columns, (top, bottom)): Extent) -> bool {
        bottom - top >= FEW || !(top..=bottom).all(|row| is_full(&self.bits[row * self.words..], columns))
    }

    #[inline]
    fn runs<'s, 'a>(
        &'s mut self,
        shape: &'s Shape<'a>,
        triangle: ([u32; 3], [Point; 3]),
        (columns, rows): Extent,
    ) -> Runs<'s, 'a> {
        Runs { bits: &mut self.bits, words: self.words, shape, triangle, from: (columns.0, rows.0), cut: None }
    }
}

/// Runs of samples that wear what a triangle does.
struct Runs<'s, 'a> {
    bits: &'s mut [u64],
    words: usize,
    shape: &'s Shape<'a>,
    triangle: ([u32; 3], [Point; 3]),
    /// A sample near it.
    from: (usize, usize),
    /// Made when a sample that is still clear asks for it.
    cut: Option<Option<Cut<'a>>>,
}

impl Runs<'_, '_> {
    #[inline]
    fn add(&mut self, row: usize, left: usize, right: usize) {
        let (first, last) = (left / 64, (right - 1) / 64);
        let (from, to) = (u64::MAX << (left % 64), u64::MAX >> (63 - (right - 1) % 64));
        // Most runs lie within a word.
        if first == last {
            return self.add_to(row, first, from & to);
        }
        self.add_to(row, first, from);
        (first + 1..last).for_each(|word| self.add_to(row, word, u64::MAX));
        self.add_to(row, last, to);
    }

    #[inline]
    fn add_to(&mut self, row: usize, word: usize, run: u64) {
        let open = run & !self.bits[row * self.words + word];
        if open != 0 {
            self.show(row, word, open);
        }
    }

    /// Draws what is still clear of a word.
    fn show(&mut self, row: usize, word: usize, open: u64) {
        let (corners, p) = self.triangle;
        let cut = self.cut.get_or_insert_with(|| Cut::new(self.shape, corners, p, self.from));
        self.bits[row * self.words + word] |= cut.as_ref().map_or(open, |cut| cut.covered(word * 64, row, open));
    }
}

/// How a triangle is cut out. Places are in units of [`TEXEL`].
struct Cut<'a> {
    level: &'a Level,
    magnified: bool,
    /// Column and row of a sample, and the place of its middle.
    from: [i64; 2],
    place: [i64; 2],
    /// To the next column and row.
    across: [i64; 2],
    down: [i64; 2],
}

impl<'a> Cut<'a> {
    /// None for what is solid. `from` is a sample near the triangle.
    fn new(shape: &Shape<'a>, corners: [u32; 3], p: [Point; 3], from: (usize, usize)) -> Option<Self> {
        let mesh = shape.mesh;
        if shape.repeat == Repeat::Tiled {
            return None;
        }
        let tile = if mesh.tiles.is_empty() { Some(0) } else { mesh.tiles.get(corners[0] as usize).copied() };
        let &picture = tile.and_then(|t| shape.cutouts.get(t as usize))?;
        let [a, b, c] = corners.map(|c| mesh.uvs.get(c as usize).copied().unwrap_or(Vec2::ZERO));
        let area = edge(p[0], p[1], p[2].x, p[2].y) as f32 / (SUBSAMPLE * SUBSAMPLE);
        let share = ((b - a).perp_dot(c - a) * picture.texels() / area).abs();
        let level = picture.at(picture.level(share));
        let plane = Plane::new(p, [a, b, c].map(|uv| level.place(uv).as_dvec2()));
        let place = units(plane.at(from.0, from.1), FARTHEST);
        let [across, down] = [plane.across, plane.down].map(|step| units(step, STEEPEST));
        Some(Self { level, magnified: share < 1.0, from: [from.0 as i64, from.1 as i64], place, across, down })
    }

    /// What is covered of the samples `open`, the first bit of which is `column`.
    #[inline]
    fn covered(&self, column: usize, row: usize, open: u64) -> u64 {
        let (first, last) = (open.trailing_zeros(), 63 - open.leading_zeros());
        let (right, below) = (column as i64 + i64::from(first) - self.from[0], row as i64 - self.from[1]);
        let [dx, dy] = self.across;
        let (x, y) =
            (self.place[0] + dx * right + self.down[0] * below, self.place[1] + dy * right + self.down[1] * below);
        let run = Run { x, y, dx, dy, count: last - first + 1 };
        open & (if self.magnified || self.level.filtered { self.level.run_about(run) } else { self.level.run(run) }
            << first)
    }
}

/// Farthest place and longest step, texels: slivers have any, and sums of 8192 steps are to stay numbers.
const FARTHEST: f64 = (1 << 27) as f64;
const STEEPEST: f64 = (1 << 13) as f64;

/// Texels in units of [`TEXEL`], no farther than that from none. `as` takes NaN to 0.
fn units(texels: DVec2, most: f64) -> [i64; 2] {
    [texels.x, texels.y].map(|v| (v.clamp(-most, most) * TEXEL as f64) as i64)
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
            let drawn = Silhouette::new(
                &[Shape { mesh: &mesh, cutouts: &cutouts, repeat, closed: false }],
                &front(1.5),
                130,
                130,
            );
            let surface = Surface { mesh: &mesh, pictures: &pictures, repeat, closed: false };
            let target = rasterize(&[surface], &front(1.5), 130, 130, 1, &Shading::Nothing);
            let differ = drawn.pixels(1).iter().zip(&target.coverage).filter(|(a, b)| **a as f32 != **b).count();
            // Coordinates are stepped here: a sample on the edge of a texel may fall to either side.
            assert!(differ <= 130 * 130 / 200 && drawn.count() > 3000, "{differ} of {}", drawn.count());
        }
    }

    #[test]
    fn pixels_of_any_size_add_up() {
        let [drawn, other] = [60, 90].map(|count| {
            let mesh = strewn(count);
            let shapes = [Shape { mesh: &mesh, cutouts: &[], repeat: Repeat::Tiled, closed: false }];
            Silhouette::new(&shapes, &front(1.5), 150, 90)
        });
        for size in [1, 2, 3, 5, 10, 15, 30] {
            let sum: u64 = drawn.pixels(size).iter().map(|c| u64::from(*c)).sum();
            assert_eq!(sum, drawn.count(), "{size}");
        }
        assert_eq!(drawn.pixels(64).len(), 2);
        assert_eq!(u64::from(drawn.areas().count()), drawn.count());
        let samples = [&drawn, &other].map(|drawn| drawn.pixels(1));
        let areas = [&drawn, &other].map(Silhouette::areas);
        for (size, (x, y)) in [(1, (0, 0)), (2, (0, 0)), (7, (5, 3)), (15, (0, 7)), (90, (60, 0)), (200, (50, 50))] {
            // A pixel more to the left and above, and all that begin before the end.
            let half = |samples: &[u16], row: usize, column: usize| {
                let part = |first: usize, from: usize, end: usize| {
                    (first * size + from).saturating_sub(size)..(first * size + from).min(end)
                };
                let rows = part(row, y, 90).map(|row| &samples[row * 150..][part(column, x, 150)]);
                2 * rows.flatten().map(|s| usize::from(*s)).sum::<usize>() >= size * size
            };
            let (mut both, mut either) = (0, 0);
            for (row, column) in (0..92).flat_map(|row| (0..152).map(move |column| (row, column))) {
                if (row * size + y).saturating_sub(size) >= 90 || (column * size + x).saturating_sub(size) >= 150 {
                    continue;
                }
                let [a, b] = [0, 1].map(|i| half(&samples[i], row, column));
                both += u32::from(a && b);
                either += u32::from(a || b);
            }
            assert!(either > 0 || size == 200);
            assert_eq!(areas[0].overlap(&areas[1], size, (x, y)), (both, either), "{size}");
        }
    }

    #[test]
    fn broken_meshes_cover_nothing() {
        let mut mesh = strewn(1);
        mesh.indices = vec![0, 1, 99, 2];
        mesh.positions[1] = Vec3::NAN;
        let shapes = [Shape { mesh: &mesh, cutouts: &[], repeat: Repeat::Cutout, closed: false }];
        assert_eq!(Silhouette::new(&shapes, &front(f32::NAN), 0, 0).count(), 0);
        assert_eq!(Silhouette::new(&shapes, &front(1.0), 64, 64).count(), 0);
    }
}
