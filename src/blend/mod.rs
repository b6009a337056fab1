//! Modes of blending: each only chooses [`Weights`](crate::relate::Weights) for a [`Family`](crate::relate::Family).

mod mix;
mod schedule;

pub use mix::mix;
pub use schedule::{Batch, batch, progress_of, sample};
