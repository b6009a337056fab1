// Plays a clip in three.js in Chromium and takes a screenshot at three times.
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/play.mjs out/morph/morph_clip_001.glb shots/ [CHROMIUM]
//
// Exit code 1 when the page reports an error, when no animation is found,
// or when two of the screenshots are the same.

import { createServer } from "node:http";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";
import { chromium as browsers } from "playwright-core";

const [clip, shots, chromium = "/usr/bin/chromium"] = process.argv.slice(2);
if (!clip || !shots) {
  console.error("usage: node play.mjs CLIP.glb FOLDER [CHROMIUM]");
  process.exit(2);
}
const three = path.join(path.dirname(createRequire(import.meta.url).resolve("three")), "..");
const folder = path.dirname(path.resolve(clip));

const page = `<!doctype html><style>body{margin:0}</style>
<script type="importmap">{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module">
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
window.ready = true;
</script>`;

const types = { ".js": "text/javascript", ".glb": "model/gltf-binary", ".png": "image/png" };
const server = createServer(async (request, response) => {
  const url = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  if (url === "/") return response.writeHead(200, { "content-type": "text/html" }).end(page);
  if (url === "/favicon.ico") return response.writeHead(204).end();
  const root = url.startsWith("/three/") ? three : url.startsWith("/files/") ? folder : null;
  const file = root && path.join(root, path.normalize(url.replace(/^\/\w+\//, "/")));
  try {
    if (!file?.startsWith(root)) throw new Error();
    const bytes = await readFile(file);
    response.writeHead(200, { "content-type": types[path.extname(file)] ?? "application/octet-stream" }).end(bytes);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const browser = await browsers.launch({
  executablePath: chromium,
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const tab = await browser.newPage();
const faults = [];
tab.on("pageerror", (error) => faults.push(String(error)));
tab.on("console", (message) => message.type() === "error" && faults.push(message.text()));
await tab.setViewportSize({ width: 720, height: 720 });
await tab.goto(`http://127.0.0.1:${server.address().port}/`);
await tab.waitForFunction("window.ready", undefined, { timeout: 240000 }).catch((error) => faults.push(String(error)));
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
await browser.close();
server.close();
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 || new Set(taken).size < 3 ? 1 : 0);
