//! Treewright turns a few source trees into sets of engine-ready tree assets.
//!
//! A preset (RON) names sources, grown by guiding-vector synthesis or imported from scans; variants come from blending
//! them; each is dressed with twigs and leaves, given levels of detail down to a billboard cloud, and written as glTF
//! with one shared atlas. ARCHITECTURE.md tells the story of the folders; a folder imports from those above it only:

pub mod bake;
pub mod base;
pub mod blend;
pub mod build;
#[cfg(feature = "cli")]
pub mod cli;
pub mod dress;
pub mod export;
pub mod lod;
pub mod mesh;
pub mod plant;
pub mod preset;
#[cfg(feature = "preview")]
pub mod preview;
pub mod relate;
pub mod select;
pub mod sketch;
pub mod source;
#[cfg(feature = "cli")]
pub mod watch;
