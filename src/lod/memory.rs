//! What the levels of one tree are made of, to be remembered level by level.

use std::sync::Arc;

use serde::Serialize;

use super::agree::Outlines;
use super::impostor::Impostor;
use super::measure::{Measured, Reference};
use super::tile::Tile;
use crate::bake::Silhouette;
use crate::mesh::{Mesh, TreeMesh};
use crate::preset::plan::Lod;

/// What one level of a tree hangs on, beside the tree, how it is meshed, the leaf pictures and the seed: another budget of
/// one level leaves the others as they are.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rung {
    pub(super) lod: Lod,
    /// Of those that bring pictures.
    pub(super) texels: Option<u32>,
    /// Most triangles of a cloud.
    pub(super) triangles: usize,
}

/// A level by itself.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Its own tiles are counted from the leaf pictures on.
    pub(super) mesh: TreeMesh,
    pub(super) tiles: Vec<Tile>,
    pub(super) impostor: Option<Impostor>,
    /// Its outlines, as many samples high as its kind is compared on.
    pub(super) drawn: Vec<Silhouette>,
}

impl Piece {
    /// A mesh that wears leaf pictures only.
    pub(super) const fn plain(mesh: TreeMesh, drawn: Vec<Silhouette>) -> Self {
        Self { mesh, tiles: Vec::new(), impostor: None, drawn }
    }

    /// Triangles where each of its cards is written so often.
    pub(super) fn triangles(&self, sides: usize) -> usize {
        (self.mesh.bark.indices.len() + self.mesh.leaf.indices.len() * sides) / 3
    }

    /// Bytes that it takes, about.
    #[must_use]
    pub fn weight(&self) -> usize {
        let mesh = |mesh: &Mesh| mesh.positions.len() * 64 + mesh.indices.len() * 4;
        let tiles: usize = self.tiles.iter().map(Tile::weight).sum();
        mesh(&self.mesh.bark) + mesh(&self.mesh.leaf) + tiles + self.drawn.iter().map(Silhouette::weight).sum::<usize>()
    }
}

/// Where a level takes over.
#[derive(Clone, Copy, Debug)]
pub struct Footing {
    /// The share of the screen's height that the tree covers there.
    pub(super) size: f32,
    /// How well its outlines agree there.
    pub(super) measured: Measured,
}

/// How the colours of a level compare with the full one's at one size: see [`Measured`].
#[derive(Clone, Copy, Debug)]
pub struct Colors {
    pub(super) color: f32,
    pub(super) flip: f32,
    /// By how much its pictures are brightened.
    pub(super) gain: f32,
    /// How the outlines of an impostor agree there that is shown without its shader.
    pub(super) plain: Option<Measured>,
}

impl Colors {
    /// As they were measured, of pictures that were brightened so.
    pub(super) const fn of(measured: &Measured, gain: f32) -> Self {
        Self { color: measured.color, flip: measured.flip, gain, plain: None }
    }
}

/// Who remembers what the levels of one tree are made of and measured with: answers with what the last argument makes, now
/// or earlier for the same question.
pub trait Memory: Sync {
    /// A level.
    fn level(&self, rung: &Rung, make: &mut dyn FnMut() -> Piece) -> Arc<Piece>;
    /// Where a level takes over, of some sizes.
    fn footing(&self, rung: &Rung, sizes: &[usize], make: &mut dyn FnMut() -> Footing) -> Footing;
    /// A level's colours where the tree is so many pixels high.
    fn colors(&self, rung: &Rung, pixels: u32, make: &mut dyn FnMut() -> Colors) -> Colors;
    /// The full level's outlines, so many samples high.
    fn outlines(&self, lines: u32, make: &mut dyn FnMut() -> Outlines) -> Arc<Outlines>;
    /// The full level in plain colours, so many pixels high.
    fn reference(&self, pixels: u32, make: &mut dyn FnMut() -> Reference) -> Arc<Reference>;
}

/// Makes all anew.
pub(super) struct Forgetful;

impl Memory for Forgetful {
    fn level(&self, _: &Rung, make: &mut dyn FnMut() -> Piece) -> Arc<Piece> {
        Arc::new(make())
    }

    fn footing(&self, _: &Rung, _: &[usize], make: &mut dyn FnMut() -> Footing) -> Footing {
        make()
    }

    fn colors(&self, _: &Rung, _: u32, make: &mut dyn FnMut() -> Colors) -> Colors {
        make()
    }

    fn outlines(&self, _: u32, make: &mut dyn FnMut() -> Outlines) -> Arc<Outlines> {
        Arc::new(make())
    }

    fn reference(&self, _: u32, make: &mut dyn FnMut() -> Reference) -> Arc<Reference> {
        Arc::new(make())
    }
}
