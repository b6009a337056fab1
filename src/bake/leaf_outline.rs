//! The outlines of single leaf blades, one a species, each a little different by its seed.
//!
//! Blade space: the petiole ends at the origin, the tip lies at (0, 1), x runs across. Pinnate blades are an envelope
//! `t^a (1 - t)^b` with lobes or teeth cut along the direction of the side veins; the palmate blade is drawn by its
//! points. Terms: Hickey 1973, "Classification of the architecture of dicotyledonous leaves".

use glam::Vec2;

use crate::base::{Seed, math};
use crate::preset::plan::LeafShape;

/// Proportions of a pinnate blade.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pinnate {
    /// Half the blade's width over its length.
    pub(super) half_width: f32,
    /// Exponents of the envelope at base and tip; their share a / (a + b) is where the blade is widest.
    base: f32,
    tip: f32,
    /// Side veins on each side.
    pub(super) veins: f32,
    /// Rise of a side vein over its run across the blade.
    pub(super) slope: f32,
    /// How much side veins bend towards the tip, per half width squared.
    pub(super) arch: f32,
    margin: Margin,
}

#[derive(Clone, Copy, Debug)]
enum Margin {
    /// Rounded lobes, one a side vein, cut to this share of the half width.
    Lobed(f32),
    /// Large teeth, one a side vein, with `fine` small ones on each; depths over the blade's length.
    Serrate { coarse: f32, small: f32, fine: f32 },
    /// Waves of this depth over the blade's length.
    Entire(f32),
}

/// The proportions of a shape's blade or, for a compound leaf, of a leaflet. Maple and pine have none of their own and
/// get the beech's.
pub(super) fn pinnate(shape: LeafShape) -> Pinnate {
    let form = |half_width, base, tip, veins, slope, arch, margin| Pinnate {
        half_width,
        base,
        tip,
        veins,
        slope,
        arch,
        margin,
    };
    match shape {
        LeafShape::Oak => form(0.33, 0.95, 0.5, 4.0, 0.5, 0.0, Margin::Lobed(0.5)),
        LeafShape::Birch => {
            form(0.37, 0.45, 1.05, 7.0, 0.75, 0.0, Margin::Serrate { coarse: 0.028, small: 0.013, fine: 3.0 })
        }
        LeafShape::Willow => {
            form(0.078, 0.7, 0.95, 12.0, 0.9, 2.0, Margin::Serrate { coarse: 0.0, small: 0.0035, fine: 3.0 })
        }
        LeafShape::Ash => {
            form(0.17, 0.65, 0.95, 8.0, 0.8, 1.2, Margin::Serrate { coarse: 0.004, small: 0.006, fine: 2.0 })
        }
        LeafShape::Linden => {
            form(0.45, 0.34, 0.95, 7.0, 0.7, 0.1, Margin::Serrate { coarse: 0.016, small: 0.009, fine: 2.0 })
        }
        LeafShape::Poplar => {
            form(0.46, 0.3, 1.3, 6.0, 0.6, 0.1, Margin::Serrate { coarse: 0.012, small: 0.008, fine: 2.0 })
        }
        LeafShape::Elm => {
            form(0.31, 0.55, 0.8, 12.0, 0.9, 0.1, Margin::Serrate { coarse: 0.026, small: 0.012, fine: 2.0 })
        }
        LeafShape::Olive => form(0.11, 0.75, 0.8, 7.0, 0.6, 0.6, Margin::Entire(0.002)),
        LeafShape::Palm => form(0.05, 0.4, 0.8, 6.0, 6.0, 0.0, Margin::Entire(0.0)),
        LeafShape::Beech | LeafShape::Maple | LeafShape::Pine | LeafShape::Spruce | LeafShape::Cypress => {
            form(0.3, 0.62, 0.75, 8.0, 0.8, 0.25, Margin::Entire(0.008))
        }
    }
}

/// The right half of the palmate blade: x, y, and whether the point is a sinus that stays where it is.
const PALMATE: [(f32, f32); 21] = [
    (0.09, -0.05),
    (0.21, -0.10),
    (0.40, -0.13),
    (0.37, -0.05),
    (0.29, 0.05),
    (0.40, 0.07),
    (0.53, 0.10),
    (0.50, 0.19),
    (0.66, 0.28),
    (0.60, 0.34),
    (0.70, 0.50),
    (0.54, 0.46),
    (0.49, 0.55),
    (0.40, 0.46),
    (0.17, 0.36),
    (0.20, 0.52),
    (0.33, 0.63),
    (0.22, 0.66),
    (0.20, 0.77),
    (0.11, 0.80),
    (0.06, 0.90),
];

/// Directions of the palmate blade's main veins to the right of the middle one: where they end.
pub(super) const PALMATE_VEINS: [Vec2; 2] = [Vec2::new(0.70, 0.50), Vec2::new(0.40, -0.13)];

/// Points on each side of a pinnate blade: enough for its teeth or lobes at the size that sprays show it.
const fn side_points(shape: LeafShape) -> usize {
    match shape {
        LeafShape::Birch | LeafShape::Elm => 150,
        LeafShape::Willow | LeafShape::Ash => 60,
        LeafShape::Palm => 24,
        _ => 96,
    }
}

/// The closed outline of one blade in blade space, counter-clockwise from its base: up to about 300 points.
pub(super) fn outline(shape: LeafShape, seed: Seed) -> Vec<Vec2> {
    let side = |name: &str, sign: f32| -> Vec<Vec2> {
        let seed = seed.child(name);
        let points = if shape == LeafShape::Maple { palmate_side(seed) } else { pinnate_side(shape, sign, seed) };
        points.into_iter().map(|p| Vec2::new(p.x * sign, p.y)).collect()
    };
    let mut points = vec![Vec2::ZERO];
    points.extend(side("right", 1.0));
    points.push(Vec2::new(0.0, 1.0));
    points.extend(side("left", -1.0).into_iter().rev());
    points
}

fn pinnate_side(shape: LeafShape, sign: f32, seed: Seed) -> Vec<Vec2> {
    let form = pinnate(shape);
    let peak = form.base / (form.base + form.tip);
    let top = math::pow(peak, form.base) * math::pow(1.0 - peak, form.tip);
    let width = form.half_width * seed.child("width").range(0.93, 1.07);
    let wave = seed.child("wave").range(0.0, std::f32::consts::TAU);
    let count = side_points(shape);
    (1..count)
        .map(|i| {
            // Denser at both ends, where the envelope turns.
            let t = 0.5 - 0.5 * math::cos(i as f32 / count as f32 * std::f32::consts::PI);
            let mut x = width * math::pow(t, form.base) * math::pow(1.0 - t, form.tip) / top;
            let mut y = t;
            let phase = vein_phase(form, sign, x, y);
            let share = (x / width).clamp(0.0, 1.0);
            match form.margin {
                Margin::Lobed(depth) => {
                    let lobe = phase.floor();
                    let vary = seed.child("lobe").at((lobe as i32 + 64) as u64).range(0.85, 1.1);
                    // 0 in the middle of a lobe, 1 in the sinus: broad round lobes, narrower round sinuses.
                    let across = 2.0 * (phase - lobe) - 1.0;
                    let round = across * across;
                    let cut = depth * vary * round * (0.15 + 0.85 * round) * math::smoothstep(0.1, 0.45, share);
                    // The last lobe of all stands at the tip and is cut less.
                    let cut = cut * (1.0 - 0.8 * math::smoothstep(0.9, 1.0, t));
                    y -= cut * x * form.slope;
                    x -= cut * x;
                }
                Margin::Serrate { coarse, small, fine } => {
                    // Saw teeth that rise slowly and break off on the side of the tip.
                    let tooth = |p: f32| p - p.floor();
                    let big = tooth(phase);
                    let out = (coarse * big + small * tooth(phase * fine)) * math::smoothstep(0.06, 0.2, t);
                    let out = out * (1.0 - math::smoothstep(0.8, 1.0, t));
                    x += out;
                    y += out * 0.7;
                }
                Margin::Entire(depth) => {
                    x += depth * math::sin(phase * std::f32::consts::TAU + wave) * share;
                }
            }
            Vec2::new(x.max(0.0), y)
        })
        .collect()
}

/// Where a place lies among the side veins: the n-th vein runs where the phase is n + 0.5. Sides alternate.
pub(super) fn vein_phase(form: Pinnate, sign: f32, x: f32, y: f32) -> f32 {
    let across = x.abs();
    let start = y - form.slope * across + form.arch * across * across;
    // Veins crowd a little towards the tip.
    let crowd = start + 0.12 * start * start.abs();
    crowd * form.veins + if sign < 0.0 { 0.42 } else { 0.0 }
}

fn palmate_side(seed: Seed) -> Vec<Vec2> {
    let mut corners = vec![Vec2::ZERO];
    for (i, &(x, y)) in PALMATE.iter().enumerate() {
        let jitter = seed.at(i as u64);
        corners.push(Vec2::new(x * jitter.at(0).range(0.95, 1.05), y + jitter.at(1).range(-0.015, 0.015)));
    }
    corners.push(Vec2::new(0.0, 1.0));
    let mut points = Vec::new();
    for (i, pair) in corners.windows(2).enumerate() {
        let (a, b) = (pair[0], pair[1]);
        // Each edge is a shallow arc that bends inwards, so teeth are drawn out and sinuses round.
        let normal = Vec2::new(b.y - a.y, a.x - b.x);
        let steps = 6;
        for k in 0..steps {
            if i == 0 && k == 0 {
                continue;
            }
            let t = k as f32 / steps as f32;
            points.push(a + (b - a) * t - normal * (0.32 * t * (1.0 - t)));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Needles have no blade.
    fn blades() -> impl Iterator<Item = LeafShape> {
        LeafShape::ALL.into_iter().filter(|shape| !shape.is_conifer())
    }

    #[test]
    fn outlines_stand_on_the_petiole_and_enclose_an_area_like_their_species() {
        for shape in blades() {
            let points = outline(shape, Seed::new(5));
            assert_eq!(points[0], Vec2::ZERO);
            assert!(points.iter().all(|p| p.x.abs() < 0.8 && p.y > -0.25 && p.y < 1.05), "{shape:?}");
            let mut twice = 0.0;
            for (i, p) in points.iter().enumerate() {
                let q = points[(i + 1) % points.len()];
                twice += p.x * q.y - q.x * p.y;
            }
            let area = 0.5 * twice;
            let low = if [LeafShape::Willow, LeafShape::Olive, LeafShape::Palm].contains(&shape) { 0.06 } else { 0.18 };
            assert!(area > low && area < 0.75, "{shape:?}: {area}");
        }
    }

    #[test]
    fn no_two_blades_are_alike() {
        for shape in blades() {
            assert_ne!(outline(shape, Seed::new(1)), outline(shape, Seed::new(2)), "{shape:?}");
        }
    }
}
