//! Alpha coverage: how much of a cut-out picture is left in its mips, and alpha that keeps it.
//!
//! Engines box-filter the mips of a PNG, and thin leaves then fall below the cut-off: the tree dissolves with distance
//! (three.js #20522, godot-proposals #9152). Castaño's remedy (2010, "Computing Alpha Mipmaps") scales the alpha of each
//! mip, but a PNG has none. What a PNG has is room: a clear texel may hold any alpha below the cut-off and a solid one any
//! above, and neither shows at level 0. So the mips are designed, from fine to coarse: of the squares that become one texel
//! of a mip as many are chosen to be solid as level 0 covers, the fullest first, picture by picture, of those whose texels
//! can be brought there. Then alpha is moved as little as makes every mean fall on its side, from the coarsest mip down to
//! the texels. Texels that have none of the other side beside them are moved first: alpha between neighbours is what a
//! magnified leaf's edge hangs on.
//!
//! Limits: mips beyond the [`MIPS`]-th and those of filters other than the box are what they come to. Tried before: a halo
//! of one strength and width around all leaves, which left mip 4 off by 35 to 63 %; choosing squares from coarse to fine,
//! which left mip 5 off by 15 %; moving all texels alike, which took a tenth of the area of magnified cards.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Maps, Rect};

/// Alpha at which a leaf's texel is solid: the cut-off of the `MASK` material, as a share of full alpha.
pub const ALPHA_CUTOFF: f32 = 0.5;

/// Mips that keep the coverage.
const MIPS: usize = 5;
/// The first alpha that is solid, and the last that is clear.
const SOLID: f32 = 128.0;
const CLEAR: f32 = 127.0;
/// How far from the cut-off texels are kept that are moved: engines compress blocks of 4 × 4 texels, and those on the brink
/// change sides. With moves up to it 2 to 3 % more of four sets were solid as BC3, BC7 or ETC2. The last are for pictures so
/// sparse that their mips can't be solid anywhere else.
const GAPS: [f32; 3] = [8.0, 4.0, 1.0];
/// How much of what a mip is to cover it may lack for want of texels that can be moved, before a smaller gap is taken.
const LACKING: f32 = 0.015;
/// Room for the rounding of each mip.
const MARGIN: f32 = 1.5;

/// Share of solid texels at each mip, level 0 first, at most `levels` of them; box-filtered as engines do. Empty
/// for a picture without texels or whose arrays aren't of its size.
#[must_use]
pub fn coverage(maps: &Maps, levels: usize) -> Vec<f32> {
    let alpha: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
    coverage_of(alpha, maps.width as usize, maps.height as usize, levels)
}

/// Coverage before and after a correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoverageReport {
    /// Share of solid texels, level 0 to 5, as the picture was.
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

/// Changes alpha so that the first five box-filtered mips cover what level 0 does, all in all and, as far as their texels
/// are a picture's own, in each of the given pictures. What is solid at level 0 stays so, and no more.
pub fn preserve_alpha(alpha: &mut [u8], (width, height): (u32, u32), pictures: &[Rect]) -> CoverageReport {
    let (wide, high) = (width as usize, height as usize);
    let before = coverage_of(alpha.to_vec(), wide, high, MIPS + 1);
    if before.is_empty() {
        return CoverageReport { after: before.clone(), before };
    }
    move_alpha(alpha, (width, height), pictures);
    let after = coverage_of(alpha.to_vec(), wide, high, MIPS + 1);
    CoverageReport { before, after }
}

/// As [`preserve_alpha`], which also tells what it did. Does nothing where `alpha` is not of the size.
pub(crate) fn move_alpha(alpha: &mut [u8], (width, height): (u32, u32), pictures: &[Rect]) {
    let (wide, high) = (width as usize, height as usize);
    if alpha.is_empty() || alpha.len() != wide * high {
        return;
    }
    let free = free(alpha, wide);
    for gap in GAPS {
        let is_last = gap == GAPS[GAPS.len() - 1];
        if let Some(levels) = designed(alpha, &free, (wide, high), pictures, gap, is_last) {
            settle(alpha, &free, &levels, gap);
            return;
        }
    }
}

/// The mips, as they are to be; none where one lacks what it is to cover, unless that is to be taken.
fn designed(
    alpha: &[u8],
    free: &[bool],
    (wide, high): (usize, usize),
    pictures: &[Rect],
    gap: f32,
    is_last: bool,
) -> Option<Vec<Level>> {
    let mut levels: Vec<Level> = Vec::new();
    while levels.len() < MIPS {
        let (w, h) = levels.last().map_or((wide, high), |fine| (fine.width, fine.height));
        if !w.is_multiple_of(2) || !h.is_multiple_of(2) {
            break;
        }
        let mut next = match levels.last() {
            Some(fine) => Level::of(w / 2, h / 2, |i| fine.squares[i]),
            None => Level::of(w / 2, h / 2, |i| Square::texel(alpha[i], free[i], gap)),
        };
        let lacking = next.choose(levels.len() + 1, pictures);
        if lacking > LACKING && !is_last {
            return None;
        }
        levels.push(next);
    }
    Some(levels)
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
        Self { solid: if solid { 1.0 } else { 0.0 }, low, high, free_low, free_high, own }
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
struct Level {
    width: usize,
    height: usize,
    squares: Vec<Square>,
}

impl Level {
    fn of(width: usize, height: usize, fine: impl Fn(usize) -> Square + Sync) -> Self {
        let square = |i: usize| Square::mean(children(i, width).map(&fine));
        let squares = (0..width * height).into_par_iter().with_min_len(1 << 13).map(square).collect();
        Self { width, height, squares }
    }

    /// Chooses the squares of the `k`-th mip that are to be solid: in each picture as many as it covers. Gives back the share of
    /// all that is to be solid and can't be.
    fn choose(&mut self, k: usize, pictures: &[Rect]) -> f32 {
        let mut taken = vec![false; self.squares.len()];
        let edge = 1 << k;
        let mut of_pictures: Vec<Vec<Ranked>> = Vec::with_capacity(pictures.len() + 1);
        for rect in pictures {
            let (x0, y0) = (rect.x as usize / edge, rect.y as usize / edge);
            let x1 = ((rect.x + rect.width) as usize).div_ceil(edge).min(self.width);
            let y1 = ((rect.y + rect.height) as usize).div_ceil(edge).min(self.height);
            let squares = (y0..y1).flat_map(|y| (x0..x1).map(move |x| (y, x))).map(|(y, x)| y * self.width + x);
            // A square that several pictures share is the first one's.
            of_pictures
                .push(squares.filter(|&i| !std::mem::replace(&mut taken[i], true)).map(|i| (0.0, i as u32)).collect());
        }
        of_pictures.push((0..taken.len()).filter(|&i| !taken[i]).map(|i| (0.0, i as u32)).collect());
        let wanted: Vec<(f32, usize, usize)> = of_pictures.par_iter_mut().map(|ranked| self.rank(ranked)).collect();
        // Coverage that rounding to whole squares owes to the next picture.
        let mut owed = 0.0_f32;
        let count = |(wanted, forced, able): (f32, usize, usize)| {
            let wanted = wanted + owed;
            let count = ((wanted + 0.5).floor().max(0.0) as usize).clamp(forced, able.max(forced));
            owed = wanted - count as f32;
            count
        };
        let all: f32 = wanted.iter().map(|wanted| wanted.0).sum();
        let counts: Vec<usize> = wanted.into_iter().map(count).collect();
        // Less than a square is no lack.
        let lacking = ((all - counts.iter().sum::<usize>() as f32).abs() - 1.0) / all.max(1.0);
        of_pictures.par_iter_mut().zip(&counts).for_each(|(ranked, &count)| {
            if count < ranked.len() {
                ranked.select_nth_unstable_by(count, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            }
        });
        let mut solid = taken;
        for (ranked, count) in of_pictures.iter().zip(counts) {
            ranked.iter().enumerate().for_each(|(place, &(_, i))| solid[i as usize] = place < count);
        }
        self.squares.par_iter_mut().zip(solid).with_min_len(1 << 13).for_each(|(square, solid)| square.keep(solid));
        lacking
    }

    /// Ranks some squares: those that can be either go by how full they are, before them come those that can't be clear.
    /// How many they cover, how many can't be clear, and how many can be solid.
    fn rank(&self, ranked: &mut [Ranked]) -> (f32, usize, usize) {
        let (mut wanted, mut forced, mut able) = (0.0, 0, 0);
        for (rank, i) in ranked {
            let square = &self.squares[*i as usize];
            wanted += square.solid;
            *rank = match () {
                () if square.low > CLEAR - MARGIN => 9.0,
                () if square.high < SOLID + MARGIN => -1.0,
                () => square.solid + square.own * 1e-4,
            };
            forced += usize::from(*rank > 8.0);
            able += usize::from(*rank >= 0.0);
        }
        (wanted, forced, able)
    }
}

/// How soon a square is to be solid, and its number.
type Ranked = (f32, u32);

/// Moves alpha so that the squares of every mip fall on the sides that were chosen for them.
fn settle(alpha: &mut [u8], free: &[bool], levels: &[Level], gap: f32) {
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
    let rows =
        alpha.par_chunks_exact_mut(4 * width).zip(free.par_chunks_exact(4 * width)).zip(goals.par_chunks_exact(width));
    rows.for_each(|((alpha, free), goals)| {
        for (x, goal) in goals.iter().enumerate() {
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

fn coverage_of(mut alpha: Vec<u8>, mut width: usize, mut height: usize, levels: usize) -> Vec<f32> {
    let mut shares = Vec::new();
    if alpha.len() != width * height {
        return shares;
    }
    while shares.len() < levels && !alpha.is_empty() {
        let solid = alpha.iter().filter(|&&a| f32::from(a) >= ALPHA_CUTOFF * 255.0).count();
        shares.push(solid as f32 / alpha.len() as f32);
        if width == 1 && height == 1 {
            break;
        }
        let (w, h) = ((width / 2).max(1), (height / 2).max(1));
        let mut next = vec![0_u8; w * h];
        next.par_chunks_exact_mut(w).with_min_len(32).enumerate().for_each(|(y, line)| {
            let row = |y: usize| &alpha[y.min(height - 1) * width..][..width];
            let (upper, lower) = (row(2 * y), row(2 * y + 1));
            let mean = |a: u8, b: u8, c: u8, d: u8| {
                ((u16::from(a) + u16::from(b) + u16::from(c) + u16::from(d) + 2) / 4) as u8
            };
            if width == 1 {
                line[0] = mean(upper[0], upper[0], lower[0], lower[0]);
                return;
            }
            for ((out, up), low) in line.iter_mut().zip(upper.as_chunks::<2>().0).zip(lower.as_chunks::<2>().0) {
                *out = mean(up[0], up[1], low[0], low[1]);
            }
        });
        (alpha, width, height) = (next, w, h);
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, math};

    fn stripes(period: usize) -> Maps {
        let n = 64 * 64;
        let color = (0..n).map(|i| [90, 120, 60, if i % 64 % period < 2 { 255 } else { 0 }]).collect();
        Maps { width: 64, height: 64, color, normal: vec![[128, 128, 255]; n], orm: vec![[255, 200, 0]; n] }
    }

    #[test]
    fn coverage_counts_solid_texels_and_halves_the_mips() {
        assert_eq!(coverage(&stripes(4), 3), [0.5, 0.5, 1.0]);
        assert_eq!(coverage(&stripes(64), 9).len(), 7);
    }

    /// Leaves of 14 by 3 texels with soft edges, strewn over `edge` texels.
    fn strewn(edge: usize, leaves: u64) -> Maps {
        let mut alpha = vec![0_u8; edge * edge];
        for i in 0..leaves {
            let seed = Seed::new(i);
            let (x, y) = (seed.at(0).range(0.0, edge as f32), seed.at(1).range(0.0, edge as f32));
            let (sin, cos) = math::sin_cos(seed.at(2).range(0.0, 6.3));
            for k in 0..14 * 3 * 4 {
                let (along, across) = (f32::from(k as u8 / 6) / 2.0, f32::from(k as u8 % 6) / 2.0);
                let (px, py) = (x + along * cos - across * sin, y + along * sin + across * cos);
                if (0.0..edge as f32).contains(&px) && (0.0..edge as f32).contains(&py) {
                    let a = &mut alpha[py as usize * edge + px as usize];
                    *a = (*a).max(60 + (seed.at(k).unit() * 195.0) as u8);
                }
            }
        }
        let n = edge * edge;
        let color = alpha.into_iter().map(|a| [90, 120, 60, a]).collect();
        let size = edge as u32;
        Maps { width: size, height: size, color, normal: vec![[128, 128, 255]; n], orm: vec![[255, 200, 0]; n] }
    }

    #[test]
    fn every_mip_covers_what_level_0_does_and_that_stays() {
        for leaves in [15, 60, 240, 900] {
            let mut maps = strewn(256, leaves);
            let before = maps.color.clone();
            let solid = |m: &Maps| m.color.iter().map(|c| c[3] >= 128).collect::<Vec<_>>();
            let was = solid(&maps);
            let report = preserve_coverage(&mut maps);
            assert_eq!(solid(&maps), was);
            // Little is moved to the brink, where compressed blocks would take it to the other side, but of few leaves.
            let brink = 121..135;
            let moved = maps.color.iter().zip(&before).filter(|(a, b)| brink.contains(&a[3]) && !brink.contains(&b[3]));
            let moved = moved.count();
            assert!(leaves < 100 || moved == 0, "{leaves}: {moved}");
            // Of a few leaves a square of the coarser mips is more than 2 %.
            let squares = |k: usize| ((256 >> k) * (256 >> k)) as f32;
            for (k, share) in report.after.iter().enumerate().skip(1).take(if leaves < 60 { 4 } else { 5 }) {
                let bound = (0.02 * report.after[0]).max(0.75 / squares(k));
                assert!((share - report.after[0]).abs() <= bound, "{leaves}: {report:?}");
            }
            assert!((report.before[3] / report.before[0] - 1.0).abs() > 0.1, "{report:?}");
        }
    }

    #[test]
    fn each_picture_keeps_its_own_coverage() {
        // Left dense, right sparse: by rank alone all would go to the left.
        let mut alpha = vec![0_u8; 128 * 64];
        for (i, a) in alpha.iter_mut().enumerate() {
            let share = if i % 128 < 64 { 0.8 } else { 0.2 };
            *a = if Seed::new(4).at(i as u64).unit() < share { 255 } else { 0 };
        }
        let halves = [0, 64].map(|x| Rect { x, y: 0, width: 64, height: 64 });
        preserve_alpha(&mut alpha, (128, 64), &halves);
        for half in 0..2 {
            let part: Vec<u8> = (0..64 * 64).map(|i| alpha[i / 64 * 128 + half * 64 + i % 64]).collect();
            let shares = coverage_of(part, 64, 64, 4);
            assert!(shares.iter().all(|s| (s / shares[0] - 1.0).abs() < 0.03), "{shares:?}");
        }
    }

    #[test]
    fn pictures_of_a_single_square_keep_it_among_them() {
        // Two in five texels of every picture: none is half full, and none may round to nothing for all.
        let mut alpha = vec![0_u8; 128 * 128];
        for (i, a) in alpha.iter_mut().enumerate() {
            *a = if Seed::new(5).at(i as u64).unit() < 0.4 { 255 } else { 0 };
        }
        let rects: Vec<Rect> = (0..256).map(|i| Rect { x: i % 16 * 8, y: i / 16 * 8, width: 8, height: 8 }).collect();
        let after = preserve_alpha(&mut alpha, (128, 128), &rects).after;
        assert!((after[3] / after[0] - 1.0).abs() < 0.02, "{after:?}");
    }

    #[test]
    fn nothing_stays_nothing_and_odd_sizes_are_answered() {
        let mut maps = stripes(64);
        maps.color.iter_mut().for_each(|c| c[3] = 0);
        assert_eq!(preserve_coverage(&mut maps).after, [0.0; 6]);
        let mut none = Maps { width: 0, height: 0, color: vec![], normal: vec![], orm: vec![] };
        assert!(preserve_coverage(&mut none).before.is_empty());
        let mut odd = vec![255; 7 * 3];
        assert_eq!(preserve_alpha(&mut odd, (7, 3), &[Rect { x: 5, y: 1, width: 90, height: 90 }]).after[0], 1.0);
    }
}
