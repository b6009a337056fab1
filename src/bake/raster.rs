//! An orthographic, z-buffered triangle rasterizer with textures, alpha test and supersampling.
//!
//! It bakes the cards of the billboard cloud, measures levels of detail against each other and draws contact sheets.
//! Two passes: the first finds for every sample the nearest triangle (a visibility buffer; only depth and alpha are
//! looked at), the second fetches colour, normal and occlusion once for each triangle that a pixel shows, at the middle of
//! its samples there, and weighs them by their samples. Most triangles of a tree are smaller than a pixel: those whose
//! box holds few samples are tested against them at once, and most go no further.
//!
//! Vertices are snapped to 1/256 of a sample and edges tested in integers with the top-left rule, so triangles that share
//! an edge neither overlap nor leave a gap. Bands of rows are filled in parallel, each walking its triangles in order;
//! of two samples at the same depth the earlier triangle's stays: the picture is the same on any number of threads.
//! Texture coordinates are affine under an orthographic view, so the mip level is one a triangle.
//!
//! Limits: no perspective, no transparency; triangles with a vertex that is not finite or more than 200,000 samples
//! away from the picture are skipped; pictures are at most 8192 samples wide and high.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::draft::Draft;
use super::picture::{Picture, Repeat};
use super::recipe::{Palette, Recipe};
use super::samples::{
    Extent, Grid, Plane, Point, SMALL, SUBSAMPLE, corner_points, edge, extent, holds_any, project, scan,
};
use super::shade::{Fragment, Light, Shading};
use crate::base::Frame;
use crate::mesh::Mesh;

/// Rows of samples that one task fills.
const BAND: usize = 32;
/// Most samples along an edge of a target.
const LARGEST: u32 = 8192;
/// Most samples in the box of a triangle that is tested against each of them before anything else is done with it.
const FEW: usize = 6;
/// No triangle.
const NONE: u32 = u32::MAX;

/// A box in space that is looked at along one of its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// `x` points right, `y` up in the picture, `z` towards the viewer.
    pub frame: Frame,
    /// Middle of the picture, metres.
    pub centre: Vec3,
    /// Half the width of what is seen, metres.
    pub half_width: f32,
    /// Half the height of what is seen, metres.
    pub half_height: f32,
    /// How far in front of the centre things are seen, metres.
    pub front: f32,
    /// How far behind the centre things are seen, metres.
    pub back: f32,
}

impl View {
    /// A view of everything along `-frame.z`, as wide and high as given.
    #[must_use]
    pub const fn new(frame: Frame, centre: Vec3, half_width: f32, half_height: f32) -> Self {
        Self { frame, centre, half_width, half_height, front: f32::MAX, back: f32::MAX }
    }

    /// A level view from the horizontal direction `azimuth` (radians, 0 looks from +Z, towards +X).
    #[must_use]
    pub fn level(azimuth: f32, centre: Vec3, half_width: f32, half_height: f32) -> Self {
        let (sin, cos) = crate::base::math::sin_cos(azimuth);
        let z = Vec3::new(sin, 0.0, cos);
        Self::new(Frame { x: Vec3::Y.cross(z), y: Vec3::Y, z }, centre, half_width, half_height)
    }
}

/// A mesh and what it wears.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Where `tiles` is empty all of it wears the first picture.
    pub mesh: &'a Mesh,
    /// Indexed by the mesh's `tiles`. Triangles without a picture are white.
    pub pictures: &'a [Picture],
    /// Tiled and opaque, or cut out by alpha.
    pub repeat: Repeat,
}

/// What was drawn; arrays of `width * height`, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Share of the pixel's samples that show something, 0..=1.
    pub coverage: Vec<f32>,
    /// Linear light, the mean of the covered samples; zero where there are none.
    pub color: Vec<Vec3>,
    /// Unit normals in the world; zero where nothing is covered.
    pub normal: Vec<Vec3>,
    /// Occlusion of the pictures, 1 is open; the mean of the covered samples.
    pub occlusion: Vec<f32>,
    /// Mean distance from the view's centre towards the viewer, metres; negative infinity where nothing is covered.
    pub depth: Vec<f32>,
}

/// Which depths are drawn.
struct Range {
    near: f32,
    far: f32,
    /// What was drawn is kept whatever its depth: coverage does not ask for it.
    first_stays: bool,
}

/// A nearest triangle, as far as it is known.
#[derive(Clone, Copy)]
struct Sample {
    depth: f32,
    /// Counted through all surfaces.
    triangle: u32,
}

impl Sample {
    const EMPTY: Self = Self { depth: f32::NEG_INFINITY, triangle: NONE };
}

/// Draws surfaces into a picture of `width * height` pixels with `samples * samples` samples each.
///
/// Sizes are clamped so that no edge has more than 8192 samples. The target is empty where the view has no area.
#[must_use]
pub fn rasterize(
    surfaces: &[Surface<'_>],
    view: &View,
    width: u32,
    height: u32,
    samples: u32,
    shading: &Shading,
) -> Target {
    draw(surfaces, view, (width, height, samples), shading, Noted::Nothing).0
}

/// As [`rasterize`] for [`Shading::Albedo`] or [`Shading::Seen`], with what each pixel's colour is mixed from: a picture
/// that is seldom drawn can be painted as often as colours change. The palette counts the pictures of all surfaces, one
/// after the other.
#[must_use]
pub fn survey(
    surfaces: &[Surface<'_>],
    view: &View,
    width: u32,
    height: u32,
    samples: u32,
    shading: &Shading,
) -> (Target, Recipe) {
    let starts = first_pictures(surfaces);
    let (target, notes) = draw(surfaces, view, (width, height, samples), shading, Noted::Palette(&starts));
    (target, notes.recipe)
}

/// The number of each surface's first picture, counted through all of them.
fn first_pictures(surfaces: &[Surface<'_>]) -> Vec<u32> {
    let starts = surfaces.iter().scan(0_u32, |next, surface| {
        let start = *next;
        *next = next.saturating_add(surface.pictures.len() as u32);
        Some(start)
    });
    starts.collect()
}

/// What each pixel shows in the light, before colours: see [`Draft`]. Pixels that show nothing have no part. Pictures are
/// counted through all surfaces.
pub(super) fn draft(
    surfaces: &[Surface<'_>],
    view: &View,
    (width, height, samples): (u32, u32, u32),
    light: Light,
) -> (Target, Draft) {
    let starts = first_pictures(surfaces);
    let (target, recipe) = draw(surfaces, view, (width, height, samples), &Shading::Lit(light), Noted::Light(&starts));
    (target, recipe.draft)
}

/// What is noted of each pixel's parts.
#[derive(Clone, Copy)]
enum Noted<'a> {
    Nothing,
    /// Texels of a palette, by each surface's first picture.
    Palette(&'a [u32]),
    /// Texels of the pictures' mips, and the light on them, by each surface's first picture.
    Light(&'a [u32]),
}

/// What was noted.
#[derive(Default)]
struct Notes {
    recipe: Recipe,
    draft: Draft,
}

fn draw(
    surfaces: &[Surface<'_>],
    view: &View,
    (width, height, samples): (u32, u32, u32),
    shading: &Shading,
    noted: Noted<'_>,
) -> (Target, Notes) {
    let samples = samples.clamp(1, 16);
    let (width, height) = (width.clamp(1, LARGEST / samples), height.clamp(1, LARGEST / samples));
    let grid = Grid { columns: (width * samples) as usize, rows: (height * samples) as usize };
    let per_pixel = samples as usize;
    // A small picture is one band: whoever draws many of them spreads the pictures. A band holds whole pixels.
    let rows = if grid.columns * grid.rows <= SMALL { grid.rows } else { (BAND / per_pixel).max(1) * per_pixel };
    let projected: Vec<Vec<Point>> = surfaces.iter().map(|s| project(s.mesh, view, grid)).collect();
    let scene = Scene::new(surfaces, &projected, view, grid, *shading == Shading::Nothing);
    let bands = (rows < grid.rows).then(|| Bands::new(&scene, rows));
    let pixels = rows / per_pixel * width as usize;
    let count = width as usize * height as usize;
    let mut target = Target {
        width,
        height,
        coverage: vec![0.0; count],
        color: vec![Vec3::ZERO; count],
        normal: vec![Vec3::ZERO; count],
        occlusion: vec![0.0; count],
        depth: vec![f32::NEG_INFINITY; count],
    };
    let drawn = |(band, (coverage, color, normal, occlusion, depth)): (usize, Rows<'_>)| {
        let first = band * rows;
        let here = rows.min(grid.rows - first) * grid.columns;
        let mut buffer = vec![Sample::EMPTY; here];
        match &bands {
            Some(bands) => bands.of(band).iter().for_each(|&name| scene.fill(name, first, &mut buffer)),
            None => scene.fill_all(&mut buffer),
        }
        let mut notes = Notes::default();
        let area = (samples * samples) as f32;
        let mut shader = Shader { scene: &scene, shading, area, held: NONE, surface: 0, setup: None };
        let mut shown: Vec<Shown> = Vec::new();
        let mut mixed: Vec<(u32, f32)> = Vec::new();
        for pixel in 0..coverage.len() {
            let (px, py) = (pixel % width as usize * per_pixel, pixel / width as usize * per_pixel);
            shown.clear();
            mixed.clear();
            let (mut deep, mut hits) = (0.0_f32, 0_u32);
            for row in py..py + per_pixel {
                for column in px..px + per_pixel {
                    let sample = buffer[row * grid.columns + column];
                    if sample.triangle != NONE {
                        Shown::note(&mut shown, sample, column, first + row);
                        deep += sample.depth;
                        hits += 1;
                    }
                }
            }
            if hits > 0 {
                let scale = 1.0 / hits as f32;
                coverage[pixel] = hits as f32 / area;
                depth[pixel] = deep * scale;
                if *shading != Shading::Nothing {
                    let mut sum = Fragment::default();
                    for part in &shown {
                        let fragment = shader.shade(part);
                        match noted {
                            Noted::Nothing => {}
                            Noted::Palette(starts) => {
                                let start = starts[shader.surface] * Palette::TEXELS;
                                let place = if fragment.place == NONE { NONE } else { start + fragment.place };
                                mixed.push((place, fragment.shade * part.count as f32 * scale));
                            }
                            Noted::Light(starts) => {
                                let picture = starts[shader.surface] as usize + shader.picture();
                                let light = fragment.light * (part.count as f32 / area);
                                notes.draft.add(picture, shader.texel(part), light);
                            }
                        }
                        sum.add(fragment, part.count as f32);
                    }
                    color[pixel] = sum.color * scale;
                    normal[pixel] = sum.normal.normalize_or(view.frame.z);
                    occlusion[pixel] = sum.occlusion * scale;
                }
            }
            match noted {
                Noted::Nothing => {}
                Noted::Palette(_) => notes.recipe.push(&mut mixed),
                Noted::Light(_) => notes.draft.end(),
            }
        }
        notes
    };
    let rows = (
        target.coverage.par_chunks_mut(pixels),
        target.color.par_chunks_mut(pixels),
        target.normal.par_chunks_mut(pixels),
        target.occlusion.par_chunks_mut(pixels),
        target.depth.par_chunks_mut(pixels),
    );
    let all: Vec<Notes> = rows.into_par_iter().enumerate().map(drawn).collect();
    let (recipes, drafts) = all.into_iter().map(|notes| (notes.recipe, notes.draft)).unzip();
    (target, Notes { recipe: Recipe::joined(recipes), draft: Draft::joined(drafts) })
}

/// The rows of a target that one task fills.
type Rows<'a> = (&'a mut [f32], &'a mut [Vec3], &'a mut [Vec3], &'a mut [f32], &'a mut [f32]);

/// What is drawn, projected.
struct Scene<'a> {
    surfaces: &'a [Surface<'a>],
    projected: &'a [Vec<Point>],
    /// Triangles of all surfaces before each, and of all.
    starts: Vec<u32>,
    grid: Grid,
    range: Range,
}

impl<'a> Scene<'a> {
    fn new(
        surfaces: &'a [Surface<'a>],
        projected: &'a [Vec<Point>],
        view: &View,
        grid: Grid,
        first_stays: bool,
    ) -> Self {
        let mut starts = vec![0];
        starts.extend(surfaces.iter().scan(0_u32, |sum, s| {
            *sum = sum.saturating_add((s.mesh.indices.len() / 3) as u32);
            Some(*sum)
        }));
        let range = Range { near: view.front, far: -view.back, first_stays };
        Self { surfaces, projected, starts, grid, range }
    }

    fn triangles(&self) -> u32 {
        self.starts[self.surfaces.len()]
    }

    /// The surface of a triangle, and its number there.
    fn place(&self, name: u32) -> (usize, usize) {
        let surface = self.starts.partition_point(|&start| start <= name) - 1;
        (surface, (name - self.starts[surface]) as usize)
    }

    /// Where a triangle is to be looked for; none where it covers no sample.
    fn extent(&self, name: u32) -> Option<Extent> {
        let (surface, triangle) = self.place(name);
        let corners = self.surfaces[surface].mesh.indices[triangle * 3..].first_chunk::<3>()?;
        let points = corner_points(&self.projected[surface], *corners)?;
        let (x, y) = extent(points, self.grid)?;
        ((x.1 - x.0 + 1) * (y.1 - y.0 + 1) > FEW || holds_any(points, self.grid)).then_some((x, y))
    }

    fn fill(&self, name: u32, first: usize, buffer: &mut [Sample]) {
        let (s, triangle) = self.place(name);
        let (surface, points) = (&self.surfaces[s], &self.projected[s]);
        let Some(corners) = surface.mesh.indices[triangle * 3..].first_chunk::<3>() else { return };
        self.fill_one(surface, points, name, *corners, first, buffer);
    }

    /// Fills all triangles, in order.
    fn fill_all(&self, buffer: &mut [Sample]) {
        for ((surface, points), &start) in self.surfaces.iter().zip(self.projected).zip(&self.starts) {
            for (name, corners) in (start..).zip(surface.mesh.indices.as_chunks::<3>().0) {
                self.fill_one(surface, points, name, *corners, 0, buffer);
            }
        }
    }

    #[inline]
    fn fill_one(
        &self,
        surface: &Surface<'_>,
        points: &[Point],
        name: u32,
        corners: [u32; 3],
        first: usize,
        buffer: &mut [Sample],
    ) {
        let Some(points) = corner_points(points, corners) else { return };
        let rows = first..first + buffer.len() / self.grid.columns;
        let mut setup: Option<Option<(Setup, Plane)>> = None;
        scan(points, self.grid, rows, |row, left, right| {
            let made = || {
                let textured = if surface.repeat == Repeat::Cutout { Some(1.0) } else { None };
                let setup = Setup::new(surface, points, corners, textured)?;
                let values = std::array::from_fn(|k| setup.uv[k].extend(points[k].depth));
                Some((setup, Plane::new(points, values)))
            };
            if let Some((setup, plane)) = setup.get_or_insert_with(made) {
                let (start, across) = (plane.at(left, row).as_vec3(), plane.across.as_vec3());
                let line = &mut buffer[(row - first) * self.grid.columns..][left..right];
                setup.fill(surface, name, (start, across), line, &self.range);
            }
        });
    }
}

/// A triangle as far as one pixel shows it.
#[derive(Clone, Copy)]
struct Shown {
    triangle: u32,
    /// Samples, and the sums of their columns and rows.
    count: u32,
    columns: u32,
    rows: u32,
}

impl Shown {
    fn note(all: &mut Vec<Self>, sample: Sample, column: usize, row: usize) {
        if let Some(known) = all.iter_mut().rev().find(|s| s.triangle == sample.triangle) {
            known.count += 1;
            known.columns += column as u32;
            known.rows += row as u32;
        } else {
            let (columns, rows) = (column as u32, row as u32);
            all.push(Self { triangle: sample.triangle, count: 1, columns, rows });
        }
    }

    /// The middle of its samples, in units.
    const fn middle(&self) -> (i32, i32) {
        let count = self.count as u64;
        ((self.columns as u64 * 256 / count) as i32 + 128, (self.rows as u64 * 256 / count) as i32 + 128)
    }
}

/// Triangles by the band of rows that they touch, in order within each band.
struct Bands {
    /// Start of each band's triangles in `entries`, and the end of the last.
    starts: Vec<usize>,
    /// Triangles.
    entries: Vec<u32>,
}

impl Bands {
    /// A counting sort of triangles by band; those that cover no sample are left out.
    fn new(scene: &Scene<'_>, rows: usize) -> Self {
        let count = scene.grid.rows.div_ceil(rows);
        let touched: Vec<(u32, u32, u32)> = (0..scene.triangles())
            .into_par_iter()
            .with_min_len(4096)
            .filter_map(|name| scene.extent(name).map(|(_, y)| ((y.0 / rows) as u32, (y.1 / rows) as u32, name)))
            .collect();
        let mut starts = vec![0_usize; count + 1];
        for &(a, b, _) in &touched {
            (a..=b).for_each(|band| starts[band as usize + 1] += 1);
        }
        for band in 0..count {
            starts[band + 1] += starts[band];
        }
        let mut next = starts.clone();
        let mut entries = vec![NONE; starts[count]];
        for (a, b, name) in touched {
            for band in a..=b {
                entries[next[band as usize]] = name;
                next[band as usize] += 1;
            }
        }
        Self { starts, entries }
    }

    fn of(&self, band: usize) -> &[u32] {
        &self.entries[self.starts[band]..self.starts[band + 1]]
    }
}

/// One triangle, ready to be filled: `value(x, y) = value(a) + w_b * (b - a) + w_c * (c - a)`.
struct Setup {
    corners: [u32; 3],
    points: [Point; 3],
    /// Twice the area, in squared units; positive of a back.
    area: i64,
    uv: [Vec2; 3],
    picture: Option<usize>,
    level: usize,
    /// A texel is larger than a sample.
    magnified: bool,
    back: bool,
}

impl Setup {
    /// With coordinates for its picture where `textured` says for how many samples a texel is looked up.
    #[inline]
    fn new(surface: &Surface<'_>, points: [Point; 3], corners: [u32; 3], textured: Option<f32>) -> Option<Self> {
        let mesh = surface.mesh;
        let area = edge(points[0], points[1], points[2].x, points[2].y);
        if area == 0 {
            return None;
        }
        // Rows count downwards, so that a front turns clockwise here.
        let back = area > 0;
        let uv = corners.map(|c| mesh.uvs.get(c as usize).copied().unwrap_or(Vec2::ZERO));
        let mut made = Self { corners, points, area, uv, picture: None, level: 0, magnified: false, back };
        let Some(samples) = textured else { return Some(made) };
        let tile = if mesh.tiles.is_empty() { 0 } else { mesh.tiles.get(corners[0] as usize).copied().unwrap_or(NONE) };
        let picture = Some(tile as usize).filter(|t| *t < surface.pictures.len());
        let (level, magnified) = picture.map_or((0, false), |t| {
            let (e1, e2) = (uv[1] - uv[0], uv[2] - uv[0]);
            let texels = (e1.x * e2.y - e1.y * e2.x).abs() * surface.pictures[t].texels();
            let share = samples * texels / (area.abs() as f32 / (SUBSAMPLE * SUBSAMPLE));
            (surface.pictures[t].level(share), share < 1.0)
        });
        (made.picture, made.level, made.magnified) = (picture, level, magnified);
        Some(made)
    }

    /// Puts the triangle into a run of samples where it is nearer than what is there; `start` and `across` are its
    /// coordinates and depth at the first of them and to the next.
    #[inline]
    fn fill(
        &self,
        surface: &Surface<'_>,
        name: u32,
        (start, across): (Vec3, Vec3),
        line: &mut [Sample],
        range: &Range,
    ) {
        let cutout = self.picture.filter(|_| surface.repeat == Repeat::Cutout).map(|t| surface.pictures[t].cutout());
        for (k, sample) in line.iter_mut().enumerate() {
            let depth = start.z + across.z * k as f32;
            let kept = range.first_stays && sample.triangle != NONE;
            if kept || !(depth > sample.depth && depth <= range.near && depth >= range.far) {
                continue;
            }
            let shown = cutout.is_none_or(|cutout| {
                let uv = start + across * k as f32;
                cutout.covers(self.level, self.magnified, uv.x, uv.y)
            });
            if shown {
                *sample = Sample { depth, triangle: name };
            }
        }
    }

    /// Coordinates at a point within it, in units.
    fn uv_at(&self, (x, y): (i32, i32)) -> Vec2 {
        let [a, b, c] = self.points;
        let inverse = 1.0 / self.area as f32;
        let (wb, wc) = (edge(c, a, x, y) as f32 * inverse, edge(a, b, x, y) as f32 * inverse);
        self.uv[0] * (1.0 - wb - wc) + self.uv[1] * wb + self.uv[2] * wc
    }

    /// What the triangle shows at a point within it, in units.
    fn fragment(&self, surface: &Surface<'_>, (x, y): (i32, i32)) -> Fragment {
        let [a, b, c] = self.points;
        let inverse = 1.0 / self.area as f32;
        let (wb, wc) = (edge(c, a, x, y) as f32 * inverse, edge(a, b, x, y) as f32 * inverse);
        let weights = [1.0 - wb - wc, wb, wc];
        let mesh = surface.mesh;
        let mut normal = Vec3::ZERO;
        let (mut tangent, mut hand, mut shade) = (Vec3::ZERO, 1.0_f32, 0.0_f32);
        for (&corner, w) in self.corners.iter().zip(weights) {
            let i = corner as usize;
            normal += mesh.normals.get(i).copied().unwrap_or(Vec3::ZERO) * w;
            shade += mesh.occlusion.get(i).map_or(1.0, |&o| f32::from(o) / 255.0) * w;
            if let Some(t) = mesh.tangents.get(i) {
                tangent += Vec3::new(t[0], t[1], t[2]) * w;
                hand = t[3];
            }
        }
        let mut normal = normal.normalize_or(Vec3::Y);
        let (mut color, mut occlusion, mut place) = (Vec3::ONE, 1.0, NONE);
        if let Some(t) = self.picture {
            let uv = self.uv[0] * weights[0] + self.uv[1] * wb + self.uv[2] * wc;
            let texel = surface.pictures[t].sample(self.level, self.magnified, (uv.x, uv.y), surface.repeat);
            color = texel.color;
            occlusion = texel.occlusion;
            place = Palette::place(t as u32, uv, surface.repeat);
            let tangent = (tangent - normal * normal.dot(tangent)).normalize_or_zero();
            if tangent != Vec3::ZERO {
                let n = texel.normal;
                let bent = tangent * n.x + normal.cross(tangent) * (n.y * hand) + normal * n.z;
                normal = bent.normalize_or(normal);
            }
        }
        Fragment { color: color * shade, light: Vec3::splat(shade), normal, occlusion, back: self.back, shade, place }
    }
}

/// Keeps the last triangle, since neighbouring pixels mostly show the same.
struct Shader<'a> {
    scene: &'a Scene<'a>,
    shading: &'a Shading,
    /// Samples in a pixel.
    area: f32,
    held: u32,
    surface: usize,
    setup: Option<Setup>,
}

impl Shader<'_> {
    /// Which of its surface's pictures the part last shaded shows.
    fn picture(&self) -> usize {
        self.setup.as_ref().and_then(|setup| setup.picture).unwrap_or(0)
    }

    /// The texel that the part last shaded shows; `u32::MAX` for white.
    fn texel(&self, part: &Shown) -> u32 {
        let surface = &self.scene.surfaces[self.surface];
        let picture = self.setup.as_ref().and_then(|s| Some((s, &surface.pictures[s.picture?])));
        picture.map_or(NONE, |(setup, picture)| {
            let uv = setup.uv_at(part.middle());
            picture.address(setup.level, setup.magnified, (uv.x, uv.y), surface.repeat)
        })
    }

    fn shade(&mut self, part: &Shown) -> Fragment {
        if self.held != part.triangle {
            self.held = part.triangle;
            let (surface, triangle) = self.scene.place(part.triangle);
            self.surface = surface;
            let (points, surface) = (&self.scene.projected[surface], &self.scene.surfaces[surface]);
            let corners = surface.mesh.indices[triangle * 3..].first_chunk::<3>().copied();
            self.setup = corners
                .and_then(|corners| Setup::new(surface, corner_points(points, corners)?, corners, Some(self.area)));
        }
        let surface = &self.scene.surfaces[self.surface];
        let fragment = self.setup.as_ref().map_or_else(Fragment::default, |s| s.fragment(surface, part.middle()));
        self.shading.apply(fragment, surface.repeat)
    }
}

#[cfg(test)]
mod tests;
