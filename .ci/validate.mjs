// Runs the Khronos glTF validator over every .glb below the folders given, with the pictures they name.
//
//     npm install --prefix .ci --no-package-lock && node .ci/validate.mjs out/ ...
//
// KTX2 it can't read; those pictures are read here, by ktx-parse (of three.js' package). Of PNG it reads the head only; all
// PNG below the folders are unpacked here to their last byte and checksum.
//
// Prints one line a file and what the validator says about it. Exit code 1 when there is an error or a warning, an info
// that isn't in `allowed`, a PNG that is not whole, or a folder with no .glb; 2 on wrong usage.

import { readFile, readdir } from "node:fs/promises";
import path from "node:path";
import { crc32, inflateSync } from "node:zlib";
import validator from "gltf-validator";
import { read as readKtx2 } from "three/addons/libs/ktx-parse.module.js";

// Infos that we accept, each with its reason. Everything else counts as a failure. The list stands in
// examples/engines/README.md too.
const allowed = [
  // Textures are files of their own because all variants of a set share them.
  { code: "URI_GLB", pointer: /^\/images\/\d+\/uri$/ },
  // Levels of detail are MSFT_lod, a vendor extension that the validator doesn't know; it is never required.
  { code: "UNSUPPORTED_EXTENSION", about: "MSFT_lod" },
  // What leaves let through, told to whoever reads it; the validator doesn't know it yet, and it is never required.
  { code: "UNSUPPORTED_EXTENSION", about: "KHR_materials_diffuse_transmission" },
  // A consequence of MSFT_lod: the lower levels' nodes are named by MSFT_lod only, so the validator takes them to be
  // unused. Their meshes, materials and accessors are not exempted.
  { code: "UNUSED_OBJECT", pointer: /^\/nodes\/\d+$/ },
  // The second UV set is for light maps, which are baked in the engine, further ones hold the wind for shaders: no texture
  // of the file uses them.
  { code: "UNUSED_OBJECT", pointer: /\/attributes\/TEXCOORD_[1-5]$/ },
  // The web profile is packed by meshoptimizer; the validator doesn't know the extension, so it takes the buffer that holds
  // the packed bytes to be unused.
  { code: "UNSUPPORTED_EXTENSION", about: "EXT_meshopt_compression" },
  { code: "UNUSED_OBJECT", pointer: /^\/buffers\/0$/ },
  // KTX2 textures; the validator doesn't know the extension, so it takes the pictures to be unused.
  { code: "UNSUPPORTED_EXTENSION", about: "KHR_texture_basisu" },
  { code: "UNUSED_OBJECT", pointer: /^\/images\/\d+$/, ktx2: true },
  // The one warning: it says that the validator can't read KTX2. What it would check is checked by `ktx2Faults`.
  { code: "IMAGE_UNRECOGNIZED_FORMAT", pointer: /^\/images\/\d+$/, ktx2: true, severity: 1 },
];

const severities = ["error", "warning", "info", "hint"];

function isAllowed(issue, images) {
  const image = images[Number(/^\/images\/(\d+)$/.exec(issue.pointer ?? "")?.[1])];
  return (
    allowed.some(
      (a) =>
        a.code === issue.code &&
        issue.severity >= (a.severity ?? 2) &&
        (!a.ktx2 || image?.uri?.endsWith(".ktx2")) &&
        (!a.about || issue.message.includes(a.about)) &&
        (!a.pointer || a.pointer.test(issue.pointer ?? "")),
    )
  );
}

async function files(folder, ending) {
  const entries = await readdir(folder, { recursive: true, withFileTypes: true });
  return entries
    .filter((e) => e.isFile() && e.name.toLowerCase().endsWith(ending))
    .map((e) => path.join(e.parentPath ?? e.path, e.name))
    .sort();
}

// Why a PNG is not whole; nothing when it is.
function pngFault(bytes) {
  const data = [];
  let head;
  for (let at = 8; at < bytes.length; ) {
    const length = bytes.readUInt32BE(at);
    const chunk = bytes.subarray(at + 4, at + 8 + length);
    if (chunk.length !== 4 + length || crc32(chunk) !== bytes.readUInt32BE(at + 8 + length)) return `a chunk at ${at} is broken`;
    const name = chunk.toString("latin1", 0, 4);
    if (name === "IHDR") head = { width: chunk.readUInt32BE(4), height: chunk.readUInt32BE(8), channels: [1, 0, 3, 1, 2, 0, 4][chunk[13]] };
    if (name === "IDAT") data.push(chunk.subarray(4));
    at += 12 + length;
  }
  try {
    const unpacked = inflateSync(Buffer.concat(data)).length;
    const wanted = (head.width * head.channels + 1) * head.height;
    return unpacked === wanted ? undefined : `${unpacked} bytes unpacked, ${wanted} expected`;
  } catch (error) {
    return error.message;
  }
}

// What KHR_texture_basisu asks of a file's KTX2 pictures, and what we promise of them.
async function ktx2Faults(root, folder) {
  const faults = [];
  const source = (texture) => root.textures[texture.index].extensions?.KHR_texture_basisu?.source ?? root.textures[texture.index].source;
  const uses = new Map();
  for (const m of root.materials ?? []) {
    const pbr = m.pbrMetallicRoughness ?? {};
    for (const [texture, srgb] of [[pbr.baseColorTexture, true], [m.emissiveTexture, true],
      [pbr.metallicRoughnessTexture, false], [m.normalTexture, false], [m.occlusionTexture, false]]) {
      if (texture) uses.set(source(texture), { srgb, alpha: srgb && m.alphaMode === "MASK" });
    }
  }
  for (const [i, image] of (root.images ?? []).entries()) {
    if (!image.uri?.endsWith(".ktx2")) continue;
    const wrong = (what) => faults.push({ severity: 0, code: "KTX2", pointer: `/images/${i}`, message: `${image.uri}: ${what}` });
    try {
      const ktx = readKtx2(new Uint8Array(await readFile(path.join(folder, decodeURIComponent(image.uri)))));
      const [dfd] = ktx.dataFormatDescriptor;
      const use = uses.get(i);
      if (!use) wrong("no material uses it");
      if (ktx.vkFormat !== 0 || dfd.colorModel !== 166) wrong("is not Basis UASTC");
      if (dfd.colorPrimaries !== 1 || dfd.transferFunction !== (use?.srgb ? 2 : 1)) wrong("has the wrong transfer function");
      if (dfd.samples[0].channelType !== (use?.alpha ? 3 : 0)) wrong("has the wrong channels");
      if (dfd.flags !== 0) wrong("alpha is premultiplied");
      if (ktx.pixelWidth % 4 || ktx.pixelHeight % 4 || ktx.pixelDepth || ktx.layerCount || ktx.faceCount !== 1) wrong("has the wrong shape");
      if (ktx.levels.length !== Math.floor(Math.log2(Math.max(ktx.pixelWidth, ktx.pixelHeight))) + 1) wrong("lacks mips");
      if (![0, 2].includes(ktx.supercompressionScheme)) wrong("is packed in another way than by zstd");
      const orientation = ktx.keyValue.KTXorientation;
      if (orientation !== undefined && !/^rd\0?$/.test(String(orientation))) wrong("does not start above");
      ktx.levels.forEach((level, k) => {
        const blocks = [ktx.pixelWidth, ktx.pixelHeight].map((side) => Math.ceil(Math.max(1, side >> k) / 4));
        if (level.uncompressedByteLength !== blocks[0] * blocks[1] * 16) wrong(`level ${k} has the wrong size`);
      });
    } catch (error) {
      wrong(error.message);
    }
  }
  return faults;
}

async function validate(file) {
  const folder = path.dirname(file);
  const bytes = await readFile(file);
  const root = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
  const report = await validator.validateBytes(new Uint8Array(bytes), {
    uri: path.basename(file),
    format: "glb",
    maxIssues: 1000,
    writeTimestamp: false,
    // URIs come as in the file: percent-encoded, relative to it.
    externalResourceFunction: async (uri) => new Uint8Array(await readFile(path.join(folder, decodeURIComponent(uri)))),
  });
  return { info: report.info, issues: report.issues, images: root.images ?? [], faults: await ktx2Faults(root, folder) };
}

const folders = process.argv.slice(2);
if (folders.length === 0) {
  console.error("usage: node validate.mjs FOLDER ...");
  process.exit(2);
}

let checked = 0;
let failed = 0;
for (const folder of folders) {
  for (const file of await files(folder, ".png")) {
    checked += 1;
    const fault = pngFault(await readFile(file));
    if (!fault) continue;
    failed += 1;
    console.log(`FAILED ${file}: ${fault}`);
  }
  const models = await files(folder, ".glb");
  if (models.length === 0) {
    failed += 1;
    console.log(`FAILED ${folder}: no .glb file found`);
  }
  for (const file of models) {
    checked += 1;
    const { info, issues, images, faults } = await validate(file);
    const counted = [...faults, ...issues.messages.filter((m) => !isAllowed(m, images))];
    const bad = counted.length > 0 || issues.truncated;
    failed += bad ? 1 : 0;
    const { numErrors: e, numWarnings: w, numInfos: i, numHints: h } = issues;
    const size = `${info?.totalVertexCount ?? 0} vertices, ${info?.totalTriangleCount ?? 0} triangles`;
    console.log(`${bad ? "FAILED" : "ok    "} ${file}: ${e} errors, ${w} warnings, ${i} infos, ${h} hints; ${size}`);
    for (const m of counted.slice(0, 20)) {
      console.log(`         ${severities[m.severity]} ${m.code} ${m.pointer ?? ""}: ${m.message}`);
    }
    if (counted.length > 20) console.log(`         and ${counted.length - 20} more`);
  }
}
console.log(`${checked} files, ${failed} failed`);
process.exit(failed > 0 ? 1 : 0);
