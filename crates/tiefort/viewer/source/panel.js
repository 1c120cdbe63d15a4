// Words and figures beside the picture.
import { legendOf } from "./colors.js";

export const at = (id) => document.getElementById(id);
const grouped = (number) => Math.round(number).toLocaleString("en-US");
const degrees = (radians) => (radians * 180) / Math.PI;

/** The counters: rows of a name and a value. */
export function showFigures(area, { tank, loaded, view, under, frameMs, houses, objects }) {
  const limits = area.limits, place = area.inSystem(tank.east, tank.north).map((metres) => metres.toFixed(0));
  const here = under ? `${under.module.row},${under.module.col}` : "–";
  const count = under ? `${under.count} of ${limits.per_load_module}` : "–";
  const heading = ((degrees(tank.heading + (tank.flies ? tank.turned : 0)) % 360) + 360) % 360;
  const tilt = (tank.tilt ?? [0, 0]).map((angle) => degrees(angle).toFixed(1));
  const rows = [
    ["east, north", `${place[0]}, ${place[1]}`],
    ["height", tank.height === null ? "–" : `${(tank.flies ? tank.altitude : tank.height).toFixed(1)} m`],
    ["heading, speed", `${heading.toFixed(0)}°, ${(3.6 * Math.abs(tank.speed)).toFixed(0)} km/h`],
    ["pitch, roll", tank.flies ? "in flight" : `${tilt[0]}°, ${tilt[1]}°`],
    ["driven", `${(tank.driven / 1000).toFixed(2)} km`],
    ["load modules", `${grouped(loaded.modules)} of ${grouped(area.rows * area.cols)}`],
    ["triangles loaded", grouped(loaded.triangles)],
    ["triangles in view", `${grouped(view.triangles)} in ${view.modules}`],
    [`${limits.count} in ${here}`, count],
    [`fullest ${limits.window.rows} x ${limits.window.cols}`,
      `${loaded.fullest === null ? "–" : grouped(loaded.fullest)} of ${grouped(limits.window.limit)}`],
    ["frame", `${frameMs.toFixed(1)} ms`],
  ];
  if (1 < area.levels) {
    const { modules, triangles } = loaded.coarser;
    rows.splice(7, 0, ["farther, coarser", `${grouped(triangles)} in ${grouped(modules)}`]);
  }
  if (area.buildings) rows.splice(-1, 0, ["buildings drawn", `${grouped(houses.drawn)} of ${grouped(houses.all)}`]);
  if (objects.all) {
    rows.splice(-1, 0, ["objects drawn", `${grouped(objects.drawn)} of ${grouped(objects.all)}`],
      ["trees nearby", grouped(objects.trees)]);
  }
  const table = at("figures").querySelector("table");
  while (table.rows.length < rows.length) [0, 1].forEach(((row) => () => row.insertCell())(table.insertRow()));
  rows.forEach((row, i) => row.forEach((words, j) => {
    if (table.rows[i].cells[j].textContent !== words) table.rows[i].cells[j].textContent = words;
  }));
}

export function showName(area) {
  at("figures").querySelector("summary").textContent = `${area.name}, ${area.crs}`;
  document.title = `${area.name} - tiefort view`;
}

const WINDS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];

/** What is always seen: heading, height, speed and gear. */
export function showHud({ tank }) {
  const heading = ((degrees(tank.heading + tank.turned) % 360) + 360) % 360;
  const wind = WINDS[Math.round(heading / 45) % WINDS.length];
  const above = tank.height === null ? "" : ` (${Math.max(tank.altitude - tank.height, 0).toFixed(0)} m above ground)`;
  const height = tank.flies ? `${tank.altitude.toFixed(0)} m${above}` : `${tank.height?.toFixed(1) ?? "-"} m`;
  const speed = `${(3.6 * Math.abs(tank.speed)).toFixed(0)} km/h`;
  const meets = !tank.flies && tank.meets ? ` \u00b7 ${tank.meets}` : "";
  const gear = `gear ${tank.gear + 1}${meets}`;
  const words = `${wind} ${heading.toFixed(0)}\u00b0 \u00b7 ${height} \u00b7 ${speed} \u00b7 ${gear}`;
  const place = at("hud").querySelector("span");
  if (place.textContent !== words) place.textContent = words;
}

/** The scale of colours. */
export function showLegend(area, colors, showsDem) {
  const [stops, low, high] = legendOf(area, colors, showsDem);
  at("legend").querySelector("i").style.background = `linear-gradient(to right, ${stops.join(", ")})`;
  at("legend").querySelector("span").replaceChildren(...[low, high].map((words) => {
    const element = document.createElement("em");
    element.textContent = words;
    return element;
  }));
  const sea = at("legend").querySelector("div");
  sea.hidden = colors !== "height" || !area.hasSea;
  sea.querySelector("b").style.background = area.palette.water;
}

/** What was clicked: a triangle of a load module, or a load module that is drawn coarsely. */
export function showPicked(area, picked) {
  const box = at("picked");
  box.style.display = picked ? "block" : "none";
  if (!picked) return;
  at("answer").style.display = "none";
  const { row, col, level, place, triangle, thing, above } = picked, figures = area.figures(row, col);
  const [east, north] = area.inSystem(place[0], place[1]);
  const metres = (value) => (Number.isNaN(value) ? "no post measured" : `${value.toFixed(2)} m`);
  const lines = [
    `Load module ${row},${col}`,
    `${figures.triangles} triangles, ${figures.polygons} polygons`,
    `limit ${area.limits.per_load_module} ${area.limits.count}`,
    `residual RMS ${metres(figures.rms)}, largest ${metres(figures.largest)}`,
    `${east.toFixed(1)} E, ${north.toFixed(1)} N, ${place[2].toFixed(2)} m`,
  ];
  if (thing) {
    lines.push(`${thing}, ${above.toFixed(2)} m above the ground`);
  } else if (triangle) {
    const slope = degrees(Math.acos(Math.min(triangle.normal[2], 1)));
    const kind = triangle.className === undefined ? "" : `, class ${triangle.className}`;
    if (level) lines.push(`drawn at level ${level}`);
    lines.push(`triangle ${triangle.number}: slope ${slope.toFixed(1)}°${kind}`);
    if (triangle.residual !== undefined) lines.push(`residual at the nearest post ${metres(triangle.residual)}`);
  } else {
    lines.push("drawn coarsely: out of range");
  }
  box.replaceChildren(...lines.map((words, i) => {
    const element = document.createElement(i === 0 ? "strong" : "div");
    element.textContent = words;
    return element;
  }));
}

/** What a tool answers: words, and a drawing where `draw` makes one on a canvas. */
export function tell(words, draw) {
  const box = at("answer");
  box.style.display = words ? "block" : "none";
  if (words) at("picked").style.display = "none";
  const [line, canvas] = [document.createElement("div"), document.createElement("canvas")];
  line.textContent = words;
  box.replaceChildren(...(draw ? [line, canvas] : [line]));
  draw?.(canvas);
}

export function note(words) {
  at("note").textContent = words;
}

export function wrong(words) {
  at("wrong").style.display = words ? "block" : "none";
  at("wrong").textContent = words ?? "";
}
