// The block of load modules around the observer: loaded, drawn, dropped; around it load modules at coarser levels of
// detail, where the database has them; beyond these the area as it is coarsely.
import { Frustum, Group, Matrix4 } from "three";
import { Blocks } from "./blocks.js";
import { canopyMeshes } from "./canopies.js";
import { apron, Coarse } from "./coarse.js";
import * as looks from "./materials.js";
import { deckMesh, moduleLines, moduleMesh, paint, roadMesh } from "./meshes.js";
import { metAt } from "./objects.js";
import { checkDem, readLines, readModules, readPosts } from "./server.js";
import { deckUnder, triangleUnder } from "./surface.js";
import { wallMeshes } from "./walls.js";

/** Metres from the middle of the area to where nothing is any more. */
const APRON_M = 400_000;
/** How much further each coarser level reaches than the one before, as a part of the visible range. */
const RING = 0.5;
/** Load modules that the server gives at once. */
const MODULES_MAX = 1024;
/** How long after load modules could not be read they are asked for again. */
const AGAIN_MS = 2000;
/** Milliseconds of a picture that load modules which have come may take. */
const DRAW_MS = 7;

export class Terrain {
  constructor(area) {
    this.area = area;
    this.group = new Group();
    // By row * cols + col: {module, surface, mesh, beside, decks, roads, stands}. Levels that differ fit together, so
    // that a load module stays until the one in its place has come.
    this.drawn = new Map();
    this.colors = "height";
    this.withLines = this.withDem = false;
    // For each level the half-open block within which load modules are at least that fine.
    this.blocks = [];
    this.lacks = false;
    this.asked = new Set();
    // What has come and is not drawn yet, the nearest to the observer first.
    this.came = [];
    this.at = [0, 0];
    this.fault = null;
    // Change with what is drawn, and with what stands on it.
    this.version = this.stock = 0;
    this.showsObjects = true;
    // Objects that are drawn: how many load modules have each, by its id.
    this.ids = new Map();
    this.coarse = new Coarse(area);
    this.base = area.hasSea ? Math.min(area.height_m[0], 0) - 1 : area.height_m[0] - 20;
    this.group.add(this.coarse.group, apron(area, this.base, APRON_M));
    this.closed();
  }

  /** The half-open block of load modules within `range` of a place. */
  blockAround(east, north, range) {
    const { area } = this, reach = Math.ceil(range / area.side_m), [row, col] = area.moduleAt(east, north);
    const clamp = (value, end) => Math.min(Math.max(value, 0), end);
    return [clamp(row - reach, area.rows), clamp(col - reach, area.cols), clamp(row + reach + 1, area.rows),
      clamp(col + reach + 1, area.cols)];
  }

  /** The block of the finest level; null before anything was asked for. */
  get block() {
    return this.blocks[0] ?? null;
  }

  /** Draws what has come, as much of it as one picture may wait for. */
  drawSome() {
    if (this.came.length === 0) return;
    const end = performance.now() + DRAW_MS;
    while (0 < this.came.length && performance.now() < end) {
      const module = this.came.shift(), key = module.row * this.area.cols + module.col;
      this.asked.delete(this.askedKey(key, module.level));
      if (this.levelOf(key) === module.level) this.draw(key, module);
    }
    this.closed();
  }

  /** Follows the observer: drops what is out of range, asks for what is missing. */
  follow(east, north, range) {
    this.coarse.follow(east, north);
    // The DEM has one level, and would not fit to coarser load modules.
    const levels = this.withDem ? 1 : this.area.levels;
    this.at = this.area.moduleAt(east, north);
    const blocks = Array.from({ length: levels }, (_, level) =>
      this.blockAround(east, north, range * (1 + RING * level)));
    if (!this.lacks && String(blocks) === String(this.blocks)) return;
    [this.blocks, this.lacks] = [blocks, false];
    let dropped = false;
    for (const key of this.drawn.keys()) {
      if (this.levelOf(key) === -1) dropped = this.drop(key) || dropped;
    }
    if (dropped) this.closed();
    this.loadMissing();
  }

  /** The level at which a load module is wanted; -1 when it is not. */
  levelOf(key) {
    const [row, col] = [Math.floor(key / this.area.cols), key % this.area.cols];
    return this.blocks.findIndex(([south, west, north, east]) =>
      south <= row && row < north && west <= col && col < east);
  }

  loadMissing() {
    for (let level = 0; level < this.blocks.length; level++) {
      const away = (part) => this.away(part);
      for (const part of this.missing(level).sort((a, b) => away(a) - away(b))) this.load(part, level);
    }
  }

  /** How many load modules a rectangle of them lies from the observer. */
  away([south, west, north, east]) {
    const [row, col] = this.at;
    return Math.hypot(Math.max(south - row, 0, row + 1 - north), Math.max(west - col, 0, col + 1 - east));
  }

  /** What stands for a load module on its way. */
  askedKey(key, level) {
    return key + level * this.area.rows * this.area.cols;
  }

  /** Load modules that are wanted at a level and neither here nor on their way, as rectangles. */
  missing(level) {
    const [south, west, north, east] = this.blocks[level], parts = [];
    const lacks = (row, col) => {
      const key = row * this.area.cols + col;
      return this.levelOf(key) === level && this.drawn.get(key)?.module.level !== level
        && !this.asked.has(this.askedKey(key, level));
    };
    for (let row = south; row < north; row++) {
      for (let col = west; col < east; col++) {
        if (!lacks(row, col)) continue;
        const start = col;
        while (col < east && lacks(row, col)) col++;
        const fits = ([south, west, , east]) => (row + 1 - south) * (east - west) <= MODULES_MAX;
        const below = parts.find((part) => part[1] === start && part[3] === col && part[2] === row && fits(part));
        if (below) below[2]++;
        else parts.push([row, start, row + 1, col]);
      }
    }
    return parts;
  }

  async load(part, level) {
    const [south, west, north, east] = part, keys = [];
    for (let row = south; row < north; row++) {
      for (let col = west; col < east; col++) keys.push(this.askedKey(row * this.area.cols + col, level));
    }
    keys.forEach((key) => this.asked.add(key));
    try {
      const modules = await readModules(this.area, part, level);
      if (this.withDem && level === 0) await readPosts(this.area, part, modules);
      if (this.area.has_lines) await readLines(this.area, part, modules);
      const away = ({ row, col }) => this.away([row, col, row + 1, col + 1]);
      this.came = [...this.came, ...modules].sort((a, b) => away(a) - away(b));
      this.fault = null;
    } catch (fault) {
      // What was not loaded stays coarse; the page says so, and asks again.
      keys.forEach((key) => this.asked.delete(key));
      this.fault = fault.message;
      setTimeout(() => (this.lacks = true), AGAIN_MS);
    }
  }

  draw(key, module) {
    this.drop(key);
    const surface = (this.withDem && module.dem) || module.tin;
    const isSplit = surface !== module.tin;
    const mesh = moduleMesh(surface, isSplit ? looks.sides[1] : looks.fine);
    paint(this.area, module, surface, mesh, this.colors);
    // Left of the line are the triangles that were made from it.
    const beside = isSplit ? moduleMesh(module.tin, looks.sides[0]) : null;
    if (beside) {
      paint(this.area, module, module.tin, beside, this.colors);
      mesh.add(beside);
    }
    mesh.userData.key = key;
    this.group.add(mesh);
    // The DEM knows no decks.
    const decks = module.decks && surface === module.tin ? deckMesh(this.area, module.decks) : null;
    if (decks) mesh.add(decks);
    if (decks) decks.userData.deckOf = key;
    const roads = module.lines ? roadMesh(this.area, module.lines, surface) : null;
    if (roads) mesh.add(roads);
    const stands = module.objects ? this.stand(module.objects, surface) : null;
    if (stands) mesh.add(...stands.meshes);
    this.drawn.set(key, { module, surface, mesh, beside, decks, roads, stands });
  }

  /** Lets the objects of a load module stand on its surface. */
  stand({ prisms, canopies, box }, surface) {
    const blocks = new Blocks();
    prisms.forEach((prism) => blocks.add(prism));
    const { meshes: leaves, pieces } = canopyMeshes(canopies, box, surface);
    const block = blocks.mesh(), meshes = [block, ...leaves].filter(Boolean);
    meshes.forEach((each) => (each.visible = this.showsObjects));
    for (const { id } of [...prisms, ...canopies]) this.ids.set(id, (this.ids.get(id) ?? 0) + 1);
    this.stock += 1;
    return { prisms, canopies, box, pieces, leaves, meshes, block };
  }

  /** Objects of a load module go. */
  fell({ prisms, canopies, meshes }) {
    meshes.forEach(({ geometry }) => geometry.dispose());
    for (const { id } of [...prisms, ...canopies]) {
      const left = this.ids.get(id) - 1;
      if (left === 0) this.ids.delete(id);
      else this.ids.set(id, left);
    }
    this.stock += 1;
  }

  /** Whether objects are shown. */
  showObjects(isShown) {
    if (isShown === this.showsObjects) return;
    this.showsObjects = isShown;
    [this.version, this.stock] = [this.version + 1, this.stock + 1];
    for (const { stands } of this.drawn.values()) stands?.meshes.forEach((mesh) => (mesh.visible = isShown));
  }

  /** How many objects there are, and how many of them are drawn. */
  counts() {
    const all = Object.values(this.area.objects).reduce((sum, count) => sum + count, 0);
    return { all, drawn: this.showsObjects ? this.ids.size : 0 };
  }

  /** What a vehicle meets at a place: the kind of a block within a radius that reaches from `low` to `high`, and the
   * woods over its middle. */
  met(east, north, radius, low, high) {
    const found = { prism: null, woods: [] }, keys = new Set();
    for (const [x, y] of [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) {
      const [row, col] = this.area.moduleAt(east + radius * x, north + radius * y);
      if (0 <= row && 0 <= col && col < this.area.cols) keys.add(row * this.area.cols + col);
    }
    for (const key of keys) {
      const objects = this.drawn.get(key)?.module.objects;
      if (!objects) continue;
      const { prism, woods } = metAt(objects, east, north, radius, low, high);
      found.prism ??= prism;
      found.woods.push(...woods);
    }
    return found;
  }

  drop(key) {
    const old = this.drawn.get(key);
    if (!old) return false;
    this.group.remove(old.mesh);
    old.mesh.geometry.dispose();
    old.beside?.geometry.dispose();
    old.decks?.geometry.dispose();
    old.roads?.geometry.dispose();
    if (old.stands) this.fell(old.stands);
    return this.drawn.delete(key);
  }

  /** Makes the surface whole again after load modules came or went. */
  closed() {
    const { area, group } = this;
    this.version += 1;
    for (const old of [...(this.walls ?? []), this.lines].filter(Boolean)) {
      group.remove(old);
      old.geometry.dispose();
    }
    this.coarse.cut((row, col) => this.drawn.has(row * area.cols + col));
    this.walls = wallMeshes(area, this.drawn, this.base);
    this.lines = this.withLines ? moduleLines(this.drawn) : null;
    group.add(...[...this.walls, this.lines].filter(Boolean));
  }

  show({ colors, lines }) {
    if (lines !== this.withLines) {
      this.withLines = lines;
      this.closed();
    }
    if (colors !== this.colors) {
      this.colors = colors;
      this.repaint();
    }
  }

  repaint() {
    this.version += 1;
    this.coarse.repaint(this.colors);
    for (const { module, surface, mesh, beside } of this.drawn.values()) {
      paint(this.area, module, surface, mesh, this.colors);
      if (beside) paint(this.area, module, module.tin, beside, this.colors);
    }
  }

  /** Shows the DEM, or the triangles again. Fails where the DEM cannot be read; then nothing has changed. */
  async showDem(wanted) {
    if (wanted) await checkDem();
    const modules = [...this.drawn.values()].map(({ module }) => module).filter((module) => module.level === 0);
    if (wanted && modules.some((module) => !module.dem)) {
      const rows = modules.map((module) => module.row), cols = modules.map((module) => module.col);
      const part = [Math.min(...rows), Math.min(...cols), Math.max(...rows) + 1, Math.max(...cols) + 1];
      await readPosts(this.area, part, modules);
    }
    // What came meanwhile came without, or with.
    for (const module of this.came.splice(0)) {
      this.asked.delete(this.askedKey(module.row * this.area.cols + module.col, module.level));
    }
    this.withDem = wanted;
    // Coarser levels go, or come again.
    this.lacks = true;
    if (wanted) this.blocks = this.blocks.slice(0, 1);
    for (const key of [...this.drawn.keys()]) {
      if (this.levelOf(key) !== this.drawn.get(key).module.level) this.drop(key);
    }
    for (const module of modules) {
      const key = module.row * this.area.cols + module.col;
      if (this.drawn.has(key)) this.draw(key, module);
    }
    // What came meanwhile came without.
    if (wanted) {
      for (const [key, { module }] of this.drawn) if (!module.dem) this.drop(key);
      this.loadMissing();
    }
    this.closed();
  }

  /** What is drawn at a place: load module, triangle, height, normal; null where nothing fine is loaded. It is the
   * topmost of ground and decks that is not above `ceiling`, and the ground where all is. */
  under(east, north, ceiling = Infinity) {
    const [west, south, far, top] = this.area.sides;
    const inside = [Math.min(Math.max(east, west), far - 1e-3), Math.min(Math.max(north, south), top - 1e-3)];
    const [row, col] = this.area.moduleAt(...inside);
    const found = this.drawn.get(row * this.area.cols + col);
    const triangle = found && triangleUnder(found.surface, ...inside);
    if (!triangle) return null;
    const deck = found.decks && deckUnder(found.module.decks, ...inside, ceiling);
    const isDeck = deck !== null && triangle.height <= deck.height;
    return { ...found, ...(isDeck ? deck : triangle), isDeck };
  }

  /** How high a place lies above the ground, however many decks are between. */
  aboveGround(east, north, height) {
    const ground = this.under(east, north, -Infinity);
    return ground ? Math.max(height - ground.height, 0) : 0;
  }

  count(module) {
    return module.counts[this.area.limits.count];
  }

  /** Load modules and triangles that the camera sees within its range. */
  inView(camera, east, north, range) {
    const frustum = new Frustum().setFromProjectionMatrix(
      new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
    const { area } = this, side = area.side_m;
    let [modules, triangles] = [0, 0];
    for (const { module, surface, mesh } of this.drawn.values()) {
      const [west, south] = [(module.col - area.corner[1]) * side, (module.row - area.corner[0]) * side];
      const away = [Math.max(west - east, 0, east - west - side), Math.max(south - north, 0, north - south - side)];
      if (range < Math.hypot(...away) || !frustum.intersectsObject(mesh)) continue;
      modules += 1;
      triangles += surface === module.tin ? module.counts.triangles : surface.triangles.length / 3;
    }
    return { modules, triangles };
  }

  /** Load modules at their finest level, by key. */
  fine() {
    return new Map([...this.drawn].filter(([, { module }]) => module.level === 0));
  }

  /** Triangles of all that is loaded at the finest level, the count of its fullest whole window, if it holds one, and
   * load modules and triangles at coarser levels. */
  loaded() {
    const { area } = this, drawn = this.fine(), { rows, cols } = area.limits.window;
    let triangles = 0, fullest = null;
    const coarser = { modules: this.drawn.size - drawn.size, triangles: 0 };
    for (const { module } of this.drawn.values()) {
      if (module.level === 0) triangles += module.counts.triangles;
      else coarser.triangles += module.counts.triangles;
    }
    if (!this.block) return { modules: 0, triangles, fullest, coarser };
    const [south, west, north, east] = this.block;
    for (let row = south; row + rows <= north; row++) {
      for (let col = west; col + cols <= east; col++) {
        let sum = 0;
        for (let cell = 0; cell < rows * cols; cell++) {
          const found = drawn.get((row + Math.floor(cell / cols)) * area.cols + col + (cell % cols));
          sum += found ? this.count(found.module) : 0;
        }
        fullest = Math.max(fullest ?? 0, sum);
      }
    }
    return { modules: drawn.size, triangles, fullest, coarser };
  }
}
