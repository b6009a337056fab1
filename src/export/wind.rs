//! What vertices tell about wind, as attributes.

use gltf_json as json;
use json::accessor::{ComponentType, Type};
use json::mesh::Semantic;
use json::validation::Checked::Valid;

use super::glb::Writer;
use crate::mesh::{Mesh, Wind};

impl Writer<'_> {
    /// Adds bend and phase as the first texture coordinates that are free, and in the two after that the limb's pivot, x and
    /// y, then z and how far the limb swings. No attribute of an own name, which some loaders refuse a file for; Bevy alone,
    /// which reads two sets of texture coordinates, gets pivot and swing as one, and beside light maps bend and phase, too.
    pub(super) fn wind(&mut self, primitive: &mut json::mesh::Primitive, wind: &Wind, mesh: &Mesh) {
        let count = mesh.positions.len();
        let swings =
            || wind.pivots.iter().zip(&wind.weights).map(|(pivot, weights)| pivot.extend(weights[1]).to_array());
        if self.custom {
            let view = self.vertex_view(swings().flatten().flat_map(f32::to_le_bytes));
            let accessor = self.accessor(view, count, ComponentType::F32, Type::Vec4);
            primitive.attributes.insert(Valid(Semantic::Extras("WIND".to_owned())), accessor);
        }
        let first = if mesh.lightmap.is_empty() { 1 } else { 2 };
        let bend = || wind.bend_and_phase().into_iter().map(|v| v.to_array());
        if self.custom && first > 1 {
            let view = self.vertex_view(bend().flatten().flat_map(f32::to_le_bytes));
            let accessor = self.accessor(view, count, ComponentType::F32, Type::Vec2);
            primitive.attributes.insert(Valid(Semantic::Extras("WIND_BEND".to_owned())), accessor);
            return;
        }
        let mut sets: Vec<Vec<[f32; 2]>> = vec![bend().collect()];
        if !self.custom {
            sets.extend([
                swings().map(|[x, y, ..]| [x, y]).collect(),
                swings().map(|[.., z, swing]| [z, swing]).collect(),
            ]);
        }
        for (k, pairs) in sets.into_iter().enumerate() {
            let view = self.vertex_view(pairs.iter().flatten().flat_map(|v| v.to_le_bytes()));
            let accessor = self.accessor(view, count, ComponentType::F32, Type::Vec2);
            primitive.attributes.insert(Valid(Semantic::TexCoords(first + k as u32)), accessor);
        }
    }
}
