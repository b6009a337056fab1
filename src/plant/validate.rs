//! Every invariant of a [`Plant`], in one function.

use glam::Vec3;

use super::{ChainId, Plant};

/// What is wrong with a plant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// No chain at all.
    #[error("the plant has no chain")]
    Empty,
    /// A chain of fewer than two points.
    #[error("chain {0:?} has fewer than two points")]
    TooShort(ChainId),
    /// A coordinate, radius, location, orientation or size that is not finite, or a radius or size that is negative.
    #[error("chain {chain:?} holds a {what} that is not finite or below zero")]
    BadNumber {
        /// The chain.
        chain: ChainId,
        /// Which quantity.
        what: &'static str,
    },
    /// A first point that is not the base.
    #[error("the first point of chain {0:?} is not zero")]
    OffBase(ChainId),
    /// A parent that is no earlier chain, or an order that is not the parent's plus one.
    #[error("chain {0:?} does not come after its parent with the next order")]
    BadParent(ChainId),
    /// A location outside 0..=1.
    #[error("chain {chain:?} holds a location {location} outside 0..=1")]
    BadLocation {
        /// The chain, or the chain of the leaf.
        chain: ChainId,
        /// The location.
        location: f32,
    },
    /// A leaf on a chain that does not exist.
    #[error("leaf {0} is on a chain that does not exist")]
    LostLeaf(usize),
}

/// Checks that
///
/// - there is at least one chain, the first is a stem, and each has two points or more;
/// - parents come before children; a stem's order is 1, any other's is its parent's plus one;
/// - locations lie in 0..=1; the first point of a chain is zero; only stems have an origin;
/// - coordinates, radii, leaf sizes, widths, offsets and orientations are finite, radii, sizes and widths not negative;
/// - every leaf is on a chain.
pub(super) fn validate(plant: &Plant) -> Result<(), PlantError> {
    if plant.chains.is_empty() {
        return Err(PlantError::Empty);
    }
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let bad = |what| PlantError::BadNumber { chain: id, what };
        if chain.len < 2 {
            return Err(PlantError::TooShort(id));
        }
        if !plant.points(id).iter().all(|p| p.is_finite()) || !chain.origin.is_finite() {
            return Err(bad("coordinate"));
        }
        if !plant.radii(id).iter().all(|r| r.is_finite() && *r >= 0.0) {
            return Err(bad("radius"));
        }
        if plant.points(id)[0] != Vec3::ZERO {
            return Err(PlantError::OffBase(id));
        }
        if !(0.0..=1.0).contains(&chain.location) {
            return Err(PlantError::BadLocation { chain: id, location: chain.location });
        }
        let right = match chain.parent {
            None => chain.order == 1,
            Some(parent) => {
                parent < id
                    && plant.chain(parent).order.checked_add(1) == Some(chain.order)
                    && chain.origin == Vec3::ZERO
            }
        };
        if !right {
            return Err(PlantError::BadParent(id));
        }
    }
    for (i, leaf) in plant.leaves.iter().enumerate() {
        if leaf.chain.index() >= plant.chains.len() {
            return Err(PlantError::LostLeaf(i));
        }
        if !(0.0..=1.0).contains(&leaf.location) {
            return Err(PlantError::BadLocation { chain: leaf.chain, location: leaf.location });
        }
        if !(leaf.size.is_finite() && leaf.size >= 0.0) {
            return Err(PlantError::BadNumber { chain: leaf.chain, what: "leaf size" });
        }
        if !(leaf.orientation.v.is_finite() && leaf.orientation.w.is_finite()) {
            return Err(PlantError::BadNumber { chain: leaf.chain, what: "leaf orientation" });
        }
        if !(leaf.offset.is_finite() && leaf.form.is_sound()) {
            return Err(PlantError::BadNumber { chain: leaf.chain, what: "leaf offset, width or bend" });
        }
    }
    Ok(())
}
