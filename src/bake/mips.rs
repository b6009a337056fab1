//! A material's mips, for textures that carry them.
//!
//! Each is the mean of the one before it: colour in linear light and by its alpha, normals brought to unit length. Of a
//! cut-out alpha is moved in the first nine so that they show of each picture what level 0 does (`mip_coverage.rs`; a PNG, whose
//! mips engines make, can't have that), but for sheets of frames, which the atlas' alpha is made for; of those beyond
//! as many texels are solid as level 0 covers, those of the greatest alpha.
//! Alpha then keeps [`MARGIN`] steps off the cut-off, also at level 0, so that what block compression rounds stays on its
//! side. No filter is wider than the box: pictures of an atlas would run into one another.

use rayon::prelude::*;

use super::mip_coverage::{ALPHA_CUTOFF, MIPS, keep_shown};
use super::resample::resample;
use super::{Maps, PictureKind, Rect};

/// Steps of alpha between a texel and the cut-off.
const MARGIN: u8 = 8;
/// The same in mips whose alpha was made for what is seen between texels: how near the cut-off they are is part of it.
const MIPS_MARGIN: u8 = 3;
/// The first alpha that is solid.
const SOLID: u8 = (ALPHA_CUTOFF * 255.0 + 0.5) as u8;

/// What alpha is to a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlphaUse {
    /// Nothing.
    Opaque,
    /// A mask, cut at [`ALPHA_CUTOFF`].
    CutOut,
}

/// All mips down to one texel, level 0 first: `maps` itself, but for the margin of a cut-out. Sides are halved and rounded
/// down. Empty for maps without texels or whose arrays aren't of their size.
#[must_use]
pub fn mips(maps: &Maps, alpha: AlphaUse) -> Vec<Maps> {
    mips_of(maps, alpha, &[])
}

/// As [`mips`], of an atlas of these pictures.
#[must_use]
pub fn mips_of(maps: &Maps, alpha: AlphaUse, pictures: &[(Rect, PictureKind)]) -> Vec<Maps> {
    let texels = maps.width as usize * maps.height as usize;
    if texels == 0 || [maps.color.len(), maps.normal.len(), maps.orm.len()] != [texels; 3] {
        return Vec::new();
    }
    let mut levels = vec![maps.clone()];
    while let Some(last) = levels.last()
        && (last.width > 1 || last.height > 1)
    {
        levels.push(resample(last, (last.width / 2).max(1), (last.height / 2).max(1)));
    }
    if alpha == AlphaUse::CutOut {
        let mut alphas: Vec<Vec<u8>> =
            levels.iter().take(MIPS + 1).map(|level| level.color.iter().map(|c| c[3]).collect()).collect();
        keep_shown(&mut alphas, (maps.width, maps.height), pictures);
        for (level, alpha) in levels.iter_mut().zip(alphas) {
            level.color.iter_mut().zip(alpha).for_each(|(color, alpha)| color[3] = alpha);
        }
        let solid = maps.color.iter().filter(|c| c[3] >= SOLID).count() as u64;
        levels.par_iter_mut().enumerate().for_each(|(k, level)| {
            let here = level.color.len() as u64;
            if k <= MIPS {
                let margin = if k == 0 { MARGIN } else { MIPS_MARGIN };
                return level.color.iter_mut().for_each(|c| c[3] = clear_of_cut_off(c[3], c[3] >= SOLID, margin));
            }
            keep(&mut level.color, ((solid * here + texels as u64 / 2) / texels as u64) as usize);
        });
    }
    levels
}

/// Makes `count` texels solid, those of the greatest alpha, and all others clear.
fn keep(color: &mut [[u8; 4]], count: usize) {
    let mut histogram = [0_usize; 256];
    color.iter().for_each(|c| histogram[usize::from(c[3])] += 1);
    // All above `edge` are solid, and of those that are at it some.
    let (mut edge, mut above) = (255, 0);
    while edge > 0 && above + histogram[edge] < count {
        above += histogram[edge];
        edge -= 1;
    }
    let (at, wanted) = (histogram[edge], count - above);
    let mut seen = 0;
    for c in color {
        let solid = match usize::from(c[3]).cmp(&edge) {
            std::cmp::Ordering::Greater => true,
            std::cmp::Ordering::Less => false,
            std::cmp::Ordering::Equal => {
                seen += 1;
                // Spread evenly over all that are alike.
                seen * wanted / at > (seen - 1) * wanted / at
            }
        };
        c[3] = clear_of_cut_off(c[3], solid, MARGIN);
    }
}

fn clear_of_cut_off(alpha: u8, solid: bool, margin: u8) -> u8 {
    if solid { alpha.max(SOLID + margin) } else { alpha.min(SOLID - 1 - margin) }
}

/// Maps whose sides are multiples of four, as block compression wants them: shrunk by up to three texels, or, below four,
/// with each texel repeated.
#[must_use]
pub fn to_blocks(maps: &Maps) -> Maps {
    let side = |n: u32| (n & !3).max(4);
    let (width, height) = (side(maps.width), side(maps.height));
    if (width, height) == (maps.width, maps.height) || maps.color.is_empty() {
        return maps.clone();
    }
    let (wide, high) = (maps.width.max(4), maps.height.max(4));
    let at = |i: usize| {
        let (x, y) = (i as u32 % wide, i as u32 / wide);
        ((y * maps.height / high) * maps.width + x * maps.width / wide) as usize
    };
    let repeated = |count: usize| (0..count).map(at);
    let count = (wide * high) as usize;
    let larger = Maps {
        width: wide,
        height: high,
        color: repeated(count).map(|i| maps.color[i]).collect(),
        normal: repeated(count).map(|i| maps.normal[i]).collect(),
        orm: repeated(count).map(|i| maps.orm[i]).collect(),
    };
    if (wide, high) == (width, height) { larger } else { resample(&larger, width, height) }
}

#[cfg(test)]
mod tests {
    use super::super::{coverage, coverage_in, preserve_coverage};
    use super::*;
    use crate::base::Seed;

    /// Soft blots, those of 128 texels repeated.
    fn blots(edge: u32) -> Maps {
        let count = (edge * edge) as usize;
        let alpha = |i: usize| {
            let (x, y) = ((i as u32 % edge % 128) as f32, (i as u32 / edge % 128) as f32);
            let far = |k: u64| {
                let seed = Seed::new(k);
                let (cx, cy) = (seed.at(0).range(0.0, 128.0), seed.at(1).range(0.0, 128.0));
                ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt()
            };
            let near = (0..60).map(far).fold(f32::MAX, f32::min);
            ((6.0 - near) * 60.0 + 128.0).clamp(0.0, 255.0) as u8
        };
        let color = (0..count).map(|i| [90, (i % 97) as u8, 60, alpha(i)]).collect();
        Maps { width: edge, height: edge, color, normal: vec![[128, 128, 255]; count], orm: vec![[255, 200, 0]; count] }
    }

    #[test]
    fn every_mip_shows_what_level_0_does_and_keeps_off_the_cut_off() {
        let mut maps = blots(512);
        let plain = mips(&maps, AlphaUse::Opaque);
        assert_eq!(plain[0], maps);
        preserve_coverage(&mut maps);
        let levels = mips(&maps, AlphaUse::CutOut);
        assert_eq!(levels.iter().map(|l| l.width).collect::<Vec<_>>(), [512, 256, 128, 64, 32, 16, 8, 4, 2, 1]);
        let share = |m: &Maps| coverage(m, 1)[0];
        let off =
            |levels: &[Maps]| levels[1..6].iter().map(|m| (share(m) / share(&maps) - 1.0).abs()).fold(0.0, f32::max);
        assert!(off(&levels) < 0.15 && off(&plain) > 0.2, "{} {}", off(&levels), off(&plain));
        // Beyond those that are made for it, texels are counted.
        let solid = levels[9].color.iter().filter(|c| c[3] >= 128).count();
        assert_eq!(solid, usize::from(share(&maps) >= 0.5));
        assert!(levels[0].color.iter().all(|c| !(120..136).contains(&c[3])));
        assert!(levels.iter().all(|level| level.color.iter().all(|c| !(125..131).contains(&c[3]))));
    }

    #[test]
    fn every_picture_shows_in_mips_of_its_own_what_it_does_at_level_0_and_frames_are_left_alone() {
        // Four pictures of leaves of unlike fullness, 4 by 14 texels.
        let (edge, half) = (256_u32, 128);
        let mut maps = Maps { width: edge, height: edge, ..blots(edge) };
        maps.color.iter_mut().for_each(|c| c[3] = 0);
        for (i, leaves) in [(0_u32, 20_u64), (1, 60), (2, 140), (3, 300)] {
            for leaf in 0..leaves {
                let seed = Seed::new(u64::from(i)).at(leaf);
                let (x, y) = (seed.at(0).range(0.0, 114.0) as u32, seed.at(1).range(0.0, 124.0) as u32);
                for (dx, dy) in (0..14).flat_map(|dx| (0..4).map(move |dy| (dx, dy))) {
                    let at = (i / 2 * half + y + dy) * edge + i % 2 * half + x + dx;
                    maps.color[at as usize][3] = 255;
                }
            }
        }
        let rect = |i: u32, k: u32| Rect {
            x: (i % 2 * half) >> k,
            y: (i / 2 * half) >> k,
            width: half >> k,
            height: half >> k,
        };
        let of = |kind: PictureKind| {
            let pictures: Vec<_> = (0..4).map(|i| (rect(i, 0), kind)).collect();
            mips_of(&maps, AlphaUse::CutOut, &pictures)
        };
        let plain = mips(&maps, AlphaUse::Opaque);
        let shown = |level: &Maps, i: u32, k: u32| {
            let alpha: Vec<u8> = level.color.iter().map(|c| c[3]).collect();
            coverage_in(&alpha, (level.width, level.height), &[(rect(i, k), PictureKind::Card)])[0]
        };
        let levels = of(PictureKind::Card);
        let mut worst = 0.0_f32;
        for (k, i) in (1..=4).flat_map(|k| (0..4).map(move |i| (k, i))) {
            let (was, now) = (shown(&maps, i, 0), shown(&levels[k as usize], i, k));
            worst = worst.max((shown(&plain[k as usize], i, k) / was - 1.0).abs());
            // Alpha is of whole numbers: to a few of the places that are looked at, four a texel.
            let few = 10.0 / (4 * (half >> k) * (half >> k)) as f32;
            assert!((now - was).abs() < few.max(0.03 * was), "{k} {i}: {now} of {was}");
        }
        assert!(worst > 0.4, "{worst}");
        for (level, plain) in of(PictureKind::Frames).iter().zip(&plain).take(5) {
            let moved = level.color.iter().zip(&plain.color).map(|(a, b)| a[3].abs_diff(b[3])).max();
            assert!(moved <= Some(MARGIN), "{moved:?}");
        }
    }

    #[test]
    fn colour_is_averaged_in_linear_light_and_normals_stay_units() {
        let maps = Maps {
            width: 2,
            height: 1,
            color: vec![[0, 0, 0, 255], [255, 255, 255, 255]],
            normal: vec![[218, 128, 218], [38, 128, 218]],
            orm: vec![[0, 100, 0], [100, 200, 0]],
        };
        let last = mips(&maps, AlphaUse::Opaque).pop().unwrap();
        assert_eq!((last.color[0], last.normal[0], last.orm[0]), ([188, 188, 188, 255], [128, 128, 255], [50, 150, 0]));
    }

    #[test]
    fn sides_become_multiples_of_four() {
        for (width, height, wanted) in
            [(8, 4, (8, 4)), (13, 6, (12, 4)), (1, 3, (4, 4)), (2, 9, (4, 8)), (4, 5, (4, 4))]
        {
            let count = (width * height) as usize;
            let maps = Maps {
                width,
                height,
                color: (0..count).map(|i| [i as u8; 4]).collect(),
                normal: vec![[128, 128, 255]; count],
                orm: vec![[1, 2, 3]; count],
            };
            let blocks = to_blocks(&maps);
            assert_eq!((blocks.width, blocks.height), wanted);
            let texels = (wanted.0 * wanted.1) as usize;
            assert_eq!([blocks.color.len(), blocks.normal.len(), blocks.orm.len()], [texels; 3]);
            assert_eq!(blocks.orm[texels - 1], [1, 2, 3]);
        }
        let none = Maps { width: 0, height: 0, color: vec![], normal: vec![], orm: vec![] };
        assert!(mips(&none, AlphaUse::CutOut).is_empty());
    }
}
