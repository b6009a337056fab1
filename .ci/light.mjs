// Lights the levels of a set's first variant in three.js in Chromium: by a sun in front, beside, behind and above, and by the
// sky alone, seen from eight sides each, and compares how bright they are with the full level. Impostors wear their shader
// (`examples/engines/impostor.js`); nothing comes through leaves there.
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/light.mjs out/avenue [CHROMIUM]
//
// Exit code 1 when a level is not within `within` of it.

import { readFile } from "node:fs/promises";
import path from "node:path";
import { open } from "./three.mjs";

// Of the luminance of the full level. Mixed normals all look to the viewer: of a sun behind the tree they show less.
const within = { front: [0.85, 1.12], side: [0.85, 1.12], above: [0.8, 1.15], sky: [0.82, 1.15], behind: [0.55, 1.25] };
// A crown that is two planes has a normal for each place, and no depth. (As planes with the cards' own normals: 1.6 to 2 from the front, and
// nothing from behind.)
const ofQuads = { front: [0.7, 1.45], side: [0.7, 1.5], above: [0.6, 1.85], sky: [0.75, 1.4], behind: [0.6, 1.9] };

const [root, chromium] = process.argv.slice(2);
if (!root) {
  console.error("usage: node light.mjs FOLDER [CHROMIUM]");
  process.exit(2);
}
const folder = path.resolve(root);
const set = JSON.parse(await readFile(path.join(folder, `${path.basename(folder)}.manifest.json`)));

const { tab, faults, close } = await open(folder, `
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { impostor } from "/engines/impostor.js";
const renderer = new THREE.WebGLRenderer({ antialias: false, alpha: true });
renderer.setClearColor(0x000000, 0);
const edge = 200, sides = 8;
// Where the sun stands, from the viewer's azimuth; and how bright it and the sky are.
const lights = {
  front: { turn: 0.6, high: 0.8, sun: 3, sky: 0 },
  side: { turn: 1.7, high: 0.5, sun: 3, sky: 0 },
  behind: { turn: 2.8, high: 0.6, sun: 3, sky: 0 },
  above: { turn: 0, high: 14, sun: 3, sky: 0 },
  sky: { turn: 0, high: 1, sun: 0, sky: 2 },
};

// Mean luminance of what a level covers, by light.
window.lit = async (file, levels) => {
  const gltf = await new GLTFLoader().loadAsync("/files/" + encodeURIComponent(file));
  const names = gltf.parser.json.meshes.map((mesh) => mesh.name);
  const target = new THREE.WebGLRenderTarget(edge, edge, { type: THREE.FloatType });
  const pixels = new Float32Array(edge * edge * 4);
  let box;
  const found = [];
  for (const { mesh, kind } of levels) {
    const plain = (await gltf.parser.getDependency("mesh", names.indexOf(mesh))).clone();
    const level = kind === "Impostor" ? impostor(plain) : plain;
    box ??= new THREE.Box3().setFromObject(level);
    const centre = box.getCenter(new THREE.Vector3()), radius = box.getSize(new THREE.Vector3()).length() / 2;
    const by = {};
    for (const [name, { turn, high, sun, sky }] of Object.entries(lights)) {
      let [sum, count] = [0, 0];
      for (let side = 0; side < sides; side++) {
        const azimuth = (side / sides) * 2 * Math.PI + 0.2;
        const scene = new THREE.Scene();
        const light = new THREE.DirectionalLight(0xffffff, sun);
        light.position.set(Math.sin(azimuth + turn), high, Math.cos(azimuth + turn));
        scene.add(level, light, new THREE.HemisphereLight(0xffffff, 0x808080, sky));
        const camera = new THREE.OrthographicCamera(-radius, radius, radius, -radius, 0, 8 * radius);
        camera.position.set(Math.sin(azimuth), 0.15, Math.cos(azimuth)).multiplyScalar(4 * radius).add(centre);
        camera.lookAt(centre);
        renderer.setRenderTarget(target);
        renderer.clear();
        renderer.render(scene, camera);
        renderer.readRenderTargetPixels(target, 0, 0, edge, edge, pixels);
        for (let i = 0; i < pixels.length; i += 4) {
          if (pixels[i + 3] === 0) continue;
          sum += 0.2126 * pixels[i] + 0.7152 * pixels[i + 1] + 0.0722 * pixels[i + 2];
          count += 1;
        }
      }
      by[name] = sum / Math.max(count, 1);
    }
    found.push(by);
  }
  return found;
};`, { edge: 64, chromium });

const { file, levels } = set.variants[0];
const asked = levels.map(({ mesh, kind }) => ({ mesh, kind }));
const found = await tab
  .evaluate(([file, levels]) => window.lit(file, levels), [file, asked])
  .catch((error) => faults.push(`${file}: ${error}`));
if (Array.isArray(found)) {
  if (found.length < 2) faults.push("no level was lit");
  found.slice(1).forEach((by, i) => {
    for (const [name, [least, most]] of Object.entries(asked[i + 1].kind === "CrossedQuads" ? ofQuads : within)) {
      const share = by[name] / found[0][name];
      const good = share >= least && share <= most;
      console.log(`${good ? "ok    " : "FAILED"} ${asked[i + 1].mesh} lit from ${name}: ${share.toFixed(3)} of the full level`);
      if (!good) faults.push(`${asked[i + 1].mesh}: lit from ${name} it is ${share.toFixed(3)} as bright as the full level`);
    }
  });
}
await close();
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
