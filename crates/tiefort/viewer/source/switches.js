// The switches, by mouse or by key.
import * as looks from "./materials.js";
import { at, note, showLegend } from "./panel.js";
import { unpick } from "./pick.js";

const KEYS = {
  KeyT: "wireframe", KeyM: "lines", KeyG: "dem", KeyF: "fly", KeyH: "chase", KeyJ: "facets", KeyU: "texture",
  KeyI: "imagery", Digit0: "objects",
};
const PANELS = { KeyY: "layers", KeyO: "figures" };
/** The lowest place of the light's slider means light as on maps. */
const AS_ON_MAPS = 5;

/** Listens to the switches of a view; gives what a key does, and whether it was one of theirs. */
export function switches(view, { light }) {
  const { area, terrain, tank, map } = view;
  const shown = () => {
    const colors = at("colors").value, is = (id) => at(id).checked;
    if (colors !== terrain.colors) map.repaint(colors === "going" || colors === "levels" ? "height" : colors);
    terrain.show({ colors, lines: is("lines") });
    view.houses.show(is("objects"));
    terrain.showObjects(is("objects"));
    looks.setLook({
      wireframe: is("wireframe"), facets: is("facets"), range: view.range, going: colors === "going",
      texture: is("texture") && (colors === "height" || colors === "going"),
    });
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
      note(`The DEM cannot be read: ${fault.message}`);
      at("layers").open = true;
    }
    at("splitter").hidden = !terrain.withDem;
    shown();
  };
  const range = () => {
    view.range = Number(at("range").value);
    at("range").nextElementSibling.textContent = `${view.range / 1000} km`;
    shown();
  };
  const imagery = () => view.imagery.show(at("imagery").checked, Number(at("strength").value));
  const hour = () => {
    const value = Number(at("hour").value), minutes = String(60 * (value % 1)).padStart(2, "0");
    view.hour = value <= AS_ON_MAPS ? null : value;
    at("hour").nextElementSibling.textContent = view.hour === null ? "as on a map" : `${Math.floor(value)}:${minutes}`;
    light();
  };
  const looked = ["colors", "wireframe", "lines", "facets", "texture", "objects"];
  for (const id of looked) at(id).addEventListener("change", shown);
  at("dem").addEventListener("change", dem);
  at("imagery").addEventListener("change", imagery);
  at("strength").addEventListener("input", imagery);
  at("fly").addEventListener("change", () => tank.takeOff(at("fly").checked));
  at("chase").addEventListener("change", () => (tank.chases = at("chase").checked));
  at("range").addEventListener("input", range);
  at("hour").addEventListener("input", hour);
  const { all } = terrain.counts(), drawnOnly = area.buildings ? ", drawn only" : "";
  at("objects").parentElement.hidden = !(all || area.buildings);
  at("past").parentElement.hidden = !all;
  at("standing").textContent = all ? `buildings and woods: ${all.toLocaleString("en-US")}` : `buildings${drawnOnly}`;
  at("range").value = view.range;
  range();
  hour();
  imagery();
  return ({ code }) => {
    if (code === "KeyC") {
      at("colors").selectedIndex = (at("colors").selectedIndex + 1) % at("colors").length;
      shown();
    } else if (KEYS[code]) at(KEYS[code]).click();
    else if (PANELS[code]) at(PANELS[code]).open = !at(PANELS[code]).open;
    else return false;
    return true;
  };
}
