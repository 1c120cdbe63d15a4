// Readers of exports that are not ours. Run it where `npm install` has put what check_exports.py names.
//
//   node readers.mjs gltf FILE.glb…
//   node readers.mjs --terrain DIR --implicit DIR --tileset DIR --places places.json [--pictures DIR]
//                    [--chromium /usr/bin/chromium]
//   node readers.mjs --terrain http://…/NAME --tileset http://…/NAME --places places.json
//
// The first form validates glTF by Khronos' validator: no error and no warning may be found. The others load what is
// for globes in CesiumJS, in a headless Chromium, and compare heights with given places; the last one loads it from
// `tiefort serve --cors '*'`, as a page of another origin does.
// places.json: [[longitude, latitude, height above the ellipsoid], …] of the compiled surface. Exit code 0 when
// everything agrees.
import { createServer } from "node:http";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, extname, join, normalize } from "node:path";
import { parseArgs } from "node:util";

if (process.argv[2] === "gltf") process.exit((await validated(process.argv.slice(3))) === 0 ? 0 : 1);

async function validated(paths) {
  const { default: validator } = await import("gltf-validator");
  let faults = 0;
  for (const path of paths) {
    const report = await validator.validateBytes(new Uint8Array(readFileSync(path)), { maxIssues: 20 });
    const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
    faults += numErrors + numWarnings;
    if (0 < numErrors + numWarnings || paths.length <= 2) {
      console.log(`${path}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`);
      messages.filter((message) => message.severity <= 1).forEach((message) => console.log("  ", message));
    }
  }
  console.log(`${paths.length} files, ${faults} errors and warnings`);
  return faults;
}

const { default: puppeteer } = await import("puppeteer-core");
const { values } = parseArgs({
  options: {
    terrain: { type: "string" },
    implicit: { type: "string" },
    tileset: { type: "string" },
    places: { type: "string" },
    pictures: { type: "string" },
    chromium: { type: "string", default: "/usr/bin/chromium" },
    tolerance: { type: "string", default: "0.10" },
  },
});
const cesium = join(dirname(createRequire(import.meta.url).resolve("cesium/package.json")), "Build", "Cesium");
const roots = { cesium, terrain: values.terrain, implicit: values.implicit, tileset: values.tileset };
// Folders are handed out by the server below; a service hands out its own.
const address = (name) => (values[name]?.startsWith("http:") ? values[name] : `/${name}`);
const types = {
  ".js": "text/javascript", ".css": "text/css", ".json": "application/json", ".glb": "model/gltf-binary",
};

// Only on this machine, and only files below the three folders.
const server = createServer((request, response) => {
  const [, name, ...rest] = new URL(request.url, "http://x").pathname.split("/");
  if (name === "") {
    response.setHeader("content-type", "text/html");
    return response.end(`<!doctype html><link rel="icon" href="data:,"><link rel="stylesheet"
      href="/cesium/Widgets/widgets.css"><style>html,body,#globe{width:100%;height:100%;margin:0}</style>
      <script>window.CESIUM_BASE_URL = "/cesium/";</script><script src="/cesium/Cesium.js"></script>
      <div id="globe"></div>`);
  }
  try {
    const path = normalize(rest.join("/"));
    if (!roots[name] || path.startsWith("..")) throw new Error("outside");
    const body = readFileSync(join(roots[name], path));
    response.setHeader("content-type", types[extname(path)] ?? "application/octet-stream");
    response.end(body);
  } catch {
    missing.push(request.url);
    response.statusCode = 404;
    response.end();
  }
});
const missing = [];
await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
const profile = mkdtempSync(join(tmpdir(), "cesium-"));
const browser = await puppeteer.launch({
  executablePath: values.chromium,
  userDataDir: profile,
  protocolTimeout: 600_000,
  args: [
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--window-size=1024,640",
  ],
});
let faults = 0;
const expect = (holds, what) => {
  console.log(`${holds ? "ok   " : "WRONG"} ${what}`);
  faults += holds ? 0 : 1;
};
try {
  const page = await browser.newPage();
  await page.setViewport({ width: 1024, height: 640 });
  const said = [];
  page.on("console", (message) => message.type() === "error" && said.push(message.text()));
  page.on("pageerror", (error) => said.push(String(error)));
  await page.goto(`http://127.0.0.1:${server.address().port}/`, { timeout: 120_000 });
  await page.waitForFunction("window.Cesium !== undefined", { timeout: 300_000 });
  const places = JSON.parse(readFileSync(values.places));
  for (const [name, format] of [["terrain", "quantized-mesh"], ["implicit", "3dtiles-terrain"]]) {
    if (!values[name]) continue;
    const heights = await page.evaluate(async (places, address, isImplicit) => {
      const wanted = { requestVertexNormals: true, requestWaterMask: !isImplicit };
      const terrain = isImplicit
        ? await Cesium.Cesium3DTilesTerrainProvider.fromUrl(`${address}/tileset.json`, wanted)
        : await Cesium.CesiumTerrainProvider.fromUrl(address, wanted);
      const asked = places.map(([lon, lat]) => Cesium.Cartographic.fromDegrees(lon, lat));
      await Cesium.sampleTerrainMostDetailed(terrain, asked);
      window.terrain = terrain;
      return asked.map((place) => place.height);
    }, places, address(name), name === "implicit");
    const off = heights.map((height, index) => Math.abs(height - places[index][2]));
    const worst = Math.max(...off.map((metres) => (Number.isFinite(metres) ? metres : Infinity)));
    expect(worst < Number(values.tolerance),
      `${format}: ${heights.length} heights by sampleTerrainMostDetailed within ${worst.toFixed(3)} m`);
    await look(page, name, places, false);
  }
  if (values.tileset) {
    const loaded = await look(page, "tileset", places, true);
    expect(0 < loaded.tiles && 0 < loaded.triangles,
      `3dtiles: ${loaded.tiles} tiles with ${loaded.triangles} triangles are drawn`);
    expect(loaded.failed === 0, `3dtiles: ${loaded.failed} tiles failed`);
  }
  expect(missing.length === 0, `no file was missing ${missing.slice(0, 3)}`);
  expect(said.length === 0, `no error in the console ${said.slice(0, 3)}`);
} finally {
  await browser.close();
  server.close();
  rmSync(profile, { recursive: true, force: true });
}
console.log(`${faults} faults`);
process.exit(faults === 0 ? 0 : 1);

// Draws the globe from the south of the places, looking north and down, until everything is loaded.
async function look(page, name, places, withTileset) {
  const found = await page.evaluate(async (places, withTileset, address) => {
    document.getElementById("globe").innerHTML = "";
    const viewer = new Cesium.Viewer("globe", {
      baseLayer: false, animation: false, timeline: false, geocoder: false, homeButton: false, infoBox: false,
      baseLayerPicker: false, navigationHelpButton: false, sceneModePicker: false, selectionIndicator: false,
      terrainProvider: withTileset ? undefined : window.terrain,
      contextOptions: { webgl: { preserveDrawingBuffer: true } },
    });
    viewer.scene.globe.enableLighting = true;
    viewer.clock.currentTime = Cesium.JulianDate.fromIso8601("2026-06-21T17:00:00Z");
    viewer.scene.globe.baseColor = Cesium.Color.fromCssColorString("#b5a27a");
    let failed = 0;
    let tileset;
    if (withTileset) {
      tileset = await Cesium.Cesium3DTileset.fromUrl(`${address}/tileset.json`);
      tileset.tileFailed.addEventListener(() => failed++);
      viewer.scene.primitives.add(tileset);
      viewer.scene.globe.show = false;
    }
    const middle = [0, 1, 2].map((axis) => places.reduce((sum, place) => sum + place[axis], 0) / places.length);
    const south = Math.min(...places.map((place) => place[1]));
    const away = (middle[1] - south) * 111_000;
    viewer.camera.lookAt(Cesium.Cartesian3.fromDegrees(...middle),
      new Cesium.HeadingPitchRange(0, Cesium.Math.toRadians(-25), 2.2 * away + 2000));
    const done = () => (withTileset ? tileset.tilesLoaded : viewer.scene.globe.tilesLoaded);
    const start = performance.now();
    let quiet = 0;
    while (quiet < 5 && performance.now() - start < 240_000) {
      viewer.scene.render();
      await new Promise((later) => setTimeout(later, 200));
      quiet = done() ? quiet + 1 : 0;
    }
    viewer.scene.render();
    const statistics = tileset?.statistics;
    return { failed, tiles: statistics?.numberOfTilesWithContentReady ?? 0,
             triangles: statistics?.numberOfTrianglesSelected ?? 0 };
  }, places, withTileset, address("tileset"));
  if (values.pictures) await page.screenshot({ path: join(values.pictures, `${name}.png`) });
  return found;
}
