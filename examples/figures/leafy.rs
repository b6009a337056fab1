//! Trees with leaves that figures are measured on: grown ones, and imported ones with leaves of their own.

use treewright::base::Seed;
use treewright::dress::dress;
use treewright::plant::Plant;
use treewright::preset::plan::ImportParams;
use treewright::relate::{PatternParams, PatternTree, gather_loose};
use treewright::source::import::import;

use crate::data;
use crate::table_1::source;

#[path = "../../benches/foliage/mod.rs"]
mod shared;
pub(crate) use shared::foliage;

/// A dressed tree of a shipped species.
pub(crate) fn leafy(species: &str, seed: u64, leaves: u32) -> Plant {
    dress(&source(species, seed, usize::MAX), &foliage(leaves), Seed::new(seed).child("dress"))
}

/// A mesh of the data folder with its own leaves, all on chains near them.
pub(crate) fn imported(name: &str) -> Option<Plant> {
    let bytes = std::fs::read(data()?.join("mesh").join(name)).ok()?;
    let plant = import(&bytes, name, &ImportParams::default()).ok()?.plant;
    Some(gather_loose(&plant, &PatternTree::of(&plant, &PatternParams::default())))
}
