//! Sources: whatever a plant is made from, grown or read.

pub mod import;
//! Sources: where plants come from. Each ends in a [`Plant`](crate::plant::Plant), and later stages can't tell them
//! apart.

pub mod grow;
