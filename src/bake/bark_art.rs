//! Tiling maps of bark: colour, normal and material out of one height field.
//!
//! Heights come from `bark_height`; normals are their central differences across the tile's edge, occlusion is how far
//! a place lies below the mean of its surroundings (two box passes, wrapped), as in Luft, Colditz and Deussen 2006.
//! Linear in the pixels; rows run in parallel.

use glam::Vec3;
use rayon::prelude::*;

use super::bark_height::{Bark, Spot};
use super::leaf_art::encode_normal;
use super::{Maps, srgb};
use crate::base::Seed;
use crate::preset::plan::BarkPattern;

/// Smallest and largest edge of made bark, pixels.
const SIZES: (u32, u32) = (16, 8192);

/// The maps of a tile of bark that repeats without a seam both ways; u runs around the trunk, v along it (down in the
/// picture). `color` is that of the ridges, linear 0..=1; `size` is the edge in pixels, clamped to 16..=8192. Alpha is
/// 255 everywhere. Time is linear in the pixels.
#[must_use]
pub fn bark_maps(pattern: BarkPattern, color: [f32; 3], size: u32, seed: Seed) -> Maps {
    let size = size.clamp(SIZES.0, SIZES.1) as usize;
    let bark = Bark::new(pattern, seed.child("bark picture"));
    let color = Vec3::from_array(color.map(|c| if c.is_finite() { c.clamp(0.0, 1.0) } else { 0.0 }));
    let at = |i: usize| (i as f32 + 0.5) / size as f32;
    let rows: Vec<Vec<Spot>> = (0..size).into_par_iter().map(|y| bark.row(at(y), size)).collect();
    let spots: Vec<Spot> = rows.concat();
    let heights: Vec<f32> = spots.iter().map(|s| s.height).collect();
    let reach = (size / 40).max(1);
    let mut around = heights.clone();
    for _ in 0..2 {
        around = blurred(&around, size, reach);
    }
    // Heights are shares of the depth, the depth a share of the tile: slopes come out in pixels over pixels.
    let scale = 0.5 * bark.depth() * size as f32;
    let relief = bark.depth() * 40.0;
    let pixels: Vec<([u8; 4], [u8; 3], [u8; 3])> = spots
        .par_iter()
        .enumerate()
        .map(|(i, spot)| {
            let (x, y) = (i % size, i / size);
            let (left, right) = ((x + size - 1) % size, (x + 1) % size);
            let (up, down) = ((y + size - 1) % size, (y + 1) % size);
            let dx = (heights[y * size + right] - heights[y * size + left]) * scale;
            let dy = (heights[up * size + x] - heights[down * size + x]) * scale;
            let below = (around[i] - spot.height).max(0.0);
            let open = (1.0 - relief.min(1.2) * 1.3 * below).clamp(0.25, 1.0);
            let tone = spot.tone.max(Vec3::splat(0.02)) * (0.6 + 0.4 * open);
            let rgb = color * tone;
            let byte = |v: f32| (v * 255.0 + 0.5).clamp(0.0, 255.0) as u8;
            (
                [srgb::encode(rgb.x), srgb::encode(rgb.y), srgb::encode(rgb.z), 255],
                encode_normal(Vec3::new(-dx, -dy, 1.0)),
                [byte(open), byte(spot.rough.clamp(0.3, 1.0)), 0],
            )
        })
        .collect();
    Maps::square(size as u32, &pixels)
}

/// A box filter of `2 * reach + 1` pixels both ways over a square tile that wraps, by running sums.
fn blurred(values: &[f32], size: usize, reach: usize) -> Vec<f32> {
    let scale = 1.0 / (2 * reach + 1) as f32;
    let rows: Vec<Vec<f32>> = values
        .par_chunks(size)
        .map(|row| {
            let mut sum: f32 = (0..2 * reach + 1).map(|k| row[(k + size - reach) % size]).sum();
            (0..size)
                .map(|x| {
                    let mean = sum * scale;
                    sum += row[(x + reach + 1) % size] - row[(x + size - reach) % size];
                    mean
                })
                .collect()
        })
        .collect();
    let mut sums = vec![0.0_f32; size];
    for k in 0..2 * reach + 1 {
        for (sum, v) in sums.iter_mut().zip(&rows[(k + size - reach) % size]) {
            *sum += v;
        }
    }
    let mut out = Vec::with_capacity(size * size);
    for y in 0..size {
        out.extend(sums.iter().map(|s| s * scale));
        let (enter, leave) = (&rows[(y + reach + 1) % size], &rows[(y + size - reach) % size]);
        for ((sum, a), b) in sums.iter_mut().zip(enter).zip(leave) {
            *sum += a - b;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Key;

    const PATTERNS: [BarkPattern; 6] = [
        BarkPattern::Furrowed,
        BarkPattern::Papery,
        BarkPattern::Plated,
        BarkPattern::Smooth,
        BarkPattern::Fibrous,
        BarkPattern::Ringed,
    ];

    fn difference(maps: &Maps, a: (u32, u32), b: (u32, u32)) -> i64 {
        let at = |(x, y): (u32, u32)| (y * maps.width + x) as usize;
        let (p, q) = (at(a), at(b));
        let color: i64 = (0..3).map(|k| i64::from(maps.color[p][k].abs_diff(maps.color[q][k]))).sum();
        let normal: i64 = (0..3).map(|k| i64::from(maps.normal[p][k].abs_diff(maps.normal[q][k]))).sum();
        color + normal
    }

    #[test]
    fn tiles_have_no_seam_either_way() {
        for pattern in PATTERNS {
            let size = 128;
            let maps = bark_maps(pattern, [0.2, 0.16, 0.12], size, Seed::new(7));
            let column = |a: u32, b: u32| (0..size).map(|y| difference(&maps, (a, y), (b, y))).sum::<i64>();
            let row = |a: u32, b: u32| (0..size).map(|x| difference(&maps, (x, a), (x, b))).sum::<i64>();
            let most_column = (0..size - 1).map(|x| column(x, x + 1)).max().unwrap();
            let most_row = (0..size - 1).map(|y| row(y, y + 1)).max().unwrap();
            assert!(column(size - 1, 0) <= most_column, "{pattern:?}");
            assert!(row(size - 1, 0) <= most_row, "{pattern:?}");
        }
    }

    #[test]
    fn normals_are_unit_and_point_outwards() {
        for pattern in PATTERNS {
            for n in bark_maps(pattern, [0.2; 3], 64, Seed::new(1)).normal {
                let v = n.map(|c| (f32::from(c) - 128.0) / 127.0);
                let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
                assert!((length - 1.0).abs() < 0.02 && v[2] > 0.0, "{pattern:?} {n:?}");
            }
        }
    }

    #[test]
    fn pictures_are_golden() {
        let keys = PATTERNS.map(|pattern| key(&bark_maps(pattern, [0.2, 0.16, 0.12], 64, Seed::new(41))));
        assert_eq!(keys[..5].concat(), "8e987bd8f1f5b5f799b340238d7a4988ac2c25f8");
    }

    fn key(maps: &Maps) -> String {
        let mut bytes: Vec<u8> = maps.color.iter().flatten().copied().collect();
        bytes.extend(maps.normal.iter().chain(&maps.orm).flatten());
        Key::of_bytes(&bytes).to_hex()[..8].to_owned()
    }

    #[test]
    fn odd_parameters_make_a_picture_all_the_same() {
        let maps = bark_maps(BarkPattern::Plated, [f32::NAN, -3.0, 9.0], 0, Seed::new(1));
        assert_eq!((maps.width, maps.color.len()), (16, 256));
    }

    #[test]
    fn a_wrapped_blur_keeps_the_mean() {
        let values: Vec<f32> = (0..64).map(|i| ((i * 37) % 11) as f32).collect();
        let mean = |v: &[f32]| v.iter().sum::<f32>() / v.len() as f32;
        assert!((mean(&blurred(&values, 8, 2)) - mean(&values)).abs() < 1e-3);
    }
}
