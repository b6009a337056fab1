//! Alpha coverage: how much of a cut-out picture is left in its mips, and alpha that keeps it.
//!
//! Engines box-filter the mips of a PNG, and thin leaves then fall below the cut-off: the tree dissolves with distance
//! (three.js #20522, godot-proposals #9152). Castaño's remedy (2010, "Computing Alpha Mipmaps") scales the alpha of each
//! mip, but a PNG has none. What a PNG has is room: a clear texel may hold any alpha below the cut-off and a solid one any
//! above, and neither shows at level 0. So the mips are designed: of the squares that become one texel of mip k as many
//! are chosen to be solid as level 0 covers, the fullest first, picture by picture; then alpha is moved as little as makes
//! every mean fall on its side, from the coarsest mip down to the texels. That is linear and exact but for squares that
//! can't be had: a clear one without a clear texel, a solid one whose clear parts are wholly clear by choice.
//!
//! Limits: under bilinear magnification the visible edge moves by up to half a texel; mips beyond the
//! [`MIPS`]-th and those of filters other than the box are what they come to. Tried before: a halo of one strength and
//! width around all leaves, which left mip 4 off by 35 to 63 %.

use serde::{Deserialize, Serialize};

use super::{Maps, Rect};

/// Alpha at which a leaf's texel is solid: the cut-off of the `MASK` material, as a share of full alpha.
pub const ALPHA_CUTOFF: f32 = 0.5;

/// Mips that keep the coverage.
const MIPS: usize = 5;
/// The first alpha that is solid, and the last that is clear.
const SOLID: f32 = 128.0;
const CLEAR: f32 = 127.0;
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
    let levels = levels(alpha, wide, high);
    let mut sides: Vec<Vec<bool>> = Vec::new();
    for k in (1..levels.len()).rev() {
        let above = sides.last().map(|above: &Vec<bool>| (above.as_slice(), levels[k + 1].width));
        sides.push(choose(&levels[k], k, above, pictures));
    }
    sides.reverse();
    settle(alpha, &levels, &sides);
    let after = coverage_of(alpha.to_vec(), wide, high, MIPS + 1);
    CoverageReport { before, after }
}

/// One mip: how much of each of its squares is solid at level 0, and the mean of their alpha.
struct Level {
    width: usize,
    height: usize,
    solid: Vec<f32>,
    alpha: Vec<f32>,
}

/// Level 0 and the mips, as long as sides are even.
fn levels(alpha: &[u8], width: usize, height: usize) -> Vec<Level> {
    let solid = alpha.iter().map(|&a| if f32::from(a) >= SOLID { 1.0 } else { 0.0 }).collect();
    let mut levels = vec![Level { width, height, solid, alpha: alpha.iter().map(|&a| f32::from(a)).collect() }];
    while levels.len() <= MIPS {
        let fine = &levels[levels.len() - 1];
        if !fine.width.is_multiple_of(2) || !fine.height.is_multiple_of(2) {
            break;
        }
        let (solid, alpha) = (halved(&fine.solid, fine.width), halved(&fine.alpha, fine.width));
        levels.push(Level { width: fine.width / 2, height: fine.height / 2, solid, alpha });
    }
    levels
}

/// Means of squares of four.
fn halved(values: &[f32], width: usize) -> Vec<f32> {
    values
        .chunks_exact(2 * width)
        .flat_map(|rows| {
            let (upper, lower) = rows.split_at(width);
            let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
            pairs.map(|(a, b)| (a[0] + a[1] + b[0] + b[1]) * 0.25)
        })
        .collect()
}

/// Which squares of the `k`-th mip are to be solid; `above` are those of the next mip and its width.
fn choose(level: &Level, k: usize, above: Option<(&[bool], usize)>, pictures: &[Rect]) -> Vec<bool> {
    let mut chosen = vec![false; level.solid.len()];
    let mut taken = vec![false; level.solid.len()];
    // Coverage that rounding to whole squares owes.
    let mut owed = 0.0_f32;
    let mut pick = |squares: Vec<usize>, chosen: &mut Vec<bool>| {
        let wanted = squares.iter().map(|&i| level.solid[i]).sum::<f32>() + owed;
        let count = (wanted + 0.5).floor().clamp(0.0, squares.len() as f32) as usize;
        owed = wanted - count as f32;
        let parents = |i: usize, width: usize| i / level.width / 2 * width + i % level.width / 2;
        // The fullest first; what stands in a square that is to be solid comes before equals.
        let rank = |&i: &usize| {
            let bonus = above.map_or(0.0, |(sides, width)| if sides[parents(i, width)] { 0.02 } else { 0.0 });
            level.solid[i] + bonus + level.alpha[i] * 1e-5
        };
        let mut ranked: Vec<(f32, usize)> =
            squares.iter().filter(|&&i| level.solid[i] > 0.0).map(|i| (rank(i), *i)).collect();
        ranked.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for &(_, i) in ranked.iter().take(count) {
            chosen[i] = true;
        }
        owed += count.saturating_sub(ranked.len()) as f32;
    };
    for rect in pictures {
        let edge = 1 << k;
        let (x0, y0) = (rect.x as usize / edge, rect.y as usize / edge);
        let x1 = ((rect.x + rect.width) as usize).div_ceil(edge).min(level.width);
        let y1 = ((rect.y + rect.height) as usize).div_ceil(edge).min(level.height);
        let squares = (y0..y1).flat_map(|y| (x0..x1).map(move |x| y * level.width + x));
        let own: Vec<usize> = squares.filter(|&i| !std::mem::replace(&mut taken[i], true)).collect();
        pick(own, &mut chosen);
    }
    pick((0..taken.len()).filter(|&i| !taken[i]).collect(), &mut chosen);
    chosen
}

/// Moves alpha so that the squares of every mip fall on the sides that were chosen for them.
fn settle(alpha: &mut [u8], levels: &[Level], sides: &[Vec<bool>]) {
    // What means can be reached, and what they would be without the mips above: from the texels up.
    let bounds = |solid: bool| if solid { (SOLID, 255.0) } else { (0.0, CLEAR) };
    let texels: Vec<[f32; 3]> = alpha
        .iter()
        .map(|&a| {
            let (low, high) = bounds(f32::from(a) >= SOLID);
            [low, high, f32::from(a)]
        })
        .collect();
    let mut reach = vec![texels];
    for (k, sides) in sides.iter().enumerate() {
        let (fine, level) = (&reach[k], &levels[k + 1]);
        let mean = |i: usize| {
            let mut sum = [0.0_f32; 3];
            for from in children(i, level.width) {
                for (s, v) in sum.iter_mut().zip(fine[from]) {
                    *s += v * 0.25;
                }
            }
            let [low, high, own] = sum;
            let (least, most) = if sides[i] { (SOLID + MARGIN, 255.0) } else { (0.0, CLEAR - MARGIN) };
            // What can't be had stays what it is.
            let (low, high) =
                if low.max(least) <= high.min(most) { (low.max(least), high.min(most)) } else { (low, high) };
            [low, high, own.clamp(low, high)]
        };
        reach.push((0..level.solid.len()).map(mean).collect());
    }
    // From the coarsest down: each square hands its mean on to its four parts, which move by their room.
    let mut goals: Vec<f32> = reach[sides.len()].iter().map(|r| r[2]).collect();
    for k in (0..sides.len()).rev() {
        let (fine, level) = (&reach[k], &levels[k + 1]);
        let mut next = vec![0.0_f32; fine.len()];
        for (i, goal) in goals.iter().enumerate() {
            let parts = children(i, level.width);
            let short = goal * 4.0 - parts.iter().map(|&p| fine[p][2]).sum::<f32>();
            let room = |p: usize| if short > 0.0 { fine[p][1] - fine[p][2] } else { fine[p][2] - fine[p][0] };
            let all: f32 = parts.iter().map(|&p| room(p)).sum();
            let share = if all > 0.0 { (short / all).clamp(-1.0, 1.0) } else { 0.0 };
            for p in parts {
                next[p] = fine[p][2] + share * room(p);
            }
        }
        goals = next;
    }
    for (a, goal) in alpha.iter_mut().zip(goals) {
        let (low, high) = bounds(f32::from(*a) >= SOLID);
        *a = (goal + 0.5).clamp(low, high) as u8;
    }
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
        let mut next = Vec::with_capacity(w * h);
        for y in 0..h {
            let rows = [(2 * y).min(height - 1) * width, (2 * y + 1).min(height - 1) * width];
            for x in 0..w {
                let columns = [(2 * x).min(width - 1), (2 * x + 1).min(width - 1)];
                let sum: u32 =
                    rows.iter().flat_map(|r| columns.iter().map(move |c| r + c)).map(|i| u32::from(alpha[i])).sum();
                next.push(((sum + 2) / 4) as u8);
            }
        }
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
            let solid = |m: &Maps| m.color.iter().map(|c| c[3] >= 128).collect::<Vec<_>>();
            let was = solid(&maps);
            let report = preserve_coverage(&mut maps);
            assert_eq!(solid(&maps), was);
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
        for i in 0..128 * 64 {
            let share = if i % 128 < 64 { 0.8 } else { 0.2 };
            alpha[i] = if Seed::new(4).at(i as u64).unit() < share { 255 } else { 0 };
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
