// Runs the Khronos glTF validator over every .glb below the folders given, with the pictures they name.
//
//     npm install --prefix .ci --no-package-lock && node .ci/validate.mjs out/ ...
//
// Prints one line a file and what the validator says about it. Exit code 1 when there is an error or a warning, an info
// that isn't in `allowed`, or no .glb at all; 2 on wrong usage.

import { readFile, readdir } from "node:fs/promises";
import path from "node:path";
import validator from "gltf-validator";

// Infos that we accept, each with its reason. Everything else counts as a failure.
const allowed = [
  // Textures are files of their own because all variants of a set share them.
  { code: "URI_GLB", pointer: /^\/images\/\d+\/uri$/ },
  // Levels of detail are MSFT_lod, a vendor extension that the validator doesn't know; it is never required.
  { code: "UNSUPPORTED_EXTENSION", about: "MSFT_lod" },
  // A consequence of the above: the lower levels' nodes are named by MSFT_lod only, so the validator takes them to be
  // unused. Their meshes, materials and accessors are not exempted.
  { code: "UNUSED_OBJECT", pointer: /^\/nodes\/\d+$/ },
  // The second UV set is for light maps, which are baked in the engine, further ones hold the wind for shaders: no texture
  // of the file uses them.
  { code: "UNUSED_OBJECT", pointer: /\/attributes\/TEXCOORD_[1-4]$/ },
  // The web profile is packed by meshoptimizer; the validator doesn't know the extension, so it takes the buffer that holds
  // the packed bytes to be unused.
  { code: "UNSUPPORTED_EXTENSION", about: "EXT_meshopt_compression" },
  { code: "UNUSED_OBJECT", pointer: /^\/buffers\/0$/ },
];

const severities = ["error", "warning", "info", "hint"];

function isAllowed(issue) {
  return (
    issue.severity >= 2 &&
    allowed.some(
      (a) =>
        a.code === issue.code &&
        (!a.about || issue.message.includes(a.about)) &&
        (!a.pointer || a.pointer.test(issue.pointer ?? "")),
    )
  );
}

async function glbs(folder) {
  const entries = await readdir(folder, { recursive: true, withFileTypes: true });
  return entries
    .filter((e) => e.isFile() && e.name.toLowerCase().endsWith(".glb"))
    .map((e) => path.join(e.parentPath ?? e.path, e.name))
    .sort();
}

async function validate(file) {
  const folder = path.dirname(file);
  const report = await validator.validateBytes(new Uint8Array(await readFile(file)), {
    uri: path.basename(file),
    format: "glb",
    maxIssues: 1000,
    writeTimestamp: false,
    // URIs come as in the file: percent-encoded, relative to it.
    externalResourceFunction: async (uri) => new Uint8Array(await readFile(path.join(folder, decodeURIComponent(uri)))),
  });
  return { info: report.info, issues: report.issues };
}

const folders = process.argv.slice(2);
if (folders.length === 0) {
  console.error("usage: node validate.mjs FOLDER ...");
  process.exit(2);
}

let files = 0;
let failed = 0;
for (const folder of folders) {
  for (const file of await glbs(folder)) {
    files += 1;
    const { info, issues } = await validate(file);
    const counted = issues.messages.filter((m) => !isAllowed(m));
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
if (files === 0) console.error("no .glb file found");
else console.log(`${files} files, ${failed} failed`);
process.exit(files === 0 || failed > 0 ? 1 : 0);
