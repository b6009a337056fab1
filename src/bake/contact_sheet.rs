//! The contact sheet: all trees of a set side by side, a row a variant, a column a level of detail.
//!
//! Everything on a sheet is drawn to one scale, standing on one ground line a row, so that sizes compare. A level with a
//! size at which it takes over is drawn a second time, that small, beside itself: what a player will see.

use glam::Vec3;

use super::letters::{ADVANCE, HEIGHT, rows as letter_rows};
use super::raster::{Surface, Target, View, rasterize};
use super::shade::{Light, Shading};
use super::srgb::encode;

/// Pixels around a tree, and between cells.
const MARGIN: u32 = 14;
/// Pixels for the two lines of text above a tree.
const HEAD: u32 = 2 * (HEIGHT + 4) + 6;
/// Largest edge of a sheet, pixels.
const LARGEST: u32 = 8192;
/// Where trees are looked at from: radians, as [`View::level`].
const AZIMUTH: f32 = 0.45;
/// Background above the ground and below, linear.
const SKY: Vec3 = Vec3::new(0.56, 0.62, 0.68);
const SOIL: Vec3 = Vec3::new(0.40, 0.40, 0.37);
/// Of the letters, sRGB.
const INK: [u8; 4] = [40, 46, 52, 255];

/// One tree at one level.
#[derive(Clone, Debug)]
pub struct SheetCell<'a> {
    /// What it shows; the origin is the foot of the trunk.
    pub surfaces: Vec<Surface<'a>>,
    /// Two lines of text: which level, how many triangles.
    pub labels: [String; 2],
    /// Height at which the level takes over, pixels, for the small picture; 0 for none.
    pub small: u32,
}

/// One row.
#[derive(Clone, Debug)]
pub struct SheetRow<'a> {
    /// Its name.
    pub name: String,
    /// From fine to coarse.
    pub cells: Vec<SheetCell<'a>>,
}

/// A picture for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sheet {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// sRGB and alpha, rows from the top.
    pub pixels: Vec<u8>,
}

/// Draws a sheet whose largest tree is `tree_height` pixels high, smaller where the sheet would be wider or higher than
/// 8192 pixels. An empty sheet is one pixel.
#[must_use]
pub fn contact_sheet(rows: &[SheetRow<'_>], tree_height: u32) -> Sheet {
    let columns = rows.iter().map(|r| r.cells.len()).max().unwrap_or(0) as u32;
    if columns == 0 {
        return Sheet { width: 1, height: 1, pixels: vec![255; 4] };
    }
    let (reach, top) = extent(rows);
    let count = rows.len().min((LARGEST / (HEAD + 3 * MARGIN)) as usize) as u32;
    let columns = columns.min(LARGEST / 64);
    // Text must fit, and so must the whole sheet.
    let room = (LARGEST / count).saturating_sub(HEAD + 3 * MARGIN).max(1);
    let wide = (LARGEST / columns).saturating_sub(2 * MARGIN).max(1) as f32;
    let tall = (tree_height.clamp(8, 4096).min(room) as f32).min(wide * top / (2.0 * reach)).max(1.0);
    let per_metre = tall / top;
    let tree = ((2.0 * reach * per_metre).ceil() as u32, tall.ceil() as u32);
    let cell = ((tree.0 + 2 * MARGIN).max(24 * ADVANCE).min(LARGEST / columns), tree.1 + HEAD + 3 * MARGIN);
    let mut sheet = Canvas::new(cell.0 * columns, cell.1 * count);
    for (r, row) in rows.iter().take(count as usize).enumerate() {
        let ground = r as u32 * cell.1 + HEAD + MARGIN + tree.1;
        sheet.band(ground, (r as u32 + 1) * cell.1);
        for (c, shown) in row.cells.iter().take(columns as usize).enumerate() {
            let left = c as u32 * cell.0;
            let text = r as u32 * cell.1 + MARGIN / 2;
            sheet.write(left + MARGIN, text, &format!("{} {}", row.name, shown.labels[0]), cell.0 - MARGIN);
            sheet.write(left + MARGIN, text + HEIGHT + 4, &shown.labels[1], cell.0 - MARGIN);
            let view = |reach: f32| View::level(AZIMUTH, Vec3::Y * (top * 0.5), reach, top * 0.5);
            let half = tree.0 as f32 * 0.5 / per_metre;
            let drawn = rasterize(&shown.surfaces, &view(half), tree.0, tree.1, 3, &Shading::Lit(Light::DAY));
            sheet.lay(&drawn, left + cell.0.saturating_sub(tree.0) / 2, ground - tree.1);
            if shown.small > 0 && shown.small * 3 < tree.1 {
                let small = (((2 * shown.small) as f32 * reach / top).ceil() as u32, shown.small);
                let half = small.0 as f32 * 0.5 * top / small.1 as f32;
                let drawn = rasterize(&shown.surfaces, &view(half), small.0, small.1, 3, &Shading::Lit(Light::DAY));
                sheet.lay(&drawn, (left + cell.0).saturating_sub(small.0 + 2), ground - small.1);
            }
        }
    }
    Sheet { width: sheet.width, height: sheet.height, pixels: sheet.pixels.into_flattened() }
}

/// Half the width and the height of a box around every tree, metres, with a little air.
fn extent(rows: &[SheetRow<'_>]) -> (f32, f32) {
    let (mut reach, mut top) = (0.1_f32, 0.1_f32);
    let surfaces = rows.iter().flat_map(|r| &r.cells).flat_map(|c| &c.surfaces);
    for p in surfaces.flat_map(|s| &s.mesh.positions).filter(|p| p.is_finite()) {
        reach = reach.max((p.x * p.x + p.z * p.z).sqrt());
        top = top.max(p.y);
    }
    (reach.min(1e6) * 1.03, top.min(1e6) * 1.03)
}

struct Canvas {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 4]>,
}

impl Canvas {
    fn new(width: u32, height: u32) -> Self {
        let sky = [encode(SKY.x), encode(SKY.y), encode(SKY.z), 255];
        Self { width, height, pixels: vec![sky; width as usize * height as usize] }
    }

    /// Ground from one row to another.
    fn band(&mut self, top: u32, bottom: u32) {
        let soil = [encode(SOIL.x), encode(SOIL.y), encode(SOIL.z), 255];
        let wide = self.width as usize;
        let bottom = bottom.saturating_sub(MARGIN).max(top).min(self.height);
        self.pixels[top.min(bottom) as usize * wide..bottom as usize * wide].fill(soil);
    }

    fn lay(&mut self, target: &Target, left: u32, top: u32) {
        let rows = target.height.min(self.height.saturating_sub(top));
        let columns = target.width.min(self.width.saturating_sub(left));
        for y in 0..rows {
            for x in 0..columns {
                let from = (y * target.width + x) as usize;
                let cover = target.coverage[from];
                if cover > 0.0 {
                    // Over the sky; the ground begins below the trees.
                    let mixed = target.color[from] * cover + SKY * (1.0 - cover);
                    let to = (top + y) as usize * self.width as usize + (left + x) as usize;
                    self.pixels[to] = [encode(mixed.x), encode(mixed.y), encode(mixed.z), 255];
                }
            }
        }
    }

    /// Text on one line, cut off after `room` pixels.
    fn write(&mut self, left: u32, top: u32, text: &str, room: u32) {
        for (i, letter) in text.chars().take((room / ADVANCE) as usize).enumerate() {
            for (y, bits) in letter_rows(letter).into_iter().enumerate() {
                for x in 0..5 {
                    let (px, py) = (left + i as u32 * ADVANCE + x, top + y as u32);
                    if bits >> (4 - x) & 1 == 1 && px < self.width && py < self.height {
                        self.pixels[py as usize * self.width as usize + px as usize] = INK;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::Repeat;
    use crate::mesh::Mesh;

    fn post(height: f32) -> Mesh {
        Mesh {
            positions: [(-0.5, 0.0), (0.5, 0.0), (0.5, height), (-0.5, height)]
                .map(|(x, y)| Vec3::new(x, y, 0.0))
                .into(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        }
    }

    fn row(mesh: &Mesh) -> SheetRow<'_> {
        let cell = |labels: [&str; 2]| SheetCell {
            surfaces: vec![Surface { mesh, pictures: &[], repeat: Repeat::Tiled }],
            labels: labels.map(str::to_owned),
            small: 9,
        };
        SheetRow { name: "oak".into(), cells: vec![cell(["Full", "12 triangles"]), cell(["Cloud", "\u{1f333}"])] }
    }

    #[test]
    fn trees_stand_on_the_ground_at_one_scale() {
        let (short, tall) = (post(2.0), post(4.0));
        let sheet = contact_sheet(&[row(&tall), row(&short)], 100);
        assert_eq!(sheet.pixels.len(), (sheet.width * sheet.height * 4) as usize);
        // Lit pixels of the middle of the first column, in the upper and in the lower row.
        let x = (sheet.width / 4) as usize;
        let sky = &sheet.pixels[..4].to_vec();
        let half = sheet.height as usize / 2;
        let lit = |from: usize| {
            let first = from + HEAD as usize;
            let last = from + half - 2 * MARGIN as usize;
            (first..last).filter(|y| &sheet.pixels[(y * sheet.width as usize + x) * 4..][..4] != sky.as_slice()).count()
        };
        let (a, b) = (lit(0) as f32, lit(half) as f32);
        assert!((a / b - 2.0).abs() < 0.1, "{a} {b}");
    }

    #[test]
    fn strange_sheets_are_drawn_within_bounds() {
        assert_eq!(contact_sheet(&[], 100).pixels.len(), 4);
        let (flat, broken) =
            (post(1e-9), Mesh { positions: vec![Vec3::NAN; 3], indices: vec![0, 1, 2], ..Mesh::default() });
        let sheet = contact_sheet(&[row(&flat), row(&broken)], u32::MAX);
        assert!(sheet.width <= LARGEST && sheet.height <= LARGEST);
    }
}
