// What check_viewer.mjs looks at besides driving: the beginning, panels, a phone, tools, a link opened again, ground that
// is whole from above, buildings, tracks, lines of sight over the round earth, and pictures laid over the ground.
import { spawn } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";

const state = (page) => page.evaluate("window.tiefort.state()");

// Waiting for a page. It is asked from here: a poll that runs inside a page that has just been opened sometimes stops
// after its first look, and the page is blamed for standing still.
const EVERY_MS = 50;

/** Waits until an expression or function is true in the page; else fails after `ms`, telling what the page says. */
export async function until(page, isSo, ms = 120_000) {
  // A page that is opened again cannot be asked meanwhile.
  const ask = () => page.evaluate(isSo).catch((fault) => fault);
  const end = Date.now() + ms;
  let found;
  while ((found = await ask()) !== true) {
    if (end < Date.now()) throw new Error(`${found} after ${ms / 1000} s: ${isSo}; the page: ${await told(page)}`);
    await new Promise((later) => setTimeout(later, EVERY_MS));
  }
}

async function told(page) {
  const { frames, loaded, ...state } = await page.evaluate("window.tiefort?.state() ?? {}").catch(() => ({}));
  return JSON.stringify({ ...state, loaded: loaded?.length });
}

const KEYS_OF_COLORS = ["height", "going", "residuals", "limits", "levels"];
const near = (a, b, most) => Math.abs(a - b) <= most;
const text = (page, id) => page.$eval(`#${id}`, (box) => box.textContent);

/** Begins in flight and nears what it sees, until the first key; the help goes then. */
export async function begun(page, { address, expect, picture, pause }) {
  const since = Date.now();
  await page.goto(address, { timeout: 120_000 });
  await until(page, "window.tiefort !== undefined && 0 < window.tiefort.state().count");
  console.log(`     first picture after ${Date.now() - since} ms`);
  await until(page, "window.tiefort.state().height !== null && window.tiefort.state().lit");
  const first = await state(page);
  await pause(1500);
  const second = await state(page), gone = Math.hypot(second.east - first.east, second.north - first.north);
  expect(first.flies && first.drifts && 1 < gone && gone < 100, `begins in flight and nears, ${gone.toFixed(1)} m`);
  expect(first.height + 30 < first.altitude, `${(first.altitude - first.height).toFixed(0)} m above the ground`);
  await picture(page, "begin");
  await page.keyboard.press("KeyX");
  await pause(900);
  const help = await page.$eval("#keys", (box) => getComputedStyle(box).opacity);
  expect(help === "0" && !(await state(page)).drifts, "the first key ends the approach and the help");
}

/** Share of the window that panels cover. */
const covered = (page) => page.evaluate(() => {
  const boxes = [...document.querySelectorAll(".box")].map((box) => box.getBoundingClientRect());
  let hit = 0;
  for (let y = 0; y < 50; y++) {
    for (let x = 0; x < 50; x++) {
      const [left, top] = [((x + 0.5) * innerWidth) / 50, ((y + 0.5) * innerHeight) / 50];
      hit += boxes.some((box) => box.left <= left && left < box.right && box.top <= top && top < box.bottom) ? 1 : 0;
    }
  }
  return hit / 2500;
});

/** Panels leave the ground free, on a phone too; the keys are listed on `?`. */
export async function framed(page, { expect, picture, pause, size }) {
  const closed = await covered(page);
  await page.evaluate(() => document.querySelectorAll("details").forEach((box) => (box.open = true)));
  await pause(400);
  const open = await covered(page);
  const shares = [closed, open].map((share) => `${(100 * share).toFixed(0)} %`);
  expect(closed < 0.13 && open <= 0.45, `panels cover ${shares[0]}, all open ${shares[1]}`);
  await picture(page, "panels");
  await page.evaluate(() => document.querySelectorAll("details").forEach((box) => (box.open = false)));
  await page.setViewport({ width: 390, height: 800, hasTouch: true, isMobile: true });
  await pause(1200);
  const phone = await covered(page);
  expect(phone < 1 / 3, `on a phone panels cover ${(100 * phone).toFixed(0)} %`);
  await picture(page, "phone");
  await page.setViewport({ ...size, hasTouch: true });
  // A page that is turned into a phone's, and back, begins again.
  await until(page, "window.tiefort?.state().lit", 60_000);
  await page.keyboard.press("?");
  await pause(300);
  expect(await page.$eval("#all", (box) => box.open && 10 < box.querySelectorAll("dt").length), "? lists the keys");
  await page.keyboard.press("Escape");
  await pause(400);
}

/** Every way of colouring by its key. */
export async function colored(page, { expect, picture, pause }) {
  const seen = [];
  for (let i = 0; i < KEYS_OF_COLORS.length; i++) {
    seen.push(await page.$eval("#colors", (list) => list.value));
    if (["going", "levels"].includes(seen.at(-1))) await picture(page, `colors-${seen.at(-1)}`);
    await page.keyboard.press("KeyC");
    await pause(700);
  }
  expect(KEYS_OF_COLORS.every((colors) => seen.includes(colors)), `C goes through ${seen.join(", ")}`);
}

/** Line of sight, viewshed, profile and coordinates, held against the program's own answers. */
export async function asked(page, { expect, picture, pause, run, folder, size }) {
  await page.keyboard.press("KeyR");
  await page.mouse.click(size.width / 2 - 60, size.height * 0.9);
  await page.mouse.click(size.width / 2 + 160, size.height * 0.72);
  await until(page, "window.tiefort.state().answer !== null", 30_000);
  const { answer: line } = await state(page);
  const end = ([east, north]) => `${east.toFixed(3)},${north.toFixed(3)},2.5`;
  const said = run(["sight", folder, "--from", end(line.ends[0]), "--to", end(line.ends[1])]);
  const isSame = said.startsWith(line.visible ? "visible" : "hidden")
    && said.includes(`clearance  ${line.clearance_m.toFixed(2)} m`);
  expect(isSame, `a line of sight is that of the program: ${said.split("\n")[0]}`);
  await picture(page, "sight");
  await page.keyboard.press("Escape");
  await page.keyboard.press("KeyP");
  await page.mouse.click(size.width / 2 - 60, size.height * 0.9);
  await page.mouse.click(size.width / 2 + 160, size.height * 0.72);
  await until(page, "window.tiefort.state().answer?.along_m !== undefined", 30_000);
  expect(/km; climbs \d+ m/.test(await text(page, "answer")), `a profile tells: ${await text(page, "answer")}`);
  await picture(page, "profile");
  await page.keyboard.press("Escape");
  const place = await state(page);
  await page.keyboard.press("KeyV");
  await until(page, "window.tiefort.state().answer?.seen !== undefined", 30_000);
  const { answer: seen } = await state(page);
  expect(0 < seen.seen && seen.seen < seen.places, `a viewshed of ${seen.seen} in ${seen.places} places`);
  await pause(700);
  await picture(page, "viewshed");
  await page.keyboard.press("Escape");
  await page.keyboard.press("KeyN");
  await page.keyboard.type(`11S ${(place.east + 200).toFixed(0)} ${place.north.toFixed(0)}`);
  await page.keyboard.press("Enter");
  await pause(1500);
  const there = await state(page);
  expect(near(there.east, place.east + 200, 1) && near(there.north, place.north, 1), "coordinates of UTM are found");
}

/** A link opens the same place and view. */
export async function linked(page, { expect, address, open }) {
  await page.keyboard.press("KeyL");
  const before = await state(page), link = await page.evaluate("location.search");
  await page.goto("about:blank");
  await open(page, link.slice(1));
  const after = await state(page);
  const isThere = near(before.east, after.east, 0.2) && near(before.north, after.north, 0.2)
    && near(before.turned, after.turned, 0.01) && near(before.pitch, after.pitch, 0.01)
    && before.flies === after.flies && (!before.flies || near(before.altitude, after.altitude, 0.2));
  expect(isThere, `a link opens the same view of ${address}: ${link}`);
}

/** Milliseconds of a picture in the middle and at most, on a machine that does nothing else. */
const MEDIAN_MS_MAX = 60, FRAME_MS_MAX = 150;

/** How long pictures take while driving at full speed, at 1280 x 800; held where the machine is idle. And that what is
 * left behind is let go. */
export async function paced(page, { expect, open, pause, size, start, isIdle }) {
  await page.setViewport({ width: 1280, height: 800, hasTouch: true });
  await open(page, start);
  await page.keyboard.press("Digit4");
  await page.keyboard.down("ShiftLeft");
  await page.keyboard.down("KeyW");
  await pause(2500);
  const { count: before, textures: held } = await state(page);
  await pause(8000);
  const { count, frames, driven } = await state(page);
  await page.keyboard.up("KeyW");
  await page.keyboard.up("ShiftLeft");
  const taken = frames.slice(Math.max(frames.length - (count - before), 0)).sort((a, b) => a - b);
  const median = taken[Math.floor(taken.length / 2)], most = taken.at(-1);
  const told = `pictures of ${median.toFixed(0)} ms in the middle, ${most.toFixed(0)} ms at most, `
    + `${(driven / 1000).toFixed(1)} km`;
  if (isIdle) expect(median <= MEDIAN_MS_MAX && most <= FRAME_MS_MAX, told);
  else console.log(`     ${told}`);
  const { geometries, inScene, textures } = await state(page);
  expect(geometries <= inScene && textures <= held,
    `after it ${geometries} geometries are held, ${inScene} of the scene, and ${textures} textures of ${held}`);
  await page.setViewport({ ...size, hasTouch: true });
}

/** From high above, all around, where fine ground meets coarse and the area its border, no pixel sees the sky. */
export async function turned(page, { expect, open, own, settled }) {
  const middle = [0, 1].map((axis) => own.origin[axis] + ([own.cols, own.rows][axis] * own.side) / 2);
  let [below, sky, places] = [0, 0, []];
  for (const above of [600, 1500]) {
    for (let heading = 0; heading < 360; heading += 30) {
      const at = `east=${middle[0] + 40}&north=${middle[1] - 60}&heading=${heading}.3&range=1000`;
      if (heading === 0) {
        await open(page, at);
        const { height } = await state(page);
        await open(page, `${at}&height=${height + above}&pitch=-20`);
      }
      const seen = await page.evaluate("window.tiefort.skyBelowHorizon()");
      [below, sky] = [below + seen.below, sky + seen.sky];
      if (0 < seen.sky) places.push([above, heading, ...seen.places[0]]);
      await page.mouse.move(800, 300);
      await page.mouse.down();
      await page.mouse.move(800 - TURN_PIXELS, 300, { steps: 3 });
      await page.mouse.up();
      await settled(page);
    }
  }
  const found = `${sky} of ${below} pixels ${JSON.stringify(places)}`;
  expect(sky === 0, `no hole in the ground from above, all around: ${found}`);
}

/** So many pixels of a drag turn the view by 30 degrees. */
const TURN_PIXELS = 131;

/** Blocks of the sample's houses stand in the picture, cast shadows, are counted, and go with their switch. */
export async function housed(page, { expect, picture, pause, serveJob, settled, open }) {
  const other = await serveJob("houses", `[features]\nsources = ["houses.geojson"]\n`, { "houses.geojson": houses() });
  try {
    const at = `east=505550&north=3875500&heading=35&height=${HEIGHT_M}&pitch=-12&range=1000`;
    await open(page, at, other.address);
    await until(page, "window.tiefort.state().houses.drawn === 4", 60_000);
    await settled(page);
    await pause(700);
    const { houses: counts } = await state(page);
    expect(counts.all === 4 && counts.drawn === 4, `${counts.drawn} of ${counts.all} buildings are drawn`);
    await picture(page, "buildings");
    const shot = () => page.screenshot({ encoding: "base64" });
    const [withThem, off] = [await shot(), "objects"];
    await page.evaluate((id) => document.getElementById(id).click(), off);
    await pause(1200);
    const without = await shot();
    const share = await page.evaluate(difference, withThem, without);
    expect(0.01 < share && share < 0.6, `they take ${(100 * share).toFixed(1)} % of the picture, with their shadows`);
    const { houses: none } = await state(page);
    expect(none.drawn === 0, "their switch takes them away");
    await pause(900);
    const link = await page.evaluate("location.search");
    expect(/layers=/.test(link) && !/objects/.test(link), `a link says so: ${link}`);
  } finally {
    other.end();
  }
}

/** Objects of load modules stand in the picture and are counted, in no place twice; the tank stops at a wall, goes
 * slowly through a wood, and a line of sight is told what hides it. */
export async function stood(page, { expect, picture, pause, serveJob, settled, open }) {
  const sections = `[features]\nsources = ["houses.geojson"]\n[objects]\n`;
  const other = await serveJob("objects", sections, { "houses.geojson": houses(WOOD) });
  try {
    await open(page, `east=505550&north=3875500&heading=35&height=${HEIGHT_M}&pitch=-12&range=1000`, other.address);
    await settled(page);
    await picture(page, "objects");
    const { objects, houses: drawnOnly } = await state(page);
    expect(objects.all === 5 && objects.drawn === 5 && drawnOnly.all === 0,
      `${objects.drawn} of ${objects.all} objects are drawn, ${drawnOnly.drawn} buildings beside them`);
    await page.evaluate(() => document.getElementById("objects").click());
    await pause(700);
    expect((await state(page)).objects.drawn === 0, "their switch takes them away");
    // 25 m south of the tallest house, and in the wood.
    await open(page, "east=505790&north=3875735&heading=0&range=1000", other.address);
    await page.keyboard.down("KeyW");
    await until(page, "window.tiefort.state().meets === 'stopped by a building'", 60_000);
    await page.keyboard.up("KeyW");
    const { north } = await state(page);
    expect(3875755 < north && north < 3875760, `the tank stops ${(3875760 - north).toFixed(1)} m before a wall`);
    await open(page, "east=505575&north=3875575&heading=0&range=1000", other.address);
    await page.keyboard.down("KeyW");
    await until(page, "0 < window.tiefort.state().speed && window.tiefort.state().meets === 'in a wood'", 60_000);
    await pause(3000);
    const { speed } = await state(page);
    await page.keyboard.up("KeyW");
    expect(0 < speed && speed < 3, `it goes at ${speed.toFixed(1)} m/s between stems 4 m apart`);
    await picture(page, "wood");
    const body = JSON.stringify({ lines: [[505790, 3875740, 3, 505790, 3875840, 3]], above_ground: true });
    const { lines: [line] } = await page.evaluate(async (body) => {
      const headers = { "Content-Type": "application/json" };
      return (await fetch("/line-of-sight", { method: "POST", headers, body })).json();
    }, body);
    expect(line.hidden_by === "building" && line.visible === false, `a line of sight ends at a ${line.hidden_by}`);
  } finally {
    other.end();
  }
}

/** A wood of 50 m. */
const WOOD = {
  type: "Feature", properties: { natural: "wood" },
  geometry: {
    type: "Polygon",
    coordinates: [[[505550, 3875560], [505600, 3875560], [505600, 3875610], [505550, 3875610], [505550, 3875560]]],
  },
};

/** Metres over the sample's ground there. */
const HEIGHT_M = 1180;

/** Four blocks 150 m and more ahead, and what else is given. */
function houses(...more) {
  const block = ([east, north], side, height) => ({
    type: "Feature", properties: { building: "yes", height: String(height) },
    geometry: {
      type: "Polygon",
      coordinates: [[[0, 0], [side, 0], [side, side], [0, side], [0, 0]].map(([x, y]) => [east + x, north + y])],
    },
  });
  return JSON.stringify({
    type: "FeatureCollection", crs: { type: "name", properties: { name: "urn:ogc:def:crs:EPSG::32611" } },
    features: [
      block([505650, 3875650], 30, 40), block([505720, 3875620], 25, 15), block([505600, 3875720], 20, 9),
      block([505760, 3875760], 60, 60), ...more,
    ],
  });
}

/** Runs in the page: the share of pixels in which two pictures differ. */
async function difference(one, other) {
  const pixels = async (shot) => {
    const image = new Image();
    image.src = `data:image/png;base64,${shot}`;
    await image.decode();
    const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
    [canvas.width, canvas.height] = [image.width, image.height];
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height).data;
  };
  const [a, b] = [await pixels(one), await pixels(other)];
  let count = 0;
  for (let i = 0; i < a.length; i += 4) count += 24 < Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) ? 1 : 0;
  return count / (a.length / 4);
}

/** A track that is saved as GPX has places in degrees, where the observer stands. */
export async function tracked(page, { expect, pause }) {
  await page.evaluate(() => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => make((window.saved = blob));
    document.getElementById("track").value = "gpx";
  });
  await page.keyboard.press("KeyZ");
  await pause(2300);
  await page.keyboard.press("KeyZ");
  await until(page, "window.saved !== undefined", 30_000);
  const { east, north } = await state(page);
  const where = await page.evaluate(async (place) => (await fetch(`/api/where/${place}`)).json(), `${east},${north}`);
  const text = await page.evaluate(() => window.saved.text());
  const points = [...text.matchAll(/<trkpt lat="(.+?)" lon="(.+?)"/g)];
  const [, latitude, longitude] = points.at(-1) ?? [];
  const isThere = Math.abs(latitude - where.latitude) < 1e-4 && Math.abs(longitude - where.longitude) < 1e-4;
  const isGpx = text.startsWith("<?xml") && 1 < points.length;
  expect(isGpx && isThere, `a track of ${points.length} places is saved as GPX`);
}

/** Over the round earth a line of sight is that of the program, and another than over the flat one. */
export async function curved(page, { expect, run, folder, size }) {
  const clearances = [];
  for (const isRound of [false, true]) {
    await page.evaluate((isRound) => (document.getElementById("curved").checked = isRound), isRound);
    await page.keyboard.press("KeyR");
    await page.mouse.click(size.width / 2 - 60, size.height * 0.9);
    await page.mouse.click(size.width / 2 + 160, size.height * 0.85);
    await until(page, "window.tiefort.state().answer?.clearance_m !== undefined", 30_000);
    const { answer: line } = await state(page), end = ([east, north]) => `${east.toFixed(3)},${north.toFixed(3)},2.5`;
    const words = ["sight", folder, "--from", end(line.ends[0]), "--to", end(line.ends[1])];
    const said = run(isRound ? [...words, "--curvature"] : words);
    expect(said.includes(`clearance  ${line.clearance_m.toFixed(2)} m`),
      `over the ${isRound ? "round" : "flat"} earth a line clears the ground by ${line.clearance_m.toFixed(3)} m`);
    clearances.push(line.clearance_m);
    await page.keyboard.press("Escape");
  }
  await page.evaluate(() => (document.getElementById("curved").checked = false));
  expect(clearances[0] !== clearances[1], "and the two differ");
}

/** Metres of a pixel, and pixels along a side. */
const PIXEL_M = 2, SIDE = 1000;
/** Squares share one texture. */
const TEXTURES_MAX = 10;
const BLUE = [30, 60, 235], GREEN = [30, 200, 60];

/** A GeoTIFF of bare colours, not packed, with its north-western corner at a place. */
function geotiff([west, north], epsg, color) {
  const doubles = { 33550: [PIXEL_M, PIXEL_M, 0], 33922: [0, 0, 0, west, north, 0] };
  const keys = [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, epsg], size = 3 * SIDE * SIDE;
  const short = 3, long = 4, double = 12, beyond = [];
  let free = 8 + 2 + 12 * 12 + 4;
  const apart = (bytes) => {
    beyond.push(bytes);
    free += bytes.length;
    return free - bytes.length;
  };
  const of = (kind, list) => {
    const bytes = Buffer.alloc(list.length * (kind === short ? 2 : 8));
    const put = (value, i) => (kind === short ? bytes.writeUInt16LE(value, 2 * i) : bytes.writeDoubleLE(value, 8 * i));
    list.forEach(put);
    return [kind, list.length, apart(bytes)];
  };
  const tags = {
    256: [long, 1, SIDE], 257: [long, 1, SIDE], 258: of(short, [8, 8, 8]), 259: [short, 1, 1], 262: [short, 1, 2],
    277: [short, 1, 3], 278: [long, 1, SIDE], 279: [long, 1, size], 33550: of(double, doubles[33550]),
    33922: of(double, doubles[33922]), 34735: of(short, keys),
  };
  const pixels = Buffer.alloc(size);
  for (let at = 0; at < SIDE * SIDE; at++) pixels.set(color(at % SIDE, Math.floor(at / SIDE)), 3 * at);
  tags[273] = [long, 1, apart(pixels)];
  const head = Buffer.alloc(8 + 2 + 12 * 12 + 4);
  head.write("II*\0", "latin1");
  head.writeUInt32LE(8, 4);
  head.writeUInt16LE(12, 8);
  Object.keys(tags).map(Number).sort((a, b) => a - b).forEach((tag, i) => {
    const [kind, count, value] = tags[tag], at = 10 + 12 * i;
    head.writeUInt16LE(tag, at);
    head.writeUInt16LE(kind, at + 2);
    head.writeUInt32LE(count, at + 4);
    head.writeUInt32LE(value, at + 8);
  });
  return Buffer.concat([head, ...beyond]);
}

/** The server with pictures, and its address. */
async function serve(program, folder, files) {
  const words = ["view", folder, ...files.flatMap((file) => ["--imagery", file])];
  const server = spawn(program, words, { stdio: ["ignore", "pipe", "inherit"] });
  const address = await new Promise((found, failed) => {
    server.stdout.on("data", (text) => found(String(text).trim()));
    server.once("exit", (code) => failed(new Error(`tiefort view --imagery ended with ${code}`)));
  });
  return { server, address };
}

/** The colour of the screen at a place, the panels left out. */
async function colorAt(page, x, y) {
  const shot = await page.screenshot({ encoding: "base64", clip: { x: x - 2, y: y - 2, width: 4, height: 4 } });
  return page.evaluate(async (shot) => {
    const image = new Image();
    image.src = `data:image/png;base64,${shot}`;
    await image.decode();
    const context = new OffscreenCanvas(4, 4).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, 4, 4);
    const mean = (part) => Array.from({ length: 16 }, (_, i) => data[4 * i + part]).reduce((a, b) => a + b) / 16;
    return [0, 1, 2].map(mean);
  }, shot);
}

const isLike = (found, color) => {
  const most = color.indexOf(Math.max(...color));
  return color.every((_, part) => part === most || 1.5 * found[part] < found[most]);
};
const inWords = (color) => color.map((part) => part.toFixed(0)).join(" ");

/** A square in the picture has its colour where it lies, near and far, and the ground its own where there is none. */
export async function draped(told) {
  const { browser, expect, picture, pause, program, folder, scratch, address: plain, middle, size } = told;
  const { crs } = await (await fetch(new URL("/api/area", plain))).json(), epsg = Number(crs.split(":")[1]);
  const corner = [middle[0] - (PIXEL_M * SIDE) / 2, middle[1] + (PIXEL_M * SIDE) / 2], half = SIDE / 2;
  const inSquare = (x, y, wide) => Math.max(Math.abs(x - half), Math.abs(y - half)) < wide;
  const below = join(scratch, "below.tif"), above = join(scratch, "above.tif");
  writeFileSync(below, geotiff(corner, epsg, () => GREEN));
  // The upper one lies 400 m further west; it is blue there and in a square of 200 m at the middle.
  const color = (x, y) => (inSquare(x - 200, y, 50) ? BLUE : GREEN);
  writeFileSync(above, geotiff([corner[0] - 400, corner[1]], epsg, color));
  const { server, address } = await serve(program, folder, [below, above]), page = await browser.newPage();
  const said = [];
  page.on("console", (message) => ["error", "warn"].includes(message.type()) && said.push(message.text()));
  page.on("pageerror", (error) => said.push(String(error)));
  await page.setViewport(size);
  try {
    const open = async (words) => {
      await page.goto(`${address}?${words}`, { timeout: 120_000 });
      const isThere = "window.tiefort?.state().imagery.levels !== 0 && window.tiefort.state().imagery.isWhole"
        + " && window.tiefort.state().lit && window.tiefort.state().waiting === 0";
      await until(page, isThere);
      await page.evaluate(() => document.getElementById("keys").classList.add("gone"));
      await pause(1500);
    };
    await open(`east=${middle[0]}&north=${middle[1]}`);
    const height = (await state(page)).height + 300;
    // At 45 degrees from 300 m: what lies 300 m ahead is in the middle of the screen.
    await open(`east=${middle[0]}&north=${middle[1] - 300}&heading=0&pitch=-45&height=${height}&range=1000`);
    const [x, y] = [size.width / 2, size.height / 2];
    // Before single places are looked at: a browser that shows a part of its window draws no more than that part.
    await picture(page, "imagery");
    const seen = await colorAt(page, x, y), beside = await colorAt(page, x + 320, y);
    expect(isLike(seen, BLUE) && isLike(beside, GREEN),
      `a picture's square lies where it should: ${inWords(seen)}, and beside it ${inWords(beside)}`);
    await page.keyboard.press("KeyI");
    await pause(1000);
    const without = await colorAt(page, x, y);
    expect(!isLike(without, BLUE), `I leaves the pictures out: ${inWords(without)}`);
    await page.keyboard.press("KeyI");
    await page.evaluate(() => {
      document.getElementById("strength").value = 0.5;
      document.getElementById("strength").dispatchEvent(new Event("input"));
    });
    await pause(1500);
    const weakly = await colorAt(page, x, y), link = await page.evaluate("location.search");
    expect(seen[2] - weakly[2] + weakly[0] - seen[0] > 10 && link.includes("imagery=0.5"),
      `half as strong it is ${inWords(weakly)}, and the link says so`);
    await page.goto("about:blank");
    await open(link.slice(1));
    const again = await colorAt(page, x, y);
    expect(again.every((part, i) => Math.abs(part - weakly[i]) < 12), `a link opens it as strong: ${inWords(again)}`);
    const { imagery, textures } = await state(page);
    expect(0 < imagery.drawn && textures < TEXTURES_MAX,
      `${imagery.drawn} squares at ${imagery.levels} levels in ${textures} textures, with those of the ground`);
  } finally {
    await page.close();
    const ended = new Promise((end) => server.once("exit", end));
    server.kill("SIGINT");
    await ended;
  }
  expect(said.length === 0, `no error in the console over imagery ${said.slice(0, 3)}`);
}
