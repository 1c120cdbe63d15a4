// The page of `tiefort view`: one picture after another, and what hangs together by that.
import {
  BufferGeometry, Color, DirectionalLight, Float32BufferAttribute, Fog, HemisphereLight, LineBasicMaterial, LineLoop,
  PerspectiveCamera, Raycaster, Scene, Vector2, WebGLRenderer,
} from "three";
import { controls } from "./controls.js";
import { SmallMap } from "./map.js";
import { at, note, showFigures, showLegend, showName, showPicked, wrong } from "./panel.js";
import { readArea } from "./server.js";
import { Tank } from "./tank.js";
import { Terrain } from "./terrain.js";
import { skyBelowHorizon } from "./crack.js";

const FOG_M = [4_000, 90_000], EYE_DEGREES = 55, NEAR_M = 1, FAR_M = 500_000;
/** Seconds that one picture may stand for, so that a slow machine drives slowly and not in leaps. */
const STEP_SECONDS_MAX = 0.25;

async function start() {
  const area = await readArea();
  showName(area);
  const canvas = at("scene");
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  const scene = new Scene();
  // As at the horizon of the server's pictures: blue is water only.
  const sky = new Color(area.palette.sky.at(-1));
  scene.background = sky;
  scene.fog = new Fog(sky, ...FOG_M);
  const sun = new DirectionalLight(0xfff4e0, 2.3);
  sun.position.set(-1, 1.1, -1);
  scene.add(sun, new HemisphereLight(0xf0eee8, 0x77705c, 1.4));
  const camera = new PerspectiveCamera(EYE_DEGREES, 1, NEAR_M, FAR_M);
  const terrain = new Terrain(area);
  const tank = new Tank(terrain, ...startPlace(area));
  scene.add(terrain.group, tank.model);
  const view = { area, renderer, scene, camera, terrain, tank, range: area.range_m, frameMs: 0 };
  view.map = new SmallMap(area, at("map").querySelector("canvas"), (east, north) => {
    Object.assign(tank, { east, north, speed: 0 });
    tank.height = null;
  });
  const wishes = controls(canvas, tank, { pick: (x, y) => pick(view, x, y), press: switches(view) });
  const fit = () => {
    renderer.setSize(innerWidth, innerHeight, false);
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
  };
  addEventListener("resize", fit);
  fit();
  let last = performance.now();
  renderer.setAnimationLoop((now) => {
    const passed = Math.max(now - last, 0);
    last = now;
    view.frameMs += 0.1 * (passed - view.frameMs);
    frame(view, Math.min(passed / 1000, STEP_SECONDS_MAX), wishes());
  });
  // What a test asks, and whoever is curious in the console.
  window.tiefort = { state: () => state(view), skyBelowHorizon: () => skyBelowHorizon(view) };
}

/** Where the tank begins: the middle of the area, or what the address says (?east=…&north=…&heading=…). */
function startPlace(area) {
  const asked = new URLSearchParams(location.search);
  const number = (name) => (asked.has(name) ? Number(asked.get(name)) : NaN);
  const place = area.fromSystem(number("east"), number("north"));
  const [east, north] = place.every(Number.isFinite) ? place : [area.side_m / 2, area.side_m / 2];
  const [west, south, far, top] = area.sides;
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  return [clamp(east, west, far), clamp(north, south, top), ((number("heading") || 0) * Math.PI) / 180];
}

function frame(view, seconds, wish) {
  const { area, renderer, scene, camera, terrain, tank, map, range } = view;
  terrain.follow(tank.east, tank.north, range);
  if (tank.height === null) tank.settle();
  else tank.step(seconds, wish);
  tank.place(camera);
  renderer.render(scene, camera);
  map.draw(terrain.block, tank, range);
  const under = terrain.under(tank.east, tank.north, tank.ceiling());
  if (under) under.count = terrain.count(under.module);
  view.figures = {
    tank, under, frameMs: view.frameMs, loaded: terrain.loaded(),
    view: terrain.inView(camera, tank.east, tank.north, range),
  };
  showFigures(area, view.figures);
  wrong(terrain.fault && `Load modules could not be read: ${terrain.fault}`);
}

/** The switches, by mouse or by key; gives what a key does. */
function switches(view) {
  const { area, terrain, tank, map } = view;
  const shown = () => {
    const colors = at("colors").value;
    if (colors !== terrain.colors) map.repaint(colors);
    terrain.show({ colors, wireframe: at("wireframe").checked, lines: at("lines").checked });
    showLegend(area, colors, terrain.withDem);
  };
  const dem = async () => {
    note(at("dem").checked ? "reading the ground …" : "");
    try {
      await terrain.showDem(at("dem").checked);
      unpick(view);
      note("");
    } catch (fault) {
      at("dem").checked = false;
      note(`The DEM is not at hand: ${fault.message}`);
    }
    shown();
  };
  const range = () => {
    view.range = Number(at("range").value);
    at("range").nextElementSibling.textContent = `${view.range / 1000} km`;
  };
  for (const id of ["colors", "wireframe", "lines"]) at(id).addEventListener("change", shown);
  at("dem").addEventListener("change", dem);
  at("fly").addEventListener("change", () => tank.takeOff(at("fly").checked));
  at("chase").addEventListener("change", () => (tank.chases = at("chase").checked));
  at("range").addEventListener("input", range);
  at("range").value = new URLSearchParams(location.search).get("range") ?? area.range_m;
  range();
  shown();
  const keys = { KeyT: "wireframe", KeyM: "lines", KeyG: "dem", KeyF: "fly", KeyH: "chase" };
  return (code) => {
    if (code === "KeyC") {
      at("colors").selectedIndex = (at("colors").selectedIndex + 1) % at("colors").length;
      shown();
    } else if (keys[code]) at(keys[code]).click();
  };
}

/** Reads the triangle under the pointer, and outlines it. */
function pick(view, x, y) {
  const { area, scene, camera, terrain } = view;
  const rays = new Raycaster();
  rays.setFromCamera(new Vector2((2 * x) / innerWidth - 1, 1 - (2 * y) / innerHeight), camera);
  const meshes = [...terrain.drawn.values()].map(({ mesh }) => mesh);
  const [hit] = rays.intersectObjects([...meshes, terrain.coarse.mesh], false);
  unpick(view);
  if (!hit) return;
  const place = [hit.point.x, -hit.point.z, hit.point.y], [row, col] = area.moduleAt(place[0], place[1]);
  const found = terrain.drawn.get(hit.object.userData.key);
  if (!found) return showPicked(area, { row, col, place });
  const { module, surface } = found, number = hit.faceIndex, positions = [];
  for (const vertex of surface.triangles.subarray(3 * number, 3 * number + 3)) {
    const [east, north, up] = surface.points.subarray(3 * vertex, 3 * vertex + 3);
    positions.push(east, up + 0.4, -north);
  }
  const outline = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(positions, 3));
  view.outline = new LineLoop(outline, new LineBasicMaterial({ color: 0xff3d9a, depthTest: false }));
  scene.add(view.outline);
  const normal = [hit.face.normal.x, -hit.face.normal.z, hit.face.normal.y];
  const isTin = surface === module.tin;
  const ofClass = isTin ? module.classes[number] : undefined;
  const className = ofClass === area.hole ? "hole" : (area.classes[ofClass] ?? ofClass);
  const residual = isTin ? undefined : surface.residuals[nearest(surface, number, place)];
  const { row: ownRow, col: ownCol, level } = module;
  view.picked = { row: ownRow, col: ownCol, level, place, triangle: { number, normal, className, residual } };
  showPicked(area, view.picked);
}

/** Forgets what was clicked. */
function unpick(view) {
  if (view.outline) view.scene.remove(view.outline);
  view.outline = view.picked = undefined;
  showPicked(view.area, null);
}

/** The corner of a triangle that a place is nearest to. */
function nearest({ points, triangles }, number, [east, north]) {
  const away = (vertex) => Math.hypot(points[3 * vertex] - east, points[3 * vertex + 1] - north);
  return [...triangles.subarray(3 * number, 3 * number + 3)].reduce((a, b) => (away(b) < away(a) ? b : a));
}

/** Everything a test wants to know. */
function state(view) {
  const { area, terrain, tank, figures, picked } = view;
  const [east, north] = area.inSystem(tank.east, tank.north);
  return {
    east, north, height: tank.height, heading: tank.heading, tilt: tank.tilt, driven: tank.driven, speed: tank.speed,
    block: terrain.block, loaded: [...terrain.fine().keys()], waiting: terrain.asked.size, fault: terrain.fault,
    showsDem: terrain.withDem, isOnDeck: figures?.under?.isDeck, modules: figures?.loaded.modules, triangles: figures?.loaded.triangles,
    coarser: [...terrain.drawn.values()].filter(({ module }) => module.level !== 0)
      .map(({ module }) => [module.level, module.row, module.col, module.counts.triangles]),
    blocks: terrain.blocks, fullest: figures?.loaded.fullest, view: figures?.view, frameMs: view.frameMs, picked,
  };
}

start().catch((fault) => wrong(`The area could not be shown: ${fault.message}`));
