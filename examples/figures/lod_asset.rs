//! Assets read back from the files of a set, as an engine gets them: meshes from the GLB, pictures from the PNGs.

use glam::{Vec2, Vec3};
use serde_json::Value;
use treewright::bake::Maps;
use treewright::build::SetFiles;
use treewright::lod::{Impostor, Wardrobe};
use treewright::mesh::{Mesh, TreeMesh};

/// A set as its files tell it.
pub(crate) struct Set {
    pub(crate) manifest: Value,
    pub(crate) leaf: Maps,
    pub(crate) wardrobe: Wardrobe,
    /// By variant: the layout of the impostor, and the corners of its sheet in the atlas.
    pub(crate) impostors: Vec<Option<(Impostor, [Vec2; 2])>>,
    /// By variant: each level's mesh, and the coverage down to which it is shown.
    pub(crate) variants: Vec<Vec<(TreeMesh, f32)>>,
}

/// Reads a set.
pub(crate) fn read(set: &SetFiles) -> Set {
    let file = |name: &str| {
        set.files.iter().find(|f| f.0 == name).map(|f| &*f.1).expect("the manifest names files that are there")
    };
    let manifest: Value = serde_json::from_slice(&set.files.last().expect("a set has files").1).expect("it is JSON");
    let name = manifest["set"].as_str().expect("it has a name").to_owned();
    let maps = |part: &str| {
        let png = |map: &str| {
            let name = format!("{name}_{part}_{map}.png");
            image::load_from_memory(file(&name)).expect("it is a PNG")
        };
        let (color, normal, orm) = (png("color").to_rgba8(), png("normal").to_rgb8(), png("orm").to_rgb8());
        Maps {
            width: color.width(),
            height: color.height(),
            color: color.pixels().map(|p| p.0).collect(),
            normal: normal.pixels().map(|p| p.0).collect(),
            orm: orm.pixels().map(|p| p.0).collect(),
        }
    };
    let (bark, leaf) = (maps("bark"), maps("leaf"));
    let wardrobe = Wardrobe::of_atlas(&leaf, &bark);
    let variants = manifest["variants"]
        .as_array()
        .expect("it lists variants")
        .iter()
        .map(|variant| {
            let meshes = glb(file(variant["file"].as_str().expect("a variant has a file")));
            let coverage = |i: usize| variant["levels"][i]["screen_coverage"].as_f64().unwrap_or(0.0) as f32;
            meshes.into_iter().enumerate().map(|(i, mesh)| (mesh, coverage(i))).collect()
        })
        .collect();
    let impostors = manifest["variants"].as_array().into_iter().flatten().map(impostor).collect();
    Set { manifest, leaf, wardrobe, impostors, variants }
}

/// The layout of a variant's impostor, as the manifest tells it.
fn impostor(variant: &Value) -> Option<(Impostor, [Vec2; 2])> {
    let told =
        variant["levels"].as_array()?.iter().find_map(|level| level.get("impostor").filter(|i| i.is_object()))?;
    let number = |v: &Value| v.as_f64().unwrap_or(0.0) as f32;
    let centre = &told["centre"];
    let layout = Impostor {
        frames: told["frames"].as_u64()? as u32,
        centre: Vec3::new(number(&centre[0]), number(&centre[1]), number(&centre[2])),
        radius: number(&told["radius"]),
        reach: number(&told["reach"]),
        height: number(&told["height"]),
    };
    let corner = |name: &str| Vec2::new(number(&told[name][0]), number(&told[name][1]));
    Some((layout, [corner("uv_min"), corner("uv_max")]))
}

/// The meshes of a GLB of the default profile, whose accessors are plain and alone in their views.
fn glb(bytes: &[u8]) -> Vec<TreeMesh> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let root: Value = serde_json::from_slice(&bytes[20..20 + length]).expect("the text is JSON");
    let bin = &bytes[28 + length..];
    let at = |v: &Value| v.as_u64().unwrap_or(0) as usize;
    let raw = |accessor: &Value| -> (&[u8], u64) {
        let accessor = &root["accessors"][at(accessor)];
        let view = &root["bufferViews"][at(&accessor["bufferView"])];
        let start = at(&view["byteOffset"]);
        (&bin[start..start + at(&view["byteLength"])], accessor["componentType"].as_u64().unwrap_or(0))
    };
    let floats = |accessor: &Value| -> Vec<f32> {
        raw(accessor).0.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
    };
    let vec3 = |v: &[f32]| v.as_chunks::<3>().0.iter().map(|c| Vec3::from_array(*c)).collect::<Vec<Vec3>>();
    let primitive = |p: &Value| -> Mesh {
        let a = &p["attributes"];
        let (indices, kind) = raw(&p["indices"]);
        let positions = vec3(&floats(&a["POSITION"]));
        Mesh {
            normals: vec3(&floats(&a["NORMAL"])),
            tangents: floats(&a["TANGENT"]).as_chunks::<4>().0.to_vec(),
            uvs: floats(&a["TEXCOORD_0"]).as_chunks::<2>().0.iter().map(|c| Vec2::from_array(*c)).collect(),
            occlusion: raw(&a["COLOR_0"]).0.chunks_exact(4).map(|c| c[0]).collect(),
            tiles: vec![0; positions.len()],
            indices: if kind == 5123 {
                indices.as_chunks::<2>().0.iter().map(|b| u32::from(u16::from_le_bytes(*b))).collect()
            } else {
                indices.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect()
            },
            positions,
            ..Mesh::default()
        }
    };
    let material = |p: &Value| root["materials"][at(&p["material"])]["name"].as_str().unwrap_or("").to_owned();
    let tree = |mesh: &Value| {
        let mut tree = TreeMesh::default();
        for p in mesh["primitives"].as_array().into_iter().flatten() {
            if material(p).ends_with("_bark") { tree.bark = primitive(p) } else { tree.leaf = primitive(p) }
        }
        tree
    };
    root["meshes"].as_array().into_iter().flatten().map(tree).collect()
}
