//! Shrinking a material's maps by an exact area filter that respects alpha.
//!
//! Colour is averaged in linear light and, like the other maps, weighted by alpha, so that what lies under transparent
//! texels does not bleed in; a weight of 1/1024 is left to them, so that wholly transparent places keep their dilated
//! colour. Alpha is the plain average.

use rayon::prelude::*;

use super::Maps;

/// `maps` at another, not larger size; both sides at least 1.
pub(super) fn shrink(maps: &Maps, width: u32, height: u32) -> Maps {
    let tables = Srgb::new();
    let columns: Vec<Vec<(usize, f32)>> = (0..width).map(|x| taps(x, width, maps.width)).collect();
    let rows: Vec<Vec<Texel>> = (0..height)
        .into_par_iter()
        .map(|y| {
            let lines = taps(y, height, maps.height);
            columns.iter().map(|columns| texel(maps, &lines, columns, &tables)).collect()
        })
        .collect();
    let mut out = Maps { width, height, color: Vec::new(), normal: Vec::new(), orm: Vec::new() };
    for texel in rows.into_iter().flatten() {
        out.color.push(texel.0);
        out.normal.push(texel.1);
        out.orm.push(texel.2);
    }
    out
}

type Texel = ([u8; 4], [u8; 3], [u8; 3]);

/// Source texels that the `i`-th of `to` covers, with the shares of their areas; the shares add up to 1.
fn taps(i: u32, to: u32, from: u32) -> Vec<(usize, f32)> {
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

fn texel(maps: &Maps, lines: &[(usize, f32)], columns: &[(usize, f32)], tables: &Srgb) -> Texel {
    let (mut color, mut normal, mut orm) = ([0.0_f32; 3], [0.0_f32; 3], [0.0_f32; 3]);
    let (mut alpha, mut weight) = (0.0_f32, 0.0_f32);
    for &(y, wy) in lines {
        for &(x, wx) in columns {
            let i = y * maps.width as usize + x;
            let a = f32::from(maps.color[i][3]);
            alpha += wx * wy * a;
            let w = wx * wy * (a / 255.0 + 1.0 / 1024.0);
            weight += w;
            for k in 0..3 {
                color[k] += w * tables.linear[usize::from(maps.color[i][k])];
                normal[k] += w * (f32::from(maps.normal[i][k]) - 128.0);
                orm[k] += w * f32::from(maps.orm[i][k]);
            }
        }
    }
    let byte = |v: f32| (v + 0.5) as u8;
    let [r, g, b] = color.map(|c| tables.encode(c / weight));
    let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
    let normal =
        if length > 0.0 { normal.map(|n| byte((n / length * 127.0 + 128.0).max(0.0))) } else { [128, 128, 255] };
    ([r, g, b, byte(alpha)], normal, orm.map(|v| byte(v / weight)))
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
