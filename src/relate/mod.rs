//! Plants in correspondence: matching them, and the [`Family`] that every blend is made from.

mod alignment;
mod assignment;
mod family;
mod fuzzy;
mod kernel;
#[cfg(test)]
pub(crate) mod random_plant;
mod resample;
#[cfg(test)]
mod tests;
mod topology_tree;
mod weights;

pub use assignment::assign;
pub use family::{Family, FamilyError, Kin, KinId};
pub use fuzzy::{MOST_CELLS, fuzzy_family, match_fuzzy};
pub use topology_tree::{TopologyNode, TopologyTree};
pub use weights::Weights;
