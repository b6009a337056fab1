//! Where the meshes of a glTF scene stand, and which nodes are levels of which.

use super::accessor::Layout;
use super::buffers::Buffers;
use super::{GlbError, Instance, LodInfo, LodLevel, json};

const IDENTITY: [f32; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Name and parent of a node, which comes before it.
type Nodes = Vec<(String, Option<usize>)>;

/// Every mesh of the default scene (the first where none is named) and the nodes that bear them; all nodes without a parent where
/// there is no scene.
///
/// Without recursion, and each node at most once, so neither depth nor cycles can hurt.
pub(super) fn instances(
    root: &json::Root,
    layouts: &[Layout],
    buffers: &Buffers<'_>,
) -> Result<(Nodes, Vec<Instance>), GlbError> {
    let known = |i: u64| {
        let index = usize::try_from(i).ok().filter(|&i| i < root.nodes.len());
        index.ok_or_else(|| GlbError::Broken(format!("node {i} is named but not there")))
    };
    let starts: Vec<u64> = match (root.scene, root.scenes.first()) {
        (Some(i), _) => {
            let scene = usize::try_from(i).ok().and_then(|i| root.scenes.get(i));
            scene.ok_or_else(|| GlbError::Broken(format!("scene {i} is named but not there")))?.nodes.clone()
        }
        (None, Some(scene)) => scene.nodes.clone(),
        (None, None) => {
            let mut child = vec![false; root.nodes.len()];
            for &c in root.nodes.iter().flat_map(|n| &n.children) {
                child[known(c)?] = true;
            }
            (0..root.nodes.len() as u64).filter(|&i| !child[i as usize]).collect()
        }
    };
    let mut seen = vec![false; root.nodes.len()];
    let mut stack: Vec<(u64, Option<usize>, [f32; 16])> =
        starts.into_iter().rev().map(|i| (i, None, IDENTITY)).collect();
    let (mut visited, mut found) = (Vec::<(usize, Option<usize>)>::new(), Vec::new());
    while let Some((i, above, parent)) = stack.pop() {
        let index = known(i)?;
        if std::mem::replace(&mut seen[index], true) {
            return Err(GlbError::Broken(format!("node {i} has two parents or is its own ancestor")));
        }
        let node = &root.nodes[index];
        let matrix = product(&parent, &local(node));
        let at = visited.len();
        visited.push((index, above));
        if let Some(mesh) = mesh_of(node, root)? {
            match &node.extensions.instancing {
                None => found.push(Instance { node: node.name.clone(), at, mesh, matrix }),
                // A name for each copy could make much of a small file.
                Some(copies) => found.extend(places(copies, layouts, buffers)?.into_iter().map(|place| Instance {
                    node: String::new(),
                    at,
                    mesh,
                    matrix: product(&matrix, &place),
                })),
            }
        }
        stack.extend(node.children.iter().rev().map(|&c| (c, Some(at), matrix)));
    }
    Ok((bearing(root, &visited, &mut found), found))
}

/// Those of the nodes that bear a mesh or have one below them; instances count them from then on.
fn bearing(root: &json::Root, visited: &[(usize, Option<usize>)], found: &mut [Instance]) -> Nodes {
    let mut bears = vec![false; visited.len()];
    found.iter().for_each(|instance| bears[instance.at] = true);
    for (at, &(_, above)) in visited.iter().enumerate().rev() {
        if let Some(above) = above.filter(|_| bears[at]) {
            bears[above] = true;
        }
    }
    let mut numbers = vec![0; visited.len()];
    let mut nodes = Nodes::new();
    for (at, &(index, above)) in visited.iter().enumerate().filter(|(at, _)| bears[*at]) {
        numbers[at] = nodes.len();
        nodes.push((root.nodes[index].name.clone(), above.map(|above| numbers[above])));
    }
    found.iter_mut().for_each(|instance| instance.at = numbers[instance.at]);
    nodes
}

/// Where a node's copies are (EXT_mesh_gpu_instancing); one place where the file's data is missing.
fn places(copies: &json::Instancing, layouts: &[Layout], buffers: &Buffers<'_>) -> Result<Vec<[f32; 16]>, GlbError> {
    let of = |name: &str| match copies.attributes.get(name) {
        None => Ok(None),
        Some(&accessor) => {
            let layout = usize::try_from(accessor).ok().and_then(|a| layouts.get(a));
            let layout = layout
                .ok_or_else(|| GlbError::Broken(format!("instances name accessor {accessor}, which is not there")))?;
            layout.elements(buffers).map(Some)
        }
    };
    let (moved, turned, scaled) = match (of("TRANSLATION"), of("ROTATION"), of("SCALE")) {
        (Err(GlbError::Unsupported(_)), ..)
        | (_, Err(GlbError::Unsupported(_)), _)
        | (.., Err(GlbError::Unsupported(_))) => return Ok(vec![IDENTITY]),
        (moved, turned, scaled) => (moved?, turned?, scaled?),
    };
    let counts = [&moved, &turned, &scaled].map(|e| e.as_ref().map(super::accessor::Elements::len));
    let count = counts.iter().flatten().copied().min().unwrap_or(0);
    if counts.iter().flatten().any(|&n| n != count) {
        return Err(GlbError::Broken("instances have places of different counts".to_owned()));
    }
    Ok((0..count)
        .map(|i| {
            local(&json::Node {
                translation: moved.as_ref().map(|e| e.get(i)),
                rotation: turned.as_ref().map(|e| e.get(i)),
                scale: scaled.as_ref().map(|e| e.get(i)),
                ..json::Node::default()
            })
        })
        .collect())
}

/// Every node with `MSFT_lod` levels, in order of nodes.
pub(super) fn lods(root: &json::Root) -> Result<Vec<LodInfo>, GlbError> {
    let mut found = Vec::new();
    let mut listed = 0_usize;
    for node in &root.nodes {
        let Some(lod) = &node.extensions.msft_lod else { continue };
        let coverage: &[f64] = match &node.extras {
            json::Extras::Known { coverage } => coverage,
            json::Extras::Other(_) => &[],
        };
        let share = |level: usize| coverage.get(level).map(|&v| v as f32);
        let mut levels =
            vec![LodLevel { node: node.name.clone(), mesh: mesh_of(node, root)?, screen_coverage: share(0) }];
        // A node is a level of one other at most; more would let names of a few bytes grow into a large list.
        listed += lod.ids.len();
        if listed > root.nodes.len() {
            return Err(GlbError::Broken("MSFT_lod names more levels than there are nodes".to_owned()));
        }
        for (i, &id) in lod.ids.iter().enumerate() {
            let level = usize::try_from(id).ok().and_then(|id| root.nodes.get(id));
            let level =
                level.ok_or_else(|| GlbError::Broken(format!("MSFT_lod names node {id}, which is not there")))?;
            levels.push(LodLevel {
                node: level.name.clone(),
                mesh: mesh_of(level, root)?,
                screen_coverage: share(i + 1),
            });
        }
        found.push(LodInfo { node: node.name.clone(), levels });
    }
    Ok(found)
}

fn mesh_of(node: &json::Node, root: &json::Root) -> Result<Option<usize>, GlbError> {
    match node.mesh {
        Some(m) if m >= root.meshes.len() as u64 => Err(GlbError::Broken(format!("mesh {m} is named but not there"))),
        mesh => Ok(mesh.map(|m| m as usize)),
    }
}

/// A node's own matrix, column by column: as stated, or scale, then rotation, then translation.
fn local(node: &json::Node) -> [f32; 16] {
    if let Some(matrix) = &node.matrix {
        return **matrix;
    }
    let [tx, ty, tz] = node.translation.unwrap_or_default();
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let [sx, sy, sz] = node.scale.unwrap_or([1.0; 3]);
    [
        (1.0 - 2.0 * (y * y + z * z)) * sx,
        2.0 * (x * y + z * w) * sx,
        2.0 * (x * z - y * w) * sx,
        0.0,
        2.0 * (x * y - z * w) * sy,
        (1.0 - 2.0 * (x * x + z * z)) * sy,
        2.0 * (y * z + x * w) * sy,
        0.0,
        2.0 * (x * z + y * w) * sz,
        2.0 * (y * z - x * w) * sz,
        (1.0 - 2.0 * (x * x + y * y)) * sz,
        0.0,
        tx,
        ty,
        tz,
        1.0,
    ]
}

fn product(a: &[f32; 16], b: &[f32; 16]) -> [f32; 16] {
    std::array::from_fn(|i| {
        let (column, row) = (i / 4 * 4, i % 4);
        a[row] * b[column] + a[4 + row] * b[column + 1] + a[8 + row] * b[column + 2] + a[12 + row] * b[column + 3]
    })
}
