//! The only way to make a [`Plant`].

use glam::Vec3;

use super::validate::{PlantError, validate};
use super::{Chain, ChainId, Leaf, Plant};

/// Collects chains, parents first, and leaves; [`finish`](Self::finish) checks every invariant.
#[derive(Clone, Debug, Default)]
pub struct PlantBuilder {
    plant: Plant,
}

impl PlantBuilder {
    /// An empty builder.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A builder that holds all of `plant` already; ids stay what they were.
    #[must_use]
    pub fn from_plant(plant: Plant) -> Self {
        Self { plant }
    }

    /// Adds a stem that stands at `origin`. Points are relative to it, the first one zero.
    pub fn stem(&mut self, origin: Vec3, points: &[Vec3], radii: &[f32]) -> ChainId {
        self.push(Chain { parent: None, location: 0.0, order: 1, origin, first: 0, len: 0 }, points, radii)
    }

    /// Adds a chain that branches from `parent` at arc-length parameter `location`. Points are relative to its base in
    /// the frame of the parent there ([`Posed::frame`](super::Posed::frame)), the first one zero.
    pub fn branch(&mut self, parent: ChainId, location: f32, points: &[Vec3], radii: &[f32]) -> ChainId {
        let order = self.plant.chains.get(parent.index()).map_or(1, |p| p.order.saturating_add(1));
        let chain = Chain { parent: Some(parent), location, order, origin: Vec3::ZERO, first: 0, len: 0 };
        self.push(chain, points, radii)
    }

    /// An empty builder in the memory of a plant that is no longer needed, with room for this much.
    pub(crate) fn reusing(mut plant: Plant, chains: usize, points: usize, leaves: usize) -> Self {
        plant.chains.clear();
        plant.points.clear();
        plant.radii.clear();
        plant.leaves.clear();
        plant.chains.reserve(chains);
        plant.points.reserve(points);
        plant.radii.reserve(points);
        plant.leaves.reserve(leaves);
        Self { plant }
    }

    /// Adds a chain on `parent`, or a stem at `origin`; one radius a point.
    pub(crate) fn chain(
        &mut self,
        parent: Option<ChainId>,
        location: f32,
        origin: Vec3,
        points: &[Vec3],
        radii: &[f32],
    ) -> ChainId {
        let id = ChainId(self.plant.chains.len() as u32);
        let order = parent.map_or(1, |p| self.plant.chains[p.index()].order.saturating_add(1));
        let (location, origin) = if parent.is_some() { (location, Vec3::ZERO) } else { (0.0, origin) };
        let (first, len) = (self.plant.points.len() as u32, points.len() as u32);
        self.plant.chains.push(Chain { parent, location, order, origin, first, len });
        self.plant.points.extend_from_slice(points);
        self.plant.radii.extend_from_slice(radii);
        id
    }

    /// What was added so far.
    #[cfg(test)]
    pub(crate) fn so_far(&self) -> &Plant {
        &self.plant
    }

    /// The radii of all chains so far.
    pub(crate) fn radii_mut(&mut self) -> &mut [f32] {
        &mut self.plant.radii
    }

    /// The finished plant, for callers whose arithmetic keeps every invariant; checked in builds with debug
    /// assertions only.
    pub(crate) fn finish_trusted(self) -> Plant {
        debug_assert_eq!(validate(&self.plant), Ok(()));
        self.plant
    }

    /// Adds a leaf.
    pub fn leaf(&mut self, leaf: Leaf) {
        self.plant.leaves.push(leaf);
    }

    /// How many chains were added.
    #[must_use]
    pub fn chain_count(&self) -> usize {
        self.plant.chains.len()
    }

    /// The finished plant.
    ///
    /// # Errors
    ///
    /// When an invariant does not hold; the error names the first chain or leaf that breaks one.
    pub fn finish(self) -> Result<Plant, PlantError> {
        validate(&self.plant)?;
        Ok(self.plant)
    }

    fn push(&mut self, mut chain: Chain, points: &[Vec3], radii: &[f32]) -> ChainId {
        let id = ChainId(self.plant.chains.len() as u32);
        chain.first = self.plant.points.len() as u32;
        chain.len = points.len() as u32;
        self.plant.chains.push(chain);
        self.plant.points.extend_from_slice(points);
        // A wrong number of radii must not shift those of later chains: pad here, `validate` reports it as NaN.
        self.plant.radii.extend(radii.iter().copied().chain(std::iter::repeat(f32::NAN)).take(points.len()));
        id
    }
}
