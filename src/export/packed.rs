//! Meshes for the web: quantized, and packed by meshoptimizer's codecs.
//!
//! Positions are whole numbers of 16 bits in a cube around the whole variant, that the nodes' scale and translation bring to
//! its place (one scale for all axes, so that normals stay), and not normalized ones, whose bounds some engines take as they
//! stand: they culled what they drew; normals and tangents 8 bits; texture coordinates of the atlas 16 bits,
//! those of bark, which leave 0..=1, stay floats. Each view is packed by `EXT_meshopt_compression` with the vertex codec's
//! version 0, which is the one that the extension knows. Triangles are reordered for the vertex cache, which the index
//! codec wants.
//!
//! A 20 m tree is off by at most 0.2 mm. Source: KHR_mesh_quantization, EXT_meshopt_compression.

use gltf_json as json;
use json::Index;
use json::accessor::{ComponentType, Type};
use json::mesh::Semantic;
use json::validation::Checked::Valid;
use json::validation::USize64;

use glam::Vec3;

use super::glb::{Part, Writer, unit};
use crate::mesh::{Mesh, Wind, optimize};

/// The cube that positions are counted in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cube {
    pub(super) low: Vec3,
    /// Metres that the largest number stands for.
    pub(super) edge: f32,
}

impl Cube {
    /// The smallest around some points.
    pub(super) fn around<'a>(points: impl Iterator<Item = &'a Vec3>) -> Self {
        let (low, high) = points.fold((Vec3::MAX, Vec3::MIN), |(l, h), &p| (l.min(p), h.max(p)));
        if low.cmple(high).all() {
            Self { low, edge: (high - low).max_element().max(1e-6) }
        } else {
            Self { low: Vec3::ZERO, edge: 1.0 }
        }
    }

    /// A place in it, as it is counted.
    fn counted(&self, place: Vec3) -> [u16; 3] {
        ((place - self.low) / self.edge).to_array().map(|v| (v.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16)
    }
}

fn signed(v: f32) -> u8 {
    ((v.clamp(-1.0, 1.0) * 127.0 + if v < 0.0 { -0.5 } else { 0.5 }) as i8) as u8
}

fn share(v: f32) -> [u8; 2] {
    ((v.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16).to_le_bytes()
}

impl Writer<'_> {
    /// Adds a primitive of a mesh that was checked; `triangles` are its proper ones.
    pub(super) fn packed_primitive(
        &mut self,
        part: Part,
        mesh: &Mesh,
        triangles: Vec<u32>,
        cube: Cube,
        wind: Option<&Wind>,
    ) -> Result<json::mesh::Primitive, String> {
        let mut mesh = Mesh { indices: triangles, ..mesh.clone() };
        let order = optimize(&mut mesh).map_err(|e| e.to_string())?;
        let count = mesh.positions.len();
        let mut attributes = std::collections::BTreeMap::new();

        let quantized: Vec<[u16; 3]> = mesh.positions.iter().map(|&p| cube.counted(p)).collect();
        let bytes: Vec<[u8; 8]> = quantized
            .iter()
            .map(|p| {
                let [x, y, z] = p.map(u16::to_le_bytes);
                [x[0], x[1], y[0], y[1], z[0], z[1], 0, 0]
            })
            .collect();
        let view = self.packed_view(&bytes, "ATTRIBUTES")?;
        let accessor = self.accessor(view, count, ComponentType::U16, Type::Vec3);
        let bound = |pick: fn(u16, u16) -> u16, first: u16| {
            quantized.iter().fold([first; 3], |a, p| [pick(a[0], p[0]), pick(a[1], p[1]), pick(a[2], p[2])])
        };
        let (low, high) = (bound(u16::min, u16::MAX), bound(u16::max, 0));
        let positions = &mut self.root.accessors[accessor.value()];
        positions.min = Some(serde_json::json!(low));
        positions.max = Some(serde_json::json!(high));
        attributes.insert(Valid(Semantic::Positions), accessor);

        let bytes: Vec<[u8; 4]> = (mesh.normals.iter())
            .map(|&n| unit(n, Vec3::Y).to_array().map(signed))
            .map(|[x, y, z]| [x, y, z, 0])
            .collect();
        let view = self.packed_view(&bytes, "ATTRIBUTES")?;
        attributes.insert(Valid(Semantic::Normals), self.normalized(view, count, ComponentType::I8, Type::Vec3));

        let bytes: Vec<[u8; 4]> = (mesh.tangents.iter())
            .map(|&[x, y, z, w]| {
                let [x, y, z] = unit(Vec3::new(x, y, z), Vec3::X).to_array().map(signed);
                [x, y, z, signed(if w < 0.0 { -1.0 } else { 1.0 })]
            })
            .collect();
        let view = self.packed_view(&bytes, "ATTRIBUTES")?;
        attributes.insert(Valid(Semantic::Tangents), self.normalized(view, count, ComponentType::I8, Type::Vec4));

        let inside = mesh.uvs.iter().all(|uv| uv.cmpge(glam::Vec2::ZERO).all() && uv.cmple(glam::Vec2::ONE).all());
        let uvs = if inside {
            let bytes: Vec<[u8; 4]> =
                (mesh.uvs.iter()).map(|uv| (share(uv.x), share(uv.y))).map(|(u, v)| [u[0], u[1], v[0], v[1]]).collect();
            let view = self.packed_view(&bytes, "ATTRIBUTES")?;
            self.normalized(view, count, ComponentType::U16, Type::Vec2)
        } else {
            let view = self.packed_view(&pairs(&mesh.uvs), "ATTRIBUTES")?;
            self.accessor(view, count, ComponentType::F32, Type::Vec2)
        };
        attributes.insert(Valid(Semantic::TexCoords(0)), uvs);
        if !mesh.lightmap.is_empty() {
            let view = self.packed_view(&pairs(&mesh.lightmap), "ATTRIBUTES")?;
            let accessor = self.accessor(view, count, ComponentType::F32, Type::Vec2);
            attributes.insert(Valid(Semantic::TexCoords(1)), accessor);
        }
        if let Some(wind) = wind {
            let first = if mesh.lightmap.is_empty() { 1 } else { 2 };
            for (k, (values, is_share)) in wind_sets(wind, &order, cube).into_iter().enumerate() {
                let view = self.packed_view(&values, "ATTRIBUTES")?;
                let accessor = self.accessor(view, count, ComponentType::U16, Type::Vec2);
                self.root.accessors[accessor.value()].normalized = is_share;
                attributes.insert(Valid(Semantic::TexCoords(first + k as u32)), accessor);
            }
        }

        let bytes: Vec<[u8; 4]> = mesh.occlusion.iter().map(|&o| [o, o, o, 255]).collect();
        let view = self.packed_view(&bytes, "ATTRIBUTES")?;
        attributes.insert(Valid(Semantic::Colors(0)), self.normalized(view, count, ComponentType::U8, Type::Vec4));

        let encoded = meshopt::encode_index_buffer(&mesh.indices, count).map_err(|e| e.to_string())?;
        let short = count <= usize::from(u16::MAX);
        let (size, kind) = if short { (2, ComponentType::U16) } else { (4, ComponentType::U32) };
        let view = self.push_packed(&encoded, mesh.indices.len(), size, "TRIANGLES");
        let indices = self.accessor(view, mesh.indices.len(), kind, Type::Scalar);
        Ok(json::mesh::Primitive {
            attributes,
            extensions: None,
            extras: None,
            indices: Some(indices),
            material: Some(self.material(part)),
            mode: Valid(json::mesh::Mode::Triangles),
            targets: None,
        })
    }

    fn normalized(
        &mut self,
        view: Index<json::buffer::View>,
        count: usize,
        component: ComponentType,
        shape: Type,
    ) -> Index<json::Accessor> {
        let accessor = self.accessor(view, count, component, shape);
        self.root.accessors[accessor.value()].normalized = true;
        accessor
    }

    fn packed_view<const N: usize>(
        &mut self,
        values: &[[u8; N]],
        mode: &str,
    ) -> Result<Index<json::buffer::View>, String> {
        let encoded = meshopt::encode_vertex_buffer_level(values, 2, Some(0)).map_err(|e| e.to_string())?;
        Ok(self.push_packed(&encoded, values.len(), N, mode))
    }

    /// A view of the fallback buffer, which holds nothing, with the packed bytes in its extension.
    fn push_packed(&mut self, encoded: &[u8], count: usize, size: usize, mode: &str) -> Index<json::buffer::View> {
        let start = self.append(encoded.iter().map(|byte| [[*byte]]));
        let fallback = self.unpacked.next_multiple_of(8);
        self.unpacked = fallback + count * size;
        let vertices = mode == "ATTRIBUTES";
        let mut told = serde_json::json!({
            "buffer": 0, "byteOffset": start, "byteLength": encoded.len(), "byteStride": size, "count": count, "mode": mode,
        });
        if start == 0 {
            told.as_object_mut().map(|o| o.remove("byteOffset"));
        }
        let mut extensions = json::extensions::buffer::View::default();
        extensions.others.insert("EXT_meshopt_compression".to_owned(), told);
        let target =
            if vertices { json::buffer::Target::ArrayBuffer } else { json::buffer::Target::ElementArrayBuffer };
        self.root.push(json::buffer::View {
            buffer: Index::new(1),
            byte_length: USize64::from(count * size),
            byte_offset: Some(USize64::from(fallback)),
            byte_stride: vertices.then_some(json::buffer::Stride(size)),
            name: None,
            target: Some(Valid(target)),
            extensions: Some(extensions),
            extras: None,
        })
    }
}

/// The texture sets of the wind, by vertices in their new order, and whether their numbers are shares: pivots are counted as
/// positions are, and the swing beside them in 65,535 parts.
fn wind_sets(wind: &Wind, order: &[usize], cube: Cube) -> [(Vec<[u8; 4]>, bool); 4] {
    let of = |pair: &dyn Fn(usize) -> [[u8; 2]; 2]| {
        let bytes = |&i: &usize| {
            let [[a, b], [c, d]] = pair(i);
            [a, b, c, d]
        };
        order.iter().map(bytes).collect()
    };
    let bends = wind.bend_and_phase();
    let pivot = |i: usize| cube.counted(wind.pivots[i]).map(u16::to_le_bytes);
    [
        (of(&|i| [share(bends[i].x), share(bends[i].y)]), true),
        (of(&|i| [pivot(i)[0], pivot(i)[1]]), false),
        (of(&|i| [pivot(i)[2], share(wind.weights[i][1])]), false),
        (of(&|i| [share(wind.leaves[i].x), share(wind.leaves[i].y)]), true),
    ]
}

fn pairs(values: &[glam::Vec2]) -> Vec<[u8; 8]> {
    values
        .iter()
        .map(|uv| {
            let (u, v) = (uv.x.to_le_bytes(), uv.y.to_le_bytes());
            [u[0], u[1], u[2], u[3], v[0], v[1], v[2], v[3]]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    #[test]
    fn wind_is_that_of_the_vertices_in_their_new_order_and_pivots_are_counted_as_positions() {
        let places = [Vec3::ZERO, Vec3::new(1.0, 2.0, 4.0), Vec3::new(4.0, 3.0, 0.0)];
        let cube = Cube::around(places.iter());
        let wind = Wind {
            weights: [0.0, 0.5, 1.0].map(|swing| [1.0, swing, 0.25]).to_vec(),
            pivots: places.to_vec(),
            leaves: [0.0, 0.5, 1.0].map(|v| Vec2::new(v, 1.0 - v)).to_vec(),
        };
        let number = |[a, b, c, d]: [u8; 4]| [u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])];
        let sets =
            wind_sets(&wind, &[2, 0, 1], cube).map(|(values, _)| values.into_iter().map(number).collect::<Vec<_>>());
        for (place, vertex) in [2_usize, 0, 1].into_iter().enumerate() {
            let [x, y, z] = cube.counted(places[vertex]);
            let share = [0, 32768, 65535][vertex];
            assert_eq!(sets[1][place], [x, y]);
            assert_eq!(sets[2][place], [z, share]);
            assert_eq!(sets[3][place], [share, 65535 - share + u16::from(vertex == 1)]);
            assert_eq!(sets[0][place][1], 16384);
        }
    }
}
