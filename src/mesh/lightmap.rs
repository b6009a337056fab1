//! A second UV set for light maps: both primitives of a level unwrapped by xatlas into one square without overlaps.
//!
//! xatlas cuts a mesh into charts, so vertices on seams are doubled: every vertex array is gathered again through
//! xatlas's references. Its Rust wrapper aborts the process on bad input and each atlas starts threads of its own, so
//! meshes pass the gate first, empty ones are left out, and one atlas is made at a time. Takes 0.6 s for 55,000
//! triangles: presets ask for it, it is not made by default.

use std::sync::Mutex;

use glam::Vec2;
use xatlas_rs_v2::{ChartOptions, IndexData, MeshData, MeshDecl, PackOptions, Xatlas};

use super::{Mesh, TreeMesh};

/// A mesh could not be unwrapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LightmapError {
    /// Vertex arrays of different length, an index out of range, or a number that is not finite.
    #[error("the mesh is not well-formed")]
    BadMesh,
    /// xatlas refused the mesh.
    #[error("xatlas refused the mesh")]
    Refused,
}

static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Extent that meshes are scaled to for xatlas: it leaves out triangles of less than an area that is the same for all.
const EXTENT: f32 = 1000.0;
/// Texels between charts.
const PADDING: u32 = 2;
/// How often charts are packed anew for less room, and how much less than it seems to take.
const PACKED: usize = 8;
const TIGHTER: f32 = 0.95;

/// Fills [`Mesh::lightmap`] of both primitives; `resolution` is the light map's edge in texels, charts stay two texels
/// apart there. The edge that they take: more than `resolution` where there are so many that none of that size holds them.
///
/// # Errors
///
/// When a mesh is not well-formed or xatlas refuses it; the meshes are then unchanged.
pub fn unwrap_lightmap(level: &mut TreeMesh, resolution: u32) -> Result<u32, LightmapError> {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let meshes: Vec<&mut Mesh> =
        [&mut level.bark, &mut level.leaf].into_iter().filter(|mesh| !mesh.indices.is_empty()).collect();
    if !meshes.iter().all(|mesh| is_well_formed(mesh)) {
        return Err(LightmapError::BadMesh);
    }
    let extent = meshes.iter().flat_map(|mesh| &mesh.positions).fold(0.0_f32, |a, p| a.max(p.abs().max_element()));
    let scale = if extent > 0.0 { EXTENT / extent } else { 1.0 };
    let flat: Vec<Vec<f32>> =
        meshes.iter().map(|mesh| mesh.positions.iter().flat_map(|p| (*p * scale).to_array()).collect()).collect();
    let indices: Vec<Vec<u32>> = meshes.iter().map(|mesh| mesh.indices.clone()).collect();
    let declared: Vec<MeshDecl<'_>> = flat
        .iter()
        .zip(&indices)
        .map(|(positions, indices)| MeshDecl {
            vertex_position_data: MeshData::Contiguous(positions),
            vertex_normal_data: None,
            vertex_uv_data: None,
            face_ignore_data: None,
            face_material_data: None,
            face_vertex_count: None,
            index_data: Some(IndexData::U32(indices)),
            face_count: (indices.len() / 3) as u32,
            epsilon: 1.192_092_9e-7,
        })
        .collect();
    if declared.is_empty() {
        return Ok(0);
    }
    let mut atlas = Xatlas::new();
    for mesh in &declared {
        if atlas.add_mesh(mesh).is_err() {
            // Dropping an atlas whose mesh was refused aborts the process; the leak is the lesser evil, and the gate
            // above lets no known cause through.
            std::mem::forget(atlas);
            return Err(LightmapError::Refused);
        }
    }
    let packing = |texels_per_unit: f32, resolution: u32| PackOptions {
        max_chart_size: 0,
        padding: PADDING,
        texels_per_unit,
        resolution,
        bilinear: true,
        block_align: false,
        brute_force: false,
        create_image: false,
        rotate_charts_to_axis: true,
        rotate_charts: true,
    };
    atlas.generate(&ChartOptions::default(), &packing(0.0, resolution));
    let taken = |atlas: &Xatlas<'_>| atlas.width().max(atlas.height()).max(1);
    // A chart takes a texel at least: more than there is room for no packing holds, and each try takes as long as all else.
    let room = u64::from(resolution) * u64::from(resolution);
    let fits = u64::from(atlas.chart_count()) * u64::from((1 + PADDING) * (1 + PADDING)) <= room;
    // xatlas reckons without the room between charts, which is most of it where there are thousands.
    for _ in 0..if fits { PACKED } else { 0 } {
        let (edge, density) = (taken(&atlas), atlas.texels_per_unit());
        if edge <= resolution || density <= 0.0 {
            break;
        }
        let less = resolution as f32 / edge as f32;
        atlas.pack_charts(&packing(density * less * less.sqrt() * TIGHTER, 0));
    }
    // The charts may fill less than the resolution asked for: normalize by the larger edge.
    let edge = taken(&atlas) as f32;
    for (mesh, unwrapped) in meshes.into_iter().zip(atlas.meshes()) {
        let from: Vec<usize> = unwrapped.vertex_array.iter().map(|v| v.xref as usize).collect();
        mesh.lightmap = unwrapped.vertex_array.iter().map(|v| Vec2::new(v.uv[0], v.uv[1]) / edge).collect();
        mesh.indices = unwrapped.index_array.to_vec();
        mesh.positions = gather(&mesh.positions, &from);
        mesh.normals = gather(&mesh.normals, &from);
        mesh.tangents = gather(&mesh.tangents, &from);
        mesh.uvs = gather(&mesh.uvs, &from);
        mesh.occlusion = gather(&mesh.occlusion, &from);
        mesh.tiles = gather(&mesh.tiles, &from);
        mesh.chains = gather(&mesh.chains, &from);
    }
    Ok(edge as u32)
}

/// The values at some indices; an array that the mesh does not have stays empty.
fn gather<T: Copy>(values: &[T], from: &[usize]) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { from.iter().map(|&i| values[i]).collect() }
}

fn is_well_formed(mesh: &Mesh) -> bool {
    let count = mesh.positions.len();
    let fits = |length: usize| length == 0 || length == count;
    mesh.indices.len().is_multiple_of(3)
        && mesh.indices.iter().all(|&i| (i as usize) < count)
        && mesh.positions.iter().all(|p| p.is_finite())
        && [mesh.normals.len(), mesh.tangents.len(), mesh.uvs.len()].into_iter().all(fits)
        && [mesh.occlusion.len(), mesh.tiles.len(), mesh.chains.len()].into_iter().all(fits)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn cube() -> Mesh {
        let positions: Vec<Vec3> =
            (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let indices = quads.iter().flat_map(|q: &[u32; 4]| [q[0], q[1], q[2], q[0], q[2], q[3]]).collect();
        Mesh { positions, indices, ..Mesh::default() }
    }

    #[test]
    fn a_cube_is_unwrapped_without_overlap() {
        let mut level = TreeMesh { bark: cube(), leaf: Mesh::default() };
        unwrap_lightmap(&mut level, 256).unwrap();
        let mesh = &level.bark;
        assert_eq!(mesh.lightmap.len(), mesh.positions.len());
        assert_eq!(mesh.indices.len(), 36);
        assert!(mesh.lightmap.iter().all(|uv| uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all()));
        // Rasterize the triangles' interiors: no texel centre is covered twice.
        let n = 256;
        let mut hits = vec![0_u8; n * n];
        for t in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| mesh.lightmap[t[k] as usize] * n as f32);
            let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp_dot(r - p);
            for (i, hit) in hits.iter_mut().enumerate() {
                let p = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5);
                let s = [side(a, b, p), side(b, c, p), side(c, a, p)];
                *hit += u8::from(s.iter().all(|v| *v > 1e-3) || s.iter().all(|v| *v < -1e-3));
            }
        }
        assert!(hits.iter().all(|h| *h <= 1));
        assert!(hits.iter().filter(|h| **h == 1).count() > n * n / 3);
    }

    #[test]
    fn charts_are_packed_until_the_light_map_holds_them_and_small_ones_are_not_left_out() {
        // Two hundred cubes of a tenth of a millimetre, and as many of a centimetre.
        let mut bark = Mesh::default();
        for i in 0..400 {
            let mut one = cube();
            let size = if i % 2 == 0 { 1e-2 } else { 1.0 };
            one.positions.iter_mut().for_each(|p| *p = *p * size + Vec3::X * (2 * i) as f32);
            bark.append(&one);
        }
        bark.positions.iter_mut().for_each(|p| *p *= 0.01);
        for (resolution, holds) in [(1024, true), (512, true), (16, false)] {
            let mut level = TreeMesh { bark: bark.clone(), leaf: Mesh::default() };
            let edge = unwrap_lightmap(&mut level, resolution).unwrap();
            assert_eq!(edge <= resolution, holds, "{edge} of {resolution}");
            let of = |t: &[u32; 3]| t.map(|i| level.bark.lightmap[i as usize]);
            let flat = level.bark.indices.as_chunks().0.iter().filter(|t| of(t) == [Vec2::ZERO; 3]).count();
            assert_eq!(flat, 0, "{resolution}");
        }
    }

    #[test]
    fn a_broken_mesh_is_refused_and_unchanged() {
        let mut broken = cube();
        broken.indices[0] = 99;
        let mut level = TreeMesh { bark: broken.clone(), leaf: Mesh::default() };
        assert_eq!(unwrap_lightmap(&mut level, 64), Err(LightmapError::BadMesh));
        assert_eq!(level.bark, broken);
        let mut level = TreeMesh { bark: Mesh { chains: vec![0; 3], ..cube() }, leaf: Mesh::default() };
        assert_eq!(unwrap_lightmap(&mut level, 64), Err(LightmapError::BadMesh));
        assert!(unwrap_lightmap(&mut TreeMesh::default(), 64).is_ok());
    }
}
