//! Sources of unlike heights, matched and blended at one size.
//!
//! Branches come into a blend one after the other, each as long as its source has it. Between a sapling and an old tree, a bole of
//! three metres would bear limbs of twenty. So sources are brought to one size first, and what is made of them is as large as the
//! wood that has come: half of either, half way between their sizes.
//!
//! Sizes are powers of two. They change no bit but the exponent of a number, so a source stays what it is; and sources that differ by
//! less than a factor of √2 stay as they are, as the paper has them.

use super::kernel::Feed;
use super::{Blender, Family, FamilyError};
use crate::plant::Plant;

/// Most times that a plant is as high as another: a tree of 100 m and one of 10 cm.
const LARGEST: f32 = 1024.0;

/// What has been brought to one size.
#[derive(Clone, Debug)]
pub(super) struct Sizes {
    /// The sources as they came.
    pub(super) sources: Vec<Plant>,
    /// How many times as large each is.
    each: Vec<f32>,
}

impl Family {
    /// The family that `matched` makes of some plants, brought to one height before; trees of it are as large as lies between these
    /// heights, by the wood that they have of each. Plants that differ by less than a factor of √2 in height stay as they are.
    ///
    /// # Errors
    ///
    /// Those of `matched`.
    pub fn at_one_size(
        plants: Vec<Plant>,
        matched: impl FnOnce(Vec<Plant>) -> Result<Self, FamilyError>,
    ) -> Result<Self, FamilyError> {
        let each = sizes(&plants);
        if each.iter().all(|size| *size == 1.0) {
            return matched(plants);
        }
        let alike = plants.iter().zip(&each).map(|(plant, size)| plant.clone().scaled(size.recip())).collect();
        let mut family = matched(alike)?;
        family.sizes = Some(Sizes { sources: plants, each });
        Ok(family)
    }
}

/// How many times as high as the lowest each plant is, as the nearest power of two; 1 for one without height.
fn sizes(plants: &[Plant]) -> Vec<f32> {
    let heights: Vec<f32> = plants.iter().map(Plant::height).collect();
    let lowest = heights.iter().copied().filter(|height| *height > 0.0).fold(f32::INFINITY, f32::min);
    let size = |height: f32| {
        let mut size = 1.0;
        while size < LARGEST && height > lowest * size * std::f32::consts::SQRT_2 {
            size *= 2.0;
        }
        size
    };
    heights.into_iter().map(size).collect()
}

impl Blender<'_> {
    /// How many times as large as the family's plants the tree is whose kins have been weighed: the mean of the sources' sizes, each by
    /// the share of its chains that stand.
    pub(super) fn size(&self) -> f32 {
        let Some(Sizes { each, sources }) = &self.family.sizes else { return 1.0 };
        // Where some of it takes no part, the tree stays as large as that.
        let is_partial = self.feeds.iter().zip(&self.kept).any(|(feed, kept)| *kept && *feed != Feed::Nothing);
        let mut standing = vec![0.0_f64; each.len()];
        for (k, feed) in self.feeds.iter().enumerate() {
            if *feed != Feed::Nothing && (!is_partial || self.kept[k]) {
                let degree = f64::from(self.degrees[k]);
                standing.iter_mut().zip(self.share(k)).for_each(|(sum, share)| *sum += degree * f64::from(*share));
            }
        }
        let (mut sum, mut all) = (0.0, 0.0);
        for ((size, source), standing) in each.iter().zip(sources).zip(standing) {
            let share = standing / source.chains().len() as f64;
            sum += share * f64::from(*size);
            all += share;
        }
        if all > 0.0 { (sum / all) as f32 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::blend::{Tasks, mix};
    use crate::preset::plan::MatchParams;
    use crate::relate::nway_family;
    use crate::relate::random_plant::{Oddity, random_plant};

    const MATCHING: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    fn plant(seed: u64, size: f32) -> Plant {
        random_plant(Seed::new(seed), 40, Oddity::Tame).scaled(size)
    }

    fn family(plants: Vec<Plant>) -> Family {
        Family::at_one_size(plants, |plants| nway_family(plants, &MATCHING)).unwrap()
    }

    #[test]
    fn between_a_sapling_and_the_same_tree_all_are_of_its_shape() {
        for (seed, size) in [(1, 1.6), (2, 3.0), (3, 8.0), (4, 900.0)] {
            let (small, large) = (plant(seed, 1.0), plant(seed, size));
            let family = family(vec![small.clone(), large.clone()]);
            let tasks = Tasks::new(&family, 0, 1);
            let mut last = 0.0;
            for progress in [0.1, 0.4, 0.7, 0.95] {
                let state = tasks.sample(Seed::new(7), progress, 1.0);
                let tree = family.blend(&tasks.weights(&state));
                let height = tree.height();
                let within = |height: f32| height > small.height() * 0.999 && height < large.height() * 1.001;
                assert!(within(height) && height >= last, "{seed} {progress}: {height}");
                last = height;
                // Its trunk may be of any share, but no more than √2 longer or shorter than what it bears.
                let ratio = |id| {
                    crate::plant::Curve::new(tree.points(id)).length()
                        / crate::plant::Curve::new(small.points(id)).length()
                };
                let all: Vec<f32> = tree.chain_ids().map(ratio).collect();
                let (least, most) = all.iter().fold((f32::MAX, 0.0_f32), |(a, b), r| (a.min(*r), b.max(*r)));
                assert!(most / least < 1.42, "{seed} {progress}: {least} to {most}");
            }
        }
    }

    #[test]
    fn heights_lie_between_those_of_the_sources_as_far_as_the_blend() {
        for seed in 2..6 {
            let (small, large) = (plant(seed, 1.0), plant(seed + 50, 12.0));
            let (a, b) = (small.height(), large.height());
            let family = family(vec![small.clone(), large.clone()]);
            assert!(family.sources() == [small.clone(), large.clone()]);
            assert!(family.blend(&family.corner(0)) == small && family.blend(&family.corner(1)) == large);
            let tasks = Tasks::new(&family, 0, 1);
            for share in [0.2, 0.5, 0.8] {
                let straight = a + (b - a) * share;
                let state = tasks.sample(Seed::new(3), share, 1.0);
                for weights in [tasks.weights(&state), mix(&family, &[1.0 - share, share])] {
                    let height = family.blend(&weights).height();
                    assert!((0.6..1.4).contains(&(height / straight)), "{seed} {share}: {height} for {straight}");
                }
            }
        }
    }

    #[test]
    fn a_tree_of_which_a_part_is_blended_is_as_large_as_the_rest_of_it() {
        for (own, other) in [(1.0, 9.0), (9.0, 1.0)] {
            let (first, second) = (plant(5, own), plant(60, other));
            let family = family(vec![first.clone(), second]);
            // All but the stems.
            let tasks = Tasks::partial(&family, 0, 1, &|kin| family.parent(kin).is_some());
            assert!(tasks.count() > 10);
            let mut blender = Blender::new(&family);
            let tree = blender.blend(&tasks.weights(&tasks.sample(Seed::new(3), 0.8, 1.0)));
            let mut stems = 0;
            for (id, kin) in tree.chain_ids().zip(blender.kins()).filter(|(id, _)| tree.chain(*id).parent.is_none()) {
                let own = family.member(*kin, 0).expect("stems of the second alone stay away");
                assert!(tree.points(id) == first.points(own) && tree.radii(id) == first.radii(own), "{kin:?}");
                stems += 1;
            }
            assert!(stems > 0);
        }
    }

    #[test]
    fn plants_of_nearly_one_height_stay_as_they_are() {
        let plants = vec![plant(1, 1.0), plant(1, 1.4), plant(1, 0.999)];
        assert!(family(plants.clone()).sizes.is_none());
        assert_eq!(sizes(&[plant(1, 1.0), plant(1, 1.42), plant(1, 0.36)]), [2.0, 4.0, 1.0]);
        let flat = Plant::default();
        assert_eq!(sizes(&[flat.clone(), plant(1, 1.0), flat]), [1.0; 3]);
    }
}
