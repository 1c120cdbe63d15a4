// Asks the server, and reads what it answers. Places are metres east and north of `corner`, a corner of load modules in
// the middle of the area, so that they are small numbers, whole in 1/128 m, that a 32-bit float holds exactly.

import { dried } from "./colors.js";
import { objectsAt } from "./objects.js";

const QUANTA = 128;
/** Metres that a TIN leaves the sea's level by, and the share of an area from which on level ground at 0 is the sea:
 * rasters that know no other name for it have it so. */
const SEA_M = 0.75, SEA_SHARE = 0.02;
const isAtSeaLevel = (height) => Math.abs(height) < SEA_M;

/** Whether ground at these heights is taken for the sea; the legend says so. Pictures of `render` show its heights. */
export const isSea = (area, heights) => area.hasSea && heights.every(isAtSeaLevel);

/** What the server answers; fails with its words where it has none. */
export async function answer(path, request) {
  const response = await fetch(path, request);
  if (response.ok) return response;
  const words = await response.text(), isJson = response.headers.get("content-type") === "application/json";
  throw new Error(isJson ? JSON.parse(words).error : words);
}

/** What the area is, with its overview: heights and classes on a coarse grid, figures of every load module. */
export async function readArea() {
  const answers = [answer("/api/area"), answer("/api/overview"), answer("/api/lines")];
  const area = await (await answers[0]).json(), bytes = await (await answers[1]).arrayBuffer();
  dried(area);
  const [wide, high] = [area.cols * area.coarse_steps + 1, area.rows * area.coarse_steps + 1];
  area.corner = [Math.floor(area.rows / 2), Math.floor(area.cols / 2)];
  const classes = new Uint8Array(bytes, bytes.byteLength - wide * high);
  const heights = new Float32Array(bytes, 0, wide * high);
  area.coarse = { wide, high, heights, classes };
  area.hasSea = SEA_SHARE * heights.length < heights.filter(isAtSeaLevel).length;
  // What comes after them, the classes, fills no whole words.
  const part = [4 * wide * high, 4 * area.rows * area.cols];
  const words = new Uint32Array(bytes, ...part), metres = new Float32Array(bytes, ...part);
  const figures = (index) => {
    const [triangles, polygons] = [words[4 * index], words[4 * index + 1]];
    const count = area.limits.count === "triangles" ? triangles : polygons;
    return { triangles, polygons, count, rms: metres[4 * index + 2], largest: metres[4 * index + 3] };
  };
  area.figures = (row, col) => figures(row * area.cols + col);
  // West, south, east and north of the area.
  area.sides = [-area.corner[1], -area.corner[0], area.cols - area.corner[1], area.rows - area.corner[0]]
    .map((modules) => modules * area.side_m);
  area.moduleAt = (east, north) =>
    [Math.floor(north / area.side_m) + area.corner[0], Math.floor(east / area.side_m) + area.corner[1]];
  area.inSystem = (east, north) => [area.origin_m[0] + east - area.sides[0], area.origin_m[1] + north - area.sides[1]];
  area.fromSystem = (east, north) =>
    [east - area.origin_m[0] + area.sides[0], north - area.origin_m[1] + area.sides[1]];
  area.lines = linesIn(area, await (await answers[2]).arrayBuffer());
  return area;
}

/** The load modules of a half-open block at a level of detail; 0 is the finest. */
export async function readModules(area, [south, west, north, east], level) {
  const bytes = await (await answer(`/api/levels/${level}/${south}/${west}/${north}/${east}`)).arrayBuffer();
  const modules = [];
  for (let at = 0; at < bytes.byteLength;) {
    const [module, end] = moduleAt(area, bytes, at);
    modules.push({ ...module, level });
    at = end;
  }
  return modules;
}

/** Puts roads and streams that are lines of the TIN into the load modules of a half-open block. */
export async function readLines(area, [south, west, north, east], modules) {
  const bytes = await (await answer(`/api/lines/${south}/${west}/${north}/${east}`)).arrayBuffer();
  const lines = linesIn(area, bytes);
  for (const module of modules) module.lines = lines.get(module.row * area.cols + module.col);
}

/** The lines of an answer by their load modules, row * cols + col. */
function linesIn(area, bytes) {
  const words = new Uint32Array(bytes), metres = new Float32Array(bytes), found = new Map();
  const place = (at) => [metres[at] + area.sides[0], metres[at + 1] + area.sides[1], metres[at + 2]];
  for (let at = 0; at < words.length; at += 10) {
    const line = { class: words[at + 2], width: metres[at + 3], ends: [place(at + 4), place(at + 7)] };
    const key = words[at] * area.cols + words[at + 1];
    if (!found.has(key)) found.set(key, []);
    found.get(key).push(line);
  }
  return found;
}

function moduleAt(area, bytes, start) {
  const words = new Uint32Array(bytes, start, 13), [row, col, vertexCount, triangleCount, polygons, posts] = words;
  const sideCounts = words.subarray(6, 10), [deckVertices, deckTriangles, objectBytes] = words.subarray(10);
  const [rms, largest] = new Float32Array(bytes, start + 52, 2);
  const corner = [(col - area.corner[1]) * area.side_m, (row - area.corner[0]) * area.side_m];
  let at = start + 60;
  const points = pointsAt(bytes, at, vertexCount, corner);
  at += 8 * vertexCount;
  const triangles = new Uint16Array(bytes, at, 3 * triangleCount);
  at += 6 * triangleCount;
  const sides = [0, 1, 2, 3].map((side) => {
    const list = new Uint16Array(bytes, at, sideCounts[side]);
    at += 2 * sideCounts[side];
    return list;
  });
  const classes = new Uint8Array(bytes, at, triangleCount);
  at = 4 * Math.ceil((at + triangleCount) / 4);
  const decks = deckTriangles === 0 ? null : {
    points: pointsAt(bytes, at, deckVertices, corner),
    triangles: new Uint16Array(bytes, at + 8 * deckVertices, 3 * deckTriangles),
    classes: new Uint8Array(bytes, at + 8 * deckVertices + 6 * deckTriangles, deckTriangles),
  };
  at = 4 * Math.ceil((at + 8 * deckVertices + 7 * deckTriangles) / 4);
  const objects = objectBytes === 0 ? null : objectsAt(bytes, at, corner, area.side_m);
  const tin = { points, triangles, sides };
  // What limits count: decks as the ground.
  const counts = { triangles: triangleCount + deckTriangles, polygons: polygons + deckTriangles };
  return [{ row, col, counts, posts, rms, largest, classes, tin, decks, objects }, at + objectBytes];
}

/** Vertices of a load module whose south-west corner is at `[west, south]`. */
function pointsAt(bytes, at, count, [west, south]) {
  const [plan, heights] = [new Uint16Array(bytes, at, 4 * count), new Int32Array(bytes, at, 2 * count)];
  const points = new Float32Array(3 * count);
  for (let i = 0; i < count; i++) {
    points[3 * i] = west + plan[4 * i] / QUANTA;
    points[3 * i + 1] = south + plan[4 * i + 1] / QUANTA;
    points[3 * i + 2] = heights[2 * i + 1] / QUANTA;
  }
  return points;
}

/** Fails with the reason where the sources of the database cannot be read. */
export async function checkDem() {
  const { why } = await (await answer("/api/dem")).json();
  if (why !== null) throw new Error(why);
}

/** Puts the DEM's posts under load modules of a half-open block, each as a surface of two triangles a cell. */
export async function readPosts(area, [south, west, north, east], modules) {
  const bytes = await (await answer(`/api/dem/${south}/${west}/${north}/${east}`)).arrayBuffer();
  const cells = area.side_cells;
  const [wide, high] = [(east - west) * cells + 1, (north - south) * cells + 1];
  const [heights, residuals] = [0, 1].map((part) => new Float32Array(bytes, 4 * part * wide * high, wide * high));
  const step = area.side_m / cells, posts = cells + 1;
  for (const module of modules) {
    const points = new Float32Array(3 * posts * posts), found = new Float32Array(posts * posts);
    const corner = [(module.col - area.corner[1]) * area.side_m, (module.row - area.corner[0]) * area.side_m];
    for (let row = 0, i = 0; row < posts; row++) {
      for (let col = 0; col < posts; col++, i++) {
        const place = ((module.row - south) * cells + row) * wide + (module.col - west) * cells + col;
        points.set([corner[0] + col * step, corner[1] + row * step, heights[place]], 3 * i);
        found[i] = residuals[place];
      }
    }
    module.dem = { points, residuals: found, ...gridOf(cells) };
  }
}

const grids = new Map();

/** Triangles and sides of a square of so many cells a side. */
function gridOf(cells) {
  if (!grids.has(cells)) {
    const posts = cells + 1, triangles = [];
    for (let row = 0; row < cells; row++) {
      for (let col = 0; col < cells; col++) {
        const at = row * posts + col;
        triangles.push(at, at + 1, at + posts + 1, at, at + posts + 1, at + posts);
      }
    }
    const line = (start, step) => Array.from({ length: posts }, (_, i) => start + i * step);
    const sides = [line(0, 1), line(cells, posts), line(cells * posts, 1), line(0, posts)];
    grids.set(cells, { triangles: new Uint32Array(triangles), sides });
  }
  return grids.get(cells);
}
