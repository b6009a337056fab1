// Draws impostors with `examples/engines/impostor.hlsl` (what Unity and Unreal run, here as GLSL) and with `impostor.js`, and
// checks that both show the same: from around and above, from nearby and from far away.
//
//     node .ci/hlsl.mjs out/ash [CHROMIUM]
//
// Wants glslangValidator and spirv-cross. Exit code 1 where more than `tolerance` of the pixels differ.

import { execFileSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { open } from "./three.mjs";

// Share of those that are drawn by either, and difference of what both draw, of 255.
const tolerance = { outline: 0.002, color: 1 };

const [root, chromium] = process.argv.slice(2);
if (!root) {
  console.error("usage: node hlsl.mjs FOLDER [CHROMIUM]");
  process.exit(2);
}
const folder = path.resolve(root);
const set = JSON.parse(await readFile(path.join(folder, `${path.basename(folder)}.manifest.json`)));
const variant = set.variants[0];
const level = variant.levels.findIndex((level) => level.kind === "Impostor");
if (level < 0) throw new Error(`${set.set} has no impostor`);

const common = `
#include "impostor.hlsl"
cbuffer Told { float4 sheet, shape, middle, eye, back, texels, clipX, clipY, clipZ, clipW; };
Impostor told() {
  Impostor it = (Impostor)0;
  it.sheet = sheet; it.shape = shape; it.middle = middle.xyz;
  it.eye = eye.xyz; it.back = back.xyz; it.isFar = eye.w > 0.5;
  return it;
}`;
const sources = {
  vert: `${common}
void main(float3 position : POSITION, float2 uv : TEXCOORD0, out float4 clip : SV_Position, out float3 at : TEXCOORD0) {
  at = told().Placed(uv);
  float4 from = float4(at, 1.0);
  clip = float4(dot(clipX, from), dot(clipY, from), dot(clipZ, from), dot(clipW, from));
}`,
  frag: `${common}
Texture2D colors; SamplerState colorSampler;
Texture2D normals; SamplerState normalSampler;
Texture2D orms; SamplerState ormSampler;
float4 main(float4 clip : SV_Position, float3 at : TEXCOORD0) : SV_Target {
  Impostor seen = told();
  seen.Look(at, texels.xy, colors, colorSampler, normals, normalSampler, orms, ormSampler);
  if (seen.color.a < texels.z) discard;
  float3 lit = seen.color.rgb * max(dot(seen.normal, normalize(float3(0.4, 0.7, 0.6))), 0.0) * seen.roughness * seen.occlusion;
  return float4(lit, 1.0);
}`,
};
const work = await mkdtemp(path.join(tmpdir(), "treewright-hlsl-"));
const glsl = {};
for (const [stage, text] of Object.entries(sources)) {
  const [file, spirv] = [path.join(work, `it.${stage}.hlsl`), path.join(work, `${stage}.spv`)];
  await writeFile(file, text);
  const engines = fileURLToPath(new URL("../examples/engines", import.meta.url));
  execFileSync("glslangValidator", ["-D", "-V", "-S", stage, "-e", "main", "--auto-map-bindings", "--auto-map-locations", `-I${engines}`, file, "-o", spirv]);
  const to = ["--es", "--version", "300", "--glsl-emit-ubo-as-plain-uniforms"];
  glsl[stage] = execFileSync("spirv-cross", [spirv, ...to], { encoding: "utf8" }).replace(/^#version.*/, "");
}
await rm(work, { recursive: true });

const { tab, faults, close } = await open(folder, `
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { impostor } from "/engines/impostor.js";
const edge = 256;
const renderer = new THREE.WebGLRenderer({ antialias: false });
renderer.setClearColor(0x000000, 0);
renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
const target = new THREE.WebGLRenderTarget(edge, edge);
const glsl = ${JSON.stringify(glsl)};

function drawn(mesh, camera) {
  const scene = new THREE.Scene();
  scene.add(mesh);
  renderer.setRenderTarget(target);
  renderer.clear();
  renderer.render(scene, camera);
  const bytes = new Uint8Array(edge * edge * 4);
  renderer.readRenderTargetPixels(target, 0, 0, edge, edge, bytes);
  return bytes;
}

// The names that spirv-cross gives: a structure of what is told, and textures with their samplers.
function ported(plain, uniforms) {
  const told = (text) => text.match(/uniform Told (\\w+);/)?.[1];
  const named = {};
  for (const stage of ["vert", "frag"]) if (told(glsl[stage])) named[told(glsl[stage])] = { value: uniforms };
  for (const [name, map] of [["colors", "map"], ["normals", "normalMap"], ["orms", "aoMap"]]) {
    const found = glsl.frag.match(new RegExp("uniform \\\\w* ?sampler2D (\\\\w*" + name + "\\\\w*);"))[1];
    named[found] = { value: plain.material[map] };
  }
  const material = new THREE.RawShaderMaterial({
    glslVersion: THREE.GLSL3, vertexShader: glsl.vert, fragmentShader: glsl.frag, uniforms: named, side: THREE.DoubleSide,
  });
  const mesh = new THREE.Mesh(plain.geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}

window.compare = async (file, name) => {
  const gltf = await new GLTFLoader().loadAsync("/files/" + encodeURIComponent(file));
  const names = gltf.parser.json.meshes.map((mesh) => mesh.name);
  const level = await gltf.parser.getDependency("mesh", names.indexOf(name));
  let plain = null;
  level.traverse((part) => { if (part.isMesh && part.userData.impostor) plain = part; });
  const { frames, centre, radius, reach, height, uv_min, uv_max } = plain.userData.impostor;
  const { image } = plain.material.map;
  const uniforms = {
    sheet: new THREE.Vector4(...uv_min, ...uv_max), shape: new THREE.Vector4(frames, radius, reach, height),
    middle: new THREE.Vector4(...centre), eye: new THREE.Vector4(), back: new THREE.Vector4(),
    texels: new THREE.Vector4(image.width, image.height, plain.material.alphaTest, 0),
    clipX: new THREE.Vector4(), clipY: new THREE.Vector4(), clipZ: new THREE.Vector4(), clipW: new THREE.Vector4(),
  };
  const theirs = ported(plain, uniforms), ours = impostor(level);
  const change = ours.material.onBeforeCompile;
  // As little of lights as the other.
  ours.material.onBeforeCompile = (shader) => {
    change(shader);
    shader.fragmentShader = shader.fragmentShader.replace("#include <opaque_fragment>",
      "vec3 inTree = normalize(inverse(treeToView) * normal);\\n" +
      "gl_FragColor = vec4(diffuseColor.rgb * max(dot(inTree, normalize(vec3(0.4, 0.7, 0.6))), 0.0) * seenSurface.y * seenSurface.x, 1.0);");
  };
  const found = [];
  for (let i = 0; i < 24; i++) {
    const isFar = i % 3 === 0;
    const sin = -0.1 + 1.1 * i / 24, cos = Math.sqrt(1 - sin * sin), turn = 2.4 * i;
    const towards = new THREE.Vector3(Math.sin(turn) * cos, sin, Math.cos(turn) * cos);
    const away = radius * (isFar ? 8 : 2.5 + i % 5 * 2), wide = radius * 1.4;
    const camera = isFar ? new THREE.OrthographicCamera(-wide, wide, wide, -wide, 0.1, 20 * radius)
      : new THREE.PerspectiveCamera(2 * Math.atan(wide / away) * 180 / Math.PI, 1, 0.1, 20 * radius);
    camera.position.set(...centre).addScaledVector(towards, away);
    camera.lookAt(...centre);
    camera.updateMatrixWorld();
    uniforms.eye.set(...camera.position, isFar ? 1 : 0);
    uniforms.back.set(...new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 2), 0);
    const toClip = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).elements;
    ["clipX", "clipY", "clipZ", "clipW"].forEach((row, r) => uniforms[row].set(toClip[r], toClip[r + 4], toClip[r + 8], toClip[r + 12]));
    const [a, b] = [drawn(ours, camera), drawn(theirs, camera)];
    let [either, one, off, both] = [0, 0, 0, 0];
    for (let at = 0; at < a.length; at += 4) {
      const [p, q] = [a[at + 3] > 0, b[at + 3] > 0];
      either += p || q;
      one += p !== q;
      if (p && q) {
        both++;
        for (const c of [0, 1, 2]) off += Math.abs(a[at + c] - b[at + c]) / 3;
      }
    }
    found.push({ drawn: either, outline: one / Math.max(either, 1), color: off / Math.max(both, 1) });
  }
  return found;
};`, { edge: 64, chromium });

const { mesh } = variant.levels[level];
const found = await tab.evaluate(([file, name]) => window.compare(file, name), [variant.file, mesh])
  .catch((error) => (faults.push(String(error)), []));
await close();
const most = (of) => Math.max(...found.map(of));
const least = Math.min(...found.map((view) => view.drawn));
console.log(`${set.set}: ${found.length} views, at least ${least} pixels; outlines differ by at most ${most((v) => v.outline).toFixed(4)}, ` +
  `colours by ${most((v) => v.color).toFixed(2)} of 255`);
faults.forEach((fault) => console.error(fault));
const isGood = found.length === 24 && least > 1000 && most((v) => v.outline) <= tolerance.outline && most((v) => v.color) <= tolerance.color;
process.exit(isGood && faults.length === 0 ? 0 : 1);
