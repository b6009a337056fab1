//! The set's atlas: many pictures in one, with gutters that survive the mips.
//!
//! Each picture lies in a cell of its own, at least half a gutter from its edges. Cells begin and end at multiples of 16 texels,
//! large ones of 32 and 64, and squares of a power of two at multiples of themselves, four of them in a square again: so no
//! texel of the first four mips mixes two pictures, and none of a leaf's down to the one that is all of it ([`AtlasParams::inside`]). Those of a picture are then the same in every
//! atlas: alpha is made for them, and levels are settled by it before there is an atlas. The rest of the cell repeats the
//! picture's edge. Pictures that don't fit at full size are all scaled by one factor, the largest k/1024 that fits. The
//! height is halved while everything still fits, and the width where that leaves fewer texels; both sides stay powers of two.
//!
//! A [`Layout`] is made from sizes alone, and normals and material are drawn apart from colours: a new tint draws the
//! colours again and nothing else. Pictures are dilated already; between the cells colour goes on in squares of 16 texels.
//! Limits: sides up to 8192.

use std::borrow::Cow;
use std::cmp::Reverse;

use glam::Vec2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::resample::{resample_color, resample_relief};
use super::skyline::{self, Block};
use super::{Maps, dilate_color};
use crate::mesh::Mesh;
use crate::preset::plan::AtlasParams;

/// Cells begin and end at multiples of this many texels.
pub(crate) const ALIGN: u32 = 16;
/// The same of cells with sides of so many texels and more: they are seen in more mips.
const ALIGN_LARGE: u32 = 32;
const LARGE: u32 = 128;
const ALIGN_LARGER: u32 = 64;
const LARGER: u32 = 256;
/// Texels between pictures where nothing else is told.
pub(crate) const GUTTER: u32 = 8;
/// Pictures begin at multiples of this many texels where their cells have room.
const EVEN: u32 = 8;
/// Scales are whole multiples of one over this.
const SCALES: u32 = 1024;
/// Least width that an atlas is halved to, texels: as much as a texel of the coarsest mip holds that alpha is designed for.
const NARROWEST: u32 = 512;
/// Share of an atlas that echoes may take, in sixteenths.
const ECHOED: u64 = 3;

/// How often leaf pictures are drawn once more, so that they fill squares of four. Where a leaf is smaller than a texel, engines see
/// the mean of four pictures that lie in a square: two beside clear cells are clear there, and a tree at that distance would be.
/// None where they are of other sizes than each other, or would take more than three sixteenths of the atlas.
#[must_use]
pub fn echoes(leaves: &[(u32, u32)], params: &AtlasParams) -> usize {
    let Some(&first) = leaves.first() else { return 0 };
    let Block { width, height, of } = Cell::of(first, params.gutter).block;
    let count = leaves.len().next_multiple_of(4) - leaves.len();
    let are_squares = (width, height) == (of, of) && leaves.iter().all(|&size| size == first);
    let has_room = count as u64 * u64::from(of) * u64::from(of) * 16 <= ECHOED * u64::from(params.size).pow(2);
    if are_squares && has_room { count } else { 0 }
}

/// A picture's cell, texels.
struct Cell {
    block: Block,
    /// Where the picture begins in it.
    picture: (u32, u32),
}

impl Cell {
    fn of((width, height): (u32, u32), gutter: u32) -> Self {
        let margin = gutter.div_ceil(2);
        let own = |side: u32| side.saturating_add(2 * margin);
        let (wide, high) = (own(width), own(height));
        let of = match wide.min(high) {
            LARGE.. if wide == high && wide.is_power_of_two() => wide,
            LARGER.. => ALIGN_LARGER,
            LARGE.. => ALIGN_LARGE,
            _ => ALIGN,
        };
        let whole = |side: u32| side.checked_next_multiple_of(of).unwrap_or(u32::MAX);
        let block = Block { width: whole(wide), height: whole(high), of };
        // Frames begin at multiples in their sheet, and show in coarser mips where that does, too.
        let begin = margin.next_multiple_of(EVEN);
        let first = |side: u32, cell: u32| if cell - side >= begin + margin { begin } else { margin };
        Self { block, picture: (first(width, block.width), first(height, block.height)) }
    }
}

/// Where a picture of some columns and rows begins in its cell of an atlas with such gutters, texels.
pub(super) fn corner(size: (u32, u32), gutter: u32) -> (u32, u32) {
    Cell::of(size, gutter).picture
}

/// A picture's place in an atlas, texels, without its gutter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rect {
    /// Left edge.
    pub x: u32,
    /// Upper edge.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Where pictures lie in an atlas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layout {
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// One a picture, in the order given.
    pub rects: Vec<Rect>,
    /// What all pictures were scaled by, 0..=1.
    pub scale: f32,
    /// Share of the atlas that pictures take, without gutters, 0..=1.
    pub utilisation: f32,
    gutter: u32,
    /// Where which pictures are drawn once more ([`echoes`]).
    echoes: Vec<(u32, Rect)>,
}

/// Pictures packed into one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Atlas {
    /// The packed maps.
    pub maps: Maps,
    /// Where the pictures lie.
    pub layout: Layout,
}

/// A picture as an atlas takes it: rows from the top, colour with alpha.
#[derive(Clone, Copy, Debug)]
pub struct Picked<'a> {
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// sRGB; where only normals and material are drawn the alpha alone counts.
    pub color: &'a [[u8; 4]],
    /// As in [`Maps`].
    pub normal: &'a [[u8; 3]],
    /// As in [`Maps`].
    pub orm: &'a [[u8; 3]],
}

impl<'a> From<&'a Maps> for Picked<'a> {
    fn from(maps: &'a Maps) -> Self {
        let Maps { width, height, color, normal, orm } = maps;
        Self { width: *width, height: *height, color, normal, orm }
    }
}

/// Why pictures can't be packed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AtlasError {
    /// Nothing to pack.
    #[error("there is no picture for the atlas")]
    Empty,
    /// A picture's arrays aren't of its size, or it has no texel.
    #[error("picture {0} has no texel, or not as many as its size says")]
    Picture(usize),
    /// Size or gutter out of range.
    #[error(
        "an atlas of {size} texels with gutters of {gutter}: the size is a power of two up to 8192, the gutter at most a sixteenth of it"
    )]
    Params {
        /// As asked.
        size: u32,
        /// As asked.
        gutter: u32,
    },
    /// Not even a texel a picture fits.
    #[error("{pictures} pictures do not fit an atlas of {size} texels at any scale")]
    TooMany {
        /// How many.
        pictures: usize,
        /// Texels along an edge.
        size: u32,
    },
    /// A mesh names a picture that was not packed, or not one for each vertex.
    #[error("a mesh names a picture that the atlas doesn't hold, or not one for each vertex")]
    Tiles,
}

/// Packs pictures into one atlas.
///
/// # Errors
///
/// See [`AtlasError`].
pub fn pack(tiles: &[&Maps], params: &AtlasParams) -> Result<Atlas, AtlasError> {
    let sizes: Vec<(u32, u32)> = tiles.iter().map(|t| (t.width, t.height)).collect();
    let layout = Layout::new(&sizes, &[], params)?;
    let picked: Vec<Picked<'_>> = tiles.iter().map(|&maps| maps.into()).collect();
    let (relief, color) = rayon::join(|| layout.relief(&picked), || layout.color(&picked));
    let ((normal, orm), color) = (relief?, color?);
    let maps = Maps { width: layout.width, height: layout.height, color, normal, orm };
    Ok(Atlas { maps, layout })
}

impl Layout {
    /// Finds places for pictures of these sizes.
    ///
    /// `groups` are numbers of pictures that belong together, in order. As long as all fit at full size, one group is
    /// placed after the other, so that the places of the first do not hang on those that come later; else, and where that
    /// makes an atlas of half the texels, the largest come first, whosever they are. The first group is of leaf pictures, which
    /// are drawn once more to fill a square where there is room ([`echoes`]).
    ///
    /// # Errors
    ///
    /// See [`AtlasError`].
    pub fn new(sizes: &[(u32, u32)], groups: &[usize], params: &AtlasParams) -> Result<Self, AtlasError> {
        let plain = Self::placed(sizes, groups, params)?;
        let leaves = groups.first().map_or(0, |&count| count.min(sizes.len()));
        let count = echoes(&sizes[..leaves], params);
        if count == 0 || plain.scale < 1.0 {
            return Ok(plain);
        }
        let again = (0..count).map(|i| i % leaves);
        let (first, rest) = sizes.split_at(leaves);
        let all: Vec<(u32, u32)> =
            first.iter().copied().chain(again.clone().map(|i| first[i])).chain(rest.iter().copied()).collect();
        let groups: Vec<usize> = std::iter::once(leaves + count).chain(groups[1..].iter().copied()).collect();
        match Self::placed(&all, &groups, params) {
            // Leaves alone are beside nothing clear.
            Ok(echoed) if rest.is_empty() && echoed.texels() > plain.texels() => Ok(plain),
            Ok(mut echoed) if echoed.scale == 1.0 => {
                let drawn = echoed.rects.drain(leaves..leaves + count);
                echoed.echoes = again.map(|i| i as u32).zip(drawn).collect();
                Ok(Self { utilisation: plain.utilisation * (plain.texels() / echoed.texels()) as f32, ..echoed })
            }
            _ => Ok(plain),
        }
    }

    /// As [`new`](Self::new), each picture once.
    fn placed(sizes: &[(u32, u32)], groups: &[usize], params: &AtlasParams) -> Result<Self, AtlasError> {
        let AtlasParams { size, gutter } = *params;
        if !size.is_power_of_two() || !(16..=8192).contains(&size) || gutter > size / 16 {
            return Err(AtlasError::Params { size, gutter });
        }
        if sizes.is_empty() {
            return Err(AtlasError::Empty);
        }
        if let Some(i) = sizes.iter().position(|s| s.0 == 0 || s.1 == 0) {
            return Err(AtlasError::Picture(i));
        }
        let margin = gutter.div_ceil(2);
        let sizes_at = |k: u32| -> Vec<(u32, u32)> {
            let side = |n: u32| ((u64::from(n) * u64::from(k) + u64::from(SCALES / 2)) / u64::from(SCALES)).max(1);
            sizes.iter().map(|t| (side(t.0) as u32, side(t.1) as u32)).collect()
        };
        let fit = |k: u32, group: &dyn Fn(usize) -> usize, wide: u32| -> Option<Vec<(u32, u32)>> {
            let cells = sizes_at(k).into_iter().map(|size| Cell::of(size, gutter).block);
            let cells: Vec<Block> = cells.collect();
            let area: u64 = cells.iter().map(|b| u64::from(b.width) * u64::from(b.height)).fold(0, u64::saturating_add);
            if area > u64::from(wide) * u64::from(size) {
                return None;
            }
            let mut order: Vec<usize> = (0..cells.len()).collect();
            // Behind those of larger multiples hardly any leaves room to begin at its own.
            order.sort_by_key(|&i| {
                let Block { width, height, of } = cells[i];
                (group(i), Reverse(of), Reverse(height), Reverse(width), i)
            });
            let is_square = |i: &usize| (cells[*i].width, cells[*i].height) == (cells[*i].of, cells[*i].of);
            let squares = order.iter().take_while(|i| is_square(i)).count();
            skyline::place(&cells, &order, squares, (wide, size))
        };
        let ends: Vec<usize> = groups
            .iter()
            .scan(0, |sum, count| {
                *sum += count;
                Some(*sum)
            })
            .collect();
        let own = |i: usize| ends.partition_point(|&end| end <= i);
        let one = |_: usize| 0;
        let height = |corners: &[(u32, u32)], sizes: &[(u32, u32)]| {
            let end = |(&(_, y), &size): (&(u32, u32), &(u32, u32))| y + corner(size, gutter).1 + size.1 + margin;
            let bottom = corners.iter().zip(sizes).map(end).max().unwrap_or(1);
            bottom.next_power_of_two().min(size)
        };
        let all: u64 = sizes.iter().map(|s| u64::from(s.0) * u64::from(s.1)).sum();
        let texels = |wide: u32, corners: &[(u32, u32)]| u64::from(wide) * u64::from(height(corners, sizes));
        // Half the texels are worth more than places that stay.
        let whole = |wide: u32| {
            let grouped = fit(SCALES, &own, wide);
            let may_be_lower = grouped.as_ref().is_none_or(|grouped| all * 2 < texels(wide, grouped));
            let ordered = if may_be_lower { fit(SCALES, &one, wide) } else { None };
            match (grouped, ordered) {
                (Some(grouped), Some(ordered)) if texels(wide, &grouped) <= texels(wide, &ordered) => Some(grouped),
                (grouped, ordered) => ordered.or(grouped),
            }
        };
        // Bisection for the largest k that fits; the lower end always does.
        let (mut wide, mut best) = match whole(size) {
            Some(corners) => (size, (SCALES, corners)),
            None => (size, (1, fit(1, &one, size).ok_or(AtlasError::TooMany { pictures: sizes.len(), size })?)),
        };
        let mut narrower = size / 2;
        // Gutters are at most a sixteenth of it, and the coarsest mips that are designed need room.
        while best.0 == SCALES && narrower >= (16 * gutter).max(NARROWEST) && all * 2 < texels(wide, &best.1) {
            if let Some(corners) = whole(narrower).filter(|corners| texels(narrower, corners) < texels(wide, &best.1)) {
                (wide, best.1) = (narrower, corners);
            }
            narrower /= 2;
        }
        let mut above = SCALES;
        while above > best.0 + 1 {
            let k = best.0.midpoint(above);
            match fit(k, &one, size) {
                Some(corners) => best = (k, corners),
                None => above = k,
            }
        }
        let (k, corners) = best;
        let sizes = sizes_at(k);
        let height = height(&corners, &sizes);
        let rects: Vec<Rect> = (corners.iter().zip(sizes))
            .map(|(&(x, y), (width, height))| {
                let first = corner((width, height), gutter);
                Rect { x: x + first.0, y: y + first.1, width, height }
            })
            .collect();
        let used: u64 = rects.iter().map(|r| u64::from(r.width) * u64::from(r.height)).sum();
        let utilisation = (used as f64 / (f64::from(wide) * f64::from(height))) as f32;
        let scale = k as f32 / SCALES as f32;
        Ok(Self { width: wide, height, rects, scale, utilisation, gutter, echoes: Vec::new() })
    }

    /// Whether its cells lie in it and its echoes are of its pictures, as of one that was not found but read.
    pub(crate) fn is_sound(&self) -> bool {
        let is_inside = |rect: &Rect| {
            let first = corner((rect.width, rect.height), self.gutter);
            let ends = |at: u32, side: u32, all: u32| at.checked_add(side).is_some_and(|end| side > 0 && end <= all);
            let is_in = ends(rect.x, rect.width, self.width) && ends(rect.y, rect.height, self.height);
            is_in && rect.x >= first.0 && rect.y >= first.1
        };
        self.gutter <= self.width / 16
            && self.rects.iter().all(is_inside)
            && self.echoes.iter().all(|(i, rect)| (*i as usize) < self.rects.len() && is_inside(rect))
    }

    fn texels(&self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }

    /// Width and height, texels.
    #[must_use]
    pub const fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Moves a mesh's texture coordinates from its pictures (0..=1 in each, what lies outside is clamped) to the atlas
    /// and empties `mesh.tiles`.
    ///
    /// 0 and 1 are the outer edges of the picture's texels: what filtering reads beyond them is the gutter, which
    /// repeats them. Without a gutter they are the centres of the outer texels.
    ///
    /// # Errors
    ///
    /// When `tiles` isn't one for each vertex or names a picture that isn't there; the mesh is then as it was.
    pub fn place(&self, mesh: &mut Mesh) -> Result<(), AtlasError> {
        if mesh.tiles.len() != mesh.uvs.len() || mesh.tiles.iter().any(|&t| t as usize >= self.rects.len()) {
            return Err(AtlasError::Tiles);
        }
        let inset = if self.gutter == 0 { 0.5 } else { 0.0 };
        let size = Vec2::new(self.width as f32, self.height as f32);
        for (uv, &tile) in mesh.uvs.iter_mut().zip(&mesh.tiles) {
            let r = self.rects[tile as usize];
            let corner = Vec2::new(r.x as f32, r.y as f32) + inset;
            let extent = Vec2::new(r.width as f32, r.height as f32) - 2.0 * inset;
            *uv = (corner + uv.clamp(Vec2::ZERO, Vec2::ONE) * extent) / size;
        }
        mesh.tiles.clear();
        Ok(())
    }

    /// Normals and material of the atlas, from pictures in the order of the sizes.
    ///
    /// # Errors
    ///
    /// When there are more or fewer pictures than places, or one isn't whole.
    pub fn relief(&self, pictures: &[Picked<'_>]) -> Result<Relief, AtlasError> {
        self.check(pictures, |p| p.color.len() == p.normal.len() && p.color.len() == p.orm.len())?;
        let (normal, orm): (Vec<_>, Vec<_>) = self
            .with_places(pictures)
            .map(|(p, r)| {
                if (p.width, p.height) == (r.width, r.height) {
                    return (Cow::Borrowed(p.normal), Cow::Borrowed(p.orm));
                }
                let (normal, orm) = resample_relief(p, r.width, r.height);
                (Cow::Owned(normal), Cow::Owned(orm))
            })
            .unzip();
        Ok(rayon::join(|| self.draw(&normal, [128, 128, 255]), || self.draw(&orm, [255, 255, 0])))
    }

    /// Colour and alpha of the atlas, from pictures in the order of the sizes; normals and material are not looked at.
    ///
    /// # Errors
    ///
    /// As [`relief`](Self::relief).
    pub fn color(&self, pictures: &[Picked<'_>]) -> Result<Vec<[u8; 4]>, AtlasError> {
        self.check(pictures, |_| true)?;
        let scaled: Vec<Cow<'_, [[u8; 4]]>> = self
            .with_places(pictures)
            .map(|(p, r)| {
                if (p.width, p.height) == (r.width, r.height) {
                    return Cow::Borrowed(p.color);
                }
                Cow::Owned(resample_color(p, r.width, r.height))
            })
            .collect();
        let mut color = self.draw(&scaled, [0; 4]);
        self.fill_between(&mut color);
        Ok(color)
    }

    /// Alpha of the atlas alone, from the alphas of pictures in the order of the sizes, none of them scaled.
    ///
    /// # Errors
    ///
    /// As [`relief`](Self::relief); also where a picture is not of its place's size.
    pub fn alpha(&self, pictures: &[Vec<u8>]) -> Result<Vec<u8>, AtlasError> {
        if pictures.len() != self.rects.len() {
            return Err(AtlasError::Tiles);
        }
        let whole = |(p, r): (&Vec<u8>, &Rect)| p.len() == r.width as usize * r.height as usize && !p.is_empty();
        if let Some(i) = pictures.iter().zip(&self.rects).position(|pair| !whole(pair)) {
            return Err(AtlasError::Picture(i));
        }
        let rows: Vec<Cow<'_, [[u8; 1]]>> = pictures.iter().map(|p| Cow::Borrowed(p.as_chunks().0)).collect();
        Ok(self.draw(&rows, [0]).as_flattened().to_vec())
    }

    fn check(&self, pictures: &[Picked<'_>], even: impl Fn(&Picked<'_>) -> bool) -> Result<(), AtlasError> {
        if pictures.len() != self.rects.len() {
            return Err(AtlasError::Tiles);
        }
        let whole = |p: &Picked<'_>| {
            let texels = p.width as usize * p.height as usize;
            texels > 0 && p.color.len() == texels && even(p)
        };
        pictures.iter().position(|p| !whole(p)).map_or(Ok(()), |i| Err(AtlasError::Picture(i)))
    }

    fn with_places<'a>(
        &'a self,
        pictures: &'a [Picked<'a>],
    ) -> impl IndexedParallelIterator<Item = (&'a Picked<'a>, &'a Rect)> {
        pictures.par_iter().zip(&self.rects)
    }

    /// First column and row of a picture's cell, and those behind it.
    fn cell(&self, rect: &Rect) -> (u32, u32, u32, u32) {
        let Cell { block, picture } = Cell::of((rect.width, rect.height), self.gutter);
        let (x, y) = (rect.x - picture.0, rect.y - picture.1);
        // An atlas may end before a cell does, but not before its gutter.
        (x, y, (x + block.width).min(self.width), (y + block.height).min(self.height))
    }

    /// One map: pictures with their edges repeated over their cells, and `blank` between.
    fn draw<const N: usize>(&self, pictures: &[Cow<'_, [[u8; N]]>], blank: [u8; N]) -> Vec<[u8; N]> {
        let mut map = vec![blank; self.width as usize * self.height as usize];
        let echoes = self.echoes.iter().map(|(i, rect)| (&pictures[*i as usize], rect));
        for (picture, rect) in pictures.iter().zip(&self.rects).chain(echoes) {
            let (x0, y0, x1, y1) = self.cell(rect);
            let (left, right) = ((rect.x - x0) as usize, (x1 - rect.x - rect.width) as usize);
            let wide = rect.width as usize;
            for y in y0..y1 {
                let row = (y.clamp(rect.y, rect.y + rect.height - 1) - rect.y) as usize;
                let line = &picture[row * wide..(row + 1) * wide];
                let to = &mut map[y as usize * self.width as usize + x0 as usize..][..left + wide + right];
                to[..left].fill(line[0]);
                to[left..left + wide].copy_from_slice(line);
                to[left + wide..].fill(line[wide - 1]);
            }
        }
        map
    }

    /// Squares that no cell holds take the colour of those around them.
    fn fill_between(&self, color: &mut [[u8; 4]]) {
        let side = ALIGN.min(self.height);
        let (columns, rows) = (self.width / side, self.height / side);
        if columns == 0 || rows == 0 {
            return;
        }
        let mut squares = vec![[0_u8; 4]; (columns * rows) as usize];
        for rect in self.rects.iter().chain(self.echoes.iter().map(|(_, rect)| rect)) {
            let (x0, y0, x1, y1) = self.cell(rect);
            for (y, x) in (y0 / side..y1 / side).flat_map(|y| (x0 / side..x1 / side).map(move |x| (y, x))) {
                let middle = (y * side + side / 2) * self.width + x * side + side / 2;
                let [r, g, b, _] = color[middle as usize];
                squares[(y * columns + x) as usize] = [r, g, b, 255];
            }
        }
        dilate_color(&mut squares, columns, rows);
        for (i, square) in squares.iter().enumerate().filter(|(_, s)| s[3] == 0) {
            let (x, y) = (i as u32 % columns * side, i as u32 / columns * side);
            for row in y..y + side {
                color[(row * self.width + x) as usize..][..side as usize].fill([square[0], square[1], square[2], 0]);
            }
        }
    }
}

/// Normals, and occlusion, roughness and metalness.
pub type Relief = (Vec<[u8; 3]>, Vec<[u8; 3]>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn plain(width: u32, height: u32, value: u8) -> Maps {
        let n = (width * height) as usize;
        Maps {
            width,
            height,
            color: vec![[value, value, value, 255]; n],
            normal: vec![[128, 128, 255]; n],
            orm: vec![[255, value, 0]; n],
        }
    }

    #[test]
    fn two_tiles_land_where_they_must_and_their_gutters_repeat_them() {
        let (a, b) = (plain(12, 12, 10), plain(4, 4, 200));
        let atlas = pack(&[&b, &a], &AtlasParams { size: 64, gutter: 4 }).unwrap();
        assert_eq!(
            atlas.layout.rects,
            [Rect { x: 8, y: 8, width: 4, height: 4 }, Rect { x: 18, y: 2, width: 12, height: 12 }]
        );
        assert_eq!((atlas.maps.width, atlas.maps.height, atlas.layout.scale), (64, 16, 1.0));
        let at = |x: usize, y: usize| atlas.maps.color[y * 64 + x];
        assert_eq!([at(16, 0), at(31, 15), at(0, 0), at(15, 13)].map(|c| c[0]), [10, 10, 200, 200]);
        assert_eq!([at(32, 6), at(63, 15)].map(|c| c[3]), [0; 2]);
        // What no picture holds goes on in their colours.
        assert!([at(32, 6), at(60, 12)].iter().all(|c| (10..=200).contains(&c[0])));
        let mut mesh = Mesh { uvs: vec![Vec2::ZERO, Vec2::ONE], tiles: vec![0, 1], ..Mesh::default() };
        atlas.layout.place(&mut mesh).unwrap();
        assert_eq!(mesh.uvs, [Vec2::new(8.0 / 64.0, 8.0 / 16.0), Vec2::new(30.0 / 64.0, 14.0 / 16.0)]);
        assert!(mesh.tiles.is_empty());
        let mut wrong = Mesh { uvs: vec![Vec2::ZERO], tiles: vec![2], ..Mesh::default() };
        assert_eq!(atlas.layout.place(&mut wrong), Err(AtlasError::Tiles));
    }

    #[test]
    fn cells_never_overlap_and_stay_inside() {
        for round in 0..12 {
            let seed = Seed::new(round);
            let side = |i: u64| 1 + seed.at(i).index(90) as u32;
            let tiles: Vec<Maps> = (0..60).map(|i| plain(side(2 * i), side(2 * i + 1), 7)).collect();
            let gutter = seed.child("gutter").index(9) as u32;
            let atlas = pack(&tiles.iter().collect::<Vec<_>>(), &AtlasParams { size: 256, gutter }).unwrap();
            let (margin, width) = (gutter.div_ceil(2), atlas.maps.width);
            let mut taken = vec![false; (width * atlas.maps.height) as usize];
            for r in &atlas.layout.rects {
                let first = corner((r.width, r.height), gutter);
                assert_eq!(((r.x - first.0) % ALIGN, (r.y - first.1) % ALIGN), (0, 0));
                for y in r.y - margin..r.y + r.height + margin {
                    for x in r.x - margin..r.x + r.width + margin {
                        assert!(!std::mem::replace(&mut taken[(y * width + x) as usize], true));
                    }
                }
            }
        }
    }

    #[test]
    fn later_groups_do_not_move_earlier_ones() {
        let sizes: Vec<(u32, u32)> = (0..60).map(|i| (10 + i * 7 % 31, 12 + i * 11 % 29)).collect();
        let params = AtlasParams { size: 512, gutter: 4 };
        let some = Layout::new(&sizes[..40], &[10, 15, 15], &params).unwrap();
        let all = Layout::new(&sizes, &[10, 15, 15, 20], &params).unwrap();
        assert_eq!((some.scale, all.scale), (1.0, 1.0));
        assert_eq!(some.rects, all.rects[..40]);
        // Too many for one after the other at full size: still all of them fit.
        let many: Vec<(u32, u32)> = sizes.iter().cycle().take(900).copied().collect();
        assert!(Layout::new(&many, &[300; 3], &params).unwrap().scale < 1.0);
    }

    #[test]
    fn leaf_pictures_fill_squares_of_four_where_there_is_room_and_move_nothing_else() {
        let params = AtlasParams { size: 1024, gutter: 8 };
        for leaves in 1..=9 {
            let sizes: Vec<(u32, u32)> =
                [(120, 120)].repeat(leaves).into_iter().chain([(300, 300), (40, 90)]).collect();
            let layout = Layout::new(&sizes, &[leaves, 2], &params).unwrap();
            assert_eq!((layout.rects.len(), (layout.echoes.len() + leaves) % 4), (leaves + 2, 0), "{leaves}");
            // Four in a row are the quarters of a square.
            let own: Vec<&Rect> =
                layout.rects[..leaves].iter().chain(layout.echoes.iter().map(|(_, rect)| rect)).collect();
            for four in own.chunks(4) {
                let squares: Vec<(u32, u32)> = four.iter().map(|rect| (rect.x / 256, rect.y / 256)).collect();
                assert!(squares.iter().all(|square| *square == squares[0]), "{leaves}: {squares:?}");
            }
            // They hold what those hold that they repeat.
            let maps: Vec<Maps> = (10..).zip(&sizes).map(|(value, &(w, h))| plain(w, h, value)).collect();
            let picked: Vec<Picked<'_>> = maps.iter().map(Picked::from).collect();
            let color = layout.color(&picked).unwrap();
            for (i, rect) in &layout.echoes {
                assert_eq!(color[(rect.y * layout.width + rect.x) as usize][0], 10 + *i as u8, "{leaves}");
            }
        }
        // One picture beside cards fills a square, though the atlas is higher by it.
        let params = AtlasParams { size: 2048, gutter: 8 };
        let layout = Layout::new(&[(504, 504), (400, 400), (400, 400)], &[1, 2], &params).unwrap();
        assert!(layout.echoes.len() == 3 && layout.scale == 1.0 && layout.height == 1024, "{}", layout.height);
        let params = AtlasParams { size: 1024, gutter: 8 };
        // No room, other sizes, no leaves.
        let narrow = AtlasParams { size: 256, gutter: 8 };
        assert!(Layout::new(&[(120, 120); 2], &[2], &narrow).unwrap().echoes.is_empty());
        assert!(Layout::new(&[(120, 120), (56, 56)], &[2], &params).unwrap().echoes.is_empty());
        assert!(Layout::new(&[(120, 120); 2], &[], &params).unwrap().echoes.is_empty());
        // None where what comes later has no room then.
        let full: Vec<(u32, u32)> = [[(248, 248)].as_slice(), &[(504, 504); 3], &[(248, 248); 3]].concat();
        let layout = Layout::new(&full, &[1, 6], &params).unwrap();
        assert!(layout.echoes.is_empty() && layout.scale == 1.0);
    }

    #[test]
    fn few_pictures_take_no_wide_atlas_and_one_leaf_no_more_than_its_own_cell() {
        let params = AtlasParams { size: 4096, gutter: 8 };
        let size = |sizes: &[(u32, u32)], groups: &[usize]| Layout::new(sizes, groups, &params).unwrap().size();
        assert_eq!(size(&[(504, 504)], &[1]), (512, 512));
        assert_eq!(size(&[(504, 504); 3], &[3]), (1024, 1024));
        let layout = Layout::new(&[(240, 480); 6], &[0, 6], &params).unwrap();
        assert!(layout.width * layout.height <= 1024 * 1024 && layout.utilisation > 0.6, "{layout:?}");
        // Gutters may be a sixteenth of the atlas.
        let wide = AtlasParams { size: 1024, gutter: 64 };
        let layout = Layout::new(&[(40, 40)], &[1], &wide).unwrap();
        assert!(layout.width >= 1024 && layout.is_sound(), "{layout:?}");
    }

    #[test]
    fn groups_never_make_an_atlas_higher_than_it_must_be() {
        let mut freed = 0;
        for i in 0..40 {
            let seed = Seed::new(8).at(i);
            let edge = |k: u64| 20 + seed.at(k).index(40) as u32;
            // Trees of a sheet and some cards each.
            let tree = |k: u64| std::iter::once((180, 180)).chain((0..9).map(move |c| (edge(k * 20 + c), edge(k + c))));
            let count = 2 + i % 5;
            let sizes: Vec<(u32, u32)> = (0..count).flat_map(tree).collect();
            let params = AtlasParams { size: 512, gutter: 2 };
            let grouped = Layout::new(&sizes, &vec![10; count as usize], &params).unwrap();
            let free = Layout::new(&sizes, &[], &params).unwrap();
            if grouped.scale == 1.0 {
                assert!(grouped.texels() <= free.texels(), "{i}");
            }
            freed += u32::from(grouped == free);
        }
        assert!((1..40).contains(&freed), "{freed}");
    }

    #[test]
    fn shrinking_ignores_colour_under_alpha() {
        let mut tile = plain(2, 1, 0);
        tile.color = vec![[200, 0, 0, 255], [0, 255, 0, 0]];
        let small = resample_color(&(&tile).into(), 1, 1);
        assert_eq!(small[0][3], 128);
        assert!(small[0][0] >= 199 && small[0][1] < 20, "{:?}", small[0]);
    }

    #[test]
    fn a_full_set_fits_at_one_scale() {
        let leaves: Vec<Maps> = (0..12).map(|_| plain(256, 256, 90)).collect();
        let seed = Seed::new(3);
        let cards: Vec<Maps> = (0..600)
            .map(|i| plain(72 + seed.at(i).index(49) as u32, 72 + seed.at(i + 600).index(49) as u32, 120))
            .collect();
        let tiles: Vec<&Maps> = leaves.iter().chain(&cards).collect();
        let atlas = pack(&tiles, &AtlasParams { size: 2048, gutter: 8 }).unwrap();
        assert!(
            atlas.layout.scale > 0.6 && atlas.layout.scale < 1.0 && atlas.layout.utilisation > 0.6,
            "{} {}",
            atlas.layout.scale,
            atlas.layout.utilisation
        );
    }

    #[test]
    fn nonsense_is_refused() {
        let good = plain(4, 4, 1);
        let broken = Maps { orm: Vec::new(), ..good.clone() };
        let params = AtlasParams { size: 256, gutter: 4 };
        assert_eq!(pack(&[], &params), Err(AtlasError::Empty));
        assert_eq!(pack(&[&good, &broken], &params), Err(AtlasError::Picture(1)));
        assert!(matches!(pack(&[&good; 5000], &params), Err(AtlasError::TooMany { .. })));
        assert!(matches!(pack(&[&good], &AtlasParams { size: 300, gutter: 4 }), Err(AtlasError::Params { .. })));
    }
}
