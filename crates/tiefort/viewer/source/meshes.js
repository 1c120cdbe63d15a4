// From surfaces to what the renderer draws: east is x, up is y, south is z.
import {
  BufferAttribute, BufferGeometry, DoubleSide, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial,
  MeshLambertMaterial,
} from "three";
import { colorOf, light } from "./colors.js";
import { coarseHeight, triangleUnder } from "./surface.js";

const ground = new MeshLambertMaterial({
  vertexColors: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
});
// Decks have no thickness, and are seen from below too.
const deck = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
// Roads and streams that are only lines lie on the ground as ribbons, which must not sink into it.
const ribbons = new MeshLambertMaterial({
  vertexColors: true, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: -3, polygonOffsetUnits: -3,
});
/** Metres that a ribbon is long at most, so that it follows the ground beside its line, and how far it lies above. */
const RIBBON_M_MAX = 12, RIBBON_LIFT_M = 0.15, RIBBON_WIDTH_M_MIN = 2;
// Unlit: a wall is no part of the ground, and should not show more than it must.
const walls = new MeshBasicMaterial({ vertexColors: true, side: DoubleSide, color: 0xb8b8b8 });
const cliffs = new MeshBasicMaterial({ vertexColors: true, color: 0xb8b8b8 });
const plain = new MeshLambertMaterial({ color: 0x6d6a5c });
const wires = new MeshBasicMaterial({ color: 0x10181c, wireframe: true, transparent: true, opacity: 0.4 });
const lines = new LineBasicMaterial({ color: 0xffe14d });

/** Corners of a surface's triangles, one after the other, as the renderer has them: each triangle is lit as one. */
function corners({ points, triangles }) {
  const out = new Float32Array(3 * triangles.length);
  triangles.forEach((vertex, i) => {
    const [east, north, height] = points.subarray(3 * vertex, 3 * vertex + 3);
    out.set([east, height, -north], 3 * i);
  });
  return out;
}

function geometryOf(positions, index) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("color", new BufferAttribute(new Float32Array(positions.length), 3));
  if (index) geometry.setIndex(new BufferAttribute(index, 1));
  return geometry;
}

/** A load module's surface, filled, with its edges beside it. */
export function moduleMesh(surface) {
  const geometry = geometryOf(corners(surface));
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  const mesh = new Mesh(geometry, ground);
  const edges = new Mesh(geometry, wires);
  mesh.add(edges);
  return { mesh, edges };
}

/** The decks of a load module, coloured by their classes. */
export function deckMesh(area, decks) {
  const geometry = geometryOf(corners(decks)), color = geometry.getAttribute("color");
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  for (let i = 0; i < decks.triangles.length; i++) {
    const of = colorOf.cover(area, decks.classes[Math.floor(i / 3)]) ?? colorOf.deck();
    color.array.set(light(of), 3 * i);
  }
  return new Mesh(geometry, deck);
}

/** Roads and streams of a load module that are lines of its TIN, as ribbons on the ground. */
export function roadMesh(area, roads, surface) {
  const positions = [], tints = [];
  const on = (east, north, height) =>
    [east, Math.max(height, triangleUnder(surface, east, north)?.height ?? height) + RIBBON_LIFT_M, -north];
  for (const { class: of, width, ends: [a, b] } of roads) {
    const run = b.map((to, axis) => to - a[axis]), length = Math.hypot(run[0], run[1]);
    if (length === 0) continue;
    const half = Math.max(width, RIBBON_WIDTH_M_MIN) / 2;
    const [right, up] = [(half * run[1]) / length, (-half * run[0]) / length];
    const across = (share) => {
      const [east, north, height] = a.map((from, axis) => from + share * run[axis]);
      return [on(east - right, north - up, height), on(east + right, north + up, height)];
    };
    const pieces = Math.ceil(length / RIBBON_M_MAX), tint = light(colorOf.cover(area, of) ?? colorOf.deck());
    for (let piece = 0; piece < pieces; piece++) {
      const [left, other] = across(piece / pieces), [farLeft, farOther] = across((piece + 1) / pieces);
      for (const corner of [left, other, farOther, left, farOther, farLeft]) {
        positions.push(...corner);
        tints.push(...tint);
      }
    }
  }
  const geometry = geometryOf(new Float32Array(positions));
  geometry.getAttribute("color").array.set(tints);
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  return new Mesh(geometry, ribbons);
}

/** Colours a load module's surface: its triangles, or the ground they were made from. */
export function paint(area, module, surface, mesh, colors) {
  const attribute = mesh.geometry.getAttribute("color");
  const figures = area.figures(module.row, module.col);
  const whole = { limits: figures.count, residuals: figures.rms }[colors];
  const one = whole === undefined ? undefined : light(colorOf[colors](area, whole));
  const byPost = colors === "residuals" && surface.residuals;
  const { points, residuals, triangles } = surface;
  const of = (v) => (byPost ? colorOf.residual(area, residuals[v]) : colorOf.height(area, points[3 * v + 2]));
  const own = byPost || !one ? Array.from({ length: points.length / 3 }, (_, vertex) => light(of(vertex))) : null;
  const covers = {};
  if (colors === "height" && surface === module.tin) {
    for (const of of new Set(module.classes)) {
      const color = colorOf.cover(area, of);
      if (color) covers[of] = light(color);
    }
  }
  const cover = (i) => covers[module.classes[Math.floor(i / 3)]];
  triangles.forEach((vertex, i) => attribute.array.set(cover(i) ?? (own ? own[vertex] : one), 3 * i));
  attribute.needsUpdate = true;
}

/** The whole area on its coarse grid; `cut` leaves out load modules that are drawn finely. */
export function coarseMesh(area) {
  const { wide, high, heights, classes } = area.coarse, step = area.side_m / area.coarse_steps;
  const positions = new Float32Array(3 * wide * high);
  for (let row = 0, i = 0; row < high; row++) {
    for (let col = 0; col < wide; col++, i++) {
      positions.set([area.sides[0] + col * step, heights[i], -(area.sides[1] + row * step)], 3 * i);
    }
  }
  const geometry = geometryOf(positions, new Uint32Array(6 * (wide - 1) * (high - 1)));
  const mesh = new Mesh(geometry, ground);
  mesh.frustumCulled = false;
  const color = geometry.getAttribute("color"), steps = area.coarse_steps;
  const repaint = (colors) => {
    for (let i = 0; i < wide * high; i++) {
      const [row, col] = [Math.floor(i / wide), i % wide].map((place) => Math.floor(place / steps));
      const figures = area.figures(Math.min(row, area.rows - 1), Math.min(col, area.cols - 1));
      const value = { limits: figures.count, residuals: figures.rms }[colors] ?? heights[i];
      const cover = colors === "height" ? colorOf.cover(area, classes[i]) : undefined;
      const found = cover ?? colorOf[colors](area, value);
      color.array.set(light(found), 3 * i);
    }
    color.needsUpdate = true;
  };
  const cut = (isFine) => {
    const index = geometry.index;
    let end = 0;
    for (let row = 0; row < area.rows; row++) {
      for (let col = 0; col < area.cols; col++) {
        if (isFine(row, col)) continue;
        for (let cell = 0; cell < steps * steps; cell++) {
          const at = (row * steps + Math.floor(cell / steps)) * wide + col * steps + (cell % steps);
          index.array.set([at, at + 1, at + wide + 1, at, at + wide + 1, at + wide], end);
          end += 6;
        }
      }
    }
    index.needsUpdate = true;
    geometry.setDrawRange(0, end);
  };
  cut(() => false);
  geometry.computeVertexNormals();
  return { mesh, repaint, cut };
}

/** A side of a load module (south, east, north, west) in coarse steps: where it begins, and which way it goes. */
function sideLine(area, { row, col }, side) {
  const steps = area.coarse_steps, [south, west] = [row * steps, col * steps];
  return [[south, west, 0, 1], [south, west + steps, 1, 0], [south + steps, west, 0, 1], [south, west, 1, 0]][side];
}

/** Upper and lower points of a wall along a side, from the surface's heights to `below(height, row, col)`. */
function wallAlong(area, module, surface, side, below) {
  const [row, col, up, right] = sideLine(area, module, side);
  const step = area.side_m / area.coarse_steps;
  const [south, west] = [area.sides[1] + row * step, area.sides[0] + col * step];
  const fine = Array.from(surface.sides[side], (vertex) => {
    const [east, north, height] = surface.points.subarray(3 * vertex, 3 * vertex + 3);
    return [right ? (east - west) / step : (north - south) / step, height];
  });
  // Where either of the two surfaces bends, the wall does.
  const bends = new Set([...fine.map(([at]) => at), ...Array(area.coarse_steps + 1).keys()]);
  let i = 0;
  return [...bends].sort((a, b) => a - b).map((at) => {
    while (i + 2 < fine.length && fine[i + 1][0] < at) i++;
    const [[from, low], [to, high]] = [fine[i], fine[i + 1]];
    const height = low + ((at - from) / (to - from)) * (high - low);
    const place = [row + at * up, col + at * right];
    return [west + at * right * step, south + at * up * step, height, below(height, ...place)];
  });
}

/** Walls, upright strips between an upper and a lower line, as one mesh. */
class Walls {
  constructor(area, material) {
    Object.assign(this, { area, material, positions: [], tints: [] });
  }

  /** Seen from in front, `wall` runs from left to right. */
  add(wall) {
    for (let i = 0; i + 1 < wall.length; i++) {
      const [[ax, ay, ah, al], [bx, by, bh, bl]] = [wall[i], wall[i + 1]];
      for (const [x, y, z] of [[ax, ay, ah], [ax, ay, al], [bx, by, bh], [bx, by, bh], [ax, ay, al], [bx, by, bl]]) {
        this.positions.push(x, z, -y);
        this.tints.push(...light(colorOf.height(this.area, z)));
      }
    }
  }

  mesh() {
    const geometry = geometryOf(new Float32Array(this.positions));
    geometry.getAttribute("color").array.set(this.tints);
    const mesh = new Mesh(geometry, this.material);
    mesh.frustumCulled = false;
    return mesh;
  }
}

/** North and west run from right to left for who stands outside. */
const outward = (wall, side) => (side < 2 ? wall : wall.reverse());

/** Walls that close what is open between fine and coarse load modules, and those along the border of the area. */
export function wallMeshes(area, drawn, base) {
  const [inner, border] = [new Walls(area, walls), new Walls(area, cliffs)];
  const isInside = (row, col) => 0 <= row && 0 <= col && row < area.rows && col < area.cols;
  // A little further than the other surface, against rounding.
  const onto = (height, row, col) => {
    const other = coarseHeight(area.coarse, row, col);
    return other + (other < height ? -2 : 2);
  };
  for (const { module, surface } of drawn.values()) {
    [[-1, 0], [0, 1], [1, 0], [0, -1]].forEach(([up, right], side) => {
      const [row, col] = [module.row + up, module.col + right];
      if (!isInside(row, col)) border.add(outward(wallAlong(area, module, surface, side, () => base), side));
      else if (!drawn.has(row * area.cols + col)) inner.add(wallAlong(area, module, surface, side, onto));
    });
  }
  addBorder(area, drawn, base, border);
  return [inner.mesh(), border.mesh()];
}

/** The walls of coarse load modules along the border of the area. */
function addBorder(area, drawn, base, border) {
  const { wide, heights } = area.coarse, steps = area.coarse_steps, step = area.side_m / steps;
  const wall = (row, col, side) => {
    if (drawn.has(row * area.cols + col)) return;
    const [south, west, up, right] = sideLine(area, { row, col }, side);
    border.add(outward(Array.from({ length: steps + 1 }, (_, at) => {
      const [r, c] = [south + at * up, west + at * right];
      return [area.sides[0] + c * step, area.sides[1] + r * step, heights[r * wide + c], base];
    }), side));
  };
  for (let col = 0; col < area.cols; col++) [wall(0, col, 0), wall(area.rows - 1, col, 2)];
  for (let row = 0; row < area.rows; row++) [wall(row, area.cols - 1, 1), wall(row, 0, 3)];
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
  const geometry = geometryOf(new Float32Array(positions));
  geometry.computeVertexNormals();
  const mesh = new Mesh(geometry, plain);
  mesh.frustumCulled = false;
  return mesh;
}

/** Lines between load modules, along their triangles. */
export function moduleLines(drawn) {
  const positions = [];
  for (const { surface } of drawn.values()) {
    for (const side of surface.sides) {
      for (let i = 0; i + 1 < side.length; i++) {
        for (const vertex of [side[i], side[i + 1]]) {
          const [east, north, up] = surface.points.subarray(3 * vertex, 3 * vertex + 3);
          positions.push(east, up + 0.3, -north);
        }
      }
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  const segments = new LineSegments(geometry, lines);
  segments.frustumCulled = false;
  return segments;
}
