//! Presets: the RON text that a designer writes, and the checked [`Plan`] that it means.
//!
//! A text becomes tokens (`token`), a tree of values with places (`syntax`), and values checked by tables (`schema`,
//! `reader`); `set`, `pick`, `look`, `output`, `species` and `guiding` hold the tables and lower them once to `plan`,
//! whose parameter structs hold no `Option` and no value out of range. Every later stage reads its own struct from `plan`
//! and nothing else.

mod asked;
mod blend_rules;
mod blends;
mod decided;
mod edit;
mod guiding;
mod json_schema;
mod knobs;
mod look;
mod morphs;
mod nearest;
mod output;
mod path;
mod pick;
mod place;
pub mod plan;
mod reader;
mod report;
mod schema;
mod set;
mod shapes;
mod sketches;
mod species;
mod surroundings;
mod syntax;
mod token;
mod variants;

pub(crate) use asked::data_asked_for;
pub use edit::{Edit, EditError, edited, value_of};
pub use json_schema::describe_json;
pub use knobs::{Knob, KnobsOf, Turns, knobs};
pub(crate) use look::{BARE_IN_WINTER, TURNED};
pub(crate) use nearest::nearest;
pub use path::beside;
pub use place::place;
pub use plan::Plan;
pub use schema::describe;
pub use set::load;
pub use species::species;

#[cfg(test)]
mod tests;
