//! What a tree's levels are made of: the full level's mesh, and the budgets of the others.

use serde::{Deserialize, Serialize};

/// How much of a tree's extent tubes may stray by where a preset tells no error: a tree of less than four metres would lose the
/// bends of its trunk at the usual one.
pub const USUAL_ERROR_SHARE: f32 = 1.0 / 400.0;

/// A bound on triangles that bounds nothing.
pub const ANY: u32 = u32::MAX;

/// The full level's mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshParams {
    /// Sides of the thickest tube at LOD0, 3..=64.
    pub sides: u32,
    /// How many it may have where so few would stray further than `error`, `sides`..=64.
    pub most_sides: u32,
    /// Largest distance between a tube and the smooth branch at LOD0, metres; twigs in leaf may stray 2.5 times as far.
    pub error: f32,
    /// Largest share of a tree's extent that this may be; 0 where a preset tells an error.
    pub error_share: f32,
    /// Height of one bark tile on the trunk, metres.
    pub bark_tile: f32,
    /// How a branch leaves its parent.
    pub forks: Forks,
    /// What leaves are drawn on; not written where it is the usual, so that such plans keep their keys.
    #[serde(skip_serializing_if = "is_folded")]
    pub leaves: LeafCards,
    /// Most triangles of a tree; [`ANY`] for as many as it takes, which is not written either.
    #[serde(skip_serializing_if = "is_any")]
    pub most: u32,
    /// How the backs of leaves are drawn.
    pub backs: Backs,
    /// How far stems go on below the ground, metres; not written where they don't.
    #[serde(skip_serializing_if = "is_nothing")]
    pub below: f32,
    /// Share of what a stem's foot flares that is drawn out into roots, 0..=1.
    pub roots: f32,
    /// How much wider, as a share of its radius, a stem's foot gets that is not so much wider by itself, 0..=2.
    pub flare: f32,
}

/// How much wider feet get, unless told.
pub const USUAL_FLARE: f32 = 0.38;

impl MeshParams {
    /// Those of a preset that tells sides and error, metres, and nothing else, with bark tiles of a metre and round feet, which flare.
    #[must_use]
    pub const fn told(sides: u32, error: f32) -> Self {
        let (forks, leaves, backs) = (Forks::Collar, LeafCards::Folded, Backs::Doubled);
        let (error_share, bark_tile, below, roots, flare, most) = (0.0, 1.0, 0.0, 0.0, USUAL_FLARE, ANY);
        Self {
            sides,
            most_sides: sides,
            error,
            error_share,
            bark_tile,
            forks,
            leaves,
            most,
            backs,
            below,
            roots,
            flare,
        }
    }

    /// As a tree of such an extent, metres, is meshed.
    #[must_use]
    pub fn on(&self, extent: f32) -> Self {
        let most = if self.error_share > 0.0 { extent * self.error_share } else { f32::INFINITY };
        Self { error: self.error.min(most), ..self.clone() }
    }
}

/// What leaves are drawn on at LOD0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize)]
pub enum LeafCards {
    /// Flat squares of two triangles.
    Flat,
    /// Squares folded along the middle: four triangles.
    #[default]
    Folded,
    /// Arched to the tip and folded: eight triangles.
    Bent,
    /// Folded, and cut to the outline of the picture.
    CutOut {
        /// Most corners of the outline, 8..=32.
        corners: u32,
    },
}

fn is_folded(leaves: &LeafCards) -> bool {
    *leaves == LeafCards::Folded
}

/// How the backs of leaves and of clouds' cards are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize)]
pub enum Backs {
    /// By triangles of their own, with the normals of the front.
    #[default]
    Doubled,
    /// By the material: most engines turn the normals there.
    DoubleSided,
}

impl Backs {
    /// How often leaves and cards are written.
    #[must_use]
    pub const fn sides(self) -> usize {
        match self {
            Self::Doubled => 2,
            Self::DoubleSided => 1,
        }
    }
}

fn is_nothing(metres: &f32) -> bool {
    *metres == 0.0
}

fn is_any(most: &u32) -> bool {
    *most == ANY
}

/// How a branch leaves its parent's wood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Forks {
    /// Through a collar that widens towards the parent: five more rings a branch.
    Collar,
    /// Straight out of it: the fewest triangles.
    Plain,
}

/// A level of detail.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Lod {
    /// Everything.
    Full,
    /// About this share of the full level's triangles.
    Thinned {
        /// 0..1.
        triangles: f32,
        /// Most triangles, whatever the share is; [`ANY`] for any number.
        most: u32,
    },
    /// Leaves and thin branches as at most this many textured cards.
    BillboardCloud {
        /// 4..=512.
        cards: u32,
    },
    /// Two crossed quads.
    CrossedQuads,
    /// A sheet of views for a hemi-octahedral impostor, on crossed quads where an engine has no shader for it.
    Impostor {
        /// Views along an edge of the sheet, 4..=24.
        frames: u32,
    },
}

impl Lod {
    /// How often this level's leaves and cards are written: crossed quads and impostors stand back to back as they are.
    #[must_use]
    pub const fn sides(&self, backs: Backs) -> usize {
        match self {
            Self::CrossedQuads | Self::Impostor { .. } => 1,
            _ => backs.sides(),
        }
    }

    /// A share of the full level's triangles, 0..1, and no other bound.
    #[must_use]
    pub const fn thinned(triangles: f32) -> Self {
        Self::Thinned { triangles, most: ANY }
    }
}

/// A level of detail, and where it takes over.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LodBudget {
    /// What it is made of.
    pub lod: Lod,
    /// Largest height of the tree, as a share of the screen's, at which it is shown, 0.002..=1; falls from level to level.
    /// None: measured, where it agrees with the full level.
    pub screen: Option<f32>,
}

impl From<Lod> for LodBudget {
    fn from(lod: Lod) -> Self {
        Self { lod, screen: None }
    }
}
