// Draws the levels of a set's variants in three.js in Chromium, from the views and at the sizes at which the manifest says
// how they agree with the full level, and checks that three.js finds the same.
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/agree.mjs out/avenue [VARIANTS] [CHROMIUM]
//
// Silhouettes are compared as `src/lod/agree.rs` does: orthographic views on a golden spiral from level to 45 degrees,
// samples of a pixel counted, a pixel drawn where half of them are covered, mean of four rasters of pixels. Impostors wear their shader
// (`examples/engines/impostor.js`). At one sample a pixel levels must show what `shown` says; what they show of the level that they
// take over from is told. Exit code 1 when IoU or coverage is off by more than `tolerance`, or nothing was compared.

import { readFile } from "node:fs/promises";
import path from "node:path";
import { open } from "./three.mjs";

// Of the mean IoU, and of the covered area.
const tolerance = 0.02;
// Of the tree's area, what may be seen at the switch at one sample a pixel: levels must not dissolve by their mips. Whole leaf
// cards are smaller than a pixel where thinned levels take over, and a mip of their pictures smaller than a texel.
const shown = { Thinned: [0.5, 1.2], BillboardCloud: [0.8, 1.25], Impostor: [0.7, 1.25] };
// Samples along the tree's height, about: so many that leaves are seen by the finest mips, as the rasterizer sees them.
const lines = 1080;

const [root, most = "2", chromium] = process.argv.slice(2);
if (!root) {
  console.error("usage: node agree.mjs FOLDER [VARIANTS] [CHROMIUM]");
  process.exit(2);
}
const folder = path.resolve(root);
const set = JSON.parse(await readFile(path.join(folder, `${path.basename(folder)}.manifest.json`)));

const { tab, faults, close } = await open(folder, `
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { impostor } from "/engines/impostor.js";
const renderer = new THREE.WebGLRenderer({ antialias: false });
renderer.setClearColor(0x000000, 0);

// The views of a tree that is so many pixels high, and the size of their pictures.
function views(box, pixels, count) {
  const half = box.getSize(new THREE.Vector3()).multiplyScalar(0.5), centre = box.getCenter(new THREE.Vector3());
  const radius = Math.hypot(half.x, half.z), steepest = Math.SQRT1_2;
  const perMetre = pixels / (2 * half.y);
  const width = Math.ceil(2 * radius * 1.1 * perMetre);
  const height = Math.ceil(2 * Math.max(half.y + radius * steepest, half.y) * 1.1 * perMetre);
  const far = 4 * (half.y + radius);
  const cameras = Array.from({ length: count }, (_, i) => {
    const sin = steepest * (i + 0.5) / count, cos = Math.sqrt(1 - sin * sin);
    const azimuth = Math.PI * (3 - Math.sqrt(5)) * (i + 0.27);
    const [w, h] = [width / 2 / perMetre, height / 2 / perMetre];
    const camera = new THREE.OrthographicCamera(-w, w, h, -h, 0, 2 * far);
    const towards = new THREE.Vector3(Math.sin(azimuth) * cos, sin, Math.cos(azimuth) * cos);
    camera.position.copy(centre).addScaledVector(towards, far);
    camera.lookAt(centre);
    camera.updateMatrixWorld();
    return camera;
  });
  return { cameras, width, height };
}

// Covered share of every pixel, view by view, on four rasters of pixels that are half a pixel apart.
function drawn(level, { cameras, width, height }, samples) {
  const target = new THREE.WebGLRenderTarget(width * samples, height * samples);
  const scene = new THREE.Scene();
  scene.add(level);
  const bytes = new Uint8Array(width * samples * height * samples * 4);
  const half = samples / 2;
  const pictures = cameras.flatMap((camera) => {
    renderer.setRenderTarget(target);
    renderer.clear();
    renderer.render(scene, camera);
    renderer.readRenderTargetPixels(target, 0, 0, width * samples, height * samples, bytes);
    return [[0, 0], [half, 0], [0, half], [half, half]].map(([left, below]) => {
      const pixels = new Float64Array((width + 1) * (height + 1));
      for (let y = 0, at = 3; y < height * samples; y++) {
        const row = Math.floor((y + below) / samples) * (width + 1);
        for (let x = 0; x < width * samples; x++, at += 4) {
          if (bytes[at] > 0) pixels[row + Math.floor((x + left) / samples)] += 1 / (samples * samples);
        }
      }
      return pixels;
    });
  });
  target.dispose();
  return pictures;
}

window.compare = async (file, levels, lines) => {
  const gltf = await new GLTFLoader().loadAsync("/files/" + encodeURIComponent(file));
  const names = gltf.parser.json.meshes.map((mesh) => mesh.name);
  const mesh = async (name, kind) => {
    const level = (await gltf.parser.getDependency("mesh", names.indexOf(name))).clone();
    if (kind === "Impostor") return impostor(level);
    level.traverse((o) => {
      if (!o.material) return;
      const { map, alphaTest, side } = o.material;
      o.material = new THREE.MeshBasicMaterial({ map: alphaTest > 0 ? map : null, alphaTest, side });
    });
    return level;
  };
  const full = await mesh(levels[0].mesh);
  const box = new THREE.Box3().setFromObject(full);
  const found = [];
  for (const { mesh: name, kind, pixels, count, before } of levels.slice(1)) {
    const from = views(box, pixels, count);
    const samples = Math.min(40, Math.max(2, 2 * Math.ceil(lines / pixels / 2)));
    const [a, b] = [drawn(full, from, samples), drawn(await mesh(name, kind), from, samples)];
    let [iou, coverage] = [0, 0];
    a.forEach((pixels, view) => {
      let [both, either, area, other] = [0, 0, 0, 0];
      pixels.forEach((covered, i) => {
        const [p, q] = [covered >= 0.5, b[view][i] >= 0.5];
        both += p && q;
        either += p || q;
        area += covered;
        other += b[view][i];
      });
      iou += both / Math.max(either, 1) / a.length;
      coverage += other / area / a.length;
    });
    // What an engine draws at a sample a pixel, where mips are seen.
    const area = (pictures) => pictures.reduce((sum, pixels) => sum + pixels.reduce((s, covered) => s + covered, 0), 0);
    const [shown, last] = [area(drawn(await mesh(name, kind), from, 1)), area(drawn(await mesh(before.mesh, before.kind), from, 1))];
    found.push({ iou, coverage, plain: shown / area(a), jump: shown / last });
  }
  return found;
};`, { edge: 64, chromium });

let compared = 0;
const [worst, range, jumps] = [[0, 0], [Infinity, 0], [Infinity, 0]];
const widen = (range, value) => range.splice(0, 2, Math.min(range[0], value), Math.max(range[1], value));
for (const variant of set.variants.slice(0, Number(most))) {
  const told = variant.levels.filter((level) => level.measured && ["Thinned", "BillboardCloud", "Impostor"].includes(level.kind));
  const before = (level) => variant.levels[variant.levels.indexOf(level) - 1];
  const asked = told.map((level) => ({
    mesh: level.mesh, kind: level.kind, pixels: level.measured.pixels, count: level.measured.views, before: before(level),
  }));
  const found = await tab
    .evaluate(([file, levels, lines]) => window.compare(file, levels, lines), [variant.file, [variant.levels[0], ...asked], lines])
    .catch((error) => faults.push(`${variant.file}: ${error}`));
  if (!Array.isArray(found)) continue;
  found.forEach(({ iou, coverage, plain, jump }, i) => {
    const { mesh, kind, measured } = told[i];
    const [least, most] = shown[kind];
    console.log(`${plain > least && plain < most ? "ok    " : "FAILED"} ${mesh} at ${measured.pixels} pixels, a sample each: ${plain.toFixed(3)} of the tree, ${jump.toFixed(3)} of the level before`);
    if (!(plain > least && plain < most)) faults.push(`${mesh}: at a sample a pixel ${plain.toFixed(3)} of the tree is seen`);
    const off = Math.max(Math.abs(iou - measured.iou_mean), Math.abs(coverage - measured.coverage));
    console.log(`${off <= tolerance ? "ok    " : "FAILED"} ${mesh} at ${measured.pixels} pixels: IoU ${iou.toFixed(4)}, the manifest ` +
      `${measured.iou_mean.toFixed(4)}; coverage ${coverage.toFixed(4)}, the manifest ${measured.coverage.toFixed(4)}`);
    if (!(off <= tolerance)) faults.push(`${mesh}: three.js sees another tree, off by ${off.toFixed(4)}`);
    compared += 1;
    widen(range, plain);
    widen(jumps, jump);
    worst[0] = Math.max(worst[0], Math.abs(iou - measured.iou_mean));
    worst[1] = Math.max(worst[1], Math.abs(coverage - measured.coverage));
  });
}
if (compared === 0) faults.push("no level was compared");
const [seen, jumped] = [range, jumps].map((range) => range.map((share) => share.toFixed(3)).join(" to "));
console.log(`At a sample a pixel levels show ${seen} of the tree, and ${jumped} of the level before`);
console.log(`${compared} levels: IoU off by ${worst[0].toFixed(4)} at most, coverage by ${worst[1].toFixed(4)}`);
await close();
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
