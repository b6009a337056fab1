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
//! Frames of an impostor are mixed with others before alpha is cut, by what it is and not by its side. There solid squares are
//! counted, and those that change sides do so by a hair: designed as cards are, impostors of six sets agreed by 0.885 with
//! their trees for 0.909, and still by 0.896 with clear texels of a third at most.
//!
//! Limits: mips beyond the [`MIPS`]-th and those of filters other than the box are what they come to. In pictures so sparse
//! that hardly any square holds a solid texel the coarsest mips stay emptier. Tried before: a halo
//! of one strength and width around all leaves, which left mip 4 off by 35 to 63 %; choosing squares from coarse to fine,
//! which left mip 5 off by 15 %; moving all texels alike, which took a tenth of the area of magnified cards.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Maps, Rect};
use crate::base::math;

/// Alpha at which a leaf's texel is solid: the cut-off of the `MASK` material, as a share of full alpha.
pub const ALPHA_CUTOFF: f32 = 0.5;

/// Mips that keep the coverage.
pub(super) const MIPS: usize = 8;
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
/// By how much of what it shows a mip is taken to be short or over at most, and what is asked for at most.
const LEAST_MORE: f32 = 0.4;
const MOST_ASKED: f32 = 8.0;
/// How much the mips count, level 1 first, and how many squares of a picture they hold at least to be designed: fewer are moved by what
/// lies beside them.
const WEIGHTS: [f32; MIPS] = [2.0, 2.0, 1.5, 1.0, 1.0, 0.5, 0.3, 0.1];
const FEW: f64 = 4.0;
/// Texels of a picture all of whose mips are.
const LARGE: f64 = 16384.0;
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
    let report = preserve_alpha(&mut alpha, (maps.width, maps.height), &[], &[]);
    maps.color.iter_mut().zip(alpha).for_each(|(color, alpha)| color[3] = alpha);
    report
}

/// How alpha of a picture is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blending {
    /// As it is.
    Alone,
    /// Mixed with that of others, as the frames of an impostor are.
    Mixed,
}

/// Changes alpha so that in each of the given pictures, or all over where none are given, the first eight box-filtered mips show as
/// much as level 0 does, as far as their texels are a picture's own. What is solid at level 0 stays so, and no more. `asked` is
/// what was found of the same pictures before; where it is not of as many, it is found.
pub fn preserve_alpha(
    alpha: &mut [u8],
    size: (u32, u32),
    pictures: &[(Rect, Blending)],
    asked: &[Asked],
) -> CoverageReport {
    let before = coverage_of(alpha, size, pictures, TOLD + 1);
    Design::of(asked.to_vec()).move_alpha(alpha, size, pictures);
    let after = coverage_of(alpha, size, pictures, TOLD + 1);
    CoverageReport { before, after }
}

/// What the mips of a picture are asked for, level 1 first, as shares of what it covers, so that they show as much: what one atlas found
/// holds in others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Asked([f32; MIPS]);

impl Default for Asked {
    fn default() -> Self {
        Self::SHEET
    }
}

impl Asked {
    /// Of a sheet of frames, in which squares are counted.
    pub(crate) const SHEET: Self = Self([1.0; MIPS]);
}

/// What mips are asked for, found by moving alpha: who moves pictures that are nearly those from before need not find it again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Design {
    asked: Vec<Asked>,
}

impl Design {
    /// Of pictures that were designed before.
    pub(crate) fn of(asked: Vec<Asked>) -> Self {
        Self { asked }
    }

    /// By picture; none before alpha was moved.
    pub(crate) fn asked(&self) -> &[Asked] {
        &self.asked
    }

    /// As [`preserve_alpha`]. Does nothing where `alpha` is not of the size.
    pub(crate) fn move_alpha(&mut self, alpha: &mut [u8], (width, height): (u32, u32), pictures: &[(Rect, Blending)]) {
        let (wide, high) = (width as usize, height as usize);
        if alpha.is_empty() || alpha.len() != wide * high {
            return;
        }
        let pictures = Picture::all(alpha, (width, height), pictures);
        let is_known = self.asked.len() == pictures.len();
        if !is_known {
            self.asked = pictures.iter().map(|p| Asked([p.asked_at_first(); MIPS])).collect();
        }
        let asks = !is_known && pictures.iter().any(|p| p.blending == Blending::Alone);
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
        let alone: Vec<usize> = (0..pictures.len()).filter(|&i| pictures[i].blending == Blending::Alone).collect();
        let shown = |alpha: &[u8], size: (usize, usize), k: usize| -> Vec<f32> {
            let of = |&i: &usize| pictures[i].shown((|at| f32::from(alpha[at]), size), k);
            alone.par_iter().map(of).collect()
        };
        // Thin leaves show a little less between texels than they have: far away they are to show what they have.
        let goals = shown(&alpha, (wide, high), 0);
        let goals: Vec<f32> = goals.into_iter().zip(&alone).map(|(shown, &i)| shown.max(pictures[i].solid)).collect();
        for k in 1..=MIPS {
            if !wide.is_multiple_of(2) || !high.is_multiple_of(2) {
                break;
            }
            alpha = halved(&alpha, wide, high);
            (wide, high) = (wide / 2, high / 2);
            for ((&i, goal), shown) in alone.iter().zip(&goals).zip(shown(&alpha, (wide, high), k)) {
                let more = (goal / shown.max(1e-6)).clamp(LEAST_MORE, LEAST_MORE.recip());
                if !pictures[i].has(k) {
                    continue;
                }
                off[i] += math::ln(more).abs() * WEIGHTS[k - 1];
                let asked = &mut self.asked[i].0[k - 1];
                *asked = (*asked * math::pow(more, eager)).clamp(MOST_ASKED.recip(), MOST_ASKED);
            }
        }
        off
    }
}

/// A picture of an atlas.
struct Picture {
    x: [usize; 2],
    y: [usize; 2],
    blending: Blending,
    /// Share of its texels that is solid.
    solid: f32,
}

impl Picture {
    /// Those of an atlas; none given are one.
    fn all(alpha: &[u8], (width, height): (u32, u32), rects: &[(Rect, Blending)]) -> Vec<Self> {
        let whole = [(Rect { x: 0, y: 0, width, height }, Blending::Alone)];
        let rects = if rects.is_empty() { &whole } else { rects };
        rects
            .iter()
            .map(|(rect, blending)| Self::of(rect, *blending, alpha, (width as usize, height as usize)))
            .collect()
    }

    fn of(rect: &Rect, blending: Blending, alpha: &[u8], (wide, high): (usize, usize)) -> Self {
        let ends =
            |first: u32, many: u32, all: usize| [first, first.saturating_add(many)].map(|v| (v as usize).min(all));
        let (x, y) = (ends(rect.x, rect.width, wide), ends(rect.y, rect.height, high));
        let row = |y: usize| alpha[y * wide + x[0]..y * wide + x[1]].iter().filter(|&&a| f32::from(a) >= SOLID).count();
        let solid = (y[0]..y[1]).map(row).sum::<usize>() as f32;
        Self { x, y, blending, solid: solid / ((x[1] - x[0]) * (y[1] - y[0])).max(1) as f32 }
    }

    fn is_sparse(&self) -> bool {
        self.blending == Blending::Alone && self.solid < SPARSE
    }

    fn asked_at_first(&self) -> f32 {
        match self.blending {
            Blending::Alone => ASKED[usize::from(!self.is_sparse())],
            Blending::Mixed => 1.0,
        }
    }

    /// Whether its `k`-th mip is designed: of a leaf's picture all, since full crowns are seen as far as to the last, of a card those of
    /// more than a few squares.
    fn has(&self, k: usize) -> bool {
        self.area() >= LARGE.min(FEW * (1_u64 << (2 * k)) as f64)
    }

    fn area(&self) -> f64 {
        ((self.x[1] - self.x[0]) * (self.y[1] - self.y[0])) as f64
    }

    /// Columns and rows of the squares of the `k`-th mip that it touches.
    fn squares(&self, k: usize, (wide, high): (usize, usize)) -> [Range<usize>; 2] {
        let of = |[first, end]: [usize; 2], all: usize| (first >> k).min(all)..end.div_ceil(1 << k).min(all);
        [of(self.x, wide), of(self.y, high)]
    }

    /// Looks at alpha between the squares of the `k`-th mip, at the places of a grid of half a square that lie in the picture, or
    /// in the middle of it where none do; in so many rows as tell it.
    fn look(&self, (at, size): (impl Fn(usize) -> f32, (usize, usize)), k: usize, mut see: impl FnMut(f32)) {
        let half = 0.5 * (1_usize << k) as f32;
        let places = |[first, end]: [usize; 2]| {
            let (first, end) = (first as f32 / half, end as f32 / half);
            let places = (first - 0.5).ceil() as usize..(end - 0.5).ceil() as usize;
            let middle = (0.5 * (first + end)) as usize;
            if places.is_empty() { middle..middle + 1 } else { places }
        };
        // A square and the neighbour that a place of it is nearer to.
        let pair = |place: usize, all: usize| {
            let own = (place / 2).min(all - 1);
            (own, if place.is_multiple_of(2) { own.saturating_sub(1) } else { (own + 1).min(all - 1) })
        };
        let (columns, rows) = (places(self.x), places(self.y));
        // Odd, or what repeats would be met at the same rows.
        let step = (columns.len() * rows.len() / LOOKED_AT) | 1;
        for row in rows.step_by(step) {
            let (own, other) = pair(row, size.1);
            let (own, other) = (own * size.0, other * size.0);
            for column in columns.clone() {
                let (x, beside) = pair(column, size.0);
                let near = 0.5625 * at(own + x) + 0.1875 * (at(own + beside) + at(other + x));
                see(near + 0.0625 * at(other + beside));
            }
        }
    }

    /// The share that shows.
    fn shown(&self, of: (impl Fn(usize) -> f32, (usize, usize)), k: usize) -> f32 {
        let (mut solid, mut all) = (0_u32, 0_u32);
        self.look(of, k, |alpha| {
            solid += u32::from(alpha >= CUT);
            all += 1;
        });
        solid as f32 / all.max(1) as f32
    }

    /// The share that counts: of a picture that is seen alone what shows, of a sheet of frames squares that are solid.
    fn counted(&self, alpha: &[u8], size: (usize, usize), k: usize) -> f32 {
        if self.blending == Blending::Alone {
            return self.shown((|i| f32::from(alpha[i]), size), k);
        }
        let [columns, rows] = self.squares(k, size);
        let count = (columns.len() * rows.len()).max(1);
        let row = |y: usize| alpha[y * size.0..][columns.clone()].iter().filter(|&&a| f32::from(a) >= SOLID).count();
        rows.map(row).sum::<usize>() as f32 / count as f32
    }

    /// By how much the squares of the `k`-th mip are to be moved for a share of the picture to show.
    fn shift(&self, (at, size): (impl Fn(usize) -> f32, (usize, usize)), k: usize, share: f32) -> f32 {
        const BINS: usize = 1 << 10;
        if share <= 0.0 {
            return 0.0;
        }
        let mut bins = [0_u32; BINS];
        let mut all = 0_u32;
        self.look((at, size), k, |alpha| {
            bins[((alpha * 4.0) as usize).min(BINS - 1)] += 1;
            all += 1;
        });
        let wanted = all as f32 * share.min(0.98);
        let (mut above, mut bin) = (0_u32, BINS);
        while bin > 0 && (above as f32) < wanted {
            bin -= 1;
            above += bins[bin];
        }
        CUT - bin as f32 * 0.25
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

/// What becomes one texel of a mip: means of the alpha of its texels.
#[derive(Clone, Copy, Default)]
struct Square {
    /// Share that is solid at level 0.
    solid: f32,
    /// The least and the greatest that can be had.
    low: f32,
    high: f32,
    /// The same with texels only that are free to move.
    free_low: f32,
    free_high: f32,
    /// As it is, or as near to it as it may be.
    own: f32,
}

impl Square {
    fn texel(alpha: u8, free: bool, gap: f32) -> Self {
        let own = f32::from(alpha);
        let solid = own >= SOLID;
        let (low, high) = if solid { (own.min(CLEAR + gap), 255.0) } else { (0.0, own.max(SOLID - gap)) };
        let (free_low, free_high) = if free { (low, high) } else { (own, own) };
        Self { solid: f32::from(u8::from(solid)), low, high, free_low, free_high, own }
    }

    fn mean(of: [Self; 4]) -> Self {
        let mean = |get: fn(&Self) -> f32| (get(&of[0]) + get(&of[1]) + get(&of[2]) + get(&of[3])) * 0.25;
        Self {
            solid: mean(|s| s.solid),
            low: mean(|s| s.low),
            high: mean(|s| s.high),
            free_low: mean(|s| s.free_low),
            free_high: mean(|s| s.free_high),
            own: mean(|s| s.own),
        }
    }

    /// Keeps it on one side of the cut-off.
    fn keep(&mut self, solid: bool) {
        let (least, most) = if solid { (SOLID + MARGIN, 255.0) } else { (0.0, CLEAR - MARGIN) };
        let (low, high) = (self.low.max(least), self.high.min(most));
        // What can't be had stays what it is.
        if low <= high {
            (self.low, self.high) = (low, high);
        }
        self.own = self.own.clamp(self.low, self.high);
        self.free_low = self.free_low.clamp(self.low, self.own);
        self.free_high = self.free_high.clamp(self.own, self.high);
    }
}

/// One mip.
#[derive(Clone)]
struct Level {
    width: usize,
    height: usize,
    squares: Vec<Square>,
}

impl Level {
    fn of(width: usize, height: usize, fine: impl Fn(usize, usize) -> Square + Sync) -> Self {
        let square = |i: usize| Square::mean(children(i, width).map(|part| fine(i, part)));
        let squares = (0..width * height).into_par_iter().with_min_len(1 << 13).map(square).collect();
        Self { width, height, squares }
    }

    /// Moves the squares of the `k`-th mip that are near the cut-off so that each picture shows what it is asked for, and keeps all
    /// on the sides on which they are then. A square that several pictures share is the first one's, or a sheet's.
    fn choose(&mut self, k: usize, pictures: &[Picture], asked: impl Fn(usize) -> f32 + Sync) {
        let size = (self.width, self.height);
        let mut owners = vec![u32::MAX; self.squares.len()];
        // Sheets come first: what is asked of the cards beside them must not move their frames.
        let is_sheet = |picture: &&Picture| picture.blending == Blending::Mixed;
        let (sheets, others): (Vec<_>, Vec<_>) = (0..).zip(pictures).partition(|(_, picture)| is_sheet(picture));
        for (i, picture) in sheets.into_iter().chain(others) {
            let [columns, rows] = picture.squares(k, size);
            for y in rows {
                let row = owners[y * size.0..][columns.clone()].iter_mut();
                row.filter(|owner| **owner == u32::MAX).for_each(|owner| *owner = i);
            }
        }
        let squares = &self.squares;
        let of = |(i, p): (usize, &Picture)| match p.blending {
            Blending::Alone if p.has(k) => {
                Choice::By(p.shift((|i: usize| squares[i].own, size), k, p.solid * asked(i)))
            }
            Blending::Mixed if k <= SHEET_MIPS => {
                let [columns, rows] = p.squares(k, size);
                let all = rows.flat_map(|y| columns.clone().map(move |x| y * size.0 + x));
                Choice::Solid(fullest(squares, all.filter(|&at| owners[at] as usize == i).collect()))
            }
            Blending::Alone | Blending::Mixed => Choice::None,
        };
        let choices: Vec<Choice> = pictures.par_iter().enumerate().map(of).collect();
        let each = self.squares.par_iter_mut().zip(&owners).enumerate().with_min_len(1 << 13);
        each.for_each(|(at, (square, &owner))| {
            let is_solid = match choices.get(owner as usize) {
                Some(Choice::By(by)) => {
                    let far = (((square.own - CUT).abs() - by.abs()) / FAR).clamp(0.0, 1.0);
                    square.own = (square.own + by * (1.0 - far)).clamp(square.low, square.high);
                    square.own >= CUT
                }
                Some(Choice::Solid(solid)) => solid.binary_search(&(at as u32)).is_ok(),
                Some(Choice::None) | None => return,
            };
            square.keep(is_solid);
        });
    }
}

/// What becomes of a picture's squares.
enum Choice {
    /// They are moved by so much.
    By(f32),
    /// These are to be solid, in order, and no others.
    Solid(Vec<u32>),
    /// Nothing.
    None,
}

/// As many of some squares as they cover at level 0, in order: those that can't be clear, then the fullest of those that can be
/// solid.
fn fullest(squares: &[Square], mut all: Vec<usize>) -> Vec<u32> {
    let (mut wanted, mut forced, mut able) = (0.0, 0, 0);
    let rank = |square: &Square| match () {
        () if square.low > CLEAR - MARGIN => 9.0,
        () if square.high < SOLID + MARGIN => -1.0,
        () => square.solid + square.own * 1e-4,
    };
    for square in all.iter().map(|&at| &squares[at]) {
        wanted += square.solid;
        forced += usize::from(rank(square) > 8.0);
        able += usize::from(rank(square) >= 0.0);
    }
    let count = ((wanted + 0.5) as usize).clamp(forced, able.max(forced));
    if count < all.len() {
        let later = |a: &usize, b: &usize| rank(&squares[*b]).total_cmp(&rank(&squares[*a])).then(a.cmp(b));
        all.select_nth_unstable_by(count, later);
        all.truncate(count);
    }
    let mut solid: Vec<u32> = all.into_iter().map(|at| at as u32).collect();
    solid.sort_unstable();
    solid
}

/// Moves alpha so that the squares of every mip are what they are to be.
fn settle(alpha: &mut [u8], (free, gaps): (&[bool], &[f32]), levels: &[Level]) {
    let Some(last) = levels.last() else { return };
    // From the coarsest down: each square hands its mean on to its four parts.
    let mut goals: Vec<f32> = last.squares.iter().map(|s| s.own).collect();
    for k in (1..levels.len()).rev() {
        let (fine, width) = (&levels[k - 1], levels[k].width);
        let mut next = vec![0.0_f32; fine.squares.len()];
        for (i, goal) in goals.iter().enumerate() {
            let parts = children(i, width);
            for (part, goal) in parts.into_iter().zip(handed(*goal, parts.map(|p| fine.squares[p]))) {
                next[part] = goal;
            }
        }
        goals = next;
    }
    let width = levels[0].width;
    let of = (goals.par_chunks_exact(width), gaps.par_chunks_exact(width));
    let rows = alpha.par_chunks_exact_mut(4 * width).zip(free.par_chunks_exact(4 * width)).zip(of.0.zip(of.1));
    rows.for_each(|((alpha, free), (goals, gaps))| {
        for (x, (goal, &gap)) in goals.iter().zip(gaps).enumerate() {
            let parts = children(x, width);
            let sum: u32 = parts.iter().map(|&p| u32::from(alpha[p])).sum();
            if sum as f32 * 0.25 == *goal {
                continue;
            }
            let texels = parts.map(|p| Square::texel(alpha[p], free[p], gap));
            for ((part, goal), texel) in parts.into_iter().zip(handed(*goal, texels)).zip(texels) {
                alpha[part] = (goal + 0.5).clamp(texel.low, texel.high) as u8;
            }
        }
    });
}

/// The means of four parts that make `goal`: what is free is moved first, each by its room, then the rest.
fn handed(goal: f32, parts: [Square; 4]) -> [f32; 4] {
    let mut at = parts.map(|p| p.own);
    let mut short = goal * 4.0 - at.iter().sum::<f32>();
    // Most parts are left as they are: means of whole numbers are exact.
    if short == 0.0 {
        return at;
    }
    let up = short > 0.0;
    let ends: [fn(&Square) -> f32; 2] = if up { [|s| s.free_high, |s| s.high] } else { [|s| s.free_low, |s| s.low] };
    for end in ends {
        let room: [f32; 4] = std::array::from_fn(|i| end(&parts[i]) - at[i]);
        let all: f32 = room.iter().sum();
        if all == 0.0 || short == 0.0 || (all > 0.0) != up {
            continue;
        }
        let share = (short / all).clamp(0.0, 1.0);
        for (at, room) in at.iter_mut().zip(room) {
            *at += share * room;
        }
        short -= share * all;
    }
    at
}

/// The four squares of the next finer level within the `i`-th of one that is `width` wide.
fn children(i: usize, width: usize) -> [usize; 4] {
    let first = i / width * 4 * width + i % width * 2;
    [first, first + 1, first + 2 * width, first + 2 * width + 1]
}

fn coverage_of(alpha: &[u8], (width, height): (u32, u32), pictures: &[(Rect, Blending)], levels: usize) -> Vec<f32> {
    let mut shares = Vec::new();
    let (mut wide, mut high) = (width as usize, height as usize);
    if alpha.is_empty() || alpha.len() != wide * high {
        return shares;
    }
    let pictures = Picture::all(alpha, (width, height), pictures);
    let area: f64 = pictures.iter().map(Picture::area).sum();
    let mut alpha = alpha.to_vec();
    while shares.len() < levels {
        let of = |p: &Picture| p.area() * f64::from(p.counted(&alpha, (wide, high), shares.len()));
        let shown: Vec<f64> = pictures.par_iter().map(of).collect();
        shares.push((shown.iter().sum::<f64>() / area.max(1.0)) as f32);
        if wide == 1 && high == 1 {
            break;
        }
        alpha = halved(&alpha, wide, high);
        (wide, high) = ((wide / 2).max(1), (high / 2).max(1));
    }
    shares
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
