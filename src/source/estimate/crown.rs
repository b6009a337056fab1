//! The crown's envelope: of the shapes that a species can take endpoints from, the smallest that holds nine tenths of the
//! given tips, and how hollow it is.

/// Share of the tips that the envelope holds.
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

    /// Its volume over that of the cylinder around it.
    const fn fill(self) -> f32 {
        match self {
            Self::Ellipsoid | Self::HalfEllipsoid => 2.0 / 3.0,
            Self::Cone => 1.0 / 3.0,
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
    let quantile = |mut values: Vec<f32>, q: f32| {
        values.sort_unstable_by(f32::total_cmp);
        values.get(((values.len().max(1) - 1) as f32 * q + 0.5) as usize).copied().unwrap_or(0.0)
    };
    let heights: Vec<f32> = tips.iter().map(|t| t[0]).collect();
    let (low, high) = (quantile(heights.clone(), 0.05), quantile(heights, 0.95));
    // A crown of one layer still is one.
    let air = ((high - low) * 0.08).max(0.03);
    let (bottom, top) = ((low - air).clamp(0.0, 0.93), (high + air).clamp(0.05, 1.0));
    let top = top.max(bottom + 0.05).min(1.0);
    let share = |height: f32| ((height - bottom) / (top - bottom)).clamp(0.0, 1.0);
    let radius = |shape: Shape| {
        // Where a shape closes, any tip off the axis would ask for any radius.
        let asked = tips.iter().map(|t| t[1] / shape.profile(share(t[0])).max(0.15)).collect();
        quantile(asked, HELD).clamp(0.01, 4.0)
    };
    let volume = |shape: Shape| shape.fill() * radius(shape) * radius(shape);
    let shape = Shape::ALL.into_iter().min_by(|a, b| volume(*a).total_cmp(&volume(*b))).unwrap_or(Shape::Cylinder);
    let radius = radius(shape);
    let reaches = tips.iter().map(|t| shape.reach(share(t[0]), t[1] / radius)).collect();
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
            assert!((crown.bottom - 0.3).abs() < 0.06 && (crown.top - 0.9).abs() < 0.16, "{crown:?}");
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
