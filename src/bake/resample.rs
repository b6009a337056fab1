//! Resampling a material's maps with respect to alpha: smaller by an exact area filter, larger linearly between texels.
//!
//! Colour is averaged in linear light and, like the other maps, weighted by alpha, so that what lies under transparent
//! texels does not bleed in; a weight of 1/1024 is left to them, so that wholly transparent places keep their dilated
//! colour. Alpha is the plain average.

use rayon::prelude::*;

use super::Maps;
use super::atlas::{Picked, Relief};

/// `maps` at another size; both sides at least 1.
pub(super) fn resample(maps: &Maps, width: u32, height: u32) -> Maps {
    let picked = maps.into();
    let ((normal, orm), color) =
        rayon::join(|| resample_relief(&picked, width, height), || resample_color(&picked, width, height));
    Maps { width, height, color, normal, orm }
}

/// The colour of a picture at another size.
pub(super) fn resample_color(from: &Picked<'_>, width: u32, height: u32) -> Vec<[u8; 4]> {
    let tables = Srgb::new();
    resampled(from, (width, height), |i, w, sum: &mut [f32; 3]| {
        for (sum, c) in sum.iter_mut().zip(from.color[i]) {
            *sum += w * tables.linear[usize::from(c)];
        }
    })
    .into_iter()
    .map(|(sum, alpha)| {
        let [r, g, b] = sum.map(|c| tables.encode(c));
        [r, g, b, (alpha + 0.5) as u8]
    })
    .collect()
}

/// Normals and material of a picture at another size.
pub(super) fn resample_relief(from: &Picked<'_>, width: u32, height: u32) -> Relief {
    let byte = |v: f32| (v + 0.5) as u8;
    resampled(from, (width, height), |i, w, sum: &mut [f32; 6]| {
        for k in 0..3 {
            sum[k] += w * (f32::from(from.normal[i][k]) - 128.0);
            sum[k + 3] += w * f32::from(from.orm[i][k]);
        }
    })
    .into_iter()
    .map(|([x, y, z, o, r, m], _)| {
        let length = (x * x + y * y + z * z).sqrt();
        let normal =
            if length > 0.0 { [x, y, z].map(|n| byte((n / length * 127.0 + 128.0).max(0.0))) } else { [128, 128, 255] };
        (normal, [o, r, m].map(byte))
    })
    .unzip()
}

/// Means by area and alpha of what `add` sums at each source texel, and the mean alpha.
fn resampled<const N: usize>(
    from: &Picked<'_>,
    (width, height): (u32, u32),
    add: impl Fn(usize, f32, &mut [f32; N]) + Sync,
) -> Vec<([f32; N], f32)> {
    let columns: Vec<Vec<(usize, f32)>> = (0..width).map(|x| taps(x, width, from.width)).collect();
    (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let lines = taps(y, height, from.height);
            let (add, columns) = (&add, &columns);
            columns.iter().map(move |columns| {
                let (mut sum, mut alpha, mut weight) = ([0.0_f32; N], 0.0_f32, 0.0_f32);
                for &(y, wy) in &lines {
                    for &(x, wx) in columns {
                        let i = y * from.width as usize + x;
                        let a = f32::from(from.color[i][3]);
                        alpha += wx * wy * a;
                        let w = wx * wy * (a / 255.0 + 1.0 / 1024.0);
                        weight += w;
                        add(i, w, &mut sum);
                    }
                }
                (sum.map(|s| s / weight), alpha)
            })
        })
        .collect()
}

/// Source texels that the `i`-th of `to` covers, with the shares of their areas, or the two about its middle where it is less
/// than one of them; the shares add up to 1.
fn taps(i: u32, to: u32, from: u32) -> Vec<(usize, f32)> {
    if to > from {
        let middle = (f64::from(i) + 0.5) * f64::from(from) / f64::from(to) - 0.5;
        let (left, right) = (middle.max(0.0) as usize, from as usize - 1);
        let share = (middle - left as f64).clamp(0.0, 1.0) as f32;
        return vec![(left, 1.0 - share), ((left + 1).min(right), share)];
    }
    // In units of 1 / to of a source texel, so that the ends are whole numbers.
    let (to, from) = (u64::from(to), u64::from(from));
    let (low, high) = (u64::from(i) * from, (u64::from(i) + 1) * from);
    (low / to..high.div_ceil(to))
        .map(|t| {
            let share = ((t + 1) * to).min(high) - (t * to).max(low);
            (t as usize, share as f32 / from as f32)
        })
        .collect()
}

/// sRGB's transfer function as tables.
struct Srgb {
    linear: Vec<f32>,
    /// Linear value from which on the next byte is nearer.
    next: Vec<f32>,
}

impl Srgb {
    fn new() -> Self {
        let linear: Vec<f32> = (0..=255).map(super::srgb::decode).collect();
        let next = linear.windows(2).map(|p| (p[0] + p[1]) * 0.5).collect();
        Self { linear, next }
    }

    fn encode(&self, value: f32) -> u8 {
        self.next.partition_point(|&n| n <= value) as u8
    }
}
