// The shader of hemi-octahedral impostors for three.js: a rectangle that faces the camera shows what the three frames of the
// sheet hold that were drawn from around the camera's direction, each moved to its depth, mixed by their shares. Lights,
// fog, shadows and instances are three.js' own.
//
//     import { impostor } from './impostor.js';
//     lod.addLevel(impostor(node), distance);       // `node`: the level as GLTFLoader gives it
//
// The layout is what the manifest tells of the level, and stands in the extras of its mesh, where it is taken from.

import { BufferGeometry, DoubleSide, Float32BufferAttribute, Mesh, MeshDepthMaterial, MeshDistanceMaterial, MeshStandardMaterial, Sphere, Vector3, Vector4 } from 'three';

const LAYOUT = /* glsl */`
uniform vec4 sheet;    // upper left and lower right corner in the atlas
uniform vec4 shape;    // frames along an edge; radius, reach and height, metres
uniform vec3 middle;
flat varying vec4 frames;      // the first corner of the triangle of frames, and its second
flat varying vec3 shares;
flat varying mat3 treeToView;
varying vec3 rayFrom;          // metres from the middle
varying vec3 rayAlong;

vec2 halfExtent(vec3 z) {
  return vec2(shape.z, shape.w * length(z.xz) + shape.z * abs(z.y));
}

// Level, to the right of who looks along -z.
vec3 rightOf(vec3 z) {
  return abs(z.x) + abs(z.z) > 1e-4 ? normalize(vec3(z.z, 0.0, -z.x)) : vec3(1.0, 0.0, 0.0);
}
`;

const PLACED = /* glsl */`
#ifdef USE_INSTANCING
mat4 toWorld = modelMatrix * instanceMatrix;
#else
mat4 toWorld = modelMatrix;
#endif
mat4 toTree = inverse(toWorld);
vec3 eye = (toTree * vec4(cameraPosition, 1.0)).xyz - middle;
vec3 towards = normalize(isOrthographic ? mat3(toTree) * vec3(viewMatrix[0].z, viewMatrix[1].z, viewMatrix[2].z) : eye);
treeToView = mat3(viewMatrix) * mat3(toWorld);

// The place on the half octahedron; from below it is the horizon's.
vec3 upper = vec3(towards.x, max(towards.y, 0.0), towards.z);
upper /= abs(upper.x) + upper.y + abs(upper.z);
vec2 place = (vec2(upper.x + upper.z, upper.z - upper.x) * 0.5 + 0.5) * (shape.x - 1.0);
vec2 first = clamp(floor(place), 0.0, shape.x - 2.0);
vec2 part = place - first;
bool lower = part.x > part.y;
frames = vec4(first, first + (lower ? vec2(1.0, 0.0) : vec2(0.0, 1.0)));
shares = lower ? vec3(1.0 - part.x, part.x - part.y, part.y) : vec3(1.0 - part.y, part.y - part.x, part.x);

// From nearby the near side of the tree is larger.
float grown = isOrthographic ? 1.0 : 1.0 / max(1.0 - shape.y / length(eye), 0.2);
vec2 corner = position.xy * halfExtent(towards) * grown;
vec3 right = rightOf(towards);
rayFrom = right * corner.x + cross(towards, right) * corner.y;
rayAlong = isOrthographic ? -towards : rayFrom - eye;
vec3 transformed = middle + rayFrom;
`;

const LOOKED_UP = /* glsl */`
uniform sampler2D sheetColor;
uniform sampler2D sheetNormal;
uniform sampler2D sheetOrm;

// Trunks a texel or two wide are gone in the mips that pixels ask for. Finer ones are taken, which three mixed frames keep calm.
const float FINER = 0.35;

// The axes of a frame; z points to its viewer.
mat3 axesOf(vec2 frame) {
  vec2 at = frame / (shape.x - 1.0) * 2.0 - 1.0;
  vec2 level = vec2(at.x - at.y, at.x + at.y) * 0.5;
  vec3 z = normalize(vec3(level.x, max(1.0 - abs(level.x) - abs(level.y), 0.0), level.y));
  vec3 x = rightOf(z);
  return mat3(x, cross(z, x), z);
}

// Adds what a frame holds where the ray meets the tree, by its alpha: colour and alpha, normal, occlusion and roughness.
void addFrame(vec2 frame, float share, inout vec4 color, inout vec3 normal, inout vec2 surface) {
  mat3 axes = axesOf(frame);
  vec2 extent = halfExtent(axes[2]);
  vec2 edge = (sheet.zw - sheet.xy) / shape.x;
  vec2 halfTexel = 0.5 / (vec2(textureSize(sheetColor, 0)) * edge);
  vec3 from = rayFrom * axes, along = rayAlong * axes;
  vec2 slope = along.xy / min(along.z, -1e-4);
  vec2 plane = from.xy - slope * from.z;
  vec2 scale = vec2(0.5, -0.5) / extent;
  vec2 dx = dFdx(plane) * scale * edge * FINER, dy = dFdy(plane) * scale * edge * FINER;
  float deep = 0.0;
  for (int i = 0; i < 2; i++) {
    vec2 uv = sheet.xy + (frame + clamp(0.5 + (plane + slope * deep) * scale, halfTexel, 1.0 - halfTexel)) * edge;
    deep = (textureGrad(sheetOrm, uv, dx, dy).b * 2.0 - 1.0) * shape.y;
  }
  vec2 seen = plane + slope * deep;
  if (any(greaterThan(abs(seen), extent))) return;
  vec2 uv = sheet.xy + (frame + clamp(0.5 + seen * scale, halfTexel, 1.0 - halfTexel)) * edge;
  vec4 texel = textureGrad(sheetColor, uv, dx, dy);
  float own = texel.a * share;
  color += vec4(texel.rgb * own, own);
  vec2 orm = textureGrad(sheetOrm, uv, dx, dy).rg;
  // Above a leaf's roughness it is told how far the normal looks away.
  float away = clamp((orm.y - 0.784) / 0.216, 0.0, 1.0);
  vec3 turned = normalize(textureGrad(sheetNormal, uv, dx, dy).xyz * 2.0 - 1.0) * sqrt(1.0 - away * away);
  normal += axes * vec3(turned.xy, turned.z - away) * own;
  surface += vec2(orm.x, min(orm.y, 0.784)) * own;
}
`;

const COLOR = /* glsl */`
vec4 seenColor = vec4(0.0);
vec3 seenNormal = vec3(0.0);
vec2 seenSurface = vec2(0.0);
addFrame(frames.xy, shares.x, seenColor, seenNormal, seenSurface);
addFrame(frames.zw, shares.y, seenColor, seenNormal, seenSurface);
addFrame(frames.xy + 1.0, shares.z, seenColor, seenNormal, seenSurface);
seenSurface /= max(seenColor.a, 1e-4);
diffuseColor *= vec4(seenColor.rgb / max(seenColor.a, 1e-4), seenColor.a);
`;

const NORMAL = /* glsl */`
vec3 normal = normalize(treeToView * seenNormal);
vec3 nonPerturbedNormal = normal;
`;

/** Has a material of three.js' own show the sheet. */
function wearing(material, uniforms) {
  material.onBeforeCompile = shader => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', `#include <common>\n${LAYOUT}`)
      .replace('#include <begin_vertex>', PLACED);
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', `#include <common>\n${LAYOUT}\n${LOOKED_UP}`)
      .replace('#include <map_fragment>', COLOR)
      .replace('#include <roughnessmap_fragment>', 'float roughnessFactor = roughness * seenSurface.y;')
      .replace('#include <normal_fragment_begin>', NORMAL)
      .replace('#include <aomap_fragment>', 'reflectedLight.indirectDiffuse *= seenSurface.x;');
  };
  material.customProgramCacheKey = () => 'hemi-octahedral impostor';
  return material;
}

/** The impostor of a level, in place of its two crossed planes. Its geometry and material may go into an `InstancedMesh`. */
export function impostor(level) {
  let plain = null;
  level.traverse(part => { if (part.isMesh && part.userData.impostor) plain = part; });
  if (!plain) throw new Error(`${level.name || 'this level'} is no impostor`);
  const { frames, centre, radius, reach, height, uv_min: low, uv_max: high } = plain.userData.impostor;
  const { map, normalMap, aoMap, roughness, alphaTest } = plain.material;
  const uniforms = {
    sheet: { value: new Vector4(...low, ...high) },
    shape: { value: new Vector4(frames, radius, reach, height) },
    middle: { value: new Vector3(...centre) },
    sheetColor: { value: map },
    sheetNormal: { value: normalMap },
    sheetOrm: { value: aoMap },
  };
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new Float32BufferAttribute([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0], 3));
  geometry.setAttribute('normal', new Float32BufferAttribute([0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1], 3));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  // The shader puts the corners elsewhere.
  geometry.boundingSphere = new Sphere(uniforms.middle.value.clone(), radius);
  const mesh = new Mesh(geometry, wearing(new MeshStandardMaterial({ roughness, metalness: 0, alphaTest, shadowSide: DoubleSide }), uniforms));
  mesh.customDepthMaterial = wearing(new MeshDepthMaterial({ alphaTest }), uniforms);
  // Point lights ask for another.
  mesh.customDistanceMaterial = wearing(new MeshDistanceMaterial({ alphaTest }), uniforms);
  mesh.name = plain.name;
  mesh.userData.facing = true;
  return mesh;
}
