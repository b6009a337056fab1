// Plays a clip in three.js in Chromium and takes a screenshot at three times.
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/play.mjs out/morph/morph_clip_001.glb shots/ [CHROMIUM]
//
// Exit code 1 when the page reports an error, when no animation is found,
// or when two of the screenshots are the same.

import { mkdir, writeFile } from "node:fs/promises";
import path from "node:path";
import { open } from "./three.mjs";

const [clip, shots, chromium] = process.argv.slice(2);
if (!clip || !shots) {
  console.error("usage: node play.mjs CLIP.glb FOLDER [CHROMIUM]");
  process.exit(2);
}
const folder = path.dirname(path.resolve(clip));

const { tab, faults, close } = await open(folder, `
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(720, 720);
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0xc8d2dc);
scene.add(new THREE.HemisphereLight(0xffffff, 0x667755, 2.5));
const sun = new THREE.DirectionalLight(0xfff4e0, 2);
sun.position.set(3, 6, 5);
scene.add(sun);
const gltf = await new GLTFLoader().loadAsync("/files/${encodeURIComponent(path.basename(clip))}");
scene.add(gltf.scene);
const mixer = new THREE.AnimationMixer(gltf.scene);
const animation = gltf.animations[0];
mixer.clipAction(animation).play();
const box = new THREE.Box3();
gltf.scene.traverse((o) => o.geometry && box.union(new THREE.Box3().setFromBufferAttribute(o.geometry.attributes.position)));
const size = box.getSize(new THREE.Vector3()), middle = box.getCenter(new THREE.Vector3());
const camera = new THREE.PerspectiveCamera(35, 1, 0.1, 1000);
camera.position.set(middle.x, middle.y, middle.z + Math.max(size.x, size.y) * 2.0);
camera.lookAt(middle);
window.animations = gltf.animations.length;
window.seconds = animation.duration;
window.at = (time) => {
  mixer.setTime(time);
  renderer.render(scene, camera);
};
`, { edge: 720, chromium, patience: 240000 });
await mkdir(shots, { recursive: true });
const taken = [];
if (faults.length === 0) {
  const seconds = await tab.evaluate("window.seconds");
  for (const share of [0.02, 0.5, 0.98]) {
    await tab.evaluate(`window.at(${seconds * share})`);
    const bytes = await tab.screenshot();
    await writeFile(path.join(shots, `${path.basename(clip, ".glb")}_${Math.round(share * 100)}.png`), bytes);
    taken.push(Buffer.from(bytes).toString("base64"));
  }
  console.log(`${await tab.evaluate("window.animations")} animations, ${seconds} s, ${new Set(taken).size} different pictures`);
}
await close();
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 || new Set(taken).size < 3 ? 1 : 0);
