//! Blends that would be higher than every source.
//!
//! Branches and what bears them come from one source to the other each at its own pace, and a limb that is wide in one source may
//! stand on a trunk that is upright in the other: between a pole with a tuft and an umbrella of the same height trees were up to 1.5
//! times as high as both. Such a tree is as much shorter in all of its branches. They stay as thick: they are as their sources have
//! them, and so do leaves.

use super::grounded;
use crate::plant::Plant;

/// A blend of some plants that reaches no farther below the ground and no higher than any of them; as it is where it does not.
#[must_use]
pub fn within<'s, S: IntoIterator<Item = &'s Plant, IntoIter: Clone>>(blend: Plant, sources: S) -> Plant {
    let sources = sources.into_iter();
    no_higher(grounded(blend, sources.clone()), sources)
}

fn no_higher<'s>(blend: Plant, sources: impl Iterator<Item = &'s Plant>) -> Plant {
    let most = sources.map(Plant::height).fold(0.0, f32::max);
    let height = blend.height();
    if !(most > 0.0 && height > most) {
        return blend;
    }
    let radii = blend.all_radii().to_vec();
    blend.scaled(most / height).with_radii(radii)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn a_blend_that_is_higher_than_its_sources_is_shorter_in_all_and_as_thick() {
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
        for height in [3.0, 5.0, 6.0] {
            assert!(within(pole(height), &sources) == pole(height));
        }
    }
}
