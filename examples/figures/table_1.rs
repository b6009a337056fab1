//! The sources and rows of the paper's Table 1 (2017 TVCG): what figures and benchmarks of blending are measured on.

use std::path::Path;

use treewright::base::Seed;
use treewright::plant::Plant;
use treewright::preset::plan::{FilterParams, MatchParams, ScoreParams};
use treewright::select;
use treewright::source::grow::grow;

/// Weights of matching.
pub(crate) const MATCHING: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
/// The filter as presets have it.
pub(crate) const FILTER: FilterParams = FilterParams { collisions: 0.01, rise: 0.01, botany: 2.0 };
/// Weights of scores.
pub(crate) const SCORES: ScoreParams = ScoreParams { crown: 0.4, ratio: 0.2, topology: 0.4, sources: Vec::new() };

/// A row of the table.
pub(crate) struct Row {
    /// Species and chains of the source.
    pub(crate) source: (&'static str, usize),
    /// And of the target.
    pub(crate) target: (&'static str, usize),
    /// Blended trees.
    pub(crate) trees: usize,
}

impl Row {
    /// Its source and target.
    pub(crate) fn plants(&self) -> (Plant, Plant) {
        (source(self.source.0, 1, self.source.1), source(self.target.0, 2, self.target.1))
    }
}

/// The rows, with the shipped species that are nearest to the paper's.
pub(crate) const ROWS: [Row; 7] = [
    Row { source: ("willow", 213), target: ("willow", 594), trees: 317 },
    Row { source: ("willow", 594), target: ("bonsai", 32), trees: 292 },
    Row { source: ("elm", 348), target: ("elm", 170), trees: 527 },
    Row { source: ("pine", 180), target: ("ash", 113), trees: 152 },
    Row { source: ("spruce", 84), target: ("bonsai", 32), trees: 89 },
    Row { source: ("poplar", 245), target: ("lime", 307), trees: 323 },
    Row { source: ("zelkova", 56), target: ("bonsai", 42), trees: 127 },
];

/// A plant of a shipped species, cut down to its `chains` thickest chains.
pub(crate) fn source(species: &str, seed: u64, chains: usize) -> Plant {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("presets/species/{species}.ron"));
    let text = std::fs::read_to_string(file).expect("it is shipped");
    let mut params = treewright::preset::species(species, &text).expect("the species is good");
    params.seed = seed;
    let plant = grow(&params, Seed::new(seed).child("grow")).expect("it grows").0;
    let mut order: Vec<_> = plant.chain_ids().collect();
    order.sort_by(|&a, &b| {
        let key = |id| (plant.chain(id).order, -plant.radii(id)[0]);
        key(a).0.cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1)).then(a.cmp(&b))
    });
    // Coarse orders first, so no chain loses its parent.
    select::without(&plant, order.get(chains..).unwrap_or(&[]))
}
