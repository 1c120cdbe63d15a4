// Walls that close what is open between fine and coarse load modules, and those along the border of the area.
import { BufferAttribute } from "three";
import { bytes, colorOf, isWater, MADE, numbers } from "./colors.js";
import * as looks from "./materials.js";
import { geometryOf, meshOf, tintAt, tintOf } from "./meshes.js";
import { coarseHeight } from "./surface.js";

/** How far walls reach beyond the upper of the lines they stand between, as a part of their distance: a quarter of a
 * pixel, since some renderers place corners by a sixteenth only. Metres that they reach beyond the lower line, and
 * below the base. */
const LIP = 3e-4, FOOT_M = 2, BELOW_M = 10;

/** A side of a load module (south, east, north, west) in coarse steps: where it begins, and which way it goes. */
function sideLine(area, { row, col }, side) {
  const steps = area.coarse_steps, [south, west] = [row * steps, col * steps];
  return [[south, west, 0, 1], [south, west + steps, 1, 0], [south + steps, west, 0, 1], [south, west, 1, 0]][side];
}

/** The tint of water at a place of the coarse grid; null on land. */
function waterAt(area, row, col) {
  const { wide, classes } = area.coarse, ofClass = classes[Math.round(row) * wide + Math.round(col)];
  const cover = colorOf.cover(area, ofClass);
  return cover && isWater(area, ofClass) ? tintOf(area, ofClass, cover) : null;
}

/** Upper and lower points of a wall along a side, from the surface's heights to `below(height, row, col)`, with the
 * tint of water there. */
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
    return [west + at * right * step, south + at * up * step, height, below(height, ...place), waterAt(area, ...place)];
  });
}

/** Walls, upright strips between an upper and a lower line, as one mesh. What fills a gap is lit as level ground, so
 * that it is hardly seen; a cliff as the wall it is. */
class Walls {
  constructor(area, isCliff) {
    Object.assign(this, { area, isCliff, positions: [], tints: [] });
  }

  /** Seen from in front, `wall` runs from left to right. */
  add(wall) {
    for (let i = 0; i + 1 < wall.length; i++) {
      const [[ax, ay, ah, al, water], [bx, by, bh, bl, on]] = [wall[i], wall[i + 1]];
      for (const [x, y, z] of [[ax, ay, ah], [ax, ay, al], [bx, by, bh], [bx, by, bh], [ax, ay, al], [bx, by, bl]]) {
        this.positions.push(x, z, -y);
        this.tints.push(...(this.isCliff ? CLIFF(this.area) : (on && water) ?? tintAt(this.area, z)));
      }
    }
  }

  mesh() {
    const geometry = geometryOf(new Float32Array(this.positions));
    geometry.getAttribute("tint").array.set(this.tints);
    if (this.isCliff) geometry.computeVertexNormals();
    else geometry.setAttribute("normal", new BufferAttribute(upward(this.positions.length), 3));
    const mesh = meshOf(geometry, this.isCliff ? looks.cliffs : looks.walls);
    mesh.frustumCulled = false;
    return mesh;
  }
}

const CLIFF = (area) => [...bytes(numbers(area.palette.rock)), MADE];

function upward(count) {
  const normals = new Float32Array(count);
  for (let i = 1; i < count; i += 3) normals[i] = 1;
  return normals;
}

/** North and west run from right to left for who stands outside. */
const outward = (wall, side) => (side < 2 ? wall : wall.reverse());

/** From below the lower of two lines to above the upper one, so that the wall is whole where they cross: were its edges
 * to follow one line each, it would be narrowest somewhere beside the crossing, and leave open what lies between. Both
 * reach a little further, since a wall bends where either line does, and so, but for rounding, lies on the other. */
const between = (wall, lip) => wall.map(([east, north, one, other, water]) =>
  [east, north, Math.max(one, other) + lip, Math.min(one, other) - FOOT_M, water]);

/** Walls that close what is open between fine and coarse load modules, and those along the border of the area. */
export function wallMeshes(area, drawn, base) {
  const [inner, border] = [new Walls(area, false), new Walls(area, true)];
  const isInside = (row, col) => 0 <= row && 0 <= col && row < area.rows && col < area.cols;
  const onto = (_, row, col) => coarseHeight(area.coarse, row, col);
  // The level ground around the area meets the walls at the base; edges of different lengths do not quite meet.
  const foot = base - BELOW_M;
  // The observer stands in the middle of what is drawn finely.
  const lip = (LIP * Math.sqrt(drawn.size) * area.side_m) / 2;
  for (const { module, surface } of drawn.values()) {
    [[-1, 0], [0, 1], [1, 0], [0, -1]].forEach(([up, right], side) => {
      const [row, col] = [module.row + up, module.col + right];
      if (!isInside(row, col)) border.add(outward(wallAlong(area, module, surface, side, () => foot), side));
      else if (!drawn.has(row * area.cols + col)) inner.add(between(wallAlong(area, module, surface, side, onto), lip));
    });
  }
  addBorder(area, drawn, foot, border);
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

