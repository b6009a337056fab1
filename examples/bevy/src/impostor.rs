//! Impostors: the last level of a tree, a sheet of pictures from all around it, shown by `impostor.wgsl`.
//!
//! The file holds two crossed planes for whoever has no shader. What the shader needs stands in the extras of their mesh:
//! [`wear`] puts a rectangle in place of them, for all trees of one file the same, so that Bevy draws those at once.

use std::collections::HashMap;

use bevy::asset::{RenderAssetUsages, embedded_asset};
use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::gltf::GltfMeshExtras;
use bevy::light::NotShadowReceiver;
use bevy::mesh::{Indices, MeshVertexBufferLayoutRef, PrimitiveTopology};
use bevy::pbr::{MaterialPipeline, MaterialPipelineKey};
use bevy::prelude::*;
use bevy::reflect::TypePath;
use bevy::render::render_resource::{AsBindGroup, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError};
use bevy::shader::ShaderRef;
use bevy::world_serialization::WorldInstanceReady;

const SHADER: &str = "embedded://treewright_bevy/impostor.wgsl";

/// Shows impostors as what they are.
pub struct ImpostorPlugin;

impl Plugin for ImpostorPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "impostor.wgsl");
        app.add_plugins(MaterialPlugin::<ImpostorMaterial>::default()).add_observer(wear);
    }
}

/// What the shader reads; the pictures are those of the leaves' atlas.
#[derive(Asset, AsBindGroup, Clone, TypePath)]
pub struct ImpostorMaterial {
    #[uniform(0)]
    layout: Layout,
    #[texture(1)]
    #[sampler(4)]
    color: Handle<Image>,
    #[texture(2)]
    normal: Handle<Image>,
    #[texture(3)]
    orm: Handle<Image>,
}

/// As the manifest and the mesh's extras tell it.
#[derive(Clone, ShaderType)]
struct Layout {
    /// Upper left and lower right corner in the atlas.
    sheet: Vec4,
    /// Frames along an edge; radius, reach and height, metres.
    shape: Vec4,
    /// Middle of the tree; the least alpha that is shown.
    middle: Vec4,
}

impl Layout {
    fn read(extras: &str, least_alpha: f32) -> Option<Self> {
        let value: serde_json::Value = serde_json::from_str(extras).ok()?;
        let impostor = value.get("impostor")?;
        let number = |field: &str| Some(impostor.get(field)?.as_f64()? as f32);
        let part = |field: &str, i: usize| Some(impostor.get(field)?.get(i)?.as_f64()? as f32);
        Some(Self {
            sheet: Vec4::new(part("uv_min", 0)?, part("uv_min", 1)?, part("uv_max", 0)?, part("uv_max", 1)?),
            shape: Vec4::new(number("frames")?, number("radius")?, number("reach")?, number("height")?),
            middle: Vec4::new(part("centre", 0)?, part("centre", 1)?, part("centre", 2)?, least_alpha),
        })
    }
}

impl Material for ImpostorMaterial {
    fn vertex_shader() -> ShaderRef {
        SHADER.into()
    }

    fn fragment_shader() -> ShaderRef {
        SHADER.into()
    }

    fn prepass_vertex_shader() -> ShaderRef {
        SHADER.into()
    }

    fn prepass_fragment_shader() -> ShaderRef {
        SHADER.into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        AlphaMode::Mask(self.layout.middle.w)
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        _: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        // Of a tree that is mirrored the rectangle is, too.
        descriptor.primitive.cull_mode = None;
        Ok(())
    }
}

/// The rectangle of all impostors, and each file's material.
#[derive(Default)]
struct Made {
    rectangle: Option<Handle<Mesh>>,
    materials: HashMap<AssetId<StandardMaterial>, Handle<ImpostorMaterial>>,
}

/// Puts the rectangle in place of the crossed planes once a tree is there, also when it is there again.
fn wear(
    ready: On<WorldInstanceReady>,
    mut commands: Commands,
    mut made: Local<Made>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ImpostorMaterial>>,
    children: Query<&Children>,
    planes: Query<(&GltfMeshExtras, &MeshMaterial3d<StandardMaterial>)>,
    standard: Res<Assets<StandardMaterial>>,
) {
    for entity in children.iter_descendants(ready.entity) {
        let Ok((extras, worn)) = planes.get(entity) else { continue };
        let Some(leaf) = standard.get(&worn.0) else { continue };
        let least_alpha = if let AlphaMode::Mask(least) = leaf.alpha_mode { least } else { 0.5 };
        let Some(layout) = Layout::read(&extras.value, least_alpha) else { continue };
        let (Some(color), Some(normal), Some(orm)) =
            (&leaf.base_color_texture, &leaf.normal_map_texture, &leaf.metallic_roughness_texture)
        else {
            continue;
        };
        let (middle, radius) = (layout.middle.truncate(), layout.shape.y);
        let material = ImpostorMaterial { layout, color: color.clone(), normal: normal.clone(), orm: orm.clone() };
        let handle = made.materials.entry(worn.0.id()).or_insert_with(|| materials.reserve_handle()).clone();
        // A tree that is loaded again may have another sheet.
        let _ = materials.insert(&handle, material);
        let rectangle = made.rectangle.get_or_insert_with(|| meshes.add(rectangle())).clone();
        commands
            .entity(entity)
            .remove::<MeshMaterial3d<StandardMaterial>>()
            // The shader puts the corners elsewhere. It casts shadows, but would stand in its own.
            .insert((Mesh3d(rectangle), MeshMaterial3d(handle), NoAutoAabb, NotShadowReceiver))
            .insert(Aabb { center: middle.into(), half_extents: Vec3::splat(radius).into() });
    }
}

/// Its corners say which they are.
fn rectangle() -> Mesh {
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(
            Mesh::ATTRIBUTE_POSITION,
            vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
        )
        // Bevy asks for them where there is a prepass of normals.
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; 4])
        .with_inserted_indices(Indices::U32(vec![0, 1, 2, 0, 2, 3]))
}
