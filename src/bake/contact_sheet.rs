//! The contact sheet: all trees of a set side by side, a row a variant, a column a level of detail.
//!
//! Everything on a sheet is drawn to one scale, standing on one ground line a row, so that sizes compare; only rows whose
//! trees would be dots are enlarged, and say so. Lower levels are drawn a second time beside themselves, small: as a player will see them. Each tree is drawn by itself, from its own
//! pictures rather than the atlas, so that a sheet of many needs but those drawn anew that did change.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;

use super::draft::Draft;
use super::letters::{ADVANCE, HEIGHT, rows as letter_rows};
use super::picture::Picture;
use super::raster::{Surface, View, draft};
use super::shade::Light;
use super::srgb::encode;
use crate::base::Frame;
use crate::mesh::TreeMesh;

/// Pixels around a tree, and between cells.
const MARGIN: u32 = 14;
/// Pixels for each dot of a letter.
const LETTER: u32 = 2;
/// Samples along an edge of a pixel.
const SAMPLES: u32 = 2;
/// Letters that columns are made wider for, at most; longer names are cut off.
const MOST_LETTERS: usize = 64;
/// Pixels for the two lines of text above a tree.
const HEAD: u32 = 2 * (LETTER * HEIGHT + 6) + 6;
/// Height of the largest tree, pixels.
const TREE: u32 = 280;
/// How many times as large as a row's trees the largest of the sheet must be for the row to be enlarged.
const DOTS: f32 = 8.0;
/// How much smaller lower levels are drawn the second time.
const SMALL: u32 = 5;
/// Extents of the least tree, metres.
const LEAST: f32 = 0.01;
/// Largest edge of a sheet, pixels.
const LARGEST: u32 = 8192;
/// Height of a sheet that its trees are drawn smaller for, down to a half.
const TALL: u32 = 4096;
/// Where trees are looked at from: radians, as [`View::level`].
const AZIMUTH: f32 = 0.45;
/// Background above the ground and below, linear.
const SKY: Vec3 = Vec3::new(0.56, 0.62, 0.68);
const SOIL: Vec3 = Vec3::new(0.40, 0.40, 0.37);
/// Of the letters, sRGB.
const INK: [u8; 3] = [40, 46, 52];

/// One tree at one level.
#[derive(Clone, Debug)]
pub struct SheetColumn<'a> {
    /// Which level, how many triangles.
    pub label: String,
    /// Where it is shown, in the line above; the first column's is the row's.
    pub shown: String,
    /// Bark, and leaves whose tiles count pictures of the row; the origin is the foot of the trunk.
    pub mesh: &'a TreeMesh,
}

/// One variant.
#[derive(Clone, Debug)]
pub struct SheetRow<'a> {
    /// Its name.
    pub label: String,
    /// From fine to coarse.
    pub columns: Vec<SheetColumn<'a>>,
}

/// A picture for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sheet {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// sRGB, three bytes a pixel, rows from the top.
    pub pixels: Vec<u8>,
}

/// How large trees are drawn on a sheet: with its mesh and pictures all that the drawings of a tree hang on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SheetScale {
    /// Pixels of a tree, and of the small one beside it.
    tree: (u32, u32),
    small: (u32, u32),
    /// Pixels a metre, and metres from the ground to the top.
    per_metre: f32,
    top: f32,
}

/// Where everything is on a sheet.
#[derive(Clone, Debug)]
pub struct SheetLayout {
    size: (u32, u32),
    cell: (u32, u32),
    /// By row; they differ in metres only.
    scales: Vec<SheetScale>,
    /// By row: left, top in its row, room and letters.
    texts: Vec<Vec<(u32, u32, u32, String)>>,
    /// Row and column of each tree that has a place.
    cells: Vec<(usize, usize)>,
}

/// The drawings of one tree at one level, before they have colours: large, and of lower levels small.
#[derive(Clone, Debug)]
pub struct SheetCell {
    large: Drawing,
    little: Option<Drawing>,
}

/// The colours of a picture with its mips.
#[derive(Clone, Debug)]
pub struct SheetColors(Vec<[u16; 4]>);

/// One tree on a sheet.
#[derive(Clone, Debug)]
struct Drawing {
    width: u32,
    coverage: Vec<f32>,
    draft: Draft,
}

impl SheetScale {
    /// The axes of who looks at the trees.
    #[must_use]
    pub fn viewer() -> Frame {
        View::level(AZIMUTH, Vec3::ZERO, 1.0, 1.0).frame
    }

    /// Draws one tree at one level; colours of pictures are not looked at. `leaves` are those that the mesh's tiles count.
    #[must_use]
    pub fn draw(&self, column: usize, mesh: &TreeMesh, bark: &Picture, leaves: &[Picture]) -> SheetCell {
        let half = (self.tree.0 as f32 * 0.5 / self.per_metre, self.top * 0.5);
        let view = View::level(AZIMUTH, Vec3::Y * half.1, half.0, half.1);
        let surfaces = Surface::of_tree(mesh, std::slice::from_ref(bark), leaves);
        let one = |size: (u32, u32), samples: u32| {
            let (target, draft) = draft(&surfaces, &view, (size.0, size.1, samples), Light::DAY);
            Drawing { width: target.width, coverage: target.coverage, draft }
        };
        SheetCell { large: one(self.tree, SAMPLES), little: (column > 0).then(|| one(self.small, SAMPLES + 1)) }
    }
}

impl SheetCell {
    /// About how many bytes it takes.
    #[must_use]
    pub fn weight(&self) -> usize {
        let of = |drawing: &Drawing| drawing.coverage.len() * 4 + drawing.draft.weight();
        of(&self.large) + self.little.as_ref().map_or(0, of)
    }
}

impl SheetColors {
    /// Those of a picture of so many by so many texels, sRGB with alpha.
    #[must_use]
    pub fn of(size: (u32, u32), color: &[[u8; 4]]) -> Self {
        Self(Picture::colors(size, color))
    }
}

impl SheetLayout {
    /// Lays out a sheet. The largest tree is 280 pixels high, or 210 or 140 where the sheet would be higher than 4096 pixels,
    /// or 105, 70, … where it would be higher than 8192, and less where it would be wider.
    #[must_use]
    pub fn new(rows: &[SheetRow<'_>]) -> Self {
        let columns = (rows.iter().map(|r| r.columns.len()).max().unwrap_or(0) as u32).clamp(1, LARGEST / 64);
        let extents: Vec<(f32, f32)> = rows.iter().map(extent).collect();
        let larger = |a: (f32, f32), b: &(f32, f32)| (a.0.max(b.0), a.1.max(b.1));
        let (reach, top) = extents.iter().fold((LEAST, LEAST), larger);
        let count = rows.len().clamp(1, (LARGEST / (HEAD + 4 * MARGIN)) as usize) as u32;
        // Text must fit, and so must the whole sheet.
        let room = |all: u32| (all / count).saturating_sub(HEAD + 3 * MARGIN);
        let room = room(TALL).max(room(LARGEST).min(TREE / 2)).max(1);
        let wide = (LARGEST / columns).saturating_sub(2 * MARGIN).max(1) as f32 * SMALL as f32 / (SMALL + 2) as f32;
        // By steps: one more row seldom changes the scale of all.
        let step = (0..).map(|k| (TREE >> (k / 2)) * if k % 2 == 0 { 4 } else { 3 } / 4).find(|&tall| tall <= room);
        let tall = (step.unwrap_or(1) as f32).min(wide * top / (2.0 * reach)).max(1.0);
        let per_metre = tall / top;
        let tree = ((2.0 * reach * per_metre).ceil() as u32, tall.ceil() as u32);
        let small = ((tree.0 / SMALL).max(1), (tree.1 / SMALL).max(1));
        // Room beside the tree for the small one, so that neither hides the other.
        let written = |text: &str| text.chars().count().min(MOST_LETTERS) as u32 * LETTER * ADVANCE + MARGIN;
        let text = rows.iter().zip(&extents).map(|(row, own)| {
            // A name has the whole row where nothing stands beside it.
            let name = name(&row.label, enlarged((reach / own.0).min(top / own.1)));
            let name = if alone(row) { 0 } else { written(&name) };
            let columns = row.columns.iter().flat_map(|column| [written(&column.label), written(&column.shown)]);
            columns.fold(name, u32::max)
        });
        let text = text.fold(32 * LETTER * ADVANCE, u32::max);
        let cell = ((tree.0 + 2 * (MARGIN + small.0)).max(text).min(LARGEST / columns), tree.1 + HEAD + 3 * MARGIN);
        let mut sheet = Self {
            size: (cell.0 * columns, cell.1 * count),
            cell,
            scales: Vec::new(),
            texts: Vec::new(),
            cells: Vec::new(),
        };
        for (r, (row, own)) in rows.iter().zip(&extents).take(count as usize).enumerate() {
            let larger = enlarged((reach / own.0).min(top / own.1));
            sheet.scales.push(SheetScale { tree, small, per_metre: per_metre * larger, top: top / larger });
            let text = MARGIN / 2;
            let room = if alone(row) { cell.0 * columns } else { cell.0 - MARGIN };
            let mut texts = vec![(MARGIN, text, room, name(&row.label, larger))];
            for (c, shown) in row.columns[..row.columns.len().min(columns as usize)].iter().enumerate() {
                let left = c as u32 * cell.0;
                texts.push((left + MARGIN, text + LETTER * HEIGHT + 6, cell.0 - MARGIN, shown.label.clone()));
                if c > 0 {
                    texts.push((left + MARGIN, text, cell.0 - MARGIN, shown.shown.clone()));
                }
                sheet.cells.push((r, c));
            }
            sheet.texts.push(texts);
        }
        sheet
    }

    /// How large the trees of a row are drawn that has [cells](Self::cells).
    ///
    /// # Panics
    ///
    /// Where the row has none.
    #[must_use]
    pub fn scale(&self, row: usize) -> SheetScale {
        self.scales[row]
    }

    /// Row and column of each tree that has a place on the sheet.
    #[must_use]
    pub fn cells(&self) -> &[(usize, usize)] {
        &self.cells
    }

    /// The line of a row's pixels on which its trees stand.
    fn ground(&self) -> u32 {
        self.cell.1 - 2 * MARGIN
    }

    /// The sheet in colours: drawings in the order of [`cells`](Self::cells), the bark's colours, and by row those of
    /// the leaves' pictures. A sheet without trees is one pixel.
    #[must_use]
    pub fn paint<'c>(
        &self,
        drawn: &[Arc<SheetCell>],
        bark: &'c SheetColors,
        leaves: &(dyn Fn(usize) -> Vec<&'c SheetColors> + Sync),
    ) -> Sheet {
        if self.cells.is_empty() {
            return Sheet { width: 1, height: 1, pixels: vec![255; 3] };
        }
        let (wide, tall) = (self.size.0 as usize, self.cell.1 as usize);
        let mut pixels = vec![[0; 3]; wide * self.size.1 as usize];
        // A band a row of trees.
        pixels.par_chunks_exact_mut(wide * tall).enumerate().for_each(|(row, pixels)| {
            let mut band = Band::new(self.size.0, pixels);
            band.soil(self.ground());
            for (left, top, room, text) in &self.texts[row] {
                band.write(*left, *top, text, *room);
            }
            let colors: Vec<&[[u16; 4]]> =
                std::iter::once(bark).chain(leaves(row)).map(|colors| colors.0.as_slice()).collect();
            let of_row = self.cells.iter().zip(drawn).filter(|((r, _), _)| *r == row);
            for ((_, column), cell) in of_row {
                let SheetScale { tree, small, .. } = self.scales[row];
                let left = *column as u32 * self.cell.0;
                let middle = left + self.cell.0.saturating_sub(tree.0) / 2;
                band.lay(&cell.large, &colors, (middle, self.ground().saturating_sub(tree.1)));
                if let Some(little) = &cell.little {
                    let right = (left + self.cell.0).saturating_sub(small.0 + 2);
                    band.lay(little, &colors, (right, self.ground().saturating_sub(small.1)));
                }
            }
        });
        Sheet { width: self.size.0, height: self.size.1, pixels: pixels.into_flattened() }
    }
}

/// Half the width and the height of a box around every tree of a row, metres, with a little air.
fn extent(row: &SheetRow<'_>) -> (f32, f32) {
    let (mut reach, mut top) = (LEAST, LEAST);
    let meshes = row.columns.iter().flat_map(|c| [&c.mesh.bark, &c.mesh.leaf]);
    for p in meshes.flat_map(|m| &m.positions).filter(|p| p.is_finite()) {
        reach = reach.max((p.x * p.x + p.z * p.z).sqrt());
        top = top.max(p.y);
    }
    (rounded(reach.min(1e6) * 1.03), rounded(top.min(1e6) * 1.03))
}

/// By how much trees are enlarged that are so many times smaller than the largest: by powers of two, to a quarter of it at
/// least and a half at most.
fn enlarged(smaller: f32) -> f32 {
    if smaller < DOTS {
        return 1.0;
    }
    let mut larger = 1.0;
    while larger * 4.0 <= smaller {
        larger *= 2.0;
    }
    larger
}

/// Whether nothing stands beside a row's name.
fn alone(row: &SheetRow<'_>) -> bool {
    row.columns.iter().skip(1).all(|column| column.shown.is_empty())
}

/// What stands above a row.
fn name(label: &str, larger: f32) -> String {
    if larger > 1.0 { format!("{label}, {larger} x larger") } else { label.to_owned() }
}

/// Up to a sixteenth more of a length: one more tree seldom changes the scale of all.
fn rounded(length: f32) -> f32 {
    let mut step = 1.0 / 1024.0;
    while step * 32.0 < length {
        step *= 2.0;
    }
    (length / step).ceil() * step
}

/// The pixels of a row of trees.
struct Band<'a> {
    width: u32,
    height: u32,
    pixels: &'a mut [[u8; 3]],
}

impl<'a> Band<'a> {
    fn new(width: u32, pixels: &'a mut [[u8; 3]]) -> Self {
        pixels.fill(SKY.to_array().map(encode));
        Self { width, height: (pixels.len() / width.max(1) as usize) as u32, pixels }
    }

    /// Ground from a line on.
    fn soil(&mut self, top: u32) {
        let bottom = self.height.saturating_sub(MARGIN).max(top).min(self.height);
        let wide = self.width as usize;
        self.pixels[top.min(bottom) as usize * wide..bottom as usize * wide].fill(SOIL.to_array().map(encode));
    }

    /// A tree over what is there of the sky; what is bare of it is left.
    fn lay(&mut self, drawing: &Drawing, colors: &[&[[u16; 4]]], (left, top): (u32, u32)) {
        let (wide, size) = (self.width as usize, drawing.width.max(1));
        for (i, (light, cover)) in drawing.draft.paint(colors).zip(&drawing.coverage).enumerate() {
            let (x, y) = (left + i as u32 % size, top + i as u32 / size);
            if *cover > 0.0 && x < self.width && y < self.height {
                let over = light + SKY * (1.0 - cover);
                self.pixels[y as usize * wide + x as usize] = over.to_array().map(encode);
            }
        }
    }

    /// Text on one line, cut off after `room` pixels.
    fn write(&mut self, left: u32, top: u32, text: &str, room: u32) {
        for (i, letter) in text.chars().take((room / (LETTER * ADVANCE)) as usize).enumerate() {
            for (y, bits) in letter_rows(letter).into_iter().enumerate() {
                for x in (0..5).filter(|x| bits >> (4 - x) & 1 == 1) {
                    self.dot(left + (i as u32 * ADVANCE + x) * LETTER, top + y as u32 * LETTER);
                }
            }
        }
    }

    /// One dot of a letter.
    fn dot(&mut self, left: u32, top: u32) {
        for y in top..(top + LETTER).min(self.height) {
            for x in left..(left + LETTER).min(self.width) {
                self.pixels[y as usize * self.width as usize + x as usize] = INK;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::Maps;
    use crate::mesh::Mesh;

    fn post(height: f32) -> TreeMesh {
        let corners = [(-0.5, 0.0), (0.5, 0.0), (0.5, height), (-0.5, height)];
        let bark = Mesh {
            positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).into(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        };
        TreeMesh { bark, leaf: Mesh::default() }
    }

    fn row(mesh: &TreeMesh) -> SheetRow<'_> {
        let column = |label: &str| SheetColumn { label: label.to_owned(), shown: String::new(), mesh };
        SheetRow { label: "oak_001".into(), columns: vec![column("LOD0 Full 12 tris"), column("\u{1f333}")] }
    }

    fn contact_sheet(rows: &[SheetRow<'_>]) -> Sheet {
        let layout = SheetLayout::new(rows);
        let (bark, colors) = (Picture::new(&grey()), SheetColors::of((1, 1), &grey().color));
        let draw = |&(r, c): &(usize, usize)| Arc::new(layout.scale(r).draw(c, rows[r].columns[c].mesh, &bark, &[]));
        let drawn: Vec<Arc<SheetCell>> = layout.cells().iter().map(draw).collect();
        layout.paint(&drawn, &colors, &|_| Vec::new())
    }

    fn grey() -> Maps {
        Maps { width: 1, height: 1, color: vec![[90, 90, 90, 255]], normal: vec![[128, 128, 255]], orm: vec![[255; 3]] }
    }

    #[test]
    fn trees_stand_on_the_ground_at_one_scale() {
        let (short, tall) = (post(2.0), post(4.0));
        let sheet = contact_sheet(&[row(&tall), row(&short)]);
        assert_eq!(sheet.pixels.len(), (sheet.width * sheet.height * 3) as usize);
        // Pixels of the middle of the first column that are not sky, in the upper and in the lower row.
        let x = (sheet.width / 4) as usize;
        let half = sheet.height as usize / 2;
        let lit = |from: usize| {
            let rows = from + HEAD as usize..from + half - 2 * MARGIN as usize;
            rows.filter(|y| sheet.pixels[(y * sheet.width as usize + x) * 3..][..3] != sheet.pixels[..3]).count()
        };
        let (a, b) = (lit(0) as f32, lit(half) as f32);
        assert!((a / b - 2.0).abs() < 0.1, "{a} {b}");
    }

    #[test]
    fn trees_that_would_be_dots_are_enlarged_and_their_rows_say_so() {
        for (smaller, larger) in [(1.0, 1.0), (7.9, 1.0), (8.0, 4.0), (15.9, 4.0), (16.0, 8.0), (40.0, 16.0)] {
            assert_eq!(enlarged(smaller), larger, "{smaller}");
        }
        let (mut small, mut sapling) = (post(0.5), post(4.0));
        // As slender as the others.
        small.bark.positions.iter_mut().for_each(|p| p.x *= 0.05);
        sapling.bark.positions.iter_mut().for_each(|p| p.x *= 0.5);
        let tall = post(10.0);
        let rows = [row(&tall), row(&sapling), row(&small)];
        let layout = SheetLayout::new(&rows);
        let metres = |row: usize| layout.scale(row).per_metre / layout.scale(0).per_metre;
        assert_eq!([metres(1), metres(2)], [1.0, 8.0]);
        let names: Vec<&str> = layout.texts.iter().map(|texts| texts[0].3.as_str()).collect();
        assert_eq!(names, ["oak_001", "oak_001", "oak_001, 8 x larger"]);
        // Half a metre is drawn as high as four.
        let sheet = contact_sheet(&rows);
        let (wide, band) = (sheet.width as usize, sheet.height as usize / 3);
        let lit = |r: usize| {
            let lines = r * band + HEAD as usize..(r + 1) * band - 2 * MARGIN as usize;
            lines.filter(|y| sheet.pixels[(y * wide + wide / 4) * 3..][..3] != sheet.pixels[..3]).count() as f32
        };
        assert!(lit(1) > 20.0 && (lit(2) / lit(1) - 1.0).abs() < 0.1, "{} {}", lit(1), lit(2));
    }

    #[test]
    fn columns_are_as_wide_as_what_is_written_above_them() {
        let (tall, small) = (post(40.0), post(1.0));
        let mut rows = [row(&tall), row(&small)];
        rows.iter_mut().for_each(|row| row.columns[1].shown = "below 12.5 % of the screen".into());
        let narrow = SheetLayout::new(&rows).cell.0;
        rows[1].label = "birches_of_all_heights_and_ages_001".into();
        let layout = SheetLayout::new(&rows);
        assert!(layout.cell.0 > narrow, "{narrow}");
        for texts in &layout.texts {
            for (_, _, room, text) in texts {
                assert!(text.len() as u32 * LETTER * ADVANCE <= *room, "{text}");
            }
        }
    }

    #[test]
    fn where_a_level_is_shown_stands_above_its_name() {
        let tree = post(4.0);
        let (plain, mut told) = (row(&tree), row(&tree));
        told.columns[1].shown = "below 7.1 % of the screen".into();
        let (plain, told) = (contact_sheet(&[plain]), contact_sheet(&[told]));
        let row = |y: u32| y as usize * told.width as usize * 3..(y + 1) as usize * told.width as usize * 3;
        let changed: Vec<u32> = (0..told.height).filter(|&y| plain.pixels[row(y)] != told.pixels[row(y)]).collect();
        let line = MARGIN / 2..MARGIN / 2 + LETTER * HEIGHT;
        assert!(!changed.is_empty() && changed.iter().all(|y| line.contains(y)), "{changed:?}");
    }

    #[test]
    fn strange_sheets_are_drawn_within_bounds() {
        assert_eq!(contact_sheet(&[]).pixels.len(), 3);
        let (flat, far) = (post(1e-9), post(f32::NAN));
        let rows: Vec<SheetRow<'_>> = (0..400).map(|i| row(if i % 2 == 0 { &flat } else { &far })).collect();
        let sheet = contact_sheet(&rows);
        assert!(sheet.width <= LARGEST && sheet.height <= LARGEST);
    }
}
