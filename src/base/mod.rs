//! What every layer stands on: addressed randomness, deterministic mathematics, frames, content keys and
//! diagnostics. Nothing here knows what a tree is.

mod alone;
pub(crate) mod bulk;
mod counted;
mod diagnostic;
mod frame;
mod gaussian;
mod groups;
mod key;
pub mod math;
mod once;
mod seed;
mod simplex;
mod svg;

pub(crate) use alone::is_alone;
pub(crate) use counted::counted;
pub use diagnostic::{Asked, Diagnostic, Note, Span};
pub use frame::{Frame, Rotation};
pub use gaussian::gaussian_shares;
pub(crate) use groups::Groups;
pub use key::{Key, KeyBuilder};
pub(crate) use once::once;
pub use seed::{Draws, Seed};
pub use simplex::simplex_point;
pub(crate) use svg::{SvgError, read_svg};
