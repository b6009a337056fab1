//! Presets: the RON text that a designer writes, and the checked [`Plan`] that it means.
//!
//! `schema` is exactly the text; `resolve` lowers it once to `plan`, whose parameter structs hold no `Option` and no
//! value out of range. Every later stage reads its own struct from `plan` and nothing else.

pub mod plan;

pub use plan::Plan;
