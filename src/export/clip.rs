//! A sequence as one animated GLB: morph targets, which every engine that reads glTF animations plays.
//!
//! Wood is a mesh with a target for each key but one; the weights go from one to the next, so each vertex moves along a
//! polyline. That one is the largest: viewers frame and cull by what a mesh is without its targets, and a sapling's box cuts
//! the grown tree off. glTF asks readers for eight morphed attributes, which are four targets (Cesium stops drawing at more),
//! so a longer clip has a mesh of wood for each four steps of it, shown by a scale of 1 or 0. Leaves change their pictures,
//! which a texture coordinate that stays cannot: there is a leaf mesh for each key, with the picture that is worn about then,
//! shown from the middle before the key to the middle after it by a scale of 1 or 0 that steps; its two targets are where the
//! leaves stand at those middles. So one picture is seen at a time, and leaves do not jump when they change it.
//!
//! A node with a scale of 0 is not drawn (glTF 2.0, 3.5.3). Where all keys wear the same pictures one leaf mesh with all
//! keys would do; it is written likewise, since then no case is special.
//!
//! Why no skins: chains bend while they morph, so a skin would need a bone for each ring.

use glam::Vec3;
use gltf_json as json;
use json::Index;
use json::accessor::{ComponentType, Type};
use json::validation::Checked::Valid;

use super::SetMaterials;
use super::glb::{ExportError, Part, Writer, proper_triangles, unit};
use crate::mesh::{Key, Mesh, add_tangents};

/// Most targets of a mesh.
const TARGETS: usize = 4;

/// Leaves about one key.
#[derive(Clone, Debug)]
pub struct ClipLeaves {
    /// At the key.
    pub mesh: Mesh,
    /// At the middle before it, and after it; none at the ends of the clip.
    pub around: [Option<Key>; 2],
}

/// A clip to be written.
#[derive(Clone, Copy, Debug)]
pub struct ClipIn<'a> {
    /// Name of the clip and of its root node.
    pub name: &'a str,
    /// The preset's seed, told in the file's extras.
    pub seed: u64,
    /// Times of the keys, rising from 0, seconds; two at least.
    pub times: &'a [f32],
    /// Wood at the first key, with tangents.
    pub wood: &'a Mesh,
    /// Wood at every key.
    pub keys: &'a [Key],
    /// Leaves, one for each key; none for a bare clip.
    pub leaves: &'a [ClipLeaves],
    /// The set's materials.
    pub materials: &'a SetMaterials,
}

/// Writes a clip as GLB; the same input gives the same bytes.
///
/// # Errors
///
/// See [`ExportError`]; keys that don't fit their mesh are an error of that mesh.
pub fn clip_glb(clip: &ClipIn<'_>) -> Result<Vec<u8>, ExportError> {
    let wrong = |what: &str| ExportError::Mesh { name: clip.name.to_owned(), what: what.to_owned() };
    let rising = clip.times.windows(2).all(|pair| pair[0] < pair[1]);
    if clip.times.len() < 2 || !rising || clip.times[0] != 0.0 || clip.keys.len() != clip.times.len() {
        return Err(wrong("its times are not two at least, rising from 0, one a key"));
    }
    if !clip.leaves.is_empty() && clip.leaves.len() != clip.times.len() {
        return Err(wrong("its leaves are not one a key"));
    }
    let mut build =
        Build { writer: Writer::new(clip.materials), nodes: Vec::new(), channels: Vec::new(), samplers: Vec::new() };
    let last = clip.times.len() - 1;
    for (first, end) in (0..last).step_by(TARGETS).map(|first| (first, (first + TARGETS).min(last))) {
        build.wood(clip, (first, end))?;
    }
    let middle = |k: usize| (clip.times[k] + clip.times[k + 1]) * 0.5;
    for (k, leaves) in clip.leaves.iter().enumerate() {
        let targets: Vec<&Key> = leaves.around.iter().flatten().collect();
        let name = format!("{}_leaves_{:02}", clip.name, k + 1);
        let Some(node) = build.node(&name, Part::Leaf, &leaves.mesh, &targets)? else { continue };
        let (from, to) = (if k > 0 { middle(k - 1) } else { 0.0 }, if k < last { middle(k) } else { clip.times[last] });
        // From the middle before, by the key, to the middle after.
        let mut steps: Vec<(f32, bool, bool)> = vec![(clip.times[k], false, false)];
        if leaves.around[0].is_some() && k > 0 {
            steps.insert(0, (from, true, false));
        }
        if leaves.around[1].is_some() && k < last {
            steps.push((to, false, true));
        }
        let [before, after] = [0, 1].map(|i| leaves.around[i].is_some());
        let weights = steps.iter().flat_map(|&(_, at_from, at_to)| {
            let weight = |on: bool| if on { 1.0 } else { 0.0 };
            [before.then(|| weight(at_from)), after.then(|| weight(at_to))].into_iter().flatten()
        });
        if !targets.is_empty() {
            let own: Vec<f32> = steps.iter().map(|s| s.0).collect();
            let times = build.times(&own);
            build.channel(node, times, Property::Weights, weights.collect(), targets.len());
        }
        // Shown in between only.
        let mut shown = vec![(0.0, k == 0)];
        if k > 0 {
            shown.push((from, true));
        }
        if k < last {
            shown.push((to, false));
        }
        build.shown(node, &shown);
    }
    build.finish(clip)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Property {
    Weights,
    Scale,
}

struct Build<'a> {
    writer: Writer<'a>,
    nodes: Vec<Index<json::Node>>,
    channels: Vec<json::animation::Channel>,
    samplers: Vec<json::animation::Sampler>,
}

impl Build<'_> {
    /// Adds the wood from one key to another, and shows it from the time of the one to that of the other.
    fn wood(&mut self, clip: &ClipIn<'_>, (first, end): (usize, usize)) -> Result<(), ExportError> {
        let last = clip.times.len() - 1;
        let size = |key: &Key| {
            let ends = key.positions.iter().fold((Vec3::MAX, Vec3::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
            (ends.1 - ends.0).length()
        };
        let keys = first..=end;
        let rest = keys.clone().max_by(|a, b| size(&clip.keys[*a]).total_cmp(&size(&clip.keys[*b]))).unwrap_or(first);
        let Key { positions, normals } = clip.keys[rest].clone();
        let mut mesh = Mesh { positions, normals, ..clip.wood.clone() };
        if rest > 0 {
            // An error only says that the mesh has no triangles to take tangents from.
            let _ = add_tangents(&mut mesh);
        }
        let moving: Vec<usize> = keys.clone().filter(|key| *key != rest).collect();
        let targets: Vec<&Key> = moving.iter().map(|key| &clip.keys[*key]).collect();
        let name = if first == 0 { format!("{}_wood", clip.name) } else { format!("{}_wood_{first:02}", clip.name) };
        let Some(node) = self.node(&name, Part::Bark, &mesh, &targets)? else { return Ok(()) };
        let at = |key: usize| moving.iter().map(move |of| if *of == key { 1.0 } else { 0.0 });
        // Before the clip plays the first key is seen.
        let root = &mut self.writer.root;
        if let Some(mesh) = root.nodes[node as usize].mesh {
            root.meshes[mesh.value()].weights = Some(at(first).collect());
        }
        let times = self.times(&clip.times[keys.clone()]);
        self.channel(node, times, Property::Weights, keys.flat_map(at).collect(), targets.len());
        if (first, end) != (0, last) {
            let mut shown = vec![(0.0, first == 0)];
            shown.extend((first > 0).then(|| (clip.times[first], true)));
            shown.extend((end < last).then(|| (clip.times[end], false)));
            self.shown(node, &shown);
        }
        Ok(())
    }

    /// Shows a node at some times and hides it at others; what is hidden at first is so before the clip plays.
    fn shown(&mut self, node: u32, shown: &[(f32, bool)]) {
        let own: Vec<f32> = shown.iter().map(|s| s.0).collect();
        let times = self.times(&own);
        let scales = shown.iter().flat_map(|&(_, on)| [if on { 1.0 } else { 0.0 }; 3]).collect();
        self.channel(node, times, Property::Scale, scales, 3);
        if !shown[0].1 {
            self.writer.root.nodes[node as usize].scale = Some([0.0; 3]);
        }
    }

    /// Adds a mesh with its targets and a node that shows it; none for a mesh without triangles.
    fn node(&mut self, name: &str, part: Part, mesh: &Mesh, targets: &[&Key]) -> Result<Option<u32>, ExportError> {
        let wrong = |what: String| ExportError::Mesh { name: name.to_owned(), what };
        let triangles = proper_triangles(mesh).map_err(wrong)?;
        if triangles.is_empty() {
            return Ok(None);
        }
        let count = mesh.positions.len();
        if targets.iter().any(|t| t.positions.len() != count || t.normals.len() != count) {
            return Err(wrong("a key has another number of vertices".to_owned()));
        }
        if targets.iter().any(|t| !t.positions.iter().all(|p| p.is_finite())) {
            return Err(wrong("a key has a position that is not finite".to_owned()));
        }
        let mut primitive = self.writer.primitive(part, mesh, &triangles);
        let mut made = Vec::with_capacity(targets.len());
        for target in targets {
            let positions: Vec<Vec3> =
                target.positions.iter().zip(&mesh.positions).map(|(to, from)| *to - *from).collect();
            // What the writer made of the normals.
            let normals = target.normals.iter().zip(&mesh.normals);
            let normals: Vec<Vec3> = normals.map(|(to, from)| unit(*to, Vec3::Y) - unit(*from, Vec3::Y)).collect();
            let [positions, normals] = [positions, normals].map(|moves| self.moves(&moves));
            made.push(json::mesh::MorphTarget { positions: Some(positions), normals: Some(normals), tangents: None });
        }
        let weights = (!made.is_empty()).then(|| vec![0.0; made.len()]);
        primitive.targets = (!made.is_empty()).then_some(made);
        let root = &mut self.writer.root;
        let mesh = root.push(json::Mesh {
            extensions: None,
            extras: None,
            name: Some(name.to_owned()),
            primitives: vec![primitive],
            weights,
        });
        let node = root.push(json::Node { mesh: Some(mesh), name: Some(name.to_owned()), ..Default::default() });
        self.nodes.push(node);
        Ok(Some(node.value() as u32))
    }

    fn moves(&mut self, moves: &[Vec3]) -> Index<json::Accessor> {
        let (low, high) = moves.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let view = self.writer.array_view(moves.iter().map(|p| p.to_array().map(f32::to_le_bytes)));
        let index = self.writer.accessor(view, moves.len(), ComponentType::F32, Type::Vec3);
        let accessor = &mut self.writer.root.accessors[index.value()];
        accessor.min = Some(serde_json::json!(low.to_array()));
        accessor.max = Some(serde_json::json!(high.to_array()));
        index
    }

    fn numbers(&mut self, numbers: &[f32], count: usize, shape: Type) -> Index<json::Accessor> {
        let view = self.writer.plain_view(numbers.iter().map(|v| [v.to_le_bytes()]));
        self.writer.accessor(view, count, ComponentType::F32, shape)
    }

    fn times(&mut self, times: &[f32]) -> Index<json::Accessor> {
        let index = self.numbers(times, times.len(), Type::Scalar);
        let accessor = &mut self.writer.root.accessors[index.value()];
        accessor.min = Some(serde_json::json!([times[0]]));
        accessor.max = Some(serde_json::json!([times[times.len() - 1]]));
        index
    }

    fn channel(&mut self, node: u32, times: Index<json::Accessor>, property: Property, values: Vec<f32>, width: usize) {
        use json::animation::{Channel, Interpolation, Property as Path, Sampler, Target};
        let (path, interpolation, output) = match property {
            Property::Weights => {
                let output = self.numbers(&values, values.len(), Type::Scalar);
                (Path::MorphTargetWeights, Interpolation::Linear, output)
            }
            Property::Scale => {
                (Path::Scale, Interpolation::Step, self.numbers(&values, values.len() / width.max(1), Type::Vec3))
            }
        };
        let sampler = Index::new(self.samplers.len() as u32);
        self.samplers.push(Sampler {
            extensions: None,
            extras: None,
            input: times,
            interpolation: Valid(interpolation),
            output,
        });
        let target = Target { extensions: None, extras: None, node: Index::new(node), path: Valid(path) };
        self.channels.push(Channel { sampler, target, extensions: None, extras: None });
    }

    fn finish(mut self, clip: &ClipIn<'_>) -> Result<Vec<u8>, ExportError> {
        if self.nodes.is_empty() {
            return Err(ExportError::EmptyLevel { name: clip.name.to_owned(), level: 0 });
        }
        let children = std::mem::take(&mut self.nodes);
        let root = &mut self.writer.root;
        let node =
            root.push(json::Node { name: Some(clip.name.to_owned()), children: Some(children), ..Default::default() });
        if !self.channels.is_empty() {
            root.animations.push(json::Animation {
                extensions: None,
                extras: None,
                channels: self.channels,
                name: Some(clip.name.to_owned()),
                samplers: self.samplers,
            });
        }
        self.writer.seal((clip.name, clip.seed, 0.0), vec![node])
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::preset::plan::TextureFormat;

    fn quad(shift: f32) -> Mesh {
        let positions = vec![
            Vec3::X * shift,
            Vec3::X * (shift + 1.0),
            Vec3::new(shift + 1.0, 1.0, 0.0),
            Vec3::new(shift, 1.0, 0.0),
        ];
        Mesh {
            normals: vec![Vec3::Z; 4],
            tangents: vec![[1.0, 0.0, 0.0, 1.0]; 4],
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
            occlusion: vec![255; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            positions,
            ..Mesh::default()
        }
    }

    fn key(mesh: &Mesh) -> Key {
        Key { positions: mesh.positions.clone(), normals: mesh.normals.clone() }
    }

    #[test]
    fn a_clip_of_three_keys_reads_back_with_its_targets_and_channels() {
        let meshes: Vec<Mesh> = [0.0, 0.5, 2.0].map(quad).to_vec();
        let keys: Vec<Key> = meshes.iter().map(key).collect();
        let leaves: Vec<ClipLeaves> = (0..3)
            .map(|k| ClipLeaves {
                mesh: meshes[k].clone(),
                around: [(k > 0).then(|| keys[k].clone()), (k < 2).then(|| keys[k].clone())],
            })
            .collect();
        let materials = SetMaterials::of("set", TextureFormat::Png);
        let clip = ClipIn {
            name: "set_clip_001",
            seed: 1,
            times: &[0.0, 1.0, 2.0],
            wood: &meshes[0],
            keys: &keys,
            leaves: &leaves,
            materials: &materials,
        };
        let bytes = clip_glb(&clip).unwrap();
        let read = gltf::Gltf::from_slice(&bytes).unwrap();
        assert_eq!(read.animations().count(), 1);
        // Wood, and for each of three leaf meshes weights and scale.
        assert_eq!(read.animations().next().unwrap().channels().count(), 7);
        assert_eq!(
            read.meshes().map(|m| m.primitives().next().unwrap().morph_targets().count()).collect::<Vec<_>>(),
            [2, 1, 2, 1]
        );
        assert_eq!(read.scenes().next().unwrap().nodes().next().unwrap().children().count(), 4);
        let bare = ClipIn { leaves: &[], ..clip };
        assert!(clip_glb(&bare).is_ok());
    }

    #[test]
    fn long_clips_have_wood_of_four_targets_at_most_and_rest_as_large_as_they_get() {
        let meshes: Vec<Mesh> = (0..8)
            .map(|k| {
                let mut mesh = quad(0.0);
                mesh.positions.iter_mut().for_each(|p| *p *= 1.0 + k as f32);
                mesh
            })
            .collect();
        let keys: Vec<Key> = meshes.iter().map(key).collect();
        let times: Vec<f32> = (0..8).map(|k| k as f32).collect();
        let materials = SetMaterials::of("set", TextureFormat::Png);
        let clip = ClipIn {
            name: "c",
            seed: 1,
            times: &times,
            wood: &meshes[0],
            keys: &keys,
            leaves: &[],
            materials: &materials,
        };
        let bytes = clip_glb(&clip).unwrap();
        let read = gltf::Gltf::from_slice(&bytes).unwrap();
        let primitives: Vec<_> = read.meshes().map(|mesh| mesh.primitives().next().unwrap()).collect();
        assert_eq!(primitives.iter().map(|p| p.morph_targets().count()).collect::<Vec<_>>(), [4, 3]);
        let tops: Vec<f32> = primitives.iter().map(|p| p.bounding_box().max[1]).collect();
        assert_eq!(tops, [5.0, 8.0]);
        let nodes: Vec<_> = read.nodes().filter(|node| node.mesh().is_some()).collect();
        // The first key, which is a target, and nothing of the later part.
        assert_eq!(nodes[0].mesh().unwrap().weights().unwrap(), [1.0, 0.0, 0.0, 0.0]);
        assert_eq!((nodes[0].transform().decomposed().2, nodes[1].transform().decomposed().2), ([1.0; 3], [0.0; 3]));
        assert_eq!(read.animations().next().unwrap().channels().count(), 4);
    }

    #[test]
    fn keys_that_do_not_fit_are_errors() {
        let (mesh, materials) = (quad(0.0), SetMaterials::of("set", TextureFormat::Png));
        let keys = [key(&mesh), Key::default()];
        let clip = ClipIn {
            name: "c",
            seed: 0,
            times: &[0.0, 1.0],
            wood: &mesh,
            keys: &keys,
            leaves: &[],
            materials: &materials,
        };
        assert!(clip_glb(&clip).is_err());
        let keys = [key(&mesh), key(&mesh)];
        assert!(clip_glb(&ClipIn { keys: &keys, times: &[0.0, 0.0], ..clip }).is_err());
        assert!(clip_glb(&ClipIn { keys: &keys[..1], times: &[0.0], ..clip }).is_err());
        assert!(clip_glb(&ClipIn { keys: &keys, wood: &Mesh::default(), ..clip }).is_err());
        // Of leaves, too: one mesh a key, and each as many vertices as its neighbours.
        let whole = |mesh: &Mesh| ClipLeaves { mesh: mesh.clone(), around: [None, Some(key(mesh))] };
        let mut more = mesh.clone();
        more.append(&mesh);
        let clip = ClipIn { keys: &keys, ..clip };
        assert!(clip_glb(&ClipIn { leaves: &[whole(&mesh), whole(&more)], ..clip }).is_ok());
        assert!(clip_glb(&ClipIn { leaves: &[whole(&mesh)], ..clip }).is_err());
        let unlike = ClipLeaves { mesh: mesh.clone(), around: [None, Some(key(&more))] };
        let error = clip_glb(&ClipIn { leaves: &[unlike, whole(&more)], ..clip }).unwrap_err().to_string();
        assert!(error.contains("another number of vertices"), "{error}");
    }
}
