// Trees near the observer: trunks and crowns of one form, drawn many times, in the canopies that they make up.
import { BufferAttribute, Group, InstancedBufferAttribute, InstancedBufferGeometry, Mesh } from "three";
import { hasTrees } from "./canopies.js";
import { MADE } from "./colors.js";
import * as looks from "./materials.js";

/** Metres within which trees are drawn, and within which each is: beyond, every fourth stands for those around it. */
const REACH_M = 600, ALL_M = 150;
/** The same as a part of that where there is no graphics hardware. */
const SOFT = 0.3;
/** Metres that the observer goes before it is looked again which are drawn. */
const MOVE_M = 25;
/** Trees of one load module at most. */
const MODULE_MAX = 40_000;
/** Metres between trees of a row, and of others at least. */
const ROW_M = 5, TREE_M = 4;
/** Share of woods that are firs, firs and others, others. */
const FIRS = [0.3, 0.6];

export class Trees {
  constructor(isSoft) {
    this.reach = (isSoft ? SOFT : 1) * REACH_M;
    this.all = (isSoft ? SOFT : 1) * ALL_M;
    looks.setLeaves(0.7 * this.all, this.all, this.reach);
    this.group = new Group();
    this.form = formOf();
    // Those of load modules that are near, by key: {stands, trees, mesh}.
    this.near = new Map();
    [this.at, this.stock, this.version, this.count] = [null, null, 0, 0];
  }

  /** Follows the observer; `stock` changes with the load modules of `terrain`. */
  follow(terrain, east, north) {
    const stays = this.at && Math.hypot(east - this.at[0], north - this.at[1]) < MOVE_M, seen = new Set();
    if (stays && this.stock === terrain.stock) return;
    if (!stays) this.at = [east, north];
    this.stock = terrain.stock;
    this.count = 0;
    for (const [key, { stands }] of terrain.showsObjects ? terrain.drawn : []) {
      if (!stands?.canopies.some(hasTrees) || this.reach < away(stands.box, east, north)) continue;
      seen.add(key);
      if (this.near.get(key)?.stands !== stands) {
        this.drop(key);
        this.near.set(key, { stands, trees: treesOf(stands), mesh: null, count: null });
      }
      const module = this.near.get(key);
      if (!stays || module.count === null) this.choose(module, east, north);
      this.count += module.count;
    }
    for (const key of [...this.near.keys()]) if (!seen.has(key)) this.drop(key);
  }

  drop(key) {
    if (this.near.has(key)) this.clear(this.near.get(key));
    this.near.delete(key);
  }

  clear(module) {
    this.version += 1;
    if (!module.mesh) return;
    const { geometry } = module.mesh;
    this.group.remove(module.mesh);
    // The form is that of all others, too.
    Object.keys(this.form.attributes).forEach((name) => geometry.deleteAttribute(name));
    geometry.setIndex(null);
    geometry.dispose();
    module.mesh = null;
  }

  /** Draws the trees of a load module that are near enough. */
  choose(module, east, north) {
    const { trees } = module, chosen = [];
    for (let at = 0; at < trees.length; at += 8) {
      const far = Math.hypot(trees[at] - east, trees[at + 1] - north);
      if (far < this.all || (far < this.reach && trees[at + 7] === 0)) chosen.push(at);
    }
    this.clear(module);
    module.count = chosen.length;
    if (chosen.length === 0) return;
    const geometry = new InstancedBufferGeometry();
    const [stand, shape] = [0, 1].map(() => new Float32Array(4 * chosen.length));
    chosen.forEach((at, i) => {
      stand.set([trees[at], trees[at + 2], -trees[at + 1], trees[at + 3]], 4 * i);
      shape.set([trees[at + 4], trees[at + 5], trees[at + 6], trees[at + 7]], 4 * i);
    });
    for (const [name, attribute] of Object.entries(this.form.attributes)) geometry.setAttribute(name, attribute);
    geometry.setIndex(this.form.index);
    geometry.setAttribute("stand", new InstancedBufferAttribute(stand, 4));
    geometry.setAttribute("shape", new InstancedBufferAttribute(shape, 4));
    geometry.instanceCount = chosen.length;
    geometry.boundingSphere = sphereOf(module.stands);
    module.mesh = new Mesh(geometry, looks.trees);
    module.mesh.matrixAutoUpdate = false;
    this.group.add(module.mesh);
  }
}

/** Metres on the map from a box to a place. */
function away([west, south, east, north], x, y) {
  return Math.hypot(Math.max(west - x, 0, x - east), Math.max(south - y, 0, y - north));
}

/** A number from 0 to 1 for two whole ones, always the same. */
function hashed(a, b) {
  let state = (Math.imul(a, 374761393) + Math.imul(b, 668265263)) | 0;
  state = Math.imul(state ^ (state >>> 13), 1274126177);
  return ((state ^ (state >>> 16)) >>> 0) / 4294967296;
}

/** The trees of a load module, eight numbers each: east, north, height of the ground, its own height, width, shade, how
 * much of a fir it is, and 0 for those that are seen from afar. They stand on one lattice for the whole area, each a
 * little beside its place. */
function treesOf({ canopies, pieces }) {
  const trees = [];
  canopies.forEach((canopy, i) => {
    if (!hasTrees(canopy)) return;
    const { kind, height, id } = canopy, step = kind === "row" ? ROW_M : Math.max(canopy.spacing, TREE_M);
    const kinds = hashed(id & 0xffff, 7), fir = kind !== "wood" ? 0 : kinds < FIRS[0] ? 1 : kinds < FIRS[1] ? 0.5 : 0;
    for (const piece of pieces[i]) {
      for (const [col, row, east, north, ground] of lattice(piece, step)) {
        if (8 * MODULE_MAX <= trees.length) return;
        const own = hashed(row, 3 * col + 1), isFir = hashed(col, 5 * row + 2) < fir ? 1 : 0;
        trees.push(east, north, ground, height * (0.78 + 0.27 * own), step * (isFir ? 0.95 : 1.3) * (0.8 + 0.4 * own),
          0.8 + 0.4 * hashed(col + 11, row), isFir, (col & 1) | (row & 1));
      }
    }
  });
  return new Float32Array(trees);
}

/** Places of a lattice, each moved a little, inside a piece of ground. */
function* lattice(piece, step) {
  const [xs, ys] = [0, 1].map((axis) => piece.map((place) => place[axis]));
  const [a, b, c] = piece, [ux, uy, vx, vy] = [b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]];
  const area = ux * vy - uy * vx;
  if (area <= 1e-3) return;
  const [uz, vz] = [b[2] - a[2], c[2] - a[2]], [rise, climb] = [(uz * vy - vz * uy) / area, (vz * ux - uz * vx) / area];
  const aside = (one, other) => 0.5 + 0.8 * (hashed(one, other) - 0.5);
  for (let row = Math.floor(Math.min(...ys) / step) - 1; row <= Math.ceil(Math.max(...ys) / step); row++) {
    for (let col = Math.floor(Math.min(...xs) / step) - 1; col <= Math.ceil(Math.max(...xs) / step); col++) {
      const [x, y] = [(col + aside(col, row)) * step, (row + aside(row, col + 9)) * step];
      const isIn = piece.every((from, i) => {
        const to = piece[(i + 1) % piece.length];
        return 0 <= (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0]);
      });
      if (isIn) yield [col, row, x, y, a[2] + rise * (x - a[0]) + climb * (y - a[1])];
    }
  }
}

function sphereOf({ leaves }) {
  const sphere = leaves[0].geometry.boundingSphere.clone();
  sphere.radius += 20;
  return sphere;
}

/** A tree 1 m high and, without its trunk, 1 m wide: corners of a round crown, and where they are on a fir. */
function formOf() {
  const sides = 5, round = [], pointed = [], tints = [], index = [];
  const ring = (count, [wide, up], [firWide, firUp], tint) => {
    const first = round.length / 3;
    for (let i = 0; i < count; i++) {
      const [sin, cos] = [Math.sin((2 * Math.PI * i) / count), Math.cos((2 * Math.PI * i) / count)];
      round.push(0.5 * wide * cos, up, 0.5 * wide * sin);
      pointed.push(0.5 * firWide * cos, firUp, 0.5 * firWide * sin);
      tints.push(...tint, MADE);
    }
    return first;
  };
  const join = (low, high, count) => {
    for (let i = 0; i < count; i++) {
      const next = (i + 1) % count;
      index.push(low + i, high + i, low + next, low + next, high + i, high + next);
    }
  };
  const trunk = [88, 72, 56], dark = [52, 72, 42], leaf = [88, 114, 62];
  join(ring(4, [0.16, -0.05], [0.12, -0.05], trunk), ring(4, [0.1, 0.5], [0.06, 0.5], trunk), 4);
  const rings = [
    [[0.3, 0.28], [0.9, 0.16], dark], [[0.95, 0.45], [0.72, 0.34], leaf], [[0.9, 0.75], [0.36, 0.66], leaf],
    [[0.12, 1], [0.02, 1], leaf],
  ].map((each) => ring(sides, ...each));
  rings.slice(1).forEach((high, i) => join(rings[i], high, sides));
  const attributes = {
    position: new BufferAttribute(new Float32Array(round), 3),
    pointed: new BufferAttribute(new Float32Array(pointed), 3),
    tint: new BufferAttribute(new Uint8Array(tints), 4, true),
  };
  return { attributes, index: new BufferAttribute(new Uint16Array(index), 1) };
}
