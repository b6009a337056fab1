//! Modes of blending: each only chooses [`Weights`](crate::relate::Weights) for a [`Family`](crate::relate::Family).

mod ground;
mod growth;
mod height;
mod mix;
mod morph;
mod part;
mod schedule;
pub mod shape;
mod stems;
mod tasks;
#[cfg(test)]
mod tests;

pub use ground::grounded;
pub use growth::grown;
pub(crate) use height::Bounds;
pub use height::within;
pub use mix::{mix, scattered};
pub(crate) use morph::support_at;
pub use morph::{Pace, morph, support_over_morph};
pub use part::{Chosen, chosen};
pub use schedule::{Batch, State, sample};
pub use stems::whole_stems;
pub use tasks::Tasks;
