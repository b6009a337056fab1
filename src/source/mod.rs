//! Sources: where plants come from. Each ends in a [`Plant`](crate::plant::Plant), and later stages can't tell them
//! apart.

pub mod grow;
pub mod import;
