// The page of `tiefort view`: one picture after another, and what hangs together by that.
import { askWhere } from "./ask.js";
import { drawingOn } from "./canvas.js";
import { Casts } from "./casts.js";
import { controls } from "./controls.js";
import { skyBelowHorizon } from "./crack.js";
import { helpList } from "./help.js";
import { Houses } from "./houses.js";
import { Imagery } from "./imagery.js";
import { asked, follower, setSwitches } from "./link.js";
import { SmallMap } from "./map.js";
import * as looks from "./materials.js";
import { at, note, showFigures, showHud, showName, wrong } from "./panel.js";
import { pick } from "./pick.js";
import { coarseAt, scenicPlace } from "./scenic.js";
import { readArea } from "./server.js";
import { sunAt } from "./sun.js";
import { switches } from "./switches.js";
import { Tank } from "./tank.js";
import { Terrain } from "./terrain.js";
import { TOOL_KEYS, Tools } from "./tools.js";
import { Trees } from "./trees.js";

/** Seconds that one picture may stand for, so that a slow machine drives slowly and not in leaps. */
const STEP_SECONDS_MAX = 0.25;
/** Milliseconds between two tables of figures, and two pictures of the map. */
const FIGURES_MS = 250, MAP_MS = 100;
/** Pictures whose milliseconds a test may ask for. */
const FRAMES_KEPT = 600;

export async function start() {
  // While the server answers, the canvas is made ready.
  const reading = readArea(), drawing = drawingOn(at("scene")), area = await reading;
  showName(area);
  const view = viewOf(area, drawing), { scene, tank, terrain } = view;
  const wanted = asked(area);
  begin(view, wanted);
  const light = lighting(view);
  // For the sun's height; where the area lies nowhere on the globe, a middle one will do.
  askWhere(area.inSystem(0, 0)).then(({ latitude }) => (area.latitude = latitude)).catch(() => null);
  setSwitches(wanted);
  const listens = switches(view, { light });
  const help = helpList(), tools = new Tools(view);
  const search = (event) => {
    event.preventDefault();
    at("tools").open = true;
    at("place").select();
  };
  const keys = (event) => {
    if (event.key === "?") help();
    else if (event.code === "Escape") tools.clear();
    else if (TOOL_KEYS[event.code]) at(TOOL_KEYS[event.code]).click();
    else if (event.code === "KeyN") search(event);
    else if (event.code === "KeyX") tank.level();
    else if (/^Digit[1-4]$/.test(event.code)) tank.shift(Number(event.code.at(-1)) - 1);
    else listens(event);
  };
  const touch = () => {
    at("keys").classList.add("gone");
    if (tank.drifts) [tank.drifts, tank.speed] = [false, 0];
  };
  const wishes = controls(view.renderer.domElement, tank, {
    pick: (x, y) => tools.click(x, y) || pick(view, x, y), press: keys, touch,
  });
  at("help").addEventListener("click", help);
  at("horizon").addEventListener("click", () => tank.level());
  view.imagery.begin().catch((fault) => note(`The imagery could not be read: ${fault.message}`));
  scene.add(terrain.group, view.houses.group, view.trees.group, tank.model);
  run(view, wishes);
  // What a test asks, and whoever is curious in the console.
  window.tiefort = {
    state: () => ({ ...state(view), answer: tools.answer, tool: tools.mode }),
    skyBelowHorizon: () => skyBelowHorizon(view),
  };
}

function viewOf(area, drawing) {
  const { renderer, scene, sky } = drawing, terrain = new Terrain(area), tank = new Tank(terrain, 0, 0, 0);
  looks.setPalette(area);
  scene.add(sky);
  const view = { ...drawing, area, terrain, tank, range: area.range_m, hour: null };
  // Changes with what tools put into the scene; pictures drawn, and milliseconds of the last ones.
  Object.assign(view, { version: 0, count: 0, frames: [], frameMs: 0, drew: false });
  [view.mapAt, view.figuresAt] = [-Infinity, -Infinity];
  [view.houses, view.trees, view.casts, view.imagery] =
    [new Houses(area), new Trees(drawing.pace.isSoft), new Casts(), new Imagery(area, renderer)];
  view.map = new SmallMap(area, at("map").querySelector("canvas"), (east, north) => tank.goTo(east, north));
  return view;
}

/** Begins where the address says, else in flight at the most scenic place, nearing it slowly. */
function begin(view, wanted) {
  const { area, tank } = view, { place, heading, turned, pitch, height, range } = wanted;
  if (Number.isFinite(range)) view.range = range;
  if (!place) {
    const scenic = scenicPlace(area);
    Object.assign(tank, scenic, { flies: true, drifts: true, pitch: -0.1 });
  } else {
    Object.assign(tank, { east: place[0], north: place[1], heading, turned, chases: wanted.chases });
    if (Number.isFinite(pitch)) tank.pitch = pitch;
    if (Number.isFinite(height)) Object.assign(tank, { flies: true, altitude: height });
    else tank.altitude = (coarseAt(area, ...place) ?? 0) + 60;
  }
  at("fly").checked = tank.flies;
}

/** Lights the ground: at once by the coarse heights, then by those that the worker reads. */
function lighting(view) {
  const { area } = view, worker = new Worker("/viewer.js", { type: "module" });
  let isRead = false;
  worker.onmessage = ({ data }) => {
    if (data.fault) note(`The relief could not be read: ${data.fault}`);
    else looks.setRelief(area, data);
    view.lit = true;
  };
  return () => {
    const sun = sunAt(view.hour, area.latitude ?? 40);
    looks.setSun(area, sun);
    view.sun = sun;
    worker.postMessage({ sideM: isRead ? null : area.side_m, sun });
    isRead = true;
  };
}

function run(view, wishes) {
  const follow = follower(view);
  let last = performance.now();
  view.renderer.setAnimationLoop((now) => {
    const passed = Math.max(now - last, 0);
    last = now;
    view.frameMs += 0.1 * (passed - view.frameMs);
    frame(view, passed, wishes(), now);
    follow(now);
  });
}

function frame(view, passed, wish, now) {
  const { area, renderer, scene, camera, terrain, tank, map, range } = view;
  const seconds = Math.min(passed / 1000, STEP_SECONDS_MAX);
  terrain.drawSome();
  terrain.follow(tank.east, tank.north, range);
  view.imagery.follow(tank.east, tank.north);
  if (tank.height === null) tank.settle();
  else tank.step(seconds, wish);
  tank.place(camera);
  view.houses.follow(tank.east, tank.north);
  view.trees.follow(terrain, tank.east, tank.north);
  looks.setFrame(now / 1000, tank.east, tank.north, tank.flies || !tank.chases ? 0 : 4.5);
  looks.setSplit(Number(at("split").value));
  const version = `${terrain.version} ${looks.version()} ${view.version} ${view.houses.version} ${view.trees.version}`;
  if (view.pace.draws(camera, version, now)) {
    view.casts.draw(view, now);
    looks.setWidth(renderer.domElement.width);
    renderer.render(scene, camera);
    if (view.drew) view.pace.took(passed);
    view.drew = true;
    view.count += 1;
    view.frames.push(passed);
    if (FRAMES_KEPT < view.frames.length) view.frames.shift();
    // The first picture waits for nothing else.
    if (view.count === 1) return;
  } else view.drew = false;
  if (MAP_MS < now - view.mapAt) {
    view.mapAt = now;
    map.draw(terrain.block, tank, range);
    showHud(view);
  }
  if (FIGURES_MS < now - view.figuresAt) {
    view.figuresAt = now;
    if (at("figures").open) showFigures(area, figures(view));
    wrong(terrain.fault && `Load modules could not be read: ${terrain.fault}`);
  }
}

/** What is loaded, seen and stood on. */
function figures({ terrain, tank, camera, range, frameMs, houses, trees }) {
  const under = terrain.under(tank.east, tank.north, tank.ceiling());
  if (under) under.count = terrain.count(under.module);
  const view = terrain.inView(camera, tank.east, tank.north, range);
  const objects = { ...terrain.counts(), trees: trees.count };
  return { tank, under, frameMs, loaded: terrain.loaded(), view, houses: houses.counts(), objects };
}

/** Everything a test wants to know. */
function state(view) {
  const { area, terrain, tank, picked } = view, { under, loaded, view: seen, objects } = figures(view);
  const [east, north] = area.inSystem(tank.east, tank.north);
  return {
    east, north, height: tank.height, heading: tank.heading, tilt: tank.tilt, driven: tank.driven, speed: tank.speed,
    block: terrain.block, loaded: [...terrain.fine().keys()], waiting: terrain.asked.size, fault: terrain.fault,
    showsDem: terrain.withDem, isOnDeck: under?.isDeck, modules: loaded.modules, triangles: loaded.triangles,
    coarser: [...terrain.drawn.values()].filter(({ module }) => module.level !== 0)
      .map(({ module }) => [module.level, module.row, module.col, module.counts.triangles]),
    houses: view.houses.counts(), objects, meets: tank.meets,
    blocks: terrain.blocks, fullest: loaded.fullest, view: seen, frameMs: view.frameMs, picked,
    flies: tank.flies, altitude: tank.altitude, turned: tank.turned, pitch: tank.pitch, gear: tank.gear,
    drifts: tank.drifts, lit: view.lit === true, frames: view.frames, count: view.count,
    imagery: { levels: view.imagery.levels.length, drawn: view.imagery.drawn, isWhole: view.imagery.isWhole },
    pixelRatio: view.renderer.getPixelRatio(), ...view.renderer.info.memory, inScene: geometriesIn(view.scene),
  };
}

/** The geometries of a scene: the renderer should hold no others. */
function geometriesIn(scene) {
  const all = new Set();
  scene.traverse(({ geometry }) => geometry && all.add(geometry));
  return all.size;
}
