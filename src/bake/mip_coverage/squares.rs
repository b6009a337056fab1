//! The squares of texels that become one of a mip: which of them are to be solid, and what alpha makes them so.

use rayon::prelude::*;

use super::seen::{Picture, Pool};
use super::{CLEAR, CUT, FAR, MARGIN, PictureKind, SHEET_MIPS, SOLID};

/// What becomes one texel of a mip: means of the alpha of its texels.
#[derive(Clone, Copy, Default)]
pub(super) struct Square {
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
    #[inline]
    pub(super) fn texel(alpha: u8, free: bool, gap: f32) -> Self {
        let own = f32::from(alpha);
        let solid = own >= SOLID;
        let (low, high) = if solid { (own.min(CLEAR + gap), 255.0) } else { (0.0, own.max(SOLID - gap)) };
        let (free_low, free_high) = if free { (low, high) } else { (own, own) };
        Self { solid: f32::from(u8::from(solid)), low, high, free_low, free_high, own }
    }

    /// The mean of four, added up one by one: they need not stand in memory together.
    #[inline]
    fn mean(of: impl Fn(usize) -> Self) -> Self {
        let mut sum = of(0);
        for part in 1..4 {
            let part = of(part);
            sum.solid += part.solid;
            sum.low += part.low;
            sum.high += part.high;
            sum.free_low += part.free_low;
            sum.free_high += part.free_high;
            sum.own += part.own;
        }
        Self {
            solid: sum.solid * 0.25,
            low: sum.low * 0.25,
            high: sum.high * 0.25,
            free_low: sum.free_low * 0.25,
            free_high: sum.free_high * 0.25,
            own: sum.own * 0.25,
        }
    }

    /// Keeps it on one side of the cut-off.
    #[inline]
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
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) squares: Vec<Square>,
}

impl Level {
    pub(super) fn of(width: usize, height: usize, fine: impl Fn(usize, usize) -> Square + Sync) -> Self {
        let mut squares = vec![Square::default(); width * height];
        let row = |(y, row): (usize, &mut [Square])| {
            for (x, square) in row.iter_mut().enumerate() {
                let parts = children((x, y), width);
                *square = Square::mean(|k| fine(y * width + x, parts[k]));
            }
        };
        squares.par_chunks_exact_mut(width.max(1)).with_min_len(rows_of_a_task(width)).enumerate().for_each(row);
        Self { width, height, squares }
    }

    /// Moves the squares of the `k`-th mip that are near the cut-off so that each pool shows what it is asked for, and keeps all
    /// on their sides then: as many are solid as the pool covers.
    pub(super) fn choose(&mut self, k: usize, pictures: &[Picture], asked: impl Fn(usize) -> f32 + Sync) {
        let size = (self.width, self.height);
        let pools = Pool::all(pictures, k);
        let owners = owners(&pools, pictures, k, size);
        let squares = &self.squares;
        // Each once: those that two pictures of a pool share are the first one's.
        let owned = |i: usize, pool: &Pool| -> Vec<u32> {
            let mut all = Vec::new();
            for &p in &pool.of {
                let [columns, rows] = pictures[p].squares(k, size);
                for first in rows.map(|y| y * size.0) {
                    let own = columns.clone().map(|x| (first + x) as u32);
                    all.extend(own.filter(|&at| owners[at as usize] as usize == i));
                }
            }
            if pool.of.len() > 1 {
                all.sort_unstable();
                all.dedup();
            }
            all
        };
        let of = |(i, pool): (usize, &Pool)| match pool.kind {
            PictureKind::Frames if k <= SHEET_MIPS => Choice::Solid(fullest(squares, owned(i, pool))),
            PictureKind::Frames => Choice::None,
            _ if pool.is_beyond(pictures, k) => Choice::None,
            PictureKind::Leaf | PictureKind::Card => {
                let share = pool.mean(pictures, |p| pictures[p].solid * asked(p));
                let by = pool.shift(pictures, (|i: usize| squares[i].own, size), k, share);
                // So few of a sparse picture's are solid that they show by how near those around them are; of the last mips
                // fuller than they are.
                let is_sparse = pool.of.iter().all(|&p| pictures[p].is_sparse());
                let shown = CUT - by;
                let least = if is_sparse || pool.fuller(pictures, k) > 1.0 {
                    shown
                } else {
                    least_solid(squares, &owned(i, pool)).clamp(shown - NEAR, shown + NEAR)
                };
                Choice::By { by, least }
            }
        };
        let choices: Vec<Choice> = pools.par_iter().enumerate().map(of).collect();
        let some = self.squares.par_chunks_mut(TASK).zip(owners.par_chunks(TASK)).enumerate();
        some.for_each(|(task, (squares, owners))| {
            for (at, (square, &owner)) in (task * TASK..).zip(squares.iter_mut().zip(owners)) {
                let is_solid = match choices.get(owner as usize) {
                    Some(&Choice::By { by, least }) => {
                        let is_solid = square.own >= least;
                        let far = (((square.own - CUT).abs() - by.abs()) / FAR).clamp(0.0, 1.0);
                        square.own = (square.own + by * (1.0 - far)).clamp(square.low, square.high);
                        is_solid
                    }
                    Some(Choice::Solid(solid)) => solid.binary_search(&(at as u32)).is_ok(),
                    Some(Choice::None) | None => continue,
                };
                square.keep(is_solid);
            }
        });
    }
}

/// The pool that each square of the `k`-th mip belongs to, [`u32::MAX`] for none. One that several pictures share is the first
/// one's, or a sheet's.
fn owners(pools: &[Pool], pictures: &[Picture], k: usize, size: (usize, usize)) -> Vec<u32> {
    let mut owners = vec![u32::MAX; size.0 * size.1];
    // Sheets come first: what is asked of the cards beside them must not move their frames.
    let is_sheet = |pool: &&Pool| pool.kind == PictureKind::Frames;
    let (sheets, others): (Vec<_>, Vec<_>) = (0..).zip(pools).partition(|(_, pool)| is_sheet(pool));
    for (i, picture) in sheets.into_iter().chain(others).flat_map(|(i, pool)| pool.of.iter().map(move |&p| (i, p))) {
        let [columns, rows] = pictures[picture].squares(k, size);
        for y in rows {
            let row = owners[y * size.0..][columns.clone()].iter_mut();
            row.filter(|owner| **owner == u32::MAX).for_each(|owner| *owner = i);
        }
    }
    owners
}

/// Moves the alpha of the `k`-th mip so that each pool shows of it the mean of what its pictures do at level 0, which `goals` tells by
/// picture; sheets of frames stay as they are.
pub(super) fn shift(alpha: &mut [u8], size: (usize, usize), k: usize, pictures: &[Picture], goals: &[f32]) {
    let pools = Pool::all(pictures, k);
    let owners = owners(&pools, pictures, k, size);
    let of = |pool: &Pool| {
        if pool.kind == PictureKind::Frames {
            return 0;
        }
        let goal = pool.mean(pictures, |i| goals[i]);
        let about = pool.shift(pictures, (|i: usize| f32::from(alpha[i]), size), k, goal) as i32;
        let off = |by: &i32| {
            let shown = pool.shown(pictures, (|i: usize| f32::from(alpha[i]) + *by as f32, size), k);
            (shown - goal).abs()
        };
        // Alpha is of whole numbers, and of many texels that are alike all change sides at once.
        (about - 2..=about + 2).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(about)
    };
    let by: Vec<i32> = pools.par_iter().map(of).collect();
    for (alpha, owner) in alpha.iter_mut().zip(&owners) {
        if let Some(by) = by.get(*owner as usize) {
            *alpha = (i32::from(*alpha) + by).clamp(0, 255) as u8;
        }
    }
}

/// Squares that are worth a task of their own.
const TASK: usize = 1 << 13;

/// How far from the alpha with which enough shows is that from which on squares are solid: what shows goes before how many are.
const NEAR: f32 = 3.0;

/// What becomes of a pool's squares.
enum Choice {
    /// They are moved by so much, and solid are those that were so much at least.
    By { by: f32, least: f32 },
    /// These are to be solid, in order, and no others.
    Solid(Vec<u32>),
    /// Nothing.
    None,
}

/// From what alpha on as many of some squares are solid as they cover at level 0.
fn least_solid(squares: &[Square], of: &[u32]) -> f32 {
    const BINS: usize = 1 << 10;
    let (mut bins, mut wanted) = ([0_u32; BINS], 0.0_f32);
    for square in of.iter().map(|&at| &squares[at as usize]) {
        bins[((square.own * 4.0) as u32 as usize).min(BINS - 1)] += 1;
        wanted += square.solid;
    }
    let (mut above, mut bin) = (0.0_f32, BINS);
    while bin > 0 {
        let next = above + bins[bin - 1] as f32;
        // What are alike are taken whole or not, whichever is nearer.
        if next - wanted > wanted - above {
            break;
        }
        (above, bin) = (next, bin - 1);
    }
    bin as f32 * 0.25
}

/// As many of some squares as they cover at level 0, in order: those that can't be clear, then the fullest of those that can be
/// solid.
fn fullest(squares: &[Square], mut all: Vec<u32>) -> Vec<u32> {
    let (mut wanted, mut forced, mut able) = (0.0, 0, 0);
    let rank = |square: &Square| match () {
        () if square.low > CLEAR - MARGIN => 9.0,
        () if square.high < SOLID + MARGIN => -1.0,
        () => square.solid + square.own * 1e-4,
    };
    for square in all.iter().map(|&at| &squares[at as usize]) {
        wanted += square.solid;
        forced += usize::from(rank(square) > 8.0);
        able += usize::from(rank(square) >= 0.0);
    }
    let count = ((wanted + 0.5) as usize).clamp(forced, able.max(forced));
    if count < all.len() {
        let later =
            |a: &u32, b: &u32| rank(&squares[*b as usize]).total_cmp(&rank(&squares[*a as usize])).then(a.cmp(b));
        all.select_nth_unstable_by(count, later);
        all.truncate(count);
    }
    all.sort_unstable();
    all
}

/// Moves alpha so that the squares of every mip are what they are to be.
pub(super) fn settle(alpha: &mut [u8], (free, gaps): (&[bool], &[f32]), levels: &[Level]) {
    let Some(last) = levels.last() else { return };
    // From the coarsest down: each square hands its mean on to its four parts.
    let mut goals: Vec<f32> = last.squares.iter().map(|s| s.own).collect();
    for k in (1..levels.len()).rev() {
        let (fine, width) = (&levels[k - 1].squares, levels[k].width);
        let mut next = vec![0.0_f32; fine.len()];
        let rows = next.par_chunks_exact_mut(4 * width).zip(fine.par_chunks_exact(4 * width));
        let rows = rows.zip(goals.par_chunks_exact(width)).with_min_len(rows_of_a_task(width));
        rows.for_each(|((next, fine), goals)| {
            for (x, goal) in goals.iter().enumerate() {
                let parts = children((x, 0), width);
                for (part, goal) in parts.into_iter().zip(handed(*goal, |k| fine[parts[k]])) {
                    next[part] = goal;
                }
            }
        });
        goals = next;
    }
    let width = levels[0].width;
    let of = (goals.par_chunks_exact(width), gaps.par_chunks_exact(width));
    let rows = alpha.par_chunks_exact_mut(4 * width).zip(free.par_chunks_exact(4 * width)).zip(of.0.zip(of.1));
    rows.with_min_len(rows_of_a_task(width)).for_each(|((alpha, free), (goals, gaps))| {
        for (x, (goal, &gap)) in goals.iter().zip(gaps).enumerate() {
            let parts = children((x, 0), width);
            let sum: u32 = parts.iter().map(|&p| u32::from(alpha[p])).sum();
            if sum as f32 * 0.25 == *goal {
                continue;
            }
            let texels: [Square; 4] = std::array::from_fn(|k| Square::texel(alpha[parts[k]], free[parts[k]], gap));
            for ((part, goal), texel) in parts.into_iter().zip(handed(*goal, |k| texels[k])).zip(&texels) {
                alpha[part] = (goal + 0.5).clamp(texel.low, texel.high) as u8;
            }
        }
    });
}

/// The means of four parts that make `goal`: what is free is moved first, each by its room, then the rest.
#[inline]
fn handed(goal: f32, part: impl Fn(usize) -> Square) -> [f32; 4] {
    let mut at: [f32; 4] = std::array::from_fn(|i| part(i).own);
    let mut short = goal * 4.0 - at.iter().sum::<f32>();
    // Most parts are left as they are: means of whole numbers are exact.
    if short == 0.0 {
        return at;
    }
    let up = short > 0.0;
    for is_free in [true, false] {
        let end = |i: usize| match (part(i), is_free, up) {
            (part, true, true) => part.free_high,
            (part, true, false) => part.free_low,
            (part, false, true) => part.high,
            (part, false, false) => part.low,
        };
        let room: [f32; 4] = std::array::from_fn(|i| end(i) - at[i]);
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

/// The four squares of the next finer level within one of a level that is `width` wide.
#[inline]
fn children((x, y): (usize, usize), width: usize) -> [usize; 4] {
    let first = 4 * width * y + 2 * x;
    [first, first + 1, first + 2 * width, first + 2 * width + 1]
}

/// Rows of squares that are worth a task.
fn rows_of_a_task(width: usize) -> usize {
    (TASK / width.max(1)).max(1)
}
