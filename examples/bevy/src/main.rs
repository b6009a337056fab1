//! Shows a set that treewright built for Bevy, and swaps trees while `treewright watch` builds them anew.
//!
//!     treewright watch trees --out assets/trees        # beside it
//!     cargo run -- trees/avenue                        # a set, below `assets`
//!     cargo run -- trees/avenue --shots shots          # no window: writes shots/1.png, and one more a swap
//!
//! Every tree of the set stands at four distances, just behind where each of its levels takes over: those are measured and
//! may be hundreds of metres away, so that the last ones are small. What to load, and when to load it again, the manifest says: treewright writes it last, and it lists every file with its hash. Bevy's own `file_watcher` sees
//! files that are written in place; on Linux treewright swaps a set's whole folder in one step, which that reports as a
//! renamed folder and loads nothing of. Reading one small file now and then works everywhere, and no tree is loaded
//! from a set that is only half there.

mod impostor;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use bevy::app::ScheduleRunnerPlugin;
use bevy::camera::RenderTarget;
use bevy::camera::visibility::VisibilityRange;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::gltf::GltfExtras;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};
use bevy::time::common_conditions::on_timer;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy::world_serialization::WorldInstanceReady;

/// To the right of straight ahead, for the trees that show the same level: radians.
const ROWS: [f32; 4] = [-0.42, 0.0, 0.26, 0.46];
/// How far away those stand that show the first, and how far apart, metres.
const NEAR: (f32, f32) = (34.0, 14.0);
/// Frames that a change is given before it is photographed.
const SETTLED: u32 = 60;

/// The set that is shown: its folder below `assets`, and the hash of each of its files as they were loaded.
#[derive(Resource, Default)]
struct Set {
    folder: String,
    hashes: BTreeMap<String, String>,
}

/// A tree by its file, which of those it is, and the level that it is to show.
#[derive(Component)]
struct Tree {
    file: String,
    number: usize,
    level: usize,
}

/// Where to photograph to, how many were made, and how many frames ago something changed.
#[derive(Resource)]
struct Shots {
    folder: PathBuf,
    target: Handle<Image>,
    made: u32,
    still: u32,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = arguments.first().cloned().unwrap_or_else(|| "trees/avenue".to_owned());
    let shots = arguments.iter().position(|a| a == "--shots").and_then(|i| arguments.get(i + 1)).map(PathBuf::from);
    let mut app = App::new();
    let plugins = DefaultPlugins.set(AssetPlugin {
        // Relative to where it is started; Bevy would take the folder of this Cargo.toml.
        file_path: std::env::current_dir().unwrap_or_default().join("assets").to_string_lossy().into_owned(),
        ..default()
    });
    match &shots {
        None => app.add_plugins(plugins),
        Some(_) => app
            .add_plugins(
                plugins
                    .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
                    .disable::<WinitPlugin>(),
            )
            .add_plugins(ScheduleRunnerPlugin::run_loop(Duration::from_millis(16))),
    };
    app.insert_resource(Set { folder, ..default() })
        .insert_resource(ClearColor(Color::srgb(0.62, 0.72, 0.82)))
        .insert_resource(GlobalAmbientLight { brightness: 900.0, ..default() })
        .add_systems(
            Startup,
            (ground, move |commands: Commands, images: ResMut<Assets<Image>>| {
                stage(commands, images, shots.as_deref());
            }),
        )
        .add_systems(Update, follow.run_if(on_timer(Duration::from_millis(250))))
        .add_systems(Update, photograph.run_if(resource_exists::<Shots>))
        .add_plugins(impostor::ImpostorPlugin)
        .add_observer(levels)
        .run();
}

/// What trees stand on, and throw their shadows on.
fn ground(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    let soil = StandardMaterial { base_color: Color::srgb(0.36, 0.38, 0.28), perceptual_roughness: 1.0, ..default() };
    commands
        .spawn((Mesh3d(meshes.add(Plane3d::new(Vec3::Y, Vec2::splat(4000.0)))), MeshMaterial3d(materials.add(soil))));
}

/// Light and a camera.
fn stage(mut commands: Commands, mut images: ResMut<Assets<Image>>, shots: Option<&Path>) {
    commands.spawn((
        DirectionalLight { illuminance: 9_000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(-2.0, 3.0, 2.5).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    // Some tone mappings need tables that this program does without.
    let eye = Transform::from_xyz(0.0, 3.0, 0.0).looking_at(Vec3::new(0.0, 6.0, -NEAR.0), Vec3::Y);
    let mut camera = commands.spawn((Camera3d::default(), Tonemapping::AcesFitted, eye));
    if let Some(folder) = shots {
        let target = images.add(Image::new_target_texture(960, 600, TextureFormat::Rgba8UnormSrgb, None));
        camera.insert(RenderTarget::Image(target.clone().into()));
        commands.insert_resource(Shots { folder: folder.to_owned(), target, made: 0, still: 0 });
    }
}

/// Reads the manifest; loads what is new in it, loads again what changed, and lets go what is gone.
fn follow(
    mut commands: Commands,
    mut set: ResMut<Set>,
    mut shots: Option<ResMut<Shots>>,
    server: Res<AssetServer>,
    trees: Query<(Entity, &Tree)>,
) {
    let name = set.folder.rsplit('/').next().unwrap_or_default();
    let manifest = std::env::current_dir().unwrap_or_default().join("assets").join(&set.folder);
    // Missing while it is built for the first time.
    let Ok(text) = std::fs::read(manifest.join(format!("{name}.manifest.json"))) else { return };
    let Ok(manifest) = serde_json::from_slice::<serde_json::Value>(&text) else { return };
    let hashes: BTreeMap<String, String> = (manifest["files"].as_array().into_iter().flatten())
        .filter_map(|file| Some((file["file"].as_str()?.to_owned(), file["blake3"].as_str()?.to_owned())))
        .collect();
    if hashes == set.hashes {
        return;
    }
    for (file, _) in hashes.iter().filter(|(file, hash)| set.hashes.get(*file).is_some_and(|old| old != *hash)) {
        info!("{file} changed");
        server.reload(format!("{}/{file}", set.folder));
    }
    for (entity, _) in trees.iter().filter(|(_, tree)| !hashes.contains_key(&tree.file)) {
        commands.entity(entity).despawn();
    }
    // Those with colliders end in `.colliders.bevy.glb`, and are for the physics.
    let shown = |file: &&String| file.ends_with(".bevy.glb") && !file.contains(".colliders.");
    for (i, file) in hashes.keys().filter(shown).enumerate().filter(|(_, file)| !set.hashes.contains_key(*file)) {
        info!("{file} loads");
        let scene = server.load(GltfAssetLabel::Scene(0).from_asset(format!("{}/{file}", set.folder)));
        for level in 0..ROWS.len() {
            commands.spawn((
                Tree { file: file.clone(), number: i, level },
                WorldAssetRoot(scene.clone()),
                Transform::from_rotation(Quat::from_rotation_y(level as f32)),
            ));
        }
    }
    set.hashes = hashes;
    if let Some(shots) = &mut shots {
        shots.still = 0;
    }
}

/// Gives every level its range once its tree is there, also when it is there again, and the tree its place. A node's extras
/// hold the range; what is drawn are the meshes below it, which do not inherit it.
fn levels(
    ready: On<WorldInstanceReady>,
    mut commands: Commands,
    mut trees: Query<(&Tree, &mut Transform)>,
    children: Query<&Children>,
    extras: Query<&GltfExtras>,
    meshes: Query<(), With<Mesh3d>>,
) {
    let mut begins = Vec::new();
    for node in children.iter_descendants(ready.entity) {
        let Some(range) = extras.get(node).ok().and_then(|extras| range(&extras.value)) else { continue };
        begins.push(range.start_margin.end);
        for mesh in children.iter_descendants(node).filter(|&mesh| meshes.contains(mesh)) {
            commands.entity(mesh).insert(range.clone());
        }
    }
    begins.sort_by(f32::total_cmp);
    let Ok((tree, mut place)) = trees.get_mut(ready.entity) else { return };
    let away = begins.get(tree.level).or(begins.last()).map_or(0.0, |begin| begin * 1.05).max(NEAR.0);
    // The further away, the wider apart, so that none hides behind another.
    let apart = NEAR.1 * (away / 60.0).max(1.0) * tree.number as f32;
    place.translation = Vec3::new(ROWS[tree.level].tan() * away + apart, 0.0, -away);
}

/// The range of a level out of its extras, with a tenth on both sides to fade from one to the next: all levels of a tree
/// have one origin, as that needs.
fn range(extras: &str) -> Option<VisibilityRange> {
    let value: serde_json::Value = serde_json::from_str(extras).ok()?;
    let bound = |i: usize| Some(value["visibility_range"].get(i)?.as_f64()? as f32);
    let (from, to) = (bound(0)?, bound(1)?);
    let start = from * 0.9..from * 1.1;
    Some(VisibilityRange {
        end_margin: (to * 0.9).max(start.end)..(to * 1.1).max(start.end),
        start_margin: start,
        use_aabb: false,
    })
}

/// Writes a picture once all is loaded and has stood still, one for each state of the set.
fn photograph(
    mut commands: Commands,
    mut shots: ResMut<Shots>,
    roots: Query<&WorldAssetRoot>,
    server: Res<AssetServer>,
) {
    let loaded = !roots.is_empty() && roots.iter().all(|root| server.is_loaded_with_dependencies(&root.0));
    shots.still = if loaded { shots.still.saturating_add(1) } else { 0 };
    if shots.still == SETTLED {
        shots.made += 1;
        let path = shots.folder.join(format!("{}.png", shots.made));
        info!("writes {}", path.display());
        let _ = std::fs::create_dir_all(&shots.folder);
        commands.spawn(Screenshot::image(shots.target.clone())).observe(save_to_disk(path));
    }
}
