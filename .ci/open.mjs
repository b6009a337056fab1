// Opens every .glb below a folder in three.js in Chromium, and in assimp where that is installed, and checks that they see
// as many vertices and triangles as the file says. Where a variant was written plain and for the web, both are rendered
// and compared.
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/open.mjs out/avenue shots/ [CHROMIUM]
//
// Exit code 1 when counts differ, a page reports an error, or two
// pictures of one variant differ by more than `tolerance`.

import { execFileSync } from "node:child_process";
import { createServer } from "node:http";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";
import { chromium as browsers } from "playwright-core";

// Mean difference of the channels, 0 to 1: quantized normals shade a little differently.
const tolerance = 0.01;

const [root, shots, chromium = "/usr/bin/chromium"] = process.argv.slice(2);
if (!root || !shots) {
  console.error("usage: node open.mjs FOLDER SHOTS [CHROMIUM]");
  process.exit(2);
}
const three = path.join(path.dirname(createRequire(import.meta.url).resolve("three")), "..");
const folder = path.resolve(root);

const page = `<!doctype html><style>body{margin:0}</style>
<script type="importmap">{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(512, 512);
document.body.append(renderer.domElement);
const loader = new GLTFLoader();
loader.setMeshoptDecoder(MeshoptDecoder);
window.open_ = async (file) => {
  const gltf = await loader.loadAsync("/files/" + file.split("/").map(encodeURIComponent).join("/"));
  const counts = [];
  // Lower levels lie outside of the scene where MSFT_lod names them.
  for (const mesh of await gltf.parser.getDependencies("mesh")) {
    mesh.traverse((o) => {
      if (!o.geometry) return;
      counts.push([o.geometry.attributes.position.count, o.geometry.index.count / 3]);
    });
  }
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xc8d2dc);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x667755, 2.5));
  const sun = new THREE.DirectionalLight(0xfff4e0, 2);
  sun.position.set(3, 6, 5);
  scene.add(sun, gltf.scene);
  const box = new THREE.Box3().setFromObject(gltf.scene);
  const size = box.getSize(new THREE.Vector3()), middle = box.getCenter(new THREE.Vector3());
  const camera = new THREE.PerspectiveCamera(35, 1, 0.1, 1000);
  camera.position.set(middle.x, middle.y, middle.z + Math.max(size.x, size.y) * 2.0);
  camera.lookAt(middle);
  renderer.render(scene, camera);
  gltf.scene.traverse((o) => o.geometry?.dispose());
  return { counts, size: size.toArray() };
};
window.ready = true;
</script>`;

const types = { ".js": "text/javascript", ".glb": "model/gltf-binary", ".png": "image/png" };
const server = createServer(async (request, response) => {
  const url = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  if (url === "/") return response.writeHead(200, { "content-type": "text/html" }).end(page);
  if (url === "/favicon.ico") return response.writeHead(204).end();
  const base = url.startsWith("/three/") ? three : url.startsWith("/files/") ? folder : null;
  const file = base && path.join(base, path.normalize(url.replace(/^\/\w+\//, "/")));
  try {
    if (!file?.startsWith(base)) throw new Error();
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
await tab.setViewportSize({ width: 512, height: 512 });
await tab.goto(`http://127.0.0.1:${server.address().port}/`);
await tab.waitForFunction("window.ready", undefined, { timeout: 120000 }).catch((error) => faults.push(String(error)));
await mkdir(shots, { recursive: true });

// What the file itself says, primitive by primitive.
function stated(bytes) {
  const length = bytes.readUInt32LE(12);
  const root = JSON.parse(bytes.subarray(20, 20 + length).toString());
  const count = (accessor) => root.accessors[accessor].count;
  return (root.meshes ?? []).flatMap((m) => m.primitives.map((p) => [count(p.attributes.POSITION), count(p.indices) / 3]));
}

const sum = (counts) => counts.reduce(([a, b], [c, d]) => [a + c, b + d], [0, 0]);
let assimp = true;
// assimp shows what is in the scene, and splits nothing that it need not; it can not read packed files.
function byAssimp(file) {
  if (!assimp || file.endsWith(".web.glb")) return null;
  try {
    const text = execFileSync("assimp", ["info", file], { stdio: ["ignore", "pipe", "ignore"] }).toString();
    return [Number(/Vertices:\s+(\d+)/.exec(text)[1]), Number(/Faces:\s+(\d+)/.exec(text)[1])];
  } catch (error) {
    if (error.code === "ENOENT") assimp = false;
    else faults.push(`${file}: assimp: ${error.message.split("\n")[0]}`);
    return null;
  }
}

const files = (await readdir(folder, { recursive: true })).filter((f) => f.endsWith(".glb")).sort();
const pictures = new Map();
for (const file of files) {
  const bytes = await readFile(path.join(folder, file));
  const said = stated(bytes);
  const seen = await tab.evaluate((name) => window.open_(name), file).catch((error) => faults.push(`${file}: ${error}`));
  if (!seen?.counts) continue;
  const same = JSON.stringify(sum(seen.counts)) === JSON.stringify(sum(said));
  if (!same) faults.push(`${file}: three.js sees ${sum(seen.counts)}, the file says ${sum(said)}`);
  const other = byAssimp(path.join(folder, file));
  const [vertices, triangles] = sum(said);
  console.log(`${same ? "ok    " : "FAILED"} ${file}: ${vertices} vertices, ${triangles} triangles; ` +
    `three.js the same${other ? `; assimp ${other[0]} vertices, ${other[1]} triangles` : ""}`);
  if (other && (other[0] > vertices || other[1] > triangles)) faults.push(`${file}: assimp sees more than there is`);
  await writeFile(path.join(shots, `${path.basename(file, ".glb")}.png`), await tab.screenshot());
  const pixels = await tab.evaluate(() => {
    const source = document.querySelector("canvas");
    const canvas = Object.assign(document.createElement("canvas"), { width: 512, height: 512 });
    const context = canvas.getContext("2d");
    context.drawImage(source, 0, 0);
    return Array.from(context.getImageData(0, 0, 512, 512).data);
  });
  pictures.set(file, pixels);
}
for (const [file, pixels] of pictures) {
  if (!file.endsWith(".web.glb")) continue;
  const plain = pictures.get(file.replace(".web.glb", ".glb"));
  if (!plain) continue;
  const off = pixels.reduce((total, v, i) => total + Math.abs(v - plain[i]), 0) / pixels.length / 255;
  console.log(`${file} and its plain file differ by ${off.toFixed(5)}`);
  if (!(off < tolerance)) faults.push(`${file}: differs from its plain file by ${off}`);
}
if (!assimp) console.log("assimp is not installed: not asked");
if (files.length === 0) faults.push("no .glb file found");
await browser.close();
server.close();
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
