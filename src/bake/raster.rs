//! An orthographic, z-buffered triangle rasterizer with textures, alpha test and supersampling.
//!
//! It bakes the cards of the billboard cloud, measures levels of detail against each other and draws contact sheets.
//! Two passes: the first finds for every sample the nearest triangle (a visibility buffer; only depth and alpha are
//! looked at), the second fetches colour, normal and occlusion once for each triangle that a pixel shows, at the middle of
//! its samples there, and weighs them by their samples. Most triangles of a tree are smaller than a pixel: those whose
//! box holds few samples are tested against each of them, without a division. (Tried: from front to back with a
//! hierarchical z-buffer. Nothing is hidden by it where triangles have 1.3 samples each, as those of impostors have, and as
//! much is won as lost in large pictures. Outer leaves first, whatever the view, and what lies behind all of its box left out:
//! no gain for impostors, and large pictures took a sixth longer. Sides of tubes left out two triangles at a time, colours left
//! out where a recipe tells them: no gain.)
//!
//! Vertices are snapped to 1/256 of a sample and edges tested in integers with the top-left rule, so triangles that share
//! an edge neither overlap nor leave a gap. Bands of rows are filled in parallel, each walking its triangles in order;
//! of two samples at the same depth the earlier triangle's stays: the picture is the same on any number of threads.
//! Texture coordinates are affine under an orthographic view, so the mip level is one a triangle.
//!
//! Limits: no perspective, no transparency; triangles with a vertex that is not finite or more than 200,000 samples
//! away from the picture are skipped; pictures are at most 8192 samples wide and high.

use bytemuck::zeroed_vec;
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::cutout::Level;
use super::draft::Draft;
use super::picture::{Picture, Repeat};
use super::quads::{is_parallelogram, joined};
use super::recipe::{Palette, Recipe};
use super::samples::{
    Extent, Grid, Plane, Point, SMALL, Small, corner_points, extent, holds_any, is_back, mixed, project, scan_box,
};
use super::shade::{Fragment, Light, Shading};
use super::shader::{Face, Worn};
use crate::base::{Frame, Seed};
use crate::mesh::{Mesh, TreeMesh};

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

    /// The same from an elevation (radians, π/2 looks straight down, with the azimuth at the lower edge).
    #[must_use]
    pub fn raised(azimuth: f32, elevation: f32, centre: Vec3, half_width: f32, half_height: f32) -> Self {
        let level = Self::level(azimuth, centre, half_width, half_height);
        let (sin, cos) = crate::base::math::sin_cos(elevation);
        let z = level.frame.z * cos + Vec3::Y * sin;
        Self { frame: Frame { y: z.cross(level.frame.x), z, ..level.frame }, ..level }
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
    /// Backs are always hidden, and left out: of tubes with ends that views look into from outside never.
    pub closed: bool,
}

impl<'a> Surface<'a> {
    /// A tree in its pictures: wood, which is closed, and leaves, whose tiles count theirs.
    #[must_use]
    pub fn of_tree(tree: &'a TreeMesh, bark: &'a [Picture], leaves: &'a [Picture]) -> [Self; 2] {
        [
            Self { mesh: &tree.bark, pictures: bark, repeat: Repeat::Tiled, closed: true },
            Self { mesh: &tree.leaf, pictures: leaves, repeat: Repeat::Cutout, closed: false },
        ]
    }

    /// What its pictures let through, of 255, at each texel of a palette of them; wood nothing.
    pub(crate) fn through(&self) -> impl Iterator<Item = u8> + use<'a> {
        let is_leaf = self.repeat == Repeat::Cutout;
        self.pictures.iter().flat_map(Picture::through).map(move |&through| if is_leaf { through } else { 0 })
    }
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
    /// Unit normals in the world; zero where nothing is covered. Of [`Shading::Seen`] one that the pixel shows, else the mean.
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
    let one_normal = *shading == Shading::Seen;
    let count = width as usize * height as usize;
    // Zeroed by the system, page by page where something is drawn.
    let mut target = Target {
        width,
        height,
        coverage: vec![0.0; count],
        color: zeroed_vec(count),
        normal: zeroed_vec(count),
        occlusion: vec![0.0; count],
        depth: vec![0.0; count],
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
        let mut shader = Shader { scene: &scene, shading, area, held: NONE, surface: 0, face: None };
        let mut shown: Vec<Shown> = Vec::new();
        let mut mixed: Vec<(u32, f32)> = Vec::new();
        for (y, lines) in buffer.chunks_exact(grid.columns * per_pixel).enumerate() {
            for x in 0..width as usize {
                let pixel = y * width as usize + x;
                let at = (x * per_pixel, first + y * per_pixel);
                let deep = Shown::of_pixel(&mut shown, lines, grid.columns, per_pixel, at);
                mixed.clear();
                if shown.is_empty() {
                    depth[pixel] = f32::NEG_INFINITY;
                } else {
                    let hits: u32 = shown.iter().map(|part| part.count).sum();
                    let scale = 1.0 / hits as f32;
                    coverage[pixel] = hits as f32 / area;
                    depth[pixel] = deep * scale;
                    if *shading != Shading::Nothing {
                        let mut sum = Fragment::default();
                        let place = first / per_pixel * width as usize + pixel;
                        let picked = if one_normal { Shown::picked(&shown, hits, place) } else { usize::MAX };
                        let mut normal_of = None;
                        for (i, part) in shown.iter().enumerate() {
                            let fragment = shader.shade(part, !one_normal || i == picked);
                            if i == picked {
                                normal_of = Some(fragment.normal);
                            }
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
                        // Of one part it has unit length.
                        let is_one = shown.len() == 1;
                        let mean = || if is_one { sum.normal * scale } else { sum.normal.normalize_or(view.frame.z) };
                        normal[pixel] = normal_of.unwrap_or_else(mean);
                        occlusion[pixel] = sum.occlusion * scale;
                    }
                }
                match noted {
                    Noted::Nothing => {}
                    Noted::Palette(_) => notes.recipe.push(&mut mixed),
                    Noted::Light(_) => notes.draft.end(),
                }
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
        if self.surfaces[surface].closed && is_back(points) {
            return None;
        }
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
            let mut rest = surface.mesh.indices.as_chunks::<3>().0;
            let mut name = start;
            while let [corners, others @ ..] = rest {
                let pair = others.first().filter(|_| !surface.closed).map(|second| [*corners, *second]);
                if pair.is_some_and(|pair| self.fill_pair(surface, points, name, pair, buffer)) {
                    (rest, name) = (&others[1..], name + 2);
                } else {
                    self.fill_one(surface, points, name, *corners, 0, buffer);
                    (rest, name) = (others, name + 1);
                }
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
        if surface.closed && is_back(points) {
            return;
        }
        let Some(extent) = extent(points, self.grid) else { return };
        let rows = first..first + buffer.len() / self.grid.columns;
        if let Some(small) = Small::new(points, extent) {
            self.fill_small(&small, surface, (name, corners, points), first, buffer);
            return;
        }
        let mut setup: Option<(Worn, Plane<DVec3>)> = None;
        scan_box(points, self.grid, rows, |row, left, right| {
            let (worn, plane) = setup.get_or_insert_with(|| {
                let worn = Worn::tested(surface, points, corners);
                let values = std::array::from_fn(|k| worn.uv[k].extend(points[k].depth).as_dvec3());
                (worn, Plane::new(points, values))
            });
            let along = (plane.at(left, row).as_vec3(), plane.across.as_vec3());
            let line = &mut buffer[(row - first) * self.grid.columns..][left..right];
            self.range.fill(surface, (name, worn), along, line);
        });
    }

    /// Fills two triangles that are a small parallelogram, the first of them number `name`; false where they are not.
    #[inline]
    fn fill_pair(
        &self,
        surface: &Surface<'_>,
        points: &[Point],
        name: u32,
        triangles: [[u32; 3]; 2],
        buffer: &mut [Sample],
    ) -> bool {
        let Some(corners) = joined(triangles) else { return false };
        let Some(p) = corner_points(points, corners) else { return false };
        let Some(extent) = extent(p, self.grid) else { return true };
        let Some(small) = Small::new(p, extent) else { return false };
        if !is_parallelogram(surface.mesh, corners, p) {
            return false;
        }
        self.fill_small(&small, surface, (name, triangles[0], [p[0], p[1], p[2]]), 0, buffer);
        true
    }

    /// Fills a small triangle, or one and the next, which are a parallelogram.
    #[inline]
    fn fill_small<const N: usize>(
        &self,
        small: &Small<N>,
        surface: &Surface<'_>,
        (name, corners, points): (u32, [u32; 3], [Point; 3]),
        first: usize,
        buffer: &mut [Sample],
    ) {
        let rows = first..first + buffer.len() / self.grid.columns;
        let inverse = small.inverse();
        let depths = points.map(|p| p.depth * inverse);
        // What cuts it out, whether its texels are larger than samples, and where its corners lie in its picture.
        let mut setup: Option<(Option<&Level>, bool, [Vec2; 3])> = None;
        small.each(rows, |row, column, at| {
            let sample = &mut buffer[(row - first) * self.grid.columns + column];
            let depth = mixed(depths, at);
            if !self.range.takes(depth, sample) {
                return;
            }
            let (level, magnified, uvs) = setup.get_or_insert_with(|| {
                let worn = Worn::tested(surface, points, corners);
                (worn.level_of(surface), worn.magnified, worn.uv.map(|uv| uv * inverse))
            });
            if level.is_none_or(|level| level.shows(*magnified, mixed(*uvs, at))) {
                let is_second = N > 3 && at[1] < 0;
                *sample = Sample { depth, triangle: name + u32::from(is_second) };
            }
        });
    }
}

impl Range {
    /// Whether what lies at a depth is seen before what a sample shows.
    #[inline]
    fn takes(&self, depth: f32, sample: &Sample) -> bool {
        let kept = self.first_stays && sample.triangle != NONE;
        !kept && depth > sample.depth && depth <= self.near && depth >= self.far
    }

    /// Puts a triangle into a run of samples where it is nearer than what is there; `start` and `across` are its
    /// coordinates and depth at the first of them and to the next.
    #[inline]
    fn fill(
        &self,
        surface: &Surface<'_>,
        (name, worn): (u32, &Worn),
        (start, across): (Vec3, Vec3),
        line: &mut [Sample],
    ) {
        let level = worn.level_of(surface);
        for (k, sample) in line.iter_mut().enumerate() {
            let depth = start.z + across.z * k as f32;
            if !self.takes(depth, sample) {
                continue;
            }
            let shows = |level: &Level| level.shows(worn.magnified, (start + across * k as f32).truncate());
            if level.is_none_or(shows) {
                *sample = Sample { depth, triangle: name };
            }
        }
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
    /// Notes what the samples of a pixel show; their columns and rows are counted from `at`. The sum of their depths.
    #[inline]
    fn of_pixel(all: &mut Vec<Self>, lines: &[Sample], columns: usize, size: usize, at: (usize, usize)) -> f32 {
        all.clear();
        if size == 1 {
            let sample = lines[at.0];
            if sample.triangle != NONE {
                all.push(Self { triangle: sample.triangle, count: 1, columns: at.0 as u32, rows: at.1 as u32 });
            }
            return sample.depth;
        }
        let mut deep = 0.0;
        for down in 0..size {
            for (across, sample) in lines[down * columns + at.0..][..size].iter().enumerate() {
                if sample.triangle == NONE {
                    continue;
                }
                deep += sample.depth;
                let (column, row) = ((at.0 + across) as u32, (at.1 + down) as u32);
                if let Some(known) = all.iter_mut().rev().find(|s| s.triangle == sample.triangle) {
                    known.count += 1;
                    known.columns += column;
                    known.rows += row;
                } else {
                    all.push(Self { triangle: sample.triangle, count: 1, columns: column, rows: row });
                }
            }
        }
        deep
    }

    /// The part that one of a pixel's `hits` samples shows, picked by chance that hangs on the pixel's place.
    fn picked(all: &[Self], hits: u32, place: usize) -> usize {
        let mut sample = Seed::new(place as u64).index(hits as usize) as u32;
        let holds = |part: &Self| {
            let here = sample < part.count;
            sample = sample.saturating_sub(part.count);
            here
        };
        all.iter().position(holds).unwrap_or(0)
    }

    /// The middle of its samples, in units.
    const fn middle(&self) -> (i32, i32) {
        // Sums of 256 samples, each below 8192, in units: they fit.
        let (columns, rows) = (self.columns * 256, self.rows * 256);
        if self.count == 1 {
            return (columns as i32 + 128, rows as i32 + 128);
        }
        ((columns / self.count) as i32 + 128, (rows / self.count) as i32 + 128)
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

/// Keeps the last triangle, since neighbouring pixels mostly show the same.
struct Shader<'a> {
    scene: &'a Scene<'a>,
    shading: &'a Shading,
    /// Samples in a pixel.
    area: f32,
    held: u32,
    surface: usize,
    face: Option<Face<'a>>,
}

impl Shader<'_> {
    /// Which of its surface's pictures the part last shaded shows.
    fn picture(&self) -> usize {
        self.face.as_ref().map_or(0, Face::picture)
    }

    /// The texel that the part last shaded shows; `u32::MAX` for white.
    fn texel(&self, part: &Shown) -> u32 {
        self.face.as_ref().map_or(NONE, |face| face.texel(part.middle()))
    }

    #[inline]
    fn shade(&mut self, part: &Shown, has_normal: bool) -> Fragment {
        if self.held != part.triangle {
            self.held = part.triangle;
            let (surface, triangle) = self.scene.place(part.triangle);
            self.surface = surface;
            let (points, surface) = (&self.scene.projected[surface], &self.scene.surfaces[surface]);
            let corners = surface.mesh.indices[triangle * 3..].first_chunk::<3>().copied();
            self.face =
                corners.and_then(|corners| Face::new(surface, corner_points(points, corners)?, corners, self.area));
        }
        let fragment =
            self.face.as_ref().map_or_else(Fragment::default, |face| face.fragment(part.middle(), has_normal));
        self.shading.apply(fragment, self.scene.surfaces[self.surface].repeat)
    }
}

#[cfg(test)]
mod tests;
