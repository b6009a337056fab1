// Opens every .glb below a folder in three.js in Chromium, and in assimp where that is installed, and checks that they see
// as many vertices and triangles as the file says. Where a variant was written plain and for the web or Unity, all are
// rendered and compared, so WebP and KTX2 textures (by Basis' own transcoder, from three.js' package) look like PNG: close
// by, and small, where mips are seen. Every one of their textures must have been loaded, KTX2 as compressed ones with mips.
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/open.mjs out/avenue shots/ [CHROMIUM]
//
// Exit code 1 when counts differ, a page reports an error, or two
// pictures of one variant differ by more than `tolerance`.

import { execFileSync } from "node:child_process";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import path from "node:path";
import { open } from "./three.mjs";

// Mean difference of the channels over the tree, 0 to 1: quantized normals shade a little differently, and blocks round.
const tolerance = 0.03;
// How many times as far the second picture of a file is taken, and the share of the tree's area that must be seen there: the
// full level at 90 pixels.
const away = 5;
const left = [0.65, 1.15];

const [root, shots, chromium] = process.argv.slice(2);
if (!root || !shots) {
  console.error("usage: node open.mjs FOLDER SHOTS [CHROMIUM]");
  process.exit(2);
}
const folder = path.resolve(root);

const { tab, faults, close } = await open(folder, `
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { KTX2Loader } from "three/addons/loaders/KTX2Loader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(512, 512);
document.body.append(renderer.domElement);
const loader = new GLTFLoader();
loader.setMeshoptDecoder(MeshoptDecoder);
loader.setKTX2Loader(new KTX2Loader().setTranscoderPath("/three/examples/jsm/libs/basis/").detectSupport(renderer));
window.open_ = async (file, far) => {
  const gltf = await loader.loadAsync("/files/" + file.split("/").map(encodeURIComponent).join("/"));
  const counts = [];
  // Lower levels lie outside of the scene where MSFT_lod names them.
  for (const mesh of await gltf.parser.getDependencies("mesh")) {
    mesh.traverse((o) => {
      if (!o.geometry) return;
      counts.push([o.geometry.attributes.position.count, o.geometry.index.count / 3]);
    });
  }
  const textures = (await gltf.parser.getDependencies("texture")).map((t) => ({
    type: t.type, name: t.source?.data?.src ?? "", width: t.image.width, height: t.image.height,
    compressed: Boolean(t.isCompressedTexture), format: t.format, mips: t.mipmaps?.length ?? 0, colorSpace: t.colorSpace,
  }));
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xc8d2dc);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x667755, 2.5));
  const sun = new THREE.DirectionalLight(0xfff4e0, 2);
  sun.position.set(3, 6, 5);
  scene.add(sun, gltf.scene);
  const box = new THREE.Box3().setFromObject(gltf.scene);
  const size = box.getSize(new THREE.Vector3()), middle = box.getCenter(new THREE.Vector3());
  const camera = new THREE.PerspectiveCamera(35, 1, 0.1, 1000);
  camera.position.set(middle.x, middle.y, middle.z + Math.max(size.x, size.y) * 2.0 * far);
  camera.lookAt(middle);
  renderer.render(scene, camera);
  gltf.scene.traverse((o) => o.geometry?.dispose());
  return { counts, size: size.toArray(), textures };
};
`, { edge: 512, chromium });
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
const withMips = new Set();
for (const file of files) {
  const bytes = await readFile(path.join(folder, file));
  const said = stated(bytes);
  const seen = await tab.evaluate((name) => window.open_(name, 1), file).catch((error) => faults.push(`${file}: ${error}`));
  if (!seen?.counts) continue;
  const same = JSON.stringify(sum(seen.counts)) === JSON.stringify(sum(said));
  if (!same) faults.push(`${file}: three.js sees ${sum(seen.counts)}, the file says ${sum(said)}`);
  const other = byAssimp(path.join(folder, file));
  const [vertices, triangles] = sum(said);
  console.log(`${same ? "ok    " : "FAILED"} ${file}: ${vertices} vertices, ${triangles} triangles; ` +
    `three.js the same${other ? `; assimp ${other[0]} vertices, ${other[1]} triangles` : ""}`);
  if (other && (other[0] > vertices || other[1] > triangles)) faults.push(`${file}: assimp sees more than there is`);
  texturesOf(file, bytes, seen.textures);
  const base = path.join(shots, path.basename(file, ".glb"));
  const views = [await picture(`${base}.png`)];
  // Far away only what is compared: a file for the web, and the plain one that it is compared with.
  if (file.endsWith(".web.glb") || files.includes(file.replace(/\.glb$/, ".web.glb"))) {
    await tab.evaluate(([name, far]) => window.open_(name, far).then(() => null), [file, away]);
    views.push(await picture(`${base}_far.png`));
  }
  pictures.set(file, views);
}

// What the page shows, kept as a file and as numbers.
async function picture(file) {
  await writeFile(file, await tab.screenshot());
  return tab.evaluate(() => {
    const source = document.querySelector("canvas");
    const canvas = Object.assign(document.createElement("canvas"), { width: 512, height: 512 });
    const context = canvas.getContext("2d");
    context.drawImage(source, 0, 0);
    return Array.from(context.getImageData(0, 0, 512, 512).data);
  });
}

// Every texture that the file names must be there, and KTX2 must reach the graphics card compressed and with its mips.
function texturesOf(file, bytes, textures) {
  const root = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
  const packed = (root.extensionsRequired ?? []).includes("KHR_texture_basisu");
  if (textures.length !== (root.textures ?? []).length) faults.push(`${file}: ${textures.length} textures were loaded`);
  for (const t of textures) {
    const fine = t.width > 0 && (!packed || (t.mips === Math.floor(Math.log2(Math.max(t.width, t.height))) + 1));
    if (!fine || (packed && !t.compressed)) faults.push(`${file}: a texture is not what it was: ${JSON.stringify(t)}`);
  }
  if (packed) withMips.add(file);
  if (packed) console.log(`       KTX2 reached the card as ${[...new Set(textures.map((t) => t.format))].join(", ")}`);
}

// Mean difference of the channels where one of two pictures shows the tree.
function difference(a, b) {
  let [sum, count] = [0, 0];
  for (let i = 0; i < a.length; i += 4) {
    const shows = (p) => [0, 1, 2].some((c) => p[i + c] !== p[c]);
    if (!shows(a) && !shows(b)) continue;
    for (let c = 0; c < 3; c++) sum += Math.abs(a[i + c] - b[i + c]);
    count += 3;
  }
  return sum / Math.max(count, 1) / 255;
}

// How much of the tree's area is left far away: what differs from the sky, by how much.
function kept([near, far]) {
  const shown = (p) => {
    let sum = 0;
    for (let i = 0; i < p.length; i++) sum += Math.abs(p[i] - p[i % 4]);
    return sum;
  };
  return (shown(far) * away * away) / shown(near);
}

for (const [file, views] of pictures) {
  if (!file.endsWith(".web.glb")) continue;
  const plain = pictures.get(file.replace(".web.glb", ".glb"));
  if (!plain) continue;
  // Far away mips are seen, and those of KTX2 are others on purpose.
  const same = withMips.has(file) ? 1 : 2;
  const off = views.slice(0, same).map((view, i) => difference(view, plain[i]));
  console.log(`${file} and its plain file differ by ${off.map((d) => d.toFixed(5)).join(", far by ")}; ${away} times as far ` +
    `${(kept(views) * 100).toFixed(1)} % of the tree is left, of the plain file ${(kept(plain) * 100).toFixed(1)} %`);
  for (const d of off) if (!(d < tolerance)) faults.push(`${file}: differs from its plain file by ${d}`);
  if (!(kept(views) > left[0] && kept(views) < left[1])) {
    faults.push(`${file}: ${kept(views)} of the tree is left far away`);
  }
}
if (!assimp) console.log("assimp is not installed: not asked");
if (files.length === 0) faults.push("no .glb file found");
await close();
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
