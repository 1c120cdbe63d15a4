// The tools: line of sight, viewshed, distance and profile, a place by its coordinates, pictures, tracks, links.
import { DataTexture, NearestFilter, RGBAFormat } from "three";
import { askPlace, askProfile, askSight, askViewshed } from "./ask.js";
import { drawProfile, profileInWords } from "./chart.js";
import { linkOf } from "./link.js";
import { Marks } from "./marks.js";
import { setOverlay } from "./materials.js";
import { at, tell } from "./panel.js";
import { hitAt, placeOf } from "./pick.js";
import { recorder, savePicture } from "./shot.js";

const FREE = [0.35, 1, 0.45], HIDDEN = [1, 0.25, 0.2], LINE = [1, 0.88, 0.3];
/** Of places that are seen and that are not: what is laid over the ground, and how much of it. */
const SEEN = [90, 220, 100, 95], DARK = [28, 10, 40, 135];
/** Metres between places of a viewshed at least, and places along its side at most. */
const SPACING_M = 25, SIDE_MAX = 1001;
/** Heights of a profile at most, and metres between them at least. */
const STEPS = 400, STEP_M = 1;
const HINTS = {
  sight: "click the eye, then the place it looks at", measure: "click where the line begins, then where it ends",
};
/** How lines of sight are looked along. */
const looking = () => ({ objects: at("past").value, curvature: at("curved").checked });
/** Keys of the tools, by the ids of their buttons. */
export const TOOL_KEYS = {
  KeyR: "sight", KeyV: "viewshed", KeyP: "measure", KeyK: "picture", KeyZ: "record", KeyL: "link",
};

export class Tools {
  constructor(view) {
    Object.assign(this, { view, mode: null, first: null, marks: new Marks(view), overlay: null, answer: null });
    const record = recorder(view);
    for (const mode of ["sight", "measure"]) at(mode).addEventListener("click", () => this.choose(mode));
    at("viewshed").addEventListener("click", () => this.tried(() => this.viewshed()));
    at("picture").addEventListener("click", () => savePicture(view));
    at("record").addEventListener("click", () => {
      this.tried(async () => {
        const count = await record();
        tell(count === null ? "recording; press again to save the track" : `${count} places saved`);
      });
    });
    at("link").addEventListener("click", () => this.tried(() => this.link()));
    at("goto").addEventListener("submit", (event) => {
      event.preventDefault();
      this.tried(() => this.go(at("place").value));
    });
  }

  /** Chooses what clicks mean; the same again gives it up. */
  choose(mode) {
    this.mode = this.mode === mode ? null : mode;
    this.first = null;
    for (const id of Object.keys(HINTS)) at(id).setAttribute("aria-pressed", id === this.mode);
    tell(this.mode ? HINTS[this.mode] : "");
  }

  /** Forgets everything that was asked. */
  clear() {
    if (this.mode) this.choose(this.mode);
    this.marks.clear();
    setOverlay(null);
    this.overlay?.dispose();
    [this.overlay, this.answer] = [null, null];
    at("viewshed").setAttribute("aria-pressed", false);
    tell("");
  }

  /** Says what went wrong, where something did. */
  async tried(what) {
    try {
      await what();
    } catch (fault) {
      tell(fault.message);
    }
  }

  /** A click at a place of the window; whether it was one of a tool's. */
  click(x, y) {
    if (!this.mode) return false;
    const hit = hitAt(this.view, x, y);
    if (!hit) return true;
    const { east, north, above, isWall } = placeOf(this.view, hit), place = this.view.area.inSystem(east, north);
    const end = { place, above, isWall };
    if (!this.first) {
      this.first = end;
      this.marks.draw([[[...place, hit.point.y], [...place, hit.point.y + 30], LINE]]);
      return true;
    }
    const [from, mode] = [this.first, this.mode];
    this.first = null;
    this.tried(() => (mode === "sight" ? this.sight(from, end) : this.measure(from.place, place)));
    return true;
  }

  /** Whether one end sees another: each stands on what was clicked, or is the place of a wall itself. */
  async sight(from, to) {
    const end = ({ place, above, isWall }, height) => [...place, isWall ? above : above + Number(at(height).value)];
    const found = await askSight(end(from, "eye"), end(to, "target"), looking());
    if (found.visible === null) throw new Error("the line leaves the area");
    const { visible, blocker, ends, hidden_by: by, clearance_m: clearance, wood_m: wood, transmission } = found;
    this.marks.draw(visible ? [[...ends, FREE]] : [[ends[0], blocker, FREE], [blocker, ends[1], HIDDEN]]);
    const away = (place) => Math.hypot(place[0] - ends[0][0], place[1] - ends[0][1]).toFixed(0);
    this.answer = found;
    const left = `${(100 * transmission).toFixed(0)} % of the light`;
    const woods = wood === 0 ? "" : `; ${wood.toFixed(1)} m in woods leave ${left}`;
    tell(`${visible ? "visible" : `hidden by ${by}, first ${away(blocker)} m from the eye`}; ${away(ends[1])} m apart; `
      + `clearance ${clearance === null ? "unknown" : `${clearance.toFixed(2)} m`}${woods}`);
  }

  async measure(from, to) {
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]), spacing = Math.max(length / STEPS, STEP_M);
    const found = await askProfile(from, to, spacing), { along_m: along, height_m: heights } = found;
    const place = (i) => {
      const share = along[i] / (along.at(-1) || 1);
      return [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]), heights[i] ?? 0];
    };
    this.marks.draw(along.slice(1).map((_, i) => [place(i), place(i + 1), LINE]));
    this.answer = found;
    tell(profileInWords(found), (canvas) => drawProfile(canvas, found));
  }

  /** What is seen from where the observer stands, on the ground or on a deck, or from above the ground below. */
  async viewshed() {
    if (this.overlay) return this.clear();
    const { area, tank } = this.view, place = area.inSystem(tank.east, tank.north);
    const above = (height) => this.view.terrain.aboveGround(tank.east, tank.north, height ?? -Infinity);
    const eye = tank.flies && at("aloft").checked ? above(tank.altitude)
      : above(tank.flies ? null : tank.height) + Number(at("eye").value);
    tell("looking …");
    const target = Number(at("target").value), range = 1000 * (Number(at("reach").value) || 5);
    const spacing = Math.max(SPACING_M, Math.ceil((2 * range) / (SIDE_MAX - 1)));
    const found = await askViewshed([...place, eye], target, range, spacing, looking()), { side, seen } = found;
    const data = new Uint8Array(4 * side * side);
    seen.forEach((what, i) => {
      const [row, col] = [Math.floor(i / side), i % side], isEdge = row % (side - 1) === 0 || col % (side - 1) === 0;
      if (what <= 1 && !isEdge) data.set(what === 1 ? SEEN : DARK, 4 * i);
    });
    // Pressed twice before the answer, it is asked twice.
    this.overlay?.dispose();
    this.overlay = new DataTexture(data, side, side, RGBAFormat);
    this.overlay.magFilter = NearestFilter;
    this.overlay.needsUpdate = true;
    const reach = (side / 2) * spacing;
    setOverlay(this.overlay, tank.east - reach, tank.north + reach, side * spacing);
    const count = seen.filter((what) => what === 1).length, all = seen.filter((what) => what <= 1).length;
    at("viewshed").setAttribute("aria-pressed", true);
    this.answer = { seen: count, places: all };
    tell(`seen from ${eye.toFixed(1)} m above the ground: ${((100 * count) / all).toFixed(1)} % within `
      + `${range / 1000} km${looking().curvature ? " on the round earth" : ""}, `
      + `${((count * spacing * spacing) / 1e6).toFixed(2)} km²`);
  }

  async go(words) {
    const place = await askPlace(words), { area, tank } = this.view;
    tank.goTo(...area.fromSystem(...place));
    tell(`at ${place.map((metres) => metres.toFixed(1)).join(", ")}`);
    this.view.renderer.domElement.focus();
  }

  async link() {
    const link = new URL(linkOf(this.view), location.href).href;
    history.replaceState(null, "", link);
    await navigator.clipboard?.writeText(link).catch(() => null);
    tell("the address now opens this place and view");
  }
}
