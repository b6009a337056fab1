//! The elastic matcher (2018 TOG, sections 2 and 3): plants in correspondence by the shapes of their chains and the order
//! of their branches, and chains that are blended as elastic curves.

mod bifurcation;
mod blocks;
mod correspondence;
mod curve;
mod karcher;
mod mirror;
mod monotone;
mod place;
mod point;
mod register;
mod rotation;
#[cfg(test)]
mod tests;

pub use bifurcation::{Bifurcation, match_bifurcations};
pub(super) use blocks::Elastic;
pub use blocks::elastic_family;
pub(crate) use correspondence::canonical_order;
pub use curve::{ElasticCurve, SAMPLES};
pub use mirror::{mirror_family, mirrored, turned};
pub use point::ShapePoint;
pub use register::{Registration, STEPS, best_path, register};
