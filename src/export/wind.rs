//! What vertices tell about wind, as attributes.

use gltf_json as json;
use json::accessor::{ComponentType, Type};
use json::mesh::Semantic;
use json::validation::Checked::Valid;

use super::glb::Writer;
use crate::mesh::{Mesh, Wind};

impl Writer<'_> {
    /// Adds bend and phase as the first texture coordinates that are free, in the two after that the limb's pivot, x and y,
    /// then z and how far the limb swings, and then how far the leaf flutters and its phase. No attribute of an own name,
    /// which some loaders refuse a file for; Bevy alone, which reads two sets of texture coordinates, gets pivot and swing as
    /// one, what leaves do as another, and beside light maps bend and phase, too.
    pub(super) fn wind(&mut self, primitive: &mut json::mesh::Primitive, wind: &Wind, mesh: &Mesh) {
        let count = mesh.positions.len();
        let swings =
            || wind.pivots.iter().zip(&wind.weights).map(|(pivot, weights)| pivot.extend(weights[1]).to_array());
        let first = if mesh.lightmap.is_empty() { 1 } else { 2 };
        let bend = || wind.bend_and_phase().into_iter().map(|v| v.to_array());
        let leaves = || wind.leaves.iter().map(|v| v.to_array());
        let mut sets: Vec<Vec<[f32; 2]>> = Vec::new();
        if self.custom {
            self.own(primitive, "WIND", swings());
            self.own(primitive, "WIND_LEAF", leaves());
            if first > 1 {
                self.own(primitive, "WIND_BEND", bend());
            } else {
                sets.push(bend().collect());
            }
        } else {
            sets.push(bend().collect());
            sets.push(swings().map(|[x, y, ..]| [x, y]).collect());
            sets.push(swings().map(|[.., z, swing]| [z, swing]).collect());
            sets.push(leaves().collect());
        }
        for (k, pairs) in sets.into_iter().enumerate() {
            let view = self.array_view(pairs.iter().map(|pair| pair.map(f32::to_le_bytes)));
            let accessor = self.accessor(view, count, ComponentType::F32, Type::Vec2);
            primitive.attributes.insert(Valid(Semantic::TexCoords(first + k as u32)), accessor);
        }
    }

    /// Adds an attribute of an own name.
    fn own<const N: usize>(
        &mut self,
        primitive: &mut json::mesh::Primitive,
        name: &str,
        values: impl Iterator<Item = [f32; N]> + Clone,
    ) {
        let shape = if N == 2 { Type::Vec2 } else { Type::Vec4 };
        let count = values.clone().count();
        let view = self.array_view(values.map(|value| value.map(f32::to_le_bytes)));
        let accessor = self.accessor(view, count, ComponentType::F32, shape);
        primitive.attributes.insert(Valid(Semantic::Extras(name.to_owned())), accessor);
    }
}
