// Woods, orchards and hedges: a layer of leaves that follows the ground at its height, with sides along its border.
// Near the observer trees stand in its place (trees.js).
import { BufferAttribute } from "three";
import { CASTS } from "./blocks.js";
import { MADE } from "./colors.js";
import { boxesOf, groundOf } from "./drape.js";
import * as looks from "./materials.js";
import { geometryOf, meshOf } from "./meshes.js";

/** Of single leaves, by kind. */
const LEAVES = { wood: [78, 104, 58], scrub: [116, 122, 76], orchard: [104, 128, 70], row: [80, 106, 58] };
/** Metres from which on a canopy has trees. */
const TREES_M = 3;
/** Where trees stand, the layer lies so much lower nearby; and where its underside is, which casts the shadow. */
const LOWER = 0.22, UNDERSIDE = 0.35;
/** The share of a triangle from which on it counts as covered. */
const WHOLE = 0.9999;

/** Whether trees stand in a canopy: hedges and vines are as dense as they are drawn. */
export const hasTrees = ({ kind, height }) => (kind === "row" ? 6 < height : TREES_M <= height);

/** The meshes of all canopies of a load module over its surface, of which the second is seen by the sun alone, and the
 * pieces that each canopy is made of: corners [east, north, height of the ground], counter-clockwise. */
export function canopyMeshes(canopies, box, surface) {
  const ground = groundOf(surface), [leaves, undersides] = [new Layer(), new Layer()];
  const pieces = canopies.map((canopy) => {
    const { height, kind } = canopy, tint = [...LEAVES[kind], MADE], border = borderOf(canopy, box), own = [];
    const isWood = hasTrees(canopy), low = isWood ? LOWER * height : 0;
    for (const { piece, normal } of over(ground, canopy)) {
      const places = piece.map(({ place }) => place);
      own.push(places);
      leaves.fan(places, height - low, low, isWood, normal, tint);
      undersides.fan([...places].reverse(), UNDERSIDE * height, 0, isWood, normal, tint);
      piece.forEach(({ place, side }, i) => {
        if (border.has(side)) leaves.side(place, places[(i + 1) % places.length], height - low, low, isWood, tint);
      });
    }
    return own;
  });
  const meshes = [leaves, undersides].filter(({ index }) => 0 < index.length).map((layer) => layer.mesh());
  meshes[0]?.layers.enable(CASTS);
  meshes[1]?.layers.set(CASTS);
  return { meshes, pieces };
}

/** Leaves that become one mesh. */
class Layer {
  constructor() {
    [this.positions, this.normals, this.tints, this.lifts, this.index] = [[], [], [], [], []];
  }

  put([east, north, up], above, lift, isWood, normal, tint) {
    this.positions.push(east, up + above, -north);
    this.normals.push(...normal);
    this.tints.push(...tint);
    this.lifts.push(lift, isWood ? 1 : 0);
    return this.positions.length / 3 - 1;
  }

  /** A piece so far above the ground. */
  fan(places, above, lift, isWood, normal, tint) {
    const corners = places.map((place) => this.put(place, above, lift, isWood, normal, tint));
    for (let i = 2; i < corners.length; i++) this.index.push(corners[0], corners[i - 1], corners[i]);
  }

  /** An upright strip from the ground. */
  side(a, b, above, lift, isWood, tint) {
    const [east, north] = [b[0] - a[0], b[1] - a[1]], length = Math.hypot(east, north) || 1;
    const normal = [north / length, 0, east / length];
    const [low, next] = [a, b].map((place) => this.put(place, 0, 0, isWood, normal, tint));
    const [high, far] = [a, b].map((place) => this.put(place, above, lift, isWood, normal, tint));
    this.index.push(low, next, far, low, far, high);
  }

  mesh() {
    const geometry = geometryOf(new Float32Array(this.positions), new Uint32Array(this.index));
    geometry.getAttribute("tint").array.set(this.tints);
    geometry.setAttribute("normal", new BufferAttribute(new Float32Array(this.normals), 3));
    geometry.setAttribute("lift", new BufferAttribute(new Float32Array(this.lifts), 2));
    geometry.computeBoundingSphere();
    return meshOf(geometry, looks.leaves);
  }
}

/** The sides of triangles that are no other triangle's, by their places in the list: where the canopy ends. What is cut
 * at the side of the load module goes on in the next. */
function borderOf({ corners, triangles }, [west, south, east, north]) {
  const end = (at) => triangles[at % 3 === 2 ? at - 2 : at + 1], known = new Set();
  triangles.forEach((from, at) => known.add(from * 65536 + end(at)));
  const isCut = (a, b) =>
    (a.x === b.x && (a.x === west || a.x === east)) || (a.y === b.y && (a.y === south || a.y === north));
  const border = new Set();
  triangles.forEach((from, at) => {
    if (!known.has(end(at) * 65536 + from) && !isCut(corners[from], corners[end(at)])) border.add(at);
  });
  return border;
}

/** The ground under a canopy in pieces, each inside one triangle of the surface; the whole triangle where all of it is
 * covered. Corners with the place of the canopy's side that the edge from each lies on, or -1. */
function* over({ points, triangles, boxes }, { corners, triangles: plan, box: [west, south, east, north] }) {
  const at = (axis) => (corner) => corners[plan[corner]][axis];
  const plans = boxesOf(plan.length / 3, at("x"), at("y"));
  for (let g = 0; g < boxes.length; g += 4) {
    const [left, low, right, top] = boxes.subarray(g, g + 4);
    if (east <= left || north <= low || right <= west || top <= south) continue;
    const vertices = [0, 1, 2].map((i) => 3 * triangles[(3 * g) / 4 + i]);
    const ground = vertices.map((vertex) => [...points.subarray(vertex, vertex + 3)]);
    const pieces = [];
    for (let p = 0; p < plans.length; p += 4) {
      if (right <= plans[p] || top <= plans[p + 1] || plans[p + 2] <= left || plans[p + 3] <= low) continue;
      const first = (3 * p) / 4, piece = clipped(ground, [0, 1, 2].map((i) => corners[plan[first + i]]), first);
      if (2 < piece.length) pieces.push(piece);
    }
    const covered = pieces.reduce((sum, piece) => sum + areaOf(piece.map(({ place }) => place)), 0);
    const whole = ground.map((place) => ({ place, side: -1 })), normal = normalOf(ground);
    for (const piece of areaOf(ground) * WHOLE <= covered ? [whole] : pieces) yield { piece, normal };
  }
}

/** The normal of a triangle as the renderer has it. */
function normalOf([a, b, c]) {
  const [u, v] = [b, c].map((to) => to.map((value, axis) => value - a[axis]));
  const cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const length = Math.hypot(...cross) || 1;
  return [cross[0] / length, cross[2] / length, -cross[1] / length];
}

function areaOf(places) {
  return places.reduce((sum, a, i) => {
    const b = places[(i + 1) % places.length];
    return sum + (a[0] * b[1] - a[1] * b[0]) / 2;
  }, 0);
}

/** What of a triangle [east, north, height] lies over one on the map, whose first side has a number. */
function clipped(corners, plan, first) {
  let piece = corners.map((place) => ({ place, side: -1 }));
  for (let side = 0; side < 3 && 0 < piece.length; side++) {
    const [a, b] = [plan[side], plan[(side + 1) % 3]], kept = [];
    const left = ({ place: [x, y] }) => (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
    const sides = piece.map(left);
    if (sides.every((here) => 0 <= here)) continue;
    piece.forEach((from, i) => {
      const to = piece[(i + 1) % piece.length], [here, there] = [sides[i], sides[(i + 1) % piece.length]];
      if (0 <= here) kept.push(from);
      if ((0 <= here) === (0 <= there)) return;
      const share = here / (here - there);
      const place = from.place.map((value, axis) => value + share * (to.place[axis] - value));
      kept.push({ place, side: 0 <= here ? first + side : from.side });
    });
    piece = kept;
  }
  return piece;
}
