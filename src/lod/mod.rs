//! Levels of detail: from the whole tree to an impostor or two crossed quads, each measured against the first.
//!
//! Bark is meshed again from the chains at every level; leaves are thinned, then baked to cards. Where a level takes
//! over is measured, not guessed: see [`ladder`].

mod agree;
mod bake_card;
mod bench;
mod bent;
mod between;
mod bounded;
mod cloud;
mod crossed;
mod flip;
mod impostor;
mod lacks;
mod ladder;
mod limbs;
mod measure;
mod memory;
mod outline;
mod packed;
mod parallax;
mod planes;
mod secant;
mod sizes;
#[cfg(test)]
pub(crate) mod specimen;
mod stock;
mod thin;
mod tile;
mod trunk;
mod twigs;

pub use agree::Outlines;
pub use cloud::{CARD_TEXELS, CloudParams};
pub use flip::flip;
pub use impostor::Impostor;
pub use ladder::{CULL, Ladder, Level, Texels, ladder, ladder_by, ladder_with, mesh_levels, mesh_levels_on, pictures};
pub use measure::{Asked, Measured, Reference, Seen, Wardrobe};
pub use memory::{Colors, Footing, Memory, Piece, Rung};
pub(crate) use parallax::Facing;
pub use stock::{Stock, palette};
pub use tile::Tile;
