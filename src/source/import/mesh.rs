//! A mesh becomes a plant with leaves: told apart, skeletonized, put together again.

use super::{Format, Imported};
use crate::base::Diagnostic;
use crate::preset::plan::{ImportParams, UpAxis};
use crate::source::foliage::{self, Overrides};
use crate::source::scene::{Files, MeshFormat, Scene};
use crate::source::skeletonize::{Method, SkeletonParams, Wood, skeletonize};

/// Imports a mesh. `files` holds its pictures, as far as they are there.
pub(super) fn mesh(
    mut scene: Scene,
    files: &Files<'_>,
    format: MeshFormat,
    file: &str,
    params: &ImportParams,
) -> Result<Imported, Vec<Diagnostic>> {
    let mut notes = std::mem::take(&mut scene.notes);
    let overrides = Overrides { leaves: params.leaves.clone(), wood: params.wood.clone() };
    for name in foliage::unmatched(&scene, &overrides) {
        notes.push(format!("no material or part is called \"{name}\""));
    }
    let mut parts = foliage::split(&scene, files, &overrides);
    let up = if params.up == UpAxis::Detect { scene.up.0 } else { params.up };
    let wood =
        Wood { positions: std::mem::take(&mut parts.wood_positions), triangles: std::mem::take(&mut parts.wood) };
    let skeleton = SkeletonParams { up, height: params.height, method: Method::ByPiece, around: Some(parts.bounds) };
    let made = skeletonize(&wood, &skeleton).map_err(|error| {
        let hint = "name the materials or parts that are wood in the preset: `wood: [\"…\"]`";
        vec![Diagnostic::new(file, error.to_string()).with_hint(hint)]
    })?;
    notes.extend(made.notes);
    notes.append(&mut parts.notes);
    let plant = foliage::attach(made.plant, &parts, &made.placement, &mut notes);
    Ok(Imported { plant, format: Format::Mesh(format), art: parts.art, notes })
}
