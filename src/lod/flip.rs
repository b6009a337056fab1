//! FLIP: how different two pictures look when one takes the other's place (Andersson et al. 2020, "FLIP: a difference
//! evaluator for alternating images"), for pictures of low dynamic range.
//!
//! Colours are blurred as the eye blurs them at [`PIXELS_PER_DEGREE`], compared by their hue-adjusted HyAB distance in
//! L*a*b*, and the result is raised where edges or points differ. Constants are the paper's. Edges of the picture are
//! repeated outwards.

use glam::Vec3;

use crate::base::math;

/// Pixels of a degree of sight: a screen 0.7 m wide of 3840 pixels seen from 0.7 m, as the paper has it.
const PIXELS_PER_DEGREE: f32 = 67.020_64;
/// Exponent of the colour difference, and where its range is bent.
const COLOR: (f32, f32, f32) = (0.7, 0.4, 0.95);
/// Width of the feature detector, degrees, and its exponent.
const FEATURE: (f32, f32) = (0.082, 0.5);
/// White of the standard observer (D65) as sums of the rows of the sRGB matrix.
const WHITE: Vec3 = Vec3::new(0.950_428_55, 1.0, 1.088_900_4);

/// Mean FLIP of two pictures in linear light, 0 for the same, 1 for the farthest apart; values are clamped to 0..=1.
/// Rows of `width` pixels; 0 for pictures of no or unequal size. About 3 µs a pixel.
#[must_use]
pub fn flip(a: &[Vec3], b: &[Vec3], width: usize) -> f32 {
    if width == 0 || a.len() != b.len() || !a.len().is_multiple_of(width) || a.is_empty() {
        return 0.0;
    }
    let (first, second) = (opponent(a), opponent(b));
    let (edges_a, edges_b) = (features(&first, width), features(&second, width));
    let (seen_a, seen_b) = (seen(&first, width), seen(&second, width));
    let most = pow(hyab(hunt(Vec3::Y), hunt(Vec3::Z)), COLOR.0);
    let mut sum = 0.0_f64;
    for i in 0..a.len() {
        let far = pow(hyab(seen_a[i], seen_b[i]), COLOR.0);
        let bend = COLOR.1 * most;
        let color =
            if far < bend { COLOR.2 / bend * far } else { COLOR.2 + (far - bend) / (most - bend) * (1.0 - COLOR.2) };
        let (edge, point) = ((edges_a[i].0 - edges_b[i].0).abs(), (edges_a[i].1 - edges_b[i].1).abs());
        let feature = pow(edge.max(point) * std::f32::consts::FRAC_1_SQRT_2, FEATURE.1);
        sum += f64::from(pow(color.clamp(0.0, 1.0), (1.0 - feature).clamp(0.0, 1.0)));
    }
    (sum / a.len() as f64) as f32
}

fn pow(base: f32, exponent: f32) -> f32 {
    if base <= 0.0 { 0.0 } else { math::pow(base, exponent) }
}

fn xyz(c: Vec3) -> Vec3 {
    Vec3::new(
        Vec3::new(0.412_391, 0.357_584, 0.180_453_5).dot(c),
        Vec3::new(0.212_639, 0.715_168, 0.072_193).dot(c),
        Vec3::new(0.019_330_8, 0.119_193_5, 0.950_376_1).dot(c),
    )
}

fn rgb(c: Vec3) -> Vec3 {
    Vec3::new(
        Vec3::new(3.241_003_3, -1.537_398_9, -0.498_615_9).dot(c),
        Vec3::new(-0.969_224_2, 1.875_93, 0.041_554_22).dot(c),
        Vec3::new(0.055_639_36, -0.204_011_21, 1.057_148_9).dot(c),
    )
}

/// Linear light as Y, Cx, Cz, an opponent space that is linear in light.
fn opponent(picture: &[Vec3]) -> Vec<Vec3> {
    picture
        .iter()
        .map(|&c| {
            let n = xyz(c.clamp(Vec3::ZERO, Vec3::ONE)) / WHITE;
            Vec3::new(116.0 * n.y - 16.0, 500.0 * (n.x - n.y), 200.0 * (n.y - n.z))
        })
        .collect()
}

/// As the eye sees it: blurred by the contrast sensitivity of each channel, in hue-adjusted L*a*b*.
fn seen(picture: &[Vec3], width: usize) -> Vec<Vec3> {
    // Amplitude and width of each channel's Gaussians.
    let gauss = |b: f32| -> Vec<f32> {
        let radius = (3.0 * (0.04_f32 / (2.0 * std::f32::consts::PI * std::f32::consts::PI)).sqrt() * PIXELS_PER_DEGREE)
            .ceil() as i32;
        let at = |x: i32| x as f32 / PIXELS_PER_DEGREE;
        (-radius..=radius)
            .map(|x| math::exp(-std::f32::consts::PI * std::f32::consts::PI * at(x) * at(x) / b))
            .collect()
    };
    let channel = |pick: fn(&Vec3) -> f32, terms: &[(f32, f32)]| -> Vec<f32> {
        let values: Vec<f32> = picture.iter().map(pick).collect();
        let mut sum = vec![0.0_f32; values.len()];
        let mut total = 0.0;
        for &(a, b) in terms {
            let kernel = gauss(b);
            let weight = a * (std::f32::consts::PI / b).sqrt();
            let whole = kernel.iter().sum::<f32>();
            total += weight * whole * whole;
            for (s, v) in sum.iter_mut().zip(across(&down(&values, width, &kernel), width, &kernel)) {
                *s += v * weight;
            }
        }
        sum.iter_mut().for_each(|s| *s /= total);
        sum
    };
    let y = channel(|c| c.x, &[(1.0, 0.0047)]);
    let x = channel(|c| c.y, &[(1.0, 0.0053)]);
    let z = channel(|c| c.z, &[(34.1, 0.04), (13.5, 0.025)]);
    (0..picture.len())
        .map(|i| {
            let level = (y[i] + 16.0) / 116.0;
            hunt(rgb(Vec3::new(level + x[i] / 500.0, level, level - z[i] / 200.0) * WHITE).clamp(Vec3::ZERO, Vec3::ONE))
        })
        .collect()
}

/// L*a*b* of linear light with the Hunt effect: colours are weaker in the dark.
fn hunt(c: Vec3) -> Vec3 {
    let n = xyz(c) / WHITE;
    let f = |t: f32| if t > 0.008_856_452 { math::cbrt(t) } else { t * 7.787_037 + 4.0 / 29.0 };
    let (x, y, z) = (f(n.x), f(n.y), f(n.z));
    let light = 116.0 * y - 16.0;
    Vec3::new(light, 0.01 * light * 500.0 * (x - y), 0.01 * light * 200.0 * (y - z))
}

fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + (d.y * d.y + d.z * d.z).sqrt()
}

/// Strength of edges and of points in the brightness.
fn features(picture: &[Vec3], width: usize) -> Vec<(f32, f32)> {
    let bright: Vec<f32> = picture.iter().map(|c| (c.x + 16.0) / 116.0).collect();
    let sigma = 0.5 * FEATURE.0 * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as i32;
    let bell = |x: i32| math::exp(-((x * x) as f32) / (2.0 * sigma * sigma));
    let normed = |mut kernel: Vec<f32>| {
        let (up, low) =
            kernel.iter().fold((0.0, 0.0), |(p, n), &v: &f32| if v > 0.0 { (p + v, n) } else { (p, n - v) });
        for v in &mut kernel {
            *v /= if *v > 0.0 { up } else { low.max(1e-12) };
        }
        kernel
    };
    let gauss: Vec<f32> = normed((-radius..=radius).map(bell).collect());
    let edge = normed((-radius..=radius).map(|x| -(x as f32) * bell(x)).collect());
    let point = normed((-radius..=radius).map(|x| ((x * x) as f32 / (sigma * sigma) - 1.0) * bell(x)).collect());
    let both = |kernel: &[f32]| {
        let (along_x, along_y) = (
            down(&across(&bright, width, kernel), width, &gauss),
            across(&down(&bright, width, kernel), width, &gauss),
        );
        along_x.iter().zip(&along_y).map(|(x, y)| (x * x + y * y).sqrt()).collect::<Vec<f32>>()
    };
    both(&edge).into_iter().zip(both(&point)).collect()
}

/// Filtered along rows.
fn across(values: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let radius = (kernel.len() / 2) as isize;
    let mut out = vec![0.0; values.len()];
    for (row, to) in values.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        for (x, value) in to.iter_mut().enumerate() {
            for (k, weight) in kernel.iter().enumerate() {
                let from = (x as isize + k as isize - radius).clamp(0, width as isize - 1);
                *value += row[from as usize] * weight;
            }
        }
    }
    out
}

/// Filtered along columns.
fn down(values: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let height = (values.len() / width) as isize;
    let radius = (kernel.len() / 2) as isize;
    let mut out = vec![0.0; values.len()];
    for (y, to) in out.chunks_exact_mut(width).enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let from = (y as isize + k as isize - radius).clamp(0, height - 1) as usize * width;
            for (value, v) in to.iter_mut().zip(&values[from..from + width]) {
                *value += v * weight;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_zero_and_black_on_white_is_one() {
        let (black, white) = (vec![Vec3::ZERO; 400], vec![Vec3::ONE; 400]);
        assert_eq!(flip(&white, &white, 20), 0.0);
        // The paper's own tool gives 0.9661 for it: HyAB of black and white is 100 of 308 at most.
        let far = flip(&black, &white, 20);
        assert!(far > 0.9 && far <= 1.0, "{far}");
        assert!((flip(&white, &black, 20) - far).abs() < 1e-6);
    }

    #[test]
    fn a_small_change_is_small_and_a_larger_one_more() {
        let plain = vec![Vec3::splat(0.3); 900];
        let with = |v: f32| flip(&plain, &[vec![Vec3::splat(v); 450], vec![Vec3::splat(0.3); 450]].concat(), 30);
        let (little, more) = (with(0.32), with(0.5));
        assert!(little > 0.0 && little < 0.1 && more > 2.0 * little, "{little} {more}");
    }

    #[test]
    fn pictures_that_do_not_fit_are_no_difference() {
        assert_eq!(flip(&[], &[], 0), 0.0);
        assert_eq!(flip(&[Vec3::ZERO; 4], &[Vec3::ONE; 6], 2), 0.0);
    }
}
