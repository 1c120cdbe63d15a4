#!/usr/bin/env node
// Drives through a database in a headless Chromium, and looks for what is missing, torn or miscounted.
//
//   node scripts/check_viewer.mjs [DIR] [--tiefort PROGRAM] [--pictures DIR] [--chromium /usr/bin/chromium]
//                                 [--metres 2000] [--range M] [--idle] [--update-reference]
//
// DIR is a terrain database; without it tests/jobs/small.toml is built, and the first picture is compared with
// scripts/viewer/reference.json. --idle holds the time of pictures, too. PROGRAM is built with the feature `viewer`.
// Counts are taken from the load-module files by this script itself (docs/FORMAT.md). Needs what
// scripts/build_viewer.sh installs. Exit code 0: all is well.
import { spawn, spawnSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { parseArgs } from "node:util";
import * as looks from "./viewer/looks.mjs";

const root = join(dirname(fileURLToPath(import.meta.url)), "..");
const library = createRequire(join(root, "crates", "tiefort", "viewer", "package.json")).resolve("puppeteer-core");
const { default: puppeteer } = await import(pathToFileURL(library));
const reference = join(root, "scripts", "viewer", "reference.json");
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    tiefort: { type: "string", default: join(root, "target", "release", "tiefort") },
    pictures: { type: "string" },
    chromium: { type: "string", default: "/usr/bin/chromium" },
    metres: { type: "string", default: "2000" },
    range: { type: "string" },
    idle: { type: "boolean", default: false },
    "update-reference": { type: "boolean", default: false },
  },
});
/** The picture is compared on a grid of so many colours; levels of 255 that they may differ by. */
const GRID = [32, 20], MEAN_LEVELS_MAX = 4, LEVELS_MAX = 40;
/** Milliseconds after which a picture that stands still has all its pixels. */
const STILL_MS = 600;
const SIZE = { width: 1120, height: 700 };

let faults = 0;
const expect = (holds, what) => {
  console.log(`${holds ? "ok   " : "WRONG"} ${what}`);
  faults += holds ? 0 : 1;
};
const pause = (ms) => new Promise((later) => setTimeout(later, ms));

const scratch = mkdtempSync(join(tmpdir(), "viewer-"));
let folder = positionals[0];
if (!folder) {
  folder = join(scratch, "small.tdb");
  const job = join(root, "tests", "jobs", "small.toml");
  const words = ["build", job, "--out", folder, "--quiet", "--no-html"];
  const built = spawnSync(values.tiefort, words, { stdio: "inherit" });
  if (built.status !== 0) process.exit(2);
}
if (values.pictures) mkdirSync(values.pictures, { recursive: true });
const own = readCounts(join(folder, "modules"));
const { server, address } = await serve(folder);
const browser = await puppeteer.launch({
  executablePath: values.chromium,
  userDataDir: join(scratch, "profile"),
  protocolTimeout: 300_000,
  args: [
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", `--window-size=${SIZE.width},${SIZE.height}`,
  ],
});
try {
  await check();
} finally {
  await browser.close();
  const ended = new Promise((end) => server.once("exit", (code, signal) => end(code ?? signal)));
  server.kill("SIGINT");
  expect((await ended) === 0, "Ctrl-C ends the server");
  rmSync(scratch, { recursive: true, force: true });
}
console.log(`${faults} faults`);
process.exit(faults === 0 ? 0 : 1);

/** What the program prints. */
function run(words) {
  return String(spawnSync(values.tiefort, words).stdout);
}

/** Builds the small job with a section more, beside files of its own, and serves it. */
async function serveJob(name, section, files) {
  const place = join(scratch, name);
  mkdirSync(place);
  for (const [file, text] of Object.entries(files)) writeFileSync(join(place, file), text);
  writeFileSync(join(place, "job.toml"), `${readFileSync(join(root, "tests", "jobs", "small.toml"))}\n${section}`);
  const words = ["build", join(place, "job.toml"), "--out", join(place, "area.tdb"), "--quiet", "--no-html"];
  if (spawnSync(values.tiefort, words, { stdio: "inherit" }).status !== 0) throw new Error(`${name} was not built`);
  const { server, address } = await serve(join(place, "area.tdb"));
  return { address, end: () => server.kill("SIGINT") };
}

/** Starts the server on a free port. */
async function serve(folder) {
  const server = spawn(values.tiefort, ["view", folder], { stdio: ["ignore", "pipe", "inherit"] });
  const address = await new Promise((found, failed) => {
    server.stdout.on("data", (text) => found(String(text).trim()));
    server.once("exit", (code) => failed(new Error(`tiefort view ended with ${code}`)));
  });
  return { server, address };
}

/** Triangles and polygons of every load module, from headers and indexes; `levels` has those of every level. */
function readCounts(modules) {
  const area = { levels: [], decks: [] };
  for (const name of readdirSync(modules).filter((name) => name.endsWith(".slm"))) {
    const file = readFileSync(join(modules, name));
    const word = (at) => file.readUInt32LE(at);
    [area.rows, area.cols, area.side] = [word(32), word(36), word(56) / 128];
    area.origin = [file.readDoubleLE(72), file.readDoubleLE(80)];
    const entry = file.readUInt16LE(8) === 1 ? 32 : 48;
    let at = word(12);
    for (let level = 0; level < file.readUInt16LE(10); level++) {
      const counts = (area.levels[level] ??= new Map());
      for (let row = word(40); row < word(44); row++) {
        for (let col = word(48); col < word(52); col++, at += entry) {
          // Decks count as the ground does.
          const decks = entry === 32 ? 0 : word(at + 36);
          if (0 < decks && level === 0) area.decks.push(...decksIn(file, at, area, row, col));
          counts.set(row * area.cols + col, { triangles: word(at + 16) + decks, polygons: word(at + 20) + decks });
        }
      }
    }
  }
  return { ...area, counts: area.levels[0] };
}

/**
 * The triangles of a load module's decks, whose entry in the index is at `at`: their middles, the direction and length
 * of their longest sides, and how far the ground lies below.
 */
function decksIn(file, at, { side, origin }, row, col) {
  const ground = Number(file.readBigUInt64LE(at)), decks = ground + file.readUInt32LE(at + 8);
  const read = (start, vertices, triangles) => {
    const corner = (v) => {
      const place = start + 8 * v;
      const [x, y, z] = [file.readUInt16LE(place), file.readUInt16LE(place + 2), file.readInt32LE(place + 4)];
      return [origin[0] + col * side + x / 128, origin[1] + row * side + y / 128, z / 128];
    };
    const first = start + 8 * vertices;
    const triangle = (t) => [0, 2, 4].map((c) => corner(file.readUInt16LE(first + 6 * t + c)));
    return Array.from({ length: triangles }, (_, t) => triangle(t));
  };
  const below = read(ground + 56, file.readUInt32LE(at + 12), file.readUInt32LE(at + 16));
  return read(decks + 20, file.readUInt32LE(at + 32), file.readUInt32LE(at + 36)).map((corners) => {
    const place = [0, 1, 2].map((axis) => corners.reduce((sum, of) => sum + of[axis], 0) / 3);
    const sides = corners.map((from, c) => [0, 1].map((axis) => corners[(c + 1) % 3][axis] - from[axis]));
    const along = sides.reduce((most, of) => (Math.hypot(...most) < Math.hypot(...of) ? of : most));
    const under = below.map((triangle) => heightOn(triangle, place)).filter((height) => height !== null);
    const heading = ((Math.atan2(along[0], along[1]) * 180) / Math.PI + 360) % 180;
    return { place, heading, length: Math.hypot(...along), clear: place[2] - Math.max(...under) };
  });
}

/** The height of a triangle at a place, where it lies over that. */
function heightOn([a, b, c], [x, y]) {
  const left = (p, q) => (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
  const [onA, onB, onC] = [left(b, c), left(c, a), left(a, b)];
  return Math.min(onA, onB, onC) < 0 ? null : (onA * a[2] + onB * b[2] + onC * c[2]) / (onA + onB + onC);
}

async function check() {
  const page = await browser.newPage();
  await page.setViewport({ ...SIZE, hasTouch: true });
  const said = [], failed = [], wanted = [];
  page.on("console", (message) => ["error", "warn"].includes(message.type()) && said.push(message.text()));
  page.on("pageerror", (error) => said.push(String(error)));
  page.on("response", (response) => response.ok() || failed.push(`${response.status()} ${response.url()}`));
  page.on("request", (request) => wanted.push(request.url()));
  if (!positionals[0]) await compared(page);
  const metres = Number(values.metres);
  const middle = [own.origin[0] + (own.cols * own.side) / 2, own.origin[1] + (own.rows * own.side) / 2];
  const range = values.range ?? (positionals[0] ? 3500 : 1000);
  // On a slow machine the tank goes on a good while before the keys are seen to be let go.
  const north = Math.max(own.origin[1] + 300, middle[1] - 0.85 * metres);
  const start = `east=${middle[0] + 40}&north=${north}&heading=0&range=${range}`;
  await open(page, start);
  await whole(page, "at the start");
  await counted(page, "at the start");
  await picture(page, "start");
  await drive(page, metres);
  await settled(page);
  await whole(page, "after the drive");
  await counted(page, "after the drive");
  await picture(page, "end");
  await clicked(page);
  await shown(page);
  const told = { address, expect, picture, pause, run, folder, open, size: SIZE, own, settled, serveJob };
  await looks.colored(page, told);
  await looks.asked(page, told);
  await looks.curved(page, told);
  await looks.tracked(page, told);
  await looks.linked(page, told);
  await looks.framed(page, told);
  await touched(page);
  await flown(page);
  await looks.linked(page, told);
  await looks.paced(page, { ...told, start, isIdle: values.idle });
  await looks.begun(page, told);
  await looks.turned(page, told);
  await looks.draped({ ...told, browser, program: values.tiefort, scratch, middle });
  if (0 < own.decks.length) await bridged(page);
  expect(failed.length === 0, `every answer was whole ${failed.slice(0, 3)}`);
  const isOurs = (url) => url.startsWith(address) || url === "about:blank" || url.startsWith("data:");
  expect(wanted.every(isOurs), "nothing else was asked");
  // It asks another server.
  if (!positionals[0]) await looks.housed(page, told);
  if (!positionals[0]) await looks.stood(page, told);
  expect(said.length === 0, `no error in the console ${said.slice(0, 3)}`);
}

async function open(page, start, of = address) {
  await page.goto(`${of}?${start}`, { timeout: 120_000 });
  await looks.until(page, "window.tiefort !== undefined");
  await settled(page);
}

function state(page) {
  return page.evaluate("window.tiefort.state()");
}

/** Waits until all that is wanted is there, and two pictures more. */
async function settled(page) {
  await looks.until(page, () => {
    const { block, modules, waiting, height, fault, lit } = window.tiefort.state();
    const wanted = (block[2] - block[0]) * (block[3] - block[1]);
    return fault !== null || (lit && height !== null && waiting === 0 && modules === wanted);
  });
  // What stands still is drawn finely a moment later.
  await pause(STILL_MS);
  await page.evaluate(() => new Promise((end) => requestAnimationFrame(() => requestAnimationFrame(end))));
}

/** No pixel below the horizon sees the sky. */
async function whole(page, when) {
  const { below, sky, places } = await page.evaluate("window.tiefort.skyBelowHorizon()");
  const where = sky === 0 ? "" : `, such as ${JSON.stringify(places)}`;
  expect(1000 < below && sky === 0, `no hole in the ground ${when}: ${sky} of ${below} pixels${where}`);
}

/** What is loaded is the block around the tank, all of it, and is counted right. */
async function counted(page, when) {
  const found = await state(page);
  const area = await page.evaluate(async () => (await fetch("/api/area")).json());
  const [south, west, north, east] = found.block;
  const keys = [];
  for (let row = south; row < north; row++) for (let col = west; col < east; col++) keys.push(row * own.cols + col);
  const missing = keys.filter((key) => !found.loaded.includes(key)).length;
  expect(missing === 0 && found.loaded.length === keys.length && found.modules === keys.length,
    `${keys.length} load modules around the tank ${when}, ${missing} missing`);
  const reach = [found.north - own.origin[1], found.east - own.origin[0]].map((place) => Math.floor(place / own.side));
  const [row, col] = reach;
  expect(south <= row && row < north && west <= col && col < east, `the tank stands among them ${when}`);
  const triangles = keys.reduce((sum, key) => sum + own.counts.get(key).triangles, 0);
  expect(found.triangles === triangles, `${triangles} triangles in them ${when}, counted ${found.triangles}`);
  const { rows, cols } = area.limits.window;
  let fullest = null;
  for (let row = south; row + rows <= north; row++) {
    for (let col = west; col + cols <= east; col++) {
      let sum = 0;
      for (let cell = 0; cell < rows * cols; cell++) {
        const key = (row + Math.floor(cell / cols)) * own.cols + col + (cell % cols);
        sum += own.counts.get(key)[area.limits.count];
      }
      fullest = Math.max(fullest ?? 0, sum);
    }
  }
  expect(found.fullest === fullest, `${fullest ?? "no"} ${area.limits.count} in the fullest window ${when}`);
  if (1 < area.levels) farther(found, area, when);
  const seen = found.view.triangles;
  expect(0 < seen && seen <= triangles, `${seen} triangles in view ${when}`);
}

/** Around the block there are load modules at coarser levels, each at the level of its ring. */
function farther(found, area, when) {
  const inside = ([south, west, north, east], row, col) => south <= row && row < north && west <= col && col < east;
  const expected = new Map();
  for (let row = 0; row < own.rows; row++) {
    for (let col = 0; col < own.cols; col++) {
      const level = found.blocks.findIndex((block) => inside(block, row, col));
      if (0 < level) expected.set(row * own.cols + col, level);
    }
  }
  const right = found.coarser.filter(([level, row, col, triangles]) => {
    const key = row * own.cols + col;
    return expected.get(key) === level && own.levels[level].get(key).triangles === triangles;
  });
  expect(found.blocks.length === area.levels && right.length === expected.size
    && found.coarser.length === expected.size,
  `${expected.size} load modules at coarser levels around them ${when}, ${right.length} right`);
}

/** Drives north with the keys, looking for holes on the way. */
async function drive(page, metres) {
  const before = await state(page);
  await page.keyboard.down("ShiftLeft");
  await page.keyboard.down("KeyW");
  let [looked, holes, tilted, frames] = [0, [], 0, []];
  const began = Date.now();
  for (let now = before; now.driven < metres && Date.now() - began < 240_000; now = await state(page)) {
    // A look takes a second on a slow machine, and the tank goes on: none near the end, and slowly there.
    if (0.75 * metres < now.driven) await page.keyboard.up("ShiftLeft");
    if (now.driven < 0.4 * metres) {
      const { sky, places } = await page.evaluate("window.tiefort.skyBelowHorizon()");
      looked += 1;
      if (0 < sky) holes.push(`${sky} pixels from ${places[0]} after ${now.driven.toFixed(0)} m`);
    }
    tilted = Math.max(tilted, ...now.tilt.map(Math.abs));
    frames.push(now.frameMs);
    await pause(50);
  }
  await page.keyboard.up("ShiftLeft");
  await page.keyboard.up("KeyW");
  await looks.until(page, "window.tiefort.state().speed === 0", 60_000);
  const after = await state(page);
  const gone = Math.hypot(after.east - before.east, after.north - before.north);
  const frame = frames.sort((a, b) => a - b)[Math.floor(frames.length / 2)];
  expect(metres <= after.driven && 0.95 * metres < gone,
    `drove ${gone.toFixed(0)} m; median frame ${frame?.toFixed(0)} ms`);
  expect(holes.length === 0, `no hole in the ground on the way, ${looked} looks ${holes.join("; ")}`);
  expect(0.005 < tilted && tilted < 1, `pitched and rolled up to ${((tilted * 180) / Math.PI).toFixed(1)} degrees`);
}

/** A click on the ground tells the load module there. */
async function clicked(page) {
  await page.mouse.click(SIZE.width / 2 + 90, SIZE.height * 0.8);
  const { picked } = await state(page);
  const words = await page.$eval("#picked", (box) => box.innerText);
  const counts = own.counts.get(picked?.row * own.cols + picked?.col);
  const told = counts && [`Load module ${picked.row},${picked.col}`, `${counts.triangles} tri`];
  expect(told?.every((part) => words.includes(part)),
    `a click tells: ${words.split("\n").slice(0, 3).join("; ")}`);
}

/** Every switch, with a picture of each. */
async function shown(page) {
  await page.keyboard.press("KeyM");
  for (const colors of ["residuals", "limits", "height"]) {
    await page.select("#colors", colors);
    await settled(page);
    await picture(page, `colors-${colors}`);
  }
  await page.keyboard.press("KeyT");
  await settled(page);
  await picture(page, "without-edges");
  await page.keyboard.press("KeyG");
  const isRead = () => !document.getElementById("note").textContent.startsWith("reading");
  await looks.until(page, isRead);
  const { showsDem } = await state(page);
  const note = await page.$eval("#note", (box) => box.textContent);
  expect(showsDem || note.includes("not at hand"), showsDem ? "the DEM is shown" : `no DEM, and told so: ${note}`);
  if (showsDem) {
    await settled(page);
    await whole(page, "of the DEM");
    await page.select("#colors", "residuals");
    await settled(page);
    await picture(page, "dem");
    await page.select("#colors", "height");
    await page.keyboard.press("KeyG");
  }
  for (const key of ["KeyT", "KeyM"]) await page.keyboard.press(key);
}

/** A finger on the left half drives. */
async function touched(page) {
  const before = await state(page);
  await page.touchscreen.touchStart(300, 400);
  await page.touchscreen.touchMove(300, 320);
  await pause(1500);
  await page.touchscreen.touchEnd();
  const after = await state(page);
  expect(before.driven < after.driven, `a finger drove ${(after.driven - before.driven).toFixed(1)} m`);
}

/** From above, and from the hatch. */
async function flown(page) {
  await page.keyboard.press("KeyH");
  await settled(page);
  await whole(page, "from the hatch");
  await picture(page, "hatch");
  await page.keyboard.press("KeyF");
  await page.keyboard.down("ShiftLeft");
  await page.keyboard.down("KeyE");
  await pause(1500);
  await page.keyboard.up("KeyE");
  await page.keyboard.up("ShiftLeft");
  await page.mouse.move(600, 300);
  await page.mouse.down();
  await page.mouse.move(600, 240, { steps: 4 });
  await page.mouse.up();
  await settled(page);
  await whole(page, "in flight");
  await picture(page, "flight");
}

/** The tank stands on a deck where it is put there and drives along it, and drives under one from beside it. */
async function bridged(page) {
  const most = (of) => own.decks.reduce((best, deck) => (of(best) < of(deck) ? deck : best));
  const at = ([east, north], heading) => `east=${east}&north=${north}&heading=${heading}&range=1000`;
  const long = most((deck) => deck.length);
  await open(page, at(long.place, long.heading));
  const deck = await state(page), off = deck.height - long.place[2];
  expect(deck.isOnDeck && Math.abs(off) < 0.2, `the tank stands on a deck, ${off.toFixed(2)} m off`);
  await picture(page, "on-deck");
  const far = Math.min(150, 0.2 * long.length);
  await page.keyboard.down("KeyW");
  await looks.until(page, `${far} < window.tiefort.state().driven`);
  const along = await state(page);
  await page.keyboard.up("KeyW");
  // On a slow machine it has driven past the end of a short one before it is asked.
  if (along.driven < 0.4 * long.length) {
    expect(along.isOnDeck, `and drives on along it, ${along.driven.toFixed(1)} m, at ${along.height.toFixed(1)} m`);
  }
  const high = most((deck) => deck.clear);
  if (high.clear < 3) return console.log(`     no deck is higher than ${high.clear.toFixed(1)} m over the ground`);
  const across = high.heading + 90, [east, north] = high.place, turned = (across * Math.PI) / 180;
  await open(page, at([east - 80 * Math.sin(turned), north - 80 * Math.cos(turned)], across));
  await picture(page, "before-deck");
  let [under, onDeck] = [null, 0];
  await page.keyboard.down("KeyW");
  for (let now = await state(page); now.driven < 82; now = await state(page)) {
    onDeck += now.isOnDeck ? 1 : 0;
    if (under === null && 78 < now.driven) {
      under = now;
      await picture(page, "under-deck");
    }
    await pause(20);
  }
  await page.keyboard.up("KeyW");
  const below = high.place[2] - (under ?? (await state(page))).height;
  expect(onDeck === 0 && high.clear / 2 < below, `and another drives under it, ${below.toFixed(1)} m below`);
}

async function picture(page, name) {
  if (values.pictures) await page.screenshot({ path: join(values.pictures, `${name}.png`) });
}

/** The scene alone, from above, as a grid of colours, beside that of the reference. */
async function compared(page) {
  await open(page, `east=${own.origin[0] + 700}&north=${own.origin[1] + 500}&heading=40&range=1000`);
  await page.keyboard.press("KeyF");
  await settled(page);
  await picture(page, "reference");
  const boxes = await page.addStyleTag({ content: ".box { visibility: hidden }" }).catch(() => null);
  const shot = await page.screenshot({ encoding: "base64" });
  await boxes?.evaluate((tag) => tag.remove());
  const found = await page.evaluate(async (shot, [wide, high]) => {
    const image = new Image();
    image.src = `data:image/png;base64,${shot}`;
    await image.decode();
    const [canvas, sums] = [document.createElement("canvas"), Array(3 * wide * high).fill(0)];
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const [cellWide, cellHigh] = [Math.floor(image.width / wide), Math.floor(image.height / high)];
    for (let y = 0; y < cellHigh * high; y++) {
      for (let x = 0; x < cellWide * wide; x++) {
        const cell = 3 * (Math.floor(y / cellHigh) * wide + Math.floor(x / cellWide));
        for (let part = 0; part < 3; part++) sums[cell + part] += data[4 * (y * image.width + x) + part];
      }
    }
    return sums.map((sum) => Math.round(sum / (cellWide * cellHigh)));
  }, shot, GRID);
  if (values["update-reference"]) {
    mkdirSync(dirname(reference), { recursive: true });
    writeFileSync(reference, `${JSON.stringify(found)}\n`);
  }
  if (!existsSync(reference)) return expect(false, "no reference picture: make it with --update-reference");
  const wanted = JSON.parse(readFileSync(reference));
  const off = found.map((level, i) => Math.abs(level - wanted[i]));
  const mean = off.reduce((sum, level) => sum + level, 0) / off.length, most = Math.max(...off);
  expect(mean < MEAN_LEVELS_MAX && most < LEVELS_MAX,
    `the picture is that of the reference within ${mean.toFixed(2)} levels, ${most} at most`);
}
