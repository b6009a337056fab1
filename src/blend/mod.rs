//! Modes of blending: each only chooses [`Weights`](crate::relate::Weights) for a [`Family`](crate::relate::Family).

mod mix;
mod part;
mod schedule;
pub mod shape;
mod tasks;
#[cfg(test)]
mod tests;

pub use mix::{mix, scattered};
pub use part::{Chosen, chosen};
pub use schedule::{Batch, State, sample};
pub use tasks::Tasks;
