// The whole area on a coarse grid, for what is far away, and the level ground around it.
import { BufferAttribute, BufferGeometry, Group, Sphere, Vector3 } from "three";
import { bytes, colorOf, isWater, MADE, numbers, WATER } from "./colors.js";
import * as looks from "./materials.js";
import { geometryOf, meshOf, seaTint, tintAt, tintOf } from "./meshes.js";
import { isSea } from "./server.js";

/** Load modules along the side of a part that is drawn at once, or not where the camera does not look. */
const PART = 10;

export class Coarse {
  constructor(area) {
    const { wide, high, heights } = area.coarse, step = area.side_m / area.coarse_steps;
    this.area = area;
    this.group = new Group();
    const positions = new Float32Array(3 * wide * high);
    for (let row = 0, i = 0; row < high; row++) {
      for (let col = 0; col < wide; col++, i++) {
        positions.set([area.sides[0] + col * step, heights[i], -(area.sides[1] + row * step)], 3 * i);
      }
    }
    this.whole = geometryOf(positions);
    this.whole.setAttribute("normal", new BufferAttribute(normals(area.coarse, step), 3));
    this.parts = [];
    for (let south = 0; south < area.rows; south += PART) {
      for (let west = 0; west < area.cols; west += PART) this.addPart(south, west);
    }
    this.repaint("height");
    this.cut(() => false);
  }

  addPart(south, west) {
    const { area, whole } = this, { wide, heights } = area.coarse, steps = area.coarse_steps;
    const block = [south, west, Math.min(south + PART, area.rows), Math.min(west + PART, area.cols)];
    const geometry = new BufferGeometry();
    for (const name of ["position", "normal", "tint"]) geometry.setAttribute(name, whole.getAttribute(name));
    const modules = (block[2] - south) * (block[3] - west);
    geometry.setIndex(new BufferAttribute(new Uint32Array(6 * modules * steps * steps), 1));
    let [low, top] = [Infinity, -Infinity];
    for (let row = south * steps; row <= block[2] * steps; row++) {
      for (let col = west * steps; col <= block[3] * steps; col++) {
        const height = heights[row * wide + col];
        if (height < low) low = height;
        if (top < height) top = height;
      }
    }
    const [left, down] = [area.sides[0] + west * area.side_m, area.sides[1] + south * area.side_m];
    const half = [(block[3] - west) / 2, (block[2] - south) / 2].map((modules) => modules * area.side_m);
    geometry.boundingSphere = new Sphere(new Vector3(left + half[0], (low + top) / 2, -(down + half[1])),
      Math.hypot(...half, (top - low) / 2));
    const mesh = meshOf(geometry, looks.coarse);
    this.parts.push({ block, mesh, finely: null });
    this.group.add(mesh);
  }

  repaint(colors) {
    const { area } = this, { wide, high, heights, classes } = area.coarse, steps = area.coarse_steps;
    const tint = this.whole.getAttribute("tint");
    for (let i = 0; i < wide * high; i++) {
      let found;
      if (colors === "height" || colors === "going") {
        const cover = colorOf.cover(area, classes[i]);
        // A road is narrower than a cell: far away only water is more than a line.
        const stays = cover && (isWater(area, classes[i]) || classes[i] === area.hole);
        const plain = isSea(area, [heights[i]]) ? seaTint(area) : tintAt(area, heights[i]);
        found = stays ? tintOf(area, classes[i], cover) : plain;
      } else {
        const [row, col] = [Math.floor(i / wide), i % wide].map((place) => Math.floor(place / steps));
        const figures = area.figures(Math.min(row, area.rows - 1), Math.min(col, area.cols - 1));
        const value = { limits: figures.count, residuals: figures.rms, levels: Infinity }[colors];
        found = [...bytes(colorOf[colors](area, value)), MADE];
      }
      tint.array.set(found, 4 * i);
    }
    tint.needsUpdate = true;
  }

  /** Leaves out load modules that are drawn finely. */
  cut(isFine) {
    const { wide } = this.area.coarse, steps = this.area.coarse_steps;
    for (const part of this.parts) {
      const [south, west, north, east] = part.block, index = part.mesh.geometry.index;
      let finely = "", end = 0;
      for (let row = south; row < north; row++) {
        for (let col = west; col < east; col++) finely += isFine(row, col) ? "1" : "0";
      }
      if (finely === part.finely) continue;
      part.finely = finely;
      for (let row = south, i = 0; row < north; row++) {
        for (let col = west; col < east; col++, i++) {
          if (finely[i] === "1") continue;
          for (let cell = 0; cell < steps * steps; cell++, end += 6) {
            const at = (row * steps + Math.floor(cell / steps)) * wide + col * steps + (cell % steps);
            index.array.set([at, at + 1, at + wide + 1, at, at + wide + 1, at + wide], end);
          }
        }
      }
      index.needsUpdate = true;
      part.mesh.geometry.setDrawRange(0, end);
      part.mesh.visible = 0 < end;
    }
  }
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
  rectangle(-reach, -reach, reach, south);
  rectangle(-reach, north, reach, reach);
  rectangle(-reach, south, west, north);
  rectangle(east, south, reach, north);
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
