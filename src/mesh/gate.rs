//! The one door to meshoptimizer: its "safe" functions crash the process on an index out of range or on a length that
//! three doesn't divide, so nothing calls them but through here.

use super::Mesh;

/// Why a mesh cannot go to meshoptimizer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// The number of indices is no multiple of three.
    #[error("{0} indices are no whole triangles")]
    Ragged(usize),
    /// An index that no vertex has.
    #[error("index {index} at {at} is out of range: there are {vertices} vertices")]
    OutOfRange {
        /// Place in the index array.
        at: usize,
        /// Its value.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A vertex array whose length is neither zero nor that of the positions.
    #[error("a vertex array of {len} does not go with {vertices} vertices")]
    Uneven {
        /// Its length.
        len: usize,
        /// Number of vertices.
        vertices: usize,
    },
}

/// Checks what meshoptimizer takes for granted.
///
/// # Errors
///
/// When the indices are no whole triangles or one is out of range.
pub fn check_indices(indices: &[u32], vertices: usize) -> Result<(), MeshError> {
    if !indices.len().is_multiple_of(3) {
        return Err(MeshError::Ragged(indices.len()));
    }
    match indices.iter().position(|&i| i as usize >= vertices) {
        Some(at) => Err(MeshError::OutOfRange { at, index: indices[at], vertices }),
        None => Ok(()),
    }
}

/// Orders triangles for the vertex cache and vertices by first use, and drops vertices that no triangle uses. The
/// triangles stay the same as sets of corners. Deterministic. Tells which vertex each was before.
///
/// # Errors
///
/// When the mesh's arrays do not fit each other; it is then unchanged.
pub fn optimize(mesh: &mut Mesh) -> Result<Vec<usize>, MeshError> {
    let vertices = mesh.positions.len();
    check_indices(&mesh.indices, vertices)?;
    let others = [mesh.lightmap.len(), mesh.chains.len(), mesh.tiles.len()];
    let lengths = [mesh.normals.len(), mesh.tangents.len(), mesh.uvs.len(), mesh.occlusion.len()];
    if let Some(&len) = lengths.iter().chain(&others).find(|&&len| len != 0 && len != vertices) {
        return Err(MeshError::Uneven { len, vertices });
    }
    if mesh.indices.is_empty() {
        *mesh = Mesh::default();
        return Ok(Vec::new());
    }
    let indices = meshopt::optimize_vertex_cache(&mesh.indices, vertices);
    // By first use; the same as meshoptimizer's fetch order, without handing it seven arrays.
    let mut place = vec![u32::MAX; vertices];
    let mut order = Vec::with_capacity(vertices);
    mesh.indices = indices
        .into_iter()
        .map(|i| {
            let slot = &mut place[i as usize];
            if *slot == u32::MAX {
                *slot = order.len() as u32;
                order.push(i as usize);
            }
            *slot
        })
        .collect();
    gather(&mut mesh.positions, &order);
    gather(&mut mesh.normals, &order);
    gather(&mut mesh.tangents, &order);
    gather(&mut mesh.uvs, &order);
    gather(&mut mesh.occlusion, &order);
    gather(&mut mesh.tiles, &order);
    gather(&mut mesh.chains, &order);
    gather(&mut mesh.lightmap, &order);
    Ok(order)
}

fn gather<T: Copy>(values: &mut Vec<T>, order: &[usize]) {
    if !values.is_empty() {
        *values = order.iter().map(|&i| values[i]).collect();
    }
}
