//! A mesh becomes a plant with leaves: told apart, skeletonized, put together again.
//!
//! glTF says that Y points up, and is believed; but where the wood runs along Z as the trunk of an upright tree does, a note
//! names the field that turns it.

use glam::Vec3;

use super::{Format, Imported};
use crate::base::Diagnostic;
use crate::plant::Plant;
use crate::preset::plan::{ImportParams, UpAxis};
use crate::source::foliage::{self, Overrides, Parts};
use crate::source::scene::{Files, MeshFormat, Scene};
use crate::source::skeletonize::{Method, SkeletonParams, Wood, skeletonize};

/// How much more wood runs along Z than along Y and along X in a tree that lies.
const LYING: f32 = 1.5;
/// Most names that an error lists.
const MOST_NAMES: usize = 4;

/// Imports a mesh. `files` holds its pictures, as far as they are there.
pub(super) fn mesh(
    mut scene: Scene,
    files: &Files<'_>,
    format: MeshFormat,
    file: &str,
    params: &ImportParams,
) -> Result<Imported, Vec<Diagnostic>> {
    if params.objects.is_empty() {
        scene.keep_first_tree(params.up);
    } else {
        scene.keep_objects(&params.objects, file).map_err(|error| vec![error])?;
    }
    let mut notes = std::mem::take(&mut scene.notes);
    let overrides = Overrides { leaves: params.leaves.clone(), wood: params.wood.clone() };
    for name in foliage::unmatched(&scene, &overrides) {
        let names = scene.names_told();
        let are = if names.is_empty() { "the file names none".to_owned() } else { format!("there are {names}") };
        notes.push(format!("no material or part is called \"{name}\"; {are}"));
    }
    let mut parts = foliage::split(&scene, files, &overrides);
    if parts.wood.is_empty() {
        return Err(vec![no_wood(&scene, &parts, file)]);
    }
    let up = if params.up == UpAxis::Detect { scene.up.0 } else { params.up };
    let said_by_format = params.up == UpAxis::Detect && scene.up.0 == UpAxis::Y;
    let wood =
        Wood { positions: std::mem::take(&mut parts.wood_positions), triangles: std::mem::take(&mut parts.wood) };
    let skeleton = SkeletonParams { up, height: params.height, method: Method::ByPiece, around: Some(parts.bounds) };
    let made = skeletonize(&wood, &skeleton).map_err(|error| {
        let error = error.to_string();
        let hint = if said_by_format && error.contains("rises above") {
            "glTF says that Y points up; where the file's tree rises along Z, `up: Z` in the preset stands it up"
        } else if error.contains("loose pieces") {
            "cards of leaves are no wood: leave them out of `wood` in the preset, and export trunk and branches with them"
        } else {
            "name the materials or parts that are wood in the preset: `wood: [\"…\"]`"
        };
        vec![Diagnostic::new(file, error).with_hint(hint)]
    })?;
    notes.extend(made.notes);
    if said_by_format && lies(&made.plant) {
        notes.push(
            "the wood runs along Z, and glTF says that Y points up: the tree lies on its side; `up: Z` in the preset stands \
             it up"
                .to_owned(),
        );
    }
    notes.append(&mut parts.notes);
    let plant = foliage::attach(made.plant, &parts, &made.placement, &mut notes);
    if plant.leaves().is_empty() {
        notes.push(foliage::BARE.to_owned());
    }
    Ok(Imported { plant, format: Format::Mesh(format), art: parts.art, notes })
}

/// Whether a plant whose Y is the file's has its trunk along Z: lengths along the axes are weighed by cross-section, as where
/// the file doesn't say which axis points up. A crown spreads along X as far as along Z.
fn lies(plant: &Plant) -> bool {
    let posed = plant.pose();
    let thickest = plant.all_radii().iter().fold(f32::MIN_POSITIVE, |most, r| most.max(*r));
    let mut sum = Vec3::ZERO;
    for id in plant.chain_ids() {
        for (ends, radii) in posed.chain(plant, id).windows(2).zip(plant.radii(id).windows(2)) {
            let thick = (radii[0] + radii[1]) * 0.5 / thickest;
            sum += (ends[1] - ends[0]).abs() * (thick * thick);
        }
    }
    sum.z > sum.y.max(sum.x) * LYING
}

/// Says what became of a mesh of which nothing is wood.
fn no_wood(scene: &Scene, parts: &Parts, file: &str) -> Diagnostic {
    let mut names: Vec<&str> = Vec::new();
    let of_parts = scene.parts.iter().map(|part| part.name.as_str());
    for name in scene.materials.iter().map(|m| m.name.as_str()).chain(of_parts) {
        if !name.is_empty() && !names.contains(&name) {
            names.push(name);
        }
    }
    let taken = if parts.cards.is_empty() && parts.crowns.is_empty() { "dropped" } else { "taken for leaves" };
    let shown = names.iter().take(MOST_NAMES).map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let called = if shown.is_empty() { String::new() } else { format!(" ({shown})") };
    let alone = "leaf cards or a billboard alone are no tree: export its trunk and branches with them";
    let hint = match names[..] {
        [first, _, ..] => format!("if a part of it is trunk and branches, name that: `wood: [\"{first}\"]`; {alone}"),
        _ => alone.to_owned(),
    };
    Diagnostic::new(file, format!("there is no wood: all of the mesh{called} was {taken}")).with_hint(hint)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::scene::{Alpha, Material, Part, SceneUp};

    /// A tube of six sides from one place to another.
    fn tube(part: &mut Part, from: Vec3, to: Vec3, radius: f32) {
        let way = crate::base::Frame::along((to - from).normalize());
        let first = part.positions.len() as u32;
        for k in 0..5_u32 {
            for s in 0..6_u32 {
                let (sin, cos) = crate::base::math::sin_cos(s as f32 * std::f32::consts::TAU / 6.0);
                let ring = (way.x * cos + way.z * sin) * (radius * (1.0 - 0.1 * k as f32));
                part.positions.push(from.lerp(to, k as f32 / 4.0) + ring);
            }
        }
        for k in 0..4 {
            for s in 0..6 {
                let (a, b) = (first + k * 6 + s, first + k * 6 + (s + 1) % 6);
                part.triangles.extend([[a, b + 6, b], [a, a + 6, b + 6]]);
            }
        }
    }

    /// A trunk of four metres with four branches, upright along Y or lying along Z.
    fn bare(lies: bool) -> Scene {
        let mut part = Part { name: "bark".into(), ..Part::default() };
        tube(&mut part, Vec3::ZERO, Vec3::Y * 4.0, 0.2);
        for way in [Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z] {
            tube(&mut part, Vec3::Y * 2.5, Vec3::Y * 3.0 + way * 1.5, 0.05);
        }
        if lies {
            part.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x, -p.z, p.y));
        }
        part.faces = (0..part.triangles.len() as u32).collect();
        Scene { parts: vec![part], up: SceneUp(UpAxis::Y), ..Scene::default() }
    }

    /// A card of a metre beside the trunk.
    fn card(name: &str) -> Part {
        let corner = |x: f32, y: f32| Vec3::new(0.3 + x, 3.0 + y, 0.0);
        Part {
            name: name.into(),
            positions: vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            faces: vec![0, 1],
            ..Part::default()
        }
    }

    fn imported(scene: Scene, params: &ImportParams) -> Result<Imported, Vec<Diagnostic>> {
        mesh(scene, &Files::new(), MeshFormat::Glb, "t.glb", params)
    }

    #[test]
    fn a_gltf_that_lies_on_its_side_is_told_with_the_field_that_stands_it_up() {
        let told = |scene: Scene, up: UpAxis| {
            let notes = imported(scene, &ImportParams { up, ..ImportParams::default() }).unwrap().notes;
            notes.iter().any(|note| note.contains("lies on its side; `up: Z`"))
        };
        assert!(told(bare(true), UpAxis::Detect));
        for (lies, up) in [(false, UpAxis::Detect), (true, UpAxis::Y), (true, UpAxis::Z)] {
            assert!(!told(bare(lies), up), "{lies} {up:?}");
        }
        // Where not even a branch rises, the error says as much.
        let mut pole = Part { name: "bark".into(), ..Part::default() };
        tube(&mut pole, Vec3::ZERO, Vec3::Z * 4.0, 0.2);
        let scene = Scene { parts: vec![pole], up: SceneUp(UpAxis::Y), ..Scene::default() };
        let error = imported(scene.clone(), &ImportParams::default()).unwrap_err().remove(0);
        assert!(error.message.contains("rises above") && error.hint.contains("`up: Z`"), "{error}");
        assert!(imported(scene, &ImportParams { up: UpAxis::Z, ..ImportParams::default() }).is_ok());
    }

    #[test]
    fn wood_alone_is_told_and_a_leafy_mesh_is_not() {
        let notes = |scene| imported(scene, &ImportParams::default()).unwrap().notes;
        assert!(notes(bare(false)).contains(&foliage::BARE.to_owned()));
        let mut leafy = bare(false);
        leafy.parts.push(card("leaves"));
        assert!(!notes(leafy).contains(&foliage::BARE.to_owned()));
    }

    #[test]
    fn a_mesh_without_wood_is_told_by_what_it_was_taken_for() {
        let mut leaves = card("");
        leaves.material = Some(0);
        let materials = vec![Material { name: "billboard".into(), alpha: Alpha::Mask(0.5), ..Material::default() }];
        let scene = Scene { parts: vec![leaves], materials, ..Scene::default() };
        let error = imported(scene.clone(), &ImportParams::default()).unwrap_err().remove(0);
        assert_eq!(error.message, "there is no wood: all of the mesh (\"billboard\") was taken for leaves");
        assert!(error.hint.contains("export its trunk and branches") && !error.hint.contains("`wood:"), "{error}");
        let mut two = scene.clone();
        two.parts.push(card("leaves"));
        let error = imported(two, &ImportParams::default()).unwrap_err().remove(0);
        assert!(error.hint.contains("`wood: [\"billboard\"]`"), "{error}");
        // Cards that the preset calls wood are none, but they have an area.
        let wood = vec!["billboard".to_owned()];
        let error = imported(scene, &ImportParams { wood, ..ImportParams::default() }).unwrap_err().remove(0);
        assert!(error.message.contains("loose pieces of one to three triangles"), "{error}");
        assert!(error.hint.contains("leave them out of `wood`"), "{error}");
    }
}
