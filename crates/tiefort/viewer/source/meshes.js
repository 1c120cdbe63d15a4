// From surfaces to what the renderer draws: east is x, up is y, south is z.
import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments, Mesh } from "three";
import { DISC, joined } from "./bands.js";
import { bytes, colorOf, GROUND, isWater, MADE, WATER } from "./colors.js";
import { draped, groundOf, liesOn } from "./drape.js";
import * as looks from "./materials.js";
import { isSea } from "./server.js";

/** Metres that ribbons lie above the ground, and how much more those of the first class do; how wide they are at least;
 * how far beside the middle is still the middle. */
const RIBBON_LIFT_M = 0.1, CLASSES_LIFT_M = 0.1, RIBBON_WIDTH_M_MIN = 2, MIDDLE_M = 0.02;
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

/** How far the ribbons of a class lie above the ground: where two cross, the class that comes first is on top. */
const liftOf = (area, ofClass) => RIBBON_LIFT_M + CLASSES_LIFT_M * (1 - Math.min(ofClass / area.classes.length, 1));
const halfOf = ({ width }) => Math.max(width, RIBBON_WIDTH_M_MIN) / 2;

/** Corners of ribbons that become one mesh. */
class Ribbons {
  constructor(area) {
    Object.assign(this, { area, positions: [], tints: [], asides: [] });
  }

  /** What a road puts here: a convex piece, corners [east, north, height], which lie beside its middle by `aside`. */
  of({ class: of }) {
    const lift = liftOf(this.area, of);
    // Too narrow to mirror anything: seen flat, a stream would glitter.
    const tint = [...bytes(colorOf.cover(this.area, of) ?? colorOf.deck()), MADE];
    const put = ([east, north, height], [right, up]) => {
      this.positions.push(east, height + lift, -north);
      this.tints.push(...tint);
      // South is z.
      this.asides.push(right, -up);
    };
    return (piece, aside) => {
      for (let i = 2; i < piece.length; i++) [0, i - 1, i].forEach((at) => put(piece[at], aside(piece[at])));
    };
  }

  get count() {
    return this.positions.length / 3;
  }

  mesh() {
    const geometry = geometryOf(new Float32Array(this.positions));
    geometry.getAttribute("tint").array.set(this.tints);
    geometry.setAttribute("aside", new BufferAttribute(new Float32Array(this.asides), 2));
    geometry.computeVertexNormals();
    geometry.computeBoundingSphere();
    return meshOf(geometry, looks.ribbons);
  }
}

/** How far beside the middle of a road a place lies; on it where rounding alone says otherwise. */
function asideOf({ ends: [a, b] }) {
  const [right, up] = [b[0] - a[0], b[1] - a[1]], length = Math.hypot(right, up) || 1;
  return ([east, north]) => {
    const left = ((north - a[1]) * right - (east - a[0]) * up) / length;
    return Math.abs(left) < MIDDLE_M ? [0, 0] : [(-up * left) / length, (right * left) / length];
  };
}

/** The height of a road's middle beside a place. */
function levelOf({ ends: [a, b] }) {
  const [right, up, rise] = a.map((from, axis) => b[axis] - from), square = right * right + up * up || 1;
  return ([x, y]) => a[2] + rise * Math.min(Math.max(((x - a[0]) * right + (y - a[1]) * up) / square, 0), 1);
}

/** The plans of a road's band, counter-clockwise: between its ends, and the discs there that join it to others. Each
 * with how far beside the middle a place lies, and how high that is. */
function plansOf(road, joints) {
  const half = halfOf(road), [a, b] = road.ends, [from, to] = joints, level = levelOf(road);
  const beside = ([east, north], [right, up], side) => [east + side * half * right, north + side * half * up];
  const along = [beside(a, from.left, -1), beside(b, to.left, -1), beside(b, to.left, 1), beside(a, from.left, 1)];
  const discs = [0, 1].filter((end) => joints[end].isDisc).map((end) => road.ends[end]);
  return [{ plan: along, aside: asideOf(road), level }, ...discs.map((end) => ({
    plan: DISC.map((corner) => beside(end, corner, 1)), aside: ([x, y]) => [x - end[0], y - end[1]], level,
  }))];
}

/** The band between a road's ends in plans of so many metres at most. */
function* piecesOf({ ends: [a, b] }, [right, farRight, farLeft, left], most) {
  const pieces = Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1]) / most);
  const at = (from, to, share) => from.map((start, axis) => start + share * (to[axis] - start));
  for (let piece = 0; piece < pieces; piece++) {
    const [near, far] = [piece / pieces, (piece + 1) / pieces];
    yield [at(right, farRight, near), at(right, farRight, far), at(left, farLeft, far), at(left, farLeft, near)];
  }
}

/** Roads and streams of a load module that are lines of its TIN, as ribbons cut along its triangles: level from side to
 * side, as high as their middle, but where the ground is higher. */
export function roadMesh(area, roads, surface) {
  const ribbons = new Ribbons(area), ground = groundOf(surface), joints = joined(roads, halfOf);
  roads.forEach((road, number) => {
    const put = ribbons.of(road);
    for (const { plan, aside, level } of plansOf(road, joints[number])) {
      const over = ([x, y, height]) => [x, y, Math.max(level([x, y]), height ?? -Infinity)];
      for (const piece of draped(ground, plan)) put(piece.map(over), aside);
      // The ground beyond the load module is another's.
      if (!liesOn(ground, plan)) put(plan.map(over), aside);
    }
  });
  return ribbons.mesh();
}

/** Roads and streams as ribbons in pieces of so many metres at most, at the heights that `on` gives places, and how
 * many corners each has: for ground that is far away, without discs. */
export function ribbonMesh(area, roads, most, on) {
  const ribbons = new Ribbons(area), joints = joined(roads, halfOf);
  const counts = roads.map((road, number) => {
    const put = ribbons.of(road), before = ribbons.count, [{ plan, aside }] = plansOf(road, joints[number]);
    for (const piece of piecesOf(road, plan, most)) put(piece.map(([x, y]) => [x, y, on(x, y)]), aside);
    return ribbons.count - before;
  });
  return { mesh: ribbons.mesh(), counts };
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
