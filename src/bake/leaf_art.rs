//! Pictures of foliage: a spray of leaves, drawn flat with veins, relief, shadow between the blades and what they let
//! through (`transmission`).
//!
//! Each row is drawn alone, front to back, with exact coverage (`coverage`), so rows run in parallel and the time is
//! linear in the pixels. Occlusion between blades comes from the unsharp-masked depth picture (Luft, Colditz and Deussen
//! 2006, "Image Enhancement by Unsharp Masking the Depth Buffer"). Colours are mixed in linear light.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::coverage::cover_row;
use super::dilate::{filled_over, keep_mean};
use super::dye::{self, Dye, Packed};
use super::leaf_veins::relief;
use super::noise::{Noise, mix};
use super::spray::{Growth, Part, Spray, Tissue, covered, half_width, spray};
use super::transmission::{behind, of_blade, of_part, shaded};
use super::{Maps, dilate, srgb};
use crate::base::{Seed, math};
use crate::preset::plan::LeafShape;

/// Smallest and largest edge of a made picture, pixels.
const SIZES: (u32, u32) = (16, 4096);

/// How many sprays are drawn by lot for a picture, the best of which is taken, and how often its leaves are counted anew.
const TRIES: u64 = 8;
const ROUNDS: usize = 5;
/// How far what a picture's spray covers may be off.
const CLOSE: f32 = 0.03;
/// How much lighter the tip of a shoot is than its base.
const YOUNG: f32 = 0.9;

/// One pixel while it is drawn; all but `alpha` are multiplied by it.
#[derive(Clone, Copy, Default)]
struct Texel {
    color: Dye,
    normal: Vec3,
    rough: f32,
    depth: f32,
    through: f32,
    alpha: f32,
}

/// The maps of one picture of a species' foliage: a twig end with several leaves (for conifers shoots with needles). The
/// twig's base stands at the bottom centre of the picture (u = 0.5, v = 1), its tip near the top edge.
///
/// `color` is linear, 0..=1; `variation` 0..=1 scales how much hue and brightness differ between pictures, blades and
/// places of a blade; `size` is the edge in pixels, clamped to 16..=4096; `picture` chooses one of any number of
/// sprays below `seed`. Alpha is anti-aliased and covers 20 to 50 % of the picture; colour, normal and ORM go on under
/// it. Time is linear in the pixels.
#[must_use]
pub fn leaf_maps(shape: LeafShape, color: [f32; 3], variation: f32, size: u32, picture: u32, seed: Seed) -> Maps {
    LeafPicture::new(shape, variation, size, picture, seed).dyed(color)
}

/// A picture of foliage before its tint is chosen: what takes time is the same for all tints.
#[derive(Clone, Debug)]
pub struct LeafPicture {
    /// Without colours, but with their alpha.
    maps: Maps,
    /// Of every pixel.
    dyes: Vec<Packed>,
}

impl LeafPicture {
    /// Draws a picture; parameters as of [`leaf_maps`].
    #[must_use]
    pub fn new(shape: LeafShape, variation: f32, size: u32, picture: u32, seed: Seed) -> Self {
        let size = size.clamp(SIZES.0, SIZES.1);
        let variation = if variation.is_finite() { variation.clamp(0.0, 1.0) } else { 0.0 };
        let seed = seed.child("leaf picture").at(u64::from(picture));
        let scene = filled_spray(shape, seed);
        let brush = Brush::new(shape, variation, size, seed);
        let outlines: Vec<Outline> = scene.parts.iter().map(|p| pixels(&p.outline, size)).collect();
        let mut texels = vec![Texel::default(); (size * size) as usize];
        let rows = texels.par_chunks_exact_mut(size as usize).enumerate();
        rows.for_each(|(y, row)| brush.row(&scene, &outlines, y as u32, row));
        finish(texels, size as usize)
    }

    /// The maps in a linear colour, 0..=1. About 20 ns a pixel.
    #[must_use]
    pub fn dyed(&self, color: [f32; 3]) -> Maps {
        let tint = Vec3::from_array(color.map(|c| if c.is_finite() { c.clamp(0.0, 1.0) } else { 0.0 }));
        let pixel = |(pixel, dye): (&[u8; 4], &Packed)| {
            let [r, g, b] = dye::dyed(dye, tint).to_array().map(srgb::encode);
            [r, g, b, pixel[3]]
        };
        let Maps { width, height, color, normal, orm } = &self.maps;
        let mut color: Vec<[u8; 4]> = color.par_iter().zip(&self.dyes).with_min_len(4096).map(pixel).collect();
        keep_mean(&mut color, *width as usize);
        Maps { width: *width, height: *height, color, normal: normal.clone(), orm: orm.clone() }
    }

    /// Bytes that it takes, about.
    #[must_use]
    pub fn weight(&self) -> usize {
        self.dyes.len() * (10 + size_of::<Packed>())
    }
}

/// A spray as its picture would show it.
struct Drawn {
    seed: Seed,
    scene: Spray,
    /// Share of the picture.
    covers: f32,
    /// How far it is from what is wanted; 0 is best.
    miss: f32,
}

/// A spray that fills the picture and covers about as much of it as its species' should: the nearest of some that are drawn
/// by lot, with more leaves or fewer. Their size may change by little: enlarged until a spray is full, they read as one
/// broad leaf.
fn filled_spray(shape: LeafShape, seed: Seed) -> Spray {
    let wanted = covered(shape);
    let draw = |seed: Seed, growth: Growth| {
        let scene = spray(shape, seed, growth);
        let covers = coverage(&scene);
        Drawn { miss: (covers - wanted).abs() + 0.3 * (1.0 - scene.filled), seed, scene, covers }
    };
    let nearer = |a: Drawn, b: Drawn| if b.miss < a.miss { b } else { a };
    let mut growth = Growth::default();
    let lot = |i: u64| draw(seed.child("try").at(i), growth);
    let mut best = (1..TRIES).map(lot).fold(lot(0), nearer);
    let seed = best.seed;
    let (mut covers, mut filled) = (best.covers, best.scene.filled);
    for _ in 0..ROUNDS {
        if (covers - wanted).abs() < CLOSE && filled > 0.97 {
            break;
        }
        growth = growth.towards(shape, wanted / covers.max(0.05), filled);
        let next = draw(seed, growth);
        (covers, filled) = (next.covers, next.scene.filled);
        best = nearer(best, next);
    }
    best.scene
}

/// Share of the picture that the scene covers, measured on 64 rows.
fn coverage(scene: &Spray) -> f32 {
    const ROWS: u32 = 64;
    let outlines: Vec<Outline> = scene.parts.iter().map(|p| pixels(&p.outline, ROWS)).collect();
    let mut sum = 0.0;
    let mut crossings = Vec::new();
    for y in 0..ROWS {
        let mut open = [1.0_f32; ROWS as usize];
        for outline in outlines.iter().filter(|o| o.rows.contains(&y)) {
            let mut row = [0.0_f32; ROWS as usize];
            for x in cover_row(&outline.points, y, &mut row, &mut crossings) {
                open[x] *= 1.0 - row[x].min(1.0);
            }
        }
        sum += open.iter().map(|o| 1.0 - o).sum::<f32>();
    }
    sum / (ROWS * ROWS) as f32
}

/// An outline in pixels, and the rows that it touches.
struct Outline {
    points: Vec<Vec2>,
    rows: std::ops::RangeInclusive<u32>,
}

fn pixels(outline: &[Vec2], size: u32) -> Outline {
    let edge = size as f32;
    let points: Vec<Vec2> = outline.iter().map(|p| Vec2::new((p.x + 0.5) * edge, (1.0 - p.y) * edge)).collect();
    let (low, high) = points.iter().fold((edge, 0.0_f32), |(l, h), p| (l.min(p.y), h.max(p.y)));
    Outline { points, rows: low.max(0.0) as u32..=high as u32 }
}

/// What all rows of a picture share.
struct Brush {
    shape: LeafShape,
    color: Dye,
    variation: f32,
    size: u32,
    mottle: Noise,
    /// Address of the picture.
    seed: Seed,
}

/// Colour, normal, roughness and transmission of a part at a place.
struct Shade {
    color: Dye,
    normal: Vec3,
    rough: f32,
    through: f32,
}

impl Brush {
    fn new(shape: LeafShape, variation: f32, size: u32, seed: Seed) -> Self {
        let color = Dye::TINT.map(tint(seed.child("hue"), 0.5 * variation));
        Self { shape, color, variation, size, mottle: Noise::new(seed.child("mottle"), 4096, 4096), seed }
    }

    /// Draws onto an empty row.
    fn row(&self, scene: &Spray, outlines: &[Outline], y: u32, row: &mut [Texel]) {
        let edge = self.size as f32;
        let mut cover = vec![0.0_f32; self.size as usize];
        let mut crossings = Vec::new();
        // What parts before leave free.
        let mut open = vec![1.0_f32; self.size as usize];
        // What of the light from behind comes to the parts in front.
        let mut left = vec![1.0_f32; self.size as usize];
        for (part, outline) in scene.parts.iter().zip(outlines).rev() {
            if !outline.rows.contains(&y) {
                continue;
            }
            let touched = cover_row(&outline.points, y, &mut cover, &mut crossings);
            // Shoots stay apart in mips, where single blades run together.
            let light = 1.0 + YOUNG * self.variation * (part.young - 0.5);
            let own = tint(part.seed.child("tint"), self.variation);
            let blade_color = self.color.map(|color| own(color) * light);
            for x in touched {
                let alpha = std::mem::take(&mut cover[x]).min(1.0);
                let share = alpha * open[x];
                left[x] *= 1.0 - alpha * (1.0 - open[x]) * (1.0 - behind(part.tissue));
                if share <= 0.0 {
                    continue;
                }
                let at = Vec2::new((x as f32 + 0.5) / edge - 0.5, 1.0 - (y as f32 + 0.5) / edge);
                let shade = self.shade(part, blade_color, at);
                let texel = &mut row[x];
                texel.color.add(shade.color, share);
                texel.normal += shade.normal * share;
                texel.rough += shade.rough * share;
                texel.depth += part.depth * share;
                texel.alpha += share;
                texel.through += shade.through * share;
                open[x] *= 1.0 - alpha;
            }
        }
        row.iter_mut().zip(left).for_each(|(texel, left)| texel.through *= shaded(left));
    }

    fn shade(&self, part: &Part, color: Dye, at: Vec2) -> Shade {
        let p = part.place.to_part(at);
        match part.tissue {
            Tissue::Blade | Tissue::Underside => self.blade(part, color, p),
            Tissue::Petiole | Tissue::Wood | Tissue::Needle => self.rod(part, color, p),
        }
    }

    fn blade(&self, part: &Part, color: Dye, p: Vec2) -> Shade {
        let under = part.tissue == Tissue::Underside;
        let step = 1.0 / (self.size as f32 * part.place.length);
        let here = relief(self.shape, p.x, p.y, step);
        let sx = (relief(self.shape, p.x + step, p.y, step).height - here.height) / step;
        let sy = (relief(self.shape, p.x, p.y + step, step).height - here.height) / step;
        let sense = if under { -0.7 } else { 1.0 };
        // The blade arches down to its tip and its margins.
        let width = half_width(self.shape).max(0.05);
        // The fold is a pixel or two wide: a hard one would show as a saw.
        let side = mix(part.slope[1], part.slope[2], math::smoothstep(-1.5 * step, 1.5 * step, p.x));
        let gx = side - 0.35 * p.x / width + sense * sx;
        let gy = part.slope[0] - 0.5 * (p.y - 0.4) + sense * sy;
        let slope = part.place.across() * gx + part.place.along * gy;
        let slope = slope * (1.0 / (1.0 + 0.35 * slope.length()));
        let normal = Vec3::new(-slope.x, -slope.y, 1.0).normalize();

        let offset = 97.0 * part.seed.child("offset").unit();
        let coarse = self.mottle.gradient(p.x * 5.0 + offset, p.y * 5.0 + offset);
        let fine = self.mottle.gradient(p.x * 34.0 + offset, p.y * 34.0 - offset);
        let mut tone = 1.0 + self.variation * (0.22 * coarse + 0.14 * fine);
        // Margins are thinner and lighter, the base darker.
        tone *= 0.9 + 0.16 * (p.x.abs() / width).min(1.0) + 0.06 * p.y;
        // Furrows hold a little shadow and flanks that face the sky some light: it survives where maps are not read.
        tone *= 1.0 + (0.16 * (normal.y - 0.1) - 0.1 * normal.x).clamp(-0.22, 0.22);
        let yellow = (0.5 + 0.5 * coarse) * self.variation * 0.35 * math::smoothstep(0.5, 1.1, p.x.abs() / width);
        // Towards warmer margins, then towards light veins.
        let vein = here.vein * 0.75;
        let warmer = Vec3::ONE.lerp(Vec3::new(1.5, 1.15, 0.8), yellow) * tone;
        let lighter = warmer * Vec3::ONE.lerp(Vec3::new(1.75, 1.5, 1.35), vein);
        let mut base = color.map(|c| c * lighter).plus(Vec3::new(0.018, 0.022, 0.008) * vein);
        if under {
            base = base.map(|c| {
                let grey = c.dot(Vec3::new(0.3, 0.6, 0.1));
                c.lerp(Vec3::new(grey, grey, grey * 0.8), 0.35) * 1.45
            });
        }
        let rough = if under { 0.82 } else { 0.7 + 0.07 * fine + 0.08 * here.vein };
        let through = of_blade(self.shape, here.vein, p.x.abs() / width);
        Shade { color: base, normal, rough: rough.clamp(0.55, 0.88), through }
    }

    fn rod(&self, part: &Part, color: Dye, p: Vec2) -> Shade {
        let radius = mix(part.radius[0], part.radius[1], p.y.clamp(0.0, 1.0)).max(1e-5);
        let c = (p.x / radius).clamp(-0.95, 0.95);
        let up = (1.0 - c * c).sqrt();
        let n = part.place.across() * c - part.place.along * (0.4 * part.slope[0]);
        let normal = Vec3::new(n.x, n.y, up.max(0.3)).normalize();
        let streak = self.mottle.gradient(p.x / radius * 0.8, p.y * 40.0);
        let lit = 0.72 + 0.34 * up;
        let (color, rough) = match part.tissue {
            Tissue::Wood => (Dye::fast(self.wood() * (1.0 + 0.25 * streak)), 0.8),
            Tissue::Petiole => (color.map(|c| c * Vec3::new(1.5, 1.2, 0.9)).plus(Vec3::new(0.012, 0.006, 0.002)), 0.6),
            _ => {
                // Needles are paler at the sheath and yellow at the very tip.
                let tip = math::smoothstep(0.85, 1.0, p.y);
                let change = Vec3::ONE.lerp(Vec3::new(1.7, 1.25, 0.8), 0.5 * tip) * (0.8 + 0.35 * p.y);
                (color.map(|c| c * change), 0.72)
            }
        };
        let through = of_part(self.shape, part.tissue);
        Shade { color: color.map(|c| c * lit), normal, rough, through }
    }

    /// Colour of the twig, linear.
    fn wood(&self) -> Vec3 {
        let base = match self.shape {
            LeafShape::Linden | LeafShape::Elm => Vec3::new(0.090, 0.060, 0.045),
            LeafShape::Poplar | LeafShape::Olive => Vec3::new(0.120, 0.105, 0.075),
            LeafShape::Oak | LeafShape::Ash | LeafShape::Palm => Vec3::new(0.105, 0.090, 0.062),
            LeafShape::Birch => Vec3::new(0.075, 0.042, 0.028),
            LeafShape::Beech => Vec3::new(0.085, 0.063, 0.045),
            LeafShape::Maple => Vec3::new(0.095, 0.058, 0.036),
            LeafShape::Willow => Vec3::new(0.13, 0.105, 0.040),
            LeafShape::Pine | LeafShape::Spruce | LeafShape::Cypress => Vec3::new(0.125, 0.075, 0.038),
        };
        tint(self.seed.child("wood"), 0.4)(base)
    }
}

/// Makes colours warmer or cooler, lighter or darker by a seed; `strength` 0..=1.
fn tint(seed: Seed, strength: f32) -> impl Fn(Vec3) -> Vec3 {
    let warm = strength * seed.at(0).range(-0.24, 0.24);
    let light = 1.0 + strength * seed.at(1).range(-0.3, 0.3);
    let dull = 0.25 * strength * seed.at(2).unit();
    move |color| {
        let grey = color.dot(Vec3::new(0.25, 0.65, 0.1));
        (color * Vec3::new(1.0 + warm, 1.0 + 0.25 * warm, 1.0 - 0.5 * warm)).lerp(Vec3::splat(grey), dull) * light
    }
}

/// Occlusion from depth, then bytes; all goes on under clear pixels. What is read for the last time is let go: at 4096 texels an edge
/// each array takes half a gigabyte or more.
fn finish(texels: Vec<Texel>, size: usize) -> LeafPicture {
    let reach = (size / 26).max(1);
    let mut depth: Vec<f32> = texels.iter().map(|t| t.depth).collect();
    let mut alpha: Vec<f32> = texels.iter().map(|t| t.alpha).collect();
    for _ in 0..2 {
        blur(&mut depth, size, reach);
        blur(&mut alpha, size, reach);
    }
    let byte = |x: f32| (x * 255.0 + 0.5).clamp(0.0, 255.0) as u8;
    let pixel = |(i, texel): (usize, &Texel)| {
        if texel.alpha <= 0.0 {
            return (([0; 4], [128, 128, 255], [255, 153, 0]), [0.0; 12]);
        }
        let over = 1.0 / texel.alpha;
        // In front of the place lies, on average, this much of the picture's depth.
        let front = depth[i] / alpha[i].max(1e-3) - texel.depth * over;
        let crowd = math::smoothstep(0.35, 1.0, alpha[i]);
        let open = (1.0 - 1.5 * front.max(0.0) - 0.18 * crowd).clamp(0.3, 1.0);
        let light = over * (0.45 + 0.55 * open) * (1.0 + 0.25 * (-front).clamp(0.0, 0.3));
        let [r, g, b, plain] = texel.color.columns.map(|c| (c * light).to_array());
        let dye = std::array::from_fn(|k| [r, g, b, plain][k / 3][k % 3]);
        let orm = [open, texel.rough * over, texel.through * over].map(byte);
        (([0, 0, 0, byte(texel.alpha)], encode_normal(texel.normal), orm), dye)
    };
    let (pixels, dyes): (Vec<_>, Vec<[f32; 12]>) = texels.par_iter().enumerate().map(pixel).unzip();
    drop((texels, depth, alpha));
    let mut maps = Maps::square(size as u32, &pixels);
    drop(pixels);
    let alphas: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
    let dyes = filled_over(&alphas, maps.width, maps.height, dyes);
    dilate(&mut maps);
    LeafPicture { maps, dyes: dyes.into_iter().map(dye::packed).collect() }
}

/// A direction, not of unit length, as the bytes of a normal map.
pub(super) fn encode_normal(n: Vec3) -> [u8; 3] {
    let n = n.try_normalize().unwrap_or(Vec3::Z) * 127.0;
    [n.x, n.y, n.z].map(|c| (c + 128.5).clamp(0.0, 255.0) as u8)
}

/// One pass of a box filter of `2 * reach + 1` pixels both ways over a square picture, by running sums; what lies
/// outside is zero.
fn blur(values: &mut [f32], size: usize, reach: usize) {
    let scale = 1.0 / (2 * reach + 1) as f32;
    values.par_chunks_mut(size).for_each(|row| {
        let source = row.to_vec();
        let mut sum: f32 = source.iter().take(reach).sum();
        for x in 0..size {
            sum += source.get(x + reach).copied().unwrap_or(0.0);
            row[x] = sum.max(0.0) * scale;
            if x >= reach {
                sum -= source[x - reach];
            }
        }
    });
    let source = values.to_vec();
    let mut sums = vec![0.0_f32; size];
    for row in source.chunks(size).take(reach) {
        for (sum, v) in sums.iter_mut().zip(row) {
            *sum += v;
        }
    }
    for y in 0..size {
        if y + reach < size {
            for (sum, v) in sums.iter_mut().zip(&source[(y + reach) * size..]) {
                *sum += v;
            }
        }
        for (out, sum) in values[y * size..].iter_mut().zip(&sums) {
            *out = sum.max(0.0) * scale;
        }
        if y >= reach {
            for (sum, v) in sums.iter_mut().zip(&source[(y - reach) * size..]) {
                *sum -= v;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::spray_span;
    use crate::base::Key;

    const GREEN: [f32; 3] = [0.061, 0.114, 0.021];

    #[test]
    fn pictures_are_golden() {
        let keys = LeafShape::ALL.map(|shape| {
            let maps = leaf_maps(shape, GREEN, 0.5, 64, 0, Seed::new(41));
            let mut bytes: Vec<u8> = maps.color.iter().flatten().copied().collect();
            bytes.extend(maps.normal.iter().chain(&maps.orm).flatten());
            Key::of_bytes(&bytes).to_hex()[..8].to_owned()
        });
        assert_eq!(
            keys.concat(),
            "b719ace7db43815af524d4cdd940b3d836e2f0f99d865330e9a4cfd3d860e1ed64b020154432547519fde2a262d61ca95648ca7ede2de02f"
        );
    }

    #[test]
    fn another_tint_changes_colours_alone_and_in_proportion() {
        for shape in LeafShape::ALL {
            let picture = LeafPicture::new(shape, 0.5, 64, 0, Seed::new(41));
            let [dark, middle, light] = [0.02, 0.08, 0.14].map(|g| picture.dyed([0.06, g, 0.02]));
            assert_eq!((&dark.normal, &dark.orm), (&light.normal, &light.orm), "{shape:?}");
            let mut changed = 0;
            for ((a, b), c) in dark.color.iter().zip(&middle.color).zip(&light.color) {
                assert_eq!(a[3], c[3]);
                let [low, between, high] = [a, b, c].map(|c| srgb::decode(c[1]));
                assert!((between - 0.5 * (low + high)).abs() < 0.012, "{shape:?} {a:?} {b:?} {c:?}");
                changed += usize::from(high > low + 0.02);
            }
            assert!(changed > dark.color.len() / 2, "{shape:?} {changed}");
        }
    }

    #[test]
    fn alpha_covers_a_fifth_to_a_half_of_every_picture() {
        for shape in LeafShape::ALL {
            for picture in 0..6 {
                let maps = leaf_maps(shape, GREEN, 0.5, 64, picture, Seed::new(9));
                let share = maps.color.iter().map(|c| f32::from(c[3])).sum::<f32>() / (255.0 * 64.0 * 64.0);
                assert!((0.2..0.5).contains(&share), "{shape:?} {picture}: {share}");
            }
        }
    }

    #[test]
    fn every_picture_spans_as_many_leaves_as_told_and_shows_a_twig_of_many() {
        // Of ash, conifers and palm the picture is the leaf.
        for shape in LeafShape::ALL.into_iter().filter(|&shape| spray_span(shape) > 1.0) {
            let (mut blades, mut lengths) = (0, 0.0);
            for picture in 0..6 {
                let scene = filled_spray(shape, Seed::new(41).child("leaf picture").at(picture));
                let found = scene.parts.iter().filter(|part| matches!(part.tissue, Tissue::Blade | Tissue::Underside));
                let own: Vec<f32> = found.map(|blade| blade.place.length).collect();
                let (count, sum) = (own.len(), own.iter().sum::<f32>());
                let span = count as f32 / sum;
                assert!((span / spray_span(shape) - 1.0).abs() < 0.2, "{shape:?} {picture} {span}");
                (blades, lengths) = (blades + count, lengths + sum);
            }
            let span = blades as f32 / lengths;
            assert!((span / spray_span(shape) - 1.0).abs() < 0.05, "{shape:?} {span}");
            assert!(blades > 6 * 30, "{shape:?} {blades}");
        }
    }

    #[test]
    fn nothing_under_alpha_is_black_and_every_normal_is_unit() {
        for shape in LeafShape::ALL {
            let maps = leaf_maps(shape, GREEN, 0.5, 64, 1, Seed::new(2));
            assert!(maps.color.iter().all(|c| c[1] > 20), "{shape:?}");
            for n in &maps.normal {
                let v = n.map(|c| (f32::from(c) - 128.0) / 127.0);
                let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
                assert!((length - 1.0).abs() < 0.02, "{shape:?} {n:?}");
            }
        }
    }

    #[test]
    fn the_twig_stands_at_the_bottom_centre_and_the_border_stays_free() {
        for shape in LeafShape::ALL {
            let maps = leaf_maps(shape, GREEN, 0.5, 128, 0, Seed::new(4));
            let seen = |x: usize, y: usize| maps.color[y * 128 + x][3] > 100;
            assert!((60..68).any(|x| seen(x, 126)), "{shape:?}");
            assert!((0..128).all(|y| !seen(0, y) && !seen(127, y)) && (0..128).all(|x| !seen(x, 0)), "{shape:?}");
            assert!((0..128).any(|x| (0..20).any(|y| seen(x, y))), "{shape:?} leaves the top empty");
        }
    }

    #[test]
    fn odd_parameters_make_a_picture_all_the_same() {
        let maps = leaf_maps(LeafShape::Oak, [f32::NAN, 7.0, -1.0], f32::INFINITY, 0, u32::MAX, Seed::new(1));
        assert_eq!((maps.width, maps.color.len()), (16, 256));
    }

    #[test]
    fn pictures_differ_from_one_another() {
        let picture = |n| leaf_maps(LeafShape::Beech, GREEN, 0.5, 32, n, Seed::new(1));
        assert_ne!(picture(0), picture(1));
        assert_eq!(picture(1), picture(1));
    }
}
