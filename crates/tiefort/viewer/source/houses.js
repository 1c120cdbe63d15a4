// Buildings as blocks: read where the observer comes near, drawn the largest first, as far as each is seen. They are
// drawn only: no line of sight knows them.
import { Group } from "three";
import { Blocks } from "./blocks.js";
import { note } from "./panel.js";
import { answer } from "./server.js";

/** Load modules along the side of a part that is read and drawn at once. */
const PART = 4;
/** Metres within which parts are read, metres beyond which they go again, and parts that are on their way at most. */
const REACH_M = 5000, GONE_M = 6500, ASKED_MAX = 2;
/** How large a building is at least that is drawn, as a part of its distance: about two pixels. */
const SEEN = 1 / 400;
/** Metres that the observer goes before it is looked again which are drawn. */
const MOVE_M = 40;
/** How long after buildings could not be read they are asked for again. */
const AGAIN_MS = 5000;

export class Houses {
  constructor(area) {
    this.area = area;
    this.group = new Group();
    // By row of parts * 65536 + column: {mesh, ends, sizes, box}; null while it is on its way.
    this.parts = new Map();
    // Change with what is drawn, and with what has been read.
    this.version = this.stock = 0;
    // Where it was last looked which are drawn, whether to look again, and parts that are on their way.
    [this.at, this.lacks, this.waits] = [null, false, 0];
  }

  /** Whether they are shown. */
  show(isShown) {
    if (isShown === this.group.visible) return;
    this.group.visible = isShown;
    this.version += 1;
    this.stock += 1;
  }

  /** Follows the observer. */
  follow(east, north) {
    if (!this.area.buildings || !this.group.visible) return;
    const place = [east, north];
    if (this.at && !this.lacks && Math.hypot(...place.map((to, i) => to - this.at[i])) < MOVE_M) return;
    [this.at, this.lacks] = [place, false];
    for (const [key, part] of this.parts) {
      if (part && GONE_M < away(part.box, place)) this.drop(key, part);
    }
    this.ask(place);
    for (const part of this.parts.values()) if (part) this.cut(part, place);
  }

  /** Asks for the nearest parts that are missing. */
  ask(place) {
    const { rows, cols } = this.area, missing = [];
    for (let row = 0; PART * row < rows; row++) {
      for (let col = 0; PART * col < cols; col++) {
        const key = row * 65536 + col, far = away(this.boxOf(row, col), place);
        if (far < REACH_M && !this.parts.has(key)) missing.push([far, row, col, key]);
      }
    }
    missing.sort((a, b) => a[0] - b[0]);
    for (const [, row, col, key] of missing.slice(0, Math.max(ASKED_MAX - this.waits, 0))) this.load(row, col, key);
  }

  /** West, south, east and north of a part. */
  boxOf(row, col) {
    const { corner, side_m: side, rows, cols } = this.area;
    const end = [Math.min((col + 1) * PART, cols), Math.min((row + 1) * PART, rows)];
    return [(col * PART - corner[1]) * side, (row * PART - corner[0]) * side, (end[0] - corner[1]) * side,
      (end[1] - corner[0]) * side];
  }

  async load(row, col, key) {
    const { rows, cols } = this.area;
    const block = [row * PART, col * PART, Math.min((row + 1) * PART, rows), Math.min((col + 1) * PART, cols)];
    this.parts.set(key, null);
    this.waits += 1;
    try {
      const bytes = await (await answer(`/api/buildings/${block.join("/")}`)).arrayBuffer();
      const part = { ...partOf(this.area, bytes), box: this.boxOf(row, col) };
      this.parts.set(key, part);
      if (part.mesh) this.group.add(part.mesh);
      this.version += 1;
      this.stock += 1;
      this.lacks = true;
    } catch (fault) {
      note(`Buildings could not be read: ${fault.message}`);
      setTimeout(() => [this.parts.delete(key), (this.lacks = true)], AGAIN_MS);
    }
    this.waits -= 1;
  }

  drop(key, part) {
    this.parts.delete(key);
    this.version += 1;
    this.stock += 1;
    if (!part.mesh) return;
    this.group.remove(part.mesh);
    part.mesh.geometry.dispose();
  }

  /** Draws of a part those that are large enough at its distance: they come first. */
  cut({ mesh, box, sizes, ends }, place) {
    if (!mesh) return;
    const least = SEEN * away(box, place);
    let [low, high] = [0, sizes.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (sizes[middle] < least) high = middle;
      else low = middle + 1;
    }
    const end = low === 0 ? 0 : ends[low - 1];
    if (mesh.geometry.drawRange.count === end) return;
    mesh.geometry.setDrawRange(0, end);
    mesh.visible = 0 < end;
    mesh.userData.count = low;
    this.version += 1;
  }

  /** How many there are, have been read, and are drawn. */
  counts() {
    let [read, drawn] = [0, 0];
    for (const part of this.parts.values()) {
      read += part?.sizes.length ?? 0;
      drawn += part?.mesh && this.group.visible ? part.mesh.userData.count : 0;
    }
    return { all: this.area.buildings, read, drawn, waiting: this.waits };
  }
}

/** Metres on the map from a box to a place. */
function away([west, south, east, north], [x, y]) {
  return Math.hypot(Math.max(west - x, 0, x - east), Math.max(south - y, 0, y - north));
}

/** The blocks of an answer as one mesh, where each block's triangles end, and its size: load modules one after the
 * other have their largest first, and so has the whole. */
function partOf(area, bytes) {
  const words = new Uint32Array(bytes), metres = new Float32Array(bytes), all = [];
  for (let at = 0; at < words.length;) {
    const counts = words.subarray(at + 1, at + 1 + words[at]);
    at += 1 + words[at];
    const [floor, roof, size] = metres.subarray(at, at + 3), rings = [];
    at += 3;
    for (const count of counts) {
      rings.push(Array.from({ length: count }, (_, i) =>
        ({ x: metres[at + 2 * i] + area.sides[0], y: metres[at + 2 * i + 1] + area.sides[1] })));
      at += 2 * count;
    }
    all.push({ kind: "building", floor, roof, size, rings });
  }
  if (all.length === 0) return { mesh: null, sizes: [], ends: [] };
  all.sort((a, b) => b.size - a.size);
  const blocks = new Blocks(), ends = all.map((block) => {
    blocks.add(block);
    return blocks.end;
  });
  const mesh = blocks.mesh();
  mesh.userData.count = all.length;
  mesh.geometry.setDrawRange(0, blocks.end);
  return { mesh, ends, sizes: all.map(({ size }) => size) };
}
