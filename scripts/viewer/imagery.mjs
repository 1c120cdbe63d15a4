// What check_viewer.mjs looks at besides driving: pictures laid over the ground, from GeoTIFFs that it writes itself.

import { spawn } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { until } from "./wait.mjs";

const state = (page) => page.evaluate("window.tiefort.state()");
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
