// Decodes every KTX2 texture below a folder with Basis' own transcoder (from three.js' package) and compares it with the PNG
// of the same name beside it:
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/textures.mjs out/engines [PSNR]
//
// Prints decibels over the texels that can be seen, and the share of solid texels level by level. Exit code 1 when there is
// none, one is below PSNR (35 by default; 32 for normals, whose noise no format of eight bits a texel keeps), level 0
// covers other than the PNG by over 2 %, or one of its first four mips by over 15 %, both by solid texels and by what shows between
// them (leaves and cards keep the one, sheets of frames the other, and it does not know where they lie). Sheets of impostors change
// from texel to texel: the more of an atlas they take, the fewer decibels it has.

import { readFile, readdir } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";
import { inflateSync } from "node:zlib";

const [root, least = "35"] = process.argv.slice(2);
if (!root) {
  console.error("usage: node textures.mjs FOLDER [PSNR]");
  process.exit(2);
}
const require = createRequire(import.meta.url);
const basis = path.join(path.dirname(require.resolve("three")), "../examples/jsm/libs/basis");
// A plain script for browsers and CommonJS, in a package of modules.
const script = await readFile(path.join(basis, "basis_transcoder.js"), "utf8");
const BASIS = new Function("require", "__dirname", "__filename", `${script}; return BASIS;`)(require, basis, basis);
const transcoder = await BASIS({ wasmBinary: await readFile(path.join(basis, "basis_transcoder.wasm")) });
transcoder.initializeBasis();

// Our own PNG: eight bits, RGB or RGBA, rows plain or less the row above.
function readPng(bytes) {
  const [width, height, channels] = [bytes.readUInt32BE(16), bytes.readUInt32BE(20), bytes[25] === 6 ? 4 : 3];
  const parts = [];
  for (let at = 8; at < bytes.length; at += bytes.readUInt32BE(at) + 12) {
    if (bytes.toString("latin1", at + 4, at + 8) === "IDAT") parts.push(bytes.subarray(at + 8, at + 8 + bytes.readUInt32BE(at)));
  }
  const rows = inflateSync(Buffer.concat(parts));
  const [texels, line] = [new Uint8Array(width * height * 4).fill(255), width * channels];
  const above = new Uint8Array(line);
  for (let y = 0; y < height; y++) {
    const filter = rows[y * (line + 1)];
    if (filter !== 0 && filter !== 2) throw new Error(`filter ${filter} is none of ours`);
    for (let x = 0; x < line; x++) {
      above[x] = rows[y * (line + 1) + 1 + x] + (filter === 2 ? above[x] : 0);
      texels[(y * width + Math.floor(x / channels)) * 4 + (x % channels)] = above[x];
    }
  }
  return { width, height, texels };
}

// Shares of a level that are solid, and that show between texels: filtered and cut at a half, as engines do.
function shares(texels, width, height) {
  const alpha = (x, y) => texels[(Math.min(Math.max(y, 0), height - 1) * width + Math.min(Math.max(x, 0), width - 1)) * 4 + 3];
  let [solid, shown] = [0, 0];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const own = alpha(x, y);
      solid += own >= 128;
      for (const down of [-1, 1]) {
        for (const across of [-1, 1]) {
          const mean = (9 * own + 3 * (alpha(x + across, y) + alpha(x, y + down)) + alpha(x + across, y + down)) / 16;
          shown += (mean >= 127.5) / 4;
        }
      }
    }
  }
  return [solid, shown].map((count) => count / (width * height));
}

function compare(ktx, png) {
  const file = new transcoder.KTX2File(new Uint8Array(ktx));
  if (!file.isValid() || !file.isUASTC() || !file.startTranscoding()) throw new Error("Basis can't read it");
  const level = (k, format) => {
    const info = file.getImageLevelInfo(k, 0, 0);
    const texels = new Uint8Array(file.getImageTranscodedSizeInBytes(k, 0, 0, format));
    if (!file.transcodeImage(texels, k, 0, 0, format, 0, -1, -1)) throw new Error(`level ${k} can't be had as format ${format}`);
    return { width: info.origWidth, height: info.origHeight, texels };
  };
  const RGBA = 13;
  const { width, height, texels: wanted } = readPng(png);
  const first = level(0, RGBA);
  let [sum, count, clear] = [0, 0, 0];
  if (first.width !== width || first.height !== height) throw new Error("has another size than the PNG");
  for (let i = 0; i < wanted.length; i += 4) {
    clear += wanted[i + 3] < 255;
    if (wanted[i + 3] < 64) continue;
    for (let c = 0; c < 3; c++) sum += (wanted[i + c] - first.texels[i + c]) ** 2;
    count += 3;
  }
  const levels = Array.from({ length: file.getLevels() }, (_, k) => {
    const { texels, width, height } = level(k, RGBA);
    return { covers: shares(texels, width, height), texels: width * height };
  });
  // ETC1, ETC2, BC1, BC3, BC7 and ASTC: what phones and cards get must be had too.
  for (const format of [0, 1, 2, 3, 6, 10]) level(0, format);
  file.close();
  const psnr = 10 * Math.log10((255 * 255 * count) / Math.max(sum, 1e-9));
  return { psnr, masked: clear > 0, levels, covers: shares(wanted, width, height), size: [width, height] };
}

const faults = [];
const files = (await readdir(root, { recursive: true })).filter((f) => f.endsWith(".ktx2")).sort();
for (const name of files) {
  const [ktx, png] = await Promise.all(["ktx2", "png"].map((end) => readFile(path.join(root, name.replace(/ktx2$/, end)))));
  let seen;
  try {
    seen = compare(ktx, png);
  } catch (error) {
    faults.push(`${name}: ${error.message}`);
    continue;
  }
  const percent = (covers) => covers.map((share) => (share * 100).toFixed(1)).join("/");
  const told = seen.masked ? `; solid/shown ${percent(seen.covers)} % in the PNG, by level ` +
    seen.levels.map(({ covers }) => percent(covers)).join(" ") : "";
  console.log(`${name}: ${seen.size.join(" x ")}, ${seen.psnr.toFixed(1)} dB${told}`);
  const wanted = Number(least) - (name.includes("_normal.") ? 3 : 0);
  if (!(seen.psnr >= wanted)) faults.push(`${name}: ${seen.psnr} dB, and ${wanted} are asked for`);
  if (seen.masked) {
    seen.levels.forEach(({ covers, texels }, k) => {
      // Level 0 to a hair. Mips of leaves and cards show between texels what they do, those of sheets of frames have as much solid.
      const off = covers.map((share, i) => Math.abs(share - seen.covers[i]) / Math.max((k === 0 ? 0.02 : 0.15) * seen.covers[i], 0.51 / texels));
      if (k <= 4 && Math.min(...off) > 1) faults.push(`${name}: level ${k} covers ${covers}, the PNG ${seen.covers}`);
    });
  }
}
if (files.length === 0) faults.push("no .ktx2 file found");
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
