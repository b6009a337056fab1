//! glTF 2.0, binary and text, through the checked reader of [`crate::source::glb`].

use glam::{Vec2, Vec3};

use super::{Alpha, Files, Material, Part, Scene, SceneUp};
use crate::base::Diagnostic;
use crate::preset::plan::UpAxis;
use crate::source::glb::{GlbError, GlbInfo, MaterialInfo, read_glb, read_gltf};

/// Whether a text is a JSON object with a member `asset`.
pub(super) fn is_gltf(text: &[u8]) -> bool {
    text.trim_ascii_start().starts_with(b"{") && text.windows(7).any(|w| w == b"\"asset\"")
}

/// The buffers and pictures that a file names.
pub(super) fn refers(_: &[u8]) -> Vec<String> {
    Vec::new()
}

/// Reads a glTF; see [`super::read`].
pub(super) fn read(bytes: &[u8], file: &str, _: &Files<'_>) -> Result<Scene, Vec<Diagnostic>> {
    let fail = |e: GlbError| vec![Diagnostic::new(file, e.to_string())];
    let info = if bytes.starts_with(b"glTF") { read_glb(bytes) } else { read_gltf(bytes) }.map_err(fail)?;
    let mut scene = Scene {
        up: SceneUp(UpAxis::Y),
        materials: info.materials.iter().map(material).collect(),
        ..Scene::default()
    };
    for instance in &info.instances {
        for p in 0..info.meshes[instance.mesh].primitives.len() {
            let mut part = part(&info, instance.mesh, p).map_err(fail)?;
            let m = &instance.matrix;
            for position in &mut part.positions {
                *position = Vec3::from_array(instance.place(position.to_array()));
            }
            let (x, y, z) = (Vec3::new(m[0], m[1], m[2]), Vec3::new(m[4], m[5], m[6]), Vec3::new(m[8], m[9], m[10]));
            let turned = x.cross(y).dot(z) < 0.0;
            for normal in &mut part.normals {
                let n = y.cross(z) * normal.x + z.cross(x) * normal.y + x.cross(y) * normal.z;
                *normal = n.normalize_or_zero() * if turned { -1.0 } else { 1.0 };
            }
            if turned {
                part.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
            part.name.clone_from(&instance.node);
            if part.positions.iter().any(|p| !p.is_finite()) {
                return Err(vec![Diagnostic::new(file, format!("mesh {}: a vertex is not finite", instance.mesh))]);
            }
            scene.parts.push(part);
        }
    }
    Ok(scene)
}

fn part(info: &GlbInfo<'_>, mesh: usize, primitive: usize) -> Result<Part, GlbError> {
    let three = |name: &str| {
        let found = info.attribute(mesh, primitive, name)?;
        Ok(found.filter(|(_, n)| *n == 3).map(|(v, _)| v.chunks_exact(3).map(Vec3::from_slice).collect()))
    };
    let triangles = info.triangles(mesh, primitive)?;
    let uvs = info.attribute(mesh, primitive, "TEXCOORD_0")?.filter(|(_, n)| *n == 2);
    let colors = info.attribute(mesh, primitive, "COLOR_0")?.filter(|(_, n)| *n == 3 || *n == 4);
    Ok(Part {
        name: String::new(),
        material: info.meshes[mesh].primitives[primitive].material,
        positions: three("POSITION")?.unwrap_or_default(),
        normals: three("NORMAL")?.unwrap_or_default(),
        uvs: uvs.map(|(v, _)| v.chunks_exact(2).map(Vec2::from_slice).collect()).unwrap_or_default(),
        colors: colors
            .map(|(v, n)| v.chunks_exact(n).map(|c| [c[0], c[1], c[2], c.get(3).copied().unwrap_or(1.0)]).collect())
            .unwrap_or_default(),
        faces: (0..triangles.len() as u32).collect(),
        triangles,
    })
}

fn material(info: &MaterialInfo) -> Material {
    Material {
        name: info.name.clone(),
        alpha: match info.alpha_mode.as_str() {
            "MASK" => Alpha::Mask(info.alpha_cutoff),
            "BLEND" => Alpha::Blend,
            _ => Alpha::Opaque,
        },
        double_sided: info.double_sided,
        ..Material::default()
    }
}
