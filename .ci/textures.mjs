// Decodes every KTX2 texture below a folder with Basis' own transcoder (from three.js' package) and compares it with the PNG
// of the same name beside it:
//
//     (cd .ci && npm install --no-package-lock)
//     node .ci/textures.mjs out/engines [PSNR]
//
// Prints decibels over the texels that can be seen, and what is covered level by level. Exit code 1 when there is none, one is below
// PSNR (35 by default; 32 for normals, whose noise no format of eight bits a texel keeps), level 0 covers other than the PNG by over
// 2 %, or one of its first five mips by more: of leaves and cards by 10 % of what shows between texels, of impostors' sheets, which lie
// where the manifest beside it tells, by 15 % of the solid texels. Sheets change from texel to texel: the more of an atlas they take,
// the fewer decibels it has.

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

// Where impostors' sheets lie in the atlas of a set, 0..=1: their upper left and lower right corners.
async function sheets(file) {
  const folder = path.dirname(file);
  const set = JSON.parse(await readFile(path.join(folder, `${path.basename(folder)}.manifest.json`)));
  return set.variants.flatMap(({ levels }) => levels.flatMap(({ impostor }) => (impostor ? [[impostor.uv_min, impostor.uv_max]] : [])));
}

// Shares of a level that are covered: beside sheets what shows between texels, filtered and cut at a half as engines do, and of sheets
// what is solid.
function shares({ texels, width, height }, sheets) {
  const alpha = (x, y) => texels[(Math.min(Math.max(y, 0), height - 1) * width + Math.min(Math.max(x, 0), width - 1)) * 4 + 3];
  const inside = ([[left, top], [right, bottom]], u, v) => u > left && u < right && v > top && v < bottom;
  const [covered, all] = [[0, 0], [0, 0]];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const own = alpha(x, y);
      const sheet = sheets.some((sheet) => inside(sheet, (x + 0.5) / width, (y + 0.5) / height)) ? 1 : 0;
      all[sheet] += 1;
      if (sheet) {
        covered[1] += own >= 128;
        continue;
      }
      for (const down of [-1, 1]) {
        for (const across of [-1, 1]) {
          const mean = (9 * own + 3 * (alpha(x + across, y) + alpha(x, y + down)) + alpha(x + across, y + down)) / 16;
          covered[0] += (mean >= 127.5) / 4;
        }
      }
    }
  }
  return covered.map((count, i) => ({ share: count / Math.max(all[i], 1), texels: all[i] }));
}

function compare(ktx, png, sheets) {
  const file = new transcoder.KTX2File(new Uint8Array(ktx));
  if (!file.isValid() || !file.isUASTC() || !file.startTranscoding()) throw new Error("Basis can't read it");
  const level = (k, format) => {
    const info = file.getImageLevelInfo(k, 0, 0);
    const texels = new Uint8Array(file.getImageTranscodedSizeInBytes(k, 0, 0, format));
    if (!file.transcodeImage(texels, k, 0, 0, format, 0, -1, -1)) throw new Error(`level ${k} can't be had as format ${format}`);
    return { width: info.origWidth, height: info.origHeight, texels };
  };
  const RGBA = 13;
  const plain = readPng(png);
  const { width, height, texels: wanted } = plain;
  const first = level(0, RGBA);
  let [sum, count, clear] = [0, 0, 0];
  if (first.width !== width || first.height !== height) throw new Error("has another size than the PNG");
  for (let i = 0; i < wanted.length; i += 4) {
    clear += wanted[i + 3] < 255;
    if (wanted[i + 3] < 64) continue;
    for (let c = 0; c < 3; c++) sum += (wanted[i + c] - first.texels[i + c]) ** 2;
    count += 3;
  }
  const levels = Array.from({ length: file.getLevels() }, (_, k) => shares(level(k, RGBA), sheets));
  // ETC1, ETC2, BC1, BC3, BC7 and ASTC: what phones and cards get must be had too.
  for (const format of [0, 1, 2, 3, 6, 10]) level(0, format);
  file.close();
  const psnr = 10 * Math.log10((255 * 255 * count) / Math.max(sum, 1e-9));
  return { psnr, masked: clear > 0, levels, covers: shares(plain, sheets), size: [width, height] };
}

const faults = [];
const files = (await readdir(root, { recursive: true })).filter((f) => f.endsWith(".ktx2")).sort();
for (const name of files) {
  const [ktx, png] = await Promise.all(["ktx2", "png"].map((end) => readFile(path.join(root, name.replace(/ktx2$/, end)))));
  let seen;
  try {
    seen = compare(ktx, png, await sheets(path.join(root, name)));
  } catch (error) {
    faults.push(`${name}: ${error.message}`);
    continue;
  }
  const percent = (covers) => covers.map(({ share }) => (share * 100).toFixed(1)).join("/");
  const told = seen.masked ? `; pictures/sheets ${percent(seen.covers)} % in the PNG, by level ${seen.levels.map(percent).join(" ")}` : "";
  console.log(`${name}: ${seen.size.join(" x ")}, ${seen.psnr.toFixed(1)} dB${told}`);
  const wanted = Number(least) - (name.includes("_normal.") ? 3 : 0);
  if (!(seen.psnr >= wanted)) faults.push(`${name}: ${seen.psnr} dB, and ${wanted} are asked for`);
  if (seen.masked) {
    seen.levels.slice(0, 6).forEach((covers, k) => {
      covers.forEach(({ share, texels }, i) => {
        const wanted = seen.covers[i].share;
        const bound = Math.max((k === 0 ? 0.02 : [0.1, 0.15][i]) * wanted, 0.51 / Math.max(texels, 1));
        if (Math.abs(share - wanted) > bound) faults.push(`${name}: level ${k} covers ${share}, level 0 of the PNG ${wanted}, of ${["pictures", "sheets"][i]}`);
      });
    });
  }
}
if (files.length === 0) faults.push("no .ktx2 file found");
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
