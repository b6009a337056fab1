//! The foliage that leafy trees of benchmarks and figures wear.

use treewright::preset::plan::{DressParams, Phyllotaxis};

/// Foliage of so many leaves at most.
pub(crate) fn foliage(leaves: u32) -> DressParams {
    DressParams {
        leaf_share: 1.0 / 15.0,
        density: 1.0,
        most_leaves: leaves,
        leaf_size: 0.2,
        leaf_spread: 0.2,
        leaf_angle: 0.9,
        twig_length: 0.35,
        phyllotaxis: Phyllotaxis::Spiral,
        droop: 0.2,
        pictures: 2,
    }
}
