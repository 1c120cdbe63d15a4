// From surfaces to what the renderer draws: east is x, up is y, south is z.
import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments, Mesh } from "three";
import { bytes, colorOf, GROUND, isWater, MADE, WATER } from "./colors.js";
import * as looks from "./materials.js";
import { isSea } from "./server.js";
import { triangleUnder } from "./surface.js";

/** Metres that a ribbon is long at most, so that it follows the ground beside its line, and how far it lies above. */
const RIBBON_M_MAX = 12, RIBBON_LIFT_M = 0.15, RIBBON_WIDTH_M_MIN = 2;
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

export function geometryOf(positions, index) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("tint", new BufferAttribute(new Uint8Array((4 * positions.length) / 3), 4, true));
  if (index) geometry.setIndex(new BufferAttribute(index, 1));
  return geometry;
}

export function meshOf(geometry, material) {
  const mesh = new Mesh(geometry, material);
  // Everything stands where it is.
  mesh.matrixAutoUpdate = false;
  return mesh;
}

/** A load module's surface. */
export function moduleMesh(surface, material = looks.fine) {
  const geometry = geometryOf(corners(surface));
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  return meshOf(geometry, material);
}

/** The decks of a load module, coloured by their classes. */
export function deckMesh(area, decks) {
  const geometry = geometryOf(corners(decks)), tint = geometry.getAttribute("tint");
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  for (let i = 0; i < decks.triangles.length; i++) {
    const of = colorOf.cover(area, decks.classes[Math.floor(i / 3)]) ?? colorOf.deck();
    tint.array.set([...bytes(of), MADE], 4 * i);
  }
  return meshOf(geometry, looks.decks);
}

/** Roads and streams of a load module that are lines of its TIN, as ribbons on the ground. */
export function roadMesh(area, roads, surface) {
  const on = (east, north, height) => Math.max(height, triangleUnder(surface, east, north)?.height ?? height);
  return ribbonMesh(area, roads, RIBBON_M_MAX, on).mesh;
}

/** Roads and streams as ribbons in pieces of so many metres at most, at the heights that `on` gives places, and how
 * many corners each has. */
export function ribbonMesh(area, roads, most, on) {
  const positions = [], tints = [], asides = [], counts = [];
  for (const { class: of, width, ends: [a, b] } of roads) {
    const run = b.map((to, axis) => to - a[axis]), length = Math.hypot(run[0], run[1]);
    counts.push(6 * Math.ceil(length / most));
    if (length === 0) continue;
    const half = Math.max(width, RIBBON_WIDTH_M_MIN) / 2;
    const [right, up] = [(half * run[1]) / length, (-half * run[0]) / length];
    const across = (share) => {
      const [east, north, height] = a.map((from, axis) => from + share * run[axis]);
      return [-1, 1].map((side) => {
        const [x, y] = [east + side * right, north + side * up];
        return [x, on(x, y, height) + RIBBON_LIFT_M, -y];
      });
    };
    // Too narrow to mirror anything: seen flat, a stream would glitter.
    const pieces = Math.ceil(length / most), tint = [...bytes(colorOf.cover(area, of) ?? colorOf.deck()), MADE];
    for (let piece = 0; piece < pieces; piece++) {
      const [left, other] = across(piece / pieces), [farLeft, farOther] = across((piece + 1) / pieces);
      [left, other, farOther, left, farOther, farLeft].forEach((corner, i) => {
        // South is z, and the first of a pair lies left of the line.
        const side = [-1, 1, 1, -1, 1, -1][i];
        positions.push(...corner);
        tints.push(...tint);
        asides.push(side * right, -side * up);
      });
    }
  }
  const geometry = geometryOf(new Float32Array(positions));
  geometry.getAttribute("tint").array.set(tints);
  geometry.setAttribute("aside", new BufferAttribute(new Float32Array(asides), 2));
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  return { mesh: meshOf(geometry, looks.ribbons), counts };
}

/** The tint of a class that has a colour of its own. */
export function tintOf(area, ofClass, color) {
  return [...bytes(color), isWater(area, ofClass) ? WATER : ofClass === area.hole ? GROUND : MADE];
}

/** Colours a load module's surface: its triangles, or the ground they were made from. */
export function paint(area, module, surface, mesh, colors) {
  const attribute = mesh.geometry.getAttribute("tint");
  const figures = area.figures(module.row, module.col);
  const whole = { limits: figures.count, residuals: figures.rms, levels: module.level }[colors];
  const one = whole === undefined ? null : [...bytes(colorOf[colors](area, whole)), MADE];
  const byPost = colors === "residuals" && surface.residuals;
  const { points, residuals, triangles } = surface;
  const of = (v) => (byPost ? [...bytes(colorOf.residual(area, residuals[v])), MADE] : tintAt(area, points[3 * v + 2]));
  const own = byPost || !one ? Array.from({ length: points.length / 3 }, (_, vertex) => of(vertex)) : null;
  const covers = {};
  if (!one && !byPost && surface === module.tin) {
    for (const of of new Set(module.classes)) {
      const color = colorOf.cover(area, of);
      if (color) covers[of] = tintOf(area, of, color);
    }
  }
  for (let t = 0; 3 * t < triangles.length; t++) {
    const three = triangles.subarray(3 * t, 3 * t + 3), isPlain = !one && !byPost;
    const heights = Array.from(three, (vertex) => points[3 * vertex + 2]);
    const cover = covers[module.classes[t]] ?? (isPlain && isSea(area, heights) ? seaTint(area) : undefined);
    three.forEach((vertex, i) => attribute.array.set(cover ?? (own ? own[vertex] : one), 4 * (3 * t + i)));
  }
  attribute.needsUpdate = true;
}

/** Plain ground at a height. */
export const tintAt = (area, height) => [...bytes(colorOf.height(area, height)), GROUND];

/** The tint of water without a class. */
export const seaTint = (area) => [...bytes(colorOf.sea(area)), WATER];

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
