// Blocks, as buildings and walls are drawn: upright walls with rows of windows, a level roof of another tone, or a
// gable where the roof is a rectangle.
import { BufferAttribute, ShapeUtils, Vector2 } from "three";
import { MADE } from "./colors.js";
import * as looks from "./materials.js";
import { geometryOf, meshOf } from "./meshes.js";

/** The layer of the camera of shadows. */
export const CASTS = 1;
/** Colours that walls and roofs have, by their place; and those of walls that stand alone. */
const WALLS = [[221, 211, 195], [208, 197, 183], [230, 222, 209], [200, 187, 171], [215, 204, 198]];
const ROOFS = [[150, 92, 72], [138, 128, 120], [164, 108, 82], [120, 112, 108], [146, 134, 122]];
const TOWERS = [[186, 182, 176], [172, 150, 138]], STONES = [[158, 150, 138], [146, 140, 132]];
/** Metres along a wall from window to window. */
const BAY_M = 3.2;
/** A roof that is at most so wide has a gable: how high that is as a part of its width, and metres and parts of the
 * block's height at most. */
const GABLE_M_MAX = 13, GABLE = 0.32, GABLE_HIGH_M = 3.5, GABLE_HIGH = 0.3;
/** How far a corner of a rectangle may be from a right angle, as its cosine. */
const SQUARE = 0.06;

/** Blocks that become one mesh; each is {kind, floor, roof, rings}, a ring being places with x and y, of which those
 * with `isOpen` begin no wall. */
export class Blocks {
  constructor() {
    [this.positions, this.tints, this.bays] = [[], [], []];
  }

  /** Corners of triangles up to here. */
  get end() {
    return this.positions.length / 3;
  }

  put(tint, bay, corners) {
    corners.forEach(([place, height, at = 0, below = -1]) => {
      this.positions.push(place.x, height, -place.y);
      this.tints.push(...tint, MADE);
      this.bays.push(bay * at, bay === 0 ? -1 : below);
    });
  }

  add({ kind, floor, roof, rings }) {
    // Neighbours differ, and a building always has the same.
    const { x, y } = rings[0][0], pick = (list) => list[Math.abs(Math.round(7 * x + 13 * y)) % list.length];
    const wall = pick({ tower: TOWERS, wall: STONES }[kind] ?? WALLS), top = kind === "building" ? pick(ROOFS) : wall;
    const gable = kind === "building" && rings.length === 1 ? gableOf(rings[0], roof - floor) : null;
    const eaves = roof - (gable?.high ?? 0);
    for (const ring of rings) {
      ring.forEach((a, i) => {
        if (a.isOpen) return;
        const b = ring[(i + 1) % ring.length], bays = Math.max(Math.round(Math.hypot(b.x - a.x, b.y - a.y) / BAY_M), 1);
        const [low, high] = [eaves - floor, 0];
        this.put(wall, kind === "building" ? bays : 0, [[a, floor, 0, low], [b, floor, 1, low], [b, eaves, 1, high],
          [a, floor, 0, low], [b, eaves, 1, high], [a, eaves, 0, high]]);
      });
    }
    if (gable) return this.roofOver(rings[0], gable, eaves, roof, wall, top);
    const corners = rings.flat(), [outer, ...yards] = rings.map((ring) => ring.map(({ x, y }) => new Vector2(x, y)));
    for (const [a, b, c] of ShapeUtils.triangulateShape(outer, yards)) {
      const isLeft = 0 < (corners[b].x - corners[a].x) * (corners[c].y - corners[a].y)
        - (corners[b].y - corners[a].y) * (corners[c].x - corners[a].x);
      const face = (isLeft ? [a, b, c] : [a, c, b]).map((corner) => corners[corner]);
      this.put(top, 0, face.map((place) => [place, roof]));
      this.put(wall, 0, face.reverse().map((place) => [place, floor]));
    }
  }

  /** Two slopes and two gables; the ridge runs along the longer sides. */
  roofOver(ring, { first }, eaves, roof, wall, top) {
    const [a, b, c, d] = [0, 1, 2, 3].map((i) => ring[(first + i) % 4]);
    const between = (from, to) => ({ x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 });
    const [left, right] = [between(d, a), between(b, c)];
    for (const [from, to, near, far] of [[a, b, right, left], [c, d, left, right]]) {
      this.put(top, 0, [[from, eaves], [to, eaves], [near, roof], [from, eaves], [near, roof], [far, roof]]);
    }
    this.put(wall, 0, [[b, eaves], [c, eaves], [right, roof], [d, eaves], [a, eaves], [left, roof]]);
  }

  /** All of them; null where there are none. */
  mesh() {
    if (this.end === 0) return null;
    const geometry = geometryOf(new Float32Array(this.positions));
    geometry.getAttribute("tint").array.set(this.tints);
    geometry.setAttribute("bay", new BufferAttribute(new Float32Array(this.bays), 2));
    geometry.computeVertexNormals();
    geometry.computeBoundingSphere();
    const mesh = meshOf(geometry, looks.blocks);
    mesh.layers.enable(CASTS);
    return mesh;
  }
}

/** The gable of a roof: how high it is, and the corner where a longer side begins; null where it has none. */
function gableOf(ring, high) {
  if (ring.length !== 4 || ring.some(({ isOpen }) => isOpen)) return null;
  const sides = ring.map((a, i) => {
    const b = ring[(i + 1) % 4];
    return [b.x - a.x, b.y - a.y];
  });
  const long = sides.map((side) => Math.hypot(...side));
  const isSquare = sides.every(([x, y], i) => {
    const [u, v] = sides[(i + 1) % 4];
    return Math.abs(x * u + y * v) < SQUARE * long[i] * long[(i + 1) % 4];
  });
  const first = long[0] < long[1] ? 1 : 0, wide = long[1 - first];
  if (!isSquare || GABLE_M_MAX < wide) return null;
  return { first, high: Math.min(GABLE * wide, GABLE_HIGH_M, GABLE_HIGH * high) };
}
