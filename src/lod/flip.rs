//! FLIP: how different two pictures look when one takes the other's place (Andersson et al. 2020, "FLIP: a difference
//! evaluator for alternating images"), for pictures of low dynamic range.
//!
//! Colours are blurred as the eye blurs them at [`PIXELS_PER_DEGREE`], compared by their hue-adjusted HyAB distance in
//! L*a*b*, and the result is raised where edges or points differ. Constants are the paper's. Edges of the picture are
//! repeated outwards.

use std::ops::Range;

use glam::Vec3;

use crate::base::math;

/// Pixels of a degree of sight: a screen 0.7 m wide of 3840 pixels seen from 0.7 m, as the paper has it.
const PIXELS_PER_DEGREE: f32 = 67.020_64;
/// Exponent of the colour difference, and where its range is bent.
const COLOR: (f32, f32, f32) = (0.7, 0.4, 0.95);
/// Width of the feature detector, degrees.
const FEATURE: f32 = 0.082;
/// The least that a blur's weight is worth, of its greatest.
const NOTHING: f32 = 1e-7;
/// White of the standard observer (D65) as sums of the rows of the sRGB matrix.
const WHITE: Vec3 = Vec3::new(0.950_428_55, 1.0, 1.088_900_4);

/// Mean FLIP of two pictures in linear light, 0 for the same, 1 for the farthest apart; values are clamped to 0..=1.
/// Rows of `width` pixels; 0 for pictures of no or unequal size. Only the part that differs is looked at, with what the
/// filters reach; about 0.3 µs a pixel of it.
#[must_use]
pub fn flip(a: &[Vec3], b: &[Vec3], width: usize) -> f32 {
    if width == 0 || a.len() != b.len() || !a.len().is_multiple_of(width) || a.is_empty() {
        return 0.0;
    }
    let kernels = Kernels::new();
    let Some(part) = differing(a, b, width, 2 * kernels.reach) else { return 0.0 };
    let cut = |picture: &[Vec3]| -> Vec<Vec3> {
        part.1.clone().flat_map(|y| &picture[y * width..][part.0.clone()]).copied().collect()
    };
    let wide = part.0.len();
    let both = |picture: &[Vec3]| {
        let picture = opponent(&cut(picture));
        (kernels.features(&picture, wide), kernels.seen(&picture, wide))
    };
    let ((edges_a, seen_a), (edges_b, seen_b)) = rayon::join(|| both(a), || both(b));
    let most = pow(hyab(hunt(Vec3::Y), hunt(Vec3::Z)), COLOR.0);
    let mut sum = 0.0_f64;
    for i in 0..seen_a.len() {
        // Where colours are the same features count nothing.
        if seen_a[i] == seen_b[i] {
            continue;
        }
        let far = pow(hyab(seen_a[i], seen_b[i]), COLOR.0);
        let bend = COLOR.1 * most;
        let color =
            if far < bend { COLOR.2 / bend * far } else { COLOR.2 + (far - bend) / (most - bend) * (1.0 - COLOR.2) };
        let (edge, point) = ((edges_a[i].0 - edges_b[i].0).abs(), (edges_a[i].1 - edges_b[i].1).abs());
        // The paper's exponent of features is a half.
        let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
        sum += f64::from(pow(color.clamp(0.0, 1.0), (1.0 - feature).clamp(0.0, 1.0)));
    }
    (sum / a.len() as f64) as f32
}

/// Columns and rows.
type Part = (Range<usize>, Range<usize>);

/// The part of two pictures that holds all that differs, and `around` pixels more where there are so many: beyond, all is
/// the same, and so is what filters make of it.
fn differing(a: &[Vec3], b: &[Vec3], width: usize, around: usize) -> Option<Part> {
    let height = a.len() / width;
    let (mut columns, mut rows) = (width..0, height..0);
    for (y, (p, q)) in a.chunks_exact(width).zip(b.chunks_exact(width)).enumerate() {
        let differs = |x: &usize| p[*x] != q[*x];
        let Some(first) = (0..width).find(differs) else { continue };
        let last = (first..width).rev().find(differs).unwrap_or(first);
        columns = columns.start.min(first)..columns.end.max(last + 1);
        rows = rows.start.min(y)..y + 1;
    }
    let wider = |r: Range<usize>, size: usize| r.start.saturating_sub(around)..(r.end + around).min(size);
    (!columns.is_empty()).then(|| (wider(columns, width), wider(rows, height)))
}

fn pow(base: f32, exponent: f32) -> f32 {
    if base <= 0.0 {
        0.0
    } else if exponent == 1.0 {
        base
    } else {
        math::pow(base, exponent)
    }
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

/// What pictures are filtered by.
struct Kernels {
    /// Half the width of the widest.
    reach: usize,
    /// For each channel its Gaussians, each with what its result counts.
    channels: [Vec<(Vec<f32>, f32)>; 3],
    bell: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Kernels {
    fn new() -> Self {
        use std::f32::consts::PI;
        let radius = (3.0 * (0.04_f32 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
        let gauss = |b: f32| -> Vec<f32> {
            let at = |x: i32| x as f32 / PIXELS_PER_DEGREE;
            let bell = |x: i32| math::exp(-PI * PI * at(x) * at(x) / b);
            // Of the narrow ones most would be multiplied by nothing that a sum of floats can tell.
            let reach = (0..=radius).take_while(|&x| bell(x) > NOTHING).last().unwrap_or(0);
            (-reach..=reach).map(bell).collect()
        };
        // Amplitude and width of each channel's Gaussians.
        let channel = |terms: &[(f32, f32)]| -> Vec<(Vec<f32>, f32)> {
            let mut made: Vec<(Vec<f32>, f32)> = terms.iter().map(|&(a, b)| (gauss(b), a * (PI / b).sqrt())).collect();
            let total: f32 = made.iter().map(|(k, w)| w * k.iter().sum::<f32>() * k.iter().sum::<f32>()).sum();
            made.iter_mut().for_each(|term| term.1 /= total);
            made
        };
        let channels = [channel(&[(1.0, 0.0047)]), channel(&[(1.0, 0.0053)]), channel(&[(34.1, 0.04), (13.5, 0.025)])];
        let sigma = 0.5 * FEATURE * PIXELS_PER_DEGREE;
        let wide = (3.0 * sigma).ceil() as i32;
        let bell = |x: i32| math::exp(-((x * x) as f32) / (2.0 * sigma * sigma));
        let normed = |mut kernel: Vec<f32>| {
            let (up, low) =
                kernel.iter().fold((0.0, 0.0), |(p, n), &v: &f32| if v > 0.0 { (p + v, n) } else { (p, n - v) });
            for v in &mut kernel {
                *v /= if *v > 0.0 { up } else { low.max(1e-12) };
            }
            kernel
        };
        Self {
            reach: radius.max(wide) as usize,
            channels,
            bell: normed((-wide..=wide).map(bell).collect()),
            edge: normed((-wide..=wide).map(|x| -(x as f32) * bell(x)).collect()),
            point: normed((-wide..=wide).map(|x| ((x * x) as f32 / (sigma * sigma) - 1.0) * bell(x)).collect()),
        }
    }

    /// As the eye sees it: blurred by the contrast sensitivity of each channel, in hue-adjusted L*a*b*.
    fn seen(&self, picture: &[Vec3], width: usize) -> Vec<Vec3> {
        let channel = |pick: fn(&Vec3) -> f32, terms: &[(Vec<f32>, f32)]| -> Vec<f32> {
            let values: Vec<f32> = picture.iter().map(pick).collect();
            let mut sum = vec![0.0_f32; values.len()];
            for (kernel, weight) in terms {
                for (s, v) in sum.iter_mut().zip(across(&down(&values, width, kernel), width, kernel)) {
                    *s += v * weight;
                }
            }
            sum
        };
        let y = channel(|c| c.x, &self.channels[0]);
        let x = channel(|c| c.y, &self.channels[1]);
        let z = channel(|c| c.z, &self.channels[2]);
        // Sky is the same for many pixels, one beside the other.
        let (mut before, mut made) = ([f32::NAN; 3], Vec3::ZERO);
        (0..picture.len())
            .map(|i| {
                let of = [x[i], y[i], z[i]];
                if of != before {
                    let level = (y[i] + 16.0) / 116.0;
                    let n = Vec3::new(level + x[i] / 500.0, level, level - z[i] / 200.0);
                    (before, made) = (of, hunt(rgb(n * WHITE).clamp(Vec3::ZERO, Vec3::ONE)));
                }
                made
            })
            .collect()
    }

    /// Strength of edges and of points in the brightness.
    fn features(&self, picture: &[Vec3], width: usize) -> Vec<(f32, f32)> {
        let bright: Vec<f32> = picture.iter().map(|c| (c.x + 16.0) / 116.0).collect();
        let (smooth_x, smooth_y) = (across(&bright, width, &self.bell), down(&bright, width, &self.bell));
        let both = |kernel: &[f32]| {
            let (along_x, along_y) = (across(&smooth_y, width, kernel), down(&smooth_x, width, kernel));
            along_x.iter().zip(&along_y).map(|(x, y)| (x * x + y * y).sqrt()).collect::<Vec<f32>>()
        };
        both(&self.edge).into_iter().zip(both(&self.point)).collect()
    }
}

/// Adds rows, each by its tap of a kernel, in their order; four at a time, so that sums stay where they are added up.
fn add_taps<'v>(sums: &mut [f32], kernel: &[f32], row: impl Fn(usize) -> &'v [f32]) {
    let (fours, rest) = kernel.as_chunks::<4>();
    for (i, [a, b, c, d]) in fours.iter().enumerate() {
        let rows = [0, 1, 2, 3].map(|k| row(4 * i + k));
        let values = rows[0].iter().zip(rows[1]).zip(rows[2]).zip(rows[3]);
        for (sum, (((p, q), r), s)) in sums.iter_mut().zip(values) {
            *sum = *sum + p * a + q * b + r * c + s * d;
        }
    }
    for (k, weight) in rest.iter().enumerate() {
        for (sum, v) in sums.iter_mut().zip(row(4 * fours.len() + k)) {
            *sum += v * weight;
        }
    }
}

/// Filtered along rows.
fn across(values: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0; values.len()];
    let mut padded = vec![0.0; width + 2 * radius];
    for (row, to) in values.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        padded[..radius].fill(row[0]);
        padded[radius..radius + width].copy_from_slice(row);
        padded[radius + width..].fill(row[width - 1]);
        add_taps(to, kernel, |k| &padded[k..k + width]);
    }
    out
}

/// Filtered along columns.
fn down(values: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let height = (values.len() / width) as isize;
    let radius = (kernel.len() / 2) as isize;
    let mut out = vec![0.0; values.len()];
    for (y, to) in out.chunks_exact_mut(width).enumerate() {
        add_taps(to, kernel, |k| {
            let from = (y as isize + k as isize - radius).clamp(0, height - 1) as usize * width;
            &values[from..from + width]
        });
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
    fn only_what_differs_counts_however_large_the_sky() {
        // A blot on a plain picture: the sum over all pixels stays when more sky is put around.
        let with = |width: usize, at: usize| {
            let mut b = vec![Vec3::splat(0.3); width * width];
            for k in 0..9 {
                b[(at + k / 3) * width + at + k % 3] = Vec3::new(0.6, 0.1, 0.2);
            }
            f64::from(flip(&vec![Vec3::splat(0.3); width * width], &b, width)) * (width * width) as f64
        };
        let (small, large) = (with(60, 28), with(140, 70));
        assert!(small > 1.0 && (small / large - 1.0).abs() < 1e-4, "{small} {large}");
    }

    #[test]
    fn taps_are_added_in_their_order_however_many() {
        let values: Vec<f32> = (0..90).map(|i| crate::base::Seed::new(2).at(i).unit()).collect();
        for count in 0..10 {
            let kernel: Vec<f32> = (0..count).map(|k| 0.3 + k as f32).collect();
            let mut sums = [0.5; 9];
            add_taps(&mut sums, &kernel, |k| &values[9 * k..9 * k + 9]);
            for (x, sum) in sums.iter().enumerate() {
                assert_eq!(*sum, kernel.iter().enumerate().fold(0.5, |sum, (k, tap)| sum + values[9 * k + x] * tap));
            }
        }
    }

    #[test]
    fn pictures_that_do_not_fit_are_no_difference() {
        assert_eq!(flip(&[], &[], 0), 0.0);
        assert_eq!(flip(&[Vec3::ZERO; 4], &[Vec3::ONE; 6], 2), 0.0);
    }
}
