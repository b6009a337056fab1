// Runs the snippets of examples/engines/threejs.md in Chromium, as they stand there, on a set that is built for them:
//
//     node .ci/snippets.mjs target/release/treewright
//
// Ends with 1 when one fails, or when the levels are not those of the manifest.

import { execFileSync } from "node:child_process";
import { cpSync, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, extname, join, normalize, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium as browsers } from "playwright-core";

const root = resolve(dirname(fileURLToPath(import.meta.url)), "..");
const program = resolve(process.argv[2] ?? join(root, "target/release/treewright"));
const executablePath = process.env.CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
const three = join(dirname(createRequire(import.meta.url).resolve("three")), "..");

const text = readFileSync(join(root, "examples/engines/threejs.md"), "utf8");
const blocks = [...text.matchAll(/```js\n([\s\S]*?)```/g)].map(match => match[1]);
if (blocks.length < 2) throw new Error("threejs.md has lost its snippets");

const scratch = mkdtempSync(join(tmpdir(), "treewright-snippets-"));
cpSync(join(root, "presets/species"), join(scratch, "species"), { recursive: true });
writeFileSync(join(scratch, "avenue.ron"), `(
    sources: {"oak": Grow(species: "species/oak.ron", seed: 1, height: 9.0)},
    variants: [Source("oak")],
    lods: [Full, Thinned(triangles: 0.4), BillboardCloud(cards: 24), Impostor],
    foliage: (density: 0.4),
    atlas: (size: 1024),
    engines: [Generic, Web],
)`);
execFileSync(program, ["build", "avenue.ron", "--out", "out"], { cwd: scratch, stdio: "ignore" });

// Imports must stand before all else in a module; what a reader of the page has is made between.
const [imports, rest] = [[], []];
for (const line of blocks.join("\n").split("\n")) (line.startsWith("import ") ? imports : rest).push(line);
const page = `<!doctype html><link rel="icon" href="data:,">
<script type="importmap">{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module">
${imports.join("\n")}
const scene = new THREE.Scene();
${rest.join("\n")}
const camera = new THREE.PerspectiveCamera(60, 1, 0.1, 10000);
const renderer = new THREE.WebGLRenderer();
scene.add(new THREE.HemisphereLight());
const seen = lod.levels.map((level, i) => {
    const far = lod.levels[i + 1]?.distance ?? level.distance + 50;
    camera.position.set(0, 2, (level.distance + far) / 2);
    camera.updateMatrixWorld();
    lod.update(camera);
    renderer.render(scene, camera);
    const shown = lod.levels.findIndex(other => other.object.visible);
    return [shown, renderer.info.render.triangles];
});
// Against the sun, with what comes through the leaves and without it.
const far = lod.levels.map(level => level.distance);
scene.children.filter(child => child.isLight).forEach(light => scene.remove(light));
const sun = new THREE.DirectionalLight(0xffffff, 5);
sun.position.set(0, 4, -100);
scene.add(sun);
const gl = renderer.getContext();
const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
const green = distance => {
    camera.position.set(0, 4, distance);
    // As large in the picture from everywhere.
    camera.fov = 2 * Math.atan(6 / distance) * 180 / Math.PI;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    lod.update(camera);
    renderer.render(scene, camera);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels.reduce((sum, value, i) => sum + (i % 4 === 1 ? value : 0), 0);
};
const near = far.map((distance, i) => Math.max(12, i + 1 < far.length ? (distance + far[i + 1]) / 2 : distance + 10));
const lit = near.map(green);
leaves.forEach(material => {
    const { onBeforeCompile } = material;
    material.onBeforeCompile = (shader, renderer) => {
        onBeforeCompile(shader, renderer);
        shader.fragmentShader = shader.fragmentShader.replace(/\\bthrough = [^;]+;/, 'through = 0.0;');
    };
    material.customProgramCacheKey = () => 'opaque ' + material.id;
    material.needsUpdate = true;
});
const unlit = near.map(green);
window.seen = { seen, levels: levels.length, lit, unlit };
</script>`;
const types = { ".js": "text/javascript", ".glb": "model/gltf-binary", ".png": "image/png", ".json": "application/json" };
const server = createServer((request, response) => {
  const url = normalize(decodeURIComponent(new URL(request.url, "http://localhost").pathname));
  if (url === "/") return response.writeHead(200, { "content-type": "text/html" }).end(page);
  const beside = url === "/impostor.js" && join(root, "examples/engines", url);
  const file = beside || (url.startsWith("/three/") ? join(three, url.slice(7)) : join(scratch, "out", url));
  if (!existsSync(file)) return response.writeHead(404).end();
  response.writeHead(200, { "content-type": types[extname(file)] ?? "application/octet-stream" }).end(readFileSync(file));
});
await new Promise(done => server.listen(0, "127.0.0.1", done));
const browser = await browsers.launch({
  executablePath,
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const tab = await browser.newPage();
const faults = [];
tab.on("pageerror", error => faults.push(String(error)));
tab.on("console", message => message.type() === "error" && faults.push(message.text()));
await tab.goto(`http://127.0.0.1:${server.address().port}/`);
const seen = await tab.waitForFunction(() => window.seen, undefined, { timeout: 120000 }).then(handle => handle.jsonValue(), error => { faults.push(String(error)); });
if (seen) {
  console.log(`threejs.md: ${seen.levels} levels; shown and triangles at the middle of each: ${JSON.stringify(seen.seen)}`);
  console.log(`threejs.md: green against the sun, by level: ${seen.lit}, without what comes through leaves ${seen.unlit}`);
  if (!seen.lit.every((sum, i) => sum > 1.3 * seen.unlit[i])) faults.push("leaves are no brighter against the sun");
  const inOrder = seen.seen.every(([shown], i) => shown === i) && seen.seen.length === seen.levels;
  const fewer = seen.seen.every(([, count], i) => count > 0 && (i === 0 || count < seen.seen[i - 1][1]));
  if (!inOrder || !fewer) faults.push("the levels are not shown in their order, each with fewer triangles");
}
await browser.close();
server.close();
rmSync(scratch, { recursive: true, force: true });
faults.forEach(fault => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
