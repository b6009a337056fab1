//! Geometry: from a dressed plant to triangles.

mod bareness;
mod bark_uv;
mod bearer;
mod canopy;
mod card;
mod check;
mod crown_light;
mod cut;
mod ears;
mod fit;
mod gate;
mod ground;
mod keyed;
#[cfg(feature = "lightmap")]
mod lightmap;
mod rings;
mod roots;
mod shapes;
mod sides;
mod sweep;
mod tangent;
#[cfg(test)]
mod tests;
mod tube;
mod wind;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::base::bulk;

pub(crate) use bareness::bareness;
pub(crate) use card::least_leaf;
pub use card::{CardShape, Cards, LeafCard, all_cards, leaf_cards, leaf_cards_in};
pub use check::{Closure, closure, fork_gaps, problems};
pub use crown_light::CrownLight;
pub use cut::CardCut;
pub use gate::{MeshError, check_indices, optimize};
pub use keyed::{Key, KeyPlant, card_key, card_mesh, keyed_tubes, picked_leaves};
#[cfg(feature = "lightmap")]
pub use lightmap::{LightmapError, unwrap_lightmap};
pub use tangent::add_tangents;
pub use tube::{TubeDetail, Wood, tubes, tubes_in};
pub use wind::{Limbs, NO_CHAIN, Wind};

/// An indexed triangle mesh, counter-clockwise from outside; all vertex arrays are of equal length.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Metres, Y up.
    #[serde(with = "bulk")]
    pub positions: Vec<Vec3>,
    /// Unit vectors.
    #[serde(with = "bulk")]
    pub normals: Vec<Vec3>,
    /// Unit tangent x, y, z and the bitangent's sign w (glTF).
    #[serde(with = "bulk")]
    pub tangents: Vec<[f32; 4]>,
    /// Texture coordinates, v down (glTF). For leaf meshes they lie in the tile that `tiles` names until the atlas is
    /// packed.
    #[serde(with = "bulk")]
    pub uvs: Vec<Vec2>,
    /// Coordinates of the second set, overlap-free in 0..=1 over both primitives of a level, but that backs of leaves share the light
    /// of their fronts; empty unless the preset asks for light maps.
    #[serde(with = "bulk")]
    pub lightmap: Vec<Vec2>,
    /// Ambient occlusion, 255 is open sky.
    #[serde(with = "bulk")]
    pub occlusion: Vec<u8>,
    /// For leaf meshes the picture that each vertex takes its coordinates from, an index into the set's tiles; empty
    /// for bark.
    #[serde(with = "bulk")]
    pub tiles: Vec<u32>,
    /// The chain that each vertex is on or hangs on, `u32::MAX` for what stands for many; empty where nobody asks: for
    /// [`Limbs`].
    #[serde(with = "bulk")]
    pub chains: Vec<u32>,
    /// Three a triangle.
    #[serde(with = "bulk")]
    pub indices: Vec<u32>,
}

impl Mesh {
    /// Area of its triangles, square metres.
    #[must_use]
    pub fn area(&self) -> f32 {
        let corner = |i: u32| self.positions[i as usize];
        let one = |[a, b, c]: &[u32; 3]| 0.5 * (corner(*b) - corner(*a)).cross(corner(*c) - corner(*a)).length();
        self.indices.as_chunks().0.iter().map(one).sum()
    }

    /// Empty, with room for so many vertices and indices of wood.
    fn with_room(vertices: usize, indices: usize) -> Self {
        Self {
            positions: Vec::with_capacity(vertices),
            normals: Vec::with_capacity(vertices),
            tangents: Vec::with_capacity(vertices),
            uvs: Vec::with_capacity(vertices),
            occlusion: Vec::with_capacity(vertices),
            chains: Vec::with_capacity(vertices),
            indices: Vec::with_capacity(indices),
            ..Self::default()
        }
    }

    /// Adds the other side of each triangle, with the same normals. Its vertices are its own: Blender takes two triangles
    /// between the same three for one.
    pub fn double(&mut self) {
        let mut backs = self.clone();
        backs.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        self.append(&backs);
    }

    /// Adds all of `part`; both have the same arrays.
    pub(crate) fn append(&mut self, part: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend_from_slice(&part.positions);
        self.normals.extend_from_slice(&part.normals);
        self.tangents.extend_from_slice(&part.tangents);
        self.uvs.extend_from_slice(&part.uvs);
        self.lightmap.extend_from_slice(&part.lightmap);
        self.occlusion.extend_from_slice(&part.occlusion);
        self.tiles.extend_from_slice(&part.tiles);
        self.chains.extend_from_slice(&part.chains);
        self.indices.extend(part.indices.iter().map(|i| i + first));
    }
}

/// The two primitives of one level of detail.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TreeMesh {
    /// Wood; wears the set's tiling bark.
    pub bark: Mesh,
    /// Leaves and cards; wear the set's atlas.
    pub leaf: Mesh,
}
