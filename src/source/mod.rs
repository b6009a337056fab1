//! Sources: whatever a plant is made from, grown or read.

pub mod import;
