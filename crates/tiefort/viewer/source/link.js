// Place, view and layers in the address, so that a link opens what was seen.
import { at } from "./panel.js";

const degrees = (radians) => (radians * 180) / Math.PI, radians = (degrees) => (degrees * Math.PI) / 180;
const SWITCHES = ["wireframe", "lines", "facets", "texture", "objects", "dem"];
const BY_DEFAULT = ["texture", "objects"];
/** Milliseconds between two changes of the address: browsers refuse a hundred in half a minute. */
const EVERY_MS = 700;

/** What the address asks for; a number that is missing is not a number. */
export function asked(area) {
  const words = new URLSearchParams(location.search);
  const number = (name) => (words.has(name) ? Number(words.get(name)) : NaN);
  const place = area.fromSystem(number("east"), number("north"));
  const [west, south, far, top] = area.sides, clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  return {
    place: place.every(Number.isFinite) ? [clamp(place[0], west, far), clamp(place[1], south, top)] : null,
    heading: radians(number("heading") || 0), turned: radians(number("look") || 0), pitch: radians(number("pitch")),
    height: number("height"), range: number("range"), hour: number("hour"), colors: words.get("colors"),
    chases: words.get("eye") !== "hatch", imagery: number("imagery"),
    layers: words.has("layers") ? words.get("layers").split(" ") : null,
  };
}

/** Sets the switches that the address names. */
export function setSwitches({ colors, layers, chases, hour, imagery }) {
  if ([...at("colors").options].some((option) => option.value === colors)) at("colors").value = colors;
  if (layers) for (const id of SWITCHES) if (id !== "dem") at(id).checked = layers.includes(id);
  at("chase").checked = chases;
  if (Number.isFinite(hour)) at("hour").value = hour;
  if (Number.isFinite(imagery)) {
    at("imagery").checked = 0 < imagery;
    if (0 < imagery) at("strength").value = imagery;
  }
}

/** The address of what is seen now. */
export function linkOf({ area, tank, range, hour, imagery }) {
  const [east, north] = area.inSystem(tank.east, tank.north), words = new URLSearchParams();
  const round = (value, digits) => String(Number(value.toFixed(digits)));
  words.set("east", round(east, 1));
  words.set("north", round(north, 1));
  words.set("heading", round(((degrees(tank.heading) % 360) + 360) % 360, 1));
  if (tank.turned !== 0) words.set("look", round(degrees(tank.turned), 1));
  words.set("pitch", round(degrees(tank.pitch), 1));
  if (tank.flies) words.set("height", round(tank.altitude, 1));
  else if (!tank.chases) words.set("eye", "hatch");
  if (range !== area.range_m) words.set("range", String(range));
  if (hour !== null) words.set("hour", String(hour));
  if (at("colors").value !== "height") words.set("colors", at("colors").value);
  const strength = at("imagery").checked ? Number(at("strength").value) : 0;
  if (imagery.levels.length !== 0 && strength !== 1) words.set("imagery", String(strength));
  const layers = SWITCHES.filter((id) => at(id).checked);
  if (String(layers) !== String(BY_DEFAULT)) words.set("layers", layers.join(" "));
  return `${location.pathname}?${words}`;
}

/** Keeps the address that of what is seen; gives what each picture calls. */
export function follower(view) {
  let [last, then] = ["", 0];
  return (now) => {
    if (now - then < EVERY_MS || view.tank.drifts || view.tank.height === null) return;
    then = now;
    const link = linkOf(view);
    if (link !== last) history.replaceState(null, "", link);
    last = link;
  };
}
