//! Dressing: twigs and leaves for a bare plant (Wang et al. 2017, TVCG, 4.3 "Foliage").
//!
//! Leaf points are seeded in the crown, twigs grow towards them from the thin wood by space colonization (Runions et al.
//! 2007), and leaves sit along the twigs. Where twigs stand does not depend on the density; the density takes leaves
//! from one fixed order of sites. So raising it moves no branch, twig or leaf, it adds.

mod attract;
mod colonize;
mod foliage;
mod grid;
mod twig;

use crate::base::Seed;
use crate::plant::Plant;
use crate::preset::plan::DressParams;

/// The plant with twigs and leaves. Its own chains keep their ids, twigs come after them.
///
/// A plant that has leaves already (imported ones) keeps them and gets nothing. So does one without length. Linear in
/// points and leaves but for a sort of the leaves.
#[must_use]
pub fn dress(plant: &Plant, params: &DressParams, seed: Seed) -> Plant {
    if !plant.leaves().is_empty() || plant.chains().is_empty() || params.most_leaves == 0 || !(params.density > 0.0) {
        return plant.clone();
    }
    let posed = plant.pose();
    let Some(wood) = twig::Wood::of(plant, &posed, params) else { return plant.clone() };
    let points = attract::leaf_points(&wood, seed.child("points"));
    let shoots = colonize::colonize(&wood, &points, seed.child("twigs"));
    let twiggy = twig::add(plant, &posed, &wood, &shoots);
    foliage::add(plant, twiggy, &wood, params, seed.child("leaves"))
}
