//! The crown's envelope: of the shapes that a species can take endpoints from, the one whose outline is nearest to that
//! of the given tips, and how hollow it is.
//!
//! The outline is the 90th percentile of the tips' distance from the axis in up to [`SLICES`] layers of equal height; each
//! shape gets the radius that fits it best by least squares. Rejected: the smallest shape that holds nine tenths of the
//! tips. The few tips near the ends of an ellipsoid ask for any radius, and a cylinder won.

use super::measure::quantile;

/// Layers of the outline, at most.
const SLICES: usize = 7;
/// Share of the tips of a layer that lie within its outline.
const HELD: f32 = 0.9;
/// Share of the tips that may lie inside its hollow.
const INSIDE: f32 = 0.15;

/// A shape upright about the axis, lengths in plant heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crown {
    pub(super) shape: Shape,
    pub(super) bottom: f32,
    pub(super) top: f32,
    pub(super) radius: f32,
    pub(super) hollow: f32,
}

/// The kinds of shape, by their names in a species file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Ellipsoid,
    HalfEllipsoid,
    Cone,
    Cylinder,
}

impl Shape {
    pub(super) const ALL: [Self; 4] = [Self::Ellipsoid, Self::HalfEllipsoid, Self::Cone, Self::Cylinder];

    /// Its name in a species file.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Ellipsoid => "Ellipsoid",
            Self::HalfEllipsoid => "HalfEllipsoid",
            Self::Cone => "Cone",
            Self::Cylinder => "Cylinder",
        }
    }

    /// Its radius at the share `u` of its height, over its greatest radius.
    fn profile(self, u: f32) -> f32 {
        let u = u.clamp(0.0, 1.0);
        match self {
            Self::Ellipsoid => (4.0 * u * (1.0 - u)).max(0.0).sqrt(),
            Self::HalfEllipsoid => (1.0 - u * u).max(0.0).sqrt(),
            Self::Cone => 1.0 - u,
            Self::Cylinder => 1.0,
        }
    }

    /// How far out a tip lies in units of the shape: what `hollow` is measured by (`source/grow/volume.rs`).
    fn reach(self, u: f32, out: f32) -> f32 {
        match self {
            Self::Ellipsoid => ((2.0 * u - 1.0) * (2.0 * u - 1.0) + out * out).sqrt(),
            Self::HalfEllipsoid => (u * u + out * out).sqrt(),
            Self::Cone | Self::Cylinder => out / self.profile(u).max(0.05),
        }
    }
}

/// Fits a crown to tips, each its height and its distance from the axis over the plant's height.
pub(super) fn fit(tips: &[[f32; 2]]) -> Crown {
    let tips: Vec<[f32; 2]> = tips.iter().filter(|t| t[0].is_finite() && t[1].is_finite()).copied().collect();
    let heights: Vec<f32> = tips.iter().map(|t| t[0]).collect();
    let (low, high) = (quantile(heights.clone(), 0.02), quantile(heights, 0.98));
    // A crown of one layer still is one.
    let air = if high - low < 0.06 { 0.03 } else { 0.0 };
    let (bottom, top) = ((low - air).clamp(0.0, 0.93), (high + air).clamp(0.05, 1.0));
    let top = top.max(bottom + 0.05).min(1.0);
    let slices = (tips.len() / 5).clamp(1, SLICES);
    let mut layers: Vec<Vec<f32>> = vec![Vec::new(); slices];
    for tip in &tips {
        let share = (tip[0] - bottom) / (top - bottom);
        layers[((share.clamp(0.0, 1.0) * slices as f32) as usize).min(slices - 1)].push(tip[1]);
    }
    // Height and outline of each layer.
    let outline: Vec<(f32, f32)> = layers
        .into_iter()
        .enumerate()
        .filter(|(_, layer)| !layer.is_empty())
        .map(|(i, layer)| (bottom + (top - bottom) * (i as f32 + 0.5) / slices as f32, quantile(layer, HELD)))
        .collect();
    // Radius and squared miss of a shape with its top at a height.
    let fitted = |shape: Shape, top: f32| {
        let profile = |height: f32| shape.profile((height - bottom) / (top - bottom));
        let (mut product, mut square) = (0.0_f32, 1e-9_f32);
        for &(height, out) in &outline {
            product += out * profile(height);
            square += profile(height) * profile(height);
        }
        let radius = product / square;
        let miss = |&(height, out): &(f32, f32)| out - radius * profile(height);
        (radius, outline.iter().map(|layer| miss(layer) * miss(layer)).sum::<f32>())
    };
    // Few tips lie in the point of a cone, so shapes may end above the highest.
    let tops = [0.0, 0.15, 0.3].map(|more| (top + (top - bottom) * more).min(1.0));
    let candidates = Shape::ALL.into_iter().flat_map(|shape| tops.map(|top| (shape, top)));
    let best = candidates.min_by(|a, b| fitted(a.0, a.1).1.total_cmp(&fitted(b.0, b.1).1));
    // One or two layers have no shape.
    let (shape, top) = best.filter(|_| outline.len() > 2).unwrap_or((Shape::Ellipsoid, top));
    let radius = fitted(shape, top).0.clamp(0.01, 4.0);
    let reach = |t: &[f32; 2]| shape.reach(((t[0] - bottom) / (top - bottom)).clamp(0.0, 1.0), t[1] / radius);
    let reaches = tips.iter().map(reach).collect();
    // A few tips say nothing about a hollow.
    let hollow = if tips.len() < 8 { 0.0 } else { quantile(reaches, INSIDE).clamp(0.0, 0.85) };
    Crown { shape, bottom, top, radius, hollow }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    fn tips(shape: Shape, hollow: f32) -> Vec<[f32; 2]> {
        let seed = Seed::new(8);
        (0..4000_u64)
            .filter_map(|i| {
                let (x, z) = (seed.child("x").at(i).range(-1.0, 1.0), seed.child("z").at(i).range(-1.0, 1.0));
                let (u, out) = (seed.child("u").at(i).unit(), (x * x + z * z).sqrt());
                let reach = shape.reach(u, out);
                (out <= shape.profile(u) && reach >= hollow).then_some([0.3 + 0.6 * u, out * 0.25])
            })
            .collect()
    }

    #[test]
    fn the_shape_that_held_the_tips_is_found() {
        for shape in Shape::ALL {
            let crown = fit(&tips(shape, 0.0));
            assert_eq!(crown.shape, shape, "{crown:?}");
            assert!((crown.radius - 0.25).abs() < 0.07, "{crown:?}");
            assert!((crown.bottom - 0.3).abs() < 0.08 && (crown.top - 0.9).abs() < 0.25, "{crown:?}");
        }
    }

    #[test]
    fn a_shell_is_hollow_and_a_full_crown_is_not() {
        let (full, shell) = (fit(&tips(Shape::Ellipsoid, 0.0)), fit(&tips(Shape::Ellipsoid, 0.7)));
        assert!(full.hollow < 0.6 && shell.hollow > 0.65 && shell.hollow > full.hollow + 0.1, "{full:?} {shell:?}");
    }

    #[test]
    fn no_tip_and_one_tip_give_a_crown() {
        for tips in [&[][..], &[[0.5, 0.0]][..], &[[f32::NAN, f32::NAN]][..]] {
            let crown = fit(tips);
            assert!(crown.bottom < crown.top && crown.radius > 0.0, "{crown:?}");
        }
    }
}
