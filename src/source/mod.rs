//! Sources: where plants come from. Each ends in a [`Plant`](crate::plant::Plant), and later stages can't tell them
//! apart. And a checked reader of GLB files, which `inspect` uses.

pub mod estimate;
pub mod foliage;
pub mod glb;
pub mod grow;
pub mod import;
pub mod scene;
pub mod skeletonize;
