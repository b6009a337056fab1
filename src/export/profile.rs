//! One variant as the files that an engine reads.
//!
//! | engine | files | levels | colliders |
//! |---|---|---|---|
//! | `Generic` | `NAME.glb` | `MSFT_lod` with screen coverages; a loader that doesn't know it shows LOD0 | in the manifest |
//! | `Web` | `NAME.web.glb` | as generic; `KHR_mesh_quantization` and `EXT_meshopt_compression`, both required | in the manifest |
//! | `Godot` | `NAME.godot.glb` | siblings `NAME_LOD0…` under one root, as Terrain3D takes them | `NAME_0-convcolonly…` in the same file: the importer makes them bodies |
//! | `Unity` | `NAME.unity.glb` | siblings `NAME_LOD0…` under one root, as LOD groups are named | `NAME.colliders.unity.glb` |
//! | `Bevy` | `NAME.bevy.glb` | siblings with `visibility_range` in their extras (distances in metres, for `VisibilityRange`) | `NAME.colliders.bevy.glb` |
//! | `Unreal` | `NAME_LOD0.unreal.glb…` | one file a level | `UCX_NAME_LOD0_00…` in the file of LOD0 |
//!
//! All levels share the tree's origin: the middle of the trunk on the ground. Colliders are convex hulls of the capsules
//! along the trunk and thick limbs, and after them those around the crown, where the preset asks for such: as
//! `NAME_crown_0-convcolonly…` (Godot), `NAME_crown_0…` in the file of colliders (Unity, Bevy), with the next numbers of
//! `UCX_NAME_LOD0_00…` (Unreal, which knows no other names). Textures are shared by all files of the set. PEERS of the design names the sources.

use gltf_json as json;
use json::Index;

use super::extras::raw;
use super::glb::Writer;
use super::manifest::switch_distance;
use super::{AssetIn, Capsule, ExportError, Hull, glb, level_name};
use crate::base::{Frame, math};
use crate::preset::plan::Engine;

/// Sides of a collider.
const SIDES: u32 = 8;

/// What physics take a variant for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Colliders<'a> {
    /// Of the trunk and thick limbs.
    pub capsules: &'a [Capsule],
    /// Around the crown.
    pub hulls: &'a [Hull],
}

impl<'a> Colliders<'a> {
    /// Corners and triangles of each convex hull: of the capsules, then of the crown.
    fn meshes(self) -> impl Iterator<Item = (Vec<glam::Vec3>, Vec<u32>)> + 'a {
        self.capsules.iter().map(hull).chain(self.hulls.iter().map(Hull::mesh))
    }

    /// A name for each; those of capsules start with `prefix`.
    fn names(self, prefix: &'static str) -> impl Iterator<Item = String> {
        let of_capsules = (0..self.capsules.len()).map(move |k| format!("{prefix}{k}"));
        of_capsules.chain((0..self.hulls.len()).map(|k| format!("crown_{k}")))
    }
}

/// The files of a variant for an engine, name and bytes, what is loaded first in front.
///
/// # Errors
///
/// See [`ExportError`].
pub fn engine_files(
    asset: &AssetIn<'_>,
    colliders: Colliders<'_>,
    engine: Engine,
) -> Result<Vec<(String, Vec<u8>)>, ExportError> {
    let name = asset.name;
    let mut files = Vec::new();
    match engine {
        Engine::Generic => files.push((format!("{name}.glb"), glb(asset)?)),
        Engine::Web => files.push((format!("{name}.web.glb"), super::glb::web(asset)?)),
        Engine::Godot => files.push((format!("{name}.godot.glb"), siblings(asset, colliders, engine)?)),
        Engine::Unity | Engine::Bevy => {
            let suffix = if engine == Engine::Unity { "unity" } else { "bevy" };
            files.push((format!("{name}.{suffix}.glb"), siblings(asset, Colliders::default(), engine)?));
            if !(colliders.capsules.is_empty() && colliders.hulls.is_empty()) {
                files.push((format!("{name}.colliders.{suffix}.glb"), alone(asset, colliders)?));
            }
        }
        Engine::Unreal => {
            super::glb::check_levels(asset)?;
            for (i, level) in asset.levels.iter().enumerate() {
                let of_level = level_name(name, i);
                let mut writer = Writer::new(asset.materials);
                writer.level(&of_level, i, level)?;
                let mut children = vec![node(&mut writer, &of_level, Index::new(0))];
                if i == 0 {
                    let names = (0_usize..).map(|k| format!("UCX_{of_level}_{k:02}"));
                    for ((points, triangles), name) in colliders.meshes().zip(names) {
                        children.push(collider(&mut writer, &name, &points, &triangles));
                    }
                }
                files.push((format!("{of_level}.unreal.glb"), writer.seal((name, asset.seed, asset.below), children)?));
            }
        }
    }
    Ok(files)
}

/// All levels side by side under one root, and colliders that the importer knows by their names.
fn siblings(asset: &AssetIn<'_>, colliders: Colliders<'_>, engine: Engine) -> Result<Vec<u8>, ExportError> {
    super::glb::check_levels(asset)?;
    let height = height(asset);
    let mut writer = Writer::new(asset.materials);
    writer.custom = engine == Engine::Bevy;
    let mut children = Vec::new();
    let mut from = 0.0_f32;
    for (i, level) in asset.levels.iter().enumerate() {
        let name = level_name(asset.name, i);
        writer.level(&name, i, level)?;
        let child = node(&mut writer, &name, Index::new(i as u32));
        let to = switch_distance(height, level.screen_coverage);
        let coverage = level.screen_coverage;
        writer.root.nodes[child.value()].extras = if engine == Engine::Bevy {
            raw(&serde_json::json!({ "screen_coverage": coverage, "visibility_range": [from, to] }))
        } else {
            raw(&serde_json::json!({ "screen_coverage": coverage }))
        };
        from = to;
        children.push(child);
    }
    for ((points, triangles), name) in colliders.meshes().zip(colliders.names("")) {
        children.push(collider(&mut writer, &format!("{}_{name}-convcolonly", asset.name), &points, &triangles));
    }
    let root = writer.root.push(json::Node {
        name: Some(asset.name.to_owned()),
        children: Some(children),
        ..Default::default()
    });
    writer.seal((asset.name, asset.seed, asset.below), vec![root])
}

/// Colliders in a file of their own.
fn alone(asset: &AssetIn<'_>, colliders: Colliders<'_>) -> Result<Vec<u8>, ExportError> {
    let mut writer = Writer::new(asset.materials);
    let mut nodes = Vec::new();
    for ((points, triangles), name) in colliders.meshes().zip(colliders.names("collider_")) {
        nodes.push(collider(&mut writer, &format!("{}_{name}", asset.name), &points, &triangles));
    }
    writer.seal((asset.name, asset.seed, asset.below), nodes)
}

fn node(writer: &mut Writer<'_>, name: &str, mesh: Index<json::Mesh>) -> Index<json::Node> {
    writer.root.push(json::Node { mesh: Some(mesh), name: Some(name.to_owned()), ..Default::default() })
}

/// A convex hull as a mesh and a node of one name.
fn collider(writer: &mut Writer<'_>, name: &str, points: &[glam::Vec3], triangles: &[u32]) -> Index<json::Node> {
    let mesh = writer.plain_mesh(name, points, triangles);
    node(writer, name, mesh)
}

/// Height of the finest level, metres.
fn height(asset: &AssetIn<'_>) -> f32 {
    let points = asset.levels.iter().take(1).flat_map(|l| l.mesh.bark.positions.iter().chain(&l.mesh.leaf.positions));
    let (low, high) = points.fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(p.y), high.max(p.y)));
    (high - low).max(0.0)
}

/// A convex hull of a capsule: a prism around it with a ring and a point at each end, counter-clockwise from outside.
pub(super) fn hull(capsule: &Capsule) -> (Vec<glam::Vec3>, Vec<u32>) {
    let (a, b) = (glam::Vec3::from(capsule.a), glam::Vec3::from(capsule.b));
    let axis = (b - a).normalize_or(glam::Vec3::Y);
    let frame = Frame::along(axis);
    // Wide enough that the prism holds the round wood.
    let radius = capsule.radius / math::cos(std::f32::consts::PI / SIDES as f32);
    let mut points = vec![a - axis * capsule.radius, b + axis * capsule.radius];
    // (along from the end, radius): each end is a belt at the axis' end and a smaller ring half way to the tip.
    for (end, along, share) in [(a, -0.6, 0.8), (a, 0.0, 1.0), (b, 0.0, 1.0), (b, 0.6, 0.8)] {
        for k in 0..SIDES {
            let (sin, cos) = math::sin_cos(std::f32::consts::TAU * k as f32 / SIDES as f32);
            points.push(end + axis * (along * capsule.radius) + (frame.x * cos - frame.z * sin) * (radius * share));
        }
    }
    let at = |ring: u32, k: u32| 2 + ring * SIDES + k % SIDES;
    let mut triangles = Vec::new();
    for k in 0..SIDES {
        triangles.extend([0, at(0, k + 1), at(0, k)]);
        for ring in 0..3 {
            let (p, q, r, s) = (at(ring, k), at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1));
            triangles.extend([p, q, s, p, s, r]);
        }
        triangles.extend([1, at(3, k), at(3, k + 1)]);
    }
    (points, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hulls_are_closed_convex_and_hold_the_capsule() {
        let capsule = Capsule { a: [1.0, 0.0, 0.5], b: [1.5, 3.0, 0.0], radius: 0.4 };
        let (points, triangles) = hull(&capsule);
        let (a, b) = (glam::Vec3::from(capsule.a), glam::Vec3::from(capsule.b));
        let mut edges = std::collections::BTreeMap::new();
        for t in triangles.as_chunks::<3>().0 {
            let [p, q, r] = t.map(|i| points[i as usize]);
            let normal = (q - p).cross(r - p).normalize();
            assert!(points.iter().all(|v| normal.dot(*v - p) < 1e-4), "convex, and wound outward");
            for step in 0..10 {
                assert!(normal.dot(a.lerp(b, step as f32 / 9.0) - p) < -0.3 * capsule.radius);
            }
            for (i, j) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry((i.min(j), i.max(j))).or_insert(0) += if i < j { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&sum| sum == 0), "closed");
    }
}
