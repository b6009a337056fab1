//! The shape space of plants (2018 TOG): tree-shape space with its geodesics, distances and means, symmetry, and the
//! weights that put all of it into plants.
//!
//! Two ways to go between plants stand beside each other. In tree-shape space ([`TreePoint`], [`TreeGeodesic`]) edges are points of
//! R²⁰ and go straight: the paper's metric, QED, for any family, also one whose sources order their branches differently.
//! In an elastic family ([`weighted_mean`]) chains bend: the default for making plants.

mod along;
mod binary;
mod dendrogram;
mod distance;
mod filter;
mod frechet;
mod straighten;
mod symmetry;
#[cfg(test)]
mod tests;
mod tree_point;

pub use along::weighted_mean;
pub use binary::{BinaryNode, BinaryTree, Side};
pub use dendrogram::{Merge, dendrogram, linkage};
pub use distance::{Comparison, Metric, Size, distance, distance_matrix, nearest_facing};
pub use filter::SmallBranches;
pub use frechet::{frechet_mean, variance};
pub use straighten::TreeGeodesic;
pub use symmetry::Reflection;
pub use tree_point::{Axis, Edge, LANDMARKS, TreePoint};
