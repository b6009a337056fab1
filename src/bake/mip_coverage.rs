//! Alpha coverage: how much of a cut-out picture is left in its mips, and alpha that keeps it.
//!
//! Engines box-filter the mips of a PNG, and thin leaves then fall below the cut-off: the tree dissolves with distance
//! (three.js #20522, godot-proposals #9152). Castaño's remedy (2010, "Computing Alpha Mipmaps") scales the alpha of each
//! mip, but a PNG has none. What a PNG has is room: a clear texel may hold any alpha below the cut-off and a solid one any
//! above, and neither shows at level 0. So the mips are designed, from fine to coarse and picture by picture: the squares that
//! become one texel of a mip are moved up or down together until as many places between them are solid as at level 0, each
//! as far as its texels let it. Then alpha is moved as little as makes every mean what it is to be, from the coarsest mip down to
//! the texels. Texels that have none of the other side beside them are moved first: alpha between neighbours is what a
//! magnified leaf's edge hangs on.
//!
//! What counts is what shows, and engines filter between texels: where every fifth texel is solid by a hair and the others are
//! nearly clear, next to nothing is solid between them. Pictures were designed by counting solid texels first: sparse cards
//! of clouds then showed 0.74, 0.44 and 0.22 of themselves in their first three mips, and whole crowns went at a
//! pixel a sample. As finer mips change with what coarser ones ask of them, all is designed a few times, each time asking for as much
//! more or less as came out wrong.
//!
//! Coarse mips hold a few texels of a picture or one. There all that are of a kind share: as many texels are solid among them as
//! all cover. A card that is smaller than a pixel shows such a mip, and without them crowns of small leaves were gone before the
//! next level took over.
//!
//! Frames of an impostor are mixed with others before alpha is cut, by what it is and not by its side. There solid squares are
//! counted, and those that change sides do so by a hair: designed as cards are, impostors of six sets agreed by 0.885 with
//! their trees for 0.909, and still by 0.896 with clear texels of a third at most.
//!
//! Limits: mips beyond the ninth and those of filters other than the box are what they come to. In pictures so sparse
//! that hardly any square holds a solid texel the coarsest mips stay emptier. Tried before: a halo
//! of one strength and width around all leaves, which left mip 4 off by 35 to 63 %; choosing squares from coarse to fine,
//! which left mip 5 off by 15 %; moving all texels alike, which took a tenth of the area of magnified cards; finding what mips are asked
//! for without moving texels, by means alone, which takes two thirds of the time, and clouds agree a little worse (71 trees, mean IoU 0.9090,
//! and 0.9086).

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::seen::{Picture, Pool};
use self::squares::{Level, Square, settle};
use super::{Maps, Rect};
use crate::base::math;

mod seen;
mod squares;

/// Alpha at which a leaf's texel is solid: the cut-off of the `MASK` material, as a share of full alpha.
pub const ALPHA_CUTOFF: f32 = 0.5;

/// Mips that keep the coverage.
pub(super) const MIPS: usize = 9;
/// Of a sheet of frames so many do: coarser ones hold several frames a texel, and nobody looks at it from so far.
const SHEET_MIPS: usize = 5;
/// Mips that reports tell of.
const TOLD: usize = 5;
/// The first alpha that is solid, and the last that is clear.
const SOLID: f32 = 128.0;
const CLEAR: f32 = 127.0;
/// Between them.
const CUT: f32 = 127.5;
/// How far from the cut-off texels are kept that are moved: engines compress blocks of 4 × 4 texels, and those on the brink
/// change sides. With moves up to it 2 to 3 % more of four sets were solid as BC3, BC7 or ETC2. The second is for pictures so
/// sparse that their mips can't be solid elsewhere.
const GAPS: [f32; 2] = [8.0, 4.0];
/// Pictures less of which is solid are sparse.
const SPARSE: f32 = 0.15;
/// Room for the rounding of each mip.
const MARGIN: f32 = 1.5;
/// How far from the cut-off squares are left alone, beyond those that change sides.
const FAR: f32 = 15.0;
/// How each time that all is designed the next is asked for what is short: at first for more than that, as each mip answers to its
/// own with less.
const EAGER: [f32; 6] = [1.5, 1.5, 1.2, 1.0, 1.0, 1.0];
/// The largest share that is to show.
const MOST_SHOWN: f32 = 0.9;
/// By how much of what it shows a mip is taken to be short or over at most, and what is asked for at most.
const LEAST_MORE: f32 = 0.4;
const MOST_ASKED: f32 = 8.0;
/// How much the mips count, level 1 first.
const WEIGHTS: [f32; MIPS] = [2.0, 2.0, 1.5, 1.0, 1.0, 0.8, 0.8, 0.8, 0.2];
/// Squares of a picture, fewer of which are chosen among those of all that are of its kind.
const FEW: f64 = 4.0;
/// How much such a mip counts, of what it would.
const SHARED: f32 = 0.3;
/// How much more of leaves is to show than level 0 does in the mip that is a texel a leaf, and in coarser ones. That is seen mixed with the
/// next, of which hardly anything is solid: crowns are as full in between.
const FULLER: [f32; 2] = [1.8, 3.0];
/// Of what a mip shows, how much it is asked for at first, where pictures are sparse and where not: the settling of coarser
/// mips brings finer ones nearer to the cut-off.
const ASKED: [f32; 2] = [0.55, 0.95];
/// Texels of a picture that are looked at for what it shows, about.
const LOOKED_AT: usize = 1 << 14;

/// Share of what shows at each mip, level 0 first, at most `levels` of them: box-filtered, and filtered between texels, as engines
/// do. Empty for a picture without texels or whose arrays aren't of its size.
#[must_use]
pub fn coverage(maps: &Maps, levels: usize) -> Vec<f32> {
    let alpha: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
    coverage_of(&alpha, (maps.width, maps.height), &[], levels)
}

/// Coverage before and after a correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoverageReport {
    /// Share of the pictures that shows, of sheets of frames what is solid, level 0 to 5, as they were.
    pub before: Vec<f32>,
    /// The same as it is now.
    pub after: Vec<f32>,
}

/// As [`preserve_alpha`], of a material's maps that are one picture.
pub fn preserve_coverage(maps: &mut Maps) -> CoverageReport {
    let mut alpha: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
    let report = preserve_alpha(&mut alpha, (maps.width, maps.height), &[]);
    maps.color.iter_mut().zip(alpha).for_each(|(color, alpha)| color[3] = alpha);
    report
}

/// What a picture is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PictureKind {
    /// A leaf or spray, of which a crown wears thousands.
    Leaf,
    /// A card of a cloud, or a crossed quad.
    Card,
    /// The frames of an impostor, which are mixed before alpha is cut.
    Frames,
}

/// Changes alpha so that in each of the given pictures, or all over where none are given, the first nine box-filtered mips show as
/// much as level 0 does, as far as their texels are a picture's own. What is solid at level 0 stays so, and no more.
pub fn preserve_alpha(alpha: &mut [u8], size: (u32, u32), pictures: &[(Rect, PictureKind)]) -> CoverageReport {
    let before = coverage_in(alpha, size, pictures);
    Design::default().move_alpha(alpha, size, pictures);
    CoverageReport { before, after: coverage_in(alpha, size, pictures) }
}

/// Share of what shows of the pictures of an atlas at each of the mips that a file carries itself, level 0 first.
#[must_use]
pub fn coverage_of_mips(levels: &[Maps], pictures: &[(Rect, PictureKind)]) -> Vec<f32> {
    let Some(first) = levels.first() else { return Vec::new() };
    let alpha = |level: &Maps| -> Vec<u8> { level.color.iter().map(|c| c[3]).collect() };
    let pictures = Picture::all(&alpha(first), (first.width, first.height), pictures);
    let size = |level: &Maps| (level.width as usize, level.height as usize);
    let share = |(k, level): (usize, &Maps)| share(&pictures, (&alpha(level), size(level)), k);
    levels.iter().enumerate().map(share).collect()
}

/// Moves the alpha of mips that a file carries itself, level 0 first and left as it is, so that each shows of every picture what
/// level 0 does: nothing has to be made of the texels before it.
pub(super) fn keep_shown(levels: &mut [Vec<u8>], (width, height): (u32, u32), pictures: &[(Rect, PictureKind)]) {
    let Some((first, mips)) = levels.split_first_mut() else { return };
    let pictures = Picture::all(first, (width, height), pictures);
    let size = |k: usize| ((width as usize >> k).max(1), (height as usize >> k).max(1));
    let goals: Vec<f32> = pictures.par_iter().map(|picture| picture.counted(first, size(0), 0)).collect();
    mips.par_iter_mut().enumerate().for_each(|(i, alpha)| {
        let (k, size) = (i + 1, size(i + 1));
        if alpha.len() == size.0 * size.1 {
            squares::shift(alpha, size, k, &pictures, &goals);
        }
    });
}

/// Coverage of the pictures of an atlas, as [`CoverageReport`] tells it.
#[must_use]
pub fn coverage_in(alpha: &[u8], size: (u32, u32), pictures: &[(Rect, PictureKind)]) -> Vec<f32> {
    coverage_of(alpha, size, pictures, TOLD + 1)
}

/// What the mips of a picture are asked for, level 1 first, as shares of what it covers, so that they show as much.
#[derive(Clone, Copy, Debug)]
struct Asked([f32; MIPS]);

impl Asked {
    /// Of a sheet of frames, in which squares are counted.
    const SHEET: Self = Self([1.0; MIPS]);

    fn at_first(of: &Picture) -> Self {
        match of.kind {
            PictureKind::Frames => Self::SHEET,
            PictureKind::Leaf | PictureKind::Card => Self([ASKED[usize::from(!of.is_sparse())]; MIPS]),
        }
    }
}

/// What mips are asked for, found by moving alpha: who moves pictures that are nearly those from before need not find it again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Design {
    asked: Vec<Asked>,
}

impl Design {
    /// As [`preserve_alpha`]. Does nothing where `alpha` is not of the size.
    pub(crate) fn move_alpha(
        &mut self,
        alpha: &mut [u8],
        (width, height): (u32, u32),
        pictures: &[(Rect, PictureKind)],
    ) {
        let (wide, high) = (width as usize, height as usize);
        if alpha.is_empty() || alpha.len() != wide * high {
            return;
        }
        let pictures = Picture::all(alpha, (width, height), pictures);
        let is_known = self.asked.len() == pictures.len();
        if !is_known {
            self.asked = pictures.iter().map(Asked::at_first).collect();
        }
        let asks = !is_known && pictures.iter().any(|p| p.kind != PictureKind::Frames);
        if !wide.is_multiple_of(2) || !high.is_multiple_of(2) {
            return;
        }
        let (free, gaps) = (free(alpha, wide), gaps(&pictures, (wide, high)));
        let texel = |square: usize, i: usize| Square::texel(alpha[i], free[i], gaps[square]);
        let first = Level::of(wide / 2, high / 2, texel);
        let moved = |design: &Self| {
            let mut moved = alpha.to_vec();
            settle(&mut moved, (&free, &gaps), &design.designed(&first, &pictures));
            moved
        };
        // Mips pull at each other, and what is asked for may come out worse than before: of each picture the best is kept.
        let mut best = vec![(f32::INFINITY, Asked::SHEET); pictures.len()];
        for &eager in if asks { &EAGER[..] } else { &[] } {
            let asked = self.asked.clone();
            let off = self.ask(moved(self), (wide, high), &pictures, eager);
            for ((best, off), asked) in best.iter_mut().zip(off).zip(asked) {
                if off < best.0 {
                    *best = (off, asked);
                }
            }
        }
        if asks {
            self.asked = best.into_iter().map(|(_, asked)| asked).collect();
        }
        let moved = moved(self);
        alpha.copy_from_slice(&moved);
    }

    /// The mips, as they are to be, from the first as it is.
    fn designed(&self, first: &Level, pictures: &[Picture]) -> Vec<Level> {
        let mut levels: Vec<Level> = Vec::with_capacity(MIPS);
        let mut next = first.clone();
        loop {
            let k = levels.len() + 1;
            next.choose(k, pictures, |i| self.asked[i].0[k - 1]);
            let (w, h) = (next.width, next.height);
            levels.push(next);
            if k == MIPS || !w.is_multiple_of(2) || !h.is_multiple_of(2) {
                return levels;
            }
            let fine = &levels[k - 1];
            next = Level::of(w / 2, h / 2, |_, i| fine.squares[i]);
        }
    }

    /// Asks each mip of each picture that is seen alone for as much more as it shows less than level 0, and says how far each picture
    /// is off.
    fn ask(
        &mut self,
        mut alpha: Vec<u8>,
        (mut wide, mut high): (usize, usize),
        pictures: &[Picture],
        eager: f32,
    ) -> Vec<f32> {
        let mut off = vec![0.0; pictures.len()];
        // Of a card that shows too much at a mip the next is asked for that much less: what lifts that lifts what is clear at this one.
        let mut less = vec![1.0_f32; pictures.len()];
        // Thin leaves show a little less between texels than they have: far away they are to show what they have.
        let goal = |picture: &Picture| picture.counted(&alpha, (wide, high), 0).max(picture.solid);
        let goals: Vec<f32> = pictures.par_iter().map(goal).collect();
        for k in 1..=MIPS {
            if !wide.is_multiple_of(2) || !high.is_multiple_of(2) {
                break;
            }
            alpha = halved(&alpha, wide, high);
            (wide, high) = (wide / 2, high / 2);
            let mut pools = Pool::all(pictures, k);
            pools.retain(|pool| pool.kind != PictureKind::Frames && !pool.is_beyond(pictures, k));
            let more = |pool: &Pool| {
                let goal = (pool.mean(pictures, |i| goals[i]) * pool.fuller(pictures, k)).min(MOST_SHOWN);
                let shown = pool.shown(pictures, (|i: usize| f32::from(alpha[i]), (wide, high)), k);
                (goal / shown.max(1e-6)).clamp(LEAST_MORE, LEAST_MORE.recip())
            };
            let more: Vec<f32> = pools.par_iter().map(more).collect();
            for (more, i) in more.iter().zip(&pools).flat_map(|(more, pool)| pool.of.iter().map(move |&i| (more, i))) {
                let share = if pictures[i].is_many(k) { 1.0 } else { SHARED };
                off[i] += math::ln(*more).abs() * WEIGHTS[k - 1] * share;
                let asked = &mut self.asked[i].0[k - 1];
                *asked = (*asked * math::pow(*more, eager) * less[i]).clamp(MOST_ASKED.recip(), MOST_ASKED);
                less[i] = if pictures[i].kind == PictureKind::Card { more.min(1.0) } else { 1.0 };
            }
        }
        off
    }
}

/// How far from the cut-off texels of each square of the first mip are kept.
fn gaps(pictures: &[Picture], (wide, high): (usize, usize)) -> Vec<f32> {
    let size = (wide / 2, high / 2);
    let mut gaps = vec![GAPS[0]; size.0 * size.1];
    for picture in pictures.iter().filter(|picture| picture.is_sparse()) {
        let [columns, rows] = picture.squares(1, size);
        rows.for_each(|y| gaps[y * size.0..][columns.clone()].fill(GAPS[1]));
    }
    gaps
}

/// Texels around which all are on the same side of the cut-off.
fn free(alpha: &[u8], width: usize) -> Vec<bool> {
    let solid: Vec<u8> = alpha.iter().map(|&a| u8::from(f32::from(a) >= SOLID)).collect();
    let rows: Vec<&[u8]> = solid.chunks_exact(width).collect();
    let mut free = vec![false; alpha.len()];
    free.par_chunks_exact_mut(width).with_min_len(32).enumerate().for_each(|(y, free)| {
        let around = [rows[y.saturating_sub(1)], rows[y], rows[(y + 1).min(rows.len() - 1)]];
        let column = |x: usize| around[0][x] + around[1][x] + around[2][x];
        let (mut left, mut own) = (column(0), column(0));
        for (x, free) in free.iter_mut().enumerate() {
            let right = column((x + 1).min(width - 1));
            *free = matches!(left + own + right, 0 | 9);
            (left, own) = (own, right);
        }
    });
    free
}

fn coverage_of(alpha: &[u8], (width, height): (u32, u32), pictures: &[(Rect, PictureKind)], levels: usize) -> Vec<f32> {
    let mut shares = Vec::new();
    let (mut wide, mut high) = (width as usize, height as usize);
    if alpha.is_empty() || alpha.len() != wide * high {
        return shares;
    }
    let pictures = Picture::all(alpha, (width, height), pictures);
    let mut alpha = alpha.to_vec();
    while shares.len() < levels {
        shares.push(share(&pictures, (&alpha, (wide, high)), shares.len()));
        if wide == 1 && high == 1 {
            break;
        }
        alpha = halved(&alpha, wide, high);
        (wide, high) = ((wide / 2).max(1), (high / 2).max(1));
    }
    shares
}

/// Share of what counts of the `k`-th mip of some pictures, each by its area.
fn share(pictures: &[Picture], (alpha, size): (&[u8], (usize, usize)), k: usize) -> f32 {
    let area: f64 = pictures.iter().map(Picture::area).sum();
    let of = |p: &Picture| p.area() * f64::from(p.counted(alpha, size, k));
    let shown: Vec<f64> = pictures.par_iter().map(of).collect();
    (shown.iter().sum::<f64>() / area.max(1.0)) as f32
}

/// The next mip, rounded.
fn halved(alpha: &[u8], width: usize, height: usize) -> Vec<u8> {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let mut next = vec![0_u8; w * h];
    next.par_chunks_exact_mut(w).with_min_len(32).enumerate().for_each(|(y, line)| {
        let row = |y: usize| &alpha[y.min(height - 1) * width..][..width];
        let (upper, lower) = (row(2 * y), row(2 * y + 1));
        let mean =
            |a: u8, b: u8, c: u8, d: u8| ((u16::from(a) + u16::from(b) + u16::from(c) + u16::from(d) + 2) / 4) as u8;
        if width == 1 {
            line[0] = mean(upper[0], upper[0], lower[0], lower[0]);
            return;
        }
        for ((out, up), low) in line.iter_mut().zip(upper.as_chunks::<2>().0).zip(lower.as_chunks::<2>().0) {
            *out = mean(up[0], up[1], low[0], low[1]);
        }
    });
    next
}

#[cfg(test)]
mod tests;
