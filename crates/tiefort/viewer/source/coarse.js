// The whole area on a coarse grid, for what is far away, and the level ground around it.
import { BufferAttribute, BufferGeometry, Group, Sphere, Vector3 } from "three";
import { bytes, colorOf, isWater, MADE, numbers, WATER } from "./colors.js";
import * as looks from "./materials.js";
import { geometryOf, meshOf, ribbonMesh, seaTint, tintAt, tintOf } from "./meshes.js";
import { isSea } from "./server.js";
import { coarseUnder } from "./surface.js";

/** Load modules along the side of a part that is drawn at once, or not where the camera does not look. */
const PART = 10;
/** Steps between the heights of a part that is far away: its border keeps all, so that parts fit together. */
const STRIDES = [4, 2];
/** Radians that a height may be off where it is left out: less than a pixel of a screen. */
const OFF_MAX = 0.001;
/** Metres that the observer moves between two looks at which parts are far away. */
const LOOK_M = 200;
/** Pieces of roads and streams along a coarse step, so that they follow the ground. */
const PIECES = 3;

export class Coarse {
  constructor(area) {
    this.area = area;
    this.group = new Group();
    this.normals = normals(area.coarse, area.side_m / area.coarse_steps);
    this.parts = [];
    for (let south = 0; south < area.rows; south += PART) {
      for (let west = 0; west < area.cols; west += PART) this.addPart(south, west);
    }
    this.repaint("height");
    this.cut(() => false);
  }

  addPart(south, west) {
    const { area } = this, { wide, heights } = area.coarse, steps = area.coarse_steps;
    const block = [south, west, Math.min(south + PART, area.rows), Math.min(west + PART, area.cols)];
    const step = area.side_m / steps, [rows, cols] = [(block[2] - south) * steps, (block[3] - west) * steps];
    const count = (rows + 1) * (cols + 1);
    const [positions, smooth] = [new Float32Array(3 * count), new Float32Array(3 * count)];
    // Where each of its heights is among those of the area.
    const places = new Uint32Array(count);
    let [low, top] = [Infinity, -Infinity];
    for (let row = 0, i = 0; row <= rows; row++) {
      for (let col = 0; col <= cols; col++, i++) {
        const at = (south * steps + row) * wide + west * steps + col, height = heights[at];
        places[i] = at;
        positions.set([area.sides[0] + (west * steps + col) * step, height,
          -(area.sides[1] + (south * steps + row) * step)], 3 * i);
        smooth.set(this.normals.subarray(3 * at, 3 * at + 3), 3 * i);
        if (height < low) low = height;
        if (top < height) top = height;
      }
    }
    const geometry = geometryOf(positions);
    geometry.setAttribute("normal", new BufferAttribute(smooth, 3));
    geometry.setIndex(new BufferAttribute(new Uint16Array(6 * rows * cols), 1));
    const [left, down] = [area.sides[0] + west * area.side_m, area.sides[1] + south * area.side_m];
    const half = [(block[3] - west) / 2, (block[2] - south) / 2].map((modules) => modules * area.side_m);
    geometry.boundingSphere = new Sphere(new Vector3(left + half[0], (low + top) / 2, -(down + half[1])),
      Math.hypot(...half, (top - low) / 2));
    const mesh = meshOf(geometry, looks.coarse);
    const height = (row, col) => positions[3 * (row * (cols + 1) + col) + 1];
    // How far away it may be drawn at each stride.
    const from = STRIDES.map((stride) =>
      (rows % stride || cols % stride ? Infinity : offBy(height, rows, cols, stride) / OFF_MAX));
    const ends = [left, down, left + 2 * half[0], down + 2 * half[1]];
    const roads = this.roadsOf(block);
    this.parts.push({ block, mesh, rows, cols, places, ends, from, roads, finely: null, isPlain: true, stride: 1 });
    this.group.add(mesh, ...(roads ? [roads.mesh] : []));
  }

  /** Roads and streams of a part on the coarse ground, and which of their corners are whose load module's. */
  roadsOf([south, west, north, east]) {
    const { area } = this, step = area.side_m / area.coarse_steps / PIECES, all = [], ends = [];
    const on = (x, y) => coarseUnder(area, x, y);
    for (let row = south; row < north; row++) {
      for (let col = west; col < east; col++) {
        const lines = area.lines.get(row * area.cols + col);
        if (!lines) continue;
        all.push(...lines);
        ends.push([(row - south) * (east - west) + col - west, lines.length]);
      }
    }
    if (all.length === 0) return null;
    const { mesh, counts } = ribbonMesh(area, all, step, on);
    let corner = 0, line = 0;
    const runs = ends.map(([module, lines]) => {
      const first = corner;
      for (let i = 0; i < lines; i++) corner += counts[line++];
      return [module, first, corner];
    });
    mesh.geometry.setIndex(new BufferAttribute(new Uint32Array(corner), 1));
    return { mesh, runs };
  }

  repaint(colors) {
    const { area } = this, { wide, heights, classes } = area.coarse, steps = area.coarse_steps;
    const isByHeight = colors === "height" || colors === "going";
    // A road is narrower than a cell: far away only water is more than a line.
    const stays = (ofClass) =>
      colorOf.cover(area, ofClass) && (isWater(area, ofClass) || ofClass === area.hole);
    const covers = new Map([...new Set(classes)].filter(stays).map((ofClass) =>
      [ofClass, tintOf(area, ofClass, colorOf.cover(area, ofClass))]));
    for (const part of this.parts) {
      const tint = part.mesh.geometry.getAttribute("tint");
      part.isPlain = isByHeight;
      part.places.forEach((at, i) => {
        let found;
        if (isByHeight) {
          const cover = covers.get(classes[at]), isLevel = isSea(area, [heights[at]]);
          found = cover ?? (isLevel ? seaTint(area) : tintAt(area, heights[at]));
          // Shores stay where they are.
          if (cover || isLevel) part.isPlain = false;
        } else {
          const [row, col] = [Math.floor(at / wide), at % wide].map((place) => Math.floor(place / steps));
          const figures = area.figures(Math.min(row, area.rows - 1), Math.min(col, area.cols - 1));
          const value = { limits: figures.count, residuals: figures.rms, levels: Infinity }[colors];
          found = [...bytes(colorOf[colors](area, value)), MADE];
        }
        tint.array.set(found, 4 * i);
      });
      tint.needsUpdate = true;
    }
    this.looked = null;
  }

  /** Leaves out load modules that are drawn finely. */
  cut(isFine) {
    for (const part of this.parts) {
      const [south, west, north, east] = part.block;
      let finely = "";
      for (let row = south; row < north; row++) {
        for (let col = west; col < east; col++) finely += isFine(row, col) ? "1" : "0";
      }
      if (finely === part.finely) continue;
      part.finely = finely;
      this.index(part);
    }
  }

  /** Draws with fewer triangles what is so far away that it looks the same. */
  follow(east, north) {
    if (this.looked && Math.hypot(east - this.looked[0], north - this.looked[1]) < LOOK_M) return;
    this.looked = [east, north];
    for (const part of this.parts) {
      const [west, south, far, top] = part.ends;
      const away = Math.hypot(Math.max(west - east, 0, east - far), Math.max(south - north, 0, north - top)) - LOOK_M;
      const stride = STRIDES.find((_, i) => part.isPlain && part.from[i] < away) ?? 1;
      if (stride === part.stride) continue;
      part.stride = stride;
      this.index(part);
    }
  }

  /** The triangles of a part: all of them but those of load modules that are drawn finely, or fewer of them. */
  index(part) {
    const { rows, cols, finely, mesh } = part, { index } = mesh.geometry, steps = this.area.coarse_steps;
    let end = 0;
    const put = (...corners) => {
      index.array.set(corners, end);
      end += corners.length;
    };
    if (part.stride !== 1 && !finely.includes("1")) strided(part, put);
    else {
      const across = cols / steps, wide = cols + 1;
      // Row by row, so that what was reckoned for one row of heights is still there for the next.
      for (let row = 0; row < rows; row++) {
        for (let col = 0; col < cols; col++) {
          if (finely[Math.floor(row / steps) * across + Math.floor(col / steps)] === "1") continue;
          const at = row * wide + col;
          put(at, at + 1, at + wide + 1, at, at + wide + 1, at + wide);
        }
      }
    }
    index.needsUpdate = true;
    mesh.geometry.setDrawRange(0, end);
    mesh.visible = 0 < end;
    if (part.roads && part.roads.finely !== finely) indexRoads(part);
  }
}

/** The roads of a part but for those of load modules that are drawn finely. */
function indexRoads({ roads, finely }) {
  const { geometry } = roads.mesh, { index } = geometry;
  let end = 0;
  for (const [module, first, last] of roads.runs) {
    if (finely[module] === "1") continue;
    for (let corner = first; corner < last; corner++) index.array[end++] = corner;
  }
  index.needsUpdate = true;
  geometry.setDrawRange(0, end);
  roads.mesh.visible = 0 < end;
  roads.finely = finely;
}

/** The triangles of a part some of whose heights are left out, but for those along its border: squares there are fans
 * around their middles. */
function strided({ rows, cols, stride }, put) {
  const wide = cols + 1, at = (row, col) => row * wide + col;
  for (let south = 0; south < rows; south += stride) {
    for (let west = 0; west < cols; west += stride) {
      const [north, east] = [south + stride, west + stride];
      const corners = [at(south, west), at(south, east), at(north, east), at(north, west)];
      const open = [south === 0, east === cols, north === rows, west === 0];
      if (!open.includes(true)) {
        put(corners[0], corners[1], corners[2], corners[0], corners[2], corners[3]);
        continue;
      }
      const middle = at(south + stride / 2, west + stride / 2);
      open.forEach((isOpen, side) => {
        const [from, to] = [corners[side], corners[(side + 1) % 4]], pieces = isOpen ? stride : 1;
        const step = (to - from) / pieces;
        for (let piece = 0; piece < pieces; piece++) put(middle, from + piece * step, from + (piece + 1) * step);
      });
    }
  }
}

/** Metres that a height is off at most where only one in so many is kept each way. */
function offBy(height, rows, cols, stride) {
  let most = 0;
  for (let row = 0; row < rows; row++) {
    for (let col = 0; col < cols; col++) {
      const [up, right] = [(row % stride) / stride, (col % stride) / stride];
      const [south, west] = [row - (row % stride), col - (col % stride)];
      const [a, b, c, d] = [height(south, west), height(south, west + stride), height(south + stride, west + stride),
        height(south + stride, west)];
      const on = up <= right ? a + right * (b - a) + up * (c - b) : a + up * (d - a) + right * (c - d);
      const off = Math.abs(height(row, col) - on);
      // A height that is missing stays a hole.
      most = Math.max(most, Number.isNaN(off) ? Infinity : off);
    }
  }
  return most;
}

/** Smooth normals of a grid. */
function normals({ wide, high, heights }, step) {
  const out = new Float32Array(3 * wide * high), inside = (at, end) => Math.min(Math.max(at, 0), end - 1);
  for (let row = 0, i = 0; row < high; row++) {
    for (let col = 0; col < wide; col++, i++) {
      const rise = (to, from) => (heights[to] - heights[from]) / (2 * step);
      const east = rise(row * wide + inside(col + 1, wide), row * wide + inside(col - 1, wide));
      const north = rise(inside(row + 1, high) * wide + col, inside(row - 1, high) * wide + col);
      const length = Math.hypot(east, 1, north);
      out.set([-east / length, 1 / length, north / length], 3 * i);
    }
  }
  return out;
}

/** Level ground around the area, so that the earth does not end with it. Below the area there is nothing: a hole in
 * the ground must show the sky, not this. */
export function apron(area, base, reach) {
  const [west, south, east, north] = area.sides, positions = [];
  const rectangle = (left, low, right, top) => {
    for (const [x, y] of [[left, low], [right, low], [right, top], [left, low], [right, top], [left, top]]) {
      positions.push(x, base, -y);
    }
  };
  // Rectangles that meet along whole sides: beside a corner in the middle of a side a pixel may show the sky.
  const across = [-reach, west, east, reach], along = [-reach, south, north, reach];
  for (let row = 0; row < 3; row++) {
    for (let col = 0; col < 3; col++) {
      if (row !== 1 || col !== 1) rectangle(across[col], along[row], across[col + 1], along[row + 1]);
    }
  }
  const geometry = geometryOf(new Float32Array(positions)), tint = geometry.getAttribute("tint");
  // Nothing is known of it: land in the haze, or the sea where the area has one.
  const haze = bytes(numbers(area.palette.haze)), land = tintAt(area, base).map((part, i) => (part + 2 * haze[i]) / 3);
  const color = area.hasSea ? [...bytes(colorOf.sea(area)), WATER] : [...land.slice(0, 3), MADE];
  for (let i = 0; i < tint.count; i++) tint.array.set(color, 4 * i);
  geometry.computeVertexNormals();
  const mesh = meshOf(geometry, looks.apron);
  mesh.frustumCulled = false;
  return mesh;
}
