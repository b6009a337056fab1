//! Blends that would be higher than every source, or lower.
//!
//! Branches and what bears them come from one source to the other each at its own pace, and a limb that is wide in one source may
//! stand on a trunk that is upright in the other: between a pole with a tuft and an umbrella of the same height trees were up to 1.5
//! times as high as both. Where the limbs of both are half grown they were as much lower: between trees of 11.9 and 8.7 metres one of
//! 6.3. The mean of two wide limbs that lean to different sides stands upright, and on the geodesic between two umbrellas of 8.4
//! metres stood a tree of 11.7. Such a tree is as much shorter or longer in all of its branches. They stay as thick: they are as their sources have them, and
//! so do leaves.

use super::ground::{Depths, held};
use crate::plant::Plant;

/// A blend of some plants that reaches no farther below the ground than any of them and is as high as lies between them; as it is
/// where that is so.
#[must_use]
pub fn within<'s, S: IntoIterator<Item = &'s Plant, IntoIter: Clone>>(blend: Plant, sources: S) -> Plant {
    let sources = sources.into_iter();
    let heights = Bounds::heights(sources.clone());
    between(held(blend, &|| Depths::of(sources.clone())), heights)
}

/// What some plants bound their blends by, known for many of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    depths: Depths,
    /// Of the lowest and of the highest.
    heights: (f32, f32),
}

impl Bounds {
    /// Those of some plants.
    pub(crate) fn of(sources: &[Plant]) -> Self {
        Self { depths: Depths::of(sources.iter()), heights: Self::heights(sources.iter()) }
    }

    fn heights<'s>(sources: impl Iterator<Item = &'s Plant>) -> (f32, f32) {
        sources.map(Plant::height).fold((f32::MAX, 0.0_f32), |(l, m), height| (l.min(height), m.max(height)))
    }

    /// As [`within`].
    pub(crate) fn hold(&self, blend: Plant) -> Plant {
        between(held(blend, &|| self.depths), self.heights)
    }
}

fn between(blend: Plant, (least, most): (f32, f32)) -> Plant {
    let height = blend.height();
    if !(least > 0.0 && height > 0.0) || (least..=most).contains(&height) {
        return blend;
    }
    let radii = blend.all_radii().to_vec();
    blend.scaled(height.clamp(least, most) / height).with_radii(radii)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn a_blend_that_is_higher_or_lower_than_its_sources_is_as_high_as_they_are_and_as_thick() {
        let pole = |height: f32| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * height], &[0.2, 0.1]);
            builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.1, 0.05]);
            builder.finish().expect("it stands")
        };
        let sources = [pole(6.0), pole(4.0)];
        let made = within(pole(9.0), &sources);
        assert!((made.height() - 6.0).abs() < 1e-4 && made.all_radii() == pole(9.0).all_radii());
        assert!((made.all_points()[3].x - 6.0 / 9.0).abs() < 1e-6, "{:?}", made.all_points());
        let low = within(pole(3.0), &sources);
        assert!((low.height() - 4.0).abs() < 1e-4 && low.all_radii() == pole(3.0).all_radii());
        for height in [4.0, 5.0, 6.0] {
            assert!(within(pole(height), &sources) == pole(height));
        }
        assert!(Bounds::of(&sources).hold(pole(9.0)) == made && Bounds::of(&sources).hold(pole(5.0)) == pole(5.0));
    }
}
