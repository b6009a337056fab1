// The shader of hemi-octahedral impostors for Bevy: a rectangle that faces the viewer shows what the three frames of the
// sheet hold that were drawn from around the viewer's direction, each moved to its depth, mixed by their shares. The same as
// `examples/engines/impostor.js`. For the picture, its prepass, and the shadows, where the viewer is the light.

#import bevy_pbr::{
    mesh_bindings::mesh,
    mesh_functions,
    mesh_view_bindings::view,
    view_transformations::position_world_to_clip,
}
#ifdef PREPASS_PIPELINE
#import bevy_pbr::{pbr_prepass_functions::calculate_motion_vector, prepass_io::{Vertex, VertexOutput}}
#ifdef PREPASS_FRAGMENT
#import bevy_pbr::prepass_io::FragmentOutput
#endif
#else
#import bevy_pbr::{
    forward_io::{Vertex, VertexOutput, FragmentOutput},
    pbr_functions::{apply_pbr_lighting, calculate_view, main_pass_post_lighting_processing},
    pbr_types::{pbr_input_new, STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT},
}
#endif
#ifdef VISIBILITY_RANGE_DITHER
#import bevy_pbr::pbr_functions::visibility_range_dither
#endif

struct Layout {
    // Upper left and lower right corner in the atlas.
    sheet: vec4<f32>,
    // Frames along an edge; radius, reach and height, metres.
    shape: vec4<f32>,
    // Middle of the tree; the least alpha that is shown.
    middle: vec4<f32>,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> placed: Layout;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var sheet_color: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(2) var sheet_normal: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(3) var sheet_orm: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(4) var sheet_sampler: sampler;

// Who looks, in metres from the middle of the tree.
struct Viewer {
    eye: vec3<f32>,
    towards: vec3<f32>,
    is_far: bool,
}

fn viewer_of(instance: u32) -> Viewer {
    let local_from_world = mesh_functions::get_local_from_world(instance);
    let is_far = view.clip_from_view[3].w == 1.0;
    let eye = (local_from_world * vec4(view.world_position, 1.0)).xyz - placed.middle.xyz;
    let back = (local_from_world * vec4(view.world_from_view[2].xyz, 0.0)).xyz;
    return Viewer(eye, normalize(select(eye, back, is_far)), is_far);
}

fn half_extent(z: vec3<f32>) -> vec2<f32> {
    return vec2(placed.shape.z, placed.shape.w * length(z.xz) + placed.shape.z * abs(z.y));
}

// Level, to the right of who looks along -z.
fn right_of(z: vec3<f32>) -> vec3<f32> {
    if abs(z.x) + abs(z.z) > 1e-4 {
        return normalize(vec3(z.z, 0.0, -z.x));
    }
    return vec3(1.0, 0.0, 0.0);
}

// The axes of a frame; z points to its viewer.
fn axes_of(frame: vec2<f32>) -> mat3x3<f32> {
    let at = frame / (placed.shape.x - 1.0) * 2.0 - 1.0;
    let level = vec2(at.x - at.y, at.x + at.y) * 0.5;
    let z = normalize(vec3(level.x, max(1.0 - abs(level.x) - abs(level.y), 0.0), level.y));
    let x = right_of(z);
    return mat3x3(x, cross(z, x), z);
}

struct Seen {
    // Premultiplied.
    color: vec4<f32>,
    normal: vec3<f32>,
    // Occlusion and roughness.
    surface: vec2<f32>,
}

// Adds what a frame holds where the ray meets the tree, by its alpha.
fn add_frame(seen: ptr<function, Seen>, frame: vec2<f32>, share: f32, ray_from: vec3<f32>, ray_along: vec3<f32>) {
    let axes = axes_of(frame);
    let extent = half_extent(axes[2]);
    let edge = (placed.sheet.zw - placed.sheet.xy) / placed.shape.x;
    let half_texel = 0.5 / (vec2<f32>(textureDimensions(sheet_color)) * edge);
    let ray = ray_from * axes;
    let along = ray_along * axes;
    let slope = along.xy / min(along.z, -1e-4);
    let plane = ray.xy - slope * ray.z;
    let scale = vec2(0.5, -0.5) / extent;
    // Trunks a texel or two wide are gone in the mips that pixels ask for. Finer ones are taken, which three mixed frames keep calm.
    let finer = 0.35;
    let dx = dpdx(plane) * scale * edge * finer;
    let dy = dpdy(plane) * scale * edge * finer;
    var deep = 0.0;
    for (var i = 0; i < 2; i++) {
        let within = clamp(0.5 + (plane + slope * deep) * scale, half_texel, 1.0 - half_texel);
        let uv = placed.sheet.xy + (frame + within) * edge;
        deep = (textureSampleGrad(sheet_orm, sheet_sampler, uv, dx, dy).b * 2.0 - 1.0) * placed.shape.y;
    }
    let place = plane + slope * deep;
    let within = clamp(0.5 + place * scale, half_texel, 1.0 - half_texel);
    let uv = placed.sheet.xy + (frame + within) * edge;
    let texel = textureSampleGrad(sheet_color, sheet_sampler, uv, dx, dy);
    let own = select(texel.a * share, 0.0, any(abs(place) > extent));
    let normal = textureSampleGrad(sheet_normal, sheet_sampler, uv, dx, dy).xyz * 2.0 - 1.0;
    (*seen).color += vec4(texel.rgb * own, own);
    let orm = textureSampleGrad(sheet_orm, sheet_sampler, uv, dx, dy).rg;
    // Above a leaf's roughness it is told how far the normal looks away.
    let away = clamp((orm.y - 0.784) / 0.216, 0.0, 1.0);
    let turned = normalize(normal) * sqrt(1.0 - away * away);
    (*seen).normal += axes * vec3(turned.xy, turned.z - away) * own;
    (*seen).surface += vec2(orm.x, min(orm.y, 0.784)) * own;
}

// What is seen at a place of the rectangle; nothing where that is little.
fn seen_at(world_position: vec3<f32>, instance: u32) -> Seen {
    let viewer = viewer_of(instance);
    let z = viewer.towards;
    let local = (mesh_functions::get_local_from_world(instance) * vec4(world_position, 1.0)).xyz;
    let ray_from = local - placed.middle.xyz;
    let ray_along = select(ray_from - viewer.eye, -z, viewer.is_far);

    // The place on the half octahedron; from below it is the horizon's.
    var upper = vec3(z.x, max(z.y, 0.0), z.z);
    upper /= abs(upper.x) + upper.y + abs(upper.z);
    let place = (vec2(upper.x + upper.z, upper.z - upper.x) * 0.5 + 0.5) * (placed.shape.x - 1.0);
    let first = clamp(floor(place), vec2(0.0), vec2(placed.shape.x - 2.0));
    let part = place - first;
    let is_lower = part.x > part.y;
    let second = first + select(vec2(0.0, 1.0), vec2(1.0, 0.0), is_lower);
    let shares = vec3(1.0 - max(part.x, part.y), abs(part.x - part.y), min(part.x, part.y));

    var seen = Seen(vec4(0.0), vec3(0.0), vec2(0.0));
    add_frame(&seen, first, shares.x, ray_from, ray_along);
    add_frame(&seen, second, shares.y, ray_from, ray_along);
    add_frame(&seen, first + 1.0, shares.z, ray_from, ray_along);
    return seen;
}

@vertex
fn vertex(corner: Vertex) -> VertexOutput {
    let instance = corner.instance_index;
    let viewer = viewer_of(instance);
    // From nearby the near side of the tree is larger.
    let grown = select(1.0 / max(1.0 - placed.shape.y / length(viewer.eye), 0.2), 1.0, viewer.is_far);
    let place = corner.position.xy * half_extent(viewer.towards) * grown;
    let right = right_of(viewer.towards);
    let local = vec4(placed.middle.xyz + right * place.x + cross(viewer.towards, right) * place.y, 1.0);
    let world_from_local = mesh_functions::get_world_from_local(instance);

    var out: VertexOutput;
    out.world_position = world_from_local * local;
    out.position = position_world_to_clip(out.world_position.xyz);
    out.instance_index = instance;
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    out.unclipped_depth = out.position.z;
    out.position.z = min(out.position.z, 1.0);
#endif
#ifdef PREPASS_PIPELINE
#ifdef MOTION_VECTOR_PREPASS
    out.previous_world_position = mesh_functions::get_previous_world_from_local(instance) * local;
#endif
#endif
#ifdef VISIBILITY_RANGE_DITHER
    out.visibility_range_dither = mesh_functions::get_visibility_range_dither_level(instance, world_from_local[3]);
#endif
    return out;
}

// What is seen, where it is enough.
fn cut(in: VertexOutput) -> Seen {
#ifdef VISIBILITY_RANGE_DITHER
    visibility_range_dither(in.position, in.visibility_range_dither);
#endif
    let seen = seen_at(in.world_position.xyz, in.instance_index);
    if seen.color.a < placed.middle.w {
        discard;
    }
    return seen;
}

#ifdef PREPASS_PIPELINE

#ifdef PREPASS_FRAGMENT
@fragment
fn fragment(in: VertexOutput) -> FragmentOutput {
    let seen = cut(in);
    var out: FragmentOutput;
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    out.frag_depth = in.unclipped_depth;
#endif
#ifdef NORMAL_PREPASS
    let normal = mesh_functions::mesh_normal_local_to_world(seen.normal, in.instance_index);
    out.normal = vec4(normal * 0.5 + 0.5, 1.0);
#endif
#ifdef MOTION_VECTOR_PREPASS
    out.motion_vector = calculate_motion_vector(in.world_position, in.previous_world_position);
#endif
    return out;
}
#else
@fragment
fn fragment(in: VertexOutput) {
    let _seen = cut(in);
}
#endif

#else

@fragment
fn fragment(in: VertexOutput) -> FragmentOutput {
    let seen = cut(in);
    let surface = seen.surface / seen.color.a;
    var input = pbr_input_new();
    input.material.base_color = vec4(seen.color.rgb / seen.color.a, 1.0);
    input.material.perceptual_roughness = surface.y;
    input.material.flags |= STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT;
    input.diffuse_occlusion = vec3(surface.x);
    input.frag_coord = in.position;
    input.world_position = in.world_position;
    input.is_orthographic = view.clip_from_view[3].w == 1.0;
    input.N = mesh_functions::mesh_normal_local_to_world(seen.normal, in.instance_index);
    input.world_normal = input.N;
    input.V = calculate_view(in.world_position, input.is_orthographic);
    input.flags = mesh[in.instance_index].flags;
    var out: FragmentOutput;
    out.color = apply_pbr_lighting(input);
    out.color = main_pass_post_lighting_processing(input, out.color);
    return out;
}

#endif
