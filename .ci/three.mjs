// three.js in Chromium: a page with a module that may import "three" and "three/addons/…", and reads the files of one folder
// below /files/ and examples/engines below /engines/. For the checks beside it.

import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { chromium as browsers } from "playwright-core";

const three = path.join(path.dirname(createRequire(import.meta.url).resolve("three")), "..");
const engines = fileURLToPath(new URL("../examples/engines", import.meta.url));
const types = { ".wasm": "application/wasm", ".webp": "image/webp", ".js": "text/javascript", ".glb": "model/gltf-binary", ".png": "image/png" };

// Opens a page that runs `module` and waits until it has set `window.ready`. What goes wrong there is kept in `faults`.
export async function open(folder, module, { edge, chromium = "/usr/bin/chromium", patience = 120000 }) {
  const page = `<!doctype html><style>body{margin:0}</style>
<script type="importmap">{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module">${module}
window.ready = true;
</script>`;
  const server = createServer(async (request, response) => {
    const url = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
    if (url === "/") return response.writeHead(200, { "content-type": "text/html" }).end(page);
    if (url === "/favicon.ico") return response.writeHead(204).end();
    const base = { three, files: folder, engines }[url.split("/")[1]];
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
  await tab.setViewportSize({ width: edge, height: edge });
  await tab.goto(`http://127.0.0.1:${server.address().port}/`);
  await tab.waitForFunction("window.ready", undefined, { timeout: patience }).catch((error) => faults.push(String(error)));
  const close = async () => {
    await browser.close();
    server.close();
  };
  return { tab, faults, close };
}
