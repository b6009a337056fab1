//! Colour, normal and material under transparent pixels, so that filtering and mips never mix in a fringe.
//!
//! Push-pull (Gortler et al. 1996, "The Lumigraph", 3.4): averages of the seen pixels go up a pyramid, each empty
//! pixel then takes the nearest level's value that has any. Time and memory are linear in the pixels.
//!
//! A mip of a leaf is the mean of all its texels, whatever their alpha: what lies beyond a few pixels from it is of the colour by
//! which that mean is the leaf's own. With the rims' colours carried on, an oak's leaves whose rims are light were 1.31 times as
//! bright from afar as they are.

use glam::{DVec3, Vec3};

use super::{Maps, srgb};

/// Pixels of less alpha than this count as unseen: what a picture holds there is often a left-over of its editor.
const SEEN: u8 = 8;
/// Pixels of this alpha and more are solid.
const SOLID: u8 = 128;
/// How many pixels around what is seen colours go on as they are.
const NEAR: usize = 3;
/// The colour beyond is so much of the picture's mean at least and at most.
const LEVELLED: (f32, f32) = (0.5, 1.5);
/// Of a picture that comes from elsewhere colours are its own from this alpha on, unless none is as opaque.
const OPAQUE: u8 = 240;
/// Of so many opaque pixels one at least lies among others where a picture's rims are told from the rest.
const FEW: usize = 10;

/// A level of the pyramid: `N` channels.
struct Level<const N: usize> {
    width: usize,
    height: usize,
    values: Vec<[f32; N]>,
    weights: Vec<f32>,
}

/// Fills the colour, normal and ORM of every pixel whose alpha is below 8/255 from the seen pixels around it. Alpha
/// stays as it is, and so does every seen pixel. A picture without any seen pixel is left alone, as is one whose arrays
/// do not match its size.
pub fn dilate(maps: &mut Maps) {
    let count = maps.width as usize * maps.height as usize;
    if maps.color.len() != count || maps.normal.len() != count || maps.orm.len() != count {
        return;
    }
    let values = |i: usize| {
        let (c, n, o) = (maps.color[i], maps.normal[i], maps.orm[i]);
        [c[0], c[1], c[2], n[0], n[1], n[2], o[0], o[1], o[2]].map(f32::from)
    };
    let alphas: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
    let Some(filled) = filled(&alphas, maps.width, maps.height, values) else { return };
    let pixels = maps.color.iter_mut().zip(&mut maps.normal).zip(&mut maps.orm);
    for (((color, normal), orm), v) in pixels.zip(&filled) {
        if color[3] >= SEEN {
            continue;
        }
        for i in 0..3 {
            color[i] = byte(v[i]);
            orm[i] = byte(v[6 + i]);
        }
        *normal = unit_normal([v[3], v[4], v[5]]);
    }
}

/// Gives what is far from anything seen the colour by which the mean of all pixels is that of the solid ones, in linear light: last of
/// all that is done to a leaf's colours.
pub(super) fn keep_mean(color: &mut [[u8; 4]], width: usize) {
    let far = beyond(color, width);
    let linear = |c: &[u8; 4]| Vec3::new(srgb::decode(c[0]), srgb::decode(c[1]), srgb::decode(c[2]));
    let sum = |of: &dyn Fn(usize) -> bool| {
        let of = (0..color.len()).filter(|&i| of(i));
        of.fold((DVec3::ZERO, 0.0), |(sum, count), i| (sum + linear(&color[i]).as_dvec3(), count + 1.0))
    };
    let is_solid = |i: usize| color[i][3] >= SOLID;
    let ((solid, count), (near, near_count)) = (sum(&is_solid), sum(&|i| !is_solid(i) && !far[i]));
    let far_count = color.len() as f64 - count - near_count;
    if count == 0.0 || far_count == 0.0 {
        return;
    }
    let mean = solid / count;
    let wanted = (mean * (near_count + far_count) - near) / far_count;
    let (least, most) = (mean * f64::from(LEVELLED.0), mean * f64::from(LEVELLED.1));
    let [r, g, b] = wanted.clamp(least, most).as_vec3().to_array().map(|c| srgb::encode(c.min(1.0)));
    color.iter_mut().zip(far).filter(|(_, far)| *far).for_each(|(color, _)| *color = [r, g, b, color[3]]);
}

/// Which pixels have none near them that is seen.
fn beyond(color: &[[u8; 4]], width: usize) -> Vec<bool> {
    let spread = |seen: &[bool], step: usize, count: usize| -> Vec<bool> {
        let at = |i: usize| {
            let place = i / step % count;
            let first = i - place.min(NEAR) * step;
            (0..=place.min(NEAR) + NEAR.min(count - 1 - place)).any(|k| seen[first + k * step])
        };
        (0..seen.len()).map(at).collect()
    };
    let seen: Vec<bool> = color.iter().map(|color| color[3] >= SEEN).collect();
    let along = spread(&seen, 1, width.max(1));
    spread(&along, width.max(1), color.len() / width.max(1)).into_iter().map(|near| !near).collect()
}

/// Takes the colours of what is not opaque, and of the outermost pixels of what is, from what lies inside of that; those of what is
/// so slim that nothing does stay. Pictures are cut out of a light ground as a rule, and their rims, and what was carried
/// on from there under the clear, are pale by it: engines mix it into every mip, and trees paled with distance. Normals and
/// material have no ground, and stay.
pub(super) fn clean(maps: &mut Maps) {
    let (width, height) = (maps.width as usize, maps.height as usize);
    if maps.color.len() != width * height {
        return;
    }
    let most = maps.color.iter().map(|color| color[3]).max().unwrap_or(0).min(OPAQUE);
    let opaque: Vec<bool> = maps.color.iter().map(|color| color[3] >= most).collect();
    let around = |i: usize| {
        let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        near(i / width, height).flat_map(move |y| near(i % width, width).map(move |x| y * width + x))
    };
    let inner: Vec<bool> = (0..opaque.len()).map(|i| around(i).all(|k| opaque[k])).collect();
    let count = |of: &[bool]| of.iter().filter(|is| **is).count();
    // Of what is all rims those are what there is.
    let sound = if count(&inner) * FEW < count(&opaque) { &opaque } else { &inner };
    let is_rim = |i: usize| !sound[i] && (!opaque[i] || around(i).any(|k| sound[k]));
    let values = |i: usize| [maps.color[i][0], maps.color[i][1], maps.color[i][2]].map(f32::from);
    let seen: Vec<u8> = sound.iter().map(|&sound| if sound { u8::MAX } else { 0 }).collect();
    let Some(filled) = filled(&seen, maps.width, maps.height, values) else { return };
    for i in (0..opaque.len()).filter(|&i| is_rim(i)) {
        let ([r, g, b], alpha) = (filled[i].map(byte), maps.color[i][3]);
        maps.color[i] = [r, g, b, alpha];
    }
}

/// As [`dilate`], of a picture of colours alone.
pub fn dilate_color(color: &mut [[u8; 4]], width: u32, height: u32) {
    if color.len() != width as usize * height as usize {
        return;
    }
    let alphas: Vec<u8> = color.iter().map(|c| c[3]).collect();
    let values = |i: usize| [color[i][0], color[i][1], color[i][2]].map(f32::from);
    let Some(filled) = filled(&alphas, width, height, values) else { return };
    for (color, v) in color.iter_mut().zip(&filled).filter(|(color, _)| color[3] < SEEN) {
        *color = [byte(v[0]), byte(v[1]), byte(v[2]), color[3]];
    }
}

/// As [`dilate`], of normals and material alone, by the alpha of a picture's pixels.
pub(crate) fn dilate_relief(alphas: &[u8], normal: &mut [[u8; 3]], orm: &mut [[u8; 3]], (width, height): (u32, u32)) {
    let count = width as usize * height as usize;
    if [alphas.len(), normal.len(), orm.len()] != [count; 3] {
        return;
    }
    let values = |i: usize| {
        let (n, o) = (normal[i], orm[i]);
        [n[0], n[1], n[2], o[0], o[1], o[2]].map(f32::from)
    };
    let Some(filled) = filled(alphas, width, height, values) else { return };
    let pixels = normal.iter_mut().zip(orm).zip(alphas).zip(&filled);
    for (((normal, orm), _), v) in pixels.filter(|((_, alpha), _)| **alpha < SEEN) {
        *normal = unit_normal([v[0], v[1], v[2]]);
        *orm = [byte(v[3]), byte(v[4]), byte(v[5])];
    }
}

fn byte(x: f32) -> u8 {
    (x + 0.5).clamp(0.0, 255.0) as u8
}

/// The channels of all pixels, those of unseen ones from what is seen around them; none where nothing is to be filled or
/// there is nothing to fill it from.
pub(crate) fn filled<const N: usize>(
    alphas: &[u8],
    width: u32,
    height: u32,
    channels: impl Fn(usize) -> [f32; N],
) -> Option<Vec<[f32; N]>> {
    has_holes(alphas).then(|| filled_over(alphas, width, height, (0..alphas.len()).map(channels).collect()))
}

/// Whether some pixels are unseen, and some not.
fn has_holes(alphas: &[u8]) -> bool {
    let seen = alphas.iter().filter(|alpha| **alpha >= SEEN).count();
    seen != 0 && seen != alphas.len()
}

/// As [`filled`], of channels that are given; as they are where nothing is to be filled.
pub(super) fn filled_over<const N: usize>(
    alphas: &[u8],
    width: u32,
    height: u32,
    values: Vec<[f32; N]>,
) -> Vec<[f32; N]> {
    if !has_holes(alphas) {
        return values;
    }
    let weights = alphas.iter().map(|&alpha| if alpha < SEEN { 0.0 } else { f32::from(alpha) / 255.0 }).collect();
    let mut levels = vec![Level { width: width as usize, height: height as usize, values, weights }];
    // What has no hole needs nothing from coarser levels.
    while let Some(next) = levels.last().filter(|l| l.weights.contains(&0.0)).map(push) {
        levels.push(next);
    }
    let coarsest = levels.pop().expect("there is one");
    let down = |coarse: Level<N>, mut fine: Level<N>| {
        pull(&coarse, &mut fine);
        fine
    };
    levels.into_iter().rev().fold(coarsest, down).values
}

/// The level of half the size: averages by weight.
fn push<const N: usize>(fine: &Level<N>) -> Level<N> {
    let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    let mut values = vec![[0.0; N]; width * height];
    let mut weights = vec![0.0; width * height];
    for y in 0..fine.height {
        for x in 0..fine.width {
            let (from, to) = (y * fine.width + x, y / 2 * width + x / 2);
            let weight = fine.weights[from];
            if weight > 0.0 {
                for (sum, value) in values[to].iter_mut().zip(fine.values[from]) {
                    *sum += value * weight;
                }
                weights[to] += weight;
            }
        }
    }
    for (value, weight) in values.iter_mut().zip(&mut weights) {
        if *weight > 0.0 {
            for channel in value {
                *channel /= *weight;
            }
            *weight = weight.min(1.0);
        }
    }
    Level { width, height, values, weights }
}

/// Fills the empty pixels of `fine` from `coarse`, whose pixels all have a value, bilinearly.
fn pull<const N: usize>(coarse: &Level<N>, fine: &mut Level<N>) {
    for y in 0..fine.height {
        // A fine pixel's centre lies a quarter of a coarse pixel from its parent's.
        let y0 = y / 2;
        let y1 = if y % 2 == 0 { y0.saturating_sub(1) } else { (y0 + 1).min(coarse.height - 1) };
        for x in 0..fine.width {
            let at = y * fine.width + x;
            if fine.weights[at] > 0.0 {
                continue;
            }
            let x0 = x / 2;
            let x1 = if x % 2 == 0 { x0.saturating_sub(1) } else { (x0 + 1).min(coarse.width - 1) };
            let corners = [(x0, y0, 0.5625), (x1, y0, 0.1875), (x0, y1, 0.1875), (x1, y1, 0.0625)];
            let mut value = [0.0; N];
            for (cx, cy, weight) in corners {
                for (sum, v) in value.iter_mut().zip(coarse.values[cy * coarse.width + cx]) {
                    *sum += v * weight;
                }
            }
            fine.values[at] = value;
        }
    }
}

/// An averaged normal, in bytes about 128, made unit length again; straight up where it cancels out.
fn unit_normal(v: [f32; 3]) -> [u8; 3] {
    let n = v.map(|c| c - 128.0);
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    if length < 1.0 {
        return [128, 128, 255];
    }
    n.map(|c| (c / length * 127.0 + 128.5).clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32, seen: impl Fn(u32, u32) -> bool) -> Maps {
        let mut maps = Maps { width, height, color: vec![], normal: vec![], orm: vec![] };
        for y in 0..height {
            for x in 0..width {
                let on = seen(x, y);
                maps.color.push(if on { [60, 90, 30, 255] } else { [0; 4] });
                maps.normal.push(if on { [128, 218, 218] } else { [0; 3] });
                maps.orm.push(if on { [255, 150, 0] } else { [0; 3] });
            }
        }
        maps
    }

    #[test]
    fn every_unseen_pixel_takes_the_seen_colour_and_alpha_stays() {
        for (w, h) in [(1, 7), (16, 16), (13, 5), (33, 64)] {
            let mut maps = picture(w, h, |x, y| (x, y) == (w / 2, h / 2));
            let alpha: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
            dilate(&mut maps);
            assert!(maps.color.iter().all(|c| c[..3] == [60, 90, 30]), "{w}x{h}");
            assert!(maps.normal.iter().all(|n| n[1] >= 217 && n[2] >= 217), "{w}x{h}");
            assert!(maps.orm.iter().all(|o| *o == [255, 150, 0]));
            assert_eq!(alpha, maps.color.iter().map(|c| c[3]).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_mean_of_a_leaf_and_its_ground_is_the_leafs() {
        // Dark within and light at the rim, which is what lies beside the ground.
        let inside = |x: u32, y: u32, by: u32| (64 + by..192 - by).contains(&x) && (64 + by..192 - by).contains(&y);
        let mut maps = picture(256, 256, |x, y| inside(x, y, 0));
        for (i, color) in maps.color.iter_mut().enumerate() {
            let (x, y) = (i as u32 % 256, i as u32 / 256);
            if inside(x, y, 0) && !inside(x, y, 8) {
                *color = [130, 200, 60, 255];
            }
        }
        dilate(&mut maps);
        keep_mean(&mut maps.color, 256);
        let linear = |of: &dyn Fn(&[u8; 4]) -> bool| {
            let all: Vec<f32> = maps.color.iter().filter(|c| of(c)).map(|c| srgb::decode(c[1])).collect();
            all.iter().sum::<f32>() / all.len() as f32
        };
        let (all, leaf) = (linear(&|_| true), linear(&|c| c[3] > 0));
        assert!((all / leaf - 1.0).abs() < 0.02, "{all} {leaf}");
        // Beside the leaf what is near goes on.
        let (beside, far) = (maps.color[128 * 256 + 62], maps.color[128 * 256 + 50]);
        assert!(beside[1] > far[1] + 20, "{beside:?} {far:?}");
    }

    #[test]
    fn relief_alone_is_what_it_is_beside_colours() {
        let mut maps = picture(21, 34, |x, y| x * y % 7 == 3);
        let noise = |i: usize, k: usize| [i * 7 + k, i * 13 + k, i * 29 + k].map(|v| (v % 256) as u8);
        maps.normal.iter_mut().enumerate().for_each(|(i, n)| *n = noise(i, 1));
        maps.orm.iter_mut().enumerate().for_each(|(i, o)| *o = noise(i, 2));
        let alphas: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
        let (mut normal, mut orm) = (maps.normal.clone(), maps.orm.clone());
        dilate_relief(&alphas, &mut normal, &mut orm, (21, 34));
        assert!(normal != maps.normal && orm != maps.orm);
        dilate(&mut maps);
        assert!(normal == maps.normal && orm == maps.orm);
    }

    #[test]
    fn a_pale_edge_takes_the_colour_of_what_it_is_the_edge_of() {
        let mut maps = picture(32, 32, |x, y| (8..24).contains(&x) && (8..24).contains(&y));
        let rim = |i: usize| (7..25).contains(&(i % 32)) && (7..25).contains(&(i / 32));
        let edge: Vec<usize> = (0..32 * 32).filter(|&i| rim(i) && maps.color[i][3] == 0).collect();
        for &i in &edge {
            // Opaque at the sides.
            let is_side = (9..23).contains(&(i / 32));
            maps.color[i] = [230, 230, 220, if is_side { 255 } else { 100 }];
            maps.normal[i] = [9, 128, 200];
        }
        let before = maps.clone();
        clean(&mut maps);
        assert!(edge.len() > 60 && maps.color.iter().all(|c| c[..3] == [60, 90, 30]));
        assert!(maps.normal == before.normal && maps.color.iter().zip(&before.color).all(|(a, b)| a[3] == b[3]));
        // What is nowhere opaque is as opaque as it gets.
        let mut ghost = before;
        ghost.color.iter_mut().for_each(|c| c[3] = c[3].min(100));
        clean(&mut ghost);
        assert!(ghost.color.iter().all(|c| c[..3] == [60, 90, 30]));
    }

    #[test]
    fn seen_pixels_do_not_change() {
        let before = picture(20, 20, |x, y| (x + y) % 3 == 0);
        let mut after = before.clone();
        dilate(&mut after);
        for (a, b) in before.color.iter().zip(&after.color) {
            assert!(a[3] == 0 || a == b);
        }
    }

    #[test]
    fn an_empty_picture_or_a_broken_one_is_left_alone() {
        for mut maps in
            [picture(4, 4, |_, _| false), picture(0, 0, |_, _| true), Maps { width: 9, ..picture(2, 2, |_, _| true) }]
        {
            let before = maps.clone();
            dilate(&mut maps);
            assert_eq!(before, maps);
        }
    }
}
