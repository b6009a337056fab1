//! Treewright turns a few source trees into sets of engine-ready tree assets.
//!
//! A preset (RON) names sources, grown by guiding-vector synthesis or imported from scans; variants come from blending
//! them; each is dressed with twigs and leaves, given levels of detail down to a billboard cloud, and written as glTF
//! with one shared atlas. ARCHITECTURE.md tells the story of the folders; a folder imports from those above it only.
//!
//! The main path, in memory: a preset and the species that it names go in, the files of a set come out.
//! [`build::Builder`] does the same for files on disk, and knows what is current.
//!
//! ```
//! use std::collections::BTreeMap;
//!
//! let species = "(
//!     height: 3.0,
//!     nodes: 500,
//!     iterations: [(endpoints: Volume(shape: HalfEllipsoid(bottom: 0.35, top: 0.9, radius: 0.36), count: 6))],
//! )";
//! let preset = r#"(
//!     sources: {"a": Grow(species: "bush.ron", seed: 1), "b": Grow(species: "bush.ron", seed: 2)},
//!     variants: [Source("a"), Blend(of: ["a", "b"], count: 2)],
//!     foliage: (leaf: "birch", density: 0.1, most: 20, pictures: 1, resolution: 64),
//!     bark: (resolution: 64),
//!     lods: [Full],
//!     atlas: (size: 256),
//! )"#;
//! let files = BTreeMap::from([
//!     ("hedge.ron".to_owned(), preset.as_bytes().to_vec()),
//!     ("bush.ron".to_owned(), species.as_bytes().to_vec()),
//! ]);
//! let set = treewright::build::make_set("hedge.ron", files)?;
//! let trees: Vec<_> = set.files.iter().filter(|(name, _)| name.ends_with(".glb")).collect();
//! assert_eq!(trees.len(), 3);
//! assert!(trees.iter().all(|(_, bytes)| bytes.starts_with(b"glTF")));
//! # Ok::<(), treewright::build::BuildError>(())
//! ```

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
