//! Plants in correspondence: matching them, and the [`Family`] that every blend is made from.

mod alignment;
mod assignment;
mod burden;
mod chain_traits;
mod elastic;
mod family;
mod forked;
mod fuzzy;
mod kernel;
mod leaf_pairs;
mod leaf_pools;
mod lobes;
mod merge;
mod nway;
mod pattern;
mod pattern_match;
mod pattern_tree;
mod place;
mod point_weights;
mod pruned;
#[cfg(test)]
pub(crate) mod random_plant;
mod reach;
mod resample;
mod rule;
mod size;
#[cfg(test)]
mod tests;
mod topology_tree;
mod turns;
mod units;
mod weights;

pub use assignment::assign;
pub(crate) use elastic::canonical_order;
pub use elastic::{
    Bifurcation, ElasticCurve, Registration, SAMPLES, STEPS, ShapePoint, best_path, elastic_family, match_bifurcations,
    mirror_family, mirrored, register, turned,
};
pub use family::{Family, FamilyError, Kin, KinId};
pub use fuzzy::{MOST_CELLS, match_fuzzy};
pub use kernel::Blender;
pub use leaf_pairs::PairedSlots;
pub use leaf_pools::LeafMatches;
pub use lobes::{gather_loose, lobes};
pub use merge::{match_merged, merged_family};
pub use nway::{fuzzy_family, match_nway, nway_family};
pub use pattern::{Group, Pattern, groups, pattern};
pub use pattern_match::{match_patterns, pattern_family};
pub use pattern_tree::{PatternNode, PatternTree};
pub use point_weights::point_weight;
pub use topology_tree::{TopologyNode, TopologyTree};
pub use weights::{Run, Weights};

pub use crate::preset::plan::PatternParams;
