//! Tangents from texture coordinates (Lengyel 2001), orthogonal to the normals, for glTF's normal maps.
//!
//! Tubes and leaf cards know where u grows and make their own; this is for all other meshes. Each triangle's direction of
//! growing u is summed at its corners, weighted by the triangle's area, made orthogonal to the vertex's normal and unit; the
//! sign says whether v runs along `normal × tangent`. Vertices are not split: tubes have a seam column and cards share
//! nothing, so no vertex sees mirrored texture.
//!
//! Rejected: meshoptimizer's `generate_tangents`. It answers a corner at a time, so that vertices would have to be split
//! and welded again, and a C++ compiler may fuse its products on one platform and not on another.

use glam::{Vec2, Vec3};

use super::{Mesh, MeshError, check_indices};
use crate::base::Frame;

/// Fills `tangents`. Where the texture has no direction (no area in u, v, or no triangle) the tangent is any vector at
/// right angles to the normal. Linear.
///
/// # Errors
///
/// When indices, normals or texture coordinates do not fit the positions; the mesh is then unchanged.
pub fn add_tangents(mesh: &mut Mesh) -> Result<(), MeshError> {
    let vertices = mesh.positions.len();
    check_indices(&mesh.indices, vertices)?;
    for len in [mesh.normals.len(), mesh.uvs.len()] {
        if len != vertices {
            return Err(MeshError::Uneven { len, vertices });
        }
    }
    let mut sums = vec![(Vec3::ZERO, Vec3::ZERO); vertices];
    for t in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [t[0] as usize, t[1] as usize, t[2] as usize];
        let (p, q) = (mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
        let (s, r) = (mesh.uvs[b] - mesh.uvs[a], mesh.uvs[c] - mesh.uvs[a]);
        let Some((tangent, bitangent)) = directions(p, q, s, r) else { continue };
        let area = p.cross(q).length();
        for i in [a, b, c] {
            sums[i].0 += tangent * area;
            sums[i].1 += bitangent * area;
        }
    }
    mesh.tangents = sums
        .iter()
        .zip(&mesh.normals)
        .map(|(&(tangent, bitangent), &normal)| tangent_of(normal, tangent, bitangent))
        .collect();
    Ok(())
}

/// The tangent of a vertex with this unit normal, where u and v grow this way.
#[inline]
pub(super) fn tangent_of(normal: Vec3, tangent: Vec3, bitangent: Vec3) -> [f32; 4] {
    let flat = (tangent - normal * normal.dot(tangent)).try_normalize();
    let tangent = flat.unwrap_or_else(|| Frame::along(normal.normalize_or(Vec3::Y)).x);
    // glTF: bitangent = cross(normal, tangent) * w, and v grows down the picture while the bitangent points up.
    let sign = if normal.cross(tangent).dot(bitangent) > 0.0 { -1.0 } else { 1.0 };
    [tangent.x, tangent.y, tangent.z, sign]
}

/// Unit directions of growing u and v on a triangle with edges `p`, `q` and texture edges `s`, `r`.
fn directions(p: Vec3, q: Vec3, s: Vec2, r: Vec2) -> Option<(Vec3, Vec3)> {
    let area = s.x * r.y - r.x * s.y;
    let sign = if area < 0.0 { -1.0 } else { 1.0 };
    let tangent = ((p * r.y - q * s.y) * sign).try_normalize()?;
    let bitangent = ((q * s.x - p * r.x) * sign).try_normalize()?;
    (area != 0.0 && area.is_finite()).then_some((tangent, bitangent))
}
